//! Share of space that grains or water take up, averaged across the tank, on a grid in the section x1, x3.

use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use super::{Sides, SurfaceProfile, TankInside};

/// A share of space at the points of a square grid: the middles of equal parts of the tank in x1, and heights from
/// the floor on in x3.
pub(super) struct SectionDensity {
    range: [Real; 2],
    floor: Real,
    columns: usize,
    spacing: [Real; 2],
    rows: usize,
    share: Vec<Real>,
}

impl SectionDensity {
    /// Sum of the volumes [m^3] of the particles, each spread over a disc of `radius` \[m] in the section by the
    /// Wendland C2 function of unit integral in two dimensions, `7/(pi R^2) (1-q)^4 (1+4q)` (Wendland 1995), and over
    /// the whole width. What reaches through end walls or the floor comes back as from a mirror, what reaches through
    /// joined ends at the other one. For periodic sides and for walls alike, nothing leaves across.
    pub fn of(tank: &TankInside, spacing: Real, radius: Real, particles: impl Iterator<Item = (Vector, Real)>) -> Self {
        let particles: Vec<_> = particles.collect();
        let top = particles.iter().map(|(place, _)| place.z).fold(tank.floor, Real::max) + radius;
        let columns = ((tank.length() / spacing).round() as usize).max(1);
        let rows = ((top - tank.floor) / spacing).ceil() as usize + 2;
        let spacing = [tank.length() / columns as Real, spacing];
        let share = vec![0.0; columns * rows];
        let mut density = Self { range: tank.x, floor: tank.floor, columns, spacing, rows, share };
        let scale = 7.0 / (PI * radius * radius * tank.width());
        for (place, volume) in particles {
            let images = |x: Real, mirror: Real| [Some(x), ((x - mirror).abs() < radius).then_some(2.0 * mirror - x)];
            let [own, mut lower] = images(place.x, tank.x[0]);
            let [_, mut upper] = images(place.x, tank.x[1]);
            if tank.ends == Sides::Periodic {
                (lower, upper) = (lower.map(|_| place.x + tank.length()), upper.map(|_| place.x - tank.length()));
            }
            for x in [own, lower, upper].into_iter().flatten() {
                for z in images(place.z, tank.floor).into_iter().flatten() {
                    density.spread([x, z], radius, volume * scale);
                }
            }
        }
        density
    }

    fn spread(&mut self, [x, z]: [Real; 2], radius: Real, amount: Real) {
        let column = |x: Real| (x - self.range[0]) / self.spacing[0] - 0.5;
        let row = |z: Real| (z - self.floor) / self.spacing[1];
        // Casts of negative numbers give zero.
        let columns =
            column(x - radius).ceil() as usize..((column(x + radius).floor() + 1.0) as usize).min(self.columns);
        let rows = row(z - radius).ceil() as usize..((row(z + radius).floor() + 1.0) as usize).min(self.rows);
        for i in columns {
            let dx = self.range[0] + (i as Real + 0.5) * self.spacing[0] - x;
            for k in rows.clone() {
                let dz = self.floor + k as Real * self.spacing[1] - z;
                let q = dx.hypot(dz) / radius;
                if q < 1.0 {
                    self.share[i * self.rows + k] += amount * (1.0 - q).powi(4) * (1.0 + 4.0 * q);
                }
            }
        }
    }

    /// Highest place at which the share falls to `level` upwards, where it reaches `level` at the `deep` points below,
    /// linear between points.
    pub fn surface(&self, level: Real, deep: usize) -> SurfaceProfile {
        SurfaceProfile::of_parts(self.range, self.columns, |i| {
            let share = &self.share[i * self.rows..][..self.rows];
            let is_deep = |k: usize| (0..deep).all(|n| k < n || share[k - n] >= level);
            let k = (0..self.rows - 1).rev().find(|&k| share[k + 1] < level && is_deep(k))?;
            let part = (share[k] - level) / (share[k] - share[k + 1]);
            Some(self.floor + (k as Real + part) * self.spacing[1])
        })
    }

    /// Integral of the share over the section times the width [m^3], for the test of what is kept.
    #[cfg(test)]
    fn volume(&self, width: Real) -> Real {
        let rows = |i: usize| &self.share[i * self.rows..][..self.rows];
        // The floor halves the cells of the lowest points.
        let column = |i: usize| 0.5 * rows(i)[0] + rows(i)[1..].iter().sum::<Real>();
        (0..self.columns).map(column).sum::<Real>() * self.spacing[0] * self.spacing[1] * width
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Sides, made_up};
    use super::*;

    #[test]
    fn no_volume_is_lost_at_walls_and_floor() {
        let tank = made_up::tank(Sides::Walls);
        let places = [[-0.0299, 0.0002], [0.0297, 0.004], [0.001, 0.0001], [0.01, 0.01]];
        let particles = || places.iter().map(|&[x, z]| (Vector::new(x, 0.001, z), 2e-9));
        let density = SectionDensity::of(&tank, 0.1e-3, 2e-3, particles());
        assert!((density.volume(tank.width()) / 8e-9 - 1.0).abs() < 1e-3, "{}", density.volume(tank.width()));
        // Without the mirrors a part of three of them would be gone: the same box, its walls out of reach.
        let wide = TankInside { x: [-0.1, 0.1], floor: -0.1, ..tank };
        let density = SectionDensity::of(&wide, 0.1e-3, 2e-3, particles());
        let inside: Real = (0..density.columns)
            .filter(|&i| (density.range[0] + (i as Real + 0.5) * density.spacing[0]).abs() < 0.03)
            .map(|i| density.share[i * density.rows..][..density.rows].iter().skip(1000).sum::<Real>())
            .sum();
        let inside = inside * density.spacing[0] * density.spacing[1] * tank.width();
        assert!(inside < 0.8 * 8e-9, "{inside}");
    }

    #[test]
    fn a_lone_share_above_the_surface_counts_only_if_it_is_deep() {
        let mut density = SectionDensity {
            range: [0.0, 1.0],
            floor: 0.0,
            columns: 1,
            spacing: [1.0, 0.5],
            rows: 6,
            share: vec![1.0, 1.0, 0.0, 0.6, 0.0, 0.0],
        };
        assert_eq!(density.surface(0.5, 1).heights, [Some(1.5 + 0.5 / 6.0)]);
        assert_eq!(density.surface(0.5, 2).heights, [Some(0.75)]);
        density.share.fill(0.1);
        assert_eq!(density.surface(0.5, 1).heights, [None]);
    }
}
