//! All that can be said of a case before it runs.

use std::path::Path;

use crate::case::{Diagnostics, LoadedCase};
use crate::check::{self, CheckReport, CostModel, Known};
use crate::error::CommandError;
use crate::machine::{self, Machine};
use crate::tanks::{self, Maker};
use crate::{feasible, results, workers};

/// Result of the examination of a case that can run.
#[derive(Clone, Debug)]
pub struct Examined {
    /// Resolution, counts, limits on the step, memory, disk and cost.
    pub report: CheckReport,
    /// Warnings about the case; it can run with them.
    pub warnings: Diagnostics,
    /// Messages on what lies beside the case, such as a tank prepared before.
    pub messages: Vec<String>,
}

/// Validates a case without running it: with its meshes, beds and tank, on this machine with `threads` threads (all if
/// absent), and shared among `ranks`, each with so many threads, if that is asked for. `commit` is that of the program.
///
/// # Errors
/// If the case cannot run, or cannot be shared among so many ranks.
pub fn examine(
    loaded: &LoadedCase,
    threads: Option<usize>,
    ranks: Option<usize>,
    commit: Option<&str>,
) -> Result<Examined, CommandError> {
    let (machine, model) = (Machine::this(), CostModel::default());
    let feasible = feasible::check(loaded, &machine, &model)?;
    let files = &results::contents(&loaded.case);
    let ready = tanks::made_ready(loaded, Maker { commit, ranks: ranks.unwrap_or(1), files, ..Maker::default() })?;
    let known = Known { shapes: &feasible.facts, made_ready: ready.tank.is_some() };
    let (asked, threads) = (threads, threads.unwrap_or(machine.cores));
    workers::few_enough(threads, machine.cores)?;
    let mut report = check::check(&loaded.case, known, &machine, threads, &model);
    if let Some(ranks) = ranks {
        workers::can_share(&loaded.case, ranks, |possible| format!("numbers for `--ranks` that work: {possible}"))?;
        let each = asked.unwrap_or((machine.cores / ranks).max(1));
        workers::few_enough(each, machine.cores)?;
        report.ranks = check::ranks(&loaded.case, ranks, each, &report, &feasible.beds, &model);
    }
    report.disk_available = machine::free_disk(Path::new("."));
    let mut warnings = feasible.warnings;
    check::warn_of_address_space(&report, &mut warnings);
    check::warn_of_disk(loaded, &report, report.disk_available, &mut warnings);
    Ok(Examined { report, warnings, messages: ready.messages })
}
