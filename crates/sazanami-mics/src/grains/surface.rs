//! The surface of the grains in the viscous equation: rigid cells, and friction beside them.
//!
//! A cell covered by at least [`SOLID`] moves with its grains. In a cell covered by half or more the open part has
//! its centroid at `(1 - alpha) dx / 2` from the surface, in a cell covered by less whose neighbour `r` is covered
//! by half or more the surface lies `(3/2 - alpha - alpha_r) dx` from the centre. From these distances comes a
//! friction `mu f (u_s - u)` towards the velocity of the surface, implicit with the viscous stress; what the
//! stress between the two cells already takes is left out of `f`. The friction acts with the opposite sign on the
//! grain, at the point of the surface.
//!
//! Distances from volume fractions along a grid line are those of a height function; the corrected distance in the
//! diagonal follows Luchini, arXiv 2506.14328.

use sazanami_numerics::choices;
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

use super::imprint::{Imprint, Share};
use crate::mobility::RowSet;

/// Solid fraction from which on a cell moves with its grains.
pub(super) const SOLID: Real = 0.99;
/// Solid fraction from which on the centre of a cell lies inside a grain.
const INSIDE: Real = 0.5;
/// Least distance between the centre of a cell and a surface beside it, in cell widths: where the two expressions
/// for the friction meet at `alpha = 1/2`.
const LEAST_DISTANCE: Real = 0.25;
/// Friction of a cell that moves with its grains over its inertia.
const HOLD: Real = 1e9;

/// Friction of the open part of a cell covered by `alpha` on its own surface, times the squared cell width.
fn own_friction(alpha: Real) -> Real {
    2.0 / (1.0 - alpha)
}

/// Friction of a cell covered by `alpha` on the surface in its neighbour covered by `inside`, less what the stress
/// between the two cells takes, times the squared cell width.
fn friction_beside(alpha: Real, inside: Real) -> Real {
    let distance = (1.5 - alpha - inside.min(1.0)).max(LEAST_DISTANCE);
    let through = if inside >= SOLID { 1.0 } else { 2.0 / (3.0 - inside) };
    1.0 / distance - through
}

/// From the centroid of the covered part of a cell covered by `inside` to the surface towards its neighbour covered
/// by `alpha`, in cell widths.
fn to_surface(alpha: Real, inside: Real) -> Real {
    let inside = inside.min(1.0);
    let distance = (1.5 - alpha - inside).max(LEAST_DISTANCE);
    1.0 + 0.5 * (1.0 - inside) - distance
}

choices! {
    /// Friction of the fluid on the surfaces of grains.
    #[derive(Default)]
    pub enum SurfaceFriction {
        /// From the distance between the centre of a cell and the surface in it or beside it.
        Distance = "distance",
        /// From the hydraulic radius of a cell, its open volume over the surface in it: one formula from grains that the grid
        /// resolves to pores narrower than a cell. The viscous step sees gravity and the pressure gradient.
        HydraulicRadius = "hydraulic_radius",
        /// As `hydraulic_radius`, with Ergun's form drag in pores; where the grid resolves a surface, the friction of a boundary layer
        /// that is thinner as the Reynolds number of the slip past it grows.
        #[default]
        HydraulicRadiusSlip = "hydraulic_radius_slip",
    }
}

impl SurfaceFriction {
    /// Whether it comes from the surface in each cell.
    pub(super) fn is_wetted(self) -> bool {
        self != Self::Distance
    }
}

/// Friction on the surfaces of the grains.
pub(crate) struct Surface {
    /// Friction over the viscosity [1/m^2]; infinite in cells that move with their grains.
    pub(super) friction: Field<Real>,
    /// Velocity of the surface in cells with friction [m/s].
    pub(super) velocity: [Field<Real>; 3],
    /// Surface in each cell over its volume [1/m], if the friction comes from it.
    pub(super) area: Field<Real>,
    /// Law of the friction.
    pub(super) law: SurfaceFriction,
    /// Momentum that friction took from the fluid in this step, per volume [N s/m^3].
    pub(super) taken: [Field<Real>; 3],
    /// Rows that grains cover, and those beside them too.
    pub(crate) covered: RowSet,
    pub(super) beside: RowSet,
}

impl Surface {
    /// No surfaces, for fields of `cells` cells.
    pub fn new(cells: [usize; 3], law: SurfaceFriction) -> Self {
        let area = Field::new(if law.is_wetted() { cells } else { [0; 3] }, 0.0);
        let three = || std::array::from_fn(|_| Field::new(cells, 0.0));
        let friction = Field::new(cells, 0.0);
        let (covered, beside) = (RowSet::default(), RowSet::default());
        Self { friction, velocity: three(), area, law, taken: three(), covered, beside }
    }

    /// Places the surfaces for a step: fills the ghosts of `imprint` and of the angular velocities `spin`, times the
    /// solid fraction, that belong to it.
    pub fn place(&mut self, domain: &Domain, imprint: &mut Imprint, spin: [&mut Field<Real>; 3]) {
        imprint.fill_halos(domain);
        let [w1, w2, w3] = spin;
        let even = &GhostRules::EVEN;
        domain.fill_halos_to(1, &mut [(w1, even), (w2, even), (w3, even)]);
        self.covered.covered(domain, &imprint.solid_fraction, |j, k| imprint.row_is_covered(j, k));
        self.beside.and_beside(domain, &self.covered);
        let (strides, spacing) = (domain.strides().map(|s| s as usize), domain.grid().spacing);
        let alpha = imprint.solid_fraction.data();
        let solid = imprint.solid_velocity.each_ref().map(Field::data);
        let spin = [w1, w2, w3].map(|w| w.data());
        let of = |fields: [&[Real]; 3], at: usize| Vector::new(fields[0][at], fields[1][at], fields[2][at]) / alpha[at];
        let Self { friction, velocity: [v1, v2, v3], taken: [t1, t2, t3], beside, .. } = self;
        let fields = (
            friction.data_mut(),
            v1.data_mut(),
            v2.data_mut(),
            v3.data_mut(),
            t1.data_mut(),
            t2.data_mut(),
            t3.data_mut(),
        );
        domain.for_each_row(&domain.interior(), fields, |row, (friction, v1, v2, v3, t1, t2, t3)| {
            for values in [&mut *friction, t1, t2, t3] {
                values.fill(0.0);
            }
            if !beside.holds(row.j, row.k) {
                return;
            }
            for (i, at) in row.shifted(0).enumerate() {
                let (mut sum, mut towards) = (0.0, Vector::ZERO);
                if alpha[at] >= SOLID {
                    (sum, towards) = (Real::INFINITY, of(solid, at));
                } else if alpha[at] >= INSIDE {
                    let (normal, width) = normal(alpha, at, strides, spacing);
                    sum = own_friction(alpha[at]) / (width * width);
                    towards = of(solid, at) + of(spin, at).cross(0.5 * alpha[at] * width * normal);
                } else {
                    for (neighbour, d, sign) in neighbours(at, strides).filter(|n| alpha[n.0] >= INSIDE) {
                        let weight = friction_beside(alpha[at], alpha[neighbour]) / (spacing[d] * spacing[d]);
                        let mut arm = Vector::ZERO;
                        arm[d] = -sign * to_surface(alpha[at], alpha[neighbour]) * spacing[d];
                        sum += weight;
                        towards += weight * (of(solid, neighbour) + of(spin, neighbour).cross(arm));
                    }
                    if sum > 0.0 {
                        towards /= sum;
                    }
                }
                friction[i] = sum;
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

    /// Fills the ghosts of what the friction took, for [`Self::on_grain`].
    pub fn complete(&mut self, domain: &Domain) {
        let Self { friction, taken: [t1, t2, t3], .. } = self;
        let even = &GhostRules::EVEN;
        domain.fill_halos_to(1, &mut [(friction, even), (t1, even), (t2, even), (t3, even)]);
    }

    /// Impulse per cell volume that the friction in and beside a cell gives a grain that covers the `part` of the
    /// solid in it, and the angular impulse about the grain's centre [N s/m^3, N s/m^2].
    pub fn on_grain(&self, domain: &Domain, alpha: &[Real], share: &Share, part: Real) -> [Vector; 2] {
        let (strides, spacing) = (domain.strides().map(|s| s as usize), domain.grid().spacing);
        let (at, arm) = (share.at as usize, share.arm());
        let taken =
            |at: usize| Vector::new(self.taken[0].data()[at], self.taken[1].data()[at], self.taken[2].data()[at]);
        if self.is_wetted() {
            return self.on_wetted_grain(domain, share, part, taken(at));
        }
        if alpha[at] < INSIDE {
            return [Vector::ZERO; 2];
        }
        let (normal, width) = normal(alpha, at, strides, spacing);
        let depth = if alpha[at] < SOLID { 0.5 * alpha[at] * width } else { 0.0 };
        let own = part * taken(at);
        let (mut impulse, mut angular) = (own, (arm + depth * normal).cross(own));
        for (neighbour, d, sign) in neighbours(at, strides) {
            let friction = self.friction.data()[neighbour];
            if alpha[neighbour] >= INSIDE || friction == 0.0 {
                continue;
            }
            let weight = friction_beside(alpha[neighbour], alpha[at]) / (spacing[d] * spacing[d]) / friction;
            let given = part * weight * taken(neighbour);
            let mut arm = arm;
            arm[d] += sign * to_surface(alpha[neighbour], alpha[at]) * spacing[d];
            impulse += given;
            angular += arm.cross(given);
        }
        [impulse, angular]
    }

    /// Friction, velocity of the surface, and the rows in which there may be friction.
    pub(crate) fn parts(&self) -> (&[Real], [&[Real]; 3], &RowSet) {
        (self.friction.data(), self.velocity.each_ref().map(Field::data), &self.beside)
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

/// The six neighbours of a cell: place, direction and sign.
fn neighbours(at: usize, strides: [usize; 3]) -> impl Iterator<Item = (usize, usize, Real)> {
    (0..3).flat_map(move |d| [(at - strides[d], d, -1.0), (at + strides[d], d, 1.0)])
}

/// Outward normal of the surface in a cell, and the width of the cell along it \[m].
fn normal(alpha: &[Real], at: usize, strides: [usize; 3], spacing: Vector) -> (Vector, Real) {
    let slope = |d: usize| (alpha[at - strides[d]].min(1.0) - alpha[at + strides[d]].min(1.0)) / spacing[d];
    let normal = Vector::new(slope(0), slope(1), slope(2)).normalize_or_zero();
    let along = (normal * normal / (spacing * spacing)).element_sum();
    (normal, if along > 0.0 { along.sqrt().recip() } else { spacing.min_element() })
}
