//! Checks across the tables of a case.

use sazanami_dem::Motion;
use sazanami_mics::advection::Convection;
use sazanami_mics::grains::Exchange;
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::{Real, Vector};

use crate::bridges;
use crate::case::Case;
use crate::driven;
use crate::entry_pressure;
use crate::followed;
use crate::liquids_at_walls;
use crate::plausible;
use crate::presets::Solver;
use crate::read::Context;
use crate::surface_tension;
use crate::tables::{
    BoundarySide, Feed, Follows, Gate, GrainPlacement, OutputFrame, Population, PressureForm, ProbePlace, RunEnd,
    TankMotion, place_of_side,
};
use crate::units::rounded;

/// Reports what does not fit together across the tables of a case.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    if case.fluid.pressure_form == PressureForm::Incremental && !case.liquids.is_empty() {
        let span = cx.places.of("fluid.pressure_form");
        cx.report
            .warning(span, "incremental projection with two fluids")
            .label("the pressure of the step before has its jump where the interface was then")
            .help("`pressure_form = \"full\"` follows the interface");
    }
    if case.run.packing_only && !case.packs() && !cx.known.is_damaged {
        let span = cx.places.of("run").unwrap_or(0..0);
        cx.report
            .error(span, "there is nothing to pack")
            .label("`packing_only` needs grains with `placement.packed`")
            .help("leave out `packing_only`, or add `placement.packed = {}` to the grains");
    }
    check_late_outputs(case, cx);
    check_end_of_motion(case, cx);
    check_gauges(case, cx);
    check_falls(case, cx);
    check_beds(case, cx);
    check_heap(case, cx);
    plausible::check(case, cx);
    check_keys_of_the_grid(case, cx);
    check_rest(case, cx);
    check_carrying_flow(case, cx);
    check_written_frame(case, cx);
    check_room(case, cx);
    check_floor(case, cx);
    check_packing(case, cx);
    check_feeds(case, cx);
    surface_tension::check(case, cx);
    entry_pressure::check(case, cx);
    bridges::check(case, cx);
    followed::check(case, cx);
    driven::check(case, cx);
    driven::check_fall(case, cx);
    liquids_at_walls::check(case, cx);
    liquids_at_walls::check_beside_gas(case, cx);
    liquids_at_walls::check_dry_baths(case, cx);
}

/// Whether gravity, if there is any, points elsewhere than to the floor at x3_lower.
fn falls_elsewhere(case: &Case) -> bool {
    let down = -case.resting_gravity();
    down.z < 0.5 * down.length()
}

/// Warns of what is measured of beds where grains do not lie on the floor.
fn check_beds(case: &Case, cx: &mut Context<'_>) {
    // Where grains are packed across gravity that is refused.
    if !falls_elsewhere(case) || packs_across(case) {
        return;
    }
    for (table, what) in [("bed", "a bed is"), ("heap", "a heap is"), ("erosion", "a crater is")] {
        // Copies of cases name `[bed]` without a bed too.
        if let Some(span) = cx.places.of(table).filter(|_| table != "bed" || case.has_bed()) {
            cx.report
                .warning(Some(span), format!("{what} measured along x3, and gravity points elsewhere"))
                .label("it is seen from x3_upper, over the floor at x3_lower")
                .help(format!("let gravity point along -x3, or leave out `[{table}]`"));
        }
    }
}

/// Tilt of gravity from which on the angle of a heap against the floor of its box is told to be that.
const LEVEL: Real = 0.017;

/// Warns of heaps in a box that is tilted.
fn check_heap(case: &Case, cx: &mut Context<'_>) {
    let gravity = case.resting_gravity();
    let tilt = gravity.x.hypot(gravity.y).atan2(-gravity.z);
    let falls = gravity != Vector::ZERO && !falls_elsewhere(case);
    if let Some(span) = cx.places.of("heap").filter(|_| falls && tilt > LEVEL) {
        cx.report
            .warning(Some(span), "the angle of the heap is that against the floor of its box")
            .label(format!("gravity slants by {} degrees against x3", rounded(tilt.to_degrees())))
            .help("add its slope along the flank, or take it off");
    }
}

/// Warns of gauges where liquid does not lie on the floor.
fn check_gauges(case: &Case, cx: &mut Context<'_>) {
    for (number, probe) in case.probes.iter().enumerate() {
        if matches!(probe.place, ProbePlace::Gauge(_)) && falls_elsewhere(case) {
            cx.report
                .warning(
                    cx.places.of(&format!("probe.{number}.gauge")),
                    "a gauge measures along x3, and gravity points elsewhere",
                )
                .label("it gives the height up to which liquid stands over the floor at x3_lower")
                .help("let gravity point along -x3, or take points or planes");
        }
    }
}

/// Warns of falls that gravity does not make.
fn check_falls(case: &Case, cx: &mut Context<'_>) {
    for (number, liquid) in case.liquids.iter().enumerate().filter(|_| falls_elsewhere(case)) {
        if let Some(span) = cx.places.of(&format!("liquid.{number}.fall")) {
            let [x, y, z] = liquid.velocity.to_array().map(rounded);
            cx.report
                .warning(Some(span), "a fall leads along -x3, and gravity points elsewhere")
                .label(format!("this liquid begins with the velocity ({x}, {y}, {z}) m/s"))
                .help("let gravity point along -x3, or give the `velocity`");
        }
    }
}

/// Part of the largest speed of a recorded motion at which it has come to rest.
const AT_REST: Real = 1e-3;

/// Warns of a recorded motion that ends before the run and not at rest.
fn check_end_of_motion(case: &Case, cx: &mut Context<'_>) {
    let Some(TankMotion::File { curve, peaks, .. }) = case.frame.as_ref().and_then(|frame| frame.motion.as_ref())
    else {
        return;
    };
    let end = curve.range()[1];
    let speed = curve.at(end)[1];
    // Moving particles refuse it.
    if case.solver == Solver::Mics && case.run.until > end && speed.abs() > AT_REST * peaks[0].value {
        cx.report
            .warning(cx.places.of("frame.motion.file"), "the motion of the tank ends before the run")
            .label(format!("its last time is {} s, and the box goes on at {} m/s", rounded(end), rounded(speed)))
            .help("give a longer record, or end the run with it");
    }
}

/// Warns of outputs that are asked for after the end of the run.
fn check_late_outputs(case: &Case, cx: &mut Context<'_>) {
    let (end, output) = (case.run.until, &case.output);
    if case.run.packing_only || end.is_nan() {
        return;
    }
    let own = [
        ("fields", &output.fields),
        ("grains", &output.grains),
        ("figures", &output.figures),
        ("series", &output.series),
    ];
    let own = own.map(|(name, schedule)| (format!("output.{name}.at"), schedule));
    let probes = case.probes.iter().enumerate().map(|(n, probe)| (format!("probe.{n}.at"), &probe.schedule));
    for (key, schedule) in own.into_iter().chain(probes) {
        let late = schedule.at.iter().filter(|&&time| time > end * (1.0 + 1e-9)).count();
        if let Some(place) = cx.places.of(&key).filter(|_| late > 0) {
            cx.report
                .warning(Some(place), format!("{late} of {} times lie after the end of the run", schedule.at.len()))
                .label(format!("the run ends at {} s", rounded(end)))
                .help("leave them out, or raise `run.until`; `sazanami resume --until` goes on to them");
        }
    }
}

/// Only a crater comes to rest, and only where the series follows it.
fn check_rest(case: &Case, cx: &mut Context<'_>) {
    if case.run.end != RunEnd::Rest {
        return;
    }
    if case.erosion.is_none() || case.solver == Solver::Mps {
        cx.report
            .error_at(cx.places.near("run.until"), "`until = \"rest\"` without a crater")
            .label("it waits for the crater that `[erosion]` evaluates with `solver = \"mics\"`")
            .help("give the time at which the run ends");
    }
    let series = &case.output.series;
    let never = series.every.is_none() && series.steps.is_none();
    if never || series.every.is_some_and(|every| every > SLOWEST_ROWS) {
        cx.report
            .error_at(cx.places.near("output.series"), "rows of the series too far apart for `until = \"rest\"`")
            .label("whether a crater rests is judged by eight rows within 10 ms")
            .help(format!("give `output.series.every` as {} s at most", SLOWEST_ROWS));
    }
}

/// Longest time between rows of the series of a run until rest \[s]: eight in 10 ms.
const SLOWEST_ROWS: Real = 1.25e-3;

/// Keys of the fluid on the grid do nothing to moving particles. A case with `domain.cells` is for both solvers, or the copy of a case; so are
/// keys that stand beside their counterparts.
fn check_keys_of_the_grid(case: &Case, cx: &mut Context<'_>) {
    if case.solver != Solver::Mps || cx.places.of("domain.cells").is_some() {
        return;
    }
    let steps = ["particles.dt", "particles.dt_max"];
    let counterparts: [(&str, &[&str], Option<&str>); 9] = [
        ("dt", &steps, Some("dt")),
        ("dt_max", &steps, Some("dt_max")),
        ("dt_first", &steps, None),
        ("dt_growth", &steps, None),
        ("cfl", &["particles.courant"], Some("courant")),
        ("tol_div", &["particles.tolerance"], Some("tolerance")),
        ("pressure_iterations", &["particles.pressure_iterations"], Some("pressure_iterations")),
        ("convection", &[], None),
        ("pressure_form", &[], None),
    ];
    let mut idle: Vec<(&str, String)> = Vec::new();
    for (key, beside, meant) in counterparts {
        if beside.iter().all(|other| cx.places.of(other).is_none()) {
            idle.push((key, meant.map_or("leave it out".into(), |meant| format!("the key is `particles.{meant}`"))));
        }
    }
    if case.fluid.viscosity == ViscosityScheme::Off {
        idle.push(("viscosity", "write `fluid.liquid.kinematic_viscosity = \"0 m^2/s\"`".to_owned()));
    }
    if case.fluid.carrying_flow.is_some() {
        idle.push(("carrying_flow", "give `fluid.initial_velocity`, or leave this out".to_owned()));
    }
    for (key, help) in idle {
        if let Some(span) = cx.places.of(&format!("fluid.{key}")) {
            cx.report
                .warning(Some(span), format!("`fluid.{key}` does nothing with `solver = \"mps\"`"))
                .label("it is for the fluid on a grid")
                .help(help);
        }
    }
}

/// Requires a displacement of the tank for output in the laboratory, whose place follows from nothing else.
fn check_written_frame(case: &Case, cx: &mut Context<'_>) {
    let Some(frame) = case.frame.as_ref().filter(|_| case.output.frame == OutputFrame::Laboratory) else { return };
    if frame.oscillation.is_some() || frame.acceleration != Vector::ZERO {
        cx.report
            .error_at(cx.places.near("output.frame"), "the position of the box in the laboratory is not known")
            .label("an acceleration determines neither initial position nor initial velocity")
            .help("write the motion as `frame.motion`, or leave out `output.frame`");
    }
    if frame.follows != Follows::Nothing {
        cx.report
            .error_at(cx.places.near("output.frame"), "a box that follows is written as it is")
            .label("positions and velocities are those against the box, whose own the series has")
            .help("leave out `output.frame`");
    }
}

/// Liquid in the open part of the cells is carried, and given to the grains, in one way only.
fn check_room(case: &Case, cx: &mut Context<'_>) {
    if case.coupling.exchange != Exchange::Surface || case.grains.is_empty() || case.solver != Solver::Mics {
        return;
    }
    if case.fluid.convection == Convection::VelocityForm {
        cx.report
            .error_at(cx.places.near("fluid.convection"), "`exchange = \"surface\"` and `convection = \"velocity_form\"`")
            .label("surfaces leave liquid the open part of cells and carry momentum with the mass fluxes, which the velocity form does not use")
            .help("choose `fluid.convection = \"consistent\"`, or `coupling.exchange = \"stress\"`");
    }
}

/// A flow that is given carries liquid alone, and crosses no wall.
fn check_carrying_flow(case: &Case, cx: &mut Context<'_>) {
    let Some(carrying) = case.fluid.carrying_flow.filter(|_| case.solver == Solver::Mics) else { return };
    let span = cx.places.near("fluid.carrying_flow").unwrap_or(0..0);
    if !case.grains.is_empty() {
        cx.report
            .error(span.clone(), "a carrying flow and grains")
            .label("a prescribed flow has no forces: grains would not feel it")
            .help("leave out `carrying_flow`, or the grains");
    }
    if case.fluid.initial_velocity.is_some() {
        cx.report
            .error(span.clone(), "a carrying flow and an initial velocity")
            .label("the velocity is that of this flow from the start")
            .help("leave out one of the two");
    }
    let is_inflow = |side: &BoundarySide| matches!(side, BoundarySide::Inflow { .. });
    if let Some(d) = (0..3).find(|&d| case.boundary[d].iter().any(is_inflow)) {
        cx.report
            .error(span.clone(), format!("a carrying flow and an inflow at a side of x{}", d + 1))
            .label("the velocity at the sides is that of this flow")
            .help(format!("make the side of x{} \"outflow\"", d + 1));
    }
    let crossed = carrying.crosses_sides();
    if let Some(d) = (0..3).find(|&d| crossed[d] && case.boundary[d].iter().any(BoundarySide::is_wall)) {
        cx.report
            .error(span, format!("the carrying flow goes through a wall at a side of x{}", d + 1))
            .label("it has a velocity there")
            .help(format!("make x{} \"periodic\", or its sides \"outflow\"", d + 1));
    }
}

/// Largest solid fraction of a stream of grains that are fed in.
const DENSEST_FEED: Real = 0.2;

/// Grains are fed in through sides that hold none back, no faster than there is room for them.
fn check_feeds(case: &Case, cx: &mut Context<'_>) {
    for (n, population) in case.grains.iter().enumerate() {
        let GrainPlacement::Fed(feed) = &population.placement else { continue };
        let place = |key: &str| format!("grains.{n}.placement.fed.{key}");
        let [direction, upper] = feed.side.place();
        let side = feed.side.text();
        if case.holds_grains(direction, upper) || case.periodic()[direction] {
            let span = cx.places.near(&place("side")).unwrap_or(0..0);
            cx.report
                .error(span, format!("grains cannot be fed in through {side}"))
                .label("it is a wall for grains, or periodic")
                .help(format!(
                    "open it, `boundary.{side} = \"outflow\"` or an inflow, and leave it out of `dem.grain_walls`"
                ));
        }
        if case.walls_move() {
            let span = cx.places.near(&place("side")).unwrap_or(0..0);
            cx.report
                .error(span, "a tank that is moved is fed no grains")
                .label("its sides are elsewhere when they come")
                .help(
                    "leave out `walls`, so that the box stands and its frame moves, or put the grains in at the start",
                );
        }
        let extent = population.shape.extent().unwrap_or(0.0) * population.sizes().largest();
        let part = feed.upper - feed.lower;
        let [a, b] = [(direction + 1) % 3, (direction + 2) % 3];
        // With the way that they go across while they are carried in.
        let needed = |d: usize| extent * (1.0 + (feed.velocity[d] / feed.inward()).abs());
        if let Some(d) = [a, b].into_iter().find(|&d| part[d] < needed(d) && !case.periodic()[d]) {
            let span = cx.places.near(&place("upper")).unwrap_or(0..0);
            cx.report
                .error(span, format!("the grains are wider than the part of {side} through which they come"))
                .label(format!(
                    "{} mm along x{}, they need {} mm",
                    rounded(1e3 * part[d]),
                    d + 1,
                    rounded(1e3 * needed(d))
                ))
                .help("feed them through a larger part");
            continue;
        }
        let least = population.shape.extent().unwrap_or(0.0) * population.sizes().smallest();
        if let Some(gate) = case.gates.iter().find(|gate| fills_feed(gate, feed, least, case)) {
            let span = cx.places.near(&place("upper")).unwrap_or(0..0);
            cx.report
                .error(span, format!("the grains have no way in beside the gate `{}`", gate.name))
                .label(format!("it stands in the part of {side} through which they come until the run ends"))
                .help("feed them through a larger part, or let the gate open before");
        }
        let volume = population.shape.volume().unwrap_or(0.0) * population.sizes().mean_cube();
        let solid = feed.rate * volume / (part[a] * part[b] * feed.inward());
        if solid > DENSEST_FEED {
            let span = cx.places.near(&place("rate")).unwrap_or(0..0);
            cx.report
                .error(span, format!("more grains are fed in than have room in {side}"))
                .label(format!(
                    "they fill {} of the stream that comes in at {} m/s",
                    rounded(solid),
                    rounded(feed.inward())
                ))
                .help(format!(
                    "take {} Hz at most, or feed them in faster or through a larger part",
                    rounded(feed.rate * DENSEST_FEED / solid)
                ));
        }
    }
}

/// Whether a gate leaves grains of this `extent` \[m] no place in the part of a side through which they come, as long as the run
/// lasts.
fn fills_feed(gate: &Gate, feed: &Feed, extent: Real, case: &Case) -> bool {
    let ([direction, _], d) = (feed.side.place(), gate.direction());
    let across = [gate.place() - feed.lower[d], feed.upper[d] - gate.place()];
    let [low, high] = if direction == 2 { [case.domain.upper.z; 2] } else { [feed.lower.z, feed.upper.z] };
    let stands = gate.opens >= case.run.until && gate.bottom <= low + 0.5 * extent && gate.top >= high - 0.5 * extent;
    d != direction && stands && across.iter().all(|part| *part < extent)
}

/// Grains that are packed, and beds that are free, lie on the lower side of x3; they are packed downwards.
fn check_floor(case: &Case, cx: &mut Context<'_>) {
    let lies = |population: &&Population| match &population.placement {
        GrainPlacement::Packed(_) => true,
        GrainPlacement::Bed(_) => population.motion == Motion::Free,
        GrainPlacement::Lattice(_) | GrainPlacement::List(_) | GrainPlacement::Fed(_) => false,
    };
    if let Some(population) = case.grains.iter().find(lies).filter(|_| !case.holds_grains(2, 0)) {
        let span = place_of_side(&cx.places, 2, 0);
        cx.report
            .error_at(span, format!("`{}` has no floor below it", population.name))
            .label("the side x3_lower is no wall for grains")
            .help("make `x3_lower` \"no_slip\" or \"slip\"");
    }
    if packs_across(case) {
        let span = cx.places.of("gravity");
        cx.report
            .error_at(span, "gravity does not press these grains onto the floor")
            .label("its largest part has to point down x3")
            .help("write `gravity = \"9.8 m/s^2\"`, which points down by itself");
    } else if case.packs() && case.packing_gravity() <= 0.0 {
        cx.report
            .error_at(
                cx.places.near("frame.acceleration"),
                "the acceleration of the box lifts these grains off the floor",
            )
            .label("gravity less this acceleration has to point down x3")
            .help("leave out its part along x3, or make it smaller");
    }
}

/// Whether grains are packed where gravity does not press them onto the floor.
fn packs_across(case: &Case) -> bool {
    case.packs() && -case.gravity.z <= case.gravity.x.hypot(case.gravity.y)
}

/// Warns of beds that are packed straight down where gravity slants, and of keys of the packing of all that a later population gives.
fn check_packing(case: &Case, cx: &mut Context<'_>) {
    let gravity = case.resting_gravity();
    let across = gravity.x.hypot(gravity.y);
    // Levelled beds, and those of tanks, come to rest under gravity as it is.
    let rests = if case.solver == Solver::Mps { case.preparation.settle > 0.0 } else { case.levels() };
    if case.packs() && !case.run.packing_only && !rests && across > STRAIGHT * case.packing_gravity() {
        let slope = (across / case.packing_gravity()).atan().to_degrees();
        let key = if case.frame.as_ref().is_some_and(|frame| frame.acceleration != Vector::ZERO) {
            "frame.acceleration"
        } else {
            "gravity"
        };
        let help = match case.solver {
            Solver::Mics => "give `placement.packed.level`: the levelled bed comes to rest under gravity as it is",
            Solver::Mps => "give `preparation.settle`: the bed comes to rest under gravity as it is",
        };
        cx.report
            .warning(cx.places.near(key), "the bed is packed straight down, and gravity in its box slants")
            .label(format!("by {} degrees against x3, from the start of the run on", rounded(slope)))
            .help(help);
    }
    let mut packed = case.grains.iter().enumerate().filter_map(|(n, population)| match &population.placement {
        GrainPlacement::Packed(how) => Some((n, &population.name, how)),
        _ => None,
    });
    let Some((_, first, all)) = packed.next() else { return };
    for (n, name, how) in packed {
        let differs = [
            ("lattice", how.lattice != all.lattice),
            ("spacing", how.spacing != all.spacing),
            ("jitter", how.jitter != all.jitter),
            ("fall_gravity", how.fall_gravity != all.fall_gravity),
            ("settle_time", how.settle_time != all.settle_time),
            ("stop", how.stop != all.stop),
            ("mean_speed", how.mean_speed != all.mean_speed),
            ("energy_ratio", how.energy_ratio != all.energy_ratio),
            ("friction_scale", how.friction_scale != all.friction_scale),
            ("time_limit", how.time_limit != all.time_limit),
        ];
        for (key, _) in differs.into_iter().filter(|(_, differs)| *differs) {
            if let Some(span) = cx.places.of(&format!("grains.{n}.placement.packed.{key}")) {
                cx.report
                    .warning(Some(span), format!("`{key}` of `{name}` does nothing"))
                    .label(format!("all populations are packed together, as `{first}` says"))
                    .help(format!("give it to `{first}`"));
            }
        }
    }
}

/// Slope up to which gravity points straight down.
const STRAIGHT: Real = 1e-6;
