//! Reports.

mod browser;
mod content;
mod support;
