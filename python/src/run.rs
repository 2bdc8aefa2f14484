//! Runs: on a thread of their own, which never waits for the interpreter.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use sazanami::error::CommandError;
use sazanami::progress::{Progress, StepLine};
use sazanami::run::{RunOptions, RunSummary, Status, resume, run};
use sazanami::state::{Every, Onlooker, Showing, State};
use sazanami::stop::{Stop, StopCause};
use sazanami_picture::Painter;

use crate::case::CaseCore;
use crate::errors::{broken, raised, words};
use crate::state;

/// What a run said that nobody has heard yet.
#[derive(Default)]
struct News {
    line: Option<StepLine>,
    messages: Vec<String>,
}

#[derive(Default)]
struct Shared {
    stop: Stop,
    news: Mutex<News>,
}

impl Shared {
    fn news(&self) -> MutexGuard<'_, News> {
        self.news.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Keeps the last step and all messages until they are asked for.
struct Listener(Arc<Shared>);

impl Progress for Listener {
    fn step(&mut self, line: &StepLine) {
        self.0.news().line = Some(*line);
    }

    fn message(&mut self, text: &str) {
        self.0.news().messages.push(text.to_owned());
    }
}

/// Hands on states one by one; the run waits until each is taken, or nobody wants any more.
#[derive(Debug)]
struct Handover(Mutex<SyncSender<State>>);

impl Onlooker for Handover {
    fn see(&self, state: State) {
        let sender = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // An error means that nobody looks any more: the run goes on to its end, or to where it is stopped.
        let _ = sender.send(state);
    }
}

type Outcome = Result<RunSummary, CommandError>;

/// A run that has begun.
#[pyclass(frozen, module = "sazanami._engine")]
pub struct RunCore {
    shared: Arc<Shared>,
    states: Mutex<Option<Receiver<State>>>,
    thread: Mutex<Option<JoinHandle<Outcome>>>,
    /// What came of it, or what its panic said: told to everyone who waits.
    ended: OnceLock<Result<Outcome, String>>,
}

/// What begins or goes on.
enum Begin {
    Case(Box<CaseCore>),
    Folder(PathBuf),
}

#[pymethods]
impl RunCore {
    /// Begins a run of `case`, or goes on with the one in `folder` if there is no case. States are shown after so many steps,
    /// or so much time.
    #[staticmethod]
    #[pyo3(signature = (case, *, folder, force, until, steps, threads, ranks, pictures, report, every_steps, every_time))]
    #[allow(clippy::too_many_arguments, reason = "the options of a run, by keyword")]
    fn begin(
        py: Python<'_>,
        case: Option<&CaseCore>,
        folder: Option<PathBuf>,
        force: bool,
        until: Option<f64>,
        steps: Option<u64>,
        threads: Option<usize>,
        ranks: usize,
        pictures: bool,
        report: bool,
        every_steps: Option<u64>,
        every_time: Option<f64>,
    ) -> PyResult<Self> {
        let shared = Arc::new(Shared::default());
        let (sender, states) = sync_channel(0);
        let every = every_steps.map(Every::Steps).or(every_time.map(Every::Time));
        let begin = match (case, &folder) {
            (Some(case), _) => Begin::Case(Box::new(case.clone())),
            (None, Some(folder)) => Begin::Folder(folder.clone()),
            (None, None) => return Err(broken(py, "neither a case nor a folder is given")),
        };
        let options = RunOptions {
            out: folder,
            force,
            until,
            steps,
            threads,
            ranks,
            commit: option_env!("SAZANAMI_COMMIT"),
            artist: if pictures { Some(&Painter) } else { None },
            report: if report { Some(sazanami_report::at_the_end) } else { None },
            showing: every.map(|every| Showing { every, to: Arc::new(Handover(Mutex::new(sender.clone()))) }),
            ..RunOptions::default()
        };
        let heard = Arc::clone(&shared);
        let work = move || {
            // The last sender goes when the run ends: then nobody waits for states any more.
            let _sender = sender;
            let mut listener = Listener(Arc::clone(&heard));
            match begin {
                Begin::Case(case) => run(&case.loaded, &options, &mut listener, &heard.stop),
                Begin::Folder(folder) => resume(&folder, &options, &mut listener, &heard.stop),
            }
        };
        let thread = std::thread::spawn(work);
        Ok(Self { shared, states: Mutex::new(Some(states)), thread: Mutex::new(Some(thread)), ended: OnceLock::new() })
    }

    /// Waits for a state or for the end, at most so many seconds: `("state", dict)`, `("ended", dict)`, or nothing. Signals are
    /// looked after.
    fn wait<'py>(&self, py: Python<'py>, seconds: f64) -> PyResult<Option<(&'static str, Bound<'py, PyDict>)>> {
        py.check_signals()?;
        let found = py.detach(|| {
            let states = self.states.lock().unwrap_or_else(PoisonError::into_inner);
            match states.as_ref() {
                Some(states) => states.recv_timeout(Duration::from_secs_f64(seconds.clamp(0.0, 3600.0))),
                None => Err(RecvTimeoutError::Disconnected),
            }
        });
        match found {
            Ok(found) => Ok(Some(("state", state::to_python(py, found)?))),
            Err(RecvTimeoutError::Timeout) => py.check_signals().map(|()| None),
            Err(RecvTimeoutError::Disconnected) => self.ended(py).map(|summary| Some(("ended", summary))),
        }
    }

    /// The last step, if there was one since this was asked, and what was said.
    fn news<'py>(&self, py: Python<'py>) -> PyResult<(Option<Bound<'py, PyDict>>, Vec<String>)> {
        let News { line, messages } = std::mem::take(&mut *self.shared.news());
        let line = line.map(|line| step(py, &line)).transpose()?;
        Ok((line, messages))
    }

    /// Asks the run to write a checkpoint and to end.
    fn stop(&self, by_interrupt: bool) {
        self.shared.stop.set(if by_interrupt { StopCause::Interrupt } else { StopCause::Caller });
    }
}

impl RunCore {
    /// Waits for the thread and tells what came of the run, as often as it is asked for.
    fn ended<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let joined = || {
            let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
            let thread = thread.ok_or_else(|| "a run has no thread".to_owned())?;
            thread.join().map_err(|panic| words(panic.as_ref()))
        };
        match py.detach(|| self.ended.get_or_init(joined)) {
            Ok(Ok(summary)) => told(py, summary),
            Ok(Err(error)) => Err(raised(py, error)),
            Err(panic) => Err(broken(py, panic)),
        }
    }
}

impl Drop for RunCore {
    /// Nobody can ask for the run any more: it writes a checkpoint and ends. Its thread needs no interpreter for that.
    fn drop(&mut self) {
        self.shared.stop.set(StopCause::Caller);
        drop(self.states.lock().unwrap_or_else(PoisonError::into_inner).take());
        if let Some(thread) = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take() {
            let _ = thread.join();
        }
    }
}

fn told<'py>(py: Python<'py>, summary: &RunSummary) -> PyResult<Bound<'py, PyDict>> {
    let status = match summary.status {
        Status::Running => "running",
        Status::Finished => "finished",
        Status::Stopped => "stopped",
        Status::Failed => "failed",
    };
    let found = PyDict::new(py);
    found.set_item("status", status)?;
    found.set_item("interrupted", summary.interrupted)?;
    found.set_item("folder", &summary.folder)?;
    found.set_item("steps", summary.steps)?;
    found.set_item("time", summary.time)?;
    found.set_item("wall", summary.wall)?;
    found.set_item("lines", &summary.lines)?;
    Ok(found)
}

fn step<'py>(py: Python<'py>, line: &StepLine) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("phase", line.phase)?;
    found.set_item("step", line.step)?;
    found.set_item("time", line.time)?;
    found.set_item("until", line.until)?;
    found.set_item("dt", line.dt)?;
    found.set_item("limiter", line.limiter)?;
    found.set_item("pressure_iterations", line.pressure_iterations)?;
    found.set_item("substeps", line.substeps)?;
    found.set_item("contacts", line.contacts)?;
    found.set_item("remaining", line.remaining)?;
    found.set_item("fraction", line.fraction())?;
    found.set_item("text", line.short())?;
    Ok(found)
}
