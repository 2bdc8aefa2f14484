//! Viscous stress: implicit in the gradient of each component, explicit in the transposed gradient.
//!
//! The change w of the velocity over a step obeys, per component,
//!
//! ```text
//! (rho / dt) w_i - div(mu grad w_i) = div(mu (grad u + grad u^T))_i
//! ```
//!
//! with the harmonic mean of the viscosities of the two cells at a face. It is solved by Chebyshev
//! steps on Jacobi's iteration, whose number follows from the bound of the spectrum beforehand: no
//! scalar products, hence the same bits on any number of ranks. A last step evaluates the stress of
//! `u + w` on the faces, so that momentum changes at walls only, however well w has converged.

use std::cell::RefCell;

use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::{Field, GHOSTS};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{SlicesMut, for_each_chunk};

use crate::boundary::Boundary;
use crate::flow::{Flow, Fluids};

/// Time integration of the viscous stress.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViscosityScheme {
    /// Backward Euler.
    #[default]
    Implicit,
    /// The stress at the start for half a step before the transport, backward Euler for half a step
    /// after it: second order in time.
    CrankNicolson,
    /// The stress before; limits the time step.
    Explicit,
    /// No viscous stress.
    Off,
}

/// The viscous step cannot be solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ViscosityError {
    /// The time step is so long that the iteration would not end.
    #[error("the viscous solve would take {iterations} iterations for a time step of {dt:e} s; shorten the step")]
    TooStiff {
        /// Iterations it would take.
        iterations: usize,
        /// Time step [s].
        dt: Real,
    },
    /// A value is not a number.
    #[error("the viscous stress on the walls is not finite")]
    NotFinite,
}

/// What a viscous step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DiffusionReport {
    /// Passes over the grid for the solve.
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

const MOST_ITERATIONS: usize = 4000;
/// Default of [`Flow::viscous_tolerance`].
pub(crate) const TOLERANCE: Real = 1e-5;
/// Stands for the reciprocal of no viscosity at all [1/(Pa s)].
const FLUID: Real = 1e200;
/// Planes whose stresses are computed in one go.
const DEPTH: usize = 8;

/// Coefficients of the viscous stress on a grid.
#[derive(Clone, Copy)]
struct Stress {
    strides: [isize; 3],
    /// Reciprocals of the cell widths [1/m].
    per_width: [Real; 3],
    /// Reciprocal viscosities of gas and liquid [1/(Pa s)].
    fluidity: [Real; 2],
}

/// Viscosity on a row of faces, and the stress on them per component.
#[derive(Default)]
struct FaceRow {
    mu: Vec<Real>,
    stress: [Vec<Real>; 3],
}

/// What the rows of cells between the faces get: divergence of the stress, and the sum of the face
/// viscosities over squared widths.
#[derive(Default)]
struct Scratch {
    side: FaceRow,
    front: FaceRow,
    back: FaceRow,
    above: FaceRow,
    below: Vec<FaceRow>,
    sum: FaceRow,
}

impl FaceRow {
    fn reserve(&mut self, width: usize) {
        for values in [&mut self.mu].into_iter().chain(&mut self.stress) {
            if values.len() < width {
                values.resize(width, 0.0);
            }
        }
    }
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// A row of cells with the divergence of the stress in it.
struct DivergenceRow<'a> {
    /// Place in memory of the first cell.
    at: usize,
    /// Divergence of the stress per component [N/m^3 for velocities].
    divergence: [&'a [Real]; 3],
    /// Sum over the faces of viscosity over squared width [Pa s/m^2].
    sum: &'a [Real],
}

impl Stress {
    fn new(domain: &Domain, fluids: &Fluids) -> Self {
        let fluidity = [fluids.gas_viscosity, fluids.liquid_viscosity].map(|mu| (1.0 / mu).min(FLUID));
        Self { strides: domain.strides(), per_width: domain.grid().spacing.recip().to_array(), fluidity }
    }

    /// Stress on the `n` lower faces normal to `d` of the cells from `at` on: `mu du_i/dx_d`, and
    /// `mu du_d/dx_i` too if `transposed`.
    fn on_faces(
        &self,
        d: usize,
        at: usize,
        n: usize,
        c: &[Real],
        u: [&[Real]; 3],
        transposed: bool,
        row: &mut FaceRow,
    ) {
        let behind = at - self.strides[d] as usize;
        let (c_l, c_r) = (&c[behind..behind + n], &c[at..at + n]);
        let FaceRow { mu, stress } = row;
        let mu = &mut mu[..n];
        let [gas, liquid] = self.fluidity;
        for i in 0..n {
            let c = 0.5 * (c_l[i] + c_r[i]);
            mu[i] = 1.0 / (gas * (1.0 - c).max(0.0) + liquid * c);
        }
        let across = self.per_width[d];
        for (i, stress) in stress.iter_mut().enumerate() {
            let stress = &mut stress[..n];
            let (u_l, u_r) = (&u[i][behind..behind + n], &u[i][at..at + n]);
            if !transposed || i == d {
                let factor = if transposed { 2.0 * across } else { across };
                for x in 0..n {
                    stress[x] = mu[x] * factor * (u_r[x] - u_l[x]);
                }
            } else {
                let (along, s) = (0.25 * self.per_width[i], self.strides[i] as usize);
                let (l_up, l_down) = (&u[d][behind + s..][..n], &u[d][behind - s..][..n]);
                let (r_up, r_down) = (&u[d][at + s..][..n], &u[d][at - s..][..n]);
                for x in 0..n {
                    let turned = (l_up[x] - l_down[x]) + (r_up[x] - r_down[x]);
                    stress[x] = mu[x] * (across * (u_r[x] - u_l[x]) + along * turned);
                }
            }
        }
    }

    /// Calls `body` for every row of interior cells with the divergence of the stress of `u` in it,
    /// and the row's part of `slices`; one ghost layer of `c` and `u` must be filled.
    fn for_each_row<S: SlicesMut>(
        &self,
        domain: &Domain,
        (c, u): (&[Real], [&[Real]; 3]),
        transposed: bool,
        slices: S,
        body: impl Fn(DivergenceRow<'_>, S) + Sync,
    ) {
        let [n1, n2, n3] = domain.cells();
        let [_, width, plane] = self.strides.map(|s| s as usize);
        let place = |j: usize, k: usize| (k + GHOSTS) * plane + (j + GHOSTS) * width + GHOSTS;
        let on_faces = |d, at, n, row: &mut FaceRow| self.on_faces(d, at, n, c, u, transposed, row);
        let interior = slices.cut(GHOSTS * plane).1.cut(n3 * plane).0;
        for_each_chunk(interior, DEPTH * plane, |number, mut rest| {
            SCRATCH.with_borrow_mut(|scratch| {
                let planes = number * DEPTH..(number * DEPTH + DEPTH).min(n3);
                scratch.reserve(n1 + 1, n2);
                let Scratch { side, front, back, above, below, sum } = scratch;
                let mut reached = (planes.start + GHOSTS) * plane;
                (0..n2).for_each(|j| on_faces(2, place(j, planes.start), n1, &mut below[j]));
                for k in planes {
                    on_faces(1, place(0, k), n1, front);
                    for j in 0..n2 {
                        let at = place(j, k);
                        on_faces(0, at, n1 + 1, side);
                        on_faces(1, place(j + 1, k), n1, back);
                        on_faces(2, place(j, k + 1), n1, above);
                        self.add_up(n1, side, [front, &below[j]], [back, above], sum);
                        std::mem::swap(front, back);
                        std::mem::swap(above, &mut below[j]);
                        let (values, behind) = rest.cut(at - reached).1.cut(n1);
                        (rest, reached) = (behind, at + n1);
                        let divergence = sum.stress.each_ref().map(|values| &values[..n1]);
                        body(DivergenceRow { at, divergence, sum: &sum.mu[..n1] }, values);
                    }
                }
            });
        });
    }

    fn add_up(&self, n: usize, side: &FaceRow, lower: [&FaceRow; 2], upper: [&FaceRow; 2], sum: &mut FaceRow) {
        let [p1, p2, p3] = self.per_width;
        {
            let (s, s_next) = (&side.mu[..n], &side.mu[1..=n]);
            let (l2, u2) = (&lower[0].mu[..n], &upper[0].mu[..n]);
            let (l3, u3) = (&lower[1].mu[..n], &upper[1].mu[..n]);
            for (x, sum) in sum.mu[..n].iter_mut().enumerate() {
                *sum = p1 * p1 * (s[x] + s_next[x]) + p2 * p2 * (l2[x] + u2[x]) + p3 * p3 * (l3[x] + u3[x]);
            }
        }
        for (i, sum) in sum.stress.iter_mut().enumerate() {
            let (s, s_next) = (&side.stress[i][..n], &side.stress[i][1..=n]);
            let (l2, u2) = (&lower[0].stress[i][..n], &upper[0].stress[i][..n]);
            let (l3, u3) = (&lower[1].stress[i][..n], &upper[1].stress[i][..n]);
            for (x, sum) in sum[..n].iter_mut().enumerate() {
                *sum = p1 * (s_next[x] - s[x]) + p2 * (u2[x] - l2[x]) + p3 * (u3[x] - l3[x]);
            }
        }
    }

    /// Force of the stress on the sides of the box on the fluid, this rank's part [N for velocities].
    fn on_sides(&self, domain: &Domain, c: &[Real], u: [&[Real]; 3], transposed: bool) -> Vector {
        let mut force = Vector::ZERO;
        for d in (0..3).filter(|&d| !domain.periodic()[d]) {
            for side in (0..2).filter(|&side| domain.at_box_end(d, side)) {
                let mut range = domain.interior();
                range[d] = if side == 0 { 0..1 } else { range[d].end..range[d].end + 1 };
                let sum = domain.sum_rows(&range, |row| {
                    SCRATCH.with_borrow_mut(|scratch| {
                        scratch.reserve(domain.cells()[0] + 1, 0);
                        self.on_faces(d, row.start, row.len, c, u, transposed, &mut scratch.side);
                        scratch.side.stress.each_ref().map(|stress| stress[..row.len].iter().sum())
                    })
                });
                let outward = if side == 0 { -1.0 } else { 1.0 };
                force += outward * domain.grid().face_area(d) * Vector::from_array(sum);
            }
        }
        force
    }
}

impl Scratch {
    fn reserve(&mut self, width: usize, rows: usize) {
        for row in [&mut self.side, &mut self.front, &mut self.back, &mut self.above, &mut self.sum] {
            row.reserve(width);
        }
        if self.below.len() < rows {
            self.below.resize_with(rows, FaceRow::default);
        }
        self.below.iter_mut().take(rows).for_each(|row| row.reserve(width));
    }
}

/// Bound of the face viscosity over the density of a cell [m^2/s].
///
/// A face has at most the harmonic mean of its cell's viscosity and the larger of the two; over the
/// density this is largest in one of the pure fluids.
fn largest_diffusivity(fluids: &Fluids) -> Real {
    let largest = fluids.gas_viscosity.max(fluids.liquid_viscosity);
    let on_face = |mu: Real| if mu > 0.0 { 2.0 * mu * largest / (mu + largest) } else { 0.0 };
    let gas = on_face(fluids.gas_viscosity) / fluids.gas_density;
    gas.max(on_face(fluids.liquid_viscosity) / fluids.liquid_density)
}

/// Sum of the reciprocals of the squared cell widths [1/m^2].
fn inverse_squares(domain: &Domain) -> Real {
    let spacing = domain.grid().spacing;
    (spacing * spacing).recip().element_sum()
}

/// Number of Chebyshev steps and the spectral bound of Jacobi's iteration they rest on.
fn plan(domain: &Domain, fluids: &Fluids, tolerance: Real, dt: Real) -> (usize, Real) {
    // One percent for fractions a little out of range.
    let stiffness = 2.02 * largest_diffusivity(fluids) * dt * inverse_squares(domain);
    let radius = stiffness / (1.0 + stiffness);
    let rate = radius / (1.0 + (1.0 - radius * radius).sqrt());
    let bound = 4.0 * stiffness * (2.0 * stiffness).min(2.0);
    let steps = if rate > 0.0 { ((tolerance / bound).ln() / rate.ln()).ceil().max(1.0) } else { 1.0 };
    (steps as usize, radius)
}

impl Flow {
    /// Applies the viscous stress for `dt` [s].
    ///
    /// The ghosts of the volume fraction must be filled.
    ///
    /// # Errors
    /// [`ViscosityError`] on all ranks alike.
    pub fn diffuse(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        dt: Real,
    ) -> Result<DiffusionReport, ViscosityError> {
        let dt = match self.schemes.viscosity {
            ViscosityScheme::Implicit | ViscosityScheme::Explicit => dt,
            ViscosityScheme::CrankNicolson => 0.5 * dt,
            ViscosityScheme::Off => {
                self.work[..3].iter_mut().for_each(|field| field.fill(0.0));
                return Ok(DiffusionReport::default());
            }
        };
        let (steps, radius) = plan(domain, &self.fluids, self.viscous_tolerance, dt);
        if steps > MOST_ITERATIONS {
            return Err(ViscosityError::TooStiff { iterations: steps, dt });
        }
        let rules: [GhostRules; 3] = std::array::from_fn(|i| boundary.velocity_rules(i));
        let [u1, u2, u3] = &mut self.velocity;
        domain.fill_halos_to(1, &mut [(u1, &rules[0]), (u2, &rules[1]), (u3, &rules[2])]);
        let stress = Stress::new(domain, &self.fluids);
        let c = self.volume_fraction.data();
        let mut force = stress.on_sides(domain, c, self.velocity.each_ref().map(Field::data), true);
        let iterations = if self.schemes.viscosity == ViscosityScheme::Explicit {
            self.diffuse_explicitly(domain, &stress, dt);
            1
        } else {
            let step = Step { stress, dt, steps, radius };
            force += self.diffuse_implicitly(domain, boundary, &step);
            steps + 1
        };
        force += std::mem::take(&mut self.force_before);
        let wall_impulse = dt * Vector::from_array(domain.sum(force.to_array()));
        if wall_impulse.is_finite() {
            Ok(DiffusionReport { iterations, wall_impulse })
        } else {
            Err(ViscosityError::NotFinite)
        }
    }

    /// The explicit half step of Crank-Nicolson.
    pub(crate) fn diffuse_before(&mut self, domain: &Domain, boundary: &Boundary, dt: Real) {
        let stress = Stress::new(domain, &self.fluids);
        self.fill_halos(domain, boundary);
        let velocity = self.velocity.each_ref().map(Field::data);
        self.force_before = stress.on_sides(domain, self.volume_fraction.data(), velocity, true);
        self.diffuse_explicitly(domain, &stress, dt);
    }

    /// Reciprocal of the longest stable step of the viscous stress [1/s]; zero unless it is explicit.
    #[must_use]
    pub fn viscous_rate(&self, domain: &Domain) -> Real {
        if self.schemes.viscosity == ViscosityScheme::Explicit {
            largest_diffusivity(&self.fluids) * 2.0 * inverse_squares(domain)
        } else {
            0.0
        }
    }

    /// Divergence of the viscous stress over the density in the cell at place `at`, as applied by
    /// the last [`Self::diffuse`] over `dt` [m/s^2]. Lost at the next transport. With
    /// Crank-Nicolson that of the half step after the transport.
    #[inline]
    #[must_use]
    pub fn viscous_acceleration(&self, at: usize, dt: Real) -> Vector {
        let dt = if self.schemes.viscosity == ViscosityScheme::CrankNicolson { 0.5 * dt } else { dt };
        Vector::new(self.work[0].data()[at], self.work[1].data()[at], self.work[2].data()[at]) / dt
    }

    fn diffuse_explicitly(&mut self, domain: &Domain, stress: &Stress, dt: Real) {
        let Self { volume_fraction, velocity, work: [w1, w2, w3, ..], fluids, .. } = self;
        let c = volume_fraction.data();
        let source = (c, velocity.each_ref().map(Field::data));
        let change = (w1.data_mut(), w2.data_mut(), w3.data_mut());
        stress.for_each_row(domain, source, true, change, |row, (w1, w2, w3)| {
            let c = &c[row.at..][..w1.len()];
            for (w, divergence) in [w1, w2, w3].into_iter().zip(row.divergence) {
                for (x, w) in w.iter_mut().enumerate() {
                    *w = dt / fluids.density(c[x]) * divergence[x];
                }
            }
        });
        for (u, w) in velocity.iter_mut().zip([w1, w2, w3]) {
            domain.for_each_row(&domain.interior(), u.data_mut(), |row, u| {
                u.iter_mut().zip(&w.data()[row.shifted(0)]).for_each(|(u, w)| *u += w);
            });
        }
    }

    /// Returns the force on the sides of the box that the implicit part adds.
    fn diffuse_implicitly(&mut self, domain: &Domain, boundary: &Boundary, step: &Step) -> Vector {
        let Self { volume_fraction, velocity, work, fluids, .. } = self;
        let c = volume_fraction.data();
        let rules: [GhostRules; 3] = std::array::from_fn(|i| boundary.velocity_change_rules(i));
        let [b1, b2, b3, x1, x2, x3, y1, y2, y3] = work;
        let mut b = [b1, b2, b3];
        let mut x = [x1, x2, x3];
        let mut y = [y1, y2, y3];
        step.start(
            domain,
            fluids,
            (c, velocity.each_ref().map(Field::data)),
            b.each_mut().map(|f| &mut **f),
            x.each_mut().map(|f| &mut **f),
        );
        let mut omega = 1.0;
        for number in 1..step.steps {
            fill(domain, &rules, &mut x);
            omega = if number == 1 { 2.0 } else { omega };
            omega = 1.0 / (1.0 - 0.25 * step.radius * step.radius * omega);
            let known = b.each_ref().map(|f| f.data());
            step.advance(
                domain,
                fluids,
                c,
                known,
                x.each_ref().map(|f| f.data()),
                y.each_mut().map(|f| &mut **f),
                (number > 1, omega),
            );
            std::mem::swap(&mut x, &mut y);
        }
        fill(domain, &rules, &mut x);
        let solution = x.each_ref().map(|f| f.data());
        step.finish(domain, fluids, (c, solution), b, velocity.each_mut());
        step.stress.on_sides(domain, c, solution, false)
    }
}

fn fill(domain: &Domain, rules: &[GhostRules; 3], x: &mut [&mut Field<Real>; 3]) {
    let [x1, x2, x3] = x;
    domain.fill_halos_to(1, &mut [(x1, &rules[0]), (x2, &rules[1]), (x3, &rules[2])]);
}

/// An implicit step.
struct Step {
    stress: Stress,
    dt: Real,
    steps: usize,
    radius: Real,
}

type Three<'a> = [&'a mut Field<Real>; 3];

impl Step {
    /// Sets `b` to the divergence of the stress of the velocity, `x` to the first iterate.
    fn start(&self, domain: &Domain, fluids: &Fluids, (c, u): (&[Real], [&[Real]; 3]), b: Three<'_>, x: Three<'_>) {
        let [b1, b2, b3] = b.map(Field::data_mut);
        let [x1, x2, x3] = x.map(Field::data_mut);
        let targets = ((b1, x1), (b2, x2), (b3, x3));
        self.stress.for_each_row(domain, (c, u), true, targets, |row, (first, second, third)| {
            let n = first.0.len();
            let c = &c[row.at..row.at + n];
            for ((b, x), divergence) in [first, second, third].into_iter().zip(row.divergence) {
                let (b, x, divergence, sum) = (&mut b[..n], &mut x[..n], &divergence[..n], &row.sum[..n]);
                for i in 0..n {
                    b[i] = divergence[i];
                    x[i] = divergence[i] / (fluids.density(c[i]) / self.dt + sum[i]);
                }
            }
        });
    }

    /// Replaces the iterate before the last, `y`, by the next after `x`; `y` counts as zero unless
    /// `known`.
    fn advance(
        &self,
        domain: &Domain,
        fluids: &Fluids,
        c: &[Real],
        b: [&[Real]; 3],
        x: [&[Real]; 3],
        y: Three<'_>,
        (known, omega): (bool, Real),
    ) {
        let [y1, y2, y3] = y.map(Field::data_mut);
        self.stress.for_each_row(domain, (c, x), false, (y1, y2, y3), |row, (y1, y2, y3)| {
            let n = y1.len();
            let cells = row.at..row.at + n;
            let c = &c[cells.clone()];
            for (d, y) in [y1, y2, y3].into_iter().enumerate() {
                let (b, x) = (&b[d][cells.clone()], &x[d][cells.clone()]);
                let (y, divergence, sum) = (&mut y[..n], &row.divergence[d][..n], &row.sum[..n]);
                for i in 0..n {
                    let inertia = fluids.density(c[i]) / self.dt;
                    let residual = b[i] + divergence[i] - inertia * x[i];
                    let before = if known { y[i] } else { 0.0 };
                    y[i] = before + omega * (x[i] - before + residual / (inertia + sum[i]));
                }
            }
        });
    }

    /// Adds the change of the velocity that the stress of `x` and `b` makes, and leaves it in `b`.
    fn finish(&self, domain: &Domain, fluids: &Fluids, (c, x): (&[Real], [&[Real]; 3]), b: Three<'_>, u: Three<'_>) {
        let [b1, b2, b3] = b.map(Field::data_mut);
        let [u1, u2, u3] = u.map(Field::data_mut);
        let targets = ((b1, u1), (b2, u2), (b3, u3));
        self.stress.for_each_row(domain, (c, x), false, targets, |row, (first, second, third)| {
            let n = first.0.len();
            let c = &c[row.at..row.at + n];
            for ((b, u), divergence) in [first, second, third].into_iter().zip(row.divergence) {
                let (b, u, divergence) = (&mut b[..n], &mut u[..n], &divergence[..n]);
                for i in 0..n {
                    b[i] = self.dt / fluids.density(c[i]) * (b[i] + divergence[i]);
                    u[i] += b[i];
                }
            }
        });
    }
}
