//! The pictures of runs and of their evaluation.

use std::borrow::Cow;
use std::path::Path;

use sazanami::artist::{Artist, Colouring, Figure, NotDrawn, Scene, SideView};
use sazanami_io::{Bodies, BodyPose, BodySurface};
use sazanami_numerics::geometry::{ContactSphereRule, Exact, Shape, SpheroidMesh, VolumeRule};

use super::crater::volume_words;
use super::{
    ColourScale, Isosurface, Picture, PictureError, SectionView, SlabPanel, SlabView, Still, VectorWindow, Viewpoint,
    section_of_cells,
};

/// Part of a cell that is liquid outside grains on the surface that is drawn: thin sheets stay visible.
const SURFACE: f64 = 0.3;
/// Width of the panels of a tank, and of a view \[pixels].
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
    }
}

/// Rings and segments of a spheroid as it is drawn: cut through, it is round.
const SMOOTH: SpheroidMesh = SpheroidMesh { rings: 9, segments: 12 };

/// Shapes as they are drawn: spheroids smooth, if the mesh that the fluid knows them by is coarser; the others by their meshes.
fn drawn_shapes(scene: &Scene) -> Vec<Shape> {
    let drawn = scene.shapes.iter().map(|shape| match shape.exact() {
        Some(Exact::Spheroid(exact)) if exact.equatorial != exact.axial => {
            let spheres = ContactSphereRule::Axis { count: 1 };
            Shape::spheroid(exact.equatorial, exact.axial, SMOOTH, VolumeRule::Inscribed, &spheres)
                .ok()
                .filter(|smooth| smooth.surface().triangles.len() > shape.surface().triangles.len())
                .unwrap_or_else(|| shape.clone())
        }
        _ => shape.clone(),
    });
    drawn.collect()
}

/// Surfaces of shapes.
fn surfaces(shapes: &[Shape]) -> Vec<BodySurface<'_>> {
    let surfaces = shapes.iter().map(|shape| shape.surface());
    surfaces.map(|surface| BodySurface { nodes: &surface.nodes, triangles: &surface.triangles }).collect()
}

/// Values that colour bodies, and their scale.
fn coloured(colouring: &Colouring) -> (Cow<'_, [f64]>, ColourScale) {
    match colouring {
        Colouring::Speed(values, fastest) => (values.into(), ColourScale::speed(*fastest)),
        Colouring::WaterSpeed(values, fastest) => {
            let label = "speed of the water [m/s]".to_owned();
            (values.into(), ColourScale { label, ..ColourScale::speed(*fastest) })
        }
        Colouring::Height(heights, range) => {
            (heights.iter().map(|height| 1e3 * height).collect(), ColourScale::height(*range))
        }
        Colouring::Signed(values, label, largest) => (values.into(), ColourScale::symmetric(label, *largest)),
    }
}

/// Title of a scene, with the volume of its crater if there is one.
fn title(scene: &Scene) -> String {
    let crater = scene.surface.as_ref().and_then(|surface| surface.crater.as_ref());
    let volume = crater.map_or_else(String::new, |crater| format!(", {}", volume_words(crater)));
    format!("{}{volume}", scene.title)
}

/// Section through the liquid, with the grains or without.
fn section(scene: &Scene, with_grains: bool) -> Result<Picture, PictureError> {
    let shapes = drawn_shapes(scene);
    let surfaces = surfaces(&shapes);
    let bodies = Bodies { surfaces: &surfaces, poses: &scene.poses };
    let (values, scale) = coloured(&scene.colouring);
    let plane = plane(scene, &bodies);
    let mut title = title(scene);
    if plane != scene.plane {
        title += &format!(", section at x₂ = {:.3} mm", 1e3 * plane);
    }
    let cells = section_of_cells(&scene.grid, &scene.liquid, plane);
    let liquid = SectionView::new(&scene.grid, plane, &title, &cells, &scale);
    let liquid = SectionView { top: scene.top, ..liquid };
    if with_grains {
        SectionView { surface: scene.surface.as_ref(), ..liquid }.with_grains(bodies, &values).draw()
    } else {
        liquid.draw()
    }
}

/// Place of the section: that of the scene or, if it meets no grain, the centre of the nearest one \[m].
fn plane(scene: &Scene, bodies: &Bodies) -> f64 {
    let gap = |(pose, radius): (&BodyPose, f64)| ((pose.position.y - scene.plane).abs() - radius, pose.position.y);
    let nearest = bodies.poses.iter().zip(bodies.outer_radii()).map(gap).min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.filter(|&(gap, _)| gap > 0.0).map_or(scene.plane, |(_, centre)| centre)
}

/// Grains and liquid in perspective, cut open.
fn view(scene: &Scene) -> Result<Picture, PictureError> {
    let shapes = drawn_shapes(scene);
    let surfaces = surfaces(&shapes);
    let (values, scale) = coloured(&scene.colouring);
    let any_liquid = scene.liquid.iter().any(|&c| c > SURFACE);
    let liquid = any_liquid.then(|| Isosurface::new(&scene.grid, &scene.liquid, SURFACE, 1)).transpose()?;
    let bodies = Bodies { surfaces: &surfaces, poses: &scene.poses };
    let title = title(scene);
    let still = Still {
        viewpoint: Viewpoint { azimuth: -75.0, elevation: 28.0 },
        top: scene.top,
        cut_open: true,
        liquid: liquid.as_ref(),
        ..Still::new(&scene.grid, &title, bodies, &values, &scale)
    };
    still.fitted(WIDTH).draw()
}

/// A tank from the side.
fn tank(side: &SideView) -> Result<Picture, PictureError> {
    let scaled = side.panels.iter().map(coloured);
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
