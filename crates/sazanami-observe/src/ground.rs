//! The plan of a box, which may repeat in one direction or both.

use sazanami_numerics::Vector;

use crate::{BedView, Horizontal};

/// A rectangle of the horizontal plane and the directions in which it repeats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Lower corner \[m].
    pub lower: Horizontal,
    /// Upper corner \[m].
    pub upper: Horizontal,
    /// Directions in which it repeats.
    pub periodic: [bool; 2],
}

impl Ground {
    /// The ground with `axis` in the middle of the directions in which it repeats.
    #[must_use]
    pub fn about(&self, axis: Horizontal) -> Self {
        let mut about = *self;
        for d in (0..2).filter(|&d| self.periodic[d]) {
            let half = 0.5 * (self.upper[d] - self.lower[d]);
            (about.lower[d], about.upper[d]) = (axis[d] - half, axis[d] + half);
        }
        about
    }

    /// Way from `axis` to the nearest image of a point \[m].
    #[must_use]
    pub fn from_axis(&self, axis: Horizontal, point: Vector) -> Horizontal {
        let way = [point.x - axis[0], point.y - axis[1]];
        [0, 1].map(|d| {
            let period = self.upper[d] - self.lower[d];
            if self.periodic[d] { way[d] - period * (way[d] / period).round() } else { way[d] }
        })
    }

    /// A bed whose grains are those images that lie nearest to `axis`.
    pub fn seen_from<R>(&self, axis: Horizontal, bed: &BedView, look: impl FnOnce(&BedView) -> R) -> R {
        if self.periodic == [false; 2] {
            return look(bed);
        }
        let nearest = |&centre: &Vector| {
            let [x, y] = self.from_axis(axis, centre);
            Vector::new(axis[0] + x, axis[1] + y, centre.z)
        };
        let position: Vec<Vector> = bed.position.iter().map(nearest).collect();
        look(&BedView { position: &position, ..*bed })
    }
}
