//! Pictures.

mod painter;
mod raindrop;
