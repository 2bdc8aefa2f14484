//! The cut of a grid into one part per rank, in x1 and x2 only.

use crate::grid::Grid;

/// The grid cannot be cut for this number of ranks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{} x {} x {} cells cannot be shared among {ranks} ranks with at least 2 cells in x1 and x2 on each", cells[0], cells[1], cells[2])]
pub struct LayoutError {
    /// Number of cells in each direction.
    pub cells: [usize; 3],
    /// Number of ranks.
    pub ranks: usize,
}

/// Fewest cells of a part in a direction that is cut: the ghosts of its neighbour.
const FEWEST: usize = crate::grid::GHOSTS;
/// Largest power of two that cuts fall on, so that multigrid levels stay aligned with the parts.
const ALIGNMENT: usize = 32;

/// Cuts of a grid: rank `r` has part `(r % parts[0], r / parts[0])`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Decomposition {
    cells: [usize; 3],
    cuts: [Vec<usize>; 2],
}

impl Decomposition {
    /// Cuts `grid` into `ranks` parts with the shortest common borders.
    ///
    /// # Errors
    /// [`LayoutError`] if no arrangement leaves every part two cells wide.
    pub fn new(grid: &Grid, ranks: usize) -> Result<Self, LayoutError> {
        let [n1, n2, _] = grid.cells;
        let border = |parts: [usize; 2]| (parts[0] - 1) * n2 + (parts[1] - 1) * n1;
        (1..=ranks)
            .filter(|p| ranks.is_multiple_of(*p))
            .map(|p| [ranks / p, p])
            .filter_map(|parts| Some((border(parts), [cut(n1, parts[0])?, cut(n2, parts[1])?])))
            .min_by_key(|(border, _)| *border)
            .map(|(_, cuts)| Self { cells: grid.cells, cuts })
            .ok_or(LayoutError { cells: grid.cells, ranks })
    }

    /// A bound on the number of parts that `grid` can be cut into.
    #[must_use]
    pub fn most(grid: &Grid) -> usize {
        let [n1, n2, _] = grid.cells.map(|n| (n / FEWEST).max(1));
        n1 * n2
    }

    /// One part.
    #[must_use]
    pub fn whole(grid: &Grid) -> Self {
        let [n1, n2, _] = grid.cells;
        Self { cells: grid.cells, cuts: [vec![0, n1], vec![0, n2]] }
    }

    /// Parts that begin at the given cells.
    ///
    /// # Panics
    /// If the last cut is not the number of cells.
    #[must_use]
    pub fn from_cuts(grid: &Grid, cuts: [Vec<usize>; 2]) -> Self {
        for (d, cuts) in cuts.iter().enumerate() {
            assert_eq!(cuts.last(), Some(&grid.cells[d]), "the last cut is the end of the grid");
        }
        Self { cells: grid.cells, cuts }
    }

    /// Number of parts in x1 and x2.
    #[must_use]
    pub fn parts(&self) -> [usize; 2] {
        [self.cuts[0].len() - 1, self.cuts[1].len() - 1]
    }

    /// First cell of each part in x1 and x2, followed by the number of cells.
    #[must_use]
    pub fn cuts(&self) -> &[Vec<usize>; 2] {
        &self.cuts
    }

    /// First cell and number of cells of a rank's part.
    #[must_use]
    pub fn part(&self, rank: usize) -> ([usize; 3], [usize; 3]) {
        let c = self.coordinates(rank);
        let start = [self.cuts[0][c[0]], self.cuts[1][c[1]], 0];
        let end = [self.cuts[0][c[0] + 1], self.cuts[1][c[1] + 1], self.cells[2]];
        (start, std::array::from_fn(|d| end[d] - start[d]))
    }

    /// Position of a rank in the arrangement of parts.
    #[must_use]
    pub fn coordinates(&self, rank: usize) -> [usize; 2] {
        [rank % self.parts()[0], rank / self.parts()[0]]
    }

    /// Rank next to `rank` on `side` (0 lower, 1 upper) of `direction` (x1 or x2), if any.
    #[must_use]
    pub fn neighbour(&self, rank: usize, direction: usize, side: usize, periodic: bool) -> Option<usize> {
        let parts = self.parts();
        let mut c = self.coordinates(rank);
        c[direction] = match (side, c[direction]) {
            (0, 0) => periodic.then_some(parts[direction] - 1)?,
            (0, n) => n - 1,
            (_, n) if n + 1 == parts[direction] => periodic.then_some(0)?,
            (_, n) => n + 1,
        };
        Some(c[0] + parts[0] * c[1])
    }

    /// Rank that owns a cell given by global indices; cells outside belong to the nearest part.
    #[must_use]
    pub fn owner(&self, cell: [isize; 3]) -> usize {
        let place = |d: usize| {
            let at = cell[d].clamp(0, self.cells[d] as isize - 1) as usize;
            self.cuts[d].partition_point(|&cut| cut <= at) - 1
        };
        place(0) + self.parts()[0] * place(1)
    }
}

/// Cuts `cells` into `parts` as even as a common power of two allows.
fn cut(cells: usize, parts: usize) -> Option<Vec<usize>> {
    if parts == 1 {
        return Some(vec![0, cells]);
    }
    let ideal = cells as f64 / parts as f64;
    let mut alignment = ALIGNMENT;
    loop {
        let cuts: Vec<usize> = (0..parts)
            .map(|p| ((p as f64 * ideal / alignment as f64).round() as usize) * alignment)
            .chain([cells])
            .collect();
        let widths = || cuts.windows(2).map(|w| w[1].saturating_sub(w[0]));
        let even = widths().all(|w| w >= FEWEST && w as f64 <= 1.2 * ideal.ceil());
        if even {
            return Some(cuts);
        }
        if alignment == 1 {
            return widths().all(|w| w >= FEWEST).then_some(cuts);
        }
        alignment /= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vector;

    fn grid(cells: [usize; 3]) -> Grid {
        Grid::new(cells, Vector::ZERO, Vector::ONE)
    }

    #[test]
    fn six_ranks_stand_three_by_two() {
        assert_eq!(Decomposition::new(&grid([24, 16, 8]), 6).unwrap().parts(), [3, 2]);
        assert_eq!(Decomposition::new(&grid([16, 16, 8]), 4).unwrap().parts(), [2, 2]);
    }

    #[test]
    fn the_parts_of_the_papers_grid_are_even_and_aligned() {
        let cuts = Decomposition::new(&grid([176, 184, 132]), 6).unwrap();
        for cuts in cuts.cuts() {
            assert!(cuts[..cuts.len() - 1].iter().all(|c| c.is_multiple_of(8)), "{cuts:?}");
        }
    }

    #[test]
    fn every_cell_has_the_owner_whose_part_holds_it() {
        let d = Decomposition::new(&grid([13, 9, 4]), 6).unwrap();
        for i in 0..13 {
            for j in 0..9 {
                let (start, cells) = d.part(d.owner([i, j, 0]));
                assert!((start[0]..start[0] + cells[0]).contains(&(i as usize)));
                assert!((start[1]..start[1] + cells[1]).contains(&(j as usize)));
            }
        }
    }

    #[test]
    fn too_many_ranks_are_refused() {
        assert!(Decomposition::new(&grid([4, 1, 4]), 3).is_err());
    }
}
