//! Axes: round ticks, labels with units, a frame.

use super::canvas::{Anchor, Canvas, Font, Pen, Rectangle};
use super::colour::{BLACK, Colour};
use super::text;

/// Range of one direction.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    pub label: String,
    pub lower: f64,
    pub upper: f64,
}

/// A tick at a value; minor ones have no label.
#[derive(Clone, Debug, PartialEq)]
struct Tick {
    value: f64,
    label: Option<String>,
}

impl Axis {
    pub fn linear(label: &str, lower: f64, upper: f64) -> Self {
        Self { label: label.to_owned(), lower, upper }
    }

    /// Part of the way from the lower to the upper end.
    pub fn part(&self, value: f64) -> f64 {
        (value - self.lower) / (self.upper - self.lower)
    }

    /// Ticks, about `most` of them with labels, and the power of ten taken out of the labels.
    fn ticks(&self, most: usize) -> (Vec<Tick>, i32) {
        let (step, parts) = round_step((self.upper - self.lower) / most.max(1) as f64);
        let largest = self.lower.abs().max(self.upper.abs());
        let power = if (1e-2..1e5).contains(&largest) { 0 } else { decade(largest) };
        let decimals = (power - decade(step * 1.000_001)).max(0) as usize;
        let minor = step / f64::from(parts);
        let slack = 1e-9 * (self.upper - self.lower);
        let first = ((self.lower - slack) / minor).ceil() as i64;
        let last = ((self.upper + slack) / minor).floor() as i64;
        let ticks = (first..=last).map(|n| {
            let value = n as f64 * minor;
            let major = n.rem_euclid(i64::from(parts)) == 0;
            Tick { value, label: major.then(|| number(value / 10_f64.powi(power), decimals)) }
        });
        (ticks.collect(), power)
    }

    /// Ticks along `length` \[pixels]: labels about the first of the distances apart, or the second where that would be
    /// fewer than four of them.
    fn ticks_along(&self, length: f64, [usual, closest]: [f64; 2]) -> (Vec<Tick>, i32) {
        let ticks = self.ticks((length / usual) as usize);
        let labels = ticks.0.iter().filter(|tick| tick.label.is_some()).count();
        if labels < 4 { self.ticks((length / closest) as usize) } else { ticks }
    }
}

/// Power of ten at or below `value`.
fn decade(value: f64) -> i32 {
    if value > 0.0 { value.log10().floor() as i32 } else { 0 }
}

/// A step of 1, 2 or 5 times a power of ten at or above `least`, and into how many minor ones it is cut.
fn round_step(least: f64) -> (f64, i32) {
    let base = 10_f64.powi(decade(least));
    let (digit, parts) = match least / base {
        d if d <= 1.000_001 => (1.0, 5),
        d if d <= 2.000_001 => (2.0, 4),
        d if d <= 5.000_001 => (5.0, 5),
        _ => (10.0, 5),
    };
    (digit * base, parts)
}

/// A number with a true minus sign.
fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let zero = text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.'));
    if zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "−") }
}

/// A whole number raised.
#[must_use]
pub fn superscript(value: i32) -> String {
    let raised = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        digit => char::from_u32('⁴' as u32 + digit as u32 - '4' as u32).unwrap_or(digit),
    };
    value.to_string().chars().map(raised).collect()
}

/// A label with the power of ten that the tick labels leave out: `V [mm³]` becomes `V [10³ mm³]`.
fn with_power(label: &str, power: i32) -> String {
    match (power, label.rsplit_once('[')) {
        (0, _) => label.to_owned(),
        (_, Some((name, unit))) if unit.starts_with(['–', '-']) => format!("{name}[10{}]", superscript(power)),
        (_, Some((name, unit))) => format!("{name}[10{} {unit}", superscript(power)),
        (_, None) => format!("{label} [10{}]", superscript(power)),
    }
}

/// A rectangle of the sheet with an axis along its bottom and one along its left side.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frame {
    pub area: Rectangle,
    pub x: Axis,
    pub y: Axis,
    /// Size of the tick labels; axis labels are a little larger.
    pub size: f64,
}

impl Frame {
    /// Place of a point on the sheet.
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Rectangle { left, top, right, bottom } = self.area;
        [left + (right - left) * self.x.part(x), bottom + (top - bottom) * self.y.part(y)]
    }

    /// Draws frame, ticks and labels.
    pub fn draw(&self, canvas: &mut Canvas) {
        let Rectangle { left, top, right, bottom } = self.area;
        let pen = Pen::new(1.5, BLACK);
        canvas.line(&[[left, top], [right, top], [right, bottom], [left, bottom], [left, top]], pen);
        let size = self.size;
        let font = Font { size, colour: BLACK, across: Anchor::Middle, down: Anchor::Start, upwards: false };
        let (ticks, power) = self.x_ticks();
        for Tick { value, label } in &ticks {
            let x = left + (right - left) * self.x.part(*value);
            let length = if label.is_some() { 8.0 } else { 4.5 };
            canvas.line(&[[x, bottom], [x, bottom - length]], pen);
            canvas.line(&[[x, top], [x, top + length]], pen);
            if let Some(label) = label {
                canvas.text([x, bottom + 0.55 * size], label, font);
            }
        }
        let title = Font { size: 1.12 * size, ..font };
        canvas.text([0.5 * (left + right), bottom + 2.0 * size], &with_power(&self.x.label, power), title);
        let (ticks, power) = self.y_ticks();
        let labels = Font { across: Anchor::End, down: Anchor::Middle, ..font };
        let mut widest: f64 = 0.0;
        for Tick { value, label } in &ticks {
            let y = bottom + (top - bottom) * self.y.part(*value);
            let length = if label.is_some() { 8.0 } else { 4.5 };
            canvas.line(&[[left, y], [left + length, y]], pen);
            canvas.line(&[[right, y], [right - length, y]], pen);
            if let Some(label) = label {
                canvas.text([left - 0.45 * size, y], label, labels);
                widest = widest.max(text::length(label, size));
            }
        }
        let title = Font { down: Anchor::End, upwards: true, ..title };
        let x = left - 0.45 * size - widest - 0.75 * size;
        canvas.text([x, 0.5 * (top + bottom)], &with_power(&self.y.label, power), title);
    }

    fn x_ticks(&self) -> (Vec<Tick>, i32) {
        self.x.ticks_along(self.area.right - self.area.left, [5.5 * self.size, 3.8 * self.size])
    }

    fn y_ticks(&self) -> (Vec<Tick>, i32) {
        self.y.ticks_along(self.area.bottom - self.area.top, [3.5 * self.size, 2.1 * self.size])
    }
}

/// A square of a colour and its meaning, which end at `[right, middle]`.
pub(super) fn draw_swatch(canvas: &mut Canvas, [right, middle]: [f64; 2], colour: Colour, label: &str, size: f64) {
    let font = Font { size, colour: BLACK, across: Anchor::End, down: Anchor::Middle, upwards: false };
    canvas.text([right, middle], label, font);
    let end = right - text::length(label, size) - 0.5 * size;
    let half = 0.45 * size;
    let square = Rectangle { left: end - 2.0 * half, right: end, top: middle - half, bottom: middle + half };
    canvas.rectangle(square, colour, 0.74);
}

/// A bar of colours beside a picture, with ticks on its right.
pub(super) fn draw_colour_bar(canvas: &mut Canvas, area: Rectangle, scale: &super::ColourScale, size: f64) {
    let Rectangle { left, top, right, bottom } = area;
    let [low, high] = scale.range;
    let axis = Axis::linear(&scale.label, low, high);
    let rows = (bottom - top).round() as usize;
    for row in 0..rows {
        let value = high + (low - high) * (row as f64 + 0.5) / rows as f64;
        let y = top + row as f64;
        canvas.rectangle(Rectangle { top: y, bottom: y + 1.0, ..area }, scale.colour(value), 1.0);
    }
    let pen = Pen::new(1.5, BLACK);
    canvas.line(&[[left, top], [right, top], [right, bottom], [left, bottom], [left, top]], pen);
    // Arrows for what lies beyond the scale; there is nothing below a scale that begins at zero.
    let middle = 0.5 * (left + right);
    let arrow = |canvas: &mut Canvas, from: f64, tip: f64, value: f64| {
        canvas.polygon(&[[left, from], [right, from], [middle, tip]], scale.colour(value), 1.0);
        canvas.line(&[[left, from], [middle, tip], [right, from]], pen);
    };
    arrow(canvas, top - 1.5, top - 0.8 * size, high);
    if low < 0.0 {
        arrow(canvas, bottom + 1.5, bottom + 0.8 * size, low);
    }
    let font = Font { size, colour: BLACK, across: Anchor::Start, down: Anchor::Middle, upwards: false };
    let (ticks, power) = axis.ticks_along(bottom - top, [3.5 * size, 2.1 * size]);
    let mut widest: f64 = 0.0;
    for Tick { value, label } in ticks {
        let Some(label) = label else { continue };
        let y = bottom + (top - bottom) * axis.part(value);
        canvas.line(&[[right - 5.0, y], [right, y]], pen);
        canvas.text([right + 0.35 * size, y], &label, font);
        widest = widest.max(text::length(&label, size));
    }
    let title = Font { size: 1.12 * size, across: Anchor::Middle, down: Anchor::Start, upwards: true, ..font };
    let x = right + 0.35 * size + widest + 0.75 * size;
    canvas.text([x, 0.5 * (top + bottom)], &with_power(&scale.label, power), title);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, most: usize) -> (Vec<String>, i32) {
        let (ticks, power) = axis.ticks(most);
        (ticks.into_iter().filter_map(|tick| tick.label).collect(), power)
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis::linear("x1 [mm]", 0.0, 33.8);
        assert_eq!(labels(&axis, 8).0, ["0", "5", "10", "15", "20", "25", "30"]);
        let axis = Axis::linear("z [mm]", -0.25, 1.0);
        assert_eq!(labels(&axis, 7).0, ["−0.2", "0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        let axis = Axis::linear("p [N s]", -2e-5, 4e-5);
        assert_eq!(labels(&axis, 6), (["−2", "−1", "0", "1", "2", "3", "4"].map(str::to_owned).to_vec(), -5));
        assert_eq!(with_power("p [N s]", -5), "p [10⁻⁵ N s]");
    }

    #[test]
    fn a_short_axis_has_closer_labels_rather_than_hardly_any() {
        let axis = Axis::linear("z [mm]", 6.0, 14.0);
        let count = |length: f64| {
            let ticks = axis.ticks_along(length, [66.0, 40.0]).0;
            ticks.iter().filter(|tick| tick.label.is_some()).count()
        };
        assert_eq!((count(230.0), count(400.0), labels(&axis, 3).0.len()), (5, 5, 1));
    }

    #[test]
    fn whole_numbers_are_raised() {
        assert_eq!(superscript(-1_234_567_890), "⁻¹²³⁴⁵⁶⁷⁸⁹⁰");
    }
}
