//! The copy of a case: every key with its value in SI units, itself a case with the same meaning.

use std::fmt::Write as _;
use std::path::Path;

use crate::key::Keys;

/// Form of file names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paths {
    /// From the root: the copy may lie anywhere.
    Absolute,
    /// As the case has them.
    AsGiven,
    /// Without folders: the same for every place the case lies in (used for its hash).
    NameOnly,
}

impl Paths {
    /// A file name in this style.
    #[must_use]
    pub fn text(self, path: &Path) -> String {
        let path = match self {
            Self::Absolute => std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
            Self::AsGiven => path.to_owned(),
            Self::NameOnly => path.file_name().map(Into::into).unwrap_or_default(),
        };
        path.display().to_string()
    }
}

/// A key or a table as written.
#[derive(Clone, Debug, PartialEq)]
pub enum Written {
    /// Nothing: the key is left out.
    Nothing,
    /// A value as TOML.
    Leaf(String),
    /// The name of a file as TOML.
    File(String),
    /// The entries of a table.
    Table(Entries),
    /// A list of tables.
    Tables(Vec<Written>),
}

impl Written {
    /// A list of tables.
    pub fn tables<T: Keys>(list: &[T], style: Paths) -> Self {
        Self::Tables(list.iter().map(|element| element.write(style)).collect())
    }

    /// `{ word = ... }`
    #[must_use]
    pub fn variant(word: &str, content: Self) -> Self {
        let mut entries = Entries::default();
        entries.push(word, content, Show::Table);
        Self::Table(entries)
    }

    fn has_file(&self) -> bool {
        match self {
            Self::File(_) => true,
            Self::Table(entries) => entries.list.iter().any(|(_, written, _)| written.has_file()),
            _ => false,
        }
    }

    /// On one line.
    fn inline(&self) -> String {
        match self {
            Self::Nothing => String::new(),
            Self::Leaf(text) | Self::File(text) => text.clone(),
            Self::Table(entries) => {
                let pairs = entries.list.iter().map(|(key, written, _)| format!("{key} = {}", written.inline()));
                format!("{{ {} }}", pairs.collect::<Vec<_>>().join(", "))
            }
            Self::Tables(list) => format!("[{}]", list.iter().map(Self::inline).collect::<Vec<_>>().join(", ")),
        }
    }
}

/// Form in which a table is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    /// Under a header of its own.
    Table,
    /// `key = { ... }`
    Inline,
    /// `key.alternative = { ... }`, and `key.alternative.file = ...` where it names a file.
    Dotted,
}

/// Keys with what is written of them, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Entries {
    list: Vec<(String, Written, Show)>,
}

impl Entries {
    /// Adds a key.
    pub fn push(&mut self, key: &str, written: Written, show: Show) {
        if written != Written::Nothing {
            self.list.push((key.to_owned(), written, show));
        }
    }

    /// Adds a key with a single value.
    pub fn leaf(&mut self, key: &str, written: Written) {
        self.push(key, written, Show::Table);
    }

    /// Adds the keys of a table that stand in this one.
    pub fn extend(&mut self, other: Written) {
        if let Written::Table(other) = other {
            self.list.extend(other.list);
        }
    }

    /// Keeps the keys in `names` alone.
    pub fn keep(&mut self, names: &[&str]) {
        self.list.retain(|(key, ..)| names.contains(&key.as_str()));
    }

    /// Puts the keys in the order of `names`.
    pub fn put_in_order(&mut self, names: &[&str]) {
        self.list.sort_by_key(|(key, ..)| names.iter().position(|name| name == key));
    }

    /// Adds the lines of a table with this path to `text`.
    pub fn render(&self, path: &str, text: &mut String) {
        // Lines of the table itself stand above the headers of the tables within it.
        let headed = |(_, written, show): &&(String, Written, Show)| {
            *show == Show::Table && matches!(written, Written::Table(_) | Written::Tables(_))
        };
        let lines = self.list.iter().filter(|entry| !headed(entry));
        for (key, written, show) in lines.chain(self.list.iter().filter(headed)) {
            let inner = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            match (written, show) {
                (Written::Table(entries), Show::Table) => {
                    if entries.has_lines() {
                        let _ = writeln!(text, "\n[{inner}]");
                    }
                    entries.render(&inner, text);
                }
                (Written::Tables(list), Show::Table) => {
                    for element in list {
                        let _ = writeln!(text, "\n[[{inner}]]");
                        if let Written::Table(entries) = element {
                            entries.render(&inner, text);
                        }
                    }
                }
                (Written::Table(entries), Show::Dotted) => entries.dotted(key, text),
                _ => {
                    let _ = writeln!(text, "{key} = {}", written.inline());
                }
            }
        }
    }

    fn dotted(&self, path: &str, text: &mut String) {
        for (key, written, _) in &self.list {
            match written {
                Written::Table(entries) if written.has_file() => entries.dotted(&format!("{path}.{key}"), text),
                _ => {
                    let _ = writeln!(text, "{path}.{key} = {}", written.inline());
                }
            }
        }
    }

    /// Whether some of it stands on lines under the header of the table.
    fn has_lines(&self) -> bool {
        let line = |(_, written, show): &(String, Written, Show)| match written {
            Written::Table(_) | Written::Tables(_) => *show != Show::Table,
            _ => true,
        };
        self.list.iter().any(line)
    }
}

/// A text of TOML with what needs it escaped.
#[must_use]
pub fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A name as a key of TOML: in quotes where it needs them.
pub fn as_key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    if !name.is_empty() && name.chars().all(is_bare) { name.to_owned() } else { quoted(name) }
}
