//! Distances to the surfaces of regions, and the share of a cell by lines along their normals.

use super::{Region, Wave};
use crate::{Real, Vector};

/// Halvings by which a line finds the surface: to 1e-9 of the cell.
const HALVINGS: usize = 30;

impl Region {
    /// Whether vertical lines do not tell where its surface lies in a cell: it stands upright, and passes between them.
    pub(super) fn is_upright(&self) -> bool {
        matches!(self, Self::HalfSpace { normal, .. } if normal.z.abs() < normal.x.abs().max(normal.y.abs()))
    }

    /// Whether vertical lines through it are not reckoned.
    pub(super) fn has_level_alone(&self) -> bool {
        match self {
            Self::Cylinder { .. } | Self::Wavy { .. } | Self::Sampled(_) => true,
            Self::Union(members) => members.iter().any(Self::has_level_alone),
            Self::Box { .. } | Self::Sphere { .. } | Self::Spheroid { .. } | Self::HalfSpace { .. } => false,
        }
    }

    /// A length that is negative within the region and positive outside, never larger than the distance to the surface \[m].
    pub(super) fn level(&self, point: Vector) -> Real {
        match self {
            Self::Box { lower, upper } => (*lower - point).max(point - *upper).max_element(),
            Self::Sphere { centre, radius } => point.distance(*centre) - radius,
            Self::Spheroid { centre, semi_axes, orientation } => {
                let scaled = (orientation.inverse() * (point - *centre) / *semi_axes).length();
                (scaled - 1.0) * semi_axes.min_element()
            }
            Self::HalfSpace { point: on, normal } => (point - *on).dot(normal.normalize_or_zero()),
            Self::Cylinder { centre, axis, semi_axes: [a, b], wave } => {
                let from = point - *centre;
                let across = [1, 2].map(|n| from[(axis + n) % 3]);
                let scaled = (across[0] / a).hypot(across[1] / b);
                ((scaled - 1.0) * a.min(*b) - wave.at(from[*axis])) / wave.steepness()
            }
            Self::Wavy { crest, up, along, wave } => {
                let from = point - *crest;
                (from[*up] + wave.amplitude - wave.at(from[*along])) / wave.steepness()
            }
            Self::Sampled(liquid) => liquid.level(point),
            Self::Union(members) => members.iter().map(|m| m.level(point)).fold(Real::INFINITY, Real::min),
        }
    }

    /// Share of the cell with this centre and these half edges, on `lines` x `lines` lines along the direction in which the surface is
    /// steepest, each of which it passes once; what lies between two ends that are both outside, or both inside, is looked for in as many
    /// pieces of the line.
    pub(super) fn share_along_normal(&self, centre: Vector, half: Vector, lines: u32) -> Real {
        let slopes: [Real; 3] = std::array::from_fn(|d| {
            let step = half * Vector::AXES[d];
            (self.level(centre + step) - self.level(centre - step)).abs() / half[d]
        });
        let along = (1..3).fold(0, |best, d| if slopes[d] > slopes[best] * (1.0 + 1e-9) { d } else { best });
        let (e, f) = ((along + 1) % 3, (along + 2) % 3);
        let place = |n: u32| (2.0 * Real::from(n) + 1.0) / Real::from(lines) - 1.0;
        let mut sum = 0.0;
        for a in 0..lines {
            for b in 0..lines {
                let inside = |t: Real| {
                    let mut point = centre;
                    point[e] += place(a) * half[e];
                    point[f] += place(b) * half[f];
                    point[along] += t * half[along];
                    self.level(point) <= 0.0
                };
                let [first, last] = [inside(-1.0), inside(1.0)];
                let end_of = |piece: u32| 2.0 * Real::from(piece) / Real::from(lines) - 1.0;
                sum += if first != last {
                    share_of_line(inside, [-1.0, 1.0], first)
                } else if (1..lines).all(|piece| inside(end_of(piece)) == first) {
                    Real::from(u8::from(first))
                } else {
                    let pieces = (1..=lines).map(|piece| {
                        let ends = [piece - 1, piece].map(end_of);
                        let [from, to] = ends.map(&inside);
                        if from == to { Real::from(u8::from(from)) } else { share_of_line(inside, ends, from) }
                    });
                    pieces.sum::<Real>() / Real::from(lines)
                };
            }
        }
        sum / Real::from(lines * lines)
    }
}

/// Share of a line that lies `inside`, which passes a surface once between its ends; `first` says whether it begins inside.
fn share_of_line(inside: impl Fn(Real) -> bool, [from, to]: [Real; 2], first: bool) -> Real {
    let (mut low, mut high) = (from, to);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if inside(middle) == first {
            low = middle;
        } else {
            high = middle;
        }
    }
    let reached = (low - from) / (to - from);
    if first { reached } else { 1.0 - reached }
}

impl Wave {
    /// No wave.
    pub const NONE: Self = Self { amplitude: 0.0, length: 1.0 };

    /// Height of the wave at a distance from its crest \[m].
    pub(super) fn at(&self, distance: Real) -> Real {
        self.amplitude * (std::f64::consts::TAU * distance / self.length).cos()
    }

    /// Most that the distance along the surface is longer than that along the wave.
    fn steepness(&self) -> Real {
        1.0_f64.hypot(std::f64::consts::TAU * self.amplitude / self.length)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::RegionFractions;
    use super::*;
    use crate::Quaternion;
    use crate::grid::Grid;

    fn total(region: &Region, grid: &Grid) -> Real {
        let fractions = RegionFractions::along_normals(region, grid, 8);
        let [n1, n2, n3] = grid.cells.map(|n| n as isize);
        let cells = (0..n3).flat_map(|k| (0..n2).flat_map(move |j| (0..n1).map(move |i| [i, j, k])));
        cells.map(|[i, j, k]| fractions.fraction(i, j, k)).sum::<Real>() * grid.cell_volume()
    }

    #[test]
    fn bodies_between_the_ends_of_lines_do_not_vanish() {
        let grid = Grid::new([5, 5, 5], Vector::ZERO, Vector::splat(5.0));
        let middle = Vector::splat(2.5);
        let exact = |a: Real, b: Real, c: Real| PI / 0.75 * a * b * c;
        let ball = Region::Sphere { centre: middle, radius: 0.4 };
        assert!((total(&ball, &grid) / exact(0.4, 0.4, 0.4) - 1.0).abs() < 1e-12);
        let disc = |half: Real| Region::Spheroid {
            centre: middle,
            semi_axes: Vector::new(2.2, 2.2, half),
            orientation: Quaternion::IDENTITY,
        };
        for half in [0.4, 0.05, 0.01] {
            assert!((total(&disc(half), &grid) / exact(2.2, 2.2, half) - 1.0).abs() < 1e-9, "{half}");
        }
        let pipe = Region::Cylinder { centre: middle, axis: 1, semi_axes: [0.3, 0.35], wave: Wave::NONE };
        assert!((total(&pipe, &grid) / (PI * 0.3 * 0.35 * 5.0) - 1.0).abs() < 0.1);
        // A hole between two bodies that fill the rest of a cell is a hole.
        let [below, above] = [[0.0, 2.3], [2.6, 5.0]]
            .map(|[low, high]| Region::Box { lower: Vector::new(0.0, 0.0, low), upper: Vector::new(5.0, 5.0, high) });
        assert!((total(&Region::Union(vec![below, above]), &grid) / (25.0 * 4.7) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn cylinders_and_waves_fill_their_volume() {
        let grid = Grid::new([24, 4, 20], Vector::new(-1.2, -0.2, -1.0), Vector::new(1.2, 0.2, 1.0));
        let pipe =
            Region::Cylinder { centre: Vector::new(0.1, 0.0, 0.03), axis: 1, semi_axes: [0.5, 0.7], wave: Wave::NONE };
        assert!((total(&pipe, &grid) / (PI * 0.35 * 0.4) - 1.0).abs() < 1e-4);
        let sea = Region::Wavy {
            crest: Vector::new(0.3, 0.0, 0.11),
            up: 2,
            along: 0,
            wave: Wave { amplitude: 0.1, length: 1.2 },
        };
        assert!((total(&sea, &grid) / (2.4 * 0.4 * 1.01) - 1.0).abs() < 1e-5);
        let crest = sea.contains(Vector::new(0.3, 0.1, 0.1099)) && !sea.contains(Vector::new(0.3, 0.1, 0.1101));
        assert!(crest && !sea.contains(Vector::new(0.9, 0.0, -0.05)) && sea.contains(Vector::new(0.9, 0.0, -0.0901)));
        let tall = Grid::new([20, 20, 24], Vector::splat(-1.0), Vector::new(1.0, 1.0, 1.4));
        let neck = Region::Cylinder {
            centre: Vector::ZERO,
            axis: 2,
            semi_axes: [0.6, 0.6],
            wave: Wave { amplitude: 0.1, length: 1.2 },
        };
        assert!((total(&neck, &tall) / (PI * (0.36 + 0.005) * 2.4) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn lines_along_the_normal_are_exact_where_vertical_columns_are_not() {
        let grid = Grid::new([20; 3], Vector::splat(-1.0), Vector::ONE);
        let wall = Region::HalfSpace { point: Vector::new(0.537, 0.0, 0.0), normal: Vector::X };
        let share = |fractions: &RegionFractions<'_>| fractions.fraction(15, 3, 4);
        assert!((share(&RegionFractions::along_normals(&wall, &grid, 8)) - 0.37).abs() < 1e-8);
        assert!((share(&RegionFractions::new(&wall, &grid, 8)) - 0.37).abs() < 1e-8);
        let in_columns = Region::Union(vec![wall]);
        assert!((share(&RegionFractions::new(&in_columns, &grid, 8)) - 0.37).abs() > 1e-3);
    }
}
