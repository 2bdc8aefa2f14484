//! Ranks and threads of a run: whether the box can be shared among them, and whether they are too many.

use std::fmt;

use sazanami_numerics::domain::{Decomposition, LayoutError};
use sazanami_parallel::Processes;
use sazanami_posing::assembly::shared;

use crate::case::LoadedCase;
use crate::case::meaning::{Case, Solver};
use crate::error::CommandError;
use crate::followers;
use crate::job::{RunOptions, Workers};
use crate::machine::Machine;

/// Most threads of a process, those of all its ranks together: systems refuse to start many more.
const MOST_THREADS: usize = 1024;

/// The ranks and threads that a run is given, on a machine of `cores` processors or on the processes of a launcher.
///
/// # Errors
/// If there are too many of either, the box cannot be shared among them, or the processes were not started alike.
pub(crate) fn of_run(loaded: &LoadedCase, options: &RunOptions, cores: usize) -> Result<Workers, CommandError> {
    let Some(processes) = &options.processes else {
        let workers = Workers::of_this_process(options, cores);
        few_enough(workers.ranks.saturating_mul(workers.threads), cores)?;
        let others = |possible| format!("numbers for `--ranks` that work: {possible}");
        return can_share(&loaded.case, workers.ranks, others).map(|()| workers);
    };
    only_launched(options, processes)?;
    let cells = loaded.case.domain.cell_count();
    let most = shared::MOST_GATHERED;
    if loaded.case.solver == Solver::Mics && cells > most {
        return Err(CommandError::input(
            format!("{cells} cells are more than the {most} whose fields one rank can gather into a file"),
            "take fewer cells: checkpoints and output are written by rank 0 alone",
        ));
    }
    can_share(&loaded.case, processes.size(), |possible| format!("numbers of processes that work: {possible}"))?;
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

/// Numbers of ranks that can share a box, about one that cannot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Possible {
    /// The next lower number.
    pub below: usize,
    /// The next higher one, if there is one.
    pub above: Option<usize>,
    /// The highest one.
    pub most: usize,
}

impl fmt::Display for Possible {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { below, above, most } = self;
        match above {
            Some(above) if above == most => write!(formatter, "{below} or {above}, which is the most"),
            Some(above) => write!(formatter, "{below} or {above}, and {most} at most"),
            None => write!(formatter, "{most} at most"),
        }
    }
}

/// Refuses ranks that the box cannot be shared among; `others` says what to do, given how many can.
///
/// # Errors
/// If they cannot.
pub fn can_share(case: &Case, ranks: usize, others: impl Fn(Possible) -> String) -> Result<(), CommandError> {
    let grid = shared::grid(case);
    let most = shared::most_ranks(&grid);
    let problem = if ranks > most {
        LayoutError { cells: grid.cells, ranks }
    } else {
        match Decomposition::new(&grid, ranks) {
            Ok(_) => return Ok(()),
            Err(problem) => problem,
        }
    };
    let can = |ranks: &usize| Decomposition::new(&grid, *ranks).is_ok();
    let below = (1..ranks.min(most + 1)).rev().find(can).unwrap_or(1);
    let possible = Possible { below, above: (ranks + 1..=most).find(can), most };
    let cells = match case.solver {
        Solver::Mics => "",
        Solver::Mps => ", which are about half a radius of influence long",
    };
    Err(CommandError::input(format!("{problem}{cells}"), others(possible)))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn more_threads_than_systems_start_are_refused() {
        let refused = few_enough(5000, 2).unwrap_err().to_string();
        assert!(refused.contains("5000 threads"), "{refused}");
        assert!(few_enough(MOST_THREADS, 2).is_ok() && few_enough(5000, 5000).is_ok());
    }

    #[test]
    fn numbers_of_ranks_that_work_are_named_on_both_sides() {
        let text = "[domain]\nsize = [\"24 mm\", \"24 mm\", \"2 mm\"]\ncells = [24, 24, 2]\n[run]\nuntil = \"1 ms\"\n";
        let case = crate::case::parse(Path::new("c.toml"), text, &[]).unwrap().case;
        let refused = |ranks| can_share(&case, ranks, |possible| possible.to_string()).unwrap_err().to_string();
        let ends = |ranks, words: &str| assert!(refused(ranks).ends_with(words), "{}", refused(ranks));
        ends(13, "12 or 14, and 144 at most");
        ends(145, "144 at most");
        for ranks in [1, 12, 14, 144] {
            assert!(can_share(&case, ranks, |possible| possible.to_string()).is_ok(), "{ranks}");
        }
    }
}
