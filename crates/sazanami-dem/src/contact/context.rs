//! Input of the evaluation of contacts.

use sazanami_numerics::{Matrix, Real, Vector};

use super::force::PairConstants;
use super::pace::PACES;
use super::search::SphereArrays;
use crate::body::Body;
use crate::bridge::Bridge;
use crate::motion::Pose;
use crate::wall::Wall;

/// The gap up to which films may act between spheres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// Over the smaller radius; 0 without films.
    pub over_radius: Real,
    /// At most \[m].
    pub farthest: Real,
}

impl Reach {
    /// The gap where the smaller sphere has this `radius` \[m].
    #[inline(always)]
    pub fn of(self, radius: Real) -> Real {
        (self.over_radius * radius).min(self.farthest)
    }
}

/// State from which contact forces are computed.
#[derive(Clone, Copy)]
pub(crate) struct ContactContext<'a> {
    pub bodies: &'a [Body],
    pub arrays: &'a [SphereArrays],
    /// Centres and radii of the contact spheres of all bodies.
    pub spheres: &'a [[Real; 4]],
    /// Gap up to which films act.
    pub reach: Reach,
    pub bridge: Option<&'a Bridge>,
    /// See [`crate::Grains::moisture`].
    pub moisture: &'a [Real],
    /// See [`crate::Grains::wetness`].
    pub wetness: &'a [Real],
    /// Whether all bodies are balls.
    pub balls: bool,
    /// Those of images on this rank are as old as the lists: contacts read the grain itself.
    pub poses: &'a [Pose],
    /// Body to laboratory coordinates of each grain; the identity for balls.
    pub rotations: &'a [Matrix],
    /// Upper bound of the path of each grain's contact spheres since the lists were built; 0 for images on this rank \[m].
    pub travel: &'a [Real],
    /// Upper bound of the growth of those of all grains of a pace or a slower one \[m].
    pub largest_travel: [Real; PACES],
    pub walls: &'a [Wall],
    /// Path of each wall since the lists were built \[m].
    pub wall_travel: &'a [Real],
    /// Extent of the box in periodic directions, else 0 \[m].
    pub period: Vector,
    pub owned: usize,
}

impl ContactContext<'_> {
    /// See [`Body::is_round`].
    #[inline]
    pub fn is_round(&self, pose: &Pose) -> bool {
        self.bodies[pose.body as usize].is_round()
    }

    /// Radius of the ball of the volume of grain `g` \[m].
    #[inline]
    pub fn volume_radius(&self, g: u32) -> Real {
        let pose = &self.poses[g as usize];
        self.bodies[pose.body as usize].volume_radius * pose.scale
    }
}

/// A sub-step of the contacts.
pub(crate) struct SubStep<'a> {
    pub context: &'a ContactContext<'a>,
    /// All contact laws, by pair of materials.
    pub laws: &'a [PairConstants],
    /// Whether all laws leave out the rarer options.
    pub plain: bool,
    /// Identifier of each grain.
    pub ids: &'a [u64],
    /// Length of the sub-step \[s].
    pub dt: Real,
}
