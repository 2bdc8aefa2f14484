//! The tables that a run with moving particles wrote, read back.

use std::path::Path;

use sazanami_numerics::Real;
use sazanami_observe::ripples::{BedForms, Growth, SurfaceProfile};
use serde_json::Value;

use crate::analyse::summary_file::summary;
use crate::analyse::table::Table;
use crate::case::LoadedCase;
use crate::case::meaning::Case;
use crate::error::CommandError;
use crate::recorder::{form_settings, forms_of, relief_of, tank_of};
use crate::results::{BED_PROFILES, WATER_PROFILES};

/// Part of a step of the series by which times are the same.
const SAME_TIME: Real = 1e-9;
/// Part of a period by which phases are the same: rows of the series need not fall on the ends of periods.
const SAME_PHASE: Real = 0.02;

/// Profiles of a run against time.
pub(super) struct Profiles {
    time: Vec<Real>,
    profile: Vec<SurfaceProfile>,
}

impl Profiles {
    /// The heights of one column of a table with a row for each time and place; `None` without a row.
    fn of(table: &Table, column: &str) -> Option<Self> {
        let (times, places, heights) = (table.column("time"), table.column("x"), table.column(column));
        let mut found = Self { time: Vec::new(), profile: Vec::new() };
        let mut first = 0;
        while first < times.len() {
            let next = times[first..].iter().position(|&time| time != times[first]).map_or(times.len(), |n| first + n);
            let spacing = if next > first + 1 { places[first + 1] - places[first] } else { 1.0 };
            found.time.push(times[first]);
            found.profile.push(SurfaceProfile {
                start: places[first],
                spacing,
                heights: heights[first..next].iter().map(|&z| z.is_finite().then_some(z)).collect(),
            });
            first = next;
        }
        (!found.time.is_empty()).then_some(found)
    }

    /// The profile nearest in time.
    pub(super) fn at(&self, time: Real) -> (Real, &SurfaceProfile) {
        let distance = |n: &usize| (self.time[*n] - time).abs();
        let nearest = (0..self.time.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or_default();
        (self.time[nearest], &self.profile[nearest])
    }

    /// The profile at `time` \[s], no farther from it than rows are from one another there; `None` beyond the rows.
    pub(super) fn reached(&self, time: Real) -> Option<&SurfaceProfile> {
        let (found, profile) = self.at(time);
        let after = self.time.partition_point(|&row| row <= found);
        let before = after.saturating_sub(2);
        let row = |n: usize| self.time[n.min(self.time.len() - 1)];
        let interval = (found - row(before)).max(row(after) - found);
        ((found - time).abs() <= interval + SAME_TIME * time.max(1.0)).then_some(profile)
    }

    /// The profile at the end of the tables.
    pub(super) fn last(&self) -> &SurfaceProfile {
        &self.profile[self.profile.len() - 1]
    }

    /// Time of the last profile \[s].
    pub(super) fn end(&self) -> Real {
        self.time[self.time.len() - 1]
    }
}

/// Ripples by the tables of a run.
pub(super) struct RunTables {
    pub(super) case: Case,
    pub(super) summary: Value,
    pub(super) bed: Option<Profiles>,
    pub(super) water: Option<Profiles>,
    /// Relief at the times of the bed's profiles [s, m].
    pub(super) relief: Vec<(Real, Real)>,
    /// Mound and ripples at the end.
    pub(super) forms: Option<BedForms>,
    /// Period of the tank or the flow \[s], if they swing in cycles.
    pub(super) period: Option<Real>,
}

impl RunTables {
    pub(super) fn read(folder: &Path, loaded: LoadedCase) -> Result<Self, CommandError> {
        let case = loaded.case;
        let [beds, waters] = [BED_PROFILES, WATER_PROFILES].map(|name| Table::read(&folder.join(name)));
        let (beds, waters) = (beds?, waters?);
        let bed = beds.as_ref().and_then(|table| Profiles::of(table, "z_concentration"));
        let water = waters.as_ref().and_then(|table| Profiles::of(table, "z"));
        let mut relief = Vec::new();
        if let (Some(bed), Some(how)) = (&bed, &case.ripples) {
            let (tank, all) = (tank_of(&case), bed.time.iter().zip(&bed.profile));
            relief = all.filter_map(|(&time, profile)| Some((time, relief_of(how, &tank, profile)?))).collect();
        }
        let forms = bed.as_ref().zip(case.ripples.as_ref()).zip(form_settings(&case));
        let forms = forms.map(|((bed, how), settings)| forms_of(how, &tank_of(&case), bed.last(), &settings));
        let period = case.period();
        Ok(Self { case, summary: summary(folder)?, bed, water, relief, forms, period })
    }

    /// Time of the last profiles \[s], if there are any.
    pub(super) fn end(&self) -> Option<Real> {
        let ends = [&self.bed, &self.water].into_iter().flatten().map(Profiles::end);
        ends.reduce(Real::max)
    }

    /// Growth of the relief, and what it is fitted to: ends of whole `periods`, or all `times` where nothing swings.
    pub(super) fn growth(&self) -> Option<(Growth, &'static str)> {
        let per = if self.period.is_some() { "periods" } else { "times" };
        Some((Growth::of(&self.reliefs()).ok()?, per))
    }

    /// Reliefs of the bed at the ends of whole periods, or at all times without a period [s, m].
    fn reliefs(&self) -> Vec<(Real, Real)> {
        match self.period {
            Some(period) => at_whole_periods(self.relief.iter().copied(), period),
            None => self.relief.clone(),
        }
    }
}

/// Of times \[s] and values those at the ends of whole periods \[s], or the nearest to each of them.
fn at_whole_periods(series: impl Iterator<Item = (Real, Real)>, period: Real) -> Vec<(Real, Real)> {
    let end = |time: Real| (time / period).round();
    let distance = |time: Real| (time / period - end(time)).abs();
    let mut found: Vec<(Real, Real)> = Vec::new();
    for (time, value) in series.filter(|&(time, _)| end(time) > 0.0 && distance(time) < SAME_PHASE) {
        match found.last_mut().filter(|last| end(last.0) == end(time)) {
            Some(last) if distance(last.0) <= distance(time) => {}
            Some(last) => *last = (time, value),
            None => found.push((time, value)),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profiles(time: &[Real]) -> Profiles {
        let profile = |_| SurfaceProfile::complete(0.0, 1.0, [0.0; 3]);
        Profiles { time: time.to_vec(), profile: time.iter().map(profile).collect() }
    }

    #[test]
    fn times_beyond_the_rows_are_not_reached() {
        let rows = profiles(&[0.0, 0.1, 0.2, 0.5]);
        let reached = |time: Real| rows.reached(time).is_some();
        assert!(reached(0.0) && reached(0.05) && reached(0.35) && reached(0.5) && reached(0.7));
        assert!(!reached(0.9) && !reached(3.0));
        let one = profiles(&[1.0]);
        assert!(one.reached(1.0).is_some() && one.reached(1.1).is_none());
    }

    #[test]
    fn one_row_stands_for_the_end_of_a_period() {
        let rows = (0..=20).map(|n| (0.1 * Real::from(n), Real::from(n)));
        let ends = |period: Real| at_whole_periods(rows.clone(), period).iter().map(|end| end.1).collect::<Vec<_>>();
        assert_eq!(ends(0.5), [5.0, 10.0, 15.0, 20.0]);
        // A period that no row hits, and rows of which several come near.
        assert_eq!(ends(0.502), [5.0, 10.0, 15.0, 20.0]);
        assert_eq!(ends(0.53), [16.0]);
        let close = (0..=100).map(|n| (0.005 * Real::from(n), Real::from(n)));
        assert_eq!(at_whole_periods(close, 0.499), [(0.5, 100.0)]);
    }
}
