import numpy as np, math
from lab import nj, wval, sval, fval, sums, neighbours, Box, surface

@nj
def pass_a(x, own, sg, u, ptr, col, R, N1, lam, Rs, Ns, me):
    n = len(ptr)-1; gx = np.zeros((len(col), 2))
    B = np.zeros((n, 2, 2)); gu = np.zeros((n, 2, 2)); ev = np.zeros(n); den = np.ones(n); cnt = np.zeros(n, np.int64); bad = 0
    cg = np.zeros((n, 2)); wd = wval(1.0, Rs)
    for a in range(n):
        m00 = 0.; m01 = 0.; m11 = 0.; g00 = 0.; g01 = 0.; g10 = 0.; g11 = 0.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]; d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; r = math.sqrt(d0*d0+d1*d1)
            s = (1-r/R)**me/N1; den[a] += wval(r, R)
            if r < 2.1: cnt[a] += 1
            q = sval(r, Rs)/Ns*(1+0.2*(wval(r, Rs)/wd)**4)
            cg[a, 0] -= q*d0; cg[a, 1] -= q*d1
            d0s = s*d0; d1s = s*d1; gx[k, 0] = d0s; gx[k, 1] = d1s
            m00 += d0s*d0; m01 += d0s*d1; m11 += d1s*d1
            e0 = u[o, 0]*sg[b, 0]-u[a, 0]; e1 = u[o, 1]*sg[b, 1]-u[a, 1]
            g00 += e0*d0s; g01 += e0*d1s; g10 += e1*d0s; g11 += e1*d1s
        det = m00*m11-m01*m01; tr = 0.5*(m00+m11); ev[a] = tr-math.sqrt(max(tr*tr-det, 0.0))
        if ev[a] > lam: i00 = m11/det; i11 = m00/det; i01 = -m01/det
        else: i00 = 1.; i11 = 1.; i01 = 0.; bad += 1
        B[a, 0, 0] = i00; B[a, 1, 1] = i11; B[a, 0, 1] = i01; B[a, 1, 0] = i01
        gu[a, 0, 0] = g00*i00+g01*i01; gu[a, 0, 1] = g00*i01+g01*i11
        gu[a, 1, 0] = g10*i00+g11*i01; gu[a, 1, 1] = g10*i01+g11*i11
    return gx, B, gu, ev, den, cnt, cg, bad
@nj
def pass_b(x, own, sg, u, gu, ptr, col, R, N1, N2, nu_dt, chi, w0):
    """Change of velocity by viscosity (HL) and by the limited damping of what is not linear."""
    n = len(ptr)-1; du = np.zeros((n, 2))
    for a in range(n):
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]; d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; r = math.sqrt(d0*d0+d1*d1)
            e0 = u[o, 0]*sg[b, 0]-u[a, 0]; e1 = u[o, 1]*sg[b, 1]-u[a, 1]
            if nu_dt > 0:
                c = nu_dt*fval(r, R)/N2; du[a, 0] += c*e0; du[a, 1] += c*e1
            if chi > 0:
                sx = sg[b, 0]*sg[b, 1]
                h00 = gu[a, 0, 0]+gu[o, 0, 0]; h11 = gu[a, 1, 1]+gu[o, 1, 1]
                h = gu[a, 0, 1]+gu[a, 1, 0]+sx*(gu[o, 0, 1]+gu[o, 1, 0])
                l = (e0*d0+e1*d1)/r                                  # relative speed along the line of centres
                m = l-0.5*(h00*d0*d0+h*d0*d1+h11*d1*d1)/r            # less that of the linear field
                if l*m > 0:
                    if abs(m) > abs(l): m = l
                    c = chi*wval(r, R)/w0*m/r; du[a, 0] += c*d0; du[a, 1] += c*d1
    return du
@nj
def D(u, own, sg, ptr, col, gx, B):
    n = len(ptr)-1; q = np.empty(n)
    for a in range(n):
        h00 = 0.; h01 = 0.; h11 = 0.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]; e0 = u[o, 0]*sg[b, 0]-u[a, 0]; e1 = u[o, 1]*sg[b, 1]-u[a, 1]
            h00 += e0*gx[k, 0]; h01 += e0*gx[k, 1]+e1*gx[k, 0]; h11 += e1*gx[k, 1]
        q[a] = B[a, 0, 0]*h00+B[a, 0, 1]*h01+B[a, 1, 1]*h11
    return q
@nj
def Gr(p, own, sg, ptr, col, gx, B):
    n = len(ptr)-1; g = np.zeros((n, 2))
    for a in range(n):
        s0 = 0.; s1 = 0.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]; sx = sg[b, 0]*sg[b, 1]; s0 += gx[k, 0]; s1 += gx[k, 1]
            g[a, 0] += p[o]*(B[o, 0, 0]*gx[k, 0]+sx*B[o, 0, 1]*gx[k, 1])
            g[a, 1] += p[o]*(sx*B[o, 0, 1]*gx[k, 0]+B[o, 1, 1]*gx[k, 1])
        g[a, 0] += p[a]*(B[a, 0, 0]*s0+B[a, 0, 1]*s1); g[a, 1] += p[a]*(B[a, 0, 1]*s0+B[a, 1, 1]*s1)
    return g
@nj
def C(p, x, own, ptr, col, gx, S):
    """-compact Laplacian; what is missing of the support has pressure zero."""
    n = len(ptr)-1; q = np.empty(n)
    for a in range(n):
        t = 0.; st = 0.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; d0 = x[b, 0]-x[a, 0]; d1 = x[b, 1]-x[a, 1]; s = math.sqrt((gx[k, 0]**2+gx[k, 1]**2)/(d0*d0+d1*d1))
            t += s*(p[a]-p[own[b]]); st += s
        q[a] = 2*(t+max(S-st, 0.0)*p[a])
    return q
@nj
def solve(rhs, p, x, own, sg, ptr, col, gx, B, S, eps, tol, itmax):
    r = rhs-(1-eps)*-D(Gr(p, own, sg, ptr, col, gx, B), own, sg, ptr, col, gx, B)
    if eps > 0: r -= eps*C(p, x, own, ptr, col, gx, S)
    d = r.copy(); rr = (r*r).sum(); it = 0; p = p.copy()
    while it < itmax and np.abs(r).max() > tol:
        q = -(1-eps)*D(Gr(d, own, sg, ptr, col, gx, B), own, sg, ptr, col, gx, B)
        if eps > 0: q += eps*C(d, x, own, ptr, col, gx, S)
        al = rr/(d*q).sum(); p += al*d; r -= al*q; r2 = (r*r).sum(); d = r+(r2/rr)*d; rr = r2; it += 1
    return p, it
@nj
def beside(x, ptr, col, fx, rad):
    n = len(ptr)-1; q = np.zeros(n, np.bool_)
    for a in range(n):
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]
            if fx[b] != 0 and (x[b, 0]-x[a, 0])**2+(x[b, 1]-x[a, 1])**2 < rad*rad: q[a] = True; break
    return q

@nj
def Gd(p, own, ptr, col, gx, B):
    n = len(ptr)-1; g = np.zeros((n, 2))
    for a in range(n):
        h0 = 0.; h1 = 0.
        for k in range(ptr[a], ptr[a+1]):
            d = p[own[col[k]]]-p[a]; h0 += d*gx[k, 0]; h1 += d*gx[k, 1]
        g[a, 0] = B[a, 0, 0]*h0+B[a, 0, 1]*h1; g[a, 1] = B[a, 1, 0]*h0+B[a, 1, 1]*h1
    return g
@nj
def Gw(p, x, own, ptr, col, gx, B, gr):
    """As Gd with mirror images of hydrostatic pressure: p_image = p + gr.(x_image - x_owner)."""
    n = len(ptr)-1; g = np.zeros((n, 2))
    for a in range(n):
        h0 = 0.; h1 = 0.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; o = own[b]
            d = p[o]-p[a]
            if b != o: d += gr[0]*(x[b, 0]-x[o, 0])+gr[1]*(x[b, 1]-x[o, 1])
            h0 += d*gx[k, 0]; h1 += d*gx[k, 1]
        g[a, 0] = B[a, 0, 0]*h0+B[a, 0, 1]*h1; g[a, 1] = B[a, 1, 0]*h0+B[a, 1, 1]*h1
    return g

@nj
def least(x, own, ptr, col, rate):
    n = len(ptr)-1; q = rate.copy()
    for a in range(n):
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]
            if (x[b, 0]-x[a, 0])**2+(x[b, 1]-x[a, 1])**2 < 4.41: q[a] = min(q[a], rate[own[b]])
    return q
@nj
def mean(x, own, sg, ptr, col, gu, R):
    n = len(ptr)-1; q = gu.copy()
    for a in range(n):
        sw = 1.
        for k in range(ptr[a], ptr[a+1]):
            b = col[k]; w = wval(math.hypot(x[b, 0]-x[a, 0], x[b, 1]-x[a, 1]), R); sw += w
            for i in range(2):
                for j in range(2): q[a, i, j] += w*gu[own[b], i, j]*sg[b, i]*sg[b, j]
        q[a] /= sw
    return q

class Conj:
    def __init__(s, x, u, box, R, scheme='D', g=(0., 0.), nu=0., **o):
        s.x, s.u, s.box, s.R, s.scheme, s.g, s.nu = x.copy(), u.copy(), box, R, scheme, np.array(g, float), nu
        s.n0, s.Nw, s.N2, _ = sums(R); me = o.setdefault('me', 3)
        r = np.array([math.hypot(i, j) for i in range(-4, 5) for j in range(-4, 5) if i or j]); r = r[r < R]; q = (1-r/R)**me
        s.N1 = (q*r*r).sum()/2; s.S = q.sum()/s.N1; s.Rs = 2.1; s.Ns = sums(2.1)[1]; s.t = 0.; s.p = np.zeros(len(x)); s.its = s.steps = s.bad = s.nclip = 0
        s.o = dict(eps=0.5, lam=0.1, shift=1.0, chi=0.1, tol=1e-5, trelax=0.0, interp=True, inward=0.0, theta=0.0, nearR=0.0); s.o.update(o)
        s.m = sum(max(0., 1-math.hypot(i, 1)/R)**me for i in range(-4, 5))/s.N1; s.f = np.zeros(len(x), np.int64)
    def energy(s): return 0.5*(s.u**2).sum()-(s.x@s.g).sum()
    def step(s, dt):
        o, R, N1 = s.o, s.R, s.N1; n = len(s.x)
        X, own, sg = s.box.images(s.x, R); ptr, col = neighbours(X, n, R)
        gx, B, gu, ev, den, cnt, cg, bad = pass_a(X, own, sg, s.u, ptr, col, R, N1, o['lam'], s.Rs, s.Ns, o['me'])
        f, nrm = surface(X, ptr, col, ev, cnt, s.m); s.f = f; s.bad += bad
        gm = np.hypot(*s.g); T = min(.05/max(np.hypot(*s.u.T).mean(), 1e-9), .05/math.sqrt(gm) if gm else 9e9)
        if o.get('damp'): o['chi'] = min(o['damp']*dt/T, 0.5)
        us = s.u+dt*s.g+pass_b(X, own, sg, s.u, gu, ptr, col, R, N1, s.N2, s.nu*dt, o['chi'], s.n0)
        if o['theta'] and s.steps:
            inside = (f == 0) & ~beside(X, ptr, col, f[own], o['nearR'] or R)
            gr = s.g if not any(s.box.per) else 0*s.g
            us = us+dt*o['theta']*np.where(inside[:, None], Gr(s.p, own, sg, ptr, col, gx, B)-Gw(s.p, X, own, ptr, col, gx, B, gr), 0)
        div = D(us, own, sg, ptr, col, gx, B); near = beside(X, ptr, col, f[own], R)
        if o.get('relax'): o['trelax'] = 100*T/o['relax']
        if o['trelax']:
            e = (den-s.n0)/(2*s.Nw); e = np.where(near | (f != 0), np.maximum(e, 0), e); div = div-e*dt/o['trelax']/dt
            s.e = e
        p, it = solve(-div/dt, s.p, X, own, sg, ptr, col, gx, B, s.S, o['eps'], o['tol']/dt, 300)
        un = us-dt*Gr(p, own, sg, ptr, col, gx, B); s.p = p; s.its += it; s.steps += 1
        s.dp = ((un**2).sum()-(us**2).sum())/2
        xn = s.x+dt*un; s.u = un
        if o['shift']:
            rate = np.sqrt(((gu+gu.transpose(0, 2, 1))**2).sum((1, 2)))   # Frobenius norm of twice the rate of strain
            if o.get('rate') == 'min': rate = least(X, own, ptr, col, rate)
            if o.get('rate') == 'avg': gm = mean(X, own, sg, ptr, col, gu, R); rate = np.sqrt(((gm+gm.transpose(0, 2, 1))**2).sum((1, 2)))
            sh = o['shift']*s.shift_scale()*dt*rate[:, None]*cg
            l = np.hypot(*sh.T); sh *= np.minimum(1, 0.05/np.maximum(l, 1e-30))[:, None]
            nr = beside(X, ptr, col, f[own], 2.1) & (f == 0); k = (f == 1) | nr
            m = -(gx_sum(ptr, gx)); m /= np.maximum(np.hypot(*m.T), 1e-30)[:, None]; m[f == 1] = nrm[f == 1]
            q = (sh*m).sum(1); q = np.where((q < 0) & nr, (1-o['inward'])*q, q)
            sh[k] -= m[k]*q[k, None]; sh[f == 2] = 0
            xn = xn+sh
            if o['interp']: s.u = s.u+np.einsum('aij,aj->ai', gu, sh)
        s.x = xn; s.t += dt; s.clip()
    def shift_scale(s): return 1.5
    def clip(s):
        for d in (0, 1):
            if s.box.per[d]: s.x[:, d] = s.box.lo[d]+np.mod(s.x[:, d]-s.box.lo[d], s.box.hi[d]-s.box.lo[d]); continue
            for w, sgn in ((s.box.lo[d], 1), (s.box.hi[d], -1)):
                if w is None: continue
                k = (s.x[:, d]-w)*sgn < 0.2
                s.x[k, d] = w+0.2*sgn; s.u[k, d] = np.where(s.u[k, d]*sgn < 0, 0, s.u[k, d]); s.nclip += int(k.sum())
@nj
def gx_sum(ptr, gx):
    n = len(ptr)-1; q = np.zeros((n, 2))
    for a in range(n):
        for k in range(ptr[a], ptr[a+1]): q[a, 0] += gx[k, 0]; q[a, 1] += gx[k, 1]
    return q
