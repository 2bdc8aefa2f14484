//! Setting up a solver.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::particles::{ParticleColumns as _, WALL};
use sazanami_numerics::{Real, Vector};

use super::published::PublishedColumns;
use super::{FluidParticle, Solver};
use crate::arrangement::Arrangement;
use crate::boundary::Tank;
use crate::error::SetupError;
use crate::gates;
use crate::ghosts::Periods;
use crate::grains::OverlappingGrains;
use crate::particles::{Kind, ParticleRecord, Particles};
use crate::pressure::PressureEquation;
use crate::scheme::{CONJUGATE_RADIUS, Kernel, ParticleProjection};
use crate::settings::ParticleSettings;
use crate::surface_test::SurfaceTest;
use crate::walls::Walls;

impl Solver {
    /// A tank with fluid and grains. Every rank passes all fluid particles and keeps those in its part of the domain.
    ///
    /// # Errors
    /// [`SetupError`] if the box does not fit the particle spacing or the radius of influence.
    pub fn new(
        domain: Domain,
        settings: ParticleSettings,
        tank: Tank,
        fluid: &[FluidParticle],
        grains: OverlappingGrains,
    ) -> Result<Self, SetupError> {
        let fluid = fluid.iter().enumerate();
        let records: Vec<ParticleRecord> =
            fluid.map(|(n, p)| ParticleRecord::new(n as u64, Kind::Fluid, p.position, p.velocity)).collect();
        Self::from_records(domain, settings, tank, &records, grains)
    }

    /// A solver from the state of fluid and walls; wall particles missing in `records` are created at rest.
    pub(crate) fn from_records(
        domain: Domain,
        settings: ParticleSettings,
        tank: Tank,
        records: &[ParticleRecord],
        mut grains: OverlappingGrains,
    ) -> Result<Self, SetupError> {
        let radius = settings.scheme.radius;
        if !(2.1..=3.6).contains(&radius) {
            return Err(SetupError::Radius { radius });
        }
        let conjugate = settings.scheme.projection == ParticleProjection::Conjugate;
        if conjugate && radius < CONJUGATE_RADIUS {
            return Err(SetupError::ConjugateRadius { radius });
        }
        if !conjugate && !tank.gates.is_empty() {
            return Err(SetupError::Gates);
        }
        let widening = if conjugate { grains.widest_size() } else { 1.0 };
        let kernel = Kernel::new(settings.scheme, settings.fluid.spacing);
        let periods = Periods::of(&domain);
        for direction in 0..3 {
            let (length, needed) = (periods.length[direction], 2.0 * widening * kernel.weight.radius);
            if length > 0.0 && length < needed {
                return Err(SetupError::BoxTooShort { direction, length, needed });
            }
        }
        let room = gates::room(widening * kernel.weight.radius, grains.smoothing());
        if !tank.has_room_for_gates(room) {
            return Err(SetupError::GatesTooNear { room });
        }
        let mut walls = tank.particles(settings.fluid.spacing, kernel.weight.radius)?;
        let initial = Walls::new(&tank, tank.lattice(settings.fluid.spacing)?, &walls);
        let water = records.iter().filter(|record| record.id < WALL).count() as Real * settings.fluid.spacing.powi(3);
        let full = tank.is_full(water + grains.solid_volume(&domain));
        grains.expect_drag(&domain, &tank);
        let me = domain.communicator().rank();
        let mut particles = Particles::default();
        for known in records.iter().filter(|record| record.id >= WALL) {
            if let Some(wall) = walls.get_mut((known.id - WALL) as usize) {
                *wall = *known;
            }
        }
        for record in records.iter().filter(|record| record.id < WALL).chain(&walls) {
            let position = periods.wrapped(Vector::from_array(record.position));
            if domain.owner_of(position) == me {
                particles.push(&ParticleRecord { position: position.to_array(), ..*record });
            }
        }
        particles.owned = particles.len();
        Ok(Self {
            surface: (!full).then(|| SurfaceTest::of(&kernel.sums)),
            grains,
            domain,
            periods,
            settings,
            tank,
            kernel,
            particles,
            walls: initial,
            largest_viscosity: 0.0,
            near: Arrangement::default(),
            equation: PressureEquation::default(),
            published: PublishedColumns::default(),
            conjugate: crate::conjugate::ConjugateColumns::default(),
            mean_flow: None,
        })
    }
}
