//! Grains and water at one time as arrays: of a run while it goes on, and of files that a run wrote.

use std::sync::Arc;

use sazanami_io::vtk::DataArray;
use sazanami_numerics::Real;
use sazanami_numerics::grid::Grid;

pub use sazanami_io::vtk::Values;

use crate::case::meaning::FieldPrecision;

/// A named array.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Its name, that of the files for ParaView.
    pub name: String,
    /// Values of one grain, cell or particle.
    pub components: usize,
    /// The values, those of a vector together.
    pub values: Values,
}

impl Array {
    /// An array of real numbers.
    pub(crate) fn reals(name: &str, components: usize, values: impl IntoIterator<Item = Real>) -> Self {
        Self { name: name.to_owned(), components, values: Values::F64(values.into_iter().collect()) }
    }

    /// An array of identifiers.
    pub(crate) fn long(name: &str, values: impl IntoIterator<Item = u64>) -> Self {
        Self { name: name.to_owned(), components: 1, values: Values::U64(values.into_iter().collect()) }
    }

    /// An array of small whole numbers.
    pub(crate) fn whole(name: &str, values: impl IntoIterator<Item = u32>) -> Self {
        Self { name: name.to_owned(), components: 1, values: Values::U32(values.into_iter().collect()) }
    }

    /// The array as a file has it, its values as they are.
    pub(crate) fn as_it_is(&self) -> DataArray<'_> {
        match &self.values {
            Values::F64(values) => DataArray::new(&self.name, self.components, values),
            Values::F32(values) => DataArray::new(&self.name, self.components, values),
            Values::U64(values) => DataArray::new(&self.name, self.components, values),
            Values::U32(values) => DataArray::new(&self.name, self.components, values),
            Values::I32(values) => DataArray::new(&self.name, self.components, values),
        }
    }

    /// The array as a file of this precision has it.
    pub(crate) fn in_file(&self, precision: FieldPrecision) -> DataArray<'_> {
        match precision {
            FieldPrecision::Single => self.rounded(),
            FieldPrecision::Double => self.as_it_is(),
        }
    }

    /// The array as a file has it, real numbers in single precision.
    pub(crate) fn rounded(&self) -> DataArray<'_> {
        match &self.values {
            Values::F64(values) => DataArray::rounded(&self.name, self.components, values.iter().copied()),
            _ => self.as_it_is(),
        }
    }
}

/// The water, and the gas above it where that is followed.
#[derive(Clone, Debug, PartialEq)]
pub enum WaterState {
    /// On the cells of a grid, x1 fastest.
    Grid {
        /// The cells of the whole box.
        grid: Grid,
        /// Values in the cells.
        arrays: Vec<Array>,
    },
    /// As moving particles.
    Particles {
        /// Values of the particles, `position` among them, in the order of their identifiers.
        arrays: Vec<Array>,
    },
}

/// Grains and water at one time, in SI units, in the frame that the case writes its files in.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Simulated time \[s].
    pub time: Real,
    /// Fluid step; absent where files do not tell it.
    pub step: Option<u64>,
    /// Arrays of the grains in the order of their identifiers, `position` among them; `orientation` is a unit quaternion
    /// w, x, y, z.
    pub grains: Vec<Array>,
    /// The water; absent where files do not have it.
    pub water: Option<WaterState>,
}

/// Who sees the states of a run while it goes on.
pub trait Onlooker: std::fmt::Debug + Send + Sync {
    /// A state that is due, on rank 0. The run waits until this returns.
    fn see(&self, state: State);
}

/// Interval of states. No step is cut for it: a state is that after the first step which reaches its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Every {
    /// After so many fluid steps.
    Steps(u64),
    /// Whenever so much simulated time has passed \[s].
    Time(Real),
}

/// States to be seen: when, and by whom. On processes of a launcher all are given the same times.
#[derive(Clone, Debug)]
pub struct Showing {
    /// Interval; the first state and the last are always seen.
    pub every: Every,
    /// By whom.
    pub to: Arc<dyn Onlooker>,
}

/// When the next state is due.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Due {
    every: Every,
    /// Step and time of the flow as it began, or went on.
    first: (u64, Real),
    shown: Option<u64>,
}

impl Due {
    /// Nothing was shown yet of a flow that begins at a step and a time \[s].
    pub fn new(every: Every, step: u64, time: Real) -> Self {
        Self { every, first: (step, time), shown: None }
    }

    /// Whether the state after the step from `before` to `time` \[s] is due; takes note of it then.
    pub fn is_due(&mut self, step: u64, before: Real, time: Real) -> bool {
        let (first, start) = self.first;
        let due = match self.every {
            Every::Steps(count) => (step - first).is_multiple_of(count.max(1)),
            // As many intervals as end by a time, whatever was lost when it was added up.
            Every::Time(interval) => {
                let ended = |time: Real| ((time - start) / interval * (1.0 + 1e-12)).floor();
                ended(time) > ended(before)
            }
        };
        due && self.note(step)
    }

    /// Takes note that the state after `step` is shown; `false` if it was before.
    pub fn note(&mut self, step: u64) -> bool {
        self.shown.replace(step) != Some(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_due_by_steps_or_times_and_none_twice() {
        let mut due = Due::new(Every::Steps(3), 10, 0.0);
        assert!(due.note(10));
        let seen: Vec<u64> = (11..20).filter(|&step| due.is_due(step, 0.0, 0.0)).collect();
        assert_eq!(seen, [13, 16, 19]);
        assert!(!due.note(19) && due.note(20));
        let mut due = Due::new(Every::Time(0.1), 0, 0.0);
        let times: Vec<Real> = (0..=40).map(|n| 0.025 * Real::from(n)).collect();
        let seen = (1..=40).filter(|&n| due.is_due(n as u64, times[n - 1], times[n])).count();
        assert_eq!(seen, 10);
    }
}
