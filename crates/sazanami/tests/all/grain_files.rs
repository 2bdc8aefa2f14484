//! Files of grains hold what glyphs, tracking and analysis need, in the form that the case asks for.

use std::f64::consts::PI;
use std::path::Path;

use crate::support::{On, Scratch, Table, load, ran, refusal, summary};
use sazanami_test_support::vtk::{VtkFile, parse};

/// Two spheres and a box, one of them out of order and turned, in air.
const MIXED: &str = include_str!("../cases/grain-files-mixed.toml");

fn run(name: &str, changes: &[&str]) -> Scratch {
    let scratch = Scratch::new(name);
    ran(MIXED, changes, &scratch.join("out"), On::threads(1));
    scratch
}

fn singles(file: &VtkFile, name: &str) -> Vec<f32> {
    let (kind, _, bytes, _) = file.array(name);
    assert_eq!(kind, "Float32", "{name}");
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("four bytes"))).collect()
}

fn words(file: &VtkFile, name: &str) -> Vec<u32> {
    file.array(name).2.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().expect("four bytes"))).collect()
}

fn first(folder: &Path, kind: &str) -> VtkFile {
    parse(&folder.join(format!("out/grains/{kind}-000000000.vtp")))
}

#[test]
fn points_carry_all_that_glyphs_and_tracking_need() {
    let scratch = run("points", &[]);
    let points = first(scratch.path(), "grains");
    let ids: Vec<u64> =
        points.array("id").2.chunks_exact(8).map(|b| u64::from_le_bytes(b.try_into().expect("eight bytes"))).collect();
    assert_eq!(ids, [0, 1, 1 << 32]);
    assert_eq!(words(&points, "population"), [0, 0, 1]);
    let material = words(&points, "material");
    assert!(material[0] == material[1] && material[0] != material[2]);
    assert_eq!(singles(&points, "scale"), [2.0, 1.0, 1.0]);
    let near = |found: &[f32], expected: &[f64]| {
        assert_eq!(found.len(), expected.len());
        assert!(
            found.iter().zip(expected).all(|(a, b)| (f64::from(*a) - b).abs() <= 2e-6 * b.abs().max(1e-12)),
            "{found:?}"
        );
    };
    let volume = [PI / 6.0 * 1e-9, PI / 6.0 * 0.125e-9, 0.4 * 0.6 * 0.8 * 1e-9];
    near(&singles(&points, "diameter"), &volume.map(|v| (6.0 / PI * v).cbrt()));
    near(&singles(&points, "mass"), &[2650.0 * volume[0], 2650.0 * volume[1], 11340.0 * volume[2]]);
    // w, x, y, z: a quarter turn about x3, beyond the turn that takes the box to its principal axes.
    let turn = singles(&points, "orientation");
    near(&turn[..8], &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    assert!((turn[8..].iter().map(|q| q * q).sum::<f32>() - 1.0).abs() < 1e-5);
    let spin = singles(&points, "angular_velocity");
    assert!(spin[..8].iter().all(|w| w.abs() < 1e-6) && (spin[8] - 5.0).abs() < 1e-4, "{spin:?}");
    assert_eq!(singles(&points, "contact_force"), [0.0; 9]);
    assert_eq!(singles(&points, "time_since_contact"), [1e9; 3]);
    near(&singles(&points, "Points"), &[1e-3, 1e-3, 2e-3, 1e-3, 3e-3, 2e-3, 3e-3, 2e-3, 2e-3]);
    // Glyphs: the surface of each population at size factor 1. Turned and scaled, the box's is that of its mesh.
    let glyph = parse(&scratch.join("out/grains/shape-1.vtp"));
    let meshes = first(scratch.path(), "meshes");
    let corners = singles(&glyph, "Points");
    let all = singles(&meshes, "Points");
    let [w, x, y, z] = [turn[8], turn[9], turn[10], turn[11]];
    for (corner, found) in corners.chunks_exact(3).zip(all[all.len() - corners.len()..].chunks_exact(3)) {
        let cross = |a: [f32; 3], b: [f32; 3]| {
            [0, 1, 2].map(|n| a[(n + 1) % 3] * b[(n + 2) % 3] - a[(n + 2) % 3] * b[(n + 1) % 3])
        };
        let v = [corner[0], corner[1], corner[2]];
        let t = cross([x, y, z], v).map(|c| 2.0 * c);
        let u = cross([x, y, z], t);
        let place = [3e-3, 2e-3, 2e-3];
        for n in 0..3 {
            assert!((v[n] + w * t[n] + u[n] + place[n] - found[n]).abs() < 1e-8, "{corner:?} {found:?}");
        }
    }
    // Values of a mesh are those of its grain; what turns glyphs is not among them.
    let scales = singles(&meshes, "scale");
    assert!(scales.len() == all.len() / 3 && scales[0] == 2.0 && scales[scales.len() - 1] == 1.0);
    assert!(!meshes.text.contains("orientation"));
}

#[test]
fn forms_and_arrays_are_chosen_by_the_case() {
    let scratch = run("arrays", &["output.grain_form=points", "output.grain_arrays=[\"id\", \"velocity\"]"]);
    let points = first(scratch.path(), "grains");
    assert!(points.text.contains("\"velocity\"") && !points.text.contains("\"mass\""));
    assert_eq!(points.attribute("PointData", "Scalars"), "velocity");
    let exists = |scratch: &Scratch, name: &str| scratch.join("out").join(name).exists();
    assert!(exists(&scratch, "grains.pvd") && exists(&scratch, "grains/shape-0.vtp"));
    assert!(!exists(&scratch, "grain-meshes.pvd"));
    let meshes = run("meshes", &["output.grain_form=meshes", "output.grain_arrays=[]"]);
    assert!(exists(&meshes, "grain-meshes.pvd") && !exists(&meshes, "grains.pvd"));
    assert!(!exists(&meshes, "grains/shape-0.vtp"));
    assert!(refusal(MIXED, &["output.grain_arrays=[\"drag\"]"]).contains("have no `drag`"));
    assert!(refusal(MIXED, &["output.grain_arrays=[\"vlocity\"]"]).contains("did you mean `velocity`?"));
    // Many grains are points alone.
    let many = load(&MIXED.replace("placement.list = [{", "placement.lattice = { lower = [\"0 mm\", \"0 mm\", \"3 mm\"], upper = [\"4 mm\", \"4 mm\", \"4 mm\"], counts = [11, 11, 9] } #"), &["grains.1.shape.box.size=[\"0.1 mm\", \"0.1 mm\", \"0.05 mm\"]"]);
    assert_eq!(many.case.output.grain_form, sazanami::case::meaning::GrainForm::Points);
}

#[test]
fn what_is_written_from_the_laboratory_lies_there() {
    // The tank begins at 2 pi f A = 0.6283 m/s.
    let moving = "frame.motion={amplitude=[\"10 mm\", \"0 mm\", \"0 mm\"], frequency=\"10 Hz\", ramp=\"0 s\"}";
    let probes = "probe=[{name=\"ball\", body={population=\"balls\", index=0}, every=\"1 ms\"}, \
                  {name=\"air\", point=[\"2 mm\", \"2 mm\", \"1 mm\"], every=\"1 ms\"}]";
    let times = ["output.grains.at=[\"0 s\", \"1 ms\"]", "output.fields.at=[\"0 s\", \"1 ms\"]"];
    let more = ["output.precision=double", "output.grain_form=both", "run.steps=1000", "fluid.dt_max=0.5 ms", probes];
    let all = |frame: &str| {
        let frame = format!("output.frame={frame}");
        run(&frame, &[&times[..], &more, &[moving, &frame]].concat())
    };
    let [tank, laboratory] = ["tank", "laboratory"].map(all);
    let steps = summary(&tank.join("out"))["steps"].as_u64().expect("steps were made");
    let doubles = |file: &VtkFile, name: &str| -> Vec<f64> {
        file.array(name).2.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect()
    };
    for (step, time) in [(0, 0.0), (steps, 1e-3)] {
        let angle = 2.0 * PI * 10.0 * time;
        let (shift, drift) = (0.01 * angle.sin(), 0.2 * PI * angle.cos());
        let read = |from: &Scratch, name: &str| parse(&from.join("out").join(name.replace('#', &format!("{step:09}"))));
        let both = |name: &str| [read(&tank, name), read(&laboratory, name)];
        let apart = |[a, b]: [&[f32]; 2], expected: f64| {
            assert_eq!(a.len(), b.len());
            for (n, (a, b)) in a.iter().zip(b).enumerate() {
                let expected = if n % 3 == 0 { expected } else { 0.0 };
                assert!((f64::from(b - a) - expected).abs() < 2e-6 * expected.abs().max(1e-3), "{step} {n}: {a} {b}");
            }
        };
        for name in ["grains/grains-#.vtp", "grains/meshes-#.vtp"] {
            let [seen, other] = both(name);
            apart([&singles(&seen, "Points"), &singles(&other, "Points")], shift);
            apart([&singles(&seen, "velocity"), &singles(&other, "velocity")], drift);
            assert!(seen.text.contains("frame of the tank") && other.text.contains("frame of the laboratory"));
        }
        let [seen, other] = both("fields/fields-#.vti");
        let origin = |file: &VtkFile| -> f64 {
            let text = file.attribute("ImageData", "Origin").to_owned();
            text.split(' ').next().and_then(|x| x.parse().ok()).expect("an origin has a first part")
        };
        assert!((origin(&other) - origin(&seen) - shift).abs() < 1e-12);
        assert!(other.text.contains("frame of the laboratory"));
        for (n, (a, b)) in doubles(&seen, "velocity").iter().zip(doubles(&other, "velocity")).enumerate() {
            assert!((b - a - if n % 3 == 0 { drift } else { 0.0 }).abs() < 1e-12, "{step} {n}: {a} {b}");
        }
        // Negative control: they differ by far more than the bounds above.
        assert!(drift > 0.1 && (step == 0 || shift > 1e-4));
    }
    let probe = |from: &Scratch, name: &str, column: &str| {
        Table::read(&from.join(&format!("out/probes/{name}.csv"))).column(column)
    };
    let motion = |time: f64| (2.0 * PI * 10.0 * time).sin_cos();
    let times = probe(&tank, "ball", "time");
    assert!(times.len() >= 2);
    for (n, (sin, cos)) in times.iter().map(|&time| motion(time)).enumerate() {
        let apart = |name: &str, column: &str| probe(&laboratory, name, column)[n] - probe(&tank, name, column)[n];
        assert!((apart("ball", "position_1") - 0.01 * sin).abs() < 1e-9);
        for name in ["ball", "air"] {
            assert!((apart(name, "velocity_1") - 0.2 * PI * cos).abs() < 1e-9, "{name}");
            assert!(apart(name, "velocity_3").abs() < 1e-12);
        }
    }
}

#[test]
fn when_all_grains_have_left_files_have_none() {
    let scratch = Scratch::new("grains-left");
    let away = "velocity = [\"0 m/s\", \"0 m/s\", \"20 m/s\"] }] } }]";
    let ball = "grains=[{ material = \"sand\", shape = { sphere = { diameter = \"0.5 mm\" } }, placement = { list = [{ position = [\"3 mm\", \"3 mm\", \"3 mm\"], ";
    let ball = format!("{ball}{away}");
    let set = [
        &ball,
        "material={ sand = { density = \"2650 kg/m^3\" } }",
        "boundary.x3_upper=outflow",
        "output.grains.steps=1",
        "output.grain_form=both",
        "run={ until = \"1 ms\" }",
    ];
    let left = ran(MIXED, &set, &scratch.join("out"), On::threads(1));
    assert_eq!(left.summary["conservation"]["departed_grains"], 1);
    let last = left.summary["steps"].as_u64().expect("a number");
    for (kind, series) in [("grains", "grains"), ("meshes", "grain-meshes")] {
        let is_empty = |step: u64| {
            parse(&scratch.join(&format!("out/grains/{kind}-{step:09}.vtp"))).text.contains("NumberOfPoints=\"0\"")
        };
        assert!(!is_empty(0) && is_empty(last), "{kind}");
        let list = std::fs::read_to_string(scratch.join(&format!("out/{series}.pvd"))).expect("the run left it");
        assert!(list.contains(&format!("{kind}-{last:09}.vtp")), "{list}");
    }
}

/// A ramp, 60 mm long, 20 mm wide and 30 mm high at its lower end in x1, as a mesh of Gmsh in millimetres.
const RAMP: &str = "$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
6
1 0 0 0
2 60 0 0
3 0 0 30
4 0 20 0
5 60 20 0
6 0 20 30
$EndNodes
$Elements
3
1 4 2 0 1 1 2 4 3
2 4 2 0 1 2 3 5 4
3 4 2 0 1 3 4 6 5
$EndElements
";

#[test]
fn a_mesh_lies_as_it_was_given() {
    let scratch = Scratch::new("grain-files-ramp");
    let mesh = scratch.join("ramp.msh");
    std::fs::write(&mesh, RAMP).expect("writable");
    let text = format!(
        "gravity = \"0 m/s^2\"
domain = {{ size = [\"200 mm\", \"40 mm\", \"80 mm\"], cells = [20, 4, 8] }}
material.rock.density = \"2000 kg/m^3\"
output = {{ grains = {{ at = [\"0 s\"] }}, fields = {{ at = [] }}, figures = {{ at = [] }}, grain_form = \"both\" }}
run.until = \"1 ms\"
[[grains]]
name = \"ramp\"
shape.mesh = {{ file = \"{}\", unit = \"1 mm\" }}
motion = \"fixed\"
placement.list = [{{ position = [\"40 mm\", \"20 mm\", \"30 mm\"] }}, {{ position = [\"130 mm\", \"20 mm\", \"30 mm\"], axis = [0, 0, 1], angle = \"180 deg\" }}]
",
        mesh.display()
    );
    let left = ran(&text, &[], &scratch.join("out"), On::threads(1));
    assert!(left.probes.is_empty());
    // Corners about the centre of mass, at a third of the length and of the height.
    let drawn = [[-20, -10, -10], [40, -10, -10], [-20, -10, 20], [-20, 10, -10], [40, 10, -10], [-20, 10, 20]];
    let nearest = |found: &[f32], [x, y, z]: [f64; 3]| {
        let away = |c: &[f32]| (f64::from(c[0]) - x).hypot((f64::from(c[1]) - y).hypot(f64::from(c[2]) - z));
        found.chunks_exact(3).map(away).fold(f64::INFINITY, f64::min)
    };
    let meshes = singles(&first(scratch.path(), "meshes"), "Points");
    let glyph = singles(&parse(&scratch.join("out/grains/shape-0.vtp")), "Points");
    for corner in drawn {
        let [x, y, z] = corner.map(|mm| 1e-3 * f64::from(mm));
        assert!(nearest(&glyph, [x, y, z]) < 1e-7, "{corner:?} {glyph:?}");
        assert!(nearest(&meshes, [0.04 + x, 0.02 + y, 0.03 + z]) < 1e-7, "{corner:?}");
        assert!(nearest(&meshes, [0.13 - x, 0.02 - y, 0.03 + z]) < 1e-7, "{corner:?}, turned");
    }
    let turns = singles(&first(scratch.path(), "grains"), "orientation");
    let expected = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0_f32];
    assert!(turns.iter().zip(expected).all(|(found, turn)| (found.abs() - turn).abs() < 1e-6), "{turns:?}");
    // Negative control: its principal axes do not lie along the box.
    let mesh = sazanami_io::mesh::read(&mesh, 1e-3).expect("a mesh");
    let axes = sazanami_numerics::geometry::MassProperties::of(&mesh.mesh).axes;
    assert!(axes.x_axis.x.abs() < 0.97, "{axes:?}");
}
