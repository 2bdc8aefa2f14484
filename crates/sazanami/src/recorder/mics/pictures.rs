//! Pictures at output times: the section through the middle with grains and liquid, the liquid alone, and a view of
//! the whole (figures 8 to 12 of Yagyu et al. 2015).

use sazanami_io::BodyPose;
use sazanami_mics::solver::Solver;
use sazanami_numerics::Real;
use sazanami_observe::BedView;

use super::series::Fractions;
use crate::artist::{Figure, Scene};
use crate::job::{Job, RecordError};
use crate::recorder::bed::GatheredGrains;
use crate::recorder::observer::Output;

/// Speed at the upper end of the colours, over the largest initial speed of a liquid: the same for all pictures of a run.
const FASTEST: Real = 0.1;

/// Draws what the figures of a time are. All ranks take part.
pub(super) fn draw(to: Output, solver: &Solver, grains: &GatheredGrains) -> Result<(), RecordError> {
    let Output { job, clock, files } = to;
    let Some(artist) = job.options.artist else { return Ok(()) };
    let liquid = Fractions::gather(solver).outside_grains();
    let Some(files) = files else { return Ok(()) };
    let name = format!("{:09}", clock.step());
    let [section, alone, view] = ["section", "liquid", "view"].map(|kind| files.figure(&format!("{kind}-{name}.png")));
    let scene = grains.with_bed(|bed| Scene {
        grid: *solver.domain().grid(),
        plane: job.case.bed.axis[1],
        title: format!("{}: t = {:.3} ms", job.case.caption(), 1e3 * clock.time()),
        fastest: fastest(job),
        shapes: job.shapes.clone(),
        poses: poses(bed),
        speeds: bed.velocity.iter().map(|v| v.length()).collect(),
        liquid,
    });
    files.drawing.add(move || {
        artist.draw(&Figure::Section(&scene), &section)?;
        artist.draw(&Figure::Liquid(&scene), &alone)?;
        artist.draw(&Figure::View(&scene), &view)
    });
    Ok(())
}

/// Speed of the last colour [m/s].
fn fastest(job: &Job) -> Real {
    let speed = job.case.liquids.iter().map(|liquid| liquid.velocity.length()).fold(0.0, Real::max);
    if speed > 0.0 { FASTEST * speed } else { 0.1 }
}

/// Poses of the grains, scaled.
fn poses(bed: &BedView) -> Vec<BodyPose> {
    (0..bed.len())
        .map(|n| BodyPose {
            surface: bed.body[n],
            scale: bed.scale[n],
            position: bed.position[n],
            orientation: bed.orientation[n],
        })
        .collect()
}
