//! Runs under `mpirun`: the bits of ranks within one process, restarts on other numbers of ranks, and what goes wrong.
//!
//! The launcher is `SAZANAMI_MPIRUN`, with its options; without it `mpirun`. `cargo xtask test --mpi` sets it.

#![cfg(all(unix, feature = "mpi"))]

mod faults;

use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// A drop on grains that are packed within the run, on a grid.
const GRID: &str = include_str!("../cases/mpi-grid.toml");

/// Moving particles over grains, packed and prepared within the run.
const TANK: &str = include_str!("../cases/mpi-tank.toml");

/// Steps of a run, and those after which it is interrupted.
const STEPS: usize = 6;
const HALF: usize = 3;

/// The launcher with its options.
fn launcher() -> Command {
    let words = std::env::var("SAZANAMI_MPIRUN").unwrap_or_else(|_| "mpirun".into());
    let mut words = words.split_whitespace();
    let mut command = Command::new(words.next().expect("a launcher is named"));
    command.args(words);
    // What Open MPI asks of a container, where everybody is root, and of a machine with fewer processors than ranks.
    for name in ["OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_rmaps_base_oversubscribe"] {
        command.env(name, "1");
    }
    command.stdin(Stdio::null());
    command
}

/// The command line of `ranks` processes of `sazanami`; no ranks stand for the command alone.
fn sazanami(folder: &Path, ranks: usize, arguments: &[&str]) -> Command {
    let mut command = match ranks {
        0 => Command::new(env!("CARGO_BIN_EXE_sazanami")),
        ranks => {
            let mut command = launcher();
            command.args(["-n", &ranks.to_string(), env!("CARGO_BIN_EXE_sazanami")]);
            command
        }
    };
    command.args(arguments).current_dir(folder);
    command
}

fn run(folder: &Path, ranks: usize, arguments: &[&str]) -> Output {
    sazanami(folder, ranks, arguments).output().expect("the launcher can be started")
}

/// Ranks of a run: processes of a launcher, or ranks within one.
#[derive(Clone, Copy, Debug, PartialEq)]
enum On {
    Mpi(usize),
    One(usize),
}

/// Does `work` (`run CASE --out OUT`, `resume OUT`) for so many steps; the hash of its state, and its summary.
fn steps(folder: &Path, on: On, work: &[&str], steps: usize) -> (String, Value) {
    let steps = steps.to_string();
    let more = ["--steps", &steps, "--threads", "1"];
    let output = match on {
        On::Mpi(ranks) => run(folder, ranks, &[work, &more].concat()),
        On::One(ranks) => run(folder, 0, &[work, &more, &["--ranks", &ranks.to_string()]].concat()),
    };
    assert!(output.status.success(), "{work:?} on {on:?}: {}", text(&output.stderr));
    let out = work.last().expect("the folder comes last");
    summary(&folder.join(out))
}

fn summary(out: &Path) -> (String, Value) {
    let text = std::fs::read_to_string(out.join("summary.json")).expect("the run wrote a summary");
    let summary: Value = serde_json::from_str(&text).expect("it is JSON");
    (summary["state_hash"].as_str().unwrap_or_default().to_owned(), summary)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A folder with both cases.
fn cases() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("there is a place for temporary files");
    std::fs::write(folder.path().join("grid.toml"), GRID).expect("it can be written to");
    std::fs::write(folder.path().join("tank.toml"), TANK).expect("it can be written to");
    folder
}

#[test]
fn processes_have_the_bits_of_ranks_within_one() {
    let folder = cases();
    let folder = folder.path();
    for (case, numbers) in [("grid", &[1, 2, 3, 4, 6][..]), ("tank", &[1, 2, 3, 4])] {
        let mut hashes = Vec::new();
        for &ranks in numbers {
            let name = format!("{case}.toml");
            let out = |kind: &str| format!("{case}-{kind}-{ranks}");
            let (one, _) = steps(folder, On::One(ranks), &["run", &name, "--out", &out("one")], STEPS);
            let (mpi, summary) = steps(folder, On::Mpi(ranks), &["run", &name, "--out", &out("mpi")], STEPS);
            assert_eq!(one, mpi, "{case} on {ranks} ranks");
            let series = |kind: &str| std::fs::read(folder.join(out(kind)).join("series.csv")).expect("a series");
            assert_eq!(series("one"), series("mpi"), "{case} on {ranks} ranks");
            let machine = &summary["machine"];
            assert_eq!((machine["ranks"].as_u64(), machine["sums"].as_str()), (Some(ranks as u64), Some("ordered")));
            assert!(machine["mpi"].is_string() && machine["hosts"].as_array().is_some_and(|all| all.len() == ranks));
            hashes.push(mpi);
        }
        // Negative control: the number of ranks shows in the last digits.
        assert!(hashes.iter().any(|hash| *hash != hashes[0]), "{case}: {hashes:?}");
    }
}

#[test]
fn tree_sums_are_the_same_within_one_process_too() {
    let folder = cases();
    let work = |out: &'static str, sums: &'static str| ["run", "grid.toml", "--sums", sums, "--out", out];
    let (one, _) = steps(folder.path(), On::One(6), &work("one", "tree"), STEPS);
    let (_, summary) = steps(folder.path(), On::Mpi(6), &work("mpi", "tree"), HALF);
    assert_eq!(summary["machine"]["sums"].as_str(), Some("tree"));
    // A run goes on as it began.
    let (mpi, summary) = steps(folder.path(), On::Mpi(6), &["resume", "mpi"], STEPS - HALF);
    assert_eq!((&one, summary["machine"]["sums"].as_str()), (&mpi, Some("tree")));
    // Negative control: the other order shows in the last digits.
    assert_ne!(one, steps(folder.path(), On::One(6), &work("ordered", "ordered"), STEPS).0);
}

#[test]
fn runs_go_on_on_other_ranks_of_either_kind() {
    let folder = cases();
    let folder = folder.path();
    for case in ["grid", "tank"] {
        let name = format!("{case}.toml");
        let (whole, _) = steps(folder, On::One(2), &["run", &name, "--out", &format!("{case}-whole")], STEPS);
        let halves = [(On::Mpi(2), On::Mpi(2)), (On::Mpi(2), On::One(2)), (On::One(2), On::Mpi(2))];
        for (n, (first, second)) in halves.into_iter().enumerate() {
            let out = format!("{case}-{n}");
            steps(folder, first, &["run", &name, "--out", &out], HALF);
            let (hash, _) = steps(folder, second, &["resume", &out], STEPS - HALF);
            assert_eq!(hash, whole, "{case}: {first:?}, then {second:?}");
        }
        // On another number of ranks it has the bits of whatever kind goes on on that number.
        let hashes = [On::Mpi(4), On::One(4)].map(|second| {
            let out = format!("{case}-{second:?}");
            steps(folder, On::Mpi(3), &["run", &name, "--out", &out], HALF);
            steps(folder, second, &["resume", &out], STEPS - HALF).0
        });
        assert_eq!(hashes[0], hashes[1], "{case} on 3, then on 4");
    }
}

#[test]
fn beds_and_prepared_tanks_reach_ranks_that_see_no_file() {
    let folder = cases();
    let folder = folder.path();
    steps(folder, On::One(1), &["run", "grid.toml", "--out", "packed"], 1);
    steps(folder, On::One(2), &["run", "tank.toml", "--out", "made"], 1);
    let bed = "grains.0.placement={ bed = { file = \"packed/packed.bed\" } }";
    for (case, set) in [("grid.toml", bed), ("tank.toml", "preparation.state=made/prepared.state")] {
        let work = |out: &'static str| ["run", case, "--set", "grains.0.count=30", "--set", set, "--out", out];
        let work =
            |out| if case == "grid.toml" { work(out).to_vec() } else { [&work(out)[..2], &work(out)[4..]].concat() };
        let (one, _) = steps(folder, On::One(2), &work("one"), HALF);
        let (mpi, _) = steps(folder, On::Mpi(2), &work("mpi"), HALF);
        assert_eq!(one, mpi, "{case}");
        for out in ["one", "mpi"] {
            std::fs::remove_dir_all(folder.join(out)).expect("the run left it");
        }
    }
}

#[test]
fn verification_and_benchmarks_are_shared() {
    let folder = cases();
    let output = run(folder.path(), 3, &["verify", "layers-at-rest", "falling-drop", "--json"]);
    let alone = run(folder.path(), 0, &["verify", "layers-at-rest", "falling-drop", "--json"]);
    assert_eq!(output.status.code(), alone.status.code(), "{}", text(&output.stderr));
    assert_eq!(text(&output.stdout), text(&alone.stdout));
    assert!(text(&output.stderr).contains("on another rank"), "{}", text(&output.stderr));
    let refused = run(folder.path(), 2, &["bench", "machine_triad"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("name benchmarks that ranks share: case_step"), "{}", text(&refused.stderr));
}

/// Whatever rank a case comes to, it is posed and judged by the folder that the command names.
#[test]
fn every_rank_takes_cases_from_the_folder() {
    let folder = cases();
    let cases = ["restitution", "bouncing"];
    for case in cases {
        std::fs::create_dir_all(folder.path().join("own").join(case)).expect("it can be written to");
        std::fs::write(folder.path().join("own").join(case).join("case.toml"), "unknown = 1\n").expect("a file");
    }
    for (more, failed) in [(&["--expected", "own"][..], 2), (&[], 0)] {
        let output = run(folder.path(), 2, &[&["verify"][..], &cases, more].concat());
        let told = text(&output.stdout);
        assert_eq!(told.matches("unknown key").count(), failed, "{told}");
        assert!(text(&output.stderr).contains("on another rank"), "{}", text(&output.stderr));
    }
}
