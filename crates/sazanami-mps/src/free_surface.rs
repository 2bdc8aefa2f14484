//! Which particles lie at the surface, and which have left the rest.

use sazanami_numerics::{Real, Vector};

use crate::weight::Calibration;

/// Radius within which a particle must have company, over the particle spacing.
pub(crate) const COMPANY_RADIUS: Real = 2.1;
/// Fewest fluid neighbours of a particle that is no splash.
const COMPANY: u32 = 5;
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
    /// other (`docs/decisions/0006-moving-particles.md`).
    pub one_sided: Real,
}

impl SurfaceTest {
    /// Thresholds from the lattice of the weight in use.
    #[must_use]
    pub fn of(calibration: &Calibration) -> Self {
        Self {
            density: calibration.surface_density(),
            asymmetry: calibration.surface_asymmetry(),
            one_sided: calibration.top_asymmetry,
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

    #[test]
    fn crowds_have_a_surface_too() {
        let test = SurfaceTest::of(&Kernel::new(Scheme::default(), 1.0).sums);
        let [little, half, much] = [0.5, 0.7, 1.1].map(|part| part * test.one_sided * Vector::X);
        assert!(test.is_surface(0.65, little), "sparse");
        assert!(test.is_surface(0.85, half) && !test.is_surface(0.85, little), "as at a flat surface");
        assert!(!test.is_surface(1.0, half), "inside, though neighbours lie a little to one side");
        assert!(test.is_surface(1.2, much), "the edge of a crowd");
    }
}
