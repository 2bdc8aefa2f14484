//! One pass of the fluid, as its phases need it.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};

use crate::boundary::Boundary;
use crate::flow::Flow;
use crate::momentum::Impulses;

/// Where, under which gravity and for how long.
#[derive(Clone, Copy)]
pub(crate) struct Pass<'a> {
    /// The grid and this rank's part of it.
    pub domain: &'a Domain,
    /// Conditions on the six sides of the box.
    pub boundary: &'a Boundary,
    /// Gravity during the pass, the motion of the frame included [m/s^2].
    pub gravity: Vector,
    /// Length of the pass \[s].
    pub dt: Real,
}

impl Pass<'_> {
    /// Lets the cells fall, predicts the face velocities, and books the weight of the fluid over all ranks. Collective.
    pub fn predict(&self, flow: &mut Flow, impulses: &mut Impulses) {
        flow.predict_faces(self.domain, self.boundary, self.gravity, self.dt);
        if self.gravity != Vector::ZERO {
            impulses.gravity_on_fluid += flow.mass(self.domain) * self.gravity * self.dt;
        }
    }
}
