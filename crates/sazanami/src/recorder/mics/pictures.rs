//! Pictures at output times: the section through the middle with grains and liquid, the liquid alone, and a view of
//! the whole (figures 8 to 12 of Yagyu et al. 2015).

use sazanami_io::Bodies;
use sazanami_io::picture::{ColourScale, Isosurface, SectionView, Still, Viewpoint, section_of_cells};
use sazanami_mics::solver::Solver;
use sazanami_numerics::{Real, Vector};

use super::series::Fractions;
use crate::clock::Clock;
use crate::recorder::RecordError;
use crate::recorder::bed::GatheredGrains;
use crate::recorder::files::{Files, poses, surfaces};
use crate::simulation::Job;

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
    let grid = solver.domain().grid();
    let case = job.case;
    let name = format!("{:09}", clock.step());
    let plane = case.bed.axis[1];
    let section = section_of_cells(grid, &liquid, plane);
    let scale = ColourScale::speed(fastest(job));
    let title = format!("{}: t = {:.3} ms", case.caption(), 1e3 * clock.time());
    let any_liquid = liquid.iter().any(|&c| c > SURFACE);
    let surface = any_liquid.then(|| Isosurface::new(grid, &liquid, SURFACE, 1)).transpose()?;
    seen.with_bed(|bed| {
        let (surfaces, poses) = (surfaces(&job.shapes), poses(bed));
        let speeds: Vec<Real> = bed.velocity.iter().map(|v| v.length()).collect();
        let bodies = Bodies { surfaces: &surfaces, poses: &poses };
        let mut view = SectionView::new(grid, plane, &title, &section, &scale);
        if !bed.is_empty() {
            view = view.with_grains(bodies, &speeds);
        }
        view.draw()?.save(&files.figure(&format!("section-{name}.png")))?;
        SectionView::new(grid, plane, &title, &section, &scale)
            .draw()?
            .save(&files.figure(&format!("liquid-{name}.png")))?;
        let mut still = Still::new(grid, &title, bodies, &speeds, &scale);
        still.cut_open = true;
        still.viewpoint =
            Viewpoint { azimuth: -75.0, elevation: 18.0, zoom: 1.25, centre: Vector::new(0.5, 0.5, 0.42) };
        if let Some(surface) = &surface {
            still = still.with_liquid(surface);
        }
        still.draw()?.save(&files.figure(&format!("view-{name}.png")))?;
        Ok(())
    })
}

/// Speed of the last colour [m/s].
fn fastest(job: &Job) -> Real {
    let speed = job.case.liquids.iter().map(|liquid| liquid.velocity.length()).fold(0.0, Real::max);
    if speed > 0.0 { FASTEST * speed } else { 0.1 }
}
