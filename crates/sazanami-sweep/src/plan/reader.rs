//! A plan as its file has it: what is wrong is named with its place.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use sazanami::case::read::At;
use sazanami::case::units::parse_quantity;
use sazanami::case::{Diagnostics, Source, nearest};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{MOST_RUNS, Plan, Target};
use crate::keys::{Between, Choices, Design, Key, Setting};
use crate::points;

type Name<'t> = &'t Spanned<Cow<'t, str>>;
type Entry<'t> = &'t Spanned<DeValue<'t>>;

/// Keys at the top of a plan.
const TOP: [&str; 8] = ["case", "points", "seeds", "side_by_side", "set", "keys", "targets", "most_runs"];
/// Most runs of a calibration, unless its plan says so.
const MOST_TRIED: usize = 40;
/// Levels of a design of trajectories, unless its plan says so.
const LEVELS: usize = 4;
/// Keys of a range.
const RANGE: [&str; 6] = ["values", "from", "to", "count", "scale", "integers"];

pub(super) struct Reader<'a> {
    pub text: &'a str,
    pub report: Diagnostics,
}

impl Reader<'_> {
    pub fn plan(&mut self, path: &Path, source: &Source) -> Option<Plan> {
        let (tree, errors) = DeTable::parse_recoverable(self.text);
        for error in errors.iter().take(20) {
            self.report.error(error.span().unwrap_or(0..0), "this is not TOML").label(error.message().to_owned());
        }
        if !errors.is_empty() {
            return None;
        }
        let root = tree.get_ref();
        if let Some((name, _)) = root.get_key_value("domain").filter(|_| !root.contains_key("keys")) {
            self.report
                .error(name.span(), "this is a case, not the plan of a sweep")
                .label("a key of a case")
                .help("`sazanami run` runs it; a plan names it as `case`, and under `[keys]` what varies");
            return None;
        }
        self.only(root, &TOP, "a plan");
        let mut case = None;
        match root.get("case") {
            Some(value) => match value.get_ref() {
                DeValue::String(file) => case = Some((file.to_string(), value.span())),
                _ => drop(self.report.error(value.span(), "`case` is the name of a case file").label("a text")),
            },
            None => drop(self.report.error_in_file("the plan names no case").help("add `case = \"CASE.toml\"`")),
        }
        let side_by_side = root.get("side_by_side").and_then(|value| self.count(value, "side_by_side", 1));
        let fixed = self.fixed(root.get("set"));
        let keys = self.keys(root.get("keys"));
        if keys.is_empty() && !self.report.has_errors() {
            self.report.error_in_file("the plan varies no key").help(
                "add `[keys]` with, for example, `\"liquid.0.fall.speed\" = { values = [\"2 m/s\", \"4 m/s\"] }`",
            );
        }
        for key in &keys {
            if let Some((_, span, _)) = fixed.iter().find(|(path, _, _)| *path == key.path) {
                self.report.error(span.clone(), format!("`{}` is set and varied", key.path)).label("also in `keys`");
            }
        }
        let design = match root.get("points") {
            Some(value) => self.design(value)?,
            None => Design::Product,
        };
        if design != Design::Zip {
            self.repeated(&keys, design);
        }
        let targets = self.targets(root.get("targets"));
        let most_runs = root.get("most_runs").and_then(|value| self.count(value, "most_runs", 3)).unwrap_or(MOST_TRIED);
        if targets.is_empty() && !root.contains_key("targets") {
            self.fitting(&keys, design);
        } else if let Some(points) = root.get("points") {
            self.report.error(points.span(), "a plan with targets makes its points itself").label("no `points`");
        }
        let seeds = root.get("seeds").map(|value| self.seeds(value)).unwrap_or_default();
        if !targets.is_empty() {
            let place = root.get("most_runs").or_else(|| root.get("targets")).map(Spanned::span);
            self.first_points((keys.len() + 1) * seeds.len().max(1), most_runs, place);
        }
        let (file, case_span) = case?;
        if self.report.has_errors() {
            return None;
        }
        let plan = Plan {
            case: path.parent().unwrap_or(Path::new("")).join(file),
            path: path.to_owned(),
            side_by_side,
            source: source.clone(),
            warnings: Diagnostics::default(),
            case_span,
            fixed,
            keys,
            design,
            seeds,
            targets,
            most_runs,
        };
        let runs = points::count(&plan.keys, design).saturating_mul(plan.seeds.len().max(1));
        if runs > MOST_RUNS {
            let place = root.get("points").or_else(|| root.get("keys")).map(Spanned::span);
            self.report
                .error_at(place, format!("{runs} runs are more than the {MOST_RUNS} that a sweep can have"))
                .help("vary fewer keys, or take a Latin hypercube: `points = { latin_hypercube = { count = 100 } }`");
            return None;
        }
        // Zipped points are made for this: of a sound plan, and no more than can be.
        if design == Design::Zip {
            self.repeated(&plan.keys, design);
        }
        Some(plan)
    }

    /// Refuses a plan that allows fewer than the `first` runs of a search.
    fn first_points(&mut self, first: usize, most_runs: usize, place: Option<Range<usize>>) {
        if most_runs < first {
            self.report
                .error_at(
                    place,
                    format!("the first points take {first} runs: one more point than keys, with all seeds"),
                )
                .help(format!("`most_runs = {}` or more", 4 * first));
        }
    }

    /// Refuses keys other than those `known`.
    fn only(&mut self, table: &DeTable, known: &[&str], what: &str) {
        for (name, _) in entries(table) {
            let word = name.get_ref().as_ref();
            if !known.contains(&word) {
                let finding = self.report.error(name.span(), format!("{what} has no key `{word}`"));
                match nearest(word, known.iter().copied()) {
                    Some(meant) => finding.label(format!("did you mean `{meant}`?")),
                    None => finding.help(format!("known: {}", known.join(", "))),
                };
            }
        }
    }

    fn verbatim(&self, span: Range<usize>) -> Setting {
        Setting { value: self.text[span.clone()].trim().to_owned(), span, is_verbatim: true }
    }

    /// A whole number of at least `least`.
    fn count(&mut self, value: Entry, name: &str, least: u64) -> Option<usize> {
        let found = integer(value).filter(|&number| number >= least).and_then(|n| usize::try_from(n).ok());
        if found.is_none() {
            self.report
                .error(value.span(), format!("`{name}` is a whole number of at least {least}"))
                .label(format!("found `{}`", &self.text[value.span()]));
        }
        found
    }

    /// Entries of a table that a plan may leave out, in the order of the file; what is none is refused by `why`.
    fn table<'t>(&mut self, value: Option<Entry<'t>>, why: &str) -> Vec<(Name<'t>, Entry<'t>)> {
        match value.map(|value| (value.get_ref(), value.span())) {
            Some((DeValue::Table(table), _)) => return entries(table),
            Some((_, span)) => drop(self.report.error(span, why)),
            None => {}
        }
        Vec::new()
    }

    fn fixed(&mut self, value: Option<Entry>) -> Vec<(String, Range<usize>, Setting)> {
        let mut found = Vec::new();
        for (name, value) in self.table(value, "`set` is a table of keys and their values") {
            if self.is_key(name, value) {
                found.push((name.get_ref().to_string(), name.span(), self.verbatim(value.span())));
            }
        }
        found
    }

    /// Refuses a path without quotes: `a.b = 1` is a table `a` for TOML.
    fn is_key(&mut self, name: Name, value: Entry) -> bool {
        let DeValue::Table(table) = value.get_ref() else { return true };
        let is_written = self.text[value.span()].trim_start().starts_with('{');
        if !is_written && !table.keys().any(|key| RANGE.contains(&key.get_ref().as_ref())) {
            self.report
                .error(name.span(), "the path of a key stands in quotes")
                .label("this is a table")
                .help("for example `\"liquid.0.fall.speed\" = ...` or `[keys.\"liquid.0.fall.speed\"]`");
            return false;
        }
        true
    }

    fn keys(&mut self, value: Option<Entry>) -> Vec<Key> {
        let mut found = Vec::new();
        for (name, value) in self.table(value, "`keys` is a table of keys and what they vary over") {
            if self.is_key(name, value)
                && let Some(choices) = self.choices(name, value)
            {
                found.push(Key { path: name.get_ref().to_string(), span: name.span(), choices });
            }
        }
        found
    }

    fn choices(&mut self, name: Name, value: Entry) -> Option<Choices> {
        let table = match value.get_ref() {
            DeValue::Array(_) => return self.values(value),
            DeValue::Table(table) => table,
            _ => {
                self.report
                    .error(value.span(), format!("`{}` is to vary over several values", name.get_ref()))
                    .label("expected `{ values = [...] }` or `{ from = ..., to = ..., count = ... }`")
                    .help("what is the same in all runs stands under `[set]`");
                return None;
            }
        };
        self.only(table, &RANGE, "what a key varies over");
        match (table.get("values"), table.get("from"), table.get("to")) {
            (Some(values), None, None) => self.values(values),
            (None, Some(from), Some(to)) => self.between(table, from, to, name.span()).map(Choices::Between),
            _ => {
                self.report
                    .error(name.span(), format!("what `{}` varies over is not said", name.get_ref()))
                    .label("expected either `values = [...]` or `from = ...` and `to = ...`");
                None
            }
        }
    }

    fn values(&mut self, value: Entry) -> Option<Choices> {
        let DeValue::Array(list) = value.get_ref() else {
            self.report.error(value.span(), "`values` is a list").label("expected `[..., ...]`");
            return None;
        };
        if list.is_empty() {
            self.report.error(value.span(), "the list of values is empty").label("expected one value at least");
            return None;
        }
        Some(Choices::Values(list.iter().map(|value| self.verbatim(value.span())).collect()))
    }

    /// Warns of values of a key that are there already, and where keys are zipped of points.
    fn repeated(&mut self, keys: &[Key], design: Design) {
        let lists: Vec<Vec<Vec<Setting>>> = if design == Design::Zip {
            vec![points::of(keys, design)]
        } else {
            let single = |list: &Vec<Setting>| list.iter().map(|value| vec![value.clone()]).collect();
            let values = keys.iter().filter_map(|key| match &key.choices {
                Choices::Values(list) => Some(single(list)),
                // Integers of a range may be fewer than its values.
                Choices::Between(between) if between.is_integer && between.count.is_some() => {
                    Some(points::of(std::slice::from_ref(key), Design::Product))
                }
                Choices::Between(_) => None,
            });
            values.collect()
        };
        let what = if design == Design::Zip { "point" } else { "value" };
        for list in lists {
            for (n, entry) in list.iter().enumerate() {
                let is_same = |other: &Vec<Setting>| other.iter().zip(entry).all(|(a, b)| same(&a.value, &b.value));
                if let (Some(first), Some(value)) = (list[..n].iter().position(is_same), entry.first()) {
                    self.report
                        .warning(
                            Some(value.span.clone()),
                            format!("this {what} is there already, as {what} {}", first + 1),
                        )
                        .label("the same runs are made once more")
                        .help(format!("name each {what} once"));
                }
            }
        }
    }

    fn between(&mut self, table: &DeTable, from: Entry, to: Entry, span: Range<usize>) -> Option<Between> {
        let ends = [self.end(from)?, self.end(to)?];
        let [(a, unit, _), (b, other, _)] = &ends;
        if unit != other {
            self.report
                .error(to.span(), "both ends of a range have the same unit")
                .label(format!("`{other}`, and `from` has `{unit}`"));
        }
        if unit == other && a >= b {
            let from = format!("`to` has to lie above `from`, {a} {unit}");
            self.report.error(to.span(), "the range is empty").label(from.trim_end());
        }
        let mut is_logarithmic = false;
        if let Some(scale) = table.get("scale") {
            match scale.get_ref() {
                DeValue::String(word) if word == "linear" => {}
                DeValue::String(word) if word == "logarithmic" => is_logarithmic = true,
                _ => drop(self.report.error(scale.span(), "`scale` is \"linear\" or \"logarithmic\"")),
            }
        }
        if is_logarithmic && *a <= 0.0 {
            self.report.error(from.span(), "a logarithmic range lies above zero");
        }
        let mut is_integer = false;
        if let Some(value) = table.get("integers") {
            match value.get_ref() {
                DeValue::Boolean(said) => is_integer = *said,
                _ => drop(self.report.error(value.span(), "`integers` is true or false")),
            }
        }
        let count = match table.get("count") {
            Some(value) => Some(self.count(value, "count", 2)?),
            None => None,
        };
        let has_integer_ends = ends[0].2 && ends[1].2;
        let ends = [*a, *b];
        Some(Between { ends, unit: unit.clone(), count, is_logarithmic, is_integer, has_integer_ends, span })
    }

    /// Number and unit of an end, and whether it is written as an integer.
    fn end(&mut self, value: Entry) -> Option<(f64, String, bool)> {
        let found = match value.get_ref() {
            DeValue::String(text) => match parse_quantity(text) {
                Ok(_) => {
                    let text = text.trim();
                    let is_number = |at: usize| text[..at].trim().parse::<f64>().ok();
                    // The longest beginning that is a number: the rest is the unit.
                    let ends = text.char_indices().map(|(at, _)| at).chain([text.len()]);
                    let at = ends.filter(|&at| is_number(at).is_some()).max();
                    at.and_then(|at| Some((is_number(at)?, text[at..].trim().to_owned(), false)))
                }
                Err(error) => {
                    self.report.error(value.span(), error.message);
                    return None;
                }
            },
            other => number(value).map(|number| (number, String::new(), matches!(other, DeValue::Integer(_)))),
        };
        let found = found.filter(|(number, _, _)| number.is_finite());
        if found.is_none() {
            self.report
                .error(value.span(), "an end of a range is a number, or a text with a number and its unit")
                .help("for example `from = \"2 m/s\"`; other values stand in a list, `values = [...]`");
        }
        found
    }

    fn design(&mut self, value: Entry) -> Option<Design> {
        const WORDS: [&str; 5] = ["product", "zip", "latin_hypercube", "sobol", "morris"];
        match value.get_ref() {
            DeValue::String(word) if word == "product" => return Some(Design::Product),
            DeValue::String(word) if word == "zip" => return Some(Design::Zip),
            DeValue::Table(table) => {
                self.only(table, &WORDS[2..], "`points`");
                if let [(name, inner)] = entries(table)[..]
                    && let DeValue::Table(of) = inner.get_ref()
                {
                    return self.samples(name.get_ref(), inner, of);
                }
            }
            _ => {}
        }
        let word = if let DeValue::String(word) = value.get_ref() { word.as_ref() } else { "" };
        let finding = self.report.error(value.span(), "`points` says how the values of several keys are combined");
        match nearest(word, WORDS) {
            Some(meant) => finding.label(format!("did you mean `{meant}`?")),
            None => finding.label("expected \"product\", \"zip\", or a table"),
        };
        finding.help("designs of samples are tables: `points = { sobol = { count = 16 } }`");
        None
    }

    /// A design of samples, by its name and table.
    fn samples(&mut self, name: &str, place: Entry, of: &DeTable) -> Option<Design> {
        let (size, least) = if name == "morris" { ("trajectories", 1) } else { ("count", 2) };
        self.only(
            of,
            if name == "morris" { &["trajectories", "levels", "seed"] } else { &["count", "seed"] },
            "such a design",
        );
        let Some(entry) = of.get(size) else {
            self.report
                .error(place.span(), format!("the number of {} is missing", size.replace("count", "points")))
                .help(format!("add `{size} = 20`"));
            return None;
        };
        let count = self.count(entry, size, least)?;
        let seed = match of.get("seed") {
            Some(seed) => self.count(seed, "seed", 0)? as u64,
            None => 0,
        };
        let levels = match of.get("levels") {
            Some(levels) => self.count(levels, "levels", 2)?,
            None => LEVELS,
        };
        if levels % 2 == 1 {
            self.report.error(of["levels"].span(), "`levels` is even").label("so that each step has one side to go to");
            return None;
        }
        match name {
            "latin_hypercube" => Some(Design::LatinHypercube { count, seed }),
            "sobol" => Some(Design::Sobol { count, seed }),
            "morris" => Some(Design::Morris { trajectories: count, levels, seed }),
            _ => None,
        }
    }

    /// Whether the choices of the keys fit the design.
    fn fitting(&mut self, keys: &[Key], design: Design) {
        for key in keys {
            let Choices::Between(between) = &key.choices else { continue };
            match (between.count, design.count(keys.len())) {
                (None, None) => {
                    self.report
                        .error(key.span.clone(), format!("how many values of `{}` there are is not said", key.path))
                        .help("add `count = 4`, or take points of a design: `points = { sobol = { count = 16 } }`");
                }
                (Some(_), Some(count)) => {
                    self.report
                        .error(key.span.clone(), format!("`{}` has a count, and so has the design", key.path))
                        .label(format!("the design has {count} points"))
                        .help("leave out the count of the key");
                }
                _ => {}
            }
        }
        if design == Design::Zip {
            let first = keys.first().map(|key| (key.choices.len(), &key.path));
            for key in keys {
                let (length, path) = first.unwrap_or((0, &key.path));
                if key.choices.len() != length {
                    self.report
                        .error(key.span.clone(), "keys that are zipped have equally many values")
                        .label(format!("{} values, and `{path}` has {length}", key.choices.len()));
                }
            }
        }
        if let Design::Sobol { seed, .. } = design
            && u32::try_from(seed).is_err()
        {
            self.report.error_in_file(format!("a seed of a Sobol sequence is at most {}", u32::MAX));
        }
    }

    fn targets(&mut self, value: Option<Entry>) -> Vec<Target> {
        let mut found = Vec::new();
        for (name, value) in self.table(value, "`targets` is a table of findings") {
            let entry = |key: &str| value.get_ref().get(key).and_then(number);
            let read = entry("value").zip(entry("tolerance"));
            match read.filter(|(value, tolerance)| value.is_finite() && *tolerance > 0.0) {
                Some((value, tolerance)) => found.push(Target { name: name.get_ref().to_string(), value, tolerance }),
                None => {
                    self.report
                        .error(name.span(), "a target has a value and a tolerance above zero")
                        .help("for example `\"bed.porosity\" = { value = 0.45, tolerance = 0.002 }`");
                }
            }
        }
        found
    }

    fn seeds(&mut self, value: Entry) -> Vec<Setting> {
        let list = match value.get_ref() {
            DeValue::Array(list) if !list.is_empty() => list,
            _ => {
                self.report.error(value.span(), "`seeds` is a list of whole numbers").help("for example `[1, 2, 3]`");
                return Vec::new();
            }
        };
        for value in list.iter().filter(|value| integer(value).is_none()).map(Spanned::span).collect::<Vec<_>>() {
            self.report.error(value, "a seed is a whole number of zero or more");
        }
        let numbers: Vec<Option<f64>> = list.iter().map(number).collect();
        for (n, value) in
            list.iter().enumerate().filter(|(n, _)| numbers[*n].is_some() && numbers[..*n].contains(&numbers[*n]))
        {
            self.report
                .error(value.span(), format!("seed {} is there already", n + 1))
                .help("each seed makes another bed: name it once");
        }
        list.iter().map(|value| self.verbatim(value.span())).collect()
    }
}

fn number(value: Entry) -> Option<f64> {
    At::root(value.get_ref()).number()
}

/// A whole number of zero or more.
fn integer(value: Entry) -> Option<u64> {
    At::root(value.get_ref()).integer().and_then(|number| u64::try_from(number).ok())
}

/// Whether two values as they are written mean the same.
fn same(a: &str, b: &str) -> bool {
    let quantity = |text: &str| match text.strip_prefix(['"', '\'']).and_then(|text| text.strip_suffix(['"', '\''])) {
        Some(inner) => parse_quantity(inner).ok(),
        None => parse_quantity(&text.replace('_', "")).ok(),
    };
    a == b || quantity(a).zip(quantity(b)).is_some_and(|(a, b)| a == b)
}

/// Entries of a table in the order of the file.
fn entries<'t>(table: &'t DeTable<'t>) -> Vec<(Name<'t>, Entry<'t>)> {
    let mut found: Vec<_> = table.iter().collect();
    found.sort_by_key(|(name, _)| name.span().start);
    found
}
