//! Surfaces of a run against those that were measured in an experiment.

use std::path::Path;

use sazanami_io::MeasuredProfile;
use sazanami_numerics::Real;
use sazanami_observe::ripples::{BedMatch, ProfileMatch, ShiftLimits, match_bed, match_profiles};
use serde_json::{Value, json};

use super::tables::{Profiles, RunTables};
use crate::case::meaning::Measured;
use crate::recorder::{closed, form_settings, tank_of};

/// A surface of a run held against a measured one.
pub(super) struct Compared {
    /// Time at which it was measured \[s].
    time: Real,
    /// The surface: bed or water.
    surface: &'static str,
    /// Match with the measured surface, or why there is none.
    found: Result<Match, String>,
}

enum Match {
    Bed(Box<BedMatch>),
    Water(ProfileMatch),
}

impl Match {
    fn profiles(&self) -> &ProfileMatch {
        match self {
            Self::Bed(bed) => &bed.profiles,
            Self::Water(water) => water,
        }
    }

    fn text(&self) -> String {
        let profiles = self.profiles();
        let (rmse, correlation) = (1e3 * profiles.rmse, two_digits(profiles.correlation));
        let measures = match self {
            Self::Bed(bed) => format!(
                "rmse {rmse:.2} mm ({} of the height), correlation {correlation}, height ratio {}, \
                 wavelength ratio {}, crests that agree {}",
                two_digits(bed.relative_rmse()),
                two_digits(bed.ratio(|ripples| ripples.height)),
                two_digits(bed.ratio(|ripples| ripples.wavelength)),
                two_digits(bed.crests_agree)
            ),
            Self::Water(water) => format!(
                "rmse {rmse:.2} mm, correlation {correlation}, wave height ratio {}",
                two_digits(water.extent_ratio())
            ),
        };
        format!(
            "{measures}, mean {:+.2} mm off, moved by {:.1} and {:.1} mm",
            1e3 * profiles.offset,
            1e3 * profiles.shift_x,
            1e3 * profiles.shift_z
        )
    }

    /// A warning if the measured profile was moved as far as it may be.
    fn warning(&self) -> Option<String> {
        let axes = match self.profiles().at_limit {
            [false, false] => return None,
            [true, false] => "x1",
            [false, true] => "x3",
            [true, true] => "x1 and x3",
        };
        Some(format!("moved along {axes} as far as allowed: a better place may lie beyond, check the origin"))
    }

    /// Measures in the form of the summary.
    fn json(&self) -> Value {
        let profiles = self.profiles();
        let mut json = json!({
            "rmse_mm": 1e3 * profiles.rmse,
            "correlation": profiles.correlation,
            "mean_offset_mm": 1e3 * profiles.offset,
            "shift_x_mm": 1e3 * profiles.shift_x,
            "shift_z_mm": 1e3 * profiles.shift_z,
            "shift_at_limit": profiles.at_limit,
        });
        match self {
            Self::Bed(bed) => {
                json["rmse_over_height"] = json!(bed.relative_rmse());
                json["height_ratio"] = json!(bed.ratio(|ripples| ripples.height));
                json["wavelength_ratio"] = json!(bed.ratio(|ripples| ripples.wavelength));
                json["crests_agree"] = json!(bed.crests_agree);
            }
            Self::Water(water) => json["wave_height_ratio"] = json!(water.extent_ratio()),
        }
        json
    }
}

fn two_digits(value: Option<Real>) -> String {
    value.map_or("none".into(), |value| format!("{value:.2}"))
}

impl Compared {
    /// Label and value for people, and a warning where there is one.
    pub fn rows(&self) -> Vec<(String, String)> {
        let label = format!("{} against experiment, t = {} s", self.surface, self.time);
        match &self.found {
            Ok(found) => {
                let warning = found.warning().map(|warning| ("  warning".to_owned(), warning));
                std::iter::once((label, found.text())).chain(warning).collect()
            }
            Err(problem) => vec![(label, problem.clone())],
        }
    }

    /// The same in the form of the summary.
    pub fn json(&self) -> Value {
        let mut json = match &self.found {
            Ok(found) => found.json(),
            Err(problem) => json!({ "not_compared": problem }),
        };
        json["time_s"] = json!(self.time);
        json["surface"] = json!(self.surface);
        json
    }
}

/// Everything that was measured against the run.
pub(super) fn compared(tables: &RunTables) -> Vec<Compared> {
    tables.case.ripples.iter().flat_map(|ripples| &ripples.measured).flat_map(|at| of_time(tables, at)).collect()
}

fn of_time(tables: &RunTables, measured: &Measured) -> Vec<Compared> {
    let time = measured.time;
    let one = |surface, found| Compared { time, surface, found };
    let mut all = Vec::new();
    if let Some(file) = &measured.bed {
        all.push(one("bed", of_bed(tables, &read(tables, file, time), time)));
    }
    if let Some(file) = &measured.water {
        all.push(one("water", of_water(tables, &read(tables, file, time), time)));
    }
    all
}

/// Reads a measured profile, or says why it is not there.
fn read(tables: &RunTables, file: &Path, time: Real) -> Result<MeasuredProfile, String> {
    match tables.case.measured_profile(file, time) {
        Ok(Some(profile)) => Ok(profile),
        Ok(None) => Err(format!("absent: {}", file.display())),
        Err(problem) => Err(problem.to_string()),
    }
}

fn of_bed(tables: &RunTables, measured: &Result<MeasuredProfile, String>, time: Real) -> Result<Match, String> {
    let measured = measured.as_ref().map_err(Clone::clone)?;
    let own = tables.bed.as_ref().zip(tables.case.ripples.as_ref()).zip(form_settings(&tables.case));
    let ((own, how), settings) = own.ok_or("the run has no table of its bed")?;
    let run = closed(how, &tank_of(&tables.case), own.reached(time).ok_or_else(|| not_reached(own))?);
    let found = match_bed(&run, &measured.points, limits(measured), &settings);
    found.map(|found| Match::Bed(Box::new(found))).map_err(|problem| format!("not compared: {problem}"))
}

fn of_water(tables: &RunTables, measured: &Result<MeasuredProfile, String>, time: Real) -> Result<Match, String> {
    let measured = measured.as_ref().map_err(Clone::clone)?;
    let own = tables.water.as_ref().ok_or("the run has no table of its water")?;
    let run = own.reached(time).ok_or_else(|| not_reached(own))?;
    let found = match_profiles(run, &measured.points, limits(measured));
    found.map(Match::Water).map_err(|problem| format!("not compared: {problem}"))
}

fn not_reached(own: &Profiles) -> String {
    format!("not compared: the table of the run ends at {} s", own.end())
}

/// Limits on the displacement of a profile \[m], as its header declares; 0 without a declaration.
fn limits(measured: &MeasuredProfile) -> ShiftLimits {
    ShiftLimits { x: measured.x_shift_limit.unwrap_or(0.0), z: measured.z_shift_limit.unwrap_or(0.0) }
}
