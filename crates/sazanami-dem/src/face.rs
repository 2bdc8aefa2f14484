//! Flat faces: contact spheres that touch a plane at once.
//!
//! Faces are found as a body would come to lie on a plane: planes that touch three neighbouring spheres (two, one) and have
//! all others behind them. Spheres less than [`DEPTH`] of their radius behind such a plane touch it too once others overlap
//! it by as much.

use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use crate::modes::{Inertia, Modes};

/// Depth behind a plane, over the radius, up to which a sphere belongs to a face: grains are meant to overlap by a hundredth.
const DEPTH: Real = 0.01;
/// Nearest spheres of each among which the planes are sought.
const NEIGHBOURS: usize = 8;
/// Most spheres with which a rounded body meets a plane.
const ROUNDED: usize = 5;
/// Distance by which a sphere may stand out of a plane, over its radius: round-off.
const ROUND_OFF: Real = 1e-9;

/// What a body meets a plane with at most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Face {
    /// Largest number of contact spheres that touch a plane at once.
    pub spheres: usize,
    /// Outward normal of that plane.
    normal: Vector,
    /// Largest eigenvalue of the contacts of a face for a unit of stiffness along the normal, times the mass.
    along: Real,
    /// The same for a unit of stiffness in all directions.
    all: Real,
}

impl Face {
    /// The largest of all faces of a body of these contact spheres, in its principal axes.
    pub(crate) fn largest(volume: Real, inertia: Vector, centres: &[Vector], radii: &[Real]) -> Self {
        let unit = Inertia { inverse_mass: 1.0, inverse_moments: volume / inertia };
        let mut largest = Self::default();
        let mut touching = Vec::new();
        for first in 0..centres.len() {
            let mut last = (0, 0);
            for normal in normals(first, centres, radii) {
                let offset = normal.dot(centres[first]) + radii[first];
                let behind = |i: usize| (offset - normal.dot(centres[i]) - radii[i]) / radii[i];
                if (0..centres.len()).any(|i| behind(i) < -ROUND_OFF) {
                    continue;
                }
                touching.clear();
                touching.extend((0..centres.len()).filter(|&i| behind(i) < DEPTH));
                // A face is met once from each of its spheres, and often from the first.
                let same = (touching.len(), touching.iter().sum::<usize>());
                if touching[0] != first || same == last {
                    continue;
                }
                last = same;
                let [along, all] = [0.0, 1.0].map(|across| {
                    let mut modes = Modes::default();
                    touching.iter().for_each(|&i| {
                        modes.add(&unit, centres[i] + radii[i] * normal, normal, [1.0, across]);
                    });
                    modes.largest()
                });
                if touching.len() > largest.spheres {
                    (largest.spheres, largest.normal) = (touching.len(), normal);
                }
                (largest.along, largest.all) = (largest.along.max(along), largest.all.max(all));
            }
        }
        largest
    }

    /// Whether it is a flat face, and not the three or four spheres that a rounded body meets a plane with.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        self.spheres > ROUNDED
    }

    /// Places in the plane of the largest face and radii of its spheres \[m], of a body of these spheres times `scale`.
    pub(crate) fn flat(&self, centres: &[Vector], radii: &[Real], scale: Real) -> Vec<[Real; 3]> {
        let [x, y] = [self.normal.any_orthonormal_vector(), self.normal.cross(self.normal.any_orthonormal_vector())];
        let offset = |i: usize| self.normal.dot(centres[i]) + radii[i];
        let all = 0..centres.len();
        let outermost = all.clone().map(offset).fold(Real::NEG_INFINITY, Real::max);
        all.filter(|&i| outermost - offset(i) < DEPTH * radii[i])
            .map(|i| [x.dot(centres[i]), y.dot(centres[i]), radii[i]].map(|value| scale * value))
            .collect()
    }

    /// Bound on the largest eigenvalue of the contacts of a face, each of these stiffnesses or dashpots along and across
    /// the normal, times the mass: it is convex in them.
    pub(crate) fn mode(&self, [along, across]: [Real; 2]) -> Real {
        (along - across).max(0.0) * self.along + across * self.all
    }
}

/// Outward normals of planes that may touch sphere `first` and its neighbours.
fn normals(first: usize, centres: &[Vector], radii: &[Real]) -> Vec<Vector> {
    let (home, radius) = (centres[first], radii[first]);
    let mut near: Vec<usize> = (0..centres.len()).filter(|&i| i != first && centres[i] != home).collect();
    let distance = |i: usize| centres[i].distance_squared(home);
    let order = |a: &usize, b: &usize| distance(*a).total_cmp(&distance(*b)).then(a.cmp(b));
    if near.len() > NEIGHBOURS {
        near.select_nth_unstable_by(NEIGHBOURS, order);
        near.truncate(NEIGHBOURS);
    }
    near.sort_unstable_by(order);
    let outward = home.try_normalize().unwrap_or(Vector::Z);
    let mut all = vec![outward];
    for (n, &i) in near.iter().enumerate() {
        let a = centres[i] - home;
        // normal . a = radius - radii[i]
        let lean = |across: Vector| lean(a * ((radius - radii[i]) / a.length_squared()), across);
        let across = (outward - a * (outward.dot(a) / a.length_squared())).try_normalize();
        all.extend(lean(across.unwrap_or_else(|| a.any_orthonormal_vector())));
        for &j in &near[n + 1..] {
            let b = centres[j] - home;
            let cross = a.cross(b);
            let square = cross.length_squared();
            if square <= 1e-12 * a.length_squared() * b.length_squared() {
                continue;
            }
            let (to_i, to_j) = (radius - radii[i], radius - radii[j]);
            let within = (b.cross(cross) * to_i + cross.cross(a) * to_j) / square;
            let across = cross / square.sqrt();
            all.extend([across, -across].into_iter().filter_map(|across| self::lean(within, across)));
        }
    }
    all
}

/// The unit vector with the part `within` and the rest along `across`, which is perpendicular to it.
fn lean(within: Vector, across: Vector) -> Option<Vector> {
    let rest = 1.0 - within.length_squared();
    (rest >= 0.0).then(|| within + rest.sqrt() * across)
}

/// What spheres add to the friction of two faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bumps {
    /// Mean rise over the way of one face that slides on the other: the friction coefficient, where what it gained on each
    /// bump is lost behind it.
    pub friction: Real,
    /// Distance of a sphere from the next in the coarser face \[m]: where a face goes so far in the time of a fall by as much
    /// it flies from bump to bump, and loses more.
    pub pitch: Real,
}

/// Ways of one face on the other, steps on each, and their length over the pitch.
const WAYS: usize = 4;
const STEPS: usize = 150;
const LENGTH: Real = 3.0;

impl Bumps {
    /// Those of two faces ([`crate::Body::flat_face`]), as the one slides on the other without tilting.
    #[must_use]
    pub fn of(faces: [Vec<[Real; 3]>; 2]) -> Self {
        let pitch = faces.each_ref().map(|face| pitch(face)).into_iter().fold(0.0, Real::max);
        let golden = PI * (3.0 - 5.0_f64.sqrt());
        let rise = |way: usize| {
            let (sine, cosine) = (golden * way as Real).sin_cos();
            let start = [1, 2].map(|n| pitch * ((way + n) as Real * golden).fract());
            rise(&faces, start, [cosine, sine].map(|part| LENGTH * pitch * part))
        };
        let all: Real = (0..WAYS).map(rise).sum();
        Self { friction: all / (WAYS as Real * LENGTH * pitch), pitch }
    }
}

/// Sum of what the first face rises on the second from a start on a way, both relative to where they are given \[m].
fn rise(faces: &[Vec<[Real; 3]>; 2], start: [Real; 2], way: [Real; 2]) -> Real {
    let height = |n: usize| {
        let [x, y] = [0, 1].map(|d| start[d] + way[d] * n as Real / STEPS as Real);
        let gap = |a: &[Real; 3], b: &[Real; 3]| {
            let reach = a[2] + b[2];
            let square = reach * reach - (a[0] + x - b[0]).powi(2) - (a[1] + y - b[1]).powi(2);
            square.max(0.0).sqrt() - reach
        };
        let all = faces[0].iter().flat_map(|a| faces[1].iter().map(move |b| gap(a, b)));
        all.fold(Real::NEG_INFINITY, Real::max)
    };
    let heights: Vec<Real> = (0..=STEPS).map(height).collect();
    heights.windows(2).map(|pair| (pair[1] - pair[0]).max(0.0)).sum()
}

/// Largest distance of a sphere of a face from the next.
fn pitch(face: &[[Real; 3]]) -> Real {
    let next = |(n, a): (usize, &[Real; 3])| {
        let others = face.iter().enumerate().filter(|(m, _)| *m != n);
        others.map(|(_, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(Real::INFINITY, Real::min)
    };
    face.iter().enumerate().map(next).filter(|distance| distance.is_finite()).fold(0.0, Real::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Spheres of radius `r` in `n^3` places of a cube of edge 1 that they touch from inside, on its surface.
    fn block(n: usize, r: Real) -> (Vec<Vector>, Vec<Real>) {
        let at = |i: usize| -0.5 + r + (1.0 - 2.0 * r) * i as Real / (n - 1) as Real;
        let outer = |i: usize| i == 0 || i == n - 1;
        let all = (0..n * n * n).map(|m| [m % n, m / n % n, m / (n * n)]);
        let centres: Vec<Vector> =
            all.filter(|p| p.iter().any(|&i| outer(i))).map(|p| Vector::from_array(p.map(at))).collect();
        let radii = vec![r; centres.len()];
        (centres, radii)
    }

    #[test]
    fn a_block_meets_a_plane_with_all_spheres_of_a_face() {
        let (centres, radii) = block(6, 0.12);
        let face = Face::largest(1.0, Vector::splat(1.0 / 6.0), &centres, &radii);
        assert_eq!(face.spheres, 36);
        // Along the normal it rises with 36 k/m, or tilts with k sum x^2/I.
        let at = |i: i32| -0.5 + 0.12 + 0.76 * Real::from(i) / 5.0;
        let tilt = 6.0 * (0..6).map(|i| at(i).powi(2)).sum::<Real>() * 6.0;
        let expected = Real::max(36.0, tilt);
        assert!((1.0 - 1e-12..1.03).contains(&(face.mode([1.0, 0.0]) / expected)), "{}", face.mode([1.0, 0.0]));
        assert!(face.mode([1.0, 1.0]) > face.mode([1.0, 0.0]) && face.mode([1.0, 0.5]) < face.mode([1.0, 1.0]));
        assert!((face.mode([3.0, 0.0]) / face.mode([1.0, 0.0]) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn rounded_bodies_meet_it_with_few() {
        let ball = Face::largest(1.0, Vector::splat(0.1), &[Vector::ZERO], &[0.5]);
        assert_eq!(ball.spheres, 1);
        // Spheres spread over a ball of radius 1: an octahedron and its edges' middles.
        let corners = Vector::AXES.into_iter().chain(Vector::AXES.map(|axis| -axis));
        let centres: Vec<Vector> = corners.collect();
        let round = Face::largest(1.0, Vector::splat(0.1), &centres, &[0.3; 6]);
        assert_eq!(round.spheres, 3, "{round:?}");
    }

    #[test]
    fn a_rod_lies_on_all_spheres_of_its_axis() {
        let centres: Vec<Vector> = (-4..=4).map(|n| Vector::new(0.0, 0.0, Real::from(n))).collect();
        let rod = Face::largest(1.0, Vector::new(1.0, 1.0, 0.1), &centres, &[0.6; 9]);
        assert_eq!(rod.spheres, 9, "{rod:?}");
        // Negative control: one that tapers rests on a few in its middle.
        let radii: Vec<Real> = (-4..=4).map(|n| 0.6 - 0.01 * Real::from(n * n)).collect();
        let spindle = Face::largest(1.0, Vector::new(1.0, 1.0, 0.1), &centres, &radii);
        assert!(spindle.spheres <= 2, "{spindle:?}");
    }

    #[test]
    fn a_row_that_slides_on_a_row_rises_once_a_distance() {
        let row: Vec<[Real; 3]> = (0..9).map(|n| [Real::from(n), 0.0, 1.0]).collect();
        let faces = [row.clone(), row];
        let found = rise(&faces, [0.2, 0.0], [3.0, 0.0]);
        // From the hollow, half a distance aside, to the top.
        let expected = 3.0 * (2.0 - (4.0_f64 - 0.25).sqrt());
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
        // Negative control: across the rows it only falls.
        assert!(rise(&faces, [0.0, 0.0], [0.0, 1.0]).abs() < 1e-12);
    }

    #[test]
    fn finer_bumps_rub_less_and_size_makes_no_difference() {
        let bumps = |n: usize, scale: Real| {
            let (centres, radii) = block(n, 0.1);
            let face = Face::largest(1.0, Vector::splat(1.0 / 6.0), &centres, &radii).flat(&centres, &radii, scale);
            Bumps::of([face.clone(), face])
        };
        let [coarse, fine, large] = [(5, 1.0), (9, 1.0), (5, 2.0)].map(|(n, scale)| bumps(n, scale));
        assert!((coarse.pitch - 0.2).abs() < 1e-9 && (large.pitch - 0.4).abs() < 1e-9, "{coarse:?} {large:?}");
        assert!(fine.friction < 0.7 * coarse.friction && fine.friction > 0.0, "{coarse:?} {fine:?}");
        assert!((large.friction / coarse.friction - 1.0).abs() < 1e-9);
    }
}
