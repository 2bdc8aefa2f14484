//! Volume fractions of a ball by sampling, for set-ups in code.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

/// Part of every cell of a rank inside a ball, by `samples` points per direction in the cells that
/// its surface may cross. In directions one cell thick the ball is a cylinder.
#[must_use]
pub fn ball(domain: &Domain, centre: Vector, radius: Real, samples: usize) -> Field<Real> {
    let grid = domain.grid();
    let thick = Vector::from_array(grid.cells.map(|n| if n > 1 { 1.0 } else { 0.0 }));
    let per_axis = grid.cells.map(|n| if n > 1 { samples } else { 1 });
    let total: usize = per_axis.iter().product();
    let mut fraction = domain.field(0.0);
    domain.set(&mut fraction, |i, j, k| {
        let x = (domain.centre(i, j, k) - centre) * thick;
        let reach = (grid.spacing * thick).length();
        if (x.length() - radius).abs() > reach {
            return if x.length() < radius { 1.0 } else { 0.0 };
        }
        let inside = |n: usize| {
            let index = [n % per_axis[0], n / per_axis[0] % per_axis[1], n / (per_axis[0] * per_axis[1])];
            let offset = Vector::from_array(std::array::from_fn(|d| {
                ((index[d] as Real + 0.5) / per_axis[d] as Real - 0.5) * grid.spacing[d]
            }));
            (x + offset * thick).length_squared() < radius * radius
        };
        (0..total).filter(|&n| inside(n)).count() as Real / total as Real
    });
    fraction
}
