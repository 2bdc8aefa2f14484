//! The state of a run as named arrays: what a checkpoint holds, whoever writes it.

use std::collections::BTreeMap;

use crate::domain::FailedElsewhere;
use crate::{Real, Vector};

/// An array of a snapshot.
#[derive(Clone, Debug, PartialEq)]
pub enum Section {
    /// Bytes or text.
    U8(Vec<u8>),
    /// Small numbers.
    U32(Vec<u32>),
    /// Counters and identifiers.
    U64(Vec<u64>),
    /// Physical quantities.
    F64(Vec<f64>),
}

/// Something is not in a snapshot as expected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SnapshotError {
    /// No array of this name and element type.
    #[error("the snapshot holds no section `{name}` of type {kind}")]
    Missing {
        /// Name asked for.
        name: String,
        /// Element type asked for.
        kind: &'static str,
    },
    /// An array of another length.
    #[error("section `{name}` of the snapshot has {found} values, not {expected}")]
    Length {
        /// Name of the section.
        name: String,
        /// Length asked for.
        expected: usize,
        /// Length found.
        found: usize,
    },
    /// Rank 0, which reads it, has the reason.
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

/// Named arrays in alphabetical order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Snapshot {
    sections: BTreeMap<String, Section>,
}

macro_rules! accessors {
    ($put:ident, $get:ident $(, $get_of:ident)?; $variant:ident, $element:ty) => {
        /// Adds an array, in place of one of the same name.
        pub fn $put(&mut self, name: impl Into<String>, values: Vec<$element>) {
            self.sections.insert(name.into(), Section::$variant(values));
        }

        /// Reads an array.
        ///
        /// # Errors
        /// [`SnapshotError::Missing`] if there is none of this name and type.
        pub fn $get(&self, name: &str) -> Result<&[$element], SnapshotError> {
            match self.sections.get(name) {
                Some(Section::$variant(values)) => Ok(values),
                _ => Err(SnapshotError::Missing { name: name.to_string(), kind: stringify!($element) }),
            }
        }

        $(
            /// Reads an array of known length.
            ///
            /// # Errors
            /// [`SnapshotError`] if there is no such array or its length differs.
            pub fn $get_of(&self, name: &str, expected: usize) -> Result<&[$element], SnapshotError> {
                of_length(name, self.$get(name)?, expected)
            }
        )?
    };
}

impl Snapshot {
    accessors!(put_bytes, bytes; U8, u8);
    accessors!(put_u32, u32, u32_of; U32, u32);
    accessors!(put_u64, u64, u64_of; U64, u64);
    accessors!(put_reals, reals, reals_of; F64, Real);

    /// Adds vectors as an array of three values each.
    pub fn put_vectors(&mut self, name: impl Into<String>, values: &[Vector]) {
        self.put_reals(name, bytemuck::cast_slice(values).to_vec());
    }

    /// Reads vectors.
    ///
    /// # Errors
    /// [`SnapshotError`] if there is no such array or its length is not a multiple of three.
    pub fn vectors(&self, name: &str) -> Result<Vec<Vector>, SnapshotError> {
        let values = self.reals(name)?;
        let values = of_length(name, values, values.len() / 3 * 3)?;
        Ok(values.chunks_exact(3).map(Vector::from_slice).collect())
    }

    /// All arrays in alphabetical order.
    pub fn sections(&self) -> impl Iterator<Item = (&str, &Section)> {
        self.sections.iter().map(|(name, section)| (name.as_str(), section))
    }

    /// Adds an array of any type.
    pub fn put(&mut self, name: impl Into<String>, section: Section) {
        self.sections.insert(name.into(), section);
    }
}

/// The values of array `name` if there are as many as expected.
fn of_length<'a, T>(name: &str, values: &'a [T], expected: usize) -> Result<&'a [T], SnapshotError> {
    if values.len() == expected {
        Ok(values)
    } else {
        Err(SnapshotError::Length { name: name.to_string(), expected, found: values.len() })
    }
}
