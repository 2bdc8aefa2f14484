//! Modules of a crate that import one another in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::Path;

use super::sources::{lines_of_tests, without_comments_and_text};
use crate::links::files_below;

/// Modules that may import one another, by crate: reading, writing and checking a table recurse through its keys.
const MUTUAL: &[(&str, &[&[&str]])] = &[(
    "sazanami-case",
    &[&["case", "cross_checks", "moving_particles"], &["key", "known", "read", "tables", "value", "write"]],
)];

/// For each module of a level those that it imports.
type Imports = BTreeMap<String, BTreeSet<String>>;

/// Circles among the top-level modules of the crate `name` in `folder`, and among those within each of its modules.
pub fn circles(name: &str, folder: &Path) -> io::Result<Vec<String>> {
    let (source, mut files) = (folder.join("src"), Vec::new());
    files_below(&source, "rs", &mut files)?;
    let mut texts = Vec::new();
    for file in &files {
        let path = file.strip_prefix(&source).unwrap_or(file).with_extension("");
        let mut module: Vec<String> = path.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        module.pop_if(|last| last == "mod");
        let code = without_comments_and_text(&std::fs::read_to_string(file)?);
        texts.push((module, code.map_err(|error| io::Error::other(format!("{}: {error}", file.display())))?));
    }
    let allowed = MUTUAL.iter().find(|(known, _)| *known == name).map_or(&[][..], |(_, groups)| *groups);
    let mut problems = refused(name, &imports(&texts, &[]), allowed);
    let parents: BTreeSet<&[String]> = texts.iter().map(|(module, _)| &module[..module.len().max(1) - 1]).collect();
    for parent in parents.into_iter().filter(|parent| !parent.is_empty()) {
        problems.extend(refused(&format!("{name}::{}", parent.join("::")), &imports(&texts, parent), &[]));
    }
    Ok(problems)
}

/// Imports between the modules within `parent` (the crate: none) by `texts`, code with the path of its module.
fn imports(texts: &[(Vec<String>, String)], parent: &[String]) -> Imports {
    let level = parent.len();
    let within: Vec<_> =
        texts.iter().filter(|(module, _)| module.len() > level && module.starts_with(parent)).collect();
    let modules: BTreeSet<&String> = within.iter().map(|(module, _)| &module[level]).collect();
    let mut imports = Imports::new();
    for (module, code) in
        within.iter().filter(|(module, _)| level > 0 || !["lib", "main"].contains(&module[0].as_str()))
    {
        let tested = lines_of_tests(code);
        let kept: Vec<&str> = code.lines().zip(tested).filter(|(_, tested)| !tested).map(|(line, _)| line).collect();
        let named = named_within(&kept.join("\n"), parent, module.len() - level);
        let others = named.into_iter().filter(|other| *other != module[level] && modules.contains(other));
        imports.entry(module[level].clone()).or_default().extend(others);
    }
    imports
}

/// Names that directly follow the module `parent` in `code` of a module so `deep` below it: `crate::PARENT::NAME`,
/// `crate::PARENT::{NAME, ...}`, and as many `super::` as lead there.
fn named_within(code: &str, parent: &[String], deep: usize) -> Vec<String> {
    let down: String = parent.iter().map(|module| format!("{module}::")).collect();
    let mut names = Vec::new();
    for root in [format!("crate::{down}"), "super::".repeat(deep)] {
        let root = root.as_str();
        for (at, _) in code.match_indices(root) {
            let begins = !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':' || c == '$');
            let rest = &code[at + root.len()..];
            match rest.strip_prefix('{') {
                _ if !begins => {}
                Some(group) => names.extend(first_names(group)),
                None => names.push(name_at(rest)),
            }
        }
    }
    names
}

/// The first name of each item of a group of imports, from behind its opening brace on.
fn first_names(group: &str) -> Vec<String> {
    let (mut depth, mut begins, mut names) = (0, true, Vec::new());
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => begins = true,
            c if begins && !c.is_whitespace() => {
                names.push(name_at(&group[at..]));
                begins = false;
            }
            _ => {}
        }
    }
    names
}

fn name_at(text: &str) -> String {
    text.chars().take_while(|&c| c.is_alphanumeric() || c == '_').collect()
}

/// Circles in `imports` but for those among the modules of a group in `allowed`, and groups that form none any more.
fn refused(name: &str, imports: &Imports, allowed: &[&[&str]]) -> Vec<String> {
    let group_of = |module: &str| allowed.iter().position(|group| group.contains(&module));
    let outside = imports.iter().map(|(from, to)| {
        let is_free = |other: &&String| group_of(from).is_none() || group_of(from) != group_of(other);
        (from.clone(), to.iter().filter(is_free).cloned().collect())
    });
    let found = circle(outside.collect()).map(|edges| {
        format!("modules of {name} import one another in a circle: {edges}; move what they share below them")
    });
    let superfluous = allowed.iter().filter(|group| {
        let within = |module: &&String| group.contains(&module.as_str());
        let inside = imports.iter().filter(|(from, _)| within(from));
        circle(inside.map(|(from, to)| (from.clone(), to.iter().filter(within).cloned().collect())).collect()).is_none()
    });
    let no_circle =
        |group: &&[&str]| format!("{group:?} of {name} form no circle: take them from xtask/src/tidy/modules.rs");
    found.into_iter().chain(superfluous.map(no_circle)).collect()
}

/// The imports that remain when modules that import nothing, or that nothing imports, are taken away until there is
/// none; `None` if nothing remains.
fn circle(mut imports: Imports) -> Option<String> {
    loop {
        let imported: BTreeSet<String> = imports.values().flatten().cloned().collect();
        let kept: BTreeSet<String> = imports
            .iter()
            .filter(|(from, to)| !to.is_empty() && imported.contains(*from))
            .map(|(from, _)| from.clone())
            .collect();
        if kept.len() == imports.len() {
            break;
        }
        imports.retain(|from, _| kept.contains(from));
        imports.values_mut().for_each(|to| to.retain(|other| kept.contains(other)));
    }
    let edge =
        |(from, to): (&String, &BTreeSet<String>)| to.iter().map(|to| format!("{from} -> {to}")).collect::<Vec<_>>();
    let edges: Vec<String> = imports.iter().flat_map(edge).collect();
    (!edges.is_empty()).then(|| edges.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(files: &[(&str, &str)]) -> Imports {
        let texts = files.iter().map(|(module, text)| {
            (module.split('/').map(str::to_owned).collect(), without_comments_and_text(text).unwrap())
        });
        imports(&texts.collect::<Vec<_>>(), &[])
    }

    #[test]
    fn circles_within_a_module_are_refused() {
        let found = |back: &str| {
            let folder = std::env::temp_dir().join(format!("sazanami-modules-{}-{}", std::process::id(), back.len()));
            let inner = folder.join("src/a/c");
            std::fs::create_dir_all(&inner).unwrap();
            let write = |name: &str, text: &str| std::fs::write(folder.join("src").join(name), text).unwrap();
            write("lib.rs", "mod a;");
            write("a/mod.rs", "mod b; mod c; use b::B;");
            write("a/b.rs", "use super::c::C;");
            write("a/c/mod.rs", "mod d; use crate::Real;");
            write("a/c/d.rs", back);
            let problems = circles("x", &folder).unwrap();
            std::fs::remove_dir_all(&folder).unwrap();
            problems
        };
        for back in ["use super::super::b::B;", "use crate::a::b;", "use crate::a::{b::B, e};"] {
            let problems = found(back);
            assert!(
                problems.len() == 1 && problems[0].contains("x::a ") && problems[0].contains("b -> c"),
                "{problems:?}"
            );
        }
        assert_eq!(found("use super::b; use crate::b;"), Vec::<String>::new(), "other modules of that name");
    }

    #[test]
    fn one_way_imports_are_accepted() {
        let files = [
            ("lib", "pub mod a; use crate::c::C;"),
            ("a", "use crate::b::B; mod inner;"),
            ("a/inner", "use super::A; use crate::b;"),
            (
                "b",
                "use crate::{c, d::{D, a}, Real};\n// use crate::a::A;\n#[cfg(test)]\nmod tests {\n use crate::a;\n}",
            ),
            ("c", "fn f() -> &str { \"crate::a\" }"),
            ("d", "macro_rules! m { () => { $crate::a }; }"),
        ];
        let imports = of(&files);
        assert_eq!(imports["b"], ["c", "d"].map(str::to_owned).into());
        assert_eq!(refused("x", &imports, &[]), Vec::<String>::new());
    }

    #[test]
    fn circles_are_refused() {
        for back in ["use crate::a::A;", "use super::super::a;", "fn f(a: crate::a::A) {}", "use crate::{b::B,\n a};"] {
            let imports =
                of(&[("a", "use crate::b::B;"), ("b", ""), ("b/c", "use crate::c;"), ("c/e", back), ("d", "")]);
            let problems = refused("x", &imports, &[]);
            assert!(problems.len() == 1 && problems[0].contains("a -> b, b -> c, c -> a"), "{back}: {problems:?}");
            assert!(refused("x", &imports, &[&["a", "b", "c"]]).is_empty());
            assert_eq!(refused("x", &imports, &[&["a", "b", "c"], &["d", "e"]]).len(), 1, "a group without a circle");
        }
    }
}
