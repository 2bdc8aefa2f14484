//! The momentum budget of a step: momentum stored, and the impulses that change it.
//!
//! With the exact exchange, `liquid + gas + grains - displaced + deferred` changes by the impulses alone.
//! `displaced = sum_k m_f,k v_k` enters because the impulse of a grain is defined for its mass in
//! excess of the fluid it displaces, and the displaced-mass flux `-sum_k v_k dm_f,k` because that mass changes
//! when a grain moves from gas into liquid.

use std::ops::AddAssign;

use sazanami_numerics::Vector;

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

/// Impulses from outside in one step, over all ranks [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Impulses {
    /// Pressure and viscous stress of walls and open sides on the fluid.
    pub walls_on_fluid: Vector,
    /// Contact forces of walls on free grains.
    pub walls_on_grains: Vector,
    /// Weight of the fluid.
    pub gravity_on_fluid: Vector,
    /// Weight of the free grains less that of the fluid they displace.
    pub gravity_on_grains: Vector,
    /// Displaced-mass flux `-sum_k v_k dm_f,k` of the free grains.
    pub displaced_mass_flux: Vector,
    /// Momentum convected in less that convected out through open sides.
    pub open_sides: Vector,
    /// Of the constraints that hold or drive fixed and prescribed grains.
    pub held_grains: Vector,
}

impl AddAssign for Impulses {
    fn add_assign(&mut self, other: Self) {
        self.walls_on_fluid += other.walls_on_fluid;
        self.walls_on_grains += other.walls_on_grains;
        self.gravity_on_fluid += other.gravity_on_fluid;
        self.gravity_on_grains += other.gravity_on_grains;
        self.displaced_mass_flux += other.displaced_mass_flux;
        self.open_sides += other.open_sides;
        self.held_grains += other.held_grains;
    }
}
