//! `sazanami verify`: cases with known results.

use std::path::PathBuf;

use clap::Args;
use sazanami::error::{CommandError, exit};
use sazanami::progress::duration;
use sazanami::run::RunOptions;
use sazanami::workers;
use sazanami_parallel::Processes;
use sazanami_verification::catalogue::CASES;
use sazanami_verification::judge::Row;
use sazanami_verification::page;
use sazanami_verification::verify::{self, Choice};

use super::print_json;
use super::run::of_this_program;
use crate::terminal::{self, Screen};
use crate::words;

/// Run cases with known results.
#[derive(Debug, Args)]
#[command(
    long_about = "Run cases with known results and judge what they measure: value, reference, band and verdict. All of it takes \
                  about 40 minutes on two cores; --long adds what takes longer. Exit code 0 if nothing is worse than recorded in \
                  verification/<case>/expected.toml, 1 on a regression or a miss that is not recorded there. Ctrl-C ends the \
                  runs of cases: those judged until then are told, with exit code 130; with --keep the same command goes on with \
                  the others.",
    after_help = "Example:\n  sazanami verify layers-at-rest falling-drop --json"
)]
pub struct Verify {
    /// Cases (default: all)
    #[arg(value_name = "CASE", value_parser = words::VERIFIED, hide_possible_values = true)]
    names: Vec<String>,
    /// Add the cases that take longest
    #[arg(long)]
    long: bool,
    /// Only the cases that run with the tests: a few minutes
    #[arg(long)]
    subset: bool,
    /// List the cases and do nothing else
    #[arg(long)]
    list: bool,
    /// Print one array of rows as JSON
    #[arg(long)]
    json: bool,
    /// Write values, page and figure of each case to DIR/<case>
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Take case.toml, reference.csv and expected.toml from DIR/<case> where they are there: of one case at least
    #[arg(long, value_name = "DIR")]
    expected: Option<PathBuf>,
    /// Cases at a time, each on one thread (default: one for each processor)
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    jobs: usize,
    /// Keep the runs in DIR/<case>, and take or go on with those that are there, of the same case and version (a changed program of the same version is not told apart)
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
}

impl Verify {
    pub fn execute(self, processes: Option<&Processes>) -> Result<u8, CommandError> {
        if self.list {
            return self.print_list();
        }
        let Self { names, long, subset, json, out, expected, jobs, keep, .. } = self;
        for folder in out.iter().chain(&keep) {
            page::make_ready(folder).map_err(|error| {
                CommandError::input(
                    format!("nothing can be written to `{}`: {error}", folder.display()),
                    "choose another folder",
                )
            })?;
        }
        let stop = terminal::stop_on_signals_for("ending the runs of cases; once more ends at once", "ended at once")?;
        let mut screen = Screen::new();
        let mut choice = Choice { names, long, subset, expected, jobs, keep };
        let chosen = verify::count(CASES, &choice)?;
        let found = match processes {
            Some(processes) => {
                let options = RunOptions { processes: Some(processes.clone()), ..of_this_program() };
                // Cases at a time on each rank, by the processors that are its share.
                let [_, threads] = workers::of_options(&options)?;
                choice.jobs = if jobs == 0 { threads } else { jobs };
                verify::verify_on(processes, CASES, &choice, &mut screen, &stop)?
            }
            None => verify::verify(CASES, &choice, &mut screen, &stop)?,
        };
        drop(screen);
        let mut unwritten = Ok(());
        for case in found.iter().filter(|case| !case.outcome.values.is_empty()) {
            if let Some(folder) = &out {
                let written = page::write_case(folder, case.name, &case.expected, &case.outcome);
                unwritten = unwritten.and(written.map_err(|error| CommandError::Undone(error.to_string())));
            }
        }
        let judged = found.len();
        let rows: Vec<Row> = found.into_iter().flat_map(|case| case.rows).collect();
        if json {
            print_json(&super::json(&rows)?);
        } else {
            out!("{}", verify::table(&rows));
        }
        // The table is told first: what was computed is not lost with a page.
        unwritten?;
        if let Some(cause) = stop.cause().filter(|_| judged < chosen) {
            terminal::print_error(format_args!("stopped by {cause}: {judged} of {chosen} cases had been judged"));
            return Ok(exit::STOPPED);
        }
        Ok(if rows.iter().any(|row| row.verdict.is_bad()) { exit::FAILED } else { exit::DONE })
    }

    fn print_list(&self) -> Result<u8, CommandError> {
        for case in CASES {
            let expected = verify::expected_of(case, self.expected.as_ref())?;
            let when = if expected.long { ", with --long" } else { "" };
            outln!("{:<28} {} ({}{when})", case.name, expected.about, duration(expected.cost));
        }
        Ok(exit::DONE)
    }
}
