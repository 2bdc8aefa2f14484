//! Grains as structure of arrays: this rank's own, sorted by identifier, then ghosts.

use sazanami_numerics::choices;
use sazanami_numerics::{Matrix, Quaternion, Real, Vector};

use crate::body::Body;
use crate::error::DemError;

/// Grains in a block of parallel work.
pub(crate) const ROWS: usize = 64;
/// Number of values that a coupled solver may store with each grain ([`Grains::attached`]).
pub const ATTACHED: usize = 20;

choices! {
    /// How a grain moves.
    #[derive(Default)]
    pub enum Motion {
        /// Moved by forces.
        #[default]
        Free = "free",
        /// Held in place.
        Fixed = "fixed",
        /// Its constant velocity and angular velocity; forces do not act on it.
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
    /// Mass that overrides density times volume [kg].
    pub mass: Option<Real>,
    /// How it moves.
    pub motion: Motion,
    /// Centre of mass [m].
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

/// All grains a rank holds: its own (`0..owned`, sorted by identifier), then ghosts, which are
/// copies of other ranks' grains or periodic images. Every array covers both.
#[derive(Clone, Debug, Default)]
pub struct Grains {
    pub(crate) owned: usize,
    /// Identifiers.
    pub id: Vec<u64>,
    /// Number of the shape.
    pub shape: Vec<u32>,
    /// Number of the material.
    pub material: Vec<u32>,
    /// Size over that of the shape.
    pub scale: Vec<Real>,
    /// Mass [kg].
    pub mass: Vec<Real>,
    /// Principal moments of inertia [kg m^2].
    pub inertia: Vec<Vector>,
    /// How the grain moves.
    pub motion: Vec<Motion>,
    /// Centre of mass of the periodic image that this entry represents [m].
    pub position: Vec<Vector>,
    /// Takes body coordinates to laboratory coordinates.
    pub orientation: Vec<Quaternion>,
    /// Velocity of the centre of mass [m/s].
    pub velocity: Vec<Vector>,
    /// Angular momentum about the centre of mass, laboratory frame [kg m^2/s].
    pub angular_momentum: Vec<Vector>,
    /// Time of the last contact with a grain or wall, on the clock of the engine [s]; minus infinity: never.
    pub last_contact: Vec<Real>,
    /// Sum of the contact forces in the last sub-step [N]; of owned grains only.
    pub contact_force: Vec<Vector>,
    /// Sum of the contact torques in the last sub-step [N m]; of owned grains only.
    pub contact_torque: Vec<Vector>,
    /// Impulse of the drag on each grain over the last call of [`crate::Engine::advance`] [N s], also of those that
    /// forces do not move; of owned grains only. The fluid loses as much.
    pub drag_impulse: Vec<Vector>,
    /// Values that a coupled solver stores with each grain, zero at first; they migrate with it.
    pub attached: Vec<[Real; ATTACHED]>,
    /// Centre of mass without wrapping at periodic sides [m].
    pub(crate) unwrapped: Vec<Vector>,
    /// Periodic image: `position = unwrapped + image * period`.
    pub(crate) image: Vec<[i32; 2]>,
}

/// Complete state of one grain, as it is sent to other ranks and stored.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct GrainRecord {
    pub id: u64,
    pub shape: u32,
    pub material: u32,
    pub motion: u32,
    pub image: [i32; 2],
    pub padding: u32,
    pub scale: Real,
    pub mass: Real,
    pub last_contact: Real,
    pub skin: Real,
    pub inertia: [Real; 3],
    pub unwrapped: [Real; 3],
    pub orientation: [Real; 4],
    pub velocity: [Real; 3],
    pub angular_momentum: [Real; 3],
    pub contact_force: [Real; 3],
    pub contact_torque: [Real; 3],
    pub drag_impulse: [Real; 3],
    pub attached: [Real; ATTACHED],
}

impl Motion {
    pub(crate) fn number(self) -> u32 {
        self as u32
    }

    pub(crate) fn from_number(number: u32) -> Self {
        match number {
            1 => Self::Fixed,
            2 => Self::Prescribed,
            3 => Self::WithWalls,
            _ => Self::Free,
        }
    }
}

impl GrainRecord {
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
            motion: grain.motion.number(),
            image: [0; 2],
            padding: 0,
            scale: grain.scale,
            mass,
            last_contact: Real::NEG_INFINITY,
            skin: 0.0,
            inertia: inertia.to_array(),
            unwrapped: grain.position.to_array(),
            orientation: orientation.to_array(),
            velocity: velocity.to_array(),
            angular_momentum: momentum.to_array(),
            contact_force: [0.0; 3],
            contact_torque: [0.0; 3],
            drag_impulse: [0.0; 3],
            attached: [0.0; ATTACHED],
        })
    }
}

impl Grains {
    /// Number of grains that belong to this rank.
    #[must_use]
    pub fn owned(&self) -> usize {
        self.owned
    }

    /// Number of grains and ghosts.
    #[must_use]
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether this rank holds neither grains nor ghosts.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// Centre of mass of grain `i` without wrapping at periodic sides [m].
    #[must_use]
    pub fn unwrapped_position(&self, i: usize) -> Vector {
        self.unwrapped[i]
    }

    /// Periodic image that entry `i` represents, counted from [`Self::unwrapped_position`].
    #[must_use]
    pub fn image(&self, i: usize) -> [i32; 2] {
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

    /// Kinetic energy of grain `i` [J].
    #[must_use]
    pub fn kinetic_energy(&self, i: usize) -> Real {
        let rotation = self.angular_momentum[i].dot(self.angular_velocity(i));
        0.5 * (self.mass[i] * self.velocity[i].length_squared() + rotation)
    }

    pub(crate) fn clear(&mut self) {
        self.truncate(0);
        self.owned = 0;
    }

    pub(crate) fn truncate(&mut self, length: usize) {
        self.id.truncate(length);
        self.shape.truncate(length);
        self.material.truncate(length);
        self.scale.truncate(length);
        self.mass.truncate(length);
        self.inertia.truncate(length);
        self.motion.truncate(length);
        self.position.truncate(length);
        self.orientation.truncate(length);
        self.velocity.truncate(length);
        self.angular_momentum.truncate(length);
        self.last_contact.truncate(length);
        self.contact_force.truncate(length);
        self.contact_torque.truncate(length);
        self.drag_impulse.truncate(length);
        self.attached.truncate(length);
        self.unwrapped.truncate(length);
        self.image.truncate(length);
    }

    pub(crate) fn push(&mut self, record: &GrainRecord, period: Vector) {
        let unwrapped = Vector::from_array(record.unwrapped);
        self.id.push(record.id);
        self.shape.push(record.shape);
        self.material.push(record.material);
        self.scale.push(record.scale);
        self.mass.push(record.mass);
        self.inertia.push(Vector::from_array(record.inertia));
        self.motion.push(Motion::from_number(record.motion));
        self.position.push(image_position(unwrapped, record.image, period));
        self.orientation.push(Quaternion::from_array(record.orientation));
        self.velocity.push(Vector::from_array(record.velocity));
        self.angular_momentum.push(Vector::from_array(record.angular_momentum));
        self.last_contact.push(record.last_contact);
        self.contact_force.push(Vector::from_array(record.contact_force));
        self.contact_torque.push(Vector::from_array(record.contact_torque));
        self.drag_impulse.push(Vector::from_array(record.drag_impulse));
        self.attached.push(record.attached);
        self.unwrapped.push(unwrapped);
        self.image.push(record.image);
    }

    pub(crate) fn record(&self, i: usize) -> GrainRecord {
        GrainRecord {
            id: self.id[i],
            shape: self.shape[i],
            material: self.material[i],
            motion: self.motion[i].number(),
            image: self.image[i],
            padding: 0,
            scale: self.scale[i],
            mass: self.mass[i],
            last_contact: self.last_contact[i],
            skin: 0.0,
            inertia: self.inertia[i].to_array(),
            unwrapped: self.unwrapped[i].to_array(),
            orientation: self.orientation[i].to_array(),
            velocity: self.velocity[i].to_array(),
            angular_momentum: self.angular_momentum[i].to_array(),
            contact_force: self.contact_force[i].to_array(),
            contact_torque: self.contact_torque[i].to_array(),
            drag_impulse: self.drag_impulse[i].to_array(),
            attached: self.attached[i],
        }
    }
}

/// Position of the periodic image `image` of a grain [m].
pub(crate) fn image_position(unwrapped: Vector, image: [i32; 2], period: Vector) -> Vector {
    if image == [0; 2] {
        return unwrapped;
    }
    unwrapped + Vector::new(Real::from(image[0]) * period.x, Real::from(image[1]) * period.y, 0.0)
}
