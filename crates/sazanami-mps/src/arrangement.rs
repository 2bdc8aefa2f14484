//! Arrangement of the particles in a step: owners, order in space, ghosts, bins and neighbour lists.

use sazanami_numerics::Real;
use sazanami_numerics::particles::Bins;

use crate::context::{Context, Motion, Voids};
use crate::ghosts::Ghosts;
use crate::neighbours::{MARGIN, Neighbours};
use crate::particles::{Kind, Particles};
use crate::reductions::largest;

/// Ghosts, bins and lists of the present step.
#[derive(Debug, Default)]
pub(crate) struct Arrangement {
    pub ghosts: Ghosts,
    pub bins: Bins,
    pub neighbours: Neighbours,
    /// Bin of each own particle.
    pub bin: Vec<u32>,
}

impl Arrangement {
    /// Migrates and sorts the particles, and renews ghosts and lists for a step in which fluid and grains move at
    /// up to `fastest` [m/s] beside the walls at the start and drag relaxes at `drag_rate` [1/s], with lists that reach `widening` times as far
    /// as the radius of influence, and ghosts at least within the radius `read` \[m] of grains. Resets `voids` to clear fluid.
    pub fn renew(
        &mut self,
        step: &Context<'_>,
        particles: &mut Particles,
        (fastest, drag_rate): (Real, Real),
        (widening, read): (Real, Real),
        voids: &mut Voids,
    ) {
        let Context { domain, periods, kernel, settings, forcing, dt, .. } = *step;
        let speed = fastest + forcing.wall_velocity.length();
        // Pairs may approach by this much before the pressure acts.
        let margin = MARGIN * settings.fluid.spacing;
        let radius = widening * kernel.weight.radius + margin;
        // Drag may change the velocity by up to its rate times the slip.
        let kick = 1.0 + (dt * drag_rate).min(1.0);
        let reach = radius.max(read) + 2.1 * dt * (kick * speed + dt * forcing.body_force.length());
        let Self { ghosts, bins, neighbours, bin } = self;
        ghosts.migrate(domain, particles);
        bins.renew(domain, reach);
        // Walls far from the fluid take part in nothing.
        let fluid = |a: usize| (particles.kind[a] == Kind::Fluid).then(|| particles.position[a]);
        bins.narrow_together(domain, particles.len(), fluid);
        ghosts.sort(particles, bins);
        ghosts.renew(domain, periods, particles, reach, bins);
        let (own, others) = particles.position.split_at(particles.owned);
        bins.fill(own, others);
        let body_force = step.explicit_force();
        let displacement = |a: usize| dt * (particles.velocity[a] + dt * body_force);
        neighbours.renew(bins, particles, radius, dt * forcing.wall_velocity, displacement);
        bin.clear();
        bin.extend(particles.position[..particles.owned].iter().map(|&x| bins.number(x)));
        voids.clear(particles.len());
    }

    /// Renews the lists if drag and viscosity moved a particle farther than they allow for.
    pub fn follow(&mut self, step: &Context<'_>, particles: &Particles, predicted: &Motion) {
        let Context { domain, kernel, settings, forcing, dt, .. } = *step;
        let body_force = step.explicit_force();
        let (position, place) = (&particles.position, &predicted.position);
        let expected = |a: usize| position[a] + dt * (particles.velocity[a] + dt * body_force);
        let stray = |a: usize| {
            if particles.kind[a] == Kind::Fluid { (place[a] - expected(a)).length_squared() } else { 0.0 }
        };
        let margin = MARGIN * settings.fluid.spacing;
        if 2.1 * domain.max(largest(particles.owned, stray).max(0.0)).sqrt() > margin {
            let displacement = |a: usize| place[a] - position[a];
            let radius = kernel.weight.radius + margin;
            self.neighbours.renew(&self.bins, particles, radius, dt * forcing.wall_velocity, displacement);
        }
    }
}
