//! Shapes of the grains of a case, with their contact spheres.

use std::path::{Path, PathBuf};

use sazanami_io::input;
use sazanami_io::mesh::MeshFileError;
use sazanami_numerics::geometry::{
    ContactSphereRule, Cylinder, Shape, ShapeError, SphereListError, SpheroidMesh, parse_sphere_list,
};

use crate::case::meaning::{ContactSphereChoice, GrainShape, Population};

/// Most contact spheres that a file may list: their numbers are kept in 16 bits.
const MOST_LISTED: usize = 20_000;

/// A population has no usable shape.
#[derive(Debug, thiserror::Error)]
pub enum ShapeProblem {
    /// The mesh or its contact spheres make no sense.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The mesh file cannot be used.
    #[error(transparent)]
    MeshFile(#[from] MeshFileError),
    /// The list of contact spheres cannot be used.
    #[error("{}: line {}: {}", path.display(), error.line, error.problem)]
    SphereList {
        /// File that the case names.
        path: PathBuf,
        /// Line and problem.
        error: SphereListError,
    },
    /// The list of contact spheres is longer than a grain's may be.
    #[error("{}: {count} contact spheres: at most {MOST_LISTED} are possible", path.display())]
    TooManySpheres {
        /// File that the case names.
        path: PathBuf,
        /// Number of spheres in it.
        count: usize,
    },
    /// A file cannot be read.
    #[error("{}: {error}", path.display())]
    Unreadable {
        /// File that the case names.
        path: PathBuf,
        /// Error of the operating system.
        error: std::io::Error,
    },
}

/// Builds the shape of a population at size factor 1.
///
/// # Errors
/// [`ShapeProblem`] names the file or the element.
pub fn shape_of(population: &Population) -> Result<Shape, ShapeProblem> {
    let rule = contact_spheres(&population.contact_spheres)?;
    let shape = match &population.shape {
        GrainShape::Sphere { diameter, refinement, volume } => Shape::sphere(*diameter, *refinement, *volume, &rule)?,
        GrainShape::Spheroid { diameter, length, rings, segments, volume } => {
            let resolution = SpheroidMesh { rings: *rings, segments: *segments };
            Shape::spheroid(0.5 * diameter, 0.5 * length, resolution, *volume, &rule)?
        }
        GrainShape::Cylinder { diameter, length, segments, volume } => {
            let cylinder = Cylinder { radius: 0.5 * diameter, length: *length };
            Shape::cylinder(cylinder, *segments, *volume, &rule)?
        }
        GrainShape::Box { size } => Shape::cuboid(*size, &rule)?,
        GrainShape::Mesh { file, unit } => {
            Shape::from_mesh(&population.name, sazanami_io::mesh::read(file, *unit)?.mesh, &rule)?
        }
    };
    Ok(shape.named(&population.name))
}

fn contact_spheres(choice: &ContactSphereChoice) -> Result<ContactSphereRule, ShapeProblem> {
    Ok(match choice {
        ContactSphereChoice::Shell { count, radius } => ContactSphereRule::Shell { count: *count, radius: *radius },
        ContactSphereChoice::Axis(count) => ContactSphereRule::Axis { count: *count },
        ContactSphereChoice::Single => ContactSphereRule::Single,
        ContactSphereChoice::File { file, unit } => {
            let text = read(file)?;
            let list = parse_sphere_list(&text, *unit)
                .map_err(|error| ShapeProblem::SphereList { path: file.clone(), error })?;
            if list.len() > MOST_LISTED {
                return Err(ShapeProblem::TooManySpheres { path: file.clone(), count: list.len() });
            }
            ContactSphereRule::Listed(list)
        }
    })
}

fn read(path: &Path) -> Result<String, ShapeProblem> {
    input::read_text(path).map_err(|error| ShapeProblem::Unreadable { path: path.to_owned(), error })
}
