//! Shifting: particles move on to where they are fewer, whatever their velocity.

use sazanami_numerics::{Real, Vector};

use crate::neighbours::Neighbours;
use crate::particles::{Kind, Role};
use crate::scheme::Kernel;

/// Places after the pressure's correction and roles, ghosts included.
pub(crate) struct Arrangement<'a> {
    pub kind: &'a [Kind],
    pub roles: &'a [Role],
    pub position: &'a [Vector],
    /// Bulk volumes `1/eps`.
    pub bulk: &'a [Real],
}

/// Ways of the own particles down the gradient of their concentration, `-factor (r_e/2)^2 grad C` with
/// `C = sum w/(eps n0)` [m] (Lind, Xu, Stansby and Rogers 2012, J. Comput. Phys. 231, 1499).
///
/// Velocities are left as they are, and so is the momentum. Where a particle sees the surface it stays: there fewer
/// neighbours are no disorder.
pub(crate) fn ways(
    kernel: &Kernel,
    neighbours: &Neighbours,
    factor: Real,
    arrangement: &Arrangement<'_>,
    into: &mut [Vector],
) {
    let Arrangement { kind, roles, position, bulk } = *arrangement;
    let weight = kernel.weight;
    let square = weight.radius * weight.radius;
    let scale = factor * 0.25 * square / kernel.sums.number_density;
    neighbours.set(into, |a, near| {
        if kind[a] != Kind::Fluid || roles[a] != Role::Unknown {
            return Vector::ZERO;
        }
        let mut gradient = Vector::ZERO;
        for &b in near {
            let b = b as usize;
            let apart = position[b] - position[a];
            let r2 = apart.length_squared();
            if r2 >= square {
                continue;
            }
            if kind[b] == Kind::Fluid && roles[b] != Role::Unknown {
                return Vector::ZERO;
            }
            gradient -= (weight.slope_over_distance(r2.sqrt()) * bulk[b]) * apart;
        }
        -scale * gradient
    });
}
