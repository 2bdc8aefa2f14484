//! Observations of a run, found again from one of its checkpoints: as its case evaluates it, or with other keys.

use sazanami_dem::Engine;
use sazanami_mics::boundary::Boundary;
use sazanami_mics::snapshot::GRAINS;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_observe::erosion::{Erosion, InitialBed};
use sazanami_observe::heap::{Heap, HeapError};
use sazanami_observe::splash::SplashTracker;
use sazanami_observe::{BedView, Body, GatheredBed};
use sazanami_posing::assembly::grains;
use serde_json::{Map, Value, json};

use super::CLOCK;
use super::bed::{BED, BedFindings, BedSettings, bed_findings, heap_json, heap_settings};
use super::mics::{BEFORE, Findings, crater_course, drops, erosion_settings, initial_heights};

use crate::case::meaning::{Case, Erosion as Evaluation};
use crate::columns::object;
use crate::error::CommandError;

/// Grains of a run as a checkpoint keeps them: as they lay before the impact, and as they lie.
pub(crate) struct Beds {
    snapshot: Snapshot,
    now: GatheredBed,
    before: Option<GatheredBed>,
    /// Whether grains have left the box.
    left: bool,
}

/// Results found again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reevaluated {
    bed: Option<BedFindings>,
    heap: Option<Result<Heap, HeapError>>,
    findings: Findings,
    /// Why the splash cannot be evaluated.
    no_splash: Option<&'static str>,
}

/// Whether a section of a checkpoint is needed to evaluate it again: the fluid is not.
pub(crate) fn is_observed(section: &str) -> bool {
    !section.starts_with("fluid/")
}

impl Beds {
    /// Rebuilds the grains of `case` from the sections of a checkpoint that [`is_observed`] names.
    ///
    /// # Errors
    /// If the sections are not those of a run of this case.
    pub fn of(case: &Case, shapes: &[Shape], snapshot: Snapshot) -> Result<Self, CommandError> {
        let misfit = |problem: &dyn std::fmt::Display| {
            CommandError::input(
                format!("the checkpoint does not fit the case: {problem}"),
                "put `case.toml` back as `sazanami run` wrote it",
            )
        };
        for (what, known) in [("shape", shapes.len()), ("material", case.materials.len())] {
            let numbers = snapshot.u32(&format!("{GRAINS}grain.{what}")).map_err(|error| misfit(&error))?;
            if numbers.iter().any(|&number| number as usize >= known) {
                return Err(misfit(&format!("it holds grains of a {what} that the case does not have")));
            }
        }
        let periodic = Boundary::new(case.boundary).map_err(|error| misfit(&error))?.periodic();
        let domain = Domain::solo(case.domain.grid(), periodic);
        let setup = grains::setup(case, shapes);
        let engine = Engine::restore(&domain, setup, GRAINS, &snapshot).map_err(|error| misfit(&error))?;
        let mut now = GatheredBed::default();
        now.gather(&domain, engine.grains(), engine.time());
        // Grains may have left or been fed in since then, of shapes that the case has.
        let known = |before: &GatheredBed| before.grains.body.iter().all(|&shape| (shape as usize) < shapes.len());
        let before = GatheredBed::restore(BEFORE, &snapshot).ok().filter(known);
        let left = engine.departures().grains > 0;
        Ok(Self { snapshot, now, before, left })
    }

    /// Whether the bed before the impact is known: checkpoints of earlier versions do not have it.
    pub fn know_before(&self) -> bool {
        self.before.is_some()
    }

    /// Evaluates the grains as `case` says; `own` is the case as the run had it.
    pub fn evaluate(&self, case: &Case, own: &Case, shapes: &[Shape]) -> Reevaluated {
        let mut found = Reevaluated::default();
        if self.now.grains.id.is_empty() && !self.left {
            return found;
        }
        let bodies: Vec<Body> = shapes.iter().map(Body::of).collect();
        let now = self.now.view(&bodies);
        let before = self.before.as_ref().map(|before| before.view(&bodies));
        found.bed = match &before {
            Some(before) => Some(BedSettings::of(case).measure(before)),
            None => bed_findings(&self.snapshot),
        };
        found.heap = heap_settings(case).map(|settings| Heap::of(&now, &settings));
        if let Some(settings) = erosion_settings(case) {
            (found.findings.drops, found.findings.floor) = (drops(case), case.domain.lower.z);
            let initial: Option<InitialBed> = match &before {
                Some(before) => Erosion::of(before, &settings, None).ok().as_ref().map(Erosion::as_initial),
                None => initial_heights(&self.snapshot),
            };
            found.findings.set_erosion(Erosion::of(&now, &settings, initial.as_ref()));
            if let Ok(&[time]) = self.snapshot.reals(CLOCK) {
                let course = crater_course(&self.snapshot);
                match erosion_settings(own) {
                    Some(of_run) if of_run == settings => found.findings.set_rest(&course, time),
                    // Of the course with other settings nothing is known: whether the crater rests is as in the run.
                    Some(of_run) => {
                        let mut in_the_run = Findings::default();
                        let initial = initial_heights(&self.snapshot);
                        in_the_run.set_erosion(Erosion::of(&now, &of_run, initial.as_ref()));
                        in_the_run.set_rest(&course, time);
                        found.findings.rests_in_the_run = in_the_run.known().at_rest;
                    }
                    None => {}
                }
            }
        }
        self.evaluate_splash(case, own, &now, &mut found);
        found
    }

    /// Splash for the threshold and the axis of the run, whose whole course tells which grains were splashed.
    fn evaluate_splash(&self, case: &Case, own: &Case, now: &BedView, found: &mut Reevaluated) {
        let watched = |erosion: &Evaluation| (erosion.axis, erosion.grain_size);
        let (Some(asked), Some(settings)) = (case.erosion.as_ref().map(watched), erosion_settings(case)) else {
            return;
        };
        match SplashTracker::restore(&self.snapshot) {
            Ok(mut tracker) if own.erosion.as_ref().map(watched) == Some(asked) => {
                let seen = |bed: &BedView| tracker.observe(bed);
                found.findings.splash = Some(settings.ground().seen_from(settings.axis, now, seen));
            }
            _ => found.no_splash = Some("it was not followed with this axis and this grain size during the run"),
        }
    }
}

impl Reevaluated {
    /// Bed, heap, crater and splash in the form of the summary.
    pub fn observables(&self) -> Map<String, Value> {
        let mut observables = self.findings.observables();
        if let Some(bed) = self.bed.as_ref().filter(|bed| bed.is_bed()) {
            observables.insert("bed".into(), Value::Object(object(BED, bed)));
        }
        observables.extend(self.heap.as_ref().map(|heap| ("heap".into(), heap_json(heap))));
        if let Some(problem) = self.no_splash {
            observables.insert("splash".into(), json!({ "not_evaluated": problem }));
        }
        if self.findings.erosion.is_some() {
            observables.insert("soaked".into(), json!({ "not_evaluated": "the water is not looked at again" }));
        }
        observables
    }
}
