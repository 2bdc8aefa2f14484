//! Grains that are seen from above.

use sazanami_numerics::Real;

use super::{GrainView, Sides, Tank};

const NO_GRAIN: u32 = u32::MAX;

/// For each grain whether at least half of its outline is seen from straight above, among the grains that `counts`
/// lets through. Pixels are an eighth of the mean diameter wide.
pub(super) fn exposed(tank: &Tank, grains: &GrainView, counts: impl Fn(usize) -> bool) -> Vec<bool> {
    let pixel = grains.mean_diameter() / 8.0;
    if pixel <= 0.0 {
        return Vec::new();
    }
    let columns = (tank.length() / pixel).ceil() as usize;
    let rows = ((tank.width() / pixel).ceil() as usize).max(1);
    let pixels = [tank.length() / columns as Real, tank.width() / rows as Real];
    let mut height = vec![Real::NEG_INFINITY; columns * rows];
    let mut seen_grain = vec![NO_GRAIN; columns * rows];
    let mut drawn = vec![0_u32; grains.position.len()];
    for grain in (0..grains.position.len()).filter(|&grain| counts(grain)) {
        let (centre, radius) = (grains.position[grain], 0.5 * grains.diameter[grain]);
        let y = tank.across(centre.y);
        let images = match tank.sides {
            Sides::Walls => vec![y],
            Sides::Periodic => [-1.0, 0.0, 1.0]
                .map(|n| y + n * tank.width())
                .into_iter()
                .filter(|y| y + radius > tank.y[0] && y - radius < tank.y[1])
                .collect(),
        };
        for y in images {
            let place = |x: Real, direction: usize| {
                let start = if direction == 0 { tank.x[0] } else { tank.y[0] };
                (x - start) / pixels[direction] - 0.5
            };
            let span = |x: Real, direction: usize, count: usize| {
                // Casts of negative numbers give zero.
                let last = (place(x + radius, direction).floor() + 1.0) as usize;
                place(x - radius, direction).ceil() as usize..last.min(count)
            };
            for j in span(y, 1, rows) {
                let dy = tank.y[0] + (j as Real + 0.5) * pixels[1] - y;
                for i in span(centre.x, 0, columns) {
                    let dx = tank.x[0] + (i as Real + 0.5) * pixels[0] - centre.x;
                    let rest = radius * radius - dx * dx - dy * dy;
                    if rest <= 0.0 {
                        continue;
                    }
                    drawn[grain] += 1;
                    let z = centre.z + rest.sqrt();
                    let at = j * columns + i;
                    if z > height[at] {
                        height[at] = z;
                        seen_grain[at] = grain as u32;
                    }
                }
            }
        }
    }
    let mut seen = vec![0_u32; grains.position.len()];
    for &grain in seen_grain.iter().filter(|&&grain| grain != NO_GRAIN) {
        seen[grain as usize] += 1;
    }
    seen.iter().zip(&drawn).map(|(&seen, &drawn)| drawn > 0 && 2 * seen >= drawn).collect()
}

#[cfg(test)]
mod tests {
    use super::super::made_up;
    use super::*;
    use sazanami_numerics::Vector;

    #[test]
    fn covered_grains_are_not_seen_and_periodic_sides_cover() {
        let position = [
            Vector::new(0.0, 0.004, 0.0005),
            Vector::new(0.0, 0.004, 0.0015),
            Vector::new(0.01, 0.0078, 0.0005),
            Vector::new(0.01, 0.0001, 0.0015),
            Vector::new(0.02, 0.004, 0.0005),
        ];
        let view = GrainView { position: &position, diameter: &[1e-3; 5], contacts: &[3; 5] };
        assert_eq!(exposed(&made_up::tank(Sides::Periodic), &view, |_| true), [false, true, false, true, true]);
        assert_eq!(exposed(&made_up::tank(Sides::Walls), &view, |_| true), [false, true, true, true, true]);
        assert_eq!(exposed(&made_up::tank(Sides::Walls), &view, |grain| grain != 1), [true, false, true, true, true]);
    }
}
