//! Properties of the liquid and the gas.

use sazanami_numerics::{Real, choices};

/// Viscosity of a fluid that has none, to divide by [Pa s].
pub(crate) const LEAST: Real = 1e-30;

/// Properties of the two fluids.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluids {
    /// Density of the liquid [kg/m^3].
    pub liquid_density: Real,
    /// Density of the gas [kg/m^3].
    pub gas_density: Real,
    /// Dynamic viscosity of the liquid [Pa s].
    pub liquid_viscosity: Real,
    /// Dynamic viscosity of the gas [Pa s].
    pub gas_viscosity: Real,
}

impl Fluids {
    /// Density of a mixture with liquid fraction `c` [kg/m^3].
    #[inline]
    #[must_use]
    pub fn density(&self, c: Real) -> Real {
        self.gas_density + (self.liquid_density - self.gas_density) * c
    }

    /// Dynamic viscosity of a mixture with liquid fraction `c`, the mean by volume, above zero where there is none [Pa s].
    #[inline]
    #[must_use]
    pub(crate) fn viscosity(&self, c: Real) -> Real {
        let [gas, liquid] = self.viscosities();
        (gas + (liquid - gas) * c.clamp(0.0, 1.0)).max(LEAST)
    }

    /// Kinematic viscosity of a mixture with liquid fraction `c` [m^2/s].
    #[inline]
    #[must_use]
    pub(crate) fn kinematic_viscosity(&self, c: Real) -> Real {
        self.viscosity(c) / self.density(c)
    }

    /// Viscosities of gas and liquid, above zero where there is none, so that one may divide by them [Pa s].
    pub(crate) fn viscosities(&self) -> [Real; 2] {
        [self.gas_viscosity, self.liquid_viscosity].map(|mu| mu.max(LEAST))
    }

    /// Constant and slope of the density as a function of C [kg/m^3].
    pub(crate) fn density_line(&self) -> [Real; 2] {
        [self.gas_density, self.liquid_density - self.gas_density]
    }
}

choices! {
    /// Either of the two fluids.
    pub enum FluidName {
        /// The heavier one.
        Liquid = "liquid",
        /// The lighter one.
        Gas = "gas",
    }
}

impl FluidName {
    /// Liquid fraction of the fluid.
    #[must_use]
    pub fn volume_fraction(self) -> Real {
        match self {
            Self::Liquid => 1.0,
            Self::Gas => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inviscid_fluid_has_almost_no_viscosity_and_it_is_a_number() {
        let fluids =
            |mu: Real| Fluids { liquid_density: 1e3, gas_density: 1.0, liquid_viscosity: mu, gas_viscosity: 1e-5 };
        assert_eq!(fluids(1e-3).kinematic_viscosity(1.0), 1e-6);
        for c in [0.0, 0.5, 1.0] {
            let of_both = Fluids { gas_viscosity: 0.0, ..fluids(0.0) }.kinematic_viscosity(c);
            assert!(0.0 < of_both && of_both < 1e-29, "{of_both}");
        }
        // The gas has a viscosity from which that of the liquid is to be taken to nothing.
        assert!(fluids(0.0).viscosity(1.0) == LEAST);
        assert!(fluids(0.0).kinematic_viscosity(1.0) < 1e-29 && fluids(0.0).kinematic_viscosity(0.0) == 1e-5);
    }
}
