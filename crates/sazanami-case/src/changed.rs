//! Keys that a case sets to something other than their defaults.
//!
//! A key is tried by leaving it out: if the case is still one and means the same, the key had its default. So a default that
//! depends on other keys is judged as what it is in this very case.

use std::collections::BTreeMap;

use toml::{Table, Value};

use crate::explain::declared;
use crate::resolved::{self, Paths};
use crate::{LoadedCase, parse};

/// Value in place of a key that is left out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DefaultValue {
    /// Nothing can: without the key there is no such case.
    Required,
    /// Nothing.
    None,
    /// A value, as in the copy of a case.
    Value(String),
}

/// A key that a case sets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Changed {
    /// Path of the key; elements of lists by their numbers.
    pub path: String,
    /// Meaning.
    pub about: &'static str,
    /// Its value as text.
    pub value: String,
    /// The value without it.
    pub default: DefaultValue,
}

/// Names of a case and its texts for people, which have no default to differ from.
const NAMES: [&str; 2] = ["name", "title"];

/// The keys of `loaded` that are required or differ from their defaults, in the order of their paths.
#[must_use]
pub fn changed(loaded: &LoadedCase) -> Vec<Changed> {
    let text = resolved::write(&loaded.case, Paths::AsGiven);
    let Ok(tree) = text.parse::<Table>() else { return Vec::new() };
    let mut paths = Vec::new();
    leaves(&tree, &mut Vec::new(), &mut paths);
    paths.retain(|path| !NAMES.contains(&path[0].as_str()));
    paths.iter().filter_map(|path| tried(loaded, &tree, path)).collect()
}

/// Values of all keys of a case by their paths, as in its copy.
#[must_use]
pub fn values(loaded: &LoadedCase) -> BTreeMap<String, String> {
    let tree = resolved::write(&loaded.case, Paths::AsGiven).parse::<Table>().unwrap_or_default();
    let mut paths = Vec::new();
    leaves(&tree, &mut Vec::new(), &mut paths);
    let value = |path: &Vec<String>| Some((path.join("."), at(&tree, path)?.to_string()));
    paths.iter().filter_map(value).collect()
}

/// Paths of all values below `table`, those of lists of tables at the top by element.
fn leaves(table: &Table, path: &mut Vec<String>, found: &mut Vec<Vec<String>>) {
    for (key, value) in table {
        path.push(key.clone());
        match value {
            Value::Table(inner) if !inner.is_empty() => leaves(inner, path, found),
            Value::Array(list) if path.len() == 1 && list.iter().any(Value::is_table) => {
                for (number, element) in list.iter().enumerate() {
                    path.push(number.to_string());
                    element.as_table().into_iter().for_each(|inner| leaves(inner, path, found));
                    path.pop();
                }
            }
            _ => found.push(path.clone()),
        }
        path.pop();
    }
}

/// The key at `path`, if the case without it is none or another one.
fn tried(loaded: &LoadedCase, tree: &Table, path: &[String]) -> Option<Changed> {
    let value = at(tree, path)?;
    let mut without = tree.clone();
    remove(&mut without, path);
    let default = match parse(&loaded.path, &without.to_string(), &[]) {
        Err(_) => DefaultValue::Required,
        Ok(other) if other.case == loaded.case => return None,
        Ok(other) => {
            let copy = resolved::write(&other.case, Paths::AsGiven).parse::<Table>().unwrap_or_default();
            at(&copy, path).map_or(DefaultValue::None, |value| DefaultValue::Value(value.to_string()))
        }
    };
    let names: Vec<&str> = path.iter().map(String::as_str).filter(|name| name.parse::<usize>().is_err()).collect();
    let about = declared(&names).map_or("", |key| key.about);
    Some(Changed { path: path.join("."), about, value: value.to_string(), default })
}

/// The value at `path`.
fn at<'a>(tree: &'a Table, path: &[String]) -> Option<&'a Value> {
    let (first, rest) = path.split_first()?;
    rest.iter().try_fold(tree.get(first)?, |value, name| match value {
        Value::Table(table) => table.get(name),
        Value::Array(list) => list.get(name.parse::<usize>().ok()?),
        _ => None,
    })
}

/// Removes the value at `path`.
fn remove(tree: &mut Table, path: &[String]) {
    let Some((last, above)) = path.split_last() else { return };
    let Some((first, rest)) = above.split_first() else {
        tree.remove(last);
        return;
    };
    let holder = rest.iter().try_fold(tree.get_mut(first), |value, name| match value? {
        Value::Table(table) => Some(table.get_mut(name)),
        Value::Array(list) => Some(list.get_mut(name.parse::<usize>().ok()?)),
        _ => None,
    });
    if let Some(Some(Value::Table(table))) = holder {
        table.remove(last);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const CASE: &str = r#"
        title = "<b>"
        [domain]
        size = ["8 mm", "8 mm", "8 mm"]
        cells = [12, 12, 12]
        [fluid]
        cfl = 0.3
        vof = "plic"
        [[liquid]]
        region.sphere = { diameter = "3 mm" }
        position = ["4 mm", "4 mm", "5 mm"]
        [run]
        until = "1 ms"
    "#;

    #[test]
    fn only_keys_that_change_the_case_are_named() {
        let loaded = parse(Path::new("a.toml"), CASE, &[]).unwrap();
        let found = changed(&loaded);
        let of = |path: &str| found.iter().find(|key| key.path == path);
        assert_eq!(of("fluid.cfl").unwrap().value, "0.3");
        assert_eq!(of("fluid.cfl").unwrap().default, DefaultValue::Value("0.45".into()));
        assert!(of("fluid.cfl").unwrap().about.contains("swept"), "{:?}", of("fluid.cfl"));
        assert_eq!(of("domain.cells").unwrap().default, DefaultValue::Required);
        assert_eq!(of("liquid.0.region.sphere.diameter").unwrap().value, "\"0.003 m\"");
        // Given, but as the default is: nothing changed.
        assert_eq!(of("fluid.vof"), None);
        assert_eq!(of("title"), None);
        assert!(found.iter().all(|key| !key.about.is_empty()), "{found:#?}");
        // The copy of the case has every key, and as many changed ones.
        let copy = parse(Path::new("a.toml"), &resolved::write(&loaded.case, Paths::AsGiven), &[]).unwrap();
        assert_eq!(changed(&copy), found);
        assert!(values(&copy).len() > 2 * found.len());
        assert_eq!(values(&copy)["fluid.cfl"], "0.3");
    }
}
