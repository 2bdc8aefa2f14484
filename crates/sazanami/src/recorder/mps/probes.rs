//! Probes: what happens at a point, along a line, to a grain, at a wave gauge.

use std::cell::OnceCell;

use sazanami_io::table::Value;
use sazanami_numerics::{Real, Vector};
use sazanami_observe::ripples::{Near, SurfaceProfile, Tank};

use super::fields::to_written_frame;
use super::sight::Sight;
use crate::assembly::grains::identifier;
use crate::case::meaning::{Case, ProbePlace};
use crate::clock::Clock;
use crate::recorder::RecordError;
use crate::recorder::columns::{Quantities, Quantity, missing};
use crate::recorder::files::Files;
use crate::simulation::Job;

/// Pressure and velocity.
const AT_POINT: [Quantity; 4] =
    [("pressure", "Pa"), ("velocity_1", "m/s"), ("velocity_2", "m/s"), ("velocity_3", "m/s")];
/// Motion of a grain and what acts on it.
const OF_BODY: [Quantity; 13] = [
    ("position_1", "m"),
    ("position_2", "m"),
    ("position_3", "m"),
    ("velocity_1", "m/s"),
    ("velocity_2", "m/s"),
    ("velocity_3", "m/s"),
    ("drag_1", "N"),
    ("drag_2", "N"),
    ("drag_3", "N"),
    ("pressure_force_1", "N"),
    ("pressure_force_2", "N"),
    ("pressure_force_3", "N"),
    ("void_fraction", ""),
];
const QUANTITIES: Quantities = Quantities { at_point: &AT_POINT, through_plane: &[], of_body: &OF_BODY };

/// What probes are read from.
struct Seen<'a> {
    tank: &'a Tank,
    sight: &'a Sight,
    /// Surface of the water, once it is asked for.
    surface: OnceCell<SurfaceProfile>,
}

/// Writes a row for every probe that is `due`.
pub(super) fn record(
    job: &Job,
    tank: &Tank,
    sight: &Sight,
    clock: &Clock,
    due: &[bool],
    files: &mut Files,
) -> Result<(), RecordError> {
    let seen = Seen { tank, sight, surface: OnceCell::new() };
    for (number, probe) in job.case.probes.iter().enumerate().filter(|&(number, _)| due[number]) {
        let mut row = vec![Value::Real(clock.time())];
        row.extend(measure(job.case, &seen, clock.time(), &probe.place));
        files.probe(number, &probe.name, || QUANTITIES.columns(&probe.place), clock, &row)?;
    }
    Ok(())
}

fn measure(case: &Case, seen: &Seen<'_>, time: Real, place: &ProbePlace) -> Vec<Value> {
    let &Seen { tank, sight, ref surface } = seen;
    match place {
        ProbePlace::Point(point) => at_points(case, tank, sight, time, &[*point]),
        ProbePlace::Line { from, to, points } => {
            let last = points.saturating_sub(1).max(1) as Real;
            let all: Vec<Vector> = (0..*points).map(|n| *from + (*to - *from) * (n as Real / last)).collect();
            at_points(case, tank, sight, time, &all)
        }
        ProbePlace::Body { population, index } => {
            let number = case.grains.iter().position(|kind| &kind.name == population).unwrap_or_default();
            of_body(case, sight, time, identifier(number, *index))
        }
        // The surface is a mean over the width.
        ProbePlace::Gauge([x, _]) => {
            let surface = surface.get_or_init(|| sight.surface(tank));
            vec![surface.at(*x).into()]
        }
        // Refused with the case.
        ProbePlace::Plane { .. } => Vec::new(),
    }
}

/// Means over the particles around each point, weighted by their volume and distance; nothing where there are too few.
fn at_points(case: &Case, tank: &Tank, sight: &Sight, time: Real, points: &[Vector]) -> Vec<Value> {
    let body_force = case.effective_gravity(time);
    let [_, drift] = to_written_frame(case, time);
    let around = sight.around(tank);
    let read = |near: &Near| -> [Value; AT_POINT.len()] {
        let pressure = near.mean(|n| sight.pressure(n, body_force));
        let [u1, u2, u3] = (near.mean(|n| sight.water.velocity[n]) + drift).to_array();
        [pressure, u1, u2, u3].map(Value::Real)
    };
    points.iter().flat_map(|&point| around.near(point).as_ref().map_or_else(missing, read)).collect()
}

fn of_body(case: &Case, sight: &Sight, time: Real, id: u64) -> Vec<Value> {
    let grains = &sight.grains;
    let Ok(n) = grains.id.binary_search(&id) else { return missing::<{ OF_BODY.len() }>().to_vec() };
    let [shift, drift] = to_written_frame(case, time);
    let vectors = [grains.position[n] + shift, grains.velocity[n] + drift, grains.drag[n], grains.pressure_force[n]];
    let mut row: Vec<Value> = vectors.iter().flat_map(|v| v.to_array()).map(Value::Real).collect();
    row.push(Value::Real(grains.void_fraction[n]));
    row
}
