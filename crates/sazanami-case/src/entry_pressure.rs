//! Checks of the entry pressure of beds of narrow grains.

use sazanami_mics::grains::Exchange;
use sazanami_numerics::Real;

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::{Population, PressureForm};
use crate::units::rounded;

/// Largest that is believed: pores of a micrometre have some 1e5 Pa \[Pa].
const LARGEST: Real = 1e5;
/// How many times that of the grains of the case is not doubted.
const DOUBTED: Real = 10.0;

/// Surface tension of water, where the case has none [N/m].
const WATER: Real = 0.0728;
/// Longest over shortest edge of cells that count as cubes.
const LONGEST_CELLS: Real = 1.25;
/// Porosity of a bed.
const POROSITY: Real = 0.4;

/// Pressure of pores that a liquid of this surface tension [N/m] wets wholly, between grains of this `size` \[m], in a bed of usual porosity \[Pa].
fn of_pores(sigma: Real, size: Real) -> Real {
    6.0 * sigma * (1.0 - POROSITY) / (POROSITY * size)
}

/// Reports an entry pressure that no pores have, and what it does not go with.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    let Some(pressure) = case.fluid.entry_pressure.filter(|pressure| !pressure.is_nan()) else { return };
    let span = cx.places.near("fluid.entry_pressure");
    let narrowest = narrowest(case);
    let sigma = case.fluid.surface_tension.filter(|&sigma| sigma > 0.0).unwrap_or(WATER);
    let usual = narrowest.map(|size| {
        let [pressure, size] = [of_pores(sigma, size), 1e3 * size];
        format!(
            "pores between grains of {} mm have about {} Pa, 6 sigma cos(theta) (1 - eps)/(eps d)",
            rounded(size),
            rounded(pressure)
        )
    });
    let usual = usual.unwrap_or_else(|| "sand of 0.2 mm has about 3000 Pa".to_owned());
    if pressure.abs() > LARGEST {
        cx.report
            .error_at(span.clone(), format!("no bed of grains has an entry pressure of {} Pa", rounded(pressure)))
            .label("this cannot be meant")
            .help(format!("check the unit, Pa or kPa: {usual}"));
    } else if narrowest.is_some_and(|size| pressure.abs() > DOUBTED * of_pores(sigma, size)) {
        cx.report
            .warning(span.clone(), format!("an entry pressure of {} Pa is that of finer pores", rounded(pressure)))
            .label("more than ten times that of these grains")
            .help(format!("check the unit, Pa or kPa: {usual}"));
    }
    if case.solver == Solver::Mps {
        cx.report
            .error_at(span, "an entry pressure with `solver = \"mps\"`")
            .label("moving particles have no interface with a gas")
            .help("choose `solver = \"mics\"`, or leave out `fluid.entry_pressure`");
        return;
    }
    if case.fluid.pressure_form == PressureForm::Incremental {
        cx.report
            .error_at(span.clone(), "an entry pressure and `pressure_form = \"incremental\"`")
            .label("its transport sees the pressure of the step before, which an interface that moves has left behind")
            .help("choose `pressure_form = \"full\"`, or leave out `fluid.entry_pressure`");
    }
    let [shortest, longest] = case.domain.divided_edges();
    if longest > LONGEST_CELLS * shortest {
        cx.report
            .error_at(span.clone(), "an entry pressure in cells that are no cubes")
            .label(format!(
                "their edges are as 1 to {}: means over five cells each way tell no bed from a grain",
                rounded(longest / shortest)
            ))
            .help("choose `domain.cells` in proportion to the edges of the box, or leave out `fluid.entry_pressure`");
    }
    if case.grains.is_empty() {
        cx.report
            .error_at(span, "an entry pressure without grains")
            .label("it is that of the pores between them")
            .help("add `[[grains]]`, or leave out `fluid.entry_pressure`");
    } else if case.coupling.exchange != Exchange::Surface {
        cx.report
            .error_at(span, "an entry pressure and `coupling.exchange = \"stress\"`")
            .label("liquid lies within grains there: it has no front in the pores")
            .help("choose `exchange = \"surface\"`, or leave out `fluid.entry_pressure`");
    } else if case.grains.iter().all(|grains| is_wide(case, grains)) {
        cx.report
            .error_at(span, "an entry pressure, and no grains narrower than four cells")
            .label("wider ones are met at `fluid.contact_angle.grains`, and the interface between them is resolved")
            .help("leave it out, or take wider cells");
    }
}

/// Size of the narrowest grains, if they are not wide ([`Case::is_wide`]) and their size is known \[m].
fn narrowest(case: &Case) -> Option<Real> {
    let size = 2.0 * case.smallest_radius();
    (!case.is_wide(size)).then_some(size)
}

/// Whether all grains of a population are wide; those of a mesh are read later.
fn is_wide(case: &Case, grains: &Population) -> bool {
    grains.shape.size().is_some_and(|size| case.is_wide(size * grains.sizes().smallest()))
}
