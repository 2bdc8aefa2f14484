//! Main results of a run in a few large numbers, and the objections to them.

use sazanami::analyse;
use sazanami::artist::NO_CRATER;
use sazanami::case::units::with_bar;
use sazanami::finished::Finished;
use sazanami::results::as_word;
use serde_json::Value;

use crate::amounts::{amount, rounded};
use crate::html::Html;
use crate::typeset::typeset;

/// A large number: what it is, its value with the unit, what belongs to it.
struct Headline(&'static str, String, String);

/// The answer of a run.
pub fn section(html: &mut Html, run: &Finished, findings: &[(String, String)]) {
    html.section("answer", "Answer");
    if let Some((verdict, more)) = how_it_broke_off(run) {
        html.raw("<p class=\"verdict bad\">");
        html.element("strong", &[], &verdict);
        html.raw(" ");
        html.text(&more);
        html.raw("</p>\n");
    }
    html.raw("<dl class=\"headlines\">\n");
    for Headline(label, value, more) in headlines(run) {
        html.raw("<div>");
        html.element("dt", &[], label);
        html.element("dd", &[], &value);
        if !more.is_empty() {
            html.element("dd", &[("class", "more")], &more);
        }
        html.raw("</div>\n");
    }
    html.raw("</dl>\n");
    let rows: Vec<Vec<String>> = findings.iter().map(|(label, value)| vec![typeset(label), typeset(value)]).collect();
    html.table("What the run found", &[], &rows);
    html.close("section");
}

/// Cause of an early end, and the state to go on from.
pub fn how_it_broke_off(run: &Finished) -> Option<(String, String)> {
    let failure = &run.summary["failure"];
    let milliseconds =
        |time: Option<f64>| time.map_or("an unknown time".into(), |time| format!("{} ms", rounded(1e3 * time)));
    let verdict = match run.summary["status"].as_str() {
        Some("failed") => {
            let step = failure["step"].as_u64().map_or_else(String::new, |step| format!(" in step {step},"));
            let why = failure["message"].as_str().unwrap_or("why was not recorded");
            format!("The run failed{step} at {}: {why}.", milliseconds(failure["time"].as_f64()))
        }
        Some("stopped") => format!("The run was stopped at {}, before its end.", milliseconds(run.number("time_s"))),
        _ => return None,
    };
    let more = match run.last_checkpoint() {
        Some(path) => {
            let path = path.strip_prefix(&run.folder).map(std::path::Path::to_owned).unwrap_or(path);
            format!(
                "What follows is what it had written until then. Its last good checkpoint is {}; `sazanami resume {}` goes on from it.",
                path.display(),
                as_word(&run.folder)
            )
        }
        None => "What follows is what it had written until then. It has no good checkpoint.".into(),
    };
    Some((verdict, more))
}

/// A volume of the crater with its uncertainty, as people write it, and what speaks against it.
pub fn volume(run: &Finished, key: &str) -> Option<(String, String)> {
    let [volume, half] = ["mm3", "uncertainty_mm3"].map(|of| run.number(&format!("observables.erosion.{key}_{of}")));
    let doubts = run.summary["observables"]["erosion"][&format!("{key}_doubts")].as_str();
    let doubts = doubts.map_or_else(String::new, |doubts| format!("not reliable: {doubts}"));
    let [volume, half] = with_bar(volume?, half?);
    Some((format!("{volume} ± {half} mm³"), doubts))
}

/// Volumes of a crater: what they are called, and their places in the summary.
const VOLUMES: [(&str, &str); 2] =
    [("Volume below the plane of the rim", "volume_below_rim"), ("Erosion volume V, eq. (14)", "volume")];

fn headlines(run: &Finished) -> Vec<Headline> {
    let number = |path: &str| run.number(&format!("observables.{path}"));
    let millimetres = |path: &str| number(path).map(|value| format!("{} mm", rounded(value)));
    let mut found = Vec::new();
    for (label, key) in VOLUMES {
        let noise = number(&format!("erosion.{key}_noise_mm3"));
        let noise = noise
            .map(|noise| format!("± by the smoothing, not by the bed; same bed before the impact: {noise:.1} mm³"));
        found.extend(volume(run, key).map(|(volume, doubts)| {
            let more = [Some(doubts).filter(|doubts| !doubts.is_empty()), noise].into_iter().flatten();
            Headline(label, volume, more.collect::<Vec<_>>().join("; "))
        }));
    }
    if let [Some(angle), Some(error)] = ["angle_deg", "angle_uncertainty_deg"].map(|key| number(&format!("heap.{key}")))
    {
        let speed = number("heap.mean_speed").unwrap_or_default();
        found.push(Headline(
            "Angle of the heap",
            format!("{angle:.1} ± {error:.1}°"),
            format!("grains move at {} m/s on the mean", rounded(speed)),
        ));
    }
    found.extend(bed_forms(run));
    let lengths = [
        ("Depth H of the crater", "erosion.depth_mm", "below its rim"),
        ("Radius L of the rim", "erosion.rim_radius_mm", "from the axis"),
        ("Relief of the bed", "ripples.relief_mm", "root mean square, all wavelengths"),
    ];
    for (label, path, more) in lengths {
        found.extend(millimetres(path).map(|value| Headline(label, value, more.into())));
    }
    if let Some(porosity) = number("bed.porosity") {
        found.push(Headline("Porosity of the bed", format!("{porosity:.3}"), "before the run".into()));
    }
    if found.is_empty() {
        found.push(Headline("Simulated time", amount(run.number("time_s").unwrap_or_default(), "s"), String::new()));
        found.extend(motion(run));
    }
    found
}

/// Of a run that observes nothing else: its grains and its liquid, and how they move at the end.
fn motion(run: &Finished) -> Vec<Headline> {
    let has_liquid = analyse::has_liquid(&run.summary);
    let count = |path: &str| run.number(path).filter(|count| *count > 0.0);
    let grains = count("counts.grains");
    let mut found: Vec<Headline> = Vec::new();
    found.extend(grains.map(|count| Headline("Grains", format!("{count:.0}"), String::new())));
    let of_end = [
        ("Largest speed of a grain", "largest_grain_speed", "m/s", grains.is_some()),
        ("Kinetic energy of the grains", "kinetic_energy_grains", "J", grains.is_some()),
        ("Largest speed of the liquid", "largest_fluid_speed", "m/s", has_liquid),
        ("Kinetic energy of the fluid", "kinetic_energy_fluid", "J", has_liquid),
    ];
    for (label, column, unit, _) in of_end.into_iter().filter(|(.., is_there)| *is_there) {
        let last = run.series.column(column).into_iter().rfind(|value| value.is_finite());
        found.extend(last.map(|value| Headline(label, amount(value, unit), "at the end".into())));
    }
    found
}

/// Mound and ripples of a bed apart, as the terminal tells them; where there is none, why.
fn bed_forms(run: &Finished) -> Vec<Headline> {
    let ripples = &run.summary["observables"]["ripples"];
    let mm = |form: &Value, key: &str| form[key].as_f64().map(|value| format!("{value:.1} mm"));
    let of = |label: &'static str, form: &Value, told: Option<(String, String)>| match (told, form["none"].as_str()) {
        (Some((value, more)), _) => Some(Headline(label, value, more)),
        (None, Some(why)) => Some(Headline(label, "none".into(), why.to_owned())),
        (None, None) => None,
    };
    let [mound, crested] = ["mound", "crested"].map(|key| &ripples[key]);
    let of_mound = || {
        let [length, height, crest] = ["wavelength_mm", "height_mm", "crest_mm"].map(|key| mm(mound, key));
        Some((format!("{} long", length?), format!("{} high, highest at x₁ = {}", height?, crest?)))
    };
    let of_ripples = || {
        let [apart, error, height] =
            ["wavelength_mm", "wavelength_uncertainty_mm", "height_mm"].map(|key| mm(crested, key));
        let crests = crested["crests_mm"].as_array()?.len();
        let error = error.map_or_else(String::new, |error| format!(" ± {error}"));
        Some((format!("{}{error} apart", apart?), format!("{crests} crests, {} high", height?)))
    };
    [of("Mound", mound, of_mound()), of("Ripples", crested, of_ripples())].into_iter().flatten().collect()
}

/// Warnings: of the summary, then of the log.
pub fn warnings(run: &Finished, log: &str) -> Vec<String> {
    let mut found = Vec::new();
    let summary = &run.summary;
    let text =
        |path: &[&str]| path.iter().try_fold(summary, |value, key| value.get(key)).and_then(|value| value.as_str());
    for (what, path) in [
        ("The heap", ["observables", "heap", "not_evaluated"]),
        ("The crater", ["observables", "erosion", "not_evaluated"]),
        ("Whether the crater rests", ["observables", "crater_rest", "not_evaluated"]),
        ("The splash", ["observables", "splash", "not_evaluated"]),
    ] {
        found.extend(text(&path).map(|why| format!("{what} was not evaluated: {why}.")));
    }
    let erosion = &summary["observables"]["erosion"];
    if erosion["rim_at_edge"] == true {
        found.push(
            "The rim of the crater lies at the edge of the box or at `erosion.r_max`: its volumes cannot be trusted."
                .into(),
        );
    }
    let is_crater = !erosion["volume_below_rim_doubts"].as_str().unwrap_or_default().contains(NO_CRATER);
    if is_crater && summary["observables"]["crater_rest"]["at_rest"] == false {
        found.push("The crater has not come to rest at the end of the run: its volumes are not the final ones.".into());
    }
    let counted = [
        ("corrections.deep_contacts", "contacts became deeper than 20 % of a contact sphere's radius"),
        ("corrections.out_of_range_cells", "cells had a liquid fraction outside the range 0 to 1"),
    ];
    for (path, what) in counted {
        found.extend(run.number(path).filter(|count| *count > 0.0).map(|count| format!("{count:.0} {what}.")));
    }
    let said = log.lines().filter_map(|line| line.split_once("warning: ")).map(|(_, text)| text.to_owned());
    found.extend(said);
    found.dedup();
    found
}
