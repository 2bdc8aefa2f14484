//! Names that the sources of a crate may use.

use std::io;
use std::path::Path;

use super::edges::PURE;
use crate::links::files_below;

/// Lines of a file, without its tests, from which on a warning asks to split it.
const LONG: usize = 700;

/// Names that no source may hold, outside tests or in them.
const NOWHERE: &[(&str, &str)] = &[
    ("todo!", "finish it or leave it out"),
    ("unimplemented!", "finish it or leave it out"),
    ("dbg!", "say it in a report or an error"),
    ("#![allow(", "allow a lint where it is met, with its reason"),
];

/// Names that pure crates may not hold outside tests.
const NOT_IN_PURE: &[(&str, &str)] = &[
    ("std::fs", "files belong to sazanami-io"),
    ("File::", "files belong to sazanami-io"),
    ("println!", "what happened belongs to reports and errors"),
    ("print!", "what happened belongs to reports and errors"),
    ("eprintln!", "what happened belongs to reports and errors"),
    ("eprint!", "what happened belongs to reports and errors"),
    ("serde", "formats belong to sazanami-io and sazanami"),
    ("Instant::now", "physics has no wall clock"),
    ("SystemTime", "physics has no wall clock"),
];

/// The crate that poses cases, and names that it may not hold outside tests: it reads what a case names.
const POSING: &str = "sazanami-posing";
const NOT_IN_POSING: &[(&str, &str)] = &[
    ("fs::write", "what a run writes belongs to sazanami"),
    ("fs::create_dir", "what a run writes belongs to sazanami"),
    ("File::create", "what a run writes belongs to sazanami"),
    ("CheckpointWriter", "checkpoints belong to sazanami"),
    ("println!", "what was found belongs to reports and errors"),
    ("print!", "what was found belongs to reports and errors"),
    ("eprintln!", "what was found belongs to reports and errors"),
    ("eprint!", "what was found belongs to reports and errors"),
    ("Instant", "what a run takes is told by sazanami"),
    ("SystemTime", "what a run takes is told by sazanami"),
];

/// Problems and warnings of a crate.
#[derive(Debug, Default)]
pub struct Findings {
    pub problems: Vec<String>,
    pub warnings: Vec<String>,
}

/// Reads the Rust sources of a crate.
pub fn findings(name: &str, folder: &Path, root: &Path) -> io::Result<Findings> {
    let mut findings = Findings::default();
    for part in ["src", "tests", "examples", "benches"] {
        let mut files = Vec::new();
        files_below(&folder.join(part), "rs", &mut files)?;
        for file in files {
            let text = std::fs::read_to_string(&file)?;
            let shown = file.strip_prefix(root).unwrap_or(&file).display().to_string();
            look_at(name, &shown, &text, part == "src", &mut findings);
        }
    }
    Ok(findings)
}

fn look_at(name: &str, shown: &str, text: &str, is_source: bool, findings: &mut Findings) {
    let code = without_comments_and_text(text);
    let in_tests = lines_of_tests(&code);
    for (number, line) in code.lines().enumerate() {
        let tested = in_tests[number];
        let mut refuse = |what: &str, why: &str| {
            findings.problems.push(format!("{shown}:{}: `{what}` in {name}: {why}", number + 1));
        };
        if let Some((what, why)) = NOWHERE.iter().find(|(what, _)| holds(line, what)) {
            refuse(what, why);
        }
        if name != "sazanami-parallel" && holds(line, "rayon::") {
            refuse("rayon::", "threads belong to sazanami-parallel");
        }
        let refused = match name {
            POSING => NOT_IN_POSING,
            _ if PURE.contains(&name) => NOT_IN_PURE,
            _ => &[],
        };
        if is_source
            && !tested
            && let Some((what, why)) = refused.iter().find(|(what, _)| holds(line, what))
        {
            refuse(what, why);
        }
    }
    let lines = in_tests.iter().filter(|&&tested| !tested).count();
    if is_source && lines > LONG {
        findings.warnings.push(format!("{shown}: {lines} lines without tests, more than {LONG}: split it by topic"));
    }
}

/// Whether a line holds a name that does not continue another one to its left.
fn holds(line: &str, what: &str) -> bool {
    let part_of_name = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(what).any(|(at, _)| !what.starts_with(part_of_name) || !line[..at].ends_with(part_of_name))
}

/// For each line whether it belongs to a module under `#[cfg(test)]`.
pub(super) fn lines_of_tests(code: &str) -> Vec<bool> {
    let mut marks = Vec::new();
    let mut announced = false;
    let mut depth: Option<i64> = None;
    for line in code.lines() {
        announced |= line.trim() == "#[cfg(test)]";
        if announced && depth.is_none() && line.contains("mod ") {
            depth = Some(0);
        } else if announced && depth.is_none() && line.contains(['{', ';']) {
            announced = false; // something else than a module is for tests only
        }
        marks.push(announced);
        if let Some(open) = &mut depth {
            *open += line.matches('{').count() as i64 - line.matches('}').count() as i64;
            if *open <= 0 {
                announced = false;
                depth = None;
            }
        }
    }
    marks
}

/// The code with comments and the contents of literals blanked out; lines stay where they are.
pub(super) fn without_comments_and_text(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut code = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let rest = &bytes[at..];
        let length = if rest.starts_with(b"//") {
            rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len())
        } else if rest.starts_with(b"/*") {
            block_comment(rest)
        } else if let Some(length) = raw_text(rest).filter(|_| !continues_a_name(bytes, at)) {
            length
        } else if rest[0] == b'"' {
            quoted(rest, b'"')
        } else if rest[0] == b'\'' && is_character(rest) {
            quoted(rest, b'\'')
        } else {
            code.push(rest[0]);
            at += 1;
            continue;
        };
        code.push(b' ');
        code.extend(rest[..length].iter().filter(|&&b| b == b'\n'));
        at += length;
    }
    String::from_utf8_lossy(&code).into_owned()
}

fn continues_a_name(bytes: &[u8], at: usize) -> bool {
    at.checked_sub(1).is_some_and(|before| bytes[before].is_ascii_alphanumeric() || bytes[before] == b'_')
}

/// Length of a (nested) block comment.
fn block_comment(rest: &[u8]) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        if rest[at..].starts_with(b"/*") {
            depth += 1;
            at += 2;
        } else if rest[at..].starts_with(b"*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                break;
            }
        } else {
            at += 1;
        }
    }
    at
}

/// Length of a raw string literal, if one starts here.
fn raw_text(rest: &[u8]) -> Option<usize> {
    let start = usize::from(rest[0] == b'b');
    if rest.get(start) != Some(&b'r') {
        return None;
    }
    let hashes = rest[start + 1..].iter().take_while(|&&b| b == b'#').count();
    let open = start + 1 + hashes;
    if rest.get(open) != Some(&b'"') {
        return None;
    }
    let mut close = vec![b'"'];
    close.resize(1 + hashes, b'#');
    let inside = rest[open + 1..].windows(close.len()).position(|window| window == close);
    Some(inside.map_or(rest.len(), |inside| open + 1 + inside + close.len()))
}

/// Length of a literal between two `mark`s.
fn quoted(rest: &[u8], mark: u8) -> usize {
    let mut at = 1;
    while at < rest.len() && rest[at] != mark {
        at += if rest[at] == b'\\' { 2 } else { 1 };
    }
    (at + 1).min(rest.len())
}

/// Whether a quote opens a character literal, not a lifetime.
fn is_character(rest: &[u8]) -> bool {
    let length = match rest.get(1) {
        Some(b'\\') => return true,
        Some(0..=0x7f) => 1,
        Some(0xc0..=0xdf) => 2,
        Some(0xe0..=0xef) => 3,
        _ => 4,
    };
    rest.get(1 + length) == Some(&b'\'')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(name: &str, text: &str) -> Vec<String> {
        let mut findings = Findings::default();
        look_at(name, "file.rs", text, true, &mut findings);
        findings.problems
    }

    #[test]
    fn physics_may_not_touch_files_threads_or_terminals() {
        for line in [
            "let text = std::fs::read(path);",
            "println!(\"{x}\");",
            "use serde::Serialize;",
            "rayon::join(a, b);",
            "let now = Instant::now();",
            "todo!()",
            "#![allow(dead_code)]",
        ] {
            assert_eq!(problems("sazanami-dem", line).len(), 1, "{line}");
        }
        for line in ["std::fs::write(path, text)?;", "eprintln!();", "use std::time::Instant;"] {
            assert_eq!(problems("sazanami-posing", line).len(), 1, "{line}");
            assert!(problems("sazanami", line).is_empty(), "{line}");
        }
        assert!(problems("sazanami-posing", "std::fs::read_to_string(path)?; use serde::Serialize;").is_empty());
        // The same lines are nobody's business elsewhere, or in tests.
        assert!(problems("sazanami-io", "std::fs::read(path); use serde::Serialize;").is_empty());
        assert!(problems("sazanami-parallel", "rayon::join(a, b);").is_empty());
        assert!(problems("sazanami-dem", "#[cfg(test)]\nmod tests {\n    println!(\"{x}\");\n}\n").is_empty());
        assert_eq!(problems("sazanami-dem", "#[cfg(test)]\nmod tests {\n    todo!();\n}\nprintln!();").len(), 2);
    }

    #[test]
    fn comments_and_texts_do_not_count() {
        for line in [
            "// println! would be wrong here",
            "/* std::fs /* nested */ println! */ fn f() {}",
            "let a = \"todo! \\\" println!\";",
            "let b = r#\"say \"println!\" \"#;",
            "let c = '\"'; let d = \"println!\";",
            "let e = blueprint!(); MeshFile::open();",
        ] {
            assert!(problems("sazanami-dem", line).is_empty(), "{line}: {:?}", problems("sazanami-dem", line));
        }
        assert_eq!(problems("sazanami-dem", "fn f<'a>(x: &'a str) { println!(\"{}\", 'x'); }").len(), 1);
    }

    #[test]
    fn lines_keep_their_numbers() {
        let text = "/* one\ntwo */\nlet s = \"a\nb\";\n\ntodo!();\n";
        assert_eq!(problems("xtask", text), ["file.rs:6: `todo!` in xtask: finish it or leave it out"]);
    }

    #[test]
    fn only_what_follows_the_mark_is_a_test() {
        let code = "#[cfg(test)]\nuse a::b;\nfn f() {}\n#[cfg(test)]\nmod tests {\n fn g() {\n }\n}\nfn h() {}\n";
        let marked: Vec<usize> = (1..).zip(lines_of_tests(code)).filter(|(_, test)| *test).map(|(n, _)| n).collect();
        assert_eq!(marked, [1, 4, 5, 6, 7, 8]);
    }

    #[test]
    fn long_files_are_pointed_out() {
        let mut findings = Findings::default();
        look_at("xtask", "long.rs", &"fn f() {}\n".repeat(701), true, &mut findings);
        assert_eq!((findings.problems.len(), findings.warnings.len()), (0, 1));
        let tested = format!("{}#[cfg(test)]\nmod tests {{\n{}}}\n", "x\n".repeat(600), "y\n".repeat(600));
        let mut findings = Findings::default();
        look_at("xtask", "tested.rs", &tested, true, &mut findings);
        assert!(findings.warnings.is_empty());
    }
}
