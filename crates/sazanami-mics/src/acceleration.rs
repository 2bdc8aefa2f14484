//! The acceleration of the last step in the viscous step of the next.
//!
//! The viscous step alone would not see gravity and the pressure gradient, which then move the fluid beside a surface for a
//! whole step as if there were no friction. With the acceleration `a = g - grad p / rho` of the last projection and the
//! viscous operator A,
//!
//! ```text
//! u' = (I + A)^-1 (u + dt a_old) + b dt (a_new - a_old),   b = 1 / (1 + dt beta)
//! ```
//!
//! with the friction `beta` of the surfaces of grains over the density has its steady state where `A u = dt a`, whatever the
//! step. Without b the pressure follows friction too slowly. The acceleration is carried, not the pressure gradient: it is
//! continuous across the interface. Face velocities, which damp what the pressure does differently on cells and
//! faces (Rhie and Chow 1983, AIAA J. 21, 1525), take
//!
//! ```text
//! u_f = mean(u'' - tau a_old) + mean(tau) a_old,f + mean(b) dt (a_new,f - a_old,f),   tau = min(b dt, 0.1 dx^2 / nu)
//! ```
//!
//! with the velocity `u''` after the viscous step, so that it does not depend on the step once that is
//! longer than viscosity and friction need.

use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

use crate::flow::Flow;
use crate::forces::{Forces, Pass};
use crate::grains::{GrainPhase, Surface};
use crate::momentum::Impulses;
use crate::pressure::Projection;
use crate::schemes::{Transposed, ViscosityScheme};

/// Longest time of the damping between cells and faces, over `dx^2 / nu`.
const DAMPING: Real = 0.1;

/// Acceleration of the fluid in the last projection.
pub(crate) struct Acceleration {
    /// On the lower faces, sides of the box included [m/s^2].
    faces: [Field<Real>; 3],
    /// The time tau in the cells, one ghost layer filled \[s].
    damping: Field<Real>,
    /// The factor b in the cells, one ghost layer filled: what friction leaves of an acceleration within the step.
    response: Field<Real>,
    spacing: Vector,
}

impl Acceleration {
    /// Fields of the viscous step beside `grains`, if their friction needs any; sets the transposed gradient of `flow`.
    pub fn beside(domain: &Domain, grains: &GrainPhase, flow: &mut Flow) -> Option<Self> {
        if !grains.is_wetted() || flow.schemes.viscosity == ViscosityScheme::Off {
            return None;
        }
        // The whole transposed gradient, explicit, is unstable with the old acceleration from steps of 2 dx^2 / nu on.
        flow.transposed = Transposed::AtInterface;
        let spacing = domain.grid().spacing;
        Some(Self {
            faces: std::array::from_fn(|_| domain.field(0.0)),
            damping: domain.field(0.0),
            response: domain.field(1.0),
            spacing,
        })
    }

    /// Keeps the acceleration that `pressure` and `gravity` gave a fluid of this `density`, ghosts filled.
    pub fn keep(&mut self, domain: &Domain, pressure: &Field<Real>, density: &Field<Real>, gravity: Vector) {
        let (p, rho) = (pressure.data(), density.data());
        for (d, faces) in self.faces.iter_mut().enumerate() {
            let (behind, per_width) = (domain.strides()[d] as usize, 2.0 / self.spacing[d]);
            domain.for_each_row(&domain.faces(d), faces.data_mut(), |row, faces| {
                for (face, at) in faces.iter_mut().zip(row.shifted(0)) {
                    let below = at - behind;
                    *face = gravity[d] - per_width * (p[at] - p[below]) / (rho[at] + rho[below]);
                }
            });
        }
    }

    /// Adds `time(at)` \[s] times the acceleration to the velocity of the cells.
    pub fn add(&self, domain: &Domain, velocity: &mut [Field<Real>; 3], time: impl Fn(usize) -> Real + Sync) {
        for (d, (u, faces)) in velocity.iter_mut().zip(&self.faces).enumerate() {
            let (a, ahead) = (faces.data(), domain.strides()[d] as usize);
            domain.for_each_row(&domain.interior(), u.data_mut(), |row, u| {
                u.iter_mut().zip(row.shifted(0)).for_each(|(u, at)| *u += time(at) * 0.5 * (a[at] + a[at + ahead]));
            });
        }
    }

    /// Takes the acceleration over the pass back after the viscous step, and predicts the face velocities.
    pub fn predict(&mut self, pass: &Pass, flow: &mut Flow, forces: &Forces, impulses: &mut Impulses) {
        let Pass { domain, boundary, gravity, dt } = *pass;
        let (damping, response) = (self.damping.data(), self.response.data());
        self.add(domain, &mut flow.velocity, |at| -damping[at]);
        forces.predict(pass, flow, impulses);
        self.add(domain, &mut flow.velocity, |at| damping[at] - dt);
        for (d, (uf, faces)) in flow.face_velocity.iter_mut().zip(&self.faces).enumerate() {
            let (a, behind, rho) = (faces.data(), domain.strides()[d] as usize, flow.density.data());
            domain.for_each_row(&domain.faces(d), uf.data_mut(), |row, uf| {
                for (uf, at) in uf.iter_mut().zip(row.shifted(0)) {
                    let (l, r) = (at - behind, at);
                    let mean = |values: &[Real]| (rho[l] * values[l] + rho[r] * values[r]) / (rho[l] + rho[r]);
                    let response = dt * mean(response);
                    *uf += (mean(damping) - response) * a[at] + (response - dt) * gravity[d];
                }
            });
            domain.fill_halos_to(1, &mut [(uf, &boundary.face_velocity_rules(d))]);
        }
    }

    /// Sets the damping time for a pass of `dt` \[s]; `friction` is that of the surfaces over the viscosity [1/m^2].
    pub fn set_damping(&mut self, domain: &Domain, dt: Real, flow: &Flow, friction: &[Real]) {
        let c = flow.volume_fraction.data();
        let squares = 3.0 / (self.spacing * self.spacing).recip().element_sum();
        let Self { damping, response, .. } = self;
        domain.for_each_row(
            &domain.interior(),
            (damping.data_mut(), response.data_mut()),
            |row, (damping, response)| {
                for (i, at) in row.shifted(0).enumerate() {
                    let nu = flow.fluids.kinematic_viscosity(c[at]);
                    response[i] = if friction[at] > 0.0 { 1.0 / (1.0 + dt * nu * friction[at]) } else { 1.0 };
                    damping[i] = (dt * response[i]).min(DAMPING * squares / nu);
                }
            },
        );
        let even = &GhostRules::EVEN;
        domain.fill_halos_to(1, &mut [(damping, even), (response, even)]);
    }

    /// The factor b in the cells.
    pub fn response(&self) -> &[Real] {
        self.response.data()
    }

    /// Leaves of the change of the acceleration by the projection what the friction of the surfaces leaves, and books what it
    /// takes.
    pub fn rub(&self, pass: &Pass, flow: &mut Flow, projection: &Projection, surface: &mut Surface) {
        let Pass { domain, gravity, dt, .. } = *pass;
        let Flow { density, velocity, work: [t1, t2, t3, ..], .. } = flow;
        let (gradient, density, response) = (projection.gradient(density), density.data(), self.response.data());
        for (d, (u, taken)) in velocity.iter_mut().zip([&mut *t1, &mut *t2, &mut *t3]).enumerate() {
            let (a, ahead) = (self.faces[d].data(), domain.strides()[d] as usize);
            domain.for_each_row(&domain.interior(), (u.data_mut(), taken.data_mut()), |row, (u, taken)| {
                for (i, at) in row.shifted(0).enumerate() {
                    let lost = if response[at] < 1.0 {
                        let now = gravity[d] - gradient.at(at)[d] / density[at];
                        dt * (1.0 - response[at]) * (now - 0.5 * (a[at] + a[at + ahead]))
                    } else {
                        0.0
                    };
                    u[i] -= lost;
                    taken[i] = density[at] * lost;
                }
            });
        }
        surface.add_taken(domain, [t1, t2, t3]);
    }
}
