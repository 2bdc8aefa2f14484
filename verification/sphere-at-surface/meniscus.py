"""Force of two fluids on a sphere at their surface.

The meniscus of Young and Laplace around a sphere of radius R whose middle is at z0, in a cylinder that it meets at 90 degrees: in the distance r from the axis, with
u = sin of the slope,

    d(r u)/dr = r (z - zref)/L^2,   dz/dr = u/sqrt(1 - u^2),   L^2 = sigma/((rho_l - rho_g) g)

from the line of contact at the angle psi from the lowest point of the sphere, where the slope is psi + theta - pi, to the wall; psi and zref are those with no slope at
the wall and the volume of the liquid. Prints the references of `expected.toml`: forces, and where a sphere floats.
"""
import math


def cap(R, ct):  # volume of the sphere below the plane at height -R cos(psi) from its centre, ct=cos(psi)
    h=R*(1-ct); return math.pi*h*h*(3*R-h)/3
def shoot(R,z0,theta,L,rout,psi,zref):
    a=R*math.sin(psi); zc=z0-R*math.cos(psi); b=psi+theta-math.pi
    r,z,vol=a,zc,0.0; n=400
    # march in r with u=sin(beta): d(r u)/dr = r (z-zref)/L^2 ; dz/dr=tan(beta)
    dr=(rout-a)/n; u=math.sin(b)
    if abs(b)>=math.pi/2: return None
    def f(r,z,u):
        if abs(u)>=1: return None
        return u/math.sqrt(1-u*u),(z-zref)/L**2-u/r
    for _ in range(n):
        k1=f(r,z,u)
        if k1 is None: return None
        k2=f(r+dr/2,z+dr/2*k1[0],u+dr/2*k1[1])
        if k2 is None: return None
        rm,zm=r+dr/2,z+dr/2*k1[0]
        z2=z+dr*k2[0]; vol+=dr*2*math.pi*rm*(z+z2)/2; u+=dr*k2[1]; z=z2; r+=dr
    return u,vol
def solve(R,z0,theta,L,rout,volume):
    def zref_of(psi):
        # slope at the wall grows with lower zref: bisect
        lo,hi=z0-6*R,z0+6*R
        for _ in range(60):
            m=(lo+hi)/2; s=shoot(R,z0,theta,L,rout,psi,m)
            b=psi+theta-math.pi
            if s is None:
                # diverged up or down: decide by sign of z-zref at start
                zc=z0-R*math.cos(psi)
                if zc>m: lo=m
                else: hi=m
            elif s[0]>0: lo=m
            else: hi=m
        return m
    def excess(psi):
        zr=zref_of(psi); s=shoot(R,z0,theta,L,rout,psi,zr)
        if s is None: return None
        a=R*math.sin(psi); zc=z0-R*math.cos(psi)
        return s[1]+math.pi*a*a*zc-cap(R,math.cos(psi))-volume
    prev=None
    for tenths in range(200,1610,13):
        psi=math.radians(tenths/10); e=excess(psi)
        if prev is not None and e is not None and prev[1]*e<=0:
            lo,hi,el=prev[0],psi,prev[1]
            for _ in range(40):
                m=(lo+hi)/2; em=excess(m)
                if em is None: break
                if em*el>0: lo=m
                else: hi=m
            else:
                return m,zref_of(m)
        prev=(psi,e) if e is not None else None
    return None
def force(R,z0,theta,sigma,rho_l,rho_g,g,width,volume):
    L=math.sqrt(sigma/((rho_l-rho_g)*g)); rout=width/math.sqrt(math.pi)
    found=solve(R,z0,theta,L,rout,volume)
    if found is None: return None
    psi,zr=found
    a=R*math.sin(psi); zc=z0-R*math.cos(psi); b=psi+theta-math.pi
    line=2*math.pi*a*sigma*math.sin(b)
    press=(rho_l-rho_g)*g*(cap(R,math.cos(psi))-math.pi*a*a*(zc-zr))+rho_g*g*4/3*math.pi*R**3
    return dict(psi=math.degrees(psi),beta=math.degrees(b),zref=zr,zc=zc,line=line,pressure=press,total=line+press)
if __name__ == "__main__":
    R, W, SIGMA, LIQUID, GAS = 0.3e-3, 1.4e-3, 0.05, 1000.0, 1.0
    volume = W * W * 0.6e-3 - cap(R, (0.5e-3 - 0.6e-3) / R)
    of = lambda z, theta: force(R, z, math.radians(theta), SIGMA, LIQUID, GAS, 1250.0, W, volume)
    for theta in (60, 90, 120):
        print(theta, of(0.5e-3, theta)["total"])
    # Where the force is the weight of a sphere of this density: heights of the middle at which the march through r succeeds, linear between them.
    for theta, density in ((90, 1100.0), (120, 1200.0)):
        weight = density * 1250.0 * 4 / 3 * math.pi * R**3
        heights = [1e-5 * n + 0.3e-6 for n in range(36, 54)]
        table = [(z, found["total"]) for z, found in ((z, of(z, theta)) for z in heights) if found]
        for (a, f), (b, g) in zip(table, table[1:]):
            if (f - weight) * (g - weight) <= 0:
                print(theta, density, a + (b - a) * (weight - f) / (g - f))
    # A sphere of 1 mm between water and air, in a box of 2.25 mm.
    R, W, SIGMA, GAS = 0.5e-3, 2.25e-3, 0.0728, 1.2
    for z, theta in ((1.07e-3, 60), (0.9e-3, 60), (1.07e-3, 120)):
        volume = W * W * 1e-3 - cap(R, (z - 1e-3) / R)
        print("water and air", theta, z, force(R, z, math.radians(theta), SIGMA, LIQUID, GAS, 9.81, W, volume)["total"])
