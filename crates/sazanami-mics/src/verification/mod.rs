//! Flows with a known answer: programs that run one and return how far the result is off.
//!
//! Tests run them on coarse grids; `sazanami verify` on the grids that the literature reports.

mod channel;
pub mod dam_break;
mod prescribed;
mod single_phase;
mod two_phase;

pub use channel::{poiseuille, two_layers};
pub use prescribed::{ShapeError, deformation, reversed_vortex, translation};
pub use single_phase::{
    CavityError, Reynolds, TimeOrder, VortexError, cavity, slip_box_vortex, taylor_green, taylor_green_in_time,
};
pub use two_phase::{FreeFlight, GRAVITY, Stillness, WATER_AND_AIR, drop_in_flight, layers_at_rest};

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::{Field, Grid};
use sazanami_numerics::{Real, Vector};

use crate::boundary::Boundary;
use crate::flow::{Flow, Fluids, Schemes, TransportReport};
use crate::pressure::{PressureError, Projection, Tolerance};
use crate::viscosity::ViscosityError;

/// A step of an experiment failed.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// In the projection.
    #[error(transparent)]
    Pressure(#[from] PressureError),
    /// In the viscous step.
    #[error(transparent)]
    Viscosity(#[from] ViscosityError),
}

/// Liquid and gas without grains on a single rank.
pub struct Experiment {
    /// The grid.
    pub domain: Domain,
    /// The sides of the box.
    pub boundary: Boundary,
    /// The fluids.
    pub flow: Flow,
    /// The pressure.
    pub projection: Projection,
    /// Accuracy of the projection.
    pub tolerance: Tolerance,
    /// Whether the last pressure gradient acts for half a step on what is carried along, and is taken
    /// back afterwards: with `Carrier::Middle` and Crank-Nicolson second order in time.
    pub pressure_carried: bool,
}

impl Experiment {
    /// Gas at rest.
    #[must_use]
    pub fn new(grid: Grid, boundary: Boundary, fluids: Fluids, schemes: Schemes) -> Self {
        let domain = Domain::solo(grid, boundary.periodic());
        let flow = Flow::new(&domain, fluids, schemes);
        let projection = Projection::new(&domain, boundary.pressure_sides());
        let tolerance = Tolerance { divergence: 1e-12, ..Tolerance::default() };
        Self { domain, boundary, flow, projection, tolerance, pressure_carried: false }
    }

    /// Sets the velocity of the cells and makes that of the faces free of divergence.
    ///
    /// # Errors
    /// [`ExperimentError`] if the projection fails.
    pub fn set_velocity(&mut self, velocity: impl Fn(Vector) -> Vector + Sync) -> Result<(), ExperimentError> {
        let domain = &self.domain;
        for (d, u) in self.flow.velocity.iter_mut().enumerate() {
            domain.set(u, |i, j, k| velocity(domain.centre(i, j, k))[d]);
        }
        self.flow.fill_halos(domain, &self.boundary);
        self.project(1.0)
    }

    /// Projects without transport, over `dt` [s] without gravity.
    ///
    /// # Errors
    /// [`ExperimentError`] if the projection fails.
    pub fn project(&mut self, dt: Real) -> Result<(), ExperimentError> {
        self.flow.predict_faces(&self.domain, &self.boundary, Vector::ZERO, dt);
        self.make_solenoidal(Vector::ZERO, dt)
    }

    fn make_solenoidal(&mut self, gravity: Vector, dt: Real) -> Result<(), ExperimentError> {
        let Flow { density, velocity, face_velocity, .. } = &mut self.flow;
        self.projection.project(&self.domain, density, velocity, face_velocity, gravity, dt, &self.tolerance)?;
        Ok(())
    }

    /// Transport, viscosity, gravity, pressure.
    ///
    /// # Errors
    /// [`ExperimentError`] if a phase fails.
    pub fn step(&mut self, gravity: Vector, dt: Real) -> Result<TransportReport, ExperimentError> {
        if self.pressure_carried {
            self.projection.add_gradient(&self.domain, &self.flow.density, &mut self.flow.velocity, -0.5 * dt);
        }
        let report = self.flow.transport(&self.domain, &self.boundary, dt);
        if self.pressure_carried {
            self.projection.add_gradient(&self.domain, &self.flow.density, &mut self.flow.velocity, 0.5 * dt);
        }
        self.flow.diffuse(&self.domain, &self.boundary, dt)?;
        self.flow.predict_faces(&self.domain, &self.boundary, gravity, dt);
        self.make_solenoidal(gravity, dt)?;
        Ok(report)
    }

    /// Means over the cells of functions of position and velocity.
    pub fn mean<const N: usize>(&self, value: impl Fn(Vector, Vector) -> [Real; N] + Sync) -> [Real; N] {
        let u = self.flow.velocity.each_ref().map(Field::data);
        let sum = self.domain.sum_rows(&self.domain.interior(), |row| {
            let mut sum = [0.0; N];
            for (i, at) in row.shifted(0).enumerate() {
                let x = self.domain.centre(i as isize, row.j, row.k);
                let values = value(x, Vector::new(u[0][at], u[1][at], u[2][at]));
                sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            }
            sum
        });
        sum.map(|sum| sum / self.domain.grid().len() as Real)
    }

    /// Largest difference of a velocity component from `before` [m/s].
    #[must_use]
    pub fn largest_change(&self, before: &[Field<Real>; 3]) -> Real {
        let pairs = self.flow.velocity.iter().zip(before);
        let change = pairs.map(|(now, before)| {
            self.domain.max_rows(&self.domain.interior(), |row| {
                let (now, before) = (&now.data()[row.shifted(0)], &before.data()[row.shifted(0)]);
                now.iter().zip(before).fold(0.0, |a, (now, before)| a.max((now - before).abs()))
            })
        });
        change.fold(0.0, Real::max)
    }

    /// Centre of the liquid [m].
    #[must_use]
    pub fn liquid_centre(&self) -> Vector {
        let c = self.flow.volume_fraction.data();
        let [x, y, z, sum] = self.domain.sum_rows(&self.domain.interior(), |row| {
            let mut sum = [0.0; 4];
            for (i, &c) in c[row.shifted(0)].iter().enumerate() {
                let x = self.domain.centre(i as isize, row.j, row.k) * c;
                sum = [sum[0] + x.x, sum[1] + x.y, sum[2] + x.z, sum[3] + c];
            }
            sum
        });
        Vector::new(x, y, z) / sum
    }
}

/// Part of every cell of a rank inside a ball, by `samples` points per direction in the cells that
/// its surface may cross. In directions one cell thick the ball is a cylinder.
#[must_use]
pub fn ball(domain: &Domain, centre: Vector, radius: Real, samples: usize) -> Field<Real> {
    let grid = domain.grid();
    let thick = Vector::from_array(grid.cells.map(|n| if n > 1 { 1.0 } else { 0.0 }));
    let per_axis = grid.cells.map(|n| if n > 1 { samples } else { 1 });
    let total: usize = per_axis.iter().product();
    let mut fraction = domain.field(0.0);
    domain.set(&mut fraction, |i, j, k| {
        let x = (domain.centre(i, j, k) - centre) * thick;
        let reach = (grid.spacing * thick).length();
        if (x.length() - radius).abs() > reach {
            return if x.length() < radius { 1.0 } else { 0.0 };
        }
        let inside = |n: usize| {
            let index = [n % per_axis[0], n / per_axis[0] % per_axis[1], n / (per_axis[0] * per_axis[1])];
            let offset = Vector::from_array(std::array::from_fn(|d| {
                ((index[d] as Real + 0.5) / per_axis[d] as Real - 0.5) * grid.spacing[d]
            }));
            (x + offset * thick).length_squared() < radius * radius
        };
        (0..total).filter(|&n| inside(n)).count() as Real / total as Real
    });
    fraction
}
