//! Checks of liquid bridges against the other tables of a case.

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::surface_tension::LARGEST;
use crate::units::rounded;

/// Largest contact angle that the force is known for [degrees].
const LARGEST_ANGLE: f64 = 50.0;

/// Reports bridges that the grains of a case cannot have.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    let Some(bridges) = case.dem.bridges else { return };
    let near = |key: &str| cx.places.near(&format!("dem.bridges{key}"));
    let [whole, sigma, angle] = ["", ".surface_tension", ".contact_angle"].map(near);
    if bridges.surface_tension > LARGEST {
        cx.report
            .error_at(sigma, format!("no liquid has a surface tension of {} N/m", rounded(bridges.surface_tension)))
            .label("molten tungsten has 2.5 N/m")
            .help("water has 72.8 mN/m, which is 0.0728 N/m");
    }
    let degrees = bridges.contact_angle.to_degrees();
    if degrees > LARGEST_ANGLE * (1.0 + 1e-9) {
        cx.report
            .error_at(angle, format!("liquid bridges with a contact angle of {} degrees", rounded(degrees)))
            .label("their force is known up to 50 degrees")
            .help("grains of sand and glass have 0 to 30 degrees");
    }
    if case.has_liquid() && case.solver == Solver::Mps {
        cx.report
            .error_at(whole.clone(), "liquid bridges between grains in moving particles of water")
            .label("the particles do not say which grains are moist")
            .help("choose `solver = \"mics\"`, or leave out `dem.bridges` or the water");
    } else if !case.has_liquid() && bridges.damp == Some(false) {
        cx.report
            .error_at(near(".damp"), "liquid bridges between grains that are dry and stay so")
            .label("there is no liquid in this case that could wet them")
            .help("leave out `damp`, or add `[[liquid]]`");
    } else if case.has_liquid() && bridges.damp.is_none() {
        cx.report
            .error_at(
                whole.clone(),
                "liquid bridges in a case with a body of liquid, and nothing says whether the grains are damp",
            )
            .label("those that the liquid has been about have bridges in any case")
            .help("add `damp = false` for a bed that is dry at first, `damp = true` for a moist one");
    }
    let other = case.fluid.surface_tension.filter(|&other| case.has_liquid() && other > 0.0);
    if let Some(other) = other.filter(|other| (other / bridges.surface_tension - 1.0).abs() > 1e-6) {
        cx.report
            .warning(near(".surface_tension"), "bridges of another liquid than that of the case")
            .label(format!(
                "{} N/m, `fluid.surface_tension` is {} N/m",
                rounded(bridges.surface_tension),
                rounded(other)
            ))
            .help("give both the same");
    }
    if case.grains.is_empty() {
        cx.report
            .error_at(whole, "liquid bridges without grains")
            .label("they hold grains together")
            .help("add `[[grains]]`, or leave out `dem.bridges`");
    }
}
