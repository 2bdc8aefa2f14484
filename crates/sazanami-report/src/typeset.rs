//! Quantities as they are set in print.

use sazanami_picture::superscript;

/// A text with powers raised, `+-` as one sign, micro as its letter, powers of ten written out, and the indices of directions and of H_s
/// lowered. What stands between backticks stays as it is.
pub fn typeset(text: &str) -> String {
    let of_part = |(n, part): (usize, &str)| if n % 2 == 0 { typeset_part(part) } else { part.to_owned() };
    text.split('`').enumerate().map(of_part).collect::<Vec<_>>().join("`")
}

fn typeset_part(text: &str) -> String {
    let mut set = String::with_capacity(text.len());
    let (mut at, mut before) = (0, ' ');
    while let Some(letter) = text[at..].chars().next() {
        at += letter.len_utf8();
        let rest = &text[at..];
        let begins = !(before.is_alphanumeric() || matches!(before, '_' | '.' | '/'));
        let lowered = INDEXED.iter().find(|(word, _)| begins && is_word(&text[at - letter.len_utf8()..], word));
        if let Some((word, indexed)) = lowered {
            set.push_str(indexed);
            at += word.len() - letter.len_utf8();
            before = 'x';
            continue;
        }
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

/// Words with an index, and how they are printed.
const INDEXED: [(&str, &str); 4] = [("x1", "x₁"), ("x2", "x₂"), ("x3", "x₃"), ("H_s", "Hₛ")];

/// Units that stand behind a `u` for micro.
const UNITS_OF_MICRO: [&str; 7] = ["m", "s", "g", "N", "J", "Pa", "L"];

/// Whether a text begins with a word that ends there.
fn is_word(text: &str, word: &str) -> bool {
    text.strip_prefix(word).is_some_and(|rest| !rest.starts_with(|next: char| next.is_alphanumeric() || next == '_'))
}

/// The whole number that a text begins with, unless letters or the end of a file's name follow it, and its length.
fn whole(text: &str) -> Option<(i32, usize)> {
    let sign = usize::from(text.starts_with(['+', '-']));
    let digits = text[sign..].find(|letter: char| !letter.is_ascii_digit()).unwrap_or(text.len() - sign);
    let (number, rest) = text.split_at(sign + digits);
    let number = number.parse().ok()?;
    let is_name = |next: char| next.is_alphabetic() || next == '_';
    let goes_on = rest.starts_with(is_name) || rest.strip_prefix('.').is_some_and(|rest| rest.starts_with(is_name));
    (!goes_on).then_some((number, sign + digits))
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
            (
                "at time 5.0000e-3 s the bed `bed_1e5` of beds/2e5.bed",
                "at time 5.0000 × 10⁻³ s the bed `bed_1e5` of beds/2e5.bed",
            ),
            (
                "bed: height H_s, along x3 and x1; x1_lower, `x2`, max1",
                "bed: height Hₛ, along x₃ and x₁; x1_lower, `x2`, max1",
            ),
        ] {
            assert_eq!(typeset(written), expected);
        }
    }
}
