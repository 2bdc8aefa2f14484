//! Pictures at output times: the section through the middle with grains and liquid, the liquid alone, and a view of
//! the whole (figures 8 to 12 of Yagyu et al. 2015). All pictures of a run show the same part of the box.

use std::sync::Arc;

use sazanami_io::BodyPose;
use sazanami_mics::solver::Solver;
use sazanami_numerics::Real;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::grid::Grid;
use sazanami_observe::BedView;
use sazanami_observe::erosion::{Erosion, ErosionSettings, InitialBed, Known};
use sazanami_posing::assembly::fluid::origin_of;

use super::GridObserver;
use super::series::Fractions;
use crate::artist::{Amount, BedSurface, Colouring, CraterCap, Figure, Points, Scene, heights_coloured};
use crate::case::meaning::{Case, GrainColour};
use crate::job::RecordError;
use crate::recorder::bed::{BedFindings, GatheredGrains};
use crate::recorder::observer::Output;

/// Speed at the upper end of the colours, over the largest initial speed of a liquid: the same for all pictures of a run.
const FASTEST: Real = 0.1;
/// Room above the drop where it starts, in parts of the width of the box.
const ABOVE: Real = 0.04;
/// Draws what the figures of a time are. All ranks take part.
pub(super) fn draw(
    to: Output,
    solver: &Solver,
    grains: &GatheredGrains,
    observer: &GridObserver,
) -> Result<(), RecordError> {
    let Output { job, clock, files } = to;
    let Some(artist) = job.options.artist else { return Ok(()) };
    let liquid = Fractions::gather(solver).outside_grains();
    let Some(files) = files else { return Ok(()) };
    let name = format!("{:09}", clock.step());
    let [section, alone, view] = ["section", "liquid", "view"].map(|kind| files.figure(&format!("{kind}-{name}.png")));
    let surface = observer.erosion.as_ref().map(|settings| {
        let findings = &observer.findings;
        bed_surface(settings, observer.initial.as_ref(), findings.erosion.as_ref(), findings.known())
    });
    let height = grains.found.filter(BedFindings::is_bed).map(|bed| 1e-3 * bed.height_mm);
    let shapes = Arc::clone(&job.shapes);
    let grid = *solver.domain().grid();
    let scene =
        grains.with_bed(|bed| scene(job.case, clock.time(), bed, height, Drawn { shapes, grid, liquid, surface }));
    files.drawing.add(move || {
        artist.draw(&Figure::Section(&scene), &section)?;
        artist.draw(&Figure::Liquid(&scene), &alone)?;
        artist.draw(&Figure::View(&scene), &view)
    });
    Ok(())
}

/// Parts that a scene takes over as they are.
pub(crate) struct Drawn {
    pub shapes: Arc<[Shape]>,
    pub grid: Grid,
    /// Part of each cell that is liquid outside grains.
    pub liquid: Vec<Real>,
    pub surface: Option<BedSurface>,
}

/// The scene of a time \[s]. `height` is that of the bed over the floor before the impact, if there was a bed \[m].
pub(crate) fn scene(case: &Case, time: Real, bed: &BedView, height: Option<Real>, drawn: Drawn) -> Scene {
    let Drawn { shapes, grid, liquid, surface } = drawn;
    let bed_before = height.map(|height| case.domain.lower.z + height);
    Scene {
        title: format!("{}: t = {:.3} ms", case.caption(), 1e3 * time),
        grid,
        top: top(case, bed_before),
        plane: case.erosion.as_ref().map_or(case.bed.axis, |erosion| erosion.axis)[1],
        colouring: colouring(case, bed, bed_before),
        shapes,
        poses: poses(bed),
        liquid,
        surface,
    }
}

/// Upper edge of the pictures of a run \[m]: a little above the drop where it starts, over a bed of that height; the lid of
/// the box where there is no bed. What rises higher leaves the pictures.
fn top(case: &Case, bed_before: Option<Real>) -> Real {
    let lid = case.domain.upper.z;
    let Some(bed_height) = bed_before else { return lid };
    let top_of = |liquid| origin_of(liquid, case.bed.axis, bed_height).z + liquid.region.heights()[1];
    let highest = case.liquids.iter().map(top_of).fold(bed_height, Real::max);
    (highest + ABOVE * case.domain.extent().x).min(lid)
}

/// Quantity that colours the grains, with a range that is the same for all pictures of a run.
fn colouring(case: &Case, bed: &BedView, bed_before: Option<Real>) -> Colouring {
    match case.output.grain_colour {
        GrainColour::Speed => Colouring::Speed(bed.velocity.iter().map(|v| v.length()).collect(), fastest(case)),
        GrainColour::Height => {
            let range = heights_coloured([case.domain.lower.z, case.domain.upper.z], bed_before);
            Colouring::Height(bed.position.iter().map(|centre| centre.z).collect(), range)
        }
    }
}

/// Speed of the last colour [m/s].
fn fastest(case: &Case) -> Real {
    let speed = case.liquids.iter().map(|liquid| liquid.velocity.length()).fold(0.0, Real::max);
    if speed > 0.0 { FASTEST * speed } else { 0.1 }
}

/// The surface of the bed about the axis, before the impact and now.
pub(crate) fn bed_surface(
    settings: &ErosionSettings,
    before: Option<&InitialBed>,
    now: Option<&Erosion>,
    known: Known,
) -> BedSurface {
    let at = |(n, height): (usize, Real)| [(n as Real + 0.5) * settings.surface_layer(), height];
    let before = before.map_or_else(Points::new, |bed| bed.heights.iter().copied().enumerate().map(at).collect());
    let now_at = |erosion: &Erosion| erosion.surface.filled().into_iter().enumerate().map(at).collect();
    let found = now.filter(|erosion| erosion.has_crater());
    BedSurface {
        axis: settings.axis[0],
        before,
        now: now.map(now_at).unwrap_or_default(),
        crater: found.map(|erosion| CraterCap {
            rim_radius: erosion.crater.rim_radius,
            rim_height: erosion.crater.rim_height,
            depth: erosion.crater.depth,
            below_rim: Amount {
                volume: erosion.crater.volume_direct,
                uncertainty: erosion.below_rim_uncertainty(),
                doubts: erosion.doubts_below_rim(known).join("; "),
            },
            cap: Amount {
                volume: erosion.crater.volume,
                uncertainty: erosion.volume_uncertainty(),
                doubts: erosion.doubts_of_cap(known).join("; "),
            },
            noise: erosion.noise_below_rim.unwrap_or_default(),
        }),
    }
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
