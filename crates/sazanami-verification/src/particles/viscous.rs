//! Viscous flow along walls: a channel, and the layer at a wall under water that swings.

use sazanami_numerics::{Real, Vector};

use super::vessel::{ExperimentError, PERIODIC, SLAB, Vessel, WALLS, advance, fluid};
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{Forcing, Solver};

/// Kinematic viscosity [m^2/s].
const VISCOSITY: Real = 1e-4;

/// A channel of `layers` particles of `spacing` \[m] between walls at the ends of z, without gravity.
fn channel(layers: usize, spacing: Real, friction: WallFriction) -> Vessel {
    let size = [SLAB, SLAB, layers];
    let mut vessel = Vessel::new(size, spacing, [PERIODIC, PERIODIC, WALLS]).filled(size);
    (vessel.scheme, vessel.friction, vessel.viscosity) = (Scheme::published(), friction, VISCOSITY);
    vessel
}

/// A body force along x [m/s^2].
fn along(force: Real) -> Forcing {
    Forcing { body_force: force * Vector::X, ..Forcing::default() }
}

/// Means of the velocity along x in as many layers as there are between the walls [m/s].
fn layer_means(solver: &Solver, layers: usize) -> Vec<Real> {
    let spacing = solver.settings().fluid.spacing;
    let mut sums = vec![[0.0; 2]; layers];
    for a in fluid(solver) {
        let particles = solver.particles();
        let layer = ((particles.position[a].z / spacing).max(0.0) as usize).min(layers - 1);
        sums[layer][0] += particles.velocity[a].x;
        sums[layer][1] += 1.0;
    }
    sums.into_iter().map(|[sum, count]| if count > 0.0 { sum / count } else { 0.0 }).collect()
}

/// Differences of a steady channel flow from a parabola.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// Speed in the middle over `b h^2/(8 nu)`.
    pub centre: Real,
    /// Root mean square error of the particles' velocities over the root mean square of the parabola.
    pub profile: Real,
}

/// Plane Poiseuille flow in a channel of `layers` particles, from rest until it is steady.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn poiseuille(layers: usize, friction: WallFriction) -> Result<Channel, ExperimentError> {
    let height = 0.02;
    let vessel = channel(layers, height / layers as Real, friction);
    let mut solver = vessel.solver()?;
    let force = 0.1;
    // Six times the time in which the slowest mode decays.
    let end = 6.0 * (height / std::f64::consts::PI).powi(2) / VISCOSITY;
    advance(&mut solver, [0.0, end], |_, _| along(force), |_, _, _| ())?;
    let exact = |z: Real| force / (2.0 * VISCOSITY) * z * (height - z);
    let [error, scale] = solver.sum_over_fluid(|p, a| {
        let exact = exact(p.position[a].z);
        [(p.velocity[a] - exact * Vector::X).length_squared(), exact * exact]
    });
    let means = layer_means(&solver, layers);
    let middle = 0.5 * (means[(layers - 1) / 2] + means[layers / 2]);
    Ok(Channel { centre: middle / exact(0.5 * height), profile: (error / scale).sqrt() })
}

/// Complex number as `[real, imaginary]`.
type Complex = [Real; 2];

fn times(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn over(a: Complex, b: Complex) -> Complex {
    let square = b[0] * b[0] + b[1] * b[1];
    times(a, [b[0] / square, -b[1] / square])
}

/// `cosh((1 + i) s)`.
fn cosh(s: Real) -> Complex {
    [s.cosh() * s.cos(), s.sinh() * s.sin()]
}

/// Root mean square error of the layers' velocities, over that of the exact ones, of water that swings along walls at
/// rest with Stokes layers of `resolution` spacings (Stokes's second problem in the frame of the wall, between two
/// walls), in the second period.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn stokes_layer(resolution: usize, friction: WallFriction) -> Result<Real, ExperimentError> {
    let (rate, speed) = (12.57, 0.05);
    let thickness = (2.0 * VISCOSITY / rate as Real).sqrt();
    let layers = 8 * resolution;
    let half = 4.0 * thickness;
    let mut vessel = channel(layers, 2.0 * half / layers as Real, friction);
    let exact = |z: Real, t: Real| {
        let ratio = over(cosh((z - half) / thickness), cosh(half / thickness));
        speed * times([1.0 - ratio[0], -ratio[1]], [(rate * t).cos(), (rate * t).sin()])[0]
    };
    vessel.set_velocity(|x| exact(x.z, 0.0) * Vector::X);
    let mut solver = vessel.solver()?;
    let period = 2.0 * std::f64::consts::PI / rate;
    // Mean of `-U w sin(w t)` over the step.
    let force = |from: Real, to: Real| along(speed * ((rate * to).cos() - (rate * from).cos()) / (to - from));
    let mut sums = [0.0; 2];
    advance(&mut solver, [0.0, 2.0 * period], force, |time, solver, _| {
        if time > period {
            for (n, mean) in layer_means(solver, layers).into_iter().enumerate() {
                let exact = exact((n as Real + 0.5) * vessel.spacing, time);
                sums[0] += (mean - exact).powi(2);
                sums[1] += exact * exact;
            }
        }
    })?;
    Ok((sums[0] / sums[1]).sqrt())
}
