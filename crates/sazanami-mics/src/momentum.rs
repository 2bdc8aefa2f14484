//! The momentum budget of a step: momentum stored, and the impulses that change it.
//!
//! With surfaces of grains, `liquid + gas + grains - displaced` changes by the impulses alone; with the published exchange also by what
//! back-projection loses. `displaced` is the momentum of the fluid on the covered part of the cells, or `sum_k m_f,k v_k`, with the
//! displaced-mass flux `-sum_k v_k dm_f,k` because that mass changes when a grain moves from gas into liquid.

use sazanami_numerics::{Vector, named_vectors};

named_vectors! {
    /// Momentum stored at one time, over all ranks [N s].
    pub struct StoredMomentum {
        /// `sum rho_l C u dV`, liquid inside grains included.
        liquid,
        /// `sum rho_g (1 - C) u dV`, gas inside grains included.
        gas,
        /// `sum M_k v_k` of the grains that move freely.
        grains,
        /// Of the fluid on the covered part of cells; with back-projection `sum m_f,k v_k`: fluid displaced by free grains.
        displaced = -1.0,
    }
}

named_vectors! {
    /// Impulses from outside in one step, over all ranks [N s].
    pub struct Impulses {
        /// Pressure and viscous stress of walls and open sides on the fluid.
        walls_on_fluid,
        /// Contact forces of walls on free grains.
        walls_on_grains,
        /// Weight of the fluid.
        gravity_on_fluid,
        /// Surface tension: the error of its curvature, and what walls hold of the interface that ends at them.
        surface_tension,
        /// Weight of the free grains less that of the fluid they displace.
        gravity_on_grains,
        /// Displaced-mass flux `-sum_k v_k dm_f,k` of the free grains.
        displaced_mass_flux,
        /// Momentum convected in less that convected out through open sides, and that of grains that leave or are fed in through them.
        open_sides,
        /// Of the constraints that hold or drive fixed and prescribed grains.
        held_grains,
        /// Of liquid that is added or taken by clipping, and of what cells without grains are too light to take.
        residue,
    }
}

impl StoredMomentum {
    /// All of it, what counts as covered taken off [N s].
    #[must_use]
    pub fn total(&self) -> Vector {
        Self::TERMS.iter().zip(self.terms()).map(|(&(_, sign), term)| sign * term).sum()
    }
}

impl Impulses {
    /// Names of the lines in the budget.
    #[must_use]
    pub fn names() -> Vec<&'static str> {
        Self::TERMS.map(|(name, _)| name).to_vec()
    }

    /// The impulse that free grains have beside that of the fluid.
    #[must_use]
    pub fn on_grains(&self) -> Vector {
        self.gravity_on_grains + self.walls_on_grains + self.held_grains
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grains_have_weight_walls_and_holding_beside_the_fluid() {
        let impulses = Impulses {
            gravity_on_grains: -5.0 * Vector::Z,
            walls_on_grains: 2.0 * Vector::Z,
            held_grains: Vector::X,
            gravity_on_fluid: -70.0 * Vector::Z,
            walls_on_fluid: 11.0 * Vector::Z,
            displaced_mass_flux: 13.0 * Vector::Y,
            ..Impulses::default()
        };
        assert_eq!(impulses.on_grains(), Vector::new(1.0, 0.0, -3.0));
    }
}
