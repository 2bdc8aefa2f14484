//! Figures of the pages as SVG.

use std::fmt::Write as _;

use sazanami_numerics::Real;

use crate::judge::{Row, Verdict};
use crate::measured::Chart;

/// Width of a figure and of a chart in it, height of a chart [px].
const WIDTH: Real = 720.0;
const CHART: Real = 350.0;
const HEIGHT: Real = 260.0;
/// Space left of and below the axes, and around them elsewhere [px].
const LEFT: Real = 62.0;
const BELOW: Real = 62.0;
const AROUND: Real = 26.0;
const COLOURS: [&str; 5] = ["#1f5fa8", "#c4451c", "#2d8a4e", "#7b4ea3", "#8a6d1a"];

/// The curves of a case, two in a row; without curves the values of its bands.
#[must_use]
pub fn figure(curves: &[Chart], rows: &[Row]) -> String {
    if curves.is_empty() { strains(rows) } else { charts(curves) }
}

fn open(height: Real) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn charts(curves: &[Chart]) -> String {
    let rows = curves.len().div_ceil(2);
    let mut svg = open(HEIGHT * rows as Real);
    for (n, chart) in curves.iter().enumerate() {
        let corner = [(n % 2) as Real * (WIDTH - CHART), (n / 2) as Real * HEIGHT];
        draw(&mut svg, chart, corner);
    }
    svg.push_str("</svg>\n");
    svg
}

/// Ends of an axis and the distance of its ticks: 1, 2 or 5 times a power of ten, about five ticks.
fn axis(values: impl Iterator<Item = Real>) -> [Real; 3] {
    let [low, high] =
        values.filter(|v| v.is_finite()).fold([Real::INFINITY, Real::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
    if low > high {
        return [0.0, 1.0, 0.5];
    }
    let width = if high > low { high - low } else { high.abs().max(1.0) };
    let power = 10.0_f64.powf((width / 5.0).log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|n| n * power).find(|step| width / step <= 6.0).unwrap_or(width);
    let (low, high) = ((low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step);
    [low, if high > low { high } else { low + step }, step]
}

fn tick(value: Real, step: Real) -> String {
    let digits = (-step.log10().floor()).max(0.0) as usize;
    let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
    if digits > 3 { format!("{value:.1e}") } else { format!("{value:.digits$}") }
}

fn ticks([low, high, step]: [Real; 3]) -> impl Iterator<Item = Real> {
    (0..=((high - low) / step).round() as usize).map(move |n| low + n as Real * step)
}

/// Attribute of a text whose middle stands at its place.
const CENTRED: &str = "text-anchor=\"middle\"";

fn text([x, y]: [Real; 2], attributes: &str, content: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" {attributes}>{}</text>", escaped(content))
}

fn draw(svg: &mut String, chart: &Chart, [x0, y0]: [Real; 2]) {
    let points = || chart.series.iter().flat_map(|series| &series.points);
    let [left, right, dx] = axis(points().map(|point| point[0]));
    let [bottom, top, dy] = axis(points().map(|point| point[1]));
    let (width, height) = (CHART - LEFT - AROUND, HEIGHT - BELOW - AROUND);
    let x = |value: Real| x0 + LEFT + width * (value - left) / (right - left);
    let y = |value: Real| y0 + AROUND + height * (top - value) / (top - bottom);
    let mut put = |line: String| {
        let _ = writeln!(svg, "{line}");
    };
    let (start, end, low, high) = (x(left), x(right), y(bottom), y(top));
    for value in ticks([left, right, dx]) {
        let (x, label) = (x(value), tick(value, dx));
        let label = text([x, low + 14.0], CENTRED, &label);
        put(format!("<path d=\"M{x:.1} {low:.1}V{high:.1}\" stroke=\"#ddd\"/>{label}"));
    }
    for value in ticks([bottom, top, dy]) {
        let (y, label) = (y(value), tick(value, dy));
        let label = text([start - 5.0, y + 4.0], "text-anchor=\"end\"", &label);
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
    let mut legend = start;
    for (n, series) in chart.series.iter().enumerate() {
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
        let mark = if series.reference { '\u{25cb}' } else { '\u{2014}' };
        put(text([legend, low + 44.0], &format!("fill=\"{colour}\""), &format!("{mark} {}", series.name)));
        legend += 6.2 * (series.name.chars().count() + 4) as Real;
    }
}

/// Longest name of a quantity in a figure of bands [characters].
const LONGEST: usize = 82;

/// Each judged value in its band: the band is grey, from its lower to its upper end; an open end is where the value of
/// the other end doubles. What lies far outside stands at the end of the line; the number says how far.
fn strains(rows: &[Row]) -> String {
    let judged: Vec<&Row> =
        rows.iter().filter(|row| row.measured.is_some() && (row.low, row.high) != (None, None)).collect();
    let (line, from, to) = (17.0, 446.0, 656.0);
    let mut svg = open(line * judged.len() as Real + 30.0);
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
        assert_eq!(axis([0.0, 9.3].into_iter()), [0.0, 10.0, 2.0]);
        assert_eq!(axis([-0.021, 0.034].into_iter()), [-0.03, 0.04, 0.01]);
        let [low, high, step] = axis([3.0, 3.0].into_iter());
        assert!(low <= 3.0 && high > low && step > 0.0);
        assert_eq!(axis(std::iter::empty()), [0.0, 1.0, 0.5]);
    }

    #[test]
    fn figures_show_every_line_and_every_value() {
        let chart = Chart::new("speed < 1", "t [s]", "u [m/s]")
            .computed("here", &[[0.0, 0.0], [1.0, 0.5]])
            .reference("there", &[[0.5, 0.2]]);
        let svg = figure(&[chart], &[]);
        assert!(
            svg.contains("speed &lt; 1")
                && svg.contains("here")
                && svg.contains("<circle")
                && svg.ends_with("</svg>\n")
        );
    }
}
