//! Division of a case among ranks, and the memory of each of them.

use sazanami_numerics::Real;
use sazanami_numerics::domain::Decomposition;
use sazanami_numerics::linear::{Levels, levels};
use serde::Serialize;

use crate::assembly::particles;
use crate::case::meaning::{Case, Solver};

/// Division of a case among ranks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RanksReport {
    /// Number of ranks.
    pub ranks: usize,
    /// Parts in x1 and x2.
    pub parts: [usize; 2],
    /// Cells of the narrowest and the widest part in x1 and in x2.
    pub widths: [[usize; 2]; 2],
    /// Cells of the largest part over the mean: how much longer the others wait for it, at least.
    pub imbalance: Real,
    /// Levels of the pressure solver that stay cut among the ranks; of moving particles none.
    pub levels: Vec<[usize; 3]>,
    /// Cells of the level that each rank solves as a whole.
    pub gathered: Option<[usize; 3]>,
    /// Memory of the rank with the largest part \[bytes].
    pub memory_bytes: Real,
    /// Memory that rank 0 takes besides while it writes a checkpoint \[bytes].
    pub gathered_bytes: Real,
}

/// Memory of a gathered level and of those below it [bytes per cell]: coefficients, solution and residual in single
/// precision, and the buffers they arrive in.
const GATHERED_CELL: Real = 60.0;

/// Memory of a checkpoint of the flow on rank 0 [bytes per cell]: eight fields, and three more of an earlier step.
const CHECKPOINT_CELL: Real = 11.0 * 8.0;

/// Division of `case`, of so much memory in all \[bytes], among `ranks`; `None` if there is none.
#[must_use]
pub fn ranks(case: &Case, ranks: usize, memory: Real) -> Option<RanksReport> {
    let grid = match case.solver {
        Solver::Mics => case.domain.grid(),
        Solver::Mps => particles::grid(case),
    };
    let cut = Decomposition::new(&grid, ranks).ok()?;
    let size = |rank| cut.part(rank).1;
    let cells = |rank| size(rank).into_iter().product::<usize>() as Real;
    let widths = [0, 1].map(|d| {
        let of = || (0..ranks).map(|rank| size(rank)[d]);
        [of().min().unwrap_or(0), of().max().unwrap_or(0)]
    });
    let largest = (0..ranks).map(cells).fold(0.0, Real::max);
    let imbalance = largest * ranks as Real / grid.len() as Real;
    let levels = match case.solver {
        Solver::Mics => levels(&grid, &cut),
        Solver::Mps => Levels { distributed: Vec::new(), gathered: None },
    };
    let gathered = levels.gathered.map_or(0.0, |cells| cells.into_iter().product::<usize>() as Real);
    // Each part has two layers of cells of its neighbours around it, and of the grains in them.
    let share = (0..ranks).map(|rank| with_layers(size(rank))).fold(0.0, Real::max) / with_layers(grid.cells);
    Some(RanksReport {
        ranks,
        parts: cut.parts(),
        widths,
        imbalance,
        levels: levels.distributed,
        gathered: levels.gathered,
        gathered_bytes: match case.solver {
            Solver::Mics => CHECKPOINT_CELL * grid.len() as Real,
            Solver::Mps => 0.0,
        },
        memory_bytes: share * memory + GATHERED_CELL * 8.0 / 7.0 * gathered,
    })
}

/// Cells of a part with the layers around it.
fn with_layers(cells: [usize; 3]) -> Real {
    cells.iter().map(|&n| n as Real + 4.0).product()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_papers_grid_on_its_ranks() {
        let text = include_str!("../../../../cases/raindrop/paper.toml");
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/raindrop/paper.toml"));
        let case = crate::case::parse(path, text, &[]).unwrap().case;
        let found = ranks(&case, 506, 506e9).unwrap();
        assert_eq!((found.parts[0] * found.parts[1], found.widths), (506, [[8, 8]; 2]));
        assert!((found.imbalance - 1.0).abs() < 1e-12 && found.levels.len() == 3, "{found:?}");
        // Ghosts of parts that are eight cells wide are more than the part.
        assert!(found.memory_bytes > 2e9 && found.memory_bytes < 3e9, "{}", found.memory_bytes);
        // Cuts that no coarse cell falls on: each rank solves the finest level, and parts differ.
        let odd = ranks(&case, 25, 1e9).unwrap();
        assert!(odd.imbalance > 1.0 && odd.levels.len() < 3 || odd.gathered.is_some());
        assert!(ranks(&case, 9_000, 1e9).is_none());
    }
}
