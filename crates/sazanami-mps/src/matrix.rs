//! The pressure equation as it is stored: coefficients by row, roles, and where rows lie.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};

use crate::neighbours::{Bins, ROWS};
use crate::particles::Role;

/// Coefficients of some consecutive particles.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    starts: [u32; ROWS + 1],
    pub columns: Vec<u32>,
    pub coefficients: Vec<f32>,
    close_starts: [u32; ROWS + 1],
    /// Neighbours within 2.1 spacings.
    pub close: Vec<u32>,
    /// Pairs whose coefficient was cut to zero.
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
    /// Notes that a row ends where its columns and its close neighbours end now.
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

/// Terms of a row besides its coefficients.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    /// Sum of the coefficients to particles of the equation, and to what is missing beyond the surface; 0 for a row
    /// that is none.
    pub diagonal: Real,
    /// Right side.
    pub right: Real,
    /// Whether a neighbour's pressure is given.
    pub beside_surface: bool,
    /// Whether what is missing beyond the surface was held to a whole side.
    pub held: bool,
}

/// Roles and places that a solve looks at.
pub(crate) struct Layout<'a> {
    pub domain: &'a Domain,
    pub bins: &'a Bins,
    /// Of every particle, ghosts included.
    pub roles: &'a [Role],
    /// Bin of each own particle.
    pub bin: &'a [u32],
    /// Where each particle is [m].
    pub place: &'a [Vector],
    pub owned: usize,
}
