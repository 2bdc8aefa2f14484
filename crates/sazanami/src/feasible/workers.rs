//! Ranks and threads of a run: whether the box can be shared among them, and whether they are too many.

use sazanami_numerics::domain::Decomposition;

use crate::assembly::particles;
use crate::case::LoadedCase;
use crate::case::meaning::{Case, Solver};
use crate::error::CommandError;
use crate::followers;
use crate::job::{RunOptions, Workers};

/// Most threads of a process, those of all its ranks together: systems refuse to start many more.
const MOST_THREADS: usize = 1024;

/// The ranks and threads that a run is given, on a machine of `cores` processors or on the processes of a launcher.
///
/// # Errors
/// If there are too many of either, the box cannot be shared among them, or the processes were not started alike.
pub(crate) fn workers(loaded: &LoadedCase, options: &RunOptions, cores: usize) -> Result<Workers, CommandError> {
    let Some(processes) = &options.processes else {
        let workers = Workers::of_this_process(options, cores);
        few_enough(&workers, cores)?;
        let more = |most| format!("give `--ranks {most}` or fewer");
        return can_share(&loaded.case, workers.ranks, more).map(|()| workers);
    };
    if options.ranks > 1 {
        return Err(CommandError::input(
            format!("`--ranks {}` is for one process, and a launcher started {}", options.ranks, processes.size()),
            "leave out `--ranks`: each process of the launcher is a rank",
        ));
    }
    can_share(&loaded.case, processes.size(), |most| format!("start {most} processes or fewer"))?;
    followers::muster(processes, Some(loaded), options)
}

fn few_enough(workers: &Workers, cores: usize) -> Result<(), CommandError> {
    let all = workers.ranks.saturating_mul(workers.threads);
    let most = MOST_THREADS.max(cores);
    if all <= most {
        return Ok(());
    }
    Err(CommandError::input(
        format!("{all} threads, those of all ranks together, are more than the {most} that a run can have"),
        format!("more threads than processors make no run faster, and this machine has {cores}"),
    ))
}

/// Refuses ranks that the box cannot be shared among; `fewer` says what to do, given how many it can.
fn can_share(case: &Case, ranks: usize, fewer: impl Fn(usize) -> String) -> Result<(), CommandError> {
    let grid = match case.solver {
        Solver::Mics => case.domain.grid(),
        Solver::Mps => particles::grid(case),
    };
    let Err(problem) = Decomposition::new(&grid, ranks) else { return Ok(()) };
    let most = (1..ranks).rev().find(|&ranks| Decomposition::new(&grid, ranks).is_ok()).unwrap_or(1);
    let cells = match case.solver {
        Solver::Mics => "",
        Solver::Mps => ", which are about half a radius of influence long",
    };
    Err(CommandError::input(format!("{problem}{cells}"), fewer(most)))
}
