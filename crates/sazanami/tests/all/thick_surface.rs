//! Surfaces of liquids so viscous that the stress is stiff: they come to rest with the steps that a case takes by itself.

use crate::support::{Left, On, Scratch, foretold, load, ran};
use sazanami_numerics::Real;

/// A wave under gravity on a liquid of 1e-3 m^2/s.
const WAVE: &str = include_str!("../cases/thick-surface.toml");
/// A drop of glycerine at rest, with surface tension, in its place.
const DROP: [&str; 6] = [
    "gravity=0 m/s^2",
    "fluid.surface_tension=63 mN/m",
    "fluid.liquid.density=1260 kg/m^3",
    "fluid.liquid.kinematic_viscosity=1.11e-3 m^2/s",
    "run.until=40 ms",
    "liquid.0.region={ cylinder = { centre = [\"0 mm\", \"0 mm\", \"0 mm\"], diameters = [\"1 mm\", \"1 mm\"] } }",
];

/// Largest kinetic energy of the fluid in the first and in the last quarter of the rows \[J].
fn early_and_late(left: &Left) -> [Real; 2] {
    let energy = left.column("kinetic_energy_fluid");
    let quarter = energy.len() / 4;
    let largest = |rows: &[Real]| rows.iter().copied().fold(0.0, Real::max);
    [largest(&energy[..quarter]), largest(&energy[energy.len() - quarter..])]
}

#[test]
fn a_wave_on_a_thick_liquid_levels_as_with_short_steps() {
    let scratch = Scratch::new("thick-wave");
    let run = |name: &str, overrides: &[&str]| ran(WAVE, overrides, &scratch.join(name), On::threads(2));
    let left = run("default", &[]);
    let [early, late] = early_and_late(&left);
    assert!(late < early, "{early} {late}");
    assert!(left.summary["limiter"]["interface_viscosity"].as_u64() > Some(0), "{}", left.summary["limiter"]);
    // What the levelling surface sets in motion; steps of 45 us are late in it by an eighth, at first order.
    let motion = |left: &Left| left.column("kinetic_energy_fluid").iter().sum::<Real>();
    let short = motion(&run("short", &["fluid.dt_max=7 us"]));
    let middle = motion(&run("middle", &["fluid.dt_max=20 us"]));
    assert!((motion(&left) / short - 1.0).abs() < 0.15 && (middle / short - 1.0).abs() < 0.07, "{middle} {short}");
    // A fixed step beyond the limit takes the fluid through it in passes.
    let fixed = run("fixed", &["fluid.dt=1 ms"]);
    let [early, late] = early_and_late(&fixed);
    assert!(late < early && (motion(&fixed) / motion(&left) - 1.0).abs() < 0.15, "{early} {late}");
    assert!(fixed.column("fluid_passes").iter().any(|&passes| passes > 10.0));
}

#[test]
fn a_drop_of_glycerine_at_rest_stays_at_rest() {
    let scratch = Scratch::new("thick-drop");
    let left = ran(WAVE, &DROP, &scratch.join("run"), On::threads(2));
    let [early, late] = early_and_late(&left);
    // In 32 cells it had grown to 1e-12 J within 40 ms; steps of 1 ms in one pass had waves of a few cells grow tenfold.
    assert!(late < 0.1 * early && early < 1e-15, "{early} {late}");
}

#[test]
fn the_limit_of_thick_liquids_under_gas_is_foretold_where_there_are_both() {
    let has = |overrides: &[&str]| {
        let report = foretold(&load(WAVE, overrides).case);
        report.limits.iter().any(|limit| limit.name == "interface_viscosity")
    };
    let region = |fluid: &str, shape: &str| format!("{{ fluid = \"{fluid}\", region = {{ {shape} }} }}");
    let has_regions = |regions: &[String]| has(&[&format!("liquid=[{}]", regions.join(", "))]);
    let all = "half_space = { point = [\"0 mm\", \"0 mm\", \"3 mm\"] }";
    let bubble = "cylinder = { centre = [\"1 mm\", \"0 mm\", \"1 mm\"], diameters = [\"1 mm\", \"1 mm\"] }";
    assert!(has(&[]));
    assert!(!has_regions(&[region("liquid", all)]));
    assert!(has_regions(&[region("liquid", all), region("gas", bubble)]));
    assert!(!has_regions(&[region("liquid", bubble), region("gas", all)]));
    assert!(!has(&["fluid.gas.kinematic_viscosity=1e-3 m^2/s", "fluid.gas.density=1000 kg/m^3"]));
    // A fixed step of ten times the limit takes ten passes.
    let limit = foretold(&load(WAVE, &[]).case).limits.iter().find(|l| l.name == "interface_viscosity").map(|l| l.dt_s);
    let dt = format!("fluid.dt={:e} s", 9.9 * limit.expect("there are both"));
    assert_eq!(foretold(&load(WAVE, &[&dt]).case).fluid_passes, 10);
}
