import numpy as np, math, sys, time
from lab import *
def lattice(nx, ny): return np.array([[i+.5, j+.5] for i in range(nx) for j in range(ny)], float)
G = 9.81
def wave(R, scheme, layers=10, periods=2.5, cfl=0.1, amp=0.02, **o):
    """L = 2h; lengths in spacings, time in s of h = 0.05 m: l0 = 0.05/layers."""
    l0 = 0.05/layers; nx = 2*layers; h = layers; k = pi/nx; g = G/l0
    w = math.sqrt(g*k*math.tanh(k*h)); x = lattice(nx, layers)
    a = amp*h; U = a*w/math.sinh(k*h)
    u = np.stack([-U*np.cosh(k*x[:, 1])*np.sin(k*x[:, 0]), U*np.sinh(k*x[:, 1])*np.cos(k*x[:, 0])], 1)
    phi = u.copy()
    s = Sim(x, u, Box((0, 0), (nx, None)), R, scheme, (0, -g), **o)
    T = 2*pi/w; dt = min(0.2/math.sqrt(g), T/200); dt = 0.1*1/math.sqrt(g)
    A = [(0, (u*phi).sum())]; e0 = 0.5*(u**2).sum(); E0 = s.energy(); emx = 0
    while s.t < periods*T:
        s.step(dt); A.append((s.t, (s.u*phi).sum()/1)); emx = max(emx, (s.energy()-E0)/e0)
        if not np.isfinite(s.u).all() or np.abs(s.u).max() > 20*math.sqrt(g*h): return dict(burst=s.t/T)
    A = np.array(A); z = [A[i, 0]-A[i, 1]*(A[i+1, 0]-A[i, 0])/(A[i+1, 1]-A[i, 1]) for i in range(len(A)-1) if A[i, 1]*A[i+1, 1] < 0]
    per = 2*np.mean(np.diff(z))/T
    # decay from energy: mode amplitude at fitted extremes
    ext = [abs(A[i, 1]) for i in range(1, len(A)-1) if abs(A[i, 1]) > abs(A[i-1, 1]) and abs(A[i, 1]) >= abs(A[i+1, 1])]
    te = [A[i, 0] for i in range(1, len(A)-1) if abs(A[i, 1]) > abs(A[i-1, 1]) and abs(A[i, 1]) >= abs(A[i+1, 1])]
    ext = [A[0, 1]]+ext; te = [0]+te
    sl = -np.polyfit(te, np.log(ext), 1)[0]     # amplitude decay 2 nu k^2
    nu = sl/(2*k*k)*l0*l0
    return dict(period=per, nu=nu, E=(s.energy()-E0)/e0, emax=emx, surf=int((s.f == 1).sum()), it=s.its/s.steps)
def drop(R, scheme, N=16, **o):
    A0 = 1.0
    q = np.arange(-N-1, N+1)+.5; x = np.array([[i, j] for i in q for j in q if math.hypot(i, j) < N], float)
    u = A0*x*np.array([1, -1]); s = Sim(x, u, Box(), R, scheme, **o)
    K0 = 0.5*(u**2).sum(); a = b = float(N); A = A0; dt = 0.1/(1.6*N)/1; dt = 0.15/(2*N); kmx = 0; pl = []
    while s.t < 1-1e-9:
        def rhs(y): a, b, A = y; return np.array([A*a, -A*b, A*A*(b*b-a*a)/(a*a+b*b)])
        y = np.array([a, b, A]); k1 = rhs(y); k2 = rhs(y+dt/2*k1); k3 = rhs(y+dt/2*k2); k4 = rhs(y+dt*k3)
        a, b, A = y+dt/6*(k1+2*k2+2*k3+k4)
        s.step(dt); kmx = max(kmx, 0.5*(s.u**2).sum()/K0); pl.append(s.p[np.argsort(np.hypot(*s.x.T))[:9]].mean()/(A*A*a*a*b*b/(a*a+b*b)))
        if not np.isfinite(s.u).all() or np.abs(s.u).max() > 10*N: return dict(burst=s.t, K=0.5*(s.u**2).sum()/K0)
    ue = A*s.x*np.array([1, -1]); pmean = np.mean(pl[-10:]); err = math.sqrt(((s.u-ue)**2).sum()/(ue**2).sum())
    r = np.hypot(*s.x.T); pm = s.p[np.argsort(r)[:9]].mean()/(A*A*a*a*b*b/(a*a+b*b))
    shape = (s.x[:, 0]/a)**2+(s.x[:, 1]/b)**2
    return dict(K=0.5*(s.u**2).sum()/K0, kmax=kmx, err=err, p=pm, pmean=pmean, shape=math.sqrt(shape.max()), falsesurf=int(((s.f == 1) & (shape < .7)).sum()), surf=int((s.f == 1).sum()), iso=int((s.f == 2).sum()), it=s.its/s.steps, dmin=closest(s))
def closest(s):
    from scipy.spatial import cKDTree
    d, _ = cKDTree(s.x).query(s.x, 2); return d[:, 1].min()
def show(name, d): print(name, ' '.join(f'{k}={v:.4g}' if isinstance(v, (float, np.floating)) else f'{k}={v}' for k, v in d.items()), flush=True)
def taylor_green(R, scheme, n=50, Re=100, T=0.5, jitter=0.2, **o):
    """Unit box with n particles; U = 1 box length over time; velocity in spacings/time."""
    U = n*1.0; nu = U*n/Re
    x = lattice(n, n); rng = np.random.default_rng(1); x = x+jitter*rng.uniform(-1, 1, x.shape)
    ex = lambda x: U*np.stack([-np.cos(2*pi*x[:, 0]/n)*np.sin(2*pi*x[:, 1]/n), np.sin(2*pi*x[:, 0]/n)*np.cos(2*pi*x[:, 1]/n)], 1)
    s = Sim(x, ex(x), Box((0, 0), (n, n), (1, 1)), R, scheme, nu=nu, **o); K0 = (s.u**2).sum(); dt = 0.15/U; M0 = s.u.sum(0)
    while s.t < T:
        s.step(dt)
        if not np.isfinite(s.u).all() or np.abs(s.u).max() > 5*U: return dict(burst=s.t)
    lam = 8*pi**2/Re; ue = ex(s.x)*math.exp(-lam*s.t)
    return dict(decay=-math.log((s.u**2).sum()/K0)/(2*lam*s.t), err=math.sqrt(((s.u-ue)**2).sum()/(ue**2).sum()), mom=np.abs(s.u.sum(0)-M0).max()/len(x)/U, false=int((s.f != 0).sum()), dmin=closest(s), it=s.its/s.steps)
def still(R, scheme, kind='disordered', n=20, T=40., **o):
    """Time in sqrt(l0/g). Half of the time free, a tenth damped by 0.9 a step, then free."""
    x = lattice(n, n); rng = np.random.default_rng(2)
    if kind == 'disordered': x = x+0.1*rng.uniform(-1, 1, x.shape)
    g = (0.16, -1.) if kind == 'tilted' else (0., -1.)
    s = Sim(x, 0*x, Box((0, 0), (n, n+0. if False else None)), R, scheme, g, **o) if kind != 'tilted' else None
    if kind == 'tilted':
        q = np.array([[i+.5, j+.5] for i in range(n) for j in range(2*n) if j+.5 < n+0.16*(i+.5-n/2)], float)
        s = Sim(q, 0*q, Box((0, 0), (n, None)), R, scheme, g, **o)
    dt = 0.1; sc = math.sqrt(n); m1 = 0; m2 = 0; me = []; E0 = s.energy()
    while s.t < T:
        s.step(dt)
        if not np.isfinite(s.u).all() or np.abs(s.u).max() > 5*sc: return dict(burst=s.t)
        v = np.sqrt((s.u**2).sum(1)).max()/sc
        if s.t < .4*T: m1 = max(m1, v)
        elif s.t < .6*T: s.u *= 0.9
        elif s.t > .7*T: m2 = max(m2, v); me.append(math.sqrt((s.u**2).sum(1).mean())/sc)
    gm = np.hypot(*s.g); d = s.x@s.g/gm; p = s.p-(-0.0) if s.scheme == 'D' else s.p+s.x@s.g
    A = np.stack([d, np.ones(len(d))], 1); k = (d.max()-d > 2); co = np.polyfit(-d, p, 1)
    top = np.sort(-d)[-n:].mean()+0.5; pe = gm*(top+d)
    return dict(vmax0=m1, vmax=m2, vrms=np.mean(me), slope=-co[0]/gm, perr=np.abs(p-pe)[5:].max()/gm/n, prms=math.sqrt(((p-pe)**2).mean())/gm/n, dE=(s.energy()-E0)/len(s.x), clip=getattr(s, 'nclip', 0), it=s.its/s.steps)
def dam(R, scheme, nx=12, ny=24, T=None, far=5., **o):
    """Column nx by ny on a dry floor, walls at 0 and far*nx. Time in sqrt(l0/g). Martin and Moyce: n^2 = 2."""
    x = lattice(nx, ny); W = far*nx
    s = Sim(x, 0*x, Box((0, 0), (W, None)), R, scheme, (0., -1.), **o); E0 = s.energy(); Emax = E0; Eprev = E0; up = 0.
    T = T or 8*math.sqrt(ny); vm = 0; fr = []; upmax = 0
    while s.t < T:
        v = np.sqrt((s.u**2).sum(1)).max(); vm = max(vm, v)
        dt = min(0.1, 0.15/max(v, 1e-9)); s.step(dt)
        if not np.isfinite(s.u).all() or v > 5*math.sqrt(2*ny): return dict(burst=s.t/math.sqrt(ny), E=s.energy()/E0, front=fr[::max(1, len(fr)//6)])
        E = s.energy(); d = E-Eprev; up += max(d, 0); upmax = max(upmax, d); Eprev = E; Emax = max(Emax, E)
        fr.append((s.t*math.sqrt(2/nx), s.x[:, 0].max()/nx))
    fr = np.array(fr); mm = [(1.0, 1.45 if False else 0)]
    at = {z: float(np.interp(z, fr[:, 1], fr[:, 0])) for z in (1.44, 2.0, 3.0, 4.0)}
    n = s.x[:, 1]
    return dict(E=s.energy()/E0, Emax=Emax/E0, ups=up/E0, vmax=vm/math.sqrt(2*ny), front=' '.join(f'{k}:{v:.3f}' for k, v in at.items()), clip=getattr(s, 'nclip', 0), bad=s.bad/s.steps, steps=s.steps, it=s.its/s.steps, sink=n.mean()/(nx*ny/W/2), dmin=closest(s))
def square(R, scheme, n=24, T=1.5, **o):
    """Rotating square, angular velocity 1; energy and momenta."""
    x = lattice(n, n)-n/2; u = np.stack([x[:, 1], -x[:, 0]], 1); s = Sim(x, u, Box(), R, scheme, **o)
    K0 = (u**2).sum(); L0 = (x[:, 0]*u[:, 1]-x[:, 1]*u[:, 0]).sum(); dt = 0.1/n; kp = K0; up = 0.; P = 0
    while s.t < T:
        s.step(dt); K = (s.u**2).sum(); up += max(K-kp, 0); kp = K
        if not np.isfinite(s.u).all() or np.abs(s.u).max() > 10*n: return dict(burst=s.t, K=K/K0)
    L = (s.x[:, 0]*s.u[:, 1]-s.x[:, 1]*s.u[:, 0]).sum()
    return dict(K=K/K0, ups=up/K0, L=L/L0, P=np.abs(s.u.sum(0)).max()/n/len(x), dmin=closest(s), it=s.its/s.steps)
def collide(R, scheme, N=10, T=1.5, **o):
    """Two drops of radius N, gap 1, each with speed N; offset 0.5 N."""
    q = np.arange(-N-1, N+1)+.5; x = np.array([[i, j] for i in q for j in q if math.hypot(i, j) < N], float)
    y = x+[2*N+1, 0.5*N]; X = np.concatenate([x, y]); u = np.zeros_like(X); u[:len(x), 0] = N; u[len(x):, 0] = -N
    s = Sim(X, u, Box(), R, scheme, **o); K0 = (u**2).sum(); kp = K0; up = 0
    Lf = lambda: (s.x[:, 0]*s.u[:, 1]-s.x[:, 1]*s.u[:, 0]).sum()
    L0 = Lf(); vm = 0
    while s.t < T:
        v = np.sqrt((s.u**2).sum(1)).max(); vm = max(vm, v)
        s.step(0.15/max(v, N)); K = (s.u**2).sum(); up += max(K-kp, 0); kp = K
        if not np.isfinite(s.u).all() or np.abs(s.u).max() > 20*N: return dict(burst=s.t, K=K/K0)
    return dict(K=K/K0, ups=up/K0, L=Lf()/L0, P=np.abs(s.u.sum(0)).max()/N/len(X), vmax=vm/N, dmin=closest(s), it=s.its/s.steps)
