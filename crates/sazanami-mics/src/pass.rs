//! One pass of the fluid, as its phases need it.

use sazanami_numerics::domain::{Domain, Row};
use sazanami_numerics::{Real, Vector};

use crate::boundary::Boundary;
use crate::flow::{Flow, fall};
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
        self.predict_by(flow, impulses, |_, _, _| {}, |_, _, _, _| {});
    }

    /// The same, with a change of the velocity of a row of cells before, and a correction of that of a row of faces after:
    /// [`Flow::predict_faces_by`].
    pub fn predict_by(
        &self,
        flow: &mut Flow,
        impulses: &mut Impulses,
        change: impl Fn(usize, &Row, &mut [Real]) + Sync,
        correct: impl Fn(usize, &Row, &[Real], &mut [Real]) + Sync,
    ) {
        let gain = self.gravity * self.dt;
        let change_and_fall = |d: usize, row: &Row, u: &mut [Real]| {
            change(d, row, u);
            fall(u, gain[d]);
        };
        flow.predict_faces_by(self.domain, self.boundary, change_and_fall, correct);
        if self.gravity != Vector::ZERO {
            impulses.gravity_on_fluid += flow.mass(self.domain) * self.gravity * self.dt;
        }
    }
}
