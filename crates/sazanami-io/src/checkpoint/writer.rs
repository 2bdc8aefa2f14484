//! Writing a checkpoint.

use std::borrow::Cow;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

use sazanami_numerics::snapshot::{self, Snapshot};
use serde::Serialize;
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use super::header::Header;
use super::{CheckpointError, Codec, Element, ElementType, Section};
use crate::blocks::{Incompressible, compress};
use crate::replace_file;

/// Collects named arrays, which may be borrowed, and writes them at once.
#[derive(Default)]
pub struct CheckpointWriter<'a> {
    sections: Vec<(String, ElementType, Cow<'a, [u8]>)>,
}

impl<'a> CheckpointWriter<'a> {
    /// A checkpoint without sections.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an array.
    ///
    /// # Errors
    /// If the name is taken.
    pub fn add<T: Element>(&mut self, name: &str, elements: &'a [T]) -> Result<(), CheckpointError> {
        self.push(name, T::TYPE, Cow::Borrowed(bytemuck::cast_slice(elements)))
    }

    /// Adds a small value as JSON text.
    ///
    /// # Errors
    /// If the name is taken.
    ///
    /// # Panics
    /// If the value has no JSON form, as a map with structs for keys has none.
    pub fn add_json(&mut self, name: &str, value: &impl Serialize) -> Result<(), CheckpointError> {
        let text = serde_json::to_vec(value).expect("checkpointed values have a JSON form");
        self.push(name, ElementType::U8, Cow::Owned(text))
    }

    /// Adds all arrays of a snapshot.
    ///
    /// # Errors
    /// If a name is taken.
    pub fn add_snapshot(&mut self, snapshot: &'a Snapshot) -> Result<(), CheckpointError> {
        snapshot.sections().try_for_each(|(name, values)| match values {
            snapshot::Section::U8(values) => self.add(name, values),
            snapshot::Section::U32(values) => self.add(name, values),
            snapshot::Section::U64(values) => self.add(name, values),
            snapshot::Section::F64(values) => self.add(name, values),
        })
    }

    fn push(&mut self, name: &str, element: ElementType, bytes: Cow<'a, [u8]>) -> Result<(), CheckpointError> {
        if self.sections.iter().any(|(taken, ..)| taken == name) {
            return Err(CheckpointError::DuplicateSection { name: name.to_owned() });
        }
        self.sections.push((name.to_owned(), element, bytes));
        Ok(())
    }

    /// XXH3-64 of the names, types and contents of the sections that `counts` lets through, in the order of their
    /// names: it depends neither on compression nor on the order in which they were added.
    #[must_use]
    pub fn content_hash(&self, counts: impl Fn(&str) -> bool) -> u64 {
        let mut sections: Vec<_> = self.sections.iter().filter(|(name, ..)| counts(name)).collect();
        sections.sort_by(|a, b| a.0.cmp(&b.0));
        let mut hash = Xxh3::new();
        for (name, element, bytes) in sections {
            hash.update(&(name.len() as u64).to_le_bytes());
            hash.update(name.as_bytes());
            hash.update(&[*element as u8]);
            hash.update(&(bytes.len() as u64).to_le_bytes());
            hash.update(bytes);
        }
        hash.digest()
    }

    /// Writes the checkpoint aside, syncs it, and renames it to `path`. Returns its length \[bytes].
    ///
    /// # Errors
    /// If the file system refuses; `path` and all other files are then as before.
    pub fn write_atomic(&self, path: &Path) -> Result<u64, CheckpointError> {
        replace_file(path, |file| self.write_to(file))
            .map_err(|source| CheckpointError::Write { path: path.to_owned(), source })
    }

    /// The checkpoint as the bytes of its file.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut file = io::Cursor::new(Vec::new());
        self.write_to(&mut file).expect("memory takes what is written to it");
        file.into_inner()
    }

    /// Writes the checkpoint from the present position 0 on and returns its length \[bytes].
    pub(super) fn write_to(&self, file: &mut (impl Write + Seek)) -> io::Result<u64> {
        file.write_all(&[0; Header::LENGTH])?;
        let mut offset = Header::LENGTH as u64;
        let mut index = Vec::with_capacity(self.sections.len());
        for (name, element, raw) in &self.sections {
            let section = write_section(file, name, *element, raw, offset)?;
            offset += section.stored;
            index.push(section);
        }
        let index = serde_json::to_vec(&index)?;
        file.write_all(&index)?;
        let length = offset + index.len() as u64;
        file.seek(SeekFrom::Start(0))?;
        file.write_all(&Header::new(offset, index.len() as u64, xxh3_64(&index), length).to_bytes())?;
        Ok(length)
    }
}

fn write_section(
    file: &mut impl Write,
    name: &str,
    element: ElementType,
    raw: &[u8],
    offset: u64,
) -> io::Result<Section> {
    let mut checksum = Xxh3::new();
    let mut stored = 0;
    let mut lengths: Vec<u8> = Vec::new();
    compress(raw, element.width(), Incompressible::Keep, |block| {
        lengths.extend_from_slice(&(block.len() as u32).to_le_bytes());
        checksum.update(block);
        stored += block.len() as u64;
        file.write_all(block)
    })?;
    checksum.update(&lengths);
    file.write_all(&lengths)?;
    Ok(Section {
        name: name.to_owned(),
        element,
        count: (raw.len() / element.width()) as u64,
        offset,
        stored: stored + lengths.len() as u64,
        codec: Codec::ShuffleLz4,
        checksum: checksum.digest(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    /// A disk with room for `left` more bytes.
    struct Disk {
        written: Cursor<Vec<u8>>,
        left: usize,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.left = self.left.checked_sub(bytes.len()).ok_or(io::ErrorKind::StorageFull)?;
            self.written.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Disk {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.written.seek(to)
        }
    }

    #[test]
    fn a_full_disk_is_reported_wherever_it_fills_up() {
        let values: Vec<f64> = (0..50_000).map(f64::from).collect();
        let mut writer = CheckpointWriter::new();
        writer.add("values", &values).unwrap();
        let on = |left| {
            let mut disk = Disk { written: Cursor::default(), left };
            writer.write_to(&mut disk).map_err(|error| error.kind())
        };
        let length = on(usize::MAX).unwrap() as usize;
        assert_eq!(on(length + Header::LENGTH), Ok(length as u64));
        for left in [0, 63, 64, 1000, length / 2, length - 1, length + Header::LENGTH - 1] {
            assert_eq!(on(left), Err(io::ErrorKind::StorageFull), "{left}");
        }
    }
}
