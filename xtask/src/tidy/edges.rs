//! Dependencies allowed between crates.

use serde_json::Value;

/// Crates of the workspace, each with those of the workspace it may name in its manifest, without `sazanami-`.
///
/// The same list as in `ARCHITECTURE.md`. Dependencies for tests and build scripts follow the same rule.
const ALLOWED: &[(&str, &str)] = &[
    ("parallel", ""),
    ("mpi", "parallel"),
    ("test-support", ""),
    ("numerics", "parallel test-support"),
    ("dem", "parallel numerics"),
    ("mics", "parallel test-support numerics dem"),
    ("mps", "parallel test-support numerics dem"),
    ("observe", "parallel numerics dem"),
    ("io", "parallel test-support numerics"),
    ("case-derive", ""),
    ("case", "case-derive numerics dem mics mps observe io"),
    ("posing", "parallel numerics dem mics mps observe io case"),
    ("picture", "parallel numerics io sazanami"),
    ("sazanami", "parallel test-support numerics dem mics mps observe io posing"),
    ("bench", "parallel numerics dem mics mps observe io posing sazanami"),
    ("verification", "parallel numerics dem mics mps observe io posing sazanami"),
    ("report", "numerics io sazanami picture"),
    ("sweep", "numerics io sazanami"),
    ("cli", "parallel mpi sazanami picture report sweep bench verification"),
    ("python", "sazanami"),
    ("xtask", "sazanami verification"),
];

/// Outside crates that only one crate may name.
const RESERVED: &[(&str, &str)] = &[
    ("rayon", "sazanami-parallel"),
    ("rayon-core", "sazanami-parallel"),
    ("ferrompi", "sazanami-mpi"),
    ("mpi", "sazanami-mpi"),
    ("pyo3", "sazanami-python"),
];

/// Crates that hold physics or numbers only: no files, no text formats, no terminal.
pub const PURE: &[&str] =
    &["sazanami-parallel", "sazanami-numerics", "sazanami-dem", "sazanami-mics", "sazanami-mps", "sazanami-observe"];

/// Outside crates that no pure crate may name.
const IMPURE: &[&str] = &["serde", "serde_json", "toml", "clap", "csv", "png", "plotters", "tempfile", "indicatif"];

/// Names of the crates that a crate may name; none of a crate that is not in the list.
fn allowed_for(name: &str) -> Option<Vec<String>> {
    let full =
        |word: &str| if matches!(word, "sazanami" | "xtask") { word.to_owned() } else { format!("sazanami-{word}") };
    let (_, words) = ALLOWED.iter().find(|(known, _)| full(known) == name)?;
    Some(words.split_whitespace().map(full).collect())
}

/// Dependencies in the output of `cargo metadata` that the architecture refuses.
pub fn refused(metadata: &Value) -> Vec<String> {
    let mut problems = Vec::new();
    let packages = metadata["packages"].as_array().map(Vec::as_slice).unwrap_or_default();
    for package in packages {
        let name = package["name"].as_str().unwrap_or("?");
        let Some(allowed) = allowed_for(name) else {
            problems.push(format!(
                "crate {name} is not in the list of crates: add it to xtask/src/tidy/edges.rs and ARCHITECTURE.md"
            ));
            continue;
        };
        let dependencies = package["dependencies"].as_array().map(Vec::as_slice).unwrap_or_default();
        for dependency in dependencies.iter().filter_map(|dependency| dependency["name"].as_str()) {
            let of_workspace = packages.iter().any(|package| package["name"] == dependency);
            if of_workspace && !allowed.iter().any(|name| name == dependency) {
                problems.push(format!("{name} must not depend on {dependency}: it may name {allowed:?}"));
            }
            if let Some((_, owner)) =
                RESERVED.iter().find(|(reserved, owner)| *reserved == dependency && *owner != name)
            {
                problems.push(format!("{name} must not depend on {dependency}: only {owner} may"));
            }
            if PURE.contains(&name) && IMPURE.contains(&dependency) {
                problems
                    .push(format!("{name} must not depend on {dependency}: it holds no files, formats or terminals"));
            }
        }
    }
    if packages.is_empty() {
        problems.push("cargo metadata names no packages".to_string());
    }
    problems
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Metadata of crates with their dependencies.
    fn workspace(crates: &[(&str, &[&str])]) -> Value {
        let package = |(name, dependencies): &(&str, &[&str])| {
            let dependencies: Vec<Value> =
                dependencies.iter().map(|name| json!({ "name": name, "kind": null })).collect();
            json!({ "name": name, "dependencies": dependencies })
        };
        json!({ "packages": crates.iter().map(package).collect::<Vec<_>>() })
    }

    #[test]
    fn the_architecture_is_accepted() {
        // Every word of the lists is a crate of the list itself.
        let known = |word: &str| ALLOWED.iter().any(|(name, _)| *name == word);
        assert!(ALLOWED.iter().flat_map(|(_, words)| words.split_whitespace()).all(known));
        let crates = ["sazanami-mics", "sazanami-case", "sazanami", "sazanami-cli", "xtask"];
        let allowed = crates.map(|name| (name, allowed_for(name).unwrap()));
        let allowed =
            allowed.each_ref().map(|(name, names)| (*name, names.iter().map(String::as_str).collect::<Vec<_>>()));
        let all: Vec<(&str, &[&str])> = allowed.iter().map(|(name, names)| (*name, names.as_slice())).collect();
        assert_eq!(refused(&workspace(&all)), Vec::<String>::new());
        let outside = [("sazanami-parallel", &["rayon", "bytemuck"] as &[&str]), ("sazanami-io", &["serde", "png"])];
        assert_eq!(refused(&workspace(&outside)), Vec::<String>::new());
    }

    #[test]
    fn forbidden_edges_are_refused() {
        for (from, to) in [
            ("sazanami-mics", "sazanami-mps"),
            ("sazanami-mps", "sazanami-mics"),
            ("sazanami-dem", "sazanami-mics"),
            ("sazanami-numerics", "sazanami-dem"),
            ("sazanami-io", "sazanami-dem"),
            ("sazanami-observe", "sazanami-io"),
            ("sazanami-io", "sazanami-picture"),
            ("sazanami", "sazanami-picture"),
            ("sazanami-posing", "sazanami"),
            ("sazanami-cli", "sazanami-dem"),
            ("sazanami-parallel", "sazanami-numerics"),
            ("sazanami-dem", "rayon"),
            ("sazanami-numerics", "serde"),
            ("sazanami", "mpi"),
        ] {
            let problems =
                refused(&workspace(&[(from, &[to]), (if to.starts_with("sazanami") { to } else { "xtask" }, &[])]));
            assert_eq!(problems.len(), 1, "{from} -> {to}: {problems:?}");
            assert!(problems[0].starts_with(&format!("{from} must not depend on {to}")), "{problems:?}");
        }
    }

    #[test]
    fn unknown_crates_and_empty_metadata_are_refused() {
        assert_eq!(refused(&workspace(&[("sazanami-utils", &[])])).len(), 1);
        assert_eq!(refused(&json!({})).len(), 1);
    }
}
