//! The free surface of the water, seen from the side and at a place.

use sazanami_numerics::{Real, Vector};

use super::section_density::SectionDensity;
use super::{Sides, SurfaceProfile, TankInside, WaterView};

/// Share of space at the surface: half of the water below.
const LEVEL: Real = 0.5;

/// Height of the water surface against x1 every `spacing` \[m]: the highest place at which the bulk volume of the
/// water, averaged across the tank over a reach of 2.5 particle spacings (`particle` \[m]), is half of the space, and
/// below which the next point is wet too. Particles that fly free of the others do not count; where the tank is dry
/// there is no surface.
#[must_use]
pub fn water_surface(tank: &TankInside, water: &WaterView, spacing: Real, particle: Real) -> SurfaceProfile {
    let flying = |n: usize| water.splash[n];
    let particles = (0..water.position.len()).filter(|&n| !flying(n));
    let particles = particles.map(|n| (water.position[n], water.bulk_volume[n]));
    SectionDensity::of(tank, spacing, 2.5 * particle, particles).surface(LEVEL, 2)
}

/// Reach across the tank of a gauge, in particle spacings: a whole number of them adds up rows of particles to the same sum wherever they lie.
const ACROSS: Real = 3.0;

/// Height of the water surface at a `place` in x1 and x2 \[m], as [`water_surface`] finds it in the water that lies within three particle spacings
/// (`particle` \[m]) across, the nearer the more; across the whole tank where that is narrower than six.
#[must_use]
pub fn water_level_at(tank: &TankInside, water: &WaterView, place: [Real; 2], particle: Real) -> Option<Real> {
    let reach = ACROSS * particle;
    let [x, y] = place;
    let weight = |at: Real| (1.0 - (at - y).abs() / reach).max(0.0) * tank.width() / reach;
    let share = |at: Real| {
        if tank.width() <= 2.0 * reach {
            return 1.0;
        }
        let images = match tank.sides {
            Sides::Periodic => [-1.0, 1.0].map(|turn| at + turn * tank.width()),
            Sides::Walls => tank.y.map(|wall| 2.0 * wall - at),
        };
        weight(at) + images.map(weight).iter().sum::<Real>()
    };
    let is_near = |n: usize| tank.way(Vector::new(x, y, 0.0), water.position[n]).x.abs() < 4.0 * particle;
    let near = (0..water.position.len()).filter(|&n| !water.splash[n] && is_near(n));
    let particles = near.map(|n| (water.position[n], water.bulk_volume[n] * share(water.position[n].y)));
    let surface = SectionDensity::of(tank, 0.5 * particle, 2.5 * particle, particles).surface(LEVEL, 2);
    match tank.ends {
        Sides::Periodic => surface.at_repeating(x),
        Sides::Walls => surface.at(x),
    }
}

#[cfg(test)]
mod tests {
    use super::super::made_up::{self, Lattice};
    use super::*;

    #[test]
    fn the_surface_lies_where_the_water_ends() {
        for sides in [Sides::Periodic, Sides::Walls] {
            let tank = made_up::tank(sides);
            let level = |x: Real| 0.010 + 0.1 * x;
            let water = Lattice::below(&tank, 0.5e-3, 1.0, level);
            let surface = water_surface(&tank, &water.water(), 0.5e-3, 0.5e-3);
            assert_eq!(surface.len(), 120);
            for [x, z] in surface.points().filter(|[x, _]| x.abs() < 0.0285) {
                assert!((z - level(x)).abs() < 0.25e-3, "{x}: {z} against {}", level(x));
            }
            assert!((surface.mean().expect("there is water") - 0.010).abs() < 0.05e-3);
        }
    }

    #[test]
    fn gauges_read_the_level_where_they_stand() {
        for sides in [Sides::Periodic, Sides::Walls] {
            let tank = TankInside { y: [0.0, 0.04], sides, ..made_up::tank(Sides::Walls) };
            let mut water = Lattice::below(&tank, 1e-3, 1.0, |_| 0.020);
            water.splash = water.position.iter().map(|place| place.y > 0.01 && place.z > 0.004).collect();
            let view = water.water();
            let at = |y: Real| water_level_at(&tank, &view, [0.0, y], 1e-3).expect("there is water");
            for (y, level) in [(0.005, 0.020), (0.02, 0.004), (0.03, 0.004)] {
                assert!((at(y) - level).abs() < 0.25e-3, "{y}: {}", at(y));
            }
            // Beside a wall there is as much water behind it; beside joined sides a part of what lies at the other one.
            assert!(at(0.001) > 0.019, "{}", at(0.001));
            // Negative control: averaged across, the water has one level.
            let mean = water_surface(&tank, &view, 0.5e-3, 1e-3).at(0.0).expect("there is water");
            assert!((mean - 0.020).abs() > 2e-3 && (mean - 0.008).abs() > 2e-3, "{mean}");
        }
    }

    #[test]
    fn splash_does_not_count_and_a_dry_floor_has_no_surface() {
        let tank = made_up::tank(Sides::Periodic);
        let mut water = Lattice::below(&tank, 1e-3, 1.0, |x| if x < 0.0 { 0.010 } else { 0.0 });
        let calm = water_surface(&tank, &water.water(), 0.5e-3, 1e-3);
        assert!(calm.at(-0.02).is_some() && calm.at(0.02).is_none());
        let flying: Vec<Vector> = (0..8)
            .flat_map(|j| [1.0, 2.0].map(|k| (j, k)))
            .map(|(j, k)| Vector::new(-0.02, (f64::from(j) + 0.5) * 1e-3, 0.020 + k * 0.5e-3))
            .collect();
        flying.iter().for_each(|&place| water.add(place, 0, true));
        assert_eq!(water_surface(&tank, &water.water(), 0.5e-3, 1e-3).at(-0.02), calm.at(-0.02));
        // The same water not flagged is a crest.
        water.splash.fill(false);
        let raised = water_surface(&TankInside { ..tank }, &water.water(), 0.5e-3, 1e-3);
        assert!(raised.at(-0.02).expect("water") > 0.019, "{:?}", raised.at(-0.02));
    }
}
