//! Probes: what happens at a point, along a line, to a grain, at a wave gauge.

use sazanami_io::table::Value;
use sazanami_numerics::{Real, Vector};
use sazanami_observe::ripples::TankInside;
use sazanami_posing::assembly::grains::named;

use super::gathered::GatheredTank;
use crate::case::meaning::{BoundarySide, Case, Probe, ProbePlace};
use crate::columns::{Cell, cells, missing, quantities};
use crate::recorder::columns::{GAUGE, ProbeColumns};

/// State of the fluid at a point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AtPoint {
    /// None before the first step.
    pressure: Option<Real>,
    velocity: Vector,
}

/// Motion of a grain and what acts on it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OfBody {
    position: Vector,
    velocity: Vector,
    spin: Vector,
    contact_force: Vector,
    drag: Vector,
    pressure_force: Vector,
    lift: Vector,
    added_mass_force: Vector,
    void_fraction: Real,
}

/// Columns of the tables of probes.
pub(super) const COLUMNS: ProbeColumns<AtPoint, (), OfBody> =
    ProbeColumns { at_point: AT_POINT, through_plane: &[], of_body: OF_BODY };

const AT_POINT: &[Cell<AtPoint>] = quantities! {
    "pressure", "Pa", "pressure; none before a step has solved for it" => |at| at.pressure.into();
    "velocity_1", "m/s", "velocity of the water along x1" => |at| at.velocity.x.into();
    "velocity_2", "m/s", "along x2" => |at| at.velocity.y.into();
    "velocity_3", "m/s", "along x3" => |at| at.velocity.z.into();
};

const OF_BODY: &[Cell<OfBody>] = quantities! {
    "position_1", "m", "position of the centre, x1" => |at| at.position.x.into();
    "position_2", "m", "x2" => |at| at.position.y.into();
    "position_3", "m", "x3" => |at| at.position.z.into();
    "velocity_1", "m/s", "velocity along x1" => |at| at.velocity.x.into();
    "velocity_2", "m/s", "along x2" => |at| at.velocity.y.into();
    "velocity_3", "m/s", "along x3" => |at| at.velocity.z.into();
    "spin_1", "rad/s", "angular velocity along x1" => |at| at.spin.x.into();
    "spin_2", "rad/s", "along x2" => |at| at.spin.y.into();
    "spin_3", "rad/s", "along x3" => |at| at.spin.z.into();
    "contact_force_1", "N", "mean force of all contacts over the step, zero before the first one, along x1" => |at| at.contact_force.x.into();
    "contact_force_2", "N", "along x2" => |at| at.contact_force.y.into();
    "contact_force_3", "N", "along x3" => |at| at.contact_force.z.into();
    "drag_1", "N", "drag along x1" => |at| at.drag.x.into();
    "drag_2", "N", "along x2" => |at| at.drag.y.into();
    "drag_3", "N", "along x3" => |at| at.drag.z.into();
    "pressure_force_1", "N", "force of the pressure, buoyancy included, along x1" => |at| at.pressure_force.x.into();
    "pressure_force_2", "N", "along x2" => |at| at.pressure_force.y.into();
    "pressure_force_3", "N", "along x3" => |at| at.pressure_force.z.into();
    "lift_1", "N", "lift along x1" => |at| at.lift.x.into();
    "lift_2", "N", "along x2" => |at| at.lift.y.into();
    "lift_3", "N", "along x3" => |at| at.lift.z.into();
    "added_mass_force_1", "N", "force by which the added mass resists, along x1" => |at| at.added_mass_force.x.into();
    "added_mass_force_2", "N", "along x2" => |at| at.added_mass_force.y.into();
    "added_mass_force_3", "N", "along x3" => |at| at.added_mass_force.z.into();
    "void_fraction", "", "void fraction around the grain, without its own share" => |at| at.void_fraction.into();
};

/// Source of the probes' values.
struct View<'a> {
    tank: &'a TankInside,
    gathered: &'a GatheredTank,
    has_pressure: bool,
}

/// Values of the probes that are `asked`, of the water whose pressure is known if it `has_pressure`.
pub(super) fn read(
    case: &Case,
    tank: &TankInside,
    (gathered, has_pressure): (&GatheredTank, bool),
    time: Real,
    asked: &[bool],
) -> Vec<Vec<Value>> {
    let view = View { tank, gathered, has_pressure };
    let found =
        |(probe, asked): (&Probe, &bool)| if *asked { measure(case, &view, time, &probe.place) } else { Vec::new() };
    case.probes.iter().zip(asked).map(found).collect()
}

fn measure(case: &Case, view: &View<'_>, time: Real, place: &ProbePlace) -> Vec<Value> {
    let &View { tank, gathered, .. } = view;
    match place {
        ProbePlace::Point(point) => at_points(case, view, time, &[*point]),
        ProbePlace::Line { from, to, points } => {
            let last = points.saturating_sub(1).max(1) as Real;
            let all: Vec<Vector> = (0..*points).map(|n| *from + (*to - *from) * (n as Real / last)).collect();
            at_points(case, view, time, &all)
        }
        ProbePlace::Body { population, index } => of_body(case, gathered, time, named(case, population, *index)),
        ProbePlace::Gauge(place) => cells(&GAUGE, &gathered.level_at(tank, *place)).collect(),
        // Refused with the case.
        ProbePlace::Plane { .. } => Vec::new(),
    }
}

/// Means over the particles around each point, weighted by their volume and distance; nothing where there are too few.
fn at_points(case: &Case, view: &View<'_>, time: Real, points: &[Vector]) -> Vec<Value> {
    let &View { tank, gathered, has_pressure, .. } = view;
    let body_force = case.effective_gravity([time; 2]);
    let [_, drift] = case.to_written_frame(time);
    let around = gathered.around(tank);
    // Across a wall the pressure grows as in fluid at rest in the tank: less that it does not change there. Along periodic sides there is no
    // such growth.
    let held = Vector::from_array(case.periodic().map(|periodic| if periodic { 0.0 } else { 1.0 }));
    let of_tank = if case.walls_move() { case.tank_at(time)[2] } else { Vector::ZERO };
    let weight = case.fluid.liquid.density * (body_force - of_tank) * held;
    let [x, y, z] = &case.boundary;
    let between_walls = !x.iter().chain(y).chain([&z[0]]).any(BoundarySide::is_open) && !case.periodic()[2];
    let read = |point: Vector| {
        let near = if between_walls { around.near_with_images(point) } else { around.near(point) };
        let at_rest = |n: usize| gathered.pressure(n, body_force) + weight.dot(point - gathered.water.position[n]);
        Some(AtPoint {
            pressure: has_pressure.then_some(near?.mean(at_rest)),
            velocity: around.near(point)?.mean(|n| gathered.water.velocity[n]) + drift,
        })
    };
    let row = |at: Option<AtPoint>| -> Vec<Value> {
        at.map_or_else(|| missing(AT_POINT).collect(), |at| cells(AT_POINT, &at).collect())
    };
    points.iter().flat_map(|&point| row(read(point))).collect()
}

fn of_body(case: &Case, gathered: &GatheredTank, time: Real, id: u64) -> Vec<Value> {
    let grains = &gathered.grains;
    let Ok(n) = grains.id.binary_search(&id) else { return missing(OF_BODY).collect() };
    let [shift, drift] = case.to_written_frame(time);
    let body = OfBody {
        position: grains.position[n] + shift,
        velocity: grains.velocity[n] + drift,
        spin: grains.spin[n],
        contact_force: gathered
            .watched
            .iter()
            .find(|(watched, _)| *watched == id)
            .map_or(Vector::ZERO, |(_, force)| *force),
        drag: grains.drag[n],
        pressure_force: grains.pressure_force[n],
        lift: grains.lift[n],
        added_mass_force: grains.added_mass_force[n],
        void_fraction: grains.void_fraction[n],
    };
    cells(OF_BODY, &body).collect()
}
