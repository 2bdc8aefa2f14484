//! Lubrication: the liquid between two spheres, or a sphere and a wall, that is squeezed out before they touch.
//!
//! Across a gap `h` the film resists the rate `v_n` at which the spheres part or approach with
//!
//! ```text
//! F = -6 pi mu R*^2 v_n (1/max(h, eta) - 1/h_0)     0 < h < h_0,    R* = R_1 R_2/(R_1 + R_2), at a wall R
//! ```
//!
//! (Brenner 1961, Cox 1974): the leading term at small gaps, bounded at the roughness `eta` of the surfaces, where asperities
//! meet, and made continuous at the outer cut-off `h_0`, from which on the drag law has what the liquid does (Kempe & Froehlich
//! 2012, Izard, Bonometti & Lacaze 2014). Once the spheres touch, the contact law alone acts, and the film not.
//!
//! A fast grain crosses the film within few sub-steps. The force of a sub-step is therefore the mean over the gaps that the
//! spheres pass through in it at their present rate, an integral with a closed form: the momentum that the film takes is right
//! for any number of sub-steps within it, as long as a grain does not pass the whole film in one.

use std::f64::consts::PI;

use sazanami_numerics::Real;

/// The liquid film between spheres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Dynamic viscosity `mu` of the liquid [Pa s].
    pub viscosity: Real,
    /// Height `eta` of the roughness at which the force stops growing \[m].
    pub roughness: Real,
    /// Outer cut-off `h_0` over the smaller radius.
    pub reach: Real,
    /// Largest outer cut-off \[m]: where a grid resolves the liquid the film has the part that its cells do not.
    pub farthest: Real,
    /// Whether it asks for sub-steps a tenth as long as contacts at least, and its damping of a pair is cut to what a sub-step bears; else
    /// sub-steps are as short as all of it needs.
    pub bounded: bool,
}

/// Longest sub-step times the rate `D/m*` at which a film brings a ball to rest at a wall, at the roughness. A grain among twelve
/// equal ones is stable up to twice this.
pub(crate) const FILM_FACTOR: Real = 0.15;
/// Change of the gap in a sub-step, over the roughness, below which the force is that of its middle.
const SMALL: Real = 1e-4;
/// Change of the gap over the gap up to which a series of the logarithm has all digits.
const SLOW: Real = 0.05;

impl Film {
    /// Outer cut-off of a film whose smaller sphere has this `radius` \[m].
    #[must_use]
    pub fn outer(&self, radius: Real) -> Real {
        (self.reach * radius).min(self.farthest)
    }

    /// Largest damping coefficient over the square of the effective radius, at the roughness [N s/m^3].
    pub(crate) fn largest_damping(&self) -> Real {
        6.0 * PI * self.viscosity / self.roughness
    }

    /// Damping coefficient of spheres of these `radii` \[m] at a gap \[m] that changes by `change` in the sub-step about it, the
    /// mean over those gaps [N s/m].
    #[inline]
    pub(crate) fn damping(&self, gap: Real, change: Real, radii: [Real; 2]) -> Real {
        let [a, b] = radii;
        let outer = self.outer(a.min(b)).max(self.roughness);
        let half = 0.5 * change.abs();
        if gap - half >= outer || gap + half <= 0.0 {
            return 0.0;
        }
        let effective = a * b / (a + b);
        let mean = if change.abs() <= SLOW * gap && gap - half >= self.roughness && gap + half <= outer {
            // ln((1 + x)/(1 - x))/(2 x), x half the change over the gap.
            let square = (half / gap).powi(2);
            (1.0 + square * (1.0 / 3.0 + square * (0.2 + square / 7.0))) / gap - 1.0 / outer
        } else if change.abs() > SMALL * self.roughness {
            (self.integral(gap + 0.5 * change, outer) - self.integral(gap - 0.5 * change, outer)) / change
        } else if gap > 0.0 && gap < outer {
            1.0 / gap.max(self.roughness) - 1.0 / outer
        } else {
            0.0
        };
        6.0 * PI * self.viscosity * effective * effective * mean
    }

    /// Integral of `1/max(h, eta) - 1/h_0` from 0 to a gap, which is cut to the film.
    fn integral(&self, gap: Real, outer: Real) -> Real {
        let h = gap.min(outer).max(0.0);
        let over = h / self.roughness;
        (if over > 1.0 { 1.0 + over.ln() } else { over }) - h / outer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILM: Film = Film { viscosity: 1e-3, roughness: 1e-6, reach: 0.1, farthest: Real::INFINITY, bounded: false };
    const RADII: [Real; 2] = [1e-3, 2e-3];

    #[test]
    fn the_force_is_that_of_brenner_and_cox_within_its_cut_offs() {
        let full = 6.0 * PI * 1e-3 * (2e-3_f64 / 3.0).powi(2);
        for (gap, expected) in [(1e-5, 1e5 - 1e4), (2e-7, 1e6 - 1e4), (1e-4, 0.0), (2e-4, 0.0), (-1e-9, 0.0)] {
            let found = FILM.damping(gap, 0.0, RADII) / full;
            assert!((found - expected).abs() <= 1e-9 * 1e6, "{gap}: {found}");
        }
        // A cut-off nearer than the reach is that of the film.
        let near = Film { farthest: 2e-5, ..FILM };
        assert!((near.damping(1e-5, 0.0, RADII) / full - 5e4).abs() < 1e-3);
        assert_eq!(near.damping(3e-5, 0.0, RADII), 0.0);
        // At a wall the effective radius is that of the sphere: for equal spheres half.
        let [wall, equal] = [1e9, 1e-3].map(|other| FILM.damping(1e-5, 0.0, [1e-3, other]));
        assert!((wall / equal - 4.0).abs() < 1e-9, "{}", wall / equal);
    }

    #[test]
    fn what_a_passage_takes_does_not_depend_on_its_steps() {
        // Sum of damping times way from beyond the film into the contact: ln(h_0/eta) at once and in many steps.
        let whole = |steps: usize| -> Real {
            let step = 1.2e-4 / steps as Real;
            (0..steps).map(|n| FILM.damping(1.1e-4 - (n as Real + 0.5) * step, -step, RADII) * step).sum()
        };
        let expected = 6.0 * PI * 1e-3 * (2e-3_f64 / 3.0).powi(2) * 100.0_f64.ln();
        for steps in [1, 7, 1000] {
            assert!((whole(steps) / expected - 1.0).abs() < 1e-9, "{steps}: {}", whole(steps) / expected);
        }
        // Negative control: the force at the middle of seven steps misses most of it.
        let step = 1.2e-4 / 7.0;
        let middle: Real = (0..7).map(|n| FILM.damping(1.1e-4 - (f64::from(n) + 0.5) * step, 0.0, RADII) * step).sum();
        assert!(middle < 0.7 * expected, "{}", middle / expected);
    }
}
