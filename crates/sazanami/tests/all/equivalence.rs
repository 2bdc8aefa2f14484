//! A rank boundary is a boundary condition and a thread is nobody's business: small cases of every
//! kind give the same bits for any number of threads, and the same physics for any number of ranks.

use sazanami_numerics::Real;
use sazanami_numerics::snapshot::{Section, Snapshot};

use crate::support::{Left, On, Scratch, Table, load, start};

/// Ranks of the decompositions, halves, thirds, 3 x 2, and the threads of each rank.
const ON: [(usize, &[usize]); 4] = [(1, &[2, 4]), (2, &[1, 3]), (3, &[1]), (6, &[1, 2])];
/// Largest difference between ranks, over the largest value of the same kind. The pressure is solved to
/// `|div u| dt <= 1e-10` in each of these cases.
const TOLERANCE: Real = 1e-7;

/// Largest relative difference of the liquid's volume.
const LIQUID: Real = 1e-12;

/// A small case.
struct Small {
    name: &'static str,
    text: &'static str,
    overrides: &'static [&'static str],
    /// Whether no grain touches anything.
    apart: bool,
    /// Changes a little what the run begins with: must be seen.
    perturbed: &'static str,
}

const DROP_ON_BED: &str = r#"
gravity = "9.8 m/s^2"
[domain]
size = ["3.6 mm", "3.2 mm", "4 mm"]
cells = [18, 16, 20]
[fluid]
tol_div = 1e-10
[[liquid]]
name = "drop"
region.sphere = { diameter = "1.4 mm" }
gap_above_bed = "0.1 mm"
offset = ["0.2 mm", "-0.1 mm"]
fall = { speed = "2 m/s" }
[material.sand]
density = "2650 kg/m^3"
[contact."sand/sand"]
normal_stiffness = "100 N/m"
restitution = 0.3
friction = 0.6
[[grains]]
name = "sand"
count = 30
shape.spheroid = { diameter = "0.52 mm", length = "1.27 mm" }
contact_spheres = "axis(9)"
material = "sand"
placement.packed = { lattice = "low", stop = "settled" }
[[probe]]
name = "between"
point = ["1.8 mm", "1.6 mm", "1.9 mm"]
steps = 2
[[probe]]
name = "grain"
body = { population = "sand", index = 7 }
steps = 2
[[probe]]
name = "section"
plane = { x1 = "1.2 mm" }
steps = 2
[run]
until = "2 ms"
steps = 20
"#;

const DAM_BREAK: &str = r#"
gravity = "9.81 m/s^2"
[domain]
size = ["0.2 m", "0.08 m", "0.12 m"]
cells = [20, 8, 12]
[boundary]
all = "slip"
x3_lower = "no_slip"
x3_upper = { fixed_pressure = { pressure = "0 Pa" } }
[fluid]
tol_div = 1e-10
[[liquid]]
region.box = { lower = ["0 m", "0 m", "0 m"], upper = ["50 mm", "80 mm", "90 mm"] }
[material.brick]
density = "1900 kg/m^3"
[contact.default]
normal_stiffness = "1e4 N/m"
restitution = 0.4
friction = 0.5
[[grains]]
shape.box = { size = ["25 mm", "25 mm", "25 mm"] }
contact_spheres = "shell(26)"
material = "brick"
placement.list = [
    { position = ["80 mm", "20 mm", "12.6 mm"] },
    { position = ["80 mm", "55 mm", "12.6 mm"] },
    { position = ["80 mm", "40 mm", "38 mm"], axis = [0, 0, 1], angle = "45 deg" },
]
[run]
until = "0.3 s"
steps = 25
"#;

const PERIODIC: &str = r#"
gravity = ["3 m/s^2", "2 m/s^2", "-9.8 m/s^2"]
[domain]
size = ["4 mm", "4 mm", "3 mm"]
cells = [16, 16, 12]
[boundary]
x1 = "periodic"
x2 = "periodic"
[fluid]
tol_div = 1e-10
[[liquid]]
region.half_space = { point = ["0 mm", "0 mm", "2 mm"] }
velocity = ["0.2 m/s", "0.1 m/s", "0 m/s"]
allow_touching_grains = true
[material.glass]
density = "2500 kg/m^3"
[contact.default]
normal_stiffness = "200 N/m"
restitution = 0.5
friction = 0.4
[[grains]]
shape.spheroid = { diameter = "0.6 mm", length = "0.95 mm" }
contact_spheres = "axis(5)"
material = "glass"
placement.lattice = { lower = ["0 mm", "0 mm", "0.05 mm"], upper = ["4 mm", "4 mm", "2 mm"], counts = [4, 4, 2], jitter = 0.02, velocity = ["0.8 m/s", "0.5 m/s", "-1 m/s"], random_orientation = true }
[run]
until = "3 ms"
steps = 30
"#;

const SETTLING: &str = r#"
gravity = "9.81 m/s^2"
[domain]
size = ["40 mm", "40 mm", "50 mm"]
cells = [16, 16, 20]
[fluid]
tol_div = 1e-10
[fluid.liquid]
density = "960 kg/m^3"
dynamic_viscosity = "0.058 Pa s"
[[liquid]]
region.half_space = { point = ["0 mm", "0 mm", "60 mm"] }
allow_touching_grains = true
[coupling]
exchange = "stress"
[material.nylon]
density = "1120 kg/m^3"
[contact.default]
normal_stiffness = "1e3 N/m"
restitution = 0.9
[[grains]]
shape.sphere = { diameter = "15 mm" }
material = "nylon"
placement.list = [{ position = ["20.3 mm", "18.9 mm", "30 mm"], velocity = ["0.02 m/s", "0 m/s", "0 m/s"] }]
[run]
until = "1 s"
steps = 20
"#;

const CHANNEL: &str = r#"
gravity = "9.81 m/s^2"
[domain]
size = ["24 mm", "12 mm", "12 mm"]
cells = [24, 12, 12]
[boundary]
all = "slip"
x1_lower = { inflow = { velocity = ["0.2 m/s", "0 m/s", "0 m/s"] } }
x1_upper = "outflow"
[fluid]
tol_div = 1e-10
[[liquid]]
region.half_space = { point = ["0 mm", "0 mm", "13 mm"] }
allow_touching_grains = true
velocity = ["0.2 m/s", "0 m/s", "0 m/s"]
[material.glass]
density = "2500 kg/m^3"
[contact.default]
normal_stiffness = "1e3 N/m"
[[grains]]
name = "post"
shape.sphere = { diameter = "4 mm" }
material = "glass"
motion = "fixed"
placement.list = [{ position = ["8.2 mm", "5.7 mm", "6.1 mm"] }]
[[grains]]
name = "pebble"
shape.box = { size = ["3 mm", "2.5 mm", "3.5 mm"] }
contact_spheres = "shell(26)"
material = "glass"
placement.list = [{ position = ["13.9 mm", "6.2 mm", "3 mm"], axis = [1, 1, 0], angle = "30 deg" }]
[run]
until = "1 s"
steps = 20
"#;

const LID: &str = r#"
gravity = "0 m/s^2"
[domain]
size = ["10 mm", "10 mm", "10 mm"]
cells = [14, 14, 14]
[boundary]
x3_upper = { moving = { velocity = ["0.5 m/s", "0.2 m/s", "0 m/s"] } }
[fluid]
tol_div = 1e-10
[fluid.liquid]
kinematic_viscosity = "1e-4 m^2/s"
density = "1000 kg/m^3"
[[liquid]]
region.half_space = { point = ["0 mm", "0 mm", "11 mm"] }
allow_touching_grains = true
[material.glass]
density = "2500 kg/m^3"
[[grains]]
shape.spheroid = { diameter = "2 mm", length = "5 mm" }
contact_spheres = "axis(9)"
material = "glass"
placement.list = [{ position = ["5 mm", "4.8 mm", "7.4 mm"], axis = [1, 0, 0], angle = "70 deg" }]
[run]
until = "1 s"
steps = 20
"#;

const OBLIQUE: &str = r#"
gravity = "9.8 m/s^2"
[domain]
size = ["5 mm", "4 mm", "4 mm"]
cells = [20, 16, 16]
[fluid]
tol_div = 1e-10
[[liquid]]
region.sphere = { diameter = "1.6 mm" }
position = ["1.6 mm", "2.1 mm", "2.9 mm"]
fall = { speed = "3 m/s", angle = "35 deg", heading = "15 deg" }
[material.rock]
density = "2650 kg/m^3"
[[grains]]
name = "rock"
motion = "fixed"
shape.spheroid = { diameter = "1.2 mm", length = "2.4 mm" }
contact_spheres = "shell(75)"
material = "rock"
placement.list = [{ position = ["2.6 mm", "2 mm", "1.3 mm"], quaternion = [0.9, 0.1, 0.4, 0.2] }]
[run]
until = "5 ms"
steps = 30
"#;

const MIXED: &str = r#"
gravity = "9.8 m/s^2"
[domain]
size = ["5 mm", "5 mm", "4 mm"]
cells = [20, 20, 16]
[fluid]
tol_div = 1e-10
[[liquid]]
region.half_space = { point = ["0 mm", "0 mm", "1.5 mm"] }
allow_touching_grains = true
[material.quartz]
density = "2650 kg/m^3"
[material.wood]
density = "1100 kg/m^3"
[contact.default]
normal_stiffness = "300 N/m"
restitution = 0.5
friction = 0.6
[contact."quartz/wood"]
normal_stiffness = "200 N/m"
restitution = 0.3
friction = 0.4
[dem]
rolling = "constant_torque"
rolling_friction = 0.02
[[grains]]
name = "pebbles"
shape.sphere = { diameter = "0.9 mm" }
material = "quartz"
size.lognormal = { sigma = 0.15, lower = 0.7, upper = 1.2 }
seed = 3
placement.lattice = { lower = ["0 mm", "0 mm", "1 mm"], upper = ["5 mm", "5 mm", "2.1 mm"], counts = [4, 4, 1], velocity = ["0.4 m/s", "0.2 m/s", "-0.8 m/s"] }
[[grains]]
name = "sticks"
shape.spheroid = { diameter = "0.5 mm", length = "1.3 mm" }
contact_spheres = "axis(5)"
material = "wood"
size.list = [{ factor = 1.0, weight = 0.7 }, { factor = 0.8, weight = 0.3 }]
seed = 5
placement.lattice = { lower = ["0 mm", "0 mm", "2.1 mm"], upper = ["5 mm", "5 mm", "3.5 mm"], counts = [3, 3, 1], random_orientation = true, velocity = ["-0.2 m/s", "0 m/s", "-1 m/s"] }
[[grains]]
name = "blocks"
shape.box = { size = ["0.8 mm", "0.6 mm", "0.7 mm"] }
contact_spheres = "shell(26)"
material = "quartz"
placement.list = [
    { position = ["1.3 mm", "2.4 mm", "0.36 mm"] },
    { position = ["3.6 mm", "2.6 mm", "0.45 mm"], axis = [1, 2, 0], angle = "12 deg" },
]
[run]
until = "5 ms"
steps = 30
"#;

const CASES: [Small; 9] = [
    Small {
        name: "drop_on_bed",
        apart: false,
        text: DROP_ON_BED,
        overrides: &[],
        perturbed: "liquid.0.fall.speed=2.0001 m/s",
    },
    Small { name: "dam_break", apart: false, text: DAM_BREAK, overrides: &[], perturbed: "gravity=9.8105 m/s^2" },
    Small {
        name: "periodic",
        apart: false,
        text: PERIODIC,
        overrides: &[],
        perturbed: "contact.default.friction=0.41",
    },
    Small {
        name: "settling",
        apart: true,
        text: SETTLING,
        overrides: &[],
        perturbed: "material.nylon.density=1120.01 kg/m^3",
    },
    Small { name: "channel", apart: true, text: CHANNEL, overrides: &[], perturbed: "gravity=9.811 m/s^2" },
    Small { name: "lid", apart: true, text: LID, overrides: &[], perturbed: "material.glass.density=2500.1 kg/m^3" },
    Small { name: "oblique", apart: true, text: OBLIQUE, overrides: &[], perturbed: "liquid.0.fall.angle=35.001 deg" },
    Small {
        name: "mixed",
        apart: false,
        text: MIXED,
        overrides: &[],
        perturbed: "grains.0.placement.lattice.jitter=1e-6",
    },
    // The literal scheme: velocity form, stress alone, old pressure in the predictor, fixed steps with passes.
    Small {
        name: "literal",
        apart: false,
        text: DROP_ON_BED,
        overrides: &[
            "fluid.convection=velocity_form",
            "coupling.exchange=stress",
            "coupling.alpha=clip",
            "fluid.projection=incremental",
            "fluid.viscosity=crank_nicolson",
            "fluid.dt=0.08 ms",
        ],
        perturbed: "liquid.0.fall.speed=2.0001 m/s",
    },
];

fn outcome(scratch: &Scratch, small: &Small, on: On, more: Option<&str>) -> Left {
    let output = ["output.figures={ at = [] }", "output.series={ steps = 2 }"];
    let overrides: Vec<&str> = small.overrides.iter().copied().chain(output).chain(more).collect();
    let loaded = load(small.text, &overrides);
    let folder = scratch.join(small.name);
    start(&loaded, &folder, on).unwrap_or_else(|error| panic!("{} on {on:?}: {error}", small.name));
    let left = Left::in_folder(&folder);
    std::fs::remove_dir_all(&folder).expect("the case is sound");
    left
}

/// Kind of a section.
fn kind_of(section: &str) -> &str {
    // Liquid that waits for room is a part of a cell.
    let section = if section == "fluid/liquid_waiting" { "fluid/volume_fraction" } else { section };
    // The components of a vector share their scale.
    section.strip_suffix("_1").or(section.strip_suffix("_2")).or(section.strip_suffix("_3")).unwrap_or(section)
}

/// Physical arrays of a state: budgets and caches left out.
fn physical(state: &Snapshot) -> impl Iterator<Item = (&str, &[Real])> {
    state.sections().filter_map(|(name, section)| match section {
        Section::F64(values) if name.starts_with("fluid/") || name.starts_with("grains/grain.") => {
            Some((name, values.as_slice()))
        }
        _ => None,
    })
}

fn scale_of(state: &Snapshot, kind: &str) -> Real {
    let values = physical(state).filter(|(name, _)| kind_of(name) == kind).flat_map(|(_, values)| values);
    values.filter(|value| value.is_finite()).fold(0.0, |largest: Real, value| largest.max(value.abs()))
}

/// Largest difference of two states over the scale of each kind of quantity, with its name.
fn state_difference(a: &Snapshot, b: &Snapshot) -> (Real, String) {
    let mut worst = (0.0, String::new());
    for ((name, x), (other, y)) in physical(a).zip(physical(b)) {
        assert_eq!((name, x.len()), (other, y.len()));
        let scale = scale_of(a, kind_of(name));
        let differ = |(x, y): (&Real, &Real)| if x == y { 0.0 } else { (x - y).abs() / scale };
        let largest = x.iter().zip(y).map(differ).fold(0.0, Real::max);
        if largest > worst.0 || largest.is_nan() {
            worst = (largest, name.to_owned());
        }
    }
    worst
}

/// Columns that count iterations, or what is round-off by nature: nothing flows through a plane across a closed box.
fn is_incidental(column: &str) -> bool {
    [
        "pressure_iterations",
        "divergence",
        "residual",
        "relative_change",
        "clipped_volume",
        "out_of_range",
        "volume_flux",
    ]
    .iter()
    .any(|part| column.contains(part))
}

/// Kind of a column: components of a vector share their scale, and momenta and impulses that of all momenta.
fn kind_of_column(name: &str) -> &str {
    let kind = name.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('_');
    if kind.starts_with("momentum") || kind.starts_with("impulse") { "momentum" } else { kind }
}

/// Largest difference of two tables over the scale of each kind of column.
fn table_difference(a: &Table, b: &Table) -> (Real, String) {
    assert_eq!((a.rows.len(), &a.columns), (b.rows.len(), &b.columns));
    let mut worst = (0.0, String::new());
    let largest =
        |name: &str| a.column(name).into_iter().filter(|x| !x.is_nan()).fold(0.0, |l: Real, x| l.max(x.abs()));
    for name in a.columns.iter().filter(|name| !is_incidental(name)) {
        let alike = a.columns.iter().filter(|other| kind_of_column(other) == kind_of_column(name));
        let scale = alike.map(|name| largest(name)).fold(0.0, Real::max);
        for (x, y) in a.column(name).into_iter().zip(b.column(name)) {
            let difference = if x == y || (x.is_nan() && y.is_nan()) { 0.0 } else { (x - y).abs() / scale };
            if difference > worst.0 || difference.is_nan() {
                worst = (difference, name.clone());
            }
        }
    }
    worst
}

/// Differences of all tables that two runs wrote.
fn table_differences(a: &Left, b: &Left) -> Vec<(Real, String)> {
    assert_eq!(a.probes.len(), b.probes.len());
    let probes = a.probes.iter().zip(&b.probes).map(|((name, a), (other, b))| {
        assert_eq!(name, other);
        let (difference, column) = table_difference(a, b);
        (difference, format!("{column} of probe {name}"))
    });
    std::iter::once(table_difference(&a.series, &b.series)).chain(probes).collect()
}

/// Liquid in cell volumes: that in the open part of the cells where it has only that as its room.
fn liquid(left: &Left) -> Real {
    let fraction = left.state.reals("fluid/volume_fraction").expect("the case is sound");
    match left.state.reals("fluid/open_part") {
        Ok(open) => {
            let waiting = left.state.reals("fluid/liquid_waiting").expect("it is beside the open part");
            fraction.iter().zip(open).zip(waiting).map(|((fraction, open), waiting)| fraction * open + waiting).sum()
        }
        Err(_) => fraction.iter().sum(),
    }
}

fn equivalent(name: &str) {
    let small = CASES.iter().find(|small| small.name == name).expect("the case is in the list");
    let scratch = Scratch::new(&format!("equivalence-{name}"));
    let alone = outcome(&scratch, small, On::threads(1), None);
    assert!(!alone.state.u64("grains/grain.id").expect("the case is sound").is_empty() && alone.series.rows.len() > 4);
    let contacts = alone.column("contacts").into_iter().fold(0.0, Real::max);
    assert!(contacts > 0.0 || small.apart, "{name}: nothing touches");
    let mut worst = (0.0, String::new());
    let mut missed = Vec::new();
    for (ranks, threads) in ON {
        let on = |&threads: &usize| outcome(&scratch, small, On::ranks(ranks, threads), None);
        let runs: Vec<Left> = threads.iter().map(on).collect();
        let first = if ranks == 1 { &alone } else { &runs[0] };
        for (left, threads) in runs.iter().zip(threads) {
            if (left.hash(), &left.series, &left.probes) != (first.hash(), &first.series, &first.probes) {
                missed.push(format!("other bits on {ranks} ranks of {threads} threads"));
            }
        }
        let of_state = state_difference(&alone.state, &first.state);
        for (difference, what) in table_differences(&alone, first).into_iter().chain([of_state]) {
            if difference.is_nan() || difference > TOLERANCE {
                missed.push(format!("{what} differs by {difference:.1e} on {ranks} ranks"));
            }
            if difference > worst.0 {
                worst = (difference, what);
            }
        }
        let change = (liquid(first) / liquid(&alone) - 1.0).abs();
        if change > LIQUID {
            missed.push(format!("the liquid's volume differs by {change:.1e} on {ranks} ranks"));
        }
    }
    assert!(missed.is_empty(), "{name}: {missed:#?}");
    // Negative control: a small change of the case is seen by both measures.
    let other = outcome(&scratch, small, On::threads(1), Some(small.perturbed));
    assert_ne!(other.hash(), alone.hash());
    let (seen, _) = state_difference(&alone.state, &other.state);
    assert!(seen > 10.0 * TOLERANCE, "{name}: `{}` changes the state by {seen:e} only", small.perturbed);
    println!("{name}: ranks differ by {:.1e} at most ({}), the perturbed case by {seen:.1e}", worst.0, worst.1);
}

macro_rules! equivalent {
    ($($test:ident: $name:literal,)+) => {$(
        #[test]
        fn $test() {
            equivalent($name);
        }
    )+};
}

equivalent! {
    a_drop_on_a_bed: "drop_on_bed",
    a_collapsing_column: "dam_break",
    grains_across_periodic_sides: "periodic",
    a_settling_sphere: "settling",
    a_channel_with_obstacles: "channel",
    a_moving_lid: "lid",
    a_rock_hit_obliquely: "oblique",
    mixed_shapes_and_sizes: "mixed",
    the_literal_scheme: "literal",
}
