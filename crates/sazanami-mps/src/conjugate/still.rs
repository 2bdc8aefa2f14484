//! The pressure of water at rest, split off in water with grains, and in a box that is full of water.
//!
//! Where particles are not on a lattice, or not where the void fraction asks for them, the force `G p` of a pressure that is the same
//! everywhere is not zero: it pushes them apart, and water under its own weight does not come to rest. In a bed that is seepage, which
//! lifts grains. So the unknown is what the pressure has beyond `P`, a function of the height alone: with the hydrostatic pressure
//! `h = level + rho b.x`, `P` is `h` less a constant from 2.5 spacings below the level on, and zero above half a spacing. `P` acts by its
//! gradient in every row, with grains or without: that is a force that a pressure answers, and water at rest stays as it is whatever the
//! void fraction. Where `P` acts by its gradient in some rows and by `G P` in others, the two differ by a force that no pressure answers,
//! along every edge between them: it stirred still water around sparse grains to a third of `sqrt(g H)`.
//!
//! Near the surface the whole pressure acts by `G p`, which vanishes beyond the outermost particles as in clear water. What is left of
//! the pressure below, that of 1.5 spacings, pushes particles to sparse places. It must be nowhere negative: it would pull particles
//! apart from one another where the surface has sunk, and the water swells. So the level is the lowest of the pressure of the step before, beyond
//! `rho b.x`, and not its mean; and it is not above the surface, where an impact has left a high pressure. Rows beside a cavity far below the
//! level keep `G P` and `C P`: it would not close otherwise. In a closed box, where a pressure has no level of its own, `P = h` with the mean
//! level.
//!
//! Only walls answer the gradient of `P`, which is no force between particles. Nothing bears water that falls: where all rows that see no
//! surface lie above the level, nothing is split off.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::operators::{COMPACT, Operators};
use super::voids::Bulk;
use crate::context::Context;
use crate::ghosts::Ghosts;
use crate::matrix::{Block, Row};
use crate::neighbours::ROWS;
use crate::particles::{Kind, Particles};
use crate::reductions::{largest, set_column, sum_of};

/// Force of a pressure that is the same everywhere, times the spacing, below which an arrangement counts as near a lattice.
const LEAST_FORCE: Real = 0.1;

/// Depths below the level from which on a pressure is split off, and from which on with its whole gradient, in spacings. With 1 and 3,
/// and the more with more, what is left stirs still water (twice to four times the speed around three held grains).
const FROM: Real = 0.5;
const WHOLE: Real = 2.5;
/// Depth from which on a row that sees a surface sees that of a cavity, in spacings.
const CAVITY: Real = 4.0;
/// Most that the level lies above the highest row that sees no surface, beyond the radius of influence, in spacings: at rest some half.
const HIGHEST: Real = 1.4;

/// The split-off pressure as a function of the hydrostatic one.
#[derive(Clone, Copy)]
struct Split {
    /// Whether it is the hydrostatic one.
    linear: bool,
    /// Hydrostatic pressure of one spacing \[Pa].
    unit: Real,
}

impl Split {
    /// For the `hydrostatic` pressure \[Pa].
    fn pressure(&self, hydrostatic: Real) -> Real {
        let [from, whole] = [FROM, WHOLE].map(|depth| depth * self.unit);
        match hydrostatic {
            h if self.linear => h,
            h if h <= from => 0.0,
            h if h >= whole => h - 0.5 * (from + whole),
            h => 0.5 * (h - from).powi(2) / (whole - from),
        }
    }

    /// Its derivative.
    fn slope(&self, hydrostatic: Real) -> Real {
        let [from, whole] = [FROM, WHOLE].map(|depth| depth * self.unit);
        match hydrostatic {
            _ if self.linear => 1.0,
            h if h <= from => 0.0,
            h if h >= whole => 1.0,
            h => (h - from) / (whole - from),
        }
    }
}

/// Columns over particles and ghosts.
#[derive(Debug, Default)]
pub(crate) struct Still {
    /// Whether a pressure is split off in this step.
    pub splits: bool,
    /// Whether a row has the gradient of `P` and not its force.
    exact: Vec<bool>,
    /// `P` \[Pa].
    pressure: Vec<Real>,
    /// What acts of it [Pa/m].
    pub gradient: Vec<Vector>,
    ways: Vec<Vector>,
    divergence: Vec<Real>,
    one: Vec<Real>,
    /// Velocity changes of [`Self::press`] [m/s].
    pub pressed: Vec<Vector>,
}

impl Still {
    /// Splits `P` off the pressure of the step before, where there are grains or the box is `closed`; its level is the lowest of that
    /// pressure beyond `rho b.x` in the rows that see no surface, in a closed box the mean.
    pub fn split(
        &mut self,
        step: &Context<'_>,
        closed: bool,
        (operators, bulk): (&Operators<'_>, &Bulk<'_>),
        (blocks, rows): (&[Block], &[Row]),
        particles: &mut Particles,
        ghosts: &mut Ghosts,
    ) {
        self.splits = closed || !bulk.clear;
        if !self.splits {
            return;
        }
        let Particles { kind, position, pressure, owned, .. } = particles;
        let (kind, position, owned) = (&kind[..], &position[..], *owned);
        let force = step.settings.fluid.density * step.still_force();
        let old = &pressure[..];
        let beyond = |a: usize| old[a] - force.dot(position[a]);
        let inside = |a: usize| kind[a] == Kind::Fluid && !rows[a].beside_surface;
        let [sum, number] = step.domain.sum(sum_of(owned, |a| if inside(a) { [beyond(a), 1.0] } else { [0.0; 2] }));
        let of_depth = Split { linear: closed, unit: step.settings.fluid.spacing * force.length() };
        let most = |of: &(dyn Fn(usize) -> Real + Sync)| {
            step.domain.max(largest(owned, |a| if inside(a) { of(a) } else { Real::NEG_INFINITY }))
        };
        let level = if closed {
            sum / number
        } else {
            let highest = step.settings.scheme.radius + HIGHEST;
            let at_surface = most(&|a| -force.dot(position[a])) + highest * of_depth.unit;
            at_surface.min(-most(&|a| -beyond(a)))
        };
        let deepest = level + most(&|a| force.dot(position[a]));
        self.splits = number > 0.0 && (closed || deepest > FROM * of_depth.unit);
        if !self.splits {
            return;
        }
        let hydrostatic = |a: usize| level + force.dot(position[a]);
        let cavity = |a: usize| rows[a].beside_surface && hydrostatic(a) > CAVITY * of_depth.unit;
        set_column(&mut self.exact, owned, |a| kind[a] == Kind::Fluid && (closed || !cavity(a)));
        let exact = &self.exact[..];
        let at = |a: usize| if kind[a] == Kind::Fluid { of_depth.pressure(hydrostatic(a)) } else { 0.0 };
        set_column(&mut self.pressure, kind.len(), at);
        ghosts.refresh(step.domain, &mut self.pressure);
        let still = &self.pressure[..];
        self.gradient.resize(kind.len(), Vector::ZERO);
        operators.force(blocks, still, &mut self.gradient[..owned], |into, a, found| {
            *into = if exact[a] { of_depth.slope(hydrostatic(a)) * force } else { found };
        });
        ghosts.refresh(step.domain, &mut self.gradient);
        for_each_chunk(&mut pressure[..], ROWS, |number, pressure| {
            pressure.iter_mut().zip(&still[number * ROWS..]).for_each(|(p, still)| *p -= still);
        });
    }

    /// Takes what `P` does from the right sides of the `rows`. For a linear pressure both parts of the matrix
    /// `(1 - a) D m D^T + a C` are `-div(eps m rho b)/eps`: so rows that have its gradient take them.
    pub fn take_from(&mut self, (operators, bulk): (&Operators<'_>, &Bulk<'_>), blocks: &[Block], rows: &mut [Row]) {
        if !self.splits {
            return;
        }
        let Self { exact, pressure, gradient, ways, divergence, .. } = self;
        let gradient = &gradient[..];
        set_column(ways, gradient.len(), |a| bulk.own(a) * gradient[a]);
        divergence.resize(rows.len(), 0.0);
        operators.divergence(blocks, ways, true, divergence);
        let (exact, pressure, divergence) = (&exact[..], &pressure[..], &divergence[..]);
        for_each_chunk(rows, ROWS, |number, rows| {
            for (row, entry) in rows.iter_mut().enumerate().filter(|(_, entry)| entry.diagonal > 0.0) {
                let a = number * ROWS + row;
                let [.., near] = operators.pairs.differences(blocks, a, |b| [0.0, 0.0, 0.0, pressure[b]]);
                let compact = (entry.diagonal - operators.sums[a][3]) * pressure[a] - near;
                let compact = if exact[a] { divergence[a] } else { -compact };
                entry.right += (1.0 - COMPACT) * divergence[a] + COMPACT * compact;
            }
        });
    }

    /// Takes the sum of the right sides of the `rows` of a closed box away, by the force of a pressure that is the same everywhere,
    /// on the water alone and without its mean along periodic directions: no momentum comes from it but that of walls.
    ///
    /// Nothing fixes the level of that pressure, and on a lattice it has no force. Off it, its force pushes particles to where they
    /// are sparse, and takes about the smallest change of velocity that leaves no mean divergence, which other pressures cannot do: with
    /// one all water is compressed a little, step after step, while a gap opens somewhere. Near a lattice it is less than that: what the
    /// error of the sums asks for there would take the energy of a flow.
    pub fn press(
        &mut self,
        step: &Context<'_>,
        operators: &Operators<'_>,
        (blocks, rows): (&[Block], &mut [Row]),
        kind: &[Kind],
        ghosts: &mut Ghosts,
    ) {
        let Self { one, pressed, divergence, .. } = self;
        let owned = rows.len();
        set_column(one, kind.len(), |a| if kind[a] == Kind::Fluid { 1.0 } else { 0.0 });
        pressed.resize(kind.len(), Vector::ZERO);
        operators.force(blocks, one, &mut pressed[..owned], |into, _, found| *into = found);
        let (fluid, force) = (&one[..], &pressed[..]);
        let [x, y, z, number] = step.domain.sum(sum_of(owned, |a| {
            let force = fluid[a] * force[a];
            [force.x, force.y, force.z, fluid[a]]
        }));
        let periodic = step.periods.length.cmpgt(Vector::ZERO);
        let mean = Vector::select(periodic, Vector::new(x, y, z) / number.max(1.0), Vector::ZERO);
        for_each_chunk(&mut pressed[..owned], ROWS, |number, pressed| {
            pressed.iter_mut().zip(&fluid[number * ROWS..]).for_each(|(force, is)| *force = *is * (*force - mean));
        });
        ghosts.refresh(step.domain, pressed);
        divergence.resize(owned, 0.0);
        operators.divergence(blocks, pressed, true, divergence);
        let (force, seen) = (&pressed[..], &*rows);
        let [sum, taken, number] = step.domain.sum(sum_of(owned, |a| {
            if seen[a].diagonal > 0.0 { [seen[a].right, force[a].length_squared(), 1.0] } else { [0.0; 3] }
        }));
        let least = (LEAST_FORCE / step.settings.fluid.spacing).powi(2);
        let level = sum / (taken + number.max(1.0) * least);
        let divergence = &divergence[..];
        for_each_chunk(rows, ROWS, |number, rows| {
            for (row, entry) in rows.iter_mut().enumerate().filter(|(_, entry)| entry.diagonal > 0.0) {
                entry.right += level * divergence[number * ROWS + row];
            }
        });
        let factor = -step.dt / step.settings.fluid.density * level;
        for_each_chunk(&mut pressed[..owned], ROWS, |_, pressed| {
            pressed.iter_mut().for_each(|change| *change *= factor);
        });
    }

    /// The whole pressure, and its gradient at each particle, from what was solved for.
    pub fn restore(&self, pressure: &mut [Real], gradient: &mut [Vector]) {
        if !self.splits {
            return;
        }
        for_each_chunk(pressure, ROWS, |number, pressure| {
            pressure.iter_mut().zip(&self.pressure[number * ROWS..]).for_each(|(p, still)| *p += still);
        });
        for_each_chunk(gradient, ROWS, |number, gradient| {
            gradient.iter_mut().zip(&self.gradient[number * ROWS..]).for_each(|(g, still)| *g += *still);
        });
    }
}
