//! `region` of `[[liquid]]`: shapes made of primitives.

use std::path::PathBuf;

use sazanami_case_derive::Keys;
use sazanami_numerics::{Quaternion, Real, Vector, choices, geometry};

use super::{BoxDomain, LiquidFile};
use crate::read::{At, Context};

choices! {
    /// A direction of the box.
    pub enum Direction {
        /// Along x1.
        X1 = "x1",
        /// Along x2.
        X2 = "x2",
        /// Along x3.
        X3 = "x3",
    }
}

impl Direction {
    /// Its number, from 0.
    #[must_use]
    pub fn index(self) -> usize {
        self as usize
    }

    /// The unit vector along it.
    pub(super) fn vector(self) -> Vector {
        Vector::AXES[self.index()]
    }
}

/// A body of liquid (or a bubble), about its origin.
#[derive(Clone, Debug, PartialEq, Keys)]
pub enum Region {
    /// A box.
    Box {
        /// Lower corner.
        #[key(unit = "m")]
        lower: Vector,
        /// Upper corner.
        #[key(unit = "m")]
        upper: Vector,
    },
    /// A sphere.
    Sphere {
        /// Centre.
        #[key(unit = "m", default = Vector::ZERO, says = "the shape's origin")]
        centre: Vector,
        /// Diameter.
        #[key(unit = "m", range = Positive)]
        diameter: Real,
    },
    /// A spheroid about the vertical.
    Spheroid {
        /// Centre.
        #[key(unit = "m", default = Vector::ZERO, says = "the shape's origin")]
        centre: Vector,
        /// Diameter across.
        #[key(unit = "m", range = Positive)]
        horizontal_diameter: Real,
        /// Diameter along the vertical.
        #[key(unit = "m", range = Positive)]
        vertical_diameter: Real,
    },
    /// All behind a plane.
    HalfSpace {
        /// A point of the plane.
        #[key(unit = "m")]
        point: Vector,
        /// Normal, out of the region.
        #[key(default = Vector::Z, says = "up")]
        normal: Vector,
    },
    /// A cylinder without ends: a disc in a slice of the grid, or a jet.
    Cylinder {
        /// A point of the axis; its radius is largest there if it has a wave.
        #[key(unit = "m", default = Vector::ZERO, says = "the shape's origin")]
        centre: Vector,
        /// Direction of the axis.
        #[key(word, default = Direction::X2)]
        axis: Direction,
        /// Diameters along the other two directions, that of lower number first.
        #[key(unit = "m", range = Positive)]
        diameters: [Real; 2],
        /// What the radius is larger by at a crest of a cosine along the axis.
        #[key(unit = "m", range = NonNegative, default = 0.0)]
        amplitude: Real,
        /// Distance between crests; needed with an amplitude.
        #[key(unit = "m", range = Positive, default = 1.0)]
        wavelength: Real,
    },
    /// All below a surface that is a cosine.
    Wavy {
        /// A point of a crest.
        #[key(unit = "m", default = Vector::ZERO, says = "the shape's origin")]
        crest: Vector,
        /// Direction out of the region.
        #[key(word, default = Direction::X3)]
        up: Direction,
        /// Direction of the wave.
        #[key(word, default = Direction::X1)]
        along: Direction,
        /// Height of a crest above the mean.
        #[key(unit = "m", range = NonNegative)]
        amplitude: Real,
        /// Distance between crests.
        #[key(unit = "m", range = Positive)]
        wavelength: Real,
    },
    /// Liquid from the fields of another run: a drop as it falls, with the flow in it. From a slice, one cell thick, it is the same all along
    /// that direction.
    File(LiquidFile),
    /// Whatever one of several regions holds.
    Union(Vec<Region>),
}

impl Region {
    /// The region moved by `shift` \[m].
    #[must_use]
    pub fn moved(&self, shift: Vector) -> Self {
        let mut moved = self.clone();
        match &mut moved {
            Self::Box { lower, upper } => {
                *lower += shift;
                *upper += shift;
            }
            Self::Sphere { centre: place, .. }
            | Self::Spheroid { centre: place, .. }
            | Self::HalfSpace { point: place, .. }
            | Self::Cylinder { centre: place, .. }
            | Self::Wavy { crest: place, .. } => *place += shift,
            Self::File(file) => file.centre += shift,
            Self::Union(regions) => regions.iter_mut().for_each(|region| *region = region.moved(shift)),
        }
        moved
    }

    /// The same in a box that repeats: with its images beyond the periodic sides through which it reaches. What comes from files has none.
    #[must_use]
    pub fn repeated(&self, domain: &BoxDomain, periodic: [bool; 3]) -> Self {
        match self {
            Self::Union(parts) => {
                return Self::Union(parts.iter().map(|part| part.repeated(domain, periodic)).collect());
            }
            Self::File(_) => return self.clone(),
            _ => {}
        }
        let ((low, high), extent) = (self.geometry().bounds(), domain.extent());
        let shifts = |d: usize| {
            let tiny = 1e-9 * extent[d];
            let (before, behind) = (low[d] < domain.lower[d] - tiny, high[d] > domain.upper[d] + tiny);
            // A box from side to side fills it.
            let is_filled = matches!(self, Self::Box { .. })
                && low[d] <= domain.lower[d] + tiny
                && high[d] >= domain.upper[d] - tiny;
            let repeats = periodic[d] && (high[d] - low[d]).is_finite() && !is_filled;
            [Some(0.0), (repeats && before).then_some(extent[d]), (repeats && behind).then_some(-extent[d])]
                .into_iter()
                .flatten()
        };
        let mut images = Vec::new();
        for x in shifts(0) {
            for y in shifts(1) {
                images.extend(shifts(2).map(|z| self.moved(Vector::new(x, y, z))));
            }
        }
        if images.len() == 1 { self.clone() } else { Self::Union(images) }
    }

    /// Whether it comes from a file, in whole or in part.
    #[must_use]
    pub fn is_sampled(&self) -> bool {
        match self {
            Self::File(_) => true,
            Self::Union(parts) => parts.iter().any(Self::is_sampled),
            _ => false,
        }
    }

    /// Lowest and highest height of the region \[m]; infinite where it has no end.
    #[must_use]
    pub fn heights(&self) -> [Real; 2] {
        let (lower, upper) = self.geometry().bounds();
        [lower.z, upper.z]
    }

    /// The files that it names.
    pub fn files(&mut self) -> Vec<&mut PathBuf> {
        match self {
            Self::File(LiquidFile { file, .. }) => vec![file],
            Self::Union(regions) => regions.iter_mut().flat_map(Self::files).collect(),
            _ => Vec::new(),
        }
    }

    /// Exact volume [m^3], where it has a formula.
    #[must_use]
    pub fn volume(&self) -> Option<Real> {
        self.geometry().volume()
    }

    /// Reports errors of the region; a normal becomes a unit vector.
    pub(super) fn check(&mut self, at: &At<'_>, cx: &mut Context<'_>) {
        match self {
            Self::Box { lower, upper } if (*upper - *lower).min_element() <= 0.0 => {
                cx.report
                    .error(at.span.clone(), "this box of liquid has no extent")
                    .label("`upper` has to lie above `lower` in x1, x2 and x3");
            }
            Self::HalfSpace { normal, .. } => {
                if normal.length() == 0.0 {
                    cx.report.error(at.span.clone(), "a normal needs a direction").label("this one is zero");
                }
                // A unit vector, as in a resolved case, is kept to the last bit.
                if (normal.length() - 1.0).abs() >= 1e-15 {
                    *normal = normal.normalize_or_zero();
                }
            }
            Self::Wavy { up, along, .. } if up == along => {
                cx.report
                    .error(at.span.clone(), "a wave runs along its surface")
                    .label("`up` and `along` are the same direction")
                    .help("give another one of the two");
            }
            Self::Cylinder { diameters, amplitude, .. } if 2.0 * *amplitude >= diameters[0].min(diameters[1]) => {
                cx.report
                    .error(at.span.clone(), "this cylinder has no radius left between the crests")
                    .label("`amplitude` is at least half of a diameter")
                    .help("give a smaller amplitude");
            }
            Self::Union(parts) => {
                if parts.is_empty() {
                    cx.report
                        .error(at.span.clone(), "a union needs at least one shape")
                        .label("expected a list of shapes");
                }
                parts.iter_mut().for_each(|part| part.check(at, cx));
            }
            _ => {}
        }
    }

    /// Bounding box \[m], where it is finite.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vector, Vector)> {
        Some(self.geometry().bounds()).filter(|(lower, upper)| lower.is_finite() && upper.is_finite())
    }

    /// The region as the geometry knows it.
    #[must_use]
    pub fn geometry(&self) -> geometry::Region {
        match self {
            Self::Box { lower, upper } => geometry::Region::Box { lower: *lower, upper: *upper },
            Self::Sphere { centre, diameter } => geometry::Region::Sphere { centre: *centre, radius: 0.5 * diameter },
            Self::Spheroid { centre, horizontal_diameter: h, vertical_diameter: v } => geometry::Region::Spheroid {
                centre: *centre,
                semi_axes: 0.5 * Vector::new(*h, *h, *v),
                orientation: Quaternion::IDENTITY,
            },
            Self::HalfSpace { point, normal } => geometry::Region::HalfSpace { point: *point, normal: *normal },
            Self::Cylinder { centre, axis, diameters, amplitude, wavelength } => {
                let axis = axis.index();
                // In cyclic order the direction of lower number comes last about x2.
                let [a, b] = diameters.map(|diameter| 0.5 * diameter);
                let semi_axes = if axis == 1 { [b, a] } else { [a, b] };
                let wave = geometry::Wave { amplitude: *amplitude, length: *wavelength };
                geometry::Region::Cylinder { centre: *centre, axis, semi_axes, wave }
            }
            Self::Wavy { crest, up, along, amplitude, wavelength } => geometry::Region::Wavy {
                crest: *crest,
                up: up.index(),
                along: along.index(),
                wave: geometry::Wave { amplitude: *amplitude, length: *wavelength },
            },
            // A file that could not be read is an error of the case; until it is reported it holds nothing.
            Self::File(file) => file.placed().map_or(geometry::Region::Union(Vec::new()), geometry::Region::Sampled),
            Self::Union(members) => geometry::Region::Union(members.iter().map(Self::geometry).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_have_images_beyond_the_periodic_sides_that_they_reach_through() {
        let domain = BoxDomain { lower: Vector::ZERO, upper: Vector::splat(10.0), cells: [1; 3] };
        let sphere = |at: Vector| Region::Sphere { centre: at, diameter: 4.0 };
        let images = |region: &Region, periodic: [bool; 3]| match region.repeated(&domain, periodic) {
            Region::Union(parts) => parts.len(),
            _ => 1,
        };
        let holds = |region: &Region, x: Vector| region.geometry().contains(x);
        let corner = sphere(Vector::ZERO);
        assert_eq!(
            (images(&corner, [true; 3]), images(&corner, [true, true, false]), images(&corner, [false; 3])),
            (8, 4, 1)
        );
        let (all, opposite) = (corner.repeated(&domain, [true; 3]), Vector::splat(9.5));
        assert!(holds(&all, opposite) && !holds(&corner, opposite));
        // Inside, up to a side, and longer than the box.
        for region in [
            sphere(Vector::splat(5.0)),
            sphere(Vector::splat(2.0)),
            Region::Box { lower: Vector::new(-20.0, 0.0, 0.0), upper: Vector::new(20.0, 10.0, 5.0) },
        ] {
            assert_eq!(images(&region, [true; 3]), 1, "{region:?}");
        }
        // As long as the box but elsewhere; each part of a union by itself; a jet along x1 through x2.
        let shifted = Region::Box { lower: Vector::new(-5.0, 0.0, 0.0), upper: Vector::new(5.0, 10.0, 5.0) };
        assert!(holds(&shifted.repeated(&domain, [true; 3]), Vector::new(8.0, 2.0, 2.0)));
        let two = Region::Union(vec![sphere(Vector::new(0.0, 5.0, 5.0)), sphere(Vector::new(9.0, 5.0, 5.0))]);
        let two = two.repeated(&domain, [true; 3]);
        assert!(holds(&two, Vector::new(9.5, 5.0, 5.0)) && holds(&two, Vector::new(0.5, 5.0, 5.0)));
    }
}
