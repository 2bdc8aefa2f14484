//! `[ripples]`: ripples of a bed, and what was measured of them, for `solver = "mps"`.

use std::ops::Range;
use std::path::PathBuf;

use sazanami_case_derive::Keys;
use sazanami_io::MeasuredProfile;
use sazanami_numerics::{Real, Vector, choices};

use super::observed::{first_size, range_of_grain_size};
use crate::read::{Context, Table};
use crate::units::rounded;

/// Distance from the end walls at which ripples are not measured \[m], in tanks four times as long or longer.
const MARGIN: Real = 10e-3;
/// Distance from the end walls that a tank of this length \[m] has where its case says nothing \[m].
pub(crate) fn usual_margin(length: Real) -> Real {
    MARGIN.min(0.25 * length)
}

/// Largest such distance over the length of the tank: something has to be left in the middle.
const WIDEST_MARGIN: Real = 0.45;
/// Force at the ends of the colours, over the submerged weight of a grain, where a case says nothing.
pub const COLOUR_FORCE: Real = 0.3;

choices! {
    /// Reference of the layers of a bed.
    pub enum LayerReference {
        /// From the floor, where grains and water are now.
        Floor = "floor",
        /// From the surface of the bed, where grains and water are now.
        Surface = "surface",
    }
}

/// Ripples, for `solver = "mps"`. Absent: not observed. An empty table observes them with the defaults.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Ripples {
    /// Grain size d.
    #[key(unit = "m", within = range_of_grain_size(cx), default = first_size(table, "ripple", cx),
          says = "that of the first population")]
    pub grain_size: Real,
    /// Thickness of the two layers of averages.
    #[key(unit = "m", within = Between(0.1 * grain_size, cx.known.domain.extent().z),
          default = (5.0 * grain_size).min(cx.known.domain.extent().z), says = "5 d, at most the height of the box")]
    pub layer_thickness: Real,
    /// Reference of the layers.
    #[key(word, default = LayerReference::Floor)]
    pub layers: LayerReference,
    /// Part of x1 that is averaged over, about the middle; at most the length of the tank.
    #[key(unit = "m", within = Between(grain_size, cx.known.domain.extent().x),
          default = cx.known.domain.extent().x, says = "the whole length")]
    pub layer_length: Real,
    /// Distance from the end walls at which ripples are not measured; less than 0.45 of the tank. A box that is periodic along x1 has
    /// none and is measured whole.
    #[key(unit = "m", within = Between(0.0, WIDEST_MARGIN * cx.known.domain.extent().x),
          default = usual_margin(cx.known.domain.extent().x), says = "10 mm, at most a quarter of the length")]
    pub margin: Real,
    /// Speed at the upper end of the colours of grains by speed.
    #[key(unit = "m/s", range = Positive, default = 0.1)]
    pub colour_speed: Real,
    /// Drag and force of the pressure at the ends of the colours of grains, over the submerged weight of a grain.
    #[key(range = Positive, default = COLOUR_FORCE)]
    pub colour_force: Real,
    /// Profiles of an experiment, see docs/guide/ripples.md.
    #[key(tables)]
    pub measured: Vec<Measured>,
    /// Middle of the tank along x1 \[m].
    #[key(skip = cx.known.domain.middle()[0])]
    pub middle: Real,
}

impl Ripples {
    fn check(&mut self, _: &Table<'_>, _: &mut Context<'_>) {
        self.measured = joined(std::mem::take(&mut self.measured));
    }

    /// Part of x1 that is averaged over \[m].
    #[must_use]
    pub fn layer_range(&self) -> [Real; 2] {
        let half = 0.5 * self.layer_length;
        [self.middle - half, self.middle + half]
    }
}

/// Tables of one time become one, unless both name the same surface.
fn joined(list: Vec<Measured>) -> Vec<Measured> {
    let mut found: Vec<Measured> = Vec::new();
    for mut one in list.into_iter().filter(|one| one.bed.is_some() || one.water.is_some()) {
        match found.iter_mut().find(|other| other.can_take(&one)) {
            Some(other) => {
                other.bed = other.bed.take().or(one.bed.take());
                other.water = other.water.take().or(one.water.take());
            }
            None => found.push(one),
        }
    }
    found
}

/// Measured profiles of a time.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Measured {
    /// Time of the profiles.
    #[key(unit = "s", range = NonNegative, example = "3 s")]
    pub time: Real,
    /// File with columns `x_m,z_m`: surface of the bed.
    pub bed: Option<PathBuf>,
    /// File with columns `x_m,z_m`: surface of the water.
    pub water: Option<PathBuf>,
}

impl Measured {
    /// Times closer than this are the same \[s].
    const SAME_TIME: Real = 1e-9;

    /// Whether it was measured at `time` \[s].
    #[must_use]
    pub fn is_of(&self, time: Real) -> bool {
        (self.time - time).abs() < Self::SAME_TIME
    }

    /// Whether `other` is of the same time and of surfaces that this one lacks.
    #[must_use]
    pub fn can_take(&self, other: &Self) -> bool {
        let both = |a: &Option<PathBuf>, b: &Option<PathBuf>| a.is_some() && b.is_some();
        self.is_of(other.time) && !both(&self.bed, &other.bed) && !both(&self.water, &other.water)
    }

    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if self.bed.is_none() && self.water.is_none() {
            cx.report
                .error(table.span(), "nothing was measured at this time")
                .label("it names no file")
                .help("name the file of a surface, `bed` or `water`");
            return;
        }
        let until = cx.known.run.until;
        if self.time > until {
            cx.report
                .warning(Some(table.place("time")), "these profiles were measured after the end of the run")
                .label(format!("the run ends at {} s", rounded(until)));
        }
        for (file, key) in [(&self.bed, "bed"), (&self.water, "water")] {
            if let Some(file) = file {
                self.check_file(file, table.place(key), cx);
            }
        }
    }

    fn check_file(&self, file: &std::path::Path, place: Range<usize>, cx: &mut Context<'_>) {
        let frame = cx.known.frame.as_ref();
        // A tank of which the case knows only how it is accelerated may be anywhere.
        let is_lost = frame.is_some_and(|frame| frame.oscillation.is_some() || frame.acceleration != Vector::ZERO);
        let motion = frame.and_then(|frame| frame.motion.as_ref());
        let displaced = motion.map_or(Vector::ZERO, |motion| motion.at(self.time)[0]);
        match MeasuredProfile::read_if_there(file) {
            Ok(Some(profile)) if profile.is_of_laboratory() && is_lost => {
                cx.report
                    .error(place, "a profile measured from the laboratory cannot be brought into this tank")
                    .label("the case gives the acceleration of the tank, not its place")
                    .help("give the profile in the coordinates of the tank, or the tank a `[frame.motion]`");
            }
            Ok(Some(profile)) => check_extent(&profile.in_tank([displaced.x, displaced.z]), place, cx),
            Ok(None) => {
                cx.report
                    .warning(Some(place), format!("there is no file `{}`", file.display()))
                    .label("nothing is compared with it");
            }
            Err(problem) => {
                cx.report
                    .error(place, "the measured profile cannot be read")
                    .label(problem.to_string())
                    .help("a CSV file with a line `x_m,z_m` and a row of numbers for each place, places increasing");
            }
        }
    }
}

/// A profile lies within the tank, but for pixels and shakes of the camera: a fiftieth of it.
fn check_extent(profile: &MeasuredProfile, place: Range<usize>, cx: &mut Context<'_>) {
    let domain = cx.known.domain;
    for d in [0, 2] {
        let along = profile.points.iter().map(|point| point[d.min(1)]);
        let [low, high] = [along.clone().fold(Real::INFINITY, Real::min), along.fold(Real::MIN, Real::max)];
        let [lower, upper] = [domain.lower[d], domain.upper[d]];
        let beyond = 0.02 * (upper - lower);
        if low >= lower - beyond && high <= upper + beyond {
            continue;
        }
        cx.report
            .error(place.clone(), format!("the measured profile reaches out of the tank along x{}", d + 1))
            .label(format!(
                "it reaches from {:.1} to {:.1} mm, the tank from {:.1} to {:.1} mm",
                1e3 * low,
                1e3 * high,
                1e3 * lower,
                1e3 * upper
            ))
            .help("columns are in metres in the coordinates of the tank: check the origin and the size of a pixel");
    }
}
