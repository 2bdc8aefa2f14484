//! `[coupling]`: how fluid and resolved grains act on each other.

use sazanami_case_derive::keys_of;
pub use sazanami_mics::grains::Coupling;
use sazanami_mics::grains::Exchange;

/// Fluid and resolved grains.
#[keys_of(Coupling)]
struct Coupling {
    /// Exchange of momentum between fluid and grains; see docs/guide/exchange.md.
    #[key(word, default, paper_literal = (Yagyu, Exchange::Stress,
          "forces on grains are the stress integral; what back-projection takes is lost"))]
    exchange: Exchange,
    /// Columns along x3 to the edge of a cell in which the volume that grains cover is evaluated: n x n in a cell, each exact.
    #[key(least = 1, most = 64, default = Coupling::default().columns)]
    columns: usize,
    #[key(skip = cx.known.dem.substeps)]
    substeps: sazanami_dem::Substeps,
}
