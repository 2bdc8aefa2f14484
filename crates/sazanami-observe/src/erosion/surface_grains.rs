//! Which grains make the surface of the bed: not those in the air, and only those seen from above.

use sazanami_numerics::{Real, Vector};

use super::{CountedGrains, ErosionSettings};
use crate::BedView;
use crate::height_map::HeightMap;

/// Highest node of a grain over its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GrainTop {
    /// Horizontal position of the centre of mass [m].
    pub x: Real,
    /// Horizontal position of the centre of mass [m].
    pub y: Real,
    /// Height of the highest node [m].
    pub height: Real,
}

/// Grains that count for the bed surface, and how many are in the air.
pub(super) struct SurfaceGrains {
    pub tops: Vec<GrainTop>,
    pub airborne: usize,
}

impl SurfaceGrains {
    pub fn of(bed: &BedView, settings: &ErosionSettings) -> Self {
        let bounds: Vec<_> = (0..bed.len()).map(|grain| bed.bounds_of(grain)).collect();
        let (airborne, map) = sort_out(bed, &bounds, settings);
        let counts = match settings.counted {
            CountedGrains::Surface => {
                map.pixels_seen(bed.len()).iter().map(|&n| n >= settings.exposed_pixels).collect()
            }
            CountedGrains::All => vec![true; bed.len()],
        };
        let tops = (0..bed.len())
            .filter(|&grain| counts[grain] && !airborne[grain])
            .map(|grain| GrainTop { x: bed.position[grain].x, y: bed.position[grain].y, height: bounds[grain].1.z })
            .collect();
        Self { tops, airborne: airborne.iter().filter(|&&flies| flies).count() }
    }
}

/// Tells the grains in the air from the bed, and maps the bed.
///
/// A grain is in the air if it belongs to a group of close grains that is not linked to the bed, or
/// moves fast without contact, or had no contact for a while and is clear of the bed below it.
fn sort_out(bed: &BedView, bounds: &[(Vector, Vector)], settings: &ErosionSettings) -> (Vec<bool>, HeightMap) {
    let linked = linked(bounds, settings.grain_size / 4.0);
    let mut map = HeightMap::new(settings.lower, settings.upper, settings.pixel);
    let mut airborne: Vec<bool> = linked.iter().map(|&linked| !linked).collect();
    let mut doubtful = Vec::new();
    // Before the first step no grain has had a contact: that says nothing about what lies where.
    let contacts_known = (0..bed.len()).any(|grain| bed.time_since_contact(grain).is_some_and(Real::is_finite));
    for (grain, flies) in airborne.iter_mut().enumerate() {
        let age = bed.time_since_contact(grain).filter(|_| contacts_known).unwrap_or(0.0);
        *flies |= age > settings.touching_within && bed.velocity[grain].length() > settings.airborne_speed;
        if !*flies && age > settings.airborne_after {
            doubtful.push(grain);
        } else if !*flies {
            map.add(bed, grain);
        }
    }
    // All are judged against the grains in contact, so that their order does not matter.
    for &grain in &doubtful {
        let (lower, upper) = bounds[grain];
        let bed_top = map.highest_within([lower.x, lower.y], [upper.x, upper.y]).unwrap_or(settings.floor);
        airborne[grain] = lower.z > bed_top + settings.grain_size;
    }
    doubtful.iter().filter(|&&grain| !airborne[grain]).for_each(|&grain| map.add(bed, grain));
    (airborne, map)
}

/// Which grains belong to the bed: the largest group of grains close to each other, within half a grain size.
pub(crate) fn linked_to_bed(bed: &BedView, grain_size: Real) -> Vec<bool> {
    let bounds: Vec<_> = (0..bed.len()).map(|grain| bed.bounds_of(grain)).collect();
    linked(&bounds, grain_size / 4.0)
}

/// Grains of the largest group linked by boxes that come closer than twice `margin` [m].
fn linked(bounds: &[(Vector, Vector)], margin: Real) -> Vec<bool> {
    let mut by_x: Vec<usize> = (0..bounds.len()).collect();
    by_x.sort_by(|&a, &b| bounds[a].0.x.total_cmp(&bounds[b].0.x).then(a.cmp(&b)));
    let mut group: Vec<usize> = (0..bounds.len()).collect();
    for (place, &a) in by_x.iter().enumerate() {
        let (lower, upper) = (bounds[a].0 - 2.0 * margin, bounds[a].1 + 2.0 * margin);
        for &b in by_x[place + 1..].iter().take_while(|&&b| bounds[b].0.x < upper.x) {
            if bounds[b].0.cmplt(upper).all() && bounds[b].1.cmpgt(lower).all() {
                let (a, b) = (root(&mut group, a), root(&mut group, b));
                group[a.max(b)] = a.min(b);
            }
        }
    }
    let roots: Vec<usize> = (0..bounds.len()).map(|grain| root(&mut group, grain)).collect();
    let mut size = vec![0_usize; bounds.len()];
    roots.iter().for_each(|&root| size[root] += 1);
    // The first of the largest groups.
    let bed = (0..size.len()).rev().max_by_key(|&root| size[root]);
    roots.iter().map(|&root| Some(root) == bed).collect()
}

fn root(group: &mut [usize], mut grain: usize) -> usize {
    while group[grain] != grain {
        group[grain] = group[group[grain]];
        grain = group[grain];
    }
    grain
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bed::test_bed::Bed;

    const D: Real = 0.5e-3;

    fn settings() -> ErosionSettings {
        ErosionSettings::recommended([-5e-3; 2], [5e-3; 2], 0.0, D)
    }

    /// Three layers of touching grains over 10 mm x 10 mm, top at 2 mm.
    fn flat() -> Bed {
        Bed::columns(D, 5e-3, 3, |_| 2e-3)
    }

    fn add(bed: &mut Bed, position: Vector, velocity: Vector, time_since_contact: Real) {
        let whole = Bed::new(D, bed.position.iter().copied().chain([position]).collect());
        let mut velocities = bed.velocity.clone();
        velocities.push(velocity);
        let mut times = bed.last_contact.clone().unwrap();
        times.push(1.0 - time_since_contact);
        *bed = whole;
        bed.velocity = velocities;
        bed.last_contact = Some(times);
    }

    fn airborne(bed: &Bed) -> usize {
        bed.view(|view| SurfaceGrains::of(view, &settings()).airborne)
    }

    #[test]
    fn only_the_top_layer_of_a_resting_bed_counts() {
        let bed = flat();
        bed.view(|view| {
            let surface = SurfaceGrains::of(view, &settings());
            assert_eq!((surface.tops.len(), surface.airborne), (400, 0));
            assert!(surface.tops.iter().all(|top| (top.height - 2e-3).abs() < 1e-15));
            let all = SurfaceGrains::of(view, &ErosionSettings { counted: CountedGrains::All, ..settings() });
            assert_eq!(all.tops.len(), 1200);
        });
    }

    #[test]
    fn a_slow_grain_just_above_the_bed_belongs_to_it() {
        let mut bed = flat();
        add(&mut bed, Vector::new(0.0, 0.0, 2e-3 + 0.6 * D), Vector::new(0.0, 0.0, 0.04), 2e-3);
        assert_eq!(airborne(&bed), 0);
    }

    #[test]
    fn grains_in_the_air_do_not_count() {
        let up = Vector::new(0.0, 0.0, 1.0);
        for (height, velocity, time) in [
            (2e-3 + 0.6 * D, 0.06 * up, 1e-4), // fast, just left
            (2e-3 + 4.0 * D, 0.01 * up, 5e-3), // slow at the top of its path
            (2e-3 + 9.0 * D, 1.0 * up, 0.0),   // touches another grain in the air: not linked
        ] {
            let mut bed = flat();
            add(&mut bed, Vector::new(1e-3, 0.0, height), velocity, time);
            assert_eq!(airborne(&bed), 1, "{height} {velocity} {time}");
            if time == 0.0 {
                add(&mut bed, Vector::new(1e-3 + D, 0.0, height), velocity, time);
                assert_eq!(airborne(&bed), 2);
            }
        }
    }

    #[test]
    fn without_contacts_only_links_decide() {
        let mut bed = flat();
        add(&mut bed, Vector::new(0.0, 0.0, 4e-3), Vector::ZERO, 0.0);
        for unknown in [None, Some(vec![Real::NEG_INFINITY; bed.position.len()])] {
            bed.last_contact = unknown;
            assert_eq!(airborne(&bed), 1);
        }
    }
}
