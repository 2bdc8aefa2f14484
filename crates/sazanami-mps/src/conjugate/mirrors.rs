//! Mirror images of fluid particles in the walls of the box.
//!
//! An image moves as its particle does, mirrored: walls then neither let fluid through nor hold it. Images are not stored;
//! a pair with an image has the number of the particle behind it and the directions in which it is turned.

use sazanami_numerics::{Real, Vector};

use crate::boundary::{Side, Tank};
use crate::gates::Gate;

/// Directions in which an image is turned: bit `d` for direction `d`; above them the number of the gate that turned it, from 1.
pub(crate) type Turned = u8;

/// Bits of the directions.
pub(crate) const DIRECTIONS: Turned = 0b111;
/// Bits of the number of a gate begin after as many.
const GATE: u32 = 3;

/// The gate that turned an image.
#[inline(always)]
pub(crate) fn gate_of(turned: Turned) -> Option<usize> {
    usize::from(turned >> GATE).checked_sub(1)
}

/// The planes of the walls, without end, and gates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mirrors<'a> {
    /// Twice the coordinate of the lower and the upper wall in each direction \[m]; `None` where there is none.
    twice: [[Option<Real>; 2]; 3],
    pub gates: &'a [Gate],
}

impl<'a> Mirrors<'a> {
    /// The walls of `tank` where they stand.
    pub fn of(tank: &'a Tank) -> Self {
        let plane = |d: usize, upper: usize| {
            let at = [tank.lower, tank.upper][upper][d] + tank.displacement[d];
            (tank.sides[d][upper] == Side::Wall).then_some(2.0 * at)
        };
        Self { twice: std::array::from_fn(|d| [plane(d, 0), plane(d, 1)]), gates: &tank.gates }
    }

    /// The gate whose plane is nearer than `radius` \[m] to `position`: gates keep farther away from each other and from walls.
    #[inline]
    pub fn gate_near(&self, position: Vector, radius: Real) -> Option<usize> {
        self.gates.iter().position(|gate| !gate.is_gone() && gate.distance(position).abs() < radius)
    }

    /// Whether the first of two particles sees the image of the second that is turned in the planes at `twice`, near a gate.
    #[inline]
    pub fn shows(&self, gate: usize, [a, b]: [Vector; 2], turned: Turned, twice: Vector) -> bool {
        let gate = &self.gates[gate];
        let by_gate = gate_of(turned).is_some();
        let lid = turned >> 2 & 1 == 1;
        match (by_gate, lid) {
            (_, true) => gate.beyond(a, b, 0.5 * twice.z, by_gate) == by_gate,
            (true, false) => gate.mirrors(a, b),
            (false, false) => !gate.parts(a, b),
        }
    }

    /// Calls `body` with every combination of walls and the `gate` near it, at most one in each direction, nearer than
    /// `radius` \[m] to `position`: the directions turned, and twice the coordinates of the planes there.
    #[inline]
    pub fn near(&self, position: Vector, radius: Real, gate: Option<usize>, mut body: impl FnMut(Turned, Vector)) {
        let mut planes: [[Option<Real>; 2]; 3] = std::array::from_fn(|d| {
            self.twice[d].map(|plane| plane.filter(|twice| (0.5 * twice - position[d]).abs() < radius))
        });
        // No wall of this direction is near.
        let gate = gate.map(|number| (self.gates[number], (number as Turned + 1) << GATE));
        if let Some((gate, _)) = gate {
            planes[gate.direction] = [Some(2.0 * gate.place), None];
        }
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
                let number = gate.filter(|(gate, _)| turned >> gate.direction & 1 == 1).map_or(0, |(_, number)| number);
                body(turned | number, twice);
            }
        }
    }
}

/// `vector` with the components along the directions `turned` reversed.
#[inline(always)]
pub(crate) fn turn(turned: Turned, vector: Vector) -> Vector {
    Vector::new(signed(turned, 0, vector.x), signed(turned, 1, vector.y), signed(turned, 2, vector.z))
}

/// The same, quick for particles that are no images.
#[inline(always)]
pub(crate) fn seen(turned: Turned, vector: Vector) -> Vector {
    if turned == 0 { vector } else { turn(turned, vector) }
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
