//! Pictures show what they are given, and the same pixels for any number of threads.

use sazanami_io::{Bodies, BodyPose, BodySurface};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Vector};
use sazanami_parallel::with_threads;
use sazanami_picture::{ColourScale, Isosurface, Picture, PictureError, SectionView, Still, section_of_cells};

struct Scene {
    grid: Grid,
    nodes: Vec<Vector>,
    triangles: Vec<[u32; 3]>,
    poses: Vec<BodyPose>,
    speeds: Vec<f64>,
    liquid: Vec<f64>,
}

/// Twelve turned cubes of 2 mm on the floor of a box of 20 x 16 x 12 mm, and a ball of liquid above.
fn scene() -> Scene {
    let grid = Grid::new([20, 16, 12], Vector::ZERO, Vector::new(0.020, 0.016, 0.012));
    let nodes =
        (0..8).map(|n| 2e-3 * (Vector::new((n & 1) as f64, (n >> 1 & 1) as f64, (n >> 2) as f64) - 0.5)).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    let poses = (0..12)
        .map(|n| BodyPose {
            scale: 1.0,
            surface: 0,
            position: Vector::new(0.003 + 0.0045 * f64::from(n % 4), 0.003 + 0.005 * f64::from(n / 4), 0.0015),
            orientation: Quaternion::from_rotation_z(0.4 * f64::from(n)),
        })
        .collect();
    let liquid = (0..grid.len())
        .map(|n| {
            let centre = grid.centre((n % 20) as isize, (n / 20 % 16) as isize, (n / 320) as isize);
            (0.5 + (0.003 - centre.distance(Vector::new(0.010, 0.008, 0.007))) / 1e-3).clamp(0.0, 1.0)
        })
        .collect();
    Scene { grid, nodes, triangles, poses, speeds: (0..12).map(|n| f64::from(n) / 11.0).collect(), liquid }
}

fn section(scene: &Scene, liquid: &[f64], with_grains: bool) -> Picture {
    let surfaces = [BodySurface { nodes: &scene.nodes, triangles: &scene.triangles }];
    let scale = ColourScale::speed(1.0);
    let mut view = SectionView::new(&scene.grid, 0.008, "t = 0.02 s", liquid, &scale);
    if with_grains {
        view = view.with_grains(Bodies { surfaces: &surfaces, poses: &scene.poses }, &scene.speeds);
    }
    SectionView { width: 400, ..view }.draw().expect("the view fits the scene")
}

fn still(scene: &Scene, surface: &Isosurface) -> Picture {
    let surfaces = [BodySurface { nodes: &scene.nodes, triangles: &scene.triangles }];
    let bodies = Bodies { surfaces: &surfaces, poses: &scene.poses };
    let scale = ColourScale::speed(1.0);
    let still = Still::new(&scene.grid, "t = 0.02 s", bodies, &scene.speeds, &scale);
    Still { liquid: Some(surface), size: [320, 240], ..still }.draw().expect("the still fits the scene")
}

fn is_blue(pixel: &&[u8; 3]) -> bool {
    i32::from(pixel[2]) > i32::from(pixel[0]) + 40
}

#[test]
fn pictures_are_the_same_for_any_number_of_threads() {
    let scene = scene();
    let surface = Isosurface::new(&scene.grid, &scene.liquid, 0.5, 1).unwrap();
    let liquid = section_of_cells(&scene.grid, &scene.liquid, 0.008);
    let draw = || (section(&scene, &liquid, true), still(&scene, &surface));
    let drawn = |threads| with_threads(threads, draw).unwrap();
    let first = drawn(1);
    assert!(first == drawn(1) && first == drawn(3));
}

#[test]
fn the_cut_faces_of_grains_have_their_area_and_colour() {
    let scene = scene();
    let picture = section(&scene, &[0.0; 240], true);
    // Grains 4 to 7 lie across the plane; the one at 0.8 rad from the axes is cut along a line of known length.
    let scale = ColourScale::speed(1.0);
    let width = |angle: f64| 2e-3 / angle.cos().abs().max(angle.sin().abs());
    for n in 4..8 {
        let face = scale.colour(scene.speeds[n]).map(|c| c as i32);
        let near = |pixel: &&[u8; 3]| (0..3).all(|c| (i32::from(pixel[c]) - face[c]).abs() < 12);
        // The bar of colours lies to the right of the section.
        let rows = picture.pixels().chunks(picture.width()).map(|row| &row[..96 + 400]);
        let count = rows.flatten().filter(near).count() as f64;
        let area = width(0.4 * n as f64) * 2e-3 * (400.0_f64 / 0.020).powi(2);
        // The outline takes a pixel off all round.
        assert!((0.80..1.15).contains(&(count / area)), "grain {n}: {count} pixels of {area}");
    }
}

#[test]
fn liquid_is_drawn_where_there_is_at_least_a_hundredth() {
    let scene = scene();
    let drop = section(&scene, &section_of_cells(&scene.grid, &scene.liquid, 0.008), false);
    let area = std::f64::consts::PI * 0.003_f64.powi(2) * (400.0_f64 / 0.020).powi(2);
    let empty = section(&scene, &[0.0; 240], false);
    // In the section itself, without the legend below it.
    let shown = |picture: &Picture| -> Vec<[u8; 3]> {
        picture.pixels().chunks(picture.width()).take(56 + 240).flatten().copied().collect()
    };
    let wet = shown(&drop).iter().zip(&shown(&empty)).filter(|(a, b)| a != b).count() as f64;
    // Between the centres of cells a hundredth lies farther out than the surface.
    assert!((1.5..1.65).contains(&(wet / area)), "{wet} pixels of {area}");
    assert!(drop.pixels().iter().filter(is_blue).count() as f64 > 0.7 * area);
    assert!(empty == section(&scene, &[0.009; 240], false));
    assert!(empty != section(&scene, &[0.011; 240], false));
}

#[test]
fn a_still_shows_grains_and_liquid() {
    let scene = scene();
    let picture = still(&scene, &Isosurface::new(&scene.grid, &scene.liquid, 0.5, 1).unwrap());
    // The bar of colours stands beside the view and the title above it.
    assert_eq!((picture.width(), picture.height()), (320 + 130, 240 + 56));
    let sandy = picture.pixels().iter().filter(|p| i32::from(p[0]) > i32::from(p[2]) + 40).count();
    let blue = picture.pixels().iter().filter(is_blue).count();
    assert!(sandy > 1500 && blue > 800, "{sandy} {blue}");
}

/// Pixels of sand in the view itself.
fn sandy(picture: &Picture) -> usize {
    let rows = picture.pixels().chunks(picture.width()).skip(56).map(|row| &row[..320]);
    rows.flatten().filter(|p| i32::from(p[0]) > i32::from(p[2]) + 40).count()
}

#[test]
fn a_scene_without_grains_has_no_pixels_of_grains() {
    let mut scene = scene();
    let water = Isosurface::new(&scene.grid, &scene.liquid, 0.5, 1).unwrap();
    assert!(sandy(&still(&scene, &water)) > 1500);
    scene.poses.clear();
    scene.speeds.clear();
    assert_eq!(sandy(&still(&scene, &water)), 0);
}

#[test]
fn values_that_do_not_fit_are_refused() {
    let scene = scene();
    let surfaces = [BodySurface { nodes: &scene.nodes, triangles: &scene.triangles }];
    let bodies = Bodies { surfaces: &surfaces, poses: &scene.poses };
    let scale = ColourScale::speed(1.0);
    let still = Still::new(&scene.grid, "", bodies, &[1.0], &scale);
    assert!(matches!(still.draw(), Err(PictureError::WrongLength { expected: 12, found: 1, .. })));
}

#[test]
fn a_saved_picture_is_a_png_of_the_same_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plot.png");
    let picture = section(&scene(), &[0.0; 240], true);
    picture.save(&path).unwrap();
    let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width as usize, info.height as usize), (picture.width(), picture.height()));
    assert_eq!(pixels.as_chunks::<3>().0, picture.pixels());
    assert!(matches!(picture.save(&folder.path().join("none/plot.png")), Err(PictureError::Write { .. })));
}
