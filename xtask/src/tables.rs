//! The tables of `docs/results/verification.md`, written from what `sazanami verify --json` measured.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::root;

/// What was measured, a row a line.
const ROWS: &str = "docs/results/verification.json";
/// The page with the tables and what is said about them.
const PAGE: &str = "docs/results/verification.md";

/// Takes the cases in `files` over into the rows that are kept, writes the tables anew, and returns the exit code.
pub fn run(files: &[String]) -> u8 {
    match renew(files) {
        Ok(count) => {
            println!("{PAGE}: {count} rows");
            0
        }
        Err(problem) => {
            eprintln!("error: {problem}");
            1
        }
    }
}

fn renew(files: &[String]) -> Result<usize, String> {
    let [kept, page] = [ROWS, PAGE].map(|name| root().join(name));
    let mut rows = if kept.is_file() { read_rows(&kept)? } else { Vec::new() };
    for file in files {
        rows = merged(rows, read_rows(Path::new(file))?);
    }
    let text = fs::read_to_string(&page).map_err(|error| format!("{PAGE}: {error}"))?;
    let text = with_tables(&text, &rows)?;
    write(&kept, &lines(&rows))?;
    write(&page, &text)?;
    Ok(rows.len())
}

fn read_rows(path: &Path) -> Result<Vec<Value>, String> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    match serde_json::from_str(&text) {
        Ok(Value::Array(rows)) => Ok(rows),
        Ok(_) => Err(format!("{}: there is no array of rows in it", path.display())),
        Err(error) => Err(format!("{}: {error}", path.display())),
    }
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}

/// `rows` with the cases in `new` put in the place of what was there of them. Times are left out: they tell about the
/// machine and what else it did.
fn merged(mut rows: Vec<Value>, mut new: Vec<Value>) -> Vec<Value> {
    for row in new.iter_mut().filter_map(Value::as_object_mut) {
        row.remove("seconds");
    }
    rows.retain(|row| new.iter().all(|other| other["case"] != row["case"]));
    rows.append(&mut new);
    rows
}

/// The rows as JSON, one a line.
fn lines(rows: &[Value]) -> String {
    let rows: Vec<String> = rows.iter().map(Value::to_string).collect();
    format!("[\n{}\n]\n", rows.join(",\n"))
}

/// The page with the table under each heading `## case` replaced by the rows of that case; all else stays.
fn with_tables(page: &str, rows: &[Value]) -> Result<String, String> {
    let mut cases: BTreeMap<&str, Vec<&Value>> = BTreeMap::new();
    for row in rows {
        cases.entry(text(row, "case")).or_default().push(row);
    }
    let mut written = String::new();
    // Rows of the section whose table is yet to come; whether the lines of its old table are being left out.
    let (mut to_come, mut replacing): (Option<Vec<&Value>>, bool) = (None, false);
    let mut without_table = Vec::new();
    let mut heading = "";
    for line in page.lines() {
        if let Some(found) = line.strip_prefix("## ") {
            without_table.extend(to_come.take().map(|_| heading));
            heading = found;
            to_come = cases.remove(heading);
        }
        if !line.starts_with('|') {
            replacing = false;
        } else if let Some(rows) = to_come.take() {
            written.push_str(&table(&rows));
            replacing = true;
        }
        if !replacing {
            written.push_str(line);
            written.push('\n');
        }
    }
    without_table.extend(to_come.map(|_| heading));
    without_table.extend(cases.into_keys());
    if without_table.is_empty() {
        return Ok(written);
    }
    Err(format!("{PAGE}: a heading `## case` with a table under it is missing for {}", without_table.join(", ")))
}

fn table(rows: &[&Value]) -> String {
    let mut table = String::from("| quantity | measured | reference | band | verdict |\n|---|---|---|---|---|\n");
    for row in rows {
        // An upright line would end the cell.
        let mut quantity = text(row, "quantity").replace('|', "\\|");
        let unit = text(row, "unit");
        if !unit.is_empty() {
            quantity.push_str(&format!(" [{unit}]"));
        }
        let [measured, reference, low, high] = ["measured", "reference", "low", "high"].map(|key| number(&row[key]));
        let band = if low == "-" && high == "-" { low } else { format!("{low} .. {high}") };
        let verdict = match text(row, "verdict") {
            "fail" => "**fail**",
            other => other,
        };
        table.push_str(&format!("| {quantity} | {measured} | {reference} | {band} | {verdict} |\n"));
    }
    table
}

/// A number as `sazanami verify` prints it.
fn number(value: &Value) -> String {
    match value.as_f64() {
        None => "-".to_owned(),
        Some(v) if v != 0.0 && !(1e-3..1e6).contains(&v.abs()) => format!("{v:.4e}"),
        Some(v) => format!("{v:.6}").trim_end_matches('0').trim_end_matches('.').to_owned(),
    }
}

fn text<'v>(row: &'v Value, key: &str) -> &'v str {
    row[key].as_str().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use serde_json::json;

    use super::*;

    fn kept() -> (Vec<Value>, String) {
        (read_rows(&root().join(ROWS)).unwrap(), fs::read_to_string(root().join(PAGE)).unwrap())
    }

    #[test]
    fn the_page_holds_what_was_measured() {
        let (rows, page) = kept();
        assert!(with_tables(&page, &rows).unwrap() == page, "`cargo xtask tables` writes other tables");
        let mut names = BTreeSet::new();
        for row in &rows {
            assert!(names.insert([text(row, "case"), text(row, "quantity")]), "twice: {row}");
        }
    }

    /// The verdict of every row follows from the numbers beside it.
    #[test]
    fn verdicts_agree_with_the_bands_printed() {
        let (rows, page) = kept();
        let mut judged = 0;
        for line in page.lines().filter(|line| line.starts_with("| ")) {
            let cells: Vec<&str> = line.trim_matches('|').rsplitn(5, " | ").map(str::trim).collect();
            let [verdict, band, _, measured, quantity] = cells[..] else { panic!("{line}") };
            let (Ok(measured), Some((low, high))) = (measured.parse::<f64>(), band.split_once(" .. ")) else {
                assert!(verdict == "info" || verdict == "verdict", "{quantity}: {verdict} without a band");
                continue;
            };
            let end = |end: &str, open: f64| if end == "-" { open } else { end.parse().unwrap() };
            let inside = end(low, f64::NEG_INFINITY) <= measured && measured <= end(high, f64::INFINITY);
            assert_eq!(verdict, if inside { "pass" } else { "**fail**" }, "{quantity}: {measured} in {band}");
            judged += 1;
        }
        assert_eq!(judged, rows.iter().filter(|row| text(row, "verdict") != "info").count());
    }

    #[test]
    fn every_miss_is_told_at_the_head_of_the_page() {
        let (rows, page) = kept();
        let (_, missed) = page.split_once("## What is missed").unwrap();
        let missed = missed.split("\n## ").next().unwrap();
        for row in rows.iter().filter(|row| text(row, "verdict") == "fail") {
            assert!(missed.contains(&format!("`{}`", text(row, "case"))), "not told: {row}");
        }
    }

    fn row(case: &str, measured: f64) -> Value {
        json!({ "case": case, "quantity": "|u|", "unit": "m/s", "measured": measured, "reference": null,
                "low": 0.0, "high": 1.0, "verdict": "pass", "seconds": 3.0 })
    }

    #[test]
    fn tables_are_replaced_and_prose_stays() {
        let page = "# Page\n\n| a | b |\n\n## one\n\nBefore.\n\n| old |\n|---|\n\nAfter.\n\n## two\n\n| other |\n";
        let written = with_tables(page, &[row("one", 0.5)]).unwrap();
        assert!(written.contains("Before.\n\n| quantity |"), "{written}");
        assert!(written.contains("| \\|u\\| [m/s] | 0.5 | - | 0 .. 1 | pass |\n\nAfter."), "{written}");
        assert!(written.contains("| a | b |") && written.contains("| other |") && !written.contains("| old |"));
        assert_eq!(with_tables(&written, &[row("one", 0.5)]).unwrap(), written);
        // Nowhere to put the rows.
        assert!(with_tables("## one\n\n## two\n", &[row("one", 0.5)]).unwrap_err().contains("one"));
        assert!(with_tables("## two\n", &[row("one", 0.5)]).unwrap_err().contains("one"));
    }

    #[test]
    fn new_measurements_take_the_place_of_old_ones() {
        let rows = merged(vec![row("one", 0.1), row("two", 0.2)], vec![row("one", 0.3)]);
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0]["measured"], 0.2);
        assert_eq!(rows[1]["measured"], 0.3);
        assert!(rows[1].get("seconds").is_none());
        let read: Vec<Value> = serde_json::from_str(&lines(&rows)).unwrap();
        assert_eq!(read, rows);
    }
}
