//! Shifting of particles by the rate of strain: positions move to where particles are sparse, velocities stay.
//!
//! Between grains what neighbours are shifted by on the mean is left out: shifting is to sort particles among themselves, and a
//! mean of a thousandth of a spacing in a step is a seepage that lifts grains.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::pairs::Pairs;
use super::surroundings::Surroundings;
use super::voids::Bulk;
use crate::context::Context;
use crate::matrix::Block;
use crate::neighbours::ROWS;
use crate::particles::{Kind, Role};
use crate::scheme::Kernel;

/// Way over that of a diffusion number `rate dt`, times 1.5 as drops and vortices need it.
const SHARE: Real = 2.0 * 1.5;
/// Longest way in a step over the spacing of the particles there.
const LONGEST: Real = 0.05;

/// Ways of the own fluid particles for their `rate` of strain [1/s] \[m] and the `size` of their spacing over that of clear
/// water; those at the surface and those with one of these near (`second`) move along it alone, isolated ones not.
pub(crate) fn find_ways(
    step: &Context<'_>,
    kind: &[Kind],
    (surroundings, size): (&[Surroundings], &[Real]),
    rate: impl Fn(usize) -> Real + Sync,
    second: impl Fn(usize) -> bool + Sync,
    ways: &mut [Vector],
) {
    let spacing = step.settings.fluid.spacing;
    let way = |a: usize| {
        let Surroundings { drift, normal, role, .. } = surroundings[a];
        if kind[a] != Kind::Fluid || role == Role::Inactive {
            return Vector::ZERO;
        }
        let spacing = spacing * size[a];
        let whole = (SHARE * spacing * spacing * step.dt * rate(a) * drift).clamp_length_max(LONGEST * spacing);
        let along = role == Role::Dirichlet || second(a);
        if along { whole - whole.dot(normal) * normal } else { whole }
    };
    for_each_chunk(ways, ROWS, |number, ways| {
        ways.iter_mut().enumerate().for_each(|(row, entry)| *entry = way(number * ROWS + row));
    });
}

/// Sets the `means` of the `ways` of neighbours, with their weights in the number density, at own particles between grains that
/// are `inside`; zero elsewhere. Ghosts of the ways are up to date.
pub(crate) fn find_means(
    kernel: &Kernel,
    (pairs, blocks): (&Pairs, &[Block]),
    bulk: &Bulk<'_>,
    ways: &[Vector],
    inside: impl Fn(usize) -> bool + Sync,
    means: &mut [Vector],
) {
    for_each_chunk(means, ROWS, |number, means| {
        for (row, mean) in means.iter_mut().enumerate() {
            let a = number * ROWS + row;
            *mean = Vector::ZERO;
            if bulk.inverse_void[a] <= 1.0 || !inside(a) {
                continue;
            }
            let (mut sum, mut total) = (ways[a], 1.0);
            for pair in pairs.of(blocks, a) {
                let b = pair.particle;
                let w = kernel.weight.value(pair.way().length() * bulk.narrowing(a, b));
                sum += w * pair.seen(ways[b]);
                total += w;
            }
            *mean = sum / total;
        }
    });
}
