//! Volume fractions of bodies in the cells of a grid: what the solver on a grid does in every step, by itself.

use std::path::Path;

use sazanami_numerics::Real;
use sazanami_numerics::geometry::{ContactSphereRule, MassProperties, Rasteriser, Shape};

pub use sazanami_numerics::geometry::{TetrahedralMesh, VolumeFractionMethod as Method};
pub use sazanami_numerics::grid::Grid;
pub use sazanami_numerics::{Quaternion, Vector};

use crate::case::value::split_call;
use crate::error::CommandError;

/// A placed body: its mesh multiplied by `scale`, turned, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// Place of the origin of the mesh \[m].
    pub position: Vector,
    /// Turn of the mesh.
    pub orientation: Quaternion,
    /// Factor on every length.
    pub scale: Real,
}

/// The solid in a file of Gmsh, whose lengths are multiplied by `unit` \[m].
///
/// # Errors
/// If there is none in it.
pub fn mesh_of_file(path: &Path, unit: Real) -> Result<TetrahedralMesh, CommandError> {
    let read = sazanami_io::mesh::read(path, unit);
    read.map(|file| file.mesh).map_err(|error| refused(&format!("{}: {error}", path.display())))
}

fn refused(problem: &dyn std::fmt::Display) -> CommandError {
    CommandError::input(problem.to_string(), "give a closed solid of tetrahedra that lies within the box")
}

/// A grid of so many cells between two corners \[m].
///
/// # Errors
/// If it has no cells, or the upper corner does not lie above the lower one.
pub fn grid_of(cells: [usize; 3], lower: Vector, upper: Vector) -> Result<Grid, CommandError> {
    let is_box = lower.is_finite() && upper.is_finite() && (upper - lower).min_element() > 0.0;
    if is_box && !cells.contains(&0) { Ok(Grid::new(cells, lower, upper)) } else { Err(no_cells()) }
}

fn no_cells() -> CommandError {
    CommandError::input("the grid has no cells", "give its corners, the upper one above the lower")
}

/// The method of a name: `clip`, `columns` or `columns(4)`.
///
/// # Errors
/// If there is none.
pub fn method_of(name: &str) -> Result<Method, CommandError> {
    let method = match split_call(name) {
        Some(("clip", None)) => Some(Method::Clip),
        Some(("columns", None)) => Some(Method::default()),
        Some(("columns", Some(count))) => {
            u8::try_from(count).ok().filter(|&count| count > 0).map(|per_axis| Method::Columns { per_axis })
        }
        _ => None,
    };
    method.ok_or_else(|| CommandError::unknown("method", name, &["clip", "columns(4)"]))
}

/// Most cells of the box round a body, which are held while it is drawn.
const MOST_OF_A_BODY: Real = 1e8;

/// The part of each cell of `grid` that bodies of one mesh cover, x1 fastest; where bodies overlap their parts add up. What lies
/// outside the grid is left out.
///
/// # Errors
/// If the mesh is not a sound solid, a place is not finite, a body is wider than a hundred million cells, or the grid has no
/// cells or more than the memory holds.
pub fn volume_fractions(
    mesh: TetrahedralMesh,
    placed: &[Placed],
    grid: &Grid,
    method: Method,
) -> Result<Vec<Real>, CommandError> {
    let is_finite = |place: &Placed| {
        let [length, scale] = [place.orientation.length(), place.scale];
        place.position.is_finite() && [length, scale].iter().all(|size| size.is_finite() && *size > 0.0)
    };
    if let Some(number) = placed.iter().position(|place| !is_finite(place)) {
        return Err(CommandError::input(
            format!("body {number} has no finite place, turn and size"),
            "positions are finite, orientations not zero, scales above zero",
        ));
    }
    if grid.cells.contains(&0) || !(grid.spacing.min_element() > 0.0 && grid.spacing.is_finite()) {
        return Err(no_cells());
    }
    mesh.check().map_err(|error| refused(&error))?;
    let mass = MassProperties::of(&mesh);
    // A body has to have a contact sphere, which nothing touches here.
    let inner = ContactSphereRule::Listed(vec![(mass.centroid, 0.1 * mass.volume.cbrt())]);
    let shape = Shape::from_mesh("mesh", mesh, &inner).map_err(|error| refused(&error))?;
    let cells_of = |place: &Placed| {
        let widths = 2.0 * shape.bounding_radius() * place.scale / grid.spacing;
        widths.to_array().iter().map(|cells| cells + 2.0).product::<Real>()
    };
    if let Some(number) = placed.iter().position(|place| cells_of(place) > MOST_OF_A_BODY) {
        return Err(CommandError::input(
            format!("body {number} is {:.1e} cells large", cells_of(&placed[number])),
            "give the mesh its unit (`unit=\"1 mm\"`), or take wider cells",
        ));
    }
    let (origin, _) = shape.source_frame();
    let mut rasteriser = Rasteriser::new(method);
    let (mut covers, mut fractions) = (Vec::new(), Vec::new());
    let [n1, n2, n3] = grid.cells;
    let count = n1.checked_mul(n2).and_then(|layer| layer.checked_mul(n3));
    if count.is_none_or(|count| fractions.try_reserve_exact(count).is_err()) {
        return Err(CommandError::input(
            format!("{n1} x {n2} x {n3} cells are more than the memory holds"),
            "take fewer cells",
        ));
    }
    fractions.resize(grid.len(), 0.0);
    for place in placed {
        let turn = place.orientation.normalize();
        let centre = place.position + turn * (place.scale * origin);
        covers.clear();
        rasteriser.imprint_scaled(&shape, place.scale, centre, turn * shape.drawn(), grid, &mut covers);
        for cover in &covers {
            let cell = cover.cell.map(|index| usize::try_from(index).unwrap_or(usize::MAX));
            if (0..3).all(|d| cell[d] < grid.cells[d]) {
                fractions[cell[0] + n1 * (cell[1] + n2 * cell[2])] += cover.fraction;
            }
        }
    }
    Ok(fractions)
}

#[cfg(test)]
mod tests {
    use sazanami_numerics::geometry::box_mesh;

    use super::*;

    fn grid() -> Grid {
        Grid::new([8, 8, 8], Vector::ZERO, Vector::ONE)
    }

    #[test]
    fn a_box_that_is_moved_covers_its_volume_where_it_lies() {
        // A mesh away from its origin, whose body frame is turned.
        let mesh = box_mesh(Vector::new(0.5, 0.25, 0.125)).mapped(|p| p + Vector::new(0.3, 0.0, 0.0));
        let place = Placed { position: Vector::new(0.2, 0.5, 0.5625), orientation: Quaternion::IDENTITY, scale: 1.0 };
        let found = volume_fractions(mesh.clone(), &[place], &grid(), Method::Clip).unwrap();
        let volume: Real = found.iter().sum::<Real>() * grid().cell_volume();
        assert!((volume - 0.5 * 0.25 * 0.125).abs() < 1e-12, "{volume}");
        // From 0.25 to 0.75, 0.375 to 0.625, 0.5 to 0.625: whole cells.
        for (n, fraction) in found.iter().enumerate() {
            let [i, j, k] = [n % 8, n / 8 % 8, n / 64];
            let within = (2..6).contains(&i) && (3..5).contains(&j) && k == 4;
            assert!((fraction - Real::from(u8::from(within))).abs() < 1e-9, "{i} {j} {k}: {fraction}");
        }
        // Control: elsewhere other cells are covered.
        let aside = Placed { position: place.position + Vector::new(0.1, 0.0, 0.0), ..place };
        let other = volume_fractions(mesh, &[aside], &grid(), Method::Clip).unwrap();
        assert!(found.iter().zip(&other).any(|(a, b)| (a - b).abs() > 0.1));
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let good = Placed { position: Vector::splat(0.5), orientation: Quaternion::IDENTITY, scale: 1.0 };
        let place = |bad: Placed| volume_fractions(box_mesh(Vector::splat(0.1)), &[bad], &grid(), Default::default());
        assert!(place(good).is_ok());
        assert!(place(Placed { position: Vector::NAN, ..good }).is_err());
        assert!(place(Placed { scale: 0.0, ..good }).is_err());
        assert!(place(Placed { orientation: Quaternion::from_xyzw(0.0, 0.0, 0.0, Real::INFINITY), ..good }).is_err());
        let metres = place(Placed { scale: 1000.0, ..good }).unwrap_err().to_string();
        assert!(metres.contains("cells large") && metres.contains("unit"), "{metres}");
        assert!(grid_of([2, 0, 2], Vector::ZERO, Vector::ONE).is_err());
        assert!(grid_of([2, 2, 2], Vector::ONE, Vector::ZERO).is_err());
        let vast = grid_of([1 << 30; 3], Vector::ZERO, Vector::ONE).unwrap();
        assert!(volume_fractions(box_mesh(Vector::splat(0.1)), &[good], &vast, Default::default()).is_err());
        let open = TetrahedralMesh { tetrahedra: Vec::new(), ..box_mesh(Vector::ONE) };
        assert!(volume_fractions(open, &[good], &grid(), Default::default()).is_err());
    }
}
