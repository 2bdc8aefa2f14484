import numpy as np, numba as nb, math
from math import pi
nj = nb.njit(cache=True, fastmath=False)

@nj
def wval(r, R):
    q = r/R
    return (1-q)**4*(1+4*q) if q < 1 else 0.0
@nj
def sval(r, R):            # -w'/r
    q = r/R
    return 20*(1-q)**3/(R*R) if q < 1 else 0.0
@nj
def fval(r, R):            # max(w'',0)
    q = r/R
    if q >= 1: return 0.0
    return max(20*(1-q)**2*(4*q-1)/(R*R), 0.0)

def sums(R):               # lattice sums in 2D, spacing 1
    n0 = 0.; N1 = 0.; N2 = 0.; S = 0.; nx = 0.
    for i in range(-4, 5):
        for j in range(-4, 5):
            r = math.hypot(i, j)
            n0 += wval(r, R)
            if r > 0:
                N1 += sval(r, R)*r*r/2; N2 += fval(r, R)*r*r/4; S += sval(r, R)
    return n0, N1, N2, S

@nj
def neighbours(x, n, R):   # rows of the first n particles; all entries of x are columns
    m = len(x); R2 = R*R
    x0 = x[:, 0].min(); y0 = x[:, 1].min()
    nx = int((x[:, 0].max()-x0)/R)+1; ny = int((x[:, 1].max()-y0)/R)+1
    head = -np.ones(nx*ny, np.int64); nxt = np.empty(m, np.int64)
    for a in range(m):
        c = int((x[a, 0]-x0)/R)*ny+int((x[a, 1]-y0)/R)
        nxt[a] = head[c]; head[c] = a
    ptr = np.zeros(n+1, np.int64)
    col = np.empty(0, np.int64)
    for sweep in range(2):
        k = 0
        for a in range(n):
            ci = int((x[a, 0]-x0)/R); cj = int((x[a, 1]-y0)/R)
            for i in range(max(ci-1, 0), min(ci+2, nx)):
                for j in range(max(cj-1, 0), min(cj+2, ny)):
                    b = head[i*ny+j]
                    while b >= 0:
                        d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]
                        r2 = d0*d0+d1*d1
                        if r2 < R2 and b != a:
                            if sweep == 1: col[k] = b
                            k += 1
                        b = nxt[b]
            ptr[a+1] = k
        if sweep == 0: col = np.empty(k, np.int64)
    return ptr, col

class Box:
    """Images of particles: periodic or mirror walls in x, y; None is open. lo/hi of walls."""
    def __init__(s, lo=(None, None), hi=(None, None), periodic=(0, 0)):
        s.lo, s.hi, s.per = lo, hi, periodic
    def images(s, x, R):
        n = len(x); X = [x]; own = [np.arange(n)]; sg = [np.ones((n, 2))]
        for d in (0, 1):
            P = np.concatenate(X); O = np.concatenate(own); G = np.concatenate(sg)
            if s.per[d]:
                L = s.hi[d]-s.lo[d]
                for sh, k in ((L, P[:, d] < s.lo[d]+R), (-L, P[:, d] > s.hi[d]-R)):
                    Q = P[k].copy(); Q[:, d] += sh; X.append(Q); own.append(O[k]); sg.append(G[k])
            else:
                for w, k in ((s.lo[d], None if s.lo[d] is None else P[:, d] < s.lo[d]+R),
                             (s.hi[d], None if s.hi[d] is None else P[:, d] > s.hi[d]-R)):
                    if w is None: continue
                    Q = P[k].copy(); Q[:, d] = 2*w-Q[:, d]; H = G[k].copy(); H[:, d] *= -1
                    X.append(Q); own.append(O[k]); sg.append(H)
        return np.concatenate(X), np.concatenate(own), np.concatenate(sg)

@nj
def geometry(x, own, sg, u, ptr, col, R, n0, N1, lam, Rs=2.1, Ns=1.0):
    """Moments: B (2x2 inverse), smallest eigenvalue, divergence, number density, gradient of u, concentration gradient."""
    n = len(ptr)-1
    B = np.zeros((n, 2, 2)); ev = np.zeros(n); div = np.zeros(n); den = np.zeros(n); gu = np.zeros((n, 2, 2))
    cg = np.zeros((n, 2)); um = np.zeros(n); cnt = np.zeros(n, np.int64); bad = 0
    wd = wval(1.0, Rs)
    for a in range(n):
        m00 = 0.; m01 = 0.; m11 = 0.; den[a] = 1.0
        g00 = 0.; g01 = 0.; g10 = 0.; g11 = 0.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]
            d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; r = math.sqrt(d0*d0+d1*d1)
            s = sval(r, R)/N1; w = wval(r, R); den[a] += w
            if r < 2.1: cnt[a] += 1
            m00 += s*d0*d0; m01 += s*d0*d1; m11 += s*d1*d1
            e0 = u[o, 0]*sg[b, 0]-u[a, 0]; e1 = u[o, 1]*sg[b, 1]-u[a, 1]
            um[a] = max(um[a], e0*e0+e1*e1)
            g00 += s*e0*d0; g01 += s*e0*d1; g10 += s*e1*d0; g11 += s*e1*d1
            q = sval(r, Rs)/Ns*(1+0.2*(wval(r, Rs)/wd)**4)
            cg[a, 0] -= q*d0; cg[a, 1] -= q*d1      # -> away from neighbours
        um[a] = math.sqrt(um[a])
        det = m00*m11-m01*m01; tr = 0.5*(m00+m11)
        ev[a] = tr-math.sqrt(max(tr*tr-det, 0.0))
        # eigenvalues bounded below by lam: B of the bounded matrix
        if ev[a] > lam:
            B[a, 0, 0] = m11/det; B[a, 1, 1] = m00/det; B[a, 0, 1] = -m01/det; B[a, 1, 0] = -m01/det
        else:
            bad += 1
            B[a, 0, 0] = 1.; B[a, 1, 1] = 1.
        gu[a, 0, 0] = g00*B[a, 0, 0]+g01*B[a, 1, 0]; gu[a, 0, 1] = g00*B[a, 0, 1]+g01*B[a, 1, 1]
        gu[a, 1, 0] = g10*B[a, 0, 0]+g11*B[a, 1, 0]; gu[a, 1, 1] = g10*B[a, 0, 1]+g11*B[a, 1, 1]
        div[a] = gu[a, 0, 0]+gu[a, 1, 1]
    return B, ev, div, den, gu, cg, um, cnt, bad

@nj
def surface(x, ptr, col, ev, cnt, m):
    """0 inside, 1 surface, 2 isolated. Eigenvalue and cone as the code."""
    n = len(ptr)-1; f = np.zeros(n, np.int64); nrm = np.zeros((n, 2))
    for a in range(n):
        t0 = 0.; t1 = 0.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; r2 = d0*d0+d1*d1
            if r2 < 2.1*2.1:
                c = (1-r2/4.41)/math.sqrt(max(r2, 1e-30)); t0 += c*d0; t1 += c*d1
        l = math.sqrt(t0*t0+t1*t1)
        if l > 0: nrm[a, 0] = -t0/l; nrm[a, 1] = -t1/l
        if ev[a] > 0.5+2*m/3: continue
        if cnt[a] < 3: f[a] = 2; continue
        if ev[a] < 0.5*m: f[a] = 1; continue
        f[a] = 1
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; r2 = d0*d0+d1*d1
            if r2 < 2.1*2.1:
                al = d0*nrm[a, 0]+d1*nrm[a, 1]
                if al > 0 and al*al > 0.5*r2: f[a] = 0; break
    return f, nrm

# --- family D: conjugate gradient and divergence, pressure at every particle, natural surface ---
@nj
def adj_grad(p, x, own, sg, ptr, col, B, R, N1):
    n = len(ptr)-1; g = np.zeros((n, 2))
    for a in range(n):
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]
            d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; s = sval(math.sqrt(d0*d0+d1*d1), R)/N1
            sx = sg[b, 0]*sg[b, 1]
            c00 = p[a]*B[a, 0, 0]+p[o]*B[o, 0, 0]; c01 = p[a]*B[a, 0, 1]+p[o]*B[o, 0, 1]*sx
            c11 = p[a]*B[a, 1, 1]+p[o]*B[o, 1, 1]
            g[a, 0] += s*(c00*d0+c01*d1); g[a, 1] += s*(c01*d0+c11*d1)
    return g
@nj
def divergence(u, x, own, sg, ptr, col, B, R, N1):
    n = len(ptr)-1; q = np.zeros(n)
    for a in range(n):
        h0 = 0.; h1 = 0.; t = 0.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]
            d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; s = sval(math.sqrt(d0*d0+d1*d1), R)/N1
            e0 = u[o, 0]*sg[b, 0]-u[a, 0]; e1 = u[o, 1]*sg[b, 1]-u[a, 1]
            t += s*(e0*(B[a, 0, 0]*d0+B[a, 0, 1]*d1)+e1*(B[a, 1, 0]*d0+B[a, 1, 1]*d1))
        q[a] = t
    return q
@nj
def compact(p, x, own, ptr, col, B, R, N1, S, c):
    """-L p, L = sum (b_i+b_j) s (p_j-p_i), missing neighbours have zero pressure, weight c."""
    n = len(ptr)-1; q = np.zeros(n)
    for a in range(n):
        t = 0.; st = 0.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]
            d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; s = sval(math.sqrt(d0*d0+d1*d1), R)/N1
            t += 2*s*(p[a]-p[o]); st += s
        q[a] = t+2*c*max(S/N1-st, 0.0)*p[a]
    return q
@nj
def solve_adj(rhs, p, x, own, sg, ptr, col, B, R, N1, S, eps, c, tol, itmax):
    """(D D^T + eps*(compact)) p = rhs by CG; rhs = -rho/dt*div."""
    n = len(p)
    def_d = 2*S/N1
    A = -divergence(adj_grad(p, x, own, sg, ptr, col, B, R, N1), x, own, sg, ptr, col, B, R, N1)*(1-eps)
    if eps > 0: A += eps*compact(p, x, own, ptr, col, B, R, N1, S, c)
    r = rhs-A; d = r.copy(); rr = (r*r).sum(); it = 0
    while it < itmax and np.abs(r).max() > tol:
        q = -divergence(adj_grad(d, x, own, sg, ptr, col, B, R, N1), x, own, sg, ptr, col, B, R, N1)*(1-eps)
        if eps > 0: q += eps*compact(d, x, own, ptr, col, B, R, N1, S, c)
        al = rr/(d*q).sum(); p = p+al*d; r = r-al*q
        r2 = (r*r).sum(); d = r+(r2/rr)*d; rr = r2; it += 1
    return p, it

# --- family of consistent operators with Dirichlet surface ---
@nj
def rows(x, own, ptr, col, f, R, N1, N2, form, comp):
    """Coefficients of the Laplacian: form 0 HL, 1 Brookshaw; diag completed if comp."""
    n = len(ptr)-1; c = np.zeros(len(col)); diag = np.zeros(n)
    for a in range(n):
        if f[a] != 0: continue
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]
            if f[own[b]] == 2: continue
            d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; r = math.sqrt(d0*d0+d1*d1)
            c[k] = fval(r, R)/N2 if form == 0 else 2*sval(r, R)/N1
            diag[a] += c[k]
    return c, diag
@nj
def cg_dirichlet(rhs, p, own, ptr, col, f, c, diag, tol, itmax):
    n = len(p); r = np.zeros(n); z = np.zeros(n); d = np.zeros(n); q = np.zeros(n)
    for a in range(n):
        if f[a] == 0 and diag[a] > 0:
            t = diag[a]*p[a]
            for k in range(ptr[a], ptr[a+1]): t -= c[k]*p[own[col[k]]]
            r[a] = rhs[a]-t; z[a] = r[a]/diag[a]
    d[:] = z; rz = (r*z).sum(); it = 0
    p = p.copy()
    while it < itmax and np.abs(r).max() > tol:
        for a in range(n):
            q[a] = 0.
            if f[a] == 0 and diag[a] > 0:
                t = diag[a]*d[a]
                for k in range(ptr[a], ptr[a+1]): t -= c[k]*d[own[col[k]]]
                q[a] = t
        al = rz/(d*q).sum(); p += al*d; r -= al*q
        for a in range(n): z[a] = r[a]/diag[a] if diag[a] > 0 else 0.0
        r2 = (r*z).sum(); d = z+(r2/rz)*d; rz = r2; it += 1
    return p, it
@nj
def gc_grad(p, x, own, sg, ptr, col, f, R, lam):
    """GC of the MPS: M^-1 sum w/r^2 (p_j-p_i) r."""
    n = len(ptr)-1; g = np.zeros((n, 2))
    for a in range(n):
        if f[a] == 2: continue
        m00 = 0.; m01 = 0.; m11 = 0.; h0 = 0.; h1 = 0.; sw = 0.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]
            if f[o] == 2: continue
            d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; r2 = d0*d0+d1*d1
            w = wval(math.sqrt(r2), R)/r2; dp = p[o]-p[a]; sw += w*r2
            m00 += w*d0*d0; m01 += w*d0*d1; m11 += w*d1*d1; h0 += w*dp*d0; h1 += w*dp*d1
        det = m00*m11-m01*m01
        if det > lam*sw*sw/4:
            g[a, 0] = (m11*h0-m01*h1)/det; g[a, 1] = (m00*h1-m01*h0)/det
        elif sw > 0:
            g[a, 0] = 2*h0/sw; g[a, 1] = 2*h1/sw
    return g
@nj
def lap_u(u, x, own, sg, ptr, col, R, N2):
    n = len(ptr)-1; q = np.zeros((n, 2))
    for a in range(n):
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]
            d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; c = fval(math.sqrt(d0*d0+d1*d1), R)/N2
            q[a, 0] += c*(u[o, 0]*sg[b, 0]-u[a, 0]); q[a, 1] += c*(u[o, 1]*sg[b, 1]-u[a, 1])
    return q

class Sim:
    """Lengths in spacings, density 1 (masses 1)."""
    def __init__(s, x, u, box, R, scheme='K', g=(0., 0.), nu=0., **o):
        s.x, s.u, s.box, s.R, s.scheme, s.g, s.nu = x.copy(), u.copy(), box, R, scheme, np.array(g, float), nu
        s.n0, s.N1, s.N2, s.S = sums(R); s.t = 0.; s.p = np.zeros(len(x)); s.its = 0; s.steps = 0; s.mode = o.pop('mode', 'mid')
        s.o = dict(eps=0.0, c=1.0, lam=0.1, shift=0.0, form=0, ecs=1.0, interp=True, tol=1e-5, trelax=0.0, near=1, Rs=2.1); s.o.update(o)
        # next layer of the eigenvalue test
        s.m = sum(sval(math.hypot(i, 1), R) for i in range(-4, 5))/s.N1
        s.f = np.zeros(len(x), np.int64); s.wshift = 0.; s.closest = 9.; s.bad = 0; s.log = []
    def lists(s, x):
        X, own, sg = s.box.images(x, s.R); ptr, col = neighbours(X, len(x), s.R); return X, own, sg, ptr, col
    def energy(s): return 0.5*(s.u**2).sum()-(s.x@s.g).sum()
    def step(s, dt):
        o = s.o; R, N1 = s.R, s.N1; n = len(s.x)
        xp = s.x+{'start': 0., 'mid': .5, 'pred': 1.}[s.mode]*dt*s.u
        X, own, sg, ptr, col = s.lists(xp)
        us = s.u+dt*s.g
        if s.nu: us = us+dt*s.nu*lap_u(s.u, X, own, sg, ptr, col, R, s.N2)
        B, ev, div, den, gu, cg, um, cnt, bad = geometry(X, own, sg, us, ptr, col, R, s.n0, N1, o['lam'])
        f, nrm = surface(X, ptr, col, ev, cnt, s.m)
        s.f, s.den, s.ev, s.nrm, s.cnt = f, den, ev, nrm, cnt
        e = (den-s.n0)/(2*N1)
        T = o['trelax'] if o['trelax'] else 1e30
        src = div - o['ecs']*np.where(f == 0, e, 0.)/max(T, dt)
        if s.scheme == 'D':
            p, it = solve_adj(-src/dt, s.p, X, own, sg, ptr, col, B, R, N1, s.S, o['eps'], o['c'], o['tol']/dt, 400)
            g = adj_grad(p, X, own, sg, ptr, col, B, R, N1)
        else:
            c, diag = rows(X, own, ptr, col, f, R, N1, s.N2, o['form'], 0)
            # reduced pressure: p = 0 at the surface
            p = s.p.copy(); pi0 = -(xp@s.g)      # pi = p - g.x ; at surface pi = -g.x
            pin = np.where(f != 0, pi0, p)
            div0 = src-0.0
            uin = None
            # divergence of u* of reduced form is that of s.u (+viscosity): g has no divergence but at walls
            B2, ev2, div2, *_ = geometry(X, own, sg, us-dt*s.g, ptr, col, R, s.n0, N1, o['lam'])
            src = div2-(div-src)
            p, it = cg_dirichlet(-src/dt, pin, own, ptr, col, f, c, diag, o['tol']/dt, 400)
            if (f == 0).all(): p = p-p.mean()
            g = gc_grad(p, X, own, sg, ptr, col, f, R, 0.05)
            us = us-dt*s.g
            g[f == 2] = -s.g
        s.p = p; s.its += it; s.steps += 1; s.bad += bad
        un = us-dt*g
        s.work = ((un**2).sum()-(us**2).sum())/2
        xn = s.x+dt*un if s.mode != 'trap' else s.x+dt/2*(un+s.u)
        s.u = un
        if o['shift'] > 0:
            sh = o['shift']*s.shifts(xn, dt)
            if o['interp']:
                s.u = s.u+np.einsum('aij,aj->ai', s.gu, sh)
            e0 = (s.u**2).sum()/2
            xn = xn+sh
        s.x = xn; s.t += dt
        s.clip()
    def shifts(s, x, dt):
        o = s.o; R = s.R
        X, own, sg, ptr, col = s.lists(x)
        B, ev, div, den, gu, cg, um, cnt, bad = geometry(X, own, sg, s.u, ptr, col, R, s.n0, s.N1, o['lam'], o['Rs'], sums(o['Rs'])[1])
        f, nrm = surface(X, ptr, col, ev, cnt, s.m)
        s.gu = gu
        sh = R/2*dt*um[:, None]*cg     # R/2 ~ h
        # limit
        l = np.hypot(*sh.T); lim = 0.05
        sh *= np.minimum(1, lim/np.maximum(l, 1e-30))[:, None]
        # surface: tangential only
        near = f.copy()
        fx = np.concatenate([f, f[own[len(x):]]])
        k = f == 1
        sh[k] -= nrm[k]*(sh[k]*nrm[k]).sum(1)[:, None]
        sh[f == 2] = 0
        nr = has_surface(ptr, col, fx)
        k = (f == 0) & nr
        if o['near'] == 1:   # beside the surface: tangential to the mean normal of support
            m = -cg_normal(X, ptr, col, R)
            l = np.hypot(*m.T); m /= np.maximum(l, 1e-30)[:, None]
            sh[k] -= m[k]*np.maximum((sh[k]*m[k]).sum(1), 0)[:, None]*1.0
        elif o['near'] == 2: sh[k] = 0
        return sh
    def clip(s):
        for d in (0, 1):
            if s.box.per[d]:
                s.x[:, d] = s.box.lo[d]+np.mod(s.x[:, d]-s.box.lo[d], s.box.hi[d]-s.box.lo[d])
            else:
                for w, sgn in ((s.box.lo[d], 1), (s.box.hi[d], -1)):
                    if w is None: continue
                    k = (s.x[:, d]-w)*sgn < 0.1
                    s.x[k, d] = w+0.1*sgn; s.u[k, d] = np.where(s.u[k, d]*sgn < 0, 0, s.u[k, d])
                    s.nclip = getattr(s, 'nclip', 0)+k.sum()
@nj
def has_surface(ptr, col, fx):
    n = len(ptr)-1; q = np.zeros(n, np.bool_)
    for a in range(n):
        for k in range(ptr[a], ptr[a+1]):
            if fx[col[k]] != 0: q[a] = True; break
    return q
@nj
def cg_normal(x, ptr, col, R):
    n = len(ptr)-1; q = np.zeros((n, 2))
    for a in range(n):
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; s = sval(math.sqrt(d0*d0+d1*d1), R)
            q[a, 0] += s*d0; q[a, 1] += s*d1
    return q
