//! Fluid forces on grains: the volume integral of the divergence of the stress over the covered
//! cells, `F_k = sum_c alpha_kc dV (-grad p + div tau)_c` and the torque with the arms to the
//! covered centroids. By Gauss it equals the traction on the surface; buoyancy is included.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::imprint::{Imprint, MOST};
use super::joint::hold_on;
use super::surface::Surface;

/// Force and torque of the fluid on a grain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FluidLoad {
    /// Force \[N].
    pub force: Vector,
    /// Torque about the centre of mass [N m].
    pub torque: Vector,
}

impl FluidLoad {
    /// Force and torque as numbers to be summed over ranks, and a zero.
    pub(super) fn in_numbers(&self) -> [Real; 7] {
        let [f, t] = [self.force.to_array(), self.torque.to_array()];
        [f[0], f[1], f[2], t[0], t[1], t[2], 0.0]
    }
}

/// Integrates `stress_divergence` [N/m^3] over the cells that each grain covers.
pub(super) fn integrate(
    domain: &Domain,
    imprint: &Imprint,
    stress_divergence: &[Field<Real>; 3],
    loads: &mut [FluidLoad],
) {
    let volume = domain.grid().cell_volume();
    let alpha = imprint.solid_fraction.data();
    let [s1, s2, s3] = stress_divergence.each_ref().map(Field::data);
    for_each_chunk(loads, 64, |number, loads| {
        for (offset, load) in loads.iter_mut().enumerate() {
            *load = FluidLoad::default();
            for share in imprint.shares(number * 64 + offset) {
                let at = share.at as usize;
                let part = share.fraction / alpha[at].max(1.0) * volume;
                let force = part * Vector::new(s1[at], s2[at], s3[at]);
                load.force += force;
                load.torque += share.arm().cross(force);
            }
        }
    });
}

/// Shares out what is `given` to the grains in each cell, per volume [N s/m^3], among these, and adds the friction of the last step on
/// the `surface`, ghosts filled, if asked for: impulses [N s] and angular impulses [N m s].
pub(super) fn share_out(
    domain: &Domain,
    imprint: &Imprint,
    given: &[Field<Real>; 3],
    surface: Option<&Surface>,
    loads: &mut [[Real; 7]],
    by_block: &mut Vec<[Real; MOST]>,
) {
    let volume = domain.grid().cell_volume();
    let alpha = imprint.solid_fraction.data();
    let of = |fields: [&[Real]; 3], at: usize| Vector::new(fields[0][at], fields[1][at], fields[2][at]);
    let given = given.each_ref().map(Field::data);
    let friction = surface.map(|surface| (surface.grip(imprint), surface.taken.each_ref().map(Field::data)));
    imprint.set_by_block(loads, by_block, |n| {
        let mut load = FluidLoad::default();
        for share in imprint.shares(n) {
            let at = share.at as usize;
            let impulse = share.fraction / alpha[at] * volume * of(given, at);
            load.force += impulse;
            load.torque += share.arm().cross(impulse);
            if let Some((grip, taken)) = friction {
                let (weight, place) = hold_on(grip, share);
                let impulse = weight * volume * of(taken, at);
                load.force += impulse;
                load.torque += place.cross(impulse);
            }
        }
        load.in_numbers()
    });
}
