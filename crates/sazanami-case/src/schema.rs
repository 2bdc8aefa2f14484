//! The JSON Schema of case files, for editors.

use std::collections::BTreeMap;

use serde_json::{Map, Value as Json, json};

use crate::case::Case;
use crate::key::{KeyDoc, Keys, TableDoc, ValueDoc};

/// The JSON Schema of case files, as text.
#[must_use]
pub fn json_schema() -> String {
    let mut definitions = BTreeMap::new();
    let Json::Object(case) = table(&Case::docs(), &mut definitions) else { return String::new() };
    let mut schema = Map::new();
    schema.insert("$schema".into(), json!("https://json-schema.org/draft/2020-12/schema"));
    schema.insert("title".into(), json!("sazanami case"));
    schema.extend(case);
    schema.insert("$defs".into(), json!(definitions));
    let mut text = serde_json::to_string_pretty(&Json::Object(schema)).unwrap_or_default();
    text.push('\n');
    text
}

type Definitions = BTreeMap<&'static str, Json>;

/// A reference to the definition of a table, which is made where it is missing.
fn reference(docs: fn() -> TableDoc, definitions: &mut Definitions) -> Json {
    let docs = docs();
    if !definitions.contains_key(docs.name) {
        // A table may hold tables of its own kind.
        definitions.insert(docs.name, Json::Null);
        let schema = if docs.is_choice { choice(&docs, definitions) } else { table(&docs, definitions) };
        definitions.insert(docs.name, schema);
    }
    json!({ "$ref": format!("#/$defs/{}", docs.name) })
}

fn table(docs: &TableDoc, definitions: &mut Definitions) -> Json {
    let keys = docs.keys.iter().map(|key| (key.name.to_owned(), described(key, definitions)));
    let properties: Map<String, Json> = keys.collect();
    json!({ "type": "object", "description": docs.about, "properties": properties, "additionalProperties": false })
}

fn choice(docs: &TableDoc, definitions: &mut Definitions) -> Json {
    let alternative = |key: &KeyDoc| match key.value {
        ValueDoc::Word => json!({ "const": key.name, "description": key.about }),
        _ => {
            let name = key.name;
            json!({
                "type": "object",
                "description": key.about,
                "properties": { name: value(key, definitions) },
                "required": [name],
                "additionalProperties": false,
            })
        }
    };
    json!({ "description": docs.about, "oneOf": docs.keys.iter().map(alternative).collect::<Vec<_>>() })
}

fn described(key: &KeyDoc, definitions: &mut Definitions) -> Json {
    let mut schema = value(key, definitions);
    if let Json::Object(schema) = &mut schema {
        schema.insert("description".into(), json!(key.about));
        if let Some(default) = key.default_text() {
            schema.insert("description".into(), json!(format!("{} Default: {default}.", key.about)));
        }
    }
    schema
}

fn value(key: &KeyDoc, definitions: &mut Definitions) -> Json {
    match &key.value {
        ValueDoc::Leaf(_, schema) => schema(key),
        ValueDoc::Words(words) => json!({ "enum": words.iter().map(|(word, _)| *word).collect::<Vec<_>>() }),
        ValueDoc::Word => json!({ "const": key.name }),
        ValueDoc::Table(docs) => reference(*docs, definitions),
        ValueDoc::Tables(docs) => {
            let one = reference(*docs, definitions);
            json!({ "anyOf": [{ "type": "array", "items": one }, one] })
        }
        ValueDoc::Named(docs) => {
            json!({ "type": "object", "additionalProperties": reference(*docs, definitions) })
        }
    }
}
