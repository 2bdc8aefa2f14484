//! The cheap experiments of `sazanami verify`, on coarser lattices or for less time.

use sazanami_mps::boundary::Side;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{FluidParticle, Forcing};
use sazanami_mps::{Kind, Role};
use sazanami_numerics::{Real, Vector};
use sazanami_verification::particles::{DOWN, Vessel, WaveTank, seepage, standing_wave};

#[test]
fn a_bed_resists_as_ergun_says() {
    let found = seepage(Scheme::default(), 0.5, 0.8, 0.04).unwrap();
    assert!((found.ergun(3) - 1.0).abs() < 0.03, "{found:?}");
    // Negative control: another power of eps.
    assert!((found.ergun(2) - 1.0).abs() > 0.3);
}

#[test]
fn a_wave_swings_with_its_period() {
    let tank = WaveTank { length: 0.1, depth: 0.05, layers: 5, scheme: Scheme::default() };
    let found = standing_wave(tank, 1, 0.02).unwrap();
    assert!((found.period - 1.0).abs() < 0.05, "{found:?}");
}

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
