//! Grains in boxes of water that are periodic all round: flow through fixed ones, and free ones that settle.

use sazanami_dem::{Grain, Motion, Random};
use sazanami_mps::filling;
use sazanami_mps::grains::{DragParameters, volume};
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{FluidParticle, Forcing, Solver};
use sazanami_numerics::mean_flow::{ActsBy, MeanFlow, MeanFlowSettings};
use sazanami_numerics::{Real, Vector};

use super::beds::fix_on_lattice;
use super::vessel::{DENSITY, DIAMETER, DOWN, ExperimentError, GRAIN_DENSITY, GRAVITY, PERIODIC, Vessel};
use super::vessel::{advance, under};

/// Extent of the boxes, in diameters.
const SIZE: [usize; 3] = [10, 10, 12];
/// Kinematic viscosity of the water [m^2/s].
const VISCOSITY: Real = 1e-6;
/// Time in which the driving force answers to the mean velocity \[s].
const ANSWER: Real = 0.005;
/// Void fraction above which grains are placed at random.
const SPARSE: Real = 0.69;

/// Places in a box of `extent` diameters, periodic all round, at random one after the other and a diameter or more apart, in
/// diameters; the box can hold at most a third of its volume so.
fn scattered(extent: Vector, count: usize, seed: u64) -> Vec<Vector> {
    let mut random = Random::new(seed);
    let mut places: Vec<Vector> = Vec::new();
    while places.len() < count {
        let place = extent * Vector::new(random.unit(), random.unit(), random.unit());
        let apart = |other: &Vector| {
            let way = place - *other;
            (way - extent * (way / extent).round()).length()
        };
        if places.iter().all(|other| apart(other) >= 1.0) {
            places.push(place);
        }
    }
    places
}

/// A box periodic all round with grains that leave the void fraction `eps`, and with water at rest: free grains, or fixed ones.
fn suspension(scheme: Scheme, eps: Real, motion: Motion, seed: u64) -> Vessel {
    let d = DIAMETER;
    let mut vessel = Vessel::new(SIZE, d, [PERIODIC; 3]);
    (vessel.scheme, vessel.longest) = (scheme, 4e-4);
    let extent = vessel.upper / d;
    if eps > SPARSE {
        let count = ((1.0 - eps) * extent.element_product() / volume(1.0)).round() as usize;
        let grain = |(n, place): (usize, Vector)| Grain { motion, ..Grain::new(n as u64, GRAIN_DENSITY, d * place) };
        vessel.grains = scattered(extent, count, seed).into_iter().enumerate().map(grain).collect();
    } else {
        fix_on_lattice(&mut vessel, eps);
    }
    vessel.fluid = filling::layers(vessel.lower, vessel.upper, vessel.upper.z, d, |_| eps)
        .into_iter()
        .map(|position| FluidParticle { position, velocity: Vector::ZERO })
        .collect();
    vessel
}

/// Steady flow upwards through fixed grains.
#[derive(Clone, Copy, Debug)]
pub struct UpwardFlow {
    /// Diameter of the grains \[m].
    pub diameter: Real,
    /// Void fraction, from the number of fluid particles.
    pub void_fraction: Real,
    /// Mean velocity times void fraction [m/s].
    pub flux: Real,
    /// Force on the fluid over its volume that holds the flux, which is the pressure gradient [Pa/m].
    pub gradient: Real,
    /// Change of the force between the last two quarters of the run over the force.
    pub change: Real,
    /// Mean void fraction that the drag was taken with.
    pub void_of_drag: Real,
}

impl UpwardFlow {
    /// Pressure gradient by Ergun (1952) at this flux over that found, with `eps^power` in place of `eps^3`.
    #[must_use]
    pub fn ergun(&self, power: i32) -> Real {
        ergun(self.void_fraction, self.flux, self.diameter, power) / self.gradient
    }

    /// Pressure gradient by Wen and Yu (1966) with the drag of Schiller and Naumann at this flux over that found, with
    /// `eps^power` in place of `eps^-1.65`.
    #[must_use]
    pub fn wen_yu(&self, power: Real) -> Real {
        self.wen_yu_at(self.void_fraction, power)
    }

    /// The same with the void fraction that the drag was taken with.
    #[must_use]
    pub fn wen_yu_seen(&self) -> Real {
        self.wen_yu_at(self.void_of_drag, -1.65)
    }

    /// Void fraction that the drag was taken with over that of the box.
    #[must_use]
    pub fn void_over_box(&self) -> Real {
        self.void_of_drag / self.void_fraction
    }

    /// Drag at a void fraction `eps`, with the velocity and the number of grains of the box.
    fn wen_yu_at(&self, eps: Real, power: Real) -> Real {
        let Self { void_fraction, flux, diameter: d, .. } = *self;
        let slip = flux / void_fraction;
        let reynolds = eps * slip * d / VISCOSITY;
        let drag = 24.0 / reynolds * (1.0 + 0.15 * reynolds.powf(0.687));
        // Force per bulk volume over the void fraction.
        let force = 0.75 * drag * (1.0 - void_fraction) * eps.powf(power) * DENSITY * slip * slip / d;
        force / void_fraction / self.gradient
    }
}

/// Pressure gradient of a flux [m/s] through a bed of void fraction `eps` by Ergun (1952), with `eps^power` in place of `eps^3`
/// [Pa/m].
pub(super) fn ergun(eps: Real, flux: Real, d: Real, power: i32) -> Real {
    let linear = 150.0 * DENSITY * VISCOSITY * (1.0 - eps).powi(2) * flux / (d * d);
    let quadratic = 1.75 * DENSITY * (1.0 - eps) * flux * flux / d;
    (linear + quadratic) / eps.powi(power)
}

/// Flow held at the `flux` [m/s] upwards through fixed grains of void fraction `eps`, until `end` \[s].
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn upward_flow(scheme: Scheme, eps: Real, flux: Real, end: Real) -> Result<UpwardFlow, ExperimentError> {
    let vessel = suspension(scheme, eps, Motion::Fixed, 1);
    let mut solver = vessel.solver()?;
    let extent = vessel.upper;
    let solid = vessel.grains.len() as Real * volume(vessel.diameter) / extent.element_product();
    let velocity = flux / (1.0 - solid) * Vector::Z;
    solver.set_velocities(|_, _| velocity);
    let area = extent.x * extent.y;
    let acts_by = ActsBy::Mass;
    solver.hold_mean_flow(MeanFlow::new(MeanFlowSettings {
        velocity,
        held: velocity.to_array().map(|u| u != 0.0),
        net: false,
        above: -1.0,
        area,
        answer: ANSWER,
        rise: 0.0,
        acts_by,
    }));
    let (mut sums, mut counts) = ([[0.0; 2]; 4], [0.0; 4]);
    advance(&mut solver, [0.0, end], under(Vector::ZERO), |time, _, report| {
        let flow = report.mean_flow.expect("a mean velocity is held");
        let quarter = ((4.0 * time / end) as usize).min(3);
        sums[quarter][0] += flow.velocity.z;
        sums[quarter][1] += flow.acceleration.z;
        counts[quarter] += 1.0;
    })?;
    let [before, after] = [2, 3].map(|n| sums[n].map(|sum| sum / counts[n]));
    Ok(UpwardFlow {
        diameter: vessel.diameter,
        void_fraction: 1.0 - solid,
        flux: (1.0 - solid) * after[0],
        gradient: DENSITY * after[1],
        change: after[1] / before[1] - 1.0,
        void_of_drag: mean_void(&solver),
    })
}

/// Grains that settle together through water that their volume displaces.
#[derive(Clone, Copy, Debug)]
pub struct HinderedSettling {
    /// Solid fraction.
    pub fraction: Real,
    /// Mean velocity of the grains downwards, relative to that of the volume of water and grains [m/s].
    pub speed: Real,
    /// Change of it between the two halves of the mean, over itself.
    pub change: Real,
    /// Mean void fraction that the grains' drag was taken with.
    pub void_fraction: Real,
    /// Root mean square velocity of the grains across, over the speed.
    pub agitation: Real,
    /// Largest momentum of water and grains over that of the grains.
    pub momentum: Real,
}

impl HinderedSettling {
    /// The speed at which the drag law in use bears the submerged weight of a grain at this solid fraction [m/s].
    #[must_use]
    pub fn by_drag(&self) -> Real {
        settling_speed(1.0 - self.fraction)
    }

    /// That by Richardson and Zaki (1954) with the exponent of 1 < Re < 500, without walls [m/s].
    #[must_use]
    pub fn by_richardson_and_zaki(&self) -> Real {
        let lone = settling_speed(1.0);
        lone * (1.0 - self.fraction).powf(4.45 * (lone * DIAMETER / VISCOSITY).powf(-0.1))
    }
}

/// Flux of water past grains of void fraction `eps` at which the drag law bears their submerged weight [m/s].
#[must_use]
pub fn settling_speed(eps: Real) -> Real {
    let law = DragParameters::recommended(DENSITY, DENSITY * VISCOSITY);
    let weight = eps * (GRAIN_DENSITY - DENSITY) * GRAVITY * volume(DIAMETER);
    let [mut low, mut high] = [0.0, 1.0];
    for _ in 0..60 {
        let slip = 0.5 * (low + high);
        if law.coefficient(DIAMETER, eps, slip) * slip < weight { low = slip } else { high = slip }
    }
    eps * low
}

/// Mean void fraction that the drag on grains was taken with.
fn mean_void(solver: &Solver) -> Real {
    let phase = solver.grains();
    let owned = phase.engine().grains().owned();
    (0..owned).map(|g| phase.surroundings(g)[0]).sum::<Real>() / owned as Real
}

/// Mean velocity of the grains, that of the volume of water and grains along x3, momentum of both over that of the grains,
/// mean void fraction around grains and mean square velocity across.
fn motion(solver: &Solver) -> [Real; 5] {
    let phase = solver.grains();
    let grains = phase.engine().grains();
    let owned = grains.owned();
    let count = owned as Real;
    let water = solver.fluid_momentum();
    let momentum = (0..owned).map(|g| grains.mass[g] * grains.velocity[g]).sum::<Vector>();
    let extent = solver.tank().upper - solver.tank().lower;
    let flux = (water.z / DENSITY + momentum.z / GRAIN_DENSITY) / extent.element_product();
    let across = (0..owned).map(|g| grains.velocity[g].truncate().length_squared()).sum::<Real>() / count;
    let speed = momentum.z / (count * GRAIN_DENSITY * volume(DIAMETER));
    [speed, flux, (water + momentum).length() / momentum.length(), mean_void(solver), across]
}

/// Free grains of a solid fraction, scattered by `seed`, from rest until `end` \[s]; the last three fifths are averaged.
///
/// The mean gradient of the pressure bears the weight of water and grains. Without walls the volume of both may travel; what
/// counts is the motion relative to it.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn hindered_settling(
    scheme: Scheme,
    fraction: Real,
    seed: u64,
    end: Real,
) -> Result<HinderedSettling, ExperimentError> {
    let vessel = suspension(scheme, 1.0 - fraction, Motion::Free, seed);
    let mut solver = vessel.solver()?;
    let solid = vessel.grains.len() as Real * volume(DIAMETER);
    let mass = solver.particle_mass() * vessel.fluid.len() as Real + GRAIN_DENSITY * solid;
    let space = vessel.upper.element_product();
    let displaced = solver.particle_mass() * vessel.fluid.len() as Real + DENSITY * solid;
    let by_volume = -mass / displaced * DOWN;
    let forcing = |_: Real, _: Real| Forcing { body_force: DOWN + by_volume, by_volume, ..Forcing::default() };
    let (mut sums, mut seen, mut momentum, mut last) = ([[0.0; 3]; 2], [0.0; 2], 0.0, 0.0);
    advance(&mut solver, [0.0, end], forcing, |time, solver, _| {
        let dt = time - last;
        last = time;
        if time < 0.4 * end {
            return;
        }
        let [grains, volume, both, void, across] = motion(solver);
        let half = usize::from(time > 0.7 * end);
        seen[half] += dt;
        momentum = Real::max(momentum, both);
        for (sum, value) in sums[half].iter_mut().zip([volume - grains, void, across]) {
            *sum += dt * value;
        }
    })?;
    let halves = [0, 1].map(|n| sums[n].map(|sum| sum / seen[n]));
    let mean = |n: usize| (sums[0][n] + sums[1][n]) / (seen[0] + seen[1]);
    let speed = mean(0);
    Ok(HinderedSettling {
        fraction: solid / space,
        speed,
        change: (halves[1][0] - halves[0][0]) / speed,
        void_fraction: mean(1),
        agitation: mean(2).sqrt() / speed,
        momentum,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattered_grains_do_not_touch_across_sides() {
        let extent = Vector::new(6.0, 5.0, 7.0);
        let places = scattered(extent, 80, 3);
        for (n, a) in places.iter().enumerate() {
            for b in &places[..n] {
                let way = *a - *b;
                assert!((way - extent * (way / extent).round()).length() >= 1.0);
            }
        }
    }

    #[test]
    fn settling_speeds_are_those_of_wen_and_yu() {
        // A lone grain; slow at high Reynolds numbers as eps^2.3 to eps^4.65.
        assert!((settling_speed(1.0) - 0.1551).abs() < 0.001, "{}", settling_speed(1.0));
        let power = (settling_speed(0.9) / settling_speed(1.0)).ln() / 0.9_f64.ln();
        assert!((2.32..4.65).contains(&power), "{power}");
    }
}
