//! Populations that are held until a time.

use sazanami_numerics::Real;

use super::END;
use crate::assembly::grains::population_of;
use crate::case::meaning::Case;
use crate::job::{Job, RankError};
use crate::water::Water;

/// Populations that still wait, by number, with the times of their release \[s]; the next is the last.
pub(super) struct Releases(Vec<(Real, usize)>);

impl Releases {
    /// Those of a run that begins or goes on. A population that was released before is released again, which changes nothing.
    pub fn of(case: &Case) -> Self {
        let times = case.grains.iter().enumerate().filter_map(|(n, population)| Some((population.release?, n)));
        let mut waiting: Vec<(Real, usize)> = times.collect();
        waiting.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
        Self(waiting)
    }

    /// Lets those go whose time has come.
    pub fn let_go<W: Water>(&mut self, job: &Job, water: &mut W, time: Real) -> Result<(), RankError> {
        while let Some((_, number)) = self.0.pop_if(|(release, _)| *release <= time * (1.0 + END)) {
            let count = water.release(|id| population_of(id).0 == number)?;
            if count > 0 && water.domain().communicator().rank() == 0 {
                job.say(format!("released {count} grains of `{}` at {time} s", job.case.grains[number].name));
            }
        }
        Ok(())
    }

    /// The next time at which a step has to end \[s]: that of an output, or of the next release.
    pub fn next(&self, output: Option<Real>) -> Option<Real> {
        let release = self.0.last().map(|(release, _)| *release);
        release.into_iter().chain(output).reduce(Real::min)
    }
}
