//! Volume, centre of mass and principal inertia of uniform solids made of tetrahedra.
//!
//! For a tetrahedron with corners p_0..p_3 about the origin, the second moment is
//! integral x x^T dV = V/20 (sum_i p_i p_i^T + s s^T), s = sum_i p_i, and the inertia per unit density
//! is I = tr(S) 1 - S with S the sum of these.

use super::TetrahedralMesh;
use crate::{Matrix, Real, Vector};

/// Mass properties per unit density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Volume [m^3].
    pub volume: Real,
    /// Centre of mass \[m].
    pub centroid: Vector,
    /// Principal moments of inertia about the centre of mass per unit density [m^5].
    pub principal_inertia: Vector,
    /// Principal axes as columns of a rotation, in the order of `principal_inertia`; takes body
    /// coordinates to those of the mesh.
    pub axes: Matrix,
}

/// Moments that differ by less than this share of the largest count as equal.
const EQUAL: Real = 1e-9;

impl MassProperties {
    /// Sums the tetrahedra of `mesh`, whose orientation must be sound.
    ///
    /// The axes are those nearest to the axes the mesh is written in, so a mesh that is already in its
    /// principal frame stays as it is; within a plane or a sphere of equal moments likewise.
    #[must_use]
    pub fn of(mesh: &TetrahedralMesh) -> Self {
        let reference = mesh.nodes.iter().sum::<Vector>() / (mesh.nodes.len().max(1)) as Real;
        let mut volume = 0.0;
        let mut first = Vector::ZERO;
        let mut second = Matrix::ZERO;
        for t in 0..mesh.tetrahedra.len() {
            let corners = mesh.corners(t).map(|p| p - reference);
            let v = super::tetrahedron::signed_volume(&corners);
            let s: Vector = corners.iter().sum();
            volume += v;
            first += v / 4.0 * s;
            let outer = corners.iter().fold(outer_product(s), |sum, &p| sum + outer_product(p));
            second += outer * (v / 20.0);
        }
        let centroid = first / volume;
        second -= outer_product(centroid) * volume;
        let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
        let (principal_inertia, axes) = principal(Matrix::from_diagonal(Vector::splat(trace)) - second);
        Self { volume, centroid: reference + centroid, principal_inertia, axes }
    }
}

fn outer_product(p: Vector) -> Matrix {
    Matrix::from_cols(p * p.x, p * p.y, p * p.z)
}

/// Eigenvalues and right-handed eigenvectors (columns) of a symmetric matrix, nearest to the unit axes.
pub(super) fn principal(matrix: Matrix) -> (Vector, Matrix) {
    let (values, axes) = jacobi(matrix);
    let scale = values.abs().max_element();
    let equal = |i: usize, j: usize| (values[i] - values[j]).abs() <= EQUAL * scale;
    if equal(0, 1) && equal(1, 2) && equal(0, 2) {
        return (Vector::splat(values.element_sum() / 3.0), Matrix::IDENTITY);
    }
    let pair = [(0, 1, 2), (1, 2, 0), (2, 0, 1)].into_iter().find(|&(i, j, _)| equal(i, j));
    match pair {
        Some((i, j, single)) => about_axis(0.5 * (values[i] + values[j]), values[single], axes.col(single)),
        None => nearest_order(values, axes),
    }
}

/// Frame of a body of revolution with single axis `axis`: the rotation that takes the unit axis nearest to
/// `axis` there by the shortest way.
fn about_axis(equal: Real, single: Real, axis: Vector) -> (Vector, Matrix) {
    let magnitude = axis.abs();
    let k = (0..3).fold(0, |best, i| if magnitude[i] > magnitude[best] + 1e-12 { i } else { best });
    let unit = Vector::AXES[k];
    let axis = if axis[k] < 0.0 { -axis } else { axis };
    let cross = unit.cross(axis);
    let rotation = if cross.length() < 1e-9 {
        Matrix::IDENTITY
    } else {
        Matrix::from_quat(crate::Quaternion::from_rotation_arc(unit, axis.normalize()))
    };
    let mut values = Vector::splat(equal);
    values[k] = single;
    (values, rotation)
}

/// Orders and signs distinct axes so that they lie nearest to the unit axes and form a right hand.
fn nearest_order(values: Vector, axes: Matrix) -> (Vector, Matrix) {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let closeness = |order: &[usize; 3]| -> Real { (0..3).map(|i| axes.col(order[i])[i].abs()).sum() };
    let best = ORDERS.iter().fold(
        &ORDERS[0],
        |best, order| {
            if closeness(order) > closeness(best) + 1e-12 { order } else { best }
        },
    );
    let mut columns = best.map(|c| axes.col(c));
    for (i, column) in columns.iter_mut().enumerate() {
        if column[i] < 0.0 {
            *column = -*column;
        }
    }
    if columns[0].cross(columns[1]).dot(columns[2]) < 0.0 {
        let weakest = (0..3).fold(0, |w, i| if columns[i][i] < columns[w][w] { i } else { w });
        columns[weakest] = -columns[weakest];
    }
    let ordered = Vector::new(values[best[0]], values[best[1]], values[best[2]]);
    (ordered, Matrix::from_cols(columns[0], columns[1], columns[2]))
}

/// Cyclic Jacobi rotations by the smaller angle; off-diagonals at round-off are taken for zero.
fn jacobi(matrix: Matrix) -> (Vector, Matrix) {
    let mut a = matrix.to_cols_array_2d();
    let mut axes = Matrix::IDENTITY.to_cols_array_2d();
    let scale = (0..3).map(|i| a[i][i].abs()).fold(0.0, Real::max);
    for _ in 0..50 {
        let largest = a[0][1].abs().max(a[0][2].abs()).max(a[1][2].abs());
        if largest <= 1e-15 * scale {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].abs() <= 1e-16 * scale {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                (axes[p][k], axes[q][k]) = (c * axes[p][k] - s * axes[q][k], s * axes[p][k] + c * axes[q][k]);
            }
        }
    }
    (Vector::new(a[0][0], a[1][1], a[2][2]), Matrix::from_cols_array_2d(&axes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Quaternion;
    use crate::geometry::{SpheroidMesh, VolumeRule, box_mesh, spheroid_mesh};

    fn close(a: Vector, b: Vector, tolerance: Real) -> bool {
        (a - b).abs().max_element() <= tolerance * b.abs().max_element()
    }

    #[test]
    fn a_box_has_the_inertia_of_a_box() {
        let edges = Vector::new(1.0, 2.0, 3.0);
        let found = MassProperties::of(&box_mesh(edges));
        let expected = 6.0 / 12.0 * Vector::new(13.0, 10.0, 5.0);
        assert!((found.volume - 6.0).abs() < 1e-14);
        assert!(found.centroid.length() < 1e-15);
        assert!(close(found.principal_inertia, expected, 1e-14));
        assert!((found.axes - Matrix::IDENTITY).abs().to_cols_array().iter().all(|&e| e < 1e-14));
    }

    #[test]
    fn a_corner_tetrahedron_matches_the_integrals_by_hand() {
        let mesh = TetrahedralMesh {
            nodes: vec![Vector::ZERO, Vector::X, Vector::Y, Vector::Z],
            tetrahedra: vec![[0, 1, 2, 3]],
        };
        let found = MassProperties::of(&mesh);
        assert!((found.volume - 1.0 / 6.0).abs() < 1e-16);
        assert!((found.centroid - Vector::splat(0.25)).length() < 1e-15);
        // About the centroid: S_xx = 1/60 - 1/96 = 1/160, S_xy = 1/120 - 1/96 = -1/480;
        // I has eigenvalues tr S - (S_xx + 2 S_xy) = 1/60 along (1,1,1), tr S - (S_xx - S_xy) = 1/96 + ... twice.
        let (s_xx, s_xy) = (1.0 / 160.0, -1.0 / 480.0);
        let single = 3.0 * s_xx - (s_xx + 2.0 * s_xy);
        let double = 3.0 * s_xx - (s_xx - s_xy);
        let mut sorted = found.principal_inertia.to_array();
        sorted.sort_by(Real::total_cmp);
        assert!((sorted[0] - double).abs() < 1e-16 && (sorted[1] - double).abs() < 1e-16);
        assert!((sorted[2] - single).abs() < 1e-16);
        assert!((found.axes.determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_turned_and_moved_body_keeps_its_moments_and_gives_its_axes_back() {
        let turn = Quaternion::from_axis_angle(Vector::new(1.0, -2.0, 0.5).normalize(), 0.6);
        let shift = Vector::new(5.0, -3.0, 8.0);
        for mesh in [
            box_mesh(Vector::new(1.0, 2.0, 3.0)),
            spheroid_mesh(0.26, 0.635, SpheroidMesh::PAPER, VolumeRule::Inscribed),
        ] {
            let at_rest = MassProperties::of(&mesh);
            let moved = MassProperties::of(&mesh.mapped(|p| turn * p + shift));
            assert!((moved.centroid - shift).length() < 1e-13);
            assert!(close(moved.principal_inertia, at_rest.principal_inertia, 1e-11));
            assert!((moved.axes.determinant() - 1.0).abs() < 1e-12);
            // The body frame of the moved mesh diagonalises: recompute it there.
            let inverse = moved.axes.transpose();
            let back = MassProperties::of(&mesh.mapped(|p| inverse * (turn * p)));
            assert!(close(back.principal_inertia, at_rest.principal_inertia, 1e-11));
            assert!((back.axes - Matrix::IDENTITY).abs().to_cols_array().iter().all(|&e| e < 1e-8));
        }
    }

    #[test]
    fn equal_moments_leave_the_frame_alone() {
        let (values, axes) = principal(Matrix::from_diagonal(Vector::splat(2.0)));
        assert_eq!((values, axes), (Vector::splat(2.0), Matrix::IDENTITY));

        let mut noisy = Matrix::from_diagonal(Vector::new(1.0, 3.0, 3.0));
        noisy.y_axis.z = 1e-13;
        noisy.z_axis.y = 1e-13;
        let (values, axes) = principal(noisy);
        assert_eq!(axes, Matrix::IDENTITY);
        assert!(close(values, Vector::new(1.0, 3.0, 3.0), 1e-12));
    }

    #[test]
    fn distinct_moments_are_found_for_any_orientation() {
        for n in 0..40 {
            let angle = Real::from(n) * 0.37;
            let axis = Vector::new(angle.sin(), (2.0 * angle).cos(), 0.3 + (3.0 * angle).sin()).normalize();
            let turn = Matrix::from_axis_angle(axis, angle);
            let diagonal = Vector::new(1.0, 2.0, 4.0);
            let tensor = turn * Matrix::from_diagonal(diagonal) * turn.transpose();
            let (values, axes) = principal(tensor);
            let rebuilt = axes * Matrix::from_diagonal(values) * axes.transpose();
            assert!((rebuilt - tensor).abs().to_cols_array().iter().all(|&e| e < 1e-12));
            assert!((axes.determinant() - 1.0).abs() < 1e-12);
            assert!(axes.x_axis.x >= 0.0 || axes.y_axis.y >= 0.0);
        }
    }
}
