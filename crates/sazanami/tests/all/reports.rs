//! Small cases posed from what users of other programs report in public; each names the report.

use std::f64::consts::PI;

use crate::support::{Left, On, Scratch, go_on_with, ran};

fn run(name: &str, text: &str, overrides: &[&str]) -> Left {
    ran(text, overrides, &Scratch::new(name).join("run"), On::threads(1))
}

fn largest(left: &Left, column: &str) -> f64 {
    left.column(column).iter().fold(0.0, |a: f64, b| a.max(b.abs()))
}

/// Beads that come in across the seam of periodic sides.
const SEAM: &str = include_str!("../cases/reports-seam.toml");

/// lammps/lammps#1695: grains that are inserted overlap others across a periodic side; #4337: their number is wrong in small boxes.
#[test]
fn grains_that_are_fed_in_do_not_overlap_across_periodic_sides() {
    let left = run("report-seam", SEAM, &[]);
    let fed = left.last("fed_grains");
    // One each 1.7 ms, in a stream in which they have a tenth of the room that discs have: some wait.
    assert!((9.0..=12.0).contains(&fed), "{fed}");
    assert!(largest(&left, "largest_overlap") < 0.02);
}

/// lammps/lammps#2644: a run that goes on feeds in what it should not, or nothing.
#[test]
fn a_longer_run_is_fed_as_long() {
    let sparse = ["grains.0.placement.fed.rate=100 Hz"];
    let count = |left: &Left| left.summary["conservation"]["fed_grains"].as_f64().expect("a number");
    let folder = Scratch::new("report-longer");
    let go_on = |name: &str, more: &[&str]| {
        let place = folder.join(name);
        let first = count(&ran(SEAM, &[&sparse[..], more].concat(), &place, On::threads(1)));
        let mut options = On::threads(1).options(None);
        options.until = Some(40e-3);
        go_on_with(&place, &options).0.unwrap_or_else(|error| panic!("{error}"));
        [first, count(&Left::in_folder(&place))]
    };
    assert_eq!(go_on("open", &[]), [2.0, 4.0]);
    assert_eq!(go_on("bounded", &["grains.0.count=2"]), [2.0, 2.0], "negative control");
}

/// Balls without water.
const BALLS: &str = include_str!("../cases/reports-balls.toml");

/// lammps/lammps#3025: of unlike sizes no dashpot gives the restitution that is asked for.
#[test]
fn the_restitution_asked_for_holds_between_balls_of_one_and_twenty() {
    let measured = |restitution: f64| {
        let change = format!("contact.default.restitution={restitution}");
        let left = run(&format!("report-unlike-{restitution}"), BALLS, &[&change]);
        let speed = |n: usize| left.probes[n].1.last("velocity_1");
        speed(1) - speed(0)
    };
    for restitution in [0.2, 0.4, 0.9] {
        let found = measured(restitution);
        // Twice the mean error of impacts that sub-steps may have where no other is asked for: it is one impact.
        assert!((found - restitution).abs() < 0.05, "{found} for {restitution}");
    }
    assert!(measured(0.6) > measured(0.3) + 0.2, "negative control: another one is told from it");
}

/// DualSPHysics/DualSPHysics#44: balls as stiff as steel make the steps unstable.
#[test]
fn stiff_balls_that_fall_on_one_another_gain_no_energy() {
    let place = |n: usize| {
        let (x, z) = (30.0 + 2.0 * (n % 3) as f64, 8.0 + 11.0 * n as f64);
        format!("{{ position = [\"{x} mm\", \"30 mm\", \"{z} mm\"] }}")
    };
    let places = (0..6).map(place).collect::<Vec<_>>().join(", ");
    let list = format!("grains.0.placement.list=[{places}]");
    let more = [
        "gravity=9.8 m/s^2",
        "contact.default.normal_stiffness=1e7 N/m",
        "domain.size=[\"100 mm\", \"60 mm\", \"80 mm\"]",
        "run.until=60 ms",
    ];
    let left = run("report-steel", BALLS, &[&more[..], &[&list]].concat());
    // The potential energy is that of submerged grains.
    let weight = 7800.0 / (7800.0 - 998.2);
    let (moving, lying) = (left.column("kinetic_energy_grains"), left.column("potential_energy"));
    let energy: Vec<f64> = moving.iter().zip(lying).map(|(moving, lying)| moving + weight * lying).collect();
    let first = energy[0];
    let most = energy.iter().copied().fold(0.0, f64::max);
    assert!(most <= first * (1.0 + 1e-4), "{most} J of {first}");
    assert!(energy[energy.len() - 1] < 0.95 * first, "they do fall");
    assert!(largest(&left, "largest_overlap") < 0.05);
}

/// DLR-RY/TwoPhaseFlow#44: parasitic currents carry bubbles of micrometres about.
#[test]
fn a_bubble_of_micrometres_stays_in_its_place() {
    let text = r#"
solver = "mics"
gravity = "0 m/s^2"
[domain]
size = ["150 um", "150 um", "150 um"]
cells = [20, 20, 20]
[fluid]
surface_tension = "72.8 mN/m"
[[liquid]]
region.half_space = { point = ["0 m", "0 m", "1 m"] }
[[liquid]]
fluid = "gas"
region.sphere = { centre = ["76 um", "74 um", "75 um"], diameter = "60 um" }
[output]
fields = { at = [] }
figures = { at = [] }
[run]
until = "0.1 ms"
"#;
    let left = run("report-bubble", text, &[]);
    // Momentum that the liquid has goes back where the bubble comes from: its way over a cell, at most.
    let way = |left: &Left| {
        let (time, momentum) = (left.column("time"), left.column("momentum_liquid_3"));
        let displaced = 998.2 * PI / 6.0 * 60e-6_f64.powi(3);
        time.windows(2).zip(&momentum[1..]).map(|(t, p)| (t[1] - t[0]) * p / displaced).sum::<f64>().abs() / 7.5e-6
    };
    assert!(way(&left) < 0.05, "{} cells", way(&left));
    // Negative control: buoyancy of 1e5 m/s^2 moves it.
    let heavy = run("report-bubble-rises", text, &["gravity=1e5 m/s^2", "run.until=20 us"]);
    assert!(way(&heavy) > 0.5, "{} cells", way(&heavy));
}
