//! Pictures at output times: the section through the middle with grains and liquid, the liquid alone, and a view of
//! the whole (figures 8 to 12 of Yagyu et al. 2015).

use std::path::PathBuf;
use std::sync::Arc;

use sazanami_io::{Bodies, BodyPose, BodySurface};
use sazanami_mics::solver::Solver;
use sazanami_numerics::Real;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::grid::Grid;
use sazanami_picture::{ColourScale, Isosurface, PictureError, SectionView, Still, Viewpoint, section_of_cells};

use super::series::Fractions;
use crate::clock::Clock;
use crate::job::{Job, RecordError};
use crate::recorder::bed::GatheredGrains;
use crate::recorder::files::{Files, poses, surfaces};

/// Speed at the upper end of the colours, over the largest initial speed of a liquid: the same for all pictures of a run.
const FASTEST: Real = 0.1;
/// Part of a cell that is liquid outside grains on the surface that is drawn: thin sheets stay visible.
const SURFACE: Real = 0.3;

/// Draws what the figures of a time are. All ranks take part.
pub(super) fn draw(
    job: &Job,
    solver: &Solver,
    clock: &Clock,
    files: Option<&mut Files>,
    seen: &GatheredGrains,
) -> Result<(), RecordError> {
    let liquid = Fractions::gather(solver).outside_grains();
    let Some(files) = files else { return Ok(()) };
    let name = format!("{:09}", clock.step());
    let paths = ["section", "liquid", "view"].map(|kind| files.figure(&format!("{kind}-{name}.png")));
    let pictures = seen.with_bed(|bed| Pictures {
        grid: *solver.domain().grid(),
        plane: job.case.bed.axis[1],
        title: format!("{}: t = {:.3} ms", job.case.caption(), 1e3 * clock.time()),
        scale: ColourScale::speed(fastest(job)),
        shapes: job.shapes.clone(),
        poses: poses(bed),
        speeds: bed.velocity.iter().map(|v| v.length()).collect(),
        liquid,
    });
    files.drawing.add(move || pictures.draw(&paths));
    Ok(())
}

/// What the pictures of a time show.
struct Pictures {
    grid: Grid,
    /// Place of the section along x2 [m].
    plane: Real,
    title: String,
    scale: ColourScale,
    shapes: Arc<[Shape]>,
    poses: Vec<BodyPose>,
    /// Speeds of the grains [m/s].
    speeds: Vec<Real>,
    /// Part of each cell that is liquid outside grains.
    liquid: Vec<Real>,
}

impl Pictures {
    /// Draws the section, the liquid alone and the view.
    fn draw(&self, [section, liquid, view]: &[PathBuf; 3]) -> Result<(), PictureError> {
        let surfaces = surfaces(&self.shapes);
        let bodies = Bodies { surfaces: &surfaces, poses: &self.poses };
        let top = self.top(&surfaces);
        let cells = section_of_cells(&self.grid, &self.liquid, self.plane);
        let water = SectionView { top, ..SectionView::new(&self.grid, self.plane, &self.title, &cells, &self.scale) };
        water.clone().with_grains(bodies, &self.speeds).draw()?.save(section)?;
        water.draw()?.save(liquid)?;
        let any_liquid = self.liquid.iter().any(|&c| c > SURFACE);
        let surface = any_liquid.then(|| Isosurface::new(&self.grid, &self.liquid, SURFACE, 1)).transpose()?;
        let still = Still {
            viewpoint: Viewpoint { azimuth: -75.0, elevation: 20.0 },
            top,
            cut_open: true,
            liquid: surface.as_ref(),
            ..Still::new(&self.grid, &self.title, bodies, &self.speeds, &self.scale)
        };
        still.draw()?.save(view)
    }

    /// Upper edge of the pictures: above all grains and liquid, in steps of a tenth of the box so that it seldom
    /// moves from one time to the next [m].
    fn top(&self, surfaces: &[BodySurface]) -> Real {
        let radius = |surface: &BodySurface| surface.nodes.iter().map(|node| node.length()).fold(0.0, Real::max);
        let radii: Vec<Real> = surfaces.iter().map(radius).collect();
        let of_grain = |pose: &BodyPose| pose.position.z + pose.scale * radii[pose.surface as usize];
        let [n1, n2, _] = self.grid.cells;
        let layer = self.liquid.iter().rposition(|&c| c > SURFACE).map_or(0, |cell| cell / (n1 * n2) + 1);
        let (lower, upper) = (self.grid.lower.z, self.grid.upper().z);
        let highest = self.poses.iter().map(of_grain).fold(lower + layer as Real * self.grid.spacing.z, Real::max);
        let tenths = (10.0 * (highest - lower) / (upper - lower) + 0.3).ceil().clamp(1.0, 10.0);
        lower + 0.1 * tenths * (upper - lower)
    }
}

/// Speed of the last colour [m/s].
fn fastest(job: &Job) -> Real {
    let speed = job.case.liquids.iter().map(|liquid| liquid.velocity.length()).fold(0.0, Real::max);
    if speed > 0.0 { FASTEST * speed } else { 0.1 }
}
