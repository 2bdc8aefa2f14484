//! Initial positions of fluid particles, layer by layer, each with the bulk volume `l0^3/eps`.

use sazanami_numerics::{Real, Vector};

/// Integration points per particle spacing over the height.
const FINENESS: Real = 16.0;

/// Cumulative volume of the voids over the height.
struct Voids {
    floor: Real,
    step: Real,
    area: Real,
    /// Void volume below each height [m^3].
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

    /// Height below which the voids have this `volume`, and the void fraction there.
    fn reached_by(&self, volume: Real) -> (Real, Real) {
        let n = self.below.partition_point(|&below| below <= volume).clamp(1, self.below.len() - 1);
        let piece = self.below[n] - self.below[n - 1];
        let part = (volume - self.below[n - 1]) / piece;
        (self.floor + self.step * ((n - 1) as Real + part), piece / (self.step * self.area))
    }
}

/// Positions of fluid particles of spacing `spacing` \[m] from the floor of a box up to `level` \[m].
///
/// Layers are horizontal lattices of spacing `l0 eps^(-1/3)`, rounded to fit the box; `void` is the void fraction at a
/// height, and each layer is as thick as the volume of its particles requires there. The number of layers is the one
/// closest to the level; the spacings within layers are then scaled uniformly to fill the voids below it, to within a row
/// of particles. If the caller keeps only part of the box, the volume kept is off by up to half a row per layer.
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
    // Particles placed so far, and the number required.
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
    fn clear_water_is_filled_with_a_cubic_lattice() {
        let places = layers(Vector::ZERO, Vector::new(4.0, 3.0, 9.0), 5.0, 1.0, |_| 1.0);
        assert_eq!(places.len(), 60);
        let corner = places[0] - Vector::splat(0.5);
        assert!(corner.length() < 1e-12, "{corner}");
    }

    #[test]
    fn depths_between_two_layers_are_met() {
        for level in [5.3, 5.5, 5.7] {
            let places = layers(Vector::ZERO, Vector::new(40.0, 3.0, 9.0), level, 1.0, |_| 1.0);
            // A row is 3 particles, a layer 120.
            assert!((places.len() as Real - 120.0 * level).abs() <= 3.0, "{level} {}", places.len());
            assert!(places.iter().all(|place| place.z < level - 0.4));
        }
    }

    #[test]
    fn a_bed_takes_the_volume_of_its_voids() {
        let void = |z: Real| if z < 10.0 { 0.4 } else { 1.0 };
        let places = layers(Vector::ZERO, Vector::new(15.0, 20.0, 30.0), 20.0, 1.0, void);
        let expected = 15.0 * 20.0 * (10.0 * 0.4 + 10.0);
        // A row is 20 particles; whole layers, 165 in the bed, miss by up to half of one.
        assert!((places.len() as Real - expected).abs() <= 20.0, "{} {expected}", places.len());
    }
}
