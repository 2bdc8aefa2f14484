//! Sums over pairs that need neither pressure nor the neighbours' gradients: `B`, velocity gradient, density, drift, roles.

use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::mirrors::seen;
use super::pairs::{LANES, Pairs, add_to, four, lanes, three};
use super::voids::Bulk;
use crate::free_surface::is_isolated;
use crate::matrix::{Block, CLOSE_RADIUS};
use crate::moments::{Symmetric, eigenvalues_exceed, full};
use crate::neighbours::ROWS;
use crate::particles::{Kind, Role};
use crate::scheme::Kernel;
use crate::surface_test::{Support, cone_is_empty, towards};
use crate::weight::{Calibration, Weight};

/// Smallest eigenvalue of `M` below which `B` is the unit matrix: sheets of one layer and threads.
const THINNEST: Real = 0.1;
/// Factor of the drift of close pairs (Monaghan 2000, J. Comput. Phys. 159, 290).
const CLOSE_PAIRS: Real = 0.2;
/// Distance over the spacing below which a pair is counted as collided.
const COLLIDED: Real = 0.5;
const UNIT: Symmetric = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];

/// The weight of shifting and of the surface test: that of 2.1 spacings, whatever the radius of the scheme.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near {
    weight: Weight,
    strain: Real,
    at_spacing: Real,
}

impl Near {
    pub fn new(spacing: Real) -> Self {
        let weight = Weight { radius: CLOSE_RADIUS * spacing };
        let strain = Calibration::new(&weight, spacing).strain;
        Self { weight, strain, at_spacing: weight.value(spacing) }
    }

    /// Share of a neighbour at distance `r` \[m] in the drift, over its way [1/m^2].
    #[inline(always)]
    pub fn drift(&self, r: Real) -> Real {
        let ratio = (self.weight.value(r) / self.at_spacing).powi(2);
        -self.weight.slope_over_distance(r) / self.strain * (1.0 + CLOSE_PAIRS * ratio * ratio)
    }
}

/// Density, surface and role of a particle among its neighbours.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Surroundings {
    /// Number density.
    pub density: Real,
    /// Direction in which particles are sparse, `-grad C` of shifting [1/m].
    pub drift: Vector,
    /// Outward direction: away from the mean of the close neighbours; zero inside.
    pub normal: Vector,
    /// Pairs nearer than half a spacing.
    pub collided: u32,
    /// Whether it lies inside, at the free surface, or alone.
    pub role: Role,
}

/// Columns set by [`surround`] for each own particle.
pub(crate) struct PairSums<'a> {
    pub inverse: &'a mut [Symmetric],
    /// Gradient of the velocity, `grad[i][j] = du_i/dx_j` as a matrix [1/s].
    pub gradient: &'a mut [Matrix],
    pub surroundings: &'a mut [Surroundings],
}

/// Sums over the pairs of each own fluid particle with its `velocity` [m/s]; `open` if there is a free surface.
pub(crate) fn surround(
    kernel: &Kernel,
    near: &Near,
    open: bool,
    (pairs, blocks): (&Pairs, &[Block]),
    (kind, velocity): (&[Kind], &[Vector]),
    bulk: &Bulk<'_>,
    found: PairSums<'_>,
) {
    let spacing = near.weight.radius / CLOSE_RADIUS;
    let PairSums { inverse, gradient, surroundings } = found;
    for_each_chunk((inverse, gradient, surroundings), ROWS, |number, (inverse, gradient, surroundings)| {
        for row in 0..inverse.len() {
            let a = number * ROWS + row;
            (inverse[row], gradient[row]) = (UNIT, Matrix::ZERO);
            surroundings[row] = Surroundings::default();
            if kind[a] != Kind::Fluid {
                continue;
            }
            let Sums { moments, changes, sum, density, drift, close, collided } =
                Sums::over(kernel, near, (pairs, blocks), velocity, bulk, a);
            let mine = &mut surroundings[row];
            (mine.density, mine.drift, mine.collided) = (density, drift, collided);
            if eigenvalues_exceed(&moments, THINNEST) {
                let m = full(&moments).inverse();
                inverse[row] = [m.x_axis.x, m.y_axis.y, m.z_axis.z, m.x_axis.y, m.x_axis.z, m.y_axis.z];
            }
            gradient[row] = changes * full(&inverse[row]);
            let spacing = bulk.size[a] * spacing;
            let apart = pairs.of(blocks, a).map(|pair| pair.way()).filter(|d| d.length() < CLOSE_RADIUS * spacing);
            let scaled = moments.map(|m| m * kernel.sums.strain / bulk.inverse_void[a]);
            let role = if open { role(&scaled, &kernel.sums, close, spacing, apart.clone()) } else { Role::Unknown };
            mine.role = role;
            mine.normal = match role {
                Role::Dirichlet => -towards(spacing, apart),
                Role::Inactive | Role::Unknown => -sum,
            }
            .normalize_or_zero();
        }
    });
}

/// Sums over the neighbours of a particle.
struct Sums {
    /// `M`.
    moments: Symmetric,
    /// `sum (u_j - u_i) g_ij^T` [1/s].
    changes: Matrix,
    /// `sum g_ij` [1/m].
    sum: Vector,
    density: Real,
    drift: Vector,
    /// Neighbours within 2.1 spacings, and within half a spacing.
    close: u32,
    collided: u32,
}

impl Sums {
    /// Those of own particle `a`.
    #[inline(always)]
    fn over(
        kernel: &Kernel,
        near: &Near,
        (pairs, blocks): (&Pairs, &[Block]),
        velocity: &[Vector],
        bulk: &Bulk<'_>,
        a: usize,
    ) -> Self {
        let spacing = near.weight.radius / CLOSE_RADIUS;
        let here = velocity[a];
        // The last column holds 11, 22, 33, 12 of the moments; the first three end in sums of `g`.
        let (mut changes, mut moments) = ([[0.0; 4]; 3], [0.0; 4]);
        let [mut moment13, mut moment23, mut density] = [0.0, 0.0, 1.0];
        let (mut drift, mut close, mut collided) = ([0.0; 4], 0, 0);
        pairs.for_each_group(blocks, a, |columns, turned, group| {
            let (mut share, mut narrower, mut crowd) = ([1.0; LANES], [1.0; LANES], [1.0; LANES]);
            if !bulk.clear {
                for (l, &b) in columns.iter().enumerate() {
                    let b = b as usize;
                    (share[l], narrower[l], crowd[l]) = (bulk.share(a, b), bulk.narrowing(a, b), bulk.crowd(a, b));
                }
            }
            let r = lanes(|l| group.length[l] * narrower[l]);
            let stiffness = lanes(|l| share[l] * group.stiffness[l]);
            let weight = lanes(|l| kernel.weight.value(r[l]));
            let drifts = lanes(|l| {
                let drift = crowd[l] * near.drift(r[l]) * narrower[l] * narrower[l];
                if r[l] < CLOSE_RADIUS * spacing { drift } else { 0.0 }
            });
            for (l, (&b, &turned)) in columns.iter().zip(turned).take(LANES).enumerate() {
                let change = four(seen(turned, velocity[b as usize]) - here, 1.0);
                let way @ [x, y, z, _] = group.way[l];
                (0..3).for_each(|d| add_to(&mut changes[d], share[l] * group.slope[l][d], &change));
                add_to(&mut moments, stiffness[l], &[x * x, y * y, z * z, x * y]);
                moment13 += stiffness[l] * (x * z);
                moment23 += stiffness[l] * (y * z);
                density += weight[l];
                add_to(&mut drift, -drifts[l], &way);
                close += u32::from(r[l] < CLOSE_RADIUS * spacing);
                collided += u32::from(r[l] < COLLIDED * spacing);
            }
        });
        let [p, q, s] = changes;
        let [xx, yy, zz, xy] = moments;
        Self {
            moments: [xx, yy, zz, xy, moment13, moment23],
            changes: Matrix::from_cols(three(p), three(q), three(s)),
            sum: Vector::new(p[3], q[3], s[3]),
            density,
            drift: three(drift),
            close,
            collided,
        }
    }
}

/// Role by eigenvalue and cone; it matters for shifting, spray and the relaxation of the density alone.
fn role(
    moments: &Symmetric,
    sums: &Calibration,
    close: u32,
    spacing: Real,
    apart: impl Iterator<Item = Vector> + Clone,
) -> Role {
    let at_surface = match Support::of(moments, sums) {
        Support::Full => return Role::Unknown,
        Support::Thin => true,
        Support::Partial => cone_is_empty(spacing, apart),
    };
    match at_surface {
        _ if is_isolated(close) => Role::Inactive,
        true => Role::Dirichlet,
        false => Role::Unknown,
    }
}
