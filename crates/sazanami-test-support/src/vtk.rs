//! A reader of VTK XML files that follows the format and not the writer: arrays appended raw in LZ4 blocks.

use std::path::Path;

/// A file: the text before the data, and the data.
pub struct VtkFile {
    /// The XML before the data.
    pub text: String,
    /// The data behind it.
    pub data: Vec<u8>,
}

/// Reads the file at `path`.
///
/// # Panics
/// If it is not one.
#[must_use]
pub fn parse(path: &Path) -> VtkFile {
    let bytes = std::fs::read(path).expect("the file is there");
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let at = bytes.windows(marker.len()).position(|window| window == marker).expect("data are appended");
    let end = b"\n  </AppendedData>\n</VTKFile>\n";
    assert!(bytes.ends_with(end));
    VtkFile {
        text: String::from_utf8(bytes[..at].to_vec()).expect("the header is text"),
        data: bytes[at + marker.len()..bytes.len() - end.len()].to_vec(),
    }
}

fn attribute_of<'a>(tag: &'a str, name: &str) -> &'a str {
    let (_, rest) = tag.split_once(&format!(" {name}=\"")).expect("the tag has the attribute");
    rest.split_once('"').expect("the attribute ends").0
}

impl VtkFile {
    fn tag(&self, matches: impl Fn(&str) -> bool) -> &str {
        self.text.split('<').find(|tag| matches(tag)).expect("the tag is there")
    }

    /// Attribute `name` of the first `element`.
    ///
    /// # Panics
    /// If it is not there.
    #[must_use]
    pub fn attribute(&self, element: &str, name: &str) -> &str {
        attribute_of(self.tag(|tag| tag.starts_with(element)), name)
    }

    /// Type, number of components and unpacked bytes of an array, with the place where it ends.
    ///
    /// # Panics
    /// If it is not there or damaged.
    #[must_use]
    pub fn array(&self, name: &str) -> (&str, usize, Vec<u8>, usize) {
        let tag = self.tag(|tag| tag.contains(&format!("Name=\"{name}\"")));
        let number = |name: &str| attribute_of(tag, name).parse::<usize>().expect("a number");
        let offset = number("offset");
        let word = |n: usize| u64::from_le_bytes(std::array::from_fn(|b| self.data[offset + 8 * n + b])) as usize;
        let (blocks, size, last) = (word(0), word(1), word(2));
        let mut at = offset + 8 * (3 + blocks);
        let mut raw = Vec::new();
        for block in 0..blocks {
            let length = if block + 1 == blocks && last > 0 { last } else { size };
            let stored = &self.data[at..at + word(3 + block)];
            raw.extend(lz4_flex::block::decompress(stored, length).expect("an LZ4 block"));
            at += stored.len();
        }
        (attribute_of(tag, "type"), number("NumberOfComponents"), raw, at)
    }
}
