//! Grains that are fed in through sides of the box and leave through others: counted, with mass and momentum booked, on any ranks and across restarts.

use std::f64::consts::PI;

use sazanami::run::RunOptions;

use crate::support::{Left, On, Scratch, findings, go_on, go_on_with, heard, load, ran};

/// Beads that a stream carries in and out again.
const STREAM: &str = include_str!("../cases/feeding-stream.toml");

fn run(name: &str, overrides: &[&str], on: On) -> Left {
    ran(STREAM, overrides, &Scratch::new(name).join("run"), on)
}

/// Number, mass \[kg] and momentum along x1 [N s] of what passed, `fed` or `departed`.
fn passed(left: &Left, how: &str) -> [f64; 3] {
    let conservation = &left.summary["conservation"];
    let number = |name: &str| conservation[format!("{how}_{name}")].as_f64().expect("a number");
    let along = conservation[format!("{how}_momentum")][0].as_f64().expect("a number");
    [number("grains"), number("mass"), along]
}

#[test]
fn grains_that_are_fed_in_are_counted_and_their_momentum_is_booked() {
    for exchange in ["stress", "surface"] {
        let left = run(&format!("feeding-{exchange}"), &[&format!("coupling.exchange={exchange}")], On::threads(1));
        let [grains, mass, momentum] = passed(&left, "fed");
        assert_eq!(grains, 3.0, "{exchange}: at 0, 8.3 and 16.7 ms");
        let one = 2500.0 * PI / 6.0 * 8e-9;
        assert!((mass / (3.0 * one) - 1.0).abs() < 0.3, "{mass}");
        assert!((momentum / (0.4 * mass) - 1.0).abs() < 1e-12, "{exchange}: {momentum}");
        assert_eq!(passed(&left, "departed")[0], 3.0, "{exchange}: the box is 35 ms long");
        assert!((passed(&left, "departed")[1] / mass - 1.0).abs() < 1e-12);
        let drift = passed(&left, "departed")[2] / momentum;
        assert!((drift - 1.0).abs() < 0.1, "{exchange}: they drift with the stream: {drift}");
        let residual = left.summary["conservation"]["momentum_residual_relative"].as_f64().expect("a number");
        assert!(residual < 1e-8, "{exchange}: {residual}");
        let counted = left.column("fed_grains");
        assert!(counted[0] == 0.0 && counted[counted.len() - 1] == 3.0);
        // The second comes in at its time, is carried in, and then goes with the stream.
        let probe = &left.probes[0].1;
        let (time, x) = (probe.column("time"), probe.column("position_1"));
        let first = x.iter().position(|x| x.is_finite()).expect("it comes");
        assert!((8.3e-3..9.3e-3).contains(&time[first]) && x[first] < 0.0, "{} {}", time[first], x[first]);
        let later = time.iter().position(|time| *time > 18e-3).expect("the run is longer");
        assert!((x[later] - (x[first] + 0.4 * (time[later] - time[first]))).abs() < 0.3e-3);
        // It goes when its last point has left.
        let last = x.iter().rposition(|x| x.is_finite()).expect("it was there");
        assert!((0.0128..=0.0134).contains(&x[last]), "{} {}", x[last], time[last]);
        assert!(last + 1 < x.len(), "the run goes on when all have left");
    }
    // Negative control: none is fed in where none is asked for.
    let left = run("feeding-later", &["grains.0.placement.fed.from=15 ms", "probe=[]"], On::threads(1));
    assert_eq!(passed(&left, "fed")[0], 1.0);
    // Negative control: walls for grains keep them.
    let left = run("feeding-wall", &["dem.grain_walls=[\"x1_upper\"]"], On::threads(1));
    assert_eq!(passed(&left, "departed")[0], 0.0);
}

#[test]
fn feeding_has_the_same_bits_for_threads_and_after_a_restart() {
    for exchange in ["stress", "surface"] {
        let change = format!("coupling.exchange={exchange}");
        let whole = run(&format!("feeding-whole-{exchange}"), &[&change], On::threads(1));
        let threads = run(&format!("feeding-threads-{exchange}"), &[&change], On::threads(2));
        assert_eq!(whole.hash(), threads.hash(), "{exchange}");
        let ranks = run(&format!("feeding-ranks-{exchange}"), &[&change], On::ranks(2, 1));
        assert_eq!(passed(&ranks, "fed"), passed(&whole, "fed"));
        let [gone, one] = [&ranks, &whole].map(|left| passed(left, "departed"));
        assert!(gone[0] == 3.0 && (gone[2] / one[2] - 1.0).abs() < 1e-6, "{exchange}: {gone:?} {one:?}");
        let steps = whole.summary["steps"].as_u64().unwrap();
        let folder = Scratch::new(&format!("feeding-again-{exchange}"));
        // While one is carried in, before the first has left, and after the last.
        for stop in [2, steps / 2, steps * 9 / 10] {
            let place = folder.join(&stop.to_string());
            ran(STREAM, &[&change], &place, On::threads(1).steps(stop));
            go_on(&place, On::threads(1)).0.unwrap_or_else(|error| panic!("{error}"));
            let again = Left::in_folder(&place);
            assert_eq!(again.hash(), whole.hash(), "{exchange}, from step {stop} of {steps}");
            for how in ["fed", "departed"] {
                assert_eq!(passed(&again, how), passed(&whole, how));
            }
        }
    }
}

#[test]
fn grains_wait_until_there_is_room() {
    // One stands in the only way in.
    let narrow = [
        "grains.0.placement.fed.rate=100 Hz",
        "grains.0.placement.fed.lower=[\"0 m\", \"2.8 mm\", \"0 m\"]",
        "grains.0.placement.fed.upper=[\"0 m\", \"5.2 mm\", \"2.4 mm\"]",
    ];
    let post = "\n[[grains]]\nname = \"post\"\nshape.sphere = { diameter = \"2 mm\" }\nmotion = \"fixed\"\nplacement.list = [{ position = [\"1.5 mm\", \"4 mm\", \"1.2 mm\"] }]\n";
    let text = STREAM.replace("[[probe]]", &format!("{post}[[probe]]"));
    let fed =
        |text: &str, name: &str| passed(&ran(text, &narrow, &Scratch::new(name).join("run"), On::threads(1)), "fed")[0];
    assert_eq!(fed(&text, "feeding-full"), 0.0);
    assert_eq!(fed(STREAM, "feeding-free"), 2.0, "negative control");
}

#[test]
fn feeds_that_cannot_be_are_refused() {
    let refused = |more: &[&str], what: &str| {
        let found = findings(STREAM, more);
        assert!(found.iter().any(|title| title.contains(what)), "{what}: {found:?}");
    };
    assert!(findings(STREAM, &[]).is_empty());
    refused(&["grains.0.placement.fed.side=x2_lower"], "do not come in through x2_lower");
    refused(
        &["grains.0.placement.fed.side=x2_lower", "grains.0.placement.fed.velocity=[\"0 m/s\", \"1 m/s\", \"0 m/s\"]"],
        "cannot be fed in through x2_lower",
    );
    refused(&["grains.0.placement.fed.rate=20 kHz"], "more grains are fed in than have room");
    refused(&["grains.0.placement.fed.upper=[\"0 m\", \"1 mm\", \"8 mm\"]"], "wider than the part");
    refused(&["grains.0.placement.fed.upper=[\"0 m\", \"9 mm\", \"8 mm\"]"], "no part of the side");
    refused(&["grains.0.placement.fed.from=30 ms"], "ends before it begins");
    refused(&["grains.0.motion=fixed"], "move by the forces on them");
    refused(&["grains.0.release=1 ms"], "not held until a time");
}

#[test]
fn spheres_among_moving_particles_are_fed_in_and_leave() {
    let tank = [
        "solver=mps",
        "domain.size=[\"16 mm\", \"16 mm\", \"20 mm\"]",
        "particles={ spacing = \"2 mm\" }",
        "boundary={ all = \"slip\", x1_upper = \"outflow\", x3_upper = \"outflow\" }",
        "liquid=[]",
        "grains.0.placement.fed.side=x3_upper",
        "grains.0.placement.fed.velocity=[\"0.5 m/s\", \"0 m/s\", \"-0.3 m/s\"]",
        "run.until=60 ms",
    ];
    let with = |name: &str, more: &[&str]| run(name, &[&tank[..], more].concat(), On::threads(1));
    let left = with("feeding-particles", &[]);
    let ([fed, ..], [gone, mass, momentum]) = (passed(&left, "fed"), passed(&left, "departed"));
    assert!(fed == 3.0 && gone > 0.0 && mass > 0.0 && momentum > 0.0, "{fed} {gone} {mass} {momentum}");
    let whole = with("feeding-particles-whole", &["run.until=30 ms"]);
    let again = Scratch::new("feeding-particles-again");
    let half = On::threads(1).steps(whole.summary["steps"].as_u64().unwrap() / 2);
    ran(STREAM, &[&tank[..], &["run.until=30 ms"]].concat(), again.path(), half);
    go_on(again.path(), On::threads(2)).0.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(Left::in_folder(again.path()).hash(), whole.hash());
    // Negative control: behind walls for grains none leaves.
    let kept = with(
        "feeding-particles-kept",
        &["dem.grain_walls=[\"x1_lower\", \"x1_upper\", \"x2_lower\", \"x2_upper\", \"x3_lower\"]"],
    );
    assert_eq!(passed(&kept, "departed")[0], 0.0);
}

#[test]
fn grains_that_find_no_room_are_told() {
    const STONES: &str = "[[grains]]\nname = \"stone\"\nmotion = \"fixed\"\nshape.sphere.diameter = \"2 mm\"\n\
        placement.lattice = { upper = [\"2 mm\", \"8 mm\", \"8 mm\"], counts = [1, 4, 4] }\n";
    let said = |name: &str, stones: &str| {
        let scratch = Scratch::new(name);
        let ends = if name == "feeding-end" {
            ["run.until=8 ms", "grains.0.placement.fed.rate=125 Hz"]
        } else {
            ["run.until=9 ms", "grains.0.placement.fed.rate=120 Hz"]
        };
        let loaded = load(&format!("{STREAM}{stones}"), &[&ends[..], &["probe=[]"]].concat());
        heard(&loaded, &On::threads(1).options(Some(&scratch.join("run")))).messages
    };
    let waits = |said: &[String]| {
        said.iter().any(|text| text.contains("are not fed in, as there is no room at their side: 2;"))
    };
    let blocked = said("feeding-blocked", STONES);
    assert!(waits(&blocked), "{blocked:?}");
    // Negative controls: without stones they come in, and one that is due at the end has not been tried.
    assert!(said("feeding-end", "").iter().all(|text| !text.contains("not fed in")));
    assert!(!waits(&said("feeding-clear", "")));
}

#[test]
fn a_feed_that_was_lengthened_with_its_run_goes_on_from_an_earlier_checkpoint() {
    let scratch = Scratch::new("feeding-lengthened");
    let folder = scratch.join("run");
    let endless = STREAM.replace("until = \"20 ms\"\n", "");
    ran(&endless, &["run.until=4 ms", "probe=[]"], &folder, On::threads(1));
    let kept = std::fs::read_dir(folder.join("checkpoints")).unwrap().flatten().map(|entry| entry.path());
    let kept: Vec<_> = kept.map(|path| (std::fs::read(&path).unwrap(), path)).collect();
    let longer = RunOptions { until: Some(10e-3), ..On::threads(1).options(None) };
    let whole = go_on_with(&folder, &longer).0.expect("it goes on");
    assert_eq!(passed(&Left::in_folder(&folder), "fed")[0], 2.0, "at 0 and 8.3 ms");
    let hash = Left::in_folder(&folder).hash().to_owned();
    // Killed before a checkpoint of the longer run: the case in the folder has its end already.
    std::fs::remove_dir_all(folder.join("checkpoints")).unwrap();
    std::fs::create_dir(folder.join("checkpoints")).unwrap();
    kept.iter().for_each(|(bytes, path)| std::fs::write(path, bytes).unwrap());
    assert_eq!(go_on(&folder, On::threads(1)).0.expect("it goes on").status, whole.status);
    assert_eq!(Left::in_folder(&folder).hash(), hash);
}
