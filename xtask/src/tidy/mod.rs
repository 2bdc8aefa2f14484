//! Architecture rules that the compiler does not know.

mod edges;
mod lock;
mod modules;
mod sources;
mod words;

use std::io;
use std::path::Path;

use serde_json::Value;

use crate::{book, cargo, generated, links, root};

/// Checks the workspace, prints what is wrong, and returns the exit code.
pub fn run(locked: bool) -> u8 {
    println!("-- tidy");
    let metadata = match metadata(locked) {
        Ok(metadata) => metadata,
        Err(problem) => {
            eprintln!("{problem}");
            return 1;
        }
    };
    let mut problems = edges::refused(&metadata);
    problems.extend(generated::stale(&root()));
    let mut warnings = Vec::new();
    let mut take = |what: &str, found: io::Result<Vec<String>>| match found {
        Ok(found) => problems.extend(found),
        Err(error) => problems.push(format!("{what}: cannot be read: {error}")),
    };
    for (name, folder) in packages(&metadata) {
        let shown = folder.display().to_string();
        let findings = sources::findings(&name, &folder, &root());
        take(
            &shown,
            findings.map(|findings| {
                warnings.extend(findings.warnings);
                findings.problems
            }),
        );
        take(&shown, modules::circles(&name, &folder));
    }
    let lock = std::fs::read_to_string(root().join("python/Cargo.lock"));
    take("python/Cargo.lock", lock.map(|text| lock::stale(&metadata, &text)));
    for found in [links::broken(&root()), book::dead(&root()), words::unused(&root())] {
        take("pages, cases and sources", found);
    }
    warnings.iter().for_each(|warning| println!("warning: {warning}"));
    problems.iter().for_each(|problem| eprintln!("error: {problem}"));
    u8::from(!problems.is_empty())
}

fn metadata(locked: bool) -> Result<Value, String> {
    let mut command = cargo();
    command.args(["metadata", "--format-version", "1", "--no-deps"]).args(locked.then_some("--locked"));
    let output = command.output().map_err(|error| format!("cargo metadata cannot be run: {error}"))?;
    if !output.status.success() {
        return Err(format!("cargo metadata failed: {}", String::from_utf8_lossy(&output.stderr).trim()));
    }
    serde_json::from_slice(&output.stdout).map_err(|error| format!("cargo metadata is not JSON: {error}"))
}

/// Names and folders of the workspace's packages.
fn packages(metadata: &Value) -> Vec<(String, std::path::PathBuf)> {
    let all = metadata["packages"].as_array().map(Vec::as_slice).unwrap_or_default();
    all.iter()
        .filter_map(|package| {
            let folder = Path::new(package["manifest_path"].as_str()?).parent()?;
            Some((package["name"].as_str()?.to_string(), folder.to_path_buf()))
        })
        .collect()
}
