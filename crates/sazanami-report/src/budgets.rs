//! Momentum and liquid: do their budgets close?

use sazanami::finished::Finished;
use serde_json::Value;

use crate::html::Html;
use crate::typeset::typeset;

/// Up to this a relative residual is round-off of sums over many steps.
const ROUND_OFF: f64 = 1e-9;
/// Largest relative residual of the momentum that moving particles leave in tanks with a bed (guide, "Ripples").
const PARTICLES: f64 = 2e-2;
/// Usual relative change of the bulk volume of moving particles (guide, "Columns").
const BULK: f64 = 1e-3;
/// Most that a grid may lose of either before its results are in doubt.
const GRID: f64 = 1e-6;

/// A budget in plain words, and whether it closes.
struct Verdict {
    holds: bool,
    text: String,
}

/// The verdict on a relative residual with its bound.
fn verdict(what: &str, residual: Option<f64>, bound: f64, else_: &str) -> Verdict {
    match residual {
        None => Verdict { holds: true, text: format!("{what} has no budget in this run: {else_}.") },
        Some(found) if found.abs() <= ROUND_OFF => {
            Verdict { holds: true, text: format!("{what} is kept to round-off: {found:.1e} of it is unaccounted for.") }
        }
        Some(found) if found.abs() <= bound => Verdict {
            holds: true,
            text: format!("{what} is kept: {found:.1e} of it is unaccounted for, at most {bound:.0e} is usual."),
        },
        Some(found) => Verdict {
            holds: false,
            text: format!("{what} is not kept: {found:.1e} of it is unaccounted for, at most {bound:.0e} is usual."),
        },
    }
}

/// The section on both budgets.
pub fn section(html: &mut Html, run: &Finished) {
    html.section("budgets", "Budgets");
    let particles = run.summary["solver"] == "mps";
    let (momentum, liquid) = if particles { (PARTICLES, BULK) } else { (GRID, GRID) };
    let verdicts = [
        verdict(
            "The momentum",
            run.number("conservation.momentum_residual_relative"),
            momentum,
            "no force acts from outside, or the flow is given",
        ),
        verdict(
            "The volume of the liquid",
            run.number("conservation.liquid_volume_relative_change"),
            liquid,
            "there is no liquid",
        ),
    ];
    for Verdict { holds, text } in &verdicts {
        html.open("p", &[("class", if *holds { "verdict good" } else { "verdict bad" })]);
        html.raw(if *holds { "<strong>Closed.</strong> " } else { "<strong>Open.</strong> " });
        html.text(&typeset(text));
        html.close("p");
    }
    let mut rows = Vec::new();
    terms(&run.summary["momentum"], "", &mut rows);
    if !rows.is_empty() {
        html.raw("<details><summary>Terms of the momentum budget</summary>\n");
        html.table("Momentum and impulses [N s]", &["term", "x1", "x2", "x3"], &rows);
        html.raw("</details>\n");
    }
    html.close("section");
}

/// Vectors below `value`, a row each.
fn terms(value: &Value, name: &str, rows: &mut Vec<Vec<String>>) {
    if let Some(vector) = value.as_array().filter(|list| list.len() == 3 && list.iter().all(Value::is_number)) {
        let parts = vector.iter().filter_map(Value::as_f64).map(|part| typeset(&format!("{part:.4e}")));
        rows.push(std::iter::once(name.replace('_', " ")).chain(parts).collect());
    }
    for (key, inner) in value.as_object().into_iter().flatten() {
        terms(inner, &if name.is_empty() { key.clone() } else { format!("{name}: {key}") }, rows);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_budget_is_called_open() {
        assert!(verdict("It", Some(7e-13), GRID, "").holds);
        assert!(verdict("It", Some(-7e-7), GRID, "").text.contains("is kept: -7.0e-7"));
        let open = verdict("It", Some(-3e-6), GRID, "");
        assert!(!open.holds && open.text.contains("is not kept"));
    }
}
