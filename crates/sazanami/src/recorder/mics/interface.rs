//! The interface between liquid and gas where it has surface tension.

use std::f64::consts::TAU;

use sazanami_mics::solver::Solver;
use sazanami_numerics::{Real, Vector};

use super::outside_grains;

/// Length of the mean direction of the gas along a periodic direction from which on it lies together there: 1 at one place, 0 all along.
const TOGETHER: Real = 0.2;
/// Part of the box that is no gas but the rounding of liquid fractions.
const ROUNDING: Real = 1e-12;

/// What is observed of the interface and the fluids beside it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interface {
    /// Surface tension times its area \[J].
    pub energy: Real,
    /// Largest speed of a cell [m/s].
    pub speed: Real,
    /// Root mean square by mass, outside grains, of the difference from the mean velocity [m/s].
    pub deviation: Real,
    /// Mean place of the gas \[m]; none where there is no gas.
    pub gas_centre: Option<Vector>,
}

impl Interface {
    /// As it is now, ghosts filled; nothing without surface tension. All ranks take part.
    pub fn of(solver: &Solver) -> Option<Self> {
        solver.surface_tension()?;
        let (domain, flow) = (solver.domain(), solver.flow());
        let u = flow.velocity.each_ref().map(sazanami_numerics::grid::Field::data);
        let square = |at: usize| u.iter().map(|u| u[at] * u[at]).sum::<Real>();
        let fastest = domain.max_rows(&domain.interior(), |row| row.shifted(0).map(square).fold(0.0, Real::max));
        let mass_of = |at: usize| outside_grains(solver, at)[1] * flow.density.data()[at];
        let [mass, momenta @ ..] = domain.sum(domain.sum_rows(&domain.interior(), |row| {
            let mut sums = [0.0; 4];
            for at in row.shifted(0) {
                let mass = mass_of(at);
                sums[0] += mass;
                (0..3).for_each(|d| sums[1 + d] += mass * u[d][at]);
            }
            sums
        }));
        let mean = momenta.map(|momentum| momentum / mass);
        let [deviation] = domain.sum(domain.sum_rows(&domain.interior(), |row| {
            let off = |at: usize| (0..3).map(|d| (u[d][at] - mean[d]).powi(2)).sum::<Real>();
            [row.shifted(0).map(|at| mass_of(at) * off(at)).sum()]
        }));
        let gas_in = |at: usize| {
            let [liquid, room] = outside_grains(solver, at);
            room - liquid
        };
        let (grid, periodic) = (domain.grid(), domain.periodic());
        let (lower, extent) = (grid.lower, grid.extent());
        // Along periodic directions the mean is taken from a seam opposite the gas, if it lies together.
        let angle = |d: usize, place: Vector| TAU * (place[d] - lower[d]) / extent[d];
        let [volume, turns @ ..] = domain.sum(domain.sum_rows(&domain.interior(), |row| {
            let mut sums = [0.0; 7];
            for (at, i) in row.shifted(0).zip(row.first..) {
                let (gas, place) = (gas_in(at), domain.centre(i, row.j, row.k));
                sums[0] += gas;
                for d in (0..3).filter(|&d| periodic[d]) {
                    let (sin, cos) = angle(d, place).sin_cos();
                    sums[1 + 2 * d] += gas * cos;
                    sums[2 + 2 * d] += gas * sin;
                }
            }
            sums
        }));
        let seam: [Real; 3] = std::array::from_fn(|d| {
            let [x, y] = [turns[2 * d] / volume, turns[2 * d + 1] / volume];
            let opposite = lower[d] + extent[d] * (y.atan2(x) / TAU + 0.5).rem_euclid(1.0);
            if periodic[d] && x.hypot(y) > TOGETHER { opposite } else { lower[d] }
        });
        let from_seam = |d: usize, place: Vector| (place[d] - seam[d]).rem_euclid(extent[d]);
        let moments = domain.sum(domain.sum_rows(&domain.interior(), |row| {
            let mut sums = [0.0; 3];
            for (at, i) in row.shifted(0).zip(row.first..) {
                let (gas, place) = (gas_in(at), domain.centre(i, row.j, row.k));
                (0..3).for_each(|d| sums[d] += gas * from_seam(d, place));
            }
            sums
        }));
        let centre = |d: usize| lower[d] + (seam[d] - lower[d] + moments[d] / volume).rem_euclid(extent[d]);
        Some(Self {
            energy: solver.surface_energy(),
            speed: domain.max(fastest).sqrt(),
            deviation: (deviation / mass).sqrt(),
            gas_centre: (volume > ROUNDING * domain.grid().len() as Real)
                .then(|| Vector::from_array([0, 1, 2].map(centre))),
        })
    }
}
