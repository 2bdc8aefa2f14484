use sazanami_numerics::Random;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;

use super::*;
use crate::boundary::{Side, Tank, WallFriction};
use crate::conjugate::exchange::{Received, add_stress};
use crate::conjugate::shift::find_means;
use crate::conjugate::surroundings::Near;
use crate::grains::OverlappingGrains;
use crate::momentum::FluidImpulses;
use crate::particles::Role;
use crate::pressure::Tolerance;
use crate::scheme::{Fluid, Scheme};
use crate::solver::{FluidParticle, ParticleSettings};
use crate::stability::StepLimits;

const WALLS: [Side; 2] = [Side::Wall; 2];
const OPEN: [Side; 2] = [Side::Open; 2];
const OPEN_TOP: [Side; 2] = [Side::Wall, Side::Open];
const PERIODIC: [Side; 2] = [Side::Periodic; 2];

/// A disordered block of 10 x 8 x 6 particles of unit spacing, from the lower corner of a box, ready for its operators.
fn posed(sides: [[Side; 2]; 3], radius: Real) -> Solver {
    posed_between(sides, radius, |_| 1.0)
}

/// The same with a `void` fraction, at least 0.4, as if there were grains.
fn posed_between(sides: [[Side; 2]; 3], radius: Real, void: impl Fn(Vector) -> Real) -> Solver {
    posed_of(&block(), Vector::new(10.0, 8.0, 12.0), sides, radius, void)
}

/// The particles of the block.
fn block() -> Vec<FluidParticle> {
    let mut random = Random::new(5);
    let mut way = || 0.15 * random.between(-1.0, 1.0);
    let places = (0..480).map(|n| [n % 10, n / 10 % 8, n / 80].map(|n| f64::from(n) + 0.5));
    let at =
        |x: [Real; 3], way: Vector| FluidParticle { position: Vector::from_array(x) + way, velocity: Vector::ZERO };
    places.map(|x| at(x, Vector::new(way(), way(), way()))).collect()
}

/// The same with these particles in a box from zero to `upper`.
fn posed_of(
    fluid: &[FluidParticle],
    upper: Vector,
    sides: [[Side; 2]; 3],
    radius: Real,
    void: impl Fn(Vector) -> Real,
) -> Solver {
    let domain = Domain::solo(Grid::new([4, 4, 4], Vector::ZERO, upper), sides.map(|s| s[0] == Side::Periodic));
    let settings = ParticleSettings {
        fluid: Fluid { density: 2.0, viscosity: 0.01, spacing: 1.0 },
        scheme: Scheme::conjugate(radius),
        limits: StepLimits { longest: 0.05, ..StepLimits::default() },
        tolerance: Tolerance::default(),
        reference: Vector::ZERO,
    };
    let tank = Tank::new(Vector::ZERO, upper, sides, WallFriction::Slip);
    let grains = OverlappingGrains::none(&domain).unwrap();
    let mut solver = Solver::new(domain, settings, tank, fluid, grains).unwrap();
    let widest = Real::cbrt(2.5);
    prepare(&mut solver, widest, void);
    solver
}

/// Pairs, moments and what neighbours exchange of a solver as it stands, with a `void` fraction.
fn prepare(solver: &mut Solver, widest: Real, void: impl Fn(Vector) -> Real) {
    let (forcing, surface, reduced_force, dt) = (Forcing::default(), solver.surface, Vector::ZERO, 0.01);
    let Solver { domain, periods, settings, kernel, tank, particles, walls, near, equation, grains, conjugate, .. } =
        solver;
    let step =
        Context { domain, periods, settings, kernel, surface, forcing: &forcing, reduced_force, dt, flow_time: dt };
    walls.begin_step(&step, tank, particles);
    near.renew(&step, particles, (0.0, 0.0), (widest, 0.0), &mut conjugate.voids.start);
    equation.resize(particles.owned);
    conjugate.voids.at_start(&step, tank, particles, near, grains);
    for (a, inverse) in conjugate.voids.start.inverse.iter_mut().enumerate() {
        *inverse = if particles.is_fluid(a) { void(particles.position[a]).recip() } else { 1.0 };
    }
    near.ghosts.refresh(domain, &mut conjugate.voids.start.inverse);
    conjugate.voids.prepare(particles.owned, false);
    conjugate.sum_over_pairs(&step, (&Mirrors::of(tank), widest), near, particles, equation);
    conjugate.exchange(&step, tank, near, particles, equation);
}

/// A column of `value` at all particles, with ghosts; zero at walls.
fn column<T: bytemuck::Pod + Default + Send + Sync>(solver: &mut Solver, mut value: impl FnMut(Vector) -> T) -> Vec<T> {
    let particles = &solver.particles;
    let of = |a: usize| if particles.is_fluid(a) { value(particles.position[a]) } else { T::default() };
    let mut column: Vec<T> = (0..particles.len()).map(of).collect();
    solver.near.ghosts.refresh(&solver.domain, &mut column);
    column
}

fn divergence(solver: &Solver, velocity: &[Vector]) -> Vec<Real> {
    let mut found = vec![0.0; solver.particles.owned];
    solver.conjugate.operators().divergence(&solver.equation.blocks, velocity, true, &mut found);
    found
}

/// The same solver without the moments.
fn without_moments(mut solver: Solver) -> Solver {
    solver.conjugate.inverse.fill([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    solver.conjugate.weigh(&solver.equation.blocks);
    solver
}

fn force(solver: &Solver, pressure: &[Real]) -> Vec<Vector> {
    let mut found = vec![Vector::ZERO; solver.particles.owned];
    solver.conjugate.operators().force(&solver.equation.blocks, pressure, &mut found, |into, _, force| *into = force);
    found
}

#[test]
fn groups_hold_the_pairs_of_a_particle_in_order() {
    let Solver { particles, conjugate, equation, .. } = posed([OPEN_TOP, OPEN, OPEN_TOP], 2.6);
    let (pairs, blocks) = (&conjugate.pairs, &equation.blocks[..]);
    let mut images = 0;
    for a in 0..particles.owned {
        let mut rest = pairs.of(blocks, a);
        pairs.for_each_group(blocks, a, |columns, turned, group| {
            for (l, (&b, &turned)) in columns.iter().zip(turned).enumerate() {
                let pair = rest.next().unwrap();
                let (way, found) = (pair.way(), Vector::from_slice(&group.way[l][..3]));
                assert_eq!((pair.particle, pair.turned), (b as usize, turned));
                assert_eq!((pair.stiffness, way, way.length()), (group.stiffness[l], found, group.length[l]));
                images += usize::from(turned != 0);
            }
        });
        assert!(rest.next().is_none());
    }
    assert!(images > 100, "{images}");
}

#[test]
fn the_divergence_of_linear_flows_is_exact_at_surfaces_and_at_walls() {
    let free = |x: Vector| Vector::new(2.0 * x.x + 0.7 * x.z, 0.3, x.y - 0.5 * x.z);
    // Along the floor and a wall, so that their mirrors continue it.
    let walled = |x: Vector| Vector::new(2.0 * x.x, 0.3, -0.5 * x.z);
    for radius in [2.6, 3.1] {
        for (sides, flow, free) in
            [([OPEN; 3], free as fn(Vector) -> Vector, true), ([OPEN_TOP, OPEN, OPEN_TOP], walled, false)]
        {
            let mut solver = posed(sides, radius);
            let velocity = column(&mut solver, flow);
            let worst = |solver: &Solver| {
                let found = divergence(solver, &velocity);
                let of = |a: usize| if solver.particles.is_fluid(a) { (found[a] - 1.5).abs() } else { 0.0 };
                (0..found.len()).map(of).fold(0.0, Real::max)
            };
            let exact = worst(&solver);
            assert!(exact < 2e-5, "{radius} {free}: {exact:e}");
            // Negative control: without the moments.
            let plain = worst(&without_moments(solver));
            assert!(plain > 0.3, "{radius} {free}: {plain}");
        }
    }
}

#[test]
fn the_pressure_force_is_the_negative_transpose_of_the_divergence() {
    let all = [[WALLS, PERIODIC, OPEN_TOP], [WALLS, WALLS, OPEN_TOP], [PERIODIC, PERIODIC, OPEN], [OPEN; 3]];
    let clear = |_: Vector| 1.0;
    // Between grains, as dense as they come; it does not fit a period, nor need it.
    let bed = |x: Vector| 0.7 - 0.3 * (0.4 * x.x + 0.5 * x.y).sin() * (0.9 * x.z).cos();
    let kinds = [(clear as fn(Vector) -> Real, 2.6), (clear, 3.1), (bed, 2.6)];
    for (sides, (void, radius)) in all.into_iter().flat_map(|sides| kinds.map(|kind| (sides, kind))) {
        let mut solver = posed_between(sides, radius, void);
        let mut random = Random::new(3);
        let velocity = column(&mut solver, |_| {
            Vector::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0))
        });
        let pressure = column(&mut solver, |_| random.between(0.0, 1.0));
        let work: Real = force(&solver, &pressure).iter().zip(&velocity).map(|(f, u)| f.dot(*u)).sum();
        let against = |found: Vec<Real>| -> Real { found.iter().zip(&pressure).map(|(d, p)| d * p).sum() };
        let transposed = against(divergence(&solver, &velocity));
        let scale: Real = force(&solver, &pressure).iter().map(|f| f.length()).sum();
        assert!((work + transposed).abs() < 1e-13 * scale, "{sides:?}: {work} {transposed}");
        // Without walls the momentum of fluid and grains is kept, in single precision where void fractions differ.
        let between = void(Vector::X) != 1.0;
        let inverse_void = &solver.conjugate.voids.start.inverse;
        let sum = force(&solver, &pressure).iter().zip(inverse_void).map(|(f, inverse)| *inverse * *f).sum::<Vector>();
        let bound = if between { 1e-7 } else { 1e-13 };
        for d in (0..3).filter(|&d| sides[d][0] != Side::Wall) {
            assert!(sum[d].abs() < bound * scale, "{sides:?}: {sum} {scale}");
            // Negative control: that of the fluid alone.
            let fluid = force(&solver, &pressure).into_iter().sum::<Vector>();
            assert!(!between || fluid[d].abs() > 1e-4 * scale, "{sides:?}: {fluid} {scale}");
        }
        // Negative control: walls push.
        assert!(sides[2][0] == Side::Open || sum.z.abs() > 1e-3 * scale);
        // Negative control: a divergence without the moments is not the transpose.
        let plain = against(divergence(&without_moments(solver), &velocity));
        assert!((work + plain).abs() > 1e-4 * scale, "{sides:?}: {work} {plain}");
    }
}

#[test]
fn in_a_bed_neighbours_are_missing_beside_a_surface_alone() {
    let solver = posed_between([WALLS, PERIODIC, OPEN_TOP], 2.6, |_| 0.97);
    let (rows, sums) = (&solver.equation.rows, solver.conjugate.operators().sums);
    let fluid = (0..solver.particles.owned).filter(|&a| solver.particles.is_fluid(a));
    let (outer, inner): (Vec<usize>, Vec<usize>) = fluid.partition(|&a| rows[a].beside_surface);
    assert!(inner.len() > 100 && outer.len() > 100, "{} {}", inner.len(), outer.len());
    assert!(inner.iter().all(|&a| rows[a].diagonal == sums[a][3]));
    assert!(outer.iter().filter(|&&a| rows[a].diagonal > 1.1 * sums[a][3]).count() >= 80);
    // Negative control: in clear water disorder alone misses neighbours inside.
    let clear = posed([WALLS, PERIODIC, OPEN_TOP], 2.6);
    let (rows, sums) = (&clear.equation.rows, clear.conjugate.operators().sums);
    assert!(inner.iter().any(|&a| rows[a].diagonal > 1.03 * sums[a][3]));
}

#[test]
fn beds_are_closed_where_there_is_a_surface_and_not_for_isolated_particles() {
    let mut solver = posed_between([WALLS, PERIODIC, OPEN_TOP], 2.6, |_| 0.97);
    let fluid: Vec<usize> = (0..solver.particles.owned).filter(|&a| solver.particles.is_fluid(a)).collect();
    // Part of the rows that see no surface which are closed, with these roles of the first particles.
    let mut closed = |roles: &[Role]| {
        let Solver { domain, periods, settings, kernel, particles, equation, conjugate, surface, .. } = &mut solver;
        let (forcing, reduced_force, surface) = (&Forcing::default(), Vector::ZERO, *surface);
        let (domain, periods, settings, kernel) = (&*domain, &*periods, &*settings, &*kernel);
        let step =
            Context { domain, periods, settings, kernel, surface, forcing, reduced_force, dt: 0.01, flow_time: 0.01 };
        let sums = conjugate.operators().sums;
        for (n, &a) in fluid.iter().enumerate() {
            particles.role[a] = roles.get(n).copied().unwrap_or(Role::Unknown);
            equation.rows[a].diagonal = 1.1 * sums[a][3];
        }
        conjugate.close_inside_beds(&step, &particles.role, &mut equation.rows[..particles.owned]);
        let inner = || fluid.iter().filter(|&&a| !equation.rows[a].beside_surface);
        inner().filter(|&&a| equation.rows[a].diagonal == sums[a][3]).count() as Real / inner().count() as Real
    };
    assert_eq!(closed(&[Role::Dirichlet; 40]), 1.0);
    // Isolated particles, however many, are no surface, and take no part of it.
    assert_eq!(closed(&[]), 0.0);
    assert_eq!(closed(&[Role::Inactive]), 0.0);
    assert_eq!(closed(&[Role::Inactive; 40]), 0.0);
    let mut both = [Role::Inactive; 80];
    both[..40].fill(Role::Dirichlet);
    assert_eq!(closed(&both), 1.0);
}

/// Drift of shifting in the middle of a lattice inverted in a sphere of this `radius`, where it lies `along`, over the spacing
/// of clear water; and that without the bulk volume of the neighbours. Cells stay cubes, and their edges grow with the square
/// of the distance from the centre: the void fraction that is right for them falls with its sixth power.
fn drift_of_an_inverted_lattice(radius: Real, along: Vector) -> [Vector; 2] {
    let inverted = |y: Vector| radius * radius / y.length_squared() * y;
    let (first, middle) = ((radius - 3.5) * along, Vector::splat(7.0));
    let shift = middle - inverted(first);
    let cells = (0..343).map(|n| [n % 7, n / 7 % 7, n / 49].map(|n| Real::from(n) - 3.0));
    let position = cells.map(|cell| inverted(first + Vector::from_array(cell)) + shift);
    let fluid: Vec<_> = position.map(|position| FluidParticle { position, velocity: Vector::ZERO }).collect();
    let void = |x: Vector| ((x - shift).length() / radius).powi(-6);
    let Solver { particles, conjugate, equation, .. } = posed_of(&fluid, Vector::splat(14.0), [OPEN; 3], 2.6, void);
    let is_middle = |&a: &usize| particles.is_fluid(a) && (particles.position[a] - middle).length() < 1e-9;
    let a = (0..particles.owned).find(is_middle).unwrap();
    let (near, bulk) = (Near::new(1.0), conjugate.voids.bulk());
    let plain = conjugate.pairs.of(&equation.blocks, a).map(|pair| {
        let narrower = bulk.narrowing(a, pair.particle);
        -near.drift(pair.way().length() * narrower) * narrower * narrower * pair.way()
    });
    [conjugate.surroundings[a].drift, plain.sum()]
}

#[test]
fn shifting_leaves_water_that_follows_the_voids_where_it_is() {
    for along in [Vector::Z, Vector::new(0.6, 0.0, 0.8)] {
        let [steep, gentle] = [30.0, 60.0].map(|radius| drift_of_an_inverted_lattice(radius, along));
        // Water and voids of the same slope: none to first order, and none to second.
        let [weighted, plain] = [0, 1].map(|n| steep[n].length() / gentle[n].length());
        assert!(gentle[0].length() < 1e-4 && (6.0..12.0).contains(&weighted), "{along}: {steep:?} {gentle:?}");
        // Negative control: without bulk volumes half of the slope of `-ln eps`, into the bed.
        let half = 3.0 / (60.0 * 60.0 / 56.5);
        assert!((gentle[1].dot(along) / half - 1.0).abs() < 0.12 && plain < 2.5, "{along}: {steep:?} {gentle:?}");
    }
}

/// Largest speed over `g dt` after a step of the solver from rest, its water with this void fraction or `clear`.
fn speed_after_a_step(solver: &mut Solver, void: impl Fn(Vector) -> Real, clear: bool) -> Real {
    let widest = Real::cbrt(2.5);
    prepare(solver, widest, void);
    let body_force = -10.0 * Vector::Z;
    let (forcing, surface) = (&Forcing { body_force, ..Forcing::default() }, solver.surface);
    let Solver { domain, periods, settings, kernel, tank, particles, near, equation, conjugate, .. } = solver;
    let (domain, periods, settings, kernel, reduced_force) = (&*domain, &*periods, &*settings, &*kernel, Vector::ZERO);
    let step =
        &Context { domain, periods, settings, kernel, surface, forcing, reduced_force, dt: 0.01, flow_time: 0.01 };
    conjugate.voids.prepare(particles.owned, clear);
    conjugate.sum_over_pairs(step, (&Mirrors::of(tank), widest), near, particles, equation);
    conjugate.add_viscosity_and_body_force(step, tank, near, particles, equation);
    conjugate.set_right_side(step, particles, near, equation);
    conjugate.solve_pressure(step, near, particles, equation, Real::INFINITY).unwrap();
    conjugate.correct_velocities(step, particles, equation);
    let speed = |a: usize| if particles.is_fluid(a) { conjugate.new.velocity[a].length() } else { 0.0 };
    (0..particles.owned).map(speed).fold(0.0, Real::max) / (10.0 * step.dt)
}

#[test]
fn still_water_under_a_lid_stays_as_it_is_with_grains_and_without() {
    let bed = |x: Vector| 0.7 - 0.3 * (0.2 * std::f64::consts::PI * x.x).sin() * (0.9 * x.z).cos();
    for void in [bed as fn(Vector) -> Real, |_| 1.0] {
        let mut solver = posed_of(&block(), Vector::new(10.0, 8.0, 6.0), [PERIODIC, PERIODIC, WALLS], 2.6, bed);
        solver.settings.scheme.relaxation = Real::INFINITY;
        solver.settings.tolerance.strain = 1e-10;
        let between = speed_after_a_step(&mut solver, void, false);
        assert!(between < 1e-6, "{between:e}");
        let Particles { pressure, position, gradient, .. } = &solver.particles;
        let fluid: Vec<usize> = (0..solver.particles.owned).filter(|&a| solver.particles.is_fluid(a)).collect();
        let depth = |a: usize| pressure[a] + 20.0 * position[a].z;
        assert!(
            fluid.iter().all(|&a| (depth(a) - depth(fluid[0])).abs() < 1e-4 && (gradient[a].z + 20.0).abs() < 1e-4)
        );
        // So does water alone.
        let alone = speed_after_a_step(&mut solver, void, true);
        assert!(alone < 1e-6, "{alone:e}");
    }
    // Negative control: under a free surface the whole pressure of water alone pushes the disordered particles about.
    let mut open = posed_of(&block(), Vector::new(10.0, 8.0, 8.0), [PERIODIC, PERIODIC, OPEN_TOP], 2.6, |_| 1.0);
    open.settings.scheme.relaxation = Real::INFINITY;
    let alone = speed_after_a_step(&mut open, |_| 1.0, true);
    assert!(alone > 0.05, "{alone:e}");
}

#[test]
fn between_grains_shifting_leaves_the_mean_of_the_water_where_it_is() {
    let void = |x: Vector| if x.x < 5.0 { 0.6 } else { 1.0 };
    let mut solver = posed_between([OPEN_TOP, PERIODIC, OPEN_TOP], 2.6, void);
    let mut random = Random::new(4);
    let mut sorted = |_| Vector::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    let fields = [column(&mut solver, |_| Vector::Y), column(&mut solver, &mut sorted)];
    let Solver { kernel, particles, equation, conjugate, .. } = &solver;
    let (pairs, bulk) = ((&conjugate.pairs, &equation.blocks[..]), conjugate.voids.bulk());
    let [even, odd] = fields.map(|ways| {
        let mut means = vec![Vector::ZERO; particles.owned];
        find_means(kernel, pairs, &bulk, &ways, |a| particles.is_fluid(a), &mut means);
        means
    });
    for a in (0..particles.owned).filter(|&a| particles.is_fluid(a)) {
        let between = particles.position[a].x < 5.0;
        // What moves as one is its own mean; what only sorts particles has hardly any; clear water keeps both.
        assert!((even[a] - if between { Vector::Y } else { Vector::ZERO }).length() < 1e-12);
        assert!((odd[a] != Vector::ZERO) == between);
    }
    // Of three variances of 1/3.
    let [left, number] =
        odd.iter().filter(|m| **m != Vector::ZERO).fold([0.0; 2], |[l, n], m| [l + m.length_squared(), n + 1.0]);
    assert!(left / number < 0.1, "{}", left / number);
}

#[test]
fn momentum_and_energy_of_a_step_are_what_its_parts_report() {
    for relaxation in [Real::INFINITY, 10.0] {
        let mut solver = posed([WALLS, PERIODIC, OPEN_TOP], 2.6);
        let mut random = Random::new(9);
        let mut some = || 0.2 * random.between(-1.0, 1.0);
        let velocities: Vec<Vector> = (0..480).map(|_| Vector::new(some(), some(), some())).collect();
        solver.set_velocities(|particles, a| velocities[particles.id[a] as usize]);
        solver.settings.scheme.relaxation = relaxation;
        solver.settings.fluid.viscosity = 0.0;
        solver.settings.tolerance.strain = 1e-10;
        let energy = |solver: &Solver| {
            solver.particle_mass() * solver.sum_over_fluid(|p, a| [0.5 * p.velocity[a].length_squared()])[0]
        };
        for n in 0..10 {
            let body_force = if n < 5 { Vector::ZERO } else { Vector::new(0.1, 0.0, -1.0) };
            let forcing = Forcing { body_force, ..Forcing::default() };
            let (before, momentum) = (energy(&solver), solver.fluid_momentum());
            let report = solver.step(0.01, &forcing, |_| ()).unwrap();
            let FluidImpulses { body_force, wall_pressure, friction, contact } = report.impulses;
            let rest = solver.fluid_momentum() - momentum - (body_force + wall_pressure + friction + contact);
            assert!(rest.length() < 1e-12 * wall_pressure.length(), "{rest} {wall_pressure}");
            let EnergyChanges { projection, relaxation: relaxed, shifting } = report.energy;
            assert!(report.stabilisation_work < 0.0 && projection < 0.0, "{report:?}");
            // Only a pressure that relaxes the density can add energy.
            assert!((relaxed == 0.0) == relaxation.is_infinite(), "{relaxed:e}");
            if n < 5 {
                assert!(report.clipped == 0 && shifting == 0.0);
                let gained = energy(&solver) - before;
                let booked = projection + relaxed + report.stabilisation_work;
                assert!((gained - booked).abs() < 1e-11 * before, "{gained:e} {booked:e}");
                assert!(gained < 0.0 || relaxation.is_finite(), "{gained:e}");
                // Negative control: a part left out.
                assert!((gained - projection - relaxed).abs() > 1e-6 * before);
            } else {
                assert!(shifting != 0.0);
            }
        }
    }
}

/// Damping for a damping number of 1 in a flow, without and with the part of the velocity gradients, by identifier.
fn damping(solver: &mut Solver, flow: &[Vector], void: fn(Vector) -> Real) -> [Vec<Vector>; 2] {
    solver.set_velocities(|particles, a| flow[particles.id[a] as usize]);
    prepare(solver, Real::cbrt(2.5), void);
    let Solver { particles, equation, conjugate, .. } = &*solver;
    let mut stress = vec![Received::default(); particles.owned];
    let (pairs, moments) = ((&conjugate.pairs, &equation.blocks[..]), (&conjugate.stress[..], &conjugate.inverse[..]));
    add_stress(pairs, (&particles.kind, &conjugate.voids.bulk()), moments, &mut stress);
    let mut found = [vec![Vector::ZERO; flow.len()], vec![Vector::ZERO; flow.len()]];
    for a in (0..particles.owned).filter(|&a| particles.is_fluid(a)) {
        let (id, whole) = (particles.id[a] as usize, conjugate.received[a].damping);
        (found[0][id], found[1][id]) = (whole - stress[a].damping, whole);
    }
    found
}

#[test]
fn damping_is_symmetric_takes_energy_and_leaves_linear_flows() {
    let dot = |u: &[Vector], v: &[Vector]| u.iter().zip(v).map(|(u, v)| u.dot(*v)).sum::<Real>();
    let mut random = Random::new(21);
    let mut some = || -> Vec<Vector> {
        let mut one = || random.between(-1.0, 1.0);
        (0..480).map(|_| Vector::new(one(), one(), one())).collect()
    };
    let clear: fn(Vector) -> Real = |_| 1.0;
    for (sides, void) in [
        ([WALLS, PERIODIC, OPEN_TOP], clear),
        ([OPEN; 3], clear),
        ([WALLS, PERIODIC, OPEN_TOP], |x: Vector| if x.x < 5.0 { 0.6 } else { 1.0 }),
    ] {
        let mut solver = posed(sides, 2.6);
        let (u, v) = (some(), some());
        let (at_u, at_v) = (damping(&mut solver, &u, void), damping(&mut solver, &v, void));
        let scale = dot(&u, &u);
        let asymmetry = |part: usize| (dot(&at_u[part], &v) - dot(&at_v[part], &u)).abs() / scale;
        assert!(asymmetry(1) < 1e-6, "{sides:?}: {:e}", asymmetry(1));
        // Negative control: without the part of the gradients.
        assert!(asymmetry(0) > 1e-4, "{sides:?}: {:e}", asymmetry(0));
        assert!(dot(&at_u[1], &u) < -0.1 * scale && dot(&at_v[1], &v) < -0.1 * scale);
        // A step may take all of a motion, not turn it over: the largest eigenvalue.
        let (mut mode, mut largest) = (u, 0.0);
        for _ in 0..20 {
            mode = damping(&mut solver, &mode, void).into_iter().next_back().unwrap();
            largest = dot(&mode, &mode).sqrt();
            mode.iter_mut().for_each(|u| *u /= largest);
        }
        assert!((0.3..1.0).contains(&largest), "{sides:?}: {largest}");
    }
    let mut solver = posed([OPEN; 3], 2.6);
    let mut places = vec![Vector::ZERO; 480];
    let particles = &solver.particles;
    (0..particles.owned)
        .filter(|&a| particles.is_fluid(a))
        .for_each(|a| places[particles.id[a] as usize] = particles.position[a]);
    let noise = damping(&mut solver, &some(), clear).into_iter().next_back().unwrap();
    let scale: Real = noise.iter().map(|u| u.length()).sum();
    let turning: Vector = places.iter().zip(&noise).map(|(x, f)| x.cross(*f)).sum();
    assert!(noise.iter().sum::<Vector>().length() < 1e-12 * scale && turning.length() < 1e-5 * scale, "{turning}");
    // Negative control: a quadratic flow is not left alone.
    let worst = |flow: Vec<Vector>, solver: &mut Solver| {
        damping(solver, &flow, clear)[1].iter().map(|f| f.length()).fold(0.0, Real::max)
    };
    let linear = places.iter().map(|x| Vector::new(2.0 * x.x + 0.7 * x.z, 0.3, x.y - 2.0 * x.z)).collect();
    let linear = worst(linear, &mut solver);
    let quadratic = worst(places.iter().map(|x| Vector::new(x.z * x.z, 0.0, 0.0)).collect(), &mut solver);
    assert!(linear < 1e-6 && quadratic > 0.01, "{linear} {quadratic}");
}
