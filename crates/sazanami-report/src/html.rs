//! HTML as it is put together: what comes from outside goes through [`Html::text`] and cannot become markup.

use std::fmt::Write as _;

use serde_json::Value;

/// Attributes of an element.
pub type Attributes<'a> = &'a [(&'static str, &'a str)];

/// A page, or a part of one.
#[derive(Debug, Default)]
pub struct Html(String);

impl Html {
    /// The text of the page.
    pub fn into_text(self) -> String {
        self.0
    }

    /// Adds markup, which the program itself holds.
    pub fn raw(&mut self, markup: &'static str) {
        self.0.push_str(markup);
    }

    /// Adds text.
    pub fn text(&mut self, text: &str) {
        for character in text.chars() {
            match character {
                '&' => self.0.push_str("&amp;"),
                '<' => self.0.push_str("&lt;"),
                '>' => self.0.push_str("&gt;"),
                '"' => self.0.push_str("&quot;"),
                '\'' => self.0.push_str("&#39;"),
                other => self.0.push(other),
            }
        }
    }

    /// Begins an element.
    pub fn open(&mut self, name: &'static str, attributes: Attributes) {
        let _ = write!(self.0, "<{name}");
        for (key, value) in attributes {
            let _ = write!(self.0, " {key}=\"");
            self.text(value);
            self.0.push('"');
        }
        self.0.push('>');
    }

    /// Ends an element.
    pub fn close(&mut self, name: &'static str) {
        let _ = writeln!(self.0, "</{name}>");
    }

    /// Adds an element that holds a text.
    pub fn element(&mut self, name: &'static str, attributes: Attributes, text: &str) {
        self.open(name, attributes);
        self.text(text);
        self.close(name);
    }

    /// Begins a section of the page with its heading.
    pub fn section(&mut self, id: &'static str, heading: &str) {
        let label = format!("{id}-heading");
        self.open("section", &[("id", id), ("aria-labelledby", &label)]);
        self.element("h2", &[("id", &label)], heading);
    }

    /// Adds a table whose rows begin with their heading.
    pub fn table(&mut self, caption: &str, headings: &[&str], rows: &[Vec<String>]) {
        self.table_of_class(None, caption, headings, rows);
    }

    /// The same of which narrow screens show the cells of a row one below the other, each with its heading.
    pub fn table_of_cells(&mut self, caption: &str, headings: &[&str], rows: &[Vec<String>]) {
        self.table_of_class(Some("cells"), caption, headings, rows);
    }

    fn table_of_class(&mut self, class: Option<&'static str>, caption: &str, headings: &[&str], rows: &[Vec<String>]) {
        self.open("div", &[("class", "wide"), ("role", "region"), ("tabindex", "0"), ("aria-label", caption)]);
        self.open("table", class.map(|class| ("class", class)).as_slice());
        self.element("caption", &[], caption);
        if !headings.is_empty() {
            self.raw("<thead><tr>");
            headings.iter().for_each(|heading| self.element("th", &[("scope", "col")], heading));
            self.raw("</tr></thead>\n");
        }
        self.raw("<tbody>\n");
        for row in rows {
            self.raw("<tr>");
            for (number, cell) in row.iter().enumerate() {
                let is_part = cell.starts_with("  ");
                match (number, is_part) {
                    (0, true) => self.element("th", &[("scope", "row"), ("class", "part")], cell.trim()),
                    (0, false) => self.element("th", &[("scope", "row")], cell),
                    _ => match headings.get(number).filter(|_| class == Some("cells")) {
                        Some(&heading) => self.element("td", &[("data-heading", heading)], cell),
                        None => self.element("td", &[], cell),
                    },
                }
            }
            self.raw("</tr>\n");
        }
        self.raw("</tbody></table></div>\n");
    }

    /// Adds data for the scripts of the page: JSON in which nothing can end its element.
    pub fn data(&mut self, id: &str, value: &Value) {
        self.open("script", &[("type", "application/json"), ("id", id)]);
        self.0.push_str(&value.to_string().replace('<', "\\u003c"));
        self.close("script");
    }

    /// Adds bytes for the scripts of the page, in base64.
    pub fn bytes(&mut self, id: &str, bytes: &[u8]) {
        self.open("script", &[("type", "application/octet-stream"), ("id", id)]);
        push_base64(&mut self.0, bytes);
        self.close("script");
    }

    /// Adds a PNG picture that a press opens in full; what closes it leads `back` to a place of the page.
    pub fn picture(&mut self, id: &str, back: &str, png: &[u8], about: &str) {
        self.open("div", &[("class", "picture"), ("id", id)]);
        self.element("a", &[("class", "shut"), ("href", back)], "Close");
        self.open("a", &[("href", &format!("#{id}")), ("title", "Open in full")]);
        self.raw("<img src=\"data:image/png;base64,");
        push_base64(&mut self.0, png);
        self.raw("\" alt=\"");
        self.text(about);
        self.raw("\"></a></div>\n");
    }
}

/// Adds `bytes` in base64 (RFC 4648, section 4).
fn push_base64(text: &mut String, bytes: &[u8]) {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    text.reserve(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = (0..3).fold(0_usize, |word, n| word << 8 | usize::from(chunk.get(n).copied().unwrap_or(0)));
        for digit in 0..4 {
            let is_there = digit <= chunk.len();
            text.push(if is_there { char::from(DIGITS[word >> (18 - 6 * digit) & 63]) } else { '=' });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_from_outside_stays_text() {
        let bad = "</script><script>alert('x')</script>\" onload=\"y";
        let mut html = Html::default();
        html.element("p", &[("title", bad)], bad);
        html.table(bad, &[bad], &[vec![bad.into()]]);
        let markup = html.0.clone();
        html.data("d", &serde_json::json!({ "a": bad }));
        let text = html.into_text();
        assert_eq!(text.matches("<script").count(), 1, "{text}");
        assert_eq!(text.matches("</script").count(), 1, "{text}");
        assert!(!markup.contains("\" onload"), "{markup}");
    }

    #[test]
    fn a_table_of_cells_tells_the_heading_of_each() {
        let made = |add: fn(&mut Html)| {
            let mut html = Html::default();
            add(&mut html);
            html.into_text()
        };
        let heading = "<td data-heading=\"value\">1</td>";
        assert!(
            made(|html| html.table_of_cells("", &["key", "value"], &[vec!["a".into(), "1".into()]])).contains(heading)
        );
        assert!(!made(|html| html.table("", &["key", "value"], &[vec!["a".into(), "1".into()]])).contains(heading));
    }

    #[test]
    fn base64_is_that_of_the_standard() {
        // RFC 4648, section 10.
        for (bytes, expected) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")]
        {
            let mut text = String::new();
            push_base64(&mut text, bytes.as_bytes());
            assert_eq!(text, expected);
        }
    }
}
