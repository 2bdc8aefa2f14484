//! The operators on a lattice, on a disordered lattice, and on one that is spread as in a bed.

use sazanami_dem::Random;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::lattice;
use crate::boundary::WallFriction;
use crate::matrix::Block;
use crate::neighbours::{Bins, Neighbours, ROWS};
use crate::number_density::{self, Crowding, Prediction, Sample};
use crate::operators::{PressureField, gradient};
use crate::particles::{Kind, ParticleRecord, Particles, Role};
use crate::scheme::{GradientForm, Kernel, Scheme};

/// Particles in each direction.
const COUNT: usize = 18;
/// Particles nearer to the outside than this lack neighbours, in spacings.
const RIM: Real = 5.0;

/// What the operators find well inside, as means and root mean square errors.
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
    /// The same for a gradient of 1 that is not corrected.
    pub plain_gradient_error: Real,
    /// Part of the pairs whose coefficient in the pressure equation was cut to zero.
    pub cut: Real,
}

/// Particles on a cubic lattice of spacing `spacing`, moved by up to `jitter` in each direction, all of weight `bulk`.
struct Cloud {
    kernel: Kernel,
    particles: Particles,
    neighbours: Neighbours,
    bulk: Vec<Real>,
    inner: Vec<usize>,
}

impl Cloud {
    fn new(scheme: Scheme, spacing: Real, jitter: Real, bulk: Real) -> Self {
        let kernel = Kernel::new(scheme, 1.0);
        let width = spacing * COUNT as Real;
        let domain = Domain::solo(Grid::new([COUNT / 3; 3], Vector::ZERO, Vector::splat(width)), [false; 3]);
        let mut random = Random::new(3);
        let mut particles = Particles::default();
        for (n, place) in lattice([COUNT; 3]).enumerate() {
            let way = Vector::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            let position = spacing * place + jitter * way;
            particles.push(&ParticleRecord::new(n as u64, Kind::Fluid, position, Vector::ZERO));
        }
        let mut bins = Bins::default();
        bins.renew(&domain, kernel.weight.radius);
        particles.sort(bins.len(), |x| bins.number(x));
        bins.fill(&particles.position, &[]);
        let mut neighbours = Neighbours::default();
        neighbours.renew(&bins, &particles, kernel.weight.radius, Vector::ZERO, |_| Vector::ZERO);
        particles.role.fill(Role::Unknown);
        let rim = RIM.max(1.3 * kernel.weight.radius);
        let inside = |x: Vector| x.min_element() > rim && x.max_element() < width - rim;
        let inner = (0..particles.owned).filter(|&a| inside(particles.position[a])).collect();
        let bulk = vec![bulk; particles.owned];
        Self { kernel, particles, neighbours, bulk, inner }
    }

    fn samples(&self, velocity: &[Vector]) -> Vec<Sample> {
        let mut samples = Vec::new();
        let still = vec![0.0; velocity.len()];
        number_density::sample(&self.particles.position, velocity, &self.bulk, &still, &mut samples);
        samples
    }

    fn values<T>(&self, value: impl Fn(Vector) -> T) -> Vec<T> {
        self.particles.position.iter().map(|&x| value(x)).collect()
    }

    fn crowding(&self, velocity: &[Vector]) -> Vec<Crowding> {
        let mut found = vec![Crowding::default(); velocity.len()];
        let (samples, kind) = (self.samples(velocity), &self.particles.kind);
        let friction = WallFriction::NoSlip;
        number_density::crowding(&self.kernel, &self.neighbours, kind, &samples, velocity, friction, &mut found);
        found
    }

    fn equation(&self) -> Vec<Block> {
        let owned = self.particles.owned;
        let blocks = owned.div_ceil(ROWS);
        let samples = self.samples(&vec![Vector::ZERO; owned]);
        let conductance: Vec<Real> = self.bulk.iter().map(|bulk| 1.0 / bulk).collect();
        let mut equation = vec![Block::default(); blocks];
        let mut sums = vec![Prediction::default(); blocks * ROWS];
        let (kind, near) = (&self.particles.kind, &self.neighbours);
        number_density::prediction(&self.kernel, 1.0, near, kind, &samples, &conductance, &mut equation, &mut sums);
        equation
    }

    fn gradient(&self, equation: &mut [Block], form: GradientForm, field: &[Real]) -> Vec<Vector> {
        let Particles { kind, position, role, owned, .. } = &self.particles;
        let kernel = Kernel { scheme: Scheme { gradient: form, ..self.kernel.scheme }, ..self.kernel };
        let field = PressureField {
            pressure: field,
            position,
            bulk: &self.bulk,
            roles: role,
            kind,
            weight_of_fluid: Vector::ZERO,
        };
        let (mut found, mut plain) = (vec![Vector::ZERO; *owned], vec![false; *owned]);
        gradient(&kernel, equation, &field, &mut found, &mut plain);
        found
    }

    /// Mean of `value` over the particles well inside.
    fn mean(&self, value: impl Fn(usize) -> Real) -> Real {
        self.inner.iter().map(|&a| value(a)).sum::<Real>() / self.inner.len() as Real
    }

    /// Mean, and root mean square of the difference from `exact`.
    fn statistics(&self, exact: Real, value: impl Fn(usize) -> Real) -> [Real; 2] {
        [self.mean(&value), self.mean(|a| (value(a) - exact).powi(2)).sqrt()]
    }

    fn operators(&self) -> Operators {
        let n0 = self.kernel.sums.number_density;
        let flow = self.crowding(&self.values(|x| Vector::new(x.x, -0.5 * x.y, 0.0)));
        // Bowls around each particle, from one around the origin and the slopes.
        let bowl = self.crowding(&self.values(|x| Vector::new(x.length_squared() / 6.0, 0.0, 0.0)));
        let slopes = self.crowding(&self.values(|x| x));
        let position = &self.particles.position;
        let centred = |a: usize| {
            let [x, slope] = [position[a], slopes[a].laplacian];
            bowl[a].laplacian.x - x.dot(slope) / 3.0
        };
        let mut equation = self.equation();
        let row = |a: usize| {
            let (columns, coefficients) = equation[a / ROWS].row(a % ROWS);
            let bowl = |b: u32| (position[b as usize] - position[a]).length_squared() / 6.0;
            columns.iter().zip(coefficients).map(|(&b, &c)| Real::from(c) * bowl(b)).sum::<Real>()
        };
        let [_, equation_error] = self.statistics(1.0, row);
        let cut_of = |a: usize| {
            let (columns, _) = equation[a / ROWS].row(a % ROWS);
            let cut = |b: u32| {
                let r = (position[b as usize] - position[a]).length();
                self.kernel.scheme.laplacian.coefficient(&self.kernel.weight, r).1
            };
            columns.iter().filter(|&&b| cut(b)).count() as Real
        };
        let pairs = self.mean(|a| equation[a / ROWS].row(a % ROWS).0.len() as Real);
        let cut = self.mean(cut_of) / pairs;
        let curved = self.values(|x| 0.5 * x.length_squared());
        let corrected = self.gradient(&mut equation, GradientForm::Corrected, &curved);
        let slope = self.values(|x| x.x);
        let plain = self.gradient(&mut equation, GradientForm::Classical, &slope);
        let [density, density_error] = self.statistics(1.0, |a| flow[a].density / n0);
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
            plain_gradient_error: self.mean(|a| (plain[a] - Vector::X).length_squared()).sqrt(),
            cut,
        }
    }
}

/// The operators for a radius of influence of 3.1 spacings on a lattice of spacing 1, disordered by `jitter`.
#[must_use]
pub fn operators(jitter: Real) -> Operators {
    Cloud::new(Scheme::default(), 1.0, jitter, 1.0).operators()
}

/// The operators on a lattice that is spread and weighted as in a bed of void fraction `eps`.
#[must_use]
pub fn bulk_weighted(eps: Real) -> Operators {
    Cloud::new(Scheme::default(), eps.cbrt().recip(), 0.0, eps.recip()).operators()
}

/// The Laplacian of a field whose Laplacian is 1, normalised by the number density: wrong by the factor that N2 is for.
#[must_use]
pub fn laplacian_by_number_density() -> Real {
    let cloud = Cloud::new(Scheme::default(), 1.0, 0.0, 1.0);
    let sums = cloud.kernel.sums;
    cloud.operators().laplacian * sums.laplacian / sums.number_density
}
