//! First places of grains of unlike sizes: at random, the largest first, each where there is room.
//!
//! Random sequential addition (Widom (1966), doi:10.1063/1.1726548) by falling size: fine grains find room between coarse ones, so that
//! the space is filled about as densely as by a loose bed, and grains have little more to fall than their own size, wherever
//! they are. Grains are balls here, as large as they reach.

use std::collections::HashMap;
use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use sazanami_numerics::Random;

/// Part of the space that the balls fill at first.
const FILLED: Real = 0.35;
/// Places that are tried for a grain before all begin anew with more room: at [`FILLED`] those of a usual sieve curve need 25 on the mean.
const TRIES: usize = 1000;
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
///
/// Where one finds no room all begin anew below a greater height: the coarse ones have their places first, and room that were added above
/// them would be left to the fine ones.
pub(super) fn scatter(
    size: Vector,
    periodic: [bool; 2],
    radii: &[Real],
    random: &mut Random,
) -> Result<Vec<Vector>, Real> {
    let largest = radii.iter().copied().fold(0.0, Real::max);
    if 2.0 * largest > size.x.min(size.y) {
        return Err(2.0 * largest);
    }
    let room = Room::new(size, periodic, radii);
    let mut height = scattered_height(size, radii.iter().copied());
    loop {
        if let Some(places) = room.filled(height, random) {
            return Ok(places);
        }
        height *= HIGHER;
    }
}

/// A box to be filled with balls.
#[derive(Debug)]
struct Room<'a> {
    size: Vector,
    periodic: [bool; 2],
    /// From a place to its images in periodic directions \[m]; none first, for the place itself.
    shifts: Vec<Vector>,
    radii: &'a [Real],
    /// The balls by falling radius.
    order: Vec<usize>,
}

impl<'a> Room<'a> {
    fn new(size: Vector, periodic: [bool; 2], radii: &'a [Real]) -> Self {
        let mut order: Vec<usize> = (0..radii.len()).collect();
        order.sort_by(|&a, &b| radii[b].total_cmp(&radii[a]).then(a.cmp(&b)));
        let images = |d: usize, length: Real| if periodic[d] { vec![0.0, -length, length] } else { vec![0.0] };
        let [along, across] = [images(0, size.x), images(1, size.y)];
        let shift = |&y: &Real| along.iter().map(move |&x| Vector::new(x, y, 0.0));
        Self { size, periodic, shifts: across.iter().flat_map(shift).collect(), radii, order }
    }

    /// Places of all balls below this height \[m]; `None` where one finds none in [`TRIES`].
    fn filled(&self, height: Real, random: &mut Random) -> Option<Vec<Vector>> {
        let mut places = vec![Vector::ZERO; self.radii.len()];
        let mut classes: Vec<Class> = Vec::new();
        for &n in &self.order {
            let radius = self.radii[n];
            let mut tried = (0..TRIES).map(|_| self.drawn(radius, height, random));
            let place = tried.find(|&place| self.is_free(place, radius, &places, &classes))?;
            places[n] = place;
            // A class holds balls down to half of its largest: two of it and a smaller one meet within a cell's width.
            if classes.last().is_none_or(|class| 4.0 * radius < class.width) {
                classes.push(Class { width: 2.0 * radius, cells: HashMap::new() });
            }
            if let Some(class) = classes.last_mut() {
                class.cells.entry(class.cell(place)).or_default().push(n);
            }
        }
        Some(places)
    }

    /// A place for a ball, whatever is there already.
    fn drawn(&self, radius: Real, height: Real, random: &mut Random) -> Vector {
        let mut within = |length: Real, wraps: bool| {
            let margin = if wraps { 0.0 } else { radius };
            random.between(margin, length - margin)
        };
        let x = within(self.size.x, self.periodic[0]);
        let y = within(self.size.y, self.periodic[1]);
        Vector::new(x, y, within(height, false))
    }

    /// Whether a ball there and its images keep clear of those that have a place.
    fn is_free(&self, place: Vector, radius: Real, places: &[Vector], classes: &[Class]) -> bool {
        let apart = |place: Vector, class: &Class| {
            let [i, j, k] = class.cell(place);
            let near = (0..27).map(|c| [i + c % 3 - 1, j + c / 3 % 3 - 1, k + c / 9 - 1]);
            let mut there = near.filter_map(|cell| class.cells.get(&cell)).flatten();
            there.all(|&m| place.distance_squared(places[m]) >= (radius + self.radii[m]).powi(2))
        };
        self.shifts.iter().all(|&shift| classes.iter().all(|class| apart(place + shift, class)))
    }
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

    /// Radii of a sieve curve from 0.5 to 1.2, half of the mass of which is below [`MEDIAN`]: as many from each part of it.
    fn sieved(count: usize) -> Vec<Real> {
        let ends = [0.5, MEDIAN, 1.2].map(|radius: Real| radius.powi(-2));
        let of_part = |n: usize| (ends[n] - ends[n + 1]) / [MEDIAN - 0.5, 1.2 - MEDIAN][n];
        let fine = of_part(0) / (of_part(0) + of_part(1));
        let radius = |n: usize| {
            let at = (n as Real + 0.5) / count as Real;
            let (part, share) = if at < fine { (0, at / fine) } else { (1, (at - fine) / (1.0 - fine)) };
            (ends[part] - share * (ends[part] - ends[part + 1])).powf(-0.5)
        };
        (0..count).map(radius).collect()
    }

    const MEDIAN: Real = 0.8;

    #[test]
    fn fine_and_coarse_balls_are_mixed_alike_at_every_height() {
        // In a box that is hardly wider than the coarse ones room is lacking at first.
        for (width, count, lacks_room) in [(20.0, 2700, false), (2.5, 600, true)] {
            let (size, radii) = (Vector::new(width, width, 1.0), sieved(count));
            let places = scatter(size, [false; 2], &radii, &mut Random::new(1)).expect("the box is wide enough");
            let top = (0..count).map(|n| places[n].z + radii[n]).fold(0.0, Real::max);
            let first = scattered_height(size, radii.iter().copied());
            assert_eq!(top > 1.02 * first, lacks_room, "{width}: {top} of {first}");
            // Share of the mass between two heights that is fine, with fine balls at some of their heights.
            let fine = |low: Real, high: Real, lifted: &dyn Fn(Real) -> Real| {
                let mass_below = |most: Real| {
                    let is_there = |&n: &usize| {
                        let z = if radii[n] < MEDIAN { lifted(places[n].z) } else { places[n].z };
                        radii[n] < most && (low * top..high * top).contains(&z)
                    };
                    (0..count).filter(is_there).map(|n| radii[n].powi(3)).sum::<Real>()
                };
                mass_below(MEDIAN) / mass_below(Real::INFINITY)
            };
            let as_they_lie = |low: Real, high: Real| fine(low, high, &|z| z);
            let all = as_they_lie(0.0, 1.0);
            assert!((all - 0.5).abs() < 0.01, "{all}");
            for (low, high, most) in [(0.0, 0.5, 0.05), (0.5, 1.0, 0.05), (0.8, 1.0, 0.1)] {
                let found = as_they_lie(low, high);
                assert!((found - all).abs() < most, "{width}: {found} from {low} to {high}");
            }
            // Negative control: with a fifth more room for the fine ones alone, above the others.
            assert!((fine(0.8, 1.2, &|z| 1.2 * z) - all).abs() > 0.1, "{width}");
        }
    }
}
