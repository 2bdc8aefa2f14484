//! Pictures: what they show, and who draws them. The library gathers the data; a front end brings an [`Artist`].

use std::error::Error;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use sazanami_io::BodyPose;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};
pub use sazanami_observe::erosion::NO_CRATER;

use crate::case::units::with_bar;

/// Draws pictures and keeps them as files.
///
/// Runs call it from a thread of their own, beside their steps.
pub trait Artist: std::fmt::Debug + Sync {
    /// Draws `figure` into a PNG file at `path`.
    ///
    /// # Errors
    /// If there is nothing that can be drawn, or the file cannot be written.
    fn draw(&self, figure: &Figure, path: &Path) -> Result<(), NotDrawn>;
}

/// Why there is no picture.
pub type NotDrawn = Box<dyn Error + Send + Sync>;

/// Points of a curve \[m].
pub type Points = Vec<[Real; 2]>;

/// Content of a picture, in SI units.
#[derive(Clone, Copy, Debug)]
pub enum Figure<'a> {
    /// Vertical section through the grains and the liquid (as figures 8 to 10 of Yagyu et al. 2015).
    Section(&'a Scene),
    /// The same section through the liquid alone.
    Liquid(&'a Scene),
    /// Grains and liquid in perspective, cut open.
    View(&'a Scene),
    /// A tank from the side, its grains coloured by several quantities (as figure 3 of Tazaki et al.).
    Tank(&'a SideView),
}

/// Grains and liquid on a grid at one time.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Title, with the time.
    pub title: String,
    /// Cells and extent of the box.
    pub grid: Grid,
    /// Height up to which the box is shown, the same at all times of a run \[m].
    pub top: Real,
    /// Place of the section along x2 \[m].
    pub plane: Real,
    /// Quantity that colours the grains.
    pub colouring: Colouring,
    /// Shapes of the grains.
    pub shapes: Arc<[Shape]>,
    /// Shape and pose of each grain.
    pub poses: Vec<BodyPose>,
    /// Part of each cell that is liquid outside grains.
    pub liquid: Vec<Real>,
    /// The surface of the bed about the axis of the impact, in runs that evaluate it.
    pub surface: Option<BedSurface>,
}

/// Smoothed surface of a bed about the axis of an impact, and the crater in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BedSurface {
    /// Place of the axis along x1 \[m].
    pub axis: Real,
    /// Distance from the axis and mean height before the impact \[m].
    pub before: Points,
    /// The same now.
    pub now: Points,
    /// The crater, once there is one.
    pub crater: Option<CraterCap>,
}

/// Heights of grains that have the first and the last colour, in parts of the height of the bed before the impact.
const COLOURED: [Real; 2] = [0.5, 1.2];

/// Heights of grains that have the first and the last colour \[m], between `floor` and `lid`; with the top of the bed before the
/// impact, if there was a bed.
#[must_use]
pub fn heights_coloured([floor, lid]: [Real; 2], bed_before: Option<Real>) -> [Real; 2] {
    bed_before.map_or([floor, lid], |top| COLOURED.map(|part| floor + part * (top - floor)))
}

/// A volume of a crater.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Amount {
    /// The volume [m^3].
    pub volume: Real,
    /// Its uncertainty, up and down [m^3].
    pub uncertainty: Real,
    /// What speaks against it, in words; empty where nothing does.
    pub doubts: String,
}

impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [volume, bar] = with_bar(1e9 * self.volume, 1e9 * self.uncertainty);
        write!(f, "{volume} ± {bar} mm³")
    }
}

/// A crater, and the spherical cap of eq. (14) of Yagyu et al. (2015) in it.
#[derive(Clone, Debug, PartialEq)]
pub struct CraterCap {
    /// Distance of the rim from the axis, L \[m].
    pub rim_radius: Real,
    /// Height of the rim \[m].
    pub rim_height: Real,
    /// Depth below the rim, H \[m].
    pub depth: Real,
    /// Volume below the plane of the rim.
    pub below_rim: Amount,
    /// V, the volume of the cap.
    pub cap: Amount,
    /// Volume below the plane of the rim of the same bed before the impact [m^3].
    pub noise: Real,
}

/// A tank from the side: a panel for each quantity of the grains within a slab about its middle, and arrows of the water.
#[derive(Clone, Debug)]
pub struct SideView {
    /// Title, with the time.
    pub title: String,
    /// Note on omissions, below the panels.
    pub note: String,
    /// Bounds in x1 \[m].
    pub x: [Real; 2],
    /// Bounds in x3 \[m].
    pub z: [Real; 2],
    /// Bounds in x2 of the grains that are drawn \[m].
    pub slab: [Real; 2],
    /// Centres of the grains \[m].
    pub position: Vec<Vector>,
    /// Diameters of the grains \[m].
    pub diameter: Vec<Real>,
    /// Quantities that colour the grains, a panel each.
    pub panels: Vec<Colouring>,
    /// Surface of the water: points (x1, x3) \[m], NaN for a gap.
    pub water: Points,
    /// Bounds in x1 of the window of arrows \[m].
    pub window: [Real; 2],
    /// Places (x1, x3) \[m] and velocities of the water there [m/s].
    pub arrows: Vec<([Real; 2], [Real; 2])>,
    /// Speed of the arrow in the caption [m/s].
    pub reference: Real,
}

/// Values by which grains are coloured.
#[derive(Clone, Debug)]
pub enum Colouring {
    /// Speeds, up to a fastest [m/s].
    Speed(Vec<Real>, Real),
    /// Speeds of the water, up to a fastest [m/s].
    WaterSpeed(Vec<Real>, Real),
    /// Heights between those of the first and the last colour \[m].
    Height(Vec<Real>, [Real; 2]),
    /// A quantity of either sign, with the label of its colours and the value of the last colour to either side.
    Signed(Vec<Real>, String, Real),
}
