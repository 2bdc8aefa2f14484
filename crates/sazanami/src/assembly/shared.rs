//! The grid that ranks share, and among how many it can be shared.

use sazanami_numerics::domain::Decomposition;
use sazanami_numerics::grid::Grid;

use super::particles;
use crate::case::meaning::{Case, Solver};

/// Most cells whose fields rank 0 gathers for checkpoints and output.
pub(crate) const MOST_GATHERED: usize = 50_000_000;

/// The grid that ranks share: that of the fluid, or the bins of moving particles.
pub(crate) fn grid(case: &Case) -> Grid {
    match case.solver {
        Solver::Mics => case.domain.grid(),
        Solver::Mps => particles::grid(case),
    }
}

/// Most ranks that a grid can be shared among.
pub(crate) fn most_ranks(grid: &Grid) -> usize {
    (1..=Decomposition::most(grid)).rev().find(|&ranks| Decomposition::new(grid, ranks).is_ok()).unwrap_or(1)
}
