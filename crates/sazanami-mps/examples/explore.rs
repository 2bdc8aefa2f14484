use sazanami_mps::boundary::{Side, Tank, WallFriction};
use sazanami_mps::pressure::Tolerance;
use sazanami_mps::scheme::{Fluid, Scheme};
use sazanami_mps::solver::*;
use sazanami_mps::stability::StepLimits;
use sazanami_mps::{Kind};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};
use std::time::Instant;

fn solver(size: [usize; 3], fill: [usize; 3], sides: [[Side; 2]; 3], l0: Real, scheme: Scheme) -> Solver {
    let upper = l0 * Vector::new(size[0] as Real, size[1] as Real, size[2] as Real);
    let tank = Tank::new(Vector::ZERO, upper, sides, WallFriction::NoSlip);
    let cell = 0.5 * (scheme.radius + 0.36) * l0;
    let cells = [0, 1, 2].map(|d| ((upper[d] / cell).floor() as usize).max(1));
    let periodic = sides.map(|s| s[0] == Side::Periodic);
    let domain = Domain::solo(Grid::new(cells, Vector::ZERO, upper), periodic);
    let mut fluid = Vec::new(); let mut seed: u64 = 7;
    for k in 0..fill[2] { for j in 0..fill[1] { for i in 0..fill[0] {
        let jit: Real = std::env::var("JIT").map_or(0.0, |v| v.parse().unwrap());
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); let a = (seed >> 11) as Real / (1u64 << 53) as Real - 0.5;
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); let b = (seed >> 11) as Real / (1u64 << 53) as Real - 0.5;
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); let c = (seed >> 11) as Real / (1u64 << 53) as Real - 0.5;
        let position = l0 * Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real + 0.5) + l0 * 2.0 * jit * Vector::new(a, b, c);
        fluid.push(FluidParticle { position, velocity: Vector::ZERO });
    } } }
    let settings = Settings {
        fluid: Fluid { density: 1000.0, viscosity: std::env::var("NU").map_or(1e-6, |v| v.parse().unwrap()), spacing: l0 },
        scheme, limits: StepLimits { longest: 5e-4, ..StepLimits::default() },
        tolerance: Tolerance { strain: std::env::var("TOL").map_or(1e-6, |v| v.parse().unwrap()), ..Tolerance::default() }, reference: Vector::new(0.0, 0.0, l0 * fill[2] as Real),
    };
    { let none = sazanami_mps::grains::GrainPhase::none(&domain).unwrap(); Solver::new(domain, settings, tank, &fluid, none).unwrap() }
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let l0 = 1e-3;
    let g = Vector::new(0.0, 0.0, -9.81);
    let wall = [Side::Wall; 2];
    let per = [Side::Periodic; 2];
    let open = [Side::Wall, Side::Open];
    let scheme = Scheme { surface_repeats: args.get(3).map_or(0, |v| v.parse().unwrap()), ..Scheme::default() };
    let scheme = Scheme { relaxation: std::env::var("REL").map_or(100.0, |v| v.parse().unwrap()), stabilisation: std::env::var("DS").map_or(scheme.stabilisation, |v| { let d: Real = v.parse().unwrap(); (d > 0.0).then_some(sazanami_mps::scheme::Stabilisation { distance: d, weighted: std::env::var("DSU").is_err() }) }), compensation: std::env::var("ECS").map_or(1.0, |v| v.parse().unwrap()), ..scheme };
    let end: Real = args.get(2).map_or(0.05, |v| v.parse().unwrap());
    let mut s = match args[1].as_str() {
        "rest" => solver([20, 7, 25], [20, 7, 20], [wall, per, open], l0, scheme),
        "plain" => solver([20, 7, 25], [20, 7, 20], [wall, per, open], l0, Scheme { reduced_pressure: false, ..scheme }),
        "block" => solver([20, 20, 40], [20, 20, 20], [[Side::Open; 2], [Side::Open; 2], [Side::Open; 2]], l0, scheme),
        "dam" => solver([80, 20, 50], [20, 20, 40], [wall, per, open], l0, scheme),
        "dam3" => solver([100, 40, 80], [50, 40, 50], [wall, wall, open], l0, scheme),
        "tank" => solver([150, 20, 30], [150, 20, 14], [wall, per, open], l0, scheme),
        _ => panic!(),
    };
    println!("{} particles", s.particles().len());
    let mut t = 0.0; let mut n = 0;
    let mut phases = std::collections::BTreeMap::new();
    while t < end {
        let dt = s.stable_step(g).dt;
        let mut now = (Instant::now(), Phase::Neighbours);
        let begin = now.0;
        let mut lap = |p: Phase, phases: &mut std::collections::BTreeMap<String, f64>| {
            *phases.entry(format!("{:?}", now.1)).or_insert(0.0) += now.0.elapsed().as_secs_f64();
            now = (Instant::now(), p);
        };
        let r = s.step(dt, &Forcing { body_force: g, ..Forcing::default() }, |p| lap(p, &mut phases)).unwrap();
        lap(Phase::Neighbours, &mut phases);
        t += dt; n += 1;
        if n % args.get(4).map_or(20, |v| v.parse().unwrap()) == 0 || n <= 3 {
            let m = s.particle_mass();
            let [e, p, z, c, front] = s.sum_over_fluid(|q, a| [0.5 * m * q.velocity[a].length_squared(), m * q.velocity[a].z, m * q.position[a].z, m, 0.0]);
            let front = (0..s.particles().owned()).filter(|&a| s.particles().kind[a] == Kind::Fluid && s.particles().role[a] != sazanami_mps::pressure::Role::Outside).map(|a| s.particles().position[a].x).fold(0.0, Real::max);
            println!("{n} t {t:.5} dt {dt:.2e} it {} res {:.1e} strain {:.2e} {:.2e} umax {:.3e} surf {} spl {} plain {} push {} col {} clip {} ek {e:.3e} pz/m {:.4e} zc {:.6e} front {:.4e} wall {:.3}", r.pressure.iterations, r.pressure.residual, r.strain[0], r.strain[1], r.largest_speed, r.surface, r.splashes, r.plain_gradients, r.pushed_pairs, r.collisions, r.clipped, p / c / t, z / c, front, begin.elapsed().as_secs_f64());
            let _ = front;
        }
    }
    println!("{phases:?} steps {n}");
    { use std::io::Write; let q = s.particles(); let mut f = std::io::BufWriter::new(std::fs::File::create("/tmp/state.csv").unwrap());
    for a in 0..q.owned() { if q.kind[a] == Kind::Fluid { writeln!(f, "f,{},{},{},{},{},{},{},{:?}", q.position[a].x, q.position[a].y, q.position[a].z, q.velocity[a].x, q.velocity[a].y, q.velocity[a].z, q.pressure[a], q.role[a]).unwrap(); } } }
    if args[1] == "rest" || args[1] == "plain" {
        let q = s.particles();
        let mut worst: Real = 0.0;
        for a in 0..q.owned() { if q.kind[a] == Kind::Fluid {
            let h = 0.02;
            let reference = 0.02;
            let p = if args[1] == "rest" { q.pressure[a] + 1000.0 * -9.81 * (q.position[a].z - reference) } else { q.pressure[a] };
            worst = worst.max((p - 9810.0 * (h - q.position[a].z)).abs());
        } }
        println!("worst p error / rho g H {:.3e}", worst / (9810.0 * 0.02));
    }
    if args[1] == "block" {
        let q = s.particles();
        let mut sum = 0.0; let mut c = 0.0;
        for a in 0..q.owned() { let d = q.velocity[a] / t - g; sum += d.length_squared(); c += 1.0; }
        println!("rms |a-g|/g {:.4e}", (sum / c as Real).sqrt() / 9.81);
    }
}
