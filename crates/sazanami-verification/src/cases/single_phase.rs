//! The projection by itself.

use sazanami_dem::Random;
use sazanami_mics::pressure::{PressureReport, PressureSide, Projection, Tolerance};
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::{Field, Grid};
use sazanami_numerics::{Real, Vector};

use super::tank::largest;
use crate::measured::Measured;

/// Observed orders of a sequence of errors, each from twice as fine as the one before.
pub(crate) fn orders<const N: usize>(errors: [Real; N]) -> Vec<Real> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// The results of `run` for each of `inputs`.
pub(crate) fn each<I: Copy, O, E: std::fmt::Display, const N: usize>(
    inputs: [I; N],
    run: impl Fn(I) -> Result<O, E>,
) -> Result<[O; N], String> {
    let outputs: Result<Vec<O>, String> =
        inputs.into_iter().map(|i| run(i).map_err(|error| error.to_string())).collect();
    outputs?.try_into().map_err(|_| "as many results as inputs".to_owned())
}

/// A random velocity in a closed box of liquid and gas sprinkled cell by cell.
struct Sprinkled {
    domain: Domain,
    density: Field<Real>,
    velocity: [Field<Real>; 3],
    faces: [Field<Real>; 3],
}

impl Sprinkled {
    fn new(n: usize) -> Self {
        let domain = Domain::solo(Grid::new([n; 3], Vector::ZERO, Vector::splat(1e-3 * n as Real)), [false; 3]);
        let mut random = Random::new(5);
        let (mut density, mut velocity) = (domain.field(0.0), [0; 3].map(|_| domain.field(0.0)));
        let mut faces = velocity.clone();
        let last = n as isize;
        for k in 0..last {
            for j in 0..last {
                for i in 0..last {
                    density[[i, j, k]] = if random.unit() < 0.5 { 1e3 } else { 1.0 };
                    for d in 0..3 {
                        velocity[d][[i, j, k]] = random.between(-1.0, 1.0);
                        let inside = [i, j, k][d] > 0;
                        faces[d][[i, j, k]] = if inside { random.between(-1.0, 1.0) } else { 0.0 };
                    }
                }
            }
        }
        domain.fill_halos(&mut [(&mut density, &GhostRules::EVEN)]);
        Self { domain, density, velocity, faces }
    }

    fn project(&mut self, projection: &mut Projection, dt: Real, divergence: Real) -> Result<PressureReport, String> {
        let tolerance = Tolerance { divergence, max_iterations: 500 };
        let Self { domain, density, velocity, faces } = self;
        projection
            .project(domain, density, velocity, faces, Vector::ZERO, dt, &tolerance)
            .map_err(|error| error.to_string())
    }

    /// Largest |div u| dt, by sums over the faces made here.
    fn divergence(&self, dt: Real) -> Real {
        let n = self.domain.cells().map(|n| n as isize);
        let mut worst: Real = 0.0;
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    let [f1, f2, f3] = &self.faces;
                    let sum = f1[[i + 1, j, k]] - f1[[i, j, k]] + f2[[i, j + 1, k]] - f2[[i, j, k]] + f3[[i, j, k + 1]]
                        - f3[[i, j, k]];
                    worst = worst.max((sum / 1e-3 * dt).abs());
                }
            }
        }
        worst
    }

    fn momentum(&self) -> Vector {
        let rho = self.density.data();
        let sum = self.domain.sum_rows(&self.domain.interior(), |row| {
            let part = |d: usize| row.shifted(0).map(|at| rho[at] * self.velocity[d].data()[at]).sum::<Real>();
            [part(0), part(1), part(2)]
        });
        Vector::from_array(sum) * self.domain.grid().cell_volume()
    }
}

/// The projection of a random velocity with density jumps of 1000 cell by cell.
pub(crate) fn projection() -> Result<Vec<Measured>, String> {
    let (dt, asked) = (1e-4, 1e-10);
    let mut box_ = Sprinkled::new(40);
    let mut projection = Projection::new(&box_.domain, [[PressureSide::Wall; 2]; 3]);
    let before = box_.divergence(dt);
    let momentum = box_.momentum();
    let scale = 500.0 * box_.domain.grid().cell_volume() * box_.domain.grid().len() as Real;
    let report = box_.project(&mut projection, dt, asked)?;
    let after = box_.divergence(dt);
    let gained = box_.momentum() - momentum;
    let faces = box_.faces.clone();
    let mut again = Projection::new(&box_.domain, [[PressureSide::Wall; 2]; 3]);
    box_.project(&mut again, dt, asked)?;
    let changes =
        box_.faces.iter().zip(&faces).flat_map(|(a, b)| a.data().iter().zip(b.data()).map(|(a, b)| (a - b).abs()));
    let change = largest(changes) * dt / 1e-3;
    Ok(vec![
        Measured::new("control: largest |div u| dt before", before),
        Measured::new("largest |div u| dt over the tolerance", after / asked),
        Measured::new("change of a face by a second projection, dt/dx, over the tolerance", change / asked),
        Measured::new("momentum not explained by the wall pressure", (gained - report.wall_impulse).length() / scale),
        Measured::new("control: momentum gained", gained.length() / scale),
        Measured::new("iterations", report.iterations as Real),
    ])
}
