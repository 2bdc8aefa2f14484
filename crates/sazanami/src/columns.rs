//! Columns of tables and fields of the summary: one entry is a name, a unit, a meaning and the function that gives the
//! value. From these lists come headings, rows, and the tables of `docs/guide/columns.md`.

use std::fmt::Write as _;

use sazanami_io::table::{Column, Value};
use serde_json::Map;

/// A quantity: how it is called, its unit (empty for none), what it means, and how it is read.
#[derive(Clone, Copy)]
pub(crate) struct Quantity<F> {
    pub name: &'static str,
    pub unit: &'static str,
    pub meaning: &'static str,
    pub value: F,
}

/// An entry of a list of quantities.
pub(crate) const fn quantity<F>(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
    value: F,
) -> Quantity<F> {
    Quantity { name, unit, meaning, value }
}

/// A list of quantities: `name, unit, meaning => value;`, or `..function();` of one that is written elsewhere.
macro_rules! quantities {
    ($($(..$whole:ident())? $($name:literal, $unit:literal, $meaning:literal => $value:expr)?;)+) => {
        &[$($($whole())? $($crate::columns::quantity($name, $unit, $meaning, $value))?),+]
    };
}
pub(crate) use quantities;

/// A column whose value is read from an `S`.
pub(crate) type Cell<S> = Quantity<fn(&S) -> Value>;
/// A field of the summary that is read from an `S`.
pub(crate) type Field<S> = Quantity<fn(&S) -> serde_json::Value>;

/// Parts of the series that not every run has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SeriesParts {
    /// The crater.
    pub crater: bool,
    /// The interface where it has surface tension.
    pub surface_tension: bool,
    /// The mean velocity that is held.
    pub mean_flow: bool,
    /// The speed of a box that follows its liquid.
    pub moving_box: bool,
    /// Liquid bridges between grains.
    pub bridges: bool,
}

/// Headings of a list of columns.
pub(crate) fn headings<F>(list: &[Quantity<F>]) -> Vec<Column> {
    list.iter().map(|quantity| Column::new(quantity.name, quantity.unit)).collect()
}

/// Values of a list of columns.
pub(crate) fn cells<'a, S>(list: &'a [Cell<S>], from: &'a S) -> impl Iterator<Item = Value> + 'a {
    list.iter().map(move |cell| (cell.value)(from))
}

/// Values of a list of columns of which nothing was observed.
pub(crate) fn missing<F>(list: &[Quantity<F>]) -> impl Iterator<Item = Value> + '_ {
    list.iter().map(|_| Value::Missing)
}

/// An object of the summary.
pub(crate) fn object<S>(list: &[Field<S>], from: &S) -> Map<String, serde_json::Value> {
    list.iter().map(|field| (field.name.to_owned(), (field.value)(from))).collect()
}

/// A table of the reference page: what it is, and a line for each quantity.
pub(crate) fn page<F>(title: &str, list: &[Quantity<F>]) -> String {
    let mut text = format!("{title}\n\n| name | unit | meaning |\n|---|---|---|\n");
    for Quantity { name, unit, meaning, .. } in list {
        let _ = writeln!(text, "| `{name}` | {unit} | {meaning} |");
    }
    text.push('\n');
    text
}
