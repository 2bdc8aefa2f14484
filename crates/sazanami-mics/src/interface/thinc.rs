//! Liquid in a slab of a cell from a hyperbolic-tangent profile: no geometry, a smeared interface.
//!
//! Along the sweep the liquid fraction in the cell is `(1 + s tanh(b (x - x0))) / 2` with the sign
//! `s` of its gradient; `x0` follows from the mean (Xiao, Honma and Kono 2005).

use sazanami_numerics::Real;

use super::{Neighbourhood, youngs_normal};

/// Below this fraction (or above one less this) the profile is not resolved in rounded numbers.
const PURE: Real = 1e-8;

/// Yokoi (2007), J. Comput. Phys. 226: profile along the sweep and uniform liquid, weighted by the
/// components of the normal.
pub(super) fn weighted(cells: &Neighbourhood, direction: usize, courant: Real) -> Real {
    let uniform = cells[13] * courant;
    let Some(m) = youngs_normal(cells) else { return uniform };
    let weight = m[direction].abs();
    weight * profile(cells[13], -m[direction].signum(), 3.5, courant) + (1.0 - weight) * uniform
}

/// Integral of the profile over the slab of width `|courant|` at the upper end of the cell (lower
/// if `courant` is negative), signed like `courant`.
fn profile(c: Real, sign: Real, b: Real, courant: Real) -> Real {
    if !(PURE..=1.0 - PURE).contains(&c) {
        return c * courant;
    }
    // Mirrored such that the liquid lies at the upper end of the cell.
    let at_upper_end = (courant > 0.0) == (sign > 0.0);
    let q = (b * (2.0 * c - 1.0)).exp();
    let (up, down) = (b.exp(), (-b).exp());
    // tanh profile of mean c: exp(2 b x0) = (up - q) / (q - down).
    let middle = ((up - q) / (q - down)).ln() / (2.0 * b);
    let logarithm = |x: Real| {
        let y = (b * (x - middle)).abs();
        y + (-2.0 * y).exp().ln_1p()
    };
    let width = courant.abs();
    let (from, to) = if at_upper_end { (1.0 - width, 1.0) } else { (0.0, width) };
    let liquid = 0.5 * (width + (logarithm(to) - logarithm(from)) / b);
    courant.signum() * liquid.clamp(0.0, width.min(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slabs_of_a_profile_add_up_to_its_mean() {
        for c in [1e-6, 0.1, 0.5, 0.97] {
            for sign in [-1.0, 1.0] {
                for b in [0.01, 1.3, 3.5] {
                    let sum = profile(c, sign, b, 0.4) - profile(c, sign, b, -0.6);
                    assert!((sum - c).abs() < 1e-10, "{c} {sign} {b}: {sum}");
                }
            }
        }
        assert!(profile(0.5, 1.0, 3.5, 0.3) > 0.26, "liquid at the upper end leaves there");
        assert!(profile(0.5, -1.0, 3.5, 0.3) < 0.04);
    }
}
