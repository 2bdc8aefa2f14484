//! `sazanami new`: templates for cases.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use sazanami::case::json_schema;
use sazanami::error::{CommandError, exit};
use sazanami::results::as_word;
use sazanami::templates::{TEMPLATES, template};

use crate::words;

/// List the templates, or write a commented case of one kind into DIR.
#[derive(Debug, Args)]
#[command(
    long_about = "List the templates, or write a commented case of one kind into DIR, with the JSON Schema that lets \
                  editors complete it. Files that exist are not overwritten.",
    after_help = "Example:\n  sazanami new raindrop my-drop\n  sazanami check my-drop/raindrop.toml"
)]
pub struct New {
    /// Template; without one, the templates are listed
    #[arg(requires = "dir", value_parser = words::TEMPLATE, hide_possible_values = true)]
    template: Option<String>,
    /// Folder to write into; made if it is missing
    dir: Option<PathBuf>,
    /// Print the JSON Schema of case files and do nothing else
    #[arg(long, conflicts_with_all = ["template", "dir"])]
    schema: bool,
}

impl New {
    pub fn execute(self) -> Result<u8, CommandError> {
        if self.schema {
            out!("{}", json_schema());
            return Ok(exit::DONE);
        }
        let (Some(name), Some(dir)) = (self.template, self.dir) else {
            for template in &TEMPLATES {
                outln!("{:<16} {}", template.name, template.about);
            }
            outln!("\nwrite one with `sazanami new TEMPLATE DIR`");
            return Ok(exit::DONE);
        };
        let template = template(&name)?;
        if dir.extension().is_some_and(|extension| extension == "toml") && !dir.is_dir() {
            let folder = dir.with_extension("");
            return Err(CommandError::input(
                format!("`{}` names a file, and a folder is made", dir.display()),
                format!("`sazanami new {name} {}` writes {}/{name}.toml", as_word(&folder), folder.display()),
            ));
        }
        let case = dir.join(format!("{}.toml", template.name));
        let schema = dir.join("schema.json");
        if case.exists() {
            return Err(CommandError::input(format!("`{}` exists already", case.display()), "choose another folder"));
        }
        let unwritable = |error: std::io::Error| {
            CommandError::input(
                format!("nothing can be written to `{}`: {error}", dir.display()),
                "choose another folder",
            )
        };
        fs::create_dir_all(&dir).map_err(unwritable)?;
        fs::write(&case, format!("#:schema ./schema.json\n{}", template.text)).map_err(unwritable)?;
        outln!("{}", case.display());
        let text = json_schema();
        match fs::read(&schema) {
            Ok(there) if there == text.as_bytes() => outln!("{} (there already)", schema.display()),
            Ok(_) => outln!(
                "{} is kept, although it differs: `sazanami new --schema` prints that of this version",
                schema.display()
            ),
            Err(_) => {
                let file = fs::File::create_new(&schema);
                file.and_then(|mut file| file.write_all(text.as_bytes())).map_err(unwritable)?;
                outln!("{}", schema.display());
            }
        }
        let name = as_word(&case);
        outln!("\nsee what it will be with `sazanami check {name}`, run it with `sazanami run {name}`");
        Ok(exit::DONE)
    }
}
