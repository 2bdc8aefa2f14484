//! Momentum of the fluid on the covered part of the cells.
//!
//! The equations of the fluid hold on whole cells, also where grains cover them. What the covered part has gained of
//! momentum after transport, stress and body forces is what crossed the surface of the grain: it is given to the
//! grain, and `sum (1 - alpha) rho u dV + sum M v` changes by outer impulses alone.

use sazanami_numerics::Real;
use sazanami_numerics::Vector;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_parallel::for_each_chunk;

use super::imprint::Imprint;
use super::surface::SOLID;

/// For every grain and ghost: momentum [N s], angular momentum about its centre [N m s] and mass \[kg] of the fluid on the
/// covered part of this rank's cells.
pub(super) fn sum(
    domain: &Domain,
    imprint: &Imprint,
    u: &[Field<Real>; 3],
    density: &Field<Real>,
    sums: &mut [[Real; 7]],
) {
    let volume = domain.grid().cell_volume();
    let (alpha, rho) = (imprint.solid_fraction.data(), density.data());
    let [u1, u2, u3] = u.each_ref().map(Field::data);
    for_each_chunk(sums, 64, |number, sums| {
        for (offset, sum) in sums.iter_mut().enumerate() {
            let (mut momentum, mut angular_momentum, mut covered) = (Vector::ZERO, Vector::ZERO, 0.0);
            for share in imprint.shares(number * 64 + offset) {
                let at = share.at as usize;
                let mass = part(share.fraction, alpha[at]) * volume * rho[at];
                let held = mass * Vector::new(u1[at], u2[at], u3[at]);
                momentum += held;
                angular_momentum += share.arm().cross(held);
                covered += mass;
            }
            let [p, l] = [momentum.to_array(), angular_momentum.to_array()];
            *sum = [p[0], p[1], p[2], l[0], l[1], l[2], covered];
        }
    });
}

/// Volume of this rank's cells that each grain and ghost covers, as [`sum`] counts it \[m^3].
pub(super) fn volumes(domain: &Domain, imprint: &Imprint, count: usize) -> Vec<[Real; 1]> {
    let (cell, alpha) = (domain.grid().cell_volume(), imprint.solid_fraction.data());
    let of =
        |n: usize| imprint.shares(n).iter().map(|share| part(share.fraction, alpha[share.at as usize])).sum::<Real>();
    (0..count).map(|n| [cell * of(n)]).collect()
}

/// Part of a cell that belongs to a grain covering the `fraction` of it: all of it where the cell moves with its grains.
#[inline]
pub(super) fn part(fraction: Real, alpha: Real) -> Real {
    if alpha >= SOLID { fraction / alpha } else { fraction }
}
