//! A rigid shape in its body frame: origin at the centre of mass, axes principal.
//!
//! The tetrahedral mesh gives mass, inertia, volume fractions and node heights; the contact spheres give
//! contact. Neither is derived from the other.

use super::contact_spheres::{ContactSphereError, Outline};
use super::surface_mesh::Facet;
use super::{
    ContactSphereRule, ContactSpheres, Cylinder, Exact, MassProperties, MeshError, MeshQuality, Spheroid, SpheroidMesh,
    SurfaceMesh, TetrahedralMesh, VolumeRule, box_mesh, cylinder_mesh, sphere_mesh, spheroid_mesh,
};
use crate::{Matrix, Quaternion, Real, Vector};

/// A rigid body's geometry, per unit density.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    name: String,
    mesh: TetrahedralMesh,
    surface: SurfaceMesh,
    facets: Vec<Facet>,
    volume: Real,
    principal_inertia: Vector,
    bounding_radius: Real,
    /// See [`SurfaceMesh::levers`].
    levers: Vec<Vector>,
    contact_spheres: ContactSpheres,
    exact: Option<Exact>,
    origin: Vector,
    axes: Matrix,
}

/// Why a shape could not be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A length that is not a positive number.
    #[error("{quantity} is {value} m: it must be a positive length")]
    NotPositive {
        /// Name of the length.
        quantity: &'static str,
        /// Its value \[m].
        value: Real,
    },
    /// A ring mesh without a body.
    #[error("{rings} rings of {segments} segments make no mesh: at least one ring and three segments are needed")]
    TooCoarse {
        /// Number of rings.
        rings: usize,
        /// Nodes on each.
        segments: usize,
    },
    /// A subdivision of millions of tetrahedra.
    #[error("a sphere divided {refinement} times has 20 x 4^{refinement} tetrahedra: at most {most} times is allowed")]
    TooFine {
        /// Times asked for.
        refinement: usize,
        /// Times allowed.
        most: usize,
    },
    /// The mesh is not a sound solid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The contact spheres cannot be placed.
    #[error(transparent)]
    ContactSpheres(#[from] ContactSphereError),
}

/// Figures of a shape that `check` reports.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeReport {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of tetrahedra.
    pub tetrahedra: usize,
    /// Volume of the mesh [m^3].
    pub volume: Real,
    /// (Mesh volume)/(volume of the exact shape, see [`Exact`]) - 1, where there is one.
    pub volume_error: Option<Real>,
    /// Largest relative deviation of a principal moment per unit density from the exact one, where there is one.
    pub inertia_error: Option<Real>,
    /// Shape of the tetrahedra.
    pub quality: MeshQuality,
    /// Number of contact spheres.
    pub contact_spheres: usize,
    /// Smallest and largest radius of a contact sphere \[m].
    pub sphere_radii: [Real; 2],
    /// Largest distance from the outline to the union of the contact spheres \[m].
    pub largest_gap: Real,
}

/// Displacements and turns below this share of the size are round-off of a mesh given in its own frame.
const ROUND_OFF: Real = 1e-12;
/// Most times an icosahedron is divided: 327,680 tetrahedra.
const FINEST: usize = 7;

impl Shape {
    /// Sphere of the given `diameter` \[m] as an icosahedron divided `refinement` times.
    ///
    /// # Errors
    /// If the diameter is not positive or the contact spheres cannot be placed.
    pub fn sphere(
        diameter: Real,
        refinement: usize,
        volume: VolumeRule,
        spheres: &ContactSphereRule,
    ) -> Result<Self, ShapeError> {
        let radius = 0.5 * positive("the diameter of a sphere", diameter)?;
        if refinement > FINEST {
            return Err(ShapeError::TooFine { refinement, most: FINEST });
        }
        let exact = Exact::Spheroid(Spheroid { equatorial: radius, axial: radius });
        Self::build("sphere", sphere_mesh(radius, refinement, volume), Some(exact), spheres)
    }

    /// Spheroid with two semi-axes `a` and a single one `c` along body axis x1 \[m], as a ring mesh.
    ///
    /// # Errors
    /// If a length is not positive, the mesh has no body, or the contact spheres cannot be placed.
    pub fn spheroid(
        a: Real,
        c: Real,
        resolution: SpheroidMesh,
        volume: VolumeRule,
        spheres: &ContactSphereRule,
    ) -> Result<Self, ShapeError> {
        let exact = Exact::Spheroid(Spheroid {
            equatorial: positive("the equatorial semi-axis of a spheroid", a)?,
            axial: positive("the axial semi-axis of a spheroid", c)?,
        });
        let SpheroidMesh { rings, segments } = resolution;
        if rings < 1 || segments < 3 {
            return Err(ShapeError::TooCoarse { rings, segments });
        }
        Self::build("spheroid", spheroid_mesh(a, c, resolution, volume), Some(exact), spheres)
    }

    /// Box with the given `edges` along the body axes \[m].
    ///
    /// # Errors
    /// If an edge is not positive or the contact spheres cannot be placed.
    pub fn cuboid(edges: Vector, spheres: &ContactSphereRule) -> Result<Self, ShapeError> {
        for edge in edges.to_array() {
            positive("an edge of a box", edge)?;
        }
        Self::build("box", box_mesh(edges), None, spheres)
    }

    /// Circular cylinder along body axis x1 as a prism on a polygon of `segments` corners. `axis(n)` puts contact spheres
    /// of its radius on its axis.
    ///
    /// # Errors
    /// If a length is not positive, there are fewer than three segments, or the contact spheres cannot be placed.
    pub fn cylinder(
        cylinder: Cylinder,
        segments: usize,
        volume: VolumeRule,
        spheres: &ContactSphereRule,
    ) -> Result<Self, ShapeError> {
        positive("the radius of a cylinder", cylinder.radius)?;
        positive("the length of a cylinder", cylinder.length)?;
        if segments < 3 {
            return Err(ShapeError::TooCoarse { rings: 2, segments });
        }
        let mesh = cylinder_mesh(cylinder, segments, volume);
        let exact = Some(Exact::Cylinder(cylinder));
        match spheres {
            &ContactSphereRule::Axis { count } => {
                let spheres = ContactSphereRule::Listed(cylinder.spheres_on_axis(count)?);
                Self::build("cylinder", mesh, exact, &spheres)
            }
            spheres => Self::build("cylinder", mesh, exact, spheres),
        }
    }

    /// Any solid. Listed contact spheres are in the frame of the mesh.
    ///
    /// # Errors
    /// If the mesh is not a sound solid or the contact spheres cannot be placed.
    pub fn from_mesh(name: &str, mesh: TetrahedralMesh, spheres: &ContactSphereRule) -> Result<Self, ShapeError> {
        mesh.check()?;
        Self::build(name, mesh, None, spheres)
    }

    fn build(
        name: &str,
        mesh: TetrahedralMesh,
        exact: Option<Exact>,
        rule: &ContactSphereRule,
    ) -> Result<Self, ShapeError> {
        let mass = MassProperties::of(&mesh);
        let size = mass.volume.cbrt();
        let origin = if mass.centroid.length() < ROUND_OFF * size { Vector::ZERO } else { mass.centroid };
        let turned = (mass.axes - Matrix::IDENTITY).to_cols_array().iter().any(|e| e.abs() > ROUND_OFF);
        let axes = if turned { mass.axes } else { Matrix::IDENTITY };
        let to_body = axes.transpose();
        let mesh = mesh.mapped(|p| to_body * (p - origin));
        let surface = mesh.boundary();
        let rule = match rule {
            ContactSphereRule::Listed(list) => {
                ContactSphereRule::Listed(list.iter().map(|&(c, r)| (to_body * (c - origin), r)).collect())
            }
            other => other.clone(),
        };
        let outline = match exact {
            Some(Exact::Spheroid(spheroid)) => Outline::Spheroid(spheroid),
            Some(Exact::Cylinder(_)) | None => Outline::Mesh { surface: &surface, tree: surface.tree() },
        };
        let contact_spheres = ContactSpheres::place(&rule, &outline)?;
        let nodes_within = mesh.nodes.iter().map(|p| p.length()).fold(0.0, Real::max);
        Ok(Self {
            name: name.to_owned(),
            bounding_radius: nodes_within.max(contact_spheres.bounding_radius()),
            volume: mass.volume,
            principal_inertia: mass.principal_inertia,
            levers: surface.levers(),
            facets: surface.facets(),
            mesh,
            surface,
            contact_spheres,
            exact,
            origin,
            axes,
        })
    }

    /// The same shape under another name.
    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        name.clone_into(&mut self.name);
        self
    }

    /// The solid mesh, in the body frame.
    #[must_use]
    pub fn mesh(&self) -> &TetrahedralMesh {
        &self.mesh
    }

    /// The closed surface of the mesh, in the body frame.
    #[must_use]
    pub fn surface(&self) -> &SurfaceMesh {
        &self.surface
    }

    /// The same as plane facets of three or four corners.
    pub(super) fn facets(&self) -> &[Facet] {
        &self.facets
    }

    /// Volume of the mesh [m^3]; times the density, the mass.
    #[must_use]
    pub fn volume(&self) -> Real {
        self.volume
    }

    /// Principal moments of inertia per unit density [m^5]; times the density, the inertia about the body axes.
    #[must_use]
    pub fn principal_inertia(&self) -> Vector {
        self.principal_inertia
    }

    /// Lowest and highest coordinates of the mesh in the body frame \[m].
    #[must_use]
    pub fn extent(&self) -> (Vector, Vector) {
        let nodes = &self.mesh.nodes;
        nodes
            .iter()
            .fold((Vector::INFINITY, Vector::NEG_INFINITY), |(low, high), &node| (low.min(node), high.max(node)))
    }

    /// Radius of the sphere about the centre of mass that holds mesh and contact spheres \[m].
    #[must_use]
    pub fn bounding_radius(&self) -> Real {
        self.bounding_radius
    }

    /// Largest speed of a point of the surface along its normal [m/s] when the body turns about its centre of mass with
    /// `angular_velocity`, in the body frame [rad/s]: how fast it covers and uncovers space. A turn about an axis of
    /// revolution does neither, but for the edges of the mesh.
    #[must_use]
    pub fn turning_speed(&self, angular_velocity: Vector) -> Real {
        self.levers.iter().map(|lever| lever.dot(angular_velocity).abs()).fold(0.0, Real::max)
    }

    /// The contact spheres, in the body frame.
    #[must_use]
    pub fn contact_spheres(&self) -> &ContactSpheres {
        &self.contact_spheres
    }

    /// The smooth solid that the mesh approximates, where there is one.
    #[must_use]
    pub fn exact(&self) -> Option<Exact> {
        self.exact
    }

    /// Frame of the mesh as given in the body frame: its coordinates are `origin + axes * (body coordinates)`.
    #[must_use]
    pub fn source_frame(&self) -> (Vector, Matrix) {
        (self.origin, self.axes)
    }

    /// Rotation of the body frame with which the shape lies as its mesh was given.
    #[must_use]
    pub fn drawn(&self) -> Quaternion {
        if self.axes == Matrix::IDENTITY { Quaternion::IDENTITY } else { Quaternion::from_mat3(&self.axes) }
    }

    /// Quality of the mesh and its distance from the exact shape.
    #[must_use]
    pub fn report(&self) -> ShapeReport {
        let relative = |found: Vector, exact: Vector| (found / exact - 1.0).abs().max_element();
        let radii = &self.contact_spheres.radii;
        ShapeReport {
            nodes: self.mesh.nodes.len(),
            tetrahedra: self.mesh.tetrahedra.len(),
            volume: self.volume,
            volume_error: self.exact.map(|s| self.volume / s.volume() - 1.0),
            inertia_error: self.exact.map(|s| relative(self.principal_inertia, s.principal_inertia())),
            quality: self.mesh.quality(),
            contact_spheres: self.contact_spheres.len(),
            sphere_radii: [
                radii.iter().copied().fold(Real::INFINITY, Real::min),
                radii.iter().copied().fold(0.0, Real::max),
            ],
            largest_gap: self.contact_spheres.largest_gap,
        }
    }
}

fn positive(quantity: &'static str, value: Real) -> Result<Real, ShapeError> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(ShapeError::NotPositive { quantity, value }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Quaternion;

    const AXIS: ContactSphereRule = ContactSphereRule::Axis { count: 9 };

    fn grain(resolution: SpheroidMesh, rule: VolumeRule) -> Shape {
        Shape::spheroid(0.26e-3, 0.635e-3, resolution, rule, &AXIS).unwrap()
    }

    #[test]
    fn a_spheroid_keeps_the_frame_it_is_built_in() {
        let shape = grain(SpheroidMesh::PAPER, VolumeRule::Inscribed);
        assert_eq!(shape.source_frame(), (Vector::ZERO, Matrix::IDENTITY));
        let inertia = shape.principal_inertia();
        assert!(inertia.x < inertia.y && inertia.y == inertia.z);
        assert!((shape.bounding_radius() - 0.635e-3).abs() < 1e-15);
        assert!((shape.surface().volume() / shape.volume() - 1.0).abs() < 1e-13);
        assert!((shape.report().volume_error.unwrap() + 0.202).abs() < 1e-3);
        assert_eq!(shape.surface().triangles.len(), 84);
    }

    #[test]
    fn a_turn_about_an_axis_of_revolution_moves_no_surface() {
        let fine = SpheroidMesh { rings: 63, segments: 64 };
        let [about, across] = [Vector::X, Vector::Y].map(|axis| grain(fine, VolumeRule::Preserve).turning_speed(axis));
        // Half the chord of a segment; of an ellipse the largest moment of the unit normal is c - a.
        assert!(about < 0.26e-3 * (std::f64::consts::PI / 64.0).sin() * 1.01, "{about}");
        assert!((across / (0.635e-3 - 0.26e-3) - 1.0).abs() < 0.05, "{across}");
        // The paper's mesh has six segments, whose edges stand out.
        let paper = grain(SpheroidMesh::PAPER, VolumeRule::Inscribed);
        let edges = paper.turning_speed(Vector::X);
        assert!((edges / (0.26e-3 * 0.5) - 1.0).abs() < 0.1, "{edges}");
        assert!(paper.turning_speed(Vector::Y) < 0.75 * paper.bounding_radius());
        // A cube moves its edges whichever way it turns.
        let cube = Shape::cuboid(Vector::ONE, &ContactSphereRule::Listed(vec![(Vector::ZERO, 0.1)])).unwrap();
        assert!((cube.turning_speed(Vector::Z) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn inertia_converges_to_the_exact_spheroid() {
        let exact = 2.0 * 0.26_f64.powi(2) / (0.26_f64.powi(2) + 0.635_f64.powi(2));
        assert!((exact - 0.287_16).abs() < 5e-6);
        let ratio = |n: usize| {
            let inertia =
                grain(SpheroidMesh { rings: n - 1, segments: 2 * n }, VolumeRule::Preserve).principal_inertia();
            inertia.x / inertia.y
        };
        let errors: Vec<Real> = [6, 12, 24].iter().map(|&n| (ratio(n) - exact).abs()).collect();
        println!("I_axial/I_trans - 0.28716: {errors:?}");
        assert!(errors[1] < errors[0] && errors[2] < 0.5 * errors[1] && errors[2] < 5e-5);
        let moments = |n: usize| {
            let shape = grain(SpheroidMesh { rings: n - 1, segments: 2 * n }, VolumeRule::Inscribed);
            shape.report().inertia_error.unwrap()
        };
        assert!((moments(8) / moments(16)).log2() > 1.85);
    }

    #[test]
    fn mass_properties_of_a_cylinder_are_those_of_its_formulas() {
        let cylinder = Cylinder { radius: 0.26e-3, length: 1.27e-3 };
        let rule = ContactSphereRule::Axis { count: 9 };
        let shape = |segments: usize| Shape::cylinder(cylinder, segments, VolumeRule::Preserve, &rule).unwrap();
        let found = shape(96);
        let mass = std::f64::consts::PI * 0.26e-3_f64.powi(2) * 1.27e-3;
        assert!((found.volume() / mass - 1.0).abs() < 1e-12);
        assert!((found.surface().volume() / mass - 1.0).abs() < 1e-12);
        let moments = Vector::new(0.5 * 0.26e-3_f64.powi(2), 0.0, 0.0)
            + Vector::new(0.0, 1.0, 1.0) * (3.0 * 0.26e-3_f64.powi(2) + 1.27e-3_f64.powi(2)) / 12.0;
        assert!((found.principal_inertia() / (mass * moments) - 1.0).abs().max_element() < 2e-6);
        let error = |segments: usize| shape(segments).report().inertia_error.unwrap();
        // The polygon of equal area has the moments of the circle to fourth order.
        assert!((error(12) / error(24)).log2() > 3.9, "{} {}", error(12), error(24));
        assert_eq!(found.source_frame(), (Vector::ZERO, Matrix::IDENTITY));
    }

    #[test]
    fn contact_spheres_of_a_cylinder_lie_within_it() {
        let cylinder = Cylinder { radius: 0.26, length: 1.27 };
        let shape = |rule| Shape::cylinder(cylinder, 24, VolumeRule::Preserve, &rule);
        let axis = shape(ContactSphereRule::Axis { count: 9 }).unwrap();
        let gap = axis.contact_spheres().largest_gap;
        // At the edges of the mesh, whose radius is larger by 0.6 %.
        assert!((gap / (0.26 * (2.0_f64.sqrt() - 1.0)) - 1.0).abs() < 0.02, "{gap}");
        assert!(axis.contact_spheres().largest_protrusion < 0.01 * 0.26);
        assert!((axis.contact_spheres().bounding_radius() - 0.635).abs() < 1e-12);
        let shell = shape(ContactSphereRule::Shell { count: 75, radius: None }).unwrap();
        assert_eq!(shell.contact_spheres().len(), 75);
        assert!(shell.contact_spheres().largest_gap < 0.8 * gap, "{}", shell.contact_spheres().largest_gap);
        let disc = Cylinder { radius: 0.5, length: 0.3 };
        let refused = Shape::cylinder(disc, 24, VolumeRule::Preserve, &ContactSphereRule::Axis { count: 9 });
        assert!(refused.unwrap_err().to_string().contains("shorter than its diameter"));
        assert!(shape(ContactSphereRule::Single).is_err());
    }

    #[test]
    fn a_mesh_given_anywhere_comes_to_its_body_frame_with_its_spheres() {
        let turn = Quaternion::from_axis_angle(Vector::new(0.3, 1.0, -0.2).normalize(), 0.4);
        let shift = Vector::new(3.0, -1.0, 2.0);
        let given = box_mesh(Vector::new(1.0, 2.0, 3.0)).mapped(|p| turn * p + shift);
        let tip = turn * Vector::new(0.0, 0.0, 1.2) + shift;
        let rule = ContactSphereRule::Listed(vec![(tip, 0.3)]);
        let shape = Shape::from_mesh("block", given.clone(), &rule).unwrap();
        let again = MassProperties::of(shape.mesh());
        assert!(again.centroid.length() < 1e-13);
        assert!((again.axes - Matrix::IDENTITY).to_cols_array().iter().all(|e| e.abs() < 1e-8));
        let (origin, axes) = shape.source_frame();
        for (body, source) in shape.mesh().nodes.iter().zip(&given.nodes) {
            assert!((origin + axes * *body - *source).length() < 1e-12);
        }
        let centre = shape.contact_spheres().centres[0];
        assert!((origin + axes * centre - tip).length() < 1e-12);
        assert!((shape.contact_spheres().largest_protrusion).abs() < 1e-2);
    }

    #[test]
    fn bad_input_is_refused() {
        let refused = Shape::sphere(-1.0, 1, VolumeRule::Preserve, &ContactSphereRule::Single);
        assert!(matches!(refused, Err(ShapeError::NotPositive { value, .. }) if value == -1.0));
        let resolution = SpheroidMesh { rings: 0, segments: 6 };
        let refused = Shape::spheroid(1.0, 2.0, resolution, VolumeRule::Preserve, &AXIS);
        assert!(matches!(refused, Err(ShapeError::TooCoarse { .. })));
        let mut inverted = box_mesh(Vector::ONE);
        inverted.tetrahedra[2].swap(0, 1);
        let refused = Shape::from_mesh("block", inverted, &ContactSphereRule::Shell { count: 9, radius: None });
        assert!(matches!(refused, Err(ShapeError::Mesh(MeshError::Inverted { tetrahedron: 2, .. }))));
    }

    #[test]
    fn a_sphere_turns_alike_about_every_axis() {
        let shape = Shape::sphere(1e-3, 2, VolumeRule::Preserve, &ContactSphereRule::Single).unwrap();
        let report = shape.report();
        assert!(report.volume_error.unwrap().abs() < 1e-13);
        assert_eq!(shape.principal_inertia().x, shape.principal_inertia().z);
        assert_eq!((report.contact_spheres, report.sphere_radii), (1, [0.5e-3; 2]));
        assert!(report.inertia_error.unwrap() < 0.03, "{:?}", report.inertia_error);
        assert!(report.largest_gap < 1e-12);
    }
}
