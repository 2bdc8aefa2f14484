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

pub use crate::element::{Element, ElementType};

use serde::{Deserialize, Serialize};

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
