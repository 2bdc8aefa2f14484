//! Walls that hold the water beside walls along which it slips.

use sazanami_mps::boundary::{Tank, WallFriction};
use sazanami_mps::grains::OverlappingGrains;
use sazanami_mps::solver::{Forcing, Solver};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::Solo;

use crate::support::{Case, PERIODIC, SPACING, WALLS, under};

/// Layers between the walls.
const LAYERS: usize = 8;

/// Mean velocities of the layers between two walls in a flow that a force along x1 drives, after a while, over the largest of a film.
fn layers(direction: usize, friction: [WallFriction; 2]) -> Vec<Real> {
    let mut sides = [PERIODIC; 3];
    sides[direction] = WALLS;
    let mut size = [6; 3];
    size[direction] = LAYERS;
    let case = Case { viscosity: 1e-3, ..Case::filled(size, size, sides) };
    let domain = case.domain(Box::<Solo>::default());
    let grains = OverlappingGrains::none(&domain).expect("no grains");
    let mut each = [[WallFriction::NoSlip; 2]; 3];
    each[direction] = friction;
    let tank = Tank { friction: each, ..case.tank() };
    let mut solver = Solver::new(domain, case.settings(), tank, &case.fluid, grains).expect("a sound tank");
    let force = Vector::new(0.1, 0.0, 0.0);
    let height = LAYERS as Real * SPACING;
    // 0.6 H^2/nu.
    let dt = 1.5e-4;
    for _ in 0..(0.6 * height * height / case.viscosity / dt) as usize {
        solver.step(dt, &under(force), |_| ()).expect("the step is sound");
    }
    let largest = force.x * height * height / (2.0 * case.viscosity);
    let layer = |n: usize| {
        let within = |x: Vector| (x[direction] / SPACING) as usize == n;
        let [sum, count] = solver.sum_over_fluid(|p, a| {
            let inside = Real::from(u8::from(within(p.position[a])));
            [inside * p.velocity[a].x, inside]
        });
        sum / count / largest
    };
    (0..LAYERS).map(layer).collect()
}

/// Flow from rest over a floor that holds it under a lid that does not, `x` from the floor over `H`: Schlichting and Gersten,
/// Boundary-Layer Theory, section 5.3, as half of a channel.
fn film(x: Real) -> Real {
    let term = |n: i32| {
        let k = (Real::from(n) + 0.5) * std::f64::consts::PI;
        4.0 / k.powi(3) * (k * x).sin() * (-k * k * 0.6).exp()
    };
    2.0 * x - x * x - (0..6).map(term).sum::<Real>()
}

#[test]
fn each_wall_has_its_own_friction() {
    let held = [WallFriction::NoSlip, WallFriction::Slip];
    for direction in [1, 2] {
        let found = layers(direction, held);
        let exact: Vec<Real> = (0..LAYERS).map(|n| film((n as Real + 0.5) / LAYERS as Real)).collect();
        let worst = found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, Real::max);
        assert!(worst < 0.02, "x{}: {worst}: {found:?} {exact:?}", direction + 1);
        // Turned upside down it is the same flow.
        let mut turned = layers(direction, [held[1], held[0]]);
        turned.reverse();
        assert!(found.iter().zip(&turned).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?} {turned:?}");
        // Control: walls that are alike are no film.
        let both = layers(direction, [WallFriction::NoSlip; 2]);
        assert!(both[LAYERS - 1] < 0.5 * found[LAYERS - 1], "{both:?}");
    }
}

#[test]
fn a_slow_flow_in_a_box_that_moves_is_solved_for_as_finely() {
    // Water that turns about x3 at up to a share of 0.1 m/s, in a box that moves at a speed.
    let residual = |share: Real, speed: Vector| {
        let mut case = Case { viscosity: 1e-4, ..Case::filled([8; 3], [8; 3], [WALLS; 3]) };
        for p in &mut case.fluid {
            let [x, y, _] = (std::f64::consts::PI * p.position / case.size[0] as Real / SPACING).to_array();
            let turning = Vector::new(x.sin() * y.cos(), -x.cos() * y.sin(), 0.0);
            p.velocity = 0.1 * share * turning + speed;
        }
        let mut solver = case.solo();
        let dt = 1e-4;
        let last = (1..=5).map(|n| {
            let wall_displacement = Real::from(n) * dt * speed;
            let forcing = Forcing { wall_displacement, wall_velocity: speed, ..Forcing::default() };
            solver.step(dt, &forcing, |_| ()).expect("the step is sound").pressure.residual
        });
        last.fold(0.0, Real::max)
    };
    let slow = residual(1e-3, Vector::ZERO);
    let moving = residual(1e-3, Vector::new(0.5, 0.2, 0.0));
    assert!(slow < 2e-8 && moving < 2e-8, "{slow} {moving}");
    // Control: of a fast flow no more is asked than is allowed.
    let fast = residual(1.0, Vector::ZERO);
    assert!((1e-7..1e-6).contains(&fast), "{fast}");
}
