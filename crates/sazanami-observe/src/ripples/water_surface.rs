//! The free surface of the water, seen from the side.

use sazanami_numerics::Real;

use super::section_density::SectionDensity;
use super::{SurfaceProfile, TankInside, WaterView};

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

#[cfg(test)]
mod tests {
    use super::super::made_up::{self, Lattice};
    use super::super::{Sides, TankInside};
    use super::*;
    use sazanami_numerics::Vector;

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
