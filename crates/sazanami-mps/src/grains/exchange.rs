//! Momentum exchange: the reaction of drag, lift and added mass returned to the fluid.
//!
//! A particle gets the part `a_i` of the impulse on a grain, the part that the grain reads of it ([`super::reading`]), and by its own slip
//! `-a_i K (u_i - u)` more than others, `u` being what the grain felt and `K` the resistance of the grain in the step: water that stands still
//! is not pushed along. Over the particles of a grain the latter is zero.

use sazanami_numerics::{Real, Vector};

use super::OverlappingGrains;
use super::binned::{Lanes, lanes};
use super::kept::{
    ADDED_MASS_FORCE, DRAG_FORCE, FELT, LIFT_FORCE, NOT_RETURNED, PLACE, SHARE, WEIGHTS, set_vector, vector,
};
use super::reading::solid_cubed;
use super::sources::{floor, is_seen};
use crate::boundary::Tank;
use crate::context::Context;
use crate::gates::near;
use crate::particles::{Kind, Particles};
use crate::reductions::{for_each_entry, set_column, sum_of};

/// Numbers that a grain gives back with: its position, impulse less resistance times felt velocity, resistance, two weights, and
/// whether it is an image in a gate.
pub(super) const GIVEN: usize = 10;

/// `values` and zeros.
pub(super) fn with_zeros<const N: usize>(values: [Real; N]) -> [Real; GIVEN] {
    std::array::from_fn(|n| values.get(n).copied().unwrap_or(0.0))
}

impl OverlappingGrains {
    /// Sets `change` to the velocity change of each own fluid particle by drag [m/s], by lift, and by the added mass in the
    /// step before, with positions and weights of the start of the step. Returns their impulse on the fluid, over all ranks
    /// [N s].
    pub(crate) fn return_drag(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        particles: &Particles,
        inverse_void: &[Real],
        change: &mut Vec<Vector>,
    ) -> Vector {
        if !self.is_active() {
            set_column(change, particles.owned, |_| Vector::ZERO);
            return Vector::ZERO;
        }
        self.gather_givers(step, tank);
        let (particle_mass, domain) = (step.particle_mass(), step.domain);
        let radius = self.sources.smoothing().0;
        let Self { impulses, gates, bulk, felt, .. } = &*self;
        let (gates, bulk, felt, floor) = (&gates[..], &bulk[..], &felt[..], floor(tank));
        set_column(change, particles.owned, |a| {
            let x = particles.position[a];
            if particles.kind[a] != Kind::Fluid || !impulses.is_near(x) {
                return Vector::ZERO;
            }
            let (gate, cube) = (near(gates, x, radius), solid_cubed(inverse_void[a]));
            let [i, j, k, resistance] = impulses.sum(x, |pair, giver: &[Lanes; GIVEN]| {
                let [p, q, r, i, j, k, resists, clear, solid, mirrored] = giver;
                let weight = lanes(|l| {
                    let source = (Vector::new(p[l], q[l], r[l]), mirrored[l] > 0.0);
                    let seen = gates.is_empty() || is_seen(gate, x, source, floor);
                    if seen { pair.weight[l] * (clear[l] + solid[l] * cube) } else { 0.0 }
                });
                [i, j, k, resists].map(|values| lanes(|l| weight[l] * values[l]))
            });
            -bulk[a] / particle_mass * (Vector::new(i, j, k) + resistance * felt[a])
        });
        let change = &change[..];
        Vector::from_array(domain.sum(sum_of(change.len(), |a| (particle_mass * change[a]).to_array())))
    }

    /// Sorts what the grains give back, images behind walls included, into bins.
    fn gather_givers(&mut self, step: &Context<'_>, tank: &Tank) {
        let Context { domain, dt, .. } = *step;
        let Self { engine, coupling, sources, shared, places, givers, giver_ids, impulses, .. } = self;
        let (radius, _) = sources.smoothing();
        let has_more = coupling.has_more_than_drag();
        let grains = engine.grains();
        set_column(shared, grains.len(), |g| {
            if g >= grains.owned() {
                return [0.0; GIVEN];
            }
            let kept = &grains.attached[g];
            let mut impulse = if kept[SHARE] > 0.0 { grains.drag_impulse[g] } else { Vector::ZERO };
            if has_more && kept[SHARE] > 0.0 {
                impulse += dt * vector(kept, LIFT_FORCE) + vector(kept, NOT_RETURNED);
            }
            let [clear, solid, resists] = vector(kept, WEIGHTS).to_array();
            let (x, impulse) = (vector(kept, PLACE), impulse - resists * vector(kept, FELT));
            [x.x, x.y, x.z, impulse.x, impulse.y, impulse.z, resists, clear, solid, 0.0]
        });
        let owned = grains.owned();
        set_column(places, owned, |g| grains.drag_impulse[g] / dt);
        let drag = &places[..];
        for_each_entry(&mut engine.attached_mut()[..owned], |g, kept| {
            set_vector(kept, DRAG_FORCE, drag[g]);
            set_vector(kept, ADDED_MASS_FORCE, Vector::ZERO);
        });
        engine.share_with_ghosts(domain, shared);
        let grains = engine.grains();
        for_each_entry(shared, |g, shared| {
            let place = engine.image_position(Vector::from_slice(&shared[..3]), grains.image(g));
            shared[..3].copy_from_slice(&place.to_array());
        });
        // Which ghosts are known beyond the radius is arbitrary.
        let known = engine.vicinity(domain, radius);
        givers.clear();
        giver_ids.clear();
        for (g, shared) in shared.iter().enumerate() {
            let place = Vector::from_slice(&shared[..3]);
            tank.for_each_image(place, radius, |image| {
                if known.contains(image.position) {
                    let mut giver = *shared;
                    giver[..3].copy_from_slice(&image.position.to_array());
                    giver[9] = if image.in_gate.is_some() { 1.0 } else { 0.0 };
                    givers.push(giver);
                    giver_ids.push(grains.id[g]);
                }
            });
        }
        let (givers, ids) = (&givers[..], &giver_ids[..]);
        impulses.fill(
            domain,
            radius,
            givers.len(),
            |n| Some(Vector::from_slice(&givers[n][..3])),
            |a, b| {
                let by = |d: usize| givers[a][d].total_cmp(&givers[b][d]);
                ids[a].cmp(&ids[b]).then_with(|| by(0).then_with(|| by(1)).then_with(|| by(2)))
            },
            |n| givers[n],
        );
    }
}
