//! The pictures of runs and of their evaluation.

use std::path::Path;

use sazanami::artist::{Artist, Colouring, Figure, NotDrawn, Scene, SideView};
use sazanami_io::{Bodies, BodyPose, BodySurface};

use super::{
    ColourScale, Isosurface, LayerFigure, Picture, PictureError, ProfileFigure, SectionView, SlabPanel, SlabView,
    Still, VectorWindow, Viewpoint, bed_profiles, crater_history, erosion_against_momentum, momentum_budget,
    ripple_growth, section_of_cells,
};

/// Part of a cell that is liquid outside grains on the surface that is drawn: thin sheets stay visible.
const SURFACE: f64 = 0.3;
/// Width of the panels of a tank \[pixels].
const WIDTH: usize = 1100;

/// The artist of this crate.
#[derive(Clone, Copy, Debug, Default)]
pub struct Painter;

impl Artist for Painter {
    fn draw(&self, figure: &Figure, path: &Path) -> Result<(), NotDrawn> {
        Ok(picture_of(figure)?.save(path)?)
    }
}

fn picture_of(figure: &Figure) -> Result<Picture, PictureError> {
    match *figure {
        Figure::Section(scene) => section(scene, true),
        Figure::Liquid(scene) => section(scene, false),
        Figure::View(scene) => view(scene),
        Figure::Tank(side) => tank(side),
        Figure::Surfaces { title, moments, x_range } => ProfileFigure { title, moments, x_range }.draw(),
        Figure::BedProfiles { title, curves } => bed_profiles(title, curves).draw(),
        Figure::Crater { title, times, depths_and_radii: [depths, radii] } => {
            crater_history(title, times, depths, radii).draw()
        }
        Figure::MomentumBudget { title, times, parts } => momentum_budget(title, "x₃", times, parts).draw(),
        Figure::Erosion { title, groups } => erosion_against_momentum(title, groups).draw(),
        Figure::Layers { title, history, layers, submerged_weight } => {
            let runs = std::slice::from_ref(history);
            LayerFigure { title, runs, layers, time_range: None, ranges: [None; 4], submerged_weight }.draw()
        }
        Figure::RippleGrowth { title, runs } => ripple_growth(title, runs, false),
    }
}

/// Surfaces of the shapes of a scene.
fn surfaces(scene: &Scene) -> Vec<BodySurface<'_>> {
    let surfaces = scene.shapes.iter().map(|shape| shape.surface());
    surfaces.map(|surface| BodySurface { nodes: &surface.nodes, triangles: &surface.triangles }).collect()
}

/// Section through the liquid, with the grains or without.
fn section(scene: &Scene, with_grains: bool) -> Result<Picture, PictureError> {
    let surfaces = surfaces(scene);
    let bodies = Bodies { surfaces: &surfaces, poses: &scene.poses };
    let scale = ColourScale::speed(scene.fastest);
    let plane = plane(scene, &bodies);
    let title = format!("{}, section at x₂ = {:.3} mm", scene.title, 1e3 * plane);
    let title = if plane == scene.plane { &scene.title } else { &title };
    let cells = section_of_cells(&scene.grid, &scene.liquid, plane);
    let liquid = SectionView::new(&scene.grid, plane, title, &cells, &scale);
    let liquid = SectionView { top: top(scene, &bodies), ..liquid };
    if with_grains { liquid.with_grains(bodies, &scene.speeds).draw() } else { liquid.draw() }
}

/// Place of the section: that of the scene or, if it meets no grain, the centre of the nearest one \[m].
fn plane(scene: &Scene, bodies: &Bodies) -> f64 {
    let gap = |(pose, radius): (&BodyPose, f64)| ((pose.position.y - scene.plane).abs() - radius, pose.position.y);
    let nearest = bodies.poses.iter().zip(bodies.outer_radii()).map(gap).min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.filter(|&(gap, _)| gap > 0.0).map_or(scene.plane, |(_, centre)| centre)
}

/// Grains and liquid in perspective, cut open.
fn view(scene: &Scene) -> Result<Picture, PictureError> {
    let surfaces = surfaces(scene);
    let scale = ColourScale::speed(scene.fastest);
    let any_liquid = scene.liquid.iter().any(|&c| c > SURFACE);
    let liquid = any_liquid.then(|| Isosurface::new(&scene.grid, &scene.liquid, SURFACE, 1)).transpose()?;
    let bodies = Bodies { surfaces: &surfaces, poses: &scene.poses };
    let still = Still {
        viewpoint: Viewpoint { azimuth: -75.0, elevation: 20.0 },
        top: top(scene, &bodies),
        cut_open: true,
        liquid: liquid.as_ref(),
        ..Still::new(&scene.grid, &scene.title, bodies, &scene.speeds, &scale)
    };
    still.draw()
}

/// Upper edge of the pictures of a scene: above all grains and liquid, in steps of a tenth of the box so that it seldom
/// moves from one time to the next \[m].
fn top(scene: &Scene, bodies: &Bodies) -> f64 {
    let tops = bodies.poses.iter().zip(bodies.outer_radii()).map(|(pose, radius)| pose.position.z + radius);
    let [n1, n2, _] = scene.grid.cells;
    let layer = scene.liquid.iter().rposition(|&c| c > SURFACE).map_or(0, |cell| cell / (n1 * n2) + 1);
    let (lower, upper) = (scene.grid.lower.z, scene.grid.upper().z);
    let highest = tops.fold(lower + layer as f64 * scene.grid.spacing.z, f64::max);
    let tenths = (10.0 * (highest - lower) / (upper - lower) + 0.3).ceil().clamp(1.0, 10.0);
    lower + 0.1 * tenths * (upper - lower)
}

/// A tank from the side.
fn tank(side: &SideView) -> Result<Picture, PictureError> {
    let scaled = side.panels.iter().map(|panel| match panel {
        Colouring::Speed(values, fastest) => (values, ColourScale::speed(*fastest)),
        Colouring::Signed(values, label, largest) => (values, ColourScale::symmetric(label, *largest)),
    });
    let scaled: Vec<_> = scaled.collect();
    let panels: Vec<SlabPanel> = scaled.iter().map(|(values, scale)| SlabPanel { values, scale }).collect();
    let window = VectorWindow { x: side.window, z: side.z, vectors: &side.arrows, reference: side.reference };
    let view = SlabView {
        title: &side.title,
        note: &side.note,
        x: side.x,
        z: side.z,
        slab: side.slab,
        position: &side.position,
        diameter: &side.diameter,
        panels: &panels,
        water: &side.water,
        vectors: Some(&window),
        width: WIDTH,
    };
    view.draw()
}
