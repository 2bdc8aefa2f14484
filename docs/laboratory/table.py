"""Prints the table of the laboratory: `python table.py [test ...] [key=value ...] [--scheme dirichlet] [--radius 2.6]`.

Tests: wave drop vortices still tilted dam dam-fine square drops. Keys are the constants of `scheme.Conjugate`.
"""
import argparse
import math
import numpy as np
from scipy.spatial import cKDTree
from scheme import Box, Conjugate, Dirichlet

PI = math.pi


class Burst(Exception):
    pass


def lattice(nx, ny):
    return np.array([[i+0.5, j+0.5] for i in range(nx) for j in range(ny)])


def disc(radius):
    ticks = np.arange(-radius-1, radius+1)+0.5
    return np.array([[i, j] for i in ticks for j in ticks if math.hypot(i, j) < radius])


def advance(sim, dt, limit):
    sim.step(dt)
    speed = np.hypot(*sim.u.T).max()
    if not speed < limit:
        raise Burst(f'burst at {sim.time:.3g}, energy {sim.energy():.3g}')
    return speed


def nearest(sim):
    return cKDTree(sim.x).query(sim.x, 2)[0][:, 1].min()


def angular(sim):
    return (sim.x[:, 0]*sim.u[:, 1]-sim.x[:, 1]*sim.u[:, 0]).sum()


def wave(make, layers=10):
    """First mode, L = 2 h, amplitude 0.02 h, 2.5 periods; viscosity in m2/s for h = 0.05 m."""
    spacing, n = 0.05/layers, 2*layers
    g, k = 9.81/spacing, PI/n
    omega = math.sqrt(g*k*math.tanh(k*layers))
    x, speed = lattice(n, layers), 0.02*layers*omega/math.sinh(k*layers)
    mode = speed*np.stack([-np.cosh(k*x[:, 1])*np.sin(k*x[:, 0]), np.sinh(k*x[:, 1])*np.cos(k*x[:, 0])], 1)
    sim = make(x, mode, Box((0, 0), (n, None)), body=(0, -g))
    times, parts = [0.0], [(mode*mode).sum()]
    while sim.time < 2.5*2*PI/omega:
        advance(sim, 0.1/math.sqrt(g), 100*math.sqrt(g*layers))
        times.append(sim.time)
        parts.append((sim.u*mode).sum())
    t, a = np.array(times), np.array(parts)
    i = np.flatnonzero(a[:-1]*a[1:] < 0)
    zeros = t[i]-a[i]*(t[i+1]-t[i])/(a[i+1]-a[i])
    e = np.flatnonzero((np.abs(a[1:-1]) > np.abs(a[:-2])) & (np.abs(a[1:-1]) >= np.abs(a[2:])))+1
    rate = -np.polyfit(np.append(0, t[e]), np.log(np.abs(np.append(a[0], a[e]))), 1)[0]
    return dict(period=2*np.diff(zeros).mean()*omega/(2*PI), viscosity=rate/(2*k*k)*spacing**2)


def drop(make, radius=16):
    """Stretching drop to t A = 1 beside its exact ellipse."""
    x, state = disc(radius), np.array([radius, radius, 1.0])
    sim = make(x, x*[1, -1], Box())
    first, dt, most, middle = sim.energy(), 0.15/(2*radius), 0.0, []

    def slope(y):
        a, b, rate = y
        return np.array([rate*a, -rate*b, rate**2*(b*b-a*a)/(a*a+b*b)])
    while sim.time < 1-1e-9:
        k1 = slope(state)
        k2 = slope(state+dt/2*k1)
        k3 = slope(state+dt/2*k2)
        state = state+dt/6*(k1+2*k2+2*k3+slope(state+dt*k3))
        advance(sim, dt, 10*radius)
        most = max(most, sim.energy()/first)
        a, b, rate = state
        middle.append(sim.pressure[np.argsort(np.hypot(*sim.x.T))[:9]].mean()/(rate**2*a*a*b*b/(a*a+b*b)))
    exact = rate*sim.x*[1, -1]
    inside = (sim.x[:, 0]/a)**2+(sim.x[:, 1]/b)**2 < 0.7
    return dict(energy=sim.energy()/first, most=most, error=math.sqrt(((sim.u-exact)**2).sum()/(exact**2).sum()),
                pressure=np.mean(middle[-10:]), false_surface=int((sim.surface & inside).sum()), nearest=nearest(sim))


def vortices(make, n=50, reynolds=100):
    """Taylor-Green, periodic, to t U/L = 0.5."""
    def exact(x):
        p = 2*PI*x/n
        return n*np.stack([-np.cos(p[:, 0])*np.sin(p[:, 1]), np.sin(p[:, 0])*np.cos(p[:, 1])], 1)
    x = lattice(n, n)
    sim = make(x, exact(x), Box((0, 0), (n, n), True), viscosity=n*n/reynolds)
    first, rate = sim.energy(), 8*PI**2/reynolds
    while sim.time < 0.5:
        advance(sim, 0.15/n, 5*n)
    u = exact(sim.x)*math.exp(-rate*sim.time)
    return dict(decay=math.log(first/sim.energy())/(2*rate*sim.time),
                error=math.sqrt(((sim.u-u)**2).sum()/(u**2).sum()), nearest=nearest(sim))


def still(make, tilt=0.0, n=20):
    """Disordered or tilted water as in verification/mps-hydrostatics, spacing 1 mm: time 300 sqrt(l0/g) in all."""
    x = lattice(n, 2*n)
    x = x[x[:, 1] < n+tilt*(x[:, 0]-n/2)]
    if not tilt:
        x = x+0.1*np.random.default_rng(2).uniform(-1, 1, x.shape)
    sim = make(x, 0*x, Box((0, 0), (n, None)), body=(tilt, -1.0), viscosity=0.01)
    scale, largest, squares = math.sqrt(n), 0.0, []
    while sim.time < 300:
        speed = advance(sim, 0.1, 5*scale)
        if 50 < sim.time < 100:
            sim.u *= 0.9
        elif sim.time > 275:
            largest = max(largest, speed/scale)
            squares.append((sim.u**2).sum(1).mean()/n)
    down = sim.x@sim.body/math.hypot(*sim.body)
    top = np.sort(-down)[-n:].mean()+0.5
    error = np.abs(sim.pressure-math.hypot(*sim.body)*(top+down))/n
    return dict(largest=largest, rms=math.sqrt(np.mean(squares)), pressure_error=error.max())


def dam(make, nx=12, ny=24, far=5, until=8):
    """Column on a dry floor, far wall and splash; times t sqrt(2g/a) of the front at Z = 2, 3, 3.9.

    Martin and Moyce, verification/dam-break/reference.csv, interpolated: 1.73, 2.51, 3.12, less a shift of the clock."""
    sim = make(lattice(nx, ny), np.zeros((nx*ny, 2)), Box((0, 0), (far*nx, None)), body=(0.0, -1.0))
    first = before = most = sim.energy()
    gained, front, speed, fastest = 0.0, [], 0.0, 0.0
    while sim.time < until*math.sqrt(ny):
        speed = advance(sim, min(0.1, 0.15/max(speed, 1e-9)), 5*math.sqrt(2*ny))
        energy = sim.energy()
        gained, before, most = gained+max(energy-before, 0), energy, max(most, energy)
        fastest = max(fastest, speed)
        front.append((sim.time*math.sqrt(2/nx), sim.x[:, 0].max()/nx))
    t, z = np.array(front).T
    return dict(most=most/first, gained=gained/first, fastest=fastest/math.sqrt(2*ny),
                front=[round(float(np.interp(at, z, t)), 3) for at in (2, 3, 3.9)], clipped=sim.clipped)


def isolated(sim, until, speed):
    first, before, moment, gained, fastest = sim.energy(), sim.energy(), angular(sim), 0.0, speed
    push = sim.u.sum(0)
    while sim.time < until:
        fastest = advance(sim, 0.15/max(fastest, speed), 20*speed)
        gained, before = gained+max(sim.energy()-before, 0), sim.energy()
    return dict(energy=before/first, gained=gained/first, momentum=np.abs(sim.u.sum(0)-push).max()/speed/len(sim.x),
                angular=angular(sim)/moment, nearest=nearest(sim))


def square(make, n=24):
    x = lattice(n, n)-n/2
    return isolated(make(x, np.stack([x[:, 1], -x[:, 0]], 1), Box()), 1.5, n)


def drops(make, radius=10):
    """Two drops that collide off their axis."""
    one = disc(radius)
    x = np.concatenate([one, one+[2*radius+1, radius/2]])
    u = np.zeros_like(x)
    u[:len(one), 0], u[len(one):, 0] = radius, -radius
    return isolated(make(x, u, Box()), 1.5, radius)


TESTS = {'wave': wave, 'drop': drop, 'vortices': vortices, 'still': still, 'tilted': lambda m: still(m, 0.16), 'dam': dam,
         'dam-fine': lambda m: dam(m, 24, 48, 4, 5), 'square': square, 'drops': drops}


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument('--scheme', choices=['conjugate', 'dirichlet'], default='conjugate')
    options.add_argument('--radius', type=float, nargs='*', default=[2.1, 2.6, 3.1])
    options.add_argument('words', nargs='*', help='tests, and key=value')
    given = options.parse_args()
    keys = {k: float(v) for k, v in (word.split('=') for word in given.words if '=' in word)}
    scheme = {'conjugate': Conjugate, 'dirichlet': Dirichlet}[given.scheme]
    for name in [word for word in given.words if '=' not in word] or TESTS:
        for radius in given.radius:
            sims = []

            def make(x, u, box, **more):
                sims.append(scheme(x, u, box, radius, **more, **keys))
                return sims[0]
            try:
                found = TESTS[name](make)
            except Burst as burst:
                found = {'': burst}
            values = ' '.join(f'{k}={v:.4g}' if isinstance(v, float) else f'{k}={v}' for k, v in found.items())
            print(f'{given.scheme} r={radius} {name}: {values} iterations={sims[0].iterations/max(sims[0].steps, 1):.1f}', flush=True)


if __name__ == '__main__':
    main()
