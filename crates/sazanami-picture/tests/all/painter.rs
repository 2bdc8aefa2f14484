//! Every figure of a run and of its evaluation becomes a PNG file of its own.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use sazanami::artist::{Amount, Artist as _, BedSurface, Colouring, CraterCap, Figure, Scene, SideView};
use sazanami_io::BodyPose;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Vector};
use sazanami_picture::{ColourScale, Painter};

/// A ball on the floor of a box, with liquid above it.
fn scene() -> Scene {
    let grid = Grid::new([8, 8, 8], Vector::ZERO, Vector::splat(0.008));
    let ball = Shape::sphere(2e-3, 1, VolumeRule::Preserve, &ContactSphereRule::Single).expect("a sphere has a shape");
    let pose = BodyPose {
        scale: 1.0,
        surface: 0,
        position: Vector::new(0.004, 0.004, 0.001),
        orientation: Quaternion::IDENTITY,
    };
    let liquid = (0..grid.len()).map(|n| if n / 64 == 5 { 1.0 } else { 0.0 }).collect();
    Scene {
        title: "t = 1 ms".into(),
        grid,
        top: 0.008,
        plane: 0.004,
        colouring: Colouring::Speed(vec![0.3], 1.0),
        shapes: [ball].into(),
        poses: vec![pose],
        liquid,
        surface: None,
    }
}

fn side_view() -> SideView {
    SideView {
        title: "t = 1 s".into(),
        note: "the middle of the tank".into(),
        x: [-0.02, 0.02],
        z: [0.0, 0.03],
        slab: [-0.01, 0.01],
        position: vec![Vector::new(0.0, 0.0, 0.002), Vector::new(0.004, 0.0, 0.002)],
        diameter: vec![2e-3; 2],
        panels: vec![Colouring::Speed(vec![0.0, 0.1], 0.1), Colouring::Signed(vec![-1.0, 1.0], "drag [N]".into(), 1.0)],
        water: vec![[-0.02, 0.02], [0.02, 0.021]],
        window: [-0.005, 0.005],
        arrows: vec![([0.0, 0.01], [0.05, 0.0])],
        reference: 0.1,
    }
}

#[test]
fn every_figure_becomes_a_picture_of_its_own() {
    let (scene, side) = (scene(), side_view());
    let all = [Figure::Section(&scene), Figure::Liquid(&scene), Figure::View(&scene), Figure::Tank(&side)];
    let folder = tempfile::tempdir().expect("the picture was written");
    let mut drawn: Vec<Vec<u8>> = Vec::new();
    for (n, figure) in all.iter().enumerate() {
        let path = folder.path().join(format!("{n}.png"));
        Painter.draw(figure, &path).expect("the picture was written");
        let bytes = std::fs::read(&path).expect("the picture was written");
        assert!(bytes.starts_with(b"\x89PNG") && !drawn.contains(&bytes), "{n}");
        drawn.push(bytes);
    }
    // What cannot be kept is an error.
    assert!(Painter.draw(&all[0], &folder.path().join("absent/a.png")).is_err());
}

#[test]
fn a_tank_shows_the_grains_of_its_slab_alone() {
    let folder = tempfile::tempdir().expect("the picture was written");
    let drawn = |side: &SideView| {
        let path = folder.path().join("tank.png");
        Painter.draw(&Figure::Tank(side), &path).expect("the picture was written");
        std::fs::read(&path).expect("the picture was written")
    };
    let both = side_view();
    let mut beside = both.clone();
    beside.position[1].y = 0.02;
    let mut alone = both.clone();
    alone.position.truncate(1);
    alone.diameter.truncate(1);
    for panel in &mut alone.panels {
        let (Colouring::Speed(values, _)
        | Colouring::WaterSpeed(values, _)
        | Colouring::Height(values, _)
        | Colouring::Signed(values, ..)) = panel;
        values.truncate(1);
    }
    assert!(drawn(&beside) == drawn(&alone) && drawn(&both) == drawn(&both));
    // The control: within the slab the second grain is seen.
    assert!(drawn(&both) != drawn(&alone));
}

/// Pixels of a picture, left of the bar of colours, whose red, green and blue satisfy `is_counted`.
fn count(path: &Path, is_counted: impl Fn([u8; 3]) -> bool) -> usize {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path).expect("the picture was written")))
        .read_info()
        .expect("the picture was written");
    let mut bytes = vec![0; reader.output_buffer_size().expect("the picture was written")];
    let header = reader.next_frame(&mut bytes).expect("the picture was written");
    assert_eq!(header.color_type, png::ColorType::Rgb);
    let rows = bytes.chunks_exact(header.line_size);
    let left = rows.flat_map(|row| row[..row.len() - 3 * 150].as_chunks::<3>().0);
    left.filter(|pixel| is_counted(**pixel)).count()
}

#[test]
fn a_grain_that_the_middle_plane_cuts_is_in_the_view_and_one_in_front_of_it_is_not() {
    let folder = tempfile::tempdir().expect("the picture was written");
    // Without liquid nothing else in the view has the warm colours of a slow grain.
    let drawn = |y: f64| {
        let mut scene = Scene { liquid: vec![0.0; 512], colouring: Colouring::Speed(vec![0.0], 1.0), ..scene() };
        scene.poses[0].position.y = y;
        let path = folder.path().join("view.png");
        Painter.draw(&Figure::View(&scene), &path).expect("the picture was written");
        count(&path, |[red, _, blue]| red > blue.saturating_add(25))
    };
    let seen = drawn(0.004);
    assert!(seen > 5_000, "{seen}");
    for nudge in [1e-12, -1e-12, 0.5e-3, -0.5e-3] {
        let moved = drawn(0.004 + nudge);
        assert!(moved.abs_diff(seen) < seen / 4, "{moved} against {seen} after {nudge} m");
    }
    assert_eq!(drawn(0.004 - 1.5e-3), 0, "a ball of 1 mm radius that lies wholly in front of the plane");
}

#[test]
fn pictures_of_all_times_have_one_frame_and_a_rim_only_with_a_crater() {
    let folder = tempfile::tempdir().expect("the picture was written");
    let path = folder.path().join("frame.png");
    let size = |figure: &Figure| {
        Painter.draw(figure, &path).expect("the picture was written");
        let file = BufReader::new(File::open(&path).expect("the picture was written"));
        png::Decoder::new(file).read_info().expect("the picture was written").info().size()
    };
    // The line of the surface, and the marks of the rim, which are black.
    let black = || count(&path, |pixel| pixel.iter().all(|&c| c < 60));
    let crater = CraterCap {
        rim_radius: 2e-3,
        rim_height: 4e-3,
        depth: 1e-3,
        below_rim: Amount { volume: 6e-9, uncertainty: 1e-9, doubts: String::new() },
        cap: Amount { volume: 7e-9, uncertainty: 1e-9, doubts: String::new() },
        noise: 0.0,
    };
    let surface = BedSurface {
        axis: 4e-3,
        before: vec![[1e-3, 4e-3], [3e-3, 4e-3]],
        now: vec![[1e-3, 3e-3], [2e-3, 4e-3]],
        crater: None,
    };
    let first = Scene { top: 6e-3, surface: Some(surface.clone()), ..scene() };
    let mut later = Scene { liquid: vec![0.0; 512], ..first.clone() };
    later.poses[0].position.z = 7e-3;
    later.surface = Some(BedSurface { crater: Some(crater), ..surface });
    for figure in [Figure::Liquid, Figure::View, Figure::Section] {
        assert_eq!(size(&figure(&first)), size(&figure(&later)));
    }
    let with_crater = black();
    size(&Figure::Section(&Scene { surface: first.surface.clone(), ..later.clone() }));
    assert!(with_crater > black() + 500, "{with_crater} against {}", black());
    // Another box has another frame: the control.
    assert_ne!(size(&Figure::Section(&first)), size(&Figure::Section(&Scene { top: 8e-3, ..first.clone() })));
}

#[test]
fn a_section_that_meets_no_grain_goes_through_the_nearest_one() {
    let folder = tempfile::tempdir().expect("the picture was written");
    let cut = ColourScale::speed(1.0).colour(1.0);
    let drawn = |y: f64| {
        let mut scene = Scene { liquid: vec![0.0; 512], colouring: Colouring::Speed(vec![1.0], 1.0), ..scene() };
        scene.poses[0].position.y = y;
        let path = folder.path().join("section.png");
        Painter.draw(&Figure::Section(&scene), &path).expect("the picture was written");
        count(&path, |pixel| pixel.iter().zip(cut).all(|(&a, b)| a.abs_diff(b) < 16))
    };
    let through_the_middle = drawn(0.004);
    assert!(through_the_middle > 10_000, "{through_the_middle}");
    for y in [0.001, 0.0028, 0.0052, 0.007] {
        let moved = drawn(y);
        assert!(moved.abs_diff(through_the_middle) < through_the_middle / 50, "{moved} of {through_the_middle} at {y}");
    }
    // A plane that meets the grain stays where it is, and cuts a smaller circle: the control.
    let beside = drawn(0.0048);
    assert!(beside < through_the_middle / 2, "{beside} of {through_the_middle}");
}
