//! The interface between liquid and gas: the liquid flux through a cell face.
//!
//! The liquid fraction C of the fluid in a cell is transported one direction after the other by
//! (Weymouth and Yue 2010, J. Comput. Phys. 229)
//!
//! ```text
//! C <- C - (G_+ - G_-) + c_c (c_+ - c_-),     c = u_f dt / dx,   c_c = 1 where C > 1/2 at the start, else 0
//! ```
//!
//! with `G` the liquid in the slab of width `|c|` that the donor cell loses, signed like `c`. `c_c`
//! is the same in all sweeps, so that the terms add up to `c_c dt div u`: liquid is conserved as
//! exactly as the velocity is free of divergence.

mod normal;
mod plic;
mod residue;
mod wetting;

use sazanami_numerics::Real;

pub use normal::{mixed_normal, youngs_normal};
pub use plic::{Facet, Plane, plane_constant, volume_below};
pub use residue::ResidueReport;
pub(crate) use residue::{Collector, RESIDUE, View};
pub(crate) use wetting::Wetting;

/// Liquid fractions of a cell and its 26 neighbours, x1 fastest; the cell itself has index 13.
pub type Neighbourhood = [Real; 27];

/// Liquid that a cell with `0 < C < 1` in the centre of `cells` gives through the face in
/// `direction` it loses fluid by, as a part of the cell's volume and signed like `courant`,
/// the signed part of the cell that leaves: what a plane in the cell cuts off (piecewise linear interface).
pub(crate) fn donated(cells: &Neighbourhood, direction: usize, courant: Real) -> Real {
    Plane::through(cells).map_or(cells[13] * courant, |plane| plane.donated(direction, courant))
}

/// The neighbourhood of the cell at place `at` of a field with these strides.
#[inline]
pub(crate) fn neighbourhood(c: &[Real], at: usize, strides: [isize; 3]) -> Neighbourhood {
    let mut cells = [0.0; 27];
    for (n, cell) in cells.chunks_exact_mut(3).enumerate() {
        let row = (n / 3) as isize - 1;
        let start = (at as isize + row * strides[2] + ((n % 3) as isize - 1) * strides[1] - 1) as usize;
        cell.copy_from_slice(&c[start..start + 3]);
    }
    cells
}
