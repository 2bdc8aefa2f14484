//! Projection with a pressure force that is the negative transpose of the divergence.
//!
//! Every fluid particle has an unknown pressure; walls are mirrors ([`mirrors`]). Equations, constants and what they were
//! chosen by are in `docs/decisions/0018-scheme-of-moving-particles.md`. A step: pairs, moments and velocity gradients;
//! viscosity and damping of pairs; projection; motion and shifting. All sums are taken at the positions at its start.

pub(crate) mod eddies;
pub(crate) mod exchange;
mod mirrors;
mod operators;
mod pairs;
pub(crate) mod shift;
mod still;
pub(crate) mod surroundings;
mod voids;

use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::arrangement::Arrangement;
use crate::boundary::Tank;
use crate::context::{Context, Motion};
use crate::free_surface;
use crate::gates::Gate;
use crate::ghosts::Ghosts;
use crate::grains::{OverlappingGrains, VoidReport};
use crate::matrix::{Block, CLOSE_RADIUS, Layout, Row};
use crate::moments::Symmetric;
use crate::momentum::FluidImpulses;
use crate::neighbours::ROWS;
use crate::number_density::NumberDensity;
use crate::particles::{Kind, Particles, Role};
use crate::pressure::{PressureEquation, PressureError, PressureReport};
use crate::reductions::{largest, set_column, sum_of};
use crate::report::StepReport;
use crate::scheme::Turbulence;
use crate::weight::Weight;
use eddies::Eddies;
use exchange::{Fields, Received, SlipPlanes};
pub(crate) use mirrors::Mirrors;
use operators::Conjugate;
pub(crate) use operators::Operators;
use pairs::{Pairs, Search};
use still::Still;
use surroundings::{Near, PairSums, Surroundings};
use voids::VoidColumns;

/// Damping number of the motion between pairs that is not linear: this part of a step over the flow time scale, at most
/// [`MOST_DAMPED`].
const DAMPED: Real = 0.2;
const MOST_DAMPED: Real = 0.5;

/// Part of the fluid particles that a free surface has at least: that of water a thousand particles deep. Of those inside a
/// disordered arrangement 5e-5 pass for surface.
const LEAST_SURFACE: Real = 1e-3;

/// Columns over particles, kept for their memory.
#[derive(Debug, Default)]
pub(crate) struct ConjugateColumns {
    pub voids: VoidColumns,
    pub pairs: Pairs,
    /// Velocities relative to the walls [m/s].
    velocity: Vec<Vector>,
    /// `B` of each particle and ghost.
    pub inverse: Vec<Symmetric>,
    /// Velocity gradient of each particle and ghost [1/s].
    gradient: Vec<Matrix>,
    /// Sums of the coefficients of each own particle, by whole blocks.
    sums: Vec<[Real; 4]>,
    /// `(grad eps)/eps` at each own particle, by whole blocks [1/m].
    slope: Vec<Vector>,
    pub surroundings: Vec<Surroundings>,
    pub received: Vec<Received>,
    /// Eddy viscosity, if the scheme has one.
    eddies: Option<Eddies>,
    /// Stress of the damping of each particle and ghost [m^2/s].
    pub stress: Vec<Symmetric>,
    /// Force and pressure of each particle and ghost in a product.
    force: Vec<[Real; 4]>,
    ways: Vec<Vector>,
    pub divergence: Vec<Real>,
    /// Divergence of the grains' share in the motion by the old pressure [1/s].
    shares: Vec<Real>,
    /// Pressure of water at rest.
    still: Still,
    /// Whether there is neither a surface nor a gate: nothing fixes the level of the pressure.
    closed: bool,
    /// Means of `ways`.
    means: Vec<Vector>,
    /// Whether grains move with the pressure of the step.
    pub moves_grains: bool,
    /// Velocity changes by drag [m/s].
    pub drag: Vec<Vector>,
    roles: Vec<u8>,
    /// Unknown pressures: those of all fluid.
    unknown: Vec<Role>,
    start: Vec<NumberDensity>,
    pub new: Motion,
}

impl ConjugateColumns {
    /// `D` and `G` at the start of the step.
    pub fn operators(&self) -> Operators<'_> {
        Operators { pairs: &self.pairs, sums: &self.sums, slope: &self.slope }
    }

    /// Coefficients of the operators from `B`.
    pub fn weigh(&mut self, blocks: &[Block]) {
        let bulk = self.voids.bulk();
        self.pairs.weigh(blocks, &self.inverse, &bulk, (&mut self.sums, &mut self.slope));
    }

    /// Pairs, moments, velocity gradients and roles at the start of the step.
    pub fn sum_over_pairs(
        &mut self,
        step: &Context<'_>,
        (mirrors, widest): (&Mirrors<'_>, Real),
        near: &mut Arrangement,
        particles: &mut Particles,
        equation: &mut PressureEquation,
    ) {
        self.closed = step.surface.is_none() && mirrors.gates.iter().all(Gate::is_gone);
        let Arrangement { ghosts, bins, neighbours, .. } = near;
        let Particles { kind, role, position, velocity, owned, .. } = particles;
        let (owned, count, walls) = (*owned, kind.len(), step.forcing.wall_velocity);
        set_column(&mut self.velocity, count, |a| velocity[a] - walls);
        let fluid = |a: usize| if kind[a] == Kind::Fluid { Role::Unknown } else { Role::Inactive };
        set_column(&mut self.unknown, count, fluid);
        let bulk = self.voids.bulk();
        let search = Search { kernel: step.kernel, mirrors, bins, neighbours, kind, position, bulk, widest };
        self.pairs.renew(&search, &mut equation.blocks, &mut equation.rows);
        self.inverse.resize(count, [0.0; 6]);
        self.gradient.resize(count, Matrix::ZERO);
        self.sums.resize(equation.rows.len(), [0.0; 4]);
        self.slope.resize(equation.rows.len(), Vector::ZERO);
        self.surroundings.resize(owned, Surroundings::default());
        surroundings::surround(
            step.kernel,
            &Near::new(step.settings.fluid.spacing),
            step.surface.is_some(),
            (&self.pairs, &equation.blocks),
            (kind, &self.velocity),
            &bulk,
            PairSums {
                inverse: &mut self.inverse[..owned],
                gradient: &mut self.gradient[..owned],
                surroundings: &mut self.surroundings,
            },
        );
        ghosts.refresh(step.domain, &mut self.inverse);
        ghosts.refresh(step.domain, &mut self.gradient);
        self.weigh(&equation.blocks);
        let surroundings = &self.surroundings[..];
        let lists = neighbours.blocks();
        set_column(&mut self.roles, count, |a| match kind[a] {
            _ if a >= owned => 0,
            Kind::Fluid => surroundings[a].role.number(),
            // Walls without fluid beside them have no list.
            Kind::Wall if !lists[a / ROWS].of(a % ROWS).is_empty() => Role::Unknown.number(),
            Kind::Wall | Kind::Dummy => Role::Inactive.number(),
        });
        free_surface::share(step.domain, ghosts, &mut self.roles, role);
        let (pairs, role) = (&self.pairs, &role[..]);
        let outside = |blocks: &[Block], a: usize| {
            role[a] != Role::Unknown || pairs.of(blocks, a).any(|pair| role[pair.particle] != Role::Unknown)
        };
        let PressureEquation { blocks, rows, .. } = equation;
        for_each_chunk(&mut rows[..owned], ROWS, |number, rows| {
            for (row, entry) in rows.iter_mut().enumerate().filter(|(_, entry)| entry.diagonal > 0.0) {
                entry.beside_surface = outside(blocks, number * ROWS + row);
            }
        });
        self.close_inside_beds(step, role, &mut equation.rows[..owned]);
    }

    /// Takes missing neighbours out of the rows between grains that see no surface, where there is one: disorder and sizes
    /// that differ would let the pressure leak, and the water becomes denser until nothing seems to be missing. In a box that is
    /// closed all rows are. In other clear water the leak is small, and tilted water is stiller with it.
    ///
    /// There is a surface where more than [`LEAST_SURFACE`] of the fluid that is not isolated lies at it: isolated particles,
    /// and single ones inside that pass for surface, close no rows.
    pub(crate) fn close_inside_beds(&self, step: &Context<'_>, role: &[Role], rows: &mut [Row]) {
        if self.voids.bulk().clear && !self.closed {
            return;
        }
        let unknown = &self.unknown[..];
        let fluid = |a: usize| unknown[a] == Role::Unknown && role[a] != Role::Inactive;
        let [surface, all] = step.domain.sum(sum_of(rows.len(), |a| {
            let at_surface = fluid(a) && role[a] == Role::Dirichlet;
            [at_surface, fluid(a)].map(|is| if is { 1.0 } else { 0.0 })
        }));
        if !self.closed && surface <= LEAST_SURFACE * all {
            return;
        }
        let (sums, inverse_void) = (&self.sums[..], self.voids.bulk().inverse_void);
        for_each_chunk(rows, ROWS, |number, rows| {
            for (row, entry) in rows.iter_mut().enumerate().filter(|(_, entry)| !entry.beside_surface) {
                let a = number * ROWS + row;
                if self.closed || inverse_void[a] > 1.0 {
                    entry.diagonal = sums[a][3];
                }
            }
        });
    }

    /// Counts of roles and the volume strain; returns the number of pairs nearer than half a spacing.
    pub fn count_roles(
        &mut self,
        step: &Context<'_>,
        particles: &Particles,
        equation: &PressureEquation,
        report: &mut StepReport,
    ) -> usize {
        let (owned, surroundings) = (particles.owned, &self.surroundings[..]);
        set_column(&mut self.start, owned, |a| NumberDensity {
            density: surroundings[a].density,
            ..Default::default()
        });
        report.set_surface(&free_surface::report(step, particles, &equation.rows, &self.start));
        let ends = sum_of(owned, |a| [Real::from(surroundings[a].collided)]);
        (0.5 * step.domain.sum(ends)[0]).round() as usize
    }

    /// Mixing lengths over the bed as it is, where turbulence is put in.
    pub fn measure_mixing_lengths(&mut self, step: &Context<'_>, tank: &Tank, grains: &OverlappingGrains) {
        if step.settings.scheme.turbulence == Turbulence::MixingLength {
            self.eddies.get_or_insert_default().measure(step, tank, grains);
        }
    }

    /// Eddy viscosity by the velocity gradients; returns the largest viscosity, fluid and eddies together [m^2/s].
    pub fn set_eddy_viscosity(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        near: &mut Arrangement,
        particles: &Particles,
    ) -> Real {
        let gradient = &self.gradient[..];
        let set = |eddies: &mut Eddies| eddies.set(step, tank, (particles, gradient), &mut near.ghosts);
        self.eddies.as_mut().map_or(step.settings.fluid.viscosity, set)
    }

    /// Square of the friction velocity of each particle and ghost, and the longest mixing length, where turbulence is put in.
    pub fn eddies(&self) -> Option<(&[Vector], Real)> {
        self.eddies.as_ref().map(|eddies| (&eddies.turbulence[..], eddies.longest))
    }

    /// Viscosity, damping and mean gradients of the neighbours at the start of the step.
    pub fn exchange(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        near: &mut Arrangement,
        particles: &Particles,
        equation: &PressureEquation,
    ) {
        let (owned, friction) = (particles.owned, SlipPlanes::of(tank));
        self.received.resize(owned, Received::default());
        self.stress.resize(particles.len(), [0.0; 6]);
        let bulk = self.voids.bulk();
        let eddies = self.eddies.as_ref().map(|eddies| &eddies.relative[..]);
        let fields = Fields { kind: &particles.kind, velocity: &self.velocity, gradient: &self.gradient, bulk, eddies };
        let (into, pairs) = ((&mut self.received[..], &mut self.stress[..owned]), (&self.pairs, &equation.blocks[..]));
        exchange::exchange(step.kernel, &friction, pairs, &fields, into);
        near.ghosts.refresh(step.domain, &mut self.stress);
        let moments = (&self.stress[..], &self.inverse[..]);
        exchange::add_stress(pairs, (&particles.kind, &bulk), moments, &mut self.received);
    }

    /// Velocities with viscosity, body force and damping, without the pressure; returns the work of the damping \[J].
    pub fn add_viscosity_and_body_force(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        near: &mut Arrangement,
        particles: &Particles,
        equation: &PressureEquation,
    ) -> Real {
        let owned = particles.owned;
        self.exchange(step, tank, near, particles, equation);
        let damping = (DAMPED * step.dt / step.flow_time).min(MOST_DAMPED);
        let (viscosity, force) = (step.settings.fluid.viscosity, step.forcing.body_force);
        let kind = &particles.kind[..];
        for_each_chunk((&mut self.velocity[..owned], &mut self.received[..]), ROWS, |number, (velocity, received)| {
            for (row, (u, received)) in velocity.iter_mut().zip(received).enumerate() {
                received.laplacian *= viscosity * step.dt;
                received.damping *= damping;
                if kind[number * ROWS + row] == Kind::Fluid {
                    *u += received.laplacian + step.dt * force;
                }
            }
        });
        let (velocity, received) = (&self.velocity[..], &self.received[..]);
        let [work] = sum_of(owned, |a| [(velocity[a] + 0.5 * received[a].damping).dot(received[a].damping)]);
        for_each_chunk(&mut self.velocity[..owned], ROWS, |number, velocity| {
            velocity.iter_mut().zip(&received[number * ROWS..]).for_each(|(u, received)| *u += received.damping);
        });
        near.ghosts.refresh(step.domain, &mut self.velocity);
        step.particle_mass() * step.domain.sum([work])[0]
    }

    /// Impulses but that of the pressure. Forces between particles cancel, so that all of a sum comes from walls.
    pub fn impulses(&self, step: &Context<'_>, particles: &Particles) -> FluidImpulses {
        let (kind, received) = (&particles.kind[..], &self.received[..]);
        let sums = step.domain.sum(sum_of(particles.owned, |a| {
            let Received { laplacian: friction, damping, .. } = received[a];
            let one = if kind[a] == Kind::Fluid { 1.0 } else { 0.0 };
            [one, friction.x, friction.y, friction.z, damping.x, damping.y, damping.z]
        }));
        let mass = step.particle_mass();
        FluidImpulses {
            body_force: mass * sums[0] * step.dt * step.forcing.body_force,
            wall_pressure: Vector::ZERO,
            friction: mass * Vector::from_slice(&sums[1..4]),
            contact: mass * Vector::from_slice(&sums[4..]),
        }
    }

    /// Velocities and positions without the new pressure, with the velocity changes `drag` [m/s] if they are known.
    pub fn predict(
        &mut self,
        step: &Context<'_>,
        particles: &Particles,
        drag: Option<&[Vector]>,
        near: &mut Arrangement,
    ) {
        self.new.resize(particles.len());
        let (free, walls, owned) = (&self.velocity[..], step.forcing.wall_velocity, particles.owned);
        let Particles { kind, position, velocity: present, .. } = particles;
        let new = (&mut self.new.velocity[..owned], &mut self.new.position[..owned]);
        for_each_chunk(new, ROWS, |number, (velocity, place)| {
            for (row, (u, x)) in velocity.iter_mut().zip(place).enumerate() {
                let a = number * ROWS + row;
                *u = present[a];
                if kind[a] == Kind::Fluid {
                    *u = free[a] + walls + drag.map_or(Vector::ZERO, |drag| drag[a]);
                }
                *x = step.periods.rounded(position[a] + step.dt * *u);
            }
        });
        self.new.refresh(step.domain, &mut near.ghosts);
    }

    /// Takes over the predicted velocities, drag included, and the rates of the void fraction there.
    pub fn take_predicted_velocities(
        &mut self,
        step: &Context<'_>,
        tank: &mut Tank,
        particles: &Particles,
        grains: &mut OverlappingGrains,
    ) -> VoidReport {
        let (walls, predicted) = (step.forcing.wall_velocity, &self.new.velocity[..]);
        set_column(&mut self.velocity, particles.len(), |a| predicted[a] - walls);
        self.voids.predict(step, tank, particles, &self.new, grains)
    }

    /// Velocity of a particle or ghost without the pressure of the step, after [`Self::take_predicted_velocities`] [m/s].
    pub fn velocity_without_pressure(&self, step: &Context<'_>, a: usize) -> Vector {
        self.velocity[a] + step.forcing.wall_velocity
    }

    /// Right side: the divergence to be taken away, less that which relaxes the number density. Grains have the pressure
    /// of the step before already: their part of the equation acts on its change alone.
    pub fn set_right_side(
        &mut self,
        step: &Context<'_>,
        particles: &mut Particles,
        near: &mut Arrangement,
        equation: &mut PressureEquation,
    ) {
        let owned = particles.owned;
        self.divergence.resize(owned, 0.0);
        let operators = Operators { pairs: &self.pairs, sums: &self.sums, slope: &self.slope };
        let matrix = (&operators, &self.voids.bulk());
        self.still.split(step, self.closed, matrix, (&equation.blocks, &equation.rows), particles, &mut near.ghosts);
        operators.divergence(&equation.blocks, &self.velocity, false, &mut self.divergence);
        let (rate, slope, bulk) = (&self.voids.rate[..], &self.slope[..], self.voids.bulk());
        let (free, present, walls) = (&self.velocity[..], &particles.velocity[..], step.forcing.wall_velocity);
        let divergence = &mut self.divergence[..];
        // Rates by the velocity at the start hold in every frame; what it has gained since is treated as the pressure's.
        for_each_chunk(&mut *divergence, ROWS, |number, divergence| {
            for (row, div) in divergence.iter_mut().enumerate() {
                let a = number * ROWS + row;
                *div += rate[a] + slope[a].dot(free[a] + walls - present[a]);
            }
        });
        if self.moves_grains {
            let (factor, old) = (step.dt / step.settings.fluid.density, &particles.gradient[..]);
            let ways = &mut self.ways;
            set_column(ways, particles.len(), |a| factor * (bulk.own(a) - 1.0) * old[a]);
            near.ghosts.refresh(step.domain, ways);
            self.shares.resize(owned, 0.0);
            operators.divergence(&equation.blocks, ways, true, &mut self.shares);
            let shares = &self.shares[..];
            for_each_chunk(divergence, ROWS, |number, divergence| {
                divergence.iter_mut().zip(&shares[number * ROWS..]).for_each(|(div, share)| *div += share);
            });
        }
        let (divergence, surroundings) = (&self.divergence[..], &self.surroundings[..]);
        let expansion = self.expansion(step, &equation.rows[..owned]);
        for_each_chunk(&mut equation.rows[..owned], ROWS, |number, rows| {
            for (row, entry) in rows.iter_mut().enumerate().filter(|(_, entry)| entry.diagonal > 0.0) {
                let a = number * ROWS + row;
                let wanted = expansion(surroundings[a].density, entry.beside_surface);
                entry.right = step.settings.fluid.density / step.dt * (wanted - divergence[a]);
            }
        });
        self.still.take_from(matrix, &equation.blocks, &mut equation.rows[..owned]);
        if self.closed {
            let rows = &mut equation.rows[..owned];
            self.still.press(step, &operators, (&equation.blocks, rows), &particles.kind, &mut near.ghosts);
        }
    }

    /// Divergence that relaxes a number density [1/s]; beside the surface a low one is no error. In a closed box it is that beyond
    /// the mean, which nothing can relax.
    fn expansion<'a>(&self, step: &'a Context<'_>, rows: &[Row]) -> impl Fn(Real, bool) -> Real + Sync + use<'a> {
        let sums = &step.kernel.sums;
        let of = move |density: Real, beside_surface: bool| {
            let strain = (density - sums.number_density) / (3.0 * sums.strain);
            let strain = if beside_surface { strain.max(0.0) } else { strain };
            strain / (step.settings.scheme.relaxation * step.flow_time)
        };
        let surroundings = &self.surroundings[..];
        let in_row = |a: usize| {
            let inside = rows[a].diagonal > 0.0;
            if inside { [of(surroundings[a].density, rows[a].beside_surface), 1.0] } else { [0.0; 2] }
        };
        let [sum, number] = if self.closed { step.domain.sum(sum_of(rows.len(), in_row)) } else { [0.0, 1.0] };
        let mean = sum / number.max(1.0);
        move |density, beside_surface| of(density, beside_surface) - mean
    }

    /// Solves for the pressure, as finely as the `fastest` speed of the step's start asks [m/s].
    pub fn solve_pressure(
        &mut self,
        step: &Context<'_>,
        near: &mut Arrangement,
        particles: &mut Particles,
        equation: &mut PressureEquation,
        fastest: Real,
    ) -> Result<PressureReport, PressureError> {
        let Arrangement { ghosts, bins, bin, .. } = near;
        let Particles { pressure, position, owned, kind, .. } = particles;
        self.force.resize(kind.len(), [0.0; 4]);
        let operators = Operators { pairs: &self.pairs, sums: &self.sums, slope: &self.slope };
        let layout = Layout { domain: step.domain, bins, roles: &self.unknown, bin, place: position, owned: *owned };
        let unknown = |a: usize| [if layout.roles[a] == Role::Unknown { 1.0 } else { 0.0 }];
        let without_level = self.closed.then(|| step.domain.sum(sum_of(layout.owned, unknown))[0]);
        let mut matrix = Conjugate { operators, force: &mut self.force, bulk: self.voids.bulk(), without_level };
        let strain = step.dt * step.dt / step.settings.fluid.density;
        let courant = fastest * step.dt / step.settings.fluid.spacing;
        equation.solve_with(&mut matrix, &layout, ghosts, pressure, strain, (&step.settings.tolerance, courant))
    }

    /// New velocities and positions; returns the impulse of the walls \[N s], and the kinetic energy (relative to the walls)
    /// that the pressure adds by relaxing the number density, and otherwise \[J].
    pub fn correct_velocities(
        &mut self,
        step: &Context<'_>,
        particles: &mut Particles,
        equation: &PressureEquation,
    ) -> (Vector, [Real; 2]) {
        let Particles { kind, position, velocity: present, pressure, gradient, owned, .. } = particles;
        let owned = *owned;
        self.operators().force(&equation.blocks, pressure, &mut gradient[..owned], |into, _, force| *into = force);
        self.still.restore(pressure, &mut gradient[..owned]);
        self.new.resize(kind.len());
        let (free, walls) = (&self.velocity[..], step.forcing.wall_velocity);
        let (kind, gradient) = (&kind[..], &gradient[..]);
        let factor = step.dt / step.settings.fluid.density;
        let pressed = self.closed.then_some(&self.still.pressed[..]);
        let pressed = |a: usize| pressed.map_or(Vector::ZERO, |pressed| pressed[a]);
        let new = (&mut self.new.velocity[..owned], &mut self.new.position[..owned]);
        for_each_chunk(new, ROWS, |number, (velocity, place)| {
            for (row, (u, x)) in velocity.iter_mut().zip(place).enumerate() {
                let a = number * ROWS + row;
                (*u, *x) = (present[a], position[a]);
                if kind[a] == Kind::Fluid {
                    *u = free[a] + walls - factor * gradient[a] + pressed(a);
                    *x += step.dt * *u;
                }
            }
        });
        let (mass, surroundings, rows) = (step.particle_mass(), &self.surroundings[..], &equation.rows[..]);
        let expansion = self.expansion(step, &rows[..owned]);
        let inverse_void = &self.voids.start.inverse[..];
        let sums = step.domain.sum(sum_of(owned, |a| {
            let change = -factor * gradient[a];
            let by_walls = inverse_void[a] * change + pressed(a);
            let change = change + pressed(a);
            let whole = change.dot(free[a] + 0.5 * change);
            let inside = rows[a].diagonal > 0.0;
            let wanted = if inside { expansion(surroundings[a].density, rows[a].beside_surface) } else { 0.0 };
            [by_walls.x, by_walls.y, by_walls.z, factor * wanted * pressure[a], whole]
        }));
        let [relaxation, whole] = [mass * sums[3], mass * sums[4]];
        (mass * Vector::from_slice(&sums[..3]), [relaxation, whole - relaxation])
    }

    /// Shifts the new positions; returns the longest way \[m], and the potential energy that it adds \[J].
    pub fn shift(
        &mut self,
        step: &Context<'_>,
        ghosts: &mut Ghosts,
        particles: &Particles,
        equation: &PressureEquation,
    ) -> [Real; 2] {
        let close = CLOSE_RADIUS * step.settings.fluid.spacing;
        let bulk = self.voids.bulk();
        let size = bulk.size;
        let (pairs, blocks, role) = (&self.pairs, &equation.blocks[..], &particles.role[..]);
        let second = |a: usize| {
            pairs
                .of(blocks, a)
                .any(|pair| role[pair.particle] != Role::Unknown && pair.way().length() < close * size[a])
        };
        let (surroundings, received) = (&self.surroundings[..], &self.received[..]);
        let rate = |a: usize| received[a].strain;
        let kind = &particles.kind[..];
        self.ways.resize(particles.len(), Vector::ZERO);
        let ways = &mut self.ways[..particles.owned];
        shift::find_ways(step, kind, (surroundings, size), rate, second, ways);
        if !bulk.clear {
            ghosts.refresh(step.domain, &mut self.ways);
            let inside = |a: usize| kind[a] == Kind::Fluid && role[a] == Role::Unknown && !second(a);
            self.means.resize(particles.owned, Vector::ZERO);
            shift::find_means(step.kernel, (pairs, blocks), &bulk, &self.ways, inside, &mut self.means);
            for_each_chunk(&mut self.ways[..particles.owned], ROWS, |number, ways| {
                ways.iter_mut().zip(&self.means[number * ROWS..]).for_each(|(way, mean)| *way -= *mean);
            });
        }
        let ways = &self.ways[..particles.owned];
        for_each_chunk(&mut self.new.position[..particles.owned], ROWS, |number, position| {
            position.iter_mut().zip(&ways[number * ROWS..]).for_each(|(x, way)| *x += *way);
        });
        let longest = step.domain.max(largest(ways.len(), |a| ways[a].length()).max(0.0));
        let [work] = step.domain.sum(sum_of(ways.len(), |a| [ways[a].dot(step.forcing.body_force)]));
        [longest, -step.particle_mass() * work]
    }
}

/// Gives wall particles beside fluid the pressure of the fluid that they mirror, for whoever looks at it; others have none.
/// `means` is work space.
pub(crate) fn set_wall_pressures(
    step: &Context<'_>,
    tank: &Tank,
    near: &Arrangement,
    particles: &mut Particles,
    means: &mut [Real],
) {
    let weight = Weight { radius: CLOSE_RADIUS * step.settings.fluid.spacing };
    let Particles { kind, position, pressure, owned, .. } = particles;
    let (kind, position, solved) = (&kind[..], &position[..], &pressure[..]);
    near.neighbours.set(means, |a, near| {
        if kind[a] == Kind::Fluid {
            return solved[a];
        }
        let at = tank.mirrored(position[a]);
        let fluid = near.iter().map(|&b| b as usize).filter(|&b| kind[b] == Kind::Fluid);
        let [sum, total] = fluid.fold([0.0; 2], |[sum, total], b| {
            let w = weight.value((position[b] - at).length());
            [sum + w * solved[b], total + w]
        });
        if total > 0.0 { sum / total } else { 0.0 }
    });
    let means = &*means;
    for_each_chunk(&mut pressure[..*owned], ROWS, |number, pressure| {
        pressure.copy_from_slice(&means[number * ROWS..][..pressure.len()]);
    });
}
