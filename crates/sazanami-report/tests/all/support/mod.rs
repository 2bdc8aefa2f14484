//! Folders of results as runs leave them, with grains and water of any number.

use std::fs;
use std::path::Path;

use sazanami_io::vtk::{BodyFile, DataArray, ImageFile, PointFile, PvdSeries, write_bodies, write_image, write_points};
use sazanami_io::{Bodies, BodyPose, BodySurface};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Random, Vector};

/// Text that a page must not take for its own.
pub const BAD: &str = "</script><script>document.title='broken'</script><img src=x onerror=alert(1)>";

/// Why nothing here fails.
const WRITABLE: &str = "a scratch folder takes results";

/// Size of the box \[m].
const BOX: f64 = 0.03;

/// Arrangement of the grains in the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lying {
    /// Anywhere, and elsewhere at each time, so that nothing repeats: octahedra.
    Anywhere,
    /// As a dense bed over the floor: spheroids of 84 triangles with the axes of the paper's, half of the space.
    Bed,
}

/// Results of a run with so many grains that lie anywhere, written at so many times.
pub fn results(folder: &Path, grains: usize, times: usize, cells: [usize; 3]) {
    results_with(folder, grains, times, cells, Lying::Anywhere);
}

/// The same with grains that lie so.
pub fn results_with(folder: &Path, grains: usize, times: usize, cells: [usize; 3], lying: Lying) {
    write_results(folder, grains, times, cells, lying, ("", &|_| Vector::ZERO));
}

/// Results of a tank that is shaken, with grains where they lie in it or, `seen` from the laboratory, in that.
pub fn shaken_results(folder: &Path, seen: bool) {
    let motion = "[frame.motion]\namplitude = [\"8 mm\", \"0 mm\", \"0 mm\"]\nfrequency = \"10 Hz\"\nramp = \"0 s\"\n";
    let frame = if seen { "[output]\nframe = \"laboratory\"\n" } else { "" };
    let place = |time: f64| Vector::X * (8e-3 * (std::f64::consts::TAU * 10.0 * time).sin());
    let moved = |time: f64| if seen { place(time) } else { Vector::ZERO };
    write_results(folder, 8, 2, [4, 4, 4], Lying::Anywhere, (&format!("{motion}{frame}"), &moved));
}

fn write_results(
    folder: &Path,
    grains: usize,
    times: usize,
    cells: [usize; 3],
    lying: Lying,
    (keys, moved): (&str, &dyn Fn(f64) -> Vector),
) {
    for name in ["grains", "fields"] {
        fs::create_dir_all(folder.join(name)).expect(WRITABLE);
    }
    let case = format!(
        "title = {:?}\n[domain]\nsize = [\"30 mm\", \"30 mm\", \"30 mm\"]\ncells = {cells:?}\n[fluid]\ncfl = 0.3\n\
         [material.sand]\ndensity = \"2650 kg/m^3\"\n[contact.default]\nnormal_stiffness = \"1e3 N/m\"\n\
         tangential_stiffness = \"1e3 N/m\"\nrestitution = 0.5\nfriction = 0.5\n[[grains]]\nname = \"sand\"\ncount = 8\n\
         shape.sphere = {{ diameter = \"1 mm\" }}\nmaterial = \"sand\"\nplacement.packed = {{ lattice = \"low\" }}\n\
         [run]\nuntil = \"20 ms\"\n{keys}",
        BAD
    );
    fs::write(folder.join("case.toml"), case).expect(WRITABLE);
    let summary = serde_json::json!({
        "status": "finished", "version": env!("CARGO_PKG_VERSION"), "commit": "0", "case": "a", "case_hash": "0", "solver": "mics",
        "machine": { "cpu": BAD, "cores": 2, "threads": 1, "ranks": 1 }, "time_s": 0.02, "steps": 2, "grain_substeps": 9,
        "wall_s": 65.0, "phase_s": { "fluid": 1.0 }, "counts": { "cells": 1, "fluid_particles": 0, "grains": grains },
        "conservation": { "liquid_volume_relative_change": 7e-13, "momentum_residual_relative": 0.25 },
        "momentum": { "residual": [0.0, 0.0, 1e-9] },
        "observables": { "erosion": { "volume_mm3": 68.75, "volume_uncertainty_mm3": 12.02, "depth_mm": 1.717 } },
        "history": { "ranks": [1], "sums": ["ordered"], "programs": ["sazanami 0.2.0 (unknown commit)"], "ends_s": [] },
        "state_hash": "abcdef",
    });
    fs::write(folder.join("summary.json"), summary.to_string()).expect(WRITABLE);
    let rows: String =
        (0..20).map(|n| format!("{n},{},{},{}\n", f64::from(n) * 1e-3, 1e-4 * f64::from(n), 5e-3)).collect();
    fs::write(folder.join("series.csv"), format!("step,time [s],crater_depth [m],rim_radius [m]\n{rows}"))
        .expect(WRITABLE);
    let log = format!(
        "2026-01-01T00:00:00Z  begun\n2026-01-01T00:00:01Z  warning: at time 5.0000e-3 s along x3\n\
         2026-01-01T00:01:05Z  warning: {BAD}\n"
    );
    fs::write(folder.join("log.txt"), log).expect(WRITABLE);
    let mut random = Random::new(7);
    let (mut points, mut images) =
        (PvdSeries::create(&folder.join("grains.pvd")), PvdSeries::create(&folder.join("fields.pvd")));
    write_shape(&folder.join("grains/shape-0.vtp"), lying);
    for n in 0..times {
        let time = 0.02 * n as f64 / times as f64;
        let name = format!("grains/grains-{n:09}.vtp");
        write_grains(&folder.join(&name), grains, &mut random, lying, moved(time));
        points.push(time, &name).expect(WRITABLE);
        let name = format!("fields/fields-{n:09}.vti");
        write_water(&folder.join(&name), cells, n);
        images.push(time, &name).expect(WRITABLE);
    }
}

/// An octahedron, or a spheroid of seven rings of six nodes and two poles.
fn write_shape(path: &Path, lying: Lying) {
    let (x, y, z) = (Vector::X * 5e-4, Vector::Y * 5e-4, Vector::Z * 5e-4);
    let mut nodes = vec![x, y, z, -x, -y, -z];
    let mut triangles = vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
    if lying == Lying::Bed {
        let (rings, around) = (7_u32, 6_u32);
        let node = |n: u32| {
            let [polar, turn] = [
                std::f64::consts::PI * f64::from(n / around + 1) / f64::from(rings + 1),
                std::f64::consts::TAU * f64::from(n % around) / f64::from(around),
            ];
            let across = 2.6e-4 * polar.sin();
            Vector::new(across * turn.cos(), across * turn.sin(), 6.35e-4 * polar.cos())
        };
        nodes = (0..rings * around).map(node).chain([6.35e-4, -6.35e-4].map(|z| Vector::Z * z)).collect();
        let [top, bottom] = [rings * around, rings * around + 1];
        let next = |n: u32| n / around * around + (n + 1) % around;
        let quads =
            (0..(rings - 1) * around).flat_map(|n| [[n, n + around, next(n)], [next(n), n + around, next(n) + around]]);
        let caps = (0..around).flat_map(|n| {
            let last = (rings - 1) * around + n;
            [[top, n, next(n)], [bottom, next(last), last]]
        });
        triangles = quads.chain(caps).collect();
    }
    let pose = BodyPose { surface: 0, scale: 1.0, position: Vector::ZERO, orientation: Quaternion::IDENTITY };
    let surfaces = [BodySurface { nodes: &nodes, triangles: &triangles }];
    let bodies = Bodies { surfaces: &surfaces, poses: &[pose] };
    write_bodies(path, &BodyFile { bodies, time: None, arrays: &[], scalars: None, frame: None }).expect(WRITABLE);
}

fn write_grains(path: &Path, count: usize, random: &mut Random, lying: Lying, moved: Vector) {
    let mut vectors = |scale: f64| -> Vec<Vector> {
        (0..count).map(|_| scale * Vector::new(random.unit(), random.unit(), random.unit())).collect()
    };
    let (mut places, speeds, forces, turns) = (vectors(BOX), vectors(1.0), vectors(1e-3), vectors(1.0));
    if lying == Lying::Bed {
        // Half of the space is grains: cells of twice their volume, each with one somewhere about its middle.
        let cell = (2.0 * 1.5e-10_f64).cbrt();
        let along = (BOX / cell) as usize;
        for (n, place) in places.iter_mut().enumerate() {
            let middle = [n % along, n / along % along, n / along / along].map(|k| (k as f64 + 0.5) * cell);
            *place = Vector::from_array(middle) + (*place / BOX - Vector::splat(0.5)) * (0.5 * cell);
        }
    }
    places.iter_mut().for_each(|place| *place += moved);
    let flat = |vectors: &[Vector]| vectors.iter().flat_map(|v| v.to_array()).collect::<Vec<f64>>();
    let turn = |v: &Vector| {
        let turned = Quaternion::from_rotation_x(6.0 * v.x) * Quaternion::from_rotation_z(6.0 * v.y);
        [turned.w, turned.x, turned.y, turned.z]
    };
    let arrays = [
        DataArray::whole("id", (0..count).map(|n| n as u32 + 10)),
        DataArray::whole("population", std::iter::repeat_n(0, count)),
        DataArray::rounded("diameter", 1, std::iter::repeat_n(1e-3, count)),
        DataArray::rounded("scale", 1, std::iter::repeat_n(1.0, count)),
        DataArray::rounded("orientation", 4, turns.iter().flat_map(turn)),
        DataArray::rounded("speed", 1, speeds.iter().map(|v| v.length())),
        DataArray::rounded("contact_force", 3, flat(&forces)),
    ];
    let file = PointFile { places: &places, double: false, time: None, arrays: &arrays, scalars: None, frame: None };
    write_points(path, &file).expect(WRITABLE);
}

/// Water with waves up to the middle of the box.
fn write_water(path: &Path, cells: [usize; 3], n: usize) {
    let grid = Grid::new(cells, Vector::ZERO, Vector::splat(BOX));
    let [n1, n2, _] = cells;
    let fraction = |at: usize| {
        let (i, j, k) = (at % n1, at / n1 % n2, at / n1 / n2);
        let level = 0.5 * cells[2] as f64 * (1.0 + 0.3 * (0.7 * (i + n) as f64).sin() * (0.5 * j as f64).cos());
        (level - k as f64).clamp(0.0, 1.0)
    };
    let array = DataArray::rounded("liquid_outside_grains", 1, (0..grid.len()).map(fraction));
    write_image(path, &ImageFile { grid: &grid, time: None, cells: &[array], scalars: None, frame: None })
        .expect(WRITABLE);
}
