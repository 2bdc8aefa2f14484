//! The slope of a heap: the angle of repose, once the grains lie still.
//!
//! The surface is that of the grains seen from above, averaged over bands that lie one grain wide at the same distance from the axis of a
//! cone or from the line of a ridge. The flank is what lies between a fifth and four fifths of the way up from the foot to the
//! crest, so that neither the round top nor grains that rolled away count; a straight line of least squares through its bands has
//! the slope. Grains in the air are left out, and a heap that moves has no angle.

use sazanami_numerics::{Real, choices};
use sazanami_parallel::sum_over;

use crate::erosion::linked_to_bed;
use crate::fit::line;
use crate::height_map::HeightMap;
use crate::{BedView, Ground, Horizontal};

choices! {
    /// Shape of a heap.
    pub enum HeapShape {
        /// A cone about a vertical axis.
        Cone = "cone",
        /// Straight along x2: a ridge, a pile at a wall, a slope from end to end. Its height depends on the distance from the axis along x1.
        Ridge = "ridge",
    }
}

/// Settings of the measurement of a heap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeapSettings {
    /// Cone or ridge.
    pub shape: HeapShape,
    /// Axis of the cone; of a ridge the line of its crest along x1 \[m].
    pub axis: Horizontal,
    /// Width of a band, and the unit in which a heap has to be high: the size of a grain \[m].
    pub grain_size: Real,
    /// Horizontal corners of the box \[m].
    pub lower: Horizontal,
    /// Horizontal corners of the box \[m].
    pub upper: Horizontal,
    /// Whether the box repeats in these directions.
    pub periodic: [bool; 2],
    /// Height of the floor, the surface where there is no grain \[m].
    pub floor: Real,
    /// Magnitude of gravity [m/s^2]: it says how fast grains of a heap that moves are.
    pub gravity: Real,
}

impl HeapSettings {
    /// Mean speed of the grains up to which a heap lies still [m/s]: its grains take a hundred times as long to move by their size as
    /// one that falls.
    #[must_use]
    pub fn still(&self) -> Real {
        STILL * (self.gravity * self.grain_size).sqrt()
    }
}

/// A heap, as it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heap {
    /// Angle of the flank against the horizontal, positive if it falls away from the axis \[rad].
    pub angle: Real,
    /// Standard error of the angle: from the scatter of the bands about the line, or of the angles of the parts of the heap, whichever
    /// is larger \[rad]. Nothing of the scatter between heaps is in it.
    pub uncertainty: Real,
    /// Angles of the upper and the lower half of the flank: they differ where it is not straight \[rad].
    pub halves: [Real; 2],
    /// Angles of the parts of the heap: four quadrants of a cone, the flanks of a ridge in two strips each \[rad].
    pub parts: [Option<Real>; 4],
    /// Height of the crest over the foot \[m].
    pub relief: Real,
    /// Distances from the axis between which the flank lies \[m].
    pub flank: [Real; 2],
    /// Mean speed of the grains that are not in the air [m/s].
    pub mean_speed: Real,
    /// Grains in the air, which are left out.
    pub airborne: usize,
}

/// Why there is no angle.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum HeapError {
    /// There is no heap.
    #[error(
        "the bed is flat: its surface falls by {:.3} mm from its crest, less than {LEAST_RELIEF} grain sizes of {:.3} mm",
        1e3 * .relief, 1e3 * .grain_size
    )]
    Flat {
        /// Height of the crest over the foot \[m].
        relief: Real,
        /// Size of a grain \[m].
        grain_size: Real,
    },
    /// The grains have not come to rest.
    #[error(
        "the heap moves: the mean speed of its grains is {:.2e} m/s, and that of a heap that lies still {:.2e} m/s at most", .mean_speed, .still
    )]
    Moving {
        /// Mean speed of the grains that are not in the air [m/s].
        mean_speed: Real,
        /// The largest of a heap that lies still [m/s].
        still: Real,
    },
    /// There is hardly a flank.
    #[error(
        "the flank is {bands} grains long, and a slope needs {LEAST_BANDS}: a larger heap, or a finer `grain_size`"
    )]
    Short {
        /// Bands of the flank.
        bands: usize,
    },
}

/// Height of a heap in grain sizes, at least.
const LEAST_RELIEF: Real = 4.0;
/// Bands of a flank, at least.
const LEAST_BANDS: usize = 4;
/// Part of the way up at which the flank begins and ends.
const FLANK: [Real; 2] = [0.2, 0.8];
/// Mean speed of a heap that lies still, over that of a grain that falls by its size.
const STILL: Real = 0.01;
/// Pixels across a grain.
const FINENESS: Real = 8.0;
/// Parts of a heap whose slopes are compared.
const PARTS: usize = 4;

/// Part of a band that grains cover, at least: elsewhere the floor is its surface, with a few grains on it.
const COVERED: Real = 0.3;

/// View of a band: sum of the heights of grains, pixels with grains, all pixels.
#[derive(Clone, Copy, Default)]
struct Seen {
    height: Real,
    grains: Real,
    pixels: Real,
}

impl Seen {
    /// Mean height of the surface \[m]; `None` of a band that is not there.
    fn height(&self, floor: Real) -> Option<Real> {
        let is_covered = self.grains >= COVERED * self.pixels;
        (self.pixels > 0.0).then(|| if is_covered { self.height / self.grains } else { floor })
    }
}

/// A band: all of it, and each of its parts.
type Band = [Seen; 1 + PARTS];

impl Heap {
    /// Measures the heap that the grains of `bed` make.
    ///
    /// # Errors
    /// If the bed is flat, the heap is too small to have a slope, or it moves.
    pub fn of(bed: &BedView, settings: &HeapSettings) -> Result<Self, HeapError> {
        let &HeapSettings { axis, lower, upper, periodic, .. } = settings;
        let ground = Ground { lower, upper, periodic };
        let Ground { lower, upper, .. } = ground.about(axis);
        let about = HeapSettings { lower, upper, periodic: [false; 2], ..*settings };
        ground.seen_from(axis, bed, |bed| Self::about_axis(bed, &about))
    }

    /// The same of a bed that does not repeat.
    fn about_axis(bed: &BedView, settings: &HeapSettings) -> Result<Self, HeapError> {
        let lying = lying(bed, settings);
        let airborne = airborne(bed, &lying);
        let bands = bands(bed, &lying, settings);
        let d = settings.grain_size;
        let profile = |part: usize| -> Vec<(Real, Real)> {
            let all = bands.iter().enumerate();
            all.filter_map(|(n, band)| Some(((n as Real + 0.5) * d, band[part].height(settings.floor)?))).collect()
        };
        let whole = profile(0);
        let [from, to, relief] = flank(&whole, d)?;
        let free = |n: usize| Real::from(u8::from(!bed.held[lying[n]]));
        let [speeds, count] = sum_over(lying.len(), |n| [free(n) * bed.velocity[lying[n]].length(), free(n)]);
        let (mean_speed, still) = (speeds / Real::max(count, 1.0), settings.still());
        if mean_speed > still {
            return Err(HeapError::Moving { mean_speed, still });
        }
        let within = |points: Vec<(Real, Real)>| -> Vec<(Real, Real)> {
            points.into_iter().filter(|&(s, _)| (from..=to).contains(&s)).collect()
        };
        let points = within(whole);
        let too_short = HeapError::Short { bands: points.len() };
        if points.len() < LEAST_BANDS {
            return Err(too_short);
        }
        let line_through = |points: &[(Real, Real)]| line(points).ok_or(too_short);
        let angle = |slope: Real| (-slope).atan();
        let fitted = line_through(&points)?;
        let (inner, outer) = points.split_at(points.len() / 2);
        let halves = [angle(line_through(inner)?.slope), angle(line_through(outer)?.slope)];
        let parts = std::array::from_fn(|part| line(&within(profile(part + 1))).map(|line| angle(line.slope)));
        // The angle changes by cos^2 of it with the slope.
        let of_bands = fitted.standard_error.unwrap_or_default() / (1.0 + fitted.slope * fitted.slope);
        Ok(Self {
            angle: angle(fitted.slope),
            uncertainty: of_bands.max(standard_error(&parts)),
            halves,
            parts,
            relief,
            flank: [from - 0.5 * d, to + 0.5 * d],
            mean_speed,
            airborne,
        })
    }
}

/// Standard error of the mean of those values that there are; 0 of fewer than two.
fn standard_error(values: &[Option<Real>]) -> Real {
    let known = || values.iter().flatten();
    let count = known().count() as Real;
    if count < 2.0 {
        return 0.0;
    }
    let mean = known().sum::<Real>() / count;
    (known().map(|value| (value - mean).powi(2)).sum::<Real>() / (count - 1.0) / count).sqrt()
}

/// Numbers of the grains that are not in the air: those near to others of the heap, and those that lie on the floor beside it.
fn lying(bed: &BedView, settings: &HeapSettings) -> Vec<usize> {
    let linked = linked_to_bed(bed, settings.grain_size, settings.floor);
    (0..bed.len()).filter(|&grain| linked[grain]).collect()
}

/// Number of grains in the air: neither among the `lying` ones nor held, as a funnel above the heap is.
fn airborne(bed: &BedView, lying: &[usize]) -> usize {
    let free = |grain: &usize| !bed.held[*grain];
    (0..bed.len()).filter(free).count() - lying.iter().copied().filter(free).count()
}

/// The bands about the axis, out to where they reach the nearest side of the box or, of a ridge, the farthest.
fn bands(bed: &BedView, lying: &[usize], settings: &HeapSettings) -> Vec<Band> {
    let &HeapSettings { shape, axis, grain_size: d, lower, upper, .. } = settings;
    let longest = (upper[0] - lower[0]).max(upper[1] - lower[1]);
    let mut map = HeightMap::new(lower, upper, d / FINENESS);
    map.add(bed, &bed.bounds(), lying);
    let to_sides = |k: usize| [axis[k] - lower[k], upper[k] - axis[k]];
    let reach = match shape {
        // Of a half or a quarter of a cone the walls through its axis cut nothing off.
        HeapShape::Cone => {
            let all = to_sides(0).into_iter().chain(to_sides(1));
            all.filter(|&side| side > d).fold(Real::INFINITY, Real::min).min(longest)
        }
        HeapShape::Ridge => to_sides(0).into_iter().fold(0.0, Real::max),
    };
    let mut bands = vec![Band::default(); (reach / d).floor().max(0.0) as usize];
    let [columns, rows] = map.pixels();
    for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
        let centre = map.centre(i, j);
        let [x, y] = [0, 1].map(|k| centre[k] - axis[k]);
        let (distance, across) = match shape {
            HeapShape::Cone => (x.hypot(y), y),
            HeapShape::Ridge => (x.abs(), centre[1] - 0.5 * (lower[1] + upper[1])),
        };
        let part = 1 + 2 * usize::from(x >= 0.0) + usize::from(across >= 0.0);
        if let Some(band) = bands.get_mut((distance / d) as usize) {
            let height = map.height(i, j);
            for part in [0, part] {
                let seen = &mut band[part];
                seen.pixels += 1.0;
                seen.grains += Real::from(u8::from(height.is_some()));
                seen.height += height.unwrap_or_default();
            }
        }
    }
    bands
}

/// First and last distance of the flank of a profile, and the relief \[m].
fn flank(profile: &[(Real, Real)], grain_size: Real) -> Result<[Real; 3], HeapError> {
    let flat = |relief: Real| HeapError::Flat { relief, grain_size };
    let crest = (0..profile.len()).max_by(|&a, &b| profile[a].1.total_cmp(&profile[b].1)).ok_or(flat(0.0))?;
    let beyond = &profile[crest..];
    let foot = beyond.iter().map(|&(_, z)| z).fold(Real::INFINITY, Real::min);
    let relief = profile[crest].1 - foot;
    if relief < LEAST_RELIEF * grain_size {
        return Err(flat(relief));
    }
    let [low, high] = FLANK.map(|part| foot + part * relief);
    let bands: Vec<Real> =
        beyond.iter().skip_while(|&&(_, z)| z > high).take_while(|&&(_, z)| z >= low).map(|&(s, _)| s).collect();
    match (bands.first(), bands.last()) {
        (Some(&from), Some(&to)) => Ok([from, to, relief]),
        _ => Err(HeapError::Short { bands: 0 }),
    }
}

#[cfg(test)]
mod tests {
    use sazanami_numerics::Vector;

    use super::*;
    use crate::bed::test_bed::Bed;
    use sazanami_numerics::Random;

    const HALF: Real = 20.0;
    const HEAP: HeapSettings = HeapSettings {
        shape: HeapShape::Cone,
        axis: [0.0, 0.0],
        grain_size: 1.0,
        lower: [-HALF, -HALF],
        upper: [HALF, HALF],
        periodic: [false; 2],
        floor: -4.0,
        gravity: 9.81,
    };

    fn measured(bed: &Bed, settings: &HeapSettings) -> Result<Heap, HeapError> {
        bed.view(|view| Heap::of(view, settings))
    }

    #[test]
    fn cones_have_their_angles() {
        for degrees in [16.0_f64, 20.0, 32.0, 40.0] {
            let bed = Bed::columns(1.0, HALF, 3, |r| (16.0 - r).max(0.0) * degrees.to_radians().tan());
            let heap = measured(&bed, &HEAP).unwrap();
            let [found, error] = [heap.angle, heap.uncertainty].map(Real::to_degrees);
            assert!((found - degrees).abs() < 0.5, "{found} +- {error} for {degrees}");
            assert!(
                error < 1.0 && heap.halves.iter().all(|half| (half.to_degrees() - degrees).abs() < 2.0),
                "{heap:?}"
            );
        }
    }

    #[test]
    fn a_half_and_a_quarter_of_a_cone_at_walls_have_the_angle_of_the_whole() {
        let degrees: Real = 32.0;
        let cone = || Bed::columns(1.0, HALF, 3, |r| (16.0 - r).max(0.0) * degrees.to_radians().tan());
        for lower in [[0.0, -HALF], [-HALF, 0.0], [0.0, 0.0]] {
            let whole = cone();
            let kept = whole.position.into_iter().filter(|place| place.x > lower[0] && place.y > lower[1]);
            let heap = measured(&Bed::new(1.0, kept.collect()), &HeapSettings { lower, ..HEAP }).unwrap();
            assert!((heap.angle.to_degrees() - degrees).abs() < 1.0, "{lower:?}: {heap:?}");
        }
    }

    #[test]
    fn a_slope_from_side_to_side_and_a_pile_at_a_wall_have_theirs() {
        let wedge = |degrees: Real, top: Real| {
            let mut bed = Bed::columns(1.0, HALF, 3, |_| 0.0);
            for position in &mut bed.position {
                position.z += ((top - position.x - HALF) * degrees.to_radians().tan()).max(0.0);
            }
            bed
        };
        let settings = HeapSettings { shape: HeapShape::Ridge, axis: [-HALF, 0.0], ..HEAP };
        for (degrees, top) in [(15.0, 40.0), (32.0, 40.0), (32.0, 20.0)] {
            let heap = measured(&wedge(degrees, top), &settings).unwrap();
            assert!((heap.angle.to_degrees() - degrees).abs() < 0.5, "{heap:?}");
        }
        // Seen from the foot there is no crest to fall from, and from the side nothing falls.
        let from_the_foot = measured(&wedge(32.0, 40.0), &HeapSettings { axis: [HALF, 0.0], ..settings });
        assert!(matches!(from_the_foot, Err(HeapError::Flat { .. })), "{from_the_foot:?}");
    }

    #[test]
    fn a_flat_bed_has_no_angle() {
        let mut bed = Bed::columns(1.0, HALF, 3, |_| 5.0);
        let mut random = Random::new(1);
        bed.position.iter_mut().for_each(|position| position.z += random.between(-0.5, 0.5));
        for shape in [HeapShape::Cone, HeapShape::Ridge] {
            let flat = measured(&bed, &HeapSettings { shape, ..HEAP });
            assert!(matches!(flat, Err(HeapError::Flat { .. })), "{flat:?}");
            assert!(flat.unwrap_err().to_string().contains("the bed is flat"));
        }
        let nothing = measured(&Bed::new(1.0, Vec::new()), &HEAP);
        assert_eq!(nothing, Err(HeapError::Flat { relief: 0.0, grain_size: 1.0 }));
        let steep = Bed::columns(1.0, HALF, 9, |r| if r < 5.0 { 9.0 } else { 0.0 });
        assert!(matches!(measured(&steep, &HEAP), Err(HeapError::Short { .. })));
    }

    #[test]
    fn a_heap_that_moves_has_no_angle_and_grains_in_the_air_do_not_count() {
        let cone = || Bed::columns(1.0, HALF, 3, |r| (16.0 - r).max(0.0) * 32.0_f64.to_radians().tan());
        let lying = measured(&cone(), &HEAP).unwrap();
        assert_eq!((lying.airborne, lying.mean_speed), (0, 0.0));
        // A cloud over one side of the flank.
        let cloud = (0..40).map(|n| Vector::new(4.5 + f64::from(n % 8), 0.5 + f64::from(n / 8), 25.0));
        let mut splashed = Bed::new(1.0, cone().position.into_iter().chain(cloud).collect());
        let flying = splashed.position.len() - 40..;
        splashed.velocity[flying.clone()].fill(Vector::new(0.0, 0.0, 3.0));
        splashed.last_contact.as_mut().unwrap()[flying.clone()].fill(0.5);
        let seen = measured(&splashed, &HEAP).unwrap();
        assert_eq!(seen, Heap { airborne: 40, ..lying });
        // So do grains of a funnel above the heap, held ones and those that touch them.
        splashed.last_contact.as_mut().unwrap().iter_mut().for_each(|time| *time = 1.0);
        splashed.velocity.fill(Vector::ZERO);
        assert_eq!(measured(&splashed, &HEAP), Ok(seen));
        splashed.held[flying.start..flying.start + 20].fill(true);
        assert_eq!(measured(&splashed, &HEAP), Ok(Heap { airborne: 20, ..lying }));
        // Control: the same grains on the floor are part of the heap.
        splashed.position[flying].iter_mut().for_each(|place| *place += Vector::new(0.0, 0.0, HEAP.floor + 0.5 - 25.0));
        assert_eq!(measured(&splashed, &HEAP).unwrap().airborne, 0);
        for (part, still) in [(0.9, true), (1.1, false)] {
            let mut moving = cone();
            moving.velocity.fill(Vector::new(part * HEAP.still(), 0.0, 0.0));
            // Held grains of its base do not make it lie more still.
            let base = moving.position.len() / 2;
            moving.velocity[..base].fill(Vector::ZERO);
            moving.held[..base].fill(true);
            let found = measured(&moving, &HEAP);
            assert!(if still { found.is_ok() } else { matches!(found, Err(HeapError::Moving { .. })) }, "{found:?}");
        }
    }

    /// Rough cones: the angle is right on the mean, and scatters by about what is said of one.
    #[test]
    fn the_uncertainty_is_that_of_rough_heaps() {
        let degrees: Real = 30.0;
        let (mut found, mut said) = (Vec::new(), 0.0);
        let count = 24;
        for heap in 0..count {
            let mut random = Random::new(77 + heap);
            let mut bed = Bed::columns(1.0, HALF, 3, |r| (18.0 - r).max(0.0) * degrees.to_radians().tan());
            bed.position.iter_mut().for_each(|position| position.z += random.between(-1.0, 1.0));
            let heap = measured(&bed, &HEAP).unwrap();
            found.push(heap.angle.to_degrees());
            said += heap.uncertainty.to_degrees() / count as Real;
        }
        let mean = found.iter().sum::<Real>() / count as Real;
        let scatter = (found.iter().map(|angle| (angle - mean).powi(2)).sum::<Real>() / (count - 1) as Real).sqrt();
        assert!((mean - degrees).abs() < 0.5, "{mean}");
        assert!((0.4..2.5).contains(&(said / scatter)), "said {said}, scatter {scatter}");
    }
}
