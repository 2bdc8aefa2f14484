//! The page of a case and the overview, from what was measured and what is expected.
//!
//! A page is written by hand but for what stands between two marks; the figure is a file beside it.

use std::io::{self, Write as _};
use std::path::Path;

use sazanami::progress::duration;
use sazanami_io::replace_file;
use sazanami_numerics::Real;
use serde_json::{Value, json};

use crate::catalogue::Case;
use crate::chart::figure;
use crate::expected::Expected;
use crate::judge::{Row, Verdict, judge, number, tally};
use crate::measured::Outcome;

/// File of the last measurements, beside `expected.toml`.
pub const MEASURED: &str = "measured.json";
const PAGE: &str = "README.md";
const FIGURE: &str = "figure.svg";
const OVERVIEW: &str = "docs/results/verification.md";
const BEGIN: &str = "<!-- from here: written by `cargo xtask generate` -->";
const END: &str = "<!-- to here -->";

/// Makes `folder`, and makes sure that files can be written there.
///
/// # Errors
/// If they cannot.
pub fn make_ready(folder: &Path) -> io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let trial = folder.join(".sazanami-write-test");
    replace_file(&trial, |file| file.write_all(b"sazanami"))?;
    std::fs::remove_file(trial)
}

/// Puts `text` at `path`: all of it, or what was there stays.
///
/// # Errors
/// Those of the file system, with the path.
pub fn put(path: &Path, text: &str) -> io::Result<()> {
    replace_file(path, |file| file.write_all(text.as_bytes())).map_err(|error| of_path(path, &error))
}

/// Text of a file, if there is such a file: what is there and cannot be read is an error.
fn text_at(path: &Path) -> io::Result<Option<String>> {
    match std::fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(of_path(path, &error)),
    }
}

fn of_path(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

/// Writes what was measured, the page and its figure into `folder/<case>`; a page that is there keeps its text.
///
/// # Errors
/// If a file cannot be written, or a page that is there cannot be read.
pub fn write_case(folder: &Path, name: &str, expected: &Expected, outcome: &Outcome) -> io::Result<()> {
    let folder = folder.join(name);
    std::fs::create_dir_all(&folder).map_err(|error| of_path(&folder, &error))?;
    put(&folder.join(MEASURED), &kept(outcome))?;
    pages_of(&folder, name, expected, outcome)?.iter().try_for_each(|(path, text)| put(&folder.join(path), text))
}

/// Measurements as JSON, a value a line; those that are not finite, which JSON has no numbers for, as words.
fn kept(outcome: &Outcome) -> String {
    let number = |value: Real| if value.is_finite() { json!(value) } else { json!(value.to_string()) };
    let values: Vec<String> =
        outcome.values.iter().map(|(name, &value)| format!("{}: {}", json!(name), number(value))).collect();
    let curves: Vec<String> = outcome.curves.iter().map(|chart| json!(chart).to_string()).collect();
    format!("{{\n\"values\": {{\n{}\n}},\n\"curves\": [\n{}\n]\n}}\n", values.join(",\n"), curves.join(",\n"))
}

/// Measurements of a text of [`kept`].
fn measured(text: &str) -> serde_json::Result<Outcome> {
    let mut kept: Value = serde_json::from_str(text)?;
    let mut odd = Vec::new();
    if let Some(values) = kept.get_mut("values").and_then(Value::as_object_mut) {
        values.retain(|name, value| {
            let word = value.as_str().and_then(|word| word.parse::<Real>().ok());
            odd.extend(word.map(|value| (name.clone(), value)));
            word.is_none()
        });
    }
    let mut outcome: Outcome = serde_json::from_value(kept)?;
    outcome.values.extend(odd);
    Ok(outcome)
}

/// File names and texts of page and figure.
fn pages_of(
    folder: &Path,
    name: &str,
    expected: &Expected,
    outcome: &Outcome,
) -> io::Result<[(&'static str, String); 2]> {
    let rows = judge(name, expected, outcome);
    let page = text_at(&folder.join(PAGE))?.unwrap_or_else(|| format!("# {name}\n\n{}.\n", expected.about));
    Ok([(PAGE, with_results(&page, &results(&rows))), (FIGURE, figure(&outcome.curves, &rows))])
}

/// `page` with the text between the marks replaced, or with marks and text at its end.
fn with_results(page: &str, results: &str) -> String {
    let block = format!("{BEGIN}\n\n{results}\n{END}\n");
    let around = page.split_once(BEGIN).and_then(|(before, rest)| Some((before, rest.split_once(END)?.1)));
    match around {
        Some((before, after)) => format!("{before}{block}{}", after.trim_start_matches('\n')),
        None => format!("{}\n\n{block}", page.trim_end()),
    }
}

fn results(rows: &[Row]) -> String {
    let mut text = format!("![Measured, beside the reference]({FIGURE})\n\n");
    text.push_str("| quantity | measured | reference | band | verdict |\n|---|---|---|---|---|\n");
    for row in rows {
        let (quantity, band) = (row.name().replace('|', "\\|"), row.band());
        let (measured, reference) = (number(row.measured), number(row.reference));
        text.push_str(&format!("| {quantity} | {measured} | {reference} | {band} | {} |\n", row.verdict.word()));
    }
    let misses: Vec<&Row> = rows.iter().filter(|row| row.verdict == Verdict::KnownMiss).collect();
    if !misses.is_empty() {
        text.push_str("\n**Known misses**\n\n");
        let mut given: Vec<&str> = Vec::new();
        for row in misses {
            let again = given.contains(&row.remark.as_str());
            given.push(&row.remark);
            let reason = if again { "as above" } else { &row.remark };
            text.push_str(&format!("- {}: {reason}.\n", row.quantity.replace('|', "\\|")));
        }
    }
    let mut sources: Vec<&str> =
        rows.iter().map(|row| row.source.as_str()).filter(|source| !source.is_empty()).collect();
    sources.sort_unstable();
    sources.dedup();
    text.push_str(&format!(
        "\nReferences and bands: {}. Addresses of the papers: [references](../../docs/references.md).\n",
        sources.join("; ")
    ));
    text
}

/// A case as it was measured last.
struct Recorded {
    name: &'static str,
    expected: Expected,
    outcome: Option<Outcome>,
}

fn recorded(root: &Path, cases: &[Case]) -> Result<Vec<Recorded>, String> {
    let of = |case: &Case| {
        let folder = root.join("verification").join(case.name);
        let expected =
            std::fs::read_to_string(folder.join("expected.toml")).map_err(|error| format!("{}: {error}", case.name))?;
        let expected = Expected::parse(&expected).map_err(|problem| format!("{}: {problem}", case.name))?;
        let text = text_at(&folder.join(MEASURED)).map_err(|error| error.to_string())?;
        let outcome = text.map(|text| measured(&text)).transpose();
        let outcome = outcome.map_err(|error| format!("{}: {MEASURED}: {error}", case.name))?;
        Ok(Recorded { name: case.name, expected, outcome })
    };
    cases.iter().map(of).collect()
}

/// Paths and texts of all pages of a checkout at `root`, from what was measured last.
///
/// # Errors
/// The error in an `expected.toml` or a `measured.json`, or a page that cannot be read.
pub fn pages(root: &Path, cases: &[Case]) -> Result<Vec<(String, String)>, String> {
    let recorded = recorded(root, cases)?;
    let mut pages = Vec::new();
    for Recorded { name, expected, outcome } in &recorded {
        let Some(outcome) = outcome else { continue };
        let folder = root.join("verification").join(name);
        let written = pages_of(&folder, name, expected, outcome).map_err(|error| error.to_string())?;
        pages.extend(written.map(|(file, text)| (format!("verification/{name}/{file}"), text)));
    }
    let page = text_at(&root.join(OVERVIEW)).map_err(|error| error.to_string())?;
    let page = page.unwrap_or_else(|| "# Verification\n".to_owned());
    pages.push((OVERVIEW.to_owned(), with_results(&page, &overview(&recorded))));
    Ok(pages)
}

/// A line per case: what it shows, how many quantities stand how, and the one that stands worst.
fn overview(recorded: &[Recorded]) -> String {
    let mut lines = String::from(
        "| case | what it shows | worst quantity | measured | band | verdict |\n|---|---|---|---|---|---|\n",
    );
    let mut all: Vec<Row> = Vec::new();
    for Recorded { name, expected, outcome } in recorded {
        let link = format!("[{name}](../../verification/{name}/README.md)");
        let Some(outcome) = outcome else {
            let cost = duration(expected.cost);
            lines.push_str(&format!(
                "| {link} | {} | not measured yet: {cost} of processor time | | | |\n",
                expected.about
            ));
            continue;
        };
        let rows = judge(name, expected, outcome);
        all.extend_from_slice(&rows);
        let misses = rows.iter().filter(|row| row.verdict == Verdict::KnownMiss).count();
        let rank = |row: &Row| (row.verdict.is_bad(), row.verdict == Verdict::KnownMiss);
        let worst = rows
            .iter()
            .filter(|row| row.verdict != Verdict::Informational)
            .max_by(|a, b| rank(a).cmp(&rank(b)).then(a.strain().total_cmp(&b.strain())));
        let Some(worst) = worst else { continue };
        let verdict = match (worst.verdict, misses) {
            (Verdict::KnownMiss, misses) => format!("{misses} known of {}", rows.len()),
            (verdict, _) if verdict.is_bad() => {
                let bad = rows.iter().filter(|row| row.verdict.is_bad()).count();
                format!("{} {} of {}", bad, verdict.word(), rows.len())
            }
            (verdict, _) => format!("{}, all {}", verdict.word(), rows.len()),
        };
        let (quantity, measured) = (worst.quantity.replace('|', "\\|"), number(worst.measured));
        lines.push_str(&format!(
            "| {link} | {} | {quantity} | {measured} | {} | {verdict} |\n",
            expected.about,
            worst.band()
        ));
    }
    let cases = recorded.iter().filter(|case| case.outcome.is_some()).count();
    format!("{} quantities in {cases} cases: {}.\n\n{lines}", all.len(), tally(&all))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::CASES;
    use crate::measured::Chart;

    fn root() -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
    }

    #[test]
    fn nothing_recorded_is_worse_than_recorded() {
        for Recorded { name, expected, outcome } in recorded(&root(), CASES).unwrap() {
            for row in outcome.iter().flat_map(|outcome| judge(name, &expected, outcome)) {
                assert!(!row.verdict.is_bad(), "{name}: {}: {}", row.quantity, row.verdict.word());
            }
        }
    }

    #[test]
    fn a_page_that_cannot_be_read_stays_and_one_that_is_absent_is_begun() {
        let root = std::env::temp_dir().join(format!("sazanami-pages-{}", std::process::id()));
        let expected = Expected::parse("about = \"a test\"\ncost = 1\nquantity = []\n").unwrap();
        let page = root.join("case").join(PAGE);
        make_ready(&root).unwrap();
        assert_eq!(std::fs::read_dir(&root).unwrap().count(), 0);
        write_case(&root, "case", &expected, &Outcome::default()).unwrap();
        assert!(std::fs::read_to_string(&page).unwrap().starts_with("# case\n\na test.\n"));
        let by_hand = b"# Case\n\nBy hand, 20 \xb0.\n";
        std::fs::write(&page, by_hand).unwrap();
        let refused = write_case(&root, "case", &expected, &Outcome::default()).unwrap_err();
        assert!(refused.to_string().contains(PAGE), "{refused}");
        assert_eq!(std::fs::read(&page).unwrap(), by_hand);
        // What is no folder takes no files.
        assert!(make_ready(&page).is_err());
        std::fs::remove_dir_all(&root).unwrap();
    }

    #[test]
    fn what_is_not_finite_is_kept_as_it_was_measured() {
        let values = [("a", Real::NAN), ("b", Real::INFINITY), ("c", Real::NEG_INFINITY), ("d", 0.1 + 0.2)];
        let values = values.map(|(name, value)| (name.to_owned(), value)).into();
        let chart = Chart::new("title", "x", "y").computed("a", &[[0.0, 1.0], [1.0, Real::NAN]]);
        let outcome = Outcome { values, curves: vec![chart.reference("b", &[[Real::INFINITY, 0.0]])] };
        let found = measured(&kept(&outcome)).unwrap();
        let bits = |outcome: &Outcome| outcome.values.values().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!((bits(&found), &found.curves), (bits(&outcome), &outcome.curves));
        assert_eq!(found.curves[0].series.iter().map(|series| series.points.len()).collect::<Vec<_>>(), [1, 0]);
        // Other words are no numbers.
        assert!(measured("{ \"values\": { \"a\": \"many\" } }").is_err());
    }

    #[test]
    fn text_by_hand_stays() {
        let first = with_results("# Case\n\nBy hand.\n", "one\n");
        let second = with_results(&first.replace("By hand.", "By hand, more."), "two\n");
        assert!(second.contains("By hand, more.") && second.contains("two") && !second.contains("one"));
        assert_eq!(with_results(&second, "two\n"), second);
        let below = format!("{second}\nBelow.\n");
        assert!(with_results(&below, "three\n").ends_with("Below.\n"));
    }
}
