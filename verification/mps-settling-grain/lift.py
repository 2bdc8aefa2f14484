"""Speed to which the lift brings the grain at the edge of the jet of `case.toml` in 5 ms, by the laws of Saffman (1965) and Mei (1992).

The water keeps its velocity. Its mean and its vorticity at the grain are those that the method reads (docs/theory/mps.md): by the weights `l0^3 W/eps`, the
vorticity by least squares, over particles on their lattice, with which a sharp edge has the vorticity of one of some millimetres.
"""
from math import exp, hypot, pi, sqrt

D, SPACING, RADIUS, RHO, MU, JET, EDGE = 1e-3, 1e-3, 3e-3, 1000.0, 1e-3, 0.05, 37e-3
GRAIN, VOLUME, MASS = (7.63e-3, 7.38e-3, 37e-3), pi / 6 * D**3, 2650.0 * pi / 6 * D**3
STEP, END = 1e-5, 5e-3


def read():
    """Mean velocity [m/s] and shear across the edge [1/s]; the lattice is nearly even about the grain, so that cross moments count for little."""
    total = mean = way = square = product = 0.0
    for x, y, z in ((x, y, z) for x in range(15) for y in range(15) for z in range(45)):
        apart = [(n + 0.5) * SPACING - at for n, at in zip((x, y, z), GRAIN)]
        q = sqrt(sum(a * a for a in apart)) / RADIUS
        if q < 1:
            wendland = 21 / (2 * pi * RADIUS**3) * (1 - q) ** 4 * (1 + 4 * q)
            weight = SPACING**3 * wendland / (1 - VOLUME * wendland)
            up, u = apart[2], JET if (z + 0.5) * SPACING > EDGE else 0.0
            total, mean, way = total + weight, mean + weight * u, way + weight * up
            square, product = square + weight * up * up, product + weight * up * u
    return mean / total, (product - way * mean / total) / (square - way * way / total)


def speed(law):
    """Speed upwards [m/s] at the end."""
    mean, shear = read()
    along = up = 0.0
    for _ in range(round(END / STEP)):
        slip = (mean - along, -up)
        fast = hypot(*slip)
        reynolds, part = RHO * fast * D / MU, 0.3314 * sqrt(D * shear / (2 * fast))
        drag = 3 * pi * MU * D * (1 + 0.15 * reynolds**0.687)
        lift = 1.615 * D**2 * sqrt(RHO * MU * shear)
        if law == "mei":
            lift *= (1 - part) * exp(-reynolds / 10) + part
        along += STEP * (drag * slip[0] - lift * slip[1]) / MASS
        up += STEP * (drag * slip[1] + lift * slip[0]) / MASS
    return up


for law in ("saffman", "mei"):
    print(law, speed(law))
