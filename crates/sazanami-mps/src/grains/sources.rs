//! Solid fraction as a smooth sum over the grains, their periodic images and their mirror images in walls.

use std::cmp::Ordering;
use std::f64::consts::PI;

use sazanami_dem::{Engine, Motion};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};

use super::binned::{Binned, Lanes, Pair, lanes};
use super::diameter_of;
use super::drag::volume;
use crate::boundary::{Image, Tank};
use crate::gates::{Gate, near};
use crate::reductions::set_column;
use crate::weight::Weight;

/// A grain or one of its images.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Source {
    /// Identifier of the grain.
    id: u64,
    position: Vector,
    velocity: Vector,
    volume: Real,
    /// Acceleration by a gradient of pressure over that of the fluid; 0 for a grain that does not move freely.
    mobility: Real,
}

impl Source {
    /// Order of sources within a bin.
    fn order(&self, other: &Self) -> Ordering {
        let by = |d: usize| self.position[d].total_cmp(&other.position[d]);
        self.id.cmp(&other.id).then_with(|| by(0).then_with(|| by(1)).then_with(|| by(2)))
    }
}

/// Solid volume per volume, smoothed with a Wendland function of unit integral.
#[derive(Debug)]
pub(crate) struct Sources {
    /// Smoothing function; its radius is R_eps.
    weight: Weight,
    /// `21/(2 pi R_eps^3)`.
    scale: Real,
    sources: Vec<Source>,
    /// Sources in bins: positions, velocities, volumes (negative for an image in a gate), mobilities.
    binned: Binned<8>,
    gates: Vec<Gate>,
    /// Height of a wall below \[m].
    floor: Real,
}

/// Solid fraction at a position and its rate of change.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Solid {
    pub fraction: Real,
    pub rate: Real,
    /// Solid fraction times the acceleration of grains by a gradient of pressure over that of the fluid: without added mass
    /// fluid density over grain density.
    pub grain_mobility: Real,
}

/// Integral of the smoothing function over a ball of `q` times its radius.
fn share_within(q: Real) -> Real {
    let q = q.min(1.0);
    q.powi(3) * (14.0 + q * q * (-84.0 + q * (140.0 + q * (-90.0 + q * 21.0))))
}

/// Height of the floor that mirrors gates \[m].
pub(super) fn floor(tank: &Tank) -> Real {
    tank.lower.z + tank.displacement.z
}

/// Whether a particle at `position` beside the `gate` sees a source, which may be `mirrored` in the gate: grains on its side, and
/// their images beyond it. Without a gate near it sees grains alone.
#[inline(always)]
pub(super) fn is_seen(gate: Option<&Gate>, position: Vector, (source, mirrored): (Vector, bool), floor: Real) -> bool {
    gate.map_or(!mirrored, |gate| gate.parts_over(position, source, floor) == mirrored)
}

impl Sources {
    pub fn new(radius: Real) -> Self {
        Self {
            weight: Weight { radius },
            scale: 21.0 / (2.0 * PI * radius.powi(3)),
            sources: Vec::new(),
            binned: Binned::default(),
            gates: Vec::new(),
            floor: Real::NEG_INFINITY,
        }
    }

    /// Solid fraction around a grain of diameter `d` \[m], where `solid` is the smoothed value `S` at its centre.
    ///
    /// The grain's own contribution `S0` must not count: a single grain is in clear fluid. Other centres keep a diameter
    /// away, so that in a random suspension their contribution misses the part `E` of the smoothing function within a
    /// diameter; in a bed the own contribution fills just that gap. Hence the smaller of `(S - S0)/(1 - E)` and `S`
    /// (`docs/decisions/0006-moving-particles.md`).
    pub fn around(&self, solid: Real, d: Real) -> Real {
        let others = (solid - self.scale * volume(d)).max(0.0);
        (others / (1.0 - share_within(d / self.weight.radius))).min(solid)
    }

    /// Collects all grains near this rank's part and their images in walls; grains that are `frozen` stand still whatever their
    /// velocity. `density` is that of the fluid [kg/m^3], `added` the added mass of each grain and ghost, empty without \[kg].
    pub fn fill(
        &mut self,
        domain: &Domain,
        tank: &Tank,
        (engine, frozen): (&Engine, bool),
        density: Real,
        added: &[Real],
    ) {
        let radius = self.weight.radius;
        let grains = engine.grains();
        let sources = &mut self.sources;
        set_column(sources, grains.len(), |g| {
            let volume = volume(diameter_of(engine, g));
            let added = added.get(g).copied().unwrap_or(0.0);
            let free = grains.motion[g] == Motion::Free;
            let mobility = if free { (density * volume + added) / (grains.mass[g] + added) } else { 0.0 };
            let (position, velocity) = (grains.position[g], if frozen { Vector::ZERO } else { grains.velocity[g] });
            Source { id: grains.id[g], position, velocity, volume, mobility }
        });
        // Which ghosts are known farther away is arbitrary, and would change the order of the sums.
        let known = engine.vicinity(domain, engine.ghost_margin());
        sources.retain(|source| known.contains(source.position));
        self.gates.clear();
        self.gates.extend_from_slice(&tank.gates);
        self.floor = floor(tank);
        for n in 0..sources.len() {
            let source = sources[n];
            tank.for_each_image(source.position, radius, |image| {
                let Image { position, in_wall, in_gate } = *image;
                if !image.is_mirrored() {
                    return;
                }
                let mut image = Source { position, ..source };
                for d in (0..3).filter(|&d| in_wall[d]) {
                    image.velocity[d] = 2.0 * tank.velocity[d] - image.velocity[d];
                }
                if let Some(d) = in_gate {
                    image.velocity[d] = -image.velocity[d];
                    image.volume = -image.volume;
                }
                sources.push(image);
            });
        }
        let sources = &sources[..];
        self.binned.fill(
            domain,
            radius,
            sources.len(),
            |n| Some(sources[n].position),
            |a, b| sources[a].order(&sources[b]),
            |n| {
                let Source { position: x, velocity: u, volume, mobility, .. } = sources[n];
                [x.x, x.y, x.z, u.x, u.y, u.z, volume, mobility]
            },
        );
    }

    /// Solid fraction at `position` \[m].
    pub fn fraction(&self, position: Vector) -> Real {
        let gate = near(&self.gates, position, self.weight.radius);
        let share = |pair: &Pair, source: &[Lanes; 8]| {
            let volume = self.seen(gate, position, source);
            [lanes(|l| volume[l] * pair.weight[l])]
        };
        let [fraction] = self.binned.sum(position, share);
        self.scale * fraction
    }

    /// Volumes of sources that are seen from `position` \[m] beside a gate: grains on its side, and their images beyond it.
    #[inline(always)]
    fn seen(&self, gate: Option<&Gate>, position: Vector, source: &[Lanes; 8]) -> Lanes {
        let [x, y, z, _, _, _, volume, _] = source;
        if self.gates.is_empty() {
            return *volume;
        }
        lanes(|l| {
            let source = (Vector::new(x[l], y[l], z[l]), volume[l] < 0.0);
            if is_seen(gate, position, source, self.floor) { volume[l].abs() } else { 0.0 }
        })
    }

    /// Radius of the smoothing function \[m], and what its weights times to be of unit integral [1/m^3].
    pub fn smoothing(&self) -> (Real, Real) {
        (self.weight.radius, self.scale)
    }

    /// Solid fraction at `position` \[m] and its rate along `velocity` [m/s]; `None` where no grain is near.
    pub fn solid(&self, position: Vector, velocity: Vector) -> Option<Solid> {
        if !self.binned.is_near(position) {
            return None;
        }
        let gate = near(&self.gates, position, self.weight.radius);
        let shares = |pair: &Pair, source: &[Lanes; 8]| {
            let [p, q, r] = &pair.apart;
            let [_, _, _, u, v, w1, _, mobility] = source;
            let volume = self.seen(gate, position, source);
            let share = lanes(|l| volume[l] * pair.weight[l]);
            let stretch =
                lanes(|l| (velocity.x - u[l]) * p[l] + (velocity.y - v[l]) * q[l] + (velocity.z - w1[l]) * r[l]);
            let slope = lanes(|l| volume[l] * pair.slope[l]);
            [share, lanes(|l| slope[l] * stretch[l]), lanes(|l| mobility[l] * share[l])]
        };
        let [fraction, rate, grain_mobility] = self.binned.sum(position, shares).map(|sum| self.scale * sum);
        Some(Solid { fraction, rate, grain_mobility })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solid_fraction_around_a_grain_is_right_in_suspensions_and_beds() {
        let d = 1e-3;
        let sources = Sources::new(3.0 * d);
        let sum = |steps: u32, q: Real| {
            let part = |n: u32| q * (Real::from(n) + 0.5) / Real::from(steps);
            let shell = |x: Real| 4.0 * PI * x * x * (1.0 - x).powi(4) * (1.0 + 4.0 * x) * 21.0 / (2.0 * PI);
            (0..steps).map(|n| shell(part(n)) * q / Real::from(steps)).sum::<Real>()
        };
        assert!(
            (share_within(1.0 / 3.0) - sum(1000, 1.0 / 3.0)).abs() < 1e-6 && (share_within(1.0) - 1.0).abs() < 1e-12
        );
        let own = sources.scale * volume(d);
        assert_eq!(sources.around(own, d), 0.0);
        // Solid fractions at the centres of spheres placed at random one after the other, and on a disturbed body-centred
        // lattice, at those of the whole.
        for (fraction, at_centre) in
            [(0.1, 0.1365), (0.2, 0.2160), (0.3, 0.3043), (0.4, 0.4030), (0.5, 0.5033), (0.6, 0.6031)]
        {
            let found = sources.around(at_centre, d);
            assert!((found - fraction).abs() < 0.02, "{fraction}: {found}");
            // Negative control: without the own share.
            let others = at_centre - own;
            assert!((others - fraction).abs() > 0.02);
        }
    }
}
