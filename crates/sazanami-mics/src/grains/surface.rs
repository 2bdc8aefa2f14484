//! The surface of the grains in the viscous equation: rigid cells, and friction in cells that a surface cuts.
//!
//! A cell covered by at least [`SOLID`] moves with its grains. A cell of which the part `theta = 1 - alpha` is open, with the surface
//! `a` of grains per volume in it, has the hydraulic radius `r = theta / a`, and the friction of Kozeny and Carman,
//!
//! ```text
//! mu f (u_s - u),   f = 6 / r^2
//! ```
//!
//! towards the velocity of the surface at its centre in the cell, implicit with the viscous stress; there it acts with the opposite
//! sign on the grain. In slow flow the one formula serves lone grains, beds of grains that the grid resolves, and pores narrower than
//! a cell (docs/decisions/0010).
//!
//! With inertia it takes too much where the grid resolves the surface: momentum that the flow carries through the open part of a
//! cell leaves it again before viscosity has spread it over the hydraulic radius; what stays is a boundary layer, thinner than the
//! cell, whose friction grows with the root of the Reynolds number. Pores within a cell have a form drag instead (the second term of
//! Ergun 1952, Chem. Eng. Prog. 48, 89, with the hydraulic radius of spheres). With `Re = |u - u_s| r / nu` and the part `w` to which
//! the grid resolves the surface,
//!
//! ```text
//! f r^2 = 6 - 5 w Re / (0.1 + Re) + 0.5 w sqrt(Re) + 0.29 (1 - w) Re,   w = min(1, s / 0.6)
//! ```
//!
//! where `s`, the variance of the solid fraction over the cell and its 26 neighbours over `m (1 - m)` with the mean `m`, is 1 where
//! cells are covered whole or not at all, and 0 where all are covered by the same part.
//!
//! A flat end of a grain that lies in a plane of cells holds the fluid in the cells beside it as a wall of the box does, whatever the Reynolds number: half
//! a cell lies between it and their centres (docs/decisions/0035).

use sazanami_dem::Grains;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

use super::imprint::Imprint;
use crate::flow::Flow;
use crate::mobility::{NARROWEST, RowSet};

/// Solid fraction from which on a cell moves with its grains.
pub(super) const SOLID: Real = 0.99;
/// Solid fraction below which a cell with a surface is beside a flat end of a grain in a plane of cells, a wall like those of the box.
const WALL: Real = 1e-10;
/// Friction of a cell that moves with its grains over its inertia.
const HOLD: Real = 1e9;

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

/// Friction in the cell at place `at` beside flat ends in planes of cells [1/m^2]: as much as the stress towards the covered cells behind them, which
/// ends half a cell away then; `squares` are those of the widths \[m^2].
fn beside_ends(alpha: &[Real], at: usize, strides: [usize; 3], squares: Vector) -> Real {
    (0..3).map(|d| (alpha[at - strides[d]].min(1.0) + alpha[at + strides[d]].min(1.0)) / squares[d]).sum()
}

/// Cells of a row that are looked at together.
const BLOCK: usize = 64;

/// Parts to which the grid resolves the surface in at most [`BLOCK`] cells of a row, the first of them at place `at`.
fn resolved(alpha: &[Real], at: usize, strides: [usize; 3], parts: &mut [Real]) {
    let first = at - strides.iter().sum::<usize>();
    let [mut sums, mut squares] = [[0.0; BLOCK + 2]; 2];
    for row in (0..9).map(|n| first + n % 3 * strides[1] + n / 3 * strides[2]) {
        let row = &alpha[row..row + parts.len() + 2];
        for (alpha, (sum, square)) in row.iter().zip(sums.iter_mut().zip(&mut squares)) {
            let alpha = alpha.min(1.0);
            *sum += alpha;
            *square += alpha * alpha;
        }
    }
    for (i, part) in parts.iter_mut().enumerate() {
        let [mean, square] = [&sums, &squares].map(|line| (line[i] + line[i + 1] + line[i + 2]) / 27.0);
        let spread: Real = mean * (1.0 - mean);
        *part = if spread > 0.0 { ((square - mean * mean) / (RESOLVED * spread)).min(1.0) } else { 1.0 };
    }
}

/// Friction on the surfaces of the grains.
pub(crate) struct Surface {
    /// Friction over the viscosity [1/m^2]; infinite in cells that move with their grains.
    pub(super) friction: Field<Real>,
    /// Velocity of the surface in cells with friction [m/s].
    pub(super) velocity: [Field<Real>; 3],
    /// Momentum that friction took from the fluid in this step, per volume [N s/m^3].
    pub(super) taken: [Field<Real>; 3],
    /// Rows that grains cover, and those beside them too.
    pub(crate) covered: RowSet,
    beside: RowSet,
    /// The latter in the last step.
    were_beside: RowSet,
}

impl Surface {
    /// No surfaces, for fields of `cells` cells.
    pub fn new(cells: [usize; 3]) -> Self {
        let field = || Field::new(cells, 0.0);
        let three = || [field(), field(), field()];
        let [covered, beside, were_beside] = Default::default();
        Self { friction: field(), velocity: three(), taken: three(), covered, beside, were_beside }
    }

    /// Places the surfaces for a step, and sums the velocities of the grains in the cells; velocity and angular velocity of every grain and ghost are in `motion`.
    pub fn place(
        &mut self,
        domain: &Domain,
        imprint: &mut Imprint,
        (grains, motion): (&Grains, &[[Real; 6]]),
        flow: &Flow,
    ) {
        imprint.sum_surfaces(domain, grains, motion, self.velocity.each_mut());
        imprint.fill_halos(domain);
        self.covered.covered(domain, &imprint.solid_fraction, |j, k| imprint.row_is_covered(j, k));
        std::mem::swap(&mut self.beside, &mut self.were_beside);
        self.beside.and_beside(domain, &self.covered);
        let (strides, spacing) = (domain.strides().map(|s| s as usize), domain.grid().spacing);
        let squares = spacing * spacing;
        let (alpha, shared) = (imprint.solid_fraction.data(), imprint.shared());
        let solid = imprint.solid_velocity.each_ref().map(Field::data);
        let Self { friction, velocity: [v1, v2, v3], taken: [t1, t2, t3], covered, beside, were_beside } = self;
        let area = imprint.area.data();
        let (c, [u1, u2, u3]) = (flow.volume_fraction.data(), flow.velocity.each_ref().map(Field::data));
        let velocity = (v1.data_mut(), v2.data_mut(), v3.data_mut());
        let taken = (t1.data_mut(), t2.data_mut(), t3.data_mut());
        let fields = (friction.data_mut(), velocity, taken);
        domain.for_each_row(&domain.interior(), fields, |row, (friction, (v1, v2, v3), (t1, t2, t3))| {
            if beside.holds(row.j, row.k) || were_beside.holds(row.j, row.k) {
                [&mut *friction, t1, t2, t3].into_iter().for_each(|values| values.fill(0.0));
            }
            if !covered.holds(row.j, row.k) {
                return;
            }
            let mut parts = [0.0; BLOCK];
            for (i, at) in row.shifted(0).enumerate() {
                if i % BLOCK == 0 {
                    resolved(alpha, at, strides, &mut parts[..BLOCK.min(row.len - i)]);
                }
                let is_shared = shared.is_some_and(|count| count[at] > 1.0) && area[at] > 0.0;
                let towards = if alpha[at] >= SOLID && !is_shared {
                    friction[i] = Real::INFINITY;
                    Vector::new(solid[0][at], solid[1][at], solid[2][at]) / alpha[at]
                } else if area[at] > 0.0 {
                    let open = if is_shared { (1.0 - alpha[at]).max(NARROWEST) } else { 1.0 - alpha[at] };
                    let (radius, towards) = (open / area[at], Vector::new(v1[i], v2[i], v3[i]) / area[at]);
                    let slip = (Vector::new(u1[at], u2[at], u3[at]) - towards).length();
                    let reynolds = slip * radius / flow.fluids.kinematic_viscosity(c[at]);
                    friction[i] = if alpha[at] < WALL {
                        beside_ends(alpha, at, strides, squares)
                    } else {
                        beside_slip(reynolds, parts[i % BLOCK]) / (radius * radius)
                    };
                    towards
                } else {
                    continue;
                };
                (v1[i], v2[i], v3[i]) = (towards.x, towards.y, towards.z);
            }
        });
    }

    /// Gives the cells that move with their grains the velocity of these.
    pub fn hold(&self, domain: &Domain, u: &mut [Field<Real>; 3]) {
        let [u1, u2, u3] = u.each_mut().map(Field::data_mut);
        let velocity = self.velocity.each_ref().map(Field::data);
        domain.for_each_row(&domain.interior(), (u1, u2, u3), |row, (u1, u2, u3)| {
            if !self.covered.holds(row.j, row.k) {
                return;
            }
            for (i, at) in row.shifted(0).enumerate().filter(|(_, at)| self.friction.data()[*at] == Real::INFINITY) {
                (u1[i], u2[i], u3[i]) = (velocity[0][at], velocity[1][at], velocity[2][at]);
            }
        });
    }

    /// Friction, velocity of the surface, and the rows in which there may be friction.
    pub(crate) fn parts(&self) -> (&[Real], [&[Real]; 3], &RowSet) {
        (self.friction.data(), self.velocity.each_ref().map(Field::data), &self.beside)
    }

    /// The rows that grains cover, and those beside them.
    pub(super) fn reach(&self) -> &RowSet {
        &self.beside
    }

    /// Momentum for the surfaces of the grains in each cell, per volume [N s/m^3], for writing.
    pub(crate) fn taken_mut(&mut self) -> [&mut Field<Real>; 3] {
        self.taken.each_mut()
    }

    /// Adds what the friction of a pass took from the fluid, per volume [N s/m^3].
    pub(crate) fn add_taken(&mut self, domain: &Domain, taken: [&Field<Real>; 3]) {
        let Self { taken: [t1, t2, t3], beside, .. } = self;
        let taken = taken.map(Field::data);
        let sums = (t1.data_mut(), t2.data_mut(), t3.data_mut());
        domain.for_each_row(&domain.interior(), sums, |row, (t1, t2, t3)| {
            if beside.holds(row.j, row.k) {
                for (sum, taken) in [t1, t2, t3].into_iter().zip(taken) {
                    sum.iter_mut().zip(&taken[row.shifted(0)]).for_each(|(sum, taken)| *sum += taken);
                }
            }
        });
    }
}

/// Resistance of the friction `f` [1/m^2] in a fluid of viscosity `mu` \[Pa s] and density `rho` [kg/m^3] in a step of
/// `dt` \[s] [kg/(m^3 s)].
#[inline]
pub(crate) fn resistance(friction: Real, mu: Real, rho: Real, dt: Real) -> Real {
    if friction == Real::INFINITY { HOLD * rho / dt } else { mu * friction }
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
        let resolved = |alpha: &[Real]| {
            let mut part = [0.0];
            resolved(alpha, at, strides, &mut part);
            part[0]
        };
        assert_eq!(resolved(&half), 1.0);
        let mixed = field(|_| 0.4);
        assert!(resolved(&mixed) < 1e-12);
        let between = field(|n| if n % 2 == 0 { 0.2 } else { 0.6 });
        let found = resolved(&between);
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
