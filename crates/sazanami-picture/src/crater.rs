//! The crater in a section: the bed's smoothed surface before and now, rim, depth, and the cap whose volume is V.

use sazanami::artist::{BedSurface, CraterCap, NO_CRATER};

use super::axes::Frame;
use super::canvas::{Anchor, Canvas, Font, Pen, Rectangle};
use super::colour::{BLACK, Colour, WHITE};
use super::text;

/// Rows of the legend and their height \[pixels].
const ROWS: usize = 4;
const ROW: f64 = 27.0;
const SAMPLE: f64 = 46.0;
const SIZE: f64 = 18.0;

const SURFACE: Colour = [150, 0, 110];
const DASHES: &[f64] = &[9.0, 6.0];

/// The volume of a crater with its uncertainty, as reports and the summary have it, and what speaks against it.
pub(super) fn volume_words(crater: &CraterCap) -> String {
    let doubt = if crater.below_rim.doubts.is_empty() { "" } else { " (not reliable)" };
    format!("{} below the rim{doubt}", crater.below_rim)
}

/// Meaning of the volumes: the last rows of the legend.
fn explanation(surface: &BedSurface) -> [String; ROWS - 1] {
    let Some(crater) = &surface.crater else {
        return [NO_CRATER.into(), String::new(), String::new()];
    };
    let doubts = &crater.below_rim.doubts;
    [
        format!(
            "below the plane of the rim {}, before the impact {:.1} mm³; depth H = {:.2} mm, rim radius L = {:.2} mm",
            crater.below_rim,
            1e9 * crater.noise,
            1e3 * crater.depth,
            1e3 * crater.rim_radius
        ),
        format!("cap through the rim and the height at the axis V = π H (3 L² + H²) / 6 = {}", crater.cap),
        if doubts.is_empty() { String::new() } else { format!("not reliable: {doubts}") },
    ]
}

/// Height of the legend \[pixels], the same with a crater and without.
pub(super) fn legend_height() -> usize {
    (ROWS as f64 * ROW) as usize
}

/// A profile about the axis as it crosses the section, from left to right \[mm].
fn across(axis: f64, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let side = |sign: f64| move |&[r, h]: &[f64; 2]| [1e3 * (axis + sign * r), 1e3 * h];
    points.iter().rev().map(side(-1.0)).chain(points.iter().map(side(1.0))).collect()
}

/// Points of the cap's lower side, from rim to rim \[mm].
fn arc(axis: f64, crater: &CraterCap) -> Vec<[f64; 2]> {
    let (l, h) = (crater.rim_radius, crater.depth);
    let radius = (l * l + h * h) / (2.0 * h);
    let point = |n: i32| {
        let r = l * f64::from(n) / 60.0;
        [1e3 * (axis + r), 1e3 * (crater.rim_height - h + radius - (radius * radius - r * r).max(0.0).sqrt())]
    };
    (-60..=60).map(point).collect()
}

/// Draws surfaces and crater over a section whose axes are in mm.
pub(super) fn draw(canvas: &mut Canvas, frame: &Frame, surface: &BedSurface) {
    let on_sheet = |points: Vec<[f64; 2]>| points.into_iter().map(|point| frame.place(point)).collect::<Vec<_>>();
    if let Some(crater) = &surface.crater {
        let cap = on_sheet(arc(surface.axis, crater));
        canvas.polygon(&cap, SURFACE, 0.13);
        canvas.line(&cap, Pen { width: 1.6, colour: SURFACE, dashes: &[2.0, 4.0] });
    }
    let halo = Pen::new(5.0, WHITE);
    let before = on_sheet(across(surface.axis, &surface.before));
    let now = on_sheet(across(surface.axis, &surface.now));
    let dashed = Pen { width: 2.6, colour: BLACK, dashes: DASHES };
    canvas.line(&before, Pen { dashes: DASHES, ..halo });
    canvas.line(&before, dashed);
    if surface.now != surface.before {
        canvas.line(&now, halo);
        canvas.line(&now, Pen::new(3.0, SURFACE));
    }
    if let Some(crater) = &surface.crater {
        draw_measures(canvas, frame, surface.axis, crater);
    }
}

/// Draws the plane of the rim with L, and H below it.
fn draw_measures(canvas: &mut Canvas, frame: &Frame, axis: f64, crater: &CraterCap) {
    let place = |r: f64, h: f64| frame.place([1e3 * (axis + r), 1e3 * h]);
    let (rim, base) = (crater.rim_height, crater.rim_height - crater.depth);
    let pen = Pen::new(1.8, BLACK);
    let [left, middle, right] = [-crater.rim_radius, 0.0, crater.rim_radius].map(|r| place(r, rim));
    let lowest = place(0.0, base);
    canvas.line(&[left, right], pen);
    canvas.line(&[middle, lowest], pen);
    for end in [left, right] {
        canvas.disc(end, 6.0, WHITE);
        canvas.disc(end, 4.5, BLACK);
    }
    for (end, towards) in [(middle, 1.0), (lowest, -1.0)] {
        canvas.polygon(
            &[end, [end[0] - 5.0, end[1] + 11.0 * towards], [end[0] + 5.0, end[1] + 11.0 * towards]],
            BLACK,
            1.0,
        );
    }
    let mut label = |words: &str, [x, y]: [f64; 2]| {
        let half = 0.5 * text::length(words, SIZE) + 4.0;
        canvas.rectangle(Rectangle { left: x - half, right: x + half, top: y - 12.0, bottom: y + 12.0 }, WHITE, 0.8);
        let font = Font { size: SIZE, colour: BLACK, across: Anchor::Middle, down: Anchor::Middle, upwards: false };
        canvas.text([x, y], words, font);
    };
    label("L", [0.5 * (middle[0] + right[0]), middle[1] - 16.0]);
    label("H", [middle[0] + 18.0, 0.5 * (middle[1] + lowest[1])]);
}

/// Draws what the lines are, and what the volumes are, from a corner of the sheet downwards, in `room` pixels.
pub(super) fn draw_legend(canvas: &mut Canvas, [left, top]: [f64; 2], room: f64, surface: &BedSurface) {
    let font = Font { size: SIZE, colour: BLACK, across: Anchor::Start, down: Anchor::Middle, upwards: false };
    let row = |n: usize| top + ROW * (n as f64 + 0.5);
    let dashed = Pen { width: 2.6, colour: BLACK, dashes: DASHES };
    let mut x = left;
    for (pen, words) in [
        (dashed, "surface before the impact"),
        (Pen::new(3.0, SURFACE), "surface now, both means over circles about the axis"),
    ] {
        canvas.line(&[[x, row(0)], [x + SAMPLE, row(0)]], pen);
        canvas.text([x + SAMPLE + 10.0, row(0)], words, font);
        x += SAMPLE + 40.0 + text::length(words, SIZE);
    }
    for (n, words) in explanation(surface).iter().enumerate() {
        canvas.text([left, row(n + 1)], words, Font { size: text::fitted(words, SIZE, room), ..font });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sazanami::artist::{Amount, Points};

    fn crater() -> CraterCap {
        CraterCap {
            rim_radius: 4.95e-3,
            rim_height: 6e-3,
            depth: 1.72e-3,
            below_rim: Amount { volume: 61.274e-9, uncertainty: 3.04e-9, doubts: String::new() },
            cap: Amount { volume: 68.812e-9, uncertainty: 12.04e-9, doubts: String::new() },
            noise: 5.44e-9,
        }
    }

    #[test]
    fn the_legend_says_what_the_volumes_are_with_their_parts() {
        let with = BedSurface { crater: Some(crater()), ..BedSurface::default() };
        let words = explanation(&with).join(" ");
        for part in ["61.3 ± 3.0 mm³", "5.4 mm³", "H = 1.72 mm", "L = 4.95 mm", "V = π H (3 L² + H²) / 6 = 69 ± 12 mm³"]
        {
            assert!(words.contains(part), "{part}: {words}");
        }
        assert!(!words.contains("not reliable") && !volume_words(&crater()).contains("not reliable"));
        let mut doubted = crater();
        doubted.below_rim.doubts = "the crater has not come to rest".into();
        assert_eq!(volume_words(&doubted), "61.3 ± 3.0 mm³ below the rim (not reliable)");
        let doubted = BedSurface { crater: Some(doubted), ..with };
        assert_eq!(explanation(&doubted)[2], "not reliable: the crater has not come to rest");
        let words = explanation(&BedSurface::default()).join(" ");
        assert!(words.starts_with("no crater") && !words.contains("L ="), "{words}");
    }

    #[test]
    fn the_cap_that_is_drawn_has_the_volume_that_is_written() {
        let crater = crater();
        let points = arc(9e-3, &crater);
        // Discs between the plane of the rim and the arc, in mm.
        let outward = points[60..].windows(2).map(|ends| {
            let [r, s] = [ends[0][0] - 9.0, ends[1][0] - 9.0];
            std::f64::consts::PI * (s * s - r * r) * (6.0 - 0.5 * (ends[0][1] + ends[1][1]))
        });
        let (l, h) = (4.95, 1.72);
        let exact = std::f64::consts::PI * h * (3.0 * l * l + h * h) / 6.0;
        assert!((outward.sum::<f64>() / exact - 1.0).abs() < 1e-3);
        assert!((points[0][1] - 6.0).abs() < 1e-12 && (points[60][1] - 4.28).abs() < 1e-12);
    }

    #[test]
    fn a_profile_is_mirrored_at_the_axis() {
        let points: Points = vec![[1e-3, 2e-3], [3e-3, 4e-3]];
        let expected = [[6.0, 4.0], [8.0, 2.0], [10.0, 2.0], [12.0, 4.0]];
        let found = across(9e-3, &points);
        assert!(found.iter().zip(expected).all(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-12), "{found:?}");
    }
}
