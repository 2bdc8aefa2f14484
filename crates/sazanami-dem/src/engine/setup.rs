//! Input of an engine: bodies and walls, loads and drag, the number of sub-steps.

use sazanami_numerics::{Real, Vector};

use crate::body::Body;
use crate::contact::laws::Interactions;
use crate::wall::Wall;

/// Bodies, contact laws, walls and region of an engine: everything but the grains.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Bodies by number of the shape.
    pub bodies: Vec<Body>,
    /// Contact laws.
    pub interactions: Interactions,
    /// Planes that bound the grains, fixed or moving.
    pub walls: Vec<Wall>,
    /// Corners of the region that centres of mass may not leave \[m]; components may be infinite.
    pub region: [Vector; 2],
    /// A rank holds a ghost of every grain whose surface comes this near to its part of the domain \[m].
    pub ghost_margin: Real,
}

/// Forces and torques from outside on this rank's grains, constant over a call, and the drag of a fluid.
#[derive(Clone, Copy, Default)]
pub struct Loads<'a> {
    /// Force on each own grain \[N]; empty: none.
    pub force: &'a [Vector],
    /// Torque about the centre of mass of each own grain [N m]; empty: none.
    pub torque: &'a [Vector],
    /// Mass of fluid that each own grain has to accelerate with itself \[kg]; empty: none.
    ///
    /// It is inertia without weight: forces and drag move a free grain of mass `m` with `F/(m + a)`, gravity with
    /// `m g/(m + a)`; torques by its own inertia. The dashpots of contacts are those of `m`: with it a collision restitutes as
    /// that of a heavier grain.
    pub added_mass: &'a [Real],
    /// Drag, implicit in every sub-step; what it gives each own grain is in [`Grains::drag_impulse`](crate::Grains::drag_impulse).
    pub drag: Option<&'a dyn Drag>,
}

/// The drag of a fluid on own grains: force `kappa (u - v)` through the centre of mass.
///
/// A sub-step of length `h` takes a free grain from velocity `v` to
/// `(v + h (F/m + g) + h kappa u/m)/(1 + h kappa/m)`, with `kappa` at the slip `|u - v|` of its start. Where the fluid
/// yields with a mass `M`, `u` follows the drag too: `u` is that of the start less the impulse so far over `M`, and the
/// sub-step is implicit on both sides, with `1/m + 1/M` for `1/m` below the line.
pub trait Drag: Sync {
    /// Velocity `u` of the fluid round own grain `own` [m/s].
    fn fluid_velocity(&self, own: usize) -> Vector;

    /// Drag coefficient `kappa` of own grain `own` at the speed `slip` [m/s] relative to the fluid [kg/s].
    fn coefficient(&self, own: usize, slip: Real) -> Real;

    /// One over the mass of the fluid that yields to the drag on own grain `own` [1/kg]; 0 for a fluid that keeps its
    /// velocity.
    fn inverse_fluid_mass(&self, _own: usize) -> Real {
        0.0
    }
}

impl std::fmt::Debug for Loads<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut out = f.debug_struct("Loads");
        out.field("force", &self.force).field("torque", &self.torque).field("added_mass", &self.added_mass);
        out.field("drag", &self.drag.is_some()).finish()
    }
}

impl Loads<'_> {
    /// No loads.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }
}

/// Number of sub-steps of a call.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Substeps {
    /// As many as [`Engine::contact_time_step`](crate::Engine::contact_time_step) asks for.
    #[default]
    Auto,
    /// This number.
    Fixed(usize),
}

/// The region in which a rank holds all images of grains: see [`Engine::vicinity`](crate::Engine::vicinity).
#[derive(Clone, Copy, Debug)]
pub struct Vicinity {
    /// The rank's part, without end where a side of the box is not periodic \[m].
    pub(super) lower: Vector,
    pub(super) upper: Vector,
    /// Farthest from that part \[m].
    pub(super) margin: Real,
    /// Farthest in each direction \[m].
    pub(super) farthest: Vector,
}

impl Vicinity {
    /// Whether `position` \[m] lies in the region.
    #[inline]
    #[must_use]
    pub fn contains(&self, position: Vector) -> bool {
        let beyond = (self.lower - position).max(position - self.upper).max(Vector::ZERO);
        beyond.length_squared() < self.margin.powi(2) && beyond.cmplt(self.farthest).all()
    }
}
