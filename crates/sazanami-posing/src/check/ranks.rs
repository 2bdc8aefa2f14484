//! Division of a case among ranks: balance, memory and time of each of them.

use sazanami_io::bed::Bed;
use sazanami_numerics::Real;
use sazanami_numerics::domain::Decomposition;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::linear::{Levels, levels};
use serde::Serialize;

use super::memory::with_layers;
use super::{CheckReport, CostModel};
use crate::assembly::{grains, shared};
use crate::case::meaning::{Case, GrainPlacement, Solver};

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
    /// Grains of the fullest part over the mean; packed ones spread evenly. Absent without grains.
    pub grain_imbalance: Option<Real>,
    /// Most ranks that can share the box.
    pub most: usize,
    /// Whether processes of a launcher can run it: rank 0 gathers what is written.
    pub launchable: bool,
    /// Levels of the pressure solver that stay cut among the ranks; of moving particles none.
    pub levels: Vec<[usize; 3]>,
    /// Cells of the level that each rank solves as a whole.
    pub gathered: Option<[usize; 3]>,
    /// Memory of the rank with the largest part \[bytes].
    pub memory_bytes: Real,
    /// Memory that rank 0 takes besides while it writes a checkpoint \[bytes].
    pub gathered_bytes: Real,
    /// Threads of each rank that the time is for.
    pub threads: usize,
    /// Wall-clock time by part, where each rank has so many processors like those of this machine, without the time in
    /// which messages are on their way \[s].
    pub predicted_s: Vec<(&'static str, Real)>,
    /// The same in all \[s].
    pub predicted_total_s: Real,
}

/// Memory of a gathered level and of those below it [bytes per cell]: coefficients, solution and residual in single
/// precision, and the buffers they arrive in.
const GATHERED_CELL: Real = 60.0;

/// Memory of a checkpoint of the flow on rank 0 [bytes per cell]: eight fields, and three more of an earlier step.
const CHECKPOINT_CELL: Real = 11.0 * 8.0;

/// What the largest part has of the whole.
struct Shares {
    /// Cells, with the two layers of its neighbours around it.
    cells: Real,
    /// Grains.
    grains: Real,
}

/// Division of `case`, of which `report` tells the whole, among `ranks` with `threads` each; `None` if there is none. `beds` are
/// those of the populations.
#[must_use]
pub fn ranks(
    case: &Case,
    ranks: usize,
    threads: usize,
    report: &CheckReport,
    beds: &[Option<Bed>],
    model: &CostModel,
) -> Option<RanksReport> {
    let grid = shared::grid(case);
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
    let fullest = fullest(case, report, beds, &grid, &cut, ranks);
    let shares = Shares { cells: share, grains: fullest.unwrap_or(share) };
    let predicted_s = predicted(report, &shares, threads, model);
    Some(RanksReport {
        ranks,
        parts: cut.parts(),
        widths,
        imbalance,
        grain_imbalance: fullest.map(|share| share * ranks as Real),
        most: shared::most_ranks(&grid),
        launchable: case.solver == Solver::Mps || grid.len() <= shared::MOST_GATHERED,
        levels: levels.distributed,
        gathered: levels.gathered,
        gathered_bytes: match case.solver {
            Solver::Mics => CHECKPOINT_CELL * grid.len() as Real,
            Solver::Mps => 0.0,
        },
        memory_bytes: share * report.memory_bytes + GATHERED_CELL * 8.0 / 7.0 * gathered,
        threads,
        predicted_total_s: predicted_s.iter().map(|(_, seconds)| seconds).sum(),
        predicted_s,
    })
}

/// Wall-clock time by part: that of the whole on one thread, times what the largest part has of it, on `threads`.
fn predicted(report: &CheckReport, shares: &Shares, threads: usize, model: &CostModel) -> Vec<(&'static str, Real)> {
    let whole = model.speed(report.threads.min(report.machine.cores)) / model.speed(threads);
    let share = |name: &str| match name {
        // Rank 0 draws for all.
        "pictures" | "files" => 1.0,
        "fluid" => whole * shares.cells,
        _ => whole * shares.grains,
    };
    report.predicted_s.iter().map(|&(name, seconds)| (name, seconds * share(name))).collect()
}

/// Part of all grains that the fullest rank has, as they lie at the start; packed ones are spread over the floor. `None` without
/// grains.
fn fullest(
    case: &Case,
    report: &CheckReport,
    beds: &[Option<Bed>],
    grid: &Grid,
    cut: &Decomposition,
    ranks: usize,
) -> Option<Real> {
    let mut held = vec![0.0; ranks];
    let spacing = grid.spacing;
    for grain in grains::placed(case, &[], beds) {
        let cell = (grain.position - grid.lower) / spacing;
        let lies_in = |rank: &usize| {
            let (start, size) = cut.part(*rank);
            [cell.x, cell.y].into_iter().enumerate().all(|(d, at)| {
                let at = at.clamp(0.0, grid.cells[d] as Real - 0.5);
                (start[d] as Real..(start[d] + size[d]) as Real).contains(&at)
            })
        };
        if let Some(rank) = (0..ranks).find(lies_in) {
            held[rank] += 1.0;
        }
    }
    let packed = case.grains.iter().zip(&report.populations);
    let packed = packed.filter(|(population, _)| matches!(population.placement, GrainPlacement::Packed(_)));
    let packed: usize = packed.filter_map(|(_, known)| known.levelled.or(known.grains)).sum();
    let columns = (grid.cells[0] * grid.cells[1]) as Real;
    for (rank, held) in held.iter_mut().enumerate() {
        let [n1, n2, _] = cut.part(rank).1;
        *held += packed as Real * (n1 * n2) as Real / columns;
    }
    let all: Real = held.iter().sum();
    (all > 0.0).then(|| held.iter().copied().fold(0.0, Real::max) / all)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::{Known, check};
    use super::*;
    use crate::machine::Machine;

    fn divided(file: &str, changes: &[String], number: usize) -> Option<RanksReport> {
        let path = format!("{}/../../cases/{file}.toml", env!("CARGO_MANIFEST_DIR"));
        let case = crate::case::load(Path::new(&path), changes).unwrap().case;
        let model = CostModel::default();
        let machine = Machine { cores: 1, ..Machine::this() };
        let report = check(&case, Known::default(), &machine, 1, &model);
        ranks(&case, number, 1, &CheckReport { memory_bytes: 506e9, ..report }, &[None, None], &model)
    }

    #[test]
    fn the_papers_grid_on_its_ranks() {
        let found = divided("raindrop/paper", &[], 506).unwrap();
        assert_eq!((found.parts[0] * found.parts[1], found.widths), (506, [[8, 8]; 2]));
        assert!((found.imbalance - 1.0).abs() < 1e-12 && found.levels.len() == 3, "{found:?}");
        // Ghosts of parts that are eight cells wide are more than the part.
        assert!(found.memory_bytes > 2e9 && found.memory_bytes < 3e9, "{}", found.memory_bytes);
        assert_eq!((found.most, found.launchable), (88 * 92, true));
        // Cuts that no coarse cell falls on: each rank solves the finest level, and parts differ.
        let odd = divided("raindrop/paper", &[], 25).unwrap();
        assert!(odd.imbalance > 1.0 && odd.levels.len() < 3 || odd.gathered.is_some());
        assert!(divided("raindrop/paper", &[], 9_000).is_none());
        let large = ["domain.cells=[640, 640, 132]".to_owned()];
        assert!(!divided("raindrop/paper", &large, 16).unwrap().launchable);
    }

    #[test]
    fn grains_are_balanced_as_they_lie() {
        // Packed over the whole floor, and a column beside one wall: the rank there has all.
        let packed = divided("raindrop/quick", &[], 4).unwrap();
        assert!((packed.grain_imbalance.unwrap() - packed.imbalance).abs() < 1e-12, "{packed:?}");
        let column = divided("heap/column", &[], 2).unwrap();
        assert!(column.grain_imbalance.unwrap() > 1.9 && column.imbalance < 1.3, "{column:?}");
        assert_eq!(divided("examples/channel", &[], 2).unwrap().grain_imbalance, None);
    }

    #[test]
    fn time_falls_with_the_ranks_and_stays_above_an_even_share() {
        let total =
            |number| divided("raindrop/quick", &["output.figures.at=[]".to_owned()], number).unwrap().predicted_total_s;
        let [one, four] = [total(1), total(4)];
        assert!(four < 0.4 * one && four > 0.25 * one, "{one} and {four}");
        // Where one rank has all the grains their time does not fall.
        let grains = |number| {
            let found = divided("heap/column", &[], number).unwrap();
            found.predicted_s.iter().find(|(name, _)| *name == "grains").unwrap().1
        };
        assert!((grains(2) / grains(1) - 1.0).abs() < 0.05);
    }
}
