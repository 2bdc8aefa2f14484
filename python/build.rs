//! Tells the program which commit it was built from, where that is known.

use std::process::Command;

fn main() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    for file in [".git/HEAD", ".git/logs/HEAD"] {
        println!("cargo::rerun-if-changed={root}/{file}");
    }
    println!("cargo::rerun-if-env-changed=SAZANAMI_COMMIT");
    let described = Command::new("git").args(["rev-parse", "--short=12", "HEAD"]).current_dir(root).output();
    let described = described.ok().filter(|output| output.status.success());
    let commit = described.and_then(|output| String::from_utf8(output.stdout).ok()).map(|text| text.trim().to_owned());
    // A source archive has no history: who builds from one may set the variable.
    if let (None, Some(commit)) = (std::env::var_os("SAZANAMI_COMMIT"), commit) {
        println!("cargo::rustc-env=SAZANAMI_COMMIT={commit}");
    }
}
