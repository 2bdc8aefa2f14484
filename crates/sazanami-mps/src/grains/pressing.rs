//! Force of the pressure on grains: what the particles in their bulk do not get of it.
//!
//! A particle has the bulk volume `l0^3/eps`, and `l0^3` of it is water: the pressure gives it `-l0^3 grad p`, and
//! `-(1/eps - 1) l0^3 grad p` to the grains in its bulk. Since `1 - eps = sum V W` over the grains, each by its own smoothing
//! function, a grain gets
//!
//! ```text
//! F = -V sum (l0^3/eps) W grad p
//! ```
//!
//! over the particles around it, with positions and void fractions of the start of the step as the pressure force has them. Then
//! the pressure gives water and grains together what walls give, to round-off: `sum (l0^3/eps) grad p` is that of walls alone.
//! Images in walls count for the grain itself. Where `eps` is at its lower bound, a grain has that part of `W` which the bound leaves.
//! The hydrostatic part of the pressure acts by the volume of the wet part of the grain.

use sazanami_numerics::{Real, Vector};

use super::GrainPhase;
use super::binned::{Lanes, lanes};
use super::sources::{floor, is_seen};
use crate::boundary::Tank;
use crate::context::Context;
use crate::gates::near;
use crate::ghosts::Ghosts;
use crate::particles::{Kind, Particles};
use crate::reductions::set_column;

impl GrainPhase {
    /// Sorts the fluid particles into bins where they are at the start of the step, of the `inverse_void` fractions there, with
    /// the pressure of the step before. All ranks take part.
    pub(super) fn begin_pressing(
        &mut self,
        step: &Context<'_>,
        particles: &mut Particles,
        inverse_void: &[Real],
        ghosts: &mut Ghosts,
    ) {
        let Self { sources, void, coupling, bulk, pressing, .. } = self;
        let (radius, scale) = sources.smoothing();
        let (whole, least) = (scale * step.settings.fluid.spacing.powi(3), coupling.least_void);
        let void = &void[..];
        set_column(bulk, particles.len(), |a| {
            let part = |void: Real| if void < least { (1.0 - least) / (1.0 - void) } else { 1.0 };
            if a < particles.owned { whole * inverse_void[a] * part(void[a]) } else { 0.0 }
        });
        ghosts.refresh(step.domain, bulk);
        ghosts.refresh(step.domain, &mut particles.gradient);
        let Particles { kind, position, .. } = &*particles;
        let is_fluid = |a: usize| (kind[a] == Kind::Fluid).then_some(position[a]);
        let entry = pressing_entry(step, particles, bulk);
        pressing.fill(step.domain, radius, position.len(), is_fluid, |a, b| a.cmp(&b), entry);
    }

    /// The same with the new pressure.
    pub(super) fn press_anew(&mut self, step: &Context<'_>, particles: &mut Particles, ghosts: &mut Ghosts) {
        ghosts.refresh(step.domain, &mut particles.gradient);
        let Self { bulk, pressing, .. } = self;
        pressing.set(pressing_entry(step, particles, bulk));
    }

    /// Force of the pressure beyond the hydrostatic one on a grain that is at `x` \[m] at the start of the step, over its volume,
    /// upwards along the pressure [Pa/m].
    pub(super) fn pressing_at(&self, tank: &Tank, x: Vector) -> Vector {
        let (radius, _) = self.sources.smoothing();
        let (gates, floor, mut total) = (&self.gates[..], floor(tank), Vector::ZERO);
        tank.for_each_image(x, radius, |image| {
            let source = (image.position, image.in_gate.is_some());
            let sum = self.pressing.sum(image.position, |pair, fluid: &[Lanes; 6]| {
                let [x, y, z, gradient @ ..] = fluid;
                let weight = if gates.is_empty() {
                    pair.weight
                } else {
                    lanes(|l| {
                        let particle = Vector::new(x[l], y[l], z[l]);
                        let seen = is_seen(near(gates, particle, radius), particle, source, floor);
                        if seen { pair.weight[l] } else { 0.0 }
                    })
                };
                gradient.map(|gradient| lanes(|l| weight[l] * gradient[l]))
            });
            total += Vector::from_array(sum);
        });
        total
    }
}

/// What bins know of a particle: its position, and bulk volume times the gradient of the pressure beyond the hydrostatic one.
fn pressing_entry<'a>(
    step: &Context<'_>,
    particles: &'a Particles,
    bulk: &'a [Real],
) -> impl Fn(usize) -> [Real; 6] + Sync + use<'a> {
    let Particles { position, gradient, .. } = particles;
    let hydrostatic = step.settings.fluid.density * step.unreduced_still_force();
    move |a| {
        let (x, g) = (position[a], bulk[a] * (gradient[a] - hydrostatic));
        [x.x, x.y, x.z, g.x, g.y, g.z]
    }
}
