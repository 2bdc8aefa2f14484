//! Runs with moving particles: ripples, averages over layers and measured profiles, from the tables that they wrote.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use sazanami_io::MeasuredProfile;
use sazanami_io::picture::{
    LayerFigure, LayerHistory, Picture, ProfileFigure, ProfilesAtTime, RippleHistory, ripple_growth,
};
use sazanami_numerics::Real;
use sazanami_observe::ripples::{
    BedMatch, Growth, PhaseAverage, RippleSettings, Ripples, ShiftLimits, SurfaceProfile, Unmeasured, cycle_averages,
    match_bed, match_profiles, migration, phase_average,
};
use serde_json::Value;

use super::{Table, aligned, drawing, free_picture, list_files, number, summary};
use crate::case::meaning::{Case, LayerReference};
use crate::case::{self, LoadedCase};
use crate::error::CommandError;
use crate::progress::Progress;
use crate::recorder::{self, measure, tank_of, weight_of_grain};
use crate::results::ANALYSIS;

/// Times in a figure of profiles, side by side, at most.
const MOMENTS: usize = 3;
/// Heights shown in a figure of profiles about their mean [m].
const SHOWN: Real = 8e-3;
/// Part of a step of the series by which times are the same.
const SAME_TIME: Real = 1e-9;

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
}

/// What the tables of a run tell.
struct RunTables {
    case: Case,
    summary: Value,
    bed: Option<Profiles>,
    water: Option<Profiles>,
    /// Ripples at the times of the bed's profiles.
    ripples: Vec<(Real, Result<Ripples, Unmeasured>)>,
}

impl RunTables {
    fn read(folder: &Path, loaded: LoadedCase) -> Result<Self, CommandError> {
        let case = loaded.case;
        let bed = Profiles::read(&folder.join("bed.csv"), "z_concentration");
        let water = Profiles::read(&folder.join("water.csv"), "z");
        let mut ripples = Vec::new();
        if let (Some(bed), Some(how)) = (&bed, &case.ripples) {
            let tank = tank_of(&case);
            let all = bed.time.iter().zip(&bed.profile);
            ripples = all.map(|(&time, profile)| (time, measure(how, &tank, profile, tank.width()))).collect();
        }
        Ok(Self { case, summary: summary(folder)?, bed, water, ripples })
    }

    fn last_ripples(&self) -> Option<&Result<Ripples, Unmeasured>> {
        self.ripples.last().map(|(_, ripples)| ripples)
    }

    /// Heights of the ripples at the ends of whole periods, or at all times without a period [s, m].
    fn heights(&self) -> Vec<(Real, Real)> {
        let found = self.ripples.iter().filter_map(|(time, ripples)| Some((*time, ripples.as_ref().ok()?.height())));
        match self.period() {
            Some(period) => found
                .filter(|(time, _)| {
                    let phase = time / period;
                    phase > 0.5 && (phase - phase.round()).abs() < 1e-6 * phase.max(1.0)
                })
                .collect(),
            None => found.collect(),
        }
    }

    fn period(&self) -> Option<Real> {
        self.case.frame.as_ref()?.motion.as_ref()?.period()
    }

    /// Shift of the ripples in the last period [m], and how well they are the same.
    fn migration(&self) -> Option<(Real, Real)> {
        let (bed, period, settings) = (self.bed.as_ref()?, self.period()?, settings_of(&self.case)?);
        let (last, now) = (*bed.time.last()?, bed.profile.last()?);
        let (then, before) = bed.at(last - period);
        if (last - period - then).abs() > SAME_TIME * last.max(1.0) {
            return None;
        }
        let range = settings.range_in(&tank_of(&self.case));
        let longest = 0.5 * self.last_ripples()?.as_ref().ok()?.spectral_wavelength;
        let found = migration(before, now, range, longest, &settings).ok()?;
        Some((found.shift, found.correlation))
    }
}

/// How ripples are measured on the main surface of the bed; `None` if the case does not ask for it.
fn settings_of(case: &Case) -> Option<RippleSettings> {
    Some(recorder::settings_of(case.ripples.as_ref()?, tank_of(case).width()))
}

/// Whether a folder holds a run with moving particles.
pub(super) fn is_one(summary: &Value) -> bool {
    summary["solver"] == "mps"
}

/// Draws the figures of a run and tells what its tables say, evaluated as `overrides` of keys under `ripples` ask.
pub(super) fn of_run(
    folder: &Path,
    overrides: &[String],
    progress: &mut dyn Progress,
) -> Result<Vec<String>, CommandError> {
    let loaded = case::load_evaluated(&folder.join("case.toml"), overrides)?;
    let tables = RunTables::read(folder, loaded)?;
    let figures = if overrides.is_empty() { folder.join("figures") } else { folder.join(ANALYSIS) };
    std::fs::create_dir_all(&figures).map_err(|error| drawing(&error))?;
    let mut save = |picture: Result<Picture, sazanami_io::picture::PictureError>, name: &str| {
        let path = figures.join(name);
        picture.and_then(|picture| picture.save(&path)).map_err(|error| drawing(&error))?;
        progress.message(&format!("drew {}", path.display()));
        Ok::<(), CommandError>(())
    };
    let name = tables.summary["case"].as_str().unwrap_or("run").to_owned();
    let layers = layer_history(folder);
    let cycles = layers.as_ref().zip(tables.period()).map(|(layers, period)| averages(layers, period));
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
        save(figure.draw(), "layers.png")?;
    }
    let history = history(&name, &tables);
    if history.height.len() > 1 {
        save(ripple_growth(&format!("{name}: growth of ripples"), &[history], false), "growth.png")?;
    }
    if let Some(figure) = profiles(&name, std::slice::from_ref(&tables)) {
        save(figure, "profiles.png")?;
    }
    list_files(folder, &tables.summary)?;
    Ok(lines(folder, &tables, cycles.as_deref().unwrap_or_default()))
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
/// Table of what layers do in a cycle of the tank.
pub(crate) const CYCLES: &str = "cycles.csv";
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

/// Writes a row for each phase and for each whole cycle.
fn write_averages(path: &Path, cycles: &[CycleAverage]) -> std::io::Result<()> {
    let mut text = "layer,quantity,kind,phase_or_end_of_cycle,mean,deviation,cycles\n".to_owned();
    for CycleAverage { layer, quantity, phases, means } in cycles {
        if let Some(phases) = phases {
            for (n, (mean, deviation)) in phases.mean.iter().zip(&phases.deviation).enumerate() {
                let phase = n as Real / phases.mean.len() as Real;
                let _ = writeln!(text, "{layer},{quantity},phase,{phase},{mean:e},{deviation:e},{}", phases.cycles);
            }
        }
        for (end, mean) in means {
            let _ = writeln!(text, "{layer},{quantity},cycle,{end},{mean:e},,1");
        }
    }
    std::fs::write(path, text)
}

/// What layers did in a run; `None` if it did not look.
pub(crate) fn layer_history(folder: &Path) -> Option<LayerHistory> {
    let text = std::fs::read_to_string(folder.join("layers.csv")).ok()?;
    let mut rows = text.lines();
    let head: Vec<&str> = rows.next()?.split(',').map(|name| name.split(" [").next().unwrap_or(name)).collect();
    let at = |name: &str| head.iter().position(|column| *column == name);
    let (time, layer) = (at("time")?, at("layer")?);
    let places: Vec<usize> = QUANTITIES.iter().map(|name| at(name)).collect::<Option<_>>()?;
    let mut found = LayerHistory::default();
    for row in rows {
        let cells: Vec<&str> = row.split(',').collect();
        let value = |n: usize| cells.get(n).and_then(|cell| cell.parse().ok()).unwrap_or(Real::NAN);
        let upper = cells.get(layer).is_some_and(|name| name.trim_matches('"') == "upper");
        let into = if upper { &mut found.upper } else { &mut found.lower };
        for (column, &place) in into.iter_mut().zip(&places) {
            column.push(value(place));
        }
        if upper {
            found.time.push(value(time));
        }
    }
    (found.time.len() > 1).then_some(found)
}

/// Times at which profiles are drawn: those that were measured, or else the last that the case has pictures for.
fn moments(case: &Case, end: Real) -> Vec<Real> {
    let within = |time: &Real| *time <= end * (1.0 + SAME_TIME);
    let mut measured: Vec<Real> = case
        .ripples
        .iter()
        .flat_map(|ripples| &ripples.measured)
        .map(|measured| measured.time)
        .filter(within)
        .collect();
    measured.sort_by(Real::total_cmp);
    measured.dedup();
    if measured.is_empty() {
        measured = case.output.figures.at.iter().copied().filter(within).filter(|&time| time > 0.0).collect();
        if measured.len() > MOMENTS {
            // The first, the middle and the last of them.
            let last = measured.len() - 1;
            measured = (0..MOMENTS).map(|n| measured[n * last / (MOMENTS - 1)]).collect();
        }
    }
    if measured.is_empty() {
        measured.push(end);
    }
    measured.truncate(MOMENTS);
    measured
}

fn measured_at(case: &Case, time: Real) -> [Option<MeasuredProfile>; 2] {
    let all = case.ripples.iter().flat_map(|ripples| &ripples.measured);
    let found = all.into_iter().find(|measured| (measured.time - time).abs() < 1e-9);
    let read = |file: &Option<PathBuf>| MeasuredProfile::read_if_there(file.as_ref()?).ok().flatten();
    found.map_or([None, None], |measured| [read(&measured.bed), read(&measured.water)])
}

fn profiles(title: &str, runs: &[RunTables]) -> Option<Result<Picture, sazanami_io::picture::PictureError>> {
    let first = runs.first()?;
    let end = number(&first.summary, &["time_s"])?;
    let mean = |profiles: Option<&Profiles>| profiles.and_then(|all| all.profile.last()?.mean());
    let heights = |mean: Real| [mean - SHOWN, mean + SHOWN];
    let (bed, water) = (mean(first.bed.as_ref()).unwrap_or(0.0), mean(first.water.as_ref())?);
    let several = runs.len() > 1;
    let moments: Vec<ProfilesAtTime> = moments(&first.case, end)
        .into_iter()
        .map(|time| {
            let [measured_bed, measured_water] = measured_at(&first.case, time);
            let points = |profile: Option<MeasuredProfile>| profile.map(|profile| profile.points).unwrap_or_default();
            let mut moment = ProfilesAtTime {
                title: format!("t = {time:.2} s"),
                measured_bed: points(measured_bed),
                measured_water: points(measured_water),
                ..ProfilesAtTime::default()
            };
            for run in runs {
                let label = if several { run.summary["case"].as_str().unwrap_or("run") } else { "" };
                let of = |profiles: &Option<Profiles>| {
                    profiles.as_ref().map(|all| all.at(time).1.points_with_gaps().collect()).unwrap_or_default()
                };
                moment.bed.push((label.to_owned(), of(&run.bed)));
                moment.water.push((label.to_owned(), of(&run.water)));
            }
            moment
        })
        .collect();
    let longest = runs.iter().map(|run| [run.case.domain.lower.x, run.case.domain.upper.x]);
    let x_range = longest.fold([Real::INFINITY, Real::NEG_INFINITY], |[a, b], [c, d]| [a.min(c), b.max(d)]);
    let figure = ProfileFigure {
        title: &format!("{title}: surfaces of bed and water"),
        moments: &moments,
        x_range,
        bed_range: heights(bed),
        water_range: heights(water),
    };
    Some(figure.draw())
}

/// The table at the end of a run.
fn lines(folder: &Path, tables: &RunTables, cycles: &[CycleAverage]) -> Vec<String> {
    let mut rows: Vec<(String, String)> = Vec::new();
    let summary = &tables.summary;
    let mut row = |label: &str, value: String| rows.push((label.to_owned(), value));
    let said = |path: &[&str]| number(summary, path);
    for (label, path, unit, digits) in [
        ("time simulated", &["time_s"][..], "s", 4),
        ("steps", &["steps"], "", 0),
        ("grain sub-steps", &["grain_substeps"], "", 0),
        ("wall-clock time", &["wall_s"], "s", 1),
        ("fluid particles", &["counts", "fluid_particles"], "", 0),
        ("grains", &["counts", "grains"], "", 0),
    ] {
        if let Some(value) = said(path) {
            row(label, format!("{value:.digits$} {unit}"));
        }
    }
    match tables.last_ripples() {
        Some(Ok(ripples)) => {
            let mm = |value: &Result<Real, Unmeasured>| match value {
                Ok(value) => format!("{:.2} mm", 1e3 * value),
                Err(problem) => format!("not measured: {problem}"),
            };
            row("ripples: wavelength, spectrum", format!("{:.2} mm", 1e3 * ripples.spectral_wavelength));
            row("  from crossings", mm(&ripples.crossing_wavelength));
            row("  from correlation", mm(&ripples.correlation_wavelength));
            row("ripples: height, 2 sqrt(2) sigma", format!("{:.3} mm", 1e3 * ripples.height()));
            row("  crest to trough", mm(&ripples.crest_to_trough));
            row("  relief of the bed, rms", format!("{:.3} mm", 1e3 * ripples.relief));
            if let Ok(steepness) = ripples.steepness() {
                row("  steepness", format!("{steepness:.3}"));
            }
        }
        Some(Err(problem)) => row("ripples", format!("none measured: {problem}")),
        None => {}
    }
    if let Ok(growth) = Growth::of(&tables.heights()) {
        row(
            "  growth",
            format!("{:+.3} +- {:.3} 1/s over {} periods", growth.rate, growth.standard_error, growth.points),
        );
    }
    if let Some((shift, correlation)) = tables.migration() {
        row("  migration in the last period", format!("{:+.2} mm (correlation {correlation:.2})", 1e3 * shift));
    }
    for quantity in QUANTITIES {
        let of = |layer: &str| {
            let found = cycles.iter().find(|average| average.layer == layer && average.quantity == quantity);
            found.and_then(|average| Some(average.phases.as_ref()?.half_range()))
        };
        if let (Some(upper), Some(lower)) = (of("upper"), of("lower")) {
            let name = quantity.trim_end_matches("_1").replace('_', " ");
            row(
                &format!("  {name}, half range, upper / lower"),
                format!("{upper:.3e} / {lower:.3e} = {:.2}", upper / lower),
            );
        }
    }
    if let Some(extent) = said(&["observables", "water", "highest_less_lowest_mm"]) {
        row("water surface, highest less lowest", format!("{extent:.2} mm"));
    }
    for (label, key) in [
        ("bulk volume of the water, change", "fluid_bulk_volume_relative_change"),
        ("drag given and taken, residual", "drag_exchange_residual_relative"),
    ] {
        if let Some(value) = said(&["conservation", key]) {
            row(label, format!("{value:+.2e}"));
        }
    }
    if let Some(value) = said(&["particles", "worst_strain_rms"]) {
        row("largest volume strain, rms", format!("{:.2} %", 1e2 * value));
    }
    if let Some(value) = said(&["worst", "overlap_relative"]) {
        row("largest overlap of grains", format!("{:.1} % of a radius", 1e2 * value));
    }
    let counted = ["clipped", "collisions", "cut_voids", "plain_gradients"].map(|key| said(&["particles", key]));
    if let [Some(clipped), Some(collisions), Some(voids), Some(plain)] = counted {
        row(
            "put back, bounced, cut voids, plain gradients",
            format!("{clipped:.0}, {collisions:.0}, {voids:.0}, {plain:.0}"),
        );
    }
    rows.extend(compared(tables));
    if let Some(picture) = newest_picture(folder) {
        rows.push(("picture".into(), picture.display().to_string()));
    }
    let width = rows.iter().map(|(label, _)| label.len()).max().unwrap_or_default();
    rows.into_iter().map(|(label, value)| format!("{label:<width$}  {value}")).collect()
}

fn newest_picture(folder: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder.join("figures")).ok()?;
    let is_one = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("grains-"));
    entries.flatten().map(|entry| entry.path()).filter(is_one).max()
}

/// Lines about profiles that were measured.
fn compared(tables: &RunTables) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    let all = tables.case.ripples.iter().flat_map(|ripples| &ripples.measured);
    let end = number(&tables.summary, &["time_s"]).unwrap_or_default();
    for measured in all {
        let [bed, water] = measured_at(&tables.case, measured.time);
        let label = |what: &str| format!("{what} against experiment, t = {} s", measured.time);
        if measured.time > end * (1.0 + SAME_TIME) {
            rows.push((label("profiles"), "the run ends before".into()));
            continue;
        }
        for (what, file, profile, own) in
            [("bed", &measured.bed, &bed, &tables.bed), ("water", &measured.water, &water, &tables.water)]
        {
            let Some(file) = file else { continue };
            let Some(profile) = profile else {
                rows.push((label(what), format!("absent: {}", file.display())));
                continue;
            };
            let Some(own) = own else { continue };
            let limits = ShiftLimits { x: profile.x_shift_limit.unwrap_or(0.0), z: profile.z_shift_limit };
            let run = own.at(measured.time).1;
            let told = match (what, settings_of(&tables.case)) {
                ("bed", Some(settings)) => match_bed(run, &profile.points, limits, &settings).map(|m| told_of_bed(&m)),
                _ => match_profiles(run, &profile.points, limits).map(|m| {
                    let ratio = m.extent_ratio().map_or("none".into(), |ratio| format!("{ratio:.2}"));
                    format!(
                        "rmse {:.2} mm, correlation {}, wave height ratio {ratio}, moved by {:.1} and {:.1} mm",
                        1e3 * m.rmse,
                        two_digits(m.correlation),
                        1e3 * m.shift_x,
                        1e3 * m.shift_z
                    )
                }),
            };
            rows.push((label(what), told.unwrap_or_else(|problem| format!("not compared: {problem}"))));
        }
    }
    rows
}

fn two_digits(value: Option<Real>) -> String {
    value.map_or("none".into(), |value| format!("{value:.2}"))
}

fn told_of_bed(found: &BedMatch) -> String {
    let profiles = &found.profiles;
    format!(
        "rmse {:.2} mm ({} of the height), correlation {}, height ratio {}, wavelength ratio {}, crests that agree {}, \
         moved by {:.1} and {:.1} mm",
        1e3 * profiles.rmse,
        two_digits(found.relative_rmse()),
        two_digits(profiles.correlation),
        two_digits(found.height_ratio()),
        two_digits(found.wavelength_ratio()),
        two_digits(found.crests_agree),
        1e3 * profiles.shift_x,
        1e3 * profiles.shift_z
    )
}

/// Puts several runs, failed ones included, into one table and their growth and profiles into one figure each.
pub(super) fn several(folders: &[PathBuf], progress: &mut dyn Progress) -> Result<Vec<String>, CommandError> {
    let mut runs = Vec::new();
    for folder in folders {
        let loaded = case::load(&folder.join("case.toml"), &[])?;
        let mut tables = RunTables::read(folder, loaded)?;
        // Folders tell runs of one case apart.
        if let Some(name) = folder.file_name() {
            tables.summary["case"] = Value::String(name.to_string_lossy().into_owned());
        }
        runs.push(tables);
    }
    let name_of = |run: &RunTables| run.summary["case"].as_str().unwrap_or("run").to_owned();
    let histories: Vec<RippleHistory> =
        runs.iter().map(|run| history(&name_of(run), run)).filter(|history| history.height.len() > 1).collect();
    let mut draw = |picture: Result<Picture, sazanami_io::picture::PictureError>, name: &str| {
        let path = free_picture(Path::new(""), name);
        picture.and_then(|picture| picture.save(&path)).map_err(|error| drawing(&error))?;
        progress.message(&format!("drew {}", path.display()));
        Ok::<(), CommandError>(())
    };
    if !histories.is_empty() {
        draw(ripple_growth("Growth of ripples", &histories, false), "ripple-growth")?;
    }
    if let Some(figure) = profiles("Runs", &runs) {
        draw(figure, "ripple-profiles")?;
    }
    let header = [
        "run",
        "status",
        "L [mm]",
        "t [s]",
        "wavelength [mm]",
        "height [mm]",
        "relief [mm]",
        "growth [1/s]",
        "volume [%]",
    ];
    let rows: Vec<[String; 9]> = runs
        .iter()
        .map(|run| {
            let status = run.summary["status"].as_str().unwrap_or("unknown");
            let status = match run.summary["failure"]["kind"].as_str() {
                Some(kind) => format!("{status}: {kind}"),
                None => status.to_owned(),
            };
            let ripples = run.last_ripples().and_then(|ripples| ripples.as_ref().ok());
            let of = |value: fn(&Ripples) -> Real| ripples.map_or("none".into(), |r| format!("{:.2}", 1e3 * value(r)));
            let growth = Growth::of(&run.heights()).map_or("none".into(), |growth| format!("{:+.2}", growth.rate));
            let volume = number(&run.summary, &["conservation", "fluid_bulk_volume_relative_change"]);
            [
                name_of(run),
                status,
                format!("{:.0}", 1e3 * run.case.domain.extent().x),
                number(&run.summary, &["time_s"]).map_or("none".into(), |time| format!("{time:.3}")),
                of(|ripples| ripples.spectral_wavelength),
                of(Ripples::height),
                number(&run.summary, &["observables", "ripples", "relief_mm"])
                    .map_or("none".into(), |relief| format!("{relief:.2}")),
                growth,
                volume.map_or("none".into(), |volume| format!("{:+.2}", 1e2 * volume)),
            ]
        })
        .collect();
    Ok(aligned(&header.map(str::to_owned), &rows))
}
