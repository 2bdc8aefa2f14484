//! The forces on the fluid: one list for the step, its limit and the momentum budget.
//!
//! A force gives a uniform acceleration, accelerations on the cell faces, or both. A face acceleration
//! acts on the face velocity and, averaged over opposite faces, on the cell velocity, as the pressure
//! gradient does: a force that the pressure can balance is balanced to round-off (Popinet 2009,
//! J. Comput. Phys. 228). In cells that grains cover, the momentum exchange passes a force other than
//! gravity on to the grains with the deferred impulse.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};

use crate::boundary::Boundary;
use crate::flow::{Flow, FluidState};
use crate::fluids::Fluids;
use crate::momentum::{Impulses, MAX_FORCES};

/// One pass of the fluid, as a force needs it.
#[derive(Clone, Copy)]
pub struct Pass<'a> {
    /// The grid and this rank's part of it.
    pub domain: &'a Domain,
    /// Conditions on the six sides of the box.
    pub boundary: &'a Boundary,
    /// Gravity during the pass, the motion of the frame included [m/s^2].
    pub gravity: Vector,
    /// Length of the pass \[s].
    pub dt: Real,
}

/// A force on the fluid: an entry of [`Forces`].
pub trait Force: Send + Sync {
    /// Name of its step limit, of its line in the momentum budget and, after `impulse_`, of its column.
    fn name(&self) -> &'static str;

    /// Reciprocal of the longest stable step [1/s] on cells of this `spacing` \[m]; zero where there is no limit.
    fn rate(&self, _spacing: Vector, _fluids: &Fluids) -> Real {
        0.0
    }

    /// Acceleration that is the same everywhere in the fluid [m/s^2].
    fn uniform_acceleration(&self, _pass: &Pass) -> Vector {
        Vector::ZERO
    }

    /// Accelerates faces and cells after the face velocities are predicted ([`accelerate_faces`]);
    /// returns the impulse on the fluid, over all ranks [N s]. Collective.
    fn accelerate(&self, _pass: &Pass, _flow: &mut Flow) -> Vector {
        Vector::ZERO
    }
}

/// The weight of the fluid.
struct Gravity;

impl Force for Gravity {
    fn name(&self) -> &'static str {
        "gravity_on_fluid"
    }

    fn uniform_acceleration(&self, pass: &Pass) -> Vector {
        pass.gravity
    }
}

/// The list of forces on the fluid; gravity is the first.
pub struct Forces(Vec<Box<dyn Force>>);

impl Default for Forces {
    /// Gravity alone.
    fn default() -> Self {
        Self(vec![Box::new(Gravity)])
    }
}

impl Forces {
    /// Adds a force.
    ///
    /// # Panics
    /// If there are [`MAX_FORCES`] already.
    pub fn add(&mut self, force: Box<dyn Force>) {
        assert!(self.0.len() < MAX_FORCES, "at most {MAX_FORCES} forces act on the fluid");
        self.0.push(force);
    }

    /// The names of the forces, in order.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.0.iter().map(|force| force.name())
    }

    /// The largest rate of all forces on cells of this `spacing` \[m], with the name of the force [1/s].
    #[must_use]
    pub fn rate(&self, spacing: Vector, fluids: &Fluids) -> (Real, &'static str) {
        let rates = self.0.iter().map(|force| (force.rate(spacing, fluids), force.name()));
        rates.fold((0.0, ""), |a, b| if b.0 > a.0 { b } else { a })
    }

    /// Acceleration by all forces that is the same everywhere in the fluid [m/s^2].
    pub(crate) fn uniform_acceleration(&self, pass: &Pass) -> Vector {
        self.0.iter().map(|force| force.uniform_acceleration(pass)).sum()
    }

    /// Accelerates the cells, predicts the face velocities and adds the impulses of the forces to
    /// `impulses`, over all ranks [N s].
    pub(crate) fn predict(&self, pass: &Pass, flow: &mut Flow, impulses: &mut Impulses) {
        flow.predict_faces(pass.domain, pass.boundary, self.uniform_acceleration(pass), pass.dt);
        let impulses = std::iter::once(&mut impulses.gravity_on_fluid).chain(&mut impulses.other_forces);
        for (force, impulse) in self.0.iter().zip(impulses) {
            let uniform = force.uniform_acceleration(pass);
            if uniform != Vector::ZERO {
                *impulse += flow.mass(pass.domain) * uniform * pass.dt;
            }
            *impulse += force.accelerate(pass, flow);
        }
    }
}

/// Adds `dt` times `acceleration(state, direction, at)` [m/s^2] on the lower face of each cell at place `at` to
/// the face velocity, and the mean of opposite faces to the cell velocity; walls and inlets keep their velocity.
/// Returns the impulse on the fluid, over all ranks [N s]. Collective.
pub fn accelerate_faces(
    pass: &Pass,
    flow: &mut Flow,
    acceleration: impl Fn(FluidState<'_>, usize, usize) -> Real + Sync,
) -> Vector {
    let Pass { domain, boundary, dt, .. } = *pass;
    let strides = domain.strides().map(|stride| stride as usize);
    let mut impulse = Vector::ZERO;
    for (d, ahead) in strides.into_iter().enumerate() {
        let (state, u, uf) = flow.state_and_velocity(d, strides);
        let on_face = |at: usize| acceleration(state, d, at);
        let in_cell = |at: usize| 0.5 * (on_face(at) + on_face(at + ahead));
        domain.for_each_row(&domain.faces(d), uf.data_mut(), |row, uf| {
            uf.iter_mut().zip(row.shifted(0)).for_each(|(uf, at)| *uf += dt * on_face(at));
        });
        domain.for_each_row(&domain.interior(), u.data_mut(), |row, u| {
            u.iter_mut().zip(row.shifted(0)).for_each(|(u, at)| *u += dt * in_cell(at));
        });
        let force =
            domain.sum_rows(&domain.interior(), |row| [row.shifted(0).map(|at| state.density[at] * in_cell(at)).sum()]);
        impulse[d] = dt * domain.grid().cell_volume() * domain.sum(force)[0];
        domain.fill_halos_to(1, &mut [(uf, &boundary.face_velocity_rules(d))]);
    }
    impulse
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schemes::Schemes;
    use sazanami_numerics::grid::Grid;

    /// A body force given on the faces.
    struct Push;

    impl Force for Push {
        fn name(&self) -> &'static str {
            "push"
        }

        fn rate(&self, _spacing: Vector, _fluids: &Fluids) -> Real {
            7.0
        }

        fn accelerate(&self, pass: &Pass, flow: &mut Flow) -> Vector {
            accelerate_faces(pass, flow, |_, d, _| if d == 0 { 3.0 } else { 0.0 })
        }
    }

    #[test]
    fn a_force_on_faces_is_the_same_as_a_uniform_one_and_has_its_line() {
        let domain = Domain::solo(Grid::new([4, 5, 6], Vector::ZERO, Vector::ONE), [true; 3]);
        let boundary = Boundary::all_periodic();
        let fluids = Fluids { liquid_density: 1e3, gas_density: 2.0, liquid_viscosity: 0.0, gas_viscosity: 0.0 };
        let mut forces = Forces::default();
        assert_eq!(forces.rate(Vector::ONE, &fluids), (0.0, ""));
        forces.add(Box::new(Push));
        assert_eq!(forces.rate(Vector::ONE, &fluids), (7.0, "push"));
        let run = |forces: &Forces, gravity: Vector| {
            let mut flow = Flow::new(&domain, fluids, Schemes::default());
            flow.volume_fraction[[1, 2, 3]] = 0.25;
            flow.fill_halos(&domain, &boundary);
            let mut impulses = Impulses::default();
            let pass = Pass { domain: &domain, boundary: &boundary, gravity, dt: 0.1 };
            forces.predict(&pass, &mut flow, &mut impulses);
            (flow, impulses)
        };
        let (pushed, by_push) = run(&forces, Vector::ZERO);
        let (fallen, by_gravity) = run(&Forces::default(), Vector::new(3.0, 0.0, 0.0));
        let (push, weight) = (by_push.other_forces[0], by_gravity.gravity_on_fluid);
        assert!((push - weight).length() < 1e-12 * weight.length());
        assert_eq!((by_push.gravity_on_fluid, by_gravity.other_forces[0]), (Vector::ZERO, Vector::ZERO));
        let momentum = |flow: &Flow| flow.momentum(&domain).into_iter().sum::<Vector>();
        assert!((momentum(&pushed) - push).length() < 1e-12 * push.length());
        assert!((momentum(&fallen) - weight).length() < 1e-12 * weight.length());
        let faces = |flow: &Flow| flow.face_velocity[0][[1, 2, 3]];
        assert!((faces(&pushed) - faces(&fallen)).abs() < 1e-15 && (faces(&pushed) - 0.3).abs() < 1e-15);
        // Negative control: without the force nothing moves.
        let (still, none) = run(&Forces::default(), Vector::ZERO);
        assert_eq!((faces(&still), none), (0.0, Impulses::default()));
    }
}
