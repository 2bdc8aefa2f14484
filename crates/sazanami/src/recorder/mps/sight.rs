//! Grains and water of all ranks on rank 0, as an observer sees them.

use bytemuck::{Pod, Zeroable};
use sazanami_mps::solver::Solver;
use sazanami_mps::{Kind, Role};
use sazanami_numerics::{Real, Vector};
use sazanami_observe::ripples::{GrainView, SurfaceProfile, Tank, WaterView, water_surface};

use super::Stock;

/// A grain on its way to rank 0.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct GrainRecord {
    id: u64,
    contacts: u64,
    position: [Real; 3],
    velocity: [Real; 3],
    drag: [Real; 3],
    pressure_force: [Real; 3],
    diameter: Real,
    void_fraction: Real,
    wetness: Real,
}

/// A fluid particle on its way to rank 0.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct WaterRecord {
    id: u64,
    role: u64,
    position: [Real; 3],
    velocity: [Real; 3],
    pressure: Real,
    bulk_volume: Real,
}

/// Grains in the order of their identifiers.
#[derive(Clone, Debug, Default)]
pub(super) struct Grains {
    pub id: Vec<u64>,
    /// Centres [m].
    pub position: Vec<Vector>,
    /// Velocities [m/s].
    pub velocity: Vec<Vector>,
    /// Diameters [m].
    pub diameter: Vec<Real>,
    /// Grains that each one touches.
    pub contacts: Vec<u32>,
    /// Drag, mean over the last step [N].
    pub drag: Vec<Vector>,
    /// Force of the pressure, buoyancy included, mean over the last step [N].
    pub pressure_force: Vec<Vector>,
    /// Void fraction around each, without its own share.
    pub void_fraction: Vec<Real>,
    /// Wet part.
    pub wetness: Vec<Real>,
}

impl Grains {
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }
}

/// Fluid particles in the order of their identifiers.
#[derive(Clone, Debug, Default)]
pub(super) struct Water {
    /// Places [m].
    pub position: Vec<Vector>,
    /// Velocities [m/s].
    pub velocity: Vec<Vector>,
    /// Pressure as the solver has it: without its part at rest, if it was solved for so [Pa].
    pub pressure: Vec<Real>,
    /// `V0 / eps` [m^3].
    pub bulk_volume: Vec<Real>,
    /// Whether each flies free of the others.
    pub splash: Vec<bool>,
    /// 0 within, 1 at the surface, 2 on its own.
    pub place: Vec<u32>,
}

/// Everything in sight, in the frame of the tank; empty on ranks other than 0.
#[derive(Clone, Debug, Default)]
pub(super) struct Sight {
    /// Whether this is rank 0.
    pub leads: bool,
    pub grains: Grains,
    pub water: Water,
    /// Point at which the pressure at rest is zero [m], and density [kg/m^3], if the pressure is without it.
    pub at_rest: Option<(Vector, Real)>,
    /// Velocity of the tank against the solver's frame [m/s].
    pub drift: Vector,
    /// Radius of influence [m].
    pub reach: Real,
    /// Particle spacing [m].
    pub spacing: Real,
}

impl Sight {
    /// Looks again from a tank that is displaced [m] and moves [m/s]. All ranks take part.
    pub fn renew(&mut self, solver: &mut Solver, [shift, drift]: [Vector; 2]) {
        solver.place_grains();
        let domain = solver.domain();
        let settings = *solver.settings();
        let volume = settings.fluid.spacing.powi(3);
        self.leads = domain.communicator().rank() == 0;
        self.at_rest = settings.scheme.reduced_pressure.then_some((settings.reference, settings.fluid.density));
        self.reach = settings.scheme.radius * settings.fluid.spacing;
        self.spacing = settings.fluid.spacing;
        self.drift = drift;
        let phase = solver.grains();
        let engine = phase.engine();
        let all = engine.grains();
        let around = phase.surroundings();
        let mine: Vec<GrainRecord> = (0..all.owned())
            .map(|g| {
                let [drag, pressure_force] = phase.forces(g).map(|force| force.to_array());
                let radius = engine.bodies()[all.shape[g] as usize].bounding_radius * all.scale[g];
                let near = around.get(g).copied().unwrap_or_default();
                GrainRecord {
                    id: all.id[g],
                    contacts: engine.touched_grains(g) as u64,
                    position: (all.position[g] - shift).to_array(),
                    velocity: (all.velocity[g] - drift).to_array(),
                    drag,
                    pressure_force,
                    diameter: 2.0 * radius,
                    void_fraction: near.void_fraction,
                    wetness: near.wetness,
                }
            })
            .collect();
        let mut grains = domain.to_first(&mine);
        grains.sort_unstable_by_key(|record| record.id);
        let particles = solver.particles();
        let mine: Vec<WaterRecord> = (0..particles.owned())
            .filter(|&a| particles.kind[a] == Kind::Fluid)
            .map(|a| WaterRecord {
                id: particles.id[a],
                role: match particles.role[a] {
                    Role::Unknown => 0,
                    Role::Given => 1,
                    Role::Outside => 2,
                },
                position: (particles.position[a] - shift).to_array(),
                velocity: (particles.velocity[a] - drift).to_array(),
                pressure: particles.pressure[a],
                bulk_volume: volume / phase.void_fraction(particles.position[a]),
            })
            .collect();
        let mut water = domain.to_first(&mine);
        water.sort_unstable_by_key(|record| record.id);
        self.unpack(&grains, &water);
    }

    fn unpack(&mut self, grains: &[GrainRecord], water: &[WaterRecord]) {
        fn column<R, T>(records: &[R], of: impl Fn(&R) -> T) -> Vec<T> {
            records.iter().map(of).collect()
        }
        self.grains = Grains {
            id: column(grains, |r| r.id),
            position: column(grains, |r| r.position.into()),
            velocity: column(grains, |r| r.velocity.into()),
            diameter: column(grains, |r| r.diameter),
            contacts: column(grains, |r| r.contacts as u32),
            drag: column(grains, |r| r.drag.into()),
            pressure_force: column(grains, |r| r.pressure_force.into()),
            void_fraction: column(grains, |r| r.void_fraction),
            wetness: column(grains, |r| r.wetness),
        };
        self.water = Water {
            position: column(water, |r| r.position.into()),
            velocity: column(water, |r| r.velocity.into()),
            pressure: column(water, |r| r.pressure),
            bulk_volume: column(water, |r| r.bulk_volume),
            splash: column(water, |r| r.role == 2),
            place: column(water, |r| r.role as u32),
        };
    }

    /// Sums over what is in sight, and over the grains of all ranks. All ranks take part; the sums are on rank 0.
    ///
    /// `gravity` is that of the case [m/s^2].
    pub fn stock(&self, solver: &Solver, gravity: Real) -> Stock {
        let settings = solver.settings();
        let density = settings.fluid.density;
        let floor = solver.tank().lower.z;
        let mass = solver.particle_mass();
        let drift = self.drift;
        let phase = solver.grains();
        let all = phase.engine().grains();
        let closure = &phase.coupling().closure;
        let around = phase.surroundings();
        let mut sums = [0.0; 8];
        for g in 0..all.owned() {
            let radius = phase.engine().bodies()[all.shape[g] as usize].bounding_radius * all.scale[g];
            let volume = sazanami_mps::grains::volume(2.0 * radius);
            let (momentum, drifting) = (all.mass[g] * all.velocity[g], all.mass[g] * drift);
            (0..3).for_each(|d| sums[d] += momentum[d] - drifting[d]);
            sums[3] += all.kinetic_energy(g) - momentum.dot(drift) + 0.5 * drifting.dot(drift);
            sums[4] += (all.mass[g] - density * volume) * gravity;
            sums[5] += (all.mass[g] - density * volume) * gravity * (all.position[g].z - floor);
            sums[6] += all.position[g].z - floor;
            sums[7] += around.get(g).map_or(0.0, |near| closure.bed_share(near.void_fraction));
        }
        let sums = solver.domain().sum(sums);
        let count = self.grains.position.len().max(1) as Real;
        let mut stock = Stock {
            momentum: Vector::from_slice(&sums[..3]),
            grain_energy: sums[3],
            submerged_weight: sums[4],
            potential_energy: sums[5],
            grain_height: sums[6] / count,
            bed_share: sums[7] / count,
            particles: self.water.position.len(),
            front: Real::NEG_INFINITY,
            ..Stock::default()
        };
        let water = &self.water;
        for (n, &velocity) in water.velocity.iter().enumerate() {
            stock.volume += water.bulk_volume[n];
            stock.momentum += mass * velocity;
            stock.fluid_energy += 0.5 * mass * velocity.length_squared();
            stock.potential_energy += density * water.bulk_volume[n] * gravity * (water.position[n].z - floor);
            if !water.splash[n] {
                stock.front = stock.front.max(water.position[n].x + 0.5 * self.spacing);
            }
        }
        stock
    }

    /// The grains, for those who measure beds.
    pub fn grain_view(&self) -> GrainView<'_> {
        let grains = &self.grains;
        GrainView { position: &grains.position, diameter: &grains.diameter, contacts: &grains.contacts }
    }

    /// The water, for those who measure its surface.
    pub fn water_view(&self) -> WaterView<'_> {
        let water = &self.water;
        WaterView { position: &water.position, bulk_volume: &water.bulk_volume, splash: &water.splash }
    }

    /// Surface of the water.
    pub fn surface(&self, tank: &Tank) -> SurfaceProfile {
        water_surface(tank, &self.water_view(), 0.5 * self.spacing, self.spacing)
    }

    /// Whole pressure of particle `n` under a body force [m/s^2], in Pa.
    pub fn pressure(&self, n: usize, body_force: Vector) -> Real {
        let at_rest = self
            .at_rest
            .map_or(0.0, |(reference, density)| density * body_force.dot(self.water.position[n] - reference));
        self.water.pressure[n] + at_rest
    }
}
