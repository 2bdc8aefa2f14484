//! Geometry of rigid shapes: tetrahedral meshes and their mass properties, contact spheres, and the
//! share of each grid cell that a shape or a liquid region fills.

mod bounding_tree;
mod contact_spheres;
mod cylinder;
mod exact;
mod mass_properties;
mod primitives;
mod region;
mod shape;
mod spheroid;
mod surface_mesh;
mod tetrahedra;
mod tetrahedron;
mod volume_fraction;

pub use contact_spheres::{ContactSphereError, ContactSphereRule, ContactSpheres, SphereListError, parse_sphere_list};
pub use cylinder::Cylinder;
pub use exact::Exact;
pub use mass_properties::MassProperties;
pub use primitives::{SpheroidMesh, VolumeRule, box_mesh, cylinder_mesh, sphere_mesh, spheroid_mesh};
pub use region::{PlacedLiquid, Region, RegionFractions, SampledCells, SampledLiquid, Wave};
pub use shape::{Shape, ShapeError, ShapeReport};
pub use spheroid::Spheroid;
pub use surface_mesh::SurfaceMesh;
pub use tetrahedra::{MeshError, MeshQuality, TetrahedralMesh};
pub use volume_fraction::{CellCover, FLUSH_FRACTION, Imprint, Rasteriser, Section, VolumeFractionMethod};
