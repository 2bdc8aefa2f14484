//! Behaviour of the command towards terminals, signals, other runs and the limits of the machine.

#![cfg(unix)]

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Two glass beads under a falling drop, for longer than anyone waits.
const LONG: &str = include_str!("../long.toml");

fn sazanami(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().expect("the command can be started")
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sazanami"));
    command.args(arguments).current_dir(folder);
    command
}

/// Runs a line of a shell with the command as `$S`.
fn shell(folder: &Path, line: &str) -> Output {
    let mut shell = Command::new("sh");
    shell.args(["-c", line]).env("S", env!("CARGO_BIN_EXE_sazanami")).current_dir(folder);
    shell.output().expect("there is a shell")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A folder with the long case, and its run into `out` as soon as it has steps to show.
fn live_run(folder: &Path) -> Child {
    // The tests may have been begun by `nohup`, whose children ignore that their terminal was closed.
    let mut program = Command::new("env");
    program.args(["--default-signal=HUP,INT,TERM", env!("CARGO_BIN_EXE_sazanami")]);
    start_live_run(folder, program).expect("a run can be started in a folder of its own")
}

fn start_live_run(folder: &Path, mut program: Command) -> std::io::Result<Child> {
    std::fs::write(folder.join("long.toml"), LONG)?;
    let errors = folder.join("errors.txt");
    let mut run = program
        .args(["run", "long.toml", "--out", "out", "--threads", "1"])
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(&errors)?)
        .spawn()?;
    let began = Instant::now();
    let series = folder.join("out/series.csv");
    while !std::fs::read_to_string(&series).is_ok_and(|text| text.lines().count() > 2) {
        assert!(run.try_wait()?.is_none(), "the run ended: {}", text(&std::fs::read(&errors)?));
        assert!(began.elapsed() < Duration::from_secs(100), "no steps");
        std::thread::sleep(Duration::from_millis(50));
    }
    Ok(run)
}

fn signal(run: &Child, name: &str) {
    let sent = Command::new("kill").args([name, &run.id().to_string()]).status();
    assert!(sent.is_ok_and(|status| status.success()));
}

#[test]
fn a_folder_belongs_to_one_run_and_comes_free_when_that_is_killed() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = live_run(folder.path());
    for arguments in [&["resume", "out"][..], &["run", "long.toml", "--out", "out", "--force"]] {
        let refused = sazanami(folder.path(), arguments);
        let printed = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{printed}");
        assert!(printed.contains(&format!("(process {}, since 20", run.id())), "{printed}");
    }
    let early = sazanami(folder.path(), &["analyse", "out"]);
    assert_eq!(early.status.code(), Some(2));
    assert!(text(&early.stderr).contains("has written no summary.json yet"), "{}", text(&early.stderr));
    assert!(run.try_wait().unwrap().is_none(), "the live run goes on");
    signal(&run, "-KILL");
    run.wait().unwrap();
    // It had no checkpoint yet: it begins again, and says so.
    let resumed = sazanami(folder.path(), &["resume", "out", "--steps", "2"]);
    assert_eq!(resumed.status.code(), Some(0), "{}", text(&resumed.stderr));
    assert!(text(&resumed.stderr).contains("begins again"), "{}", text(&resumed.stderr));
    let again = sazanami(folder.path(), &["run", "long.toml", "--out", "out", "--force", "--steps", "2"]);
    assert_eq!(again.status.code(), Some(0), "{}", text(&again.stderr));
    assert!(!folder.path().join("out/.sazanami-lock").exists());
}

/// A build without MPI under a launcher: each of its processes would run the whole case.
#[cfg(not(feature = "mpi"))]
#[test]
fn a_launcher_of_processes_that_know_nothing_of_one_another_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("long.toml"), LONG).unwrap();
    let launched = |rank: &str, arguments: &[&str]| {
        let mut process = command(folder.path(), arguments);
        process.env("OMPI_COMM_WORLD_SIZE", "2").env("OMPI_COMM_WORLD_RANK", rank).output().unwrap()
    };
    let refused = launched("0", &["run", "long.toml", "--steps", "1", "--out", "out"]);
    let printed = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{printed}");
    assert!(printed.contains("built without MPI") && printed.contains("--features mpi"), "{printed}");
    // The others leave it to rank 0 to say so; what is no work of ranks goes on.
    let other = launched("1", &["verify", "layers-at-rest"]);
    assert_eq!((other.status.code(), text(&other.stderr).as_str()), (Some(2), ""));
    assert_eq!(launched("0", &["check", "long.toml"]).status.code(), Some(0));
    assert!(text(&launched("0", &["doctor"]).stdout).contains("a launcher of 2 processes"));
    assert!(!folder.path().join("out").exists());
}

#[test]
fn a_closed_terminal_ends_a_run_with_a_checkpoint_and_the_log_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = live_run(folder.path());
    signal(&run, "-HUP");
    let began = Instant::now();
    while run.try_wait().unwrap().is_none() {
        if began.elapsed() > Duration::from_secs(100) {
            run.kill().unwrap();
            panic!("SIGHUP does not end the run");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(run.wait().unwrap().code(), Some(130));
    assert!(std::fs::read_dir(folder.path().join("out/checkpoints")).unwrap().count() > 0);
    for file in ["errors.txt", "out/log.txt"] {
        let printed = std::fs::read_to_string(folder.path().join(file)).unwrap();
        assert!(printed.contains("stopped by SIGHUP: its terminal was closed at step "), "{file}: {printed}");
    }
}

#[test]
fn signals_that_were_ignored_at_the_start_stay_ignored() {
    let folder = tempfile::tempdir().unwrap();
    // As `nohup sazanami run ... &` in a script: neither a closed terminal nor Ctrl-C is meant for it.
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' HUP INT; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_sazanami")]);
    let mut run = start_live_run(folder.path(), shell).unwrap();
    let lines = || std::fs::read_to_string(folder.path().join("out/series.csv")).unwrap().lines().count();
    signal(&run, "-HUP");
    signal(&run, "-INT");
    let (before, began) = (lines(), Instant::now());
    while lines() < before + 3 {
        assert!(run.try_wait().unwrap().is_none() && began.elapsed() < Duration::from_secs(100), "it goes on");
        std::thread::sleep(Duration::from_millis(20));
    }
    signal(&run, "-TERM");
    assert_eq!(run.wait().unwrap().code(), Some(130));
    let log = std::fs::read_to_string(folder.path().join("out/log.txt")).unwrap();
    assert!(log.contains("stopped by SIGTERM") && !log.contains("SIGHUP"), "{log}");
}

#[test]
fn a_closed_output_is_a_quiet_end_and_a_full_one_an_error() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(sazanami(folder.path(), &["new", "raindrop", "."]).status.code(), Some(0));
    let commands =
        ["check raindrop.toml", "new --schema", "new", "completions bash", "check raindrop.toml --json", "--help"];
    for arguments in commands {
        // `read` takes one line and closes the pipe; the exit code is kept aside.
        let closed = shell(folder.path(), &format!("{{ $S {arguments}; echo $? > code; }} | true"));
        let printed = text(&closed.stderr);
        assert!(!printed.contains("panicked") && !printed.contains("error"), "{arguments}: {printed}");
        assert_eq!(std::fs::read_to_string(folder.path().join("code")).unwrap().trim(), "0", "{arguments}");
        if Path::new("/dev/full").exists() {
            let full = shell(folder.path(), &format!("$S {arguments} > /dev/full"));
            let printed = text(&full.stderr);
            assert_eq!(full.status.code(), Some(1), "{arguments}: {printed}");
            assert!(!printed.contains("panicked"), "{arguments}: {printed}");
            assert!(
                arguments == "--help" || printed.contains("standard output cannot be written: No space left"),
                "{printed}"
            );
        }
    }
    // Negative control: an open output gets it all.
    assert!(text(&sazanami(folder.path(), &["new", "--schema"]).stdout).trim_end().ends_with('}'));
    // A closed error stream does not end a run either.
    std::fs::write(folder.path().join("long.toml"), LONG).unwrap();
    let silent = shell(folder.path(), "$S run long.toml --out out --steps 3 2>&-");
    assert_eq!(silent.status.code(), Some(0), "{}", text(&silent.stderr));
}

#[test]
fn quiet_says_nothing_and_verbose_more() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("long.toml"), LONG).unwrap();
    let run = |out: &str, more: &[&str]| {
        let output = sazanami(folder.path(), &[&["run", "long.toml", "--steps", "3", "--out", out], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        (text(&output.stdout), text(&output.stderr))
    };
    let (plain, printed) = run("plain", &[]);
    // Percentage first, within 80 columns, nothing guessed after the first step.
    let line = printed.lines().find(|line| line.starts_with("flow ")).expect(&printed);
    assert!(line[8..].trim_start().chars().next().is_some_and(|c| c.is_ascii_digit()), "{line}");
    assert!(line.contains(" %  ") && line.len() < 80 && !line.contains("left"), "{line}");
    assert!(!line.contains("sub-steps"), "{line}");
    let (quiet, silence) = run("quiet", &["--quiet"]);
    assert_eq!(silence, "");
    assert_eq!(quiet.lines().count(), plain.lines().count());
    let (_, more) = run("verbose", &["-v"]);
    assert!(more.contains("sub-steps") && more.contains("\ntook ") && more.contains(" MiB at most"), "{more}");
    // Errors are shown all the same.
    assert!(text(&sazanami(folder.path(), &["check", "none.toml", "-q"]).stderr).contains("none.toml"));
}

#[test]
fn shells_get_completions() {
    for (shell, sign) in [("bash", "complete -F"), ("zsh", "#compdef sazanami"), ("fish", "complete -c sazanami")] {
        let output = sazanami(Path::new("."), &["completions", shell]);
        let script = text(&output.stdout);
        assert!(output.status.success() && script.contains(sign) && script.contains("resume"), "{shell}: {script}");
    }
    assert_eq!(sazanami(Path::new("."), &["completions", "dos"]).status.code(), Some(2));
}

#[test]
fn the_doctor_looks_at_machine_and_limits() {
    let folder = tempfile::tempdir().unwrap();
    let output = sazanami(folder.path(), &["doctor", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stdout));
    let findings: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let found: Vec<&str> =
        findings.as_array().unwrap().iter().map(|finding| finding["what"].as_str().unwrap()).collect();
    for what in [
        "version",
        "build",
        "processor",
        "instruction set",
        "cores",
        "memory",
        "memory bandwidth",
        "results",
        "MPI",
        "fonts",
    ] {
        assert!(found.contains(&what), "{what}: {found:?}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    // A limit on address space rules.
    let limited = text(&shell(folder.path(), "ulimit -v 3000000; $S doctor").stdout);
    let rules = limited.lines().find(|line| line.contains("it rules")).expect(&limited);
    assert!(rules.contains("ulimit -v"), "{limited}");
    // Where it leaves no room for the measurement that is said, with all the rest.
    for limit in ["250000", "350000", "400000", "450000", "550000"] {
        let limited = shell(folder.path(), &format!("ulimit -v {limit}; $S doctor"));
        let printed = text(&limited.stdout);
        assert_eq!(limited.status.code(), Some(0), "{limit}: {printed}{}", text(&limited.stderr));
        assert!(printed.contains("memory bandwidth") && printed.contains("fonts"), "{limit}: {printed}");
    }
}

#[test]
fn memory_that_is_refused_ends_by_name() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("long.toml"), LONG).unwrap();
    // Predicted: refused before anything is written.
    let line =
        "ulimit -v 300000; $S run long.toml --out out --steps 1 --threads 1 --set domain.cells='[200, 200, 200]'";
    let predicted = shell(folder.path(), line);
    let printed = text(&predicted.stderr);
    assert_eq!(predicted.status.code(), Some(2), "{printed}");
    assert!(printed.contains("too large for the memory") && !folder.path().join("out").exists(), "{printed}");
    // Not predicted: the standard library says what was refused and aborts.
    let numbers = "1,".repeat(5_000_000);
    std::fs::write(folder.path().join("large.toml"), format!("numbers = [{numbers}]\n")).unwrap();
    let refused = shell(folder.path(), "ulimit -v 300000; $S check large.toml");
    let text = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{text}");
    assert!(text.contains("error: out of memory") && text.contains("ulimit -v"), "{text}");
}

#[test]
fn files_that_may_not_grow_end_a_run_with_an_error() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("long.toml"), LONG).unwrap();
    let ended = |limit: &str, out: &str| {
        shell(folder.path(), &format!("ulimit -f {limit}; $S run long.toml --steps 1 --threads 1 --out {out}"))
    };
    let refused = ended("8", "small");
    let printed = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{printed}");
    assert!(printed.contains("error: ") && printed.contains("File too large"), "{printed}");
    // Negative control: with room for its files the run ends well.
    let good = ended("unlimited", "large");
    assert_eq!(good.status.code(), Some(0), "{}", text(&good.stderr));
}

#[test]
fn an_abort_with_another_cause_is_not_taken_for_a_lack_of_memory() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = live_run(folder.path());
    signal(&run, "-ABRT");
    assert_eq!(run.wait().unwrap().code(), None, "it ends by the signal");
    let errors = std::fs::read_to_string(folder.path().join("errors.txt")).unwrap();
    assert!(errors.contains("aborted (signal SIGABRT)") && !errors.contains("out of memory"), "{errors}");
}

/// A drop near the floor of a box that begins to swing, whose pressure does not converge once it moves.
const FAILING: &str = "gravity = \"0 m/s^2\"\nframe.motion = { amplitude = [\"5 mm\", \"0 mm\", \"0 mm\"], frequency = \"50 Hz\", ramp = \"1 ms\" }\n[domain]\nsize = [\"4 mm\", \"4 mm\", \"4 mm\"]\ncells = [12, 12, 12]\n[[liquid]]\n\
    region.sphere = { diameter = \"1.5 mm\" }\nposition = [\"1.5 mm\", \"2 mm\", \"1.2 mm\"]\n[fluid]\ndt_first = \"1 ns\"\n\
    tol_div = 1e-11\npressure_iterations = 2\n[checkpoint]\nevery = \"1 us\"\n[run]\nuntil = \"2 ms\"\n";

#[test]
fn a_run_that_fails_or_is_stopped_leaves_a_report_that_says_so() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    std::fs::write(folder.path().join("case.toml"), FAILING).expect("a scratch folder is writable");
    let report = |name: &str| std::fs::read_to_string(folder.path().join(name).join("report.html")).unwrap_or_default();
    let failed = sazanami(folder.path(), &["run", "case.toml", "--out", "failed"]);
    assert_eq!(failed.status.code(), Some(1), "{}", text(&failed.stderr));
    let page = report("failed");
    for expected in
        ["The run failed in step", "the pressure did not converge", "Its last good checkpoint is checkpoints"]
    {
        assert!(page.contains(expected), "{expected}: {}", text(&failed.stderr));
    }
    // The control: a run that stops where it was asked to says that, and one that ends says neither.
    let good = ["run", "case.toml", "--set", "fluid.pressure_iterations=500"];
    let stopped = sazanami(folder.path(), &[&good[..], &["--steps", "3", "--out", "stopped"]].concat());
    assert_eq!(stopped.status.code(), Some(0), "{}", text(&stopped.stderr));
    let page = report("stopped");
    assert!(page.contains("The run was stopped at") && !page.contains("The run failed"));
    let ended = sazanami(folder.path(), &[&good[..], &["--set", "run.until=0 s", "--out", "ended"]].concat());
    assert_eq!(ended.status.code(), Some(0), "{}", text(&ended.stderr));
    let page = report("ended");
    assert!(!page.is_empty() && !page.contains("The run was stopped at") && !page.contains("The run failed"));
}

#[test]
fn surface_tension_takes_the_memory_that_is_foretold() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("ball.toml"), include_str!("../cases/wide-ball.toml")).unwrap();
    let mebibytes = |changes: &[&str]| {
        let set: Vec<&str> = changes.iter().flat_map(|change| ["--set", change]).collect();
        let with = |arguments: &[&str]| {
            let output = sazanami(folder.path(), &[arguments, &set].concat());
            assert!(output.status.success(), "{}", text(&output.stderr));
            output
        };
        let report = with(&["check", "ball.toml", "--json"]);
        let report: serde_json::Value = serde_json::from_slice(&report.stdout).unwrap();
        let foretold = report["report"]["memory_bytes"].as_f64().unwrap() / f64::from(1 << 20);
        let said = text(&with(&["run", "ball.toml", "--verbose", "--threads", "1", "--out", "out"]).stderr);
        std::fs::remove_dir_all(folder.path().join("out")).unwrap();
        let taken = said.rsplit(", ").find_map(|part| part.split_once(" MiB at most")).unwrap().0;
        [foretold, taken.parse().unwrap()]
    };
    let narrow = "grains.0.shape.sphere.diameter=0.3 mm";
    let tension = "fluid.surface_tension=72.8 mN/m";
    let cases: [(&[&str], &[&str]); 3] = [
        (&[], &[tension]),
        (&[narrow], &[narrow, tension]),
        (&[narrow], &[narrow, tension, "fluid.entry_pressure=300 Pa"]),
    ];
    for (without, with) in cases {
        let [without, more] = [without, with].map(mebibytes);
        let [foretold, taken] = [0, 1].map(|n| more[n] - without[n]);
        assert!(taken > 15.0 && (0.8..1.25).contains(&(foretold / taken)), "{with:?}: {foretold} for {taken} MiB");
    }
}
