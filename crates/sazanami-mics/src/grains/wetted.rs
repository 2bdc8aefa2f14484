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
//!
//! With inertia it takes too much: momentum that the flow carries through the open part of a cell leaves it again before
//! viscosity has spread it over the hydraulic radius. With `hydraulic_radius_slip` the friction is, with `Re = |u - u_s| r / nu`,
//!
//! ```text
//! f r^2 = 1 + 5 / (1 + Re / 0.1) + 0.29 Re
//! ```
//!
//! where the last term is the form drag of pores (the second term of Ergun 1952, Chem. Eng. Prog. 48, 89, with the hydraulic
//! radius of spheres); it vanishes as the cells become narrow beside the grains.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};

use super::imprint::{Imprint, Share};
use super::surface::{SOLID, Surface, SurfaceFriction};
use crate::flow::Flow;

/// Friction times the squared hydraulic radius in slow flow.
const SLOW: Real = 6.0;
/// The same where the fluid slips fast, if it counts.
const FAST: Real = 1.0;
/// Reynolds number of the slip and the hydraulic radius at which the friction is half way between the two.
const HALF_WAY: Real = 0.1;
/// Form drag in pores, Ergun's second term with the hydraulic radius `d theta / (6 alpha)` of spheres: 1.75/6.
const FORM: Real = 1.75 / 6.0;

/// Friction times the squared hydraulic radius at the Reynolds number of the slip and the hydraulic radius.
fn beside_slip(reynolds: Real) -> Real {
    FAST + (SLOW - FAST) / (1.0 + reynolds / HALF_WAY) + FORM * reynolds
}

impl Surface {
    /// Whether the friction comes from the wetted area.
    pub(super) fn is_wetted(&self) -> bool {
        self.area.cells() != [0; 3]
    }

    /// Places the surfaces for a step; velocity and angular velocity of every grain and ghost are in `motion`.
    pub fn place_wetted(&mut self, domain: &Domain, imprint: &mut Imprint, motion: &[[Real; 6]], flow: &Flow) {
        imprint.fill_halos(domain);
        self.covered.covered(domain, &imprint.solid_fraction, |j, k| imprint.row_is_covered(j, k));
        self.beside.and_beside(domain, &self.covered);
        let [v1, v2, v3] = &mut self.velocity;
        imprint.sum_surfaces(domain, motion, &mut self.area, [v1, v2, v3]);
        let alpha = imprint.solid_fraction.data();
        let solid = imprint.solid_velocity.each_ref().map(|v| v.data());
        let Self { friction, velocity: [v1, v2, v3], area, law, taken: [t1, t2, t3], covered, .. } = self;
        let (area, law) = (area.data(), *law);
        let (c, [u1, u2, u3]) = (flow.volume_fraction.data(), flow.velocity.each_ref().map(|u| u.data()));
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
                    let (radius, towards) = ((1.0 - alpha[at]) / area[at], Vector::new(v1[i], v2[i], v3[i]) / area[at]);
                    let factor = if law == SurfaceFriction::HydraulicRadiusSlip {
                        let slip = (Vector::new(u1[at], u2[at], u3[at]) - towards).length();
                        beside_slip(slip * radius / flow.fluids.kinematic_viscosity(c[at]))
                    } else {
                        SLOW
                    };
                    friction[i] = factor / (radius * radius);
                    towards
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
