//! Crater, splash and the books of momentum in the form of the summary.

use std::collections::BTreeMap;

use sazanami_numerics::Real;
use sazanami_observe::budget::MomentumBudget;
use sazanami_observe::erosion::{Erosion, ErosionError};
use sazanami_observe::splash::Splash;
use serde_json::{Map, Value, json};

use super::GridBooks;
use crate::recorder::books::Account;

/// What a case was asked to find, as it stands.
#[derive(Clone, Debug, Default)]
pub(crate) struct Findings {
    pub erosion: Option<Erosion>,
    /// Why there is none at present.
    pub no_erosion: Option<String>,
    pub splash: Option<Splash>,
    pub liquid_relative_change: Real,
    pub wet_relative_change: Real,
}

impl Findings {
    /// Takes up what came of an evaluation of the crater.
    pub fn set_erosion(&mut self, evaluated: Result<Erosion, ErosionError>) {
        (self.erosion, self.no_erosion) = match evaluated {
            Ok(erosion) => (Some(erosion), None),
            Err(problem) => (None, Some(problem.to_string())),
        };
    }

    /// Crater and splash as the summary has them.
    pub fn observables(&self) -> Map<String, Value> {
        let mut observables = Map::new();
        if let Some(erosion) = &self.erosion {
            observables.insert("erosion".into(), erosion_json(erosion));
        } else if let Some(problem) = &self.no_erosion {
            observables.insert("erosion".into(), json!({ "not_evaluated": problem }));
        }
        if let Some(splash) = &self.splash {
            observables.insert("splash".into(), splash_json(splash));
        }
        observables
    }
}

/// The erosion in the units that people compare.
pub(crate) fn erosion_json(erosion: &Erosion) -> Value {
    let mm = |value: Real| 1e3 * value;
    let mm3 = |value: Real| 1e9 * value;
    let crater = &erosion.crater;
    json!({
        "volume_mm3": mm3(crater.volume),
        "volume_uncertainty_mm3": mm3(erosion.volume_uncertainty()),
        "volume_range_mm3": erosion.volume_range.map(mm3),
        "volume_refined_mm3": mm3(crater.refined_volume),
        "volume_noise_mm3": erosion.noise.map(mm3),
        "volume_direct_mm3": mm3(crater.volume_direct),
        "volume_excavated_mm3": erosion.volume_excavated.map(mm3),
        "volume_rim_mm3": erosion.volume_rim.map(mm3),
        "rim_radius_mm": mm(crater.rim_radius),
        "rim_height_mm": mm(crater.rim_height),
        "depth_mm": mm(crater.depth),
        "depth_below_initial_mm": erosion.depth_below_initial.map(mm),
        "rim_at_edge": crater.rim_at_edge,
        "surface_grains": erosion.surface_grains,
        "airborne_grains": erosion.airborne_grains,
    })
}

fn splash_json(splash: &Splash) -> Value {
    json!({
        "grains": splash.grains,
        "mass_mg": 1e6 * splash.mass,
        "farthest_distance_mm": 1e3 * splash.farthest_distance,
        "highest_rise_mm": 1e3 * splash.highest_rise,
        "above_now": splash.above_now,
    })
}

fn momentum_json(budget: &MomentumBudget) -> Value {
    let stored = |stored: &sazanami_observe::budget::StoredMomentum| {
        json!({
            "liquid": stored.liquid.to_array(),
            "gas": stored.gas.to_array(),
            "grains": stored.grains.to_array(),
            "displaced": stored.displaced.to_array(),
            "owed_to_grains": stored.deferred.to_array(),
        })
    };
    let impulses = budget.impulses();
    let named: BTreeMap<&str, [Real; 3]> = sazanami_observe::budget::Impulses::NAMES
        .into_iter()
        .zip(impulses.terms().map(|term| term.to_array()))
        .collect();
    json!({
        "initial": stored(budget.initial()),
        "now": stored(budget.stored()),
        "impulses": named,
        "residual": budget.residual().to_array(),
    })
}

/// What the books have to tell.
pub(super) fn account(books: &GridBooks) -> Account {
    let (findings, budget) = (&books.findings, books.momentum.as_ref());
    Account {
        particles: 0,
        conservation: json!({
            "liquid_volume_relative_change": findings.liquid_relative_change,
            "wet_liquid_volume_relative_change": findings.wet_relative_change,
            "momentum_residual_relative": budget.map_or(0.0, MomentumBudget::relative_residual),
            "momentum_residual_of_initial": budget.and_then(MomentumBudget::residual_of_initial),
        }),
        momentum: budget.map_or(Value::Null, momentum_json),
        observables: findings.observables(),
    }
}
