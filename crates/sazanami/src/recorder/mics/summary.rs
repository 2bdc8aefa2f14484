//! Crater, splash and the momentum budget in the form of the summary.

use std::collections::BTreeMap;

use sazanami_numerics::{Real, Vector};
use sazanami_observe::budget::MomentumBudget;
use sazanami_observe::erosion::{CraterCourse, Erosion, ErosionError, Known, Rest, RestError};
use sazanami_observe::splash::Splash;
use serde_json::{Map, Value, json};

use super::{GridObserver, Soaked};
use crate::columns::{Field, object, quantities};
use crate::recorder::observer::SummaryParts;

/// The observables that a case asks for, as measured last.
#[derive(Clone, Debug, Default)]
pub(crate) struct Findings {
    pub erosion: Option<Erosion>,
    /// Why there is none at present.
    pub no_erosion: Option<String>,
    /// When the crater came to rest, or why that is not known; `None` without a crater that could be evaluated.
    pub rest: Option<Result<Rest, RestError>>,
    /// Whether it rests by the evaluation of the run, where this one has other keys.
    pub rests_in_the_run: Option<bool>,
    /// Number of drops that fall.
    pub drops: usize,
    /// Height of the floor of the box \[m].
    pub floor: Real,
    pub splash: Option<Splash>,
    pub soaked: Option<Soaked>,
    pub liquid_relative_change: Option<Real>,
    pub wet_relative_change: Option<Real>,
}

impl Findings {
    /// Takes up what came of an evaluation of the crater.
    pub fn set_erosion(&mut self, evaluated: Result<Erosion, ErosionError>) {
        (self.erosion, self.no_erosion) = match evaluated {
            Ok(erosion) => (Some(erosion), None),
            Err(problem) => (None, Some(problem.to_string())),
        };
    }

    /// Judges by the `course` before whether the crater, as it was evaluated at `time` \[s], has come to rest.
    pub fn set_rest(&mut self, course: &CraterCourse, time: Real) {
        self.rest = self.erosion.as_ref().map(|erosion| {
            let mut course = course.clone();
            course.add(time, [erosion.crater.volume, erosion.crater.volume_direct]);
            course.rest(erosion)
        });
    }

    /// What is known of the crater beside its surface.
    pub fn known(&self) -> Known {
        Known {
            at_rest: self.rest.and_then(Result::ok).map(|rest| rest.at_rest).or(self.rests_in_the_run),
            drops: self.drops,
        }
    }

    /// Crater and splash as the summary has them.
    pub fn observables(&self) -> Map<String, Value> {
        let mut observables = Map::new();
        if let Some(erosion) = &self.erosion {
            let evaluated = Evaluated { erosion: erosion.clone(), known: self.known(), floor: self.floor };
            observables.insert("erosion".into(), Value::Object(object(EROSION, &evaluated)));
        } else if let Some(problem) = &self.no_erosion {
            observables.insert("erosion".into(), json!({ "not_evaluated": problem }));
        }
        if let Some(rest) = &self.rest {
            let found = match rest {
                Ok(rest) => Value::Object(object(REST, rest)),
                Err(problem) => json!({ "not_evaluated": problem.to_string() }),
            };
            observables.insert("crater_rest".into(), found);
        }
        if let Some(splash) = &self.splash {
            observables.insert("splash".into(), Value::Object(object(SPLASH, splash)));
        }
        if let Some(soaked) = &self.soaked {
            observables.insert("soaked".into(), Value::Object(object(SOAKED, soaked)));
        }
        observables
    }
}

/// An evaluation of a crater, and what is known of it beside.
pub(crate) struct Evaluated {
    erosion: Erosion,
    known: Known,
    /// Height of the floor of the box \[m].
    floor: Real,
}

impl std::ops::Deref for Evaluated {
    type Target = Erosion;

    fn deref(&self) -> &Erosion {
        &self.erosion
    }
}

/// Doubts as a text; absent where there are none.
fn doubts(found: &[String]) -> Value {
    if found.is_empty() { Value::Null } else { json!(found.join("; ")) }
}

/// Fields of `observables.erosion`, in the units in which craters are compared.
pub(crate) const EROSION: &[Field<Evaluated>] = quantities! {
    "volume_below_rim_mm3", "mm^3", "volume of the crater below the plane of its rim"
        => |erosion| json!(1e9 * erosion.crater.volume_direct);
    "volume_below_rim_uncertainty_mm3", "mm^3", "half the width of `volume_below_rim_range_mm3`"
        => |erosion| json!(1e9 * erosion.below_rim_uncertainty());
    "volume_below_rim_range_mm3", "mm^3", "smallest and largest of it over three bandwidths and with the rim half a bandwidth nearer and farther"
        => |erosion| json!(erosion.below_rim_range.map(|volume| 1e9 * volume));
    "volume_below_rim_noise_mm3", "mm^3", "the same of the bed before the impact"
        => |erosion| json!(erosion.noise_below_rim.map(|volume| 1e9 * volume));
    "volume_below_rim_doubts", "", "what speaks against it: more than one drop, a rim at the edge, or one that sides of the box cut, a hollow that is not round about the axis, a crater that has not come to rest, an uncertainty above 20 %, a third or more of it in the bed before the impact; null where nothing does"
        => |erosion| doubts(&erosion.doubts_below_rim(erosion.known));
    "volume_mm3", "mm^3", "erosion volume V, eq. (14) of Yagyu et al. (2015): that of the spherical cap with the depth and the rim radius of the crater"
        => |erosion| json!(1e9 * erosion.crater.volume);
    "volume_uncertainty_mm3", "mm^3", "half the width of `volume_range_mm3`"
        => |erosion| json!(1e9 * erosion.volume_uncertainty());
    "volume_range_mm3", "mm^3", "smallest and largest V over three bandwidths and with the rim half a bandwidth nearer and farther"
        => |erosion| json!(erosion.volume_range.map(|volume| 1e9 * volume));
    "volume_noise_mm3", "mm^3", "V of the same bed before the impact: a V that is not several times larger means nothing"
        => |erosion| json!(erosion.noise.map(|volume| 1e9 * volume));
    "volume_doubts", "", "what speaks against V, as `volume_below_rim_doubts`" => |erosion| doubts(&erosion.doubts_of_cap(erosion.known));
    "volume_by_layers_mm3", "mm^3", "V with the surface in the layers of the paper, one of which is the rim"
        => |erosion| json!(erosion.by_layers.map(|crater| 1e9 * crater.volume));
    "volume_excavated_mm3", "mm^3", "volume below the bed's surface before the impact"
        => |erosion| json!(erosion.volume_excavated.map(|volume| 1e9 * volume));
    "volume_rim_mm3", "mm^3", "volume heaped up above that surface"
        => |erosion| json!(erosion.volume_rim.map(|volume| 1e9 * volume));
    "rim_radius_mm", "mm", "distance of the rim from the axis, L" => |erosion| json!(1e3 * erosion.crater.rim_radius);
    "rim_height_mm", "mm", "height of the rim above the floor of the box"
        => |erosion| json!(1e3 * (erosion.crater.rim_height - erosion.floor));
    "depth_mm", "mm", "depth of the crater below its rim, H" => |erosion| json!(1e3 * erosion.crater.depth);
    "depth_below_initial_mm", "mm", "depth of the crater below the bed's surface before the impact"
        => |erosion| json!(erosion.depth_below_initial.map(|depth| 1e3 * depth));
    "rim_at_edge", "", "whether the rim lies at the end of the surface that is looked at: the box, or `erosion.r_max`, is too small for this crater, and V cannot be trusted"
        => |erosion| json!(erosion.crater.rim_at_edge);
    "surface_grains", "", "grains that form the surface" => |erosion| json!(erosion.surface_grains);
    "airborne_grains", "", "grains in flight, which are left out" => |erosion| json!(erosion.airborne_grains);
};

/// Fields of `observables.crater_rest`: by the course of the volume below the rim, as `series.csv` has it.
pub(crate) const REST: &[Field<Rest>] = quantities! {
    "at_rest", "", "whether the crater has come to rest: the volume below its rim has kept within its uncertainty, 3 % at least, for a tenth of the run or longer, and `late_drift_mm3` is a quarter of the uncertainty at most; where that holds in fewer than eight rows of the series, it is not known, and `not_evaluated` stands in place of all of these"
        => |rest| json!(rest.at_rest);
    "within_uncertainty_since_s", "s", "time from which the volume below the rim stays within its uncertainty, 3 % at least, of the last one"
        => |rest| json!(rest.since);
    "late_drift_mm3", "mm^3", "mean of that volume over the second half of the time since then, less that over the first; where that time is half of the run or more, twice the difference of its last two quarters"
        => |rest| json!(1e9 * rest.drift);
};

/// Fields of `observables.splash`: grains that have left the bed.
pub(crate) const SPLASH: &[Field<Splash>] = quantities! {
    "grains", "", "their number" => |splash| json!(splash.grains);
    "mass_mg", "mg", "their mass" => |splash| json!(1e6 * splash.mass);
    "farthest_distance_mm", "mm", "distance of the farthest of them from the axis"
        => |splash| json!(1e3 * splash.farthest_distance);
    "highest_rise_mm", "mm", "highest rise of one of them above the bed" => |splash| json!(1e3 * splash.highest_rise);
    "above_now", "", "grains that are above the bed at this time" => |splash| json!(splash.above_now);
};

/// Fields of `observables.soaked`: liquid below the bed's surface before the impact.
pub(crate) const SOAKED: &[Field<Soaked>] = quantities! {
    "level_mm", "mm", "mean height of that surface above the floor of the box" => |soaked| json!(1e3 * soaked.level);
    "depth_mm", "mm", "wetted depth: from the level to the lowest interface of a cell at least half full"
        => |soaked| json!(1e3 * soaked.depth);
    "volume_mm3", "mm^3", "soaked volume: of the liquid outside grains below the level"
        => |soaked| json!(1e9 * soaked.volume);
};

/// Fields of `conservation`.
pub(in crate::recorder) const CONSERVATION: &[Field<GridObserver>] = quantities! {
    "departed_grains", "", "grains that have left through open sides" => |observer| json!(observer.departures.grains);
    "departed_mass", "kg", "their mass" => |observer| json!(observer.departures.mass);
    "departed_momentum", "N s", "momentum that they left with"
        => |observer| json!(observer.departures.momentum.to_array());
    "fed_grains", "", "grains that were fed in" => |observer| json!(observer.arrivals.grains);
    "fed_mass", "kg", "their mass" => |observer| json!(observer.arrivals.mass);
    "fed_momentum", "N s", "momentum that they had when forces began to move them"
        => |observer| json!(observer.arrivals.momentum.to_array());
    "liquid_volume_relative_change", "", "what of the change of the liquid volume since the start did not come through sides of the box, over the volume at the start: an error"
        => |observer| json!(observer.findings.liquid_relative_change);
    "wet_liquid_volume_relative_change", "", "the same of the liquid outside grains: with `exchange = \"stress\"` liquid that grains cover counts as lost"
        => |observer| json!(observer.findings.wet_relative_change);
    "momentum_residual_relative", "", "momentum residual over the largest term of the budget, or over the momentum that all that moves would have along one direction (of the fluid the root of 2 mass energy) if that is more"
        => |observer| json!(observer.momentum.as_ref().map(MomentumBudget::relative_residual));
    "momentum_residual_of_exchange", "", "momentum residual over the largest momentum that the grains have had from the fluid so far, beyond the buoyancy of fluid at rest"
        => |observer| json!(observer.momentum.as_ref().and_then(MomentumBudget::residual_of_exchange));
    "momentum_residual_of_initial", "", "momentum residual over the momentum at the start"
        => |observer| json!(observer.momentum.as_ref().and_then(MomentumBudget::residual_of_initial));
};

fn momentum_json(budget: &MomentumBudget) -> Value {
    fn named(lines: impl Iterator<Item = (&'static str, Vector)>) -> BTreeMap<&'static str, [Real; 3]> {
        lines.map(|(name, term)| (name, term.to_array())).collect()
    }
    json!({
        "initial": named(budget.initial()),
        "now": named(budget.stored()),
        "impulses": named(budget.impulses()),
        "residual": budget.residual().to_array(),
    })
}

/// The parts of the summary of a run on a grid.
pub(super) fn parts(observer: &GridObserver) -> SummaryParts {
    SummaryParts {
        particles: 0,
        conservation: object(CONSERVATION, observer),
        momentum: observer.momentum.as_ref().map_or(Value::Null, momentum_json),
        observables: observer.findings.observables(),
    }
}
