//! From text to [`CaseText`]: parses the file, lays the overrides over it, and collects every
//! structural error: after each, what is wrong is taken out and the rest is read again.

use std::collections::BTreeSet;
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::diagnostics::Diagnostics;
use super::overrides;
use super::schema::CaseText;
use super::source::Source;
use super::suggest::nearest;

/// A case as read, with the keys that were left out because they were wrong.
#[derive(Debug, Default)]
pub struct Reading {
    /// What could be read.
    pub text: CaseText,
    /// Keys that were wrong, and those they were probably meant to be: their absence is no second error.
    pub forgiven: BTreeSet<String>,
}

/// More errors than this help nobody.
const MOST_ERRORS: usize = 40;

/// Reads the source; errors go to `report`.
#[must_use]
pub fn read(source: &Source, report: &mut Diagnostics) -> Reading {
    let padded = overrides::padded_values(source);
    let (mut tree, syntax_errors) = DeTable::parse_recoverable(source.text());
    if !syntax_errors.is_empty() {
        for error in syntax_errors.iter().take(MOST_ERRORS) {
            let span = error.span().unwrap_or(0..0);
            report
                .error(span, "this is not TOML")
                .label(error.message().to_owned())
                .help("texts stand in quotes, tables in brackets, lists in brackets with commas");
        }
        return Reading::default();
    }
    overrides::apply(&mut tree, source, &padded, report);
    let mut forgiven = BTreeSet::new();
    for _ in 0..MOST_ERRORS {
        let attempt = CaseText::deserialize(toml::Deserializer::from(tree.clone()));
        let error = match attempt {
            Ok(text) => return Reading { text, forgiven },
            Err(error) => error,
        };
        let Some(span) = error.span() else {
            report.error_in_file(error.message().to_owned());
            break;
        };
        describe(error.message(), span.clone(), source, report, &mut forgiven);
        match remove(tree.get_mut(), &span) {
            Some(key) => forgiven.insert(key),
            None => break,
        };
        // A table whose only choice was wrong is no second error.
        if error.message().starts_with("unknown variant") {
            forgiven.extend(drop_emptied(tree.get_mut(), &span));
        }
    }
    Reading { text: CaseText::default(), forgiven }
}

/// Turns a message of the deserialiser into a finding.
fn describe(
    message: &str,
    span: Range<usize>,
    source: &Source,
    report: &mut Diagnostics,
    forgiven: &mut BTreeSet<String>,
) {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let what = if message.starts_with("unknown field") {
        "key"
    } else if message.starts_with("unknown variant") {
        "choice"
    } else {
        let place = source.locate(span.clone());
        let text = &place.text[place.span];
        if let Some(rest) = message.strip_prefix("invalid type: ") {
            let (found, expected) = rest.split_once(", expected ").unwrap_or((rest, "something else"));
            let expected = expected.replace("unit variant", "a word").replace("newtype variant", "a table");
            report
                .error(span, format!("{found} does not fit here"))
                .label(format!("expected {}", plain_type(&expected)));
        } else if message.starts_with("wanted exactly 1 element") {
            report
                .error(span, "exactly one alternative has to be chosen here")
                .label("this names none or several")
                .help("keep one of the keys and leave out the others");
        } else {
            report.error(span, message.to_owned()).label(if text.len() > 60 { "" } else { "here" });
        }
        return;
    };
    let (unknown, known) = quoted.split_first().map_or(("", &[][..]), |(first, rest)| (*first, rest));
    let finding = report.error(span, format!("unknown {what} `{unknown}`"));
    let mut sorted = known.to_vec();
    sorted.sort_unstable();
    match nearest(unknown, sorted.iter().copied()) {
        Some(meant) => {
            finding.label(format!("did you mean `{meant}`?"));
            forgiven.insert(meant.to_owned());
        }
        None => {
            finding.label(format!("not a {what} known here"));
        }
    }
    if !sorted.is_empty() {
        finding.help(format!("known here: {}", sorted.join(", ")));
    }
}

/// A type of Rust in the words of the case file.
fn plain_type(expected: &str) -> String {
    if expected.starts_with("struct") || expected.starts_with("a map") || expected == "a table" {
        "a table of keys".into()
    } else if expected.starts_with("a sequence") {
        "a list (`[[...]]` or `[...]`)".into()
    } else if let Some(rest) = expected.strip_prefix("enum ") {
        let name = rest.trim_end_matches("Text").to_lowercase();
        format!("a choice of {name}")
    } else {
        expected.to_owned()
    }
}

/// Takes the smallest entry that holds `span` out of the tree; returns its key.
fn remove(table: &mut DeTable<'_>, span: &Range<usize>) -> Option<String> {
    let holds = |outer: Range<usize>| outer.start <= span.start && span.end <= outer.end;
    let exact = table
        .iter()
        .find(|(key, value)| key.span() == *span || (value.span() == *span && !has_inside(value.get_ref(), span)))
        .map(|(key, _)| key.get_ref().to_string());
    if let Some(key) = exact {
        table.remove(key.as_str());
        return Some(key);
    }
    for (_, value) in table.iter_mut() {
        if let Some(key) = remove_inside(value.get_mut(), span) {
            return Some(key);
        }
    }
    let around = table
        .iter()
        .find(|(key, value)| holds(key.span()) || holds(value.span()))
        .map(|(key, _)| key.get_ref().to_string())?;
    table.remove(around.as_str());
    Some(around)
}

/// Takes out tables that lost their only entry at `span`; returns their keys.
fn drop_emptied(table: &mut DeTable<'_>, span: &Range<usize>) -> Vec<String> {
    let mut dropped = Vec::new();
    // `region.shpere = {}` has its table at the key before the dot, `region = { shpere = {} }` round it.
    let near = |key: Range<usize>, value: Range<usize>| {
        (value.start <= span.start && span.end <= value.end) || (key.end <= span.start && span.start - key.end < 4)
    };
    let is_empty = |value: &DeValue<'_>| value.as_table().is_some_and(|inner| inner.is_empty());
    let emptied: Vec<String> = table
        .iter()
        .filter(|(key, value)| is_empty(value.get_ref()) && near(key.span(), value.span()))
        .map(|(key, _)| key.get_ref().to_string())
        .collect();
    for key in emptied {
        table.remove(key.as_str());
        dropped.push(key);
    }
    for (_, value) in table.iter_mut() {
        match value.get_mut() {
            DeValue::Table(inner) => dropped.extend(drop_emptied(inner, span)),
            DeValue::Array(array) => {
                for element in array.iter_mut() {
                    if let DeValue::Table(inner) = element.get_mut() {
                        dropped.extend(drop_emptied(inner, span));
                    }
                }
            }
            _ => {}
        }
    }
    dropped
}

/// Whether an entry further inside has that very span.
fn has_inside(value: &DeValue<'_>, span: &Range<usize>) -> bool {
    match value {
        DeValue::Table(table) => table
            .iter()
            .any(|(key, value)| key.span() == *span || value.span() == *span || has_inside(value.get_ref(), span)),
        DeValue::Array(array) => array.iter().any(|value| has_inside(value.get_ref(), span)),
        _ => false,
    }
}

fn remove_inside(value: &mut DeValue<'_>, span: &Range<usize>) -> Option<String> {
    match value {
        DeValue::Table(table) => {
            let found = has_inside(&DeValue::Table(table.clone()), span)
                || table.iter().any(|(_, value)| contains(value, span));
            if found { remove(table, span) } else { None }
        }
        DeValue::Array(array) => array.iter_mut().find_map(|value| remove_inside(value.get_mut(), span)),
        _ => None,
    }
}

/// Whether a value, or one inside it, stretches over `span`.
fn contains(value: &Spanned<DeValue<'_>>, span: &Range<usize>) -> bool {
    let own = value.span();
    if own.start <= span.start && span.end <= own.end {
        return true;
    }
    match value.get_ref() {
        DeValue::Table(table) => table.iter().any(|(_, value)| contains(value, span)),
        DeValue::Array(array) => array.iter().any(|value| contains(value, span)),
        _ => false,
    }
}
