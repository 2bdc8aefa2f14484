//! Rows of the series, the profiles of bed and water, and the averages over layers.

use sazanami_io::table::{Column, Value};
use sazanami_mps::solver::{Solver, StepReport};
use sazanami_numerics::Real;
use sazanami_observe::ripples::{BedSurfaces, LayerMeans, Ripples, SurfaceProfile, Tank, Unmeasured};
use serde_json::json;

use super::{Found, ParticleBooks, Stock};
use crate::clock::Clock;
use crate::recorder::books::Step;
use crate::recorder::columns::{LENGTH, Quantity, columns as named, length, missing};
use crate::recorder::files::Files;
use crate::recorder::{RecordError, Totals};
use crate::results::{BED_PROFILES, LAYER_MEANS, WATER_PROFILES};

/// Time of a row.
const TIME: [Quantity; 1] = [("time", "s")];
/// What the last step did.
const OF_STEP: [Quantity; 24] = [
    ("pressure_iterations", ""),
    ("pressure_residual", ""),
    ("removed_mean_strain", ""),
    ("strain_mean", ""),
    ("strain_rms", ""),
    ("surface_particles", ""),
    ("splash_particles", ""),
    ("plain_gradients", ""),
    ("released_walls", ""),
    ("cut_coefficients", ""),
    ("held_rows", ""),
    ("pushed_pairs", ""),
    ("push_work", "J"),
    ("largest_shift", "m"),
    ("collisions", ""),
    ("clipped_particles", ""),
    ("cut_voids", ""),
    ("least_void_fraction", ""),
    ("largest_fluid_speed", "m/s"),
    ("largest_grain_speed", "m/s"),
    ("grain_substeps", ""),
    ("contacts", ""),
    ("largest_overlap", ""),
    ("contact_force_over_submerged_weight", ""),
];
/// What is kept, or should be.
const CONSERVED: [Quantity; 11] = [
    ("bulk_volume_relative_change", ""),
    ("kinetic_energy_fluid", "J"),
    ("kinetic_energy_grains", "J"),
    ("potential_energy", "J"),
    ("momentum_1", "N s"),
    ("momentum_2", "N s"),
    ("momentum_3", "N s"),
    ("drag_exchange_residual", "N s"),
    ("fluid_momentum_residual_1", "N s"),
    ("fluid_momentum_residual_2", "N s"),
    ("fluid_momentum_residual_3", "N s"),
];
/// Where grains and water are.
const PLACES: [Quantity; 7] = [
    ("grain_height", "m"),
    ("bed_law_share", ""),
    ("front", "m"),
    ("water_level_mean", "m"),
    ("water_level_highest", "m"),
    ("water_level_lowest", "m"),
    ("particles_above_rim", ""),
];
/// What the bed is like.
const OF_BED: [Quantity; 8] = [
    ("bed_relief", "m"),
    ("ripple_height", "m"),
    ("ripple_crest_to_trough", "m"),
    ("ripple_wavelength_spectrum", "m"),
    ("ripple_wavelength_crossings", "m"),
    ("ripple_wavelength_correlation", "m"),
    ("ripple_steepness", ""),
    ("suspended_grains", ""),
];
/// Averages over a layer at a time.
const OF_LAYER: [Quantity; 8] = [
    ("time", "s"),
    ("layer", ""),
    ("water_velocity_1", "m/s"),
    ("grain_velocity_1", "m/s"),
    ("drag_1", "N"),
    ("pressure_force_1", "N"),
    ("water_particles", ""),
    ("grains", ""),
];

pub(super) fn columns() -> Vec<Column> {
    named(&[&TIME, &LENGTH, &OF_STEP, &CONSERVED, &PLACES, &OF_BED])
}

/// Adds rows to the series and to the other tables.
pub(super) fn rows(
    books: &ParticleBooks,
    clock: &Clock,
    step: Option<&Step<'_, Solver>>,
    totals: &Totals,
    files: &mut Files,
) -> Result<(), RecordError> {
    files.row(clock, &values(books, clock, step, totals))?;
    files.add(WATER_PROFILES, || profile_columns(&["z"]), clock, &water_rows(clock, &books.water))?;
    let Some(found) = &books.found else { return Ok(()) };
    let heights = ["z_concentration", "z_image", "z_top_layer"];
    files.add(BED_PROFILES, || profile_columns(&heights), clock, &bed_rows(clock, &found.bed))?;
    let of_layers = ["lower", "upper"].iter().zip(&found.layers);
    let rows: Vec<Vec<Value>> = of_layers.map(|(name, means)| of_layer(clock, name, means).to_vec()).collect();
    files.add(LAYER_MEANS, || named(&[&OF_LAYER]), clock, &rows)
}

/// Heights of the water's surface, a row for each place.
fn water_rows(clock: &Clock, surface: &SurfaceProfile) -> Vec<Vec<Value>> {
    let row = |n: usize| vec![clock.time().into(), surface.x(n).into(), surface.heights[n].into()];
    (0..surface.len()).map(row).collect()
}

/// Heights of the bed's surface in its three definitions, a row for each place of the main one.
fn bed_rows(clock: &Clock, bed: &BedSurfaces) -> Vec<Vec<Value>> {
    let main = &bed.concentration;
    let row = |n: usize| {
        let x = main.x(n);
        vec![clock.time().into(), x.into(), main.heights[n].into(), bed.image.at(x).into(), bed.top_layer.at(x).into()]
    };
    (0..main.len()).map(row).collect()
}

fn of_layer(clock: &Clock, name: &str, means: &LayerMeans) -> [Value; OF_LAYER.len()] {
    [
        clock.time().into(),
        name.into(),
        means.water_velocity.into(),
        means.grain_velocity.into(),
        means.drag.into(),
        means.pressure_force.into(),
        means.water_count.into(),
        means.grain_count.into(),
    ]
}

fn profile_columns(heights: &[&str]) -> Vec<Column> {
    let mut columns = vec![Column::new("time", "s"), Column::new("x", "m")];
    columns.extend(heights.iter().map(|name| Column::new(name, "m")));
    columns
}

fn values(books: &ParticleBooks, clock: &Clock, step: Option<&Step<'_, Solver>>, totals: &Totals) -> Vec<Value> {
    let mut row = vec![clock.time().into()];
    row.extend(step.map_or_else(missing, |step| length(step, totals)));
    row.extend(step.map_or_else(missing, |step| of_step(&books.stock, step.report)));
    row.extend(conserved(books));
    row.extend(places(books));
    row.extend(books.found.as_ref().map_or_else(missing, of_bed));
    row
}

fn of_step(stock: &Stock, report: &StepReport) -> [Value; OF_STEP.len()] {
    let (pressure, contacts) = (&report.pressure, &report.contacts);
    let carried = (stock.submerged_weight > 0.0).then(|| stock.carried_weight / stock.submerged_weight);
    [
        pressure.iterations.into(),
        pressure.residual.into(),
        pressure.removed_mean.into(),
        report.strain[0].into(),
        report.strain[1].into(),
        report.surface.into(),
        report.isolated.into(),
        report.uncorrected_gradients.into(),
        report.tensile_cutoffs.into(),
        pressure.cut_coefficients.into(),
        pressure.limited_rows.into(),
        report.stabilised_pairs.into(),
        report.stabilisation_work.into(),
        report.largest_shift.into(),
        report.collisions.into(),
        report.clipped.into(),
        report.coupling.cut_voids.into(),
        report.coupling.least_void.into(),
        report.largest_speed.into(),
        contacts.largest_speed.into(),
        contacts.substeps.into(),
        contacts.contacts.into(),
        contacts.largest_overlap.into(),
        carried.into(),
    ]
}

fn conserved(books: &ParticleBooks) -> [Value; CONSERVED.len()] {
    let (stock, residual) = (&books.stock, books.momentum.residual());
    [
        books.volume_change().into(),
        stock.fluid_energy.into(),
        stock.grain_energy.into(),
        stock.potential_energy.into(),
        stock.momentum.x.into(),
        stock.momentum.y.into(),
        stock.momentum.z.into(),
        books.momentum.impulses().drag_residual().length().into(),
        residual.x.into(),
        residual.y.into(),
        residual.z.into(),
    ]
}

fn places(books: &ParticleBooks) -> [Value; PLACES.len()] {
    let (stock, water) = (&books.stock, &books.water);
    let has_grains = !books.sight.grains.is_empty();
    let level = |pick: fn(Real, Real) -> Real| water.points().map(|[_, z]| z).reduce(pick);
    [
        has_grains.then_some(stock.grain_height).into(),
        has_grains.then_some(stock.bed_share).into(),
        stock.front.is_finite().then_some(stock.front).into(),
        water.mean().into(),
        level(Real::max).into(),
        level(Real::min).into(),
        books.rim.as_ref().map(|rim| rim.above).into(),
    ]
}

fn of_bed(found: &Found) -> [Value; OF_BED.len()] {
    let main = found.ripples[0].as_ref().ok();
    let of = |value: fn(&Ripples) -> Result<Real, Unmeasured>| main.and_then(|ripples| value(ripples).ok()).into();
    [
        found.relief.into(),
        of(|ripples| Ok(ripples.height())),
        of(|ripples| ripples.crest_to_trough),
        of(|ripples| Ok(ripples.spectral_wavelength)),
        of(|ripples| ripples.crossing_wavelength),
        of(|ripples| ripples.correlation_wavelength),
        of(Ripples::steepness),
        found.bed.suspended.into(),
    ]
}

/// Ripples of one surface in the form of the summary; lengths in mm. Where there are none it says why.
pub(crate) fn surface_json(
    ripples: &Result<Ripples, Unmeasured>,
    profile: &SurfaceProfile,
    tank: &Tank,
) -> serde_json::Value {
    let mean_height = profile.mean().map(|z| 1e3 * (z - tank.floor));
    match ripples {
        Ok(ripples) => {
            let mm = |value: &Result<Real, Unmeasured>| value.as_ref().ok().map(|value| 1e3 * value);
            json!({
                "wavelength_mm": 1e3 * ripples.spectral_wavelength,
                "wavelength_crossings_mm": mm(&ripples.crossing_wavelength),
                "wavelength_correlation_mm": mm(&ripples.correlation_wavelength),
                "height_mm": 1e3 * ripples.height(),
                "crest_to_trough_mm": mm(&ripples.crest_to_trough),
                "steepness": ripples.steepness().ok(),
                "relief_mm": 1e3 * ripples.relief,
                "waves": ripples.waves,
                "mean_height_mm": mean_height,
            })
        }
        Err(problem) => json!({ "not_measured": problem.to_string(), "mean_height_mm": mean_height }),
    }
}

/// Ripples in the form of the summary: of the main surface, with those of the others in it.
pub(super) fn ripples_json(found: &Found, tank: &Tank) -> serde_json::Value {
    let of = |ripples, profile| surface_json(ripples, profile, tank);
    let mut main = of(&found.ripples[0], &found.bed.concentration);
    if let Some(main) = main.as_object_mut() {
        main.insert("image".into(), of(&found.ripples[1], &found.bed.image));
        main.insert("top_layer".into(), of(&found.ripples[2], &found.bed.top_layer));
        main.insert("relief_mm".into(), json!(found.relief.map(|relief| 1e3 * relief)));
        main.insert("suspended_grains".into(), json!(found.bed.suspended));
    }
    main
}
