//! What keeps particles apart when the pressure does not: stabilisation (DS) and, at last, collisions.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::matrix::Block;
use crate::neighbours::ROWS;
use crate::particles::Kind;
use crate::scheme::{Kernel, Stabilisation};

/// Distance over the particle spacing below which particles bounce off each other.
const COLLISION: Real = 0.5;
/// Part of the speed with which particles leave a collision.
const RESTITUTION: Real = 0.2;
/// Part of its push that a pair keeps which comes apart by itself (`docs/decisions/0007-shaken-tanks.md`).
const PARTING: Real = 0.2;

/// Places before and after the pressure's correction and velocities after it, ghosts included.
pub(crate) struct Moved<'a> {
    pub kind: &'a [Kind],
    pub before: &'a [Vector],
    pub after: &'a [Vector],
    pub velocity: &'a [Vector],
    /// Sizes: the spacing, stretched by the bulk volume [m].
    pub size: &'a [Real],
    pub blocks: &'a [Block],
    /// Whether the close neighbours hold all pairs that can be too near.
    pub close: bool,
}

impl Moved<'_> {
    /// Sets an entry of `column` for every own particle from the neighbours that may be too near.
    fn set<T: Send>(&self, column: &mut [T], value: impl Fn(usize, &[u32]) -> T + Sync) {
        for_each_chunk(column, ROWS, |number, column| {
            let block = &self.blocks[number];
            for (row, entry) in column.iter_mut().enumerate() {
                let near = if self.close { block.close(row) } else { block.row(row).0 };
                *entry = value(number * ROWS + row, near);
            }
        });
    }
}

/// Sizes of particles of spacing `spacing` [m] with bulk volumes `1/eps`.
pub(crate) fn sizes(spacing: Real, kind: &[Kind], bulk: &[Real], into: &mut Vec<Real>) {
    into.resize(kind.len(), 0.0);
    for_each_chunk(&mut into[..], ROWS, |number, into| {
        for (row, size) in into.iter_mut().enumerate() {
            let a = number * ROWS + row;
            let plain = kind[a] != Kind::Fluid || bulk[a] == 1.0;
            *size = if plain { spacing } else { spacing * bulk[a].cbrt() };
        }
    });
}

/// The widest particle [m].
pub(crate) fn widest(spacing: Real) -> Real {
    1.5 * spacing
}

/// What stabilisation does to a particle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Push {
    /// Acceleration times the square of [`crate::stability::flow_time`]: a displacement [m].
    pub way: Vector,
    /// Square of the distance to the nearest neighbour [m^2].
    pub nearest: Real,
    /// Pairs too near, of which another particle of fluid counts a half.
    pub pairs: Real,
}

/// Pushes each own fluid particle from neighbours that came too near (Tsuruta et al. 2013).
///
/// A pair at `r` after the correction that is nearer than it may be is pushed along its direction `e` before the
/// correction, each so that it would move by half of what is missing in [`crate::stability::flow_time`], times `w/n0`;
/// by [`PARTING`] of that if the pair comes apart already, so that pushes take more energy from disordered water than
/// they give.
pub(crate) fn pushes(kernel: &Kernel, settings: &Stabilisation, spacing: Real, moved: &Moved<'_>, into: &mut [Push]) {
    let Moved { kind, before, after, velocity, size, .. } = *moved;
    let limit = widest(spacing) * widest(spacing);
    moved.set(into, |a, near| {
        let mut push = Push { nearest: Real::INFINITY, ..Push::default() };
        if kind[a] != Kind::Fluid {
            return push;
        }
        let mine = size[a];
        for &b in near {
            let b = b as usize;
            let apart = after[b] - after[a];
            let r2 = apart.length_squared();
            if r2 > limit {
                continue;
            }
            push.nearest = push.nearest.min(r2);
            let least = settings.distance * 0.5 * (mine + size[b]);
            if r2 >= least * least {
                continue;
            }
            let direction = (before[b] - before[a]).normalize_or_zero();
            let along = apart.dot(direction);
            let across = (r2 - along * along).max(0.0);
            let missing = (least * least - across).sqrt() - along;
            let share = if settings.weighted { kernel.weight.value(r2.sqrt()) } else { 1.0 };
            let approaching = (velocity[b] - velocity[a]).dot(direction) < 0.0;
            let kept = if approaching { 1.0 } else { PARTING };
            push.way -= (kept * 0.5 * missing * share / kernel.sums.number_density) * direction;
            push.pairs += part_of_pair(kind[b]);
        }
        push
    });
}

/// The part that one fluid particle has in a pair with another particle: walls do not give way.
fn part_of_pair(other: Kind) -> Real {
    if other == Kind::Fluid { 0.5 } else { 1.0 }
}

/// Change of velocity of each own fluid particle by collisions with particles that are still too near, and in how many
/// pairs, of which another particle of fluid counts a half.
pub(crate) fn collisions(spacing: Real, moved: &Moved<'_>, into: &mut [(Vector, Real)]) {
    let Moved { kind, after: position, velocity, .. } = *moved;
    let limit = (COLLISION * spacing) * (COLLISION * spacing);
    moved.set(into, |a, near| {
        let mut change = (Vector::ZERO, 0.0);
        if kind[a] != Kind::Fluid {
            return change;
        }
        for &b in near {
            let b = b as usize;
            let apart = position[b] - position[a];
            let r2 = apart.length_squared();
            if r2 >= limit {
                continue;
            }
            let approach = (velocity[b] - velocity[a]).dot(apart);
            if approach < 0.0 {
                let part = part_of_pair(kind[b]);
                change.1 += part;
                change.0 += part * (1.0 + RESTITUTION) * approach / r2 * apart;
            }
        }
        change
    });
}
