//! Divergence `D` and pressure force `G = -D^T`, and the product with the matrix of the pressure equation.
//!
//! With `g_ij = s_ij r_ij`, `s_ij = -w'/(r N1)` and `B_i` the inverse of `M_i = sum g_ij r_ij^T`,
//! `D_i u = sum (u_j - u_i).B_i g_ij` is exact for linear velocities, and `G_i p = sum (B_i p_i + B_j p_j) g_ij` pushes
//! both particles of a pair equally. Sums run over particles and their images in walls, which carry the mirrored `u` and
//! `B`. See `docs/decisions/0018-scheme-of-moving-particles.md`.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::pairs::{Neighbour, Pairs};
use crate::ghosts::Ghosts;
use crate::matrix::{Block, Layout, Row};
use crate::moments::Symmetric;
use crate::neighbours::ROWS;
use crate::pressure_system::{Compact, Product};

/// Part of the compact matrix in that of the pressure equation.
const COMPACT: Real = 0.5;

/// `matrix vector`.
#[inline(always)]
pub(crate) fn times(m: &Symmetric, v: Vector) -> Vector {
    Vector::new(
        m[0] * v.x + m[3] * v.y + m[4] * v.z,
        m[3] * v.x + m[1] * v.y + m[5] * v.z,
        m[4] * v.x + m[5] * v.y + m[2] * v.z,
    )
}

/// Pairs with the matrices `B` of every particle, ghosts included.
#[derive(Clone, Copy)]
pub(crate) struct Operators<'a> {
    pub pairs: &'a Pairs,
    pub inverse: &'a [Symmetric],
    /// `sum g_ij` of each own particle [1/m].
    pub sums: &'a [Vector],
}

impl Operators<'_> {
    /// Sets the divergence of `velocity` [m/s] at each own particle [1/s]; ghosts of the velocity are up to date.
    pub fn divergence(&self, blocks: &[Block], velocity: &[Vector], into: &mut [Real]) {
        for_each_chunk(into, ROWS, |number, into| {
            for (row, into) in into.iter_mut().enumerate() {
                *into = self.divergence_at(blocks, velocity, number * ROWS + row);
            }
        });
    }

    #[inline(always)]
    fn divergence_at(&self, blocks: &[Block], velocity: &[Vector], a: usize) -> Real {
        let own = velocity[a];
        let mut sums = [0.0; 6];
        for pair in self.pairs.of(blocks, a) {
            let (v, g) = (pair.seen(velocity[pair.particle]) - own, pair.slope);
            sums[0] += v.x * g.x;
            sums[1] += v.y * g.y;
            sums[2] += v.z * g.z;
            sums[3] += v.x * g.y + v.y * g.x;
            sums[4] += v.x * g.z + v.z * g.x;
            sums[5] += v.y * g.z + v.z * g.y;
        }
        sums.iter().zip(&self.inverse[a]).map(|(sum, b)| sum * b).sum()
    }

    /// Sets `G p` at each own particle [Pa/m]; ghosts of the pressure \[Pa] are up to date.
    pub fn force(&self, blocks: &[Block], pressure: &[Real], into: &mut [Vector]) {
        for_each_chunk(into, ROWS, |number, into| {
            for (row, into) in into.iter_mut().enumerate() {
                let a = number * ROWS + row;
                let mut sum = pressure[a] * times(&self.inverse[a], self.sums[a]);
                for pair in self.pairs.of(blocks, a) {
                    let Neighbour { particle: b, slope, .. } = pair;
                    sum += pressure[b] * pair.seen(times(&self.inverse[b], pair.seen(slope)));
                }
                *into = sum;
            }
        });
    }
}

/// `(1 - a) D D^T + a C`, with the compact matrix `C` in the rows of the equation.
pub(crate) struct Conjugate<'a> {
    pub operators: Operators<'a>,
    /// Work space for a force at each particle, ghosts included.
    pub force: &'a mut [Vector],
    /// Work space for a divergence at each own particle.
    pub divergence: &'a mut [Real],
}

impl Product for Conjugate<'_> {
    const UP_TO_CONSTANT: bool = false;

    fn multiply(
        &mut self,
        layout: &Layout<'_>,
        ghosts: &mut Ghosts,
        (blocks, rows): (&mut [Block], &[Row]),
        d: &[Real],
        q: &mut [Real],
    ) {
        let Self { operators, force, divergence } = self;
        Compact.multiply(layout, ghosts, (&mut *blocks, rows), d, q);
        operators.force(blocks, d, &mut force[..layout.owned]);
        ghosts.refresh(layout.domain, force);
        operators.divergence(blocks, force, divergence);
        let divergence = &divergence[..];
        for_each_chunk(&mut q[..layout.owned], ROWS, |number, q| {
            q.iter_mut()
                .zip(&divergence[number * ROWS..])
                .for_each(|(q, div)| *q = COMPACT * *q - (1.0 - COMPACT) * div);
        });
    }
}
