//! Expectations of a case: `verification/<case>/expected.toml`.

use std::collections::BTreeSet;

use sazanami_numerics::Real;
use serde::{Deserialize, Serialize};

use crate::value::{Beside, Columns, Function, Value};

/// Expectations of a case.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// Subject, in one line.
    pub about: String,
    /// Processor time it takes, about \[s].
    pub cost: Real,
    /// Whether it runs only by name or with `--long`.
    #[serde(default)]
    pub long: bool,
    /// Whether it is among the cases that run with the tests.
    #[serde(default)]
    pub subset: bool,
    /// Runs of `case.toml`; none: one run of it as it stands.
    #[serde(default, rename = "run")]
    pub runs: Vec<Run>,
    /// Table of results of quantities and charts that name none.
    #[serde(default)]
    pub from: String,
    /// The quantities, in the order of the table.
    #[serde(rename = "quantity")]
    pub quantities: Vec<Quantity>,
    /// Curves of the page.
    #[serde(default, rename = "chart")]
    pub charts: Vec<Curves>,
}

/// A run of the case.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Name, unique in the case.
    pub name: String,
    /// Case file, where there are several; none: the first.
    pub case: Option<String>,
    /// Keys that it sets, as `--set` takes them.
    #[serde(default)]
    pub set: Vec<String>,
}

/// One quantity and how it is judged.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// Name, unique in the case.
    pub name: String,
    /// Unit; empty for a ratio or a count.
    #[serde(default)]
    pub unit: String,
    /// Reference value.
    pub reference: Option<Real>,
    /// Smallest and largest value that pass.
    pub band: Option<[Real; 2]>,
    /// Source of reference and band.
    #[serde(default)]
    pub source: String,
    /// Meaning of the quantity beyond its name; of an informational one, why nothing could be wrong with it.
    #[serde(default)]
    pub meaning: String,
    /// A miss that is recorded: the band is not met, and must not be missed by more than this.
    pub known_miss: Option<KnownMiss>,
    /// Beside what it is judged.
    #[serde(default)]
    pub kind: Kind,
    /// What is taken of the results, a [`Value`]; none: a program of the case measures it.
    pub value: Option<Value>,
    /// Run that it is taken of; none: the only one.
    pub run: Option<String>,
    /// Table that it is taken of, instead of that of the file.
    pub from: Option<String>,
    /// Times between which rows of the table count \[s]; none: all.
    pub when: Option<[Real; 2]>,
    /// The value is divided by this.
    pub over: Option<Other>,
    /// This is then taken off.
    pub minus: Option<Other>,
    /// Whether the sign is then dropped.
    #[serde(default)]
    pub absolute: bool,
    /// Rows of `reference.csv` from which the distance is taken.
    pub beside: Option<Beside>,
    /// Errors of an order of convergence, by name, each from twice as fine as the one before.
    #[serde(default)]
    pub of: Vec<String>,
}

/// A number, a quantity further up, or another value of the results.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Other {
    /// The number.
    Number(Real),
    /// Name of the quantity.
    Quantity(String),
    /// What differs from the value of the quantity itself.
    Taken(Taken),
}

/// Where a value is taken; what is not given is as in the quantity.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Taken {
    /// What is taken.
    pub value: Option<Value>,
    /// The run.
    pub run: Option<String>,
    /// The table.
    pub from: Option<String>,
    /// The times.
    pub when: Option<[Real; 2]>,
}

/// Curves of runs over one pair of axes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curves {
    /// Text above the axes.
    pub title: String,
    /// Labels of the axes, with units.
    pub axes: [String; 2],
    /// Columns that are shown.
    pub value: Columns,
    /// Runs that are shown; none: all.
    #[serde(default)]
    pub runs: Vec<String>,
    /// Table, instead of that of the file.
    pub from: Option<String>,
    /// Reference that is shown, and the units of the axes.
    pub beside: Option<Beside>,
    /// Name of the reference in the legend.
    #[serde(default)]
    pub reference: String,
}

/// Recorded miss of a band: its extent and reason.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownMiss {
    /// Values that are no worse than recorded.
    pub band: [Real; 2],
    /// Why the band is missed.
    pub reason: String,
}

/// Beside what a quantity is judged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A reference: theory, experiment, conservation, another computation.
    #[default]
    Reference,
    /// Its own value of an earlier version: a change is seen, an error that was always there is not.
    Regression,
    /// Nothing: it is reported alone.
    Informational,
}

/// Begins the source of a band about a value of an earlier version.
const RECORDED: &str = "recorded value";

impl Expected {
    /// Reads `expected.toml`.
    ///
    /// # Errors
    /// The error in the text.
    pub fn parse(text: &str) -> Result<Self, String> {
        let expected: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        let mut names = BTreeSet::new();
        for quantity in &expected.quantities {
            let named = |problem: String| format!("`{}`: {problem}", quantity.name);
            quantity.check().map_err(|problem| named(problem.into()))?;
            expected.check_value(quantity, &names).map_err(named)?;
            if !names.insert(quantity.name.as_str()) {
                return Err(format!("`{}` twice", quantity.name));
            }
        }
        let used = |run: &Run| {
            expected.runs.len() == 1
                || expected.quantities.iter().any(|quantity| quantity.takes().any(|of| of == run.name))
        };
        match expected.runs.iter().find(|run| !used(run)) {
            Some(run) => Err(format!("no quantity is taken of the run `{}`", run.name)),
            None => Ok(expected),
        }
    }

    /// Place of a run by its name; none stands for the only one.
    ///
    /// # Errors
    /// If there is no such run.
    pub fn run(&self, name: Option<&str>) -> Result<usize, String> {
        match name {
            None if self.runs.len() < 2 => Ok(0),
            None => Err("there are several runs: name one".into()),
            Some(name) => {
                self.runs.iter().position(|run| run.name == name).ok_or_else(|| format!("there is no run `{name}`"))
            }
        }
    }

    /// Checks what is taken of the results for `quantity`, below quantities called `above`.
    fn check_value(&self, quantity: &Quantity, above: &BTreeSet<&str>) -> Result<(), String> {
        let Some(value) = &quantity.value else {
            return if quantity.declares() { Err("there is no `value`".into()) } else { Ok(()) };
        };
        let others = [&quantity.over, &quantity.minus].into_iter().flatten().filter_map(|other| match other {
            Other::Quantity(name) => Some(name),
            _ => None,
        });
        if let Some(missing) = others.chain(&quantity.of).find(|name| !above.contains(name.as_str())) {
            return Err(format!("`{missing}` does not stand above it"));
        }
        let is_itself = |other: &Other| matches!(other, Other::Taken(taken) if quantity.is(taken));
        if [&quantity.over, &quantity.minus].into_iter().flatten().any(is_itself) {
            return Err("it is compared with itself".into());
        }
        if (value.function == Function::Order) != (quantity.of.len() > 1) {
            return Err("an order of convergence, and nothing else, is `of` two quantities or more".into());
        }
        if value.function == Function::Shift && quantity.beside.as_ref().is_none_or(|beside| beside.shift.is_none()) {
            return Err("no `shift` is allowed".into());
        }
        if value.function != Function::Order && quantity.run.is_none() {
            self.run(None)?;
        }
        quantity.takes().try_for_each(|run| self.run(Some(run)).map(drop))
    }
}

impl Quantity {
    /// Names of the runs that it is taken of.
    fn takes(&self) -> impl Iterator<Item = &str> {
        let others = [&self.over, &self.minus].into_iter().flatten().filter_map(|other| match other {
            Other::Taken(taken) => taken.run.as_deref(),
            _ => None,
        });
        self.run.as_deref().into_iter().chain(others)
    }

    /// Whether `taken` is what the quantity itself is taken of.
    fn is(&self, taken: &Taken) -> bool {
        (taken.value.is_none() || taken.value == self.value)
            && (taken.run.is_none() || taken.run == self.run)
            && (taken.from.is_none() || taken.from == self.from)
            && (taken.when.is_none() || taken.when == self.when)
    }

    /// Whether it says how it is taken of the results.
    fn declares(&self) -> bool {
        let words = [self.run.is_some(), self.from.is_some(), self.when.is_some(), self.over.is_some()];
        words.contains(&true) || self.minus.is_some() || self.absolute || self.beside.is_some() || !self.of.is_empty()
    }

    fn check(&self) -> Result<(), &'static str> {
        match (self.kind, self.band, &self.known_miss) {
            (Kind::Informational, Some(_), _) | (Kind::Informational, _, Some(_)) => Err("informational, with a band"),
            (Kind::Informational, ..) if self.meaning.is_empty() => Err("informational, and no meaning says why"),
            (_, None, _) if self.kind != Kind::Informational => Err("neither a band nor informational"),
            (_, Some(band), _) if !holds_values(band) => Err("a band without values"),
            (_, Some(_), _) if self.source.is_empty() => Err("a band without a source"),
            (Kind::Reference, ..) if self.source.starts_with(RECORDED) => {
                Err("a recorded value is no reference: add `kind = \"regression\"`")
            }
            (Kind::Regression, ..) if !self.source.starts_with(RECORDED) => {
                Err("the source of a regression row begins with `recorded value`")
            }
            (_, Some(band), Some(miss)) => miss.check(band),
            _ => Ok(()),
        }
    }
}

impl KnownMiss {
    fn check(&self, [low, high]: [Real; 2]) -> Result<(), &'static str> {
        let [from, to] = self.band;
        if self.reason.is_empty() {
            Err("a known miss without a reason")
        } else if !holds_values(self.band) {
            Err("the band of the known miss holds no values")
        } else if to > low && from < high {
            Err("the band of the known miss overlaps the band it misses")
        } else {
            Ok(())
        }
    }
}

/// Whether there is a value in a band; NaN has none.
fn holds_values([low, high]: [Real; 2]) -> bool {
    low <= high
}
