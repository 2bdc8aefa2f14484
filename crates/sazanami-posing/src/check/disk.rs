//! Results on disk, and whether they fit there.

use sazanami_numerics::Real;

use super::{CheckReport, CostModel, Size, bytes, particles};
use crate::case::meaning::{Case, Probe, ProbePlace, Schedule};
use crate::case::{Diagnostics, LoadedCase};

/// The report without its charts, and a row of the series in them, of which they hold so many \[bytes].
const REPORT: Real = 1.3e5;
const ROW_OF_CHARTS: Real = 500.0;
const ROWS_OF_CHARTS: Real = 2000.0;
/// Case, log and summary \[bytes].
const SMALL_FILES: Real = 1e4;
/// The pictures of a time on disk \[bytes].
const PICTURES: Real = 1.5e6;
/// A row of the series on disk \[bytes].
const ROW: Real = 600.0;
/// Row of a watched point \[bytes].
const ROW_OF_POINT: Real = 70.0;
/// Row of a place along the surface of the bed or of the water, and the rows of the two layers at a time \[bytes].
const ROW_OF_PLACE: Real = 55.0;
const ROWS_OF_LAYERS: Real = 600.0;
/// Place of a grain that is written as a point \[bytes].
const PLACE_OF_GRAIN: Real = 14.0;
/// Value of a grain that is written as a point \[bytes].
const VALUE_OF_GRAIN: Real = 6.0;
/// Corner of the surface of a grain with its share of the triangles, and a value of the grain, which all corners have \[bytes].
const CORNER: Real = 33.4;
const CORNER_OF_VALUE: Real = 0.07;

/// Name of what every run writes among the results: case, log, summary and report.
const ALWAYS: &str = "always";

/// Results on disk by key of `[output]` \[bytes], the checkpoints kept, and what every run writes.
pub(super) fn disk(case: &Case, size: &Size, [steps, dt]: [Real; 2], model: &CostModel) -> [(&'static str, Real); 7] {
    let outputs = &case.output;
    let (elements, element) = match particles::report(case, &[]) {
        Some(particles) => (particles.fluid, model.disk_point),
        None => (size.cells, model.disk_cell),
    };
    let form = outputs.grain_form;
    let arrays = outputs.grain_arrays.0.len() as Real;
    let point = if form.has_points() { PLACE_OF_GRAIN + arrays * VALUE_OF_GRAIN } else { 0.0 };
    let corner = if form.has_meshes() { CORNER + arrays * CORNER_OF_VALUE } else { 0.0 };
    let grains = size.grains as Real * point + size.surface_corners as Real * corner;
    let until = end_of(case, [steps, dt]);
    let times = |schedule: &Schedule| schedule.count(until, steps);
    let state = elements as Real * 64.0 + size.grains as Real * 600.0;
    let probes = case.probes.iter().map(|probe| times(&probe.schedule) * points(probe) * ROW_OF_POINT).sum();
    [
        ("fields", times(&outputs.fields) * elements as Real * element),
        ("grains", times(&outputs.grains) * grains),
        ("figures", times(&outputs.figures) * PICTURES),
        ("series", times(&outputs.series) * (ROW + profiles(case))),
        ("probe", probes),
        ("checkpoint", (case.checkpoint.keep + 1) as Real * state),
        (ALWAYS, SMALL_FILES + REPORT + ROW_OF_CHARTS * times(&outputs.series).min(ROWS_OF_CHARTS)),
    ]
}

/// When a run of so many steps of a length \[s] ends \[s].
fn end_of(case: &Case, [steps, dt]: [Real; 2]) -> Real {
    if case.run.steps.is_some() { case.run.until.min(steps * dt) } else { case.run.until }
}

/// Files of fields, grains and checkpoints that are written, each complete on the disk before the run goes on.
pub(super) fn files(case: &Case, [steps, dt]: [Real; 2]) -> Real {
    let until = end_of(case, [steps, dt]);
    let (outputs, form) = (&case.output, case.output.grain_form);
    // With the list of the times that there are.
    let of_grains = Real::from(u8::from(form.has_points()) + u8::from(form.has_meshes()) + 1);
    let grains = if case.grains.is_empty() { 0.0 } else { outputs.grains.count(until, steps) * of_grains };
    2.0 * outputs.fields.count(until, steps) + grains + case.checkpoint.schedule().count(until, steps)
}

/// Profiles of moving particles and of the bed below them beside a row of the series \[bytes].
fn profiles(case: &Case) -> Real {
    // Two places a particle, and two a grain size.
    let along = |size: Real| 2.0 * case.domain.extent().x / size * ROW_OF_PLACE;
    let water = case.particles.as_ref().map_or(0.0, |particles| along(particles.spacing));
    water + case.ripples.as_ref().map_or(0.0, |ripples| along(ripples.grain_size) + ROWS_OF_LAYERS)
}

/// Points that a probe watches.
pub(super) fn points(probe: &Probe) -> Real {
    if let ProbePlace::Line { points, .. } = probe.place { points as Real } else { 1.0 }
}

/// Warns of results that do not fit onto the disk, of which `available` bytes are free, and names what takes most.
pub fn warn_of_disk(loaded: &LoadedCase, report: &CheckReport, available: Option<u64>, warnings: &mut Diagnostics) {
    let Some(free) = available.map(|free| free as Real).filter(|&free| report.disk_bytes > free) else { return };
    let parts = report.disk_parts.into_iter().filter(|(name, _)| *name != ALWAYS);
    let Some((most, share)) = parts.max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let span = match most {
        "checkpoint" => loaded.places.of("checkpoint"),
        "probe" => loaded.places.of("probe.0"),
        _ => loaded.places.of("output"),
    };
    let key = if ["checkpoint", "probe"].contains(&most) { most.to_owned() } else { format!("output.{most}") };
    warnings
        .warning(span, "the results do not fit onto the disk")
        .label(format!("about {}, of which {} are free", bytes(report.disk_bytes), bytes(free)))
        .help(format!("write `{key}` less often: it takes {}", bytes(share)));
}
