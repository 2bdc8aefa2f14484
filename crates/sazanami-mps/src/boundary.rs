//! The box, its sides, and the lattice of wall particles.

use sazanami_numerics::particles::WALL;
use sazanami_numerics::{Real, Vector};

use crate::gates::{Gate, MOST_GATES, NEAREST};
use crate::particles::{Kind, ParticleRecord};

/// A side of the box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// A wall of particles.
    #[default]
    Wall,
    /// Open: fluid may leave the box, as over the rim of a tank.
    Open,
    /// Periodic, with the opposite side.
    Periodic,
}

/// Velocity condition at walls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WallFriction {
    /// No slip: the fluid at a wall moves with it.
    #[default]
    NoSlip,
    /// Free slip: no shear stress at walls.
    Slip,
}

/// A box with walls of particles, which may move as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Tank {
    /// Lower corner of the box at the start \[m].
    pub lower: Vector,
    /// Upper corner of the box at the start \[m].
    pub upper: Vector,
    /// Lower and upper side in each direction.
    pub sides: [[Side; 2]; 3],
    /// Velocity condition at the lower and the upper wall in each direction; of other sides without meaning.
    pub friction: [[WallFriction; 2]; 3],
    /// Displacement of the walls since the start \[m].
    pub displacement: Vector,
    /// Velocity of the walls [m/s].
    pub velocity: Vector,
    /// Plates across the box, all normal to the same direction; they do not move with the walls.
    pub gates: Vec<Gate>,
}

/// A point, or one of its mirror images in walls and gates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Image {
    /// \[m]
    pub position: Vector,
    /// Directions in which a wall mirrors it.
    pub in_wall: [bool; 3],
    /// Direction in which a gate does.
    pub in_gate: Option<usize>,
}

impl Image {
    /// Whether it is not the point itself.
    pub fn is_mirrored(&self) -> bool {
        self.in_wall.contains(&true) || self.in_gate.is_some()
    }
}

/// The extent of the box in a direction is not a multiple of the particle spacing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the box is {:.6} mm long in x{}: the nearest lattice that fits has a spacing of {:.6} mm, more than 2 % away from \
     the particle spacing of {:.6} mm",
    1e3 * length, direction + 1, 1e3 * found, 1e3 * spacing
)]
pub struct LatticeError {
    /// Direction, from 0.
    pub direction: usize,
    /// Extent of the box \[m].
    pub length: Real,
    /// Spacing of the fluid particles \[m].
    pub spacing: Real,
    /// Nearest spacing that fits \[m].
    pub found: Real,
}

/// Allowed relative difference between the spacings of wall lattice and fluid.
const LATTICE_TOLERANCE: Real = 0.02;
/// Filled fraction of a closed box above which it has no free surface.
const FULL: Real = 0.99;
/// Part of a distance that is round-off.
const ROUND_OFF: Real = 1e-9;

impl Tank {
    /// A box at rest, all walls alike.
    #[must_use]
    pub fn new(lower: Vector, upper: Vector, sides: [[Side; 2]; 3], friction: WallFriction) -> Self {
        let (friction, still) = ([[friction; 2]; 3], Vector::ZERO);
        Self { lower, upper, sides, friction, displacement: still, velocity: still, gates: Vec::new() }
    }

    /// Velocity condition at gates, and of the published scheme at all walls: free slip where any wall has it.
    pub(crate) fn common_friction(&self) -> WallFriction {
        let slips = |(side, friction): (&Side, &WallFriction)| *side == Side::Wall && *friction == WallFriction::Slip;
        let any = self.sides.as_flattened().iter().zip(self.friction.as_flattened()).any(slips);
        if any { WallFriction::Slip } else { WallFriction::NoSlip }
    }

    /// Whether a volume of fluid and grains [m^3] fills a closed box, so that there is no free surface.
    pub(crate) fn is_full(&self, volume: Real) -> bool {
        let closed = self.sides.as_flattened().iter().all(|&side| side != Side::Open);
        closed && volume > FULL * (self.upper - self.lower).element_product()
    }

    /// Calls `see` with the point `x` \[m] and its images in the planes of walls and gates nearer than `radius` \[m]; images of
    /// images fill edges and corners.
    pub(crate) fn for_each_image(&self, x: Vector, radius: Real, mut see: impl FnMut(&Image)) {
        let as_it_is = Image { position: x, in_wall: [false; 3], in_gate: None };
        self.mirror(as_it_is, 0, radius, &mut see);
    }

    /// [`Self::for_each_image`] of an image from `direction` on.
    fn mirror(&self, image: Image, direction: usize, radius: Real, see: &mut impl FnMut(&Image)) {
        if direction == 3 {
            return see(&image);
        }
        self.mirror(image, direction + 1, radius, see);
        let coordinate = image.position[direction];
        let mut in_plane = |plane: Real, mut mirrored: Image| {
            if (coordinate - plane).abs() < radius {
                mirrored.position[direction] = 2.0 * plane - coordinate;
                self.mirror(mirrored, direction + 1, radius, see);
            }
        };
        for gate in self.gates.iter().filter(|gate| gate.direction == direction && !gate.is_gone()) {
            in_plane(gate.place, Image { in_gate: Some(direction), ..image });
        }
        for (side, corner) in [self.lower, self.upper].into_iter().enumerate() {
            if self.sides[direction][side] == Side::Wall {
                let mut mirrored = image;
                mirrored.in_wall[direction] = true;
                in_plane(corner[direction] + self.displacement[direction], mirrored);
            }
        }
    }

    /// Whether gates are normal to one direction, along which there are walls, and keep `room` \[m] from these and from each
    /// other.
    pub(crate) fn has_room_for_gates(&self, room: Real) -> bool {
        self.gates.len() <= MOST_GATES
            && self.gates.iter().enumerate().all(|(n, gate)| {
                let d = gate.direction;
                let others = self.gates[..n]
                    .iter()
                    .all(|other| other.direction == d && (other.place - gate.place).abs() >= room * (1.0 - ROUND_OFF));
                let nearest = (gate.place - self.lower[d]).min(self.upper[d] - gate.place);
                d < 2 && others && self.sides[d][0] != Side::Periodic && nearest >= room * (1.0 - ROUND_OFF)
            })
    }

    /// Spacing in each direction of the lattice nearest to `spacing` \[m] that fits the box \[m].
    ///
    /// # Errors
    /// [`LatticeError`] if it differs by more than 2 %.
    pub fn lattice(&self, spacing: Real) -> Result<Vector, LatticeError> {
        let mut fitted = Vector::ZERO;
        for direction in 0..3 {
            let length = self.upper[direction] - self.lower[direction];
            let found = length / (length / spacing).round().max(1.0);
            // An open side need not lie on the lattice.
            let open = self.sides[direction].contains(&Side::Open);
            if !open && (found / spacing - 1.0).abs() > LATTICE_TOLERANCE {
                return Err(LatticeError { direction, length, spacing, found });
            }
            fitted[direction] = if open { spacing } else { found };
        }
        Ok(fitted)
    }

    /// Wall and dummy particles at the start; `reach` is the radius of influence \[m].
    ///
    /// # Errors
    /// [`LatticeError`] if no lattice of about `spacing` \[m] fits.
    pub(crate) fn particles(&self, spacing: Real, reach: Real) -> Result<Vec<ParticleRecord>, LatticeError> {
        let lattice = self.lattice(spacing)?;
        // The first layer, and as many as lie within its radius of influence.
        let layers = 1 + (reach / spacing * (1.0 + 1e-9)).floor() as i64;
        let extent = self.upper - self.lower;
        let counts: [i64; 3] = std::array::from_fn(|d| (extent[d] / lattice[d]).round() as i64);
        // Where only the upper side is a wall, the lattice begins there.
        let base = Vector::from_array(std::array::from_fn(|d| match self.sides[d] {
            [Side::Open, Side::Wall] => self.upper[d] - counts[d] as Real * lattice[d],
            _ => self.lower[d],
        }));
        let range = |d: usize| {
            let beyond = |side: usize| if self.sides[d][side] == Side::Wall { layers } else { 0 };
            -beyond(0)..counts[d] + beyond(1)
        };
        let mut records = Vec::new();
        let depth = |n: i64, d: usize| if n < 0 { -n } else { (n - counts[d] + 1).max(0) };
        for k in range(2) {
            for j in range(1) {
                for i in range(0) {
                    let deepest = depth(i, 0).max(depth(j, 1)).max(depth(k, 2));
                    if deepest == 0 {
                        continue;
                    }
                    let kind = if deepest == 1 { Kind::Wall } else { Kind::Dummy };
                    let place = Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real + 0.5);
                    let id = WALL + records.len() as u64;
                    records.push(ParticleRecord::new(id, kind, base + place * lattice, Vector::ZERO));
                }
            }
        }
        Ok(records)
    }

    /// Moves a fluid particle that came too close to a wall back and removes its velocity into the wall; returns whether
    /// it did.
    pub(crate) fn clip(&self, spacing: Real, position: &mut Vector, velocity: &mut Vector) -> bool {
        let mut clipped = false;
        for d in 0..3 {
            let [lower, upper] = self.sides[d];
            let low = self.lower[d] + self.displacement[d] + NEAREST * spacing;
            let high = self.upper[d] + self.displacement[d] - NEAREST * spacing;
            if lower == Side::Wall && position[d] < low {
                position[d] = low;
                velocity[d] = velocity[d].max(self.velocity[d]);
                clipped = true;
            } else if upper == Side::Wall && position[d] > high {
                position[d] = high;
                velocity[d] = velocity[d].min(self.velocity[d]);
                clipped = true;
            }
        }
        clipped
    }

    /// The same for a particle that went from `from` to a `position` \[m] among gates.
    pub(crate) fn clip_from(&self, spacing: Real, from: Vector, position: &mut Vector, velocity: &mut Vector) -> bool {
        let mut held = false;
        for gate in self.gates.iter().filter(|gate| !gate.is_gone()) {
            held |= gate.clip(spacing, from, position, velocity);
        }
        self.clip(spacing, position, velocity) || held
    }

    /// The point in the fluid that mirrors a `position` \[m] behind walls.
    pub(crate) fn mirrored(&self, position: Vector) -> Vector {
        let mut mirrored = position;
        for d in 0..3 {
            let (low, high) = (self.lower[d] + self.displacement[d], self.upper[d] + self.displacement[d]);
            if self.sides[d][0] == Side::Wall && position[d] < low {
                mirrored[d] = 2.0 * low - position[d];
            } else if self.sides[d][1] == Side::Wall && position[d] > high {
                mirrored[d] = 2.0 * high - position[d];
            }
        }
        mirrored
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sazanami_numerics::particles::Stored;

    fn tank() -> Tank {
        let sides = [[Side::Wall; 2], [Side::Periodic; 2], [Side::Wall, Side::Open]];
        Tank::new(Vector::ZERO, Vector::new(8.0, 7.0, 5.0), sides, WallFriction::NoSlip)
    }

    #[test]
    fn walls_have_one_layer_with_pressure_and_dummies_behind() {
        let records = tank().particles(1.0, 3.1).unwrap();
        let walls = records.iter().filter(|r| r.kind == Kind::Wall.store()).count();
        // Floor with its two edges, and two sides of five layers.
        assert_eq!(walls, (8 + 2) * 7 + 2 * 5 * 7);
        assert_eq!(records.len(), (8 + 8) * 7 * (5 + 4) - 8 * 7 * 5);
        assert!(records.iter().all(|r| r.position[2] < 5.0 && r.position[1] > 0.0 && r.position[1] < 7.0));
    }

    #[test]
    fn the_lattice_starts_at_the_wall_where_the_other_side_is_open() {
        let mut tank = tank();
        tank.sides[0] = [Side::Open, Side::Wall];
        tank.upper.x = 8.3;
        let nearest = |tank: &Tank| {
            let walls = tank.particles(1.0, 3.1).unwrap();
            let beyond = walls.iter().map(|r| r.position[0]).filter(|&x| x > 8.0);
            beyond.fold(Real::INFINITY, Real::min) - tank.upper.x
        };
        assert!((nearest(&tank) - 0.5).abs() < 1e-12);
        tank.sides[0] = [Side::Wall, Side::Open];
        assert!(tank.particles(1.0, 3.1).unwrap().iter().any(|r| (r.position[0] + 0.5).abs() < 1e-12));
    }

    #[test]
    fn a_box_that_is_not_a_multiple_of_the_spacing_is_refused() {
        let mut tank = tank();
        tank.upper.x = 8.1;
        assert!((tank.lattice(1.0).unwrap().x - 8.1 / 8.0).abs() < 1e-12);
        tank.upper.x = 8.3;
        assert_eq!(tank.lattice(1.0).unwrap_err().direction, 0);
    }

    #[test]
    fn clipped_particles_lose_their_velocity_into_the_wall() {
        let (mut x, mut u) = (Vector::new(0.1, 3.0, 4.0), Vector::new(-1.0, 2.0, 3.0));
        assert!(tank().clip(1.0, &mut x, &mut u));
        assert_eq!((x, u), (Vector::new(0.2, 3.0, 4.0), Vector::new(0.0, 2.0, 3.0)));
        assert!(!tank().clip(1.0, &mut x, &mut u));
        assert_eq!(tank().mirrored(Vector::new(-0.5, 1.0, -1.5)), Vector::new(0.5, 1.0, 1.5));
    }
}
