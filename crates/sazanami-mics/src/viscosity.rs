//! Viscous stress: implicit in the gradient of each component, explicit in the transposed gradient.
//!
//! The change w of the velocity over a step obeys, per component,
//!
//! ```text
//! (rho / dt) w_i - div(mu grad w_i) = div(mu (grad u + grad u^T))_i
//! ```
//!
//! with a viscosity of the faces that resists between the centres as the fluids between them do (`stress.rs`). It is solved by Chebyshev
//! steps on Jacobi's iteration, whose number follows from the bound of the spectrum beforehand: no
//! scalar products, hence the same bits on any number of ranks. A last step evaluates the stress of
//! `u + w` on the faces, so that momentum changes at walls only, however well w has converged.
//!
//! On faces that see both fluids the implicit part has up to twice the viscosity (`reserve`): there the transposed gradient makes the stress more
//! than twice that of the gradients alone, which no step beyond a certain length would bear. What w is too small by is of first order in the
//! step, as the rest of a backward Euler step.
//!
//! In steps so short that it errs no more, [`ViscosityScheme::Auto`] takes the stress of `u` alone instead.
//!
//! On the surfaces of grains a friction `sigma (u_s - u - w)` joins the stress ([`crate::grains`]): sigma on the
//! diagonal, and in the last step a whole Jacobi step in these cells. What the friction then takes is the rest that
//! the change of the momentum leaves, so that fluid and grains together lose nothing. After an explicit stress it acts
//! implicitly by itself.

mod stress;

use sazanami_numerics::domain::{Domain, Ghost, GhostRules};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

use crate::boundary::Boundary;
use crate::flow::Flow;
use crate::fluids::Fluids;
use crate::grains::{Surface, resistance};
use crate::mobility::RowSet;
use crate::schemes::Transposed;
use crate::stability::INTERFACE_VISCOSITY;
use stress::{Source, Stress};

pub use crate::diffusion::{DiffusionReport, ViscosityError};
pub use crate::schemes::ViscosityScheme;

const MAX_ITERATIONS: usize = 4000;
/// Bound of the face viscosity over the density of a cell [m^2/s].
///
/// A face has at most the harmonic mean `2 mu M/(mu + M)` of its cell's viscosity and the larger of the two, `M`. Over the density of the
/// cell, with viscosity and density linear in the liquid fraction, this is largest in one of the pure fluids or where `mu^2 = M (s rho_g - mu_g)`, with
/// `s` the slope of the viscosity over that of the density. Of mixtures with liquid fractions from `low` to `high`.
fn largest_diffusivity(fluids: &Fluids, [low, high]: [Real; 2]) -> Real {
    let [gas, liquid] = fluids.viscosities();
    let largest = fluids.viscosity(low).max(fluids.viscosity(high));
    let at = |c: Real| {
        let mu = fluids.viscosity(c);
        2.0 * mu * largest / ((mu + largest) * fluids.density(c))
    };
    let [light, slope] = fluids.density_line();
    let square = largest * ((liquid - gas) / slope * light - gas);
    // Not a number for equal densities or viscosities, whose largest value is at an end.
    let between = (square.max(0.0).sqrt() - gas) / (liquid - gas);
    [low, high].into_iter().chain((between > low && between < high).then_some(between)).map(at).fold(0.0, Real::max)
}

/// Sum of the reciprocals of the squared cell widths [1/m^2].
fn inverse_squares(spacing: Vector) -> Real {
    (spacing * spacing).recip().element_sum()
}

/// Reciprocal of the longest stable step of explicit viscosity on cells of this `spacing` \[m] [1/s].
#[must_use]
pub fn explicit_rate(fluids: &Fluids, spacing: Vector) -> Real {
    largest_diffusivity(fluids, ANY) * 2.0 * inverse_squares(spacing)
}

/// The same of the fluid of the larger viscosity [1/s].
#[must_use]
pub fn explicit_rate_of_thicker(fluids: &Fluids, spacing: Vector) -> Real {
    let [gas, liquid] = fluids.viscosities();
    fluids.kinematic_viscosity(if liquid >= gas { 1.0 } else { 0.0 }) * 2.0 * inverse_squares(spacing)
}

/// The same of the liquid alone [1/s].
#[must_use]
pub fn explicit_rate_of_liquid(fluids: &Fluids, spacing: Vector) -> Real {
    fluids.kinematic_viscosity(1.0) * 2.0 * inverse_squares(spacing)
}

/// Stiffness up to which [`ViscosityScheme::Auto`] is explicit. The fastest mode of the grid decays by the rate of twice
/// the stiffness `s` a step; the explicit Euler step then errs by `-2 s^2` of it, the backward one by `2 s^2`, and the
/// explicit one is stable to `s = 1`.
const SOFT: Real = 0.1;

/// Liquid fractions of any mixture.
const ANY: [Real; 2] = [0.0, 1.0];

/// Smallest and largest liquid fraction, those beyond open sides included.
fn fractions(domain: &Domain, boundary: &Boundary, fraction: &Field<Real>) -> [Real; 2] {
    if boundary.volume_fraction_rules().sides.as_flattened().iter().any(|ghost| *ghost != Ghost::Even) {
        return ANY;
    }
    fractions_within(domain, fraction)
}

/// Smallest and largest liquid fraction of the cells.
fn fractions_within(domain: &Domain, fraction: &Field<Real>) -> [Real; 2] {
    let (c, range) = (fraction.data(), domain.interior());
    let [low, high] = [-1.0, 1.0].map(|sign| {
        let of_row =
            |row: sazanami_numerics::domain::Row| c[row.shifted(0)].iter().map(|c| sign * c).fold(Real::MIN, Real::max);
        domain.max(domain.max_rows(&range, of_row)).clamp(-1.0, 1.0)
    });
    [-low, high]
}

/// Twice the largest viscosity of the mixtures with these `fractions` times the step over the squared cell widths.
fn stiffness(domain: &Domain, fluids: &Fluids, fractions: [Real; 2], dt: Real) -> Real {
    // One percent in reserve for fractions slightly out of range.
    2.02 * largest_diffusivity(fluids, fractions) * dt * inverse_squares(domain.grid().spacing)
}

/// Stiffness from which on the implicit part of the stress is held in reserve where both fluids meet, and from which on by [`RESERVE`]. Without, drops of
/// 1e-3 m^2/s in air stay at rest up to 9, and are torn by growing waves from 20 on.
const STIFF: [Real; 2] = [4.0, 8.0];
/// Largest factor of the viscosity of their faces.
const RESERVE: Real = 2.0;

/// Fraction of a fluid in a cell that is a trace of it.
const TRACE: Real = 1e-6;

/// Whether the viscosities of the fluids differ.
pub fn are_unlike(fluids: &Fluids) -> bool {
    let [gas, liquid] = fluids.viscosities();
    (liquid - gas).abs() > TRACE * liquid.max(gas)
}

/// Whether these smallest and largest liquid fractions are those of a liquid and a gas.
fn are_both([low, high]: [Real; 2]) -> bool {
    low < 1.0 - TRACE && high > TRACE && high - low > TRACE
}

/// Factor of the viscosity in the implicit part of the stress on faces that see both fluids, for a stiffness of the fluid of the larger viscosity and
/// the `fractions` that there are; 1 of fluids that are equally viscous.
fn reserve(fluids: &Fluids, stiffness: Real, fractions: [Real; 2]) -> Real {
    let part = ((stiffness - STIFF[0]) / (STIFF[1] - STIFF[0])).clamp(0.0, 1.0);
    if are_both(fractions) && are_unlike(fluids) { 1.0 + (RESERVE - 1.0) * part } else { 1.0 }
}

/// Number of Chebyshev steps and the spectral bound of Jacobi's iteration they rest on.
fn plan(stiffness: Real, tolerance: Real) -> (usize, Real) {
    let radius = stiffness / (1.0 + stiffness);
    let rate = radius / (1.0 + (1.0 - radius * radius).sqrt());
    let bound = 4.0 * stiffness * (2.0 * stiffness).min(2.0);
    let steps = if rate > 0.0 { ((tolerance / bound).ln() / rate.ln()).ceil().max(1.0) } else { 1.0 };
    (steps as usize, radius)
}

impl Flow {
    /// Applies the viscous stress for `dt` \[s].
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
        self.diffuse_beside(domain, boundary, dt, None)
    }

    /// Applies the viscous stress and the friction on the surfaces of grains for `dt` \[s].
    pub(crate) fn diffuse_beside(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        dt: Real,
        surface: Option<&mut Surface>,
    ) -> Result<DiffusionReport, ViscosityError> {
        let report = self.diffuse_against(domain, boundary, dt, surface.as_deref())?;
        if let Some(surface) = surface.filter(|_| self.schemes.viscosity != ViscosityScheme::Off) {
            let [b1, b2, b3, ..] = &self.work;
            surface.add_taken(domain, [b1, b2, b3]);
        }
        Ok(report)
    }

    /// The same; what the friction took from the fluid, per volume, is then in the first three scratch fields
    /// in the rows that may have friction [N s/m^3].
    pub(crate) fn diffuse_against(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        dt: Real,
        surface: Option<&Surface>,
    ) -> Result<DiffusionReport, ViscosityError> {
        let whole = dt;
        let dt = match self.schemes.viscosity {
            ViscosityScheme::Auto | ViscosityScheme::Implicit | ViscosityScheme::Explicit => dt,
            ViscosityScheme::CrankNicolson => 0.5 * dt,
            ViscosityScheme::Off => return Ok(DiffusionReport::default()),
        };
        let is_explicit = !self.diffuses_implicitly(domain, whole);
        let (steps, radius, reserve) = if is_explicit {
            (1, 0.0, 1.0)
        } else {
            let present = fractions(domain, boundary, &self.volume_fraction);
            let stiffness = stiffness(domain, &self.fluids, present, dt);
            let of_thicker = explicit_rate_of_thicker(&self.fluids, domain.grid().spacing) * dt;
            let reserve = reserve(&self.fluids, of_thicker, present);
            let (steps, radius) = plan(reserve * stiffness, self.viscous_tolerance);
            (steps, radius, reserve)
        };
        if steps > MAX_ITERATIONS {
            return Err(ViscosityError::TooStiff { iterations: steps, dt });
        }
        let rules: [GhostRules; 3] = std::array::from_fn(|i| boundary.velocity_rules(i));
        let [u1, u2, u3] = &mut self.velocity;
        domain.fill_halos_to(1, &mut [(u1, &rules[0]), (u2, &rules[1]), (u3, &rules[2])]);
        let stress = Stress::new(domain, &self.fluids);
        let mut force = stress.on_sides(domain, self.moving());
        let iterations = if is_explicit {
            self.diffuse_explicitly(domain, &stress, dt);
            if let Some(surface) = surface {
                self.rub(domain, surface, dt);
            }
            1
        } else {
            let friction = surface.map(|surface| SurfaceFriction::new(surface, &self.fluids, dt, whole));
            let step = ViscousStep { stress, dt, steps, radius, reserve, friction };
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

    /// Whether the stress in the viscous step over `dt` \[s] is implicit.
    pub(crate) fn diffuses_implicitly(&self, domain: &Domain, dt: Real) -> bool {
        match self.schemes.viscosity {
            ViscosityScheme::Auto => stiffness(domain, &self.fluids, ANY, dt) > SOFT,
            ViscosityScheme::Implicit | ViscosityScheme::CrankNicolson => true,
            ViscosityScheme::Explicit | ViscosityScheme::Off => false,
        }
    }

    /// The velocity, with the transposed gradient.
    fn moving(&self) -> Source<'_> {
        let u = self.velocity.each_ref().map(Field::data);
        Source { c: self.volume_fraction.data(), u, transposed: self.transposed, reserve: 1.0 }
    }

    /// The explicit half step of Crank-Nicolson.
    pub(crate) fn diffuse_before(&mut self, domain: &Domain, boundary: &Boundary, dt: Real) {
        let stress = Stress::new(domain, &self.fluids);
        self.fill_halos(domain, boundary);
        self.force_before = stress.on_sides(domain, self.moving());
        self.diffuse_explicitly(domain, &stress, dt);
    }

    /// Reciprocal of the longest stable step of the viscous stress [1/s]; zero unless it is explicit.
    #[must_use]
    pub fn viscous_rate(&self, domain: &Domain) -> Real {
        if self.schemes.viscosity == ViscosityScheme::Explicit {
            explicit_rate(&self.fluids, domain.grid().spacing)
        } else {
            0.0
        }
    }

    /// See [`crate::stability::Rates::interface_viscosity`]; zero too where it allows steps of `longest` \[s].
    pub(crate) fn interface_rate(&self, domain: &Domain, longest: Real) -> Real {
        let rate = explicit_rate_of_thicker(&self.fluids, domain.grid().spacing);
        let is_implicit = !matches!(self.schemes.viscosity, ViscosityScheme::Off | ViscosityScheme::Explicit);
        let matters = is_implicit && are_unlike(&self.fluids) && rate * longest > INTERFACE_VISCOSITY;
        if matters && are_both(fractions_within(domain, &self.volume_fraction)) { rate } else { 0.0 }
    }

    /// Divergence of the viscous stress over the density in the cell at place `at`, as applied by
    /// the last [`Self::diffuse`] over `dt` [m/s^2]. Lost at the next transport. With
    /// Crank-Nicolson that of the half step after the transport.
    #[inline]
    #[must_use]
    pub fn viscous_acceleration(&self, at: usize, dt: Real) -> Vector {
        let dt = match self.schemes.viscosity {
            ViscosityScheme::Auto | ViscosityScheme::Implicit | ViscosityScheme::Explicit => dt,
            ViscosityScheme::CrankNicolson => 0.5 * dt,
            ViscosityScheme::Off => return Vector::ZERO,
        };
        Vector::new(self.work[0].data()[at], self.work[1].data()[at], self.work[2].data()[at]) / dt
    }

    fn diffuse_explicitly(&mut self, domain: &Domain, stress: &Stress, dt: Real) {
        let Self { volume_fraction, velocity, work: [w1, w2, w3, ..], fluids, transposed, .. } = self;
        let c = volume_fraction.data();
        let u = velocity.each_ref().map(Field::data);
        let source = Source { c, u, transposed: *transposed, reserve: 1.0 };
        let change = (w1.data_mut(), w2.data_mut(), w3.data_mut());
        stress.for_each_row(domain, source, change, |row, (w1, w2, w3)| {
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

    /// Friction alone, implicit, for `dt` \[s].
    fn rub(&mut self, domain: &Domain, surface: &Surface, dt: Real) {
        let Self { volume_fraction, velocity: [u1, u2, u3], fluids, work: [t1, t2, t3, ..], .. } = self;
        let (c, friction) = (volume_fraction.data(), SurfaceFriction::new(surface, fluids, dt, dt));
        let targets = ((u1.data_mut(), t1.data_mut()), (u2.data_mut(), t2.data_mut()), (u3.data_mut(), t3.data_mut()));
        domain.for_each_row(&domain.interior(), targets, |row, (first, second, third)| {
            if !friction.is_in_row(row.j, row.k) {
                return;
            }
            let mut targets = [first, second, third];
            for (i, at) in row.shifted(0).enumerate() {
                let rho = fluids.density(c[at]);
                let rubbed = friction.resistance(at, c[at]) * (dt / rho);
                let part = rubbed / (1.0 + rubbed);
                for ((u, taken), surface) in targets.iter_mut().zip(friction.surface) {
                    let change = part * (surface[at] - u[i]);
                    u[i] += change;
                    taken[i] = -rho * change;
                }
            }
        });
    }

    /// Returns the force on the sides of the box that the implicit part adds.
    fn diffuse_implicitly(&mut self, domain: &Domain, boundary: &Boundary, step: &ViscousStep<'_>) -> Vector {
        let Self { volume_fraction, velocity, work, fluids, transposed, .. } = self;
        let c = volume_fraction.data();
        let rules: [GhostRules; 3] = std::array::from_fn(|i| boundary.velocity_change_rules(i));
        let [b1, b2, b3, x1, x2, x3, y1, y2, y3] = work;
        let mut b = [b1, b2, b3];
        let (mut x, mut y) = ([x1, x2, x3], [y1, y2, y3]);
        let reserve = step.reserve;
        let moving = Source { c, u: velocity.each_ref().map(Field::data), transposed: *transposed, reserve };
        step.start(domain, fluids, moving, b.each_mut().map(|f| f.data_mut()), x.each_mut().map(|f| f.data_mut()));
        let mut omega = None;
        for _ in 1..step.steps {
            fill(domain, &rules, &mut x);
            // Chebyshev: the factor starts at 1 / (1 - r^2 / 2).
            let next = 1.0 / (1.0 - 0.25 * step.radius * step.radius * omega.unwrap_or(2.0));
            let change = Source { c, u: x.each_ref().map(|f| f.data()), transposed: Transposed::Left, reserve };
            let known = b.each_ref().map(|f| f.data());
            step.advance(domain, fluids, change, known, y.each_mut().map(|f| f.data_mut()), (omega.is_some(), next));
            omega = Some(next);
            std::mem::swap(&mut x, &mut y);
        }
        fill(domain, &rules, &mut x);
        let change = Source { c, u: x.each_ref().map(|f| f.data()), transposed: Transposed::Left, reserve };
        step.finish(
            domain,
            fluids,
            change,
            b.each_mut().map(|f| f.data_mut()),
            velocity.each_mut().map(Field::data_mut),
        );
        step.stress.on_sides(domain, change)
    }
}

fn fill(domain: &Domain, rules: &[GhostRules; 3], x: &mut [&mut Field<Real>; 3]) {
    let [x1, x2, x3] = x;
    domain.fill_halos_to(1, &mut [(x1, &rules[0]), (x2, &rules[1]), (x3, &rules[2])]);
}

/// Friction on the surfaces of grains, as the viscous equation needs it.
#[derive(Clone, Copy)]
struct SurfaceFriction<'a> {
    /// Friction over the viscosity [1/m^2], infinite in cells that move with their grains.
    friction: &'a [Real],
    /// Velocity of the surface [m/s].
    surface: [&'a [Real]; 3],
    rows: &'a RowSet,
    fluids: Fluids,
    dt: Real,
    /// Length of the step over the part of it that the equation is solved for.
    parts: Real,
}

impl<'a> SurfaceFriction<'a> {
    /// Friction that acts over `whole` \[s] in an equation over `dt` \[s].
    fn new(surface: &'a Surface, fluids: &Fluids, dt: Real, whole: Real) -> Self {
        let (friction, surface, rows) = surface.parts();
        Self { friction, surface, rows, fluids: *fluids, dt, parts: whole / dt }
    }

    fn is_in_row(&self, j: isize, k: isize) -> bool {
        self.rows.holds(j, k)
    }

    /// Resistance in the cell at place `at` with the liquid fraction `c` [kg/(m^3 s)].
    #[inline]
    fn resistance(&self, at: usize, c: Real) -> Real {
        let friction = self.friction[at];
        if friction == 0.0 {
            return 0.0;
        }
        resistance(friction, self.parts * self.fluids.viscosity(c), self.fluids.density(c), self.dt)
    }
}

/// A backward Euler step of the viscous stress and its solution by Chebyshev iteration.
struct ViscousStep<'a> {
    stress: Stress,
    dt: Real,
    steps: usize,
    radius: Real,
    /// See [`Source::reserve`].
    reserve: Real,
    friction: Option<SurfaceFriction<'a>>,
}

type Three<'a> = [&'a mut [Real]; 3];

impl ViscousStep<'_> {
    /// The friction, if there is any in this row.
    fn friction_in(&self, (j, k): (isize, isize)) -> Option<SurfaceFriction<'_>> {
        self.friction.filter(|friction| friction.is_in_row(j, k))
    }

    /// Sets `b` to the divergence of the stress of the velocity, `x` to the first iterate.
    fn start(&self, domain: &Domain, fluids: &Fluids, moving: Source<'_>, [b1, b2, b3]: Three<'_>, x: Three<'_>) {
        let [x1, x2, x3] = x;
        let targets = ((b1, x1), (b2, x2), (b3, x3));
        self.stress.for_each_row(domain, moving, targets, |row, (first, second, third)| {
            let n = first.0.len();
            let c = &moving.c[row.at..row.at + n];
            let friction = self.friction_in(row.index);
            for (d, ((b, x), divergence)) in [first, second, third].into_iter().zip(row.divergence).enumerate() {
                let (b, x, divergence, sum) = (&mut b[..n], &mut x[..n], &divergence[..n], &row.sum[..n]);
                if let Some(friction) = friction {
                    for i in 0..n {
                        let at = row.at + i;
                        let resistance = friction.resistance(at, c[i]);
                        b[i] = divergence[i] + resistance * (friction.surface[d][at] - moving.u[d][at]);
                        x[i] = b[i] / (fluids.density(c[i]) / self.dt + resistance + sum[i]);
                    }
                    continue;
                }
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
        x: Source<'_>,
        b: [&[Real]; 3],
        [y1, y2, y3]: Three<'_>,
        (known, omega): (bool, Real),
    ) {
        self.stress.for_each_row(domain, x, (y1, y2, y3), |row, (y1, y2, y3)| {
            let n = y1.len();
            let cells = row.at..row.at + n;
            let c = &x.c[cells.clone()];
            let friction = self.friction_in(row.index);
            for (d, y) in [y1, y2, y3].into_iter().enumerate() {
                let (b, x) = (&b[d][cells.clone()], &x.u[d][cells.clone()]);
                let (y, divergence, sum) = (&mut y[..n], &row.divergence[d][..n], &row.sum[..n]);
                if let Some(friction) = friction {
                    for i in 0..n {
                        let inertia = fluids.density(c[i]) / self.dt + friction.resistance(row.at + i, c[i]);
                        let residual = b[i] + divergence[i] - inertia * x[i];
                        let before = if known { y[i] } else { 0.0 };
                        y[i] = before + omega * (x[i] - before + residual / (inertia + sum[i]));
                    }
                    continue;
                }
                for i in 0..n {
                    let inertia = fluids.density(c[i]) / self.dt;
                    let residual = b[i] + divergence[i] - inertia * x[i];
                    let before = if known { y[i] } else { 0.0 };
                    y[i] = before + omega * (x[i] - before + residual / (inertia + sum[i]));
                }
            }
        });
    }

    /// Adds the change of the velocity that the stress of `x` and `b` makes, and leaves it in `b`; in rows with friction
    /// leaves the momentum per volume that this takes [N s/m^3].
    fn finish(&self, domain: &Domain, fluids: &Fluids, x: Source<'_>, [b1, b2, b3]: Three<'_>, u: Three<'_>) {
        let [u1, u2, u3] = u;
        let targets = ((b1, u1), (b2, u2), (b3, u3));
        self.stress.for_each_row(domain, x, targets, |row, (first, second, third)| {
            let n = first.0.len();
            let c = &x.c[row.at..row.at + n];
            let friction = self.friction_in(row.index);
            for (d, ((b, u), divergence)) in [first, second, third].into_iter().zip(row.divergence).enumerate() {
                let (b, u, divergence) = (&mut b[..n], &mut u[..n], &divergence[..n]);
                if let Some(friction) = friction {
                    for i in 0..n {
                        let (at, rho) = (row.at + i, fluids.density(c[i]));
                        let resistance = friction.resistance(at, c[i]);
                        let slip = resistance * (friction.surface[d][at] - u[i]);
                        let gained = self.dt * (b[i] - slip + divergence[i]);
                        let change = if resistance > 0.0 {
                            let force = b[i] + divergence[i] + row.sum[i] * x.u[d][at];
                            force / (rho / self.dt + resistance + row.sum[i])
                        } else {
                            gained / rho
                        };
                        u[i] += change;
                        b[i] = if resistance > 0.0 { gained - rho * change } else { 0.0 };
                    }
                    continue;
                }
                for i in 0..n {
                    b[i] = self.dt / fluids.density(c[i]) * (b[i] + divergence[i]);
                    u[i] += b[i];
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reserve_and_the_limit_of_interfaces_are_for_two_fluids_of_which_one_is_thick() {
        let glycerine = Fluids { liquid_density: 1260.0, gas_density: 1.0, liquid_viscosity: 1.4, gas_viscosity: 1e-5 };
        assert_eq!([0.0, 4.0, 6.0, 8.0, 80.0].map(|s| reserve(&glycerine, s, ANY)), [1.0, 1.0, 1.5, 2.0, 2.0]);
        // Of one fluid, traces of the other in it, and of two that are equally viscous nothing is held in reserve.
        for one in [[0.0, 0.0], [1.0, 1.0], [1.0 - 1e-12, 1.0], [0.0, 1e-12]] {
            assert_eq!(reserve(&glycerine, 80.0, one), 1.0);
        }
        let alike = Fluids { gas_viscosity: 1.4, ..glycerine };
        assert!(reserve(&alike, 80.0, ANY) == 1.0 && !are_unlike(&alike) && are_unlike(&glycerine));
        let spacing = Vector::splat(1e-4);
        let rate = 1.4 / 1260.0 * 6.0 / 1e-8;
        assert!((explicit_rate_of_thicker(&glycerine, spacing) / rate - 1.0).abs() < 1e-12);
        let inverted = Fluids { liquid_viscosity: 1e-5, gas_viscosity: 1.4, ..glycerine };
        assert!((explicit_rate_of_thicker(&inverted, spacing) / (1260.0 * rate) - 1.0).abs() < 1e-12);
    }
}
