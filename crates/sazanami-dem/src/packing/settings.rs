//! Settings of a packing: box, lattice of the first places, fall, conditions of rest.

use sazanami_numerics::choices;
use sazanami_numerics::{Quaternion, Real, Vector};

use super::scatter::{scatter, scattered_height};
use crate::body::Body;
use crate::contact::laws::Interactions;
use crate::engine::{Setup, Substeps};
use crate::error::DemError;
use crate::grain::Grain;
use crate::wall::Wall;
use sazanami_numerics::Random;

choices! {
    /// Layout of the lattice.
    #[derive(Default)]
    pub enum Lattice {
        /// Cubic, room for every orientation, orientations uniformly random.
        #[default]
        Cubic = "tall",
        /// Low: long axes within 10 degrees of the horizontal in random directions, layers as close as
        /// that allows. Falls less far; some of the initial order remains in the bed.
        Low = "low",
    }
}

/// Settings of the packing of a bed.
#[derive(Clone, Debug, PartialEq)]
pub struct PackingSettings {
    /// Lower corner of the box \[m].
    pub lower: Vector,
    /// Upper corner of the box \[m]; its height does not limit the grains.
    pub upper: Vector,
    /// Directions among x1 and x2 that are periodic instead of walled.
    pub periodic: [bool; 2],
    /// Number of the material of floor and side walls.
    pub wall_material: u32,
    /// Material of its vertical sides.
    pub side_material: u32,
    /// Layout of the first positions.
    pub lattice: Lattice,
    /// Spacing of the lattice over the largest extent of the grains that share it.
    pub spacing: Real,
    /// Random displacement over spacing, up to half of what the spacing leaves between neighbours.
    pub jitter: Real,
    /// Seed of positions and orientations.
    pub seed: u64,
    /// Gravity, downward [m/s^2].
    pub gravity: Real,
    /// Gravity during the fall over gravity.
    pub fall_factor: Real,
    /// Time after the fall before the bed can be done \[s].
    pub settling_time: Real,
    /// Whether the settling time alone decides, as in the paper.
    pub by_time_only: bool,
    /// Largest mean speed of a bed at rest [m/s].
    pub rest_speed: Real,
    /// Largest kinetic energy of a bed at rest, over weight times thickness of a grain.
    pub rest_energy: Real,
    /// Factor on friction until the fall has ended; below 1 beds are denser. 1 unless a porosity is aimed at.
    pub fall_friction: Real,
    /// Shortest step of [`Packing::step`](crate::Packing::step): a sub-step may be longer \[s].
    pub step: Real,
    /// Sub-steps within a step.
    pub substeps: Substeps,
    /// Time after which packing is given up \[s].
    pub longest: Real,
    /// See [`Setup::ghost_margin`].
    pub ghost_margin: Real,
}

impl PackingSettings {
    /// The paper's procedure in a box.
    #[must_use]
    pub const fn new(lower: Vector, upper: Vector) -> Self {
        Self {
            lower,
            upper,
            periodic: [false; 2],
            wall_material: 0,
            side_material: 0,
            lattice: Lattice::Cubic,
            spacing: 1.05,
            jitter: 0.02,
            seed: 1,
            gravity: 9.8,
            fall_factor: 4.0,
            settling_time: 5e-3,
            by_time_only: false,
            rest_speed: 2e-3,
            rest_energy: 1e-3,
            fall_friction: 1.0,
            step: 2e-5,
            substeps: Substeps::Auto,
            longest: 2.0,
            ghost_margin: 0.0,
        }
    }

    /// Puts `grains` on the lattice, layer by layer; what they are is left as it is. Grains of sizes more than a factor of two
    /// apart have no lattice: they are scattered at random, the largest first.
    ///
    /// # Errors
    /// [`DemError::BadGrain`] if the box is narrower than a grain or a shape is missing.
    pub fn arrange(&self, bodies: &[Body], grains: &mut [Grain]) -> Result<(), DemError> {
        let size = |grain: &Grain| {
            let missing = || DemError::BadGrain { id: grain.id, what: "there is no such shape".to_string() };
            let body = bodies.get(grain.shape as usize).ok_or_else(missing)?;
            Ok([2.0 * body.bounding_radius * grain.scale, grain.scale * self.layer(body)])
        };
        let sizes: Vec<[Real; 2]> = grains.iter().map(size).collect::<Result<_, DemError>>()?;
        let id = grains.first().map_or(0, |g| g.id);
        let narrow = |spacing| DemError::BadGrain { id, what: format!("the box is narrower than {spacing} m") };
        let mut random = Random::new(self.seed);
        if unlike(&sizes) {
            let radii: Vec<Real> = sizes.iter().map(|[extent, _]| 0.5 * extent).collect();
            let places = scatter(self.upper - self.lower, self.periodic, &radii, &mut random).map_err(narrow)?;
            for (grain, place) in grains.iter_mut().zip(places) {
                grain.position = self.lower + place;
                grain.orientation = self.orientation(&bodies[grain.shape as usize], &mut random);
            }
            return Ok(());
        }
        let row = Row::of(self, &sizes).map_err(narrow)?;
        let Row { along, pitch, extent, height } = row;
        for (slot, grain) in grains.iter_mut().enumerate() {
            let (i, j, k) = (slot % along[0], slot / along[0] % along[1], slot / row.in_layer());
            let cell = Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real + 0.5);
            let shake = Vector::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            // Never so far that neighbours could touch; not at all where they do already.
            let free = (pitch - Vector::new(extent, extent, height)).max(Vector::ZERO);
            let shake = shake * (self.jitter * pitch).min(0.5 * free);
            grain.position = self.lower + cell * pitch + shake;
            grain.orientation = self.orientation(&bodies[grain.shape as usize], &mut random);
        }
        Ok(())
    }

    /// A first orientation.
    fn orientation(&self, body: &Body, random: &mut Random) -> Quaternion {
        match self.lattice {
            Lattice::Cubic => random.orientation(),
            Lattice::Low => lying(body, random),
        }
    }

    /// Height that grains fill at first, each of its largest extent and the height of its layer \[m], about where they are
    /// scattered; `None` if the box is narrower than one of them.
    #[must_use]
    pub fn lattice_height(&self, sizes: &[[Real; 2]]) -> Option<Real> {
        let row = Row::of(self, sizes).ok()?;
        if unlike(sizes) {
            let radii = sizes.iter().map(|[extent, _]| 0.5 * extent);
            return Some(scattered_height(self.upper - self.lower, radii));
        }
        Some(row.pitch.z * sizes.len().div_ceil(row.in_layer()) as Real)
    }

    /// Time in which velocities fall to 1/e once gravity has its true value, of grains of this mean thickness \[m] \[s].
    #[must_use]
    pub fn slowing_time(&self, thickness: Real) -> Real {
        SLOWING * (thickness / self.gravity).sqrt()
    }

    /// Height of a layer of grains.
    fn layer(&self, body: &Body) -> Real {
        let c = &body.capsule;
        let length = (c.upper - c.lower) * TILT.sin();
        let lying = 2.0 * c.radius + length + (c.upper + c.lower).abs() * TILT.sin();
        if self.lattice == Lattice::Low { lying.min(2.0 * body.bounding_radius) } else { 2.0 * body.bounding_radius }
    }

    fn walls(&self) -> Vec<Wall> {
        let [x, y] = self.periodic.map(|periodic| [!periodic; 2]);
        // The floor comes last.
        let mut walls = Wall::of_box(self.lower, self.upper, self.side_material, [x, y, [false; 2]]);
        walls.push(Wall::at_rest(self.lower, Vector::Z, self.wall_material));
        walls
    }

    /// With `room` for grains beyond the walls \[m].
    pub(super) fn setup(&self, bodies: Vec<Body>, interactions: Interactions, room: Real) -> Setup {
        let lower = self.lower - room;
        let mut upper = self.upper + room;
        upper.z = Real::INFINITY;
        Setup { bodies, interactions, walls: self.walls(), region: [lower, upper], ghost_margin: self.ghost_margin }
    }
}

/// See [`PackingSettings::slowing_time`]: over the time in which a grain falls by half its thickness.
const SLOWING: Real = 3.0;

/// The lattice.
#[derive(Clone, Copy, Debug)]
struct Row {
    /// Places along x1 and x2.
    along: [usize; 2],
    /// Distances of places \[m].
    pitch: Vector,
    /// Largest extent and height of its grains \[m].
    extent: Real,
    height: Real,
}

/// Sizes farther apart than this share no lattice.
pub(super) const ALIKE: Real = 2.0;

/// Whether sizes are too far apart for a lattice.
fn unlike(sizes: &[[Real; 2]]) -> bool {
    let ends = (Real::INFINITY, 0.0_f64);
    let (least, most) = sizes.iter().fold(ends, |(low, high), [extent, _]| (low.min(*extent), high.max(*extent)));
    most > ALIKE * least
}

impl Row {
    /// Of grains of these extents and heights \[m]; the spacing \[m] that the box has no room for if it is too narrow.
    fn of(settings: &PackingSettings, sizes: &[[Real; 2]]) -> Result<Self, Real> {
        let largest = |d: usize| sizes.iter().map(|size| size[d]).fold(0.0, Real::max);
        let (extent, height) = (largest(0), largest(1));
        let spacing = settings.spacing * extent;
        let size = settings.upper - settings.lower;
        let along = [size.x, size.y].map(|l| (l / spacing).floor() as usize);
        if along.contains(&0) {
            return Err(spacing);
        }
        let pitch = Vector::new(size.x / along[0] as Real, size.y / along[1] as Real, settings.spacing * height);
        Ok(Self { along, pitch, extent, height })
    }

    /// Places in a layer.
    fn in_layer(&self) -> usize {
        self.along[0] * self.along[1]
    }
}

/// Largest angle of a grain of the low lattice to the horizontal \[rad].
pub const TILT: Real = 10.0 / 180.0 * std::f64::consts::PI;

/// An orientation with the capsule's axis horizontal but for a small random tilt, and a random rotation about it.
fn lying(body: &Body, random: &mut Random) -> Quaternion {
    let axis = Vector::AXES[body.capsule.axis];
    let azimuth = random.between(0.0, 2.0 * std::f64::consts::PI);
    let tilt = random.between(-TILT, TILT);
    let along = Vector::new(azimuth.cos() * tilt.cos(), azimuth.sin() * tilt.cos(), tilt.sin());
    let about = Quaternion::from_axis_angle(along, random.between(0.0, 2.0 * std::f64::consts::PI));
    about * Quaternion::from_rotation_arc(axis, along)
}
