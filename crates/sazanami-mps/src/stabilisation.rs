//! Dynamic stabilisation (DS) and collisions: repulsion of particles that the pressure left too close.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::context::{Context, Motion};
use crate::ghosts::Ghosts;
use crate::matrix::{Block, CLOSE_RADIUS};
use crate::neighbours::ROWS;
use crate::particles::Kind;
use crate::reductions::{largest, set_column, sum_of};
use crate::scheme::{Kernel, STABILISATION_DISTANCE};

/// Distance over the particle spacing below which a pair collides.
const COLLISION: Real = 0.5;
/// Coefficient of restitution of a collision.
const RESTITUTION: Real = 0.2;
/// Factor on the repulsion of a pair that already separates (`docs/decisions/0007-shaken-tanks.md`).
const SEPARATING: Real = 0.2;

/// Outcome of the stabilisation, over all ranks.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StabilisationReport {
    /// Pairs on which it acted.
    pub pairs: usize,
    /// Work done \[J].
    pub work: Real,
}

/// Particles at their predicted positions, ghosts included.
#[derive(Clone, Copy)]
pub(crate) struct Pairs<'a> {
    pub kind: &'a [Kind],
    pub owned: usize,
    /// Predicted positions \[m].
    pub position: &'a [Vector],
    /// Inverse void fraction.
    pub inverse_void: &'a [Real],
    pub blocks: &'a [Block],
}

/// Dynamic stabilisation and collisions of a step.
#[derive(Debug, Default)]
pub(crate) struct Stabiliser {
    size: Vec<Real>,
    repulsions: Vec<Repulsion>,
    collisions: Vec<(Vector, Real)>,
    /// Whether the lists of close neighbours contain all pairs that can be too close.
    close: bool,
    /// Square of the smallest distance of a pair, over all ranks; 0 if unknown [m^2].
    nearest: Real,
}

impl Stabiliser {
    /// Repels the pairs that the pressure correction left too close in `new`.
    pub fn stabilise(
        &mut self,
        step: &Context<'_>,
        pairs: &Pairs<'_>,
        ghosts: &mut Ghosts,
        new: &mut Motion,
    ) -> StabilisationReport {
        let Context { domain, kernel, settings, dt, flow_time, .. } = *step;
        let Self { size, repulsions, close, nearest, .. } = self;
        let Pairs { kind, owned, position: before, inverse_void, blocks } = *pairs;
        let spacing = settings.fluid.spacing;
        sizes(spacing, kind, inverse_void, size);
        let longest = largest(owned, |a| (new.position[a] - before[a]).length_squared());
        let longest = domain.max(longest.max(0.0)).sqrt();
        *close = 2.0 * longest + widest(spacing) < CLOSE_RADIUS * spacing;
        *nearest = 0.0;
        let Motion { position: after, velocity } = new;
        repulsions.resize(owned, Repulsion::default());
        let moved = Moved { kind, before, after, velocity, size, blocks, close: *close };
        find_repulsions(kernel, STABILISATION_DISTANCE, spacing, &moved, repulsions);
        let (rate, mass, repulsions) = (dt / (flow_time * flow_time), step.particle_mass(), &repulsions[..]);
        let sums = sum_of(owned, |a| {
            let change = rate * repulsions[a].displacement;
            [repulsions[a].pairs, mass * change.dot(velocity[a] + 0.5 * change)]
        });
        *nearest = domain.min(-largest(owned, |a| -repulsions[a].nearest));
        for_each_chunk((&mut velocity[..owned], &mut after[..owned]), ROWS, |number, (velocity, after)| {
            let repulsions = &repulsions[number * ROWS..];
            for ((u, x), push) in velocity.iter_mut().zip(after).zip(repulsions).filter(|(_, push)| push.pairs > 0.0) {
                *u += rate * push.displacement;
                *x += dt * rate * push.displacement;
            }
        });
        new.refresh(domain, ghosts);
        let [pairs, work] = domain.sum(sums);
        StabilisationReport { pairs: pairs.round() as usize, work }
    }

    /// Lets pairs collide that are still too close; returns their number over all ranks.
    pub fn collide(&mut self, step: &Context<'_>, pairs: &Pairs<'_>, new: &mut Motion) -> usize {
        let Self { size, collisions, close, nearest, .. } = self;
        let Pairs { kind, owned, position: before, blocks, .. } = *pairs;
        let spacing = step.settings.fluid.spacing;
        // Stabilisation moves by less than a tenth of a spacing: pairs farther apart cannot collide.
        if *nearest >= (0.7 * spacing) * (0.7 * spacing) {
            return 0;
        }
        collisions.resize(owned, (Vector::ZERO, 0.0));
        let Motion { position: after, velocity } = new;
        let moved = Moved { kind, before, after, velocity, size, blocks, close: *close };
        find_collisions(spacing, &moved, collisions);
        let collisions = &collisions[..];
        for_each_chunk(&mut velocity[..owned], ROWS, |number, velocity| {
            velocity.iter_mut().zip(&collisions[number * ROWS..]).for_each(|(u, (change, _))| *u += *change);
        });
        step.domain.sum(sum_of(owned, |a| [collisions[a].1]))[0].round() as usize
    }
}

/// Positions before and after the pressure correction and velocities after it, ghosts included.
struct Moved<'a> {
    kind: &'a [Kind],
    before: &'a [Vector],
    after: &'a [Vector],
    velocity: &'a [Vector],
    /// Particle size: the edge of its bulk volume `l0^3/eps` \[m].
    size: &'a [Real],
    blocks: &'a [Block],
    /// Whether the lists of close neighbours contain all pairs that can be too close.
    close: bool,
}

impl Moved<'_> {
    /// Sets the entry of each own particle in `column` from the neighbours that may be too close.
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

/// Edge of the bulk volume `l0^3/eps` of each particle \[m].
fn sizes(spacing: Real, kind: &[Kind], inverse_void: &[Real], into: &mut Vec<Real>) {
    set_column(into, kind.len(), |a| {
        let plain = kind[a] != Kind::Fluid || inverse_void[a] == 1.0;
        if plain { spacing } else { spacing * inverse_void[a].cbrt() }
    });
}

/// Largest particle size \[m].
fn widest(spacing: Real) -> Real {
    1.5 * spacing
}

/// Stabilisation of one particle.
#[derive(Clone, Copy, Debug, Default)]
struct Repulsion {
    /// Acceleration times the square of [`crate::stability::flow_time`]: a displacement \[m].
    displacement: Vector,
    /// Square of the distance to the nearest neighbour [m^2].
    nearest: Real,
    /// Number of pairs too close; a pair of fluid particles counts one half at each of them.
    pairs: Real,
}

/// Repels each own fluid particle from neighbours nearer than `distance` mean sizes of the pair (Tsuruta et al. 2013).
///
/// A pair that is too close after the pressure correction is accelerated along its direction before the correction so
/// that each particle would move by half of the overlap within [`crate::stability::flow_time`], times `w/n0`; by
/// [`SEPARATING`] of that where the pair separates already, so that on disordered arrangements the repulsion extracts
/// more energy than it supplies.
fn find_repulsions(kernel: &Kernel, distance: Real, spacing: Real, moved: &Moved<'_>, into: &mut [Repulsion]) {
    let Moved { kind, before, after, velocity, size, .. } = *moved;
    let limit = widest(spacing) * widest(spacing);
    moved.set(into, |a, near| {
        let mut push = Repulsion { nearest: Real::INFINITY, ..Repulsion::default() };
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
            let least = distance * 0.5 * (mine + size[b]);
            if r2 >= least * least {
                continue;
            }
            let direction = (before[b] - before[a]).normalize_or_zero();
            let along = apart.dot(direction);
            let across = (r2 - along * along).max(0.0);
            let missing = (least * least - across).sqrt() - along;
            let share = kernel.weight.value(r2.sqrt());
            let approaching = (velocity[b] - velocity[a]).dot(direction) < 0.0;
            let factor = if approaching { 1.0 } else { SEPARATING };
            push.displacement -= (factor * 0.5 * missing * share / kernel.sums.number_density) * direction;
            push.pairs += share_of_pair(kind[b]);
        }
        push
    });
}

/// Share of a fluid particle in a pair: one half with another fluid particle, all of it with a wall.
fn share_of_pair(other: Kind) -> Real {
    if other == Kind::Fluid { 0.5 } else { 1.0 }
}

/// Velocity change of each own fluid particle by collisions with particles that are still too close, and the number of
/// its pairs; a pair of fluid particles counts one half at each of them.
fn find_collisions(spacing: Real, moved: &Moved<'_>, into: &mut [(Vector, Real)]) {
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
                let share = share_of_pair(kind[b]);
                change.1 += share;
                change.0 += share * (1.0 + RESTITUTION) * approach / r2 * apart;
            }
        }
        change
    });
}
