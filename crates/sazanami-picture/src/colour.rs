//! Colours and colour scales.

/// Red, green and blue as written in a file (sRGB).
pub type Colour = [u8; 3];

/// Red, green and blue proportional to light.
pub(super) type Light = [f32; 3];

pub(super) const BLACK: Colour = [20, 20, 22];
pub(super) const WHITE: Colour = [255, 255, 255];
pub(super) const GREY: Colour = [120, 124, 130];
/// Water.
pub(super) const BLUE: Colour = [38, 110, 190];

/// A way from low to high.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourMap {
    /// Sand at rest, then orange, red and purple: grains by speed.
    Sand,
    /// Dark violet to yellow, of even steps to the eye (viridis of Smith and van der Walt).
    Viridis,
    /// Blue, white, red: quantities of either sign.
    BlueRed,
}

/// Colours for a range of values that stays the same from picture to picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourScale {
    /// Quantity shown, with its unit, as in `grain speed [m/s]`.
    pub label: String,
    /// Values of the first and the last colour; what lies beyond has these.
    pub range: [f64; 2],
    /// Colours between.
    pub map: ColourMap,
}

impl ColourScale {
    /// Grains by speed up to `fastest` [m/s].
    #[must_use]
    pub fn speed(fastest: f64) -> Self {
        Self { label: "grain speed [m/s]".to_owned(), range: [0.0, fastest], map: ColourMap::Sand }
    }

    /// Grains by height between those of the first and the last colour \[m].
    #[must_use]
    pub fn height(range: [f64; 2]) -> Self {
        Self { label: "height x₃ [mm]".to_owned(), range: range.map(|height| 1e3 * height), map: ColourMap::Viridis }
    }

    /// A quantity of either sign, zero in the middle, up to `largest` to either side.
    #[must_use]
    pub fn symmetric(label: &str, largest: f64) -> Self {
        Self { label: label.to_owned(), range: [-largest, largest], map: ColourMap::BlueRed }
    }

    /// Colour of `value`.
    #[must_use]
    pub fn colour(&self, value: f64) -> Colour {
        let [low, high] = self.range;
        let part = (value - low) / (high - low);
        self.map.colour(if part.is_nan() { 0.0 } else { part })
    }
}

impl ColourMap {
    fn stops(self) -> &'static [Colour] {
        match self {
            Self::Sand => &[[214, 190, 146], [238, 168, 78], [232, 104, 46], [190, 40, 60], [110, 16, 92]],
            Self::Viridis => &[
                [68, 1, 84],
                [71, 44, 122],
                [59, 81, 139],
                [44, 113, 142],
                [33, 144, 141],
                [39, 173, 129],
                [92, 200, 99],
                [170, 220, 50],
                [253, 231, 37],
            ],
            Self::BlueRed => &[[33, 75, 165], [120, 165, 215], [242, 242, 240], [232, 145, 110], [170, 25, 40]],
        }
    }

    /// Colour at `part` of the way, from 0 to 1.
    #[must_use]
    pub fn colour(self, part: f64) -> Colour {
        let stops = self.stops();
        let place = part.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
        let first = (place as usize).min(stops.len() - 2);
        let weight = place - first as f64;
        std::array::from_fn(|c| {
            let (a, b) = (f64::from(stops[first][c]), f64::from(stops[first + 1][c]));
            (a + (b - a) * weight).round() as u8
        })
    }
}

/// Light of a colour (IEC 61966-2-1).
pub(super) fn to_light(colour: Colour) -> Light {
    colour.map(|c| {
        let c = f32::from(c) / 255.0;
        if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    })
}

/// Colour of light (IEC 61966-2-1).
pub(super) fn to_colour(light: Light) -> Colour {
    light.map(|c| {
        let c = c.clamp(0.0, 1.0);
        let c = if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (c * 255.0 + 0.5) as u8
    })
}

/// Colours of light from a table, within one step of [`to_colour`].
pub(super) struct Shades(Vec<u8>);

impl Shades {
    const STEPS: usize = 1 << 13;

    pub fn new() -> Self {
        let shade = |n: usize| to_colour([n as f32 / Self::STEPS as f32; 3])[0];
        Self((0..=Self::STEPS).map(shade).collect())
    }

    pub fn colour(&self, light: Light) -> Colour {
        light.map(|c| self.0[(c.clamp(0.0, 1.0) * Self::STEPS as f32 + 0.5) as usize])
    }
}

/// Light between `a` and `b`.
pub(super) fn mix(a: Light, b: Light, weight: f32) -> Light {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_survive_the_way_through_light() {
        for c in 0..=255 {
            assert_eq!(to_colour(to_light([c, 255 - c, c])), [c, 255 - c, c]);
        }
    }

    #[test]
    fn the_table_of_shades_is_within_one_step() {
        let shades = Shades::new();
        for n in 0..=5000 {
            let light = [n as f32 / 5000.0; 3];
            let [exact, table] = [to_colour(light)[0], shades.colour(light)[0]];
            assert!(exact.abs_diff(table) <= 1, "{n}: {exact} {table}");
        }
    }

    #[test]
    fn a_scale_is_fixed_at_its_ends() {
        let scale = ColourScale::speed(2.0);
        assert_eq!(scale.colour(-1.0), ColourMap::Sand.colour(0.0));
        assert_eq!(scale.colour(7.0), ColourMap::Sand.colour(1.0));
        assert_eq!(scale.colour(f64::NAN), ColourMap::Sand.colour(0.0));
        assert_eq!(scale.colour(1.0), [232, 104, 46]);
        let force = ColourScale::symmetric("f [N]", 1e-6);
        assert_eq!(force.colour(0.0), ColourMap::BlueRed.colour(0.5));
        assert_eq!((force.colour(-1e-6), force.colour(1e-6)), ([33, 75, 165], [170, 25, 40]));
    }
}
