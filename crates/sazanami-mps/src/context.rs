//! Input of every phase of a step: settings, forcing, and the constants that follow from them.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::ghosts::{Ghosts, Periods};
use crate::neighbours::ROWS;
use crate::particles::Kind;
use crate::scheme::Kernel;
use crate::settings::{Forcing, ParticleSettings};
use crate::surface_test::SurfaceTest;

/// The constants of a step.
#[derive(Clone, Copy)]
pub(crate) struct Context<'a> {
    pub domain: &'a Domain,
    pub periods: &'a Periods,
    pub settings: &'a ParticleSettings,
    pub kernel: &'a Kernel,
    /// `None` in a closed box that is full.
    pub surface: Option<SurfaceTest>,
    pub forcing: &'a Forcing,
    /// The part of the body force whose hydrostatic pressure is split off [m/s^2].
    pub reduced_force: Vector,
    /// Length of the step \[s].
    pub dt: Real,
    /// Time scale on which the particle arrangement is corrected, see [`crate::stability::flow_time`] \[s].
    pub flow_time: Real,
}

impl Context<'_> {
    /// Body force of the predictor, without the part in the hydrostatic pressure [m/s^2].
    pub fn explicit_force(&self) -> Vector {
        self.forcing.body_force - self.reduced_force
    }

    /// Body force that a pressure can bear: without its part along periodic directions [m/s^2].
    pub fn still_force(&self) -> Vector {
        Vector::select(self.periods.length.cmpgt(Vector::ZERO), Vector::ZERO, self.forcing.body_force)
    }

    /// Its part whose hydrostatic pressure is not split off [m/s^2].
    pub fn unreduced_still_force(&self) -> Vector {
        self.still_force() - self.reduced_force
    }

    /// Mass of a fluid particle \[kg].
    pub fn particle_mass(&self) -> Real {
        self.settings.fluid.density * self.settings.fluid.spacing.powi(3)
    }

    /// Whether a particle of this number density is a wall particle with little fluid in front of it.
    pub fn is_dry_wall(&self, kind: Kind, density: Real) -> bool {
        let n0 = self.kernel.sums.number_density;
        kind == Kind::Wall && self.surface.is_some_and(|test| density < test.density * n0)
    }
}

/// Positions and velocities of all particles and ghosts at one stage of the step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motion {
    /// \[m]
    pub position: Vec<Vector>,
    /// [m/s]
    pub velocity: Vec<Vector>,
}

impl Motion {
    /// Makes room for `count` particles and ghosts.
    pub fn resize(&mut self, count: usize) {
        self.position.resize(count, Vector::ZERO);
        self.velocity.resize(count, Vector::ZERO);
    }

    /// Brings the ghosts up to date.
    pub fn refresh(&mut self, domain: &Domain, ghosts: &mut Ghosts) {
        ghosts.refresh(domain, &mut self.velocity);
        ghosts.refresh_positions(domain, &mut self.position);
    }
}

/// Void fraction at all particles and ghosts.
#[derive(Clone, Debug, Default)]
pub struct Voids {
    /// Inverse void fraction `1/eps`.
    pub inverse: Vec<Real>,
    /// Material rate of change of `1/eps` [1/s].
    pub inverse_rate: Vec<Real>,
    /// `(1 - eps) rho/rho_s`, where the pressure of the step accelerates grains; 0 elsewhere.
    pub grain_mobility: Vec<Real>,
}

impl Voids {
    /// Clear fluid everywhere.
    pub(crate) fn clear(&mut self, count: usize) {
        for (column, value) in
            [(&mut self.inverse, 1.0), (&mut self.inverse_rate, 0.0), (&mut self.grain_mobility, 0.0)]
        {
            column.resize(count, value);
            for_each_chunk(&mut column[..], ROWS, |_, column| column.fill(value));
        }
    }

    /// Brings the ghosts up to date.
    pub(crate) fn refresh(&mut self, domain: &Domain, ghosts: &mut Ghosts) {
        ghosts.refresh(domain, &mut self.inverse);
        ghosts.refresh(domain, &mut self.inverse_rate);
        ghosts.refresh(domain, &mut self.grain_mobility);
    }
}
