//! The momentum budget of a step: momentum stored, and the impulses that change it.
//!
//! With the exact exchange, `liquid + gas + grains - displaced + deferred` changes by the impulses alone.
//! `displaced = sum_k m_f,k v_k` enters because the impulse of a grain is defined for its mass in
//! excess of the fluid it displaces, and the displaced-mass flux `-sum_k v_k dm_f,k` because that mass changes
//! when a grain moves from gas into liquid.

use std::ops::AddAssign;

use sazanami_numerics::{Real, Vector};

use crate::forces::{Forces, MAX_FORCES};

/// Momentum stored at one time, over all ranks [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StoredMomentum {
    /// `sum rho_l C u dV`, liquid inside grains included.
    pub liquid: Vector,
    /// `sum rho_g (1 - C) u dV`, gas inside grains included.
    pub gas: Vector,
    /// `sum M_k v_k` of the grains that move freely.
    pub grains: Vector,
    /// `sum m_f,k v_k`: fluid displaced by free grains; enters the total with a minus sign.
    pub displaced: Vector,
    /// Deferred impulse: taken from the fluid and given to the grains in the next step.
    pub deferred: Vector,
}

impl StoredMomentum {
    /// Names of the terms in files, and their signs in the total.
    pub const TERMS: [(&str, Real); 5] =
        [("liquid", 1.0), ("gas", 1.0), ("grains", 1.0), ("displaced", -1.0), ("deferred_to_grains", 1.0)];

    /// The terms in the order of [`Self::TERMS`].
    #[must_use]
    pub fn terms(&self) -> [Vector; 5] {
        [self.liquid, self.gas, self.grains, self.displaced, self.deferred]
    }
}

/// Impulses from outside in one step, over all ranks [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Impulses {
    /// Pressure and viscous stress of walls and open sides on the fluid.
    pub walls_on_fluid: Vector,
    /// Contact forces of walls on free grains.
    pub walls_on_grains: Vector,
    /// The forces on the fluid in the order of their list, gravity first.
    pub forces: [Vector; MAX_FORCES],
    /// Weight of the free grains less that of the fluid they displace.
    pub gravity_on_grains: Vector,
    /// Displaced-mass flux `-sum_k v_k dm_f,k` of the free grains.
    pub displaced_mass_flux: Vector,
    /// Momentum convected in less that convected out through open sides, and that of clipped residue.
    pub open_sides: Vector,
    /// Of the constraints that hold or drive fixed and prescribed grains.
    pub held_grains: Vector,
}

impl Impulses {
    /// Number of lines up to the forces other than gravity, which come last.
    pub const WITH_GRAVITY: usize = 7;

    /// Names of the lines in the budget, those of the forces included.
    #[must_use]
    pub fn names(forces: &Forces) -> Vec<&'static str> {
        let mut forces = forces.names();
        let gravity = forces.next();
        let own = ["gravity_on_grains", "displaced_mass_flux", "open_sides", "held_grains"];
        ["walls_on_fluid", "walls_on_grains"].into_iter().chain(gravity).chain(own).chain(forces).collect()
    }

    /// The impulses in the order of [`Self::names`], with zeros for forces that are not in the list.
    pub fn terms(&self) -> impl Iterator<Item = Vector> {
        let [gravity, forces @ ..] = self.forces;
        let own = [self.gravity_on_grains, self.displaced_mass_flux, self.open_sides, self.held_grains];
        [self.walls_on_fluid, self.walls_on_grains, gravity].into_iter().chain(own).chain(forces)
    }
}

impl AddAssign for Impulses {
    fn add_assign(&mut self, other: Self) {
        self.walls_on_fluid += other.walls_on_fluid;
        self.walls_on_grains += other.walls_on_grains;
        self.forces.iter_mut().zip(other.forces).for_each(|(sum, impulse)| *sum += impulse);
        self.gravity_on_grains += other.gravity_on_grains;
        self.displaced_mass_flux += other.displaced_mass_flux;
        self.open_sides += other.open_sides;
        self.held_grains += other.held_grains;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_terms_are_in_the_same_order() {
        let names = Impulses::names(&Forces::default());
        let mut impulses = Impulses { displaced_mass_flux: Vector::X, ..Impulses::default() };
        impulses.forces[0] = Vector::Y;
        let term = |name: &str| names.iter().position(|&n| n == name).and_then(|at| impulses.terms().nth(at));
        assert_eq!(term("displaced_mass_flux"), Some(Vector::X));
        assert_eq!(term("gravity_on_fluid"), Some(Vector::Y));
        assert_eq!(term("held_grains"), Some(Vector::ZERO));
        assert_eq!(names.len(), Impulses::WITH_GRAVITY);
    }
}
