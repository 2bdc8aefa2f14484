//! `sazanami explain`: what a key of case files means.

use clap::Args;
use sazanami::case::{Explained, explain};
use sazanami::error::{CommandError, exit};

use crate::words;

/// Explain a key of case files: meaning, unit, range, defaults
#[derive(Debug, Args)]
#[command(
    long_about = "Explain a key of case files: its meaning, unit, range and default, what `preset = \"paper_literal\"` \
                  sets and why, and the words it can have. Without a key, list the tables.",
    after_help = "Example:\n  sazanami explain fluid.viscosity\n  sazanami explain grains.placement.packed"
)]
pub struct Explain {
    /// Path of the key, such as fluid.viscosity, or its name alone
    #[arg(value_parser = words::KEY, hide_possible_values = true)]
    key: Option<String>,
}

impl Explain {
    /// Prints it.
    pub fn execute(self) -> Result<u8, CommandError> {
        let key = self.key.unwrap_or_default();
        match explain(&key) {
            Explained::Text(text) => {
                out!("{text}");
                Ok(exit::DONE)
            }
            Explained::Unknown { meant, known } => {
                let hint = match (meant, &known[..]) {
                    (Some(meant), _) => format!("did you mean `{meant}`?"),
                    (None, []) => "`sazanami explain` lists the tables".to_owned(),
                    (None, known) => format!("known here: {}", known.join(", ")),
                };
                Err(CommandError::input(format!("there is no key `{key}`"), hint))
            }
        }
    }
}
