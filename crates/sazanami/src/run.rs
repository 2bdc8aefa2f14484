//! Running a case and going on with one: what is asked and what comes of it.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::mpsc;
use std::time::Instant;

use sazanami_io::checkpoint::{CheckpointError, CheckpointFolder, NewestCheckpoint};
use sazanami_numerics::Real;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_parallel::{Solo, run_ranks, with_threads};

use crate::bed_file::Bed;
use crate::case::meaning::Case;
use crate::case::resolved::{self, Paths};
use crate::case::{self, CaseError, Diagnostics, LoadedCase};
use crate::check::CostModel;
use crate::error::{CommandError, Failure};
use crate::log::Log;
use crate::machine::Machine;
use crate::progress::Progress;
use crate::simulation::{self, Ended, Event, Job, RankFailure, Reporter, Resumed};
use crate::{feasible, recorder, results, tanks};

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Not ended yet.
    Running,
    /// Reached its end.
    Finished,
    /// Stopped by a signal, a number of steps or a time before its end.
    Stopped,
    /// Ended by an error.
    Failed,
}

/// What `run` is asked beyond the case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunOptions {
    /// Folder for the results; absent: the next free `runs/<case>-<n>`.
    pub out: Option<PathBuf>,
    /// Overwrite a folder that is not empty.
    pub force: bool,
    /// Stop at this simulated time [s] (never changes a time step).
    pub until: Option<Real>,
    /// Stop after so many further fluid steps.
    pub steps: Option<u64>,
    /// Threads; absent: as many as the machine has.
    pub threads: Option<usize>,
    /// In-process ranks.
    pub ranks: usize,
    /// The commit that the program was built from, for the summary.
    pub commit: Option<&'static str>,
}

/// What came of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSummary {
    /// How it ended.
    pub status: Status,
    /// Whether a signal stopped it.
    pub interrupted: bool,
    /// Folder of the results.
    pub folder: PathBuf,
    /// Fluid steps so far.
    pub steps: u64,
    /// Simulated time so far [s].
    pub time: Real,
    /// Wall-clock time of this command [s].
    pub wall: Real,
    /// Lines for people: crater volume, budget, what was written.
    pub lines: Vec<String>,
}

impl RunSummary {
    /// Exit code of the command.
    #[must_use]
    pub const fn exit_code(&self) -> u8 {
        if self.interrupted { crate::error::exit::STOPPED } else { crate::error::exit::DONE }
    }
}

/// Runs a case into a folder of its own until it ends or `stop` is set.
///
/// # Errors
/// If the case cannot run, the folder is refused, or the run fails.
pub fn run(
    loaded: &LoadedCase,
    options: &RunOptions,
    progress: &mut dyn Progress,
    stop: &AtomicBool,
) -> Result<RunSummary, CommandError> {
    let feasible = feasible::check(loaded, &Machine::this(), &CostModel::default())?;
    if !feasible.warnings.is_empty() {
        progress.warnings(&feasible.warnings, &loaded.source);
    }
    let (prepared, told) = made_ready(loaded, options)?;
    let folder = results::prepare(options.out.as_deref(), &loaded.case.name, options.force)?;
    // Kept before anything is removed: the case may lie in the very folder, and name the copies of an earlier run.
    let kept = results::keep_inputs(&loaded.case, &folder)?;
    if options.force {
        results::clear(&folder, &kept)?;
    }
    let mut log = Log::create(&folder, progress);
    log.note(&heading(&loaded.case, options));
    told.iter().for_each(|text| log.message(text));
    let from = From::Case(resolved::write(&kept, Paths::AsGiven), prepared);
    start(&loaded.case, feasible.shapes, feasible.beds, options, folder, from, &mut log, stop)
}

/// A tank made ready before that suits the case, if there is one, and where it comes from.
fn made_ready(loaded: &LoadedCase, options: &RunOptions) -> Result<(Option<Snapshot>, Vec<String>), CommandError> {
    let (mut report, mut told) = (Diagnostics::default(), Vec::new());
    let commit = options.commit.unwrap_or("unknown");
    let found = tanks::find(loaded, commit, &mut report, |text| told.push(text));
    if report.has_errors() {
        return Err(Box::new(CaseError { source: loaded.source.clone(), diagnostics: report }).into());
    }
    Ok((found, told))
}

/// Goes on from the newest good checkpoint in `folder`.
///
/// # Errors
/// If there is none, if the case in the folder is not the one the run began with, or if the run fails.
pub fn resume(
    folder: &Path,
    options: &RunOptions,
    progress: &mut dyn Progress,
    stop: &AtomicBool,
) -> Result<RunSummary, CommandError> {
    let case_file = folder.join("case.toml");
    if !case_file.is_file() {
        return Err(CommandError::input(
            format!("`{}` holds no run: there is no case.toml in it", folder.display()),
            "give the folder that `sazanami run` wrote to",
        ));
    }
    let loaded = case::load(&case_file, &[])?;
    let newest = newest_checkpoint(folder, progress)?;
    let Some((step, reader)) = &newest.good else {
        return Err(CommandError::input(
            format!("`{}` holds no good checkpoint", folder.display()),
            "start the case again with `sazanami run`",
        ));
    };
    let resumed = Resumed {
        run: recorder::run_state(reader).map_err(unreadable)?,
        snapshot: reader.snapshot().map_err(unreadable)?,
    };
    if resumed.run.case_hash != format!("{:016x}", resolved::hash(&loaded.case)) {
        return Err(CommandError::input(
            format!("`{}` is not the case that this run began with: it was changed since", case_file.display()),
            "put the file back as `sazanami run` wrote it, or run the changed case into a new folder: \
             `sazanami run CASE.toml --out DIR`",
        ));
    }
    let (machine, model) = (Machine::this(), CostModel::default());
    // Once the grains lie where they are put nobody needs the beds any more: they may be gone.
    let feasible = if resumed.run.packing {
        feasible::check(&loaded, &machine, &model)?
    } else {
        feasible::check_without_grains(&loaded, &machine, &model)?
    };
    let mut log = Log::append(folder, progress);
    log.note(&heading(&loaded.case, options));
    skipped(&newest).for_each(|text| log.note(&text));
    log.message(&format!("going on from step {step}, time {:.6e} s", resumed.run.time));
    let from = From::Checkpoint(Box::new(resumed));
    start(&loaded.case, feasible.shapes, feasible.beds, options, folder.to_owned(), from, &mut log, stop)
}

/// What of a checkpoint cannot be read.
pub(crate) fn unreadable(error: CheckpointError) -> CommandError {
    CommandError::input(error.to_string(), "start the case again with `sazanami run`")
}

/// The newest good checkpoint in a folder of results, with a word about each that is skipped.
pub(crate) fn newest_checkpoint(folder: &Path, progress: &mut dyn Progress) -> Result<NewestCheckpoint, CommandError> {
    let newest = checkpoints(folder).newest_good().map_err(unreadable)?;
    skipped(&newest).for_each(|text| progress.message(&text));
    Ok(newest)
}

/// A line about each checkpoint that was skipped.
fn skipped(newest: &NewestCheckpoint) -> impl Iterator<Item = String> {
    newest.skipped.iter().map(|(path, error)| format!("skipped {}: {error}", path.display()))
}

fn checkpoints(folder: &Path) -> CheckpointFolder {
    CheckpointFolder::new(folder.join("checkpoints"), 1)
}

/// What a run begins with.
enum From {
    /// A case, with the text of its resolved copy and a tank that was made ready before.
    Case(String, Option<Snapshot>),
    /// A checkpoint of the run in the folder.
    Checkpoint(Box<Resumed>),
}

/// First line of a command in the log.
fn heading(case: &Case, options: &RunOptions) -> String {
    format!(
        "sazanami {} ({}): {}, case hash {:016x}",
        env!("CARGO_PKG_VERSION"),
        options.commit.unwrap_or("unknown commit"),
        case.name,
        resolved::hash(case)
    )
}

/// Runs the job; how it ended goes into the log.
#[allow(clippy::too_many_arguments, reason = "what a run needs comes from as many places")]
fn start(
    case: &Case,
    shapes: Vec<Shape>,
    beds: Vec<Option<Bed>>,
    options: &RunOptions,
    folder: PathBuf,
    from: From,
    log: &mut Log,
    stop: &AtomicBool,
) -> Result<RunSummary, CommandError> {
    let outcome = listen(case, shapes, beds, options, folder, from, log, stop);
    match &outcome {
        Ok(summary) => summary.lines.iter().for_each(|line| log.note(line)),
        Err(error) => log.note(&format!("error: {error}")),
    }
    outcome
}

/// How many events a run may be ahead of its listener before it waits for it.
const LISTENER_LAG: usize = 1;

/// Starts the ranks and hears them to the end.
#[allow(clippy::too_many_arguments, reason = "what a run needs comes from as many places")]
fn listen(
    case: &Case,
    shapes: Vec<Shape>,
    beds: Vec<Option<Bed>>,
    options: &RunOptions,
    folder: PathBuf,
    from: From,
    progress: &mut dyn Progress,
    stop: &AtomicBool,
) -> Result<RunSummary, CommandError> {
    let began = Instant::now();
    let ranks = options.ranks.max(1);
    let cores = Machine::this().cores;
    let threads = options.threads.unwrap_or_else(|| cores.div_ceil(ranks)).max(1);
    let (sender, events) = mpsc::sync_channel(LISTENER_LAG);
    let reporter = Reporter(sender);
    let (case_text, prepared, resumed) = match from {
        From::Case(text, prepared) => (Some(text), prepared, None),
        From::Checkpoint(resumed) => (None, None, Some(*resumed)),
    };
    let goes_on = resumed.is_some();
    let shapes = shapes.into();
    let job = Job { case, case_text, shapes, beds, options, folder, prepared, resumed, reporter, stop, threads };
    let outcome = std::thread::scope(|scope| {
        // The job, and with it the only sender, ends with the worker: then the listener ends too.
        let worker = scope.spawn(move || {
            let folder = job.folder.clone();
            (ranks_of(&job, ranks), folder)
        });
        for event in events {
            match event {
                Event::Step(line) => progress.step(&line),
                Event::Message(text) => progress.message(&text),
            }
        }
        worker.join()
    });
    let (ended, folder) = outcome.map_err(|_| Failure {
        kind: "panic",
        message: "the run broke off: this is a fault of the program, please report it with the case".into(),
        ..Failure::default()
    })?;
    let ended = ended.map_err(|failed| {
        // Rank 0, which wrote the summary, may have known only that another rank had failed. A wrong command has
        // not touched the run it was to go on with.
        if !(goes_on && failed.error.is_at_once())
            && let Err(problem) = recorder::put_failure(&folder, &failed.failure)
        {
            progress.message(&format!("the failure could not be put into the summary: {problem}"));
        }
        // A case file may lie elsewhere, and files are named relative to it.
        let bed = case.packs().then(|| recorder::packed_bed(case, &folder));
        let bed = bed.map(|bed| std::path::absolute(&bed).unwrap_or(bed));
        failed.into_command_error(last_good_checkpoint(&folder), bed.as_deref())
    })?;
    let lines = crate::analyse::present(&folder, progress)?;
    Ok(RunSummary {
        status: ended.status,
        interrupted: ended.interrupted,
        folder,
        steps: ended.steps,
        time: ended.time,
        wall: began.elapsed().as_secs_f64(),
        lines,
    })
}

/// Runs the job on its ranks; the first-hand error of the lowest rank counts.
fn ranks_of(job: &Job, ranks: usize) -> Result<Ended, Box<RankFailure>> {
    if ranks == 1 {
        return with_threads(job.threads, || simulation::run_rank(Box::<Solo>::default(), job));
    }
    let outcomes = match run_ranks(ranks, job.threads, |communicator| simulation::run_rank(communicator, job)) {
        Ok(outcomes) => outcomes,
        Err(failed) => std::panic::panic_any(failed.to_string()),
    };
    let mut ended = None;
    let mut secondary = None;
    for outcome in outcomes {
        match outcome {
            Ok(value) => ended = ended.or(Some(value)),
            Err(failed) if failed.error.is_secondary() => secondary = secondary.or(Some(failed)),
            Err(failed) => return Err(failed),
        }
    }
    match (secondary, ended) {
        (Some(failed), _) => Err(failed),
        (None, Some(ended)) => Ok(ended),
        (None, None) => unreachable!("a group has at least one rank"),
    }
}

fn last_good_checkpoint(folder: &Path) -> Option<PathBuf> {
    checkpoints(folder).newest_good().ok()?.good.map(|(_, reader)| reader.path().to_owned())
}
