//! Volume fractions of rigid shapes: exact sums, error by method, invariance, cost.

use sazanami_numerics::geometry::{
    CellCover, ContactSphereRule, Imprint, Rasteriser, Shape, SpheroidMesh, TetrahedralMesh, VolumeFractionMethod,
    VolumeRule,
};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Random, Real, Vector};
use sazanami_test_support::allocations_of_thread;

const COLUMNS: VolumeFractionMethod = VolumeFractionMethod::Columns { per_axis: 4 };

/// A place within the cell at the middle of the grid and any orientation.
fn pose(random: &mut Random, grid: &Grid) -> (Vector, Quaternion) {
    let place = Vector::new(random.unit(), random.unit(), random.unit());
    (grid.lower + 0.5 * grid.extent() + grid.spacing * place, random.orientation())
}

/// The grid of the paper: 0.192 x 0.184 x 0.189 mm.
fn paper_grid() -> Grid {
    Grid::new([176, 184, 132], Vector::ZERO, Vector::new(33.8e-3, 33.8e-3, 25e-3))
}

fn paper_grain() -> Shape {
    paper_grain_of(1.0)
}

/// The same, so many times as large.
fn paper_grain_of(scale: Real) -> Shape {
    let spheres = ContactSphereRule::Axis { count: 9 };
    Shape::spheroid(scale * 0.26e-3, scale * 0.635e-3, SpheroidMesh::PAPER, VolumeRule::Inscribed, &spheres)
        .expect("the shape is sound")
}

fn tetrahedron(size: Real) -> Shape {
    let mesh = TetrahedralMesh {
        nodes: [Vector::ZERO, Vector::X, Vector::Y, Vector::Z].map(|p| size * p).to_vec(),
        tetrahedra: vec![[0, 1, 2, 3]],
    };
    Shape::from_mesh("tetrahedron", mesh, &ContactSphereRule::Listed(vec![(Vector::splat(0.2 * size), 0.1 * size)]))
        .expect("the shape is sound")
}

fn cuboid(edges: Vector) -> Shape {
    Shape::cuboid(edges, &ContactSphereRule::Listed(vec![(Vector::ZERO, 0.4 * edges.min_element())]))
        .expect("the shape is sound")
}

fn imprint(
    method: VolumeFractionMethod,
    shape: &Shape,
    x: Vector,
    q: Quaternion,
    grid: &Grid,
) -> (Vec<CellCover>, Imprint) {
    let mut covers = Vec::new();
    let imprint = Rasteriser::new(method).imprint(shape, x, q, grid, &mut covers);
    assert_eq!(imprint.cells, covers.len());
    (covers, imprint)
}

fn fraction_in(covers: &[CellCover], cell: [i32; 3]) -> Real {
    covers.iter().find(|c| c.cell == cell).map_or(0.0, |c| c.fraction)
}

#[test]
fn every_method_holds_the_exact_volume_and_centre_of_every_shape() {
    let grid = paper_grid();
    let sphere = Shape::sphere(0.52e-3, 2, VolumeRule::Inscribed, &ContactSphereRule::Single).unwrap();
    let shapes = [sphere, paper_grain(), cuboid(Vector::new(0.4e-3, 0.7e-3, 0.5e-3)), tetrahedron(1e-3)];
    let methods = [COLUMNS, VolumeFractionMethod::Columns { per_axis: 3 }, VolumeFractionMethod::Clip];
    let mut random = Random::new(1);
    for shape in &shapes {
        for method in methods {
            for _ in 0..50 {
                let (x, q) = pose(&mut random, &grid);
                let (covers, imprint) = imprint(method, shape, x, q, &grid);
                let volume: Real = covers.iter().map(|c| c.fraction * grid.cell_volume()).sum();
                assert!((volume / shape.volume() - 1.0).abs() < 1e-12);
                assert!(covers.iter().all(|c| c.fraction > 0.0 && c.fraction <= 1.0));
                let centre = covers.iter().map(|c| c.fraction * (c.centroid - x)).sum::<Vector>();
                assert!(centre.length() < 1e-13 * grid.spacing.x * covers.len() as Real);
                assert!(!imprint.fell_back);
                if method == VolumeFractionMethod::Clip {
                    assert!(imprint.raw_volume_error.abs() < 1e-8, "{}", imprint.raw_volume_error);
                } else {
                    assert!(imprint.raw_volume_error.abs() > 1e-12, "sampling is not exact");
                }
            }
        }
    }
}

/// Root mean square over touched cells and poses of the error against exact clipping, with the volume error.
fn errors(method: VolumeFractionMethod, poses: usize) -> (Real, Real, Real) {
    let (grid, grain) = (paper_grid(), paper_grain());
    let mut random = Random::new(7);
    let (mut squares, mut cells, mut volume, mut arm) = (0.0, 0.0, 0.0, 0.0);
    for _ in 0..poses {
        let (x, q) = pose(&mut random, &grid);
        let (exact, _) = imprint(VolumeFractionMethod::Clip, &grain, x, q, &grid);
        let (found, raw) = imprint(method, &grain, x, q, &grid);
        for cover in &exact {
            squares += (cover.fraction - fraction_in(&found, cover.cell)).powi(2);
            if let Some(other) = found.iter().find(|c| c.cell == cover.cell) {
                arm += cover.fraction.powi(2) * ((other.centroid - cover.centroid) / grid.spacing).length_squared();
            }
        }
        for cover in &found {
            if fraction_in(&exact, cover.cell) == 0.0 {
                squares += cover.fraction.powi(2);
            }
        }
        cells += exact.len() as Real;
        volume += raw.raw_volume_error.powi(2);
    }
    ((squares / cells).sqrt(), (volume / poses as Real).sqrt(), (arm / cells).sqrt())
}

#[test]
fn columns_are_of_second_order_in_their_spacing() {
    let columns = |per_axis| errors(VolumeFractionMethod::Columns { per_axis }, 200);
    println!("method          rms alpha   rms volume   rms alpha*arm/dx");
    for (name, (alpha, volume, arm)) in [
        ("columns 2^2", columns(2)),
        ("columns 3^2", columns(3)),
        ("columns 4^2", columns(4)),
        ("columns 8^2", columns(8)),
    ] {
        println!("{name:15} {alpha:9.5} {volume:12.6} {arm:12.5}");
    }
    // 0.014 is what the centres of 4^3 sub-cells would give for this grain on this grid.
    let (alpha, volume, _) = columns(4);
    assert!(alpha < 0.012, "{alpha}");
    assert!(volume < 0.006, "{volume}");
    // At least in the mean over poses.
    assert!(columns(8).0 < 0.45 * alpha && columns(2).0 > alpha / 0.45);
}

#[test]
fn clipping_is_exact_for_cuboids() {
    let grid = Grid::new([20, 20, 20], Vector::new(-0.3, 0.2, 0.1), Vector::new(1.7, 3.2, 1.6));
    let edges = Vector::new(0.37, 0.52, 0.44);
    let block = cuboid(edges);
    let mut random = Random::new(3);
    for turn in [Quaternion::IDENTITY, Quaternion::from_rotation_x(std::f64::consts::FRAC_PI_2)] {
        let half = 0.5 * (turn * edges).abs();
        for _ in 0..20 {
            let (x, _) = pose(&mut random, &grid);
            let (covers, _) = imprint(VolumeFractionMethod::Clip, &block, x, turn, &grid);
            let mut total = 0.0;
            for cover in &covers {
                let [i, j, k] = cover.cell.map(|n| n as isize);
                let lower = grid.centre(i, j, k) - 0.5 * grid.spacing;
                let (from, to) = (lower.max(x - half), (lower + grid.spacing).min(x + half));
                let size = (to - from).max(Vector::ZERO) / grid.spacing;
                let exact = size.x * size.y * size.z;
                assert!((cover.fraction - exact).abs() < 1e-12, "{} {exact}", cover.fraction);
                if exact > 1e-6 {
                    assert!((cover.centroid - 0.5 * (from + to)).length() < 1e-9);
                }
                total += exact;
            }
            assert!((total * grid.cell_volume() / block.volume() - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn a_cuboid_on_the_faces_of_cells_fills_them_by_every_method() {
    let grid = Grid::new([10, 10, 10], Vector::ZERO, Vector::ONE);
    let block = cuboid(Vector::new(0.3, 0.2, 0.4));
    for method in [COLUMNS, VolumeFractionMethod::Clip] {
        let (covers, _) = imprint(method, &block, Vector::new(0.55, 0.5, 0.4), Quaternion::IDENTITY, &grid);
        let full = covers.iter().filter(|c| c.fraction > 1.0 - 1e-9).count();
        assert_eq!(full, 24, "{method:?}");
        let rest: Real = covers.iter().map(|c| c.fraction).filter(|f| *f <= 1.0 - 1e-9).sum();
        assert!(rest < 1e-9);
    }
}

#[test]
fn clipping_agrees_with_points_in_the_mesh() {
    // An independent measure: winding numbers of the points of a fine lattice.
    let (grid, grain) = (paper_grid(), paper_grain());
    let (x, q) = pose(&mut Random::new(11), &grid);
    let (covers, _) = imprint(VolumeFractionMethod::Clip, &grain, x, q, &grid);
    const POINTS: usize = 12;
    let mut squares = 0.0;
    for cover in &covers {
        let [i, j, k] = cover.cell.map(|n| n as isize);
        let lower = grid.centre(i, j, k) - 0.5 * grid.spacing;
        let mut inside = 0;
        for n in 0..POINTS.pow(3) {
            let index =
                [n % POINTS, n / POINTS % POINTS, n / POINTS / POINTS].map(|m| (m as Real + 0.5) / POINTS as Real);
            let point = lower + grid.spacing * Vector::from_array(index);
            inside += usize::from(grain.surface().contains(q.inverse() * (point - x)));
        }
        let sampled = inside as Real / POINTS.pow(3) as Real;
        squares += (sampled - cover.fraction).powi(2);
    }
    let rms = (squares / covers.len() as Real).sqrt();
    assert!(rms < 0.005, "{rms}");
}

#[test]
fn sampling_is_unbiased_over_translations() {
    let (grid, grain) = (paper_grid(), paper_grain());
    let (base, q) = pose(&mut Random::new(5), &grid);
    let (mut mean, mut rms, mut count) = (0.0, 0.0, 0.0);
    // The lattice of samples repeats four times a cell: translations through one of its periods cover all.
    for n in 0..512 {
        let shift = Vector::new(Real::from(n % 8), Real::from(n / 8 % 8), Real::from(n / 64)) / 32.0 * grid.spacing;
        let (_, imprint) = imprint(COLUMNS, &grain, base + shift, q, &grid);
        mean += imprint.raw_volume_error;
        rms += imprint.raw_volume_error.powi(2);
        count += 1.0;
    }
    let (mean, rms) = (mean / count, Real::sqrt(rms / count));
    println!("mean volume error {mean:.2e}, rms {rms:.2e}");
    assert!(mean.abs() < 2e-4 && mean.abs() < 0.2 * rms, "{mean} {rms}");
}

#[test]
fn a_shift_by_whole_cells_shifts_the_cells() {
    let grain = paper_grain();
    let grid = Grid::new([64, 64, 64], Vector::ZERO, Vector::splat(64.0 * 0.1875e-3));
    let (x, q) = pose(&mut Random::new(9), &grid);
    let (here, _) = imprint(COLUMNS, &grain, x, q, &grid);
    // Out of the grid altogether: the list goes on outside.
    let (there, _) = imprint(COLUMNS, &grain, x - 50.0 * grid.spacing, q, &grid);
    assert_eq!(here.len(), there.len());
    for (a, b) in here.iter().zip(&there) {
        assert_eq!(a.cell.map(|n| n - 50), b.cell);
        assert!((a.fraction - b.fraction).abs() < 1e-9);
    }
    assert!(there.iter().any(|c| c.cell[0] < 0));
}

#[test]
fn a_grain_that_slips_between_the_samples_is_evaluated_exactly() {
    let grid = Grid::new([4, 4, 4], Vector::ZERO, Vector::ONE);
    let grain = paper_grain_of(20.0);
    let mut random = Random::new(2);
    let mut fell_back = 0;
    for _ in 0..100 {
        let (x, q) = pose(&mut random, &grid);
        let (covers, imprint) = imprint(COLUMNS, &grain, x, q, &grid);
        fell_back += usize::from(imprint.fell_back);
        let volume: Real = covers.iter().map(|c| c.fraction).sum();
        assert!((volume * grid.cell_volume() / grain.volume() - 1.0).abs() < 1e-12);
    }
    assert!(fell_back > 50);
}

#[test]
fn the_order_of_calls_leaves_no_trace_and_memory_is_reused() {
    let (grid, grain) = (paper_grid(), paper_grain());
    let mut random = Random::new(4);
    let poses: Vec<_> = (0..200).map(|_| pose(&mut random, &grid)).collect();
    let mut rasteriser = Rasteriser::new(COLUMNS);
    let mut covers = Vec::new();
    for &(x, q) in &poses {
        rasteriser.imprint(&grain, x, q, &grid, &mut covers);
    }
    let first = covers.clone();
    covers.clear();
    let before = allocations_of_thread();
    for &(x, q) in &poses {
        rasteriser.imprint(&grain, x, q, &grid, &mut covers);
    }
    assert_eq!(allocations_of_thread(), before);
    assert_eq!(first, covers);
    let (alone, _) = imprint(COLUMNS, &grain, poses[17].0, poses[17].1, &grid);
    assert!(covers.windows(alone.len()).any(|w| w == alone));
}

#[test]
fn the_surface_in_the_cells_adds_up_to_that_of_the_grain_and_does_not_jump() {
    let (grid, grain) = (paper_grid(), paper_grain());
    let whole = grain.surface().area();
    let mut random = Random::new(5);
    let areas = |x: Vector, q: Quaternion, with_areas: bool| {
        let mut covers = Vec::new();
        let clip = Rasteriser::new(VolumeFractionMethod::Clip).with_areas(with_areas);
        clip.clone().imprint(&grain, x, q, &grid, &mut covers);
        covers
    };
    for _ in 0..50 {
        let (x, q) = pose(&mut random, &grid);
        let covers = areas(x, q, true);
        let sum: Real = covers.iter().map(|cover| cover.area).sum();
        assert!((sum / whole - 1.0).abs() < 1e-6, "{}", sum / whole);
        let centre = covers.iter().map(|cover| cover.area * (cover.surface - x)).sum::<Vector>() / whole;
        assert!(centre.length() < 1e-3 * whole.sqrt());
        // A thousandth of a cell further the areas are nearly the same.
        let moved = areas(x + 1e-3 * grid.spacing, q, true);
        let change: Real = covers
            .iter()
            .map(|a| a.area - moved.iter().find(|b| b.cell == a.cell).map_or(0.0, |b| b.area))
            .map(Real::abs)
            .sum();
        assert!(change < 0.02 * whole, "{}", change / whole);
        // Negative control: not asked for.
        assert!(areas(x, q, false).iter().all(|cover| cover.area == 0.0));
    }
}

#[test]
fn the_sections_of_a_box_across_its_axis_have_the_area_and_the_centre_of_its_end() {
    let (grid, edges) = (paper_grid(), Vector::new(1.1e-3, 0.93e-3, 0.71e-3));
    let block = cuboid(edges);
    let mut random = Random::new(7);
    for (d, axis) in [Vector::X, Vector::Y, Vector::Z].into_iter().enumerate() {
        let (x, _) = pose(&mut random, &grid);
        let q = Quaternion::from_axis_angle(axis, 6.0 * random.unit());
        let covers_of = |with_areas: bool| {
            let mut covers = Vec::new();
            Rasteriser::new(VolumeFractionMethod::Clip).with_areas(with_areas).imprint(
                &block,
                x,
                q,
                &grid,
                &mut covers,
            );
            covers
        };
        let covers = covers_of(true);
        let [a, b] = [1, 2].map(|t| (d + t) % 3);
        let (face, end) = (grid.spacing[a] * grid.spacing[b], edges[a] * edges[b]);
        let mut planes = 0;
        for plane in 0..200 {
            let place = grid.lower[d] + grid.spacing[d] * Real::from(plane);
            if (place - x[d]).abs() > 0.499 * edges[d] {
                continue;
            }
            planes += 1;
            let sections = covers.iter().filter(|cover| cover.cell[d] == plane).map(|cover| cover.sections[d]);
            let [area, first, second] = sections.fold([0.0; 3], |[area, first, second], section| {
                [area + section.part, first + section.moment[0], second + section.moment[1]]
            });
            assert!((area * face / end - 1.0).abs() < 1e-6, "{d}: {}", area * face / end);
            assert!((first / area - x[a]).abs() < 1e-6 * edges[a] && (second / area - x[b]).abs() < 1e-6 * edges[b]);
        }
        assert!(planes >= 3, "{planes}");
        // Negative control: not asked for.
        assert!(covers_of(false).iter().all(|cover| cover.sections[d].part == 0.0));
    }
}

#[test]
#[ignore = "prints the cost of each method"]
fn cost() {
    let (grid, grain) = (paper_grid(), paper_grain());
    let mut random = Random::new(6);
    let poses: Vec<_> = (0..2000).map(|_| pose(&mut random, &grid)).collect();
    for (name, method) in [
        ("columns 3^2", VolumeFractionMethod::Columns { per_axis: 3 }),
        ("columns 4^2", COLUMNS),
        ("columns 8^2", VolumeFractionMethod::Columns { per_axis: 8 }),
        ("clip", VolumeFractionMethod::Clip),
    ] {
        let mut rasteriser = Rasteriser::new(method);
        let mut covers = Vec::new();
        let best = (0..7)
            .map(|_| {
                covers.clear();
                let start = std::time::Instant::now();
                for &(x, q) in &poses {
                    rasteriser.imprint(&grain, x, q, &grid, &mut covers);
                }
                start.elapsed().as_secs_f64() / poses.len() as f64
            })
            .fold(f64::INFINITY, f64::min);
        println!("{name:14} {:6.2} us a grain, {:.1} cells", best * 1e6, covers.len() as f64 / poses.len() as f64);
    }
}
