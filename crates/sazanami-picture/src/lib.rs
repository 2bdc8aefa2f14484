//! Pictures drawn without a GPU or a display: section views and three-dimensional stills. Charts are drawn by the report.
//!
//! The same input gives the same pixels for any number of threads. [`Painter`] draws what a run and its evaluation have
//! to show.

mod axes;
mod canvas;
mod colour;
mod crater;
mod isosurface;
mod painter;
mod raster;
mod scene;
mod section;
mod slab;
mod still;
mod text;
mod vectors;

pub use axes::superscript;
pub use colour::{Colour, ColourMap, ColourScale};
pub use isosurface::Isosurface;
pub use painter::Painter;
pub use section::{SectionView, section_of_cells};
pub use slab::{SlabPanel, SlabView};
pub use still::{Still, Viewpoint};
pub use vectors::VectorWindow;

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use sazanami_io::replace_file;

/// Why a picture could not be drawn or kept.
#[derive(Debug, Error)]
pub enum PictureError {
    /// The file system refused.
    #[error("cannot write picture {path}: {source}", path = path.display())]
    Write {
        /// File to be written.
        path: PathBuf,
        /// Refusal of the file system.
        source: io::Error,
    },
    /// Something to be drawn has the wrong number of values.
    #[error("the picture needs {expected} values of {what}, not {found}")]
    WrongLength {
        /// Quantity of the values.
        what: &'static str,
        /// Number needed.
        expected: usize,
        /// Number given.
        found: usize,
    },
}

/// Finished pixels.
#[derive(Clone, PartialEq, Eq)]
pub struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl std::fmt::Debug for Picture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Picture({} x {})", self.width, self.height)
    }
}

impl Picture {
    /// Width \[pixels].
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height \[pixels].
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Red, green and blue of the pixels, row by row from the top.
    #[must_use]
    pub fn pixels(&self) -> &[[u8; 3]] {
        self.rgb.as_chunks().0
    }

    /// Writes a PNG file, all at once.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn save(&self, path: &Path) -> Result<(), PictureError> {
        replace_file(path, |file| {
            let mut encoder = png::Encoder::new(file, self.width as u32, self.height as u32);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Eight);
            encoder.set_compression(png::Compression::Fast);
            let mut writer = encoder.write_header()?;
            writer.write_image_data(&self.rgb)?;
            writer.finish()?;
            Ok(())
        })
        .map_err(|source| PictureError::Write { path: path.to_owned(), source })
    }
}

/// Refuses `found` values where `expected` are needed.
fn check_length(what: &'static str, expected: usize, found: usize) -> Result<(), PictureError> {
    if expected == found { Ok(()) } else { Err(PictureError::WrongLength { what, expected, found }) }
}
