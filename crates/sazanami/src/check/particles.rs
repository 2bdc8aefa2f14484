//! What a case of moving particles will be: counts, limits of the step, and the waves that its tank makes.

use std::f64::consts::TAU;

use sazanami_numerics::Real;
use serde::Serialize;

use super::{CostModel, LimitReport};
use crate::case::meaning::{BoundarySide, Case, FluidName, GrainPlacement, Particles, Placement, Solver};

/// Share of the space that grains fill in a bed of spheres.
const FILLING: Real = 0.60;
/// Layers of a wall beside those within the radius of influence.
const WALL_LAYERS: Real = 1.0;

/// Moving particles and their tank.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParticlesReport {
    /// Particle spacing [m].
    pub spacing_m: Real,
    /// Fluid particles, about.
    pub fluid: usize,
    /// Wall particles.
    pub walls: usize,
    /// Waves of a shaken tank.
    pub tank: Option<TankReport>,
}

/// Waves in a tank that is shaken along x1 or x2, by linear theory: from the bed or the floor up, without friction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TankReport {
    /// Direction, from 1.
    pub axis: usize,
    /// Frequency of the motion, or of its strongest harmonic [Hz].
    pub frequency_hz: Real,
    /// Length of the tank [m].
    pub length_m: Real,
    /// Depth of the water above the bed [m].
    pub depth_m: Real,
    /// Wavelength at the frequency of the motion [m].
    pub wavelength_m: Real,
    /// `1/cos(k L/2)`, without its sign: large near resonance.
    pub amplification: Real,
    /// Largest speed of the water against the tank over that of the tank.
    pub speed_ratio: Real,
    /// Elevation at the end walls over the depth.
    pub end_elevation: Real,
    /// Largest elevation over the depth.
    pub largest_elevation: Real,
    /// Largest speed of the tank [m/s].
    pub tank_speed: Real,
    /// Thickness of the oscillating boundary layer [m].
    pub stokes_layer_m: Real,
}

/// Describes particles and tank; `None` for the other solver.
pub(super) fn report(case: &Case) -> Option<ParticlesReport> {
    let particles = case.particles.as_ref().filter(|_| case.solver == Solver::Mps)?;
    Some(ParticlesReport {
        spacing_m: particles.spacing,
        fluid: fluid(case, particles),
        walls: walls(case, particles),
        tank: tank(case),
    })
}

/// Fluid particles: the liquids less what grains take of them.
fn fluid(case: &Case, particles: &Particles) -> usize {
    let box_ = case.domain.extent();
    let liquid: Real = case
        .liquids
        .iter()
        .map(|liquid| {
            let volume = liquid.region.volume().unwrap_or(box_.x * box_.y * box_.z);
            if liquid.fluid == FluidName::Liquid { volume } else { -volume }
        })
        .sum();
    let solid: Real = case
        .grains
        .iter()
        .map(|population| match &population.placement {
            GrainPlacement::Packed(how) if how.level.is_some() => {
                FILLING * box_.x * box_.y * how.level.unwrap_or_default()
            }
            _ => {
                let volume = population.shape.volume().unwrap_or_default() * population.size.mean_cube();
                population.count.unwrap_or_default() as Real * volume
            }
        })
        .sum();
    ((liquid - solid).max(0.0) / particles.spacing.powi(3)).round() as usize
}

fn is_wall(side: &BoundarySide) -> bool {
    matches!(side, BoundarySide::NoSlip | BoundarySide::Slip)
}

/// Particles of the walls: the layers behind each, edges included.
fn walls(case: &Case, particles: &Particles) -> usize {
    let layers = WALL_LAYERS + particles.radius.floor();
    let box_ = case.domain.extent();
    let inner: Vec<Real> = (0..3).map(|d| (box_[d] / particles.spacing).round()).collect();
    let outer = |d: usize| inner[d] + layers * case.boundary[d].iter().filter(|side| is_wall(side)).count() as Real;
    (outer(0) * outer(1) * outer(2) - inner[0] * inner[1] * inner[2]) as usize
}

/// Waves of a tank that is shaken at its strongest harmonic, along the horizontal direction with end walls in which they are
/// highest.
pub(crate) fn tank(case: &Case) -> Option<TankReport> {
    let frame = case.frame.as_ref()?;
    let shaken = frame.motion.as_ref().and_then(|motion| motion.harmonic(case.run.until)).or_else(|| {
        let by = frame.oscillation?;
        Some((by.amplitude / (TAU * by.frequency).powi(2), by.frequency))
    });
    let (amplitude, frequency) = shaken?;
    let closed = |d: &usize| amplitude[*d] != 0.0 && case.boundary[*d].iter().all(is_wall);
    let depth = depth(case)?;
    let waves = (0..2).filter(closed).map(|axis| waves(case, axis, amplitude[axis].abs(), frequency, depth));
    waves.max_by(|a, b| a.largest_elevation.total_cmp(&b.largest_elevation))
}

/// Waves along a direction, from 0, in which the tank is shaken by an amplitude [m] at a frequency [Hz].
fn waves(case: &Case, axis: usize, amplitude: Real, frequency: Real, depth: Real) -> TankReport {
    let omega = TAU * frequency;
    let length_m = case.domain.extent()[axis];
    let k = wavenumber(omega, case.gravity.length(), depth);
    let half = 0.5 * k * length_m;
    let amplification = 1.0 / half.cos().abs();
    // The speed relative to the tank is 1 - cos(k x)/cos(k L/2) of the tank's, the elevation h A k sin(k x)/cos(k L/2).
    let places = (0..=200).map(|n| half * Real::from(n) / 200.0);
    let speed_ratio = places.clone().map(|place| (1.0 - place.cos() / half.cos()).abs()).fold(0.0, Real::max);
    let elevation = amplitude * k * amplification;
    TankReport {
        axis: axis + 1,
        frequency_hz: frequency,
        length_m,
        depth_m: depth,
        wavelength_m: TAU / k,
        amplification,
        speed_ratio,
        end_elevation: elevation * half.sin().abs(),
        largest_elevation: elevation * places.map(|place| place.sin().abs()).fold(0.0, Real::max),
        tank_speed: amplitude * omega,
        stokes_layer_m: (2.0 * case.fluids.liquid.viscosity / case.fluids.liquid.density / omega).sqrt(),
    }
}

/// Depth of the water above a bed that is levelled, or above the floor [m].
fn depth(case: &Case) -> Option<Real> {
    let top = |liquid: &crate::case::meaning::LiquidRegion| match liquid.placement {
        Placement::Absolute(position) => Some(position.z + liquid.region.heights()[1]),
        Placement::AboveBed { .. } => None,
    };
    let liquids = case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid);
    let level = liquids.filter_map(top).filter(|top| top.is_finite()).reduce(Real::max)?;
    let bed = case.grains.iter().filter_map(|population| match &population.placement {
        GrainPlacement::Packed(how) => how.level,
        _ => None,
    });
    let depth = level - case.domain.lower.z - bed.fold(0.0, Real::max);
    (depth > 0.0).then_some(depth)
}

/// Solution of `omega^2 = g k tanh(k h)` by Newton's method.
fn wavenumber(omega: Real, gravity: Real, depth: Real) -> Real {
    let deep = omega * omega / gravity;
    let mut k = deep.max(omega / (gravity * depth).sqrt());
    for _ in 0..50 {
        let (tanh, slope) = ((k * depth).tanh(), depth / (k * depth).cosh().powi(2));
        let change = (k * tanh - deep) / (tanh + k * slope);
        k -= change;
        if change.abs() < 1e-14 * k {
            break;
        }
    }
    k
}

/// The limits on the step at the start [s].
pub(super) fn step_limits(case: &Case, particles: &Particles) -> (Vec<LimitReport>, Real) {
    let spacing = particles.spacing;
    let mut limits = Vec::new();
    let mut add = |name, dt_s: Real, rule: String| {
        if dt_s.is_finite() && dt_s > 0.0 {
            limits.push(LimitReport { name, dt_s, rule, rules: false });
        }
    };
    if let Some(dt) = particles.dt {
        add("fixed", dt, "the case asks for it".into());
    } else {
        add("longest", particles.dt_max, "dt_max of the case".into());
        let speed = fastest(case);
        add(
            "advective",
            particles.courant * spacing / speed,
            format!("{} of the particle spacing at {speed:.3} m/s, foreseen", particles.courant),
        );
        let force = case.gravity.length();
        add("body force", 0.2 * (spacing / force).sqrt(), "0.2 sqrt(spacing / body force)".into());
        let nu = case.fluids.liquid.viscosity / case.fluids.liquid.density;
        add("viscous", 0.2 * spacing * spacing / nu, "0.2 spacing^2 / nu".into());
    }
    limits.sort_by(|a, b| a.dt_s.total_cmp(&b.dt_s));
    let dt = limits.first().map_or(particles.dt_max, |limit| limit.dt_s);
    if let Some(first) = limits.first_mut() {
        first.rules = true;
    }
    (limits, dt)
}

/// Largest speed of the water that can be foreseen [m/s]: that of the waves, of what falls, or of the start.
fn fastest(case: &Case) -> Real {
    let waves = tank(case).map_or(0.0, |tank| tank.speed_ratio.min(6.0) * tank.tank_speed);
    let box_ = case.domain.extent();
    let falls = |liquid: &crate::case::meaning::LiquidRegion| {
        let region = liquid.region.volume().unwrap_or(Real::INFINITY);
        let [low, high] = liquid.region.heights();
        // A body of liquid that does not fill the floor collapses.
        let covers = region >= 0.99 * box_.x * box_.y * (high - low);
        let height = if covers || !high.is_finite() { 0.0 } else { high.min(box_.z) };
        liquid.velocity.length() + (2.0 * case.gravity.length() * height).sqrt()
    };
    case.liquids.iter().map(falls).fold(waves, Real::max)
}

/// Wall-clock time of the steps and of what comes before them, without the grains [s].
pub(super) fn predict(report: &ParticlesReport, steps: Real, threads: usize, model: &CostModel) -> Real {
    let speed = 1.0 + model.parallel_share * (threads as Real - 1.0);
    steps * (report.fluid as Real * model.fluid_particle + report.walls as Real * model.wall_particle) / speed
}

/// Memory [bytes].
pub(super) fn memory(report: &ParticlesReport, model: &CostModel) -> Real {
    (report.fluid + report.walls) as Real * model.memory_particle
}

/// Steps that come before the run, at most.
pub(super) fn preparation_steps(particles: &Particles, dt: Real) -> Real {
    let preparation = &particles.preparation;
    if preparation.state.is_some() {
        return 0.0;
    }
    preparation.relax_steps as Real + preparation.settle / dt
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_and_short_waves() {
        // 10 mm of water at 2 Hz: k = 41.2 1/m.
        assert!((wavenumber(2.0 * TAU, 9.81, 0.01) - 41.2).abs() < 0.1);
        let deep = wavenumber(20.0, 9.81, 10.0);
        assert!((deep - 400.0 / 9.81).abs() < 1e-9);
    }
}
