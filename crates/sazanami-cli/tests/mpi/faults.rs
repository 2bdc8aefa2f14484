//! Wrong launches, wrong input, signals and ranks that are gone.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::{HALF, On, STEPS, cases, launcher, run, sazanami, steps, summary, text};

const PROGRAM: &str = env!("CARGO_BIN_EXE_sazanami");
/// Longest time to the end of a job once something is wrong.
const SOON: Duration = Duration::from_secs(5);

/// Error stream and exit code of `mpirun -n 2` of a shell line with `$S` for the program.
fn shell(folder: &Path, line: &str) -> (Option<i32>, String) {
    let mut command = launcher();
    command.args(["-n", "2", "sh", "-c", line]).env("S", PROGRAM).current_dir(folder);
    // MPICH would put its messages into files in memory, which a bound on the size of files refuses.
    command.env("UCX_TLS", "self,tcp");
    let output = command.output().expect("the launcher can be started");
    (output.status.code(), text(&output.stderr))
}

#[test]
fn wrong_launches_are_refused_with_the_reason() {
    let folder = cases();
    let folder = folder.path();
    let refused = |line: &str, says: &str| {
        let (code, printed) = shell(folder, line);
        assert_eq!(code, Some(2), "{line}: {printed}");
        assert!(printed.contains(says), "{line}: {printed}");
        assert!(!folder.join("out").exists(), "{line} left a folder");
    };
    refused("exec $S run grid.toml --out out --ranks 2", "leave out `--ranks`");
    refused("exec taskset -c 0 $S run grid.toml --out out --threads 2", "is bound to 1 processor");
    refused("OMPI_COMM_WORLD_SIZE=5 exec $S run grid.toml --out out", "a launcher of 5 processes");
    refused(
        "exec $S run grid.toml --out out --set domain.cells='[2, 2, 20]'",
        "numbers of processes that work: 1 at most",
    );
    refused("exec $S run missing.toml --out out", "the case file cannot be read");
    refused("exec $S run grid.toml --out /proc/none", "nothing can be written to");
    // Ranks that were started differently, or see another case file.
    let other = "[ ${OMPI_COMM_WORLD_RANK:-$PMI_RANK} = 1 ]";
    refused(
        &format!("{other} && set -- --force; exec $S run grid.toml --out out $*"),
        "was started with other arguments",
    );
    std::fs::create_dir(folder.join("elsewhere")).unwrap();
    std::fs::write(folder.join("elsewhere/grid.toml"), "# another\n").unwrap();
    refused(&format!("{other} && cd elsewhere; exec $S run grid.toml --out out"), "sees another case file");
    // A rank that sees no file at all gets it from rank 0.
    std::fs::create_dir(folder.join("bare")).unwrap();
    let (code, printed) = shell(folder, &format!("{other} && cd bare; exec $S run grid.toml --out seen --steps 2"));
    assert_eq!(code, Some(0), "{printed}");
    let (whole, _) = steps(folder, On::One(2), &["run", "grid.toml", "--out", "whole"], 2);
    assert_eq!(summary(&folder.join("seen")).0, whole);
    assert!(!folder.join("bare/seen").exists());
}

/// A run that goes on, on three ranks.
fn live(folder: &Path, out: &str) -> Child {
    let errors = std::fs::File::create(folder.join("errors.txt")).expect("the folder can be written to");
    let arguments = ["run", "grid.toml", "--out", out, "--threads", "1"];
    let mut command = sazanami(folder, 3, &arguments);
    let child = command.stdout(Stdio::null()).stderr(errors).spawn().expect("the launcher can be started");
    let began = Instant::now();
    let series = folder.join(out).join("series.csv");
    while !std::fs::read_to_string(&series).is_ok_and(|text| text.lines().count() > 2) {
        assert!(began.elapsed() < Duration::from_secs(100), "no steps: {}", errors_of(folder));
        std::thread::sleep(Duration::from_millis(50));
    }
    child
}

fn errors_of(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("errors.txt")).unwrap_or_default()
}

/// The processes of the program under a launcher, in the order of their numbers.
fn processes(launcher: &Child) -> Vec<u32> {
    let listed = Command::new("pgrep").args(["-f", "run grid.toml --out"]).output().expect("there is pgrep");
    let of_program =
        |id: &u32| std::fs::read_link(format!("/proc/{id}/exe")).is_ok_and(|path| path == Path::new(PROGRAM));
    let mut found: Vec<u32> =
        text(&listed.stdout).lines().filter_map(|line| line.parse().ok()).filter(of_program).collect();
    found.retain(|&id| id != launcher.id());
    found.sort_unstable();
    found
}

fn signal(name: &str, process: u32) {
    let sent = Command::new("kill").args([name, &process.to_string()]).status();
    assert!(sent.is_ok_and(|status| status.success()));
}

/// Waits for the end of a job that has to come soon.
fn ended(mut job: Child) -> Option<i32> {
    let began = Instant::now();
    loop {
        match job.try_wait().expect("the launcher can be waited for") {
            Some(status) => return status.code(),
            None => assert!(began.elapsed() < 2 * SOON, "the job hangs"),
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn sigusr1_on_one_rank_ends_all_with_a_checkpoint() {
    let folder = cases();
    let folder = folder.path();
    let job = live(folder, "out");
    let all = processes(&job);
    assert_eq!(all.len(), 3, "{all:?}");
    signal("-USR1", all[2]);
    let code = ended(job);
    assert_eq!(code, Some(130), "{}", errors_of(folder));
    assert!(errors_of(folder).contains("stopped by SIGUSR1"), "{}", errors_of(folder));
    let log = std::fs::read_to_string(folder.join("out/log.txt")).unwrap();
    assert!(log.contains("stopped by SIGUSR1"), "{log}");
    // It goes on in one process, and under MPI, to the same bits.
    let done = summary(&folder.join("out")).1["steps"].as_u64().unwrap();
    assert!(Command::new("cp").args(["-r", "out", "copy"]).current_dir(folder).status().unwrap().success());
    let (one, _) = steps(folder, On::One(2), &["resume", "out"], HALF);
    let (mpi, after) = steps(folder, On::Mpi(2), &["resume", "copy"], HALF);
    assert_eq!(one, mpi);
    assert_eq!(after["steps"].as_u64(), Some(done + HALF as u64));
}

#[test]
fn a_rank_that_is_killed_ends_the_job_and_leaves_what_was_written() {
    let folder = cases();
    let folder = folder.path();
    steps(folder, On::Mpi(3), &["run", "grid.toml", "--out", "out"], HALF);
    let checkpoints = || std::fs::read_dir(folder.join("out/checkpoints")).unwrap().count();
    let before = checkpoints();
    let job = live(folder, "other");
    let all = processes(&job);
    signal("-KILL", all[1]);
    assert_ne!(ended(job), Some(0));
    assert!(processes_of_nobody(), "a rank is left: {:?}", all);
    // The lock of the folder is gone with the processes.
    let again = run(folder, 2, &["resume", "other", "--steps", "1", "--threads", "1"]);
    assert!(again.status.success(), "{}", text(&again.stderr));
    assert_eq!(checkpoints(), before);
}

/// Whether no process of a killed job is left after a moment.
fn processes_of_nobody() -> bool {
    let began = Instant::now();
    while began.elapsed() < SOON {
        let listed = Command::new("pgrep").args(["-f", "run grid.toml --out other"]).output().expect("there is pgrep");
        if listed.stdout.is_empty() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    false
}

#[test]
fn a_full_disk_ends_all_ranks_with_the_cause_of_rank_0() {
    let folder = cases();
    let (code, printed) =
        shell(folder.path(), "trap '' XFSZ; ulimit -f 40; exec $S run grid.toml --out out --steps 6 --threads 1");
    assert_eq!(code, Some(1), "{printed}");
    assert!(printed.contains("File too large") && !printed.contains("panicked"), "{printed}");
}

/// A drop in a box of many cells.
const LARGE: &str = include_str!("../cases/faults-large.toml");

#[test]
fn memory_refused_to_one_rank_ends_the_job() {
    let folder = cases();
    std::fs::write(folder.path().join("large.toml"), LARGE).unwrap();
    let line = "[ ${OMPI_COMM_WORLD_RANK:-$PMI_RANK} = 1 ] && ulimit -v 800000; \
                exec $S run large.toml --out out --threads 1 --steps 3";
    let (code, printed) = shell(folder.path(), line);
    assert_ne!(code, Some(0), "{printed}");
    assert!(printed.contains("out of memory"), "{printed}");
}

#[test]
fn damaged_checkpoints_are_skipped_or_refused_by_rank_0() {
    let folder = cases();
    let folder = folder.path();
    steps(folder, On::Mpi(2), &["run", "grid.toml", "--out", "out"], HALF);
    let all: Vec<_> = std::fs::read_dir(folder.join("out/checkpoints")).unwrap().flatten().map(|e| e.path()).collect();
    let kept: Vec<_> = all.iter().map(|path| (path, std::fs::read(path).unwrap())).collect();
    kept.iter().for_each(|(path, bytes)| std::fs::write(path, &bytes[..bytes.len() / 2]).unwrap());
    let refused = run(folder, 2, &["resume", "out", "--steps", "1", "--threads", "1"]);
    let printed = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{printed}");
    assert!(printed.contains("holds no good checkpoint"), "{printed}");
    // Put back, it goes on where it was.
    kept.iter().for_each(|(path, bytes)| std::fs::write(path, bytes).unwrap());
    let (hash, _) = steps(folder, On::Mpi(2), &["resume", "out"], STEPS - HALF);
    assert_eq!(hash, steps(folder, On::One(2), &["run", "grid.toml", "--out", "whole"], STEPS).0);
}
