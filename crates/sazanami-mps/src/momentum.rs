//! What acts on the fluid from outside, for its budget of momentum.
//!
//! The fluid gains `M b dt` by the body force, `sum p A n dt` by the pressure on the walls it stands before, the walls'
//! part of `sum m nu lap(u) dt` by their friction, and what keeps particles off them; drag and pressure of the grains stand
//! in the report of the coupling. Forces between fluid particles should cancel. Pushes do. Viscosity does where the void
//! fraction is even, those of the corrected gradient as far as it is consistent, and the pressure vanishes in the middle of
//! the particles at the surface, half a spacing below where the water ends: what is left over, the residual of the budget,
//! tells how well what the particles feel adds up to what walls and grains feel.

use sazanami_numerics::Vector;

use crate::boundary::Tank;

/// Impulses on the fluid from outside in a step, or since the start [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FluidImpulses {
    /// Of the body force.
    pub body_force: Vector,
    /// Of the pressure on the walls.
    pub wall_pressure: Vector,
    /// Of the walls' friction.
    pub friction: Vector,
    /// Of what keeps particles apart, which is of the walls: pushes, bounces, and putting back into the box.
    pub contact: Vector,
}

/// Area of a wall particle that fluid stands before, along the normal into the box [m^2]; zero for edges, corners and
/// those behind. `start` is its place at the start, `lattice` the spacing of the walls in each direction [m].
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
    fn facets_cover_the_walls() {
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
