//! `sazanami man`: the manual pages.

use std::path::PathBuf;

use clap::{Args, CommandFactory as _};
use clap_mangen::Man as Page;
use sazanami::error::{CommandError, exit};

/// Print the manual page, or write it and those of all commands
#[derive(Debug, Args)]
#[command(
    long_about = "Print the manual page of the program (roff, for `man -l -`), or write it and one of each command into DIR, where \
                  `man` finds them if DIR is `man1` in a folder of MANPATH.",
    after_help = "Example:\n  sazanami man | man -l -\n  sazanami man --out ~/.local/share/man/man1"
)]
pub struct Man {
    /// Write the pages into DIR, which is made if it is missing
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Man {
    pub fn execute(self) -> Result<u8, CommandError> {
        let command = crate::Arguments::command().name("sazanami");
        let Some(folder) = self.out else {
            let mut page = Vec::new();
            Page::new(command).render(&mut page).map_err(|error| CommandError::Undone(error.to_string()))?;
            out!("{}", String::from_utf8_lossy(&page));
            return Ok(exit::DONE);
        };
        let unwritable = |error: std::io::Error| {
            CommandError::input(
                format!("nothing can be written to `{}`: {error}", folder.display()),
                "choose another folder with --out",
            )
        };
        std::fs::create_dir_all(&folder).map_err(unwritable)?;
        clap_mangen::generate_to(command, &folder).map_err(unwritable)?;
        outln!("wrote the pages to {}", folder.display());
        Ok(exit::DONE)
    }
}
