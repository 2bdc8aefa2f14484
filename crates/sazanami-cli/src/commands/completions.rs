//! `sazanami completions`: lets a shell complete commands, options and files.

use clap::{Args, CommandFactory as _};
use clap_complete::Shell;
use sazanami::error::{CommandError, exit};

/// Print the completions of a shell.
#[derive(Debug, Args)]
#[command(
    long_about = "Print a script that lets a shell complete commands, options and files.",
    after_help = "Example:\n  sazanami completions bash > ~/.local/share/bash-completion/completions/sazanami\n  \
                  sazanami completions zsh > ~/.zfunc/_sazanami\n  \
                  sazanami completions fish > ~/.config/fish/completions/sazanami.fish"
)]
pub struct Completions {
    /// Shell
    shell: Shell,
}

impl Completions {
    pub fn execute(self) -> Result<u8, CommandError> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut crate::Arguments::command(), "sazanami", &mut script);
        out!("{}", String::from_utf8_lossy(&script));
        Ok(exit::DONE)
    }
}
