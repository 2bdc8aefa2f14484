//! Two regimes of drag: single spheres in dilute suspensions, a packed bed in dense ones.

use sazanami_numerics::Real;

use super::packed_bed::PackedBed;
use super::single_sphere::SingleSphere;
use super::{DragLaw, DragParameters};

/// Linear interpolation between [`SingleSphere`] and [`PackedBed`] by the solid number density.
#[derive(Clone, Copy, Debug)]
pub struct Blend {
    parameters: DragParameters,
    bed: PackedBed,
    sphere: SingleSphere,
}

impl DragLaw for Blend {
    fn new(parameters: &DragParameters) -> Self {
        Self { parameters: *parameters, bed: PackedBed::new(parameters), sphere: SingleSphere::new(parameters) }
    }

    #[inline]
    fn coefficient(&self, d: Real, eps: Real, s: Real) -> Real {
        let share = self.parameters.bed_share(eps);
        let mut kappa = 0.0;
        if share > 0.0 {
            kappa += share * self.bed.coefficient(d, eps, s);
        }
        if share < 1.0 {
            kappa += (1.0 - share) * self.sphere.coefficient(d, eps, s);
        }
        kappa
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::tests::water;
    use super::*;

    #[test]
    fn the_blend_is_continuous_and_the_switch_is_not() {
        let at = |law: &DragParameters, phi: Real| law.coefficient(1e-3, 1.0 - phi * PI / 6.0, 0.05);
        let (low, high) = (at(&water(), 0.38 - 1e-9), at(&water(), 0.38 + 1e-9));
        assert!((low / high - 1.0).abs() < 1e-6);
        let switched = DragParameters { blend: [0.4, 0.4], ..water() };
        let jump = at(&switched, 0.4 + 1e-9) / at(&switched, 0.4 - 1e-9);
        assert!((jump - 1.32).abs() < 0.01, "{jump}");
    }
}
