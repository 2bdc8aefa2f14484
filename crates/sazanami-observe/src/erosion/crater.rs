//! The crater as a spherical cap: Yagyu et al. (2015), eqs. (9)-(14).

use std::f64::consts::PI;

use sazanami_numerics::Real;

use super::{InitialBed, Profile};

/// Volume [m^3] of the cap from its rim radius, eq. (14): `V = (pi H/6)(3 L^2 + H^2)`; zero if it is no hollow.
#[must_use]
pub fn cap_volume(depth: Real, rim_radius: Real) -> Real {
    PI * depth.max(0.0) / 6.0 * (3.0 * rim_radius * rim_radius + depth * depth)
}

/// Crater found in a smoothed profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crater {
    /// Height at the axis: the innermost layer's, `b` \[m].
    pub base: Real,
    /// Number of the layer with the rim.
    pub rim_layer: usize,
    /// Distance of the rim from the axis, `L` \[m].
    pub rim_radius: Real,
    /// Height of the rim, `a` \[m].
    pub rim_height: Real,
    /// `H = a - b` \[m]; negative if the middle stands higher.
    pub depth: Real,
    /// Depth of the lowest layer within the rim below it \[m]: `H`, or more where grains lie heaped in the middle.
    pub greatest_depth: Real,
    /// Erosion volume by eq. (14) [m^3]: below the plane of the rim, so it counts the rim's height.
    pub volume: Real,
    /// Volume below the plane of the rim [m^3], without the assumption of a cap; what stands above it in the middle is left out.
    pub volume_direct: Real,
    /// The highest layer is the outermost one: the rim, if there is one, lies farther out.
    pub rim_at_edge: bool,
}

impl Crater {
    /// Reads the crater off a profile; `None` if fewer than two layers hold grains or the innermost does not.
    #[must_use]
    pub fn of(profile: &Profile) -> Option<Self> {
        Self::with_rim_beyond(profile, profile.layer, 0.0)
    }

    /// The same with the rim at a radius of `least` \[m] or more, about a heap that ends before the radius `moat` \[m].
    pub(super) fn with_rim_beyond(profile: &Profile, least: Real, moat: Real) -> Option<Self> {
        let base = profile.heights.first().copied().flatten()?;
        let mut rim = None;
        let inside = (0..profile.heights.len()).take_while(|&n| profile.radius(n) < least).count();
        for (n, height) in profile.heights.iter().enumerate().skip(inside) {
            if let Some(height) = *height
                && rim.is_none_or(|(_, highest)| height > highest)
            {
                rim = Some((n, height));
            }
        }
        let (rim_layer, rim_height) = rim?;
        let heights = profile.filled();
        let rim_radius = profile.radius(rim_layer);
        Some(Self {
            base,
            rim_layer,
            rim_radius,
            rim_height,
            depth: rim_height - base,
            greatest_depth: heights[..rim_layer]
                .iter()
                .fold(rim_height - base, |most, height| most.max(rim_height - height)),
            volume: cap_volume(rim_height - base, rim_radius),
            volume_direct: volume_to(profile, &heights, rim_layer, moat),
            rim_at_edge: profile.heights[rim_layer + 1..].iter().all(Option::is_none),
        })
    }
}

/// Volume [m^3] of a profile below the plane through its own height at a distance `radius` \[m] from the axis, out to there, about a heap
/// that ends before the radius `moat` \[m].
pub(super) fn volume_below(profile: &Profile, radius: Real, moat: Real) -> Real {
    let heights = profile.filled();
    let last = (0..heights.len()).rev().find(|&n| profile.radius(n) <= radius).unwrap_or_default();
    volume_to(profile, &heights, last, moat)
}

/// The same out to the layer `last`. Of a heap what stands above the plane is left out.
fn volume_to(profile: &Profile, heights: &[Real], last: usize, moat: Real) -> Real {
    let below = |n: usize| {
        let depth = heights[last] - heights[n];
        if profile.radius(n) < moat { depth.max(0.0) } else { depth }
    };
    (0..=last).map(|n| below(n) * profile.area(n)).sum()
}

/// Distance from the axis \[m] of the place where a surface lies deepest below the bed before the impact, if by `least` \[m] or more.
pub(super) fn dug_deepest(surface: &Profile, initial: &InitialBed, least: Real) -> Option<Real> {
    let heights = surface.filled();
    let dug = |n: usize| initial.heights[n] - heights[n];
    let deepest = (0..heights.len().min(initial.heights.len())).max_by(|&a, &b| dug(a).total_cmp(&dug(b)))?;
    (dug(deepest) >= least).then(|| surface.radius(deepest))
}

/// Volumes [m^3] of a profile below and above a reference profile: what was dug out and what was heaped up.
///
/// `reference` gives the height \[m] of each layer before the impact.
#[must_use]
pub fn volumes_against(profile: &Profile, reference: impl Fn(usize) -> Real) -> (Real, Real) {
    let mut volumes = (0.0, 0.0);
    for (n, height) in profile.filled().into_iter().enumerate() {
        let change = height - reference(n);
        volumes.0 += (-change).max(0.0) * profile.area(n);
        volumes.1 += change.max(0.0) * profile.area(n);
    }
    volumes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Worked example in millimetres; the formulas do not care.
    fn example() -> Profile {
        let heights = [6.20, 6.45, 7.05, 7.80, 8.35, 8.55, 8.40, 8.25, 8.18, 8.15, 8.16, 8.14];
        Profile { layer: 1.0, heights: heights.map(Some).to_vec() }
    }

    #[test]
    fn the_worked_example_is_met() {
        let crater = Crater::of(&example()).unwrap();
        assert_eq!((crater.rim_layer, crater.rim_radius, crater.rim_height, crater.base), (5, 5.5, 8.55, 6.2));
        assert!((crater.depth - 2.35).abs() < 1e-12 && crater.greatest_depth == crater.depth);
        assert!((crater.volume - 118.459).abs() < 5e-4, "{}", crater.volume);
        assert!((crater.volume_direct - 72.885).abs() < 5e-4, "{}", crater.volume_direct);
        assert!(!crater.rim_at_edge);
        assert!((volume_below(&example(), crater.rim_radius, 0.0) - crater.volume_direct).abs() < 1e-12);
        assert!(volume_below(&example(), crater.rim_radius - 1.0, 0.0) < crater.volume_direct);
        let (excavated, rim) = volumes_against(&example(), |_| 8.15);
        assert!((excavated - 47.846).abs() < 5e-4, "{excavated}");
        assert!((rim - 36.662).abs() < 5e-4, "{rim}");
    }

    #[test]
    fn the_sensitivities_of_the_worked_example_are_met() {
        let volume = cap_volume(2.35, 5.5);
        assert!((cap_volume(2.35, 6.0) / volume - 1.179).abs() < 5e-4);
        assert!((cap_volume(2.45, 5.5) / volume - 1.048).abs() < 5e-4);
    }

    #[test]
    fn a_hill_has_no_erosion_volume() {
        let hill = Profile { layer: 1.0, heights: [3.0, 2.0, 1.0].map(Some).to_vec() };
        let crater = Crater::of(&hill).unwrap();
        assert_eq!((crater.volume, crater.depth), (0.0, -1.0));
    }

    #[test]
    fn a_rim_outside_the_profile_is_reported() {
        let slope = Profile { layer: 1.0, heights: [1.0, 2.0, 3.0].map(Some).to_vec() };
        let crater = Crater::of(&slope).unwrap();
        assert!(crater.rim_at_edge);
        let empty_edge = Profile { layer: 1.0, heights: vec![Some(1.0), Some(3.0), Some(2.0), None] };
        assert!(!Crater::of(&empty_edge).unwrap().rim_at_edge);
        assert!(Crater::of(&Profile { layer: 1.0, heights: vec![None, Some(1.0)] }).is_none());
    }
}
