//! Running a case, and resuming one from its checkpoints.

use std::any::Any;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Instant;

use sazanami_numerics::Real;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_parallel::{RanksFailed, Solo, run_ranks_with, with_threads};

use crate::case::meaning::{Case, RunEnd};
use crate::case::resolved::{self, Paths};
use crate::case::{self, LoadedCase};
use crate::check::{self, CostModel, Known};
use crate::error::{CommandError, Failure};
use crate::feasible::{self, Feasible};
use crate::followers;
use crate::job::{Ending, Event, Job, Program, RankFailure, Reporter, Resumed, RunState, Workers};
use crate::lock::FolderLock;
use crate::log::{LOG, Log};
use crate::machine::{self, Machine};
use crate::progress::{Pace, Progress, StepLine, duration};
use crate::stop::Stop;
use crate::tanks::{self, MadeReady, Maker};
use crate::{checkpoints, recorder, results, simulation, workers};

pub use crate::job::{ReportWriter, RunOptions, Status};

/// Ranks that one process may have without being asked, however few processors there are.
const FEW_RANKS: usize = 16;

/// The outcome of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSummary {
    /// Whether it reached its end.
    pub status: Status,
    /// Whether a signal stopped it.
    pub interrupted: bool,
    /// Folder of the results.
    pub folder: PathBuf,
    /// Fluid steps so far.
    pub steps: u64,
    /// Simulated time so far \[s].
    pub time: Real,
    /// Wall-clock time of this command \[s].
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
    stop: &Stop,
) -> Result<RunSummary, CommandError> {
    let machine = Machine::this();
    let files = results::contents(&loaded.case);
    let mut feasible = feasible::check(loaded, &machine, &CostModel::default())?;
    let workers = workers::of_run(loaded, options, machine.cores)?;
    let ready = tanks::made_ready(loaded, Maker::of(&workers, options, &files))?;
    foresee_limits(loaded, &mut feasible, &ready, options, workers.ranks * workers.threads);
    if !feasible.warnings.is_empty() {
        progress.warnings(&feasible.warnings, &loaded.source);
    }
    let folder = results::prepare(options.out.as_deref(), &loaded.case.name, options.force)?;
    let lock = FolderLock::take(&folder)?;
    // Kept before anything is removed: the case may lie in the very folder, and name the copies of an earlier run.
    let kept = results::keep_inputs(&loaded.case, &folder)?;
    if options.force {
        results::clear(&folder, &kept)?;
    }
    let mut log = Log::create(&folder, progress);
    log.note(&heading(&loaded.case, options));
    for warning in feasible.warnings.records(&loaded.source) {
        log.note(&format!("warning: {}", warning.message));
    }
    warn_without(&lock, &mut log);
    if let Some(later) = options.until.filter(|until| *until > loaded.case.run.until) {
        let end = loaded.case.run.until;
        log.message(&format!(
            "warning: the case ends at {end} s, before {later} s: `--set run.until=\"{later} s\"` lengthens it"
        ));
    }
    ready.messages.iter().for_each(|text| log.message(text));
    let from = Start::Case(resolved::write(&kept, Paths::AsGiven), ready.tank);
    Launch { case: &loaded.case, feasible, files, workers, options, folder: &folder, stop }.start(from, &mut log)
}

/// Says so where nothing keeps a second run out of the folder.
fn warn_without(lock: &FolderLock, log: &mut Log) {
    if !lock.is_kept() {
        log.message("warning: this file system knows no locks: take care that no other run writes to this folder");
    }
}

/// Warns of results that the disk does not hold, and of an address space too small for so many threads.
fn foresee_limits(
    loaded: &LoadedCase,
    feasible: &mut Feasible,
    ready: &MadeReady,
    options: &RunOptions,
    threads: usize,
) {
    let known = Known { shapes: &feasible.facts, made_ready: ready.tank.is_some() };
    let report = check::check(&loaded.case, known, &Machine::this(), threads, &CostModel::default());
    check::warn_of_address_space(&report, &mut feasible.warnings);
    let free = machine::free_disk(options.out.as_deref().unwrap_or(Path::new(".")));
    check::warn_of_disk(loaded, &report, free, &mut feasible.warnings);
}

/// Goes on from the newest good checkpoint in `folder`, or from its case if the run ended before the first one.
///
/// # Errors
/// If all are damaged, if a run that has not ended writes to the folder, if the case in the folder is not the one the run began with, or if the run fails.
pub fn resume(
    folder: &Path,
    options: &RunOptions,
    progress: &mut dyn Progress,
    stop: &Stop,
) -> Result<RunSummary, CommandError> {
    let case_file = folder.join(results::CASE);
    if !case_file.is_file() {
        return Err(CommandError::input(
            format!("`{}` holds no run: there is no {} in it", folder.display(), results::CASE),
            "give the folder that `sazanami run` wrote to",
        ));
    }
    let lock = FolderLock::take(folder)?;
    let loaded = case::load(&case_file, &[])?;
    let newest = checkpoints::newest(folder, progress)?;
    let (step, reader) = match &newest.good {
        Some(good) => good,
        None if newest.skipped.is_empty() => {
            refuse_without_checkpoints(folder)?;
            let longer = options.until.filter(|until| can_end_later(&loaded, *until));
            let longer = longer.map(|until| lengthened(&case_file, &loaded, until)).transpose()?;
            return begin_again(&longer.unwrap_or(loaded), options, folder, progress, stop);
        }
        None => {
            return Err(CommandError::input(
                format!("`{}` holds no good checkpoint", folder.display()),
                "start the case again with `sazanami run`",
            ));
        }
    };
    let mut resumed =
        Resumed { run: checkpoints::run_state(reader)?, snapshot: reader.snapshot().map_err(checkpoints::unreadable)? };
    if !resumed.run.is_of(&loaded) {
        return Err(CommandError::input(
            format!("`{}` is not the case that this run began with: it was changed since", case_file.display()),
            "put the file back as `sazanami run` wrote it, or run the changed case into a new folder: \
             `sazanami run CASE.toml --out DIR`",
        ));
    }
    refuse_to_stand_still(&loaded, &resumed.run, options)?;
    refuse_at_rest(&loaded, &resumed.run, options, folder)?;
    let longer = longer(&case_file, &loaded, &resumed.run, options)?;
    if let Some(history) = resumed.run.history.as_mut().filter(|_| longer.is_some()) {
        history.ends.push(loaded.case.run.until);
    }
    let lengthened =
        longer.as_ref().map(|longer| resolved::write(&results::named_within(&longer.case, folder), Paths::AsGiven));
    let loaded = longer.unwrap_or(loaded);
    if lengthened.is_some() {
        resumed.run.case_hash = resolved::hash_text(&loaded.case);
    }
    let (machine, model) = (Machine::this(), CostModel::default());
    // Once the grains lie where they are put nobody needs the beds any more: they may be gone.
    let feasible = if resumed.run.packing {
        feasible::check(&loaded, &machine, &model)?
    } else {
        feasible::check_without_grains(&loaded, &machine, &model)?
    };
    let options = &continued(&resumed.run, options, folder, machine.cores)?;
    let workers = workers::of_run(&loaded, options, machine.cores)?;
    let mut log = Log::append(folder, progress);
    log.note(&heading(&loaded.case, options));
    warn_without(&lock, &mut log);
    checkpoints::skipped(&newest).for_each(|text| log.note(&text));
    checkpoints::put_aside(&newest);
    let ranks = if workers.ranks == 1 { String::new() } else { format!(", on {} ranks", workers.ranks) };
    log.message(&format!("going on from step {step}, time {:.6e} s{ranks}", resumed.run.time));
    if lengthened.is_some() {
        log.message(&format!("the case now ends at {} s", loaded.case.run.until));
    }
    if let Some(text) = other_program(&resumed.run, &loaded.case, options) {
        log.message(&text);
    }
    let files = results::contents(&loaded.case);
    let launch = Launch { case: &loaded.case, feasible, files, workers, options, folder, stop };
    launch.start(Start::Checkpoint(lengthened, Box::new(resumed)), &mut log)
}

/// Refuses to go on with a run whose flow is where the command asks it to stop, or at an end that the command does not
/// move. A run at an end of its case, time or steps, may be resumed without a wish: its results are then presented again.
fn refuse_to_stand_still(loaded: &LoadedCase, run: &RunState, options: &RunOptions) -> Result<(), CommandError> {
    let length = &loaded.case.run;
    let has_all_steps = length.steps.is_some_and(|most| run.step >= most as u64);
    let at = format!("this run is at step {}, {} s", run.step, run.time);
    let refused = |problem: String, help: &str| Err(CommandError::input(problem, help));
    if !run.flows() {
        return Ok(());
    }
    match (options.until, options.steps) {
        (Some(until), _) if until < run.time => refused(
            format!("{at}: it cannot go back to {until} s"),
            "give a later time, or run the case into a new folder",
        ),
        (until, Some(_)) | (until @ Some(_), _) if has_all_steps => refused(
            format!(
                "{at}, and its case ends after {} steps{}",
                length.steps.unwrap_or_default(),
                until.map_or("", |_| " whatever the time")
            ),
            "raise or remove `run.steps` in the case.toml of its folder, then resume it",
        ),
        (None, Some(_)) if run.time >= length.until => refused(
            format!("{at}, and its case ends at {} s", length.until),
            "give a later end: `sazanami resume DIR --until TIME`",
        ),
        _ => Ok(()),
    }
}

/// Refuses to go on with a run that has ended since its crater came to rest: it would end again without a step.
fn refuse_at_rest(
    loaded: &LoadedCase,
    run: &RunState,
    options: &RunOptions,
    folder: &Path,
) -> Result<(), CommandError> {
    let summary = summary_of(folder);
    let is_end = summary["status"] == "finished" && summary["time_s"].as_f64() == Some(run.time);
    let rests = loaded.case.run.end == RunEnd::Rest && run.flows() && is_end;
    if !rests || run.time >= loaded.case.run.until || options.until.is_none() && options.steps.is_none() {
        return Ok(());
    }
    Err(CommandError::input(
        format!("this run has come to rest at {} s, where its case ends", run.time),
        "write a time as `run.until` in the case.toml of its folder, without `run.latest`, then resume it",
    ))
}

/// The case with the end that the command asks for, where that is later than its own.
fn longer(
    case_file: &Path,
    loaded: &LoadedCase,
    run: &RunState,
    options: &RunOptions,
) -> Result<Option<LoadedCase>, CommandError> {
    let until = options.until.filter(|until| run.flows() && can_end_later(loaded, *until));
    until.map(|until| lengthened(case_file, loaded, until)).transpose()
}

/// Whether `until` \[s] lies after the end of a case that has one.
fn can_end_later(loaded: &LoadedCase, until: Real) -> bool {
    !loaded.case.run.packing_only && until > loaded.case.run.until
}

/// The case in a file with its end, and what ends with it, moved to `until` \[s].
fn lengthened(case_file: &Path, loaded: &LoadedCase, until: Real) -> Result<LoadedCase, CommandError> {
    let length = &loaded.case.run;
    let end = (length.end != RunEnd::Rest).then(|| format!("run.until=\"{until} s\""));
    let latest = length.latest.map(|latest| format!("run.latest=\"{} s\"", latest.max(until)));
    let mut longer = case::load(case_file, &end.into_iter().chain(latest).collect::<Vec<_>>())?;
    longer.case.output.move_end(length.until, until);
    longer.case.grains.iter_mut().for_each(|population| population.move_end(length.until, until));
    Ok(longer)
}

/// The options of a command that goes on with a run, with the ranks and the order of sums that the run had where they leave that open.
fn continued(run: &RunState, options: &RunOptions, folder: &Path, cores: usize) -> Result<RunOptions, CommandError> {
    let sums = options.sums.or(run.sums());
    if options.ranks > 0 || options.processes.is_some() {
        return Ok(RunOptions { sums, ..options.clone() });
    }
    // Earlier versions told it in the summary alone.
    let told = || summary_of(folder)["machine"]["ranks"].as_u64().map(|ranks| ranks as usize);
    let ranks = run.ranks().or_else(told).unwrap_or(1);
    if ranks > cores.max(FEW_RANKS) {
        return Err(CommandError::input(
            format!("this run was on {ranks} ranks, and this machine has {cores} processors"),
            "start as many processes by a launcher of MPI, or give `--ranks`: another number gives other last bits",
        ));
    }
    Ok(RunOptions { sums, ranks, ..options.clone() })
}

/// The summary in a folder of results; null where there is none.
fn summary_of(folder: &Path) -> serde_json::Value {
    let text = std::fs::read_to_string(folder.join(results::SUMMARY)).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

/// Refuses a run that wrote its last checkpoint long ago and has it no more: it would be computed again from the beginning.
fn refuse_without_checkpoints(folder: &Path) -> Result<(), CommandError> {
    let summary = summary_of(folder);
    let status = match summary["status"].as_str() {
        Some(status @ ("finished" | "stopped")) => status,
        // The hash of the state comes with the first checkpoint.
        Some(_) if !summary["state_hash"].is_null() => "broken off",
        _ => return Ok(()),
    };
    Err(CommandError::input(
        format!("`{}` holds a run that has {status}, and no checkpoint of it", folder.display()),
        format!(
            "its results stand; `sazanami run {} --out DIR` computes it anew",
            results::as_word(&folder.join(results::CASE))
        ),
    ))
}

/// Begins a run again that ended before its first checkpoint, from the case in its folder.
fn begin_again(
    loaded: &LoadedCase,
    options: &RunOptions,
    folder: &Path,
    progress: &mut dyn Progress,
    stop: &Stop,
) -> Result<RunSummary, CommandError> {
    let machine = Machine::this();
    let files = results::contents(&loaded.case);
    let feasible = feasible::check(loaded, &machine, &CostModel::default())?;
    let workers = workers::of_run(loaded, options, machine.cores)?;
    let ready = tanks::made_ready(loaded, Maker::of(&workers, options, &files))?;
    let kept = results::keep_inputs(&loaded.case, folder)?;
    let log = std::fs::read(folder.join(LOG)).unwrap_or_default();
    results::clear(folder, &kept)?;
    // What was said before stays in the log; where it cannot be kept the new log says why.
    let _ = std::fs::write(folder.join(LOG), log);
    let mut log = Log::append(folder, progress);
    log.note(&heading(&loaded.case, options));
    log.message("no checkpoint had been written: the run begins again from the case in its folder");
    ready.messages.iter().for_each(|text| log.message(text));
    let from = Start::Case(resolved::write(&kept, Paths::AsGiven), ready.tank);
    Launch { case: &loaded.case, feasible, files, workers, options, folder, stop }.start(from, &mut log)
}

/// A warning where another program began the run than goes on with it.
fn other_program(run: &RunState, case: &Case, options: &RunOptions) -> Option<String> {
    let this = Program::this(options);
    let began = match &run.program {
        Some(program) if *program == this => return None,
        Some(program) => program.to_string(),
        None if run.case_hash == format!("{:016x}", resolved::hash(case)) => return None,
        None => "an earlier version of sazanami".into(),
    };
    Some(format!(
        "warning: {began} began this run, and {this} goes on with it: the results may differ from those of a run \
         without a break"
    ))
}

/// Beginning of a run.
enum Start {
    /// A case, with the text of its resolved copy and a tank that was prepared before.
    Case(String, Option<Snapshot>),
    /// A checkpoint of the run in the folder, with the text of its case where that has got another end.
    Checkpoint(Option<String>, Box<Resumed>),
}

/// First line of a command in the log.
fn heading(case: &Case, options: &RunOptions) -> String {
    format!(
        "sazanami {} ({}): {}, case hash {}",
        env!("CARGO_PKG_VERSION"),
        options.commit.unwrap_or("unknown commit"),
        case.name,
        resolved::hash_text(case)
    )
}

/// Number of events that a run may be ahead of its listener before it waits for it.
const LISTENER_LAG: usize = 1;

/// A run that can begin.
struct Launch<'a> {
    case: &'a Case,
    feasible: Feasible,
    /// Hashes of what its files hold.
    files: Vec<String>,
    workers: Workers,
    options: &'a RunOptions,
    folder: &'a Path,
    stop: &'a Stop,
}

impl Launch<'_> {
    /// Runs; how it ended goes into the log.
    fn start(self, from: Start, log: &mut Log) -> Result<RunSummary, CommandError> {
        let outcome = self.listen(from, log);
        match &outcome {
            Ok(summary) => summary.lines.iter().for_each(|line| log.note(line)),
            Err(error) => log.note(&format!("error: {error}")),
        }
        outcome
    }

    /// Starts the ranks and hears them to the end.
    fn listen(self, from: Start, progress: &mut dyn Progress) -> Result<RunSummary, CommandError> {
        let Self { case, feasible, files, workers, options, folder, stop } = self;
        let began = Instant::now();
        let (sender, events) = mpsc::sync_channel(LISTENER_LAG);
        let (case_text, prepared, resumed) = match from {
            Start::Case(text, prepared) => (Some(text), prepared, None),
            Start::Checkpoint(text, resumed) => (text, None, Some(*resumed)),
        };
        let goes_on = resumed.is_some();
        let job = Job {
            case,
            case_text,
            packing_time: check::packing_time_of(case, &feasible.facts),
            shapes: feasible.shapes.into(),
            beds: feasible.beds,
            files,
            options,
            folder: folder.to_owned(),
            prepared,
            resumed,
            reporter: Reporter(sender),
            stop,
            workers,
        };
        if let Some(processes) = &options.processes {
            followers::get_ready(processes, &job)?;
        }
        let (mut last, mut pace) = (StepLine::default(), Pace::new());
        let outcome = std::thread::scope(|scope| {
            // The job, and with it the only sender, ends with the worker: then the listener ends too.
            let worker = scope.spawn(move || ranks_of(&job));
            for event in events {
                match event {
                    Event::Step(line) => {
                        last = StepLine { remaining: pace.remaining(&line), ..line };
                        progress.step(&last);
                    }
                    Event::Message(text) => progress.message(&text),
                }
            }
            worker.join()
        });
        let ended = outcome.map_err(|panic| broke_off(folder, &last, panic.as_ref(), options, progress))?.map_err(
            |failed| {
                // Rank 0, which wrote the summary, may have known only that another rank had failed. A wrong command has
                // not touched the run it was to go on with.
                if !(goes_on && failed.is_at_once) {
                    put_failure(folder, &failed.failure, progress);
                    report_failure(folder, options, progress);
                }
                // A case file may lie elsewhere, and files are named relative to it.
                let bed = case.packs().then(|| recorder::packed_bed(case, folder));
                let bed = bed.map(|bed| std::path::absolute(&bed).unwrap_or(bed));
                failed.into_command_error(checkpoints::last_good(folder), bed.as_deref())
            },
        )?;
        let wall = began.elapsed().as_secs_f64();
        let most_steps = case.run.steps.map(|steps| steps as u64);
        progress.message(&how_it_ended(&ended, &last, (options, most_steps), stop, wall));
        let lines = crate::analyse::present(folder, progress)?;
        if let Some(report) = options.report {
            let undone = |error: &dyn std::fmt::Display| CommandError::Undone(error.to_string());
            let written = report(folder).map_err(|error| undone(&error));
            let listed =
                written.and_then(|path| recorder::put_files(folder).map_err(|error| undone(&error)).map(|()| path));
            match listed {
                Ok(path) => progress.message(&format!("wrote {}", path.display())),
                Err(error) => {
                    // What was found is told nevertheless.
                    lines.iter().for_each(|line| progress.message(line));
                    return Err(error);
                }
            }
        }
        Ok(RunSummary {
            status: ended.status,
            interrupted: ended.interrupted,
            folder: folder.to_owned(),
            steps: ended.steps,
            time: ended.time,
            wall,
            lines,
        })
    }
}

/// Message on what stopped a run, and where: `last` is the last step that was reported, `most_steps` are those of its case.
fn how_it_ended(
    ended: &Ending,
    last: &StepLine,
    (options, most_steps): (&RunOptions, Option<u64>),
    stop: &Stop,
    wall: Real,
) -> String {
    // Before the flow its time and steps are zero.
    let before = ended.status != Status::Finished && !["", "flow"].contains(&last.phase);
    let place = if before {
        let StepLine { phase, step, time, .. } = last;
        format!("in the phase `{phase}` at its step {step}, time {time:.6e} s, after {}", duration(wall))
    } else {
        format!("at step {}, time {:.6e} s, after {}", ended.steps, ended.time, duration(wall))
    };
    match (ended.status, stop.cause(), options.steps) {
        (Status::Finished, _, _) => format!("finished {place}"),
        (_, Some(cause), _) if ended.interrupted => format!("stopped by {cause} {place}; a checkpoint was written"),
        _ if most_steps.is_some_and(|most| ended.steps >= most) => {
            format!("stopped by `run.steps` of the case {place}")
        }
        (_, _, Some(steps)) => format!("stopped after {steps} steps, as asked, {place}"),
        _ => format!("stopped at the time that was asked {place}"),
    }
}

/// The run panicked, soon after it reported its step `last`.
fn broke_off(
    folder: &Path,
    last: &StepLine,
    panic: &(dyn Any + Send),
    options: &RunOptions,
    progress: &mut dyn Progress,
) -> Failure {
    // Ranks say which of them it was, and why.
    let cause = panic.downcast_ref::<RanksFailed>().map_or_else(String::new, |failed| format!("\n{failed}"));
    let mut failure = Failure {
        kind: "panic".into(),
        message: format!(
            "the run broke off: this is a fault of the program, please report it with the case{}",
            cause.trim_end()
        ),
        step: last.step,
        time: last.time,
        limiter: last.limiter.into(),
        ..Failure::default()
    };
    // First what is short: a job that cannot end in good order has seconds left.
    put_failure(folder, &failure, progress);
    failure.checkpoint = checkpoints::last_good(folder);
    report_failure(folder, options, progress);
    failure
}

/// Writes the report on a run that failed, if it left anything that can be shown: what went wrong stands in it.
fn report_failure(folder: &Path, options: &RunOptions, progress: &mut dyn Progress) {
    let Some(report) = options.report else { return };
    let listed = |error: sazanami_io::table::TableError| CommandError::Undone(error.to_string());
    match report(folder).and_then(|path| recorder::put_files(folder).map_err(listed).map(|()| path)) {
        Ok(path) => progress.message(&format!("wrote {}", path.display())),
        Err(problem) => progress.message(&format!("no report was written: {problem}")),
    }
}

/// Puts a failure into the summary of its run, or says that it could not.
fn put_failure(folder: &Path, failure: &Failure, progress: &mut dyn Progress) {
    if let Err(problem) = recorder::put_failure(folder, failure) {
        progress.message(&format!("the failure could not be put into the summary: {problem}"));
    }
}

/// Runs the job on its ranks; the first-hand error of the lowest rank counts.
fn ranks_of(job: &Job) -> Result<Ending, Box<RankFailure>> {
    let Workers { ranks, threads, .. } = job.workers;
    let run_rank = |communicator| simulation::run_rank(communicator, job);
    let outcomes = match &job.options.processes {
        Some(processes) => followers::run(processes, job),
        None if ranks == 1 => return with_threads(threads, || run_rank(Box::<Solo>::default()))?,
        None => run_ranks_with(job.workers.sums(), ranks, threads, run_rank),
    };
    let outcomes = match outcomes {
        Ok(outcomes) => outcomes,
        Err(RanksFailed::Threads(refused)) => return Err(refused.into()),
        Err(failed) => std::panic::resume_unwind(Box::new(failed)),
    };
    let (mut ended, mut secondary) = (None, None);
    let mut first_hand = Vec::new();
    for (rank, outcome) in outcomes.into_iter().enumerate() {
        match outcome {
            Ok(value) => ended = ended.or(Some(value)),
            Err(failed) if failed.is_secondary => secondary = secondary.or(Some(failed)),
            Err(failed) => first_hand.push((rank, failed)),
        }
    }
    // What all ranks found is no matter of one of them.
    let of_all = first_hand.len() == ranks;
    if let Some((rank, mut failed)) = first_hand.into_iter().next() {
        failed.failure.rank = (!of_all).then_some(rank);
        return Err(failed);
    }
    match (secondary, ended) {
        (Some(failed), _) => Err(failed),
        (None, Some(ended)) => Ok(ended),
        (None, None) => unreachable!("a group has at least one rank"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stop::StopCause;

    #[test]
    fn what_stops_a_packing_says_how_far_it_was() {
        let ended = Ending { status: Status::Stopped, interrupted: true, time: 0.0, steps: 0 };
        let last = StepLine { phase: "packing", step: 1234, time: 0.02468, ..StepLine::default() };
        let stop = Stop::new();
        stop.set(StopCause::Interrupt);
        let told = |last: &StepLine| how_it_ended(&ended, last, (&RunOptions::default(), None), &stop, 60.0);
        assert!(told(&last).contains("in the phase `packing` at its step 1234, time 2.468000e-2 s"), "{}", told(&last));
        // Negative control: the flow counts by itself.
        assert!(told(&StepLine { phase: "flow", ..last }).contains("at step 0, time 0.000000e0 s"));
    }
}
