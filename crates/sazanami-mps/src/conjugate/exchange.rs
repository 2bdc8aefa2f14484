//! Exchange between neighbours without the pressure: viscosity, damping of non-linear motion, mean gradients.
//!
//! A pair parts by `m = (u_j - u_i).e - e.(L_i + L_j) r/2` faster than the velocity gradients `L` of its particles let it.
//! The damping is the negative gradient of `sum (w/n0) m^2/2` over all pairs with respect to the velocities: that of `m` itself
//! pulls along the pair, that of `L` acts as a stress does. It takes energy only, and keeps momentum and angular momentum.

use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::mirrors::{DIRECTIONS, Turned, gate_of, seen, turn};
use super::pairs::{LANES, Pairs, add_to, columns_of as symmetric_columns, four, lanes, product, three};
use super::voids::Bulk;
use crate::boundary::{Tank, WallFriction};
use crate::gates::Gate;
use crate::matrix::Block;
use crate::moments::Symmetric;
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
pub(crate) struct SlipPlanes<'a> {
    /// Lower and upper wall in each direction.
    walls: [[bool; 2]; 3],
    by_gates: bool,
    gates: &'a [Gate],
}

impl<'a> SlipPlanes<'a> {
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
    friction: &SlipPlanes<'_>,
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
            let here = velocity[a];
            let mine = columns_of(&gradient[a]);
            let (mut mean, mut total) = (mine, 1.0);
            let (mut laplacian, mut damping, mut stresses) = ([0.0; 4], [0.0; 4], [[0.0; 4]; 2]);
            pairs.for_each_group(blocks, a, |columns, turned, group| {
                let mut narrower = [1.0; LANES];
                if !bulk.clear {
                    narrower
                        .iter_mut()
                        .zip(columns)
                        .for_each(|(narrower, &b)| *narrower = bulk.narrowing(a, b as usize));
                }
                let r = lanes(|l| group.length[l] * narrower[l]);
                let w = lanes(|l| weight.value(r[l]));
                let curvature = lanes(|l| weight.laplacian(r[l]).0);
                let per_way = lanes(|l| narrower[l] * r[l].max(COINCIDENT).recip());
                for (l, (&b, &turned)) in columns.iter().zip(turned).take(LANES).enumerate() {
                    let (b, way) = (b as usize, group.way[l]);
                    let slips = if turned == 0 { 0 } else { friction.slips(turned, three(way)) };
                    let held = turned & DIRECTIONS != slips;
                    // At a wall that holds the water eddies are gone.
                    let eddies = eddies.filter(|_| !held);
                    let thicker = eddies.map_or(1.0, |eddies| 1.0 + 0.5 * (eddies[a] + eddies[b]));
                    let plain = seen(turned, velocity[b]);
                    let image = if held { friction.held(turned, slips, velocity[b]) } else { plain };
                    let stiffness = thicker * curvature[l] * narrower[l] * narrower[l];
                    add_to(&mut laplacian, stiffness * per_laplacian, &four(image - here, 0.0));
                    let other = columns_of(&if turned == 0 { gradient[b] } else { mirrored(turned, &gradient[b]) });
                    total += w[l];
                    (0..3).for_each(|d| add_to(&mut mean[d], w[l], &other[d]));
                    let along = way.map(|x| per_way[l] * x);
                    let change = beyond_linear(four(plain - here, 0.0), [&mine, &other], &way);
                    let pull = w[l] * per_density * three(change).dot(three(along));
                    add_to(&mut damping, pull, &along);
                    let pull = if bulk.clear { pull * r[l] } else { pull * r[l] / narrower[l] };
                    let [x, y, z, _] = along;
                    add_to(&mut stresses[0], pull, &[x * x, y * y, z * z, x * y]);
                    add_to(&mut stresses[1], pull, &[x * z, y * z, 0.0, 0.0]);
                }
            });
            (into.laplacian, into.damping) = (three(laplacian), three(damping));
            let [[xx, yy, zz, xy], [xz, yz, ..]] = stresses;
            *stress = [xx, yy, zz, xy, xz, yz];
            let mean = Matrix::from_cols(three(mean[0]), three(mean[1]), three(mean[2])) * total.recip();
            let twice = mean + mean.transpose();
            into.strain = twice.to_cols_array().iter().map(|v| v * v).sum::<Real>().sqrt();
        }
    });
}

/// The columns of a velocity gradient, each with a zero behind it.
#[inline(always)]
fn columns_of(gradient: &Matrix) -> [[Real; 4]; 3] {
    [gradient.x_axis, gradient.y_axis, gradient.z_axis].map(|column| four(column, 0.0))
}

/// `change - (L_i + L_j) way/2` for the columns of two velocity gradients.
#[inline(always)]
fn beyond_linear(change: [Real; 4], gradients: [&[[Real; 4]; 3]; 2], way: &[Real; 4]) -> [Real; 4] {
    let [mine, other] = gradients;
    std::array::from_fn(|l| {
        let [x, y, z] = [0, 1, 2].map(|d| 0.5 * (mine[d][l] + other[d][l]) * way[d]);
        change[l] - (x + y + z)
    })
}

/// Adds to the damping of each own fluid particle what the velocity gradients have to do with it: with the stress `Q`,
/// `-1/2 sum (Q_i B_i + Q_j B_j) g_ij`. Ghosts of `stress` are up to date.
pub(crate) fn add_stress(
    (pairs, blocks): (&Pairs, &[Block]),
    (kind, bulk): (&[Kind], &Bulk<'_>),
    (stress, inverse): (&[Symmetric], &[Symmetric]),
    into: &mut [Received],
) {
    let of = |a: usize| [&inverse[a], &stress[a]].map(symmetric_columns);
    for_each_chunk(into, ROWS, |number, into| {
        for (row, into) in into.iter_mut().enumerate() {
            let a = number * ROWS + row;
            if kind[a] != Kind::Fluid {
                continue;
            }
            let (mut slopes, mut there) = ([0.0; 4], [0.0; 4]);
            for pair in pairs.of(blocks, a) {
                let slope = four(bulk.share(a, pair.particle) * pair.slope, 0.0);
                add_to(&mut slopes, 1.0, &slope);
                let [inverse, stress] = of(pair.particle);
                let seen = four(pair.seen(three(slope)), 0.0);
                let pushed = product(&stress, &product(&inverse, &seen));
                add_to(&mut there, 1.0, &four(pair.seen(three(pushed)), 0.0));
            }
            let [inverse, stress] = of(a);
            let here = product(&stress, &product(&inverse, &slopes));
            into.damping -= 0.5 * (three(here) + three(there));
        }
    });
}

/// The gradient at an image.
fn mirrored(turned: Turned, gradient: &Matrix) -> Matrix {
    let columns = [gradient.x_axis, gradient.y_axis, gradient.z_axis].map(|column| turn(turned, column));
    let rows = Matrix::from_cols(columns[0], columns[1], columns[2]).transpose();
    let rows = [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| turn(turned, row));
    Matrix::from_cols(rows[0], rows[1], rows[2]).transpose()
}
