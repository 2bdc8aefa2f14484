//! Ends of a run by failure, in the open: exit code, message, summary, and the checkpoint that is left.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use sazanami::artist::{Artist, Figure, NotDrawn};
use sazanami::error::{CommandError, Failure, exit};
use sazanami::run::{self, RunOptions, RunSummary, Status};
use sazanami::stop::{Stop, StopCause};

use crate::support::{
    Left, Listener, On, Scratch, checkpoints, go_on, heard, interrupted, load, newest, ran, start, summary,
};

/// Two grains in a box, one of them thrown at the other; `[[grains]]` and contact can be changed.
const THROWN: &str = include_str!("../cases/failures-thrown.toml");

/// Runs something that must not take long; a group of ranks that wait for each other would for ever.
fn in_time<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || sender.send(work()));
    receiver.recv_timeout(Duration::from_secs(100)).expect("the ranks still wait for each other")
}

fn run_in(folder: &Path, text: &'static str, overrides: &[&str], ranks: usize) -> CommandError {
    let loaded = load(text, overrides);
    let folder = folder.to_owned();
    in_time(move || start(&loaded, &folder, On::ranks(ranks, 1))).expect_err("the run fails")
}

fn failure(error: &CommandError) -> &Failure {
    match error {
        CommandError::Failed(failure) => failure,
        other => panic!("not a failure of the run: {other}"),
    }
}

/// Goes on with the run in `folder`.
fn goes_on_in_time(folder: &Path, on: On) -> Result<RunSummary, CommandError> {
    let folder = folder.to_owned();
    in_time(move || go_on(&folder, on)).0
}

/// Runs a case that fails on one rank and on several, and looks at what is common to all failures.
fn fails(name: &str, text: &'static str, overrides: &[&str], kind: &str, words: &[&str]) {
    let scratch = Scratch::new(&format!("failures-{name}"));
    for ranks in [1, 4] {
        let folder = scratch.join(&format!("on-{ranks}"));
        let error = run_in(&folder, text, overrides, ranks);
        assert_eq!(error.exit_code(), exit::FAILED);
        let failure = failure(&error);
        println!("{error}\n");
        assert_eq!(failure.kind, kind, "{error}");
        let told = error.to_string();
        // Before the first step no limit rules.
        let ruled: &[&str] = if failure.step > 0 { &["step length ruled by "] } else { &[] };
        for word in words.iter().chain(&["at step ", "time "]).chain(ruled) {
            assert!(told.contains(word), "{ranks} ranks: `{word}` is not in:\n{told}");
        }
        let left = summary(&folder);
        assert_eq!(left["status"], "failed", "{ranks} ranks");
        assert_eq!(left["failure"]["kind"], kind);
        assert_eq!(left["failure"]["message"], failure.message.as_str());
        assert_eq!(left["failure"]["step"], failure.step);
        assert_eq!(left["failure"]["limiter"], failure.limiter);
        assert_eq!(failure.limiter.is_empty(), failure.step == 0);
        if checkpoints(&folder).steps().expect("the case is sound").is_empty() {
            assert!(told.contains("no checkpoint had been written"), "{told}");
            continue;
        }
        // The checkpoint it names is good: the run can be looked at, or gone on with, from there.
        let checkpoint = failure.checkpoint.clone().expect("there is a checkpoint");
        assert_eq!(checkpoint, newest(&folder).path());
        assert!(told.contains(&format!("last good checkpoint: {}", checkpoint.display())));
        let again = goes_on_in_time(&folder, On::ranks(ranks, 2)).expect_err("it fails once more");
        assert_eq!(essence(&again), essence(&error), "on {ranks} ranks");
    }
}

/// Common part of a failure and its repetition.
fn essence(error: &CommandError) -> (&str, &str, u64, f64) {
    let failure = failure(error);
    (failure.kind.as_str(), &failure.message, failure.step, failure.time)
}

#[test]
fn grains_that_pass_through_each_other() {
    let soft = ["contact.default.normal_stiffness=20 N/m"];
    let words = ["grain 0 of `still` and grain 1 of `thrown` overlap by ", "% of a contact sphere's radius at (2.0"];
    fails("overlap", THROWN, &soft, "overlap", &words);
}

#[test]
fn a_grain_that_passes_through_the_floor() {
    let soft = [
        "contact.default.normal_stiffness=20 N/m",
        "grains.1.placement.list=[{ position = [\"0.7 mm\", \"3 mm\", \"2.6 mm\"], velocity = [\"0 m/s\", \"0 m/s\", \"-4 m/s\"] }]",
    ];
    let softened = ["dem.soften={ from = \"0 s\", stiffness = 0.9, largest_overlap = 0.01 }"];
    fails("softened", THROWN, &softened, "overlap", &[" overlap by ", "`dem.soften` allows 1.0 %"]);
    // Negative control: as soft, where more is allowed.
    let folder = Scratch::new("softened-control");
    let allowed = ["dem.soften={ from = \"0 s\", stiffness = 0.9, largest_overlap = 0.5 }"];
    ran(THROWN, &allowed, &folder.join("run"), On::ranks(1, 1));
    // Nor is an overlap before springs are softened due to that.
    let later = [&soft[..], &["dem.soften={ from = \"1.9 ms\", stiffness = 0.9 }"]].concat();
    let before = run_in(&folder.join("before"), THROWN, &later, 1).to_string();
    assert!(before.contains(" overlap by ") && !before.contains("dem.soften"), "{before}");
    fails("floor", THROWN, &soft, "overlap", &["grain 0 of `thrown` and the side x3_lower overlap by "]);
}

#[test]
fn a_grain_that_escapes() {
    let open = [
        "dem.grain_walls=[\"x1_lower\", \"x2_lower\", \"x2_upper\", \"x3_lower\"]",
        "grains.1.placement.list=[{ position = [\"2.6 mm\", \"3 mm\", \"2.6 mm\"], velocity = [\"5 m/s\", \"0 m/s\", \"0 m/s\"] }]",
    ];
    let words = ["grain 0 of `thrown` escaped from the box: its centre of mass is at (4.5"];
    fails("escape", THROWN, &open, "grain_escaped", &words);
}

const SPLASHING: &str = include_str!("../cases/failures-splashing.toml");

#[test]
fn a_pressure_that_does_not_converge() {
    // A box that begins to swing: while the steps are short there is little to do; they grow until the iterations do not suffice.
    let few = [
        "gravity=0 m/s^2",
        "frame.motion={ amplitude = [\"5 mm\", \"0 mm\", \"0 mm\"], frequency = \"50 Hz\", ramp = \"1 ms\" }",
        "liquid.0.fall.speed=0 m/s",
        "fluid.dt_first=1 ns",
        "fluid.tol_div=1e-11",
        "fluid.pressure_iterations=2",
        "checkpoint.every=1 us",
    ];
    let words =
        ["the pressure did not converge: |div u| dt = ", "after 2 iterations", "it is largest in cell (", ") m"];
    fails("pressure", SPLASHING, &few, "pressure", &words);
    // A tolerance below rounding is a stall, whatever the number of iterations.
    let words = ["the pressure did not converge: |div u| dt = ", "it is largest in cell ("];
    let under_pressure = ["fluid.tol_div=1e-15", "boundary.x3_upper={ fixed_pressure = { pressure = \"1e5 Pa\" } }"];
    fails("stall", SPLASHING, &under_pressure, "pressure", &words);
    // Where more is wanted than rounding lets, of a drop at rest, and all that is asked for comes out, the run goes on.
    let scratch = Scratch::new("failures-rounding");
    for (name, more) in [("default", ""), ("weightless", "gravity=0 m/s^2"), ("long", "fluid.dt_max=1 s")] {
        let still = ["liquid.0.fall.speed=0 m/s", "run.until=1 ms", under_pressure[1], more];
        let still = if more.is_empty() { &still[..3] } else { &still[..] };
        ran(SPLASHING, still, &scratch.join(name), On::threads(2));
    }
}

#[test]
fn a_run_into_nan() {
    // A pressure that drives the fluid to a speed whose square is NaN.
    let push = ["boundary.x1_lower={ fixed_pressure = { pressure = \"1e250 Pa\" } }", "boundary.x1_upper=outflow"];
    let scratch = Scratch::new("failures-numbers");
    for ranks in [1, 2] {
        let folder = scratch.join(&format!("on-{ranks}"));
        let error = run_in(&folder, SPLASHING, &push, ranks);
        println!("{error}\n");
        assert_eq!((error.exit_code(), failure(&error).kind.as_str()), (exit::FAILED, "not_finite"));
        assert!(error.to_string().contains("cell ("), "{error}");
        let mut summary = summary(&folder);
        assert_eq!(summary["status"], "failed");
        // Outside the message no NaN was written before.
        assert!(summary["failure"].take()["message"].to_string().contains("NaN"));
        let text = std::fs::read_to_string(folder.join("series.csv")).unwrap() + &summary.to_string();
        assert!(!text.contains("NaN") && !text.contains("inf,"), "{text}");
    }
}

#[test]
fn deep_contacts_are_counted_and_warned_of() {
    let scratch = Scratch::new("failures-deep");
    let run = |stiffness: &str, ranks: usize| {
        let folder = scratch.join(&format!("{}-{ranks}", stiffness.replace(' ', "-").replace('/', "")));
        let loaded = load(THROWN, &[&format!("contact.default.normal_stiffness={stiffness}"), "run.until=1 ms"]);
        let said = heard(&loaded, &On::ranks(ranks, 1).options(Some(&folder))).messages;
        (Left::in_folder(&folder), said)
    };
    for ranks in [1, 3] {
        let (left, said) = run("200 N/m", ranks);
        let worst = left.summary["worst"]["overlap_relative"].as_f64().unwrap();
        assert!((0.2..0.8).contains(&worst), "{worst}");
        let counted = left.summary["corrections"]["deep_contacts"].as_u64().unwrap();
        assert_eq!(counted, 1, "one contact became deep, once");
        assert_eq!(left.column("deep_contacts").last(), Some(&1.0));
        let warnings: Vec<_> = said.iter().filter(|text| text.starts_with("warning: 1 contacts")).collect();
        assert_eq!(warnings.len(), 1, "{said:#?}");
        assert!(warnings[0].contains("between grain 0 of `still` and grain 1 of `thrown`"), "{}", warnings[0]);
    }
    // Negative control: stiff grains.
    let (left, said) = run("1e4 N/m", 1);
    assert_eq!(left.summary["corrections"]["deep_contacts"], 0);
    assert!(left.column("contacts").iter().any(|&n| n > 0.0));
    assert!(said.iter().all(|text| !text.starts_with("warning")), "{said:#?}");
}

#[test]
fn a_given_number_of_substeps_rules_the_step() {
    let scratch = Scratch::new("failures-substeps");
    let run = |substeps: &str| {
        let keys = [&format!("dem.substeps={substeps}"), "run.until=0.1 ms"];
        let left = ran(THROWN, &keys, &scratch.join(substeps), On::threads(1));
        (left.summary["limiter"].clone(), left.column("dt").into_iter().fold(0.0, f64::max))
    };
    let (limiter, longest) = run("1");
    assert!(limiter["contact"].as_u64().unwrap() > 10, "{limiter}");
    // Negative control: as many as the step needs.
    let (limiter, longer) = run("auto");
    assert!(limiter.get("contact").is_none() && longer > 5.0 * longest, "{limiter}");
}

#[test]
fn without_an_artist_a_run_says_that_there_are_no_pictures() {
    let scratch = Scratch::new("failures-artist");
    let loaded = load(THROWN, &["output.figures={ steps = 1 }"]);
    let said = |name: &str, options: RunOptions| {
        let folder = scratch.join(name);
        let said = heard(&loaded, &RunOptions { out: Some(folder.clone()), ..options }).messages;
        let pictures = std::fs::read_dir(folder.join("figures")).unwrap().count();
        (said.iter().filter(|text| text.contains("no pictures")).count(), pictures)
    };
    let with = On::threads(1).steps(2).options(None);
    assert_eq!(said("without", RunOptions { artist: None, ..with.clone() }), (1, 0));
    let (messages, pictures) = said("with", with);
    assert!(messages == 0 && pictures > 3, "{messages} {pictures}");
}

/// Takes its time, and counts the checkpoints that are there before a picture is.
#[derive(Debug)]
struct Slow;

static DRAWN: AtomicUsize = AtomicUsize::new(0);
static BEFORE_DRAWN: AtomicUsize = AtomicUsize::new(0);

impl Artist for Slow {
    fn draw(&self, _: &Figure, path: &Path) -> Result<(), NotDrawn> {
        std::thread::sleep(Duration::from_millis(50));
        let run = path.parent().and_then(Path::parent).expect("pictures have a folder in that of the run");
        BEFORE_DRAWN.fetch_max(std::fs::read_dir(run.join("checkpoints"))?.count(), Ordering::SeqCst);
        DRAWN.fetch_add(1, Ordering::SeqCst);
        Ok(std::fs::write(path, "a picture")?)
    }
}

#[test]
fn pictures_are_drawn_before_the_checkpoint_after_them() {
    let folder = Scratch::new("failures-drawn").join("run");
    let loaded = load(THROWN, &["output.figures={ steps = 1 }"]);
    let options = On::threads(1).steps(2).options(Some(&folder));
    heard(&loaded, &RunOptions { artist: Some(&Slow), ..options });
    assert!(DRAWN.load(Ordering::SeqCst) > 3, "they were drawn");
    assert_eq!(BEFORE_DRAWN.load(Ordering::SeqCst), 0, "a checkpoint was there before the pictures up to it");
    // Negative control: the run did write one.
    assert_eq!(std::fs::read_dir(folder.join("checkpoints")).unwrap().count(), 1);
}

#[test]
fn a_place_that_cannot_be_written_to() {
    // A file stands where the folder of checkpoints should be, before the run and in the middle of it.
    let scratch = Scratch::new("failures-folder");
    for ranks in [1, 3] {
        let folder = scratch.join(&format!("on-{ranks}"));
        ran(THROWN, &[], &folder, On::ranks(ranks, 1).steps(3));
        let aside = scratch.join(&format!("aside-{ranks}"));
        std::fs::rename(folder.join("figures"), &aside).unwrap();
        std::fs::write(folder.join("figures"), "in the way").unwrap();
        let error = goes_on_in_time(&folder, On::ranks(ranks, 1)).expect_err("it cannot write");
        assert_eq!((error.exit_code(), failure(&error).kind.as_str()), (exit::FAILED, "disk"), "{error}");
        assert!(error.to_string().contains("figures"), "{error}");
        std::fs::remove_file(folder.join("figures")).unwrap();

        // In the middle: the checkpoint of this step is already a folder, and cannot be replaced.
        let next: PathBuf = checkpoints(&folder).path_of(6);
        std::fs::create_dir_all(next.join("in the way")).unwrap();
        let error = goes_on_in_time(&folder, On::ranks(ranks, 1).steps(3)).expect_err("it cannot write");
        println!("{error}\n");
        assert_eq!((error.exit_code(), failure(&error).kind.as_str()), (exit::FAILED, "disk"), "{error}");
        let told = error.to_string();
        assert!(told.contains(&format!("cannot write {}", next.display())) && told.contains("at step 6"), "{told}");
        let good = newest(&folder);
        assert!(told.contains(&format!("last good checkpoint: {}", good.path().display())), "{told}");
        assert_eq!(summary(&folder)["status"], "failed");
        std::fs::remove_dir_all(&next).unwrap();
        let (outcome, _) = go_on(&folder, On::ranks(ranks, 1).steps(3));
        assert_eq!(outcome.unwrap().status, Status::Stopped);
    }
}

/// Files in a folder, with their contents.
fn all_files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<_> = entries
        .flat_map(|path| match path.is_dir() {
            true => all_files(&path),
            false => vec![(path.clone(), std::fs::read(&path).expect("it can be read"))],
        })
        .collect();
    found.sort();
    found
}

#[test]
fn a_group_that_cannot_be_formed_is_refused_before_anything_is_removed() {
    let scratch = Scratch::new("failures-group");
    let loaded = load(THROWN, &[]);
    let folder = scratch.join("results");
    start(&loaded, &folder, On::threads(1).steps(1)).unwrap();
    let before = all_files(&folder);
    let stop = Stop::new();
    // Eight cells each way: no more than four parts of two cells in x1 and x2.
    let refusals = [(On::ranks(64, 1), "among 64 ranks", "16 at most"), (On::threads(60_000), "60000", "processor")];
    for (on, what, help) in refusals {
        for force in [true, false] {
            let out = if force { folder.clone() } else { scratch.join("new") };
            let options = RunOptions { force, ..on.options(Some(&out)) };
            let error = run::run(&loaded, &options, &mut Listener::default(), &stop).unwrap_err();
            assert_eq!(error.exit_code(), exit::WRONG_INPUT, "{error}");
            assert!(error.to_string().contains(what) && error.to_string().contains(help), "{error}");
        }
        assert_eq!(go_on(&folder, on).0.unwrap_err().exit_code(), exit::WRONG_INPUT);
        assert!(all_files(&folder) == before && !scratch.join("new").exists(), "{what}");
    }
    // Negative control: a group that can be formed overwrites.
    let options = RunOptions { force: true, ..On::ranks(4, 1).steps(1).options(Some(&folder)) };
    run::run(&loaded, &options, &mut Listener::default(), &stop).unwrap();
    assert!(all_files(&folder) != before);
}

/// A small disk of its own, where the system allows it.
struct Disk(PathBuf);

impl Disk {
    fn of(kilobytes: usize, place: PathBuf) -> Option<Self> {
        std::fs::create_dir_all(&place).expect("the case is sound");
        let size = format!("size={kilobytes}k");
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(&place).output();
        mounted.is_ok_and(|output| output.status.success()).then_some(Self(place))
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).output();
    }
}

#[test]
#[ignore = "mounts a small disk, which only root may"]
fn a_full_disk() {
    let scratch = Scratch::new("failures-disk");
    let disk = Disk::of(5000, scratch.join("disk")).expect("a disk can be mounted");
    for ranks in [1, 2] {
        let folder = disk.0.join(format!("on-{ranks}"));
        let overrides =
            ["output.fields.steps=1", "output.precision=double", "domain.cells=[20, 20, 20]", "checkpoint.keep=1"];
        let error = run_in(&folder, SPLASHING, &overrides, ranks);
        println!("{error}\n");
        assert_eq!((error.exit_code(), failure(&error).kind.as_str()), (exit::FAILED, "disk"), "{error}");
        let told = error.to_string();
        for word in ["No space left on device", "at step ", "last good checkpoint: ", "step length ruled by "] {
            assert!(told.contains(word), "`{word}` is not in:\n{told}");
        }
        // What is there is whole: with room again the run goes on, from the checkpoint, to what it would have been.
        for part in ["fields", "figures"] {
            std::fs::remove_dir_all(folder.join(part)).unwrap();
        }
        goes_on_in_time(&folder, On::ranks(ranks, 1).steps(2)).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

#[test]
fn a_stop_from_outside() {
    let scratch = Scratch::new("failures-stop");
    let loaded = load(THROWN, &["contact.default.normal_stiffness=200 N/m"]);
    for ranks in [1, 3] {
        let folder = scratch.join(&format!("on-{ranks}"));
        let options = On::ranks(ranks, 1).options(Some(&folder));
        let ended = interrupted(&loaded, &options, |line| line.phase == "flow" && line.step >= 4);
        let left = summary(&folder);
        assert_eq!((&left["status"], &left["failure"]), (&"stopped".into(), &serde_json::Value::Null));
        // The checkpoint is that of the last step.
        assert_eq!(checkpoints(&folder).steps().unwrap().last(), Some(&ended.steps));
        assert_eq!(left["steps"], ended.steps);
        let (outcome, _) = go_on(&folder, On::ranks(ranks, 2));
        assert_eq!(outcome.unwrap().status, Status::Finished);
    }
    // A flag that is set before anything happens: a checkpoint of the beginning.
    let folder = scratch.join("at-once");
    let stop = Stop::new();
    stop.set(StopCause::Caller);
    let ended = run::run(&loaded, &On::threads(1).options(Some(&folder)), &mut Listener::default(), &stop).unwrap();
    assert_eq!((ended.steps, ended.interrupted), (0, true));
    assert_eq!(checkpoints(&folder).steps().unwrap(), [0]);
}

#[test]
fn a_bed_that_fails_while_it_is_packed() {
    const SOFT: &str = r#"
gravity = "9.8 m/s^2"
[domain]
size = ["3.2 mm", "3.2 mm", "3 mm"]
cells = [8, 8, 8]
[material.sand]
density = "2650 kg/m^3"
[contact.default]
normal_stiffness = "0.02 N/m"
restitution = 0.3
[[grains]]
name = "sand"
count = 12
shape.spheroid = { diameter = "0.52 mm", length = "1.27 mm" }
contact_spheres = "axis(9)"
material = "sand"
placement.packed = { lattice = "low" }
[output]
figures = { at = [] }
[run]
until = "1 ms"
"#;
    fails("packing", SOFT, &[], "overlap", &[" of `sand` and ", "ruled by contact", "no checkpoint had been written"]);
}
