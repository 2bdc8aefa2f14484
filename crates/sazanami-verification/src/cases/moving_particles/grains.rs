//! Water with grains.

use std::f64::consts::PI;

use crate::particles::{self as experiments, RestingBed};
use sazanami_numerics::Real;

use super::{CONTROL, EXACT, at_most, said};
use crate::measured::Measured;

/// Void fractions.
pub fn void_fraction() -> Result<Vec<Measured>, String> {
    let found = experiments::lattice_voids().map_err(said)?;
    let eps = 1.0 - PI / 6.0;
    Ok(vec![
        Measured::near("interior of a lattice", "", found.interior[0], eps, 0.01).from_source(EXACT),
        at_most("interior: largest difference from the mean, of eps", found.interior[1] / eps, 0.01),
        Measured::near("half a grain from a wall", "", found.at_wall, eps, 0.02).from_source(EXACT),
        Measured::near("rate of eps under compression over that of differences", "", found.rate, 1.0, 0.01)
            .from_source(EXACT),
        Measured::within("control: at a wall without images", "", found.without_images / eps - 1.0, 0.02, 1.0)
            .from_source(CONTROL),
        Measured::within(
            "control: rate that forgets the grains' motion",
            "",
            1.0 - found.rate_of_fluid_alone,
            0.01,
            2.0,
        )
        .from_source(CONTROL),
    ])
}

/// What is judged of a bed at rest.
fn bed_rows(name: &str, found: &RestingBed) -> Vec<Measured> {
    vec![
        at_most(format!("{name}: largest error of the pressure, of rho g H"), found.pressure, 5e-3),
        at_most(format!("{name}: drift of the bed's height, in diameters"), found.height.abs(), 0.05),
        Measured::within(format!("{name}: largest speed of a grain"), "m/s", found.speed, 0.0, 1e-3).from_source(EXACT),
        Measured::near(format!("{name}: force on the floor over submerged weight"), "", found.floor, 1.0, 0.01)
            .from_source(EXACT),
        at_most(format!("{name}: change of the fluid's bulk volume"), found.volume.abs(), 0.01),
        at_most(format!("{name}: mean of n/n0 - 1 in the bed"), found.density.abs(), 0.01),
        Measured::info(format!("{name}: rms of n/n0 - 1 in the bed"), "", found.density_spread),
    ]
}

/// A bed at rest, level and under a tilted surface.
pub fn resting_bed() -> Result<Vec<Measured>, String> {
    let level = experiments::resting_bed([10, 8], 10.0, 5.0, 0.0, 5.0).map_err(said)?;
    let tilted = experiments::resting_bed([10, 8], 10.0, 5.0, 0.161, 1.0).map_err(said)?;
    let mut rows = bed_rows("level", &level);
    rows.push(
        Measured::within("tilted: drift of the bed's height, in diameters", "", tilted.height.abs(), 0.0, 0.05)
            .from_source("9.1 degrees are less than the friction angle"),
    );
    rows.push(Measured::within("tilted: largest speed of a grain", "m/s", tilted.speed, 0.0, 1e-3).from_source(EXACT));
    let fewer = -level.volume_of_fewer;
    rows.push(
        Measured::within("control: bulk volume lost without every fiftieth particle", "", fewer, 0.01, 1.0)
            .from_source(CONTROL),
    );
    let dry = experiments::dry_bed([10, 8], 10.0).map_err(said)?;
    rows.push(
        Measured::within("control: floor's force without water, off by", "", dry - 1.0, 0.01, 1.0).from_source(CONTROL),
    );
    Ok(rows)
}

/// The submerged angle of repose.
pub fn repose() -> Result<Vec<Measured>, String> {
    let found = experiments::repose([40, 8], 10.0, 2.0).map_err(said)?;
    let source = "immersed avalanches of spheres, after Courrech du Pont et al. (2003)";
    Ok(vec![
        Measured::within("angle at which the bed begins to slide, degrees", "", found.start, 25.0, 29.0)
            .from_source(source),
        Measured::within("angle at which it lies still again, degrees", "", found.stop, 21.0, 25.0).from_source(source),
        Measured::info("way of the upper grains before, in diameters", "", found.creep),
        Measured::info("time of the slide", "s", found.seconds),
        Measured::info("largest mean speed of the upper grains, of sqrt(g d)", "", found.speed),
    ])
}

/// One grain in water at rest.
pub fn settling_grain() -> Result<Vec<Measured>, String> {
    let source = "Schiller-Naumann drag, no added mass";
    let mut rows = Vec::new();
    for (spacing, tolerance) in [(1.0, 0.05), (1.5, 0.03), (2.0, 0.03)] {
        let found = experiments::falling_grain(spacing, experiments::GRAIN_DENSITY, 0.15).map_err(said)?;
        let name = format!("l0/d {spacing}");
        rows.push(
            Measured::near(
                format!("{name}: speed after 0.15 s"),
                "m/s",
                found.speed * found.expected,
                0.1551,
                tolerance,
            )
            .from_source(source),
        );
        rows.push(
            Measured::within(format!("{name}: rms difference from one-way coupling"), "", found.history, 0.0, 0.02)
                .from_source(source),
        );
        rows.push(
            Measured::within(format!("{name}: sum of drag on grain and fluid"), "", found.momentum, 0.0, 1e-10)
                .from_source("conservation"),
        );
        let by_density = found.momentum_by_density;
        rows.push(
            Measured::within(format!("control, {name}: sum of drag with shares over n0"), "", by_density, 1e-5, 1.0)
                .from_source(CONTROL),
        );
    }
    let heavier = experiments::falling_grain(1.5, 1.1 * experiments::GRAIN_DENSITY, 0.15).map_err(said)?;
    rows.push(
        Measured::within("control, l0/d 1.5: speed of a grain a tenth heavier, over", "", heavier.speed, 1.05, 2.0)
            .from_source(CONTROL),
    );
    Ok(rows)
}

/// Flow through a bed.
pub fn packed_bed() -> Result<Vec<Measured>, String> {
    let source = "Ergun 1952";
    let mut rows = Vec::new();
    for (eps, force) in [(0.36, 0.8), (0.40, 0.1), (0.40, 0.8), (0.40, 3.0), (0.50, 0.8)] {
        let found = experiments::seepage(eps, force, 0.2).map_err(said)?;
        let name = format!("eps {eps}, {:.0} Pa/m", found.gradient);
        let void = Measured::info(format!("{name}: void fraction of the fluid"), "", found.void_fraction);
        rows.push(Measured { reference: Some(eps), ..void });
        rows.push(Measured::info(format!("{name}: flux"), "m/s", found.flux));
        rows.push(
            Measured::near(format!("{name}: Ergun over found"), "", found.ergun(3), 1.0, 0.03).from_source(source),
        );
        rows.push(Measured::info(format!("{name}: change of the flux at the end"), "", found.change));
        if eps == 0.40 && force == 0.8 {
            for power in [2, 4] {
                let off: Real = (found.ergun(power) - 1.0).abs();
                let row =
                    Measured::within(format!("control, {name}: error with eps^{power}"), "", off, 0.03, Real::INFINITY);
                rows.push(row.from_source(CONTROL));
            }
        }
    }
    Ok(rows)
}

/// Water alone.
pub fn frames() -> Result<Vec<Measured>, String> {
    let [found, chance] = experiments::frames(5, 1.0).map_err(said)?;
    let source = "the frame is a matter of choice";
    let row = |name: &str, value: Real| Measured::within(name, "", value, 0.0, 0.01).from_source(source);
    Ok(vec![
        row("rms difference of the mean velocities of columns until 0.25 s", found.early),
        row("rms difference of the mean velocities of columns", found.velocity),
        row("rms difference of the mean heights of columns", found.height),
        row("rms difference of the centre of mass", found.centre),
        row("rms difference of the kinetic energy", found.energy),
        Measured::info("way of the tank in a step, in spacings", "", found.speed),
        Measured::info("by chance: rms difference of the mean velocities of columns until 0.25 s", "", chance.early),
        Measured::info("by chance: rms difference of the mean velocities of columns", "", chance.velocity),
        Measured::info("by chance: rms difference of the mean heights of columns", "", chance.height),
        Measured::info("by chance: rms difference of the centre of mass", "", chance.centre),
        Measured::info("by chance: rms difference of the kinetic energy", "", chance.energy),
    ])
}

/// With a bed.
pub fn frames_with_bed() -> Result<Vec<Measured>, String> {
    let [found, chance] = experiments::frames_with_bed(120, 0.5).map_err(said)?;
    let source = "the frame is a matter of choice";
    let row = |name: &str, value: Real| Measured::within(name, "", value.abs(), 0.0, 0.05).from_source(source);
    Ok(vec![
        row("relief of the bed after 0.5 s", found.bed_relief),
        row("kinetic energy of the bed until 0.5 s", found.bed_energy),
        Measured::info("rms difference of the centre of mass of the water", "", found.centre),
        Measured::info("rms difference of the kinetic energy of the water", "", found.energy),
        Measured::info("by chance: relief of the bed after 0.5 s", "", chance.bed_relief.abs()),
        Measured::info("by chance: kinetic energy of the bed until 0.5 s", "", chance.bed_energy.abs()),
    ])
}
