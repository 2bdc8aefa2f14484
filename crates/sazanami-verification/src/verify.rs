//! Verification and validation cases: measured values beside references, with a band and a verdict.

use std::collections::BTreeSet;
use std::time::Instant;

use sazanami_numerics::Real;
use serde::Serialize;

use crate::measured::Measured;

use sazanami::error::CommandError;
use sazanami::progress::Progress;

/// Whether a measured value lies where it should.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Within the band.
    Pass,
    /// Outside the band.
    Fail,
    /// There is no band: told for information.
    Info,
}

/// One measured quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerifyRow {
    /// Name of the case.
    pub case: String,
    /// What was measured.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// Measured value.
    pub measured: Real,
    /// Reference, if there is one.
    pub reference: Option<Real>,
    /// Lower end of the band.
    pub low: Option<Real>,
    /// Upper end of the band.
    pub high: Option<Real>,
    /// Whether it lies within the band.
    pub verdict: Verdict,
    /// Wall-clock time of the whole case [s].
    pub seconds: Real,
    /// Where the reference comes from.
    pub source: String,
}

fn judged(measured: Measured, case: &str, seconds: Real) -> VerifyRow {
    let verdict = match measured.band {
        None => Verdict::Info,
        Some([low, high]) if measured.value >= low && measured.value <= high => Verdict::Pass,
        Some(_) => Verdict::Fail,
    };
    let end = |n: usize| measured.band.map(|band| band[n]).filter(|end| end.is_finite());
    VerifyRow {
        case: case.to_owned(),
        quantity: measured.quantity,
        unit: measured.unit.to_owned(),
        measured: measured.value,
        reference: measured.reference,
        low: end(0),
        high: end(1),
        verdict,
        seconds,
        source: measured.source.to_owned(),
    }
}

/// A verification case: a program that measures.
#[derive(Clone, Copy, Debug)]
pub struct VerifyCase {
    /// Name on the command line.
    pub name: &'static str,
    /// What it shows, in one line.
    pub about: &'static str,
    /// Whether it runs only with `--long`.
    pub long: bool,
    /// Measures; an error is a failed case.
    pub measure: fn() -> Result<Vec<Measured>, String>,
}

/// Runs the cases called `names` (all of them, if none is named; long ones with `long` or by name).
///
/// # Errors
/// If a name is not known.
pub fn verify(
    cases: &[VerifyCase],
    names: &[String],
    long: bool,
    progress: &mut dyn Progress,
) -> Result<Vec<VerifyRow>, CommandError> {
    let mut rows = Vec::new();
    for case in chosen(cases, names, long)? {
        progress.message(&format!("{}: {}", case.name, case.about));
        let start = Instant::now();
        let measured = (case.measure)().and_then(named_once);
        let seconds = start.elapsed().as_secs_f64();
        match measured {
            Ok(values) => rows.extend(values.into_iter().map(|value| judged(value, case.name, seconds))),
            Err(message) => {
                progress.message(&format!("{}: {message}", case.name));
                rows.push(VerifyRow {
                    verdict: Verdict::Fail,
                    ..judged(Measured::info(format!("failed: {message}"), "", 0.0), case.name, seconds)
                });
            }
        }
    }
    Ok(rows)
}

/// The values of a case, if no two share a name: a table of them could not be read otherwise.
fn named_once(values: Vec<Measured>) -> Result<Vec<Measured>, String> {
    let mut names = BTreeSet::new();
    match values.iter().find(|value| !names.insert(&value.quantity)) {
        Some(twice) => Err(format!("two rows are called `{}`", twice.quantity)),
        None => Ok(values),
    }
}

fn chosen<'c>(cases: &'c [VerifyCase], names: &[String], long: bool) -> Result<Vec<&'c VerifyCase>, CommandError> {
    if names.is_empty() {
        return Ok(cases.iter().filter(|case| long || !case.long).collect());
    }
    let known: Vec<&str> = cases.iter().map(|case| case.name).collect();
    names
        .iter()
        .map(|name| {
            cases
                .iter()
                .find(|case| case.name == name)
                .ok_or_else(|| CommandError::unknown("verification case", name, &known))
        })
        .collect()
}

/// The rows as a table for people.
#[must_use]
pub fn table(rows: &[VerifyRow]) -> String {
    let number = |value: Option<Real>| match value {
        None => "-".to_owned(),
        Some(v) if v != 0.0 && !(1e-3..1e6).contains(&v.abs()) => format!("{v:.4e}"),
        Some(v) => format!("{v:.6}").trim_end_matches('0').trim_end_matches('.').to_owned(),
    };
    let mut text = format!(
        "{:<28} {:<44} {:>13} {:>13} {:>27}  {:<7} {:>8}\n",
        "case", "quantity", "measured", "reference", "band", "verdict", "seconds"
    );
    for row in rows {
        let quantity =
            if row.unit.is_empty() { row.quantity.clone() } else { format!("{} [{}]", row.quantity, row.unit) };
        let band = match (row.low, row.high) {
            (None, None) => "-".to_owned(),
            (low, high) => format!("{} .. {}", number(low), number(high)),
        };
        let verdict = match row.verdict {
            Verdict::Pass => "pass",
            Verdict::Fail => "FAIL",
            Verdict::Info => "info",
        };
        text.push_str(&format!(
            "{:<28} {:<44} {:>13} {:>13} {:>27}  {:<7} {:>8.1}\n",
            row.case,
            quantity,
            number(Some(row.measured)),
            number(row.reference),
            band,
            verdict,
            row.seconds
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use sazanami::progress::Silent;

    fn cases() -> [VerifyCase; 3] {
        [
            VerifyCase {
                name: "near",
                about: "lies in its band",
                long: false,
                measure: || Ok(vec![Measured::near("x", "m", 1.01, 1.0, 0.02), Measured::info("y", "", 3.0)]),
            },
            VerifyCase {
                name: "far",
                about: "lies outside",
                long: false,
                measure: || Ok(vec![Measured::near("x", "m", 1.1, 1.0, 0.02)]),
            },
            VerifyCase { name: "slow", about: "takes long", long: true, measure: || Err("broke".into()) },
        ]
    }

    #[test]
    fn bands_decide_and_errors_fail() {
        let verdicts = |names: &[&str], long| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            let rows = verify(&cases(), &names, long, &mut Silent).unwrap();
            rows.iter().map(|row| row.verdict).collect::<Vec<_>>()
        };
        assert_eq!(verdicts(&[], false), [Verdict::Pass, Verdict::Info, Verdict::Fail]);
        assert_eq!(verdicts(&[], true).len(), 4);
        assert_eq!(verdicts(&["slow"], false), [Verdict::Fail]);
    }

    #[test]
    fn two_rows_of_one_name_fail() {
        let twice = VerifyCase {
            name: "twice",
            about: "says x two times",
            long: false,
            measure: || Ok(vec![Measured::info("x", "", 1.0), Measured::info("x", "", 2.0)]),
        };
        let rows = verify(&[twice], &[], false, &mut Silent).unwrap();
        assert_eq!(rows.len(), 1);
        assert_eq!(rows[0].verdict, Verdict::Fail);
        assert!(rows[0].quantity.contains("two rows are called `x`"));
    }

    #[test]
    fn unknown_names_are_wrong_input() {
        let error = verify(&cases(), &["neer".into()], false, &mut Silent).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("did you mean `near`?"));
    }
}
