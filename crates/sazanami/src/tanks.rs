//! Tanks of water and grains that were prepared: kept in a file, and found again by what they were made of.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use sazanami_io::checkpoint::{CheckpointReader, CheckpointWriter};
use sazanami_numerics::snapshot::Snapshot;
use sazanami_parallel::Sums;
use serde::{Deserialize, Serialize};

use crate::case::meaning::{
    Bed, Case, Checkpoints, GrainArrays, GrainForm, LiquidRegion, OutputFrame, Outputs, Placement, RunLength, Schedule,
};
use crate::case::resolved::{self, Paths};
use crate::case::{CaseError, Diagnostics, LoadedCase};
use crate::job::{Job, RecordError, RunOptions, Workers};
use crate::results::PREPARED;

/// Section of a state's file with its [`Recipe`].
const RECIPE: &str = "tank/recipe";
/// Environment variable that names the folder in which states are kept.
pub const CACHE: &str = "SAZANAMI_CACHE";

/// The case and the program that a state was made with.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Recipe {
    /// Version of the program.
    version: String,
    /// Commit that it was built from.
    commit: String,
    /// The part of the resolved case that a tank at rest depends on.
    tank: String,
    /// Hashes of what the files hold that this part names; absent in states of earlier versions.
    #[serde(default)]
    files: Option<Vec<String>>,
}

/// Who prepares a tank: other ranks, or another order of their sums, give other last bits.
#[derive(Clone, Copy, Debug)]
pub struct Maker<'a> {
    /// Commit that the program was built from.
    pub commit: Option<&'a str>,
    /// Ranks of the run.
    pub ranks: usize,
    /// Order of sums over them.
    pub sums: &'a str,
    /// Hashes of what the files hold that populations and liquids name, when they were read.
    pub files: &'a [String],
}

impl Default for Maker<'_> {
    /// A program of unknown commit on one rank.
    fn default() -> Self {
        Self { commit: None, ranks: 1, sums: Sums::default().word(), files: &[] }
    }
}

impl<'a> Maker<'a> {
    /// The ranks of a run.
    pub(crate) fn of(workers: &'a Workers, options: &RunOptions, files: &'a [String]) -> Self {
        Self { commit: options.commit, ranks: workers.ranks, sums: &workers.sums, files }
    }

    fn commit(&self) -> &str {
        self.commit.unwrap_or("unknown")
    }

    /// File in which the state of this tank is kept.
    fn kept_at(&self, case: &Case) -> Option<PathBuf> {
        let folder = cache_folder()?;
        let ranks = if self.ranks > 1 { format!("{} ranks, {}", self.ranks, self.sums) } else { String::new() };
        let (version, tank, files) = (env!("CARGO_PKG_VERSION"), tank_of(case), self.files.join(" "));
        let key = format!("{version} {} {ranks}\n{tank}\n{files}", self.commit());
        Some(folder.join(format!("tank-{:016x}.state", xxhash_rust::xxh3::xxh3_64(key.as_bytes()))))
    }
}

/// The part of a case that a tank at rest depends on, as text: all but how it is moved, observed and written. It is
/// itself a case.
fn tank_of(case: &Case) -> String {
    let nothing = Schedule::default;
    let (lower, upper) = (case.domain.lower, case.domain.upper);
    let middle = 0.5 * (lower + upper);
    // Liquids above the bed are put by its height.
    let by_bed = |liquid: &LiquidRegion| matches!(liquid.placement, Placement::AboveBed { .. });
    let (height_radius, axis) = if case.liquids.iter().any(by_bed) {
        (case.bed.height_radius, case.bed.axis)
    } else {
        ((upper - lower).max_element(), [middle.x, middle.y])
    };
    let mut tank = Case {
        name: "tank".to_owned(),
        title: String::new(),
        bed: Bed { porosity_lower: lower.z, porosity_upper: None, height_radius, axis, ..case.bed },
        erosion: None,
        heap: None,
        ripples: None,
        probes: Vec::new(),
        output: Outputs {
            fields: nothing(),
            grains: nothing(),
            figures: nothing(),
            series: nothing(),
            bed: None,
            frame: OutputFrame::Tank,
            grain_form: GrainForm::default(),
            grain_arrays: GrainArrays::default(),
            ..case.output.clone()
        },
        checkpoint: Checkpoints { every_wall: None, every: None, keep: 1 },
        run: RunLength::until(0.0),
        ..case.clone()
    };
    tank.drive = None;
    tank.gates.iter_mut().for_each(|gate| (gate.opens, gate.speed) = (0.0, None));
    if let Some(frame) = &mut tank.frame {
        frame.oscillation = None;
        frame.motion = None;
    }
    if tank.frame.as_ref().is_some_and(|frame| frame.acceleration == sazanami_numerics::Vector::ZERO) {
        tank.frame = None;
    }
    tank.preparation.state = None;
    tank.preparation.cache = true;
    resolved::write(&tank, Paths::NameOnly)
}

/// Folder in which states are kept, if the system has a place for such.
pub(crate) fn cache_folder() -> Option<PathBuf> {
    std::env::var_os(CACHE).map(PathBuf::from).or_else(|| {
        let cache = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from);
        let cache = cache.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")));
        Some(cache?.join("sazanami"))
    })
}

/// The state that `path` holds, with what it was made of.
fn read(path: &Path) -> Result<(Recipe, Snapshot), String> {
    let reader = CheckpointReader::open(path).map_err(|error| error.to_string())?;
    let recipe = reader.get_json(RECIPE).map_err(|error| error.to_string())?;
    let snapshot = reader.snapshot_of(|name| name != RECIPE).map_err(|error| error.to_string())?;
    Ok((recipe, snapshot))
}

/// A tank prepared before.
#[derive(Clone, Debug, Default)]
pub struct MadeReady {
    /// The tank, if there is one that fits the case.
    pub tank: Option<Snapshot>,
    /// Origin, or why it cannot be used.
    pub messages: Vec<String>,
}

/// Looks for a tank prepared before that fits the case, as `maker` would make it.
///
/// # Errors
/// If the case names a state that does not fit it.
pub fn made_ready(loaded: &LoadedCase, maker: Maker<'_>) -> Result<MadeReady, Box<CaseError>> {
    let (mut report, mut messages) = (Diagnostics::default(), Vec::new());
    let tank = find(loaded, maker, &mut report, |text| messages.push(text));
    if report.has_errors() {
        return Err(loaded.refused(report));
    }
    Ok(MadeReady { tank, messages })
}

/// The tank of this case prepared before: the one that the case names, or one that was kept; `None` if the run has to
/// make it ready. `say` gets where it comes from.
///
/// A state that the case names and that does not fit it is an error in `report`.
fn find(
    loaded: &LoadedCase,
    maker: Maker<'_>,
    report: &mut Diagnostics,
    mut say: impl FnMut(String),
) -> Option<Snapshot> {
    let case = &loaded.case;
    let preparation = &case.preparation;
    if let Some(path) = &preparation.state {
        let span = loaded.places.at("preparation");
        if case.run.packing_only {
            report
                .error(loaded.places.at("run.packing_only"), "there is nothing to pack")
                .label("the tank of `preparation.state` is taken as it is")
                .help("leave out `run.packing_only` or `preparation.state`");
            return None;
        }
        if case.output.bed.is_some() && case.packs() {
            report
                .error(loaded.places.at("output.bed"), "there is no bed to write")
                .label("the tank of `preparation.state` is taken as it is, and nothing is packed")
                .help("leave out `output.bed` or `preparation.state`");
            return None;
        }
        let (recipe, snapshot) = match read(path) {
            Ok(found) => found,
            Err(problem) => {
                report
                    .error(span, format!("`{}` is no state of a tank", path.display()))
                    .label(problem)
                    .help("leave out `state`: the tank is prepared before the run");
                return None;
            }
        };
        let tank = tank_of(case);
        if !is_same(&recipe.tank, &tank, loaded) {
            let [theirs, ours] = first_difference(&recipe.tank, &tank);
            let made = format!("it was made with {theirs} (version {}, commit {})", recipe.version, recipe.commit);
            report
                .error(span, format!("`{}` is the state of another tank", path.display()))
                .label(format!("{made}, this case has {ours}"))
                .help("make the two alike, or leave out `state`");
            return None;
        }
        if recipe.files.is_some_and(|files| files != maker.files) {
            report
                .error(span, format!("`{}` is the state of another tank", path.display()))
                .label("the files of beds or shapes that it was made with held something else")
                .help("leave out `state`: the tank is prepared before the run");
            return None;
        }
        say(format!("tank prepared before, from {}", path.display()));
        return Some(snapshot);
    }
    if !preparation.cache || !preparation.is_needed() || case.run.packing_only {
        return None;
    }
    let path = maker.kept_at(case).filter(|path| path.is_file())?;
    if case.output.bed.is_some() && case.packs() {
        say("the tank is prepared anew: `output.bed` asks for the bed as it is packed, which a kept tank has not"
            .to_owned());
        return None;
    }
    match read(&path) {
        Ok((recipe, snapshot)) if recipe.tank == tank_of(case) && recipe.files.as_deref() == Some(maker.files) => {
            say(format!("tank prepared by an earlier run, from {}", path.display()));
            Some(snapshot)
        }
        Ok(_) => None,
        Err(problem) => {
            say(format!("warning: {} cannot be used: {problem}; the tank is prepared anew", path.display()));
            None
        }
    }
}

/// Whether the part of a case that made a tank, as text, means `tank`, that of the case of `loaded`: keys that the maker
/// did not know yet have their defaults.
fn is_same(made_of: &str, tank: &str, loaded: &LoadedCase) -> bool {
    made_of == tank || crate::case::parse(&loaded.path, made_of, &[]).is_ok_and(|made| tank_of(&made.case) == tank)
}

/// The first key in which two resolved copies differ, and what each has there, in words.
fn first_difference(theirs: &str, ours: &str) -> [String; 2] {
    let keys = |text: &str| {
        let mut keys = BTreeMap::new();
        if let Ok(table) = text.parse::<toml::Table>() {
            flatten(String::new(), &toml::Value::Table(table), &mut keys);
        }
        keys
    };
    let (theirs, ours) = (keys(theirs), keys(ours));
    // What both know comes first: a key of one alone may be one that the other program does not have.
    let both = theirs.keys().find(|key| ours.get(*key).is_some_and(|value| *value != theirs[*key]));
    let one = || theirs.keys().chain(ours.keys()).find(|key| theirs.get(*key) != ours.get(*key));
    let Some(key) = both.or_else(one) else { return [String::new(), String::new()] };
    [&theirs, &ours].map(|keys| match keys.get(key) {
        Some(value) => format!("`{key} = {value}`"),
        None => format!("no `{key}`"),
    })
}

/// Lists the values of a table by their full keys.
fn flatten(key: String, value: &toml::Value, into: &mut BTreeMap<String, String>) {
    let under = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match value {
        toml::Value::Table(table) => table.iter().for_each(|(name, value)| flatten(under(name), value, into)),
        toml::Value::Array(list) if list.iter().any(toml::Value::is_table) => {
            list.iter().enumerate().for_each(|(n, value)| flatten(under(&n.to_string()), value, into));
        }
        value => {
            into.insert(key, value.to_string());
        }
    }
}

/// Keeps a tank that was prepared: in the folder of results, and for later runs.
pub(crate) fn keep(job: &Job, snapshot: &Snapshot) -> Result<(), RecordError> {
    let maker = Maker::of(&job.workers, job.options, &job.files);
    let recipe = Recipe {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commit: maker.commit().to_owned(),
        tank: tank_of(job.case),
        files: Some(job.files.clone()),
    };
    let mut writer = CheckpointWriter::new();
    writer.add_snapshot(snapshot)?;
    writer.add_json(RECIPE, &recipe)?;
    writer.write_atomic(&job.folder.join(PREPARED))?;
    let wanted = job.case.preparation.cache;
    let Some(path) = maker.kept_at(job.case).filter(|_| wanted) else { return Ok(()) };
    let folder = path.parent().unwrap_or(Path::new(""));
    let kept = std::fs::create_dir_all(folder).map_err(|error| error.to_string());
    let kept = kept.and_then(|()| writer.write_atomic(&path).map_err(|error| error.to_string()));
    match kept {
        Ok(_) => job.say(format!("tank prepared, kept for later runs in {}", path.display())),
        Err(problem) => job.say(format!("warning: the tank is not kept for later runs: {problem}")),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tanks_of_other_beds_and_of_other_ranks_are_others() {
        const TANK: &str = "solver = \"mps\"\ngravity = \"9.81 m/s^2\"\ndomain.size = [\"20 mm\", \"16 mm\", \"24 mm\"]\n\
            particles.spacing = \"2 mm\"\nmaterial.s.density = \"2650 kg/m^3\"\ncontact.default = { normal_stiffness = \"200 N/m\", \
            restitution = 0.3, friction = 0.4 }\nrun.until = \"20 ms\"\n[[grains]]\nshape.sphere.diameter = \"2 mm\"\n\
            placement.bed.file = \"bed.csv\"\n[[liquid]]\nregion.half_space.point = [\"0 mm\", \"0 mm\", \"10 mm\"]\n";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tank.toml");
        std::fs::write(&path, TANK).unwrap();
        let of = |bed: &str, maker: Maker| {
            std::fs::write(folder.path().join("bed.csv"), bed).unwrap();
            let loaded = crate::case::load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
            let files = crate::results::contents(&loaded.case);
            Maker { files: &files, ..maker }.kept_at(&loaded.case)
        };
        let one = Maker::default();
        let kept = of("x1_m,x2_m,x3_m\n0.005,0.005,0.001\n", one);
        assert_eq!(kept, of("x1_m,x2_m,x3_m\n0.005,0.005,0.001\n", one));
        assert_ne!(kept, of("x1_m,x2_m,x3_m\n0.006,0.005,0.001\n", one));
        let two = Maker { ranks: 2, ..one };
        let on_two = of("x1_m,x2_m,x3_m\n0.005,0.005,0.001\n", two);
        assert!(kept != on_two && on_two != of("x1_m,x2_m,x3_m\n0.005,0.005,0.001\n", Maker { sums: "tree", ..two }));
    }

    #[test]
    fn tanks_whose_water_is_put_by_the_height_of_the_bed_depend_on_how_it_is_measured() {
        let folder = tempfile::tempdir().unwrap();
        let tank = |liquid: &str, bed: &str| {
            let text = format!(
                "solver = \"mps\"\ndomain.size = [\"20 mm\", \"16 mm\", \"24 mm\"]\nparticles.spacing = \"2 mm\"\n\
                 material.s.density = \"2650 kg/m^3\"\ncontact.default.restitution = 0.3\nrun.until = \"20 ms\"\n{bed}\n\
                 [[grains]]\nshape.sphere.diameter = \"2 mm\"\nplacement.packed = {{ level = \"6 mm\" }}\n[[liquid]]\n{liquid}\n"
            );
            let path = folder.path().join("tank.toml");
            std::fs::write(&path, text).unwrap();
            tank_of(&crate::case::load(&path, &[]).unwrap_or_else(|error| panic!("{error}")).case)
        };
        let above = "region.half_space.point = [\"0 mm\", \"0 mm\", \"0 mm\"]\nabove_bed = \"3 mm\"";
        let fixed = "region.half_space.point = [\"0 mm\", \"0 mm\", \"10 mm\"]";
        for bed in ["bed.height_radius = \"3 mm\"", "bed.axis = [\"3 mm\", \"4 mm\"]"] {
            assert_ne!(tank(above, bed), tank(above, ""), "{bed}");
            // Negative control: others do not.
            assert_eq!(tank(fixed, bed), tank(fixed, ""), "{bed}");
        }
    }

    #[test]
    fn the_first_different_key_is_found() {
        let text = "a = 1\n[particles]\nspacing = \"1 mm\"\n[[grains]]\nname = \"sand\"\n";
        let words = |a: &str, b: &str| [a.to_owned(), b.to_owned()];
        let other = text.replace("sand", "silt");
        assert_eq!(first_difference(text, &other), words("`grains.0.name = \"sand\"`", "`grains.0.name = \"silt\"`"));
        // A key that only one of them knows is named where nothing else differs.
        let older = text.replace("a = 1\n", "");
        assert_eq!(first_difference(&older, &other), words("`grains.0.name = \"sand\"`", "`grains.0.name = \"silt\"`"));
        assert_eq!(first_difference(&older, text), words("no `a`", "`a = 1`"));
        assert_eq!(first_difference(text, text), words("", ""));
    }
}
