//! Columns of tables, and values for them.

use sazanami_io::table::{Column, Value};

use super::Totals;
use super::books::Step;
use crate::case::meaning::ProbePlace;
use crate::simulation::Water;

/// Name and unit of a quantity.
pub(super) type Quantity = (&'static str, &'static str);

/// How long the last step was, how long it could have been stable and what ruled that, before it was cut for an output,
/// and the shortest stable length since the last row.
pub(super) const LENGTH: [Quantity; 4] = [("dt", "s"), ("stable_dt", "s"), ("limiter", ""), ("least_stable_dt", "s")];

/// Values of [`LENGTH`].
pub(super) fn length<W: Water>(step: &Step<'_, W>, totals: &Totals) -> [Value; LENGTH.len()] {
    let (stable, limiter) = step.stable;
    [step.dt.into(), stable.into(), limiter.into(), totals.least_stable_step.into()]
}

/// Columns of groups of quantities.
pub(super) fn columns(groups: &[&[Quantity]]) -> Vec<Column> {
    groups.iter().flat_map(|group| group.iter()).map(|(name, unit)| Column::new(name, unit)).collect()
}

/// Values of a group of which nothing was observed.
pub(super) fn missing<const N: usize>() -> [Value; N] {
    std::array::from_fn(|_| Value::Missing)
}

/// What a solver tells at each kind of place; [`ProbePlace::Gauge`] always tells the level of the water.
pub(super) struct Quantities {
    /// At a point, and at each point of a line.
    pub at_point: &'static [Quantity],
    /// Through a plane; none where planes are refused with the case.
    pub through_plane: &'static [Quantity],
    /// Of a grain.
    pub of_body: &'static [Quantity],
}

impl Quantities {
    /// Time and what a probe at `place` tells.
    pub fn columns(&self, place: &ProbePlace) -> Vec<Column> {
        let mut found = vec![Column::new("time", "s")];
        found.extend(match place {
            ProbePlace::Point(_) => columns(&[self.at_point]),
            ProbePlace::Line { points, .. } => {
                let numbered = |n: usize| {
                    self.at_point.iter().map(move |(name, unit)| Column::new(&format!("{name}_at_{n}"), unit))
                };
                (0..*points).flat_map(numbered).collect()
            }
            ProbePlace::Plane { .. } => columns(&[self.through_plane]),
            ProbePlace::Body { .. } => columns(&[self.of_body]),
            ProbePlace::Gauge(_) => columns(&[&[("water_level", "m")]]),
        });
        found
    }
}
