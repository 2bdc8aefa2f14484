//! Beds in files: positions and orientations of settled grains, with the recipe that made them.
//!
//! The file is a container of named, checksummed sections, or, where its name ends in `.csv`, a table for people
//! (`table.rs`); the grains are in the order of their identifiers.

mod table;

use std::path::{Path, PathBuf};

use sazanami_numerics::{Quaternion, Real, Vector};
use serde::{Deserialize, Serialize};

use crate::checkpoint::{CheckpointError, CheckpointReader, CheckpointWriter};

/// Origin of a bed and its measures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Name of the case that packed it.
    pub case: String,
    /// Hash of what of that case the packed grains depend on.
    pub case_hash: String,
    /// Version of the program.
    pub version: String,
    /// Names of the shapes, in the order of [`BedGrain::shape`].
    pub shapes: Vec<String>,
    /// Porosity of a slab; `None` if the slab that the case gives lies above the bed.
    pub porosity: Option<Real>,
    /// Heights of that slab, as far as it lies within the bed \[m].
    pub porosity_slab: [Real; 2],
    /// Highest node near the axis, H_s \[m].
    pub height: Real,
    /// Mean speed of the grains when packing ended [m/s].
    pub mean_speed: Real,
    /// Largest mean speed during the fall [m/s].
    pub largest_mean_speed: Real,
    /// Order of the long axes: above 0 if they lie, 0 at random.
    pub lying_order: Real,
    /// Simulated time of the packing \[s].
    pub time: Real,
}

/// Section with the grains that are glued.
const HELD: &str = "bed/held";

/// A grain at rest in a bed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BedGrain {
    /// Its number among the [`Recipe::shapes`].
    pub shape: u32,
    /// Factor on the size of its shape.
    pub scale: Real,
    /// Centre of mass \[m].
    pub position: Vector,
    /// Rotation from the frame of its shape to that of the box.
    pub orientation: Quaternion,
    /// Whether it is glued to the floor: forces do not move it.
    pub held: bool,
}

/// A bed at rest, as its file keeps it.
#[derive(Clone, Debug, PartialEq)]
pub struct Bed {
    /// Lower corner of the box it lies in \[m].
    pub lower: Vector,
    /// Upper corner \[m].
    pub upper: Vector,
    /// Its origin.
    pub recipe: Recipe,
    /// Its grains, in the order of their identifiers.
    pub grains: Vec<BedGrain>,
}

/// A bed file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BedFileError {
    /// The file cannot be read or written.
    #[error(transparent)]
    File(#[from] CheckpointError),
    /// Sections do not belong together.
    #[error("{}: the sections of the bed do not fit each other", path.display())]
    Inconsistent {
        /// The file.
        path: PathBuf,
    },
    /// A table is not one of grains.
    #[error("{}, line {line}: {problem}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// What is wrong there, and what was expected.
        problem: String,
    },
    /// A table cannot be read or written.
    #[error("{}: {source}", path.display())]
    Path {
        /// The file.
        path: PathBuf,
        /// Refusal of the file system.
        source: std::io::Error,
    },
}

impl Bed {
    /// Writes the bed, all at once: as a table if the name of the file ends in `.csv`.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn write(&self, path: &Path) -> Result<(), BedFileError> {
        if table::is_table(path) {
            return table::write(self, path);
        }
        let position: Vec<Real> = self.grains.iter().flat_map(|grain| grain.position.to_array()).collect();
        let orientation: Vec<Real> = self.grains.iter().flat_map(|grain| grain.orientation.to_array()).collect();
        let scale: Vec<Real> = self.grains.iter().map(|grain| grain.scale).collect();
        let shape: Vec<u32> = self.grains.iter().map(|grain| grain.shape).collect();
        let corners: Vec<Real> = [self.lower, self.upper].iter().flat_map(|corner| corner.to_array()).collect();
        let mut file = CheckpointWriter::new();
        file.add_json("bed/recipe", &self.recipe)?;
        file.add("bed/box", &corners)?;
        file.add("bed/position", &position)?;
        file.add("bed/orientation", &orientation)?;
        file.add("bed/scale", &scale)?;
        file.add("bed/shape", &shape)?;
        let held: Vec<u32> = self.grains.iter().map(|grain| u32::from(grain.held)).collect();
        if held.contains(&1) {
            file.add(HELD, &held)?;
        }
        file.write_atomic(path)?;
        Ok(())
    }

    /// Reads a bed from `path`: a table if its name ends in `.csv`.
    ///
    /// # Errors
    /// [`BedFileError`] if it is not one.
    pub fn read(path: &Path) -> Result<Self, BedFileError> {
        if table::is_table(path) {
            return table::read(path);
        }
        let file = CheckpointReader::open(path)?;
        let corners: Vec<Real> = file.get("bed/box")?;
        let position: Vec<Real> = file.get("bed/position")?;
        let orientation: Vec<Real> = file.get("bed/orientation")?;
        let scale: Vec<Real> = file.get("bed/scale")?;
        let shape: Vec<u32> = file.get("bed/shape")?;
        let count = shape.len();
        // There only if grains are glued.
        let held: Vec<u32> = if file.has(HELD) { file.get(HELD)? } else { vec![0; count] };
        if held.len() != count
            || corners.len() != 6
            || scale.len() != count
            || position.len() != 3 * count
            || orientation.len() != 4 * count
        {
            return Err(BedFileError::Inconsistent { path: path.to_owned() });
        }
        let lying = |n: usize| BedGrain {
            shape: shape[n],
            scale: scale[n],
            position: Vector::from_slice(&position[3 * n..]),
            orientation: Quaternion::from_slice(&orientation[4 * n..]),
            held: held[n] != 0,
        };
        Ok(Self {
            lower: Vector::from_slice(&corners),
            upper: Vector::from_slice(&corners[3..]),
            recipe: file.get_json("bed/recipe")?,
            grains: (0..count).map(lying).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bed_comes_back_to_the_bit() {
        let bed = Bed {
            lower: Vector::ZERO,
            upper: Vector::ONE,
            recipe: Recipe {
                case: "bed".into(),
                shapes: vec!["sand".into(), "shell".into()],
                porosity: Some(0.454),
                ..Recipe::default()
            },
            grains: (0..5)
                .map(|n| BedGrain {
                    shape: n % 2,
                    scale: 1.0 + 0.1 * Real::from(n),
                    position: Vector::new(0.1, 0.2, Real::from(n) / 3.0),
                    orientation: Quaternion::from_rotation_x(Real::from(n)),
                    held: n == 2,
                })
                .collect(),
        };
        for ending in ["bed", "csv"] {
            let path = std::env::temp_dir().join(format!("sazanami-bed-{}.{ending}", std::process::id()));
            bed.write(&path).unwrap();
            assert_eq!(Bed::read(&path).unwrap(), bed, "{ending}");
            // Negative control: the last bit of a place makes another bed.
            let mut other = bed.clone();
            other.grains[3].position.x = other.grains[3].position.x.next_up();
            other.write(&path).unwrap();
            assert_ne!(Bed::read(&path).unwrap(), bed, "{ending}");
            std::fs::write(&path, b"not a bed").unwrap();
            assert!(Bed::read(&path).is_err());
            std::fs::remove_file(&path).unwrap();
        }
    }
}
