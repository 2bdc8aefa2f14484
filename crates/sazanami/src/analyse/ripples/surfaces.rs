//! Surfaces of bed and water of one or several runs, as their figure shows them.

use std::path::Path;

use sazanami_io::MeasuredProfile;
use sazanami_numerics::Real;

use super::tables::{Profiles, RunTables, SAME_TIME};
use crate::analyse::output::Output;
use crate::artist::{Figure, Surfaces};
use crate::error::CommandError;
use crate::recorder::moment;
use crate::results::BED_DEFINITIONS;

/// Times in a figure of profiles, side by side, at most, unless more were measured.
const MOMENTS: usize = 3;

/// Times at which profiles are drawn \[s], in order, of those that at least half of the runs reach: all that were
/// measured, or else the first, the middle and the last that the cases have pictures for, or else the end.
pub(super) fn moments(runs: &[RunTables]) -> Vec<Real> {
    let measured = runs.iter().flat_map(|run| &run.case.ripples).flat_map(|ripples| &ripples.measured);
    let measured = shared(runs, measured.map(|measured| measured.time));
    if !measured.is_empty() {
        return measured;
    }
    let pictured = runs.iter().flat_map(|run| &run.case.output.figures.at).copied().filter(|&time| time > 0.0);
    let pictured = shared(runs, pictured);
    if pictured.len() > MOMENTS {
        return (0..MOMENTS).map(|n| pictured[n * (pictured.len() - 1) / (MOMENTS - 1)]).collect();
    }
    if !pictured.is_empty() {
        return pictured;
    }
    shared(runs, runs.iter().filter_map(RunTables::end)).pop().into_iter().collect()
}

/// Of some times \[s] those that at least half of the runs reach, in order, each once.
fn shared(runs: &[RunTables], times: impl Iterator<Item = Real>) -> Vec<Real> {
    let reaching = |time: Real| runs.iter().filter(|run| run.reaches(time)).count();
    let mut found: Vec<Real> = times.filter(|&time| 2 * reaching(time) >= runs.len()).collect();
    found.sort_by(Real::total_cmp);
    found.dedup_by(|a, b| (*a - *b).abs() <= SAME_TIME * b.max(1.0));
    found
}

/// The bed and the water that were measured at `time` \[s], each by the first run that has it.
fn measured_at(runs: &[RunTables], time: Real) -> [Option<MeasuredProfile>; 2] {
    runs.iter().fold([None, None], |[bed, water], run| {
        let [its_bed, its_water] = run.case.measured_at(time);
        [bed.or(its_bed), water.or(its_water)]
    })
}

/// Points of the profile at `time` \[s]; none where a run does not reach it.
fn points_at(profiles: Option<&Profiles>, time: Real) -> Vec<[Real; 2]> {
    let reached = profiles.and_then(|all| all.reached(time));
    reached.map(|profile| profile.points_with_gaps().collect()).unwrap_or_default()
}

/// Surfaces of one run at `time` \[s], and what it began with.
fn of_one(run: &RunTables, time: Real) -> Surfaces {
    let [main, image, top_layer] = BED_DEFINITIONS;
    let named = |name: &str, profiles: &Option<Profiles>| (name.to_owned(), points_at(profiles.as_ref(), time));
    let other_beds = [(image, &run.image), (top_layer, &run.top_layer)].map(|(name, all)| named(name, all));
    Surfaces {
        title: moment(&run.case, run.period, time),
        bed: vec![named(main, &run.bed)],
        water: vec![named("", &run.water)],
        other_beds: other_beds.into_iter().filter(|(_, points)| !points.is_empty()).collect(),
        first_bed: points_at(run.bed.as_ref(), 0.0),
        first_water: points_at(run.water.as_ref(), 0.0),
        ..Surfaces::default()
    }
}

/// Surfaces of several runs at `time` \[s], by the names of the runs.
fn of_several(runs: &[&RunTables], time: Real) -> Surfaces {
    let named = |surface: fn(&RunTables) -> Option<&Profiles>| {
        let name = |run: &RunTables| run.summary["case"].as_str().unwrap_or("run").to_owned();
        runs.iter().map(|run| (name(run), points_at(surface(run), time))).collect()
    };
    Surfaces {
        title: format!("t = {time:.2} s"),
        bed: named(|run| run.bed.as_ref()),
        water: named(|run| run.water.as_ref()),
        ..Surfaces::default()
    }
}

/// Draws surfaces of bed and water of runs at the times that most of them reach; a single run is shown with the bed by its
/// other definitions and with what it began with.
pub(super) fn draw(title: &str, runs: &[RunTables], path: &Path, output: &mut Output) -> Result<(), CommandError> {
    let times = moments(runs);
    if times.is_empty() || runs.iter().all(|run| run.water.is_none()) {
        return Ok(());
    }
    let shown: Vec<&RunTables> = runs.iter().filter(|run| times.iter().any(|&time| run.reaches(time))).collect();
    let moments: Vec<Surfaces> = times
        .iter()
        .map(|&time| {
            let points = |profile: Option<MeasuredProfile>| profile.map(|profile| profile.points).unwrap_or_default();
            let [measured_bed, measured_water] = measured_at(runs, time).map(points);
            let surfaces = match runs {
                [one] => of_one(one, time),
                _ => of_several(&shown, time),
            };
            Surfaces { measured_bed, measured_water, ..surfaces }
        })
        .collect();
    let longest = runs.iter().map(|run| [run.case.domain.lower.x, run.case.domain.upper.x]);
    let x_range = longest.fold([Real::INFINITY, Real::NEG_INFINITY], |[a, b], [c, d]| [a.min(c), b.max(d)]);
    let title = format!("{title}: surfaces of bed and water");
    output.draw(&Figure::Surfaces { title: &title, moments: &moments, x_range }, path)
}
