//! Splashed grains: how many, how heavy, how far.
//!
//! A grain counts as splashed from the moment its centre has risen more than one grain size above the
//! highest point of the bed before the impact, of its grains that are not held. Neither a heaved rim (lower) nor a grain that rolls or
//! slides away (never up there) is a splash. Once splashed, a grain stays so wherever it lands. A hop
//! shorter than the time between two observations can be missed, so observe often while grains fly.
//! Grains that are in the air before the impact neither raise the bed nor are ever splashed, and neither are grains that are fed in
//! later, held, or moved in a given way. A grain that leaves the box stays what it was when it was seen last: splashed, or not.

use sazanami_numerics::Real;
use sazanami_numerics::snapshot::{Snapshot, SnapshotError};
use sazanami_parallel::{for_each_chunk, reduce_over};

use crate::bed::GRAINS_AT_ONCE;
use crate::erosion::linked_to_bed;
use crate::{BedView, Horizontal};

/// Fate of a grain.
const IN_BED: u8 = 0;
const SPLASHED: u8 = 1;
const ALREADY_FLYING: u8 = 2;

/// Grains that were splashed so far.
#[derive(Clone, Debug, PartialEq)]
pub struct SplashTracker {
    axis: Horizontal,
    bed_top: Real,
    threshold: Real,
    /// The grains before the impact, in the order of their identifiers: identifier, mass \[kg] and fate of each.
    id: Vec<u64>,
    mass: Vec<Real>,
    fate: Vec<u8>,
    farthest: Real,
    highest: Real,
}

/// Splash up to a time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Splash {
    /// Number of grains that were splashed.
    pub grains: usize,
    /// Their mass \[kg].
    pub mass: Real,
    /// Largest horizontal distance of a splashed grain from the impact axis, in flight or landed \[m]; 0 if none was.
    pub farthest_distance: Real,
    /// Largest height of the centre of a splashed grain above the bed before the impact \[m]; 0 if none was.
    pub highest_rise: Real,
    /// Number of grains above the threshold now.
    pub above_now: usize,
}

/// Splashed grains of a part of the bed: their sums, and the farthest and highest place now \[m].
#[derive(Clone, Copy, Debug)]
struct SplashSums {
    splash: Splash,
    farthest: Real,
    highest: Real,
}

impl Default for SplashSums {
    fn default() -> Self {
        Self { splash: Splash::default(), farthest: 0.0, highest: Real::NEG_INFINITY }
    }
}

impl SplashSums {
    fn and(mut self, other: Self) -> Self {
        self.splash.grains += other.splash.grains;
        self.splash.mass += other.splash.mass;
        self.splash.above_now += other.splash.above_now;
        Self { farthest: self.farthest.max(other.farthest), highest: self.highest.max(other.highest), ..self }
    }
}

impl SplashTracker {
    /// Starts with the bed before the impact over a `floor` \[m]; `grain_size` is the short axis \[m].
    #[must_use]
    pub fn new(bed: &BedView, axis: Horizontal, grain_size: Real, floor: Real) -> Self {
        let linked = linked_to_bed(bed, grain_size, floor);
        let top = |of: &dyn Fn(usize) -> bool| {
            let lying = (0..bed.len()).filter(|&grain| linked[grain] && of(grain));
            lying.map(|grain| bed.top_of(grain)).fold(Real::NEG_INFINITY, Real::max)
        };
        // A pier or a stone that is held stands out of the bed.
        let free = top(&|grain| !bed.held[grain]);
        let bed_top = if free.is_finite() { free } else { top(&|_| true) };
        let threshold = bed_top + grain_size;
        let fate = linked.iter().map(|&linked| if linked { IN_BED } else { ALREADY_FLYING }).collect();
        let (id, mass) = (bed.id.to_vec(), bed.mass.to_vec());
        Self { axis, bed_top, threshold, id, mass, fate, farthest: 0.0, highest: threshold }
    }

    /// Height above which a centre counts as splashed \[m].
    #[must_use]
    pub fn threshold(&self) -> Real {
        self.threshold
    }

    /// Observes the bed now. Grains may have left it or come to it since the start.
    pub fn observe(&mut self, bed: &BedView) -> Splash {
        let places = self.places(bed);
        let above = |place: usize| bed.position[place].z > self.threshold && !bed.held[place];
        for_each_chunk(&mut self.fate[..], GRAINS_AT_ONCE, |number, fate| {
            let places = &places[number * GRAINS_AT_ONCE..];
            for (fate, place) in fate.iter_mut().zip(places) {
                if *fate == IN_BED && place.is_some_and(above) {
                    *fate = SPLASHED;
                }
            }
        });
        let of_chunk = |number| self.of_chunk(bed, &places, number);
        let found = reduce_over(self.id.len().div_ceil(GRAINS_AT_ONCE), of_chunk, SplashSums::and);
        let SplashSums { mut splash, farthest, highest } = found.unwrap_or_default();
        (self.farthest, self.highest) = (self.farthest.max(farthest), self.highest.max(highest));
        if splash.grains > 0 {
            splash.farthest_distance = self.farthest;
            splash.highest_rise = self.highest - self.bed_top;
        }
        splash
    }

    /// Place in `bed` of each grain from before the impact; none of one that has left. Both are in the order of identifiers.
    fn places(&self, bed: &BedView) -> Vec<Option<usize>> {
        let mut next = 0;
        let place = |&id: &u64| {
            next += bed.id[next..].iter().take_while(|&&other| other < id).count();
            (bed.id.get(next) == Some(&id)).then_some(next)
        };
        self.id.iter().map(place).collect()
    }

    /// Splashed grains of a chunk of the grains from before the impact.
    fn of_chunk(&self, bed: &BedView, places: &[Option<usize>], number: usize) -> SplashSums {
        let grains = number * GRAINS_AT_ONCE..((number + 1) * GRAINS_AT_ONCE).min(self.id.len());
        grains.filter(|&grain| self.fate[grain] == SPLASHED).fold(SplashSums::default(), |mut found, grain| {
            found.splash.grains += 1;
            found.splash.mass += self.mass[grain];
            let Some(place) = places[grain] else { return found };
            let position = bed.position[place];
            found.splash.above_now += usize::from(position.z > self.threshold);
            found.farthest = found.farthest.max((position.x - self.axis[0]).hypot(position.y - self.axis[1]));
            found.highest = found.highest.max(position.z);
            found
        })
    }

    /// Writes the state into a snapshot.
    pub fn save(&self, snapshot: &mut Snapshot) {
        snapshot.put_u64("splash.id", self.id.clone());
        snapshot.put_reals("splash.mass", self.mass.clone());
        snapshot.put_bytes("splash.splashed", self.fate.clone());
        let numbers = [self.axis[0], self.axis[1], self.bed_top, self.threshold, self.farthest, self.highest];
        snapshot.put_reals("splash.numbers", numbers.to_vec());
    }

    /// Reads the state from a snapshot.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is not there.
    pub fn restore(snapshot: &Snapshot) -> Result<Self, SnapshotError> {
        let id = snapshot.u64("splash.id")?.to_vec();
        let mass = snapshot.reals_of("splash.mass", id.len())?.to_vec();
        let fate = snapshot.bytes("splash.splashed")?.to_vec();
        if fate.len() != id.len() {
            let (name, expected, found) = ("splash.splashed".to_owned(), id.len(), fate.len());
            return Err(SnapshotError::Length { name, expected, found });
        }
        let numbers = snapshot.reals_of("splash.numbers", 6)?;
        Ok(Self {
            axis: [numbers[0], numbers[1]],
            bed_top: numbers[2],
            threshold: numbers[3],
            id,
            mass,
            fate,
            farthest: numbers[4],
            highest: numbers[5],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bed::test_bed::Bed;
    use sazanami_numerics::Vector;

    const D: Real = 0.5e-3;

    fn start() -> (Bed, SplashTracker) {
        let bed = Bed::columns(D, 2e-3, 2, |_| 1e-3);
        let tracker = bed.view(|view| SplashTracker::new(view, [0.0; 2], D, -1.0));
        (bed, tracker)
    }

    #[test]
    fn a_splashed_grain_stays_splashed_where_it_lands() {
        let (mut bed, mut tracker) = start();
        assert!((tracker.threshold() - 1.5e-3).abs() < 1e-15);
        assert_eq!(bed.view(|view| tracker.observe(view)), Splash::default());
        (bed.position[3].x, bed.position[3].y, bed.position[3].z) = (3e-3, 4e-3, 2e-3);
        let flying = bed.view(|view| tracker.observe(view));
        assert_eq!((flying.grains, flying.above_now), (1, 1));
        assert!((flying.farthest_distance - 5e-3).abs() < 1e-15 && (flying.highest_rise - 1e-3).abs() < 1e-15);
        (bed.position[3].x, bed.position[3].z) = (4.5e-3, 0.25e-3);
        let landed = bed.view(|view| tracker.observe(view));
        assert_eq!((landed.grains, landed.above_now, landed.mass), (1, 0, 1e-7));
        assert!(landed.farthest_distance > flying.farthest_distance);
        assert_eq!(landed.highest_rise, flying.highest_rise);
    }

    #[test]
    fn a_held_body_that_stands_out_of_the_bed_is_not_its_top() {
        // A post in the middle column, of grains on one another.
        let mut bed = Bed::columns(D, 2e-3, 6, |r| if r < 0.5e-3 { 3e-3 } else { 1e-3 });
        let post: Vec<usize> = (0..bed.held.len()).filter(|&n| bed.position[n].z > 1e-3).collect();
        let threshold = |bed: &Bed| bed.view(|view| SplashTracker::new(view, [0.0; 2], D, -1.0)).threshold();
        let loose = threshold(&bed);
        assert!(!post.is_empty() && (loose - 3.5e-3).abs() < 1e-12, "{loose}");
        post.iter().for_each(|&n| bed.held[n] = true);
        assert!((threshold(&bed) - 1.5e-3).abs() < 0.3e-3, "{}", threshold(&bed));
        // Of held grains alone the highest counts.
        bed.held.fill(true);
        assert_eq!(threshold(&bed), loose);
    }

    #[test]
    fn a_rim_and_a_rolling_grain_are_no_splash() {
        let (mut bed, mut tracker) = start();
        bed.position[1].z = 1.49e-3;
        bed.position[5].x = 20e-3;
        assert_eq!(bed.view(|view| tracker.observe(view)), Splash::default());
    }

    #[test]
    fn a_grain_that_flies_before_the_impact_is_no_splash_and_no_bed() {
        let (resting, _) = start();
        let mut bed = resting;
        bed.position[3].z = 20e-3;
        let mut tracker = bed.view(|view| SplashTracker::new(view, [0.0; 2], D, -1.0));
        assert!((tracker.threshold() - 1.5e-3).abs() < 1e-15);
        assert_eq!(bed.view(|view| tracker.observe(view)), Splash::default());
        bed.position[5].z = 3e-3;
        assert_eq!(bed.view(|view| tracker.observe(view)).grains, 1);
    }

    #[test]
    fn a_grain_that_leaves_stays_what_it_was() {
        let (mut bed, mut tracker) = start();
        let mut unaware = tracker.clone();
        bed.position[3].z = 3e-3;
        let flying = bed.view(|view| tracker.observe(view));
        assert_eq!((flying.grains, flying.above_now, flying.mass), (1, 1, 1e-7));
        // It leaves, and with it one that lies in the bed.
        let mut rest = bed.without(3).without(7);
        let left = rest.view(|view| tracker.observe(view));
        assert_eq!(left, Splash { above_now: 0, ..flying });
        // The others are still known by their identifiers: the next one, in the place of the first, is splashed too.
        rest.position[3].z = 4e-3;
        let second = rest.view(|view| tracker.observe(view));
        assert_eq!((second.grains, second.above_now, second.mass), (2, 1, 2e-7));
        // Negative control: one that left before it was seen in the air is none.
        assert_eq!(rest.view(|view| unaware.observe(view)).grains, 1);
    }

    #[test]
    fn grains_that_are_fed_in_or_held_are_no_splash() {
        let (bed, mut tracker) = start();
        let mut fed = Bed::new(D, bed.position.iter().copied().chain([Vector::new(0.0, 0.0, 9e-3)]).collect());
        assert_eq!(fed.view(|view| tracker.observe(view)), Splash::default());
        fed.position[5].z = 9e-3;
        fed.held[5] = true;
        assert_eq!(fed.view(|view| tracker.observe(view)), Splash::default());
        // Negative control: the same grain of the bed, once it is let go.
        fed.held[5] = false;
        assert_eq!(fed.view(|view| tracker.observe(view)).grains, 1);
    }

    #[test]
    fn the_state_survives_a_snapshot() {
        let (mut bed, mut tracker) = start();
        bed.position[3].z = 3e-3;
        bed.view(|view| tracker.observe(view));
        let mut snapshot = Snapshot::default();
        tracker.save(&mut snapshot);
        assert_eq!(SplashTracker::restore(&snapshot).unwrap(), tracker);
        assert!(SplashTracker::restore(&Snapshot::default()).is_err());
    }
}
