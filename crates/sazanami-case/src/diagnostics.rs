//! Errors of a case file, several together, each with its place, the expected value and one suggestion.

use std::collections::HashMap;
use std::ops::Range;

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use serde::Serialize;

use crate::source::Source;

/// Severity of a finding: whether the case can run in spite of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// The case cannot run.
    Error,
    /// The case can run, but is it what was meant?
    Warning,
}

/// One finding.
#[derive(Clone, Debug)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// The problem, in one line.
    pub title: String,
    /// Place in the [`Source`]; findings about the whole file have none.
    pub span: Option<Range<usize>>,
    /// Expectation at this place, in a few words.
    pub label: String,
    /// One thing to do.
    pub help: Option<String>,
}

impl Diagnostic {
    /// Says what was expected at the place.
    pub fn label(&mut self, label: impl Into<String>) -> &mut Self {
        self.label = label.into();
        self
    }

    /// Suggests one thing to do.
    pub fn help(&mut self, help: impl Into<String>) -> &mut Self {
        self.help = Some(help.into());
        self
    }
}

/// Findings shown with their excerpts, and findings for other programs: more of them help nobody.
const MOST_SHOWN: usize = 40;
const MOST_RECORDED: usize = 1000;

/// The findings on one case, in the order of the file.
#[derive(Clone, Debug, Default)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    /// Place in the list of the findings that have a place in the file.
    placed: HashMap<(Severity, Range<usize>, String), usize>,
}

/// A finding in a form for other programs.
#[derive(Clone, Debug, Serialize)]
pub struct DiagnosticRecord {
    /// Error or warning.
    pub severity: Severity,
    /// The problem.
    pub message: String,
    /// Case file, or `--set`.
    pub file: String,
    /// Line, from 1.
    pub line: Option<usize>,
    /// Column in characters, from 1.
    pub column: Option<usize>,
    /// The expectation.
    pub expected: Option<String>,
    /// One thing to do.
    pub suggestion: Option<String>,
}

impl Diagnostics {
    /// Adds an error about the text at `span`.
    pub fn error(&mut self, span: Range<usize>, title: impl Into<String>) -> &mut Diagnostic {
        self.add(Severity::Error, Some(span), title.into())
    }

    /// Adds an error about the file as a whole.
    pub fn error_in_file(&mut self, title: impl Into<String>) -> &mut Diagnostic {
        self.add(Severity::Error, None, title.into())
    }

    /// Adds an error about the text at `span`, or about the whole file.
    pub fn error_at(&mut self, span: Option<Range<usize>>, title: impl Into<String>) -> &mut Diagnostic {
        self.add(Severity::Error, span, title.into())
    }

    /// Adds a warning about the text at `span`, or about the whole file.
    pub fn warning(&mut self, span: Option<Range<usize>>, title: impl Into<String>) -> &mut Diagnostic {
        self.add(Severity::Warning, span, title.into())
    }

    /// A finding reported before, such as one on a general table that several entries share, is reported once.
    fn add(&mut self, severity: Severity, span: Option<Range<usize>>, title: String) -> &mut Diagnostic {
        let number = match &span {
            Some(span) => *self.placed.entry((severity, span.clone(), title.clone())).or_insert(self.list.len()),
            None => self.list.len(),
        };
        if number == self.list.len() {
            self.list.push(Diagnostic { severity, title, span, label: String::new(), help: None });
        }
        &mut self.list[number]
    }

    /// Takes over the findings of another list.
    pub fn extend(&mut self, other: Self) {
        let before = self.list.len();
        self.list.extend(other.list);
        other.placed.into_iter().for_each(|(finding, number)| {
            self.placed.entry(finding).or_insert(before + number);
        });
    }

    /// Whether one of them is an error.
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|d| d.severity == Severity::Error)
    }

    /// Whether nothing was found.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The findings: errors first, each group in the order of the file.
    #[must_use]
    pub fn sorted(&self) -> Vec<&Diagnostic> {
        let mut sorted: Vec<&Diagnostic> = self.list.iter().collect();
        sorted
            .sort_by_key(|d| (d.severity == Severity::Warning, d.span.as_ref().map_or(usize::MAX, |span| span.start)));
        sorted
    }

    /// The findings as text for people, with excerpts of the file; `styled` adds the terminal's colours.
    #[must_use]
    pub fn render(&self, source: &Source, styled: bool) -> String {
        let renderer = if styled { Renderer::styled() } else { Renderer::plain() };
        let renderer = renderer.decor_style(DecorStyle::Ascii);
        let mut text = String::new();
        let sorted = self.sorted();
        for diagnostic in sorted.iter().take(MOST_SHOWN) {
            text.push_str(&render_one(&renderer, diagnostic, source));
            text.push_str("\n\n");
        }
        if let Some(more) = sorted.len().checked_sub(MOST_SHOWN).filter(|more| *more > 0) {
            text.push_str(&format!("... and {more} more that are not shown\n\n"));
        }
        text.push_str(&self.closing_line(source));
        text
    }

    /// `2 errors, 1 warning in FILE`.
    fn closing_line(&self, source: &Source) -> String {
        let errors = self.list.iter().filter(|d| d.severity == Severity::Error).count();
        let warnings = self.list.len() - errors;
        let counted = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        let parts: Vec<String> = [(errors, "error"), (warnings, "warning")]
            .iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, w)| counted(*n, w))
            .collect();
        format!("{} in {}\n", parts.join(", "), source.name())
    }

    /// The findings for other programs, the first thousand of them.
    #[must_use]
    pub fn records(&self, source: &Source) -> Vec<DiagnosticRecord> {
        let record = |d: &Diagnostic| {
            let place = d.span.clone().map(|span| source.locate(span));
            DiagnosticRecord {
                severity: d.severity,
                message: d.title.clone(),
                file: place.as_ref().map_or_else(|| source.name().to_owned(), |p| p.origin.to_owned()),
                line: place.as_ref().map(|p| p.line),
                column: place.as_ref().map(|p| p.column),
                expected: (!d.label.is_empty()).then(|| d.label.clone()),
                suggestion: d.help.clone(),
            }
        };
        self.sorted().into_iter().take(MOST_RECORDED).map(record).collect()
    }
}

fn render_one(renderer: &Renderer, diagnostic: &Diagnostic, source: &Source) -> String {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let title = level.primary_title(diagnostic.title.as_str());
    let group: Group<'_> = match &diagnostic.span {
        Some(span) => {
            let place = source.locate(span.clone());
            let mut annotation = AnnotationKind::Primary.span(place.span.clone());
            if !diagnostic.label.is_empty() {
                annotation = annotation.label(diagnostic.label.as_str());
            }
            title.element(Snippet::source(place.text).path(place.origin).annotation(annotation))
        }
        None => {
            let group = title.element(Origin::path(source.name()));
            if diagnostic.label.is_empty() {
                group
            } else {
                group.element(Level::NOTE.message(diagnostic.label.as_str()))
            }
        }
    };
    let group = match &diagnostic.help {
        Some(help) => group.element(Level::HELP.message(help.as_str())),
        None => group,
    };
    renderer.render(&[group])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_findings_are_counted_but_not_all_shown() {
        let source = Source::new("a.toml", "x = 1\n".repeat(5000), &[]);
        let mut report = Diagnostics::default();
        (0..5000).for_each(|n| {
            report.error(6 * n..6 * n + 1, "unknown key `x`").label("not known here");
        });
        // One that is there already, and one of another list.
        report.error(0..1, "unknown key `x`");
        let mut others = Diagnostics::default();
        others.warning(Some(0..1), "unknown key `x`");
        report.extend(others);
        let text = report.render(&source, false);
        assert!(text.contains("and 4961 more that are not shown") && text.len() < 20_000, "{}", text.len());
        assert!(text.ends_with("5000 errors, 1 warning in a.toml\n"), "{text}");
        assert_eq!(report.records(&source).len(), MOST_RECORDED);
        assert_eq!(report.records(&source)[999].line, Some(1000));
    }
}
