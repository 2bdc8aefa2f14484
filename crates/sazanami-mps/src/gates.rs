//! Gates: rigid plates without thickness that stand across the tank until they are raised.
//!
//! A pair of particles does not see each other where the way between them meets a plate; each sees the images of the
//! particles on its side there. Both tests give the same answer from either end of a pair, to the last bit.

use sazanami_numerics::{Real, Vector};

/// Smallest distance of fluid particles from a wall or gate over the particle spacing.
pub(crate) const NEAREST: Real = 0.2;
/// Most gates of a tank.
pub const MOST_GATES: usize = 16;

/// Least distance of gates from each other and from walls \[m], so that a particle sees one plane at a time: twice the largest
/// radius of a sum, of influence or, for void fractions among grains, of `smoothing`.
#[must_use]
pub fn room(influence: Real, smoothing: Real) -> Real {
    2.0 * influence.max(smoothing)
}

/// Part of a time that is round-off.
const ROUND_OFF: Real = 1e-9;

/// A plate normal to x1 or x2, over the whole width of the tank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    /// Direction of its normal, 0 or 1.
    pub direction: usize,
    /// Coordinate along it \[m].
    pub place: Real,
    /// Lower and upper edge while it is closed \[m].
    pub edges: [Real; 2],
    /// Time at which it begins to rise \[s].
    pub opens: Real,
    /// Speed at which it rises [m/s]; `None` if it is gone at once.
    pub speed: Option<Real>,
    /// Height by which it is raised \[m]; infinite when it is gone.
    pub raised: Real,
    /// Its present velocity, upwards [m/s].
    pub velocity: Real,
}

impl Gate {
    /// A closed gate.
    #[must_use]
    pub fn closed(direction: usize, place: Real, edges: [Real; 2], opens: Real, speed: Option<Real>) -> Self {
        Self { direction, place, edges, opens, speed, raised: 0.0, velocity: 0.0 }
    }

    /// Puts the gate where it is at `time` \[s]; it is gone once it is above `ceiling` \[m].
    pub(crate) fn put(&mut self, time: Real, ceiling: Real) {
        (self.raised, self.velocity) = match self.speed {
            _ if time < self.opens * (1.0 - ROUND_OFF) => (0.0, 0.0),
            None => (Real::INFINITY, 0.0),
            Some(speed) => (speed * (time - self.opens).max(0.0), speed),
        };
        if self.edges[0] + self.raised >= ceiling {
            (self.raised, self.velocity) = (Real::INFINITY, 0.0);
        }
    }

    /// Whether there is a plate no more.
    #[must_use]
    pub fn is_gone(&self) -> bool {
        self.raised == Real::INFINITY
    }

    /// Lower and upper edge where it is now \[m].
    #[must_use]
    pub fn span(&self) -> [Real; 2] {
        self.edges.map(|edge| edge + self.raised)
    }

    /// Whether the plate reaches over the height `z` \[m].
    fn holds(&self, z: Real) -> bool {
        let [lower, upper] = self.span();
        z >= lower && z <= upper
    }

    /// Distance from the nearest point of the plate \[m].
    #[must_use]
    pub fn clearance(&self, x: Vector) -> Real {
        let [lower, upper] = self.span();
        self.distance(x).hypot(x.z - x.z.max(lower).min(upper))
    }

    /// Distance from the plane of the plate, positive on its upper side \[m].
    pub(crate) fn distance(&self, x: Vector) -> Real {
        x[self.direction] - self.place
    }

    /// Whether the way from `a` to `b` goes through the plate.
    #[must_use]
    pub fn parts(&self, a: Vector, b: Vector) -> bool {
        let (da, db) = (self.distance(a), self.distance(b));
        are_apart(da, db) && self.holds(crossing([a.z, b.z], [da, db]))
    }

    /// As [`Self::parts`], where `b` may lie behind a `floor` \[m] that mirrors the plate.
    pub(crate) fn parts_over(&self, a: Vector, b: Vector, floor: Real) -> bool {
        let (da, db) = (self.distance(a), self.distance(b));
        are_apart(da, db) && self.holds(floor + (crossing([a.z, b.z], [da, db]) - floor).abs())
    }

    /// Whether the way from `a` to the image of `b` on the same side goes through the plate.
    pub(crate) fn mirrors(&self, a: Vector, b: Vector) -> bool {
        let (da, db) = (self.distance(a), self.distance(b));
        !are_apart(da, db) && self.holds(crossing([a.z, b.z], [da, db]))
    }

    /// The same where `b` is mirrored in a floor or lid at height `level` \[m] as well; `mirrored` tells whether in the gate.
    pub(crate) fn beyond(&self, a: Vector, b: Vector, level: Real, mirrored: bool) -> bool {
        let (da, db) = (self.distance(a), self.distance(b));
        let meets = are_apart(da, db) != mirrored;
        let (ua, ub) = (a.z - level, b.z - level);
        let height = ((ua * db.abs() - ub * da.abs()) / (da.abs() + db.abs())).abs();
        meets && self.holds(level + height.copysign(ua))
    }

    /// Puts a fluid particle that went from `from` into the plate or too close to it back on its side, and removes its
    /// velocity into the plate; returns whether it did.
    pub(crate) fn clip(&self, spacing: Real, from: Vector, position: &mut Vector, velocity: &mut Vector) -> bool {
        let d = self.direction;
        let side = if self.distance(from) < 0.0 { -1.0 } else { 1.0 };
        let [before, after] = [from, *position].map(|x| side * self.distance(x));
        if after >= NEAREST * spacing {
            return false;
        }
        let z = if after < 0.0 { crossing([from.z, position.z], [before, after]) } else { position.z };
        if !self.holds(z) {
            return false;
        }
        position[d] = self.place + side * NEAREST * spacing;
        velocity[d] = side * (side * velocity[d]).max(0.0);
        true
    }
}

/// The gate of `gates` whose plane is nearer than `radius` \[m] to `x`.
pub(crate) fn near(gates: &[Gate], x: Vector, radius: Real) -> Option<&Gate> {
    gates.iter().find(|gate| !gate.is_gone() && gate.distance(x).abs() < radius)
}

/// Whether two distances from a plane are of different sides; the plane itself belongs to the upper one.
fn are_apart(da: Real, db: Real) -> bool {
    (da < 0.0) != (db < 0.0)
}

/// Height at which a way between heights `z` meets a plane from which its ends are `apart`.
fn crossing(z: [Real; 2], apart: [Real; 2]) -> Real {
    let [da, db] = apart.map(Real::abs);
    (z[0] * db + z[1] * da) / (da + db)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate() -> Gate {
        Gate::closed(0, 5.0, [0.0, 4.0], 1.0, Some(2.0))
    }

    #[test]
    fn a_gate_rises_with_its_speed_from_its_time_on_until_it_is_gone() {
        let mut gate = gate();
        gate.put(0.5, 6.0);
        assert_eq!((gate.span(), gate.velocity), ([0.0, 4.0], 0.0));
        gate.put(2.0, 6.0);
        assert_eq!((gate.span(), gate.velocity), ([2.0, 6.0], 2.0));
        gate.put(4.0, 6.0);
        assert!(gate.is_gone() && gate.velocity == 0.0);
        let mut at_once = Gate { speed: None, ..gate };
        at_once.put(0.999, 6.0);
        assert!(!at_once.is_gone());
        at_once.put(1.0, 6.0);
        assert!(at_once.is_gone());
    }

    #[test]
    fn both_ends_of_a_pair_see_the_same_plate() {
        let mut gate = gate();
        gate.put(1.25, 6.0);
        let mut random = sazanami_numerics::Random::new(3);
        let mut place = || Vector::new(random.between(4.0, 6.0), 0.0, random.between(0.0, 1.0));
        let mut seen = [0; 4];
        for _ in 0..10_000 {
            let (a, b) = (place(), place());
            assert_eq!(gate.parts(a, b), gate.parts(b, a));
            assert_eq!(gate.mirrors(a, b), gate.mirrors(b, a));
            for mirrored in [false, true] {
                assert_eq!(gate.beyond(a, b, 0.0, mirrored), gate.beyond(b, a, 0.0, mirrored));
            }
            let found = [gate.parts(a, b), gate.mirrors(a, b), gate.beyond(a, b, 0.0, false)];
            (0..3).for_each(|n| seen[n] += usize::from(found[n]));
            seen[3] += usize::from(!found[0] && (a.x < 5.0) != (b.x < 5.0));
        }
        assert!(seen.iter().all(|&count| count > 500), "{seen:?}");
        // Under the edge the way is free, by the floor too; a closed gate leaves no way.
        let low = [4.9, 5.1].map(|x| Vector::new(x, 0.0, 0.1));
        assert!(!gate.parts(low[0], low[1]) && !gate.beyond(low[0], low[1], 0.0, false));
        gate.put(0.0, 6.0);
        assert!(gate.parts(low[0], low[1]) && gate.beyond(low[0], low[1], 0.0, false));
    }

    #[test]
    fn particles_do_not_pass_a_plate() {
        let gate = gate();
        let from = Vector::new(4.5, 0.0, 1.0);
        for x in [4.9, 5.5] {
            let (mut x, mut u) = (Vector::new(x, 0.0, 1.0), Vector::new(3.0, 1.0, 0.0));
            assert!(gate.clip(1.0, from, &mut x, &mut u));
            assert_eq!((x, u), (Vector::new(4.8, 0.0, 1.0), Vector::new(0.0, 1.0, 0.0)));
        }
        let (mut x, mut u) = (Vector::new(5.5, 0.0, 5.0), Vector::X);
        assert!(!gate.clip(1.0, from.with_z(5.0), &mut x, &mut u));
    }
}
