//! `summary.json`: what a run was, did, and found.

use std::path::Path;

use sazanami_io::table::{TableError, write_json};
use sazanami_numerics::Real;
use sazanami_observe::heap::{Heap, HeapError};
use serde_json::{Map, Value, json};

use super::bed::{BED, BedFindings, heap_json};
use super::files::Fixed;
use super::observer::SummaryParts;
use crate::columns::{Field, object, quantities};
use crate::error::Failure;
use crate::job::{CORRECTIONS, PARTICLES, Status, Totals, WORST};
use crate::results::{self, SUMMARY};

/// The parts of the summary that change during a run.
pub(crate) struct Present<'a> {
    pub status: Status,
    pub failure: Option<&'a Failure>,
    pub time: Real,
    pub steps: u64,
    pub totals: &'a Totals,
    pub grains_by_shape: &'a [usize],
    /// The bed as it was last measured.
    pub bed: Option<&'a BedFindings>,
    /// The heap as it was last measured.
    pub heap: Option<&'a Result<Heap, HeapError>>,
    pub parts: SummaryParts,
    pub state_hash: Option<u64>,
}

/// Numbers of cells, particles, grains and contacts of a run.
pub(super) struct Counts {
    cells: usize,
    fluid_particles: usize,
    grains: usize,
    contact_spheres: usize,
    /// Pairs in contact, touching contact spheres.
    contacts: [usize; 2],
}

/// Fields of `counts`.
pub(super) const COUNTS: &[Field<Counts>] = quantities! {
    "cells", "", "cells of the grid" => |counts| json!(counts.cells);
    "fluid_particles", "", "moving particles of fluid" => |counts| json!(counts.fluid_particles);
    "grains", "", "grains" => |counts| json!(counts.grains);
    "contact_spheres", "", "contact spheres of all grains" => |counts| json!(counts.contact_spheres);
    "contacts", "", "touching pairs of contact spheres in the last step, of the packing where none followed" => |counts| json!(counts.contacts[1]);
    "contact_pairs", "", "pairs of touching grains in the last step, of the packing where none followed" => |counts| json!(counts.contacts[0]);
};

/// Writes the summary, all at once.
pub(crate) fn write(folder: &Path, fixed: &Fixed, present: &Present) -> Result<(), TableError> {
    let totals = present.totals;
    let mut observables = present.parts.observables.clone();
    if let Some(bed) = present.bed.filter(|bed| bed.is_bed()) {
        observables.insert("bed".into(), Value::Object(object(BED, bed)));
    }
    observables.extend(present.heap.map(|heap| ("heap".into(), heap_json(heap))));
    let grains = present.grains_by_shape;
    let counts = Counts {
        cells: fixed.cells,
        fluid_particles: present.parts.particles,
        grains: grains.iter().sum(),
        contact_spheres: grains.iter().zip(&fixed.contact_spheres_by_shape).map(|(count, each)| count * each).sum(),
        contacts: totals.contacts,
    };
    let failure = present.failure.map(failure_json);
    let value = json!({
        "status": present.status,
        "failure": failure,
        "solver": fixed.solver,
        "case": fixed.case,
        "version": env!("CARGO_PKG_VERSION"),
        "commit": fixed.commit,
        "case_hash": fixed.case_hash,
        "machine": {
            "cpu": fixed.cpu, "cores": fixed.cores, "threads": fixed.workers.threads, "ranks": fixed.workers.ranks,
            "hosts": fixed.workers.hosts, "mpi": fixed.workers.mpi, "sums": fixed.workers.sums,
        },
        "history": fixed.history.as_ref().map(|history| json!({
            "ranks": history.ranks, "sums": history.sums, "programs": history.programs, "ends_s": history.ends,
        })),
        "time_s": present.time,
        "steps": present.steps,
        "fluid_passes": totals.fluid_passes,
        "grain_substeps": totals.grain_substeps,
        "wall_s": totals.wall_s,
        "phase_s": totals.phase_s,
        "counts": object(COUNTS, &counts),
        "conservation": present.parts.conservation,
        "momentum": present.parts.momentum,
        "worst": object(WORST, &totals.worst),
        "corrections": object(CORRECTIONS, &totals.corrections),
        "particles": totals.particles.map(|particles| object(PARTICLES, &particles)),
        "limiter": totals.limiter,
        "observables": observables,
        "state_hash": present.state_hash.map(|hash| format!("{hash:016x}")),
        "files": results::written(folder),
    });
    write_json(&folder.join(SUMMARY), &value)
}

fn failure_json(failure: &Failure) -> Value {
    json!({
        "kind": failure.kind,
        "message": failure.message,
        "step": failure.step,
        "time": failure.time,
        "limiter": failure.limiter,
        "rank": failure.rank,
    })
}

/// Puts the failure that ended the run into the summary there is, if there is one.
pub(crate) fn put_failure(folder: &Path, failure: &Failure) -> Result<(), TableError> {
    amend(folder, |summary| {
        summary.insert("status".into(), json!(Status::Failed));
        summary.insert("failure".into(), failure_json(failure));
    })
}

/// Brings the list of files in the summary there is up to date.
pub(crate) fn put_files(folder: &Path) -> Result<(), TableError> {
    amend(folder, |summary| drop(summary.insert("files".into(), json!(results::written(folder)))))
}

/// Adds what the tables of a whole run show of its ripples to what the summary has of them at the end.
pub(crate) fn put_ripples(folder: &Path, found: Map<String, Value>) -> Result<(), TableError> {
    amend(folder, |summary| {
        let observables = summary.entry("observables").or_insert_with(|| json!({}));
        let ripples = observables.as_object_mut().map(|all| all.entry("ripples").or_insert_with(|| json!({})));
        if let Some(ripples) = ripples.and_then(Value::as_object_mut) {
            ripples.extend(found);
        }
    })
}

/// Changes the summary in a folder, if there is a good one.
fn amend(folder: &Path, change: impl FnOnce(&mut Map<String, Value>)) -> Result<(), TableError> {
    let path = folder.join(SUMMARY);
    let text = std::fs::read_to_string(&path).unwrap_or_default();
    let Ok(Value::Object(mut summary)) = serde_json::from_str(&text) else { return Ok(()) };
    let before = summary.clone();
    change(&mut summary);
    if summary == before { Ok(()) } else { write_json(&path, &Value::Object(summary)) }
}
