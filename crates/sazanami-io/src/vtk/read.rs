//! Reads the VTK XML files that this crate writes: arrays appended raw in LZ4 blocks.

use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::blocks::BLOCK;
use crate::input::refuse_special;

/// Names of arrays with the liquid of the cells: of files with grains the first, that outside them, is the liquid itself.
pub const LIQUID: [&str; 2] = ["liquid_outside_grains", "liquid_fraction"];

/// Why a VTK file could not be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The file system refused.
    #[error("cannot read {path}: {source}", path = path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Refusal of the file system.
        source: io::Error,
    },
    /// The file is cut, changed, or of another kind.
    #[error("{path} is damaged, or not a file of this program: {what}", path = path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Missing or wrong part.
        what: String,
    },
}

/// Values of an array by their type.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Real numbers in eight bytes.
    F64(Vec<f64>),
    /// Real numbers in four bytes.
    F32(Vec<f32>),
    /// Whole numbers from 0 on in eight bytes.
    U64(Vec<u64>),
    /// Whole numbers from 0 on in four bytes.
    U32(Vec<u32>),
    /// Whole numbers in four bytes.
    I32(Vec<i32>),
}

impl Values {
    /// Number of values.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::F64(values) => values.len(),
            Self::F32(values) => values.len(),
            Self::U64(values) => values.len(),
            Self::U32(values) => values.len(),
            Self::I32(values) => values.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A file in memory; arrays are unpacked when they are asked for.
#[derive(Debug)]
pub struct VtkFile {
    path: PathBuf,
    text: String,
    data: Vec<u8>,
}

const BEGIN: &[u8] = b"<AppendedData encoding=\"raw\">\n_";
const END: &[u8] = b"\n  </AppendedData>\n</VTKFile>\n";
/// Most bytes of an array: what a wrong header asks for beyond is refused.
const MOST: u64 = 1 << 36;
/// Bytes of a beginning: the header takes a few thousand, and the time stands behind it.
const BEGINNING: u64 = 1 << 16;

impl VtkFile {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// If it cannot be read or is none.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let bytes = refuse_special(path).and_then(|()| std::fs::read(path));
        let bytes = bytes.map_err(|source| ReadError::File { path: path.to_owned(), source })?;
        let end = bytes[bytes.len().saturating_sub(END.len())..].to_vec();
        Self::of(path, bytes, &end)
    }

    /// The header of the file at `path`, and of its arrays what stands in its first kilobytes.
    ///
    /// # Errors
    /// If it cannot be read or is none.
    pub fn beginning(path: &Path) -> Result<Self, ReadError> {
        let parts = || -> io::Result<(Vec<u8>, Vec<u8>)> {
            refuse_special(path)?;
            let mut file = File::open(path)?;
            let (mut beginning, mut end) = (Vec::new(), Vec::new());
            file.by_ref().take(BEGINNING).read_to_end(&mut beginning)?;
            let length = file.metadata()?.len();
            file.seek(SeekFrom::Start(length.saturating_sub(END.len() as u64)))?;
            file.read_to_end(&mut end)?;
            Ok((beginning, end))
        };
        let (beginning, end) = parts().map_err(|source| ReadError::File { path: path.to_owned(), source })?;
        Self::of(path, beginning, &end)
    }

    /// The time \[s] in the file at `path`, from its beginning and its end alone; `None` if it states none.
    ///
    /// # Errors
    /// If it cannot be read or is none.
    pub fn time_in(path: &Path) -> Result<Option<f64>, ReadError> {
        let file = Self::beginning(path)?;
        if !file.has("TimeValue") {
            return Ok(None);
        }
        match file.values("TimeValue")?.1 {
            Values::F64(times) => Ok(times.first().copied()),
            _ => Ok(None),
        }
    }

    /// A file of its `bytes`, or of the first ones, and its last ones.
    fn of(path: &Path, mut bytes: Vec<u8>, end: &[u8]) -> Result<Self, ReadError> {
        let damaged = |what: &str| ReadError::Damaged { path: path.to_owned(), what: what.to_owned() };
        let at = bytes.windows(BEGIN.len()).position(|window| window == BEGIN).ok_or_else(|| damaged("no data"))?;
        if end != END {
            return Err(damaged("its end is missing"));
        }
        if bytes.ends_with(END) {
            bytes.truncate(bytes.len() - END.len());
        }
        let data = bytes.get(at + BEGIN.len()..).ok_or_else(|| damaged("no data"))?.to_vec();
        bytes.truncate(at);
        let text = String::from_utf8(bytes).map_err(|_| damaged("its header is not a text"))?;
        Ok(Self { path: path.to_owned(), text, data })
    }

    fn damaged(&self, what: impl Into<String>) -> ReadError {
        ReadError::Damaged { path: self.path.clone(), what: what.into() }
    }

    fn tag(&self, matches: impl Fn(&str) -> bool) -> Option<&str> {
        self.text.split('<').find(|tag| matches(tag))
    }

    /// Numbers in attribute `name` of the first `element`.
    ///
    /// # Errors
    /// If it is not there or holds something else.
    pub fn numbers<const N: usize>(&self, element: &str, name: &str) -> Result<[f64; N], ReadError> {
        let text = self.tag(|tag| tag.starts_with(element)).and_then(|tag| attribute(tag, name)).unwrap_or_default();
        let values: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        let array = values.ok().and_then(|values| <[f64; N]>::try_from(values).ok());
        array.ok_or_else(|| self.damaged(format!("{name} of {element}")))
    }

    /// Whether there is an array `name`.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.array_tag(name).is_some()
    }

    /// Name of the array with the liquid of the cells, where there is one: that outside grains rather than its share of the open part.
    #[must_use]
    pub fn liquid(&self) -> Option<&'static str> {
        LIQUID.into_iter().find(|name| self.has(name))
    }

    fn array_tag(&self, name: &str) -> Option<&str> {
        self.tag(|tag| tag.starts_with("DataArray ") && attribute(tag, "Name") == Some(name))
    }

    /// Names of the arrays of points, cells or bodies, without those that make up their places.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let arrays = self.text.split('<').filter(|tag| tag.starts_with("DataArray "));
        let of_places = ["Points", "connectivity", "offsets", "types", "TimeValue"];
        arrays.filter_map(|tag| attribute(tag, "Name")).filter(move |name| !of_places.contains(name))
    }

    /// Number of components and values of the array `name`, those of a vector together, as they are in the file.
    ///
    /// # Errors
    /// If it is not there or damaged.
    pub fn values(&self, name: &str) -> Result<(usize, Values), ReadError> {
        let missing = || self.damaged(format!("array `{name}`"));
        let tag = self.array_tag(name).ok_or_else(missing)?;
        let offset = attribute(tag, "offset").and_then(|text| text.parse().ok()).ok_or_else(missing)?;
        let components = attribute(tag, "NumberOfComponents").map_or(Ok(1), str::parse).map_err(|_| missing())?;
        let raw = self.unpacked(offset).ok_or_else(missing)?;
        fn values<const N: usize, T>(raw: &[u8], of: impl Fn([u8; N]) -> T) -> Vec<T> {
            raw.as_chunks().0.iter().map(|&bytes| of(bytes)).collect()
        }
        let values = match attribute(tag, "type") {
            Some("Float32") => Values::F32(values(&raw, f32::from_le_bytes)),
            Some("Float64") => Values::F64(values(&raw, f64::from_le_bytes)),
            Some("UInt32") => Values::U32(values(&raw, u32::from_le_bytes)),
            Some("Int32") => Values::I32(values(&raw, i32::from_le_bytes)),
            Some("UInt64") => Values::U64(values(&raw, u64::from_le_bytes)),
            _ => return Err(missing()),
        };
        if components == 0 || values.len() % components != 0 { Err(missing()) } else { Ok((components, values)) }
    }

    /// Values of the array `name`, vectors by component, in single precision.
    ///
    /// # Errors
    /// If it is not there or damaged.
    pub fn array(&self, name: &str) -> Result<Vec<f32>, ReadError> {
        Ok(match self.values(name)?.1 {
            Values::F32(values) => values,
            Values::F64(values) => values.into_iter().map(|value| value as f32).collect(),
            Values::U32(values) => values.into_iter().map(|value| value as f32).collect(),
            Values::I32(values) => values.into_iter().map(|value| value as f32).collect(),
            Values::U64(values) => values.into_iter().map(|value| value as f32).collect(),
        })
    }

    /// Values of the array `name`, vectors by component.
    ///
    /// # Errors
    /// If it is not there or damaged.
    pub fn doubles(&self, name: &str) -> Result<Vec<f64>, ReadError> {
        match self.values(name)?.1 {
            Values::F64(values) => Ok(values),
            _ => Ok(self.array(name)?.into_iter().map(f64::from).collect()),
        }
    }

    /// The unpacked bytes of the array at `offset`.
    fn unpacked(&self, offset: usize) -> Option<Vec<u8>> {
        let word = |n: usize| {
            let at = offset.checked_add(n.checked_mul(8)?)?;
            self.data.get(at..at.checked_add(8)?)?.try_into().ok().map(u64::from_le_bytes)
        };
        let (blocks, size, last) = (word(0)?, word(1)?, word(2)?);
        if size != BLOCK as u64 || last >= size || blocks.checked_mul(size)? > MOST {
            return None;
        }
        let blocks = blocks as usize;
        let mut at = offset + 8 * (3 + blocks);
        let mut raw = Vec::new();
        for block in 0..blocks {
            let length = if block + 1 == blocks && last > 0 { last } else { size } as usize;
            let end = at.checked_add(usize::try_from(word(3 + block)?).ok()?)?;
            raw.extend(lz4_flex::block::decompress(self.data.get(at..end)?, length).ok()?);
            at = end;
        }
        Some(raw)
    }
}

/// Attribute `name` of a tag.
fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = tag.split_once(&format!(" {name}=\""))?;
    Some(rest.split_once('"')?.0)
}

#[cfg(test)]
mod tests {
    use sazanami_numerics::Vector;

    use super::*;
    use crate::vtk::{DataArray, PointFile, write_points};

    #[test]
    fn points_are_read_as_written_and_damage_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtp");
        // More than one block of the largest array.
        let count = BLOCK / 4;
        let speeds: Vec<f32> = (0..count).map(|n| (n as f32).sin()).collect();
        let places: Vec<Vector> = (0..count).map(|n| Vector::new(n as f64, 0.5, -1.0)).collect();
        let arrays =
            [DataArray::owned("speed", 1, &speeds), DataArray::whole("population", (0..count).map(|n| n as u32))];
        let file =
            PointFile { places: &places, double: false, time: Some(0.25), arrays: &arrays, scalars: None, frame: None };
        write_points(&path, &file).unwrap();
        let read = VtkFile::read(&path).unwrap();
        assert_eq!(read.numbers::<1>("Piece", "NumberOfPoints").unwrap(), [count as f64]);
        assert_eq!(read.array("speed").unwrap(), speeds);
        assert_eq!(read.array("population").unwrap()[7], 7.0);
        assert_eq!(read.array("Points").unwrap()[3..6], [1.0, 0.5, -1.0]);
        assert_eq!(read.names().collect::<Vec<_>>(), ["speed", "population"]);
        assert_eq!(read.values("population").unwrap(), (1, Values::U32((0..count).map(|n| n as u32).collect())));
        assert_eq!(read.values("Points").unwrap().0, 3);
        assert!(read.has("speed") && !read.has("spee"));
        assert!(read.array("spin").unwrap_err().to_string().contains("array `spin`"));
        let whole = std::fs::read(&path).unwrap();
        assert!(whole.len() as u64 > BEGINNING && VtkFile::time_in(&path).unwrap() == Some(0.25));
        // What lies between beginning and end is not looked at.
        let mut torn = whole.clone();
        torn[BEGINNING as usize..whole.len() - END.len()].fill(0);
        std::fs::write(&path, &torn).unwrap();
        assert_eq!(VtkFile::time_in(&path).unwrap(), Some(0.25));
        std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        assert!(VtkFile::time_in(&path).unwrap_err().to_string().contains("end is missing"));
        assert!(VtkFile::read(&path).unwrap_err().to_string().contains("end is missing"));
        let mut torn = whole.clone();
        let middle = torn.len() / 2;
        torn.drain(middle - 5000..middle);
        std::fs::write(&path, &torn).unwrap();
        let torn = VtkFile::read(&path).unwrap();
        assert!(["speed", "Points"].iter().any(|name| torn.array(name).is_err()));
        assert!(VtkFile::time_in(&folder.path().join("absent")).unwrap_err().to_string().contains("cannot read"));
        assert!(VtkFile::read(&folder.path().join("absent")).unwrap_err().to_string().contains("cannot read"));
    }
}
