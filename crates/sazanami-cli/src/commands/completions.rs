//! `sazanami completions`: lets a shell complete commands, options, files, templates and keys.

use clap::{Args, Command, CommandFactory as _};
use clap_complete::Shell;
use sazanami::error::{CommandError, exit};

/// Print the completions of a shell.
#[derive(Debug, Args)]
#[command(
    long_about = "Print a script that lets a shell complete commands, options and files, and the names of templates, keys of case \
                  files, cases of `verify` and benchmarks.",
    after_help = "Example:\n  sazanami completions bash > ~/.local/share/bash-completion/completions/sazanami\n  \
                  sazanami completions zsh > ~/.zfunc/_sazanami\n  \
                  sazanami completions fish > ~/.config/fish/completions/sazanami.fish"
)]
pub struct Completions {
    /// Shell
    shell: Shell,
}

/// A key is followed by its value: no space is put behind `key=`.
const BASH: &str = "
_sazanami_before_values() {
    _sazanami \"$@\"
    if [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *= ]]; then compopt -o nospace; fi
}
complete -F _sazanami_before_values -o bashdefault -o default sazanami
";

impl Completions {
    pub fn execute(self) -> Result<u8, CommandError> {
        let mut command = crate::Arguments::command();
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, "sazanami", &mut script);
        out!("{}", String::from_utf8_lossy(&script));
        match self.shell {
            Shell::Bash => out!("{BASH}"),
            Shell::Fish => command.get_subcommands().for_each(fish_words),
            _ => {}
        }
        Ok(exit::DONE)
    }
}

/// What stands by itself behind a command, which the generator for fish leaves out.
fn fish_words(command: &Command) {
    for argument in command.get_positionals().filter(|argument| argument.get_id() != "shell") {
        let words: Vec<String> =
            argument.get_possible_values().iter().map(|value| value.get_name().to_owned()).collect();
        if !words.is_empty() {
            let name = command.get_name();
            outln!("complete -c sazanami -n \"__fish_seen_subcommand_from {name}\" -f -a \"{}\"", words.join(" "));
        }
    }
}
