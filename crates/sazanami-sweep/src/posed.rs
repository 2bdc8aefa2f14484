//! The runs of a plan: a case for each point, checked before anything runs.

use std::ops::Range;

use sazanami::case::meaning::Population;
use sazanami::case::resolved::{self, Paths};
use sazanami::case::{self, CaseError, Diagnostics, LoadedCase};
use sazanami::check::{self, CostModel, Known};
use sazanami::feasible;
use sazanami::machine::Machine;
use serde::{Deserialize, Serialize};

use crate::keys::Setting;
use crate::plan::Plan;

/// Runs whose findings are told together.
const MOST_WRONG: usize = 20;
/// Longest part of the name of a folder that tells values.
const LONGEST: usize = 60;

/// Resources of a run, as `sazanami check` foretells them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Needs {
    /// Memory \[bytes].
    pub memory: f64,
    /// Results on disk \[bytes].
    pub disk: f64,
    /// Wall-clock time on the threads of a run, if steps stay as they are at the start, and at most \[s].
    pub wall: [f64; 2],
}

/// A run of a sweep.
#[derive(Clone, Debug)]
pub struct Run {
    /// Name of its folder: a number, and the values that fit.
    pub name: String,
    /// Values of the keys that vary, in the order of the plan.
    pub settings: Vec<(String, String)>,
    /// Hash of what its case means.
    pub hash: String,
    /// Its resources.
    pub needs: Needs,
    /// Its case as text.
    pub(crate) text: String,
    /// Steps after which the case ends it, if it says so.
    pub(crate) most_steps: Option<u64>,
}

/// An override with the places of its key and value in the plan.
struct Laid {
    text: String,
    key: String,
    key_span: Range<usize>,
    value: Setting,
    varies: bool,
}

impl Laid {
    fn new(key: &str, key_span: Range<usize>, value: &Setting, varies: bool) -> Self {
        let text = format!("{key}={}", value.value);
        Self { text, key: key.to_owned(), key_span, value: value.clone(), varies }
    }
}

/// The runs of a plan, each on `threads` threads.
///
/// # Errors
/// All findings on the cases of the points, with their places in the plan.
pub fn runs(plan: &Plan, machine: &Machine, threads: usize) -> Result<Vec<Run>, Box<CaseError>> {
    let mut report = Diagnostics::default();
    let mut found = Vec::new();
    let mut wrong = 0;
    let mut causes = Causes { plan, machine, last: 0 };
    let points: Vec<Vec<Laid>> = points(plan, &mut report);
    for (number, point) in points.iter().enumerate() {
        let posed = load(plan, point).and_then(|loaded| run(&loaded, point, machine, threads));
        match posed {
            Ok(mut run) => {
                run.name = name(number + 1, &run.settings);
                found.push(run);
            }
            Err(error) => {
                translate((number + 1, point), &error, &mut causes, &mut report);
                wrong += 1;
                if wrong >= MOST_WRONG {
                    break;
                }
            }
        }
    }
    if report.has_errors() { Err(plan.refused(report)) } else { Ok(found) }
}

/// The overrides of each run.
fn points(plan: &Plan, report: &mut Diagnostics) -> Vec<Vec<Laid>> {
    let fixed = || plan.fixed.iter().map(|(key, span, value)| Laid::new(key, span.clone(), value, false));
    let mut all = Vec::new();
    for point in plan.points() {
        let varied =
            || plan.keys.iter().zip(&point).map(|(key, value)| Laid::new(&key.path, key.span.clone(), value, true));
        let base = || fixed().chain(varied()).collect::<Vec<Laid>>();
        if plan.seeds.is_empty() {
            all.push(base());
            continue;
        }
        let posed = load(plan, &base()).ok();
        let populations = posed.as_ref().map_or(1, |loaded| loaded.case.grains.len());
        if let Some(loaded) = posed.filter(|loaded| !loaded.case.grains.iter().any(Population::draws_from_seed)) {
            let why = match loaded.case.grains.is_empty() {
                true => "seeds are for grains, and the case has none",
                false => "these seeds change nothing: nothing of the grains is drawn at random",
            };
            report
                .error(plan.seeds[0].span.clone(), why)
                .label("all seeds would give one run, and its scatter would be zero")
                .help("leave out `seeds`, or give beds of several packings: `[keys] \"grains.0.placement.bed.file\" = [...]`");
            return Vec::new();
        }
        for seed in &plan.seeds {
            let of = |n: usize| Laid::new(&format!("grains.{n}.seed"), seed.span.clone(), seed, n == 0);
            all.push(base().into_iter().chain((0..populations).map(of)).collect());
        }
    }
    all
}

fn load<'a>(plan: &Plan, point: impl IntoIterator<Item = &'a Laid>) -> Result<LoadedCase, Box<CaseError>> {
    let overrides: Vec<String> = point.into_iter().map(|laid| laid.text.clone()).collect();
    case::load(&plan.case, &overrides)
}

/// Values of the keys that vary.
fn settings(point: &[Laid]) -> Vec<(String, String)> {
    point.iter().filter(|laid| laid.varies).map(|laid| (laid.key.clone(), laid.value.shown())).collect()
}

/// Where a finding on a case comes from that points to none of the keys of the plan.
enum Origin {
    /// From the case itself.
    Case,
    /// From the override of this number: without it there is no such finding.
    Key(usize),
    /// From several overrides.
    Keys,
}

/// Looks for the origins of findings.
struct Causes<'a> {
    plan: &'a Plan,
    machine: &'a Machine,
    /// The override that the one before came from.
    last: usize,
}

impl Causes<'_> {
    /// Origin of the findings of this title.
    fn of(&mut self, title: &str, point: &[Laid]) -> Origin {
        // With the overrides of some numbers alone; nothing is known of it where these make no case.
        let comes = |takes: &dyn Fn(usize) -> bool| {
            let taken = point.iter().enumerate().filter(|(n, _)| takes(*n)).map(|(_, laid)| laid);
            let is_among = |error: &CaseError| error.diagnostics.sorted().iter().any(|finding| finding.title == title);
            match load(self.plan, taken) {
                Ok(loaded) => {
                    let posed = feasible::check(&loaded, self.machine, &CostModel::default());
                    Some(posed.is_err_and(|error| is_among(&error)))
                }
                Err(error) => is_among(&error).then_some(true),
            }
        };
        if comes(&|_| false) == Some(true) {
            return Origin::Case;
        }
        let is_origin = |left_out: &usize| comes(&|n| n != *left_out) == Some(false);
        let alone = std::iter::once(self.last).chain(0..point.len()).find(is_origin);
        self.last = alone.unwrap_or(self.last);
        alone.map_or(Origin::Keys, Origin::Key)
    }
}

fn run(loaded: &LoadedCase, point: &[Laid], machine: &Machine, threads: usize) -> Result<Run, Box<CaseError>> {
    let model = CostModel::default();
    let feasible = feasible::check(loaded, machine, &model)?;
    let known = Known { shapes: &feasible.facts, made_ready: false };
    let report = check::check(&loaded.case, known, machine, threads, &model);
    let needs = Needs {
        memory: report.memory_bytes,
        disk: report.disk_bytes,
        wall: [report.predicted_total_s, report.predicted_most_s],
    };
    // Each run keeps its bed in its own folder, where it goes by itself; a kept tank would have none.
    let mut case = loaded.case.clone();
    let is_varied = point.iter().any(|laid| laid.varies && laid.key == "output.bed");
    if !is_varied && case.preparation.state.is_none() && case.output.bed.take().is_some() {
        case.preparation.cache = false;
    }
    Ok(Run {
        name: String::new(),
        settings: settings(point),
        hash: resolved::hash_text(&case),
        needs,
        text: resolved::write(&case, Paths::Absolute),
        most_steps: loaded.case.run.steps.map(|steps| steps as u64),
    })
}

/// Puts findings on a case of the sweep, that of a point with its number, to the places of the plan that they come from.
fn translate((number, point): (usize, &[Laid]), error: &CaseError, causes: &mut Causes, report: &mut Diagnostics) {
    for finding in error.diagnostics.sorted() {
        if finding.severity == case::Severity::Warning {
            continue;
        }
        let laid = finding.span.clone().and_then(|span| {
            let mut all = error.source.overrides().zip(point);
            all.find(|((start, text), _)| span.start >= *start && span.start <= start + text.len())
                .map(|((start, _), laid)| (span.start - start, span.end.saturating_sub(start), laid))
        });
        let told = match laid {
            Some((from, _, laid)) if from < laid.key.len() => {
                report.error(laid.key_span.clone(), finding.title.clone())
            }
            Some((from, to, laid)) => {
                let value = &laid.value.span;
                let within = |at: usize| (value.start + at.saturating_sub(laid.key.len() + 1)).min(value.end);
                let span = if laid.value.is_verbatim { within(from)..within(to) } else { value.clone() };
                let title = match laid.value.is_verbatim {
                    true => finding.title.clone(),
                    false => format!("{} ({})", finding.title, laid.value.shown()),
                };
                report.error(span, title)
            }
            None => match causes.of(&finding.title, point) {
                Origin::Key(n) => {
                    let value = &point[n].value;
                    report.error(value.span.clone(), format!("{} ({})", finding.title, value.shown()))
                }
                origin => {
                    let place = finding.span.clone().map(|span| error.source.locate(span));
                    let place = place.map(|place| format!("{}:{}", place.origin, place.line));
                    let run = matches!(origin, Origin::Keys).then(|| format!("run {}", name(number, &settings(point))));
                    let more: Vec<String> = run.into_iter().chain(place).collect();
                    let more = if more.is_empty() { String::new() } else { format!(" ({})", more.join(", ")) };
                    report.error(causes.plan.case_span.clone(), format!("{}{more}", finding.title))
                }
            },
        };
        told.label(finding.label.clone());
        if let Some(help) = &finding.help {
            told.help(help.clone());
        }
    }
}

/// Name of the folder of a run.
fn name(number: usize, settings: &[(String, String)]) -> String {
    // A sweep that grows keeps the names that it has.
    let mut name = format!("{number:03}");
    for (key, value) in settings {
        // Tables say too much.
        if value.contains(['{', '\n']) {
            continue;
        }
        let key = key.rsplit('.').next().unwrap_or(key);
        let mut part = String::new();
        for c in format!("{key} {value}").chars() {
            match c {
                c if c.is_ascii_alphanumeric() || c == '.' || c == '_' => part.push(c),
                _ if part.ends_with('-') => {}
                _ => part.push('-'),
            }
        }
        let part = part.trim_matches('-');
        if name.len() + 1 + part.len() <= LONGEST {
            name = format!("{name}-{part}");
        }
    }
    name
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const CASE: &str = "[domain]\nsize = [\"8 mm\", \"8 mm\", \"8 mm\"]\ncells = [8, 8, 8]\n[[liquid]]\n\
        region.sphere = { diameter = \"3 mm\" }\nposition = [\"4 mm\", \"4 mm\", \"5 mm\"]\n[run]\nuntil = \"1 ms\"\n";

    fn posed(text: &str) -> Result<Vec<Run>, Box<CaseError>> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.toml"), CASE).unwrap();
        let path = folder.path().join("plan.toml");
        let plan = Plan::parse(Path::new(&path), &format!("case = \"a.toml\"\n{text}")).unwrap();
        runs(&plan, &Machine::this(), 1)
    }

    #[test]
    fn each_point_is_a_case() {
        let runs = posed("[set]\n\"run.until\" = \"2 ms\"\n[keys]\n\"liquid.0.fall.speed\" = [\"1 m/s\", \"2 m/s\"]\n")
            .unwrap();
        let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
        assert_eq!(names, ["001-speed-1-m-s", "002-speed-2-m-s"]);
        assert_ne!(runs[0].hash, runs[1].hash);
        assert!(runs.iter().all(|run| run.needs.memory > 0.0 && run.text.contains("until = \"0.002 s\"")), "{runs:?}");
        assert_eq!(runs[1].settings, [("liquid.0.fall.speed".to_owned(), "2 m/s".to_owned())]);
        let runs = posed("[keys]\n\"domain.cells\" = [[8, 8, 8], [16, 16, 16]]\n").unwrap();
        assert_eq!(runs[1].name, "002-cells-16-16-16");
    }

    #[test]
    fn each_run_keeps_its_own_bed() {
        let packed = "[set]\n\"material.sand.density\" = \"2650 kg/m^3\"\n\"grains\" = [{ count = 8, shape = { sphere = { \
                      diameter = \"0.5 mm\" } }, placement = { packed = { lattice = \"low\" } } }]\n\
                      \"run.packing_only\" = true\nBED[keys]\n\"grains.0.seed\" = [1, 2]\n";
        let texts = |bed: &str| {
            let runs = posed(&packed.replace("BED", bed)).unwrap_or_else(|error| panic!("{error}"));
            runs.into_iter().map(|run| (run.text, run.hash)).collect::<Vec<_>>()
        };
        let [asked, other] = ["\"output.bed\" = \"packed.bed\"\n", "\"preparation.cache\" = false\n"].map(texts);
        assert_eq!(asked, other);
        // Negative control: beds that the plan varies stay.
        let varied =
            packed.replace("BED", "").replace("\"grains.0.seed\" = [1, 2]", "\"output.bed\" = [\"a.bed\", \"b.bed\"]");
        let runs = posed(&varied).unwrap_or_else(|error| panic!("{error}"));
        assert!(runs.iter().zip(["a.bed", "b.bed"]).all(|(run, bed)| run.text.contains(bed)));
    }

    #[test]
    fn names_do_not_hang_on_the_number_of_runs() {
        assert_eq!(["007", "1000"], [7, 1000].map(|number| name(number, &[])));
    }

    #[test]
    fn seeds_that_change_nothing_are_refused() {
        let grains = "[set]\n\"material.sand.density\" = \"2650 kg/m^3\"\n\"grains\" = [{ shape = { sphere = { \
                      diameter = \"0.5 mm\" } }, placement = { PLACE }SIZE }]\n[keys]\n\"fluid.cfl\" = [0.3]\n";
        let sized = |place: &str, size: &str| {
            posed(&format!("seeds = [1, 2]\n{}", grains.replace("PLACE", place).replace("SIZE", size)))
        };
        let with = |place: &str| sized(place, "");
        let lattice = "lattice = { lower = [\"1 mm\", \"1 mm\", \"1 mm\"], upper = [\"7 mm\", \"7 mm\", \"3 mm\"], counts = [2, 2, 1]";
        let error = with(&format!("{lattice} }}")).unwrap_err().to_string();
        assert!(error.contains("these seeds change nothing") && error.contains("plan.toml:2:10"), "{error}");
        // Nor do sizes of which there is one.
        for size in
            ["uniform = { lower = 0.9, upper = 0.9 }", "lognormal = { sigma = 0.0 }", "list = [{ factor = 0.7 }]"]
        {
            let error = sized(&format!("{lattice} }}"), &format!(", size = {{ {size} }}")).unwrap_err().to_string();
            assert!(error.contains("these seeds change nothing"), "{size}: {error}");
        }
        // Negative controls: sizes and places that are drawn.
        let runs = sized(&format!("{lattice} }}"), ", size = { uniform = { lower = 0.9, upper = 1.0 } }");
        assert_eq!(runs.unwrap_or_else(|error| panic!("{error}")).len(), 2);
        let runs = with(&format!("{lattice}, jitter = 0.1 }}")).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(runs.len(), 2);
    }

    #[test]
    fn findings_on_cases_point_into_the_plan() {
        for (text, expected, place) in [
            ("[keys]\n\"liquid.0.fall.sped\" = [\"1 m/s\"]\n", "did you mean `speed`?", "plan.toml:3:"),
            ("[keys]\n\"fluid.cfl\" = [0.3, \"fast\"]\n", "fast", "plan.toml:3:21"),
            ("[keys]\n\"fluid.cfl\" = { from = 0.3, to = 30.0, count = 2 }\n", "(30.0)", "plan.toml:3:1"),
            ("seeds = [1]\n[keys]\n\"fluid.cfl\" = [0.3]\n", "the case has none", "plan.toml:2:10"),
            ("[set]\n\"domain.cells\" = [0, 8, 8]\n[keys]\n\"fluid.cfl\" = [0.3]\n", "cells", "plan.toml:3:"),
        ] {
            let error = posed(text).unwrap_err().to_string();
            assert!(error.contains(expected) && error.contains(place), "{text}:\n{error}");
        }
        // Told of the liquid, and of the end of the run: by the key that it comes from, or by the run where that are several.
        let fast = "[keys]\n\"liquid.0.fall.speed\" = [\"1 m/s\", \"2000 m/s\"]\n";
        let stream =
            "\"fluid.initial_velocity\" = [{ uniform = { velocity = [\"2000 m/s\", \"0 m/s\", \"0 m/s\"] } }]\n";
        for (text, expected, place) in [
            (fast, "faster than sound in water (2000 m/s)", "plan.toml:3:35"),
            ("[keys]\n\"fluid.dt_max\" = [\"1e-15 s\", \"1 us\"]\n", "come to its end (1e-15 s)", "plan.toml:3:19"),
            (&format!("{fast}{stream}"), "faster than sound in water (run 002-speed-2000-m-s, ", "plan.toml:1:8"),
        ] {
            let error = posed(text).unwrap_err().to_string();
            assert!(error.contains(expected) && error.contains(place), "{text}:\n{error}");
        }
        // A key without which there is no case is not the origin of what another brings.
        let needed = "[set]\n\"material.sand.density\" = \"2650 kg/m^3\"\n[keys]\n\"grains\" = [[{ shape = { sphere = { diameter = \
                      \"0.5 mm\" } }, placement = { list = [{ position = [\"3 mm\", \"3 mm\", \"3 mm\"], velocity = [\"2000 m/s\", \
                      \"0 m/s\", \"0 m/s\"] }] } }]]\n";
        let error = posed(needed).unwrap_err().to_string();
        assert!(error.contains("faster than sound in water"), "{error}");
        assert!(!error.contains("(2650 kg/m^3)") && error.contains("plan.toml:5:"), "{error}");
        let plan = Plan::parse(Path::new("plan.toml"), "case = \"none.toml\"\n[keys]\n\"a\" = [1, 2]\n").unwrap();
        let error = runs(&plan, &Machine::this(), 1).unwrap_err().to_string();
        assert!(error.contains("cannot be read") && error.contains("plan.toml:1:8"), "{error}");
        assert!(error.contains("1 error in"), "{error}");
    }
}
