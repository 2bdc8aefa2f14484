//! The test for particles at the free surface.

use sazanami_numerics::{Real, Vector};

use crate::weight::Calibration;

/// Asymmetry of the top layer of a lattice over n0 above which it exceeds that of disordered fluid: C2 with 3.1 spacings
/// and more. With smaller radii the top layer is less asymmetric, disordered fluid more.
const STANDS_OUT: Real = 0.18;
/// Number density over n0 below which a particle lies at the surface whatever its asymmetry.
const SPARSE: Real = 0.7;

/// Thresholds of the free-surface test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceTest {
    /// Number density over n0 below which a particle may lie at the surface.
    pub density: Real,
    /// Asymmetry (length of the sum of weights times unit vectors, over n0) above which it then does.
    pub asymmetry: Real,
    /// Asymmetry above which it does at any number density: clustered neighbours on one side can compensate for missing
    /// ones on the other (`docs/decisions/0006-moving-particles.md`). Infinite where disordered fluid is as asymmetric.
    pub one_sided: Real,
}

impl SurfaceTest {
    /// Thresholds from the lattice sums of the weight in use.
    #[must_use]
    pub fn of(calibration: &Calibration) -> Self {
        let top = calibration.top_asymmetry;
        Self {
            density: calibration.surface_density(),
            asymmetry: calibration.surface_asymmetry(),
            one_sided: if top > STANDS_OUT { top } else { Real::INFINITY },
        }
    }

    /// Whether a particle of number density `density` and asymmetry vector `asymmetry`, both over n0, lies at the
    /// surface.
    #[must_use]
    pub fn is_surface(&self, density: Real, asymmetry: Vector) -> bool {
        let asymmetry = asymmetry.length();
        asymmetry > self.one_sided || density < self.density && (density < SPARSE || asymmetry > self.asymmetry)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scheme::{Kernel, Scheme};
    use crate::weight::Wendland;
    use sazanami_dem::Random;

    /// Number density and asymmetry over n0 at a place among particles of unit spacing.
    fn sums(kernel: &Kernel, at: Vector, particles: &[Vector]) -> (Real, Vector) {
        let weights = particles.iter().map(|&x| {
            let w = kernel.weight.value((x - at).length());
            (w, w * (x - at).normalize_or_zero())
        });
        let (density, asymmetry) = weights.fold((0.0, Vector::ZERO), |sum, w| (sum.0 + w.0, sum.1 + w.1));
        (density / kernel.sums.number_density, asymmetry / kernel.sums.number_density)
    }

    /// A lattice around the origin, `above` layers of it above, every particle moved by up to `jitter`.
    fn lattice(above: i32, jitter: Real) -> Vec<Vector> {
        let mut random = Random::new(11);
        let mut way = || jitter * random.between(-1.0, 1.0);
        let (wide, deep) = (-6..=6, -6..=above);
        let places = deep.flat_map(|k| wide.clone().flat_map(move |j| (-6..=6).map(move |i| [i, j, k])));
        places.map(|n| Vector::from_array(n.map(Real::from)) + Vector::new(way(), way(), way())).collect()
    }

    #[test]
    fn clustered_particles_at_the_edge_are_at_the_surface() {
        let kernel = Kernel::new(Scheme::default(), 1.0);
        let test = SurfaceTest::of(&kernel.sums);
        let mut water = lattice(0, 0.0);
        // Two more, half a spacing beside a particle of the top layer and a little below.
        water.extend([-0.5, 0.5].map(|x| Vector::new(x, 0.0, -0.2)));
        let (density, asymmetry) = sums(&kernel, Vector::ZERO, &water);
        assert!(density > test.density && test.is_surface(density, asymmetry), "{density} {asymmetry}");
        // What was missed without the rule.
        assert!(!SurfaceTest { one_sided: Real::INFINITY, ..test }.is_surface(density, asymmetry));
    }

    #[test]
    fn disordered_fluid_is_less_asymmetric_than_a_surface() {
        for (weight, radius) in [(Wendland::C2, 3.1), (Wendland::C2, 3.6), (Wendland::C4, 3.6), (Wendland::C2, 2.1)] {
            let kernel = Kernel::new(Scheme { weight, radius, ..Scheme::default() }, 1.0);
            let test = SurfaceTest::of(&kernel.sums);
            let water = lattice(6, 0.3);
            let inside = water.iter().filter(|x| x.abs().max_element() < 2.5);
            let largest = inside.map(|&x| sums(&kernel, x, &water).1.length()).fold(0.0, Real::max);
            assert!(largest < test.one_sided, "{weight:?} {radius}: {largest} {}", test.one_sided);
            // The top layer of a lattice would not do for small radii.
            assert!(radius > 2.5 || largest > kernel.sums.top_asymmetry, "{largest}");
        }
    }
}
