//! Mirror images of fluid particles in the walls of the box.
//!
//! An image moves as its particle does, mirrored: walls then neither let fluid through nor hold it. Images are not stored;
//! a pair with an image has the number of the particle behind it and the directions in which it is turned.

use sazanami_numerics::{Real, Vector};

use crate::boundary::{Side, Tank};

/// Directions in which an image is turned: bit `d` for direction `d`.
pub(crate) type Turned = u8;

/// The planes of the walls, without end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mirrors {
    /// Twice the coordinate of the lower and the upper wall in each direction \[m]; `None` where there is none.
    twice: [[Option<Real>; 2]; 3],
}

impl Mirrors {
    /// The walls of `tank` where they stand.
    pub fn of(tank: &Tank) -> Self {
        let plane = |d: usize, upper: usize| {
            let at = [tank.lower, tank.upper][upper][d] + tank.displacement[d];
            (tank.sides[d][upper] == Side::Wall).then_some(2.0 * at)
        };
        Self { twice: std::array::from_fn(|d| [plane(d, 0), plane(d, 1)]) }
    }

    /// Calls `body` with every combination of walls, at most one in each direction, nearer than `radius` \[m] to
    /// `position`: the directions turned, and twice the coordinates of the planes there.
    #[inline]
    pub fn near(&self, position: Vector, radius: Real, mut body: impl FnMut(Turned, Vector)) {
        let planes: [[Option<Real>; 2]; 3] = std::array::from_fn(|d| {
            self.twice[d].map(|plane| plane.filter(|twice| (0.5 * twice - position[d]).abs() < radius))
        });
        if planes.as_flattened().iter().all(Option::is_none) {
            return;
        }
        for number in 1..27 {
            let sides = [number % 3, number / 3 % 3, number / 9];
            let (mut turned, mut twice, mut exists) = (0, Vector::ZERO, true);
            for d in (0..3).filter(|&d| sides[d] > 0) {
                match planes[d][sides[d] - 1] {
                    Some(plane) => (turned, twice[d]) = (turned | 1 << d, plane),
                    None => exists = false,
                }
            }
            if exists {
                body(turned, twice);
            }
        }
    }
}

/// `vector` with the components along the directions `turned` reversed.
#[inline(always)]
pub(crate) fn turn(turned: Turned, vector: Vector) -> Vector {
    Vector::new(signed(turned, 0, vector.x), signed(turned, 1, vector.y), signed(turned, 2, vector.z))
}

#[inline(always)]
fn signed(turned: Turned, d: u8, value: Real) -> Real {
    if turned >> d & 1 == 1 { -value } else { value }
}

/// Way from `from` to the image of `to` \[m]; the same from either end of a pair, mirrored, to the last bit.
#[inline(always)]
pub(crate) fn way(from: Vector, to: Vector, turned: Turned, twice: Vector) -> Vector {
    let of = |d: usize| if turned >> d & 1 == 1 { twice[d] - (from[d] + to[d]) } else { to[d] - from[d] };
    Vector::new(of(0), of(1), of(2))
}
