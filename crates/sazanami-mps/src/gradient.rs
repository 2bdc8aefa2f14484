//! Corrected gradient of the pressure, with the inverse moment matrix: exact for linear fields on any arrangement (GC, Khayyer & Gotoh
//! 2011).

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::context::Context;
use crate::matrix::Block;
use crate::moments::{add, full, inverse};
use crate::neighbours::ROWS;
use crate::particles::{Kind, Particles, Role};
use crate::reductions::sum_of;
use crate::scheme::Kernel;
use crate::weight::COINCIDENT;

/// Sets the gradient of the reduced pressure of each own particle; returns the number of those left uncorrected, over all
/// ranks. `uncorrected` is work space.
pub(crate) fn gradient(
    step: &Context<'_>,
    blocks: &[Block],
    position: &[Vector],
    inverse_void: &[Real],
    particles: &mut Particles,
    uncorrected: &mut Vec<bool>,
) -> usize {
    let Particles { kind, role, pressure, gradient, owned, .. } = particles;
    uncorrected.resize(*owned, false);
    let weight_of_fluid = step.settings.fluid.density * step.reduced_force;
    let field = PressureField { pressure, position, inverse_void, roles: role, kind, weight_of_fluid };
    gradient_of(step.kernel, blocks, &field, &mut gradient[..*owned], uncorrected);
    let uncorrected = &uncorrected[..];
    step.domain.sum(sum_of(*owned, |a| [if uncorrected[a] { 1.0 } else { 0.0 }]))[0] as usize
}

/// Fields from which the pressure gradient is computed, ghosts included.
pub(crate) struct PressureField<'a> {
    pub pressure: &'a [Real],
    pub position: &'a [Vector],
    pub inverse_void: &'a [Real],
    pub roles: &'a [Role],
    pub kind: &'a [Kind],
    /// Density times the part of the body force whose hydrostatic pressure is split off [N/m^3].
    pub weight_of_fluid: Vector,
}

/// Gradient of the reduced pressure at each own fluid particle, and whether it was left uncorrected. The total pressure
/// gradient at isolated particles is zero.
pub(crate) fn gradient_of(
    kernel: &Kernel,
    blocks: &[Block],
    field: &PressureField<'_>,
    into: &mut [Vector],
    uncorrected: &mut [bool],
) {
    let PressureField { pressure, position, inverse_void, roles, kind, weight_of_fluid } = *field;
    let Kernel { weight, sums, .. } = kernel;
    let owned = into.len();
    let into = &mut into[..];
    for_each_chunk((into, uncorrected), ROWS, |number, (into, uncorrected)| {
        let (block, weight) = (&blocks[number], *weight);
        for (row, (gradient, uncorrected)) in into.iter_mut().zip(uncorrected).enumerate() {
            let a = number * ROWS + row;
            (*gradient, *uncorrected) = (Vector::ZERO, false);
            if a >= owned || kind[a] != Kind::Fluid {
                continue;
            }
            if roles[a] == Role::Inactive {
                *gradient = -weight_of_fluid;
                continue;
            }
            let (mut matrix, mut sum, mut support) = ([0.0; 6], Vector::ZERO, 0.0);
            for &b in block.row(row).0 {
                let b = b as usize;
                if roles[b] == Role::Inactive {
                    continue;
                }
                let apart = position[b] - position[a];
                let r2 = apart.length_squared();
                let w = weight.value(r2.sqrt()) * inverse_void[b];
                let share = w / r2.max(COINCIDENT);
                support += w;
                add(&mut matrix, share, apart);
                sum += (share * (pressure[b] - pressure[a])) * apart;
            }
            *gradient = match inverse(&matrix, support) {
                Some(inverse) => inverse * sum,
                None => {
                    // Too little support for the correction: plain gradient of the total pressure.
                    *uncorrected = true;
                    let whole = sum + full(&matrix) * weight_of_fluid;
                    whole * (3.0 / sums.others) - weight_of_fluid
                }
            };
        }
    });
}
