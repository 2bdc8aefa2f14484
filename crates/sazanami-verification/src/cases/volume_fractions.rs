//! Part of each cell that a shape covers.

use sazanami_dem::Random;
use sazanami_numerics::geometry::{
    CellCover, ContactSphereRule, Rasteriser, Shape, ShapeError, SpheroidMesh, TetrahedralMesh, VolumeFractionMethod,
    VolumeRule,
};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Real, Vector};

use crate::measured::Measured;

const GRAIN: [Real; 2] = [0.26e-3, 0.635e-3];
/// The paper's grid.
const SPACING: Vector = Vector::new(0.19205e-3, 0.1837e-3, 0.18939e-3);

fn grid() -> Grid {
    let cells = [16, 16, 16];
    Grid::new(cells, Vector::ZERO, 16.0 * SPACING)
}

fn shapes() -> Result<Vec<(&'static str, Shape)>, ShapeError> {
    let inside = ContactSphereRule::Listed(vec![(Vector::ZERO, 0.05e-3)]);
    let corners = [[0.0, 0.0, 0.0], [0.8, 0.0, 0.1], [0.1, 0.9, 0.0], [0.2, 0.1, 0.7]];
    let tetrahedron = TetrahedralMesh {
        nodes: corners.iter().map(|c| 1e-3 * (Vector::from_array(*c) - Vector::new(0.275, 0.25, 0.2))).collect(),
        tetrahedra: vec![[0, 1, 2, 3]],
    };
    Ok(vec![
        ("sphere", Shape::sphere(0.52e-3, 3, VolumeRule::Preserve, &ContactSphereRule::Single)?),
        (
            "spheroid",
            Shape::spheroid(
                GRAIN[0],
                GRAIN[1],
                SpheroidMesh::PAPER,
                VolumeRule::Inscribed,
                &ContactSphereRule::Axis { count: 9 },
            )?,
        ),
        ("cuboid", Shape::cuboid(Vector::new(0.5e-3, 0.8e-3, 0.6e-3), &inside)?),
        ("tetrahedron", Shape::from_mesh("tetrahedron", tetrahedron, &inside)?),
    ])
}

/// Differences from the exact fractions over poses at random.
#[derive(Default)]
struct Errors {
    /// Largest relative error of the corrected volume.
    volume: Real,
    /// Root mean square error of a touched cell's fraction.
    fraction: Real,
    /// Mean and root mean square relative error of the volume before the correction.
    raw: [Real; 2],
}

fn errors(shape: &Shape, method: VolumeFractionMethod, poses: usize) -> Errors {
    let grid = grid();
    let (mut exact, mut tried) = (Rasteriser::new(VolumeFractionMethod::Clip), Rasteriser::new(method));
    let mut random = Random::new(3);
    let (mut all, mut some): (Vec<CellCover>, Vec<CellCover>) = (Vec::new(), Vec::new());
    let (mut sum, mut count, mut found) = (0.0, 0.0, Errors::default());
    for _ in 0..poses {
        let offset = Vector::from_array(std::array::from_fn(|_| random.unit())) * SPACING;
        let (position, orientation) = (0.5 * grid.extent() + offset, random.orientation());
        all.clear();
        some.clear();
        exact.imprint(shape, position, orientation, &grid, &mut all);
        let imprint = tried.imprint(shape, position, orientation, &grid, &mut some);
        let volume: Real = some.iter().map(|cover| cover.fraction).sum::<Real>() * grid.cell_volume();
        found.volume = found.volume.max((volume / shape.volume() - 1.0).abs());
        found.raw[0] += imprint.raw_volume_error / poses as Real;
        found.raw[1] += imprint.raw_volume_error.powi(2) / poses as Real;
        let of = |covers: &[CellCover], cell| covers.iter().find(|c| c.cell == cell).map_or(0.0, |c| c.fraction);
        for cover in &all {
            sum += (of(&some, cover.cell) - cover.fraction).powi(2);
            count += 1.0;
        }
    }
    found.fraction = (sum / count).sqrt();
    found.raw[1] = found.raw[1].sqrt();
    found
}

/// Largest error of the exact method on a box along the axes whose fractions are products of lengths.
fn box_along_axes() -> Result<Real, ShapeError> {
    let grid = grid();
    let edges = Vector::new(0.5e-3, 0.8e-3, 0.6e-3);
    let shape = Shape::cuboid(edges, &ContactSphereRule::Listed(vec![(Vector::ZERO, 0.05e-3)]))?;
    let centre = 0.5 * grid.extent() + Vector::new(0.3, 0.7, 0.11) * SPACING;
    let mut covers = Vec::new();
    Rasteriser::new(VolumeFractionMethod::Clip).imprint(&shape, centre, Quaternion::IDENTITY, &grid, &mut covers);
    let mut worst: Real = 0.0;
    for cover in covers {
        let lower = Vector::from_array(cover.cell.map(Real::from)) * grid.spacing;
        let length = (lower + grid.spacing).min(centre + 0.5 * shape_edges(&shape, edges))
            - lower.max(centre - 0.5 * shape_edges(&shape, edges));
        let exact = (length / grid.spacing).element_product();
        worst = worst.max((cover.fraction - exact).abs());
    }
    Ok(worst)
}

/// The edges of a box along the body axes of its shape, which follow its principal moments.
fn shape_edges(shape: &Shape, edges: Vector) -> Vector {
    let (_, turn) = shape.source_frame();
    (turn.transpose() * edges).abs()
}

/// Volume fractions of shapes in cells.
pub(crate) fn evaluators() -> Result<Vec<Measured>, String> {
    let shapes = shapes().map_err(|error| error.to_string())?;
    let mut rows = Vec::new();
    for (name, shape) in &shapes {
        let found = errors(shape, VolumeFractionMethod::default(), 200);
        rows.push(Measured::new(format!("{name}: error of the corrected volume"), found.volume));
    }
    let grain = &shapes[1].1;
    let found = errors(grain, VolumeFractionMethod::default(), 400);
    rows.push(Measured::new("grain, 4^2 columns (default): rms error of alpha", found.fraction));
    rows.push(Measured::new("grain, 4^2 columns: rms error of the raw volume", found.raw[1]));
    rows.push(Measured::new(
        "grain, 4^2 columns: mean error of the raw volume over rms",
        (found.raw[0] / found.raw[1]).abs(),
    ));
    let cuboid = box_along_axes().map_err(|error| error.to_string())?;
    rows.push(Measured::new("cuboid, clipped: largest error of alpha", cuboid));
    let coarse = errors(grain, VolumeFractionMethod::Columns { per_axis: 1 }, 200);
    rows.push(Measured::new("control: rms error of alpha with one column", coarse.fraction));
    Ok(rows)
}
