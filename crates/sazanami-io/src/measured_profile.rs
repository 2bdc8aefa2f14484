//! Profiles of bed or water read from photographs of an experiment.

use std::path::Path;

use crate::readings::{Readings, ReadingsError, Trouble};

const COLUMNS: [&str; 2] = ["x_m", "z_m"];
const LEAST_ROWS: usize = 3;
/// Declaration of `frame` for a profile seen from the laboratory.
const LABORATORY: &str = "laboratory";

/// A profile read from an experiment: a file with the columns `x_m,z_m` and comments `# key: value` (see
/// [`crate::readings`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredProfile {
    /// Origin as the file declares it (`source`).
    pub source: Option<String>,
    /// Frame of the film, or frame of reference, in the words of whoever read it (`frame`). Places are those in the
    /// tank unless it is `laboratory`.
    pub frame: Option<String>,
    /// Origin that the reading was made with, as declared (`x0`, `z0`). For the record: nothing is added to the points.
    pub origin: [Option<f64>; 2],
    /// Width of a pixel (`pixel_size_m`) \[m].
    pub pixel_size: Option<f64>,
    /// Uncertainty of the instant within the cycle (`phase_uncertainty_s`) \[s].
    pub phase_uncertainty: Option<f64>,
    /// Largest shift in x1 to either side within which the origin is known (`x_shift_limit_m`) \[m]; without it the
    /// profile is not to be moved.
    pub x_shift_limit: Option<f64>,
    /// The same in x3 (`z_shift_limit_m`) \[m].
    pub z_shift_limit: Option<f64>,
    /// Points `(x1, x3)` in the order of x1 \[m].
    pub points: Vec<[f64; 2]>,
}

impl MeasuredProfile {
    /// Reads a profile, or nothing if there is no such file.
    ///
    /// # Errors
    /// If the file cannot be read, lacks a column, has fewer than three rows or rows out of order, or holds or declares
    /// something that is not a number where one is expected.
    pub fn read_if_there(path: &Path) -> Result<Option<Self>, ReadingsError> {
        Readings::read_if_there(path, &COLUMNS, LEAST_ROWS)?.map(|readings| Self::of(&readings)).transpose()
    }

    /// Whether its places are those in the laboratory, where the tank moves.
    #[must_use]
    pub fn is_of_laboratory(&self) -> bool {
        self.frame.as_ref().is_some_and(|frame| frame.trim().eq_ignore_ascii_case(LABORATORY))
    }

    /// The profile in the tank, which stands `displaced` along x1 and x3 \[m] from where both frames are the same.
    #[must_use]
    pub fn in_tank(mut self, displaced: [f64; 2]) -> Self {
        if self.is_of_laboratory() {
            self.points.iter_mut().for_each(|[x, z]| (*x, *z) = (*x - displaced[0], *z - displaced[1]));
            self.frame = None;
        }
        self
    }

    fn of(readings: &Readings) -> Result<Self, ReadingsError> {
        let text = |key: &str| readings.declared(key).map(str::to_owned);
        let positive = |key: &str| {
            let found = readings.declared_number(key)?;
            match found.filter(|value| *value < 0.0) {
                Some(found) => Err(readings.wrong(key, Trouble::Negative { key: key.to_owned(), found })),
                None => Ok(found),
            }
        };
        Ok(Self {
            source: text("source"),
            frame: text("frame"),
            origin: [readings.declared_number("x0")?, readings.declared_number("z0")?],
            pixel_size: positive("pixel_size_m")?,
            phase_uncertainty: positive("phase_uncertainty_s")?,
            x_shift_limit: positive("x_shift_limit_m")?,
            z_shift_limit: positive("z_shift_limit_m")?,
            points: readings.points(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "\
# source: figure 2, read by hand
# frame: tank
# x0: 0
# z0: 0.0
# pixel_size_m: 2e-4
# phase_uncertainty_s: 0.02
# x_shift_limit_m: 5e-3
x_m,z_m
-0.05,0.011
0.00,0.009
0.05,0.010
";

    fn read(text: &str) -> Result<MeasuredProfile, ReadingsError> {
        MeasuredProfile::of(&Readings::parse(Path::new("exp_bed_t3.0.csv"), text.as_bytes(), &COLUMNS, LEAST_ROWS)?)
    }

    #[test]
    fn what_the_header_declares_is_kept() {
        let profile = read(FILE).expect("a good file");
        assert_eq!(profile.source.as_deref(), Some("figure 2, read by hand"));
        assert_eq!((profile.origin, profile.pixel_size), ([Some(0.0); 2], Some(2e-4)));
        assert_eq!((profile.x_shift_limit, profile.z_shift_limit), (Some(5e-3), None));
        assert_eq!(profile.points.len(), 3);
        let bare = read("x_m,z_m\n0,1\n1,1\n2,1\n").expect("a good file");
        assert_eq!(bare, MeasuredProfile { points: vec![[0.0, 1.0], [1.0, 1.0], [2.0, 1.0]], ..Default::default() });
    }

    #[test]
    fn places_in_the_laboratory_are_brought_into_the_tank() {
        let inside = read(FILE).expect("a good file");
        assert_eq!(inside.clone().in_tank([1e-3, 0.0]), inside);
        let seen = read(&FILE.replace("frame: tank", "frame: Laboratory")).expect("a good file");
        let moved = seen.in_tank([0.01, -0.001]).in_tank([0.01, -0.001]);
        assert!((moved.points[1][0] + 0.01).abs() < 1e-15 && (moved.points[1][1] - 0.010).abs() < 1e-15, "{moved:?}");
    }

    #[test]
    fn a_negative_limit_is_refused() {
        let problem = read(&FILE.replace("5e-3", "-5e-3")).expect_err("it is negative").to_string();
        assert_eq!(problem, "exp_bed_t3.0.csv, line 7: x_shift_limit_m is -0.005; expected zero or more");
        let word = read(&FILE.replace("0.02\n", "short\n")).expect_err("it is a word").to_string();
        assert!(word.starts_with("exp_bed_t3.0.csv, line 6: `short` for phase_uncertainty_s"), "{word}");
    }

    #[test]
    fn absent_profiles_are_skipped() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(MeasuredProfile::read_if_there(&folder.path().join("exp_bed_t7.0.csv")).expect("no error"), None);
    }
}
