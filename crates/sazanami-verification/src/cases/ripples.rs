//! Ripples in the shaken tank of Tazaki et al., ten diameters across, to 3 s.

use sazanami_numerics::Real;

use super::whole_run::{WholeRun, number};
use crate::measured::Measured;
use sazanami::analyse::layer_history;

const CASE: &str = include_str!("../../cases/ripples/paper.toml");
/// Simulated time of each run \[s].
const UNTIL: Real = 3.0;
/// Last part of a run whose layer averages count: two periods \[s].
const WATCHED: Real = 1.0;

/// Results of a run at its end.
struct Found {
    /// Root mean square of the bed without its trend [mm].
    relief: Real,
    /// Half ranges of the averages of the upper and the lower layer: water, drag, pressure force.
    upper: [Real; 3],
    lower: [Real; 3],
    /// Largest relative change of the water's volume.
    volume: Real,
}

/// Runs the tank with `changes`.
fn tank(name: &str, changes: &[&str]) -> Result<Found, String> {
    let mut overrides = vec![
        "domain.size=[\"150 mm\",\"10 mm\",\"40 mm\"]".to_owned(),
        "liquid.0.region.box.upper=[\"75 mm\",\"10 mm\",\"20 mm\"]".to_owned(),
        format!("run.until={UNTIL} s"),
        "output.figures.at=[]".to_owned(),
        "output.fields.at=[]".to_owned(),
        "output.grains={ at = [] }".to_owned(),
    ];
    overrides.extend(changes.iter().map(|change| (*change).to_owned()));
    let left = WholeRun::of_text(&format!("ripples-{name}"), CASE, &overrides)?;
    let summary = left.summary()?;
    let layers = layer_history(left.folder())
        .map_err(|error| error.to_string())?
        .ok_or("the run tells nothing of its layers")?;
    let half_ranges = |columns: &[Vec<Real>; 4]| {
        // Velocity of water, drag, pressure force.
        [0, 2, 3].map(|quantity| half_range(&layers.time, &columns[quantity]))
    };
    Ok(Found {
        relief: number(&summary, "/observables/ripples/relief_mm")?,
        upper: half_ranges(&layers.upper),
        lower: half_ranges(&layers.lower),
        volume: number(&summary, "/conservation/fluid_bulk_volume_relative_change")?,
    })
}

/// Half of the way from the lowest to the highest value in the last part of a run.
fn half_range(time: &[Real], values: &[Real]) -> Real {
    let late = || time.iter().zip(values).filter(|(time, _)| **time >= UNTIL - WATCHED).map(|(_, value)| *value);
    0.5 * (late().fold(Real::NEG_INFINITY, Real::max) - late().fold(Real::INFINITY, Real::min))
}

/// Relief of the bed, for other particles and another drag law too, and for a gentle motion.
pub(crate) fn ripples() -> Result<Vec<Measured>, String> {
    let base = tank("base", &[])?;
    let gentle = tank("gentle", &["frame.motion.amplitude=[\"-3 mm\",\"0 mm\",\"0 mm\"]"])?;
    let mut rows = vec![
        Measured::new("relief at 3 s", base.relief),
        Measured::new("relief over that of a motion of 3 mm", base.relief / gentle.relief),
        Measured::new("water velocity, upper over lower layer", base.upper[0] / base.lower[0]),
        Measured::new("drag, upper over lower layer", base.upper[1] / base.lower[1]),
        Measured::new("drag over pressure force, upper layer", base.upper[1] / base.upper[2]),
        Measured::new("change of the water's volume", base.volume.abs()),
    ];
    for (name, change) in
        [("particles of 0.8 mm", "particles.spacing=0.8333333333 mm"), ("F_ch = 0.55", "overlap.forchheimer=0.55")]
    {
        let other = tank(name, &[change])?;
        rows.push(Measured::new(format!("{name}: relief"), other.relief));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_ranges_are_those_of_the_last_part() {
        let time = [1.0, 2.5, 3.0];
        assert_eq!(half_range(&time, &[9.0, -1.0, 3.0]), 2.0);
        // Negative control: earlier values do not count.
        assert_ne!(half_range(&[2.1, 2.5, 3.0], &[9.0, -1.0, 3.0]), 2.0);
    }
}
