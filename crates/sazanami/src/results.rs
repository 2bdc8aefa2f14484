//! The folder of results: chosen, refused or made before anything is computed or overwritten.

use std::fs;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

use crate::case::meaning::{Case, ContactSphereChoice, GrainPlacement, GrainShape, Population, TankMotion};
use crate::error::CommandError;
use crate::lock::FolderLock;
pub use crate::log::LOG;
pub use sazanami_io::as_word;
pub use sazanami_posing::assembly::grains::population_of;

/// Chooses and prepares the folder of a run: `out`, or else `runs/<case>-<n>` with the next free number.
///
/// # Errors
/// If `out` is not empty and `force` is not set, has files that a run would write and none of whose runs they are, is not a folder, or
/// cannot be written.
pub fn prepare(out: Option<&Path>, case_name: &str, force: bool) -> Result<PathBuf, CommandError> {
    let folder = match out {
        Some(folder) => folder.to_owned(),
        None => next_free(Path::new("runs"), case_name),
    };
    if folder.exists() && !folder.is_dir() {
        return Err(CommandError::input(
            format!("`{}` is a file, not a folder for results", folder.display()),
            "give another name with --out",
        ));
    }
    if !force && is_filled(&folder) {
        return Err(CommandError::input(
            format!("`{}` is not empty", folder.display()),
            "choose another folder with --out, overwrite it with --force, or go on with `sazanami resume`",
        ));
    }
    if let Some(own) = of_nobodys_run(&folder) {
        return Err(CommandError::input(
            format!("`{}` would be overwritten, and no run wrote it", folder.join(own).display()),
            "choose another folder with --out",
        ));
    }
    let unwritable = |error: std::io::Error| {
        CommandError::input(
            format!("nothing can be written to `{}`: {error}", folder.display()),
            "choose another folder with --out",
        )
    };
    fs::create_dir_all(&folder).map_err(unwritable)?;
    let trial = folder.join(".sazanami-write-test");
    fs::File::create(&trial).and_then(|mut file| file.write_all(b"sazanami")).map_err(unwritable)?;
    fs::remove_file(&trial).map_err(unwritable)?;
    Ok(folder)
}

/// The first file or folder in `folder` that a run would overwrite, if no run has been there.
fn of_nobodys_run(folder: &Path) -> Option<&'static str> {
    let begins = |name: &str| {
        let mut start = [0; 64];
        let read = fs::File::open(folder.join(name)).and_then(|mut file| file.read(&mut start));
        String::from_utf8_lossy(&start[..read.unwrap_or(0)]).into_owned()
    };
    // The copy of a case alone may be somebody's own beside what else it names.
    let has_run = begins(LOG).contains("  sazanami ") || begins(SUMMARY).starts_with('{');
    WRITTEN.into_iter().chain([CASE]).find(|name| !has_run && folder.join(name).exists())
}

/// Whether a run that has not ended holds `folder`.
#[must_use]
pub fn is_in_use(folder: &Path) -> bool {
    FolderLock::refuse_held(folder).is_err()
}

/// What a run wrote into its folder, relative to it: nothing beside that, nor what links within it lead to.
pub(crate) fn written(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut left: Vec<PathBuf> = WRITTEN.into_iter().chain([CASE, INPUTS]).map(PathBuf::from).collect();
    while let Some(name) = left.pop() {
        let path = folder.join(&name);
        // A folder of results may be a link to another disk; within it none is followed.
        let is_top = name.components().count() == 1;
        let entry = if is_top { fs::metadata(&path) } else { fs::symlink_metadata(&path) };
        match entry.map(|entry| entry.file_type()) {
            Ok(kind) if kind.is_dir() => {
                left.extend(
                    fs::read_dir(&path).into_iter().flatten().flatten().map(|entry| name.join(entry.file_name())),
                );
            }
            // What begins with a dot is being written.
            Ok(kind)
                if kind.is_file() && !name.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.')) =>
            {
                found.push(name.to_string_lossy().into_owned());
            }
            _ => {}
        }
    }
    found.sort();
    found
}

/// Files and folders that a run writes, beside its case.
const WRITTEN: [&str; 20] = [
    FIELDS,
    GRAINS,
    FIGURES,
    CHECKPOINTS,
    PROBES,
    ANALYSIS,
    FIELD_SERIES,
    GRAIN_SERIES,
    MESH_SERIES,
    SERIES,
    CRATER_PROFILES,
    BED_PROFILES,
    WATER_PROFILES,
    LAYER_MEANS,
    CYCLES,
    PREPARED,
    SUMMARY,
    PACKED_BED,
    REPORT,
    LOG,
];

/// The case as it is run.
pub const CASE: &str = "case.toml";
/// Summary of a run.
pub const SUMMARY: &str = "summary.json";
/// A row per observation.
pub const SERIES: &str = "series.csv";
/// Heights of the smoothed surface of a bed about the axis of a crater.
pub const CRATER_PROFILES: &str = "profiles.csv";
/// Heights of the bed's surface along a tank.
pub const BED_PROFILES: &str = "bed.csv";
/// Heights of the water's surface along a tank.
pub const WATER_PROFILES: &str = "water.csv";
/// Averages over the layers of the bed.
pub const LAYER_MEANS: &str = "layers.csv";
/// Averages over the layers of the bed in a cycle of the tank.
pub(crate) const CYCLES: &str = "cycles.csv";
/// Times and files of the fluid for ParaView.
pub const FIELD_SERIES: &str = "fields.pvd";
/// Times and files of the grains as points for ParaView.
pub const GRAIN_SERIES: &str = "grains.pvd";
/// Times and files of the surfaces of the grains for ParaView.
pub(crate) const MESH_SERIES: &str = "grain-meshes.pvd";
/// The bed that a run packed, unless its case names another file for it.
pub(crate) const PACKED_BED: &str = "packed.bed";
/// A tank with water at rest that a run prepared.
pub(crate) const PREPARED: &str = "prepared.state";

/// All of a run in one page.
pub const REPORT: &str = "report.html";

/// Folder of the fluid for ParaView.
pub(crate) const FIELDS: &str = "fields";
/// Folder of the grains for ParaView.
pub const GRAINS: &str = "grains";
/// Folder of the pictures.
pub(crate) const FIGURES: &str = "figures";
/// Folder of the checkpoints.
pub(crate) const CHECKPOINTS: &str = "checkpoints";
/// Folder of the tables of probes.
pub(crate) const PROBES: &str = "probes";
/// Folder of what an evaluation with other keys found.
pub(crate) const ANALYSIS: &str = "analysis";

/// Folder of the copies of the files that a case names.
const INPUTS: &str = "inputs";
/// Folders in it for what a population may name: mesh, contact spheres, bed.
const KINDS: [&str; 3] = ["shape", "contact-spheres", "bed"];
/// Beginning of the names of those for what a tank may name, of which some may be absent.
const TANK: &str = "tank";
/// Beginning of the names of those for liquids.
const LIQUID: &str = "liquid";

/// Copies the meshes, contact spheres, beds and liquids that a case names into `folder`, so that the run can go on without
/// the originals. Returns the case with the names of the copies, relative to `folder`.
///
/// # Errors
/// If a file cannot be read or written.
pub fn keep_inputs(case: &Case, folder: &Path) -> Result<Case, CommandError> {
    let mut kept = case.clone();
    let absolute = |path: &mut PathBuf| {
        if let Ok(found) = std::path::absolute(&*path) {
            *path = found;
        }
    };
    for (place, file) in inputs(&mut kept) {
        // Profiles of a tank may be absent.
        if file.is_file() || !place.starts_with(TANK) {
            *file = keep(file, folder, &Path::new(INPUTS).join(place))?;
        } else {
            absolute(file);
        }
    }
    let beds = kept.grains.iter_mut().filter_map(|population| match &mut population.placement {
        GrainPlacement::Bed(bed) => bed.recipe.as_mut(),
        _ => None,
    });
    beds.chain(&mut kept.output.bed).for_each(absolute);
    Ok(kept)
}

/// The case of a run in `folder` with the names of its copies relative to that, as its file has them.
pub fn named_within(case: &Case, folder: &Path) -> Case {
    let mut case = case.clone();
    for (_, file) in inputs(&mut case) {
        if let Ok(name) = file.strip_prefix(folder) {
            *file = name.to_owned();
        }
    }
    case
}

/// Copies `file` into `place` within `folder`; returns its name there.
fn keep(file: &Path, folder: &Path, place: &Path) -> Result<PathBuf, CommandError> {
    let Some(name) = file.file_name() else { return Ok(file.to_owned()) };
    let copy = place.join(name);
    let target = folder.join(&copy);
    let is_there = match (fs::canonicalize(file), fs::canonicalize(&target)) {
        (Ok(from), Ok(to)) => from == to,
        _ => false,
    };
    if !is_there {
        let copied = fs::create_dir_all(folder.join(place)).and_then(|()| fs::copy(file, &target).map(drop));
        copied.map_err(|error| {
            CommandError::input(
                format!("`{}` cannot be copied to `{}`: {error}", file.display(), target.display()),
                "choose another folder with --out",
            )
        })?;
    }
    Ok(copy)
}

/// Removes what an earlier run left in `folder`, so that nothing of it is taken for the new one; other files stay, and
/// so do the copies that `kept` names, which [`keep_inputs`] returned.
///
/// # Errors
/// If the file system refuses.
pub fn clear(folder: &Path, kept: &Case) -> Result<(), CommandError> {
    for name in WRITTEN {
        let path = folder.join(name);
        let outcome = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        removed(&path, outcome)?;
    }
    let needed: Vec<PathBuf> = inputs(&mut kept.clone()).into_iter().map(|(_, file)| folder.join(file)).collect();
    clear_inputs(&folder.join(INPUTS), &needed)
}

/// Folder of the copies for a population, by its number.
fn population(number: usize) -> String {
    format!("grains-{number}")
}

/// The files that a case names, each with the folder of its copy within [`INPUTS`]: meshes, contact spheres and beds of
/// its populations; motion, state and measured profiles of its tank; liquids.
fn inputs(case: &mut Case) -> Vec<(String, &mut PathBuf)> {
    let mut found = Vec::new();
    for (number, Population { shape, contact_spheres, placement, .. }) in case.grains.iter_mut().enumerate() {
        let mut add = |kind: usize, file| found.push((format!("{}/{}", population(number), KINDS[kind]), file));
        if let GrainShape::Mesh { file, .. } = shape {
            add(0, file);
        }
        if let ContactSphereChoice::File { file, .. } = contact_spheres {
            add(1, file);
        }
        if let GrainPlacement::Bed(bed) = placement {
            add(2, &mut bed.file);
        }
    }
    let motion = case.frame.as_mut().and_then(|frame| match &mut frame.motion {
        Some(TankMotion::File { file, .. }) => Some(file),
        _ => None,
    });
    let measured = case.ripples.iter_mut().flat_map(|ripples| &mut ripples.measured);
    let profiles = measured.flat_map(|measured| [&mut measured.bed, &mut measured.water]).flatten();
    let of_tank = motion.into_iter().chain(&mut case.preparation.state).chain(profiles).enumerate();
    found.extend(of_tank.map(|(number, file)| (format!("{TANK}-{number}"), file)));
    let of_liquids = case.liquids.iter_mut().flat_map(|liquid| liquid.region.files()).enumerate();
    found.extend(of_liquids.map(|(number, file)| (format!("{LIQUID}-{number}"), file)));
    found
}

/// The meshes, contact spheres, beds and liquids that a case names, and what its tank may name.
pub(crate) fn inputs_of(case: &mut Case) -> Vec<PathBuf> {
    inputs(case).into_iter().map(|(_, file)| file.clone()).collect()
}

/// Hashes of what the files hold that populations and liquids name, in their order.
pub(crate) fn contents(case: &Case) -> Vec<String> {
    let hash = |file: &Path| match fs::read(file) {
        Ok(bytes) => format!("{:016x}", xxhash_rust::xxh3::xxh3_64(&bytes)),
        Err(_) => "missing".to_owned(),
    };
    let mut case = case.clone();
    let files = inputs(&mut case).into_iter().filter(|(place, _)| !place.starts_with(TANK));
    files.map(|(_, file)| hash(file)).collect()
}

/// Removes the copies that [`keep_inputs`] made under `folder` for an earlier run but those `needed`, and the folders
/// that are empty then. What else lies there is somebody's own.
fn clear_inputs(folder: &Path, needed: &[PathBuf]) -> Result<(), CommandError> {
    for place in (0..).map(|number| folder.join(population(number))).take_while(|path| path.is_dir()) {
        for kind in KINDS.map(|kind| place.join(kind)) {
            for path in fs::read_dir(&kind).into_iter().flatten().flatten().map(|entry| entry.path()) {
                if path.is_file() && !needed.contains(&path) {
                    removed(&path, fs::remove_file(&path))?;
                }
            }
            remove_if_empty(&kind)?;
        }
        remove_if_empty(&place)?;
    }
    for place in fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
        let is_of = |name: &str| [TANK, LIQUID].iter().any(|kind| name.starts_with(kind));
        let is_ours = place.file_name().is_some_and(|name| is_of(&name.to_string_lossy()));
        for path in fs::read_dir(&place).into_iter().flatten().flatten().map(|entry| entry.path()) {
            if is_ours && path.is_file() && !needed.contains(&path) {
                removed(&path, fs::remove_file(&path))?;
            }
        }
        if is_ours {
            remove_if_empty(&place)?;
        }
    }
    remove_if_empty(folder)
}

fn remove_if_empty(folder: &Path) -> Result<(), CommandError> {
    if folder.is_dir() && !is_filled(folder) { removed(folder, fs::remove_dir(folder)) } else { Ok(()) }
}

fn removed(path: &Path, outcome: std::io::Result<()>) -> Result<(), CommandError> {
    match outcome {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(CommandError::input(
            format!("`{}` cannot be removed: {error}", path.display()),
            "choose another folder with --out",
        )),
        _ => Ok(()),
    }
}

fn is_filled(folder: &Path) -> bool {
    fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some())
}

fn next_free(parent: &Path, case_name: &str) -> PathBuf {
    (1..)
        .map(|n: u32| parent.join(format!("{case_name}-{n}")))
        .find(|folder| !is_filled(folder) && !folder.is_file())
        .unwrap_or_else(|| parent.join(case_name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filled_folders_are_refused_unless_forced() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("filled");
        assert_eq!(prepare(Some(&folder), "case", false).unwrap(), folder);
        assert!(prepare(Some(&folder), "case", false).is_ok());
        fs::write(folder.join("notes.txt"), "x").unwrap();
        assert_eq!(prepare(Some(&folder), "case", false).unwrap_err().exit_code(), 2);
        assert!(prepare(Some(&folder), "case", true).is_ok());
        // Pictures of a paper are nobody's results; those beside the copy of a case, or a log, are a run's.
        fs::create_dir(folder.join("figures")).unwrap();
        assert!(
            prepare(Some(&folder), "case", true).unwrap_err().to_string().contains("figures` would be overwritten")
        );
        for (name, text) in [(SUMMARY, "{ }"), (LOG, "2026-11-30T03:38:51Z  sazanami 0.2.0")] {
            fs::write(folder.join(name), text).unwrap();
            assert!(prepare(Some(&folder), "case", true).is_ok());
            fs::remove_file(folder.join(name)).unwrap();
        }
        fs::remove_dir(folder.join("figures")).unwrap();
        fs::write(folder.join(CASE), "# The case as run: saved from a report").unwrap();
        assert_eq!(prepare(Some(&folder), "case", true).unwrap_err().exit_code(), 2);
    }

    #[test]
    fn only_files_of_the_run_are_listed() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path();
        for file in
            ["figures/a.png", "figures/.b.png", "inputs/grains-0/bed/a.bed", "series.csv", "notes.txt", "other/x"]
        {
            fs::create_dir_all(folder.join(file).parent().unwrap()).unwrap();
            fs::write(folder.join(file), "x").unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink("..", folder.join("figures/up")).unwrap();
        assert_eq!(written(folder), ["figures/a.png", "inputs/grains-0/bed/a.bed", "series.csv"]);
    }

    #[test]
    fn copies_for_earlier_runs_go_and_those_needed_stay() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("inputs");
        let [needed, old] = ["grains-0/bed/new.bed", "grains-1/shape/old.msh"].map(|name| folder.join(name));
        for file in [&needed, &old, &folder.join("grains-0/bed/old.bed")] {
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, "x").unwrap();
        }
        clear_inputs(&folder, std::slice::from_ref(&needed)).unwrap();
        assert!(needed.is_file() && !folder.join("grains-1").exists());
        assert_eq!(fs::read_dir(folder.join("grains-0/bed")).unwrap().count(), 1);
        // What no run put there is somebody's own.
        let own = [folder.join("other.msh"), folder.join("mine/sand.msh")];
        fs::create_dir_all(folder.join("mine")).unwrap();
        own.iter().for_each(|file| fs::write(file, "x").unwrap());
        clear_inputs(&folder, &[]).unwrap();
        assert!(own.iter().all(|file| file.is_file()) && !needed.exists());
        own.iter().for_each(|file| fs::remove_file(file).unwrap());
        fs::remove_dir(folder.join("mine")).unwrap();
        clear_inputs(&folder, &[]).unwrap();
        assert!(!folder.exists());
        assert!(clear_inputs(&folder, &[]).is_ok());
    }

    #[test]
    fn files_and_unwritable_places_are_refused() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("file");
        fs::write(&folder, "x").unwrap();
        assert!(prepare(Some(&folder), "case", true).unwrap_err().to_string().contains("is a file"));
        assert!(prepare(Some(&folder.join("inside")), "case", false).is_err());
    }

    #[test]
    fn unnamed_results_get_the_next_free_number() {
        let parent = tempfile::tempdir().unwrap();
        fs::create_dir_all(parent.path().join("case-1")).unwrap();
        fs::write(parent.path().join("case-1/a"), "x").unwrap();
        assert_eq!(next_free(parent.path(), "case"), parent.path().join("case-2"));
    }
}
