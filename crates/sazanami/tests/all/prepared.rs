//! Liquids that the preparation of a tank would move before the run begins.

use sazanami::machine::Machine;
use sazanami_io::vtk::VtkFile;

use crate::support::{Left, On, Scratch, bed_of_balls, before_run, heard, load, ran};

/// A drop above a bed.
const DROP: &str = include_str!("../cases/prepared-drop.toml");
const AS_PUT: &str = "preparation={ relax_steps = 0, settle = \"0 s\", cache = false }";

/// Whether the case can run, and what is found wrong with it or warned of before.
fn found(overrides: &[&str]) -> (bool, Vec<String>) {
    before_run(&load(DROP, overrides), &Machine::this())
}

/// Whether the drop is said to fall before the run.
fn falls(found: &[String]) -> bool {
    found.iter().any(|finding| finding.contains("`drop` would fall before the run begins"))
}

#[test]
fn liquids_that_would_fall_before_the_run_are_refused_with_the_way_out() {
    let scratch = Scratch::new("prepared-drop");
    let balls = bed_of_balls(&scratch.join("balls.bed"), [9, 9, 14], 4);
    let placed = |more: &str| {
        format!(
            "liquid.0={{ name = \"drop\", region = {{ sphere = {{ diameter = \"4 mm\", centre = [\"4 mm\", \"4 mm\", \"10 mm\"] }} }}{more} }}"
        )
    };
    let moving = "liquid.0.velocity=[\"0 m/s\", \"0 m/s\", \"-1 m/s\"]";
    let placed_moving = placed(", fall = { speed = \"1 m/s\" }");
    let in_the_air: [&[&str]; 4] = [&[], &[&balls], &[moving], &[&placed_moving]];
    for put in in_the_air {
        let (runs, found) = found(put);
        assert!(!runs && falls(&found), "{put:?}: {found:?}");
        // That its velocity is lost is no second message.
        assert!(
            !found.iter().any(|finding| finding.contains("does not begin with its velocity")),
            "{put:?}: {found:?}"
        );
    }
    // Where a point is given it may be meant to come down and rest first.
    let (runs, warned) = found(&[&placed("")]);
    assert!(runs && falls(&warned), "{warned:?}");
    // Negative controls: what lies on the bed, on other water, or where nothing is prepared or falls.
    let pool = "liquid.1.region.box.upper=[\"9 mm\", \"9 mm\", \"6 mm\"]";
    let on_bed = "liquid.0.gap_above_bed=0 mm";
    for borne in [
        &[on_bed][..],
        &[pool],
        &[AS_PUT],
        &["run.packing_only=true"],
        &[&balls, on_bed],
        &[&balls, pool],
        &[&balls, AS_PUT],
    ] {
        let (runs, found) = found(borne);
        assert!(runs && !falls(&found), "{borne:?}: {found:?}");
    }
    // The way out begins with the drop above the bed.
    let said = |name: &str, overrides: &[&str]| {
        let options = On::threads(2).steps(1).options(Some(&scratch.join(name)));
        heard(&load(DROP, overrides), &options).messages
    };
    let advises = |said: &[String]| said.iter().any(|message| message.contains("preparation.relax_steps = "));
    let (folder, fields) = (scratch.join("run"), "output.fields.at=[\"0 s\"]");
    assert!(!advises(&said("run", &[AS_PUT, moving, fields])));
    // Of the preparation it is told where it would leave the water in its place.
    assert!(!advises(&said("above", &[AS_PUT, &balls])));
    assert!(advises(&said("on", &[AS_PUT, &balls, on_bed])));
    let left = Left::in_folder(&folder);
    let momentum = left.column("momentum_3")[0];
    assert!((momentum / -33.5e-6 - 1.0).abs() < 0.1, "{momentum}");
    let bed = 1e-3 * left.summary["observables"]["bed"]["height_mm"].as_f64().expect("there is a bed");
    let places = VtkFile::read(&folder.join("fields/fields-000000000.vtp")).and_then(|file| file.doubles("Points"));
    let heights = places.expect("the run left it").into_iter().skip(2).step_by(3).map(|z| z - bed);
    let of_drop: Vec<f64> = heights.filter(|height| *height > 0.0).collect();
    // Particles of a spacing of 1 mm between 2 and 6 mm above it.
    let [lowest, highest] = [f64::min, f64::max].map(|of| of_drop.iter().copied().reduce(of).expect("there is a drop"));
    assert!((1.9e-3..3.1e-3).contains(&lowest) && (4.9e-3..6.1e-3).contains(&highest), "{lowest} {highest}");
}

/// A ball of given motion above a bed.
const BALL: &str = include_str!("../cases/prepared-ball.toml");

#[test]
fn grains_whose_motion_is_prescribed_wait_for_the_run_to_begin() {
    let scratch = Scratch::new("prepared-ball");
    for on in [On::threads(1), On::ranks(2, 1)] {
        let left = ran(BALL, &[], &scratch.join(&on.ranks.to_string()), on);
        let ball = left.probe("ball");
        let of = |name: &str| ball.column(name);
        let (time, z) = (of("time"), of("position_3"));
        assert_eq!((time[0], z[0]), (0.0, 20e-3), "it lies where the case puts it");
        assert!(of("velocity_3").iter().all(|v| *v == -0.5) && of("spin_1").iter().all(|v| (*v - 7.0).abs() < 1e-12));
        let off = time.iter().zip(&z).map(|(t, z)| (z - (20e-3 - 0.5 * t)).abs()).fold(0.0, f64::max);
        assert!(time.len() > 3 && off < 1e-12, "{off}");
    }
    // One that forces move would lose its velocity: refused, but for a run that begins with all as it is put.
    let free = "grains.1.motion=free";
    let refuses = |overrides: &[&str]| {
        let (runs, found) = before_run(&load(BALL, overrides), &Machine::this());
        !runs && found.iter().any(|finding| finding.contains("`ball` would not begin with its velocity"))
    };
    assert!(refuses(&[free]) && !refuses(&[]) && !refuses(&[free, AS_PUT]));
    let left = ran(BALL, &[free, AS_PUT], &scratch.join("thrown"), On::threads(1));
    assert_eq!(left.probe("ball").column("position_3")[0], 20e-3);
    // Put there at rest it may be meant to come down.
    let at_rest = "grains.1.placement.list.0={ position = [\"6 mm\", \"6 mm\", \"20 mm\"] }";
    let falls = |overrides: &[&str]| {
        let (runs, found) = before_run(&load(BALL, overrides), &Machine::this());
        assert!(runs, "{found:?}");
        found.iter().any(|finding| finding.contains("grain 0 of `ball` moves before the run begins"))
    };
    assert!(falls(&[free, at_rest]) && !falls(&[at_rest]) && !falls(&[free, at_rest, AS_PUT]));
    assert!(!falls(&[free, at_rest, "grains.1.release=1 ms"]));
}
