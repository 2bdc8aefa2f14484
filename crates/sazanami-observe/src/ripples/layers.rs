//! Means over two layers of the bed: flow, motion of the grains, and the forces on them along the shaking.

use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use super::SurfaceProfile;

/// One of two layers of the bed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The deeper one.
    Lower,
    /// The one at the surface.
    Upper,
}

/// Surface from which layers are counted.
#[derive(Clone, Copy, Debug)]
pub enum LayerReference<'a> {
    /// From the floor at this height \[m] upwards: lower, upper.
    Floor(Real),
    /// From the surface of the bed downwards: upper, lower. Beside the profile and in its gaps there is no layer.
    Surface(&'a SurfaceProfile),
}

/// Two layers of equal thickness.
#[derive(Clone, Copy, Debug)]
pub struct Layers<'a> {
    /// Surface from which they are counted.
    pub reference: LayerReference<'a>,
    /// Thickness of each \[m]: 5 grain diameters in the paper.
    pub thickness: Real,
    /// Part of x1 \[m] that is looked at.
    pub range: [Real; 2],
}

impl Layers<'_> {
    /// Layer that a place lies in, its lower bound included.
    #[must_use]
    pub fn of(&self, place: Vector) -> Option<Layer> {
        if place.x < self.range[0] || place.x > self.range[1] {
            return None;
        }
        let (distance, order) = match self.reference {
            LayerReference::Floor(floor) => (place.z - floor, [Layer::Lower, Layer::Upper]),
            LayerReference::Surface(surface) => (surface.at(place.x)? - place.z, [Layer::Upper, Layer::Lower]),
        };
        let number = (distance / self.thickness).floor();
        if number == 0.0 { Some(order[0]) } else { (number == 1.0).then_some(order[1]) }
    }

    /// Layer of each of several places. Kept from the beginning of a run, they are the layers by initial depth.
    #[must_use]
    pub fn sort(&self, places: &[Vector]) -> Vec<Option<Layer>> {
        places.iter().map(|&place| self.of(place)).collect()
    }
}

/// Grains at one instant, one entry each.
#[derive(Clone, Copy, Debug)]
pub struct LayerGrains<'a> {
    /// Layer of each grain ([`Layers::sort`]).
    pub layer: &'a [Option<Layer>],
    /// Velocities relative to the tank [m/s].
    pub velocity: &'a [Vector],
    /// Drag of the water on each grain \[N].
    pub drag: &'a [Vector],
    /// Force of the pressure gradient on each grain, buoyancy included \[N].
    pub pressure_force: &'a [Vector],
}

/// Water at one instant, one entry per particle.
#[derive(Clone, Copy, Debug)]
pub struct LayerWater<'a> {
    /// Layer of each particle ([`Layers::sort`]).
    pub layer: &'a [Option<Layer>],
    /// Volume that each particle takes up together with the grains in it, `V0 / eps` [m^3].
    pub bulk_volume: &'a [Real],
    /// Velocities relative to the tank [m/s].
    pub velocity: &'a [Vector],
}

/// Means of a layer along x1; `None` where nothing is in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayerMeans {
    /// Velocity of the water, by bulk volume [m/s].
    pub water_velocity: Option<Real>,
    /// Velocity of the grains [m/s].
    pub grain_velocity: Option<Real>,
    /// Drag on a grain \[N].
    pub drag: Option<Real>,
    /// Force of the pressure gradient on a grain \[N].
    pub pressure_force: Option<Real>,
    /// Number of particles of water.
    pub water_count: usize,
    /// Number of grains.
    pub grain_count: usize,
}

/// Weight under water \[N] of a sphere of `diameter` \[m], with the densities of grain and water [kg/m^3] and the
/// gravity [m/s^2].
#[must_use]
pub fn submerged_weight(diameter: Real, grain_density: Real, water_density: Real, gravity: Real) -> Real {
    (grain_density - water_density) * PI / 6.0 * diameter.powi(3) * gravity
}

/// Means over the members of a layer.
#[must_use]
pub fn layer_means(layer: Layer, grains: &LayerGrains, water: &LayerWater) -> LayerMeans {
    let members =
        |layers: &[Option<Layer>]| -> Vec<usize> { (0..layers.len()).filter(|&n| layers[n] == Some(layer)).collect() };
    let (grain, particle) = (members(grains.layer), members(water.layer));
    let mean = |values: &[Vector]| {
        (!grain.is_empty()).then(|| grain.iter().map(|&n| values[n].x).sum::<Real>() / grain.len() as Real)
    };
    let volume: Real = particle.iter().map(|&n| water.bulk_volume[n]).sum();
    let flow: Real = particle.iter().map(|&n| water.bulk_volume[n] * water.velocity[n].x).sum();
    LayerMeans {
        water_velocity: (volume > 0.0).then(|| flow / volume),
        grain_velocity: mean(grains.velocity),
        drag: mean(grains.drag),
        pressure_force: mean(grains.pressure_force),
        water_count: particle.len(),
        grain_count: grain.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_have_their_bounds() {
        let layers = Layers { reference: LayerReference::Floor(0.0), thickness: 5e-3, range: [-0.01, 0.01] };
        let at = |x: Real, z: Real| layers.of(Vector::new(x, 0.0, z));
        assert_eq!((at(0.0, 0.0), at(0.0, 4.9e-3)), (Some(Layer::Lower), Some(Layer::Lower)));
        assert_eq!((at(0.0, 5.1e-3), at(0.0, 9.9e-3)), (Some(Layer::Upper), Some(Layer::Upper)));
        assert_eq!((at(0.0, -1e-6), at(0.0, 10.1e-3), at(0.02, 1e-3)), (None, None, None));
    }

    #[test]
    fn layers_follow_a_surface() {
        let surface = SurfaceProfile::complete(-0.01, 0.01, [0.008, 0.010, 0.012]);
        let layers = Layers { reference: LayerReference::Surface(&surface), thickness: 5e-3, range: [-1.0, 1.0] };
        let at = |x: Real, z: Real| layers.of(Vector::new(x, 0.0, z));
        assert_eq!((at(-0.01, 4e-3), at(0.01, 4e-3)), (Some(Layer::Upper), Some(Layer::Lower)));
        assert_eq!((at(0.01, 0.0125), at(0.01, 1e-3), at(0.5, 4e-3)), (None, None, None));
    }

    #[test]
    fn means_are_by_volume_and_by_grain() {
        let (low, high) = (Some(Layer::Lower), Some(Layer::Upper));
        let along = |values: [Real; 4]| values.map(|x| Vector::new(x, 9.0, -9.0));
        let layer = [high, low, high, None];
        let (velocity, drag) = (along([1.0, 2.0, 3.0, 100.0]), along([2e-6, 0.0, 6e-6, 1.0]));
        let grains = LayerGrains { layer: &layer, velocity: &velocity, drag: &drag, pressure_force: &drag };
        let water = LayerWater { layer: &layer, bulk_volume: &[1.0, 1.0, 3.0, 1.0], velocity: &velocity };
        let upper = layer_means(Layer::Upper, &grains, &water);
        assert_eq!((upper.water_velocity, upper.grain_velocity), (Some(2.5), Some(2.0)));
        assert_eq!((upper.grain_count, upper.water_count), (2, 2));
        assert!((upper.drag.expect("two grains") - 4e-6).abs() < 1e-18);
        let lower = layer_means(Layer::Lower, &grains, &water);
        assert_eq!((lower.water_velocity, lower.pressure_force, lower.grain_count), (Some(2.0), Some(0.0), 1));
        let nothing = LayerGrains { layer: &[None; 4], ..grains };
        let empty = layer_means(Layer::Upper, &nothing, &LayerWater { layer: &[None; 4], ..water });
        assert_eq!(empty, LayerMeans::default());
    }

    #[test]
    fn all_layers_together_hold_the_whole() {
        // The sum over layers of what goes into the means is the sum over all members, and no layer counts twice.
        let places: Vec<Vector> = (0..1000).map(|n| Vector::new(0.0, 0.0, 1e-5 * f64::from(n))).collect();
        let layers = Layers { reference: LayerReference::Floor(0.0), thickness: 5e-3, range: [-1.0, 1.0] };
        let layer = layers.sort(&places);
        let values: Vec<Vector> = (0..1000).map(|n| Vector::new(f64::from(n * n % 97), 0.0, 0.0)).collect();
        let volume = vec![1e-9; 1000];
        let grains = LayerGrains { layer: &layer, velocity: &values, drag: &values, pressure_force: &values };
        let water = LayerWater { layer: &layer, bulk_volume: &volume, velocity: &values };
        let total = |layers: &[Layer]| -> Real {
            let means = layers.iter().map(|&layer| layer_means(layer, &grains, &water));
            means.map(|m| m.drag.expect("grains") * m.grain_count as Real).sum()
        };
        let whole: Real = values.iter().map(|v| v.x).sum();
        assert!((total(&[Layer::Lower, Layer::Upper]) - whole).abs() < 1e-9 * whole);
        assert!((total(&[Layer::Upper]) - whole).abs() > 0.1 * whole, "one layer alone is not the whole");
    }

    #[test]
    fn grains_weigh_less_under_water() {
        let weight = submerged_weight(1e-3, 2650.0, 1000.0, 9.81);
        assert!((weight - 8.475e-6).abs() < 1e-9, "{weight}");
    }
}
