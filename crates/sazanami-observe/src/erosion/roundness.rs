//! Whether a hollow is as round about the axis as averages along circles suppose.

use sazanami_numerics::Real;

use super::Crater;
use crate::Horizontal;
use crate::height_map::HeightMap;

/// A hollow whose middle lies farther from the axis than this part of the rim radius is doubted, and one so many times as long as wide: either
/// takes a twentieth of the volume below the rim of a cap.
const OFF_AXIS: Real = 0.1;
const ELONGATED: Real = 1.2;

/// Plan of a hollow, by the moments of its depth below the plane of the rim within the rim radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roundness {
    /// Distance of its middle from the axis \[m].
    pub off_axis: Real,
    /// The same over the rim radius.
    pub relative: Real,
    /// Length over width: square root of the ratio of the second moments about the middle.
    pub elongation: Real,
}

impl Roundness {
    /// That of the `crater` about `axis` \[m] in a bed seen from above.
    pub(super) fn of(map: &HeightMap, axis: Horizontal, crater: &Crater) -> Self {
        let [columns, rows] = map.pixels();
        // Depths, and their first and second moments.
        let mut sums = [0.0; 6];
        for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
            let [x, y] = map.centre(i, j);
            let [x, y] = [x - axis[0], y - axis[1]];
            let Some(height) = map.height(i, j).filter(|_| x.hypot(y) < crater.rim_radius) else { continue };
            let depth = (crater.rim_height - height).max(0.0);
            let moments = [1.0, x, y, x * x, y * y, x * y];
            sums.iter_mut().zip(moments).for_each(|(sum, moment)| *sum += depth * moment);
        }
        let [all, x, y, xx, yy, xy] = sums;
        if all <= 0.0 {
            return Self { off_axis: 0.0, relative: 0.0, elongation: 1.0 };
        }
        let [x, y] = [x / all, y / all];
        let [xx, yy, xy] = [xx / all - x * x, yy / all - y * y, xy / all - x * y];
        let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        let off_axis = x.hypot(y);
        let least = (mean - half).max(Real::MIN_POSITIVE);
        Self { off_axis, relative: off_axis / crater.rim_radius, elongation: ((mean + half) / least).sqrt() }
    }

    /// What speaks against averages along circles, in words.
    pub(super) fn doubts(&self) -> impl Iterator<Item = String> {
        let &Self { off_axis, relative, elongation } = self;
        let beside = (relative > OFF_AXIS).then(|| {
            format!("the middle of the hollow lies {:.2} mm beside the axis (`erosion.axis`): averages along circles flatten the rim", 1e3 * off_axis)
        });
        let long = (elongation > ELONGATED).then(|| {
            format!("the hollow is {elongation:.1} times as long as wide: averages along circles flatten the rim")
        });
        beside.into_iter().chain(long)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Erosion, ErosionSettings, Known};
    use super::*;
    use crate::bed::test_bed::Bed;

    const D: Real = 0.52e-3;
    const HALF: Real = 16.9e-3;
    const LEVEL: Real = 8.15e-3;

    /// A rough bed with a hollow `ratio` times as long as wide, turned by `angle` [rad], whose middle lies at `x` \[m].
    fn evaluate(ratio: Real, angle: Real, x: Real) -> Erosion {
        let mut bed = Bed::columns(D, HALF, 3, |_| LEVEL);
        for (n, place) in bed.position.iter_mut().enumerate() {
            let (sin, cos) = angle.sin_cos();
            let [along, across] = [(place.x - x) * cos + place.y * sin, place.y * cos - (place.x - x) * sin];
            let r = (along / ratio.sqrt()).hypot(across * ratio.sqrt()) / 6.3e-3;
            let pit = if r < 1.0 { 0.5e-3 - 2e-3 * (1.0 - r * r) } else { (0.5e-3 - 2.5e-3 * (r - 1.0)).max(0.0) };
            let noise = ((n / 3) as Real * 12.9898).sin() * 43758.5453;
            place.z += pit + 0.5 * noise.fract() * D;
        }
        bed.view(|view| Erosion::of(view, &ErosionSettings::recommended([-HALF; 2], [HALF; 2], 0.0, D), None)).unwrap()
    }

    #[test]
    fn a_hollow_that_is_not_round_about_the_axis_is_doubted() {
        let doubts = |erosion: &Erosion| {
            let found = erosion.doubts_below_rim(Known::default());
            ["beside the axis", "as long as wide"].map(|words| found.iter().any(|doubt| doubt.contains(words)))
        };
        let round = evaluate(1.0, 0.0, 0.0);
        let volume = round.crater.volume_direct;
        assert_eq!(doubts(&round), [false; 2]);
        assert!(round.roundness.relative < 0.02 && round.roundness.elongation < 1.05, "{:?}", round.roundness);
        for angle in [0.0, 0.6] {
            let long = evaluate(1.5, angle, 0.0);
            assert_eq!(doubts(&long), [false, true], "{:?}", long.roundness);
            assert!(long.crater.volume_direct < 0.9 * volume);
        }
        let beside = evaluate(1.0, 0.0, 1.2e-3);
        assert_eq!(doubts(&beside), [true, false], "{:?}", beside.roundness);
        assert!(beside.crater.volume_direct < 0.9 * volume);
        // What is not doubted costs a twentieth of the volume at most.
        for (ratio, x) in [(1.12, 0.0), (1.0, 0.5e-3)] {
            let little = evaluate(ratio, 0.3, x);
            assert_eq!(doubts(&little), [false; 2], "{:?}", little.roundness);
            assert!(little.crater.volume_direct > 0.95 * volume, "{}", little.crater.volume_direct / volume);
        }
    }
}
