//! Checks of the surface tension of a case.

use sazanami_numerics::Real;

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::PressureForm;
use crate::units::rounded;

/// Largest surface tension that is believed: molten tungsten has 2.5 N/m, mercury 0.49 N/m [N/m].
const LARGEST: Real = 5.0;
/// Smallest that is not doubted: liquids near their critical point have less, and liquid helium [N/m].
const SMALLEST: Real = 1e-3;

/// Reports a surface tension that no liquid has, and what it does not go with.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    let Some(sigma) = case.fluid.surface_tension.filter(|sigma| *sigma != 0.0) else { return };
    let span = cx.places.near("fluid.surface_tension");
    if sigma > LARGEST {
        cx.report
            .error_at(span.clone(), format!("no liquid has a surface tension of {} N/m", rounded(sigma)))
            .label("molten tungsten has 2.5 N/m")
            .help(format!("is it {} mN/m? Water has 72.8 mN/m, which is 0.0728 N/m", rounded(sigma)));
    } else if sigma < SMALLEST {
        cx.report
            .warning(span.clone(), format!("a surface tension of {} N/m is hardly one", rounded(sigma)))
            .label("liquid helium has less than 0.4 mN/m")
            .help("check the unit: water has 72.8 mN/m, which is 0.0728 N/m");
    }
    if case.solver == Solver::Mps {
        cx.report
            .error_at(span.clone(), "surface tension with `solver = \"mps\"`")
            .label("moving particles have none")
            .help("choose `solver = \"mics\"`, or leave out `fluid.surface_tension`");
        return;
    }
    if case.fluid.projection == PressureForm::Incremental {
        cx.report
            .error_at(span.clone(), "surface tension and `projection = \"incremental\"`")
            .label("the increment keeps the jump of the pressure where the interface was")
            .help("choose `projection = \"full\"`, or leave out `fluid.surface_tension`");
    }
    if case.fluid.carrying_flow.is_some() {
        cx.report
            .error_at(span, "surface tension and a carrying flow")
            .label("the flow is given: no force acts on it")
            .help("leave out one of the two");
    }
}
