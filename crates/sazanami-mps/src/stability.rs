//! Stability limits of the time step.

use sazanami_numerics::{Real, Vector};

/// Limit on the length of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Limit {
    /// Courant number of the fluid particles.
    #[default]
    Advective,
    /// Displacement by the body force.
    BodyForce,
    /// Viscous diffusion number.
    Viscous,
    /// Courant number of the grains.
    GrainMotion,
    /// Relaxation time of the drag between grains and fluid.
    Drag,
    /// Upper bound set by the case.
    Longest,
    /// Step prescribed by the case.
    Fixed,
    /// Step prescribed by the case, longer than the other limits allow.
    FixedBeyondLimits,
}

impl Limit {
    /// Name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Advective => "advective",
            Self::BodyForce => "body_force",
            Self::Viscous => "viscous",
            Self::GrainMotion => "grain_motion",
            Self::Drag => "drag",
            Self::Longest => "longest",
            Self::Fixed => "fixed",
            Self::FixedBeyondLimits => "fixed_beyond_limits",
        }
    }
}

/// Recommended Courant number: displacement of the fastest particle in a step over its size.
pub const COURANT: Real = 0.15;
/// Limit on the step over the time scale `sqrt(l0/|b|)` of the body force b.
pub const BODY_FORCE: Real = 0.2;
/// Limit on the step over the viscous time scale `l0^2/nu`.
pub const VISCOUS: Real = 0.2;
/// Limit on the step over the relaxation time of the drag: the drag on the fluid is explicit and overshoots beyond 1.
pub const DRAG: Real = 0.5;

/// A tenth of the speed of sound in water [m/s]: faster flow is not incompressible, and a run that reaches it has become
/// unstable.
pub const COMPRESSIBLE: Real = 150.0;

/// Settings that bound the length of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimits {
    /// Courant number: displacement of the fastest fluid particle or grain in a step over its size.
    pub courant: Real,
    /// Longest step \[s].
    pub longest: Real,
    /// Prescribed step, whatever the limits say \[s].
    pub fixed: Option<Real>,
}

impl Default for StepLimits {
    fn default() -> Self {
        Self { courant: COURANT, longest: 2e-4, fixed: None }
    }
}

/// Rates that the step has to resolve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Largest speed of a fluid particle over the particle spacing [1/s].
    pub advective: Real,
    /// Largest speed of a grain over its diameter [1/s].
    pub grain_motion: Real,
    /// Reciprocal of the shortest relaxation time of the drag between grains and fluid [1/s].
    pub drag: Real,
}

/// A step length and the limit that set it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StableStep {
    /// Length \[s].
    pub dt: Real,
    /// Limit that set it.
    pub limit: Limit,
}

/// Displacement of fast particles within the flow time scale, in spacings: that of a recommended step, whatever the
/// Courant number of the case, since the time scale must not depend on the step.
const DISPLACEMENT: Real = COURANT;
/// Speed of fast particles over the mean speed.
const FAST: Real = 3.0;
/// Flow time scale over the time scale `sqrt(l0/|b|)` of the body force.
const FORCE_FRACTION: Real = 0.05;

/// Flow time scale \[s] over which errors of the particle arrangement are corrected, from the mean speed of the fluid
/// relative to its walls [m/s] and the body force [m/s^2]; never less than the step, infinite where nothing moves and no
/// force acts.
///
/// Corrections within one step, however short, would give particles speeds that shorten the next step, without end
/// (`docs/decisions/0007-shaken-tanks.md`).
#[must_use]
pub(crate) fn flow_time(mean_speed: Real, body_force: Vector, spacing: Real, dt: Real) -> Real {
    let of_speed = DISPLACEMENT * spacing / (FAST * mean_speed);
    of_speed.min(FORCE_FRACTION * (spacing / body_force.length()).sqrt()).max(dt)
}

impl StepLimits {
    /// The list of stability limits, each with the longest step that it allows, for these rates, a body force [m/s^2], a
    /// spacing \[m] and a viscosity [m^2/s]; infinite where a limit does not apply. The solver steps by the shortest;
    /// a forecast asks with the rates that it expects.
    #[must_use]
    pub fn bounds(&self, rates: &Rates, body_force: Vector, spacing: Real, viscosity: Real) -> [StableStep; 5] {
        let within = |part: Real, rate: Real| if rate > 0.0 { part / rate } else { Real::INFINITY };
        [
            (within(self.courant, rates.advective), Limit::Advective),
            (within(self.courant, rates.grain_motion), Limit::GrainMotion),
            (BODY_FORCE * within(1.0, (body_force.length() / spacing).sqrt()), Limit::BodyForce),
            (within(VISCOUS, viscosity / (spacing * spacing)), Limit::Viscous),
            (within(DRAG, rates.drag), Limit::Drag),
        ]
        .map(|(dt, limit)| StableStep { dt, limit })
    }

    /// The longest step within all [`Self::bounds`], or the prescribed one.
    #[must_use]
    pub fn choose(&self, rates: &Rates, body_force: Vector, spacing: Real, viscosity: Real) -> StableStep {
        let bounds = self.bounds(rates, body_force, spacing, viscosity);
        if let Some(dt) = self.fixed {
            let beyond = bounds.iter().any(|bound| dt > bound.dt);
            return StableStep { dt, limit: if beyond { Limit::FixedBeyondLimits } else { Limit::Fixed } };
        }
        let longest = StableStep { dt: self.longest, limit: Limit::Longest };
        bounds.into_iter().chain([longest]).reduce(|a, b| if b.dt < a.dt { b } else { a }).unwrap_or(longest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_limit_sets_the_step() {
        let limits = StepLimits { longest: 1.0, ..StepLimits::default() };
        let rates = Rates { advective: 300.0, ..Rates::default() };
        let step = limits.choose(&rates, Vector::new(0.0, 0.0, -9.81), 1e-3, 1e-6);
        assert_eq!((step.limit, step.dt), (Limit::Advective, 0.15 / 300.0));
        let slow = Rates { advective: 1.0, ..Rates::default() };
        assert_eq!(limits.choose(&slow, Vector::new(0.0, 0.0, -9.81), 1e-3, 1e-6).limit, Limit::BodyForce);
        let fixed = StepLimits { fixed: Some(2e-4), ..limits };
        assert_eq!(fixed.choose(&rates, Vector::ZERO, 1e-3, 1e-6), StableStep { dt: 2e-4, limit: Limit::Fixed });
        let dragged = Rates { drag: 1e4, ..rates };
        let bounds = limits.bounds(&rates, Vector::ZERO, 1e-3, 1e-6);
        assert_eq!(bounds.map(|bound| bound.dt), [5e-4, Real::INFINITY, Real::INFINITY, 0.2, Real::INFINITY]);
        let beyond = StableStep { dt: 2e-4, limit: Limit::FixedBeyondLimits };
        assert_eq!(fixed.choose(&dragged, Vector::ZERO, 1e-3, 1e-6), beyond);
    }

    #[test]
    fn the_flow_time_scale_follows_speed_and_force_and_is_no_less_than_the_step() {
        let still = flow_time(0.0, Vector::new(0.0, 0.0, -9.81), 1e-3, 1e-5);
        assert!((still - 0.05 * (1e-3 / 9.81_f64).sqrt()).abs() < 1e-12);
        // Ten times as fast, a tenth of the time; the step does not enter.
        let of = |speed: Real, dt: Real| flow_time(speed, Vector::new(0.0, 0.0, -9.81), 1e-3, dt);
        assert!((of(1.0, 1e-6) - 5e-5).abs() < 1e-15 && of(1.0, 1e-6) == of(1.0, 1e-5));
        assert!((of(10.0, 1e-7) - 5e-6).abs() < 1e-15);
        assert_eq!(of(10.0, 1e-4), 1e-4);
        assert_eq!(flow_time(0.0, Vector::ZERO, 1e-3, 1e-4), Real::INFINITY);
    }
}
