//! Particles of fluid and walls as structure of arrays: this rank's own in the order of their bins, then ghosts.

use bytemuck::Zeroable;
use sazanami_numerics::columns;
use sazanami_numerics::particles::Stored;
use sazanami_numerics::{Real, Vector};

/// Kind of a particle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Fluid particle, moves with the flow.
    #[default]
    Fluid,
    /// First layer of a wall: moves with the wall and carries a pressure of its own.
    Wall,
    /// Deeper layers of a wall: complete the kernel support, carry no pressure.
    Dummy,
}

impl Stored for Kind {
    type Form = u32;

    fn store(self) -> u32 {
        self as u32
    }

    fn load(form: u32) -> Self {
        match form {
            0 => Self::Fluid,
            1 => Self::Wall,
            _ => Self::Dummy,
        }
    }
}

/// Role of a particle in the pressure equation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Role {
    /// Not part of the equation: dummy particles, isolated particles, dry walls.
    #[default]
    Inactive,
    /// Prescribed pressure: free surface.
    Dirichlet,
    /// Pressure solved for.
    Unknown,
}

impl Stored for Role {
    type Form = u32;

    fn store(self) -> u32 {
        self as u32
    }

    fn load(form: u32) -> Self {
        match form {
            1 => Self::Dirichlet,
            2 => Self::Unknown,
            _ => Self::Inactive,
        }
    }
}

impl Role {
    pub(crate) fn number(self) -> u8 {
        self as u8
    }

    pub(crate) fn from_number(number: u8) -> Self {
        Self::load(u32::from(number))
    }
}

columns! {
    /// All particles a rank holds: its own (`0..owned`, by bin and identifier), then ghosts, which are copies of other
    /// ranks' particles or periodic images. Every column covers both.
    pub struct Particles;
    /// Complete state of a particle, as it is sent and stored.
    pub struct ParticleRecord;
    {
        /// Identifiers.
        pub id: u64,
        /// Kind of each particle.
        pub kind: Kind,
        /// Role in the pressure equation of the last step.
        pub role: Role,
        /// Position of the periodic image that this entry represents \[m].
        pub position: Vector,
        /// Velocity [m/s].
        pub velocity: Vector,
        /// Reduced pressure: pressure less that of a fluid at rest under the part of the body force that walls can bear
        /// ([`Solver::reduced_force`](crate::solver::Solver::reduced_force)) \[Pa].
        pub pressure: Real,
        /// Gradient of the reduced pressure at the end of the last step [Pa/m].
        pub gradient: Vector,
    }
}

impl ParticleRecord {
    /// A particle without pressure. Until the first step classifies it, it is not isolated.
    pub fn new(id: u64, kind: Kind, position: Vector, velocity: Vector) -> Self {
        let (position, velocity) = (position.to_array(), velocity.to_array());
        Self { id, kind: kind.store(), role: Role::Unknown.store(), position, velocity, ..Self::zeroed() }
    }

    /// Kind and 256 times the role, as snapshots store them.
    pub fn flags(&self) -> u64 {
        u64::from(self.kind) | (u64::from(self.role) << 8)
    }

    /// Kind and role of stored flags.
    pub fn of_flags(flags: u64) -> [u32; 2] {
        [(flags & 255) as u32, (flags >> 8) as u32]
    }
}

impl Particles {
    /// Whether particle `a` is fluid.
    #[must_use]
    pub fn is_fluid(&self, a: usize) -> bool {
        self.kind[a] == Kind::Fluid
    }
}
