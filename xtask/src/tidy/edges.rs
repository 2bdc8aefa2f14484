//! Which crate may depend on which.

use serde_json::Value;

/// Crates of the workspace, each with those of the workspace it may name in its manifest.
///
/// The same list as in `ARCHITECTURE.md`. Dependencies for tests and build scripts follow the same rule.
const ALLOWED: &[(&str, &[&str])] = &[
    ("sazanami-parallel", &[]),
    ("sazanami-test-support", &[]),
    ("sazanami-numerics", &["sazanami-parallel", "sazanami-test-support"]),
    ("sazanami-dem", &["sazanami-parallel", "sazanami-numerics"]),
    ("sazanami-mics", &["sazanami-parallel", "sazanami-test-support", "sazanami-numerics", "sazanami-dem"]),
    ("sazanami-mps", &["sazanami-parallel", "sazanami-test-support", "sazanami-numerics", "sazanami-dem"]),
    ("sazanami-observe", &["sazanami-parallel", "sazanami-numerics", "sazanami-dem"]),
    ("sazanami-io", &["sazanami-parallel", "sazanami-test-support", "sazanami-numerics"]),
    ("sazanami-case-derive", &[]),
    (
        "sazanami-case",
        &[
            "sazanami-case-derive",
            "sazanami-numerics",
            "sazanami-dem",
            "sazanami-mics",
            "sazanami-mps",
            "sazanami-observe",
            "sazanami-io",
        ],
    ),
    ("sazanami-picture", &["sazanami-parallel", "sazanami-numerics", "sazanami-io", "sazanami"]),
    (
        "sazanami",
        &[
            "sazanami-parallel",
            "sazanami-test-support",
            "sazanami-numerics",
            "sazanami-dem",
            "sazanami-mics",
            "sazanami-mps",
            "sazanami-observe",
            "sazanami-io",
            "sazanami-case",
        ],
    ),
    (
        "sazanami-bench",
        &[
            "sazanami-parallel",
            "sazanami-numerics",
            "sazanami-dem",
            "sazanami-mics",
            "sazanami-mps",
            "sazanami-observe",
            "sazanami-io",
            "sazanami",
        ],
    ),
    (
        "sazanami-verification",
        &[
            "sazanami-parallel",
            "sazanami-numerics",
            "sazanami-dem",
            "sazanami-mics",
            "sazanami-mps",
            "sazanami-observe",
            "sazanami-io",
            "sazanami",
        ],
    ),
    ("sazanami-report", &["sazanami-numerics", "sazanami-io", "sazanami", "sazanami-picture"]),
    ("sazanami-sweep", &["sazanami-dem", "sazanami-io", "sazanami"]),
    (
        "sazanami-cli",
        &[
            "sazanami-parallel",
            "sazanami",
            "sazanami-picture",
            "sazanami-report",
            "sazanami-sweep",
            "sazanami-bench",
            "sazanami-verification",
        ],
    ),
    ("sazanami-python", &["sazanami"]),
    ("xtask", &["sazanami", "sazanami-verification"]),
];

/// Outside crates that only one crate may name.
const RESERVED: &[(&str, &str)] = &[
    ("rayon", "sazanami-parallel"),
    ("rayon-core", "sazanami-parallel"),
    ("ferrompi", "sazanami-parallel"),
    ("mpi", "sazanami-parallel"),
    ("pyo3", "sazanami-python"),
];

/// Crates that hold physics or numbers only: no files, no text formats, no terminal.
pub const PURE: &[&str] =
    &["sazanami-parallel", "sazanami-numerics", "sazanami-dem", "sazanami-mics", "sazanami-mps", "sazanami-observe"];

/// Outside crates that no pure crate may name.
const IMPURE: &[&str] = &["serde", "serde_json", "toml", "clap", "csv", "png", "plotters", "tempfile", "indicatif"];

/// Dependencies in the output of `cargo metadata` that the architecture refuses.
pub fn refused(metadata: &Value) -> Vec<String> {
    let mut problems = Vec::new();
    let packages = metadata["packages"].as_array().map(Vec::as_slice).unwrap_or_default();
    for package in packages {
        let name = package["name"].as_str().unwrap_or("?");
        let Some((_, allowed)) = ALLOWED.iter().find(|(known, _)| *known == name) else {
            problems.push(format!(
                "crate {name} is not in the list of crates: add it to xtask/src/tidy/edges.rs and ARCHITECTURE.md"
            ));
            continue;
        };
        let dependencies = package["dependencies"].as_array().map(Vec::as_slice).unwrap_or_default();
        for dependency in dependencies.iter().filter_map(|dependency| dependency["name"].as_str()) {
            let of_workspace = packages.iter().any(|package| package["name"] == dependency);
            if of_workspace && !allowed.contains(&dependency) {
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
        let all: Vec<_> = ALLOWED.iter().map(|&(name, allowed)| (name, allowed)).collect();
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
