"""Height of a capillary wave of small amplitude between two fluids of the same density and viscosity.

Prosperetti (1981), Phys. Fluids 24, 1217, eqs. (21)-(24), doi:10.1063/1.863522. Writes `reference.csv` of this folder to the standard output:
t [s], |a|/a_0, and the height of the highest crest in units of a_0 above the floor of `case.toml`.
"""
import cmath
import math

SIGMA, RHO, LENGTH, LAPLACE, A0, MEAN = 0.05, 1000.0, 1e-3, 3000.0, 1e-5, 150.0
K = 2 * math.pi / LENGTH
NU = math.sqrt(SIGMA * LENGTH / (LAPLACE * RHO))
W0 = math.sqrt(SIGMA * K**3 / (2 * RHO))
BETA = 0.25  # rho_1 rho_2 / (rho_1 + rho_2)^2


def scaled_erfc(z):
    """exp(z^2) erfc(z): by its series near zero, else by its continued fraction."""
    if z.real < 0:
        return 2 * cmath.exp(z * z) - scaled_erfc(-z)
    if abs(z) < 4:
        total, term, n = 0j, z, 0
        while n < 5 or abs(term) > 1e-18 * abs(total):
            total += term / (2 * n + 1)
            n += 1
            term *= -z * z / n
        return cmath.exp(z * z) * (1 - 2 / math.sqrt(math.pi) * total)
    fraction = 0j
    for n in range(80, 0, -1):
        fraction = (n / 2) / (z + fraction)
    return 1 / (math.sqrt(math.pi) * (z + fraction))


def roots(a, b, c, d):
    """Of z^4 + a z^3 + b z^2 + c z + d, all at once (Durand and Kerner)."""
    size = max(abs(a), abs(b) ** 0.5, abs(c) ** (1 / 3), abs(d) ** 0.25)
    found = [size * (0.4 + 0.9j) ** n for n in range(4)]
    for _ in range(400):
        for i, z in enumerate(found):
            others = [z - found[j] for j in range(4) if j != i]
            found[i] -= ((((z + a) * z + b) * z + c) * z + d) / (others[0] * others[1] * others[2])
    return found


NK = NU * K * K
ROOTS = roots(-4 * BETA * math.sqrt(NK), 2 * (1 - 6 * BETA) * NK, 4 * (1 - 3 * BETA) * NK**1.5, (1 - 4 * BETA) * NK**2 + W0**2)


def amplitude(t):
    """a(t)/a_0."""
    steady = 4 * (1 - 4 * BETA) * NK**2 / (8 * (1 - 4 * BETA) * NK**2 + W0**2) * math.erfc(math.sqrt(NK * t))
    total = 0j
    for i, z in enumerate(ROOTS):
        product = 1
        for j in range(4):
            product *= ROOTS[j] - z if j != i else 1
        total += z / product * W0**2 / (z * z - NK) * math.exp(-NK * t) * scaled_erfc(z * math.sqrt(t))
    return steady + total.real


if __name__ == "__main__":
    print("t,a,height")
    for n in range(251):
        t = n / 250 * 25 / W0
        a = abs(amplitude(max(t, 1e-18)))
        print(f"{t:.9g},{a:.9g},{MEAN + a:.9g}")
