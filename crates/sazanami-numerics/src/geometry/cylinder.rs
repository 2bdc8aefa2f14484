//! The exact circular cylinder: what its meshes are measured against. Its axis is body axis x1.

use std::f64::consts::PI;

use super::ContactSphereError;
use crate::{Quaternion, Real, Vector};

/// A circular cylinder about the body axis x1, with flat ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Radius \[m].
    pub radius: Real,
    /// Length along the axis \[m].
    pub length: Real,
}

impl Cylinder {
    /// Volume pi r^2 l [m^3].
    #[must_use]
    pub fn volume(&self) -> Real {
        PI * self.radius * self.radius * self.length
    }

    /// Principal moments of inertia per unit density, axis first: V r^2/2 and V (3 r^2 + l^2)/12 [m^5].
    #[must_use]
    pub fn principal_inertia(&self) -> Vector {
        let (r2, l2) = (self.radius.powi(2), self.length.powi(2));
        let across = (3.0 * r2 + l2) / 12.0;
        self.volume() * Vector::new(0.5 * r2, across, across)
    }

    /// Half the edges of the box along x1, x2, x3 round the cylinder turned by `orientation` \[m].
    #[must_use]
    pub fn half_extents(&self, orientation: Quaternion) -> Vector {
        let axis = orientation * Vector::X;
        let across = (Vector::ONE - axis * axis).max(Vector::ZERO).map(Real::sqrt);
        0.5 * self.length * axis.abs() + self.radius * across
    }

    /// `count` contact spheres of the cylinder's radius, evenly spaced on its axis from one end to the other: they follow
    /// its mantle and leave a gap of (sqrt(2) - 1) r at the edges of its ends.
    ///
    /// # Errors
    /// If there are none, or the cylinder is shorter than its diameter.
    pub(super) fn spheres_on_axis(&self, count: usize) -> Result<Vec<(Vector, Real)>, ContactSphereError> {
        let end = 0.5 * self.length - self.radius;
        match count {
            0 => Err(ContactSphereError::None),
            _ if end < 0.0 => {
                Err(ContactSphereError::NotProlate { count, found: "this cylinder is shorter than its diameter" })
            }
            // As long as wide: all of them would be the same sphere.
            _ if count == 1 || end <= 1e-12 * self.radius => Ok(vec![(Vector::ZERO, self.radius)]),
            _ => {
                let place = |i: usize| end * (2.0 * i as Real / (count - 1) as Real - 1.0);
                Ok((0..count).map(|i| (Vector::new(place(i), 0.0, 0.0), self.radius)).collect())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_round_a_turned_cylinder_holds_its_rims_and_no_more() {
        let cylinder = Cylinder { radius: 0.3, length: 1.1 };
        let turn = Quaternion::from_rotation_z(0.7) * Quaternion::from_rotation_y(0.4);
        let rim = |n: u32| {
            let (sin, cos) = (2.0 * PI * Real::from(n) / 2000.0).sin_cos();
            turn * Vector::new(0.55, 0.3 * cos, 0.3 * sin)
        };
        let found = (0..2000).map(rim).fold(Vector::ZERO, |most, p| most.max(p.abs()));
        let half = cylinder.half_extents(turn);
        assert!((half - found).abs().max_element() < 1e-6 && half.cmpge(found - 1e-12).all(), "{half} {found}");
    }

    #[test]
    fn a_cylinder_as_long_as_wide_has_one_sphere_on_its_axis() {
        let [wide, long] = [0.6, 0.8].map(|length| Cylinder { radius: 0.3, length });
        assert_eq!(wide.spheres_on_axis(9).expect("it is no shorter than wide"), [(Vector::ZERO, 0.3)]);
        assert_eq!(long.spheres_on_axis(9).expect("it is longer").len(), 9);
        assert!(Cylinder { radius: 0.3, length: 0.59 }.spheres_on_axis(9).is_err());
    }
}
