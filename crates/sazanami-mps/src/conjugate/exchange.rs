//! Exchange between neighbours without the pressure: viscosity, damping of non-linear motion, mean gradients.
//!
//! A pair parts by `m = (u_j - u_i).e - e.(L_i + L_j) r/2` faster than the velocity gradients `L` of its particles let it.
//! The damping is the negative gradient of `sum (w/n0) m^2/2` over all pairs with respect to the velocities: that of `m` itself
//! pulls along the pair, that of `L` acts as a stress does. It takes energy only, and keeps momentum and angular momentum.

use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::mirrors::{DIRECTIONS, Turned, gate_of, turn};
use super::pairs::{Neighbour, Pairs, times};
use super::voids::Bulk;
use crate::boundary::{Tank, WallFriction};
use crate::gates::Gate;
use crate::matrix::Block;
use crate::moments::{Symmetric, add};
use crate::neighbours::ROWS;
use crate::particles::Kind;
use crate::scheme::Kernel;
use crate::weight::COINCIDENT;

/// Sums over the neighbours of a particle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Received {
    /// Laplacian of the velocity, with eddies `div((1 + nu_t/nu) grad u)` [1/(m s)].
    pub laplacian: Vector,
    /// Velocity change by damping for a damping number of 1 [m/s].
    pub damping: Vector,
    /// Rate of strain of the mean of the neighbours' velocity gradients, Frobenius norm of twice its symmetric part [1/s].
    pub strain: Real,
}

/// Fields of all particles, ghosts included.
#[derive(Clone, Copy)]
pub(crate) struct Fields<'a> {
    pub kind: &'a [Kind],
    /// Velocities relative to the walls [m/s].
    pub velocity: &'a [Vector],
    /// Velocity gradients [1/s].
    pub gradient: &'a [Matrix],
    pub bulk: Bulk<'a>,
    /// Eddy viscosity over that of the fluid, if there is one.
    pub eddies: Option<&'a [Real]>,
}

/// Which planes let the water slip along them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Friction<'a> {
    /// Lower and upper wall in each direction.
    walls: [[bool; 2]; 3],
    by_gates: bool,
    gates: &'a [Gate],
}

impl<'a> Friction<'a> {
    /// That of a tank.
    pub fn of(tank: &'a Tank) -> Self {
        let walls = tank.friction.map(|sides| sides.map(|friction| friction == WallFriction::Slip));
        Self { walls, by_gates: tank.common_friction() == WallFriction::Slip, gates: &tank.gates }
    }

    /// The directions in which an image is turned by a plane that lets the water slip; `way` goes to the image.
    #[inline(always)]
    fn slips(&self, turned: Turned, way: Vector) -> Turned {
        let gate = gate_of(turned).map(|gate| self.gates[gate].direction);
        (0..3).fold(0, |slips, d| {
            let by_plane = if gate == Some(d) { self.by_gates } else { self.walls[d][usize::from(way[d] > 0.0)] };
            slips | ((turned & 1 << d) * Turned::from(by_plane))
        })
    }

    /// Velocity of an image in a plane that holds the water: it moves against the particle behind, turned by the others.
    #[inline(always)]
    fn held(&self, turned: Turned, slips: Turned, velocity: Vector) -> Vector {
        let gate = gate_of(turned).map(|gate| &self.gates[gate]);
        match gate.filter(|gate| slips >> gate.direction & 1 == 0) {
            Some(gate) => Vector::new(0.0, 0.0, 2.0 * gate.velocity) - turn(slips, velocity),
            None => -turn(slips, velocity),
        }
    }
}

/// Sets what each own fluid particle receives, its damping without the part of the gradients, and its stress
/// `sum (w/n0) m e r^T` [m^2/s], for [`add_stress`].
pub(crate) fn exchange(
    kernel: &Kernel,
    friction: &Friction<'_>,
    (pairs, blocks): (&Pairs, &[Block]),
    fields: &Fields<'_>,
    (into, stress): (&mut [Received], &mut [Symmetric]),
) {
    let Fields { kind, velocity, gradient, bulk, eddies } = *fields;
    let (weight, sums) = (kernel.weight, kernel.sums);
    let [per_laplacian, per_density] = [sums.laplacian, sums.number_density].map(Real::recip);
    for_each_chunk((into, stress), ROWS, |number, (into, stress)| {
        for (row, (into, stress)) in into.iter_mut().zip(stress).enumerate() {
            let a = number * ROWS + row;
            (*into, *stress) = (Received::default(), [0.0; 6]);
            if kind[a] != Kind::Fluid {
                continue;
            }
            let (mut mean, mut total) = (gradient[a], 1.0);
            for pair in pairs.of(blocks, a) {
                let Neighbour { particle: b, turned, .. } = pair;
                let apart = pair.way();
                let narrower = bulk.narrowing(a, b);
                let r = apart.length() * narrower;
                let w = weight.value(r);
                let slips = if turned == 0 { 0 } else { friction.slips(turned, apart) };
                let held = turned & DIRECTIONS != slips;
                // At a wall that holds the water eddies are gone.
                let eddies = eddies.filter(|_| !held);
                let thicker = eddies.map_or(1.0, |eddies| 1.0 + 0.5 * (eddies[a] + eddies[b]));
                let image = if held { friction.held(turned, slips, velocity[b]) } else { pair.seen(velocity[b]) };
                let stiffness = thicker * weight.laplacian(r).0 * narrower * narrower;
                into.laplacian += stiffness * per_laplacian * (image - velocity[a]);
                let other = seen(&pair, &gradient[b]);
                total += w;
                mean += w * other;
                let along = narrower * r.max(COINCIDENT).recip() * apart;
                let change = pair.seen(velocity[b]) - velocity[a] - 0.5 * (gradient[a] + other) * apart;
                let pull = w * per_density * change.dot(along);
                into.damping += pull * along;
                add(stress, pull * r / narrower, along);
            }
            let mean = mean * total.recip();
            let twice = mean + mean.transpose();
            into.strain = twice.to_cols_array().iter().map(|v| v * v).sum::<Real>().sqrt();
        }
    });
}

/// Adds to the damping of each own fluid particle what the velocity gradients have to do with it: with the stress `Q`,
/// `-1/2 sum (Q_i B_i + Q_j B_j) g_ij`. Ghosts of `stress` are up to date.
pub(crate) fn add_stress(
    (pairs, blocks): (&Pairs, &[Block]),
    (kind, bulk): (&[Kind], &Bulk<'_>),
    (stress, inverse): (&[Symmetric], &[Symmetric]),
    into: &mut [Received],
) {
    let of = |a: usize, slope: Vector| times(&stress[a], times(&inverse[a], slope));
    for_each_chunk(into, ROWS, |number, into| {
        for (row, into) in into.iter_mut().enumerate() {
            let a = number * ROWS + row;
            if kind[a] != Kind::Fluid {
                continue;
            }
            let (mut slopes, mut there) = (Vector::ZERO, Vector::ZERO);
            for pair in pairs.of(blocks, a) {
                let slope = bulk.share(a, pair.particle) * pair.slope;
                slopes += slope;
                there += pair.seen(of(pair.particle, pair.seen(slope)));
            }
            into.damping -= 0.5 * (of(a, slopes) + there);
        }
    });
}

/// The gradient at an image.
#[inline(always)]
fn seen(pair: &Neighbour, gradient: &Matrix) -> Matrix {
    if pair.turned == 0 {
        return *gradient;
    }
    let turned = Matrix::from_cols(pair.seen(gradient.x_axis), pair.seen(gradient.y_axis), pair.seen(gradient.z_axis));
    let rows = turned.transpose();
    Matrix::from_cols(pair.seen(rows.x_axis), pair.seen(rows.y_axis), pair.seen(rows.z_axis)).transpose()
}
