//! Filling a tank: fluid particles layer by layer, each with the bulk volume that its void fraction gives it.

use sazanami_numerics::{Real, Vector};

/// Places of fluid particles of spacing `spacing` [m] from the floor of a box up to `level` [m].
///
/// Layers are horizontal lattices of spacing `l0 eps^(-1/3)`, rounded to fit the box, each as thick as its particles'
/// bulk volume asks for; `void` is the void fraction at a height. The volume of fluid up to the level is kept to
/// within half a layer.
#[must_use]
pub fn layers(lower: Vector, upper: Vector, level: Real, spacing: Real, void: impl Fn(Real) -> Real) -> Vec<Vector> {
    let extent = upper - lower;
    let mut places = Vec::new();
    let mut z = lower.z;
    loop {
        let guess = spacing * void(z + 0.5 * spacing).cbrt().recip();
        let eps = void(z + 0.5 * guess);
        let width = spacing * eps.cbrt().recip();
        let count = |length: Real| (length / width).round().max(1.0);
        let [nx, ny] = [count(extent.x), count(extent.y)];
        let thickness = nx * ny * spacing.powi(3) / (eps * extent.x * extent.y);
        if z + 0.5 * thickness > level {
            return places;
        }
        for j in 0..ny as usize {
            for i in 0..nx as usize {
                let (i, j) = (i as Real + 0.5, j as Real + 0.5);
                places.push(Vector::new(lower.x + i * extent.x / nx, lower.y + j * extent.y / ny, z + 0.5 * thickness));
            }
        }
        z += thickness;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clear_water_is_a_lattice() {
        let places = layers(Vector::ZERO, Vector::new(4.0, 3.0, 9.0), 5.0, 1.0, |_| 1.0);
        assert_eq!(places.len(), 60);
        assert_eq!(places[0], Vector::splat(0.5));
    }

    #[test]
    fn a_bed_takes_as_much_as_its_voids_hold() {
        let void = |z: Real| if z < 10.0 { 0.4 } else { 1.0 };
        let places = layers(Vector::ZERO, Vector::new(15.0, 20.0, 30.0), 20.0, 1.0, void);
        let expected = 15.0 * 20.0 * (10.0 * 0.4 + 10.0);
        assert!((places.len() as Real / expected - 1.0).abs() < 0.03, "{} {expected}", places.len());
    }
}
