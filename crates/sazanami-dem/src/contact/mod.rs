//! Contacts: neighbour search, skin checks, contact forces.

pub(crate) mod block;
pub(crate) mod evaluate;
pub(crate) mod incoming;
pub(crate) mod law;
pub(crate) mod neighbours;
pub(crate) mod search;
pub(crate) mod walls;

use sazanami_numerics::{Matrix, Real, Vector};

use crate::body::Body;
use crate::motion::Pose;
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

/// State from which contact forces are computed.
#[derive(Clone, Copy)]
pub(crate) struct ContactContext<'a> {
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
    /// Those of images on this rank are as old as the lists: contacts read the grain itself.
    pub poses: &'a [Pose],
    /// Body to laboratory coordinates of each grain; the identity for balls.
    pub rotations: &'a [Matrix],
    /// Upper bound of the path of each grain's contact spheres since the lists were built; 0 for images on this rank [m].
    pub travel: &'a [Real],
    /// Upper bound of all of them [m].
    pub largest_travel: Real,
    pub walls: &'a [Wall],
    /// Path of each wall since the lists were built [m].
    pub wall_travel: &'a [Real],
    /// Extent of the box in periodic directions, else 0 [m].
    pub period: Vector,
    pub owned: usize,
}

/// The history of a sphere contact between two grains, the lower identifier first, or between a
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
    /// Whether it has been counted as deeper than the warning limit.
    pub deep: u32,
    pub d_t: [Real; 3],
}

impl ContactRecord {
    pub fn key(&self) -> (u64, u64, [i32; 2], u16, u16) {
        (self.low, self.high, self.image, self.a, self.b)
    }
}

/// Counters of the contacts of one or more blocks in a sub-step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counters {
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

impl Default for Counters {
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

impl Counters {
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
