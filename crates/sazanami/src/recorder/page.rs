//! Reference page of the records of a run.

use super::columns::series_page;
use super::mics::GridObserver;
use super::mps::ParticleObserver;
use super::{bed, mics, mps, summary};
use crate::columns::page as table;
use crate::job::{CORRECTIONS, PARTICLES, WORST};

/// A section for each table and for each part of the summary.
pub(crate) fn page() -> String {
    let sections = [
        ("`series.csv` of `solver = \"mics\"`", series_page::<GridObserver>()),
        ("`series.csv` of `solver = \"mps\"`", series_page::<ParticleObserver>()),
        ("`profiles.csv`", mics::profile_page()),
        ("`water.csv`", table("A row per place and observation.", mps::WATER)),
        ("`bed.csv`", table("A row per place and observation.", mps::BED)),
        ("`layers.csv`", table("A row per layer and observation.", mps::LAYERS)),
        ("`probes/NAME.csv` of `solver = \"mics\"`", mics::probe_page()),
        ("`probes/NAME.csv` of `solver = \"mps\"`", mps::probe_page()),
        ("`counts` of `summary.json`", table("Sizes of the run.", summary::COUNTS)),
        ("`conservation` with `solver = \"mics\"`", table("Errors of conserved quantities.", mics::CONSERVATION)),
        ("`conservation` with `solver = \"mps\"`", table("Errors of conserved quantities.", mps::CONSERVATION)),
        ("`worst` of `summary.json`", table("Largest values met since the start.", WORST)),
        ("`corrections` of `summary.json`", table("Corrections since the start.", CORRECTIONS)),
        ("`particles` with `solver = \"mps\"`", table("Events of moving particles since the start.", PARTICLES)),
        ("`observables.bed` of `summary.json`", table("The bed before the impact.", bed::BED)),
        ("`observables.heap` of `summary.json`", table("The slope of a heap (with `[heap]`).", bed::HEAP)),
        ("`observables.erosion` of `summary.json`", table("The crater at the end.", mics::EROSION)),
        (
            "`observables.crater_rest` of `summary.json`",
            table("Whether the crater has come to rest, by the course of the volume below its rim.", mics::REST),
        ),
        (
            "`observables.soaked` of `summary.json`",
            table("Liquid below the bed's surface before the impact.", mics::SOAKED),
        ),
        ("`observables.splash` of `summary.json`", table("Grains that have left the bed.", mics::SPLASH)),
    ];
    sections.iter().map(|(title, table)| format!("## {title}\n\n{table}\n")).collect()
}
