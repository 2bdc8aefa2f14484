//! Calibration: the values of one to five keys with which a case finds given targets, by the simplex of Nelder and Mead
//! (1965) over runs that are kept as those of a sweep.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::neldermead::NelderMead;
use sazanami::error::CommandError;
use sazanami::machine::Machine;
use sazanami::progress::Progress;
use sazanami::stop::Stop;
use sazanami_io::table::write_json;
use serde_json::Value;

use crate::keys::{Between, Choices, Design};
use crate::plan::{Plan, Target};
use crate::plane::uncertainties;
use crate::pool::SideBySide;
use crate::state::{Progressed, State};
use crate::sweep::Sweep;
use crate::table;
use crate::work::TRIED;

/// Part of the ranges that the first simplex spans, about their middle.
const FIRST: [f64; 2] = [0.3, 0.7];
/// Digits of the values that are tried.
const DIGITS: usize = 6;
/// Cost of a run that failed, and of a point outside the ranges, where none is made.
const FAILED: f64 = 1e12;

/// A key as it was fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedKey {
    /// Path of the key in the case.
    pub path: String,
    /// The value of the best point, as text with its unit.
    pub value: String,
    /// By how much it is uncertain if each target is by its tolerance and by the standard error of its mean over the
    /// seeds, in the same unit; absent where the runs do not determine the key within its range: the targets change with
    /// it by no more than they scatter, or do not tell it from other keys.
    pub uncertainty: Option<f64>,
}

/// A target and what was found at the best point.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedTarget {
    /// Name of the finding.
    pub name: String,
    /// Target and its tolerance.
    pub target: [f64; 2],
    /// Measured mean over the seeds.
    pub found: f64,
    /// Standard error of that mean, from the scatter between seeds at all points; absent with less than two seeds.
    pub error: Option<f64>,
}

/// Result of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Keys that were fitted, with their best values.
    pub keys: Vec<FittedKey>,
    /// Targets of the plan, as the best point meets them.
    pub targets: Vec<FittedTarget>,
    /// Whether all of them were met.
    pub is_met: bool,
    /// Whether a signal ended the search.
    pub interrupted: bool,
    /// Runs that it took.
    pub runs: usize,
    /// Folder of the best run: with seeds the first one at the best point.
    pub best: PathBuf,
}

/// A point in the unit cube that was tried, and what its runs found for each target, one for each seed; nothing if one of
/// them failed or could not evaluate a target.
#[derive(Clone, Debug)]
struct Tried {
    name: String,
    place: Vec<f64>,
    found: Option<Vec<Vec<f64>>>,
}

impl Tried {
    /// Findings for each target, mean over the seeds.
    fn means(&self) -> Option<Vec<f64>> {
        Some(self.found.as_ref()?.iter().map(|of_seeds| mean(of_seeds)).collect())
    }
}

/// Why the search ends.
#[derive(Debug, thiserror::Error)]
enum End {
    #[error("the targets are met")]
    Met,
    #[error("as many runs as the plan allows")]
    Runs,
    #[error("a signal")]
    Stopped,
    #[error(transparent)]
    Refused(#[from] CommandError),
}

struct Search<'a> {
    plan: &'a Plan,
    folder: &'a Path,
    program: &'a Path,
    asked: Option<usize>,
    stop: &'a Stop,
    ranges: Vec<&'a Between>,
    state: RefCell<SearchState<'a>>,
}

struct SearchState<'a> {
    tried: Vec<Tried>,
    progress: &'a mut dyn Progress,
}

/// Searches for the values of the keys of `plan` with which its targets are found; runs are processes of `program`.
///
/// # Errors
/// If the plan has no targets or other keys than ranges, or a case cannot run.
pub fn calibrate(
    plan: &Plan,
    folder: &Path,
    program: &Path,
    asked: Option<usize>,
    progress: &mut dyn Progress,
    stop: &Stop,
) -> Result<Fit, CommandError> {
    let ranges = ranges(plan)?;
    let search = Search {
        plan,
        folder,
        program,
        asked,
        stop,
        ranges,
        state: RefCell::new(SearchState { tried: Vec::new(), progress }),
    };
    match search.work() {
        Some(End::Refused(refusal)) => Err(refusal),
        ended => search.fit(matches!(ended, Some(End::Stopped))),
    }
}

/// Whether the finding `name` stands among the `observables` of a run without a value, or in a table that says why it has none.
fn could_not_evaluate(observables: &Value, name: &str) -> bool {
    let mut at = observables;
    for key in name.split('.') {
        if ["none", "not_evaluated"].iter().any(|why| at.get(why).is_some()) {
            return true;
        }
        match at.get(key) {
            Some(inner) => at = inner,
            None => return false,
        }
    }
    at.is_null()
}

/// The ranges of the keys.
fn ranges(plan: &Plan) -> Result<Vec<&Between>, CommandError> {
    const HELP: &str = "docs/guide/sweeps.md has an example";
    if plan.targets.is_empty() {
        return Err(CommandError::input("the plan names no target", format!("add `[targets]`: {HELP}")));
    }
    if !(1..=5).contains(&plan.keys.len()) {
        return Err(CommandError::input(
            format!("{} keys are to be fitted, and one to five can be", plan.keys.len()),
            "put the others under `[set]`",
        ));
    }
    let mut found = Vec::new();
    for key in &plan.keys {
        match &key.choices {
            Choices::Between(between) => found.push(between),
            Choices::Values(_) => {
                return Err(CommandError::input(
                    format!("`{}` varies over a list, and what is fitted lies in a range", key.path),
                    "give `from` and `to`",
                ));
            }
        }
    }
    Ok(found)
}

impl Search<'_> {
    fn work(&self) -> Option<End> {
        let n = self.ranges.len();
        // What was tried before, then the first simplex: side by side.
        let mut first: Vec<Vec<f64>> = vec![vec![FIRST[0]; n]];
        first.extend((0..n).map(|d| (0..n).map(|e| FIRST[usize::from(d == e)]).collect()));
        let text = fs::read_to_string(self.folder.join(TRIED)).unwrap_or_default();
        let mut points: Vec<Vec<f64>> = serde_json::from_str(&text).unwrap_or_default();
        if let Some(other) = points.iter().find(|point| point.len() != n) {
            return Some(End::Refused(CommandError::input(
                format!("`{}` holds a search over {} keys, and this plan has {n}", self.folder.display(), other.len()),
                "choose another folder with --out",
            )));
        }
        if points.is_empty() {
            points.push(first[0].clone());
        }
        if points.len() == 1 {
            // By itself, also when a command before ended with it: a target that no run finds is told by the first one. That it
            // meets all of them is no end: how well they determine the keys is told by the others.
            match self.evaluate(&points) {
                Ok(()) | Err(End::Met) => {}
                Err(end) => return Some(end),
            }
        }
        for point in &first {
            if !points.contains(point) {
                points.push(point.clone());
            }
        }
        if let Err(end) = self.evaluate(&points) {
            return Some(end);
        }
        // Costs that are alike are no end: the points may lie on both sides of it.
        let solver = NelderMead::new(first).with_sd_tolerance(0.0).ok()?;
        let ended = Executor::new(self, solver).configure(|state| state.max_iters(1000)).run();
        ended.err().and_then(|error| error.downcast::<End>().ok())
    }

    /// Runs the points, all that were tried before included, and reads what they found.
    fn evaluate(&self, points: &[Vec<f64>]) -> Result<(), End> {
        let state = &mut *self.state.borrow_mut();
        let mut plan = self.plan.clone();
        for (d, key) in plan.keys.iter_mut().enumerate() {
            let values = points.iter().map(|point| self.ranges[d].at(point[d], DIGITS)).collect();
            key.choices = Choices::Values(values);
        }
        plan.design = Design::Zip;
        let cores = Machine::this().cores;
        let seeds = self.seeds();
        let side_by_side = SideBySide::of(self.asked, None, (points.len() - state.tried.len()) * seeds, cores);
        let sweep = Sweep::pose(plan, self.folder, side_by_side.threads)?;
        // Before the runs: a command that goes on knows of all that may lie there.
        fs::create_dir_all(self.folder).map_err(|error| CommandError::Undone(error.to_string()))?;
        write_json(&self.folder.join(TRIED), &points).map_err(|error| CommandError::Undone(error.to_string()))?;
        let interrupted = sweep.run(self.program, side_by_side, false, state.progress, self.stop)?.interrupted;
        let before = state.tried.len();
        for (place, point) in points.iter().enumerate().skip(before) {
            let mut found = Some(vec![Vec::new(); self.plan.targets.len()]);
            for number in place * seeds..(place + 1) * seeds {
                let progressed = sweep.progressed(number);
                match &progressed.state {
                    State::Finished => match self.values(&progressed, &state.tried)? {
                        Some(values) => found.iter_mut().flatten().zip(values).for_each(|(all, of)| all.push(of)),
                        None => found = None,
                    },
                    State::Failed(_) => found = None,
                    _ if interrupted => return Err(End::Stopped),
                    state_of => {
                        let text = format!("{}: {}", sweep.runs()[number].name, state_of.word());
                        return Err(CommandError::Undone(text).into());
                    }
                }
            }
            let name = sweep.runs()[place * seeds].name.clone();
            state.tried.push(Tried { name, place: point.clone(), found });
        }
        if state.tried.iter().any(|tried| self.is_met(tried)) { Err(End::Met) } else { Ok(()) }
    }

    /// Findings of a run for each target; none if it could not evaluate one: too flat a heap, a bed without a crater.
    fn values(&self, progressed: &Progressed, tried: &[Tried]) -> Result<Option<Vec<f64>>, CommandError> {
        let found: BTreeMap<String, String> = table::findings(progressed).into_iter().collect();
        let value = |target: &Target| match found.get(&target.name).and_then(|text| text.parse::<f64>().ok()) {
            Some(value) => Ok(Some(value)),
            None if could_not_evaluate(&progressed.summary["observables"], &target.name) => Ok(None),
            // Another run has had all of them.
            None if tried.iter().any(|tried| tried.found.is_some()) => Ok(None),
            None => {
                let known: Vec<&str> = found.keys().map(String::as_str).collect();
                Err(CommandError::unknown("finding", &target.name, &known))
            }
        };
        self.plan.targets.iter().map(value).collect()
    }

    /// Runs at each point.
    fn seeds(&self) -> usize {
        self.plan.seeds.len().max(1)
    }

    /// Standard errors of the means over the seeds for each target, from the scatter between seeds about the means of all
    /// points; nothing where no point has two seeds.
    fn errors(&self, tried: &[Tried]) -> Option<Vec<f64>> {
        let seeds = self.seeds();
        let known: Vec<&Vec<Vec<f64>>> = tried.iter().filter_map(|tried| tried.found.as_ref()).collect();
        let freedom = known.len() * (seeds - 1);
        let error = |target: usize| {
            let squares = known.iter().map(|found| {
                let middle = mean(&found[target]);
                found[target].iter().map(|value| (value - middle).powi(2)).sum::<f64>()
            });
            (squares.sum::<f64>() / (freedom * seeds) as f64).sqrt()
        };
        (freedom > 0).then(|| (0..self.plan.targets.len()).map(error).collect())
    }

    /// Deviations from the targets in their tolerances.
    fn deviations(&self, tried: &Tried) -> Option<Vec<f64>> {
        let found = tried.means()?;
        Some(found.iter().zip(&self.plan.targets).map(|(found, t)| (found - t.value) / t.tolerance).collect())
    }

    fn is_met(&self, tried: &Tried) -> bool {
        self.deviations(tried).is_some_and(|all| all.iter().all(|deviation| deviation.abs() <= 1.0))
    }

    fn cost_of(&self, tried: &Tried) -> f64 {
        self.deviations(tried).map_or(FAILED, |all| all.iter().map(|deviation| deviation * deviation).sum())
    }

    /// The best run and what it says of the keys.
    fn fit(&self, interrupted: bool) -> Result<Fit, CommandError> {
        let state = self.state.borrow();
        let best = (0..state.tried.len())
            .filter(|&number| state.tried[number].found.is_some())
            .min_by(|&a, &b| self.cost_of(&state.tried[a]).total_cmp(&self.cost_of(&state.tried[b])));
        let Some(best) = best else {
            return Err(CommandError::Undone("no run has found anything yet".into()));
        };
        let tried = &state.tried[best];
        let uncertainties = self.uncertainties(&state.tried, best);
        let key = |d: usize| {
            let range = self.ranges[d];
            let place = tried.place[d];
            FittedKey {
                path: self.plan.keys[d].path.clone(),
                value: range.at(place, DIGITS).shown(),
                uncertainty: uncertainties[d].map(|of_range| of_range * range.slope(place).abs()),
            }
        };
        let (found, errors) = (tried.means().unwrap_or_default(), self.errors(&state.tried));
        let target = |(n, target): (usize, &Target)| FittedTarget {
            name: target.name.clone(),
            target: [target.value, target.tolerance],
            found: found[n],
            error: errors.as_ref().map(|all| all[n]),
        };
        Ok(Fit {
            keys: (0..self.ranges.len()).map(key).collect(),
            targets: self.plan.targets.iter().enumerate().map(target).collect(),
            is_met: self.is_met(tried),
            interrupted,
            runs: state.tried.len() * self.seeds(),
            best: self.folder.join(&tried.name),
        })
    }

    /// Standard uncertainties of the places \[parts of the ranges], by the plane through the best point and those nearest to it: if
    /// each target is uncertain by its tolerance and, with seeds, by the standard error of its mean. Means scatter, and
    /// points that lie close tell little of a slope: with seeds the plane goes through all points.
    fn uncertainties(&self, tried: &[Tried], best: usize) -> Vec<Option<f64>> {
        let centre = &tried[best].place;
        let distance = |other: &Tried| -> f64 { other.place.iter().zip(centre).map(|(a, b)| (a - b).powi(2)).sum() };
        let mut known: Vec<&Tried> = tried.iter().filter(|other| other.found.is_some()).collect();
        known.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let errors = self.errors(tried);
        if errors.is_none() {
            known.truncate(1 + 2 * self.ranges.len());
        }
        let places: Vec<&[f64]> = known.iter().map(|tried| &tried.place[..]).collect();
        let deviations: Vec<Vec<f64>> = known.iter().filter_map(|tried| self.deviations(tried)).collect();
        let error = |(t, target): (usize, &Target)| errors.as_ref().map_or(0.0, |all| all[t] / target.tolerance);
        let errors: Vec<f64> = self.plan.targets.iter().enumerate().map(error).collect();
        let freedom = self.errors(tried).map(|_| known.len() * (self.seeds() - 1));
        uncertainties(&places, &deviations, &errors, freedom)
    }
}

impl CostFunction for &Search<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, place: &Vec<f64>) -> Result<f64, Error> {
        let outside: f64 = place.iter().map(|&part| (-part).max(part - 1.0).max(0.0)).sum();
        if outside > 0.0 {
            return Ok(FAILED * (1.0 + outside));
        }
        // Values are rounded: places that differ by less are the same run.
        let values = |place: &[f64]| -> Vec<String> {
            self.ranges.iter().zip(place).map(|(range, &part)| range.at(part, DIGITS).value).collect()
        };
        let own = values(place);
        let known = self.state.borrow().tried.iter().find(|tried| own == values(&tried.place)).cloned();
        if let Some(tried) = known {
            return Ok(self.cost_of(&tried));
        }
        let mut points: Vec<Vec<f64>> = self.state.borrow().tried.iter().map(|tried| tried.place.clone()).collect();
        if (points.len() + 1) * self.seeds() > self.plan.most_runs {
            return Err(End::Runs.into());
        }
        points.push(place.clone());
        self.evaluate(&points)?;
        let state = self.state.borrow();
        Ok(state.tried.last().map_or(FAILED, |tried| self.cost_of(tried)))
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_could_not_evaluate_a_target_is_told_from_a_misspelt_one() {
        let observables = serde_json::json!({
            "heap": { "not_evaluated": "too flat" }, "ripples": { "crested": { "none": "0 crests" } },
            "bed": { "porosity": null, "height_mm": 3.0 },
        });
        for name in ["heap.angle_deg", "ripples.crested.wavelength_mm", "bed.porosity"] {
            assert!(could_not_evaluate(&observables, name), "{name}");
        }
        for name in ["bed.height_mm", "bed.porosty", "ripples.relief_mm", "time_s"] {
            assert!(!could_not_evaluate(&observables, name), "{name}");
        }
    }

    /// Substitute for the program: `steps` change with the key by a slope, are 3 at 0.3, and off by a draw of the seed.
    #[cfg(unix)]
    const NOISY: &str = r#"#!/bin/sh
value() { sed -n "s/^$1 = //p" "$2"; }
mkdir -p "$4" && cp "$2" "$4/case.toml"
awk -v key="$(value cfl "$2")" -v seed="$(value seed "$2")" 'BEGIN {
    split("0.9 -0.2 -0.5 0.1", drawn, " ")
    printf "{ \"status\": \"finished\", \"steps\": %.9f }", SLOPE * (key - 0.3) + 3 + drawn[seed]
}' > "$4/summary.json"
"#;

    /// Finds the key whose `steps`, which change by `slope` with it, are 3, by the mean over `seeds`.
    #[cfg(unix)]
    fn found_with(seeds: &str, slope: &str) -> Fit {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let case = "[domain]\nsize = [\"8 mm\", \"8 mm\", \"8 mm\"]\ncells = [8, 8, 8]\n[material.glass]\n\
                    density = \"2500 kg/m^3\"\n[contact.default]\nnormal_stiffness = \"1e3 N/m\"\nrestitution = 0.3\n\
                    [[grains]]\nshape.sphere = { diameter = \"2 mm\" }\n\
                    placement.lattice = { lower = [\"1 mm\", \"1 mm\", \"3 mm\"], upper = [\"7 mm\", \"7 mm\", \"6 mm\"], \
                    counts = [1, 1, 1], jitter = 0.1 }\n[run]\nuntil = \"1 ms\"\n";
        fs::write(at("a.toml"), case).unwrap();
        fs::write(at("program"), NOISY.replace("SLOPE", slope)).unwrap();
        fs::set_permissions(at("program"), fs::Permissions::from_mode(0o700)).unwrap();
        let plan = format!(
            "case = \"a.toml\"\nseeds = {seeds}\n[keys]\n\"fluid.cfl\" = {{ from = 0.1, to = 0.5 }}\n\
             [targets]\n\"steps\" = {{ value = 3.0, tolerance = 0.05 }}\n"
        );
        let plan = Plan::parse(&at("plan.toml"), &plan).unwrap();
        let silent = &mut sazanami::progress::Silent;
        calibrate(&plan, &at("runs"), &at("program"), Some(4), silent, &Stop::new()).unwrap()
    }

    #[cfg(unix)]
    #[test]
    fn the_mean_over_seeds_finds_what_one_seed_misses() {
        let off = |fit: &Fit| (fit.keys[0].value.parse::<f64>().unwrap() - 0.3, fit.keys[0].uncertainty.unwrap());
        let fit = found_with("[1, 2, 3, 4]", "10");
        let (distance, uncertainty) = off(&fit);
        let error = fit.targets[0].error.unwrap();
        assert!(fit.is_met && fit.runs.is_multiple_of(4), "{fit:?}");
        // The standard deviation of what is drawn, over the root of four.
        assert!((error - 0.301_039_9).abs() < 1e-6, "{fit:?}");
        assert!((uncertainty / (error.hypot(0.05) / 10.0) - 1.0).abs() < 1e-6, "{fit:?}");
        assert!(distance.abs() < 2.0 * uncertainty && distance.abs() < 0.014, "{fit:?}");
        // The control: one seed meets the target, and is off by many times what it believes.
        let fit = found_with("[1]", "10");
        let (distance, uncertainty) = off(&fit);
        assert!(fit.is_met && fit.targets[0].error.is_none(), "{fit:?}");
        assert!((distance + 0.09).abs() <= 6e-3 && distance.abs() > 10.0 * uncertainty, "{fit:?}");
        // Another one: where the scatter hides the slope no key is determined, though the target may be met.
        let fit = found_with("[1, 2, 3, 4]", "0.5");
        assert!(fit.is_met && fit.keys[0].uncertainty.is_none(), "{fit:?}");
    }
}
