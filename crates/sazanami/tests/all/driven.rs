//! Flows that a body force drives through periodic sides, by both solvers: the force that holds a mean velocity is the friction.

use std::path::Path;

use crate::support::{Left, On, Scratch, findings, go_on, load, ran, start};
use sazanami_numerics::Real;

/// A viscous liquid between two plates 4 mm apart, at a mean velocity of 10 mm/s along x1.
const PLATES: &str = include_str!("../cases/driven-plates.toml");

/// A grain in that liquid, before its particles.
const GRAIN: &str = r#"
[material.sand]
density = "2500 kg/m^3"
[contact.default]
[[grains]]
shape.sphere = { diameter = "1 mm" }
placement.list = [{ position = ["2 mm", "2 mm", "2 mm"] }]
[particles]"#;

fn left(folder: &Path, overrides: &[&str], steps: Option<u64>) -> Left {
    ran(PLATES, overrides, folder, On { steps, ..On::threads(1) })
}

/// The mean of the last third of a column: the force on moving particles fluctuates by a per cent.
fn late_mean(left: &Left, column: &str) -> Real {
    let all = left.column(column);
    let late = &all[all.len() - all.len() / 3..];
    late.iter().sum::<Real>() / late.len() as Real
}

#[test]
fn the_force_between_plates_is_that_of_poiseuille() {
    let scratch = Scratch::new("plates");
    for (solver, tolerance, until) in [("mics", 1e-3, "0.3 s"), ("mps", 0.06, "0.12 s")] {
        let (word, until) = (format!("solver={solver}"), format!("run.until={until}"));
        let step = "fluid.dt_max=0.3 ms";
        let expected = |nu: Real| {
            // 12 nu U / h^2. On 16 cells the second-order differences give 2/16^2 more velocity.
            let exact = 12.0 * nu * 0.01 / 16e-6;
            if solver == "mics" { exact / (1.0 + 2.0 / 256.0) } else { exact }
        };
        let flow = left(&scratch.join(solver), &[&word, &until, step], None);
        let (speed, force) = (flow.last("mean_velocity_1"), late_mean(&flow, "driving_acceleration_1"));
        assert!((speed / 0.01 - 1.0).abs() < 1e-3, "{solver}: {speed}");
        assert!((force / expected(1e-4) - 1.0).abs() < tolerance, "{solver}: {force} for {}", expected(1e-4));
        assert_eq!((flow.last("driving_acceleration_2"), flow.last("driving_acceleration_3")), (0.0, 0.0));
        let stress = flow.last("driving_stress_1");
        let over_plates = 1000.0 * 4e-3 * flow.last("driving_acceleration_1");
        assert!((stress / over_plates - 1.0).abs() < 1e-9, "{solver}: {stress}");
        // The force stands in the momentum budget, which closes.
        let residual = flow.summary["conservation"]["momentum_residual_relative"].as_f64().expect("a number");
        assert!(residual < 0.01, "{solver}: {residual}");
        // Negative control: half the viscosity takes half the force, and without a velocity to be held nothing moves.
        let thin = left(
            &scratch.join(&format!("{solver}-thin")),
            &[&word, &until, step, "fluid.liquid.kinematic_viscosity=5e-5 m^2/s"],
            None,
        );
        let force = late_mean(&thin, "driving_acceleration_1");
        assert!((force / expected(5e-5) - 1.0).abs() < tolerance, "{solver}: {force} for {}", expected(5e-5));
        let still = left(
            &scratch.join(&format!("{solver}-still")),
            &[&word, "drive={ acceleration = [\"0 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"] }"],
            Some(20),
        );
        assert!(!still.series.columns.iter().any(|column| column == "mean_velocity_1"));
        assert!(still.last("kinetic_energy_fluid") < 1e-20);
    }
}

#[test]
fn a_constant_force_begins_with_the_run() {
    let scratch = Scratch::new("pushed");
    for solver in ["mics", "mps"] {
        let word = format!("solver={solver}");
        let pushed = "drive={ acceleration = [\"3 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"] }";
        let free = "boundary.x3=periodic";
        let flow = left(&scratch.join(solver), &[&word, pushed, free, "run.until=10 ms"], None);
        // Nothing holds the liquid: it moves at 30 mm/s.
        let (mass, speed): (Real, Real) = (1000.0 * 64e-9, 3.0 * 0.01);
        let energy = flow.last("kinetic_energy_fluid");
        assert!((energy / (0.5 * mass * speed * speed) - 1.0).abs() < 1e-6, "{solver}: {energy}");
    }
}

#[test]
fn an_oscillating_force_swings_free_water_without_a_mean_velocity() {
    let scratch = Scratch::new("swung");
    for solver in ["mics", "mps"] {
        let word = format!("solver={solver}");
        let energies = |name: &str, phase: &str| {
            let drive = format!(
                "drive={{ oscillation = {{ amplitude = [\"3 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], frequency = \"25 Hz\", phase = \"{phase}\" }} }}"
            );
            let folder = scratch.join(&format!("{solver}-{name}"));
            let flow = left(&folder, &[&word, &drive, "boundary.x3=periodic", "run.until=20 ms"], None);
            let energy = flow.column("kinetic_energy_fluid");
            [energy[energy.len() / 2], energy[energy.len() - 1]]
        };
        // The speed is `a/omega sin(omega t)`: largest after 10 ms, nothing after 20 ms.
        let (mass, speed): (Real, Real) = (1000.0 * 64e-9, 3.0 / (std::f64::consts::TAU * 25.0));
        let largest = 0.5 * mass * speed * speed;
        let [half, whole] = energies("even", "90 deg");
        assert!((half / largest - 1.0).abs() < 1e-4 && whole < 1e-7 * largest, "{solver}: {half} {whole} {largest}");
        // Negative control: begun at its zero the force leaves a mean velocity, twice the amplitude after half a period.
        let [_, whole] = energies("uneven", "0 deg");
        assert!((whole / (4.0 * largest) - 1.0).abs() < 1e-3, "{solver}: {whole}");
    }
}

#[test]
fn a_gradient_of_pressure_acts_on_grains_by_the_water_that_they_displace() {
    let scratch = Scratch::new("by-volume");
    let text = PLATES.replace("[particles]", GRAIN);
    let driven = |name: &str, drive: &str| {
        let nu = "fluid.liquid.kinematic_viscosity=1e-6 m^2/s";
        let overrides =
            ["solver=mps", drive, nu, "boundary.x3=periodic", "run.until=5 ms", "output.series={ steps = 1 }"];
        ran(&text, &overrides, &scratch.join(name), On::threads(1))
    };
    let momentum = |name: &str, acts_by: &str| {
        let drive =
            format!("drive={{ acceleration = [\"3 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], acts_by = \"{acts_by}\" }}");
        let flow = driven(name, &drive);
        let residual = flow.summary["conservation"]["momentum_residual_relative"].as_f64().expect("a number");
        // Viscosity and pressure do not quite cancel where the void fraction varies.
        assert!(residual < 2e-4, "{acts_by}: {residual}");
        flow.last("momentum_1")
    };
    // Drag and pressure act between water and grain; what both gain comes from outside.
    let volume = std::f64::consts::PI / 6.0 * 1e-9;
    let [by_mass, by_volume] = ["mass", "volume"].map(|by| momentum(by, by));
    let expected = 1500.0 * volume * 3.0 * 5e-3;
    assert!(((by_mass - by_volume) / expected - 1.0).abs() < 0.02, "{by_mass} {by_volume} {expected}");
    // A held mean velocity likewise: by its force, step for step.
    let whole = by_mass / (3.0 * 5e-3);
    for (acts_by, other) in [("volume", false), ("mass", true)] {
        let flow = driven(
            &format!("held-{acts_by}"),
            &format!(
                "drive={{ mean_velocity = [\"5 cm/s\", \"0 m/s\", \"0 m/s\"], answer = \"1 ms\", acts_by = \"{acts_by}\" }}"
            ),
        );
        let pairs = flow.column("driving_acceleration_1").into_iter().zip(flow.column("dt")).skip(1);
        let impulse = pairs.map(|(a, dt)| a * dt).sum::<Real>() * (whole - 1500.0 * volume);
        let off = flow.last("momentum_1") / impulse - 1.0;
        // Negative control: by mass it is more by what the grain is heavier, 1.2 % of all.
        assert_eq!(off.abs() > 3e-3, other, "{acts_by}: {off}");
    }
}

/// Held spheres whose drag stops water within 0.5 ms, and water that is to flow through them at 5 mm/s.
const BED: &str = include_str!("../cases/driven-bed.toml");

#[test]
fn a_mean_velocity_through_a_bed_is_reached_within_a_few_answers() {
    let scratch = Scratch::new("bed");
    // Against the weight of the water.
    for solver in ["mps", "mics"] {
        let driven = |name: &str, answer: &str| {
            let words = [format!("solver={solver}"), "gravity=9.8 m/s^2".to_owned(), format!("drive.answer={answer}")];
            let words = [&words.each_ref().map(String::as_str)[..], &["drive.ramp=50 ms"]].concat();
            ran(BED, &words, &scratch.join(&format!("{solver}-{name}")), On::threads(2))
        };
        let flow = driven("flow", "10 ms");
        let (speed, times) = (flow.column("mean_velocity_3"), flow.column("time"));
        let after = |time: Real| speed[times.iter().position(|t| *t >= time - 1e-9).expect("a row")] / 5e-3;
        // Five answers after the ramp; it does not overshoot.
        assert!(after(0.1) > 0.9 && (after(0.15) - 1.0).abs() < 0.01, "{solver}: {speed:?}");
        assert!(speed[1..].iter().all(|u| *u < 5.1e-3), "{solver}: {speed:?}");
        // Control: an answer ten times as slow is not there.
        assert!(solver == "mics" || driven("slow", "0.1 s").last("mean_velocity_3") < 4e-3, "{solver}");
    }
}

#[test]
fn a_restart_goes_on_with_the_force_as_it_was() {
    let scratch = Scratch::new("driven-restart");
    for solver in ["mics", "mps"] {
        let word = format!("solver={solver}");
        let whole = left(&scratch.join(&format!("{solver}-whole")), &[&word], Some(20));
        let folder = scratch.join(&format!("{solver}-parts"));
        left(&folder, &[&word], Some(8));
        go_on(&folder, On::threads(2).steps(12)).0.expect("the run goes on");
        let parts = Left::in_folder(&folder);
        assert_eq!(whole.hash(), parts.hash(), "{solver}");
        assert_eq!(whole.series, parts.series, "{solver}");
        assert!(whole.last("driving_acceleration_1") != 0.0);
    }
}

#[test]
fn ranks_hold_the_same_flow_and_let_the_same_grain_go() {
    let scratch = Scratch::new("driven-ranks");
    let text = PLATES.replace("[particles]", GRAIN);
    for solver in ["mics", "mps"] {
        let word = format!("solver={solver}");
        let wide = ["domain.size=[\"16 mm\", \"4 mm\", \"4 mm\"]", "domain.cells=[16, 4, 16]"];
        let water = "liquid.0.region.box.upper=[\"16 mm\", \"4 mm\", \"4 mm\"]";
        let inside = "liquid.0.allow_touching_grains=true";
        let exact = if solver == "mps" { "particles.tolerance=1e-12" } else { "fluid.tol_div=1e-10" };
        let release = "grains.0.release=0.5 ms";
        let run = |name: &str, on: On, more: &str| {
            let overrides = [&word, wide[0], wide[1], water, inside, exact, release, more];
            ran(&text, &overrides, &scratch.join(&format!("{solver}-{name}")), on.steps(15))
        };
        let answer = "drive.answer=5 ms";
        let alone = run("alone", On::threads(1), answer);
        let [two, threads] = [run("two", On::ranks(2, 1), answer), run("threads", On::ranks(2, 2), answer)];
        assert_eq!(two.hash(), threads.hash(), "{solver}");
        let difference = |other: &Left| {
            let of = |column: &str| {
                let pairs = alone.column(column).into_iter().zip(other.column(column)).skip(1);
                pairs.map(|(a, b)| (a - b).abs() / a.abs()).fold(0.0, Real::max)
            };
            of("driving_acceleration_1").max(of("mean_velocity_1"))
        };
        assert!(difference(&two) < 1e-6, "{solver}: {}", difference(&two));
        let speed = alone.last("largest_grain_speed");
        assert!(speed > 0.0 && (two.last("largest_grain_speed") / speed - 1.0).abs() < 1e-6, "{solver}: {speed}");
        // Negative control: another time of the answer is seen.
        let other = run("other", On::threads(1), "drive.answer=5.1 ms");
        assert!(difference(&other) > 1e-3, "{solver}: {}", difference(&other));
    }
}

/// A simple cubic lattice of fixed spheres in a box that is periodic all round, and a liquid that is driven through it.
const LATTICE: &str = include_str!("../cases/driven-lattice.toml");

#[test]
fn free_grains_in_a_box_that_is_periodic_all_round_are_refused_gravity() {
    let text = format!(
        "{LATTICE}{}",
        r#"
[domain]
size = ["8.8 mm", "8.8 mm", "8.8 mm"]
[particles]
spacing = "1.1 mm"
dt_max = "1 ms"
[[liquid]]
region.box = { lower = ["0 mm", "0 mm", "0 mm"], upper = ["8.8 mm", "8.8 mm", "8.8 mm"] }
[[grains]]
shape.sphere = { diameter = "1 mm" }
motion = "fixed"
placement.lattice = { counts = [8, 8, 8] }
[run]
until = "0.1 s"
"#
    );
    // Free grains would fall without end under gravity, but not where nothing pulls them.
    let titles = |more: &[&str]| findings(&text, &[&["solver=mps"], more].concat());
    let free = "grains.0.motion=free";
    assert!(titles(&[free]).is_empty());
    assert!(titles(&[free, "gravity=9.81 m/s^2"])[0].contains("everything falls along x3 without end"));
    assert!(titles(&["gravity=9.81 m/s^2"]).is_empty());
}

#[test]
fn flows_that_cannot_be_driven_are_refused() {
    let velocity = |x3: &str| format!("drive.mean_velocity=[\"10 mm/s\", \"0 m/s\", \"{x3}\"]");
    for (change, words) in [
        (velocity("1 mm/s"), "goes through the sides of x3"),
        ("boundary.x1=no_slip".to_owned(), "goes through the sides of x1"),
        ("drive.above=4 mm".to_owned(), "`above` lies outside the box"),
        ("drive.answer=0.3 ms".to_owned(), "shorter than four steps"),
        ("drive={}".to_owned(), "mean_velocity"),
    ] {
        for solver in ["solver=mics", "solver=mps"] {
            let found = findings(PLATES, &[&change, solver]);
            assert!(found.len() == 1 && found[0].contains(words), "{change}, {solver}: {found:#?}");
        }
    }
    assert!(findings(PLATES, &[&velocity("0 m/s")]).is_empty());
    let empty = "liquid.0.region.box.upper=[\"4 mm\", \"4 mm\", \"2 mm\"]";
    let found = findings(PLATES, &[empty, "drive.above=3 mm"]);
    assert!(found.len() == 1 && found[0].contains("there is no water above `above`"), "{found:#?}");
    // A gradient of pressure acts on grains that water overlaps, along periodic sides.
    let by_volume = "drive.acts_by=volume";
    let upwards = "drive.acceleration=[\"0 m/s^2\", \"0 m/s^2\", \"1 m/s^2\"]";
    let found = findings(PLATES, &["solver=mps", by_volume, upwards]);
    assert!(found.len() == 1 && found[0].contains("a gradient of pressure along x3 does nothing"), "{found:#?}");
    for solver in ["solver=mps", "solver=mics"] {
        assert!(findings(PLATES, &[solver, by_volume]).is_empty());
    }
}

/// A bead in hardly any gas in a box that is shaken: it stays where it is, so that in the box it swings.
const SHAKEN: &str = include_str!("../cases/driven-shaken.toml");

#[test]
fn steps_follow_what_shakes_the_box() {
    let scratch = Scratch::new("shaken");
    // In the frame of the box the bead's velocity is -(a/w) (1 - cos w t): its mean takes it along, its swing is a/w^2.
    let [amplitude, turn]: [Real; 2] = [200.0, 2.0 * std::f64::consts::PI * 1000.0];
    let off = |name: &str, overrides: &[&str]| {
        let left = ran(SHAKEN, overrides, &scratch.join(name), On::threads(1));
        let probe = left.probe("bead");
        let (times, places) = (probe.column("time"), probe.column("position_1"));
        let exact = |time: Real| 0.2 - amplitude / turn * (time - (turn * time).sin() / turn);
        let worst = times.iter().zip(&places).map(|(&time, &place)| (place - exact(time)).abs()).fold(0.0, Real::max);
        (worst / (amplitude / turn.powi(2)), left.summary["limiter"].clone())
    };
    let (error, limiter) = off("follows", &[]);
    assert!(error < 0.01, "{error}");
    assert!(limiter["swing"].as_u64().is_some_and(|steps| steps > 100), "{limiter}");
    // Negative control: steps of a tenth of a period, right in the velocity at their ends, have another way between.
    let (error, limiter) = off("fixed", &["fluid.dt=\"0.1 ms\""]);
    assert!(error > 0.02 && limiter["swing"].is_null(), "{error} {limiter}");
}

/// Water in a box that starts to swing within less than a step.
const JERKED: &str = include_str!("../cases/driven-jerked.toml");

#[test]
fn a_start_within_a_step_leaves_the_water_where_it_was() {
    let scratch = Scratch::new("jerked");
    for solver in ["mics", "mps"] {
        let case = load(JERKED, &[&format!("solver={solver}")]);
        let folder = scratch.join(solver);
        start(&case, &folder, On::threads(2)).unwrap_or_else(|error| panic!("{error}"));
        let left = Left::in_folder(&folder);
        let probe = left.probe("water");
        for (time, speed) in probe.column("time").into_iter().zip(probe.column("velocity_1")).skip(1) {
            let expected = -case.case.tank_at(time)[1].x;
            assert!((speed - expected).abs() < 0.01 * 0.0628, "{solver}, {time}: {speed} {expected}");
        }
        // Negative control: the acceleration in the middle of the first step is not that of its mean.
        let step = left.column("dt").into_iter().fold(0.0, Real::max);
        let [_, reached, _] = case.case.tank_at(step);
        let [.., middle] = case.case.tank_at(0.5 * step);
        assert!((middle.x * step - reached.x).abs() > 0.02 * reached.x.abs(), "{solver}: {middle} {reached}");
    }
}

/// A bead that is free and one that is held, dry, in a box that swings.
const BEADS: &str = include_str!("../cases/driven-beads.toml");

#[test]
fn what_is_at_rest_stays_where_it_was_when_the_box_begins_with_a_speed() {
    let scratch = Scratch::new("begun");
    let record = |name: &str, place: &dyn Fn(Real) -> Real| {
        let rows = (0..=50).map(|n| 0.02 * Real::from(n)).map(|t| format!("{t},{}\n", place(t)));
        let path = scratch.join(name);
        std::fs::write(&path, std::iter::once("t_s,x_m\n".to_owned()).chain(rows).collect::<String>()).unwrap();
        format!("frame.motion={{ file = \"{}\" }}", path.display())
    };
    let turn = 2.0 * std::f64::consts::PI * 2.0;
    let resting = record("resting.csv", &|t| 0.03 * (0.5 * turn * t).sin().powi(2));
    let moving = record("moving.csv", &|t| 5e-3 * (turn * t).sin());
    let sudden = "frame.motion.ramp=0 s";
    // The motion, and the speed with which water and a free bead begin in the box: what they have is that of the box, negative.
    for (name, motion, expected) in [
        ("formula", sudden, -5e-3 * turn),
        ("moving", &moving, -5e-3 * turn),
        ("resting", &resting, 0.0),
        // Negative control: a box that rises from rest gives them no speed at the start.
        ("ramp", "frame.motion.ramp=0.1 s", 0.0),
    ] {
        for solver in ["mics", "mps"] {
            let word = format!("solver={solver}");
            let of = |text: &str, what: &str| {
                let case = load(text, &[&word, motion]);
                let folder = scratch.join(&format!("{name}-{what}-{solver}"));
                start(&case, &folder, On::threads(2)).unwrap_or_else(|error| panic!("{error}"));
                let left = Left::in_folder(&folder);
                let probe = left.probe(what);
                for (time, speed) in probe.column("time").into_iter().zip(probe.column("velocity_1")) {
                    let there = -case.case.tank_at(time)[1].x;
                    assert!((speed - there).abs() < 0.01 * 0.0628, "{name} {what} {solver}, {time}: {speed} {there}");
                }
                let first = probe.column("velocity_1")[0];
                assert!((first - expected).abs() < 1e-3 * 0.0628, "{name} {what} {solver}: {first} {expected}");
                left
            };
            of(JERKED, "water");
            let left = of(BEADS, "free");
            // What is held goes with the box.
            assert!(left.probe("held").column("velocity_1").iter().all(|speed| *speed == 0.0), "{name} {solver}");
            if solver == "mics" {
                let residual = left.summary["conservation"]["momentum_residual_relative"].as_f64();
                assert!(residual.is_some_and(|residual| residual < 1e-6), "{name}: {residual:?}");
                // Without liquid there is no volume of it.
                assert!(left.summary["conservation"]["liquid_volume_relative_change"].is_null(), "{name}");
            }
        }
    }
}

#[test]
fn velocities_of_a_box_that_begins_with_a_speed_are_those_of_the_laboratory() {
    let scratch = Scratch::new("begun-given");
    let speed = 5e-3 * 2.0 * std::f64::consts::PI * 2.0;
    for solver in ["mics", "mps"] {
        let word = format!("solver={solver}");
        let given = "fluid.initial_velocity.uniform={ velocity = [\"0.2 m/s\", \"0 m/s\", \"0 m/s\"] }";
        let first = |name: &str, more: &[&str]| {
            let words = [&[&word, "frame.motion.ramp=0 s", "run.until=10 ms"], more].concat();
            let left = ran(JERKED, &words, &scratch.join(&format!("{solver}-{name}")), On::threads(1));
            left.probe("water").column("velocity_1")[0]
        };
        let (with, without) = (first("given", &[given]), first("none", &[]));
        assert!(
            (with - (0.2 - speed)).abs() < 1e-3 * speed && (without + speed).abs() < 1e-3 * speed,
            "{with} {without}"
        );
        // Written as seen from the laboratory it is what was given.
        let seen = first("seen", &[given, "output.frame=laboratory"]);
        assert!((seen - 0.2).abs() < 1e-3 * speed, "{solver}: {seen}");
    }
    // A run that goes on from its checkpoint does not begin again.
    let (whole, parts) = (scratch.join("whole"), scratch.join("parts"));
    let overrides = ["solver=mics", "frame.motion.ramp=0 s", "run.until=10 ms"];
    let left = ran(JERKED, &overrides, &whole, On::threads(1));
    ran(JERKED, &overrides, &parts, On { steps: Some(2), ..On::threads(1) });
    go_on(&parts, On::threads(1)).0.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(Left::in_folder(&parts).summary["state_hash"], left.summary["state_hash"]);
}
