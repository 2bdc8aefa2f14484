//! A run on the processes that a launcher started. Rank 0 leads: it reads, decides, writes and prints. The others follow its
//! orders, and know of files what it sends them.

use std::path::{Path, PathBuf};
use std::sync::mpsc;

use sazanami_io::checkpoint::{CheckpointReader, CheckpointWriter};
use sazanami_numerics::Real;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_parallel::{Processes, RanksFailed};
use sazanami_posing::feasible;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::case::meaning::{Case, Solver};
use crate::case::{self, LoadedCase};
use crate::error::CommandError;
use crate::job::{Ending, Job, Program, RUN_STATE, RankFailure, Reporter, Resumed, RunOptions, Workers};
use crate::machine::{self, Machine};
use crate::results::{self, CASE};
use crate::simulation;
use crate::stop::Stop;

/// Order of rank 0 to the others.
#[derive(Debug, Serialize, Deserialize)]
enum Order {
    /// Say what you are, and whether you were started alike.
    Muster(Command),
    /// Get ready for a run, and then run.
    Run(Box<RunOrder>),
    /// Do what the command line does beside runs.
    Work(String),
    /// The command is done: end.
    End,
}

/// Program, arguments and case file that a process was started with.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Command {
    program: Program,
    /// Arguments of the command line.
    arguments: Vec<String>,
    /// The case file, and the hash of its text.
    case: Option<(PathBuf, u64)>,
}

/// Host, processors and objection of a process.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Present {
    host: String,
    /// Processors that it may use, by their numbers where the system tells them.
    processors: String,
    /// Their number.
    cores: usize,
    /// In what it differs from rank 0.
    objection: Option<String>,
}

/// All that a rank needs to know of a run; the files follow.
#[derive(Debug, Serialize, Deserialize)]
struct RunOrder {
    /// Names of the files relative to a folder of the follower's own, and their lengths \[bytes].
    files: Vec<(PathBuf, usize)>,
    folder: PathBuf,
    until: Option<Real>,
    steps: Option<u64>,
    workers: Workers,
    packing_time: Option<Real>,
}

/// File with the state that a run goes on from, and with a tank that was prepared.
const STATE: &str = "state";
const TANK: &str = "tank";

impl Command {
    /// The command that started this process.
    fn of_this(options: &RunOptions, case: Option<(PathBuf, u64)>) -> Self {
        let arguments = std::env::args_os().skip(1).map(|text| text.to_string_lossy().into_owned()).collect();
        Self { program: Program::this(options), arguments, case }
    }

    /// Reason why this process cannot follow that command of rank 0. A case file that it does not see is no hindrance:
    /// rank 0 sends it.
    fn objection(&self, options: &RunOptions) -> Option<String> {
        let own = Self::of_this(options, None);
        if own.program != self.program {
            return Some(format!("is {}, not {}", own.program, self.program));
        }
        if own.arguments != self.arguments {
            return Some(format!("was started with other arguments: `{}`", own.arguments.join(" ")));
        }
        if let Err(error) = tempfile::tempdir() {
            return Some(format!("has no place for temporary files: {error}"));
        }
        let (path, hash) = self.case.as_ref()?;
        let text = std::fs::read(path).ok()?;
        (xxhash_rust::xxh3::xxh3_64(&text) != *hash).then(|| {
            format!("sees another case file at `{}`", std::path::absolute(path).as_ref().unwrap_or(path).display())
        })
    }
}

impl Present {
    fn this(processes: &Processes, objection: Option<String>) -> Self {
        let cores = Machine::this().cores;
        Self { host: processes.host(), processors: machine::processors_allowed(), cores, objection }
    }
}

fn to_bytes(value: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(value).expect("orders and answers have a binary form")
}

fn from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> T {
    postcard::from_bytes(bytes).expect("all processes are of one program")
}

/// Gives an order, on rank 0.
fn tell(processes: &Processes, order: &Order) {
    processes.control().broadcast(&mut to_bytes(order));
}

/// The answers of all ranks, each on all.
fn answers<T: Serialize + DeserializeOwned>(processes: &Processes, own: &T) -> Vec<T> {
    let mut all = Vec::new();
    processes.control().all_gather(&to_bytes(own), &mut all);
    all.iter().map(|bytes| from_bytes(bytes)).collect()
}

/// Lets the other ranks end, on rank 0.
pub fn dismiss(processes: &Processes) {
    tell(processes, &Order::End);
}

/// Lets the other ranks do work that the command line knows by this text, on rank 0.
pub fn order_work(processes: &Processes, work: &str) {
    tell(processes, &Order::Work(work.to_owned()));
}

/// Gives the other ranks work, does this rank's own, and takes their answers, by rank, without one of rank 0.
pub fn share_work<T: DeserializeOwned, O>(processes: &Processes, work: &str, own: impl FnOnce() -> O) -> (O, Vec<T>) {
    order_work(processes, work);
    let own = own();
    let mut all = Vec::new();
    processes.control().all_gather(&[], &mut all);
    (own, all[1..].iter().map(|bytes| from_bytes(bytes)).collect())
}

/// Answers the order of [`share_work`].
pub fn answer_work(processes: &Processes, answer: &impl Serialize) {
    processes.control().all_gather(&to_bytes(answer), &mut Vec::new());
}

/// Threads and ranks of a run on these processes, if they can do it; `loaded` is the case they are started for.
pub(crate) fn muster(
    processes: &Processes,
    loaded: Option<&LoadedCase>,
    options: &RunOptions,
) -> Result<Workers, CommandError> {
    let hash = |loaded: &LoadedCase| xxhash_rust::xxh3::xxh3_64(loaded.source.text().as_bytes());
    let command = Command::of_this(options, loaded.map(|loaded| (loaded.path.clone(), hash(loaded))));
    tell(processes, &Order::Muster(command));
    let present = answers(processes, &Present::this(processes, None));
    for (rank, Present { host, objection, .. }) in present.iter().enumerate() {
        if let Some(objection) = objection {
            return Err(CommandError::input(
                format!("rank {rank} on {host} {objection}"),
                "start all ranks with one command of one program, on one case file; `TMPDIR` names a place for temporary files",
            ));
        }
    }
    let sharing = |of: &Present| {
        present.iter().filter(|other| other.host == of.host && other.processors == of.processors).count()
    };
    let fair = present.iter().map(|rank| rank.cores / sharing(rank)).min().unwrap_or(1).max(1);
    let threads = options.threads.unwrap_or(fair);
    if let Some((rank, of)) = present.iter().enumerate().find(|(_, of)| of.cores < threads) {
        return Err(CommandError::input(
            format!(
                "{threads} threads a rank are asked for, but rank {rank} on {} is bound to {} processor{}",
                of.host,
                of.cores,
                if of.cores == 1 { "" } else { "s" }
            ),
            "let the launcher bind each rank to as many as it has threads (Open MPI: `--map-by slot:PE=N`; \
             Slurm: `--cpus-per-task=N`) or to none (`--bind-to none`), or give fewer `--threads`",
        ));
    }
    let hosts = present.into_iter().map(|rank| rank.host).collect();
    Ok(Workers {
        ranks: processes.size(),
        threads,
        sums: options.sums().word().to_owned(),
        hosts,
        mpi: Some(processes.library()),
    })
}

/// Sends the other ranks what they need for `job`, on rank 0, and waits until they are ready.
pub(crate) fn get_ready(processes: &Processes, job: &Job) -> Result<(), CommandError> {
    let mut files = inputs(job)?;
    if let Some(Resumed { snapshot, .. }) = &job.resumed {
        let of_cells = |name: &str| job.case.solver == Solver::Mics && sazanami_mics::snapshot::is_of_cells(name);
        let mut needed = Snapshot::default();
        let sections = snapshot.sections().filter(|(name, _)| !of_cells(name));
        sections.for_each(|(name, section)| needed.put(name, section.clone()));
        let mut writer = CheckpointWriter::new();
        writer.add_snapshot(&needed).map_err(unsent)?;
        files.push((STATE.into(), writer.to_bytes()));
    }
    if let Some(tank) = &job.prepared {
        let mut writer = CheckpointWriter::new();
        writer.add_snapshot(tank).map_err(unsent)?;
        files.push((TANK.into(), writer.to_bytes()));
    }
    let order = RunOrder {
        files: files.iter().map(|(name, bytes)| (name.clone(), bytes.len())).collect(),
        folder: job.folder.clone(),
        until: job.options.until,
        steps: job.options.steps,
        workers: job.workers.clone(),
        packing_time: job.packing_time,
    };
    tell(processes, &Order::Run(Box::new(order)));
    for (_, mut bytes) in files {
        processes.control().broadcast(&mut bytes);
    }
    match readiness(processes, Ok(())) {
        None => Ok(()),
        Some((rank, reason)) => Err(CommandError::input(
            format!("rank {rank} cannot take part: {reason}"),
            "look at the machine it runs on: its memory, its temporary files",
        )),
    }
}

fn unsent(error: impl std::fmt::Display) -> CommandError {
    CommandError::Undone(format!("the other ranks cannot be sent their part: {error}"))
}

/// The case and the files that it names, as they lie in the folder of results.
fn inputs(job: &Job) -> Result<Vec<(PathBuf, Vec<u8>)>, CommandError> {
    let path = job.folder.join(CASE);
    let text = match &job.case_text {
        Some(text) => text.clone(),
        None => std::fs::read_to_string(&path).map_err(unsent)?,
    };
    let mut case = case::parse(&path, &text, &[])?.case;
    let state = case.preparation.state.clone();
    let mut files = vec![(PathBuf::from(CASE), text.into_bytes())];
    for file in results::inputs_of(&mut case) {
        // A tank that was prepared is sent as it was read; its file only has to be there.
        let bytes = if state.as_ref() == Some(&file) { Ok(Vec::new()) } else { std::fs::read(&file) };
        // What lies elsewhere is not needed to run; beds may be gone once their grains have moved.
        if let (Ok(name), Ok(bytes)) = (file.strip_prefix(&job.folder), bytes) {
            files.push((name.to_owned(), bytes));
        }
    }
    Ok(files)
}

/// The first rank that is not ready, with the reason; known to all.
fn readiness(processes: &Processes, own: Result<(), String>) -> Option<(usize, String)> {
    let all: Vec<Option<String>> = answers(processes, &own.err());
    all.into_iter().enumerate().find_map(|(rank, reason)| Some((rank, reason?)))
}

/// End of a run on each rank, or the failure that broke off all.
type Outcomes = Result<Vec<Result<Ending, Box<RankFailure>>>, RanksFailed>;

/// Runs this rank's part of `job`, for which all have got ready. The outcomes of all come by rank.
pub(crate) fn run(processes: &Processes, job: &Job) -> Outcomes {
    let work = |communicator| simulation::run_rank(communicator, job);
    let own = processes.run(job.workers.threads, job.workers.sums(), work)?;
    Ok(answers(processes, &own))
}

/// Follows the orders of rank 0 until it gives the last one. `work` does what
/// [`order_work`] names; `options` are those that all ranks share by their program.
pub fn follow(processes: &Processes, options: &RunOptions, stop: &Stop, mut work: impl FnMut(&str)) {
    loop {
        let mut bytes = Vec::new();
        processes.control().broadcast(&mut bytes);
        match from_bytes(&bytes) {
            Order::Muster(command) => {
                drop(answers(processes, &Present::this(processes, command.objection(options))));
            }
            Order::Run(order) => follow_run(processes, &order, options, stop),
            Order::Work(text) => work(&text),
            Order::End => return,
        }
    }
}

/// Case, shapes, beds and state that a follower has got ready for a run.
struct Ready {
    case: Case,
    shapes: Vec<sazanami_numerics::geometry::Shape>,
    beds: Vec<Option<crate::bed_file::Bed>>,
    resumed: Option<Resumed>,
    prepared: Option<Snapshot>,
}

/// Runs a follower's part of a run.
fn follow_run(processes: &Processes, order: &RunOrder, options: &RunOptions, stop: &Stop) {
    let files: Vec<(&Path, Vec<u8>)> = order
        .files
        .iter()
        .map(|(name, length)| {
            let mut bytes = Vec::with_capacity(*length);
            processes.control().broadcast(&mut bytes);
            (name.as_path(), bytes)
        })
        .collect();
    let ready = unpack(&files);
    drop(files);
    let refused = readiness(processes, ready.as_ref().map(drop).map_err(Clone::clone));
    let (Ok(ready), None) = (ready, refused) else { return };
    let Ready { case, shapes, beds, resumed, prepared } = ready;
    let options = RunOptions { until: order.until, steps: order.steps, ..options.clone() };
    let job = Job {
        case: &case,
        case_text: None,
        shapes: shapes.into(),
        beds,
        // Rank 0 keeps the tank.
        files: Vec::new(),
        options: &options,
        folder: order.folder.clone(),
        prepared,
        resumed,
        // Nobody listens to a follower.
        reporter: Reporter(mpsc::sync_channel(0).0),
        stop,
        workers: order.workers.clone(),
        packing_time: order.packing_time,
    };
    // What went wrong here, rank 0 says.
    drop(run(processes, &job));
}

/// Puts files where only this process has them, and reads them from there as any run reads its own.
fn unpack(files: &[(&Path, Vec<u8>)]) -> Result<Ready, String> {
    let place = tempfile::tempdir().map_err(|error| format!("no place for its files: {error}"))?;
    for (name, bytes) in files {
        let path = place.path().join(name);
        let written =
            std::fs::create_dir_all(path.parent().unwrap_or(place.path())).and_then(|()| std::fs::write(&path, bytes));
        written.map_err(|error| format!("{}: {error}", path.display()))?;
    }
    let loaded = case::load(&place.path().join(CASE), &[]).map_err(|error| error.to_string())?;
    let read = |name: &str| {
        let path = place.path().join(name);
        path.is_file().then(|| CheckpointReader::open(&path)).transpose().map_err(|error| error.to_string())
    };
    let resumed = match read(STATE)? {
        Some(reader) => Some(Resumed {
            run: reader.get_json(RUN_STATE).map_err(|error| error.to_string())?,
            snapshot: reader.snapshot().map_err(|error| error.to_string())?,
        }),
        None => None,
    };
    let prepared = match read(TANK)? {
        Some(reader) => Some(reader.snapshot().map_err(|error| error.to_string())?),
        None => None,
    };
    // Once the grains lie where they are put nobody needs the beds any more.
    let begins = resumed.as_ref().is_none_or(|state: &Resumed| state.run.packing);
    let (shapes, beds) = feasible::shapes_and_beds(&loaded, begins).map_err(|error| error.to_string())?;
    Ok(Ready { case: loaded.case, shapes, beds, resumed, prepared })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Failure;

    #[test]
    fn answers_keep_the_bits_of_numbers() {
        for time in [Real::NAN, Real::INFINITY, -0.0, 0.1 + 0.2, Real::MIN_POSITIVE / 3.0] {
            let failure = Failure { time, rank: Some(3), ..Failure::default() };
            let back: Failure = from_bytes(&to_bytes(&failure));
            assert_eq!((back.time.to_bits(), back.rank), (time.to_bits(), Some(3)));
        }
    }

    #[test]
    fn ranks_of_another_program_or_with_other_arguments_object() {
        let options = RunOptions::default();
        let command = Command::of_this(&options, None);
        assert_eq!(command.objection(&options), None);
        let other = RunOptions { commit: Some("another"), ..RunOptions::default() };
        assert!(command.objection(&other).is_some_and(|text| text.contains("(another), not")));
        let changed = Command { arguments: vec!["run".into()], ..Command::of_this(&options, None) };
        assert!(changed.objection(&options).is_some_and(|text| text.contains("other arguments")));
    }
}
