//! `[preparation]`: how a bed in water is prepared before the run, for `solver = "mps"`.

use std::path::PathBuf;

use sazanami_case_derive::Keys;
use sazanami_numerics::Real;

use crate::read::{Context, Table};

/// Steps in which water over a bed comes to rest.
pub const RELAX_STEPS: usize = 1000;
/// Time for which the grains of a bed settle in water at rest \[s].
const SETTLE: Real = 0.2;

/// Part of the velocity that a step to rest leaves.
pub(crate) const DAMPING: Real = 0.9;
/// Volume strain of water at rest.
pub(crate) const STRAIN_AT_REST: Real = 0.01;
/// Speed of water at rest [m/s].
pub(crate) const SPEED_AT_REST: Real = 1e-3;

/// Preparation before the run, for `solver = "mps"`.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Preparation {
    /// Most steps in which the water comes to rest with the grains held.
    #[key(default = if cx.known.has_bed() { RELAX_STEPS } else { 0 },
          says = format!("{RELAX_STEPS} with a bed, otherwise 0"))]
    pub relax_steps: usize,
    /// Part of the water's velocity that a step leaves meanwhile.
    #[key(range = Between(0.0, 1.0), default = DAMPING)]
    pub damping: Real,
    /// Root mean square of the volume strain of water at rest.
    #[key(range = Positive, default = STRAIN_AT_REST)]
    pub strain: Real,
    /// Largest speed of water at rest.
    #[key(unit = "m/s", range = Positive, default = SPEED_AT_REST)]
    pub speed: Real,
    /// Whether the run ends where the water, with the grains held, is still far from rest after `relax_steps`: beyond five times
    /// `strain` or `speed`.
    #[key(default = true)]
    pub must_rest: bool,
    /// Time for which the grains are then free in water at rest.
    #[key(unit = "s", range = NonNegative, default = if cx.known.has_bed() { SETTLE } else { 0.0 },
          says = format!("{SETTLE} s with a bed, otherwise 0"))]
    pub settle: Real,
    /// A tank prepared by an earlier run, instead.
    pub state: Option<PathBuf>,
    /// Whether the tank prepared is kept for later runs of the same tank.
    #[key(default = true)]
    pub cache: bool,
}

impl Preparation {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if let Some(state) = self.state.as_ref().filter(|state| !state.is_file()) {
            cx.report
                .error(table.place("state"), format!("there is no file `{}`", state.display()))
                .label("file not found")
                .help("leave out `state`: the bed is prepared before the run, and the state is kept");
        }
    }

    /// Whether anything is done before the run.
    #[must_use]
    pub fn is_needed(&self) -> bool {
        self.relax_steps > 0 || self.settle > 0.0
    }
}
