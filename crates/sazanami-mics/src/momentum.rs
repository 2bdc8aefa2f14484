//! Momentum held by everything, and the impulses that change it.
//!
//! With the exact exchange, `liquid + gas + grains - displaced + owed` changes by the impulses alone.
//! `displaced = sum_k m_f,k v_k` enters because the impulse of a grain is defined for its mass in
//! excess of the fluid it displaces, and `swallowed = -sum_k v_k dm_f,k` because that mass changes
//! when a grain moves from gas into liquid.

use std::ops::AddAssign;

use sazanami_numerics::Vector;

/// Momentum held at one time, over all ranks [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MomentumStock {
    /// In the liquid, inside grains too.
    pub liquid: Vector,
    /// In the gas, inside grains too.
    pub gas: Vector,
    /// In the grains that move freely.
    pub grains: Vector,
    /// Of the fluid that free grains displace, at the velocity of the grains.
    pub displaced: Vector,
    /// Taken from the fluid and not yet given to the grains.
    pub owed: Vector,
}

/// Impulses in a step, over all ranks [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MomentumImpulses {
    /// Pressure and shear of walls and open sides on the fluid.
    pub walls_on_fluid: Vector,
    /// Contact forces of walls on free grains.
    pub walls_on_grains: Vector,
    /// Weight of the fluid.
    pub gravity_on_fluid: Vector,
    /// Weight of the free grains less that of the displaced fluid.
    pub gravity_on_grains: Vector,
    /// `-sum_k v_k dm_f,k` of the free grains.
    pub swallowed: Vector,
    /// Carried in less carried out through open sides.
    pub open_sides: Vector,
    /// Of what holds fixed and driven grains.
    pub held_grains: Vector,
}

impl AddAssign for MomentumImpulses {
    fn add_assign(&mut self, other: Self) {
        self.walls_on_fluid += other.walls_on_fluid;
        self.walls_on_grains += other.walls_on_grains;
        self.gravity_on_fluid += other.gravity_on_fluid;
        self.gravity_on_grains += other.gravity_on_grains;
        self.swallowed += other.swallowed;
        self.open_sides += other.open_sides;
        self.held_grains += other.held_grains;
    }
}
