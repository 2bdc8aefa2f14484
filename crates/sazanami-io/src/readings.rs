//! Small tables of numbers that people bring along: profiles read from photographs, motions of a tank.
//!
//! The format is CSV: lines that begin with `#` are comments, which may declare something as `# key: value` or
//! `# key = value`; then a line with the names of the columns, units in the names (`x_m,z_m`); then a line of numbers
//! per row. Fields may stand in quotes. The first column asked for increases strictly from row to row.

mod error;

pub use error::{ReadingsError, Trouble};

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

use crate::table::{fields, unquoted};

/// A declared value, with the line it stands in.
#[derive(Clone, Debug, PartialEq)]
struct Declaration {
    key: String,
    value: String,
    line: usize,
}

/// Columns of numbers from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Readings {
    path: PathBuf,
    declarations: Vec<Declaration>,
    columns: Vec<Vec<f64>>,
}

impl Readings {
    /// Reads the columns `names` of a file, in that order, whatever the order in the file; others are left alone. The
    /// first of them has to increase strictly, and there have to be at least `least_rows` rows.
    ///
    /// # Errors
    /// [`ReadingsError`] names the file, the line, and what was expected there.
    pub fn read(path: &Path, names: &[&str], least_rows: usize) -> Result<Self, ReadingsError> {
        let bytes = crate::input::read(path).map_err(|source| ReadingsError::Read { path: path.to_owned(), source })?;
        Self::parse(path, &bytes, names, least_rows)
    }

    /// The same, or nothing if there is no such file.
    ///
    /// # Errors
    /// As [`Self::read`], for a file that is there.
    pub fn read_if_there(path: &Path, names: &[&str], least_rows: usize) -> Result<Option<Self>, ReadingsError> {
        match Self::read(path, names, least_rows) {
            Err(ReadingsError::Read { source, .. }) if source.kind() == io::ErrorKind::NotFound => Ok(None),
            other => other.map(Some),
        }
    }

    /// Takes the columns out of the bytes of a file; `path` is for the messages.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(path: &Path, bytes: &[u8], names: &[&str], least_rows: usize) -> Result<Self, ReadingsError> {
        let mut declarations = Vec::new();
        let mut head: Option<(Vec<Cow<str>>, Vec<usize>)> = None;
        let mut columns = vec![Vec::new(); names.len()];
        let mut last_line = 0;
        for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
            let at = |trouble| ReadingsError::Line { path: path.to_owned(), line: number + 1, trouble };
            let text = std::str::from_utf8(line).map_err(|_| at(Trouble::NotText))?;
            let text = if number == 0 { text.trim_start_matches('\u{feff}') } else { text }.trim();
            if text.is_empty() {
                continue;
            }
            last_line = number + 1;
            if let Some(comment) = text.strip_prefix('#') {
                declarations.extend(declaration(comment, number + 1));
                continue;
            }
            let fields: Vec<Cow<str>> = fields(text).map(|field| unquoted(field.trim())).collect();
            match &head {
                None => {
                    let places = places(&fields, names).map_err(at)?;
                    head = Some((fields, places));
                }
                Some((known, places)) => row(&fields, known, places, &mut columns).map_err(at)?,
            }
        }
        let at_end = |trouble| ReadingsError::Line { path: path.to_owned(), line: last_line.max(1), trouble };
        if head.is_none() {
            return Err(at_end(Trouble::NoHead { expected: names.join(",") }));
        }
        let found = columns.first().map_or(0, Vec::len);
        if found < least_rows {
            return Err(at_end(Trouble::TooFewRows { found, needed: least_rows }));
        }
        Ok(Self { path: path.to_owned(), declarations, columns })
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Values of the column that was asked for as number `number`, counted from 0.
    ///
    /// # Panics
    /// If fewer columns were asked for.
    #[must_use]
    pub fn column(&self, number: usize) -> &[f64] {
        &self.columns[number]
    }

    /// Pairs of the first two columns asked for.
    ///
    /// # Panics
    /// If fewer were asked for.
    #[must_use]
    pub fn points(&self) -> Vec<[f64; 2]> {
        self.columns[0].iter().zip(&self.columns[1]).map(|(&x, &y)| [x, y]).collect()
    }

    /// Value that a comment declares for `key`; the first one counts.
    #[must_use]
    pub fn declared(&self, key: &str) -> Option<&str> {
        self.declarations.iter().find(|known| known.key == key).map(|known| known.value.as_str())
    }

    /// A number that a comment declares for `key`.
    ///
    /// # Errors
    /// If it declares something else than a finite number.
    pub fn declared_number(&self, key: &str) -> Result<Option<f64>, ReadingsError> {
        let Some(known) = self.declarations.iter().find(|known| known.key == key) else { return Ok(None) };
        let number = known.value.parse::<f64>().ok().filter(|value| value.is_finite());
        let trouble = Trouble::NotNumber { column: key.to_owned(), found: known.value.clone() };
        number.map(Some).ok_or_else(|| self.wrong(key, trouble))
    }

    /// An error about what a comment declares for `key`.
    pub(crate) fn wrong(&self, key: &str, trouble: Trouble) -> ReadingsError {
        let line = self.declarations.iter().find(|known| known.key == key).map_or(1, |known| known.line);
        ReadingsError::Line { path: self.path.clone(), line, trouble }
    }
}

/// Declaration in a comment, if there is one: the part before the first `:` or `=` is one word.
fn declaration(comment: &str, line: usize) -> Option<Declaration> {
    let (key, value) = comment.split_once([':', '='])?;
    let (key, value) = (key.trim(), value.trim());
    let is_word = !key.is_empty() && !key.contains(char::is_whitespace);
    is_word.then(|| Declaration { key: key.to_owned(), value: value.to_owned(), line })
}

/// Numbers of the columns asked for.
fn places(fields: &[Cow<str>], names: &[&str]) -> Result<Vec<usize>, Trouble> {
    let all = |name: &str| fields.iter().filter(|field| *field == name).count();
    if let Some(twice) = fields.iter().find(|name| !name.is_empty() && all(name) > 1) {
        return Err(Trouble::Twice { column: twice.to_string() });
    }
    let place = |name: &&str| fields.iter().position(|field| field == *name);
    names.iter().map(place).collect::<Option<Vec<usize>>>().ok_or_else(|| Trouble::MissingColumns {
        missing: names.iter().filter(|name| place(name).is_none()).copied().collect::<Vec<_>>().join(","),
        found: fields.join(","),
    })
}

/// Adds a row to the columns.
fn row(fields: &[Cow<str>], known: &[Cow<str>], places: &[usize], columns: &mut [Vec<f64>]) -> Result<(), Trouble> {
    if fields.len() != known.len() {
        return Err(Trouble::OtherWidth { found: fields.len(), expected: known.len() });
    }
    for (number, (column, &place)) in columns.iter_mut().zip(places).enumerate() {
        let value = fields[place].parse::<f64>().ok().filter(|value| value.is_finite());
        let value = value
            .ok_or_else(|| Trouble::NotNumber { column: known[place].to_string(), found: fields[place].to_string() })?;
        if let Some(&before) = column.last()
            && number == 0
            && value <= before
        {
            return Err(Trouble::Disordered { column: known[place].to_string(), before, found: value });
        }
        column.push(value);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
