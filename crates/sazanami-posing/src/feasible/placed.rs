//! Grains whose places are known before the run, and where they lie.

use std::ops::Range;

use sazanami_numerics::geometry::Region;
use sazanami_numerics::{Quaternion, Real, Vector};

use super::Search;
use crate::assembly::grains::population_of;
use crate::case::meaning::GrainPlacement;

/// A grain that has a place already.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub population: usize,
    pub index: usize,
    pub position: Vector,
    pub orientation: Quaternion,
    pub factor: Real,
    /// Origin of its place.
    pub origin: Origin,
}

/// File that gave a grain its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    /// By the case file.
    Case,
    /// By a bed file; whether it will still move before the run begins.
    Bed { relaxes: bool },
}

impl Search<'_> {
    /// A grain that begins where it is now.
    pub(super) fn as_it_lies(&self, grain: &sazanami_dem::Grain) -> Placed {
        let (population, index) = population_of(grain.id);
        let origin = match &self.case.grains[population].placement {
            GrainPlacement::Bed(bed) => Origin::Bed { relaxes: bed.relax },
            _ => Origin::Case,
        };
        Placed {
            population,
            index: index as usize,
            position: grain.position,
            orientation: grain.orientation,
            factor: grain.scale,
            origin,
        }
    }

    /// Names a grain and points to it as well as the file allows.
    pub(super) fn name(&self, grain: &Placed) -> (String, Range<usize>) {
        let population = &self.case.grains[grain.population];
        let path = format!("grains.{}.placement.list.{}.position", grain.population, grain.index);
        (format!("grain {} of `{}`", grain.index, population.name), self.loaded.places.at(&path))
    }

    /// Height of the lowest point of a grain's contact spheres \[m].
    pub(super) fn lowest(&self, grain: &Placed) -> Real {
        self.spheres(grain).iter().map(|(centre, radius)| centre.z - radius).fold(Real::INFINITY, Real::min)
    }

    /// Contact spheres of a grain where it lies.
    pub(super) fn spheres(&self, grain: &Placed) -> Vec<(Vector, Real)> {
        let spheres = self.shapes[grain.population].contact_spheres();
        let at = |(&centre, &radius): (&Vector, &Real)| {
            (grain.position + grain.orientation * (grain.factor * centre), grain.factor * radius)
        };
        spheres.centres.iter().zip(&spheres.radii).map(at).collect()
    }

    /// Corners of the box round the surface of a grain: of the smooth shape where it has one, else of its mesh \[m].
    ///
    /// Nodes of a mesh that keeps the volume of a sphere stand out of the sphere.
    pub(super) fn surface(&self, grain: &Placed) -> [Vector; 2] {
        match self.shapes[grain.population].exact() {
            Some(exact) => {
                let half = grain.factor * exact.half_extents(grain.orientation);
                [grain.position - half, grain.position + half]
            }
            None => self.nodes(grain).fold(no_corners(), |[low, high], x| [low.min(x), high.max(x)]),
        }
    }

    /// Nodes of a grain where it lies \[m].
    fn nodes(&self, grain: &Placed) -> impl Iterator<Item = Vector> {
        let grain = *grain;
        let nodes = &self.shapes[grain.population].mesh().nodes;
        nodes.iter().map(move |&node| grain.position + grain.orientation * (grain.factor * node))
    }

    pub(super) fn touches(&self, region: &Region, grain: &Placed) -> bool {
        let reach = grain.factor * self.shapes[grain.population].bounding_radius();
        region.touches_ball(grain.position, reach)
            && (self.nodes(grain).any(|x| region.contains(x))
                || self.spheres(grain).iter().any(|&(centre, radius)| region.touches_ball(centre, radius)))
    }
}

/// Corners of a box that holds nothing yet.
pub(super) const fn no_corners() -> [Vector; 2] {
    [Vector::INFINITY, Vector::NEG_INFINITY]
}
