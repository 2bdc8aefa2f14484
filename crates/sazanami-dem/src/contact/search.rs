//! Pairs of contact spheres of two grains that are near each other.
//!
//! The search is exact: spheres are left out only where a bound proves them far. Bounds come
//! from the capsules round the two grains, so that a pair costs some tens of distances instead of
//! the product of the numbers of spheres.

use sazanami_numerics::{Matrix, Real, Vector};

use crate::body::{Body, Capsule};

/// Gap over the smaller bounding radius below which a sphere pair is given to the contact law.
pub(crate) const TOUCH: Real = 1e-9;
/// Gap of two grains, or of a grain and a wall, over the smaller bounding radius, below which the gaps of their contact
/// spheres are measured one by one.
pub(crate) const CUT_OFF: Real = 0.1;

/// A capsule in the laboratory frame or another common one: all points within `radius` of a segment \[m].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PlacedCapsule {
    pub start: Vector,
    pub end: Vector,
    pub radius: Real,
}

impl PlacedCapsule {
    /// The capsule of a grain relative to its centre of mass, in the laboratory frame.
    pub fn new(capsule: &Capsule, rotation: &Matrix, scale: Real) -> Self {
        let axis = rotation.col(capsule.axis) * scale;
        Self { start: axis * capsule.lower, end: axis * capsule.upper, radius: capsule.radius * scale }
    }

    /// A lower bound of the gap to a capsule whose origin stands at `offset` from this one's \[m].
    pub fn gap(&self, other: &Self, offset: Vector) -> Real {
        segment_distance(self.start, self.end, other.start + offset, other.end + offset) - self.radius - other.radius
    }
}

/// Smallest distance of the segments `a b` and `c d` (Ericson, Real-Time Collision Detection, 2005, section 5.1.9).
fn segment_distance(a: Vector, b: Vector, c: Vector, d: Vector) -> Real {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, vv, uv) = (u.length_squared(), v.length_squared(), u.dot(v));
    let (uw, vw) = (u.dot(w), v.dot(w));
    let determinant = uu * vv - uv * uv;
    let mut s = if determinant > 1e-14 * uu * vv { ((uv * vw - uw * vv) / determinant).clamp(0.0, 1.0) } else { 0.0 };
    let mut t = if vv > 0.0 { (uv * s + vw) / vv } else { 0.0 };
    if !(0.0..=1.0).contains(&t) || vv == 0.0 {
        t = t.clamp(0.0, 1.0);
        s = if uu > 0.0 { ((uv * t - uw) / uu).clamp(0.0, 1.0) } else { 0.0 };
    }
    (w + u * s - v * t).length()
}

/// Number of sphere pairs stored as the nearest that do not touch.
pub(crate) const NEAREST: usize = 4;

/// The nearest sphere pairs of two grains that do not touch: while all others are known to be
/// farther, only these need be measured again.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NearestSpheres {
    pub count: u32,
    /// Those beyond `count` are spheres of the two grains too.
    pub spheres: [(u16, u16); NEAREST],
    /// Sum of the grains' travels at which another sphere pair could touch.
    pub rest: Real,
}

impl NearestSpheres {
    /// Adds a sphere pair that has just parted.
    pub fn add(&mut self, spheres: (u16, u16)) {
        let count = self.count as usize;
        if self.spheres[..count].contains(&spheres) {
        } else if count < NEAREST {
            self.spheres[count] = spheres;
            self.count += 1;
        } else {
            // No room: the next search measures all of them.
            self.rest = Real::NEG_INFINITY;
        }
    }
}

/// Work space of a search.
#[derive(Clone, Debug, Default)]
pub(crate) struct SphereSearch {
    first: Candidates,
    second: Candidates,
    gaps: Vec<Real>,
    /// Spheres `(A, B)` that touch or are about to, in order.
    pub found: Vec<(u16, u16)>,
    /// The nearest of the others with their gaps \[m], by gap.
    nearest: [(Real, (u16, u16)); NEAREST],
    count: usize,
    /// Gap that all the rest have at least \[m].
    rest: Real,
}

/// Spheres of one grain that may be near the other grain.
#[derive(Clone, Debug, Default)]
struct Candidates {
    count: usize,
    index: Vec<u16>,
    x: Vec<Real>,
    y: Vec<Real>,
    z: Vec<Real>,
    radius: Vec<Real>,
    excess: Vec<Real>,
}

/// Contact spheres of a body, component by component.
#[derive(Clone, Debug)]
pub(crate) struct SphereArrays {
    x: Vec<Real>,
    y: Vec<Real>,
    z: Vec<Real>,
    radius: Vec<Real>,
}

impl SphereArrays {
    pub fn new(body: &Body) -> Self {
        let component = |d: usize| body.centres.iter().map(|c| c[d]).collect();
        Self { x: component(0), y: component(1), z: component(2), radius: body.radii.clone() }
    }
}

impl Candidates {
    /// Selects the spheres, moved by `turn` and `shift` after scaling, that come within `cut_off` of a capsule \[m].
    fn take(
        &mut self,
        spheres: &SphereArrays,
        scale: Real,
        turn: &Matrix,
        shift: Vector,
        capsule: &PlacedCapsule,
        cut_off: Real,
    ) {
        let n = spheres.x.len();
        if self.index.len() < n {
            self.index.resize(n, 0);
            for v in [&mut self.x, &mut self.y, &mut self.z, &mut self.radius, &mut self.excess] {
                v.resize(n, 0.0);
            }
        }
        let m = *turn * scale;
        let axis = capsule.end - capsule.start;
        let inverse = if axis.length_squared() > 0.0 { axis.length_squared().recip() } else { 0.0 };
        let (x, y, z) = (&mut self.x[..n], &mut self.y[..n], &mut self.z[..n]);
        let (radius, excess) = (&mut self.radius[..n], &mut self.excess[..n]);
        let (sx, sy, sz, sr) = (&spheres.x[..n], &spheres.y[..n], &spheres.z[..n], &spheres.radius[..n]);
        for k in 0..n {
            let (a, b, c) = (sx[k], sy[k], sz[k]);
            x[k] = m.x_axis.x * a + m.y_axis.x * b + m.z_axis.x * c + shift.x;
            y[k] = m.x_axis.y * a + m.y_axis.y * b + m.z_axis.y * c + shift.y;
            z[k] = m.x_axis.z * a + m.y_axis.z * b + m.z_axis.z * c + shift.z;
            radius[k] = sr[k] * scale;
            let (px, py, pz) = (x[k] - capsule.start.x, y[k] - capsule.start.y, z[k] - capsule.start.z);
            let along = (px * axis.x + py * axis.y + pz * axis.z) * inverse;
            let along = if along > 0.0 { along } else { 0.0 };
            let along = if along < 1.0 { along } else { 1.0 };
            let (px, py, pz) = (px - along * axis.x, py - along * axis.y, pz - along * axis.z);
            let limit = radius[k] + capsule.radius + cut_off;
            excess[k] = px * px + py * py + pz * pz - limit * limit;
        }
        let mut count = 0;
        for k in 0..n {
            // Kept in place, front to back; what is overwritten has been read.
            self.index[count] = k as u16;
            (self.x[count], self.y[count], self.z[count]) = (self.x[k], self.y[k], self.z[k]);
            self.radius[count] = self.radius[k];
            count += usize::from(self.excess[k] < 0.0);
        }
        self.count = count;
    }
}

impl SphereSearch {
    /// Finds all sphere pairs of grains `i` and `j` with a gap below `touch`, and returns a lower
    /// bound, at most `cut_off` or the bound of the capsules, of the gaps of the others \[m].
    /// Each with its rotation and scale; `offset` points from `i` to `j`.
    pub fn find(
        &mut self,
        [i, j]: [(&Body, &SphereArrays, &Matrix, Real); 2],
        offset: Vector,
        cut_off: Real,
        touch: Real,
    ) -> Real {
        self.found.clear();
        self.count = 0;
        let capsules = [i, j].map(|(body, _, rotation, scale)| PlacedCapsule::new(&body.capsule, rotation, scale));
        let bound = capsules[0].gap(&capsules[1], offset);
        if bound >= cut_off {
            self.rest = bound;
            return bound;
        }
        // Everything relative to j, in j's axes: j's spheres then need no rotation.
        let back = j.2.transpose();
        let turn = back * *i.2;
        let shift = -(back * offset);
        let capsule_i = PlacedCapsule {
            start: back * capsules[0].start + shift,
            end: back * capsules[0].end + shift,
            ..capsules[0]
        };
        let capsule_j = PlacedCapsule::new(&j.0.capsule, &Matrix::IDENTITY, j.3);
        self.first.take(i.1, i.3, &turn, shift, &capsule_j, cut_off);
        self.second.take(j.1, j.3, &Matrix::IDENTITY, Vector::ZERO, &capsule_i, cut_off);
        self.compare(cut_off, touch);
        if self.count > 0 { self.nearest[0].0 } else { self.rest }
    }

    /// Nearest spheres of the last search; `sum` is the sum of the two travels \[m].
    pub fn nearest(&self, sum: Real, slack: Real) -> NearestSpheres {
        let spheres = std::array::from_fn(|n| if n < self.count { self.nearest[n].1 } else { (0, 0) });
        NearestSpheres { count: self.count as u32, spheres, rest: sum + (self.rest - slack).max(0.0) }
    }

    /// Nearest spheres of the last search; where some touch the first of those.
    pub fn closest(&self) -> Option<(u16, u16)> {
        self.found.first().copied().or((self.count > 0).then(|| self.nearest[0].1))
    }

    fn compare(&mut self, cut_off: Real, touch: Real) {
        self.rest = cut_off;
        let n = self.second.count;
        if self.gaps.len() < n {
            self.gaps.resize(n, 0.0);
        }
        for k in 0..self.first.count {
            let (a, b) = (&self.first, &self.second);
            let (x, y, z, r) = (a.x[k], a.y[k], a.z[k], a.radius[k]);
            let number = a.index[k];
            let gaps = &mut self.gaps[..n];
            let (bx, by, bz, br) = (&b.x[..n], &b.y[..n], &b.z[..n], &b.radius[..n]);
            for l in 0..n {
                let (dx, dy, dz) = (bx[l] - x, by[l] - y, bz[l] - z);
                gaps[l] = (dx * dx + dy * dy + dz * dz).sqrt() - (r + br[l]);
            }
            for l in 0..n {
                let gap = self.gaps[l];
                if gap < self.rest {
                    let spheres = (number, self.second.index[l]);
                    if gap < touch { self.found.push(spheres) } else { self.keep(gap, spheres) }
                }
            }
        }
    }

    /// Enters a sphere pair among the nearest; what falls out bounds the rest.
    fn keep(&mut self, gap: Real, spheres: (u16, u16)) {
        if self.count == NEAREST {
            let last = self.nearest[NEAREST - 1].0;
            if gap >= last {
                self.rest = self.rest.min(gap);
                return;
            }
            self.rest = self.rest.min(last);
            self.count -= 1;
        }
        let mut at = self.count;
        while at > 0 && self.nearest[at - 1].0 > gap {
            self.nearest[at] = self.nearest[at - 1];
            at -= 1;
        }
        self.nearest[at] = (gap, spheres);
        self.count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sazanami_numerics::Quaternion;

    fn rotation(angle: Real) -> Matrix {
        let axis = Vector::new(angle.sin(), 0.4, angle.cos()).normalize();
        Matrix::from_quat(Quaternion::from_axis_angle(axis, 3.0 * angle))
    }

    #[test]
    fn the_search_finds_what_all_pairs_find() {
        let body = Body::prolate(0.26, 0.635, 9);
        let arrays = SphereArrays::new(&body);
        let mut near = SphereSearch::default();
        let (mut touching, mut apart) = (0, 0);
        for n in 0..400 {
            let angle = Real::from(n) * 0.7;
            let (i, j) = (rotation(angle), rotation(1.3 * angle + 0.2));
            let offset = Vector::new(0.9 * angle.sin(), 0.8 * (1.7 * angle).cos(), 0.5 + 0.6 * (2.1 * angle).sin());
            let bound = near.find([(&body, &arrays, &i, 1.0), (&body, &arrays, &j, 1.2)], offset, 0.1, 1e-9);
            let mut expected = Vec::new();
            let mut least = 0.1_f64;
            for a in 0..9 {
                for b in 0..9 {
                    let p = i * body.centres[a];
                    let q = j * body.centres[b] * 1.2 + offset;
                    let gap = (q - p).length() - body.radii[a] - body.radii[b] * 1.2;
                    if gap < 1e-9 {
                        expected.push((a as u16, b as u16));
                    } else {
                        least = least.min(gap);
                    }
                }
            }
            assert_eq!(near.found, expected);
            if bound < 0.1 {
                assert!((bound - least).abs() < 1e-12);
            } else {
                assert!(least >= 0.1);
                apart += 1;
            }
            touching += usize::from(!expected.is_empty());
        }
        assert!(touching > 20 && apart > 20, "{touching} {apart}");
    }

    #[test]
    fn segments_know_their_distance() {
        let d = |a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]| {
            segment_distance(Vector::from_array(a), Vector::from_array(b), Vector::from_array(c), Vector::from_array(d))
        };
        assert!((d([0., 0., 0.], [1., 0., 0.], [0.5, -1., 2.], [0.5, 1., 2.]) - 2.0).abs() < 1e-14);
        assert!((d([0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [3., 0., 0.]) - 1.0).abs() < 1e-14);
        assert!((d([0., 0., 0.], [1., 0., 0.], [0.2, 3., 0.], [0.7, 3., 0.]) - 3.0).abs() < 1e-14);
        assert!((d([0., 0., 0.], [0., 0., 0.], [0., 3., 0.], [0., 4., 0.]) - 3.0).abs() < 1e-14);
    }
}
