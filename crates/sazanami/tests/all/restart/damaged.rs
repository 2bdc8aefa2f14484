//! Damage to a folder between two parts of a run: broken files, older programs, wrong commands.

use super::*;

/// Damages a file.
fn damage(path: &Path, how: &str) {
    let mut bytes = std::fs::read(path).expect("the case is sound");
    let length = bytes.len();
    match how {
        "cut to nothing" => bytes.clear(),
        "cut in the header" => bytes.truncate(20),
        "cut in the middle" => bytes.truncate(length / 2),
        "short of a byte" => bytes.truncate(length - 1),
        "a bit of the header" => bytes[17] ^= 1,
        "a bit of the data" => bytes[length / 3] ^= 0x10,
        "a bit of the index" => bytes[length - 40] ^= 4,
        "something else" => {
            bytes = b"not a checkpoint at all, but long enough to be looked at twice, or thrice".to_vec()
        }
        _ => panic!("unknown damage"),
    }
    std::fs::write(path, bytes).expect("the case is sound");
}

#[test]
fn a_damaged_checkpoint_is_passed_over_for_the_one_before() {
    let scratch = Scratch::new("restart-damage");
    let loaded = load(SLIDING, &["checkpoint.every=0.1 ms", "checkpoint.keep=2"]);
    let whole = scratch.join("whole");
    start(&loaded, &whole, On::threads(1).steps(2 * STEPS)).unwrap();
    let sound = scratch.join("sound");
    start(&loaded, &sound, On::threads(1).steps(STEPS)).unwrap();
    let steps = checkpoints(&sound).steps().unwrap();
    assert_eq!(steps.len(), 2);
    let copy = |name: &str| {
        let folder = scratch.join(name);
        copy_folder(&sound, &folder);
        folder
    };
    let all = [
        ("cut to nothing", "torn"),
        ("cut in the header", "torn"),
        ("cut in the middle", "torn"),
        ("short of a byte", "torn"),
        ("a bit of the header", "damaged header"),
        ("a bit of the data", "damaged"),
        ("a bit of the index", "damaged index"),
        ("something else", "not a checkpoint"),
    ];
    for (how, word) in all {
        let folder = copy(&how.replace(' ', "-"));
        damage(&checkpoints(&folder).path_of(steps[1]), how);
        let left = 2 * STEPS - steps[0];
        let (outcome, said) = go_on(&folder, On::threads(2).steps(left));
        assert_eq!(outcome.unwrap().steps, 2 * STEPS, "{how}");
        let report =
            said.iter().find(|text| text.starts_with("warning: skipped")).unwrap_or_else(|| panic!("{how}: {said:#?}"));
        assert!(report.contains(word) && report.contains(&format!("step-{:09}", steps[1])), "{how}: {report}");
        assert!(said.iter().any(|text| text.contains(&format!("from step {}", steps[0]))), "{how}: {said:#?}");
        // It no longer counts among those that are kept.
        let aside = checkpoints(&folder).path_of(steps[1]).with_extension("ckpt.damaged");
        assert!(aside.is_file() && checkpoints(&folder).steps().unwrap().len() == 2, "{how}");
        assert_same(&folder, &whole, how);
    }
    let folder = copy("nothing-left");
    steps.iter().for_each(|&step| damage(&checkpoints(&folder).path_of(step), "cut in the middle"));
    let (outcome, said) = go_on(&folder, On::threads(1));
    let error = outcome.unwrap_err();
    assert_eq!(error.exit_code(), exit::WRONG_INPUT);
    assert!(error.to_string().contains("no good checkpoint"), "{error}");
    assert_eq!(said.iter().filter(|text| text.starts_with("warning: skipped")).count(), 2);
    // Nothing was touched.
    assert_eq!(std::fs::read(folder.join("series.csv")).unwrap(), std::fs::read(sound.join("series.csv")).unwrap());
}

#[test]
fn only_folders_of_runs_can_be_gone_on_with() {
    let scratch = Scratch::new("restart-nothing");
    for folder in [scratch.join("missing"), scratch.path().to_owned()] {
        let (outcome, _) = go_on(&folder, On::threads(1));
        assert_eq!(outcome.unwrap_err().exit_code(), exit::WRONG_INPUT);
    }
}

#[test]
fn a_run_without_a_checkpoint_begins_again_from_its_case() {
    let scratch = Scratch::new("restart-begin-again");
    let whole = scratch.join("whole");
    let begun_once = ran(SLIDING, &["run.until=0.1 ms"], &whole, On::threads(1));
    // Checkpoints by the wall clock that never come are no reason to fail.
    let never =
        ran(SLIDING, &["run.until=0.1 ms", "checkpoint.every_wall=1e20 s"], &scratch.join("never"), On::threads(1));
    assert_eq!(never.hash(), begun_once.hash());
    // What a run that was killed before its first checkpoint leaves: its case, a part of its series, a torn file.
    let killed = scratch.join("killed");
    std::fs::create_dir_all(killed.join("checkpoints")).unwrap();
    std::fs::copy(whole.join("case.toml"), killed.join("case.toml")).unwrap();
    std::fs::write(killed.join("series.csv"), "time [s],dt [s]\n0,1e-").unwrap();
    std::fs::write(killed.join("log.txt"), "2026-11-22T18:30:00Z  sazanami 0.1.0\n").unwrap();
    std::fs::write(killed.join("checkpoints/.unfinished-x"), "half").unwrap();
    std::fs::write(killed.join(".sazanami-lock"), "process 1, since 2026-11-22T18:30:00Z\n").unwrap();
    let (outcome, said) = go_on(&killed, On::threads(1));
    assert_eq!(outcome.unwrap().status, Status::Finished);
    assert!(said.iter().any(|text| text.contains("begins again from the case")), "{said:#?}");
    let begun_again = Left::in_folder(&killed);
    assert_eq!(begun_again.hash(), begun_once.hash());
    assert_eq!(begun_again.series.rows.len(), begun_once.series.rows.len());
    let log = std::fs::read_to_string(killed.join("log.txt")).unwrap();
    assert!(log.starts_with("2026-11-22T18:30:00Z  sazanami 0.1.0\n"), "{log}");
    assert!(!killed.join("checkpoints/.unfinished-x").exists() && !killed.join(".sazanami-lock").exists());
    // The end that is asked for is that of the run.
    let later = scratch.join("later");
    std::fs::create_dir_all(&later).unwrap();
    std::fs::copy(whole.join("case.toml"), later.join("case.toml")).unwrap();
    let longer = RunOptions { until: Some(0.2e-3), ..On::threads(1).options(None) };
    assert_eq!(go_on_with(&later, &longer).0.unwrap().status, Status::Finished);
    assert_eq!(Left::in_folder(&later).column("time").last(), Some(&0.2e-3));
}

#[test]
fn a_run_that_has_ended_is_not_computed_again_for_want_of_a_checkpoint() {
    let scratch = Scratch::new("restart-thinned");
    let folder = scratch.join("run");
    ran(SLIDING, &["run.until=0.1 ms"], &folder, On::threads(1));
    std::fs::remove_dir_all(folder.join("checkpoints")).unwrap();
    let before = std::fs::read(folder.join("summary.json")).unwrap();
    let error = go_on(&folder, On::threads(1)).0.unwrap_err();
    assert_eq!(error.exit_code(), exit::WRONG_INPUT);
    assert!(error.to_string().contains("has finished, and no checkpoint of it"), "{error}");
    assert_eq!(std::fs::read(folder.join("summary.json")).unwrap(), before);
    // Nor is one that was killed after its first checkpoint.
    let killed = String::from_utf8(before).unwrap().replace("\"finished\"", "\"running\"");
    std::fs::write(folder.join("summary.json"), &killed).unwrap();
    let error = go_on(&folder, On::threads(1)).0.unwrap_err();
    assert!(error.to_string().contains("has broken off, and no checkpoint of it"), "{error}");
    assert_eq!(std::fs::read_to_string(folder.join("summary.json")).unwrap(), killed);
}

#[test]
fn a_run_goes_on_with_its_ranks_and_tells_of_others() {
    let scratch = Scratch::new("restart-ranks");
    let folder = scratch.join("run");
    ran(SLIDING, &[], &folder, On::ranks(2, 1).steps(3));
    let open = RunOptions { ranks: 0, ..On::threads(1).steps(3).options(None) };
    let (outcome, said) = go_on_with(&folder, &open);
    outcome.unwrap();
    assert!(said.iter().any(|text| text.ends_with("on 2 ranks")), "{said:#?}");
    let history = |folder: &Path| summary(folder)["history"]["ranks"].clone();
    assert_eq!((&summary(&folder)["machine"]["ranks"], history(&folder)), (&2.into(), serde_json::json!([2])));
    let whole = ran(SLIDING, &[], &scratch.join("whole"), On::ranks(2, 1).steps(6));
    assert_eq!(Left::in_folder(&folder).hash(), whole.hash());
    go_on(&folder, On::threads(1).steps(2)).0.unwrap();
    assert_eq!(history(&folder), serde_json::json!([2, 1]));
}

#[test]
fn a_wrong_command_leaves_a_run_as_it_is() {
    let scratch = Scratch::new("restart-wrong");
    let folder = scratch.join("run");
    start(&load(SLIDING, &["run.until=0.1 ms"]), &folder, On::threads(1)).unwrap();
    let before = summary(&folder);
    assert_eq!(before["status"], "finished");
    for file in ["log.txt", "series.csv"] {
        assert!(before["files"].as_array().unwrap().contains(&file.into()), "{file}: {}", before["files"]);
    }
    // More ranks than there are columns of cells.
    let error = go_on(&folder, On::ranks(500, 1)).0.unwrap_err();
    assert_eq!(error.exit_code(), exit::WRONG_INPUT, "{error}");
    assert_eq!(summary(&folder), before);
    // A case that was changed, and put back.
    let case = folder.join("case.toml");
    let text = std::fs::read_to_string(&case).unwrap();
    let steeper = text.replace("\"-9.8 m/s^2\"", "\"-9.9 m/s^2\"");
    assert_ne!(steeper, text);
    std::fs::write(&case, steeper).unwrap();
    let error = go_on(&folder, On::threads(1)).0.unwrap_err();
    assert_eq!(error.exit_code(), exit::WRONG_INPUT);
    assert!(error.to_string().contains("is not the case that this run began with"), "{error}");
    assert_eq!(summary(&folder), before);
    std::fs::write(&case, text).unwrap();
    assert_eq!(go_on(&folder, On::threads(2)).0.unwrap().status, Status::Finished);
}

/// Makes the run in `folder` one of a program that knew fewer keys and columns, and perhaps recorded which it was.
fn made_older(folder: &Path, key: &str, program: serde_json::Value) {
    let path = folder.join("series.csv");
    let table = std::fs::read_to_string(&path).expect("the run left it");
    let at = table.lines().next().and_then(|header| header.split(',').position(|name| name.starts_with("stable_dt")));
    let at = at.expect("there is such a column");
    let fewer = |line: &str| {
        let fields = line.split(',').enumerate().filter(|(n, _)| *n != at).map(|(_, field)| field);
        fields.collect::<Vec<_>>().join(",") + "\n"
    };
    std::fs::write(&path, table.lines().map(fewer).collect::<String>()).expect("the run left it");
    let path = folder.join("case.toml");
    let text = std::fs::read_to_string(&path).expect("the run left it");
    let older: String = text.lines().filter(|line| !line.starts_with(key)).flat_map(|line| [line, "\n"]).collect();
    assert!(older.len() < text.len(), "{key} is not in the copy");
    // And more keys, which have gone since.
    let gone = |text: String, table: &str, key: &str| {
        let with = if key.ends_with(table) { key.to_owned() } else { format!("{table}{key}") };
        if text.contains(key) { text } else { text.replace(table, &with) }
    };
    let older = gone(older, "[fluid]\n", "vof = \"plic\"\n");
    let older = gone(older, "[coupling]\n", "alpha = \"columns(4)\"\n");
    let older = gone(older, "[dem]\n", "contact_start = \"touch\"\nrolling = \"none\"\nslip_direction = \"force\"\n");
    let older = older.replace("pressure_form = \"full\"", "projection = \"full\"");
    let older = gone(older, "normal_damping = ", "damping = \"literal\"\nnormal_damping = ");
    std::fs::write(&path, &older).expect("the run left it");
    let reader = newest(folder);
    let mut state: serde_json::Value = reader.get_json("run/state").expect("the run left it");
    state["case_hash"] = format!("{:016x}", resolved::hash_of_copy(&older)).into();
    state["program"] = program;
    let snapshot = reader.snapshot_of(|name| name != "run/state").expect("the run left it");
    let mut writer = CheckpointWriter::new();
    writer.add_snapshot(&snapshot).expect("the run left it");
    writer.add_json("run/state", &state).expect("the run left it");
    writer.write_atomic(reader.path()).expect("the run left it");
}

#[test]
fn a_run_of_an_older_program_goes_on_and_a_changed_case_does_not() {
    let scratch = Scratch::new("restart-older");
    let bed = scratch.join("small.bed");
    let name = format!("output.bed={}", bed.display());
    start(&load(PACKED, &[&name, "run.packing_only=true"]), &scratch.join("packed"), On::threads(1)).unwrap();
    let report =
        |said: &[String]| said.iter().filter(|text| text.contains("began this run")).cloned().collect::<Vec<_>>();
    // With a file that is named, of which the folder is no part of the hash, and without.
    for (name, text) in [("sliding", SLIDING.to_owned()), ("bed", on_bed(&bed, ""))] {
        let folder = scratch.join(name);
        start(&load(&text, &[]), &folder, On::threads(1).steps(1)).unwrap();
        let copy = std::fs::read_to_string(folder.join("case.toml")).unwrap();
        let own = case::load(&folder.join("case.toml"), &[]).unwrap();
        assert_eq!(resolved::hash_of_copy(&copy), resolved::hash(&own.case), "{name}");
        assert!(report(&go_on(&folder, On::threads(1).steps(1)).1).is_empty());

        made_older(&folder, "columns", serde_json::Value::Null);
        let (outcome, said) = go_on(&folder, On::threads(1).steps(1));
        outcome.unwrap();
        assert!(report(&said)[0].contains("an earlier version of sazanami began this run"), "{said:#?}");
        let program = serde_json::json!({ "version": "0.0.1", "commit": "abc" });
        made_older(&folder, "drop_velocity", program.clone());
        for _ in 0..2 {
            let (outcome, said) = go_on(&folder, On::threads(1).steps(1));
            outcome.unwrap();
            assert!(report(&said)[0].contains("sazanami 0.0.1 (abc) began this run"), "{said:#?}");
        }
        let state: serde_json::Value = newest(&folder).get_json("run/state").unwrap();
        assert_eq!(state["program"], program);

        // What was changed is refused, whoever began the run.
        let older = std::fs::read_to_string(folder.join("case.toml")).unwrap();
        std::fs::write(folder.join("case.toml"), older.replace("friction = 0.6", "friction = 0.5")).unwrap();
        let error = go_on(&folder, On::threads(1).steps(1)).0.unwrap_err();
        assert!(error.exit_code() == exit::WRONG_INPUT && error.to_string().contains("changed since"), "{error}");
    }
}

#[test]
fn a_run_goes_on_without_the_bed_it_began_with() {
    let scratch = Scratch::new("restart-bed");
    let bed = scratch.join("small.bed");
    let name = format!("output.bed={}", bed.display());
    start(&load(PACKED, &[&name, "run.packing_only=true"]), &scratch.join("packed"), On::threads(2)).unwrap();
    let text = on_bed(&bed, "");
    let folder = scratch.join("run");
    start(&load(&text, &[]), &folder, On::threads(1).steps(3)).unwrap();
    std::fs::remove_file(&bed).unwrap();
    let moved = scratch.join("moved");
    std::fs::rename(&folder, &moved).unwrap();
    assert_eq!(go_on(&moved, On::threads(1).steps(2)).0.unwrap().steps, 5);
    // Begun anew in its own folder it finds the copy there.
    let again = RunOptions { force: true, ..On::threads(1).steps(1).options(Some(&moved)) };
    heard(&case::load(&moved.join("case.toml"), &[]).unwrap(), &again);
    let copy = "inputs/grains-0/bed/small.bed";
    let listed = |copy: &str| summary(&moved)["files"].as_array().unwrap().contains(&copy.into());
    assert!(listed(copy));
    // Negative control: the copy is what it needs.
    std::fs::rename(moved.join(copy), scratch.join("small.bed")).unwrap();
    assert_eq!(go_on(&moved, On::threads(1)).0.unwrap_err().exit_code(), exit::WRONG_INPUT);
    // Another case in the same folder leaves no copy of what it does not name.
    std::fs::rename(scratch.join("small.bed"), moved.join(copy)).unwrap();
    heard(&load(SLIDING, &[]), &again);
    assert!(!listed(copy) && !moved.join("inputs").exists());
}

#[test]
fn the_log_holds_what_was_said() {
    let scratch = Scratch::new("restart-log");
    let folder = scratch.join("run");
    start(&load(SLIDING, &[]), &folder, On::ranks(2, 1).steps(2)).unwrap();
    let first = std::fs::read_to_string(folder.join("log.txt")).unwrap();
    assert_eq!(first.lines().filter(|line| line.contains("Z  flow ")).count(), 1, "{first}");
    assert!(first.contains("Z  stopped after 2 steps, as asked, at step 2, "), "{first}");
    // The time of day stands before each message: 2026-11-22T18:30:00Z.
    let is_dated = |line: &str| line.len() > 22 && line.as_bytes()[10] == b'T' && &line[19..22] == "Z  ";
    assert!(first.lines().filter(|line| !line.starts_with(' ')).all(is_dated), "{first}");
    let said = go_on(&folder, On::threads(1).steps(2)).1;
    let both = std::fs::read_to_string(folder.join("log.txt")).unwrap();
    let added = both.strip_prefix(&first).expect("the log of the first command stays");
    assert!(said.iter().any(|text| text.starts_with("going on from step 2")));
    for text in &said {
        assert!(added.lines().any(|line| line.ends_with(text.as_str())), "`{text}` is not in:\n{added}");
    }
}

#[test]
fn probes_keep_their_own_schedules() {
    let scratch = Scratch::new("restart-probes");
    let more = "[[probe]]\nname = \"as the series\"\npoint = [\"1 mm\", \"1 mm\", \"1 mm\"]\n\
                [[probe]]\nname = \"never\"\nat = []\npoint = [\"1 mm\", \"1 mm\", \"1 mm\"]\n[output]\n";
    let text = SLIDING.replace("[output]\n", more).replace("series = { steps = 1 }", "series = { steps = 2 }");
    let left = ran(&text, &[], &scratch.join("run"), On::threads(1).steps(6));
    let steps = |name: &str| {
        let found = left.probes.iter().find(|(file, _)| *file == format!("{name}.csv"));
        found.map(|(_, table)| table.column("step"))
    };
    assert_eq!(steps("middle"), Some(vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    assert_eq!(steps("grain"), Some(vec![0.0, 3.0, 6.0]));
    assert_eq!(steps("as the series"), Some(left.column("step")));
    assert_eq!(steps("never"), None);
    assert_eq!(left.column("step"), [0.0, 2.0, 4.0, 6.0]);
}

/// A linear signal: the place of a grain that moves with a constant velocity.
#[test]
fn probes_are_read_between_the_ends_of_steps() {
    let scratch = Scratch::new("restart-between");
    let moving = "[[grains]]\nname = \"moving\"\nmotion = \"prescribed\"\nshape.sphere = { diameter = \"0.3 mm\" }\n\
                  material = \"sand\"\nplacement.lattice = { lower = [\"1 mm\", \"1 mm\", \"2.5 mm\"], \
                  upper = [\"1.4 mm\", \"1.4 mm\", \"2.9 mm\"], counts = [1, 1, 1], velocity = [\"0.7 m/s\", \"0 m/s\", \"0 m/s\"] }\n[bed]\n";
    let text = SLIDING.replace("[bed]\n", moving);
    let run = |name: &str, probes: &str, overrides: &[&str]| {
        let text = text.replace("[output]\n", &format!("{probes}[output]\n"));
        // It leaves the box later.
        ran(&text, &[overrides, &["run.until=2 ms"]].concat(), &scratch.join(name), On::threads(1).steps(15))
    };
    let body = "body = { population = \"moving\" }\n";
    let probes =
        format!("[[probe]]\nname = \"times\"\n{body}every = \"3 us\"\n[[probe]]\nname = \"steps\"\n{body}steps = 1\n");
    let [with, without] = [run("with", &probes, &[]), run("without", "", &[])];
    assert_eq!((with.hash(), &with.series), (without.hash(), &without.series));
    // Negative control: output at the same times shortens steps.
    let cut = run("cut", "", &["output.grains.every=3 us"]);
    assert_ne!(cut.hash(), without.hash());

    let [times, ends] = ["times", "steps"].map(|name| with.probe(name).column("time"));
    let last = ends[ends.len() - 1];
    assert_eq!(times.len(), 1 + (last / 3e-6).floor() as usize);
    for (n, (time, place)) in times.iter().zip(with.probe("times").column("position_1")).enumerate() {
        assert!((time - 3e-6 * n as f64).abs() < 1e-15, "{time}");
        assert!((place - 1.2e-3 - 0.7 * time).abs() < 1e-15, "{place} at {time}");
    }
    // Negative control: at the ends of the steps it is elsewhere.
    let away = |time: &f64| ends.iter().map(|end| 0.7 * (end - time).abs()).fold(f64::INFINITY, f64::min);
    assert!(times.iter().map(away).fold(0.0, f64::max) > 1e-7);
}

fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("the case is sound");
    for entry in std::fs::read_dir(from).expect("the case is sound") {
        let path = entry.expect("the case is sound").path();
        let place = to.join(path.file_name().expect("the case is sound"));
        if path.is_dir() {
            copy_folder(&path, &place);
        } else {
            std::fs::copy(&path, &place).expect("the case is sound");
        }
    }
}

#[test]
fn damaged_lists_and_tables_do_not_stop_a_run() {
    let scratch = Scratch::new("restart-tables");
    let loaded = load(SLIDING, &["output.series.steps=1", "output.grains.every=\"0.05 ms\""]);
    let [sound, damaged] = ["sound", "damaged"].map(|name| scratch.join(name));
    start(&loaded, &sound, On::threads(1).steps(STEPS)).unwrap();
    copy_folder(&sound, &damaged);
    let warned =
        |said: &[String], about: &str| said.iter().any(|line| line.starts_with("warning: ") && line.contains(about));
    let (outcome, said) = go_on(&sound, On::threads(1).steps(STEPS));
    outcome.unwrap();
    // Negative control: of sound files nothing is said.
    assert!(!["grains.pvd", "series.csv", "middle.csv"].iter().any(|about| warned(&said, about)), "{said:#?}");
    std::fs::write(damaged.join("grains.pvd"), "<DataSet no list").unwrap();
    std::fs::write(damaged.join("probes/middle.csv"), "not a table\n1,2,3\n").unwrap();
    let series = std::fs::read_to_string(damaged.join("series.csv")).unwrap();
    let kept = series.lines().count() / 2;
    let cut: usize = series.lines().take(kept).map(|line| line.len() + 1).sum();
    std::fs::write(damaged.join("series.csv"), &series[..cut + 7]).unwrap();
    let (outcome, said) = go_on(&damaged, On::threads(1).steps(STEPS));
    outcome.unwrap();
    for about in ["grains.pvd", "series.csv", "middle.csv"] {
        assert!(warned(&said, about), "{about}: {said:#?}");
    }
    assert!(damaged.join("probes/middle.csv.damaged").is_file());
    let [whole, left] = [&sound, &damaged].map(|folder| Left::in_folder(folder));
    assert_eq!(whole.hash(), left.hash());
    // What was lost stays lost, and what comes after follows what was kept.
    let rows = |left: &Left| left.series.rows.iter().map(|row| row[0].clone()).collect::<Vec<_>>();
    let lost = series.lines().count() - kept;
    assert_eq!(rows(&left).len() + lost, rows(&whole).len());
    assert_eq!(rows(&left)[kept - 1..], rows(&whole)[kept - 1 + lost..]);
}
