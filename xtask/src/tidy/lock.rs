//! Whether the lock file of the Python package, a workspace of its own, names what the crates need.

use serde_json::Value;

/// Dependencies of the crates in `lock` by their manifests that the lock does not name: `pip install` would be refused.
pub fn stale(metadata: &Value, lock: &str) -> Vec<String> {
    let packages = metadata["packages"].as_array().map(Vec::as_slice).unwrap_or_default();
    let mut problems = Vec::new();
    for entry in lock.split("[[package]]").filter(|entry| !entry.contains("\nsource = ")) {
        let name = entry.lines().find_map(|line| line.strip_prefix("name = ")).unwrap_or_default().trim_matches('"');
        let Some(package) = packages.iter().find(|package| package["name"] == name) else { continue };
        // A line is `"name",` or `"name version",`.
        let locked: Vec<&str> =
            entry.lines().filter_map(|line| line.trim().strip_prefix('"')?.split(['"', ' ']).next()).collect();
        let needed = package["dependencies"].as_array().map(Vec::as_slice).unwrap_or_default();
        let needed = needed.iter().filter(|one| one["kind"].is_null() && one["optional"] != true);
        problems.extend(needed.filter_map(|one| one["name"].as_str()).filter(|one| !locked.contains(one)).map(|one| {
            format!(
                "python/Cargo.lock: {name} needs {one}: run `cargo update --workspace` in python/ and commit the file"
            )
        }));
    }
    problems
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_dependency_that_is_not_locked_is_found() {
        let of = |name: &str, kind: Value, optional: bool| json!({ "name": name, "kind": kind, "optional": optional });
        let dependencies =
            [of("serde", Value::Null, false), of("tempfile", json!("dev"), false), of("mpi", Value::Null, true)];
        let metadata = json!({ "packages": [{ "name": "sazanami", "dependencies": dependencies }] });
        let lock = "version = 4\n\n[[package]]\nname = \"sazanami\"\nversion = \"0.1.0\"\ndependencies = [\n \"serde 1.0.0\",\n]\n";
        assert_eq!(stale(&metadata, lock), Vec::<String>::new());
        let problems = stale(&metadata, &lock.replace("serde 1", "toml 1"));
        assert!(problems.len() == 1 && problems[0].contains("sazanami needs serde"), "{problems:?}");
    }
}
