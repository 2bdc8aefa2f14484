//! Columns of the series and of the tables of probes.

use std::marker::PhantomData;

use sazanami_io::table::{Column, Value};
use sazanami_numerics::mean_flow::MeanFlowReport;

use super::observer::{Observer, Row, SeriesCell};
use crate::case::meaning::ProbePlace;
use crate::columns::{Cell, SeriesParts, headings, page, quantities, quantity};
use crate::water::Water;

/// The columns that every series begins with: time, the length of the last step before and after it was shortened to
/// end at an output, and the shortest stable length since the last row.
const fn first_columns<O: Observer>() -> [SeriesCell<O>; 5] {
    [
        quantity("time", "s", "simulated time", |row| row.clock.time().into()),
        quantity("dt", "s", "length of the last step", |row| row.step.map(|step| step.dt).into()),
        quantity("stable_dt", "s", "stable length of that step, before it was shortened to end at an output", |row| {
            row.step.map(|step| step.stable.0).into()
        }),
        quantity("limiter", "", "limit that set the stable length", |row| row.step.map(|step| step.stable.1).into()),
        quantity("least_stable_dt", "s", "shortest stable length since the previous row", |row| {
            row.step.and(row.totals.least_stable_step).into()
        }),
    ]
}

/// A value of the last step; missing before the first.
pub(crate) fn of_step<O: Observer, T: Into<Value>>(
    row: &Row<'_, O>,
    value: impl FnOnce(&<O::Water as Water>::Report) -> T,
) -> Value {
    row.step.map(|step| value(step.report)).into()
}

/// Iterations of the pressure solver, as both solvers have them.
pub(crate) const fn pressure_iterations<O: Observer>() -> SeriesCell<O> {
    quantity("pressure_iterations", "", "iterations of the pressure solver in the last step", |row| {
        of_step(row, O::Water::pressure_iterations)
    })
}

/// Contact sub-steps, as both solvers have them.
pub(crate) const fn grain_substeps<O: Observer>() -> SeriesCell<O> {
    quantity("grain_substeps", "", "contact sub-steps in the last step", |row| {
        of_step(row, |report| O::Water::contacts(report).substeps)
    })
}

/// A value of the mean velocity that is held; missing before the first step.
fn of_mean_flow<O: Observer>(row: &Row<'_, O>, value: impl FnOnce(&MeanFlowReport) -> f64) -> Value {
    row.step.and_then(|step| O::Water::mean_flow(step.report)).map(value).into()
}

/// The columns of the series of an observer that not every run has.
struct Further<O>(PhantomData<O>);

impl<O: Observer> Further<O> {
    /// Those of a run whose mean velocity is held.
    const MEAN_FLOW: &'static [SeriesCell<O>] = quantities! {
        "mean_velocity_1", "m/s", "mean velocity of the water above `drive.above` along x1"
            => |row| of_mean_flow(row, |flow| flow.velocity.x);
        "mean_velocity_2", "m/s", "the same along x2" => |row| of_mean_flow(row, |flow| flow.velocity.y);
        "mean_velocity_3", "m/s", "the same along x3" => |row| of_mean_flow(row, |flow| flow.velocity.z);
        "driving_acceleration_1", "m/s^2", "body force per mass that held this velocity in the last step, along x1"
            => |row| of_mean_flow(row, |flow| flow.acceleration.x);
        "driving_acceleration_2", "m/s^2", "the same along x2" => |row| of_mean_flow(row, |flow| flow.acceleration.y);
        "driving_acceleration_3", "m/s^2", "the same along x3" => |row| of_mean_flow(row, |flow| flow.acceleration.z);
        "driving_stress_1", "Pa", "that force on the water above `drive.above` over the plan of the box along x1: in steady flow the shear stress on what lies below, where no lid and no side walls bear a part of it"
            => |row| of_mean_flow(row, |flow| flow.stress.x);
        "driving_stress_2", "Pa", "the same along x2" => |row| of_mean_flow(row, |flow| flow.stress.y);
    };

    /// Those of a run whose box follows its liquid.
    const MOVING_BOX: &'static [SeriesCell<O>] = quantities! {
        "box_velocity_3", "m/s", "what the velocity of the box that follows the liquid has changed by since the start, along x3"
            => |row| of_mean_flow(row, |flow| -flow.outside.z);
    };

    /// Those of a run with liquid bridges.
    const BRIDGES: &'static [SeriesCell<O>] = quantities! {
        "liquid_bridges", "", "liquid bridges between grains" => |row| of_step(row, |report| O::Water::contacts(report).bridges);
        "bridge_volume", "m^3", "liquid in them" => |row| of_step(row, |report| O::Water::contacts(report).bridge_volume);
        "broken_bridges", "", "liquid bridges that broke in the last step"
            => |row| of_step(row, |report| O::Water::contacts(report).ruptures);
    };
}

/// All columns of the series of an observer, of these parts.
fn series<O: Observer>(parts: SeriesParts) -> impl Iterator<Item = SeriesCell<O>> {
    let crater = if parts.crater { O::SERIES_OF_CRATER } else { &[] };
    let interface = if parts.surface_tension { O::SERIES_OF_INTERFACE } else { &[] };
    let driven = if parts.mean_flow { Further::<O>::MEAN_FLOW } else { &[] };
    let moving_box = if parts.moving_box { Further::<O>::MOVING_BOX } else { &[] };
    let bridges = if parts.bridges { Further::<O>::BRIDGES } else { &[] };
    let further = crater.iter().chain(interface).chain(driven).chain(moving_box).chain(bridges);
    first_columns::<O>().into_iter().chain(O::SERIES.iter().chain(further).copied())
}

/// Headings of the series of an observer.
pub(crate) fn series_headings<O: Observer>(parts: SeriesParts) -> Vec<Column> {
    series::<O>(parts).map(|column| Column::new(column.name, column.unit)).collect()
}

/// A row of the series.
pub(crate) fn series_row<O: Observer>(row: &Row<'_, O>, parts: SeriesParts) -> Vec<Value> {
    series::<O>(parts).map(|column| (column.value)(row)).collect()
}

/// Quantities of a solver at each kind of place; [`ProbePlace::Gauge`] always gives the level of the water.
pub(crate) struct ProbeColumns<P: 'static, T: 'static, B: 'static> {
    /// At a point, and at each point of a line.
    pub at_point: &'static [Cell<P>],
    /// Through a plane; none where planes are refused with the case.
    pub through_plane: &'static [Cell<T>],
    /// Motion of a grain and the forces on it.
    pub of_body: &'static [Cell<B>],
}

/// The level of the water at a gauge.
pub(crate) const GAUGE: [Cell<Option<f64>>; 1] = [quantity(
    "water_level",
    "m",
    "height of the water's surface; on the grid where it is dry that of the floor, or of the cells without room that stand on it",
    |level| (*level).into(),
)];

impl<P, T, B> ProbeColumns<P, T, B> {
    /// Headings of the table of a probe at `place`, after the time.
    pub fn headings(&self, place: &ProbePlace) -> Vec<Column> {
        let mut found = vec![Column::new("time", "s")];
        found.extend(match place {
            ProbePlace::Point(_) => headings(self.at_point),
            ProbePlace::Line { points, .. } => {
                let numbered = |n: usize| {
                    let at = move |cell: &Cell<P>| Column::new(&format!("{}_at_{n}", cell.name), cell.unit);
                    self.at_point.iter().map(at)
                };
                (0..*points).flat_map(numbered).collect()
            }
            ProbePlace::Plane { .. } => headings(self.through_plane),
            ProbePlace::Body { .. } => headings(self.of_body),
            ProbePlace::Gauge(_) => headings(&GAUGE),
        });
        found
    }
}

/// The series of an observer as the reference page has it.
pub(crate) fn series_page<O: Observer>() -> String {
    let all: Vec<SeriesCell<O>> = series(SeriesParts::default()).collect();
    let main = page("A row per observation.", &all);
    let driven = page("With `drive.mean_velocity` also:", Further::<O>::MEAN_FLOW);
    let bridges = page("With `dem.bridges` also:", Further::<O>::BRIDGES);
    match O::SERIES_OF_CRATER {
        [] => format!("{main}\n{driven}\n{bridges}"),
        crater => {
            let crater = page("With `[erosion]` also:", crater);
            let interface =
                page("With `fluid.surface_tension` or `fluid.entry_pressure` also:", O::SERIES_OF_INTERFACE);
            let followed = page(
                "With `frame.follows = \"liquid\"` those of `drive.mean_velocity`, and:",
                Further::<O>::MOVING_BOX,
            );
            format!("{main}\n{crater}\n{interface}\n{driven}\n{followed}\n{bridges}")
        }
    }
}

impl<P, T, B> ProbeColumns<P, T, B> {
    /// The tables of probes as the reference page has them.
    pub fn page(&self) -> String {
        let point =
            page("At a `point`; along a `line` the same at each of its points, `NAME_at_0` and so on:", self.at_point);
        let plane = page("Through a `plane`:", self.through_plane);
        let plane = if self.through_plane.is_empty() { String::new() } else { plane + "\n" };
        let body = page("Of a grain (`body`):", self.of_body);
        let gauge = page("At a `gauge`:", &GAUGE);
        format!("{point}\n{plane}{body}\n{gauge}")
    }
}
