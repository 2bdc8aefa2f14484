//! The plots of ripples in a shaken tank, from quantities in SI units: profiles of bed and water, layer averages,
//! growth (figures 2 and 4 of Tazaki, Harada, Ikari and Gotoh, ripples in an oscillating tank).

use super::colour::{BLACK, LINES};
use super::tiles::sheet;
use super::{Dash, LinePlot, Mark, Picture, PictureError, Trace, check_length};

/// Width of the plots of histories [pixels].
const WIDTH: usize = 1100;
/// Points of a photograph closer than this part of the width of a plot are thinned out.
const CLOSEST: f64 = 1.0 / 150.0;

/// Surfaces of bed and water at one instant; one curve per run, each with its label and its points `(x1, x3)` [m].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProfilesAtTime {
    /// What stands above, as `t = 3.0 s`.
    pub title: String,
    /// Beds.
    pub bed: Vec<(String, Vec<[f64; 2]>)>,
    /// Water surfaces, in the order of the beds.
    pub water: Vec<(String, Vec<[f64; 2]>)>,
    /// Bed of the experiment; empty if there is none.
    pub measured_bed: Vec<[f64; 2]>,
    /// Water surface of the experiment; empty if there is none.
    pub measured_water: Vec<[f64; 2]>,
}

/// Bed (above) and water surface (below) at one or several instants side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileFigure<'a> {
    /// Title of the sheet.
    pub title: &'a str,
    /// The instants.
    pub moments: &'a [ProfilesAtTime],
    /// Part of x1 shown [m].
    pub x_range: [f64; 2],
    /// Heights shown for the bed [m].
    pub bed_range: [f64; 2],
    /// Heights shown for the water [m].
    pub water_range: [f64; 2],
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
        let (mut above, mut below) = (Vec::new(), Vec::new());
        let mut key = LinePlot::new("", "", "");
        for moment in self.moments {
            let title = &moment.title;
            let bed = self.plot([title, "", "bed surface [mm]"], &moment.bed, &moment.measured_bed, self.bed_range);
            let labels = ["", "x₁ [mm]", "water surface [mm]"];
            let water = self.plot(labels, &moment.water, &moment.measured_water, self.water_range);
            for trace in bed.traces.iter().chain(&water.traces) {
                if !key.traces.iter().any(|known| known.label == trace.label) {
                    key.traces.push(trace.clone());
                }
            }
            for (plot, row) in [(bed, &mut above), (water, &mut below)] {
                row.push(without_labels(plot).framed(width, 260).draw()?);
            }
        }
        let strip = key.legend_strip(width * self.moments.len());
        Ok(sheet(self.title, &[vec![strip], above, below]))
    }

    fn plot(
        &self,
        [title, x_label, y_label]: [&str; 3],
        runs: &[(String, Vec<[f64; 2]>)],
        measured: &[[f64; 2]],
        range: [f64; 2],
    ) -> LinePlot {
        let mut plot = LinePlot::new(title, x_label, y_label);
        plot.x_range = Some(self.x_range.map(|x| 1e3 * x));
        plot.y_range = Some(range.map(|z| 1e3 * z));
        for (number, (label, points)) in runs.iter().enumerate() {
            let trace = Trace::line(label, points.iter().map(|point| point.map(|v| 1e3 * v)));
            plot = plot.with(trace.coloured(LINES[number % LINES.len()]));
        }
        if !measured.is_empty() {
            let shown = thinned(measured, CLOSEST * (self.x_range[1] - self.x_range[0]));
            let points = shown.into_iter().map(|point| point.map(|v| 1e3 * v));
            plot = plot.with(Trace::marks("experiment", Mark::Dot, points).coloured(BLACK));
        }
        plot
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

/// Averages over the layers of the bed in one run. The four quantities of each layer are: velocity of the water and of
/// the grains [m/s], drag and force of the pressure gradient on a grain [N], all along x1. NaN leaves a gap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerHistory {
    /// Name of the run; empty if there is only one.
    pub label: String,
    /// Times [s].
    pub time: Vec<f64>,
    /// Upper layer: the four quantities at these times.
    pub upper: [Vec<f64>; 4],
    /// Lower layer.
    pub lower: [Vec<f64>; 4],
}

/// Layer averages against time, four plots below each other; the upper layer is a solid line, the lower one is dashed.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerFigure<'a> {
    /// Title of the sheet.
    pub title: &'a str,
    /// Runs.
    pub runs: &'a [LayerHistory],
    /// What the layers are, in the legend: upper, lower.
    pub layers: [&'a str; 2],
    /// Times shown [s], or all.
    pub time_range: Option<[f64; 2]>,
    /// Ranges of the four quantities, or what the data need.
    pub ranges: [Option<[f64; 2]>; 4],
    /// Submerged weight of a grain [N], in parts of which the forces are shown; without it they are shown in N.
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

/// Height and wavelength of ripples in one run, or measured ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RippleHistory {
    /// Name in the legend.
    pub label: String,
    /// Times and heights [s, m].
    pub height: Vec<[f64; 2]>,
    /// Times and wavelengths [s, m].
    pub wavelength: Vec<[f64; 2]>,
    /// Whether this was measured: marks instead of a line.
    pub measured: bool,
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
    fn figures_need_something_of_the_right_length() {
        let figure = ProfileFigure {
            title: "",
            moments: &[],
            x_range: [0.0, 1.0],
            bed_range: [0.0, 1.0],
            water_range: [0.0, 1.0],
        };
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
