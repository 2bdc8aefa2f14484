//! Pictures at output times: the tank seen from the side with grains coloured by speed, drag and pressure force, and the
//! water between them (as figure 3 of Tazaki et al.); of a tank without grains its water, coloured by speed and pressure.

use std::fmt::Write as _;

use sazanami_numerics::{Real, Vector};
use sazanami_observe::ripples::{SectionWindow, submerged_weight, vectors_in_section};

use super::ParticleObserver;
use crate::artist::{Colouring, Figure, SideView};
use crate::case::meaning::{COLOUR_FORCE, Case};
use crate::clock::Clock;
use crate::job::{Job, RecordError};
use crate::recorder::files::Files;

/// Part of the width of a tank, about its middle, in which grains are drawn; a thin slab hides nothing.
const SLAB: Real = 0.3;
/// Width of the window of arrows \[m].
const WINDOW: Real = 20e-3;
/// Distance of the arrows \[m].
const ARROWS: Real = 1e-3;
/// Room above what is highest \[m].
const ABOVE: Real = 5e-3;
/// Weight that stands for none \[N].
const NO_WEIGHT: Real = 1e-12;
/// Speed [m/s] and pressure \[Pa] that stand for none.
const SLOW: Real = 1e-3;
const NO_PRESSURE: Real = 1.0;
/// Density that force ranges are found with where a case has no grains [kg/m^3].
const SAND: Real = 2650.0;

/// Draws what the figures of a time are.
pub(super) fn draw(
    job: &Job,
    observer: &ParticleObserver,
    clock: &Clock,
    files: &mut Files,
) -> Result<(), RecordError> {
    let Some(artist) = job.options.artist else { return Ok(()) };
    let name = format!("{:09}", clock.step());
    let moment = moment(job.case, observer.period, clock.time());
    let grains = files.figure(&format!("grains-{name}.png"));
    let side = side_view(job.case, observer, &moment, job.case.effective_gravity([clock.time(); 2]));
    files.drawing.add(move || artist.draw(&Figure::Tank(&side), &grains));
    Ok(())
}

/// Caption of a time \[s] in pictures: with the phase of what swings, if it has a `period` \[s], and where it is and how
/// it accelerates, if it moves.
fn moment(case: &Case, period: Option<Real>, time: Real) -> String {
    let mut text = format!("t = {time:.3} s");
    if let Some(period) = period {
        let hundredths = (1e2 * time / period).round().rem_euclid(1e2);
        let _ = write!(text, ", phase {:.2}", 1e-2 * hundredths);
    }
    let [place, _, acceleration] = case.tank_at(time);
    let moves = |d: usize| place[d] != 0.0 || acceleration[d] != 0.0;
    for (d, name) in ["₁", "₂", "₃"].into_iter().enumerate().filter(|&(d, _)| moves(d)) {
        let (x, a) = (rounded(1e3 * place[d], 10.0), rounded(acceleration[d], 100.0));
        let _ = write!(text, ", tank x{name} = {x:.1} mm, a{name} = {a:.2} m/s²");
    }
    text.replace('-', "−")
}

/// A number in whole parts of which `parts` are one, zero without a sign.
fn rounded(value: Real, parts: Real) -> Real {
    (value * parts).round() / parts + 0.0
}

/// A number with two digits.
fn two_digits(value: Real) -> Real {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// The tank from the side: grains by speed, drag and pressure force, and the velocity of the water in a window.
fn side_view(case: &Case, observer: &ParticleObserver, moment: &str, body_force: Vector) -> SideView {
    let (lower, upper) = (case.domain.lower, case.domain.upper);
    let (discs, what, fastest) =
        if case.grains.is_empty() { of_water(observer, body_force) } else { of_grains(case, observer) };
    let Discs { position, diameter, panels } = discs;
    let water = observer.water.points_with_gaps().collect();
    let middle = 0.5 * (lower + upper);
    let half = (0.5 * SLAB * (upper.y - lower.y)).max(diameter.first().copied().unwrap_or_default());
    // Water and grains may stand above the open top of the box, and grains above the water.
    let surfaces = observer.water.points().map(|[_, z]| z);
    let discs = position.iter().zip(&diameter).map(|(place, diameter)| place.z + 0.5 * diameter);
    let top = surfaces.chain(discs).fold(lower.z, Real::max) + ABOVE;
    let x = [middle.x - 0.5 * WINDOW, middle.x + 0.5 * WINDOW];
    let arrows = arrows(observer, &SectionWindow { x, z: [lower.z, top], plane: middle.y, spacing: ARROWS });
    let share = (2e2 * half / (upper.y - lower.y)).min(100.0);
    SideView {
        title: format!("{}: {moment}", case.caption()),
        note: format!("{what}: middle {share:.0} % of the width; water surface: mean over the whole width"),
        x: [lower.x, upper.x],
        z: [lower.z, top],
        slab: [middle.y - half, middle.y + half],
        position,
        diameter,
        panels,
        water,
        window: x,
        arrows,
        reference: two_digits(2.0 * fastest),
    }
}

/// What is drawn as discs.
struct Discs {
    position: Vec<Vector>,
    diameter: Vec<Real>,
    panels: Vec<Colouring>,
}

/// Grains by speed, drag and pressure force, their name, and the speed of the last colour [m/s].
fn of_grains(case: &Case, observer: &ParticleObserver) -> (Discs, &'static str, Real) {
    let grains = &observer.gathered.grains;
    let speed: Vec<Real> = grains.velocity.iter().map(|v| v.length()).collect();
    let along = |forces: &[Vector]| forces.iter().map(|force| force.x).collect::<Vec<Real>>();
    let (fastest, part) =
        observer.settings.as_ref().map_or((0.1, COLOUR_FORCE), |ripples| (ripples.colour_speed, ripples.colour_force));
    let weight = weight_of_grain(case);
    let panels = vec![
        Colouring::Speed(speed, fastest),
        by_force("drag f_{d,x}", along(&grains.drag), part, weight),
        by_force("pressure force f_{p,x}", along(&grains.pressure_force), part, weight),
    ];
    (Discs { position: grains.position.clone(), diameter: grains.diameter.clone(), panels }, "grains", fastest)
}

/// The particles of water of a tank without grains by speed and pressure, as [`of_grains`]; colours go to the largest values.
fn of_water(observer: &ParticleObserver, body_force: Vector) -> (Discs, &'static str, Real) {
    let water = &observer.gathered.water;
    let speed: Vec<Real> = water.velocity.iter().map(|v| v.length()).collect();
    let largest = |values: &[Real]| values.iter().fold(0.0, |most: Real, value| most.max(value.abs()));
    let pressure: Vec<Real> = (0..speed.len()).map(|n| observer.gathered.pressure(n, body_force)).collect();
    let (fastest, highest) = (largest(&speed).max(SLOW), largest(&pressure).max(NO_PRESSURE));
    let panels =
        vec![Colouring::WaterSpeed(speed, fastest), Colouring::Signed(pressure, "pressure p [Pa]".to_owned(), highest)];
    let diameter = vec![observer.gathered.spacing; water.position.len()];
    (Discs { position: water.position.clone(), diameter, panels }, "particles of water", fastest)
}

/// Colours for forces \[N] on grains up to `part` of their submerged `weight` \[N], with a label that says how many go beyond.
fn by_force(name: &str, forces: Vec<Real>, part: Real, weight: Real) -> Colouring {
    // Grains as dense as water have no weight in it.
    let largest = part * if weight > 0.0 { weight } else { NO_WEIGHT };
    let beyond = forces.iter().filter(|force| force.abs() > largest).count();
    let percent = (1e2 * beyond as Real / forces.len().max(1) as Real).ceil();
    let ends = if weight > 0.0 { format!("colours to ±{part} W") } else { "colours of the sign".to_owned() };
    let label = format!("{name} [N], {ends}, {percent:.0} % of the grains beyond");
    Colouring::Signed(forces, label, largest)
}

/// Places and velocities of the water in a window, below its surface: a mean over what is near a place is one above the
/// surface too.
fn arrows(observer: &ParticleObserver, window: &SectionWindow) -> Vec<([Real; 2], [Real; 2])> {
    let gathered = &observer.gathered;
    let mut vectors = vectors_in_section(&gathered.around(&observer.tank), window, &gathered.water.velocity);
    vectors.retain(|&([x, z], _)| observer.water.at(x).is_some_and(|surface| z <= surface));
    vectors
}

/// Submerged weight of a grain of the first population \[N].
fn weight_of_grain(case: &Case) -> Real {
    let first = case.grains.first();
    let density = first.and_then(|kind| case.material(&kind.material)).map_or(SAND, |material| material.density);
    let size = first.and_then(|kind| Some(kind.shape.size()? * kind.usual_factor())).unwrap_or(1e-3);
    submerged_weight(size, density, case.fluid.liquid.density, case.resting_gravity().length()).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_have_no_sign_when_they_round_to_zero() {
        assert_eq!(format!("{:.1} {:.2}", rounded(-0.04, 10.0), rounded(-1.579, 100.0)), "0.0 -1.58");
    }
}
