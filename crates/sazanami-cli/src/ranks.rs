//! The command on the processes of a launcher: rank 0 does what the command line asks for, the others follow it.

use sazanami::error::{CommandError, exit};
use sazanami::followers;
use sazanami_parallel::{JoinError, Processes};
use sazanami_verification::catalogue::CASES;
use sazanami_verification::verify;

use crate::commands::run::of_this_program;
use crate::terminal::{self, Verbosity};

/// Takes part as the rank that this process is; returns the exit code. `command` is what rank 0 does.
pub fn take_part(processes: &Processes, command: impl FnOnce(Option<&Processes>, Option<&JoinError>) -> u8) -> u8 {
    let outcome =
        processes.guarded(|| if processes.rank() == 0 { lead(processes, command) } else { follow(processes) });
    match outcome {
        Ok(code) if !processes.have_failed() => code,
        // The others wait in vain for one that is gone: no process can end in good order.
        Ok(code) => processes.abort(terminal::end_output(code)),
        Err(failed) => {
            terminal::error(&CommandError::Undone(format!("the command broke off: {failed}")));
            processes.abort(exit::FAILED)
        }
    }
}

fn lead(processes: &Processes, command: impl FnOnce(Option<&Processes>, Option<&JoinError>) -> u8) -> u8 {
    let code = command(Some(processes), None);
    if !processes.have_failed() {
        followers::dismiss(processes);
    }
    code
}

fn follow(processes: &Processes) -> u8 {
    terminal::set_verbosity(Verbosity::Silent);
    announce_panics(processes);
    match terminal::stop_on_signals() {
        // The exit code of the job is that of rank 0, which says why.
        Ok(stop) => {
            followers::follow(processes, &of_this_program(), &stop, |work| {
                sazanami_bench::follow(processes, work);
                verify::follow_order(processes, CASES, work, &stop);
            });
            exit::DONE
        }
        Err(error) => {
            terminal::error(&error);
            processes.abort(error.exit_code())
        }
    }
}

/// Puts the rank before what is said of a panic.
fn announce_panics(processes: &Processes) {
    let (rank, host) = (processes.rank(), processes.host());
    let say = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        terminal::print_error(format_args!("[rank {rank} on {host}]"));
        say(panic);
    }));
}
