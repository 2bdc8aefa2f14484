//! Checks of gates against the other tables of a case.

use sazanami_mps::gates::{self, MOST_GATES};
use sazanami_mps::scheme::ParticleProjection;
use sazanami_numerics::Real;

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::{BoundarySide, Particles};
use crate::units::{rounded, rounded_within};

/// Reports gates that the solver cannot have.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    let Some(first) = case.gates.first() else { return };
    let span = cx.places.at("gate.0");
    if case.solver == Solver::Mics {
        cx.report
            .error(span, "gates are for `solver = \"mps\"`")
            .label("this case has `solver = \"mics\"`")
            .help("leave out `[[gate]]`: on a grid water starts as it is posed, without a preparation");
        return;
    }
    let Some(particles) = &case.particles else { return };
    if particles.projection == ParticleProjection::Enhanced {
        let forced = ["particles.projection", "preset"];
        let place = forced.into_iter().find_map(|key| cx.places.of(key)).unwrap_or(span.clone());
        cx.report
            .error(place, "gates are for `projection = \"conjugate\"`")
            .label("the published scheme has walls of several layers of particles: a thin plate cannot be one")
            .help("write `projection = \"conjugate\"`, and leave out keys of the other; or leave out `[[gate]]`");
    }
    if case.walls_move() {
        cx.report
            .error(span.clone(), "gates stand in a tank at rest")
            .label("this one has walls that move")
            .help("leave out `walls` under `[frame]`: the fluid feels the acceleration of the tank");
    }
    if case.gates.len() > MOST_GATES {
        let place = cx.places.at(&format!("gate.{MOST_GATES}"));
        cx.report.error(place, format!("a tank has {MOST_GATES} gates at most")).label("one too many");
    }
    let direction = first.direction();
    if case.boundary[direction][0] == BoundarySide::Periodic {
        cx.report
            .error(span, format!("the gate `{}` separates nothing: x{} is periodic", first.name, direction + 1))
            .label("water flows round it through the periodic sides")
            .help(format!("make the sides of x{} walls", direction + 1));
    }
    let [floor, top] = case.boundary[2];
    if !matches!(floor, BoundarySide::NoSlip | BoundarySide::Slip)
        || matches!(top, BoundarySide::NoSlip | BoundarySide::Slip | BoundarySide::Periodic)
    {
        cx.report
            .error(cx.places.at("gate.0"), "gates stand on a floor, in a tank that is open above")
            .label("under a lid the water on one side of a gate may fill its part of the tank")
            .help("write `boundary.x3_upper = \"outflow\"` and a wall below");
    }
    check_places(case, cx, particles);
    check_room(case, cx, particles);
}

/// Gates stand between the particles of the lattice, and have names of their own.
fn check_places(case: &Case, cx: &mut Context<'_>, particles: &Particles) {
    for (n, gate) in case.gates.iter().enumerate() {
        let span = cx.places.at(&format!("gate.{n}"));
        let (lower, extent) = (case.domain.lower[gate.direction()], case.domain.extent()[gate.direction()]);
        let lattice = extent / (extent / particles.spacing).round().max(1.0);
        let number = (gate.place() - lower) / lattice;
        if (number - number.round()).abs() > 1e-6 {
            let nearest = rounded(1e3 * (lower + number.round() * lattice));
            cx.report
                .error(span.clone(), format!("`{}` stands within a layer of particles", gate.name))
                .label(format!("they are {} mm apart, the first half of it from the side", rounded(1e3 * lattice)))
                .help(format!("write `x{} = \"{nearest} mm\"`", gate.direction() + 1));
        }
        if case.gates[..n].iter().any(|other| other.name == gate.name) {
            cx.report
                .error(span, format!("two gates are called `{}`", gate.name))
                .label("messages refer to gates by name");
        }
    }
}

/// The room that a particle needs to see one plane at a time, between gates, and between gates and walls.
fn check_room(case: &Case, cx: &mut Context<'_>, particles: &Particles) {
    let reach = particles.radius * particles.spacing;
    let room = match &case.grains[..] {
        [] => gates::room(reach, 0.0),
        _ => gates::room(reach / case.overlap.least_void.cbrt(), case.overlap.smoothing),
    };
    let [needed, _] = rounded_within(1e3 * room, Real::INFINITY);
    let direction = case.gates[0].direction();
    let (lower, upper) = (case.domain.lower[direction], case.domain.upper[direction]);
    for (n, gate) in case.gates.iter().enumerate() {
        let span = cx.places.at(&format!("gate.{n}"));
        if gate.direction() != direction {
            cx.report
                .error(span, format!("`{}` and `{}` meet", case.gates[0].name, gate.name))
                .label("gates over the whole width are normal to one direction")
                .help(format!("give `x{}` instead", direction + 1));
            continue;
        }
        let near = |distance: Real| distance < room * (1.0 - 1e-9);
        let other = case.gates[..n].iter().find(|other| near((other.place() - gate.place()).abs()));
        let what = if let Some(other) = other {
            format!("`{}` and `{}` are too near to each other", other.name, gate.name)
        } else if near(gate.place() - lower) || near(upper - gate.place()) {
            format!("`{}` is too near to a wall", gate.name)
        } else {
            continue;
        };
        cx.report
            .error(span, what)
            .label(format!("it has to be {needed} mm away: two radii of influence, or of the void fraction"))
            .help("move it, or take smaller particles and grains");
    }
}
