//! Cases for other programs: keys as values in SI units, read and set by their paths.

use serde_json::{Map, Number, Value as Json};
use toml::de::DeTable;

use crate::case::Case;
use crate::explain::{Explained, declared, explain};
use crate::key::{KeyDoc, Keys as _, ValueDoc};
use crate::resolved::{self, Paths};
use crate::units::parse_quantity;
use crate::write::as_key;
use crate::{Diagnostics, LoadedCase, Source, overrides};

/// Content of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    /// A single value or a list of them.
    Value,
    /// One table of keys.
    Table,
    /// A list of tables.
    Tables,
    /// Tables by names of the user's choice.
    Named,
}

/// A key that there is.
#[derive(Clone, Debug)]
pub struct KnownKey {
    /// Meaning.
    pub about: &'static str,
    /// Content.
    pub holds: Holds,
    /// Its SI unit, if it has a dimension.
    pub unit: Option<&'static str>,
    /// Names of the keys below it.
    pub keys: Vec<&'static str>,
}

/// A key that there is not, with the nearest one if one is near.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownKey {
    /// Path that was asked for.
    pub path: String,
    /// Path of the nearest key.
    pub meant: Option<String>,
}

/// Declaration of the key with the path `names`, numbers of list elements and chosen names among them; the case
/// itself without names.
///
/// # Errors
/// If there is no such key.
pub fn known(names: &[&str]) -> Result<KnownKey, UnknownKey> {
    let plain: Vec<&str> = names.iter().copied().filter(|name| name.parse::<usize>().is_err()).collect();
    let of_table = |about, keys: Vec<KeyDoc>| KnownKey {
        about,
        holds: Holds::Table,
        unit: None,
        keys: keys.iter().map(|key| key.name).collect(),
    };
    let Some((last, above)) = plain.split_last() else {
        let docs = Case::docs();
        return Ok(of_table(docs.about, docs.keys));
    };
    if let Some(key) = declared(&plain) {
        let is_element = names.last().is_some_and(|name| name.parse::<usize>().is_ok());
        let is_chosen = key.name != *last;
        let holds = match key.value {
            ValueDoc::Tables(_) if !is_element => Holds::Tables,
            ValueDoc::Named(_) if !is_chosen => Holds::Named,
            ValueDoc::Table(_) | ValueDoc::Tables(_) | ValueDoc::Named(_) => Holds::Table,
            _ => Holds::Value,
        };
        let keys = key.nested_docs().keys.iter().map(|key| key.name).collect();
        return Ok(KnownKey { about: key.about, holds, unit: key.unit.map(|unit| unit.unit), keys });
    }
    // A name of the user's choice, of a table that need not be there yet.
    if let Some(key) = declared(above).filter(|key| matches!(key.value, ValueDoc::Named(_))) {
        let docs = key.nested_docs();
        if docs.keys.iter().all(|key| key.name != *last) {
            return Ok(of_table(docs.about, docs.keys));
        }
    }
    let path = names.join(".");
    let meant = match explain(&path) {
        Explained::Unknown { meant, .. } => meant,
        Explained::Text(_) => None,
    };
    Err(UnknownKey { path, meant })
}

/// All keys of a case as values: quantities as numbers in SI units, words, lists and tables. Keys that the copy of a case
/// puts in other words, such as `domain.size` or a contact `default`, are there as they were written. Names of files are those from
/// the root, which mean the same in any case.
#[must_use]
pub fn values(loaded: &LoadedCase) -> Json {
    let tree = resolved::write(&loaded.case, Paths::Absolute).parse::<toml::Table>().unwrap_or_default();
    let mut found = in_si(&toml::Value::Table(tree), &mut Vec::new());
    complete(&mut found, in_si(&toml::Value::Table(written(&loaded.source)), &mut Vec::new()));
    found
}

/// The keys of a case as they were written, overrides over the text.
fn written(source: &Source) -> toml::Table {
    let Ok(mut tree) = DeTable::parse(source.text()) else { return toml::Table::new() };
    let padded = overrides::padded_values(source);
    overrides::apply(&mut tree, source, &padded, &mut Diagnostics::default());
    serde::Deserialize::deserialize(toml::Deserializer::from(tree)).unwrap_or_default()
}

/// Adds what `known` lacks and `other` has.
fn complete(known: &mut Json, other: Json) {
    match (known, other) {
        (Json::Object(known), Json::Object(other)) => {
            for (name, value) in other {
                match known.get_mut(&name) {
                    Some(inner) => complete(inner, value),
                    None => drop(known.insert(name, value)),
                }
            }
        }
        (Json::Array(known), Json::Array(other)) if known.len() == other.len() => {
            known.iter_mut().zip(other).for_each(|(known, other)| complete(known, other));
        }
        _ => {}
    }
}

fn in_si(value: &toml::Value, names: &mut Vec<String>) -> Json {
    match value {
        toml::Value::Table(table) => {
            let mut found = Map::new();
            for (name, inner) in table {
                names.push(name.clone());
                found.insert(name.clone(), in_si(inner, names));
                names.pop();
            }
            Json::Object(found)
        }
        toml::Value::Array(list) => list.iter().map(|element| in_si(element, names)).collect(),
        toml::Value::String(text) => quantity(text, names).unwrap_or_else(|| text.clone().into()),
        toml::Value::Integer(number) => (*number).into(),
        toml::Value::Float(number) => Number::from_f64(*number).map_or(Json::Null, Json::Number),
        toml::Value::Boolean(flag) => (*flag).into(),
        toml::Value::Datetime(time) => time.to_string().into(),
    }
}

/// The text of a quantity as a number in SI units, if the key has a dimension.
fn quantity(text: &str, names: &[String]) -> Option<Json> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let unit = declared(&names)?.unit?;
    let (value, dimension) = parse_quantity(text).ok()?;
    (dimension == unit.dimension).then(|| Number::from_f64(value).map_or(Json::Null, Json::Number))
}

/// The override `path=value` that sets the key with the path `names`. Numbers of keys with a dimension are in SI units; texts
/// are as in case files, with units of their own.
#[must_use]
pub fn setting(names: &[&str], value: &Json) -> String {
    let plain = names.iter().filter(|name| name.parse::<usize>().is_err()).map(|name| (*name).to_owned());
    format!("{}={}", path(names), as_toml(value, &mut plain.collect()))
}

/// The path of an override that sets the key with the path `names`, without the equals sign.
#[must_use]
pub fn path(names: &[impl AsRef<str>]) -> String {
    names.iter().map(|name| quoted(name.as_ref())).collect::<Vec<_>>().join(".")
}

/// A name as a key of TOML: within double quotes if it is not plain, quotes and backslashes in it escaped.
fn quoted(name: &str) -> String {
    let is_plain = as_key(name) == name;
    if is_plain { name.to_owned() } else { format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\"")) }
}

fn as_toml(value: &Json, names: &mut Vec<String>) -> String {
    match value {
        Json::Null => "\"\"".to_owned(),
        Json::Bool(flag) => flag.to_string(),
        Json::Number(number) => {
            let text = number.as_f64().filter(|_| number.is_f64()).map_or(number.to_string(), |x| format!("{x:?}"));
            let plain: Vec<&str> = names.iter().map(String::as_str).collect();
            match declared(&plain).and_then(|key| key.unit) {
                Some(unit) => format!("\"{text} {}\"", unit.unit),
                None => text,
            }
        }
        Json::String(text) => toml::Value::String(text.clone()).to_string(),
        Json::Array(list) => {
            let elements: Vec<String> = list.iter().map(|element| as_toml(element, names)).collect();
            format!("[{}]", elements.join(", "))
        }
        Json::Object(table) => {
            let entry = |(name, inner): (&String, &Json)| {
                names.push(name.clone());
                let text = format!("{} = {}", quoted(name), as_toml(inner, names));
                names.pop();
                text
            };
            format!("{{ {} }}", table.iter().map(entry).collect::<Vec<_>>().join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use serde_json::json;

    use super::*;
    use crate::parse;

    const CASE: &str = r#"
        [domain]
        size = ["8 mm", "8 mm", "8 mm"]
        cells = [12, 12, 12]
        [[liquid]]
        region.sphere = { diameter = "3 mm" }
        position = ["4 mm", "4 mm", "5 mm"]
        [run]
        until = "1 ms"
    "#;

    #[test]
    fn values_are_in_si_units() {
        let found = values(&parse(Path::new("a.toml"), CASE, &[]).unwrap());
        assert_eq!(found["domain"]["upper"][2], json!(8e-3));
        assert_eq!(found["domain"]["size"][2], json!(8e-3));
        assert_eq!(found["domain"]["cells"], json!([12, 12, 12]));
        assert_eq!(found["liquid"][0]["region"]["sphere"]["diameter"], json!(3e-3));
        assert_eq!(found["fluid"]["viscosity"], json!("auto"));
    }

    #[test]
    fn keys_are_set_by_values() {
        let set = [
            setting(&["run", "until"], &json!(2e-3)),
            setting(&["domain", "size"], &json!([0.01, "9 mm", 0.008])),
            setting(&["liquid", "0", "region"], &json!({ "sphere": { "diameter": 2e-3 } })),
            setting(&["material", "glass.1", "density"], &json!(2500)),
            setting(&["title"], &json!("a \"b\" = c")),
        ];
        assert_eq!(set[0], "run.until=\"0.002 s\"");
        assert_eq!(set[3], "material.\"glass.1\".density=\"2500 kg/m^3\"");
        let loaded = parse(Path::new("a.toml"), CASE, &set).unwrap();
        let found = values(&loaded);
        assert_eq!(found["run"]["until"], json!(2e-3));
        assert_eq!(found["domain"]["size"], json!([0.01, 9e-3, 8e-3]));
        assert_eq!(found["liquid"][0]["region"]["sphere"]["diameter"], json!(2e-3));
        assert_eq!(loaded.case.title, "a \"b\" = c");
        let wrong = parse(Path::new("a.toml"), CASE, &[setting(&["run", "untill"], &json!(1))]).unwrap_err();
        assert!(wrong.to_string().contains("did you mean `until`?"));
    }

    #[test]
    fn names_of_any_letters_are_set_by_themselves_and_within_tables() {
        for name in ["砂", "größe", "a \"b\"", "a\\b", "a.b", "plain-1"] {
            let table = json!({ name: { "density": 2500 } });
            for set in [setting(&["material"], &table), setting(&["material", name], &table[name])] {
                let found = values(&parse(Path::new("a.toml"), CASE, &[set]).unwrap());
                assert_eq!(found["material"][name]["density"], json!(2500.0), "{name}");
            }
        }
        // Negative control: plain names need no quotes.
        assert_eq!(path(&["material", "sand_1", "砂"]), "material.sand_1.\"砂\"");
    }

    #[test]
    fn names_of_files_mean_the_same_when_they_are_set_again() {
        let packed = format!(
            "{CASE}{}",
            r#"
            [material.sand]
            density = "2650 kg/m^3"
            [contact."sand/sand"]
            normal_stiffness = "1e3 N/m"
            restitution = 0.5
            friction = 0.6
            [[grains]]
            material = "sand"
            shape.sphere = { diameter = "1 mm" }
            count = 3
            placement.packed = {}
            "#
        );
        let set = [setting(&["output", "bed"], &json!("b.bed"))];
        let (here, there) = (Path::new("cases/x/y.toml"), Path::new("elsewhere/z.toml"));
        let first = parse(here, &packed, &set).unwrap();
        let name = &values(&first)["output"]["bed"];
        let file = std::path::absolute("cases/x/b.bed").unwrap();
        assert_eq!(name, &json!(file.display().to_string()));
        for place in [here, there] {
            let again = parse(place, &packed, &[setting(&["output", "bed"], name)]).unwrap();
            assert_eq!(&values(&again)["output"]["bed"], name);
        }
        // Negative control: the name as it was written means another file elsewhere.
        let other = parse(there, &packed, &set).unwrap();
        assert_ne!(&values(&other)["output"]["bed"], name);
    }

    #[test]
    fn keys_are_known_or_the_nearest_is_named() {
        assert!(known(&[]).unwrap().keys.contains(&"fluid"));
        let cfl = known(&["fluid", "cfl"]).unwrap();
        assert!(cfl.holds == Holds::Value && cfl.unit.is_none());
        assert_eq!(known(&["run", "until"]).unwrap().unit, Some("s"));
        assert_eq!(known(&["grains"]).unwrap().holds, Holds::Tables);
        assert_eq!(known(&["grains", "0"]).unwrap().holds, Holds::Table);
        assert_eq!(known(&["material"]).unwrap().holds, Holds::Named);
        assert_eq!(known(&["material", "quartz"]).unwrap().holds, Holds::Table);
        assert_eq!(known(&["material", "quartz", "density"]).unwrap().unit, Some("kg/m^3"));
        assert_eq!(known(&["contact", "sand/floor"]).unwrap().holds, Holds::Table);
        let unknown = known(&["fluid", "clf"]).unwrap_err();
        assert_eq!(unknown.meant.as_deref(), Some("fluid.cfl"));
    }
}
