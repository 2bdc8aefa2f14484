//! Equal spheres touching a spheroid from inside.
//!
//! Their centres lie on the parallel surface one radius below. They start on a Fibonacci spiral of equal areas and
//! are moved to the centroids of their Voronoi regions on that surface (Lloyd, 1982).

use std::f64::consts::PI;

use super::ContactSphereError;
use crate::geometry::Spheroid;
use crate::geometry::bounding_tree::BoundingTree;
use crate::{Real, Vector};

/// Radius over smallest semi-axis of the paper's grain: 0.075 mm / 0.26 mm.
const RADIUS_RATIO: Real = 0.075 / 0.26;
/// Distance in radii from neighbouring centres to the farthest point between them, below which spheres are kept.
const COVERED: Real = 1.2;
const LLOYD_STEPS: usize = 40;

pub(super) fn place(
    spheroid: &Spheroid,
    count: usize,
    radius: Option<Real>,
) -> Result<Vec<(Vector, Real)>, ContactSphereError> {
    let limit = spheroid.smallest_curvature_radius();
    if let Some(radius) = radius {
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(ContactSphereError::BadSphere { index: 0, radius });
        }
        if radius > limit {
            return Err(ContactSphereError::RadiusTooLarge { radius, limit });
        }
        let (centres, _) = spread_evenly(spheroid, count, radius);
        let places = distinct(&centres, 1e-3 * radius);
        if places < count {
            return Err(ContactSphereError::TooMany { count, places, radius });
        }
        return Ok(centres.into_iter().map(|c| (c, radius)).collect());
    }
    let largest = 0.95 * limit;
    let mut radius = (RADIUS_RATIO * spheroid.equatorial.min(spheroid.axial)).min(largest);
    loop {
        let (centres, covering) = spread_evenly(spheroid, count, radius);
        if covering < COVERED * radius || radius >= largest {
            return Ok(centres.into_iter().map(|c| (c, radius)).collect());
        }
        radius = (1.15 * radius).min(largest);
    }
}

/// Number of centres that lie farther than `gap` \[m] from all before them.
fn distinct(centres: &[Vector], gap: Real) -> usize {
    let is_apart = |&n: &usize| centres[..n].iter().all(|other| other.distance_squared(centres[n]) > gap * gap);
    (0..centres.len()).filter(is_apart).count()
}

/// Centres one radius below the surface, and the largest distance from a point there to the nearest of them.
fn spread_evenly(spheroid: &Spheroid, count: usize, radius: Real) -> (Vec<Vector>, Real) {
    let samples = spread(spheroid, radius, (80 * count).max(6000));
    let mut centres = spread(spheroid, radius, count);
    for _ in 0..LLOYD_STEPS {
        let mut sums = vec![(Vector::ZERO, 0_usize); count];
        let tree = BoundingTree::of_points(&centres);
        for &p in &samples {
            let i = tree.nearest_point(p).map_or(0, |found| found.0);
            sums[i].0 += p;
            sums[i].1 += 1;
        }
        for (centre, (sum, number)) in centres.iter_mut().zip(sums) {
            if number > 0 {
                *centre = onto(spheroid, radius, sum / number as Real);
            }
        }
    }
    let tree = BoundingTree::of_points(&centres);
    let covering = samples.iter().filter_map(|&p| tree.nearest_point(p)).map(|found| found.1).fold(0.0, Real::max);
    (centres, covering.sqrt())
}

/// `count` points on the surface `depth` below the spheroid, evenly by area on a Fibonacci spiral.
pub(in crate::geometry) fn spread(spheroid: &Spheroid, depth: Real, count: usize) -> Vec<Vector> {
    const PARTS: usize = 4096;
    let at = |i: usize| spheroid.meridian(PI * i as Real / PARTS as Real, depth);
    let mut cumulative = vec![0.0; PARTS + 1];
    for i in 0..PARTS {
        let ([x, r], [y, s]) = (at(i), at(i + 1));
        cumulative[i + 1] = cumulative[i] + (r + s).max(0.0) * (x - y).hypot(r - s);
    }
    let total = cumulative[PARTS];
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let mut part = 0;
    (0..count)
        .map(|i| {
            let target = total * (i as Real + 0.5) / count as Real;
            while part + 1 < PARTS && cumulative[part + 1] < target {
                part += 1;
            }
            let step = cumulative[part + 1] - cumulative[part];
            let share = if step > 0.0 { (target - cumulative[part]) / step } else { 0.5 };
            let [x, r] = spheroid.meridian(PI * (part as Real + share) / PARTS as Real, depth);
            let (sin, cos) = (golden * i as Real).sin_cos();
            Vector::new(x, r * cos, r * sin)
        })
        .collect()
}

/// Point of the surface `depth` below the spheroid nearest to `point`.
fn onto(spheroid: &Spheroid, depth: Real, point: Vector) -> Vector {
    let radial = point.y.hypot(point.z);
    let distance = |t: Real| {
        let [x, r] = spheroid.meridian(t, depth);
        (x - point.x).hypot(r - radial)
    };
    const PARTS: usize = 128;
    let step = PI / PARTS as Real;
    let start = (0..=PARTS)
        .map(|i| step * i as Real)
        .fold((0.0, Real::INFINITY), |best, t| if distance(t) < best.1 { (t, distance(t)) } else { best })
        .0;
    let (mut lower, mut upper) = ((start - step).max(0.0), (start + step).min(PI));
    for _ in 0..50 {
        let (p, q) = (lower + (upper - lower) / 3.0, upper - (upper - lower) / 3.0);
        if distance(p) < distance(q) {
            upper = q;
        } else {
            lower = p;
        }
    }
    let [x, r] = spheroid.meridian(0.5 * (lower + upper), depth);
    let scale = if radial > 0.0 { r / radial } else { 0.0 };
    Vector::new(x, scale * point.y, scale * point.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_reaches_the_offset_surface() {
        let spheroid = Spheroid { equatorial: 0.26, axial: 0.635 };
        for p in spread(&spheroid, 0.075, 50) {
            let q = onto(&spheroid, 0.075, 0.97 * p);
            let r = onto(&spheroid, 0.075, q);
            assert!(q.distance(r) < 1e-6);
            assert!(p.distance(onto(&spheroid, 0.075, p)) < 1e-6);
        }
    }

    #[test]
    fn spheres_in_one_place_are_refused() {
        let ball = Spheroid { equatorial: 3e-3, axial: 3e-3 };
        let refused = place(&ball, 75, Some(3e-3));
        assert!(matches!(refused, Err(ContactSphereError::TooMany { count: 75, places: 1, .. })), "{refused:?}");
        // Negative controls: one alone, and smaller ones.
        assert_eq!(place(&ball, 1, Some(3e-3)).map(|spheres| spheres.len()), Ok(1));
        assert_eq!(place(&ball, 75, Some(1e-3)).map(|spheres| spheres.len()), Ok(75));
    }

    #[test]
    fn the_spiral_spreads_by_area() {
        let sphere = Spheroid { equatorial: 1.0, axial: 1.0 };
        let points = spread(&sphere, 0.0, 10_000);
        let mean_square = points.iter().map(|p| p.x * p.x).sum::<Real>() / 10_000.0;
        assert!((mean_square - 1.0 / 3.0).abs() < 1e-4);
    }
}
