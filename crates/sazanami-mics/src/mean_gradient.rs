//! The mean gradient of the pressure along periodic directions, given or such that a net flow is held.
//!
//! The pressure is a periodic one and `G . x`: beyond an upper side it is `G L` higher than within the lower one, for the equation, the
//! velocities and the loads on grains alike. It acts by volume. The net flow, the mean of the velocity on the faces, answers to `G` along
//! a straight line, whose slope is the flow that a gradient of 1 Pa/m alone gives: a solution of the pressure equation in each direction
//! held. So the flow after the projection is the one that is wanted, in every step.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_numerics::linear::Stop;
use sazanami_numerics::{Matrix, Real, Vector};

use crate::mobility::Mobility;
use crate::pressure_sides::BoxSides;

/// Largest residual of the flow that a gradient gives, over that of the liquid in one cell.
const RESPONSE: Real = 1e-6;

/// The mean gradient of the pressure.
#[derive(Default)]
pub(crate) struct MeanGradient {
    /// The acceleration of the liquid by it [m/s^2].
    acceleration: Vector,
    liquid_density: Real,
    /// The directions in which a net flow is held, and that flow [m/s].
    held: Option<([bool; 3], Vector)>,
    /// Pressure by a gradient of 1 Pa/m in each direction held.
    response: [Option<Field<Real>>; 3],
}

/// What the net flow depends on beside the pressure.
pub(crate) struct MeanFlux<'a> {
    pub domain: &'a Domain,
    pub mobility: &'a Mobility,
    pub density: &'a [Real],
    pub spacing: Vector,
}

impl MeanFlux<'_> {
    /// Mean over the faces of their velocity [m/s], and of their acceleration by the pressure `p`, ghosts filled [m/s^2].
    fn of(&self, velocity: Option<&[Field<Real>; 3]>, p: &Field<Real>) -> [Vector; 2] {
        let Self { domain, mobility, density: rho, spacing } = self;
        let p = p.data();
        let mut sums = [0.0; 6];
        for (d, stride) in domain.strides().into_iter().enumerate() {
            let behind = stride as usize;
            let scale = 2.0 / spacing[d];
            let [u, a] = domain.sum_rows(&domain.interior(), |row| {
                let mobility = mobility.of(d, &row, false);
                let mut sum = [0.0; 2];
                for (n, at) in row.shifted(0).enumerate() {
                    sum[0] += velocity.map_or(0.0, |velocity| velocity[d].data()[at]);
                    sum[1] -= scale * mobility[n] * ((p[at] - p[at - behind]) / (rho[at] + rho[at - behind]));
                }
                sum
            });
            (sums[d], sums[3 + d]) = (u, a);
        }
        let sums = domain.sum(sums).map(|sum| sum / domain.grid().len() as Real);
        [Vector::from_slice(&sums[..3]), Vector::from_slice(&sums[3..])]
    }
}

impl MeanGradient {
    /// Drives a liquid of this density [kg/m^3] by an `acceleration` [m/s^2].
    pub fn drive(&mut self, acceleration: Vector, liquid_density: Real) {
        (self.acceleration, self.liquid_density) = (acceleration, liquid_density);
    }

    /// Holds a net flow [m/s] in some directions from the next projection on.
    pub fn hold(&mut self, held: [bool; 3], flow: Vector) {
        self.held = Some((held, flow));
    }

    /// Acceleration of the liquid by it [m/s^2].
    pub fn acceleration(&self) -> Vector {
        self.acceleration
    }

    /// The gradient [Pa/m].
    pub fn gradient(&self) -> Vector {
        self.acceleration * -self.liquid_density
    }

    /// Pressure by a gradient of 1 Pa/m in each direction held: the first guess of the next.
    pub fn responses(&self) -> &[Option<Field<Real>>; 3] {
        &self.response
    }

    /// The same for writing, at a restart.
    pub fn responses_mut(&mut self) -> &mut [Option<Field<Real>>; 3] {
        &mut self.response
    }

    /// Whether a net flow is held.
    pub fn is_held(&self) -> bool {
        self.held.is_some()
    }

    /// Solves for the pressure by a gradient of 1 Pa/m in each direction held, with `solve(sides, pressure, stop)`; returns the iterations.
    pub fn respond<E>(
        &mut self,
        flux: &MeanFlux<'_>,
        sides: &BoxSides<'_>,
        mut solve: impl FnMut(&BoxSides<'_>, &mut Field<Real>, Stop) -> Result<usize, E>,
    ) -> Result<usize, E> {
        let mut iterations = 0;
        let stop = Stop::Largest(RESPONSE / (self.liquid_density * flux.spacing.max_element()));
        for (d, response) in self.response.iter_mut().enumerate() {
            if self.held.is_none_or(|(held, _)| !held[d]) {
                continue;
            }
            let response = response.get_or_insert_with(|| flux.domain.field(0.0));
            let sides = sides.of_change(flux.domain, Vector::AXES[d]);
            iterations += solve(&sides, response, stop)?;
        }
        Ok(iterations)
    }

    /// Changes the gradient and with it the pressure so that `velocity`, which the pressure is to correct over `dt` \[s], has the flow that
    /// is held.
    pub fn meet(&mut self, flux: &MeanFlux<'_>, velocity: &[Field<Real>; 3], pressure: &mut Field<Real>, dt: Real) {
        let Some((held, wanted)) = self.held else { return };
        let [flow, change] = flux.of(Some(velocity), pressure);
        let mut lack = (wanted - flow) / dt - change;
        let mut slopes = Matrix::IDENTITY;
        for (d, response) in self.response.iter().enumerate() {
            match response {
                Some(response) if held[d] => *slopes.col_mut(d) = flux.of(None, response)[1],
                _ => lack[d] = 0.0,
            }
        }
        for d in (0..3).filter(|&d| !held[d]) {
            // What is not held does not count.
            (0..3).filter(|&e| e != d).for_each(|e| slopes.col_mut(e)[d] = 0.0);
        }
        let gradient = slopes.inverse() * lack;
        for (d, response) in self.response.iter().enumerate() {
            if let (true, Some(response)) = (held[d], response) {
                let (domain, response) = (flux.domain, response.data());
                domain.for_each_row(&domain.interior(), pressure.data_mut(), |row, p| {
                    p.iter_mut().zip(&response[row.shifted(0)]).for_each(|(p, by)| *p += gradient[d] * by);
                });
                self.acceleration[d] -= gradient[d] / self.liquid_density;
            }
        }
    }
}
