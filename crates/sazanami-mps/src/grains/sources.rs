//! Grains as sources of solid volume: real ones, periodic images, and images in walls.

use std::f64::consts::PI;

use sazanami_dem::{Engine, Motion};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};

use super::closure::volume;
use crate::boundary::{Side, Tank};
use crate::neighbours::Bins;
use crate::weight::{Weight, Wendland};

/// A grain or an image of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Source {
    pub position: Vector,
    pub velocity: Vector,
    pub volume: Real,
    /// Density of the fluid over that of the grain; 0 for one that pressure does not move.
    pub mobility: Real,
}

/// Solid volume around places, smoothed with a Wendland function of unit integral (spec: W_eps).
#[derive(Debug)]
pub(crate) struct Sources {
    /// Smoothing function; its radius is R_eps.
    weight: Weight,
    /// `21/(2 pi R_eps^3)`.
    scale: Real,
    bins: Bins,
    sources: Vec<Source>,
    positions: Vec<Vector>,
    keys: Vec<(u32, u64, Source)>,
}

/// Solid fraction at a place and its rate.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Solid {
    pub fraction: Real,
    pub rate: Real,
    /// Solid fraction times density of the fluid over that of the grains.
    pub mobile: Real,
}

impl Sources {
    pub fn new(radius: Real) -> Self {
        Self {
            weight: Weight { family: Wendland::C2, radius },
            scale: 21.0 / (2.0 * PI * radius.powi(3)),
            bins: Bins::default(),
            sources: Vec::new(),
            positions: Vec::new(),
            keys: Vec::new(),
        }
    }

    /// Part of space that a grain of volume `volume` [m^3] fills at its own centre.
    pub fn own(&self, volume: Real) -> Real {
        self.scale * volume
    }

    /// Takes note of all grains near this rank's part and of their images in walls; `density` is that of the fluid
    /// [kg/m^3].
    pub fn fill(&mut self, domain: &Domain, tank: &Tank, engine: &Engine, density: Real) {
        let radius = self.weight.radius;
        let mut bins = std::mem::take(&mut self.bins);
        bins.renew(domain, radius);
        let grains = engine.grains();
        let keys = &mut self.keys;
        keys.clear();
        for g in 0..grains.len() {
            let d = engine.bodies()[grains.shape[g] as usize].bounding_radius * 2.0 * grains.scale[g];
            let volume = volume(d);
            let mobility = if grains.motion[g] == Motion::Free { density * volume / grains.mass[g] } else { 0.0 };
            let real = Source { position: grains.position[g], velocity: grains.velocity[g], volume, mobility };
            keys.push((0, grains.id[g], real));
            let first = keys.len() - 1;
            for direction in 0..3 {
                for side in 0..2 {
                    if tank.sides[direction][side] != Side::Wall {
                        continue;
                    }
                    let corner = if side == 0 { tank.lower } else { tank.upper };
                    let wall = corner[direction] + tank.displacement[direction];
                    // Images of images stand for edges and corners.
                    for n in first..keys.len() {
                        let mut image = keys[n].2;
                        if (image.position[direction] - wall).abs() < radius {
                            image.position[direction] = 2.0 * wall - image.position[direction];
                            image.velocity[direction] = 2.0 * tank.velocity[direction] - image.velocity[direction];
                            keys.push((0, grains.id[g], image));
                        }
                    }
                }
            }
        }
        keys.iter_mut().for_each(|key| key.0 = bins.number(key.2.position));
        keys.sort_unstable_by(|a, b| {
            let place = |s: &Source| s.position;
            let (p, q) = (place(&a.2), place(&b.2));
            (a.0, a.1)
                .cmp(&(b.0, b.1))
                .then_with(|| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z)))
        });
        self.sources.clear();
        self.sources.extend(keys.iter().map(|key| key.2));
        self.positions.clear();
        self.positions.extend(keys.iter().map(|key| key.2.position));
        bins.fill(&self.positions, &[]);
        self.bins = bins;
    }

    /// Solid fraction at `position` [m] and its rate along `velocity` [m/s].
    pub fn solid(&self, position: Vector, velocity: Vector) -> Solid {
        let mut solid = Solid::default();
        let weight = self.weight;
        let square = weight.radius * weight.radius;
        self.bins.for_each_range(position, self.weight.radius, |range| {
            for source in &self.sources[range] {
                let apart = position - source.position;
                let r2 = apart.length_squared();
                if r2 < square {
                    let r = r2.sqrt();
                    let share = source.volume * weight.value(r);
                    solid.fraction += share;
                    solid.mobile += source.mobility * share;
                    let stretch = (velocity - source.velocity).dot(apart);
                    solid.rate += source.volume * weight.slope_over_distance(r) * stretch;
                }
            }
        });
        let Solid { fraction, rate, mobile } = solid;
        Solid { fraction: self.scale * fraction, rate: self.scale * rate, mobile: self.scale * mobile }
    }
}
