//! Normals of the interface from the liquid fractions around a cell.
//!
//! Mixed Youngs-centred: of the three normals from centred differences of column heights, the one
//! whose columns stand steepest on the interface is kept; Youngs' normal replaces it where that is
//! steeper (Aulisa, Manservisi, Scardovelli and Zaleski 2007, J. Comput. Phys. 225).

use sazanami_numerics::Real;

use super::{Neighbourhood, RESIDUE};

const STRIDES: [usize; 3] = [1, 3, 9];
/// Normals whose steepness differs by less are equally steep, and the first of them is taken: a drop of a few
/// cells has such by its shape, and rounding must not choose among them.
const TIE: Real = 1e-9;

/// Normal in cell coordinates that points out of the liquid, with `|m_1| + |m_2| + |m_3| = 1`.
/// Youngs' weighted difference over all 27 cells; `None` if it vanishes.
#[must_use]
pub fn youngs_normal(cells: &Neighbourhood) -> Option<[Real; 3]> {
    let weight = [1.0, 2.0, 1.0];
    normalised(std::array::from_fn(|d| {
        let (e, f) = (STRIDES[(d + 1) % 3], STRIDES[(d + 2) % 3]);
        let mut difference = 0.0;
        for (a, wa) in weight.iter().enumerate() {
            for (b, wb) in weight.iter().enumerate() {
                let at = a * e + b * f;
                difference += wa * wb * (cells[at] - cells[at + 2 * STRIDES[d]]);
            }
        }
        difference
    }))
}

/// Mixed Youngs-centred normal, as [`youngs_normal`]; `None` if all fractions are equal.
#[must_use]
pub fn mixed_normal(cells: &Neighbourhood) -> Option<[Real; 3]> {
    let youngs = youngs_normal(cells);
    let mut best: Option<([Real; 3], Real)> = None;
    for d in 0..3 {
        if let Some(m) = centred_normal(cells, d)
            && best.is_none_or(|(_, steepness)| m[d].abs() > steepness + TIE)
        {
            best = Some((m, m[d].abs()));
        }
    }
    let Some((centred, steepness)) = best else { return youngs };
    match youngs {
        Some(m) if m.iter().fold(0.0, |a: Real, b| a.max(b.abs())) < steepness - TIE => youngs,
        _ => Some(centred),
    }
}

/// Normal from the heights of the liquid in columns along `d`.
fn centred_normal(cells: &Neighbourhood, d: usize) -> Option<[Real; 3]> {
    let (sd, e, f) = (STRIDES[d], (d + 1) % 3, (d + 2) % 3);
    let column = |at: usize| cells[at - sd] + cells[at] + cells[at + sd];
    let mut m = [0.0; 3];
    let layer = |at: usize| {
        let row = |at: usize| cells[at - STRIDES[e]] + cells[at] + cells[at + STRIDES[e]];
        row(at - STRIDES[f]) + row(at) + row(at + STRIDES[f])
    };
    let fall = layer(13 - sd) - layer(13 + sd);
    // Round-off residue around a drop must not flip the normal.
    if fall.abs() <= RESIDUE {
        return None;
    }
    m[d] = fall.signum();
    m[e] = 0.5 * (column(13 - STRIDES[e]) - column(13 + STRIDES[e]));
    m[f] = 0.5 * (column(13 - STRIDES[f]) - column(13 + STRIDES[f]));
    normalised(m)
}

fn normalised(m: [Real; 3]) -> Option<[Real; 3]> {
    let sum = m[0].abs() + m[1].abs() + m[2].abs();
    (sum > RESIDUE).then(|| m.map(|v| v / sum))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::{plane_constant, volume_below};

    /// Fractions of the cells around one whose interface is the plane `m . x = alpha` of its own.
    pub(crate) fn plane_fractions(m: [Real; 3], alpha: Real) -> Neighbourhood {
        std::array::from_fn(|n| {
            let offset = [n % 3, n / 3 % 3, n / 9].map(|o| o as Real - 1.0);
            let local = alpha - (0..3).map(|d| m[d] * offset[d]).sum::<Real>();
            let shifted = local - m.iter().map(|v| v.min(0.0)).sum::<Real>();
            volume_below(m.map(Real::abs), shifted)
        })
    }

    #[test]
    fn planes_that_do_not_leave_the_columns_are_found_exactly() {
        for m in [[0.1, -0.2, 0.7], [-0.8, 0.1, 0.1], [0.0, 1.0, 0.0], [0.25, 0.0, -0.75]] {
            let alpha = plane_constant(m.map(Real::abs), 0.5) + m.iter().map(|v| v.min(0.0)).sum::<Real>();
            let found = mixed_normal(&plane_fractions(m, alpha)).unwrap();
            for d in 0..3 {
                assert!((found[d] - m[d]).abs() < 1e-13, "{m:?}: {found:?}");
            }
        }
        assert_eq!(mixed_normal(&[0.3; 27]), None);
    }
}
