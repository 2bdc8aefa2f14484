//! The pressure equation `sum_j c_ij (p_j - p_i) = -(rho/dt) source` and its solution.
//!
//! The coefficients `c_ij` (see `number_density.rs`) are the operator `div(mobility grad p)/eps`, symmetric to the
//! last bit because both particles of a pair evaluate the same expression. They are stored in single precision and summed
//! in double. Solved by conjugate gradients, preconditioned by the diagonal, which damps everything shorter than the
//! radius of influence, plus a correction on a coarse grid.

use sazanami_numerics::domain::FailedElsewhere;
use sazanami_numerics::linear::{Control, Progress, SolveError, System, iterate};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk};

use crate::arrangement::Arrangement;
use crate::coarse::CoarseGrid;
use crate::context::Context;
use crate::ghosts::Ghosts;
use crate::matrix::{Block, Layout, Row};
use crate::neighbours::ROWS;
use crate::number_density::Prediction;
use crate::particles::{Kind, Particles, Role};
use crate::pressure_system::{Compact, ParticleSystem, Product, subtract_from_right};
use crate::reductions::sum_of;
pub use crate::settings::Tolerance;

/// Outcome of a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PressureReport {
    /// Number of iterations.
    pub iterations: usize,
    /// Largest true residual, as a volume strain in the step.
    pub residual: Real,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Number of particles with prescribed pressure.
    pub given: usize,
    /// Mean of the right side, removed where no pressure is prescribed, as a strain in the step.
    pub removed_mean: Real,
    /// Pairs whose negative coefficient was set to zero.
    pub cut_coefficients: usize,
    /// Rows whose completion beyond the surface was limited.
    pub limited_rows: usize,
}

/// The pressure equation was not solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PressureError {
    /// The residual stagnates, or falls too slowly.
    #[error(
        "the pressure equation was not solved: residual {residual:.3e} (volume strain per step) after {iterations} \
         iterations, tolerance {tolerance:.1e}"
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Residual reached, as a volume strain in the step.
        residual: Real,
        /// Residual asked for.
        tolerance: Real,
    },
    /// NaN or infinity in the iteration.
    #[error("the pressure is not finite after {iterations} iterations")]
    NotFinite {
        /// Iterations done.
        iterations: usize,
    },
    /// Another rank failed.
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

impl PressureError {
    fn of(error: &SolveError, tolerance: Real) -> Self {
        match *error {
            SolveError::NotFinite { iterations } => Self::NotFinite { iterations },
            SolveError::NotConverged { iterations, residual, .. }
            | SolveError::Breakdown { iterations, residual, .. } => {
                Self::NotConverged { iterations, residual, tolerance }
            }
        }
    }
}

/// Most iterations for what a slow flow wants beyond what is allowed.
const FINER: usize = 100;

/// The equation of the present step, with the work vectors of its solution.
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
    /// Allocates the rows of `owned` particles and clears them.
    pub fn resize(&mut self, owned: usize) {
        self.blocks.resize_with(owned.div_ceil(ROWS), Block::default);
        self.rows.clear();
        self.rows.resize(self.blocks.len() * ROWS, Row::default());
    }

    /// Sets the diagonal, and marks the rows beside the free surface.
    pub fn set_diagonal(&mut self, roles: &[Role], owned: usize) {
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
                    if role != Role::Inactive {
                        entry.diagonal += Real::from(c);
                    }
                    entry.beside_surface |= role == Role::Dirichlet;
                }
            }
        });
    }

    /// Completes the truncated support of rows beside the free surface. `sums` hold the first moment of a row's
    /// coefficients; `particles` the prescribed pressures.
    ///
    /// With truncated support the Laplacian of a linear pressure is not zero but the gradient times the first-moment
    /// deficit. A virtual neighbour at the mean position of the surface neighbours, with their mean pressure and the
    /// coefficient that makes the sum exact for a pressure linear in that direction, removes it. It only adds to the
    /// diagonal and the right side, so that the equation stays symmetric.
    pub fn complete_support(&mut self, particles: &Particles, position: &[Vector], sums: &[Prediction]) {
        let Particles { kind, role, pressure, .. } = particles;
        self.complete(role, position, pressure, |a| (kind[a] == Kind::Fluid).then(|| sums[a].moment_deficit));
    }

    fn complete(
        &mut self,
        roles: &[Role],
        place: &[Vector],
        pressure: &[Real],
        moment_deficit: impl Fn(usize) -> Option<Vector> + Sync,
    ) {
        let blocks = &self.blocks[..];
        for_each_chunk(&mut self.rows[..], ROWS, |number, rows| {
            for (n, row) in rows.iter_mut().enumerate().filter(|(_, row)| row.beside_surface) {
                let a = number * ROWS + n;
                let Some(moment_deficit) = moment_deficit(a) else { continue };
                let (columns, coefficients) = blocks[number].row(n);
                let (mut moment_deficit, mut way, mut given, mut weights) = (moment_deficit, Vector::ZERO, 0.0, 0.0);
                for (&b, &c) in columns.iter().zip(coefficients) {
                    let (b, c) = (b as usize, Real::from(c));
                    match roles[b] {
                        Role::Dirichlet => {
                            way += c * (place[b] - place[a]);
                            given += c * pressure[b];
                            weights += c;
                        }
                        // Inactive neighbours are not part of the row.
                        Role::Inactive => moment_deficit -= c * (place[b] - place[a]),
                        Role::Unknown => {}
                    }
                }
                // Coefficients of very close and very distant pairs are zero.
                if weights <= 0.0 || way == Vector::ZERO {
                    continue;
                }
                let (way, given) = (way / weights, given / weights);
                // At most the present diagonal: surface neighbours may lie on both sides.
                let asked = -moment_deficit.dot(way) / way.length_squared();
                row.limited = asked > row.diagonal;
                let missing = asked.min(row.diagonal);
                if missing > 0.0 {
                    row.diagonal += missing;
                    row.right += missing * given;
                }
            }
        });
    }

    /// Own pairs whose negative coefficient was set to zero, and own rows whose completion was limited.
    fn limited(&self) -> [Real; 2] {
        let cut = self.blocks.iter().map(|block| block.cut).sum::<usize>() as Real;
        let [limited] = sum_of(self.rows.len(), |a| [if self.rows[a].limited { 1.0 } else { 0.0 }]);
        [cut, limited]
    }

    /// Tensile cut-off at dry walls: a wall particle with little fluid in front of it whose pressure is below the mean of
    /// its fluid neighbours takes that mean, as air would enter. A film running up a wall would be drawn into it
    /// otherwise. Returns the number of wall particles affected, over all ranks.
    pub fn cut_tension(&mut self, step: &Context<'_>, sums: &[Prediction], particles: &mut Particles) -> usize {
        let Self { blocks, rows, product, .. } = self;
        let Particles { kind, role, pressure, owned, .. } = particles;
        let dry = |a: usize| step.is_dry_wall(kind[a], sums[a].density);
        let (blocks, rows, owned) = (&*blocks, &*rows, *owned);
        let solved = &pressure[..];
        product.resize(rows.len(), 0.0);
        for_each_chunk(&mut product[..owned], ROWS, |number, cut| {
            for (row, cut) in cut.iter_mut().enumerate() {
                let a = number * ROWS + row;
                *cut = solved[a];
                if rows[a].diagonal <= 0.0 || !dry(a) {
                    continue;
                }
                let (columns, coefficients) = blocks[number].row(row);
                let (mut sum, mut weights) = (0.0, 0.0);
                for (&b, &c) in columns.iter().zip(coefficients) {
                    let b = b as usize;
                    if kind[b] == Kind::Fluid && role[b] != Role::Inactive {
                        sum += Real::from(c) * solved[b];
                        weights += Real::from(c);
                    }
                }
                if weights > 0.0 && solved[a] < sum / weights {
                    *cut = sum / weights;
                }
            }
        });
        let cut = &product[..];
        let [count] = sum_of(owned, |a| [if cut[a] > solved[a] { 1.0 } else { 0.0 }]);
        for_each_chunk(&mut pressure[..owned], ROWS, |number, pressure| {
            pressure.copy_from_slice(&cut[number * ROWS..][..pressure.len()]);
        });
        step.domain.sum([count])[0] as usize
    }

    /// Solves for the pressure of the `particles` at `position` \[m], which hold prescribed values and the initial guess,
    /// ghosts included.
    ///
    /// # Errors
    /// [`PressureError`] if the residual does not fall below the tolerance.
    pub fn solve(
        &mut self,
        step: &Context<'_>,
        near: &mut Arrangement,
        particles: &mut Particles,
        position: &[Vector],
    ) -> Result<PressureReport, PressureError> {
        let Arrangement { ghosts, bins, bin, .. } = near;
        let Particles { role, pressure, owned, .. } = particles;
        let layout = Layout { domain: step.domain, bins, roles: role, bin, place: position, owned: *owned };
        // Converts a residual into a volume strain in the step.
        let strain = step.dt * step.dt / step.settings.fluid.density;
        let [cut, limited] = step.domain.sum(self.limited());
        let solved = self.solve_with(
            &mut Compact,
            &layout,
            ghosts,
            pressure,
            strain,
            (&step.settings.tolerance, Real::INFINITY),
        )?;
        Ok(PressureReport { cut_coefficients: cut as usize, limited_rows: limited as usize, ..solved })
    }

    /// Solves with a `matrix`, of which the rows hold the preconditioner; `strain` converts a residual into a volume strain
    /// in the step. What a flow of the Courant number wants beyond what is allowed is gone for, in [`FINER`] iterations at most.
    ///
    /// # Errors
    /// [`PressureError`] if the residual does not fall below the tolerance.
    pub fn solve_with<P: Product>(
        &mut self,
        matrix: &mut P,
        layout: &Layout<'_>,
        ghosts: &mut Ghosts,
        pressure: &mut [Real],
        strain: Real,
        (tolerance, courant): (&Tolerance, Real),
    ) -> Result<PressureReport, PressureError> {
        let Layout { domain, roles, owned, .. } = *layout;
        let Self { blocks, rows, coarse, residual, step, direction, product } = self;
        let is = |a: usize, role: Role| if roles[a] == role { 1.0 } else { 0.0 };
        let [unknowns, given] = domain.sum(sum_of(owned, |a| [is(a, Role::Unknown), is(a, Role::Dirichlet)]));
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

        let singular = given == 0.0 && matrix.up_to_constant();
        if singular {
            report.removed_mean = remove_mean(layout, rows, unknowns) * strain;
        }
        let wanted = tolerance.at(courant);
        let Tolerance { strain: tolerance, most_iterations } = *tolerance;
        // In double precision the recursive residual is as good as the true one until it has converged.
        let control = Control { tolerance, most_iterations, margin: 1.0, trusted_fall: 0.0, most_stalls: usize::MAX };
        matrix.multiply(layout, ghosts, (blocks, rows), pressure, residual);
        let size = subtract_from_right(layout, rows, residual);
        let mut system = ParticleSystem {
            matrix,
            layout,
            ghosts: &mut *ghosts,
            blocks,
            rows,
            coarse,
            pressure: &mut *pressure,
            residual,
            step,
            direction,
            product,
            strain,
            unknowns,
            singular,
            before: None,
        };
        let mut progress = iterate(&mut system, domain.max(size) * strain, &control)
            .map_err(|error| PressureError::of(&error, tolerance))?;
        if wanted < progress.residual {
            let finer = Control { tolerance: wanted, most_iterations: FINER, ..control };
            let more = match iterate(&mut system, progress.residual, &finer) {
                Ok(Progress { iterations, residual, .. }) => (iterations, residual),
                Err(SolveError::NotConverged { iterations, .. } | SolveError::Breakdown { iterations, .. }) => {
                    (iterations, system.evaluate())
                }
                Err(error @ SolveError::NotFinite { .. }) => return Err(PressureError::of(&error, tolerance)),
            };
            progress.iterations += more.0;
            progress.residual = more.1;
            if progress.residual.is_nan() || progress.residual > tolerance {
                let Progress { iterations, residual, .. } = progress;
                return Err(PressureError::NotConverged { iterations, residual, tolerance });
            }
        }
        ghosts.refresh(domain, pressure);
        Ok(PressureReport { iterations: progress.iterations, residual: progress.residual, ..report })
    }
}

/// Removes the mean of the right side over the unknowns, which a singular system cannot have, and returns it.
fn remove_mean(layout: &Layout<'_>, rows: &mut [Row], unknowns: Real) -> Real {
    let Layout { domain, roles, owned, .. } = *layout;
    let [sum] = domain.sum(sum_of(rows.len(), |a| if a < owned { [rows[a].right] } else { [0.0] }));
    let mean = sum / unknowns;
    for_each_chunk(&mut rows[..owned], ROWS, |number, rows| {
        let unknown = rows.iter_mut().zip(&roles[number * ROWS..]).filter(|(_, role)| **role == Role::Unknown);
        unknown.for_each(|(row, _)| row.right -= mean);
    });
    mean
}

/// Hydrostatic part of the pressure at `position`, `rho b . (x - x_ref)` \[Pa].
#[inline]
#[must_use]
pub fn hydrostatic(density: Real, body_force: Vector, position: Vector, reference: Vector) -> Real {
    density * body_force.dot(position - reference)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residual of row 0, with neighbours of coefficient 1 at these positions, for a pressure `slope . x`.
    fn residual_of_linear_pressure(neighbours: &[(Vector, Role)], slope: Vector, complete: bool) -> Real {
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
        equation.set_diagonal(&roles, 1);
        if complete {
            let moment_deficit = neighbours.iter().map(|(way, _)| *way).sum::<Vector>();
            equation.complete(&roles, &place, &pressure, |_| Some(moment_deficit));
        }
        let row = equation.rows[0];
        let counts = |n: &usize| roles[n + 1] != Role::Inactive;
        let sum: Real = (0..neighbours.len()).filter(counts).map(|n| pressure[n + 1]).sum();
        // The row reads `diagonal p_0 - sum = right`.
        row.diagonal * pressure[0] - sum - row.right
    }

    #[test]
    fn completed_rows_are_exact_for_linear_pressure() {
        let [x, z] = [Vector::X, Vector::Z];
        // Fluid below and beside, a surface one spacing above, nothing beyond.
        let deep = [(-2.0 * z, Role::Unknown), (-z, Role::Unknown), (x, Role::Unknown), (-x, Role::Unknown)];
        let near = [(z + x, Role::Dirichlet), (z - x, Role::Dirichlet)];
        let both: Vec<(Vector, Role)> = deep.iter().chain(&near).copied().collect();
        assert!(residual_of_linear_pressure(&both, z, true).abs() < 1e-12);
        assert!(
            (residual_of_linear_pressure(&both, z, false) - 1.0).abs() < 1e-12,
            "negative control: a truncated row"
        );
        assert!(residual_of_linear_pressure(&both, x, true).abs() < 1e-12, "along the surface the support is complete");
        // An isolated particle beyond the surface is no support.
        let splash: Vec<(Vector, Role)> = both.iter().copied().chain([(1.5 * z, Role::Inactive)]).collect();
        assert!(residual_of_linear_pressure(&splash, z, true).abs() < 1e-12);
        // Full support needs no completion.
        let whole: Vec<(Vector, Role)> = both.iter().copied().chain([(z, Role::Unknown)]).collect();
        assert_eq!(residual_of_linear_pressure(&whole, z, true), residual_of_linear_pressure(&whole, z, false));
    }
}
