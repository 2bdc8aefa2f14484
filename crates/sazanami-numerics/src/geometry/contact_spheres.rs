//! Spheres that stand for a shape in contact: where they go, and how far they miss its surface.
//!
//! Mass and volume fractions never come from them; they only touch. A rule places them inside the outline (the
//! exact spheroid where the shape is one, otherwise the surface of its mesh) and the result says how far the
//! outline is from their union.

use super::bounding_tree::BoundingTree;
use super::{Spheroid, SurfaceMesh};
use crate::{Real, Vector};

mod mesh_shell;
mod spheroid_shell;

/// Rule for the contact spheres of a shape.
#[derive(Clone, Debug, PartialEq)]
pub enum ContactSphereRule {
    /// `count` equal spheres touching the outline from inside, spread evenly.
    Shell {
        /// Number of spheres.
        count: usize,
        /// Radius \[m]; without one, 0.288 of the smallest semi-axis of a spheroid (0.075 mm for the sand of Yagyu et
        /// al. 2015), larger if that leaves holes; on other shapes the radius with the smallest gap.
        radius: Option<Real>,
    },
    /// `count` largest inscribed spheres with evenly spaced centres on the long axis of a prolate spheroid or a cylinder.
    Axis {
        /// Number of spheres.
        count: usize,
    },
    /// The sphere itself.
    Single,
    /// Given centres and radii \[m], in the frame of the shape's mesh.
    Listed(Vec<(Vector, Real)>),
}

/// Contact spheres in the body frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactSpheres {
    /// Centres \[m].
    pub centres: Vec<Vector>,
    /// Radii \[m].
    pub radii: Vec<Real>,
    /// Largest distance from a point of the outline to the union of the spheres \[m].
    pub largest_gap: Real,
    /// Largest distance by which a sphere stands out of the outline \[m].
    pub largest_protrusion: Real,
}

/// Why contact spheres could not be placed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ContactSphereError {
    /// No spheres were asked for or listed.
    #[error("a shape needs at least one contact sphere")]
    None,
    /// A radius that no sphere can have.
    #[error("contact sphere {} has a radius of {radius} m or a centre that is not finite", index + 1)]
    BadSphere {
        /// Index of the sphere.
        index: usize,
        /// Its radius \[m].
        radius: Real,
    },
    /// The axis rule needs a prolate spheroid or a cylinder.
    #[error("axis({count}) puts spheres on the long axis of a prolate spheroid or a cylinder; {found}: use shell(n)")]
    NotProlate {
        /// Number of spheres asked for.
        count: usize,
        /// Kind of the shape.
        found: &'static str,
    },
    /// The single rule needs a sphere.
    #[error("a single contact sphere is for spheres; use axis(n) or shell(n) for other shapes")]
    NotSphere,
    /// A sphere of this radius touches the outline nowhere from inside.
    #[error("contact spheres of radius {radius:.4e} m do not fit inside the shape: at most {limit:.4e} m do")]
    RadiusTooLarge {
        /// Radius asked for \[m].
        radius: Real,
        /// Largest radius possible \[m].
        limit: Real,
    },
    /// There are fewer different places for the spheres than spheres.
    #[error(
        "there is room for {places} different contact spheres of radius {radius:.4e} m, not for {count}: use \
             fewer or smaller ones"
    )]
    TooMany {
        /// Number asked for.
        count: usize,
        /// Number of different places found.
        places: usize,
        /// Their radius \[m].
        radius: Real,
    },
}

/// Outline that spheres are measured against.
pub(super) enum Outline<'a> {
    Spheroid(Spheroid),
    Mesh { surface: &'a SurfaceMesh, tree: BoundingTree },
}

/// Number of points of the outline at which gaps are measured.
const GAP_SAMPLES: usize = 30_000;

impl Outline<'_> {
    fn points(&self) -> Vec<Vector> {
        match self {
            Self::Spheroid(spheroid) => spheroid_shell::spread(spheroid, 0.0, GAP_SAMPLES),
            Self::Mesh { surface, .. } => {
                let mut points: Vec<Vector> = surface.samples(GAP_SAMPLES).iter().map(|s| s.0).collect();
                points.extend(&surface.nodes);
                points
            }
        }
    }

    fn contains(&self, point: Vector) -> bool {
        match self {
            Self::Spheroid(spheroid) => spheroid.contains(point),
            Self::Mesh { surface, .. } => surface.contains(point),
        }
    }
}

impl ContactSpheres {
    /// Places spheres by `rule` (listed ones already in the body frame) and measures them against `outline`.
    pub(super) fn place(rule: &ContactSphereRule, outline: &Outline) -> Result<Self, ContactSphereError> {
        let spheres = match (rule, outline) {
            (ContactSphereRule::Listed(list), _) => listed(list)?,
            (ContactSphereRule::Shell { count: 0, .. } | ContactSphereRule::Axis { count: 0 }, _) => {
                return Err(ContactSphereError::None);
            }
            (ContactSphereRule::Single, Outline::Spheroid(s)) if s.equatorial == s.axial => {
                vec![(Vector::ZERO, s.axial)]
            }
            (ContactSphereRule::Single, _) => return Err(ContactSphereError::NotSphere),
            (&ContactSphereRule::Axis { count }, Outline::Spheroid(s)) if s.axial >= s.equatorial => axis(s, count),
            (&ContactSphereRule::Axis { count }, outline) => {
                let found = match outline {
                    Outline::Spheroid(_) => "this one is oblate",
                    Outline::Mesh { .. } => "this shape is a mesh",
                };
                return Err(ContactSphereError::NotProlate { count, found });
            }
            (&ContactSphereRule::Shell { count, radius }, Outline::Spheroid(s)) => {
                spheroid_shell::place(s, count, radius)?
            }
            (&ContactSphereRule::Shell { count, radius }, Outline::Mesh { surface, tree }) => {
                mesh_shell::place(surface, tree, count, radius)?
            }
        };
        Ok(Self::measured(&spheres, outline))
    }

    fn measured(spheres: &[(Vector, Real)], outline: &Outline) -> Self {
        let points = outline.points();
        let protrusion = |&(centre, radius): &(Vector, Real)| {
            let distance = points.iter().map(|p| p.distance_squared(centre)).fold(Real::INFINITY, Real::min).sqrt();
            if outline.contains(centre) { radius - distance } else { radius + distance }
        };
        Self {
            centres: spheres.iter().map(|s| s.0).collect(),
            radii: spheres.iter().map(|s| s.1).collect(),
            largest_gap: largest_gap(&points, spheres),
            largest_protrusion: spheres.iter().map(protrusion).fold(0.0, Real::max),
        }
    }

    /// Number of spheres.
    #[must_use]
    pub fn len(&self) -> usize {
        self.radii.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.radii.is_empty()
    }

    /// Largest distance from the origin to a point of a sphere \[m].
    #[must_use]
    pub fn bounding_radius(&self) -> Real {
        self.centres.iter().zip(&self.radii).map(|(c, r)| c.length() + r).fold(0.0, Real::max)
    }
}

/// Largest distance from one of `points` to the union of `spheres` \[m].
fn largest_gap(points: &[Vector], spheres: &[(Vector, Real)]) -> Real {
    let equal = spheres.first().map(|first| first.1).filter(|&radius| spheres.iter().all(|sphere| sphere.1 == radius));
    let of_all = |p: Vector| spheres.iter().map(|&(c, r)| p.distance(c) - r).fold(Real::INFINITY, Real::min);
    let Some(radius) = equal else { return points.iter().map(|&p| of_all(p)).fold(0.0, Real::max) };
    // Of equal spheres the one with the nearest centre is nearest.
    let tree = BoundingTree::of_points(&spheres.iter().map(|sphere| sphere.0).collect::<Vec<_>>());
    let farthest = points.iter().filter_map(|&p| tree.nearest_point(p)).map(|found| found.1).fold(0.0, Real::max);
    (farthest.sqrt() - radius).max(0.0)
}

fn listed(list: &[(Vector, Real)]) -> Result<Vec<(Vector, Real)>, ContactSphereError> {
    if list.is_empty() {
        return Err(ContactSphereError::None);
    }
    let bad = |&(centre, radius): &(Vector, Real)| !(radius > 0.0 && radius.is_finite() && centre.is_finite());
    match list.iter().position(bad) {
        Some(index) => Err(ContactSphereError::BadSphere { index, radius: list[index].1 }),
        None => Ok(list.to_vec()),
    }
}

/// Largest inscribed spheres centred at x in [-x_m, x_m], x_m = (c^2 - a^2)/c, with r = a sqrt(1 - x^2/(c^2 - a^2)).
fn axis(spheroid: &Spheroid, count: usize) -> Vec<(Vector, Real)> {
    let (a, c) = (spheroid.equatorial, spheroid.axial);
    let focal = c * c - a * a;
    if focal <= 0.0 {
        return vec![(Vector::ZERO, a)];
    }
    let end = focal / c;
    (0..count)
        .map(|i| {
            let x = if count == 1 { 0.0 } else { end * (2.0 * i as Real / (count - 1) as Real - 1.0) };
            (Vector::new(x, 0.0, 0.0), a * (1.0 - x * x / focal).sqrt())
        })
        .collect()
}

/// A line of a sphere list that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}; a line holds x y z r, four numbers, r positive")]
pub struct SphereListError {
    /// Number of the line, from one.
    pub line: usize,
    /// Error of the line, for people.
    pub problem: String,
}

/// Reads lines of `x y z r`, blank- or comma-separated, `#` starting a comment; lengths are multiplied by
/// `unit` \[m].
///
/// # Errors
/// The first line that is not four numbers with a positive radius.
pub fn parse_sphere_list(text: &str, unit: Real) -> Result<Vec<(Vector, Real)>, SphereListError> {
    let mut spheres = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let error = |problem: String| SphereListError { line: index + 1, problem };
        let content = line.split('#').next().unwrap_or_default();
        let mut values = Vec::with_capacity(4);
        for word in content.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()) {
            match word.parse::<Real>() {
                Ok(value) if value.is_finite() => values.push(unit * value),
                _ => return Err(error(format!("'{word}' is not a finite number"))),
            }
        }
        match values[..] {
            [] => {}
            [x, y, z, r] if r > 0.0 => spheres.push((Vector::new(x, y, z), r)),
            [_, _, _, r] => return Err(error(format!("the radius is {r}"))),
            _ => return Err(error(format!("there are {} numbers", values.len()))),
        }
    }
    Ok(spheres)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{box_mesh, sphere_mesh};

    const GRAIN: Spheroid = Spheroid { equatorial: 0.26e-3, axial: 0.635e-3 };

    fn mesh_outline(surface: &SurfaceMesh) -> Outline<'_> {
        Outline::Mesh { surface, tree: surface.tree() }
    }

    #[test]
    fn axis_spheres_leave_the_gaps_known_for_the_paper_grain() {
        // Largest gap measured square to the axis, union of the spheres over the spheroid's volume, and nearest distance.
        for (count, radial, distance) in
            [(5, 79.2, 54.8), (7, 37.2, 28.0), (9, 22.9, 17.0), (11, 15.9, 11.5), (15, 9.3, 6.3)]
        {
            let rule = ContactSphereRule::Axis { count };
            let spheres = ContactSpheres::place(&rule, &Outline::Spheroid(GRAIN)).unwrap();
            assert_eq!(spheres.len(), count);
            assert!((radial_gap(&spheres) * 1e6 - radial).abs() < 0.1, "{}", radial_gap(&spheres) * 1e6);
            assert!((spheres.largest_gap * 1e6 - distance).abs() < 0.1, "{}", spheres.largest_gap * 1e6);
            assert!(spheres.largest_protrusion < 1e-3 * GRAIN.equatorial);
            assert!((spheres.bounding_radius() - GRAIN.axial).abs() < 1e-12);
        }
    }

    fn radial_gap(spheres: &ContactSpheres) -> Real {
        (0..4000)
            .map(|i| {
                let [x, r] = GRAIN.meridian(std::f64::consts::PI * Real::from(i) / 4000.0, 0.0);
                let reach = spheres.centres.iter().zip(&spheres.radii).map(|(c, s)| s * s - (x - c.x).powi(2));
                r - reach.fold(0.0, Real::max).sqrt()
            })
            .fold(0.0, Real::max)
    }

    #[test]
    fn the_shell_of_75_has_the_paper_radius_and_lies_inside() {
        let rule = ContactSphereRule::Shell { count: 75, radius: None };
        let spheres = ContactSpheres::place(&rule, &Outline::Spheroid(GRAIN)).unwrap();
        println!("shell(75): gap {:.2} um", spheres.largest_gap * 1e6);
        assert_eq!(spheres.len(), 75);
        assert!(spheres.radii.iter().all(|r| (r - 0.075e-3).abs() < 1e-12));
        assert!(spheres.largest_protrusion < 2e-3 * GRAIN.equatorial, "{}", spheres.largest_protrusion);
        assert!(spheres.largest_gap < 0.07e-3, "{}", spheres.largest_gap);
        // Spread: nearest neighbours about the hexagonal spacing of 0.128 mm on the offset surface apart.
        for (i, a) in spheres.centres.iter().enumerate() {
            let nearest = spheres.centres.iter().enumerate().filter(|(j, _)| *j != i);
            let distance = nearest.map(|(_, b)| a.distance(*b)).fold(Real::INFINITY, Real::min);
            assert!((0.09e-3..0.15e-3).contains(&distance), "{distance}");
        }
        // Negative control: fewer spheres leave larger gaps.
        let fewer = ContactSphereRule::Shell { count: 40, radius: Some(0.075e-3) };
        let fewer = ContactSpheres::place(&fewer, &Outline::Spheroid(GRAIN)).unwrap();
        assert!(fewer.largest_gap > 1.2 * spheres.largest_gap);
    }

    #[test]
    fn shells_go_on_oblate_spheroids_and_spheres_and_axis_does_not() {
        let oblate = Spheroid { equatorial: 0.6, axial: 0.3 };
        for outline in [oblate, Spheroid { equatorial: 1.0, axial: 1.0 }] {
            let rule = ContactSphereRule::Shell { count: 60, radius: None };
            let spheres = ContactSpheres::place(&rule, &Outline::Spheroid(outline)).unwrap();
            assert!(spheres.largest_protrusion < 2e-3 * outline.equatorial);
            assert!(spheres.largest_gap < 0.3 * outline.axial);
        }
        let refused = ContactSpheres::place(&ContactSphereRule::Axis { count: 9 }, &Outline::Spheroid(oblate));
        assert!(matches!(refused, Err(ContactSphereError::NotProlate { count: 9, .. })));
        let refused = ContactSpheres::place(&ContactSphereRule::Single, &Outline::Spheroid(oblate));
        assert_eq!(refused, Err(ContactSphereError::NotSphere));
        let large = ContactSphereRule::Shell { count: 9, radius: Some(0.2) };
        assert!(matches!(
            ContactSpheres::place(&large, &Outline::Spheroid(oblate)),
            Err(ContactSphereError::RadiusTooLarge { limit, .. }) if (limit - 0.15).abs() < 1e-12
        ));
    }

    #[test]
    fn a_shell_on_a_box_touches_faces_and_reaches_into_corners() {
        let edges = Vector::new(1.0, 0.6, 0.8);
        let surface = box_mesh(edges).boundary();
        let rule = ContactSphereRule::Shell { count: 60, radius: Some(0.1) };
        let spheres = ContactSpheres::place(&rule, &mesh_outline(&surface)).unwrap();
        assert_eq!(spheres.len(), 60);
        assert!(spheres.largest_protrusion < 1e-3);
        for centre in &spheres.centres {
            let depth = (0.5 * edges - centre.abs()).min_element();
            assert!((depth - 0.1).abs() < 1e-6, "{depth}");
        }
        // At best a corner keeps the gap (sqrt(3) - 1) r; spheres must come close to that.
        let corner = (3.0_f64.sqrt() - 1.0) * 0.1;
        assert!(spheres.largest_gap >= corner - 1e-9 && spheres.largest_gap < 1.5 * corner, "{}", spheres.largest_gap);

        let free = ContactSphereRule::Shell { count: 60, radius: None };
        let free = ContactSpheres::place(&free, &mesh_outline(&surface)).unwrap();
        assert!(free.largest_gap <= 1.05 * spheres.largest_gap, "{} {}", free.largest_gap, spheres.largest_gap);
    }

    #[test]
    fn what_does_not_fit_in_a_mesh_is_refused() {
        let surface = sphere_mesh(1.0, 2, crate::geometry::VolumeRule::Inscribed).boundary();
        let rule = ContactSphereRule::Shell { count: 20, radius: Some(1.2) };
        assert!(matches!(
            ContactSpheres::place(&rule, &mesh_outline(&surface)),
            Err(ContactSphereError::RadiusTooLarge { .. })
        ));
        let rule = ContactSphereRule::Axis { count: 3 };
        assert!(ContactSpheres::place(&rule, &mesh_outline(&surface)).is_err());
    }

    #[test]
    fn lists_are_read_and_faults_named_by_line() {
        let text = "# x y z r\n0 0 0 0.1\n\n 0.1, 0.2, -0.3, 0.05 # tip\n";
        let spheres = parse_sphere_list(text, 1e-3).unwrap();
        assert_eq!(spheres.len(), 2);
        assert!((spheres[1].0.z + 0.3e-3).abs() < 1e-18 && (spheres[1].1 - 0.05e-3).abs() < 1e-18);
        assert_eq!(parse_sphere_list("0 0 0 1\n1 2 3", 1.0).unwrap_err().line, 2);
        assert_eq!(parse_sphere_list("0 0 0 -1", 1.0).unwrap_err().line, 1);
        assert!(parse_sphere_list("0 zero 0 1", 1.0).unwrap_err().to_string().contains("'zero'"));
        let rule = ContactSphereRule::Listed(Vec::new());
        assert_eq!(ContactSpheres::place(&rule, &Outline::Spheroid(GRAIN)), Err(ContactSphereError::None));
    }
}
