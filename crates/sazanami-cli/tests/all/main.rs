//! The command as people and machines use it.

mod behaviour;
mod commands;
mod snapshots;
mod sweep;
mod verify;
