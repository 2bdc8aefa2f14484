//! What a held flow of moving particles is measured against, what it bears, and what grains in it feel.

use crate::support::{Left, On, Scratch, ran};
use sazanami_numerics::Real;

/// A viscous liquid between two plates 4 mm apart, at a mean velocity of 10 mm/s along x1.
const PLATES: &str = include_str!("../cases/driven-plates.toml");
/// Held spheres whose drag stops water within 0.5 ms, and water that is to flow through them at 5 mm/s.
const BED: &str = include_str!("../cases/driven-bed.toml");

#[test]
fn a_mean_velocity_is_held_against_the_tank_whichever_frame_is_computed_in() {
    let scratch = Scratch::new("held-tank");
    let flow = |walls: &str| {
        let motion = format!(
            "frame.motion={{ amplitude = [\"1 mm\", \"0 m\", \"0 m\"], frequency = \"10 Hz\", ramp = \"0 s\", walls = \"{walls}\" }}"
        );
        let left = ran(PLATES, &["solver=mps", &motion, "run.until=50 ms"], &scratch.join(walls), On::threads(2));
        [left.column("mean_velocity_1"), left.column("time")]
    };
    let [[resting, times], [moving, again]] = [flow("at_rest"), flow("moving")];
    assert_eq!(times, again);
    // The walls go at up to 63 mm/s.
    let apart = resting.iter().zip(&moving).skip(1).map(|(a, b)| (a - b).abs()).fold(0.0, Real::max);
    assert!(apart < 1e-3, "{apart}: {resting:?} {moving:?}");
    // Control: the tank shakes the flow.
    let most = resting.iter().skip(1).map(|u| (u - 10e-3).abs()).fold(0.0, Real::max);
    assert!(most > 2e-3, "{resting:?}");
}

#[test]
fn a_net_flow_of_zero_bears_the_weight_of_what_nothing_else_holds() {
    let scratch = Scratch::new("held-weight");
    let first = |name: &str, more: &[&str]| {
        let keys = ["solver=mps", "gravity=9.8 m/s^2", "drive.mean_velocity=[\"0 m/s\", \"0 m/s\", \"0 m/s\"]"];
        let short = ["output.series={ steps = 1 }", "run.steps=2"];
        let left = ran(BED, &[&keys[..], &short, more].concat(), &scratch.join(name), On::threads(1));
        left.column("driving_acceleration_3")[1]
    };
    let held = first("held", &[]);
    assert!((held / 9.8 - 1.0).abs() < 0.02, "{held}");
    // Control: the gradient bears grains that are free.
    let free = first("free", &["grains.0.motion=free"]);
    assert!(free > 1.2 * 9.8, "{free}");
}

#[test]
fn drag_is_the_law_at_the_least_void_fraction_where_that_cuts() {
    let scratch = Scratch::new("held-least-void");
    let drag = |name: &str, more: &[&str]| {
        let probe = format!("{BED}[[probe]]\nname = \"grain\"\nbody = {{ index = 100 }}\nevery = \"5 ms\"\n");
        let keys = ["solver=mps", "gravity=0 m/s^2"];
        let left: Left = ran(&probe, &[&keys[..], more].concat(), &scratch.join(name), On::threads(2));
        let speed = left.last("mean_velocity_3");
        assert!((speed / 5e-3 - 1.0).abs() < 0.02, "{name}: {speed}");
        left.probe("grain").last("drag_3")
    };
    // Spheres that take up 0.39 of the space, counted as 0.3, and as many in a box of which they take up 0.3.
    let cut = drag("cut", &["overlap.least_void=0.7"]);
    let edge = "1.9269 mm";
    let cube = format!("[\"{edge}\", \"{edge}\", \"{edge}\"]");
    let sparse = [
        format!("domain.size={cube}"),
        "particles.spacing=0.2409 mm".to_owned(),
        format!("liquid.0.region.box.upper={cube}"),
    ];
    let sparse = drag("sparse", &sparse.each_ref().map(String::as_str));
    assert!((cut / sparse - 1.0).abs() < 0.1, "{cut} {sparse}");
    // Control: uncut it is more.
    let dense = drag("dense", &[]);
    assert!(dense > 1.3 * cut, "{dense} {cut}");
}

#[test]
fn the_forces_of_a_probe_are_what_moves_the_grain() {
    const SINKING: &str = "solver = \"mps\"\ngravity = \"9.81 m/s^2\"\n\
        domain.size = [\"8 mm\", \"8 mm\", \"12 mm\"]\nparticles = { spacing = \"1 mm\", dt_max = \"0.2 ms\" }\n\
        fluid.liquid = { density = \"1000 kg/m^3\", kinematic_viscosity = \"1e-6 m^2/s\" }\nmaterial.sand.density = \"2650 kg/m^3\"\n\
        contact.default = { normal_stiffness = \"400 N/m\", restitution = 0.5 }\n\
        overlap = { added_mass = \"constant\", lift = \"mei\" }\n\
        output = { fields = { at = [] }, grains = { at = [] }, figures = { at = [] } }\nrun.until = \"10 ms\"\n\
        [[liquid]]\nregion.box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"8 mm\", \"8 mm\", \"12 mm\"] }\n\
        [[grains]]\nshape.sphere.diameter = \"1 mm\"\nplacement.list = [{ position = [\"4.2 mm\", \"3.9 mm\", \"9 mm\"] }]\n\
        [[probe]]\nname = \"grain\"\nbody = {}\nsteps = 1\n";
    let scratch = Scratch::new("held-forces");
    let left = ran(SINKING, &[], &scratch.join("run"), On::threads(1));
    let probe = left.probe("grain");
    let mass = 2650.0 * std::f64::consts::PI / 6.0 * 1e-9;
    let (time, velocity) = (probe.column("time"), probe.column("velocity_3"));
    let sum = |names: &[&str]| -> Vec<Real> {
        let columns: Vec<Vec<Real>> = names.iter().map(|name| probe.column(&format!("{name}_3"))).collect();
        (0..time.len()).map(|n| columns.iter().map(|column| column[n]).sum()).collect()
    };
    let all = sum(&["contact_force", "drag", "pressure_force", "lift", "added_mass_force"]);
    let without = sum(&["contact_force", "drag", "pressure_force"]);
    let weight = mass * 9.81;
    let off = |forces: &[Real]| {
        let steps = (2..time.len()).map(|n| {
            let moved = mass * (velocity[n] - velocity[n - 1]) / (time[n] - time[n - 1]);
            (moved - forces[n] + weight).abs() / weight
        });
        steps.fold(0.0, Real::max)
    };
    assert!(time.len() > 20 && off(&all) < 1e-6, "{} {:?}", off(&all), time.len());
    // Negative control: without the added mass it would fall faster.
    assert!(off(&without) > 0.02, "{}", off(&without));
}
