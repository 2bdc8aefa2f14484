//! Expectations of a case: `verification/<case>/expected.toml`.

use std::collections::BTreeSet;

use sazanami_numerics::Real;
use serde::{Deserialize, Serialize};

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
    /// The quantities, in the order of the table.
    #[serde(rename = "quantity")]
    pub quantities: Vec<Quantity>,
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
            if !names.insert(&quantity.name) {
                return Err(format!("`{}` twice", quantity.name));
            }
            quantity.check().map_err(|problem| format!("`{}`: {problem}", quantity.name))?;
        }
        Ok(expected)
    }
}

impl Quantity {
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
