//! The text a case is read from: the file, and the `--set` overrides as lines of their own, so that
//! an error in an override points to the override.

use std::ops::Range;

/// Text of a case file with its overrides. Places are byte ranges over the file followed by the
/// overrides, each set off by one byte.
#[derive(Clone, Debug)]
pub struct Source {
    name: String,
    text: String,
    overrides: Vec<String>,
}

/// A place in one of the texts of a [`Source`].
#[derive(Clone, Debug)]
pub struct Place<'a> {
    /// Name of the file, or `--set`.
    pub origin: &'a str,
    /// The whole text it stands in.
    pub text: &'a str,
    /// Bytes of that text.
    pub span: Range<usize>,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Source {
    /// The source of the case file `name` with the given text and `path=value` overrides.
    #[must_use]
    pub fn new(name: impl Into<String>, text: impl Into<String>, overrides: &[String]) -> Self {
        Self { name: name.into(), text: text.into(), overrides: overrides.to_vec() }
    }

    /// Name of the file.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Text of the file.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The overrides, each with the place where it begins.
    pub fn overrides(&self) -> impl Iterator<Item = (usize, &str)> {
        let mut start = self.text.len() + 1;
        self.overrides.iter().map(move |text| {
            let here = start;
            start += text.len() + 1;
            (here, text.as_str())
        })
    }

    /// Finds the text that holds `span`.
    #[must_use]
    pub fn locate(&self, span: Range<usize>) -> Place<'_> {
        for (start, text) in self.overrides() {
            if span.start >= start && span.start <= start + text.len() {
                let end = (span.end - start).min(text.len());
                return place("--set", text, span.start - start..end);
            }
        }
        let start = span.start.min(self.text.len());
        place(&self.name, &self.text, start..span.end.clamp(start, self.text.len()))
    }
}

/// Line of the byte `at` of a text, from 1.
pub(crate) fn line_of(text: &[u8], at: usize) -> usize {
    text[..at.min(text.len())].iter().filter(|byte| **byte == b'\n').count() + 1
}

fn place<'a>(origin: &'a str, text: &'a str, span: Range<usize>) -> Place<'a> {
    let before = &text[..span.start];
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    Place {
        origin,
        text,
        line: line_of(text.as_bytes(), span.start),
        column: before[line_start..].chars().count() + 1,
        span,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_in_the_file_and_in_the_overrides() {
        let source = Source::new("a.toml", "one = 1\ntwo = 2\n", &["three=3".into(), "four=4".into()]);
        let two = source.locate(8..11);
        assert_eq!((two.origin, two.line, two.column, &two.text[two.span.clone()]), ("a.toml", 2, 1, "two"));
        let (start, _) = source.overrides().nth(1).unwrap();
        let four = source.locate(start..start + 4);
        assert_eq!((four.origin, four.line, &four.text[four.span.clone()]), ("--set", 1, "four"));
        let end = source.locate(16..99);
        assert_eq!(end.line, 3);
    }
}
