//! Liquids that meet within cells: what one leaves of the other, in all orders.

use crate::carrying_flow::values;
use crate::support::{On, Scratch, ran};

const BOX: &str = "gravity = \"0 m/s^2\"\ndomain = { size = [\"10 mm\", \"10 mm\", \"10 mm\"], cells = [10, 10, 10] }\n\
    boundary.all = \"slip\"\noutput = { precision = \"double\", figures = { at = [] }, grains = { at = [] }, fields = { at = [\"0 s\"] } }\nrun = { until = \"1 s\", steps = 1 }\n";

#[test]
fn liquids_that_meet_within_cells_keep_their_volume() {
    let scratch = Scratch::new("touching");
    // Liquid in cell volumes, of a thousand.
    let poured = |name: &str, liquids: &str| {
        let out = scratch.join(name);
        ran(&format!("{BOX}{liquids}"), &[], &out, On::threads(1));
        values(&out, 0, "liquid_fraction").iter().sum::<f64>()
    };
    let slab = |d: usize, from: &str, to: &str, more: &str| {
        let corner = |at: &str, other: &str| {
            let all: [String; 3] = std::array::from_fn(|n| format!("\"{} mm\"", if n == d { at } else { other }));
            all.join(", ")
        };
        format!(
            "[[liquid]]\n{more}region.box = {{ lower = [{}], upper = [{}] }}\n",
            corner(from, "0"),
            corner(to, "10")
        )
    };
    for d in 0..3 {
        for middle in ["4.5", "4.3"] {
            let (below, above) = (slab(d, "0", middle, ""), slab(d, middle, "8", ""));
            for (order, text) in [("up", format!("{below}{above}")), ("down", format!("{above}{below}"))] {
                let found = poured(&format!("{d}-{middle}-{order}"), &text);
                assert!((found - 800.0).abs() < 1e-3, "along x{}, {middle} mm, {order}: {found}", d + 1);
            }
        }
    }
    // One within the other takes its place, and so does gas; half of each other they share a half.
    let pool = slab(2, "0", "4.5", "");
    let inside = poured("inside", &format!("{pool}{}", slab(2, "4.1", "4.4", "")));
    assert!((inside - 450.0).abs() < 1e-3, "{inside}");
    let gas = poured("gas", &format!("{pool}{}", slab(2, "4.25", "4.75", "fluid = \"gas\"\n")));
    assert!((gas - 425.0).abs() < 1e-3, "{gas}");
    let across = poured("across", &format!("{pool}{}", slab(2, "4.25", "4.75", "")));
    assert!((across - 475.0).abs() < 1e-3, "{across}");
    // Gas between the points by which a cell is looked at takes its part of what is there on the mean.
    let thin = poured("thin", &format!("{pool}{}", slab(2, "4.26", "4.3", "fluid = \"gas\"\n")));
    assert!((thin - 448.0).abs() < 1e-3, "{thin}");
    // Control: with a gap between them there is less.
    let apart = poured("apart", &format!("{pool}{}", slab(2, "4.7", "8", "")));
    assert!((apart - 780.0).abs() < 1e-3, "{apart}");
}

#[test]
fn liquids_of_moving_particles_that_meet_between_them_keep_their_volume() {
    let scratch = Scratch::new("touching-particles");
    let poured = |name: &str, from: &str| {
        let liquid = |low: &str, high: &str| {
            format!(
                "[[liquid]]\nregion.box = {{ lower = [\"0 mm\", \"0 mm\", \"{low} mm\"], upper = [\"10 mm\", \"10 mm\", \"{high} mm\"] }}\n"
            )
        };
        let particles = "solver = \"mps\"\nparticles = { spacing = \"1 mm\", dt_max = \"0.1 ms\" }\n\
                         fluid.liquid = { density = \"1000 kg/m^3\", kinematic_viscosity = \"1e-6 m^2/s\" }\n";
        let text = format!("{particles}{BOX}{}{}", liquid("0", "4.5"), liquid(from, "8"));
        let left = ran(&text, &[], &scratch.join(name), On::threads(1));
        left.summary["counts"]["fluid_particles"].as_u64().expect("a number")
    };
    assert!((797..=803).contains(&poured("meet", "4.5")));
    // Control: with a gap between them there are fewer.
    assert!((777..=783).contains(&poured("apart", "4.7")));
}
