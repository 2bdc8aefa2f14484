//! Beds that settled without water and were covered by water afterwards.

use std::f64::consts::PI;

use sazanami_dem::{Grain, Loads, Motion, Random, Substeps};
use sazanami_mps::filling;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{FluidParticle, Solver};
use sazanami_numerics::{Real, Vector};

use super::vessel::{DIAMETER, DOWN, ExperimentError, GRAIN_DENSITY, OPEN_TOP, PERIODIC, Vessel, WALLS};
use super::vessel::{lattice, under};

/// A bed that settled without water, covered by water that came to rest around held grains; lengths in diameters.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SettledBed {
    /// Scheme of the water.
    pub scheme: Scheme,
    /// Extent in x and y.
    pub size: [usize; 2],
    /// Thickness of the bed.
    pub layers: Real,
    /// Water above it.
    pub water: Real,
    /// Room that the surface of the water has to rise at the ends.
    pub rise: Real,
    /// Whether the ends in x are periodic.
    pub endless: bool,
    /// Height below which grains are held for good.
    pub glued: Real,
}

impl SettledBed {
    /// Depth of the water above the floor \[m].
    pub fn depth(&self) -> Real {
        (self.layers + self.water) * DIAMETER
    }

    /// The bed with its water at rest.
    pub fn solver(&self) -> Result<Solver, ExperimentError> {
        let Self { size, layers, water, .. } = *self;
        let (d, depth) = (DIAMETER, self.depth());
        let ends = if self.endless { PERIODIC } else { WALLS };
        let high = (layers + water + self.rise + 6.0).ceil() as usize;
        let mut vessel = Vessel::new([size[0], size[1], high], d, [ends, PERIODIC, OPEN_TOP]);
        (vessel.longest, vessel.scheme) = (2e-4, self.scheme);
        vessel.reference = Vector::new(0.5 * vessel.upper.x, 0.0, depth);
        vessel.grains = packed(&vessel, layers)?;
        for grain in vessel.grains.iter_mut().filter(|grain| grain.position.z < self.glued * d) {
            grain.motion = Motion::WithWalls;
        }
        let domain = vessel.domain();
        let mut phase = vessel.grain_phase(&domain)?;
        phase.place(&domain, &vessel.tank());
        let mean = |z: Real| {
            let places = lattice([40, 8, 1]).map(|s| s * Vector::new(vessel.upper.x / 40.0, vessel.upper.y / 8.0, 0.0));
            places.map(|x| phase.void_fraction(x + z * Vector::Z)).sum::<Real>() / 320.0
        };
        let fluid = filling::layers(vessel.lower, vessel.upper, depth, d, mean).into_iter();
        vessel.fluid = fluid.map(|position| FluidParticle { position, velocity: Vector::ZERO }).collect();
        let mut solver = vessel.solver()?;
        solver.grains_mut().freeze(true);
        for _ in 0..500 {
            let dt = solver.stable_step(DOWN).dt;
            let report = solver.step(dt, &under(DOWN)(0.0, dt), |_| ())?;
            solver.set_velocities(|p, a| 0.9 * p.velocity[a]);
            if report.strain[1] < 0.01 && report.largest_speed < 1e-3 {
                break;
            }
        }
        solver.set_velocities(|_, _| Vector::ZERO);
        solver.grains_mut().freeze(false);
        Ok(solver)
    }
}

/// Grains dropped into the box without water until they lie still.
pub(super) fn packed(vessel: &Vessel, layers: Real) -> Result<Vec<Grain>, ExperimentError> {
    let d = DIAMETER;
    let extent = vessel.upper - vessel.lower;
    let [n1, n2] = [0, 1].map(|axis| (extent[axis] / (1.1 * d)).floor() as usize);
    let total = (0.6 / (PI / 6.0) * extent.x * extent.y * layers / (d * d)).round() as usize;
    let mut random = Random::new(1);
    let mut way = || 0.045 * d * random.between(-1.0, 1.0);
    let mut grains: Vec<Grain> = (0..total)
        .map(|n| {
            let (i, j, k) = (n % n1, n / n1 % n2, n / (n1 * n2));
            let place = Vector::new(
                (i as Real + 0.5) * extent.x / n1 as Real,
                (j as Real + 0.5) * extent.y / n2 as Real,
                (k as Real + 0.55) * 1.1 * d,
            );
            Grain::new(n as u64, GRAIN_DENSITY, vessel.lower + place + Vector::new(way(), way(), way()))
        })
        .collect();
    let settling = Vessel { grains: grains.clone(), ..vessel.clone() };
    let domain = settling.domain();
    let mut engine = settling.engine(&domain)?;
    for step in 0..5000 {
        engine.advance(&domain, &Loads::none(), DOWN, 2e-4, Substeps::Auto)?;
        let owned = engine.grains().owned();
        let fastest = engine.grains().velocity[..owned].iter().map(|v| v.length()).fold(0.0, Real::max);
        if step > 300 && fastest < 1e-4 {
            break;
        }
    }
    for (n, grain) in grains.iter_mut().enumerate() {
        grain.position = engine.grains().unwrapped_position(n);
    }
    Ok(grains)
}
