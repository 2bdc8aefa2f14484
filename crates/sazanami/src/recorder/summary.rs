//! `summary.json`: what a run was, did, and found.

use std::collections::BTreeMap;
use std::path::Path;

use sazanami_numerics::Real;
use sazanami_observe::bed_profile;
use sazanami_observe::budget::MomentumBudget;
use sazanami_observe::erosion::{Erosion, ErosionError};
use sazanami_observe::splash::Splash;
use serde_json::{Map, Value, json};

use super::Totals;
use crate::error::Failure;
use crate::run::Status;

/// What a case was asked to find, as it stands.
#[derive(Clone, Debug, Default)]
pub(crate) struct Findings {
    pub bed: Option<BedFindings>,
    pub erosion: Option<Erosion>,
    /// Why there is none at present.
    pub no_erosion: Option<String>,
    pub splash: Option<Splash>,
    pub liquid_relative_change: Real,
    pub wet_relative_change: Real,
}

impl Findings {
    /// Takes up what came of an evaluation of the crater.
    pub fn set_erosion(&mut self, evaluated: Result<Erosion, ErosionError>) {
        (self.erosion, self.no_erosion) = match evaluated {
            Ok(erosion) => (Some(erosion), None),
            Err(problem) => (None, Some(problem.to_string())),
        };
    }

    /// Bed, crater and splash as the summary has them.
    pub fn observables(&self) -> Map<String, Value> {
        let mut observables = Map::new();
        if let Some(bed) = &self.bed {
            observables.insert("bed".into(), json!(bed));
        }
        if let Some(erosion) = &self.erosion {
            observables.insert("erosion".into(), erosion_json(erosion));
        } else if let Some(problem) = &self.no_erosion {
            observables.insert("erosion".into(), json!({ "not_evaluated": problem }));
        }
        if let Some(splash) = &self.splash {
            observables.insert("splash".into(), splash_json(splash));
        }
        observables
    }
}

/// The bed in use before anything hits it.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct BedFindings {
    /// Porosity of the slab.
    pub porosity: Real,
    /// Highest node near the axis [mm].
    pub height_mm: Real,
    /// Mean speed [m/s].
    pub mean_speed: Real,
    /// Order of the long axes: above 0 if they lie.
    pub lying_order: Real,
}

impl BedFindings {
    pub fn of(bed: &sazanami_observe::BedView, floor: Real, height: Real, porosity: Real) -> Self {
        Self {
            porosity,
            height_mm: 1e3 * (height - floor),
            mean_speed: bed_profile::motion(bed).mean_speed,
            lying_order: bed_profile::orientation(bed).map_or(0.0, |order| order.lying_order),
        }
    }
}

/// The parts of the summary that do not change during a run.
#[derive(Clone, Debug)]
pub(crate) struct Fixed {
    pub case: String,
    pub commit: &'static str,
    pub case_hash: String,
    pub cpu: String,
    pub cores: usize,
    pub threads: usize,
    pub ranks: usize,
    pub cells: usize,
    pub contact_spheres_by_shape: Vec<usize>,
}

/// The parts that do.
pub(crate) struct Present<'a> {
    pub status: Status,
    pub failure: Option<&'a Failure>,
    pub time: Real,
    pub steps: u64,
    pub totals: &'a Totals,
    pub grains_by_shape: &'a [usize],
    pub budget: Option<&'a MomentumBudget>,
    pub findings: &'a Findings,
    pub state_hash: Option<u64>,
}

/// The erosion in the units that people compare.
pub(crate) fn erosion_json(erosion: &Erosion) -> Value {
    let mm = |value: Real| 1e3 * value;
    let mm3 = |value: Real| 1e9 * value;
    let crater = &erosion.crater;
    json!({
        "volume_mm3": mm3(crater.volume),
        "volume_uncertainty_mm3": mm3(erosion.volume_uncertainty()),
        "volume_range_mm3": erosion.volume_range.map(mm3),
        "volume_refined_mm3": mm3(crater.refined_volume),
        "volume_noise_mm3": erosion.noise.map(mm3),
        "volume_direct_mm3": mm3(crater.volume_direct),
        "volume_excavated_mm3": erosion.volume_excavated.map(mm3),
        "volume_rim_mm3": erosion.volume_rim.map(mm3),
        "rim_radius_mm": mm(crater.rim_radius),
        "rim_height_mm": mm(crater.rim_height),
        "depth_mm": mm(crater.depth),
        "depth_below_initial_mm": erosion.depth_below_initial.map(mm),
        "rim_at_edge": crater.rim_at_edge,
        "surface_grains": erosion.surface_grains,
        "airborne_grains": erosion.airborne_grains,
    })
}

fn splash_json(splash: &Splash) -> Value {
    json!({
        "grains": splash.grains,
        "mass_mg": 1e6 * splash.mass,
        "farthest_distance_mm": 1e3 * splash.farthest_distance,
        "highest_rise_mm": 1e3 * splash.highest_rise,
        "above_now": splash.above_now,
    })
}

fn momentum_json(budget: &MomentumBudget) -> Value {
    let stock = |stock: &sazanami_observe::budget::MomentumStock| {
        json!({
            "liquid": stock.liquid.to_array(),
            "gas": stock.gas.to_array(),
            "grains": stock.grains.to_array(),
            "displaced": stock.displaced.to_array(),
            "owed_to_grains": stock.owed_to_grains.to_array(),
        })
    };
    let impulses = budget.impulses();
    let named: BTreeMap<&str, [Real; 3]> = sazanami_observe::budget::Impulses::NAMES
        .into_iter()
        .zip(impulses.terms().map(|term| term.to_array()))
        .collect();
    json!({
        "initial": stock(budget.initial()),
        "now": stock(budget.stock()),
        "impulses": named,
        "residual": budget.residual().to_array(),
    })
}

/// Writes the summary, all at once.
pub(crate) fn write(folder: &Path, fixed: &Fixed, present: &Present) -> Result<(), sazanami_io::table::TableError> {
    let totals = present.totals;
    let findings = present.findings;
    let counts: usize = present.grains_by_shape.iter().sum();
    let spheres: usize =
        present.grains_by_shape.iter().zip(&fixed.contact_spheres_by_shape).map(|(grains, each)| grains * each).sum();
    let failure = present.failure.map(failure_json);
    let value = json!({
        "status": present.status,
        "failure": failure,
        "solver": "mics",
        "case": fixed.case,
        "version": env!("CARGO_PKG_VERSION"),
        "commit": fixed.commit,
        "case_hash": fixed.case_hash,
        "machine": {
            "cpu": fixed.cpu, "cores": fixed.cores, "threads": fixed.threads, "ranks": fixed.ranks,
        },
        "time_s": present.time,
        "steps": present.steps,
        "fluid_passes": totals.fluid_passes,
        "grain_substeps": totals.grain_substeps,
        "wall_s": totals.wall_s,
        "phase_s": totals.phase_s,
        "counts": {
            "cells": fixed.cells,
            "fluid_particles": 0,
            "grains": counts,
            "contact_spheres": spheres,
            "contacts": totals.contacts[1],
            "contact_pairs": totals.contacts[0],
        },
        "conservation": {
            "liquid_volume_relative_change": findings.liquid_relative_change,
            "wet_liquid_volume_relative_change": findings.wet_relative_change,
            "momentum_residual_relative": present.budget.map_or(0.0, MomentumBudget::relative_residual),
            "momentum_residual_of_initial": present.budget.and_then(MomentumBudget::residual_of_initial),
        },
        "momentum": present.budget.map(momentum_json),
        "worst": totals.worst,
        "tidied": totals.tidied,
        "limiter": totals.limiter,
        "observables": findings.observables(),
        "state_hash": present.state_hash.map(|hash| format!("{hash:016x}")),
        "files": files(folder),
    });
    sazanami_io::table::write_json(&folder.join("summary.json"), &value)
}

fn failure_json(failure: &Failure) -> Value {
    json!({
        "kind": failure.kind,
        "message": failure.message,
        "step": failure.step,
        "time": failure.time,
        "limiter": failure.limiter,
    })
}

/// Puts the failure that ended the run into the summary there is, if there is one.
pub(crate) fn put_failure(folder: &Path, failure: &Failure) -> Result<(), sazanami_io::table::TableError> {
    let path = folder.join("summary.json");
    let text = std::fs::read_to_string(&path).unwrap_or_default();
    let Ok(Value::Object(mut summary)) = serde_json::from_str(&text) else { return Ok(()) };
    summary.insert("status".into(), json!(Status::Failed));
    summary.insert("failure".into(), failure_json(failure));
    sazanami_io::table::write_json(&path, &Value::Object(summary))
}

/// Brings the list of files in the summary there is up to date.
pub(crate) fn put_files(folder: &Path) -> Result<(), sazanami_io::table::TableError> {
    let path = folder.join("summary.json");
    let text = std::fs::read_to_string(&path).unwrap_or_default();
    let Ok(Value::Object(mut summary)) = serde_json::from_str(&text) else { return Ok(()) };
    summary.insert("files".into(), json!(files(folder)));
    sazanami_io::table::write_json(&path, &Value::Object(summary))
}

/// What lies in the folder of results, relative to it.
fn files(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&next) else { continue };
        for path in entries.flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                folders.push(path);
            } else if let Ok(relative) = path.strip_prefix(folder) {
                found.push(relative.to_string_lossy().into_owned());
            }
        }
    }
    found.sort();
    found
}
