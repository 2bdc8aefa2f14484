//! Free grains that settle together in a box of water that is periodic all round.

use sazanami_dem::{Grain, Random};
use sazanami_mps::filling;
use sazanami_mps::grains::{DragParameters, volume};
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{FluidParticle, Forcing, Solver};
use sazanami_numerics::{Real, Vector};

use super::vessel::advance;
use super::vessel::{DENSITY, DIAMETER, DOWN, ExperimentError, GRAIN_DENSITY, GRAVITY, PERIODIC, Vessel};

/// Extent of the boxes, in diameters.
const SIZE: [usize; 3] = [10, 10, 12];
/// Kinematic viscosity of the water [m^2/s].
const VISCOSITY: Real = 1e-6;

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

/// A box periodic all round with free grains that leave the void fraction `eps`, scattered by `seed`, and with water at rest.
fn suspension(scheme: Scheme, eps: Real, seed: u64) -> Vessel {
    let d = DIAMETER;
    let mut vessel = Vessel::new(SIZE, d, [PERIODIC; 3]);
    (vessel.scheme, vessel.longest) = (scheme, 4e-4);
    let extent = vessel.upper / d;
    let count = ((1.0 - eps) * extent.element_product() / volume(1.0)).round() as usize;
    let places = scattered(extent, count, seed).into_iter().enumerate();
    vessel.grains = places.map(|(n, place)| Grain::new(n as u64, GRAIN_DENSITY, d * place)).collect();
    vessel.fluid = filling::layers(vessel.lower, vessel.upper, vessel.upper.z, d, |_| eps)
        .into_iter()
        .map(|position| FluidParticle { position, velocity: Vector::ZERO })
        .collect();
    vessel
}

/// Pressure gradient of a flux [m/s] through a bed of void fraction `eps` by Ergun (1952), with `eps^power` in place of `eps^3`
/// [Pa/m].
pub(super) fn ergun(eps: Real, flux: Real, d: Real, power: i32) -> Real {
    let linear = 150.0 * DENSITY * VISCOSITY * (1.0 - eps).powi(2) * flux / (d * d);
    let quadratic = 1.75 * DENSITY * (1.0 - eps) * flux * flux / d;
    (linear + quadratic) / eps.powi(power)
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
    let vessel = suspension(scheme, 1.0 - fraction, seed);
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
