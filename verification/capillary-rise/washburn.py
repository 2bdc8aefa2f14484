"""Level in the middle between two plates that a viscous liquid rises between without gravity.

Lucas (1918), Kolloid-Z. 23, 15, and Washburn (1921), Phys. Rev. 17, 273, doi:10.1103/PhysRev.17.273, between plates a width w apart:
l^2 = l_0^2 + sigma w cos(theta) t/(3 mu) for the mean level l. In the first of the eight cells between the middle and a plate the circular meniscus
is lower. Writes `reference.csv` of this folder to the standard output: t [s], level there [m].
"""
import math

SIGMA, MU, WIDTH, THETA, FIRST, CELLS = 0.05, 0.1, 2e-3, math.radians(60), 4e-3, 8
half = WIDTH / 2
radius = half / math.cos(THETA)


def mean(width):
    """Mean height of the arc above its foot over this distance from the middle."""
    return radius - (width * math.sqrt(radius**2 - width**2) / 2 + radius**2 * math.asin(width / radius) / 2) / width


lower = mean(half) - mean(half / CELLS)
print("t,middle")
for n in range(1, 16):
    t = 0.05 * n
    level = math.sqrt(FIRST**2 + SIGMA * WIDTH * math.cos(THETA) * t / (3 * MU))
    print(f"{t:.2f},{level - lower:.6e}")
