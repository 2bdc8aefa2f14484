//! Particles of fluid and walls as structure of arrays: this rank's own in the order of their bins, then ghosts.

use bytemuck::{Pod, Zeroable};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

/// Identifiers of wall and dummy particles start here; smaller ones are fluid.
pub const FIRST_WALL_ID: u64 = 1 << 62;

/// What a particle is.
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

impl Kind {
    fn number(self) -> u64 {
        self as u64
    }

    fn from_number(number: u64) -> Self {
        match number {
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

impl Role {
    pub(crate) fn number(self) -> u8 {
        self as u8
    }

    pub(crate) fn from_number(number: u8) -> Self {
        match number {
            1 => Self::Dirichlet,
            2 => Self::Unknown,
            _ => Self::Inactive,
        }
    }
}

/// All particles a rank knows: its own (`0..owned`, by bin and identifier), then ghosts, which are copies of other
/// ranks' particles or periodic images. Every column covers both.
#[derive(Clone, Debug, Default)]
pub struct Particles {
    pub(crate) owned: usize,
    /// Identifiers.
    pub id: Vec<u64>,
    /// What each particle is.
    pub kind: Vec<Kind>,
    /// Position, of the periodic image that this entry stands for [m].
    pub position: Vec<Vector>,
    /// Velocity [m/s].
    pub velocity: Vec<Vector>,
    /// Reduced pressure: pressure less that of a fluid at rest under the part of the body force that walls can bear
    /// ([`Solver::reduced_force`](crate::solver::Solver::reduced_force)) [Pa].
    pub pressure: Vec<Real>,
    /// Gradient of the reduced pressure at the end of the last step [Pa/m].
    pub gradient: Vec<Vector>,
    /// Role in the pressure equation of the last step.
    pub role: Vec<Role>,
    /// Order of the particles, kept for its memory.
    keys: Vec<(u32, u64, u32)>,
    spare: Spare,
}

/// Everything about a particle, as it is sent and stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ParticleRecord {
    pub id: u64,
    /// Kind, and 256 times the role.
    pub flags: u64,
    pub position: [Real; 3],
    pub velocity: [Real; 3],
    pub pressure: Real,
    pub gradient: [Real; 3],
}

impl ParticleRecord {
    pub fn kind(&self) -> Kind {
        Kind::from_number(self.flags & 255)
    }

    pub fn role(&self) -> Role {
        Role::from_number((self.flags >> 8) as u8)
    }

    pub fn new(id: u64, kind: Kind, position: Vector, velocity: Vector) -> Self {
        let (position, velocity) = (position.to_array(), velocity.to_array());
        // Until the first step classifies them, fluid particles are not isolated.
        let flags = kind.number() | (u64::from(Role::Unknown.number()) << 8);
        Self { id, flags, position, velocity, ..Self::default() }
    }
}

impl Particles {
    /// Number of particles that belong to this rank.
    #[must_use]
    pub fn owned(&self) -> usize {
        self.owned
    }

    /// Number of particles and ghosts.
    #[must_use]
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether this rank knows no particles at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// Whether particle `a` is fluid.
    #[must_use]
    pub fn is_fluid(&self, a: usize) -> bool {
        self.kind[a] == Kind::Fluid
    }

    pub(crate) fn truncate(&mut self, length: usize) {
        self.id.truncate(length);
        self.kind.truncate(length);
        self.position.truncate(length);
        self.velocity.truncate(length);
        self.pressure.truncate(length);
        self.gradient.truncate(length);
        self.role.truncate(length);
    }

    pub(crate) fn push(&mut self, record: &ParticleRecord) {
        self.id.push(record.id);
        self.kind.push(record.kind());
        self.position.push(Vector::from_array(record.position));
        self.velocity.push(Vector::from_array(record.velocity));
        self.pressure.push(record.pressure);
        self.gradient.push(Vector::from_array(record.gradient));
        self.role.push(record.role());
    }

    pub(crate) fn record(&self, a: usize) -> ParticleRecord {
        ParticleRecord {
            id: self.id[a],
            flags: self.kind[a].number() | (u64::from(self.role[a].number()) << 8),
            position: self.position[a].to_array(),
            velocity: self.velocity[a].to_array(),
            pressure: self.pressure[a],
            gradient: self.gradient[a].to_array(),
        }
    }

    /// Puts the own particles into the order of `bin` and, within a bin, of their identifiers. There are no ghosts.
    pub(crate) fn sort(&mut self, bins: usize, bin: impl Fn(Vector) -> u32 + Sync) {
        let Self { id, kind, position, velocity, pressure, gradient, role, keys, spare, .. } = self;
        keys.resize(id.len(), (0, 0, 0));
        for_each_chunk(&mut keys[..], MANY, |number, keys| {
            for (n, key) in keys.iter_mut().enumerate() {
                let a = number * MANY + n;
                *key = (bin(position[a]), id[a], a as u32);
            }
        });
        if !keys.is_sorted() {
            sort_by_bin(keys, &mut spare.keys, &mut spare.starts, bins);
            permute(id, &mut spare.id, keys);
            permute(kind, &mut spare.kind, keys);
            permute(position, &mut spare.vector, keys);
            permute(velocity, &mut spare.vector, keys);
            permute(pressure, &mut spare.number, keys);
            permute(gradient, &mut spare.vector, keys);
            permute(role, &mut spare.role, keys);
        }
        self.owned = self.len();
    }
}

/// Particles that are put in order in one go.
const MANY: usize = 1024;

/// Columns to be put in order, kept for their memory.
#[derive(Clone, Debug, Default)]
struct Spare {
    id: Vec<u64>,
    kind: Vec<Kind>,
    vector: Vec<Vector>,
    number: Vec<Real>,
    role: Vec<Role>,
    keys: Vec<(u32, u64, u32)>,
    starts: Vec<u32>,
}

/// Sorts keys whose first part is less than `bins`.
fn sort_by_bin(keys: &mut Vec<(u32, u64, u32)>, spare: &mut Vec<(u32, u64, u32)>, starts: &mut Vec<u32>, bins: usize) {
    starts.clear();
    starts.resize(bins + 1, 0);
    keys.iter().for_each(|key| starts[key.0 as usize + 1] += 1);
    (1..=bins).for_each(|n| starts[n] += starts[n - 1]);
    spare.resize(keys.len(), (0, 0, 0));
    for key in &*keys {
        let at = &mut starts[key.0 as usize];
        spare[*at as usize] = *key;
        *at += 1;
    }
    // Each entry is where its bin ends now.
    let mut first = 0;
    for &end in &starts[..bins] {
        spare[first..end as usize].sort_unstable();
        first = end as usize;
    }
    std::mem::swap(keys, spare);
}

/// Puts a column into the order of the keys.
fn permute<T: Copy + Default + Send + Sync>(column: &mut Vec<T>, spare: &mut Vec<T>, keys: &[(u32, u64, u32)]) {
    spare.resize(column.len(), T::default());
    let before = &column[..];
    for_each_chunk(&mut spare[..], MANY, |number, after| {
        after.iter_mut().zip(&keys[number * MANY..]).for_each(|(after, key)| *after = before[key.2 as usize]);
    });
    std::mem::swap(column, spare);
}
