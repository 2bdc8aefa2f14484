//! Momentum and liquid: do their budgets close?

use sazanami::analyse;
use sazanami::finished::Finished;
use serde_json::Value;

use crate::amounts::rounded;
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

/// A budget in plain words, and whether it closes, if there is one.
struct Verdict {
    holds: Option<bool>,
    text: String,
}

impl Verdict {
    /// Class of its paragraph, and its first word.
    fn said(&self) -> [&'static str; 2] {
        match self.holds {
            Some(true) => ["verdict good", "Closed."],
            Some(false) => ["verdict bad", "Open."],
            None => ["verdict", "None."],
        }
    }
}

/// The verdict on a relative residual with its bound; where there is none, why.
fn verdict(what: &str, residual: Option<f64>, bound: f64, without: &str) -> Verdict {
    match residual {
        None => Verdict { holds: None, text: format!("{what} has no budget in this run: {without}.") },
        Some(found) if found.abs() <= ROUND_OFF => Verdict {
            holds: Some(true),
            text: format!("{what} is kept to round-off: {found:.1e} of it is unaccounted for."),
        },
        Some(found) if found.abs() <= bound => Verdict {
            holds: Some(true),
            text: format!("{what} is kept: {found:.1e} of it is unaccounted for, at most {bound:.0e} is usual."),
        },
        Some(found) => Verdict {
            holds: Some(false),
            text: format!("{what} is not kept: {found:.1e} of it is unaccounted for, at most {bound:.0e} is usual."),
        },
    }
}

/// Why a run has no budget of the momentum.
fn without_momentum(run: &Finished) -> &'static str {
    let particles = run.summary["solver"] == "mps";
    match () {
        () if particles && run.number("counts.fluid_particles") == Some(0.0) => {
            "with moving particles it is that of the liquid, and there is none"
        }
        () if particles => "no body force acts on the liquid whose impulse would be its measure",
        () => "the flow is given",
    }
}

/// The section on both budgets.
pub fn section(html: &mut Html, run: &Finished) {
    html.section("budgets", "Budgets");
    let particles = run.summary["solver"] == "mps";
    let (momentum, liquid) = if particles { (PARTICLES, BULK) } else { (GRID, GRID) };
    let verdicts = [
        verdict("The momentum", run.number("conservation.momentum_residual_relative"), momentum, without_momentum(run)),
        verdict(
            "The volume of the liquid",
            run.number("conservation.liquid_volume_relative_change"),
            liquid,
            "there is no liquid",
        ),
    ];
    for verdict in &verdicts {
        let [class, word] = verdict.said();
        html.open("p", &[("class", class)]);
        html.element("strong", &[], word);
        html.raw(" ");
        html.text(&typeset(&verdict.text));
        html.close("p");
    }
    let mut rows = Vec::new();
    terms(&run.summary["momentum"], "", &mut rows);
    // Without liquid its terms are zero.
    if !analyse::has_liquid(&run.summary) {
        rows.retain(|row: &Vec<String>| row[1..].iter().any(|part| part != "0"));
    }
    if !rows.is_empty() {
        html.raw("<details><summary>Terms of the momentum budget</summary>\n");
        html.table("Momentum and impulses [N s]", &["term", "x₁", "x₂", "x₃"], &rows);
        html.raw("</details>\n");
    }
    html.close("section");
}

/// Vectors below `value`, a row each.
fn terms(value: &Value, name: &str, rows: &mut Vec<Vec<String>>) {
    if let Some(vector) = value.as_array().filter(|list| list.len() == 3 && list.iter().all(Value::is_number)) {
        let parts = vector.iter().filter_map(Value::as_f64).map(rounded);
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
        assert_eq!(verdict("It", Some(7e-13), GRID, "").said()[1], "Closed.");
        assert!(verdict("It", Some(-7e-7), GRID, "").text.contains("is kept: -7.0e-7"));
        let open = verdict("It", Some(-3e-6), GRID, "");
        assert!(open.holds == Some(false) && open.text.contains("is not kept"));
    }

    #[test]
    fn what_has_no_budget_is_not_called_closed() {
        let none = verdict("It", None, GRID, "there is no liquid");
        assert_eq!(none.said(), ["verdict", "None."]);
        assert!(none.text.contains("has no budget in this run: there is no liquid."), "{}", none.text);
        // Negative control: a residual of zero is one.
        assert_eq!(verdict("It", Some(0.0), GRID, "").said()[1], "Closed.");
    }
}
