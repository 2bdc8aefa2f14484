//! Case files: read as written ([`schema`]), given their meaning ([`meaning`]), and written out again
//! with every default ([`resolved`]).

mod build;
pub mod diagnostics;
pub mod meaning;
mod overrides;
pub mod presets;
mod read;
pub mod resolved;
pub mod schema;
pub mod source;
mod suggest;
pub mod units;
mod value;
pub mod written;

use std::path::{Path, PathBuf};

pub use diagnostics::{Diagnostic, DiagnosticRecord, Diagnostics, Severity};
pub use meaning::Case;
pub use source::Source;
pub use suggest::nearest;

/// A case with the text it was read from, for findings that come later.
#[derive(Clone, Debug)]
pub struct LoadedCase {
    /// What it means.
    pub case: Case,
    /// The case file.
    pub path: PathBuf,
    /// Its text and overrides.
    pub source: Source,
    /// Warnings.
    pub warnings: Diagnostics,
    /// What was written where, for later findings.
    pub text: schema::CaseText,
}

/// Why there is no case: findings on a text.
#[derive(Clone, Debug)]
pub struct CaseError {
    /// The text.
    pub source: Source,
    /// The findings, at least one of them an error.
    pub diagnostics: Diagnostics,
}

impl std::fmt::Display for CaseError {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.diagnostics.render(&self.source, false))
    }
}

impl std::error::Error for CaseError {}

/// Reads the case file at `path` with `path=value` overrides laid over it.
///
/// # Errors
/// All findings together, if one of them is an error.
pub fn load(path: &Path, overrides: &[String]) -> Result<LoadedCase, Box<CaseError>> {
    match std::fs::read_to_string(path) {
        Ok(text) => parse(path, &text, overrides),
        Err(error) => {
            let source = Source::new(path.display().to_string(), "", overrides);
            let mut diagnostics = Diagnostics::default();
            diagnostics
                .error_in_file("the case file cannot be read")
                .label(error.to_string())
                .help("`sazanami new` lists templates for case files");
            Err(Box::new(CaseError { source, diagnostics }))
        }
    }
}

/// Tables of a case that say how craters are evaluated, from a checkpoint, and nothing of how the run goes.
pub const CRATERS_EVALUATED: [&str; 2] = ["bed", "erosion"];
/// Keys that say how ripples are evaluated from tables: layers and surfaces were gathered during the run.
pub const RIPPLES_EVALUATED: [&str; 3] = ["ripples.grain_size", "ripples.margin", "ripples.measured"];

/// Reads the case file of a run that has been, with overrides of how it is evaluated: of the keys `evaluated`, each a
/// table or a `table.key`, and what is under them.
///
/// # Errors
/// If other keys are overridden, and as [`load`].
pub fn load_evaluated(path: &Path, overrides: &[String], evaluated: &[&str]) -> Result<LoadedCase, Box<CaseError>> {
    let source = Source::new(path.display().to_string(), "", overrides);
    let mut diagnostics = Diagnostics::default();
    overrides::only_of(&source, evaluated, &mut diagnostics);
    if diagnostics.has_errors() { Err(Box::new(CaseError { source, diagnostics })) } else { load(path, overrides) }
}

/// Reads a case from its text; file names in it are relative to the folder of `path`.
///
/// # Errors
/// All findings together, if one of them is an error.
pub fn parse(path: &Path, text: &str, overrides: &[String]) -> Result<LoadedCase, Box<CaseError>> {
    let source = Source::new(path.display().to_string(), text, overrides);
    let mut diagnostics = Diagnostics::default();
    let reading = read::read(&source, &mut diagnostics);
    let name = path.file_stem().map_or_else(|| "case".into(), |stem| stem.to_string_lossy().into_owned());
    let folder = path.parent().unwrap_or(Path::new(""));
    let unreadable = diagnostics.has_errors() && reading.text == schema::CaseText::default();
    let case = (!unreadable).then(|| build::build(&reading, &name, folder, &mut diagnostics));
    match case {
        Some(case) if !diagnostics.has_errors() => {
            Ok(LoadedCase { case, path: path.to_owned(), source, warnings: diagnostics, text: reading.text })
        }
        _ => Err(Box::new(CaseError { source, diagnostics })),
    }
}

/// The JSON Schema of case files, for editors.
#[must_use]
pub fn json_schema() -> String {
    let schema = schemars::schema_for!(schema::CaseText);
    let mut text = serde_json::to_string_pretty(&schema).expect("a schema is always JSON");
    text.push('\n');
    text
}
