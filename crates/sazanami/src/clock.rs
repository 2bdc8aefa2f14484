//! Time, steps, and the length of the next step.

use sazanami_numerics::Real;
use sazanami_posing::steps::{LANDING, towards};

/// A time counts as reached when this part of it is left.
pub(crate) const END: Real = 1e-12;

/// Physical time and number of steps taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    time: Real,
    step: u64,
    fixed: Option<Real>,
}

impl Clock {
    /// A clock at time zero. With `fixed` every step has that length \[s].
    #[must_use]
    pub fn new(fixed: Option<Real>) -> Self {
        Self { time: 0.0, step: 0, fixed }
    }

    /// Sets the clock to where a checkpoint left it.
    #[must_use]
    pub fn at(self, time: Real, step: u64) -> Self {
        Self { time, step, ..self }
    }

    /// Physical time \[s].
    #[must_use]
    pub fn time(&self) -> Real {
        self.time
    }

    /// Steps taken so far.
    #[must_use]
    pub fn step(&self) -> u64 {
        self.step
    }

    /// Whether it has come to `time` \[s].
    #[must_use]
    pub fn has_reached(&self, time: Real) -> bool {
        self.time >= time * (1.0 - END)
    }

    /// Length of the next step \[s]: `stable`, shortened so that a step ends at `due`, the next output time ([`towards`]), or the fixed one.
    ///
    /// Fixed steps are not shortened: their outputs come at the step nearest to the time asked for.
    #[must_use]
    pub fn next_step(&self, stable: Real, due: Option<Real>) -> Real {
        if let Some(dt) = self.fixed {
            return dt;
        }
        due.map_or(stable, |due| towards(due - self.time, stable))
    }

    /// Counts a step of length `dt` \[s] and lands on `due` if it is reached.
    pub fn advance(&mut self, dt: Real, due: Option<Real>) {
        self.step += 1;
        self.time = match (self.fixed, due) {
            (Some(dt), _) => self.step as Real * dt,
            (None, Some(due)) if (due - (self.time + dt)).abs() <= LANDING * dt => due,
            _ => self.time + dt,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_land_on_output_times() {
        let mut clock = Clock::new(None);
        let due = Some(0.01);
        let mut steps = 0;
        while clock.time() < 0.01 {
            let dt = clock.next_step(0.0013, due);
            assert!(dt <= 0.0013 * (1.0 + 1e-8) && dt > 0.0003);
            clock.advance(dt, due);
            steps += 1;
        }
        assert_eq!(clock.time().to_bits(), 0.01_f64.to_bits());
        assert_eq!(steps, 8);
    }

    #[test]
    fn fixed_steps_keep_their_length() {
        let mut clock = Clock::new(Some(1e-5));
        for _ in 0..1000 {
            assert_eq!(clock.next_step(1e-7, Some(5e-6)), 1e-5);
            clock.advance(1e-5, Some(5e-6));
        }
        assert_eq!(clock.time(), 1000.0 * 1e-5);
    }
}
