//! The reduced raindrop case, whole: packed, hit, evaluated.

use std::path::Path;

use super::whole_run::{WholeRun, number};
use crate::measured::Measured;
use sazanami::case::{self, LoadedCase};

const CASE: &str = include_str!("../../cases/raindrop/reduced.toml");

/// The case at `speed` [m/s].
fn at(speed: &str) -> Result<LoadedCase, String> {
    let speed = format!("liquid.0.fall.speed=\"{speed} m/s\"");
    case::parse(Path::new("reduced.toml"), CASE, &[speed]).map_err(|error| error.to_string())
}

/// A quarter of the bed, an eighth of the drop, at 2.25 and 9 m/s.
pub(crate) fn reduced_raindrop() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let mut volumes = Vec::new();
    for speed in ["2.25", "9"] {
        let found = WholeRun::of(&format!("reduced-{speed}"), &at(speed)?)?.summary()?;
        let of = |pointer| number(&found, pointer);
        let name = |what: &str| format!("{speed} m/s: {what}");
        let volume = of("/observables/erosion/volume_mm3")?;
        let noise = of("/observables/erosion/volume_noise_mm3")?;
        rows.push(Measured::new(name("erosion volume"), volume));
        rows.push(Measured::new(name("erosion volume of the bed before"), noise));
        let residual = of("/conservation/momentum_residual_relative")?;
        rows.push(Measured::new(name("residual of the momentum budget"), residual.abs()));
        let liquid = of("/conservation/liquid_volume_relative_change")?;
        rows.push(Measured::new(name("change of the liquid volume"), liquid.abs()));
        rows.push(Measured::new(name("grains"), of("/counts/grains")?));
        rows.push(Measured::new(name("largest overlap over radius"), of("/worst/overlap_relative")?));
        volumes.push(volume);
    }
    rows.push(Measured::new("V at 9 m/s over that at 2.25 m/s", volumes[1] / volumes[0]));
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_case_is_read_at_both_speeds() {
        let slow = at("2.25").unwrap();
        assert_eq!(slow.case.grains[0].count, Some(7725));
        assert_ne!(slow.case, at("9").unwrap().case);
        // Negative control: a speed that is none.
        assert!(at("fast").is_err());
    }
}
