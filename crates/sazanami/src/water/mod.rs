//! Interface of a run to its solver: water with grains in it.

pub(crate) mod mics;
pub(crate) mod mps;

use sazanami_dem::{ContactReport, DemError, Engine, Grain};
use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::mean_flow::{MeanFlow, MeanFlowReport};
use sazanami_numerics::snapshot::{Snapshot, SnapshotError};

use crate::case::meaning::{Case, Softening};
use crate::naming::grain_error;

/// Why a step could not be completed.
#[derive(Clone, Debug)]
pub(crate) struct StepProblem {
    /// Kind in one word, as in [`crate::error::Failure`].
    pub kind: &'static str,
    /// Whether another rank has the reason.
    pub elsewhere: bool,
    /// In a sentence, in the terms of the case.
    pub message: String,
}

/// Kind of a failure that another rank reports.
pub(crate) const ELSEWHERE: &str = "elsewhere";

impl StepProblem {
    /// The `error` of a step; what went wrong among the grains in the names of the case.
    fn new(
        case: &Case,
        engine: &Engine,
        kind: &'static str,
        error: &impl std::fmt::Display,
        of_grains: Option<&DemError>,
    ) -> Self {
        let message = of_grains.map_or_else(|| error.to_string(), |error| grain_error(case, engine.walls(), error));
        Self { kind, elsewhere: kind == ELSEWHERE, message }
    }
}

/// Methods that the solvers and their reports name alike.
macro_rules! named_alike {
    () => {
        fn domain(&self) -> &Domain {
            self.domain()
        }

        fn engine(&self) -> &Engine {
            self.grains().engine()
        }

        fn length(stable: Self::Stable) -> (Real, &'static str) {
            (stable.dt, stable.limit.name())
        }

        fn pressure_iterations(report: &StepReport) -> usize {
            report.pressure.iterations
        }

        fn contacts(report: &StepReport) -> &ContactReport {
            &report.contacts
        }

        fn release(&mut self, which: impl Fn(u64) -> bool + Sync) -> Result<usize, DemError> {
            self.release(which)
        }

        fn soften(&mut self, softening: &crate::case::meaning::Softening) {
            self.soften_contacts(softening.stiffness, softening.largest_overlap);
        }

        fn feed(&mut self, fed: &[Grain], which: impl Fn(u64) -> bool + Sync) -> Result<(), DemError> {
            self.feed(fed, which)
        }

        fn watch_contacts(&mut self, grains: impl Iterator<Item = u64>) {
            self.watch_contacts(grains);
        }

        fn mean_flow(report: &StepReport) -> Option<&MeanFlowReport> {
            report.mean_flow.as_ref()
        }

        fn snapshot(&mut self) -> Snapshot {
            self.snapshot()
        }
    };
}
use named_alike;

/// A solver as a run drives it.
pub(crate) trait Water: Sized {
    /// A stable next step.
    type Stable: Copy;
    /// Report of a step.
    type Report;

    /// This rank's part of the box.
    fn domain(&self) -> &Domain;

    /// The grains of this rank, with their contacts.
    fn engine(&self) -> &Engine;

    /// The longest stable next step from `time` \[s].
    fn stable_step(&mut self, case: &Case, time: Real) -> Self::Stable;

    /// Its length \[s] and the limit that rules it.
    fn length(stable: Self::Stable) -> (Real, &'static str);

    /// Goes from `time` on by `dt` \[s]; `watch` gets the name of each phase as it begins.
    fn advance(
        &mut self,
        case: &Case,
        time: Real,
        stable: Self::Stable,
        dt: Real,
        watch: impl FnMut(&'static str),
    ) -> Result<Self::Report, StepProblem>;

    /// Puts what moves by the clock alone where it is at `time` \[s]: gates.
    fn put(&mut self, _time: Real) {}

    /// Iterations of the pressure solver in a step.
    fn pressure_iterations(report: &Self::Report) -> usize;

    /// Contacts of the grains in a step.
    fn contacts(report: &Self::Report) -> &ContactReport;

    /// Lets the held grains whose identifier `which` takes move from now on; returns how many did not before. Collective.
    fn release(&mut self, which: impl Fn(u64) -> bool + Sync) -> Result<usize, DemError>;

    /// Leaves a part of the stiffness of contacts from now on. Collective.
    fn soften(&mut self, softening: &Softening);

    /// Feeds in grains, which every rank gives alike, and lets those go whose identifier `which` takes. Collective.
    fn feed(&mut self, fed: &[Grain], which: impl Fn(u64) -> bool + Sync) -> Result<(), DemError>;

    /// Watches the contacts of grains, by their identifiers: [`Engine::watched`].
    fn watch_contacts(&mut self, grains: impl Iterator<Item = u64>);

    /// The mean velocity that is held, if one is, and the force that held it in a step.
    fn mean_flow(report: &Self::Report) -> Option<&MeanFlowReport>;

    /// Everything that a run needs to go on. Collective; complete on rank 0.
    fn snapshot(&mut self) -> Snapshot;
}

/// The mean velocity that the case holds, if it holds one: new, or as a checkpoint has it.
pub(crate) fn mean_flow(case: &Case, resumed: Option<&Snapshot>) -> Result<Option<MeanFlow>, SnapshotError> {
    let Some(settings) = case.mean_flow() else { return Ok(None) };
    Ok(Some(match resumed {
        Some(snapshot) => MeanFlow::restore(settings, snapshot)?,
        None => MeanFlow::new(settings),
    }))
}
