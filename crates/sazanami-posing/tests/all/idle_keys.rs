//! Keys that would do nothing where they stand are told, and files of beds that a case contradicts.

use crate::absurd_cases::{all_reported, findings};

const LOBOVSKY: &str = "../verification/mps-dam-break-lobovsky/case.toml";
const RAINDROP: &str = "raindrop/small.toml";
const GRADED: &str = "raindrop/graded.toml";
const PACKING: &str = "templates/packing.toml";
const CHANNEL: &str = "../verification/grain-arrays/case.toml";
const FALLING: &str = "../verification/drop-at-terminal-speed/case.toml";

/// Whether a finding on a changed case has these words.
fn says(case: &str, overrides: &[&str], words: &str) -> bool {
    findings(case, overrides).1.iter().any(|text| text.contains(words))
}

#[test]
fn keys_of_the_grid_do_nothing_to_moving_particles() {
    const IDLE: &str = "does nothing with `solver = \"mps\"`";
    let keys = ["dt=1e-6 s", "cfl=0.2", "viscosity=off", "tol_div=1e-9"];
    for key in keys.map(|key| format!("fluid.{key}")) {
        assert!(says(LOBOVSKY, &[&key], IDLE), "{key}");
        assert!(!says(RAINDROP, &[&key], IDLE), "{key}");
    }
    // Negative control: beside their counterparts, as a case for both solvers and a copy of a case have them.
    for both in [
        ["fluid.cfl=0.2", "particles.courant=0.1"],
        ["fluid.tol_div=1e-9", "particles.tolerance=1e-9"],
        ["fluid.dt_max=1e-5 s", "particles.dt_max=2 ms"],
    ] {
        assert!(!says(LOBOVSKY, &both, IDLE), "{both:?}");
    }
}

#[test]
fn beds_are_packed_together_and_straight_down() {
    let slanted = "gravity=[\"2 m/s^2\", \"0 m/s^2\", \"-9 m/s^2\"]";
    all_reported(true, &[(PACKING, slanted, "by 12.53 degrees against x3")]);
    const SLANTS: &str = "gravity slants";
    assert!(!says(PACKING, &[], SLANTS));
    assert!(!says(PACKING, &[slanted, "grains.0.placement.packed.level=5 mm"], SLANTS));
    // The second population is packed as the first says.
    assert!(says(PACKING, &["grains.1.placement.packed.jitter=0.2"], "`jitter` of `sticks` does nothing"));
    assert!(!says(PACKING, &["grains.0.placement.packed.jitter=0.2"], "does nothing"));
    assert!(!says(GRADED, &[], "does nothing"));
}

#[test]
fn probes_on_grains_that_levelling_takes_are_told_on_the_grid_too() {
    const TAKEN: &str = "may be taken away when the bed is levelled";
    let probe = "probe=[{ name = \"top\", body = { population = \"pebbles\", index = 599 } }]";
    assert!(says(PACKING, &[probe, "grains.0.placement.packed.level=1 mm"], TAKEN));
    assert!(!says(PACKING, &[probe], TAKEN));
}

#[test]
fn what_holds_a_net_flow_has_no_time_of_answer() {
    const IDLE: &str = "`answer` does nothing to a net flow on the grid";
    let drive = |more: &str| {
        format!("drive={{ mean_velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"], acts_by = \"volume\"{more} }}")
    };
    assert!(says(CHANNEL, &[&drive(", answer = \"2 s\"")], IDLE));
    assert!(!says(CHANNEL, &[&drive("")], IDLE));
}

#[test]
fn a_box_that_follows_is_not_written_in_the_laboratory() {
    all_reported(false, &[(FALLING, "output.frame=laboratory", "a box that follows is written as it is")]);
    assert!(findings(FALLING, &[]).0);
}

#[test]
fn liquids_that_reach_over_the_box_are_told() {
    const CUT: &str = "reaches over the edge of the box";
    let water = |upper: &str| {
        format!(
            "liquid=[{{ region.box = {{ lower = [\"-75 mm\", \"0 mm\", \"0 mm\"], upper = [\"{upper}\", \"20 mm\", \"20 mm\"] }} }}]"
        )
    };
    assert!(says("ripples/paper.toml", &[&water("80 mm")], CUT));
    assert!(!says("ripples/paper.toml", &[&water("75 mm")], CUT));
}

#[test]
fn sizes_in_a_bed_file_are_those_of_the_case() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("bed.csv");
    std::fs::write(&file, "x1_m,x2_m,x3_m,size_factor\n0.003,0.003,0.0015,3\n0.006,0.006,0.0005,1\n")
        .expect("it is written");
    let placement = format!("grains.0.placement={{ bed = {{ file = \"{}\" }} }}", file.display());
    let own = [&placement[..], "grains.0.count=2"];
    const OTHER: &str = "of other sizes than `size` says";
    assert!(says(RAINDROP, &own, OTHER));
    let differs = |size: &str| says(RAINDROP, &[&own[..], &[size]].concat(), OTHER);
    assert!(!differs("grains.0.size={ uniform = { lower = 1, upper = 3 } }"));
    assert!(differs("grains.0.size={ uniform = { lower = 1, upper = 2.9 } }"));
}
