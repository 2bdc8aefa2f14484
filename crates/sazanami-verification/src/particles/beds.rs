//! Void fractions in a lattice of grains.

use sazanami_dem::{DemError, Grain, Motion};
use sazanami_numerics::{Real, Vector};

use super::vessel::{DIAMETER, GRAIN_DENSITY, OPEN, PERIODIC, Vessel, WALLS, lattice};
use sazanami_mps::Kind;
use sazanami_mps::grains::{OverlappingGrains, Voids};

/// Void fractions of touching grains on a simple cubic lattice.
#[derive(Clone, Copy, Debug)]
pub struct LatticeVoids {
    /// Mean in the interior, and largest difference from it.
    pub interior: [Real; 2],
    /// Mean half a grain from a wall.
    pub at_wall: Real,
    /// The same if grains had no images in the walls.
    pub without_images: Real,
    /// Analytic rate of the void fraction over that from differences, while the lattice is compressed.
    pub rate: Real,
    /// The same with the rate of a lattice that stands still.
    pub rate_of_fluid_alone: Real,
}

/// 10 x 10 x 10 grains between a floor and a lid, periodic in x and y.
///
/// # Errors
/// If the grains cannot be set up.
pub fn lattice_voids() -> Result<LatticeVoids, DemError> {
    let count = 10;
    let d = DIAMETER;
    let lid = |sides| {
        let mut vessel = Vessel::new([count; 3], d, sides);
        vessel.grains = lattice([count; 3])
            .enumerate()
            .map(|(n, place)| Grain { motion: Motion::Fixed, ..Grain::new(n as u64, GRAIN_DENSITY, d * place) })
            .collect();
        vessel
    };
    let phase = |vessel: &Vessel| -> Result<OverlappingGrains, DemError> {
        let domain = vessel.domain();
        let mut phase = vessel.overlapping_grains(&domain)?;
        phase.place(&domain, &vessel.tank());
        Ok(phase)
    };
    let vessel = lid([PERIODIC, PERIODIC, WALLS]);
    let closed = phase(&vessel)?;
    let open = phase(&lid([PERIODIC, PERIODIC, OPEN]))?;
    // Over a cell of the lattice: the smoothed fraction ripples.
    let samples = |z: [Real; 2]| {
        lattice([8; 3]).map(move |s| {
            let place = Vector::new(5.0 + s.x / 8.0, 5.0 + s.y / 8.0, z[0] + (z[1] - z[0]) * s.z / 8.0);
            d * place
        })
    };
    let mean =
        |phase: &OverlappingGrains, z: [Real; 2]| samples(z).map(|x| phase.void_fraction(x)).sum::<Real>() / 512.0;
    let interior = mean(&closed, [5.0, 6.0]);
    let spread = samples([5.0, 6.0]).map(|x| (closed.void_fraction(x) - interior).abs()).fold(0.0, Real::max);
    let (at_wall, without_images) = (mean(&closed, [0.0, 1.0]), mean(&open, [0.0, 1.0]));

    // Grains and fluid move towards the middle of x at unequal rates.
    let mut vessel = lid([WALLS, PERIODIC, WALLS]);
    let middle = 0.5 * count as Real * d;
    let (grain_rate, fluid_rate) = (-2.0, 1.0);
    let moved = |vessel: &mut Vessel, time: Real| {
        for (grain, place) in vessel.grains.iter_mut().zip(lattice([count; 3])) {
            grain.position.x = middle + (d * place.x - middle) * (1.0 + grain_rate * time);
            grain.velocity = Vector::new(grain_rate * (d * place.x - middle), 0.0, 0.0);
            grain.motion = Motion::Prescribed;
        }
    };
    let points: Vec<Vector> = lattice([6; 3]).map(|s| d * (Vector::splat(3.0) + s / 1.5)).collect();
    let found = |vessel: &Vessel, time: Real, still: bool| -> Result<[Vec<Real>; 2], DemError> {
        let mut phase = phase(vessel)?;
        let velocity: Vec<Vector> = points.iter().map(|x| fluid_rate * (x.x - middle) * Vector::X).collect();
        let place: Vec<Vector> = points.iter().zip(&velocity).map(|(x, u)| *x + time * *u).collect();
        if still {
            for g in 0..phase.engine().grains().owned() {
                phase.engine_mut().set_velocity(g, Vector::ZERO, Vector::ZERO);
            }
            phase.place(&vessel.domain(), &vessel.tank());
        }
        let count = points.len();
        let column = || vec![0.0; count];
        let mut voids = Voids { inverse: column(), inverse_rate: column(), grain_mobility: column() };
        phase.voids(&vec![Kind::Fluid; count], &place, &velocity, &mut voids);
        Ok([voids.inverse, voids.inverse_rate])
    };
    let step = 1e-4;
    let mut at = |time: Real, still: bool| {
        moved(&mut vessel, time);
        found(&vessel, time, still)
    };
    let ([before, _], [after, _], [_, rate], [_, still]) =
        (at(-step, false)?, at(step, false)?, at(0.0, false)?, at(0.0, true)?);
    let difference = |n: usize| (after[n] - before[n]) / (2.0 * step);
    let share = |rate: &[Real]| {
        let product: Real = (0..rate.len()).map(|n| rate[n] * difference(n)).sum();
        product / (0..rate.len()).map(|n| difference(n).powi(2)).sum::<Real>()
    };
    Ok(LatticeVoids {
        interior: [interior, spread],
        at_wall,
        without_images,
        rate: share(&rate),
        rate_of_fluid_alone: share(&still),
    })
}
