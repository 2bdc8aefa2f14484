//! First places of grains of unlike sizes: at random, the largest first, each where there is room.
//!
//! Random sequential addition (Widom (1966), doi:10.1063/1.1726548) by falling size: fine grains find room between coarse ones, so that
//! the space is filled about as densely as by a loose bed, and grains have little more to fall than their own size, wherever
//! they are. Grains are balls here, as large as they reach.

use std::collections::HashMap;
use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use sazanami_numerics::Random;

/// Part of the space that the balls fill.
const FILLED: Real = 0.35;
/// Places that are tried for a grain before there is made more room above.
const TRIES: usize = 100;
/// Factor on the height then.
const HIGHER: Real = 1.05;

/// Height that balls of these `radii` \[m] fill at first in a box of this `size` \[m] \[m].
pub(super) fn scattered_height(size: Vector, radii: impl Iterator<Item = Real>) -> Real {
    let (volume, largest) = radii.fold((0.0, 0.0_f64), |(volume, largest), radius| {
        (volume + 4.0 / 3.0 * PI * radius.powi(3), largest.max(radius))
    });
    (volume / (FILLED * size.x * size.y)).max(2.0 * largest)
}

/// Balls of like size, by cells as wide as the largest of them.
#[derive(Debug)]
struct Class {
    width: Real,
    cells: HashMap<[i64; 3], Vec<usize>>,
}

impl Class {
    fn cell(&self, place: Vector) -> [i64; 3] {
        place.to_array().map(|x| (x / self.width).floor() as i64)
    }
}

/// Places of balls of these `radii` \[m] above the lower corner of a box of this `size` \[m], periodic in x1 and x2 or not \[m]; the width that the box lacks if it is narrower
/// than a ball.
pub(super) fn scatter(
    size: Vector,
    periodic: [bool; 2],
    radii: &[Real],
    random: &mut Random,
) -> Result<Vec<Vector>, Real> {
    let mut order: Vec<usize> = (0..radii.len()).collect();
    order.sort_by(|&a, &b| radii[b].total_cmp(&radii[a]).then(a.cmp(&b)));
    let largest = order.first().map_or(0.0, |&n| radii[n]);
    if 2.0 * largest > size.x.min(size.y) {
        return Err(2.0 * largest);
    }
    let mut height = scattered_height(size, radii.iter().copied());
    let mut places = vec![Vector::ZERO; radii.len()];
    let mut classes: Vec<Class> = Vec::new();
    // Images of a place in periodic directions, itself first.
    let images = |d: usize, length: Real| if periodic[d] { vec![0.0, -length, length] } else { vec![0.0] };
    let [along, across] = [images(0, size.x), images(1, size.y)];
    let shifts: Vec<Vector> = across.iter().flat_map(|&y| along.iter().map(move |&x| Vector::new(x, y, 0.0))).collect();
    for n in order {
        let radius = radii[n];
        let is_free = |place: Vector, places: &[Vector], classes: &[Class]| {
            let apart = |class: &Class| {
                let [i, j, k] = class.cell(place);
                let near = (0..27).map(|c| [i + c % 3 - 1, j + c / 3 % 3 - 1, k + c / 9 - 1]);
                let mut there = near.filter_map(|cell| class.cells.get(&cell)).flatten();
                there.all(|&m| place.distance_squared(places[m]) >= (radius + radii[m]).powi(2))
            };
            classes.iter().all(apart)
        };
        let mut tries = 0;
        let place = loop {
            let within = |length: Real, wraps: bool, random: &mut Random| {
                let margin = if wraps { 0.0 } else { radius };
                random.between(margin, length - margin)
            };
            let x = within(size.x, periodic[0], random);
            let y = within(size.y, periodic[1], random);
            let place = Vector::new(x, y, within(height, false, random));
            if shifts.iter().all(|&shift| is_free(place + shift, &places, &classes)) {
                break place;
            }
            tries += 1;
            if tries % TRIES == 0 {
                height *= HIGHER;
            }
        };
        places[n] = place;
        // A class holds balls down to half of its largest: two of it and a smaller one meet within a cell's width.
        if classes.last().is_none_or(|class| 4.0 * radius < class.width) {
            classes.push(Class { width: 2.0 * radius, cells: HashMap::new() });
        }
        if let Some(class) = classes.last_mut() {
            class.cells.entry(class.cell(place)).or_default().push(n);
        }
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattered_balls_do_not_touch_each_other_their_images_or_walls() {
        let size = Vector::new(10.0, 12.0, 50.0);
        let periodic = [true, false];
        let radii: Vec<Real> = (0..400).map(|n| 3.0 / (1.0 + Real::from(n)).sqrt()).collect();
        let places = scatter(size, periodic, &radii, &mut Random::new(3)).expect("the box is wide enough");
        let apart =
            |shift: Real, a: usize, b: usize| places[a].distance(places[b] + shift * Vector::X) - radii[a] - radii[b];
        let mut closest = Real::INFINITY;
        for a in 0..radii.len() {
            let wall = places[a].y.min(size.y - places[a].y).min(places[a].z);
            assert!(wall >= radii[a] && (0.0..size.x).contains(&places[a].x));
            for b in 0..a {
                for shift in [0.0, size.x, -size.x] {
                    closest = closest.min(apart(shift, a, b));
                }
            }
        }
        assert!((0.0..0.05).contains(&closest), "{closest}: fine grains lie beside others");
        // Negative control: places that do not know of one another meet.
        let alone = |n: usize| scatter(size, periodic, &radii[n..=n], &mut Random::new(3)).expect("wide enough")[0];
        assert!(alone(1).distance(alone(2)) < radii[1] + radii[2]);
        let top = (0..radii.len()).map(|n| places[n].z + radii[n]).fold(0.0, Real::max);
        assert!(top < 1.5 * scattered_height(size, radii.iter().copied()), "{top}");
        assert_eq!(scatter(size, periodic, &[6.0], &mut Random::new(1)), Err(12.0), "too wide");
    }
}
