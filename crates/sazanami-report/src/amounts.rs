//! Amounts in the unit in which they are read best.

use sazanami::case::units::parse_quantity;

use crate::typeset::typeset;

/// Smaller units by the SI unit, with the factors to them, from large to small.
const SMALLER: &[(&str, &[(&str, f64)])] = &[
    ("m", &[("mm", 1e3), ("um", 1e6), ("nm", 1e9)]),
    ("s", &[("ms", 1e3), ("us", 1e6)]),
    ("m/s", &[("mm/s", 1e3)]),
    ("m^2/s", &[("mm^2/s", 1e6)]),
    ("m^3", &[("mm^3", 1e9)]),
    ("kg", &[("g", 1e3), ("mg", 1e6), ("ug", 1e9)]),
    ("J", &[("mJ", 1e3), ("uJ", 1e6), ("nJ", 1e9)]),
    ("N", &[("mN", 1e3), ("uN", 1e6)]),
    ("N/m", &[("mN/m", 1e3)]),
    ("N s", &[("mN s", 1e3), ("uN s", 1e6)]),
    ("N s/m", &[("mN s/m", 1e3)]),
    ("Pa s", &[("mPa s", 1e3), ("uPa s", 1e6)]),
];

/// A unit in which the largest of `values` \[SI] is at least 1 where there is one, and the factor to it. Millimetres go down to a tenth, as
/// grains are spoken of; angles are in degrees.
pub fn readable(unit: &str, values: &[f64]) -> (String, f64) {
    if unit == "rad" {
        return ("°".into(), 1_f64.to_degrees());
    }
    let largest = values.iter().map(|value| value.abs()).filter(|value| value.is_finite()).fold(0.0, f64::max);
    let smaller = SMALLER.iter().find(|(of, _)| *of == unit).map_or(&[][..], |(_, smaller)| smaller);
    // What is 1 but for round-off is 1.
    let fits = |name: &str, factor: f64| largest * factor >= if name == "mm" { 0.1 } else { 1.0 } - 1e-9;
    if largest == 0.0 || fits(unit, 1.0) {
        return (typeset(unit), 1.0);
    }
    let found = smaller.iter().find(|(name, factor)| fits(name, *factor)).or(smaller.last());
    found.map_or((typeset(unit), 1.0), |(name, factor)| (typeset(name), *factor))
}

/// A value \[SI] to four digits with its unit.
pub fn amount(value: f64, unit: &str) -> String {
    let (unit, factor) = readable(unit, &[value]);
    with_unit(&rounded(factor * value), &unit)
}

fn with_unit(number: &str, unit: &str) -> String {
    if matches!(unit, "" | "°") { format!("{number}{unit}") } else { format!("{number} {unit}") }
}

/// A number for people: four digits, a dash where there is none.
pub fn rounded(value: f64) -> String {
    if value.is_finite() { shortest(value, 4) } else { "–".into() }
}

/// A number to so many digits, without those that say nothing; very small and very large ones with a power of ten.
fn shortest(value: f64, digits: usize) -> String {
    let short: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    match short.abs() {
        0.0 => "0".into(),
        1e-3..1e6 => short.to_string(),
        _ => typeset(&format!("{short:e}")),
    }
}

/// The quantities of a number, a text or a list of them, as a case has them: values and their unit, the same for all.
pub fn quantities(value: &str) -> Option<(Vec<f64>, String)> {
    let part = |text: &str| {
        let text = text.trim().trim_matches('"');
        parse_quantity(text).ok()?;
        let (number, unit) = text.split_once(' ').unwrap_or((text, ""));
        Some((number.parse::<f64>().ok()?, unit.to_owned()))
    };
    let parts: Vec<(f64, String)> = value.trim_matches(['[', ']', ' ']).split(',').map(part).collect::<Option<_>>()?;
    let unit = parts.first()?.1.clone();
    parts.iter().all(|part| part.1 == unit).then(|| (parts.into_iter().map(|(value, _)| value).collect(), unit))
}

/// The value of a `key`, as a copy of a case has it, for people: its quantities in the units in which they are read best, names as they are.
pub fn of_key(key: &str, value: &str) -> String {
    if ["name", "title"].contains(&key.rsplit('.').next().unwrap_or(key)) {
        return value.trim_matches('"').to_owned();
    }
    let (mut set, mut rest) = (String::with_capacity(value.len()), value);
    while let Some(first) = rest.chars().next() {
        let is_inside = set.ends_with(|before: char| before.is_alphanumeric() || before == '_');
        let end = match first {
            '[' => rest.find(']').map(|end| end + 1),
            '"' => rest[1..].find('"').map(|end| end + 2),
            '-' | '0'..='9' if !is_inside => rest.find([',', ' ', ']', '}']).or(Some(rest.len())),
            _ => None,
        };
        let whole = end.map(|end| rest.split_at(end));
        match whole.and_then(|(part, after)| Some((quantity_of_key(part)?, after))) {
            Some((told, after)) => {
                set.push_str(&told);
                rest = after;
            }
            None => {
                // A text that is no quantity stays as it is, without its quotes.
                let length = end.filter(|_| first == '"').unwrap_or(first.len_utf8());
                set.push_str(rest[..length].trim_matches('"'));
                rest = &rest[length..];
            }
        }
    }
    set
}

/// A quantity or a list of quantities of one unit; `None` if it is neither.
fn quantity_of_key(text: &str) -> Option<String> {
    /// More than anyone gives, and fewer than the round-off of units has.
    const DIGITS: usize = 9;
    let (values, unit) = quantities(text)?;
    // Whole numbers are counts and seeds, with all their digits; a quoted number is a name.
    if unit.is_empty() && (text.contains('"') || !text.contains(['.', 'e'])) {
        return Some(text.replace('"', ""));
    }
    let (unit, factor) = readable(&unit, &values);
    let told: Vec<String> = values.iter().map(|value| shortest(factor * value, DIGITS)).collect();
    let told = told.join(", ");
    Some(with_unit(&if text.starts_with('[') { format!("[{told}]") } else { told }, &unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_to_four_digits() {
        for (value, expected) in [
            (68.75013, "68.75"),
            (0.0, "0"),
            (1200.0, "1200"),
            (7.15e-13, "7.15 × 10⁻¹³"),
            (-0.5, "-0.5"),
            (f64::NAN, "–"),
        ] {
            assert_eq!(rounded(value), expected);
        }
    }

    #[test]
    fn quantities_have_their_units() {
        assert_eq!(quantities("\"0.003 m\""), Some((vec![0.003], "m".into())));
        assert_eq!(quantities("0.45"), Some((vec![0.45], String::new())));
        assert_eq!(quantities("[\"3.0 m/s\", \"-4.0 m/s\"]"), Some((vec![3.0, -4.0], "m/s".into())));
        assert_eq!(quantities("\"plic\""), None);
        assert_eq!(quantities("[\"1 m\", \"1 s\"]"), None);
    }

    #[test]
    fn keys_are_told_in_the_units_in_which_they_are_read_best() {
        for (written, expected) in [
            ("1e-10", "1 × 10⁻¹⁰"),
            ("0.0000000001", "1 × 10⁻¹⁰"),
            ("0.45", "0.45"),
            ("\"0.00052 m\"", "0.52 mm"),
            ("\"0.001 m\"", "1 mm"),
            ("\"0.00005 m\"", "50 µm"),
            ("\"60.0 s\"", "60 s"),
            ("\"2000.0 N/m\"", "2000 N/m"),
            ("\"1000.0 kg/m^3\"", "1000 kg/m³"),
            ("\"1e-5 Pa s\"", "10 µPa s"),
            ("\"0.0728 N/m\"", "72.8 mN/m"),
            ("\"0.5235987755982988 rad\"", "30°"),
            ("[\"0.018 m\", \"0.018 m\", \"0.0102 m\"]", "[18, 18, 10.2] mm"),
            ("[\"0.0 m/s\", \"0.0 m/s\", \"-4.5 m/s\"]", "[0, 0, -4.5] m/s"),
            ("[60, 60, 34]", "[60, 60, 34]"),
            ("[]", "[]"),
            ("12345678901", "12345678901"),
            (
                "[{ factor = 1.0, position = [\"0.05 m\", \"0.025 m\"], motion = \"free\" }]",
                "[{ factor = 1, position = [50, 25] mm, motion = free }]",
            ),
        ] {
            assert_eq!(of_key("key", written), expected);
        }
    }

    #[test]
    fn names_stay_as_they_are() {
        for (written, expected) in [
            ("\"beds/2e5.bed\"", "beds/2e5.bed"),
            ("\"a^2\"", "a^2"),
            ("\"007\"", "007"),
            ("true", "true"),
            ("[\"x1_lower\", \"x1_upper\"]", "[x1_lower, x1_upper]"),
            ("\"axis(9)\"", "axis(9)"),
        ] {
            assert_eq!(of_key("key", written), expected);
        }
        // A population may be called by its size.
        for key in ["name", "grains.0.name", "title"] {
            assert_eq!(of_key(key, "\"2.0 mm\""), "2.0 mm");
        }
        assert_eq!(of_key("grains.0.size", "\"2.0 mm\""), "2 mm");
    }
}
