//! Particle shifting: positions move down the gradient of the concentration; velocities are unchanged.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::arrangement::Arrangement;
use crate::context::{Context, Motion};
use crate::neighbours::{Neighbours, ROWS};
use crate::particles::{Kind, Particles, Role};
use crate::reductions::largest;
use crate::scheme::Kernel;

/// Shifts the own particles in `new`; `displacements` is work space. Returns the largest displacement over all ranks \[m].
pub(crate) fn shift(
    step: &Context<'_>,
    particles: &Particles,
    inverse_void: &[Real],
    near: &mut Arrangement,
    new: &mut Motion,
    displacements: &mut Vec<Vector>,
) -> Real {
    let factor = step.settings.scheme.shifting * step.dt / step.flow_time;
    if factor == 0.0 {
        return 0.0;
    }
    let owned = particles.owned;
    displacements.resize(owned, Vector::ZERO);
    let columns = Columns { kind: &particles.kind, roles: &particles.role, position: &new.position, inverse_void };
    find_displacements(step.kernel, &near.neighbours, factor, &columns, displacements);
    let displacements = &displacements[..];
    for_each_chunk(&mut new.position[..owned], ROWS, |number, position| {
        position.iter_mut().zip(&displacements[number * ROWS..]).for_each(|(x, displacement)| *x += *displacement);
    });
    near.ghosts.refresh_positions(step.domain, &mut new.position);
    let longest = largest(owned, |a| displacements[a].length_squared()).max(0.0);
    step.domain.max(longest).sqrt()
}

/// Positions after the pressure correction and roles, ghosts included.
struct Columns<'a> {
    kind: &'a [Kind],
    roles: &'a [Role],
    position: &'a [Vector],
    inverse_void: &'a [Real],
}

/// Displacements of the own particles down the gradient of their concentration, `-factor (r_e/2)^2 grad C` with
/// `C = sum w/(eps n0)` \[m] (Lind, Xu, Stansby and Rogers 2012, J. Comput. Phys. 231, 1499).
///
/// Momentum is unchanged. Particles with a neighbour at the free surface are not shifted: there a low concentration is
/// not disorder.
fn find_displacements(
    kernel: &Kernel,
    neighbours: &Neighbours,
    factor: Real,
    columns: &Columns<'_>,
    into: &mut [Vector],
) {
    let Columns { kind, roles, position, inverse_void } = *columns;
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
