//! One law for all void fractions, from simulations of flow through arrays of spheres.

use std::f64::consts::PI;

use sazanami_numerics::Real;

use super::{DragLaw, DragParameters};

/// Drag `3 pi mu d U F` at the superficial velocity `U = eps s`, with `phi = 1 - eps`, `Re = rho U d/mu` and
///
/// ```text
/// F = 10 phi/eps^2 + eps^2 (1 + 1.5 sqrt(phi))
///     + 0.413 Re/(24 eps^2) (1/eps + 3 eps phi + 8.4 Re^-0.343)/(1 + 10^(3 phi) Re^(-(1 + 4 phi)/2))
/// ```
///
/// (Beetstra, van der Hoef & Kuipers 2007, AIChE J. 53, 489; lattice Boltzmann simulations of `Re <= 1000`, `phi <= 0.6`).
/// `F` is the drag alone; with the mean pressure gradient the force on a sphere is `F/eps`.
#[derive(Clone, Copy, Debug)]
pub struct Beetstra {
    density: Real,
    viscosity: Real,
}

/// `mu F`, of a liquid without viscosity too: what the second line of `F` has with `mu Re = rho U d`, its `inertia`, is finite.
fn viscosity_times_drag(phi: Real, viscosity: Real, inertia: Real) -> Real {
    let eps = 1.0 - phi;
    let slow = viscosity * (10.0 * phi / (eps * eps) + eps * eps * (1.0 + 1.5 * phi.sqrt()));
    // Without slip the second line vanishes.
    if inertia <= 0.0 {
        return slow;
    }
    let shape = 1.0 / eps + 3.0 * eps * phi + 8.4 * (viscosity / inertia).powf(0.343);
    let sharing = 1.0 + 1e3_f64.powf(phi) * (viscosity / inertia).powf(0.5 * (1.0 + 4.0 * phi));
    slow + 0.413 / (24.0 * eps * eps) * inertia * shape / sharing
}

impl DragLaw for Beetstra {
    fn new(parameters: &DragParameters) -> Self {
        let DragParameters { density, viscosity, .. } = *parameters;
        Self { density, viscosity }
    }

    #[inline]
    fn coefficient(&self, d: Real, eps: Real, s: Real) -> Real {
        let inertia = eps * self.density * s * d;
        3.0 * PI * d * eps * viscosity_times_drag((1.0 - eps).max(0.0), self.viscosity, inertia)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{settling, water};
    use super::super::{DragForm, volume};
    use super::*;

    fn law(form: DragForm) -> DragParameters {
        DragParameters { form, ..water() }
    }

    #[test]
    fn the_formula_is_that_of_the_publication() {
        // Term by term at phi = 0.5, Re = 100: 20 + 0.25 * 2.06066 + 41.3/6 * (2 + 0.75 + 8.4/4.85289)/(1 + 31.6228 * 1e-3).
        let of = |phi: Real, reynolds: Real| viscosity_times_drag(phi, 1.0, reynolds);
        assert!((of(0.5, 100.0) / 50.4134 - 1.0).abs() < 2e-6, "{}", of(0.5, 100.0));
        // And at phi = 0.15, Re = 10: 2.07612 + 0.7225 * 1.58095 + 4.13/17.34 * (1.17647 + 0.3825 + 8.4/2.20293)/(1 + 2.81838 * 0.158489).
        assert!((of(0.15, 10.0) / 4.10280 - 1.0).abs() < 2e-6, "{}", of(0.15, 10.0));
        // Without slip the first line is left.
        assert_eq!(of(0.5, 0.0), 20.0 + 0.25 * (1.0 + 1.5 * 0.5_f64.sqrt()));
    }

    #[test]
    fn a_single_sphere_is_near_stokes_and_near_schiller_and_naumann() {
        let stokes = 3.0 * PI * 1e-3 * 1e-3;
        let [new, sphere] = [DragForm::Beetstra, DragForm::Blend].map(law);
        assert!((new.coefficient(1e-3, 1.0, 0.0) / stokes - 1.0).abs() < 1e-12);
        for (reynolds, expected) in [(1.0, 0.940), (10.0, 0.942), (100.0, 1.159)] {
            let at = |law: &DragParameters| law.coefficient(1e-3, 1.0, 1e-3 * reynolds);
            let ratio = at(&new) / at(&sphere);
            assert!((ratio - expected).abs() < 2e-3, "{reynolds}: {ratio}");
            // Negative control: neither is Stokes' drag.
            assert!(at(&new) / stokes > 1.08, "{reynolds}");
        }
    }

    /// Kozeny's constant that gives the same drag without inertia at void fraction `eps`.
    fn kozeny(form: DragForm, eps: Real) -> Real {
        let d = 1e-4;
        law(form).coefficient(d, eps, 0.0) / volume(d) / (1e-3 * (1.0 - eps) / (eps * d * d))
    }

    #[test]
    fn slow_flow_through_a_bed_is_that_of_carman() {
        // 180, and 18 (1 - phi)^4 (1 + 1.5 sqrt(phi))/phi of the sparse term; without the pressure gradient, or with it
        // counted twice, it would be off by a factor of eps = 0.4.
        let sparse = 18.0 * 0.4_f64.powi(4) * (1.0 + 1.5 * 0.6_f64.sqrt()) / 0.6;
        assert!((kozeny(DragForm::Beetstra, 0.4) / (180.0 + sparse) - 1.0).abs() < 1e-12 && sparse < 2.0);
        // Control: Ergun's constant.
        assert!((kozeny(DragForm::Blend, 0.4) - 150.0).abs() < 1e-9);
    }

    #[test]
    fn a_dense_and_a_sparse_state_lie_where_ergun_and_wen_and_yu_do_not() {
        // Drag over that of Stokes. Ergun: (150 phi + 1.75 Re)/(18 eps^2); Wen and Yu: (1 + 0.15 Re^0.687) eps^-3.65.
        let wen_yu = (1.0 + 0.15 * 10.0_f64.powf(0.687)) * 0.85_f64.powf(-3.65);
        let ergun = (150.0 * 0.5 + 1.75 * 100.0) / (18.0 * 0.25);
        for (eps, reynolds, expected, control) in [(0.5, 100.0, 50.4134, ergun), (0.85, 10.0, 4.10280, wen_yu)] {
            let (d, s) = (1e-3, 1e-3 * reynolds / eps);
            let at = |form| law(form).coefficient(d, eps, s) / (3.0 * PI * 1e-3 * d * eps);
            let [new, old] = [DragForm::Beetstra, DragForm::Blend].map(at);
            assert!((new / expected - 1.0).abs() < 2e-6, "{new}");
            assert!((old / control - 1.0).abs() < 1e-12 && (new / old - 1.0).abs() > 0.05, "{old} {control}");
        }
    }

    #[test]
    fn suspensions_settle_slower_than_richardson_and_zaki_found() {
        // Settling velocity over that of one sphere at phi = 0.1, 0.2, 0.3: the table of the theory page. Spheres held in place,
        // as in the simulations, resist more than those of a suspension, which make way for each other.
        let ratios = |form: DragForm, d: Real| {
            [0.1, 0.2, 0.3].map(|phi| settling(&law(form), d, 1.0 - phi) / settling(&law(form), d, 1.0))
        };
        let expected = [(2e-4, [0.468, 0.255, 0.136], 3.79), (1e-3, [0.704, 0.501, 0.343], 2.69)];
        for (d, expected, exponent) in expected {
            let found = ratios(DragForm::Beetstra, d);
            assert!((0..3).all(|n| (found[n] - expected[n]).abs() < 6e-4), "{found:?}");
            let measured = [0.9_f64, 0.8, 0.7].map(|eps| eps.powf(exponent));
            assert!((0..3).all(|n| found[n] < measured[n]), "{found:?} {measured:?}");
            // Control: the other law for all void fractions is within 20 %.
            let other = ratios(DragForm::DiFelice, d);
            assert!((0..3).all(|n| (other[n] / measured[n] - 1.0).abs() < 0.2), "{other:?} {measured:?}");
        }
    }
}
