//! Errors of grains and their contacts, in physical terms.

use sazanami_numerics::domain::FailedElsewhere;
use sazanami_numerics::snapshot::SnapshotError;
use sazanami_numerics::{Real, Vector};

use crate::film::Film;

/// The grains cannot be set up or moved on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DemError {
    /// A position, velocity, orientation or angular momentum is NaN or infinite.
    #[error("grain {id} at {position} m became NaN or infinite in sub-step {substep}")]
    NotFinite {
        /// Identifier of the grain.
        id: u64,
        /// Last known position of its centre of mass \[m].
        position: Vector,
        /// Sub-step within the call, from 0.
        substep: usize,
    },
    /// A centre of mass left the region that grains may be in.
    #[error("grain {id} escaped from the box: its centre of mass is at {position} m")]
    GrainEscaped {
        /// Identifier of the grain.
        id: u64,
        /// Position of its centre of mass \[m].
        position: Vector,
    },
    /// Two contact spheres, or a sphere and a wall, interpenetrate too far.
    #[error(
        "grains {} and {} overlap by {:.0} % of a contact sphere's radius at {position} m in sub-step {substep}",
        ids[0], Partner(ids[1]), fraction * 100.0
    )]
    OverlapTooLarge {
        /// Identifiers of the grains; [`crate::WALL`] plus its number for a wall.
        ids: [u64; 2],
        /// Overlap over the radius of the smaller sphere.
        fraction: Real,
        /// That beyond which a sub-step fails ([`crate::Engine::largest_overlap_allowed`]).
        allowed: Real,
        /// Position of the first grain \[m].
        position: Vector,
        /// Sub-step within the call, from 0.
        substep: usize,
    },
    /// Contacts drive the grains: an explicit integration with too long sub-steps.
    #[error(
        "contacts gave the grains {gained:.3e} J more than they took of the {exchanged:.3e} J that they exchanged, most to grain \
         {id} by {time} s: sub-steps are too long"
    )]
    EnergyGained {
        /// Identifier of the grain that they gave most.
        id: u64,
        /// End of the call in which they did, on the grains' clock \[s].
        time: Real,
        /// Energy that they gave beyond what they took \[J].
        gained: Real,
        /// Energy that they took and gave \[J].
        exchanged: Real,
    },
    /// A periodic direction is so short that a grain could touch its own image.
    #[error("the box is {length} m long in periodic direction x{}, but the grains need {needed} m", direction + 1)]
    BoxTooShort {
        /// Direction, 0 or 1.
        direction: usize,
        /// Extent of the box \[m].
        length: Real,
        /// Extent needed \[m].
        needed: Real,
    },
    /// Grains are described inconsistently.
    #[error("grain {id}: {what}")]
    BadGrain {
        /// Identifier of the grain.
        id: u64,
        /// Error in its description.
        what: String,
    },
    /// The parameters of the film make no sense.
    #[error(
        "a film needs a viscosity that is finite and not negative, and a roughness and a reach above zero, not {film:?}"
    )]
    BadFilm {
        /// The film.
        film: Film,
    },
    /// A grain is no ball, or its film would end within the roughness.
    #[error("grain {id} has no film: it is no ball, or the reach of {} radii is below the roughness of {} m", film.reach, film.roughness)]
    FilmDoesNotFit {
        /// Identifier of the grain.
        id: u64,
        /// The film.
        film: Film,
    },
    /// A plate is moved that is not among the walls.
    #[error(
        "the walls of the grains have no plate {number}, counted from 0: name it in their setup with `Wall::plate`"
    )]
    NoPlate {
        /// Its number among the plates.
        number: usize,
    },
    /// A snapshot does not hold what is needed.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// The grains of another rank failed.
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

impl DemError {
    /// Two grains have the identifier `id`.
    pub(crate) fn not_unique(id: u64) -> Self {
        Self::BadGrain { id, what: "the identifier is not unique".to_string() }
    }
}

/// Shows a partner that may be a wall.
struct Partner(u64);

impl std::fmt::Display for Partner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.0 >= crate::WALL { write!(f, "wall {}", self.0 - crate::WALL) } else { self.0.fmt(f) }
    }
}
