//! The tests for particles at the free surface.

use sazanami_numerics::{Real, Vector};

use crate::matrix::CLOSE_RADIUS;
use crate::moments::{Symmetric, eigenvalues_exceed};
use crate::weight::{COINCIDENT, Calibration};

/// Asymmetry of the top layer of a lattice over n0 above which it exceeds that of disordered fluid: with 3.1 spacings and
/// more. With smaller radii the top layer is less asymmetric, disordered fluid more.
const STANDS_OUT: Real = 0.18;
/// Number density over n0 below which a particle lies at the surface whatever its asymmetry.
const SPARSE: Real = 0.7;

/// Support of a particle by its neighbours, by the smallest eigenvalue of its first-moment matrix over that of full
/// support (Marrone et al. 2010, with thresholds of the radius in use instead of theirs).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Support {
    /// Inside.
    #[default]
    Full,
    /// Perhaps at the surface: the cone decides.
    Partial,
    /// In a sheet of one layer, a thread or alone: at the surface.
    Thin,
}

impl Support {
    /// From the matrix `sum -w' r n n^T/eps`.
    ///
    /// The top layer of a lattice has 1/2 at any tilt, since what lies opposite is missing, and the second a value that
    /// depends on the weight: the limit lies at two thirds of the way, as for number densities. A single layer has 0, a
    /// double one [`Calibration::next_layer`]: that limit lies at a half.
    pub fn of(moments: &Symmetric, sums: &Calibration) -> Self {
        let next = sums.next_layer;
        if eigenvalues_exceed(moments, (0.5 + next * 2.0 / 3.0) * sums.strain) {
            Self::Full
        } else if eigenvalues_exceed(moments, 0.5 * next * sums.strain) {
            Self::Partial
        } else {
            Self::Thin
        }
    }
}

/// Whether no neighbour within 2.1 spacings lies in the cone of 45 degrees around the direction away from them; `apart`
/// are their distance vectors.
///
/// The direction is that of their mean, with weights `1 - (r/2.1 l0)^2`: of small radii the weight of the scheme lets the
/// nearest neighbours alone decide, and a quarter of a disordered top layer is missed.
pub(crate) fn cone_is_empty(spacing: Real, apart: impl Iterator<Item = Vector> + Clone) -> bool {
    let towards = towards(spacing, apart.clone());
    let half = 0.5 * towards.length_squared();
    let mut apart = apart;
    !apart.any(|d| {
        let along = d.dot(towards);
        // cos^2 of the angle to the outward direction above 1/2.
        along < 0.0 && along * along > half * d.length_squared()
    })
}

/// Mean direction to the neighbours at the distance vectors `apart` \[m], with the weights of the cone.
pub(crate) fn towards(spacing: Real, apart: impl Iterator<Item = Vector>) -> Vector {
    let square = (CLOSE_RADIUS * spacing).powi(2);
    apart.fold(Vector::ZERO, |sum, d| {
        let r2 = d.length_squared();
        sum + ((1.0 - r2 / square).max(0.0) / r2.sqrt().max(COINCIDENT)) * d
    })
}

/// Thresholds of the test by number density and asymmetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceTest {
    /// Number density over n0 below which a particle may lie at the surface.
    pub density: Real,
    /// Asymmetry (length of the sum of weights times unit vectors, over n0) above which it then does.
    pub asymmetry: Real,
    /// Asymmetry above which it does at any number density: clustered neighbours on one side can compensate for missing
    /// ones on the other (`docs/decisions/0006-moving-particles.md`). Infinite where disordered fluid is as asymmetric.
    pub one_sided: Real,
}

impl SurfaceTest {
    /// Thresholds from the lattice sums of the weight in use.
    #[must_use]
    pub fn of(calibration: &Calibration) -> Self {
        let top = calibration.top_asymmetry;
        Self {
            density: calibration.surface_density(),
            asymmetry: calibration.surface_asymmetry(),
            one_sided: if top > STANDS_OUT { top } else { Real::INFINITY },
        }
    }

    /// Whether a particle of number density `density` and asymmetry vector `asymmetry`, both over n0, lies at the
    /// surface.
    #[must_use]
    pub fn is_surface(&self, density: Real, asymmetry: Vector) -> bool {
        let asymmetry = asymmetry.length();
        asymmetry > self.one_sided || density < self.density && (density < SPARSE || asymmetry > self.asymmetry)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moments;
    use crate::scheme::{Kernel, Scheme};
    use sazanami_numerics::Random;

    /// Number density and asymmetry over n0 at a place among particles of unit spacing.
    fn sums(kernel: &Kernel, at: Vector, particles: &[Vector]) -> (Real, Vector) {
        let weights = particles.iter().map(|&x| {
            let w = kernel.weight.value((x - at).length());
            (w, w * (x - at).normalize_or_zero())
        });
        let (density, asymmetry) = weights.fold((0.0, Vector::ZERO), |sum, w| (sum.0 + w.0, sum.1 + w.1));
        (density / kernel.sums.number_density, asymmetry / kernel.sums.number_density)
    }

    /// A lattice around the origin, `above` layers of it above, every particle moved by up to `jitter`.
    fn lattice(above: i32, jitter: Real) -> Vec<Vector> {
        let mut random = Random::new(11);
        let mut way = || jitter * random.between(-1.0, 1.0);
        let (wide, deep) = (-6..=6, -6..=above);
        let places = deep.flat_map(|k| wide.clone().flat_map(move |j| (-6..=6).map(move |i| [i, j, k])));
        places.map(|n| Vector::from_array(n.map(Real::from)) + Vector::new(way(), way(), way())).collect()
    }

    #[test]
    fn clustered_particles_at_the_edge_are_at_the_surface() {
        let kernel = Kernel::new(Scheme::published(), 1.0);
        let test = SurfaceTest::of(&kernel.sums);
        let mut water = lattice(0, 0.0);
        // Two more, half a spacing beside a particle of the top layer and a little below.
        water.extend([-0.5, 0.5].map(|x| Vector::new(x, 0.0, -0.2)));
        let (density, asymmetry) = sums(&kernel, Vector::ZERO, &water);
        assert!(density > test.density && test.is_surface(density, asymmetry), "{density} {asymmetry}");
        // What was missed without the rule.
        assert!(!SurfaceTest { one_sided: Real::INFINITY, ..test }.is_surface(density, asymmetry));
    }

    /// Radii from the smallest to the largest.
    fn kernels() -> impl Iterator<Item = Kernel> {
        let radii = [2.1, 2.35, 2.6, 2.85, 3.1, 3.35, 3.6];
        radii.into_iter().map(|radius| Kernel::new(Scheme { radius, ..Scheme::published() }, 1.0))
    }

    /// Whether eigenvalue and cone take a place among particles of unit spacing for surface.
    fn by_cone(kernel: &Kernel, at: Vector, particles: &[Vector]) -> bool {
        let apart = particles.iter().map(|&x| x - at).filter(|d| d.length() > 0.0);
        let mut moments = [0.0; 6];
        for d in apart.clone().filter(|d| d.length() < kernel.weight.radius) {
            moments::add(&mut moments, -kernel.weight.slope_over_distance(d.length()), d);
        }
        match Support::of(&moments, &kernel.sums) {
            Support::Full => false,
            Support::Thin => true,
            Support::Partial => cone_is_empty(1.0, apart.filter(|d| d.length() < CLOSE_RADIUS)),
        }
    }

    /// Share of the places of `water` near the origin for which `counts` holds that are taken for surface.
    fn share(water: &[Vector], counts: impl Fn(&Vector) -> bool, is_surface: impl Fn(Vector) -> bool) -> Real {
        let places: Vec<_> = water.iter().copied().filter(counts).collect();
        places.iter().filter(|&&x| is_surface(x)).count() as Real / places.len() as Real
    }

    #[test]
    fn cones_know_lattices_of_every_shape() {
        let whole = lattice(6, 0.0);
        let below = |normal: Vector, level: Real| -> Vec<Vector> {
            whole.iter().copied().filter(|x| x.dot(normal) < level + 1e-9).collect()
        };
        for kernel in kernels() {
            let name = format!("{:?}", kernel.weight);
            let surface = |at: Vector, water: &[Vector]| by_cone(&kernel, at, water);
            assert!(!surface(Vector::ZERO, &whole), "{name}: inside");
            // A flat surface, tilted ones, and the layer below.
            for normal in [Vector::Z, Vector::new(1.0, 0.0, 1.0), Vector::ONE, Vector::new(1.0, 0.0, 2.0)] {
                let water = below(normal, 0.0);
                assert!(surface(Vector::ZERO, &water), "{name}: {normal}");
                assert!(!surface(-normal, &water), "{name}: below {normal}");
            }
            // Edge and corner of a block; a sheet of one and of two layers, not the middle of three; a thread; a lone one.
            let cut = |keep: fn(&Vector) -> bool| whole.iter().copied().filter(keep).collect::<Vec<_>>();
            assert!(surface(Vector::ZERO, &cut(|x| x.x < 0.1 && x.z < 0.1)), "{name}: edge");
            assert!(surface(Vector::ZERO, &cut(|x| x.max_element() < 0.1)), "{name}: corner");
            assert!(surface(Vector::ZERO, &cut(|x| x.z == 0.0)), "{name}: sheet");
            assert!(surface(Vector::ZERO, &cut(|x| x.z.abs() < 0.1 || x.z == -1.0)), "{name}: two layers");
            assert!(!surface(Vector::ZERO, &cut(|x| x.z.abs() < 1.1)), "{name}: three layers");
            assert!(surface(Vector::ZERO, &cut(|x| x.x == 0.0 && x.y == 0.0)), "{name}: thread");
            assert!(surface(Vector::ZERO, &[]), "{name}: alone");
            // One particle missing is no surface; a hole of more is.
            for hole in [Vector::Z, Vector::new(0.0, 1.0, 1.0), Vector::ONE] {
                let water: Vec<_> = whole.iter().copied().filter(|&x| x != hole).collect();
                assert!(!surface(Vector::ZERO, &water), "{name}: {hole}");
            }
            let bubble: Vec<_> = whole.iter().copied().filter(|x| (x - Vector::Z * 2.0).length() > 1.9).collect();
            assert!(surface(Vector::ZERO, &bubble), "{name}: bubble");
            // Beside a wall that goes on above the surface.
            assert!(surface(Vector::ZERO, &cut(|x| x.z < 0.1 || x.x < -0.9)), "{name}: wall");
        }
    }

    #[test]
    fn cones_know_disordered_water() {
        // Places near the origin, which all other tests of a layer share.
        let near = |x: &Vector, z: Real| x.x.abs().max(x.y.abs()) < 3.3 && (x.z - z).abs() < 0.5;
        for kernel in kernels() {
            let name = format!("{:?}", kernel.weight);
            for (jitter, most) in [(0.1, 1.0), (0.2, 1.0), (0.3, 0.9)] {
                let (water, half) = (lattice(6, jitter), lattice(0, jitter));
                let surface = |x: Vector| by_cone(&kernel, x, &water);
                assert_eq!(share(&water, |x| x.abs().max_element() < 2.5, surface), 0.0, "{name}: inside");
                let surface = |x: Vector| by_cone(&kernel, x, &half);
                let [top, second] = [0.0, -1.0].map(|z| share(&half, |x| near(x, z), surface));
                assert!(top >= most && second <= 0.02, "{name} {jitter}: {top} {second}");
            }
        }
        // Negative control: number density and asymmetry of the smallest radius take water inside for surface.
        let kernel = Kernel::new(Scheme { radius: 2.1, ..Scheme::published() }, 1.0);
        let (test, water) = (SurfaceTest::of(&kernel.sums), lattice(6, 0.2));
        let by_density = |x: Vector| {
            let others: Vec<_> = water.iter().copied().filter(|&y| y != x).collect();
            let (density, asymmetry) = sums(&kernel, x, &others);
            test.is_surface(density + kernel.sums.number_density.recip(), asymmetry)
        };
        let wrong = share(&water, |x| x.abs().max_element() < 2.5, by_density);
        assert!(wrong > 0.05, "{wrong}");
    }

    #[test]
    fn disordered_fluid_is_less_asymmetric_than_a_surface() {
        for radius in [3.1, 3.6, 2.1] {
            let kernel = Kernel::new(Scheme { radius, ..Scheme::published() }, 1.0);
            let test = SurfaceTest::of(&kernel.sums);
            let water = lattice(6, 0.3);
            let inside = water.iter().filter(|x| x.abs().max_element() < 2.5);
            let largest = inside.map(|&x| sums(&kernel, x, &water).1.length()).fold(0.0, Real::max);
            assert!(largest < test.one_sided, "{radius}: {largest} {}", test.one_sided);
            // The top layer of a lattice would not do for small radii.
            assert!(radius > 2.5 || largest > kernel.sums.top_asymmetry, "{largest}");
        }
    }
}
