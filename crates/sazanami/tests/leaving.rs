//! Grains that leave through open sides: counted, with mass and momentum booked, on any ranks and across restarts.

#[allow(dead_code, reason = "every test program uses a part of it")]
mod support;

use std::f64::consts::PI;

use support::{Left, On, Scratch, load, start};

/// Two beads in a stream that runs out of the box; the first leaves within the run, the second does not.
const FLUME: &str = r#"
solver = "mics"
gravity = "0 m/s^2"
[domain]
size = ["20 mm", "8 mm", "8 mm"]
cells = [20, 8, 8]
[boundary]
all = "slip"
x1_lower = { inflow = { velocity = ["0.5 m/s", "0 m/s", "0 m/s"] } }
x1_upper = { fixed_pressure = { fluid = "liquid" } }
[[liquid]]
region.half_space = { point = ["0 m", "0 m", "1 m"] }
velocity = ["0.5 m/s", "0 m/s", "0 m/s"]
allow_touching_grains = true
[material.sand]
density = "2500 kg/m^3"
[[grains]]
name = "sand"
shape.sphere = { diameter = "3 mm" }
placement.list = [
  { position = ["17.2 mm", "4 mm", "4 mm"], velocity = ["0.5 m/s", "0 m/s", "0 m/s"] },
  { position = ["6 mm", "4.1 mm", "4 mm"], velocity = ["0.5 m/s", "0 m/s", "0 m/s"] },
]
[[probe]]
name = "first"
body = { population = "sand", index = 0 }
steps = 1
[output]
fields = { at = [] }
grains = { at = [] }
figures = { at = [] }
[run]
until = "12 ms"
"#;

fn run(name: &str, overrides: &[&str], on: On) -> Left {
    let folder = Scratch::new(name);
    start(&load(FLUME, overrides), &folder.join("run"), on).unwrap_or_else(|error| panic!("{error}"));
    Left::in_folder(&folder.join("run"))
}

fn departed(left: &Left) -> (f64, f64, f64, f64) {
    let conservation = &left.summary["conservation"];
    let number = |name: &str| conservation[name].as_f64().expect("a number");
    let along = conservation["departed_momentum"][0].as_f64().expect("a number");
    (number("departed_grains"), number("departed_mass"), along, number("momentum_residual_relative"))
}

const MASS: f64 = 2500.0 * PI / 6.0 * 2.7e-8;

#[test]
fn grains_that_leave_are_counted_and_their_momentum_is_booked() {
    for exchange in ["stress", "surface"] {
        let left = run(&format!("leaving-{exchange}"), &[&format!("coupling.exchange={exchange}")], On::threads(1));
        let (grains, mass, momentum, residual) = departed(&left);
        assert_eq!(grains, 1.0, "{exchange}");
        // The mesh of the sphere keeps its volume.
        assert!((mass / MASS - 1.0).abs() < 1e-6, "{mass}, not {MASS}");
        assert!((momentum / (0.5 * MASS) - 1.0).abs() < 0.1, "{exchange}: it drifts with the stream: {momentum}");
        assert!(residual < 1e-9, "{exchange}: {residual}");
        let counted = left.column("departed_grains");
        assert!(counted[0] == 0.0 && counted[counted.len() - 1] == 1.0);
        // It goes when its last point has left: 4.3 mm at 0.5 m/s from the start.
        let (time, x) = (left.probes[0].1.column("time"), left.probes[0].1.column("position_1"));
        let last = x.iter().rposition(|x| x.is_finite()).unwrap();
        assert!(
            (0.0205..=0.0222).contains(&x[last]) && (time[last] - 8.6e-3).abs() < 1e-3,
            "{} {}",
            x[last],
            time[last]
        );
    }
}

#[test]
fn walls_for_grains_keep_them() {
    let left = run("leaving-wall", &["dem.grain_walls=[\"x1_upper\"]"], On::threads(1));
    assert_eq!(departed(&left).0, 0.0, "negative control");
}

#[test]
fn leaving_has_the_same_bits_for_threads_and_after_a_restart() {
    for exchange in ["stress", "surface"] {
        let change = format!("coupling.exchange={exchange}");
        let whole = run(&format!("leaving-whole-{exchange}"), &[&change], On::threads(1));
        let threads = run(&format!("leaving-threads-{exchange}"), &[&change], On::threads(2));
        assert_eq!(whole.hash(), threads.hash(), "{exchange}");
        let ranks = run(&format!("leaving-ranks-{exchange}"), &[&change], On::ranks(2, 1));
        assert_eq!(departed(&ranks).0, 1.0);
        let close = (departed(&ranks).2 / departed(&whole).2 - 1.0).abs();
        assert!(close < 1e-6, "{exchange}: {close}");
        let steps = whole.summary["steps"].as_u64().unwrap();
        let folder = Scratch::new(&format!("leaving-again-{exchange}"));
        // Before it left, and after.
        for stop in [steps / 2, steps * 9 / 10] {
            let place = folder.join(&stop.to_string());
            start(&load(FLUME, &[&change]), &place, On::threads(1).steps(stop)).unwrap();
            support::go_on(&place, On::threads(1)).0.unwrap_or_else(|error| panic!("{error}"));
            let again = Left::in_folder(&place);
            assert_eq!(again.hash(), whole.hash(), "{exchange}, from step {stop} of {steps}");
            assert_eq!(departed(&again), departed(&whole));
        }
    }
}

#[test]
fn a_run_goes_on_when_all_have_left() {
    let one = "grains.0.placement.list=[{ position = [\"17.2 mm\", \"4 mm\", \"4 mm\"], velocity = [\"0.5 m/s\", \"0 m/s\", \"0 m/s\"] }]";
    let whole = run("leaving-none", &[one], On::threads(1));
    assert_eq!(departed(&whole).0, 1.0);
    let folder = Scratch::new("leaving-none-again");
    let steps = whole.summary["steps"].as_u64().unwrap();
    start(&load(FLUME, &[one]), &folder.join("run"), On::threads(1).steps(steps * 9 / 10)).unwrap();
    support::go_on(&folder.join("run"), On::threads(1)).0.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(Left::in_folder(&folder.join("run")).hash(), whole.hash());
}
