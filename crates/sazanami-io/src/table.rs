//! Tables: one CSV row per observation, safe to go on with after a restart, and small JSON files.

use std::borrow::Cow;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use thiserror::Error;

use crate::replace_file;

/// Why a table could not be written or gone on with.
#[derive(Debug, Error)]
pub enum TableError {
    /// The file system refused.
    #[error("cannot write table {path}: {source}", path = path.display())]
    Write {
        /// File of the table.
        path: PathBuf,
        /// Refusal of the file system.
        source: io::Error,
    },
    /// A table of that name holds other columns.
    #[error("table {path} has the columns `{found}`, not `{expected}`", path = path.display())]
    OtherColumns {
        /// File of the table.
        path: PathBuf,
        /// Header the table should have.
        expected: String,
        /// Header of the file.
        found: String,
    },
    /// A value is not a number.
    #[error("column `{column}` of table {path} would get the value {value} at step {step}", path = path.display())]
    NotFinite {
        /// File of the table.
        path: PathBuf,
        /// Name of the column.
        column: String,
        /// The value: NaN or infinite.
        value: f64,
        /// Step of the row.
        step: u64,
    },
    /// A row has more or fewer values than the table has columns.
    #[error("a row of {found} values does not fit the {expected} columns of table {path}", path = path.display())]
    WrongWidth {
        /// File of the table.
        path: PathBuf,
        /// Number of columns without the step.
        expected: usize,
        /// Number of values.
        found: usize,
    },
}

/// Heading of a column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name of the quantity.
    pub name: String,
    /// Its unit, empty for none.
    pub unit: String,
}

impl Column {
    /// A column with a unit, which may be empty.
    #[must_use]
    pub fn new(name: &str, unit: &str) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned() }
    }

    fn heading(&self) -> String {
        quoted(&if self.unit.is_empty() { self.name.clone() } else { format!("{} [{}]", self.name, self.unit) })
    }
}

/// Entry of a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A finite number, written so that it reads back to the bit.
    Real(f64),
    /// A count or identifier.
    Count(u64),
    /// Text, quoted if it has to be.
    Text(String),
    /// Nothing was observed.
    Missing,
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Real(value)
    }
}

impl From<u64> for Value {
    fn from(value: u64) -> Self {
        Self::Count(value)
    }
}

impl From<usize> for Value {
    fn from(value: usize) -> Self {
        Self::Count(value as u64)
    }
}

impl From<&str> for Value {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl<T: Into<Value>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Missing, Into::into)
    }
}

/// Writes `series.csv`: a header with units, then a line per record, each on its way to the disk before
/// [`SeriesWriter::record`] returns. The first column is the step.
#[derive(Debug)]
pub struct SeriesWriter {
    path: PathBuf,
    columns: Vec<Column>,
    file: File,
    line: String,
    last: Option<u64>,
}

impl SeriesWriter {
    /// Starts a table anew; `columns` come after the step.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn create(path: &Path, columns: &[Column]) -> Result<Self, TableError> {
        let cannot_write = |source| TableError::Write { path: path.to_owned(), source };
        let mut file = File::create(path).map_err(cannot_write)?;
        file.write_all(format!("{}\n", header(columns)).as_bytes()).map_err(cannot_write)?;
        Ok(Self { path: path.to_owned(), columns: columns.to_vec(), file, line: String::new(), last: None })
    }

    /// Goes on with a table after the state of `step` was restored: rows of later steps and a half written last row
    /// are cut off. A table that does not exist is started. One that lacks columns, since an older program began it, is
    /// given them, empty in the rows that it has.
    ///
    /// # Errors
    /// If the file system refuses, or if the table has columns that are not among `columns`.
    pub fn resume(path: &Path, columns: &[Column], step: u64) -> Result<Self, TableError> {
        let cannot_write = |source| TableError::Write { path: path.to_owned(), source };
        let mut file = match OpenOptions::new().read(true).write(true).open(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Self::create(path, columns),
            file => file.map_err(cannot_write)?,
        };
        let GoodPart { header: found, length, last } = good_part(&file, step).map_err(cannot_write)?;
        let expected = header(columns);
        if found.is_empty() {
            // Cut within its first line: nothing is left of it.
            return Self::create(path, columns);
        }
        if found != expected {
            let Some(places) = places(&found, &expected) else {
                return Err(TableError::OtherColumns { path: path.to_owned(), expected, found });
            };
            widen(path, length, &expected, &places).map_err(cannot_write)?;
            return Self::resume(path, columns, step);
        }
        file.set_len(length).and_then(|()| file.seek(SeekFrom::End(0))).map_err(cannot_write)?;
        Ok(Self { path: path.to_owned(), columns: columns.to_vec(), file, line: String::new(), last })
    }

    /// Step of the last row, if there is any.
    #[must_use]
    pub fn last_step(&self) -> Option<u64> {
        self.last
    }

    /// Adds the row of `step`.
    ///
    /// # Errors
    /// If a number is not finite, if the row does not fit the columns, or if the file system refuses; nothing of the
    /// row is written in the first two cases.
    pub fn record(&mut self, step: u64, values: &[Value]) -> Result<(), TableError> {
        use std::fmt::Write as _;

        let (expected, found) = (self.columns.len(), values.len());
        if expected != found {
            return Err(TableError::WrongWidth { path: self.path.clone(), expected, found });
        }
        self.line.clear();
        let _ = write!(self.line, "{step}");
        for (column, value) in self.columns.iter().zip(values) {
            self.line.push(',');
            match value {
                Value::Real(value) if !value.is_finite() => {
                    let (path, column) = (self.path.clone(), column.name.clone());
                    return Err(TableError::NotFinite { path, column, value: *value, step });
                }
                Value::Real(value) => self.line.push_str(&shortest(*value)),
                Value::Count(count) => drop(write!(self.line, "{count}")),
                // A row is a line.
                Value::Text(text) => self.line.push_str(&quoted(&text.replace(['\n', '\r'], " "))),
                Value::Missing => {}
            }
        }
        self.line.push('\n');
        self.file
            .write_all(self.line.as_bytes())
            .map_err(|source| TableError::Write { path: self.path.clone(), source })?;
        self.last = Some(step);
        Ok(())
    }
}

fn header(columns: &[Column]) -> String {
    columns.iter().fold("step".to_owned(), |header, column| format!("{header},{}", column.heading()))
}

/// The part of a table up to a step.
struct GoodPart {
    /// First line; empty if the file ends within it.
    header: String,
    /// Length \[bytes].
    length: u64,
    /// Step of the last row.
    last: Option<u64>,
}

/// Finds the part of a table up to `step`.
fn good_part(file: &File, step: u64) -> io::Result<GoodPart> {
    let mut lines = BufReader::new(file);
    let mut line = Vec::new();
    let mut length = lines.read_until(b'\n', &mut line)? as u64;
    if line.pop() != Some(b'\n') {
        return Ok(GoodPart { header: String::new(), length, last: None });
    }
    let header = String::from_utf8_lossy(&line).into_owned();
    let mut last = None;
    loop {
        line.clear();
        let read = lines.read_until(b'\n', &mut line)?;
        let row = std::str::from_utf8(&line).ok().and_then(|line| line.strip_suffix('\n'));
        let row_step = row.and_then(|row| unquoted(fields(row).next()?).parse::<u64>().ok());
        if row_step.is_none_or(|row_step| row_step > step) {
            return Ok(GoodPart { header, length, last });
        }
        (length, last) = (length + read as u64, row_step);
    }
}

/// Number of each column of one header in another; `None` if that lacks a column of the first one.
fn places(found: &str, expected: &str) -> Option<Vec<usize>> {
    fields(found).map(|name| fields(expected).position(|other| unquoted(other) == unquoted(name))).collect()
}

/// Replaces the first `length` bytes of a table by the same rows under a wider `header`, all at once.
fn widen(path: &Path, length: u64, header: &str, places: &[usize]) -> io::Result<()> {
    let text = std::fs::read_to_string(path)?;
    let width = fields(header).count();
    replace_file(path, |file| {
        writeln!(file, "{header}")?;
        for line in text[..length as usize].lines().skip(1) {
            let mut row = vec![""; width];
            fields(line).zip(places).for_each(|(field, &place)| row[place] = field);
            writeln!(file, "{}", row.join(","))?;
        }
        Ok(())
    })
}

/// The fields of a line as they are written, quotes included.
pub fn fields(line: &str) -> impl Iterator<Item = &str> {
    let mut is_quoted = false;
    line.split(move |character| {
        is_quoted ^= character == '"';
        character == ',' && !is_quoted
    })
}

/// What a field says: without the quotes around it, and with one quote for two within them (RFC 4180).
#[must_use]
pub fn unquoted(field: &str) -> Cow<'_, str> {
    match field.trim().strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) {
        Some(inner) if inner.contains('"') => Cow::Owned(inner.replace("\"\"", "\"")),
        Some(inner) => Cow::Borrowed(inner),
        None => Cow::Borrowed(field),
    }
}

/// Replaces `path` by rows of fields, the heading first, all at once.
///
/// # Errors
/// If the file system refuses; the old file is then untouched.
pub fn write_csv(path: &Path, rows: impl IntoIterator<Item: IntoIterator<Item: AsRef<str>>>) -> io::Result<()> {
    let text: String = rows.into_iter().map(csv_line).collect();
    replace_file(path, |file| file.write_all(text.as_bytes()))
}

/// A line of CSV (RFC 4180) with its end: a field is quoted if it holds a comma, a quote or the end of a line.
fn csv_line(fields: impl IntoIterator<Item: AsRef<str>>) -> String {
    let fields: Vec<String> = fields.into_iter().map(|field| quoted(field.as_ref())).collect();
    fields.join(",") + "\n"
}

/// Shortest decimal that reads back to the same bits, with an exponent where that is shorter to read.
fn shortest(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e9).contains(&size) { format!("{value:e}") } else { format!("{value}") }
}

fn quoted(field: &str) -> String {
    let is_plain = !field.contains([',', '"', '\n', '\r']);
    if is_plain { field.to_owned() } else { format!("\"{}\"", field.replace('"', "\"\"")) }
}

/// Replaces `path` by `value` as indented JSON, all at once. JSON knows no NaN: numbers that are not finite become
/// `null`, as what was not observed does.
///
/// # Errors
/// If the value has no JSON form or the file system refuses; the old file is then untouched.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), TableError> {
    replace_file(path, |file| {
        serde_json::to_writer_pretty(&mut *file, value)?;
        file.write_all(b"\n")
    })
    .map_err(|source| TableError::Write { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns() -> Vec<Column> {
        vec![Column::new("time", "s"), Column::new("contacts", ""), Column::new("limit", "")]
    }

    fn row(step: u64) -> [Value; 3] {
        [(step as f64 * 1e-5).into(), step.into(), "grain motion".into()]
    }

    #[test]
    fn each_row_is_in_the_file_before_the_next_one_comes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.csv");
        let mut series = SeriesWriter::create(&path, &columns()).unwrap();
        let mut expected = "step,time [s],contacts,limit\n".to_owned();
        for (step, text) in [(0, "0,0,0,grain motion\n"), (7, "7,7.000000000000001e-5,7,grain motion\n")] {
            series.record(step, &row(step)).unwrap();
            expected.push_str(text);
            assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
        }
        series.record(8, &[Value::Missing, Some(3_usize).into(), "a, \"b\"\n".into()]).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap().ends_with("\n8,,3,\"a, \"\"b\"\" \"\n"));
    }

    #[test]
    fn quoted_fields_say_what_was_written() {
        for text in ["plain", "a, b", "\"a\", b", "", "5"] {
            let line = format!("{},1", quoted(text));
            assert_eq!(fields(&line).map(unquoted).collect::<Vec<_>>(), [text, "1"]);
        }
        assert_eq!(unquoted("\"0.5\""), "0.5");
        assert_eq!(unquoted("half \"quoted\" only"), "half \"quoted\" only");
    }

    #[test]
    fn a_table_that_a_spreadsheet_quoted_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.csv");
        let all =
            "\"step\",\"time [s]\",\"contacts\",\"limit\"\n\"1\",\"1e-5\",\"1\",\"a\"\n\"2\",\"2e-5\",\"2\",\"b\"\n";
        std::fs::write(&path, all).unwrap();
        let mut series = SeriesWriter::resume(&path, &columns(), 1).unwrap();
        assert_eq!(series.last_step(), Some(1));
        series.record(2, &row(2)).unwrap();
        let expected = "step,time [s],contacts,limit\n\"1\",\"1e-5\",\"1\",\"a\"\n2,2e-5,2,grain motion\n";
        assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
    }

    #[test]
    fn a_resumed_table_equals_an_uninterrupted_one() {
        let folder = tempfile::tempdir().unwrap();
        let (whole, broken) = (folder.path().join("whole.csv"), folder.path().join("broken.csv"));
        let mut series = SeriesWriter::create(&whole, &columns()).unwrap();
        (0..20).for_each(|n| series.record(n * 10, &row(n * 10)).unwrap());
        let complete = std::fs::read(&whole).unwrap();
        for cut in [complete.len(), complete.len() - 1, complete.len() - 9] {
            for step in [0, 94, 95, 100, 160] {
                std::fs::write(&broken, &complete[..cut]).unwrap();
                let mut series = SeriesWriter::resume(&broken, &columns(), step).unwrap();
                let rows = std::fs::read_to_string(&broken).unwrap().lines().count() - 1;
                assert_eq!(rows as u64, step / 10 + 1);
                (step / 10 + 1..20).for_each(|n| series.record(n * 10, &row(n * 10)).unwrap());
                assert_eq!(std::fs::read(&broken).unwrap(), complete);
            }
        }
    }

    #[test]
    fn the_last_row_of_a_damaged_table_is_known() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.csv");
        let mut series = SeriesWriter::create(&path, &columns()).unwrap();
        assert_eq!(series.last_step(), None);
        (0..20).for_each(|n| series.record(n * 10, &row(n * 10)).unwrap());
        assert_eq!(series.last_step(), Some(190));
        let complete = std::fs::read(&path).unwrap();
        let resumed = |bytes: &[u8], step| {
            std::fs::write(&path, bytes).unwrap();
            SeriesWriter::resume(&path, &columns(), step).unwrap().last_step()
        };
        assert_eq!(resumed(&complete, 100), Some(100));
        let lines: Vec<usize> = (0..complete.len()).filter(|&n| complete[n] == b'\n').collect();
        // Cut after the row of step 40, within the next one, within the header; and a row that is no text.
        assert_eq!(resumed(&complete[..=lines[5]], 100), Some(40));
        assert_eq!(resumed(&complete[..lines[5] + 4], 100), Some(40));
        assert_eq!(resumed(&complete[..10], 100), None);
        let mut damaged = complete.clone();
        damaged[lines[5] + 1..lines[6]].fill(0xff);
        assert_eq!(resumed(&damaged, 100), Some(40));
    }

    #[test]
    fn a_table_of_fewer_columns_is_widened() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.csv");
        let few = [columns()[2].clone(), columns()[0].clone()];
        let mut series = SeriesWriter::create(&path, &few).unwrap();
        (0..3).for_each(|n| series.record(n, &["a, b".into(), (0.5 * n as f64).into()]).unwrap());
        let mut series = SeriesWriter::resume(&path, &columns(), 1).unwrap();
        series.record(2, &row(2)).unwrap();
        let expected = "step,time [s],contacts,limit\n0,0,,\"a, b\"\n1,0.5,,\"a, b\"\n2,2e-5,2,grain motion\n";
        assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
    }

    #[test]
    fn resuming_refuses_a_table_of_other_columns_and_starts_a_missing_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.csv");
        SeriesWriter::resume(&path, &columns(), 3).unwrap().record(4, &row(4)).unwrap();
        let before = std::fs::read(&path).unwrap();
        let error = SeriesWriter::resume(&path, &columns()[..2], 3).unwrap_err();
        assert!(matches!(error, TableError::OtherColumns { .. }), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), before);
    }

    #[test]
    fn what_is_no_number_never_reaches_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.csv");
        let mut series = SeriesWriter::create(&path, &columns()).unwrap();
        let before = std::fs::read(&path).unwrap();
        let error = series.record(5, &[f64::NAN.into(), 1_u64.into(), "x".into()]).unwrap_err();
        assert!(matches!(error, TableError::NotFinite { step: 5, .. }), "{error}");
        assert!(matches!(series.record(5, &row(5)[..2]), Err(TableError::WrongWidth { expected: 3, found: 2, .. })));
        assert_eq!(std::fs::read(&path).unwrap(), before);
    }

    #[test]
    fn numbers_read_back_to_the_bit() {
        for value in [0.0, -0.0, 1.0, 0.1, 1e-5, 123_456.789, 1.0 / 3.0, 6.02e23, f64::MIN_POSITIVE, -f64::MAX] {
            assert_eq!(shortest(value).parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
    }

    #[test]
    fn json_is_replaced_as_a_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("summary.json");
        write_json(&path, &serde_json::json!({"status": "running", "time_s": 0.25})).unwrap();
        write_json(&path, &serde_json::json!({"status": "finished", "time_s": 0.5})).unwrap();
        let read: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        assert_eq!(read, serde_json::json!({"status": "finished", "time_s": 0.5}));
        assert!(write_json(&folder.path().join("none/summary.json"), &1).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
