//! Ripples in the shaken tank of Tazaki et al., ten diameters across, to 3 s.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use sazanami_numerics::Real;
use serde_json::Value;

use crate::case;
use crate::progress::Silent;
use crate::run::{RunOptions, run};
use crate::verify::Measured;

const CASE: &str = include_str!("../../../../cases/ripples/paper.toml");
const SOURCE: &str =
    "predictors for the tank: dem-mps-validation V14, after Wiberg and Harris, Nielsen, Miller and Komar";
/// Simulated time of each run [s].
const UNTIL: Real = 3.0;
/// Last part of a run whose layer averages count: two periods [s].
const WATCHED: Real = 1.0;

/// What a run found at its end.
struct Found {
    /// Root mean square of the bed without its trend [mm].
    relief: Real,
    /// Wavelength at the centre of the spectrum [mm], where there are ripples.
    wavelength: Option<Real>,
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
    let loaded = case::parse(Path::new("ripples.toml"), CASE, &overrides).map_err(|error| error.to_string())?;
    let folder = std::env::temp_dir().join(format!("sazanami-ripples-{name}-{}", std::process::id()));
    let options = RunOptions { out: Some(folder.clone()), force: true, ranks: 1, ..RunOptions::default() };
    run(&loaded, &options, &mut Silent, &AtomicBool::new(false)).map_err(|error| error.to_string())?;
    let read = |file: &str| {
        let path = folder.join(file);
        std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))
    };
    let summary: Value = serde_json::from_str(&read("summary.json")?).map_err(|error| error.to_string())?;
    let number = |pointer: &str| summary.pointer(pointer).and_then(Value::as_f64);
    let layers = read("layers.csv")?;
    let found = Found {
        relief: number("/observables/ripples/relief_mm").ok_or("the run tells no relief")?,
        wavelength: number("/observables/ripples/wavelength_mm"),
        upper: half_ranges(&layers, "upper"),
        lower: half_ranges(&layers, "lower"),
        volume: number("/conservation/fluid_bulk_volume_relative_change").unwrap_or(Real::NAN),
    };
    std::fs::remove_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok(found)
}

/// Half of the way from the lowest to the highest water velocity, drag and pressure force of a layer in the last part.
fn half_ranges(table: &str, layer: &str) -> [Real; 3] {
    let mut ranges = [[Real::INFINITY, Real::NEG_INFINITY]; 3];
    for line in table.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let value = |n: usize| cells.get(n).and_then(|cell| cell.parse::<Real>().ok()).unwrap_or(Real::NAN);
        if cells.get(2).is_none_or(|name| name.trim_matches('"') != layer) || value(1) < UNTIL - WATCHED {
            continue;
        }
        // Step, time, layer, velocity of water, of grains, drag, pressure force.
        for (range, column) in ranges.iter_mut().zip([3, 5, 6]) {
            *range = [range[0].min(value(column)), range[1].max(value(column))];
        }
    }
    ranges.map(|[low, high]| 0.5 * (high - low))
}

/// V14: relief and wavelength, the same for other particles and another drag law, none for a gentle motion.
pub(super) fn ripples() -> Result<Vec<Measured>, String> {
    let base = tank("base", &[])?;
    let gentle = tank("gentle", &["frame.motion.amplitude=[\"-3 mm\",\"0 mm\",\"0 mm\"]"])?;
    let mut rows = vec![
        Measured::within("relief at 3 s", "mm", base.relief, 0.3, Real::INFINITY).from_source(SOURCE),
        Measured::within("relief over that of a motion of 3 mm", "", base.relief / gentle.relief, 3.0, Real::INFINITY)
            .from_source("no ripples below the threshold of motion"),
        Measured::within("wavelength at 3 s", "mm", base.wavelength.unwrap_or(Real::NAN), 10.0, 40.0)
            .from_source(SOURCE),
        Measured::within(
            "water velocity, upper over lower layer",
            "",
            base.upper[0] / base.lower[0],
            5.0,
            Real::INFINITY,
        )
        .from_source("Tazaki et al.: the upper layer is much faster"),
        Measured::within("drag, upper over lower layer", "", base.upper[1] / base.lower[1], 1.0, Real::INFINITY)
            .from_source("Tazaki et al."),
        Measured::within(
            "drag over pressure force, upper layer",
            "",
            base.upper[1] / base.upper[2],
            1.0,
            Real::INFINITY,
        )
        .from_source("Tazaki et al.: drag dominates at the surface"),
        Measured::within("change of the water's volume", "", base.volume.abs(), 0.0, 0.01).from_source("conservation"),
    ];
    for (name, change) in
        [("particles of 0.8 mm", "particles.spacing=0.8333333333 mm"), ("F_ch = 0.55", "overlap.forchheimer=0.55")]
    {
        let other = tank(name, &[change])?;
        let ratio = other.wavelength.unwrap_or(Real::NAN) / base.wavelength.unwrap_or(Real::NAN);
        rows.push(
            Measured::within(format!("{name}: wavelength over that of the base"), "", ratio, 0.8, 1.2)
                .from_source("robustness"),
        );
        rows.push(Measured::info(format!("{name}: relief"), "mm", other.relief));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_ranges_are_those_of_the_layer_in_the_last_part() {
        let table = "step,time [s],layer,u,v,fd,fp\n1,1.0,\"upper\",9,9,9,9\n2,2.5,upper,-1,0,2,5\n2,2.5,lower,7,7,7,7\n\
                     3,3.0,upper,3,0,4,5\n";
        assert_eq!(half_ranges(table, "upper"), [2.0, 1.0, 0.0]);
        assert_eq!(half_ranges(table, "lower"), [0.0; 3]);
    }
}
