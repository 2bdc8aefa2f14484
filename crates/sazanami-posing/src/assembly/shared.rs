//! The grid that ranks share, their parts of it, and among how many it can be shared.

use sazanami_numerics::domain::{Decomposition, Domain, LayoutError};
use sazanami_numerics::grid::Grid;
use sazanami_parallel::Communicator;

use super::particles;
use crate::case::meaning::{Case, Solver};

/// Most cells whose fields rank 0 gathers for checkpoints and output.
pub const MOST_GATHERED: usize = 50_000_000;

/// The grid that ranks share: that of the fluid, or the bins of moving particles.
pub fn grid(case: &Case) -> Grid {
    match case.solver {
        Solver::Mics => case.domain.grid(),
        Solver::Mps => particles::grid(case),
    }
}

/// A rank's part of that grid.
///
/// # Errors
/// [`LayoutError`] if it cannot be divided among the ranks of the group.
pub fn domain(case: &Case, communicator: Box<dyn Communicator>) -> Result<Domain, LayoutError> {
    Domain::new(grid(case), case.periodic(), communicator)
}

/// Most ranks that a grid can be shared among.
pub fn most_ranks(grid: &Grid) -> usize {
    (1..=Decomposition::most(grid)).rev().find(|&ranks| Decomposition::new(grid, ranks).is_ok()).unwrap_or(1)
}
