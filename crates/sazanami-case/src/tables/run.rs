//! `[run]` and `[checkpoint]`: how long the run is, and what is kept to go on from.

use sazanami_case_derive::Keys;
use sazanami_numerics::Real;
use serde_json::json;
use toml::de::DeValue;

use super::Schedule;
use crate::key::{KeyDoc, ValueDoc};
use crate::read::{At, Context, Table};
use crate::value::{Range1, Value};
use crate::write::{Paths, Written};

/// What ends a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RunEnd {
    /// A simulated time \[s].
    At(Real),
    /// The rest of the crater.
    Rest,
}

/// Length of the run.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct RunLength {
    /// Simulated time at the end, or `"rest"`: the run ends when its crater is at rest (`observables.crater_rest`), the volume below the
    /// rim has kept within 3 % for 10 ms, in eight rows of the series at least, and what grains in flight could fill, packed loosely, is 3 % of the volume below the rim at
    /// most, and at `latest` if that does not come. Drops, grains and plates that
    /// come later than that rest are not waited for. The time may be left out with `packing_only`.
    #[key(name = "until", unit = "s", range = NonNegative, default = RunEnd::At(Real::NAN), says = "required", example = "0.02 s")]
    pub end: RunEnd,
    /// Simulated time at which a run until rest ends at the latest: required with `until = "rest"`; a time `until` may not lie beyond it.
    #[key(unit = "s", range = Positive)]
    pub latest: Option<Real>,
    /// Most steps of the fluid.
    #[key(least = 1, says = "any number")]
    pub steps: Option<usize>,
    /// Whether the run ends with the packed bed.
    #[key(default = false)]
    pub packing_only: bool,
    /// Simulated time at the end, or at the latest \[s].
    #[key(skip = Real::NAN)]
    pub until: Real,
}

impl RunLength {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        match (self.end, self.latest) {
            (RunEnd::At(time), latest) => {
                self.until = time;
                if latest.is_some_and(|latest| time > latest) {
                    cx.report
                        .error(table.place("until"), "`run.until` lies beyond `run.latest`")
                        .label("the run would not come to this time")
                        .help("`latest` is for `until = \"rest\"`: leave it out, or raise it");
                }
            }
            (RunEnd::Rest, Some(latest)) => self.until = latest,
            (RunEnd::Rest, None) => {
                cx.report
                    .error(table.place("until"), "`until = \"rest\"` without the latest time")
                    .label("a crater may never come to rest")
                    .help("give the time at which the run ends anyway: `latest = \"0.19 s\"`");
            }
        }
        if table.has("until") {
            return;
        }
        if self.packing_only {
            (self.end, self.until) = (RunEnd::At(0.0), 0.0);
        } else {
            table.missing("until", cx);
        }
    }

    /// A run that ends at a time \[s].
    #[must_use]
    pub fn until(time: Real) -> Self {
        Self { end: RunEnd::At(time), latest: None, steps: None, packing_only: false, until: time }
    }
}

impl Default for RunLength {
    /// A run of which nothing is known: every comparison with its end passes.
    fn default() -> Self {
        Self::until(Real::NAN)
    }
}

impl Value for RunEnd {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf("time or `rest`", |_| json!({ "type": "string", "pattern": "^(rest|\\s*[-+]?[0-9.].*)$" }))
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        match at.value {
            Some(DeValue::String(word)) if word == "rest" => Some(Self::Rest),
            _ => Real::read(at, key, range, cx).map(Self::At),
        }
    }

    fn write(&self, unit: &str, style: Paths) -> Written {
        match self {
            Self::At(time) => time.write(unit, style),
            Self::Rest => Written::Leaf("\"rest\"".into()),
        }
    }

    fn blank() -> Self {
        Self::At(Real::blank())
    }

    fn example(key: &KeyDoc) -> String {
        Real::example(key)
    }
}

/// Wall-clock time between checkpoints \[s].
const EVERY: Real = 600.0;

/// Checkpoints.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Checkpoints {
    /// Every so much wall-clock time.
    #[key(unit = "s", range = Positive, says = format!("{} min, none if `every` is given", EVERY / 60.0))]
    pub every_wall: Option<Real>,
    /// Every so much simulated time.
    #[key(unit = "s", range = Positive)]
    pub every: Option<Real>,
    /// Number kept.
    #[key(least = 1, default = 2)]
    pub keep: usize,
}

impl Checkpoints {
    /// When one is made by simulated time.
    #[must_use]
    pub fn schedule(&self) -> Schedule {
        Schedule { every: self.every, ..Schedule::default() }
    }

    fn check(&mut self, table: &Table<'_>, _: &mut Context<'_>) {
        if !table.has("every_wall") && self.every.is_none() {
            self.every_wall = Some(EVERY);
        }
    }
}
