//! The pressure that makes the face velocity free of divergence.
//!
//! `div((1/rho) grad p) = div(uf*) / dt`, with the coefficient `2 / (rho_L + rho_R)` on the face
//! between two cells (the mass between their centres). The face velocity then takes the face
//! gradient, the cell velocity the gradient of face pressures
//! `(p_L rho_R + p_R rho_L) / (rho_L + rho_R)`, for which the acceleration is the same on both sides
//! of a face: momentum changes by the pressure on the sides of the box alone, and a fluid of any
//! layers at rest stays at rest. On a wall, whose face does not move, the face pressure is that of a
//! fluid at rest: `p_c + rho_c (dx/2) g . n`. The pressure is solved for in full at every step, with
//! the last one as the first guess. Surface tension takes its jump from every difference of pressures ([`crate::surface_tension`]). Where grains close faces, the coefficient is that times their [`Mobility`].
//!
//! Density and pressure on collocated grids: Ushijima and Nezu's C-ISMAC family; consistent face
//! accelerations: Popinet, J. Comput. Phys. 228 (2009) 5838.

use sazanami_numerics::domain::{Domain, Range3, Row};
use sazanami_numerics::grid::Field;
use sazanami_numerics::linear::{ConjugateGradient, Equation, Solution, SolveError, Stop};
use sazanami_numerics::{Real, Vector};

use crate::boundary::Boundary;
use crate::flow::Flow;
use crate::mean_gradient::{MeanFlux, MeanGradient};
use crate::mobility::{Closing, Mobility};
use crate::outside::Outside;
pub use crate::outside::PressureSide;
use crate::pressure_sides::BoxSides;
use crate::stability::{Rates, StepLimits, body_force_rate};
use crate::surface_tension::{SurfaceTension, SurfaceTensionReport};

/// Convergence criterion of the projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Largest `|div u| dt` allowed in a cell; less is wanted of slow flows: [`Self::at`].
    pub divergence: Real,
    /// Iterations after which the solve fails.
    pub max_iterations: usize,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { divergence: 1e-6, max_iterations: 500 }
    }
}

/// Courant number below which what is wanted falls with it, so that what the projection leaves stays small beside the flow.
const SLOW: Real = 0.01;
/// What is wanted of the slowest flows.
const LEAST: Real = 1e-10;

impl Tolerance {
    /// The largest `|div u| dt` that is wanted at a Courant number: what is allowed, in proportion less below 0.01, and no less than
    /// 1e-10 unless less is allowed. A solve that ends by rounding between the two has done what is allowed.
    #[must_use]
    pub fn at(&self, courant: Real) -> Real {
        self.divergence.min((self.divergence * courant / SLOW).max(LEAST))
    }
}

/// Diagnostics of a projection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PressureReport {
    /// Iterations of the conjugate-gradient solver.
    pub iterations: usize,
    /// Largest `|div u| dt` of a cell afterwards.
    pub divergence: Real,
    /// 2-norm of the divergence afterwards over that with the first guess.
    pub residual: Real,
    /// Impulse of the pressure on all sides of the box on the fluid [N s].
    pub wall_impulse: Vector,
    /// What surface tension did.
    pub surface_tension: SurfaceTensionReport,
}

impl std::ops::AddAssign for PressureReport {
    /// Iterations and impulses add up; residuals take the larger value.
    fn add_assign(&mut self, other: Self) {
        self.iterations += other.iterations;
        self.divergence = self.divergence.max(other.divergence);
        self.residual = self.residual.max(other.residual);
        self.wall_impulse += other.wall_impulse;
        self.surface_tension += other.surface_tension;
    }
}

/// The pressure equation could not be solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PressureError {
    /// The solver stalled or ran out of iterations.
    #[error(
        "the pressure did not converge: |div u| dt = {divergence:.2e} after {iterations} iterations, asked for \
         {tolerance:.2e}; it is largest in {place}"
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Largest `|div u| dt` reached.
        divergence: Real,
        /// Largest `|div u| dt` asked for.
        tolerance: Real,
        /// Cell of the largest divergence.
        place: CellPlace,
    },
    /// A velocity or density is NaN or infinite.
    #[error(
        "the pressure equation met NaN or an infinite value after {iterations} iterations, first in \
         {place}"
    )]
    NotFinite {
        /// Iterations done.
        iterations: usize,
        /// The first cell whose residual is not finite, or else the largest.
        place: CellPlace,
    },
}

/// A cell, for error messages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellPlace {
    /// Global indices of the cell.
    pub cell: [usize; 3],
    /// Centre of the cell \[m].
    pub position: Vector,
}

impl std::fmt::Display for CellPlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ([i, j, k], p) = (self.cell, self.position);
        write!(f, "cell ({i}, {j}, {k}) at ({:.4e}, {:.4e}, {:.4e}) m", p.x, p.y, p.z)
    }
}

/// Pressure field and the solver of its equation.
pub struct Projection {
    sides: [[PressureSide; 2]; 3],
    pressure: Field<Real>,
    solver: ConjugateGradient,
    spacing: Vector,
    pub(crate) mobility: Mobility,
    /// The fluid outside the open sides.
    outside: Outside,
    /// The mean gradient along periodic directions.
    pub(crate) mean: MeanGradient,
    /// Surface tension, if there is any.
    pub(crate) tension: Option<SurfaceTension>,
}

impl Projection {
    /// Storage for the cells of `domain`, with zero pressure.
    #[must_use]
    pub fn new(domain: &Domain, sides: [[PressureSide; 2]; 3]) -> Self {
        Self {
            sides,
            pressure: domain.field(0.0),
            solver: ConjugateGradient::new(domain),
            spacing: domain.grid().spacing,
            mobility: Mobility::new(domain),
            outside: Outside::default(),
            mean: MeanGradient::default(),
            tension: None,
        }
    }

    /// Gives the fluid outside open sides of a box with this `flow` a `gravity` [m/s^2]. Without it the pressure is the same all over a
    /// side.
    pub(crate) fn set_outside(&mut self, domain: &Domain, gravity: Vector, flow: &Flow) {
        self.outside.set(domain, gravity, &flow.fluids);
        self.outside.update(domain, &self.sides, &flow.volume_fraction);
    }

    /// The fluid outside the open sides, as the last projection found it.
    pub(crate) fn outside(&self) -> &Outside {
        &self.outside
    }

    /// Makes the velocity of `flow` free of divergence at once, and finds the pressure under gravity, and the mean gradient that holds a
    /// net flow against it, with which the first step starts: those of a step in which nothing is transported, less what acts at once.
    /// `box_gains` is the velocity [m/s] that what enters a box that moves gains in a time \[s].
    ///
    /// # Errors
    /// [`PressureError`].
    pub(crate) fn start(
        &mut self,
        domain: &Domain,
        (boundary, box_gains): (&Boundary, impl Fn(Real) -> Vector),
        flow: &mut Flow,
        gravity: Vector,
        limits: &StepLimits,
        tolerance: &Tolerance,
    ) -> Result<(), PressureError> {
        flow.fill_halos(domain, boundary);
        flow.predict_faces(domain, boundary, Vector::ZERO, 0.0);
        // The pressure does not hang on the length of the step, the rounding of the solve does.
        let spacing = domain.grid().spacing;
        let pushed = self.largest_pressure() / domain.grid().extent().min_element() + self.mean.gradient().length();
        let pushed = pushed / flow.fluids.liquid_density.min(flow.fluids.gas_density);
        let pulled = gravity.length().max(boundary.gravity_outside().length());
        let body_force = body_force_rate(Vector::X * (pulled + pushed), spacing);
        let rates = Rates { advective: flow.advective_rate(domain), body_force, ..Rates::default() };
        let dt = StepLimits { fixed: None, ..*limits }.choose(&rates, None).dt;
        let courant = dt * rates.advective;
        let (sides, outside, started) = (self.sides, boundary.gravity_outside(), flow.velocity.clone());
        self.set_outside(domain, outside, flow);
        let entered = boundary.with_faster_inflow(box_gains(dt));
        self.step_in_place(domain, &entered, flow, gravity, dt, (tolerance, courant))?;
        let with_gravity = std::mem::replace(&mut self.pressure, domain.field(0.0));
        flow.velocity = started;
        let driven = self.mean.acceleration();
        self.mean.drive(Vector::ZERO, flow.fluids.liquid_density);
        // The fluid outside is without pressure: what that differs by would act for the length of a step.
        self.sides = sides.map(|pair| pair.map(PressureSide::without_pressure));
        self.set_outside(domain, Vector::ZERO, flow);
        self.step_in_place(domain, boundary, flow, Vector::ZERO, dt, (tolerance, courant))?;
        self.sides = sides;
        self.set_outside(domain, outside, flow);
        self.mean.drive(driven - self.mean.acceleration(), flow.fluids.liquid_density);
        for (p, with_gravity) in self.pressure.data_mut().iter_mut().zip(with_gravity.data()) {
            *p = with_gravity - *p;
        }
        self.fill_ghosts(domain, flow, gravity);
        flow.fill_halos(domain, boundary);
        Ok(())
    }

    /// Pressures outside open sides \[Pa].
    fn pressures_outside(&self) -> impl Iterator<Item = Real> {
        self.sides.as_flattened().iter().filter_map(|side| match side {
            PressureSide::Fixed { pressure, .. } => Some(*pressure),
            PressureSide::Wall | PressureSide::Periodic => None,
        })
    }

    /// The largest of them \[Pa].
    fn largest_pressure(&self) -> Real {
        self.pressures_outside().map(Real::abs).fold(0.0, Real::max)
    }

    /// By how much they differ, over the shortest edge of the box [Pa/m].
    pub fn gradient_of_sides(&self, domain: &Domain) -> Real {
        let (highest, lowest) =
            (self.pressures_outside().reduce(Real::max), self.pressures_outside().reduce(Real::min));
        let apart = highest.zip(lowest).map_or(0.0, |(highest, lowest)| highest - lowest);
        apart / domain.grid().extent().min_element()
    }

    /// Projects the velocity of `flow` after a step of `dt` \[s] under `gravity` [m/s^2] in which nothing is transported.
    fn step_in_place(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        flow: &mut Flow,
        gravity: Vector,
        dt: Real,
        (tolerance, courant): (&Tolerance, Real),
    ) -> Result<PressureReport, PressureError> {
        flow.fill_halos(domain, boundary);
        flow.predict_faces(domain, boundary, gravity, dt);
        let Flow { volume_fraction, density, velocity, face_velocity, .. } = flow;
        self.project(domain, [volume_fraction, density], velocity, face_velocity, gravity, dt, tolerance, courant)
    }

    /// The pressure \[Pa]. Without a side of fixed pressure its mean is zero.
    #[must_use]
    pub fn pressure(&self) -> &Field<Real> {
        &self.pressure
    }

    /// The pressure \[Pa] for writing, at a restart: the first guess of the next projection.
    pub fn pressure_mut(&mut self) -> &mut Field<Real> {
        &mut self.pressure
    }

    /// Fills the ghosts of the pressure as the projection that gave it did, for a restart: `flow` is that of the projection.
    pub fn fill_ghosts(&mut self, domain: &Domain, flow: &Flow, gravity: Vector) {
        let density = &flow.density;
        self.outside.update(domain, &self.sides, &flow.volume_fraction);
        let sides = BoxSides::new(domain, &self.sides, &self.outside, self.mean.gradient());
        sides.fill_solving(domain, &mut self.pressure, density);
        let _ = sides.fill_behind_walls(domain, &mut self.pressure, density, gravity);
    }

    /// Boundary conditions of the pressure.
    #[must_use]
    pub fn sides(&self) -> &[[PressureSide; 2]; 3] {
        &self.sides
    }

    /// Finds the jumps of the pressure by surface tension for the next projection, if there is any; all ghosts of the liquid fraction must
    /// be filled; `solid` is the solid fraction, one ghost layer filled, if there are grains. Collective.
    pub fn find_jumps(&mut self, domain: &Domain, flow: &Flow, solid: Option<&[Real]>) {
        if let Some(tension) = &mut self.tension {
            tension.find(domain, flow, solid);
        }
    }

    /// Makes `face_velocity` divergence-free and corrects `velocity` with the same pressure.
    ///
    /// `courant` is the Courant number of the flow before, by which slow flows are solved for more finely ([`Tolerance::at`]).
    /// `face_velocity` holds the predicted velocity, gravity included, on all faces of the cells of
    /// the rank (on walls and inlets the prescribed one); of the liquid fraction and the density, the latter needs one ghost layer.
    /// Faces and cells of the interior are corrected, ghosts are not.
    ///
    /// # Errors
    /// [`PressureError`]; the velocities are then as they were.
    #[expect(clippy::too_many_arguments, reason = "fields of the flow are borrowed one by one")]
    pub fn project(
        &mut self,
        domain: &Domain,
        [fraction, density]: [&Field<Real>; 2],
        velocity: &mut [Field<Real>; 3],
        face_velocity: &mut [Field<Real>; 3],
        gravity: Vector,
        dt: Real,
        tolerance: &Tolerance,
        courant: Real,
    ) -> Result<PressureReport, PressureError> {
        let Tolerance { divergence: asked, max_iterations } = *tolerance;
        self.outside.update(domain, &self.sides, fraction);
        let Self { sides, pressure, solver, spacing, mobility, outside, mean, tension } = self;
        if let Some(tension) = &*tension {
            tension.push_faces(domain, density, mobility, face_velocity, dt);
        }
        let of = |gradient: Vector| BoxSides::new(domain, sides, outside, gradient);
        let stop = Stop::Largest(tolerance.at(courant) / (dt * dt));
        let mut solve = |sides: &BoxSides<'_>, velocity: Option<&[Field<Real>; 3]>, p: &mut Field<Real>, stop: Stop| {
            let equation =
                PressureEquation { density, mobility, face_velocity: velocity, sides, spacing: *spacing, dt };
            solver.solve(domain, &equation, p, stop, max_iterations).or_else(|error| {
                let place = equation.worst_cell(domain, p.data());
                match error {
                    SolveError::NotFinite { iterations } => Err(PressureError::NotFinite { iterations, place }),
                    SolveError::NotConverged { iterations, residual, .. }
                    | SolveError::Breakdown { iterations, residual, .. } => {
                        let divergence = residual * dt * dt;
                        if divergence <= asked {
                            return Ok(Solution {
                                iterations,
                                largest: residual,
                                relative: 1.0,
                                ..Solution::default()
                            });
                        }
                        Err(PressureError::NotConverged { iterations, divergence, tolerance: asked, place })
                    }
                }
            })
        };
        let mut box_sides = of(mean.gradient());
        let mut solution = solve(&box_sides, Some(face_velocity), pressure, stop)?;
        if mean.is_held() {
            let before = solution.iterations;
            let flux = MeanFlux { domain, mobility, density: density.data(), spacing: *spacing };
            let spent =
                mean.respond(&flux, &box_sides, |sides, p, stop| Ok(solve(sides, None, p, stop)?.iterations))?;
            mean.meet(&flux, face_velocity, pressure, dt);
            box_sides = of(mean.gradient());
            solution = solve(&box_sides, Some(face_velocity), pressure, stop)?;
            solution.iterations += before + spent;
        }
        let (mobility, spacing) = (&*mobility, *spacing);
        let force = box_sides.fill_behind_walls(domain, pressure, density, gravity);
        Self::correct(domain, &box_sides, (pressure, mobility, spacing), density, velocity, face_velocity, dt);
        let surface_tension = tension.as_ref().map_or_else(SurfaceTensionReport::default, |tension| {
            tension.report(tension.push_cells(domain, density, velocity, dt))
        });
        let [x, y, z] = domain.sum(force.to_array());
        Ok(PressureReport {
            surface_tension,
            iterations: solution.iterations,
            divergence: solution.largest * dt * dt,
            residual: solution.relative,
            wall_impulse: Vector::new(x, y, z) * dt,
        })
    }

    /// Closes the faces beside the grains for a projection over `dt` \[s]: see
    /// [`crate::mobility`].
    pub(crate) fn close_faces(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        closing: Closing<'_>,
        flow: &mut Flow,
        dt: Real,
    ) {
        let jump = self.tension.as_ref().map(SurfaceTension::jump);
        self.mobility.close(domain, boundary, closing, (&self.pressure, jump), flow, dt);
    }

    /// The gradient that the last projection gave the cells; `density` must still be the same.
    #[must_use]
    pub fn gradient<'a>(&'a self, density: &'a Field<Real>) -> PressureGradient<'a> {
        PressureGradient {
            pressure: self.pressure.data(),
            density: density.data(),
            strides: self.pressure.strides(),
            spacing: self.spacing,
            jump: self.tension.as_ref().map(|tension| tension.jump().each_ref().map(Field::data)),
        }
    }

    /// Adds `factor` \[s] times grad p / rho to `velocity`, with the pressure of the last projection.
    ///
    /// Before a transport that sees the pressure half of the step is added, after it taken back.
    pub fn add_gradient(&self, domain: &Domain, density: &Field<Real>, velocity: &mut [Field<Real>; 3], factor: Real) {
        if factor == 0.0 {
            return;
        }
        let gradient = self.gradient(density);
        let [u1, u2, u3] = velocity.each_mut().map(Field::data_mut);
        domain.for_each_row(&domain.interior(), (u1, u2, u3), |row, (u1, u2, u3)| {
            for (d, u) in [u1, u2, u3].into_iter().enumerate() {
                let (u, density, gradient) =
                    (&mut u[..row.len], &gradient.density[row.shifted(0)], gradient.in_row(d, &row));
                for n in 0..row.len {
                    u[n] += gradient(n) * (factor / density[n]);
                }
            }
        });
    }

    /// Subtracts the face accelerations from faces and, averaged over opposite faces, from cells.
    fn correct(
        domain: &Domain,
        sides: &BoxSides<'_>,
        (pressure, mobilities, spacing): (&Field<Real>, &Mobility, Vector),
        density: &Field<Real>,
        velocity: &mut [Field<Real>; 3],
        face_velocity: &mut [Field<Real>; 3],
        dt: Real,
    ) {
        let (p, rho) = (pressure.data(), density.data());
        let strides = domain.strides();
        let [u1, u2, u3] = velocity.each_mut().map(Field::data_mut);
        let [f1, f2, f3] = face_velocity.each_mut().map(Field::data_mut);
        domain.for_each_row(&domain.interior(), (u1, u2, u3, f1, f2, f3), |row, (u1, u2, u3, f1, f2, f3)| {
            let at_wall = [false, sides.wall[1][0] && row.j == 0, sides.wall[2][0] && row.k == 0];
            let kept = f1[0];
            let mobility = [0, 1, 2].map(|d| mobilities.of(d, &row, false));
            for (d, (u, f)) in [(u1, &mut *f1), (u2, f2), (u3, f3)].into_iter().enumerate() {
                let scale = dt / spacing[d];
                let face_scale = if at_wall[d] { 0.0 } else { 2.0 * scale };
                let (pc, rc) = (&p[row.shifted(0)], &rho[row.shifted(0)]);
                let (pl, rl) = (&p[row.shifted(-strides[d])], &rho[row.shifted(-strides[d])]);
                let (pu, ru) = (&p[row.shifted(strides[d])], &rho[row.shifted(strides[d])]);
                let (u, f, m) = (&mut u[..row.len], &mut f[..row.len], &mobility[d][..row.len]);
                for n in 0..row.len {
                    let lower = (pc[n] - pl[n]) / (rc[n] + rl[n]);
                    let upper = (pu[n] - pc[n]) / (rc[n] + ru[n]);
                    f[n] -= face_scale * (m[n] * lower);
                    u[n] -= scale * (lower + upper);
                }
            }
            if sides.wall[0][0] {
                f1[0] = kept;
            }
        });
        for d in 0..3 {
            if sides.wall[d][1] {
                continue;
            }
            let last = domain.cells()[d] as isize;
            let mut layer: Range3 = domain.interior();
            layer[d] = last..last + 1;
            let scale = 2.0 * dt / spacing[d];
            domain.for_each_row(&layer, face_velocity[d].data_mut(), |row, f| {
                let mobility = mobilities.of(d, &row, false);
                for (n, at) in row.shifted(0).enumerate() {
                    let below = at - strides[d] as usize;
                    f[n] -= scale * (mobility[n] * ((p[at] - p[below]) / (rho[at] + rho[below])));
                }
            });
        }
    }
}

/// The pressure gradient in the cells, from pressure and density.
#[derive(Clone, Copy)]
pub struct PressureGradient<'a> {
    pressure: &'a [Real],
    density: &'a [Real],
    strides: [usize; 3],
    spacing: Vector,
    /// Jumps by surface tension across the lower faces.
    jump: Option<[&'a [Real]; 3]>,
}

impl PressureGradient<'_> {
    /// Gradient, less what surface tension balances of it [Pa/m], in the interior cell with this place in memory ([`Field::at`]).
    #[inline]
    #[must_use]
    pub fn at(&self, at: usize) -> Vector {
        let (p, rho) = (self.pressure, self.density);
        let component = |d: usize| {
            let (below, above) = (at - self.strides[d], at + self.strides[d]);
            let [jump, next] = self.jump.map_or([0.0; 2], |jump| [jump[d][at], jump[d][above]]);
            let lower = (p[at] - p[below] - jump) / (rho[at] + rho[below]);
            let upper = (p[above] - p[at] - next) / (rho[at] + rho[above]);
            rho[at] * (lower + upper) / self.spacing[d]
        };
        Vector::new(component(0), component(1), component(2))
    }

    /// Component `d` of the same in a row of interior cells, by place in the row.
    #[inline]
    pub(crate) fn in_row(&self, d: usize, row: &Row) -> impl Fn(usize) -> Real {
        let (stride, spacing) = (self.strides[d] as isize, self.spacing[d]);
        let [[p_l, p, p_u], [rho_l, rho, rho_u]] =
            [self.pressure, self.density].map(|values| [-stride, 0, stride].map(|by| &values[row.shifted(by)]));
        let jumps = self.jump.map(|jump| [0, stride].map(|by| &jump[d][row.shifted(by)]));
        move |n| {
            let [jump, next] = jumps.map_or([0.0; 2], |[jump, next]| [jump[n], next[n]]);
            let lower = (p[n] - p_l[n] - jump) / (rho[n] + rho_l[n]);
            let upper = (p_u[n] - p[n] - next) / (rho[n] + rho_u[n]);
            rho[n] * (lower + upper) / spacing
        }
    }
}

/// The pressure equation, with coefficients from the density and the right-hand side from the
/// predicted face velocity; residuals are -div(u)/dt of the velocity the pressure would give.
struct PressureEquation<'a> {
    density: &'a Field<Real>,
    mobility: &'a Mobility,
    /// The velocity that the pressure makes free of divergence, if there is one.
    face_velocity: Option<&'a [Field<Real>; 3]>,
    sides: &'a BoxSides<'a>,
    spacing: Vector,
    dt: Real,
}

impl PressureEquation<'_> {
    /// The cell with the largest residual, one that is not finite before all others. Collective.
    fn worst_cell(&self, domain: &Domain, p: &[Real]) -> CellPlace {
        let size = |value: Real| if value.is_finite() { value.abs() } else { Real::INFINITY };
        let largest_in = |range: &Range3| {
            domain.max_rows(range, |row| {
                let mut values = vec![0.0; row.len];
                self.residual(row, p, &mut values);
                values.into_iter().map(size).fold(0.0, Real::max)
            })
        };
        let mut range = domain.interior();
        let mine = largest_in(&range);
        for d in [2, 1, 0] {
            let holds = |n: &isize| {
                let mut part = range.clone();
                part[d] = *n..*n + 1;
                largest_in(&part) == mine
            };
            let at = range[d].clone().find(holds).unwrap_or(range[d].start);
            range[d] = at..at + 1;
        }
        let rank = domain.communicator().rank() as Real;
        let first = domain.min(if mine == domain.max(mine) { rank } else { Real::INFINITY });
        let start = domain.start();
        let index = |d: usize| if rank == first { (range[d].start as usize + start[d]) as Real } else { 0.0 };
        let cell = domain.sum([index(0), index(1), index(2)]).map(|n| n as usize);
        let [i, j, k] = cell.map(|n| n as isize);
        CellPlace { cell, position: domain.grid().centre(i, j, k) }
    }

    /// Side of the box on which a face at this index in its direction lies, if its velocity or pressure is given there.
    fn side(&self, direction: usize, index: isize) -> Option<usize> {
        let last = self.density.cells()[direction] as isize;
        let side = if index == 0 { 0 } else { usize::from(index == last) };
        let at_end = index == 0 || index == last;
        (at_end && (self.sides.wall[direction][side] || self.sides.fixed[direction][side].is_some())).then_some(side)
    }
}

impl Equation for PressureEquation<'_> {
    fn coefficients(&self, direction: usize, row: Row, into: &mut [Real]) {
        let stride = self.density.strides()[direction] as isize;
        let scale = 2.0 / (self.spacing[direction] * self.spacing[direction]);
        let rho = self.density.data();
        let (above, below) = (&rho[row.shifted(0)], &rho[row.shifted(-stride)]);
        let mobility = self.mobility.of(direction, &row, false);
        for (((into, above), below), mobility) in into.iter_mut().zip(above).zip(below).zip(mobility) {
            *into = mobility * (scale / (above + below));
        }
        let mut on_side = |side: usize, n: usize| {
            into[n] = match self.sides.fixed[direction][side] {
                Some(_) => scale / if side == 0 { above[n] } else { below[n] },
                None => 0.0,
            };
        };
        match direction {
            0 => {
                for n in [0, row.len - 1] {
                    if let Some(side) = self.side(0, row.first + n as isize) {
                        on_side(side, n);
                    }
                }
            }
            _ => {
                if let Some(side) = self.side(direction, if direction == 1 { row.j } else { row.k }) {
                    (0..row.len).for_each(|n| on_side(side, n));
                }
            }
        }
    }

    fn residual(&self, row: Row, p: &[Real], into: &mut [Real]) {
        let rho = self.density.data();
        let (pc, rc) = (&p[row.shifted(0)], &rho[row.shifted(0)]);
        into.fill(0.0);
        for d in 0..3 {
            let stride = self.density.strides()[d] as isize;
            let scale = 2.0 / (self.spacing[d] * self.spacing[d]);
            let rate = 1.0 / (self.dt * self.spacing[d]);
            let (pl, rl) = (&p[row.shifted(-stride)], &rho[row.shifted(-stride)]);
            let (pu, ru) = (&p[row.shifted(stride)], &rho[row.shifted(stride)]);
            let velocity = self.face_velocity.map(|velocity| velocity[d].data());
            let fluxes = velocity.map(|velocity| (&velocity[row.shifted(0)], &velocity[row.shifted(stride)]));
            let into = &mut into[..row.len];
            let [ml, mu] = [false, true].map(|upper| &self.mobility.of(d, &row, upper)[..row.len]);
            let flow_by_pressure = |n: usize| {
                let lower = ml[n] * ((pc[n] - pl[n]) / (rc[n] + rl[n]));
                let upper = mu[n] * ((pu[n] - pc[n]) / (rc[n] + ru[n]));
                scale * (upper - lower)
            };
            match fluxes {
                Some((fl, fu)) => (0..row.len).for_each(|n| into[n] += flow_by_pressure(n) - rate * (fu[n] - fl[n])),
                None => (0..row.len).for_each(|n| into[n] += flow_by_pressure(n)),
            }
        }
    }

    fn fill_ghosts(&self, domain: &Domain, p: &mut Field<Real>) {
        self.sides.fill_solving(domain, p, self.density);
    }

    fn is_singular(&self) -> bool {
        self.sides.singular
    }
}
