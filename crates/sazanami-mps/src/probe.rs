//! The discrete operators of the step on a given arrangement of particles, for verification against exact values.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::particles::{Bins, ParticleColumns, SpatialOrder};
use sazanami_numerics::{Real, Vector};

use crate::boundary::WallFriction;
use crate::context::Voids;
use crate::gradient::{PressureField, gradient_of};
use crate::matrix::Block;
use crate::neighbours::{Neighbours, ROWS};
use crate::number_density::{self, NumberDensity, PredictedPairs, Prediction, Sample};
use crate::particles::{Kind, ParticleRecord, Particles, Role};
use crate::scheme::{Kernel, Scheme};
use crate::viscosity::ViscousField;

/// Fluid particles of spacing 1 without walls, all with the same inverse void fraction.
pub struct Probe {
    kernel: Kernel,
    particles: Particles,
    neighbours: Neighbours,
    inverse_void: Vec<Real>,
    equation: Vec<Block>,
}

/// Sums over the neighbours of a particle at the start of a step.
#[derive(Clone, Copy, Debug)]
pub struct FlowSums {
    /// Number density (sum of weights).
    pub density: Real,
    /// Rate of compression, `-div u` [1/s].
    pub rate: Real,
    /// Laplacian of the velocity [1/(m s)].
    pub laplacian: Vector,
}

impl Probe {
    /// Particles at `positions` in the cube between 0 and `width` \[m], each with the inverse void fraction
    /// `inverse_void`, sorted as in [`Self::positions`].
    #[must_use]
    pub fn new(scheme: Scheme, positions: &[Vector], width: Real, inverse_void: Real) -> Self {
        let kernel = Kernel::new(scheme, 1.0);
        let cells = ((width / kernel.weight.radius).floor() as usize).max(1);
        let domain = Domain::solo(Grid::new([cells; 3], Vector::ZERO, Vector::splat(width)), [false; 3]);
        let mut particles = Particles::default();
        for (n, &position) in positions.iter().enumerate() {
            particles.push(&ParticleRecord::new(n as u64, Kind::Fluid, position, Vector::ZERO));
        }
        let mut bins = Bins::default();
        bins.renew(&domain, kernel.weight.radius);
        SpatialOrder::default()
            .sort(&mut particles, bins.len(), |of: &Particles, a| (bins.number(of.position[a]), of.id[a]));
        bins.fill(&particles.position, &[]);
        let mut neighbours = Neighbours::default();
        neighbours.renew(&bins, &particles, kernel.weight.radius, Vector::ZERO, |_| Vector::ZERO);
        particles.role.fill(Role::Unknown);
        let inverse_void = vec![inverse_void; particles.owned];
        let mut probe = Self { kernel, particles, neighbours, inverse_void, equation: Vec::new() };
        probe.assemble();
        probe
    }

    fn samples(&self, velocity: &[Vector]) -> Vec<Sample> {
        let mut samples = Vec::new();
        let voids = Voids {
            inverse: self.inverse_void.clone(),
            inverse_rate: vec![0.0; velocity.len()],
            grain_mobility: Vec::new(),
        };
        number_density::sample((&self.particles.position, velocity), &voids, &mut samples);
        samples
    }

    /// Coefficients of the pressure equation.
    fn assemble(&mut self) {
        let owned = self.particles.owned;
        let blocks = owned.div_ceil(ROWS);
        let samples = self.samples(&vec![Vector::ZERO; owned]);
        let mobility: Vec<Real> = self.inverse_void.iter().map(|inverse| 1.0 / inverse).collect();
        self.equation = vec![Block::default(); blocks];
        let mut sums = vec![Prediction::default(); blocks * ROWS];
        let pairs = PredictedPairs { kind: &self.particles.kind, samples: &samples, mobility: &mobility };
        number_density::prediction(&self.kernel, 1.0, &self.neighbours, &pairs, &mut self.equation, &mut sums);
    }

    /// Positions of the particles \[m].
    #[must_use]
    pub fn positions(&self) -> &[Vector] {
        &self.particles.position
    }

    /// Number density, rate of compression and Laplacian for a velocity at each particle [m/s].
    #[must_use]
    pub fn flow(&self, velocity: &[Vector]) -> Vec<FlowSums> {
        let mut found = vec![NumberDensity::default(); velocity.len()];
        let (samples, kind) = (self.samples(velocity), &self.particles.kind);
        let viscous = ViscousField { velocity, kind, friction: WallFriction::NoSlip };
        number_density::at_start(&self.kernel, &self.neighbours, &samples, &viscous, &mut found);
        let sums = |c: &NumberDensity| FlowSums { density: c.density, rate: c.rate, laplacian: c.laplacian.total };
        found.iter().map(sums).collect()
    }

    /// Neighbours of particle `a` in the pressure equation, with their coefficients [1/m^2].
    pub fn pressure_row(&self, a: usize) -> impl ExactSizeIterator<Item = (usize, Real)> {
        let (columns, coefficients) = self.equation[a / ROWS].row(a % ROWS);
        columns.iter().zip(coefficients).map(|(&b, &c)| (b as usize, Real::from(c)))
    }

    /// Gradient of a pressure \[Pa] at each particle [Pa/m].
    #[must_use]
    pub fn gradient(&self, pressure: &[Real]) -> Vec<Vector> {
        let Particles { kind, position, role, owned, .. } = &self.particles;
        let (inverse_void, weight_of_fluid) = (&self.inverse_void[..], Vector::ZERO);
        let field = PressureField { pressure, position, inverse_void, roles: role, kind, weight_of_fluid };
        let (mut found, mut uncorrected) = (vec![Vector::ZERO; *owned], vec![false; *owned]);
        gradient_of(&self.kernel, &self.equation, &field, &mut found, &mut uncorrected);
        found
    }
}
