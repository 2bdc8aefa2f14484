//! Particle shifting: positions move down the gradient of the concentration; velocities are unchanged.

use sazanami_numerics::{Real, Vector};

use crate::neighbours::Neighbours;
use crate::particles::{Kind, Role};
use crate::scheme::Kernel;

/// Positions after the pressure correction and roles, ghosts included.
pub(crate) struct Arrangement<'a> {
    pub kind: &'a [Kind],
    pub roles: &'a [Role],
    pub position: &'a [Vector],
    /// Inverse void fraction `1/eps`.
    pub inverse_void: &'a [Real],
}

/// Displacements of the own particles down the gradient of their concentration, `-factor (r_e/2)^2 grad C` with
/// `C = sum w/(eps n0)` [m] (Lind, Xu, Stansby and Rogers 2012, J. Comput. Phys. 231, 1499).
///
/// Momentum is unchanged. Particles with a neighbour at the free surface are not shifted: there a low concentration is
/// not disorder.
pub(crate) fn displacements(
    kernel: &Kernel,
    neighbours: &Neighbours,
    factor: Real,
    arrangement: &Arrangement<'_>,
    into: &mut [Vector],
) {
    let Arrangement { kind, roles, position, inverse_void } = *arrangement;
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
            gradient -= (weight.slope_over_distance(r2.sqrt()) * inverse_void[b]) * apart;
        }
        -scale * gradient
    });
}
