//! The worked examples of `cases/examples`, run as a user runs them and read from their tables.

use std::f64::consts::PI;

use sazanami_numerics::Real;

use super::whole_run::WholeRun;
use crate::measured::Measured;

const CHANNEL: &str = include_str!("../../../../cases/examples/channel.toml");
const WAVE: &str = include_str!("../../../../cases/examples/standing-wave.toml");
const RAFT: &str = include_str!("../../../../cases/examples/raft.toml");
const BALL: &str = include_str!("../../../../cases/examples/ball-on-slope.toml");

/// Columns of a probe of an example, run with `overrides`.
fn probe<const N: usize>(text: &str, overrides: &[&str], name: &str, of: [&str; N]) -> Result<[Vec<Real>; N], String> {
    let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
    WholeRun::of_text(&format!("example-{name}"), text, &overrides)?.columns(&format!("probes/{name}.csv"), of)
}

fn last(values: &[Real]) -> Real {
    values[values.len() - 1]
}

/// Exact results of the worked examples, each beside a control that changes what decides it.
pub(crate) fn examples() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for (name, overrides) in [
        ("plates: speed in the middle over the parabola", vec![]),
        ("plates, four times the step: the same", vec!["fluid.dt_max=4 ms"]),
        ("plates, ten times the viscosity: the same times ten", vec!["fluid.liquid.kinematic_viscosity=1e-3 m^2/s"]),
        ("control: plates, half the force: the same", vec!["gravity=[\"0.05 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]"]),
    ] {
        let [speed] = probe(CHANNEL, &overrides, "middle", ["velocity_1"])?;
        let scale = if name.contains("ten times") { 10.0 } else { 1.0 };
        rows.push(Measured::new(name, scale * last(&speed) / 0.0125));
    }
    for (name, overrides) in [
        ("wave on a grid: period over theory", vec!["solver=mics"]),
        ("wave of moving particles: the same", vec!["solver=mps"]),
        (
            "control: wave on a grid of half the depth: the same",
            vec!["solver=mics", "liquid.0.region.half_space.point=[\"100 mm\", \"0 mm\", \"25 mm\"]"],
        ),
    ] {
        let [time, level] = probe(WAVE, &overrides, "wall", ["time", "water_level"])?;
        rows.push(Measured::new(name, period(&time, &level).ok_or("the wave does not swing")? / 0.6250));
    }
    for (name, overrides) in [
        ("block: height about which it swings", vec![]),
        ("control: the same, heavier by a third", vec!["material.wood.density=800 kg/m^3"]),
    ] {
        let [time, height] = probe(RAFT, &overrides, "block", ["time", "position_3"])?;
        // The last 0.45 s are two swings.
        let swings: Vec<Real> =
            time.iter().zip(&height).filter(|(time, _)| **time > 0.45).map(|(_, height)| *height).collect();
        let [low, high] =
            swings.iter().fold([Real::INFINITY, 0.0], |[low, high]: [Real; 2], &z| [low.min(z), high.max(z)]);
        rows.push(Measured::new(name, 0.5 * (low + high)));
    }
    for (name, overrides) in [
        ("ball: acceleration over 5/7 g sin 20", vec![]),
        ("control: ball without friction: the same", vec!["contact.default.friction=0"]),
    ] {
        let [time, speed] = probe(BALL, &overrides, "ball", ["time", "velocity_1"])?;
        rows.push(Measured::new(name, last(&speed) / last(&time) / (5.0 / 7.0 * 9.81 * (PI / 9.0).sin())));
    }
    Ok(rows)
}

/// Mean period of a level that swings about its mean: twice the time between its first and its last pass, over their number
/// less one.
fn period(time: &[Real], level: &[Real]) -> Option<Real> {
    let mean = level.iter().sum::<Real>() / level.len() as Real;
    let mut passes = Vec::new();
    for n in 1..level.len() {
        let [before, after] = [level[n - 1] - mean, level[n] - mean];
        if before * after < 0.0 {
            passes.push(time[n - 1] + (time[n] - time[n - 1]) * before / (before - after));
        }
    }
    let [first, .., last] = passes[..] else { return None };
    Some(2.0 * (last - first) / (passes.len() - 1) as Real)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_is_read_from_its_passes() {
        let time: Vec<Real> = (0..200).map(|n| 0.01 * n as Real).collect();
        let level: Vec<Real> = time.iter().map(|t| 0.05 + 0.002 * (2.0 * PI * t / 0.5).cos()).collect();
        let found = period(&time, &level).expect("it swings");
        assert!((found - 0.5).abs() < 1e-4, "{found}");
        assert_eq!(period(&time, &vec![1.0; 200]), None);
    }
}
