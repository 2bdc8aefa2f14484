//! Drag in a packed bed: permeability after Kozeny, inertia after Ergun or Forchheimer.

use sazanami_numerics::Real;

use super::{DragLaw, DragParameters, Forchheimer, volume};

/// `B = eps^2 mu/K + F eps^3 rho s/sqrt(K)` with the permeability `K = eps^3 d^2/(kozeny (1 - eps)^2)`; with
/// `kozeny = 150` and Ergun's quadratic coefficient the equation of Ergun (1952).
#[derive(Clone, Copy, Debug)]
pub struct PackedBed {
    density: Real,
    viscosity: Real,
    kozeny: Real,
    forchheimer: Forchheimer,
}

impl DragLaw for PackedBed {
    fn new(parameters: &DragParameters) -> Self {
        let DragParameters { density, viscosity, kozeny, forchheimer, .. } = *parameters;
        Self { density, viscosity, kozeny, forchheimer }
    }

    // B is divided by `1 - eps` before it can vanish.
    #[inline]
    fn coefficient(&self, d: Real, eps: Real, s: Real) -> Real {
        let linear = self.kozeny * self.viscosity * (1.0 - eps) / (eps * d * d);
        let quadratic = match self.forchheimer {
            Forchheimer::Ergun => 1.75 * (self.kozeny / 150.0).sqrt() * self.density * s / d,
            Forchheimer::Constant(f) => f * self.kozeny.sqrt() * eps.powf(1.5) * self.density * s / d,
        };
        volume(d) * (linear + quadratic)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::water;

    use super::*;

    #[test]
    fn pressure_gradients_are_those_of_ergun() {
        // Pressure gradient at 1 mm/s of superficial velocity [Pa/m].
        for (eps, expected) in [(0.36, 1341.0), (0.38, 1071.0), (0.40, 860.0), (0.42, 695.0)] {
            let d = 1e-3;
            let slip = 1e-3 / eps;
            // Per bulk volume, F = B du with q = eps u; -grad p = F/eps.
            let b = PackedBed::new(&water()).coefficient(d, eps, slip) * (1.0 - eps) / volume(d);
            let gradient = b * slip / eps;
            assert!((gradient / expected - 1.0).abs() < 2e-3, "{eps}: {gradient} {expected}");
        }
    }
}
