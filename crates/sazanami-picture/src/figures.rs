//! The line plots of a raindrop on sand, from quantities in SI units.

use sazanami::artist::{Curve, ErosionPoint};

use super::chart::{Dash, LinePlot, Mark, Trace};
use super::colour::LINES;
use super::{Picture, PictureError, sheet};

/// Marks that tell traces apart.
const MARKS: [Mark; 5] = [Mark::Disc, Mark::Square, Mark::Triangle, Mark::Diamond, Mark::Ring];

/// Smoothed bed surface against radius (figures 13 and 14 of Yagyu et al. 2015): for each curve its label and its
/// points of radius and mean height \[m]. The first curve is the initial surface, drawn in dashes.
#[must_use]
pub fn bed_profiles(title: &str, curves: &[Curve]) -> LinePlot {
    let mut plot = LinePlot::new(title, "r [mm]", "smoothed bed surface [mm]");
    for (number, (label, points)) in curves.iter().enumerate() {
        let trace = Trace::line(label, points.iter().map(|&[r, h]| [1e3 * r, 1e3 * h]));
        let is_first = number == 0 && curves.len() > 1;
        let trace = if is_first { trace.dashed(Dash::Dashed) } else { trace.marked(MARKS[number % MARKS.len()]) };
        plot = plot.with(trace);
    }
    plot
}

/// Crater depth and rim radius \[m] against time \[s], drawn in ms as all pictures of a raindrop; without those that were
/// never measured.
#[must_use]
pub fn crater_history(title: &str, times: &[f64], depths: &[f64], rim_radii: &[f64]) -> LinePlot {
    let against_time = |values: &[f64]| times.iter().zip(values).map(|(&t, &v)| [1e3 * t, 1e3 * v]).collect::<Vec<_>>();
    let mut plot = LinePlot::new(title, "t [ms]", "length [mm]");
    for (label, values) in [("crater depth H", depths), ("rim radius L", rim_radii)] {
        if values.iter().any(|value| value.is_finite()) {
            plot = plot.with(Trace::line(label, against_time(values)));
        }
    }
    plot
}

/// Erosion volume against momentum (figure 15 of Yagyu et al. 2015): for each kind of drop its label and its runs.
#[must_use]
pub fn erosion_against_momentum(title: &str, groups: &[(String, Vec<ErosionPoint>)]) -> LinePlot {
    let mut plot = LinePlot::new(title, "momentum of the drop m v [g cm/s]", "erosion volume V [mm³]");
    for (number, (label, runs)) in groups.iter().enumerate() {
        let points = runs.iter().map(|run| [1e5 * run.momentum, 1e9 * run.volume]);
        let errors = runs.iter().map(|run| 1e9 * run.uncertainty);
        plot = plot.with(Trace::marks(label, MARKS[number % MARKS.len()], points).with_errors(errors));
    }
    let runs = || groups.iter().flat_map(|(_, runs)| runs);
    let largest = runs().map(|run| 1e5 * run.momentum).fold(0.0, f64::max);
    let highest = runs().map(|run| 1e9 * (run.volume + run.uncertainty)).fold(0.0, f64::max);
    if largest > 0.0 && highest > 0.0 {
        plot.x_range = Some([0.0, super::axes::round_range(0.0, 1.08 * largest)[1]]);
        let lowest = runs().map(|run| 1e9 * (run.volume - run.uncertainty)).fold(0.0, f64::min);
        plot.y_range = Some(super::axes::round_range(lowest, 1.05 * highest));
    }
    plot
}

/// A part of a momentum budget that is nowhere larger than this part of the largest one has no place beside it.
const SMALL: f64 = 0.02;

/// Parts of the momentum budget [N s] against time \[s]; `axis` names the direction, as in `x₃`. A part called
/// `residual` is drawn in dashes. Parts too small to be told from zero beside the largest one are drawn below it, on an axis
/// of their own.
///
/// # Errors
/// As [`LinePlot::draw`].
pub fn momentum_budget(
    title: &str,
    axis: &str,
    times: &[f64],
    parts: &[(&str, Vec<f64>)],
) -> Result<Picture, PictureError> {
    let largest_of =
        |values: &[f64]| values.iter().filter(|v| v.is_finite()).fold(0.0_f64, |most, v| most.max(v.abs()));
    let largest = parts.iter().map(|part| largest_of(&part.1)).fold(0.0, f64::max);
    let mut plots = [true, false].map(|is_large| {
        let label = format!("momentum along {axis} [N s]");
        let title = if is_large { title.to_owned() } else { format!("parts below {} % of the largest", 100.0 * SMALL) };
        LinePlot { size: [1000, if is_large { 560 } else { 400 }], ..LinePlot::new(&title, "t [ms]", &label) }
    });
    for (number, (label, values)) in parts.iter().enumerate() {
        let most = largest_of(values);
        // A part that is zero throughout is in the legend only as the residual: that it is zero is what it is for.
        if *label != "residual" && most == 0.0 {
            continue;
        }
        let points = times.iter().zip(values).map(|(&t, &value)| [1e3 * t, value]);
        let trace = match *label {
            "residual" => Trace::line(&format!("residual, at most {most:.0e}"), points).dashed(Dash::Dashed),
            label => Trace::line(label, points),
        };
        plots[usize::from(most <= SMALL * largest)].traces.push(trace.coloured(LINES[number % LINES.len()]));
    }
    let shown = plots.iter().filter(|plot| !plot.traces.is_empty());
    let rows = shown.map(|plot| Ok(vec![plot.draw()?])).collect::<Result<Vec<_>, PictureError>>()?;
    Ok(sheet("", &rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_that_would_lie_on_zero_have_an_axis_of_their_own() {
        let times = [0.0, 1.0];
        let height = |parts: &[(&str, Vec<f64>)]| momentum_budget("", "x₃", &times, parts).unwrap().height();
        let (large, half) = (("liquid", vec![-1e-3, 0.0]), ("grains", vec![0.0, 5e-4]));
        let (small, residual) = (("gas", vec![0.0, 1e-6]), ("residual", vec![0.0, 1e-15]));
        assert_eq!(height(&[large.clone(), half.clone()]), 560);
        for small in [small, residual] {
            assert_eq!(height(&[large.clone(), half.clone(), small]), 560 + 400);
        }
        // A part that is zero throughout is not drawn at all.
        assert_eq!(height(&[large, ("walls", vec![0.0; 2])]), 560);
    }
}
