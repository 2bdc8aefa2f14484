//! The plots of ripples in a shaken tank, from quantities in SI units: profiles of bed and water, layer averages,
//! growth (figures 2 and 4 of Tazaki, Harada, Ikari and Gotoh, ripples in an oscillating tank).

use sazanami::artist::{LayerHistory, RippleHistory, Surfaces};

use super::axes::round_range;
use super::colour::{BLACK, GREY, LINES};
use super::tiles::sheet;
use super::{Dash, LinePlot, Mark, Picture, PictureError, Trace, check_length};

/// Width of the plots of histories \[pixels].
const WIDTH: usize = 1100;
/// Height of the frames of profiles \[pixels].
const PROFILE_HEIGHT: usize = 270;
/// A level surface is shown within this range of heights [mm].
const LEAST_RANGE: f64 = 2.0;
/// Points of a photograph closer than this part of the width of a plot are thinned out.
const CLOSEST: f64 = 1.0 / 150.0;

/// Curves and marks of the bed [mm], the farthest behind first.
fn traces_of_bed(surfaces: &Surfaces, closest: f64) -> Vec<Trace> {
    let mut traces = traces_of_start(&surfaces.first_bed);
    for (number, (label, points)) in surfaces.other_beds.iter().enumerate() {
        let colour = LINES[(surfaces.bed.len() + number) % LINES.len()];
        traces.push(Trace::line(label, in_mm(points)).thin().coloured(colour));
    }
    traces.extend(traces_of_runs(&surfaces.bed));
    traces.extend(traces_of_experiment(&surfaces.measured_bed, closest));
    traces
}

/// Curves and marks of the water surface [mm], the farthest behind first.
fn traces_of_water(surfaces: &Surfaces, closest: f64) -> Vec<Trace> {
    let mut traces = traces_of_start(&surfaces.first_water);
    traces.extend(traces_of_runs(&surfaces.water));
    traces.extend(traces_of_experiment(&surfaces.measured_water, closest));
    traces
}

fn in_mm(points: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> + '_ {
    points.iter().map(|point| point.map(|v| 1e3 * v))
}

fn traces_of_start(points: &[[f64; 2]]) -> Vec<Trace> {
    if points.is_empty() { Vec::new() } else { vec![Trace::line("at the start", in_mm(points)).coloured(GREY).thin()] }
}

fn traces_of_runs(runs: &[(String, Vec<[f64; 2]>)]) -> impl Iterator<Item = Trace> + '_ {
    let line = |(number, (label, points)): (usize, &(String, Vec<[f64; 2]>))| {
        Trace::line(label, in_mm(points)).coloured(LINES[number % LINES.len()])
    };
    runs.iter().enumerate().filter(|(_, (_, points))| !points.is_empty()).map(line)
}

/// Readings of an experiment, at least `closest` \[m] apart.
fn traces_of_experiment(points: &[[f64; 2]], closest: f64) -> Option<Trace> {
    let shown = thinned(points, closest);
    (!shown.is_empty()).then(|| Trace::marks("experiment", Mark::Dot, in_mm(&shown)).coloured(BLACK))
}

/// Round heights that hold all of the traces; the same for all instants.
fn heights_of<'a>(traces: impl Iterator<Item = &'a Trace>) -> [f64; 2] {
    let heights = traces.flat_map(|trace| &trace.points).map(|point| point[1]).filter(|z| z.is_finite());
    let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)]);
    if low > high {
        return [0.0, LEAST_RANGE];
    }
    let (middle, half) = (0.5 * (low + high), 0.5 * (1.06 * (high - low)).max(LEAST_RANGE));
    round_range(middle - half, middle + half)
}

/// Bed (above) and water surface (below) at one or several instants side by side, each within the heights that it
/// reaches at any of them, drawn higher than it is: how much the axes say. A bed that no instant has is left out.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileFigure<'a> {
    /// Title of the sheet.
    pub title: &'a str,
    /// The instants.
    pub moments: &'a [Surfaces],
    /// Part of x1 shown \[m].
    pub x_range: [f64; 2],
}

impl ProfileFigure<'_> {
    /// Draws the figure.
    ///
    /// # Errors
    /// If there is no instant.
    pub fn draw(&self) -> Result<Picture, PictureError> {
        if self.moments.is_empty() {
            return Err(PictureError::WrongLength { what: "profiles at instants", expected: 1, found: 0 });
        }
        let width = if self.moments.len() == 1 { 1100 } else { 860 };
        let closest = CLOSEST * (self.x_range[1] - self.x_range[0]);
        let beds: Vec<_> = self.moments.iter().map(|moment| traces_of_bed(moment, closest)).collect();
        let waters: Vec<_> = self.moments.iter().map(|moment| traces_of_water(moment, closest)).collect();
        let ranges = [&beds, &waters].map(|all| heights_of(all.iter().flatten()));
        let mut key = LinePlot::new("", "", "");
        for trace in beds.iter().chain(&waters).flatten() {
            if !key.traces.iter().any(|known| known.label == trace.label) {
                key.traces.push(trace.clone());
            }
        }
        let strip = key.legend_strip(width * self.moments.len());
        let with_bed = beds.iter().any(|traces| !traces.is_empty());
        let (mut above, mut below) = (Vec::new(), Vec::new());
        for ((moment, bed), water) in self.moments.iter().zip(beds).zip(waters) {
            if with_bed {
                let bed = self.plot([&moment.title, "", "bed"], bed, ranges[0], width);
                above.push(bed.framed(width, PROFILE_HEIGHT).draw()?);
            }
            let title = if with_bed { "" } else { &moment.title };
            let water = self.plot([title, "x₁ [mm]", "water"], water, ranges[1], width);
            below.push(water.framed(width, PROFILE_HEIGHT).draw()?);
        }
        let rows: Vec<_> = [vec![strip], above, below].into_iter().filter(|row| !row.is_empty()).collect();
        Ok(sheet(self.title, &rows))
    }

    /// A plot of a surface in a picture of `width` \[pixels].
    fn plot(&self, [title, x_label, what]: [&str; 3], traces: Vec<Trace>, heights: [f64; 2], width: usize) -> LinePlot {
        let x_range = self.x_range.map(|x| 1e3 * x);
        let along = LinePlot::frame_width(width) / (x_range[1] - x_range[0]);
        let upwards = PROFILE_HEIGHT as f64 / (heights[1] - heights[0]);
        let mut plot = LinePlot::new(title, x_label, &format!("{what} [mm], heights ×{:.1}", upwards / along));
        plot.x_range = Some(x_range);
        plot.y_range = Some(heights);
        plot.traces = traces;
        without_labels(plot)
    }
}

/// Points at least `closest` apart in x.
fn thinned(points: &[[f64; 2]], closest: f64) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::new();
    for point in points {
        if kept.last().is_none_or(|last| (point[0] - last[0]).abs() >= closest * (1.0 - 1e-9)) {
            kept.push(*point);
        }
    }
    kept
}

fn without_labels(mut plot: LinePlot) -> LinePlot {
    plot.traces.iter_mut().for_each(|trace| trace.label.clear());
    plot
}

/// Layer averages against time, four plots below each other; the upper layer is a solid line, the lower one is dashed.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerFigure<'a> {
    /// Title of the sheet.
    pub title: &'a str,
    /// Layer averages of each run against time.
    pub runs: &'a [LayerHistory],
    /// Names of the layers in the legend: upper, lower.
    pub layers: [&'a str; 2],
    /// Times shown \[s], or all.
    pub time_range: Option<[f64; 2]>,
    /// Ranges of the four quantities, or what the data need.
    pub ranges: [Option<[f64; 2]>; 4],
    /// Submerged weight of a grain \[N], in parts of which the forces are shown; without it they are shown in N.
    pub submerged_weight: Option<f64>,
}

impl LayerFigure<'_> {
    /// Draws the figure.
    ///
    /// # Errors
    /// If a quantity does not have one value for each time.
    pub fn draw(&self) -> Result<Picture, PictureError> {
        let [drag, pressure] = match self.submerged_weight {
            Some(_) => ["drag f_{d,x} / W", "pressure f_{p,x} / W"],
            None => ["drag f_{d,x} [N]", "pressure f_{p,x} [N]"],
        };
        let labels = ["water u_{x} [m/s]", "grains v_{x} [m/s]", drag, pressure];
        let mut rows = Vec::new();
        for (quantity, label) in labels.into_iter().enumerate() {
            let is_last = quantity + 1 == labels.len();
            let mut plot = LinePlot::new("", if is_last { "t [s]" } else { "" }, label);
            let unit = if quantity < 2 { 1.0 } else { self.submerged_weight.unwrap_or(1.0) };
            plot.x_range = self.time_range;
            plot.y_range = self.ranges[quantity];
            for (number, run) in self.runs.iter().enumerate() {
                let layers = [(&run.upper, self.layers[0], Dash::Whole), (&run.lower, self.layers[1], Dash::Dashed)];
                for (values, layer, dash) in layers {
                    check_length("a layer average", run.time.len(), values[quantity].len())?;
                    let name = if run.label.is_empty() { layer.to_owned() } else { format!("{}: {layer}", run.label) };
                    let points = run.time.iter().zip(&values[quantity]).map(|(&time, &value)| [time, value / unit]);
                    plot = plot.with(Trace::line(&name, points).dashed(dash).coloured(LINES[number % LINES.len()]));
                }
            }
            if quantity == 0 {
                rows.push(vec![plot.legend_strip(WIDTH)]);
            }
            rows.push(vec![without_labels(plot).framed(WIDTH, 190).draw()?]);
        }
        Ok(sheet(self.title, &rows))
    }
}

/// Growth of ripples: height (above) and wavelength (below) against time, several runs in one figure. With `log` the
/// heights have a logarithmic axis, on which exponential growth is straight.
///
/// # Errors
/// If a logarithmic axis has nothing to show.
pub fn ripple_growth(title: &str, runs: &[RippleHistory], log: bool) -> Result<Picture, PictureError> {
    let all = || runs.iter().flat_map(|run| run.height.iter().chain(&run.wavelength)).map(|point| point[0]);
    let last = all().fold(0.0, f64::max);
    let first = all().fold(0.0, f64::min);
    let plot = |x_label: &str, label: &str, values: fn(&RippleHistory) -> &Vec<[f64; 2]>| {
        let mut plot = LinePlot::new("", x_label, label);
        plot.x_range = (last > first).then_some([first, last]);
        for (number, run) in runs.iter().enumerate() {
            let points = values(run).iter().map(|&[time, value]| [time, 1e3 * value]);
            let trace = if run.measured {
                Trace::marks(&run.label, Mark::Ring, points).coloured(BLACK)
            } else {
                Trace::line(&run.label, points).coloured(LINES[number % LINES.len()])
            };
            plot = plot.with(trace);
        }
        plot
    };
    let mut heights = plot("", "ripple height [mm]", |run| &run.height);
    heights.y_log = log;
    let lengths = plot("t [s]", "wavelength [mm]", |run| &run.wavelength);
    let strip = heights.legend_strip(WIDTH);
    let [above, below] = [heights, lengths].map(|plot| without_labels(plot).framed(WIDTH, 300).draw());
    Ok(sheet(title, &[vec![strip], vec![above?], vec![below?]]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn close_readings_are_thinned_but_kept_in_order() {
        let points: Vec<[f64; 2]> = (0..100).map(|n| [0.1 * f64::from(n), f64::from(n)]).collect();
        let kept = thinned(&points, 0.5);
        assert_eq!((kept.len(), kept[1][1]), (20, 5.0));
        assert_eq!(thinned(&points, 0.1).len(), 100);
    }

    #[test]
    fn ranges_hold_all_heights_and_show_a_level_surface_as_level() {
        let traces = [Trace::line("", [[0.0, 8.1], [1.0, f64::NAN]]), Trace::line("", [[0.0, 31.7]])];
        let [low, high] = heights_of(traces.iter());
        assert!(low <= 8.1 && high >= 31.7 && high - low < 40.0, "{low} {high}");
        let [low, high] = heights_of(traces[..1].iter());
        assert!(high - low >= LEAST_RANGE && low < 8.1 && high > 8.1, "{low} {high}");
        assert_eq!(heights_of([].into_iter()), [0.0, LEAST_RANGE]);
    }

    #[test]
    fn figures_need_something_of_the_right_length() {
        let figure = ProfileFigure { title: "", moments: &[], x_range: [0.0, 1.0] };
        assert!(matches!(figure.draw(), Err(PictureError::WrongLength { .. })));
        let run = LayerHistory { time: vec![0.0, 1.0], ..LayerHistory::default() };
        let figure = LayerFigure {
            title: "",
            runs: &[run],
            layers: ["u", "l"],
            time_range: None,
            ranges: [None; 4],
            submerged_weight: None,
        };
        assert!(matches!(figure.draw(), Err(PictureError::WrongLength { expected: 2, found: 0, .. })));
        let empty = ripple_growth("", &[], true);
        assert!(matches!(empty, Err(PictureError::NothingPositive { .. })));
        ripple_growth("nothing yet", &[], false).expect("an empty plot");
    }
}
