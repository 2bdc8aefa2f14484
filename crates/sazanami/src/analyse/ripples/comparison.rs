//! Several runs with moving particles in one table.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use sazanami_io::replace_file;
use sazanami_numerics::Real;
use sazanami_observe::ripples::BedForms;
use serde_json::Value;

use super::tables::RunTables;
use crate::analyse::lines::{aligned, number};
use crate::analyse::output::{Output, free_path, undone};
use crate::case;
use crate::error::CommandError;
use crate::results::CASE;

/// A column of numbers: heading, factor to its unit and digits in the terminal; heading in the file, in SI units; value.
struct Column {
    heading: &'static str,
    factor: Real,
    digits: usize,
    signed: bool,
    in_file: &'static str,
    value: fn(&RunTables) -> Option<Real>,
}

const fn column(
    heading: &'static str,
    (factor, digits, signed): (Real, usize, bool),
    in_file: &'static str,
    value: fn(&RunTables) -> Option<Real>,
) -> Column {
    Column { heading, factor, digits, signed, in_file, value }
}

/// Of mound and ripples at the end of a run, where there are any.
fn of_forms(run: &RunTables, measure: fn(&BedForms) -> Option<Real>) -> Option<Real> {
    run.forms.as_ref().and_then(measure)
}

const COLUMNS: [Column; 8] = [
    column("L [mm]", (1e3, 0, false), "length [m]", |run| Some(run.case.domain.extent().x)),
    column("t [s]", (1.0, 3, false), "time [s]", |run| number(&run.summary, &["time_s"])),
    column("mound high [mm]", (1e3, 2, false), "mound_height [m]", |run| {
        of_forms(run, |forms| forms.mound.as_ref().ok().map(|mound| mound.height))
    }),
    column("ripples apart [mm]", (1e3, 2, false), "ripple_crest_spacing [m]", |run| {
        of_forms(run, |forms| forms.ripples.as_ref().ok().map(|ripples| ripples.wavelength))
    }),
    column("ripples high [mm]", (1e3, 2, false), "ripple_crest_height [m]", |run| {
        of_forms(run, |forms| forms.ripples.as_ref().ok().map(|ripples| ripples.height))
    }),
    column("relief [mm]", (1e3, 2, false), "relief [m]", |run| {
        number(&run.summary, &["observables", "ripples", "relief_mm"]).map(|relief| 1e-3 * relief)
    }),
    column("growth [1/s]", (1.0, 2, true), "growth [1/s]", |run| run.growth().map(|(growth, _)| growth.rate)),
    column("volume [%]", (1e2, 2, true), "fluid_bulk_volume_relative_change", |run| {
        number(&run.summary, &["conservation", "fluid_bulk_volume_relative_change"])
    }),
];

/// Columns of what is measured of a bed.
const OF_BED: std::ops::Range<usize> = 2..7;

impl Column {
    fn text(&self, value: Option<Real>) -> String {
        let Self { factor, digits, .. } = *self;
        match value.map(|value| factor * value) {
            Some(value) if self.signed => format!("{value:+.digits$}"),
            Some(value) => format!("{value:.digits$}"),
            None => "none".into(),
        }
    }
}

/// A run in the table: name, how it ended, numbers in SI units.
struct Row {
    name: String,
    status: String,
    values: [Option<Real>; COLUMNS.len()],
}

impl Row {
    fn of(run: &RunTables) -> Self {
        let summary = &run.summary;
        let status = summary["status"].as_str().unwrap_or("unknown");
        Self {
            name: name_of(run),
            status: match summary["failure"]["kind"].as_str() {
                Some(kind) => format!("{status}: {kind}"),
                None => status.to_owned(),
            },
            values: COLUMNS.map(|column| (column.value)(run)),
        }
    }

    fn text(&self) -> [String; COLUMNS.len() + 2] {
        let mut values = COLUMNS.iter().zip(self.values).map(|(column, value)| column.text(value));
        std::array::from_fn(|n| match n {
            0 => self.name.clone(),
            1 => self.status.clone(),
            _ => values.next().unwrap_or_default(),
        })
    }

    fn in_file(&self) -> String {
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        let values = self.values.iter().map(|value| value.map_or(String::new(), |value| value.to_string()));
        [quoted(&self.name), quoted(&self.status)].into_iter().chain(values).collect::<Vec<_>>().join(",")
    }
}

/// Puts several runs, failed ones included, into one table.
pub(in crate::analyse) fn several(
    folders: &[PathBuf],
    out: &Path,
    output: &mut Output,
) -> Result<Vec<String>, CommandError> {
    let runs = folders.iter().map(|folder| named(folder)).collect::<Result<Vec<_>, _>>()?;
    let rows: Vec<Row> = runs.iter().map(Row::of).collect();
    // Where no run has a bed there are no ripples to compare.
    if rows.iter().any(|row| row.values[OF_BED].iter().any(Option::is_some)) {
        write(&rows, out, output)?;
    }
    let heading = |n: usize| ["run", "status"].get(n).copied().unwrap_or_else(|| COLUMNS[n - 2].heading);
    let header: [String; COLUMNS.len() + 2] = std::array::from_fn(|n| heading(n).to_owned());
    Ok(aligned(&header, &rows.iter().map(Row::text).collect::<Vec<_>>()))
}

/// The tables of a run under the name of its folder: folders distinguish runs of one case.
fn named(folder: &Path) -> Result<RunTables, CommandError> {
    let mut tables = RunTables::read(folder, case::load(&folder.join(CASE), &[])?)?;
    if let Some(name) = folder.file_name() {
        tables.summary["case"] = Value::String(name.to_string_lossy().into_owned());
    }
    Ok(tables)
}

fn name_of(run: &RunTables) -> String {
    run.summary["case"].as_str().unwrap_or("run").to_owned()
}

fn write(rows: &[Row], out: &Path, output: &mut Output) -> Result<(), CommandError> {
    let path = free_path(out, "ripple-comparison");
    let header = COLUMNS.iter().fold("run,status".to_owned(), |header, column| header + "," + column.in_file);
    let lines = std::iter::once(header).chain(rows.iter().map(Row::in_file));
    let text: String = lines.map(|line| line + "\n").collect();
    replace_file(&path, |file| file.write_all(text.as_bytes())).map_err(undone)?;
    output.message(&format!("wrote {}", path.display()));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_units_of_their_columns() {
        let values = [Some(0.15), Some(3.0), Some(2.1e-3), Some(0.0325), None, Some(6.4e-4), Some(0.1), Some(-6e-4)];
        let row = Row { name: "a,b".into(), status: "failed: step".into(), values };
        assert_eq!(
            row.text(),
            ["a,b", "failed: step", "150", "3.000", "2.10", "32.50", "none", "0.64", "+0.10", "-0.06"]
        );
        assert_eq!(row.in_file(), "\"a,b\",\"failed: step\",0.15,3,0.0021,0.0325,,0.00064,0.1,-0.0006");
    }
}
