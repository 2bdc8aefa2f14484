//! Gravity along open and periodic sides of the grid: what is at rest stays at rest, what is between falls through the rest.

use crate::support::{Left, On, Scratch, findings, go_on, ran, refusal};
use sazanami_numerics::Real;

const BOX: &str = include_str!("../cases/open-sides-box.toml");
/// A drop on a bed of grains between walls.
const DROP: &str = include_str!("../cases/equivalence-drop-on-bed.toml");

fn largest(left: &Left, column: &str) -> Real {
    left.column(column).into_iter().filter(|value| value.is_finite()).fold(0.0, |a: Real, b| a.max(b.abs()))
}

/// Liquid on the side of a plane at `point` \[mm] that its `normal` points away from.
fn below(point: [Real; 3], normal: [Real; 3]) -> String {
    let [x, y, z] = point.map(|x| format!("\"{x} mm\""));
    format!("liquid=[{{ region.half_space = {{ point = [{x}, {y}, {z}], normal = {normal:?} }} }}]")
}

fn open(sides: &str) -> String {
    format!("boundary={{ all = \"no_slip\", {sides} }}")
}

#[test]
fn fluids_at_rest_beside_open_sides_stay_at_rest() {
    let scratch = Scratch::new("open-rest");
    let up = [0.0, 0.0, 1.0];
    let pool = below([0.0, 0.0, 43.0], up);
    let full = below([0.0, 0.0, 1e3], up);
    let along = "gravity=[\"9.81 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]";
    let tilted = "gravity=[\"3 m/s^2\", \"-2 m/s^2\", \"-9 m/s^2\"]";
    let liquid = "{ fixed_pressure = { fluid = \"liquid\", pressure = \"70 Pa\" } }";
    let all_round = "x1 = \"outflow\", x2 = \"outflow\", x3_upper = \"outflow\"";
    let cases: Vec<(&str, Vec<String>)> = vec![
        ("gas", vec![open("x1_upper = \"outflow\"")]),
        ("gas, all sides", vec![open("all = \"outflow\"").replace("all = \"no_slip\", ", "")]),
        ("gas, tilted", vec![open(all_round), tilted.to_owned()]),
        ("full", vec![open(&format!("x1_upper = {liquid}")), full.clone()]),
        (
            "full, tilted",
            vec![open(&format!("x1 = {liquid}, x2 = {liquid}, x3_upper = {liquid}")), full, tilted.to_owned()],
        ),
        ("pool", vec![open("x1_upper = \"outflow\""), pool.clone()]),
        ("pool, all round", vec![open(all_round), pool.clone()]),
        ("pool beside liquid", vec![open(&format!("x2_lower = {liquid}")), pool.clone()]),
        (
            "pool along x1",
            vec![
                open("x3 = \"outflow\", x2_upper = \"outflow\""),
                below([57.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
                along.to_owned(),
            ],
        ),
        ("pool, periodic", vec![open("x1 = \"outflow\", x2 = \"periodic\""), pool.clone()]),
    ];
    for (n, (name, overrides)) in cases.iter().enumerate() {
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
        let left = ran(BOX, &overrides, &scratch.join(&n.to_string()), On::threads(1));
        let energy = largest(&left, "kinetic_energy_fluid");
        assert!(energy < 1e-22, "{name}: {energy}");
    }
    // Negative control: the same pool beside a wall that has been taken away on one side only to gas that does not stand there.
    let falls = ran(
        BOX,
        &[&open("x1_upper = \"outflow\", x3_lower = \"outflow\""), &pool],
        &scratch.join("falls"),
        On::threads(1),
    );
    assert!(largest(&falls, "kinetic_energy_fluid") > 1e-3);
}

#[test]
fn a_full_box_spills_over_its_open_top_when_it_is_tilted() {
    let scratch = Scratch::new("open-spills");
    let full = below([0.0, 0.0, 1e3], [0.0, 0.0, 1.0]);
    let energy = |name: &str, gravity: &str, sides: &str| {
        let keys = [&open(sides)[..], &full, &format!("gravity={gravity}"), "run.until=20 ms"];
        largest(&ran(BOX, &keys, &scratch.join(name), On::threads(1)), "kinetic_energy_fluid")
    };
    let tilted = "[\"1.7 m/s^2\", \"0 m/s^2\", \"-9.65 m/s^2\"]";
    let spilling = energy("top", tilted, "x3_upper = \"outflow\"");
    // Half a litre, the upper part of which falls along the top: some centimetres a second.
    assert!((1e-6..1e-3).contains(&spilling), "{spilling}");
    // Negative controls: a box that stands level, and a closed one.
    let [level, closed] =
        [energy("level", "9.81 m/s^2", "x3_upper = \"outflow\""), energy("closed", tilted, "x3_upper = \"slip\"")];
    assert!(level < 1e-18 && closed < 1e-18, "{level} {closed}");
}

#[test]
fn a_bath_below_holds_a_column_whatever_the_longest_step() {
    let scratch = Scratch::new("open-bath");
    let pool = below([0.0, 0.0, 43.0], [0.0, 0.0, 1.0]);
    // What stands 43 mm high and has gas at its surface, at the height of the lid; 1 and 1000 kg/m^3.
    let energy = |pressure: Real, longest: &str| {
        let floor = format!("{{ fixed_pressure = {{ fluid = \"liquid\", pressure = \"{pressure} Pa\" }} }}");
        let sides = open(&format!("x3_upper = \"outflow\", x3_lower = {floor}"));
        let folder = scratch.join(&format!("{longest} {pressure}"));
        let longest = format!("fluid.dt_max={longest}");
        largest(
            &ran(BOX, &[&sides, &pool, &longest, "run.until=5 ms"], &folder, On::threads(1)),
            "kinetic_energy_fluid",
        )
    };
    let held = -999.0 * 9.81 * 0.057;
    for longest in ["1 ms", "1 s"] {
        let energy = energy(held, longest);
        assert!(energy < 1e-18, "{longest}: {energy}");
    }
    // Negative control: a centimetre more lifts it, as little as it has had time for.
    let [short, long] = ["1 ms", "1 s"].map(|longest| energy(held + 98.1, longest));
    assert!(short > 1e-6 && (long / short - 1.0).abs() < 0.2, "{short} {long}");
}

#[test]
fn layers_that_flow_through_keep_their_profile() {
    let scratch = Scratch::new("open-layers");
    let velocity = "velocity = [\"0.2 m/s\", \"0 m/s\", \"0 m/s\"]";
    let layers = format!(
        "liquid=[{{ region.half_space = {{ point = [\"0 m\", \"0 m\", \"37.5 mm\"] }}, {velocity} }}, {{ fluid = \"gas\", region.box = {{ lower = [\"0 m\", \"0 m\", \"37.5 mm\"], upper = [\"0.1 m\", \"0.05 m\", \"0.1 m\"] }}, {velocity} }}]"
    );
    let sides = "boundary={ all = \"slip\", x1 = \"outflow\" }";
    let left = ran(BOX, &[sides, &layers, "run.until=0.5 s"], &scratch.join("layers"), On::threads(1));
    let energy = left.column("kinetic_energy_fluid");
    let water: Real = 0.5 * 1000.0 * 0.1 * 0.05 * 0.0375 * 0.04;
    assert!(
        (energy[0] / water - 1.0).abs() < 2e-3 && energy.iter().all(|e| (e / energy[0] - 1.0).abs() < 1e-8),
        "{energy:?}"
    );
    // A box's length has gone through: what comes in is what stands outside.
    assert!(largest(&left, "liquid_volume_relative_change") < 1e-9);
}

#[test]
fn a_viscous_film_runs_down_a_slope_beside_its_exact_profile() {
    let scratch = Scratch::new("open-film");
    let text = format!(
        "{}\n[[probe]]\nname = \"film\"\nline = {{ from = [\"50 mm\", \"25 mm\", \"0.25 mm\"], to = [\"50 mm\", \"25 mm\", \"4.75 mm\"], points = 10 }}\n",
        BOX.replace("\"0.1 m\"]", "\"10 mm\"]").replace("8, 4, 8", "4, 2, 20")
    );
    let (g, nu, h): (Real, Real, Real) = (9.81, 1e-3, 5e-3);
    let slope: Real = 10.0_f64.to_radians();
    let gravity = format!("gravity=[\"{} m/s^2\", \"0 m/s^2\", \"{} m/s^2\"]", g * slope.sin(), -g * slope.cos());
    let sides = "boundary={ all = \"slip\", x1 = \"outflow\", x3_upper = \"outflow\", x3_lower = \"no_slip\" }";
    let fluids = [
        "fluid.liquid={ density = \"1000 kg/m^3\", kinematic_viscosity = \"1e-3 m^2/s\" }",
        "fluid.gas={ density = \"1.2 kg/m^3\", kinematic_viscosity = \"1e-3 m^2/s\" }",
        "fluid.tol_div=1e-9",
    ];
    let film = below([0.0, 0.0, 5.0], [0.0, 0.0, 1.0]);
    let run = |name: &str, more: &[&str]| {
        let all: Vec<&str> = [&[gravity.as_str(), sides, film.as_str()][..], &fluids, more].concat();
        ran(&text, &all, &scratch.join(name), On::threads(1))
    };
    let left = run("film", &["run.until=0.2 s"]);
    let probe = left.probe("film");
    let worst = |driving: Real| {
        let error = |n: usize| {
            let z = (0.25 + 0.5 * n as Real) * 1e-3;
            let exact = driving * slope.sin() / nu * (h * z - 0.5 * z * z);
            (probe.last(&format!("velocity_1_at_{n}")) - exact).abs()
        };
        (0..10).map(error).fold(0.0, Real::max)
    };
    // The largest speed is 21.3 mm/s; half a cell from the wall the differences give a fortieth of a cell's share too much.
    let lift = 1.0 - 1.2 / 1000.0;
    let error = worst(g * lift);
    assert!(error < 0.15e-3, "{error}");
    // Negative control: another slope is seen.
    assert!(worst(1.1 * g * lift) > 1e-3);
}

#[test]
fn a_jet_that_leaves_has_the_pressure_of_the_gas_around_it() {
    let scratch = Scratch::new("open-jet");
    let jet = "liquid=[{ region.box = { lower = [\"50 mm\", \"0 m\", \"70 mm\"], upper = [\"100 mm\", \"50 mm\", \"90 mm\"] }, velocity = [\"1 m/s\", \"0 m/s\", \"0 m/s\"] }]";
    let sides = "boundary={ all = \"slip\", x1_upper = \"outflow\" }";
    let more = ["run.until=40 ms", "domain.cells=[16, 4, 16]", "boundary.x1_lower=outflow"];
    let left = ran(BOX, &[&[jet, sides][..], &more].concat(), &scratch.join("jet"), On::threads(1));
    // 2 cm of water above gas would be 196 Pa, and blow it in at 18 m/s; the jet alone has 25 mJ, and gains by falling.
    let energy = left.column("kinetic_energy_fluid");
    assert!(energy.iter().all(|energy| *energy < 27e-3), "{energy:?}");
    // Negative control: the same water that stands on the floor has the pressure of water, and pushes on what runs out.
    let pool = jet.replace("70 mm", "0 mm").replace("90 mm", "20 mm");
    let pool = ran(BOX, &[&[pool.as_str(), sides][..], &more].concat(), &scratch.join("pool"), On::threads(1));
    assert!((pool.last("kinetic_energy_fluid") / left.last("kinetic_energy_fluid") - 1.0).abs() > 0.05);
}

#[test]
fn ranks_and_restarts_see_the_same_fluid_outside() {
    let scratch = Scratch::new("open-ranks");
    // Gravity along x1, over the cut between ranks; a wave on the surface.
    let case = [
        "gravity=[\"9.81 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]",
        "domain.cells=[16, 8, 8]",
        "boundary={ all = \"slip\", x3_upper = \"outflow\" }",
        "liquid=[{ region.half_space = { point = [\"57 mm\", \"0 m\", \"0 m\"], normal = [-1.0, 0.0, 0.3] } }]",
        "fluid.tol_div=1e-11",
    ];
    let whole = ran(BOX, &case, &scratch.join("one"), On::threads(1).steps(20));
    let two = ran(BOX, &case, &scratch.join("two"), On::ranks(2, 1).steps(20));
    let energies = [&whole, &two].map(|left| left.last("kinetic_energy_fluid"));
    assert!(energies[0] > 1e-5 && (energies[0] / energies[1] - 1.0).abs() < 1e-7, "{energies:?}");
    let parts = scratch.join("parts");
    ran(BOX, &case, &parts, On::threads(1).steps(9));
    go_on(&parts, On::threads(2).steps(11)).0.expect("the run goes on");
    assert_eq!(Left::in_folder(&parts).hash(), whole.hash());
}

/// A heavy sphere in a liquid that fills a box without walls.
const SETTLING: &str = include_str!("../cases/open-sides-settling.toml");

const NO_FLOW: &str = "drive={ mean_velocity = [\"0 m/s\", \"0 m/s\", \"0 m/s\"] }";

#[test]
fn grains_settle_through_a_liquid_without_net_flow() {
    let scratch = Scratch::new("no-flow");
    let (mass, displaced): (Real, Real) = (2500.0, 1000.0);
    let share = std::f64::consts::PI / 6.0 * 64e-9 / 2e-6;
    let left = ran(SETTLING, &[NO_FLOW], &scratch.join("settling"), On::threads(1));
    assert!(largest(&left, "mean_velocity_3") < 1e-15);
    // The gradient bears the weight of all, less what accelerates.
    let force = left.last("driving_acceleration_3");
    let weight = 9.8 * (1.0 + share * (mass / displaced - 1.0));
    assert!(force > 9.8 && force < 1.001 * weight, "{force} for {weight}");
    let speed = left.probes[0].1.last("velocity_3");
    assert!((-0.3..-0.05).contains(&speed), "{speed}");
    let residual = left.last("momentum_residual_relative");
    assert!(residual < 1e-8, "{residual}");
    // Ranks and restarts hold the same.
    let whole = ran(SETTLING, &[NO_FLOW], &scratch.join("whole"), On::threads(1).steps(12));
    let two = ran(SETTLING, &[NO_FLOW], &scratch.join("two"), On::ranks(2, 1).steps(12));
    let force = [&whole, &two].map(|left| left.last("driving_acceleration_3"));
    assert!((force[0] / force[1] - 1.0).abs() < 1e-6, "{force:?}");
    let parts = scratch.join("parts");
    ran(SETTLING, &[NO_FLOW], &parts, On::threads(1).steps(5));
    go_on(&parts, On::threads(2).steps(7)).0.expect("the run goes on");
    assert_eq!(Left::in_folder(&parts).hash(), whole.hash());
    // Negative control: a drop held up by its own weight's gradient falls through gas, which rises.
    let drop = "liquid=[{ region.sphere = { centre = [\"5 mm\", \"5 mm\", \"10 mm\"], diameter = \"6 mm\" } }]";
    let falling = ran(SETTLING, &[NO_FLOW, drop, "grains=[]", "probe=[]"], &scratch.join("drop"), On::threads(1));
    let fluid = 998.2 * share * 216.0 / 64.0;
    let momentum = falling.last("momentum_liquid_3");
    let free = -9.8 * 50e-3 * fluid * 2e-6;
    assert!((momentum / free - 1.0).abs() < 0.05, "{momentum} {free}");
    assert!(largest(&falling, "mean_velocity_3") < 1e-13);
}

#[test]
fn a_gradient_of_the_pressure_drives_a_flow_on_the_grid() {
    let scratch = Scratch::new("by-pressure");
    let plain = ["gravity=0 m/s^2", "grains=[]", "probe=[]", "run.until=20 ms"];
    let run = |name: &str, drive: &str, more: &[&str]| {
        let all: Vec<&str> = [&[drive][..], &plain, more].concat();
        ran(SETTLING, &all, &scratch.join(name), On::threads(1))
    };
    let energy = |left: &Left| left.last("kinetic_energy_fluid");
    let drive = "drive={ acceleration = [\"2 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], acts_by = \"volume\" }";
    let pushed = run("pushed", drive, &[]);
    let expected: Real = 0.5 * 998.2 * 2e-6 * (2.0 * 20e-3_f64).powi(2);
    assert!((energy(&pushed) / expected - 1.0).abs() < 0.01, "{} {expected}", energy(&pushed));
    // Gas of a hundredth of the density is pushed a hundred times as hard, by mass as hard: the negative control.
    let gas = ["liquid=[]", "fluid.gas={ density = \"10 kg/m^3\", kinematic_viscosity = \"1e-5 m^2/s\" }"];
    let blown = energy(&run("blown", drive, &gas));
    let heavy = energy(&run("by-mass", &drive.replace("volume", "mass"), &gas));
    assert!((blown / heavy / 99.82_f64.powi(2) - 1.0).abs() < 0.01, "{blown} {heavy}");
    let held = "drive={ mean_velocity = [\"0 m/s\", \"3 mm/s\", \"0 m/s\"], acts_by = \"volume\", ramp = \"0 s\" }";
    let held = run("held", held, &["boundary={ all = \"periodic\", x3 = \"no_slip\" }"]);
    assert!((held.last("mean_velocity_2") / 3e-3 - 1.0).abs() < 1e-12);
}

#[test]
fn boxes_in_which_everything_falls_are_refused() {
    let titles = |more: &[&str]| findings(SETTLING, more);
    let falls = |found: Vec<String>| found.len() == 1 && found[0].contains("everything falls along x3 without end");
    for solver in ["solver=mics", "solver=mps"] {
        let water = [
            solver,
            "grains=[]",
            "probe=[]",
            "domain.size=[\"12 mm\", \"12 mm\", \"24 mm\"]",
            "particles={ spacing = \"1 mm\", tolerance = 1e-6 }",
            "liquid=[{ region.box = { lower = [\"0 m\", \"0 m\", \"0 m\"], upper = [\"12 mm\", \"12 mm\", \"24 mm\"] } }]",
        ];
        let with = |more: &[&str]| titles(&[&water[..], more].concat());
        assert!(falls(with(&[])), "{solver}: {:?}", with(&[]));
        assert!(falls(with(&["boundary={ all = \"slip\", x3 = \"periodic\" }"])));
        assert!(with(&["gravity=0 m/s^2"]).is_empty());
        assert!(with(&[NO_FLOW]).is_empty(), "{:?}", with(&[NO_FLOW]));
        assert!(with(&["boundary={ all = \"slip\", x1 = \"periodic\", x2 = \"periodic\" }"]).is_empty());
        let along = with(&[
            "gravity=[\"-1 m/s^2\", \"0 m/s^2\", \"-9 m/s^2\"]",
            "boundary={ all = \"slip\", x1 = \"periodic\" }",
        ]);
        assert!(along.len() == 1 && along[0].contains("everything falls along x1"), "{along:?}");
        // A slope with friction is a flow like others; a shaft is one that is hardly meant.
        let slope = with(&[
            "gravity=[\"-1 m/s^2\", \"0 m/s^2\", \"-9 m/s^2\"]",
            "boundary={ all = \"no_slip\", x1 = \"periodic\" }",
        ]);
        assert!(slope.is_empty(), "{slope:?}");
        let shaft = with(&["boundary={ all = \"no_slip\", x3 = \"periodic\" }"]);
        assert!(shaft.len() == 1 && shaft[0].contains("the fluid falls along x3"), "{shaft:?}");
        let by_mass = with(&[NO_FLOW, "drive.acts_by=mass"]);
        assert!(
            by_mass.len() == 1 && by_mass[0].contains("a net flow of zero cannot be held by a force per mass"),
            "{by_mass:?}"
        );
        let walls = with(&[NO_FLOW, "boundary={ all = \"no_slip\" }"]);
        assert!(walls.len() == 1 && walls[0].contains("no direction along which a net flow is held"), "{walls:?}");
    }
    assert!(falls(titles(&[])));
    let borne = "drive={ acceleration = [\"0 m/s^2\", \"0 m/s^2\", \"9.8 m/s^2\"], acts_by = \"volume\" }";
    assert!(titles(&[borne]).is_empty(), "{:?}", titles(&[borne]));
}

#[test]
fn mean_gradients_of_the_pressure_beside_open_sides_are_refused() {
    let open = "boundary={ all = \"periodic\", x3_lower = \"no_slip\", x3_upper = \"outflow\" }";
    let push = "drive={ acceleration = [\"2 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], acts_by = \"volume\" }";
    let swing = "drive={ oscillation = { amplitude = [\"2 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], frequency = \"1 Hz\" }, acts_by = \"volume\" }";
    let net = "drive={ mean_velocity = [\"1 cm/s\", \"0 m/s\", \"0 m/s\"], acts_by = \"volume\" }";
    const ENDS: &str = "a mean gradient of the pressure ends at x3_upper, which is open";
    for drive in [push, swing, net, NO_FLOW] {
        let pressed = open.replace("\"outflow\"", "{ fixed_pressure = { fluid = \"gas\" } }");
        for sides in [open, &pressed] {
            let text = refusal(SETTLING, &[sides, drive]);
            assert!(text.contains(ENDS) && text.contains("or close x3_upper"), "{text}");
            assert_eq!(text.contains("write `acts_by = \"mass\"`"), drive != NO_FLOW, "{text}");
        }
        // Negative controls: a force by mass, a lid, and moving particles, on which the force acts as such.
        let refuses = |more: &[&str]| findings(SETTLING, more).iter().any(|title| title.contains(ENDS));
        assert!(!refuses(&[&open.replace("outflow", "no_slip"), drive]));
        assert!(!refuses(&[open, &drive.replace("volume", "mass")]) || drive == NO_FLOW);
        assert!(!refuses(&[open, drive, "solver=mps"]));
    }
    // A net flow is a way out of a fall without end where there is no open side alone.
    let tilted = ["gravity=[\"1 m/s^2\", \"0 m/s^2\", \"-9 m/s^2\"]"];
    let fall = |sides: &str| refusal(SETTLING, &[&tilted[..], &[sides]].concat());
    for (sides, way_out) in
        [(open.replace("no_slip", "slip"), false), (open.replace("no_slip", "slip").replace("outflow", "slip"), true)]
    {
        let text = fall(&sides);
        assert!(text.contains("everything falls along x1 without end") && text.contains("give x1 walls"), "{text}");
        assert_eq!(text.contains("drive.mean_velocity"), way_out, "{text}");
    }
}

#[test]
fn viscous_liquid_at_rest_stirs_no_gas() {
    let scratch = Scratch::new("viscous-rest");
    // Its surface on the faces of cells, where half a central difference reaches into the gas.
    let energy = |viscosity: Real, sides: &str, more: &[&str], name: &str| {
        let overrides = [
            "domain={ size = [\"20 mm\", \"20 mm\", \"20 mm\"], cells = [10, 10, 10] }".to_owned(),
            below([0.0, 0.0, 10.0], [0.0, 0.0, 1.0]),
            format!("fluid.liquid={{ density = \"1000 kg/m^3\", kinematic_viscosity = \"{viscosity} m^2/s\" }}"),
            format!("boundary={{ all = \"{sides}\" }}"),
            "fluid.tol_div=1e-6".to_owned(),
            "fluid.dt_max=1 ms".to_owned(),
            "run.until=0.3 s".to_owned(),
        ];
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).chain(more.iter().copied()).collect();
        largest(&ran(BOX, &overrides, &scratch.join(name), On::threads(1)), "kinetic_energy_fluid")
    };
    for (n, (viscosity, sides)) in [(1e-4, "no_slip"), (1e-3, "no_slip"), (1e-4, "slip")].into_iter().enumerate() {
        let energy = energy(viscosity, sides, &[], &n.to_string());
        assert!(energy < 1e-13, "{viscosity} {sides}: {energy}");
    }
    // Control: gas that is blown along at a centimetre a second is seen.
    let blown = "fluid.initial_velocity={ taylor_green = { speed = \"0.01 m/s\" } }";
    let stirred = energy(1e-4, "slip", &[blown, "run.until=10 ms"], "blown");
    assert!(stirred > 1e-11, "{stirred}");
}

#[test]
fn fluids_of_one_density_flow_through_open_sides_alike() {
    let scratch = Scratch::new("open-one-density");
    let energies = |name: &str, gas: &str, level: Real| {
        let fluids = [
            "fluid.liquid={ density = \"1000 kg/m^3\", kinematic_viscosity = \"1e-6 m^2/s\" }".to_owned(),
            format!("fluid.gas={{ density = \"{gas}\", kinematic_viscosity = \"1e-6 m^2/s\" }}"),
            "fluid.initial_velocity.taylor_green.speed=\"0.05 m/s\"".to_owned(),
            open("x1_upper = \"outflow\"").replace("no_slip", "slip"),
            below([0.0, 0.0, level], [0.0, 0.0, 1.0]),
            "run.until=\"50 ms\"".to_owned(),
        ];
        let fluids = fluids.each_ref().map(String::as_str);
        let left = ran(BOX, &fluids, &scratch.join(name), On::threads(1));
        assert!(largest(&left, "momentum_residual_relative") < 1e-9, "{name}");
        left.column("kinetic_energy_fluid")
    };
    // What flows in has the density of what is there, whichever fluid it is: the flow differs by how what it carries is found in mixed cells.
    let (pool, full) = (energies("pool", "1000 kg/m^3", 43.0), energies("full", "1000 kg/m^3", 1e3));
    let apart = |a: &[Real], b: &[Real]| a.iter().zip(b).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, Real::max);
    assert!(pool.len() > 3 && apart(&pool, &full) < 0.03, "{pool:?} {full:?}");
    // Negative control: light gas above the pool is driven elsewhere.
    assert!(apart(&energies("light", "1 kg/m^3", 43.0), &full) > 0.1);
}

#[test]
fn a_closed_box_books_nothing_with_its_open_sides() {
    let scratch = Scratch::new("open-closed");
    // Over the momentum of the drop: what passes the sides, and what no cell could take.
    let booked = |name: &str, overrides: &[&str]| {
        let left = ran(DROP, overrides, &scratch.join(name), On::threads(1));
        let drop = left.column("momentum_liquid_3")[0].abs();
        ["impulse_open_sides_3", "impulse_residue_3"].map(|column| largest(&left, column) / drop)
    };
    let [through, residue] = booked("closed", &[]);
    assert!(through == 0.0 && residue < 1e-3, "{through:e} {residue:e}");
    // Negative control: gas goes out at the top and comes in again.
    let [through, _] = booked("open", &["boundary.x3_upper=outflow"]);
    assert!(through > 1e-12, "{through:e}");
}

#[test]
fn a_bath_beside_a_dry_box_is_warned_of() {
    let bath =
        open("x1_lower = { fixed_pressure = { fluid = \"liquid\", pressure = \"2 kPa\" } }, x1_upper = \"outflow\"");
    let is_told = |more: &[&str]| {
        let told = findings(BOX, &[&[&bath[..]], more].concat());
        told.iter().any(|finding| finding.contains("no liquid lies before x1_lower"))
    };
    assert!(is_told(&[]));
    // Controls: with a pool before it, and without gravity, where liquid does come in.
    assert!(!is_told(&[&below([0.0, 0.0, 43.0], [0.0, 0.0, 1.0])]));
    assert!(!is_told(&["gravity=0 m/s^2"]));
}

#[test]
fn the_first_step_knows_the_pressure_of_open_sides() {
    let scratch = Scratch::new("open-pushed");
    // A column of 20 mm behind which there is a bar of a thousandth of a metre of water for each millimetre: 500 g.
    let sides = "boundary={ all = \"slip\", x1_lower = { fixed_pressure = { fluid = \"liquid\", pressure = \"100 kPa\" } }, x1_upper = \"outflow\" }";
    let column = below([20.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let front = |name: &str, more: &[&str]| {
        let keys =
            [&["gravity=0 m/s^2", sides, &column[..], "run.until=1 ms", "output.series={ steps = 1 }"], more].concat();
        let left = ran(BOX, &keys, &scratch.join(name), On::threads(1));
        (left.last("front") - 20e-3, left.column("dt")[1])
    };
    let (way, first) = front("run", &[]);
    // Half of 5000 m/s^2 for a millisecond; the mass grows meanwhile.
    assert!((1.8e-3..2.6e-3).contains(&way) && first < 1e-4, "{way} after a first step of {first}");
    // Negative control: without the pressure nothing moves, and the first step is long.
    let (still, long) = front("still", &["boundary.x1_lower.fixed_pressure.pressure=0 Pa"]);
    assert!(still.abs() < 1e-9 && long > 1e-4, "{still} {long}");
}
