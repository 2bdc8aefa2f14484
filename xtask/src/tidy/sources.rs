//! Names that the sources of a crate may use.

use std::io;
use std::path::Path;

use proc_macro2::{LexError, TokenStream, TokenTree};

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
    let code = match without_comments_and_text(text) {
        Ok(code) => code,
        Err(error) => {
            findings.problems.push(format!("{shown}: this is not Rust: {error}"));
            return;
        }
    };
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

/// The code with comments and literals blanked out; names stay where they are.
pub(super) fn without_comments_and_text(text: &str) -> Result<String, LexError> {
    let mut code: Vec<u8> = text.bytes().map(|byte| if byte == b'\n' { byte } else { b' ' }).collect();
    keep(text.parse()?, text.as_bytes(), &mut code);
    Ok(String::from_utf8_lossy(&code).into_owned())
}

/// Copies tokens other than literals from `text` to the same places of `code`.
fn keep(tokens: TokenStream, text: &[u8], code: &mut [u8]) {
    for token in tokens {
        let place = token.span().byte_range();
        // A comment of documentation counts as the tokens of an attribute.
        if ["//", "/*"].iter().any(|mark| text[place.clone()].starts_with(mark.as_bytes())) {
            continue;
        }
        match token {
            TokenTree::Literal(_) => {}
            TokenTree::Group(group) => {
                for end in [group.span_open(), group.span_close()].map(|span| span.byte_range()) {
                    code[end.clone()].copy_from_slice(&text[end]);
                }
                keep(group.stream(), text, code);
            }
            TokenTree::Ident(_) | TokenTree::Punct(_) => code[place.clone()].copy_from_slice(&text[place]),
        }
    }
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
