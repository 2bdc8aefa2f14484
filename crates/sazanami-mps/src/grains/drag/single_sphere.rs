//! Drag on a sphere in a dilute suspension, from the drag coefficient of a single sphere.

use sazanami_numerics::Real;

use super::{DragLaw, DragParameters, volume};

/// `C_D s` at slip speed `s` [m/s], with `C_D = 24/Re (1 + 0.15 Re^0.687)` up to Re = 1000, then 0.44 (Schiller & Naumann
/// 1935); `viscous = 24 s/Re` does not vanish with `s` [m/s].
#[inline]
fn coefficient_times_slip(viscous: Real, s: Real) -> Real {
    let reynolds = 24.0 * s / viscous;
    if reynolds < 1000.0 { viscous * (1.0 + 0.15 * reynolds.powf(0.687)) } else { 0.44 * s }
}

/// `B = 3/4 C_D (1 - eps) eps^-1.65 rho s/d` (Wen & Yu 1966), with `Re = eps rho s d/mu`.
#[derive(Clone, Copy, Debug)]
pub struct SingleSphere {
    density: Real,
    viscosity: Real,
}

impl DragLaw for SingleSphere {
    fn new(parameters: &DragParameters) -> Self {
        let DragParameters { density, viscosity, .. } = *parameters;
        Self { density, viscosity }
    }

    // B is divided by `1 - eps`.
    #[inline]
    fn coefficient(&self, d: Real, eps: Real, s: Real) -> Real {
        let viscous = 24.0 * self.viscosity / (eps * self.density * d);
        volume(d) * 0.75 * coefficient_times_slip(viscous, s) * eps.powf(-1.65) * self.density / d
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::tests::water;
    use super::*;

    #[test]
    fn terminal_velocities_are_those_of_the_drag_coefficient() {
        let law = SingleSphere::new(&water());
        // Diameter, terminal velocity with Schiller and Naumann's drag.
        for (d, expected) in [(1e-3, 0.1551), (0.5e-3, 0.0784), (0.2e-3, 0.0248), (0.1e-3, 0.00797), (2e-3, 0.2835)] {
            let weight = 1650.0 * volume(d) * 9.81;
            let found = law.coefficient(d, 1.0, expected) * expected;
            assert!((found / weight - 1.0).abs() < 0.01, "{d}: {}", found / weight);
        }
        // Control: the velocity with the coefficient of Dalla Valle.
        let weight = 1650.0 * volume(1e-3) * 9.81;
        assert!((law.coefficient(1e-3, 1.0, 0.1423) * 0.1423 / weight - 1.0).abs() > 0.05);
    }

    #[test]
    fn slow_drag_is_that_of_stokes() {
        let law = SingleSphere::new(&water());
        let stokes = 3.0 * PI * 1e-3 * 1e-3;
        assert!((law.coefficient(1e-3, 1.0, 1e-9) / stokes - 1.0).abs() < 1e-3);
        assert!(law.coefficient(1e-3, 1.0, 0.0).is_finite());
    }
}
