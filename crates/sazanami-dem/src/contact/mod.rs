//! Contacts: who is near whom, who touches, and with what force.

pub(crate) mod block;
pub(crate) mod evaluate;
pub(crate) mod incoming;
pub(crate) mod law;
pub(crate) mod neighbours;
pub(crate) mod search;
pub(crate) mod walls;

use sazanami_numerics::{Matrix, Real, Vector};

use crate::body::Body;
use crate::motion::Frame;
use crate::wall::Wall;
use law::Constants;
use search::SphereArrays;

/// A force and a torque about the centre of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Wrench {
    /// Force [N].
    pub force: Vector,
    /// Torque [N m].
    pub torque: Vector,
}

impl std::ops::AddAssign for Wrench {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.torque += other.torque;
    }
}

/// What contacts are computed from.
#[derive(Clone, Copy)]
pub(crate) struct World<'a> {
    pub bodies: &'a [Body],
    pub arrays: &'a [SphereArrays],
    /// Centres and radii of the contact spheres of all bodies.
    pub spheres: &'a [[Real; 4]],
    /// All contact laws, by pair of materials.
    pub constants: &'a [Constants],
    /// Whether all laws leave out the rarer options.
    pub plain: bool,
    /// Whether all bodies are balls.
    pub balls: bool,
    /// Of images on this rank as they were when the lists were built: contacts look at the grain itself.
    pub frames: &'a [Frame],
    /// Body to laboratory coordinates of each grain; the identity for balls.
    pub rotations: &'a [Matrix],
    /// Bound of the way each grain's contact spheres have gone since the lists were built; 0 for images on this rank [m].
    pub budget: &'a [Real],
    /// Grows in each sub-step by at least as much as any budget does [m].
    pub grown: Real,
    pub walls: &'a [Wall],
    /// The same for walls.
    pub wall_budget: &'a [Real],
    /// Extent of the box in periodic directions, else 0 [m].
    pub period: Vector,
    pub owned: usize,
}

/// The memory of a sphere contact between two grains, the lower identifier first, or between a
/// grain and a wall: as it is sent and stored.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ContactRecord {
    pub low: u64,
    /// Identifier of the other grain, or [`crate::WALL`] plus the number of the wall.
    pub high: u64,
    /// Periodic image of the second grain relative to the first, both without wrapping.
    pub image: [i32; 2],
    pub a: u16,
    pub b: u16,
    /// Whether it is known to have been deeper than the warning limit.
    pub deep: u32,
    pub d_t: [Real; 3],
}

impl ContactRecord {
    pub fn key(&self) -> (u64, u64, [i32; 2], u16, u16) {
        (self.low, self.high, self.image, self.a, self.b)
    }
}

/// What happened among the contacts of one or more blocks in a sub-step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Census {
    pub pairs: usize,
    pub contacts: usize,
    /// Pairs that began or ceased to touch.
    pub changes: usize,
    /// Contacts that passed the warning limit in this sub-step.
    pub deepened: usize,
    /// Largest overlap over the smaller radius, with the identifiers and a position.
    pub deepest: Real,
    pub deepest_ids: [u64; 2],
    pub deepest_at: Vector,
    /// Force on the walls [N].
    pub on_walls: Vector,
}

impl Default for Census {
    fn default() -> Self {
        Self {
            pairs: 0,
            contacts: 0,
            changes: 0,
            deepened: 0,
            deepest: 0.0,
            deepest_ids: [u64::MAX; 2],
            deepest_at: Vector::ZERO,
            on_walls: Vector::ZERO,
        }
    }
}

impl Census {
    pub fn merged(self, other: Self) -> Self {
        let deeper = if other.deepest > self.deepest { &other } else { &self };
        Self {
            pairs: self.pairs + other.pairs,
            contacts: self.contacts + other.contacts,
            changes: self.changes + other.changes,
            deepened: self.deepened + other.deepened,
            deepest: deeper.deepest,
            deepest_ids: deeper.deepest_ids,
            deepest_at: deeper.deepest_at,
            on_walls: self.on_walls + other.on_walls,
        }
    }
}
