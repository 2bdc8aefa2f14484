//! Why a table of readings cannot be used.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// Why a table of readings cannot be used.
#[derive(Debug, Error)]
pub enum ReadingsError {
    /// The file system refused.
    #[error("cannot read {path}: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Refusal of the file system.
        source: io::Error,
    },
    /// A line is not what it should be.
    #[error("{path}, line {line}: {trouble}", path = path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// Its error.
        trouble: Trouble,
    },
}

/// Problem of a line.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Trouble {
    /// Bytes that are not UTF-8 text.
    #[error("this is not UTF-8 text")]
    NotText,
    /// There is nothing but comments.
    #[error("the file ends without a line of column names; expected `{expected}`")]
    NoHead {
        /// Names expected.
        expected: String,
    },
    /// Columns are not there, or have another unit.
    #[error("the columns are `{found}`; expected `{missing}` among them, separated by commas, with that unit")]
    MissingColumns {
        /// Names of the columns that are not there.
        missing: String,
        /// The line.
        found: String,
    },
    /// Two columns have the same name.
    #[error("two columns are called `{column}`; expected different names")]
    Twice {
        /// The name.
        column: String,
    },
    /// More or fewer fields than columns.
    #[error("{found} fields; expected {expected}, one for each column")]
    OtherWidth {
        /// Number of fields.
        found: usize,
        /// Number of columns.
        expected: usize,
    },
    /// Not a finite number.
    #[error("`{found}` for {column}; expected a finite number such as -0.0125 or 1.5e-3")]
    NotNumber {
        /// Name of the column, or of what is declared.
        column: String,
        /// The field.
        found: String,
    },
    /// The first column does not increase.
    #[error("{column} goes from {before} to {found}; expected values that increase from row to row")]
    Disordered {
        /// Name of the column.
        column: String,
        /// Value of the row before.
        before: f64,
        /// Value of this row.
        found: f64,
    },
    /// Fewer rows of numbers than a reading needs.
    #[error("the file ends after {found} rows of numbers; expected at least {needed}")]
    TooFewRows {
        /// Number of rows.
        found: usize,
        /// Number needed.
        needed: usize,
    },
    /// A declared length or time is below zero.
    #[error("{key} is {found}; expected zero or more")]
    Negative {
        /// Name of the value.
        key: String,
        /// Its value.
        found: f64,
    },
}
