//! Reading of tables: places in the file, keys that nobody knows, tables that are none.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;

use sazanami_numerics::Real;
use toml::de::{DeTable, DeValue};

use crate::diagnostics::Diagnostics;
use crate::key::{KeyDoc, Keys, TableDoc};
use crate::known::Known;
use crate::presets::{Paper, Preset};
use crate::removed;
use crate::suggest::nearest;
use crate::units::rounded_within;
use crate::value::{Given, Range1, Value};

/// Order of the tables in the copy of a case and in the reference.
pub(crate) const ORDER: [&str; 28] = [
    "name",
    "title",
    "preset",
    "solver",
    "gravity",
    "domain",
    "boundary",
    "frame",
    "drive",
    "fluid",
    "coupling",
    "particles",
    "overlap",
    "preparation",
    "liquid",
    "gate",
    "dem",
    "material",
    "contact",
    "grains",
    "bed",
    "heap",
    "erosion",
    "ripples",
    "probe",
    "output",
    "checkpoint",
    "run",
];

/// Places of the keys of a case: byte ranges in its [`Source`](crate::Source), by paths such as
/// `grains.0.shape.sphere.diameter`.
#[derive(Clone, Debug, Default)]
pub struct Places {
    spans: BTreeMap<String, Range<usize>>,
}

impl Places {
    /// Place of the value of a key, if the case gives it.
    #[must_use]
    pub fn of(&self, path: &str) -> Option<Range<usize>> {
        self.spans.get(path).cloned()
    }

    /// Place of the value of a key, or else of the table it would stand in, or of the table round that.
    #[must_use]
    pub fn near(&self, path: &str) -> Option<Range<usize>> {
        let mut path = path;
        loop {
            if let Some(span) = self.of(path) {
                return Some(span);
            }
            path = path.rsplit_once('.')?.0;
        }
    }

    /// As [`near`](Self::near), or the beginning of the file.
    #[must_use]
    pub fn at(&self, path: &str) -> Range<usize> {
        self.near(path).unwrap_or(0..0)
    }

    /// The places of a case without some of its populations.
    pub(crate) fn without_grains(&self, left_out: &[usize]) -> Self {
        let renumbered = |path: &str| -> Option<String> {
            let Some(rest) = path.strip_prefix("grains.") else { return Some(path.to_owned()) };
            let (number, key) = rest.split_once('.').map_or((rest, ""), |(number, key)| (number, key));
            let number: usize = number.parse().ok()?;
            let before = left_out.iter().filter(|&&n| n < number).count();
            let dot = if key.is_empty() { "" } else { "." };
            (!left_out.contains(&number)).then(|| format!("grains.{}{dot}{key}", number - before))
        };
        let spans = self.spans.iter().filter_map(|(path, span)| Some((renumbered(path)?, span.clone())));
        Self { spans: spans.collect() }
    }
}

/// Last part of a path.
fn last(path: &str) -> &str {
    path.rsplit_once('.').map_or(path, |(_, name)| name)
}

/// Context of reading, common to all tables.
pub struct Context<'a> {
    /// The findings.
    pub report: &'a mut Diagnostics,
    /// Folder of the case file.
    pub folder: &'a Path,
    /// Places of the keys.
    pub places: Places,
    /// Tables read before, which later ones depend on.
    pub known: Known,
    /// Keys whose absence is no error, since something wrong stood in their place.
    suggested: BTreeSet<String>,
}

/// A value, or its absence, with its place.
#[derive(Clone, Debug)]
pub struct At<'t> {
    /// The value, if it is given.
    pub value: Option<&'t DeValue<'t>>,
    /// Its place; where it should stand, if it is absent.
    pub span: Range<usize>,
    /// Path of its key.
    pub path: String,
    /// Whether other keys stand in the same table.
    is_part: bool,
}

/// Whether a text has characters that a terminal or a page would obey in place of showing them.
pub(crate) fn cannot_be_shown(text: &str) -> bool {
    let obeyed = |c: char| matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    text.chars().any(|c| c.is_control() || obeyed(c))
}

impl<'t> At<'t> {
    /// Nothing, in the same place: a table of which every key has its default.
    #[must_use]
    pub fn empty(&self) -> Self {
        Self { value: None, ..self.clone() }
    }

    /// The root of a case.
    #[must_use]
    pub fn root(value: &'t DeValue<'t>) -> Self {
        Self { value: Some(value), span: 0..0, path: String::new(), is_part: false }
    }

    /// Last part of its path, for messages.
    fn name(&self) -> &str {
        last(&self.path)
    }

    /// Kind of its value, for messages.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self.value {
            Some(DeValue::String(_)) => "a text",
            Some(DeValue::Integer(_) | DeValue::Float(_)) => "a bare number",
            Some(DeValue::Boolean(_)) => "true or false",
            Some(DeValue::Array(_)) => "a list",
            Some(DeValue::Datetime(moment)) if moment.date.is_none() => "a time of day",
            Some(DeValue::Datetime(_)) => "a date",
            _ => "a table",
        }
    }

    /// A text, empty if the value is none.
    #[must_use]
    pub fn text(&self) -> &str {
        match self.value {
            Some(DeValue::String(text)) => text,
            _ => "",
        }
    }

    /// A whole number.
    #[must_use]
    pub fn integer(&self) -> Option<i64> {
        match self.value {
            Some(DeValue::Integer(number)) => i64::from_str_radix(number.as_str(), number.radix()).ok(),
            _ => None,
        }
    }

    /// The value as a real, if it is an integer or a floating-point number.
    #[must_use]
    pub fn number(&self) -> Option<Real> {
        match self.value {
            Some(DeValue::Float(number)) => number.as_str().parse().ok(),
            Some(DeValue::Integer(number)) => {
                self.integer().map(|number| number as Real).or_else(|| number.as_str().parse().ok())
            }
            _ => None,
        }
    }

    /// A number as text.
    #[must_use]
    pub fn number_text(&self) -> String {
        match (self.integer(), self.number()) {
            (Some(number), _) => number.to_string(),
            (None, Some(number)) => format!("{number:?}"),
            (None, None) => String::new(),
        }
    }

    /// The elements of a list.
    #[must_use]
    pub fn elements(&self) -> Option<Vec<At<'t>>> {
        let Some(DeValue::Array(list)) = self.value else { return None };
        let element = |(n, value): (usize, &'t toml::Spanned<DeValue<'t>>)| At {
            value: Some(value.get_ref()),
            span: value.span(),
            path: format!("{}.{n}", self.path),
            is_part: false,
        };
        Some(list.iter().enumerate().map(element).collect())
    }
}

/// A table whose keys are all known.
pub struct Table<'t> {
    entries: Option<&'t DeTable<'t>>,
    at: At<'t>,
    docs: TableDoc,
}

impl<'t> Table<'t> {
    /// Its place.
    #[must_use]
    pub fn span(&self) -> Range<usize> {
        self.at.span.clone()
    }

    /// The table as a value.
    #[must_use]
    pub fn at(&self) -> At<'t> {
        self.at.clone()
    }

    /// The table as one that holds other keys too.
    #[must_use]
    pub fn part(&self) -> At<'t> {
        At { is_part: true, ..self.at.clone() }
    }

    /// Whether the case gives a key.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.entries.is_some_and(|entries| entries.contains_key(name))
    }

    /// The value of a key with its place, or the place of the table where it is absent.
    #[must_use]
    pub fn get(&self, name: &str) -> At<'t> {
        let path = if self.at.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.at.path) };
        match self.entries.and_then(|entries| entries.get(name)) {
            Some(value) => At { value: Some(value.get_ref()), span: value.span(), path, is_part: false },
            None => At { value: None, span: self.at.span.clone(), path, is_part: false },
        }
    }

    /// As [`get`](Self::get), for a table or a list of them: notes where it stands.
    pub fn child(&self, name: &str, cx: &mut Context<'_>) -> At<'t> {
        let at = self.get(name);
        if at.value.is_some() {
            cx.places.spans.insert(at.path.clone(), at.span.clone());
        }
        at
    }

    /// Place of the value of a key, or of the table where it is absent.
    #[must_use]
    pub fn place(&self, name: &str) -> Range<usize> {
        self.get(name).span
    }

    /// Names of the keys that are given, with their places.
    pub fn names(&self) -> impl Iterator<Item = (&'t str, Range<usize>)> {
        self.entries.into_iter().flat_map(|entries| entries.iter().map(|(key, _)| (key.get_ref().as_ref(), key.span())))
    }

    fn key(&self, name: &str) -> Option<&KeyDoc> {
        self.docs.keys.iter().find(|key| key.name == name)
    }

    /// Reads a key; `within` is its range, if it depends on the case.
    pub fn value<T: Value>(&self, name: &str, within: Option<Range1>, cx: &mut Context<'_>) -> Given<T> {
        if !self.has(name) {
            return Given::Absent;
        }
        let at = self.child(name, cx);
        let Some(key) = self.key(name) else { return Given::Absent };
        T::read(&at, key, within.unwrap_or(key.range), cx).map_or(Given::Wrong, Given::Value)
    }

    /// Says that the default of a key that is not given lies outside the range that it has in this case.
    pub fn check_default(&self, name: &str, within: Option<Range1>, value: Real, cx: &mut Context<'_>) {
        let Some(key) = self.key(name) else { return };
        let unit = key.unit.map_or("", |unit| unit.unit);
        if let Some(why) = within.unwrap_or(key.range).refuses(value, unit) {
            let [default, _] = rounded_within(value, value);
            cx.report
                .error(self.span(), format!("`{name}` {why}"))
                .label(format!("it is not given; by default it is {default} {unit}"))
                .help(format!("give `{name}`, or another box"));
        }
    }

    /// Says that a key that has to be given is not.
    pub fn missing(&self, name: &str, cx: &mut Context<'_>) {
        let example = self.key(name).map(|key| match &key.value {
            crate::key::ValueDoc::Leaf(..) | crate::key::ValueDoc::Words(_) => key.suggestion(),
            _ => format!("add {}", key.example.unwrap_or(name)),
        });
        cx.missing(Some(self.span()), name, &example.unwrap_or_default());
    }

    /// Remembers that the table could not be read, so that what refers to it is no second error.
    pub fn give_up(&self, cx: &mut Context<'_>) {
        cx.known.is_damaged = true;
    }
}

impl KeyDoc {
    /// `` add `key = value` ``
    fn suggestion(&self) -> String {
        let (value, more) = match self.example.and_then(|example| example.split_once(" -- ")) {
            Some((value, more)) => (Some(value), format!(", {more}")),
            None => (self.example, String::new()),
        };
        let value = match (value, self.unit, &self.value) {
            (Some(value), Some(_), _) if !value.starts_with('[') => format!("\"{value}\""),
            (Some(value), None, crate::key::ValueDoc::Leaf("text" | "file", _)) => format!("\"{value}\""),
            (Some(value), ..) => value.to_owned(),
            (None, ..) => self.stock_example(),
        };
        format!("add `{} = {value}`{more}", self.name)
    }

    fn stock_example(&self) -> String {
        use sazanami_numerics::Vector;
        match &self.value {
            crate::key::ValueDoc::Leaf("vector", _) => Vector::example(self),
            crate::key::ValueDoc::Leaf("three counts", _) => <[usize; 3]>::example(self),
            crate::key::ValueDoc::Leaf("number", _) => Real::example(self),
            _ => usize::example(self),
        }
    }
}

impl<'a> Context<'a> {
    /// A context that knows nothing yet.
    pub fn new(report: &'a mut Diagnostics, folder: &'a Path) -> Self {
        Self { report, folder, places: Places::default(), known: Known::default(), suggested: BTreeSet::new() }
    }

    /// Whether defaults are those of a paper.
    #[must_use]
    pub fn follows(&self, paper: Paper) -> bool {
        self.known.preset == Preset::PaperLiteral && Paper::of(self.known.solver) == paper
    }

    /// Says that a required key is missing from the table at `table`.
    pub fn missing(&mut self, table: Option<Range<usize>>, key: &str, help: &str) {
        if self.suggested.contains(key) {
            return;
        }
        let title = format!("`{key}` is missing");
        match table {
            Some(span) => self.report.error(span, title).label(format!("this needs `{key}`")),
            None => self.report.error_in_file(title),
        }
        .help(help.to_owned());
    }

    /// A table; reports what is none, and keys that nobody knows.
    pub fn open<'t>(&mut self, at: &At<'t>, docs: TableDoc) -> Option<Table<'t>> {
        let entries = match at.value {
            None => None,
            Some(DeValue::Table(entries)) => Some(entries),
            Some(_) => {
                self.does_not_fit(at, "a table of keys");
                return None;
            }
        };
        let table = Table { entries, at: at.clone(), docs };
        let known: Vec<&str> = table.docs.keys.iter().map(|key| key.name).collect();
        for (name, span) in table.names().filter(|(name, _)| !at.is_part && !known.contains(name)) {
            let at = table.get(name);
            if let (Some(DeValue::String(word)), Some(entries)) = (at.value, entries)
                && removed::is_kept(&table.at.path, name, word, entries, self.follows(Paper::Yagyu))
            {
                let finding = self.report.warning(Some(span), format!("`{name}` is no longer a key"));
                finding.label(format!("the case has `{word}` without it")).help("leave it out");
                continue;
            }
            self.unknown("key", &at.path, name, span, &known);
        }
        Some(table)
    }

    /// Tables by names of the user's choice, in alphabetic order, each with the place of its name.
    pub fn named<'t>(&mut self, at: &At<'t>) -> Vec<(String, Range<usize>, At<'t>)> {
        let entries = match at.value {
            None => return Vec::new(),
            Some(DeValue::Table(entries)) => entries,
            Some(_) => {
                self.does_not_fit(at, "a table of keys");
                return Vec::new();
            }
        };
        let table = |(key, value): (&toml::Spanned<std::borrow::Cow<'_, str>>, &'t toml::Spanned<DeValue<'t>>)| {
            let name = key.get_ref().to_string();
            let at = At {
                value: Some(value.get_ref()),
                span: value.span(),
                path: format!("{}.{name}", at.path),
                is_part: false,
            };
            (name, key.span(), at)
        };
        let mut list: Vec<_> = entries.iter().map(table).collect();
        list.sort_by(|a, b| a.0.cmp(&b.0));
        for (_, _, at) in &list {
            self.places.spans.insert(at.path.clone(), at.span.clone());
        }
        list
    }

    /// A list of tables, or one of them alone; `None` where it is absent or none.
    pub fn tables<T: Keys>(&mut self, at: &At<'_>) -> Option<Vec<T>> {
        if let Some(DeValue::Table(_)) = at.value {
            let alone = At { path: format!("{}.0", at.path), ..at.clone() };
            self.places.spans.insert(alone.path.clone(), alone.span.clone());
            return T::read(&alone, self).map(|alone| vec![alone]);
        }
        at.value?;
        let Some(list) = at.elements() else {
            self.does_not_fit(at, "a list (`[[...]]` or `[...]`)");
            return None;
        };
        for element in &list {
            self.places.spans.insert(element.path.clone(), element.span.clone());
        }
        Some(list.iter().filter_map(|element| T::read(element, self)).collect())
    }

    fn does_not_fit(&mut self, at: &At<'_>, expected: &str) {
        self.known.is_damaged = true;
        self.report
            .error(at.span.clone(), format!("`{}` cannot be read", at.name()))
            .label(format!("{}; expected {expected}", at.kind()));
    }

    /// A key, or a choice for the key at `path`, that is not known.
    fn unknown(&mut self, what: &str, path: &str, name: &str, span: Range<usize>, known: &[&str]) {
        let word = (what == "choice").then_some(name);
        if let Some(instead) = removed::instead_of(path, word) {
            self.removed(what, name, span, instead);
            return;
        }
        let finding = self.report.error(span, format!("unknown {what} `{name}`"));
        if what == "key" && ORDER.contains(&name) && !known.contains(&name) {
            finding.label("a key of the case, not of this table").help(match name {
                "name" | "title" | "preset" | "solver" | "gravity" => "put it above the first table".to_owned(),
                "grains" | "liquid" | "probe" | "gate" => format!("write `[[{name}]]` above its keys"),
                _ => format!("put it above the first table, or write `[{name}]` above its keys"),
            });
            return;
        }
        let mut sorted = known.to_vec();
        sorted.sort_unstable();
        match nearest(name, sorted.iter().copied()) {
            Some(meant) => {
                finding.label(format!("did you mean `{meant}`?"));
                self.suggested.insert(meant.to_owned());
            }
            None if what == "choice" => {
                finding.label(format!("not a choice for `{}`", last(path)));
            }
            None => {
                finding.label(format!("not a {what} known here"));
            }
        }
        finding.help(format!("known here: {}", sorted.join(", ")));
    }

    /// A key or choice of an earlier version.
    pub(crate) fn removed(&mut self, what: &str, name: &str, span: Range<usize>, instead: &str) {
        self.report.error(span, format!("`{name}` is no longer a {what}")).label("of an earlier version").help(instead);
    }

    /// The alternative that is chosen, by its number, with its table.
    pub fn alternative<'t>(&mut self, at: &At<'t>, docs: &TableDoc) -> Option<(usize, At<'t>)> {
        let known: Vec<&str> = docs.keys.iter().map(|key| key.name).collect();
        let chosen = match at.value {
            Some(DeValue::String(word)) => Some((word.as_ref(), at.span.clone(), at.empty())),
            Some(DeValue::Table(entries)) if entries.len() == 1 => entries.iter().next().map(|(key, value)| {
                let path = format!("{}.{}", at.path, key.get_ref());
                self.places.spans.insert(path.clone(), value.span());
                (
                    key.get_ref().as_ref(),
                    key.span(),
                    At { value: Some(value.get_ref()), span: value.span(), path, is_part: false },
                )
            }),
            Some(DeValue::Table(_)) => {
                self.report
                    .error(at.span.clone(), "exactly one alternative has to be chosen here")
                    .label("this names none or several")
                    .help("keep one of the keys and leave out the others");
                self.known.is_damaged = true;
                return None;
            }
            _ => {
                self.does_not_fit(at, &format!("one of {}", known.join(", ")));
                return None;
            }
        };
        let key = at.path.as_str();
        let (name, span, at) = chosen?;
        let found = known.iter().position(|known| *known == name);
        if found.is_none() {
            self.known.is_damaged = true;
            self.unknown("choice", key, name, span, &known);
        }
        Some((found?, at))
    }
}
