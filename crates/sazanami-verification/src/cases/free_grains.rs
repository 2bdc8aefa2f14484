//! Grains without a fluid: rotation, conservation, neighbour lists.

use std::f64::consts::PI;

use sazanami_dem::{Body, Damping, Grain, Grains, LinearSpringDashpot, Loads, Random, Substeps, Wall};
use sazanami_numerics::{Matrix, Quaternion, Real, Vector};

use super::contact::Bench;
use super::single_phase::each;
use super::tank::largest;
use crate::measured::Measured;

/// Each component between -1 and 1.
fn vector(random: &mut Random) -> Vector {
    Vector::from_array(std::array::from_fn(|_| random.between(-1.0, 1.0)))
}

const AXES: [Real; 2] = [0.26e-3, 0.635e-3];

/// The paper's grain spins freely about an oblique axis.
pub(crate) fn free_rotation() -> Result<Vec<Measured>, String> {
    let body = Body::prolate(AXES[0], AXES[1], 9);
    let ratio = body.inertia.z / body.inertia.x;
    let orientation = Quaternion::from_axis_angle(Vector::new(0.3, 0.5, -0.2).normalize(), 1.1);
    let rotation = Matrix::from_quat(orientation);
    let spin = Vector::new(30.0, 0.0, 100.0);
    let inertia = 2650.0 * body.inertia;
    let grain = Grain { orientation, angular_velocity: rotation * spin, ..Grain::new(1, 2650.0, Vector::ZERO) };
    let mut bench = Bench::new(body, LinearSpringDashpot::SAND, Vec::new(), &[grain])?;
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
    Ok(vec![
        Measured::new("axial over transverse moment", ratio),
        Measured::new(
            "change of angular momentum, 1e4 steps",
            (grains.angular_momentum[0] - momentum).length() / momentum.length(),
        ),
        Measured::new("change of energy", (grains.kinetic_energy(0) / energy - 1.0).abs()),
        Measured::new("precession in the body frame over axial spin", rate),
        Measured::new("control: change of energy with Euler steps", (naive_energy / energy - 1.0).abs()),
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

/// Conservation in a swarm of colliding grains.
struct Kept {
    /// Change of momentum and of angular momentum over the sum of the grains' own.
    momentum: [Real; 2],
    /// Largest change of the energy over that at the start.
    energy: Real,
    /// Largest rise of the energy above what it had been before, over that at the start.
    rise: Real,
    /// Energy at the end over that at the start.
    left: Real,
    collisions: usize,
}

/// The swarm for `time` \[s] in sub-steps `refinement` times as short as the automatic one.
fn collide(law: LinearSpringDashpot, refinement: Real, time: Real) -> Result<Kept, String> {
    let grains = swarm(1.0);
    let mut bench = Bench::new(Body::prolate(AXES[0], AXES[1], 9), law, Vec::new(), &grains)?;
    let start = momenta(bench.grains());
    let energy = kinetic(bench.grains());
    let scale = {
        let g = bench.grains();
        let p = |n: usize| g.mass[n] * g.velocity[n];
        let turning = |n: usize| g.angular_momentum[n].length() + g.position[n].cross(p(n)).length();
        [(0..g.len()).map(|n| p(n).length()).sum::<Real>(), (0..g.len()).map(turning).sum()]
    };
    let sub = bench.engine.contact_time_step() / refinement;
    let mut kept = Kept { momentum: [0.0; 2], energy: 0.0, rise: 0.0, left: 1.0, collisions: 0 };
    let (mut lowest, mut pairs) = (energy, 0);
    for _ in 0..(time / sub) as usize {
        let report = bench.step(Vector::ZERO, sub)?;
        kept.collisions += report.pairs.saturating_sub(pairs);
        pairs = report.pairs;
        let now = kinetic(bench.grains()) + bench.engine.elastic_energy();
        kept.rise = kept.rise.max((now - lowest) / energy);
        kept.energy = kept.energy.max((now / energy - 1.0).abs());
        lowest = lowest.min(now);
        kept.left = now / energy;
    }
    for (n, (now, start)) in momenta(bench.grains()).into_iter().zip(start).enumerate() {
        kept.momentum[n] = (now - start).length() / scale[n];
    }
    Ok(kept)
}

/// A closed swarm keeps momentum; elastic, it keeps energy.
pub(crate) fn swarm_budget() -> Result<Vec<Measured>, String> {
    let elastic =
        LinearSpringDashpot { damping: Damping::Restitution(1.0), friction: 0.0, ..LinearSpringDashpot::SAND };
    // The sign of the tangential dashpot in eq. (5) as printed feeds energy.
    let printed = LinearSpringDashpot {
        damping: Damping::Literal { normal: 0.0, tangential: -2.95e-3 },
        ..LinearSpringDashpot::SAND
    };
    // Without the tangential dashpot, whose spring is set against it in slip and holds energy only on paper.
    let rubbing = LinearSpringDashpot {
        damping: Damping::Literal { normal: 2.95e-3, tangential: 0.0 },
        ..LinearSpringDashpot::SAND
    };
    let (damped, rubbed) = (collide(LinearSpringDashpot::SAND, 1.0, 2e-3)?, collide(rubbing, 32.0, 6e-4)?);
    let [coarse, half, fine] = each([1.0, 2.0, 8.0], |refinement| collide(elastic, refinement, 1.2e-3))?;
    let pumped = collide(printed, 8.0, 6e-4)?;
    Ok(vec![
        Measured::new("damped: collisions", damped.collisions as Real),
        Measured::new("damped: change of momentum", damped.momentum[0]),
        Measured::new("damped: change of angular momentum", damped.momentum[1]),
        Measured::new("damped: energy left", damped.left),
        Measured::new("damped: largest rise of energy, springs against dashpots included", damped.rise),
        Measured::new("no tangential dashpot, a 32nd of the sub-step: largest rise of energy", rubbed.rise),
        Measured::new("elastic: largest change of energy, auto sub-steps", coarse.energy),
        Measured::new("elastic: the same over that with half of them", coarse.energy / half.energy),
        Measured::new("elastic: the same with an eighth of them", fine.energy),
        Measured::new("control: rise with the sign of eq. (5) as printed", pumped.rise),
    ])
}

/// A law without friction: all forces follow from the present poses and velocities.
const PLAIN: LinearSpringDashpot = LinearSpringDashpot {
    friction: 0.0,
    damping: Damping::Literal { normal: 1e-2, tangential: 0.0 },
    ..LinearSpringDashpot::SAND
};

/// Largest difference of the engine's contact forces and torques from those of all pairs, over the largest of either; 0
/// where nothing pushes.
fn difference(bench: &Bench, body: &Body) -> Real {
    let grains = bench.grains();
    let (forces, torques) = all_pairs(body, grains, bench.engine.walls());
    let off = |pairs: &[Vector], lists: &[Vector]| {
        let scale = largest(pairs.iter().chain(lists).map(|v| v.length()));
        largest(pairs.iter().zip(lists).map(|(a, b)| (*a - *b).length())) / scale.max(Real::MIN_POSITIVE)
    };
    off(&forces, &grains.contact_force).max(off(&torques, &grains.contact_torque))
}

/// Forces from lists are those from all pairs, while grains fall into a box and come to rest.
pub(crate) fn neighbour_lists() -> Result<Vec<Measured>, String> {
    let body = Body::prolate(AXES[0], AXES[1], 9);
    let mut random = Random::new(11);
    let width = 4.2e-3;
    let grains: Vec<Grain> = (0..243_u64)
        .map(|n| {
            let place = Vector::new((n % 3) as Real, (n / 3 % 3) as Real, (n / 9) as Real);
            Grain {
                orientation: random.orientation(),
                velocity: Vector::new(0.0, 0.0, -0.6) + 0.2 * vector(&mut random),
                ..Grain::new(n, 2650.0, 0.7e-3 * Vector::ONE + 1.4e-3 * place)
            }
        })
        .collect();
    let walls =
        Wall::of_box(Vector::ZERO, Vector::new(width, width, 1.0), 0, [[true, true], [true, true], [true, false]]);
    let mut bench = Bench::new(body.clone(), PLAIN, walls, &grains)?;
    let gravity = Vector::new(0.0, 0.0, -40.0);
    let (mut worst, mut renewals, mut contacts): (Real, usize, usize) = (0.0, 0, 0);
    for _ in 0..40 {
        let Bench { domain, engine } = &mut bench;
        let report =
            engine.advance(domain, &Loads::none(), gravity, 2e-3, Substeps::Auto).map_err(|error| error.to_string())?;
        renewals += report.list_renewals;
        contacts = report.contacts;
        // No time passes: the forces of this sub-step belong to the present poses.
        bench.step(Vector::ZERO, 1e-18)?;
        worst = worst.max(difference(&bench, &body));
    }
    // Control: a sub-step's forces act at its middle; at its end they are others.
    bench.step(gravity, 1e-6)?;
    let stale = difference(&bench, &body);
    Ok(vec![
        Measured::new("largest difference from all pairs, 40 looks", worst),
        Measured::new("contacts at the end", contacts as Real),
        Measured::new("list renewals meanwhile", renewals as Real),
        Measured::new("control: difference half a microsecond later", stale),
    ])
}

/// Normal forces and torques of all pairs of spheres and of all spheres with all walls.
fn all_pairs(body: &Body, grains: &Grains, walls: &[Wall]) -> (Vec<Vector>, Vec<Vector>) {
    let place = |n: usize| {
        let spheres = body.centres.iter().zip(&body.radii);
        spheres.map(move |(c, r)| (grains.position[n] + grains.orientation[n] * *c, *r))
    };
    let dashpot = match PLAIN.damping {
        Damping::Literal { normal, .. } => normal,
        Damping::Restitution(_) | Damping::RestitutionAndRatio { .. } => 0.0,
    };
    let push = |overlap: Real, closing: Real| (PLAIN.normal_stiffness * overlap + dashpot * closing).max(0.0);
    let (mut force, mut torque) = (vec![Vector::ZERO; grains.len()], vec![Vector::ZERO; grains.len()]);
    let mut act = |n: usize, at: Vector, h: Vector| {
        force[n] += h;
        torque[n] += (at - grains.position[n]).cross(h);
    };
    for i in 0..grains.len() {
        for j in i + 1..grains.len() {
            if (grains.position[i] - grains.position[j]).length() > 2.0 * body.bounding_radius {
                continue;
            }
            for (a, ra) in place(i) {
                for (b, rb) in place(j) {
                    let distance = (b - a).length();
                    let overlap = ra + rb - distance;
                    if overlap > 0.0 {
                        let normal = (b - a) / distance;
                        let at = a + (ra - 0.5 * overlap) * normal;
                        let closing = (grains.velocity_at(i, at) - grains.velocity_at(j, at)).dot(normal);
                        let h = push(overlap, closing) * normal;
                        act(i, at, -h);
                        act(j, at, h);
                    }
                }
            }
        }
        for wall in walls {
            for (a, ra) in place(i) {
                let overlap = ra - wall.distance(a);
                if overlap > 0.0 {
                    let at = a - (ra - 0.5 * overlap) * wall.normal;
                    let closing = -grains.velocity_at(i, at).dot(wall.normal);
                    act(i, at, push(overlap, closing) * wall.normal);
                }
            }
        }
    }
    (force, torque)
}
