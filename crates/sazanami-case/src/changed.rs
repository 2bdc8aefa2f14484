//! Keys that a case sets to something other than their defaults.
//!
//! A key is tried by leaving it out: if the case is still one and means the same, the key had its default. So a default that
//! depends on other keys is judged as what it is in this very case.

use std::collections::BTreeMap;
use std::path::Path;

use toml::{Table, Value};

use crate::explain::declared;
use crate::resolved::{self, Paths};
use crate::{Case, LoadedCase, parse};

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

/// Elements of a list of tables whose keys are tried, from the first on: each trial reads the whole case.
pub const MOST_TRIED: usize = 16;

/// The keys of `loaded` that are required or differ from their defaults, in the order of their paths; of lists of tables those
/// of the first [`MOST_TRIED`] elements.
#[must_use]
pub fn changed(loaded: &LoadedCase) -> Vec<Changed> {
    let Ok(whole) = resolved::write(&loaded.case, Paths::AsGiven).parse::<Table>() else { return Vec::new() };
    let of_whole = |path: &Vec<String>| tried(&loaded.path, &loaded.case, &whole, path);
    let short = shortened(loaded, &whole);
    let mut paths = Vec::new();
    leaves(short.as_ref().map_or(&whole, |(_, tree)| tree), &mut Vec::new(), &mut paths);
    let is_tried = |path: &[String]| path.get(1).and_then(|n| n.parse().ok()).is_none_or(|n: usize| n < MOST_TRIED);
    paths.retain(|path| !NAMES.contains(&path[0].as_str()) && is_tried(path));
    let Some((case, tree)) = short else { return paths.iter().filter_map(of_whole).collect() };
    // Keys of the long lists stand for themselves. Defaults of others may depend on elements that were left out: those that the
    // shortened case has as defaults are left out of the whole one at once, the rest one by one.
    let of_list = |path: &[String]| tables_of(&whole[&path[0]]).is_some_and(|list| list.len() > MOST_TRIED);
    let found: Vec<Option<Changed>> = paths.iter().map(|path| tried(&loaded.path, &case, &tree, path)).collect();
    let mut without = whole.clone();
    let defaults = paths.iter().zip(&found).filter(|(path, found)| found.is_none() && !of_list(path));
    defaults.for_each(|(path, _)| remove(&mut without, path));
    let confirmed = parse(&loaded.path, &without.to_string(), &[]).is_ok_and(|other| other.case == loaded.case);
    let judged = paths.iter().zip(found).map(|(path, found)| match found {
        found if of_list(path) => found,
        None if confirmed => None,
        _ => of_whole(path),
    });
    judged.flatten().collect()
}

/// Lists of tables that are longer than what is tried of them, with their lengths.
#[must_use]
pub fn longer_than_tried(loaded: &LoadedCase) -> Vec<(String, usize)> {
    let tree = resolved::write(&loaded.case, Paths::AsGiven).parse::<Table>().unwrap_or_default();
    let long = tree.into_iter().filter_map(|(name, value)| Some((name, tables_of(&value)?.len())));
    long.filter(|(_, length)| *length > MOST_TRIED).collect()
}

/// The elements of a list of tables.
fn tables_of(value: &Value) -> Option<&Vec<Value>> {
    value.as_array().filter(|list| list.iter().any(Value::is_table))
}

/// The case, of this copy, without the elements of long lists that are not tried; `None` where there are none or others need them.
fn shortened(loaded: &LoadedCase, whole: &Table) -> Option<(Case, Table)> {
    let mut short = whole.clone();
    for (_, value) in &mut short {
        if tables_of(value).is_some() {
            value.as_array_mut()?.truncate(MOST_TRIED);
        }
    }
    let case = (short != *whole).then(|| parse(&loaded.path, &short.to_string(), &[]).ok())??;
    Some((case.case, short))
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
fn tried(file: &Path, case: &Case, tree: &Table, path: &[String]) -> Option<Changed> {
    let value = at(tree, path)?;
    let mut without = tree.clone();
    remove(&mut without, path);
    let default = match parse(file, &without.to_string(), &[]) {
        Err(_) => DefaultValue::Required,
        Ok(other) if other.case == *case => return None,
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
    use super::*;

    const CASE: &str = r#"
        title = "<b>"
        [domain]
        size = ["8 mm", "8 mm", "8 mm"]
        cells = [12, 12, 12]
        [fluid]
        cfl = 0.3
        viscosity = "auto"
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
        assert_eq!(of("fluid.viscosity"), None);
        assert_eq!(of("title"), None);
        assert!(found.iter().all(|key| !key.about.is_empty()), "{found:#?}");
        // The copy of the case has every key, and as many changed ones.
        let copy = parse(Path::new("a.toml"), &resolved::write(&loaded.case, Paths::AsGiven), &[]).unwrap();
        assert_eq!(changed(&copy), found);
        assert!(values(&copy).len() > 2 * found.len());
        assert_eq!(values(&copy)["fluid.cfl"], "0.3");
    }

    /// [`CASE`] with so many drops, each told apart by its size.
    fn of_drops(count: usize) -> LoadedCase {
        let one = &CASE[CASE.find("[[liquid]]").unwrap()..CASE.find("[run]").unwrap()];
        let drop = |n: usize| one.replace("3 mm", &format!("{}.5 mm", 1 + n % 3));
        let all: String = (0..count).map(drop).collect();
        parse(Path::new("a.toml"), &CASE.replace(one, &all), &[]).unwrap()
    }

    #[test]
    fn keys_of_long_lists_are_those_of_their_first_elements() {
        let long = of_drops(200);
        let (found, begun) = (changed(&long), changed(&of_drops(MOST_TRIED)));
        assert_eq!(found, begun);
        assert!(found.iter().any(|key| key.path == "liquid.15.region.sphere.diameter"), "{found:#?}");
        assert_eq!(longer_than_tried(&long), [("liquid".to_owned(), 200)]);
        assert_eq!(longer_than_tried(&of_drops(MOST_TRIED)), []);
        // Elements that others need stay: a probe on the last of twenty populations.
        let kind = |n: usize| {
            format!(
                "[[grains]]\nname = \"g{n}\"\nmaterial = \"m\"\nshape.sphere = {{ diameter = \"0.2 mm\" }}\nplacement.list = [{{ position = [\"{} mm\", \"1 mm\", \"1 mm\"] }}]\n",
                0.3 + 0.3 * n as f64
            )
        };
        let all: String = (0..20).map(kind).collect();
        let probe = "[material.m]\ndensity = \"2500 kg/m^3\"\n[contact.default]\nnormal_stiffness = \"1e3 N/m\"\n[[probe]]\nname = \"p\"\nbody = { population = \"g19\", index = 0 }\n";
        let text = CASE.replace("[[liquid]]", &format!("{all}{probe}[[liquid]]"));
        let found = changed(&parse(Path::new("a.toml"), &text, &[]).unwrap());
        let default = |path: &str| found.iter().find(|key| key.path == path).map(|key| key.default.clone());
        assert_eq!(default("grains.15.shape.sphere.diameter"), Some(DefaultValue::Required));
        assert_eq!(default("grains.16.shape.sphere.diameter"), None);
        assert!(default("probe.0.body.population").is_some(), "{found:#?}");
        // A default that hangs on an element beyond those that are tried is that of the whole case.
        let fine = "[[grains]]\nname = \"fine\"\nmaterial = \"m\"\nshape.sphere = { diameter = \"20 um\" }\nplacement.lattice = { counts = [11, 10, 10] }\n";
        let form = |word: &str| {
            let all = format!("{all}{fine}{}", probe.split("[[probe]]").next().unwrap());
            let text = CASE.replace("[[liquid]]", &format!("{all}[output]\ngrain_form = \"{word}\"\n[[liquid]]"));
            let found = changed(&parse(Path::new("a.toml"), &text, &[]).unwrap());
            found.iter().find(|key| key.path == "output.grain_form").map(|key| key.default.clone())
        };
        assert_eq!(form("points"), None);
        assert_eq!(form("both"), Some(DefaultValue::Value("\"points\"".into())));
    }
}
