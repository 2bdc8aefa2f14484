//! `sazanami calibrate`: values of keys with which a case finds what was measured.

use std::path::{Path, PathBuf};

use clap::Args;
use sazanami::case::units::rounded;
use sazanami::error::{CommandError, exit};
use sazanami::progress::Progress as _;
use sazanami_sweep::{Fit, Plan, calibrate};

use crate::terminal::{self, Screen};

/// Find the values of keys with which a case meets targets.
#[derive(Debug, Args)]
#[command(
    long_about = "Find the values of one to five keys with which a case meets targets within their tolerances, by the \
                  simplex of Nelder and Mead over runs. The search ends with the first point that meets all targets, or with \
                  the most runs that the plan allows (exit code 1). Ctrl-C ends it with checkpoints; the same command goes \
                  on where it was. The uncertainties of the keys are those that the tolerances of the targets leave and, with \
                  `seeds` in the plan, the scatter between them. A key with which the targets change by no more than they \
                  scatter is not determined, and the fit one of noise (exit code 1).",
    after_help = "Example:\n  sazanami calibrate porosity.toml --out runs/porosity"
)]
pub struct Calibrate {
    /// Plan with ranges of keys and targets
    plan: PathBuf,
    /// Folder of the calibration, with a folder for each run [default: runs/<plan>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Runs at a time, where several are independent [default: what the plan says, or one for each processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
}

impl Calibrate {
    pub fn execute(self) -> Result<u8, CommandError> {
        let plan = Plan::load(&self.plan)?;
        let out = self.out.unwrap_or_else(|| Path::new("runs").join(plan.name()));
        let program = std::env::current_exe()
            .map_err(|error| CommandError::Undone(format!("this program does not find itself: {error}")))?;
        let asked = self.jobs.map(usize::from).or(plan.side_by_side);
        let stop = terminal::stop_on_signals()?;
        let mut screen = Screen::new();
        let (warnings, source) = plan.warnings();
        screen.warnings(warnings, source);
        let fit = calibrate(&plan, &out, &program, asked, &mut screen, &stop)?;
        drop(screen);
        Ok(exit_code(&fit))
    }
}

/// Tells the fit; returns the exit code.
fn exit_code(fit: &Fit) -> u8 {
    let is_sampled = fit.targets.iter().all(|target| target.error.is_some());
    let of_what = if is_sampled { "" } else { ", nothing of the scatter between seeds in it" };
    let is_determined = fit.keys.iter().all(|key| key.uncertainty.is_some());
    let is_told_apart = fit.targets.len() >= fit.keys.len();
    let is_noise = !is_determined && is_told_apart && is_sampled && !fit.interrupted;
    for key in &fit.keys {
        match key.uncertainty {
            Some(uncertainty) => {
                outln!("{} = {} (standard uncertainty {}{of_what})", key.path, key.value, rounded(uncertainty));
            }
            None => outln!("{} = {}, of unknown uncertainty", key.path, key.value),
        }
    }
    for target in &fit.targets {
        let [value, tolerance] = target.target;
        let error = target.error.map_or_else(String::new, |error| format!(" +- {} over seeds", rounded(error)));
        outln!("{}: {}{error}, target {value} within {tolerance}", target.name, target.found);
    }
    let verdict = if fit.is_met { "the targets are met" } else { "the targets are not met" };
    outln!("{verdict} after {} runs; the nearest is {}", fit.runs, fit.best.display());
    if !is_determined && !is_told_apart {
        outln!("fewer targets than keys: other values of the keys may meet them as well");
    } else if !is_determined && !is_noise {
        outln!(
            "the runs there are do not determine all keys; with `seeds` in the plan the scatter between runs would be known"
        );
    }
    if is_noise {
        outln!(
            "a fit of noise: within these runs the targets change with a key by no more than they scatter; more seeds, a wider \
             range or other targets may determine it"
        );
    }
    match fit {
        Fit { interrupted: true, .. } => exit::STOPPED,
        _ if is_noise => exit::FAILED,
        Fit { is_met: false, .. } => exit::FAILED,
        _ => exit::DONE,
    }
}
