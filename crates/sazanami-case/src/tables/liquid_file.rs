//! `region.file` of `[[liquid]]`: a body of liquid from the fields of a run on the grid.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use sazanami_case_derive::Keys;
use sazanami_io::vtk::{LIQUID, ReadError, VtkFile};
use sazanami_numerics::geometry::{PlacedLiquid, SampledCells, SampledLiquid};
use sazanami_numerics::{Quaternion, Real, Vector, choices};

use crate::read::{Context, Table};

choices! {
    /// Lower sides in which a body from a file is mirrored.
    pub enum MirroredIn {
        /// None: the file holds the whole body.
        None = "none",
        /// The lower side along x1.
        X1 = "x1",
        /// The lower side along x2.
        X2 = "x2",
        /// Both: the file holds a quarter of the body.
        X1X2 = "x1_x2",
    }
}

impl MirroredIn {
    fn directions(self) -> &'static [usize] {
        match self {
            Self::None => &[],
            Self::X1 => &[0],
            Self::X2 => &[1],
            Self::X1X2 => &[0, 1],
        }
    }
}

/// Most cells of a file, its images among them.
const MOST_CELLS: Real = 1e8;

/// The liquid in fields that a run with `solver = "mics"` wrote, with the velocity it has there beside that of its centre of mass.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct LiquidFile {
    /// The file, `fields/fields-*.vti` of the run, relative to the case file; the liquid in it is that outside grains, with its velocity.
    #[key(example = "drop/fields/fields-000004200.vti")]
    pub file: PathBuf,
    /// Planes of symmetry of that run, in which the body is mirrored.
    #[key(word, default = MirroredIn::None)]
    pub mirrored_in: MirroredIn,
    /// Where its centre of mass lies.
    #[key(unit = "m", default = Vector::ZERO, says = "the shape's origin")]
    pub centre: Vector,
    /// Axis about which it is turned.
    #[key(default = Vector::Z, says = "up")]
    pub axis: Vector,
    /// Angle by which it is turned.
    #[key(unit = "rad", default = 0.0)]
    pub angle: Real,
    /// The body, once it is read.
    #[key(skip = None)]
    body: Option<Arc<SampledLiquid>>,
}

impl LiquidFile {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if self.axis.length() == 0.0 {
            cx.report.error(table.place("axis"), "an axis needs a direction").label("this one is zero");
        }
        match read(&self.file, self.mirrored_in) {
            Ok(Some(body)) => self.body = Some(Arc::new(body)),
            Ok(None) => {
                cx.report
                    .error(table.place("file"), "there is less than a cell of liquid in this file")
                    .label("its liquid fraction is zero in all cells, or nearly so")
                    .help("name the fields of a time at which there is some");
            }
            Err(problem) => {
                cx.report
                    .error(table.place("file"), "the liquid cannot be read")
                    .label(problem.to_string())
                    .help("name fields that a run with `solver = \"mics\"` wrote: `fields/fields-*.vti` in its folder");
            }
        }
    }

    /// The body where it lies, once it is read.
    #[must_use]
    pub fn placed(&self) -> Option<PlacedLiquid> {
        let orientation = Quaternion::from_axis_angle(self.axis.normalize_or_zero(), self.angle);
        Some(PlacedLiquid { body: self.body.clone()?, centre: self.centre, orientation })
    }
}

/// Reads the liquid of a file; `None` if there is none in it.
fn read(file: &Path, mirrored_in: MirroredIn) -> Result<Option<SampledLiquid>, ReadError> {
    let fields = VtkFile::read(file)?;
    let damaged = |what: &str| ReadError::Damaged { path: file.to_owned(), what: what.to_owned() };
    let extent = fields.numbers::<6>("ImageData", "WholeExtent")?;
    let edges = [0, 1, 2].map(|d| extent[2 * d + 1] - extent[2 * d]);
    let copies = (1 << mirrored_in.directions().len()) as f64;
    if !edges.iter().all(|&n| n >= 1.0) || copies * edges.iter().product::<f64>() > MOST_CELLS {
        return Err(damaged("WholeExtent of ImageData"));
    }
    let spacing = Vector::from_array(fields.numbers::<3>("ImageData", "Spacing")?);
    if !(spacing.is_finite() && spacing.min_element() > 0.0) {
        return Err(damaged("Spacing of ImageData"));
    }
    let cells = edges.map(|n| n as usize);
    let count = cells.iter().product::<usize>();
    let [_, without_grains] = LIQUID;
    let fraction = fields.doubles(fields.liquid().unwrap_or(without_grains))?;
    let velocity = fields.doubles("velocity")?;
    if fraction.len() != count || velocity.len() != 3 * count {
        return Err(damaged("as many values as cells"));
    }
    if !fraction.iter().chain(&velocity).all(|value| value.is_finite()) {
        return Err(damaged("finite values"));
    }
    let velocity = velocity.as_chunks::<3>().0.iter().map(|&u| Vector::from_array(u)).collect();
    let mut all = SampledCells { cells, spacing, fraction, velocity };
    for &d in mirrored_in.directions() {
        all = all.mirrored(d);
    }
    Ok(SampledLiquid::new(&all))
}
