//! Words that shells complete, and the command that was meant by a misspelt one.

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command, CommandFactory as _};
use sazanami::case::{key_paths, nearest, value_paths};
use sazanami::templates::TEMPLATES;
use sazanami_bench::benches;
use sazanami_verification::catalogue;

/// A text of which shells know the likely words; any other is taken too, and the command says what is wrong with it.
#[derive(Clone, Copy, Debug)]
pub struct Likely(fn() -> Vec<String>);

/// Names of templates.
pub const TEMPLATE: Likely = Likely(|| TEMPLATES.iter().map(|template| template.name.to_owned()).collect());
/// Paths of keys.
pub const KEY: Likely = Likely(key_paths);
/// Keys with the sign of equality behind them.
pub const OVERRIDE: Likely = Likely(|| value_paths().into_iter().map(|path| path + "=").collect());
/// Cases with known results.
pub const VERIFIED: Likely = Likely(|| catalogue::CASES.iter().map(|case| case.name.to_owned()).collect());
/// Benchmarks.
pub const BENCH: Likely = Likely(|| benches().iter().map(|bench| bench.name.to_owned()).collect());

impl TypedValueParser for Likely {
    type Value = String;

    fn parse_ref(
        &self,
        command: &Command,
        argument: Option<&Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<String, clap::Error> {
        StringValueParser::new().parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.0)().into_iter().map(PossibleValue::new)))
    }
}

/// Most words that an error lists.
const MOST_LISTED: usize = 20;

/// Words of other programs, and the command that does the same here.
const ELSEWHERE: [(&str, &str); 12] = [
    ("simulate", "run"),
    ("solve", "run"),
    ("start", "run"),
    ("restart", "resume"),
    ("continue", "resume"),
    ("init", "new"),
    ("create", "new"),
    ("template", "new"),
    ("validate", "check"),
    ("lint", "check"),
    ("plot", "report"),
    ("benchmark", "bench"),
];

/// Adds what was meant to an error about a command that there is not.
pub fn with_what_was_meant(mut error: clap::Error) -> clap::Error {
    // Likely words stand for no limit, and there may be hundreds.
    if let Some(ContextValue::Strings(words)) = error.get(ContextKind::ValidValue)
        && words.len() > MOST_LISTED
    {
        error.remove(ContextKind::ValidValue);
    }
    if error.kind() == ErrorKind::UnknownArgument
        && error.get(ContextKind::InvalidArg) == Some(&ContextValue::String("--threads".to_owned()))
        && std::env::args().nth(1).as_deref() == Some("verify")
    {
        let tip = "`--jobs N` says how many cases run at a time, each on one thread";
        error.remove(ContextKind::SuggestedArg);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
    let Some(ContextValue::String(said)) = error.get(ContextKind::InvalidSubcommand).cloned() else { return error };
    if error.kind() != ErrorKind::InvalidSubcommand {
        return error;
    }
    if said.ends_with(".toml") {
        error.remove(ContextKind::SuggestedSubcommand);
        let tip = format!("`sazanami run {said}` runs a case, `sazanami check {said}` explains it");
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    } else if let Some(meant) = meant_by(&said) {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![meant]));
    }
    error
}

fn meant_by(said: &str) -> Option<String> {
    let of_others = || nearest(said, ELSEWHERE.map(|(word, _)| word));
    let exact = ELSEWHERE.iter().any(|(word, _)| *word == said).then_some(said);
    let here = |word| ELSEWHERE.iter().find(|(other, _)| *other == word).map(|(_, meant)| (*meant).to_owned());
    if let Some(word) = exact {
        return here(word);
    }
    let command = crate::Arguments::command();
    let names: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
    nearest(said, names).map(str::to_owned).or_else(|| of_others().and_then(here))
}
