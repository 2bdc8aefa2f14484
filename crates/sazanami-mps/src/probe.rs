//! The operators of the step on given particles, one at a time, to be compared with what they are exactly.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use crate::boundary::WallFriction;
use crate::matrix::Block;
use crate::neighbours::{Bins, Neighbours, ROWS};
use crate::number_density::{self, Crowding, Prediction, Sample};
use crate::operators::{PressureField, gradient};
use crate::particles::{Kind, ParticleRecord, Particles, Role};
use crate::scheme::{GradientForm, Kernel, Scheme};

/// Fluid particles of spacing 1 without walls, all of one bulk volume.
pub struct Probe {
    kernel: Kernel,
    particles: Particles,
    neighbours: Neighbours,
    bulk: Vec<Real>,
    equation: Vec<Block>,
}

/// Sums over the neighbours of a particle before the pressure is known.
#[derive(Clone, Copy, Debug)]
pub struct FlowSums {
    /// Number density [1/m^3, times the reference volume].
    pub density: Real,
    /// Rate of compression, `-div u` [1/s].
    pub rate: Real,
    /// Laplacian of the velocity [1/(m s)].
    pub laplacian: Vector,
}

impl Probe {
    /// Particles at `positions` in the cube between 0 and `width` [m], each of `bulk` spacings cubed. They are put in the
    /// order of [`Self::positions`].
    #[must_use]
    pub fn new(scheme: Scheme, positions: &[Vector], width: Real, bulk: Real) -> Self {
        let kernel = Kernel::new(scheme, 1.0);
        let cells = ((width / kernel.weight.radius).floor() as usize).max(1);
        let domain = Domain::solo(Grid::new([cells; 3], Vector::ZERO, Vector::splat(width)), [false; 3]);
        let mut particles = Particles::default();
        for (n, &position) in positions.iter().enumerate() {
            particles.push(&ParticleRecord::new(n as u64, Kind::Fluid, position, Vector::ZERO));
        }
        let mut bins = Bins::default();
        bins.renew(&domain, kernel.weight.radius);
        particles.sort(bins.len(), |x| bins.number(x));
        bins.fill(&particles.position, &[]);
        let mut neighbours = Neighbours::default();
        neighbours.renew(&bins, &particles, kernel.weight.radius, Vector::ZERO, |_| Vector::ZERO);
        particles.role.fill(Role::Unknown);
        let bulk = vec![bulk; particles.owned];
        let mut probe = Self { kernel, particles, neighbours, bulk, equation: Vec::new() };
        probe.assemble();
        probe
    }

    fn samples(&self, velocity: &[Vector]) -> Vec<Sample> {
        let mut samples = Vec::new();
        let still = vec![0.0; velocity.len()];
        number_density::sample(&self.particles.position, velocity, &self.bulk, &still, &mut samples);
        samples
    }

    /// Coefficients of the pressure equation.
    fn assemble(&mut self) {
        let owned = self.particles.owned;
        let blocks = owned.div_ceil(ROWS);
        let samples = self.samples(&vec![Vector::ZERO; owned]);
        let conductance: Vec<Real> = self.bulk.iter().map(|bulk| 1.0 / bulk).collect();
        self.equation = vec![Block::default(); blocks];
        let mut sums = vec![Prediction::default(); blocks * ROWS];
        let (kind, near) = (&self.particles.kind, &self.neighbours);
        let equation = &mut self.equation;
        number_density::prediction(&self.kernel, 1.0, near, kind, &samples, &conductance, equation, &mut sums);
    }

    /// Positions of the particles [m].
    #[must_use]
    pub fn positions(&self) -> &[Vector] {
        &self.particles.position
    }

    /// Number density, rate of compression and Laplacian for a velocity at each particle [m/s].
    #[must_use]
    pub fn flow(&self, velocity: &[Vector]) -> Vec<FlowSums> {
        let mut found = vec![Crowding::default(); velocity.len()];
        let (samples, kind) = (self.samples(velocity), &self.particles.kind);
        let friction = WallFriction::NoSlip;
        number_density::crowding(&self.kernel, &self.neighbours, kind, &samples, velocity, friction, &mut found);
        let sums = |c: &Crowding| FlowSums { density: c.density, rate: c.rate, laplacian: c.laplacian };
        found.iter().map(sums).collect()
    }

    /// Neighbours of particle `a` in the pressure equation, with their coefficients [1/m^2].
    pub fn pressure_row(&self, a: usize) -> impl ExactSizeIterator<Item = (usize, Real)> {
        let (columns, coefficients) = self.equation[a / ROWS].row(a % ROWS);
        columns.iter().zip(coefficients).map(|(&b, &c)| (b as usize, Real::from(c)))
    }

    /// Gradient of a pressure [Pa] at each particle [Pa/m].
    #[must_use]
    pub fn gradient(&self, form: GradientForm, pressure: &[Real]) -> Vec<Vector> {
        let Particles { kind, position, role, owned, .. } = &self.particles;
        let kernel = Kernel { scheme: Scheme { gradient: form, ..self.kernel.scheme }, ..self.kernel };
        let (bulk, weight_of_fluid) = (&self.bulk[..], Vector::ZERO);
        let field = PressureField { pressure, position, bulk, roles: role, kind, weight_of_fluid };
        let (mut found, mut plain) = (vec![Vector::ZERO; *owned], vec![false; *owned]);
        gradient(&kernel, &mut self.equation.clone(), &field, &mut found, &mut plain);
        found
    }
}
