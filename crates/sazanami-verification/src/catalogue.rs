//! The verification cases: a name, the program that measures, and what is expected of it.
//!
//! The name is that of the folder in `verification/` with `expected.toml`, reference data and page.

use std::borrow::Cow;

use crate::cases::moving_particles;
pub use crate::cases::whole_run::Manner;
use crate::expected::Expected;
use crate::measured::{Measured, Outcome};
use crate::posed::Posed;

/// A verification case.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name on the command line and of the folder.
    pub name: &'static str,
    /// Text of its `expected.toml` when the program was built.
    pub expected: &'static str,
    /// Its case file, if it is posed by one.
    pub posed: Option<Posed>,
    /// Measures what no case file can pose.
    pub program: Option<Program>,
}

/// A program that measures; an error is a failed case.
pub type Program = fn() -> Result<Vec<Measured>, String>;

impl Case {
    /// Runs and measures it.
    ///
    /// # Errors
    /// Why it cannot be measured.
    pub fn measure(&self, expected: &Expected, manner: Manner<'_>) -> Result<Outcome, String> {
        match (&self.posed, self.program) {
            (Some(posed), _) => posed.measure(self.name, expected, manner),
            (None, Some(program)) => Outcome::of(program()?),
            (None, None) => Ok(Outcome::default()),
        }
    }
}

macro_rules! case {
    ($name:literal, $program:path) => {
        Case {
            name: $name,
            expected: include_str!(concat!("../verification/", $name, "/expected.toml")),
            posed: None,
            program: Some($program),
        }
    };
    // Posed by its `case.toml`.
    ($name:literal) => {
        case!($name, case concat!("../verification/", $name, "/case.toml"), "")
    };
    // The same beside the `reference.csv` of a case.
    ($name:literal, with $table:literal) => {
        case!(
            $name,
            case concat!("../verification/", $name, "/case.toml"),
            include_str!(concat!("../verification/", $table, "/reference.csv"))
        )
    };
    // By a case that is shipped.
    ($name:literal, file $path:literal) => {
        case!($name, case $path, "")
    };
    // The same beside the `reference.csv` of a case.
    ($name:literal, file $path:literal, with $table:literal) => {
        case!($name, case $path, include_str!(concat!("../verification/", $table, "/reference.csv")))
    };
    // By several of `cases/examples`, which its runs name.
    ($name:literal, files [$($file:literal),*]) => {
        Case {
            name: $name,
            expected: include_str!(concat!("../verification/", $name, "/expected.toml")),
            posed: Some(Posed {
                case: Cow::Borrowed(""),
                others: &[$(($file, include_str!(concat!("../cases/examples/", $file, ".toml")))),*],
                reference: Cow::Borrowed(""),
            }),
            program: None,
        }
    };
    ($name:literal, case $path:expr, $reference:expr) => {
        Case {
            name: $name,
            expected: include_str!(concat!("../verification/", $name, "/expected.toml")),
            posed: Some(Posed {
                case: Cow::Borrowed(include_str!($path)),
                others: &[], reference: Cow::Borrowed($reference) }),
            program: None,
        }
    };
}

/// All cases, in the order of what builds on what.
pub const CASES: &[Case] = &[
    case!("layers-at-rest"),
    case!("block-on-floor"),
    case!("taylor-green", with "taylor-green"),
    case!("channels", with "channels"),
    case!("film-on-slope", with "film-on-slope"),
    case!("lid-driven-cavity", with "lid-driven-cavity"),
    case!("slip-box-vortex", with "slip-box-vortex"),
    case!("carried-sphere"),
    case!("reversed-vortex"),
    case!("deformation"),
    case!("falling-drop"),
    case!("dam-break", with "dam-break"),
    case!("static-drop"),
    case!("drop-pressure"),
    case!("carried-drop"),
    case!("sessile-drop"),
    case!("drop-on-slope"),
    case!("drop-at-terminal-speed"),
    case!("drop-on-plate"),
    case!("drop-on-sphere"),
    case!("sphere-at-surface"),
    case!("capillary-rise", with "capillary-rise"),
    case!("capillary-wave", with "capillary-wave"),
    case!("oscillating-drop", file "../cases/examples/oscillating-drop.toml"),
    case!("rising-bubble"),
    case!("breaking-jet"),
    case!("restitution"),
    case!("bouncing"),
    case!("oblique-impact"),
    case!("slip-to-roll"),
    case!("incline"),
    case!("damp-slope"),
    case!("drop-on-bed"),
    case!("drop-on-bed-inviscid"),
    case!("literal-mics"),
    case!("added-mass"),
    case!("drag"),
    case!("spinning-sphere"),
    case!("jeffery"),
    case!("grain-arrays"),
    case!("random-bed"),
    case!("moving-sphere"),
    case!("squeezed-plates"),
    case!("two-spheres"),
    case!("light-sphere"),
    case!("settling", with "settling"),
    case!("settling-narrow"),
    case!("mps-operators", moving_particles::operators),
    case!("mps-hydrostatics", with "mps-hydrostatics"),
    case!("mps-void-fraction", moving_particles::void_fraction),
    case!("mps-settling-grain"),
    case!("mps-packed-bed"),
    case!("mps-resting-bed", with "mps-resting-bed"),
    case!("mps-repose"),
    case!("mps-bed-load"),
    case!("mps-bed-stress"),
    case!("mps-bed-threshold"),
    case!("mps-turbulent-film", with "mps-turbulent-film"),
    case!("mps-fluidised-bed"),
    case!("mps-hindered-settling"),
    case!("mps-shaken-tank", with "mps-shaken-tank"),
    case!("mps-standing-wave"),
    case!("mps-sloshing-grain"),
    case!("mps-still-grain"),
    case!("mps-sloshing-bed"),
    case!("mps-viscous-walls", with "mps-viscous-walls"),
    case!("mps-dam-break-lobovsky", with "mps-dam-break-lobovsky"),
    case!("mps-stretching-drop", with "mps-stretching-drop"),
    case!("mps-conservation"),
    case!("mps-jets", moving_particles::jets),
    case!("both-dam-break", file "../cases/both/dam-break.toml", with "dam-break"),
    case!("both-settling-sphere", file "../cases/both/settling-sphere.toml"),
    case!("examples", files ["channel", "standing-wave", "raft", "ball-on-slope"]),
    case!("ripples", file "../cases/ripples/paper.toml"),
    case!("drop-on-bed-fine"),
    case!("drag-fine"),
    case!("settling-rest", with "settling"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_are_posed_and_every_value_has_a_source() {
        for case in CASES {
            let expected = Expected::parse(case.expected).unwrap_or_else(|problem| panic!("{}: {problem}", case.name));
            let declared = expected.quantities.iter().filter(|quantity| quantity.value.is_some()).count();
            let Some(posed) = &case.posed else {
                assert_eq!((declared, expected.runs.len()), (0, 0), "{} has no case file", case.name);
                continue;
            };
            assert_eq!(declared, expected.quantities.len(), "{}", case.name);
            posed.loaded(&expected).unwrap_or_else(|problem| panic!("{}: {problem}", case.name));
            let quantities = expected.quantities.iter().filter_map(|quantity| quantity.beside.as_ref());
            for beside in quantities.chain(expected.charts.iter().filter_map(|chart| chart.beside.as_ref())) {
                beside.table(&posed.reference).unwrap_or_else(|problem| panic!("{}: {problem}", case.name));
            }
        }
    }
}
