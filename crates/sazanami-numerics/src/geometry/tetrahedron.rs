//! One tetrahedron by its corners: volume, angles, shape, overlap with another.

use crate::{Real, Vector};

/// Faces of a positively oriented tetrahedron, normals outward; face `i` lies opposite node `FACES[i][3]`.
pub(super) const FACES: [[usize; 4]; 4] = [[1, 2, 3, 0], [0, 3, 2, 1], [0, 1, 3, 2], [0, 2, 1, 3]];

/// Volume [m^3], positive where the fourth corner lies on the side to which the normal of the first three points.
pub(super) fn signed_volume([a, b, c, d]: &[Vector; 4]) -> Real {
    (*b - *a).dot((*c - *a).cross(*d - *a)) / 6.0
}

const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

pub(super) fn longest_edge(corners: &[Vector; 4]) -> Real {
    EDGES.iter().map(|&[i, j]| (corners[i] - corners[j]).length()).fold(0.0, Real::max)
}

/// Outward unit normals of the four faces.
fn face_normals(corners: &[Vector; 4]) -> [Vector; 4] {
    FACES.map(|[a, b, c, _]| (corners[b] - corners[a]).cross(corners[c] - corners[a]).normalize_or_zero())
}

/// Smallest and largest angle between two faces \[degree].
pub(super) fn dihedral_range(corners: &[Vector; 4]) -> [Real; 2] {
    let normals = face_normals(corners);
    let mut range = [180.0, 0.0];
    for i in 0..4 {
        for j in i + 1..4 {
            let angle = 180.0 - normals[i].dot(normals[j]).clamp(-1.0, 1.0).acos().to_degrees();
            range = [Real::min(range[0], angle), Real::max(range[1], angle)];
        }
    }
    range
}

/// 3 (inscribed radius)/(circumscribed radius).
pub(super) fn radius_ratio(corners: &[Vector; 4]) -> Real {
    let [a, b, c, d] = *corners;
    let six_volumes = 6.0 * signed_volume(corners).abs();
    let area: Real =
        FACES.iter().map(|&[i, j, k, _]| 0.5 * (corners[j] - corners[i]).cross(corners[k] - corners[i]).length()).sum();
    let inscribed = 0.5 * six_volumes / area;
    let (u, v, w) = (b - a, c - a, d - a);
    let numerator = u.length_squared() * v.cross(w) + v.length_squared() * w.cross(u) + w.length_squared() * u.cross(v);
    let circumscribed = numerator.length() / (2.0 * six_volumes);
    if circumscribed > 0.0 { 3.0 * inscribed / circumscribed } else { 0.0 }
}

/// Whether two tetrahedra share a volume, by the separating-axis theorem; touching does not count.
pub(super) fn overlap(a: &[Vector; 4], b: &[Vector; 4]) -> bool {
    let tolerance = 1e-9 * longest_edge(a).min(longest_edge(b));
    let separated = |axis: Vector| {
        let range = |corners: &[Vector; 4]| {
            corners
                .iter()
                .map(|&p| axis.dot(p - a[0]))
                .fold((Real::INFINITY, Real::NEG_INFINITY), |(l, u), s| (l.min(s), u.max(s)))
        };
        let ((lower_a, upper_a), (lower_b, upper_b)) = (range(a), range(b));
        upper_a.min(upper_b) - lower_a.max(lower_b) <= tolerance
    };
    if face_normals(a).into_iter().chain(face_normals(b)).any(separated) {
        return false;
    }
    for [i, j] in EDGES {
        let edge_a = (a[j] - a[i]).normalize_or_zero();
        for [k, l] in EDGES {
            let axis = edge_a.cross((b[l] - b[k]).normalize_or_zero());
            if axis.length_squared() > 1e-12 && separated(axis.normalize()) {
                return false;
            }
        }
    }
    true
}
