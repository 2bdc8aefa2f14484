//! Momentum exchange as published: the velocity of cells that grains cover becomes mass-averaged (back-projection).
//!
//! With alpha the solid fraction, `u_s` the rigid velocity (of a prescribed grain at the centre of the cell, else at the covered centroid) and
//! `w = alpha rho_s / ((1 - alpha) rho_f + alpha rho_s)`,
//!
//! ```text
//! u <- u + sum_k w (alpha_k / alpha) (u_s,k - u)
//! ```
//!
//! (Yagyu et al. 2015, section 2 (3), "mass-averaged velocity"). The stress integral that drives
//! the grains does not contain the momentum this removes from partly covered cells: it is lost.

use sazanami_numerics::Real;
use sazanami_numerics::choices;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_parallel::for_each_chunk;

use super::imprint::{Imprint, Share};

choices! {
    /// Scheme of the momentum exchange between grains and fluid.
    #[derive(Default)]
    pub enum Exchange {
        /// Grains close faces in the projection and exert friction on the fluid in the viscous equation, and liquid has the open part of
        /// the cells as its room. Momentum is conserved; drag, added mass and torque of grains that the grid resolves do not hang on the
        /// step. Grains need 0.3 of the density of the liquid or more.
        #[default]
        Surface = "surface",
        /// The stress integral, and the mass average of fluid and grains in covered cells, as in Yagyu et al. (2015): momentum is not
        /// conserved. Liquid fills whole cells.
        Stress = "stress",
    }
}

/// Width in cells below which a lone grain is all surface cells, and does not have its drag (docs/decisions/0010).
pub const RESOLVED: Real = 2.0;

/// Composition of a partly covered cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct MixedCell {
    /// Solid fraction, summed over the grains; above one where they overlap.
    pub alpha: Real,
    /// Weight w of the grains.
    pub weight: Real,
}

impl MixedCell {
    /// `alpha` and `solid_density` as imprinted, `rho` the density of the fluid [kg/m^3].
    #[inline]
    pub fn new(alpha: Real, solid_density: Real, rho: Real) -> Self {
        let filled = alpha.min(1.0);
        let solid = solid_density * filled / alpha;
        Self { alpha, weight: solid / ((1.0 - filled) * rho + solid) }
    }

    /// Fraction of a grain in the cell, scaled down where the sum exceeds one.
    #[inline]
    pub fn share(&self, fraction: Real) -> Real {
        fraction / self.alpha.max(1.0)
    }
}

/// Sums the mass of the fluid that each grain displaces \[kg].
pub(super) fn displace(domain: &Domain, imprint: &Imprint, density: &Field<Real>, displaced: &mut [[Real; 1]]) {
    let volume = domain.grid().cell_volume();
    let (alpha, solid, rho) = (imprint.solid_fraction.data(), imprint.solid_density.data(), density.data());
    for_each_chunk(displaced, 64, |number, displaced| {
        for (offset, [displaced]) in displaced.iter_mut().enumerate() {
            let of = |share: &Share| {
                let at = share.at as usize;
                MixedCell::new(alpha[at], solid[at], rho[at]).share(share.fraction) * rho[at] * volume
            };
            *displaced = imprint.shares(number * 64 + offset).iter().map(of).sum();
        }
    });
}

/// Makes the velocity of covered cells mass-averaged.
pub(super) fn back_project(domain: &Domain, imprint: &Imprint, u: &mut [Field<Real>; 3], density: &Field<Real>) {
    let [u1, u2, u3] = u;
    let (alpha, solid, rho) = (imprint.solid_fraction.data(), imprint.solid_density.data(), density.data());
    let rigid = imprint.solid_velocity.each_ref().map(Field::data);
    domain.for_each_row(&domain.interior(), (u1.data_mut(), u2.data_mut(), u3.data_mut()), |row, (u1, u2, u3)| {
        if !imprint.row_is_covered(row.j, row.k) {
            return;
        }
        for i in 0..row.len {
            let at = row.start + i;
            if alpha[at] > 0.0 {
                let cell = MixedCell::new(alpha[at], solid[at], rho[at]);
                u1[i] += cell.weight * (rigid[0][at] / cell.alpha - u1[i]);
                u2[i] += cell.weight * (rigid[1][at] / cell.alpha - u2[i]);
                u3[i] += cell.weight * (rigid[2][at] / cell.alpha - u3[i]);
            }
        }
    });
}
