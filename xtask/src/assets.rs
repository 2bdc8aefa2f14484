//! Libraries that reports embed: fetched by npm as pinned, bundled by esbuild, put where the build takes them from.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::{exit_code, root};

/// Folder of the libraries, with the list of their versions.
const ASSETS: &str = "crates/sazanami-report/assets";
/// Files copied from the packages: from `node_modules`, to `vendor`.
const COPIED: [(&str, &str); 4] = [
    ("uplot/dist/uPlot.iife.min.js", "uPlot.iife.min.js"),
    ("uplot/dist/uPlot.min.css", "uPlot.min.css"),
    ("uplot/LICENSE", "uPlot.LICENSE"),
    ("three/LICENSE", "three.LICENSE"),
];

/// Writes the files; npm and a network are needed. Returns the exit code.
pub fn run() -> u8 {
    let (assets, work) = (root().join(ASSETS), root().join("target/assets"));
    match fetched(&assets, &work) {
        Ok(0) => {
            println!("wrote {ASSETS}/vendor; `git diff` shows what changed");
            0
        }
        Ok(code) => code,
        Err(problem) => {
            eprintln!("error: {problem}");
            1
        }
    }
}

/// Fetches and bundles within `work`; returns the exit code of what failed.
fn fetched(assets: &Path, work: &Path) -> std::io::Result<u8> {
    fs::create_dir_all(work)?;
    for name in ["package.json", "package-lock.json", "three.entry.js"] {
        fs::copy(assets.join(name), work.join(name))?;
    }
    let code =
        exit_code(Command::new("npm").args(["ci", "--ignore-scripts", "--no-fund", "--no-audit"]).current_dir(work));
    if code != 0 {
        return Ok(code);
    }
    let vendor = assets.join("vendor");
    let out = format!("--outfile={}", vendor.join("three.min.js").display());
    let options = [
        "three.entry.js",
        "--bundle",
        "--minify",
        "--format=iife",
        "--global-name=THREE",
        "--legal-comments=inline",
        &out,
    ];
    let code = exit_code(Command::new("node_modules/.bin/esbuild").args(options).current_dir(work));
    for (from, to) in COPIED {
        fs::copy(work.join("node_modules").join(from), vendor.join(to))?;
    }
    Ok(code)
}
