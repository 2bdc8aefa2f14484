//! Pressure and velocity between the particles of water, as a probe at a place would read them.

use std::ops::{AddAssign, Div, Mul};

use sazanami_numerics::{Real, Vector};

use super::Tank;

/// Mean over the particles near a place, weighted by kernel and volume (Shepard 1968):
/// `sum_j V_j W(r_j) f_j / sum_j V_j W(r_j)`. It is exact for what is the same everywhere, also at walls and at the
/// free surface.
#[derive(Clone, Copy, Debug)]
pub struct Interpolation<'a, W> {
    /// The tank; across periodic sides particles are near each other.
    pub tank: &'a Tank,
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
        let weight_of = |(n, &position): (usize, &Vector)| {
            let within = |between: Real| between.abs() < self.reach;
            let may_reach = within(position.z - place.z);
            let way = may_reach.then(|| self.tank.way(place, position)).filter(|way| within(way.x))?;
            let distance = Some(way.length()).filter(|&distance| within(distance))?;
            Some((n, self.volume[n] * (self.kernel)(distance)))
        };
        let weights: Vec<(usize, Real)> = self.position.iter().enumerate().filter_map(weight_of).collect();
        let sum = weights.iter().map(|(_, weight)| weight).sum();
        (weights.len() >= self.least.max(1) && sum > 0.0).then_some(Near { weights, sum })
    }
}

/// Quantity of which a mean can be taken.
pub trait Mean: Copy + Default + AddAssign + Mul<Real, Output = Self> + Div<Real, Output = Self> {}

impl<T: Copy + Default + AddAssign + Mul<Real, Output = T> + Div<Real, Output = T>> Mean for T {}

/// The particles near a place, for the means of several quantities there.
#[derive(Clone, Debug, PartialEq)]
pub struct Near {
    /// Number and weight of each particle [m^3].
    weights: Vec<(usize, Real)>,
    /// Sum of the weights [m^3].
    sum: Real,
}

impl Near {
    /// Mean of a quantity by its value of each particle.
    pub fn mean<T: Mean>(&self, value: impl Fn(usize) -> T) -> T {
        let mut sum = T::default();
        self.weights.iter().for_each(|&(n, weight)| sum += value(n) * weight);
        sum / self.sum
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
    use super::super::Sides;
    use super::super::made_up::{self, Lattice};
    use super::*;

    const REACH: Real = 2.1e-3;

    fn kernel(distance: Real) -> Real {
        let q = distance / REACH;
        (1.0 - q).powi(4) * (1.0 + 4.0 * q)
    }

    fn probe<'a>(tank: &'a Tank, water: &'a Lattice) -> Interpolation<'a, fn(Real) -> Real> {
        let (position, volume) = (&water.position, &water.volume);
        Interpolation { tank, position, volume, reach: REACH, kernel, least: 4 }
    }

    #[test]
    fn a_constant_is_read_everywhere_and_a_slope_inside() {
        let tank = made_up::tank(Sides::Periodic);
        let water = Lattice::below(&tank, 1e-3, 1.0, |_| 0.010);
        let probe = probe(&tank, &water);
        let same = vec![7.0; water.position.len()];
        let pressure: Vec<Real> = water.position.iter().map(|place| 9810.0 * (0.010 - place.z)).collect();
        for place in [[0.0, 0.004, 0.005], [0.0302, 0.0, 0.0], [-0.012_3, 0.0001, 0.0098]] {
            let value = probe.at(Vector::from_array(place), &same).expect("in the water");
            assert!((value - 7.0).abs() < 1e-12);
        }
        let inside = probe.at(Vector::new(0.0, 0.004, 0.005), &pressure).expect("in the water");
        assert!((inside - 49.05).abs() < 1e-9, "{inside}");
        // At the surface only the water below is there: the reading is that of a place lower down.
        let surface = probe.at(Vector::new(0.0, 0.004, 0.010), &pressure).expect("at the surface");
        assert!(surface > 3.0, "{surface}");
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
