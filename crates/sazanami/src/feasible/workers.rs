//! Ranks and threads that a run is asked for: whether the box can be shared among them, and whether they are too many.

use sazanami_numerics::domain::Decomposition;

use crate::assembly::particles;
use crate::case::meaning::{Case, Solver};
use crate::error::CommandError;
use crate::job::RunOptions;

/// Most threads of a run, those of all its ranks together: systems refuse to start many more.
const MOST_THREADS: usize = 1024;

/// Refuses ranks that the box cannot be shared among, and more threads than a run can be given; `cores` are the
/// processors of the machine.
///
/// # Errors
/// If there are too many of either.
pub fn check_workers(case: &Case, options: &RunOptions, cores: usize) -> Result<(), CommandError> {
    let (ranks, threads) = (options.ranks.max(1), options.threads_of_rank(cores));
    let all = ranks.saturating_mul(threads);
    let most = MOST_THREADS.max(cores);
    if all > most {
        return Err(CommandError::input(
            format!("{all} threads, those of all ranks together, are more than the {most} that a run can have"),
            format!("more threads than processors make no run faster, and this machine has {cores}"),
        ));
    }
    let grid = match case.solver {
        Solver::Mics => case.domain.grid(),
        Solver::Mps => particles::grid(case),
    };
    let Err(problem) = Decomposition::new(&grid, ranks) else { return Ok(()) };
    let most = (1..ranks).rev().find(|&fewer| Decomposition::new(&grid, fewer).is_ok()).unwrap_or(1);
    let cells = match case.solver {
        Solver::Mics => "",
        Solver::Mps => ", which are about half a radius of influence long",
    };
    Err(CommandError::input(format!("{problem}{cells}"), format!("give `--ranks {most}` or fewer")))
}
