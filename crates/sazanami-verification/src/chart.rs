//! Figures of the pages as SVG.

use std::fmt::Write as _;

use sazanami_numerics::Real;

use crate::judge::{Row, Verdict};
use crate::measured::{Chart, Series};

/// Width of a figure and of a chart in it, height of a chart [px].
const WIDTH: Real = 720.0;
const CHART: Real = 350.0;
const HEIGHT: Real = 260.0;
/// Space left of and below the axes, and around them elsewhere [px].
const LEFT: Real = 62.0;
const BELOW: Real = 62.0;
const AROUND: Real = 26.0;
const COLOURS: [&str; 8] = ["#1f5fa8", "#c4451c", "#2d8a4e", "#7b4ea3", "#8a6d1a", "#c2327f", "#1793a0", "#4a4a4a"];
/// Height of a line of the legend, and width of a character in it, wide fonts included [px].
const LINE: Real = 14.0;
const CHARACTER: Real = 6.8;

/// The curves of a case, two in a row; without curves the values of its bands.
#[must_use]
pub fn figure(curves: &[Chart], rows: &[Row]) -> String {
    if curves.is_empty() { strains(rows) } else { charts(curves) }
}

fn open(width: Real, height: Real) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn charts(curves: &[Chart]) -> String {
    let (mut drawn, mut top) = (String::new(), 0.0);
    for row in curves.chunks(2) {
        for (n, chart) in row.iter().enumerate() {
            draw(&mut drawn, chart, [n as Real * (WIDTH - CHART), top]);
        }
        let lines = row.iter().filter_map(|chart| legend(chart).last().map(|[_, line]| *line)).max().unwrap_or(0);
        top += HEIGHT + LINE * lines as Real;
    }
    format!("{}{drawn}</svg>\n", open(WIDTH, top))
}

/// Where the name of each series begins: characters from the left of the legend, and its line.
fn legend(chart: &Chart) -> Vec<[usize; 2]> {
    let most = ((CHART - LEFT) / CHARACTER) as usize;
    let (mut from, mut line) = (0, 0);
    let place = |series: &Series| {
        let length = series.name.chars().count() + 4;
        if from > 0 && from + length > most {
            (from, line) = (0, line + 1);
        }
        let place = [from, line];
        from += length;
        place
    };
    chart.series.iter().map(place).collect()
}

/// An axis: its ends and its ticks.
struct Axis {
    low: Real,
    high: Real,
    ticks: Vec<(Real, String)>,
    logarithmic: bool,
}

impl Axis {
    /// Over these values, those that are none left out.
    fn over(values: impl Iterator<Item = Real>, logarithmic: bool) -> Self {
        let [low, high] = values
            .filter(|v| v.is_finite())
            .fold([Real::INFINITY, Real::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
        if logarithmic && low > 0.0 && low <= high { Self::of_decades(low, high) } else { Self::of_steps(low, high) }
    }

    /// Ticks at 1, 2 and 5 times powers of ten, the ends among them.
    fn of_decades(low: Real, high: Real) -> Self {
        let first = low.log10().floor() as i32;
        let all = (first..first + 40).flat_map(|power| [1.0, 2.0, 5.0].map(|n| n * 10.0_f64.powi(power)));
        let all: Vec<Real> = all.collect();
        let start = all.iter().rposition(|&tick| tick <= low * (1.0 + 1e-9)).unwrap_or(0);
        let end = all.iter().position(|&tick| tick >= high * (1.0 - 1e-9)).unwrap_or(start).max(start + 1);
        let ticks = all[start..=end].iter().map(|&tick| (tick, format!("{tick}"))).collect();
        Self { low: all[start], high: all[end], ticks, logarithmic: true }
    }

    /// Ticks at 1, 2 or 5 times a power of ten, about five, the ends among them.
    fn of_steps(low: Real, high: Real) -> Self {
        let (low, high, step) = if low > high { (0.0, 1.0, 0.5) } else { round_ends(low, high) };
        let count = ((high - low) / step).round() as usize;
        let ticks = (0..=count).map(|n| low + n as Real * step).map(|value| (value, tick(value, step))).collect();
        Self { low, high, ticks, logarithmic: false }
    }

    /// Where a value lies, 0 at the lower end and 1 at the upper one.
    fn part(&self, value: Real) -> Real {
        if self.logarithmic {
            (value / self.low).log10() / (self.high / self.low).log10()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }
}

/// Round ends about two values, and the distance of the ticks.
fn round_ends(low: Real, high: Real) -> (Real, Real, Real) {
    let width = if high > low { high - low } else { high.abs().max(1.0) };
    let power = 10.0_f64.powf((width / 5.0).log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|n| n * power).find(|step| width / step <= 6.0).unwrap_or(width);
    let (low, high) = ((low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step);
    (low, if high > low { high } else { low + step }, step)
}

fn tick(value: Real, step: Real) -> String {
    let digits = (-step.log10().floor()).max(0.0) as usize;
    let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
    if digits > 3 { format!("{value:.1e}") } else { format!("{value:.digits$}") }
}

/// Attribute of a text whose middle stands at its place.
const CENTRED: &str = "text-anchor=\"middle\"";

fn text([x, y]: [Real; 2], attributes: &str, content: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" {attributes}>{}</text>", escaped(content))
}

fn draw(svg: &mut String, chart: &Chart, [x0, y0]: [Real; 2]) {
    let points = || chart.series.iter().flat_map(|series| &series.points);
    let across = Axis::over(points().map(|point| point[0]), chart.logarithmic);
    let up = Axis::over(chart.series.iter().flat_map(Series::ordinates), chart.logarithmic);
    let (width, height) = (CHART - LEFT - AROUND, HEIGHT - BELOW - AROUND);
    let x = |value: Real| x0 + LEFT + width * across.part(value);
    let y = |value: Real| y0 + AROUND + height * (1.0 - up.part(value));
    let mut put = |line: String| {
        let _ = writeln!(svg, "{line}");
    };
    let (start, end, low, high) = (x(across.low), x(across.high), y(up.low), y(up.high));
    for (value, label) in &across.ticks {
        let x = x(*value);
        let label = text([x, low + 14.0], CENTRED, label);
        put(format!("<path d=\"M{x:.1} {low:.1}V{high:.1}\" stroke=\"#ddd\"/>{label}"));
    }
    for (value, label) in &up.ticks {
        let y = y(*value);
        let label = text([start - 5.0, y + 4.0], "text-anchor=\"end\"", label);
        put(format!("<path d=\"M{start:.1} {y:.1}H{end:.1}\" stroke=\"#ddd\"/>{label}"));
    }
    put(format!(
        "<rect x=\"{start:.1}\" y=\"{high:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"none\" stroke=\"black\"/>"
    ));
    let centre = start + 0.5 * width;
    put(text([centre, high - 8.0], &format!("{CENTRED} font-weight=\"bold\""), &chart.title));
    put(text([centre, low + 28.0], CENTRED, &chart.axes[0]));
    let (side, middle) = (x0 + 14.0, 0.5 * (low + high));
    put(format!(
        "<text transform=\"translate({side:.1} {middle:.1}) rotate(-90)\" {CENTRED}>{}</text>",
        escaped(&chart.axes[1])
    ));
    for (n, (series, [from, line])) in chart.series.iter().zip(legend(chart)).enumerate() {
        let colour = COLOURS[n % COLOURS.len()];
        if series.reference {
            for [a, b] in &series.points {
                put(format!(
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.6\" fill=\"none\" stroke=\"{colour}\"/>",
                    x(*a),
                    y(*b)
                ));
            }
        } else {
            let path: Vec<String> = series.points.iter().map(|[a, b]| format!("{:.1} {:.1}", x(*a), y(*b))).collect();
            put(format!("<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.4\"/>", path.join("L")));
        }
        for ([a, b], bar) in series.points.iter().zip(&series.bars) {
            let (a, below, above) = (x(*a), y(b - bar), y(b + bar));
            put(format!(
                "<path d=\"M{a:.1} {below:.1}V{above:.1}\" stroke=\"{colour}\"/><circle cx=\"{a:.1}\" cy=\"{:.1}\" r=\"2.6\" fill=\"{colour}\"/>",
                y(*b)
            ));
        }
        let mark = if series.reference { '\u{25cb}' } else { '\u{2014}' };
        let place = [start + CHARACTER * from as Real, low + 44.0 + LINE * line as Real];
        put(text(place, &format!("fill=\"{colour}\""), &format!("{mark} {}", series.name)));
    }
}

/// Longest name of a quantity in a figure of bands [characters].
const LONGEST: usize = 82;

/// Each judged value in its band: the band is grey, from its lower to its upper end; an open end is where the value of
/// the other end doubles. What lies far outside stands at the end of the line; the number says how far.
fn strains(rows: &[Row]) -> String {
    let judged: Vec<&Row> =
        rows.iter().filter(|row| row.measured.is_some() && (row.low, row.high) != (None, None)).collect();
    let (line, from, to) = (17.0, CHARACTER * LONGEST as Real + 10.0, CHARACTER * LONGEST as Real + 220.0);
    let mut svg = open(to + 64.0, line * judged.len() as Real + 30.0);
    let [inside, outside, ..] = COLOURS;
    let _ = writeln!(
        svg,
        "<text x=\"{from:.0}\" y=\"16\">grey: band; value <tspan fill=\"{inside}\">within it</tspan>, <tspan \
         fill=\"{outside}\">outside</tspan></text>"
    );
    for (n, row) in judged.iter().enumerate() {
        let y = 28.0 + line * n as Real;
        let value = row.measured.unwrap_or_default();
        let (low, high) = match (row.low, row.high) {
            (Some(low), Some(high)) => (low, high),
            (Some(low), None) => (low, (low + low.abs()).max(value)),
            (None, Some(high)) => ((high - high.abs()).min(value), high),
            (None, None) => (value, value),
        };
        let width = if high > low { high - low } else { low.abs().max(1.0) };
        let place = |value: Real| from + (to - from) * (0.25 + 0.5 * ((value - low) / width).clamp(-0.5, 1.5));
        let colour = match row.verdict {
            Verdict::Pass | Verdict::Mended => inside,
            _ => outside,
        };
        let name = match row.quantity.char_indices().nth(LONGEST) {
            Some((end, _)) => format!("{}…", row.quantity[..end].trim_end()),
            None => row.quantity.clone(),
        };
        let _ = writeln!(
            svg,
            "<text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{}</text><rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"8\" \
             fill=\"#d8d8d8\"/><circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.5\" fill=\"{colour}\"/><text x=\"{:.0}\" y=\"{:.1}\" \
             fill=\"{colour}\">{value:.3e}</text>",
            from - 10.0,
            y + 8.0,
            escaped(&name),
            place(low),
            y,
            (place(high) - place(low)).max(1.0),
            place(value),
            y + 4.0,
            to + 8.0,
            y + 8.0
        );
    }
    svg.push_str("</svg>\n");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_all_values_on_round_ticks() {
        let ends = |values: &[Real], logarithmic| {
            let axis = Axis::over(values.iter().copied(), logarithmic);
            (axis.low, axis.high, axis.ticks.len())
        };
        assert_eq!(ends(&[0.0, 9.3], false), (0.0, 10.0, 6));
        assert_eq!(ends(&[-0.021, 0.034], false), (-0.03, 0.04, 8));
        let (low, high, _) = ends(&[3.0, 3.0], false);
        assert!(low <= 3.0 && high > low);
        assert_eq!(ends(&[], false), (0.0, 1.0, 3));
        assert_eq!(ends(&[20.0, 80.0], true), (20.0, 100.0, 3));
        assert_eq!(ends(&[0.3, 1.0], true), (0.2, 1.0, 3));
        assert_eq!(ends(&[5.0, 5.0], true), (5.0, 10.0, 2));
        let axis = Axis::over([1.0, 100.0].into_iter(), true);
        assert!(
            (axis.part(10.0) - 0.5).abs() < 1e-12
                && (Axis::over([0.0, 100.0].into_iter(), true).part(10.0) - 0.1).abs() < 1e-12
        );
    }

    #[test]
    fn figures_show_every_line_and_every_value() {
        let chart = Chart::new("speed < 1", "t [s]", "u [m/s]")
            .computed("here", &[[0.0, 0.0], [1.0, 0.5]])
            .reference("there", &[[0.5, 0.2]])
            .results("with a bar", &[[0.5, 0.3]], &[0.4]);
        let svg = figure(&[chart], &[]);
        assert!(
            svg.contains("speed &lt; 1")
                && svg.contains("here")
                && svg.contains("with a bar")
                && svg.matches("<circle").count() == 2
                && svg.ends_with("</svg>\n")
        );
    }

    #[test]
    fn a_long_legend_goes_on_in_the_next_line() {
        let of = |count: usize| {
            let chart = Chart::new("speed", "t [s]", "u [m/s]");
            (0..count).fold(chart, |chart, n| chart.computed(&format!("0.8 m/s, bed {n}"), &[[0.0, 0.0], [1.0, 0.5]]))
        };
        let places = legend(&of(5));
        assert_eq!(places.iter().map(|[_, line]| *line).collect::<Vec<_>>(), [0, 0, 1, 1, 2]);
        assert!(places.iter().all(|[from, _]| CHARACTER * (from + 14) as Real <= CHART - LEFT));
        // The figure is as much higher; control: two names stand side by side.
        let height = |count: usize| {
            figure(&[of(count)], &[]).split("height=\"").nth(1).unwrap().split('"').next().unwrap().to_owned()
        };
        assert_eq!((height(5).as_str(), height(2).as_str()), ("288", "260"));
    }
}
