//! Spray beside a tank, in a vessel of the experiments.

use sazanami_mps::boundary::Side;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{FluidParticle, Forcing};
use sazanami_mps::{Kind, Role};
use sazanami_numerics::{Real, Vector};
use sazanami_verification::particles::{DOWN, Vessel};

/// Largest pressure on the walls after a step of water in a tank, and of droplets that fly at a wall from `height`
/// spacings above the floor, which see no water on their way; whether a wall particle there is in the equation.
fn on_walls(height: Real, droplets: usize) -> (Real, bool) {
    let spacing = 1e-3;
    let sides = [[Side::Wall; 2], [Side::Periodic; 2], [Side::Wall, Side::Open]];
    let mut vessel = Vessel::new([12, 7, 16], spacing, sides).filled([12, 7, 6]);
    vessel.scheme = Scheme::published();
    // Within the reach of a wall particle three spacings above, if only just.
    let corner = &mut vessel.fluid[5 * 12 * 7].position;
    corner.z += 0.1 * spacing;
    for n in 0..droplets {
        let position = spacing * Vector::new(0.8 + (n / 7) as Real, 0.5 + (n % 7) as Real, height);
        vessel.fluid.push(FluidParticle { position, velocity: Vector::new(-1.0, 0.0, 0.0) });
    }
    let mut solver = vessel.solver().expect("the vessel makes sense");
    solver.step(1e-4, &Forcing { body_force: DOWN, ..Forcing::default() }, |_| ()).expect("a step like any other");
    let particles = solver.particles();
    let walls =
        (0..particles.owned()).filter(|&a| particles.kind[a] == Kind::Wall && particles.role[a] == Role::Unknown);
    let above = |a: usize| particles.position[a].x < 0.0 && particles.position[a].z > 8.0 * spacing;
    let largest = walls.clone().map(|a| particles.pressure[a].abs()).fold(0.0, Real::max);
    (largest, walls.clone().any(above))
}

#[test]
fn spray_does_not_press_walls_that_hardly_see_water() {
    let [far, near] = [14.5, 8.9].map(|height| on_walls(height, 1));
    assert!(near.1 && (near.0 - far.0).abs() < 0.1 * far.0, "{near:?}, {far:?} without the droplet");
    // Droplets that keep company are water, and press.
    let together = on_walls(8.9, 14);
    assert!(together.0 > 100.0 * near.0, "{together:?}");
}
