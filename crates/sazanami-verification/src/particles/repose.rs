//! A bed under water that is tilted until it slides.

use sazanami_numerics::{Real, Vector};

use super::settled_bed::SettledBed;
use super::vessel::DIAMETER;
use super::vessel::{ExperimentError, GRAVITY, advance};
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{Forcing, Solver};
use sazanami_observe::fit::line;

/// Angle to which the bed is tilted fast, and how fast [rad, rad/s].
const FIRST: (Real, Real) = (0.26, 0.35);
/// Largest angle, at which water still covers the bed \[rad].
const LAST: Real = 0.7;
/// Mean speed of the upper grains along the bed that is a slide, and that is none any more, over `sqrt(g d)`.
const SLIDING: Real = 0.05;
const STILL: Real = 0.005;
/// Longest slide \[s].
const LONGEST: Real = 3.0;
/// Width of the columns in which the surface of the bed is found, in diameters.
const COLUMN: Real = 2.0;

/// Angles at which a bed begins and ceases to slide.
#[derive(Clone, Copy, Debug)]
pub struct Repose {
    /// Angle of the floor when the upper grains slide; not a number if they never do \[degrees].
    pub start: Real,
    /// Angle of the surface of the bed when they lie still again \[degrees].
    pub stop: Real,
    /// Duration of the slide \[s].
    pub seconds: Real,
    /// Way of the upper grains in the tilt before the slide, on the mean \[diameters].
    pub creep: Real,
    /// Largest mean speed of the upper grains in the slide over `sqrt(g d)`.
    pub speed: Real,
}

/// Body force in a box tilted by `angle` [m/s^2].
fn tilted(angle: Real) -> Forcing {
    Forcing { body_force: GRAVITY * Vector::new(angle.sin(), 0.0, -angle.cos()), ..Forcing::default() }
}

/// Mean velocity along x of the grains within two diameters below `top` [m/s].
fn speed(solver: &Solver, top: Real) -> Real {
    let grains = solver.grains().engine().grains();
    let upper = (0..grains.owned()).filter(|&g| grains.position[g].z > top - 2.0 * DIAMETER);
    let (sum, count) = upper.fold((0.0, 0.0), |(sum, count), g| (sum + grains.velocity[g].x, count + 1.0));
    sum / Real::max(count, 1.0)
}

/// Tops of the bed in columns along x, away from the ends: `(x, z)` \[m].
fn surface(solver: &Solver) -> Vec<(Real, Real)> {
    let grains = solver.grains().engine().grains();
    let length = solver.tank().upper.x;
    let columns = (length / (COLUMN * DIAMETER)).round();
    let mut tops = vec![0.0; columns as usize];
    for g in 0..grains.owned() {
        let at = (grains.position[g].x / length * columns) as usize;
        if let Some(top) = tops.get_mut(at) {
            *top = Real::max(*top, grains.position[g].z);
        }
    }
    let kept = tops.len() / 6..tops.len() - tops.len() / 6;
    kept.map(|n| ((n as Real + 0.5) / columns * length, tops[n])).collect()
}

/// A bed of `layers` diameters of spheres on a rough floor, in a box of `size` diameters, under water that covers it
/// at any angle, tilted by `rate` degrees a second.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn repose(scheme: Scheme, size: [usize; 2], layers: Real, rate: Real) -> Result<Repose, ExperimentError> {
    let rise = 0.5 * size[0] as Real * LAST.tan();
    let bed = SettledBed { scheme, size, layers, water: 0.7 * rise + 3.0, rise, glued: 0.75, ..SettledBed::default() };
    let mut solver = bed.solver()?;
    let rate = rate.to_radians();
    let [first, fast] = [FIRST.0, FIRST.1];
    let angle = |time: Real| if time < first / fast { fast * time } else { first + rate * (time - first / fast) };
    let scale = (GRAVITY * DIAMETER).sqrt();
    let tops = surface(&solver);
    let height = tops.iter().map(|p| p.1).sum::<Real>() / tops.len() as Real;
    // Judged every hundredth of a second.
    let (look, mut time, mut creep) = (0.01, 0.0, 0.0);
    loop {
        if angle(time) > LAST {
            return Ok(Repose { start: Real::NAN, stop: Real::NAN, seconds: 0.0, creep, speed: 0.0 });
        }
        advance(&mut solver, [time, time + look], |from, to| tilted(angle(0.5 * (from + to))), |_, _, _| ())?;
        time += look;
        let speed = speed(&solver, height);
        if angle(time) > first && speed > SLIDING * scale {
            break;
        }
        creep += speed * look / DIAMETER;
    }
    let (begin, start) = (time, angle(time));
    let mut largest: Real = 0.0;
    while time < begin + LONGEST {
        advance(&mut solver, [time, time + look], |_, _| tilted(start), |_, _, _| ())?;
        time += look;
        let speed = speed(&solver, height);
        largest = largest.max(speed / scale);
        if speed.abs() < STILL * scale {
            break;
        }
    }
    // Grains heap up towards +x: the surface is less steep than the floor.
    let slope = line(&surface(&solver)).map_or(Real::NAN, |line| line.slope);
    let stop = start - slope.atan();
    let [start, stop] = [start, stop].map(Real::to_degrees);
    Ok(Repose { start, stop, seconds: time - begin, creep, speed: largest })
}
