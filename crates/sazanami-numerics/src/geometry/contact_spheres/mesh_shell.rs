//! Equal spheres touching any closed surface from inside.
//!
//! From every sample of the surface a ball of the asked radius is set below and pushed away from whatever it
//! cuts until it fits; where it fits it is a candidate. Candidates are chosen one by one where the surface is
//! farthest from the spheres so far, then moved to the middle of the part of the surface each serves.

use super::{ContactSphereError, largest_gap};
use crate::geometry::SurfaceMesh;
use crate::geometry::bounding_tree::BoundingTree;
use crate::{Real, Vector};

/// Radii tried, as shares of the largest ball that fits, when none is given.
const RADII: [Real; 6] = [0.8, 0.6, 0.45, 0.35, 0.25, 0.18];
const PUSHES: usize = 60;
const LLOYD_STEPS: usize = 12;

pub(super) fn place(
    surface: &SurfaceMesh,
    tree: &BoundingTree,
    count: usize,
    radius: Option<Real>,
) -> Result<Vec<(Vector, Real)>, ContactSphereError> {
    let samples = surface.samples((30 * count).max(2000));
    let limit = largest_ball(surface, tree, &samples);
    if let Some(radius) = radius {
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(ContactSphereError::BadSphere { index: 0, radius });
        }
        if radius > limit {
            return Err(ContactSphereError::RadiusTooLarge { radius, limit });
        }
        return choose(surface, tree, &samples, count, radius);
    }
    let points: Vec<Vector> = samples.iter().map(|s| s.0).collect();
    let mut best: Option<(Real, Vec<(Vector, Real)>)> = None;
    let mut refusal = ContactSphereError::RadiusTooLarge { radius: 0.0, limit };
    for share in RADII {
        match choose(surface, tree, &samples, count, share * limit) {
            Ok(spheres) => {
                let gap = largest_gap(&points, &spheres);
                if best.as_ref().is_none_or(|b| gap < b.0) {
                    best = Some((gap, spheres));
                }
            }
            Err(error) => refusal = error,
        }
    }
    best.map(|b| b.1).ok_or(refusal)
}

/// Radius of the largest ball inside the surface that touches it at one of the samples (shrinking balls, Ma, Bae and
/// Choi, 2012).
fn largest_ball(surface: &SurfaceMesh, tree: &BoundingTree, samples: &[(Vector, Vector)]) -> Real {
    let extent = surface.nodes.iter().map(|p| p.distance(surface.nodes[0])).fold(0.0, Real::max);
    let stride = (samples.len() / 500).max(1);
    let ball = |&(p, normal): &(Vector, Vector)| {
        let mut radius = extent;
        for _ in 0..40 {
            let centre = p - radius * normal;
            let q = surface.closest_point(tree, centre);
            let depth = normal.dot(p - q);
            if q.distance(centre) >= radius * (1.0 - 1e-9) || depth <= 0.0 {
                break;
            }
            radius = p.distance_squared(q) / (2.0 * depth);
        }
        radius
    };
    samples.iter().step_by(stride).map(ball).fold(0.0, Real::max)
}

/// Centre \[m] of a ball of `radius` set below the sample and pushed clear of the surface; `None` if it stays outside.
fn candidate(surface: &SurfaceMesh, tree: &BoundingTree, sample: &(Vector, Vector), radius: Real) -> Option<Vector> {
    let mut centre = sample.0 - radius * sample.1;
    if !surface.contains(centre) {
        return None;
    }
    for _ in 0..PUSHES {
        let nearest = surface.closest_point(tree, centre);
        let distance = centre.distance(nearest);
        if distance >= radius * (1.0 - 1e-7) {
            return surface.contains(centre).then_some(centre);
        }
        centre = nearest + radius * (centre - nearest).try_normalize()?;
    }
    None
}

fn choose(
    surface: &SurfaceMesh,
    tree: &BoundingTree,
    samples: &[(Vector, Vector)],
    count: usize,
    radius: Real,
) -> Result<Vec<(Vector, Real)>, ContactSphereError> {
    let candidates: Vec<Vector> = samples.iter().filter_map(|s| candidate(surface, tree, s, radius)).collect();
    let places = BoundingTree::of_points(&candidates);
    let points: Vec<Vector> = samples.iter().map(|s| s.0).chain(surface.nodes.iter().copied()).collect();
    let mut chosen = farthest_first(&points, &candidates, &places, count, radius)?;
    let with_radius =
        |chosen: &[usize]| -> Vec<(Vector, Real)> { chosen.iter().map(|&i| (candidates[i], radius)).collect() };
    let mut best = with_radius(&chosen);
    let mut gap = largest_gap(&points, &best);
    for _ in 0..LLOYD_STEPS {
        chosen = recentred(&points, &candidates, &places, &chosen);
        let spheres = with_radius(&chosen);
        let found = largest_gap(&points, &spheres);
        if found < gap {
            (best, gap) = (spheres, found);
        }
    }
    Ok(best)
}

/// Each time the candidate nearest to the point of the surface that is worst served.
fn farthest_first(
    points: &[Vector],
    candidates: &[Vector],
    places: &BoundingTree,
    count: usize,
    radius: Real,
) -> Result<Vec<usize>, ContactSphereError> {
    let mut taken = vec![false; candidates.len()];
    let mut to_point = vec![Real::INFINITY; points.len()];
    let mut to_candidate = vec![Real::INFINITY; candidates.len()];
    let mut chosen = Vec::with_capacity(count);
    while chosen.len() < count {
        let worst = points[index_of_largest(&to_point)];
        let nearest = places.nearest_point(worst).map(|found| found.0);
        let apart = 1e-6 * radius * radius;
        let next = match nearest {
            Some(i) if !taken[i] && to_candidate[i] > apart => i,
            // Nothing serves that point better: fill the largest hole between the spheres instead.
            Some(_) => index_of_largest(&to_candidate),
            None => return Err(ContactSphereError::TooMany { count, places: 0, radius }),
        };
        if to_candidate[next] <= apart {
            return Err(ContactSphereError::TooMany { count, places: chosen.len(), radius });
        }
        taken[next] = true;
        chosen.push(next);
        let centre = candidates[next];
        for (distance, p) in to_point.iter_mut().zip(points) {
            *distance = distance.min(p.distance_squared(centre));
        }
        for (distance, p) in to_candidate.iter_mut().zip(candidates) {
            *distance = distance.min(p.distance_squared(centre));
        }
    }
    Ok(chosen)
}

/// For each chosen candidate the one whose farthest served point is nearest to the middle of its part.
fn recentred(points: &[Vector], candidates: &[Vector], places: &BoundingTree, chosen: &[usize]) -> Vec<usize> {
    let mut lower = vec![Vector::INFINITY; chosen.len()];
    let mut upper = vec![Vector::NEG_INFINITY; chosen.len()];
    let centres: Vec<Vector> = chosen.iter().map(|&i| candidates[i]).collect();
    let centres = BoundingTree::of_points(&centres);
    for &p in points {
        let nearest = centres.nearest_point(p).map_or(0, |found| found.0);
        lower[nearest] = lower[nearest].min(p);
        upper[nearest] = upper[nearest].max(p);
    }
    let mut moved: Vec<usize> = Vec::with_capacity(chosen.len());
    for (i, &old) in chosen.iter().enumerate() {
        let middle = 0.5 * (lower[i] + upper[i]);
        let best = Some(middle).filter(|middle| middle.is_finite()).and_then(|middle| places.nearest_point(middle));
        match best {
            Some((new, _)) if !moved.contains(&new) && !chosen[i + 1..].contains(&new) => moved.push(new),
            _ => moved.push(old),
        }
    }
    moved
}

fn index_of_largest(values: &[Real]) -> usize {
    values.iter().enumerate().fold((0, Real::NEG_INFINITY), |best, (i, &v)| if v > best.1 { (i, v) } else { best }).0
}
