//! What a run needs of a solver: water with grains in it.

pub(crate) mod mics;
pub(crate) mod mps;

use sazanami_dem::{ContactReport, Engine};
use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::snapshot::Snapshot;

use crate::case::meaning::Case;

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

/// A solver as a run drives it.
pub(crate) trait Water: Sized {
    /// A stable next step.
    type Stable: Copy;
    /// What a step did.
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

    /// Iterations of the pressure solver in a step.
    fn pressure_iterations(report: &Self::Report) -> usize;

    /// Contacts of the grains in a step.
    fn contacts(report: &Self::Report) -> &ContactReport;

    /// Everything that a run needs to go on. Collective; complete on rank 0.
    fn snapshot(&mut self) -> Snapshot;
}
