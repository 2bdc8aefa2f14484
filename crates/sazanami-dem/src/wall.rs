//! Plane walls, at rest or moving.

use sazanami_numerics::{Real, Vector};

/// A plane that grains cannot pass, from the side its normal points to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// A point of the plane \[m].
    pub point: Vector,
    /// Unit normal, towards the grains.
    pub normal: Vector,
    /// Velocity of the wall material [m/s]; its normal part moves the plane.
    pub velocity: Vector,
    /// Material, for the contact law.
    pub material: u32,
}

impl Wall {
    /// A wall at rest.
    #[must_use]
    pub fn at_rest(point: Vector, normal: Vector, material: u32) -> Self {
        Self { point, normal: normal.normalize(), velocity: Vector::ZERO, material }
    }

    /// Walls on the sides of a box that `present[direction][lower or upper]` names.
    #[must_use]
    pub fn of_box(lower: Vector, upper: Vector, material: u32, present: [[bool; 2]; 3]) -> Vec<Self> {
        let mut walls = Vec::new();
        for (axis, present) in Vector::AXES.into_iter().zip(present) {
            for (present, point, sign) in [(present[0], lower, 1.0), (present[1], upper, -1.0)] {
                if present {
                    walls.push(Self::at_rest(point, sign * axis, material));
                }
            }
        }
        walls
    }

    /// Distance of `position` from the plane, positive on the side of the grains \[m].
    #[must_use]
    pub fn distance(&self, position: Vector) -> Real {
        (position - self.point).dot(self.normal)
    }
}
