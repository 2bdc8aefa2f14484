//! The plane in a cell, and the liquid in a slab of the cell.
//!
//! In cell coordinates (the unit cube) the liquid is where `m . x <= alpha`. The relations between
//! `alpha` and the liquid volume are those of Scardovelli and Zaleski (2000), J. Comput. Phys. 164,
//! written such that no term cancels when a component of `m` is tiny.

use sazanami_numerics::{Real, Vector};

use super::{Neighbourhood, mixed_normal};

/// Volume of the unit cube below `m . x = alpha` for a normal without negative components.
#[must_use]
pub fn volume_below(m: [Real; 3], alpha: Real) -> Real {
    let sum = m[0] + m[1] + m[2];
    if alpha <= 0.0 {
        return 0.0;
    }
    if alpha >= sum {
        return 1.0;
    }
    let m = sorted(m.map(|v| v / sum));
    let a = alpha / sum;
    if a <= 0.5 { lower_half(m, a) } else { 1.0 - lower_half(m, 1.0 - a) }
}

/// The `alpha` at which `volume_below(m, alpha)` is `volume`, between 0 and the sum of `m`.
#[must_use]
pub fn plane_constant(m: [Real; 3], volume: Real) -> Real {
    let sum = m[0] + m[1] + m[2];
    let m = sorted(m.map(|v| v / sum));
    sum * if volume <= 0.5 {
        lower_constant(m, volume.max(0.0))
    } else {
        1.0 - lower_constant(m, (1.0 - volume).max(0.0))
    }
}

/// Components of the normal below this count as zero, and change the volume by as much at most: the products of smaller ones vanish, and
/// with them the denominators of the relations. Traces of liquid in the cells around have such.
const FLAT: Real = 1e-100;

/// The components of a normal that sum to one, in ascending order.
fn sorted(m: [Real; 3]) -> [Real; 3] {
    let [a, b, c] = m.map(|v| if v < FLAT { 0.0 } else { v });
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), low.max(c.min(high)), high.max(c)]
}

/// Volume for `m1 <= m2 <= m3`, `m1 + m2 + m3 = 1`, `0 <= a <= 1/2`.
fn lower_half([m1, m2, m3]: [Real; 3], a: Real) -> Real {
    let m12 = m1 + m2;
    if a < m1 {
        a * a * a / (6.0 * m1 * m2 * m3)
    } else if a < m2 {
        a * (a - m1) / (2.0 * m2 * m3) + m1 * m1 / (6.0 * m2 * m3)
    } else if a < m12 || m3 < m12 {
        // Two corners are cut off, and a third where a > m3; a - m2 is never much larger than m1.
        let cut = (a - m2).powi(3) + (a - m3).max(0.0).powi(3);
        a * (a - m1) / (2.0 * m2 * m3) + m1 * m1 / (6.0 * m2 * m3) - cut / (6.0 * m1 * m2 * m3)
    } else {
        (a - 0.5 * m12) / m3
    }
}

/// Inverse of [`lower_half`] for `0 <= volume <= 1/2`.
fn lower_constant(m: [Real; 3], volume: Real) -> Real {
    let [m1, m2, m3] = m;
    let m12 = m1 + m2;
    if volume < lower_half(m, m1) {
        return (6.0 * m1 * m2 * m3 * volume).cbrt().min(m1);
    }
    if m12 <= m3 && volume >= lower_half(m, m12) {
        return (m3 * volume + 0.5 * m12).min(0.5);
    }
    // As long as a < m2; beyond, the volume is smaller than this formula's and convex, so that
    // Newton's steps come from one side after the first.
    let mut a = 0.5 * (m1 + (m1 * m1 + 8.0 * m2 * m3 * (volume - m1 * m1 / (6.0 * m2 * m3))).max(0.0).sqrt());
    if a <= m2 {
        return a;
    }
    let end = if m12 <= m3 { m12 } else { 0.5 };
    for _ in 0..30 {
        let cut = (a - m2).powi(2) + (a - m3).max(0.0).powi(2);
        let area = (2.0 * a - m1) / (2.0 * m2 * m3) - cut / (2.0 * m1 * m2 * m3);
        let step = (volume - lower_half(m, a)) / area;
        a = (a + step).clamp(m2, end);
        if step.abs() <= 2e-16 {
            break;
        }
    }
    a
}

/// The interface in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Normal out of the liquid in cell coordinates, absolute components summing to one.
    normal: [Real; 3],
    /// Plane constant after the directions in which the normal is negative are mirrored.
    constant: Real,
}

impl Plane {
    /// The plane in the centre of `cells` that holds its liquid; `None` if all fractions are equal.
    #[must_use]
    pub fn through(cells: &Neighbourhood) -> Option<Self> {
        let normal = mixed_normal(cells)?;
        Some(Self { normal, constant: plane_constant(normal.map(Real::abs), cells[13]) })
    }

    /// Liquid in the slab of width `|courant|` at the upper face of `direction` (lower if
    /// `courant` is negative), signed like `courant`.
    #[must_use]
    pub fn donated(&self, direction: usize, courant: Real) -> Real {
        let width = courant.abs();
        let mut m = self.normal.map(Real::abs);
        let at_upper_end = (courant > 0.0) == (self.normal[direction] >= 0.0);
        let offset = if at_upper_end { m[direction] * (1.0 - width) } else { 0.0 };
        m[direction] *= width;
        courant * volume_below(m, self.constant - offset)
    }

    /// Share of the upper or the lower face of `direction` that lies in the liquid.
    #[must_use]
    pub fn share_of_face(&self, direction: usize, upper: bool) -> Real {
        let mut m = self.normal.map(Real::abs);
        let at_upper_end = upper == (self.normal[direction] >= 0.0);
        let below = self.constant - if at_upper_end { m[direction] } else { 0.0 };
        m[direction] = 0.0;
        if m == [0.0; 3] { Real::from(u8::from(below > 0.0)) } else { volume_below(m, below) }
    }

    /// The piece of the plane in a cell with these edges \[m]; `None` if the plane only touches the cell.
    #[must_use]
    pub fn facet(&self, edges: Vector) -> Option<Facet> {
        let m = self.normal.map(Real::abs);
        let mut corners = [Vector::ZERO; 6];
        let mut count = 0;
        for edge in 0..12 {
            let d = edge / 4;
            let (e, f) = ((d + 1) % 3, (d + 2) % 3);
            let mut corner = Vector::ZERO;
            (corner[e], corner[f]) = (Real::from(edge as u8 & 1), Real::from(edge as u8 >> 1 & 1));
            let below = self.constant - m[e] * corner[e] - m[f] * corner[f];
            // From one end of the edge to the other the plane is crossed once, or not.
            if count < 6 && (0.0 <= below) != (m[d] <= below) {
                corner[d] = below / m[d];
                corners[count] = corner;
                count += 1;
            }
        }
        let corners = &mut corners[..count];
        if count < 3 {
            return None;
        }
        for corner in &mut *corners {
            for d in 0..3 {
                corner[d] = edges[d] * if self.normal[d] < 0.0 { 1.0 - corner[d] } else { corner[d] };
            }
        }
        let normal = (Vector::from_array(self.normal) / edges).normalize();
        let middle = corners.iter().sum::<Vector>() / count as Real;
        let (along, across) = normal.any_orthonormal_pair();
        let angle = |p: &Vector| (across.dot(*p - middle)).atan2(along.dot(*p - middle));
        corners.sort_unstable_by(|p, q| angle(p).total_cmp(&angle(q)));
        let (mut area, mut moment) = (0.0, Vector::ZERO);
        for n in 0..count {
            let (p, q) = (corners[n], corners[(n + 1) % count]);
            let part = 0.5 * normal.dot((p - middle).cross(q - middle));
            area += part;
            moment += part * (middle + p + q) / 3.0;
        }
        (area > 0.0).then(|| Facet { area, centre: moment / area, normal })
    }
}

/// A piece of the interface in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Its area [m^2].
    pub area: Real,
    /// Its centre of area, from the lower corner of the cell \[m].
    pub centre: Vector,
    /// Unit normal out of the liquid.
    pub normal: Vector,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normals() -> Vec<[Real; 3]> {
        let values: [Real; 9] = [0.0, 3e-224, 1e-160, 1e-13, 1e-7, 1e-3, 0.2, 0.33, 1.0];
        let mut all = Vec::new();
        for a in values {
            for b in values {
                for c in values {
                    if a + b + c > 1e-2 {
                        let sum = a + b + c;
                        all.push([a / sum, b / sum, c / sum]);
                    }
                }
            }
        }
        all
    }

    #[test]
    fn volume_and_plane_constant_are_inverse_to_each_other() {
        for m in normals() {
            for n in 0..=200 {
                let volume = Real::from(n) / 200.0;
                let back = volume_below(m, plane_constant(m, volume));
                assert!((back - volume).abs() < 3e-15, "{m:?} {volume}: {back}");
            }
        }
    }

    #[test]
    fn traces_around_a_cell_leave_its_liquid_finite() {
        let mut cells = [0.0; 27];
        (cells[13], cells[14], cells[16], cells[22], cells[4]) = (3e-224, 1e-196, 1e-196, 1.0, 7e-5);
        let plane = Plane::through(&cells).unwrap();
        for direction in 0..3 {
            for courant in [1e-300, 1e-160, -1e-3, 0.3] {
                let share = plane.donated(direction, courant) / courant;
                assert!((0.0..=1.0).contains(&share), "{direction} {courant}: {share}");
            }
        }
    }

    #[test]
    fn volumes_agree_with_sampling() {
        let n = 60;
        for m in [[0.1, 0.3, 0.6], [0.3, 0.33, 0.37], [0.02, 0.49, 0.49], [0.0, 0.4, 0.6]] {
            for alpha in [0.05, 0.2, 0.35, 0.45, 0.5, 0.7, 0.95] {
                let centre = |i: usize| (i as Real + 0.5) / n as Real;
                let below = (0..n * n * n)
                    .filter(|c| m[0] * centre(c % n) + m[1] * centre(c / n % n) + m[2] * centre(c / (n * n)) <= alpha)
                    .count();
                let sampled = below as Real / (n * n * n) as Real;
                assert!((volume_below(m, alpha) - sampled).abs() < 4e-3, "{m:?} {alpha}");
            }
        }
    }

    #[test]
    fn facets_have_the_area_by_which_the_volume_grows() {
        let edges = Vector::new(1.0, 2.0, 0.5);
        for m in [[0.2, -0.5, 0.3], [-0.1, -0.1, -0.8], [0.0, 1.0, 0.0], [0.6, 0.4, 0.0], [-0.34, 0.33, 0.33]] {
            for volume in [0.01, 0.2, 0.5, 0.7, 0.99] {
                let positive = m.map(Real::abs);
                let constant = plane_constant(positive, volume);
                let facet = Plane { normal: m, constant }.facet(edges).unwrap();
                // dV = A ds with the plane moved by ds = d(constant) / |grad|.
                let grad = (Vector::from_array(positive) / edges).length();
                let step = 1e-6;
                let grown = volume_below(positive, constant + step) - volume_below(positive, constant - step);
                let expected = grown / (2.0 * step) * grad * edges.element_product();
                assert!((facet.area / expected - 1.0).abs() < 1e-5, "{m:?} {volume}: {facet:?} {expected}");
                let place = facet.centre / edges;
                let mirrored = [0, 1, 2].map(|d| if m[d] < 0.0 { 1.0 - place[d] } else { place[d] });
                let on_plane: Real = (0..3).map(|d| positive[d] * mirrored[d]).sum();
                assert!((on_plane - constant).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn shares_of_faces_are_what_slabs_that_vanish_hold() {
        for m in [[0.2, -0.5, 0.3], [-0.1, -0.1, -0.8], [0.0, 1.0, 0.0], [0.6, 0.4, 0.0]] {
            for volume in [0.03, 0.5, 0.9] {
                let plane = Plane { normal: m, constant: plane_constant(m.map(Real::abs), volume) };
                for direction in 0..3 {
                    for (upper, courant) in [(true, 1e-7), (false, -1e-7)] {
                        let share = plane.share_of_face(direction, upper);
                        let held = plane.donated(direction, courant) / courant;
                        assert!((share - held).abs() < 1e-5, "{m:?} {volume} {direction} {upper}: {share} {held}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_slabs_of_a_cell_add_up_to_its_liquid() {
        for m in [[0.2, -0.5, 0.3], [-0.1, -0.1, -0.8], [0.0, 1.0, 0.0], [0.6, 0.4, 0.0]] {
            for volume in [1e-10, 0.03, 0.5, 0.9, 1.0 - 1e-12] {
                let plane = Plane { normal: m, constant: plane_constant(m.map(Real::abs), volume) };
                for direction in 0..3 {
                    let sum = plane.donated(direction, 0.3) - plane.donated(direction, -0.7);
                    assert!((sum - volume).abs() < 1e-15, "{m:?} {volume} {direction}: {sum}");
                }
            }
        }
    }
}
