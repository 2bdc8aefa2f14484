//! Output on the terminal. A closed or full output never ends a command in the middle.

use std::fmt::Arguments;
use std::io::{ErrorKind, IsTerminal as _, Write as _};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sazanami::case::{Diagnostics, Source};
use sazanami::error::{CommandError, exit};
use sazanami::progress::{Progress, StepLine};
use sazanami::stop::{Stop, StopCause};

/// Amount of messages on the error stream.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verbosity {
    /// Nothing at all: a rank that follows another.
    Silent,
    /// Warnings and errors.
    Quiet,
    /// Progress and messages too.
    #[default]
    Normal,
    /// All that is known of each step, and what the command took.
    Verbose,
}

static VERBOSITY: OnceLock<Verbosity> = OnceLock::new();
/// The first error of standard output; nothing more is written after it.
static OUTPUT_ERROR: OnceLock<std::io::Error> = OnceLock::new();

/// Sets how much is shown, once, before the command begins.
pub fn set_verbosity(verbosity: Verbosity) {
    VERBOSITY.get_or_init(|| verbosity);
}

/// Amount of messages.
pub fn verbosity() -> Verbosity {
    VERBOSITY.get().copied().unwrap_or_default()
}

/// Writes to standard output, as `print!` does, without a panic where it is closed or full; see [`end_output`].
macro_rules! out {
    ($($argument:tt)*) => { crate::terminal::write_out(format_args!($($argument)*)) };
}

/// [`out!`] with a new line.
macro_rules! outln {
    ($($argument:tt)*) => { crate::terminal::write_out(format_args!("{}\n", format_args!($($argument)*))) };
}

/// See [`out!`].
pub fn write_out(text: Arguments) {
    if OUTPUT_ERROR.get().is_none()
        && let Err(error) = std::io::stdout().write_fmt(text)
    {
        OUTPUT_ERROR.get_or_init(|| error);
    }
}

/// Exit code of a command that would have ended with `code`: whoever closes our output has read enough, but an output
/// that cannot hold what was asked for is an error.
pub fn end_output(code: u8) -> u8 {
    if let Err(error) = std::io::stdout().flush() {
        OUTPUT_ERROR.get_or_init(|| error);
    }
    match OUTPUT_ERROR.get() {
        Some(error) if error.kind() != ErrorKind::BrokenPipe => {
            print_error(format_args!("error: standard output cannot be written: {error}"));
            code.max(exit::FAILED)
        }
        _ => code,
    }
}

/// Writes a line to the error stream; where that is closed nobody reads it.
pub fn print_error(text: Arguments) {
    let _ = std::io::stderr().write_fmt(format_args!("{text}\n"));
}

/// Time between two changes of the live line.
const LIVE_INTERVAL: Duration = Duration::from_millis(200);
/// Shortest and longest time between two plain lines; between them it is a twentieth of the time since the beginning.
const PLAIN_INTERVALS: [Duration; 2] = [Duration::from_secs(5), Duration::from_secs(60)];
/// Steps of the bar.
const BAR: u64 = 1000;

/// Shows how a command gets on, on the error stream: one live line with a bar where it is a terminal, plain lines
/// otherwise.
#[derive(Debug)]
pub struct Screen {
    bar: Option<ProgressBar>,
    began: Instant,
    shown: Option<Instant>,
    phase: &'static str,
    verbosity: Verbosity,
}

impl Screen {
    /// A live line if the error stream is a terminal, plain lines otherwise.
    pub fn new() -> Self {
        let verbosity = verbosity();
        let live = std::io::stderr().is_terminal() && verbosity != Verbosity::Quiet;
        Self { bar: live.then(bar), began: Instant::now(), shown: None, phase: "", verbosity }
    }

    /// Whether it is time for another line.
    fn is_due(&self) -> bool {
        let interval = match self.bar {
            Some(_) => LIVE_INTERVAL,
            None => (self.began.elapsed() / 20).clamp(PLAIN_INTERVALS[0], PLAIN_INTERVALS[1]),
        };
        self.shown.is_none_or(|shown| shown.elapsed() >= interval)
    }

    /// Writes a line above the live one.
    fn write(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| print_error(format_args!("{text}"))),
            None => print_error(format_args!("{text}")),
        }
    }
}

/// A bar that is drawn only when asked to.
fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix:<7} {percent:>3} %  {bar:16}  {wide_msg}");
    // The template is right: a test draws with it.
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> ");
    ProgressBar::with_draw_target(Some(BAR), ProgressDrawTarget::stderr()).with_style(style)
}

impl Progress for Screen {
    fn step(&mut self, line: &StepLine) {
        if self.verbosity == Verbosity::Quiet || (line.phase == self.phase && !self.is_due()) {
            return;
        }
        (self.shown, self.phase) = (Some(Instant::now()), line.phase);
        match (&self.bar, self.verbosity) {
            (Some(bar), _) => {
                bar.set_prefix(line.phase);
                bar.set_message(line.after_percentage());
                bar.set_position((BAR as f64 * line.fraction()) as u64);
            }
            (None, Verbosity::Verbose) => self.write(&line.to_string()),
            (None, _) => self.write(&line.short()),
        }
    }

    fn message(&mut self, text: &str) {
        if self.verbosity != Verbosity::Quiet || text.starts_with("warning") {
            self.write(text);
        }
    }

    fn warnings(&mut self, warnings: &Diagnostics, source: &Source) {
        if !warnings.is_empty() {
            self.write(warnings.render(source, std::io::stderr().is_terminal()).trim_end());
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Shows what ended the command.
pub fn error(error: &CommandError) {
    match error {
        CommandError::Case(case) => {
            let text = case.diagnostics.render(&case.source, std::io::stderr().is_terminal());
            print_error(format_args!("{}", text.trim_end_matches('\n')));
        }
        other => print_error(format_args!("error: {other}")),
    }
}

/// A second signal this long after the first ends the program at once; one that comes sooner is the same
/// signal, sent to the group and to the program.
const PATIENCE: Duration = Duration::from_secs(2);

/// Whether whoever started this program asked it to ignore a signal: `nohup` does so with SIGHUP, shells do so with SIGINT
/// for what runs in the background.
fn is_ignored(signal: &i32) -> bool {
    let mut action = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
    // SAFETY: without a new action `sigaction` changes nothing, and it fills the structure, which is valid as zeros too.
    let action = unsafe {
        libc::sigaction(*signal, std::ptr::null(), action.as_mut_ptr());
        action.assume_init()
    };
    action.sa_sigaction == libc::SIG_IGN
}

/// From here on a file that grows beyond the limit on the size of files (`ulimit -f`) is an error of whoever writes it, as a full disk, and no
/// signal that ends the program without a word.
pub fn meet_full_files_as_errors() {
    // SAFETY: ignoring a signal runs no code.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
}

/// Stop that Ctrl-C, SIGTERM, SIGHUP and SIGUSR1 set; a second signal ends the program at once. Those that were ignored
/// when the program began stay ignored.
pub fn stop_on_signals() -> Result<Arc<Stop>, CommandError> {
    stop_on_signals_for(
        "ending after this step with a checkpoint; once more ends at once",
        "ended at once; what was computed since the last checkpoint is lost",
    )
}

/// The same for a command that tells by `ending` what the first signal does, and by `ended` what the second has done.
pub fn stop_on_signals_for(ending: &'static str, ended: &'static str) -> Result<Arc<Stop>, CommandError> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
    let failed =
        |error| CommandError::input(format!("signals cannot be caught: {error}"), "this is a fault of the system");
    let stop = Arc::new(Stop::new());
    let heard = [SIGINT, SIGTERM, SIGHUP, SIGUSR1].into_iter().filter(|signal| !is_ignored(signal));
    let mut signals = signal_hook::iterator::Signals::new(heard).map_err(failed)?;
    let asked = Arc::clone(&stop);
    let listen = move || {
        let mut first: Option<Instant> = None;
        for signal in signals.forever() {
            let cause = match signal {
                SIGHUP => StopCause::HangUp,
                SIGINT => StopCause::Interrupt,
                SIGUSR1 => StopCause::User,
                _ => StopCause::Terminate,
            };
            asked.set(cause);
            if first.is_none() && verbosity() != Verbosity::Silent {
                print_error(format_args!("\n{cause}: {ending}"));
            }
            if first.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
                print_error(format_args!("\n{ended}"));
                std::process::exit(i32::from(exit::STOPPED));
            }
        }
    };
    std::thread::Builder::new().name("signals".into()).spawn(listen).map_err(failed)?;
    Ok(stop)
}

#[cfg(test)]
mod tests {
    use indicatif::InMemoryTerm;

    use super::*;

    #[test]
    fn the_live_line_fits_80_columns_with_percentage_and_time_left_first() {
        let terminal = InMemoryTerm::new(5, 80);
        let bar = bar();
        bar.set_draw_target(ProgressDrawTarget::term_like(Box::new(terminal.clone())));
        let began = Instant::now();
        let mut screen = Screen { bar: Some(bar), began, shown: None, phase: "", verbosity: Verbosity::Normal };
        let line = StepLine {
            phase: "packing",
            step: 1_234_567,
            time: 0.02,
            until: 0.05,
            dt: 2e-5,
            limiter: "grain_motion",
            remaining: Some(18_650.0),
            ..StepLine::default()
        };
        screen.step(&line);
        let shown = terminal.contents();
        assert!(shown.starts_with("packing  40 %  ======>           left 5 h 10 min  "), "{shown}");
        assert_eq!(shown.lines().count(), 1, "{shown}");
        screen.message("a word between");
        assert!(terminal.contents().contains("left 5 h 10 min"), "{}", terminal.contents());
    }
}
