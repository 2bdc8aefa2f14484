//! Drag between grains and fluid: a packed bed and single grains, switched by the solid number density.

use std::f64::consts::PI;

use sazanami_numerics::Real;
use sazanami_numerics::choices;

choices! {
    /// Volume fraction of the packing whose number density is 1.
    #[derive(Default)]
    pub enum DensityReference {
        /// Touching spheres on a simple cubic lattice, `pi/6`: the convention of moving-particle methods.
        #[default]
        SimpleCubic = "simple_cubic",
        /// Randomly close-packed spheres, 0.64.
        ClosePacked = "close_packed",
        /// Solid alone.
        Solid = "solid",
    }
}

impl DensityReference {
    fn solid_fraction(self) -> Real {
        match self {
            Self::SimpleCubic => PI / 6.0,
            Self::ClosePacked => 0.64,
            Self::Solid => 1.0,
        }
    }
}

/// Quadratic coefficient of flow through a bed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Forchheimer {
    /// `1.75/sqrt(150 eps^3)`: with Kozeny's permeability the equation of Ergun (1952).
    #[default]
    Ergun,
    /// A constant, as 0.55 (Ward 1964).
    Constant(Real),
}

choices! {
    /// Drag coefficient of a single sphere.
    #[derive(Default)]
    pub enum SphereDrag {
        /// `24/Re (1 + 0.15 Re^0.687)` up to Re = 1000, then 0.44 (Schiller & Naumann).
        #[default]
        SchillerNaumann = "schiller_naumann",
        /// `(0.63 + 4.8/sqrt(Re))^2` (Dalla Valle, as Di Felice uses it).
        DallaValle = "dalla_valle",
    }
}

/// Drag law of grains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closure {
    /// Density of the fluid [kg/m^3].
    pub density: Real,
    /// Dynamic viscosity of the fluid [Pa s].
    pub viscosity: Real,
    /// Kozeny's constant: 150 in Ergun's equation.
    pub kozeny: Real,
    /// Quadratic coefficient.
    pub forchheimer: Forchheimer,
    /// Drag of a single sphere.
    pub sphere: SphereDrag,
    /// What the solid number density is counted from.
    pub reference: DensityReference,
    /// Solid number densities between which the law goes over from single grains to a bed; equal: a switch there.
    pub blend: [Real; 2],
}

impl Closure {
    /// The recommended law for a fluid.
    #[must_use]
    pub fn recommended(density: Real, viscosity: Real) -> Self {
        Self {
            density,
            viscosity,
            kozeny: 150.0,
            forchheimer: Forchheimer::default(),
            sphere: SphereDrag::default(),
            reference: DensityReference::default(),
            blend: [0.38, 0.42],
        }
    }

    /// Solid number density at void fraction `eps`.
    #[must_use]
    pub fn number_density(&self, eps: Real) -> Real {
        (1.0 - eps) / self.reference.solid_fraction()
    }

    /// Part of the packed-bed law at void fraction `eps`.
    #[must_use]
    pub fn bed_share(&self, eps: Real) -> Real {
        let phi = self.number_density(eps);
        let [low, high] = self.blend;
        if phi >= high {
            1.0
        } else if phi <= low {
            0.0
        } else {
            (phi - low) / (high - low)
        }
    }

    /// Drag coefficient `kappa = V B/(1 - eps)` of a sphere of diameter `d` [m] in void fraction `eps` at slip speed
    /// `s` [m/s]; the force is `kappa` times the slip [kg/s].
    #[must_use]
    pub fn coefficient(&self, d: Real, eps: Real, s: Real) -> Real {
        let share = self.bed_share(eps);
        let mut kappa = 0.0;
        if share > 0.0 {
            kappa += share * self.bed(d, eps, s);
        }
        if share < 1.0 {
            kappa += (1.0 - share) * self.single(d, eps, s);
        }
        kappa
    }

    /// `B = eps^2 mu/K + F eps^3 rho s/sqrt(K)` with `K = eps^3 d^2/(kozeny (1 - eps)^2)`, divided by `1 - eps`
    /// before it can vanish.
    fn bed(&self, d: Real, eps: Real, s: Real) -> Real {
        let linear = self.kozeny * self.viscosity * (1.0 - eps) / (eps * d * d);
        let quadratic = match self.forchheimer {
            Forchheimer::Ergun => 1.75 * (self.kozeny / 150.0).sqrt() * self.density * s / d,
            Forchheimer::Constant(f) => f * self.kozeny.sqrt() * eps.powf(1.5) * self.density * s / d,
        };
        volume(d) * (linear + quadratic)
    }

    /// `B = 3/4 C_D (1 - eps) eps^-1.65 rho s/d`, divided by `1 - eps`.
    fn single(&self, d: Real, eps: Real, s: Real) -> Real {
        // C_D s, which does not vanish with s.
        let viscous = 24.0 * self.viscosity / (eps * self.density * d);
        let reynolds = 24.0 * s / viscous;
        let drag_times_slip = match self.sphere {
            SphereDrag::SchillerNaumann if reynolds < 1000.0 => viscous * (1.0 + 0.15 * reynolds.powf(0.687)),
            SphereDrag::SchillerNaumann => 0.44 * s,
            // (0.63 sqrt(s) + 4.8 sqrt(s/Re))^2.
            SphereDrag::DallaValle => (0.63 * s.sqrt() + 4.8 * (viscous / 24.0).sqrt()).powi(2),
        };
        volume(d) * 0.75 * drag_times_slip * eps.powf(-1.65) * self.density / d
    }
}

/// Volume of a sphere of diameter `d` [m^3].
#[must_use]
pub fn volume(d: Real) -> Real {
    PI / 6.0 * d * d * d
}

#[cfg(test)]
mod tests {
    use super::*;

    fn water() -> Closure {
        Closure::recommended(1000.0, 1e-3)
    }

    #[test]
    fn a_bed_resists_as_ergun_says() {
        // Pressure gradient at 1 mm/s of superficial velocity [Pa/m].
        for (eps, expected) in [(0.36, 1341.0), (0.38, 1071.0), (0.40, 860.0), (0.42, 695.0)] {
            let d = 1e-3;
            let slip = 1e-3 / eps;
            // Per bulk volume, F = B du with q = eps u; -grad p = F/eps.
            let b = water().coefficient(d, eps, slip) * (1.0 - eps) / volume(d);
            let gradient = b * slip / eps;
            assert!((gradient / expected - 1.0).abs() < 2e-3, "{eps}: {gradient} {expected}");
        }
    }

    #[test]
    fn a_single_sphere_falls_as_its_drag_says() {
        // Diameter, terminal velocity with Schiller and Naumann's drag.
        for (d, expected) in [(1e-3, 0.1551), (0.5e-3, 0.0784), (0.2e-3, 0.0248), (0.1e-3, 0.00797), (2e-3, 0.2835)] {
            let weight = 1650.0 * volume(d) * 9.81;
            let found = water().coefficient(d, 1.0, expected) * expected;
            assert!((found / weight - 1.0).abs() < 0.01, "{d}: {}", found / weight);
        }
        let other = Closure { sphere: SphereDrag::DallaValle, ..water() };
        let weight = 1650.0 * volume(1e-3) * 9.81;
        assert!((other.coefficient(1e-3, 1.0, 0.1423) * 0.1423 / weight - 1.0).abs() < 0.01);
    }

    #[test]
    fn slow_drag_is_that_of_stokes() {
        let stokes = 3.0 * PI * 1e-3 * 1e-3;
        assert!((water().coefficient(1e-3, 1.0, 1e-9) / stokes - 1.0).abs() < 1e-3);
        assert!(water().coefficient(1e-3, 1.0, 0.0).is_finite());
    }

    #[test]
    fn the_blend_is_continuous_and_the_switch_is_not() {
        let at = |law: &Closure, phi: Real| law.coefficient(1e-3, 1.0 - phi * PI / 6.0, 0.05);
        let (low, high) = (at(&water(), 0.38 - 1e-9), at(&water(), 0.38 + 1e-9));
        assert!((low / high - 1.0).abs() < 1e-6);
        let switched = Closure { blend: [0.4, 0.4], ..water() };
        let jump = at(&switched, 0.4 + 1e-9) / at(&switched, 0.4 - 1e-9);
        assert!((jump - 1.32).abs() < 0.01, "{jump}");
    }
}
