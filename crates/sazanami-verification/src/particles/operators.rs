//! The operators on a lattice, on a disordered lattice, and on one that is spread as in a bed.

use sazanami_mps::probe::Probe;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::weight::{Calibration, Weight};
use sazanami_numerics::Random;
use sazanami_numerics::{Real, Vector};

use super::vessel::lattice;

/// Particles in each direction.
const COUNT: usize = 18;
/// Particles nearer to the outside than this lack neighbours, in spacings.
const RIM: Real = 5.0;

/// Values of the operators well inside, as means and root mean square errors.
#[derive(Clone, Copy, Debug, Default)]
pub struct Operators {
    /// Mean number density over n0.
    pub density: Real,
    /// Root mean square of `(n - n0)/n0`.
    pub density_error: Real,
    /// Mean divergence of a velocity whose divergence is 1/2 (HS).
    pub divergence: Real,
    /// Its root mean square error.
    pub divergence_error: Real,
    /// Mean Laplacian of a quadratic field whose Laplacian is 1 (HL).
    pub laplacian: Real,
    /// Its root mean square error.
    pub laplacian_error: Real,
    /// Root mean square error of the same from the coefficients of the pressure equation.
    pub equation_error: Real,
    /// Root mean square error of the gradient of a quadratic field of unit curvature (GC), in spacings.
    pub gradient_error: Real,
    /// The same for a gradient of 1 that is not corrected but normalised by the number density, exact on a cubic lattice only.
    pub plain_gradient_error: Real,
    /// Part of the pairs whose coefficient in the pressure equation was cut to zero.
    pub cut: Real,
}

/// Particles on a cubic lattice of spacing `spacing`, moved by up to `jitter` in each direction, all of weight `bulk`.
struct Cloud {
    weight: Weight,
    sums: Calibration,
    probe: Probe,
    inner: Vec<usize>,
}

impl Cloud {
    fn new(scheme: Scheme, spacing: Real, jitter: Real, bulk: Real) -> Self {
        let weight = Weight { radius: scheme.radius };
        let sums = Calibration::new(&weight, 1.0);
        let width = spacing * COUNT as Real;
        let mut random = Random::new(3);
        let mut jittered = |place: Vector| {
            let way = Vector::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            spacing * place + jitter * way
        };
        let positions: Vec<Vector> = lattice([COUNT; 3]).map(&mut jittered).collect();
        let probe = Probe::new(scheme, &positions, width, bulk);
        let rim = RIM.max(1.3 * weight.radius);
        let inside = |x: Vector| x.min_element() > rim && x.max_element() < width - rim;
        let inner = (0..positions.len()).filter(|&a| inside(probe.positions()[a])).collect();
        Self { weight, sums, probe, inner }
    }

    fn values<T>(&self, value: impl Fn(Vector) -> T) -> Vec<T> {
        self.probe.positions().iter().map(|&x| value(x)).collect()
    }

    /// Mean of `value` over the particles well inside.
    fn mean(&self, value: impl Fn(usize) -> Real) -> Real {
        self.inner.iter().map(|&a| value(a)).sum::<Real>() / self.inner.len() as Real
    }

    /// Mean, and root mean square of the difference from `exact`.
    fn statistics(&self, exact: Real, value: impl Fn(usize) -> Real) -> [Real; 2] {
        [self.mean(&value), self.mean(|a| (value(a) - exact).powi(2)).sqrt()]
    }

    /// Part of the pairs whose coefficient in the pressure equation was cut to zero.
    fn cut(&self) -> Real {
        let position = self.probe.positions();
        let cut = |a: usize, b: usize| {
            let r = (position[b] - position[a]).length();
            self.weight.laplacian(r).1
        };
        let count = |a: usize| self.probe.pressure_row(a).filter(|&(b, _)| cut(a, b)).count() as Real;
        self.mean(count) / self.mean(|a| self.probe.pressure_row(a).len() as Real)
    }

    fn operators(&self) -> Operators {
        let position = self.probe.positions();
        let flow = self.probe.flow(&self.values(|x| Vector::new(x.x, -0.5 * x.y, 0.0)));
        // Bowls around each particle, from one around the origin and the slopes.
        let bowl = self.probe.flow(&self.values(|x| Vector::new(x.length_squared() / 6.0, 0.0, 0.0)));
        let slopes = self.probe.flow(&self.values(|x| x));
        let centred = |a: usize| bowl[a].laplacian.x - position[a].dot(slopes[a].laplacian) / 3.0;
        let row = |a: usize| {
            let bowl = |b: usize| (position[b] - position[a]).length_squared() / 6.0;
            self.probe.pressure_row(a).map(|(b, c)| c * bowl(b)).sum::<Real>()
        };
        let [_, equation_error] = self.statistics(1.0, row);
        let corrected = self.probe.gradient(&self.values(|x| 0.5 * x.length_squared()));
        let plain = |a: usize| {
            let share = |(b, _): (usize, Real)| {
                let apart = position[b] - position[a];
                self.weight.value(apart.length()) / apart.length_squared() * apart.x * apart
            };
            3.0 / self.sums.others * self.probe.pressure_row(a).map(share).sum::<Vector>()
        };
        let [density, density_error] = self.statistics(1.0, |a| flow[a].density / self.sums.number_density);
        let [divergence, divergence_error] = self.statistics(0.5, |a| -flow[a].rate);
        let [laplacian, laplacian_error] = self.statistics(1.0, centred);
        Operators {
            density,
            density_error,
            divergence,
            divergence_error,
            laplacian,
            laplacian_error,
            equation_error,
            gradient_error: self.mean(|a| (corrected[a] - position[a]).length_squared()).sqrt(),
            plain_gradient_error: self.mean(|a| (plain(a) - Vector::X).length_squared()).sqrt(),
            cut: self.cut(),
        }
    }
}

/// The operators for a radius of influence of 3.1 spacings on a lattice of spacing 1, disordered by `jitter`.
#[must_use]
pub fn operators(jitter: Real) -> Operators {
    Cloud::new(Scheme::published(), 1.0, jitter, 1.0).operators()
}

/// The operators on a lattice that is spread and weighted as in a bed of void fraction `eps`.
#[must_use]
pub fn bulk_weighted(eps: Real) -> Operators {
    Cloud::new(Scheme::published(), eps.cbrt().recip(), 0.0, eps.recip()).operators()
}

/// The Laplacian of a field whose Laplacian is 1, normalised by the number density: wrong by the factor that N2 is for.
#[must_use]
pub fn laplacian_by_number_density() -> Real {
    let cloud = Cloud::new(Scheme::published(), 1.0, 0.0, 1.0);
    let sums = cloud.sums;
    cloud.operators().laplacian * sums.laplacian / sums.number_density
}
