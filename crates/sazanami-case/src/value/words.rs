//! Values that are no quantities: counts, words, texts, files.

use std::path::PathBuf;

use sazanami_numerics::choice::Choice;
use serde_json::json;
use toml::de::DeValue;

use super::{Range1, Value, so_many};
use crate::key::{KeyDoc, ValueDoc};
use crate::read::{At, Context};
use crate::removed::instead_of;
use crate::suggest::nearest;
use crate::write::{Paths, Written, quoted};

impl Value for usize {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf("count", |key| json!({ "type": "integer", "minimum": key.count[0] }))
    }

    fn read(at: &At<'_>, key: &KeyDoc, _: Range1, cx: &mut Context<'_>) -> Option<Self> {
        let (name, [least, most]) = (key.name, key.count);
        let number = match (at.integer(), at.value) {
            (Some(number), _) => number,
            // Below all that are allowed.
            (None, Some(DeValue::Integer(number))) if number.as_str().starts_with('-') => i64::MIN,
            (None, Some(DeValue::Integer(_))) => {
                cx.report
                    .error(at.span.clone(), format!("`{name}` is larger than {}", i64::MAX))
                    .label("whole numbers of a case end there")
                    .help("write a smaller whole number");
                return None;
            }
            (None, _) => {
                cx.report
                    .error(at.span.clone(), format!("`{name}` is not a whole number"))
                    .label(format!("{}; expected a whole number", at.kind()));
                return None;
            }
        };
        let number = Self::try_from(number).ok().filter(|&number| number >= least);
        match number {
            Some(number) if number <= most => Some(number),
            Some(_) => {
                cx.report
                    .error(at.span.clone(), format!("`{name}` has to be {most} or less"))
                    .label(format!("expected a whole number from {least} to {most}"))
                    .help(format!("write {most} or a smaller whole number"));
                None
            }
            None => {
                let finding = cx.report.error(at.span.clone(), format!("`{name}` has to be {least} or more"));
                finding.label(format!("expected a whole number, {least} or more"));
                finding.help(format!("write {least} or a larger whole number"));
                None
            }
        }
    }

    fn write(&self, _: &str, _: Paths) -> Written {
        Written::Leaf(self.to_string())
    }

    fn blank() -> Self {
        0
    }

    fn example(key: &KeyDoc) -> String {
        key.example.unwrap_or("1").to_owned()
    }
}

impl Value for u64 {
    fn doc() -> ValueDoc {
        usize::doc()
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        usize::read(at, key, range, cx).map(|number| number as Self)
    }

    fn write(&self, _: &str, _: Paths) -> Written {
        Written::Leaf(self.to_string())
    }

    fn blank() -> Self {
        0
    }

    fn example(key: &KeyDoc) -> String {
        usize::example(key)
    }
}

/// Cells or grains in x1, x2, x3.
impl Value for [usize; 3] {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf(
            "three counts",
            |_| json!({ "type": "array", "items": { "type": "integer", "minimum": 1 }, "minItems": 3, "maxItems": 3 }),
        )
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        let key = &KeyDoc { count: [1, usize::MAX], ..key.clone() };
        let list = so_many::<3>(at, key, ["three", "three whole numbers such as [64, 64, 64]"], cx)?;
        Some(list.map(|element| usize::read(&element, key, range, cx).unwrap_or(0)))
    }

    fn write(&self, _: &str, _: Paths) -> Written {
        Written::Leaf(format!("{self:?}"))
    }

    fn blank() -> Self {
        [0; 3]
    }

    fn wrong() -> Option<Self> {
        Some([0; 3])
    }

    fn example(key: &KeyDoc) -> String {
        key.example.unwrap_or("[64, 64, 64]").to_owned()
    }
}

impl Value for bool {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf("true, false", |_| json!({ "type": "boolean" }))
    }

    fn read(at: &At<'_>, key: &KeyDoc, _: Range1, cx: &mut Context<'_>) -> Option<Self> {
        if let Some(DeValue::Boolean(flag)) = at.value {
            return Some(*flag);
        }
        cx.report
            .error(at.span.clone(), format!("`{}` is neither true nor false", key.name))
            .label(format!("{}; expected true or false, without quotes", at.kind()));
        None
    }

    fn write(&self, _: &str, _: Paths) -> Written {
        Written::Leaf(self.to_string())
    }

    fn blank() -> Self {
        false
    }

    fn example(_: &KeyDoc) -> String {
        "true".into()
    }
}

impl Value for String {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf("text", |_| json!({ "type": "string" }))
    }

    fn read(at: &At<'_>, key: &KeyDoc, _: Range1, cx: &mut Context<'_>) -> Option<Self> {
        if let Some(DeValue::String(text)) = at.value {
            return Some(text.to_string());
        }
        cx.report
            .error(at.span.clone(), format!("`{}` is not a text", key.name))
            .label(format!("{}; expected a text in quotes", at.kind()));
        None
    }

    fn write(&self, _: &str, _: Paths) -> Written {
        Written::Leaf(quoted(self))
    }

    fn blank() -> Self {
        Self::new()
    }

    fn example(key: &KeyDoc) -> String {
        format!("\"{}\"", key.example.unwrap_or_default())
    }
}

/// A file, relative to the case file.
impl Value for PathBuf {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf("file", |_| json!({ "type": "string" }))
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        let name = String::read(at, key, range, cx)?;
        if name.trim().is_empty() {
            cx.report
                .error(at.span.clone(), format!("`{}` names no file", key.name))
                .label("an empty name")
                .help("write the name of a file, or leave the key out");
            return None;
        }
        Some(cx.folder.join(name))
    }

    fn write(&self, _: &str, style: Paths) -> Written {
        Written::File(quoted(&style.text(self)))
    }

    fn blank() -> Self {
        Self::new()
    }

    fn example(key: &KeyDoc) -> String {
        String::example(key)
    }
}

/// A word of a [`Choice`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word<C>(pub C);

impl<C: Choice> Value for Word<C> {
    fn doc() -> ValueDoc {
        ValueDoc::Words(C::ALL.iter().map(|choice| (choice.word(), choice.about())).collect())
    }

    fn read(at: &At<'_>, key: &KeyDoc, _: Range1, cx: &mut Context<'_>) -> Option<Self> {
        let words: Vec<&str> = C::ALL.iter().map(|choice| choice.word()).collect();
        let Some(DeValue::String(word)) = at.value else {
            cx.report.error(at.span.clone(), format!("`{}` is not a word", key.name)).label(format!(
                "{}; expected one of {}",
                at.kind(),
                words.join(", ")
            ));
            return None;
        };
        let choice = C::from_word(word);
        if choice.is_some() {
            return choice.map(Self);
        }
        if let Some(instead) = instead_of(&at.path, Some(word)) {
            cx.removed("choice", word, at.span.clone(), instead);
        } else {
            let finding = cx.report.error(at.span.clone(), format!("`{word}` is not a choice for `{}`", key.name));
            match nearest(word, words.iter().copied()) {
                Some(meant) => finding.label(format!("did you mean `{meant}`?")),
                None => finding.label("not a choice known here"),
            };
            finding.help(format!("known here: {}", words.join(", ")));
        }
        None
    }

    fn write(&self, _: &str, _: Paths) -> Written {
        Written::Leaf(format!("\"{}\"", self.0.word()))
    }

    fn blank() -> Self {
        Self(C::ALL[0])
    }

    fn example(_: &KeyDoc) -> String {
        format!("\"{}\"", C::ALL[0].word())
    }
}
