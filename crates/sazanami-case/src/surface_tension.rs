//! Checks of the surface tension of a case and of its contact angles.

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use sazanami_mics::grains::Exchange;
use sazanami_numerics::Real;

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::{BoundarySide, ContactAngles, PressureForm, SIDE_NAMES};
use crate::units::rounded;

/// Largest surface tension that is believed: molten tungsten has 2.5 N/m, mercury 0.49 N/m [N/m].
pub(crate) const LARGEST: Real = 5.0;
/// Smallest that is not doubted: liquids near their critical point have less, and liquid helium [N/m].
const SMALLEST: Real = 1e-3;

/// Contact angles between which the columns beside the wall end, whatever way the line of contact runs [degrees].
const IN_COLUMNS: [Real; 2] = [20.0, 160.0];

/// Reports a surface tension that no liquid has, and what it does not go with.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    if let Some(angles) = &case.fluid.contact_angle {
        check_angles(case, "contact_angle", angles, cx);
    }
    if let Some(receding) = &case.fluid.receding_angle {
        check_angles(case, "receding_angle", receding, cx);
        check_receding(case, receding, cx);
    }
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
    if case.fluid.pressure_form == PressureForm::Incremental {
        cx.report
            .error_at(span.clone(), "surface tension and `pressure_form = \"incremental\"`")
            .label("its transport sees the pressure of the step before, which an interface that moves has left behind")
            .help("choose `pressure_form = \"full\"`, or leave out `fluid.surface_tension`");
    }
    if case.fluid.carrying_flow.is_some() {
        cx.report
            .error_at(span, "surface tension and a carrying flow")
            .label("the flow is given: no force acts on it")
            .help("leave out one of the two");
    }
}

/// Reports a contact angle of grains that are not there, or that do not act by their surfaces.
fn check_grains(case: &Case, span: Option<Range<usize>>, cx: &mut Context<'_>) {
    if case.grains.is_empty() {
        cx.report
            .error_at(span, "a contact angle at grains, and there are none")
            .label("liquid meets grains at it")
            .help("leave it out, or add `[[grains]]`; walls have `x3_lower` and the like");
    } else if case.coupling.exchange != Exchange::Surface {
        cx.report
            .error_at(span, "a contact angle at grains and `coupling.exchange = \"stress\"`")
            .label("liquid lies within grains there: it has no line of contact")
            .help("choose `exchange = \"surface\"`, or leave out `fluid.contact_angle.grains`");
    }
}

/// Reports receding angles larger than the contact angles of the same walls, or of grains.
fn check_receding(case: &Case, receding: &ContactAngles, cx: &mut Context<'_>) {
    if receding.grains.is_some() {
        cx.report
            .error_at(cx.places.near("fluid.receding_angle.grains"), "a receding angle of grains")
            .label("grains have one angle, at rest and in motion")
            .help("leave it out; walls may have two");
    }
    let advancing = case.fluid.contact_angle.unwrap_or_default();
    for (d, upper) in (0..6).map(|n| (n / 2, n % 2)) {
        let side = &case.boundary[d][upper];
        let Some(least) = receding.at(d, upper, side) else { continue };
        let most = advancing.at(d, upper, side).unwrap_or(FRAC_PI_2);
        if matches!(side, BoundarySide::Moving { .. }) && least < most {
            cx.report
                .error_at(
                    cx.places.near("fluid.receding_angle"),
                    format!("a receding angle at {}, which moves", SIDE_NAMES[d][upper]),
                )
                .label("the line of contact would be held in the box, not on the wall that slides past it")
                .help("leave it out there: name the walls that stand still");
            return;
        }
        if least > most {
            let [least, most] = [least, most].map(|angle| rounded(angle.to_degrees()));
            cx.report
                .error_at(
                    cx.places.near("fluid.receding_angle"),
                    format!("a receding angle of {least} degrees at {}", SIDE_NAMES[d][upper]),
                )
                .label(format!("the interface advances there from {most} degrees on"))
                .help(
                    "`fluid.contact_angle` has to be the larger one of the two; it is 90 degrees where it is not given",
                );
            return;
        }
    }
}

/// Reports the angles of the table `fluid.KEY` that are none, or that no wall has.
fn check_angles(case: &Case, key: &str, angles: &ContactAngles, cx: &mut Context<'_>) {
    if case.fluid.surface_tension.is_none_or(|sigma| sigma == 0.0) {
        cx.report
            .error_at(cx.places.near(&format!("fluid.{key}")), "contact angles without surface tension")
            .label("it is surface tension that pulls the interface to its angle")
            .help(format!("add `surface_tension = \"72.8 mN/m\"` (water), or leave out `fluid.{key}`"));
    }
    for (name, angle, sides) in angles.given().filter(|(_, angle, _)| !angle.is_nan()) {
        let span = cx.places.near(&format!("fluid.{key}.{name}"));
        let degrees = rounded(angle.to_degrees());
        if angle <= 0.0 || angle >= std::f64::consts::PI {
            cx.report
                .error_at(span.clone(), format!("a contact angle of {degrees} degrees"))
                .label("it has to lie between 0 and 180 degrees")
                .help("write it with its unit, `\"60 deg\"`; liquid that wets has less than 90 degrees");
        } else if !(IN_COLUMNS[0]..=IN_COLUMNS[1]).contains(&angle.to_degrees()) {
            cx.report
                .warning(span.clone(), format!("a contact angle of {degrees} degrees is hardly resolved"))
                .label("the wedge at the wall is longer than the columns of cells that its curvature comes from")
                .help("angles from 20 to 160 degrees are");
        }
        if name == "grains" {
            check_grains(case, span, cx);
            continue;
        }
        if let Some([d, upper]) = sides.iter().find(|[d, upper]| !case.boundary[*d][*upper].is_wall()) {
            cx.report
                .error_at(span, format!("a contact angle at {}, which is no wall", SIDE_NAMES[*d][*upper]))
                .label("liquid meets walls at an angle, not open or periodic sides")
                .help(format!("leave out `{name}`, or make the side \"no_slip\""));
        } else if name == "all"
            && !case.boundary.iter().flatten().any(|side| side.is_wall() && *side != BoundarySide::Slip)
        {
            cx.report
                .error_at(span, "a contact angle at all walls, and none holds the fluid")
                .label("`all` leaves out `slip` walls, which may be planes of symmetry")
                .help(format!("name the wall: `fluid.{key}.x3_lower`"));
        }
    }
}
