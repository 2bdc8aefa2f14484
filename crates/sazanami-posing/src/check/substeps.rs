//! The length of the contact sub-steps: what asks for the shortest, and the errors of impacts that it brings.

use sazanami_dem::Interactions;
use sazanami_dem::impact::ImpactErrors;
use sazanami_dem::stability::{EffectiveMasses, LongestSubstep};
use sazanami_numerics::Real;
use serde::Serialize;

use super::PopulationReport;
use crate::assembly::grains;
use crate::case::meaning::{Case, PairContact, Population, Substeps};

/// Contacts of a population.
fn contacts_of<'c>(case: &'c Case, population: &Population) -> impl Iterator<Item = &'c PairContact> {
    let material = population.material.clone();
    case.contacts.iter().filter(move |pair| pair.a == material || pair.b == material)
}

/// The larger stiffness of a contact [N/m].
pub(crate) fn stiffness(pair: &PairContact) -> Real {
    let [normal, tangential] = pair.law.stiffness();
    normal.max(tangential)
}

/// The stiffest contact that grains of the case have.
pub(crate) fn stiffest_contact(case: &Case) -> Option<&PairContact> {
    let all = case.grains.iter().flat_map(|population| contacts_of(case, population));
    all.max_by(|a, b| stiffness(a).total_cmp(&stiffness(b)))
}

/// Longest sub-step the contacts allow \[s], by the engine's own limit for the smallest and the largest grains of each
/// population; `None` where no grain moves. The film of [`grains::wet_interactions`] may ask for shorter ones than the springs of
/// [`grains::interactions`]; a bed is packed without it.
pub(super) fn contact_step(case: &Case, populations: &[PopulationReport], interactions: &Interactions) -> Option<Real> {
    Some(longest_substep(case, populations, interactions)?.shortest()).filter(|step| step.is_finite())
}

/// The same by cause.
pub(crate) fn longest_substep(
    case: &Case,
    populations: &[PopulationReport],
    interactions: &Interactions,
) -> Option<LongestSubstep> {
    Some(masses(case, populations, interactions)?.longest_substep())
}

/// Errors of impacts with sub-steps of `substep` \[s]; `None` where no grain moves.
pub(crate) fn impact_errors(
    case: &Case,
    populations: &[PopulationReport],
    interactions: &Interactions,
    substep: Real,
) -> Option<ImpactErrors> {
    masses(case, populations, interactions)?.impact_errors(substep)
}

/// The smallest and the largest grains of each population that forces move.
fn masses<'i>(
    case: &Case,
    populations: &[PopulationReport],
    interactions: &'i Interactions,
) -> Option<EffectiveMasses<'i>> {
    let mut masses = EffectiveMasses::new(interactions);
    for (population, report) in case.grains.iter().zip(populations) {
        let Some(body) = report.body.as_ref().filter(|_| population.has_free_grains()) else { continue };
        let density = case.material(&population.material)?.density;
        let mass = population.mass_override.unwrap_or(density * body.volume);
        for factor in [population.sizes().smallest(), population.sizes().largest()] {
            masses.add(body, factor, mass * factor.powi(3), grains::material_number(case, &population.material));
        }
    }
    Some(masses)
}

/// What asks for the shortest sub-steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SubstepCause {
    /// The stiffest contact.
    Contact,
    /// A face that comes to rest on a plane with all its contact spheres.
    Face,
    /// The film between grains.
    Film,
}

/// What asks for the shortest sub-steps.
pub(crate) fn substep_cause(case: &Case, populations: &[PopulationReport]) -> SubstepCause {
    let Some(longest) = longest_substep(case, populations, &grains::wet_interactions(case)) else {
        return SubstepCause::Contact;
    };
    if longest.film < longest.contact.min(longest.face) {
        SubstepCause::Film
    } else if longest.face < longest.contact {
        SubstepCause::Face
    } else {
        SubstepCause::Contact
    }
}

/// Sub-steps of the grains in a step of `dt` \[s].
pub(super) fn of_step(case: &Case, populations: &[PopulationReport], dt: Real) -> usize {
    of_step_with(case, populations, dt, &grains::wet_interactions(case))
}

/// The same with these contacts.
fn of_step_with(case: &Case, populations: &[PopulationReport], dt: Real, interactions: &Interactions) -> usize {
    if case.grains.is_empty() {
        return 0;
    }
    match case.dem.substeps {
        Substeps::Fixed(n) => n,
        Substeps::Auto => {
            contact_step(case, populations, interactions).map_or(1, |step| (dt / step).ceil() as usize).max(1)
        }
    }
}

/// The same in a step of the `mean` length in a run to `end` \[s], in which springs may become softer.
pub(super) fn mean_of_step(case: &Case, populations: &[PopulationReport], mean: Real, end: Real) -> usize {
    let own = of_step(case, populations, mean);
    let Some(softening) = case.dem.soften.filter(|softening| softening.from < end) else { return own };
    let mut soft = grains::wet_interactions(case);
    soft.scale_stiffness(softening.stiffness);
    let soft = of_step_with(case, populations, mean, &soft);
    let part = 1.0 - softening.from / end;
    (own as Real * (1.0 - part) + soft as Real * part).round() as usize
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use sazanami_dem::{Engine, Grain, LinearSpringDashpot};
    use sazanami_numerics::domain::Domain;
    use sazanami_numerics::grid::Grid;

    use sazanami_numerics::Vector;

    use super::super::population_reports;
    use super::*;
    use crate::assembly::shapes::shape_of;
    use sazanami_numerics::Random;

    /// The contact sub-step that the engine finds for the smallest and the largest grain of each population \[s].
    fn of_engine(case: &Case) -> Real {
        let shapes: Vec<_> = case.grains.iter().map(|population| shape_of(population).unwrap()).collect();
        let mut setup = grains::setup(case, &shapes);
        // A box with room for all of them, side by side.
        let widest = shapes.iter().map(sazanami_numerics::geometry::Shape::bounding_radius).fold(0.0, Real::max)
            * case.grains.iter().map(|p| p.sizes().largest()).fold(0.0, Real::max);
        let room = 4.0 * widest * (2 * shapes.len()) as Real;
        (setup.walls, setup.region) = (Vec::new(), [Vector::ZERO, Vector::splat(room)]);
        let mut all = Vec::new();
        for (n, population) in case.grains.iter().enumerate() {
            for factor in [population.sizes().smallest(), population.sizes().largest()] {
                let at = 4.0 * widest * (all.len() as Real + 0.5);
                let grain = grains::member(case, n, all.len(), factor);
                let motion = if population.has_free_grains() { sazanami_dem::Motion::Free } else { grain.motion };
                all.push(Grain { position: Vector::new(at, 0.5 * room, 0.5 * room), motion, ..grain });
            }
        }
        let domain = Domain::solo(Grid::new([4; 3], Vector::ZERO, Vector::splat(room / 4.0)), [false; 3]);
        Engine::new(&domain, setup, &all).unwrap().contact_time_step()
    }

    fn predicted(case: &Case) -> Real {
        contact_step(case, &population_reports(case, &[]), &grains::wet_interactions(case)).unwrap_or(Real::INFINITY)
    }

    fn shipped() -> Vec<PathBuf> {
        let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases")];
        let mut files = Vec::new();
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|ext| ext == "toml") {
                    files.push(path);
                }
            }
        }
        files
    }

    #[test]
    fn check_predicts_the_contact_step_of_the_engine_for_every_shipped_case() {
        let mut compared = 0;
        for path in shipped() {
            let Ok(loaded) = crate::case::load(&path, &[]) else { continue };
            if loaded.case.grains.is_empty() {
                continue;
            }
            let (expected, found) = (predicted(&loaded.case), of_engine(&loaded.case));
            assert!(
                expected == found || (expected / found - 1.0).abs() < 1e-12,
                "{}: {expected} s, not {found} s",
                path.display()
            );
            compared += 1;
        }
        assert!(compared >= 10, "{compared}");
    }

    #[test]
    fn check_predicts_the_contact_step_of_random_grains() {
        let mut numbers = Random::new(2015);
        let mut random = move || numbers.unit();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/both/settling-sphere.toml");
        for _ in 0..12 {
            let mut case = crate::case::load(&path, &[]).unwrap().case;
            case.contacts.iter_mut().for_each(|pair| {
                let normal_stiffness = 10.0_f64.powf(2.0 + 4.0 * random());
                let tangential_stiffness = normal_stiffness * (0.1 + random());
                let law = LinearSpringDashpot::SAND;
                pair.law = LinearSpringDashpot { normal_stiffness, tangential_stiffness, ..law };
            });
            case.materials.iter_mut().for_each(|material| material.density = 1100.0 + 6000.0 * random());
            let (expected, found) = (predicted(&case), of_engine(&case));
            assert!((expected / found - 1.0).abs() < 1e-12, "{expected} s, not {found} s");
            // Negative control: half the mass has another sub-step.
            case.materials.iter_mut().for_each(|material| material.density *= 0.5);
            assert!((predicted(&case) / found - 1.0).abs() > 0.2);
        }
    }
}
