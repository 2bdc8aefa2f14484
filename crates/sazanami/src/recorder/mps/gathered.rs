//! Grains and water of all ranks on rank 0, as the observer gathers them.

use bytemuck::{Pod, Zeroable};
use sazanami_dem::Motion;
use sazanami_mps::grains::{diameter_of, volume};
use sazanami_mps::solver::Solver;
use sazanami_mps::weight::Weight;
use sazanami_mps::{Kind, Role};
use sazanami_numerics::{Real, Vector};
use sazanami_observe::ripples::{
    GrainView, Interpolation, SurfaceProfile, TankInside, WaterView, water_level_at, water_surface,
};
use sazanami_posing::assembly::wetted::PlacedLiquids;

use super::TankSums;
use crate::recorder::grain_files::in_tank;

/// Least number of particles within the cut-off for a value at a place.
const FEWEST: usize = 4;

/// A grain as it is sent to rank 0.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct GrainRecord {
    id: u64,
    contacts: u64,
    position: [Real; 3],
    velocity: [Real; 3],
    spin: [Real; 3],
    drag: [Real; 3],
    pressure_force: [Real; 3],
    lift: [Real; 3],
    added_mass_force: [Real; 3],
    diameter: Real,
    void_fraction: Real,
    wetness: Real,
}

/// A fluid particle as it is sent to rank 0.
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
    /// Centres \[m].
    pub position: Vec<Vector>,
    /// Velocities [m/s].
    pub velocity: Vec<Vector>,
    /// Diameters \[m].
    pub diameter: Vec<Real>,
    /// Angular velocities [rad/s].
    pub spin: Vec<Vector>,
    /// Grains that each one touches.
    pub contacts: Vec<u32>,
    /// Drag, mean over the last step \[N].
    pub drag: Vec<Vector>,
    /// Force of the pressure, buoyancy included, mean over the last step \[N].
    pub pressure_force: Vec<Vector>,
    /// Lift, mean over the last step \[N].
    pub lift: Vec<Vector>,
    /// Force of the added mass, mean over the last step \[N].
    pub added_mass_force: Vec<Vector>,
    /// Void fraction around each, without its own share.
    pub void_fraction: Vec<Real>,
    /// Part of its surroundings that is water, 0 to 1.
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
    /// Places \[m].
    pub position: Vec<Vector>,
    /// Velocities [m/s].
    pub velocity: Vec<Vector>,
    /// Pressure as the solver has it: without its part at rest, if it was solved for so \[Pa].
    pub pressure: Vec<Real>,
    /// `V0 / eps` [m^3].
    pub bulk_volume: Vec<Real>,
    /// Whether each is isolated.
    pub splash: Vec<bool>,
    /// 0 within, 1 at the surface, 2 isolated.
    pub place: Vec<u32>,
}

/// Grains and water of all ranks, in the frame of the tank; empty on ranks other than 0.
#[derive(Clone, Debug, Default)]
pub(super) struct GatheredTank {
    /// Whether this is rank 0.
    pub leads: bool,
    pub grains: Grains,
    /// Mean forces of contacts over the last step on the grains that are watched, by their identifiers \[N].
    pub watched: Vec<(u64, Vector)>,
    pub water: Water,
    /// Point, in the frame of the tank, at which the pressure at rest is zero \[m].
    pub reference: Vector,
    /// Density along directions of whose body force the pressure is without its part at rest, zero along others [kg/m^3].
    pub reduced_density: Vector,
    /// Displacement of the tank in the solver's frame \[m].
    pub shift: Vector,
    /// Velocity of the tank against the solver's frame [m/s].
    pub drift: Vector,
    /// Cut-off of the weights \[m].
    pub cutoff: Real,
    /// Particle spacing \[m].
    pub spacing: Real,
}

impl GatheredTank {
    /// Gathers again, from a tank that is displaced \[m] and moves [m/s]. All ranks take part.
    pub fn renew(&mut self, solver: &mut Solver, [shift, drift]: [Vector; 2]) {
        solver.place_grains();
        let domain = solver.domain();
        let settings = *solver.settings();
        let volume = settings.fluid.spacing.powi(3);
        self.leads = domain.communicator().rank() == 0;
        self.reference = settings.reference - shift;
        self.reduced_density = settings.fluid.density * solver.reduced_force(Vector::ONE);
        self.cutoff = settings.scheme.radius * settings.fluid.spacing;
        self.spacing = settings.fluid.spacing;
        (self.shift, self.drift) = (shift, drift);
        let phase = solver.grains();
        let engine = phase.engine();
        let all = engine.grains();
        let grain = |g: usize| {
            let [drag, pressure_force, lift, added_mass_force] = phase.forces(g).map(|force| force.to_array());
            let [void_fraction, wetness] = phase.surroundings(g);
            GrainRecord {
                id: all.id[g],
                contacts: engine.touched_grains(g) as u64,
                position: in_tank(domain, all.position[g], shift).to_array(),
                velocity: (all.velocity[g] - drift).to_array(),
                spin: all.angular_velocity(g).to_array(),
                drag,
                pressure_force,
                lift,
                added_mass_force,
                diameter: diameter_of(engine, g),
                void_fraction,
                wetness,
            }
        };
        let grains = domain.to_first_by((0..all.owned()).map(grain), |record| record.id);
        let whole = |&(id, force): &(u64, Vector)| (id, Vector::from_array(domain.sum(force.to_array())));
        self.watched.clear();
        self.watched.extend(engine.watched().iter().map(whole));
        let particles = solver.particles();
        let particle = |a: usize| WaterRecord {
            id: particles.id[a],
            role: match particles.role[a] {
                Role::Unknown => 0,
                Role::Dirichlet => 1,
                Role::Inactive => 2,
            },
            position: in_tank(domain, particles.position[a], shift).to_array(),
            velocity: (particles.velocity[a] - drift).to_array(),
            pressure: particles.pressure[a],
            bulk_volume: volume / phase.void_fraction(particles.position[a]),
        };
        let fluid = (0..particles.owned()).filter(|&a| particles.kind[a] == Kind::Fluid);
        let water = domain.to_first_by(fluid.map(particle), |record| record.id);
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
            spin: column(grains, |r| r.spin.into()),
            diameter: column(grains, |r| r.diameter),
            contacts: column(grains, |r| r.contacts as u32),
            drag: column(grains, |r| r.drag.into()),
            pressure_force: column(grains, |r| r.pressure_force.into()),
            lift: column(grains, |r| r.lift.into()),
            added_mass_force: column(grains, |r| r.added_mass_force.into()),
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

    /// Sums over what was gathered, and over the grains of all ranks. All ranks take part; the sums are on rank 0.
    ///
    /// Weights and energies are those under a `force` per mass [m/s^2]. Grains weigh less by the water that they displace, as far as there is
    /// water around them; those that no step has looked at lie in the liquids of the start. Along periodic sides there is no height.
    pub fn sums(&self, solver: &Solver, force: Vector, start: &PlacedLiquids) -> TankSums {
        let settings = solver.settings();
        let density = settings.fluid.density;
        let tank = solver.tank();
        let lower = tank.lower;
        let [is_wet] = solver.sum_over_fluid(|_, _| [1.0]).map(|particles| particles > 0.0);
        let periodic = solver.domain().periodic();
        let uphill = Vector::from_array(std::array::from_fn(|d| if periodic[d] { 0.0 } else { -force[d] }));
        let mass = solver.particle_mass();
        let drift = self.drift;
        let phase = solver.grains();
        let all = phase.engine().grains();
        let drag = &phase.coupling().drag;
        let mut sums = [0.0; 9];
        for g in 0..all.owned() {
            let diameter = diameter_of(phase.engine(), g);
            let volume = volume(diameter);
            let (momentum, drifting) = (all.mass[g] * all.velocity[g], all.mass[g] * drift);
            (0..3).for_each(|d| sums[d] += momentum[d] - drifting[d]);
            sums[3] += all.kinetic_energy(g) - momentum.dot(drift) + 0.5 * drifting.dot(drift);
            let [void_fraction, _] = phase.surroundings(g);
            let place = in_tank(solver.domain(), all.position[g], self.shift);
            let wet = match () {
                () if !is_wet => 0.0,
                () if void_fraction > 0.0 => phase.submerged(g),
                () => start.part(place, diameter),
            };
            let submerged = all.mass[g] - density * volume * wet;
            let place = place - lower;
            sums[5] += (submerged * uphill).dot(place);
            if all.motion[g] == Motion::Free {
                sums[4] -= submerged * force.z;
                // What free grains do to each other cancels: what carries them is left.
                sums[8] += all.contact_force[g].z;
            }
            sums[6] += place.z;
            sums[7] += if void_fraction > 0.0 { drag.bed_share(void_fraction) } else { 0.0 };
        }
        let sums = solver.domain().sum(sums);
        let count = self.grains.position.len().max(1) as Real;
        let mut sums = TankSums {
            momentum: Vector::from_slice(&sums[..3]),
            grain_energy: sums[3],
            submerged_weight: sums[4],
            carried_weight: sums[8],
            potential_energy: sums[5],
            grain_height: sums[6] / count,
            bed_share: sums[7] / count,
            particles: self.water.position.len(),
            front: Real::NEG_INFINITY,
            ..TankSums::default()
        };
        let water = &self.water;
        for (n, &velocity) in water.velocity.iter().enumerate() {
            sums.volume += water.bulk_volume[n];
            sums.momentum += mass * velocity;
            sums.fluid_energy += 0.5 * mass * velocity.length_squared();
            sums.potential_energy += (density * water.bulk_volume[n] * uphill).dot(water.position[n] - lower);
            if !water.splash[n] {
                sums.front = sums.front.max(water.position[n].x + 0.5 * self.spacing);
            }
        }
        sums
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

    /// Means over the water around places.
    pub fn around<'a>(&'a self, tank: &'a TankInside) -> Interpolation<'a, impl Fn(Real) -> Real> {
        let weight = Weight { radius: self.cutoff };
        Interpolation {
            tank,
            position: &self.water.position,
            volume: &self.water.bulk_volume,
            reach: self.cutoff,
            kernel: move |distance| weight.value(distance),
            least: FEWEST,
        }
    }

    /// Surface of the water.
    pub fn surface(&self, tank: &TankInside) -> SurfaceProfile {
        water_surface(tank, &self.water_view(), 0.5 * self.spacing, self.spacing)
    }

    /// Height of the surface of the water at a place in x1 and x2 \[m].
    pub fn level_at(&self, tank: &TankInside, place: [Real; 2]) -> Option<Real> {
        water_level_at(tank, &self.water_view(), place, self.spacing)
    }

    /// Whole pressure of particle `n` under a body force [m/s^2], in Pa.
    pub fn pressure(&self, n: usize, body_force: Vector) -> Real {
        self.water.pressure[n] + (self.reduced_density * body_force).dot(self.water.position[n] - self.reference)
    }
}
