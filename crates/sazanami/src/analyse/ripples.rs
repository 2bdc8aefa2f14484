//! Runs with moving particles: ripples, averages over layers and measured profiles, from the tables that they wrote.

mod comparison;
mod findings;
mod measured;
mod report;

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use sazanami_io::{MeasuredProfile, replace_file};
use sazanami_numerics::Real;
use sazanami_observe::ripples::{
    BedSurfaceSettings, PhaseAverage, RippleSettings, Ripples, SurfaceProfile, Unmeasured, cycle_averages, migration,
    phase_average,
};
use sazanami_picture::{
    LayerFigure, LayerHistory, Picture, PictureError, ProfileFigure, ProfilesAtTime, RippleHistory, ripple_growth,
};
use serde_json::{Map, Value, json};

use super::figures::{drawing, list_files, save};
use super::summary_file::summary;
use super::table::Table;
use crate::case::meaning::{Case, LayerReference};
use crate::case::{self, LoadedCase, RIPPLES_EVALUATED};
use crate::columns::{Quantity, quantity};
use crate::error::CommandError;
use crate::progress::Progress;
use crate::recorder::{self, measure, moment, tank_of, weight_of_grain};
use crate::results::{
    ANALYSIS, BED_DEFINITIONS, BED_PROFILES, CASE, CYCLES, FIGURES, LAYER_MEANS, SUMMARY, WATER_PROFILES,
};

pub(super) use comparison::several;

/// Figures of a run.
const LAYERS_FIGURE: &str = "layers.png";
const GROWTH_FIGURE: &str = "growth.png";
const PROFILES_FIGURE: &str = "profiles.png";
/// Times in a figure of profiles, side by side, at most, unless more were measured.
const MOMENTS: usize = 3;
/// Part of a step of the series by which times are the same.
const SAME_TIME: Real = 1e-9;
/// Part of a period by which phases are the same: rows of the series need not fall on the ends of periods.
const SAME_PHASE: Real = 0.02;

/// Profiles of a run against time.
struct Profiles {
    time: Vec<Real>,
    profile: Vec<SurfaceProfile>,
}

impl Profiles {
    /// Reads the heights of one column of a table with a row for each time and place.
    fn read(path: &Path, column: &str) -> Option<Self> {
        let table = Table::read(path)?;
        let (times, places, heights) = (table.column("time"), table.column("x"), table.column(column));
        let mut found = Self { time: Vec::new(), profile: Vec::new() };
        let mut first = 0;
        while first < times.len() {
            let next = times[first..].iter().position(|&time| time != times[first]).map_or(times.len(), |n| first + n);
            let spacing = if next > first + 1 { places[first + 1] - places[first] } else { 1.0 };
            found.time.push(times[first]);
            found.profile.push(SurfaceProfile {
                start: places[first],
                spacing,
                heights: heights[first..next].iter().map(|&z| z.is_finite().then_some(z)).collect(),
            });
            first = next;
        }
        (!found.time.is_empty()).then_some(found)
    }

    /// The profile nearest in time.
    fn at(&self, time: Real) -> (Real, &SurfaceProfile) {
        let distance = |n: &usize| (self.time[*n] - time).abs();
        let nearest = (0..self.time.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or_default();
        (self.time[nearest], &self.profile[nearest])
    }

    /// The profile at `time` [s], no farther from it than rows are from one another there; `None` beyond the rows.
    fn reached(&self, time: Real) -> Option<&SurfaceProfile> {
        let (found, profile) = self.at(time);
        let after = self.time.partition_point(|&row| row <= found);
        let before = after.saturating_sub(2);
        let row = |n: usize| self.time[n.min(self.time.len() - 1)];
        let interval = (found - row(before)).max(row(after) - found);
        ((found - time).abs() <= interval + SAME_TIME * time.max(1.0)).then_some(profile)
    }

    /// The last profile.
    fn last(&self) -> &SurfaceProfile {
        &self.profile[self.profile.len() - 1]
    }

    /// Time of the last profile [s].
    fn end(&self) -> Real {
        self.time[self.time.len() - 1]
    }
}

/// Ripples by the tables of a run.
struct RunTables {
    case: Case,
    /// Width of the slab that the bed was seen in from the side, when the tables were written [m].
    slab: Real,
    summary: Value,
    /// The bed by its concentration, its main surface.
    bed: Option<Profiles>,
    /// The bed as seen from the side.
    image: Option<Profiles>,
    /// The mean of the topmost grains.
    top_layer: Option<Profiles>,
    water: Option<Profiles>,
    /// Ripples at the times of the bed's profiles.
    ripples: Vec<(Real, Result<Ripples, Unmeasured>)>,
    /// Period of the tank [s], if it moves in cycles.
    period: Option<Real>,
}

impl RunTables {
    fn read(folder: &Path, loaded: LoadedCase) -> Result<Self, CommandError> {
        let case = loaded.case;
        // Other keys do not change what was gathered during the run.
        let as_run = case::load(&folder.join(CASE), &[]).ok().and_then(|run| run.case.ripples);
        let slab = as_run
            .as_ref()
            .or(case.ripples.as_ref())
            .map_or(0.0, |how| BedSurfaceSettings::of_grains(how.grain_size).slab);
        let [bed, image, top_layer] = ["z_concentration", "z_image", "z_top_layer"]
            .map(|column| Profiles::read(&folder.join(BED_PROFILES), column));
        let water = Profiles::read(&folder.join(WATER_PROFILES), "z");
        let mut ripples = Vec::new();
        if let (Some(bed), Some(how)) = (&bed, &case.ripples) {
            let tank = tank_of(&case);
            let all = bed.time.iter().zip(&bed.profile);
            ripples = all.map(|(&time, profile)| (time, measure(how, &tank, profile, tank.width()))).collect();
        }
        let period = case.period();
        Ok(Self { case, slab, summary: summary(folder)?, bed, image, top_layer, water, ripples, period })
    }

    /// Time of the last profiles [s], if there are any.
    fn end(&self) -> Option<Real> {
        let ends = [&self.bed, &self.water].into_iter().flatten().map(Profiles::end);
        ends.reduce(Real::max)
    }

    /// Whether there are profiles at `time` [s].
    fn reaches(&self, time: Real) -> bool {
        [&self.bed, &self.water].into_iter().flatten().any(|profiles| profiles.reached(time).is_some())
    }

    fn last_ripples(&self) -> Option<&Result<Ripples, Unmeasured>> {
        self.ripples.last().map(|(_, ripples)| ripples)
    }

    /// Heights of the ripples at the ends of whole periods, or at all times without a period [s, m].
    fn heights(&self) -> Vec<(Real, Real)> {
        let found = self.ripples.iter().filter_map(|(time, ripples)| Some((*time, ripples.as_ref().ok()?.height())));
        match self.period {
            Some(period) => at_whole_periods(found, period),
            None => found.collect(),
        }
    }

    /// Shift of the ripples in the last period [m], and how well they are the same.
    fn migration(&self) -> Option<(Real, Real)> {
        let (bed, period, settings) = (self.bed.as_ref()?, self.period?, settings_of(&self.case)?);
        let (last, now) = (*bed.time.last()?, bed.profile.last()?);
        let (then, before) = bed.at(last - period);
        if (last - period - then).abs() > SAME_PHASE * period {
            return None;
        }
        let range = settings.range_in(&tank_of(&self.case));
        let longest = 0.5 * self.last_ripples()?.as_ref().ok()?.spectral_wavelength;
        let found = migration(before, now, range, longest, &settings).ok()?;
        Some((found.shift, found.correlation))
    }
}

/// Of times [s] and values those at the ends of whole periods [s], or the nearest to each of them.
fn at_whole_periods(series: impl Iterator<Item = (Real, Real)>, period: Real) -> Vec<(Real, Real)> {
    let end = |time: Real| (time / period).round();
    let distance = |time: Real| (time / period - end(time)).abs();
    let mut found: Vec<(Real, Real)> = Vec::new();
    for (time, value) in series.filter(|&(time, _)| end(time) > 0.0 && distance(time) < SAME_PHASE) {
        match found.last_mut().filter(|last| end(last.0) == end(time)) {
            Some(last) if distance(last.0) <= distance(time) => {}
            Some(last) => *last = (time, value),
            None => found.push((time, value)),
        }
    }
    found
}

/// How ripples are measured on the main surface of the bed; `None` if the case does not ask for it.
fn settings_of(case: &Case) -> Option<RippleSettings> {
    Some(recorder::settings_of(case.ripples.as_ref()?, tank_of(case).width()))
}

/// Draws the figures of a run and reports what its tables show, evaluated as `overrides` of keys under `ripples` ask. What
/// the tables show of the whole run goes into its summary, or into one of its own if keys are overridden.
pub(super) fn of_run(
    folder: &Path,
    overrides: &[String],
    progress: &mut dyn Progress,
) -> Result<Vec<String>, CommandError> {
    let loaded = case::load_evaluated(&folder.join(CASE), overrides, &RIPPLES_EVALUATED)?;
    let tables = RunTables::read(folder, loaded)?;
    let figures = if overrides.is_empty() { folder.join(FIGURES) } else { folder.join(ANALYSIS) };
    std::fs::create_dir_all(&figures).map_err(|error| drawing(&error))?;
    for name in [LAYERS_FIGURE, GROWTH_FIGURE, PROFILES_FIGURE] {
        // What an earlier call found otherwise is no part of this.
        let _ = std::fs::remove_file(figures.join(name));
    }
    let mut draw = |picture: Result<Picture, PictureError>, name: &str| save(picture, &figures.join(name), progress);
    let name = tables.summary["case"].as_str().unwrap_or("run").to_owned();
    let layers = layer_history(folder);
    let cycles = layers.as_ref().zip(tables.period).map(|(layers, period)| averages(layers, period));
    if let Some(cycles) = cycles.as_ref().filter(|cycles| !cycles.is_empty()) {
        let place = if overrides.is_empty() { folder } else { &figures };
        write_averages(&place.join(CYCLES), cycles).map_err(|error| drawing(&error))?;
    }
    if let Some(figure) = layers {
        let title = format!("{name}: averages over the layers of the bed");
        let names = layer_names(&tables.case);
        let names = names.each_ref().map(String::as_str);
        let weight = weight_of_grain(&tables.case);
        let figure = LayerFigure {
            title: &title,
            runs: &[figure],
            layers: names,
            time_range: None,
            ranges: [None; 4],
            submerged_weight: (weight > 0.0).then_some(weight),
        };
        draw(figure.draw(), LAYERS_FIGURE)?;
    }
    let history = history(&name, &tables);
    if history.height.len() > 1 {
        draw(ripple_growth(&format!("{name}: growth of ripples"), &[history], false), GROWTH_FIGURE)?;
    }
    if let Some(figure) = profiles(&name, std::slice::from_ref(&tables)) {
        draw(figure, PROFILES_FIGURE)?;
    }
    let cycles = cycles.unwrap_or_default();
    let compared = measured::compared(&tables);
    let found = findings::of_history(&tables, &cycles, &compared);
    if overrides.is_empty() {
        keep(folder, &tables.summary, found)?;
    } else {
        write_apart(&figures, overrides, &tables, found, progress)?;
    }
    list_files(folder, &tables.summary)?;
    Ok(report::lines(folder, &tables, &cycles, &compared))
}

/// Puts what was found into the summary of a run that has ended.
fn keep(folder: &Path, summary: &Value, found: Map<String, Value>) -> Result<(), CommandError> {
    if summary["status"] == "running" || found.is_empty() {
        return Ok(());
    }
    recorder::put_ripples(folder, found).map_err(|error| drawing(&error))
}

/// Writes what was found with other keys into the folder `place`, with the ripples at the end as they ask.
fn write_apart(
    place: &Path,
    overrides: &[String],
    tables: &RunTables,
    found: Map<String, Value>,
    progress: &mut dyn Progress,
) -> Result<(), CommandError> {
    let mut ripples = findings::at_the_end(tables);
    ripples.extend(found);
    let summary = &tables.summary;
    let value = json!({
        "case": summary["case"],
        "case_hash": summary["case_hash"],
        "version": env!("CARGO_PKG_VERSION"),
        "overrides": overrides,
        "time_s": tables.end(),
        "observables": { "ripples": ripples },
    });
    let path = place.join(SUMMARY);
    sazanami_io::table::write_json(&path, &value).map_err(|error| drawing(&error))?;
    progress.message(&format!("wrote {}", path.display()));
    Ok(())
}

fn history(name: &str, tables: &RunTables) -> RippleHistory {
    let measured = || tables.ripples.iter().filter_map(|(time, ripples)| Some((*time, ripples.as_ref().ok()?)));
    RippleHistory {
        label: name.to_owned(),
        height: measured().map(|(time, ripples)| [time, ripples.height()]).collect(),
        wavelength: measured().map(|(time, ripples)| [time, ripples.spectral_wavelength]).collect(),
        measured: false,
    }
}

fn layer_names(case: &Case) -> [String; 2] {
    let Some(ripples) = &case.ripples else { return ["upper".into(), "lower".into()] };
    let thickness = 1e3 * ripples.layer_thickness;
    match ripples.layers {
        LayerReference::Surface => [format!("upper {thickness} mm"), format!("next {thickness} mm")],
        LayerReference::Floor | LayerReference::Initial => {
            [format!("{thickness} to {} mm above the floor", 2.0 * thickness), format!("below {thickness} mm")]
        }
    }
}

/// Quantities that are averaged over layers, by their columns.
const QUANTITIES: [&str; 4] = ["water_velocity_1", "grain_velocity_1", "drag_1", "pressure_force_1"];
/// Cycles at the end of a run that are averaged over, and phases of a cycle.
const LAST_CYCLES: usize = 4;
const PHASES: usize = 20;

/// A quantity of a layer in a cycle of the tank.
struct CycleAverage {
    layer: &'static str,
    quantity: &'static str,
    /// By phase, over the last cycles, where the run has as many.
    phases: Option<PhaseAverage>,
    /// Ends of cycles [s] and means over each.
    means: Vec<(Real, Real)>,
}

impl CycleAverage {
    /// Half of what a quantity spans in a mean cycle, in the upper and in the lower layer.
    fn half_ranges(all: &[Self], quantity: &str) -> Option<[Real; 2]> {
        let of = |layer: &str| {
            let found = all.iter().find(|average| average.layer == layer && average.quantity == quantity);
            Some(found?.phases.as_ref()?.half_range())
        };
        Some([of("upper")?, of("lower")?])
    }
}

/// What layers do in cycles of a `period` [s].
fn averages(layers: &LayerHistory, period: Real) -> Vec<CycleAverage> {
    let sides = [("upper", &layers.upper), ("lower", &layers.lower)];
    let each = sides.into_iter().flat_map(|(layer, columns)| {
        QUANTITIES.iter().zip(columns).map(move |(quantity, column)| (layer, *quantity, column))
    });
    each.map(|(layer, quantity, column)| {
        let pairs = layers.time.iter().copied().zip(column.iter().copied());
        let series: Vec<(Real, Real)> = pairs.filter(|(_, value)| value.is_finite()).collect();
        let last = layers.time.last().copied().unwrap_or_default();
        let cycles = ((last / period + 1e-6).floor() as usize).min(LAST_CYCLES);
        CycleAverage {
            layer,
            quantity,
            phases: phase_average(&series, period, cycles, PHASES).ok(),
            means: cycle_averages(&series, period),
        }
    })
    .collect()
}

/// A row of the table of cycles.
pub(crate) struct CycleRow {
    layer: &'static str,
    quantity: &'static str,
    kind: &'static str,
    place: Real,
    mean: Real,
    deviation: Option<Real>,
    cycles: usize,
}

/// Value of a column of the table of cycles, as text.
pub(crate) type CycleValue = fn(&CycleRow) -> String;

/// Columns of the table of cycles.
pub(crate) const CYCLE_COLUMNS: &[Quantity<CycleValue>] = &[
    quantity("layer", "", "`upper` or `lower`", |row| row.layer.to_owned()),
    quantity("quantity", "", "column of `layers.csv` that is averaged, in its unit", |row| row.quantity.to_owned()),
    quantity("kind", "", "`phase`: mean over the last cycles at a phase; `cycle`: mean over one whole cycle", |row| {
        row.kind.to_owned()
    }),
    quantity("phase_or_end_of_cycle", "", "phase from 0 to 1, or end of the cycle [s]", |row| row.place.to_string()),
    quantity("mean", "", "the mean", |row| format!("{:e}", row.mean)),
    quantity("deviation", "", "standard deviation over the cycles at that phase", |row| {
        row.deviation.map_or_else(String::new, |deviation| format!("{deviation:e}"))
    }),
    quantity("cycles", "", "number of cycles in the mean", |row| row.cycles.to_string()),
];

/// Writes a row for each phase and for each whole cycle.
fn write_averages(path: &Path, cycles: &[CycleAverage]) -> std::io::Result<()> {
    let names: Vec<&str> = CYCLE_COLUMNS.iter().map(|column| column.name).collect();
    let mut text = names.join(",") + "\n";
    let mut add = |row: &CycleRow| {
        let values: Vec<String> = CYCLE_COLUMNS.iter().map(|column| (column.value)(row)).collect();
        let _ = writeln!(text, "{}", values.join(","));
    };
    for &CycleAverage { layer, quantity, ref phases, ref means } in cycles {
        if let Some(phases) = phases {
            for (n, (&mean, &deviation)) in phases.mean.iter().zip(&phases.deviation).enumerate() {
                let place = n as Real / phases.mean.len() as Real;
                let (deviation, cycles) = (Some(deviation), phases.cycles);
                add(&CycleRow { layer, quantity, kind: "phase", place, mean, deviation, cycles });
            }
        }
        for &(place, mean) in means {
            add(&CycleRow { layer, quantity, kind: "cycle", place, mean, deviation: None, cycles: 1 });
        }
    }
    replace_file(path, |file| file.write_all(text.as_bytes()))
}

/// What layers did in a run; `None` if it did not look.
pub fn layer_history(folder: &Path) -> Option<LayerHistory> {
    let table = Table::read(&folder.join(LAYER_MEANS))?;
    let (times, columns) = (table.column("time"), QUANTITIES.map(|name| table.column(name)));
    let is_upper: Vec<bool> = table.words("layer").iter().map(|layer| *layer == "upper").collect();
    let of = |values: &Vec<Real>, upper: bool| -> Vec<Real> {
        values.iter().zip(&is_upper).filter(|(_, is_upper)| **is_upper == upper).map(|(value, _)| *value).collect()
    };
    let layer = |upper: bool| columns.each_ref().map(|column| of(column, upper));
    let found = LayerHistory { time: of(&times, true), upper: layer(true), lower: layer(false), ..Default::default() };
    let is_whole = columns.iter().all(|column| column.len() == times.len());
    (is_whole && found.time.len() > 1).then_some(found)
}

/// Times at which profiles are drawn [s], in order, of those that at least half of the runs reach: all that were
/// measured, or else the first, the middle and the last that the cases have pictures for, or else the end.
fn moments(runs: &[RunTables]) -> Vec<Real> {
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

/// Of some times [s] those that at least half of the runs reach, in order, each once.
fn shared(runs: &[RunTables], times: impl Iterator<Item = Real>) -> Vec<Real> {
    let reaching = |time: Real| runs.iter().filter(|run| run.reaches(time)).count();
    let mut found: Vec<Real> = times.filter(|&time| 2 * reaching(time) >= runs.len()).collect();
    found.sort_by(Real::total_cmp);
    found.dedup_by(|a, b| (*a - *b).abs() <= SAME_TIME * b.max(1.0));
    found
}

/// The bed and the water that were measured at `time` [s], each by the first run that has it.
fn measured_at(runs: &[RunTables], time: Real) -> [Option<MeasuredProfile>; 2] {
    runs.iter().fold([None, None], |[bed, water], run| {
        let [its_bed, its_water] = run.case.measured_at(time);
        [bed.or(its_bed), water.or(its_water)]
    })
}

/// Points of the profile at `time` [s]; none where a run does not reach it.
fn points_at(profiles: Option<&Profiles>, time: Real) -> Vec<[Real; 2]> {
    let reached = profiles.and_then(|all| all.reached(time));
    reached.map(|profile| profile.points_with_gaps().collect()).unwrap_or_default()
}

/// Surfaces of one run at `time` [s], and what it began with.
fn of_one(run: &RunTables, time: Real) -> ProfilesAtTime {
    let [main, image, top_layer] = BED_DEFINITIONS;
    let named = |name: &str, profiles: &Option<Profiles>| (name.to_owned(), points_at(profiles.as_ref(), time));
    let other_beds = [(image, &run.image), (top_layer, &run.top_layer)].map(|(name, all)| named(name, all));
    ProfilesAtTime {
        title: moment(&run.case, run.period, time),
        bed: vec![named(main, &run.bed)],
        water: vec![named("", &run.water)],
        other_beds: other_beds.into_iter().filter(|(_, points)| !points.is_empty()).collect(),
        first_bed: points_at(run.bed.as_ref(), 0.0),
        first_water: points_at(run.water.as_ref(), 0.0),
        ..ProfilesAtTime::default()
    }
}

/// Surfaces of several runs at `time` [s], by the names of the runs.
fn of_several(runs: &[&RunTables], time: Real) -> ProfilesAtTime {
    let named = |surface: fn(&RunTables) -> Option<&Profiles>| {
        let name = |run: &RunTables| run.summary["case"].as_str().unwrap_or("run").to_owned();
        runs.iter().map(|run| (name(run), points_at(surface(run), time))).collect()
    };
    ProfilesAtTime {
        title: format!("t = {time:.2} s"),
        bed: named(|run| run.bed.as_ref()),
        water: named(|run| run.water.as_ref()),
        ..ProfilesAtTime::default()
    }
}

/// Surfaces of bed and water of runs at the times that most of them reach; a single run is shown with the bed by its
/// other definitions and with what it began with.
fn profiles(title: &str, runs: &[RunTables]) -> Option<Result<Picture, PictureError>> {
    let times = moments(runs);
    if times.is_empty() || runs.iter().all(|run| run.water.is_none()) {
        return None;
    }
    let shown: Vec<&RunTables> = runs.iter().filter(|run| times.iter().any(|&time| run.reaches(time))).collect();
    let moments: Vec<ProfilesAtTime> = times
        .iter()
        .map(|&time| {
            let points = |profile: Option<MeasuredProfile>| profile.map(|profile| profile.points).unwrap_or_default();
            let [measured_bed, measured_water] = measured_at(runs, time).map(points);
            let surfaces = match runs {
                [one] => of_one(one, time),
                _ => of_several(&shown, time),
            };
            ProfilesAtTime { measured_bed, measured_water, ..surfaces }
        })
        .collect();
    let longest = runs.iter().map(|run| [run.case.domain.lower.x, run.case.domain.upper.x]);
    let x_range = longest.fold([Real::INFINITY, Real::NEG_INFINITY], |[a, b], [c, d]| [a.min(c), b.max(d)]);
    Some(ProfileFigure { title: &format!("{title}: surfaces of bed and water"), moments: &moments, x_range }.draw())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profiles(time: &[Real]) -> Profiles {
        let profile = |_| SurfaceProfile::complete(0.0, 1.0, [0.0; 3]);
        Profiles { time: time.to_vec(), profile: time.iter().map(profile).collect() }
    }

    #[test]
    fn times_beyond_the_rows_are_not_reached() {
        let rows = profiles(&[0.0, 0.1, 0.2, 0.5]);
        let reached = |time: Real| rows.reached(time).is_some();
        assert!(reached(0.0) && reached(0.05) && reached(0.35) && reached(0.5) && reached(0.7));
        assert!(!reached(0.9) && !reached(3.0));
        let one = profiles(&[1.0]);
        assert!(one.reached(1.0).is_some() && one.reached(1.1).is_none());
    }

    #[test]
    fn one_row_stands_for_the_end_of_a_period() {
        let rows = (0..=20).map(|n| (0.1 * Real::from(n), Real::from(n)));
        let ends = |period: Real| at_whole_periods(rows.clone(), period).iter().map(|end| end.1).collect::<Vec<_>>();
        assert_eq!(ends(0.5), [5.0, 10.0, 15.0, 20.0]);
        // A period that no row hits, and rows of which several come near.
        assert_eq!(ends(0.502), [5.0, 10.0, 15.0, 20.0]);
        assert_eq!(ends(0.53), [16.0]);
        let close = (0..=100).map(|n| (0.005 * Real::from(n), Real::from(n)));
        assert_eq!(at_whole_periods(close, 0.499), [(0.5, 100.0)]);
    }
}
