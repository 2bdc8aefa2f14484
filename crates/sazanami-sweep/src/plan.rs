//! A plan as written: which case, which keys, which values.

mod reader;

use std::ops::Range;
use std::path::{Path, PathBuf};

use sazanami::case::{CaseError, Diagnostics, Source};
use sazanami_io::input;

use reader::Reader;

use crate::keys::{Design, Key, Setting};
use crate::points;

/// Most runs of a sweep.
pub(crate) const MOST_RUNS: usize = 10_000;

/// Target of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Target {
    /// Name of the finding, as in the table.
    pub name: String,
    pub value: f64,
    pub tolerance: f64,
}

/// A sweep as its file poses it.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The case that all runs have in common.
    pub case: PathBuf,
    /// Its file.
    pub path: PathBuf,
    /// Runs at a time, where the plan says it.
    pub side_by_side: Option<usize>,
    pub(crate) source: Source,
    warnings: Diagnostics,
    pub(crate) case_span: Range<usize>,
    pub(crate) fixed: Vec<(String, Range<usize>, Setting)>,
    pub(crate) keys: Vec<Key>,
    pub(crate) design: Design,
    pub(crate) seeds: Vec<Setting>,
    pub(crate) targets: Vec<Target>,
    /// Most runs of a calibration, those of all seeds.
    pub(crate) most_runs: usize,
}

impl Plan {
    /// Reads the plan at `path`.
    ///
    /// # Errors
    /// All findings together, if one of them is an error.
    pub fn load(path: &Path) -> Result<Self, Box<CaseError>> {
        let text = input::read_text(path).map_err(|error| {
            let mut diagnostics = Diagnostics::default();
            diagnostics.error_in_file("the plan cannot be read").label(error.to_string()).help(
                "a plan is a TOML file with `case = \"CASE.toml\"` and `[keys]`: docs/guide/sweeps.md has examples",
            );
            Box::new(CaseError { source: Source::new(path.display().to_string(), "", &[]), diagnostics })
        })?;
        Self::parse(path, &text)
    }

    /// Reads a plan from its text; file names in it are relative to the folder of `path`.
    ///
    /// # Errors
    /// All findings together, if one of them is an error.
    pub fn parse(path: &Path, text: &str) -> Result<Self, Box<CaseError>> {
        let source = Source::new(path.display().to_string(), text, &[]);
        let mut reader = Reader { text, report: Diagnostics::default() };
        let plan = reader.plan(path, &source);
        match plan {
            Some(plan) if !reader.report.has_errors() => Ok(Self { warnings: reader.report, ..plan }),
            _ => Err(Box::new(CaseError { source, diagnostics: reader.report })),
        }
    }

    /// Name of the plan: that of its file.
    #[must_use]
    pub fn name(&self) -> String {
        self.path.file_stem().map_or_else(|| "sweep".into(), |stem| stem.to_string_lossy().into_owned())
    }

    /// The points, each with a value for each key of the plan in its order.
    #[must_use]
    pub fn points(&self) -> Vec<Vec<Setting>> {
        points::of(&self.keys, self.design)
    }

    /// Number of runs: of each point as many as there are seeds.
    #[must_use]
    pub fn runs(&self) -> usize {
        self.points().len() * self.seeds.len().max(1)
    }

    /// Places of the points in the unit cube, where the design is one of trajectories, whose steps have effects.
    pub(crate) fn trajectories(&self) -> Option<Vec<Vec<f64>>> {
        match self.design {
            Design::Morris { trajectories, levels, seed } => {
                let places = points::morris(self.keys.len(), trajectories, levels, seed);
                Some(points::realised(&self.keys, places))
            }
            _ => None,
        }
    }

    /// What is doubtful in it, and its text.
    #[must_use]
    pub fn warnings(&self) -> (&Diagnostics, &Source) {
        (&self.warnings, &self.source)
    }

    /// Whether it is for a calibration.
    #[must_use]
    pub fn has_targets(&self) -> bool {
        !self.targets.is_empty()
    }

    /// An error about a place in the plan.
    pub(crate) fn refused(&self, diagnostics: Diagnostics) -> Box<CaseError> {
        Box::new(CaseError { source: self.source.clone(), diagnostics })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(text: &str) -> Result<Plan, Box<CaseError>> {
        Plan::parse(Path::new("folder/plan.toml"), text)
    }

    #[test]
    fn values_keep_their_text_and_places() {
        let read = plan(
            "case = \"a.toml\"\nseeds = [1, 2]\n[set]\n\"run.until\" = \"1 ms\"\n[keys]\n\
             \"liquid.0.region\" = [{ sphere = { diameter = \"1 mm\" } }, \"x\"]\n",
        )
        .unwrap();
        assert_eq!((read.case.as_path(), read.name().as_str()), (Path::new("folder/a.toml"), "plan"));
        let points = read.points();
        assert_eq!(points[0][0].value, "{ sphere = { diameter = \"1 mm\" } }");
        assert_eq!((points[1][0].value.as_str(), points[1][0].shown()), ("\"x\"", "x".into()));
        assert_eq!(read.fixed[0].2.value, "\"1 ms\"");
        assert_eq!((read.seeds.len(), read.runs()), (2, 2 * points.len()));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let base = "case = \"a.toml\"\n";
        for (text, expected) in [
            ("keys = {}\n", "names no case"),
            ("case = \"a.toml\"\n", "varies no key"),
            ("case = \"a.toml\"\nkey = 1\n", "did you mean `keys`?"),
            ("case = \"a.toml\"\n[keys]\n\"a\" = []\n", "the list of values is empty"),
            ("case = \"a.toml\"\n[keys]\n\"a\" = 3\n", "is to vary over several values"),
            ("case = \"a.toml\"\n[keys]\na.b = [1]\n", "stands in quotes"),
            ("case = \"a.toml\"\n[keys]\n\"a\" = { form = 1, to = 2, count = 2 }\n", "did you mean `from`?"),
            ("case = \"a.toml\"\n[keys]\n\"a\" = { from = 2, to = 1, count = 2 }\n", "the range is empty"),
            ("case = \"a.toml\"\n[keys]\n\"a\" = { from = 1, to = 2 }\n", "is not said"),
            ("case = \"a.toml\"\n[keys]\n\"a\" = { from = \"1 mm\", to = \"2 m\", count = 2 }\n", "the same unit"),
            ("case = \"a.toml\"\n[keys]\n\"a\" = { from = \"1 mx\", to = \"2 mx\", count = 2 }\n", "mx"),
            ("case = \"a.toml\"\npoints = \"zipp\"\n[keys]\n\"a\" = [1]\n", "did you mean `zip`?"),
            ("case = \"a.toml\"\npoints = \"zip\"\n[keys]\n\"a\" = [1]\n\"b\" = [1, 2]\n", "equally many"),
            (
                "case = \"a.toml\"\npoints = \"zip\"\n[keys]\n\"a\" = { from = 1, to = 2, count = 1000000000 }\n",
                "more than the",
            ),
            ("case = \"a.toml\"\npoints = { sobol = {} }\n[keys]\n\"a\" = [1]\n", "number of points is missing"),
            ("case = \"a.toml\"\n[set]\n\"a\" = 1\n[keys]\n\"a\" = [1]\n", "is set and varied"),
            (
                "case = \"a.toml\"\n[keys]\n\"a\" = { from = 0, to = 1, count = 200 }\n\
                 \"b\" = { from = 0, to = 1, count = 200 }\n",
                "40000 runs are more than",
            ),
            (
                "case = \"a.toml\"\n[keys]\n\"a\" = { from = 1, to = 2 }\n[targets]\n\"b\" = { value = 1 }\n",
                "a tolerance",
            ),
            ("case = \"a.toml\"\nseeds = [1, 10, 1_0]\n[keys]\n\"a\" = [1]\n", "seed 3 is there already"),
            (
                "case = \"a.toml\"\nmost_runs = 5\nseeds = [1, 2, 3]\n[keys]\n\"a\" = { from = 1, to = 2 }\n[targets]\n\
                 \"b\" = { value = 1, tolerance = 1 }\n",
                "the first points take 6 runs",
            ),
            ("case = \n", "not TOML"),
        ] {
            let error = plan(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{text}:\n{error}");
        }
        assert!(plan(&format!("{base}[keys]\n\"a\" = [1]\n")).is_ok());
        let ends = plan(&format!("{base}[keys]\n\"a\" = {{ from = \"10 ms\", to = \"0.03 s\", count = 2 }}\n"));
        assert_eq!(ends.unwrap_err().to_string().matches("error:").count(), 1, "one fault, one error");
        let single =
            plan(&format!("{base}[keys]\n\"a\" = {{ from = 1, to = 2, count = 1 }}\n")).unwrap_err().to_string();
        assert!(single.matches("error:").count() == 1 && single.contains("of at least 2"), "{single}");
        let empty = plan(&format!("{base}[keys]\n\"a\" = {{ from = 1.0, to = 0.1, count = 2 }}\n")).unwrap_err();
        assert!(empty.to_string().contains("`to` has to lie above `from`, 1\n"), "{empty}");
    }

    #[test]
    fn a_value_that_stands_twice_is_warned_of() {
        let warned = |values: &str, points: &str| {
            let read = plan(&format!("case = \"a.toml\"\n{points}\n[keys]\n\"a\" = {values}\n")).unwrap();
            let (warnings, source) = read.warnings();
            warnings.records(source).into_iter().map(|record| record.message).collect::<Vec<_>>()
        };
        for values in
            ["[0.5, 0.5, 1.0]", "[\"1 ms\", \"2 ms\", \"0.001 s\"]", "[{ b = 1 }, { b = 1 }]", "[1, 2, 1_0, 10]"]
        {
            let found = warned(values, "");
            assert!(found.len() == 1 && found[0].contains("is there already"), "{values}: {found:?}");
        }
        // Integers of a range are fewer than its values.
        let found = warned("{ from = 6, to = 7, integers = true, count = 4 }", "");
        assert!(found.len() == 2 && found[0] == "this value is there already, as value 1", "{found:?}");
        assert!(warned("{ from = 6, to = 9, integers = true, count = 4 }", "").is_empty());
        // Where keys are zipped points are compared: the second has one value of the first, the third both.
        let zipped =
            |values: &str| warned(&format!("[1, 1, 1]\n\"b\" = {values}\n[set]\n\"c\" = 1"), "points = \"zip\"");
        let found = zipped("[1, 2, 1]");
        assert!(found == ["this point is there already, as point 1"], "{found:?}");
        // Negative control.
        assert!(zipped("[1, 2, 3]").is_empty() && zipped("{ from = 1, to = 2, count = 3 }").is_empty());
        for values in ["[0.5, 1.0]", "[\"1 ms\", \"1 mm\"]", "[true, false]"] {
            assert!(warned(values, "").is_empty(), "{values}");
        }
    }
}
