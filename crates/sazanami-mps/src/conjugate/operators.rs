//! Divergence `D` and pressure force `G = -D^T`, and the product with the matrix of the pressure equation.
//!
//! With `g_ij = s_ij r_ij`, `s_ij = -w'/(r N1)` and `B_i` the inverse of `M_i = sum g_ij r_ij^T`,
//! `D_i u = sum (u_j - u_i).B_i g_ij` is exact for linear velocities, and `G_i p = sum (B_i p_i + B_j p_j) g_ij` pushes
//! both particles of a pair equally. Sums run over particles and their images in walls, which carry the mirrored `u` and
//! `B`. Water between grains is in [`super::voids`]. See `docs/decisions/0018-scheme-of-moving-particles.md`.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::pairs::{Pairs, four, three};
use super::voids::Bulk;
use crate::ghosts::Ghosts;
use crate::matrix::{Block, Layout, Row};
use crate::neighbours::ROWS;
use crate::pressure_system::{Product, subtract_mean};

/// Part of the compact matrix in that of the pressure equation.
pub(super) const COMPACT: Real = 0.5;

/// Pairs with their coefficients.
#[derive(Clone, Copy)]
pub(crate) struct Operators<'a> {
    pub pairs: &'a Pairs,
    /// Sum of the coefficients of `D` at each own particle [1/m], and that of the compact matrix [1/m^2].
    pub sums: &'a [[Real; 4]],
    /// `(grad eps)/eps` at each own particle, by whole blocks [1/m].
    pub slope: &'a [Vector],
}

impl Operators<'_> {
    /// Sets the divergence of a velocity [m/s] at each own particle [1/s], with its rate along slopes of the void fraction
    /// if they are `sloping`; ghosts of the velocity are up to date.
    pub fn divergence(&self, blocks: &[Block], velocity: &[Vector], sloping: bool, into: &mut [Real]) {
        for_each_chunk(into, ROWS, |number, into| {
            for (row, into) in into.iter_mut().enumerate() {
                let a = number * ROWS + row;
                let at = |a: usize| [velocity[a].x, velocity[a].y, velocity[a].z, 0.0];
                let [x, y, z, _] = self.pairs.differences(blocks, a, at);
                *into = x + y + z + if sloping { self.slope[a].dot(velocity[a]) } else { 0.0 };
            }
        });
    }

    /// Calls `set` with an entry of `into` for each own particle and its `G p` [Pa/m]; ghosts of the pressure \[Pa] are up
    /// to date.
    pub fn force<T: Send>(
        &self,
        blocks: &[Block],
        pressure: &[Real],
        into: &mut [T],
        set: impl Fn(&mut T, usize, Vector) + Sync,
    ) {
        self.set_force(blocks, pressure, into, |into, a, force| set(into, a, three(force)));
    }

    /// The same with a zero behind each force.
    fn set_force<T: Send>(
        &self,
        blocks: &[Block],
        pressure: &[Real],
        into: &mut [T],
        set: impl Fn(&mut T, usize, [Real; 4]) + Sync,
    ) {
        for_each_chunk(into, ROWS, |number, into| {
            for (row, into) in into.iter_mut().enumerate() {
                let a = number * ROWS + row;
                let [x, y, z, zero] = self.pairs.gathered(blocks, a, pressure);
                let own = three(self.sums[a]) - self.slope[a];
                set(into, a, four(pressure[a] * own + Vector::new(x, y, z), zero));
            }
        });
    }
}

/// `(1 - a) D m D^T + a C`, with the compact matrix `C` in the rows of the equation and `m` the motion of fluid and grains
/// over that of the fluid.
pub(crate) struct Conjugate<'a> {
    pub operators: Operators<'a>,
    /// Work space: the force and the pressure at each particle, ghosts included.
    pub force: &'a mut [[Real; 4]],
    pub bulk: Bulk<'a>,
    /// Number of unknowns where nothing fixes the level of the pressure: products are then without their mean.
    pub without_level: Option<Real>,
}

impl Product for Conjugate<'_> {
    fn up_to_constant(&self) -> bool {
        self.without_level.is_some()
    }

    fn multiply(
        &mut self,
        layout: &Layout<'_>,
        ghosts: &mut Ghosts,
        (blocks, rows): (&mut [Block], &[Row]),
        d: &[Real],
        q: &mut [Real],
    ) {
        let Self { operators, force, bulk, without_level } = self;
        let set = |into: &mut [Real; 4], a: usize, [x, y, z, zero]: [Real; 4]| {
            let own = bulk.own(a);
            *into = [own * x, own * y, own * z, d[a] + zero];
        };
        operators.set_force(blocks, d, &mut force[..layout.owned], set);
        ghosts.refresh(layout.domain, force);
        let (blocks, force) = (&*blocks, &force[..]);
        for_each_chunk(&mut q[..layout.owned], ROWS, |number, q| {
            for (row, q) in q.iter_mut().enumerate() {
                let a = number * ROWS + row;
                let [x, y, z, near] = operators.pairs.differences(blocks, a, |b| force[b]);
                let missing = rows[a].diagonal - operators.sums[a][3];
                let along = operators.slope[a].dot(Vector::from_slice(&force[a][..3]));
                *q = COMPACT * (missing * d[a] - near) - (1.0 - COMPACT) * (x + y + z + along);
            }
        });
        if let Some(unknowns) = *without_level {
            subtract_mean(layout, &mut q[..layout.owned], unknowns);
        }
    }
}
