//! Keys that would do nothing where they stand are told, and files of beds that a case contradicts.

use crate::absurd_cases::{all_reported, findings};

const LOBOVSKY: &str = "../verification/mps-dam-break-lobovsky/case.toml";
const RIPPLES: &str = "ripples/quick.toml";
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
    let keys = [
        "cfl=0.2",
        "viscosity=off",
        "tol_div=1e-9",
        "pressure_iterations=50",
        "convection=velocity_form",
        "pressure_form=incremental",
    ];
    for key in keys.map(|key| format!("fluid.{key}")) {
        assert!(says(LOBOVSKY, &[&key], IDLE), "{key}");
        assert!(!says(RAINDROP, &[&key], IDLE), "{key}");
    }
    // Negative control: beside their counterparts, as a case for both solvers and a copy of a case have them.
    assert!(!says("both/dam-break.toml", &["solver=mps", "fluid.cfl=0.2"], IDLE));
    for both in [
        ["fluid.cfl=0.2", "particles.courant=0.1"],
        ["fluid.tol_div=1e-9", "particles.tolerance=1e-9"],
        ["fluid.dt=1e-5 s", "particles.dt_max=2 ms"],
    ] {
        assert!(!says(LOBOVSKY, &both, IDLE), "{both:?}");
    }
}

#[test]
fn beds_are_packed_together_and_straight_down() {
    let slanted = "gravity=[\"2 m/s^2\", \"0 m/s^2\", \"-9 m/s^2\"]";
    let shaken = "frame.acceleration=[\"2 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]";
    let flows = "run={ until = \"1 ms\" }";
    const SLANTS: &str = "packed straight down, and gravity in its box slants";
    for (change, words) in [(slanted, "by 12.53 degrees against x3"), (shaken, "by 11.53 degrees against x3")] {
        assert!(says(PACKING, &[change, flows], words) && says(PACKING, &[change, flows], SLANTS), "{change}");
    }
    assert!(!says(PACKING, &[flows], SLANTS) && !says(PACKING, &[slanted], SLANTS));
    assert!(!says(PACKING, &[slanted, flows, "grains.0.placement.packed.level=5 mm"], SLANTS));
    assert!(!says(RIPPLES, &[slanted], SLANTS) && says(RIPPLES, &[slanted, "preparation.settle=0 s"], SLANTS));
    let lifted = "frame.acceleration=[\"0 m/s^2\", \"0 m/s^2\", \"-9.81 m/s^2\"]";
    all_reported(false, &[(PACKING, lifted, "the acceleration of the box lifts these grains off the floor")]);
    // The second population is packed as the first says.
    assert!(says(PACKING, &["grains.1.placement.packed.jitter=0.2"], "`jitter` of `sticks` does nothing"));
    assert!(!says(PACKING, &["grains.0.placement.packed.jitter=0.2"], "does nothing"));
    assert!(!says(GRADED, &[], "does nothing"));
}

#[test]
fn rolling_friction_of_grains_that_are_no_balls_does_nothing() {
    const IDLE: &str = "`dem.rolling_friction` does nothing";
    let rolling = "dem.rolling_friction=0.1";
    assert!(says(GRADED, &[rolling], IDLE));
    // Negative control: a ball among them, and the default.
    assert!(!says(PACKING, &[rolling], IDLE) && !says("heap/column.toml", &[], IDLE));
    assert!(!says(GRADED, &["dem.rolling_friction=0"], IDLE));
}

#[test]
fn probes_on_grains_that_levelling_takes_are_told_on_the_grid_too() {
    const TAKEN: &str = "may be taken away when the bed is levelled";
    let probe = "probe=[{ name = \"top\", body = { population = \"pebbles\", index = 599 } }]";
    assert!(says(PACKING, &[probe, "grains.0.placement.packed.level=1 mm"], TAKEN));
    assert!(!says(PACKING, &[probe], TAKEN));
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
    // What reaches a length of the box beyond it fills it.
    assert!(!says("ripples/paper.toml", &[&water("1 m")], CUT));
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

#[test]
fn the_angle_of_a_heap_in_a_tilted_box_is_told_to_be_against_its_floor() {
    const FLOOR: &str = "the angle of the heap is that against the floor of its box";
    let tilted = "gravity=[\"3.355 m/s^2\", \"0 m/s^2\", \"-9.218 m/s^2\"]";
    assert!(says("heap/column.toml", &[tilted], FLOOR) && says("heap/column.toml", &[tilted], "by 20 degrees"));
    assert!(!says("heap/column.toml", &[], FLOOR) && !says("heap/column.toml", &["gravity=0 m/s^2"], FLOOR));
}

#[test]
fn a_gradient_of_the_pressure_that_drives_gas_is_told() {
    const GAS: &str = "the gas is driven by this gradient of the pressure too";
    let drive = "drive={ acceleration = [\"0.1 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], acts_by = \"volume\" }";
    let half = "liquid.0.region.box.upper=[\"2 m\", \"2 m\", \"1 m\"]";
    assert!(says(CHANNEL, &[drive, half], GAS) && says(CHANNEL, &[drive, half], "gas is driven"));
    let two = "liquid=[{ region.box = { lower = [\"0 m\", \"0 m\", \"0 m\"], upper = [\"2 m\", \"2 m\", \"1 m\"] }, allow_touching_grains = true }, \
               { region.box = { lower = [\"0 m\", \"0 m\", \"1 m\"], upper = [\"2 m\", \"2 m\", \"2 m\"] }, allow_touching_grains = true }]";
    let held = "drive={ mean_velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"], acts_by = \"volume\" }";
    assert!(says(CHANNEL, &[held, half], GAS) && !says(CHANNEL, &[held], GAS) && !says(CHANNEL, &[drive, two], GAS));
    assert!(!says(CHANNEL, &[drive], GAS) && !says(CHANNEL, &[&drive.replace("volume", "mass"), half], GAS));
}

#[test]
fn the_mixing_length_grows_from_a_floor_or_a_bed() {
    const NOTHING: &str = "the mixing length has nothing to work with";
    let (channel, slip) = ("ripples/channel.toml", "boundary.x3_lower=slip");
    let placed = |more: &str| {
        format!("grains.0.placement={{ list = [{{ position = [\"12 mm\", \"4 mm\", \"12 mm\"]{more} }}] }}")
    };
    let (alone, held) = (placed(""), placed(", motion = \"fixed\""));
    assert!(says(channel, &["boundary={ all = \"periodic\" }"], "no floor from which the length grows"));
    assert!(says(channel, &[slip, &alone], NOTHING));
    // Negative controls: a bed over a floor that slips, held grains, a floor that holds the water, no mixing length.
    for fine in [&[slip][..], &[slip, &held], &[&alone], &[slip, &alone, "particles.turbulence=none"]] {
        assert!(!says(channel, fine, NOTHING), "{fine:?}");
    }
}

#[test]
fn a_bed_without_resistance_is_refused() {
    all_reported(false, &[(RIPPLES, "overlap.kozeny=0", "above zero")]);
    assert!(!says(RIPPLES, &["overlap.kozeny=1e-3"], "above zero"));
}

#[test]
fn springs_that_the_weight_of_the_grains_presses_deep_are_told() {
    const PRESSED: &str = "let the weight of the grains press them deep";
    const FLAT: &str = "let the weight of the grains alone press them too deep";
    let with = |stiffness: &str| [format!("contact.default.normal_stiffness={stiffness} N/m")];
    let is_told = |stiffness: &str, what: &str| says(RIPPLES, &with(stiffness).each_ref().map(String::as_str), what);
    assert!(is_told("0.1", PRESSED) && !is_told("0.1", FLAT));
    assert!(is_told("1e-3", FLAT) && !is_told("1e-3", PRESSED));
    assert!(!is_told("200", PRESSED) && !is_told("200", FLAT));
}

#[test]
fn cells_in_another_order_than_the_edges_of_the_box_are_told() {
    const LONG: &str = "times as long as wide";
    let with = |cells: &str| says(FALLING, &[&format!("domain.cells={cells}")], LONG);
    assert!(with("[48, 16, 16]"));
    assert!(!with("[16, 16, 48]") && !with("[1, 16, 48]"));
}

#[test]
fn a_box_that_follows_its_liquid_lets_out_what_it_lets_in() {
    const CLOSED: &str = "the fluid that the liquid falls through cannot leave";
    for closed in ["slip", "no_slip"] {
        let side = format!("boundary.x3_upper={closed}");
        assert!(says(FALLING, &[&side], CLOSED) && says(FALLING, &[&side], "make it `outflow`"), "{closed}");
    }
    assert!(!says(FALLING, &[], CLOSED) && says(FALLING, &["boundary.x1=no_slip"], "a wall would fall with the box"));
}

#[test]
fn keys_of_a_rest_that_does_not_come_before_the_run_are_told() {
    let keys = ["damping=0.5", "strain=0.02", "speed=2 mm/s", "must_rest=false"];
    for key in keys.map(|key| format!("preparation.{key}")) {
        let words = format!("`{}` does nothing", key.split('=').next().unwrap());
        assert!(says(LOBOVSKY, &[&key], &words), "{key}");
        assert!(!says(LOBOVSKY, &[&key, "preparation.relax_steps=10"], &words), "{key}");
        assert!(!says(RIPPLES, &[&key], &words), "{key}");
    }
    // Negative control: the usual values written out, as the copy of a case has them.
    for key in ["damping=0.9", "strain=0.01", "speed=1 mm/s", "must_rest=true", "cache=false"] {
        assert!(!says(LOBOVSKY, &[&format!("preparation.{key}")], "does nothing"), "{key}");
    }
}
