//! Checks of the film between grains against the other tables of a case.

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::FILM_REACH;
use crate::units::rounded;

/// Reports a film that the solver or the grains cannot have.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    let Some(roughness) = case.film_roughness() else {
        // Cases are written with the default.
        let is_another = case.dem.film_reach != FILM_REACH;
        if let Some(place) = cx.places.of("dem.film_reach").filter(|_| is_another) {
            cx.report
                .warning(Some(place), "`film_reach` has no effect without a film")
                .label("there is no film")
                .help("add `film_roughness = \"1 um\"`, or leave it out");
        }
        return;
    };
    let place = cx.places.of("dem.film_roughness").unwrap_or(0..0);
    let other = case.grains.iter().position(|kind| !kind.is_of_balls());
    if let Some(n) = other.filter(|_| case.solver == Solver::Mics) {
        cx.report
            .error(cx.places.at(&format!("grains.{n}.shape")), "films are between spheres")
            .label(format!("`{}` are none, or have several contact spheres", case.grains[n].name))
            .help("leave out `film_roughness`, or take `shape.sphere` with one contact sphere");
        return;
    }
    let outer = case.dem.film_reach * case.smallest_radius();
    let farthest = case.film_farthest();
    if roughness >= farthest {
        cx.report
            .error(place, "the film ends within the roughness")
            .label(format!("on a grid it ends at half a cell, {} m", rounded(farthest)))
            .help("take a smaller `film_roughness`, or leave it out: the cells resolve all of the film");
    } else if roughness >= outer {
        cx.report
            .error(place, "the film ends within the roughness")
            .label(format!("`film_reach` of the smallest radius is {} m", rounded(outer)))
            .help("take a smaller `film_roughness`, or a larger `film_reach`");
    }
}
