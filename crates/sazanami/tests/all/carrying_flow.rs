//! Case files pose the advection tests of the interface: a flow that is given carries the liquid there and back.

use std::path::Path;

use crate::support::{Left, On, Scratch, go_on, ran, refusal};
use sazanami_test_support::vtk::parse;

/// A round piece of liquid in a box of 32 x 32 cells.
const BOX: &str = include_str!("../cases/carrying-flow-box.toml");

/// The reversed single vortex of Rider and Kothe (1998), as `verification/reversed-vortex` poses it.
const VORTEX: &str = "fluid.carrying_flow={ reversed_vortex = { speed = \"1 m/s\", period = \"8 s\" } }";

const TAYLOR_GREEN: &str = "fluid.initial_velocity={ taylor_green = { speed = \"0.5 m/s\" } }";

/// Shape error that `verification/reversed-vortex` measures on 32 x 32 cells, of a disc. The slice of a sphere one cell thick is smaller by up
/// to half a per cent of its radius.
const MEASURED: f64 = 0.066_139_3;

/// Values in the cells after `step` steps, from the files of fields of a run.
pub(crate) fn values(folder: &Path, step: usize, array: &str) -> Vec<f64> {
    let file = parse(&folder.join(format!("fields/fields-{step:09}.vti")));
    let (kind, _, bytes, _) = file.array(array);
    assert_eq!(kind, "Float64");
    bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect()
}

/// Sum of `|C - C_0|` over the cells times their area [m^2].
fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), 32 * 32);
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / (32.0 * 32.0)
}

#[test]
fn a_case_file_poses_the_reversed_vortex() {
    let scratch = Scratch::new("vortex");
    let out = scratch.join("out");
    ran(BOX, &[VORTEX], &out, On::threads(1));
    let [first, middle, last] = [0, 320, 640].map(|step| values(&out, step, "liquid_fraction"));
    let error = difference(&first, &last);
    println!("shape error {error:.6}, of a disc {MEASURED}");
    assert!((error / MEASURED - 1.0).abs() < 0.02, "{error}");
    let volume = |c: &[f64]| c.iter().sum::<f64>();
    assert!((volume(&last) / volume(&first) - 1.0).abs() < 1e-12);
    // Negative control: half way there is little left where the circle was.
    assert!(difference(&first, &middle) > 1.2 * volume(&first) / (32.0 * 32.0));
}

#[test]
fn a_flow_that_is_given_begins_as_given_and_has_no_momentum_budget() {
    let scratch = Scratch::new("given");
    let out = scratch.join("out");
    ran(BOX, &[VORTEX], &out, On::threads(1).steps(3));
    let has_no_budget = |steps: u64| {
        let Left { summary, series, .. } = Left::in_folder(&out);
        assert_eq!(summary["steps"], steps);
        assert!(summary["momentum"].is_null(), "{}", summary["momentum"]);
        let conservation = &summary["conservation"];
        for key in ["momentum_residual_relative", "momentum_residual_of_initial"] {
            assert!(conservation.get(key).is_some_and(|residual| residual.is_null()), "{conservation}");
        }
        assert!(conservation["liquid_volume_relative_change"].is_number());
        for name in ["momentum_liquid_3", "impulse_gravity_3", "momentum_residual_3", "momentum_residual_relative"] {
            assert!(series.column(name).iter().all(|cell| cell.is_nan()), "{name}");
        }
        series.column("kinetic_energy_fluid")
    };
    // At rest it would have no energy.
    let energy = has_no_budget(3);
    assert!(energy[0] > 0.5 && (energy[1] / energy[0] - 1.0).abs() < 1e-3, "{energy:?}");
    go_on(&out, On::threads(1).steps(2)).0.expect("the run goes on");
    has_no_budget(5);
    let velocity = values(&out, 0, "velocity");
    let largest = velocity.chunks_exact(3).enumerate().map(|(n, found)| {
        let [x, z] = [n % 32, n / 32].map(|n| std::f64::consts::PI * (n as f64 + 0.5) / 32.0);
        let expected = [-x.sin().powi(2) * (2.0 * z).sin(), 0.0, (2.0 * x).sin() * z.sin().powi(2)];
        (0..3).map(|d| (found[d] - expected[d]).abs()).fold(0.0, f64::max)
    });
    let largest = largest.fold(0.0, f64::max);
    assert!(largest < 0.01, "{largest}");
    // Negative control: a flow that is solved for has a budget.
    let Left { summary, series, .. } = ran(BOX, &[], &scratch.join("solved"), On::threads(1).steps(1));
    assert!(summary["conservation"]["momentum_residual_relative"].is_number());
    assert!(series.column("momentum_liquid_3").iter().all(|cell| cell.is_finite()));
}

#[test]
fn initial_velocities_are_those_of_the_formula_and_divergence_is_taken_out() {
    let velocity = |field: &[&str]| {
        let scratch = Scratch::new("initial");
        // One fluid: where densities differ the projection changes the velocity.
        let still = ["liquid=[]", "boundary.x1=periodic", "boundary.x3=periodic", "run.until=0 s"];
        let changes = [&still[..], &["output.fields.at=[\"0 s\"]"], field].concat();
        let out = scratch.join("out");
        ran(BOX, &changes, &out, On::threads(1));
        let found = values(&out, 0, "velocity");
        assert_eq!(found.len(), 3 * 32 * 32);
        found
    };
    let still = velocity(&[]);
    assert!(still.iter().all(|u| *u == 0.0));
    let found = velocity(&[TAYLOR_GREEN]);
    let at = |i: usize, k: usize| {
        let [x, z] = [i, k].map(|n| 2.0 * std::f64::consts::PI * (n as f64 + 0.5) / 32.0);
        [-0.5 * x.sin() * z.cos(), 0.0, 0.5 * x.cos() * z.sin()]
    };
    let [mut apart, mut all] = [0.0; 2];
    for (n, found) in found.chunks_exact(3).enumerate() {
        let expected = at(n % 32, n / 32);
        apart += (0..3).map(|d| (found[d] - expected[d]).powi(2)).sum::<f64>();
        all += expected.iter().map(|u| u * u).sum::<f64>();
    }
    assert!(apart < 1e-4 * all, "{apart} {all}");
}

#[test]
fn carrying_flows_that_make_no_sense_are_refused() {
    let refused = |changes: &[&str], words: &str| {
        let error = refusal(BOX, changes);
        assert!(error.contains(words), "{error}");
    };
    let uniform = "fluid.carrying_flow={ uniform = { velocity = [\"1 m/s\", \"0 m/s\", \"0 m/s\"] } }";
    refused(&[uniform], "goes through a wall at a side of x1");
    let grains = "grains=[{ shape = { sphere = { diameter = \"5 mm\" } }, \
                  placement = { list = [{ position = [\"0.5 m\", \"15 mm\", \"0.5 m\"] }] } }]";
    refused(&[VORTEX, "material.sand.density=2650 kg/m^3", grains], "a carrying flow and grains");
    refused(&[VORTEX, TAYLOR_GREEN], "a carrying flow and an initial velocity");
    let inflow = ["boundary.x1_lower={ inflow = { velocity = \"1 m/s\" } }", "boundary.x1_upper=outflow"];
    refused(&[VORTEX, inflow[0], inflow[1]], "inflow");
}
