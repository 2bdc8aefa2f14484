//! Ripples by the tables of a whole run, in the form of the summary.

use sazanami_observe::ripples::{Growth, relief};
use serde_json::{Map, Value, json};

use super::cycles::{CycleAverage, QUANTITIES};
use super::measured::Compared;
use super::tables::{Profiles, RunTables, settings_of};
use crate::check::bed_flow;
use crate::recorder::{closed, flow_json, forms_json, measure, surface_json, tank_of};

/// Growth and migration of the ripples, what the layers do in a cycle, and how the run compares with an experiment:
/// what its state at the end does not know.
pub(super) fn of_history(tables: &RunTables, cycles: &[CycleAverage], compared: &[Compared]) -> Map<String, Value> {
    let mut found = Map::new();
    if let Ok(growth) = Growth::of(&tables.heights()) {
        let per = if tables.period.is_some() { "periods" } else { "times" };
        found.insert(
            "growth".into(),
            json!({ "rate_per_s": growth.rate, "standard_error_per_s": growth.standard_error, per: growth.points }),
        );
    }
    if let Some((shift, correlation)) = tables.migration() {
        let over = tables.period;
        found
            .insert("migration".into(), json!({ "shift_mm": 1e3 * shift, "over_s": over, "correlation": correlation }));
    }
    let layers = of_layers(cycles);
    if !layers.is_empty() {
        found.insert("layers".into(), Value::Object(layers));
    }
    if !compared.is_empty() {
        found.insert("experiment".into(), compared.iter().map(Compared::json).collect());
    }
    found
}

/// Half of what each quantity spans in a mean cycle, in the upper and in the lower layer; velocities in m/s, forces in
/// N.
fn of_layers(cycles: &[CycleAverage]) -> Map<String, Value> {
    let of = |quantity| {
        let [upper, lower] = CycleAverage::half_ranges(cycles, quantity)?;
        let ratio = (lower > 0.0).then(|| upper / lower);
        Some((quantity.to_owned(), json!({ "upper_half_range": upper, "lower_half_range": lower, "ratio": ratio })))
    };
    QUANTITIES.into_iter().filter_map(of).collect()
}

/// Ripples at the last time of the tables, measured as the case asks now.
pub(super) fn at_the_end(tables: &RunTables) -> Map<String, Value> {
    let (Some(how), Some(bed)) = (&tables.case.ripples, &tables.bed) else { return Map::new() };
    let tank = tank_of(&tables.case);
    let of = |profiles: &Profiles, across| {
        let profile = profiles.last();
        surface_json(&measure(how, &tank, profile, across), profile, &tank)
    };
    let Value::Object(mut found) = of(bed, tank.width()) else { return Map::new() };
    for (name, profiles, across) in
        [("image", &tables.image, tables.slab), ("top_layer", &tables.top_layer, tank.width())]
    {
        if let Some(profiles) = profiles {
            found.insert(name.into(), of(profiles, across));
        }
    }
    let range = settings_of(&tables.case).map(|settings| settings.range_in(&tank));
    let all = range.and_then(|range| relief(&closed(how, bed.last()), range).ok());
    found.extend(tables.forms.as_ref().map(forms_json).unwrap_or_default());
    if let Some(flow) = bed_flow(&tables.case) {
        found.insert("flow".into(), flow_json(&flow));
    }
    found.insert("relief_mm".into(), json!(all.map(|relief| 1e3 * relief)));
    found
}
