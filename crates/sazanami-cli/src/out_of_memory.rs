//! Memory that is refused ends the program with a word and an exit code of its own, not with a signal.

use std::io::Write as _;

use sazanami::error::exit;

/// From here on an abort, which is how the standard library ends a program whose memory is refused (it has printed how
/// much was asked for), says what may be done and ends with exit code 1.
#[cfg(unix)]
pub fn end_by_name() {
    use std::os::fd::AsFd as _;

    // A copy of the error stream: that of the standard library might be locked.
    let Ok(errors) = std::io::stderr().as_fd().try_clone_to_owned() else { return };
    let errors = std::fs::File::from(errors);
    let end = move || {
        let _ = (&errors).write_all(TEXT.as_bytes());
        signal_hook::low_level::exit(i32::from(exit::FAILED));
    };
    // SAFETY: the handler writes a constant text to a file of its own and ends the process: `write` and `_exit` are
    // async-signal-safe, nothing is allocated and no lock is taken.
    let registered = unsafe { signal_hook::low_level::register(signal_hook::consts::SIGABRT, end) };
    // Without it the program ends by the signal, as it would have anyway.
    drop(registered);
}

/// Elsewhere the program ends as the standard library ends it.
#[cfg(not(unix))]
pub fn end_by_name() {}

/// What is said.
const TEXT: &str = "\nerror: out of memory: the system refused what the line above asked for\n  \
    help: `sazanami check` predicts the memory of a case and `sazanami doctor` shows the limits (`ulimit -v`, \
    container, machine);\n        take fewer cells or grains or fewer threads, or raise the limit; a run with a \
    checkpoint goes on with `sazanami resume`\n";
