//! The surface of the bed, seen from the side, in three definitions.

use std::f64::consts::PI;

use sazanami_numerics::Real;
use sazanami_numerics::choices;

use super::exposed::exposed;
use super::profile::median;
use super::section_density::SectionDensity;
use super::{GrainView, SurfaceProfile, Tank};

/// Share of grains at the surface: half of the 0.60 of a loose bed of spheres.
const SURFACE_SHARE: Real = 0.30;
/// A grain with fewer contacts than this may be suspended.
const FEWEST_CONTACTS: u32 = 2;
/// Height above the median surface from which on such a grain is suspended [mean diameters].
const SUSPENDED_ABOVE: Real = 2.0;

choices! {
    /// Side from which the tank is looked at.
    #[derive(Default)]
    pub enum ViewedSide {
        /// The side of the smaller x2.
        #[default]
        Lower = "x2_lower",
        /// The side of the larger x2.
        Upper = "x2_upper",
    }
}

/// Lengths in the three definitions of the bed surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BedSurfaceSettings {
    /// Distance of the places of the concentration surface \[m].
    pub spacing: Real,
    /// Radius over which the volume of a grain is spread for the concentration \[m].
    pub reach: Real,
    /// Width of the parts of x1 of the two other definitions \[m].
    pub part: Real,
    /// Thickness of the slab behind the side that is looked at \[m].
    pub slab: Real,
    /// Side that is looked at.
    pub side: ViewedSide,
}

impl BedSurfaceSettings {
    /// The usual lengths for grains of diameter `grain_size` \[m]: places half a diameter apart, reach and slab two
    /// diameters, parts one diameter.
    #[must_use]
    pub fn of_grains(grain_size: Real) -> Self {
        let side = ViewedSide::default();
        Self { spacing: 0.5 * grain_size, reach: 2.0 * grain_size, part: grain_size, slab: 2.0 * grain_size, side }
    }
}

/// The surface of the bed in three definitions, none of which counts suspended grains ([`suspended`]).
#[derive(Clone, Debug, PartialEq)]
pub struct BedSurfaces {
    /// Highest place at which grains, averaged across the tank, take up 0.30 of the space: the main definition.
    pub concentration: SurfaceProfile,
    /// Highest grain tops in a slab behind one side, a median over three parts of x1: to be held against photographs.
    pub image: SurfaceProfile,
    /// Mean of the tops of the grains of which at least half is seen from above.
    pub top_layer: SurfaceProfile,
    /// Number of suspended grains.
    pub suspended: usize,
}

impl BedSurfaces {
    /// Finds the surface of a bed.
    #[must_use]
    pub fn of(tank: &Tank, grains: &GrainView, settings: &BedSurfaceSettings) -> Self {
        let suspended = suspended(tank, grains, settings);
        let rests = |grain: usize| !suspended[grain];
        Self {
            concentration: by_concentration(tank, grains, settings, rests),
            image: from_the_side(tank, grains, settings, rests),
            top_layer: from_above(tank, grains, settings, rests),
            suspended: suspended.iter().filter(|&&is| is).count(),
        }
    }
}

/// For each grain whether it is suspended: fewer than 2 contacts, and its centre more than 2 mean diameters above the
/// median of the concentration surface of all grains.
#[must_use]
pub fn suspended(tank: &Tank, grains: &GrainView, settings: &BedSurfaceSettings) -> Vec<bool> {
    let middle = by_concentration(tank, grains, settings, |_| true).median();
    let limit = middle.unwrap_or(Real::INFINITY) + SUSPENDED_ABOVE * grains.mean_diameter();
    let contacts = grains.contacts.iter();
    contacts.zip(grains.position).map(|(&n, place)| n < FEWEST_CONTACTS && place.z > limit).collect()
}

fn by_concentration(
    tank: &Tank,
    grains: &GrainView,
    settings: &BedSurfaceSettings,
    counts: impl Fn(usize) -> bool,
) -> SurfaceProfile {
    let counted = (0..grains.position.len()).filter(|&grain| counts(grain));
    let volumes = counted.map(|grain| (grains.position[grain], PI / 6.0 * grains.diameter[grain].powi(3)));
    SectionDensity::of(tank, settings.spacing, settings.reach, volumes).surface(SURFACE_SHARE, 1)
}

/// Part of x1 that each grain let through by `counts` belongs to, among `parts`.
fn sorted_into_parts(
    tank: &Tank,
    grains: &GrainView,
    parts: usize,
    counts: impl Fn(usize) -> bool,
) -> Vec<(usize, usize)> {
    let width = tank.length() / parts as Real;
    let part = |grain: usize| (((grains.position[grain].x - tank.x[0]) / width) as usize).min(parts - 1);
    (0..grains.position.len()).filter(|&grain| counts(grain)).map(|grain| (part(grain), grain)).collect()
}

fn parts(tank: &Tank, settings: &BedSurfaceSettings) -> usize {
    ((tank.length() / settings.part).round() as usize).max(1)
}

fn from_the_side(
    tank: &Tank,
    grains: &GrainView,
    settings: &BedSurfaceSettings,
    counts: impl Fn(usize) -> bool,
) -> SurfaceProfile {
    let parts = parts(tank, settings);
    let in_slab = |grain: usize| {
        let y = tank.across(grains.position[grain].y);
        match settings.side {
            ViewedSide::Lower => y < tank.y[0] + settings.slab,
            ViewedSide::Upper => y >= tank.y[1] - settings.slab,
        }
    };
    let mut tops = vec![None; parts];
    for (part, grain) in sorted_into_parts(tank, grains, parts, |grain| counts(grain) && in_slab(grain)) {
        let top = grains.top_of(grain);
        tops[part] = Some(tops[part].map_or(top, |highest: Real| highest.max(top)));
    }
    SurfaceProfile::of_parts(tank.x, parts, |part| {
        let near = part.saturating_sub(1)..(part + 2).min(parts);
        tops[part].and_then(|_| median(tops[near].iter().filter_map(|&top| top).collect()))
    })
}

fn from_above(
    tank: &Tank,
    grains: &GrainView,
    settings: &BedSurfaceSettings,
    counts: impl Fn(usize) -> bool,
) -> SurfaceProfile {
    let parts = parts(tank, settings);
    let is_seen = exposed(tank, grains, &counts);
    let mut sums = vec![(0.0, 0_u32); parts];
    for (part, grain) in sorted_into_parts(tank, grains, parts, |grain| is_seen[grain]) {
        sums[part].0 += grains.top_of(grain);
        sums[part].1 += 1;
    }
    SurfaceProfile::of_parts(tank.x, parts, |part| (sums[part].1 > 0).then(|| sums[part].0 / Real::from(sums[part].1)))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::Sides;
    use super::super::made_up::{self, Lattice};
    use super::*;
    use sazanami_numerics::Vector;

    const D: Real = 1e-3;

    fn settings() -> BedSurfaceSettings {
        BedSurfaceSettings::of_grains(D)
    }

    /// Ripples of 20 mm and 3 mm height on a bed of 10 mm.
    fn ripples(x: Real) -> Real {
        0.010 + 1.5e-3 * (TAU * x / 0.020).sin()
    }

    #[test]
    fn all_definitions_find_the_surface_of_a_rippled_bed() {
        for sides in [Sides::Periodic, Sides::Walls] {
            let tank = made_up::tank(sides);
            let bed = Lattice::below(&tank, 0.95 * D, 0.60, ripples);
            let found = BedSurfaces::of(&tank, &bed.grains(), &settings());
            assert_eq!((found.suspended, found.concentration.len(), found.image.len()), (0, 120, 60));
            for (name, surface) in [("share", &found.concentration), ("image", &found.image), ("top", &found.top_layer)]
            {
                let inner = surface.within([-0.027, 0.027]);
                let heights = inner.whole().expect("the bed has no gaps");
                let misfit = |n: usize| heights[n] - ripples(inner.x(n));
                let bias = (0..inner.len()).map(misfit).sum::<Real>() / inner.len() as Real;
                let scatter =
                    ((0..inner.len()).map(|n| (misfit(n) - bias).powi(2)).sum::<Real>() / inner.len() as Real).sqrt();
                assert!(bias.abs() < 0.25 * D && scatter < 0.45 * D, "{name} {sides:?}: {bias} {scatter}");
            }
        }
    }

    #[test]
    fn the_share_of_a_fine_bed_falls_to_a_half_at_its_surface() {
        let tank = made_up::tank(Sides::Periodic);
        let bed = Lattice::below(&tank, 0.25 * D, 0.60, |_| 0.010);
        let fine = by_concentration(&tank, &bed.grains(), &settings(), |_| true);
        assert!(fine.points().all(|[_, z]| (z - 0.010).abs() < 0.02 * D), "{fine:?}");
        // Half as many grains are no bed at the same height: the control.
        let loose = Lattice::below(&tank, 0.25 * D, 0.32, |_| 0.010);
        let lower = by_concentration(&tank, &loose.grains(), &settings(), |_| true);
        assert!(lower.mean().expect("just a bed") < 0.0095);
    }

    #[test]
    fn grains_in_suspension_do_not_raise_the_surface() {
        let tank = made_up::tank(Sides::Periodic);
        let mut bed = Lattice::below(&tank, 0.95 * D, 0.60, |_| 0.010);
        let before = BedSurfaces::of(&tank, &bed.grains(), &settings());
        for n in 0..40 {
            bed.add(Vector::new(0.0002, 0.0005 + 0.04 * D * f64::from(n), 0.0135 + 0.02 * D * f64::from(n)), 1, false);
        }
        let with = BedSurfaces::of(&tank, &bed.grains(), &settings());
        assert_eq!(with.suspended, 40);
        assert_eq!(
            (&with.concentration, &with.image, &with.top_layer),
            (&before.concentration, &before.image, &before.top_layer)
        );
        // The same grains at rest on each other belong to the bed.
        bed.contacts.fill(2);
        let resting = BedSurfaces::of(&tank, &bed.grains(), &settings());
        assert_eq!(resting.suspended, 0);
        assert!(resting.concentration.at(0.0) > before.concentration.at(0.0).map(|z| z + D));
    }

    #[test]
    fn the_image_sees_one_side_only() {
        for sides in [Sides::Periodic, Sides::Walls] {
            let tank = made_up::tank(sides);
            let mut bed = Lattice::below(&tank, 0.95 * D, 0.60, |_| 0.010);
            let flat = BedSurfaces::of(&tank, &bed.grains(), &settings());
            for n in 0..7 {
                bed.add(Vector::new(D * f64::from(n), 0.0075, 0.0105), 3, false);
            }
            let lower = BedSurfaces::of(&tank, &bed.grains(), &settings());
            let upper_side = BedSurfaceSettings { side: ViewedSide::Upper, ..settings() };
            let upper = BedSurfaces::of(&tank, &bed.grains(), &upper_side);
            assert_eq!(lower.image, flat.image);
            assert!(upper.image.at(0.0035) > flat.image.at(0.0035).map(|z| z + 0.5 * D));
        }
    }

    #[test]
    fn no_grains_no_surface() {
        let tank = made_up::tank(Sides::Walls);
        let none = GrainView { position: &[], diameter: &[], contacts: &[] };
        let found = BedSurfaces::of(&tank, &none, &settings());
        assert!(found.concentration.median().is_none() && found.image.mean().is_none());
        assert!(found.top_layer.points().next().is_none());
    }
}
