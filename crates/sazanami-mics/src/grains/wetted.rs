//! Friction from the hydraulic radius of a cell.
//!
//! A cell of which the part `theta = 1 - alpha` is open, with the surface `a` of grains per volume in it, has the hydraulic
//! radius `r = theta / a`, and the friction of Kozeny and Carman,
//!
//! ```text
//! mu f (u_s - u),   f = 6 / r^2
//! ```
//!
//! towards the velocity of the surface at its centre in the cell, where it also acts on the grain. In slow flow the one
//! formula serves lone grains, beds of grains that the grid resolves, and pores narrower than a cell (docs/decisions/0010).

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};

use super::imprint::{Imprint, Share};
use super::surface::{SOLID, Surface};

/// Friction times the squared hydraulic radius.
const FRICTION: Real = 6.0;

impl Surface {
    /// Whether the friction comes from the wetted area.
    pub(super) fn is_wetted(&self) -> bool {
        self.area.cells() != [0; 3]
    }

    /// Places the surfaces for a step; velocity and angular velocity of every grain and ghost are in `motion`.
    pub fn place_wetted(&mut self, domain: &Domain, imprint: &mut Imprint, motion: &[[Real; 6]]) {
        imprint.fill_halos(domain);
        self.covered.covered(domain, &imprint.solid_fraction, |j, k| imprint.row_is_covered(j, k));
        self.beside.and_beside(domain, &self.covered);
        let [v1, v2, v3] = &mut self.velocity;
        imprint.sum_surfaces(domain, motion, &mut self.area, [v1, v2, v3]);
        let alpha = imprint.solid_fraction.data();
        let solid = imprint.solid_velocity.each_ref().map(|v| v.data());
        let Self { friction, velocity: [v1, v2, v3], area, taken: [t1, t2, t3], covered, .. } = self;
        let area = area.data();
        let velocity = (v1.data_mut(), v2.data_mut(), v3.data_mut());
        let taken = (t1.data_mut(), t2.data_mut(), t3.data_mut());
        let fields = (friction.data_mut(), velocity, taken);
        domain.for_each_row(&domain.interior(), fields, |row, (friction, (v1, v2, v3), (t1, t2, t3))| {
            [&mut *friction, t1, t2, t3].into_iter().for_each(|values| values.fill(0.0));
            if !covered.holds(row.j, row.k) {
                return;
            }
            for (i, at) in row.shifted(0).enumerate() {
                let towards = if alpha[at] >= SOLID {
                    friction[i] = Real::INFINITY;
                    Vector::new(solid[0][at], solid[1][at], solid[2][at]) / alpha[at]
                } else if area[at] > 0.0 {
                    friction[i] = FRICTION * (area[at] / (1.0 - alpha[at])).powi(2);
                    Vector::new(v1[i], v2[i], v3[i]) / area[at]
                } else {
                    continue;
                };
                (v1[i], v2[i], v3[i]) = (towards.x, towards.y, towards.z);
            }
        });
    }

    /// See [`Surface::on_grain`]; `taken` is what the friction took in the cell.
    pub(super) fn on_wetted_grain(&self, domain: &Domain, share: &Share, part: Real, taken: Vector) -> [Vector; 2] {
        let at = share.at as usize;
        let (impulse, arm) = if self.friction.data()[at] == Real::INFINITY {
            (part * taken, share.arm())
        } else if self.area.data()[at] > 0.0 {
            let wetted = Real::from(share.wetted) / self.area.data()[at];
            (wetted * domain.grid().cell_volume() * taken, share.foot())
        } else {
            return [Vector::ZERO; 2];
        };
        [impulse, arm.cross(impulse)]
    }
}
