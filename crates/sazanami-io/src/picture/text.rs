//! Text in the font that the program carries.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont};

/// DejaVu Sans; its licence lies beside it.
static FONT: LazyLock<FontRef<'static>> = LazyLock::new(|| {
    FontRef::try_from_slice(include_bytes!("../../assets/DejaVuSans.ttf"))
        .expect("the font that is compiled in is a font")
});

/// Scale at which an em has `size` pixels.
fn scale(size: f64) -> PxScale {
    let font = &*FONT;
    let units = font.units_per_em().unwrap_or(2048.0);
    PxScale::from(size as f32 * font.height_unscaled() / units)
}

/// Glyphs of a line with the places where they start [pixels from the left end].
fn glyphs(text: &str, size: f64) -> (Vec<(GlyphId, f32)>, f64) {
    let font = FONT.as_scaled(scale(size));
    let mut placed = Vec::with_capacity(text.len());
    let (mut at, mut previous) = (0.0, None);
    for character in text.chars() {
        let glyph = font.glyph_id(character);
        if let Some(previous) = previous {
            at += font.kern(previous, glyph);
        }
        placed.push((glyph, at));
        at += font.h_advance(glyph);
        previous = Some(glyph);
    }
    (placed, f64::from(at))
}

/// Length of a line [pixels].
pub(super) fn length(text: &str, size: f64) -> f64 {
    glyphs(text, size).1
}

/// Calls `cover(x, y, part)` for every pixel of a line that starts at `x`, `y` = 0 with its baseline at `y` = 0;
/// `y` points down. `shift` moves the line by parts of a pixel.
pub(super) fn draw(text: &str, size: f64, shift: [f64; 2], mut cover: impl FnMut(i32, i32, f32)) {
    let scale = scale(size);
    for (glyph, at) in glyphs(text, size).0 {
        let position = ab_glyph::point(at + shift[0] as f32, shift[1] as f32);
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
        assert!(length("mm", 20.0) > 1.9 * length("m", 20.0));
        assert!((length("speed [m/s]", 40.0) / length("speed [m/s]", 20.0) - 2.0).abs() < 1e-3);
    }
}
