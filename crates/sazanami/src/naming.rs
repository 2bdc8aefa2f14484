//! Grains and walls by the names of the case, for messages.

use sazanami_dem::{DemError, Wall};
use sazanami_numerics::Vector;
use sazanami_posing::assembly::grains::population_of;

use crate::case::meaning::{Case, SIDE_NAMES};

/// Message on an error of the grains, by their names in the case.
pub(crate) fn grain_error(case: &Case, walls: &[Wall], error: &DemError) -> String {
    let name = |id: u64| partner(case, walls, id);
    match error {
        DemError::NotFinite { id, position, substep } => {
            format!("{} at {} is no longer a number in sub-step {substep}", name(*id), place(*position))
        }
        DemError::GrainEscaped { id, position } => {
            format!("{} escaped from the box: its centre of mass is at {}", name(*id), place(*position))
        }
        DemError::OverlapTooLarge { ids, fraction, allowed, position, substep } => {
            // Packing, relaxation and the time before have their own.
            let softened = case.dem.soften.filter(|softening| softening.largest_overlap == *allowed);
            let limit = softened.map_or(String::new(), |softening| {
                let limit = 1e2 * softening.largest_overlap;
                format!("; `dem.soften` allows {limit:.1} %: soften less or later, in a new run")
            });
            format!(
                "{} and {} overlap by {:.1} % of a contact sphere's radius at {} in sub-step {substep}{limit}",
                name(ids[0]),
                name(ids[1]),
                1e2 * fraction,
                place(*position)
            )
        }
        DemError::EnergyGained { id, gained, exchanged, .. } => {
            let own = if case.dem.allowed_error.is_some() {
                "leave out `dem.allowed_error`"
            } else {
                "leave `dem.substeps` and the step to the run"
            };
            format!(
                "contacts gave the grains {gained:.3e} J more than they took of the {exchanged:.3e} J that they exchanged, most to {}: \
                 their sub-steps are too long; {own}, or take a softer contact",
                name(*id)
            )
        }
        other => other.to_string(),
    }
}

/// A grain by its number and population, a side of the box or a gate.
pub(crate) fn partner(case: &Case, walls: &[Wall], id: u64) -> String {
    let number = id.checked_sub(sazanami_dem::WALL).map(|number| number as usize);
    if let Some((number, wall)) = number.and_then(|number| Some((number, walls.get(number)?))) {
        if wall.edges.is_some() {
            let plates = walls[..number].iter().filter(|wall| wall.edges.is_some()).count();
            return case
                .gates
                .get(plates)
                .map_or_else(|| "a gate".to_owned(), |gate| format!("the gate `{}`", gate.name));
        }
        let direction = (0..3).find(|&d| wall.normal[d] != 0.0).unwrap_or_default();
        return format!("the side {}", SIDE_NAMES[direction][usize::from(wall.normal[direction] < 0.0)]);
    }
    let (population, index) = population_of(id);
    match case.grains.get(population) {
        Some(kind) => format!("grain {index} of `{}`", kind.name),
        None => format!("grain {id}"),
    }
}

fn place(position: Vector) -> String {
    format!("({:.4e}, {:.4e}, {:.4e}) m", position.x, position.y, position.z)
}

/// The failure of grains in one word.
pub(crate) fn grain_kind(error: &DemError) -> &'static str {
    match error {
        DemError::NotFinite { .. } => "not_finite",
        DemError::GrainEscaped { .. } => "grain_escaped",
        DemError::OverlapTooLarge { .. } => "overlap",
        DemError::EnergyGained { .. } => "energy_gained",
        DemError::BoxTooShort { .. }
        | DemError::BadGrain { .. }
        | DemError::BadFilm { .. }
        | DemError::NoPlate { .. }
        | DemError::FilmDoesNotFit { .. }
        | DemError::Snapshot(_) => "input",
        DemError::Elsewhere(_) => "elsewhere",
    }
}
