//! `sazanami bench`: times kernels and whole steps on this machine.

use clap::Args;
use sazanami::error::{CommandError, exit};
use sazanami::run::RunOptions;
use sazanami_bench as bench;
use sazanami_parallel::Processes;

use super::print_json;
use super::run::of_this_program;
use crate::terminal::Screen;
use crate::words;

/// Name of the record of loops among the benchmarks.
const SCALING: &str = "scaling";

/// Time kernels and whole steps on this machine.
#[derive(Debug, Args)]
#[command(
    long_about = "Time kernels and whole steps on this machine: median, least and largest of several runs, beside the \
                  least time the machine allows where it can be told. `scaling`, by itself, says what more threads could \
                  bring: time outside parallel loops, tasks of the loops, and the speed-up these allow.",
    after_help = "Example:\n  sazanami bench dem_substep_shell75 pressure_solve --json\n  sazanami bench scaling"
)]
pub struct Bench {
    /// Benchmarks (default: all)
    #[arg(value_name = "NAME", value_parser = words::BENCH, hide_possible_values = true)]
    names: Vec<String>,
    /// List the benchmarks and do nothing else
    #[arg(long)]
    list: bool,
    /// Threads of each rank (default: all, shared among the ranks)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Ranks within this process, of benchmarks that ranks share; under a launcher of MPI each process is one instead
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    ranks: u16,
    /// Print one array of rows as JSON
    #[arg(long)]
    json: bool,
}

impl Bench {
    pub fn execute(self, processes: Option<&Processes>) -> Result<u8, CommandError> {
        if self.list {
            for bench in bench::benches() {
                outln!("{:<24} {}", bench.name, bench.about);
            }
            outln!("{SCALING:<24} what more threads could bring to steps, from one thread; by itself");
            return Ok(exit::DONE);
        }
        let mut screen = Screen::new();
        if self.names.iter().any(|name| name == SCALING) {
            return self.scaling(processes, screen);
        }
        let options = RunOptions {
            threads: self.threads.map(usize::from),
            ranks: usize::from(self.ranks),
            processes: processes.cloned(),
            ..of_this_program()
        };
        let [ranks, threads] = sazanami::workers::of_options(&options)?;
        let place = bench::Place { threads, ranks, processes: processes.cloned() };
        let rows = bench::bench(bench::benches(), &self.names, &place, &mut screen)?;
        drop(screen);
        if self.json {
            print_json(&super::json(&rows)?);
        } else {
            out!("{}", bench::table(&rows));
        }
        Ok(exit::DONE)
    }

    fn scaling(&self, processes: Option<&Processes>, mut screen: Screen) -> Result<u8, CommandError> {
        if self.names.len() > 1 || self.threads.is_some() || self.ranks > 1 || processes.is_some() {
            return Err(CommandError::input(
                format!("`{SCALING}` goes by itself, on one rank and one thread"),
                format!("leave out the rest: `sazanami bench {SCALING}`"),
            ));
        }
        let found = bench::scaling::scaling(&mut screen)?;
        drop(screen);
        if self.json {
            print_json(&super::json(&found)?);
        } else {
            out!("{}", bench::scaling::table(&found));
        }
        Ok(exit::DONE)
    }
}
