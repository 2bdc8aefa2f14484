"""Momentum of the water in a basin that is swayed from rest, by linear waves: writes reference.csv to standard output."""
from math import pi, sin, tanh

LENGTH, DEPTH, WIDTH, DENSITY, GRAVITY = 0.1, 0.05, 0.04375, 1000.0, 9.81
AMPLITUDE, FREQUENCY, RAMP, END, EVERY, DT = -1e-3, 2.0, 0.5, 1.5, 5e-3, 1e-4


def place(t):
    s = min(max(t, 0.0) / RAMP, 1.0)
    return AMPLITUDE * (3 * s**2 - 2 * s**3) * sin(2 * pi * FREQUENCY * t)


def acceleration(t, e=1e-4):
    return (place(t + e) - 2 * place(t) + place(t - e)) / e**2


# Elevation a_n cos(k_n x): a_n'' + g k tanh(k h) a_n = k tanh(k h) 4 L/(n pi)^2 X''.
modes = {n * pi / LENGTH: [0.0, 0.0] for n in range(1, 13, 2)}
print("wave,t,momentum")
for step in range(round(END / DT) + 1):
    if step % round(EVERY / DT) == 0:
        momentum = -2 * DENSITY * WIDTH * sum(rate / k**2 for k, (_, rate) in modes.items())
        print(f"linear,{step * DT:.3f},{momentum:.5e}")
    push = acceleration((step + 0.5) * DT)
    for k, mode in modes.items():
        stiffness, weight = GRAVITY * k * tanh(k * DEPTH), k * tanh(k * DEPTH) * 4 / (LENGTH * k**2)
        mode[1] += 0.5 * DT * (weight * push - stiffness * mode[0])
        mode[0] += DT * mode[1]
        mode[1] += 0.5 * DT * (weight * push - stiffness * mode[0])
