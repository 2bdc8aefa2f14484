//! Grains as structure of arrays: this rank's own, sorted by identifier, then ghosts.

use sazanami_numerics::particles::Stored;
use sazanami_numerics::{Matrix, Quaternion, Real, Vector};
use sazanami_numerics::{choices, columns};

use crate::body::Body;
use crate::error::DemError;

/// Grains in a block of parallel work.
pub(crate) const ROWS: usize = 64;
/// Number of values that a coupled solver may store with each grain ([`Grains::attached`]).
pub const ATTACHED: usize = 32;
/// The first of them, which every snapshot has; the others are stored where some are not zero.
pub(crate) const ALWAYS_STORED: usize = 20;

choices! {
    /// Motion of a grain.
    #[derive(Default)]
    pub enum Motion {
        /// Moved by forces.
        #[default]
        Free = "free",
        /// Held in place.
        Fixed = "fixed",
        /// Its constant velocity and angular velocity, from the start of the run on; forces do not act on it.
        Prescribed = "prescribed",
        /// The velocity of the walls, to which it is fixed ([`Engine::set_wall_velocities`](crate::Engine::set_wall_velocities)).
        #[unlisted]
        WithWalls = "with_walls",
    }
}

/// A grain as input: shape, material, size, motion and state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// Identifier, unique, below [`crate::WALL`].
    pub id: u64,
    /// Number of its shape.
    pub shape: u32,
    /// Number of its material.
    pub material: u32,
    /// Size over that of the shape.
    pub scale: Real,
    /// Density [kg/m^3].
    pub density: Real,
    /// Mass that overrides density times volume \[kg].
    pub mass: Option<Real>,
    /// Cause of its motion: forces, or a prescribed velocity.
    pub motion: Motion,
    /// Centre of mass \[m].
    pub position: Vector,
    /// Takes body coordinates to laboratory coordinates.
    pub orientation: Quaternion,
    /// Velocity of the centre of mass [m/s].
    pub velocity: Vector,
    /// Angular velocity in the laboratory frame [rad/s].
    pub angular_velocity: Vector,
}

impl Grain {
    /// A free grain at rest, upright, of shape 0 and material 0.
    #[must_use]
    pub fn new(id: u64, density: Real, position: Vector) -> Self {
        Self {
            id,
            shape: 0,
            material: 0,
            scale: 1.0,
            density,
            mass: None,
            motion: Motion::Free,
            position,
            orientation: Quaternion::IDENTITY,
            velocity: Vector::ZERO,
            angular_velocity: Vector::ZERO,
        }
    }
}

columns! {
    /// All grains a rank holds: its own (`0..owned`, sorted by identifier), then ghosts, which are
    /// copies of other ranks' grains or periodic images. Every column covers both.
    pub struct Grains;
    /// Complete state of one grain, as it is sent to other ranks and stored.
    pub struct GrainRecord;
    {
        /// Identifiers.
        pub id: u64,
        /// Number of the shape.
        pub shape: u32,
        /// Number of the material.
        pub material: u32,
        /// Size over that of the shape.
        pub scale: Real,
        /// Mass \[kg].
        pub mass: Real,
        /// Principal moments of inertia [kg m^2].
        pub inertia: Vector,
        /// Motion of the grain.
        pub motion: Motion,
        /// Centre of mass of the periodic image that this entry represents \[m].
        pub position: Vector,
        /// Takes body coordinates to laboratory coordinates.
        pub orientation: Quaternion,
        /// Velocity of the centre of mass [m/s].
        pub velocity: Vector,
        /// Angular momentum about the centre of mass, laboratory frame [kg m^2/s].
        pub angular_momentum: Vector,
        /// Time of the last contact with a grain or wall, on the clock of the engine \[s]; minus infinity: never.
        pub last_contact: Real,
        /// Sum of the contact forces in the last sub-step \[N]; of owned grains only.
        pub contact_force: Vector,
        /// Sum of the contact torques in the last sub-step [N m]; of owned grains only.
        pub contact_torque: Vector,
        /// Impulse of the drag on each grain over the last call of [`crate::Engine::advance`] [N s], also of those that
        /// forces do not move; of owned grains only. The fluid loses as much.
        pub drag_impulse: Vector,
        /// Viscosity of what is about the grain over that of its [`crate::Film`], as a coupled solver last said; 1 at first. The film of a
        /// pair has the smaller of the two. Not stored: a solver that says it does so before every advance.
        pub wetness: Real,
        /// Part of the pull of the liquid bridges of each grain that what is about it leaves, as a coupled solver last said: 0 where no
        /// liquid has been, and under water; 1 at first. A pair has the smaller of the two. Not stored, as the wetness.
        pub moisture: Real,
        /// Values that a coupled solver stores with each grain, zero at first; they migrate with it.
        pub attached: [Real; ATTACHED],
        /// Centre of mass without wrapping at periodic sides \[m].
        pub(crate) unwrapped: Vector,
        /// Periodic image: `position = unwrapped + image * period`.
        pub(crate) image: [i32; 3],
        /// Distance that the grain may travel before lists are renewed \[m].
        pub(crate) skin: Real,
    }
}

impl Stored for Motion {
    type Form = u64;

    fn store(self) -> u64 {
        self as u64
    }

    fn load(form: u64) -> Self {
        match form {
            1 => Self::Fixed,
            2 => Self::Prescribed,
            3 => Self::WithWalls,
            _ => Self::Free,
        }
    }
}

impl GrainRecord {
    /// The same grain as periodic image `image`.
    pub(crate) fn as_image(&self, image: [i32; 3], period: Vector) -> Self {
        let position = image_position(Vector::from_array(self.unwrapped), image, period).to_array();
        Self { image: image.store(), position, ..*self }
    }

    /// Turns users' descriptions into states, by identifier; `materials` is how many materials there are.
    pub(crate) fn of_all(grains: &[Grain], bodies: &[Body], materials: usize) -> Result<Vec<Self>, DemError> {
        let mut records: Vec<Self> =
            grains.iter().map(|grain| Self::new(grain, bodies, materials)).collect::<Result<_, _>>()?;
        records.sort_unstable_by_key(|r| r.id);
        match records.windows(2).find(|w| w[0].id == w[1].id) {
            Some(twice) => Err(DemError::not_unique(twice[0].id)),
            None => Ok(records),
        }
    }

    /// Turns a user's description into a state.
    pub(crate) fn new(grain: &Grain, bodies: &[Body], materials: usize) -> Result<Self, DemError> {
        let bad = |what: &str| DemError::BadGrain { id: grain.id, what: what.to_string() };
        if grain.material as usize >= materials {
            return Err(bad("there is no such material"));
        }
        let body = bodies.get(grain.shape as usize).ok_or_else(|| bad("there is no such shape"))?;
        if grain.id >= crate::WALL {
            return Err(bad("the identifier is too large"));
        }
        let volume = body.volume * grain.scale.powi(3);
        let mass = grain.mass.unwrap_or(grain.density * volume);
        if !(grain.scale > 0.0 && grain.scale.is_finite() && mass > 0.0 && mass.is_finite()) {
            return Err(bad("size and mass must be positive"));
        }
        let inertia = body.inertia * grain.scale.powi(5) * (mass / volume);
        let orientation = grain.orientation.normalize();
        let turn = Matrix::from_quat(orientation);
        let at_rest = matches!(grain.motion, Motion::Fixed | Motion::WithWalls);
        let momentum =
            if at_rest { Vector::ZERO } else { turn * (inertia * (turn.transpose() * grain.angular_velocity)) };
        let velocity = if at_rest { Vector::ZERO } else { grain.velocity };
        if ![grain.position, velocity, momentum].iter().all(|v| v.is_finite()) || !orientation.is_finite() {
            return Err(bad("position, orientation and velocities must be numbers"));
        }
        Ok(Self {
            id: grain.id,
            shape: grain.shape,
            material: grain.material,
            motion: grain.motion.store(),
            scale: grain.scale,
            mass,
            last_contact: Real::NEG_INFINITY,
            skin: 0.0,
            inertia: inertia.to_array(),
            position: grain.position.to_array(),
            unwrapped: grain.position.to_array(),
            image: [0; 4],
            orientation: orientation.to_array(),
            velocity: velocity.to_array(),
            angular_momentum: momentum.to_array(),
            contact_force: [0.0; 3],
            contact_torque: [0.0; 3],
            drag_impulse: [0.0; 3],
            wetness: 1.0,
            moisture: 1.0,
            attached: [0.0; ATTACHED],
        })
    }
}

impl Grains {
    /// Centre of mass of grain `i` without wrapping at periodic sides \[m].
    #[must_use]
    pub fn unwrapped_position(&self, i: usize) -> Vector {
        self.unwrapped[i]
    }

    /// Periodic image that entry `i` represents, counted from [`Self::unwrapped_position`].
    #[must_use]
    pub fn image(&self, i: usize) -> [i32; 3] {
        self.image[i]
    }

    /// Angular velocity of grain `i` in the laboratory frame [rad/s].
    #[must_use]
    pub fn angular_velocity(&self, i: usize) -> Vector {
        let turn = Matrix::from_quat(self.orientation[i]);
        crate::body::spin(&turn, self.inertia[i].recip(), self.angular_momentum[i])
    }

    /// Velocity of the material point of grain `i` at `position` [m/s].
    #[must_use]
    pub fn velocity_at(&self, i: usize, position: Vector) -> Vector {
        self.velocity[i] + self.angular_velocity(i).cross(position - self.position[i])
    }

    /// Kinetic energy of grain `i` \[J].
    #[must_use]
    pub fn kinetic_energy(&self, i: usize) -> Real {
        let rotation = self.angular_momentum[i].dot(self.angular_velocity(i));
        0.5 * (self.mass[i] * self.velocity[i].length_squared() + rotation)
    }
}

/// Position of the periodic image `image` of a grain \[m].
pub(crate) fn image_position(unwrapped: Vector, image: [i32; 3], period: Vector) -> Vector {
    if image == [0; 3] {
        return unwrapped;
    }
    unwrapped + Vector::from_array(image.map(Real::from)) * period
}
