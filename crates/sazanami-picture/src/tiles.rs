//! Several pictures on one sheet.

use super::Picture;
use super::canvas::{Anchor, Canvas, Font};
use super::colour::BLACK;

/// Height of the strip with the title \[pixels].
const TITLE: usize = 46;

/// One sheet with a title, which may be empty, and rows of pictures below each other, each row from the left.
#[must_use]
pub fn sheet(title: &str, rows: &[Vec<Picture>]) -> Picture {
    let top = if title.is_empty() { 0 } else { TITLE };
    let height_of = |row: &Vec<Picture>| row.iter().map(Picture::height).max().unwrap_or(0);
    let width = rows.iter().map(|row| row.iter().map(Picture::width).sum()).max().unwrap_or(0);
    let mut canvas = Canvas::new(width.max(1), (top + rows.iter().map(height_of).sum::<usize>()).max(1));
    let font = Font { size: 25.0, colour: BLACK, across: Anchor::Middle, down: Anchor::Middle, upwards: false };
    canvas.text([0.5 * width as f64, 0.55 * TITLE as f64], title, font);
    let mut y = top;
    for row in rows {
        let mut x = 0;
        for picture in row {
            canvas.paste(x, y, picture);
            x += picture.width();
        }
        y += height_of(row);
    }
    canvas.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(width: usize, height: usize, shade: u8) -> Picture {
        Picture { width, height, rgb: vec![shade; 3 * width * height] }
    }

    #[test]
    fn every_picture_keeps_its_pixels() {
        let rows = [vec![tile(4, 3, 10), tile(2, 5, 20)], vec![tile(3, 2, 30)]];
        let whole = sheet("", &rows);
        assert_eq!((whole.width(), whole.height()), (6, 7));
        for (shade, count) in [(10, 12), (20, 10), (30, 6), (255, 42 - 28)] {
            assert_eq!(whole.pixels().iter().filter(|&&pixel| pixel == [shade; 3]).count(), count);
        }
        assert_eq!(whole.pixels()[5 * 6], [30; 3]);
        let titled = sheet("a title", &rows);
        assert_eq!(titled.height(), 7 + TITLE);
        assert_eq!(titled.pixels()[TITLE * 6..], *whole.pixels());
        assert_eq!((sheet("", &[]).width(), sheet("", &[]).height()), (1, 1));
    }
}
