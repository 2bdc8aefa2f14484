//! The rigid body of a grain as contacts use it: contact spheres in flat arrays, mass properties, bounds.

use sazanami_numerics::geometry::Shape;
use sazanami_numerics::{Matrix, Quaternion, Real, Vector};

use crate::face::Face;

/// Directions in which the exposed points of a contact sphere are sampled.
const DIRECTIONS: usize = 200;

/// Contact spheres and mass properties of a shape in its body frame (origin in the centre of mass,
/// axes principal), for a size factor of 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Volume [m^3].
    pub volume: Real,
    /// Principal moments of inertia over density [m^5].
    pub inertia: Vector,
    /// Centres of the contact spheres \[m].
    pub centres: Vec<Vector>,
    /// Radii of the contact spheres \[m].
    pub radii: Vec<Real>,
    /// Radius of the ball of the same volume \[m].
    pub(crate) volume_radius: Real,
    /// Radius about the centre of mass that holds contact spheres and mesh \[m].
    pub bounding_radius: Real,
    /// Largest distance of a sphere's centre from the centre of mass \[m].
    pub(crate) centre_radius: Real,
    /// A capsule round all contact spheres.
    pub(crate) capsule: Capsule,
    leverage: [Real; 2],
    face: Face,
    /// Rotation with which it lies as its shape was given.
    pub drawn: Quaternion,
}

/// All points within `radius` of the segment from `lower` to `upper` on a coordinate axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Capsule {
    pub axis: usize,
    pub lower: Real,
    pub upper: Real,
    pub radius: Real,
}

impl Body {
    /// A body of given mass properties and contact spheres, all in its body frame.
    ///
    /// # Panics
    /// If there are no spheres, or not as many radii as centres.
    #[must_use]
    pub fn new(volume: Real, inertia: Vector, centres: Vec<Vector>, radii: Vec<Real>, bounding_radius: Real) -> Self {
        assert!(
            !centres.is_empty() && centres.len() == radii.len(),
            "a body needs contact spheres, each with a radius"
        );
        let outermost = centres.iter().zip(&radii).map(|(c, r)| c.length() + r).fold(bounding_radius, Real::max);
        let centre_radius = centres.iter().map(|c| c.length()).fold(0.0, Real::max);
        let capsule = (0..3)
            .map(|axis| Capsule::around(axis, &centres, &radii))
            .min_by(|a, b| a.volume().total_cmp(&b.volume()))
            .unwrap_or_default();
        let leverage = leverage(volume, inertia, &centres, &radii);
        let face = Face::largest(volume, inertia, &centres, &radii);
        let volume_radius = match &radii[..] {
            [radius] if centre_radius == 0.0 => *radius,
            _ => (0.75 * volume / std::f64::consts::PI).cbrt(),
        };
        Self {
            volume,
            inertia,
            centres,
            radii,
            volume_radius,
            bounding_radius: outermost,
            centre_radius,
            capsule,
            leverage,
            face,
            drawn: Quaternion::IDENTITY,
        }
    }

    /// A ball with a single contact sphere.
    #[must_use]
    pub fn ball(radius: Real) -> Self {
        let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let inertia = Vector::splat(0.4 * volume * radius * radius);
        Self::new(volume, inertia, vec![Vector::ZERO], vec![radius], radius)
    }

    /// An exact spheroid of semi-axes `a` (two) and `c` (along x3), with `spheres` inscribed spheres
    /// of the largest radius that fits, evenly spaced on the long axis.
    ///
    /// # Panics
    /// If the spheroid is not prolate or there are fewer than two spheres.
    #[must_use]
    pub fn prolate(a: Real, c: Real, spheres: usize) -> Self {
        assert!(c > a && spheres > 1, "spheres on the axis suit prolate spheroids only");
        let volume = 4.0 / 3.0 * std::f64::consts::PI * a * a * c;
        let across = 0.2 * volume * (a * a + c * c);
        let inertia = Vector::new(across, across, 0.4 * volume * a * a);
        let focal = c * c - a * a;
        let end = focal / c;
        let at = |n: usize| end * (2.0 * n as Real / (spheres - 1) as Real - 1.0);
        let centres = (0..spheres).map(|n| Vector::new(0.0, 0.0, at(n))).collect();
        let radii = (0..spheres).map(|n| a * (1.0 - at(n) * at(n) / focal).sqrt()).collect();
        Self::new(volume, inertia, centres, radii, c)
    }

    /// Whether this is a ball: one contact sphere about the centre of mass, which turns alike about all axes, so that
    /// neither its contacts nor its spin depend on its orientation.
    #[must_use]
    pub fn is_ball(&self) -> bool {
        self.centres == [Vector::ZERO] && self.inertia == Vector::splat(self.inertia.x)
    }

    /// Whether it touches others as a ball does, with one contact sphere: nothing in its shape resists rolling.
    #[must_use]
    pub fn is_round(&self) -> bool {
        self.radii.len() == 1
    }

    /// Largest ratio of mass to effective mass at a contact point, along the normal and across it; see [`crate::stability`].
    #[must_use]
    pub fn leverage(&self) -> [Real; 2] {
        self.leverage
    }

    /// What it meets a plane with at most.
    #[must_use]
    pub fn face(&self) -> &Face {
        &self.face
    }

    /// Places in the plane of its largest face and radii of the spheres there \[m], with the size factor `scale`.
    #[must_use]
    pub fn flat_face(&self, scale: Real) -> Vec<[Real; 3]> {
        self.face.flat(&self.centres, &self.radii, scale)
    }

    /// Number of contact spheres.
    #[must_use]
    pub fn spheres(&self) -> usize {
        self.radii.len()
    }
}

impl Body {
    /// Centre and radius of each contact sphere.
    pub(crate) fn packed_spheres(&self) -> impl Iterator<Item = [Real; 4]> + '_ {
        self.centres.iter().zip(&self.radii).map(|(c, &r)| [c.x, c.y, c.z, r])
    }
}

impl From<&Shape> for Body {
    fn from(shape: &Shape) -> Self {
        let spheres = shape.contact_spheres();
        let (centres, radii) = (spheres.centres.clone(), spheres.radii.clone());
        let body = Self::new(shape.volume(), shape.principal_inertia(), centres, radii, shape.bounding_radius());
        Self { drawn: shape.drawn(), ..body }
    }
}

impl Capsule {
    fn around(axis: usize, centres: &[Vector], radii: &[Real]) -> Self {
        let across = |c: &Vector| (c.length_squared() - c[axis] * c[axis]).max(0.0).sqrt();
        let radius = centres.iter().zip(radii).map(|(c, r)| across(c) + r).fold(0.0, Real::max) * (1.0 + 1e-12);
        let mut capsule = Self { axis, lower: Real::INFINITY, upper: Real::NEG_INFINITY, radius };
        for (c, r) in centres.iter().zip(radii) {
            // A sphere lies in the capsule if the segment comes this close to it along the axis.
            let slack = ((radius - r).powi(2) - across(c).powi(2)).max(0.0).sqrt();
            capsule.lower = capsule.lower.min(c[axis] + slack);
            capsule.upper = capsule.upper.max(c[axis] - slack);
        }
        if capsule.lower > capsule.upper {
            let middle = 0.5 * (capsule.lower + capsule.upper);
            (capsule.lower, capsule.upper) = (middle, middle);
        }
        capsule
    }

    fn volume(&self) -> Real {
        std::f64::consts::PI * self.radius.powi(2) * (self.upper - self.lower + 4.0 / 3.0 * self.radius)
    }
}

/// Largest `M/m_eff = 1 + M (r x u) . I^-1 (r x u)` over exposed points `r` of the spheres, for `u`
/// along the normal and for the worst `u` across it.
fn leverage(volume: Real, inertia: Vector, centres: &[Vector], radii: &[Real]) -> [Real; 2] {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let directions: Vec<Vector> = (0..DIRECTIONS)
        .map(|n| {
            let z = 1.0 - (2 * n + 1) as Real / DIRECTIONS as Real;
            let (sine, cosine) = (golden * n as Real).sin_cos();
            let across = (1.0 - z * z).sqrt();
            Vector::new(across * cosine, across * sine, z)
        })
        .chain(Vector::AXES)
        .chain(Vector::AXES.map(|axis| -axis))
        .collect();
    let inverse = volume / inertia;
    let along = |r: Vector, u: Vector| {
        let arm = r.cross(u);
        1.0 + (arm * arm * inverse).element_sum()
    };
    let mut worst = [1.0_f64; 2];
    for (centre, radius) in centres.iter().zip(radii) {
        for &n in &directions {
            let r = *centre + *radius * n;
            let hidden = |(c, s): (&Vector, &Real)| (r - *c).length_squared() < s * s * (1.0 - 1e-9);
            if centres.iter().zip(radii).any(hidden) {
                continue;
            }
            let t = n.any_orthonormal_vector();
            let b = n.cross(t);
            worst[0] = worst[0].max(along(r, n));
            // The quadratic form across n is a symmetric 2 x 2 matrix; its larger eigenvalue is the worst case.
            let (tt, bb) = (along(r, t), along(r, b));
            let tb = (r.cross(t) * r.cross(b) * inverse).element_sum();
            worst[1] = worst[1].max(0.5 * (tt + bb) + (0.25 * (tt - bb).powi(2) + tb * tb).sqrt());
        }
    }
    worst
}

/// Body-frame inverse inertia applied in the laboratory frame: `R diag(1/I) R^T L`.
pub(crate) fn spin(rotation: &Matrix, inverse_inertia: Vector, momentum: Vector) -> Vector {
    *rotation * (inverse_inertia * (rotation.transpose() * momentum))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_spheroid_has_its_known_leverage() {
        let body = Body::prolate(0.26e-3, 0.635e-3, 41);
        // Over the exact spheroid: 2.49 along the normal, 5.28 across it at the tip. The valleys between spheres add a little.
        assert!((2.49..2.75).contains(&body.leverage[0]), "{:?}", body.leverage);
        assert!((body.leverage[1] - 5.28).abs() < 0.15, "{:?}", body.leverage);
        assert!((body.inertia.z / body.inertia.x - 0.28716).abs() < 1e-5);
    }

    #[test]
    fn a_ball_has_the_leverage_of_a_ball() {
        let body = Body::ball(2.0);
        assert!((body.leverage[0] - 1.0).abs() < 1e-12 && (body.leverage[1] - 3.5).abs() < 1e-12);
        assert!((body.capsule.upper - body.capsule.lower).abs() < 1e-11);
    }

    #[test]
    fn the_capsule_holds_every_sphere() {
        let centres = vec![Vector::new(0.1, 0.0, -1.0), Vector::new(0.0, 0.2, 0.3), Vector::new(0.0, 0.0, 1.5)];
        let radii = vec![0.3, 0.4, 0.2];
        let body = Body::new(1.0, Vector::ONE, centres, radii, 0.0);
        let c = body.capsule;
        for (p, r) in body.centres.iter().zip(&body.radii) {
            let mut nearest = Vector::ZERO;
            nearest[c.axis] = p[c.axis].clamp(c.lower, c.upper);
            assert!((*p - nearest).length() + r <= c.radius * (1.0 + 1e-9));
        }
    }
}
