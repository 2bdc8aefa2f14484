//! Water without grains.

use crate::particles as experiments;
use sazanami_numerics::Real;

use crate::measured::Measured;

/// Mean of error over displacement: errors grow in proportion to it.
fn per_displacement(errors: &[[Real; 2]; 4]) -> Real {
    errors.iter().map(|[a, error]| error / a).sum::<Real>() / 4.0
}

/// Sums on lattices and off them.
pub fn operators() -> Result<Vec<Measured>, String> {
    let lattice = experiments::operators(0.0);
    let mut rows = vec![
        Measured::new("lattice: error of the number density", (lattice.density - 1.0).abs()),
        Measured::new("lattice: error of HS", lattice.divergence_error),
        Measured::new("lattice: error of HL", lattice.laplacian_error),
        Measured::new("lattice: error of HL in the equation (single precision)", lattice.equation_error),
        Measured::new("lattice: error of GC", lattice.gradient_error),
    ];
    let jittered = [0.05, 0.1, 0.2, 0.3].map(|a| (a, experiments::operators(a)));
    let mut compared = |name: &str, of: fn(&experiments::Operators) -> Real| {
        let found = jittered.each_ref().map(|(a, operators)| [*a, of(operators)]);
        rows.push(Measured::new(
            format!("disordered: rms error of {name}, per displacement"),
            per_displacement(&found),
        ));
    };
    compared("n", |o| o.density_error);
    compared("HS", |o| o.divergence_error);
    for (a, found) in &jittered {
        rows.push(Measured::new(format!("disordered by {a}: rms error of n"), found.density_error));
        rows.push(Measured::new(format!("disordered by {a}: rms error of HS"), found.divergence_error));
        rows.push(Measured::new(format!("disordered by {a}: rms error of HL"), found.laplacian_error));
        rows.push(Measured::new(format!("disordered by {a}: rms error of GC"), found.gradient_error));
        rows.push(Measured::new(format!("disordered by {a}: part of negative coefficients"), found.cut));
    }
    let plain = jittered[2].1.plain_gradient_error;
    rows.push(Measured::new("control: error of a gradient of 1 without GC", plain));
    for eps in [0.8, 0.6, 0.4, 0.36] {
        let found = experiments::bulk_weighted(eps);
        rows.push(Measured::new(format!("eps {eps}: n over n0"), found.density));
        rows.push(Measured::new(format!("eps {eps}: HS over exact"), 2.0 * found.divergence));
        rows.push(Measured::new(format!("eps {eps}: HL over exact"), found.laplacian));
    }
    let wrong = experiments::laplacian_by_number_density();
    rows.push(Measured::new("control: HL over n0 instead of N2", wrong));
    Ok(rows)
}
