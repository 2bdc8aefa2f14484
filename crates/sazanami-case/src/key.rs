//! Declaration of a key, and the trait that tables of keys derive.

use crate::presets::Paper;
use crate::read::{At, Context};
use crate::units::Quantity;
use crate::value::{Range1, Value};
use crate::write::{Paths, Written};

/// A table of keys: read from a case file, written into its copy, and described.
///
/// Derived from the declaration of the struct, see `sazanami_case_derive`.
pub trait Keys: Sized {
    /// The declaration.
    fn docs() -> TableDoc;
    /// Reads the table; `None` where it is so wrong that nothing can be made of it, which has been reported then.
    fn read(at: &At<'_>, cx: &mut Context<'_>) -> Option<Self>;
    /// The table for the copy of the case.
    fn write(&self, style: Paths) -> Written;
}

/// A table as declared.
#[derive(Clone, Debug)]
pub struct TableDoc {
    /// Name of its type.
    pub name: &'static str,
    /// Subject.
    pub about: &'static str,
    /// Its keys, or the alternatives.
    pub keys: Vec<KeyDoc>,
    /// Whether exactly one of the keys is given.
    pub is_choice: bool,
}

/// Value of a key that the case leaves out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DefaultDoc {
    /// The key has to be given.
    Required,
    /// Nothing.
    None,
    /// A value, or words for one that depends on the case.
    Text(String),
}

/// The default of the preset `paper_literal`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Literal {
    /// Whose paper.
    pub paper: Paper,
    /// The default, as text of a case file.
    pub value: String,
    /// Reason for a default other than the recommended one.
    pub reason: &'static str,
}

/// Kinds of value of a key.
#[derive(Clone, Debug)]
pub enum ValueDoc {
    /// A single value: its kind in words, and its JSON Schema.
    Leaf(&'static str, fn(&KeyDoc) -> serde_json::Value),
    /// A word of a set, each with its meaning.
    Words(Vec<(&'static str, &'static str)>),
    /// A word by itself, one of several alternatives.
    Word,
    /// A table; the function gives its declaration.
    Table(fn() -> TableDoc),
    /// A list of tables.
    Tables(fn() -> TableDoc),
    /// Tables by names of the user's choice.
    Named(fn() -> TableDoc),
}

/// A key as declared.
#[derive(Clone, Debug)]
pub struct KeyDoc {
    /// Name in case files.
    pub name: &'static str,
    /// Meaning.
    pub about: &'static str,
    /// Kind of value.
    pub value: ValueDoc,
    /// Quantity and unit; `None` of pure numbers and words.
    pub unit: Option<Quantity>,
    /// Range of numbers.
    pub range: Range1,
    /// Least and most of whole numbers.
    pub count: [usize; 2],
    /// Value where the case says nothing.
    pub default: DefaultDoc,
    /// The same with the preset `paper_literal`.
    pub literal: Option<Literal>,
    /// Example in the message about its absence.
    pub example: Option<&'static str>,
}

impl KeyDoc {
    /// A key with a single value.
    #[must_use]
    pub fn leaf<T: Value>(name: &'static str, about: &'static str) -> Self {
        Self {
            name,
            about,
            value: T::doc(),
            unit: None,
            range: Range1::Any,
            count: [0, usize::MAX],
            default: DefaultDoc::Required,
            literal: None,
            example: None,
        }
    }

    /// A key with a table, or with a list of tables.
    #[must_use]
    pub fn nested(name: &'static str, about: &'static str, docs: fn() -> TableDoc, many: bool) -> Self {
        let value = if many { ValueDoc::Tables(docs) } else { ValueDoc::Table(docs) };
        Self { value, default: DefaultDoc::None, ..Self::leaf::<bool>(name, about) }
    }

    /// An alternative that is a word by itself.
    #[must_use]
    pub fn word(name: &'static str, about: &'static str) -> Self {
        Self { value: ValueDoc::Word, default: DefaultDoc::None, ..Self::leaf::<bool>(name, about) }
    }

    /// Declaration of the table it holds; an empty one where it holds none.
    #[must_use]
    pub fn nested_docs(&self) -> TableDoc {
        match self.value {
            ValueDoc::Table(docs) | ValueDoc::Tables(docs) | ValueDoc::Named(docs) => docs(),
            _ => TableDoc { name: self.name, about: self.about, keys: Vec::new(), is_choice: false },
        }
    }
}
