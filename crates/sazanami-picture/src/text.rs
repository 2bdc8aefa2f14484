//! Text in the font that the program carries.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont};

/// DejaVu Sans; its licence lies beside it.
static FONT: LazyLock<FontRef<'static>> = LazyLock::new(|| {
    FontRef::try_from_slice(include_bytes!("../assets/DejaVuSans.ttf")).expect("the font that is compiled in is a font")
});

/// Scale at which an em has `size` pixels.
fn scale(size: f64) -> PxScale {
    let font = &*FONT;
    let units = font.units_per_em().unwrap_or(2048.0);
    PxScale::from(size as f32 * font.height_unscaled() / units)
}

/// A glyph in its place.
struct Placed {
    glyph: GlyphId,
    /// Place of its start, from the left end of the line \[pixels].
    at: f32,
    /// Distance below the line \[pixels].
    below: f32,
    scale: PxScale,
}

/// Glyphs of a line and its length. `_{...}` is set lower and smaller, `^{...}` higher and smaller.
fn glyphs(text: &str, size: f64) -> (Vec<Placed>, f64) {
    let mut placed = Vec::with_capacity(text.len());
    let (mut at, mut previous, mut level) = (0.0, None, 0);
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '_' | '^' if characters.peek() == Some(&'{') => {
                characters.next();
                level = if character == '_' { 1 } else { -1 };
                previous = None;
                continue;
            }
            '}' if level != 0 => {
                level = 0;
                previous = None;
                continue;
            }
            _ => {}
        }
        let scale = scale(if level == 0 { size } else { 0.7 * size });
        let below = size as f32 * [-0.36, 0.0, 0.16][(level + 1) as usize];
        let font = FONT.as_scaled(scale);
        let glyph = font.glyph_id(character);
        if let Some(previous) = previous {
            at += font.kern(previous, glyph);
        }
        placed.push(Placed { glyph, at, below, scale });
        at += font.h_advance(glyph);
        previous = Some(glyph);
    }
    (placed, f64::from(at))
}

/// Length of a line \[pixels].
pub(super) fn length(text: &str, size: f64) -> f64 {
    glyphs(text, size).1
}

/// The size at which a line is no longer than `most` pixels, `size` at most.
pub(super) fn fitted(text: &str, size: f64, most: f64) -> f64 {
    size * (most / length(text, size)).min(1.0)
}

/// Calls `cover(x, y, part)` for every pixel of a line that starts at `x`, `y` = 0 with its baseline at `y` = 0;
/// `y` points down. `shift` moves the line by parts of a pixel.
pub(super) fn draw(text: &str, size: f64, shift: [f64; 2], mut cover: impl FnMut(i32, i32, f32)) {
    for Placed { glyph, at, below, scale } in glyphs(text, size).0 {
        let position = ab_glyph::point(at + shift[0] as f32, below + shift[1] as f32);
        if let Some(outline) = FONT.outline_glyph(glyph.with_scale_and_position(scale, position)) {
            let corner = outline.px_bounds().min;
            outline.draw(|x, y, part| cover(corner.x as i32 + x as i32, corner.y as i32 + y as i32, part.min(1.0)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_what_axes_need() {
        for character in "0123456789−×⁰¹²³⁴⁵⁶⁷⁸⁹⁻₁₂₃₄µ·≈≥≤σΔ°".chars() {
            assert_ne!(FONT.glyph_id(character), GlyphId(0), "{character}");
        }
        assert!(length("D_{H}", 20.0) < length("DH", 20.0) && length("D_{H}", 20.0) > length("D", 20.0));
        assert!(length("mm", 20.0) > 1.9 * length("m", 20.0));
        assert!((length("speed [m/s]", 40.0) / length("speed [m/s]", 20.0) - 2.0).abs() < 1e-3);
    }
}
