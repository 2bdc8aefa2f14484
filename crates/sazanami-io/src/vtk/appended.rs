//! A VTK XML file while it is put together: text with offsets, and the data they point to.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use super::{DataArray, VtkError};
use crate::blocks::{BLOCK, Incompressible, compress};
use crate::replace_file;

/// Text and compressed data of a file.
pub(super) struct Appended {
    kind: &'static str,
    text: String,
    depth: usize,
    data: Vec<Vec<u8>>,
    offset: usize,
}

impl Appended {
    /// A file of VTK's data set `kind`, with further attributes of it.
    pub fn new(kind: &'static str, attributes: &str) -> Self {
        let mut file = Self { kind, text: String::new(), depth: 0, data: Vec::new(), offset: 0 };
        file.text.push_str("<?xml version=\"1.0\"?>\n");
        file.open(&format!(
            "VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
             compressor=\"vtkLZ4DataCompressor\""
        ));
        file.open(&format!("{kind}{attributes}"));
        file
    }

    /// Opens the element that `tag` names, with its attributes.
    pub fn open(&mut self, tag: &str) {
        let _ = writeln!(self.text, "{:1$}<{tag}>", "", 2 * self.depth);
        self.depth += 1;
    }

    /// States the frame of places and velocities in a comment; its name holds no two hyphens in a row.
    pub fn frame(&mut self, frame: Option<&str>) {
        if let Some(frame) = frame {
            let text = format!("positions and velocities in the frame of the {frame}");
            let _ = writeln!(self.text, "{:1$}<!-- {text} -->", "", 2 * self.depth);
        }
    }

    /// Closes the element `name`.
    pub fn close(&mut self, name: &str) {
        self.depth -= 1;
        let _ = writeln!(self.text, "{:1$}</{name}>", "", 2 * self.depth);
    }

    /// States the time \[s] that the file shows, as ParaView reads it.
    pub fn time(&mut self, time: Option<f64>) {
        if let Some(time) = time {
            self.open("FieldData");
            self.array(&DataArray::owned("TimeValue", 1, &[time]), " NumberOfTuples=\"1\"");
            self.close("FieldData");
        }
    }

    /// Adds an array; `more` holds further attributes.
    pub fn array(&mut self, array: &DataArray, more: &str) {
        let Self { depth, offset, .. } = *self;
        let (name, kind, components) = (escaped(&array.name), array.type_name(), array.components);
        let _ = writeln!(
            self.text,
            "{:1$}<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"{more} \
             format=\"appended\" offset=\"{offset}\"/>",
            "",
            2 * depth
        );
        let data = packed(&array.bytes);
        self.offset += data.len();
        self.data.push(data);
    }

    /// Adds arrays as the attributes `section` ("PointData" or "CellData"), with the one to colour by.
    pub fn attributes(&mut self, section: &str, arrays: &[DataArray], scalars: Option<&str>) -> Result<(), VtkError> {
        let mut tag = section.to_owned();
        if let Some(name) = scalars {
            if !arrays.iter().any(|array| array.name == name) {
                return Err(VtkError::NoSuchArray { name: name.to_owned() });
            }
            let _ = write!(tag, " Scalars=\"{}\"", escaped(name));
        }
        if let Some(vectors) = arrays.iter().find(|array| array.components == 3) {
            let _ = write!(tag, " Vectors=\"{}\"", escaped(&vectors.name));
        }
        self.open(&tag);
        arrays.iter().for_each(|array| self.array(array, ""));
        self.close(section);
        Ok(())
    }

    /// Closes the data set and puts the file at `path`.
    pub fn write(mut self, path: &Path) -> Result<(), VtkError> {
        self.close(self.kind);
        replace_file(path, |file| {
            file.write_all(self.text.as_bytes())?;
            file.write_all(b"  <AppendedData encoding=\"raw\">\n_")?;
            self.data.iter().try_for_each(|data| file.write_all(data))?;
            file.write_all(b"\n  </AppendedData>\n</VTKFile>\n")
        })
        .map_err(|source| VtkError::Write { path: path.to_owned(), source })
    }
}

/// Number of blocks, size of a block, size of a shorter last one (or 0), stored sizes, blocks.
fn packed(raw: &[u8]) -> Vec<u8> {
    let blocks = raw.len().div_ceil(BLOCK);
    let mut data = Vec::with_capacity(raw.len() / 2 + 64);
    for word in [blocks, BLOCK, raw.len() % BLOCK] {
        data.extend_from_slice(&(word as u64).to_le_bytes());
    }
    data.resize(8 * (3 + blocks), 0);
    let mut at = 24;
    compress(raw, 1, Incompressible::Compress, |block| {
        data[at..at + 8].copy_from_slice(&(block.len() as u64).to_le_bytes());
        at += 8;
        data.extend_from_slice(block);
        Ok(())
    })
    .expect("memory takes all blocks");
    data
}

/// Text as it may stand in an XML attribute.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Undoes [`escaped`].
pub(super) fn unescaped(text: &str) -> String {
    text.replace("&quot;", "\"").replace("&gt;", ">").replace("&lt;", "<").replace("&amp;", "&")
}
