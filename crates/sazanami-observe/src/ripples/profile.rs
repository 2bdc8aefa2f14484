//! A surface seen from the side: height against x1.

use sazanami_numerics::Real;

use super::Unmeasured;

/// Heights at evenly spaced places on x1, averaged or seen across the tank.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceProfile {
    /// First place \[m].
    pub start: Real,
    /// Distance of the places \[m].
    pub spacing: Real,
    /// Heights \[m]; `None` where there is no surface.
    pub heights: Vec<Option<Real>>,
}

impl SurfaceProfile {
    /// A profile without gaps.
    #[must_use]
    pub fn complete(start: Real, spacing: Real, heights: impl IntoIterator<Item = Real>) -> Self {
        Self { start, spacing, heights: heights.into_iter().map(Some).collect() }
    }

    /// Heights at the middles of `count` equal parts of `range` \[m].
    pub(super) fn of_parts(range: [Real; 2], count: usize, height: impl FnMut(usize) -> Option<Real>) -> Self {
        let spacing = (range[1] - range[0]) / count as Real;
        Self { start: range[0] + 0.5 * spacing, spacing, heights: (0..count).map(height).collect() }
    }

    /// Number of places.
    #[must_use]
    pub fn len(&self) -> usize {
        self.heights.len()
    }

    /// Whether there are no places.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.heights.is_empty()
    }

    /// A place \[m].
    #[must_use]
    pub fn x(&self, number: usize) -> Real {
        self.start + number as Real * self.spacing
    }

    /// First and last place \[m]; the same where there is only one.
    #[must_use]
    pub fn range(&self) -> [Real; 2] {
        [self.start, self.x(self.len().saturating_sub(1))]
    }

    /// The places that have a height, with it \[m].
    pub fn points(&self) -> impl Iterator<Item = [Real; 2]> + '_ {
        self.heights.iter().enumerate().filter_map(|(n, z)| z.map(|z| [self.x(n), z]))
    }

    /// All places with their heights \[m], NaN where there is none: as pictures leave gaps.
    pub fn points_with_gaps(&self) -> impl Iterator<Item = [Real; 2]> + '_ {
        self.heights.iter().enumerate().map(|(n, z)| [self.x(n), z.unwrap_or(Real::NAN)])
    }

    /// Height \[m] at `x` \[m], linear between places: a wave gauge on the profile of the water surface. Within half a
    /// spacing beyond the first and last place the height is theirs; farther out, and beside a gap, there is none.
    #[must_use]
    pub fn at(&self, x: Real) -> Option<Real> {
        let place = (x - self.start) / self.spacing;
        let last = self.len().checked_sub(1)? as Real;
        if !(-0.5 - 1e-9..=last + 0.5 + 1e-9).contains(&place) {
            return None;
        }
        let place = place.clamp(0.0, last);
        let (first, part) = (place.floor() as usize, place - place.floor());
        let lower = self.heights[first];
        if part < 1e-9 {
            return lower;
        }
        let upper = self.heights[first + 1]?;
        if part > 1.0 - 1e-9 { Some(upper) } else { lower.map(|lower| lower + (upper - lower) * part) }
    }

    /// The same of a profile that repeats: between its last and its first place it goes on.
    #[must_use]
    pub fn at_repeating(&self, x: Real) -> Option<Real> {
        let count = self.len() as Real;
        let place = ((x - self.start) / self.spacing).rem_euclid(count);
        let ends = [self.heights.last(), self.heights.first()].map(|height| height.copied().flatten());
        match (place > count - 1.0, ends) {
            (false, _) => self.at(self.start + place * self.spacing),
            (true, [Some(last), Some(first)]) => Some(last + (first - last) * (place - (count - 1.0))),
            _ => None,
        }
    }

    /// Median of the heights \[m].
    #[must_use]
    pub fn median(&self) -> Option<Real> {
        median(self.heights.iter().filter_map(|&z| z).collect())
    }

    /// Mean of the heights \[m] there are.
    #[must_use]
    pub fn mean(&self) -> Option<Real> {
        let count = self.heights.iter().flatten().count();
        (count > 0).then(|| self.heights.iter().flatten().sum::<Real>() / count as Real)
    }

    /// Highest minus lowest height \[m].
    #[must_use]
    pub fn extent(&self) -> Option<Real> {
        let heights = || self.heights.iter().filter_map(|&z| z);
        Some(heights().reduce(Real::max)? - heights().reduce(Real::min)?)
    }

    /// The same with gaps of up to `longest` \[m] between two heights closed by straight lines.
    #[must_use]
    pub fn with_gaps_closed(&self, longest: Real) -> Self {
        let mut closed = self.clone();
        let present: Vec<(usize, Real)> =
            self.heights.iter().enumerate().filter_map(|(n, z)| z.map(|z| (n, z))).collect();
        for ends in present.windows(2) {
            let [(first, low), (last, high)] = [ends[0], ends[1]];
            let width = (last - first) as Real;
            if (width - 1.0) * self.spacing <= longest * (1.0 + 1e-9) {
                for n in first + 1..last {
                    closed.heights[n] = Some(low + (high - low) * (n - first) as Real / width);
                }
            }
        }
        closed
    }

    /// The same of a profile that repeats: gaps at its seam are closed too.
    #[must_use]
    pub fn with_gaps_closed_around(&self, longest: Real) -> Self {
        let count = self.len();
        let three = Self { heights: self.heights.repeat(3), ..self.clone() }.with_gaps_closed(longest);
        Self { heights: three.heights[count..2 * count].to_vec(), ..self.clone() }
    }

    /// The heights every `spacing` \[m] from one end of `range` \[m] on, by [`Self::at`].
    #[must_use]
    pub fn resampled(&self, range: [Real; 2], spacing: Real) -> Self {
        let steps = ((range[1] - range[0]) / spacing + 1e-9).floor();
        let count = if steps >= 0.0 { steps as usize + 1 } else { 0 };
        let heights = (0..count).map(|n| self.at(range[0] + n as Real * spacing)).collect();
        Self { start: range[0], spacing, heights }
    }

    /// The part within `range` \[m].
    #[must_use]
    pub fn within(&self, range: [Real; 2]) -> Self {
        let slack = 1e-9 * self.spacing;
        let inside = |n: &usize| self.x(*n) >= range[0] - slack && self.x(*n) <= range[1] + slack;
        let first = (0..self.len()).find(inside).unwrap_or(0);
        let heights = (0..self.len()).filter(inside).map(|n| self.heights[n]).collect();
        Self { start: self.x(first), spacing: self.spacing, heights }
    }

    /// The heights \[m], all of them.
    ///
    /// # Errors
    /// [`Unmeasured::Gap`] where there is none.
    pub fn whole(&self) -> Result<Vec<Real>, Unmeasured> {
        let height = |(n, z): (usize, &Option<Real>)| z.ok_or(Unmeasured::Gap { at: self.x(n) });
        self.heights.iter().enumerate().map(height).collect()
    }
}

/// Median; the mean of the two middle ones of an even number.
pub(super) fn median(mut values: Vec<Real>) -> Option<Real> {
    values.sort_by(Real::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        count if count % 2 == 1 => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_gap() -> SurfaceProfile {
        SurfaceProfile { start: 1.0, spacing: 0.5, heights: vec![Some(2.0), Some(3.0), None, None, Some(6.0)] }
    }

    #[test]
    fn a_gauge_reads_between_places_and_not_beyond_them() {
        let profile = with_gap();
        assert_eq!(profile.at(1.0), Some(2.0));
        assert_eq!(profile.at(1.25), Some(2.5));
        assert_eq!(profile.at(0.76), Some(2.0));
        assert_eq!((profile.at(0.7), profile.at(3.3), profile.at(1.7)), (None, None, None));
        assert_eq!(profile.at(3.0), Some(6.0));
        assert_eq!((profile.points().count(), profile.points_with_gaps().count()), (3, 5));
        assert!(profile.points_with_gaps().nth(2).is_some_and(|[x, z]| x == 2.0 && z.is_nan()));
        assert_eq!(SurfaceProfile::default().at(0.0), None);
    }

    #[test]
    fn a_gauge_beyond_the_last_place_of_a_profile_that_repeats_reads_on_to_the_first() {
        let profile = SurfaceProfile::complete(0.25, 0.5, [1.0, 2.0, 4.0, 3.0]);
        for (x, height) in
            [(0.25, 1.0), (0.5, 1.5), (1.75, 3.0), (2.0, 2.0), (0.0, 2.0), (2.15, 1.4), (2.5, 1.5), (-0.25, 3.0)]
        {
            let found = profile.at_repeating(x).expect("a height");
            assert!((found - height).abs() < 1e-12, "{x}: {found}");
        }
        // Negative controls: one that does not repeat ends there, and a gap at the seam has no height.
        assert!((profile.at(1.95), profile.at(2.15)) == (Some(3.0), None));
        let gap = SurfaceProfile { heights: vec![Some(1.0), Some(2.0), Some(4.0), None], ..profile };
        assert_eq!((gap.at_repeating(2.0), gap.at_repeating(0.5)), (None, Some(1.5)));
    }

    #[test]
    fn only_short_gaps_are_closed() {
        let profile = with_gap();
        assert_eq!(profile.with_gaps_closed(1.0).whole(), Ok(vec![2.0, 3.0, 4.0, 5.0, 6.0]));
        assert_eq!(profile.with_gaps_closed(0.5).whole(), Err(Unmeasured::Gap { at: 2.0 }));
        assert_eq!(profile.whole(), Err(Unmeasured::Gap { at: 2.0 }));
    }

    #[test]
    fn a_gap_at_the_seam_of_a_profile_that_repeats_is_closed() {
        let of = |heights: [Option<Real>; 4]| SurfaceProfile { start: 0.0, spacing: 0.5, heights: heights.to_vec() };
        let first = of([None, Some(2.0), Some(3.0), Some(4.0)]);
        let last = of([Some(4.0), Some(2.0), Some(3.0), None]);
        assert_eq!(first.with_gaps_closed_around(0.5).whole(), Ok(vec![3.0, 2.0, 3.0, 4.0]));
        assert_eq!(last.with_gaps_closed_around(0.5).whole(), Ok(vec![4.0, 2.0, 3.0, 3.5]));
        // Negative controls: between end walls it stays, and so does a longer one.
        assert_eq!(first.with_gaps_closed(0.5).whole(), Err(Unmeasured::Gap { at: 0.0 }));
        assert!(of([None, Some(2.0), Some(3.0), None]).with_gaps_closed_around(0.5).whole().is_err());
    }

    #[test]
    fn parts_and_new_places_lie_where_they_should() {
        let line = SurfaceProfile::complete(-1.0, 0.25, (0..9).map(|n| 0.25 * Real::from(n)));
        let part = line.within([-0.5, 0.5]);
        assert_eq!((part.start, part.len(), part.heights[0]), (-0.5, 5, Some(0.5)));
        let finer = line.resampled([-0.5, 0.51], 0.1);
        assert_eq!(finer.len(), 11);
        assert!(finer.points().all(|[x, z]| (z - (x + 1.0)).abs() < 1e-12));
        assert_eq!((line.median(), line.mean(), line.extent()), (Some(1.0), Some(1.0), Some(2.0)));
        assert_eq!(line.within([5.0, 6.0]).mean(), None);
        assert_eq!(line.resampled([1.0, 0.0], 0.1).len(), 0);
    }

    #[test]
    fn the_median_of_an_even_number_is_between() {
        assert_eq!((median(vec![]), median(vec![3.0, 1.0]), median(vec![9.0, 1.0, 2.0])), (None, Some(2.0), Some(2.0)));
    }
}
