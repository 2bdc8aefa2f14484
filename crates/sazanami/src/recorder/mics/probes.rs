//! Probes: what happens at a point, along a line, through a plane, to a grain.

use sazanami_io::table::Value;
use sazanami_mics::solver::Solver;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};
use sazanami_posing::assembly::grains::named;

use crate::case::meaning::{Case, Probe, ProbePlace};
use crate::columns::{Cell, cells, missing, quantities};
use crate::recorder::columns::{GAUGE, ProbeColumns};
use crate::recorder::mics::liquid_share;

/// State of the fluid at a point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AtPoint {
    /// None where liquid has no room.
    liquid_fraction: Option<Real>,
    pressure: Real,
    velocity: Vector,
}

/// Fluxes and mean pressure on a plane.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ThroughPlane {
    volume_flux: Real,
    liquid_flux: Real,
    mean_pressure: Real,
}

/// Distance from faces of cells within which a plane lies in them, in cells.
const ON_FACE: Real = 1e-9;
/// Least share of liquid in a cell that does not end the liquid below it.
const LIQUID: Real = 0.5;

/// Motion of a grain and what acts on it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OfBody {
    position: Vector,
    velocity: Vector,
    spin: Vector,
    fluid_force: Vector,
    contact_force: Vector,
    fluid_torque: Vector,
}

/// Columns of the tables of probes.
pub(super) const COLUMNS: ProbeColumns<AtPoint, ThroughPlane, OfBody> =
    ProbeColumns { at_point: AT_POINT, through_plane: THROUGH_PLANE, of_body: OF_BODY };

const AT_POINT: &[Cell<AtPoint>] = quantities! {
    "liquid_fraction", "", "volume fraction C of the liquid; beside grains its share of the open part, empty where there is none (with `exchange = \"surface\"`)"
        => |at| at.liquid_fraction.into();
    "pressure", "Pa", "pressure; in a box without open sides its level has no meaning, differences have" => |at| at.pressure.into();
    "velocity_1", "m/s", "velocity along x1" => |at| at.velocity.x.into();
    "velocity_2", "m/s", "along x2" => |at| at.velocity.y.into();
    "velocity_3", "m/s", "along x3" => |at| at.velocity.z.into();
};

const THROUGH_PLANE: &[Cell<ThroughPlane>] = quantities! {
    "volume_flux", "m^3/s", "volume flux of all that goes through: liquid, gas and grains" => |at| at.volume_flux.into();
    "liquid_flux", "m^3/s", "volume flux of the liquid beside the grains, by the liquid fraction of the cell that it comes from: of a drop of 4 cells that passes 4.4 % too little, of 12 cells 0.06 %; a front counts from where it enters that cell, up to a cell early" => |at| at.liquid_flux.into();
    "mean_pressure", "Pa", "mean pressure on the plane" => |at| at.mean_pressure.into();
};

const OF_BODY: &[Cell<OfBody>] = quantities! {
    "position_1", "m", "position of the centre of mass, x1" => |at| at.position.x.into();
    "position_2", "m", "x2" => |at| at.position.y.into();
    "position_3", "m", "x3" => |at| at.position.z.into();
    "velocity_1", "m/s", "velocity along x1" => |at| at.velocity.x.into();
    "velocity_2", "m/s", "along x2" => |at| at.velocity.y.into();
    "velocity_3", "m/s", "along x3" => |at| at.velocity.z.into();
    "spin_1", "rad/s", "angular velocity along x1" => |at| at.spin.x.into();
    "spin_2", "rad/s", "along x2" => |at| at.spin.y.into();
    "spin_3", "rad/s", "along x3" => |at| at.spin.z.into();
    "fluid_force_1", "N", "force of the fluid along x1" => |at| at.fluid_force.x.into();
    "fluid_force_2", "N", "along x2" => |at| at.fluid_force.y.into();
    "fluid_force_3", "N", "along x3" => |at| at.fluid_force.z.into();
    "contact_force_1", "N", "mean force of all contacts over the step, zero before the first one, along x1" => |at| at.contact_force.x.into();
    "contact_force_2", "N", "along x2" => |at| at.contact_force.y.into();
    "contact_force_3", "N", "along x3" => |at| at.contact_force.z.into();
    "fluid_torque_1", "N m", "torque of the fluid along x1" => |at| at.fluid_torque.x.into();
    "fluid_torque_2", "N m", "along x2" => |at| at.fluid_torque.y.into();
    "fluid_torque_3", "N m", "along x3" => |at| at.fluid_torque.z.into();
};

/// Values of the probes that are `asked`. All ranks take part.
pub(super) fn read(case: &Case, solver: &Solver, time: Real, asked: &[bool]) -> Vec<Vec<Value>> {
    let found = |(probe, asked): (&Probe, &bool)| if *asked { measure(case, solver, time, probe) } else { Vec::new() };
    case.probes.iter().zip(asked).map(found).collect()
}

fn measure(case: &Case, solver: &Solver, time: Real, probe: &Probe) -> Vec<Value> {
    let domain = solver.domain();
    let written @ [_, drift] = case.to_written_frame(time);
    match &probe.place {
        ProbePlace::Point(point) => cells(AT_POINT, &at_point(solver, *point, drift)).collect(),
        ProbePlace::Line { from, to, points } => {
            let last = points.saturating_sub(1).max(1) as Real;
            let at = |n: usize| at_point(solver, *from + (*to - *from) * (n as Real / last), drift);
            (0..*points).flat_map(|n| cells(AT_POINT, &at(n)).collect::<Vec<_>>()).collect()
        }
        ProbePlace::Plane { direction, position } => {
            cells(THROUGH_PLANE, &through_plane(domain, solver, *direction, *position)).collect()
        }
        ProbePlace::Body { population, index } => match of_body(solver, named(case, population, *index), written) {
            Some(body) => cells(OF_BODY, &body).collect(),
            None => missing(OF_BODY).collect(),
        },
        ProbePlace::Gauge(place) => cells(&GAUGE, &Some(level(solver, *place))).collect(),
    }
}

/// Values interpolated linearly between cell centres and to the sides of the box. `drift` is the velocity of the tank in the frame that is
/// written [m/s]. All ranks take part.
fn at_point(solver: &Solver, point: Vector, drift: Vector) -> AtPoint {
    let domain = solver.domain();
    let grid = domain.grid();
    let place = ((point - grid.lower) / grid.spacing - 0.5).to_array();
    let low = place.map(|place| place.floor() as isize);
    // The layer behind a side holds what gives the side, half-way to it, its velocity and its pressure.
    let to_side = [0, 1, 2].map(|d| [1.0 - (place[d] - low[d] as Real), place[d] - low[d] as Real]);
    // Liquid is that of the cell; through periodic sides it goes on.
    let within = [0, 1, 2].map(|d| match low[d] {
        _ if domain.periodic()[d] => to_side[d],
        -1 => [0.0, 1.0],
        last if last == grid.cells[d] as isize - 1 => [1.0, 0.0],
        _ => to_side[d],
    });
    let around = around(solver, low);
    let mean = |value: usize, weights: [[Real; 2]; 3]| -> Real {
        let parts = around.iter().enumerate().map(|(corner, values)| {
            let weight: Real = (0..3).map(|d| weights[d][corner >> d & 1]).product();
            if weight > 0.0 { weight * values[value] } else { 0.0 }
        });
        parts.sum()
    };
    let [liquid, room] = [0, 1].map(|value| mean(value, within));
    let [u1, u2, u3] = [3, 4, 5].map(|value| mean(value, to_side));
    // Behind edges there is no pressure: the differences to the sides add up.
    let inside = mean(2, within);
    let towards = |d: usize| mean(2, std::array::from_fn(|e| if e == d { to_side[e] } else { within[e] })) - inside;
    let pressure = inside + (0..3).filter(|&d| to_side[d] != within[d]).map(towards).sum::<Real>();
    let liquid_fraction = if solver.has_open_room() { (room > 0.0).then(|| liquid / room) } else { Some(liquid) };
    AtPoint { liquid_fraction, pressure, velocity: Vector::new(u1, u2, u3) + drift }
}

/// Liquid and its room, in cell volumes, pressure and velocity in the eight cells from `low` on, of which the outermost lie behind the sides:
/// the rank gives them that has the cell before it.
fn around(solver: &Solver, low: [isize; 3]) -> [[Real; 6]; 8] {
    let (domain, layout) = (solver.domain(), solver.pressure());
    let (cells, start, all) = (domain.cells(), domain.start(), domain.grid().cells);
    let u = solver.flow().velocity.each_ref().map(Field::data);
    let mut found = [0.0; 48];
    for (corner, values) in found.chunks_exact_mut(6).enumerate() {
        let index = [0, 1, 2].map(|d| low[d] + (corner >> d & 1) as isize);
        let is_own = |d: usize| {
            let before = index[d].clamp(0, all[d] as isize - 1) - start[d] as isize;
            (0..cells[d] as isize).contains(&before)
        };
        if (0..3).all(is_own) {
            let [i, j, k] = [0, 1, 2].map(|d| index[d] - start[d] as isize);
            let at = layout.at(i, j, k);
            let [liquid, room] = solver.liquid_and_room(at);
            values.copy_from_slice(&[liquid, room, layout.data()[at], u[0][at], u[1][at], u[2][at]]);
        }
    }
    let found = domain.sum(found);
    std::array::from_fn(|corner| std::array::from_fn(|value| found[6 * corner + value]))
}

/// What goes through a plane: between faces of cells linear between them. All ranks take part.
fn through_plane(domain: &Domain, solver: &Solver, direction: usize, position: Real) -> ThroughPlane {
    let grid = domain.grid();
    let place = (position - grid.lower[direction]) / grid.spacing[direction];
    let face = |n: Real| through_faces(domain, solver, direction, grid.lower[direction] + n * grid.spacing[direction]);
    let (below, part) = (place.floor(), place - place.floor());
    if (place - place.round()).abs() < ON_FACE {
        return face(place.round());
    }
    let (low, high) = (face(below), face(below + 1.0));
    let between = |of: fn(&ThroughPlane) -> Real| (1.0 - part) * of(&low) + part * of(&high);
    ThroughPlane {
        volume_flux: between(|at| at.volume_flux),
        liquid_flux: between(|at| at.liquid_flux),
        mean_pressure: between(|at| at.mean_pressure),
    }
}

fn through_faces(domain: &Domain, solver: &Solver, direction: usize, position: Real) -> ThroughPlane {
    let grid = domain.grid();
    let mut range = domain.interior();
    let mut found = [0.0; 4];
    if let Some(local) = domain.faces_at(direction, position) {
        range[direction] = local..local + 1;
        let behind = -domain.strides()[direction];
        let flow = solver.flow();
        let (u, p) = (flow.face_velocity[direction].data(), solver.pressure().data());
        let grains = solver.grains();
        let carried = grains.covered().carried_through(domain, grains.engine().grains(), direction, local);
        found = domain.sum_rows(&range, |row| {
            let mut sum = [0.0; 4];
            for at in row.shifted(0) {
                let before = (at as isize + behind) as usize;
                let fluid = u[at] - carried.get(&at).copied().unwrap_or_default();
                let donor = if fluid > 0.0 { before } else { at };
                let entering = solver.entering_fraction(direction, row, at, u[at]);
                sum[0] += u[at];
                sum[1] += fluid * entering.or_else(|| liquid_share(solver, donor)).unwrap_or_default();
                sum[2] += 0.5 * (p[at] + p[before]);
                sum[3] += 1.0;
            }
            sum
        });
    }
    let [flux, liquid, pressure, count] = domain.sum(found);
    let area = grid.face_area(direction);
    ThroughPlane { volume_flux: flux * area, liquid_flux: liquid * area, mean_pressure: pressure / count.max(1.0) }
}

/// A grain, unless it has left; what leaves the frame of the tank for the one that is written is added.
fn of_body(solver: &Solver, id: u64, [shift, drift]: [Vector; 2]) -> Option<OfBody> {
    let grains = solver.grains().engine().grains();
    let mut found = [0.0; 19];
    let watched = solver.grains().engine().watched().iter().find(|(watched, _)| *watched == id);
    let contact_force = watched.map_or(Vector::ZERO, |(_, force)| *force);
    found[15..18].copy_from_slice(&contact_force.to_array());
    if let Ok(n) = grains.id[..grains.owned()].binary_search(&id) {
        let force = solver.grains().fluid_forces().get(n).copied().unwrap_or_default();
        let torque = solver.grains().fluid_torques().get(n).copied().unwrap_or_default();
        let vectors = [grains.position[n], grains.velocity[n], grains.angular_velocity(n), force, torque];
        for (to, from) in found.chunks_exact_mut(3).zip(vectors) {
            to.copy_from_slice(&from.to_array());
        }
        found[18] = 1.0;
    }
    let found = solver.domain().sum(found);
    let [position, velocity, spin, fluid_force, fluid_torque, contact_force] =
        [0, 1, 2, 3, 4, 5].map(|n| Vector::from_slice(&found[3 * n..]));
    let (position, velocity) = (position + shift, velocity + drift);
    let body = OfBody { position, velocity, spin, fluid_force, contact_force, fluid_torque };
    (found[18] > 0.0).then_some(body)
}

/// Height up to which liquid stands over a place on the floor, as the liquid in the column of cells would fill it up to the first gas, grains in it
/// too \[m]: what flies above does not count.
fn level(solver: &Solver, [x, y]: [Real; 2]) -> Real {
    let domain = solver.domain();
    let grid = domain.grid();
    let range = domain.interior();
    let mut depth = 0.0;
    if let Some([i, j, _]) = domain.cell_at(Vector::new(x, y, grid.lower.z)) {
        let layout = solver.pressure();
        let share = |k: isize| liquid_share(solver, layout.at(i, j, k));
        // What stands on the floor is part of the height; another cell without room has the share of the one below it.
        let mut below = 1.0;
        for k in range[2].clone() {
            let here = share(k).unwrap_or(below);
            if below < LIQUID && here > below {
                break;
            }
            depth += here;
            below = here;
        }
        depth *= grid.spacing.z;
    }
    let [depth] = domain.sum([depth]);
    grid.lower.z + depth
}
