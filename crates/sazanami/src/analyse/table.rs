//! Tables that runs wrote.

use std::borrow::Cow;
use std::io::ErrorKind;
use std::path::Path;

use sazanami_io::table::{fields, unquoted};
use sazanami_numerics::Real;

use crate::error::CommandError;

/// Rows of a table with named columns.
#[derive(Debug)]
pub struct Table {
    columns: Vec<String>,
    units: Vec<String>,
    rows: Vec<String>,
}

/// The cells of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells<'t> {
    /// Numbers, NaN where a cell is empty.
    Numbers(Vec<Real>),
    /// Words, empty where a cell is.
    Words(Vec<Cow<'t, str>>),
}

impl Table {
    /// Reads the table at `path`; `None` if there is none.
    ///
    /// # Errors
    /// If it cannot be read, is empty or not a text, ends within a line, or has a line that is no row.
    pub fn read(path: &Path) -> Result<Option<Self>, CommandError> {
        let damaged = |what: &str| CommandError::input(format!("{}{what}", path.display()), REWRITE);
        let bytes = match std::fs::read(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            bytes => bytes.map_err(|error| damaged(&format!(": cannot be read: {error}")))?,
        };
        let text = String::from_utf8(bytes).map_err(|_| damaged(": this is not a text"))?;
        let mut lines = text.lines();
        let Some(heading) = lines.next() else { return Err(damaged(": this is empty")) };
        let headings = fields(heading).map(unquoted).map(|heading| {
            let (name, unit) = heading.split_once(" [").unwrap_or((&heading, "]"));
            (name.to_owned(), unit.trim_end_matches(']').to_owned())
        });
        let (columns, units) = headings.unzip();
        let table = Self { columns, units, rows: lines.map(str::to_owned).collect() };
        // What is left of a line may look like a whole one.
        if !text.ends_with('\n') {
            return Err(damaged(&format!(":{}: the file ends within this line", 1 + table.len())));
        }
        match table.damaged_line() {
            Some(line) => Err(damaged(&format!(":{line}: this is not a row of the table"))),
            None => Ok(Some(table)),
        }
    }

    /// Names and units of the columns.
    pub fn headings(&self) -> impl Iterator<Item = (&str, &str)> {
        self.columns.iter().map(String::as_str).zip(self.units.iter().map(String::as_str))
    }

    /// Number of the first line that is no row, that of the headings being 1: it has another number of cells than the
    /// headings, or its first cell is not a number where it is that of a step.
    fn damaged_line(&self) -> Option<usize> {
        let of_steps = self.columns.first().is_some_and(|name| name == "step");
        let is_row = |row: &String| {
            let begins = !of_steps || !value(fields(row).next().unwrap_or_default()).is_nan();
            begins && fields(row).count() == self.columns.len()
        };
        self.rows.iter().position(|row| !is_row(row)).map(|row| row + 2)
    }

    /// Values of a column, NaN where a cell is empty; none if there is no such column.
    pub fn column(&self, name: &str) -> Vec<Real> {
        self.cells(name).map(value).collect()
    }

    /// Words in a column; none if there is no such column.
    pub fn words(&self, name: &str) -> Vec<Cow<'_, str>> {
        self.cells(name).map(unquoted).collect()
    }

    /// Cells of a column: numbers, or words where there is no number but other text; none if there is no such column.
    #[must_use]
    pub fn cells_of(&self, name: &str) -> Cells<'_> {
        let numbers = self.column(name);
        let words = self.words(name);
        if numbers.iter().all(|number| number.is_nan()) && words.iter().any(|word| !word.is_empty() && word != "NaN") {
            Cells::Words(words)
        } else {
            Cells::Numbers(numbers)
        }
    }

    /// Number of rows below the heading.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Values of a row.
    pub fn row(&self, number: usize) -> impl Iterator<Item = Real> {
        fields(&self.rows[number]).map(value)
    }

    /// Number of a column.
    pub(super) fn place(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    fn cells(&self, name: &str) -> impl Iterator<Item = &str> {
        let place = self.place(name);
        place.into_iter().flat_map(|at| self.rows.iter().map(move |row| fields(row).nth(at).unwrap_or_default()))
    }
}

const REWRITE: &str = "the results are damaged: `sazanami resume` mends the tables of a run that broke off; otherwise take them from a copy, or run the case again";

/// Value of a cell; NaN if it is empty.
fn value(cell: &str) -> Real {
    unquoted(cell).parse().unwrap_or(Real::NAN)
}
