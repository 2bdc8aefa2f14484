//! The pressure equation of the particles as conjugate gradients see it: its products and its preconditioner.

use sazanami_numerics::Real;
use sazanami_numerics::linear::System;
use sazanami_parallel::{Rows, for_each_chunk, max_over};

use crate::coarse::CoarseGrid;
use crate::ghosts::Ghosts;
use crate::matrix::{Block, Layout, Row};
use crate::neighbours::ROWS;
use crate::particles::Role;
use crate::reductions::sum_of;

/// A product with the matrix of the equation.
pub(crate) trait Product {
    /// Whether pressures are determined up to a constant where none is prescribed.
    fn up_to_constant(&self) -> bool;

    /// `q = A d`, with `d` zero outside and up to date at ghosts.
    fn multiply(
        &mut self,
        layout: &Layout<'_>,
        ghosts: &mut Ghosts,
        matrix: (&mut [Block], &[Row]),
        d: &[Real],
        q: &mut [Real],
    );
}

/// The matrix whose coefficients are stored.
pub(crate) struct Compact;

/// The system of a step as conjugate gradients solve it; residuals are measured as volume strains in the step.
pub(crate) struct ParticleSystem<'a, P> {
    pub matrix: &'a mut P,
    pub layout: &'a Layout<'a>,
    pub ghosts: &'a mut Ghosts,
    pub blocks: &'a mut [Block],
    pub rows: &'a [Row],
    pub coarse: &'a mut CoarseGrid,
    pub pressure: &'a mut [Real],
    pub residual: &'a mut [Real],
    pub step: &'a mut [Real],
    pub direction: &'a mut [Real],
    pub product: &'a mut [Real],
    /// Converts a residual into a volume strain.
    pub strain: Real,
    pub unknowns: Real,
    pub singular: bool,
    /// Product of residual and preconditioned residual one iteration ago.
    pub before: Option<Real>,
}

impl<P: Product> System for ParticleSystem<'_, P> {
    fn evaluate(&mut self) -> Real {
        let Self { matrix, layout, ghosts, blocks, rows, pressure, residual, .. } = self;
        ghosts.refresh(layout.domain, pressure);
        self.before = None;
        matrix.multiply(layout, ghosts, (blocks, rows), pressure, residual);
        layout.domain.max(subtract_from_right(layout, rows, residual)) * self.strain
    }

    fn advance(&mut self, _last: bool) -> Result<Real, Real> {
        let Self { matrix, layout, ghosts, blocks, rows, coarse, pressure, residual, step, direction, product, .. } =
            self;
        let Layout { domain, roles, owned, .. } = **layout;
        let padded = blocks.len() * ROWS;
        // z = M^-1 r
        coarse.correct(layout, residual, step);
        add_diagonal(rows, residual, step);
        if self.singular {
            subtract_mean(layout, step, self.unknowns);
        }
        let [descent] = domain.sum(sum_of(padded, |a| [residual[a] * step[a]]));
        let beta = self.before.map_or(0.0, |before| descent / before);
        self.before = Some(descent);
        for_each_chunk((&mut direction[..padded], &mut step[..]), ROWS, |_, (p, z)| {
            p.iter_mut().zip(z).for_each(|(p, z)| *p = *z + beta * *p);
        });
        // Entries behind the own particles are ghosts, also those that pad the last block.
        direction[owned..padded.min(roles.len())].fill(0.0);
        ghosts.refresh(domain, &mut direction[..roles.len()]);
        matrix.multiply(layout, ghosts, (blocks, rows), direction, product);
        let [curvature] = domain.sum(sum_of(padded, |a| if a < owned { [direction[a] * product[a]] } else { [0.0] }));
        if !(descent.is_finite() && curvature.is_finite()) {
            return Err(Real::NAN);
        }
        if descent <= 0.0 || curvature <= 0.0 {
            return Err(curvature);
        }
        let alpha = descent / curvature;
        let own = &direction[..owned];
        for_each_chunk(&mut pressure[..owned], ROWS, |number, p| {
            p.iter_mut().zip(&own[number * ROWS..]).for_each(|(p, d)| *p += alpha * d);
        });
        for_each_chunk((&mut residual[..], &mut product[..]), ROWS, |_, (r, q)| {
            r.iter_mut().zip(q).for_each(|(r, q)| *r -= alpha * *q);
        });
        let size = max_over(blocks.len(), |n| {
            residual[n * ROWS..(n + 1) * ROWS].iter().fold(0.0, |m: Real, r| m.max(r.abs()))
        });
        Ok(domain.max(size) * self.strain)
    }
}

/// `r = b - A p` from the product `A p` in `r`; returns the largest.
pub(crate) fn subtract_from_right(layout: &Layout<'_>, rows: &[Row], r: &mut [Real]) -> Real {
    let owned = layout.owned;
    for_each_chunk(&mut *r, ROWS, |number, r| {
        for (n, r) in r.iter_mut().enumerate() {
            let a = number * ROWS + n;
            if a < owned && rows[a].diagonal > 0.0 {
                *r = rows[a].right - *r;
            }
        }
    });
    let r = &*r;
    max_over(r.len() / ROWS, |n| r[n * ROWS..(n + 1) * ROWS].iter().fold(0.0, |m: Real, r| larger(m, r.abs())))
}

/// The larger of two numbers; NaN if `b` is NaN.
fn larger(a: Real, b: Real) -> Real {
    if b.is_nan() || a < b { b } else { a }
}

impl Product for Compact {
    fn up_to_constant(&self) -> bool {
        true
    }

    fn multiply(
        &mut self,
        layout: &Layout<'_>,
        _: &mut Ghosts,
        (blocks, rows): (&mut [Block], &[Row]),
        d: &[Real],
        q: &mut [Real],
    ) {
        let owned = layout.owned;
        for_each_chunk((blocks, Rows { data: q, width: ROWS }), 1, |number, (block, q)| {
            for (row, q) in q.data.iter_mut().enumerate() {
                let a = number * ROWS + row;
                *q = 0.0;
                if a < owned && rows[a].diagonal > 0.0 {
                    let (columns, coefficients) = block[0].row(row);
                    *q = rows[a].diagonal * d[a] - gathered(columns, coefficients, d);
                }
            }
        });
    }
}

/// `sum c_b d_b`, in four partial sums.
#[inline(always)]
fn gathered(columns: &[u32], coefficients: &[f32], d: &[Real]) -> Real {
    let mut sums = [0.0; 4];
    let (columns4, coefficients4) = (columns.chunks_exact(4), coefficients.chunks_exact(4));
    let rest = columns4.remainder().iter().zip(coefficients4.remainder());
    let tail: Real = rest.map(|(&b, &c)| Real::from(c) * d[b as usize]).sum();
    for (b, c) in columns4.zip(coefficients4) {
        for lane in 0..4 {
            sums[lane] += Real::from(c[lane]) * d[b[lane] as usize];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}

/// Adds `D^-1 r`.
fn add_diagonal(rows: &[Row], r: &[Real], z: &mut [Real]) {
    for_each_chunk(z, ROWS, |number, z| {
        for (n, z) in z.iter_mut().enumerate() {
            let a = number * ROWS + n;
            if rows[a].diagonal > 0.0 {
                *z += r[a] / rows[a].diagonal;
            }
        }
    });
}

/// Subtracts the mean over the unknowns.
pub(crate) fn subtract_mean(layout: &Layout<'_>, z: &mut [Real], unknowns: Real) {
    let [sum] = layout.domain.sum(sum_of(z.len(), |a| [z[a]]));
    let mean = sum / unknowns;
    for_each_chunk(&mut z[..layout.owned], ROWS, |number, z| {
        let unknown = z.iter_mut().zip(&layout.roles[number * ROWS..]).filter(|(_, role)| **role == Role::Unknown);
        unknown.for_each(|(z, _)| *z -= mean);
    });
}
