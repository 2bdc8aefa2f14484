//! Contacts: neighbour search, skin checks, the contact law and forces.
//!
//! What users of it need is in [`public`].

pub(crate) mod block;
pub(crate) mod context;
pub(crate) mod counters;
pub(crate) mod evaluate;
pub(crate) mod force;
pub(crate) mod incoming;
pub(crate) mod laws;
pub(crate) mod linear_spring_dashpot;
pub(crate) mod neighbours;
pub(crate) mod pace;
pub(crate) mod pair;
pub(crate) mod record;
pub(crate) mod search;
pub(crate) mod walls;

/// Public part of the contacts.
pub mod public {
    pub use super::laws::Interactions;
    pub use super::linear_spring_dashpot::{Damping, LinearSpringDashpot, damping_ratio, restitution};
    pub use super::pair::DEEP_OVERLAP;
}
