//! Bodies with flat faces, made of many contact spheres that touch at once: they rest, stand on each other and slide as they should,
//! and sub-steps that are too long for them are said.

use crate::support::{Left, On, Scratch, foretold, load, ran, start};
use sazanami::check::{SubstepCause, explain};
use sazanami::error::exit;
use sazanami_numerics::Real;

/// A brick of 51 g half a millimetre above the floor of a box of air.
const BRICK: &str = include_str!("../cases/flat-faces-brick.toml");

/// A block on a fixed plate under water: once it lies still, what its contacts exchange is next to nothing.
const UNDER_WATER: &str = r#"
gravity = "9.81 m/s^2"
[domain]
size = ["30 mm", "20 mm", "30 mm"]
cells = [15, 10, 15]
[boundary]
all = "slip"

[[liquid]]
region.half_space = { point = ["0 m","0 m","10 m"] }
allow_touching_grains = true

[material.m]
density = "2000 kg/m^3"
[contact.default]
normal_stiffness = "1e4 N/m"
restitution = 0.5
friction = 0.5
[output]
fields = { at = [] }
figures = { at = [] }
grains = { at = [] }
series = { every = "1 ms" }

[run]
until = "50 ms"
[[grains]]
name = "plate"
material = "m"
shape.box = { size = ["30 mm", "20 mm", "6 mm"] }
placement.list = [{ position = ["15.0 mm", "10 mm", "3 mm"] }]
contact_spheres = "shell(400)"
motion = "fixed"
[[grains]]
name = "a"
material = "m"
shape.box = { size = ["10 mm", "10 mm", "6 mm"] }
placement.list = [{ position = ["15 mm", "10 mm", "9.0 mm"] }]
contact_spheres = "shell(200)"
[[probe]]
name = "a"
body = { population = "a", index = 0 }
every = "1 ms"
"#;

/// A heavy box a tenth of a millimetre above a floor.
const HEAVY: [&str; 7] = [
    "domain.size=[\"0.3 m\", \"0.3 m\", \"0.3 m\"]",
    "material.rock.density=2600 kg/m^3",
    "contact.default.restitution=0.3",
    "contact.default.friction=0.3",
    "grains.0.shape.box.size=[\"0.12 m\", \"0.12 m\", \"60 mm\"]",
    "grains.0.contact_spheres=shell(400)",
    "grains.0.placement.list.0.position=[\"0.15 m\", \"0.15 m\", \"30.1 mm\"]",
];

/// Time, height and speed of the first grain, as its probe has them \[s, m, m/s].
fn motion(left: &Left) -> Vec<[Real; 3]> {
    let columns =
        ["time", "position_3", "velocity_1", "velocity_2", "velocity_3"].map(|name| left.probes[0].1.column(name));
    let row = |n: usize| columns.each_ref().map(|column| column[n]);
    let rows = (0..columns[0].len()).map(row);
    rows.map(|[time, height, u, v, w]| [time, height, u.hypot(v).hypot(w)]).collect()
}

/// Centres of the grains at the end \[m], and their largest speed [m/s].
fn end(left: &Left) -> (Vec<[Real; 3]>, Real) {
    let reals = |name: &str| left.state.reals(&format!("grains/grain.{name}")).expect("the state has it");
    let triples = |values: &[Real]| values.as_chunks().0.to_vec();
    let speeds = triples(reals("velocity")).into_iter().map(|[u, v, w]| u.hypot(v).hypot(w));
    (triples(reals("position")), speeds.fold(0.0, Real::max))
}

#[test]
fn a_heavy_box_rests_on_its_face() {
    let scratch = Scratch::new("faces-heavy");
    let motion = motion(&ran(BRICK, &HEAVY, scratch.path(), On::threads(1)));
    let [_, height, speed] = motion[motion.len() - 1];
    assert!((height - 30e-3).abs() < 1e-5 && speed < 1e-5, "{height} m, {speed} m/s");
    assert!(motion.iter().all(|row| row[1] <= 30.1e-3), "{motion:?}");
}

#[test]
fn a_brick_rests_whatever_its_spheres_and_their_damping() {
    let scratch = Scratch::new("faces-brick");
    for (count, restitution) in [(75, 0.1), (98, 0.4), (392, 0.1), (392, 0.9), (800, 0.4), (1000, 0.4)] {
        let spheres = format!("grains.0.contact_spheres=shell({count})");
        let damping = format!("contact.default.restitution={restitution}");
        let folder = scratch.join(&format!("{count}-{restitution}"));
        let left = ran(BRICK, &[&spheres, &damping], &folder, On::threads(1));
        let late: Vec<_> = motion(&left).into_iter().filter(|row| row[0] > 39.5e-3).collect();
        let highest = late.iter().map(|row| row[1]).fold(0.0, Real::max);
        assert!((highest - 15e-3).abs() < 2e-5, "{count} spheres, restitution {restitution}: {highest} m");
        assert!(late.iter().all(|row| row[2] < 2e-3), "{count} spheres, restitution {restitution}: {late:?}");
        // It fell half a millimetre; the air took next to nothing.
        let work = left.summary["corrections"]["contact_work"].as_f64().expect("the run books it");
        assert!((work / (1900.0 * 27e-6 * 9.81 * 0.5e-3) + 1.0).abs() < 0.02, "{work} J");
    }
}

#[test]
fn a_block_that_comes_to_rest_on_a_plate_under_water_does_not_end_the_run() {
    let scratch = Scratch::new("faces-water");
    let left = ran(UNDER_WATER, &[], &scratch.join("run"), On::threads(1));
    let probe = left.probe("a");
    // Means over the last steps: contacts and water bear it by turns, by some per cent of its weight.
    let late = |column: &str| {
        let rows = probe.column(column);
        let late = &rows[rows.len() - 10..];
        late.iter().sum::<Real>() / late.len() as Real
    };
    let weight = 2000.0 * 600e-9 * 9.81;
    let borne = late("contact_force_3") + late("fluid_force_3");
    let fastest = probe.column("velocity_3").iter().rev().take(10).fold(0.0, |a: Real, v| a.max(v.abs()));
    assert!((borne / weight - 1.0).abs() < 0.02 && fastest < 1e-3, "{borne} of {weight}, {fastest} m/s");
    assert!(late("contact_force_3") > 0.3 * weight, "{}", late("contact_force_3"));
    assert_eq!(left.column("time").len(), 51);
}

/// Negative control: sub-steps that suit one contact and not a hundred drive the box, and the run says so.
#[test]
fn too_few_sub_steps_for_a_face_end_the_run() {
    let scratch = Scratch::new("faces-driven");
    for substeps in [4, 20] {
        let count = format!("dem.substeps={substeps}");
        let overrides = [&HEAVY[..], &["fluid.dt=1 ms", &count, "run.until=0.2 s"]].concat();
        let folder = scratch.join(&substeps.to_string());
        let error = start(&load(BRICK, &overrides), &folder, On::threads(1)).expect_err("contacts drive the box");
        assert_eq!(error.exit_code(), exit::FAILED);
        let text = error.to_string();
        assert!(text.contains("contacts gave") && text.contains("grain 0 of `block`: their sub-steps"), "{text}");
        let summary = crate::support::summary(&folder);
        assert_eq!(summary["failure"]["kind"], "energy_gained");
        assert!(summary["failure"]["time"].as_f64().is_some_and(|time| time > 0.0 && time < 0.15), "{summary}");
    }
    // With as many as the faces ask for it rests.
    let overrides = [&HEAVY[..], &["fluid.dt=1 ms", "dem.substeps=110"]].concat();
    assert!(end(&ran(BRICK, &overrides, &scratch.join("enough"), On::threads(1))).1 < 1e-5);
}

#[test]
fn a_block_on_a_slope_sticks_and_slides_by_its_friction() {
    let scratch = Scratch::new("faces-slope");
    let critical = 0.5_f64.atan().to_degrees();
    for degrees in [20.0, critical, 30.0, 40.0] {
        let (sine, cosine) = Real::to_radians(degrees).sin_cos();
        let gravity = format!("gravity=[\"{} m/s^2\", \"0 m/s^2\", \"{} m/s^2\"]", 9.81 * sine, -9.81 * cosine);
        let place = "grains.0.placement.list.0.position=[\"30 mm\", \"50 mm\", \"15.02 mm\"]";
        let folder = scratch.join(&format!("{degrees:.0}"));
        let left = ran(BRICK, &[&gravity, place, "run.until=0.12 s"], &folder, On::threads(1));
        let motion = motion(&left);
        let at = |time: Real| motion.iter().find(|row| row[0] > time - 1e-6).expect("the probe saw it")[2];
        let found = (at(0.12) - at(0.02)) / 0.1;
        let expected = 9.81 * (sine - 0.5 * cosine).max(0.0);
        assert!((found - expected).abs() < 0.02 * expected.max(0.5), "{degrees} degrees: {found}, not {expected}");
    }
}

/// Four rows of blocks on each other, half a block aside from row to row.
fn wall() -> String {
    let rows = 4;
    let block = |row: usize, n: usize| {
        let x = 150.0 + (n as Real - 0.5 * (rows - row - 1) as Real) * 60.02;
        format!("{{ position = [\"{x} mm\", \"50 mm\", \"{} mm\"] }}", 15.01 + 30.01 * row as Real)
    };
    let all = (0..rows).flat_map(|row| (0..rows - row).map(move |n| block(row, n)));
    format!("grains.0.placement.list=[{}]", all.collect::<Vec<_>>().join(", "))
}

#[test]
fn a_wall_of_blocks_stands() {
    let scratch = Scratch::new("faces-wall");
    let wall = wall();
    let shape = "grains.0.shape.box.size=[\"60 mm\", \"30 mm\", \"30 mm\"]";
    let size = "domain.size=[\"0.3 m\", \"0.1 m\", \"0.2 m\"]";
    for restitution in ["contact.default.restitution=0.2", "contact.default.restitution=0.8"] {
        let overrides = [&wall, shape, size, restitution, "grains.0.contact_spheres=shell(200)", "run.until=0.15 s"];
        let left = ran(BRICK, &overrides, &scratch.join(restitution), On::threads(1));
        let (places, fastest) = end(&left);
        assert!(fastest < 1e-2, "{restitution}: {fastest} m/s");
        for (n, [x, y, z]) in places.iter().enumerate() {
            let (row, at) = [(0, n), (1, n.wrapping_sub(4)), (2, n.wrapping_sub(7)), (3, n.wrapping_sub(9))]
                .into_iter()
                .find(|(row, at)| *at < 4 - row)
                .expect("ten blocks");
            let home = 0.15 + (at as Real - 0.5 * (3 - row) as Real) * 0.06002;
            let away = (x - home).hypot(y - 0.05).hypot(z - 0.015 - 0.03 * row as Real);
            assert!(away < 5e-4, "{restitution}: block {n} is {away} m from its place");
        }
    }
}

/// Two slabs that lean on each other at 60 degrees: an arch of three hinges, which stands on a friction of half the cotangent, 0.289.
#[test]
fn an_arch_stands_on_its_friction() {
    let scratch = Scratch::new("faces-arch");
    let (sine, cosine) = 60.0_f64.to_radians().sin_cos();
    let (length, thick) = (0.12, 0.024);
    let (up, aside) = (0.5 * (length * sine + thick * cosine), 0.5 * (length * cosine + thick * sine));
    let slab = |side: Real| {
        let position = format!("[\"{} m\", \"0.05 m\", \"{} m\"]", 0.15 + side * (aside + 2e-5), up + 2e-5);
        format!("{{ position = {position}, axis = [0, 1, 0], angle = \"{} deg\" }}", 60.0 * side)
    };
    let slabs = format!("grains.0.placement.list=[{}, {}]", slab(-1.0), slab(1.0));
    let overrides = |friction: &'static str| {
        [
            &*slabs,
            friction,
            "grains.0.shape.box.size=[\"120 mm\", \"60 mm\", \"24 mm\"]",
            "grains.0.contact_spheres=shell(300)",
            "grains.0.sphere_radius=4 mm",
            "domain.size=[\"0.3 m\", \"0.1 m\", \"0.2 m\"]",
            "contact.default.restitution=0.5",
            "run.until=0.25 s",
        ]
    };
    let [stands, falls] = ["contact.default.friction=0.5", "contact.default.friction=0.2"]
        .map(|friction| end(&ran(BRICK, &overrides(friction), &scratch.join(friction), On::threads(1))));
    assert!(stands.1 < 1e-3 && stands.0.iter().all(|place| place[2] > up - 4e-3), "{stands:?}");
    // Negative control: less friction does not hold it.
    assert!(falls.0.iter().all(|place| place[2] < up - 1e-2), "{falls:?}");
}

#[test]
fn a_face_in_a_corner_takes_more_sub_steps_than_one_on_the_floor() {
    let scratch = Scratch::new("faces-corner");
    let gravity = "gravity=[\"-9.81 m/s^2\", \"-9.81 m/s^2\", \"-9.81 m/s^2\"]";
    let place = "grains.0.placement.list.0.position=[\"15.01 mm\", \"15.01 mm\", \"15.01 mm\"]";
    let floor = ran(BRICK, &[], &scratch.join("floor"), On::threads(1));
    let corner = ran(BRICK, &[gravity, place], &scratch.join("corner"), On::threads(1));
    let [floor, in_corner] = [&floor, &corner].map(|left| left.column("grain_substeps"));
    let most = |of: &[Real]| of.iter().copied().filter(|n| n.is_finite()).fold(0.0, Real::max);
    assert!(floor.iter().filter(|n| n.is_finite()).all(|&n| n == most(&floor)), "{floor:?}");
    assert!(most(&in_corner) > most(&floor) && in_corner[1] == most(&floor), "{in_corner:?}");
    assert!(end(&corner).1 < 1e-4);
}

#[test]
fn check_says_what_faces_ask_for_and_what_their_bumps_add() {
    let described = |overrides: &[&str]| {
        let loaded = load(BRICK, overrides);
        let report = foretold(&loaded.case);
        (explain(&loaded.case, &report), report)
    };
    let (text, report) = described(&["grains.0.contact_spheres=shell(392)"]);
    assert_eq!(report.substep_cause, SubstepCause::Face);
    let spheres = report.populations[0].face_spheres.expect("the shape is known");
    assert!((60..100).contains(&spheres) && report.bumps.is_empty(), "{spheres} {:?}", report.bumps);
    assert!(text.contains("touch a plane at once") && text.contains("so that a face comes to rest"), "{text}");
    let (text, report) = described(&[&wall(), "domain.size=[\"0.3 m\", \"0.1 m\", \"0.2 m\"]"]);
    assert!(report.bumps.len() == 1 && (0.005..0.1).contains(&report.bumps[0].friction), "{:?}", report.bumps);
    assert!(text.contains("their spheres add"), "{text}");
    // Negative control: balls have neither.
    let (text, report) =
        described(&["grains.0.shape={sphere={diameter=\"30 mm\"}}", "grains.0.contact_spheres=single"]);
    assert_eq!((report.substep_cause, report.populations[0].face_spheres), (SubstepCause::Contact, Some(1)));
    assert!(!text.contains("touch a plane at once") && report.bumps.is_empty(), "{text}");
}

/// A cube whose faces lie on planes of cells, in a box of water, with gravity along x1.
const CUBE: &str = r#"
gravity = ["-9.8 m/s^2", "0 m/s^2", "0 m/s^2"]
domain = { size = ["16 mm", "16 mm", "16 mm"], cells = [16, 16, 16] }
material.a.density = "1500 kg/m^3"
output = { fields = { at = [] }, figures = { at = [] }, grains = { at = [] }, series = { steps = 1 } }
run.until = "10 ms"

[[liquid]]
region.half_space.point = ["0 mm", "0 mm", "100 mm"]
allow_touching_grains = true

[[grains]]
shape.box.size = ["6 mm", "6 mm", "6 mm"]
placement.list = [{ position = ["8 mm", "8 mm", "8 mm"] }]

[[probe]]
name = "cube"
steps = 1
body.index = 0
"#;

#[test]
fn a_cube_on_planes_of_cells_sinks_without_spin() {
    let scratch = Scratch::new("faces-cube");
    let spin = |name: &str, overrides: &[&str]| {
        let left = ran(CUBE, overrides, &scratch.join(name), On::threads(1));
        let probe = left.probe("cube");
        assert!(probe.last("velocity_1") < -0.01, "{}", probe.last("velocity_1"));
        let of =
            |n: usize| probe.column(&format!("spin_{n}")).iter().fold(0.0, |most: Real, spin| most.max(spin.abs()));
        of(1).max(of(2)).max(of(3))
    };
    // Rounding turns it by 1e-14 rad: half of a face then lies in the cells beside it.
    assert!(spin("straight", &[]) < 1e-6);
    // So do turns by which a face leaves its plane of cells: no torque grows out of them.
    for angle in ["1e-4 deg", "1e-2 deg"] {
        let turned = format!(
            "grains.0.placement.list=[{{ position = [\"8 mm\", \"8 mm\", \"8 mm\"], axis = [0, 1, 0], angle = \"{angle}\" }}]"
        );
        assert!(spin(angle, &[&turned]) < 0.1, "{angle}");
    }
}

/// A liquid between the floor and a plate whose face lies on a plane of cells, driven along x2.
const SLOT: &str = r#"
gravity = "0 m/s^2"
domain = { size = ["1 mm", "4 mm", "5 mm"], cells = [2, 8, 10] }
boundary = { x1 = "slip", x2 = "periodic", x3 = "no_slip" }
drive.acceleration = ["0 m/s^2", "0.5 m/s^2", "0 m/s^2"]
fluid = { dt_max = "5 ms", liquid = { density = "1000 kg/m^3", kinematic_viscosity = "1e-4 m^2/s" } }
output = { fields = { at = [] }, figures = { at = [] }, grains = { at = [] }, series = { every = "50 ms" } }
run.until = "0.2 s"

[[liquid]]
region.half_space.point = ["0 mm", "0 mm", "100 mm"]
allow_touching_grains = true

[[probe]]
name = "flow"
every = "50 ms"
plane.x2 = "2 mm"
"#;

#[test]
fn a_face_on_a_plane_of_cells_holds_the_liquid_as_a_wall_of_the_box_does() {
    let scratch = Scratch::new("faces-slot");
    let flux = |text: &str, name: &str, overrides: &[&str]| {
        ran(text, overrides, &scratch.join(name), On::threads(1)).probe("flow").last("volume_flux")
    };
    let walls = flux(SLOT, "walls", &["domain.size=[\"1 mm\", \"4 mm\", \"3 mm\"]", "domain.cells=[2, 8, 6]"]);
    let plate = |height: &str| {
        format!(
            "{SLOT}\n[material.m]\ndensity = \"2000 kg/m^3\"\n[[grains]]\nmaterial = \"m\"\nmotion = \"fixed\"\n\
             shape.box.size = [\"1 mm\", \"1 mm\", \"2 mm\"]\nplacement.list = [{}]\n",
            ["0.5", "1.5", "2.5", "3.5"]
                .map(|y| format!("{{ position = [\"0.5 mm\", \"{y} mm\", \"{height}\"] }}"))
                .join(", ")
        )
    };
    let below = flux(&plate("4 mm"), "plate", &[]);
    assert!((below / walls - 1.0).abs() < 1e-3, "{below} {walls}");
    // A plate on the floor does the same from below, and rounding changes nothing.
    for (name, height) in [("floor", "1 mm"), ("rounded", "0.9999999999 mm")] {
        let above = flux(&plate(height), name, &[]);
        assert!((above / walls - 1.0).abs() < 1e-3, "{name}: {above} {walls}");
    }
    // Negative control: half a cell lower it is another slot.
    let narrow = flux(&plate("3.75 mm"), "narrow", &[]);
    assert!(narrow / walls < 0.95, "{narrow} {walls}");
}

/// Water beside a dam from side to side of a tank, its faces in planes of cells.
const DAM: &str = r#"
gravity = "9.8 m/s^2"
domain = { size = ["20 mm", "4 mm", "12 mm"], cells = [20, 4, 12] }
boundary = { all = "no_slip", x2 = "slip" }
material.stone.density = "2000 kg/m^3"
output = { fields = { at = [] }, figures = { at = [] }, grains = { at = [] }, series = { every = "10 ms" } }
run.until = "50 ms"

[[liquid]]
region.box = { lower = ["0 mm", "0 mm", "0 mm"], upper = ["8 mm", "4 mm", "8 mm"] }
allow_touching_grains = true

[[probe]]
name = "left"
every = "10 ms"
gauge = ["4 mm", "2 mm"]
"#;

#[test]
fn a_dam_of_blocks_is_as_tight_as_one_of_a_piece() {
    let scratch = Scratch::new("faces-dam");
    let level = |name: &str, size: [f64; 2], middles: &[[f64; 2]]| {
        let list: Vec<String> =
            middles.iter().map(|[y, z]| format!("{{ position = [\"10 mm\", \"{y} mm\", \"{z} mm\"] }}")).collect();
        let text = format!(
            "{DAM}\n[[grains]]\nmaterial = \"stone\"\nmotion = \"fixed\"\nshape.box.size = [\"4 mm\", \"{} mm\", \"{} mm\"]\n\
             placement.list = [{}]\n",
            size[0],
            size[1],
            list.join(", ")
        );
        ran(&text, &[], &scratch.join(name), On::threads(1)).probe("left").last("water_level")
    };
    let whole = level("whole", [4.0, 10.0], &[[2.0, 5.0]]);
    assert!((whole - 8e-3).abs() < 1e-6, "{whole}");
    let blocks = level("blocks", [2.0, 5.0], &[[1.0, 2.5], [3.0, 2.5], [1.0, 7.5], [3.0, 7.5]]);
    assert!((blocks - 8e-3).abs() < 1e-6, "{blocks}");
    // Negative control: with a slot below it the water runs out.
    let open = level("open", [4.0, 8.0], &[[2.0, 6.0]]);
    assert!(open < 7.5e-3, "{open}");
}
