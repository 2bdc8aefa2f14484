//! Cases that are posed once and run with both solvers.

use crate::grid::dam_break::WIDTH;
use sazanami_mps::grains::{DragParameters, volume};
use sazanami_numerics::Real;

use super::whole_run::WholeRun;
use crate::measured::Measured;

const DAM_BREAK: &str = include_str!("../../../../cases/both/dam-break.toml");
const SETTLING_SPHERE: &str = include_str!("../../../../cases/both/settling-sphere.toml");
/// Both solvers.
const SOLVERS: [&str; 2] = ["mics", "mps"];
/// Diameter of the sphere \[m].
const DIAMETER: Real = 1e-3;

/// Runs a case with one of the solvers and returns columns of one of its tables.
fn columns<const N: usize>(text: &str, solver: &str, table: &str, names: [&str; N]) -> Result<[Vec<Real>; N], String> {
    WholeRun::of_text(&format!("both-{solver}"), text, &[format!("solver={solver}")])?.columns(table, names)
}

/// The front of a breaking dam.
pub(crate) fn dam_break() -> Result<Vec<Measured>, String> {
    let [grid, particles] = SOLVERS.map(|solver| columns(DAM_BREAK, solver, "series.csv", ["time", "front"]));
    let (grid, particles) = (grid?, particles?);
    let mut rows = Vec::new();
    let mut worst: Real = 0.0;
    for (n, &time) in grid[0].iter().enumerate() {
        let Some(m) = particles[0].iter().position(|&other| (other - time).abs() < 1e-9) else { continue };
        let (a, b) = (grid[1][n] / WIDTH, particles[1][m] / WIDTH);
        // Until the front has moved by a tenth of the width its first motion decides.
        if a.min(b) < 1.1 {
            continue;
        }
        worst = worst.max((a - b).abs() / (0.5 * (a + b)));
        let millis = (1e3 * time).round() as i64;
        if millis % 50 == 0 {
            rows.push(Measured::new(format!("front over width at {millis} ms, grid"), a));
            rows.push(Measured::new(format!("front over width at {millis} ms, particles"), b));
        }
    }
    let compared = Measured::new("largest difference of the fronts, relative", worst);
    rows.push(compared);
    Ok(rows)
}

/// The speed at which a sphere settles.
pub(crate) fn settling_sphere() -> Result<Vec<Measured>, String> {
    let law = DragParameters::recommended(1000.0, 1e-3);
    // The weight in water against the drag law, by bisection.
    let weight = 1650.0 * volume(DIAMETER) * 9.81;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let speed = 0.5 * (low + high);
        if law.coefficient(DIAMETER, 1.0, speed) * speed < weight { low = speed } else { high = speed }
    }
    let expected = 0.5 * (low + high);
    let mut rows = vec![Measured::new("speed by the drag law", expected)];
    let mut speeds = Vec::new();
    for (solver, name) in SOLVERS.iter().zip(["grid", "particles"]) {
        let found = columns(SETTLING_SPHERE, solver, "probes/sphere.csv", ["velocity_3", "position_3"])?;
        // The last speed before the sphere comes within two diameters of the floor.
        let falling = found[0].iter().zip(&found[1]).filter(|(_, height)| **height > 2.5 * DIAMETER);
        let speed = falling.map(|(speed, _)| -speed).next_back().ok_or("the sphere was never seen")?;
        rows.push(Measured::new(format!("settling speed, {name}"), speed));
        rows.push(Measured::new(format!("{name} over drag law"), speed / expected));
        speeds.push(speed);
    }
    rows.push(Measured::new("grid over particles", speeds[0] / speeds[1]));
    rows.push(Measured::new("settling speed of the particles beside the law", speeds[1]));
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use sazanami::case;

    #[test]
    fn both_cases_are_read_for_both_solvers() {
        for text in [DAM_BREAK, SETTLING_SPHERE] {
            for solver in SOLVERS {
                case::parse(Path::new("both.toml"), text, &[format!("solver={solver}")]).unwrap();
            }
            assert!(case::parse(Path::new("both.toml"), text, &["solver=none".into()]).is_err());
        }
    }
}
