//! The bed file that a run writes: whether it can be written, and the mark of the case that made it.

use std::path::{Path, PathBuf};

pub use sazanami_io::bed::{Bed, BedFileError, BedGrain, Recipe};

use crate::case::meaning::Case;
use crate::case::{Diagnostics, LoadedCase, resolved};

/// Hash of the tables of a case that packed grains depend on: the same whatever the water does, whatever is written,
/// and whatever keys other tables have come to know.
#[must_use]
pub fn hash_of(case: &Case) -> String {
    resolved::hash_of_tables(case, &["solver", "gravity", "domain", "boundary", "dem", "material", "contact", "grains"])
}

/// The bed file of the run has to be writable before hours are spent on the bed.
pub(crate) fn can_be_written(loaded: &LoadedCase, report: &mut Diagnostics) {
    let Some(path) = &loaded.case.output.bed else { return };
    let span = loaded.places.at("output.bed");
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let title = format!("the bed cannot be written to `{}`", path.display());
    if path.is_dir() {
        report.error(span, title).label("this is a folder").help("add the name of a file, for example `made.bed`");
    } else if !folder.is_dir() {
        report
            .error(span, title)
            .label(format!("there is no folder `{}`", folder.display()))
            .help("make the folder first, or name another");
    } else if let Some(Err(error)) = path.exists().then(|| Bed::read(path)) {
        let label = format!("there is something that is no bed: {error}");
        report.error(span, title).label(label).help("name another file, or take this one away first");
    } else if let Err(error) = try_to_write(folder) {
        report.error(span, title).label(error.to_string()).help("name a file in a folder that can be written to");
    }
}

/// Writes a file of no content into `folder`, and removes it.
fn try_to_write(folder: &Path) -> std::io::Result<()> {
    let trial: PathBuf = folder.join(format!(".sazanami-write-test-{}", std::process::id()));
    std::fs::File::create(&trial)?;
    std::fs::remove_file(&trial)
}
