//! Words that choose: each is what some shipped case or some row of verification runs with, as it sets it, by its preset or by default.

use std::collections::BTreeSet;
use std::io;
use std::path::Path;

use sazanami::case::key::{KeyDoc, Keys, TableDoc, ValueDoc};
use sazanami::case::meaning::Solver;
use sazanami::case::{self, Case, resolved};
use sazanami_verification::catalogue::CASES;
use sazanami_verification::expected::Expected;
use toml::{Table, Value};

use crate::links::files_below;

/// Tables and keys whose words say how results are written, and what shape a heap has: nothing is computed otherwise.
const DESCRIBED: [&str; 2] = ["output", "heap.shape"];
/// Tables that the other solver leaves alone.
const OF_GRID: [&str; 1] = ["coupling"];
const OF_PARTICLES: [&str; 2] = ["particles", "overlap"];

/// All words of a key or of the alternatives of a table, and one of them.
type Word = (Vec<&'static str>, &'static str);

/// What is wrong with the words that nothing uses.
pub fn unused(root: &Path) -> io::Result<Vec<String>> {
    let mut problems = Vec::new();
    let mut used = BTreeSet::new();
    let mut take = |name: &str, case: Result<&Case, String>| match case.and_then(words_of_case) {
        Ok(words) => used.extend(words),
        Err(problem) => problems.push(format!("{name}: {problem}")),
    };
    let mut files = Vec::new();
    files_below(&root.join("cases"), "toml", &mut files)?;
    // Plans of many runs change numbers of cases that are here.
    for path in files.iter().filter(|path| !path.starts_with(root.join("cases/sweeps"))) {
        let loaded = case::load(path, &[]).map_err(|error| error.to_string());
        take(&path.display().to_string(), loaded.as_ref().map(|loaded| &loaded.case).map_err(Clone::clone));
    }
    for verification in CASES {
        let Some(posed) = &verification.posed else { continue };
        let runs = Expected::parse(verification.expected)
            .map_err(|problem| problem.to_string())
            .and_then(|expected| posed.loaded(&expected));
        match runs {
            Ok(runs) => runs.iter().for_each(|(_, loaded)| take(verification.name, Ok(&loaded.case))),
            Err(problem) => take(verification.name, Err(problem)),
        }
    }
    problems.extend(left_out(&used));
    Ok(problems)
}

/// The words that are not among those used, each once.
fn left_out(used: &BTreeSet<Word>) -> Vec<String> {
    let mut found = BTreeSet::new();
    for key in &Case::docs().keys {
        collect(key.name, key, &mut Vec::new(), &mut |path, words, word| {
            let described = DESCRIBED
                .iter()
                .any(|of| path.strip_prefix(of).is_some_and(|rest| rest.is_empty() || rest.starts_with('.')));
            let directions = words.iter().any(|word| names_a_direction(word));
            if !described && !directions && !used.contains(&(words.to_vec(), word)) {
                found.insert(format!(
                    "`{path} = \"{word}\"` is used by no shipped case and no row of verification: remove it \
                     (sazanami-case/src/removed.rs)"
                ));
            }
        });
    }
    found.into_iter().collect()
}

/// Whether a word names a direction or a side of the box.
fn names_a_direction(word: &str) -> bool {
    ["x1", "x2", "x3"].iter().any(|name| word.starts_with(name))
}

/// The words among which a key chooses: those of a set, and those that may stand for a value.
fn words_of(key: &KeyDoc) -> Vec<&'static str> {
    match &key.value {
        ValueDoc::Words(words) => words.iter().map(|(word, _)| *word).collect(),
        ValueDoc::Leaf(kind, _) => kind.split('`').skip(1).step_by(2).collect(),
        _ => Vec::new(),
    }
}

/// The alternatives of a table that are words by themselves.
fn alternatives(docs: &TableDoc) -> Vec<&'static str> {
    docs.keys.iter().filter(|key| matches!(key.value, ValueDoc::Word)).map(|key| key.name).collect()
}

/// Tells each word of a key and of the tables in it, with the path of its key and all words of that key. A table within itself has been
/// told: `within` names the tables around.
fn collect(
    path: &str,
    key: &KeyDoc,
    within: &mut Vec<&'static str>,
    tell: &mut impl FnMut(&str, &[&'static str], &'static str),
) {
    let docs = key.nested_docs();
    for words in [words_of(key), alternatives(&docs)] {
        words.iter().for_each(|word| tell(path, &words, word));
    }
    if !within.contains(&docs.name) {
        within.push(docs.name);
        docs.keys.iter().for_each(|nested| collect(&format!("{path}.{}", nested.name), nested, within, tell));
        within.pop();
    }
}

/// The words that a case runs with.
fn words_of_case(case: &Case) -> Result<BTreeSet<Word>, String> {
    let mut copy: Table =
        toml::from_str(&resolved::write(case, resolved::Paths::NameOnly)).map_err(|error| error.to_string())?;
    let others = if case.solver == Solver::Mics { &OF_PARTICLES[..] } else { &OF_GRID[..] };
    others.iter().for_each(|name| drop(copy.remove(*name)));
    let mut found = BTreeSet::new();
    take_table(&Case::docs(), &copy, &mut found);
    Ok(found)
}

fn take_table(docs: &TableDoc, table: &Table, found: &mut BTreeSet<Word>) {
    docs.keys
        .iter()
        .filter_map(|key| Some((key, table.get(key.name)?)))
        .for_each(|(key, value)| take(key, value, found));
}

fn take(key: &KeyDoc, value: &Value, found: &mut BTreeSet<Word>) {
    let docs = key.nested_docs();
    match value {
        Value::String(text) => {
            for words in [words_of(key), alternatives(&docs)] {
                let word = words.iter().copied().find(|word| word == text);
                found.extend(word.map(|word| (words, word)));
            }
        }
        Value::Array(list) => list.iter().for_each(|value| take(key, value, found)),
        Value::Table(table) if matches!(key.value, ValueDoc::Named(_)) => {
            table.values().filter_map(Value::as_table).for_each(|table| take_table(&docs, table, found));
        }
        Value::Table(table) => take_table(&docs, table, found),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = r#"
# fluid.viscosity = "explicit", and boundary.x1 = "slip"
solver = "mics"
domain = { size = ["8 mm", "8 mm", "8 mm"], cells = [8, 8, 8] }
run.until = "1 ms"
contact."sand/sand" = { restitution = 0.5 }
material.sand.density = "2650 kg/m^3"
[[grains]]
shape.sphere.diameter = "1 mm"
material = "sand"
placement.list = [{ position = ["4 mm", "4 mm", "4 mm"] }]
"#;

    /// The problems where this case is all there is.
    fn problems(overrides: &[&str]) -> Vec<String> {
        let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
        let loaded = case::parse(Path::new("a.toml"), CASE, &overrides).unwrap_or_else(|error| panic!("{error}"));
        left_out(&words_of_case(&loaded.case).unwrap())
    }

    fn misses(problems: &[String], word: &str) -> bool {
        problems.iter().any(|problem| problem.starts_with(&format!("`{word}` ")))
    }

    #[test]
    fn a_word_is_used_where_a_case_runs_with_it() {
        let explicit = "fluid.viscosity = \"explicit\"";
        // It stands in a comment alone.
        assert!(misses(&problems(&[]), explicit));
        assert!(!misses(&problems(&["fluid.viscosity=explicit"]), explicit));
        // So do alternatives that are words, words beside values, and keys of tables in lists.
        let slip = "boundary.x1_lower = \"slip\"";
        assert!(misses(&problems(&[]), slip) && !misses(&problems(&["boundary.x2=slip"]), slip));
        let rough = "dem.film_roughness = \"none\"";
        assert!(misses(&problems(&[]), rough) && !misses(&problems(&["dem.film_roughness=none"]), rough));
        let fixed = "grains.motion = \"fixed\"";
        assert!(misses(&problems(&[]), fixed) && !misses(&problems(&["grains.0.motion=fixed"]), fixed));
    }

    #[test]
    fn defaults_and_lines_of_a_preset_are_used_by_a_case_that_runs_them() {
        let words = ["fluid.convection = \"consistent\"", "fluid.convection = \"velocity_form\""];
        let missing = |overrides: &[&str]| words.map(|word| misses(&problems(overrides), word));
        assert_eq!(missing(&[]), [false, true]);
        assert_eq!(missing(&["preset=paper_literal"]), [true, false]);
        // Tables of the other solver run nothing.
        assert!(misses(&problems(&[]), "particles.projection = \"conjugate\""));
    }
}
