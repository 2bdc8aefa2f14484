//! A mean velocity of the liquid that is held by a body force on fluids and grains, or a net flow that is held by a gradient of the pressure.

use sazanami_numerics::Vector;
use sazanami_numerics::domain::Row;
use sazanami_numerics::grid::Field;
use sazanami_numerics::mean_flow::{MeanFlow, MeanFlowReport};

use crate::solver::{Solver, StepError};

impl Solver {
    /// Holds a mean velocity of the liquid from the next step on, at a restart.
    #[must_use]
    pub fn with_mean_flow(mut self, mean_flow: Option<MeanFlow>) -> Self {
        self.mean_flow = mean_flow;
        self.move_box(0.0);
        self.fill_halos();
        self.settle_ghosts();
        self
    }

    /// Starts the flow, before its first step and before surface tension: makes the initial velocity free of divergence and finds the
    /// pressure with which that step begins, under gravity and what drives the flow: a mean velocity that is held, and a mean gradient of
    /// the pressure that gives the liquid the acceleration `by_pressure` [m/s^2]. Nothing is transported. Collective.
    ///
    /// # Errors
    /// [`StepError`] if the pressure does not converge.
    pub fn start(&mut self, mean_flow: Option<MeanFlow>, by_pressure: Vector) -> Result<(), StepError> {
        self.mean_flow = mean_flow;
        self.drive_by_pressure(by_pressure);
        if let Some(net) = self.mean_flow.filter(MeanFlow::is_net) {
            self.fill_halos();
            self.flow.predict_faces(&self.domain, &self.boundary, Vector::ZERO, 0.0);
            self.projection.mean.hold(net.held(), self.net_flow());
        }
        let gravity = self.settings.gravity + self.by_mass();
        let box_gains = |dt: f64| mean_flow.map_or(Vector::ZERO, |flow| flow.outside_after(dt));
        let Self { domain, boundary, settings, flow, projection, grains, .. } = self;
        projection.start(domain, (boundary, box_gains), flow, gravity, &settings.limits, &settings.tolerance)?;
        grains.begin_exchange(domain, flow, gravity);
        Ok(())
    }

    /// The force per mass that holds a mean velocity of the liquid [m/s^2].
    pub(crate) fn by_mass(&self) -> Vector {
        self.mean_flow.filter(|flow| !flow.is_net()).map_or(Vector::ZERO, |flow| flow.acceleration())
    }

    /// Mean velocity of all that is in the box [m/s]. Collective.
    fn net_flow(&self) -> Vector {
        let Self { domain, flow, .. } = self;
        let faces = flow.face_velocity.each_ref().map(Field::data);
        let sum = |row: Row, d: usize| faces[d][row.shifted(0)].iter().sum::<f64>();
        let sums = domain.sum_rows(&domain.interior(), |row| [0, 1, 2].map(|d| sum(row, d)));
        Vector::from_array(domain.sum(sums)) / domain.grid().len() as f64
    }

    /// Gives the pressure behind the sides of a box that moves what the force of the next step asks for, as after a restart.
    pub(crate) fn settle_ghosts(&mut self) {
        if let Some(flow) = self.mean_flow.filter(MeanFlow::moves_box) {
            let gravity = self.settings.gravity + flow.acceleration();
            self.projection.fill_ghosts(&self.domain, &self.flow, gravity);
        }
    }

    /// Gives what enters a box that moves with its liquid the velocity that fluid at rest outside has there in `dt` \[s].
    pub(crate) fn move_box(&mut self, dt: f64) {
        let outside = self.mean_flow.map_or(Vector::ZERO, |flow| flow.outside_after(dt));
        if outside != Vector::ZERO {
            self.boundary = self.given.with_faster_inflow(outside);
        }
    }

    /// Lets the force answer to the mean velocity of the liquid outside grains after a step of `dt` \[s]. Collective.
    pub(crate) fn answer(&mut self, dt: f64) -> Option<MeanFlowReport> {
        let mut held = self.mean_flow?;
        let Self { domain, flow, grains, .. } = &*self;
        if held.is_net() {
            let mass = flow.fluids.liquid_density * domain.grid().extent().element_product();
            let report = held.kept(dt, self.projection.mean.acceleration(), self.net_flow(), mass);
            self.mean_flow = Some(held);
            return Some(report);
        }
        let (c, u) = (flow.volume_fraction.data(), flow.velocity.each_ref().map(Field::data));
        let imprint = grains.covered();
        let alpha = imprint.solid_fraction.data();
        let sum = domain.sum_rows(&domain.interior(), |row| {
            let mut sum = [0.0; 4];
            if domain.centre(0, row.j, row.k).z <= held.above() {
                return sum;
            }
            let covered = !grains.is_empty() && imprint.row_is_covered(row.j, row.k);
            for at in row.shifted(0) {
                let open = if covered { 1.0 - alpha[at].min(1.0) } else { 1.0 };
                let part = open * c[at];
                (0..3).for_each(|d| sum[d] += part * u[d][at]);
                sum[3] += part;
            }
            sum
        });
        let [x, y, z, volume] = domain.sum(sum);
        let density = flow.fluids.liquid_density * domain.grid().cell_volume();
        let report = held.answer(dt, density * Vector::new(x, y, z), density * volume);
        self.mean_flow = Some(held);
        Some(report)
    }
}
