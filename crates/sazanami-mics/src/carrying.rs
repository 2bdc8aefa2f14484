//! Velocities that are given, not computed: they carry the liquid in tests of the transport.

use std::f64::consts::PI;

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::{Field, Grid};
use sazanami_numerics::{Real, Vector};

/// A velocity field given in the whole box and at all times. On the faces of the grid its discrete divergence is zero to
/// round-off: face values are differences of a stream function, or means over the face.
///
/// In a box of length `L` the coordinates of the vortices are `x/L`, and a cube of 1 m with a `speed` of 1 m/s is the
/// case of the literature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CarryingFlow {
    /// The same velocity everywhere.
    Uniform {
        /// Velocity [m/s].
        velocity: Vector,
    },
    /// The reversed single vortex of Rider and Kothe (1998, J. Comput. Phys. 141) in the plane of x1 and x3: stream function
    /// `speed L1 sin^2(pi x1/L1) sin^2(pi x3/L3) cos(pi t/period) / pi`. After a period all liquid is back.
    ReversedVortex {
        /// Largest velocity in a square box [m/s].
        speed: Real,
        /// Time after which all liquid is back \[s].
        period: Real,
    },
    /// The deformation in three dimensions of LeVeque (1996, SIAM J. Numer. Anal. 33):
    /// `u1 = 2 speed sin^2(pi x1) sin(2 pi x2) sin(2 pi x3) cos(pi t/period)`, `u2` and `u3` alike with -1 for 2; in a box that
    /// is no cube each component is stretched with its length over L1.
    Deformation {
        /// Half the largest velocity along x1 [m/s].
        speed: Real,
        /// Time after which all liquid is back \[s].
        period: Real,
    },
}

impl CarryingFlow {
    /// Sets the normal velocity on all faces of this rank at `time` \[s]; ghosts are not filled.
    pub fn set_faces(&self, domain: &Domain, time: Real, faces: &mut [Field<Real>; 3]) {
        let start = domain.start().map(|start| start as isize);
        for (d, field) in faces.iter_mut().enumerate() {
            domain.for_each_row(&domain.faces(d), field.data_mut(), |row, u| {
                for (u, i) in u.iter_mut().zip(0..) {
                    *u = self.on_face(domain.grid(), d, [i + start[0], row.j + start[1], row.k + start[2]], time);
                }
            });
        }
    }

    /// Largest sum over the directions of `|u_f| / dx` of a cell at time zero, when the flow is fastest, over all
    /// ranks [1/s].
    #[must_use]
    pub fn rate(&self, domain: &Domain) -> Real {
        let (grid, start) = (domain.grid(), domain.start().map(|start| start as isize));
        let part = |d: usize, cell: [isize; 3]| {
            let mut above = cell;
            above[d] += 1;
            let [low, high] = [cell, above].map(|face| self.on_face(grid, d, face, 0.0).abs());
            low.max(high) / grid.spacing[d]
        };
        domain.max(domain.max_rows(&domain.interior(), |row| {
            let cell = |i: isize| [i + start[0], row.j + start[1], row.k + start[2]];
            let rate = |i: isize| (0..3).map(|d| part(d, cell(i))).sum::<Real>();
            (0..row.len as isize).map(rate).fold(0.0, |a, b| sazanami_parallel::Reduction::Max.combine(a, b))
        }))
    }

    /// Upper bounds of its components in a box of these edges \[m] [m/s].
    #[must_use]
    pub fn largest(&self, extent: Vector) -> Vector {
        match *self {
            Self::Uniform { velocity } => velocity.abs(),
            Self::ReversedVortex { speed, .. } => speed.abs() * Vector::new(extent.x / extent.z, 0.0, 1.0),
            Self::Deformation { speed, .. } => speed.abs() * Vector::new(2.0, 1.0, 1.0) * extent / extent.x,
        }
    }

    /// Directions in which it has a velocity at the sides of the box.
    #[must_use]
    pub fn crosses_sides(&self) -> [bool; 3] {
        match self {
            Self::Uniform { velocity } => velocity.to_array().map(|u| u != 0.0),
            Self::ReversedVortex { .. } | Self::Deformation { .. } => [false; 3],
        }
    }

    /// Normal velocity on the lower face in direction `d` of the cell with these global indices [m/s].
    fn on_face(&self, grid: &Grid, d: usize, cell: [isize; 3], time: Real) -> Real {
        let (h, extent) = (grid.spacing, grid.extent());
        // Width of a cell over the length of the box.
        let part = grid.cells.map(|n| 1.0 / n as Real);
        let modulation = |period: Real| (PI * time / period).cos();
        match *self {
            Self::Uniform { velocity } => velocity[d],
            Self::ReversedVortex { speed, period } => {
                let stream = |i: isize, k: isize| {
                    let (x, z) = ((PI * i as Real * part[0]).sin(), (PI * k as Real * part[2]).sin());
                    speed * extent.x * (x * x * z * z * modulation(period) / PI)
                };
                let [i, _, k] = cell;
                match d {
                    0 => -(stream(i, k + 1) - stream(i, k)) / h.z,
                    2 => (stream(i + 1, k) - stream(i, k)) / h.x,
                    _ => 0.0,
                }
            }
            Self::Deformation { speed, period } => {
                let squared = |d: usize| (PI * cell[d] as Real * part[d]).sin().powi(2);
                // Mean of sin(2 pi x) over a cell.
                let mean = |d: usize| {
                    let [low, high] = [cell[d], cell[d] + 1].map(|i| (2.0 * PI * i as Real * part[d]).cos());
                    (low - high) / (2.0 * PI * part[d])
                };
                let amplitude = if d == 0 { 2.0 } else { -1.0 } * modulation(period) * (speed * extent[d] / extent.x);
                amplitude * squared(d) * (mean((d + 1) % 3) * mean((d + 2) % 3))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest `|div u| h/u`, over the largest velocity on a face.
    fn divergence(flow: CarryingFlow, time: Real) -> Real {
        let grid = Grid::new([12, 10, 14], Vector::new(-0.3, 0.0, 0.1), Vector::new(0.9, 1.0, 1.5));
        let on_face = |d: usize, cell: [isize; 3]| flow.on_face(&grid, d, cell, time);
        largest_divergence(&grid, on_face)
    }

    fn largest_divergence(grid: &Grid, on_face: impl Fn(usize, [isize; 3]) -> Real) -> Real {
        let (mut largest, mut speed): (Real, Real) = (0.0, 0.0);
        let [n1, n2, n3] = grid.cells.map(|n| n as isize);
        for cell in (0..n1).flat_map(|i| (0..n2).flat_map(move |j| (0..n3).map(move |k| [i, j, k]))) {
            let mut sum = 0.0;
            for d in 0..3 {
                let mut above = cell;
                above[d] += 1;
                sum += (on_face(d, above) - on_face(d, cell)) / grid.spacing[d];
                speed = speed.max(on_face(d, cell).abs());
            }
            largest = largest.max(sum.abs());
        }
        largest * grid.spacing.min_element() / speed
    }

    #[test]
    fn the_flows_are_free_of_divergence_on_the_faces() {
        let flows = [
            CarryingFlow::Uniform { velocity: Vector::new(1.0, -2.0, 0.5) },
            CarryingFlow::ReversedVortex { speed: 2.0, period: 8.0 },
            CarryingFlow::Deformation { speed: 0.5, period: 3.0 },
        ];
        for flow in flows {
            assert!(divergence(flow, 0.7) < 1e-13, "{flow:?}: {}", divergence(flow, 0.7));
        }
        // Negative control: the deformation taken at the middle of each face.
        let grid = Grid::new([12; 3], Vector::ZERO, Vector::ONE);
        let pointwise = |d: usize, cell: [isize; 3]| {
            let at = |e: usize| (cell[e] as Real + if e == d { 0.0 } else { 0.5 }) / 12.0;
            let other = |e: usize| (2.0 * PI * at(e)).sin();
            let squeezed = if d == 0 { 0.9 } else { 1.0 };
            let amplitude = if d == 0 { 2.0 } else { -1.0 };
            squeezed * amplitude * (PI * at(d)).sin().powi(2) * other((d + 1) % 3) * other((d + 2) % 3)
        };
        assert!(largest_divergence(&grid, pointwise) > 1e-3);
    }

    #[test]
    fn the_vortices_swing_back() {
        let grid = Grid::new([8; 3], Vector::ZERO, Vector::ONE);
        for flow in [
            CarryingFlow::ReversedVortex { speed: 1.0, period: 8.0 },
            CarryingFlow::Deformation { speed: 1.0, period: 8.0 },
        ] {
            let at = |time: Real| flow.on_face(&grid, 2, [2, 3, 5], time);
            assert!((at(1.0) + at(7.0)).abs() < 1e-14 && at(1.0).abs() > 0.05 && at(4.0).abs() < 1e-15);
        }
    }
}
