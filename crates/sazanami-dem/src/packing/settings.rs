//! Settings of a packing: box, lattice of the first places, fall, conditions of rest, tapping.

use sazanami_numerics::choices;
use sazanami_numerics::{Quaternion, Real, Vector};

use crate::body::Body;
use crate::contact::laws::Interactions;
use crate::engine::{Setup, Substeps};
use crate::error::DemError;
use crate::grain::Grain;
use crate::random::Random;
use crate::wall::Wall;

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

/// A floor that moves up and down to make a bed denser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tapping {
    /// Amplitude \[m].
    pub amplitude: Real,
    /// Frequency \[Hz].
    pub frequency: Real,
    /// Number of full periods.
    pub periods: u32,
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
    /// Layout of the first positions.
    pub lattice: Lattice,
    /// Spacing of the lattice over the largest grain's extent.
    pub spacing: Real,
    /// Random displacement over spacing.
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
    /// Tapping after settling; none unless a porosity is aimed at.
    pub tapping: Option<Tapping>,
    /// Time of a step of [`Packing::step`](crate::Packing::step) \[s].
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
            tapping: None,
            step: 2e-5,
            substeps: Substeps::Auto,
            longest: 2.0,
            ghost_margin: 0.0,
        }
    }

    /// Puts `grains` on the lattice, layer by layer; what they are is left as it is.
    ///
    /// # Errors
    /// [`DemError::BadGrain`] if the box is narrower than a grain or a shape is missing.
    pub fn arrange(&self, bodies: &[Body], grains: &mut [Grain]) -> Result<(), DemError> {
        let mut extent: Real = 0.0;
        let mut height: Real = 0.0;
        for grain in grains.iter() {
            let body = bodies
                .get(grain.shape as usize)
                .ok_or_else(|| DemError::BadGrain { id: grain.id, what: "there is no such shape".to_string() })?;
            extent = extent.max(2.0 * body.bounding_radius * grain.scale);
            height = height.max(grain.scale * self.layer(body));
        }
        let size = self.upper - self.lower;
        let spacing = self.spacing * extent;
        let along = [size.x, size.y].map(|l| (l / spacing).floor() as usize);
        if along.contains(&0) {
            let id = grains.first().map_or(0, |g| g.id);
            return Err(DemError::BadGrain { id, what: format!("the box is narrower than {spacing} m") });
        }
        let pitch = Vector::new(size.x / along[0] as Real, size.y / along[1] as Real, self.spacing * height);
        let mut random = Random::new(self.seed);
        let room = pitch - Vector::new(extent, extent, height);
        for (n, grain) in grains.iter_mut().enumerate() {
            let (i, j) = (n % along[0], n / along[0] % along[1]);
            let k = n / (along[0] * along[1]);
            let cell = Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real + 0.5);
            let shake = Vector::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            // Never so far that neighbours could touch.
            let shake = shake * (self.jitter * pitch).min(0.5 * room);
            grain.position = self.lower + cell * pitch + shake;
            grain.orientation = match self.lattice {
                Lattice::Cubic => random.orientation(),
                Lattice::Low => lying(&bodies[grain.shape as usize], &mut random),
            };
        }
        Ok(())
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
        let mut walls = Wall::of_box(self.lower, self.upper, self.wall_material, [x, y, [false; 2]]);
        walls.push(Wall::at_rest(self.lower, Vector::Z, self.wall_material));
        walls
    }

    pub(super) fn setup(&self, bodies: Vec<Body>, interactions: Interactions) -> Setup {
        let mut lower = self.lower;
        // A tapping floor takes the bed below its first place.
        lower.z -= self.tapping.map_or(0.0, |t| 2.0 * t.amplitude);
        let mut upper = self.upper;
        upper.z = Real::INFINITY;
        Setup { bodies, interactions, walls: self.walls(), region: [lower, upper], ghost_margin: self.ghost_margin }
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
