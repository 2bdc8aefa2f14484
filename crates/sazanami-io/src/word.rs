//! Paths in commands that people copy.

use std::path::Path;

/// A path as one word of a shell: as it stands, or in quotes where a shell would take it apart.
#[must_use]
pub fn as_word(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:@%=".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_a_shell_would_take_apart_is_quoted() {
        for (path, word) in [
            ("runs/paper-1", "runs/paper-1"),
            ("", "''"),
            ("my runs/a", "'my runs/a'"),
            ("it's", "'it'\\''s'"),
            ("$HOME;x", "'$HOME;x'"),
            ("砂/漣", "砂/漣"),
        ] {
            assert_eq!(as_word(Path::new(path)), word);
        }
    }
}
