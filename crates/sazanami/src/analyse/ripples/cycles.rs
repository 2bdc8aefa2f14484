//! Averages over the layers of a bed in cycles of its tank.

use std::path::Path;

use sazanami_io::table::write_csv;
use sazanami_numerics::Real;
use sazanami_observe::ripples::{PhaseAverage, cycle_averages, phase_average};

use crate::analyse::table::Table;
use crate::columns::{Quantity, quantities};
use crate::error::CommandError;
use crate::results::LAYER_MEANS;

/// Quantities that are averaged over layers, by their columns.
pub(super) const QUANTITIES: [&str; 4] = ["water_velocity_1", "grain_velocity_1", "drag_1", "pressure_force_1"];
/// Cycles at the end of a run that are averaged over, and phases of a cycle.
const LAST_CYCLES: usize = 4;
const PHASES: usize = 20;

/// Averages over the layers of the bed in one run. The four quantities of each layer are: velocity of the water and of
/// the grains [m/s], drag and force of the pressure gradient on a grain \[N], all along x1.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerHistory {
    /// Times \[s].
    pub time: Vec<Real>,
    /// Upper layer: the four quantities at these times.
    pub upper: [Vec<Real>; 4],
    /// Lower layer: the same.
    pub lower: [Vec<Real>; 4],
}

/// A quantity of a layer in a cycle of the tank.
pub(super) struct CycleAverage {
    pub(super) layer: &'static str,
    pub(super) quantity: &'static str,
    /// By phase, over the last cycles, where the run has as many.
    pub(super) phases: Option<PhaseAverage>,
    /// Ends of cycles \[s] and means over each.
    pub(super) means: Vec<(Real, Real)>,
}

impl CycleAverage {
    /// Half of what a quantity spans in a mean cycle, in the upper and in the lower layer.
    pub(super) fn half_ranges(all: &[Self], quantity: &str) -> Option<[Real; 2]> {
        let of = |layer: &str| {
            let found = all.iter().find(|average| average.layer == layer && average.quantity == quantity);
            Some(found?.phases.as_ref()?.half_range())
        };
        Some([of("upper")?, of("lower")?])
    }
}

/// Phase and cycle averages of every quantity of both layers, in cycles of a `period` \[s].
pub(super) fn averages(layers: &LayerHistory, period: Real) -> Vec<CycleAverage> {
    let sides = [("upper", &layers.upper), ("lower", &layers.lower)];
    let each = sides.into_iter().flat_map(|(layer, columns)| {
        QUANTITIES.iter().zip(columns).map(move |(quantity, column)| (layer, *quantity, column))
    });
    each.map(|(layer, quantity, column)| {
        let pairs = layers.time.iter().copied().zip(column.iter().copied());
        let series: Vec<(Real, Real)> = pairs.filter(|(_, value)| value.is_finite()).collect();
        let last = layers.time.last().copied().unwrap_or_default();
        let cycles = ((last / period + 1e-6).floor() as usize).min(LAST_CYCLES);
        CycleAverage {
            layer,
            quantity,
            phases: phase_average(&series, period, cycles, PHASES).ok(),
            means: cycle_averages(&series, period),
        }
    })
    .collect()
}

/// A row of the table of cycles.
pub(crate) struct CycleRow {
    layer: &'static str,
    quantity: &'static str,
    kind: &'static str,
    place: Real,
    mean: Real,
    deviation: Option<Real>,
    cycles: usize,
}

/// Value of a column of the table of cycles, as text.
pub(crate) type CycleValue = fn(&CycleRow) -> String;

/// Columns of the table of cycles.
pub(crate) const CYCLE_COLUMNS: &[Quantity<CycleValue>] = quantities! {
    "layer", "", "`upper` or `lower`" => |row| row.layer.to_owned();
    "quantity", "", "column of `layers.csv` that is averaged, in its unit" => |row| row.quantity.to_owned();
    "kind", "", "`phase`: mean over the last cycles at a phase; `cycle`: mean over one whole cycle"
        => |row| row.kind.to_owned();
    "phase_or_end_of_cycle", "", "phase from 0 to 1, or end of the cycle [s]" => |row| row.place.to_string();
    "mean", "", "the mean" => |row| format!("{:e}", row.mean);
    "deviation", "", "standard deviation over the cycles at that phase"
        => |row| row.deviation.map_or_else(String::new, |deviation| format!("{deviation:e}"));
    "cycles", "", "number of cycles in the mean" => |row| row.cycles.to_string();
};

/// Writes a row for each phase and for each whole cycle.
pub(super) fn write_averages(path: &Path, cycles: &[CycleAverage]) -> std::io::Result<()> {
    let mut rows = vec![CYCLE_COLUMNS.iter().map(|column| column.name.to_owned()).collect::<Vec<String>>()];
    let mut add = |row: &CycleRow| rows.push(CYCLE_COLUMNS.iter().map(|column| (column.value)(row)).collect());
    for &CycleAverage { layer, quantity, ref phases, ref means } in cycles {
        if let Some(phases) = phases {
            for (n, (&mean, &deviation)) in phases.mean.iter().zip(&phases.deviation).enumerate() {
                let place = n as Real / phases.mean.len() as Real;
                let cycles = phases.cycles;
                add(&CycleRow { layer, quantity, kind: "phase", place, mean, deviation, cycles });
            }
        }
        for &(place, mean) in means {
            add(&CycleRow { layer, quantity, kind: "cycle", place, mean, deviation: None, cycles: 1 });
        }
    }
    write_csv(path, rows)
}

/// History of the layers of a run; `None` if it has no table of layers.
///
/// # Errors
/// If the table is damaged.
pub fn layer_history(folder: &Path) -> Result<Option<LayerHistory>, CommandError> {
    let Some(table) = Table::read(&folder.join(LAYER_MEANS))? else { return Ok(None) };
    let (times, columns) = (table.column("time"), QUANTITIES.map(|name| table.column(name)));
    let is_upper: Vec<bool> = table.words("layer").iter().map(|layer| layer == "upper").collect();
    let of = |values: &Vec<Real>, upper: bool| -> Vec<Real> {
        values.iter().zip(&is_upper).filter(|(_, is_upper)| **is_upper == upper).map(|(value, _)| *value).collect()
    };
    let layer = |upper: bool| columns.each_ref().map(|column| of(column, upper));
    let found = LayerHistory { time: of(&times, true), upper: layer(true), lower: layer(false) };
    let is_whole = columns.iter().all(|column| column.len() == times.len());
    Ok((is_whole && found.time.len() > 1).then_some(found))
}
