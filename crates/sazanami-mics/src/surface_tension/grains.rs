//! Grains that the interface meets at an angle: the liquid continued into them, and the pull of the line of contact.
//!
//! Within a grain the interface goes on straight at the contact angle theta, measured in the liquid: in a plane of the normal
//!
//! ```text
//! n = n_s cos(theta) + m sin(theta)
//! ```
//!
//! with the unit normal `n_s` out of the grain and the unit vector `m` along its surface out of the liquid. That is at the surface; the plane of a
//! cell beside it is turned by a quarter to the normal of the open cells around, and has the liquid of the open part of the cell. Cells further in
//! take the mean of those beside them, layer by layer. The
//! liquid fraction of whole cells that it gives is what heights, curvature and jumps of the pressure see. Liquid continued into the solid:
//! Afkhami and Bussmann (2008), Int. J. Numer. Meth. Fluids 57, 453; in cells that a surface cuts: Tavares, Josserand, Limare,
//! Lopez-Herrera and Popinet (2024), arXiv:2402.10185.
//!
//! The interface pulls at the line of contact with sigma a length along its own tangent `n_s sin(theta) - m cos(theta)`. With the liquid
//! fraction C, whose gradient along the surface is `g`, pointing to the liquid, that is over the surface S of the grain
//!
//! ```text
//! F = sigma int (n_s sin(theta) |g| + g cos(theta)) dS
//! ```
//!
//! It takes the place of what the jumps of the pressure would give the covered part of the cells.

use sazanami_numerics::domain::{Domain, Ghost, GhostRules, Location, Row};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Matrix, Real, Vector};

use super::heights::PURE;
use crate::boundary::Boundary;
use crate::interface::{plane_constant, volume_below};
use crate::mobility::RowSet;

/// Width in cells from which on grains have a contact angle.
pub const WIDE: Real = 4.0;
/// Layers of cells from the surface on that are given a plane: a column ends three cells beyond that of its height.
const LAYERS: usize = 6;
/// Open part from which on the liquid of a cell tells where its plane is, and heights its curvature.
pub(super) const TELLS: Real = 0.5;
/// Share of the normal of the open cells around in that of a plane: the interface is bent between them and the surface, where it has its angle. With
/// this share the impulse of surface tension on all fluid and grains is least (docs/decisions/0034-line-of-contact-on-grains.md).
const AROUND: Real = 0.25;
/// Open part from which on the continued fraction is at least the liquid in it.
const HOLDS: Real = 0.25;
/// Least gradient of the liquid fraction that is an interface [1/cell]: an interface that only touches a corner of the cell still has 0.4. Wisps of
/// liquid that grains leave beside them as they move have less, and no direction.
const STEEP: Real = 0.1;
/// Slices in which the liquid of a cell cut by two planes is summed.
const SLICES: u32 = 8;
/// Halvings in the search for a plane.
const HALVINGS: u32 = 24;
/// No plane, or none yet: no normal. The last value is then -1 in liquid, 1 in gas, 0 where that is not known.
const NO_PLANE: f32 = 0.0;

/// Planes in the cells, in coordinates that count cells: their unit normals out of the liquid, and the distance of the centre of the cell from
/// them, positive in gas.
type Planes = [Field<f32>; 4];

/// Edges of the cells over the shortest: angles are those of space, planes those of the cells.
#[derive(Clone, Copy)]
struct Edges(Vector);

impl Edges {
    /// The direction of a gradient, given in [1/cell], in space [1/shortest edge].
    fn in_space(self, gradient: Vector) -> Vector {
        gradient / self.0
    }

    /// Unit normal in coordinates that count cells of a plane with a normal in space.
    fn in_cells(self, normal: Vector) -> Option<Vector> {
        (normal * self.0).try_normalize()
    }
}

/// The liquid continued into grains.
pub(super) struct Continued {
    cosine: Real,
    sine: Real,
    edges: Edges,
    /// Liquid fraction of whole cells, with that of the planes in grains; all ghosts filled.
    liquid: Field<Real>,
    rules: GhostRules,
    planes: Planes,
    next: Planes,
    /// Of the grains that have an angle: solid fraction, one ghost layer filled, and surface over the volume of the cell [1/m].
    solid: [Field<Real>; 3],
    /// Rows with such grains and those beside them.
    rows: RowSet,
}

/// Behind sides of the box are no planes.
const NONE_BEHIND: GhostRules =
    GhostRules { location: Location::Cell, sides: [[Ghost::Constant { value: 0.0 }; 2]; 3] };

/// The 27 cells around one and including it, from that cell, and how far on in memory.
pub(super) fn around(strides: [isize; 3]) -> impl Iterator<Item = (Vector, isize)> {
    (0..27_isize).map(move |n| {
        let offset = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
        let by = offset.iter().zip(strides).map(|(o, s)| o * s).sum();
        (Vector::from_array(offset.map(|o| o as Real)), by)
    })
}

pub(super) fn moved(at: usize, by: isize) -> usize {
    (at as isize + by) as usize
}

/// Gradient of `values` at a cell, over three cells each way with weights 1, 2, 1 [1/cell].
fn gradient(values: &[Real], at: usize, strides: [isize; 3]) -> Vector {
    around(strides).fold(Vector::ZERO, |sum, (x, by)| {
        let weight = 4.0 / (1 << (x.abs().element_sum() as u32 - u32::from(by != 0))) as Real;
        sum + x * (weight * values[moved(at, by)])
    }) / 32.0
}

impl Continued {
    /// Nothing continued yet, at this angle in the liquid \[rad].
    pub fn new(domain: &Domain, boundary: &Boundary, angle: Real) -> Self {
        let planes = || std::array::from_fn(|_| domain.field(NO_PLANE));
        let (sine, cosine) = angle.sin_cos();
        Self {
            cosine,
            sine,
            edges: Edges(domain.grid().spacing / domain.grid().spacing.min_element()),
            liquid: domain.field(0.0),
            rules: boundary.volume_fraction_rules(),
            planes: planes(),
            next: planes(),
            solid: std::array::from_fn(|_| domain.field(0.0)),
            rows: RowSet::default(),
        }
    }

    /// The liquid fraction of whole cells, continued into grains.
    pub fn liquid(&self) -> &Field<Real> {
        &self.liquid
    }

    /// Takes note of the grains that have an angle: `sum` adds their solid fraction and surface over the volume of the cells [1/m] to the
    /// first two of three fields of zeros. Collective.
    pub fn place(&mut self, domain: &Domain, sum: impl FnOnce([&mut Field<Real>; 3])) {
        let [s1, s2, s3] = &mut self.solid;
        let slices = (s1.data_mut(), s2.data_mut(), s3.data_mut());
        domain.for_each_row(&domain.interior(), slices, |_, (s1, s2, s3)| {
            [s1, s2, s3].into_iter().for_each(|values| values.fill(0.0));
        });
        sum(self.solid.each_mut());
        domain.fill_halos_to(1, &mut [(&mut self.solid[0], &GhostRules::EVEN)]);
        let [n1, n2, n3] = domain.cells();
        let alpha = &self.solid[0];
        let [mut with, mut beside] = <[RowSet; 2]>::default();
        with.mark([n2, n3], |j, k| {
            let start = alpha.at(-1, j, k);
            alpha.data()[start..start + n1 + 2].iter().any(|&alpha| alpha > 0.0)
        });
        // Those along the diagonal too.
        beside.and_beside(domain, &with);
        self.rows.and_beside(domain, &beside);
    }

    /// Continues the liquid fraction `c`, all ghosts filled, into the grains. Collective.
    pub fn find(&mut self, domain: &Domain, c: &Field<Real>) {
        self.find_planes(domain, c.data());
        for _ in 0..LAYERS {
            self.add_layer(domain, c.data());
        }
        let Self { liquid, planes, solid, rows, rules, .. } = self;
        let (c, alpha, planes) = (c.data(), solid[0].data(), planes.each_ref().map(Field::data));
        domain.for_each_row(&domain.interior(), liquid.data_mut(), |row, liquid| {
            let own = &c[row.shifted(0)];
            if !rows.holds(row.j, row.k) {
                return liquid.copy_from_slice(own);
            }
            for ((liquid, at), &c) in liquid.iter_mut().zip(row.shifted(0)).zip(own) {
                *liquid = fraction(plane(planes, at), alpha[at].min(1.0), c);
            }
        });
        domain.fill_halos(&mut [(liquid, &*rules)]);
    }

    /// Finds the planes of cells that tell theirs.
    fn find_planes(&mut self, domain: &Domain, c: &[Real]) {
        let Self { planes: [p1, p2, p3, p4], solid, rows, cosine, sine, edges, .. } = self;
        let (alpha, strides) = (solid[0].data(), domain.strides());
        let slices = (p1.data_mut(), p2.data_mut(), p3.data_mut(), p4.data_mut());
        domain.for_each_row(&domain.interior(), slices, |row, (p1, p2, p3, p4)| {
            for (i, at) in row.shifted(0).enumerate() {
                let is_near = rows.holds(row.j, row.k);
                let found = is_near.then(|| anchor([*cosine, *sine], *edges, c, alpha, at, strides)).flatten();
                [p1[i], p2[i], p3[i], p4[i]] = found.map_or([NO_PLANE; 4], |plane| plane.map(|v| v as f32));
            }
        });
        self.fill_planes(domain);
    }

    fn fill_planes(&mut self, domain: &Domain) {
        let [p1, p2, p3, p4] = self.planes.each_mut().map(|plane| (plane, &NONE_BEHIND));
        domain.fill_halos_to(1, &mut [p1, p2, p3, p4]);
    }

    /// Gives the cells beside those with a plane the mean of theirs; where there are none, what the cells beside are full of.
    fn add_layer(&mut self, domain: &Domain, c: &[Real]) {
        let Self { planes, next: [p1, p2, p3, p4], solid, rows, .. } = self;
        let (alpha, strides) = (solid[0].data(), domain.strides());
        let planes = planes.each_ref().map(Field::data);
        let slices = (p1.data_mut(), p2.data_mut(), p3.data_mut(), p4.data_mut());
        domain.for_each_row(&domain.interior(), slices, |row, (p1, p2, p3, p4)| {
            for (i, at) in row.shifted(0).enumerate() {
                let own = plane(planes, at);
                let found = if !rows.holds(row.j, row.k) || alpha[at] == 0.0 || has_plane(own) {
                    own
                } else {
                    mean(planes, c, alpha, at, strides).unwrap_or(own)
                };
                [p1[i], p2[i], p3[i], p4[i]] = found.map(|v| v as f32);
            }
        });
        std::mem::swap(&mut self.planes, &mut self.next);
        self.fill_planes(domain);
    }

    /// Force of the line of contact on the grains per volume of the cell at `at`, over the surface tension [1/m^2]; `edge` is the shortest of a
    /// cell \[m].
    fn pull(&self, at: usize, strides: [isize; 3], edge: Real) -> Vector {
        let [alpha, area, _] = self.solid.each_ref().map(Field::data);
        let rise = gradient(alpha, at, strides);
        if area[at] == 0.0 || rise == Vector::ZERO {
            return Vector::ZERO;
        }
        let out = -self.edges.in_space(rise).normalize();
        let along = self.edges.in_space(gradient(self.liquid.data(), at, strides)).reject_from_normalized(out);
        area[at] / edge * (out * (self.sine * along.length()) + along * self.cosine)
    }

    /// Adds `dt` \[s] of the pull of a surface tension of `coefficient` [N/m] to the impulses on the surface in each cell, per volume
    /// [N s/m^3]; returns its sum over this rank \[N s].
    pub fn add_pull(
        &self,
        domain: &Domain,
        coefficient: Real,
        dt: Real,
        [i1, i2, i3]: [&mut Field<Real>; 3],
    ) -> Vector {
        let (strides, edge) = (domain.strides(), domain.grid().spacing.min_element());
        let of = |row: &Row, at: usize| {
            if self.rows.holds(row.j, row.k) { coefficient * dt * self.pull(at, strides, edge) } else { Vector::ZERO }
        };
        let slices = (i1.data_mut(), i2.data_mut(), i3.data_mut());
        domain.for_each_row(&domain.interior(), slices, |row, (i1, i2, i3)| {
            for (i, at) in row.shifted(0).enumerate() {
                let pull = of(&row, at);
                (i1[i], i2[i], i3[i]) = (i1[i] + pull.x, i2[i] + pull.y, i3[i] + pull.z);
            }
        });
        let sum = domain.sum_rows(&domain.interior(), |row| {
            row.shifted(0).fold(Vector::ZERO, |sum, at| sum + of(&row, at)).to_array()
        });
        Vector::from_array(sum) * domain.grid().cell_volume()
    }

    /// Rows with such grains and those beside them.
    pub fn rows(&self) -> &RowSet {
        &self.rows
    }

    /// Solid fraction of the grains with an angle, one ghost layer filled.
    pub fn covers(&self) -> &[Real] {
        self.solid[0].data()
    }

    /// Whether the cell at `at` holds part of a grain with an angle.
    pub fn holds_grain(&self, at: usize) -> bool {
        self.solid[0].data()[at] > 0.0
    }
}

fn plane(planes: [&[f32]; 4], at: usize) -> [Real; 4] {
    planes.map(|field| field[at].into())
}

fn has_plane([a, b, c, _]: [Real; 4]) -> bool {
    [a, b, c] != [0.0; 3]
}

/// Share of a cell on the liquid side of a plane.
fn below([a, b, c, distance]: [Real; 4]) -> Real {
    let normal = [a, b, c].map(Real::abs);
    let sum: Real = normal.iter().sum();
    volume_below(normal.map(|v| v / sum), (0.5 * sum - distance) / sum)
}

/// The continued liquid fraction of a cell covered by `alpha` with the share `c` of liquid in its open part.
fn fraction(plane: [Real; 4], alpha: Real, c: Real) -> Real {
    let open = 1.0 - alpha;
    if alpha == 0.0 {
        c
    } else if has_plane(plane) {
        let share = below(plane);
        if open >= HOLDS { share.clamp(open * c, open * c + alpha) } else { share }
    } else if open >= TELLS || plane[3] == 0.0 {
        c
    } else {
        Real::from(u8::from(plane[3] < 0.0))
    }
}

/// The plane at the angle with this cosine and sine in the cell at `at`, if it holds an interface or one lies on a face of it, is open
/// enough to tell, and lies beside the surface of a grain.
fn anchor(
    [cosine, sine]: [Real; 2],
    edges: Edges,
    c: &[Real],
    alpha: &[Real],
    at: usize,
    strides: [isize; 3],
) -> Option<[Real; 4]> {
    let open = 1.0 - alpha[at];
    let is_beside = || around(strides).any(|(_, by)| 1.0 - alpha[moved(at, by)] < TELLS);
    if open < TELLS || !may_have_interface(c, at, strides) || !is_beside() {
        return None;
    }
    let rise = gradient(alpha, at, strides);
    let out = (rise != Vector::ZERO).then(|| -edges.in_space(rise).normalize())?;
    let across_cells = open_gradient(c, alpha, at, strides).filter(|across| across.length() > STEEP)?;
    let across = edges.in_space(across_cells);
    let along = across.reject_from_normalized(out);
    let at_surface = (along.length() > PURE).then(|| out * cosine - along.normalize() * sine)?;
    let normal = edges.in_cells(at_surface.lerp(-across.normalize(), AROUND))?;
    let out = -rise.normalize();
    let distance = if (PURE..=1.0 - PURE).contains(&c[at]) {
        distance(normal, out, &[(Vector::ZERO, alpha[at])], c[at] * open)
    } else {
        let (to, beside) = behind_face(c, at, across_cells, strides)?;
        if 1.0 - alpha[beside] < HOLDS {
            return None;
        }
        let liquid = (1.0 - alpha[at]) * c[at] + (1.0 - alpha[beside]) * c[beside];
        distance(normal, out, &[(Vector::ZERO, alpha[at]), (to, alpha[beside])], liquid)
    };
    Some([normal.x, normal.y, normal.z, distance])
}

fn are_opposite(a: Real, b: Real) -> bool {
    a.min(b) < PURE && a.max(b) > 1.0 - PURE
}

/// Whether the cell at `at` is mixed, or between it and one of the six beside it full meets empty.
fn may_have_interface(c: &[Real], at: usize, strides: [isize; 3]) -> bool {
    (PURE..=1.0 - PURE).contains(&c[at])
        || strides.iter().any(|&s| are_opposite(c[at], c[moved(at, s)]) || are_opposite(c[at], c[moved(at, -s)]))
}

/// The cell behind the face on which the interface lies, full where that at `at` is empty or the other way round, and the way to it: along
/// the direction in which the liquid fraction rises most, `across`.
fn behind_face(c: &[Real], at: usize, across: Vector, strides: [isize; 3]) -> Option<(Vector, usize)> {
    let d = (0..3).max_by(|&i, &j| across[i].abs().total_cmp(&across[j].abs()))?;
    let sign = if (across[d] > 0.0) == (c[at] < 0.5) { 1 } else { -1 };
    let beside = moved(at, sign * strides[d]);
    are_opposite(c[at], c[beside]).then_some((Vector::AXES[d] * sign as Real, beside))
}

/// Gradient of the liquid fraction by least squares over the open cells around, by their open parts [1/cell].
fn open_gradient(c: &[Real], alpha: &[Real], at: usize, strides: [isize; 3]) -> Option<Vector> {
    let weight = |x: Vector, n: usize| (1.0 - alpha[n]).max(0.0) / (1.0 + x.length_squared());
    let (mut sum, mut place, mut value) = (0.0, Vector::ZERO, 0.0);
    for (x, by) in around(strides) {
        let n = moved(at, by);
        let w = weight(x, n);
        (sum, place, value) = (sum + w, place + w * x, value + w * c[n]);
    }
    let (place, value) = (place / sum, value / sum);
    let (mut squares, mut right) = (Matrix::ZERO, Vector::ZERO);
    for (x, by) in around(strides) {
        let n = moved(at, by);
        let (w, from) = (weight(x, n), x - place);
        squares += Matrix::from_cols(from * from.x, from * from.y, from * from.z) * w;
        right += from * (w * (c[n] - value));
    }
    let ridge = 1e-3 * (squares.x_axis.x + squares.y_axis.y + squares.z_axis.z);
    (ridge > 0.0).then(|| (squares + Matrix::from_diagonal(Vector::splat(ridge))).inverse() * right)
}

/// Mean of the planes in the cells around, those nearer with more weight; without any what the cells around are full of.
fn mean(planes: [&[f32]; 4], c: &[Real], alpha: &[Real], at: usize, strides: [isize; 3]) -> Option<[Real; 4]> {
    let (mut sum, mut normal, mut distance, mut side) = (0.0, Vector::ZERO, 0.0, 0.0);
    for (x, by) in around(strides).filter(|&(_, by)| by != 0) {
        let n = moved(at, by);
        let [a, b, d, beside] = plane(planes, n);
        let w = 1.0 / x.length_squared();
        if has_plane([a, b, d, beside]) {
            let of = Vector::new(a, b, d);
            (sum, normal) = (sum + w, normal + w * of);
            distance += w * (beside - of.dot(x));
        } else if 1.0 - alpha[n] >= TELLS {
            side += w * (1.0 - 2.0 * c[n]);
        } else {
            side += w * beside;
        }
    }
    let length = normal.length();
    if sum > 0.0 && length > 0.1 * sum {
        let [a, b, d] = (normal / length).to_array();
        return Some([a, b, d, distance / sum]);
    }
    (side != 0.0).then(|| [0.0, 0.0, 0.0, side.signum()])
}

/// Distance of the centre of the first of some `cells`, in cells, from the plane with this normal on whose liquid side their open parts have
/// together this volume of `liquid`, in cells. Each is given with its place from the first and the part of it that is covered, which a plane
/// with the normal `out` cuts off.
fn distance(normal: Vector, out: Vector, cells: &[(Vector, Real)], liquid: Real) -> Real {
    let half = 0.5 * normal.abs().element_sum();
    if let [(_, alpha)] = cells
        && *alpha <= 0.0
    {
        let m = normal.abs() / (2.0 * half);
        return half - 2.0 * half * plane_constant(m.to_array(), liquid);
    }
    let reach = 0.5 * out.abs().element_sum();
    let surface = |alpha: Real| 2.0 * reach * plane_constant((out.abs() / (2.0 * reach)).to_array(), alpha) - reach;
    let beyond = cells.iter().map(|(to, _)| normal.dot(*to).abs()).fold(0.0, Real::max);
    let (mut low, mut high) = (-half - beyond, half + beyond);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let part =
            |&(to, alpha): &(Vector, Real)| volume_of_both((normal, -middle - normal.dot(to)), (-out, -surface(alpha)));
        if cells.iter().map(part).sum::<Real>() > liquid { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Volume of the part of the unit cube around the origin where `n . x <= d` for both of two planes `(n, d)`: the middle sections of
/// slices across the direction that they turn to least.
fn volume_of_both(a: (Vector, Real), b: (Vector, Real)) -> Real {
    let turned = a.0 * a.0 + b.0 * b.0;
    let d = (0..3).min_by(|&i, &j| turned[i].total_cmp(&turned[j])).unwrap_or(0);
    let [e, f] = [(d + 1) % 3, (d + 2) % 3];
    let slice = |n: u32| {
        let place = (Real::from(n) + 0.5) / Real::from(SLICES) - 0.5;
        let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        let mut polygon = ([[0.0; 2]; 8], 4);
        polygon.0[..4].copy_from_slice(&corners);
        for (n, limit) in [a, b] {
            polygon = cut(&polygon.0[..polygon.1], [n[e], n[f]], limit - n[d] * place);
        }
        area(&polygon.0[..polygon.1])
    };
    (0..SLICES).map(slice).sum::<Real>() / Real::from(SLICES)
}

/// The part of a convex polygon where `n . x <= limit` (Sutherland and Hodgman 1974, Commun. ACM 17, 32).
fn cut(polygon: &[[Real; 2]], n: [Real; 2], limit: Real) -> ([[Real; 2]; 8], usize) {
    let (mut kept, mut count) = ([[0.0; 2]; 8], 0);
    let beyond = |[x, y]: [Real; 2]| n[0] * x + n[1] * y - limit;
    let mut keep = |point: [Real; 2]| {
        kept[count] = point;
        count += 1;
    };
    for (i, &from) in polygon.iter().enumerate() {
        let to = polygon[(i + 1) % polygon.len()];
        let [first, last] = [beyond(from), beyond(to)];
        if first <= 0.0 {
            keep(from);
        }
        if (first <= 0.0) != (last <= 0.0) {
            let t = first / (first - last);
            keep([from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])]);
        }
    }
    (kept, count)
}

fn area(polygon: &[[Real; 2]]) -> Real {
    let pairs = polygon.iter().enumerate().map(|(i, p)| (p, &polygon[(i + 1) % polygon.len()]));
    0.5 * pairs.map(|(p, q)| p[0] * q[1] - q[0] * p[1]).sum::<Real>()
}

#[cfg(test)]
mod tests {
    use sazanami_numerics::grid::Grid;

    use super::*;
    use crate::boundary::Side;

    #[test]
    fn the_liquid_of_an_open_part_gives_the_plane_back() {
        for (normal, out) in [
            (Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 0.0, 1.0)),
            (Vector::new(0.6, 0.0, 0.8), Vector::new(0.0, 0.0, 1.0)),
            (Vector::new(0.5, -0.7, 0.2), Vector::new(-0.3, 0.4, 0.9)),
            (Vector::new(0.5, 0.5, -0.1), Vector::new(0.5, 0.4, 0.9)),
        ] {
            let (normal, out) = (normal.normalize(), out.normalize());
            for (surface, place) in [(-0.3, 0.1), (-0.05, -0.1), (-0.45, 0.2)] {
                let alpha = below([out.x, out.y, out.z, -surface]);
                // Sums over points, independent of the slices.
                const N: u32 = 60;
                let line = |n: u32| (Real::from(n) + 0.5) / Real::from(N) - 0.5;
                let (mut liquid, mut open) = (0.0, 0.0);
                for n in 0..N.pow(3) {
                    let x = Vector::new(line(n % N), line(n / N % N), line(n / N / N));
                    if out.dot(x) > surface {
                        open += 1.0;
                        liquid += Real::from(u8::from(normal.dot(x) <= -place));
                    }
                }
                let given = liquid / Real::from(N.pow(3));
                let (c, found) = (liquid / open, distance(normal, out, &[(Vector::ZERO, alpha)], given));
                assert!(c > 0.02 && c < 0.98, "{c}");
                assert!((found - place).abs() < 0.02, "{normal} {out} {surface} {place}: {found}");
                // Negative control: taken for the whole cell it is elsewhere unless the planes are at right angles.
                let whole = distance(normal, out, &[(Vector::ZERO, 0.0)], c);
                assert!(
                    normal.dot(out).abs() < 0.1 || surface < -0.4 || (whole - place).abs() > 0.02,
                    "{whole} {place}"
                );
            }
        }
    }

    #[test]
    fn the_angle_is_that_of_space_in_cells_of_any_edges() {
        let (strides, centre) = ([1, 3, 9], 13);
        let angle: Real = 1.0;
        let out = Vector::new(0.3, 0.1, 1.0).normalize();
        let normal = out * angle.cos() + Vector::X.reject_from_normalized(out).normalize() * angle.sin();
        let miss = |edges: Vector, taken: Vector| {
            // A plane with a normal in space cuts all 27 cells; the second holds the middle.
            let part = |normal: Vector, distance: Real, n: usize| {
                let x = Vector::new((n % 3) as Real - 1.0, (n / 3 % 3) as Real - 1.0, (n / 9) as Real - 1.0);
                let of_cells = Edges(edges).in_cells(normal).expect("a normal");
                below([of_cells.x, of_cells.y, of_cells.z, distance + of_cells.dot(x)])
            };
            let alpha: Vec<Real> = (0..27).map(|n| part(out, 0.6, n)).collect();
            let c: Vec<Real> = (0..27).map(|n| part(normal, 0.0, n)).collect();
            let cosine_and_sine = [angle.cos(), angle.sin()];
            let [a, b, d, _] = anchor(cosine_and_sine, Edges(taken), &c, &alpha, centre, strides).expect("a plane");
            let in_space = (Vector::new(a, b, d) / taken).normalize();
            in_space.angle_between(normal)
        };
        for edges in [Vector::ONE, Vector::new(1.0, 1.0, 2.0), Vector::new(2.0, 1.0, 1.0), Vector::new(1.0, 3.0, 1.5)] {
            let found = miss(edges, edges);
            assert!(found < 0.08, "{edges}: {found}");
            // Negative control: taken for cubes.
            assert!(edges == Vector::ONE || edges.y == 3.0 || miss(edges, Vector::ONE) > 0.16, "{edges}");
        }
    }

    #[test]
    fn a_straight_line_of_contact_pulls_as_long_as_it_is_in_cells_of_any_edges() {
        let (angle, size, floor): (Real, _, _) = (1.0, Vector::new(12.0, 4.0, 12.0), 4.3);
        let normal = Vector::new(angle.sin(), 0.0, angle.cos());
        let pull = |cells: [usize; 3]| {
            let domain = Domain::solo(Grid::new(cells, Vector::ZERO, size), [false, true, false]);
            let sides = [[Side::Slip; 2], [Side::Periodic; 2], [Side::Slip; 2]];
            let boundary = Boundary::new(sides).expect("closed");
            let spacing = domain.grid().spacing;
            let mut continued = Continued::new(&domain, &boundary, angle);
            let covered = |k: isize| (floor / spacing.z - k as Real).clamp(0.0, 1.0);
            continued.place(&domain, |[alpha, area, _]| {
                domain.set(alpha, |_, _, k| covered(k));
                let is_cut = |k: isize| covered(k) > 0.0 && covered(k) < 1.0;
                domain.set(area, |_, _, k| if is_cut(k) { 1.0 / spacing.z } else { 0.0 });
            });
            // The liquid behind the plane in the open part of each cell, by 16 x 16 points.
            let share = |i: isize, _: isize, k: isize| {
                let points = (0..256).map(|n| [n % 16, n / 16].map(|n| (Real::from(n) + 0.5) / 16.0));
                let at = points.map(|[x, z]| {
                    let open = covered(k) + (1.0 - covered(k)) * z;
                    spacing * Vector::new(i as Real + x, 0.0, k as Real + open) - Vector::new(6.2, 0.0, floor)
                });
                at.filter(|at| at.dot(normal) < 0.0).count() as Real / 256.0
            };
            let mut c = domain.field(0.0);
            domain.set(&mut c, share);
            domain.fill_halos(&mut [(&mut c, &boundary.volume_fraction_rules())]);
            continued.find(&domain, &c);
            let mut impulse: [Field<Real>; 3] = std::array::from_fn(|_| domain.field(0.0));
            continued.add_pull(&domain, 1.0, 1.0, impulse.each_mut())
        };
        let exact = size.y * Vector::new(-angle.cos(), 0.0, angle.sin());
        for cells in [[24, 8, 24], [24, 8, 48], [48, 8, 24], [24, 1, 36]] {
            let found = pull(cells);
            assert!((found - exact).length() < 0.15 * exact.length(), "{cells:?}: {found} for {exact}");
        }
    }

    #[test]
    fn gradients_of_linear_fractions_are_exact() {
        let strides = [1, 3, 9];
        let values: Vec<Real> = (0..27)
            .map(|n| 0.2 + 0.1 * f64::from(n % 3) - 0.05 * f64::from(n / 3 % 3) + 0.02 * f64::from(n / 9))
            .collect();
        let exact = Vector::new(0.1, -0.05, 0.02);
        assert!((gradient(&values, 13, strides) - exact).length() < 1e-14);
        let mut alpha = vec![0.0; 27];
        alpha[..9].fill(1.0);
        alpha[9..18].fill(0.4);
        let found = open_gradient(&values, &alpha, 13, strides).unwrap();
        assert!((found - exact).length() < 0.01 * exact.length(), "{found}");
    }
}
