//! A drop that stretches: the exact flow of an ellipse of water in the air.

use sazanami_numerics::{Real, Vector};

use super::vessel::{DENSITY, ExperimentError, OPEN, PERIODIC, SLAB, Vessel, fluid, kinetic_energy, under};
use sazanami_mps::Role;
use sazanami_mps::scheme::Scheme;

/// Speed over the first one from which on a drop has burst.
const BURST: Real = 5.0;

/// An ellipse in the flow `(A x, -A z)`: `A' = A^2 (b^2 - a^2)/(a^2 + b^2)`, `a' = A a`, `b' = -A b` without gravity and
/// viscosity (Monaghan 1994; Colagrossi 2005). It keeps its kinetic energy.
#[derive(Clone, Copy, Debug)]
pub struct Ellipse {
    /// Half axis in x over the first radius.
    pub wide: Real,
    /// Half axis in z.
    pub high: Real,
    /// Rate of strain A over the first one.
    pub rate: Real,
}

impl Ellipse {
    /// The circle at the start.
    pub const CIRCLE: Self = Self { wide: 1.0, high: 1.0, rate: 1.0 };

    /// Rates of its three values.
    fn slope(self) -> [Real; 3] {
        let Self { wide: a, high: b, rate } = self;
        [rate * a, -rate * b, rate * rate * (b * b - a * a) / (a * a + b * b)]
    }

    fn moved(self, [a, b, rate]: [Real; 3], dt: Real) -> Self {
        Self { wide: self.wide + dt * a, high: self.high + dt * b, rate: self.rate + dt * rate }
    }

    /// The ellipse `dt` later, by Runge and Kutta's classical method.
    #[must_use]
    pub fn later(self, dt: Real) -> Self {
        let first = self.slope();
        let second = self.moved(first, 0.5 * dt).slope();
        let third = self.moved(second, 0.5 * dt).slope();
        let fourth = self.moved(third, dt).slope();
        let mean = |d: usize| (first[d] + 2.0 * (second[d] + third[d]) + fourth[d]) / 6.0;
        self.moved([mean(0), mean(1), mean(2)], dt)
    }

    /// Pressure in the middle over `rho A0^2 R^2`.
    #[must_use]
    pub fn pressure(&self) -> Real {
        let [a, b] = [self.wide, self.high].map(|axis| axis * axis);
        self.rate * self.rate * a * b / (a + b)
    }

    /// Kinetic energy over that of the circle.
    #[must_use]
    pub fn energy(&self) -> Real {
        0.5 * self.rate * self.rate * (self.wide * self.wide + self.high * self.high)
    }

    fn velocity(&self, from_centre: Vector) -> Vector {
        self.rate * Vector::new(from_centre.x, 0.0, -from_centre.z)
    }
}

/// Differences of a drop of particles from the exact one.
#[derive(Clone, Copy, Debug)]
pub struct StretchedDrop {
    /// When it was looked at, t A0: the end, or when it burst.
    pub time: Real,
    /// Kinetic energy over that at the start.
    pub energy: Real,
    /// Largest kinetic energy over that at the start, at any time.
    pub largest_energy: Real,
    /// Root mean square error of the velocity over the root mean square of the exact one.
    pub velocity: Real,
    /// The same beside a flow whose rate of strain stays what it was.
    pub velocity_of_constant_rate: Real,
    /// Pressure in the middle over the exact one, mean over the last tenth of the time.
    pub pressure: Real,
    /// Work of the stabilisation over the kinetic energy at the start.
    pub stabilisation: Real,
    /// Part of the particles inside, nearer to the centre than 0.6 of the axes, that were taken for surface or spray,
    /// mean over the time.
    pub false_surface: Real,
    /// Pairs of particles nearer than half a spacing, over all steps.
    pub collisions: usize,
}

/// A round drop of `across` particles to the radius, 7 thick and periodic in y, until `t A0 = end` or it bursts.
///
/// # Errors
/// [`ExperimentError`] if the vessel makes no sense.
pub fn stretching_drop(across: usize, end: Real, scheme: Scheme) -> Result<StretchedDrop, ExperimentError> {
    let spacing = 1.0 / across as Real;
    let count = 2 * across;
    // The drop grows to less than three times its radius.
    let room = 4 * across;
    let mut vessel =
        Vessel::new([room + count, SLAB, room + count], spacing, [OPEN, PERIODIC, OPEN]).filled([count, SLAB, count]);
    let shift = 0.5 * room as Real * spacing * Vector::new(1.0, 0.0, 1.0);
    let centre = shift + Vector::new(1.0, 0.0, 1.0);
    vessel.fluid.iter_mut().for_each(|particle| particle.position += shift);
    let flat = |x: Vector| (x - centre) * Vector::new(1.0, 0.0, 1.0);
    vessel.fluid.retain(|particle| flat(particle.position).length() < 1.0);
    vessel.scheme = scheme;
    vessel.viscosity = 0.0;
    vessel.longest = 0.15 * spacing;
    vessel.set_velocity(|x| Ellipse::CIRCLE.velocity(flat(x)));
    let mut solver = vessel.solver()?;
    let (first, fastest) = (kinetic_energy(&solver), solver.largest_speed());
    let (mut time, mut exact, mut collisions, mut work) = (0.0, Ellipse::CIRCLE, 0, 0.0);
    let (mut largest_energy, mut pressures, mut outside) = (1.0, [0.0; 2], [0.0; 2]);
    while time < end {
        let dt = solver.stable_step(Vector::ZERO).dt.min(end - time);
        // A step that fails is a drop that burst.
        let Ok(report) = solver.step(dt, &under(Vector::ZERO)(time, time + dt), |_| ()) else { break };
        if solver.largest_speed() > BURST * fastest {
            break;
        }
        time += dt;
        exact = exact.later(dt);
        collisions += report.collisions;
        work += report.stabilisation_work / first;
        largest_energy = Real::max(largest_energy, kinetic_energy(&solver) / first);
        let particles = solver.particles();
        let mut middle = [0.0; 2];
        for a in fluid(&solver) {
            let x = flat(particles.position[a]);
            let place = Vector::new(x.x / exact.wide, 0.0, x.z / exact.high).length();
            if place < 0.6 {
                outside[0] += if particles.role[a] == Role::Unknown { 0.0 } else { 1.0 };
                outside[1] += 1.0;
            }
            if place < 0.2 {
                // The parabola of pressures over the ellipse.
                middle[0] += particles.pressure[a] / (1.0 - place * place);
                middle[1] += 1.0;
            }
        }
        if time > 0.9 * end {
            pressures[0] += dt * middle[0] / Real::max(middle[1], 1.0) / (DENSITY * exact.pressure());
            pressures[1] += dt;
        }
    }
    let error = |exact: &Ellipse| {
        let [error, scale] = solver.sum_over_fluid(|p, a| {
            let exact = exact.velocity(flat(p.position[a]));
            [(p.velocity[a] - exact).length_squared(), exact.length_squared()]
        });
        (error / scale).sqrt()
    };
    Ok(StretchedDrop {
        time,
        energy: kinetic_energy(&solver) / first,
        largest_energy,
        velocity: error(&exact),
        velocity_of_constant_rate: error(&Ellipse { rate: 1.0, ..exact }),
        pressure: pressures[0] / pressures[1],
        stabilisation: work,
        false_surface: outside[0] / Real::max(outside[1], 1.0),
        collisions,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exact_drop_keeps_energy_and_area() {
        let mut drop = Ellipse::CIRCLE;
        for _ in 0..1000 {
            drop = drop.later(1e-3);
        }
        assert!((drop.energy() - 1.0).abs() < 1e-9 && (drop.wide * drop.high - 1.0).abs() < 1e-9, "{drop:?}");
        assert!(drop.wide > 1.9 && (Ellipse::CIRCLE.pressure() - 0.5).abs() < 1e-12);
        // Negative control: a constant rate of strain gains energy.
        assert!(Ellipse { rate: 1.0, ..drop }.energy() > 2.0);
    }
}
