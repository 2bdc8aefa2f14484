//! Grains in flows upwards, and grains that settle together.

use crate::particles::{self as experiments, BedOnSieve, FluidisedBed};
use sazanami_mps::scheme::Scheme;

use super::said;
use crate::measured::Measured;

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

/// A bed of free grains in a flow upwards.
pub fn fluidised_bed() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let scheme = Scheme::default();
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
