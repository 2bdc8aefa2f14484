//! The six sides of the box: walls, periodic images, inlets and open sides.
//!
//! The kind of a side determines the ghost values of every field.

use sazanami_numerics::domain::{Ghost, GhostRules, Location};
use sazanami_numerics::{Real, Vector};

pub use crate::fluids::FluidName;
use crate::outside::PressureSide;

/// Boundary condition on a side of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    /// A no-slip wall at rest.
    NoSlip,
    /// A free-slip wall, or a plane of symmetry.
    Slip,
    /// A no-slip wall that moves in its own plane.
    Moving {
        /// Velocity of the wall [m/s]; the normal component is not used.
        velocity: Vector,
    },
    /// Periodic with the opposite side.
    Periodic,
    /// Fluid enters with a given velocity.
    Inflow {
        /// Velocity at the side [m/s].
        velocity: Vector,
        /// Fluid that enters.
        fluid: FluidName,
    },
    /// An opening to gas at rest, of pressure zero at the highest corner of the box. Liquid that stands before the side stands outside
    /// as well.
    Outflow,
    /// An opening to fluid at rest at a given pressure.
    FixedPressure {
        /// Pressure that the fluid outside has at the highest corner of the box \[Pa].
        pressure: Real,
        /// The fluid outside.
        fluid: FluidName,
    },
}

impl Side {
    /// Whether fluid can leave through it.
    #[must_use]
    pub fn is_open(&self) -> bool {
        matches!(self, Self::Outflow | Self::FixedPressure { .. })
    }

    /// Whether it is a wall.
    #[must_use]
    pub fn is_wall(&self) -> bool {
        matches!(self, Self::NoSlip | Self::Slip | Self::Moving { .. })
    }
}

/// Fluid that enters through an open side while the flow there is inward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Opening {
    /// Liquid fraction of what flows in.
    pub volume_fraction: Real,
    /// Velocity [m/s], if it is prescribed.
    pub velocity: Option<Vector>,
}

/// The boundary conditions are not consistent.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoundaryError {
    /// One side is periodic, its opposite is not.
    #[error("the lower and the upper side in x{} must both be periodic, or neither", direction + 1)]
    UnpairedPeriodicSide {
        /// Direction of the sides, from 0.
        direction: usize,
    },
    /// Fluid enters, and no side lets it out.
    #[error(
        "fluid flows in at a rate of {rate:e} m^3/s per m^2 of side, and there is no outflow or fixed-pressure side"
    )]
    NoOutlet {
        /// Largest inward speed [m/s].
        rate: Real,
    },
}

/// The angle without another at all sides \[rad].
const RIGHT_ANGLES: [[[Real; 2]; 2]; 3] = [[[std::f64::consts::FRAC_PI_2; 2]; 2]; 3];

/// The six sides of the box: lower and upper in each direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Boundary {
    sides: [[Side; 2]; 3],
    outside_gravity: Vector,
    /// Advancing and receding.
    contact_angles: [[[Real; 2]; 2]; 3],
}

impl Boundary {
    /// A box with these sides.
    ///
    /// # Errors
    /// [`BoundaryError`] if the sides contradict each other.
    pub fn new(sides: [[Side; 2]; 3]) -> Result<Self, BoundaryError> {
        let boundary = Self { sides, outside_gravity: Vector::ZERO, contact_angles: RIGHT_ANGLES };
        for (direction, pair) in sides.iter().enumerate() {
            if (pair[0] == Side::Periodic) != (pair[1] == Side::Periodic) {
                return Err(BoundaryError::UnpairedPeriodicSide { direction });
            }
        }
        let rate = boundary.largest_inward_speed();
        let inlets = sides.iter().flatten().filter(|side| matches!(side, Side::Inflow { .. })).count();
        let only_in = inlets == 1 && !sides.iter().flatten().any(Side::is_open);
        if rate > 0.0 && only_in {
            return Err(BoundaryError::NoOutlet { rate });
        }
        Ok(boundary)
    }

    /// Gives the fluid outside open sides, which is at rest, a `gravity` [m/s^2].
    #[must_use]
    pub fn with_gravity_outside(self, gravity: Vector) -> Self {
        Self { outside_gravity: gravity, ..self }
    }

    /// Gravity on the fluid outside open sides [m/s^2].
    #[must_use]
    pub fn gravity_outside(&self) -> Vector {
        self.outside_gravity
    }

    /// The same box with fluid that enters faster `by` a velocity [m/s].
    #[must_use]
    pub(crate) fn with_faster_inflow(mut self, by: Vector) -> Self {
        for side in self.sides.iter_mut().flatten() {
            if let Side::Inflow { velocity, .. } = side {
                *velocity += by;
            }
        }
        self
    }

    /// Gives walls the angles in the liquid between which an interface with surface tension meets them \[rad], between 0 and pi: the
    /// advancing one, and the receding one, which is no larger. Those of sides that are no walls are not used. Without, it meets them at a
    /// right angle.
    #[must_use]
    pub fn with_contact_angles(self, contact_angles: [[[Real; 2]; 2]; 3]) -> Self {
        Self { contact_angles, ..self }
    }

    /// Cotangents of the advancing and the receding contact angle of a side; 0 at a right angle, and of sides that are no walls.
    pub(crate) fn cotangents(&self, direction: usize, side: usize) -> [Real; 2] {
        self.contact_angles[direction][side].map(|angle| {
            // The cotangent of the nearest number to a right angle is not zero.
            let is_right = (angle - std::f64::consts::FRAC_PI_2).abs() < 1e-12;
            if self.sides[direction][side].is_wall() && !is_right { 1.0 / angle.tan() } else { 0.0 }
        })
    }

    /// A closed box with no-slip walls.
    #[must_use]
    pub fn closed() -> Self {
        Self { sides: [[Side::NoSlip; 2]; 3], outside_gravity: Vector::ZERO, contact_angles: RIGHT_ANGLES }
    }

    /// A box that is periodic in all directions.
    #[must_use]
    pub fn all_periodic() -> Self {
        Self { sides: [[Side::Periodic; 2]; 3], outside_gravity: Vector::ZERO, contact_angles: RIGHT_ANGLES }
    }

    /// Boundary conditions on the lower and the upper side in each direction.
    #[must_use]
    pub fn sides(&self) -> &[[Side; 2]; 3] {
        &self.sides
    }

    /// The periodic directions.
    #[must_use]
    pub fn periodic(&self) -> [bool; 3] {
        self.sides.map(|pair| pair[0] == Side::Periodic)
    }

    /// Whether a side lets fluid through other than to its periodic image.
    #[must_use]
    pub fn has_openings(&self) -> bool {
        (0..3).any(|direction| (0..2).any(|side| self.opening(direction, side).is_some()))
    }

    /// Inflow condition of a side, or `None` at walls and periodic sides.
    pub(crate) fn opening(&self, direction: usize, side: usize) -> Option<Opening> {
        match self.sides[direction][side] {
            Side::Inflow { velocity, fluid } => {
                Some(Opening { volume_fraction: fluid.volume_fraction(), velocity: Some(velocity) })
            }
            Side::Outflow => Some(Opening { volume_fraction: FluidName::Gas.volume_fraction(), velocity: None }),
            Side::FixedPressure { fluid, .. } => {
                Some(Opening { volume_fraction: fluid.volume_fraction(), velocity: None })
            }
            Side::NoSlip | Side::Slip | Side::Moving { .. } | Side::Periodic => None,
        }
    }

    fn largest_inward_speed(&self) -> Real {
        let inward = |direction: usize, side: usize| match self.sides[direction][side] {
            Side::Inflow { velocity, .. } if side == 0 => velocity[direction],
            Side::Inflow { velocity, .. } => -velocity[direction],
            _ => 0.0,
        };
        (0..6).map(|n| inward(n / 2, n % 2)).fold(0.0, Real::max)
    }

    fn rules(&self, location: Location, rule: impl Fn(usize, Side) -> Ghost) -> GhostRules {
        let sides = std::array::from_fn(|direction| self.sides[direction].map(|side| rule(direction, side)));
        GhostRules { location, sides }
    }

    /// Ghost rules of component `component` of the velocity in the cell centres.
    #[must_use]
    pub fn velocity_rules(&self, component: usize) -> GhostRules {
        self.rules(Location::Cell, |direction, side| velocity_ghost(component, direction, side))
    }

    /// Ghosts of a change of component `component` of the velocity: the rules of the velocity with
    /// walls and inlets at rest.
    #[must_use]
    pub fn velocity_change_rules(&self, component: usize) -> GhostRules {
        self.rules(Location::Cell, |direction, side| match velocity_ghost(component, direction, side) {
            Ghost::Odd { .. } => Ghost::Odd { wall: 0.0 },
            other => other,
        })
    }

    /// Ghosts of the normal velocity on the faces normal to `normal`; sets it on walls and inlets.
    #[must_use]
    pub fn face_velocity_rules(&self, normal: usize) -> GhostRules {
        self.rules(Location::Face(normal), |direction, side| match velocity_ghost(normal, direction, side) {
            // The face itself keeps what the pressure made of it.
            Ghost::Nearest if direction == normal => Ghost::Even,
            other => other,
        })
    }

    /// Boundary conditions of the pressure.
    #[must_use]
    pub fn pressure_sides(&self) -> [[PressureSide; 2]; 3] {
        self.sides.map(|pair| {
            pair.map(|side| match side {
                Side::NoSlip | Side::Slip | Side::Moving { .. } | Side::Inflow { .. } => PressureSide::Wall,
                Side::Outflow => PressureSide::Fixed { pressure: 0.0, fluid: FluidName::Gas },
                Side::FixedPressure { pressure, fluid } => PressureSide::Fixed { pressure, fluid },
                Side::Periodic => PressureSide::Periodic,
            })
        })
    }

    /// Ghosts of the liquid volume fraction.
    #[must_use]
    pub fn volume_fraction_rules(&self) -> GhostRules {
        self.rules(Location::Cell, |_, side| match side {
            Side::Inflow { fluid, .. } => Ghost::Constant { value: fluid.volume_fraction() },
            Side::Outflow | Side::FixedPressure { .. } => Ghost::Nearest,
            Side::NoSlip | Side::Slip | Side::Moving { .. } | Side::Periodic => Ghost::Even,
        })
    }
}

fn velocity_ghost(component: usize, direction: usize, side: Side) -> Ghost {
    let normal = component == direction;
    match side {
        Side::NoSlip => Ghost::Odd { wall: 0.0 },
        Side::Slip | Side::Moving { .. } if normal => Ghost::Odd { wall: 0.0 },
        Side::Slip => Ghost::Even,
        Side::Moving { velocity } | Side::Inflow { velocity, .. } => Ghost::Odd { wall: velocity[component] },
        Side::Outflow | Side::FixedPressure { .. } => Ghost::Nearest,
        Side::Periodic => Ghost::Kept,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moving_lid_drags_along_its_plane_only() {
        let lid = Side::Moving { velocity: Vector::new(1.0, 0.0, 7.0) };
        let mut sides = [[Side::NoSlip; 2]; 3];
        sides[2][1] = lid;
        let boundary = Boundary::new(sides).unwrap();
        assert_eq!(boundary.velocity_rules(0).sides[2][1], Ghost::Odd { wall: 1.0 });
        assert_eq!(boundary.velocity_rules(2).sides[2][1], Ghost::Odd { wall: 0.0 });
        assert_eq!(boundary.face_velocity_rules(2).sides[2][1], Ghost::Odd { wall: 0.0 });
        assert_eq!(boundary.velocity_change_rules(0).sides[2][1], Ghost::Odd { wall: 0.0 });
    }

    #[test]
    fn contradictory_sides_are_refused() {
        let mut sides = [[Side::NoSlip; 2]; 3];
        sides[1][0] = Side::Periodic;
        assert_eq!(Boundary::new(sides), Err(BoundaryError::UnpairedPeriodicSide { direction: 1 }));
        sides[1][0] = Side::Inflow { velocity: Vector::Y, fluid: FluidName::Liquid };
        assert_eq!(Boundary::new(sides), Err(BoundaryError::NoOutlet { rate: 1.0 }));
        sides[1][1] = Side::Outflow;
        assert!(Boundary::new(sides).is_ok());
    }
}
