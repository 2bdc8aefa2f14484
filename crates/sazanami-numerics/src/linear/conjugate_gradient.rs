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
use super::multigrid::{Colours, Direction, Multigrid, Residual, Step};
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

/// What a solve did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solution {
    /// Iterations.
    pub iterations: usize,
    /// Largest residual of a cell, evaluated from the solution.
    pub largest: Real,
    /// 2-norm of the residual over that of the initial guess, evaluated from the solution.
    pub relative: Real,
    /// Evaluations of the residual in double precision.
    pub evaluations: usize,
}

/// The equation was not solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The residual does not fall any more, or not fast enough.
    #[error("residual {residual:e} after {iterations} iterations, asked for {tolerance:e}")]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Residual reached, in the measure of [`Stop`].
        residual: Real,
        /// Residual asked for.
        tolerance: Real,
    },
    /// NaN or infinity came up: the equation holds one, or is not positive definite.
    #[error("NaN or infinity after {iterations} iterations")]
    NotFinite {
        /// Iterations done.
        iterations: usize,
    },
    /// A direction without curvature: the equation is not positive definite.
    #[error("no descent after {iterations} iterations (residual {residual:e}, curvature {curvature:e})")]
    Breakdown {
        /// Iterations done.
        iterations: usize,
        /// Residual reached, in the measure of [`Stop`].
        residual: Real,
        /// Curvature of the last direction.
        curvature: Real,
    },
}

/// Fall of the recursive residual after which it is replaced by the true one.
const TRUSTED: Real = 1e-4;
/// The recursive residual must be this part of the tolerance before the true one is looked at.
const MARGIN: Real = 0.9;
/// Fall per iteration expected of the first one.
const FIRST_FALL: Real = 0.3;

/// Solver for equations on one grid; holds all storage.
pub struct ConjugateGradient {
    multigrid: Multigrid,
    direction: Direction,
    previous: Colours,
    sums: Vec<[f64; 4]>,
}

/// Scalars of the recursion.
struct Recursion {
    /// Length and curvature of the last step.
    last: Option<(Real, Real)>,
    /// Residual, and its value when it was last true.
    now: Real,
    trusted: Real,
    fall: Real,
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
        let mut residual = self.evaluate(domain, equation, p, scale, 0)?;
        if !(1e-9..1e12).contains(&residual.largest) && residual.largest > 0.0 {
            scale = largest_coefficient.max(1.0) / residual.largest;
            residual = self.evaluate(domain, equation, p, scale, 0)?;
        }
        let initial = residual;
        let measure = |r: &Residual| match stop {
            Stop::Largest(_) => r.largest,
            Stop::Relative(_) => r.norm,
        };
        let tolerance = match stop {
            Stop::Largest(tolerance) => tolerance,
            Stop::Relative(tolerance) => tolerance * initial.norm,
        };
        let mut solution = Solution { evaluations: 1, ..Solution::default() };
        let now = measure(&residual);
        let mut recursion = Recursion { last: None, now, trusted: now, fall: FIRST_FALL };
        let mut stalls = 0;
        let mut descended = false;
        let mut fresh = true;
        while measure(&residual) > tolerance {
            let iterations = solution.iterations;
            let reached = measure(&residual);
            if iterations >= most_iterations || stalls > 1 {
                return Err(SolveError::NotConverged { iterations, residual: reached, tolerance });
            }
            if !descended {
                self.multigrid.descend();
            }
            let step = self.next_step(domain, equation.is_singular(), &mut recursion).map_err(|curvature| {
                if curvature.is_finite() {
                    SolveError::Breakdown { iterations, residual: reached, curvature }
                } else {
                    SolveError::NotFinite { iterations }
                }
            })?;
            solution.iterations += 1;
            let expected = recursion.now * recursion.fall * 1.3;
            let last = expected <= MARGIN * tolerance || expected <= TRUSTED * recursion.trusted;
            let step = Step { keep: !fresh, ..step };
            let Residual { largest, norm, .. } = self.advance(domain, step, !last, scale);
            descended = !last;
            fresh = false;
            let now = measure(&Residual { largest, norm, mean: 0.0 });
            recursion.fall = (now / recursion.now).clamp(0.02, 1.0);
            recursion.now = now;
            if !now.is_finite() {
                return Err(SolveError::NotFinite { iterations });
            }
            if now <= MARGIN * tolerance || now <= TRUSTED * recursion.trusted {
                self.add_steps(domain, equation, p, scale, residual.mean);
                let before = recursion.trusted;
                residual = self.evaluate(domain, equation, p, scale, solution.iterations)?;
                solution.evaluations += 1;
                stalls = if measure(&residual) > 0.5 * before { stalls + 1 } else { 0 };
                recursion.now = measure(&residual);
                recursion.trusted = recursion.now;
                descended = false;
                fresh = true;
            }
        }
        solution.largest = residual.largest;
        solution.relative = if initial.norm > 0.0 { residual.norm / initial.norm } else { 0.0 };
        Ok(solution)
    }

    /// Evaluates the residual of `p` after `iterations` and makes it the one of the recursion.
    fn evaluate(
        &mut self,
        domain: &Domain,
        equation: &impl Equation,
        p: &Field<Real>,
        scale: Real,
        iterations: usize,
    ) -> Result<Residual, SolveError> {
        let previous = (iterations > 0).then_some(&mut self.previous);
        let residual = self.multigrid.evaluate(domain, equation, p, scale, previous, &mut self.sums);
        if residual.largest.is_finite() { Ok(residual) } else { Err(SolveError::NotFinite { iterations }) }
    }

    /// Completes the cycle, and gives the next direction and the step along it; or else its
    /// curvature, if there is no descent.
    fn next_step(&mut self, domain: &Domain, singular: bool, recursion: &mut Recursion) -> Result<Step, Real> {
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
        if let Some((alpha, last)) = recursion.last {
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
        recursion.last = Some((f64::from(alpha), curvature));
        Ok(Step { beta: beta as f32, mean: mean as f32, alpha, keep: true })
    }

    fn advance(&mut self, domain: &Domain, step: Step, descend: bool, scale: Real) -> Residual {
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
