//! Regions of space bounded by simple surfaces, and the share of each cell they fill: initial liquid.
//!
//! Every primitive is convex, so a vertical line meets it in one interval and a union in a few. A cell that a
//! surface crosses is sampled on vertical columns, exactly along each; cells wholly inside or outside are
//! recognised before. Where the volume of the region is known it is then met by adding k alpha (1 - alpha)
//! to the fractions.

mod level;
mod sampled;

use std::f64::consts::PI;

use crate::grid::Grid;
use crate::{Matrix, Quaternion, Real, Vector};
pub use sampled::{PlacedLiquid, SampledCells, SampledLiquid};

/// A region of space.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// Between two corners \[m].
    Box {
        /// Corner with the smallest coordinates \[m].
        lower: Vector,
        /// Corner with the largest coordinates \[m].
        upper: Vector,
    },
    /// A ball.
    Sphere {
        /// Centre \[m].
        centre: Vector,
        /// Radius \[m].
        radius: Real,
    },
    /// An ellipsoid, a spheroid when two semi-axes are equal.
    Spheroid {
        /// Centre \[m].
        centre: Vector,
        /// Semi-axes \[m].
        semi_axes: Vector,
        /// Turns the semi-axes from the coordinate directions to theirs.
        orientation: Quaternion,
    },
    /// Everything on the side of a plane away from its normal.
    HalfSpace {
        /// A point of the plane \[m].
        point: Vector,
        /// Normal out of the region, of any length.
        normal: Vector,
    },
    /// An elliptic cylinder without ends.
    Cylinder {
        /// A point of its axis, where a wave has a crest \[m].
        centre: Vector,
        /// Direction of its axis, from 0.
        axis: usize,
        /// Semi-axes along the two directions that follow in cyclic order \[m].
        semi_axes: [Real; 2],
        /// What it is thicker by, along the axis.
        wave: Wave,
    },
    /// All below a surface with a wave.
    Wavy {
        /// A point of a crest \[m].
        crest: Vector,
        /// Direction out of the region, from 0.
        up: usize,
        /// Direction of the wave, from 0.
        along: usize,
        /// The wave.
        wave: Wave,
    },
    /// A body of liquid that is known by its share of the cells of a grid.
    Sampled(PlacedLiquid),
    /// All that lies in at least one of the members.
    Union(Vec<Region>),
}

/// A cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Height of a crest above the mean \[m].
    pub amplitude: Real,
    /// Distance between crests \[m].
    pub length: Real,
}

/// Position of a cell relative to a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Inside,
    Outside,
    Across,
}

impl Region {
    /// Whether `point` lies inside or on the surface.
    #[must_use]
    pub fn contains(&self, point: Vector) -> bool {
        match self {
            Self::Box { lower, upper } => point.cmpge(*lower).all() && point.cmple(*upper).all(),
            Self::Sphere { centre, radius } => point.distance_squared(*centre) <= radius * radius,
            Self::Spheroid { centre, semi_axes, orientation } => {
                (orientation.inverse() * (point - *centre) / *semi_axes).length_squared() <= 1.0
            }
            Self::HalfSpace { point: on, normal } => (point - *on).dot(*normal) <= 0.0,
            Self::Cylinder { .. } | Self::Wavy { .. } => self.level(point) <= 0.0,
            Self::Sampled(liquid) => liquid.contains(point),
            Self::Union(members) => members.iter().any(|m| m.contains(point)),
        }
    }

    /// Whether a ball about `centre` with `radius` \[m] shares a point with the region.
    #[must_use]
    pub fn touches_ball(&self, centre: Vector, radius: Real) -> bool {
        if self.contains(centre) {
            return true;
        }
        match self {
            Self::Box { lower, upper } => centre.distance(centre.clamp(*lower, *upper)) <= radius,
            Self::Sphere { centre: own, radius: reach } => centre.distance(*own) <= radius + reach,
            Self::Spheroid { centre: own, semi_axes, orientation } => {
                distance_to_ellipsoid(*semi_axes, orientation.inverse() * (centre - *own)) <= radius
            }
            Self::HalfSpace { point, normal } => (centre - *point).dot(*normal) <= radius * normal.length(),
            // Cautiously: the level is at most the distance.
            Self::Cylinder { .. } | Self::Wavy { .. } => self.level(centre) <= radius,
            Self::Sampled(liquid) => liquid.touches_ball(centre, radius),
            Self::Union(members) => members.iter().any(|m| m.touches_ball(centre, radius)),
        }
    }

    /// Smallest box around the region, with infinite sides where it has no end \[m].
    #[must_use]
    pub fn bounds(&self) -> (Vector, Vector) {
        match self {
            Self::Box { lower, upper } => (*lower, *upper),
            Self::Sphere { centre, radius } => (*centre - *radius, *centre + *radius),
            Self::Spheroid { centre, semi_axes, orientation } => {
                let columns = Matrix::from_quat(*orientation) * Matrix::from_diagonal(*semi_axes);
                let rows = columns.transpose();
                let reach = Vector::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
                (*centre - reach, *centre + reach)
            }
            Self::HalfSpace { point, normal } => {
                let (mut lower, mut upper) = (Vector::splat(Real::NEG_INFINITY), Vector::splat(Real::INFINITY));
                for d in 0..3 {
                    let others = normal[(d + 1) % 3] == 0.0 && normal[(d + 2) % 3] == 0.0;
                    if others && normal[d] > 0.0 {
                        upper[d] = point[d];
                    } else if others && normal[d] < 0.0 {
                        lower[d] = point[d];
                    }
                }
                (lower, upper)
            }
            Self::Cylinder { centre, axis, semi_axes, wave } => {
                let mut reach = Vector::splat(Real::INFINITY);
                let least = semi_axes[0].min(semi_axes[1]);
                for (n, semi_axis) in semi_axes.iter().enumerate() {
                    reach[(axis + 1 + n) % 3] = semi_axis * (1.0 + wave.amplitude.abs() / least);
                }
                (*centre - reach, *centre + reach)
            }
            Self::Wavy { crest, up, wave, .. } => {
                let mut upper = Vector::splat(Real::INFINITY);
                upper[*up] = crest[*up] - wave.amplitude + wave.amplitude.abs();
                (Vector::splat(Real::NEG_INFINITY), upper)
            }
            Self::Sampled(liquid) => liquid.bounds(),
            Self::Union(members) => {
                members.iter().map(Self::bounds).fold(
                    (Vector::splat(Real::INFINITY), Vector::splat(Real::NEG_INFINITY)),
                    |(lower, upper), (l, u)| (lower.min(l), upper.max(u)),
                )
            }
        }
    }

    /// Volume where a formula gives it: not for half-spaces, nor for unions whose members may overlap [m^3].
    #[must_use]
    pub fn volume(&self) -> Option<Real> {
        match self {
            Self::Box { lower, upper } => {
                let edges = (*upper - *lower).max(Vector::ZERO);
                Some(edges.x * edges.y * edges.z)
            }
            Self::Sphere { radius, .. } => Some(4.0 / 3.0 * PI * radius.powi(3)),
            Self::Spheroid { semi_axes: s, .. } => Some(4.0 / 3.0 * PI * s.x * s.y * s.z),
            Self::HalfSpace { .. } | Self::Cylinder { .. } | Self::Wavy { .. } => None,
            Self::Sampled(liquid) => Some(liquid.body.volume()).filter(|volume| volume.is_finite()),
            Self::Union(members) => {
                let apart = |a: &Self, b: &Self| {
                    let ((la, ua), (lb, ub)) = (a.bounds(), b.bounds());
                    ua.cmple(lb).any() || ub.cmple(la).any()
                };
                let disjoint = members.iter().enumerate().all(|(i, a)| members[i + 1..].iter().all(|b| apart(a, b)));
                if disjoint { members.iter().map(Self::volume).sum() } else { None }
            }
        }
    }

    /// Velocity of the liquid at a point beside that of the whole [m/s]: that of a sampled body, none of others.
    #[must_use]
    pub fn velocity(&self, point: Vector) -> Vector {
        match self {
            Self::Sampled(liquid) => liquid.velocity(point),
            Self::Union(members) => {
                let nearest = members.iter().min_by(|a, b| a.level(point).total_cmp(&b.level(point)));
                nearest.map_or(Vector::ZERO, |m| m.velocity(point))
            }
            _ => Vector::ZERO,
        }
    }

    /// Place of the cell with the given centre and half edges, cautiously: `Across` may be wrong, the others not.
    fn place(&self, centre: Vector, half: Vector) -> Place {
        let by_distance = |distance: Real, reach: Real, limit: Real| {
            if distance + reach <= limit {
                Place::Inside
            } else if distance - reach >= limit {
                Place::Outside
            } else {
                Place::Across
            }
        };
        match self {
            Self::Box { lower, upper } => {
                let (from, to) = (centre - half, centre + half);
                if from.cmpge(*lower).all() && to.cmple(*upper).all() {
                    Place::Inside
                } else if to.cmple(*lower).any() || from.cmpge(*upper).any() {
                    Place::Outside
                } else {
                    Place::Across
                }
            }
            Self::Sphere { centre: own, radius } => by_distance(centre.distance(*own), half.length(), *radius),
            Self::Spheroid { centre: own, semi_axes, orientation } => {
                let inverse = orientation.inverse();
                let reach = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
                    .map(|(s, t)| (inverse * (half * Vector::new(1.0, s, t)) / *semi_axes).length())
                    .into_iter()
                    .fold(0.0, Real::max);
                by_distance((inverse * (centre - *own) / *semi_axes).length(), reach, 1.0)
            }
            Self::HalfSpace { point, normal } => {
                by_distance((centre - *point).dot(*normal), half.dot(normal.abs()), 0.0)
            }
            Self::Cylinder { .. } | Self::Wavy { .. } => by_distance(self.level(centre), half.length(), 0.0),
            Self::Sampled(liquid) => match liquid.values_in(centre, half) {
                [least, _] if least >= 0.0 => Place::Inside,
                [_, most] if most < 0.0 => Place::Outside,
                _ => Place::Across,
            },
            Self::Union(members) => {
                members.iter().fold(Place::Outside, |place, m| match (place, m.place(centre, half)) {
                    (Place::Inside, _) | (_, Place::Inside) => Place::Inside,
                    (Place::Outside, Place::Outside) => Place::Outside,
                    _ => Place::Across,
                })
            }
        }
    }

    /// Adds the interval of height in which the vertical line through (x, y) lies in each primitive.
    fn intervals(&self, x: Real, y: Real, found: &mut Vec<[Real; 2]>) {
        match self {
            Self::Box { lower, upper } => {
                if (lower.x..=upper.x).contains(&x) && (lower.y..=upper.y).contains(&y) {
                    found.push([lower.z, upper.z]);
                }
            }
            Self::Sphere { centre, radius } => {
                let square = radius * radius - (x - centre.x).powi(2) - (y - centre.y).powi(2);
                if square > 0.0 {
                    found.push([centre.z - square.sqrt(), centre.z + square.sqrt()]);
                }
            }
            Self::Spheroid { centre, semi_axes, orientation } => {
                // |p + z d| = 1 in coordinates in which the ellipsoid is the unit ball.
                let inverse = orientation.inverse();
                let p = inverse * Vector::new(x - centre.x, y - centre.y, 0.0) / *semi_axes;
                let d = inverse * Vector::Z / *semi_axes;
                let (dd, pd) = (d.length_squared(), p.dot(d));
                let square = pd * pd - dd * (p.length_squared() - 1.0);
                if square > 0.0 {
                    found.push([centre.z - (pd + square.sqrt()) / dd, centre.z - (pd - square.sqrt()) / dd]);
                }
            }
            Self::HalfSpace { point, normal } => {
                let level = -(x - point.x) * normal.x - (y - point.y) * normal.y;
                if normal.z > 0.0 {
                    found.push([Real::NEG_INFINITY, point.z + level / normal.z]);
                } else if normal.z < 0.0 {
                    found.push([point.z + level / normal.z, Real::INFINITY]);
                } else if level >= 0.0 {
                    found.push([Real::NEG_INFINITY, Real::INFINITY]);
                }
            }
            // Found by their levels: see `has_level_alone`.
            Self::Cylinder { .. } | Self::Wavy { .. } | Self::Sampled(_) => {}
            Self::Union(members) => members.iter().for_each(|m| m.intervals(x, y, found)),
        }
    }
}

/// Distance of a point outside an ellipsoid, in its axes, to its surface: the foot y of the perpendicular satisfies
/// x_i = y_i (1 + t/s_i^2) with one positive t, found by halving.
fn distance_to_ellipsoid(semi_axes: Vector, point: Vector) -> Real {
    let squares = semi_axes * semi_axes;
    let foot = |t: Real| point * squares / (squares + t);
    let outside = |t: Real| (foot(t) / semi_axes).length_squared() > 1.0;
    let (mut lower, mut upper) = (0.0, semi_axes.max_element() * point.length());
    for _ in 0..100 {
        let middle = 0.5 * (lower + upper);
        if outside(middle) {
            lower = middle;
        } else {
            upper = middle;
        }
    }
    point.distance(foot(upper))
}

/// The share of the cells of a grid that a region fills.
#[derive(Clone, Debug)]
pub struct RegionFractions<'a> {
    region: &'a Region,
    grid: Grid,
    per_axis: u32,
    /// Whether cells are sampled along the normal of the surface, not in vertical columns.
    along_normals: bool,
    correction: Real,
    raw_volume_error: Option<Real>,
}

/// Columns tried at most along a cell's edge when a region is small for its cells.
const MOST_COLUMNS: u32 = 128;

impl<'a> RegionFractions<'a> {
    /// Prepares for `per_axis` x `per_axis` columns a cell. Where the region lies in the box of `grid` and its
    /// volume is known, the fractions are corrected to sum to it; every rank finds the same correction.
    ///
    /// # Panics
    /// If there are no columns.
    #[must_use]
    pub fn new(region: &'a Region, grid: &Grid, per_axis: u32) -> Self {
        Self::sampling(region, grid, per_axis, region.has_level_alone() || region.is_upright())
    }

    /// The same with lines along the normal of the surface in place of vertical columns: a surface that stands upright has no steps, as the
    /// curvature of an interface needs it.
    ///
    /// # Panics
    /// If there are no lines.
    #[must_use]
    pub fn along_normals(region: &'a Region, grid: &Grid, per_axis: u32) -> Self {
        Self::sampling(region, grid, per_axis, true)
    }

    fn sampling(region: &'a Region, grid: &Grid, per_axis: u32, along_normals: bool) -> Self {
        assert!(per_axis > 0, "a region is sampled on at least one column a cell");
        let mut fractions =
            Self { region, grid: *grid, per_axis, along_normals, correction: 0.0, raw_volume_error: None };
        let (lower, upper) = region.bounds();
        let margin = 1e-9 * grid.spacing;
        let within = lower.cmpge(grid.lower - margin).all() && upper.cmple(grid.upper() + margin).all();
        let Some(volume) = region.volume().filter(|_| within) else { return fractions };
        let exact = volume / grid.cell_volume();
        loop {
            let (sum, leeway) = fractions.sums(grid.cell_of(lower), grid.cell_of(upper));
            let missing = exact - sum;
            let correction = if missing.abs() <= 1e-14 * exact { 0.0 } else { missing / leeway };
            if correction.abs() <= 0.5 || fractions.per_axis >= MOST_COLUMNS {
                fractions.correction = if correction.is_finite() { correction.clamp(-1.0, 1.0) } else { 0.0 };
                fractions.raw_volume_error = Some(sum / exact - 1.0);
                return fractions;
            }
            fractions.per_axis *= 2;
        }
    }

    /// Sum of alpha and of alpha (1 - alpha) over a block of cells.
    fn sums(&self, first: [isize; 3], last: [isize; 3]) -> (Real, Real) {
        let (mut sum, mut leeway) = (0.0, 0.0);
        for k in first[2]..=last[2] {
            for j in first[1]..=last[1] {
                for i in first[0]..=last[0] {
                    let fraction = self.sampled(i, j, k);
                    sum += fraction;
                    leeway += fraction * (1.0 - fraction);
                }
            }
        }
        (sum, leeway)
    }

    /// Share of the cell with global indices `(i, j, k)`.
    #[must_use]
    pub fn fraction(&self, i: isize, j: isize, k: isize) -> Real {
        let fraction = self.sampled(i, j, k);
        (fraction + self.correction * fraction * (1.0 - fraction)).clamp(0.0, 1.0)
    }

    /// Relative error of the sampled volume before correction, where the exact one is known.
    #[must_use]
    pub fn raw_volume_error(&self) -> Option<Real> {
        self.raw_volume_error
    }

    fn sampled(&self, i: isize, j: isize, k: isize) -> Real {
        let centre = self.grid.centre(i, j, k);
        let half = 0.5 * self.grid.spacing;
        match self.region.place(centre, half) {
            Place::Inside => return 1.0,
            Place::Outside => return 0.0,
            Place::Across => {}
        }
        if let Region::Box { lower, upper } = self.region {
            let overlap = ((centre + half).min(*upper) - (centre - half).max(*lower)).max(Vector::ZERO);
            let share = overlap / self.grid.spacing;
            return share.x * share.y * share.z;
        }
        if self.along_normals {
            return self.region.share_along_normal(centre, half, self.per_axis);
        }
        let n = Real::from(self.per_axis);
        let (floor, top) = (centre.z - half.z, centre.z + half.z);
        let mut intervals = Vec::new();
        let mut covered = 0.0;
        for b in 0..self.per_axis {
            let y = centre.y + self.grid.spacing.y * ((Real::from(b) + 0.5) / n - 0.5);
            for a in 0..self.per_axis {
                let x = centre.x + self.grid.spacing.x * ((Real::from(a) + 0.5) / n - 0.5);
                intervals.clear();
                self.region.intervals(x, y, &mut intervals);
                covered += covered_length(&mut intervals, floor, top);
            }
        }
        (covered / (n * n * self.grid.spacing.z)).min(1.0)
    }
}

/// Length of the part between `floor` and `top` that lies in at least one interval.
fn covered_length(intervals: &mut [[Real; 2]], floor: Real, top: Real) -> Real {
    intervals.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let (mut length, mut reached) = (0.0, floor);
    for &[from, to] in &*intervals {
        let (from, to) = (from.max(reached), to.min(top));
        if to > from {
            length += to - from;
            reached = to;
        }
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Grid {
        Grid::new([40, 36, 44], Vector::new(-1.0, -0.9, -1.1), Vector::new(1.0, 0.9, 1.1))
    }

    fn total(region: &Region, grid: &Grid, per_axis: u32) -> Real {
        let fractions = RegionFractions::new(region, grid, per_axis);
        let mut sum = 0.0;
        for k in 0..grid.cells[2] as isize {
            for j in 0..grid.cells[1] as isize {
                for i in 0..grid.cells[0] as isize {
                    let fraction = fractions.fraction(i, j, k);
                    assert!((0.0..=1.0).contains(&fraction));
                    sum += fraction;
                }
            }
        }
        sum * grid.cell_volume()
    }

    fn tilted() -> Quaternion {
        Quaternion::from_axis_angle(Vector::new(1.0, 2.0, 0.5).normalize(), 0.7)
    }

    #[test]
    fn regions_hold_their_exact_volume() {
        let grid = grid();
        let ball = Region::Sphere { centre: Vector::new(0.11, -0.03, 0.2), radius: 0.53 };
        let ellipsoid = Region::Spheroid {
            centre: Vector::new(0.05, 0.1, -0.2),
            semi_axes: Vector::new(0.7, 0.3, 0.3),
            orientation: tilted(),
        };
        let brick = Region::Box { lower: Vector::new(-0.33, -0.21, -1.1), upper: Vector::new(0.4, 0.27, -0.8) };
        let pair = Region::Union(vec![ball.clone(), brick.clone()]);
        for region in [&ball, &ellipsoid, &brick, &pair] {
            let exact = region.volume().unwrap();
            assert!((total(region, &grid, 8) / exact - 1.0).abs() < 1e-12, "{region:?}");
        }
        let error = RegionFractions::new(&ball, &grid, 8).raw_volume_error().unwrap();
        assert!(error != 0.0 && error.abs() < 3e-5, "{error}");
        assert!(RegionFractions::new(&brick, &grid, 8).raw_volume_error().unwrap().abs() < 1e-13);
    }

    #[test]
    fn overlap_counts_once() {
        let grid = grid();
        let ball = Region::Sphere { centre: Vector::ZERO, radius: 0.5 };
        let inner = Region::Sphere { centre: Vector::new(0.1, 0.0, 0.0), radius: 0.2 };
        let both = Region::Union(vec![inner, ball.clone()]);
        assert_eq!(both.volume(), None);
        assert!((total(&both, &grid, 8) / ball.volume().unwrap() - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_water_level_inside_a_cell_is_exact() {
        let grid = grid();
        let pool = Region::HalfSpace { point: Vector::new(0.0, 0.0, -0.513), normal: Vector::Z };
        let box_bottom = 2.0 * 1.8 * (1.1 - 0.513);
        assert!((total(&pool, &grid, 2) - box_bottom).abs() < 1e-12);
        let slope = Region::HalfSpace { point: Vector::ZERO, normal: Vector::new(0.4, 0.2, 1.0) };
        assert!((total(&slope, &grid, 8) - 0.5 * 2.0 * 1.8 * 2.2).abs() < 1e-9);
        for x in [0.0, 0.0137, 0.021] {
            let side = Region::HalfSpace { point: Vector::new(x, 0.0, 0.0), normal: Vector::new(-1.0, 0.0, 1e-9) };
            assert!((total(&side, &grid, 4) - (1.0 - x) * 1.8 * 2.2).abs() < 1e-7, "{x}");
        }
        // Beside it in a union a sheet thinner than a cell is not lost.
        let side = Region::HalfSpace { point: Vector::new(0.5, 0.0, 0.0), normal: -Vector::X };
        let sheet = Region::Box { lower: Vector::new(-1.0, -0.9, 0.01), upper: Vector::new(0.0, 0.9, 0.03) };
        let both = total(&Region::Union(vec![side, sheet]), &grid, 4);
        assert!((both - 0.5 * 1.8 * 2.2 - 1.8 * 0.02).abs() < 1e-9, "{both}");
    }

    #[test]
    fn cells_are_placed_as_their_points_are() {
        let grid = grid();
        let region = Region::Spheroid {
            centre: Vector::new(0.05, 0.1, -0.2),
            semi_axes: Vector::new(0.7, 0.3, 0.25),
            orientation: tilted(),
        };
        let fractions = RegionFractions::new(&region, &grid, 6);
        for n in 0..4000_isize {
            let (i, j, k) = (n % 40, n / 40 % 36, (n * 7) % 44);
            let fraction = fractions.fraction(i, j, k);
            let centre_in = region.contains(grid.centre(i, j, k));
            assert!(if centre_in { fraction > 0.0 } else { fraction < 1.0 });
        }
    }

    #[test]
    fn a_droplet_smaller_than_a_cell_is_not_lost() {
        let grid = Grid::new([4, 4, 4], Vector::ZERO, Vector::ONE);
        for region in [
            Region::Sphere { centre: Vector::new(0.51, 0.53, 0.6), radius: 0.01 },
            Region::Sphere { centre: Vector::new(0.5, 0.5, 0.5), radius: 0.01 },
        ] {
            assert!((total(&region, &grid, 8) / region.volume().unwrap() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn balls_touch_where_they_should() {
        let region = Region::Spheroid {
            centre: Vector::new(1.0, 2.0, 3.0),
            semi_axes: Vector::new(2.0, 1.0, 0.5),
            orientation: tilted(),
        };
        // Along the outward normal of a surface point the distance is the step itself.
        for (a, b) in [(0.3_f64, 0.2_f64), (1.0, 1.1), (2.5, -0.4), (0.0, 0.0)] {
            let on = Vector::new(2.0 * a.cos() * b.cos(), a.sin() * b.cos(), 0.5 * b.sin());
            let normal = (on / Vector::new(4.0, 1.0, 0.25)).normalize();
            let centre = tilted() * (on + 0.3 * normal) + Vector::new(1.0, 2.0, 3.0);
            assert!(region.touches_ball(centre, 0.300_001) && !region.touches_ball(centre, 0.299_999));
        }
        let pool = Region::HalfSpace { point: Vector::ZERO, normal: 3.0 * Vector::Z };
        assert!(pool.touches_ball(Vector::new(5.0, 1.0, 0.2), 0.21) && !pool.touches_ball(Vector::Z, 0.9));
        let brick = Region::Box { lower: Vector::ZERO, upper: Vector::ONE };
        assert!(!brick.touches_ball(Vector::splat(1.1), 0.17) && brick.touches_ball(Vector::splat(1.1), 0.18));
    }
}
