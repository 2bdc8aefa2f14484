//! Pressure and velocity between the particles of water, as a probe at a place would read them.

use std::ops::{AddAssign, Mul};

use sazanami_numerics::{Matrix, Real, Vector};

use super::{Sides, TankInside};

/// Value at a place of the straight line through the particles near it that is best by the squares weighted by kernel and volume (Lancaster and
/// Salkauskas 1981, linear): exact for what grows linearly, at walls and at the free surface too. Where the particles hardly surround the place, as
/// beyond the surface, their weighted mean (Shepard 1968).
#[derive(Clone, Copy, Debug)]
pub struct Interpolation<'a, W> {
    /// The tank; across periodic sides particles are near each other.
    pub tank: &'a TankInside,
    /// Places of the particles \[m].
    pub position: &'a [Vector],
    /// Their volumes [m^3].
    pub volume: &'a [Real],
    /// Distance from which on a particle has no weight \[m].
    pub reach: Real,
    /// Weight of a particle by its distance \[m].
    pub kernel: W,
    /// Least number of particles within reach; with fewer there is no value.
    pub least: usize,
}

impl<W: Fn(Real) -> Real> Interpolation<'_, W> {
    /// Value at a place of a quantity with one value per particle; `None` where too few particles are near.
    pub fn at<T: Mean>(&self, place: Vector, values: &[T]) -> Option<T> {
        Some(self.near(place)?.mean(|n| values[n]))
    }

    /// The particles near a place; `None` where they are too few.
    pub fn near(&self, place: Vector) -> Option<Near> {
        self.among(place, [[None; 2]; 3])
    }

    /// The same with their images behind walls, floor and lid: for what does not change across these.
    pub fn near_with_images(&self, place: Vector) -> Option<Near> {
        let TankInside { x, y, floor, lid, ends, sides, .. } = *self.tank;
        let walls = |kind: Sides, at: [Real; 2]| at.map(|at| (kind == Sides::Walls).then_some(at));
        self.among(place, [walls(ends, x), walls(sides, y), [Some(floor), lid]])
    }

    /// The particles near a place and their images in `mirrors` normal to each direction.
    fn among(&self, place: Vector, mirrors: [[Option<Real>; 2]; 3]) -> Option<Near> {
        let within = |between: Real| between.abs() < self.reach;
        let mut near: Vec<(usize, Vector, Real)> = Vec::new();
        for (n, &position) in self.position.iter().enumerate() {
            let way = self.tank.way(place, position);
            let ways = [0, 1, 2].map(|d| {
                let image = |mirror: Option<Real>| mirror.map(|at| 2.0 * at - position[d] - place[d]);
                [Some(way[d]), image(mirrors[d][0]), image(mirrors[d][1])].map(|way| way.filter(|&way| within(way)))
            });
            for x in ways[0].into_iter().flatten() {
                for y in ways[1].into_iter().flatten() {
                    for z in ways[2].into_iter().flatten() {
                        let way = Vector::new(x, y, z);
                        if within(way.length()) {
                            near.push((n, way, self.volume[n] * (self.kernel)(way.length())));
                        }
                    }
                }
            }
        }
        let sum: Real = near.iter().map(|(.., weight)| weight).sum();
        if near.len() < self.least.max(1) || sum <= 0.0 {
            return None;
        }
        let (mean, lean) = leaning(&near, sum, self.reach);
        let share = |(n, way, weight): (usize, Vector, Real)| (n, weight / sum * (1.0 - lean.dot(way - mean)));
        Some(Near { weights: near.into_iter().map(share).collect() })
    }
}

/// Quantity of which a mean can be taken.
pub trait Mean: Copy + Default + AddAssign + Mul<Real, Output = Self> {}

impl<T: Copy + Default + AddAssign + Mul<Real, Output = T>> Mean for T {}

/// The particles near a place, for the means of several quantities there.
#[derive(Clone, Debug, PartialEq)]
pub struct Near {
    /// Number and weight of each particle; the weights add up to one.
    weights: Vec<(usize, Real)>,
}

/// Least spread of the particles around a place in any direction, over their reach.
const SPREAD: Real = 0.04;
/// Largest distance of a place from the middle of the particles, in their spread along it. On a lattice with a reach of 2.6 spacings it is 2.0 on a
/// wall, 2.9 on an edge, 3.7 in a corner, and 11 half a spacing beyond the surface.
const BESIDE: Real = 4.5;

/// Middle of ways that are weighted by their third entries, of the given `sum`, and how the weights have to lean against the way from it so that
/// their mean is the value at the beginning of the ways: not at all where they do not span space or lie on one side of it.
fn leaning(near: &[(usize, Vector, Real)], sum: Real, reach: Real) -> (Vector, Vector) {
    let mean = near.iter().map(|&(_, way, weight)| weight * way).sum::<Vector>() / sum;
    let mut spread = Matrix::ZERO;
    for &(_, way, weight) in near {
        let off = way - mean;
        spread += Matrix::from_cols(off.x * off, off.y * off, off.z * off) * (weight / sum);
    }
    // No spread is larger than the largest sum of a row (Gershgorin), and none smaller than the determinant over its square.
    let rows = spread.to_cols_array_2d().map(|row| row.iter().map(|x| x.abs()).sum::<Real>());
    let largest = rows.into_iter().fold(0.0, Real::max);
    if spread.determinant() <= (SPREAD * reach * largest).powi(2) {
        return (mean, Vector::ZERO);
    }
    let lean = spread.inverse() * mean;
    if lean.dot(mean) > BESIDE * BESIDE { (mean, Vector::ZERO) } else { (mean, lean) }
}

impl Near {
    /// Mean of a quantity by its value of each particle.
    pub fn mean<T: Mean>(&self, value: impl Fn(usize) -> T) -> T {
        let mut sum = T::default();
        self.weights.iter().for_each(|&(n, weight)| sum += value(n) * weight);
        sum
    }
}

/// A square grid in a section normal to x2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionWindow {
    /// Bounds in x1 \[m].
    pub x: [Real; 2],
    /// Bounds in x3 \[m].
    pub z: [Real; 2],
    /// Place of the section on x2 \[m].
    pub plane: Real,
    /// Distance of the grid points \[m].
    pub spacing: Real,
}

/// Velocities, or other vectors, on the grid of a window: place and value at x1, x3 \[m], row by row from below. Points
/// without enough water near them are left out.
pub fn vectors_in_section<W: Fn(Real) -> Real>(
    interpolation: &Interpolation<W>,
    window: &SectionWindow,
    values: &[Vector],
) -> Vec<([Real; 2], [Real; 2])> {
    let points = |[from, to]: [Real; 2]| -> Vec<Real> {
        let count = ((to - from) / window.spacing + 1e-9).floor().max(0.0) as usize;
        (0..=count).map(|n| from + n as Real * window.spacing).collect()
    };
    // Only what can reach the window is looked at again and again.
    let near = |place: &Vector| {
        let within =
            |value: Real, [from, to]: [Real; 2]| value > from - interpolation.reach && value < to + interpolation.reach;
        within(place.x, window.x) && within(place.z, window.z)
    };
    let members: Vec<usize> = (0..values.len()).filter(|&n| near(&interpolation.position[n])).collect();
    let position: Vec<Vector> = members.iter().map(|&n| interpolation.position[n]).collect();
    let volume: Vec<Real> = members.iter().map(|&n| interpolation.volume[n]).collect();
    let values: Vec<Vector> = members.iter().map(|&n| values[n]).collect();
    let Interpolation { tank, reach, least, .. } = *interpolation;
    let part =
        Interpolation { tank, position: &position, volume: &volume, reach, kernel: &interpolation.kernel, least };
    let columns = points(window.x);
    points(window.z)
        .iter()
        .flat_map(|&z| columns.iter().map(move |&x| [x, z]))
        .filter_map(|[x, z]| {
            let value = part.at(Vector::new(x, window.plane, z), &values)?;
            Some(([x, z], [value.x, value.z]))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::made_up::{self, Lattice};
    use super::*;

    const REACH: Real = 2.6e-3;

    fn kernel(distance: Real) -> Real {
        let q = distance / REACH;
        (1.0 - q).powi(4) * (1.0 + 4.0 * q)
    }

    fn probe<'a>(tank: &'a TankInside, water: &'a Lattice) -> Interpolation<'a, fn(Real) -> Real> {
        let (position, volume) = (&water.position, &water.volume);
        Interpolation { tank, position, volume, reach: REACH, kernel, least: 4 }
    }

    #[test]
    fn what_grows_linearly_is_read_inside_at_walls_and_at_the_surface() {
        let tank = made_up::tank(Sides::Periodic);
        let water = Lattice::below(&tank, 1e-3, 1.0, |_| 0.010);
        let probe = probe(&tank, &water);
        let same = vec![7.0; water.position.len()];
        let pressure: Vec<Real> = water.position.iter().map(|place| 9810.0 * (0.010 - place.z)).collect();
        for place in [[0.0, 0.004, 0.005], [0.0302, 0.0, 0.0], [-0.012_3, 0.0001, 0.0098]] {
            let value = probe.at(Vector::from_array(place), &same).expect("in the water");
            assert!((value - 7.0).abs() < 1e-12);
        }
        for [x, z] in [[0.0, 0.005], [0.0, 0.0], [0.03, 0.0], [-0.03, 0.010], [0.0, 0.010]] {
            let found = probe.at(Vector::new(x, 0.004, z), &pressure).expect("in the water");
            assert!((found - 9810.0 * (0.010 - z)).abs() < 1e-9, "{x} {z}: {found}");
        }
        // With images there is no slope across a wall: not the value of what has one.
        let across: Vec<Real> = water.position.iter().map(|place| place.x.powi(2)).collect();
        let [plain, mirrored] =
            [probe.near(Vector::new(0.03, 0.004, 0.0)), probe.near_with_images(Vector::new(0.03, 0.004, 0.0))]
                .map(|near| near.expect("in the water").mean(|n| across[n]));
        assert!((plain - 9e-4).abs() < 2e-6 && (mirrored - 9e-4).abs() > 1e-5, "{plain} {mirrored}");
        // At a lid as in a tank upside down.
        let lidded = TankInside { lid: Some(0.010), ..made_up::tank(Sides::Walls) };
        let upside_down: Vec<Real> = water.position.iter().map(|place| (0.010 - place.z).powi(2)).collect();
        let square: Vec<Real> = water.position.iter().map(|place| place.z.powi(2)).collect();
        let read = |tank: &TankInside, z: Real, values: &[Real]| {
            let near = Interpolation { tank, ..probe }.near_with_images(Vector::new(0.0, 0.004, z));
            near.expect("in the water").mean(|n| values[n])
        };
        let (top, bottom) = (read(&lidded, 0.010, &upside_down), read(&lidded, 0.0, &square));
        assert!(
            (top - bottom).abs() < 1e-12
                && (read(&made_up::tank(Sides::Walls), 0.010, &upside_down) - top).abs() > 1e-8,
            "{top} {bottom}"
        );
        // Negative control: beside the water there is but their mean, that of a place within.
        let beside = probe.at(Vector::new(0.0, 0.004, 0.0112), &pressure).expect("some are near");
        assert!(beside > 1.0, "{beside}");
        assert_eq!(probe.at(Vector::new(0.0, 0.004, 0.02), &pressure), None);
    }

    #[test]
    fn particles_are_near_across_periodic_sides_only() {
        let water = Lattice {
            position: vec![Vector::new(0.0, 0.0078, 0.001); 4],
            diameter: vec![],
            contacts: vec![],
            volume: vec![1e-9; 4],
            splash: vec![],
        };
        let place = Vector::new(0.0, 0.0002, 0.001);
        let values = [Vector::X, Vector::X, Vector::X * 3.0, Vector::X * 3.0];
        let across = probe(&made_up::tank(Sides::Periodic), &water).at(place, &values);
        assert!((across.expect("near") - Vector::X * 2.0).length() < 1e-12);
        assert_eq!(probe(&made_up::tank(Sides::Walls), &water).at(place, &values), None);
        // The ends likewise.
        let at_the_end = Lattice {
            position: vec![Vector::new(0.0298, 0.004, 0.001); 4],
            diameter: vec![],
            contacts: vec![],
            volume: vec![1e-9; 4],
            splash: vec![],
        };
        let begin = Vector::new(-0.0298, 0.004, 0.001);
        let repeats = TankInside { ends: Sides::Periodic, ..made_up::tank(Sides::Walls) };
        let across_ends = probe(&repeats, &at_the_end).at(begin, &values);
        assert!((across_ends.expect("near") - Vector::X * 2.0).length() < 1e-12);
        assert_eq!(probe(&made_up::tank(Sides::Walls), &at_the_end).at(begin, &values), None);
        // And upwards.
        let on_top = Lattice { position: vec![Vector::new(0.01, 0.004, 0.0198); 4], ..at_the_end };
        let below = Vector::new(0.01, 0.004, 0.0002);
        let upwards = TankInside { repeats: Some(0.02), ..made_up::tank(Sides::Walls) };
        assert!((probe(&upwards, &on_top).at(below, &values).expect("near") - Vector::X * 2.0).length() < 1e-12);
        assert_eq!(probe(&made_up::tank(Sides::Walls), &on_top).at(below, &values), None);
        let tank = made_up::tank(Sides::Periodic);
        assert_eq!(Interpolation { least: 5, ..probe(&tank, &water) }.at(place, &values), None);
        // The same particles serve for several quantities.
        let near = probe(&tank, &water).near(place).expect("near");
        assert!((near.mean(|n| n as Real) - 1.5).abs() < 1e-12);
        assert_eq!(Some(near.mean(|n| values[n])), across);
    }

    #[test]
    fn vectors_fill_the_wet_part_of_a_window() {
        let tank = made_up::tank(Sides::Walls);
        let water = Lattice::below(&tank, 1e-3, 1.0, |_| 0.010);
        let velocity: Vec<Vector> = water.position.iter().map(|p| Vector::new(0.1 * p.z, 0.0, 0.02)).collect();
        let window = SectionWindow { x: [-0.005, 0.005], z: [0.002, 0.020], plane: 0.004, spacing: 1e-3 };
        let probe = probe(&tank, &water);
        let found = vectors_in_section(&probe, &window, &velocity);
        assert_eq!(found[0].0, [-0.005, 0.002]);
        assert!(found.len() >= 11 * 9 && found.len() <= 11 * 11, "{}", found.len());
        for ([x, z], value) in found {
            let direct = probe.at(Vector::new(x, 0.004, z), &velocity).expect("the same water");
            assert_eq!(value, [direct.x, direct.z]);
            assert!(z > 0.0085 || (value[0] - 0.1 * z).abs() < 1e-5);
        }
    }
}
