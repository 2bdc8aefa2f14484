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
    /// Spacing of the lattice over the largest extent of the grains that share it.
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
    /// Stiffness of contacts while the grains fall and settle over their own, which they have when the bed is done; 1: their own
    /// throughout.
    pub stiffness_scale: Real,
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
            stiffness_scale: 1.0,
            tapping: None,
            step: 2e-5,
            substeps: Substeps::Auto,
            longest: 2.0,
            ghost_margin: 0.0,
        }
    }

    /// Puts `grains` on the lattice, layer by layer; what they are is left as it is. Grains of sizes more than a factor of two
    /// apart have layers of their own, as wide and high as they need, mixed in the order of the grains.
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
        let layers = Layers::of(self, &sizes).map_err(|spacing| {
            let id = grains.first().map_or(0, |g| g.id);
            DemError::BadGrain { id, what: format!("the box is narrower than {spacing} m") }
        })?;
        let mut random = Random::new(self.seed);
        for (grain, place) in grains.iter_mut().zip(&layers.places) {
            let Row { along, pitch, extent, height } = layers.rows[place.row];
            let (i, j) = (place.slot % along[0], place.slot / along[0] % along[1]);
            let k = place.slot / (along[0] * along[1]);
            let cell = Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real + 0.5);
            let shake = Vector::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            // Never so far that neighbours could touch.
            let shake = shake * (self.jitter * pitch).min(0.5 * (pitch - Vector::new(extent, extent, height)));
            grain.position = self.lower + place.base * Vector::Z + cell * pitch + shake;
            grain.orientation = match self.lattice {
                Lattice::Cubic => random.orientation(),
                Lattice::Low => lying(&bodies[grain.shape as usize], &mut random),
            };
        }
        Ok(())
    }

    /// Height of the lattice of grains, each of its largest extent and the height of its layer \[m]; `None` if the box is narrower
    /// than one of them.
    #[must_use]
    pub fn lattice_height(&self, sizes: &[[Real; 2]]) -> Option<Real> {
        Layers::of(self, sizes).ok().map(|layers| layers.height)
    }

    /// Stiffness that keeps overlaps small while grains fall through `drop` \[m] onto a bed of `mass` \[kg] [N/m]: of impacts below
    /// a fifth of a contact sphere's radius, and of the weight above below a twentieth. `grains` are mass \[kg], bounding radius
    /// and the radius of the smallest contact sphere \[m] of each kind.
    #[must_use]
    pub fn least_stiffness(&self, drop: Real, mass: Real, grains: impl IntoIterator<Item = [Real; 3]>) -> Real {
        let gravity = self.fall_factor * self.gravity;
        let size = self.upper - self.lower;
        let pressure = mass * gravity / (size.x * size.y);
        let of = |[mass, reach, sphere]: [Real; 3]| {
            // The deepest overlap of a free impact is v sqrt(m/K).
            let impact = mass * 2.0 * gravity * drop / (IMPACT * sphere).powi(2);
            impact.max(4.0 * reach * reach * pressure / (RESTING * sphere))
        };
        grains.into_iter().map(of).fold(0.0, Real::max)
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

/// Largest overlap of an impact over a contact sphere's radius with softer springs.
const IMPACT: Real = 0.2;
/// The same of a contact under the weight of the bed.
const RESTING: Real = 0.05;

/// The lattice of one class of sizes.
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

/// Place of a grain: its lattice, its number there, and the height from which that is counted \[m].
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    row: usize,
    slot: usize,
    base: Real,
}

/// Layers of grains of like size, one above the other.
#[derive(Clone, Debug)]
struct Layers {
    rows: Vec<Row>,
    places: Vec<Place>,
    height: Real,
}

/// Sizes farther apart than this have layers of their own.
const ALIKE: Real = 2.0;

impl Layers {
    /// Of grains of these extents and heights \[m]; the spacing \[m] that the box has no room for if it is too narrow.
    fn of(settings: &PackingSettings, sizes: &[[Real; 2]]) -> Result<Self, Real> {
        let (least, most) = sizes
            .iter()
            .fold((Real::INFINITY, 0.0_f64), |(low, high), [extent, _]| (low.min(*extent), high.max(*extent)));
        // Largest first; like sizes are one class.
        let class = |extent: Real| if most <= ALIKE * least { 0 } else { (most / extent).log(ALIKE) as usize };
        let mut members: Vec<Vec<usize>> = Vec::new();
        for (n, [extent, _]) in sizes.iter().enumerate() {
            let class = class(*extent);
            members.resize_with(members.len().max(class + 1), Vec::new);
            members[class].push(n);
        }
        members.retain(|members| !members.is_empty());
        let size = settings.upper - settings.lower;
        let mut rows = Vec::new();
        for members in &members {
            let largest = |d: usize| members.iter().map(|&n| sizes[n][d]).fold(0.0, Real::max);
            let (extent, height) = (largest(0), largest(1));
            let spacing = settings.spacing * extent;
            let along = [size.x, size.y].map(|l| (l / spacing).floor() as usize);
            if along.contains(&0) {
                return Err(spacing);
            }
            let pitch = Vector::new(size.x / along[0] as Real, size.y / along[1] as Real, settings.spacing * height);
            rows.push(Row { along, pitch, extent, height });
        }
        let mut places = vec![Place::default(); sizes.len()];
        let in_layer = |row: &Row| row.along[0] * row.along[1];
        if let ([members], [row]) = (&members[..], &rows[..]) {
            for (slot, &n) in members.iter().enumerate() {
                places[n].slot = slot;
            }
            let height = row.pitch.z * members.len().div_ceil(in_layer(row)) as Real;
            return Ok(Self { rows, places, height });
        }
        // Each layer comes where the grain in its middle stands among all.
        let mut layers: Vec<(usize, usize, &[usize])> = Vec::new();
        for (row, members) in members.iter().enumerate() {
            layers.extend(members.chunks(in_layer(&rows[row])).map(|layer| (layer[layer.len() / 2], row, layer)));
        }
        layers.sort_unstable();
        let mut base = 0.0;
        for (_, row, layer) in layers {
            for (slot, &n) in layer.iter().enumerate() {
                places[n] = Place { row, slot, base };
            }
            base += rows[row].pitch.z;
        }
        Ok(Self { rows, places, height: base })
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
