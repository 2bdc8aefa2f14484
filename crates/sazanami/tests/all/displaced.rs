//! Liquids of moving particles, and the grains that lie in them or do not, as `check` counts them before a run.

use std::f64::consts::PI;

use sazanami::check::{CostModel, Known, check};
use sazanami::feasible;
use sazanami::machine::Machine;

use crate::support::{On, Scratch, bed_of_balls, heard, load};

/// Drops over a bed that stands half in water.
const RAIN: &str = include_str!("../cases/displaced-rain.toml");

/// Volumes of the liquids [mm^3], the particles foretold, and those that the run pours.
fn counted(name: &str, overrides: &[&str]) -> (Vec<f64>, f64, f64) {
    let loaded = load(RAIN, overrides);
    let (machine, model) = (Machine::this(), CostModel::default());
    let facts = feasible::check(&loaded, &machine, &model).unwrap_or_else(|error| panic!("{error}")).facts;
    let report = check(&loaded.case, Known { shapes: &facts, made_ready: false }, &machine, 1, &model);
    let volumes = report.liquids.iter().map(|liquid| 1e9 * liquid.volume_m3.expect("it has a formula")).collect();
    let folder = Scratch::new(name);
    let said = heard(&loaded, &On::threads(1).steps(1).options(Some(&folder.join("run")))).messages;
    let poured = said.iter().find(|message| message.contains("poured")).expect("it is told");
    let poured = poured.split(' ').nth(1).and_then(|count| count.parse().ok()).expect("a number");
    (volumes, report.particles.expect("of moving particles").fluid as f64, poured)
}

#[test]
fn only_grains_that_lie_in_a_liquid_displace_it() {
    let drop = PI / 6.0 * 64.0;
    // Of the bed two of its five layers and a half lie below 2 mm.
    let (volumes, foretold, poured) = counted("rain", &[]);
    let solid = PI / 6.0 * 80.0;
    assert!((volumes[0] - (240.0 - 1.82 * solid)).abs() < 0.05 * 240.0, "{volumes:?}");
    assert!((volumes[1] - drop).abs() < 1e-6, "{volumes:?}");
    assert!((foretold / poured - 1.0).abs() < 0.1, "{foretold} {poured}");
    // Grains that are fed in later displace nothing as the run begins.
    let fed = "grains.0={ count = 1000, shape = { sphere = { diameter = \"1 mm\" } }, placement = { fed = { side = \"x3_upper\", \
               rate = \"200 Hz\", velocity = [\"0 m/s\", \"0 m/s\", \"-0.2 m/s\"] } } }";
    let (volumes, foretold, poured) = counted("fed", &[fed]);
    assert!((volumes[0] - 240.0).abs() < 1e-6 && (foretold / poured - 1.0).abs() < 0.02, "{volumes:?} {poured}");
    // Of a packed bed that part which lies in the water, as for the run.
    let packed = |level: &str| {
        format!(
            "grains.0={{ shape = {{ sphere = {{ diameter = \"1 mm\" }} }}, placement = {{ packed = {{ level = \"{level}\" }} }} }}"
        )
    };
    let drop_above = "liquid.1.region.sphere={ diameter = \"4 mm\", centre = [\"3 mm\", \"3 mm\", \"14 mm\"] }";
    let (volumes, foretold, poured) = counted("packed", &[&packed("5 mm"), drop_above]);
    assert!((volumes[0] - 0.4 * 240.0).abs() < 0.03 * 240.0 && (volumes[1] - drop).abs() < 1e-6, "{volumes:?}");
    assert!((foretold / poured - 1.0).abs() < 0.15, "{foretold} {poured}");
    // The same of a bed from a file, which lies in a looser lattice than beds do.
    let scratch = Scratch::new("displaced-file");
    let balls = bed_of_balls(&scratch.join("balls.bed"), [12, 10, 24], 5);
    let (volumes, foretold, poured) = counted("file", &[&balls, drop_above]);
    assert!((volumes[0] - 0.4 * 240.0).abs() < 0.03 * 240.0 && (volumes[1] - drop).abs() < 1e-6, "{volumes:?}");
    assert!((foretold / poured - 1.0).abs() < 0.2, "{foretold} {poured}");
    // Negative control: below the water all of it counts.
    let deep = "liquid.0.region.box.upper=[\"12 mm\", \"10 mm\", \"8 mm\"]";
    let (volumes, foretold, poured) = counted("deep", &[&packed("5 mm"), drop_above, deep]);
    assert!((volumes[0] - (960.0 - 0.569 * 540.0)).abs() < 0.01 * 960.0, "{volumes:?}");
    assert!((foretold / poured - 1.0).abs() < 0.05, "{foretold} {poured}");
}
