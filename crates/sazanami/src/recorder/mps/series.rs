//! Rows of the series, the profiles of bed and water, and the averages over layers.

use sazanami_io::table::{Column, Value};
use sazanami_mps::solver::Solver;
use sazanami_numerics::Real;
use sazanami_observe::ripples::{Ripples, SurfaceProfile, Tank, Unmeasured};
use serde_json::json;

use super::{Found, ParticleBooks};
use crate::clock::Clock;
use crate::recorder::RecordError;
use crate::recorder::books::Step;
use crate::recorder::files::Files;

/// Profiles of the bed's surface.
pub(crate) const BED: &str = "bed.csv";
/// Profiles of the water's surface.
pub(crate) const WATER: &str = "water.csv";
/// Averages over layers.
pub(crate) const LAYERS: &str = "layers.csv";

pub(super) fn columns() -> Vec<Column> {
    let named = [
        ("time", "s"),
        ("dt", "s"),
        ("limiter", ""),
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
        ("grain_height", "m"),
        ("bed_law_share", ""),
        ("front", "m"),
        ("water_level_mean", "m"),
        ("water_level_highest", "m"),
        ("water_level_lowest", "m"),
        ("bed_relief", "m"),
        ("ripple_height", "m"),
        ("ripple_crest_to_trough", "m"),
        ("ripple_wavelength_spectrum", "m"),
        ("ripple_wavelength_crossings", "m"),
        ("ripple_wavelength_correlation", "m"),
        ("ripple_steepness", ""),
        ("suspended_grains", ""),
    ];
    named.iter().map(|(name, unit)| Column::new(name, unit)).collect()
}

/// Adds rows to the series and to the other tables.
pub(super) fn rows(
    books: &ParticleBooks,
    clock: &Clock,
    step: Option<&Step<'_, Solver>>,
    files: &mut Files,
) -> Result<(), RecordError> {
    files.row(clock, &values(books, clock, step))?;
    let time = Value::Real(clock.time());
    let optional = |value: Option<Real>| value.map_or(Value::Missing, Value::Real);
    let surface = &books.water;
    let rows: Vec<Vec<Value>> = (0..surface.len())
        .map(|n| vec![time.clone(), Value::Real(surface.x(n)), optional(surface.heights[n])])
        .collect();
    files.add(WATER, || profile_columns(&["z"]), clock, &rows)?;
    let Some(found) = &books.found else { return Ok(()) };
    let bed = &found.bed.concentration;
    let rows: Vec<Vec<Value>> = (0..bed.len())
        .map(|n| {
            let x = bed.x(n);
            let others = [&found.bed.image, &found.bed.top_layer].map(|profile| optional(profile.at(x)));
            let [image, top_layer] = others;
            vec![time.clone(), Value::Real(x), optional(bed.heights[n]), image, top_layer]
        })
        .collect();
    files.add(BED, || profile_columns(&["z_concentration", "z_image", "z_top_layer"]), clock, &rows)?;
    let rows: Vec<Vec<Value>> = ["lower", "upper"]
        .iter()
        .zip(&found.layers)
        .map(|(name, means)| {
            vec![
                time.clone(),
                Value::Text((*name).to_owned()),
                optional(means.water_velocity),
                optional(means.grain_velocity),
                optional(means.drag),
                optional(means.pressure_force),
                Value::Count(means.water_count as u64),
                Value::Count(means.grain_count as u64),
            ]
        })
        .collect();
    let columns = || {
        let named = [
            ("time", "s"),
            ("layer", ""),
            ("water_velocity_1", "m/s"),
            ("grain_velocity_1", "m/s"),
            ("drag_1", "N"),
            ("pressure_force_1", "N"),
            ("water_particles", ""),
            ("grains", ""),
        ];
        named.iter().map(|(name, unit)| Column::new(name, unit)).collect()
    };
    files.add(LAYERS, columns, clock, &rows)
}

fn profile_columns(heights: &[&str]) -> Vec<Column> {
    let mut columns = vec![Column::new("time", "s"), Column::new("x", "m")];
    columns.extend(heights.iter().map(|name| Column::new(name, "m")));
    columns
}

fn values(books: &ParticleBooks, clock: &Clock, step: Option<&Step<'_, Solver>>) -> Vec<Value> {
    let real = Value::Real;
    let count = |n: usize| Value::Count(n as u64);
    let stock = &books.stock;
    let mut row = vec![real(clock.time())];
    match step {
        Some(Step { dt, limit, report }) => {
            let supported = report.contacts.impulse_on_walls.z / dt;
            let weight = stock.submerged_weight;
            row.extend([
                real(*dt),
                Value::Text((*limit).to_owned()),
                count(report.pressure.iterations),
                real(report.pressure.residual),
                real(report.pressure.removed_mean),
                real(report.strain[0]),
                real(report.strain[1]),
                count(report.surface),
                count(report.splashes),
                count(report.plain_gradients),
                count(report.released_walls),
                count(report.pressure.cut_coefficients),
                count(report.pressure.held_rows),
                count(report.pushed_pairs),
                real(report.push_work),
                real(report.largest_shift),
                count(report.collisions),
                count(report.clipped),
                count(report.coupling.cut_voids),
                real(report.coupling.least_void),
                real(report.largest_speed),
                real(report.contacts.largest_speed),
                count(report.contacts.substeps),
                count(report.contacts.contacts),
                real(report.contacts.largest_overlap),
                if weight > 0.0 { real(-supported / weight) } else { Value::Missing },
            ]);
        }
        None => row.extend(std::iter::repeat_with(|| Value::Missing).take(26)),
    }
    let change = if books.first_volume > 0.0 { stock.volume / books.first_volume - 1.0 } else { 0.0 };
    let residual = books.fluid_residual;
    row.extend([
        real(change),
        real(stock.fluid_energy),
        real(stock.grain_energy),
        real(stock.potential_energy),
        real(stock.momentum.x),
        real(stock.momentum.y),
        real(stock.momentum.z),
        real(books.drag_residual().length()),
        real(residual.x),
        real(residual.y),
        real(residual.z),
    ]);
    let optional = |value: Option<Real>| value.map_or(Value::Missing, real);
    let has_grains = !books.sight.grains.is_empty();
    row.extend([
        optional(has_grains.then_some(stock.grain_height)),
        optional(has_grains.then_some(stock.bed_share)),
        optional(stock.front.is_finite().then_some(stock.front)),
    ]);
    let level = |pick: fn(Real, Real) -> Real| books.water.points().map(|[_, z]| z).reduce(pick);
    row.extend([optional(books.water.mean()), optional(level(Real::max)), optional(level(Real::min))]);
    match &books.found {
        Some(found) => {
            let main = &found.ripples[0];
            let of = |value: fn(&Ripples) -> Result<Real, Unmeasured>| {
                optional(main.as_ref().ok().and_then(|ripples| value(ripples).ok()))
            };
            row.extend([
                optional(found.relief),
                of(|ripples| Ok(ripples.height())),
                of(|ripples| ripples.crest_to_trough),
                of(|ripples| Ok(ripples.spectral_wavelength)),
                of(|ripples| ripples.crossing_wavelength),
                of(|ripples| ripples.correlation_wavelength),
                of(Ripples::steepness),
                count(found.bed.suspended),
            ]);
        }
        None => row.extend(std::iter::repeat_with(|| Value::Missing).take(8)),
    }
    row
}

/// Ripples in the form of the summary; lengths in mm. Where there is none the main definition says why.
pub(super) fn ripples_json(found: &Found, tank: &Tank) -> serde_json::Value {
    let of = |ripples: &Result<Ripples, Unmeasured>, profile: &SurfaceProfile| match ripples {
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
                "mean_height_mm": profile.mean().map(|z| 1e3 * (z - tank.floor)),
            })
        }
        Err(problem) => {
            json!({ "not_measured": problem.to_string(), "mean_height_mm": profile.mean().map(|z| 1e3 * (z - tank.floor)) })
        }
    };
    let mut main = of(&found.ripples[0], &found.bed.concentration);
    if let Some(main) = main.as_object_mut() {
        main.insert("image".into(), of(&found.ripples[1], &found.bed.image));
        main.insert("top_layer".into(), of(&found.ripples[2], &found.bed.top_layer));
        main.insert("relief_mm".into(), json!(found.relief.map(|relief| 1e3 * relief)));
        main.insert("suspended_grains".into(), json!(found.bed.suspended));
    }
    main
}
