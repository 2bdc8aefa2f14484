//! Columns of particles, declared once with the record in which a particle is sent and stored.

use bytemuck::Pod;

use crate::{Quaternion, Real, Vector};

/// A value of a column that can be sent between ranks.
pub trait Stored: Copy + Default + Send + Sync {
    /// Plain form in a record.
    type Form: Pod;

    /// The plain form of a value.
    fn store(self) -> Self::Form;

    /// The value of a plain form.
    fn load(form: Self::Form) -> Self;
}

macro_rules! stored_as_they_are {
    ($($type:ty),+) => {
        $(impl Stored for $type {
            type Form = Self;

            fn store(self) -> Self {
                self
            }

            fn load(form: Self) -> Self {
                form
            }
        })+
    };
}
stored_as_they_are!(u8, u32, u64, Real, [Real; 32]);

/// A periodic image, with a spare number that keeps records free of gaps.
impl Stored for [i32; 3] {
    type Form = [i32; 4];

    fn store(self) -> [i32; 4] {
        [self[0], self[1], self[2], 0]
    }

    fn load(form: [i32; 4]) -> Self {
        [form[0], form[1], form[2]]
    }
}

impl Stored for Vector {
    type Form = [Real; 3];

    fn store(self) -> [Real; 3] {
        self.to_array()
    }

    fn load(form: [Real; 3]) -> Self {
        Self::from_array(form)
    }
}

impl Stored for Quaternion {
    type Form = [Real; 4];

    fn store(self) -> [Real; 4] {
        self.to_array()
    }

    fn load(form: [Real; 4]) -> Self {
        Self::from_array(form)
    }
}

/// Particles as structure of arrays: this rank's own, then ghosts.
pub trait ParticleColumns: Default + Sync {
    /// Complete state of a particle.
    type Record: Pod + Send + Sync;

    /// Number of own particles.
    fn owned(&self) -> usize;

    /// Number of own particles and ghosts.
    fn len(&self) -> usize;

    /// Whether there are neither own particles nor ghosts.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Declares all entries own particles.
    fn own_all(&mut self);

    /// Removes all entries from `length` on.
    fn truncate(&mut self, length: usize);

    /// Appends an entry.
    fn push(&mut self, record: &Self::Record);

    /// State of entry `at`.
    fn record(&self, at: usize) -> Self::Record;

    /// Takes the entries of `others`, entry `n` from place `from(n)`, in parallel.
    fn take_in_order(&mut self, others: &Self, from: impl Fn(usize) -> usize + Sync);
}

/// Declares a set of particles with its columns, and the record of one particle; implements
/// [`ParticleColumns`](crate::particles::ParticleColumns).
///
/// Record fields are in the order of the columns and must leave no padding.
///
/// ```
/// use sazanami_numerics::particles::ParticleColumns;
/// use sazanami_numerics::{Real, Vector};
///
/// sazanami_numerics::columns! {
///     /// Tracers.
///     pub struct Tracers;
///     /// State of a tracer.
///     pub struct TracerRecord;
///     {
///         /// Identifiers.
///         pub id: u64,
///         /// Positions [m].
///         pub position: Vector,
///     }
/// }
///
/// let mut tracers = Tracers::default();
/// tracers.push(&TracerRecord { id: 7, position: [0.0, 1.0, 2.0] });
/// tracers.own_all();
/// assert_eq!((tracers.owned(), tracers.position[0].z), (1, 2.0));
/// ```
#[macro_export]
macro_rules! columns {
    (
        $(#[$about:meta])+
        $visibility:vis struct $Columns:ident;
        $(#[$record_about:meta])+
        $record_visibility:vis struct $Record:ident;
        { $($(#[$column_about:meta])+ $column_visibility:vis $column:ident: $type:ty,)+ }
    ) => {
        $(#[$about])+
        #[derive(Clone, Debug, Default)]
        $visibility struct $Columns {
            pub(crate) owned: usize,
            $($(#[$column_about])+ $column_visibility $column: Vec<$type>,)+
        }

        $(#[$record_about])+
        #[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        #[repr(C)]
        $record_visibility struct $Record {
            $($(#[$column_about])+ pub $column: <$type as $crate::particles::Stored>::Form,)+
        }

        impl $Columns {
            /// Number of entries that belong to this rank.
            #[must_use]
            pub fn owned(&self) -> usize {
                self.owned
            }

            /// Number of own entries and ghosts.
            #[must_use]
            pub fn len(&self) -> usize {
                self.id.len()
            }

            /// Whether this rank holds neither own entries nor ghosts.
            #[must_use]
            pub fn is_empty(&self) -> bool {
                self.id.is_empty()
            }
        }

        impl $crate::particles::ParticleColumns for $Columns {
            type Record = $Record;

            fn owned(&self) -> usize {
                self.owned
            }

            fn len(&self) -> usize {
                self.id.len()
            }

            fn own_all(&mut self) {
                self.owned = self.id.len();
            }

            fn truncate(&mut self, length: usize) {
                $(self.$column.truncate(length);)+
                self.owned = self.owned.min(length);
            }

            fn push(&mut self, record: &$Record) {
                $(self.$column.push($crate::particles::Stored::load(record.$column));)+
            }

            fn record(&self, at: usize) -> $Record {
                $Record { $($column: $crate::particles::Stored::store(self.$column[at]),)+ }
            }

            fn take_in_order(&mut self, others: &Self, from: impl Fn(usize) -> usize + Sync) {
                self.owned = others.owned;
                $($crate::particles::take_column(&mut self.$column, &others.$column, &from);)+
            }
        }
    };
}

/// Entries that are put in order in one go.
pub(crate) const MANY: usize = 1024;

/// Takes entry `n` of a column from place `from(n)` of another.
pub fn take_column<T: Stored>(column: &mut Vec<T>, others: &[T], from: &(impl Fn(usize) -> usize + Sync)) {
    column.resize(others.len(), T::default());
    sazanami_parallel::for_each_chunk(&mut column[..], MANY, |number, column| {
        column.iter_mut().enumerate().for_each(|(n, value)| *value = others[from(number * MANY + n)]);
    });
}
