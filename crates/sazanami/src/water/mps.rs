//! Moving particles of water that overlap grains, as a run drives them.

use sazanami_dem::{ContactReport, DemError, Engine, Grain};
use sazanami_mps::pressure::PressureError;
use sazanami_mps::solver::{Forcing, Phase, Solver, StepError, StepReport};
use sazanami_mps::stability::StableStep;
use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::mean_flow::MeanFlowReport;
use sazanami_numerics::snapshot::Snapshot;

use super::{ELSEWHERE, StepProblem, Water, named_alike};
use crate::case::meaning::Case;
use crate::naming::grain_kind;

/// Body force, displacement and velocity of the walls in the step from `time` to `time + dt` \[s].
fn forcing(case: &Case, time: Real, dt: Real) -> Forcing {
    let step = [time, time + dt];
    let [body_force, by_volume] = [case.effective_gravity(step), case.force_by_volume(step)];
    if !case.walls_move() {
        return Forcing { body_force, by_volume, ..Forcing::default() };
    }
    let [before, after] = step.map(|time| case.tank_at(time)[0]);
    Forcing { body_force, by_volume, wall_displacement: after, wall_velocity: (after - before) / dt }
}

impl Water for Solver {
    type Stable = StableStep;
    type Report = StepReport;

    named_alike!();

    fn stable_step(&mut self, case: &Case, time: Real) -> StableStep {
        Solver::stable_step(self, case.effective_gravity([time; 2]))
    }

    fn advance(
        &mut self,
        case: &Case,
        time: Real,
        _stable: StableStep,
        dt: Real,
        mut watch: impl FnMut(&'static str),
    ) -> Result<StepReport, StepProblem> {
        let outcome = self.step(dt, &forcing(case, time, dt), |phase| watch(phase_name(phase)));
        let report = outcome.map_err(|error| problem(case, self, &error))?;
        if case.walls_move() {
            // In the step they and the grains that they hold had their mean velocity.
            let (engine, domain) = self.engine_mut();
            engine.set_wall_velocities(domain, case.tank_at(time + dt)[1]);
        }
        Ok(report)
    }

    fn put(&mut self, time: Real) {
        self.open_gates(time);
    }
}

fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Neighbours => "neighbours",
        Phase::Fluid => "fluid",
        Phase::Pressure => "pressure",
        Phase::Grains => "grains",
        Phase::Coupling => "coupling",
    }
}

pub(crate) fn problem(case: &Case, solver: &Solver, error: &StepError) -> StepProblem {
    let kind = match error {
        StepError::Pressure(PressureError::NotFinite { .. }) | StepError::NotFinite { .. } => "not_finite",
        StepError::Pressure(_) => "pressure",
        StepError::TooFar { .. } => "too_far",
        StepError::TooFast { .. } => "too_fast",
        StepError::Grains(error) => grain_kind(error),
        StepError::Elsewhere(_) => ELSEWHERE,
    };
    let of_grains = if let StepError::Grains(error) = error { Some(error) } else { None };
    StepProblem::new(case, solver.grains().engine(), kind, error, of_grains)
}
