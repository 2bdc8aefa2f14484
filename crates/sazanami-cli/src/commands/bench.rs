//! `sazanami bench`: times kernels and whole steps on this machine.

use clap::Args;
use sazanami::error::{CommandError, exit};
use sazanami::machine::Machine;
use sazanami_bench as bench;

use super::print_json;
use crate::terminal::Screen;

/// Time kernels and whole steps on this machine.
#[derive(Debug, Args)]
#[command(
    long_about = "Time kernels and whole steps on this machine: median, least and largest of several runs, beside the \
                  least time the machine allows where it can be told.",
    after_help = "Example:\n  sazanami bench dem_substep_shell75 pressure_solve --json"
)]
pub struct Bench {
    /// Benchmarks (default: all)
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// List the benchmarks and do nothing else
    #[arg(long)]
    list: bool,
    /// Print one array of rows as JSON
    #[arg(long)]
    json: bool,
}

impl Bench {
    pub fn execute(self) -> Result<u8, CommandError> {
        if self.list {
            for bench in bench::benches() {
                outln!("{:<24} {}", bench.name, bench.about);
            }
            return Ok(exit::DONE);
        }
        let mut screen = Screen::new();
        let rows = bench::bench(bench::benches(), &self.names, Machine::this().cores, &mut screen)?;
        drop(screen);
        if self.json {
            print_json(&super::json(&rows)?);
        } else {
            out!("{}", bench::table(&rows));
        }
        Ok(exit::DONE)
    }
}
