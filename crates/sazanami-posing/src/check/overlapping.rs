//! Liquids that are put in one place: later ones take that of earlier ones.

use sazanami_numerics::geometry::Region;
use sazanami_numerics::{Real, Vector};

use super::number;
use super::volumes::{bed_top, volume_within};
use crate::assembly::fluid::origin_of;
use crate::case::amounts;
use crate::case::meaning::{Case, LiquidRegion, Placement};
use crate::case::{Diagnostics, LoadedCase};

/// Places along each edge of the box round a liquid at which others are looked for: the part that they take is then known to
/// about a thousandth.
const PLACES: usize = 48;

/// Part of the volume of each liquid that later liquids and bubbles take; those above the bed where a bed of its grains reaches, about.
pub(crate) fn taken(case: &Case) -> Vec<Real> {
    taken_beside(case, bed_top(case, &[]))
}

/// The same beside a `bed` of this height \[m].
pub(super) fn taken_beside(case: &Case, bed: Real) -> Vec<Real> {
    let regions: Vec<_> = regions(case, bed).into_iter().map(|(region, _)| (region, false)).collect();
    (0..regions.len()).map(|n| part(case, &regions, n, |_| true)).collect()
}

/// Warns of a liquid of which another of the same fluid takes a part: it is not there twice.
pub(crate) fn warn_of_overlap(loaded: &LoadedCase, report: &mut Diagnostics) {
    let case = &loaded.case;
    let regions = regions(case, 0.0);
    for (n, liquid) in case.liquids.iter().enumerate() {
        let alike = |later: usize| case.liquids[later].fluid == liquid.fluid;
        let part = part(case, &regions, n, alike);
        let first = (n + 1..regions.len()).find(|&later| alike(later) && meet(case, &regions, n, later).is_some());
        let (Some(later), true) = (first, part > 0.0) else { continue };
        let volume = volume_within(case, liquid).map_or(String::new(), |volume| {
            format!("{} of its {}, ", amounts::volume(part * volume), amounts::volume(volume))
        });
        let other = &case.liquids[later].name;
        report
            .warning(
                loaded.places.near(&format!("liquid.{later}.region")),
                format!("`{other}` lies where `{}` is", liquid.name),
            )
            .label(format!("{volume}{} %, are counted once, with the velocity of `{other}`", number(1e2 * part, 1)))
            .help("move one of the two, or leave it so: a later liquid takes the place of an earlier one");
    }
}

/// A liquid where it is put beside a `bed` of this height \[m], and whether that is counted from the bed.
fn regions(case: &Case, bed: Real) -> Vec<(Region, bool)> {
    let placed = |liquid: &LiquidRegion| {
        let above = matches!(liquid.placement, Placement::AboveBed { .. });
        (case.region_of(liquid, origin_of(liquid, case.bed.axis, bed)).geometry(), above)
    };
    case.liquids.iter().map(placed).collect()
}

/// Corners of the part of the box round liquid `a` in which `b` may lie \[m]; `None` where they are apart, or where only the
/// bed will tell.
fn meet(case: &Case, regions: &[(Region, bool)], a: usize, b: usize) -> Option<[Vector; 2]> {
    let ((first, of_bed), (second, of_bed_too)) = (&regions[a], &regions[b]);
    let ((low, high), (from, to)) = (first.bounds(), second.bounds());
    let (lower, upper) = (low.max(from), high.min(to));
    let (lower, upper) =
        if *of_bed { (lower, upper) } else { (lower.max(case.domain.lower), upper.min(case.domain.upper)) };
    (of_bed == of_bed_too && lower.cmplt(upper).all() && (upper - lower).is_finite()).then_some([lower, upper])
}

/// Part of the volume of liquid `n` that those later ones take that `count`.
fn part(case: &Case, regions: &[(Region, bool)], n: usize, count: impl Fn(usize) -> bool) -> Real {
    let others: Vec<usize> =
        (n + 1..regions.len()).filter(|&later| count(later) && meet(case, regions, n, later).is_some()).collect();
    let Some([lower, upper]) = meet(case, regions, n, n).filter(|_| !others.is_empty()) else { return 0.0 };
    let edge = (upper - lower) / PLACES as Real;
    let at = |place: usize| {
        let [i, j, k] = [place % PLACES, place / PLACES % PLACES, place / (PLACES * PLACES)];
        lower + edge * Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real + 0.5)
    };
    let (mut inside, mut taken) = (0_usize, 0_usize);
    for x in (0..PLACES.pow(3)).map(at).filter(|x| regions[n].0.contains(*x)) {
        inside += 1;
        taken += usize::from(others.iter().any(|&other| regions[other].0.contains(x)));
    }
    taken as Real / inside.max(1) as Real
}
