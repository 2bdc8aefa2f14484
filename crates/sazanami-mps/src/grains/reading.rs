//! What a grain reads of the fluid, and what the fluid gets back: pairs of grain and particle, one weight for all.
//!
//! A particle has the bulk volume `l0^3/eps`, and `1 - eps = sum V W` over the grains: `a = (l0^3/eps) W` of the bulk of a particle is a
//! grain's per volume of the grain, with positions and void fractions of the start of the step. Images in walls count for the grain itself.
//! Where `eps` is at its lower bound, a grain has that part of `W` which the bound leaves.
//!
//! **Pressure.** `l0^3` of the bulk of a particle is water: the pressure gives it `-l0^3 grad p`, and the rest to the grains,
//!
//! ```text
//! F = -V sum a grad p
//! ```
//!
//! Then the pressure gives water and grains together what walls give, to round-off: `sum (l0^3/eps) grad p` is that of walls alone.
//! The hydrostatic part of the pressure acts by the volume of the wet part of the grain.
//!
//! **Drag.** Each particle drags by the law at its own void fraction and its own slip: water above a bed, which sees the bed as a
//! dilute one, is held back little, however wide `W` is. Of the law `kappa(eps, s)` a grain takes two values at its mean slip, in clear
//! water and at its own void fraction, where the sum over grains is `S_g`; between them it goes with the cube of `S`, and where the law has
//! less among grains than in clear water it is that among grains for all particles:
//!
//! ```text
//! kappa_i = kappa(1) + [kappa(eps_g) - kappa(1)] (S_i/S_g)^3,   F = sum a kappa_i (u_i - v)/sum a
//! ```

use sazanami_numerics::{Real, Vector};

use super::binned::{Lanes, lanes};
use super::kept::{PLACE, vector};
use super::sources::{floor, is_seen};
use super::{DragParameters, FluidAtGrain, OverlappingGrains};
use crate::boundary::Tank;
use crate::context::Context;
use crate::gates::near;
use crate::ghosts::Ghosts;
use crate::particles::{Kind, Particles};
use crate::reductions::set_column;

/// Values of a particle in its bin: position, bulk volume times the scale of the smoothing function, cube of the solid fraction,
/// velocity, and gradient of the pressure beyond the hydrostatic one.
pub(super) const READ: usize = 11;

/// Sums over the particles around a grain with the weights `a`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reading {
    /// Of the weights: 1 in water all round, but for the arrangement of the particles.
    pub share: Real,
    /// Of the velocities [m/s].
    pub velocity: Vector,
    /// Of the cubes of the solid fraction, and of these times the velocities [m/s].
    pub solid: Real,
    pub solid_velocity: Vector,
    /// Of the gradients of the pressure beyond the hydrostatic one [Pa/m].
    pub gradient: Vector,
}

impl OverlappingGrains {
    /// Sorts the fluid particles into bins where they are at the start of the step, of the `inverse_void` fractions there, with
    /// what grains feel as their velocity and the pressure of the step before. All ranks take part.
    pub(super) fn begin_reading(
        &mut self,
        step: &Context<'_>,
        particles: &mut Particles,
        inverse_void: &[Real],
        felt: impl Fn(usize) -> Vector + Sync,
        ghosts: &mut Ghosts,
    ) {
        let Self { sources, void, coupling, bulk, fluid, .. } = self;
        let (radius, scale) = sources.smoothing();
        let (whole, least) = (scale * step.settings.fluid.spacing.powi(3), coupling.least_void);
        let void = &void[..];
        set_column(bulk, particles.len(), |a| {
            let part = |void: Real| if void < least { (1.0 - least) / (1.0 - void) } else { 1.0 };
            if a < particles.owned { whole * inverse_void[a] * part(void[a]) } else { 0.0 }
        });
        ghosts.refresh(step.domain, bulk);
        let Particles { kind, position, .. } = &*particles;
        let is_fluid = |a: usize| (kind[a] == Kind::Fluid).then_some(position[a]);
        let entry = entry(step, particles, bulk, inverse_void, felt);
        fluid.fill(step.domain, radius, position.len(), is_fluid, |a, b| a.cmp(&b), entry);
    }

    /// The same with the new pressure, and another field `felt` in place of the velocity.
    pub(super) fn read_anew(
        &mut self,
        step: &Context<'_>,
        particles: &Particles,
        inverse_void: &[Real],
        felt: impl Fn(usize) -> Vector + Sync,
    ) {
        let Self { bulk, fluid, .. } = self;
        fluid.set(entry(step, particles, bulk, inverse_void, felt));
    }

    /// Reads the fluid at the own grains where they were at the start of the step.
    pub(super) fn read_at_start(&mut self, tank: &Tank) {
        let mut readings = std::mem::take(&mut self.readings);
        let grains = self.engine.grains();
        set_column(&mut readings, grains.owned(), |g| {
            let begun = self.engine.image_position(vector(&grains.attached[g], PLACE), grains.image(g));
            self.reading(tank, begun)
        });
        self.readings = readings;
    }

    /// Sums over the fluid around a grain that is at `x` \[m] at the start of the step.
    pub(super) fn reading(&self, tank: &Tank, x: Vector) -> Reading {
        let (radius, _) = self.sources.smoothing();
        let (gates, floor) = (&self.gates[..], floor(tank));
        let mut total = [0.0; READ];
        tank.for_each_image(x, radius, |image| {
            let source = (image.position, image.in_gate.is_some());
            let sums = self.fluid.sum(image.position, |pair, fluid: &[Lanes; READ]| {
                let [x, y, z, bulk, cube, u, v, w, g1, g2, g3] = fluid;
                let weight = lanes(|l| {
                    let particle = Vector::new(x[l], y[l], z[l]);
                    let seen = gates.is_empty() || is_seen(near(gates, particle, radius), particle, source, floor);
                    if seen { bulk[l] * pair.weight[l] } else { 0.0 }
                });
                let solid = lanes(|l| weight[l] * cube[l]);
                let times = |a: &Lanes, b: &Lanes| lanes(|l| a[l] * b[l]);
                let [u1, u2, u3] = [u, v, w].map(|u| times(&weight, u));
                let [s1, s2, s3] = [u, v, w].map(|u| times(&solid, u));
                let [g1, g2, g3] = [g1, g2, g3].map(|g| times(&weight, g));
                [weight, solid, u1, u2, u3, s1, s2, s3, g1, g2, g3]
            });
            total.iter_mut().zip(sums).for_each(|(total, sum)| *total += sum);
        });
        let [share, solid, vectors @ ..] = total;
        let [velocity, solid_velocity, gradient] = [0, 3, 6].map(|n| Vector::from_slice(&vectors[n..n + 3]));
        Reading { share, velocity, solid, solid_velocity, gradient }
    }

    /// What own grain `g` of diameter `d` \[m] feels at the start of the step.
    pub(super) fn feel(&self, tank: &Tank, g: usize, d: Real) -> FluidAtGrain {
        let grains = self.engine.grains();
        let x = grains.position[g];
        let (read, law) = (self.reading(tank, x), &self.coupling.drag);
        let solid = self.sources.fraction(x);
        let void_fraction = (1.0 - self.sources.around(solid, d)).clamp(self.coupling.least_void, 1.0);
        let mut felt =
            FluidAtGrain { void_fraction, pressing: read.gradient, share: read.share, ..FluidAtGrain::default() };
        if read.share > 0.0 {
            let slip = (read.velocity / read.share - grains.velocity[g]).length();
            let [clear, dense] = in_clear_water_and_among_grains(law, d, void_fraction, slip);
            // No fraction counts beyond the least void, here as at the particles.
            let counted = solid.min(1.0 - self.coupling.least_void);
            let with_solid = if counted > 0.0 { (dense - clear) / counted.powi(3) } else { 0.0 };
            let sum = clear * read.share + with_solid * read.solid;
            felt.velocity = (clear * read.velocity + with_solid * read.solid_velocity) / sum;
            felt.wetness = (2.0 * read.share).min(1.0);
            felt.submerged = submerged(read.share, d / self.sources.smoothing().0);
            felt.drag_factor = sum / (read.share * dense);
            felt.weights = [clear / sum, with_solid / sum];
        }
        felt
    }
}

/// Drag coefficients [kg/s] of a sphere of diameter `d` \[m] in clear water, no more than the other, and at void fraction `eps`, of
/// which only ratios are taken. Without viscosity they vanish with the `slip` [m/s], in proportion to it: those at rest are those at
/// any slip. Where there is no drag among grains all particles have the same part of none.
fn in_clear_water_and_among_grains(law: &DragParameters, d: Real, eps: Real, slip: Real) -> [Real; 2] {
    let at = |slip: Real| [1.0, eps].map(|eps| law.coefficient(d, eps, slip));
    let found = at(slip);
    let [clear, dense] = if found[1] > 0.0 { found } else { at(1.0) };
    if dense > 0.0 { [clear.min(dense), dense] } else { [1.0; 2] }
}

/// Part of a sphere that lies below the level at which the smoothing function has the `share` of its integral, for a diameter of
/// `size` radii of the function. With water up to a plane, the part of the function beyond it at `1 - s` radii from the centre is
/// `3.5 s^6 - 4.5 s^7 + 1.5 s^8`, the Wendland function integrated over planes; the cap of the sphere follows.
pub(super) fn submerged(share: Real, size: Real) -> Real {
    let (beyond, least) = (share.min(1.0 - share), (1.0 - 0.5 * size).max(0.0));
    let part = |s: Real| s.powi(6) * (3.5 + s * (-4.5 + 1.5 * s));
    if beyond <= part(least) {
        return if share < 0.5 { 0.0 } else { 1.0 };
    }
    // Newton's method from the centre: the function is convex, so that the steps end at the level from one side.
    let step = |s: Real, _| s - (part(s) - beyond) / (s.powi(5) * (21.0 + s * (-31.5 + 12.0 * s)));
    let away = (1.0 - (0..8).fold(1.0, step)) / (0.5 * size);
    let depth = if share < 0.5 { -away } else { away };
    0.25 * (2.0 + depth * (3.0 - depth * depth))
}

/// What bins know of a particle, see [`READ`].
fn entry<'a>(
    step: &Context<'_>,
    particles: &'a Particles,
    bulk: &'a [Real],
    inverse_void: &'a [Real],
    felt: impl Fn(usize) -> Vector + Sync + 'a,
) -> impl Fn(usize) -> [Real; READ] + Sync {
    let Particles { position, gradient, .. } = particles;
    let hydrostatic = step.settings.fluid.density * step.unreduced_still_force();
    move |a| {
        let (x, u, g) = (position[a], felt(a), gradient[a] - hydrostatic);
        [x.x, x.y, x.z, bulk[a], solid_cubed(inverse_void[a]), u.x, u.y, u.z, g.x, g.y, g.z]
    }
}

/// Cube of the solid fraction of a particle.
#[inline(always)]
pub(super) fn solid_cubed(inverse_void: Real) -> Real {
    (1.0 - 1.0 / inverse_void).powi(3)
}

#[cfg(test)]
mod tests {
    use super::super::{DragForm, Forchheimer};
    use super::*;

    #[test]
    fn without_viscosity_drag_at_rest_is_shared_out_as_that_of_any_slip() {
        for form in [DragForm::Blend, DragForm::DiFelice, DragForm::Beetstra] {
            let ratio = |viscosity: Real, slip: Real| {
                let law = DragParameters { form, ..DragParameters::recommended(1000.0, viscosity) };
                let [clear, dense] = in_clear_water_and_among_grains(&law, 1e-3, 0.6, slip);
                dense / clear
            };
            assert!((ratio(0.0, 0.0) / ratio(0.0, 0.1) - 1.0).abs() < 1e-12, "{form:?}: {}", ratio(0.0, 0.0));
            // Negative control: with viscosity it is another at rest.
            assert!((ratio(1e-3, 0.0) / ratio(1e-3, 0.1) - 1.0).abs() > 0.1, "{form:?}: {}", ratio(1e-3, 0.0));
        }
    }

    #[test]
    fn no_part_of_the_drag_is_negative_where_the_law_has_less_among_grains() {
        let law = DragParameters::recommended(1000.0, 1e-3);
        let low = DragParameters { forchheimer: Forchheimer::Constant(0.0), ..law };
        let of = |law: &DragParameters, slip: Real| {
            let law_itself = [1.0, 0.5].map(|eps| law.coefficient(1e-3, eps, slip));
            (law_itself, in_clear_water_and_among_grains(law, 1e-3, 0.5, slip))
        };
        // At a Reynolds number of 2000, without the inertia of flow through the bed.
        let ([clear, dense], shared) = of(&low, 2.0);
        assert!(clear > 2.0 * dense && shared == [dense; 2], "{clear} {dense} {shared:?}");
        // Nothing resists in a bed: nothing is shared, and it is a number.
        let none = DragParameters { viscosity: 0.0, ..low };
        assert_eq!(of(&none, 0.1).1, [1.0; 2]);
        // Negative control: the law itself elsewhere.
        let (itself, shared) = of(&law, 2.0);
        assert!(itself == shared && shared[0] < shared[1], "{shared:?}");
    }

    #[test]
    fn a_sphere_is_submerged_as_far_as_the_level_says() {
        // The smoothing function integrated over planes and then up to a level, by sums.
        let share = |level: Real| {
            let n = 2000;
            let plane = |z: Real| {
                let steps = (0..n).map(|k| z + (1.0 - z) * (Real::from(k) + 0.5) / Real::from(n));
                21.0 * (1.0 - z) / Real::from(n) * steps.map(|q| (1.0 - q).powi(4) * (1.0 + 4.0 * q) * q).sum::<Real>()
            };
            let heights = (0..n).map(|k| level.abs() * (Real::from(k) + 0.5) / Real::from(n));
            0.5 + level / Real::from(n) * heights.map(plane).sum::<Real>()
        };
        let size = 1.0 / 3.0;
        for (level, part) in [(-0.25, 0.15625), (0.0, 0.5), (0.25, 0.84375), (0.1, 0.648), (0.6, 1.0), (-0.6, 0.0)] {
            let found = submerged(share(level * size), size);
            assert!((found - part).abs() < 1e-4, "{level}: {found}");
        }
        assert_eq!([0.0, 1.0, 1.1].map(|share| submerged(share, size)), [0.0, 1.0, 1.0]);
        // Negative control: twice the share, as if half of the water around a grain wetted all of it.
        assert!((2.0 * share(-0.25 * size) - 0.15625).abs() > 0.3);
    }
}
