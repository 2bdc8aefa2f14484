//! The report on one run.

use std::path::PathBuf;

use sazanami::analyse;
use sazanami::artist::NO_CRATER;
use sazanami::case::meaning::Measured;
use sazanami::case::{Changed, DefaultValue, MOST_TRIED, changed, longer_than_tried};
use sazanami::error::CommandError;
use sazanami::finished::Finished;
use sazanami::progress::duration;
use sazanami::results::{BED_PROFILES, CASE, CRATER_PROFILES, LAYER_MEANS, LOG, SERIES, WATER_PROFILES};

use serde_json::Value;

use crate::amounts::{self, rounded};
use crate::charts::{self, Chart};
use crate::html::Html;
use crate::typeset::typeset;
use crate::view::{self, View};
use crate::{answer, budgets, page};

/// Report on one run, as HTML.
pub fn page(run: &Finished) -> Result<String, CommandError> {
    let findings = analyse::findings(&run.folder, &run.summary)?;
    let log = std::fs::read(run.folder.join(LOG)).unwrap_or_default();
    let log = String::from_utf8_lossy(&log);
    let charts = charts_of(run)?;
    let view = view::of(run)?;
    page::page(&title(run), view.as_ref(), |html| {
        html.raw("<header>");
        html.element("h1", &[], &title(run));
        html.element("p", &[("class", "subtitle")], &subtitle(run));
        let has_section = analyse::newest_section(&run.folder).is_some();
        let shown: Vec<_> = SECTIONS.into_iter().filter(|(id, _)| has_section || *id != "section").collect();
        page::contents(html, &shown);
        html.close("header");
        answer::section(html, run, &findings);
        section_picture(html, run);
        view_section(html, run, view.as_ref());
        html.section("charts", "Charts");
        html.raw("<p class=\"note\">Drag to zoom, double-click to show all. Tick curves to show or hide them.</p>\n");
        page::charts(html, 0, &charts);
        left_out(html, run);
        html.close("section");
        budgets::section(html, run);
        page::warnings(html, &answer::warnings(run, &log));
        what_was_run(html, run, &log);
        how_to_repeat(html, run);
        Ok(charts)
    })
}

const SECTIONS: [(&str, &str); 8] = [
    ("answer", "Answer"),
    ("section", "Section"),
    ("view", "View"),
    ("charts", "Charts"),
    ("budgets", "Budgets"),
    ("warnings", "Warnings"),
    ("run", "What was run"),
    ("repeat", "How to repeat it"),
];

fn title(run: &Finished) -> String {
    let case = &run.case.case;
    if case.title.is_empty() { case.name.clone() } else { case.title.clone() }
}

fn subtitle(run: &Finished) -> String {
    let status = run.summary["status"].as_str().unwrap_or("unknown");
    let time = run.number("time_s").unwrap_or_default();
    format!("{}: {status} at t = {} ms", run.name(), rounded(1e3 * time))
}

/// The section through bed and water with the measures of the crater.
fn section_picture(html: &mut Html, run: &Finished) {
    let Some(png) = analyse::newest_section(&run.folder).and_then(|path| std::fs::read(path).ok()) else { return };
    html.section("section", "Section");
    let erosion = &run.summary["observables"]["erosion"];
    let is_doubted = || erosion["volume_below_rim_doubts"].as_str().unwrap_or_default().contains(NO_CRATER);
    let what = match erosion["volume_below_rim_mm3"].as_f64() {
        Some(_) if !is_doubted() => " with rim radius L, depth H and the cap of V",
        // Without a crater to be looked for no surface is drawn.
        _ if erosion.is_null() => "",
        _ => " with the surface of the bed",
    };
    html.element("p", &[("class", "note")], &format!("Bed and water{what}, at the last time drawn."));
    let about = format!("Section through bed and water at the end of {}{what}", title(run));
    html.picture("section-picture", "#section", &png, &about);
    html.close("section");
}

/// Grains and water in three dimensions, and the newest picture of them for those who cannot see that.
fn view_section(html: &mut Html, run: &Finished, view: Option<&View>) {
    html.section("view", "View");
    if let Some(view) = view {
        html.raw(include_str!("../assets/view.html"));
        view.left_out.iter().for_each(|what| html.element("p", &[("class", "note")], what));
    }
    match analyse::newest_view(&run.folder).and_then(|path| std::fs::read(path).ok()) {
        Some(png) => {
            html.raw("<details open id=\"still\"><summary>Picture of the last time drawn</summary>\n");
            html.picture("view-picture", "#view", &png, &format!("Grains and water at the end of {}", title(run)));
            html.raw("</details>\n");
        }
        None if view.is_none() => {
            html.raw("<p>The run wrote neither grains nor water, and drew no picture of them.</p>\n")
        }
        None => {}
    }
    html.close("section");
}

/// The columns of the series that no chart shows, in a line that opens.
fn left_out(html: &mut Html, run: &Finished) {
    let zero: Vec<String> = charts::zero_columns(&run.series).into_iter().map(charts::plain).collect();
    if zero.is_empty() {
        return;
    }
    html.raw("<details><summary>");
    html.text(&format!("Zero at all times and not drawn: {} of the columns of {SERIES}", zero.len()));
    html.raw("</summary>\n");
    html.element("p", &[("class", "note")], &format!("{}.", zero.join("; ")));
    html.raw("</details>\n");
}

/// All charts of the run.
fn charts_of(run: &Finished) -> Result<Vec<Chart>, CommandError> {
    let mut found = Vec::new();
    found.extend(run.table(CRATER_PROFILES)?.and_then(|table| charts::crater_profiles(&table)));
    found.extend(surface(run, BED_PROFILES, "Surface of the bed", "z_concentration", |at| at.bed.as_ref())?);
    found.extend(surface(run, WATER_PROFILES, "Surface of the water", "z", |at| at.water.as_ref())?);
    found.extend(run.table(LAYER_MEANS)?.map(|table| charts::of_layers(&table)).unwrap_or_default());
    found.extend(charts::of_series(&run.series));
    Ok(found)
}

/// A surface along the tank, and what an experiment measured of it.
fn surface(
    run: &Finished,
    table: &str,
    title: &str,
    column: &str,
    file: fn(&Measured) -> Option<&PathBuf>,
) -> Result<Option<Chart>, CommandError> {
    let case = &run.case.case;
    let measured = case.ripples.iter().flat_map(|ripples| &ripples.measured);
    let add = |chart: Chart, at: &Measured| match file(at).map(|file| case.measured_profile(file, at.time)) {
        Some(Ok(Some(profile))) => chart.with_measured(at.time, &profile.points),
        // What is missing or damaged is among the findings.
        _ => chart,
    };
    let chart = run.table(table)?.and_then(|table| charts::tank_profiles(title, &table, column));
    Ok(chart.map(|chart| measured.fold(chart, add)))
}

/// Program, machine, times, and the keys that make this case.
fn what_was_run(html: &mut Html, run: &Finished, log: &str) {
    let text = |key: &str| run.summary[key].as_str().unwrap_or("unknown").to_owned();
    let count = |path: &str| run.number(path).map_or("–".into(), |value| format!("{value:.0}"));
    let stamp = |line: Option<&str>| {
        line.and_then(|line| line.split_once("  ")).map_or("–".into(), |(time, _)| time.to_owned())
    };
    let machine = &run.summary["machine"];
    let rows = [
        ("case", format!("{} (hash {})", text("case"), text("case_hash"))),
        ("solver", text("solver")),
        ("program", format!("sazanami {} ({})", text("version"), text("commit"))),
        ("machine", machine["cpu"].as_str().unwrap_or("unknown").to_owned()),
        ("cores, threads, ranks", ["cores", "threads", "ranks"].map(|key| machine[key].to_string()).join(", ")),
        ("began", stamp(log.lines().next())),
        ("ended", stamp(log.lines().last())),
        ("wall-clock time", duration(run.number("wall_s").unwrap_or_default())),
        (
            "cells, particles of water, grains",
            ["cells", "fluid_particles", "grains"].map(|key| count(&format!("counts.{key}"))).join(", "),
        ),
        ("steps of the fluid, of the grains", ["steps", "grain_substeps"].map(count).join(", ")),
    ];
    html.section("run", "What was run");
    html.table("Program, machine and time", &[], &rows.map(|(label, value)| vec![label.to_owned(), value]));
    let phases = run.summary["phase_s"].as_object().into_iter().flatten();
    let phases: Vec<Vec<String>> =
        phases.map(|(name, seconds)| vec![name.clone(), seconds.as_f64().map_or("–".into(), rounded)]).collect();
    html.raw("<details><summary>Where the time went</summary>\n");
    html.table("Wall-clock time by phase", &["phase", "seconds"], &phases);
    html.raw("</details>\n");
    let headings = ["key", "value", "otherwise", "meaning"];
    let keys: Vec<Vec<String>> = changed(&run.case).iter().map(row_of).collect();
    html.table_of_cells(
        "Keys that make this case: required ones, and those that differ from their defaults",
        &headings,
        &keys,
    );
    for (list, length) in longer_than_tried(&run.case) {
        let note = format!("Of {length} tables of {list} the first {MOST_TRIED} are shown; the case below has all.");
        html.element("p", &[("class", "note")], &note);
    }
    html.close("section");
}

/// The row of a key.
fn row_of(key: &Changed) -> Vec<String> {
    let default = match &key.default {
        DefaultValue::Required => "required".to_owned(),
        DefaultValue::None => "none".to_owned(),
        DefaultValue::Value(value) => amounts::of_key(&key.path, value),
    };
    vec![key.path.clone(), amounts::of_key(&key.path, &key.value), default, typeset(key.about)]
}

/// What keeps a run from being repeated bit for bit at once, by its history in the summary; none where that is not known.
fn detours(history: &Value) -> Option<Vec<String>> {
    let values = |key: &str| -> Option<Vec<String>> {
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        Some(history[key].as_array()?.iter().map(text).collect())
    };
    let (ranks, sums, programs, ends) = (values("ranks")?, values("sums")?, values("programs")?, values("ends_s")?);
    let several = |of: &[String], words: &str| (of.len() > 1).then(|| format!("{words} {}", of.join(", then ")));
    let ends = (!ends.is_empty())
        .then(|| format!("was to end at {} s before it was given a later end", ends.join(" s, then ")));
    let all = [
        several(&ranks, "was on several numbers of ranks:"),
        several(&sums, "added over its ranks in several orders:"),
        several(&programs, "was made by"),
        ends,
    ];
    Some(all.into_iter().flatten().collect())
}

/// The commands and the case.
fn how_to_repeat(html: &mut Html, run: &Finished) {
    html.section("repeat", "How to repeat it");
    let threads = run.summary["machine"]["threads"].as_u64().unwrap_or(1);
    let ranks = run.summary["machine"]["ranks"].as_u64().unwrap_or(1);
    let steps = run.summary["steps"].as_u64().filter(|_| run.summary["status"] == "stopped");
    let stop = steps.filter(|steps| *steps > 0).map_or(String::new(), |steps| format!(" --steps {steps}"));
    let sums = if run.summary["machine"]["sums"] == "tree" { " --sums tree" } else { "" };
    html.raw("<p>Save the case below beside the files that it names, and run it:</p>\n");
    let command = format!("sazanami run {CASE} --threads {threads} --ranks {ranks}{sums}{stop}");
    html.element("pre", &[("tabindex", "0")], &command);
    let hash = run.summary["state_hash"].as_str().filter(|_| steps != Some(0));
    match (detours(&run.summary["history"]), hash) {
        (None, _) => {}
        (Some(detours), _) if !detours.is_empty() => {
            let text = format!("This run {}: one at once may differ from it in the last bits, and by what grows out of them.", detours.join(", and "));
            html.element("p", &[], &text);
        }
        (Some(_), Some(hash)) => html.element("p", &[], &format!("The same program reaches the same state, bit for bit, with any number of threads: its summary then has the state hash {hash}.")),
        (Some(_), None) => {}
    }
    html.raw("<details><summary>The case, with every default</summary>\n");
    html.element("pre", &[("tabindex", "0")], run.case.source.text());
    html.raw("</details>\n");
    html.close("section");
}
