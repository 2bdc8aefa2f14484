//! The report of `check` as text for people.

use std::fmt::Write as _;

use sazanami_mics::grains::RESOLVED;
use sazanami_mics::surface_tension::WIDE;
use sazanami_numerics::Real;

use super::substeps::longest_substep;
use super::{BedReport, CheckReport, ImpactReport, RanksReport, SubstepCause, TankReport, bytes, number};
use crate::assembly::grains::wet_interactions;
use crate::case::amounts::{self, estimate, length, time};
use crate::case::meaning::{
    BoundarySide, Case, Exchange, GrainPlacement, GrainShape, Population, RunEnd, SIDE_NAMES, Substeps,
};
use crate::case::units::rounded;

/// Limits of the step beyond this are not told \[s].
const BEYOND: Real = 1e6;
/// Errors below this are none for people.
const NEGLIGIBLE: Real = 1e-4;
/// Times below this are not told one by one \[s].
const SHORT: Real = 0.05;
/// Cells from which on a plate is tight wherever its faces lie.
const TIGHT: Real = 3.0;

/// Everything `check` tells, as text.
#[must_use]
pub fn explain(case: &Case, report: &CheckReport) -> String {
    let mut text = String::new();
    let title = if report.title.is_empty() { String::new() } else { format!(": {}", report.title) };
    let _ = writeln!(text, "{}{title}", report.case);
    grid(&mut text, case, report);
    bodies(&mut text, case, report);
    step(&mut text, case, report);
    cost(&mut text, case, report);
    text
}

fn grid(text: &mut String, case: &Case, report: &CheckReport) {
    let extent = case.domain.extent();
    let [n1, n2, n3] = report.cells;
    let [dx1, dx2, dx3] = report.spacing_m.map(length);
    let _ = writeln!(text, "\nbox           {} x {} x {}", length(extent.x), length(extent.y), length(extent.z));
    if let Some(particles) = &report.particles {
        let _ = writeln!(
            text,
            "particles     about {} of water and {} of walls, spacing {}",
            particles.fluid,
            particles.walls,
            length(particles.spacing_m)
        );
        if let Some(chosen) = &case.particles {
            let _ = writeln!(
                text,
                "projection    {}, radius of influence {} spacings",
                chosen.projection,
                rounded(chosen.radius)
            );
        }
        if let Some(tank) = &particles.tank {
            waves(text, tank);
        }
        if let Some(bed) = &particles.bed {
            flow_over_bed(text, bed);
        }
        return;
    }
    let _ = writeln!(text, "cells         {n1} x {n2} x {n3} = {}, edges {dx1}, {dx2}, {dx3}", report.cell_count);
}

fn waves(text: &mut String, tank: &TankReport) {
    let _ = writeln!(
        text,
        "waves         {} of water in a tank of {} along x{}, {} Hz, wavelength {} (linear theory)",
        length(tank.depth_m),
        length(tank.length_m),
        tank.axis,
        number(tank.frequency_hz, 3),
        length(tank.wavelength_m)
    );
    let _ = writeln!(
        text,
        "  speed       up to {} m/s at the surface: {} times that of the tank; 1/cos(kL/2) = {}",
        number(tank.speed_ratio * tank.tank_speed, 3),
        number(tank.speed_ratio, 2),
        number(tank.amplification, 2)
    );
    let _ = writeln!(
        text,
        "  elevation   {} of the depth at the ends, {} at most",
        number(tank.end_elevation, 2),
        number(tank.largest_elevation, 2)
    );
    let _ = writeln!(text, "  bottom      boundary layer of {}", length(tank.stokes_layer_m));
}

fn flow_over_bed(text: &mut String, bed: &BedReport) {
    let _ = writeln!(
        text,
        "ripples       orbital amplitude {}, speed {} m/s, mobility number {} (linear theory; ripples from {} on)",
        length(bed.orbital_amplitude_m),
        number(bed.orbital_speed, 3),
        number(bed.mobility, 2),
        number(bed.least_mobility, 1)
    );
    let parts: Vec<String> = bed.mobile_m.iter().map(|[a, b]| format!("{} to {}", length(*a), length(*b))).collect();
    let where_ = if parts.is_empty() { "nowhere".to_owned() } else { parts.join(", ") };
    let _ = writeln!(text, "  mobile      {where_} along x1");
    for one in &bed.predicted {
        let height = one.height_m.map_or_else(String::new, |height| format!(", {} high", length(height)));
        let _ = writeln!(text, "  expected    {} long{height} ({})", length(one.wavelength_m), one.source);
    }
}

fn bodies(text: &mut String, case: &Case, report: &CheckReport) {
    for liquid in &report.liquids {
        let _ = write!(text, "{:<14}{}", liquid.fluid, liquid.name);
        if let (Some(volume), Some(mass), Some(momentum)) = (liquid.volume_m3, liquid.mass_kg, liquid.momentum) {
            let (volume, mass, momentum) = (amounts::volume(volume), amounts::mass(mass), amounts::momentum(momentum));
            let _ = write!(text, ": {volume}, {mass}, momentum {momentum}");
        }
        if let Some(cells) = liquid.cells_per_height.filter(|_| report.particles.is_none()) {
            let _ = write!(text, ", {cells:.1} cells high");
        }
        text.push('\n');
    }
    for (population, written) in report.populations.iter().zip(&case.grains) {
        let count = population.grains.map_or_else(|| "as many as the bed holds".to_owned(), |n| n.to_string());
        let how = match written.placement {
            GrainPlacement::Packed(_) => "packed in the run",
            GrainPlacement::Bed(_) => "read from a bed",
            GrainPlacement::Lattice(_) => "on a lattice",
            GrainPlacement::List(_) => "put one by one",
            GrainPlacement::Fed(_) => "at most, fed in one after another",
        };
        let left = population.levelled.map_or(String::new(), |left| format!(", about {left} stay below the level"));
        let _ = writeln!(text, "grains        {}: {count}, {how}{left}", population.name);
        if let (Some(size), Some(cells)) = (population.size_m, population.cells_per_grain) {
            let smallest = if written.sizes().draws() { "smallest " } else { "" };
            let _ = match &report.particles {
                Some(particles) => writeln!(
                    text,
                    "  resolution  {smallest}grain size {}: {:.2} particle spacings",
                    length(size),
                    size / particles.spacing_m
                ),
                None => {
                    let wets = case.fluid.surface_tension.is_some_and(|sigma| sigma > 0.0)
                        && case.coupling.exchange == Exchange::Surface;
                    let is_narrow = cells < WIDE * (1.0 - 1e-9);
                    let narrow = match case.fluid.entry_pressure {
                        Some(pressure) if is_narrow => {
                            format!("; below four cells beds of it have an entry pressure of {} Pa", rounded(pressure))
                        }
                        None if is_narrow && wets => "; below four cells the interface meets it at no angle".to_owned(),
                        _ => String::new(),
                    };
                    let cells = if cells < 0.1 { rounded(cells) } else { number(cells, 2) };
                    writeln!(text, "  resolution  {cells} cells on the {smallest}grain size {}{narrow}", length(size))
                }
            };
        }
        if let Some(mass) = population.mass_kg {
            let factor = if written.sizes().draws() { " with the size factor 1" } else { "" };
            let _ = writeln!(text, "  mass        {}{factor}", amounts::mass(mass));
        }
        if let Some(spheres) = population.contact_spheres {
            let face = population.body.as_ref().map(|body| body.face()).filter(|face| face.is_flat());
            let flat =
                face.map_or(String::new(), |face| format!(", {} of them touch a plane at once at most", face.spheres));
            let plural = if spheres == 1 { "" } else { "s" };
            let _ = writeln!(text, "  contact     {spheres} sphere{plural} a grain{flat}");
        }
        for line in &population.shape {
            let _ = writeln!(text, "  shape       {line}");
        }
    }
    for bumps in &report.bumps {
        let [a, b] = &bumps.between;
        let _ = writeln!(
            text,
            "bumps         `{a}` on `{b}`: their spheres add {} to the friction where they slide slowly, several times as much \
             beyond {} m/s; nothing on walls",
            number(bumps.friction, 3),
            number(bumps.speed, 2)
        );
    }
    if let Some(exchange) = &report.exchange {
        let _ = match exchange.narrowest_cells {
            Some(cells) => {
                let lost = if cells < RESOLVED { "; below two cells its drag is not resolved" } else { "" };
                let has_plates =
                    case.grains.iter().any(|population| matches!(population.shape, GrainShape::Box { .. }));
                let leaks = if has_plates && cells < TIGHT { "; a plate leaks below three cells" } else { "" };
                writeln!(
                    text,
                    "exchange      {}: the narrowest grain is {cells:.2} cells wide{lost}{leaks}",
                    exchange.scheme
                )
            }
            None => writeln!(text, "exchange      {}", exchange.scheme),
        };
    }
    film(text, case, report);
    for pair in &case.contacts {
        let _ = writeln!(text, "contact       {}/{}: {}", pair.a, pair.b, pair.law);
    }
}

fn film(text: &mut String, case: &Case, report: &CheckReport) {
    let Some(roughness) = case.film_roughness() else { return };
    let _ =
        write!(text, "film          between spheres that do not touch, down to a roughness of {}", length(roughness));
    let longest = longest_substep(case, &report.populations, &wet_interactions(case));
    if let Some(longest) = longest.filter(|longest| longest.whole_film < longest.film) {
        let _ = write!(
            text,
            "; cut to what sub-steps of {:.1e} s bear, `film_roughness = \"{} um\"` takes all of it and {:.1e} s",
            longest.film,
            number(1e6 * roughness, 3),
            longest.whole_film
        );
    }
    text.push('\n');
}

fn step(text: &mut String, case: &Case, report: &CheckReport) {
    if case.run.packing_only {
        let _ = writeln!(text, "\nthe run ends when the grains are packed; the fluids do not move");
        return;
    }
    let _ = writeln!(text, "\nlimits on the time step at the start (the run may need shorter steps)");
    for limit in report.limits.iter().filter(|limit| limit.rules || limit.dt_s < BEYOND) {
        let mark = if limit.rules { "  <- sets the step" } else { "" };
        let _ = writeln!(text, "  {:<19} {:>9}  {}{mark}", limit.name, time(limit.dt_s), limit.rule);
    }
    if report.fluid_passes > 1 {
        let _ = writeln!(text, "  the fluid makes {} passes in a step", report.fluid_passes);
    }
    if report.substeps > 0 {
        let how = match (case.dem.substeps, report.substep_cause) {
            (Substeps::Fixed(_), _) => "as the case asks",
            (Substeps::Auto, SubstepCause::Contact) => "by the stiffest contact",
            (Substeps::Auto, SubstepCause::Face) => {
                "so that a face comes to rest on a plane with all its contact spheres"
            }
            (Substeps::Auto, SubstepCause::Film) => "by the film between grains",
        };
        let plural = if report.substeps == 1 { "" } else { "s" };
        let _ = writeln!(text, "  the grains make {} sub-step{plural} in a step, {how}", report.substeps);
        if let Some(errors) = report.impact_errors {
            let ImpactReport { restitution, spin } = errors;
            let told = |error: Real, factor: Real, digits: usize| {
                if error < NEGLIGIBLE {
                    format!("below {}", factor * NEGLIGIBLE)
                } else {
                    number(factor * error, digits)
                }
            };
            let _ = writeln!(
                text,
                "  error of an oblique impact of the lightest grains: restitution {} on average, {} at worst; spin {} % of the \
                 tangential speed, {} % at worst",
                told(restitution.mean, 1.0, 4),
                told(restitution.largest, 1.0, 4),
                told(spin.mean, 1e2, 2),
                told(spin.largest, 1e2, 2)
            );
        }
    }
    let most = if report.most_steps > 1.2 * report.steps {
        format!(", up to {} at the highest speed that bodies reach", number(report.most_steps, 0))
    } else {
        String::new()
    };
    let plural = |steps: Real| if steps < 1.5 { "" } else { "s" };
    if let Some(steps) = case.run.steps.filter(|steps| *steps as Real <= report.steps) {
        let _ = writeln!(text, "  {steps} step{}, as the case asks", plural(steps as Real));
        return;
    }
    let rest = if case.run.end == RunEnd::Rest { " at the latest: the run ends when its crater rests" } else { "" };
    let steps = format!("{} step{}", number(report.steps, 0), plural(report.steps));
    let _ = writeln!(text, "  about {steps} to {}{most}{rest}", time(case.run.until));
}

fn shared(text: &mut String, report: &RanksReport) {
    let range = |[a, b]: [usize; 2]| if a == b { a.to_string() } else { format!("{a} to {b}") };
    let _ = writeln!(
        text,
        "ranks         {}: {} x {} parts of {} x {} cells, the largest {} of the mean",
        report.ranks,
        report.parts[0],
        report.parts[1],
        range(report.widths[0]),
        range(report.widths[1]),
        number(report.imbalance, 2)
    );
    if let Some(grains) = report.grain_imbalance {
        let _ = writeln!(
            text,
            "  grains      {} of the mean on the fullest rank, as they lie at the start",
            number(grains, 2)
        );
    }
    let _ = writeln!(
        text,
        "  time        {}, where each rank has {} processor{} of its own like these; messages take more",
        predicted(report.predicted_total_s, &report.predicted_s, ""),
        report.threads,
        if report.threads == 1 { "" } else { "s" }
    );
    let launcher =
        if report.launchable { "" } else { "; under a launcher none: one rank cannot gather its fields into a file" };
    let _ = writeln!(
        text,
        "  limit       {} rank{} at most{launcher}",
        report.most,
        if report.most == 1 { "" } else { "s" }
    );
    let _ = write!(text, "  memory      {} on the rank with the largest part", bytes(report.memory_bytes));
    if report.gathered_bytes > 0.0 {
        let _ = write!(text, ", and {} more on rank 0 for checkpoints", bytes(report.gathered_bytes));
    }
    text.push('\n');
    let cells = |[a, b, c]: &[usize; 3]| format!("{a} x {b} x {c}");
    if !report.levels.is_empty() {
        let cut: Vec<String> = report.levels.iter().map(cells).collect();
        let _ = write!(text, "  multigrid   {} cut among the ranks", cut.join(", "));
    } else if report.gathered.is_some() {
        let _ = write!(text, "  multigrid   no level cut among the ranks");
    }
    if let Some(whole) = &report.gathered {
        let count: usize = whole.iter().product();
        let _ = write!(text, "; {} and below on each rank as a whole, {count} cells", cells(whole));
    }
    if report.gathered.is_some() || !report.levels.is_empty() {
        text.push('\n');
    }
}

/// A predicted time, `on` what, with the parts that take some of it.
fn predicted(total: Real, parts: &[(&str, Real)], on: &str) -> String {
    let about = if total < SHORT { "less than 0.1 s".to_owned() } else { format!("about {}", estimate(total)) };
    let long = parts.iter().filter(|(_, seconds)| *seconds >= SHORT);
    let parts: Vec<String> = long.map(|(name, seconds)| format!("{name} {}", estimate(*seconds))).collect();
    if parts.is_empty() { format!("{about}{on}") } else { format!("{about}{on} ({})", parts.join(", ")) }
}

fn cost(text: &mut String, case: &Case, report: &CheckReport) {
    let free =
        |available: Option<u64>| available.map_or_else(String::new, |free| format!(" of {} free", bytes(free as Real)));
    let _ = writeln!(text, "\nmemory        {}{}", bytes(report.memory_bytes), free(report.memory_available));
    let _ = writeln!(text, "disk          {}{}", bytes(report.disk_bytes), free(report.disk_available));
    let on = format!(" on {} thread{}", report.threads, if report.threads == 1 { "" } else { "s" });
    let most = if report.predicted_most_s > (1.2 * report.predicted_total_s).max(0.1) {
        format!(", up to {} with the most steps", estimate(report.predicted_most_s))
    } else {
        String::new()
    };
    let _ = writeln!(text, "run time      {}{most}", predicted(report.predicted_total_s, &report.predicted_s, &on));
    let _ = writeln!(text, "              an estimate, good to a factor of two");
    if let Some(ranks) = &report.ranks {
        shared(text, ranks);
    }
    let _ = writeln!(text, "machine       {}, {} cores", report.machine.cpu, report.machine.cores);
    if report.made_ready {
        let _ = writeln!(text, "note          the tank was prepared before: nothing is packed");
    }
    let unwalled = |is_open: bool| {
        let sides = (0..3).flat_map(|d| [(d, 0), (d, 1)]).filter(|&(d, upper)| !case.holds_grains(d, upper));
        let sides = sides.filter(|&(d, upper)| case.boundary[d][upper] != BoundarySide::Periodic);
        let sides = sides.filter(|&(d, upper)| case.boundary[d][upper].is_open() == is_open);
        sides.map(|(d, upper)| SIDE_NAMES[d][upper]).collect::<Vec<_>>().join(", ")
    };
    if case.grains.iter().any(Population::moves) && !case.walls_move() {
        let (open, closed) = (unwalled(true), unwalled(false));
        if !open.is_empty() {
            let _ = writeln!(text, "note          grains leave through {open}: they are counted (`departed_grains`)");
        }
        if !closed.is_empty() {
            let _ = writeln!(
                text,
                "note          grains that get through {closed} end the run: `dem.grain_walls` leaves it out, and it is closed to the fluid"
            );
        }
    }
    if case.has_bed() {
        let _ =
            writeln!(text, "note          heights above the bed are taken from the bed that the run packs or reads");
    }
}
