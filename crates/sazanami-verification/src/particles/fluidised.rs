//! A bed of free grains on a sieve in a flow upwards.

use std::cell::Cell;
use std::f64::consts::PI;

use sazanami_dem::{Grain, Motion};
use sazanami_mps::filling;
use sazanami_mps::grains::volume;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{FluidParticle, Forcing, Solver};
use sazanami_numerics::mean_flow::{ActsBy, MeanFlow, MeanFlowSettings};
use sazanami_numerics::{Real, Vector};

use super::settled_bed::packed;
use super::suspended::{ergun, settling_speed};
use super::vessel::{
    DENSITY, DIAMETER, DOWN, ExperimentError, GRAIN_DENSITY, GRAVITY, OPEN_TOP, PERIODIC, Vessel, advance, lattice,
};

/// Extent across, thickness of the bed and height of the box, in diameters.
const ACROSS: usize = 8;
const LAYERS: Real = 12.0;
const HEIGHT: usize = 20;
/// Height below which grains are fixed: a sieve as thick as void fractions are smoothed, in diameters.
const SIEVE: Real = 3.0;
/// Part of the bed at its bottom and its top that is left out of its porosity, in diameters.
const ENDS: Real = 1.5;
/// Part of the free grains at their top whose void fraction is smoothed with that of clear water, in diameters.
const UPPER: Real = 3.0;
/// Time in which the flow rises and in which the driving force answers to the mean velocity \[s].
const RISE: Real = 0.1;
const ANSWER: Real = 0.005;
/// Part of the time after which is averaged.
const FROM: Real = 0.7;

/// A settled bed of porosity `porosity`, before water flows through it.
#[derive(Clone, Debug)]
pub struct BedOnSieve {
    vessel: Vessel,
    /// Void fraction of the bed away from its ends.
    pub porosity: Real,
    /// Flux at which Ergun's pressure gradient is that of the submerged weight at this porosity [m/s].
    pub least_fluidising: Real,
    /// Height of the highest grain \[m].
    top: Real,
}

/// What a flow upwards does to a bed.
#[derive(Clone, Copy, Debug, Default)]
pub struct FluidisedBed {
    /// Flux [m/s].
    pub flux: Real,
    /// Force of the water on the free grains, without buoyancy, over their submerged weight.
    pub force: Real,
    /// The same of the grains that lay more than three diameters below the top.
    pub force_below: Real,
    /// Ergun's pressure gradient at the porosity of the bed at rest over its submerged weight.
    pub by_ergun: Real,
    /// Change of the mean height of the free grains, in diameters.
    pub rise: Real,
    /// Void fraction by the mean height of the free grains.
    pub porosity: Real,
    /// Change of the rise between the two halves of the mean, in diameters.
    pub change: Real,
}

/// Volume of a sphere of diameter 1 below a plane at `height` above its centre.
fn below(height: Real) -> Real {
    let h = (height + 0.5).clamp(0.0, 1.0);
    PI * h * h * (1.5 - h) / 3.0
}

/// Void fraction between two heights, in diameters.
fn porosity(grains: &[Grain], [low, high]: [Real; 2]) -> Real {
    let within = |grain: &Grain| {
        let z = grain.position.z / DIAMETER;
        below(high - z) - below(low - z)
    };
    1.0 - grains.iter().map(within).sum::<Real>() / ((high - low) * (ACROSS * ACROSS) as Real)
}

/// Flux at which Ergun's pressure gradient bears the submerged weight of grains of void fraction `eps` [m/s].
fn least_fluidising(eps: Real) -> Real {
    let weight = (1.0 - eps) * (GRAIN_DENSITY - DENSITY) * GRAVITY;
    let [mut low, mut high] = [0.0, 1.0];
    for _ in 0..60 {
        let flux = 0.5 * (low + high);
        if ergun(eps, flux, DIAMETER, 3) < weight { low = flux } else { high = flux }
    }
    low
}

/// Void fraction at which `speed` is the flux, a function that rises with it.
fn porosity_at(flux: Real, speed: impl Fn(Real) -> Real) -> Real {
    let [mut low, mut high] = [0.2, 1.0];
    for _ in 0..60 {
        let eps = 0.5 * (low + high);
        if speed(eps) < flux { low = eps } else { high = eps }
    }
    low
}

impl BedOnSieve {
    /// Grains that settled in a dry box, of which the lowest are held as a sieve through which water comes in from below; water
    /// fills a box that is periodic all round.
    ///
    /// # Errors
    /// [`ExperimentError`] if grains and water do not fit.
    pub fn new(scheme: Scheme) -> Result<Self, ExperimentError> {
        let d = DIAMETER;
        let size = [ACROSS, ACROSS, HEIGHT];
        let mut vessel = Vessel::new(size, d, [PERIODIC; 3]);
        vessel.grains = packed(&Vessel::new(size, d, [PERIODIC, PERIODIC, OPEN_TOP]), LAYERS)?;
        for grain in vessel.grains.iter_mut().filter(|grain| grain.position.z < SIEVE * d) {
            grain.motion = Motion::Fixed;
        }
        (vessel.scheme, vessel.longest) = (scheme, 4e-4);
        let domain = vessel.domain();
        let mut phase = vessel.grain_phase(&domain)?;
        phase.place(&domain, &vessel.tank());
        let mean = |z: Real| {
            let places = lattice([ACROSS, ACROSS, 1]).map(|s| s * d * Vector::new(1.0, 1.0, 0.0));
            places.map(|x| phase.void_fraction(x + z * Vector::Z)).sum::<Real>() / (ACROSS * ACROSS) as Real
        };
        vessel.fluid = filling::layers(vessel.lower, vessel.upper, vessel.upper.z, d, mean)
            .into_iter()
            .map(|position| FluidParticle { position, velocity: Vector::ZERO })
            .collect();
        let top = vessel.grains.iter().map(|grain| grain.position.z).fold(0.0, Real::max);
        let porosity = porosity(&vessel.grains, [ENDS, top / d - ENDS]);
        Ok(Self { vessel, porosity, least_fluidising: least_fluidising(porosity), top })
    }

    /// The bed after a flow upwards of `over` times the least fluidising flux until `end` \[s].
    ///
    /// # Errors
    /// [`ExperimentError`] if a step fails.
    pub fn fluidise(&self, over: Real, end: Real) -> Result<FluidisedBed, ExperimentError> {
        let Self { vessel, porosity, least_fluidising, top } = self;
        let mut solver = vessel.solver()?;
        let extent = vessel.upper;
        let mut found = FluidisedBed { flux: over * least_fluidising, ..FluidisedBed::default() };
        let open = 1.0 - vessel.grains.len() as Real * volume(DIAMETER) / extent.element_product();
        let (velocity, area) = (found.flux / open * Vector::Z, extent.x * extent.y);
        let acts_by = ActsBy::Volume;
        let held = velocity.to_array().map(|u| u != 0.0);
        let settings = MeanFlowSettings {
            velocity,
            held,
            net: false,
            above: -1.0,
            area,
            answer: ANSWER,
            rise: RISE,
            acts_by,
            beside: Vector::ZERO,
            moves_box: false,
        };
        // Gravity acts by mass; what bears the water and drives the flow acts by volume.
        let (mut flow, driving) = (MeanFlow::new(settings), Cell::new(0.0));
        let forcing = |_: Real, _: Real| {
            let by_volume = driving.get() * Vector::Z - DOWN;
            Forcing { body_force: DOWN + by_volume, by_volume, ..Forcing::default() }
        };
        let weight = (1.0 - porosity) * (GRAIN_DENSITY - DENSITY) * GRAVITY;
        found.by_ergun = ergun(*porosity, found.flux, DIAMETER, 3) / weight;
        let lower = |id: u64| vessel.grains[id as usize].position.z < top - UPPER * DIAMETER;
        let height = mean_height(&solver);
        let (mut sums, mut seen, mut last) = ([[0.0; 3]; 2], [0.0; 2], 0.0);
        advance(&mut solver, [0.0, end], forcing, |time, solver, _| {
            let dt = time - last;
            last = time;
            let mass = solver.particle_mass() * solver.sum_over_fluid(|_, _| [1.0])[0];
            flow.answer(dt, solver.fluid_momentum(), mass);
            driving.set(flow.acceleration().z);
            let rise = (mean_height(solver) - height) / DIAMETER;
            if time < FROM * end {
                return;
            }
            let half = usize::from(time > 0.5 * (1.0 + FROM) * end);
            seen[half] += dt;
            sums[half][0] += dt * force_over_weight(solver, |_| true);
            sums[half][1] += dt * rise;
            sums[half][2] += dt * force_over_weight(solver, lower);
        })?;
        let mean = |n: usize| (sums[0][n] + sums[1][n]) / (seen[0] + seen[1]);
        (found.force, found.rise, found.force_below) = (mean(0), mean(1), mean(2));
        found.change = sums[1][1] / seen[1] - sums[0][1] / seen[0];
        // The mean height of the free grains lies in the middle of what they fill.
        let half = height / DIAMETER - SIEVE;
        found.porosity = 1.0 - (1.0 - porosity) * half / (half + found.rise);
        Ok(found)
    }
}

impl FluidisedBed {
    /// Void fraction at which Ergun's pressure gradient bears the submerged weight at this flux.
    #[must_use]
    pub fn porosity_by_ergun(&self) -> Real {
        porosity_at(self.flux, least_fluidising)
    }

    /// The same by Richardson and Zaki (1954), without walls.
    #[must_use]
    pub fn porosity_by_richardson_and_zaki(&self) -> Real {
        let lone = settling_speed(1.0);
        let exponent = 4.45 * (lone * DIAMETER * 1e6).powf(-0.1);
        (self.flux / lone).powf(exponent.recip())
    }
}

/// Indices of the grains that are free.
fn free(solver: &Solver) -> impl Iterator<Item = usize> {
    let grains = solver.grains().engine().grains();
    (0..grains.owned()).filter(|&g| grains.motion[g] == Motion::Free)
}

/// Mean height of the free grains \[m].
fn mean_height(solver: &Solver) -> Real {
    let grains = solver.grains().engine().grains();
    let [sum, count] = free(solver).fold([0.0; 2], |[sum, n], g| [sum + grains.unwrapped_position(g).z, n + 1.0]);
    sum / count
}

/// Force of the water upwards, without buoyancy, on the free grains of which `counts` is said of the identifier, over their
/// submerged weight.
fn force_over_weight(solver: &Solver, counts: impl Fn(u64) -> bool) -> Real {
    let grains = solver.grains().engine().grains();
    let buoyancy = DENSITY * volume(DIAMETER) * GRAVITY;
    let force = |g: usize| solver.grains().forces(g).iter().map(|force| force.z).sum::<Real>() - buoyancy;
    let counted = free(solver).filter(|&g| counts(grains.id[g]));
    let [sum, count] = counted.fold([0.0; 2], |[sum, n], g| [sum + force(g), n + 1.0]);
    sum / (count * (GRAIN_DENSITY - DENSITY) * volume(DIAMETER) * GRAVITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slabs_of_a_bed_hold_what_lies_within() {
        assert!((below(0.5) - PI / 6.0).abs() < 1e-15 && (below(0.0) - PI / 12.0).abs() < 1e-15 && below(-0.5) == 0.0);
        let grains: Vec<Grain> =
            lattice([ACROSS, ACROSS, 4]).map(|place| Grain::new(0, GRAIN_DENSITY, DIAMETER * place)).collect();
        for slab in [[0.0, 4.0], [0.5, 2.5], [1.2, 3.2]] {
            assert!((porosity(&grains, slab) - (1.0 - PI / 6.0)).abs() < 1e-12);
        }
    }

    #[test]
    fn fluxes_and_porosities_are_inverse() {
        let flux = least_fluidising(0.41);
        assert!((flux - 0.0105).abs() < 0.0005, "{flux}");
        assert!((porosity_at(flux, least_fluidising) - 0.41).abs() < 1e-9);
    }
}
