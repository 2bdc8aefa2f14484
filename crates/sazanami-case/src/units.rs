//! Quantities as text with a unit, `"0.52 mm"`: a number, a product of units, and a check that the
//! dimension is the one asked for.
//!
//! Powers of ten are moved into the number's decimal exponent before it is rounded, so that
//! `"0.52 mm"` is the very double that Rust reads from `0.52e-3`.

use std::fmt;
use std::ops::Range;

use sazanami_numerics::Real;

/// Powers of length, mass, time and angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dimension {
    /// Power of length \[m].
    pub length: i8,
    /// Power of mass \[kg].
    pub mass: i8,
    /// Power of time \[s].
    pub time: i8,
    /// Power of plane angle \[rad].
    pub angle: i8,
}

impl Dimension {
    /// A pure number.
    pub const NONE: Self = Self::new(0, 0, 0, 0);

    /// The dimension with the given powers of length, mass, time and angle.
    #[must_use]
    pub const fn new(length: i8, mass: i8, time: i8, angle: i8) -> Self {
        Self { length, mass, time, angle }
    }

    /// `None` where a power is beyond reason.
    fn times(self, other: Self, power: i8) -> Option<Self> {
        let sum = |own: i8, other: i8| own.checked_add(power.checked_mul(other)?);
        Some(Self {
            length: sum(self.length, other.length)?,
            mass: sum(self.mass, other.mass)?,
            time: sum(self.time, other.time)?,
            angle: sum(self.angle, other.angle)?,
        })
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for (symbol, power) in [("kg", self.mass), ("m", self.length), ("s", self.time), ("rad", self.angle)] {
            match power {
                0 => continue,
                1 => write!(formatter, "{separator}{symbol}")?,
                _ => write!(formatter, "{separator}{symbol}^{power}")?,
            }
            separator = " ";
        }
        if separator.is_empty() { formatter.write_str("no unit") } else { Ok(()) }
    }
}

/// A kind of quantity: its unit, its dimension and how messages speak of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// The SI unit that the copy of a case is written in.
    pub unit: &'static str,
    /// The kind with its article, `a length`.
    pub name: &'static str,
    /// A value as an example, `0.52 mm`.
    pub example: &'static str,
    /// Dimension of every value of the kind.
    pub dimension: Dimension,
}

impl Quantity {
    /// Every kind of quantity that keys have.
    const ALL: [Self; 15] = [
        Self::new("m", "a length", "0.52 mm", [1, 0, 0, 0]),
        Self::new("s", "a time", "1e-5 s", [0, 0, 1, 0]),
        Self::new("kg", "a mass", "1.93e-7 kg", [0, 1, 0, 0]),
        Self::new("m/s", "a velocity", "9 m/s", [1, 0, -1, 0]),
        Self::new("m/s^2", "an acceleration", "9.8 m/s^2", [1, 0, -2, 0]),
        Self::new("kg/m^3", "a density", "2650 kg/m^3", [-3, 1, 0, 0]),
        Self::new("m^2/s", "a kinematic viscosity", "1e-6 m^2/s", [2, 0, -1, 0]),
        Self::new("Pa s", "a dynamic viscosity", "1e-3 Pa s", [-1, 1, -1, 0]),
        Self::new("Pa", "a pressure", "1 kPa", [-1, 1, -2, 0]),
        Self::new("N/m", "a stiffness", "1e4 N/m", [0, 1, -2, 0]),
        Self::new("N/m", "a surface tension", "72.8 mN/m", [0, 1, -2, 0]),
        Self::new("N s/m", "a dashpot coefficient", "2.95e-3 N s/m", [0, 1, -1, 0]),
        Self::new("rad", "an angle", "30 deg", [0, 0, 0, 1]),
        Self::new("rad/s", "an angular velocity", "10 rad/s", [0, 0, -1, 1]),
        Self::new("Hz", "a frequency", "2 Hz", [0, 0, -1, 0]),
    ];

    const fn new(unit: &'static str, name: &'static str, example: &'static str, powers: [i8; 4]) -> Self {
        let [length, mass, time, angle] = powers;
        Self { unit, name, example, dimension: Dimension::new(length, mass, time, angle) }
    }

    /// The kind with that SI unit, the first of several, and that name where one is given; an unknown one does not compile.
    #[must_use]
    pub const fn of(unit: &str, name: Option<&str>) -> Self {
        let mut n = 0;
        while n < Self::ALL.len() {
            let kind = Self::ALL[n];
            let is_named = match name {
                Some(name) => same(kind.name.as_bytes(), name.as_bytes()),
                None => true,
            };
            if is_named && same(kind.unit.as_bytes(), unit.as_bytes()) {
                return kind;
            }
            n += 1;
        }
        panic!("no quantity of a key has this unit and name: add it to `Quantity::ALL`")
    }

    /// The unit of the example, as people would write it.
    pub(crate) fn common_unit(self) -> &'static str {
        self.example.split_once(' ').map_or(self.unit, |(_, unit)| unit)
    }
}

const fn same(a: &[u8], b: &[u8]) -> bool {
    let mut n = 0;
    while n < a.len() && n < b.len() && a[n] == b[n] {
        n += 1;
    }
    n == a.len() && n == b.len()
}

/// A number for people, to four digits and without what does not count.
#[must_use]
pub fn rounded(value: Real) -> String {
    let short: Real = format!("{value:.3e}").parse().unwrap_or(value);
    if short == 0.0 || (1e-3..1e6).contains(&short.abs()) { format!("{short}") } else { format!("{short:e}") }
}

/// A value and its uncertainty for people, to the two digits that the uncertainty has.
#[must_use]
pub fn with_bar(value: Real, bar: Real) -> [String; 2] {
    let short: Real = format!("{bar:.1e}").parse().unwrap_or(bar);
    let digits = if short > 0.0 { (1.0 - short.log10().floor()).clamp(0.0, 9.0) } else { 2.0 };
    [value, bar].map(|amount| format!("{amount:.*}", digits as usize))
}

/// Relative distance within which a value equals an end of a range: round-off of numbers that are written and computed.
pub(crate) const SAME: Real = 1e-9;

/// The ends of a range for people, as [`rounded`], but never beyond it.
#[must_use]
pub(crate) fn rounded_within(low: Real, high: Real) -> [String; 2] {
    let inward = |value: Real, direction: Real| {
        let short: Real = format!("{value:.3e}").parse().unwrap_or(value);
        let beyond = direction * (value - short) > SAME * value.abs();
        let digit = 10_f64.powf(value.abs().log10().floor() - 3.0);
        rounded(if beyond { short + direction * digit } else { short })
    };
    [inward(low, 1.0), inward(high, -1.0)]
}

/// Why a text is no quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitError {
    /// The problem.
    pub message: String,
    /// One thing to try.
    pub suggestion: Option<String>,
    /// Bytes of the text that are wrong.
    pub range: Range<usize>,
}

/// Reads a quantity: its value in SI units and its dimension. The unit may be absent (a pure number).
///
/// # Errors
/// If the number, the unit or their order cannot be understood.
pub fn parse_quantity(text: &str) -> Result<(Real, Dimension), UnitError> {
    let start = text.len() - text.trim_start().len();
    let (mantissa, exponent, unit_start) = split_number(text, start)?;
    let mut reader = UnitReader { text, start: unit_start, position: unit_start, brackets: 0 };
    let unit = reader.product(false)?;
    if reader.position < text.len() {
        return Err(reader.error_here("this does not belong to a unit"));
    }
    let shifted = format!("{mantissa}e{}", exponent.saturating_add(unit.decimal));
    let value: Real = shifted.parse().map_err(|_| UnitError {
        message: format!("`{mantissa}` is not a number"),
        suggestion: None,
        range: start..unit_start,
    })?;
    let value = if unit.factor == 1.0 { value } else { value * unit.factor };
    if !value.is_finite() {
        return Err(UnitError {
            message: "the value is not finite".into(),
            suggestion: None,
            range: start..text.len(),
        });
    }
    Ok((value, unit.dimension))
}

/// Splits the number off the front of `text[start..]`: its digits, its exponent, and where the unit begins.
fn split_number(text: &str, start: usize) -> Result<(&str, i32, usize), UnitError> {
    let bytes = text.as_bytes();
    let digits_from = |mut i: usize| {
        while i < bytes.len() && bytes[i].is_ascii_digit() {
            i += 1;
        }
        i
    };
    let mut end = start;
    if matches!(bytes.get(end), Some(b'+' | b'-')) {
        end += 1;
    }
    let whole = digits_from(end);
    let mut count = whole - end;
    end = whole;
    if bytes.get(end) == Some(&b'.') {
        let decimals = digits_from(end + 1);
        count += decimals - end - 1;
        end = decimals;
    }
    if count == 0 {
        return Err(UnitError {
            message: "a quantity begins with a number".into(),
            suggestion: None,
            range: start..text.len().max(start + 1),
        });
    }
    let mantissa = &text[start..end];
    if bytes.get(end) == Some(&b',') && bytes.get(end + 1).is_some_and(u8::is_ascii_digit) {
        return Err(decimal_comma(text, start, end));
    }
    let mut exponent = 0;
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let last = digits_from(end + 1 + sign);
        if last > end + 1 + sign {
            exponent = text[end + 1..last].parse().map_err(|_| UnitError {
                message: "the exponent is too large".into(),
                suggestion: None,
                range: end..last,
            })?;
            end = last;
        }
    }
    Ok((mantissa, exponent, end))
}

/// What is meant by a number with commas: one alone is taken for a decimal point.
pub(crate) fn without_commas(number: &str) -> String {
    let is_alone = number.matches(',').count() == 1 && !number.contains('.');
    number.replace(',', if is_alone { "." } else { "" })
}

/// Of a number with a comma at byte `comma`, as people write it whose decimals follow a comma or whose thousands do.
fn decimal_comma(text: &str, start: usize, comma: usize) -> UnitError {
    let rest = &text[comma..];
    let of_number = |c: char| !(c.is_ascii_digit() || matches!(c, ',' | '.'));
    let end = comma + rest.find(of_number).unwrap_or(rest.len());
    let number = &text[start..end];
    let meant = format!("{}{}", without_commas(number), &text[end..]);
    UnitError {
        message: "decimals follow a decimal point, not a comma, and thousands have no mark".into(),
        suggestion: Some(format!("write `\"{}\"`", meant.trim_end())),
        range: start..end,
    }
}

/// A unit as a power of ten, a factor that is no power of ten, and a dimension.
#[derive(Clone, Copy, Debug)]
struct Unit {
    decimal: i32,
    factor: Real,
    dimension: Dimension,
}

impl Unit {
    const ONE: Self = Self { decimal: 0, factor: 1.0, dimension: Dimension::NONE };

    /// `None` where a power is beyond reason.
    fn times(self, other: Self, power: i8) -> Option<Self> {
        let decimal = i32::from(power).checked_mul(other.decimal)?;
        Some(Self {
            decimal: self.decimal.checked_add(decimal)?,
            factor: if other.factor == 1.0 { self.factor } else { self.factor * other.factor.powi(i32::from(power)) },
            dimension: self.dimension.times(other.dimension, power)?,
        })
    }
}

/// Length \[bytes] of an exponent that stands directly behind a unit: digits, with a sign, or behind `**` of other languages.
fn bare_exponent(text: &str) -> Option<usize> {
    let stars = text.strip_prefix("**").map_or(0, |_| "**".len());
    let sign = usize::from(text[stars..].starts_with(['-', '+']));
    let rest = &text[stars + sign..];
    let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    (digits > 0).then_some(stars + sign + digits)
}

/// A unit with `^` before each of its exponents.
fn with_carets(unit: &str) -> String {
    let mut meant = String::new();
    let mut after_symbol = false;
    for (at, c) in unit.char_indices() {
        if after_symbol && bare_exponent(&unit[at..]).is_some() {
            meant.push('^');
        }
        after_symbol = c.is_alphabetic() || matches!(c, '%' | '°' | ')');
        meant.push(c);
    }
    meant.replace("^**", "^")
}

struct UnitReader<'a> {
    text: &'a str,
    /// Where the unit begins.
    start: usize,
    position: usize,
    /// Brackets that are open.
    brackets: usize,
}

/// Brackets within each other that a unit may have.
const MOST_BRACKETS: usize = 8;

impl UnitReader<'_> {
    fn rest(&self) -> &str {
        &self.text[self.position..]
    }

    fn skip_space(&mut self) {
        self.position += self.rest().len() - self.rest().trim_start().len();
    }

    fn error_here(&self, message: &str) -> UnitError {
        let end = self.text.trim_end().len().max(self.position + 1);
        UnitError { message: message.into(), suggestion: None, range: self.position..end }
    }

    /// `factor (("*" | "/" | " ") factor)*`, up to the end of the text or a closing bracket.
    fn product(&mut self, bracketed: bool) -> Result<Unit, UnitError> {
        let mut unit = Unit::ONE;
        let mut divided = false;
        let mut first = true;
        loop {
            self.skip_space();
            let Some(next) = self.rest().chars().next() else { return Ok(unit) };
            if bracketed && next == ')' {
                return Ok(unit);
            }
            let sign = match next {
                '/' => -1,
                '*' | '·' => 1,
                _ => 0,
            };
            if sign != 0 {
                if first && sign > 0 {
                    return Err(self.error_here("a unit is missing before this"));
                }
                self.position += next.len_utf8();
                self.skip_space();
            } else if divided {
                let mut error = self.error_here("is this above or below the fraction line?");
                error.suggestion = Some("put brackets round what is below, `N/(m s)`, or write `*`".into());
                return Err(error);
            }
            let power = if sign < 0 { -1 } else { 1 };
            divided = sign < 0 || (divided && sign == 0);
            let begin = self.position;
            let factor = self.factor()?;
            unit = unit.times(factor, power).ok_or_else(|| self.beyond_reason(begin))?;
            first = false;
        }
    }

    /// `symbol`, `symbol^n`, `symbol²`, `1` or a bracket.
    fn factor(&mut self) -> Result<Unit, UnitError> {
        let start = self.position;
        if self.rest().starts_with('(') {
            if self.brackets == MOST_BRACKETS {
                return Err(self.error_here("too many brackets within each other"));
            }
            self.position += 1;
            self.brackets += 1;
            let inner = self.product(true)?;
            self.brackets -= 1;
            if !self.rest().starts_with(')') {
                return Err(self.error_here("a closing bracket is missing"));
            }
            self.position += 1;
            let power = self.power()?;
            return Unit::ONE.times(inner, power).ok_or_else(|| self.beyond_reason(start));
        }
        if self.rest().starts_with('1') {
            self.position += 1;
            return Ok(Unit::ONE);
        }
        let length =
            self.rest().find(|c: char| !(c.is_alphabetic() || c == '%' || c == '°')).unwrap_or(self.rest().len());
        let symbol = self.rest()[..length].to_owned();
        if symbol.is_empty() || symbol.starts_with(['²', '³']) {
            return Err(self.error_here("a unit is expected here"));
        }
        self.position += length;
        let unit = unit_named(&symbol).ok_or_else(|| UnitError {
            message: format!("`{symbol}` is not a unit known here"),
            suggestion: crate::suggest::nearest(&symbol, COMMON_UNITS.iter().copied())
                .map(|unit| format!("did you mean `{unit}`?")),
            range: start..start + length,
        })?;
        let power = self.power()?;
        Unit::ONE.times(unit, power).ok_or_else(|| self.beyond_reason(start))
    }

    /// Of an exponent of `length` bytes that stands here without `^`.
    fn missing_caret(&self, length: usize) -> UnitError {
        UnitError {
            message: "an exponent follows `^`".into(),
            suggestion: Some(format!("write `{}`", with_carets(self.text[self.start..].trim()))),
            range: self.position..self.position + length,
        }
    }

    /// `^n`, a superscript, or nothing (1).
    fn power(&mut self) -> Result<i8, UnitError> {
        const SUPERSCRIPTS: [char; 12] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹', '⁻', '⁺'];
        let start = self.position;
        let mut digits = String::new();
        if self.rest().starts_with('^') {
            self.position += 1;
            let rest = self.rest();
            let sign = usize::from(rest.starts_with(['-', '+']));
            let length = rest[sign..].find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len() - sign) + sign;
            digits.push_str(&rest[..length]);
            self.position += length;
        } else {
            while let Some(c) = self.rest().chars().next() {
                let Some(n) = SUPERSCRIPTS.iter().position(|&s| s == c) else { break };
                digits.push(['0', '1', '2', '3', '4', '5', '6', '7', '8', '9', '-', '+'][n]);
                self.position += c.len_utf8();
            }
            if digits.is_empty() {
                return bare_exponent(self.rest()).map_or(Ok(1), |length| Err(self.missing_caret(length)));
            }
        }
        digits.parse::<i8>().ok().filter(|n| (-9..=9).contains(n)).ok_or_else(|| self.beyond_reason(start))
    }

    /// That the power of a unit which begins at byte `start` is none.
    fn beyond_reason(&self, start: usize) -> UnitError {
        UnitError {
            message: "the power of a unit is a small whole number".into(),
            suggestion: Some("for example `m^2` or `s^-1`".into()),
            range: start..self.position.max(start + 1),
        }
    }
}

/// Symbols offered as corrections.
const COMMON_UNITS: [&str; 37] = [
    "m", "km", "cm", "mm", "um", "nm", "kg", "g", "mg", "ug", "t", "s", "ms", "us", "ns", "min", "h", "N", "mN", "kN",
    "dyn", "Pa", "hPa", "kPa", "MPa", "bar", "J", "mJ", "W", "Hz", "kHz", "L", "mL", "P", "cP", "deg", "rad",
];

/// The unit of that symbol, with or without a prefix.
fn unit_named(symbol: &str) -> Option<Unit> {
    if let Some(unit) = plain_unit(symbol) {
        return Some(unit);
    }
    let first = symbol.chars().next()?;
    let decimal = match first {
        'T' => 12,
        'G' => 9,
        'M' => 6,
        'k' => 3,
        'h' => 2,
        'd' => -1,
        'c' => -2,
        'm' => -3,
        'u' | 'µ' | 'μ' => -6,
        'n' => -9,
        'p' => -12,
        _ => return None,
    };
    let base = &symbol[first.len_utf8()..];
    let takes_prefix =
        matches!(base, "m" | "g" | "s" | "N" | "Pa" | "J" | "W" | "Hz" | "L" | "l" | "P" | "St" | "rad" | "bar");
    let unit = plain_unit(base).filter(|_| takes_prefix)?;
    Some(Unit { decimal: unit.decimal + decimal, ..unit })
}

/// The unit of that symbol, without prefixes.
fn plain_unit(symbol: &str) -> Option<Unit> {
    let (length, mass, time, angle, decimal, factor) = match symbol {
        "m" => (1, 0, 0, 0, 0, 1.0),
        "g" => (0, 1, 0, 0, -3, 1.0),
        "t" => (0, 1, 0, 0, 3, 1.0),
        "s" => (0, 0, 1, 0, 0, 1.0),
        "min" => (0, 0, 1, 0, 0, 60.0),
        "h" => (0, 0, 1, 0, 0, 3600.0),
        "d" => (0, 0, 1, 0, 0, 86_400.0),
        "N" => (1, 1, -2, 0, 0, 1.0),
        "dyn" => (1, 1, -2, 0, -5, 1.0),
        "Pa" => (-1, 1, -2, 0, 0, 1.0),
        "bar" => (-1, 1, -2, 0, 5, 1.0),
        "J" => (2, 1, -2, 0, 0, 1.0),
        "W" => (2, 1, -3, 0, 0, 1.0),
        "Hz" => (0, 0, -1, 0, 0, 1.0),
        "L" | "l" => (3, 0, 0, 0, -3, 1.0),
        "P" => (-1, 1, -1, 0, -1, 1.0),
        "St" => (2, 0, -1, 0, -4, 1.0),
        "rad" => (0, 0, 0, 1, 0, 1.0),
        "deg" | "°" => (0, 0, 0, 1, 0, std::f64::consts::PI / 180.0),
        "%" => (0, 0, 0, 0, -2, 1.0),
        _ => return None,
    };
    Some(Unit { decimal, factor, dimension: Dimension { length, mass, time, angle } })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Real {
        parse_quantity(text).unwrap().0
    }

    #[test]
    fn ends_of_a_range_are_told_within_it() {
        let told = |low: Real, high: Real| rounded_within(low, high);
        assert_eq!(told(0.0, 12.3456), ["0", "12.34"]);
        assert_eq!(told(3.0864, 1e300), ["3.087", "1e300"]);
        assert_eq!(told(-1.23449, -1.23451), ["-1.234", "-1.235"]);
        // What was lost in computing an end is no reason to shorten it.
        assert_eq!(told(0.1, 0.45 * 0.12), ["0.1", "0.054"]);
        assert_eq!(told(0.0, Real::INFINITY)[0], "0");
    }

    #[test]
    fn decimal_prefixes_are_exact() {
        assert_eq!(value("0.52 mm"), 0.52e-3);
        assert_eq!(value("72 mN/m"), 72e-3);
        assert_eq!(value("72.8 dyn/cm"), 72.8e-3);
        assert_eq!(value("5.537mm"), 5.537e-3);
        assert_eq!(value("1.0 g/cm^3"), 1000.0);
        assert_eq!(value("0.1 mm^3"), 0.1e-9);
        assert_eq!(value("1e-6 m^2/s"), 1e-6);
        assert_eq!(value("1 cSt"), 1e-6);
        assert_eq!(value("3 us"), 3e-6);
        assert_eq!(value("3 µs"), 3e-6);
        assert_eq!(value("80 g cm/s"), 80e-5);
        assert_eq!(value("-9.8 m/s²"), -9.8);
    }

    #[test]
    fn other_factors_are_applied_after_rounding() {
        assert_eq!(value("10 min"), 600.0);
        assert_eq!(value("30 deg"), 30.0 * (std::f64::consts::PI / 180.0));
        assert_eq!(value("36 km/h"), 36e3 * 3600.0_f64.powi(-1));
        assert_eq!(value("45 %"), 0.45);
    }

    #[test]
    fn dimensions_follow_the_units() {
        let dimension = |text| parse_quantity(text).unwrap().1;
        assert_eq!(dimension("1 Pa s"), Dimension::new(-1, 1, -1, 0));
        assert_eq!(dimension("1 N s/m"), Dimension::new(0, 1, -1, 0));
        assert_eq!(dimension("1 kg/(m s)"), Dimension::new(-1, 1, -1, 0));
        assert_eq!(dimension("1/s"), Dimension::new(0, 0, -1, 0));
        assert_eq!(dimension("1 s^-1"), Dimension::new(0, 0, -1, 0));
        assert_eq!(dimension("2.5"), Dimension::NONE);
        assert_eq!(Dimension::new(1, 1, -2, 0).to_string(), "kg m s^-2");
    }

    #[test]
    fn mistakes_are_named() {
        let error = |text: &str| parse_quantity(text).unwrap_err();
        assert_eq!(error("3 mmm").message, "`mmm` is not a unit known here");
        assert_eq!(error("3 mmm").range, 2..5);
        assert_eq!(error("3 Mm/sec").suggestion.as_deref(), Some("did you mean `s`?"));
        assert_eq!(error("mm").message, "a quantity begins with a number");
        assert!(error("1 N/m s").message.contains("fraction line"));
        let meant = |text: &str| error(text).suggestion.unwrap();
        assert!(error("0,02 s").message.contains("decimal point") && error("0,02 s").range == (0..4));
        assert_eq!([meant("0,02 s"), meant("-1,5e-3 m/s")], ["write `\"0.02 s\"`", "write `\"-1.5e-3 m/s\"`"]);
        assert_eq!([meant("1,000.5 mm"), meant("1,000,000 mm")], ["write `\"1000.5 mm\"`", "write `\"1000000 mm\"`"]);
        for (text, unit, range) in [
            ("2650 kg/m3", "kg/m^3", 9..10),
            ("9.8 m/s2", "m/s^2", 7..8),
            ("9.8 m s-2", "m s^-2", 7..9),
            ("9.8 m/s**2", "m/s^2", 7..10),
            ("1e-6 m2/s", "m^2/s", 6..7),
            ("1 kg**1/(m s2)3", "kg^1/(m s^2)^3", 4..7),
        ] {
            let error = error(text);
            assert_eq!((&error.message[..], error.range), ("an exponent follows `^`", range), "{text}");
            assert_eq!(error.suggestion, Some(format!("write `{unit}`")));
        }
        // Negative controls: exponents behind `^`, and numbers that are none.
        let same = |a: &str, b: &str| assert_eq!(parse_quantity(a).unwrap(), parse_quantity(b).unwrap());
        same("2650 kg/m^3", "2650 kg m^-3");
        same("9.8 m/s²", "9.8 m*s^-2");
        same("3 m 1/s", "3 m/s");
        assert!(error("1 m^").message.contains("whole number"));
        assert!(error("1 (m").message.contains("bracket"));
        assert!(error("1e999 m").message.contains("finite"));
        assert!(error("1e2147483647 km").message.contains("finite"));
        assert!(error(&format!("1 {}m", "(".repeat(100_000))).message.contains("brackets"));
        assert_eq!(value("1 ((((m))))"), 1.0, "negative control");
        for wide in ["1 (m^9)^9/((m^9)^9)^9", "1 ((m^9)^9)^9", "1 s^-128"] {
            assert!(error(wide).message.contains("small whole number"), "{wide}");
        }
    }

    #[test]
    fn an_uncertainty_has_two_digits_and_its_value_no_more() {
        let text = |value: Real, bar: Real| with_bar(value, bar).join(" +- ");
        assert_eq!(
            [text(936.83, 7.391), text(70.033, 0.9997), text(97.14, 9.53)],
            ["936.8 +- 7.4", "70.0 +- 1.0", "97.1 +- 9.5"]
        );
        assert_eq!(
            [text(113.6, 10.9), text(2345.6, 213.0), text(0.4, 0.0)],
            ["114 +- 11", "2346 +- 213", "0.40 +- 0.00"]
        );
    }
}
