//! The pressure equation, `sum_j c_ij (p_j - p_i) = -(rho/dt) (source)`, and its solution.
//!
//! `c_ij = f_ij (1/eps_i + 1/eps_j) / (2 N2)`, with the Laplacian's weight `f`: the operator
//! `div(eps grad p)/eps` (with more where grains give way), symmetric to the last bit because both ends of a pair
//! evaluate the same expression.
//! Coefficients are stored in single precision, sums are in double. Conjugate gradients, preconditioned by the
//! diagonal plus a correction on a coarse grid, which is all it takes: neighbours are so many that the diagonal
//! alone rules everything shorter than the radius of influence.

use sazanami_numerics::domain::FailedElsewhere;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk, max_over};

use crate::coarse::CoarseGrid;
use crate::exchange::Exchange;
use crate::matrix::{Block, Layout, Row};
use crate::neighbours::ROWS;
use crate::particles::{Kind, Role};
use crate::reductions::sum_of;

/// When a solution is good enough, and how the solver gets there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Largest residual as a volume strain in a step.
    pub strain: Real,
    /// Most iterations.
    pub most_iterations: usize,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { strain: 1e-6, most_iterations: 500 }
    }
}

/// What a solve did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PressureReport {
    /// Iterations.
    pub iterations: usize,
    /// Largest residual as a volume strain in the step, from the solution itself.
    pub residual: Real,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Number of given pressures.
    pub given: usize,
    /// Mean of the right side that had to be taken out where no pressure is given, as a strain in the step.
    pub removed_mean: Real,
    /// Pairs whose coefficient was cut to zero.
    pub cut_coefficients: usize,
    /// Rows whose missing part beyond the surface was held to a whole side.
    pub held_rows: usize,
}

/// The pressure equation was not solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PressureError {
    /// The residual does not fall any more, or not fast enough.
    #[error(
        "the pressure was not found: after {iterations} iterations a strain of {residual:.3e} a step is left, \
         asked for {tolerance:.1e}"
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Residual reached, as a volume strain in the step.
        residual: Real,
        /// Residual asked for.
        tolerance: Real,
    },
    /// A number that is not finite came up.
    #[error("the pressure became a number that is not finite after {iterations} iterations")]
    NotFinite {
        /// Iterations done.
        iterations: usize,
    },
    /// Another rank failed.
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

/// The equation of the present step and all that its solution needs.
#[derive(Debug, Default)]
pub(crate) struct PressureEquation {
    pub blocks: Vec<Block>,
    pub rows: Vec<Row>,
    coarse: CoarseGrid,
    residual: Vec<Real>,
    step: Vec<Real>,
    direction: Vec<Real>,
    product: Vec<Real>,
}

impl PressureEquation {
    /// Room for the rows of `owned` particles.
    pub fn resize(&mut self, owned: usize) {
        self.blocks.resize_with(owned.div_ceil(ROWS), Block::default);
        self.rows.clear();
        self.rows.resize(self.blocks.len() * ROWS, Row::default());
    }

    /// Sums up the diagonal and finds the rows beside the surface.
    pub fn close(&mut self, roles: &[Role], owned: usize) {
        let rows = Rows { data: &mut self.rows[..], width: ROWS };
        for_each_chunk((&mut self.blocks[..], rows), 1, |number, (block, rows)| {
            for (row, entry) in rows.data.iter_mut().enumerate() {
                let a = number * ROWS + row;
                *entry = Row::default();
                if a >= owned || roles[a] != Role::Unknown {
                    continue;
                }
                let (columns, coefficients) = block[0].row(row);
                for (&b, &c) in columns.iter().zip(coefficients) {
                    let role = roles[b as usize];
                    if role != Role::Outside {
                        entry.diagonal += Real::from(c);
                    }
                    entry.beside_surface |= role == Role::Given;
                }
            }
        });
    }

    /// Gives rows beside the surface the neighbours that they lack beyond it. `lean` is the sum of a row's coefficients
    /// times the ways to its neighbours, where it is to be completed; `pressure` holds what is given.
    ///
    /// A sum over the neighbours that are there takes a pressure that rises into the water for a curved one: it is too
    /// large by the gradient times `lean`. The missing part is put where the neighbours with a given pressure lie on
    /// the mean, with the coefficient that makes a pressure exact which is linear in that direction. It only adds to the
    /// diagonal, so that the equation stays symmetric.
    pub fn complete(
        &mut self,
        roles: &[Role],
        place: &[Vector],
        pressure: &[Real],
        lean: impl Fn(usize) -> Option<Vector> + Sync,
    ) {
        let blocks = &self.blocks[..];
        for_each_chunk(&mut self.rows[..], ROWS, |number, rows| {
            for (n, row) in rows.iter_mut().enumerate().filter(|(_, row)| row.beside_surface) {
                let a = number * ROWS + n;
                let Some(lean) = lean(a) else { continue };
                let (columns, coefficients) = blocks[number].row(n);
                let (mut lean, mut way, mut given, mut weights) = (lean, Vector::ZERO, 0.0, 0.0);
                for (&b, &c) in columns.iter().zip(coefficients) {
                    let (b, c) = (b as usize, Real::from(c));
                    match roles[b] {
                        Role::Given => {
                            way += c * (place[b] - place[a]);
                            given += c * pressure[b];
                            weights += c;
                        }
                        // The row leaves these out: they support nothing.
                        Role::Outside => lean -= c * (place[b] - place[a]),
                        Role::Unknown => {}
                    }
                }
                // Coefficients to neighbours that are very near or far are zero.
                if weights <= 0.0 || way == Vector::ZERO {
                    continue;
                }
                let (way, given) = (way / weights, given / weights);
                // No more than a whole side: those with a given pressure may lie on both.
                let asked = -lean.dot(way) / way.length_squared();
                row.held = asked > row.diagonal;
                let missing = asked.min(row.diagonal);
                if missing > 0.0 {
                    row.diagonal += missing;
                    row.right += missing * given;
                }
            }
        });
    }

    /// Own pairs whose coefficient was cut to zero, and own rows that were held.
    pub fn limited(&self) -> [usize; 2] {
        let cut = self.blocks.iter().map(|block| block.cut).sum();
        [cut, self.rows.iter().filter(|row| row.held).count()]
    }

    /// Lets go of the water before walls that are `bare` of it: where such a wall particle has a lower pressure than
    /// the water around it, it takes theirs, as air would come between. A film that runs up a wall would be drawn into
    /// it otherwise, and driven along. Tells how many own wall particles let go.
    pub fn release_walls(
        &self,
        bare: impl Fn(usize) -> bool + Sync,
        kind: &[Kind],
        roles: &[Role],
        pressure: &mut [Real],
    ) -> usize {
        let mut released = 0;
        for (number, block) in self.blocks.iter().enumerate() {
            for row in 0..ROWS {
                let a = number * ROWS + row;
                if self.rows[a].diagonal <= 0.0 || !bare(a) {
                    continue;
                }
                let (columns, coefficients) = block.row(row);
                let (mut sum, mut weights) = (0.0, 0.0);
                for (&b, &c) in columns.iter().zip(coefficients) {
                    let b = b as usize;
                    // Only walls change here: what is read stays as it was solved for.
                    if kind[b] == Kind::Fluid && roles[b] != Role::Outside {
                        sum += Real::from(c) * pressure[b];
                        weights += Real::from(c);
                    }
                }
                if weights > 0.0 && pressure[a] < sum / weights {
                    pressure[a] = sum / weights;
                    released += 1;
                }
            }
        }
        released
    }

    /// Solves for `pressure`, which holds given values and the first guess, ghosts included.
    /// `strain` turns a residual into a volume strain in the step.
    pub fn solve(
        &mut self,
        layout: &Layout<'_>,
        exchange: &mut Exchange,
        pressure: &mut [Real],
        strain: Real,
        tolerance: &Tolerance,
    ) -> Result<PressureReport, PressureError> {
        let Layout { domain, roles, owned, .. } = *layout;
        let Self { blocks, rows, coarse, residual, step, direction, product } = self;
        let count = |role: Role| roles[..owned].iter().filter(|r| **r == role).count() as Real;
        let [unknowns, given] = domain.sum([count(Role::Unknown), count(Role::Given)]);
        let mut report =
            PressureReport { unknowns: unknowns as usize, given: given as usize, ..PressureReport::default() };
        if unknowns == 0.0 {
            return Ok(report);
        }
        coarse.assemble(layout, blocks, rows);
        let padded = blocks.len() * ROWS;
        for column in [&mut *residual, &mut *step, &mut *product] {
            column.clear();
            column.resize(padded, 0.0);
        }
        direction.clear();
        direction.resize(roles.len().max(padded), 0.0);

        let singular = given == 0.0;
        if singular {
            // Constants may be added: the right side must be orthogonal to them.
            let [sum] = domain.sum(sum_of(blocks.len() * ROWS, |a| if a < owned { [rows[a].right] } else { [0.0] }));
            let mean = sum / unknowns;
            report.removed_mean = mean * strain;
            rows[..owned]
                .iter_mut()
                .zip(roles)
                .filter(|(_, r)| **r == Role::Unknown)
                .for_each(|(r, _)| r.right -= mean);
        }
        let size = evaluate(layout, blocks, rows, pressure, residual);
        let mut largest = domain.max(size) * strain;
        let mut before: Option<Real> = None;
        while largest > tolerance.strain || largest.is_nan() {
            let iterations = report.iterations;
            if !largest.is_finite() {
                return Err(PressureError::NotFinite { iterations });
            }
            if iterations >= tolerance.most_iterations {
                return Err(PressureError::NotConverged { iterations, residual: largest, tolerance: tolerance.strain });
            }
            // z = M^-1 r
            coarse.correct(layout, residual, step);
            add_diagonal(rows, residual, step);
            if singular {
                take_out_mean(layout, step, unknowns);
            }
            let [descent] = domain.sum(sum_of(blocks.len() * ROWS, |a| [residual[a] * step[a]]));
            let beta = before.map_or(0.0, |before| descent / before);
            before = Some(descent);
            for_each_chunk((&mut direction[..padded], &mut step[..]), ROWS, |_, (p, z)| {
                p.iter_mut().zip(z).for_each(|(p, z)| *p = *z + beta * *p);
            });
            // The columns behind the own particles are ghosts: padding of the last block is theirs.
            direction[owned..padded.min(roles.len())].fill(0.0);
            exchange.refresh(domain, &mut direction[..roles.len()]);
            multiply(layout, blocks, rows, direction, product);
            let [bend] = domain
                .sum(sum_of(blocks.len() * ROWS, |a| if a < owned { [direction[a] * product[a]] } else { [0.0] }));
            if !(descent.is_finite() && bend.is_finite()) {
                return Err(PressureError::NotFinite { iterations });
            }
            if descent <= 0.0 || bend <= 0.0 {
                return Err(PressureError::NotConverged { iterations, residual: largest, tolerance: tolerance.strain });
            }
            let alpha = descent / bend;
            let own = &direction[..owned];
            for_each_chunk(&mut pressure[..owned], ROWS, |number, p| {
                p.iter_mut().zip(&own[number * ROWS..]).for_each(|(p, d)| *p += alpha * d);
            });
            for_each_chunk((&mut residual[..], &mut product[..]), ROWS, |_, (r, q)| {
                r.iter_mut().zip(q).for_each(|(r, q)| *r -= alpha * *q);
            });
            report.iterations += 1;
            let size = max_over(blocks.len(), |n| {
                residual[n * ROWS..(n + 1) * ROWS].iter().fold(0.0, |m: Real, r| m.max(r.abs()))
            });
            largest = domain.max(size) * strain;
            if largest <= tolerance.strain {
                // What counts is the residual of the solution itself.
                exchange.refresh(domain, pressure);
                let size = evaluate(layout, blocks, rows, pressure, residual);
                largest = domain.max(size) * strain;
                before = None;
            }
        }
        exchange.refresh(domain, pressure);
        report.residual = largest;
        Ok(report)
    }
}

/// `r = b + sum c (p_j - p_i)`, with `p` zero outside; returns the largest.
fn evaluate(layout: &Layout<'_>, blocks: &mut [Block], rows: &[Row], p: &[Real], r: &mut [Real]) -> Real {
    multiply(layout, blocks, rows, p, r);
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
    max_over(blocks.len(), |n| r[n * ROWS..(n + 1) * ROWS].iter().fold(0.0, |m: Real, r| larger(m, r.abs())))
}

/// The larger of two; not a number if one is not.
fn larger(a: Real, b: Real) -> Real {
    if b.is_nan() || a < b { b } else { a }
}

/// `q = A d`, with `d` zero outside.
fn multiply(layout: &Layout<'_>, blocks: &mut [Block], rows: &[Row], d: &[Real], q: &mut [Real]) {
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

/// `sum c_b d_b`, in four strands.
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

/// Takes the mean of the unknown's entries out of them.
fn take_out_mean(layout: &Layout<'_>, z: &mut [Real], unknowns: Real) {
    let [sum] = layout.domain.sum(sum_of(z.len(), |a| [z[a]]));
    let mean = sum / unknowns;
    let of = |a: usize| a < layout.owned && layout.roles[a] == Role::Unknown;
    z.iter_mut().enumerate().filter(|(a, _)| of(*a)).for_each(|(_, z)| *z -= mean);
}

/// Hydrostatic part of the pressure at `position`, `rho b . (x - x_ref)` [Pa].
#[inline]
#[must_use]
pub fn hydrostatic(density: Real, body_force: Vector, position: Vector, reference: Vector) -> Real {
    density * body_force.dot(position - reference)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Row 0 with neighbours of coefficient 1 at these places, and what its sum leaves of a pressure `slope . x`.
    fn left_over(neighbours: &[(Vector, Role)], slope: Vector, complete: bool) -> Real {
        let mut equation = PressureEquation::default();
        equation.resize(1);
        let mut place = vec![Vector::ZERO];
        let mut roles = vec![Role::Unknown];
        for &(way, role) in neighbours {
            place.push(way);
            roles.push(role);
        }
        let block = &mut equation.blocks[0];
        block.columns = (1..=neighbours.len() as u32).collect();
        block.coefficients = vec![1.0; neighbours.len()];
        (0..ROWS).for_each(|row| block.end_row(row, neighbours.len(), 0));
        let pressure: Vec<Real> = place.iter().map(|x| slope.dot(*x)).collect();
        equation.close(&roles, 1);
        if complete {
            let lean = neighbours.iter().map(|(way, _)| *way).sum::<Vector>();
            equation.complete(&roles, &place, &pressure, |_| Some(lean));
        }
        let row = equation.rows[0];
        let counts = |n: &usize| roles[n + 1] != Role::Outside;
        let sum: Real = (0..neighbours.len()).filter(counts).map(|n| pressure[n + 1]).sum();
        // The row reads `diagonal p_0 - sum = right`.
        row.diagonal * pressure[0] - sum - row.right
    }

    #[test]
    fn what_is_missing_beyond_the_surface_leaves_a_linear_pressure_alone() {
        let [x, z] = [Vector::X, Vector::Z];
        // Water below and beside, a surface one spacing above, nothing beyond.
        let deep = [(-2.0 * z, Role::Unknown), (-z, Role::Unknown), (x, Role::Unknown), (-x, Role::Unknown)];
        let near = [(z + x, Role::Given), (z - x, Role::Given)];
        let both: Vec<(Vector, Role)> = deep.iter().chain(&near).copied().collect();
        assert!(left_over(&both, z, true).abs() < 1e-12);
        assert!((left_over(&both, z, false) - 1.0).abs() < 1e-12, "negative control: a row that lacks what is beyond");
        assert!(left_over(&both, x, true).abs() < 1e-12, "along the surface nothing is missing");
        // A splash supports nothing: it does not stand for what is missing.
        let splash: Vec<(Vector, Role)> = both.iter().copied().chain([(1.5 * z, Role::Outside)]).collect();
        assert!(left_over(&splash, z, true).abs() < 1e-12);
        // Neighbours on all sides need nothing.
        let whole: Vec<(Vector, Role)> = both.iter().copied().chain([(z, Role::Unknown)]).collect();
        assert_eq!(left_over(&whole, z, true), left_over(&whole, z, false));
    }
}
