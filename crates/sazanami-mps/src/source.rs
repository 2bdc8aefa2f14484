//! Right side of the pressure equation: source (HS, ECS), the share of mobile grains, and prescribed pressures.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::context::{Context, Voids};
use crate::matrix::{Block, Row};
use crate::neighbours::ROWS;
use crate::number_density::{NumberDensity, Prediction, Sample, rate_by};
use crate::particles::{Particles, Role};
use crate::pressure::hydrostatic;
use crate::reductions::for_each_entry;

/// Sums and columns from which the source is computed.
#[derive(Clone, Copy)]
pub(crate) struct SourceTerms<'a> {
    /// At the start of the step.
    pub start: &'a [NumberDensity],
    /// At the predicted positions.
    pub predicted: &'a [Prediction],
    pub samples: &'a [Sample],
    /// `eps + (1 - eps) rho/rho_s`.
    pub mobility: &'a [Real],
    pub voids: &'a Voids,
}

/// Sets the right side of each row of the equation [Pa/m^2].
///
/// The contact sub-steps have accelerated the grains with the pressure of the previous step, which the particles still
/// hold: the grains' share of the operator acts on its change alone.
pub(crate) fn set_right_side(
    step: &Context<'_>,
    terms: &SourceTerms<'_>,
    particles: &Particles,
    blocks: &[Block],
    rows: &mut [Row],
) {
    let Context { kernel, settings, dt, .. } = *step;
    let SourceTerms { start, predicted, samples, mobility, voids } = *terms;
    let grain_mobility = &voids.grain_mobility[..];
    let Particles { kind, role, pressure, owned, .. } = particles;
    let strain = |density: Real| (density - kernel.sums.number_density) / kernel.sums.strain;
    for_each_chunk(&mut rows[..*owned], ROWS, |number, rows| {
        for (place, row) in rows.iter_mut().enumerate().filter(|(_, row)| row.diagonal > 0.0) {
            let a = number * ROWS + place;
            let dry = step.is_dry_wall(kind[a], predicted[a].density);
            // Isolated particles do not compress a dry wall.
            let compression = if dry {
                rate_by(kernel, samples, a, blocks[number].row(place).0, |b| role[b] != Role::Inactive)
            } else {
                predicted[a].rate
            };
            // No tension at dry walls, neither from receding fluid nor from error compensation.
            let source = if dry {
                compression.max(0.0)
            } else {
                let NumberDensity { density, rate, .. } = start[a];
                settings.scheme.compensated(compression, rate, strain(density), row.beside_surface, step.flow_time)
            };
            row.right = settings.fluid.density / dt * source;
            if grain_mobility[a] > 0.0 {
                let (columns, coefficients) = blocks[number].row(place);
                for (&b, &c) in columns.iter().zip(coefficients) {
                    let b = b as usize;
                    if role[b] != Role::Inactive {
                        let share = (grain_mobility[a] + grain_mobility[b]) / (mobility[a] + mobility[b]);
                        row.right -= Real::from(c) * share * (pressure[b] - pressure[a]);
                    }
                }
            }
        }
    });
}

/// Prescribes the pressure of surface particles and ghosts, total pressure zero, and clears that of inactive ones;
/// `predicted` are positions \[m].
pub(crate) fn prescribe(step: &Context<'_>, particles: &mut Particles, predicted: &[Vector]) {
    let role = &particles.role[..];
    for_each_entry(&mut particles.pressure, |a, pressure| match role[a] {
        Role::Inactive => *pressure = 0.0,
        Role::Dirichlet => *pressure = reduced_of_zero(step, predicted[a]),
        Role::Unknown => {}
    });
}

/// Sets the total pressure of inactive own particles to zero.
pub(crate) fn release_inactive(step: &Context<'_>, particles: &mut Particles, position: &[Vector]) {
    let Particles { role, pressure, owned, .. } = particles;
    for_each_entry(&mut pressure[..*owned], |a, pressure| {
        if role[a] == Role::Inactive {
            *pressure = reduced_of_zero(step, position[a]);
        }
    });
}

/// Reduced pressure at `position` \[m] where the total pressure is zero \[Pa].
fn reduced_of_zero(step: &Context<'_>, position: Vector) -> Real {
    -hydrostatic(step.settings.fluid.density, step.reduced_force, position, step.settings.reference)
}
