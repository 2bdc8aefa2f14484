//! What a box that begins with a speed gives to what is in it.

use sazanami_numerics::Vector;

use crate::case::meaning::{Case, Solver};

/// Velocity that fluid and free grains have against a box whose motion begins with a speed [m/s], beside the one that they are given: what is at
/// rest stays where it was. None where the box begins at rest, or is seen from the laboratory. A flow that is given is that in the box.
pub fn set_off(case: &Case) -> Option<Vector> {
    let velocity = -case.tank_at(0.0)[1];
    let is_given = case.solver == Solver::Mics && case.fluid.carrying_flow.is_some();
    (velocity != Vector::ZERO && !case.walls_move() && !is_given).then_some(velocity)
}
