//! `sazanami sweep`: many runs of one case that differ in a few keys.

use std::path::{Path, PathBuf};

use clap::Args;
use sazanami::analyse::analyse;
use sazanami::case::amounts::estimate;
use sazanami::check::bytes;
use sazanami::error::{CommandError, exit};
use sazanami::machine::Machine;
use sazanami::progress::Progress as _;
use sazanami::results::as_word;
use sazanami_picture::Painter;
use sazanami_sweep::{Outcome, Plan, Sensitivity, SideBySide, TABLE};

use crate::terminal::{self, Screen};

/// Most runs that are shown side by side in a report.
const MOST_IN_REPORT: usize = 40;

/// Run the cases of a plan, several at a time.
#[derive(Debug, Args)]
#[command(
    long_about = "Run the cases of a plan: one case file with keys that vary over lists, ranges, a Latin hypercube, a \
                  Sobol sequence, or trajectories that say which key matters. All cases are checked before the first one runs. Runs go side by side, each in a \
                  process of its own, as far as processors and memory allow. Ctrl-C ends all of them with checkpoints; \
                  the same command goes on wherever the sweep ended: runs that ended are not repeated, runs begun go on \
                  from their checkpoints. A run that fails is marked in the table, and the others go on. Exit code 1 if \
                  one failed.",
    after_help = "Example:\n  sazanami sweep cases/sweeps/raindrop.toml --list\n  \
                  sazanami sweep cases/sweeps/raindrop.toml --out runs/matrix --jobs 2"
)]
pub struct Sweep {
    /// Plan of the sweep
    plan: PathBuf,
    /// Folder of the sweep, with a folder for each run [default: runs/<plan>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Runs at a time [default: what the plan says, or one for each processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Threads of each run [default: the processors, shared among the runs at a time]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Try runs that failed again, from their last checkpoints
    #[arg(long)]
    retry: bool,
    /// Show the runs, how far they are and what they need, and do nothing else
    #[arg(long, conflicts_with_all = ["slurm", "collect", "retry"])]
    list: bool,
    /// Write the script of an array job of Slurm instead of running
    #[arg(long, conflicts_with_all = ["collect", "retry"])]
    slurm: bool,
    /// Write table and report of what there is, and run nothing
    #[arg(long, conflicts_with = "retry")]
    collect: bool,
}

impl Sweep {
    pub fn execute(self) -> Result<u8, CommandError> {
        let plan = Plan::load(&self.plan)?;
        let mut screen = Screen::new();
        let (warnings, source) = plan.warnings();
        screen.warnings(warnings, source);
        if plan.has_targets() {
            return Err(CommandError::input(
                format!("`{}` has targets: it is the plan of a calibration", self.plan.display()),
                "use `sazanami calibrate` for it",
            ));
        }
        let out = self.out.clone().unwrap_or_else(|| Path::new("runs").join(plan.name()));
        let (asked, threads) = (self.jobs.map(usize::from).or(plan.side_by_side), self.threads.map(usize::from));
        let cores = Machine::this().cores;
        let foretold = SideBySide::of(asked, threads, plan.runs(), cores);
        // A task of an array job has the processors that it asks for, not those of this machine.
        let of_task = threads.unwrap_or(1);
        let sweep = sazanami_sweep::Sweep::pose(plan, &out, if self.slurm { of_task } else { foretold.threads })?;
        if self.list {
            sweep.refuse_another()?;
            list(&sweep, foretold);
            return Ok(exit::DONE);
        }
        let program = std::env::current_exe()
            .map_err(|error| CommandError::Undone(format!("this program does not find itself: {error}")))?;
        if self.slurm {
            let path = sweep.write_slurm(&program, asked, of_task)?;
            outln!("wrote {}", path.display());
            outln!("start it with `sbatch {}`", as_word(&path));
            return Ok(exit::DONE);
        }
        let outcome = if self.collect {
            sweep.collect()?
        } else {
            let stop = terminal::stop_on_signals()?;
            let side_by_side = SideBySide::of(asked, threads, sweep.left(self.retry), cores);
            sweep.run(&program, side_by_side, self.retry, &mut screen, &stop)?
        };
        if !outcome.interrupted {
            compare(&outcome, &out, &mut screen);
        }
        drop(screen);
        Ok(exit_code(&sweep, &outcome, self.collect))
    }
}

/// A range of estimated times \[s].
fn times(ends: [f64; 2]) -> String {
    let [start, most] = ends.map(estimate);
    if start == most { start } else { format!("{start} to {most}") }
}

/// Shows the runs and what they need.
fn list(sweep: &sazanami_sweep::Sweep, side_by_side: SideBySide) {
    let states = sweep.states();
    for (run, found) in sweep.runs().iter().zip(&states) {
        outln!(
            "{:<10}  {}  ({} memory, {} disk, {})",
            found.state.word(),
            run.name,
            bytes(run.needs.memory),
            bytes(run.needs.disk),
            times(run.needs.wall)
        );
    }
    let SideBySide { runs, threads } = side_by_side;
    let walls = |n: usize| sweep.runs().iter().map(|run| run.needs.wall[n]).sum::<f64>() / runs as f64;
    outln!(
        "{} runs, {runs} at a time on {threads} thread{} each: about {} in all, {} on disk",
        sweep.runs().len(),
        if threads == 1 { "" } else { "s" },
        times([walls(0), walls(1)]),
        bytes(sweep.runs().iter().map(|run| run.needs.disk).sum())
    );
}

/// Compares the runs that finished: lines, a table and a report in the folder of the sweep.
fn compare(outcome: &Outcome, out: &Path, screen: &mut Screen) {
    let [first, .., _] = outcome.finished.as_slice() else { return };
    let place = out.join("comparison");
    // What an earlier command made of fewer runs.
    let _ = std::fs::remove_dir_all(&place);
    let has_ended = |result: Result<Vec<String>, CommandError>| match result {
        Ok(lines) => lines.iter().for_each(|line| outln!("{line}")),
        Err(error) => terminal::print_error(format_args!("warning: the runs are not compared: {error}")),
    };
    let says = |name: &str| {
        std::fs::read_to_string(first.join("case.toml")).is_ok_and(|text| text.contains(&format!("\n[{name}]")))
    };
    if says("erosion") || says("ripples") {
        has_ended(analyse(&outcome.finished, &[], Some(&place), Some(&Painter), screen));
    }
    let shown = &outcome.finished[..outcome.finished.len().min(MOST_IN_REPORT)];
    if shown.len() < outcome.finished.len() {
        screen.message(&format!("the report shows the first {MOST_IN_REPORT} runs side by side; the table has all"));
    }
    has_ended(sazanami_report::comparison(shown, out).map(|path| vec![format!("wrote {}", path.display())]));
}

/// Tells what came of it; returns the exit code.
fn exit_code(sweep: &sazanami_sweep::Sweep, outcome: &Outcome, is_collected: bool) -> u8 {
    for (name, cause) in &outcome.failed {
        outln!("{name} failed: {cause}");
    }
    let all = sweep.runs().len();
    outln!("{} of {all} runs finished, {} failed, {} left", outcome.finished.len(), outcome.failed.len(), outcome.left);
    outln!("table in {}", sweep.folder().join(TABLE).display());
    match &outcome.sensitivity {
        Sensitivity::Table(path) => outln!("elementary effects of the keys in {}", path.display()),
        Sensitivity::NothingFound if !outcome.finished.is_empty() => {
            outln!("no run has findings: no sensitivities; observe something (`[erosion]`, `[heap]`, `[bed]`)");
        }
        Sensitivity::NoEffect => outln!("no sensitivities: no finding changes with a key between runs that finished"),
        Sensitivity::NotAsked | Sensitivity::NothingFound => {}
    }
    if outcome.left > 0 && !is_collected {
        outln!("the same command goes on with them");
    }
    match outcome {
        Outcome { interrupted: true, .. } => exit::STOPPED,
        Outcome { failed, left, .. } if !failed.is_empty() || (*left > 0 && !is_collected) => exit::FAILED,
        _ => exit::DONE,
    }
}
