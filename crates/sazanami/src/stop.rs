//! Stop of a run from outside: a flag that says by what it was set.

use std::sync::atomic::{AtomicU8, Ordering};

/// Who stops a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum StopCause {
    /// The program that uses this library.
    Caller = 1,
    /// Ctrl-C (SIGINT).
    Interrupt,
    /// SIGTERM: `kill`, `timeout`, a batch system.
    Terminate,
    /// SIGHUP: the terminal was closed.
    HangUp,
    /// SIGUSR1: a batch system before the end of the time it granted.
    User,
}

impl std::fmt::Display for StopCause {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Caller => "the program that started it",
            Self::Interrupt => "Ctrl-C (SIGINT)",
            Self::Terminate => "SIGTERM",
            Self::HangUp => "SIGHUP: its terminal was closed",
            Self::User => "SIGUSR1",
        })
    }
}

impl StopCause {
    const ALL: [Self; 5] = [Self::Caller, Self::Interrupt, Self::Terminate, Self::HangUp, Self::User];

    /// The cause with a number of [`Stop::number`].
    fn of(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|&cause| cause as u8 == number)
    }
}

/// Asked after every step; once set the run writes a checkpoint and ends.
#[derive(Debug, Default)]
pub struct Stop(AtomicU8);

impl Stop {
    /// Nobody has asked for an end.
    #[must_use]
    pub const fn new() -> Self {
        Self(AtomicU8::new(0))
    }

    /// Asks the run to end; the first cause stays.
    pub fn set(&self, cause: StopCause) {
        // An error means that somebody else was first.
        let _ = self.0.compare_exchange(0, cause as u8, Ordering::SeqCst, Ordering::SeqCst);
    }

    /// Whether the run is to end.
    #[must_use]
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed) != 0
    }

    /// Who asked for the end first.
    #[must_use]
    pub fn cause(&self) -> Option<StopCause> {
        StopCause::of(self.number())
    }

    /// A number for who asked, which ranks can compare; 0 if nobody has.
    pub(crate) fn number(&self) -> u8 {
        self.0.load(Ordering::SeqCst)
    }

    /// Takes over what another rank was asked, by its [`Self::number`].
    pub(crate) fn heard(&self, number: u8) {
        if let Some(cause) = StopCause::of(number) {
            self.set(cause);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_cause_stays() {
        let stop = Stop::new();
        assert!(!stop.is_set() && stop.cause().is_none());
        stop.set(StopCause::HangUp);
        stop.set(StopCause::Interrupt);
        assert!(stop.is_set());
        assert_eq!(stop.cause(), Some(StopCause::HangUp));
    }
}
