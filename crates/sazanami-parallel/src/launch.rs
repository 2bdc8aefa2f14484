//! Processes that a launcher started together: `mpirun`, `mpiexec`, `srun`.
//!
//! A launcher is recognised by what it puts into the environment; without one nothing of MPI is touched. Rank 0 leads: it
//! alone reads, writes and prints, and gives the others their work over [`Processes::control`].

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;

use crate::collective::{FailedElsewhere, Ranks, Transport};
use crate::in_process::message;
use crate::loops::pool_of;
use crate::{Communicator, RanksFailed, Sums, ThreadsRefused};

/// Time that a rank that failed waits for rank 0 to end the job before it does so itself.
const PATIENCE: Duration = Duration::from_secs(4);

/// A launcher that started this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Launcher {
    /// Environment variable that it is known by.
    pub variable: &'static str,
    /// Number of processes it started, where it says so.
    pub size: Option<usize>,
    /// Number of this one, where it says so.
    pub rank: Option<usize>,
}

/// Variables of launchers with the number of processes and that of this one: Open MPI; MPICH, Intel MPI and others with
/// the process management interface; a step of Slurm (not its batch script); PMIx.
const KNOWN: [[&str; 2]; 4] = [
    ["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"],
    ["PMI_SIZE", "PMI_RANK"],
    ["SLURM_STEP_NUM_TASKS", "SLURM_PROCID"],
    ["PMIX_NAMESPACE", "PMIX_RANK"],
];

impl Launcher {
    /// The launcher of this process, if there is one.
    #[must_use]
    pub fn seen() -> Option<Self> {
        Self::within(|name| std::env::var(name).ok())
    }

    fn within(environment: impl Fn(&str) -> Option<String>) -> Option<Self> {
        let number = |name: &str| environment(name)?.parse().ok();
        KNOWN.into_iter().find_map(|[size, rank]| {
            environment(size).map(|_| Self { variable: size, size: number(size), rank: number(rank) })
        })
    }
}

impl std::fmt::Display for Launcher {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.size {
            Some(size) => write!(formatter, "a launcher of {size} processes ({})", self.variable),
            None => write!(formatter, "a launcher ({})", self.variable),
        }
    }
}

/// The processes that a launcher started cannot work together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JoinError {
    /// This program was built without MPI.
    NotBuiltIn(Launcher),
    /// The MPI that the program was built with knows of other processes than the launcher.
    OtherWorld {
        /// Launcher that started the program.
        launcher: Launcher,
        /// Number of processes that MPI knows of.
        size: usize,
        /// Number of this one among them.
        rank: usize,
        /// Name and version of the MPI library.
        library: String,
    },
    /// MPI does not start.
    NotStarted(String),
}

impl JoinError {
    /// Suggestion to the user.
    #[must_use]
    pub const fn help(&self) -> &'static str {
        match self {
            Self::NotBuiltIn(_) => {
                "build it with `--features mpi`, or run it without a launcher: `--ranks` cuts the box within one process"
            }
            Self::OtherWorld { .. } => {
                "start it with the launcher of that MPI, or build it with the MPI of this launcher"
            }
            Self::NotStarted(_) => "look whether the launcher and the MPI library belong together",
        }
    }
}

impl std::fmt::Display for JoinError {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotBuiltIn(launcher) => {
                write!(
                    formatter,
                    "{launcher} started this program, which was built without MPI: each of its processes \
                                   would run the whole case"
                )
            }
            Self::OtherWorld { launcher, size, rank, library } => {
                write!(formatter, "{launcher} started this program")?;
                if let Some(number) = launcher.rank {
                    write!(formatter, " as process {number}")?;
                }
                write!(formatter, ", but to its MPI, {library}, it is process {rank} of {size}")
            }
            Self::NotStarted(reason) => write!(formatter, "MPI does not start: {reason}"),
        }
    }
}

impl std::error::Error for JoinError {}

/// Services of a launcher to its processes beside the exchange of messages.
pub trait Session: Send + Sync {
    /// Messages apart from all others, the physics' or those of [`Processes::control`]; asked for once of each for a run.
    fn transport(&self, control: bool) -> Box<dyn Transport>;
    /// Lets the other ranks know that this one has failed: their waits end by unwinding.
    fn fail(&self, reason: &str);
    /// Rank and reason of a failure that this rank has been told of; there is one when a wait has ended without its message.
    fn failure(&self) -> Option<(usize, String)>;
    /// Ends all processes.
    fn abort(&self, code: u8) -> !;
    /// Name and version of the library.
    fn library(&self) -> String;
    /// Name of the machine that this process runs on.
    fn host(&self) -> String;
}

impl Transport for Box<dyn Transport> {
    fn rank(&self) -> usize {
        (**self).rank()
    }

    fn size(&self) -> usize {
        (**self).size()
    }

    fn send(&self, to: usize, tag: u32, bytes: &[u8]) {
        (**self).send(to, tag, bytes);
    }

    fn receive(&self, from: usize, tag: u32, into: &mut Vec<u8>) -> bool {
        (**self).receive(from, tag, into)
    }
}

struct Joined {
    session: Arc<dyn Session>,
    control: Ranks<Box<dyn Transport>>,
}

/// The processes that a launcher started together, as one of them sees them.
#[derive(Clone)]
pub struct Processes(Arc<Joined>);

impl std::fmt::Debug for Processes {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "rank {} of {} ({})", self.rank(), self.size(), self.library())
    }
}

impl Processes {
    /// The processes of a session.
    #[must_use]
    pub fn of(session: Arc<dyn Session>) -> Self {
        let control = Ranks::new(session.transport(true), Sums::Ordered);
        Self(Arc::new(Joined { session, control }))
    }

    /// Number of this process, from 0.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.control().rank()
    }

    /// Number of processes.
    #[must_use]
    pub fn size(&self) -> usize {
        self.control().size()
    }

    /// Name and version of the MPI library.
    #[must_use]
    pub fn library(&self) -> String {
        self.0.session.library()
    }

    /// Name of the machine that this process runs on.
    #[must_use]
    pub fn host(&self) -> String {
        self.0.session.host()
    }

    /// Messages about the work, apart from those of the work itself.
    #[must_use]
    pub fn control(&self) -> &dyn Communicator {
        &self.0.control
    }

    /// Runs `program` on this rank with `threads` threads. All ranks have to call it.
    ///
    /// # Errors
    /// [`RanksFailed`], on all ranks and before `program` begins, if one is refused its threads; or if a rank, this or
    /// another one, panics. After a panic the ranks cannot go on together: rank 0 has to say what happened and
    /// [`Self::abort`] the job; the others wait for that.
    pub fn run<T: Send>(
        &self,
        threads: usize,
        sums: Sums,
        program: impl FnOnce(Box<dyn Communicator>) -> T + Send,
    ) -> Result<T, RanksFailed> {
        let outcome = self.guarded(|| {
            let pool = pool_of(threads);
            self.all_have(threads, pool.as_ref().err())?;
            let communicator = Box::new(Ranks::new(self.0.session.transport(false), sums));
            Ok(pool?.install(|| program(communicator)))
        })?;
        outcome.map_err(RanksFailed::Threads)
    }

    /// Tells all ranks whether this one was refused its threads, and returns the first refusal.
    fn all_have(&self, threads: usize, own: Option<&ThreadsRefused>) -> Result<(), ThreadsRefused> {
        let mut all = Vec::new();
        self.control().all_gather(own.map_or("", ThreadsRefused::reason).as_bytes(), &mut all);
        match all.iter().position(|reason| !reason.is_empty()) {
            None => Ok(()),
            Some(rank) => Err(ThreadsRefused::on_rank(rank, threads, String::from_utf8_lossy(&all[rank]).into_owned())),
        }
    }

    /// Does `work`, and lets the other ranks know if it panics.
    ///
    /// # Errors
    /// On rank 0, if a rank panics; see [`Self::run`].
    pub fn guarded<T>(&self, work: impl FnOnce() -> T) -> Result<T, RanksFailed> {
        match catch_unwind(AssertUnwindSafe(work)) {
            Ok(value) => Ok(value),
            Err(payload) => {
                let own = (!payload.is::<FailedElsewhere>()).then(|| (self.rank(), message(payload.as_ref())));
                if let Some((_, reason)) = &own {
                    self.0.session.fail(reason);
                }
                if self.rank() > 0 {
                    std::thread::sleep(PATIENCE);
                    self.abort(1);
                }
                Err(RanksFailed::Panicked(own.or_else(|| self.0.session.failure()).into_iter().collect()))
            }
        }
    }

    /// Whether a rank has panicked, so that the ranks cannot end in good order.
    #[must_use]
    pub fn have_failed(&self) -> bool {
        self.0.session.failure().is_some()
    }

    /// Ends the processes of all ranks at once; the job ends with `code`.
    pub fn abort(&self, code: u8) -> ! {
        self.0.session.abort(code)
    }
}

/// The processes of a launcher from their meeting to their end: dropped last, by the main thread.
pub struct World {
    processes: Processes,
    /// Ends the library when it is dropped.
    _library: Box<dyn std::any::Any>,
}

impl World {
    /// `processes`, and what ends their library when it is dropped.
    #[must_use]
    pub fn new(processes: Processes, library: Box<dyn std::any::Any>) -> Self {
        Self { processes, _library: library }
    }

    /// The processes of the launcher, this one among them.
    #[must_use]
    pub const fn processes(&self) -> &Processes {
        &self.processes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launchers_are_known_by_their_environment() {
        let within = |set: &[(&str, &str)]| {
            Launcher::within(|name| set.iter().find(|(set, _)| *set == name).map(|(_, value)| (*value).to_owned()))
        };
        let found = within(&[("OMPI_COMM_WORLD_SIZE", "8"), ("OMPI_COMM_WORLD_RANK", "3")]).unwrap();
        assert_eq!((found.size, found.rank), (Some(8), Some(3)));
        assert_eq!(within(&[("PMI_SIZE", "2")]).unwrap().size, Some(2));
        assert_eq!(within(&[("PMIX_NAMESPACE", "job"), ("PMIX_RANK", "1")]).unwrap().rank, Some(1));
        assert!(within(&[("SLURM_STEP_NUM_TASKS", "4"), ("SLURM_PROCID", "0")]).is_some());
        // The batch script of Slurm runs once, whatever the job will start.
        assert_eq!(within(&[("SLURM_PROCID", "0"), ("SLURM_NTASKS", "4")]), None);
        assert_eq!(within(&[("PATH", "/bin")]), None);
    }
}
