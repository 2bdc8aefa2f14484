//! Cases with known results: case files and programs that measure, files that judge.
//!
//! A case file is run as a user runs it, and `expected.toml` says what is taken of its tables ([`posed`], [`value`]).
//! [`particles`] are experiments on moving particles; the programs in [`cases`] measure them, and whole runs, and return values
//! by name. Unit, reference and band of every value are in `verification/<case>/expected.toml`
//! ([`expected`]); [`judge`] compares, [`verify`] runs, [`page`] writes the pages.
//!
//! ```
//! use sazanami::stop::Stop;
//! use sazanami_verification::catalogue::CASES;
//! use sazanami_verification::verify::{Choice, verify};
//!
//! let choice = Choice { names: vec!["restitution".into()], ..Choice::default() };
//! let found = verify(CASES, &choice, &mut sazanami::progress::Silent, &Stop::new())?;
//! assert!(found[0].rows.iter().all(|row| !row.verdict.is_bad()));
//! # Ok::<(), sazanami::error::CommandError>(())
//! ```

pub mod cases;
pub mod catalogue;
pub mod chart;
pub mod expected;
pub mod judge;
pub mod measured;
pub mod page;
pub mod particles;
pub mod posed;
pub mod reference;
pub mod value;
pub mod verify;
