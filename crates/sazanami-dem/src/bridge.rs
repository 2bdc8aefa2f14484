//! Liquid bridges between wet grains.
//!
//! A bridge forms where two grains touch and holds until their gap `S` passes
//!
//! ```text
//! S_c = (1 + theta/2) V^(1/3)
//! ```
//!
//! (Lian, Thornton and Adams 1993, J. Colloid Interface Sci. 161, 138). It pulls them together with (Willett, Adams, Johnson and Seville
//! 2000, Langmuir 16, 9396, appendix)
//!
//! ```text
//! F = 2 pi R sigma exp(f_1 - f_2 exp(f_3 ln S+ + f_4 ln^2 S+)),    S+ = S/(2 (V/R)^(1/2)),    R = 2 R_1 R_2/(R_1 + R_2)
//! ```
//!
//! `f_1` to `f_4` being polynomials in the contact angle and `ln V/R^3`. `R_1` and `R_2` are the radii of balls of the grains' volumes: a
//! grain of another shape is pulled as that ball, at the gap of its nearest contact spheres and through them. The volume of a bridge stays
//! as it is, `V/R^3` the same for all: with six bridges a grain, as in beds, they hold the liquid content `w` of the volume of the grains,
//! `V = (4 pi/9) w R^3`. What they are made of lies on the grains when they are apart, where it does nothing. Grains that touch are pulled as
//! at no gap. The viscous force of the bridge is left out, and walls are dry. What is about the grains may leave a part of the pull alone
//! ([`crate::Grains::moisture`]).

use std::f64::consts::PI;

use sazanami_numerics::Real;

/// Liquid contents for which the fit was made (`V/R^3` of 1.4e-4 to 0.1).
const CONTENTS: [Real; 2] = [1e-4, 0.07];
/// Largest contact angle for which it was made \[rad].
const LARGEST_ANGLE: Real = 50.0 * PI / 180.0;
/// Gap over that of [`Bridge::stretch`] 1 below which the force is that of none.
const CLOSED: Real = 1e-6;

/// Moisture below which a grain is dry: what little spray leaves holds nothing.
const DRY: Real = 0.01;

/// Places and weights of Gauss and Legendre's rule of five points on -1 to 1.
const GAUSS: [(Real, Real); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189),
    (-0.538_469_310_105_683, 0.478_628_670_499_366),
    (0.0, 0.568_888_888_888_889),
    (0.538_469_310_105_683, 0.478_628_670_499_366),
    (0.906_179_845_938_664, 0.236_926_885_056_189),
];

/// Liquid bridges of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge {
    surface_tension: Real,
    /// `V/R^3`.
    volume: Real,
    /// Gap over `R` at which it breaks.
    longest: Real,
    f: [Real; 4],
    content: Real,
    damp: bool,
}

impl Bridge {
    /// Bridges of a liquid with a surface tension [N/m], a contact angle \[rad] and a content by the volume of the grains; `None` outside what
    /// the fit was made for: contents of 1e-4 to 0.07, angles up to 50 degrees.
    #[must_use]
    pub fn new(surface_tension: Real, contact_angle: Real, content: Real) -> Option<Self> {
        let fits = surface_tension >= 0.0
            && surface_tension.is_finite()
            && (0.0..=LARGEST_ANGLE * (1.0 + 1e-9)).contains(&contact_angle)
            && (CONTENTS[0]..=CONTENTS[1]).contains(&content);
        let volume = 4.0 * PI / 9.0 * content;
        fits.then(|| Self {
            surface_tension,
            volume,
            longest: (1.0 + 0.5 * contact_angle) * volume.cbrt(),
            f: coefficients(contact_angle, volume.ln()),
            content,
            damp: true,
        })
    }

    /// The same between grains that are damp when the run begins, or that are dry until a coupled solver brings liquid to them.
    #[must_use]
    pub fn of_damp_grains(self, damp: bool) -> Self {
        Self { damp, ..self }
    }

    /// Part of their bridges that grains have liquid for, `wetted` being the largest part of the pores about them that has been liquid: pores
    /// of beds hold two thirds of the volume of the grains or more, here all of it.
    #[must_use]
    pub fn supplied(&self, wetted: Real) -> Real {
        if self.damp { 1.0 } else { (wetted / self.content).min(1.0) }
    }

    /// Volume of a bridge between grains of these `radii` \[m] [m^3].
    #[must_use]
    pub fn volume(&self, radii: [Real; 2]) -> Real {
        self.volume * mean(radii).powi(3)
    }

    /// Gap at which it breaks \[m].
    #[must_use]
    pub fn rupture(&self, radii: [Real; 2]) -> Real {
        self.longest * mean(radii)
    }

    /// Its pull \[N].
    #[inline]
    #[must_use]
    pub fn force(&self, gap: Real, radii: [Real; 2]) -> Real {
        let radius = mean(radii);
        2.0 * PI * radius * self.surface_tension * self.part(gap / radius)
    }

    /// Work against the pull from no gap to this one \[J]; negative where balls overlap.
    #[must_use]
    pub fn energy(&self, gap: Real, radii: [Real; 2]) -> Real {
        let radius = mean(radii);
        let unit = 2.0 * PI * radius * radius * self.surface_tension;
        let gap = gap / radius;
        if gap <= 0.0 {
            return unit * gap * self.part(0.0);
        }
        // In the root of the gap the force is smooth.
        let half = 0.5 * gap.sqrt();
        unit * GAUSS
            .iter()
            .map(|(x, w)| (half * (1.0 + x), w))
            .map(|(u, w)| w * half * 2.0 * u * self.part(u * u))
            .sum::<Real>()
    }

    /// How far from its surface a grain of this `radius` may be held, beside another that reaches as far as its own asks: no bridge is longer
    /// than the two together, `R` being no more than the mean of both radii \[m].
    pub(crate) fn margin(&self, radius: Real) -> Real {
        0.5 * self.longest * radius
    }

    /// Pull over `2 pi R sigma` at a gap over `R`.
    #[inline]
    fn part(&self, gap: Real) -> Real {
        let [f1, f2, f3, f4] = self.f;
        let stretch = 0.5 * gap / self.volume.sqrt();
        if stretch <= CLOSED {
            return f1.exp();
        }
        let log = stretch.ln();
        (f1 - f2 * (log * (f3 + f4 * log)).exp()).exp()
    }
}

/// Part of the pull of its bridge that what is about a pair leaves, from the moisture of its grains.
#[inline]
pub(crate) fn moisture_of_pair([a, b]: [Real; 2]) -> Real {
    let least = a.min(b);
    if least < DRY { 0.0 } else { least }
}

/// Radius of the equal balls that stand for two of these radii.
#[inline]
fn mean([a, b]: [Real; 2]) -> Real {
    2.0 * a * b / (a + b)
}

/// `f_1` to `f_4` of Willett et al. (2000) at a contact angle \[rad] and `ln V/R^3`.
fn coefficients(t: Real, l: Real) -> [Real; 4] {
    let in_angle = |[a, b, c]: [Real; 3]| a + t * (b + t * c);
    let sum = |terms: &[[Real; 3]]| terms.iter().rev().fold(0.0, |sum, term| sum * l + in_angle(*term));
    [
        sum(&[
            [-0.44507, 0.050832, -1.1466],
            [-0.1119, -0.000411, -0.1490],
            [-0.012101, -0.0036456, -0.01255],
            [-0.0005, -0.0003505, -0.00029076],
        ]),
        sum(&[[1.9222, -0.57473, -1.2918], [-0.0668, -0.1201, -0.22574], [-0.0013375, -0.0068988, -0.01137]]),
        sum(&[
            [1.268, -0.01396, -0.23566],
            [0.198, 0.092, -0.06418],
            [0.02232, 0.02238, -0.009853],
            [0.0008585, 0.001318, -0.00053],
        ]),
        sum(&[[-0.010703, 0.073776, -0.34742], [0.03345, 0.04543, -0.09056], [0.0018574, 0.004456, -0.006257]]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADII: [Real; 2] = [2e-3; 2];

    fn bridge(angle: Real, content: Real) -> Bridge {
        Bridge::new(0.0728, angle.to_radians(), content).unwrap()
    }

    #[test]
    fn the_pull_is_near_the_short_formula_where_that_holds() {
        // F = 2 pi R sigma cos(theta)/(1 + 1.05 s + 2.5 s^2), s = S (R/V)^(1/2), for V/R^3 up to 1e-3 (Willett et al. 2000).
        for angle in [0.0, 20.0, 40.0] {
            for content in [1e-4, 7e-4] {
                let bridge = bridge(angle, content);
                for part in [0.0, 0.05, 0.2, 0.5] {
                    let gap = part * bridge.rupture(RADII);
                    let s = gap * (RADII[0] / bridge.volume(RADII)).sqrt();
                    let unit = 2.0 * PI * RADII[0] * 0.0728;
                    let short = angle.to_radians().cos() / (1.0 + 1.05 * s + 2.5 * s * s);
                    let found = bridge.force(gap, RADII) / unit;
                    assert!((found - short).abs() < 0.1, "{angle} {content} {part}: {found} {short}");
                }
            }
        }
        // Negative control: far from it for the largest contents.
        let wet = bridge(40.0, 0.07);
        assert!((wet.force(0.0, RADII) / (2.0 * PI * RADII[0] * 0.0728) - 40.0_f64.to_radians().cos()).abs() > 0.2);
    }

    #[test]
    fn unequal_balls_are_pulled_as_equal_ones_of_their_mean() {
        let bridge = bridge(10.0, 0.01);
        let unequal = [1e-3, 3e-3];
        assert!((bridge.force(1e-4, unequal) / bridge.force(1e-4, [1.5e-3; 2]) - 1.0).abs() < 1e-14);
        assert!(bridge.rupture(unequal) <= unequal.iter().map(|r| bridge.margin(*r)).sum());
    }

    #[test]
    fn the_energy_is_the_work_of_the_pull() {
        let bridge = bridge(20.0, 0.01);
        let longest = bridge.rupture(RADII);
        for part in [0.01, 0.3, 1.0] {
            let steps = 20_000;
            let step = part * longest / f64::from(steps);
            let work: Real = (0..steps).map(|n| bridge.force((f64::from(n) + 0.5) * step, RADII) * step).sum();
            let found = bridge.energy(part * longest, RADII);
            assert!((found / work - 1.0).abs() < 2e-3, "{part}: {found} {work}");
        }
        assert!((bridge.energy(-1e-6, RADII) + 1e-6 * bridge.force(0.0, RADII)).abs() < 1e-18);
    }

    #[test]
    fn grains_have_the_bridges_that_there_was_liquid_for() {
        let dry = bridge(0.0, 0.02).of_damp_grains(false);
        assert_eq!([0.0, 0.005, 0.02, 1.0].map(|wetted| dry.supplied(wetted)), [0.0, 0.25, 1.0, 1.0]);
        assert_eq!(bridge(0.0, 0.02).supplied(0.0), 1.0);
    }

    #[test]
    fn what_the_fit_was_not_made_for_is_refused() {
        for (sigma, angle, content) in
            [(-1.0, 0.0, 0.01), (0.07, 51.0, 0.01), (0.07, -1.0, 0.01), (0.07, 0.0, 0.08), (0.07, 0.0, 1e-5)]
        {
            assert!(Bridge::new(sigma, Real::to_radians(angle), content).is_none(), "{sigma} {angle} {content}");
        }
        assert!(Bridge::new(0.07, 50.0_f64.to_radians(), 0.07).is_some());
    }
}
