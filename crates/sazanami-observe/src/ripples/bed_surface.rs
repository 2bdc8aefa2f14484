//! The surface of the bed: height against x1.

use std::f64::consts::PI;

use sazanami_numerics::Real;

use super::section_density::SectionDensity;
use super::{GrainView, SurfaceProfile, TankInside};

/// Volume fraction of grains at the surface: half of the 0.60 of a loose bed of spheres.
const SURFACE_SHARE: Real = 0.30;
/// Distance of the places of the surface, and radius over which the volume of a grain is spread [grain sizes].
const SPACING: Real = 0.5;
const REACH: Real = 2.0;
/// A grain with fewer contacts than this may be suspended.
const FEWEST_CONTACTS: u32 = 2;
/// Height above the median surface from which on such a grain is suspended [mean diameters].
const SUSPENDED_ABOVE: Real = 2.0;

/// The surface of a bed of grains of size `grain_size` \[m], and for each grain whether it is suspended.
///
/// The surface is the highest place at which grains, averaged across the tank, take up 0.30 of the space. It counts every
/// grain across the tank and depends on no view, unlike an outline seen from the side or the tops of the uppermost grains.
/// A suspended grain has fewer than 2 contacts, and its centre is more than 2 mean diameters above the median of the
/// surface of all grains.
#[must_use]
pub fn bed_surface(tank: &TankInside, grains: &GrainView, grain_size: Real) -> (SurfaceProfile, Vec<bool>) {
    let middle = surface_of(tank, grains, grain_size, |_| true).median();
    let limit = middle.unwrap_or(Real::INFINITY) + SUSPENDED_ABOVE * grains.mean_diameter();
    let contacts = grains.contacts.iter().zip(grains.position);
    let suspended: Vec<bool> = contacts.map(|(&n, place)| n < FEWEST_CONTACTS && place.z > limit).collect();
    (surface_of(tank, grains, grain_size, |grain| !suspended[grain]), suspended)
}

fn surface_of(tank: &TankInside, grains: &GrainView, size: Real, counts: impl Fn(usize) -> bool) -> SurfaceProfile {
    let counted = (0..grains.position.len()).filter(|&grain| counts(grain));
    let volumes = counted.map(|grain| (grains.position[grain], PI / 6.0 * grains.diameter[grain].powi(3)));
    SectionDensity::of(tank, SPACING * size, REACH * size, volumes).surface(SURFACE_SHARE, 1)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::Sides;
    use super::super::made_up::{self, Lattice};
    use super::*;
    use sazanami_numerics::Vector;

    const D: Real = 1e-3;

    fn surface(tank: &TankInside, bed: &Lattice) -> SurfaceProfile {
        bed_surface(tank, &bed.grains(), D).0
    }

    /// Ripples of 20 mm and 3 mm height on a bed of 10 mm.
    fn ripples(x: Real) -> Real {
        0.010 + 1.5e-3 * (TAU * x / 0.020).sin()
    }

    #[test]
    fn the_surface_of_a_rippled_bed_is_found() {
        for sides in [Sides::Periodic, Sides::Walls] {
            let tank = made_up::tank(sides);
            let bed = Lattice::below(&tank, 0.95 * D, 0.60, ripples);
            let (found, suspended) = bed_surface(&tank, &bed.grains(), D);
            assert_eq!((suspended.contains(&true), found.len()), (false, 120));
            let inner = found.within([-0.027, 0.027]);
            let heights = inner.whole().expect("the bed has no gaps");
            let misfit = |n: usize| heights[n] - ripples(inner.x(n));
            let bias = (0..inner.len()).map(misfit).sum::<Real>() / inner.len() as Real;
            let scatter =
                ((0..inner.len()).map(|n| (misfit(n) - bias).powi(2)).sum::<Real>() / inner.len() as Real).sqrt();
            assert!(bias.abs() < 0.25 * D && scatter < 0.45 * D, "{sides:?}: {bias} {scatter}");
        }
    }

    #[test]
    fn the_share_of_a_fine_bed_falls_to_a_half_at_its_surface() {
        let tank = made_up::tank(Sides::Periodic);
        let fine = surface(&tank, &Lattice::below(&tank, 0.25 * D, 0.60, |_| 0.010));
        assert!(fine.points().all(|[_, z]| (z - 0.010).abs() < 0.02 * D), "{fine:?}");
        // Half as many grains are no bed at the same height: the control.
        let lower = surface(&tank, &Lattice::below(&tank, 0.25 * D, 0.32, |_| 0.010));
        assert!(lower.mean().expect("just a bed") < 0.0095);
    }

    #[test]
    fn grains_in_suspension_do_not_raise_the_surface() {
        let tank = made_up::tank(Sides::Periodic);
        let mut bed = Lattice::below(&tank, 0.95 * D, 0.60, |_| 0.010);
        let before = surface(&tank, &bed);
        for n in 0..40 {
            bed.add(Vector::new(0.0002, 0.0005 + 0.04 * D * f64::from(n), 0.0135 + 0.02 * D * f64::from(n)), 1, false);
        }
        let (with, suspended) = bed_surface(&tank, &bed.grains(), D);
        assert_eq!((suspended.iter().filter(|&&is| is).count(), &with), (40, &before));
        // The same grains at rest on each other belong to the bed.
        bed.contacts.fill(2);
        let (resting, suspended) = bed_surface(&tank, &bed.grains(), D);
        assert!(!suspended.contains(&true) && resting.at(0.0) > before.at(0.0).map(|z| z + D));
    }

    #[test]
    fn no_grains_no_surface() {
        let none = GrainView { position: &[], diameter: &[], contacts: &[] };
        let (surface, suspended) = bed_surface(&made_up::tank(Sides::Walls), &none, D);
        assert!(surface.median().is_none() && suspended.is_empty());
    }
}
