//! Water with grains.

use std::f64::consts::PI;

use crate::particles as experiments;
use sazanami_mps::scheme::Scheme;

use super::said;
use crate::measured::Measured;

/// Void fraction in a lattice of touching spheres and at a wall, and its rate under compression.
pub fn void_fraction() -> Result<Vec<Measured>, String> {
    let found = experiments::lattice_voids().map_err(said)?;
    let eps = 1.0 - PI / 6.0;
    Ok(vec![
        Measured::new("interior of a lattice", found.interior[0]),
        Measured::new("interior: largest difference from the mean, of eps", found.interior[1] / eps),
        Measured::new("half a grain from a wall", found.at_wall),
        Measured::new("rate of eps under compression over that of differences", found.rate),
        Measured::new("control: at a wall without images", found.without_images / eps - 1.0),
        Measured::new("control: rate that forgets the grains' motion", 1.0 - found.rate_of_fluid_alone),
    ])
}

/// The submerged angle of repose.
pub fn repose() -> Result<Vec<Measured>, String> {
    let found = experiments::repose(Scheme::default(), [40, 8], 10.0, 2.0).map_err(said)?;
    Ok(vec![
        Measured::new("angle at which the bed begins to slide, degrees", found.start),
        Measured::new("angle at which it lies still again, degrees", found.stop),
        Measured::new("way of the upper grains before, in diameters", found.creep),
        Measured::new("time of the slide", found.seconds),
        Measured::new("largest mean speed of the upper grains, of sqrt(g d)", found.speed),
    ])
}

/// Grains carried along by steady flows over their bed.
pub fn bed_load() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for shields in [0.1, 0.2, 0.4, 0.8] {
        let found = experiments::bed_load(Scheme::default(), shields, 0.8).map_err(said)?;
        let name = format!("log law {shields}");
        let over = found.shields / found.shields_by_log_law;
        rows.push(Measured::new(format!("{name}: Shields number of the driving force"), found.shields));
        rows.push(Measured::new(format!("{name}: the same over that of the logarithmic law"), over));
        rows.push(Measured::new(format!("{name}: load"), found.load));
        // The stress of slower flows is below the threshold of Wong and Parker, and their grains come to rest.
        if shields >= 0.4 {
            let over = found.load / found.by_wong_and_parker();
            rows.push(Measured::new(format!("{name}: load over Wong and Parker"), over));
            rows.push(Measured::new(format!("{name}: part of it two diameters deep"), found.deep / found.load));
            let change = found.halves[1] / found.halves[0];
            rows.push(Measured::new(format!("{name}: load of the second half over the first"), change));
        }
    }
    let slow = experiments::bed_load(Scheme::default(), 0.01, 0.4).map_err(said)?;
    rows.push(Measured::new("control: load far below the threshold", slow.load.abs()));
    Ok(rows)
}
