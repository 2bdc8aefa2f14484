//! Water with grains.

use std::f64::consts::PI;

use crate::particles as experiments;

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
