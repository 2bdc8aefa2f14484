//! Grains in flows upwards, and grains that settle together.

use crate::particles::{self as experiments, BedOnSieve, FluidisedBed, UpwardFlow};
use sazanami_mps::scheme::Scheme;

use super::said;
use crate::measured::Measured;

/// Judged quantities of a flow through fixed grains that should resist as Ergun says.
fn rows_by_ergun(name: &str, found: &UpwardFlow) -> Vec<Measured> {
    let off = |power: i32| (found.ergun(power) - 1.0).abs();
    vec![
        Measured::new(format!("{name}: Ergun over found"), found.ergun(3)),
        Measured::new(format!("{name}: change of the force at the end"), found.change),
        Measured::new(format!("control, {name}: error with eps^2"), off(2)),
        Measured::new(format!("control, {name}: error with eps^4"), off(4)),
    ]
}

/// Judged quantities of a flow through fixed grains that should resist as Wen and Yu say.
fn rows_by_wen_yu(name: &str, found: &UpwardFlow) -> Vec<Measured> {
    vec![
        Measured::new(format!("{name}: Wen and Yu over found"), found.wen_yu(-1.65)),
        Measured::new(format!("{name}: change of the force at the end"), found.change),
        Measured::new(format!("{name}: void fraction of the drag over that of the box"), found.void_over_box()),
        Measured::new(format!("{name}: Wen and Yu at the void fraction of the drag over found"), found.wen_yu_seen()),
    ]
}

/// Judged quantities of a bed that a flow should have lifted.
fn rows_of_lifted(name: &str, found: &FluidisedBed) -> Vec<Measured> {
    vec![
        Measured::new(format!("{name}: force over submerged weight"), found.force),
        Measured::new(format!("{name}: rise of the grains, in diameters"), found.rise),
        Measured::new(format!("{name}: change of it at the end, in diameters"), found.change),
        Measured::new(format!("{name}: void fraction over that by Ergun"), found.porosity / found.porosity_by_ergun()),
        Measured::new(
            format!("{name}: void fraction over that by Richardson and Zaki"),
            found.porosity / found.porosity_by_richardson_and_zaki(),
        ),
    ]
}

/// Flow upwards through fixed grains, and a bed of free ones in it.
pub fn fluidised_bed() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let scheme = Scheme::default();
    for (eps, flux) in [(0.40, 0.001), (0.40, 0.01), (0.45, 0.01), (0.60, 0.03)] {
        let found = experiments::upward_flow(scheme, eps, flux, 0.16).map_err(said)?;
        rows.extend(rows_by_ergun(&format!("fixed, eps {eps:.2}, {:.0} mm/s", 1e3 * flux), &found));
    }
    for (eps, flux) in [(0.85, 0.06), (0.95, 0.1)] {
        let found = experiments::upward_flow(scheme, eps, flux, 0.16).map_err(said)?;
        let name = format!("fixed, eps {eps:.2}, {:.0} mm/s", 1e3 * flux);
        rows.extend(rows_by_wen_yu(&name, &found));
        // A power of a void fraction near one is no control.
        if eps < 0.9 {
            for power in [-0.65, -2.65] {
                let off = (found.wen_yu(power) - 1.0).abs();
                rows.push(Measured::new(format!("control, {name}: error with eps^{power}"), off));
            }
        }
    }
    let bed = BedOnSieve::new(scheme).map_err(said)?;
    rows.push(Measured::new("free: void fraction of the bed at rest", bed.porosity));
    rows.push(Measured::new("free: least fluidising flux by Ergun", bed.least_fluidising));
    let rests = bed.fluidise(0.9, 0.4).map_err(said)?;
    rows.push(Measured::new("free, 0.9 of it: rise of the grains, in diameters", rests.rise));
    let below = rests.force_below / rests.by_ergun;
    rows.push(Measured::new("free, 0.9 of it: force below the upper three diameters over Ergun's", below));
    let all = rests.force / rests.by_ergun;
    rows.push(Measured::new("free, 0.9 of it: force on all over Ergun's", all));
    rows.push(Measured::new("control, free, 0.9 of it: force short of the submerged weight", 1.0 - rests.force));
    for (over, end) in [(1.1, 0.8), (1.5, 0.8), (2.0, 0.8)] {
        let found = bed.fluidise(over, end).map_err(said)?;
        rows.extend(rows_of_lifted(&format!("free, {over} of it"), &found));
    }
    Ok(rows)
}

/// Grains that settle together.
pub fn hindered_settling() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let lone = experiments::settling_speed(1.0);
    for fraction in [0.05, 0.1, 0.2, 0.3] {
        for seed in [1, 2] {
            let found = experiments::hindered_settling(Scheme::default(), fraction, seed, 0.8).map_err(said)?;
            let name = format!("solid fraction {fraction}, seed {seed}");
            rows.push(Measured::new(format!("{name}: speed"), found.speed));
            rows.push(Measured::new(format!("{name}: over the drag law's"), found.speed / found.by_drag()));
            let over = found.speed / found.by_richardson_and_zaki();
            rows.push(Measured::new(format!("{name}: over Richardson and Zaki's"), over));
            rows.push(Measured::new(format!("{name}: change at the end"), found.change));
            rows.push(Measured::new(format!("{name}: void fraction of the drag"), found.void_fraction));
            rows.push(Measured::new(format!("{name}: velocity across, over the speed"), found.agitation));
            rows.push(Measured::new(format!("{name}: momentum of both over that of the grains"), found.momentum));
            if fraction == 0.3 {
                let off = (lone / found.speed - 1.0).abs();
                rows.push(Measured::new(format!("control, {name}: error with the speed of a lone grain"), off));
            }
        }
    }
    Ok(rows)
}
