//! Linear solvers for the equations of the grid.

mod conjugate_gradient;
mod equation;
mod iteration;
mod multigrid;

pub use conjugate_gradient::{ConjugateGradient, Solution, Stop};
pub use equation::{Equation, FaceEquation};
pub use iteration::{Control, Progress, SolveError, System, iterate};
pub use multigrid::{Levels, levels};
