//! Case files and what is refused, warned of and predicted before they run.

mod absurd_cases;
mod case_files;
mod foreseen;
mod idle_keys;
