//! Probes, planes and gauges on the lower and upper sides of the box, in its corners and at periodic seams.

use std::fmt::Write as _;

use crate::support::{On, Scratch, ran};
use sazanami_numerics::Real;

const BOX: &str = include_str!("../cases/sides-observed-box.toml");

/// The last row of each probe, by its name.
fn read(
    case: &str,
    probes: &[(String, String)],
    overrides: &[&str],
    name: &str,
    on: On,
) -> impl Fn(&str, &str) -> Real + use<> {
    let scratch = Scratch::new(name);
    let mut text = case.to_owned();
    for (name, place) in probes {
        let _ = write!(text, "[[probe]]\nname = \"{name}\"\n{place}\nevery = \"1 ms\"\n");
    }
    let left = ran(&text, overrides, scratch.path(), on);
    move |probe: &str, column: &str| left.probe(probe).last(column)
}

fn mm(x: Real) -> String {
    format!("\"{x} mm\"")
}

/// Probes at `points` \[mm], `p0` and so on.
fn at_points(points: &[[Real; 3]]) -> Vec<(String, String)> {
    let probe = |(n, point): (usize, &[Real; 3])| (format!("p{n}"), format!("point = [{}]", point.map(mm).join(", ")));
    points.iter().enumerate().map(probe).collect()
}

#[test]
fn gauges_read_the_pool_on_all_sides_and_not_what_falls_on_it() {
    let pool = "liquid=[{ region.half_space = { point = [\"0 m\", \"0 m\", \"9 mm\"] } }, { region.sphere = { centre = [\"25 mm\", \"9 mm\", \"18 mm\"], diameter = \"6 mm\" } }]";
    let places =
        [[0.0, 0.0], [32.0, 0.0], [0.0, 16.0], [32.0, 16.0], [16.0, 16.0], [32.0, 8.0], [7.0, 5.0], [25.0, 9.0]];
    let gauges: Vec<(String, String)> = places
        .iter()
        .enumerate()
        .map(|(n, [x, y])| (format!("g{n}"), format!("gauge = [{}, {}]", mm(*x), mm(*y))))
        .collect();
    for on in [On::threads(1), On::ranks(2, 1), On::ranks(4, 1)] {
        let at = read(BOX, &gauges, &[pool], &format!("gauges-{}", on.ranks), on);
        for (n, place) in places.iter().enumerate() {
            let level = at(&format!("g{n}"), "water_level");
            assert!((level - 9e-3).abs() < 0.05e-3, "{place:?}: {level}");
        }
    }
    // Negative controls: a deeper pool is seen everywhere, and a column that reaches up from the floor is its height.
    let deeper = pool.replace("\"9 mm\"]", "\"11 mm\"]");
    let at = read(BOX, &gauges, &[&deeper], "gauges-deep", On::threads(1));
    assert!((at("g3", "water_level") - 11e-3).abs() < 0.05e-3);
    let column = "liquid=[{ region.box = { lower = [\"20 mm\", \"0 m\", \"0 m\"], upper = [\"32 mm\", \"16 mm\", \"18 mm\"] } }]";
    let at = read(BOX, &gauges, &[column, "run.until=0.1 ms", "fluid.dt_max=0.05 ms"], "gauges-column", On::threads(1));
    assert!((at("g7", "water_level") - 18e-3).abs() < 0.2e-3 && at("g0", "water_level") == 0.0);
}

#[test]
fn a_gauge_over_a_block_reads_its_top_until_water_covers_it() {
    let block = "grains=[{ name = \"block\", motion = \"fixed\", shape = { box = { size = [\"12 mm\", \"8 mm\", \"6 mm\"] } }, \
                 placement = { list = [{ position = [\"16 mm\", \"8 mm\", \"3 mm\"] }] } }]";
    let material = "material.stone.density=2500 kg/m^3";
    let contact = "contact.default.normal_stiffness=1e3 N/m";
    let gauges = [("on", [16.0, 8.0]), ("beside", [3.0, 3.0])]
        .map(|(name, [x, y])| (name.to_owned(), format!("gauge = [{}, {}]", mm(x), mm(y))));
    let levels = |liquid: &str, name: &str| {
        let brief = ["run.until=0.1 ms", "fluid.dt_max=0.05 ms"];
        let at = read(BOX, &gauges, &[&[material, contact, block, liquid][..], &brief].concat(), name, On::threads(1));
        ["on", "beside"].map(|gauge| 1e3 * at(gauge, "water_level"))
    };
    let pool = |deep: &str| {
        format!(
            "liquid=[{{ region.half_space = {{ point = [\"0 m\", \"0 m\", \"{deep} mm\"] }}, allow_touching_grains = true }}]"
        )
    };
    for (liquid, expected) in [
        ("liquid=[]".to_owned(), [6.0, 0.0]),
        (pool("4"), [6.0, 4.0]),
        (pool("6.3"), [6.3, 6.3]),
        (pool("9"), [9.0, 9.0]),
    ] {
        let found = levels(&liquid, &format!("block-{}", expected[1]));
        assert!(
            found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 0.05),
            "{found:?} for {expected:?}"
        );
    }
}

#[test]
fn planes_on_upper_sides_have_their_flux_and_pressure() {
    let plug = "liquid=[{ region.half_space = { point = [\"0 m\", \"0 m\", \"1 m\"] }, velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"] }]";
    let sides = "boundary={ all = \"slip\", x1_lower = { inflow = { velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"] } }, x1_upper = { fixed_pressure = { fluid = \"liquid\" } } }";
    let positions = [0.0, 0.9, 16.0, 31.1, 32.0];
    let mut planes: Vec<(String, String)> =
        positions.iter().enumerate().map(|(n, x)| (format!("x{n}"), format!("plane.x1 = {}", mm(*x)))).collect();
    for (n, z) in [0.0, 12.0, 24.0].into_iter().enumerate() {
        planes.push((format!("z{n}"), format!("plane.x3 = {}", mm(z))));
    }
    let flux: Real = 0.1 * 0.016 * 0.024;
    for on in [On::threads(1), On::ranks(2, 1)] {
        let at = read(BOX, &planes, &[plug, sides], &format!("planes-{}", on.ranks), on);
        for (n, place) in positions.iter().enumerate() {
            for column in ["volume_flux", "liquid_flux"] {
                let found = at(&format!("x{n}"), column);
                assert!((found / flux - 1.0).abs() < 1e-6, "{place}, {column}: {found}");
            }
            let pressure = at(&format!("x{n}"), "mean_pressure");
            assert!((pressure / (998.2 * 9.8 * 12e-3) - 1.0).abs() < 1e-2, "{place}: {pressure}");
        }
        // Hydrostatic to the sides themselves: nothing on top, all the water on the floor.
        let pressure = [0, 1, 2].map(|n| at(&format!("z{n}"), "mean_pressure"));
        let weight = pressure[0] - pressure[2];
        assert!((weight / 235.0 - 1.0).abs() < 0.01 && pressure[2].abs() < 1.0, "{pressure:?}");
        assert!((pressure[1] / (0.5 * weight) - 1.0).abs() < 0.02 && at("z2", "volume_flux") == 0.0);
    }
    // What comes back in through an open side is what stands outside: gas above the pool, not the water that is inside.
    let pool = "liquid=[{ region.half_space = { point = [\"0 m\", \"0 m\", \"12 mm\"] }, velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"] }, { fluid = \"gas\", region.box = { lower = [\"0 m\", \"0 m\", \"12 mm\"], upper = [\"32 mm\", \"16 mm\", \"24 mm\"] }, velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"] }]";
    let at =
        read(BOX, &planes, &[pool, "boundary={ all = \"slip\", x1 = \"outflow\" }"], "planes-pool", On::threads(1));
    for n in 0..positions.len() {
        let found = [at(&format!("x{n}"), "volume_flux"), at(&format!("x{n}"), "liquid_flux")];
        assert!((found[0] / flux - 1.0).abs() < 1e-6 && (found[1] / flux - 0.5).abs() < 1e-6, "{n}: {found:?}");
    }
}

#[test]
fn the_two_sides_of_a_periodic_seam_read_the_same() {
    let vortex = "fluid.initial_velocity={ taylor_green = { speed = \"0.1 m/s\" } }";
    let drop = "liquid=[{ region.sphere = { centre = [\"1 mm\", \"15 mm\", \"11 mm\"], diameter = \"12 mm\" } }]";
    let all = "boundary={ all = \"periodic\" }";
    let mut probes: Vec<(String, String)> = Vec::new();
    for (n, x) in [0.0, 32.0].into_iter().enumerate() {
        for (m, y) in [0.0, 16.0].into_iter().enumerate() {
            probes.push((format!("p{n}{m}"), format!("point = [{}, {}, \"7 mm\"]", mm(x), mm(y))));
            probes.push((format!("g{n}{m}"), format!("gauge = [{}, {}]", mm(x), mm(y))));
        }
        probes.push((format!("x{n}"), format!("plane.x1 = {}", mm(x))));
    }
    for (n, z) in [0.0, 24.0].into_iter().enumerate() {
        probes.push((format!("z{n}"), format!("plane.x3 = {}", mm(z))));
        probes.push((format!("q{n}"), format!("point = [\"3 mm\", \"15 mm\", {}]", mm(z))));
    }
    for on in [On::threads(1), On::ranks(2, 1), On::ranks(4, 1)] {
        let at = read(BOX, &probes, &[drop, all, vortex, "gravity=0 m/s^2"], &format!("seam-{}", on.ranks), on);
        for column in ["pressure", "velocity_1", "velocity_2", "liquid_fraction"] {
            let first = at("p00", column);
            for other in ["p01", "p10", "p11"] {
                assert_eq!(at(other, column), first, "{other}, {column}, {} ranks", on.ranks);
            }
            assert_eq!(at("q0", column), at("q1", column));
        }
        for pair in [["x0", "x1"], ["z0", "z1"]] {
            for column in ["volume_flux", "liquid_flux", "mean_pressure"] {
                let [a, b] = pair.map(|probe| at(probe, column));
                assert!((a - b).abs() <= 1e-12 * a.abs().max(1e-9), "{pair:?}, {column}: {a} {b}");
            }
        }
        assert_eq!(at("g00", "water_level"), at("g11", "water_level"));
        // Negative control: elsewhere it is not the same.
        assert!(at("p00", "pressure") != at("q0", "pressure"));
    }
}

#[test]
fn points_on_walls_read_the_wall() {
    let pool = "liquid=[{ region.half_space = { point = [\"0 m\", \"0 m\", \"12 mm\"] } }]";
    let points =
        [[16.0, 8.0, 0.0], [0.0, 0.0, 0.0], [32.0, 16.0, 0.0], [32.0, 8.0, 6.0], [16.0, 8.0, 6.0], [16.0, 8.0, 10.0]];
    let probes = at_points(&points);
    let water = 1000.0 * 9.8;
    for on in [On::threads(1), On::ranks(4, 1)] {
        let at = read(BOX, &probes, &[pool], &format!("walls-{}", on.ranks), on);
        let pressure = |n: usize| at(&format!("p{n}"), "pressure");
        for (n, [.., z]) in points.iter().enumerate() {
            let rise = pressure(n) - pressure(5);
            assert!((rise - water * (10.0 - z) * 1e-3).abs() < 1e-6 * water * 10e-3, "{n}: {rise}");
        }
    }
    // What slides along does so on the wall as well, what sticks does not; control: half a cell off it moves.
    let flow = "fluid.initial_velocity={ uniform = { velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"] } }";
    let full = "liquid=[{ region.half_space = { point = [\"0 m\", \"0 m\", \"1 m\"] } }]";
    let above = [(format!("p{}", points.len()), "point = [\"16 mm\", \"8 mm\", \"1 mm\"]".to_owned())];
    let probes = [&probes[..], &above[..]].concat();
    for (floor, speed) in [("slip", 0.1), ("no_slip", 0.0)] {
        let sides = format!("boundary={{ all = \"slip\", x1 = \"periodic\", x3_lower = \"{floor}\" }}");
        let at = read(BOX, &probes, &[full, &sides, flow], &format!("walls-{floor}"), On::threads(1));
        for n in 0..3 {
            let found = at(&format!("p{n}"), "velocity_1");
            assert!((found - speed).abs() < 1e-6, "{floor} {n}: {found}");
        }
        assert!(at("p6", "velocity_1") > 0.05, "{floor}: {}", at("p6", "velocity_1"));
    }
}

#[test]
fn points_on_open_sides_read_the_fluid_outside() {
    // Still water over a floor of given pressure: at its middle, edges and corners, and between two ranks.
    let full = "liquid=[{ region.half_space = { point = [\"0 m\", \"0 m\", \"1 m\"] } }]";
    let open = "boundary={ all = \"slip\", x3_lower = { fixed_pressure = { fluid = \"liquid\" } } }";
    let points =
        [[16.0, 8.0, 0.0], [0.0, 0.0, 0.0], [32.0, 16.0, 0.0], [32.0, 8.0, 0.0], [15.3, 8.4, 0.0], [16.0, 8.0, 7.0]];
    let mut probes = at_points(&points);
    probes.push(("floor".to_owned(), "plane.x3 = \"0 mm\"".to_owned()));
    for on in [On::threads(1), On::ranks(4, 1)] {
        let at = read(BOX, &probes, &[full, open], &format!("open-{}", on.ranks), on);
        let floor = at("floor", "mean_pressure");
        for (n, [.., z]) in points.iter().enumerate() {
            let expected = floor - 9800.0 * z * 1e-3;
            let found = at(&format!("p{n}"), "pressure");
            assert!((found - expected).abs() < 1e-6 * floor.abs(), "{n}: {found} {expected}");
        }
    }
}

#[test]
fn points_and_gauges_of_moving_particles_are_the_same_on_both_sides_of_a_seam() {
    let case = include_str!("../cases/sides-observed-seams.toml");
    let places = [[0.0, 0.0], [24.0, 0.0], [0.0, 24.0], [24.0, 24.0]];
    let probes: Vec<(String, String)> = places
        .iter()
        .enumerate()
        .flat_map(|(n, [x, y])| {
            let [x, y] = [mm(*x), mm(*y)];
            [
                (format!("p{n}"), format!("point = [{x}, {y}, \"4 mm\"]")),
                (format!("g{n}"), format!("gauge = [{x}, {y}]")),
            ]
        })
        .chain([("middle".to_owned(), "gauge = [\"12 mm\", \"12 mm\"]".to_owned())])
        .collect();
    let at = read(case, &probes, &[], "seams", On::threads(1));
    for n in 1..places.len() {
        for column in ["pressure", "velocity_1", "velocity_3"] {
            let [first, other] = [0, n].map(|n| at(&format!("p{n}"), column));
            assert!((first - other).abs() < 1e-9 * first.abs(), "{n} {column}: {first} {other}");
        }
        let [first, other] = [0, n].map(|n| at(&format!("g{n}"), "water_level"));
        assert!((first - other).abs() < 1e-9, "{n}: {first} {other}");
    }
    // Negative control: the water is not the same everywhere.
    assert!((at("middle", "water_level") - at("g0", "water_level")).abs() > 1e-3);
}

#[test]
fn points_of_moving_particles_on_walls_read_the_wall() {
    let case = include_str!("../cases/sides-observed-tank.toml");
    let points =
        [[6.0, 6.0, 0.0], [0.0, 0.0, 0.0], [12.0, 12.0, 0.0], [12.0, 6.0, 0.0], [12.0, 6.0, 10.0], [6.0, 6.0, 10.0]];
    let at = read(case, &at_points(&points), &[], "tank", On::threads(1));
    let pressure = |n: usize| at(&format!("p{n}"), "pressure");
    // On floor, edges and in corners alike; the discrete pressure is within a quarter of a spacing of that of its depth.
    for (n, [.., z]) in points.iter().enumerate() {
        let expected = 9800.0 * (20.0 - z) * 1e-3;
        assert!((pressure(n) - expected).abs() < 0.3 * 9.8, "{n}: {} {expected}", pressure(n));
    }
    for n in 1..4 {
        assert!((pressure(n) / pressure(0) - 1.0).abs() < 2e-3, "{n}: {} {}", pressure(n), pressure(0));
    }
}

#[test]
fn points_of_moving_particles_on_a_lid_read_it() {
    // The tank upside down, closed.
    let case = include_str!("../cases/sides-observed-tank.toml")
        .replace(
            "[\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"12 mm\", \"12 mm\", \"20 mm\"]",
            "[\"0 mm\", \"0 mm\", \"4 mm\"], upper = [\"12 mm\", \"12 mm\", \"24 mm\"]",
        )
        .replace("gravity = \"9.8 m/s^2\"", "gravity = [\"0 m/s^2\", \"0 m/s^2\", \"9.8 m/s^2\"]")
        .replace(", x3_upper = \"outflow\"", "");
    let probes = [("lid", "24 mm"), ("depth", "14 mm")]
        .map(|(name, z)| (name.to_owned(), format!("point = [\"6 mm\", \"6 mm\", \"{z}\"]")));
    let at = read(&case, &probes, &[], "lid", On::threads(1));
    for (name, depth) in [("lid", 20.0), ("depth", 10.0)] {
        let (found, expected) = (at(name, "pressure"), 9.8 * depth);
        assert!((found - expected).abs() < 0.3 * 9.8, "{name}: {found} {expected}");
    }
}

/// A sphere that goes with the liquid of a periodic box through a plane.
const CARRIED: &str = r#"
gravity = "0 m/s^2"
domain = { size = ["12 mm", "8 mm", "8 mm"], cells = [12, 8, 8] }
boundary.all = "periodic"
fluid.liquid = { density = "1000 kg/m^3", kinematic_viscosity = "1e-5 m^2/s" }
fluid.initial_velocity.uniform.velocity = ["0.1 m/s", "0 m/s", "0 m/s"]
fluid.dt_max = "1 ms"
material.a.density = "2000 kg/m^3"
output = { fields = { at = [] }, figures = { at = [] }, grains = { at = [] }, series = { every = "20 ms" } }
run.until = "60 ms"

[[liquid]]
region.half_space.point = ["0 mm", "0 mm", "100 mm"]
allow_touching_grains = true

[[grains]]
motion = "prescribed"
shape.sphere.diameter = "3 mm"
placement.list = [{ position = ["3 mm", "4 mm", "4 mm"], velocity = ["0.1 m/s", "0 m/s", "0 m/s"] }]

[[probe]]
name = "plane"
every = "1 ms"
plane.x1 = "6 mm"
"#;

#[test]
fn a_plane_tells_liquid_from_the_grains_that_go_through_it() {
    let scratch = Scratch::new("plane-grains");
    let seen = |name: &str, overrides: &[&str]| {
        let left = ran(CARRIED, overrides, &scratch.join(name), On::threads(1));
        let [all, liquid] = ["volume_flux", "liquid_flux"].map(|column| left.probe("plane").column(column));
        let rest = |(all, liquid): (&f64, &f64)| if all.is_finite() { (all - liquid) * 1e-3 } else { 0.0 };
        all.iter().zip(&liquid).map(rest).sum::<f64>()
    };
    let sphere = std::f64::consts::PI / 6.0 * 27e-9;
    let found = seen("through", &[]) / sphere;
    assert!((found - 1.0).abs() < 0.03, "{found}");
    // Negative control: one that stays before the plane.
    let none = seen("before", &["grains.0.placement.list=[{ position = [\"3 mm\", \"4 mm\", \"4 mm\"] }]"]) / sphere;
    assert!(none.abs() < 0.01, "{none}");
}

#[test]
fn planes_between_faces_of_cells_are_where_they_are_put() {
    let pool = "liquid=[{ region.half_space = { point = [\"0 m\", \"0 m\", \"10 mm\"] }, velocity = [\"0 m/s\", \"0 m/s\", \"0 m/s\"] }]";
    let heights = [1.0, 2.0, 2.7, 3.3, 4.0, 7.9];
    let planes: Vec<(String, String)> =
        heights.iter().map(|z| (format!("z{z}"), format!("plane.x3 = {}", mm(*z)))).collect();
    let at = read(BOX, &planes, &[pool, "run.until=1 ms"], "planes-between", On::threads(1));
    // Of water at rest, from the surface of 10 mm on down.
    let floor = at("z2", "mean_pressure");
    for z in heights {
        let exact = floor + 9.8 * (2.0 - z);
        let found = at(&format!("z{z}"), "mean_pressure");
        assert!((found - exact).abs() < 1e-3 * floor.abs(), "{z} mm: {found}, {exact}");
    }
    // Negative control: by the nearest faces of cells of 2 mm that of 3.3 would be that of 4.
    assert!((at("z3.3", "mean_pressure") - at("z4", "mean_pressure")).abs() > 6.0);
}
