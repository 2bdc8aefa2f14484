//! Water alone.

use crate::measured::Measured;
use crate::particles as experiments;
use sazanami_mps::scheme::{CONJUGATE_RADIUS, Scheme};
use sazanami_mps::stability::COURANT;
use sazanami_numerics::Real;

use super::said;
use super::waves::{Wave, called, drops, over_theory};

/// The scheme with its radii.
fn schemes() -> [Scheme; 2] {
    [2.6, 3.1].map(Scheme::conjugate)
}

/// A drop that stretches.
pub fn stretching_drop() -> Result<Vec<Measured>, String> {
    drops(&schemes())
}

/// Waves in ten and in five layers of deep water, with both radii.
const DEEP_WAVES: [Wave; 2] = [(0.1, 0.05, 10, 1), (0.1, 0.05, 5, 1)];
/// A longer wave and the second mode of shallow water, with the smaller one.
const LONG_WAVES: [Wave; 2] = [(0.3, 0.05, 10, 1), (0.15, 0.01, 10, 2)];

/// Standing waves, and a block in free fall.
pub fn standing_wave() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let one =
        |wave: Wave, scheme: Scheme| over_theory(&format!("{}, radius {}", called(wave), scheme.radius), wave, scheme);
    for wave in DEEP_WAVES {
        let [near, far] = schemes().map(|scheme| one(wave, scheme));
        let ((near, period), (far, other)) = (near?, far?);
        rows.extend(near.into_iter().chain(far));
        let apart = (period - other).abs();
        rows.push(Measured::new(format!("{}: periods of the two radii over theory, apart", called(wave)), apart));
    }
    let [scheme, _] = schemes();
    for wave in LONG_WAVES {
        rows.extend(one(wave, scheme)?.0);
    }
    for scheme in schemes() {
        let name = format!("radius {}", scheme.radius);
        let times = [1e-4, 0.02];
        let lattice = experiments::falling_block(scheme, 0.0, &times).map_err(said)?;
        let disordered = experiments::falling_block(scheme, 0.1, &times).map_err(said)?;
        rows.push(Measured::new(format!("{name}, falling lattice: rms error of the acceleration"), lattice[1]));
        for (time, error) in times.iter().zip(disordered) {
            let of = format!("{name}, falling block, disordered: rms error of the acceleration after {time} s");
            rows.push(Measured::new(of, error));
        }
    }
    Ok(rows)
}

/// Water at rest off the lattice, and under a tilted surface.
pub fn hydrostatics() -> Result<Vec<Measured>, String> {
    let [scheme, _] = schemes();
    let mut rows = Vec::new();
    for (name, tilt, jitter) in [("disordered", 0.0, 0.1), ("tilted", 0.16, 0.0)] {
        let setup = experiments::RestSetup { spacing: 1e-3, tilt, jitter, seconds: 1.0, scheme };
        let found = experiments::rest(&setup).map_err(said)?;
        rows.extend([
            Measured::new(format!("{name}: largest speed, last third of 1 s, of sqrt(g H)"), found.speed),
            Measured::new(format!("{name}: rms of the speed, last third of 1 s, of sqrt(g H)"), found.mean_speed),
            Measured::new(format!("{name}: mean kinetic energy, last over first third"), found.energy),
            Measured::new(format!("{name}: largest error of p at the end, of rho g H"), found.pressure_at_end),
            Measured::new(format!("{name}: drift of the surface, in spacings"), found.level.abs()),
            Measured::new(
                format!("control: {name}: largest speed before the damping, of sqrt(g H)"),
                found.first_speed,
            ),
        ]);
    }
    Ok(rows)
}

/// Vortices, a turning square and drops that collide.
pub fn conservation() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let mut row = |name: &str, value: Real| rows.push(Measured::new(name, value));
    let [scheme, wider] = schemes();
    for (name, scheme) in [("2.6", scheme), ("3.1", wider)] {
        let vortices = experiments::taylor_green(50, COURANT, scheme).map_err(said)?;
        row(&format!("vortices, radius {name}: rate of decay of the largest speed over exact"), vortices.decay);
        row(&format!("vortices, radius {name}: rms error of the velocity"), vortices.velocity);
    }
    let square = experiments::turning_patch(50, 2.0, scheme).map_err(said)?;
    row("square: kinetic energy at t w = 2 over that at the start", square.energy.last);
    row("square: largest kinetic energy over that at the start", square.energy.largest);
    row("square: angular momentum at t w = 2 over that at the start", square.angular_momentum);
    row("square: part of the particles that are isolated", square.splashes);
    let without = (square.angular_momentum_of_fewer - 1.0).abs();
    row("control, square: angular momentum without every tenth particle, off by", without);
    let jet = experiments::sheared_jet(12, 2.0, scheme).map_err(said)?;
    row("jet: kinetic energy at t U/h = 2 over that at the start", jet.energy.last);
    row("jet: largest rise of the kinetic energy", jet.energy.rise);
    row("jet: largest change of the momentum over the momentum", jet.momentum);
    row("jet: rms error of the velocity", jet.velocity);
    let drops = experiments::colliding_drops(12, 2.0, scheme).map_err(said)?;
    row("drops: kinetic energy at t U/R = 2 over that at the start", drops.energy.last);
    row("drops: largest kinetic energy over that at the start", drops.energy.largest);
    row("drops: largest rise of the kinetic energy", drops.energy.rise);
    row("drops: largest momentum over that of both", drops.momentum);
    row("drops: angular momentum at t U/R = 2 over that at the start", drops.angular_momentum);
    row(
        "control, drops: angular momentum without every tenth particle, off by",
        (drops.angular_momentum_of_fewer - 1.0).abs(),
    );
    let published = Scheme::published();
    let jet = experiments::sheared_jet(12, 2.0, published).map_err(said)?;
    row("control, jet: largest rise of the kinetic energy with the published scheme", jet.energy.rise);
    let drops = experiments::colliding_drops(12, 2.0, published).map_err(said)?;
    row("control, drops: largest rise of the kinetic energy with the published scheme", drops.energy.rise);
    row("control, drops: largest momentum with the published scheme", drops.momentum);
    Ok(rows)
}

/// Radii with the steps of water that falls to and fro; those of the published scheme.
const FALLS: [(Real, usize); 3] = [(CONJUGATE_RADIUS, 100_000), (3.1, 10_000), (3.6, 10_000)];
const PUBLISHED_FALLS: usize = 3000;

/// Jets that strike walls again and again, at three of the radii that are offered.
pub fn jets() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for (radius, steps) in FALLS {
        let found = experiments::reversed_fall(steps, Scheme::conjugate(radius)).map_err(said)?;
        rows.extend([
            Measured::new(format!("radius {radius}: steps done"), found.steps as Real),
            Measured::new(format!("radius {radius}: reversals of gravity"), found.reversals as Real),
            Measured::new(format!("radius {radius}: largest energy over that at the last reversal"), found.energy),
            Measured::new(format!("radius {radius}: largest rise of the energy between reversals"), found.rise),
            Measured::new(format!("radius {radius}: largest speed over that of a fall through the box"), found.speed),
        ]);
    }
    let published = experiments::reversed_fall(PUBLISHED_FALLS, Scheme::published()).map_err(said)?;
    rows.push(Measured::new("control: largest rise of the energy with the published scheme", published.rise));
    Ok(rows)
}
