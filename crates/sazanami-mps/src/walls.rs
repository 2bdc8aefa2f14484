//! The particles of the walls: where they began, which area each stands for, and their motion.

use sazanami_numerics::Vector;
use sazanami_numerics::particles::{ParticleColumns, WALL};
use sazanami_parallel::for_each_chunk;

use crate::boundary::Tank;
use crate::context::Context;
use crate::neighbours::ROWS;
use crate::particles::{Kind, ParticleRecord, Particles};

/// Initial position and area of every wall particle, by its number.
#[derive(Debug, Default)]
pub(crate) struct Walls {
    /// \[m]
    start: Vec<Vector>,
    /// Area vector, along the normal into the box [m^2]; see [`area`].
    area: Vec<Vector>,
}

impl Walls {
    /// The walls of a tank with the spacing `lattice` \[m] in each direction.
    pub fn new(tank: &Tank, lattice: Vector, particles: &[ParticleRecord]) -> Self {
        let start: Vec<Vector> = particles.iter().map(|wall| Vector::from_array(wall.position)).collect();
        let area = start.iter().map(|&start| area(tank, lattice, start)).collect();
        Self { start, area }
    }

    /// Area vector of the wall particle with this identifier [m^2].
    pub fn area(&self, id: u64) -> Vector {
        self.area[(id - WALL) as usize]
    }

    /// Moves the walls to their position at the start of the step, and sets their velocity in it. There are no ghosts
    /// afterwards.
    pub fn begin_step(&self, step: &Context<'_>, tank: &mut Tank, particles: &mut Particles) {
        let wall_velocity = step.forcing.wall_velocity;
        tank.displacement = step.forcing.wall_displacement - step.dt * wall_velocity;
        tank.velocity = wall_velocity;
        particles.truncate(particles.owned);
        let Particles { id, kind, position, velocity, .. } = particles;
        let displacement = tank.displacement;
        for_each_chunk((&mut position[..], &mut velocity[..]), ROWS, |number, (position, velocity)| {
            for (row, (x, u)) in position.iter_mut().zip(velocity).enumerate() {
                let a = number * ROWS + row;
                if kind[a] != Kind::Fluid {
                    *x = step.periods.wrapped(self.start[(id[a] - WALL) as usize] + displacement);
                    *u = wall_velocity;
                }
            }
        });
    }
}

/// Area vector of a wall particle in the first layer, along the normal into the box [m^2]; zero for edges, corners and
/// deeper layers. `start` is its initial position, `lattice` the spacing of the wall lattice in each direction \[m].
fn area(tank: &Tank, lattice: Vector, start: Vector) -> Vector {
    let mut vector = Vector::ZERO;
    let mut outside = 0;
    for d in 0..3 {
        let (below, above) = (tank.lower[d] - start[d], start[d] - tank.upper[d]);
        if below > 0.0 || above > 0.0 {
            outside += 1;
            let area = lattice[(d + 1) % 3] * lattice[(d + 2) % 3];
            vector[d] = if below.max(above) < lattice[d] { area * below.signum() } else { 0.0 };
        }
    }
    if outside == 1 { vector } else { Vector::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::{Side, WallFriction};

    #[test]
    fn wall_area_vectors_sum_to_the_area_of_the_walls() {
        let sides = [[Side::Wall; 2], [Side::Periodic; 2], [Side::Wall, Side::Open]];
        let tank = Tank::new(Vector::ZERO, Vector::new(8.0, 7.0, 5.0), sides, WallFriction::NoSlip);
        let walls = Walls::new(&tank, tank.lattice(1.0).unwrap(), &tank.particles(1.0, 3.1).unwrap());
        let (sum, whole) =
            walls.area.iter().fold((Vector::ZERO, Vector::ZERO), |(sum, whole), f| (sum + *f, whole + f.abs()));
        // The end walls face each other, the floor faces up.
        assert_eq!(sum, Vector::new(0.0, 0.0, 8.0 * 7.0));
        assert_eq!(whole, Vector::new(2.0 * 7.0 * 5.0, 0.0, 8.0 * 7.0));
    }
}
