//! Which particles lie at the surface, and which have left the rest.

use sazanami_numerics::{Real, Vector};

use crate::weight::Calibration;

/// Radius within which a particle must have company, over the particle spacing.
pub(crate) const COMPANY_RADIUS: Real = 2.1;
/// Fewest fluid neighbours of a particle that is no splash.
const COMPANY: u32 = 5;
/// Asymmetry of the top layer of a lattice over n0 from which on it stands out of that of disordered water: from C2 and
/// 3.1 spacings on. Of smaller radii it is less, and disorder is more.
const STANDS_OUT: Real = 0.18;
/// Number density over n0 below which a particle lies at the surface however its neighbours lie.
const SPARSE: Real = 0.7;

/// When a particle lies at the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceTest {
    /// Number density over n0 below which it may.
    pub density: Real,
    /// Length of the sum of weights times directions over n0 above which it does.
    pub asymmetry: Real,
    /// That length above which it does at any number density: neighbours that crowd on one side make up for none on the
    /// other (`docs/decisions/0006-moving-particles.md`). Infinite where disordered water is as one-sided.
    pub one_sided: Real,
}

impl SurfaceTest {
    /// Thresholds from the lattice of the weight in use.
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

/// Whether a particle with this many fluid neighbours within 2.1 spacings flies on its own.
pub(crate) fn is_splash(company: u32) -> bool {
    company < COMPANY
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
    fn a_crowd_at_the_edge_is_at_the_surface() {
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
    fn disordered_water_is_less_one_sided() {
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
