//! Quantities as they are set in print.

use sazanami::case::units::parse_quantity;
use sazanami_picture::superscript;

/// A text with powers raised, `+-` as one sign, micro as its letter and powers of ten written out.
pub fn typeset(text: &str) -> String {
    let mut set = String::with_capacity(text.len());
    let (mut at, mut before) = (0, ' ');
    while let Some(letter) = text[at..].chars().next() {
        at += letter.len_utf8();
        let rest = &text[at..];
        let is_micro = || !before.is_alphanumeric() && UNITS_OF_MICRO.iter().any(|unit| is_word(rest, unit));
        match (letter, whole(rest)) {
            ('+', _) if rest.starts_with('-') => {
                set.push('±');
                at += 1;
            }
            ('^', Some((power, length))) => {
                set.push_str(&superscript(power));
                at += length;
            }
            ('e', Some((power, length))) if before.is_ascii_digit() => {
                set.push_str(" × 10");
                set.push_str(&superscript(power));
                at += length;
            }
            ('u', _) if is_micro() => set.push('µ'),
            _ => set.push(letter),
        }
        before = letter;
    }
    set
}

/// The value of a key, set in print where it is a quantity or a list of quantities; names stay as they are.
pub fn value(text: &str) -> String {
    let parts = text.trim_matches(['[', ']', ' ']).split(", ");
    if parts.clone().all(|part| parse_quantity(part).is_ok()) { typeset(text) } else { text.to_owned() }
}

/// Units that stand behind a `u` for micro.
const UNITS_OF_MICRO: [&str; 7] = ["m", "s", "g", "N", "J", "Pa", "L"];

/// Whether a text begins with a word that ends there.
fn is_word(text: &str, word: &str) -> bool {
    text.strip_prefix(word).is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
}

/// The whole number that a text begins with, unless letters follow it, and its length.
fn whole(text: &str) -> Option<(i32, usize)> {
    let sign = usize::from(text.starts_with(['+', '-']));
    let digits = text[sign..].find(|letter: char| !letter.is_ascii_digit()).unwrap_or(text.len() - sign);
    let (number, rest) = text.split_at(sign + digits);
    let number = number.parse().ok()?;
    (!rest.starts_with(char::is_alphabetic)).then_some((number, sign + digits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_are_set_in_print() {
        for (written, expected) in [
            ("61.27 +- 3.04 mm^3 (not reliable: at rest)", "61.27 ± 3.04 mm³ (not reliable: at rest)"),
            ("-7.0e-7", "-7.0 × 10⁻⁷"),
            ("1e+06 m^2/s", "1 × 10⁶ m²/s"),
            ("9.8 m s^-2, 3 um, 4 us", "9.8 m s⁻², 3 µm, 4 µs"),
            ("V ~ (m v)^0.5, 2 umbrellas, step 3", "V ~ (m v)⁰.5, 2 umbrellas, step 3"),
            ("1.5e3x and he4", "1.5e3x and he4"),
        ] {
            assert_eq!(typeset(written), expected);
        }
    }

    #[test]
    fn names_stay_as_they_are() {
        assert_eq!(value("1e-6 m^2/s"), "1 × 10⁻⁶ m²/s");
        assert_eq!(value("[0, 0, -9.8 m/s^2]"), "[0, 0, -9.8 m/s²]");
        assert_eq!(value("beds/2e5.bed"), "beds/2e5.bed");
        assert_eq!(value("a^2"), "a^2");
    }
}
