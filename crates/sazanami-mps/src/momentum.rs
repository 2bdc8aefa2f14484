//! Momentum budget of the fluid.
//!
//! In a step the fluid gains `M b dt` from the body force, `sum p A n dt` from the pressure on the walls, the wall part of
//! `sum m nu lap(u) dt` from wall friction, and the impulses that keep particles off the walls; drag and pressure force of
//! the grains are in the report of the coupling. Forces between fluid particles should cancel: repulsion does, viscosity
//! does where the void fraction is uniform, the corrected gradient only as far as it is consistent, and the pressure
//! vanishes at the centres of surface particles, half a spacing below the actual surface. The residual of the budget
//! measures how well the forces on particles add up to those on walls and grains.

use sazanami_numerics::Vector;

use crate::boundary::Tank;

/// External impulses on the fluid in a step, or since the start [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FluidImpulses {
    /// Impulse of the body force.
    pub body_force: Vector,
    /// Impulse of the walls by pressure.
    pub wall_pressure: Vector,
    /// Impulse of the walls by friction.
    pub friction: Vector,
    /// Impulse of the walls by repulsion, collisions and clipping to the box.
    pub contact: Vector,
}

/// Area vector of a wall particle in the first layer, along the normal into the box [m^2]; zero for edges, corners and
/// deeper layers. `start` is its initial position, `lattice` the spacing of the wall lattice in each direction [m].
pub(crate) fn facet(tank: &Tank, lattice: Vector, start: Vector) -> Vector {
    let mut facet = Vector::ZERO;
    let mut outside = 0;
    for d in 0..3 {
        let (below, above) = (tank.lower[d] - start[d], start[d] - tank.upper[d]);
        if below > 0.0 || above > 0.0 {
            outside += 1;
            let area = lattice[(d + 1) % 3] * lattice[(d + 2) % 3];
            facet[d] = if below.max(above) < lattice[d] { area * below.signum() } else { 0.0 };
        }
    }
    if outside == 1 { facet } else { Vector::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::{Side, WallFriction};

    #[test]
    fn wall_area_vectors_sum_to_the_area_of_the_walls() {
        let sides = [[Side::Wall; 2], [Side::Periodic; 2], [Side::Wall, Side::Open]];
        let tank = Tank::new(Vector::ZERO, Vector::new(8.0, 7.0, 5.0), sides, WallFriction::NoSlip);
        let lattice = tank.lattice(1.0).unwrap();
        let walls = tank.particles(1.0, 3.1).unwrap();
        let facets = walls.iter().map(|wall| facet(&tank, lattice, Vector::from_array(wall.position)));
        let (sum, whole) = facets.fold((Vector::ZERO, Vector::ZERO), |(sum, whole), f| (sum + f, whole + f.abs()));
        // The end walls face each other, the floor faces up.
        assert_eq!(sum, Vector::new(0.0, 0.0, 8.0 * 7.0));
        assert_eq!(whole, Vector::new(2.0 * 7.0 * 5.0, 0.0, 8.0 * 7.0));
    }
}
