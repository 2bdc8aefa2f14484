//! Liquid in the bed: how deep it stands below the bed's surface before the impact, and how much of it.

use sazanami_mics::solver::Solver;
use sazanami_numerics::Real;

use super::{liquid_share, outside_grains};

/// Liquid below the level of the bed before the impact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Soaked {
    /// The level above the floor of the box \[m].
    pub level: Real,
    /// From it to the lowest interface below it of a cell at least half full, where the liquid in that cell and in the next one below
    /// ends; zero where none lies below \[m].
    pub depth: Real,
    /// Volume of the liquid outside grains below it [m^3].
    pub volume: Real,
}

impl Soaked {
    /// Below `level` \[m]; ghosts are filled. All ranks take part.
    pub fn below(level: Real, solver: &Solver) -> Self {
        let domain = solver.domain();
        let (grid, interior) = (domain.grid(), domain.interior());
        let (width, below) = (grid.spacing.z, domain.strides()[2] as usize);
        let share = |at: usize| liquid_share(solver, at).unwrap_or_default();
        let floor = |k: isize| grid.lower.z + k as Real * width;
        let depth = domain.max_rows(&interior, |row| {
            let next = |at: usize| if row.k == 0 { 0.0 } else { share(at - below) };
            let ends = row.shifted(0).filter(|&at| share(at) >= 0.5);
            ends.map(|at| level - floor(row.k + 1) + width * (share(at) + next(at))).fold(0.0, Real::max)
        });
        let [cells] = domain.sum_rows(&interior, |row| {
            let part = ((level - floor(row.k)) / width).clamp(0.0, 1.0);
            [if part > 0.0 { part * row.shifted(0).map(|at| outside_grains(solver, at)[0]).sum::<Real>() } else { 0.0 }]
        });
        Self {
            level: level - grid.lower.z,
            depth: domain.max(depth),
            volume: domain.sum([cells])[0] * grid.cell_volume(),
        }
    }
}
