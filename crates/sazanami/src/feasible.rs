//! Whether a case can run here: it can be posed, and the bed that it names for output be written.

pub use sazanami_posing::feasible::{Feasible, check_without_grains, shapes_alone};

use sazanami_posing::feasible;

use crate::bed_file;
use crate::case::{CaseError, LoadedCase};
use crate::check::CostModel;
use crate::machine::Machine;

/// Asks whether the case can run on this machine.
///
/// # Errors
/// All findings together, if one of them is an error.
pub fn check(loaded: &LoadedCase, machine: &Machine, model: &CostModel) -> Result<Feasible, Box<CaseError>> {
    let mut warnings = loaded.warnings.clone();
    bed_file::can_be_written(loaded, &mut warnings);
    feasible::check(&LoadedCase { warnings, ..loaded.clone() }, machine, model)
}
