//! What happens at a time of the case: populations and gates are let go, springs become softer.

use sazanami_numerics::Real;
use sazanami_posing::assembly::grains::population_of;

use crate::case::meaning::{Case, Softening};
use crate::clock::END;
use crate::job::{Job, RankError};
use crate::water::Water;

/// What still waits, the next last.
pub(super) struct Releases {
    /// Times \[s] and numbers of populations.
    grains: Vec<(Real, usize)>,
    /// Times \[s] and numbers of gates.
    gates: Vec<(Real, usize)>,
    /// Softer springs.
    softening: Option<Softening>,
}

/// Times that are given, with their numbers, the first last.
fn waiting(times: impl Iterator<Item = Option<Real>>) -> Vec<(Real, usize)> {
    let mut waiting: Vec<_> = times.enumerate().filter_map(|(n, time)| Some((time?, n))).collect();
    waiting.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
    waiting
}

impl Releases {
    /// Those of a run that begins or goes on at `time` \[s]. A population that was released before is released again, which changes nothing;
    /// springs that were softened are softened again, since they begin with their own stiffness.
    pub fn of(case: &Case, time: Real) -> Self {
        let grains = waiting(case.grains.iter().map(|population| population.release));
        let closed = |opens: Real| (opens >= time * (1.0 - END)).then_some(opens);
        let gates = waiting(case.gates.iter().map(|gate| closed(gate.opens)));
        Self { grains, gates, softening: case.dem.soften }
    }

    /// Lets the grains go whose time has come, and softens springs; gates move by themselves.
    pub fn let_go<W: Water>(&mut self, job: &Job, water: &mut W, time: Real) -> Result<(), RankError> {
        while let Some((_, number)) = self.grains.pop_if(|(release, _)| *release <= time * (1.0 + END)) {
            let count = water.release(|id| population_of(id).0 == number)?;
            if count > 0 && water.domain().communicator().rank() == 0 {
                job.say(format!("released {count} grains of `{}` at {time} s", job.case.grains[number].name));
            }
        }
        while let Some((_, number)) = self.gates.pop_if(|(opens, _)| *opens <= time * (1.0 + END)) {
            if water.domain().communicator().rank() == 0 {
                job.say(format!("`{}` opens at {time} s", job.case.gates[number].name));
            }
        }
        if let Some(softening) = self.softening.take_if(|softening| softening.from <= time * (1.0 + END)) {
            water.soften(&softening);
            if water.domain().communicator().rank() == 0 {
                let part = 1e2 * softening.stiffness;
                job.say(format!("contacts have {part:.1} % of their stiffness from {} s on", softening.from));
            }
        }
        Ok(())
    }

    /// The next time at which a step has to end \[s]: that of an output, of the next release, of a gate or of softer springs.
    pub fn next(&self, output: Option<Real>) -> Option<Real> {
        let next = |waiting: &[(Real, usize)]| waiting.last().map(|(time, _)| *time);
        let softens = self.softening.map(|softening| softening.from);
        next(&self.grains).into_iter().chain(next(&self.gates)).chain(softens).chain(output).reduce(Real::min)
    }
}
