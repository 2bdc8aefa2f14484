//! A rank boundary is a boundary condition and a thread is nobody's business: small cases of every
//! kind give the same bits for any number of threads, and the same physics for any number of ranks.

use sazanami_numerics::Real;
use sazanami_numerics::snapshot::{Section, Snapshot};

use crate::support::{Left, On, Scratch, Table, ran};

/// Ranks of the decompositions, halves, thirds, 3 x 2, and the threads of each rank.
const ON: [(usize, &[usize]); 4] = [(1, &[4]), (2, &[1, 3]), (3, &[1]), (6, &[1])];
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

const DROP_ON_BED: &str = include_str!("../cases/equivalence-drop-on-bed.toml");

const DAM_BREAK: &str = include_str!("../cases/equivalence-dam-break.toml");

const PERIODIC: &str = include_str!("../cases/equivalence-periodic.toml");

const SETTLING: &str = include_str!("../cases/equivalence-settling.toml");

const CHANNEL: &str = include_str!("../cases/equivalence-channel.toml");

const LID: &str = include_str!("../cases/equivalence-lid.toml");

const OBLIQUE: &str = include_str!("../cases/equivalence-oblique.toml");

const MIXED: &str = include_str!("../cases/equivalence-mixed.toml");

const WETTED: &str = include_str!("../cases/equivalence-wetted.toml");

const CASES: [Small; 12] = [
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
    Small {
        name: "moist",
        apart: false,
        text: DROP_ON_BED,
        overrides: &["dem.bridges={ surface_tension = \"72.8 mN/m\", damp = false }"],
        perturbed: "dem.bridges.liquid_content=0.0101",
    },
    Small {
        name: "wetted",
        apart: true,
        text: WETTED,
        overrides: &[],
        perturbed: "fluid.contact_angle.grains=60.01 deg",
    },
    Small {
        name: "sucked",
        apart: false,
        text: DROP_ON_BED,
        overrides: &[
            "fluid.entry_pressure=600 Pa",
            "fluid.surface_tension=50 mN/m",
            "domain={ size = [\"3.6 mm\", \"3.2 mm\", \"5 mm\"], cells = [18, 16, 25] }",
            "grains.0.count=70",
        ],
        perturbed: "fluid.entry_pressure=600.1 Pa",
    },
    // The literal scheme: velocity form, stress alone, old pressure in the predictor, fixed steps with passes.
    Small {
        name: "literal",
        apart: false,
        text: DROP_ON_BED,
        overrides: &[
            "fluid.convection=velocity_form",
            "coupling.exchange=stress",
            "fluid.pressure_form=incremental",
            "fluid.viscosity=crank_nicolson",
            "fluid.dt=0.08 ms",
        ],
        perturbed: "liquid.0.fall.speed=2.0001 m/s",
    },
];

fn outcome(scratch: &Scratch, small: &Small, on: On, more: Option<&str>) -> Left {
    let output = ["output.figures={ at = [] }", "output.series={ steps = 2 }"];
    let overrides: Vec<&str> = small.overrides.iter().copied().chain(output).chain(more).collect();
    let folder = scratch.join(small.name);
    let left = ran(small.text, &overrides, &folder, on);
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
    a_drop_on_a_ball_at_an_angle: "wetted",
    a_drop_on_a_bed_that_it_makes_moist: "moist",
    a_drop_that_a_bed_sucks_in: "sucked",
    the_literal_scheme: "literal",
}
