"""Two semi-implicit particle schemes in two dimensions, to be compared in minutes (numpy and numba, one thread).

`Conjugate`: the pressure force is the negative transpose of the divergence (docs/decisions/0018-scheme-of-moving-particles.md).
`Dirichlet`: corrected HS, HL, GC, pressure zero at particles that a cone finds at the surface; same shifting and damping.
Lengths are in spacings, density and mass of a particle are 1. Walls are mirrors.
"""
import math
import numpy as np
from numba import njit

CLOSE = 2.1     # radius of the weight of shifting and of the surface test


@njit(cache=True)
def slope(r, radius):
    """-w'/r of the Wendland C2 weight."""
    return 20*(1-r/radius)**3/radius**2 if r < radius else 0.0


@njit(cache=True)
def weight(r, radius):
    return (1-r/radius)**4*(1+4*r/radius) if r < radius else 0.0


@njit(cache=True)
def curvature(r, radius):
    return max(20*(1-r/radius)**2*(4*r/radius-1)/radius**2, 0.0) if r < radius else 0.0


class Sums:
    """Sums over the square lattice that normalise the operators."""

    def __init__(self, radius):
        places = [(i, j) for i in range(-4, 5) for j in range(-4, 5) if i or j]
        r = np.array([math.hypot(i, j) for i, j in places])
        of = lambda f: np.array([f(a, radius) for a in r])
        self.density = 1+of(weight).sum()
        self.strain = (of(slope)*r*r).sum()/2
        self.laplacian = (of(curvature)*r*r).sum()/4
        self.support = of(slope).sum()/self.strain
        self.next_layer = sum(s for s, (i, j) in zip(of(slope), places) if j == 1)/self.strain


class Box:
    """Images in mirror walls or periodic sides at `low` and `high`; None where open."""

    def __init__(self, low=(None, None), high=(None, None), periodic=False):
        self.low, self.high, self.periodic = low, high, periodic

    def images(self, x, radius):
        """Particles and images, the particle behind each, and the signs of its velocity."""
        owner, sign = np.arange(len(x)), np.ones((len(x), 2))
        for d in (0, 1):
            parts = [(x, owner, sign)]
            for wall, other, side in ((self.low[d], self.high[d], 1), (self.high[d], self.low[d], -1)):
                if wall is None:
                    continue
                near = (x[:, d]-wall)*side < radius
                image, turned = x[near].copy(), sign[near].copy()
                if self.periodic:
                    image[:, d] += other-wall
                else:
                    image[:, d] = 2*wall-image[:, d]
                    turned[:, d] *= -1
                parts.append((image, owner[near], turned))
            x, owner, sign = (np.concatenate(column) for column in zip(*parts))
        return x, owner, sign

    def keep(self, x, u):
        """Wraps or clips to 0.2 spacings from a wall; returns the number clipped."""
        clipped = 0
        for d in (0, 1):
            if self.periodic:
                x[:, d] = self.low[d]+np.mod(x[:, d]-self.low[d], self.high[d]-self.low[d])
                continue
            for wall, side in ((self.low[d], 1), (self.high[d], -1)):
                if wall is not None:
                    out = (x[:, d]-wall)*side < 0.2
                    x[out, d] = wall+0.2*side
                    u[out, d] = np.where(u[out, d]*side < 0, 0, u[out, d])
                    clipped += int(out.sum())
        return clipped


@njit(cache=True)
def neighbours(x, rows, radius):
    """Lists of the first `rows` particles among all `x`: starts and columns."""
    x0, y0 = x[:, 0].min(), x[:, 1].min()
    nx, ny = int((x[:, 0].max()-x0)/radius)+1, int((x[:, 1].max()-y0)/radius)+1
    head, following = -np.ones(nx*ny, np.int64), np.empty(len(x), np.int64)
    for a in range(len(x)):
        cell = int((x[a, 0]-x0)/radius)*ny+int((x[a, 1]-y0)/radius)
        following[a], head[cell] = head[cell], a
    start, column = np.zeros(rows+1, np.int64), np.empty(0, np.int64)
    for fill in (False, True):
        k = 0
        for a in range(rows):
            ci, cj = int((x[a, 0]-x0)/radius), int((x[a, 1]-y0)/radius)
            for i in range(max(ci-1, 0), min(ci+2, nx)):
                for j in range(max(cj-1, 0), min(cj+2, ny)):
                    b = head[i*ny+j]
                    while b >= 0:
                        if b != a and (x[b, 0]-x[a, 0])**2+(x[b, 1]-x[a, 1])**2 < radius*radius:
                            if fill:
                                column[k] = b
                            k += 1
                        b = following[b]
            start[a+1] = k
        if not fill:
            column = np.empty(k, np.int64)
    return start, column


@njit(cache=True)
def first_pass(x, owner, sign, u, start, column, radius, strain, narrow, thinnest):
    """g_ij = s_ij r_ij, B = M^-1, grad u, number density, close neighbours, smallest eigenvalue of M, drift -grad C."""
    n = len(start)-1
    g, inverse, gradient = np.zeros((len(column), 2)), np.zeros((n, 2, 2)), np.zeros((n, 2, 2))
    density, close, eigenvalue, drift = np.ones(n), np.zeros(n, np.int64), np.zeros(n), np.zeros((n, 2))
    at_spacing = weight(1.0, CLOSE)
    for a in range(n):
        m, h = np.zeros((2, 2)), np.zeros((2, 2))
        for k in range(start[a], start[a+1]):
            b = column[k]
            d = x[b]-x[a]
            r = math.hypot(d[0], d[1])
            g[k] = slope(r, radius)/strain*d
            density[a] += weight(r, radius)
            close[a] += r < CLOSE
            drift[a] -= slope(r, CLOSE)/narrow*(1+0.2*(weight(r, CLOSE)/at_spacing)**4)*d
            for i in range(2):
                for j in range(2):
                    m[i, j] += g[k, i]*d[j]
                    h[i, j] += (u[owner[b], i]*sign[b, i]-u[a, i])*g[k, j]
        half, det = 0.5*(m[0, 0]+m[1, 1]), m[0, 0]*m[1, 1]-m[0, 1]*m[1, 0]
        eigenvalue[a] = half-math.sqrt(max(half*half-det, 0.0))
        if eigenvalue[a] > thinnest:
            inverse[a, 0, 0], inverse[a, 1, 1] = m[1, 1]/det, m[0, 0]/det
            inverse[a, 0, 1] = inverse[a, 1, 0] = -m[0, 1]/det
        else:
            inverse[a] = np.eye(2)
        gradient[a] = h@inverse[a]
    return g, inverse, gradient, density, close, eigenvalue, drift


@njit(cache=True)
def second_pass(x, owner, sign, u, gradient, start, column, radius, sums_density, laplacian, viscous, g, inverse):
    """Velocity change by viscosity, damping for a number of 1, mean of the neighbours' velocity gradients."""
    n = len(start)-1
    change, damping, stress, mean = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 2, 2)), gradient.copy()
    for a in range(n):
        total = 1.0
        for k in range(start[a], start[a+1]):
            b = column[k]
            d, v = x[b]-x[a], u[owner[b]]*sign[b]-u[a]
            r = math.hypot(d[0], d[1])
            w = weight(r, radius)
            total += w
            change[a] += viscous*curvature(r, radius)/laplacian*v
            rest = (v[0]*d[0]+v[1]*d[1])/r
            for i in range(2):
                for j in range(2):
                    other = gradient[owner[b], i, j]*sign[b, i]*sign[b, j]
                    mean[a, i, j] += w*other
                    rest -= 0.5*(gradient[a, i, j]+other)*d[i]*d[j]/r
            pull = w/sums_density*rest/r
            damping[a] += pull*d
            for i in range(2):
                for j in range(2):
                    stress[a, i, j] += pull*d[i]*d[j]
        mean[a] /= total
        stress[a] = stress[a]@inverse[a]
    for a in range(n):
        for k in range(start[a], start[a+1]):
            b = column[k]
            for i in range(2):
                for j in range(2):
                    other = stress[owner[b], i, j]*sign[b, i]*sign[b, j]
                    damping[a, i] -= 0.5*(stress[a, i, j]+other)*g[k, j]
    return change, damping, mean


@njit(cache=True)
def divergence(u, owner, sign, start, column, g, inverse):
    n = len(start)-1
    into = np.empty(n)
    for a in range(n):
        xx = xy = yy = 0.0
        for k in range(start[a], start[a+1]):
            b = column[k]
            o = owner[b]
            v0, v1 = u[o, 0]*sign[b, 0]-u[a, 0], u[o, 1]*sign[b, 1]-u[a, 1]
            xx += v0*g[k, 0]
            xy += v0*g[k, 1]+v1*g[k, 0]
            yy += v1*g[k, 1]
        into[a] = inverse[a, 0, 0]*xx+inverse[a, 0, 1]*xy+inverse[a, 1, 1]*yy
    return into


@njit(cache=True)
def transpose(p, owner, sign, start, column, g, inverse):
    """-D^T p = sum s_ij (B_i p_i + B_j p_j) r_ij."""
    n = len(start)-1
    into = np.zeros((n, 2))
    for a in range(n):
        s0 = s1 = 0.0
        for k in range(start[a], start[a+1]):
            b = column[k]
            o, cross = owner[b], sign[b, 0]*sign[b, 1]
            s0 += g[k, 0]
            s1 += g[k, 1]
            into[a, 0] += p[o]*(inverse[o, 0, 0]*g[k, 0]+cross*inverse[o, 0, 1]*g[k, 1])
            into[a, 1] += p[o]*(cross*inverse[o, 0, 1]*g[k, 0]+inverse[o, 1, 1]*g[k, 1])
        into[a, 0] += p[a]*(inverse[a, 0, 0]*s0+inverse[a, 0, 1]*s1)
        into[a, 1] += p[a]*(inverse[a, 0, 1]*s0+inverse[a, 1, 1]*s1)
    return into


@njit(cache=True)
def compact(p, x, owner, start, column, g, support):
    """2 sum s_ij (p_i - p_j), zero pressure where neighbours are missing."""
    n = len(start)-1
    into = np.empty(n)
    for a in range(n):
        total = there = 0.0
        for k in range(start[a], start[a+1]):
            b = column[k]
            s = math.hypot(g[k, 0], g[k, 1])/math.hypot(x[b, 0]-x[a, 0], x[b, 1]-x[a, 1])
            total += s*(p[a]-p[owner[b]])
            there += s
        into[a] = 2*(total+max(support-there, 0.0)*p[a])
    return into


@njit(cache=True)
def at_surface(x, start, column, eigenvalue, close, next_layer):
    """Surface by eigenvalue and cone (docs/decisions/0017-surface-test.md); isolated particles; outward normals."""
    n = len(start)-1
    surface, isolated, normal = np.zeros(n, np.bool_), np.zeros(n, np.bool_), np.zeros((n, 2))
    for a in range(n):
        for k in range(start[a], start[a+1]):
            d = x[column[k]]-x[a]
            r = math.hypot(d[0], d[1])
            if r < CLOSE:
                normal[a] -= (1-(r/CLOSE)**2)/r*d
        normal[a] /= max(math.hypot(normal[a, 0], normal[a, 1]), 1e-30)
        isolated[a] = close[a] < 3 and eigenvalue[a] <= 0.5+2*next_layer/3
        if eigenvalue[a] > 0.5+2*next_layer/3 or isolated[a]:
            continue
        surface[a] = True
        if eigenvalue[a] > 0.5*next_layer:
            for k in range(start[a], start[a+1]):
                d = x[column[k]]-x[a]
                along, r = d@normal[a], math.hypot(d[0], d[1])
                if r < CLOSE and along > 0 and 2*along*along > r*r:
                    surface[a] = False
                    break
    return surface, isolated, normal


@njit(cache=True)
def has_near(x, start, column, flags, radius):
    n = len(start)-1
    into = np.zeros(n, np.bool_)
    for a in range(n):
        for k in range(start[a], start[a+1]):
            b = column[k]
            if flags[b] and (x[b, 0]-x[a, 0])**2+(x[b, 1]-x[a, 1])**2 < radius*radius:
                into[a] = True
    return into


@njit(cache=True)
def row_sums(start, g):
    into = np.zeros((len(start)-1, 2))
    for a in range(len(into)):
        for k in range(start[a], start[a+1]):
            into[a] += g[k]
    return into


class Conjugate:
    """State and step of the scheme with conjugate operators; keywords are its constants."""

    def __init__(self, x, u, box, radius, body=(0., 0.), viscosity=0., compact=0.5, shifting=2.0, damping=0.2,
                 relaxation=1.0, carried=False, tolerance=1e-5):
        self.x, self.u, self.box, self.radius, self.body, self.viscosity = x.copy(), u.copy(), box, radius, np.array(body), viscosity
        self.share, self.shifting, self.damping, self.relaxation = compact, shifting, damping, relaxation
        self.carried, self.tolerance = carried, tolerance
        self.sums, self.narrow = Sums(radius), Sums(CLOSE).strain
        self.time, self.pressure, self.steps, self.iterations, self.clipped = 0.0, np.zeros(len(x)), 0, 0, 0

    def energy(self):
        return 0.5*(self.u**2).sum()-(self.x@self.body).sum()

    def flow_time(self):
        """That of the code: 0.15 spacings at three times the mean speed, or 0.05 sqrt(l0/g)."""
        force = math.hypot(*self.body)
        return min(0.05/max(np.hypot(*self.u.T).mean(), 1e-9), 0.05/math.sqrt(force) if force else 1e9)

    def step(self, dt):
        x, u, sums, radius = self.x, self.u, self.sums, self.radius
        image, owner, sign = self.box.images(x, radius)
        lists = neighbours(image, len(x), radius)
        g, inverse, gradient, density, close, eigenvalue, drift = first_pass(
            image, owner, sign, u, *lists, radius, sums.strain, self.narrow, 0.1)
        surface, isolated, normal = at_surface(image, *lists, eigenvalue, close, sums.next_layer)
        time = self.flow_time()
        change, damping, mean = second_pass(image, owner, sign, u, gradient, *lists, radius, sums.density, sums.laplacian,
                                            self.viscosity*dt, g, inverse)
        change += min(self.damping*dt/time, 0.5)*damping
        beside = surface | isolated | has_near(image, *lists, (surface | isolated)[owner], radius)
        strain = (density-sums.density)/(2*sums.strain)
        strain = self.relaxation*np.where(beside, np.maximum(strain, 0), strain)/(100*time)
        system = dict(image=image, owner=owner, sign=sign, lists=lists, g=g, inverse=inverse, surface=surface, isolated=isolated)
        self.u = self.project(u+change, strain, dt, **system)
        self.x = x+dt*self.u
        if self.shifting:
            rate = np.sqrt(((mean+mean.transpose(0, 2, 1))**2).sum((1, 2)))
            shift = self.shifting*1.5*dt*rate[:, None]*drift
            shift *= np.minimum(1, 0.05/np.maximum(np.hypot(*shift.T), 1e-30))[:, None]
            second = ~surface & has_near(image, *lists, (surface | isolated)[owner], CLOSE)
            outward = -row_sums(lists[0], g)
            outward /= np.maximum(np.hypot(*outward.T), 1e-30)[:, None]
            outward[surface] = normal[surface]
            free = surface | second
            shift[free] -= outward[free]*(shift*outward).sum(1)[free, None]
            shift[isolated] = 0
            self.x += shift
            if self.carried:
                self.u = self.u+np.einsum('aij,aj->ai', gradient, shift)
        self.clipped += self.box.keep(self.x, self.u)
        self.surface, self.time, self.steps = surface, self.time+dt, self.steps+1

    def project(self, u, strain, dt, image, owner, sign, lists, g, inverse, **_):
        """Velocity whose divergence is `strain`: conjugate gradients on (1-share) D D^T + share C."""
        u = u+dt*self.body
        operators = (owner, sign, *lists, g, inverse)

        def product(p):
            q = compact(p, image, owner, *lists, g, self.sums.support)*self.share if self.share > 0 else 0.0
            return q-(1-self.share)*divergence(transpose(p, *operators), *operators) if self.share < 1 else q
        self.solve(product, (strain-divergence(u, *operators))/dt, dt)
        return u-dt*transpose(self.pressure, *operators)

    def solve(self, product, right, dt, diagonal=1.0):
        p = self.pressure
        r = right-product(p)
        d, before = r/diagonal, (r*r/diagonal).sum()
        for _ in range(300):
            if np.abs(r).max() <= self.tolerance/dt:
                break
            q = product(d)
            alpha = before/(d*q).sum()
            p, r = p+alpha*d, r-alpha*q
            now = (r*r/diagonal).sum()
            d, before = r/diagonal+now/before*d, now
            self.iterations += 1
        self.pressure = p


@njit(cache=True)
def laplacian_rows(p, x, owner, start, column, known, left_out, radius, laplacian):
    """-HL at unknown particles, and its diagonal."""
    n = len(start)-1
    into, diagonal = np.zeros(n), np.ones(n)
    for a in range(n):
        if known[a]:
            continue
        total = 0.0
        for k in range(start[a], start[a+1]):
            b = column[k]
            if not left_out[owner[b]]:
                c = curvature(math.hypot(x[b, 0]-x[a, 0], x[b, 1]-x[a, 1]), radius)/laplacian
                total += c
                into[a] += c*(p[a]-p[owner[b]])
        diagonal[a] = max(total, 1e-12)
    return into, diagonal


@njit(cache=True)
def corrected_gradient(p, x, owner, start, column, left_out, radius):
    n = len(start)-1
    into = np.zeros((n, 2))
    for a in range(n):
        m, h, total = np.zeros((2, 2)), np.zeros(2), 0.0
        for k in range(start[a], start[a+1]):
            b = column[k]
            if left_out[a] or left_out[owner[b]]:
                continue
            d = x[b]-x[a]
            r = math.hypot(d[0], d[1])
            w = weight(r, radius)/(r*r)
            total += w*r*r
            h += w*(p[owner[b]]-p[a])*d
            for i in range(2):
                for j in range(2):
                    m[i, j] += w*d[i]*d[j]
        det = m[0, 0]*m[1, 1]-m[0, 1]*m[1, 0]
        if det > 0.05*total*total/4:
            into[a, 0], into[a, 1] = (m[1, 1]*h[0]-m[0, 1]*h[1])/det, (m[0, 0]*h[1]-m[0, 1]*h[0])/det
        elif total > 0:
            into[a] = 2*h/total
    return into


class Dirichlet(Conjugate):
    """The rival: corrected HS, HL and GC for the reduced pressure, zero total pressure at surface particles."""

    def project(self, u, strain, dt, image, owner, sign, lists, g, inverse, surface, isolated):
        known = surface | isolated
        self.pressure = np.where(known, -(self.x@self.body), self.pressure)
        rows = (*lists, known, isolated, self.radius, self.sums.laplacian)
        diagonal = laplacian_rows(self.pressure, image, owner, *rows)[1]
        right = np.where(known, 0.0, (strain-divergence(u, owner, sign, *lists, g, inverse))/dt)
        self.solve(lambda p: laplacian_rows(p, image, owner, *rows)[0], right, dt, diagonal)
        force = corrected_gradient(self.pressure, image, owner, *lists, isolated, self.radius)
        force[isolated] = -self.body
        return u-dt*force
