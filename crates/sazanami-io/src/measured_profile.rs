//! Profiles of bed or water read from photographs of an experiment.

use std::path::Path;

use crate::readings::{Readings, ReadingsError, Trouble};

const COLUMNS: [&str; 2] = ["x_m", "z_m"];
const LEAST_ROWS: usize = 3;
/// Declaration of `frame` for a profile seen from the laboratory.
const LABORATORY: &str = "laboratory";

/// A profile read from an experiment: a file with the columns `x_m,z_m` and comments `# key: value` (see
/// [`crate::readings`]). Other comments are for readers of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredProfile {
    /// Frame of the film, or frame of reference, in the words of whoever read it (`frame`). Places are those in the
    /// tank unless it is `laboratory`.
    pub frame: Option<String>,
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
        let positive = |key: &str| {
            let found = readings.declared_number(key)?;
            match found.filter(|value| *value < 0.0) {
                Some(found) => Err(readings.wrong(key, Trouble::Negative { key: key.to_owned(), found })),
                None => Ok(found),
            }
        };
        Ok(Self {
            frame: readings.declared("frame").map(str::to_owned),
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
        assert_eq!(problem, "exp_bed_t3.0.csv, line 3: x_shift_limit_m is -0.005; expected zero or more");
        let word = read(&FILE.replace("5e-3\n", "short\n")).expect_err("it is a word").to_string();
        assert!(word.starts_with("exp_bed_t3.0.csv, line 3: `short` for x_shift_limit_m"), "{word}");
    }

    #[test]
    fn absent_profiles_are_skipped() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(MeasuredProfile::read_if_there(&folder.path().join("exp_bed_t7.0.csv")).expect("no error"), None);
    }
}
