//! One law for all void fractions: the voidage function of Di Felice.

use sazanami_numerics::Real;

use super::{DragLaw, DragParameters, volume};

/// Drag of a single sphere at the superficial velocity `eps s` times `eps^-beta`, with
/// `beta = 3.7 - 0.65 exp(-(1.5 - log10 Re)^2/2)`, `Re = eps rho s d/mu` and `C_D = (0.63 + 4.8/sqrt(Re))^2` (Di Felice 1994,
/// Int. J. Multiphase Flow 20, 153).
#[derive(Clone, Copy, Debug)]
pub struct DiFelice {
    density: Real,
    viscosity: Real,
}

/// The exponent `beta` of the voidage function.
fn exponent(reynolds: Real) -> Real {
    // Without slip the logarithm is minus infinity and the exponential zero.
    let decades = 1.5 - reynolds.log10();
    3.7 - 0.65 * (-0.5 * decades * decades).exp()
}

impl DragLaw for DiFelice {
    fn new(parameters: &DragParameters) -> Self {
        let DragParameters { density, viscosity, .. } = *parameters;
        Self { density, viscosity }
    }

    // With C_D s = (0.63 sqrt(s) + 4.8 sqrt(s/Re))^2, which does not vanish with s.
    #[inline]
    fn coefficient(&self, d: Real, eps: Real, s: Real) -> Real {
        // s/Re [m/s].
        let viscous = self.viscosity / (eps * self.density * d);
        let reynolds = if s > 0.0 { s / viscous } else { 0.0 };
        let drag_times_slip = (0.63 * s.sqrt() + 4.8 * viscous.sqrt()).powi(2);
        volume(d) * 0.75 * drag_times_slip * eps.powf(2.0 - exponent(reynolds)) * self.density / d
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::{
        DragForm,
        tests::{richardson_zaki, water},
    };
    use super::*;

    #[test]
    fn the_exponent_is_that_of_the_publication() {
        // Both limits, and the minimum at Re = 10^1.5.
        assert!((exponent(1e-6) - 3.7).abs() < 1e-6 && (exponent(1e8) - 3.7).abs() < 1e-6);
        assert!((exponent(31.623) - 3.05).abs() < 1e-6);
        assert_eq!(exponent(0.0), 3.7);
    }

    #[test]
    fn a_single_sphere_is_that_of_dalla_valle() {
        let law = DiFelice::new(&water());
        let stokes = 4.8 * 4.8 / 24.0 * 3.0 * PI * 1e-3 * 1e-3;
        assert!((law.coefficient(1e-3, 1.0, 0.0) / stokes - 1.0).abs() < 1e-12);
        // Terminal velocity of a grain of sand of 1 mm with Dalla Valle's drag.
        let weight = 1650.0 * volume(1e-3) * 9.81;
        assert!((law.coefficient(1e-3, 1.0, 0.1423) * 0.1423 / weight - 1.0).abs() < 0.01);
    }

    #[test]
    fn suspensions_settle_as_richardson_and_zaki_found() {
        let law = DragParameters { form: DragForm::DiFelice, ..water() };
        // 4.65 at low and 2.39 at high Reynolds numbers (Richardson & Zaki 1954).
        let [slow, fast] = [5e-6, 0.5].map(|d| richardson_zaki(&law, d, 0.7));
        assert!((slow - 4.65).abs() < 0.1 && (fast - 2.39).abs() < 0.1, "{slow} {fast}");
    }

    #[test]
    fn slow_flow_through_a_bed_is_near_ergun() {
        // Kozeny's constant that gives the same drag at eps = 0.4, against 150 to 180 as measured.
        let kappa = DiFelice::new(&water()).coefficient(1e-4, 0.4, 0.0);
        let kozeny = kappa / volume(1e-4) / (1e-3 * 0.6 / (0.4 * 1e-4 * 1e-4));
        assert!((kozeny - 150.0).abs() < 15.0, "{kozeny}");
    }
}
