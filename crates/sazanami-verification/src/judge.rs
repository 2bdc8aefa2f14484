//! The verdict on what was measured.

use sazanami_numerics::Real;
use serde::Serialize;

use crate::expected::{Expected, Kind, Quantity};
use crate::measured::Outcome;

/// Verdict on a measured value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Within the band.
    Pass,
    /// There is no band.
    Informational,
    /// Outside the band, and no worse than recorded.
    KnownMiss,
    /// Within the band, though a miss is recorded: `expected.toml` is to be updated.
    Mended,
    /// Outside the band, and no miss is recorded.
    Miss,
    /// Outside the band, and worse than recorded.
    Regression,
    /// Expected, and not measured.
    NotMeasured,
    /// Measured, and not expected.
    NotExpected,
    /// The case could not be run.
    Failed,
}

impl Verdict {
    /// Whether it makes the command fail.
    #[must_use]
    pub const fn is_bad(self) -> bool {
        !matches!(self, Self::Pass | Self::Informational | Self::KnownMiss | Self::Mended)
    }

    /// Word in tables.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Informational => "informational",
            Self::KnownMiss => "known miss",
            Self::Mended => "mended: update expected.toml",
            Self::Miss => "MISS",
            Self::Regression => "REGRESSION",
            Self::NotMeasured => "NOT MEASURED",
            Self::NotExpected => "NOT EXPECTED",
            Self::Failed => "FAILED",
        }
    }
}

/// One judged quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Name of the case.
    pub case: String,
    /// Name of the quantity, unique in its case.
    pub quantity: String,
    /// Unit of the values; empty for a ratio or a count.
    pub unit: String,
    /// Measured value, if there is one and it is a number.
    pub measured: Option<Real>,
    /// Reference, if there is one.
    pub reference: Option<Real>,
    /// Lower end of the band; absent if open.
    pub low: Option<Real>,
    /// Upper end of the band; absent if open.
    pub high: Option<Real>,
    /// Whether the value lies in its band, and how a recorded miss stands.
    pub verdict: Verdict,
    /// Beside what it is judged.
    pub kind: Kind,
    /// Source of reference and band.
    pub source: String,
    /// Reason of a known miss, meaning of an informational quantity, message of a failure.
    pub remark: String,
}

impl Row {
    /// A case that could not be run.
    #[must_use]
    pub fn failed(case: &str, message: &str) -> Self {
        Self { remark: message.to_owned(), ..Self::bare(case, "the case as a whole", None, Verdict::Failed) }
    }

    fn bare(case: &str, quantity: &str, measured: Option<Real>, verdict: Verdict) -> Self {
        Self {
            case: case.to_owned(),
            quantity: quantity.to_owned(),
            unit: String::new(),
            measured: measured.filter(|value| value.is_finite()),
            reference: None,
            low: None,
            high: None,
            verdict,
            kind: Kind::default(),
            source: String::new(),
            remark: String::new(),
        }
    }

    fn of(case: &str, expected: &Quantity, value: Option<Real>) -> Self {
        let end = |n: usize| expected.band.map(|band| band[n]).filter(|end| end.is_finite());
        let remark = expected.known_miss.as_ref().map_or(&expected.meaning, |miss| &miss.reason);
        Self {
            unit: expected.unit.clone(),
            reference: expected.reference,
            low: end(0),
            high: end(1),
            kind: expected.kind,
            source: expected.source.clone(),
            remark: remark.clone(),
            ..Self::bare(case, &expected.name, value, verdict(expected, value))
        }
    }

    /// Its name with the unit, for tables.
    pub(crate) fn name(&self) -> String {
        if self.unit.is_empty() { self.quantity.clone() } else { format!("{} [{}]", self.quantity, self.unit) }
    }

    /// Its band, for tables.
    pub(crate) fn band(&self) -> String {
        match (self.low, self.high) {
            (None, None) => "-".to_owned(),
            (low, high) => format!("{} .. {}", number(low), number(high)),
        }
    }

    /// Distance of the value from the middle of its band over half the width of the band; of an open band, or where
    /// the value is not finite, 0 inside and infinity outside. Above 1 the band is missed.
    #[must_use]
    pub fn strain(&self) -> Real {
        match (self.measured, self.low, self.high) {
            (Some(value), Some(low), Some(high)) if high > low => (2.0 * value - low - high).abs() / (high - low),
            _ if matches!(self.verdict, Verdict::Pass | Verdict::Informational | Verdict::Mended) => 0.0,
            _ => Real::INFINITY,
        }
    }
}

/// A number for people.
#[must_use]
pub fn number(value: Option<Real>) -> String {
    match value {
        None => "-".to_owned(),
        Some(v) if v != 0.0 && !(1e-3..1e6).contains(&v.abs()) => format!("{v:.3e}"),
        Some(v) => format!("{v:.5}").trim_end_matches('0').trim_end_matches('.').to_owned(),
    }
}

fn verdict(expected: &Quantity, value: Option<Real>) -> Verdict {
    let Some(value) = value else { return Verdict::NotMeasured };
    if expected.kind == Kind::Informational {
        return Verdict::Informational;
    }
    let [low, high] = expected.band.unwrap_or([Real::INFINITY, Real::NEG_INFINITY]);
    match &expected.known_miss {
        // An open band holds every number, and nothing that is none.
        None if !value.is_finite() => Verdict::Miss,
        Some(_) if low <= value && value <= high => Verdict::Mended,
        // Between the band of the miss and that of the quantity a value is better than recorded.
        Some(miss) if miss.band[0] >= high && value > high && value <= miss.band[1] => Verdict::KnownMiss,
        Some(miss) if miss.band[1] <= low && value < low && value >= miss.band[0] => Verdict::KnownMiss,
        Some(_) => Verdict::Regression,
        None if low <= value && value <= high => Verdict::Pass,
        None => Verdict::Miss,
    }
}

/// Every expected quantity, then what was measured without being expected.
#[must_use]
pub fn judge(case: &str, expected: &Expected, found: &Outcome) -> Vec<Row> {
    let known = |name: &String| expected.quantities.iter().any(|quantity| quantity.name == *name);
    let judged = expected.quantities.iter().map(|q| Row::of(case, q, found.values.get(&q.name).copied()));
    let extra = found.values.iter().filter(|(name, _)| !known(name));
    judged.chain(extra.map(|(name, value)| Row::bare(case, name, Some(*value), Verdict::NotExpected))).collect()
}

/// Numbers of rows that are judged beside a reference, a recorded value or nothing, and of each verdict among them.
#[must_use]
pub fn tally(rows: &[Row]) -> String {
    let kinds = [
        (Kind::Reference, " beside a reference"),
        (Kind::Regression, " beside a value recorded earlier (regression)"),
        (Kind::Informational, ""),
    ];
    let of_kind = |(kind, words): (Kind, &str)| {
        let mut counts: Vec<(&str, usize)> = Vec::new();
        for word in rows.iter().filter(|row| row.kind == kind).map(|row| row.verdict.word()) {
            match counts.iter_mut().find(|(other, _)| *other == word) {
                Some((_, count)) => *count += 1,
                None => counts.push((word, 1)),
            }
        }
        let total: usize = counts.iter().map(|(_, count)| count).sum();
        let counts: Vec<String> = counts.iter().map(|(word, count)| format!("{count} {word}")).collect();
        let heading = if words.is_empty() { String::new() } else { format!("{total}{words}: ") };
        (total > 0).then(|| heading + &counts.join(", "))
    };
    let parts: Vec<String> = kinds.into_iter().filter_map(of_kind).collect();
    parts.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::Measured;

    const TEXT: &str = r#"
about = "a test"
cost = 1
[[quantity]]
name = "x"
band = [0.0, 1.0]
source = "by hand"
[[quantity]]
name = "slow"
band = [0.9, 1.1]
source = "by hand"
known_miss = { band = [0.7, 0.9], reason = "too slow" }
[[quantity]]
name = "count"
kind = "informational"
meaning = "only counted"
"#;

    fn verdicts(values: &[(&str, Real)]) -> Vec<Verdict> {
        let measured: Vec<Measured> = values.iter().map(|(name, value)| Measured::new(*name, *value)).collect();
        let expected = Expected::parse(TEXT).unwrap();
        judge("test", &expected, &Outcome::of(measured).unwrap()).iter().map(|row| row.verdict).collect()
    }

    #[test]
    fn bands_and_known_misses_decide() {
        use Verdict::{Informational, KnownMiss, Mended, Miss, NotExpected, NotMeasured, Pass, Regression};
        assert_eq!(verdicts(&[("x", 0.5), ("slow", 0.8), ("count", 7.0)]), [Pass, KnownMiss, Informational]);
        assert_eq!(verdicts(&[("x", 1.5), ("slow", 1.0), ("count", 7.0)]), [Miss, Mended, Informational]);
        // Worse than recorded, missed on the other side, not a number.
        assert_eq!(verdicts(&[("x", Real::NAN), ("slow", 0.6), ("count", 7.0)])[..2], [Miss, Regression]);
        assert_eq!(verdicts(&[("x", 0.5), ("slow", 1.2), ("count", 7.0)])[1], Regression);
        assert_eq!(verdicts(&[("x", 0.5), ("slow", Real::NAN), ("count", 7.0)])[1], Regression);
        // An entry without a measurement, a measurement without an entry.
        assert_eq!(verdicts(&[("x", 0.5), ("slow", 0.8), ("y", 7.0)])[2..], [NotMeasured, NotExpected]);
        assert!([Miss, Regression, NotMeasured, NotExpected, Verdict::Failed].iter().all(|verdict| verdict.is_bad()));
        assert!([Pass, KnownMiss, Mended, Informational].iter().all(|verdict| !verdict.is_bad()));
    }

    #[test]
    fn recorded_values_are_counted_apart() {
        let text = format!(
            "{TEXT}[[quantity]]\nname = \"y\"\nband = [0.0, 1.0]\nsource = \"recorded value 0.5\"\nkind = \"regression\"\n"
        );
        let measured = [("x", 0.5), ("slow", 0.8), ("count", 7.0), ("y", 0.5)].map(|(name, x)| Measured::new(name, x));
        let outcome = Outcome::of(measured.to_vec()).unwrap();
        let rows = |text: &str| judge("test", &Expected::parse(text).unwrap(), &outcome);
        assert_eq!(
            tally(&rows(&text)),
            "2 beside a reference: 1 pass, 1 known miss; 1 beside a value recorded earlier (regression): 1 pass; \
             1 informational"
        );
        // Either word alone is refused.
        for (from, to) in [("kind = \"regression\"\n", ""), ("recorded value 0.5", "theory")] {
            assert!(Expected::parse(&text.replace(from, to)).is_err(), "{to}");
        }
    }

    #[test]
    fn expectations_that_cannot_judge_are_refused() {
        for (from, to, why) in [
            ("source = \"by hand\"", "", "without a source"),
            ("band = [0.0, 1.0]", "", "neither a band nor informational"),
            ("band = [0.0, 1.0]", "band = [1.0, 0.0]", "without values"),
            ("meaning = \"only counted\"", "", "no meaning"),
            ("band = [0.7, 0.9], reason", "band = [0.7, 0.95], reason", "overlaps"),
            ("reason = \"too slow\"", "reason = \"\"", "without a reason"),
            ("name = \"count\"", "name = \"x\"", "twice"),
            ("cost = 1", "cost = 1\ncosts = 2", "unknown field"),
        ] {
            assert!(TEXT.contains(from));
            let problem = Expected::parse(&TEXT.replacen(from, to, 1)).unwrap_err();
            assert!(problem.contains(why), "{problem}");
        }
        let twice = vec![Measured::new("x", 1.0), Measured::new("x", 2.0)];
        assert!(Outcome::of(twice).unwrap_err().contains("`x`"));
    }
}
