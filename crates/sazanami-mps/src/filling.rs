//! Filling a tank: fluid particles layer by layer, each with the bulk volume that its void fraction gives it.

use sazanami_numerics::{Real, Vector};

/// Heights per particle spacing at which the voids are summed up.
const FINENESS: Real = 16.0;

/// Volume of the voids below a height, piece by piece.
struct Voids {
    floor: Real,
    step: Real,
    area: Real,
    /// Below each height from the floor up [m^3].
    below: Vec<Real>,
}

impl Voids {
    fn up_to(level: Real, floor: Real, spacing: Real, area: Real, void: impl Fn(Real) -> Real) -> Self {
        let pieces = ((level - floor) / spacing * FINENESS).ceil().max(1.0);
        let step = (level - floor) / pieces;
        let mut below = vec![0.0];
        let mut sum = 0.0;
        for n in 0..pieces as usize {
            sum += area * step * void(floor + (n as Real + 0.5) * step);
            below.push(sum);
        }
        Self { floor, step, area, below }
    }

    fn whole(&self) -> Real {
        self.below[self.below.len() - 1]
    }

    /// Height below which there is such a `volume` of voids, and the void fraction there.
    fn reached_by(&self, volume: Real) -> (Real, Real) {
        let n = self.below.partition_point(|&below| below <= volume).clamp(1, self.below.len() - 1);
        let piece = self.below[n] - self.below[n - 1];
        let part = (volume - self.below[n - 1]) / piece;
        (self.floor + self.step * ((n - 1) as Real + part), piece / (self.step * self.area))
    }
}

/// Places of fluid particles of spacing `spacing` [m] from the floor of a box up to `level` [m].
///
/// Layers are horizontal lattices of spacing `l0 eps^(-1/3)`, rounded to fit the box, each as thick as its particles
/// need in the voids there; `void` is the void fraction at a height. So many layers are taken as come nearest to the
/// level, and particles in them are set closer or farther alike until they fill the voids below it, to within a row. Where
/// water covers only a part of the box, what is cut out of a layer misses by up to half a row.
#[must_use]
pub fn layers(lower: Vector, upper: Vector, level: Real, spacing: Real, void: impl Fn(Real) -> Real) -> Vec<Vector> {
    if level <= lower.z {
        return Vec::new();
    }
    let extent = upper - lower;
    let voids = Voids::up_to(level, lower.z, spacing, extent.x * extent.y, void);
    let volume = spacing.powi(3);
    let whole = voids.whole() / volume;
    let mut natural: Vec<[Real; 2]> = Vec::new();
    let mut taken = 0.0;
    loop {
        let (_, guess) = voids.reached_by(taken * volume);
        let ahead = 0.5 * guess.powf(2.0 / 3.0) * extent.x * extent.y * spacing;
        let (_, eps) = voids.reached_by(taken * volume + ahead);
        let width = spacing * eps.cbrt().recip();
        let [nx, ny] = [extent.x, extent.y].map(|length| (length / width).round().max(1.0));
        if taken + 0.5 * nx * ny > whole * (1.0 + 1e-12) {
            break;
        }
        natural.push([nx, ny]);
        taken += nx * ny;
    }
    let stretch = whole / taken;
    let mut places = Vec::new();
    // Particles so far, and as many as there should be.
    let (mut placed, mut due) = (0.0, 0.0);
    for [nx, ny] in natural {
        due += stretch * nx * ny;
        let ny = (ny * stretch.sqrt()).round().max(1.0);
        let nx = ((due - placed) / ny).round().max(1.0);
        let (z, _) = voids.reached_by((placed + 0.5 * nx * ny) * volume);
        for j in 0..ny as usize {
            for i in 0..nx as usize {
                let (i, j) = (i as Real + 0.5, j as Real + 0.5);
                places.push(Vector::new(lower.x + i * extent.x / nx, lower.y + j * extent.y / ny, z));
            }
        }
        placed += nx * ny;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clear_water_is_a_lattice() {
        let places = layers(Vector::ZERO, Vector::new(4.0, 3.0, 9.0), 5.0, 1.0, |_| 1.0);
        assert_eq!(places.len(), 60);
        let corner = places[0] - Vector::splat(0.5);
        assert!(corner.length() < 1e-12, "{corner}");
    }

    #[test]
    fn water_between_two_layers_is_as_deep_as_asked_for() {
        for level in [5.3, 5.5, 5.7] {
            let places = layers(Vector::ZERO, Vector::new(40.0, 3.0, 9.0), level, 1.0, |_| 1.0);
            // A row is 3 particles, a layer 120.
            assert!((places.len() as Real - 120.0 * level).abs() <= 3.0, "{level} {}", places.len());
            assert!(places.iter().all(|place| place.z < level - 0.4));
        }
    }

    #[test]
    fn a_bed_takes_as_much_as_its_voids_hold() {
        let void = |z: Real| if z < 10.0 { 0.4 } else { 1.0 };
        let places = layers(Vector::ZERO, Vector::new(15.0, 20.0, 30.0), 20.0, 1.0, void);
        let expected = 15.0 * 20.0 * (10.0 * 0.4 + 10.0);
        // A row is 20 particles; whole layers, 165 in the bed, miss by up to half of one.
        assert!((places.len() as Real - expected).abs() <= 20.0, "{} {expected}", places.len());
    }
}
