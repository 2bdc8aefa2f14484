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

/// Elements of a list of tables that are looked at, from the first on: to try a key reads the case.
pub const MOST_TRIED: usize = 16;

/// The keys of `loaded` that are required or differ from their defaults, in the order of their paths; of lists of tables those
/// of the first [`MOST_TRIED`] elements.
#[must_use]
pub fn changed(loaded: &LoadedCase) -> Vec<Changed> {
    let Ok(whole) = resolved::write(&loaded.case, Paths::AsGiven).parse::<Table>() else { return Vec::new() };
    let short = shortened(loaded, &whole);
    let mut paths = Vec::new();
    leaves(short.as_ref().map_or(&whole, |(_, tree)| tree), &mut Vec::new(), &mut paths);
    let is_tried = |path: &[String]| path.get(1).and_then(|n| n.parse().ok()).is_none_or(|n: usize| n < MOST_TRIED);
    paths.retain(|path| !NAMES.contains(&path[0].as_str()) && is_tried(path));
    let whole = Whole { file: &loaded.path, case: &loaded.case, tree: &whole };
    let Some((case, tree)) = short else { return paths.iter().filter_map(|path| whole.tried(path)).collect() };
    let short = Whole { file: &loaded.path, case: &case, tree: &tree };
    let of_list = |path: &[String]| tables_of(&whole.tree[&path[0]]).is_some_and(|list| list.len() > MOST_TRIED);
    let mut found: Vec<Found> = paths.into_iter().map(|path| (short.tried(&path), path)).collect();
    // Keys of the long lists stand for themselves. Defaults of others may depend on elements that were left out.
    let mut rest: Vec<&mut Found> = found.iter_mut().filter(|(_, path)| !of_list(path)).collect();
    whole.confirm(&mut rest);
    found.into_iter().filter_map(|(found, _)| found).collect()
}

/// A path, with its key if it is required or differs from its default.
type Found = (Option<Changed>, Vec<String>);

/// A case and its copy.
struct Whole<'a> {
    file: &'a Path,
    case: &'a Case,
    tree: &'a Table,
}

impl Whole<'_> {
    /// The key at `path`, if the case without it is none or another one.
    fn tried(&self, path: &[String]) -> Option<Changed> {
        let value = at(self.tree, path)?;
        let default = match self.read(|tree| remove(tree, path)) {
            None => DefaultValue::Required,
            Some(other) if other == *self.case => return None,
            Some(other) => {
                let copy = resolved::write(&other, Paths::AsGiven).parse::<Table>().unwrap_or_default();
                at(&copy, path).map_or(DefaultValue::None, |value| DefaultValue::Value(value.to_string()))
            }
        };
        let names: Vec<&str> = path.iter().map(String::as_str).filter(|name| name.parse::<usize>().is_err()).collect();
        let about = declared(&names).map_or("", |key| key.about);
        Some(Changed { path: path.join("."), about, value: value.to_string(), default })
    }

    /// The case after an `edit` of the copy, if it is one.
    fn read(&self, edit: impl FnOnce(&mut Table)) -> Option<Case> {
        let mut tree = self.tree.clone();
        edit(&mut tree);
        parse(self.file, &tree.to_string(), &[]).ok().map(|loaded| loaded.case)
    }

    /// Confirms what was found for a shortened case: all keys are left out together, and only those that are then not as found are tried.
    fn confirm(&self, found: &mut [&mut Found]) {
        let copy_without = |are: fn(&Changed) -> bool| {
            let left_out = found.iter().filter(|(found, _)| found.as_ref().is_none_or(are));
            let left = self.read(|tree| left_out.for_each(|(_, path)| remove(tree, path)))?;
            resolved::write(&left, Paths::AsGiven).parse::<Table>().ok()
        };
        let copies = [copy_without(|_| false), copy_without(|key| key.default != DefaultValue::Required)];
        for (found, path) in found {
            let holds = match (found.as_ref().map(|key| &key.default), &copies) {
                (Some(DefaultValue::Required), _) => true,
                (None, [Some(copy), _]) => at(copy, path) == at(self.tree, path),
                (Some(DefaultValue::None), [_, Some(copy)]) => at(copy, path).is_none(),
                (Some(DefaultValue::Value(value)), [_, Some(copy)]) => {
                    at(copy, path).is_some_and(|found| found.to_string() == *value)
                }
                _ => false,
            };
            if !holds {
                *found = self.tried(path);
            }
        }
    }
}

/// Lists of tables that are longer than what is looked at of them, by their paths, with their lengths.
#[must_use]
pub fn longer_than_tried(loaded: &LoadedCase) -> Vec<(String, usize)> {
    let mut tree = resolved::write(&loaded.case, Paths::AsGiven).parse::<Table>().unwrap_or_default();
    let mut lists = Vec::new();
    tree.iter_mut().for_each(|(name, value)| shorten(value, name, &mut lists));
    lists
}

/// The elements of a list of tables.
fn tables_of(value: &Value) -> Option<&Vec<Value>> {
    value.as_array().filter(|list| list.iter().any(Value::is_table))
}

/// Cuts the lists of tables at `path` and below it to what is looked at of them; adds their paths and lengths to `lists`.
fn shorten(value: &mut Value, path: &str, lists: &mut Vec<(String, usize)>) {
    let is_list = tables_of(value).is_some();
    match value {
        Value::Table(table) => {
            table.iter_mut().for_each(|(name, value)| shorten(value, &format!("{path}.{name}"), lists))
        }
        Value::Array(list) if is_list => {
            if list.len() > MOST_TRIED {
                lists.push((path.to_owned(), list.len()));
                list.truncate(MOST_TRIED);
            }
            list.iter_mut().enumerate().for_each(|(n, value)| shorten(value, &format!("{path}.{n}"), lists));
        }
        _ => {}
    }
}

/// The case, of this copy, with long lists cut to what is looked at of them; `None` where there are none or others need the rest.
fn shortened(loaded: &LoadedCase, whole: &Table) -> Option<(Case, Table)> {
    let (mut short, mut lists) = (whole.clone(), Vec::new());
    short.iter_mut().for_each(|(name, value)| shorten(value, name, &mut lists));
    // The copy of a population counts the grains of its list.
    for population in short.get_mut("grains").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(listed) =
            population.get("placement").and_then(|placement| placement.get("list")?.as_array()).map(Vec::len)
            && let Some(count) = population.get_mut("count")
        {
            *count = Value::Integer(listed as i64);
        }
    }
    let case = (!lists.is_empty()).then(|| parse(&loaded.path, &short.to_string(), &[]).ok())??;
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
    if let Some((table, last)) = holder(tree, path) {
        table.remove(last);
    }
}

/// The table that holds the value at `path`, and its name there.
fn holder<'a, 'b>(tree: &'a mut Table, path: &'b [String]) -> Option<(&'a mut Table, &'b str)> {
    let (last, above) = path.split_last()?;
    let Some((first, rest)) = above.split_first() else { return Some((tree, last)) };
    let holder = rest.iter().try_fold(tree.get_mut(first)?, |value, name| match value {
        Value::Table(table) => table.get_mut(name),
        Value::Array(list) => list.get_mut(name.parse::<usize>().ok()?),
        _ => None,
    });
    Some((holder?.as_table_mut()?, last))
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
        // So of grains that are listed one by one.
        let listed: Vec<String> = (0..1100)
            .map(|n| {
                format!(
                    "{{ position = [\"{} mm\", \"{} mm\", \"1 mm\"] }}",
                    0.1 + 0.2 * f64::from(n % 35),
                    0.1 + 0.2 * f64::from(n / 35)
                )
            })
            .collect();
        let list = |count: usize, more: &str| {
            let grains = format!(
                "[[grains]]\nname = \"fine\"\nmaterial = \"m\"\nshape.sphere = {{ diameter = \"20 um\" }}\nplacement.list = [{}]\n",
                listed[..count].join(", ")
            );
            let material =
                "[material.m]\ndensity = \"2500 kg/m^3\"\n[contact.default]\nnormal_stiffness = \"1e3 N/m\"\n";
            parse(Path::new("a.toml"), &CASE.replace("[[liquid]]", &format!("{grains}{material}{more}[[liquid]]")), &[])
                .unwrap()
        };
        let both = list(1100, "[output]\ngrain_form = \"both\"\n");
        let found = changed(&both);
        let form = found.iter().find(|key| key.path == "output.grain_form").expect("it is not the default of so many");
        assert_eq!(form.default, DefaultValue::Value("\"points\"".into()));
        assert_eq!(longer_than_tried(&both), [("grains.0.placement.list".to_owned(), 1100)]);
        assert_eq!(changed(&list(1100, "")), changed(&list(MOST_TRIED, "")));
    }
}
