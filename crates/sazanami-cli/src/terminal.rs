//! What is shown on the terminal: one live line where it is one, plain lines for a log otherwise.

use std::io::{IsTerminal as _, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use sazanami::case::{Diagnostics, Source};
use sazanami::error::{CommandError, exit};
use sazanami::progress::{Progress, StepLine};

/// Time between two lines of a log.
const LOG_INTERVAL: Duration = Duration::from_secs(5);
/// Time between two changes of the live line.
const LIVE_INTERVAL: Duration = Duration::from_millis(200);

/// Shows how a command gets on, on the error stream.
#[derive(Debug)]
pub struct Screen {
    live: bool,
    shown: Option<Instant>,
    drawn: usize,
}

impl Screen {
    /// A live line if the error stream is a terminal, plain lines otherwise.
    pub fn new() -> Self {
        Self { live: std::io::stderr().is_terminal(), shown: None, drawn: 0 }
    }

    fn clear(&mut self) {
        if self.drawn > 0 {
            eprint!("\r{}\r", " ".repeat(self.drawn));
            self.drawn = 0;
        }
    }
}

impl Progress for Screen {
    fn step(&mut self, line: &StepLine) {
        let interval = if self.live { LIVE_INTERVAL } else { LOG_INTERVAL };
        if self.shown.is_some_and(|shown| shown.elapsed() < interval) {
            return;
        }
        self.shown = Some(Instant::now());
        if !self.live {
            eprintln!("{line}");
            return;
        }
        let width = terminal_size::terminal_size().map_or(80, |(width, _)| usize::from(width.0));
        let text: String = line.to_string().chars().take(width.saturating_sub(1)).collect();
        let length = text.chars().count();
        eprint!("\r{text}{}", " ".repeat(self.drawn.saturating_sub(length)));
        self.drawn = length;
        // The line is for people's eyes: if it cannot be shown, the run goes on all the same.
        let _ = std::io::stderr().flush();
    }

    fn message(&mut self, text: &str) {
        self.clear();
        eprintln!("{text}");
    }

    fn warnings(&mut self, warnings: &Diagnostics, source: &Source) {
        self.clear();
        self::warnings(warnings, source);
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        if self.drawn > 0 {
            eprintln!();
        }
    }
}

/// Shows what ended the command.
pub fn error(error: &CommandError) {
    match error {
        CommandError::Case(case) => {
            eprint!("{}", case.diagnostics.render(&case.source, std::io::stderr().is_terminal()));
        }
        other => eprintln!("error: {other}"),
    }
}

/// Shows warnings about a case.
pub fn warnings(warnings: &Diagnostics, source: &Source) {
    if !warnings.is_empty() {
        eprint!("{}", warnings.render(source, std::io::stderr().is_terminal()));
    }
}

/// A second signal this long after the first ends the program at once; one that comes sooner is the same
/// signal, sent to the group and to the program.
const PATIENCE: Duration = Duration::from_secs(2);

/// A flag that Ctrl-C and SIGTERM set; a second signal ends the program at once.
pub fn stop_flag() -> Result<Arc<AtomicBool>, CommandError> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let failed =
        |error| CommandError::input(format!("signals cannot be caught: {error}"), "this is a fault of the system");
    let stop = Arc::new(AtomicBool::new(false));
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]).map_err(failed)?;
    let flag = Arc::clone(&stop);
    let listen = move || {
        let mut first: Option<Instant> = None;
        for _ in signals.forever() {
            flag.store(true, Ordering::SeqCst);
            if first.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
                eprintln!("\nstopped at once; what was written since the last checkpoint is lost");
                std::process::exit(i32::from(exit::STOPPED));
            }
        }
    };
    std::thread::Builder::new().name("signals".into()).spawn(listen).map_err(failed)?;
    Ok(stop)
}
