//! The phases of a step, in their order.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::{Forcing, Phase, Scratch, Settings, Solver, StepError, StepReport};
use crate::boundary::WallFriction;
use crate::free_surface::{CLOSE_RADIUS, SurfaceTest, is_isolated};
use crate::gradient::{self, PressureField};
use crate::grains::{self, Voids};
use crate::matrix::Layout;
use crate::momentum::FluidImpulses;
use crate::neighbours::{MARGIN, ROWS};
use crate::number_density::{self, NumberDensity, Prediction};
use crate::particles::{FIRST_WALL_ID, Kind, Particles, Role};
use crate::pressure::{PressureEquation, PressureReport, hydrostatic};
use crate::reductions::{largest, sum_of};
use crate::scheme::{Fluid, SourceForm};
use crate::shifting::{self, Arrangement};
use crate::stabilisation::{self, Moved, Repulsion};
use crate::stability::{COMPRESSIBLE, flow_time};
use crate::viscosity::{self, ViscousField};

/// Whether this is a wall particle with little fluid in front of it.
fn is_dry_wall(surface: Option<&SurfaceTest>, n0: Real, kind: Kind, sums: &Prediction) -> bool {
    kind == Kind::Wall && surface.is_some_and(|test| sums.density < test.density * n0)
}

impl Solver {
    /// Moves the walls to their position at the start of the step and sets their velocity in it.
    pub(super) fn begin_walls(&mut self, dt: Real, forcing: &Forcing) {
        self.tank.displacement = forcing.wall_displacement - dt * forcing.wall_velocity;
        self.tank.velocity = forcing.wall_velocity;
        self.grains.engine_mut().set_wall_velocities(&self.domain, forcing.wall_velocity);
        let particles = &mut self.particles;
        particles.truncate(particles.owned);
        for a in (0..particles.owned).filter(|&a| particles.kind[a] != Kind::Fluid) {
            let place = self.wall_places[(particles.id[a] - FIRST_WALL_ID) as usize];
            particles.position[a] = self.periods.wrapped(place + self.tank.displacement);
            particles.velocity[a] = forcing.wall_velocity;
        }
    }

    /// See [`flow_time`] [s].
    pub(super) fn flow_time(&self, dt: Real, forcing: &Forcing) -> Real {
        let walls = forcing.wall_velocity;
        let [speeds, count] = self.sum_over_fluid(|particles, a| [(particles.velocity[a] - walls).length(), 1.0]);
        flow_time(speeds / count.max(1.0), forcing.body_force, self.settings.fluid.spacing, dt)
    }

    /// Body force of the predictor, without the part in the hydrostatic pressure [m/s^2].
    fn explicit_force(&self, forcing: &Forcing) -> Vector {
        forcing.body_force - self.reduced_force(forcing.body_force)
    }

    /// Migration, order in space, ghosts and neighbour lists.
    pub(super) fn arrange(&mut self, dt: Real, forcing: &Forcing) {
        // Pairs may approach by this much before the pressure acts.
        let body_force = self.explicit_force(forcing);
        let margin = MARGIN * self.settings.fluid.spacing;
        let radius = self.kernel.weight.radius + margin;
        // Drag may change the velocity by up to its rate times the slip.
        let kick = 1.0 + (dt * self.grains.drag_rate()).min(1.0);
        let walls = dt * forcing.wall_velocity;
        let speed =
            self.largest_speed().max(self.grains.largest_speed(&self.domain)).max(forcing.wall_velocity.length());
        let reach = radius + 2.1 * dt * (kick * speed + dt * forcing.body_force.length());
        let Self { domain, periods, particles, ghosts, bins, neighbours, .. } = self;
        ghosts.migrate(domain, particles);
        bins.renew(domain, reach);
        particles.sort(bins.len(), |x| bins.number(x));
        ghosts.renew(domain, periods, particles, reach, |x| bins.number(x));
        let (own, ghosts) = particles.position.split_at(particles.owned);
        bins.fill(own, ghosts);
        let way = |a: usize| dt * (particles.velocity[a] + dt * body_force);
        neighbours.renew(bins, particles, radius, walls, way);
        let scratch = &mut self.scratch;
        let (owned, all) = (particles.owned, particles.len());
        let blocks = owned.div_ceil(ROWS);
        scratch.inverse_void.clear();
        scratch.inverse_void.resize(all, 1.0);
        scratch.inverse_void_rate.clear();
        scratch.inverse_void_rate.resize(all, 0.0);
        scratch.grain_mobility.clear();
        scratch.grain_mobility.resize(all, 0.0);
        scratch.change.clear();
        scratch.change.resize(owned, Vector::ZERO);
        scratch.densities.resize(owned, NumberDensity::default());
        scratch.prediction.resize(blocks * ROWS, Prediction::default());
        scratch.plain.resize(owned, false);
        scratch.repulsions.resize(owned, Repulsion::default());
        scratch.bin.clear();
        scratch.bin.extend(particles.position[..owned].iter().map(|&x| bins.number(x)));
        self.equation.resize(owned);
    }

    /// Void fraction at the particles; with `predicted`, at their predicted positions.
    pub(super) fn void_fractions(&mut self, predicted: bool, report: &mut StepReport) {
        let Self { domain, tank, particles, ghosts, scratch, grains, .. } = self;
        if grains.is_empty() {
            return;
        }
        let Scratch { inverse_void, inverse_void_rate, grain_mobility, velocity, place, .. } = scratch;
        let owned = particles.owned;
        let (places, velocities) =
            if predicted { (&*place, &*velocity) } else { (&particles.position, &particles.velocity) };
        grains.place(domain, tank);
        let mut voids = Voids {
            inverse_void: &mut inverse_void[..owned],
            inverse_void_rate: &mut inverse_void_rate[..owned],
            grain_mobility: &mut grain_mobility[..owned],
        };
        let (cut, smallest) = grains.voids(&particles.kind, places, velocities, &mut voids);
        let worst = &mut report.coupling;
        worst.cut_voids = worst.cut_voids.max(domain.sum([cut as Real])[0] as usize);
        worst.least_void = worst.least_void.min(domain.min(smallest));
        ghosts.refresh(domain, inverse_void);
        ghosts.refresh(domain, inverse_void_rate);
        ghosts.refresh(domain, grain_mobility);
    }

    /// Advances the grains and computes the drag on the fluid.
    pub(super) fn advance_grains(
        &mut self,
        dt: Real,
        forcing: &Forcing,
        report: &mut StepReport,
        watch: &mut impl FnMut(Phase),
    ) -> Result<(), StepError> {
        let mass = self.particle_mass();
        let reduced = self.reduced_force(forcing.body_force);
        let Self { domain, kernel, particles, ghosts, scratch, grains, .. } = self;
        if grains.is_empty() || grains.is_frozen() {
            return Ok(());
        }
        watch(Phase::Coupling);
        ghosts.refresh(domain, &mut particles.gradient);
        let Particles { kind, position, velocity, gradient, .. } = &*particles;
        let fluid = grains::Fluid { kind, position, velocity, gradient, inverse_void: &scratch.inverse_void };
        grains.interpolate_fluid(domain, kernel, &fluid);
        watch(Phase::Grains);
        report.contacts = grains.advance(domain, [forcing.body_force, reduced], dt, &mut report.coupling)?;
        watch(Phase::Coupling);
        let Scratch { inverse_void, change, .. } = scratch;
        grains.return_drag(domain, kernel, particles, inverse_void, mass, change, &mut report.coupling);
        Ok(())
    }

    /// Corrects the pressure force on the grains to the pressure of this step.
    pub(super) fn correct_grains(&mut self, dt: Real, report: &mut StepReport) {
        let Self { domain, kernel, particles, ghosts, scratch, grains, .. } = self;
        if grains.is_empty() || grains.is_frozen() {
            return;
        }
        ghosts.refresh(domain, &mut particles.gradient);
        let Particles { kind, gradient, .. } = &*particles;
        let Scratch { after: position, velocity, inverse_void, .. } = scratch;
        let fluid = grains::Fluid { kind, position, velocity, gradient, inverse_void };
        grains.correct_pressure_force(domain, kernel, &fluid, dt, &mut report.coupling);
    }

    /// Number density, its rate and the viscous term at the start of the step.
    pub(super) fn number_density(&mut self) {
        let Self { domain, tank, kernel, particles, ghosts, bins, neighbours, scratch, settings, .. } = self;
        let Scratch { viscous_velocity, inverse_void, inverse_void_rate, densities, bin, samples, .. } = scratch;
        let viscous_velocity = if settings.fluid.viscosity > 0.0 && tank.friction == WallFriction::NoSlip {
            let wet = |a: usize| neighbours.is_wet(bin[a]);
            viscosity::mirrored_velocities(kernel, tank, bins, particles, wet, viscous_velocity);
            ghosts.refresh(domain, viscous_velocity);
            &viscous_velocity[..]
        } else {
            &particles.velocity[..]
        };
        let Particles { kind, position, velocity, .. } = &*particles;
        number_density::sample(position, velocity, inverse_void, inverse_void_rate, samples);
        let viscous = ViscousField { velocity: viscous_velocity, kind, friction: tank.friction };
        number_density::at_start(kernel, neighbours, samples, &viscous, densities);
    }

    /// Velocities and positions without the pressure.
    pub(super) fn predict(&mut self, dt: Real, forcing: &Forcing) {
        let body_force = self.explicit_force(forcing);
        self.tank.displacement = forcing.wall_displacement;
        let Self { domain, periods, particles, ghosts, scratch, settings, .. } = self;
        let Scratch { velocity, place, densities, change, .. } = scratch;
        velocity.clone_from(&particles.velocity);
        place.clone_from(&particles.position);
        let owned = particles.owned;
        let viscosity = settings.fluid.viscosity;
        let kind = &particles.kind;
        for_each_chunk((&mut velocity[..owned], &mut place[..owned]), ROWS, |number, (velocity, place)| {
            for (row, (u, x)) in velocity.iter_mut().zip(place).enumerate() {
                let a = number * ROWS + row;
                if kind[a] == Kind::Fluid {
                    *u += dt * (viscosity * densities[a].laplacian.total + body_force) + change[a];
                }
                // On exact multiples, so that both particles of a pair across a periodic side get the same distance.
                *x = periods.rounded(*x + dt * *u);
            }
        });
        ghosts.refresh(domain, velocity);
        ghosts.refresh_positions(domain, place);
        // Rebuild the lists if drag and viscosity moved a particle farther than they allow for.
        let Self { kernel, bins, neighbours, .. } = self;
        let (position, place) = (&particles.position, &scratch.place);
        let foreseen = |a: usize| position[a] + dt * (particles.velocity[a] + dt * body_force);
        let stray = |a: usize| if kind[a] == Kind::Fluid { (place[a] - foreseen(a)).length_squared() } else { 0.0 };
        let margin = MARGIN * settings.fluid.spacing;
        if 2.1 * domain.max(largest(owned, stray).max(0.0)).sqrt() > margin {
            let way = |a: usize| place[a] - position[a];
            neighbours.renew(bins, particles, kernel.weight.radius + margin, dt * forcing.wall_velocity, way);
        }
    }

    /// Sums at the predicted positions: coefficients of the pressure equation, roles.
    pub(super) fn assemble(&mut self, report: &mut StepReport) {
        let Self { domain, kernel, particles, ghosts, neighbours, scratch, settings, equation, surface, .. } = self;
        let Scratch {
            inverse_void,
            inverse_void_rate,
            grain_mobility,
            mobility,
            velocity,
            place,
            prediction,
            roles,
            samples,
            dry,
            ..
        } = scratch;
        let spacing = settings.fluid.spacing;
        mobility.clear();
        mobility.extend(
            inverse_void
                .iter()
                .zip(&*grain_mobility)
                .map(|(inverse_void, grain_mobility)| 1.0 / inverse_void + grain_mobility),
        );
        number_density::sample(place, velocity, inverse_void, inverse_void_rate, samples);
        let blocks = &mut equation.blocks;
        number_density::prediction(kernel, spacing, neighbours, &particles.kind, samples, mobility, blocks, prediction);
        let n0 = kernel.sums.number_density;
        let owned = particles.owned;
        roles.clear();
        roles.resize(particles.len(), 0);
        let kind = &particles.kind[..];
        let surface = *surface;
        let isolated = |neighbour_count: u32| surface.is_some() && is_isolated(neighbour_count);
        let given = |density: Real, asymmetry: Vector| surface.is_some_and(|test| test.is_surface(density, asymmetry));
        for_each_chunk(&mut roles[..owned], ROWS, |number, roles| {
            let sums = &prediction[number * ROWS..];
            for ((number, sums), kind) in roles.iter_mut().zip(sums).zip(&kind[number * ROWS..]) {
                let density = sums.density / n0;
                let role = match kind {
                    Kind::Fluid if isolated(sums.neighbour_count) => Role::Inactive,
                    Kind::Fluid if given(density, sums.asymmetry / n0) => Role::Dirichlet,
                    Kind::Wall if sums.fluid_neighbours == 0 => Role::Inactive,
                    Kind::Dummy => Role::Inactive,
                    Kind::Fluid | Kind::Wall => Role::Unknown,
                };
                *number = role.number();
            }
        });
        ghosts.refresh(domain, roles);
        particles.role.iter_mut().zip(&*roles).for_each(|(role, &number)| *role = Role::from_number(number));
        // Wall particles next to isolated fluid only are not coupled to any prescribed pressure.
        dry.clear();
        dry.extend(
            (0..owned)
                .filter(|&a| {
                    let wet = |&b: &u32| {
                        particles.kind[b as usize] == Kind::Fluid && particles.role[b as usize] != Role::Inactive
                    };
                    let near = || equation.blocks[a / ROWS].row(a % ROWS).0.iter().any(wet);
                    particles.kind[a] == Kind::Wall && particles.role[a] == Role::Unknown && !near()
                })
                .map(|a| a as u32),
        );
        dry.iter().for_each(|&a| roles[a as usize] = Role::Inactive.number());
        ghosts.refresh(domain, roles);
        particles.role.iter_mut().zip(&*roles).for_each(|(role, &number)| *role = Role::from_number(number));
        equation.set_diagonal(&particles.role, owned);
        let counts = sum_of(owned, |a| match particles.role[a] {
            _ if kind[a] != Kind::Fluid => [0.0; 5],
            Role::Inactive => [1.0, 0.0, 0.0, 0.0, 0.0],
            Role::Dirichlet => [0.0, 1.0, 0.0, 0.0, 0.0],
            Role::Unknown if equation.rows[a].beside_surface => [0.0; 5],
            Role::Unknown => {
                let strain = (scratch.densities[a].density - n0) / kernel.sums.strain;
                [0.0, 0.0, 1.0, strain, strain * strain]
            }
        });
        let [isolated, at_surface, inner, sum, squares] = domain.sum(counts);
        (report.isolated, report.surface) = (isolated as usize, at_surface as usize);
        let inner = inner.max(1.0);
        report.strain = [sum / inner, (squares / inner).sqrt()];
    }

    /// Pressure and its gradient; `time` is the flow time scale [s].
    pub(super) fn solve(
        &mut self,
        dt: Real,
        time: Real,
        forcing: &Forcing,
        report: &mut StepReport,
    ) -> Result<(), StepError> {
        let reduced = self.reduced_force(forcing.body_force);
        let Self { domain, kernel, particles, ghosts, bins, scratch, settings, equation, surface, .. } = self;
        let Scratch {
            inverse_void, grain_mobility, mobility, place, densities, prediction, plain, bin, samples, ..
        } = scratch;
        let Settings { fluid, scheme, tolerance, reference, .. } = settings;
        let Particles { kind, role, pressure, gradient, owned, .. } = particles;
        let owned = *owned;
        // `pressure` is still that of the previous step, which the contact sub-steps have used.
        let n0 = kernel.sums.number_density;
        let strain = |density: Real| (density - n0) / kernel.sums.strain;
        let at_surface = |x: Vector| -hydrostatic(fluid.density, reduced, x, *reference);
        let dry = |a: usize| is_dry_wall(surface.as_ref(), n0, kind[a], &prediction[a]);
        let layout = Layout { domain, bins, roles: role, bin, place, owned };
        let PressureEquation { blocks, rows, .. } = &mut *equation;
        let blocks = &blocks[..];
        for_each_chunk(&mut rows[..owned], ROWS, |number, rows| {
            for (place, row) in rows.iter_mut().enumerate().filter(|(_, row)| row.diagonal > 0.0) {
                let a = number * ROWS + place;
                let NumberDensity { density, rate, .. } = densities[a];
                let dry = dry(a);
                let predicted = match scheme.source {
                    // Isolated particles do not compress a dry wall.
                    SourceForm::HigherOrder if dry => {
                        let near = blocks[number].row(place).0;
                        number_density::rate_by(kernel, samples, a, near, |b| role[b] != Role::Inactive)
                    }
                    SourceForm::HigherOrder => prediction[a].rate,
                    SourceForm::Classical => strain(prediction[a].density) / dt,
                };
                // No tension at dry walls, neither from receding fluid nor from error compensation.
                let source = if dry {
                    predicted.max(0.0)
                } else {
                    scheme.compensated(predicted, rate, strain(density), row.beside_surface, time)
                };
                row.right = fluid.density / dt * source;
                if grain_mobility[a] > 0.0 {
                    let (columns, coefficients) = blocks[number].row(place);
                    for (&b, &c) in columns.iter().zip(coefficients) {
                        let b = b as usize;
                        if role[b] != Role::Inactive {
                            let share = (grain_mobility[a] + grain_mobility[b]) / (mobility[a] + mobility[b]);
                            row.right -= Real::from(c) * share * (pressure[b] - pressure[a]);
                        }
                    }
                }
            }
        });
        for ((p, role), &x) in pressure.iter_mut().zip(&*role).zip(&*place) {
            match role {
                Role::Inactive => *p = 0.0,
                Role::Dirichlet => *p = at_surface(x),
                Role::Unknown => {}
            }
        }
        let completed = |a: usize| (kind[a] == Kind::Fluid).then(|| prediction[a].moment_deficit);
        equation.complete_support(role, place, pressure, completed);
        let to_strain = dt * dt / fluid.density;
        let solved = equation.solve(&layout, ghosts, pressure, to_strain, tolerance)?;
        let [cut, held] = domain.sum(equation.limited().map(|count| count as Real));
        report.pressure = PressureReport { cut_coefficients: cut as usize, limited_rows: held as usize, ..solved };
        let released = equation.cut_tension_at_dry_walls(dry, kind, role, &mut pressure[..]);
        report.tensile_cutoffs = domain.sum([released as Real])[0] as usize;
        ghosts.refresh(domain, pressure);
        let field = PressureField {
            pressure,
            position: place,
            inverse_void,
            roles: role,
            kind,
            weight_of_fluid: fluid.density * reduced,
        };
        gradient::gradient(kernel, &mut equation.blocks, &field, &mut gradient[..owned], plain);
        report.uncorrected_gradients = domain.sum([plain.iter().filter(|p| **p).count() as Real])[0] as usize;
        for a in (0..owned).filter(|&a| role[a] == Role::Inactive) {
            pressure[a] = at_surface(place[a]);
        }
        Ok(())
    }

    /// Velocities and positions with the pressure.
    pub(super) fn correct(&mut self, dt: Real) {
        let Self { domain, particles, ghosts, scratch, settings, .. } = self;
        let Scratch { velocity, place, after, .. } = scratch;
        after.clone_from(place);
        let Particles { kind, gradient, owned, .. } = particles;
        let owned = *owned;
        let density = settings.fluid.density;
        for_each_chunk((&mut velocity[..owned], &mut after[..owned]), ROWS, |number, (velocity, after)| {
            for (row, (u, x)) in velocity.iter_mut().zip(after).enumerate() {
                let a = number * ROWS + row;
                if kind[a] != Kind::Fluid {
                    continue;
                }
                let acceleration = -gradient[a] / density;
                *u += dt * acceleration;
                *x += dt * dt * acceleration;
            }
        });
        ghosts.refresh(domain, velocity);
        ghosts.refresh_positions(domain, after);
    }

    /// Momentum of the fluid with such a `velocity` of each particle, over all ranks [N s].
    pub(super) fn momentum(&self, velocity: &[Vector]) -> Vector {
        self.particle_mass() * Vector::from_array(self.sum_over_fluid(|_, a| velocity[a].to_array()))
    }

    /// External impulses on the fluid, without those of stabilisation, collisions and clipping.
    pub(super) fn record_impulses(&self, dt: Real, forcing: &Forcing, report: &mut StepReport) {
        let reduced = self.reduced_force(forcing.body_force);
        let Self { domain, kernel, particles, scratch, settings, facets, surface, .. } = self;
        let Particles { kind, role, pressure, id, owned, .. } = particles;
        let dry = |a: usize| is_dry_wall(surface.as_ref(), kernel.sums.number_density, kind[a], &scratch.prediction[a]);
        let Settings { fluid, reference, .. } = settings;
        let mass = self.particle_mass();
        let sums = sum_of(*owned, |a| {
            let [body, friction, wall] = match kind[a] {
                Kind::Fluid => [
                    mass * forcing.body_force,
                    mass * fluid.viscosity * scratch.densities[a].laplacian.from_walls,
                    Vector::ZERO,
                ],
                Kind::Wall if role[a] != Role::Inactive => {
                    // Total pressure on the face, half a spacing in front of the particle.
                    let facet = facets[(id[a] - FIRST_WALL_ID) as usize];
                    let face = scratch.place[a] + 0.5 * fluid.spacing * facet.normalize_or_zero();
                    let rest = |force: Vector, from: Vector| hydrostatic(fluid.density, force, face, from);
                    let beyond = rest(forcing.body_force - reduced, scratch.place[a]);
                    let whole = pressure[a] + rest(reduced, *reference) + beyond;
                    // No tension at dry walls.
                    let whole = if dry(a) { whole.max(0.0) } else { whole };
                    [Vector::ZERO, Vector::ZERO, whole * facet]
                }
                Kind::Wall | Kind::Dummy => [Vector::ZERO; 3],
            };
            [body.x, body.y, body.z, friction.x, friction.y, friction.z, wall.x, wall.y, wall.z]
        });
        let sums = domain.sum(sums).map(|sum| dt * sum);
        report.impulses = FluidImpulses {
            body_force: Vector::from_slice(&sums[..3]),
            friction: Vector::from_slice(&sums[3..6]),
            wall_pressure: Vector::from_slice(&sums[6..]),
            contact: -self.momentum(&scratch.velocity),
        };
    }

    /// Dynamic stabilisation and collisions; `time` is the flow time scale [s].
    pub(super) fn stabilise(&mut self, dt: Real, time: Real, report: &mut StepReport) {
        let Self { domain, kernel, particles, ghosts, scratch, settings, equation, .. } = self;
        let Scratch { velocity, place, after, inverse_void, size, repulsions, collisions, .. } = scratch;
        let (kind, owned) = (&particles.kind[..], particles.owned);
        let Fluid { spacing, density, .. } = settings.fluid;
        stabilisation::sizes(spacing, kind, inverse_void, size);
        let longest = largest(owned, |a| (after[a] - place[a]).length_squared());
        let longest = domain.max(longest.max(0.0)).sqrt();
        let close = 2.0 * longest + stabilisation::widest(spacing) < CLOSE_RADIUS * spacing;
        let blocks = &equation.blocks[..];
        let mut nearest = 0.0;
        if let Some(stabilisation) = &settings.scheme.stabilisation {
            let moved = Moved { kind, before: place, after, velocity, size, blocks, close };
            stabilisation::repulsions(kernel, stabilisation, spacing, &moved, repulsions);
            let rate = dt / (time * time);
            let mass = density * spacing.powi(3);
            let sums = sum_of(owned, |a| {
                let change = rate * repulsions[a].displacement;
                [repulsions[a].pairs, mass * change.dot(velocity[a] + 0.5 * change)]
            });
            nearest = domain.min(-largest(owned, |a| -repulsions[a].nearest));
            for_each_chunk((&mut velocity[..owned], &mut after[..owned]), ROWS, |number, (velocity, after)| {
                let repulsions = &repulsions[number * ROWS..];
                for ((u, x), push) in
                    velocity.iter_mut().zip(after).zip(repulsions).filter(|(_, push)| push.pairs > 0.0)
                {
                    *u += rate * push.displacement;
                    *x += dt * rate * push.displacement;
                }
            });
            let [pairs, work] = domain.sum(sums);
            (report.stabilised_pairs, report.stabilisation_work) = (pairs.round() as usize, work);
            ghosts.refresh(domain, velocity);
            ghosts.refresh_positions(domain, after);
        }
        // Stabilisation moves by less than a tenth of a spacing: pairs farther apart cannot collide.
        if nearest < (0.7 * spacing) * (0.7 * spacing) {
            collisions.resize(owned, (Vector::ZERO, 0.0));
            let moved = Moved { kind, before: place, after, velocity, size, blocks, close };
            stabilisation::collisions(spacing, &moved, collisions);
            let mut count = 0.0;
            for (u, (change, pairs)) in velocity.iter_mut().zip(&*collisions) {
                *u += *change;
                count += *pairs;
            }
            report.collisions = domain.sum([count])[0].round() as usize;
        }
    }

    /// Particle shifting; `time` is the flow time scale [s].
    pub(super) fn shift(&mut self, dt: Real, time: Real, report: &mut StepReport) {
        let Self { domain, kernel, particles, ghosts, neighbours, scratch, .. } = self;
        let factor = kernel.scheme.shifting * dt / time;
        if factor == 0.0 {
            return;
        }
        let Scratch { after, inverse_void, shifts, .. } = scratch;
        let Particles { kind, role, owned, .. } = &*particles;
        shifts.resize(*owned, Vector::ZERO);
        let arrangement = Arrangement { kind, roles: role, position: after, inverse_void };
        shifting::displacements(kernel, neighbours, factor, &arrangement, shifts);
        after.iter_mut().zip(&*shifts).for_each(|(x, way)| *x += *way);
        ghosts.refresh_positions(domain, after);
        let longest = largest(*owned, |a| shifts[a].length_squared()).max(0.0);
        report.largest_shift = domain.max(longest).sqrt();
    }

    /// Stores the new state, clips particles to the box, and checks for NaN and excessive displacements.
    pub(super) fn finalise(&mut self, report: &mut StepReport) -> Result<(), StepError> {
        let Self { domain, periods, tank, particles, scratch, settings, kernel, .. } = self;
        let Scratch { velocity, after, .. } = scratch;
        let spacing = settings.fluid.spacing;
        let limit = kernel.weight.radius;
        let mut clipped = 0.0;
        let mut bad = None;
        for a in 0..particles.owned {
            let (mut x, mut u) = (after[a], velocity[a]);
            if particles.kind[a] != Kind::Fluid {
                particles.position[a] = periods.wrapped(x);
                continue;
            }
            if !(x.is_finite() && u.is_finite() && particles.pressure[a].is_finite()) {
                let what = if u.is_finite() { "pressure" } else { "velocity" };
                bad = bad.or(Some(StepError::NotFinite { id: particles.id[a], what, position: particles.position[a] }));
                continue;
            }
            let distance = (x - particles.position[a]).length();
            if distance > limit {
                let position = particles.position[a];
                bad = bad.or(Some(StepError::TooFar { id: particles.id[a], distance, limit, position }));
                continue;
            }
            let speed = u.length();
            if speed > COMPRESSIBLE {
                let position = particles.position[a];
                bad = bad.or(Some(StepError::TooFast { id: particles.id[a], speed, position }));
                continue;
            }
            if tank.clip(spacing, &mut x, &mut u) {
                clipped += 1.0;
            }
            particles.position[a] = periods.wrapped(x);
            particles.velocity[a] = u;
        }
        domain.agree(bad.map_or(Ok(()), Err))?;
        report.clipped = domain.sum([clipped])[0] as usize;
        report.largest_speed = self.largest_speed();
        report.impulses.contact += self.fluid_momentum();
        Ok(())
    }
}
