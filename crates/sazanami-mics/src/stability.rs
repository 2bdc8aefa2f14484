//! Stability limits on the time step.

use sazanami_numerics::{Real, Vector};

/// The limit that set the length of a time step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Limit {
    /// Courant number of the split transport.
    Advective,
    /// Stability of explicit viscosity.
    Viscous,
    /// Shortest capillary wave on the grid.
    Capillary,
    /// Way that liquid or a grain falls from rest.
    BodyForce,
    /// Displacement of a grain and of its surface as it turns, in cell widths.
    GrainMotion,
    /// Angle by which a grain turns.
    GrainTurn,
    /// Friction between the surfaces of free grains and a viscous fluid.
    GrainFriction,
    /// Viscous stress where liquid and gas meet.
    InterfaceViscosity,
    /// Resolution of the contacts, where the number of sub-steps is fixed.
    Contact,
    /// Growth over the previous step.
    Growth,
    /// The longest step allowed.
    Maximum,
    /// The step is fixed by the case.
    Fixed,
}

impl Limit {
    /// Name in logs and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Advective => "advective",
            Self::Viscous => "viscous",
            Self::Capillary => "capillary",
            Self::BodyForce => "body_force",
            Self::GrainMotion => "grain_motion",
            Self::GrainTurn => "grain_turn",
            Self::GrainFriction => "grain_friction",
            Self::InterfaceViscosity => "interface_viscosity",
            Self::Contact => "contact",
            Self::Growth => "growth",
            Self::Maximum => "maximum",
            Self::Fixed => "fixed",
        }
    }
}

/// Rates that limit the next step [1/s]; zero where there is no limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Largest sum over the directions of `|u_f| / dx`.
    pub advective: Real,
    /// Reciprocal of the longest stable step of explicit viscosity.
    pub viscous: Real,
    /// Reciprocal of the longest step that follows the shortest capillary wave.
    pub capillary: Real,
    /// Square root of the body force over the shortest cell edge.
    pub body_force: Real,
    /// Reciprocal of the longest step in which no grain goes farther than its [`travel`].
    pub grain_motion: Real,
    /// Largest angular velocity of a grain.
    pub grain_turn: Real,
    /// That of explicit viscosity of the liquid alone, where free grains act by their surfaces.
    pub grain_friction: Real,
    /// That of the fluid of the larger viscosity, where there are liquid and gas.
    pub interface_viscosity: Real,
    /// Reciprocal of the longest step that the contacts allow.
    pub contact: Real,
}

/// Largest displacement in a step of a grain whose middle extent is `width` cells, that of its surface by its turn added, in cell
/// widths: 0.45, as far as the fluid, up to four cells, and 0.2 from six on, where the force swings as faces of cells are crossed.
#[must_use]
pub fn travel(width: Real) -> Real {
    let wide = ((width - NARROW) / (WIDE - NARROW)).clamp(0.0, 1.0);
    COURANT + wide * (TRAVEL_OF_WIDE - COURANT)
}

/// Largest Courant number.
const COURANT: Real = 0.45;
/// Longest step over the time `sqrt(dx / |b|)` in which a body force `b` takes liquid and grains across a cell from rest: they
/// then go a tenth of a cell, and a body that falls feels its drag before it is faster than it can be.
pub const BODY_FORCE: Real = 0.45;
/// Longest step with free grains over the longest stable one of explicit viscosity, `nu dt / dx^2 = 7`: the pressure about a grain that
/// starts or stops follows its friction late. A sphere of three cells is then up to 12 % too fast for some ten steps, at 20 up
/// to 30 %, and from 200 on its velocity swings without end (0015).
pub const GRAIN_FRICTION: Real = 40.0;
/// The same where liquid and gas meet: the transposed gradient is that of the velocity before the step. At `nu dt/dx^2` of 3 to 6 drops, and surfaces under
/// gravity, come to rest with the reserve of the implicit part (`viscosity.rs`); at 200 waves of a few cells grow even so.
pub const INTERFACE_VISCOSITY: Real = 40.0;
/// Displacement of wide grains in a step, in cell widths.
const TRAVEL_OF_WIDE: Real = 0.2;
/// Width in cells from which on grains go less far in a step.
const NARROW: Real = 4.0;
/// Width in cells from which on grains go least far in a step.
const WIDE: Real = 6.0;

/// The rate of a body force [m/s^2] on cells of this `spacing` \[m]: [`Rates::body_force`].
#[must_use]
pub fn body_force_rate(force: Vector, spacing: Vector) -> Real {
    (force.length() / spacing.min_element()).sqrt()
}

/// Bounds on the time step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimits {
    /// Largest Courant number, summed over the directions; stable below 1/2.
    pub courant: Real,
    /// Largest angle by which a grain turns in a step \[rad].
    pub grain_turn: Real,
    /// Largest ratio of a step to the one before.
    pub growth: Real,
    /// Longest step \[s].
    pub longest: Real,
    /// Fixed length of every step \[s]: the fluid then takes as many passes as it needs.
    pub fixed: Option<Real>,
}

impl StepLimits {
    /// The recommended limits with a longest step \[s].
    #[must_use]
    pub const fn up_to(longest: Real) -> Self {
        Self { courant: COURANT, grain_turn: 0.4, growth: 1.2, longest, fixed: None }
    }

    /// Steps of a fixed length \[s].
    #[must_use]
    pub fn always(step: Real) -> Self {
        Self { fixed: Some(step), ..Self::up_to(step) }
    }

    /// The longest step that each rate allows \[s]; infinite where it sets no limit. A forecast asks with the rates
    /// that it expects.
    #[must_use]
    pub fn bounds(&self, rates: &Rates) -> [(Real, Limit); 9] {
        let after = |part: Real, rate: Real| if rate > 0.0 { part / rate } else { Real::INFINITY };
        [
            (after(self.courant, rates.advective), Limit::Advective),
            (after(1.0, rates.viscous), Limit::Viscous),
            (after(1.0, rates.capillary), Limit::Capillary),
            (after(BODY_FORCE, rates.body_force), Limit::BodyForce),
            (after(1.0, rates.grain_motion), Limit::GrainMotion),
            (after(self.grain_turn, rates.grain_turn), Limit::GrainTurn),
            (after(GRAIN_FRICTION, rates.grain_friction), Limit::GrainFriction),
            (after(INTERFACE_VISCOSITY, rates.interface_viscosity), Limit::InterfaceViscosity),
            (after(1.0, rates.contact), Limit::Contact),
        ]
    }

    /// The next time step; `previous` is the length of the one before \[s].
    #[must_use]
    pub fn choose(&self, rates: &Rates, previous: Option<Real>) -> StableStep {
        if let Some(dt) = self.fixed {
            return StableStep { dt, limit: Limit::Fixed, fluid_passes: self.passes(rates, dt) };
        }
        let growth = (previous.map_or(Real::INFINITY, |dt| self.growth * dt), Limit::Growth);
        let candidates = [(self.longest, Limit::Maximum), growth].into_iter().chain(self.bounds(rates));
        let (dt, limit) = candidates.fold((self.longest, Limit::Maximum), |a, b| if b.0 < a.0 { b } else { a });
        StableStep { dt, limit, fluid_passes: 1 }
    }

    /// Passes of the fluid phase in a step of `dt` \[s] so that each keeps to the limits of the fluids.
    #[must_use]
    pub fn passes(&self, rates: &Rates, dt: Real) -> usize {
        let of_forces = rates.viscous.max(rates.capillary).max(rates.interface_viscosity / INTERFACE_VISCOSITY);
        let needed = dt * of_forces.max(rates.advective / self.courant);
        // Round-off must not cause a second pass.
        (needed * (1.0 - 1e-12)).ceil().max(1.0) as usize
    }
}

/// A time step and the limit that set it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StableStep {
    /// Length \[s].
    pub dt: Real,
    /// The limit that set the length.
    pub limit: Limit,
    /// Number of equal passes of the fluid phase.
    pub fluid_passes: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_grains_go_as_far_as_the_fluid_and_wide_ones_less() {
        assert_eq!([1.0, 2.7, 4.0].map(travel), [0.45; 3]);
        assert!((travel(5.0) - 0.325).abs() < 1e-15 && travel(4.5) > travel(5.5));
        assert_eq!([6.0, 20.0].map(travel), [0.2; 2]);
    }

    #[test]
    fn the_shortest_step_rules() {
        let limits = StepLimits::up_to(1e-4);
        let rates = Rates { advective: 9.0 / 1.9e-4, ..Rates::default() };
        let step = limits.choose(&rates, None);
        assert_eq!((step.limit, step.fluid_passes), (Limit::Advective, 1));
        assert!((step.dt - 0.45 * 1.9e-4 / 9.0).abs() < 1e-20);
        assert_eq!(limits.choose(&rates, Some(1e-6)).limit, Limit::Growth);
        assert_eq!(limits.choose(&Rates::default(), None).limit, Limit::Maximum);
        let grains = Rates { grain_motion: 1e6, ..rates };
        assert_eq!(limits.choose(&grains, None).limit, Limit::GrainMotion);
        let wavy = Rates { capillary: 1e7, ..rates };
        assert_eq!(limits.choose(&wavy, None), StableStep { dt: 1e-7, limit: Limit::Capillary, fluid_passes: 1 });
        assert_eq!(StepLimits::always(1e-5).choose(&wavy, None).fluid_passes, 100);
        let thick = Rates { interface_viscosity: 40e7, ..rates };
        assert_eq!(StepLimits::always(1e-5).choose(&thick, None).fluid_passes, 100);
        let falling = Rates { body_force: (9.8_f64 / 1.9e-4).sqrt(), ..Rates::default() };
        assert_eq!(limits.choose(&falling, None).limit, Limit::Maximum);
        let step = StepLimits::up_to(0.1).choose(&falling, None);
        assert!((9.8 * step.dt * step.dt / 1.9e-4 - 0.2025).abs() < 1e-12 && step.limit == Limit::BodyForce);
        let turning = Rates { grain_turn: 1e6, ..rates };
        assert_eq!(limits.choose(&turning, None).limit, Limit::GrainTurn);
        let rubbing = Rates { grain_friction: 40e7, ..rates };
        assert_eq!(
            limits.choose(&rubbing, None),
            StableStep { dt: 1e-7, limit: Limit::GrainFriction, fluid_passes: 1 }
        );
    }

    #[test]
    fn a_fixed_step_takes_as_many_passes_as_the_flow_needs() {
        let limits = StepLimits::always(1e-5);
        let at = |courant: Real| limits.choose(&Rates { advective: courant / 1e-5, ..Rates::default() }, None);
        assert_eq!([0.0, 0.45, 0.57, 1.4].map(|c| at(c).fluid_passes), [1, 1, 2, 4]);
        assert_eq!(at(0.57).limit, Limit::Fixed);
    }
}
