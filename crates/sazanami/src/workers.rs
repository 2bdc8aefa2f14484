//! Ranks and threads of a run: whether the box can be shared among them, and whether they are too many.

use sazanami_numerics::domain::{Decomposition, LayoutError};
use sazanami_parallel::Processes;

use crate::assembly::particles;
use crate::case::LoadedCase;
use crate::case::meaning::{Case, Solver};
use crate::error::CommandError;
use crate::followers;
use crate::job::{RunOptions, Workers};
use crate::machine::Machine;

/// Most threads of a process, those of all its ranks together: systems refuse to start many more.
const MOST_THREADS: usize = 1024;

/// Most cells whose fields rank 0 gathers for checkpoints and output.
const MOST_GATHERED: usize = 50_000_000;

/// The ranks and threads that a run is given, on a machine of `cores` processors or on the processes of a launcher.
///
/// # Errors
/// If there are too many of either, the box cannot be shared among them, or the processes were not started alike.
pub(crate) fn of_run(loaded: &LoadedCase, options: &RunOptions, cores: usize) -> Result<Workers, CommandError> {
    let Some(processes) = &options.processes else {
        let workers = Workers::of_this_process(options, cores);
        few_enough(workers.ranks.saturating_mul(workers.threads), cores)?;
        let more = |most| format!("give `--ranks {most}` or fewer");
        return can_share(&loaded.case, workers.ranks, more).map(|()| workers);
    };
    only_launched(options, processes)?;
    let cells = loaded.case.domain.cell_count();
    if loaded.case.solver == Solver::Mics && cells > MOST_GATHERED {
        return Err(CommandError::input(
            format!("{cells} cells are more than the {MOST_GATHERED} whose fields one rank can gather into a file"),
            "take fewer cells: checkpoints and output are written by rank 0 alone",
        ));
    }
    can_share(&loaded.case, processes.size(), |most| format!("start {most} processes or fewer"))?;
    followers::muster(processes, Some(loaded), options)
}

/// Ranks, and threads of each, of work that is not a run.
///
/// # Errors
/// If there are too many, or the processes of the launcher were not started alike.
pub fn of_options(options: &RunOptions) -> Result<[usize; 2], CommandError> {
    let cores = Machine::this().cores;
    let workers = match &options.processes {
        Some(processes) => {
            only_launched(options, processes)?;
            followers::muster(processes, None, options)?
        }
        None => Workers::of_this_process(options, cores),
    };
    if options.processes.is_none() {
        few_enough(workers.ranks.saturating_mul(workers.threads), cores)?;
    }
    Ok([workers.ranks, workers.threads])
}

/// Refuses ranks within each process of a launcher.
fn only_launched(options: &RunOptions, processes: &Processes) -> Result<(), CommandError> {
    if options.ranks <= 1 {
        return Ok(());
    }
    Err(CommandError::input(
        format!("`--ranks {}` is for one process, and a launcher started {}", options.ranks, processes.size()),
        "leave out `--ranks`: each process of the launcher is a rank",
    ))
}

/// Refuses more threads in `all` than systems start, on a machine of `cores` processors.
///
/// # Errors
/// If there are more.
pub(crate) fn few_enough(all: usize, cores: usize) -> Result<(), CommandError> {
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
///
/// # Errors
/// If there are too many.
pub fn can_share(case: &Case, ranks: usize, fewer: impl Fn(usize) -> String) -> Result<(), CommandError> {
    let grid = match case.solver {
        Solver::Mics => case.domain.grid(),
        Solver::Mps => particles::grid(case),
    };
    let tried = ranks.min(Decomposition::most(&grid) + 1);
    let Err(problem) = Decomposition::new(&grid, tried) else { return Ok(()) };
    let problem = LayoutError { ranks, ..problem };
    let most = (1..tried).rev().find(|&ranks| Decomposition::new(&grid, ranks).is_ok()).unwrap_or(1);
    let cells = match case.solver {
        Solver::Mics => "",
        Solver::Mps => ", which are about half a radius of influence long",
    };
    Err(CommandError::input(format!("{problem}{cells}"), fewer(most)))
}
