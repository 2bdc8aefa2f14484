//! Case files: every key is declared once, and from its declaration come its reading with all findings at once, the copy
//! of the case with every default, the JSON Schema, the reference page and what `sazanami explain` says.
//!
//! A table is a struct in [`tables`] that derives [`Keys`]; to add a key, add a field there and use it. Alternatives are
//! enumerations of the crates that implement them, with their words ([`sazanami_numerics::choice`]).
//!
//! ```
//! use std::path::Path;
//!
//! let text = "[domain]\nsize = [\"1 mm\", \"1 mm\", \"2 mm\"]\ncells = [4, 4, 8]\n[run]\nuntil = \"1 ms\"\n";
//! let loaded = sazanami_case::parse(Path::new("small.toml"), text, &[]).expect("this case is complete");
//! assert_eq!(loaded.case.domain.upper.z, 2e-3);
//! let error = sazanami_case::parse(Path::new("small.toml"), text, &["run.untill=1 s".into()]).unwrap_err();
//! assert!(error.to_string().contains("did you mean `until`?"));
//! ```

pub mod amounts;
mod bridges;
mod case;
mod changed;
mod cross_checks;
pub mod diagnostics;
mod driven;
mod entry_pressure;
mod explain;
mod followed;
pub mod key;
mod known;
mod liquids_at_walls;
mod moving_particles;
mod overrides;
mod plausible;
pub mod presets;
pub mod read;
pub mod reference;
mod removed;
pub mod resolved;
mod schema;
pub mod si;
pub mod source;
mod suggest;
mod surface_tension;
pub mod tables;
pub mod units;
pub mod value;
pub mod write;

use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

pub use case::Case;
pub use changed::{Changed, DefaultValue, MOST_TRIED, changed, longer_than_tried, values};
pub use diagnostics::{Diagnostic, DiagnosticRecord, Diagnostics, Severity};
pub use explain::{Explained, explain, key_paths, value_paths};
pub use key::Keys;
pub use read::Places;
pub use schema::json_schema;
pub use source::Source;
pub use suggest::nearest;

/// The case and all that its tables mean, in one place.
pub mod meaning {
    pub use crate::case::Case;
    pub use crate::presets::{Paper, Preset, Solver};
    pub use crate::tables::*;
    pub use sazanami_dem::{Damping, Lattice, LinearSpringDashpot, Motion, Substeps};
    pub use sazanami_mics::grains::Exchange;
    pub use sazanami_mics::viscosity::ViscosityScheme;
    pub use sazanami_observe::erosion::CountedGrains;
    pub use sazanami_observe::heap::HeapShape;
}

/// More errors than this help nobody.
const MOST_ERRORS: usize = 40;
/// Longest case file \[bytes].
const LONGEST: u64 = 64 << 20;

/// A case with the text it was read from, for findings that come later.
#[derive(Clone, Debug)]
pub struct LoadedCase {
    /// Meaning.
    pub case: Case,
    /// The case file.
    pub path: PathBuf,
    /// Its text and overrides.
    pub source: Source,
    /// Warnings about the case; it can run with them.
    pub warnings: Diagnostics,
    /// Places of the keys in the file, for later findings.
    pub places: Places,
}

impl LoadedCase {
    /// Why it cannot run: findings on its text, at least one of them an error.
    #[must_use]
    pub fn refused(&self, diagnostics: Diagnostics) -> Box<CaseError> {
        Box::new(CaseError { source: self.source.clone(), diagnostics })
    }

    /// The case without some of its populations, by their numbers: the others keep their places in the text.
    #[must_use]
    pub fn without_grains(&self, left_out: &[usize]) -> Self {
        let mut rest = self.clone();
        let mut number = 0..;
        rest.case.grains.retain(|_| number.next().is_some_and(|n| !left_out.contains(&n)));
        rest.places = self.places.without_grains(left_out);
        rest
    }
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
    match text_of(path) {
        Ok(text) => parse(path, &text, overrides),
        Err(why) => {
            let source = Source::new(path.display().to_string(), "", overrides);
            let mut diagnostics = Diagnostics::default();
            diagnostics
                .error_in_file("the case file cannot be read")
                .label(why)
                .help(beside(path).unwrap_or("`sazanami new` lists templates for case files".to_owned()));
            Err(Box::new(CaseError { source, diagnostics }))
        }
    }
}

/// The case file in the folder of a `path` that was meant by it, if there is nothing there.
fn beside(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.exists() {
        return None;
    }
    let names: Vec<String> = std::fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.ends_with(".toml"))
        .collect();
    let meant = nearest(path.file_name()?.to_str()?, names.iter().map(String::as_str))?;
    Some(format!("did you mean `{}`?", path.with_file_name(meant).display()))
}

/// Whether this is a pipe, whose opening waits for somebody to write to it; those of a shell have names of their own.
fn is_pipe(path: &Path) -> bool {
    let of_shell = ["/dev", "/proc"].iter().any(|folder| path.starts_with(folder));
    !of_shell && std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// The text of a case file, or why there is none.
fn text_of(path: &Path) -> Result<String, String> {
    use std::io::Read as _;
    if is_pipe(path) {
        return Err("this is a pipe, not a file".to_owned());
    }
    let mut bytes = Vec::new();
    // Devices and pipes say nothing of their length, and some have no end.
    let read = std::fs::File::open(path).and_then(|file| file.take(LONGEST + 1).read_to_end(&mut bytes));
    read.map_err(|error| error.to_string())?;
    if bytes.len() as u64 > LONGEST {
        return Err(format!("it is longer than {} MiB: this is no case file", LONGEST >> 20));
    }
    String::from_utf8(bytes).map_err(|error| {
        let line = source::line_of(error.as_bytes(), error.utf8_error().valid_up_to());
        format!("line {line} is not UTF-8: save the file in that encoding")
    })
}

/// Tables of a case that say how heaps and craters are evaluated, from a checkpoint, and nothing of how the run goes.
pub const CRATERS_EVALUATED: [&str; 3] = ["bed", "heap", "erosion"];
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
    let name = path.file_stem().map_or_else(|| "case".into(), |stem| stem.to_string_lossy().into_owned());
    let folder = path.parent().unwrap_or(Path::new(""));
    let read = read_source(&source, &name, folder, &mut diagnostics);
    match read {
        Some((case, places)) if !diagnostics.has_errors() => {
            Ok(LoadedCase { case, path: path.to_owned(), source, warnings: diagnostics, places })
        }
        _ => Err(Box::new(CaseError { source, diagnostics })),
    }
}

/// Whether there is a comma between digits at byte `at` of the text, and no second one as in a list.
fn is_decimal_comma(text: &str, at: usize) -> bool {
    let (before, after) = text.as_bytes().split_at(at.min(text.len()));
    let digits = after.iter().skip(1).take_while(|byte| byte.is_ascii_digit()).count();
    after.first() == Some(&b',')
        && before.last().is_some_and(u8::is_ascii_digit)
        && digits > 0
        && after.get(1 + digits) != Some(&b',')
}

fn read_source(source: &Source, name: &str, folder: &Path, report: &mut Diagnostics) -> Option<(Case, Places)> {
    let padded = overrides::padded_values(source);
    let (mut tree, syntax_errors) = DeTable::parse_recoverable(source.text());
    for error in syntax_errors.iter().take(MOST_ERRORS) {
        let span = error.span().unwrap_or(0..0);
        let help = match error.message() {
            "duplicate key" => "a key stands once in its table: leave out one of the two",
            _ if is_decimal_comma(source.text(), span.start) => "decimals follow a decimal point, not a comma",
            _ => "texts stand in quotes, tables in brackets, lists in brackets with commas",
        };
        report.error(span, "this is not TOML").label(error.message().to_owned()).help(help);
    }
    if !syntax_errors.is_empty() {
        return None;
    }
    if let Some((name, _)) = tree.get_ref().get_key_value("case").filter(|_| !tree.get_ref().contains_key("domain")) {
        report
            .error(name.span(), "this is the plan of a sweep, not a case")
            .label("it names its case")
            .help("`sazanami sweep` makes its runs, `sazanami calibrate` those of one with `[targets]`");
        return None;
    }
    overrides::apply(&mut tree, source, &padded, report);
    let root = DeValue::Table(tree.into_inner());
    let mut context = read::Context::new(report, folder);
    context.known.file_name = name.to_owned();
    let case = Case::read(&read::At::root(&root), &mut context)?;
    Some((case, context.places))
}
