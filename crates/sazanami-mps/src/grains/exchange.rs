//! Momentum exchange: the drag on the grains returned to the fluid.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::binned::{Lanes, lanes};
use super::{GrainPhase, PLACE, SUPPORT};
use crate::context::Context;
use crate::neighbours::ROWS;
use crate::particles::{Kind, Particles};

impl GrainPhase {
    /// Sets `change` to the velocity change of each own fluid particle by drag [m/s], with positions and weights of the
    /// start of the step. Returns the impulse of the drag on the fluid, over all ranks [N s].
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
        let Context { domain, kernel, .. } = *step;
        let particle_mass = step.particle_mass();
        let Self { engine, shared, impulses, .. } = self;
        let grains = engine.grains();
        shared.clear();
        shared.resize(grains.len(), [0.0; 6]);
        for (g, shared) in shared.iter_mut().enumerate().take(grains.owned()) {
            let kept = &grains.attached[g];
            let support = kept[SUPPORT];
            let impulse = grains.drag_impulse[g];
            for d in 0..3 {
                shared[d] = kept[PLACE + d];
                shared[3 + d] = if support > 0.0 { impulse[d] / support } else { 0.0 };
            }
        }
        engine.share_with_ghosts(domain, shared);
        for (g, shared) in shared.iter_mut().enumerate() {
            let place = engine.image_position(Vector::from_slice(&shared[..3]), grains.image(g));
            shared[..3].copy_from_slice(&place.to_array());
        }
        let shared = &shared[..];
        // Which ghosts are known beyond the radius is arbitrary.
        let near = engine.vicinity(domain, kernel.weight.radius);
        impulses.fill(
            domain,
            kernel.weight.radius,
            shared.len(),
            |g| Some(Vector::from_slice(&shared[g][..3])).filter(|&place| near.contains(place)),
            |a, b| {
                let by = |d: usize| shared[a][d].total_cmp(&shared[b][d]);
                grains.id[a].cmp(&grains.id[b]).then_with(|| by(0).then_with(|| by(1)).then_with(|| by(2)))
            },
            |g| shared[g],
        );
        let impulses = &*impulses;
        for_each_chunk(&mut change[..], ROWS, |number, change| {
            for (row, change) in change.iter_mut().enumerate() {
                let a = number * ROWS + row;
                *change = Vector::ZERO;
                if particles.kind[a] != Kind::Fluid || !impulses.is_near(particles.position[a]) {
                    continue;
                }
                let family = kernel.weight.family;
                let taken =
                    impulses.sum(family, particles.position[a], |pair, [_, _, _, impulse @ ..]: &[Lanes; 6]| {
                        impulse.map(|impulse| lanes(|l| pair.weight[l] * impulse[l]))
                    });
                *change = -inverse_void[a] / particle_mass * Vector::from_array(taken);
            }
        });
        let mut sum = [0.0; 3];
        for change in &*change {
            (0..3).for_each(|d| sum[d] += particle_mass * change[d]);
        }
        Vector::from_array(domain.sum(sum))
    }
}
