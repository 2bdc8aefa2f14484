//! Gates: they hold water as walls do, let it go, and give the same bits on threads and after restarts.

use crate::equivalence::{ranks_agree, restart_agrees, threads_agree};
use crate::support::{Case, GRAVITY, OPEN_TOP, PERIODIC, SPACING, WALLS, jittered, lattice, under};
use sazanami_dem::Grain;
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::gates::Gate;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{FluidParticle, SetupError, Solver};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::Solo;

/// A gate at `place` spacings, as high as its tank.
fn gate(direction: usize, place: usize, opens: Real, speed: Option<Real>) -> Gate {
    Gate::closed(direction, place as Real * SPACING, [0.0, 16.0 * SPACING], opens, speed)
}

/// A column 10 wide and high in a tank of a length.
fn column(length: usize, gates: Vec<Gate>) -> Case {
    Case { gates, ..Case::filled([length, 8, 16], [10, 8, 10], [WALLS, PERIODIC, OPEN_TOP]) }
}

fn fluid(solver: &Solver) -> Vec<(u64, Vector, Vector, Real)> {
    let p = solver.particles();
    let fluid = (0..p.owned()).filter(|&a| p.is_fluid(a));
    let mut all: Vec<_> = fluid.map(|a| (p.id[a], p.position[a], p.velocity[a], p.pressure[a])).collect();
    all.sort_by_key(|particle| particle.0);
    all
}

/// A run in steps of 0.2 ms; returns the sums of the impulses of walls and body force.
fn run(case: &Case, steps: usize) -> (Solver, [Vector; 2]) {
    let mut solver = case.solo();
    let mut impulses = [Vector::ZERO; 2];
    let dt = 2e-4;
    for n in 0..steps {
        solver.open_gates(dt * n as Real);
        let report = solver.step(dt, &under(GRAVITY), |_| ()).expect("the step is sound");
        impulses[0] += report.impulses.wall_pressure;
        impulses[1] += report.impulses.body_force;
    }
    (solver, impulses)
}

fn fastest(solver: &Solver) -> Real {
    fluid(solver).iter().map(|particle| particle.2.length()).fold(0.0, Real::max)
}

fn front(solver: &Solver) -> Real {
    fluid(solver).iter().map(|particle| particle.1.x).fold(0.0, Real::max)
}

#[test]
fn a_closed_gate_is_a_wall() {
    let closed = vec![gate(0, 10, Real::INFINITY, None)];
    let (behind, [walls, weight]) = run(&column(24, closed.clone()), 500);
    // sqrt(g H) is 0.31 m/s; what the floor carries is the weight, and the gate holds what the wall across holds.
    assert!(fastest(&behind) < 0.31 * 0.02, "{}", fastest(&behind));
    assert!((walls.z / weight.z + 1.0).abs() < 0.01, "{walls} {weight}");
    assert!(walls.x.abs() < 1e-3 * walls.z, "{walls}");
    let foot = |solver: &Solver| {
        let near = |x: &Vector| x.x > 9.0 * SPACING && x.x < 10.0 * SPACING && x.z < SPACING;
        let foot: Vec<Real> = fluid(solver).iter().filter(|p| near(&p.1)).map(|p| p.3).collect();
        foot.iter().sum::<Real>() / foot.len() as Real
    };
    let hydrostatic = 9.81 * 1e3 * 9.5 * SPACING;
    assert!((foot(&behind) / hydrostatic - 1.0).abs() < 0.03, "{} {hydrostatic}", foot(&behind));
    // Rounding alone tells it from the wall of a shorter tank.
    let solved = |case: Case| {
        let mut case = Case { fluid: jittered(case.fluid.clone(), 0.05), ..case };
        case.tolerance.strain = 1e-10;
        fluid(&run(&case, 20).0)
    };
    let [behind, between] = [column(24, closed), column(10, Vec::new())].map(solved);
    for (a, b) in behind.iter().zip(&between) {
        assert!((a.1 - b.1).length() < 1e-6 * SPACING && (a.3 - b.3).abs() < 1e-3, "{a:?} {b:?}");
    }
    // Negative control: without the gate the column collapses.
    let (free, _) = run(&column(24, Vec::new()), 100);
    assert!(fastest(&free) > 0.1, "{}", fastest(&free));
}

#[test]
fn water_of_two_levels_stays_apart() {
    for direction in [0, 1] {
        let mut case = column(20, vec![gate(direction, 10, Real::INFINITY, None)]);
        let places = lattice([20, 20, 10]).into_iter();
        let low = |x: &Vector| x[direction] < 10.0 * SPACING || x.z < 5.0 * SPACING;
        (case.size, case.sides) = ([20, 20, 16], [WALLS, WALLS, OPEN_TOP]);
        case.fluid = places.filter(|p: &FluidParticle| low(&p.position)).collect();
        let sides =
            |solver: &Solver| -> Vec<bool> { fluid(solver).iter().map(|p| p.1[direction] < 10.0 * SPACING).collect() };
        let begun = sides(&case.solo());
        let (solver, _) = run(&case, 100);
        assert_eq!(sides(&solver), begun);
        assert!(fastest(&solver) < 0.31 * 0.02, "{direction}: {}", fastest(&solver));
    }
}

/// `erfc(x)` for `x >= 0` by Simpson's rule on `2/sqrt(pi) exp(-s^2)`.
fn erfc(x: Real) -> Real {
    let (parts, term) = (200, |s: Real| (-s * s).exp());
    let h = x / Real::from(parts);
    let weight = |n: i32| if n == 0 || n == parts { 1.0 } else { 2.0 + 2.0 * Real::from(n % 2) };
    let sum: Real = (0..=parts).map(|n| weight(n) * term(h * Real::from(n))).sum();
    1.0 - 2.0 / std::f64::consts::PI.sqrt() * sum * h / 3.0
}

/// Velocities along a gate that rises without end in still water, of the layers of particles on both sides, over that of the gate;
/// with their distance from it over `2 sqrt(nu t)`.
fn dragged(friction: WallFriction) -> Vec<[Real; 2]> {
    let (half, speed, steps, dt) = (20, 0.05, 100, 1e-4);
    let mut case = Case::filled([2 * half, 6, 6], [2 * half, 6, 6], [WALLS, PERIODIC, PERIODIC]);
    (case.friction, case.viscosity) = (friction, 1e-3);
    case.gates = vec![Gate::closed(0, half as Real * SPACING, [-1.0, 1.0], 0.0, Some(speed))];
    let mut solver = case.solo();
    let mut rise = |n: usize| {
        solver.open_gates(dt * n as Real);
        solver.step(dt, &under(Vector::ZERO), |_| ()).expect("the step is sound");
    };
    (0..steps).for_each(&mut rise);
    let length = 2.0 * (case.viscosity * dt * steps as Real).sqrt();
    let all = fluid(&solver);
    let layer = |n: usize| {
        let inside = |x: &Vector| (x.x / SPACING) as usize == n;
        let speeds: Vec<Real> = all.iter().filter(|p| inside(&p.1)).map(|p| p.2.z / speed).collect();
        let distance = (n as Real + 0.5 - half as Real).abs() * SPACING;
        [distance / length, speeds.iter().sum::<Real>() / speeds.len() as Real]
    };
    (0..2 * half).map(layer).collect()
}

/// Stokes' first problem: Schlichting and Gersten, Boundary-Layer Theory, 8th ed., section 5.3.1.
#[test]
fn a_rough_gate_that_rises_drags_still_water_along() {
    let layers = dragged(WallFriction::NoSlip);
    let worst = layers.iter().map(|&[y, u]| (u - erfc(y)).abs()).fold(0.0, Real::max);
    assert!(worst < 0.01, "{worst}: {layers:?}");
    assert!(layers.iter().any(|layer| layer[1] > 0.8), "{layers:?}");
    // Negative control: a smooth one drags nothing.
    let smooth = dragged(WallFriction::Slip);
    assert!(smooth.iter().all(|layer| layer[1].abs() < 1e-9), "{smooth:?}");
}

#[test]
fn the_front_runs_as_without_a_gate() {
    // Gone at once, at the first moment: as if there had been none, to the last bit.
    let begun = |gates| fluid(&run(&column(60, gates), 40).0);
    assert_eq!(begun(vec![gate(0, 10, 0.0, None)]), begun(Vec::new()));
    let run = |gates| run(&column(60, gates), 250).0;
    let free = run(Vec::new());
    let raised = run(vec![gate(0, 10, 0.0, Some(3.0))]);
    let ways = [&raised, &free].map(|solver| front(solver) - 10.0 * SPACING);
    assert!((ways[0] / ways[1] - 1.0).abs() < 0.06, "{ways:?}");
    assert_eq!(fluid(&raised).len(), fluid(&free).len());
    // Negative control: at a sixtieth of the speed the water is still held at its height.
    let slow = run(vec![gate(0, 10, 0.0, Some(0.05))]);
    let way = front(&slow) - 10.0 * SPACING;
    assert!(way < 0.9 * ways[1], "{way} {ways:?}");
}

#[test]
fn threads_restarts_and_ranks_agree_while_it_opens() {
    let opening = |opens| {
        let mut case = column(24, vec![gate(0, 10, opens, Some(4.0))]);
        case.fluid = jittered(case.fluid, 0.05);
        case
    };
    threads_agree(&opening(8e-4));
    restart_agrees(&opening(8e-4), "fluid/pressure");
    ranks_agree(opening(2e-4));
    // Negative control: the gate of the first of these matters.
    let ends = [8e-4, 1.0].map(|opens| fluid(&run(&opening(opens), 14).0));
    assert!(ends[0] != ends[1]);
}

/// A bed of grains two deep on one side of a gate, under water on both.
fn bed(opens: Real, speed: Option<Real>) -> Case {
    let mut case = column(24, vec![gate(0, 12, opens, speed)]);
    case.fluid = lattice([24, 8, 8]);
    let place = |n: u64| Vector::new(0.5 + (n % 12) as Real, 0.5 + (n / 12 % 8) as Real, 0.5 + (n / 96) as Real);
    case.grains = (0..192).map(|n| Grain::new(n, 2650.0, SPACING * place(n))).collect();
    case.grains.iter_mut().for_each(|grain| grain.velocity.x = 0.05);
    case
}

#[test]
fn a_gate_holds_grains_and_hides_them() {
    let grains = |solver: &Solver| -> Real {
        let grains = solver.grains().engine().grains();
        (0..grains.owned()).map(|g| grains.position[g].x / SPACING).fold(0.0, Real::max)
    };
    let void = |solver: &mut Solver, x: Real| {
        solver.place_grains();
        solver.grains().void_fraction(SPACING * Vector::new(x, 4.0, 1.0))
    };
    let closed = bed(1.0, None);
    let mut solver = closed.solo();
    // Beside the gate the bed is as dense as inside, as beside a wall, and behind it is clear water.
    let inside = void(&mut solver, 6.0);
    assert!((void(&mut solver, 11.5) / inside - 1.0).abs() < 0.02, "{inside} {}", void(&mut solver, 11.5));
    assert_eq!(void(&mut solver, 12.2), 1.0);
    // Negative control: without the gate it is neither.
    let mut open = Case { gates: Vec::new(), ..closed.clone() }.solo();
    assert!(void(&mut open, 12.2) < 0.9 && void(&mut open, 11.5) > 1.1 * inside);
    let held = run(&closed, 100).0;
    assert!(grains(&held) < 11.55, "{}", grains(&held));
    // Negative control: a gate that is gone at once lets them go.
    let gone = run(&bed(0.0, None), 100).0;
    assert!(grains(&gone) > 12.0, "{}", grains(&gone));
}

#[test]
fn grains_and_water_exchange_momentum_on_one_side() {
    let mut solver = bed(1e-3, Some(2.0)).solo();
    for n in 0..20 {
        solver.open_gates(2e-4 * n as Real);
        let report = solver.step(2e-4, &under(GRAVITY), |_| ()).expect("the step is sound").coupling;
        let scale = report.drag_on_grains.length();
        assert!(scale > 0.0 && (report.drag_on_grains + report.drag_on_fluid).length() <= 1e-11 * scale);
    }
    threads_agree(&bed(8e-4, Some(4.0)));
    restart_agrees(&bed(8e-4, Some(4.0)), "fluid/pressure");
    // Apart from each other, so that rounding does not decide who touches; the first row runs into the gate.
    let mut apart = bed(2e-4, Some(4.0));
    apart.grains.retain(|grain| grain.position.x > SPACING && grain.position.y < 7.0 * SPACING);
    let spread = Vector::new(1.02, 8.0 / 7.0, 1.02);
    apart.grains.iter_mut().for_each(|grain| grain.position = spread * grain.position - 0.24 * SPACING * Vector::X);
    let pushed =
        apart.solo().step(4e-4, &under(GRAVITY), |_| ()).expect("the step is sound").contacts.impulse_on_walls.x;
    let row = apart.grains.iter().filter(|grain| grain.position.x > 11.0 * SPACING).count() as Real;
    let momentum = row * 2650.0 * std::f64::consts::PI / 6.0 * SPACING.powi(3) * 0.05;
    assert!(pushed > momentum, "{pushed} {momentum}");
    ranks_agree(apart);
}

#[test]
fn drag_does_not_reach_through_a_gate() {
    let beyond = |case: Case| {
        let mut solver = case.solo();
        solver.step(2e-4, &under(GRAVITY), |_| ()).expect("the step is sound");
        let near = |x: Real| x > 12.0 * SPACING && x < 14.0 * SPACING;
        fluid(&solver).iter().filter(|p| near(p.1.x)).map(|p| p.2.x).fold(0.0, Real::max)
    };
    let closed = bed(1.0, None);
    // Negative control: without the gate the grains drag the water before them along.
    let (held, free) = (beyond(closed.clone()), beyond(Case { gates: Vec::new(), ..closed }));
    assert!(free > 1e-4 && held < 1e-2 * free, "{held} {free}");
}

#[test]
fn gates_that_do_not_fit_are_refused() {
    let tried = |case: &Case| case.tried_on(Box::<Solo>::default()).err();
    let at = |gates: &[(usize, usize)]| {
        let gates = gates.iter().map(|&(direction, place)| gate(direction, place, 0.0, None)).collect();
        Case { sides: [WALLS, WALLS, OPEN_TOP], size: [24, 16, 16], ..column(24, gates) }
    };
    assert!(tried(&at(&[(0, 10)])).is_none() && tried(&at(&[(0, 8), (0, 16)])).is_none());
    for gates in [&[(0, 4)][..], &[(0, 8), (0, 12)], &[(0, 8), (1, 8)], &[(2, 8)], &[(0, 30)]] {
        assert!(matches!(tried(&at(gates)), Some(SetupError::GatesTooNear { .. })), "{gates:?}");
    }
    let across = column(24, vec![gate(1, 4, 0.0, None)]);
    assert!(matches!(tried(&across), Some(SetupError::GatesTooNear { .. })));
    let enhanced = Case { scheme: Scheme::published(), ..at(&[(0, 10)]) };
    assert!(matches!(tried(&enhanced), Some(SetupError::Gates)));
}
