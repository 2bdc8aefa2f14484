//! Liquid and gas on a grid without grains, and a step of them.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::{Field, Grid};
use sazanami_numerics::{Real, Vector};

use sazanami_mics::boundary::Boundary;
use sazanami_mics::flow::{Flow, Fluids, Schemes};
use sazanami_mics::pressure::{PressureError, Projection, Tolerance};
use sazanami_mics::transport::TransportReport;
use sazanami_mics::viscosity::ViscosityError;

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
        self.flow.set_velocity(&self.domain, &self.boundary, velocity);
        self.project(1.0)
    }

    /// Projects without transport, over `dt` \[s] without gravity.
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

    /// Centre of the liquid \[m].
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
