//! Walls that the interface meets at an angle: what stands behind them.
//!
//! Behind a wall the interface goes on straight at the contact angle theta, measured in the liquid: from the first layer of cells before
//! the wall to the first behind it it moves along the wall by `cot(theta)` of the distance of the two, out of the liquid. A mirror image,
//! as at 90 degrees, is one that does not move (after Afkhami and Bussmann 2008, Int. J. Numer. Meth. Fluids 57, 453, and 2009, 61, 827,
//! who put fractions and heights behind walls such that the interface has the angle there).
//!
//! A wall with two angles lets the interface stand at any between the receding and the advancing one: it goes on behind the wall at the
//! angle that it has before it, within these (Dupont and Legendre 2010, J. Comput. Phys. 229, 2453). What holds the line of contact is in
//! `surface_tension/pins.rs`.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::GHOSTS;
use sazanami_numerics::{Real, Vector};

use super::{Neighbourhood, neighbourhood};
use crate::boundary::Boundary;

/// Cotangents at which the mirror image stands behind a wall.
const MIRROR: [Real; 2] = [0.0; 2];

/// Distance in a neighbourhood between neighbours in each direction.
const STRIDES: [isize; 3] = [1, 3, 9];

/// Contact angles at the walls of the box that a rank has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wetting {
    /// Cotangents of the advancing and the receding angle at the lower and the upper side in each direction; 0 where the mirror image
    /// stands, at 90 degrees, and where there is no wall.
    cotangents: [[[Real; 2]; 2]; 3],
    cells: [usize; 3],
    spacing: Vector,
    strides: [isize; 3],
}

impl Wetting {
    /// Those of `boundary` on this rank.
    pub fn new(domain: &Domain, boundary: &Boundary) -> Self {
        let cotangents = std::array::from_fn(|d| {
            std::array::from_fn(|side| if domain.at_box_end(d, side) { boundary.cotangents(d, side) } else { MIRROR })
        });
        Self { cotangents, cells: domain.cells(), spacing: domain.grid().spacing, strides: domain.strides() }
    }

    /// Cotangents of the advancing and the receding angle at a side, if it is a wall that is met at other than 90 degrees.
    #[inline]
    pub fn cotangents(&self, direction: usize, side: usize) -> Option<[Real; 2]> {
        Some(self.cotangents[direction][side]).filter(|&cotangents| cotangents != MIRROR)
    }

    /// Whether a wall is met at other than 90 degrees.
    #[inline]
    pub fn is_given(&self) -> bool {
        self.cotangents != [[MIRROR; 2]; 3]
    }

    /// Index of the cell at `at` in each direction.
    fn index(&self, at: usize) -> [isize; 3] {
        let [_, row, plane] = self.strides.map(|stride| stride as usize);
        [at % row, at % plane / row, at / plane].map(|n| n as isize - GHOSTS as isize)
    }

    /// Direction of the wall with an angle that the cell at `at` lies behind, if it does.
    pub fn behind(&self, at: usize) -> Option<usize> {
        let index = self.index(at);
        (0..3).find(|&d| {
            let [lower, upper] = self.cotangents[d];
            (lower != MIRROR && index[d] < 0) || (upper != MIRROR && index[d] >= self.cells[d] as isize)
        })
    }

    /// The neighbourhood of the cell at `at`, with the liquid behind walls at their angles.
    #[inline]
    pub fn neighbourhood(&self, c: &[Real], at: usize) -> Neighbourhood {
        let mut cells = neighbourhood(c, at, self.strides);
        if self.is_given() {
            let index = self.index(at);
            for (d, cotangents) in self.cotangents.iter().enumerate() {
                for (side, &cotangents) in cotangents.iter().enumerate().filter(|(_, pair)| **pair != MIRROR) {
                    if index[d] == [0, self.cells[d] as isize - 1][side] {
                        self.lean(&mut cells, d, side, cotangents);
                    }
                }
            }
        }
        cells
    }

    /// What ends a column normal to the wall on `side` of `direction` behind it, the first cell before the wall being at `at`: full or empty
    /// where the interface does not reach the wall in the column, neither where it does.
    pub fn end(&self, c: &[Real], at: usize, direction: usize, side: usize) -> Real {
        let out = STRIDES[direction] * [-1, 1][side];
        self.neighbourhood(c, at)[(13 + out) as usize]
    }

    /// Moves the layer before the wall on `side` of `direction` along the wall to the layer behind it; from beyond the neighbourhood comes
    /// what is at its edge.
    fn lean(&self, cells: &mut Neighbourhood, direction: usize, side: usize, [least, most]: [Real; 2]) {
        let across = [(direction + 1) % 3, (direction + 2) % 3];
        let [e, f] = across.map(|d| STRIDES[d]);
        let out = STRIDES[direction] * [-1, 1][side];
        let layer_at = |from: isize| -> [[Real; 3]; 3] {
            std::array::from_fn(|a| {
                std::array::from_fn(|b| cells[(13 + from + (a as isize - 1) * e + (b as isize - 1) * f) as usize])
            })
        };
        let layer = layer_at(0);
        let rise = |low: [Real; 3], high: [Real; 3]| {
            [1.0, 2.0, 1.0].into_iter().zip(low.into_iter().zip(high)).map(|(w, (low, high))| w * (high - low)).sum()
        };
        let turned: [[Real; 3]; 3] = std::array::from_fn(|b| std::array::from_fn(|a| layer[a][b]));
        let rises: [Real; 2] = [rise(layer[0], layer[2]), rise(turned[0], turned[2])];
        let edges = across.map(|d| self.spacing[d]);
        let gradient = [rises[0] / edges[0], rises[1] / edges[1]];
        let length = gradient[0].hypot(gradient[1]);
        if length == 0.0 {
            return;
        }
        let cotangent = if least == most {
            least
        } else {
            // The gradient towards the wall over that along it: both sums of weights are taken out.
            let sum = |layer: [[Real; 3]; 3]| -> Real {
                let weights = [1.0, 2.0, 1.0];
                (0..9).map(|n| weights[n / 3] * weights[n % 3] * layer[n / 3][n % 3]).sum()
            };
            let towards = (sum(layer) - sum(layer_at(-out))) / (16.0 * self.spacing[direction]);
            (towards / (length / 8.0)).clamp(least, most)
        };
        // Along the wall out of the liquid, in cells.
        let by = [0, 1].map(|n| -gradient[n] / length * cotangent * self.spacing[direction] / edges[n]);
        let place = |n: usize, by: Real| {
            let place = (n as Real - by).clamp(0.0, 2.0);
            let low = (place as usize).min(1);
            (low, place - low as Real)
        };
        for a in 0..3 {
            for b in 0..3 {
                let ((i, x), (j, y)) = (place(a, by[0]), place(b, by[1]));
                let along = |i: usize| layer[i][j] + y * (layer[i][j + 1] - layer[i][j]);
                let value = along(i) + x * (along(i + 1) - along(i));
                cells[(13 + out + (a as isize - 1) * e + (b as isize - 1) * f) as usize] = value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::Side;
    use crate::interface::{mixed_normal, volume_below};
    use sazanami_numerics::grid::Grid;

    /// The normal found beside a floor met at `angles`, advancing and receding [degrees], by a plane of slope `true_angle` that turns by `azimuth` [degrees].
    fn normal_at_floor(angles_at_floor: [Real; 2], true_angle: Real, azimuth: Real) -> Vector {
        let sides = [[Side::Periodic; 2], [Side::Periodic; 2], [Side::NoSlip; 2]];
        let mut angles = [[[std::f64::consts::FRAC_PI_2; 2]; 2]; 3];
        angles[2][0] = angles_at_floor.map(Real::to_radians);
        let boundary = Boundary::new(sides).unwrap().with_contact_angles(angles);
        let domain = Domain::solo(Grid::new([8; 3], Vector::ZERO, Vector::splat(8.0)), boundary.periodic());
        let (sin, cos) = true_angle.to_radians().sin_cos();
        let (y, x) = azimuth.to_radians().sin_cos();
        let normal = Vector::new(sin * x, sin * y, cos);
        let mut c = domain.field(0.0);
        domain.set(&mut c, |i, j, k| {
            let m = normal / normal.abs().element_sum();
            // The plane passes the middle of the cell (4, 4, 0).
            let from = Vector::new((i - 4) as Real, (j - 4) as Real, k as Real) - 0.5;
            let alpha = -m.dot(from) - (0..3).map(|d| m[d].min(0.0)).sum::<Real>();
            volume_below(m.abs().to_array(), alpha)
        });
        domain.fill_halos(&mut [(&mut c, &boundary.volume_fraction_rules())]);
        let wetting = Wetting::new(&domain, &boundary);
        let cells = wetting.neighbourhood(c.data(), c.at(4, 4, 0));
        Vector::from_array(mixed_normal(&cells).unwrap()).normalize()
    }

    #[test]
    fn a_plane_at_the_angle_keeps_its_normal_beside_the_wall() {
        for (angle, azimuth) in [(60.0, 0.0), (120.0, 0.0), (75.0, 90.0), (60.0, 180.0), (110.0, 20.0), (75.0, 45.0)] {
            let normal = normal_at_floor([angle; 2], angle, azimuth);
            let found = normal.z.acos().to_degrees();
            assert!((found - angle).abs() < 4.0, "{angle} {azimuth}: {found}");
            // Negative control: the mirror image turns it towards 90 degrees.
            let mirrored = normal_at_floor([90.0; 2], angle, azimuth).z.acos().to_degrees();
            assert!((mirrored - angle).abs() > 5.0, "{angle} {azimuth}: {mirrored}");
        }
    }

    #[test]
    fn between_two_angles_a_plane_keeps_its_own() {
        for (angle, azimuth) in [(60.0, 0.0), (100.0, 0.0), (75.0, 90.0), (110.0, 20.0)] {
            let at = |angles| normal_at_floor(angles, angle, azimuth).z.acos().to_degrees();
            let [between, beyond] = [at([130.0, 50.0]), at([angle - 20.0, angle - 40.0])];
            assert!((between - angle).abs() < 5.0, "{angle} {azimuth}: {between}");
            // Negative control: an angle larger than both is pulled to the advancing one.
            assert!(beyond < angle - 5.0, "{angle} {azimuth}: {beyond}");
        }
    }
}
