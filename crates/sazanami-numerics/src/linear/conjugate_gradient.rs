//! Conjugate gradients preconditioned by multigrid, in mixed precision.
//!
//! Directions, steps and the recursive residual are in single precision on chequerboard storage;
//! the solution and its residual, which alone decides about convergence, in double precision. When
//! the recursive residual promises convergence, or has fallen so far that single precision shows,
//! the steps are added to the solution and the recursion goes on from the true residual
//! (van der Vorst & Ye, SIAM J. Sci. Comput. 22 (2000) 835; Clark et al., Comput. Phys. Commun. 181
//! (2010) 1517). The direction is made conjugate to the one before by Polak and Ribière's formula,
//! which forgives a preconditioner that is symmetric only up to rounding.
//!
//! An iteration passes over the finest level twice: once to finish a cycle and take all scalar
//! products, once for the new direction, the step, the residual and the first half of the next
//! cycle. The curvature `p A p` of the new direction follows from sums known before it is formed.

use super::equation::Equation;
use super::iteration::{Control, Progress, SolveError, System, iterate};
use super::multigrid::{Colours, Direction, DirectionStep, Multigrid, Residual};
use crate::Real;
use crate::domain::Domain;
use crate::grid::Field;

/// When a solution is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// The largest residual of a cell is at most this, in units of the equation.
    Largest(Real),
    /// The 2-norm of the residual is at most this times that of the initial guess.
    Relative(Real),
}

/// Outcome of a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solution {
    /// Number of iterations.
    pub iterations: usize,
    /// Largest residual of a cell, evaluated from the solution.
    pub largest: Real,
    /// 2-norm of the residual over that of the initial guess, evaluated from the solution.
    pub relative: Real,
    /// Evaluations of the residual in double precision.
    pub evaluations: usize,
}

/// Fall of the recursive residual, in single precision, after which it is replaced by the true one.
const TRUSTED: Real = 1e-4;
/// The recursive residual must be this part of the tolerance before the true one is evaluated.
const MARGIN: Real = 0.9;

/// Solver for equations on one grid; holds all storage.
pub struct ConjugateGradient {
    multigrid: Multigrid,
    direction: Direction,
    previous: Colours,
    sums: Vec<[f64; 4]>,
}

/// An equation being solved.
struct Solve<'a, E> {
    solver: &'a mut ConjugateGradient,
    domain: &'a Domain,
    equation: &'a E,
    p: &'a mut Field<Real>,
    /// Factor on the equation that brings its residual near one.
    scale: Real,
    stop: Stop,
    /// True residual when it was last evaluated.
    residual: Residual,
    /// Length and curvature of the last step.
    last: Option<(Real, Real)>,
    /// Whether the first half of the next cycle is done.
    descended: bool,
    /// Whether no step was taken since the last evaluation.
    fresh: bool,
}

impl Stop {
    fn measure(self, residual: &Residual) -> Real {
        match self {
            Self::Largest(_) => residual.largest,
            Self::Relative(_) => residual.norm,
        }
    }
}

impl<E: Equation> System for Solve<'_, E> {
    fn evaluate(&mut self) -> Real {
        let Self { solver, domain, equation, p, scale, .. } = self;
        solver.add_steps(domain, *equation, p, *scale, self.residual.mean);
        self.residual = solver.evaluate(domain, *equation, p, *scale, true);
        (self.descended, self.fresh) = (false, true);
        self.stop.measure(&self.residual)
    }

    fn advance(&mut self, last: bool) -> Result<Real, Real> {
        if !self.descended {
            self.solver.multigrid.descend();
        }
        let step = self.solver.next_step(self.domain, self.equation.is_singular(), &mut self.last)?;
        let step = DirectionStep { keep: !self.fresh, ..step };
        let residual = self.solver.advance(self.domain, step, !last, self.scale);
        (self.descended, self.fresh) = (!last, false);
        Ok(self.stop.measure(&residual))
    }
}

impl ConjugateGradient {
    /// Storage for the grid of `domain`.
    #[must_use]
    pub fn new(domain: &Domain) -> Self {
        let multigrid = Multigrid::new(domain);
        let board = *multigrid.board();
        Self {
            direction: Direction::new(&multigrid, domain),
            multigrid,
            previous: board.zeros(),
            sums: vec![[0.0; 4]; board.cells[2]],
        }
    }

    /// Solves `equation` for `p`, which holds the initial guess; its first ghost layer is filled.
    ///
    /// A singular equation is solved up to the mean of its right-hand side, and the mean of the
    /// solution is zero to single precision of its own size.
    ///
    /// # Errors
    /// [`SolveError`], with the residual reached; `p` then holds the last solution whose residual was evaluated.
    pub fn solve(
        &mut self,
        domain: &Domain,
        equation: &impl Equation,
        p: &mut Field<Real>,
        stop: Stop,
        most_iterations: usize,
    ) -> Result<Solution, SolveError> {
        let largest_coefficient = self.multigrid.set_up(equation);
        equation.fill_ghosts(domain, p);
        let mut scale = 1.0;
        let mut residual = self.evaluate(domain, equation, p, scale, false);
        if residual.largest > 0.0 && residual.largest.is_finite() && !(1e-9..1e12).contains(&residual.largest) {
            scale = largest_coefficient.max(1.0) / residual.largest;
            residual = self.evaluate(domain, equation, p, scale, false);
        }
        let initial = residual.norm;
        let tolerance = match stop {
            Stop::Largest(tolerance) => tolerance,
            Stop::Relative(tolerance) => tolerance * initial,
        };
        let control = Control { tolerance, most_iterations, margin: MARGIN, trusted_fall: TRUSTED, most_stalls: 1 };
        let (last, descended, fresh) = (None, false, true);
        let mut solve = Solve { solver: self, domain, equation, p, scale, stop, residual, last, descended, fresh };
        let Progress { iterations, evaluations, .. } = iterate(&mut solve, stop.measure(&residual), &control)?;
        let Residual { largest, norm, .. } = solve.residual;
        let relative = if initial > 0.0 { norm / initial } else { 0.0 };
        Ok(Solution { iterations, largest, relative, evaluations })
    }

    /// Evaluates the residual of `p` and makes it the one of the recursion, which `goes_on` or begins.
    fn evaluate(
        &mut self,
        domain: &Domain,
        equation: &impl Equation,
        p: &Field<Real>,
        scale: Real,
        goes_on: bool,
    ) -> Residual {
        let previous = goes_on.then_some(&mut self.previous);
        self.multigrid.evaluate(domain, equation, p, scale, previous, &mut self.sums)
    }

    /// Completes the cycle, and gives the next direction and the step along it; or else its
    /// curvature, if there is no descent.
    fn next_step(
        &mut self,
        domain: &Domain,
        singular: bool,
        last_step: &mut Option<(Real, Real)>,
    ) -> Result<DirectionStep, Real> {
        self.sums.fill([0.0; 4]);
        self.multigrid.complete(&self.previous, &mut self.sums);
        let mut sums = [0.0; 4];
        for plane in &self.sums {
            for (sum, plane) in sums.iter_mut().zip(plane) {
                *sum += plane;
            }
        }
        let [descent, before, uncorrected, sum] = domain.sum(sums);
        let mean = if singular { sum / domain.grid().len() as Real } else { 0.0 };
        // With r the residual, q = (r_old - r)/alpha the product of A and the last direction p:
        // beta = -(z q)/(p q), and (z + beta p) A (z + beta p) = z A z - (z q)^2/(p q).
        let (mut beta, mut curvature) = (0.0, uncorrected);
        if let Some((alpha, last)) = *last_step {
            let common = (before - descent) / alpha;
            curvature = uncorrected - common * common / last;
            beta = -common / last;
            // A direction nearly along the last one says that rounding rules: start afresh.
            if curvature <= 1e-3 * uncorrected {
                (beta, curvature) = (0.0, uncorrected);
            }
        }
        if !(descent > 0.0 && curvature > 0.0 && curvature.is_finite()) {
            return Err(curvature);
        }
        let alpha = (descent / curvature) as f32;
        *last_step = Some((f64::from(alpha), curvature));
        Ok(DirectionStep { beta: beta as f32, mean: mean as f32, alpha, keep: true })
    }

    fn advance(&mut self, domain: &Domain, step: DirectionStep, descend: bool, scale: Real) -> Residual {
        let Self { multigrid, direction, previous, sums, .. } = self;
        let residual = multigrid.advance(domain, direction, previous, step, descend, sums);
        Residual { largest: residual.largest / scale, norm: residual.norm / scale, ..residual }
    }

    /// Adds the steps to `p`; takes out the mean of `p` known from its last residual.
    fn add_steps(&self, domain: &Domain, equation: &impl Equation, p: &mut Field<Real>, scale: Real, mean: Real) {
        let offset = if equation.is_singular() { mean } else { 0.0 };
        self.multigrid.add_steps(&self.direction, 1.0 / scale, offset, p);
        equation.fill_ghosts(domain, p);
    }
}
