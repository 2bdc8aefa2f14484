//! What keeps particles apart when the pressure does not: stabilisation (DS) and, at last, collisions.

use sazanami_numerics::{Real, Vector};

use crate::neighbours::Neighbours;
use crate::particles::Kind;
use crate::scheme::{Kernel, Stabilisation};

/// Distance over the particle spacing below which particles bounce off each other.
const COLLISION: Real = 0.5;
/// Part of the speed that they keep.
const RESTITUTION: Real = 0.2;

/// Places before and after the pressure's correction, ghosts included.
pub(crate) struct Moved<'a> {
    pub kind: &'a [Kind],
    pub before: &'a [Vector],
    pub after: &'a [Vector],
    pub bulk: &'a [Real],
}

/// What stabilisation does to a particle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Push {
    /// Acceleration times the square of the longest step of water at rest: a displacement [m].
    pub way: Vector,
    /// Square of the distance to the nearest neighbour [m^2].
    pub nearest: Real,
    /// Neighbours too near.
    pub pairs: u32,
}

/// Pushes each own fluid particle from neighbours that came too near (Tsuruta et al. 2013).
///
/// A pair at `r` after the correction that is nearer than it may be is pushed along its direction `e` before the
/// correction, each so that the longest step of water at rest would move it by half of what is missing, times `w/n0`.
pub(crate) fn pushes(
    kernel: &Kernel,
    settings: &Stabilisation,
    spacing: Real,
    neighbours: &Neighbours,
    moved: &Moved<'_>,
    into: &mut [Push],
) {
    let Moved { kind, before, after, bulk } = *moved;
    let size = |a: usize| if kind[a] == Kind::Fluid { spacing * bulk[a].cbrt() } else { spacing };
    neighbours.set(into, |a, near| {
        let mut push = Push { nearest: Real::INFINITY, ..Push::default() };
        if kind[a] != Kind::Fluid {
            return push;
        }
        let mine = size(a);
        for &b in near {
            let b = b as usize;
            let apart = after[b] - after[a];
            let r2 = apart.length_squared();
            // The widest particles are 1.5 spacings wide.
            if r2 > (1.5 * spacing) * (1.5 * spacing) || kind[b] == Kind::Dummy {
                continue;
            }
            push.nearest = push.nearest.min(r2);
            let least = settings.distance * 0.5 * (mine + size(b));
            if r2 >= least * least {
                continue;
            }
            let direction = (before[b] - before[a]).normalize_or_zero();
            let along = apart.dot(direction);
            let across = (r2 - along * along).max(0.0);
            let missing = (least * least - across).sqrt() - along;
            let share = if settings.weighted { kernel.weight.value(r2.sqrt()) } else { 1.0 };
            push.way -= (0.5 * missing * share / kernel.sums.number_density) * direction;
            push.pairs += 1;
        }
        push
    });
}

/// Change of velocity of each own fluid particle by collisions with particles that are still too near, and with
/// how many.
pub(crate) fn collisions(
    spacing: Real,
    neighbours: &Neighbours,
    kind: &[Kind],
    position: &[Vector],
    velocity: &[Vector],
    into: &mut [(Vector, u32)],
) {
    let limit = (COLLISION * spacing) * (COLLISION * spacing);
    neighbours.set(into, |a, near| {
        let mut change = (Vector::ZERO, 0);
        if kind[a] != Kind::Fluid {
            return change;
        }
        for &b in near {
            let b = b as usize;
            let apart = position[b] - position[a];
            let r2 = apart.length_squared();
            if r2 >= limit || kind[b] == Kind::Dummy {
                continue;
            }
            change.1 += 1;
            let approach = (velocity[b] - velocity[a]).dot(apart);
            if approach < 0.0 {
                // Walls do not give way.
                let part = if kind[b] == Kind::Fluid { 0.5 } else { 1.0 };
                change.0 += part * (1.0 + RESTITUTION) * approach / r2 * apart;
            }
        }
        change
    });
}
