//! Plane walls and upright plates, at rest or moving.

use sazanami_numerics::{Real, Vector};

/// A plane that grains cannot pass, from the side its normal points to; or an upright plate without thickness, from both sides.
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
    /// Heights of the lower and the upper edge of a plate \[m]; `None` for a plane.
    pub edges: Option<[Real; 2]>,
}

impl Wall {
    /// A wall at rest.
    #[must_use]
    pub fn at_rest(point: Vector, normal: Vector, material: u32) -> Self {
        Self { point, normal: normal.normalize(), velocity: Vector::ZERO, material, edges: None }
    }

    /// A plate at rest between two heights `edges` \[m]; infinite ones stand for a plate that is gone.
    #[must_use]
    pub fn plate(point: Vector, normal: Vector, material: u32, edges: [Real; 2]) -> Self {
        Self { edges: Some(edges), ..Self::at_rest(point, normal, material) }
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
        match self.edges {
            None => (position - self.point).dot(self.normal),
            Some(edges) => self.way_from_plate(position, edges).length(),
        }
    }

    /// Distance of a sphere's centre, at `arm` from `position`, from the wall \[m], and the direction from there to it.
    pub(crate) fn facing(&self, position: Vector, arm: Vector) -> (Real, Vector) {
        let Some(edges) = self.edges else { return (self.distance(position) + arm.dot(self.normal), self.normal) };
        let way = self.way_from_plate(position + arm, edges);
        let distance = way.length();
        (distance, if distance > 0.0 { way / distance } else { self.normal })
    }

    /// Shortest way from a plate to `position` \[m].
    fn way_from_plate(&self, position: Vector, [lower, upper]: [Real; 2]) -> Vector {
        let beyond = position.z - position.z.max(lower).min(upper);
        (position - self.point).dot(self.normal) * self.normal + Vector::new(0.0, 0.0, beyond)
    }

    /// Moves the wall for `time` \[s]; returns a bound on how far the distance of a grain at rest can have changed \[m].
    pub(crate) fn advance(&mut self, time: Real) -> Real {
        let step = self.velocity.dot(self.normal) * time;
        self.point += step * self.normal;
        let Some(edges) = &mut self.edges else { return step.abs() };
        let rise = self.velocity.z * time;
        *edges = edges.map(|edge| edge + rise);
        self.velocity.length() * time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plates_are_felt_on_both_sides_and_at_their_edges() {
        let plate = Wall::plate(Vector::X, Vector::X, 0, [0.0, 2.0]);
        for (x, distance, normal) in [
            (Vector::new(1.5, 7.0, 1.0), 0.5, Vector::X),
            (Vector::new(0.5, 7.0, 2.0), 0.5, -Vector::X),
            (Vector::new(1.0, 7.0, 3.0), 1.0, Vector::Z),
            (Vector::new(4.0, 7.0, -4.0), 5.0, Vector::new(0.6, 0.0, -0.8)),
        ] {
            let (found, way) = plate.facing(x, Vector::ZERO);
            assert!((found - distance).abs() < 1e-12 && (way - normal).length() < 1e-12, "{x} {found} {way}");
            assert_eq!(plate.distance(x), found);
        }
        let mut rising = Wall { velocity: Vector::new(0.0, 0.0, 2.0), ..plate };
        assert_eq!((rising.advance(0.5), rising.edges), (1.0, Some([1.0, 3.0])));
        let gone = Wall { edges: Some([Real::INFINITY; 2]), ..plate };
        assert_eq!(gone.distance(Vector::X), Real::INFINITY);
    }
}
