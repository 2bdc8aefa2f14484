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
//! With inertia it takes too much where the grid resolves the surface: momentum that the flow carries through the open part of a
//! cell leaves it again before viscosity has spread it over the hydraulic radius; what stays is a boundary layer, thinner than the
//! cell, whose friction grows with the root of the Reynolds number. Pores within a cell have a form drag instead (the second term of
//! Ergun 1952, Chem. Eng. Prog. 48, 89, with the hydraulic radius of spheres). With `hydraulic_radius_slip`, `Re = |u - u_s| r / nu`
//! and the part `w` to which the grid resolves the surface,
//!
//! ```text
//! f r^2 = 6 - 5 w Re / (0.1 + Re) + 0.5 w sqrt(Re) + 0.29 (1 - w) Re,   w = min(1, s / 0.6)
//! ```
//!
//! where `s`, the variance of the solid fraction over the cell and its 26 neighbours over `m (1 - m)` with the mean `m`, is 1 where
//! cells are covered whole or not at all, and 0 where all are covered by the same part.

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
/// Friction of a boundary layer over the root of the Reynolds number: the drag of beds at Reynolds number 100 at all widths from 2
/// cells on (`verify random-bed`); that of a plate as long as a tenth of a grain is 0.33 to 0.66.
const LAYER: Real = 0.5;
/// Variance of the solid fraction, see above, from which on a surface counts as resolved.
const RESOLVED: Real = 0.6;

/// Friction times the squared hydraulic radius at the Reynolds number of the slip and the hydraulic radius, where the surface is
/// `resolved` to this part.
fn beside_slip(reynolds: Real, resolved: Real) -> Real {
    let layer = LAYER * reynolds.sqrt() - (SLOW - FAST) * reynolds / (HALF_WAY + reynolds);
    SLOW + resolved * layer + (1.0 - resolved) * FORM * reynolds
}

/// Part to which the grid resolves the surface in a cell.
fn resolved(alpha: &[Real], at: usize, strides: [usize; 3]) -> Real {
    let first = at - strides.iter().sum::<usize>();
    let around = (0..27).map(|n| first + n % 3 * strides[0] + n / 3 % 3 * strides[1] + n / 9 * strides[2]);
    let [sum, squares] = around.fold([0.0; 2], |[sum, squares], at| {
        let alpha = alpha[at].min(1.0);
        [sum + alpha, squares + alpha * alpha]
    });
    let mean: Real = sum / 27.0;
    let spread = mean * (1.0 - mean);
    if spread > 0.0 { ((squares / 27.0 - mean * mean) / (RESOLVED * spread)).min(1.0) } else { 1.0 }
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
        let strides = domain.strides().map(|s| s as usize);
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
                        let reynolds = slip * radius / flow.fluids.kinematic_viscosity(c[at]);
                        beside_slip(reynolds, resolved(alpha, at, strides))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_is_resolved_where_cells_are_covered_whole_or_not_at_all() {
        let strides = [1, 4, 16];
        let field = |alpha: fn(usize) -> Real| (0..64).map(alpha).collect::<Vec<_>>();
        let at = 1 + 4 + 16;
        let half = field(|n| if n % 4 < 1 { 1.0 } else { 0.0 });
        assert_eq!(resolved(&half, at, strides), 1.0);
        let mixed = field(|_| 0.4);
        assert!(resolved(&mixed, at, strides) < 1e-12);
        let between = field(|n| if n % 2 == 0 { 0.2 } else { 0.6 });
        let found = resolved(&between, at, strides);
        assert!(found > 0.05 && found < 0.5, "{found}");
    }

    #[test]
    fn slow_flow_meets_the_same_friction_however_well_it_is_resolved() {
        assert_eq!([0.0, 0.5, 1.0].map(|part| beside_slip(0.0, part)), [SLOW; 3]);
        // Fast slip: less than in slow flow where it is resolved, more in a pore.
        assert!(beside_slip(2.0, 1.0) < SLOW && beside_slip(2.0, 0.0) > SLOW);
        // Very fast: a boundary layer, whose friction over the square of the slip falls, or form drag, which keeps it.
        let over_square = |part: Real| beside_slip(4e4, part) / beside_slip(1e4, part) / 4.0;
        assert!((over_square(1.0) - 0.5).abs() < 0.02 && (over_square(0.0) - 1.0).abs() < 0.02);
    }
}
