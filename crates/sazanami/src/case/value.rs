//! Reads single values: checks that each is what its type promises, and says so where it is not.
//!
//! A value that is wrong becomes NaN (or zero, or nothing), which passes every later comparison in
//! silence: one mistake gives one message.

use std::collections::BTreeSet;
use std::ops::Range;

use sazanami_numerics::{Real, Vector};

use super::diagnostics::Diagnostics;
use super::suggest::nearest;
use super::units::{SAME, parse_quantity, rounded_within};
use super::written::{
    At, Call, Cells, Choice, ChoiceSet, Flag, Item, Kind, Number, Numbers, Quantity, ScalarOrVector, Several, Text,
    Vectorial, Whole,
};

/// Collects findings while values are read.
#[derive(Debug)]
pub struct Values<'a> {
    /// The findings.
    pub report: &'a mut Diagnostics,
    /// Keys whose absence is no error, since something wrong stood in their place.
    pub forgiven: BTreeSet<String>,
}

/// The range a number has to lie in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range1 {
    /// Any value.
    Any,
    /// Above zero.
    Positive,
    /// Zero or above.
    NonNegative,
    /// From the first to the second, both allowed.
    Between(Real, Real),
}

impl Range1 {
    /// What is wrong with a value, in a unit.
    fn refuses(self, value: Real, unit: &str) -> Option<String> {
        match self {
            Self::Any => None,
            Self::Positive => (value <= 0.0).then(|| "has to be above zero".into()),
            Self::NonNegative => (value < 0.0).then(|| "must not be negative".into()),
            Self::Between(low, high) => {
                let beyond = low - value > SAME * low.abs() || value - high > SAME * high.abs();
                let [least, most] = ends(low, high, unit);
                beyond.then(|| format!("has to lie between {least} and {most}"))
            }
        }
    }
}

/// The ends of a range for people.
fn ends(low: Real, high: Real, unit: &str) -> [String; 2] {
    rounded_within(low, high).map(|end| format!("{end} {unit}").trim_end().to_owned())
}

impl Values<'_> {
    /// Says that a required key is missing from the table at `table`.
    pub fn missing(&mut self, table: Option<&Range<usize>>, key: &str, help: &str) {
        if self.forgiven.contains(key) {
            return;
        }
        let title = format!("`{key}` is missing");
        match table {
            Some(span) => self.report.error(span.clone(), title).label(format!("this needs `{key}`")),
            None => self.report.error_in_file(title),
        }
        .help(help.to_owned());
    }

    /// SI value of one element with a unit.
    fn si<K: Kind>(&mut self, at: &At<Item>, key: &str) -> Real {
        let text = match &at.value {
            Item::Text(text) => text,
            Item::Integer(_) | Item::Float(_) => {
                let number = match &at.value {
                    Item::Integer(n) => n.to_string(),
                    Item::Float(x) => format!("{x:?}"),
                    _ => String::new(),
                };
                let unit = K::EXAMPLE.trim_start_matches(|c: char| !c.is_whitespace()).trim_start();
                self.report
                    .error(at.span.clone(), format!("`{key}` needs a unit"))
                    .label(format!("a bare number; expected {} such as \"{}\"", K::NAME, K::EXAMPLE))
                    .help(format!("write \"{number} {unit}\" if that is the unit you mean"));
                return Real::NAN;
            }
            other => {
                self.report.error(at.span.clone(), format!("`{key}` is not {}", K::NAME)).label(format!(
                    "{}; expected {} such as \"{}\"",
                    other.kind(),
                    K::NAME,
                    K::EXAMPLE
                ));
                return Real::NAN;
            }
        };
        match parse_quantity(text) {
            Ok((value, dimension)) if dimension == K::DIMENSION => value,
            Ok((_, dimension)) => {
                let written =
                    if dimension == Default::default() { "no unit".into() } else { format!("the unit {dimension}") };
                self.report
                    .error(at.span.clone(), format!("`{key}` has the wrong unit"))
                    .label(format!("this has {written}; expected {}", K::NAME))
                    .help(format!("for example \"{}\"", K::EXAMPLE));
                Real::NAN
            }
            Err(error) => {
                let inner = at.span.start + 1 + error.range.start..at.span.start + 1 + error.range.end;
                // A text with escapes is longer in the file than in memory: point to all of it then.
                let span = if text.len() + 2 == at.span.len() { inner } else { at.span.clone() };
                self.report
                    .error(span, format!("`{key}` cannot be read: {}", error.message))
                    .label(format!("expected {} such as \"{}\"", K::NAME, K::EXAMPLE))
                    .help(error.suggestion.unwrap_or_else(|| format!("for example \"{}\"", K::EXAMPLE)));
                Real::NAN
            }
        }
    }

    /// The value, if it lies in the range; `unit` and `example` are for people.
    fn check_range(
        &mut self,
        at: &At<Item>,
        key: &str,
        value: Real,
        range: Range1,
        [unit, example]: [&str; 2],
    ) -> Real {
        match range.refuses(value, unit) {
            Some(why) => {
                let help = match range {
                    Range1::Positive | Range1::NonNegative if value < 0.0 => "leave out the minus sign".to_owned(),
                    Range1::Between(low, high) => {
                        let [least, most] = ends(low, high, unit);
                        format!("choose a value from {least} to {most}")
                    }
                    _ => format!("for example {example}"),
                };
                self.report.error(at.span.clone(), format!("`{key}` {why}")).label("this value").help(help);
                Real::NAN
            }
            None => value,
        }
    }

    /// A quantity that may be absent.
    pub fn optional<K: Kind>(&mut self, written: Option<&Quantity<K>>, key: &str, range: Range1) -> Option<Real> {
        let at = &written?.item;
        let value = self.si::<K>(at, key);
        Some(self.check_range(at, key, value, range, [K::SI, &format!("\"{}\"", K::EXAMPLE)]))
    }

    /// A quantity with a default.
    pub fn quantity<K: Kind>(
        &mut self,
        written: Option<&Quantity<K>>,
        key: &str,
        range: Range1,
        default: Real,
    ) -> Real {
        self.optional(written, key, range).unwrap_or(default)
    }

    /// A quantity that has to be given.
    pub fn required<K: Kind>(
        &mut self,
        written: Option<&Quantity<K>>,
        table: &Range<usize>,
        key: &str,
        range: Range1,
    ) -> Real {
        self.required_such_as(written, table, key, range, K::EXAMPLE)
    }

    /// A quantity that has to be given, with an example of its own.
    pub fn required_such_as<K: Kind>(
        &mut self,
        written: Option<&Quantity<K>>,
        table: &Range<usize>,
        key: &str,
        range: Range1,
        example: &str,
    ) -> Real {
        if written.is_none() {
            self.missing(Some(table), key, &format!("add `{key} = \"{example}\"`"));
        }
        self.optional(written, key, range).unwrap_or(Real::NAN)
    }

    fn elements<'i>(&mut self, at: &'i At<Item>, key: &str, expected: &str) -> Option<&'i [At<Item>]> {
        if let Item::List(list) = &at.value {
            return Some(list);
        }
        self.report
            .error(at.span.clone(), format!("`{key}` is not a list"))
            .label(format!("{}; expected {expected}", at.value.kind()));
        None
    }

    fn three<K: Kind>(&mut self, at: &At<Item>, key: &str) -> Vector {
        let expected = format!("three values such as [\"{0}\", \"{0}\", \"{0}\"]", K::EXAMPLE);
        let Some(list) = self.elements(at, key, &expected) else { return Vector::NAN };
        if list.len() != 3 {
            self.report
                .error(at.span.clone(), format!("`{key}` has {} components, not three", list.len()))
                .label(format!("expected {expected}"));
            return Vector::NAN;
        }
        Vector::new(self.si::<K>(&list[0], key), self.si::<K>(&list[1], key), self.si::<K>(&list[2], key))
    }

    /// Three quantities that may be absent.
    pub fn vector<K: Kind>(&mut self, written: Option<&Vectorial<K>>, key: &str) -> Option<Vector> {
        written.map(|w| self.three::<K>(&w.item, key))
    }

    /// Three quantities that have to be given.
    pub fn required_vector<K: Kind>(
        &mut self,
        written: Option<&Vectorial<K>>,
        table: &Range<usize>,
        key: &str,
    ) -> Vector {
        if written.is_none() {
            self.missing(Some(table), key, &format!("add `{key} = [\"{0}\", \"{0}\", \"{0}\"]`", K::EXAMPLE));
        }
        self.vector(written, key).unwrap_or(Vector::NAN)
    }

    /// A vector, or a magnitude (`Ok` and `Err` of the result).
    pub fn scalar_or_vector<K: Kind>(
        &mut self,
        written: Option<&ScalarOrVector<K>>,
        key: &str,
    ) -> Option<Result<Vector, Real>> {
        let at = &written?.item;
        Some(match &at.value {
            Item::List(_) => Ok(self.three::<K>(at, key)),
            _ => Err(self.si::<K>(at, key)),
        })
    }

    /// A list of quantities.
    pub fn several<K: Kind>(&mut self, written: Option<&Several<K>>, key: &str) -> Option<Vec<Real>> {
        let at = &written?.item;
        let expected = format!("values such as [\"{}\"]", K::EXAMPLE);
        let list = self.elements(at, key, &expected)?;
        Some(list.iter().map(|element| self.si::<K>(element, key)).collect())
    }

    /// A place on the plane (x1, x2).
    pub fn pair<K: Kind>(&mut self, written: Option<&Several<K>>, key: &str) -> Option<[Real; 2]> {
        let values = self.several(written, key)?;
        if let [a, b] = values[..] {
            return Some([a, b]);
        }
        if let Some(at) = written.map(|w| &w.item) {
            self.report
                .error(at.span.clone(), format!("`{key}` has {} components, not two", values.len()))
                .label(format!("expected x1 and x2, [\"{0}\", \"{0}\"]", K::EXAMPLE));
        }
        Some([Real::NAN; 2])
    }

    fn bare(&mut self, at: &At<Item>, key: &str) -> Real {
        match &at.value {
            Item::Integer(n) => *n as Real,
            Item::Float(x) if x.is_finite() => *x,
            Item::Float(_) => {
                self.report
                    .error(at.span.clone(), format!("`{key}` is not finite"))
                    .label("expected a finite number")
                    .help("write its digits, for example 0.5");
                Real::NAN
            }
            other => {
                self.report
                    .error(at.span.clone(), format!("`{key}` is not a number"))
                    .label(format!("{}; expected a number without unit", other.kind()))
                    .help("this quantity has no dimension: leave out quotes and unit");
                Real::NAN
            }
        }
    }

    /// A pure number that may be absent.
    pub fn optional_number(&mut self, written: Option<&Number>, key: &str, range: Range1) -> Option<Real> {
        let at = &written?.0;
        let value = self.bare(at, key);
        Some(self.check_range(at, key, value, range, ["", "1.0"]))
    }

    /// A pure number with a default.
    pub fn number(&mut self, written: Option<&Number>, key: &str, range: Range1, default: Real) -> Real {
        self.optional_number(written, key, range).unwrap_or(default)
    }

    /// So many pure numbers.
    pub fn numbers<const N: usize>(&mut self, written: Option<&Numbers>, key: &str) -> Option<[Real; N]> {
        let at = &written?.0;
        let list = self.elements(at, key, &format!("a list of {N} numbers"))?;
        if list.len() != N {
            self.report
                .error(at.span.clone(), format!("`{key}` has {} components, not {N}", list.len()))
                .label(format!("expected a list of {N} numbers"));
            return Some([Real::NAN; N]);
        }
        let mut values = [0.0; N];
        for (value, element) in values.iter_mut().zip(list) {
            *value = self.bare(element, key);
        }
        Some(values)
    }

    fn whole_at(&mut self, at: &At<Item>, key: &str, least: usize) -> Option<usize> {
        let Item::Integer(n) = at.value else {
            self.report
                .error(at.span.clone(), format!("`{key}` is not a whole number"))
                .label(format!("{}; expected a whole number", at.value.kind()));
            return None;
        };
        match usize::try_from(n) {
            Ok(n) if n >= least => Some(n),
            _ => {
                self.report
                    .error(at.span.clone(), format!("`{key}` has to be {least} or more"))
                    .label(format!("expected a whole number, {least} or more"))
                    .help(format!("write {least} or a larger whole number"));
                None
            }
        }
    }

    /// A whole number that may be absent; one that is wrong counts as absent.
    pub fn whole(&mut self, written: Option<&Whole>, key: &str, least: usize) -> Option<usize> {
        self.whole_at(&written?.0, key, least)
    }

    /// A whole number from `least` to `most` that may be absent; one that is wrong counts as absent.
    pub fn whole_up_to(&mut self, written: Option<&Whole>, key: &str, least: usize, most: usize) -> Option<usize> {
        let at = &written?.0;
        let number = self.whole_at(at, key, least)?;
        if number > most {
            self.report
                .error(at.span.clone(), format!("`{key}` has to be {most} or less"))
                .label(format!("expected a whole number from {least} to {most}"))
                .help(format!("write {most} or a smaller whole number"));
            return None;
        }
        Some(number)
    }

    /// Three whole numbers, each 1 or more; zeros stand for what is wrong.
    pub fn cells(&mut self, written: Option<&Cells>, table: &Range<usize>, key: &str) -> [usize; 3] {
        let Some(Cells(at)) = written else {
            self.missing(Some(table), key, &format!("add `{key} = [64, 64, 64]`"));
            return [0; 3];
        };
        let Some(list) = self.elements(at, key, "three whole numbers such as [64, 64, 64]") else { return [0; 3] };
        if list.len() != 3 {
            self.report
                .error(at.span.clone(), format!("`{key}` has {} components, not three", list.len()))
                .label("expected three whole numbers such as [64, 64, 64]");
            return [0; 3];
        }
        [0, 1, 2].map(|d| self.whole_at(&list[d], key, 1).unwrap_or(0))
    }

    /// `true` or `false`, with a default.
    pub fn flag(&mut self, written: Option<&Flag>, key: &str, default: bool) -> bool {
        let Some(Flag(at)) = written else { return default };
        if let Item::Flag(flag) = at.value {
            return flag;
        }
        self.report
            .error(at.span.clone(), format!("`{key}` is neither true nor false"))
            .label(format!("{}; expected true or false, without quotes", at.value.kind()));
        default
    }

    /// A text that may be absent.
    pub fn text<'t>(&mut self, written: Option<&'t Text>, key: &str) -> Option<&'t str> {
        let Text(at) = written?;
        if let Item::Text(text) = &at.value {
            return Some(text);
        }
        self.report
            .error(at.span.clone(), format!("`{key}` is not a text"))
            .label(format!("{}; expected a text in quotes", at.value.kind()));
        None
    }

    /// One word of a set, with a default.
    pub fn choice<E: ChoiceSet>(&mut self, written: Option<&Choice<E>>, key: &str, default: E) -> E {
        self.optional_choice(written, key).unwrap_or(default)
    }

    /// One word of a set that may be absent.
    pub fn optional_choice<E: ChoiceSet>(&mut self, written: Option<&Choice<E>>, key: &str) -> Option<E> {
        let at = &written?.item;
        let words: Vec<&str> = E::ALL.iter().map(|choice| choice.word()).collect();
        let Item::Text(word) = &at.value else {
            self.report.error(at.span.clone(), format!("`{key}` is not a word")).label(format!(
                "{}; expected one of {}",
                at.value.kind(),
                words.join(", ")
            ));
            return None;
        };
        let choice = E::from_word(word);
        if choice.is_none() {
            let finding = self.report.error(at.span.clone(), format!("`{word}` is no choice for `{key}`"));
            match nearest(word, words.iter().copied()) {
                Some(meant) => finding.label(format!("did you mean `{meant}`?")),
                None => finding.label("not a choice known here"),
            };
            finding.help(format!("known here: {}", words.join(", ")));
        }
        choice
    }

    /// A word with an optional count, `shell(75)`.
    pub fn call<'t>(
        &mut self,
        written: Option<&'t Call>,
        key: &str,
        expected: &str,
    ) -> Option<(&'t str, Option<usize>)> {
        let Call(at) = written?;
        let parts = match &at.value {
            Item::Text(text) => split_call(text),
            _ => None,
        };
        if parts.is_none() {
            self.report.error(at.span.clone(), format!("`{key}` cannot be read")).label(format!("expected {expected}"));
        }
        parts
    }
}

/// Splits `word(n)` or `word`.
fn split_call(text: &str) -> Option<(&str, Option<usize>)> {
    let text = text.trim();
    match text.split_once('(') {
        None => Some((text, None)),
        Some((word, rest)) => {
            let count = rest.strip_suffix(')')?.trim().parse().ok()?;
            Some((word.trim(), Some(count)))
        }
    }
}
