//! Grains without a fluid: rotation, conservation, neighbour lists.

use std::f64::consts::PI;

use sazanami_dem::{Body, ContactLaw, Damping, Grain, Grains, Random, Substeps};
use sazanami_numerics::{Matrix, Quaternion, Real, Vector};

use super::contact::Bench;
use crate::verify::Measured;

/// Each component between -1 and 1.
fn vector(random: &mut Random) -> Vector {
    Vector::from_array(std::array::from_fn(|_| random.between(-1.0, 1.0)))
}

const AXES: [Real; 2] = [0.26e-3, 0.635e-3];

/// 4.7: the paper's grain spins freely about an oblique axis.
pub(super) fn free_rotation() -> Result<Vec<Measured>, String> {
    let body = Body::prolate(AXES[0], AXES[1], 9);
    let ratio = body.inertia.z / body.inertia.x;
    let orientation = Quaternion::from_axis_angle(Vector::new(0.3, 0.5, -0.2).normalize(), 1.1);
    let rotation = Matrix::from_quat(orientation);
    let spin = Vector::new(30.0, 0.0, 100.0);
    let inertia = 2650.0 * body.inertia;
    let grain = Grain { orientation, angular_velocity: rotation * spin, ..Grain::new(1, 2650.0, Vector::ZERO) };
    let mut bench = Bench::new(body, ContactLaw::SAND, Vec::new(), &[grain])?;
    let momentum = bench.grains().angular_momentum[0];
    let energy = bench.grains().kinetic_energy(0);
    let (dt, steps) = (1e-5, 10_000);
    let (mut angle, mut before) = (0.0, 0.0);
    let mut naive = orientation;
    for _ in 0..steps {
        bench.step(Vector::ZERO, dt)?;
        let grains = bench.grains();
        let local = Matrix::from_quat(grains.orientation[0]).transpose() * grains.angular_velocity(0);
        let now = local.y.atan2(local.x);
        angle += (now - before + 3.0 * PI).rem_euclid(2.0 * PI) - PI;
        before = now;
        // Control: first order, with the spin at the start of the step.
        let turn = Matrix::from_quat(naive);
        let omega = turn * ((turn.transpose() * momentum) / inertia);
        let half = 0.5 * dt * omega;
        naive = (Quaternion::from_xyzw(half.x, half.y, half.z, 1.0) * naive).normalize();
    }
    let grains = bench.grains();
    let turn = Matrix::from_quat(naive);
    let naive_energy = 0.5 * momentum.dot(turn * ((turn.transpose() * momentum) / inertia));
    let rate = angle / (Real::from(steps) * dt) / spin.z;
    let source = "rigid body without moments";
    Ok(vec![
        Measured::near("axial over transverse moment", "", ratio, 0.28716, 2e-5).from_source("2 a^2/(a^2 + c^2)"),
        Measured::within("change of angular momentum, 1e4 steps", "",
            (grains.angular_momentum[0] - momentum).length() / momentum.length(), 0.0, 1e-10).from_source(source),
        Measured::within("change of energy", "", (grains.kinetic_energy(0) / energy - 1.0).abs(), 0.0, 1e-6)
            .from_source(source),
        Measured::near("precession in the body frame over axial spin", "", rate, -0.71284, 1e-4).from_source(source),
        Measured::within("control: change of energy with Euler steps", "", (naive_energy / energy - 1.0).abs(), 1e-6,
            Real::INFINITY).from_source("negative control"),
    ])
}

/// Grains in a cube that fly towards its middle.
fn swarm(speed: Real) -> Vec<Grain> {
    let mut random = Random::new(7);
    let spacing = 1.32e-3;
    (0..100_u64)
        .map(|n| {
            let place = Vector::new((n % 5) as Real - 2.0, (n / 5 % 5) as Real - 2.0, (n / 25) as Real - 1.5);
            let position = spacing * place;
            Grain {
                orientation: random.orientation(),
                velocity: speed * (0.3 * vector(&mut random) - 0.5 * place),
                angular_velocity: 200.0 * vector(&mut random),
                ..Grain::new(n, 2650.0, position)
            }
        })
        .collect()
}

fn momenta(grains: &Grains) -> [Vector; 2] {
    let mut sum = [Vector::ZERO; 2];
    for n in 0..grains.len() {
        let p = grains.mass[n] * grains.velocity[n];
        sum[0] += p;
        sum[1] += grains.angular_momentum[n] + grains.position[n].cross(p);
    }
    sum
}

fn kinetic(grains: &Grains) -> Real {
    (0..grains.len()).map(|n| grains.kinetic_energy(n)).sum()
}

/// How much a swarm of colliding grains keeps.
struct Kept {
    momentum: [Real; 2],
    energy: Real,
    /// Largest rise of the energy between two looks over that at the start.
    rise: Real,
    collisions: Real,
}

fn collide(law: ContactLaw, refinement: Real) -> Result<Kept, String> {
    let grains = swarm(0.3);
    let mut bench = Bench::new(Body::prolate(AXES[0], AXES[1], 9), law, Vec::new(), &grains)?;
    let start = momenta(bench.grains());
    let energy = kinetic(bench.grains());
    let scale = [
        grains.iter().map(|grain| grain.velocity.length()).sum::<Real>() * bench.grains().mass[0],
        (0..grains.len())
            .map(|n| {
                let g = bench.grains();
                g.angular_momentum[n].length() + g.position[n].cross(g.mass[n] * g.velocity[n]).length()
            })
            .sum::<Real>(),
    ];
    let sub = bench.engine.contact_time_step() / refinement;
    let (mut last, mut rise, mut worst, mut collisions) = (energy, 0.0, 0.0, 0.0);
    let mut momentum: [Real; 2] = [0.0; 2];
    let steps = (12e-3 / sub) as usize;
    for _ in 0..steps {
        let report = bench.step(Vector::ZERO, sub)?;
        collisions = Real::max(collisions, report.contacts as Real);
        let now = kinetic(bench.grains()) + bench.engine.elastic_energy();
        rise = Real::max(rise, (now - last) / energy);
        worst = Real::max(worst, (now / energy - 1.0).abs());
        last = now;
    }
    for (n, (now, start)) in momenta(bench.grains()).into_iter().zip(start).enumerate() {
        momentum[n] = (now - start).length() / scale[n];
    }
    Ok(Kept { momentum, energy: worst, rise, collisions })
}

/// 4.8: a closed swarm keeps momentum; elastic, it keeps energy.
pub(super) fn swarm_budget() -> Result<Vec<Measured>, String> {
    let elastic = ContactLaw { damping: Damping::Restitution(1.0), friction: 0.0, ..ContactLaw::SAND };
    let damped = collide(ContactLaw::SAND, 1.0)?;
    let [coarse, fine] = [collide(elastic, 1.0)?, collide(elastic, 2.0)?];
    let finest = collide(elastic, 16.0)?;
    let source = "conservation";
    // The sign of eq. (5) as printed feeds energy through the tangential dashpot: shown with a negative one.
    let pumped = collide(
        ContactLaw { damping: Damping::Literal { normal: 0.0, tangential: -2.95e-3 }, ..ContactLaw::SAND },
        1.0,
    )?;
    Ok(vec![
        Measured::within("most contacts at a time", "", damped.collisions, 20.0, Real::INFINITY),
        Measured::within("damped: change of momentum", "", damped.momentum[0], 0.0, 1e-12).from_source(source),
        Measured::within("damped: change of angular momentum", "", damped.momentum[1], 0.0, 1e-12).from_source(source),
        Measured::within("damped: largest rise of energy in a sub-step", "", damped.rise, -1.0, 1e-6)
            .from_source("dissipation"),
        Measured::within("elastic: largest change of energy, auto sub-steps", "", coarse.energy, 0.0, 1e-2)
            .from_source(source),
        Measured::within("elastic: the same over that with half sub-steps", "", coarse.energy / fine.energy, 3.0,
            Real::INFINITY).from_source("second order in time"),
        Measured::within("elastic: the same at a sixteenth", "", finest.energy, 0.0, 1e-4).from_source(source),
        Measured::within("control: rise of energy with the sign of eq. (5) as printed", "", pumped.rise, 1e-6,
            Real::INFINITY).from_source("negative control"),
    ])
}

/// 4.9: forces from lists are those from all pairs.
pub(super) fn neighbour_lists() -> Result<Vec<Measured>, String> {
    let body = Body::prolate(AXES[0], AXES[1], 9);
    let law = ContactLaw { damping: Damping::Literal { normal: 0.0, tangential: 0.0 }, friction: 0.0, ..ContactLaw::SAND };
    let mut random = Random::new(11);
    let grains: Vec<Grain> = (0..400)
        .map(|n| Grain {
            orientation: random.orientation(),
            velocity: 0.2 * vector(&mut random),
            ..Grain::new(n, 2650.0, 3.2e-3 * vector(&mut random))
        })
        .collect();
    // Grains placed at random overlap a lot: shrink them until none is deeper than the law allows.
    let mut scale: Real = 1.0;
    let mut placed = grains.clone();
    while brute_force(&body, &placed, law.normal_stiffness).2 > 0.5 {
        scale *= 0.97;
        placed.iter_mut().for_each(|grain| grain.scale = scale);
    }
    let mut bench = Bench::new(body.clone(), law, Vec::new(), &placed)?;
    let differ = |bench: &Bench| {
        let now: Vec<Grain> = (0..bench.grains().len())
            .map(|n| Grain {
                position: bench.grains().position[n],
                orientation: bench.grains().orientation[n],
                ..placed[n]
            })
            .collect();
        let (forces, torques, _) = brute_force(&body, &now, law.normal_stiffness);
        let largest = forces.iter().map(|f| f.length()).fold(0.0, Real::max);
        let turning = torques.iter().map(|t| t.length()).fold(0.0, Real::max);
        let force = |n: usize| (bench.grains().contact_force[n] - forces[n]).length() / largest;
        let torque = |n: usize| (bench.grains().contact_torque[n] - torques[n]).length() / turning;
        (0..now.len()).map(|n| force(n).max(torque(n))).fold(0.0, Real::max)
    };
    let mut worst: Real = 0.0;
    let mut renewals = 0;
    for _ in 0..40 {
        let report = bench
            .engine
            .advance(&bench.domain, &sazanami_dem::Loads::none(), Vector::ZERO, 5e-5, Substeps::Auto)
            .map_err(|error| error.to_string())?;
        renewals += report.list_renewals;
        // Forces at a standstill: the poses at which they acted are the present ones.
        bench.step(Vector::ZERO, 1e-18)?;
        worst = worst.max(differ(&bench));
    }
    // Control: forces one short step later are not those from before.
    let mut later = bench;
    later.step(Vector::ZERO, 2e-6)?;
    later.step(Vector::ZERO, 2e-6)?;
    let stale = differ(&later);
    Ok(vec![
        Measured::within("largest difference from all pairs, 40 looks", "", worst, 0.0, 1e-10).from_source("all pairs"),
        Measured::within("list renewals meanwhile", "", renewals as Real, 5.0, Real::INFINITY),
        Measured::within("control: difference with poses 1 us apart", "", stale, 1e-8, Real::INFINITY)
            .from_source("negative control"),
    ])
}

/// Elastic forces and torques of all pairs of spheres, and the largest overlap over the smaller radius.
fn brute_force(body: &Body, grains: &[Grain], stiffness: Real) -> (Vec<Vector>, Vec<Vector>, Real) {
    let placed: Vec<Vec<(Vector, Real)>> = grains
        .iter()
        .map(|grain| {
            let place = |(c, r): (&Vector, &Real)| (grain.position + grain.orientation * (*c * grain.scale), r * grain.scale);
            body.centres.iter().zip(&body.radii).map(place).collect()
        })
        .collect();
    let mut force = vec![Vector::ZERO; grains.len()];
    let mut torque = force.clone();
    let mut deepest: Real = 0.0;
    for i in 0..grains.len() {
        for j in i + 1..grains.len() {
            for &(a, ra) in &placed[i] {
                for &(b, rb) in &placed[j] {
                    let distance = (b - a).length();
                    let overlap = ra + rb - distance;
                    if overlap > 0.0 {
                        deepest = deepest.max(overlap / ra.min(rb));
                        let n = (b - a) / distance;
                        let at = a + (ra - 0.5 * overlap) * n;
                        let h = -stiffness * overlap * n;
                        force[i] += h;
                        force[j] -= h;
                        torque[i] += (at - grains[i].position).cross(h);
                        torque[j] -= (at - grains[j].position).cross(h);
                    }
                }
            }
        }
    }
    (force, torque, deepest)
}
