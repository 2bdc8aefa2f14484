//! Single values: how each type is read, checked, written and described.
//!
//! A value that is wrong becomes NaN, or a default, which passes every later comparison in silence: one mistake gives
//! one message.

mod words;

use sazanami_numerics::{Real, Vector};
use serde_json::{Value as Json, json};
use toml::de::DeValue;

use crate::key::{KeyDoc, ValueDoc};
use crate::read::{At, Context};
use crate::units::{Dimension, Quantity, SAME, parse_quantity, rounded, rounded_within, without_commas};
use crate::write::{Paths, Written};

pub use words::Word;

/// A type that a key can have.
pub trait Value: Sized {
    /// Its kind in words, and its JSON Schema.
    fn doc() -> ValueDoc;
    /// Reads it; what is wrong is reported, and gives `None`.
    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self>;
    /// The value as TOML, quantities in `unit`.
    fn write(&self, unit: &str, style: Paths) -> Written;
    /// Substitute for a value that has to be given and is not.
    fn blank() -> Self;
    /// Substitute for a wrong value, if not the default.
    fn wrong() -> Option<Self> {
        None
    }
    /// Example in messages.
    fn example(key: &KeyDoc) -> String;
    /// The value for people, as a default in the reference.
    fn show(&self, key: &KeyDoc) -> String {
        match self.write(key.unit.map_or("", |unit| unit.unit), Paths::AsGiven) {
            Written::Leaf(text) | Written::File(text) => text.trim_matches('"').to_owned(),
            _ => String::new(),
        }
    }
}

/// A value of a key: given, left out, or wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Given<T> {
    /// The case gives it.
    Value(T),
    /// The case leaves it out.
    Absent,
    /// The case gives a wrong value, which has been reported.
    Wrong,
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
    /// Message on a value, in a unit, that lies outside the range.
    pub(crate) fn refuses(self, value: Real, unit: &str) -> Option<String> {
        match self {
            Self::Any => None,
            Self::Positive => (value <= 0.0).then(|| "has to be above zero".into()),
            Self::NonNegative => (value.is_sign_negative() && !value.is_nan()).then(|| "must not be negative".into()),
            Self::Between(low, high) => {
                let beyond = low - value > SAME * low.abs() || value - high > SAME * high.abs();
                let [least, most] = ends(low, high, unit);
                beyond.then(|| format!("has to lie between {least} and {most}"))
            }
        }
    }

    /// The range for people, if it is one.
    #[must_use]
    pub fn text(self, unit: &str) -> Option<String> {
        match self {
            Self::Any => None,
            Self::Positive => Some("above zero".into()),
            Self::NonNegative => Some("zero or above".into()),
            Self::Between(low, high) => {
                let [least, most] = ends(low, high, unit);
                Some(format!("{least} to {most}"))
            }
        }
    }
}

/// The ends of a range for people.
fn ends(low: Real, high: Real, unit: &str) -> [String; 2] {
    rounded_within(low, high).map(|end| format!("{end} {unit}").trim_end().to_owned())
}

/// The value, if it lies in the range.
fn check(at: &At<'_>, key: &KeyDoc, value: Real, range: Range1, cx: &mut Context<'_>) -> Option<Real> {
    let (unit, example) = match key.unit {
        Some(unit) => (unit.unit, format!("\"{}\"", unit.example)),
        None => ("", "1.0".to_owned()),
    };
    let Some(why) = range.refuses(value, unit) else { return Some(value) };
    let help = match range {
        Range1::Positive | Range1::NonNegative if value.is_sign_negative() => "leave out the minus sign".to_owned(),
        Range1::Between(low, high) => {
            let [least, most] = ends(low, high, unit);
            format!("choose a value from {least} to {most}")
        }
        _ => format!("for example {example}"),
    };
    cx.report.error(at.span.clone(), format!("`{}` {why}", key.name)).label("this value").help(help);
    None
}

/// SI value of a text with a unit.
fn quantity(at: &At<'_>, key: &KeyDoc, unit: Quantity, cx: &mut Context<'_>) -> Option<Real> {
    let (name, report) = (key.name, &mut *cx.report);
    let expected = format!("expected {} such as \"{}\"", unit.name, unit.example);
    let example = format!("for example \"{}\"", unit.example);
    let text = match at.value {
        Some(DeValue::String(text)) => text,
        Some(DeValue::Integer(_) | DeValue::Float(_)) => {
            report
                .error(at.span.clone(), format!("`{name}` needs a unit"))
                .label(format!("a bare number; {expected}"))
                .help(match at.number() {
                    Some(number) if number.is_finite() => {
                        format!("write \"{} {}\" if that is the unit you mean", at.number_text(), unit.common_unit())
                    }
                    _ => example,
                });
            return None;
        }
        _ => {
            report
                .error(at.span.clone(), format!("`{name}` is not {}", unit.name))
                .label(format!("{}; {expected}", at.kind()));
            return None;
        }
    };
    match parse_quantity(text) {
        Ok((value, dimension)) if dimension == unit.dimension => Some(value),
        Ok((_, dimension)) => {
            let written = if dimension == Dimension::NONE { "no unit".into() } else { format!("the unit {dimension}") };
            report
                .error(at.span.clone(), format!("`{name}` has the wrong unit"))
                .label(format!("this has {written}; expected {}", unit.name))
                .help(example);
            None
        }
        Err(error) => {
            let inner = at.span.start + 1 + error.range.start..at.span.start + 1 + error.range.end;
            // A text with escapes is longer in the file than in memory: point to all of it then.
            let span = if text.len() + 2 == at.span.len() { inner } else { at.span.clone() };
            report
                .error(span, format!("`{name}` cannot be read: {}", error.message))
                .label(expected)
                .help(error.suggestion.unwrap_or(example));
            None
        }
    }
}

/// Whether this is a number but for the commas in it.
fn has_commas(text: &str) -> bool {
    let number = text.strip_prefix(['-', '+']).unwrap_or(text);
    let is_digit = |c: char| c.is_ascii_digit();
    let all = number.chars().all(|c| is_digit(c) || matches!(c, ',' | '.'));
    all && number.contains(',') && number.starts_with(is_digit) && number.ends_with(is_digit)
}

fn number(at: &At<'_>, key: &KeyDoc, cx: &mut Context<'_>) -> Option<Real> {
    match at.number() {
        Some(value) if value.is_finite() => Some(value),
        Some(_) => {
            cx.report
                .error(at.span.clone(), format!("`{}` is not finite", key.name))
                .label("expected a finite number")
                .help("write its digits, for example 0.5");
            None
        }
        None => {
            let text = at.text().trim();
            let help = if has_commas(text) {
                format!("decimals follow a decimal point, and thousands have no mark: write {}", without_commas(text))
            } else {
                "this quantity has no dimension: leave out quotes and unit".to_owned()
            };
            cx.report
                .error(at.span.clone(), format!("`{}` is not a number", key.name))
                .label(format!("{}; expected a number without unit", at.kind()))
                .help(help);
            None
        }
    }
}

impl Value for Real {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf("number", |key| match key.unit {
            None => json!({ "type": "number" }),
            Some(unit) => json!({
                "type": "string",
                "pattern": "^\\s*[-+]?[0-9.].*$",
                "description": format!("{} with its unit, for example \"{}\"", unit.name, unit.example),
            }),
        })
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        let value = match key.unit {
            Some(unit) => quantity(at, key, unit, cx),
            None => number(at, key, cx),
        }?;
        check(at, key, value, range, cx)
    }

    fn write(&self, unit: &str, _: Paths) -> Written {
        Written::Leaf(if unit.is_empty() { format!("{self:?}") } else { format!("\"{self:?} {unit}\"") })
    }

    fn blank() -> Self {
        Self::NAN
    }

    fn wrong() -> Option<Self> {
        Some(Self::NAN)
    }

    fn example(key: &KeyDoc) -> String {
        match key.unit {
            Some(unit) => format!("\"{}\"", key.example.unwrap_or(unit.example)),
            None => key.example.unwrap_or("1.0").to_owned(),
        }
    }

    fn show(&self, key: &KeyDoc) -> String {
        format!("{} {}", rounded(*self), key.unit.map_or("", |unit| unit.unit)).trim_end().to_owned()
    }
}

/// The elements of a list.
pub(crate) fn elements<'t>(at: &At<'t>, key: &KeyDoc, expected: &str, cx: &mut Context<'_>) -> Option<Vec<At<'t>>> {
    if let Some(list) = at.elements() {
        return Some(list);
    }
    cx.report
        .error(at.span.clone(), format!("`{}` is not a list", key.name))
        .label(format!("{}; expected {expected}", at.kind()));
    None
}

/// As many elements as `N`, whose number is `words`.
fn so_many<'t, const N: usize>(
    at: &At<'t>,
    key: &KeyDoc,
    [words, expected]: [&str; 2],
    cx: &mut Context<'_>,
) -> Option<[At<'t>; N]> {
    let list = elements(at, key, expected, cx)?;
    let found = list.len();
    <[At<'t>; N]>::try_from(list).ok().or_else(|| {
        cx.report
            .error(at.span.clone(), format!("`{}` has {found} components, not {words}", key.name))
            .label(format!("expected {expected}"));
        None
    })
}

/// Name of a list of reals, and an example of it.
fn expected_reals<const N: usize>(key: &KeyDoc) -> [String; 2] {
    let words = ["", "", "two", "three"].get(N).map_or_else(|| N.to_string(), |word| (*word).to_owned());
    match (key.unit, N) {
        (None, _) => [N.to_string(), format!("a list of {N} numbers")],
        (Some(unit), 2) => [words, format!("x1 and x2, [\"{0}\", \"{0}\"]", unit.example)],
        (Some(unit), _) => {
            let list = vec![format!("\"{}\"", unit.example); N].join(", ");
            let expected = format!("{words} values such as [{list}]");
            [words, expected]
        }
    }
}

impl<const N: usize> Value for [Real; N] {
    fn doc() -> ValueDoc {
        let name = match N {
            2 => "two numbers",
            3 => "vector",
            4 => "four numbers",
            _ => "numbers",
        };
        ValueDoc::Leaf(name, |key| json!({ "type": "array", "items": one(key), "minItems": N, "maxItems": N }))
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        let [words, expected] = expected_reals::<N>(key);
        let list = so_many::<N>(at, key, [&words, &expected], cx)?;
        let values = list.map(|element| Real::read(&element, key, range, cx));
        values.iter().all(Option::is_some).then(|| values.map(|value| value.unwrap_or(Real::NAN)))
    }

    fn write(&self, unit: &str, style: Paths) -> Written {
        self.to_vec().write(unit, style)
    }

    fn blank() -> Self {
        [Real::NAN; N]
    }

    fn wrong() -> Option<Self> {
        Some(Self::blank())
    }

    fn example(key: &KeyDoc) -> String {
        key.example.map_or_else(|| format!("[{}]", vec![Real::example(key); N].join(", ")), str::to_owned)
    }
}

/// JSON Schema of one element of a list of reals.
fn one(key: &KeyDoc) -> Json {
    match Real::doc() {
        ValueDoc::Leaf(_, schema) => schema(key),
        _ => Json::Null,
    }
}

impl Value for Vector {
    fn doc() -> ValueDoc {
        <[Real; 3]>::doc()
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        <[Real; 3]>::read(at, key, range, cx).map(Self::from)
    }

    fn write(&self, unit: &str, style: Paths) -> Written {
        self.to_array().write(unit, style)
    }

    fn blank() -> Self {
        Self::NAN
    }

    fn wrong() -> Option<Self> {
        Some(Self::NAN)
    }

    fn example(key: &KeyDoc) -> String {
        <[Real; 3]>::example(key)
    }
}

impl Value for Vec<Real> {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf("list", |key| json!({ "type": "array", "items": one(key) }))
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        let list = elements(at, key, &format!("values such as {}", Self::example(key)), cx)?;
        let values: Vec<Option<Real>> = list.iter().map(|element| Real::read(element, key, range, cx)).collect();
        values.into_iter().collect()
    }

    fn write(&self, unit: &str, style: Paths) -> Written {
        let text = |value: &Real| match value.write(unit, style) {
            Written::Leaf(text) => text,
            _ => String::new(),
        };
        Written::Leaf(format!("[{}]", self.iter().map(text).collect::<Vec<_>>().join(", ")))
    }

    fn blank() -> Self {
        Self::new()
    }

    fn example(key: &KeyDoc) -> String {
        format!("[{}]", Real::example(key))
    }
}

/// Splits `word(n)` or `word`.
#[must_use]
pub fn split_call(text: &str) -> Option<(&str, Option<usize>)> {
    let text = text.trim();
    match text.split_once('(') {
        None => Some((text, None)),
        Some((word, rest)) => {
            let count = rest.strip_suffix(')')?.trim().parse().ok()?;
            Some((word.trim(), Some(count)))
        }
    }
}
