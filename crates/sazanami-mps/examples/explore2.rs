use sazanami_dem::*;
use sazanami_mps::boundary::{Side, Tank, WallFriction};
use sazanami_mps::filling;
use sazanami_mps::grains::{Closure, Coupling, GrainPhase};
use sazanami_mps::pressure::Tolerance;
use sazanami_mps::scheme::{Fluid, Scheme};
use sazanami_mps::solver::*;
use sazanami_mps::stability::StepLimits;
use sazanami_mps::Kind;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};
use std::time::Instant;

fn law() -> ContactLaw {
    ContactLaw { normal_stiffness: 400.0, tangential_stiffness: 400.0 * 2.0 / 7.0, damping: Damping::Restitution(0.5), friction: 0.4, ..ContactLaw::SAND }
}

fn domain(upper: Vector, lower: Vector, sides: [[Side; 2]; 3], l0: Real, scheme: &Scheme) -> Domain {
    let cell = 0.5 * (scheme.radius + 0.36) * l0;
    let extent = upper - lower;
    let cells = [0, 1, 2].map(|d| ((extent[d] / cell).floor() as usize).max(2));
    Domain::solo(Grid::new(cells, lower, upper), sides.map(|s| s[0] == Side::Periodic))
}

fn engine(domain: &Domain, tank: &Tank, grains: &[Grain], d: Real) -> Engine {
    let present = tank.sides.map(|s| s.map(|s| s == Side::Wall));
    let walls = Wall::of_box(tank.lower, tank.upper, 0, present);
    let big = Vector::splat(1.0);
    Engine::new(domain, Setup { bodies: vec![Body::ball(0.5 * d)], interactions: Interactions::uniform(1, law()), walls, region: [tank.lower - big, tank.upper + big], ghost_margin: 3.6 * d }, grains).unwrap()
}

fn packed(domain: &Domain, tank: &Tank, d: Real, layers: Real) -> Vec<Grain> {
    let extent = tank.upper - tank.lower;
    let n = [0, 1].map(|k| (extent[k] / (1.1 * d)).floor() as usize);
    let per = 0.6 / (std::f64::consts::PI / 6.0) * extent.x * extent.y * layers * d / d.powi(3);
    let total = per.round() as usize;
    let mut grains = Vec::new();
    let mut seed = 1u64;
    let mut random = || { seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); (seed >> 11) as Real / (1u64 << 53) as Real - 0.5 };
    for m in 0..total {
        let (i, j, k) = (m % n[0], m / n[0] % n[1], m / (n[0] * n[1]));
        let place = Vector::new((i as Real + 0.5) * extent.x / n[0] as Real, (j as Real + 0.5) * extent.y / n[1] as Real, (k as Real + 0.55) * 1.1 * d);
        let jitter = 0.09 * d * Vector::new(random(), random(), random());
        grains.push(Grain::new(m as u64, 2650.0, tank.lower + place + jitter));
    }
    let mut e = engine(domain, tank, &grains, d);
    let g = Vector::new(0.0, 0.0, -9.81);
    let t0 = Instant::now();
    for s in 0..3000 {
        let r = e.advance(domain, &Loads::none(), g, 2e-4, Substeps::Auto).unwrap();
        if s > 300 {
            let v = (0..e.grains().owned()).map(|n| e.grains().velocity[n].length()).fold(0.0, Real::max);
            if v < 1e-3 { println!("packed {total} after {} ms, {} contacts {:.1} s", s as Real * 0.2, r.contacts, t0.elapsed().as_secs_f64()); break; }
        }
    }
    for (n, g) in grains.iter_mut().enumerate() { g.position = e.grains().home(n); }
    grains
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let d = 1e-3;
    let l0: Real = 1e-3 * args.get(3).map_or(1.0, |v| v.parse().unwrap());
    let g = Vector::new(0.0, 0.0, -9.81);
    let wall = [Side::Wall; 2];
    let per = [Side::Periodic; 2];
    let open = [Side::Wall, Side::Open];
    let scheme = Scheme::default();
    let end: Real = args.get(2).map_or(0.05, |v| v.parse().unwrap());
    let (upper, sides, level) = match args[1].as_str() {
        "fall" => (d * Vector::new(20.0, 20.0, 45.0), [per, per, open], 40.0 * d),
        "small" => (d * Vector::new(20.0, 8.0, 25.0), [wall, per, open], 12.0 * d),
        "bed" | "shake" => (d * Vector::new(60.0, 10.0, 35.0), [wall, per, open], 20.0 * d),
        "paper" => (d * Vector::new(150.0, 20.0, 35.0), [wall, per, open], 20.0 * d),
        _ => panic!(),
    };
    let half = Vector::new(0.5 * upper.x, 0.0, 0.0);
    let (lower, upper) = (-half, upper - half);
    let tank = Tank::new(lower, upper, sides, WallFriction::NoSlip);
    let dom = domain(upper, lower, sides, l0, &scheme);
    let coupling = Coupling { closure: Closure::recommended(1000.0, 1e-3), smoothing: 3.0 * d, least_void: 0.3, implicit_pressure_force: std::env::var("LAG").is_err(), substeps: Substeps::Auto };
    let grains = match args[1].as_str() {
        "fall" => vec![Grain::new(0, 2650.0, Vector::new(0.13e-3, 10.2e-3, 36e-3))],
        "small" => packed(&dom, &tank, d, 5.0),
        _ => packed(&dom, &tank, d, 10.0),
    };
    let mut phase = GrainPhase::new(&dom, engine(&dom, &tank, &grains, d), coupling);
    phase.take_places(&dom, &tank);
    let mean = |z: Real| { let mut s = 0.0; let mut c = 0.0; for i in 0..40 { for j in 0..8 { s += phase.void_fraction(Vector::new(lower.x + (i as Real + 0.5) / 40.0 * (upper.x - lower.x), (j as Real + 0.5) / 8.0 * upper.y, z)); c += 1.0; } } s / c };
    for k in 0..14 { print!("{:.3} ", mean((k as Real + 0.5) * d)); } println!();
    let fluid: Vec<FluidParticle> = filling::layers(lower, upper, level, l0, mean).into_iter().map(|position| FluidParticle { position, velocity: Vector::ZERO }).collect();
    println!("{} grains {} fluid", grains.len(), fluid.len());
    let settings = Settings { fluid: Fluid { density: 1000.0, viscosity: 1e-6, spacing: l0 }, scheme, limits: StepLimits::default(), tolerance: Tolerance::default(), reference: Vector::new(0.0, 0.0, level) };
    let mut s = Solver::new(dom, settings, tank, &fluid, phase).unwrap();
    if grains.len() > 1 {
        s.grains_mut().freeze(true);
        for n in 0..300 {
            let r = s.step(2e-4, &Forcing { body_force: g, ..Forcing::default() }, |_| ()).unwrap();
            s.set_velocities(|p, a| 0.9 * p.velocity[a]);
            if n % 60 == 0 || n == 299 { println!("relax {n} it {} strain {:.2e} {:.2e} umax {:.2e} push {} col {} void {:.3}", r.pressure.iterations, r.strain[0], r.strain[1], r.largest_speed, r.pushed_pairs, r.collisions, r.coupling.least_void); }
            if n > 100 && r.strain[1] < 0.01 && r.largest_speed < 1e-3 { println!("relaxed after {n}"); break; }
        }
        s.set_velocities(|_, _| Vector::ZERO);
        s.grains_mut().freeze(false);
    }
    let (a, w) = (0.01, 2.0 * std::f64::consts::PI * 2.0);
    let force = |t: Real| {
        if args[1] != "shake" && args[1] != "paper" { return g; }
        let (r, r1, r2) = { let x = t / 0.5; if x < 1.0 { (3.0 * x * x - 2.0 * x.powi(3), (6.0 * x - 6.0 * x * x) / 0.5, (6.0 - 12.0 * x) / 0.25) } else { (1.0, 0.0, 0.0) } };
        let acc = -a * (r2 * (w * t).sin() + 2.0 * w * r1 * (w * t).cos() - w * w * r * (w * t).sin());
        g - Vector::new(acc, 0.0, 0.0)
    };
    let mut t = 0.0; let mut n = 0;
    let mut phases = std::collections::BTreeMap::new();
    let begin = Instant::now();
    while t < end {
        let step = s.stable_step(force(t));
        let dt = step.dt;
        let mut now = (Instant::now(), Phase::Neighbours);
        let mut lap = |p: Phase, phases: &mut std::collections::BTreeMap<String, f64>| {
            *phases.entry(format!("{:?}", now.1)).or_insert(0.0) += now.0.elapsed().as_secs_f64();
            now = (Instant::now(), p);
        };
        let r = s.step(dt, &Forcing { body_force: force(t + 0.5 * dt), ..Forcing::default() }, |p| lap(p, &mut phases)).unwrap();
        lap(Phase::Neighbours, &mut phases);
        t += dt; n += 1;
        if n % args.get(4).map_or(50, |v| v.parse().unwrap()) == 0 || n <= 2 {
            let e = s.grains().engine();
            let q = e.grains();
            let vmax = (0..q.owned()).map(|n| q.velocity[n].length()).fold(0.0, Real::max);
            let z = (0..q.owned()).map(|n| q.position[n].z).sum::<Real>() / q.owned() as Real;
            let vz = (0..q.owned()).map(|n| q.velocity[n].z).sum::<Real>() / q.owned() as Real;
            let c = r.coupling;
            println!("{n} t {t:.5} dt {dt:.2e} {:?} it {} strain {:.2e} {:.2e} umax {:.3e} surf {} spl {} push {} col {} clip {} void {:.3} cut {} | vmax {vmax:.4e} vz {vz:.5e} z {z:.5e} cont {} sub {} drag {:.3e} {:.3e} wall {:.1}", step.limit, r.pressure.iterations, r.strain[0], r.strain[1], r.largest_speed, r.surface, r.splashes, r.pushed_pairs, r.collisions, r.clipped, c.least_void, c.cut_voids, r.contacts.contacts, r.contacts.substeps, c.drag_on_grains.z, (c.drag_on_grains + c.drag_on_fluid).length(), begin.elapsed().as_secs_f64());
        }
    }
    println!("{phases:?} steps {n}");
    let q = s.particles();
    let _ = Kind::Fluid;
    let mut f = std::io::BufWriter::new(std::fs::File::create("/tmp/state.csv").unwrap());
    use std::io::Write;
    for a in 0..q.owned() { if q.kind[a] == Kind::Fluid { writeln!(f, "f,{},{},{},{},{}", q.position[a].x, q.position[a].y, q.position[a].z, q.velocity[a].x, q.velocity[a].z).unwrap(); } }
    let e = s.grains().engine().grains();
    for a in 0..e.owned() { writeln!(f, "g,{},{},{},{},{}", e.position[a].x, e.position[a].y, e.position[a].z, e.velocity[a].x, e.velocity[a].z).unwrap(); }
}
