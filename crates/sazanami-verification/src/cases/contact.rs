//! Single grains against closed forms and experiments.

use std::f64::consts::PI;

use sazanami_dem::{
    Body, Damping, Engine, Grain, Grains, Interactions, LinearSpringDashpot, Loads, Setup, Substeps, Wall, restitution,
};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::tank::{down, largest};
use crate::measured::{Chart, Measured};
use crate::reference::{self, OBLIQUE};

/// A few bodies of one shape and one contact law over a floor, without a fluid.
pub(crate) struct Bench {
    pub domain: Domain,
    pub engine: Engine,
}

impl Bench {
    pub fn new(body: Body, law: LinearSpringDashpot, walls: Vec<Wall>, grains: &[Grain]) -> Result<Self, String> {
        let domain = Domain::solo(Grid::new([4; 3], Vector::splat(-1.0), Vector::ONE), [false; 3]);
        let setup = Setup {
            bodies: vec![body],
            interactions: Interactions::uniform(1, law),
            walls,
            region: [Vector::splat(-1e3), Vector::splat(1e3)],
            ghost_margin: 0.0,
        };
        let engine = Engine::new(&domain, setup, grains).map_err(|error| error.to_string())?;
        Ok(Self { domain, engine })
    }

    pub fn floor() -> Vec<Wall> {
        vec![Wall::at_rest(Vector::ZERO, Vector::Z, 0)]
    }

    /// One step of a single sub-step.
    pub fn step(&mut self, gravity: Vector, dt: Real) -> Result<sazanami_dem::ContactReport, String> {
        let Self { domain, engine } = self;
        engine.advance(domain, &Loads::none(), gravity, dt, Substeps::Fixed(1)).map_err(|error| error.to_string())
    }

    pub fn grains(&self) -> &Grains {
        self.engine.grains()
    }
}

fn law(stiffness: Real, damping: Damping, friction: Real) -> LinearSpringDashpot {
    LinearSpringDashpot {
        normal_stiffness: stiffness,
        tangential_stiffness: stiffness,
        damping,
        friction,
        ..LinearSpringDashpot::SAND
    }
}

fn ball_mass(radius: Real, density: Real) -> Real {
    density * 4.0 / 3.0 * PI * radius.powi(3)
}

/// Rebound over impact speed of a ball of `mass`, and the time in contact \[s].
fn rebound(law: LinearSpringDashpot, mass: Real, steps: Real) -> Result<[Real; 2], String> {
    let (radius, speed) = (1e-3, 0.1);
    let dt = PI * (mass / law.normal_stiffness).sqrt() / steps;
    let grain = Grain {
        mass: Some(mass),
        velocity: Vector::new(0.0, 0.0, -speed),
        ..Grain::new(1, 1.0, Vector::new(0.0, 0.0, radius + 0.37 * speed * dt))
    };
    let mut bench = Bench::new(Body::ball(radius), law, Bench::floor(), &[grain])?;
    let mut touching = 0.0;
    for _ in 0..(3.0 * steps) as usize {
        let report = bench.step(Vector::ZERO, dt)?;
        touching += if report.contacts > 0 { dt } else { 0.0 };
        if report.contacts == 0 && touching > 0.0 {
            break;
        }
    }
    Ok([bench.grains().velocity[0].z / speed, touching])
}

/// A ball rebounds with the restitution it was given.
pub(crate) fn restitution_of_a_ball() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for tension in [true, false] {
        for e in [0.5, 0.8, 1.0] {
            let law = LinearSpringDashpot { tension, ..law(1e4, Damping::Restitution(e), 0.0) };
            let [found, _] = rebound(law, 1e-6, 500.0)?;
            let name = format!("tension {}, e = {e:.1}", if tension { "on" } else { "off" });
            rows.push(Measured::new(name, found));
        }
    }
    for gamma in [0.21545, 0.25528] {
        let (mass, stiffness): (Real, Real) = (1e-6, 1e4);
        let normal = 2.0 * gamma * (mass * stiffness).sqrt();
        let law = law(stiffness, Damping::Literal { normal, tangential: 0.0 }, 0.0);
        let [found, _] = rebound(law, mass, 500.0)?;
        rows.push(Measured::new(format!("no tension, damping ratio {gamma}"), found));
    }
    // The contact of an undamped and of a damped spring.
    for gamma in [0.0, 0.2] {
        let (mass, stiffness): (Real, Real) = (1e-6, 1e4);
        let normal = 2.0 * gamma * (mass * stiffness).sqrt();
        let law =
            LinearSpringDashpot { tension: true, ..law(stiffness, Damping::Literal { normal, tangential: 0.0 }, 0.0) };
        let [_, touching] = rebound(law, mass, 2000.0)?;
        let name = format!("time of contact, damping ratio {gamma}");
        rows.push(Measured::new(name, touching));
    }
    // The paper's dashpot on its own grain at a wall, and on half of it for a pair.
    for (name, mass) in [
        ("paper's law, M = 1.93e-7 kg, pair", 0.5 * 1.93e-7),
        ("paper's law, M = 1.93e-7 kg, wall", 1.93e-7),
        ("paper's law, M = 3.93e-7 kg, pair", 0.5 * 3.93e-7),
        ("paper's law, M = 3.93e-7 kg, wall", 3.93e-7),
    ] {
        let law = LinearSpringDashpot { tension: true, friction: 0.0, ..LinearSpringDashpot::SAND };
        let [found, _] = rebound(law, mass, 1000.0)?;
        rows.push(Measured::new(name, found));
    }
    let coarse = rebound(law(1e4, Damping::Restitution(0.5), 0.0), 1e-6, 8.0)?[0];
    rows.push(Measured::new("control: error with 8 steps in a contact", (coarse - 0.5).abs()));
    rows.push(Measured::new("closed form without tension at 0.21545", restitution(0.21545, false)));
    Ok(rows)
}

/// Height of the `k`-th apex of a ball dropped from 0.5 m, for k = 1..=3.
fn apexes(stiffness: Real, e: Real) -> Result<[Real; 3], String> {
    let radius = 0.1;
    let mass = ball_mass(radius, 2600.0);
    let grain = Grain::new(1, 2600.0, Vector::new(0.0, 0.0, 0.5));
    let mut bench =
        Bench::new(Body::ball(radius), law(stiffness, Damping::Restitution(e), 0.0), Bench::floor(), &[grain])?;
    let dt = (PI * (mass / stiffness).sqrt() / 300.0).min(1e-4);
    let (mut found, mut rising, mut number) = ([0.0; 3], false, 0);
    while number < 3 {
        bench.step(down(9.81), dt)?;
        let (z, w) = (bench.grains().position[0].z, bench.grains().velocity[0].z);
        if rising && w <= 0.0 {
            found[number] = z;
            number += 1;
        }
        rising = w > 0.0;
    }
    Ok(found)
}

/// The apexes of a bouncing ball tend to those of a hard one as the spring stiffens.
pub(crate) fn bouncing() -> Result<Vec<Measured>, String> {
    let (e, radius): (Real, Real) = (0.9, 0.1);
    let hard = [1, 2, 3].map(|k| (0.5 - radius) * e.powi(2 * k) + radius);
    let mut errors = Vec::new();
    for stiffness in [5e4, 5e5, 5e6] {
        let found = apexes(stiffness, e)?;
        errors.push(largest((0..3).map(|k| (found[k] / hard[k] - 1.0).abs())));
    }
    Ok(vec![
        Measured::new("largest error of three apexes, K = 5e4 N/m", errors[0]),
        Measured::new("the same, K = 5e5 N/m, over that at 5e4", errors[1] / errors[0]),
        Measured::new("the same, K = 5e6 N/m, over that at 5e5", errors[2] / errors[1]),
        Measured::new("largest error, K = 5e6 N/m", errors[2]),
        Measured::new("control: error of the first apex with e = 0.8", (apexes(5e6, 0.8)?[0] / hard[0] - 1.0).abs()),
    ])
}

/// Converged solution of the linear contact: angle of impact from the normal, of rebound [deg], ratio of tangential
/// velocities, spin [rad/s].
fn converged() -> Vec<[Real; 4]> {
    reference::rows(OBLIQUE, "linear", ["angle_in_deg", "rebound_deg", "tangential_velocity_ratio", "spin_rad_per_s"])
}

/// Angle of rebound [deg], ratio of tangential velocities and spin [rad/s] after an impact at `angle` [deg]. Springs
/// `hardness` times as stiff as in the experiment's description pose the same problem with less overlap; `softness`
/// divides the tangential one alone.
fn oblique_impact(angle: Real, hardness: Real, softness: Real) -> Result<[Real; 3], String> {
    let (radius, speed, stiffness) = (2.5e-3, 3.9, 1.72e7 * hardness);
    let mass = ball_mass(radius, 4000.0);
    let law = LinearSpringDashpot {
        normal_stiffness: stiffness,
        tangential_stiffness: 1.48e7 * hardness / softness,
        damping: Damping::Restitution(1.0),
        friction: 0.092,
        ..LinearSpringDashpot::SAND
    };
    let (sine, cosine) = angle.to_radians().sin_cos();
    let dt = PI * (mass / stiffness).sqrt() / 2000.0;
    let grain = Grain {
        velocity: speed * Vector::new(sine, 0.0, -cosine),
        ..Grain::new(1, 4000.0, Vector::new(0.0, 0.0, radius * (1.0 + 1e-12)))
    };
    let mut bench = Bench::new(Body::ball(radius), law, Bench::floor(), &[grain])?;
    for _ in 0..4000 {
        if bench.step(Vector::ZERO, dt)?.contacts == 0 && bench.grains().velocity[0].z > 0.0 {
            break;
        }
    }
    let v = bench.grains().velocity[0];
    let spin = bench.grains().angular_velocity(0).length();
    Ok([v.x.atan2(v.z).to_degrees(), v.x / (speed * sine), spin])
}

/// Largest relative errors of angle, velocity ratio and spin against the converged solution.
fn oblique_errors(hardness: Real) -> Result<[Real; 3], String> {
    let mut worst: [Real; 3] = [0.0; 3];
    for row in converged() {
        let found = oblique_impact(row[0], hardness, 1.0)?;
        for n in 0..3 {
            worst[n] = largest([worst[n], (found[n] / row[n + 1] - 1.0).abs()]);
        }
    }
    Ok(worst)
}

/// Largest relative error in gross sliding, which has a closed form.
fn sliding_error(hardness: Real) -> Result<Real, String> {
    let (radius, speed, friction) = (2.5e-3, 3.9, 0.092);
    let mut worst: Real = 0.0;
    for angle in [40.0, 50.0, 60.0] {
        let (sine, cosine) = Real::to_radians(angle).sin_cos();
        let [_, ratio, spin] = oblique_impact(angle, hardness, 1.0)?;
        let exact_ratio = 1.0 - 2.0 * friction * cosine / sine;
        let exact_spin = 5.0 * friction * 2.0 * speed * cosine / (2.0 * radius);
        worst = largest([worst, (ratio / exact_ratio - 1.0).abs(), (spin / exact_spin - 1.0).abs()]);
    }
    Ok(worst)
}

/// Oblique impact of a sphere on a wall.
///
/// The converged solution lets friction act at the radius of the sphere. Here it acts in the middle of the overlap, up
/// to 0.24 % nearer to the centre with the stiffness given; springs 10^4 times as stiff take the difference away.
pub(crate) fn oblique() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let mut rows = Vec::new();
    for (name, hardness) in [("stiffness as given", 1.0), ("hard limit", 1e4)] {
        let errors = oblique_errors(hardness)?;
        for (quantity, error) in ["rebound angle", "tangential velocity ratio", "spin"].into_iter().zip(errors) {
            let quantity = format!("{name}: largest error of the {quantity}, 2.5-60 deg");
            rows.push(Measured::new(quantity, error));
        }
        let sliding = sliding_error(hardness)?;
        rows.push(Measured::new(format!("{name}: gross sliding, largest error"), sliding));
    }
    let mut off: Real = 0.0;
    for [angle, rebound] in reference::rows(OBLIQUE, "experiment", ["angle_in_deg", "rebound_deg"]) {
        off = off.max((oblique_impact(angle, 1.0, 1.0)?[0] - rebound).abs());
    }
    rows.push(Measured::new("largest difference from the measured rebound angle", off));
    let soft = oblique_impact(10.0, 1.0, 100.0)?[2] / converged()[2][3];
    rows.push(Measured::new("control: error at 10 deg, tangential spring 100 times softer", (soft - 1.0).abs()));
    Ok((rows, oblique_curves()?))
}

/// Rebound and spin against the angle of impact, beside the converged solution and the experiment.
fn oblique_curves() -> Result<Vec<Chart>, String> {
    let angles: Vec<Real> = (1..=24).map(|n| 2.5 * Real::from(n)).collect();
    let found: Result<Vec<[Real; 3]>, String> = angles.iter().map(|&angle| oblique_impact(angle, 1.0, 1.0)).collect();
    let found = found?;
    let chart = |title: &str, ordinate: &str, n: usize, column: &str| {
        let curve: Vec<[Real; 2]> = angles.iter().zip(&found).map(|(angle, found)| [*angle, found[n]]).collect();
        let table = |key| reference::rows(OBLIQUE, key, ["angle_in_deg", column]);
        Chart::new(title, "angle of impact [deg]", ordinate)
            .computed("computed", &curve)
            .reference("converged", &table("linear"))
            .reference("Kharaz et al.", &table("experiment"))
    };
    Ok(vec![
        chart("Rebound angle", "angle of rebound [deg]", 0, "rebound_deg"),
        chart("Spin", "spin [rad/s]", 2, "spin_rad_per_s"),
    ])
}

/// A ball that rests on the floor under the normal gravity `g`.
fn lying(radius: Real, density: Real, law: &LinearSpringDashpot, g: Real) -> Grain {
    let overlap = ball_mass(radius, density) * g / law.normal_stiffness;
    Grain::new(1, density, Vector::new(0.0, 0.0, radius - overlap))
}

/// A ball that slips on a plane comes to roll.
pub(crate) fn slip_to_roll() -> Result<Vec<Measured>, String> {
    let (radius, density, speed, friction, g): (Real, Real, Real, Real, Real) = (0.05, 2000.0, 1.0, 0.3, 9.81);
    let run = |friction: Real| -> Result<[Real; 3], String> {
        let mut law = law(1e6, Damping::Restitution(0.5), friction);
        law.tangential_stiffness = 2e6;
        let grain = Grain { velocity: Vector::new(speed, 0.0, 0.0), ..lying(radius, density, &law, g) };
        let mut bench = Bench::new(Body::ball(radius), law, Bench::floor(), &[grain])?;
        let (dt, mut time, mut end) = (1e-5, 0.0, None);
        while time < 0.2 {
            bench.step(down(g), dt)?;
            time += dt;
            let slip = bench.grains().velocity[0].x - radius * bench.grains().angular_velocity(0).y;
            if end.is_none() && slip <= 0.0 {
                end = Some(time);
            }
        }
        let spin = bench.grains().angular_velocity(0).y * radius;
        Ok([end.unwrap_or(Real::INFINITY), bench.grains().velocity[0].x, spin])
    };
    let [end, v, spin] = run(friction)?;
    Ok(vec![
        Measured::new("end of slipping", end),
        Measured::new("velocity", v),
        Measured::new("spin times radius", spin),
        Measured::new("control: velocity with a tenth of the friction", run(0.1 * friction)?[1]),
    ])
}

/// Mean acceleration over 0.5 s of a ball let go on an incline [m/s^2].
fn ball_on_incline(degrees: Real, friction: Real) -> Result<Real, String> {
    let (radius, density, g) = (0.05, 2000.0, 9.81);
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let law = law(1e6, Damping::Restitution(0.5), friction);
    let grain = lying(radius, density, &law, g * cosine);
    let mut bench = Bench::new(Body::ball(radius), law, Bench::floor(), &[grain])?;
    let gravity = g * Vector::new(sine, 0.0, -cosine);
    (0..50_000).try_for_each(|_| bench.step(gravity, 1e-5).map(drop))?;
    Ok(bench.grains().velocity[0].x / 0.5)
}

/// Speed at which a block of four spheres creeps down an incline at rest [diameters per second], and the list
/// renewals meanwhile; with `history` the tangential springs hold it, without only dashpots do.
fn creep(degrees: Real, history: bool) -> Result<[Real; 2], String> {
    let (radius, density, g) = (5e-3, 2000.0, 9.81);
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let centres =
        [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| 2.0 * radius * Vector::new(x, y, 0.0));
    let volume = 4.0 * ball_mass(radius, 1.0);
    // As broad as a block of that size; it is flat and does not tip.
    let inertia = volume * radius * radius * Vector::new(8.0, 8.0, 16.0);
    let body = Body::new(volume, inertia, centres.to_vec(), vec![radius; 4], 4.0 * radius);
    let weight = density * volume * g;
    let damping = 2.0 * 0.3 * (density * volume * 1e5).sqrt() / 4.0;
    let mut law = law(1e5, Damping::Literal { normal: damping, tangential: damping }, 0.6);
    law.tangential_stiffness = if history { 1e5 } else { 1e-9 };
    let overlap = weight * cosine / 4.0 / law.normal_stiffness;
    // A second, fast one passes high above and makes the lists expire.
    let flying =
        Grain { velocity: Vector::new(0.0, 20.0, 0.0), ..Grain::new(2, density, Vector::new(0.0, -20.0, 30.0)) };
    let grains = [Grain::new(1, density, Vector::new(0.0, 0.0, radius - overlap)), flying];
    let mut bench = Bench::new(body, law, Bench::floor(), &grains)?;
    let gravity = g * Vector::new(sine, 0.0, -cosine);
    let dt = 2e-5;
    (0..25_000).try_for_each(|_| bench.step(gravity, dt).map(drop))?;
    let (start, mut renewals) = (bench.grains().position[0].x, 0);
    for _ in 0..50_000 {
        renewals += bench.step(gravity, dt)?.list_renewals;
    }
    Ok([(bench.grains().position[0].x - start) / (50_000.0 * dt) / (2.0 * radius), renewals as Real])
}

/// Rolling, sliding and sticking on an incline.
pub(crate) fn incline() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for degrees in [10.0, 20.0, 30.0] {
        let name = format!("rolling at {degrees} deg");
        let found = ball_on_incline(degrees, 0.6)?;
        rows.push(Measured::new(name, found));
    }
    rows.push(Measured::new("sliding at 30 deg, friction 0.1", ball_on_incline(30.0, 0.1)?));
    let [stuck, renewals] = creep(28.0, true)?;
    rows.push(Measured::new("creep of a block at 28 deg, friction 0.6", stuck.abs()));
    rows.push(Measured::new("list renewals meanwhile", renewals));
    rows.push(Measured::new("control: creep without tangential springs", creep(28.0, false)?[0]));
    Ok(rows)
}
