//! The table of a sweep: a row for each run with its parameters, its state and what it found.
//!
//! Nothing in it depends on the machine or on interruptions, so that a sweep that was killed and went on has the table of
//! one without a break, to the byte.

use std::path::Path;

use sazanami_io::table::write_csv;
use serde_json::Value;

use crate::posed::Run;
use crate::state::{Progressed, State};

/// Name of the table.
pub const TABLE: &str = "sweep.csv";

/// Paths in the summary that have a column of their own beside the observables.
const SAID: [&str; 3] = ["time_s", "steps", "state_hash"];

/// Writes the table into `folder`.
pub fn write(folder: &Path, runs: &[Run], states: &[Progressed]) -> std::io::Result<()> {
    write_csv(&folder.join(TABLE), rows(runs, states))
}

/// The heading and a row for each run.
pub fn rows(runs: &[Run], states: &[Progressed]) -> Vec<Vec<String>> {
    let found: Vec<Vec<(String, String)>> = states.iter().map(findings).collect();
    let names = names(&found);
    let keys: Vec<&String> = runs.first().into_iter().flat_map(|run| &run.settings).map(|(key, _)| key).collect();
    let texts = |list: &[&str]| list.iter().map(|text| (*text).to_owned()).collect::<Vec<String>>();
    let heading = [
        texts(&["run", "status"]),
        keys.into_iter().cloned().collect(),
        names.iter().map(|name| (*name).clone()).collect(),
        texts(&["failure"]),
    ]
    .concat();
    let row = |((run, progressed), own): ((&Run, &Progressed), &Vec<(String, String)>)| {
        let cell =
            |name: &&String| own.iter().find(|(found, _)| found == *name).map_or("", |(_, value)| value).to_owned();
        let failure = if let State::Failed(message) = &progressed.state { message.as_str() } else { "" };
        [
            texts(&[&run.name, progressed.state.word()]),
            run.settings.iter().map(|(_, value)| value.clone()).collect(),
            names.iter().map(cell).collect(),
            texts(&[failure]),
        ]
        .concat()
    };
    std::iter::once(heading).chain(runs.iter().zip(states).zip(&found).map(row)).collect()
}

/// Names of the findings of all runs, each once.
pub fn names(found: &[Vec<(String, String)>]) -> Vec<&String> {
    let mut names = Vec::new();
    for (name, _) in found.iter().flatten() {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Findings of a run, with their names in the summary.
pub fn findings(progressed: &Progressed) -> Vec<(String, String)> {
    let mut found = Vec::new();
    // What a run on its way has so far is in its own folder.
    if !progressed.state.is_ended() {
        return found;
    }
    for name in SAID {
        leaves(name, &progressed.summary[name], &mut found);
    }
    leaves("", &progressed.summary["observables"], &mut found);
    found
}

/// Numbers, texts and truths below a value, with the path to each.
fn leaves(name: &str, value: &Value, found: &mut Vec<(String, String)>) {
    match value {
        Value::Object(table) => {
            for (key, inner) in table {
                let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
                leaves(&name, inner, found);
            }
        }
        Value::Number(number) => found.push((name.to_owned(), number.to_string())),
        Value::String(text) => found.push((name.to_owned(), text.clone())),
        Value::Bool(is) => found.push((name.to_owned(), is.to_string())),
        Value::Array(_) | Value::Null => {}
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn rows_have_parameters_states_and_findings() {
        let run = |name: &str, value: &str| Run {
            name: name.to_owned(),
            settings: vec![("a.b".to_owned(), value.to_owned())],
            hash: String::new(),
            needs: crate::Needs::default(),
            text: String::new(),
            most_steps: None,
        };
        let runs = [run("001", "1"), run("002", "{ x = 1, y = \"2\" }"), run("003", "3")];
        let summary =
            json!({ "time_s": 0.5, "wall_s": 9, "observables": { "erosion": { "volume_mm3": 4.5, "list": [1] } } });
        let states = [
            Progressed { state: State::Finished, summary: summary.clone() },
            Progressed { state: State::Failed("a, b\nc".into()), summary: json!({ "time_s": 0.1 }) },
            Progressed { state: State::BrokenOff, summary },
        ];
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), &runs, &states).unwrap();
        let text = std::fs::read_to_string(folder.path().join(TABLE)).unwrap();
        let expected = "run,status,a.b,time_s,erosion.volume_mm3,failure\n001,finished,1,0.5,4.5,\n\
                        002,failed,\"{ x = 1, y = \"\"2\"\" }\",0.1,,\"a, b\nc\"\n003,broken off,3,,,\n";
        assert_eq!(text, expected);
    }
}
