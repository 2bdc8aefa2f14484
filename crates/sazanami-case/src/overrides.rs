//! `--set path=value`: lays a value over the case file. The path is made of keys and list positions
//! joined by dots, `liquid.0.fall.speed`; the value is TOML, or else a text without quotes.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::diagnostics::Diagnostics;
use crate::source::Source;
use crate::suggest::nearest;

/// The values of the overrides as `v=value`, each behind as many blanks as put its places where they belong.
pub fn padded_values(source: &Source) -> Vec<String> {
    let pad = |(start, text): (usize, &str)| {
        let value_start = text.find('=').map_or(text.len(), |at| at + 1);
        format!("{}v={}", " ".repeat((start + value_start).saturating_sub(2)), &text[value_start..])
    };
    source.overrides().map(pad).collect()
}

/// Lays the overrides of the source over the tree, the later over the earlier; `padded` are its
/// [`padded_values`].
pub fn apply<'i>(tree: &mut Spanned<DeTable<'i>>, source: &Source, padded: &'i [String], report: &mut Diagnostics) {
    for ((start, text), padded) in source.overrides().zip(padded) {
        let Some((path, _)) = text.split_once('=') else {
            report
                .error(start..start + text.len(), "an override needs an equals sign")
                .label("expected `path=value`")
                .help("for example `--set liquid.0.fall.speed=\"4.5 m/s\"`");
            continue;
        };
        let path_span = start..start + path.len();
        let keys = match split_path(path) {
            Ok(keys) => keys,
            Err(message) => {
                report.error(path_span, message).label("expected keys joined by dots, such as `liquid.0.fall.speed`");
                continue;
            }
        };
        let value_start = start + path.len() + 1;
        let value = match parse_value(padded, value_start) {
            Ok(value) => value,
            Err(message) => {
                report.error(value_start..start + text.len(), message).help("texts within lists need quotes");
                continue;
            }
        };
        if let Err(message) = put(tree.get_mut(), &keys, path_span.clone(), value) {
            report.error(path_span, message).label("the case has nothing at this place");
        }
    }
}

/// Refuses overrides of keys other than those `known`, each a table or a `table.key`, and what is under them; those
/// that are no overrides at all are found by [`apply`].
pub fn only_of(source: &Source, known: &[&str], report: &mut Diagnostics) {
    for (start, text) in source.overrides() {
        let Some((path, _)) = text.split_once('=') else { continue };
        let Ok(keys) = split_path(path) else { continue };
        if known.iter().any(|known| is_under(&keys, known)) {
            continue;
        }
        let finding =
            report.error(start..start + path.len(), format!("`{}` cannot be changed afterwards", path.trim()));
        let tables = known.iter().copied().filter(|known| !known.contains('.'));
        let meant = nearest(&keys.join("."), known.iter().copied()).or(nearest(&keys[0], tables));
        let is_table_known = known.iter().any(|known| known.split('.').next() == Some(&keys[0]));
        match meant {
            Some(meant) => finding.label(format!("did you mean `{meant}`?")),
            None if is_table_known => finding.label("its data were sampled during the run and cannot be sampled again"),
            None => finding.label("this key acted during the run: to change it, run the case again"),
        };
        finding.help(format!(
            "{} can be; for another one run the case again with it, `sazanami run CASE.toml --set ...`",
            listed(known)
        ));
    }
}

/// Whether the path of `keys` is `known`, a table or a `table.key`, or under it.
fn is_under(keys: &[String], known: &str) -> bool {
    known.split('.').count() <= keys.len() && known.split('.').zip(keys).all(|(known, key)| known == key)
}

/// The keys, or the tables that keys are under, in a sentence.
fn listed(known: &[&str]) -> String {
    let named: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
    let (last, others) = named.split_last().map_or(("", &[][..]), |(last, others)| (last.as_str(), others));
    let under = if known.iter().any(|name| name.contains('.')) { "" } else { "keys under " };
    format!("{under}{} and {last}", others.join(", "))
}

/// Splits `a.0."b.c"[1]` at its dots and brackets; within quotes a backslash stands before a quote or a backslash of the key.
fn split_path(path: &str) -> Result<Vec<String>, String> {
    let mut keys = Vec::new();
    let mut key = String::new();
    let mut quoted = false;
    let mut was_quoted = false;
    // Behind `]` a key has ended already.
    let mut is_closed = false;
    let empty = || "a key in the path of an override is empty".to_owned();
    if path.trim().is_empty() {
        return Err("the path of an override is missing".into());
    }
    let mut characters = path.trim().chars().peekable();
    while let Some(c) = characters.next() {
        match c {
            '\\' if quoted => key.push(characters.next_if(|&next| matches!(next, '"' | '\\')).unwrap_or(c)),
            '"' => {
                quoted = !quoted;
                was_quoted = true;
            }
            '.' | '[' if !quoted => {
                if !key.is_empty() || was_quoted {
                    keys.push(std::mem::take(&mut key));
                } else if !is_closed {
                    return Err(empty());
                }
                (was_quoted, is_closed) = (false, false);
            }
            ']' if !quoted => {
                if key.is_empty() && !was_quoted {
                    return Err(empty());
                }
                keys.push(std::mem::take(&mut key));
                (was_quoted, is_closed) = (false, true);
            }
            _ => key.push(c),
        }
    }
    if quoted {
        return Err("a quote is not closed".into());
    }
    match (!key.is_empty() || was_quoted, is_closed) {
        (true, _) => keys.push(key),
        (false, true) => {}
        (false, false) => return Err(empty()),
    }
    Ok(keys)
}

/// Reads a value that begins at `start` as TOML; what is no TOML is a text.
fn parse_value(padded: &str, start: usize) -> Result<Spanned<DeValue<'_>>, String> {
    let text = padded.get(start..).unwrap_or_default();
    match DeTable::parse(padded).map(|mut table| table.get_mut().remove("v")) {
        Ok(Some(value)) => Ok(Spanned::new(start..padded.len(), value.into_inner())),
        _ if text.trim_start().starts_with(['[', '{', '"', '\'']) => Err("this value is not TOML".into()),
        _ => Ok(Spanned::new(start..padded.len(), DeValue::String(text.trim().into()))),
    }
}

/// Puts the value at the path, making tables on the way.
fn put<'i>(
    table: &mut DeTable<'i>,
    keys: &[String],
    span: Range<usize>,
    value: Spanned<DeValue<'i>>,
) -> Result<(), String> {
    let (key, rest) = keys.split_first().ok_or("the path of an override is missing")?;
    if rest.is_empty() {
        table.remove(key.as_str());
        table.insert(Spanned::new(span, key.clone().into()), value);
        return Ok(());
    }
    if !table.contains_key(key.as_str()) {
        let empty = Spanned::new(span.clone(), DeValue::Table(DeTable::new()));
        table.insert(Spanned::new(span.clone(), key.clone().into()), empty);
    }
    let inner = table.get_mut(key.as_str()).ok_or("the path of an override is missing")?;
    put_inside(inner.get_mut(), key, rest, span, value)
}

fn put_inside<'i>(
    inner: &mut DeValue<'i>,
    name: &str,
    keys: &[String],
    span: Range<usize>,
    value: Spanned<DeValue<'i>>,
) -> Result<(), String> {
    match inner {
        DeValue::Table(table) => {
            // A table that stands alone where a list may is the first of it.
            let is_named = ["material", "contact"].contains(&name);
            let is_first = keys.len() > 1 && keys[0] == "0" && !is_named && !table.contains_key("0");
            put(table, &keys[usize::from(is_first)..], span, value)
        }
        DeValue::Array(array) => {
            let (key, rest) = keys.split_first().ok_or("the path of an override is missing")?;
            let length = array.len();
            let element = key.parse::<usize>().ok().and_then(|n| array.get_mut(n)).ok_or_else(|| {
                format!("`{name}` is a list of {length}: `{key}` is not a position in it (the first is 0)")
            })?;
            if rest.is_empty() {
                *element = value;
                return Ok(());
            }
            put_inside(element.get_mut(), key, rest, span, value)
        }
        // A word such as `placement = "x"` gives way to a table.
        other => {
            *other = DeValue::Table(DeTable::new());
            match other {
                DeValue::Table(table) => put(table, keys, span, value),
                _ => Err("the path of an override is missing".into()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laid_over(text: &str, overrides: &[&str]) -> (toml::Table, Diagnostics) {
        let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
        let source = Source::new("c.toml", text, &overrides);
        let mut tree = DeTable::parse(source.text()).unwrap();
        let padded = padded_values(&source);
        let mut report = Diagnostics::default();
        apply(&mut tree, &source, &padded, &mut report);
        let table = serde::Deserialize::deserialize(toml::Deserializer::from(tree)).unwrap();
        (table, report)
    }

    #[test]
    fn values_are_laid_over_tables_and_lists() {
        let (table, report) = laid_over(
            "[a]\nb = 1\n[[c]]\nd = \"x\"\n",
            &["a.b=2", "a.e=9 m/s", "c.0.d=[1, 2]", "f.\"g/h\".i=true", "c[0].k=\"q\""],
        );
        assert!(report.is_empty());
        assert_eq!(table["a"]["b"].as_integer(), Some(2));
        assert_eq!(table["a"]["e"].as_str(), Some("9 m/s"));
        assert_eq!(table["c"][0]["d"][1].as_integer(), Some(2));
        assert_eq!(table["c"][0]["k"].as_str(), Some("q"));
        assert_eq!(table["f"]["g/h"]["i"].as_bool(), Some(true));
        let (table, report) = laid_over("", &[r#"a."b\"c\\d\e".f=1"#, r"g\h=2"]);
        assert!(report.is_empty());
        assert_eq!(table["a"][r#"b"c\d\e"#]["f"].as_integer(), Some(1));
        assert_eq!(table[r"g\h"].as_integer(), Some(2));
        // A table that stands alone in place of a list.
        let (table, _) = laid_over("[a]\nb = 1\n", &["a.0.b=2", "a.1.b=3"]);
        assert_eq!((table["a"]["b"].as_integer(), table["a"]["1"]["b"].as_integer()), (Some(2), Some(3)));
    }

    #[test]
    fn what_was_gathered_is_not_changed_afterwards() {
        let told = |path: &str| {
            let source = Source::new("c.toml", "", &[path.to_owned()]);
            let mut report = Diagnostics::default();
            only_of(&source, &["ripples.margin", "ripples.measured"], &mut report);
            report.render(&source, false)
        };
        let can = |path: &str| !told(path).contains("cannot be changed");
        assert!(can("ripples.margin=5 mm") && can("ripples.measured.0.time=1 s"));
        let gathered = told("ripples.layer_thickness=1 m");
        assert!(gathered.contains("sampled during the run"), "{gathered}");
        assert!(gathered.contains("`ripples.margin` and `ripples.measured` can be"), "{gathered}");
        assert!(told("ripples.margn=5 mm").contains("did you mean `ripples.margin`?"));
        assert!(told("ripples={}").contains("cannot be changed afterwards"));
    }

    #[test]
    fn wrong_overrides_are_named() {
        let (_, report) = laid_over("[[c]]\nd = 1\n", &["nothing", "c.3.d=1", "x=[1 m]", "=3"]);
        assert_eq!(report.sorted().len(), 4);
        for path in ["run..until", ".run.until", "run.until.", "c[].d"] {
            let (table, report) = laid_over("[[c]]\nd = 1\n", &[&format!("{path}=1")]);
            let told = report.sorted();
            assert!(told.len() == 1 && told[0].title.contains("is empty"), "{path}");
            assert!(!table.contains_key("run") && table["c"][0]["d"].as_integer() == Some(1), "{path}");
        }
        // Negative control: a key that is a quoted nothing is one.
        assert_eq!(laid_over("", &["f.\"\"=1"]).0["f"][""].as_integer(), Some(1));
        assert!(report.sorted().iter().any(|d| d.title.contains("`3` is not a position")));
    }
}
