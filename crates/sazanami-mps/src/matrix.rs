//! Storage of the pressure equation: coefficients by row, right side and diagonal.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::particles::Bins;
use sazanami_numerics::{Real, Vector};

use crate::neighbours::ROWS;
use crate::particles::Role;

/// Radius of close neighbours over the particle spacing.
pub(crate) const CLOSE_RADIUS: Real = 2.1;

/// Coefficients of the rows of one block of consecutive particles.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    starts: [u32; ROWS + 1],
    pub columns: Vec<u32>,
    pub coefficients: Vec<f32>,
    close_starts: [u32; ROWS + 1],
    /// Close neighbours, within 2.1 spacings.
    pub close: Vec<u32>,
    /// Number of pairs whose negative coefficient was set to zero.
    pub cut: usize,
}

impl Default for Block {
    fn default() -> Self {
        let starts = [0; ROWS + 1];
        let (columns, coefficients, close) = (Vec::new(), Vec::new(), Vec::new());
        Self { starts, columns, coefficients, close_starts: starts, close, cut: 0 }
    }
}

impl Block {
    /// Ends a row at these numbers of columns and of close neighbours.
    pub fn end_row(&mut self, row: usize, columns: usize, close: usize) {
        (self.starts[row + 1], self.close_starts[row + 1]) = (columns as u32, close as u32);
    }

    /// Neighbours of a row and the coefficients to them.
    #[inline(always)]
    pub fn row(&self, row: usize) -> (&[u32], &[f32]) {
        let range = self.starts[row] as usize..self.starts[row + 1] as usize;
        (&self.columns[range.clone()], &self.coefficients[range])
    }

    /// Neighbours of a row within 2.1 spacings.
    #[inline(always)]
    pub fn close(&self, row: usize) -> &[u32] {
        &self.close[self.close_starts[row] as usize..self.close_starts[row + 1] as usize]
    }
}

/// Diagonal and right side of a row.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    /// Sum of the coefficients, the completion beyond the free surface included; 0 for particles that are not unknowns.
    pub diagonal: Real,
    /// Right side [Pa/m^2].
    pub right: Real,
    /// Whether a neighbour has a prescribed pressure.
    pub beside_surface: bool,
    /// Whether the completion beyond the surface was limited to the support of the row itself.
    pub limited: bool,
}

/// Roles, positions and bins of the particles of an equation.
pub(crate) struct Layout<'a> {
    pub domain: &'a Domain,
    pub bins: &'a Bins,
    /// Role of every particle, ghosts included.
    pub roles: &'a [Role],
    /// Bin of each own particle.
    pub bin: &'a [u32],
    /// Position of each particle \[m].
    pub place: &'a [Vector],
    pub owned: usize,
}
