//! The exact spheroid: what its meshes and contact spheres are measured against.
//!
//! The single axis is body axis x1: (x/c)^2 + (y^2 + z^2)/a^2 = 1; prolate where c > a.

use std::f64::consts::PI;

use crate::{Quaternion, Real, Vector};

/// An ellipsoid of revolution about the body axis x1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spheroid {
    /// Semi-axis a of the two equal axes \[m].
    pub equatorial: Real,
    /// Semi-axis c of the single axis \[m].
    pub axial: Real,
}

impl Spheroid {
    /// Volume 4/3 pi a^2 c [m^3].
    #[must_use]
    pub fn volume(&self) -> Real {
        4.0 / 3.0 * PI * self.equatorial * self.equatorial * self.axial
    }

    /// Principal moments of inertia per unit density, single axis first [m^5].
    #[must_use]
    pub fn principal_inertia(&self) -> Vector {
        let (a2, c2) = (self.equatorial.powi(2), self.axial.powi(2));
        self.volume() / 5.0 * Vector::new(a2 + a2, a2 + c2, a2 + c2)
    }

    /// Smallest radius of curvature of the surface \[m]: at the poles if prolate, round the equator if oblate.
    #[must_use]
    pub fn smallest_curvature_radius(&self) -> Real {
        let (a, c) = (self.equatorial, self.axial);
        if c >= a { a * a / c } else { c * c / a }
    }

    /// Whether `point` lies inside or on the surface.
    #[must_use]
    pub fn contains(&self, point: Vector) -> bool {
        (point.x / self.axial).powi(2) + (point.y.powi(2) + point.z.powi(2)) / self.equatorial.powi(2) <= 1.0
    }

    /// Half the edges of the box along x1, x2, x3 round the spheroid turned by `orientation` \[m].
    #[must_use]
    pub fn half_extents(&self, orientation: Quaternion) -> Vector {
        let axis = orientation * Vector::X;
        let along = axis * axis;
        (self.axial.powi(2) * along + self.equatorial.powi(2) * (Vector::ONE - along)).max(Vector::ZERO).map(Real::sqrt)
    }

    /// Point of the meridian at parameter `t` from 0 (one pole) to pi (the other), moved inward along the normal
    /// by `depth`: coordinate along the axis and distance from it \[m].
    pub(super) fn meridian(&self, t: Real, depth: Real) -> [Real; 2] {
        let (a, c) = (self.equatorial, self.axial);
        let (sin, cos) = t.sin_cos();
        let (n_axial, n_radial) = (cos / c, sin / a);
        let length = n_axial.hypot(n_radial);
        [c * cos - depth * n_axial / length, a * sin - depth * n_radial / length]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sand_grain_of_the_paper() {
        let grain = Spheroid { equatorial: 0.26e-3, axial: 0.635e-3 };
        assert!((grain.volume() * 1e9 - 0.179_81).abs() < 1e-5);
        let inertia = grain.principal_inertia();
        assert!((inertia.x / inertia.y - 0.287_16).abs() < 5e-6);
        assert_eq!(inertia.y, inertia.z);
        assert!((grain.smallest_curvature_radius() * 1e3 - 0.106_46).abs() < 1e-5);
        assert!(grain.contains(Vector::new(0.6e-3, 0.0, 0.0)) && !grain.contains(Vector::new(0.0, 0.3e-3, 0.0)));
    }

    #[test]
    fn the_box_round_a_turned_spheroid_touches_it() {
        let grain = Spheroid { equatorial: 0.26, axial: 0.635 };
        let turn = Quaternion::from_axis_angle(Vector::new(0.3, 1.0, -0.2).normalize(), 0.7);
        let half = grain.half_extents(turn);
        let mut farthest = Vector::ZERO;
        for i in 0..=400 {
            for j in 0..400 {
                let [x, r] = grain.meridian(PI * Real::from(i) / 400.0, 0.0);
                let (sin, cos) = (2.0 * PI * Real::from(j) / 400.0).sin_cos();
                farthest = farthest.max(turn * Vector::new(x, r * cos, r * sin));
            }
        }
        assert!((half - farthest).abs().max_element() < 1e-4 && (half - farthest).min_element() > -1e-12);
        assert_eq!(grain.half_extents(Quaternion::IDENTITY), Vector::new(0.635, 0.26, 0.26));
    }

    #[test]
    fn the_offset_meridian_keeps_its_depth() {
        let grain = Spheroid { equatorial: 0.26, axial: 0.635 };
        for i in 0..=10 {
            let t = PI * Real::from(i) / 10.0;
            let ([x, r], [xo, ro]) = (grain.meridian(t, 0.0), grain.meridian(t, 0.05));
            assert!(((x - xo).hypot(r - ro) - 0.05).abs() < 1e-14);
        }
    }
}
