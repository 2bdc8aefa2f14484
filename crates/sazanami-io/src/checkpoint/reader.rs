//! Reading a checkpoint.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use sazanami_numerics::snapshot::{self, Snapshot};
use serde::de::DeserializeOwned;
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use super::header::{Header, Parsed};
use super::{CheckpointError, Codec, Element, ElementType, Section};
use crate::blocks::{BLOCK, decompress};

/// A checkpoint whose every byte has been verified.
#[derive(Debug)]
pub struct CheckpointReader {
    path: PathBuf,
    file: Mutex<File>,
    sections: Vec<Section>,
}

impl CheckpointReader {
    /// Opens `path` and verifies header, length, index and the checksum of every section.
    ///
    /// # Errors
    /// A variant of its own for each way in which the file can be wrong.
    pub fn open(path: &Path) -> Result<Self, CheckpointError> {
        let cannot_read = |source| CheckpointError::Read { path: path.to_owned(), source };
        crate::input::refuse_special(path).map_err(cannot_read)?;
        let mut file = File::open(path).map_err(cannot_read)?;
        let found = file.metadata().map_err(cannot_read)?.len();
        let header = read_header(&mut file, path, found)?;
        if found != header.file_length {
            return Err(CheckpointError::Torn { path: path.to_owned(), expected: header.file_length, found });
        }
        let sections = read_index(&mut file, path, &header)?;
        file.seek(SeekFrom::Start(Header::LENGTH as u64)).map_err(cannot_read)?;
        let mut buffer = vec![0; 1 << 20];
        for section in &sections {
            let checksum = checksum_of_next(&mut file, section.stored, &mut buffer).map_err(cannot_read)?;
            if checksum != section.checksum {
                return Err(CheckpointError::DamagedSection { path: path.to_owned(), name: section.name.clone() });
            }
        }
        Ok(Self { path: path.to_owned(), file: Mutex::new(file), sections })
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names, element types and numbers of elements of the sections, in the order of the file.
    pub fn sections(&self) -> impl Iterator<Item = (&str, ElementType, usize)> {
        self.sections.iter().map(|section| (section.name.as_str(), section.element, section.count as usize))
    }

    /// Whether there is a section `name`.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.sections.iter().any(|section| section.name == name)
    }

    /// The elements of section `name`.
    ///
    /// # Errors
    /// If there is no such section, if it holds other elements, or if the file changed since it was opened.
    pub fn get<T: Element>(&self, name: &str) -> Result<Vec<T>, CheckpointError> {
        let section = self.find::<T>(name)?;
        let mut elements = vec![T::zeroed(); section.count as usize];
        self.unpack(section, bytemuck::cast_slice_mut(&mut elements))?;
        Ok(elements)
    }

    /// The value that section `name` holds as JSON text.
    ///
    /// # Errors
    /// As [`Self::get`], and if the text is not of that form.
    pub fn get_json<T: DeserializeOwned>(&self, name: &str) -> Result<T, CheckpointError> {
        serde_json::from_slice(&self.get::<u8>(name)?).map_err(|reason| CheckpointError::WrongText {
            path: self.path.clone(),
            name: name.to_owned(),
            reason: reason.to_string(),
        })
    }

    /// All sections of element types that a snapshot can hold (the writer of a snapshot uses no others).
    ///
    /// # Errors
    /// As [`Self::get`].
    pub fn snapshot(&self) -> Result<Snapshot, CheckpointError> {
        self.snapshot_of(|_| true)
    }

    /// The same of the sections that are `wanted` by their names.
    ///
    /// # Errors
    /// As [`Self::get`].
    pub fn snapshot_of(&self, wanted: impl Fn(&str) -> bool) -> Result<Snapshot, CheckpointError> {
        let mut snapshot = Snapshot::default();
        for (name, element, _) in self.sections().filter(|(name, ..)| wanted(name)) {
            let values = match element {
                ElementType::U8 => snapshot::Section::U8(self.get(name)?),
                ElementType::U32 => snapshot::Section::U32(self.get(name)?),
                ElementType::U64 => snapshot::Section::U64(self.get(name)?),
                ElementType::F64 => snapshot::Section::F64(self.get(name)?),
                ElementType::I32 | ElementType::I64 | ElementType::F32 => continue,
            };
            snapshot.put(name, values);
        }
        Ok(snapshot)
    }

    fn find<T: Element>(&self, name: &str) -> Result<&Section, CheckpointError> {
        let section = self
            .sections
            .iter()
            .find(|section| section.name == name)
            .ok_or_else(|| CheckpointError::MissingSection { path: self.path.clone(), name: name.to_owned() })?;
        if section.element == T::TYPE {
            Ok(section)
        } else {
            let (expected, found) = (T::TYPE, section.element);
            Err(CheckpointError::WrongElement { path: self.path.clone(), name: name.to_owned(), expected, found })
        }
    }

    fn unpack(&self, section: &Section, raw: &mut [u8]) -> Result<(), CheckpointError> {
        let mut stored = vec![0; section.stored as usize];
        self.read_stored(section, &mut stored)
            .map_err(|source| CheckpointError::Read { path: self.path.clone(), source })?;
        let (blocks, lengths) = stored.split_at(stored.len() - table_length(section) as usize);
        let lengths = lengths.as_chunks::<4>().0.iter().map(|&length| u32::from_le_bytes(length) as usize);
        if xxh3_64(&stored) == section.checksum && decompress(blocks, lengths, section.element.width(), raw) {
            Ok(())
        } else {
            Err(CheckpointError::DamagedSection { path: self.path.clone(), name: section.name.clone() })
        }
    }

    fn read_stored(&self, section: &Section, stored: &mut [u8]) -> io::Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(section.offset))?;
        file.read_exact(stored)
    }
}

fn read_header(file: &mut File, path: &Path, found: u64) -> Result<Header, CheckpointError> {
    let path = path.to_owned();
    let mut bytes = [0; Header::LENGTH];
    if found < Header::LENGTH as u64 {
        return Err(CheckpointError::Torn { path, expected: Header::LENGTH as u64, found });
    }
    match file.read_exact(&mut bytes) {
        Err(source) => Err(CheckpointError::Read { path, source }),
        Ok(()) => match Header::parse(&bytes) {
            Parsed::Good(header) => Ok(header),
            Parsed::Foreign => Err(CheckpointError::NotACheckpoint { path }),
            Parsed::Damaged => Err(CheckpointError::DamagedHeader { path }),
            Parsed::Version(found) => Err(CheckpointError::UnknownVersion { path, found, supported: super::VERSION }),
        },
    }
}

fn read_index(file: &mut File, path: &Path, header: &Header) -> Result<Vec<Section>, CheckpointError> {
    let damaged = |reason: &str| CheckpointError::DamagedIndex { path: path.to_owned(), reason: reason.to_owned() };
    if header.index_offset.checked_add(header.index_length) != Some(header.file_length) {
        return Err(damaged("it does not end with the file"));
    }
    let mut text = vec![0; header.index_length as usize];
    file.seek(SeekFrom::Start(header.index_offset))
        .and_then(|_| file.read_exact(&mut text))
        .map_err(|source| CheckpointError::Read { path: path.to_owned(), source })?;
    if xxh3_64(&text) != header.index_checksum {
        return Err(damaged("its checksum does not match"));
    }
    let sections: Vec<Section> = serde_json::from_slice(&text).map_err(|error| damaged(&error.to_string()))?;
    let mut end = Header::LENGTH as u64;
    for section in &sections {
        let Codec::ShuffleLz4 = section.codec;
        if section.offset != end || section.stored < table_length(section) {
            return Err(damaged(&format!("section `{}` is out of place", section.name)));
        }
        end += section.stored;
    }
    if end == header.index_offset { Ok(sections) } else { Err(damaged("it does not follow the sections")) }
}

/// Bytes of the table of block lengths of a section.
fn table_length(section: &Section) -> u64 {
    4 * (section.count * section.element.width() as u64).div_ceil(BLOCK as u64)
}

fn checksum_of_next(file: &mut File, length: u64, buffer: &mut [u8]) -> io::Result<u64> {
    let mut checksum = Xxh3::new();
    let mut left = length;
    while left > 0 {
        let part = left.min(buffer.len() as u64) as usize;
        file.read_exact(&mut buffer[..part])?;
        checksum.update(&buffer[..part]);
        left -= part as u64;
    }
    Ok(checksum.digest())
}
