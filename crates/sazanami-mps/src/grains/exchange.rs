//! Momentum exchange: the reaction of drag, lift and added mass returned to the fluid.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::GrainPhase;
use super::binned::{Lanes, lanes};
use super::kept::{LIFT_FORCE, NOT_RETURNED, PLACE, SUPPORT, vector};
use crate::context::Context;
use crate::neighbours::ROWS;
use crate::particles::{Kind, Particles};
use crate::reductions::{set_column, sum_of};

impl GrainPhase {
    /// Sets `change` to the velocity change of each own fluid particle by drag [m/s], by lift, and by the added mass in the
    /// step before, with positions and weights of the start of the step. Returns their impulse on the fluid, over all ranks
    /// [N s].
    pub(crate) fn return_drag(
        &mut self,
        step: &Context<'_>,
        particles: &Particles,
        inverse_void: &[Real],
        change: &mut Vec<Vector>,
    ) -> Vector {
        change.resize(particles.owned, Vector::ZERO);
        if !self.is_active() {
            for_each_chunk(&mut change[..], ROWS, |_, change| change.fill(Vector::ZERO));
            return Vector::ZERO;
        }
        let Context { domain, kernel, dt, .. } = *step;
        let particle_mass = step.particle_mass();
        let Self { engine, coupling, shared, impulses, gates, .. } = self;
        let reach = coupling.reach * kernel.weight.radius;
        let has_more = coupling.has_more_than_drag();
        let grains = engine.grains();
        set_column(shared, grains.len(), |g| {
            if g >= grains.owned() {
                return [0.0; 6];
            }
            let kept = &grains.attached[g];
            let (support, mut impulse) = (kept[SUPPORT], grains.drag_impulse[g]);
            if has_more {
                impulse += dt * vector(kept, LIFT_FORCE) + vector(kept, NOT_RETURNED);
            }
            let share = |d: usize| if support > 0.0 { impulse[d] / support } else { 0.0 };
            [kept[PLACE], kept[PLACE + 1], kept[PLACE + 2], share(0), share(1), share(2)]
        });
        engine.share_with_ghosts(domain, shared);
        for_each_chunk(&mut shared[..], ROWS, |number, shared| {
            for (row, shared) in shared.iter_mut().enumerate() {
                let image = grains.image(number * ROWS + row);
                let place = engine.image_position(Vector::from_slice(&shared[..3]), image);
                shared[..3].copy_from_slice(&place.to_array());
            }
        });
        let shared = &shared[..];
        // Which ghosts are known beyond the radius is arbitrary.
        let near = engine.vicinity(domain, reach);
        impulses.fill(
            domain,
            reach,
            shared.len(),
            |g| Some(Vector::from_slice(&shared[g][..3])).filter(|&place| near.contains(place)),
            |a, b| {
                let by = |d: usize| shared[a][d].total_cmp(&shared[b][d]);
                grains.id[a].cmp(&grains.id[b]).then_with(|| by(0).then_with(|| by(1)).then_with(|| by(2)))
            },
            |g| shared[g],
        );
        let (impulses, gates) = (&*impulses, &gates[..]);
        for_each_chunk(&mut change[..], ROWS, |number, change| {
            for (row, change) in change.iter_mut().enumerate() {
                let a = number * ROWS + row;
                *change = Vector::ZERO;
                if particles.kind[a] != Kind::Fluid || !impulses.is_near(particles.position[a]) {
                    continue;
                }
                let taken =
                    impulses.sum_beside(gates, particles.position[a], |pair, [_, _, _, impulse @ ..]: &[Lanes; 6]| {
                        impulse.map(|impulse| lanes(|l| pair.weight[l] * impulse[l]))
                    });
                *change = -inverse_void[a] / particle_mass * Vector::from_array(taken);
            }
        });
        let change = &change[..];
        Vector::from_array(domain.sum(sum_of(change.len(), |a| (particle_mass * change[a]).to_array())))
    }
}
