//! One grid for water, air and grains, as a run drives it.

use sazanami_dem::{ContactReport, DemError, Engine, Grain};
use sazanami_mics::pressure::PressureError;
use sazanami_mics::solver::{Phase, Solver, StepError, StepReport};
use sazanami_mics::stability::StableStep;
use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::mean_flow::MeanFlowReport;
use sazanami_numerics::snapshot::Snapshot;

use super::{ELSEWHERE, StepProblem, Water, named_alike};
use crate::case::meaning::Case;
use crate::naming::grain_kind;

impl Water for Solver {
    type Stable = StableStep;
    type Report = StepReport;

    named_alike!();

    fn stable_step(&mut self, case: &Case, time: Real) -> StableStep {
        if gravity_changes(case) {
            self.set_gravity(case.force_by_mass([time; 2]));
        }
        match &case.fluid.carrying_flow {
            Some(carrying) => self.stable_step_carried(carrying),
            None => Self::stable_step(self),
        }
    }

    fn advance(
        &mut self,
        case: &Case,
        time: Real,
        stable: StableStep,
        dt: Real,
        mut watch: impl FnMut(&'static str),
    ) -> Result<StepReport, StepProblem> {
        if gravity_changes(case) {
            self.set_gravity(case.force_by_mass([time, time + dt]));
        }
        if case.drive.is_some() {
            self.drive_by_pressure(case.force_by_volume([time, time + dt]));
        }
        let outcome = match &case.fluid.carrying_flow {
            Some(carrying) => {
                watch(phase_name(Phase::Fluid));
                self.carry(carrying, stable, time, dt)
            }
            None => self.step(stable, dt, |phase| watch(phase_name(phase))),
        };
        outcome.map_err(|error| problem(case, self, &error))
    }
}

/// Whether the force by mass changes with time.
fn gravity_changes(case: &Case) -> bool {
    case.frame.is_some() || case.drive.is_some_and(|drive| drive.oscillation.is_some())
}

fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Fluid => "fluid",
        Phase::Pressure => "pressure",
        Phase::Grains => "grains",
        Phase::Coupling => "coupling",
    }
}

fn problem(case: &Case, solver: &Solver, error: &StepError) -> StepProblem {
    let of_grains = if let StepError::Grains(error) = error { Some(error) } else { None };
    StepProblem::new(case, solver.grains().engine(), kind(error), error, of_grains)
}

/// The failure in one word.
pub(crate) fn kind(error: &StepError) -> &'static str {
    match error {
        StepError::Pressure(PressureError::NotFinite { .. }) | StepError::NotFinite { .. } => "not_finite",
        StepError::Pressure(_) => "pressure",
        StepError::Viscosity(_) => "viscosity",
        StepError::Grains(error) => grain_kind(error),
        StepError::Elsewhere(_) => ELSEWHERE,
    }
}
