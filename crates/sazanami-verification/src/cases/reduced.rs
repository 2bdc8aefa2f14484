//! The reduced raindrop case, whole: packed, hit, evaluated.

use std::path::Path;

use sazanami_numerics::Real;

use super::whole_run::{WholeRun, number};
use crate::measured::Measured;
use sazanami::case::{self, LoadedCase};

const CASE: &str = include_str!("../../../../cases/raindrop/reduced.toml");

/// The case at `speed` [m/s].
fn at(speed: &str) -> Result<LoadedCase, String> {
    let speed = format!("liquid.0.fall.speed=\"{speed} m/s\"");
    case::parse(Path::new("reduced.toml"), CASE, &[speed]).map_err(|error| error.to_string())
}

/// 7.4: a quarter of the bed, an eighth of the drop, at 2.25 and 9 m/s.
pub(crate) fn reduced_raindrop() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let mut volumes = Vec::new();
    for speed in ["2.25", "9"] {
        let found = WholeRun::of(&format!("reduced-{speed}"), &at(speed)?)?.summary()?;
        let of = |pointer| number(&found, pointer);
        let name = |what: &str| format!("{speed} m/s: {what}");
        let volume = of("/observables/erosion/volume_mm3")?;
        let noise = of("/observables/erosion/volume_noise_mm3")?;
        rows.push(Measured::within(name("erosion volume"), "mm3", volume, Real::MIN_POSITIVE, Real::INFINITY));
        rows.push(Measured::info(name("erosion volume of the bed before"), "mm3", noise));
        let residual = of("/conservation/momentum_residual_relative")?;
        rows.push(
            Measured::within(name("residual of the momentum budget"), "", residual.abs(), 0.0, 1e-9)
                .from_source("conservation"),
        );
        let liquid = of("/conservation/liquid_volume_relative_change")?;
        rows.push(
            Measured::within(name("change of the liquid volume"), "", liquid.abs(), 0.0, 1e-8)
                .from_source("conservation"),
        );
        rows.push(
            Measured::within(name("grains"), "", of("/counts/grains")?, 7725.0, 7725.0).from_source("no grain lost"),
        );
        rows.push(
            Measured::within(name("largest overlap over radius"), "", of("/worst/overlap_relative")?, 0.0, 0.8)
                .from_source("warned above 0.2, refused above 0.8"),
        );
        volumes.push(volume);
    }
    rows.push(
        Measured::within("V at 9 m/s over that at 2.25 m/s", "", volumes[1] / volumes[0], 1.0, Real::INFINITY)
            .from_source("V grows with momentum"),
    );
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
