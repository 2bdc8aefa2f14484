//! Records of an MSH file, text or binary.

use sazanami_numerics::{Real, Vector};

use super::{MeshFileError, Place, Version};

/// Reads on from a position in the file.
pub(super) struct Source<'a> {
    bytes: &'a [u8],
    position: usize,
    /// Lines before the position (meaningful in text files).
    lines: usize,
    binary: bool,
    swapped: bool,
}

impl<'a> Source<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, position: 0, lines: 0, binary: false, swapped: false }
    }

    /// Place of the next record.
    pub fn place(&self) -> Place {
        if self.binary { Place::Byte(self.position) } else { Place::Line(self.lines + 1) }
    }

    fn malformed(&self, problem: impl Into<String>) -> MeshFileError {
        MeshFileError::Malformed { at: self.place(), problem: problem.into() }
    }

    /// Error about the line just read.
    fn in_line(&self, problem: impl Into<String>) -> MeshFileError {
        let at = if self.binary { Place::Byte(self.position) } else { Place::Line(self.lines) };
        MeshFileError::Malformed { at, problem: problem.into() }
    }

    /// Next line without its end, if there is one.
    fn line(&mut self) -> Option<&'a [u8]> {
        let rest = self.bytes.get(self.position..).filter(|r| !r.is_empty())?;
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.position += (length + 1).min(rest.len());
        self.lines += 1;
        Some(rest[..length].strip_suffix(b"\r").unwrap_or(&rest[..length]))
    }

    fn text_line(&mut self) -> Result<&'a str, MeshFileError> {
        match self.line() {
            Some(line) => std::str::from_utf8(line).map_err(|_| self.in_line("this line is not text")),
            None => Err(self.malformed("the file ends here, in the middle of a section")),
        }
    }

    /// Next line that is not blank, trimmed.
    fn filled_line(&mut self) -> Option<String> {
        loop {
            let text = String::from_utf8_lossy(self.line()?).trim().to_owned();
            if !text.is_empty() {
                return Some(text);
            }
        }
    }

    /// The head of the file.
    pub fn format(&mut self) -> Result<Version, MeshFileError> {
        let first = self.filled_line().unwrap_or_default();
        if first != "$MeshFormat" {
            return Err(MeshFileError::NotMesh { found: what_it_is(&first) });
        }
        let line = self.text_line()?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let [version, kind, size] = words[..] else {
            return Err(self.in_line(format!("'{line}' should be the version, 0 or 1 for text or binary, and 8")));
        };
        let at = Place::Line(self.lines);
        let version = match version {
            "2" | "2.0" | "2.1" | "2.2" => Version::Two,
            "4.1" => Version::Four,
            other => return Err(MeshFileError::Version { at, version: other.to_owned() }),
        };
        if size != "8" {
            return Err(self.in_line(format!("numbers of {size} bytes are not understood, only of 8")));
        }
        match kind {
            "0" => {}
            "1" => {
                self.binary = true;
                let one: [u8; 4] = self.take()?;
                self.swapped = match (i32::from_le_bytes(one), i32::from_be_bytes(one)) {
                    (1, _) => false,
                    (_, 1) => true,
                    _ => return Err(self.malformed("the mark of the byte order is missing")),
                };
            }
            other => return Err(self.in_line(format!("'{other}' should be 0 (text) or 1 (binary)"))),
        }
        self.end_section("MeshFormat")?;
        Ok(version)
    }

    /// Name of the next section, if any follows.
    pub fn next_section(&mut self) -> Result<Option<String>, MeshFileError> {
        match self.filled_line() {
            None => Ok(None),
            Some(line) => match line.strip_prefix('$') {
                Some(name) if !name.starts_with("End") => Ok(Some(name.to_owned())),
                _ => Err(self.in_line(format!("a section should start here, like $Nodes, not '{}'", excerpt(&line)))),
            },
        }
    }

    pub fn end_section(&mut self, name: &str) -> Result<(), MeshFileError> {
        match self.filled_line() {
            Some(line) if line.strip_prefix("$End") == Some(name) => Ok(()),
            Some(line) => Err(self.in_line(format!("$End{name} should stand here, not '{}'", excerpt(&line)))),
            None => Err(self.malformed(format!("the file ends before $End{name}"))),
        }
    }

    pub fn skip_section(&mut self, name: &str) -> Result<(), MeshFileError> {
        let end = format!("$End{name}");
        while let Some(line) = self.line() {
            if line.trim_ascii().ends_with(end.as_bytes()) {
                return Ok(());
            }
        }
        Err(self.malformed(format!("the file ends before {end}")))
    }

    /// A number alone on a line, written as text in binary files too.
    pub fn text_count(&mut self) -> Result<usize, MeshFileError> {
        let line = self.text_line()?.trim();
        line.parse().map_err(|_| self.in_line(format!("'{}' should be the number of entries", excerpt(line))))
    }

    /// `tag x y z` of version 2.
    pub fn node(&mut self) -> Result<(u64, Vector), MeshFileError> {
        if self.binary {
            let tag = self.int()?;
            return Ok((self.positive(tag)?, Vector::new(self.real()?, self.real()?, self.real()?)));
        }
        let line = self.text_line()?;
        let mut words = line.split_whitespace();
        let tag = words.next().map(|w| self.number(w)).transpose()?;
        let position = self.vector(&mut words, line)?;
        match (tag, words.next()) {
            (Some(tag), None) => Ok((tag, position)),
            _ => Err(self.in_line(format!("'{}' should be a node: number x y z", excerpt(line)))),
        }
    }

    /// Position of a node of version 4 with `parameters` more numbers behind it.
    pub fn position(&mut self, parameters: usize) -> Result<Vector, MeshFileError> {
        if self.binary {
            let position = Vector::new(self.real()?, self.real()?, self.real()?);
            for _ in 0..parameters {
                self.real()?;
            }
            return Ok(position);
        }
        let line = self.text_line()?;
        self.vector(&mut line.split_whitespace(), line)
    }

    fn vector<'w>(&self, words: &mut impl Iterator<Item = &'w str>, line: &str) -> Result<Vector, MeshFileError> {
        let mut position = [0.0; 3];
        for component in &mut position {
            let word = words.next().unwrap_or_default();
            *component = word
                .parse::<Real>()
                .ok()
                .filter(|v| v.is_finite())
                .ok_or_else(|| self.in_line(format!("'{}' should hold three finite coordinates", excerpt(line))))?;
        }
        Ok(Vector::from_array(position))
    }

    /// `N` unsigned numbers on a line.
    pub fn sizes<const N: usize>(&mut self) -> Result<[u64; N], MeshFileError> {
        let mut values = [0; N];
        values.copy_from_slice(&self.size_list(N)?);
        Ok(values)
    }

    /// `count` unsigned numbers on a line.
    pub fn size_list(&mut self, count: usize) -> Result<Vec<u64>, MeshFileError> {
        if self.binary {
            return (0..count).map(|_| self.size()).collect();
        }
        let line = self.text_line()?;
        let values = line.split_whitespace().map(|w| self.number(w)).collect::<Result<Vec<u64>, _>>()?;
        if values.len() == count {
            Ok(values)
        } else {
            Err(self.in_line(format!("'{}' should hold {count} numbers, not {}", excerpt(line), values.len())))
        }
    }

    /// Head of a block of version 4: three signed numbers and how many entries follow.
    pub fn block(&mut self) -> Result<([i64; 3], u64), MeshFileError> {
        if self.binary {
            let head = [self.int()?, self.int()?, self.int()?].map(i64::from);
            return Ok((head, self.size()?));
        }
        let line = self.text_line()?;
        let values: Vec<i64> = line.split_whitespace().map_while(|w| w.parse().ok()).collect();
        match values[..] {
            [a, b, c, count] if count >= 0 => Ok(([a, b, c], count.unsigned_abs())),
            _ => Err(self.in_line(format!("'{}' should head a block with four whole numbers", excerpt(line)))),
        }
    }

    /// Type, number and tags of the elements of version 2 that follow under one head; in text each is on its own.
    pub fn element_head(&mut self) -> Result<(u64, usize, usize), MeshFileError> {
        if self.binary {
            let head = [self.int()?, self.int()?, self.int()?];
            let [kind, elements, tags] = head.map(|v| u64::try_from(v).unwrap_or(0));
            if elements == 0 {
                return Err(self.malformed("a block of no elements"));
            }
            return Ok((kind, elements as usize, tags as usize));
        }
        let (position, lines) = (self.position, self.lines);
        let line = self.text_line()?;
        let values = line.split_whitespace().take(3).map(|w| self.number(w)).collect::<Result<Vec<u64>, _>>()?;
        let [_, kind, tags] = values[..] else {
            return Err(self.in_line(format!("'{}' should be an element: number type tags... nodes...", excerpt(line))));
        };
        (self.position, self.lines) = (position, lines);
        Ok((kind, 1, usize::try_from(tags).unwrap_or(usize::MAX).min(line.len())))
    }

    /// Number, tags and nodes of one element of version 2.
    pub fn element(&mut self, tags: usize, nodes: usize) -> Result<Vec<u64>, MeshFileError> {
        if self.binary {
            let mut values = Vec::with_capacity(1 + nodes);
            for _ in 0..1 + tags + nodes {
                let value = self.int()?;
                // Tags may be negative; only numbers of elements and nodes matter.
                values.push(u64::try_from(value).unwrap_or(0));
            }
            return Ok(values);
        }
        let line = self.text_line()?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let expected = 3 + tags + nodes;
        if words.len() != expected {
            let problem = format!("'{}' should hold {expected} numbers, not {}", excerpt(line), words.len());
            return Err(self.in_line(problem));
        }
        let mut values = vec![self.number(words[0])?];
        values.resize(1 + tags, 0);
        for word in &words[3 + tags..] {
            values.push(self.number(word)?);
        }
        Ok(values)
    }

    fn number(&self, word: &str) -> Result<u64, MeshFileError> {
        word.parse().map_err(|_| self.in_line(format!("'{}' should be a whole number", excerpt(word))))
    }

    fn positive(&self, value: i32) -> Result<u64, MeshFileError> {
        u64::try_from(value).map_err(|_| self.malformed(format!("the node number {value} is negative")))
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], MeshFileError> {
        let found = self.bytes.get(self.position..).and_then(|rest| rest.first_chunk::<N>());
        match found {
            Some(bytes) => {
                self.position += N;
                Ok(*bytes)
            }
            None => Err(self.malformed("the file ends here, in the middle of a section")),
        }
    }

    fn int(&mut self) -> Result<i32, MeshFileError> {
        let bytes = self.take()?;
        Ok(if self.swapped { i32::from_be_bytes(bytes) } else { i32::from_le_bytes(bytes) })
    }

    fn size(&mut self) -> Result<u64, MeshFileError> {
        let bytes = self.take()?;
        Ok(if self.swapped { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) })
    }

    fn real(&mut self) -> Result<Real, MeshFileError> {
        let bytes = self.take()?;
        let value = if self.swapped { Real::from_be_bytes(bytes) } else { Real::from_le_bytes(bytes) };
        if value.is_finite() { Ok(value) } else { Err(self.malformed("a coordinate is not finite")) }
    }
}

/// The start of a text, for messages.
fn excerpt(text: &str) -> String {
    let mut short: String = text.chars().take(60).map(|c| if c.is_control() { '?' } else { c }).collect();
    if text.chars().count() > 60 {
        short.push_str("...");
    }
    short
}

/// Advice on meshing the volume within a surface.
pub(super) const FILL: &str = "To fill `grain.stl`: a file `grain.geo` with the line `Merge \"grain.stl\"; Surface Loop(1) \
                               = {1}; Volume(1) = {1};`, then `gmsh -3 grain.geo -o grain.msh`";

/// Likely kind of a file that does not start like a mesh, with a suggestion.
fn what_it_is(first: &str) -> String {
    let convert = "convert it, for instance with `meshio convert`";
    if first.is_empty() {
        return "it is empty".to_owned();
    }
    let lower = first.to_ascii_lowercase();
    let known = [
        ("$nod", "of version 1: convert it with `gmsh -save -format msh41`"),
        ("solid", "an STL surface, which has to be filled with tetrahedra"),
        ("# vtk", "a VTK file: convert it, for instance with `meshio convert`"),
        ("<?xml", "an XML file: convert it, for instance with `meshio convert`"),
        ("<vtkfile", "a VTK file: convert it, for instance with `meshio convert`"),
        ("*", "an Abaqus file: convert it, for instance with `meshio convert`"),
        ("meshversionformatted", "a Medit file: convert it, for instance with `meshio convert`"),
        ("ply", "a PLY surface, which has to be filled with tetrahedra: save it as STL"),
    ];
    match known.iter().find(|(start, _)| lower.starts_with(start)) {
        Some((_, kind)) if kind.contains("surface") => format!("it looks like {kind}. {FILL}"),
        Some((_, kind)) => format!("it looks like {kind}"),
        None => format!("its first line is '{}'; if it is another mesh format, {convert}", excerpt(first)),
    }
}
