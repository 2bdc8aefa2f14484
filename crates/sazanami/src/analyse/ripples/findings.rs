//! Ripples by the tables of a whole run, in the form of the summary.

use serde_json::{Map, Value, json};

use super::cycles::{CycleAverage, QUANTITIES};
use super::measured::Compared;
use super::tables::RunTables;
use crate::check::bed_flow;
use crate::recorder::{relief_of, surface_json, tank_of};

/// Growth of the relief, what the layers do in a cycle, and how the run compares with an experiment:
/// what its state at the end does not know.
pub(super) fn of_history(tables: &RunTables, cycles: &[CycleAverage], compared: &[Compared]) -> Map<String, Value> {
    let mut found = Map::new();
    if let Some((growth, per)) = tables.growth() {
        found.insert(
            "growth".into(),
            json!({ "rate_per_s": growth.rate, "standard_error_per_s": growth.standard_error, per: growth.points }),
        );
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

/// Mound, ripples and relief at the last time of the tables, as the case asks now.
pub(super) fn at_the_end(tables: &RunTables) -> Map<String, Value> {
    let (Some(how), Some(bed), Some(forms)) = (&tables.case.ripples, &tables.bed, &tables.forms) else {
        return Map::new();
    };
    let (tank, bed) = (tank_of(&tables.case), bed.last());
    surface_json(bed, relief_of(how, &tank, bed), forms, bed_flow(&tables.case).as_ref(), &tank)
}
