//! Erosion volume of a crater with its uncertainty: Yagyu et al. (2015), section 3.(1)b and eqs. (9)-(14).
//!
//! The bed seen from above is averaged along circles about the impact axis, and smoothed along the radius by local parabolas
//! (W. S. Cleveland, J. Am. Stat. Assoc. 74, 1979, 829, with Gaussian weights). Its height at the axis is the bottom of the cap, its
//! highest place the rim: between them lies the volume below the plane of the rim, and the spherical cap through both is
//! the erosion volume of eq. (14). The rim radius enters squared, so a volume is worth little without its uncertainty: it is
//! evaluated for three bandwidths and for the rim half a bandwidth nearer and farther, and beside it stands the
//! volume that the same evaluation finds in the bed before the impact.
//!
//! The paper averages the tops of the surface grains over square cells and these over circular layers, one of which is the rim
//! ([`Erosion::by_layers`]). Of eight copies of a case, turned and mirrored, its V jumps with the layer
//! (`docs/decisions/0031-rim-of-a-crater.md`).

mod crater;
mod profile;
mod rest;
mod roundness;
mod settings;
mod surface_grains;

use sazanami_numerics::Real;

pub use crater::{Crater, cap_volume, volumes_against};
pub use profile::Profile;
pub use rest::{CraterCourse, Rest, RestError, VolumeCourse};
pub use roundness::Roundness;
pub use settings::{CountedGrains, ErosionError, ErosionSettings};
pub(crate) use surface_grains::linked_to_bed;

use crate::{BedView, Ground};
use profile::Rings;
use surface_grains::SurfaceGrains;

/// Other bandwidths of the uncertainty, relative to that.
const SMOOTHINGS: [Real; 2] = [0.7, 1.4];

/// Part of a grain by which the deepest place has to be dug out for a heap within it to be none of the rim.
const DUG: Real = 0.5;

/// A volume is that of a crater if it is so many times that of the same bed before the impact.
const CLEAR_OF_NOISE: Real = 3.0;

/// A volume that is uncertain by more than this part of it is doubted.
const LARGEST_BAR: Real = 0.2;

/// Doubt about a rim that lies at the end of the surface that is looked at.
pub const RIM_AT_EDGE: &str = "the rim lies at the edge of the box or at `erosion.r_max`";

/// Doubt about a rim that is no whole ring.
pub const RIM_CUT: &str = "sides of the box cut the rim: it is measured where it lies within";

/// Doubt about a crater that still changes.
pub const NOT_AT_REST: &str = "the crater has not come to rest";

/// Doubt about a crater of whose rest a run says nothing.
pub const REST_UNKNOWN: &str = "whether the crater has come to rest is not known";

/// What speaks against the volume of a hollow that is the roughness of the bed ([`is_crater`]).
pub const NO_CRATER: &str = "no crater: no hollow deeper than a grain and clear of the roughness of the bed";

/// Doubt about the cap of a crater whose lowest ring is not the middle.
pub const HEAPED: &str = "grains lie heaped on the axis: depth and cap are not those of the crater";

/// What is known of a crater beside its surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Known {
    /// Whether it has come to rest, if that is known.
    pub at_rest: Option<bool>,
    /// Number of drops that make it.
    pub drops: usize,
}

/// Volumes that tell a crater from the roughness of a bed [m^3].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hollow {
    /// Erosion volume.
    pub volume: Real,
    /// That of the same bed before the impact.
    pub noise: Real,
    /// Volume below the surface before the impact; zero if that is not known.
    pub excavated: Real,
}

/// Whether a hollow of a greatest depth and a rim radius \[m] is a crater in a bed of grains of a size \[m]: deeper than a grain, and either of three times the
/// volume that the bed before the impact had, or dug out by more than a cap one grain deep within its rim. Less is the roughness of the bed.
#[must_use]
pub fn is_crater(greatest_depth: Real, rim_radius: Real, grain_size: Real, hollow: Hollow) -> bool {
    let Hollow { volume, noise, excavated } = hollow;
    greatest_depth > grain_size && (volume > CLEAR_OF_NOISE * noise || excavated > cap_volume(grain_size, rim_radius))
}

/// The bed before the impact.
#[derive(Clone, Debug, PartialEq)]
pub struct InitialBed {
    /// Height of each thin layer \[m], empty ones filled.
    pub heights: Vec<Real>,
    /// Erosion volume that the evaluation finds where nothing was eroded: its noise floor [m^3].
    pub noise: Real,
    /// Volume below the plane of the rim that it finds there [m^3].
    pub noise_below_rim: Real,
}

impl InitialBed {
    /// Mean height of the surface \[m]: of the layers by their areas.
    #[must_use]
    pub fn level(&self) -> Real {
        let area = |n: usize| (2 * n + 1) as Real;
        let sum: Real = self.heights.iter().enumerate().map(|(n, height)| area(n) * height).sum();
        sum / (self.heights.len() * self.heights.len()) as Real
    }
}

/// Result of an evaluation.
#[derive(Clone, Debug, PartialEq)]
pub struct Erosion {
    /// Grain size of the bed, the short axis \[m].
    pub grain_size: Real,
    /// Smooth bed surface, in thin layers.
    pub surface: Profile,
    /// Crater found in it.
    pub crater: Crater,
    /// Whether the rim reaches over sides of the box.
    pub rim_cut: bool,
    /// Whether it is round about the axis.
    pub roundness: Roundness,
    /// Smallest and largest volume over three bandwidths and with the rim half a bandwidth nearer and farther [m^3].
    pub volume_range: [Real; 2],
    /// The same of the volume below the plane of the rim [m^3].
    pub below_rim_range: [Real; 2],
    /// Bed surface in the layers of the paper.
    pub profile: Profile,
    /// Crater found in these; `None` where the innermost holds no grain.
    pub by_layers: Option<Crater>,
    /// Volume dug out below the initial surface [m^3]; `None` without an initial bed.
    pub volume_excavated: Option<Real>,
    /// Volume heaped up above the initial surface [m^3]; `None` without an initial bed.
    pub volume_rim: Option<Real>,
    /// Volume found in the bed before the impact [m^3]; `None` without an initial bed.
    pub noise: Option<Real>,
    /// Volume below the plane of the rim in the bed before the impact [m^3]; `None` without an initial bed.
    pub noise_below_rim: Option<Real>,
    /// Depth of the middle below the initial surface there \[m]; `None` without an initial bed.
    pub depth_below_initial: Option<Real>,
    /// Number of grains whose tops were averaged.
    pub surface_grains: usize,
    /// Number of grains in the air, left out.
    pub airborne_grains: usize,
    /// Their volume [m^3].
    pub airborne_volume: Real,
}

impl Erosion {
    /// Evaluates the crater in a bed, against the bed before the impact if it is known.
    ///
    /// # Errors
    /// [`ErosionError`] if the settings make no sense or the bed does not reach the axis.
    pub fn of(bed: &BedView, settings: &ErosionSettings, initial: Option<&InitialBed>) -> Result<Self, ErosionError> {
        settings.check()?;
        if bed.is_empty() {
            return Err(ErosionError::NoSurface);
        }
        let ground = settings.ground();
        let Ground { lower, upper, .. } = ground.about(settings.axis);
        let about = ErosionSettings { lower, upper, periodic: [false; 2], ..*settings };
        ground.seen_from(settings.axis, bed, |bed| Self::about_axis(bed, &about, initial))
    }

    /// The same of a bed that does not repeat.
    fn about_axis(
        bed: &BedView,
        settings: &ErosionSettings,
        initial: Option<&InitialBed>,
    ) -> Result<Self, ErosionError> {
        let seen = SurfaceGrains::of(bed, settings);
        let rings = Rings::of(&seen.map, settings.axis, settings.largest_radius + settings.layer);
        let surface_with = |bandwidth| Profile::smooth(&rings, bandwidth, settings.largest_radius);
        let bandwidth = settings.bandwidth();
        let surface = surface_with(bandwidth);
        // A rim nearer than a layer is a grain, one within the place that is dug out deepest a heap that stands in the crater.
        let plain = Crater::with_rim_beyond(&surface, settings.layer, 0.0).ok_or(ErosionError::NoSurface)?;
        let deepest = initial.and_then(|initial| crater::dug_deepest(&surface, initial, DUG * settings.grain_size));
        let beyond = |surface: &Profile, moat: Real| Crater::with_rim_beyond(surface, settings.layer.max(moat), moat);
        // A parabola on one side may bend before the end.
        let is_at_edge =
            |crater: &Crater| crater.rim_at_edge || crater.rim_radius > settings.largest_radius - 0.5 * bandwidth;
        // A ditch has a rim of its own; what falls off to the edge has none.
        let has_rim = |moat: &Real| {
            let ditch = beyond(&surface, *moat).filter(|crater| !is_at_edge(crater));
            ditch.is_some_and(|crater| crater.greatest_depth >= DUG * settings.grain_size)
        };
        let moat = deepest.filter(|deepest| *deepest > plain.rim_radius).filter(has_rim).unwrap_or_default();
        let crater_of = |surface: &Profile| beyond(surface, moat);
        let mut crater = crater_of(&surface).unwrap_or(plain);
        crater.rim_at_edge = is_at_edge(&crater);
        let &ErosionSettings { axis, lower, upper, .. } = settings;
        let rim_cut = (0..2).any(|d| crater.rim_radius > (axis[d] - lower[d]).min(upper[d] - axis[d]));
        let smoothings: Vec<Crater> =
            SMOOTHINGS.into_iter().filter_map(|n| crater_of(&surface_with(n * bandwidth))).collect();
        let rims = [-0.5, 0.5].map(|n| crater.rim_radius + n * bandwidth);
        let range = |volume: fn(&Crater) -> Real, with_rims: [Real; 2]| {
            let others = smoothings.iter().map(volume).chain(with_rims);
            others.fold([volume(&crater); 2], |[low, high], volume| [low.min(volume), high.max(volume)])
        };
        let volume_range = range(|crater| crater.volume, rims.map(|rim| cap_volume(crater.depth, rim)));
        let below_rim_range =
            range(|crater| crater.volume_direct, rims.map(|rim| crater::volume_below(&surface, rim, moat)));
        let profile = Profile::of(&seen.tops, settings.axis, settings.cell, settings.layer, settings.largest_radius);
        let against = initial
            .map(|initial| volumes_against(&surface, |n| initial.heights.get(n).copied().unwrap_or(settings.floor)));
        Ok(Self {
            crater,
            rim_cut,
            roundness: Roundness::of(&seen.map, axis, &crater),
            grain_size: settings.grain_size,
            volume_range,
            below_rim_range,
            by_layers: Crater::of(&profile),
            volume_excavated: against.map(|(excavated, _)| excavated),
            volume_rim: against.map(|(_, rim)| rim),
            noise: initial.map(|initial| initial.noise),
            noise_below_rim: initial.map(|initial| initial.noise_below_rim),
            depth_below_initial: initial.and_then(|initial| initial.heights.first().map(|first| first - crater.base)),
            surface_grains: seen.tops.len(),
            airborne_grains: seen.airborne,
            airborne_volume: seen.airborne_volume,
            surface,
            profile,
        })
    }

    /// This evaluation as the bed before an impact, for later ones.
    #[must_use]
    pub fn as_initial(&self) -> InitialBed {
        let Crater { volume: noise, volume_direct: noise_below_rim, .. } = self.crater;
        InitialBed { heights: self.surface.filled(), noise, noise_below_rim }
    }

    /// Whether there is a crater, and not just the roughness of the bed ([`is_crater`]).
    #[must_use]
    pub fn has_crater(&self) -> bool {
        let (noise, excavated) = (self.noise.unwrap_or_default(), self.volume_excavated.unwrap_or_default());
        let hollow = Hollow { volume: self.crater.volume, noise, excavated };
        is_crater(self.crater.greatest_depth, self.crater.rim_radius, self.grain_size, hollow)
    }

    /// Half the width of [`Self::volume_range`] [m^3].
    #[must_use]
    pub fn volume_uncertainty(&self) -> Real {
        0.5 * (self.volume_range[1] - self.volume_range[0])
    }

    /// Half the width of [`Self::below_rim_range`] [m^3].
    #[must_use]
    pub fn below_rim_uncertainty(&self) -> Real {
        0.5 * (self.below_rim_range[1] - self.below_rim_range[0])
    }

    /// What speaks against the volume below the plane of the rim, in words.
    #[must_use]
    pub fn doubts_below_rim(&self, known: Known) -> Vec<String> {
        let noise = self.noise_below_rim;
        self.doubts(known, self.crater.volume_direct, self.below_rim_uncertainty(), noise)
    }

    /// What speaks against V of eq. (14), in words.
    #[must_use]
    pub fn doubts_of_cap(&self, known: Known) -> Vec<String> {
        let mut doubts = self.doubts(known, self.crater.volume, self.volume_uncertainty(), self.noise);
        if self.crater.greatest_depth - self.crater.depth > self.grain_size {
            doubts.push(HEAPED.to_owned());
        }
        doubts
    }

    fn doubts(&self, known: Known, volume: Real, uncertainty: Real, noise: Option<Real>) -> Vec<String> {
        let mut found = Vec::new();
        if known.drops > 1 {
            found.push(format!("{} drops fall, and one volume about one axis is that of none of them", known.drops));
        }
        if !self.has_crater() {
            found.push(NO_CRATER.to_owned());
        }
        if self.crater.rim_at_edge {
            found.push(RIM_AT_EDGE.to_owned());
        }
        if self.rim_cut {
            found.push(RIM_CUT.to_owned());
        }
        if self.has_crater() {
            found.extend(self.roundness.doubts());
            found.extend((known.at_rest == Some(false)).then(|| NOT_AT_REST.to_owned()));
        }
        if uncertainty > LARGEST_BAR * volume {
            found.push(format!("uncertain by more than {:.0} %", 1e2 * LARGEST_BAR));
        }
        if let Some(noise) = noise.filter(|noise| CLEAR_OF_NOISE * noise > volume) {
            found.push(if noise > volume {
                "less than in the same bed before the impact".to_owned()
            } else {
                format!("{:.0} % of it are in the same bed before the impact", 1e2 * noise / volume)
            });
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bed::test_bed::Bed;

    const D: Real = 0.52e-3;
    const HALF: Real = 16.9e-3;
    const LEVEL: Real = 8.15e-3;

    fn settings() -> ErosionSettings {
        ErosionSettings::recommended([-HALF; 2], [HALF; 2], 0.0, D)
    }

    /// Radius of the sphere of a cap, eq. (11).
    fn sphere_radius(depth: Real, rim_diameter: Real) -> Real {
        (4.0 * depth + rim_diameter * rim_diameter / depth) / 8.0
    }

    /// Height of a spherical cap of given rim radius and depth whose rim stands `rim` above the level
    /// and falls back to it with the given slope.
    fn cap(rim_radius: Real, depth: Real, rim: Real, slope: Real) -> impl Fn(Real) -> Real {
        let radius = sphere_radius(depth, 2.0 * rim_radius);
        move |r| {
            if r < rim_radius {
                LEVEL + rim + (radius - depth) - (radius * radius - r * r).sqrt()
            } else {
                LEVEL + (rim - slope * (r - rim_radius)).max(0.0)
            }
        }
    }

    fn evaluate(bed: &Bed) -> Erosion {
        bed.view(|view| Erosion::of(view, &settings(), None)).unwrap()
    }

    #[test]
    fn the_defaults_are_those_of_the_papers_box() {
        let settings = settings();
        assert!((settings.cell - 1.30e-3).abs() < 1e-12 && (settings.layer - 1.30e-3).abs() < 1e-12);
        assert!((settings.largest_radius - 15.21e-3).abs() < 1e-12);
        let small = ErosionSettings::recommended([0.0; 2], [6e-3, 9e-3], 0.0, D);
        assert!((small.layer - 0.45e-3).abs() < 1e-12 && small.axis == [3e-3, 4.5e-3]);
    }

    /// Evaluation of a cap, and the errors of its volume, of that below the plane of the rim, and of that by layers.
    pub(super) fn evaluate_cap(rim_radius: Real, depth: Real, slope: Real) -> (Erosion, [Real; 3]) {
        let erosion = evaluate(&Bed::columns(D, HALF, 3, cap(rim_radius, depth, 0.6e-3, slope)));
        let by_layers = erosion.by_layers.unwrap().volume;
        let found = [erosion.crater.volume, erosion.crater.volume_direct, by_layers];
        (erosion, found.map(|volume| volume / cap_volume(depth, rim_radius) - 1.0))
    }

    #[test]
    fn any_cap_is_found_and_the_range_holds_it() {
        for depth in [1.8e-3, 2.35e-3] {
            for rim_radius in [5.0e-3, 5.2e-3, 5.5e-3, 5.85e-3, 6.2e-3, 6.5e-3] {
                let (erosion, [volume, direct, _]) = evaluate_cap(rim_radius, depth, 0.2);
                let place = format!("rim at {rim_radius}, depth {depth}: {volume}, {direct}");
                assert!(volume.abs() < 0.2 && direct.abs() < 0.2, "{place}");
                let [low, high] = erosion.volume_range.map(|v| v / erosion.crater.volume * (1.0 + volume));
                assert!(low < 1.0 && 1.0 < high, "{place}: {low}..{high}");
                assert!(!erosion.crater.rim_at_edge);
            }
        }
    }

    #[test]
    fn a_rim_between_two_layers_does_not_jump() {
        // By layers V jumps as the rim passes from one to the next.
        let volumes: Vec<[Real; 3]> =
            (0..8).map(|n| evaluate_cap(5.2e-3 + 0.1e-3 * n as Real, 2.1e-3, 0.1).1).collect();
        let jump =
            |kind: usize| volumes.windows(2).map(|pair| (pair[1][kind] - pair[0][kind]).abs()).fold(0.0, Real::max);
        assert!(jump(0) < 0.06 && jump(1) < 0.06 && jump(2) > 0.2, "{} {} {}", jump(0), jump(1), jump(2));
    }

    #[test]
    fn what_speaks_against_a_volume_is_said() {
        let (mut erosion, _) = evaluate_cap(6.0e-3, 2.1e-3, 0.2);
        assert!(erosion.below_rim_range[0] <= erosion.crater.volume_direct);
        let rests = Known { at_rest: Some(true), drops: 1 };
        erosion.below_rim_range = [0.9, 1.1].map(|part| part * erosion.crater.volume_direct);
        assert!(erosion.doubts_below_rim(rests).is_empty(), "{:?}", erosion.doubts_below_rim(rests));
        assert_eq!(erosion.doubts_below_rim(Known { at_rest: Some(false), ..rests }), [NOT_AT_REST]);
        assert!(erosion.doubts_below_rim(Known { drops: 2, ..rests })[0].starts_with("2 drops fall"));
        erosion.below_rim_range[0] *= 0.5;
        assert_eq!(erosion.doubts_below_rim(rests), ["uncertain by more than 20 %"]);
        erosion.below_rim_range = [erosion.crater.volume_direct; 2];
        erosion.noise_below_rim = Some(0.4 * erosion.crater.volume_direct);
        assert_eq!(erosion.doubts_below_rim(rests), ["40 % of it are in the same bed before the impact"]);
        erosion.noise_below_rim = Some(0.3 * erosion.crater.volume_direct);
        assert!(erosion.doubts_below_rim(rests).is_empty());
        erosion.crater.rim_at_edge = true;
        assert_eq!(erosion.doubts_below_rim(rests), [RIM_AT_EDGE]);
        assert!(erosion.doubts_of_cap(rests).contains(&RIM_AT_EDGE.to_owned()));
    }

    /// Deterministic noise between -1/2 and 1/2.
    fn noise(n: usize) -> Real {
        ((n as Real * 12.9898).sin() * 43758.5453).fract() * 0.5
    }

    fn rough(layers: usize, top: impl Fn(Real) -> Real) -> Bed {
        let mut bed = Bed::columns(D, HALF, layers, top);
        for (n, position) in bed.position.iter_mut().enumerate() {
            position.z += noise(n / layers) * D;
        }
        bed
    }

    #[test]
    fn a_flat_bed_stays_below_the_noise_of_one_grain() {
        let flat = evaluate(&rough(3, |_| LEVEL));
        assert!(flat.crater.volume < cap_volume(D, flat.crater.rim_radius));
        // Negative control: a dent of three grains is above it.
        let dent = evaluate(&rough(6, |r| LEVEL - 3.0 * D * (1.0 - (r / 6e-3).powi(2)).max(0.0)));
        assert!(dent.crater.volume > cap_volume(D, dent.crater.rim_radius));
    }

    #[test]
    fn volumes_against_the_initial_bed_are_those_of_the_shape() {
        let (rim_radius, depth, rim) = (6.5e-3, 2.0e-3, 0.5e-3);
        let initial = evaluate(&rough(3, |_| LEVEL)).as_initial();
        let after = rough(3, cap(rim_radius, depth, rim, 0.4))
            .view(|view| Erosion::of(view, &settings(), Some(&initial)))
            .unwrap();
        // The part of the cap below the initial level is a cap on the same sphere.
        let (below, radius) = (depth - rim, sphere_radius(depth, 2.0 * rim_radius));
        let excavated = std::f64::consts::PI * below * below * (3.0 * radius - below) / 3.0;
        assert!((after.volume_excavated.unwrap() / excavated - 1.0).abs() < 0.1);
        assert!((after.depth_below_initial.unwrap() - (depth - rim)).abs() < 0.5 * D);
        let ring = InitialBed { heights: vec![4.0, 2.0], noise: 0.0, noise_below_rim: 0.0 };
        assert_eq!(ring.level(), (4.0 + 3.0 * 2.0) / 4.0);
        assert!(after.noise.unwrap() < 0.5 * after.crater.volume);
        assert!(after.volume_rim.unwrap() > 0.0);
        assert!(after.has_crater());
        let shallow = Erosion { grain_size: after.crater.greatest_depth, ..after.clone() };
        assert!(!shallow.has_crater() && shallow.doubts_below_rim(Known::default()).contains(&NO_CRATER.to_owned()));
        // What is no crater does not come to rest.
        let moves = Known { at_rest: Some(false), drops: 1 };
        let is_told = |of: &Erosion| of.doubts_below_rim(moves).contains(&NOT_AT_REST.to_owned());
        assert!(!is_told(&shallow) && is_told(&after));
        // Against itself nothing was moved.
        let same = rough(3, |_| LEVEL).view(|view| Erosion::of(view, &settings(), Some(&initial))).unwrap();
        assert_eq!((same.volume_excavated, same.volume_rim), (Some(0.0), Some(0.0)));
        assert!(!same.has_crater() && !Erosion { grain_size: 0.0, ..same }.has_crater());
    }

    #[test]
    fn a_heap_in_the_middle_does_not_hide_a_crater() {
        let initial = evaluate(&rough(3, |_| LEVEL)).as_initial();
        let (rim_radius, depth, rim) = (6.5e-3, 2.0e-3, 0.5e-3);
        let hollow = cap(rim_radius, depth, rim, 0.4);
        let heaped = |r: Real| if r < 2.0e-3 { LEVEL + rim } else { hollow(r) };
        let found = rough(3, heaped).view(|view| Erosion::of(view, &settings(), Some(&initial))).unwrap();
        assert!(found.crater.depth < D && found.crater.greatest_depth > D, "{:?}", found.crater);
        assert!(found.has_crater());
        let doubted = |erosion: &Erosion| erosion.doubts_of_cap(Known::default()).contains(&HEAPED.to_owned());
        let plain =
            rough(3, cap(rim_radius, depth, rim, 0.4)).view(|view| Erosion::of(view, &settings(), Some(&initial)));
        let plain = plain.unwrap();
        assert!(doubted(&found) && !doubted(&plain));
        // One that stands above the rim is not taken for it: what lies below the plane of the rim is the ditch about it.
        let towering = |r: Real| if r < 2.0e-3 { LEVEL + 2.0 * rim } else { hollow(r) };
        let bed = rough(3, towering);
        let found = bed.view(|view| Erosion::of(view, &settings(), Some(&initial))).unwrap();
        let [rim_now, before] = [&found, &plain].map(|erosion| erosion.crater.rim_radius);
        assert!((rim_now / before - 1.0).abs() < 0.1, "{rim_now} {before}");
        let [ditch, whole] = [&found, &plain].map(|erosion| erosion.crater.volume_direct);
        assert!(ditch > 0.6 * whole && ditch < 0.95 * whole, "{ditch} {whole}");
        assert!(found.crater.volume == 0.0 && doubted(&found) && found.has_crater(), "{:?}", found.crater);
        // Negative control: without the bed before the impact its highest place is.
        assert!(evaluate(&bed).crater.rim_radius < 0.5 * before);
    }

    #[test]
    fn a_crater_in_a_bed_that_was_dished_before_is_told_by_what_was_dug_out() {
        // Volumes of a small bed whose own surface has a third of the volume: mm^3 and mm.
        let dug = Hollow { volume: 71.0, noise: 23.9, excavated: 26.1 };
        assert!(is_crater(1.77, 4.95, 0.52, dug));
        // Negative controls: nothing dug out, a wider rim, no depth.
        assert!(!is_crater(1.77, 4.95, 0.52, Hollow { excavated: 0.0, ..dug }));
        assert!(!is_crater(1.77, 8.0, 0.52, dug) && !is_crater(0.5, 4.95, 0.52, dug));
        assert!(is_crater(1.77, 4.95, 0.52, Hollow { noise: 5.0, excavated: 0.0, ..dug }));
    }

    #[test]
    fn copies_of_a_crater_have_its_volumes() {
        // A rough bed turned by a quarter, mirrored, and shifted by a part of a pixel.
        let crater = cap(6.3e-3, 2.1e-3, 0.4e-3, 0.4);
        let copy = |turns: usize, mirrored: bool, shift: Real| {
            let mut bed = rough(3, &crater);
            for centre in &mut bed.position {
                let mut place = if mirrored { [-centre.x, centre.y] } else { [centre.x, centre.y] };
                (0..turns).for_each(|_| place = [-place[1], place[0]]);
                (centre.x, centre.y) = (place[0] + shift, place[1] + 0.7 * shift);
            }
            let about = ErosionSettings { axis: [shift, 0.7 * shift], ..settings() };
            let found = bed.view(|view| Erosion::of(view, &about, None)).unwrap().crater;
            [found.volume, found.volume_direct]
        };
        let copies: Vec<[Real; 2]> =
            (0..8).map(|n| copy(n % 4, n >= 4, 0.0)).chain([copy(0, false, 0.017 * D)]).collect();
        for kind in 0..2 {
            let all = || copies.iter().map(|volumes| volumes[kind]);
            let (low, high) = (all().fold(Real::INFINITY, Real::min), all().fold(0.0, Real::max));
            assert!(high - low < 0.03 * high, "{kind}: {copies:?}");
        }
        // Negative control: another crater has another volume.
        let other = rough(3, cap(6.3e-3, 2.0e-3, 0.4e-3, 0.4));
        assert!((evaluate(&other).crater.volume / copies[0][0] - 1.0).abs() > 0.03);
    }

    #[test]
    fn a_crater_at_a_seam_is_that_in_the_middle() {
        let mut bed = Bed::columns(D, HALF, 3, cap(6.5e-3, 2.0e-3, 0.5e-3, 0.4));
        bed.position.iter_mut().for_each(|centre| centre.z += 0.05 * centre.x);
        let middle = evaluate(&bed).crater;
        // The same bed with its axis at a corner of a box that repeats.
        for centre in &mut bed.position {
            *centre += sazanami_numerics::Vector::new(
                HALF * (1.0 - 2.0 * f64::from(centre.x > 0.0)),
                HALF * (1.0 - 2.0 * f64::from(centre.y > 0.0)),
                0.0,
            );
        }
        let at_corner = |axis| ErosionSettings { axis, periodic: [true; 2], ..settings() };
        for axis in [[HALF, HALF], [-HALF, HALF]] {
            let found = bed.view(|view| Erosion::of(view, &at_corner(axis), None)).unwrap().crater;
            assert!((found.volume / middle.volume - 1.0).abs() < 1e-9, "{found:?} {middle:?}");
            assert!((found.volume_direct / middle.volume_direct - 1.0).abs() < 1e-9, "{found:?} {middle:?}");
        }
        // Negative control: in a box with walls the quarter of it has another tilt.
        let walls = ErosionSettings { periodic: [false; 2], ..at_corner([HALF, HALF]) };
        let found = bed.view(|view| Erosion::of(view, &walls, None)).map(|erosion| erosion.crater.volume);
        assert!(found.is_err() || (found.unwrap() / middle.volume - 1.0).abs() > 1e-6);
    }

    #[test]
    fn flying_grains_do_not_raise_the_rim() {
        let mut bed = Bed::columns(D, HALF, 3, cap(6.5e-3, 2.35e-3, 0.5e-3, 0.4));
        let still = evaluate(&bed).crater;
        let count = bed.position.len();
        for n in (0..count).step_by(count / 200) {
            bed.position[n].z += 12e-3;
            bed.velocity[n].z = 0.5;
            bed.last_contact.as_mut().unwrap()[n] = 1.0 - 4e-3;
        }
        let splashing = evaluate(&bed);
        assert!(splashing.airborne_grains >= 200);
        assert!((splashing.crater.rim_height - still.rim_height).abs() < 0.1 * D);
        // Negative control: counted as bed, they raise it by far.
        bed.last_contact = None;
        bed.velocity.fill(sazanami_numerics::Vector::ZERO);
        let linked = bed
            .view(|view| Erosion::of(view, &ErosionSettings { grain_size: 0.2, pixel: D / 8.0, ..settings() }, None));
        assert!(linked.unwrap().crater.rim_height > still.rim_height + 0.5 * D);
    }

    #[test]
    fn a_rim_over_the_sides_of_the_box_is_doubted() {
        // Craters about a place that is nearer to a side than their rim, or the middle: the negative control.
        for (x, is_cut) in [(-HALF + 3e-3, true), (0.0, false)] {
            let mut bed = Bed::columns(D, HALF, 3, |_| LEVEL);
            let pit = cap(5.85e-3, 2.35e-3, 0.6e-3, 0.2);
            bed.position.iter_mut().for_each(|place| place.z += pit((place.x - x).hypot(place.y)) - LEVEL);
            for periodic in [false, true] {
                let settings = ErosionSettings { axis: [x, 0.0], periodic: [periodic, false], ..settings() };
                let erosion = bed.view(|view| Erosion::of(view, &settings, None)).unwrap();
                assert_eq!(erosion.rim_cut, is_cut && !periodic, "{x} {periodic}");
                let doubts = erosion.doubts_below_rim(Known::default());
                assert_eq!(doubts.iter().any(|doubt| doubt == RIM_CUT), is_cut && !periodic, "{doubts:?}");
            }
        }
    }

    #[test]
    fn all_grains_lie_half_a_bed_lower() {
        let bed = Bed::columns(D, HALF, 8, |_| LEVEL);
        let all = ErosionSettings { counted: CountedGrains::All, ..settings() };
        let erosion = bed.view(|view| Erosion::of(view, &all, None)).unwrap();
        assert!((erosion.by_layers.unwrap().base - (LEVEL - 3.5 * D)).abs() < 1e-9);
        assert_eq!(erosion.surface_grains, bed.position.len());
    }

    #[test]
    fn settings_without_sense_are_refused() {
        let bed = Bed::columns(D, 5e-3, 2, |_| LEVEL);
        let refused = |settings: ErosionSettings| bed.view(|view| Erosion::of(view, &settings, None)).unwrap_err();
        assert!(matches!(refused(ErosionSettings { layer: 0.0, ..settings() }), ErosionError::NotALength { .. }));
        assert!(matches!(refused(ErosionSettings { layer: 0.01, ..settings() }), ErosionError::TooFewLayers { .. }));
        assert_eq!(refused(ErosionSettings { axis: [0.1, 0.1], ..settings() }), ErosionError::NoSurface);
        // Nor has a bed that all grains have left.
        let nothing = Bed::new(D, Vec::new());
        assert_eq!(nothing.view(|view| Erosion::of(view, &settings(), None)).unwrap_err(), ErosionError::NoSurface);
    }
}
