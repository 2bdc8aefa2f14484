//! Report and errors of the viscous step.

use sazanami_numerics::{Real, Vector};

/// The viscous equation cannot be solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ViscosityError {
    /// The time step needs more iterations than allowed.
    #[error("the viscous solve would take {iterations} iterations for a time step of {dt:e} s; shorten the step")]
    TooStiff {
        /// Iterations needed.
        iterations: usize,
        /// Time step \[s].
        dt: Real,
    },
    /// A value is NaN or infinite.
    #[error("the viscous stress on the walls is not finite")]
    NotFinite,
}

/// Diagnostics of a viscous step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DiffusionReport {
    /// Sweeps over the grid in the solve.
    pub iterations: usize,
    /// Impulse of the stress on the sides of the box on the fluid [N s].
    pub wall_impulse: Vector,
}

impl std::ops::AddAssign for DiffusionReport {
    fn add_assign(&mut self, other: Self) {
        self.iterations += other.iterations;
        self.wall_impulse += other.wall_impulse;
    }
}
