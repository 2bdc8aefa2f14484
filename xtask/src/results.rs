//! Tables of results, written from the summaries of the runs behind them, and these runs made anew.
//!
//! A folder of `docs/results/runs` is a run: `run.toml` says how it is made (`case`, `set`), by how much a new one may differ (`within`: the
//! largest relative difference of an entry of the summary) and which of its pictures the pages show; `summary.json` is what it gave.
//! `docs/results/tables.toml` has the tables. They stand in the pages between `<!-- table NAME -->` and `<!-- end -->`, in the language of the
//! page (`NAME.ja.md`: Japanese).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::{cargo, exit_code, root};

pub const RUNS: &str = "docs/results/runs";
const TABLES: &str = "docs/results/tables.toml";
const BEGIN: &str = "<!-- table ";
const END: &str = "<!-- end -->";

pub type Problem = String;

/// How a run is made and judged.
#[derive(Deserialize)]
struct Run {
    case: String,
    #[serde(default)]
    set: Vec<String>,
    #[serde(default)]
    within: BTreeMap<String, f64>,
    /// Beginning of the names of pictures below the results, of which the last is taken or, with `#n` behind it, that after n others, and its
    /// place in the repository.
    #[serde(default)]
    pictures: BTreeMap<String, String>,
}

impl Run {
    fn read(root: &Path, name: &str) -> Result<Self, Problem> {
        read_toml(&root.join(RUNS).join(name).join("run.toml"))
    }
}

fn read_text(path: &Path) -> Result<String, Problem> {
    std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}

pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, Problem> {
    toml::from_str(&read_text(path)?).map_err(|error| format!("{}: {error}", path.display()))
}

pub fn read_summary(folder: &Path) -> Result<Value, Problem> {
    let path = folder.join("summary.json");
    serde_json::from_str(&read_text(&path)?).map_err(|error| format!("{}: {error}", path.display()))
}

/// The number at `path`, entries and indices parted by dots.
pub fn number(summary: &Value, path: &str) -> Result<f64, Problem> {
    entry(summary, path).and_then(Value::as_f64).ok_or(format!("a summary has no number `{path}`"))
}

fn entry<'a>(summary: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(summary, |at, key| match key.parse::<usize>() {
        Ok(index) => at.get(index),
        Err(_) => at.get(key),
    })
}

/// `{path}`, `{path/other}`, `{path*1000:.1}` in a text become numbers of the summary: `.2` with two digits behind the point, `e` with an
/// exponent and two digits, `,` in groups of three. `{path?yes|no}` becomes one of the words.
fn filled(text: &str, summary: &Value) -> Result<String, Problem> {
    let Some((before, rest)) = text.split_once('{') else {
        return Ok(text.to_owned());
    };
    let (inner, after) = rest.split_once('}').ok_or(format!("`{text}` opens a brace and does not close it"))?;
    if let Some((path, words)) = inner.split_once('?') {
        let (yes, no) = words.split_once('|').ok_or(format!("`{inner}` has no words parted by `|`"))?;
        let holds =
            entry(summary, path).and_then(Value::as_bool).ok_or(format!("a summary says nothing of `{path}`"))?;
        return Ok(format!("{before}{}{}", if holds { yes } else { no }, filled(after, summary)?));
    }
    let (value, form) = inner.split_once(':').unwrap_or((inner, ".0"));
    let (value, factor) = value.split_once('*').unwrap_or((value, "1"));
    let (value, over) = value.split_once('/').map_or((value, None), |(value, over)| (value, Some(over)));
    let factor: f64 = factor.parse().map_err(|_| format!("`{factor}` is no number"))?;
    let number = number(summary, value)? * factor / over.map_or(Ok(1.0), |over| number(summary, over))?;
    let written = match form.strip_prefix('.') {
        Some(digits) => format!("{number:.*}", digits.parse().map_err(|_| format!("`{form}` is no form"))?),
        None if form == "e" => format!("{number:.1e}"),
        None if form == "," => in_groups(number),
        None => return Err(format!("`{form}` is no form of a number")),
    };
    Ok(format!("{before}{written}{}", filled(after, summary)?))
}

/// A whole number in groups of three digits.
fn in_groups(number: f64) -> String {
    let digits = format!("{number:.0}");
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Table `name` in `language`: a row for each quantity and a column for each run, or with `down` the other way round.
fn table(root: &Path, tables: &toml::Table, name: &str, language: &str) -> Result<String, Problem> {
    let table = tables.get(name).ok_or(format!("{TABLES} has no table `{name}`"))?;
    let list = |key: &str| table.get(key).and_then(toml::Value::as_array).cloned().unwrap_or_default();
    let label = |of: &toml::Value| -> Result<String, Problem> {
        let found = of.as_str().or_else(|| of.get(language).or_else(|| of.get("en"))?.as_str());
        found.map(str::to_owned).ok_or(format!("a label of table `{name}` has no text"))
    };
    let mut columns = vec![vec![label(table.get("head").ok_or(format!("table `{name}` has no `head`"))?)?]];
    let rows = list("rows");
    for row in &rows {
        columns[0].push(label(row)?);
    }
    for run in list("runs") {
        let folder =
            run.get("run").and_then(toml::Value::as_str).ok_or(format!("a run of table `{name}` has no name"))?;
        let summary = read_summary(&root.join(RUNS).join(folder))?;
        let mut column = vec![label(&run)?];
        for row in &rows {
            let value = row.get("value").ok_or(format!("a row of table `{name}` has no `value`"))?;
            column.push(filled(&label(value)?, &summary).map_err(|problem| format!("table `{name}`: {problem}"))?);
        }
        columns.push(column);
    }
    let down = table.get("down").and_then(toml::Value::as_bool).unwrap_or(false);
    let lines: Vec<Vec<&str>> = if down {
        columns.iter().map(|column| column.iter().map(String::as_str).collect()).collect()
    } else {
        (0..columns[0].len()).map(|row| columns.iter().map(|column| &*column[row]).collect()).collect()
    };
    let line = |cells: &[&str]| format!("| {} |\n", cells.join(" | "));
    let rule = format!("|{}\n", "---|".repeat(lines[0].len()));
    Ok(line(&lines[0]) + &rule + &lines[1..].iter().map(|cells| line(cells)).collect::<String>())
}

/// Pages with tables of results below `root`, with the tables as the summaries have them: path and text.
pub fn pages(root: &Path) -> Result<Vec<(String, String)>, Problem> {
    let tables: toml::Table = read_toml(&root.join(TABLES))?;
    let places = table_list(&tables)?;
    let mut pages = Vec::new();
    for path in places {
        let text = read_text(&root.join(&path))?;
        let language = if path.ends_with(".ja.md") { "ja" } else { "en" };
        pages.push((path.clone(), with_tables(&text, |name| table(root, &tables, name, language))?));
    }
    Ok(pages)
}

/// The pages that [`TABLES`] names.
fn table_list(tables: &toml::Table) -> Result<Vec<String>, Problem> {
    let pages = tables.get("pages").and_then(toml::Value::as_array).ok_or(format!("{TABLES} names no `pages`"))?;
    Ok(pages.iter().filter_map(|page| page.as_str().map(str::to_owned)).collect())
}

/// A page with each of its tables as `table` has it.
fn with_tables(text: &str, table: impl Fn(&str) -> Result<String, Problem>) -> Result<String, Problem> {
    let mut fresh = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once(BEGIN) {
        let (name, after) = after.split_once(" -->\n").ok_or("a table has no name")?;
        let (_, after) = after.split_once(END).ok_or(format!("table `{name}` has no end"))?;
        fresh += &format!("{before}{BEGIN}{name} -->\n{}{END}", table(name)?);
        rest = after;
    }
    Ok(fresh + rest)
}

/// Makes the runs of the names given, with `--all` every one, or lists them; `--keep` takes what they give into the repository. Returns the exit code: 1 if
/// one differs from its summary by more than its `run.toml` says.
pub fn run(arguments: &[String]) -> u8 {
    let keep = arguments.iter().any(|argument| argument == "--keep");
    let known = ["--keep", "--all"];
    if let Some(unknown) =
        arguments.iter().find(|argument| argument.starts_with("--") && !known.contains(&&***argument))
    {
        eprintln!("error: there is no option `{unknown}`: `--keep`, `--all` or none");
        return 2;
    }
    let mut names: Vec<String> = arguments.iter().filter(|argument| !argument.starts_with("--")).cloned().collect();
    if arguments.iter().any(|argument| argument == "--all") {
        names = all_runs();
    }
    if names.is_empty() {
        return list();
    }
    let mut code = 0;
    for name in &names {
        match make(&root(), name, keep) {
            Ok(differences) => {
                differences.iter().for_each(|line| println!("{line}"));
                code = code.max(u8::from(!keep && differences.iter().any(|line| line.ends_with("DIFFERS"))));
            }
            Err(problem) => {
                eprintln!("error: {problem}");
                code = 2;
            }
        }
    }
    code
}

/// Names of the runs.
fn all_runs() -> Vec<String> {
    let entries = std::fs::read_dir(root().join(RUNS)).into_iter().flatten().flatten();
    let made = entries.filter(|entry| entry.path().join("run.toml").exists());
    let mut names: Vec<String> = made.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Lists the runs.
fn list() -> u8 {
    let root = root();
    for name in all_runs() {
        match Run::read(&root, &name) {
            Ok(run) => println!("{name:28} {} {}", run.case, run.set.join(" ")),
            Err(problem) => eprintln!("{problem}"),
        }
    }
    0
}

/// Makes a run and compares it with its summary. One that was interrupted goes on if it was begun by this program for the same `run.toml` and
/// case; all others begin anew.
fn make(root: &Path, name: &str, keep: bool) -> Result<Vec<String>, Problem> {
    let run = Run::read(root, name)?;
    let out = root.join("target/results").join(name);
    let mut command = cargo();
    command.args(["run", "--release", "--quiet", "--package", "sazanami-cli", "--"]);
    let begun = root.join("target/results").join(format!("{name}.begun"));
    let now = stamp(root, name, &run)?;
    let is_mine = std::fs::read_to_string(&begun).is_ok_and(|text| text == now);
    let has_ended = read_summary(&out).is_ok_and(|summary| summary["status"] == "finished");
    if is_mine && !has_ended && out.join("case.toml").exists() {
        command.arg("resume").arg(&out);
    } else {
        let fresh = || {
            std::fs::create_dir_all(&out)
                .and_then(|()| std::fs::remove_dir_all(&out))
                .and_then(|()| std::fs::write(&begun, &now))
        };
        fresh().map_err(|error| format!("{}: {error}", out.display()))?;
        command.args(["run", &run.case, "--out"]).arg(&out);
        for set in &run.set {
            command.args(["--set", set]);
        }
    }
    match exit_code(&mut command) {
        0 => {}
        code => return Err(format!("{name}: exit code {code}")),
    }
    let (folder, found) = (root.join(RUNS).join(name), read_summary(&out)?);
    let mut lines = Vec::new();
    if !keep {
        let kept = read_summary(&folder)?;
        if run.within.is_empty() {
            return Err(format!("{name}/run.toml has no `within`: nothing is compared"));
        }
        for (path, &within) in &run.within {
            let (now, before) = (number(&found, path)?, number(&kept, path)?);
            let difference = (now - before).abs() / before.abs();
            let verdict = if difference <= within { "ok" } else { "DIFFERS" };
            lines.push(format!("{name} {path} {now} for {before}, {difference:.1e} of {within:.1e} {verdict}"));
        }
    }
    if keep {
        let copy = |from: PathBuf, to: PathBuf| {
            std::fs::copy(&from, &to).map(drop).map_err(|error| format!("{}: {error}", from.display()))
        };
        copy(out.join("summary.json"), folder.join("summary.json"))?;
        for (from, to) in &run.pictures {
            copy(picture(&out, from)?, root.join(to))?;
        }
    }
    Ok(lines)
}

/// What a run hangs on: the state of the repository with its changes, and the text of its case and of its `run.toml`.
fn stamp(root: &Path, name: &str, run: &Run) -> Result<String, Problem> {
    let git = |arguments: &[&str]| {
        let out = std::process::Command::new("git").args(arguments).current_dir(root).output();
        out.map(|out| String::from_utf8_lossy(&out.stdout).into_owned()).map_err(|error| format!("git: {error}"))
    };
    let described = read_text(&root.join(RUNS).join(name).join("run.toml"))? + &read_text(&root.join(&run.case))?;
    Ok(git(&["rev-parse", "HEAD"])? + &git(&["diff", "HEAD", "--", "crates", "Cargo.lock"])? + &described)
}

/// Of the pictures whose paths below `out` begin with `start` the last, or with `start#n` that after n others.
fn picture(out: &Path, start: &str) -> Result<PathBuf, Problem> {
    let (start, number) = match start.rsplit_once('#') {
        Some((start, number)) => (start, Some(number.parse::<usize>().map_err(|error| format!("#{number}: {error}"))?)),
        None => (start, None),
    };
    let folder = out.join(start);
    let (parent, begin) = (folder.parent().unwrap_or(out), folder.file_name().unwrap_or_default().to_string_lossy());
    let files = std::fs::read_dir(parent).into_iter().flatten().flatten().map(|entry| entry.path());
    let fits = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&*begin));
    let mut all: Vec<PathBuf> = files.filter(fits).collect();
    all.sort();
    let found = number.map_or_else(|| all.last(), |number| all.get(number));
    found.cloned().ok_or(format!("{} pictures begin with {}", all.len(), folder.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_summary_stand_in_the_text() {
        let summary = serde_json::json!({ "a": { "b": [1234.5, -2e-9] }, "n": 30900, "none": null });
        assert_eq!(filled("V = {a.b.0:.2} of {n:,}", &summary).unwrap(), "V = 1234.50 of 30,900");
        assert_eq!(filled("{a.b.1:e}, {a.b.0/n*100:.1} %", &summary).unwrap(), "-2.0e-9, 4.0 %");
        let rest = serde_json::json!({ "rest": true, "n": 1 });
        assert_eq!(filled("{rest?yes|no}, {n}", &rest).unwrap(), "yes, 1");
        assert!(filled("{n?yes|no}", &rest).is_err());
        assert!(filled("{none}", &summary).unwrap_err().contains("no number `none`"));
        assert!(filled("{n", &summary).is_err() && filled("{n:x}", &summary).is_err());
    }

    #[test]
    fn a_page_has_the_tables_of_its_runs() {
        let page = "a\n<!-- table t -->\nold\n<!-- end -->\nb\n";
        let fresh = with_tables(page, |name| Ok(format!("| {name} |\n"))).unwrap();
        assert_eq!(fresh, "a\n<!-- table t -->\n| t |\n<!-- end -->\nb\n");
        assert_eq!(with_tables(&fresh, |name| Ok(format!("| {name} |\n"))).unwrap(), fresh);
        assert!(with_tables("<!-- table t -->\nno end", |_| Ok(String::new())).is_err());
        assert!(with_tables(page, |name| Err(format!("no {name}"))).is_err());
    }

    #[test]
    fn pictures_are_named_by_their_order() {
        let out = std::env::temp_dir().join(format!("sazanami-pictures-{}", std::process::id()));
        std::fs::create_dir_all(out.join("figures")).unwrap();
        for name in ["view-000000007.png", "view-000000012.png", "section-000000012.png"] {
            std::fs::write(out.join("figures").join(name), "").unwrap();
        }
        let named = |start: &str| picture(&out, start).map(|path| path.file_name().unwrap().to_owned());
        assert_eq!(named("figures/view").unwrap(), "view-000000012.png");
        assert_eq!(named("figures/view#0").unwrap(), "view-000000007.png");
        assert!(named("figures/view#2").unwrap_err().starts_with("2 pictures begin"));
        assert!(named("figures/map").is_err() && named("figures/view#last").is_err());
        std::fs::remove_dir_all(out).unwrap();
    }

    #[test]
    fn the_tables_of_the_repository_are_those_of_its_summaries() {
        let root = root();
        for (path, text) in pages(&root).unwrap() {
            assert!(text.contains(BEGIN), "{path} has no table");
            assert_eq!(text, std::fs::read_to_string(root.join(&path)).unwrap(), "{path}");
        }
    }
}
