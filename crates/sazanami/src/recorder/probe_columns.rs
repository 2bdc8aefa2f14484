//! Columns of a probe's table.

use sazanami_io::table::Column;

use crate::case::meaning::ProbePlace;

/// Name and unit of a quantity.
pub(super) type Quantity = (&'static str, &'static str);

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
        let named = |list: &[Quantity]| list.iter().map(|(name, unit)| Column::new(name, unit)).collect::<Vec<_>>();
        let mut columns = vec![Column::new("time", "s")];
        columns.extend(match place {
            ProbePlace::Point(_) => named(self.at_point),
            ProbePlace::Line { points, .. } => {
                let numbered = |n: usize| {
                    self.at_point.iter().map(move |(name, unit)| Column::new(&format!("{name}_at_{n}"), unit))
                };
                (0..*points).flat_map(numbered).collect()
            }
            ProbePlace::Plane { .. } => named(self.through_plane),
            ProbePlace::Body { .. } => named(self.of_body),
            ProbePlace::Gauge(_) => named(&[("water_level", "m")]),
        });
        columns
    }
}
