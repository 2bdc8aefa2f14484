//! The loop of conjugate gradients, once for all systems: iterations, evaluations of the true residual, and when to end.

use crate::Real;

/// A symmetric, positive (semi-)definite system with its solution, its preconditioner and the vectors of the recursion, in
/// the storage and precision that serve it.
pub trait System {
    /// Evaluates the residual of the solution so far and lets the recursion go on from it; returns its size.
    fn evaluate(&mut self) -> Real;

    /// Takes a step along the next conjugate direction; returns the size of the recursive residual. `last` says that
    /// [`Self::evaluate`] will probably follow.
    ///
    /// # Errors
    /// The curvature of the direction if there is no descent along it; NaN if a sum is not finite.
    fn advance(&mut self, last: bool) -> Result<Real, Real>;
}

/// When to end, and when to replace the recursive residual by the true one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// Size of the true residual at which the solution is good enough.
    pub tolerance: Real,
    /// Iterations after which the solver gives up.
    pub most_iterations: usize,
    /// Part of the tolerance to which the recursive residual falls before the true one is evaluated.
    pub margin: Real,
    /// Fall of the recursive residual after which it is replaced by the true one.
    pub trusted_fall: Real,
    /// Number of times that the true residual may fall by less than half from one evaluation to the next.
    pub most_stalls: usize,
}

/// Progress of the loop.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Number of iterations so far.
    pub iterations: usize,
    /// Evaluations of the true residual, that of the initial guess included.
    pub evaluations: usize,
    /// Size of the true residual.
    pub residual: Real,
}

/// The equation was not solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The residual does not fall any more, or not fast enough.
    #[error("residual {residual:e} after {iterations} iterations, asked for {tolerance:e}")]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Size of the true residual, in the measure of the stop.
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
        /// Size of the true residual, in the measure of the stop.
        residual: Real,
        /// Curvature of the last direction.
        curvature: Real,
    },
}

/// Fall per iteration expected of the first one.
const FIRST_FALL: Real = 0.3;

/// Iterates from a true residual of size `initial` until it is within the tolerance.
///
/// # Errors
/// [`SolveError`] with the size of the last true residual.
pub fn iterate(system: &mut impl System, initial: Real, control: &Control) -> Result<Progress, SolveError> {
    let Control { tolerance, most_iterations, margin, trusted_fall, most_stalls } = *control;
    let mut progress = Progress { iterations: 0, evaluations: 1, residual: initial };
    let (mut now, mut fall, mut stalls) = (initial, FIRST_FALL, 0);
    let finite = |size: Real, iterations: usize| {
        if size.is_finite() { Ok(size) } else { Err(SolveError::NotFinite { iterations }) }
    };
    finite(initial, 0)?;
    while progress.residual > tolerance {
        let Progress { iterations, residual, .. } = progress;
        if iterations >= most_iterations || stalls > most_stalls {
            return Err(SolveError::NotConverged { iterations, residual, tolerance });
        }
        let evaluate_at = (margin * tolerance).max(trusted_fall * residual);
        let last = now * fall * 1.3 <= evaluate_at;
        let after = system.advance(last).map_err(|curvature| {
            if curvature.is_finite() {
                SolveError::Breakdown { iterations, residual, curvature }
            } else {
                SolveError::NotFinite { iterations }
            }
        })?;
        progress.iterations += 1;
        fall = (after / now).clamp(0.02, 1.0);
        now = finite(after, progress.iterations)?;
        if now <= evaluate_at {
            progress.residual = finite(system.evaluate(), progress.iterations)?;
            progress.evaluations += 1;
            stalls = if progress.residual > 0.5 * residual { stalls + 1 } else { 0 };
            now = progress.residual;
        }
    }
    Ok(progress)
}
