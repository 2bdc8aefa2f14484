//! Errors of a checkpoint.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use super::ElementType;

/// Why a checkpoint, or another file of its format, could not be written or read.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The file system refused.
    #[error("cannot write {path}: {source} (what was there before is untouched)", path = path.display())]
    Write {
        /// File to be written.
        path: PathBuf,
        /// Refusal of the file system, for example a full disk.
        source: io::Error,
    },
    /// The file system refused.
    #[error("cannot read {path}: {source}", path = path.display())]
    Read {
        /// File to be read.
        path: PathBuf,
        /// Refusal of the file system.
        source: io::Error,
    },
    /// An older checkpoint could not be removed.
    #[error("cannot remove the old checkpoint {path}: {source}", path = path.display())]
    Prune {
        /// File to be removed.
        path: PathBuf,
        /// Refusal of the file system.
        source: io::Error,
    },
    /// Two sections of one checkpoint cannot share a name.
    #[error("section `{name}` was added to the checkpoint twice")]
    DuplicateSection {
        /// Name of the section.
        name: String,
    },
    /// The file begins with something else.
    #[error("{path} is not a checkpoint", path = path.display())]
    NotACheckpoint {
        /// File read.
        path: PathBuf,
    },
    /// The file was written by a later program.
    #[error("checkpoint {path} has format version {found}, this program reads {supported}", path = path.display())]
    UnknownVersion {
        /// File read.
        path: PathBuf,
        /// Version of the file.
        found: u32,
        /// Version of this program.
        supported: u32,
    },
    /// The header does not match its checksum.
    #[error("checkpoint {path} has a damaged header", path = path.display())]
    DamagedHeader {
        /// File read.
        path: PathBuf,
    },
    /// The file was cut or something was appended.
    #[error("checkpoint {path} is torn: it should have {expected} bytes and has {found}", path = path.display())]
    Torn {
        /// File read.
        path: PathBuf,
        /// Length according to the header \[bytes].
        expected: u64,
        /// Length of the file \[bytes].
        found: u64,
    },
    /// The index does not match its checksum or makes no sense.
    #[error("checkpoint {path} has a damaged index: {reason}", path = path.display())]
    DamagedIndex {
        /// File read.
        path: PathBuf,
        /// Failed check of the index.
        reason: String,
    },
    /// A section does not match its checksum or cannot be unpacked.
    #[error("checkpoint {path} has a damaged section `{name}`", path = path.display())]
    DamagedSection {
        /// File read.
        path: PathBuf,
        /// Name of the section.
        name: String,
    },
    /// The checkpoint has no section of that name.
    #[error("checkpoint {path} has no section `{name}`", path = path.display())]
    MissingSection {
        /// File read.
        path: PathBuf,
        /// Name of the section.
        name: String,
    },
    /// The section holds other elements than asked for.
    #[error("section `{name}` of checkpoint {path} holds {found:?}, not {expected:?}", path = path.display())]
    WrongElement {
        /// File read.
        path: PathBuf,
        /// Name of the section.
        name: String,
        /// Elements asked for.
        expected: ElementType,
        /// Elements in the file.
        found: ElementType,
    },
    /// The JSON text of a section does not describe the value asked for.
    #[error("section `{name}` of checkpoint {path} cannot be understood: {reason}", path = path.display())]
    WrongText {
        /// File read.
        path: PathBuf,
        /// Name of the section.
        name: String,
        /// Message of the JSON reader.
        reason: String,
    },
}
