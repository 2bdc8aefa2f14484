//! Runs of small cases into folders of their own, and what they left behind.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use sazanami::artist::{Artist, Figure, NotDrawn};
use sazanami::case::meaning::Case;
use sazanami::case::{self, LoadedCase};
use sazanami::check::{self, CheckReport, CostModel, Known};
use sazanami::error::{CommandError, exit};
use sazanami::feasible;
use sazanami::machine::Machine;
use sazanami::progress::{Progress, StepLine};
use sazanami::run::{self, RunOptions, RunSummary, Status};
use sazanami::stop::{Stop, StopCause};
use sazanami_io::bed::{Bed, BedGrain, Recipe};
use sazanami_io::checkpoint::{CheckpointFolder, CheckpointReader};
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Quaternion, Real, Vector};
use serde_json::Value;

/// A folder that goes when it is no longer needed.
pub struct Scratch(PathBuf);

impl Scratch {
    pub fn new(name: &str) -> Self {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}-{number}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("the run left it");
        Self(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    pub fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Messages and steps of a run, and the step at which to stop it from outside.
#[derive(Default)]
pub struct Listener<'a> {
    pub messages: Vec<String>,
    pub lines: Vec<StepLine>,
    /// Set after the step for which `stop_after` says so.
    pub stop: Option<&'a Stop>,
    pub stop_after: Option<fn(&StepLine) -> bool>,
}

impl Progress for Listener<'_> {
    fn step(&mut self, line: &StepLine) {
        self.lines.push(*line);
        if let (Some(stop), Some(after)) = (self.stop, self.stop_after)
            && after(line)
        {
            stop.set(StopCause::Caller);
        }
    }

    fn message(&mut self, text: &str) {
        self.messages.push(text.to_owned());
    }
}

/// Keeps what a picture would show as text.
#[derive(Debug)]
pub struct Sketcher;

impl Artist for Sketcher {
    fn draw(&self, figure: &Figure, path: &Path) -> Result<(), NotDrawn> {
        Ok(std::fs::write(path, format!("{figure:?}"))?)
    }
}

/// Values of keys as the readers of cases take them.
pub fn owned(overrides: &[&str]) -> Vec<String> {
    overrides.iter().map(|text| (*text).to_owned()).collect()
}

/// Titles of what is wrong with a case, or of its warnings where nothing is.
pub fn findings(text: &str, overrides: &[&str]) -> Vec<String> {
    let (diagnostics, source) = match case::parse(Path::new("case.toml"), text, &owned(overrides)) {
        Ok(loaded) => (loaded.warnings, loaded.source),
        Err(error) => (error.diagnostics, error.source),
    };
    diagnostics.records(&source).iter().map(|record| record.message.clone()).collect()
}

/// The message on a case that is wrong.
pub fn refusal(text: &str, overrides: &[&str]) -> String {
    let error = case::parse(Path::new("case.toml"), text, &owned(overrides)).expect_err("the case is wrong");
    let error = CommandError::from(error);
    assert_eq!(error.exit_code(), exit::WRONG_INPUT);
    error.to_string()
}

/// Reads a case.
pub fn load(text: &str, overrides: &[&str]) -> LoadedCase {
    case::parse(Path::new("case.toml"), text, &owned(overrides)).unwrap_or_else(|error| panic!("{error}"))
}

/// Whether a case can run on `machine`, and the titles of what is wrong or warned of before it does.
pub fn before_run(loaded: &LoadedCase, machine: &Machine) -> (bool, Vec<String>) {
    let (runs, found) = match feasible::check(loaded, machine, &CostModel::default()) {
        Ok(feasible) => (true, feasible.warnings),
        Err(error) => (false, error.diagnostics),
    };
    (runs, found.records(&loaded.source).into_iter().map(|record| record.message).collect())
}

/// What `check` foretells of a case.
pub fn foretold(case: &Case) -> CheckReport {
    check::check(case, Known::default(), &Machine::this(), 1, &CostModel::default())
}

/// The only population of a case, balls of 1 mm from a bed file, as an override; the file is written with as many layers of them side by side
/// in a box of this `size` \[mm].
pub fn bed_of_balls(path: &Path, size: [u32; 3], layers: u32) -> String {
    let [n1, n2, _] = size;
    let place =
        |n: u32| 1e-3 * (0.5 + Vector::new(f64::from(n % n1), f64::from(n / n1 % n2), f64::from(n / (n1 * n2))));
    let lying =
        |n: u32| BedGrain { shape: 0, scale: 1.0, position: place(n), orientation: Quaternion::IDENTITY, held: false };
    let bed = Bed {
        lower: Vector::ZERO,
        upper: 1e-3 * Vector::from_array(size.map(f64::from)),
        recipe: Recipe { shapes: vec!["balls".into()], ..Recipe::default() },
        grains: (0..n1 * n2 * layers).map(lying).collect(),
    };
    bed.write(path).unwrap_or_else(|error| panic!("{error}"));
    let file = path.display();
    format!(
        "grains.0={{ shape = {{ sphere = {{ diameter = \"1 mm\" }} }}, placement = {{ bed = {{ file = \"{file}\" }} }} }}"
    )
}

/// On how many ranks and threads, and for how many steps.
#[derive(Clone, Copy, Debug)]
pub struct On {
    pub ranks: usize,
    pub threads: usize,
    pub steps: Option<u64>,
}

impl On {
    pub fn threads(threads: usize) -> Self {
        Self { ranks: 1, threads, steps: None }
    }

    pub fn ranks(ranks: usize, threads: usize) -> Self {
        Self { ranks, threads, steps: None }
    }

    pub fn steps(self, steps: u64) -> Self {
        Self { steps: Some(steps), ..self }
    }

    pub fn options(self, out: Option<&Path>) -> RunOptions {
        RunOptions {
            out: out.map(Path::to_owned),
            force: false,
            until: None,
            steps: self.steps,
            threads: Some(self.threads),
            ranks: self.ranks,
            artist: Some(&Sketcher),
            ..RunOptions::default()
        }
    }
}

/// Runs a case into `folder`.
pub fn start(loaded: &LoadedCase, folder: &Path, on: On) -> Result<RunSummary, CommandError> {
    let stop = Stop::new();
    run::run(loaded, &on.options(Some(folder)), &mut Listener::default(), &stop)
}

/// Runs a case, which has to end well, into `folder`; returns what it left there.
pub fn ran(text: &str, overrides: &[&str], folder: &Path, on: On) -> Left {
    start(&load(text, overrides), folder, on).unwrap_or_else(|error| panic!("{overrides:?}: {error}"));
    Left::in_folder(folder)
}

/// Runs a case, which has to end well; returns what was heard of it.
pub fn heard(loaded: &LoadedCase, options: &RunOptions) -> Listener<'static> {
    let mut listener = Listener::default();
    run::run(loaded, options, &mut listener, &Stop::new()).unwrap_or_else(|error| panic!("{error}"));
    listener
}

/// Runs a case and stops it from outside after the step for which `after` says so.
pub fn interrupted(loaded: &LoadedCase, options: &RunOptions, after: fn(&StepLine) -> bool) -> RunSummary {
    let stop = Stop::new();
    let mut listener = Listener { stop: Some(&stop), stop_after: Some(after), ..Listener::default() };
    let ended = run::run(loaded, options, &mut listener, &stop).unwrap_or_else(|error| panic!("{error}"));
    assert!(ended.interrupted);
    assert_eq!((ended.status, ended.exit_code()), (Status::Stopped, exit::STOPPED));
    ended
}

/// Goes on with the run in `folder`; returns what it said as well.
pub fn go_on(folder: &Path, on: On) -> (Result<RunSummary, CommandError>, Vec<String>) {
    go_on_with(folder, &on.options(None))
}

/// The same with these options.
pub fn go_on_with(folder: &Path, options: &RunOptions) -> (Result<RunSummary, CommandError>, Vec<String>) {
    let mut listener = Listener::default();
    let outcome = run::resume(folder, options, &mut listener, &Stop::new());
    (outcome, listener.messages)
}

/// A table as it was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("the run left it");
        let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text.lines();
        let columns = lines.next().map(cells).unwrap_or_default();
        let columns = columns.iter().map(|name| name.split(" [").next().unwrap_or(name).to_owned()).collect();
        Self { columns, rows: lines.map(cells).collect() }
    }

    /// Values of a column; missing ones are not a number.
    pub fn column(&self, name: &str) -> Vec<Real> {
        let at = self.columns.iter().position(|column| column == name);
        let at = at.unwrap_or_else(|| panic!("no column {name} among {:?}", self.columns));
        self.rows.iter().map(|row| row[at].parse().unwrap_or(Real::NAN)).collect()
    }

    /// The last value of a column.
    pub fn last(&self, name: &str) -> Real {
        *self.column(name).last().expect("there are rows")
    }
}

/// Results of a run.
pub struct Left {
    pub summary: Value,
    pub state: Snapshot,
    pub series: Table,
    pub probes: Vec<(String, Table)>,
}

impl Left {
    pub fn in_folder(folder: &Path) -> Self {
        let files = std::fs::read_dir(folder.join("probes")).into_iter().flatten().flatten();
        let mut probes: Vec<_> =
            files.map(|file| (file.file_name().to_string_lossy().into_owned(), Table::read(&file.path()))).collect();
        probes.sort_by(|a, b| a.0.cmp(&b.0));
        let series = Table::read(&folder.join("series.csv"));
        Self { summary: summary(folder), state: newest(folder).snapshot().expect("the run left it"), series, probes }
    }

    pub fn hash(&self) -> &str {
        self.summary["state_hash"].as_str().expect("a run that wrote a checkpoint has a hash")
    }

    /// A column of the series.
    pub fn column(&self, name: &str) -> Vec<Real> {
        self.series.column(name)
    }

    /// The last value of a column of the series.
    pub fn last(&self, name: &str) -> Real {
        self.series.last(name)
    }

    /// The table of a probe.
    pub fn probe(&self, name: &str) -> &Table {
        let file = format!("{name}.csv");
        &self.probes.iter().find(|(found, _)| *found == file).expect("the case has this probe").1
    }
}

pub fn summary(folder: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("summary.json")).expect("the run left it"))
        .expect("the run left it")
}

pub fn checkpoints(folder: &Path) -> CheckpointFolder {
    CheckpointFolder::new(folder.join("checkpoints"), 1)
}

pub fn newest(folder: &Path) -> CheckpointReader {
    checkpoints(folder).newest_good().expect("the run left it").good.expect("there is a checkpoint").1
}
