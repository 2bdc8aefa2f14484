//! The pressure equation as it is stored: coefficients by row, roles, and where rows lie.

use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;

use crate::neighbours::{Bins, ROWS};
use crate::particles::Role;

/// Coefficients of some consecutive particles.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    pub starts: [u32; ROWS + 1],
    pub columns: Vec<u32>,
    pub coefficients: Vec<f32>,
    /// Pairs whose coefficient was cut to zero.
    pub cut: usize,
}

impl Default for Block {
    fn default() -> Self {
        Self { starts: [0; ROWS + 1], columns: Vec::new(), coefficients: Vec::new(), cut: 0 }
    }
}

impl Block {
    pub fn clear(&mut self) {
        self.columns.clear();
        self.coefficients.clear();
        self.cut = 0;
    }

    /// Neighbours of a row and the coefficients to them.
    #[inline(always)]
    pub fn row(&self, row: usize) -> (&[u32], &[f32]) {
        let range = self.starts[row] as usize..self.starts[row + 1] as usize;
        (&self.columns[range.clone()], &self.coefficients[range])
    }
}

/// Terms of a row besides its coefficients.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    /// Sum of the coefficients to particles of the equation; 0 for a row that is none.
    pub diagonal: Real,
    /// Right side without the correction beside the surface.
    pub source: Real,
    /// Right side.
    pub right: Real,
    /// Whether a neighbour's pressure is given.
    pub beside_surface: bool,
}

/// Roles and places that a solve looks at.
pub(crate) struct Layout<'a> {
    pub domain: &'a Domain,
    pub bins: &'a Bins,
    /// Of every particle, ghosts included.
    pub roles: &'a [Role],
    /// Bin of each own particle.
    pub bin: &'a [u32],
    pub owned: usize,
}
