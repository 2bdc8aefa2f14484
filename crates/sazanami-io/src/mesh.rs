//! Tetrahedral meshes from Gmsh files.
//!
//! MSH 2.2 and 4.1, text or binary; of the elements only the four-node tetrahedra are used, points, lines and
//! surface elements are passed over. Format: Geuzaine and Remacle, Gmsh reference manual, chapter "Gmsh file formats".

mod source;

use std::fmt;
use std::path::{Path, PathBuf};

use sazanami_numerics::geometry::{MeshError, TetrahedralMesh};
use sazanami_numerics::{Real, Vector};

use source::{FILL, Source};

/// A mesh and what else the file said.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// The solid, checked, in metres.
    pub mesh: TetrahedralMesh,
    /// Elements of lower dimension passed over.
    pub ignored_elements: usize,
    /// Nodes that no tetrahedron uses, dropped.
    pub dropped_nodes: usize,
}

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of a text file, from one.
    Line(usize),
    /// Byte of a binary file, from zero.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(n) => write!(f, "line {n}"),
            Self::Byte(n) => write!(f, "byte {n}"),
        }
    }
}

/// Why a mesh file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// The file cannot be read.
    #[error("cannot read the mesh file {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// It is some other file.
    #[error("this is not a Gmsh mesh file: it should start with $MeshFormat, but {found}")]
    NotMesh {
        /// Start of the file, and a suggestion.
        found: String,
    },
    /// A version that is not understood.
    #[error(
        "{at}: MSH version {version} is not understood, only 2.2 and 4.1: convert with `gmsh -save -format msh41 \
             -o new.msh old.msh`"
    )]
    Version {
        /// Place of the version.
        at: Place,
        /// Version of the file.
        version: String,
    },
    /// The file breaks its own format.
    #[error("{at}: {problem}")]
    Malformed {
        /// Place of the error.
        at: Place,
        /// The error.
        problem: String,
    },
    /// The file is in order but holds no solid mesh of four-node tetrahedra.
    #[error("{problem}")]
    NoTetrahedra {
        /// Contents instead, and a suggestion.
        problem: String,
    },
    /// The tetrahedra do not make a sound solid.
    #[error("{at}: element {element}: {source}")]
    Unsound {
        /// Place of the element.
        at: Place,
        /// Its number in the file.
        element: u64,
        /// Error of the mesh (there elements are counted in the order of the tetrahedra of the file).
        source: MeshError,
    },
}

impl MeshFileError {
    /// Line of the file the error speaks of, where there is one.
    #[must_use]
    pub fn line(&self) -> Option<usize> {
        match self {
            Self::Version { at, .. } | Self::Malformed { at, .. } | Self::Unsound { at, .. } => match at {
                Place::Line(line) => Some(*line),
                Place::Byte(_) => None,
            },
            Self::NotMesh { .. } => Some(1),
            Self::Unreadable { .. } | Self::NoTetrahedra { .. } => None,
        }
    }
}

/// Reads the file at `path`; its lengths are multiplied by `unit` \[m].
///
/// # Errors
/// If it cannot be read, is not such a file, or its tetrahedra do not make a sound solid.
pub fn read(path: &Path, unit: Real) -> Result<MeshFile, MeshFileError> {
    let bytes =
        crate::input::read(path).map_err(|source| MeshFileError::Unreadable { path: path.to_owned(), source })?;
    parse(&bytes, unit)
}

/// Reads a mesh from the contents of a file; its lengths are multiplied by `unit` \[m].
///
/// # Errors
/// If they are not those of such a file, or the tetrahedra do not make a sound solid.
pub fn parse(bytes: &[u8], unit: Real) -> Result<MeshFile, MeshFileError> {
    let mut source = Source::new(bytes);
    let version = source.format()?;
    let mut raw = Raw::default();
    while let Some(section) = source.next_section()? {
        match (section.as_str(), version) {
            ("Nodes", Version::Two) => raw.nodes_2(&mut source)?,
            ("Nodes", Version::Four) => raw.nodes_4(&mut source)?,
            ("Elements", Version::Two) => raw.elements_2(&mut source)?,
            ("Elements", Version::Four) => raw.elements_4(&mut source)?,
            _ => {
                source.skip_section(&section)?;
                continue;
            }
        }
        source.end_section(&section)?;
    }
    raw.into_mesh(unit)
}

/// The two layouts of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Version {
    Two,
    Four,
}

/// Contents of the sections, by the numbers of the file.
#[derive(Default)]
struct Raw {
    nodes: Vec<(u64, Vector)>,
    tetrahedra: Vec<Tetrahedron>,
    ignored: usize,
}

struct Tetrahedron {
    tag: u64,
    nodes: [u64; 4],
    at: Place,
}

const TETRAHEDRON: u64 = 4;

/// Nodes of an element type and whether it is solid, for the types Gmsh writes.
fn element_type(kind: u64) -> Option<(usize, bool)> {
    let nodes = match kind {
        15 => 1,
        1 => 2,
        2 | 8 => 3,
        3 | 4 | 26 => 4,
        7 | 27 => 5,
        6 | 9 | 28 => 6,
        5 | 16 => 8,
        10 | 20 => 9,
        11 | 21 => 10,
        22 => 12,
        19 => 13,
        14 => 14,
        18 | 23 | 24 => 15,
        13 => 18,
        17 | 29 => 20,
        25 => 21,
        12 => 27,
        30 => 35,
        31 => 56,
        92 => 64,
        93 => 125,
        _ => return None,
    };
    let solid = matches!(kind, 4..=7 | 11..=14 | 17..=19 | 29..=31 | 92 | 93);
    Some((nodes, solid))
}

impl Raw {
    /// `count`, then lines of `tag x y z`.
    fn nodes_2(&mut self, source: &mut Source) -> Result<(), MeshFileError> {
        let count = source.text_count()?;
        for _ in 0..count {
            let (tag, position) = source.node()?;
            self.nodes.push((tag, position));
        }
        Ok(())
    }

    /// Blocks of `dimension entity parametric count`, then the tags, then the positions.
    fn nodes_4(&mut self, source: &mut Source) -> Result<(), MeshFileError> {
        let [blocks, ..] = source.sizes::<4>()?;
        for _ in 0..blocks {
            let ([dimension, _, parametric], count) = source.block()?;
            let first = self.nodes.len();
            for _ in 0..count {
                let [tag] = source.sizes::<1>()?;
                self.nodes.push((tag, Vector::ZERO));
            }
            let parameters = if parametric == 0 { 0 } else { dimension.clamp(0, 3) as usize };
            for node in first..self.nodes.len() {
                self.nodes[node].1 = source.position(parameters)?;
            }
        }
        Ok(())
    }

    /// `count`, then lines of `tag type tags... nodes...`; binary files gather elements of a type under one head.
    fn elements_2(&mut self, source: &mut Source) -> Result<(), MeshFileError> {
        let count = source.text_count()?;
        let mut read = 0;
        while read < count {
            let at = source.place();
            let (kind, elements, tags) = source.element_head()?;
            let nodes = self.known_type(kind, at)?;
            for _ in 0..elements {
                let at = source.place();
                let values = source.element(tags, nodes)?;
                self.add(kind, values[0], &values[1 + tags..], at);
            }
            read += elements;
        }
        Ok(())
    }

    /// Blocks of `dimension entity type count`, then lines of `tag nodes...`.
    fn elements_4(&mut self, source: &mut Source) -> Result<(), MeshFileError> {
        let [blocks, ..] = source.sizes::<4>()?;
        for _ in 0..blocks {
            let at = source.place();
            let ([_, _, kind], count) = source.block()?;
            let kind = u64::try_from(kind).unwrap_or(0);
            let nodes = self.known_type(kind, at)?;
            for _ in 0..count {
                let at = source.place();
                let values = source.size_list(1 + nodes)?;
                self.add(kind, values[0], &values[1..], at);
            }
        }
        Ok(())
    }

    /// Number of nodes of a type that may stand in the file.
    fn known_type(&self, kind: u64, at: Place) -> Result<usize, MeshFileError> {
        let problem = match element_type(kind) {
            Some((nodes, solid)) if kind == TETRAHEDRON || !solid => return Ok(nodes),
            Some((nodes, _)) if matches!(kind, 11 | 29 | 30 | 31) => format!(
                "elements of type {kind} are curved tetrahedra of {nodes} nodes, only those of 4 nodes are understood: \
                 mesh with `-order 1`"
            ),
            Some((nodes, _)) => {
                format!(
                    "elements of type {kind} are solids of {nodes} nodes, only tetrahedra of 4 nodes are understood"
                )
            }
            None => format!("there is no element type {kind}"),
        };
        Err(MeshFileError::Malformed { at, problem })
    }

    fn add(&mut self, kind: u64, tag: u64, nodes: &[u64], at: Place) {
        match *nodes {
            [a, b, c, d] if kind == TETRAHEDRON => self.tetrahedra.push(Tetrahedron { tag, nodes: [a, b, c, d], at }),
            _ => self.ignored += 1,
        }
    }

    fn into_mesh(self, unit: Real) -> Result<MeshFile, MeshFileError> {
        if self.tetrahedra.is_empty() {
            return Err(MeshFileError::NoTetrahedra {
                problem: format!(
                    "the mesh file holds {} nodes and {} elements of lower dimension, but no tetrahedra: a geometry is \
                     meshed by `gmsh -3`, and a surface has no volume to be meshed before it is given one. {FILL}",
                    self.nodes.len(),
                    self.ignored
                ),
            });
        }
        let mut order: Vec<u32> = (0..self.nodes.len() as u32).collect();
        order.sort_unstable_by_key(|&i| (self.nodes[i as usize].0, i));
        if let Some(pair) = order.windows(2).find(|w| self.nodes[w[0] as usize].0 == self.nodes[w[1] as usize].0) {
            let tag = self.nodes[pair[0] as usize].0;
            let at = self.tetrahedra[0].at;
            return Err(MeshFileError::Malformed { at, problem: format!("node {tag} is defined twice above") });
        }
        let mut tetrahedra = Vec::with_capacity(self.tetrahedra.len());
        for element in &self.tetrahedra {
            let mut nodes = [0; 4];
            for (node, &tag) in nodes.iter_mut().zip(&element.nodes) {
                let found = order.binary_search_by_key(&tag, |&i| self.nodes[i as usize].0);
                *node = found.map(|n| order[n]).map_err(|_| MeshFileError::Malformed {
                    at: element.at,
                    problem: format!("element {} names node {tag}, which the file does not define", element.tag),
                })?;
            }
            tetrahedra.push(nodes);
        }
        let nodes = self.nodes.iter().map(|&(_, p)| unit * p).collect();
        let mut mesh = TetrahedralMesh { nodes, tetrahedra };
        let dropped_nodes = mesh.drop_unreferenced_nodes();
        mesh.check().map_err(|source| {
            let element = &self.tetrahedra[first_element(&source)];
            MeshFileError::Unsound { at: element.at, element: element.tag, source }
        })?;
        Ok(MeshFile { mesh, ignored_elements: self.ignored, dropped_nodes })
    }
}

/// The tetrahedron an error is about.
fn first_element(error: &MeshError) -> usize {
    match error {
        MeshError::NoSuchNode { tetrahedron, .. }
        | MeshError::Degenerate { tetrahedron, .. }
        | MeshError::Inverted { tetrahedron, .. }
        | MeshError::Disconnected { tetrahedron, .. } => *tetrahedron,
        MeshError::NonManifoldFace { tetrahedra } => tetrahedra[0],
        MeshError::Overlapping { tetrahedra } => tetrahedra[0],
        MeshError::Empty
        | MeshError::NotFinite { .. }
        | MeshError::Unreferenced { .. }
        | MeshError::NonManifoldEdge { .. } => 0,
    }
}

#[cfg(test)]
mod tests;
