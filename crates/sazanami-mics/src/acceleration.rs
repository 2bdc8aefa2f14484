//! The acceleration by gravity and pressure in the viscous step.
//!
//! An implicit viscous step alone would not see gravity and the pressure gradient, which then move the fluid beside a wall or
//! the surface of a grain for a whole step as if there were no friction: a steady flow would be too fast by `a dt`. With the
//! acceleration `a = g - grad p / rho`, before the projection by the pressure that is known (`a_old`, with gravity and density at the
//! start of the pass), after it by the new one, and the viscous operator A,
//!
//! ```text
//! u' = (I + A)^-1 (u + dt a_old) + b dt (a_new - a_old),   b = 1 / (1 + dt beta)
//! ```
//!
//! with the friction `beta` of the surfaces of grains over the density has its steady state where `A u = dt a`, whatever the
//! step. Without b the pressure follows friction too slowly. The acceleration is carried, not the pressure gradient: it is
//! continuous across the interface. An explicit viscous step is steady there by itself and takes no part in this.
//!
//! Beside the surfaces of grains, face velocities, which damp what the pressure does differently
//! on cells and faces (Rhie and Chow 1983, AIAA J. 21, 1525), take
//!
//! ```text
//! u_f = mean(u'' - tau a_old) + mean(tau) a_old,f + mean(b) dt (a_new,f - a_old,f),   tau = min(b dt, 0.1 dx^2 / nu)
//! ```
//!
//! with the velocity `u''` after the viscous step, so that it does not depend on the step once that is
//! longer than viscosity and friction need. Where the transport has brought heavier fluid to a face there, `a_old` is what the old pressure
//! gives this: the acceleration of a gas, given to the liquid that has come, would be a hundred times what grains can bear.

use sazanami_numerics::domain::{Domain, GhostRules, Row};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

use crate::flow::Flow;
use crate::grains::ResolvedGrains;
use crate::mobility::RowSet;
use crate::momentum::Impulses;
use crate::pass::Pass;
use crate::pressure::Projection;
use crate::schemes::{Transposed, ViscosityScheme};
use crate::surface_tension::SurfaceTension;

/// Longest time of the damping between cells and faces, over `dx^2 / nu`.
const DAMPING: Real = 0.1;

/// Acceleration of the fluid by the gravity of a pass and the pressure of the projection before it.
pub(crate) struct Acceleration {
    /// On the lower faces, sides of the box included [m/s^2]; absent before it is first needed.
    faces: Option<[Field<Real>; 3]>,
    /// Beside surfaces of grains.
    beside: Option<Beside>,
    spacing: Vector,
}

/// Share of an acceleration in the velocities beside surfaces of grains.
struct Beside {
    /// The time tau in the cells, one ghost layer filled \[s].
    damping: Field<Real>,
    /// The factor b in the cells, one ghost layer filled: what friction leaves of an acceleration within the step.
    response: Field<Real>,
}

impl Acceleration {
    /// The acceleration that the viscous step of `flow` needs, if it ever needs one; no memory is taken before it does.
    pub fn of(domain: &Domain, grains: &ResolvedGrains, flow: &Flow) -> Option<Self> {
        let is_implicit = !matches!(flow.schemes.viscosity, ViscosityScheme::Off | ViscosityScheme::Explicit);
        let beside = grains.has_surfaces() && flow.schemes.viscosity != ViscosityScheme::Off;
        if !beside && !is_implicit {
            return None;
        }
        let beside = beside.then(|| Beside { damping: domain.field(0.0), response: domain.field(1.0) });
        Some(Self { faces: None, beside, spacing: domain.grid().spacing })
    }

    /// Whether surfaces need it in every step.
    pub fn is_beside_surfaces(&self) -> bool {
        self.beside.is_some()
    }

    /// The acceleration for a pass of `dt` \[s] if the viscous step in it has to see one; sets the form of the transposed
    /// gradient in `flow`.
    pub fn for_pass<'a>(
        this: &'a mut Option<Self>,
        domain: &Domain,
        flow: &mut Flow,
        dt: Real,
    ) -> Option<&'a mut Self> {
        let is_implicit = flow.diffuses_implicitly(domain, dt);
        let this = this.as_mut().filter(|this| this.is_beside_surfaces() || is_implicit);
        // The whole transposed gradient, explicit, is unstable with the old acceleration from steps of 2 dx^2 / nu on.
        flow.transposed = if this.is_some() { Transposed::AtInterface } else { Transposed::Whole };
        this
    }

    /// Keeps the acceleration that the last projection and `gravity` gave a fluid of this `density`, ghosts filled.
    pub fn keep(&mut self, domain: &Domain, projection: &Projection, density: &Field<Real>, gravity: Vector) {
        let (p, rho) = (projection.pressure().data(), density.data());
        let faces = self.faces.get_or_insert_with(|| std::array::from_fn(|_| domain.field(0.0)));
        for (d, faces) in faces.iter_mut().enumerate() {
            let (behind, per_width) = (domain.strides()[d], 2.0 / self.spacing[d]);
            domain.for_each_row(&domain.faces(d), faces.data_mut(), |row, faces| {
                let faces = &mut faces[..row.len];
                let [[p_l, p], [rho_l, rho]] = [p, rho].map(|values| [-behind, 0].map(|by| &values[row.shifted(by)]));
                for i in 0..row.len {
                    faces[i] = gravity[d] - per_width * (p[i] - p_l[i]) / (rho[i] + rho_l[i]);
                }
            });
        }
        if let Some(tension) = &projection.tension {
            tension.add_acceleration(domain, density, faces);
        }
    }

    /// Beside surfaces of grains, where the transport has changed the `density`, keeps the smaller of the two accelerations that the last
    /// projection gives a fluid of this density and of that before: what has come to a face does not leap away with what was light there.
    pub fn carry(&mut self, domain: &Domain, projection: &Projection, density: &Field<Real>, gravity: Vector) {
        if self.beside.is_none() {
            return;
        }
        let (p, rho) = (projection.pressure().data(), density.data());
        let jump = projection.tension.as_ref().map(SurfaceTension::jump);
        for (d, faces) in self.faces.iter_mut().flatten().enumerate() {
            let (behind, per_width) = (domain.strides()[d], 2.0 / self.spacing[d]);
            let jump = jump.map(|jump| jump[d].data());
            domain.for_each_row(&domain.faces(d), faces.data_mut(), |row, faces| {
                let faces = &mut faces[..row.len];
                let [[p_l, p], [rho_l, rho]] = [p, rho].map(|values| [-behind, 0].map(|by| &values[row.shifted(by)]));
                let jump = jump.map(|jump| &jump[row.shifted(0)]);
                for i in 0..row.len {
                    let rise = p[i] - p_l[i] - jump.map_or(0.0, |jump| jump[i]);
                    let by_pressure = per_width * rise / (rho[i] + rho_l[i]);
                    let is_less = by_pressure.abs() < (gravity[d] - faces[i]).abs();
                    faces[i] = if is_less { gravity[d] - by_pressure } else { faces[i] };
                }
            });
        }
    }

    /// Adds the acceleration over `dt` \[s] to the velocity of the cells.
    pub fn add(&self, domain: &Domain, velocity: &mut [Field<Real>; 3], dt: Real) {
        for (d, (u, faces)) in velocity.iter_mut().zip(self.kept()).enumerate() {
            let (a, ahead) = (faces.data(), domain.strides()[d]);
            domain.for_each_row(&domain.interior(), u.data_mut(), |row, u| {
                add_to_row(u, [0, ahead].map(|by| &a[row.shifted(by)]), |_| dt);
            });
        }
    }

    /// The acceleration on the faces [m/s^2].
    pub fn kept(&self) -> &[Field<Real>; 3] {
        self.faces.as_ref().expect("it was kept at the start of the pass")
    }

    /// Takes the acceleration over the pass back after the viscous step, and predicts the face velocities.
    pub fn predict(&self, pass: &Pass, flow: &mut Flow, impulses: &mut Impulses) {
        let Pass { domain, gravity, dt, .. } = *pass;
        let Some(Beside { damping, response }) = &self.beside else {
            self.add(domain, &mut flow.velocity, -dt);
            return pass.predict(flow, impulses);
        };
        let (damping, response) = (damping.data(), response.data());
        let (a, strides) = (self.kept().each_ref().map(Field::data), domain.strides());
        let around = |d: usize, row: &Row| [0, strides[d]].map(|by| &a[d][row.shifted(by)]);
        let damp = |d: usize, row: &Row, u: &mut [Real]| {
            let damping = &damping[row.start..][..u.len()];
            add_to_row(u, around(d, row), |i| -damping[i]);
        };
        let correct = |d: usize, row: &Row, rho: &[Real], uf: &mut [Real]| {
            let (uf, a) = (&mut uf[..row.len], &a[d][row.shifted(0)]);
            let [[rho_l, rho], [damping_l, damping], [response_l, response]] =
                [rho, damping, response].map(|values| [-strides[d], 0].map(|by| &values[row.shifted(by)]));
            for i in 0..row.len {
                let part = rho_l[i] / (rho_l[i] + rho[i]);
                let mean = |l: Real, r: Real| r + part * (l - r);
                let response = dt * mean(response_l[i], response[i]);
                uf[i] += (mean(damping_l[i], damping[i]) - response) * a[i] + (response - dt) * gravity[d];
            }
        };
        pass.predict_by(flow, impulses, damp, correct);
        for (d, u) in flow.velocity.iter_mut().enumerate() {
            domain.for_each_row(&domain.interior(), u.data_mut(), |row, u| {
                let damping = &damping[row.start..][..u.len()];
                add_to_row(u, around(d, &row), |i| damping[i] - dt);
            });
        }
    }

    /// Sets the damping time for a pass of `dt` \[s]; `friction` is that of the surfaces over the viscosity [1/m^2].
    pub fn set_damping(&mut self, domain: &Domain, dt: Real, flow: &Flow, friction: &[Real]) {
        let c = flow.volume_fraction.data();
        let squares = 3.0 / (self.spacing * self.spacing).recip().element_sum();
        let Some(Beside { damping, response }) = &mut self.beside else { return };
        domain.for_each_row(
            &domain.interior(),
            (damping.data_mut(), response.data_mut()),
            |row, (damping, response)| {
                let (c, friction) = (&c[row.shifted(0)], &friction[row.shifted(0)]);
                let (damping, response) = (&mut damping[..row.len], &mut response[..row.len]);
                for i in 0..row.len {
                    let nu = flow.fluids.kinematic_viscosity(c[i]);
                    response[i] = if friction[i] > 0.0 { 1.0 / (1.0 + dt * nu * friction[i]) } else { 1.0 };
                    damping[i] = (dt * response[i]).min(DAMPING * squares / nu);
                }
            },
        );
        let even = &GhostRules::EVEN;
        domain.fill_halos_to(1, &mut [(damping, even), (response, even)]);
    }

    /// The factor b in the cells, if it is not one everywhere.
    pub fn response(&self) -> Option<&[Real]> {
        self.beside.as_ref().map(|beside| beside.response.data())
    }

    /// Finds the change of the acceleration by the projection, times the length of the pass [m/s], in the cells of these `rows`: the middle
    /// three scratch fields.
    pub fn find_change(&self, pass: &Pass, flow: &mut Flow, projection: &Projection, rows: &RowSet) {
        let Pass { domain, gravity, dt, .. } = *pass;
        let Flow { density, work: [_, _, _, c1, c2, c3, ..], .. } = flow;
        let (gradient, density) = (projection.gradient(density), density.data());
        let (faces, ahead) = (self.kept().each_ref().map(Field::data), domain.strides());
        let changes = (c1.data_mut(), c2.data_mut(), c3.data_mut());
        domain.for_each_row(&domain.interior(), changes, |row, (c1, c2, c3)| {
            if !rows.holds(row.j, row.k) {
                return;
            }
            for (d, change) in [c1, c2, c3].into_iter().enumerate() {
                let (change, density, gradient) =
                    (&mut change[..row.len], &density[row.shifted(0)], gradient.in_row(d, &row));
                let [lower, upper] = [0, ahead[d]].map(|by| &faces[d][row.shifted(by)]);
                for i in 0..row.len {
                    change[i] = dt * (gravity[d] - gradient(i) / density[i] - 0.5 * (lower[i] + upper[i]));
                }
            }
        });
    }
}

/// Adds the acceleration, the mean of that on the lower and the upper faces, times `time(i)` to the velocity in a row of cells.
#[inline]
fn add_to_row(u: &mut [Real], faces: [&[Real]; 2], time: impl Fn(usize) -> Real) {
    let n = u.len();
    let [lower, upper] = faces.map(|faces| &faces[..n]);
    for i in 0..n {
        u[i] += time(i) * 0.5 * (lower[i] + upper[i]);
    }
}
