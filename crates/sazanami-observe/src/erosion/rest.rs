//! Whether a crater has come to rest, by the course of its volume.

use sazanami_numerics::Real;

use super::Erosion;

/// A volume of a crater against time, in the order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeCourse {
    times: Vec<Real>,
    volumes: Vec<Real>,
}

/// Part of the course for which a crater at rest has kept its volume, at least.
const LEAST_PART: Real = 0.1;
/// Fewest instants in that time.
const LEAST_INSTANTS: usize = 8;
/// Change of the mean volume from the first to the second half of that time, over the uncertainty, up to which the crater
/// rests. One that grows evenly through the whole uncertainty has a half.
const LARGEST_DRIFT: Real = 0.25;

/// Part of the course for which a crater that drifted when it came within its uncertainty has to have kept its volume since.
const LATE_PART: Real = 0.25;

/// Change of the volume below the rim that counts as none, over that volume, where it is known better.
const KEPT: Real = 0.03;

/// Why nothing is known of a crater's rest.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RestError {
    /// The course is not known: a rest is judged by several instants.
    #[error("the course of V before is not known")]
    Unknown,
    /// There was no crater to come to rest.
    #[error("no crater has formed: its volume has stayed within its uncertainty of {:.2} mm^3 about zero", 1e9 * .uncertainty)]
    NoCrater {
        /// Of the last volume [m^3].
        uncertainty: Real,
    },
    /// The crater has kept its volume long enough, but in too few instants to tell.
    #[error(
        "its volume has kept within its uncertainty since {:.4} ms, in {instants} rows of the series, and rest is judged \
         by {} or more: write them more often (`output.series`)",
        1e3 * .since,
        LEAST_INSTANTS
    )]
    TooFew {
        /// Time from which it has \[s].
        since: Real,
        /// Instants since then.
        instants: usize,
    },
}

/// When a crater came to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// Time from which the volume stays within its uncertainty of the last one \[s].
    pub since: Real,
    /// Mean volume over the second half of the time since then less that over the first half [m^3]; where that half is a quarter of the course and
    /// more, by its own two halves, as even growth would go on.
    pub drift: Real,
    /// Whether the crater rests: `since` lies at least a tenth of the course before its end, and `drift` is at most a quarter of the uncertainty.
    pub at_rest: bool,
}

impl VolumeCourse {
    /// A course from its times \[s] and volumes [m^3] in turns.
    #[must_use]
    pub fn from_pairs(pairs: &[Real]) -> Self {
        let mut course = Self::default();
        pairs.chunks_exact(2).for_each(|pair| course.add(pair[0], pair[1]));
        course
    }

    /// Times \[s] and volumes [m^3] in turns.
    #[must_use]
    pub fn pairs(&self) -> Vec<Real> {
        self.times.iter().zip(&self.volumes).flat_map(|(&time, &volume)| [time, volume]).collect()
    }

    /// Adds a volume [m^3] at a `time` \[s] after all others; an earlier one is left out.
    pub fn add(&mut self, time: Real, volume: Real) {
        if self.times.last().is_none_or(|&last| time > last) {
            self.times.push(time);
            self.volumes.push(volume);
        }
    }

    /// The last time \[s] and volume [m^3] of a crater whose volume was once larger than its `uncertainty` [m^3].
    fn last_of_crater(&self, uncertainty: Real) -> Result<[Real; 2], RestError> {
        let (&[.., end], &[_, .., volume]) = (&self.times[..], &self.volumes[..]) else {
            return Err(RestError::Unknown);
        };
        if self.volumes.iter().all(|volume| volume.abs() <= uncertainty) {
            return Err(RestError::NoCrater { uncertainty });
        }
        Ok([end, volume])
    }

    /// When the crater came to rest whose last volume is uncertain by `uncertainty` [m^3].
    ///
    /// # Errors
    /// If the course is one instant long at most, there never was a crater, or one that seems to rest has done so for fewer than eight instants.
    pub fn rest(&self, uncertainty: Real) -> Result<Rest, RestError> {
        let [end, volume] = self.last_of_crater(uncertainty)?;
        let away = self.volumes.iter().rposition(|v| (v - volume).abs() > uncertainty);
        let first = away.map_or(0, |n| n + 1);
        let since = self.times[first];
        let middle = 0.5 * (since + end);
        let course = end - self.times[0];
        let drift_from = |from: Real, to: Real| self.mean(to, end) - self.mean(from, to);
        let drift = if end - middle < LATE_PART * course {
            drift_from(since, middle)
        } else {
            2.0 * drift_from(middle, 0.5 * (middle + end))
        };
        let at_rest = end - since >= LEAST_PART * course && drift.abs() <= LARGEST_DRIFT * uncertainty;
        let instants = self.times.len() - first;
        if at_rest && instants < LEAST_INSTANTS {
            return Err(RestError::TooFew { since, instants });
        }
        Ok(Rest { since, drift, at_rest })
    }

    /// Mean volume between two times, linear between instants [m^3].
    fn mean(&self, from: Real, to: Real) -> Real {
        let (mut sum, mut length) = (0.0, 0.0);
        for (t, v) in self.times.windows(2).zip(self.volumes.windows(2)) {
            let (a, b) = (t[0].max(from), t[1].min(to));
            if b > a {
                let at = |time: Real| v[0] + (v[1] - v[0]) * (time - t[0]) / (t[1] - t[0]);
                sum += 0.5 * (at(a) + at(b)) * (b - a);
                length += b - a;
            }
        }
        if length > 0.0 { sum / length } else { self.volumes.last().copied().unwrap_or_default() }
    }
}

/// The volumes of a crater against time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CraterCourse {
    /// V of eq. (14).
    pub cap: VolumeCourse,
    /// The volume below the plane of the rim.
    pub below_rim: VolumeCourse,
}

impl CraterCourse {
    /// Adds the two volumes [m^3] at a `time` \[s] after all others; earlier ones are left out.
    pub fn add(&mut self, time: Real, [cap, below_rim]: [Real; 2]) {
        self.cap.add(time, cap);
        self.below_rim.add(time, below_rim);
    }

    /// When the crater came to rest that is evaluated now, by the volume below its rim, which a grain on the rim hardly changes, within
    /// its uncertainty or 3 % of it, whichever is larger.
    ///
    /// # Errors
    /// As [`VolumeCourse::rest`]; whether there was a crater is told by V from the roughness of a bed.
    pub fn rest(&self, now: &Erosion) -> Result<Rest, RestError> {
        self.cap.last_of_crater(now.volume_uncertainty())?;
        self.below_rim.rest(now.below_rim_uncertainty().max(KEPT * now.crater.volume_direct))
    }

    /// Whether the crater that is evaluated now has rested for `span` \[s], its volume below the rim within 3 %.
    #[must_use]
    pub fn has_kept(&self, now: &Erosion, span: Real) -> bool {
        let rested = |rest: Result<Rest, RestError>| rest.is_ok_and(|rest| rest.at_rest);
        let end = self.below_rim.times.last().copied().unwrap_or_default();
        let kept = self.below_rim.rest(KEPT * now.crater.volume_direct);
        rested(self.rest(now)) && rested(kept) && kept.is_ok_and(|rest| end - rest.since >= span * (1.0 - 1e-9))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::erosion::tests::evaluate_cap;

    fn course(volume: impl Fn(Real) -> Real) -> VolumeCourse {
        let mut course = VolumeCourse::default();
        (0..=200).for_each(|n| course.add(1e-3 * Real::from(n), volume(1e-3 * Real::from(n))));
        course
    }

    /// Grows to 1 with a time constant of 10 ms, rough by 2 %.
    fn settling(time: Real) -> Real {
        1.0 - (-time / 0.01).exp() + 0.02 * (9e4 * time).sin()
    }

    #[test]
    fn a_crater_that_has_settled_is_at_rest_since_it_entered_the_uncertainty() {
        let rest = course(settling).rest(0.1).expect("there are volumes");
        // exp(-t/10 ms) = 0.1 at 23 ms; the roughness moves that by some milliseconds.
        assert!(rest.at_rest && (0.020..0.028).contains(&rest.since), "{rest:?}");
        assert!(rest.drift.abs() < 0.025);
    }

    #[test]
    fn a_crater_that_still_grows_is_not_at_rest_however_slowly() {
        // Control: even growth, through more, as much and half as much as the uncertainty in the whole course.
        for growth in [10.0, 1.0, 0.6] {
            let rest = course(|time| 1.0 + 0.1 * growth * time / 0.2).rest(0.1).expect("there are volumes");
            assert!(!rest.at_rest && rest.drift > 0.025, "{growth}: {rest:?}");
        }
        // One that settles with the length of the course as its time constant.
        assert!(!course(|time| 1.0 - (-time / 0.2).exp()).rest(0.1).expect("there are volumes").at_rest);
    }

    #[test]
    fn a_crater_that_drifted_at_first_rests_once_it_has_kept_its_volume() {
        // From 40 ms on within the uncertainty, until 100 ms on its way through most of it.
        let crept = |until: Real| {
            let mut course = VolumeCourse::default();
            let volume =
                |time: Real| if time < 0.04 { 2.0 } else { 1.0 + 0.09 * (1.0 - (time - 0.04) / 0.06).max(0.0) };
            (0..=200)
                .map(|n| 1e-3 * Real::from(n))
                .filter(|&time| time <= until)
                .for_each(|time| course.add(time, volume(time)));
            course.rest(0.1).expect("there are volumes")
        };
        assert!(crept(0.2).at_rest && (crept(0.2).since - 0.04).abs() < 1.5e-3, "{:?}", crept(0.2));
        // Negative control: while it creeps.
        assert!(!crept(0.09).at_rest, "{:?}", crept(0.09));
    }

    #[test]
    fn a_sudden_slide_before_the_end_is_not_rest() {
        let slid = course(|time| if time < 0.19 { 1.0 } else { 1.5 });
        let rest = slid.rest(0.1).expect("there are volumes");
        assert!(!rest.at_rest && rest.since > 0.189, "{rest:?}");
    }

    #[test]
    fn a_crater_that_never_formed_is_not_at_rest() {
        let nothing = course(|time| 0.05 * (9e4 * time).sin());
        assert_eq!(nothing.rest(0.1), Err(RestError::NoCrater { uncertainty: 0.1 }));
        // Controls: one that is known better, and one that was filled up again.
        assert!(nothing.rest(0.01).is_ok());
        let filled = course(|time| if time < 0.05 { 1.0 } else { 0.0 });
        assert!(filled.rest(0.1).is_ok_and(|rest| rest.at_rest && rest.since >= 0.05));
    }

    #[test]
    fn the_volume_below_the_rim_decides_whether_a_crater_rests() {
        let bed = |time: Real, uncertainty: Real| {
            let (mut erosion, _) = evaluate_cap(6.0e-3, 2.1e-3, 0.2);
            let [cap, below] = [erosion.crater.volume, erosion.crater.volume_direct];
            erosion.below_rim_range = [(1.0 - uncertainty) * below, (1.0 + uncertainty) * below];
            let mut course = CraterCourse::default();
            for n in 0..=200 {
                let late = 1e-3 * Real::from(n) >= time;
                course.add(
                    1e-3 * Real::from(n),
                    [if n % 2 == 0 { 0.9 } else { 1.1 } * cap, if late { below } else { 1.1 * below }],
                );
            }
            (course.rest(&erosion).expect("there is a crater"), course.has_kept(&erosion, 10e-3))
        };
        assert!(bed(0.1, 0.01).0.at_rest && (bed(0.1, 0.01).0.since - 0.1).abs() < 1e-12);
        // Control: a slide before the end.
        assert!(!bed(0.195, 0.01).0.at_rest);
        // However uncertain the volume is, a run goes on until it has kept within 3 %.
        assert!(bed(0.02, 0.2).1 && bed(0.1, 0.01).1);
        assert!(bed(0.195, 0.2).0.at_rest && !bed(0.195, 0.2).1);
    }

    #[test]
    fn few_instants_say_nothing() {
        let mut short = VolumeCourse::default();
        for n in 0..2 {
            // A checkpoint without the course before has one instant.
            assert_eq!(short.rest(0.5), Err(RestError::Unknown));
            short.add(Real::from(n), 1.0);
        }
        (2..7).for_each(|n| short.add(Real::from(n), 1.0));
        assert_eq!(short.rest(0.5), Err(RestError::TooFew { since: 0.0, instants: 7 }));
        short.add(7.0, 1.0);
        assert_eq!(short.rest(0.5), Ok(Rest { since: 0.0, drift: 0.0, at_rest: true }));
        short.add(6.5, 9.0);
        assert_eq!(VolumeCourse::from_pairs(&short.pairs()), short);
    }

    #[test]
    fn too_few_instants_of_a_crater_that_keeps_are_no_unrest() {
        let of = |volumes: &[Real]| {
            let mut course = VolumeCourse::default();
            (0..).zip(volumes).for_each(|(n, &volume)| course.add(1e-3 * Real::from(n), volume));
            course
        };
        let too_few = |since: Real, instants: usize| Err(RestError::TooFew { since, instants });
        assert_eq!(of(&[1.0; 5]).rest(0.1), too_few(0.0, 5));
        assert!(of(&[1.0; 9]).rest(0.1).is_ok_and(|rest| rest.at_rest));
        let told = of(&[1.0; 5]).rest(0.1).unwrap_err().to_string();
        assert!(told.contains("since 0.0000 ms, in 5 rows of the series, and rest is judged by 8 or more"), "{told}");
        // Three of nine, for a quarter of the course: not at rest as far as is known.
        let formed = [&[2.0; 6][..], &[1.0; 3]].concat();
        assert_eq!(of(&formed).rest(0.1), too_few(6e-3, 3));
        // Negative controls: that still changes, in as few instants: within its uncertainty, at once, and for too short a time.
        for volumes in [&[1.0, 1.02, 1.04, 1.06, 1.08][..], &[2.0, 2.0, 2.0, 2.0, 1.0], &[2.0, 1.8, 1.6, 1.4, 1.2]] {
            assert!(of(volumes).rest(0.1).is_ok_and(|rest| !rest.at_rest), "{volumes:?}");
        }
        let mut late = of(&[2.0; 6]);
        (0..3).for_each(|n| late.add(0.1 + 1e-3 * Real::from(n), 1.0));
        assert!(late.rest(0.1).is_ok_and(|rest| !rest.at_rest), "{:?}", late.rest(0.1));
    }

    #[test]
    fn a_wandering_cap_with_too_few_instants_holds_up_no_rest() {
        let (mut erosion, _) = evaluate_cap(6.0e-3, 2.1e-3, 0.2);
        let [cap, below] = [erosion.crater.volume, erosion.crater.volume_direct];
        erosion.below_rim_range = [0.99 * below, 1.01 * below];
        erosion.volume_range = [0.9 * cap, 1.1 * cap];
        let mut course = CraterCourse::default();
        // A grain on the rim, which V hangs on, has lain still for three rows.
        for n in 0..12 {
            course.add(1e-3 * Real::from(n), [if n < 9 { 2.0 } else { 1.0 } * cap, below]);
        }
        assert!(matches!(course.cap.rest(erosion.volume_uncertainty()), Err(RestError::TooFew { instants: 3, .. })));
        assert!(course.rest(&erosion).is_ok_and(|rest| rest.at_rest) && course.has_kept(&erosion, 10e-3));
        // Negative control: of few rows the volume below the rim says nothing either, and no run ends by it.
        let mut short = CraterCourse::default();
        (0..7).for_each(|n| short.add(2e-3 * Real::from(n), [cap, below]));
        assert!(matches!(short.rest(&erosion), Err(RestError::TooFew { instants: 7, .. })));
        assert!(!short.has_kept(&erosion, 10e-3));
    }
}
