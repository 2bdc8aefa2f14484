//! Waves in a closed tank: standing, and driven by its motion.

use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use super::vessel::{DOWN, ExperimentError, GRAVITY, OPEN_TOP, PERIODIC, SLAB, Vessel, WALLS, advance, under};
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::Solver;

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
