//! Tables that runs wrote.

use std::path::Path;

use sazanami_numerics::Real;

/// Rows of a table with named columns.
pub struct Table {
    columns: Vec<String>,
    rows: Vec<String>,
}

impl Table {
    /// Reads the table at `path`; `None` if there is none.
    pub fn read(path: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(path).ok()?;
        let mut lines = text.lines();
        let columns = lines.next()?.split(',').map(|name| name.split(" [").next().unwrap_or(name).to_owned()).collect();
        Some(Self { columns, rows: lines.map(str::to_owned).collect() })
    }

    /// Values of a column, NaN where a cell is empty; none if there is no such column.
    pub fn column(&self, name: &str) -> Vec<Real> {
        self.cells(name).map(value).collect()
    }

    /// Words in a column; none if there is no such column.
    pub fn words(&self, name: &str) -> Vec<&str> {
        self.cells(name).map(|cell| cell.trim_matches('"')).collect()
    }

    /// Number of rows below the heading.
    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Values of a row.
    pub(super) fn row(&self, number: usize) -> impl Iterator<Item = Real> {
        self.rows[number].split(',').map(value)
    }

    /// Number of a column.
    pub(super) fn place(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    fn cells(&self, name: &str) -> impl Iterator<Item = &str> {
        let place = self.place(name);
        place.into_iter().flat_map(|at| self.rows.iter().map(move |row| row.split(',').nth(at).unwrap_or_default()))
    }
}

/// Value of a cell; NaN if it is empty.
fn value(cell: &str) -> Real {
    cell.parse().unwrap_or(Real::NAN)
}
