//! Contacts: neighbour search, skin checks, contact models and forces.
//!
//! [`model::ContactModel`] is what differs from one contact law to another; a law is one file that implements it, one
//! line in [`laws`], and what users of it need in [`public`].

pub(crate) mod block;
pub(crate) mod context;
pub(crate) mod counters;
pub(crate) mod evaluate;
pub(crate) mod force;
pub(crate) mod incoming;
pub(crate) mod laws;
pub(crate) mod linear_spring_dashpot;
pub(crate) mod model;
pub(crate) mod neighbours;
pub(crate) mod pace;
pub(crate) mod pair;
pub(crate) mod record;
pub(crate) mod search;
pub(crate) mod walls;

/// Public part of the contacts.
pub mod public {
    pub use super::laws::{ContactLaw, Interactions};
    pub use super::linear_spring_dashpot::{Damping, LinearSpringDashpot, damping_ratio, restitution};
    pub use super::pair::DEEP_OVERLAP;
}
