//! The domain: a rank's part of the grid, and the verbs that physics is written in.
//!
//! A rank boundary is a boundary condition: the physics asks its domain to fill ghosts, to take a
//! sum or a maximum, and never learns whether a wall, a periodic image or another rank stands
//! behind them.

mod decomposition;
mod gather;
mod halo;
mod rows;

use std::sync::{Arc, Mutex, PoisonError};

use sazanami_parallel::{Communicator, Reduction, Solo};

use crate::grid::{Field, Grid};
use crate::{Real, Vector};

pub use decomposition::{Decomposition, LayoutError};
pub use gather::Region;
pub use halo::{Element, Ghost, GhostRules, Location};
pub use rows::{Range3, Row};

/// A phase failed on another rank, so that this one cannot go on either.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the step failed on rank {rank}")]
pub struct FailedElsewhere {
    /// Lowest rank on which the phase failed.
    pub rank: usize,
}

/// A rank's part of a uniform grid.
pub struct Domain {
    communicator: Arc<dyn Communicator>,
    grid: Grid,
    periodic: [bool; 3],
    decomposition: Arc<Decomposition>,
    start: [usize; 3],
    cells: [usize; 3],
    buffers: Mutex<halo::Buffers>,
}

impl Domain {
    /// The part of `grid` that belongs to this rank of `communicator`.
    ///
    /// # Errors
    /// [`LayoutError`] if the grid cannot be cut into as many parts as there are ranks.
    pub fn new(grid: Grid, periodic: [bool; 3], communicator: Box<dyn Communicator>) -> Result<Self, LayoutError> {
        let decomposition = Decomposition::new(&grid, communicator.size())?;
        Ok(Self::with(grid, periodic, Arc::from(communicator), Arc::new(decomposition)))
    }

    /// The whole of `grid` on a single rank.
    #[must_use]
    pub fn solo(grid: Grid, periodic: [bool; 3]) -> Self {
        let decomposition = Decomposition::whole(&grid);
        Self::with(grid, periodic, Arc::new(Solo::default()), Arc::new(decomposition))
    }

    fn with(
        grid: Grid,
        periodic: [bool; 3],
        communicator: Arc<dyn Communicator>,
        decomposition: Arc<Decomposition>,
    ) -> Self {
        let (start, cells) = decomposition.part(communicator.rank());
        Self { communicator, grid, periodic, decomposition, start, cells, buffers: Mutex::default() }
    }

    /// The domain of a coarser grid on the same ranks whose parts begin at `cuts[d]` in x1 and x2
    /// (one more cut than parts, the last equal to the number of cells).
    #[must_use]
    pub fn coarsened(&self, grid: Grid, cuts: [Vec<usize>; 2]) -> Self {
        let decomposition = Decomposition::from_cuts(&grid, cuts);
        Self::with(grid, self.periodic, Arc::clone(&self.communicator), Arc::new(decomposition))
    }

    /// The same grid, whole, on this rank alone: for small problems that every rank solves itself.
    #[must_use]
    pub fn replicated(&self) -> Self {
        Self::solo(self.grid, self.periodic)
    }

    /// The group of ranks.
    #[must_use]
    pub fn communicator(&self) -> &dyn Communicator {
        &*self.communicator
    }

    /// The global grid.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The periodic directions.
    #[must_use]
    pub fn periodic(&self) -> [bool; 3] {
        self.periodic
    }

    /// Division of the grid among the ranks.
    #[must_use]
    pub fn decomposition(&self) -> &Decomposition {
        &self.decomposition
    }

    /// Global indices of this rank's first cell.
    #[must_use]
    pub fn start(&self) -> [usize; 3] {
        self.start
    }

    /// Number of this rank's cells in each direction.
    #[must_use]
    pub fn cells(&self) -> [usize; 3] {
        self.cells
    }

    /// A new field on this rank's cells.
    #[must_use]
    pub fn field<T: Copy>(&self, value: T) -> Field<T> {
        Field::new(self.cells, value)
    }

    /// Centre of the cell with local indices \[m].
    #[must_use]
    pub fn centre(&self, i: isize, j: isize, k: isize) -> Vector {
        let [a, b, c] = self.start;
        self.grid.centre(i + a as isize, j + b as isize, k + c as isize)
    }

    /// Whether this rank touches the wall of the box (or its periodic seam) at the lower (`side` 0)
    /// or upper (1) end of `direction`.
    #[must_use]
    pub fn at_box_end(&self, direction: usize, side: usize) -> bool {
        if side == 0 {
            self.start[direction] == 0
        } else {
            self.start[direction] + self.cells[direction] == self.grid.cells[direction]
        }
    }

    /// Lower and upper corner of the part of `rank` \[m].
    #[must_use]
    pub fn rank_box(&self, rank: usize) -> (Vector, Vector) {
        let (start, cells) = self.decomposition.part(rank);
        let corner = |index: [usize; 3]| {
            self.grid.lower + self.grid.spacing * Vector::new(index[0] as Real, index[1] as Real, index[2] as Real)
        };
        (corner(start), corner(std::array::from_fn(|d| start[d] + cells[d])))
    }

    /// The rank whose part holds `position`; positions beyond the box belong to the nearest part.
    #[must_use]
    pub fn owner_of(&self, position: Vector) -> usize {
        self.decomposition.owner(self.grid.cell_of(position))
    }

    /// Local indices of the cell of a place in the box or on its sides, if it is on this rank. An upper side belongs to the last cell, and to
    /// the first where the direction is periodic.
    #[must_use]
    pub fn cell_at(&self, place: Vector) -> Option<[isize; 3]> {
        let all = self.grid.cell_of(place);
        let local = std::array::from_fn(|d| {
            let count = self.grid.cells[d] as isize;
            let cell = if self.periodic[d] { all[d].rem_euclid(count) } else { all[d].clamp(0, count - 1) };
            cell - self.start[d] as isize
        });
        (0..3).all(|d| (0..self.cells[d] as isize).contains(&local[d])).then_some(local)
    }

    /// Local index of the faces normal to `direction` nearest to a place along it, if they are on this rank. The faces between two ranks belong to
    /// the upper one; those on the upper side of the box to the last.
    #[must_use]
    pub fn faces_at(&self, direction: usize, place: Real) -> Option<isize> {
        let face = ((place - self.grid.lower[direction]) / self.grid.spacing[direction]).round() as isize;
        let local = face - self.start[direction] as isize;
        let last = self.cells[direction] as isize - isize::from(!self.at_box_end(direction, 1));
        (0..=last).contains(&local).then_some(local)
    }

    /// Sum of `values` over the ranks, element by element, in rank order.
    #[must_use]
    pub fn sum<const N: usize>(&self, mut values: [Real; N]) -> [Real; N] {
        self.communicator.all_reduce(&mut values, Reduction::Sum);
        values
    }

    /// Largest value over the ranks; NaN if one rank has NaN.
    #[must_use]
    pub fn max(&self, value: Real) -> Real {
        let mut values = [value];
        self.communicator.all_reduce(&mut values, Reduction::Max);
        values[0]
    }

    /// Smallest value over the ranks; NaN if one rank has NaN.
    #[must_use]
    pub fn min(&self, value: Real) -> Real {
        let mut values = [value];
        self.communicator.all_reduce(&mut values, Reduction::Min);
        values[0]
    }

    /// Makes an error on one rank an error on all. The failing rank keeps its own error.
    ///
    /// # Errors
    /// The rank's own error, or [`FailedElsewhere`] turned into `E`.
    pub fn agree<T, E: From<FailedElsewhere>>(&self, outcome: Result<T, E>) -> Result<T, E> {
        let size = self.communicator.size() as Real;
        let mine = if outcome.is_err() { self.communicator.rank() as Real } else { size };
        let first = self.min(mine);
        match outcome {
            Ok(_) if first < size => Err(FailedElsewhere { rank: first as usize }.into()),
            other => other,
        }
    }

    fn buffers(&self) -> std::sync::MutexGuard<'_, halo::Buffers> {
        self.buffers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
