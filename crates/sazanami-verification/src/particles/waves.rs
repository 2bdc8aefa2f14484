//! Waves in a closed tank: standing, and driven by its motion.

use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use super::vessel::{DOWN, ExperimentError, GRAVITY, OPEN_TOP, PERIODIC, SLAB, Vessel, WALLS, advance, fluid, under};
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{Forcing, Solver};

/// A tank of water with walls that slip.
#[derive(Clone, Copy, Debug)]
pub struct WaveTank {
    /// Length \[m].
    pub length: Real,
    /// Depth \[m].
    pub depth: Real,
    /// Particle layers in the depth.
    pub layers: usize,
    /// Enhancements.
    pub scheme: Scheme,
}

impl WaveTank {
    fn spacing(&self) -> Real {
        self.depth / self.layers as Real
    }

    fn vessel(&self) -> Vessel {
        let spacing = self.spacing();
        let along = (self.length / spacing).round() as usize;
        let room = 5 + self.layers / 2;
        let mut vessel = Vessel::new([along, SLAB, self.layers + room], spacing, [WALLS, PERIODIC, OPEN_TOP]).filled([
            along,
            SLAB,
            self.layers,
        ]);
        vessel.friction = WallFriction::Slip;
        vessel.scheme = self.scheme;
        vessel
    }

    /// Wave number of mode `n` [1/m].
    fn number(&self, n: usize) -> Real {
        n as Real * PI / self.length
    }

    /// Circular frequency of mode `n` by linear theory [rad/s].
    #[must_use]
    pub fn frequency(&self, n: usize) -> Real {
        let k = self.number(n);
        (GRAVITY * k * (k * self.depth).tanh()).sqrt()
    }

    /// Velocity of mode `n` for a unit rate of its elevation `cos(k x)`.
    fn mode(&self, n: usize, x: Vector) -> Vector {
        let k = self.number(n);
        let scale = (k * self.depth).sinh().recip();
        let z = k * x.z;
        scale * Vector::new(-(k * x.x).sin() * z.cosh(), 0.0, (k * x.x).cos() * z.sinh())
    }
}

/// Period, decay and energy of a free wave in a tank.
#[derive(Clone, Copy, Debug)]
pub struct StandingWave {
    /// Period over that of linear theory.
    pub period: Real,
    /// Viscosity that explains the decay of its energy [m^2/s].
    pub viscosity: Real,
    /// Energy at the last extreme over that at the start.
    pub energy: Real,
}

/// Mode `n` with an amplitude of `amplitude` depths, from a flat surface, for 2.5 periods.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn standing_wave(tank: WaveTank, n: usize, amplitude: Real) -> Result<StandingWave, ExperimentError> {
    let rate = tank.frequency(n);
    let period = 2.0 * PI / rate;
    let mut vessel = tank.vessel();
    vessel.set_velocity(|x| amplitude * tank.depth * rate * tank.mode(n, x));
    let mut solver = vessel.solver()?;
    // Part of the mode in the velocity; it swings as the cosine.
    let share = |solver: &Solver| {
        let [product, square] = solver.sum_over_fluid(|p, a| {
            let mode = tank.mode(n, p.position[a]);
            [p.velocity[a].dot(mode), mode.length_squared()]
        });
        product / square
    };
    let mut last = [0.0, share(&solver)];
    let first = last[1];
    let (mut zeros, mut extremes) = (Vec::new(), vec![[0.0, first]]);
    let mut extreme = [0.0, 0.0];
    advance(&mut solver, [0.0, 2.55 * period], under(DOWN), |time, solver, _| {
        let now = share(solver);
        if now * last[1] < 0.0 {
            zeros.push(last[0] + (time - last[0]) * last[1] / (last[1] - now));
            if zeros.len() > 1 {
                extremes.push(extreme);
            }
            extreme = [0.0, 0.0];
        }
        if now.abs() > Real::abs(extreme[1]) {
            extreme = [time, now];
        }
        last = [time, now];
    })?;
    let count = zeros.len();
    let half = if count > 1 { (zeros[count - 1] - zeros[0]) / (count - 1) as Real } else { Real::NAN };
    let [time, value] = extremes[extremes.len() - 1];
    let energy = (value / first).powi(2);
    Ok(StandingWave {
        period: 2.0 * half / period,
        viscosity: -energy.ln() / (4.0 * tank.number(n).powi(2) * time),
        energy,
    })
}

/// A tank that is moved as `X = A r(t) sin(w t)`, where `r` rises from 0 to 1 in `ramp`.
#[derive(Clone, Copy, Debug)]
pub struct Shaking {
    /// Amplitude A \[m].
    pub amplitude: Real,
    /// Circular frequency w [rad/s].
    pub rate: Real,
    /// Time in which the motion grows \[s].
    pub ramp: Real,
}

impl Shaking {
    /// Displacement and its rate at a time [m, m/s].
    #[must_use]
    pub fn motion(&self, time: Real) -> [Real; 2] {
        let Self { amplitude, rate, ramp } = *self;
        let s = (time / ramp).min(1.0);
        let (r, slope) = (s * s * (3.0 - 2.0 * s), if s < 1.0 { 6.0 * s * (1.0 - s) / ramp } else { 0.0 });
        let (sin, cos) = (rate * time).sin_cos();
        [amplitude * r * sin, amplitude * (slope * sin + rate * r * cos)]
    }

    /// Mean acceleration between two times [m/s^2].
    #[must_use]
    pub fn acceleration(&self, from: Real, to: Real) -> Real {
        (self.motion(to)[1] - self.motion(from)[1]) / (to - from)
    }

    /// The body force in the frame of the tank.
    pub(super) fn force(&self, from: Real, to: Real) -> Forcing {
        Forcing { body_force: DOWN - self.acceleration(from, to) * Vector::X, ..Forcing::default() }
    }
}

/// Odd modes that linear theory sums up.
const MODES: usize = 8;

/// Elevations of the odd modes and their rates by linear theory, integrated in steps of `dt`.
struct Linear {
    tank: WaveTank,
    state: [[Real; 2]; MODES],
    time: Real,
}

impl Linear {
    fn advance(&mut self, shaking: &Shaking, end: Real) {
        let steps = ((end - self.time) * 1e5).ceil().max(1.0);
        let dt = (end - self.time) / steps;
        for _ in 0..steps as usize {
            let force = shaking.acceleration(self.time, self.time + dt);
            for (m, [zeta, rate]) in self.state.iter_mut().enumerate() {
                let n = 2 * m + 1;
                let k = self.tank.number(n);
                let drive = 4.0 * (k * self.tank.depth).tanh() / (self.tank.length * k) * force;
                // Leapfrog.
                *zeta += 0.5 * dt * *rate;
                *rate += dt * (drive - self.tank.frequency(n).powi(2) * *zeta);
                *zeta += 0.5 * dt * *rate;
            }
            self.time += dt;
        }
    }

    fn wave_numbers(&self) -> impl Iterator<Item = (Real, [Real; 2])> {
        self.state.iter().enumerate().map(|(m, state)| (self.tank.number(2 * m + 1), *state))
    }

    /// Centre of mass in x from the middle \[m].
    fn centre(&self) -> Real {
        let sum: Real = self.wave_numbers().map(|(k, [zeta, _])| -2.0 * zeta / (k * k)).sum();
        sum / (self.tank.depth * self.tank.length)
    }

    /// Velocity along x, mean over the depth, at `x` from the left wall [m/s].
    fn velocity(&self, x: Real) -> Real {
        self.wave_numbers().map(|(k, [_, rate])| -rate * (k * x).sin() / (k * self.tank.depth)).sum()
    }

    /// Elevation at the left wall \[m].
    fn at_wall(&self) -> Real {
        self.state.iter().map(|[zeta, _]| zeta).sum()
    }
}

/// Differences of water in a shaken tank from linear theory.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sloshing {
    /// Root mean square of the centre of mass over that of linear theory.
    pub amplitude: Real,
    /// Root mean square difference of the centre of mass over the root mean square by linear theory.
    pub history: Real,
    /// The same of the velocities, means over the depth in ten columns.
    pub velocity: Real,
    /// The same as [`Self::history`] beside the theory for 0.8 of the depth.
    pub shallower: Real,
    /// Largest elevation at a wall by linear theory, in spacings.
    pub height: Real,
    /// Root mean square of the centre of mass \[m].
    pub centre: Real,
}

/// Columns in which velocities are compared.
const COLUMNS: usize = 10;

/// Water in a tank that is shaken for `periods` periods; velocities of the last two are compared.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn sloshing(tank: WaveTank, shaking: Shaking, periods: Real) -> Result<Sloshing, ExperimentError> {
    let period = 2.0 * PI / shaking.rate;
    let mut solver = tank.vessel().solver()?;
    let theory = |depth: Real| Linear { tank: WaveTank { depth, ..tank }, state: [[0.0; 2]; MODES], time: 0.0 };
    let (mut linear, mut other) = (theory(tank.depth), theory(0.8 * tank.depth));
    let mut sums = [0.0; 6];
    let mut found = Sloshing::default();
    let mut columns = [[0.0; 2]; COLUMNS];
    advance(
        &mut solver,
        [0.0, periods * period],
        |from, to| shaking.force(from, to),
        |time, solver, _| {
            linear.advance(&shaking, time);
            other.advance(&shaking, time);
            let [sum, count] = solver.sum_over_fluid(|p, a| [p.position[a].x, 1.0]);
            let (centre, expected) = (sum / count - 0.5 * tank.length, linear.centre());
            sums[0] += (centre - expected).powi(2);
            sums[1] += expected * expected;
            sums[2] += centre * centre;
            sums[3] += 1.0;
            sums[4] += (centre - other.centre()).powi(2);
            sums[5] += other.centre().powi(2);
            found.height = found.height.max(linear.at_wall().abs() / tank.spacing());
            if time > (periods - 2.0) * period {
                // The part in phase with the velocity in the middle.
                let phase = linear.velocity(0.5 * tank.length);
                let mut means = [[0.0; 2]; COLUMNS];
                for a in fluid(solver) {
                    let particles = solver.particles();
                    let column = (particles.position[a].x / tank.length * COLUMNS as Real).max(0.0) as usize;
                    let mean = &mut means[column.min(COLUMNS - 1)];
                    mean[0] += particles.velocity[a].x;
                    mean[1] += 1.0;
                }
                for (n, (column, [sum, count])) in columns.iter_mut().zip(means).enumerate() {
                    let place = (n as Real + 0.5) / COLUMNS as Real * tank.length;
                    column[0] += phase * sum / Real::max(count, 1.0);
                    column[1] += phase * linear.velocity(place);
                }
            }
        },
    )?;
    found.amplitude = (sums[2] / sums[1]).sqrt();
    found.history = (sums[0] / sums[1]).sqrt();
    found.shallower = (sums[4] / sums[5]).sqrt();
    let square = |value: fn(&[Real; 2]) -> Real| columns.iter().map(|c| value(c).powi(2)).sum::<Real>();
    found.velocity = (square(|c| c[0] - c[1]) / square(|c| c[1])).sqrt();
    found.centre = (sums[2] / sums[3]).sqrt();
    Ok(found)
}
