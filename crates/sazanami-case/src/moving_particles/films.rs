//! Checks of the film between grains against the other tables of a case.

use sazanami_numerics::Real;

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::{ContactSphereChoice, GrainShape, Population};
use crate::units::rounded;

/// Reports a film that the solver or the grains cannot have.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    let Some(roughness) = case.dem.film_roughness else {
        if let Some(place) = cx.places.of("dem.film_reach") {
            cx.report
                .warning(Some(place), "`film_reach` has no effect without `film_roughness`")
                .label("there is no film")
                .help("add `film_roughness = \"1 um\"`, or leave it out");
        }
        return;
    };
    let place = cx.places.of("dem.film_roughness").unwrap_or(0..0);
    let radius = |diameter: Real, factor: Real| 0.5 * diameter * factor;
    let radii = case.grains.iter().filter_map(|p| p.shape.size().map(|diameter| radius(diameter, p.size.smallest())));
    if case.solver == Solver::Mics {
        let is_ball = |kind: &Population| {
            matches!(kind.shape, GrainShape::Sphere { .. }) && kind.contact_spheres == ContactSphereChoice::Single
        };
        if let Some(n) = case.grains.iter().position(|kind| !is_ball(kind)) {
            cx.report
                .error(cx.places.at(&format!("grains.{n}.shape")), "films are between spheres")
                .label(format!("`{}` are none, or have several contact spheres", case.grains[n].name))
                .help("leave out `film_roughness`, or take `shape.sphere` with one contact sphere");
            return;
        }
    }
    let outer = case.dem.film_reach * radii.fold(Real::INFINITY, Real::min);
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
