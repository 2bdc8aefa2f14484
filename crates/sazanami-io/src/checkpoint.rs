//! Checkpoints: named arrays in one compressed file that tells a good copy from a torn or damaged one.
//!
//! ```text
//! header    64 bytes: magic, version, places and checksums (see `Header`)
//! sections  blocks of 256 KiB, each byte-shuffled and LZ4-compressed (or kept if that does not help),
//!           then their stored lengths as u32
//! index     JSON: name, element type, count, offset, stored length, codec, XXH3-64 of the stored bytes
//! ```
//! Numbers are little-endian. Sections are found by name, so that a reader may know more or fewer of them.

mod error;
mod folder;
mod header;
mod reader;
mod writer;

pub use error::CheckpointError;
pub use folder::{CheckpointFolder, NewestCheckpoint};
pub use reader::CheckpointReader;
pub use writer::CheckpointWriter;

use serde::{Deserialize, Serialize};

/// Type of the elements of a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ElementType {
    /// Bytes, and text as UTF-8.
    U8,
    /// 32-bit unsigned integers.
    U32,
    /// 64-bit unsigned integers.
    U64,
    /// 64-bit signed integers.
    I64,
    /// Single-precision numbers.
    F32,
    /// Double-precision numbers.
    F64,
}

impl ElementType {
    /// Bytes of an element.
    #[must_use]
    pub const fn width(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }
}

/// What a section can be made of.
pub trait Element: bytemuck::Pod {
    /// Name of the type in the file.
    const TYPE: ElementType;
}

macro_rules! element {
    ($($rust:ty => $name:ident),+ $(,)?) => {
        $(impl Element for $rust {
            const TYPE: ElementType = ElementType::$name;
        })+
    };
}
element!(u8 => U8, u32 => U32, u64 => U64, i64 => I64, f32 => F32, f64 => F64);

const MAGIC: [u8; 8] = *b"sazanami";
const VERSION: u32 = 1;

/// Line of the index that describes a section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Section {
    name: String,
    element: ElementType,
    count: u64,
    offset: u64,
    stored: u64,
    codec: Codec,
    checksum: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Codec {
    ShuffleLz4,
}
