//! Pictures at output times: the tank seen from the side with grains coloured by speed, drag and pressure force, and the
//! water between them (as figure 3 of Tazaki et al.), and the surfaces of bed and water (as their figure 2).

use sazanami_io::MeasuredProfile;
use sazanami_io::picture::{ColourScale, ProfileFigure, ProfilesAtTime, SlabPanel, SlabView, VectorWindow};
use sazanami_mps::weight::{Weight, Wendland};
use sazanami_numerics::Real;
use sazanami_observe::ripples::{Interpolation, SectionWindow, SurfaceProfile, submerged_weight, vectors_in_section};

use super::ParticleBooks;
use crate::case::meaning::Case;
use crate::clock::Clock;
use crate::recorder::RecordError;
use crate::recorder::files::Files;
use crate::simulation::Job;

/// Part of the width of a tank, about its middle, in which grains are drawn; a thin slab hides nothing.
const SLAB: Real = 0.3;
/// Width of the window of arrows [m].
const WINDOW: Real = 20e-3;
/// Distance of the arrows [m].
const ARROWS: Real = 1e-3;
/// Force at the ends of the colours, over the submerged weight of a grain: drag, force of the pressure.
const FORCES: [Real; 2] = [2.0, 1.0];
/// Width of a panel [pixels].
const WIDTH: usize = 1100;
/// Density that force ranges are found with where a case has no grains [kg/m^3].
const SAND: Real = 2650.0;

/// Draws what the figures of a time are.
pub(super) fn draw(job: &Job, books: &ParticleBooks, clock: &Clock, files: &mut Files) -> Result<(), RecordError> {
    let case = job.case;
    let name = format!("{:09}", clock.step());
    let title = format!("{}: t = {:.3} s", case.caption(), clock.time());
    let (lower, upper) = (case.domain.lower, case.domain.upper);
    let sight = &books.sight;
    let grains = &sight.grains;
    let speed: Vec<Real> = grains.velocity.iter().map(|v| v.length()).collect();
    let drag: Vec<Real> = grains.drag.iter().map(|f| f.x).collect();
    let pressure: Vec<Real> = grains.pressure_force.iter().map(|f| f.x).collect();
    let fastest = books.settings.as_ref().map_or(0.1, |ripples| ripples.colour_speed);
    let weight = weight_of_grain(case);
    let scales = [
        ColourScale::speed(fastest),
        ColourScale::symmetric("drag f_{d,x} [N]", FORCES[0] * weight),
        ColourScale::symmetric("pressure force f_{p,x} [N]", FORCES[1] * weight),
    ];
    let panels: Vec<SlabPanel> =
        [&speed, &drag, &pressure].iter().zip(&scales).map(|(values, scale)| SlabPanel { values, scale }).collect();
    let water: Vec<[Real; 2]> = books.water.points_with_gaps().collect();
    let middle = 0.5 * (lower + upper);
    let half = (0.5 * SLAB * (upper.y - lower.y)).max(grains.diameter.first().copied().unwrap_or_default());
    let top = (books.water.points().map(|[_, z]| z).fold(lower.z, Real::max) + 5e-3).min(upper.z);
    let window = SectionWindow {
        x: [middle.x - 0.5 * WINDOW, middle.x + 0.5 * WINDOW],
        z: [lower.z, top],
        plane: middle.y,
        spacing: ARROWS,
    };
    let kernel = Weight { family: Wendland::C2, radius: sight.reach };
    let around = Interpolation {
        tank: &books.tank,
        position: &sight.water.position,
        volume: &sight.water.bulk_volume,
        reach: sight.reach,
        kernel: |distance| kernel.value(distance),
        least: 4,
    };
    let vectors = vectors_in_section(&around, &window, &sight.water.velocity);
    let arrows = VectorWindow { x: window.x, z: window.z, vectors: &vectors, reference: 2.0 * fastest };
    let view = SlabView {
        title: &title,
        x: [lower.x, upper.x],
        z: [lower.z, top],
        slab: [middle.y - half, middle.y + half],
        position: &grains.position,
        diameter: &grains.diameter,
        panels: &panels,
        water: &water,
        vectors: Some(&arrows),
        width: WIDTH,
    };
    view.draw()?.save(&files.figure(&format!("grains-{name}.png")))?;
    draw_profiles(case, books, clock, files, &name)
}

fn draw_profiles(
    case: &Case,
    books: &ParticleBooks,
    clock: &Clock,
    files: &Files,
    name: &str,
) -> Result<(), RecordError> {
    let (lower, upper) = (case.domain.lower, case.domain.upper);
    let points = |profile: &SurfaceProfile| profile.points_with_gaps().collect::<Vec<_>>();
    let mut moment = ProfilesAtTime { title: format!("t = {:.2} s", clock.time()), ..ProfilesAtTime::default() };
    moment.water.push((String::new(), points(&books.water)));
    if let Some(found) = &books.found {
        let surfaces = [("concentration", &found.bed.concentration), ("image", &found.bed.image)];
        moment.bed.extend(surfaces.iter().map(|(name, profile)| ((*name).to_owned(), points(profile))));
    }
    let near = |time: Real| (time - clock.time()).abs() < 1e-6;
    let measured = books.settings.iter().flat_map(|ripples| &ripples.measured).find(|measured| near(measured.time));
    if let Some(measured) = measured {
        let read = |file: &Option<std::path::PathBuf>| {
            let profile = file.as_ref().and_then(|file| MeasuredProfile::read_if_there(file).ok().flatten());
            profile.map(|profile| profile.points).unwrap_or_default()
        };
        moment.measured_bed = read(&measured.bed);
        moment.measured_water = read(&measured.water);
    }
    let heights = |profile: Option<&SurfaceProfile>| {
        let mean = profile.and_then(SurfaceProfile::mean).unwrap_or(0.5 * (lower.z + upper.z));
        [mean - 8e-3, mean + 8e-3]
    };
    let title = case.caption();
    let figure = ProfileFigure {
        title,
        moments: &[moment],
        x_range: [lower.x, upper.x],
        bed_range: heights(books.found.as_ref().map(|found| &found.bed.concentration)),
        water_range: heights(Some(&books.water)),
    };
    figure.draw()?.save(&files.figure(&format!("profiles-{name}.png")))?;
    Ok(())
}

/// Submerged weight of a grain of the first population [N].
pub(crate) fn weight_of_grain(case: &Case) -> Real {
    let first = case.grains.first();
    let density = first.and_then(|kind| case.material(&kind.material)).map_or(SAND, |material| material.density);
    let size = first.and_then(|kind| kind.shape.size()).unwrap_or(1e-3);
    submerged_weight(size, density, case.fluids.liquid.density, case.gravity.length()).abs()
}
