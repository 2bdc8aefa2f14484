//! The weight function, Wendland C2, and the lattice sums that normalise every operator.
//!
//! The weight is 1 at the centre and has the support `r_e`. Each operator is normalised by its own sum over a cubic
//! lattice, not by the number density, so that it is exact there for quadratic fields.

use sazanami_numerics::Real;

/// Lower bound of distances that sums divide by, for coincident particles [m or m^2].
pub(crate) const COINCIDENT: Real = 1e-100;

/// The weight `(1 - q)^4 (1 + 4 q)`, `q = r/r_e` (Wendland 1995, Adv. Comput. Math. 4, 389, C2), with its radius of influence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weight {
    /// Radius of influence r_e \[m].
    pub radius: Real,
}

impl Weight {
    /// `q = r/r_e` and `max(1 - q, 0)`.
    #[inline(always)]
    fn normalised(&self, r: Real) -> (Real, Real) {
        let q = r * self.radius.recip();
        (q, (1.0 - q).max(0.0))
    }

    /// `w(r)`; 1 at the centre, 0 from the radius on.
    #[inline(always)]
    #[must_use]
    pub fn value(&self, r: Real) -> Real {
        let (q, p) = self.normalised(r);
        let p2 = p * p;
        p2 * p2 * (1.0 + 4.0 * q)
    }

    /// `w'(r)` [1/m].
    #[inline(always)]
    #[must_use]
    pub fn slope(&self, r: Real) -> Real {
        self.slope_over_distance(r) * r
    }

    /// `w'(r)/r`, finite at the centre [1/m^2].
    #[inline(always)]
    #[must_use]
    pub fn slope_over_distance(&self, r: Real) -> Real {
        let (_, p) = self.normalised(r);
        let scale = (self.radius * self.radius).recip();
        let p2 = p * p;
        -20.0 * scale * (p2 * p)
    }

    /// `w''(r)` [1/m^2]; negative near the centre.
    #[inline(always)]
    #[must_use]
    pub fn curvature(&self, r: Real) -> Real {
        let (q, p) = self.normalised(r);
        let scale = (self.radius * self.radius).recip();
        let p2 = p * p;
        -20.0 * scale * p2 * (1.0 - 4.0 * q)
    }

    /// Coefficient of a pair at distance `r` in a Laplacian before normalisation, the second derivative of the weight
    /// where it is positive (HL, Khayyer & Gotoh 2010, in three dimensions), and whether it was negative and set to zero.
    #[inline(always)]
    #[must_use]
    pub fn laplacian(&self, r: Real) -> (Real, bool) {
        let f = self.curvature(r);
        (f.max(0.0), f < 0.0)
    }
}

/// Sums of a weight function over a cubic lattice, which normalise the operators.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Reference number density n0 of an interior particle, itself included.
    pub number_density: Real,
    /// n0 without the particle itself.
    pub others: Real,
    /// First-moment sum N1 = sum (-w') r / 3: converts a change of the number density into a volume strain.
    pub strain: Real,
    /// Sum of `-w'/r` over N1: the diagonal of a compact Laplacian with full support [1/m^2].
    pub support: Real,
    /// Second-moment sum N2 = sum f r^2 / 6 of the Laplacian.
    pub laplacian: Real,
    /// Number density of the top layer under a flat surface over n0.
    pub top_layer: Real,
    /// Number density of the layer below it over n0.
    pub second_layer: Real,
    /// Asymmetry of the top layer: length of the sum of `w` times unit vectors, over n0.
    pub top_asymmetry: Real,
    /// First-moment sum across a layer one spacing away, over N1: the smallest eigenvalue of the moment matrix is 0 in a
    /// single layer, this in a double one, 1/2 in the top layer of many, and 1/2 more than this in the second.
    pub next_layer: Real,
    /// Number of neighbours of an interior particle.
    pub neighbours: usize,
}

impl Calibration {
    /// Sums for lattice spacing `spacing` \[m].
    #[must_use]
    pub fn new(weight: &Weight, spacing: Real) -> Self {
        let reach = (weight.radius / spacing).ceil() as i32;
        let range = -reach..=reach;
        let mut sums = [0.0; 4];
        let mut neighbours = 0;
        // Layers above a particle in the top and second layer are missing.
        let mut layers = [1.0, 1.0];
        let (mut up, mut next) = (0.0, 0.0);
        for k in range.clone() {
            for j in range.clone() {
                for i in range.clone().filter(|&i| (i, j, k) != (0, 0, 0)) {
                    let r = spacing * Real::from(i * i + j * j + k * k).sqrt();
                    let w = weight.value(r);
                    if w <= 0.0 {
                        continue;
                    }
                    neighbours += 1;
                    sums[0] += w;
                    sums[1] -= weight.slope(r) * r / 3.0;
                    sums[2] += weight.laplacian(r).0 * r * r / 6.0;
                    sums[3] -= weight.slope_over_distance(r);
                    if k == 1 {
                        next -= weight.slope_over_distance(r) * spacing * spacing;
                    }
                    if k <= 0 {
                        layers[0] += w;
                        up += w * Real::from(-k) * spacing / r;
                    }
                    if k <= 1 {
                        layers[1] += w;
                    }
                }
            }
        }
        let number_density = 1.0 + sums[0];
        Self {
            number_density,
            others: sums[0],
            strain: sums[1],
            support: sums[3] / sums[1],
            laplacian: sums[2],
            top_layer: layers[0] / number_density,
            second_layer: layers[1] / number_density,
            top_asymmetry: up / number_density,
            next_layer: next / sums[1],
            neighbours,
        }
    }

    /// Number density over n0 below which a particle may lie at a surface: two thirds of the way from the top
    /// layer of a lattice to the second (0.90 for C2 and r_e = 3.1 spacings).
    #[must_use]
    pub fn surface_density(&self) -> Real {
        self.top_layer + (self.second_layer - self.top_layer) * 2.0 / 3.0
    }

    /// Asymmetry over n0 above which such a particle does lie at the surface: about half that of the top layer.
    #[must_use]
    pub fn surface_asymmetry(&self) -> Real {
        0.53 * self.top_asymmetry
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_value() {
        let weight = Weight { radius: 2.3 };
        for r in [0.1, 0.5, 1.1, 1.9, 2.2] {
            let h = 1e-5;
            let slope = (weight.value(r + h) - weight.value(r - h)) / (2.0 * h);
            let curvature = (weight.slope(r + h) - weight.slope(r - h)) / (2.0 * h);
            assert!((slope - weight.slope(r)).abs() < 1e-9, "{r}");
            assert!((curvature - weight.curvature(r)).abs() < 1e-8, "{r}");
        }
    }

    #[test]
    fn lattice_sums_are_the_known_ones() {
        // Radius, neighbours, n0, n0 without itself, N1, N2 without cutting, top and second layer.
        let known = [
            (2.1, 32, 2.849, 1.849, 2.766, 5.799, 0.859, 1.000),
            (2.6, 80, 5.309, 4.309, 5.148, 10.489, 0.789, 0.996),
            (3.1, 122, 8.940, 7.940, 8.922, 17.770, 0.742, 0.979),
            (3.5, 178, 12.849, 11.849, 12.796, 25.635, 0.714, 0.960),
        ];
        for (radius, neighbours, n0, others, n1, n2, top, second) in known {
            let sums = Calibration::new(&Weight { radius }, 1.0);
            assert_eq!(sums.neighbours, neighbours);
            let pairs = [
                (sums.number_density, n0),
                (sums.others, others),
                (sums.strain, n1),
                (sums.laplacian, n2),
                (sums.top_layer, top),
                (sums.second_layer, second),
            ];
            for (found, expected) in pairs {
                assert!((found - expected).abs() < 6e-4, "{radius}: {found} {expected}");
            }
        }
        let sums = Calibration::new(&Weight { radius: 3.1 }, 1.0);
        assert!((sums.surface_density() - 0.90).abs() < 1e-3 && (sums.top_asymmetry - 0.190).abs() < 1e-3);
        // Negative control: normalised by the number density the Laplacian would be twice as large.
        assert!((sums.laplacian / sums.number_density - 1.99).abs() < 5e-3);
    }
}
