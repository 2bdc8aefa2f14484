//! Liquid that has only the open part of the cells as its room.
//!
//! With the part `V` of a cell that is open, the liquid in it is `L = V C`. V is 1 - alpha where there is gas; in full cells it follows
//! the volume through their faces and may differ from 1 - alpha between steps too. A step carries
//!
//! ```text
//! phi = u_f - chi u_s                            chi u_s: mean of alpha u_s of two covered cells, else 0
//! L <- V C + (C* - C) - c_c D,   V <- V - D      D = dt div phi
//! ```
//!
//! with the fraction `C*` that the sweeps give with phi instead of u_f ([`crate::advection`]): `C* - C - c_c D` is the
//! liquid through the faces of the cell, so that the sum of L is kept to round-off, and a cell in a bath of liquid stays
//! full to the last bit. After the grains have moved, V becomes 1 - alpha; what that changes is gas. Liquid beyond
//! the room, or less than none, goes to the neighbours (`settle.rs`). C, and with it density and viscosity, is L / V. A cell without
//! room next to open ones takes C from these: it holds no liquid, but how far the pressure moves the faces between it and these
//! depends on its density. Left to the sweeps it would be gas beside liquid here and there, and a ball that floats would be shaken.
//!
//! Momentum is counted on the open part, `sum V rho u dV + sum M v`. The equations of the fluid still hold on whole cells; what
//! they give the part 1 - V of a cell, transport included, goes to the grains in it, and so does what a change of V leaves. Liquid that fills
//! the room of a cell makes its covered part heavier too: what that gains moves with the grains. With the velocity of the liquid that came it would
//! be energy from nowhere, the more the less room there is, for the grains to take when the cell comes to rest. A rest that no round places
//! has no momentum while it waits; the grains have it.

mod among_full;
mod settle;

use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

use super::surface::SOLID;
use super::{Imprint, ResolvedGrains};
use crate::boundary::Boundary;
use crate::flow::Flow;
use crate::mobility::RowSet;
use settle::Settler;

pub use settle::SettleReport;

/// Rooms smaller than this hold no liquid: their fraction is that of the sweeps. They are what the divergence that a solve leaves has made
/// of a cell without room, and must not decide where liquid goes.
const NONE: Real = 1e-6;
/// Fraction of a full cell.
const FULL: Real = 1.0;
/// Gas in a cell that counts as full once grains move.
const TRACE: Real = 1e-9;
/// Least mass of a cell without grains that takes momentum, over that of the fluid in a whole cell or over the mass that leaves its
/// momentum there: a lighter one would leap away.
const LIGHT: Real = 0.5;
/// Round-off of the liquid in a cell.
const ROUND_OFF: Real = 1e-15;

/// Velocity of a covered cell whose density changes from that of the transport, with the velocity `u`, to that of the liquid in its room:
/// what the covered part gains of mass moves with the grains, whose mean velocity is `solid` over `alpha` [m/s].
#[inline]
fn beside_grains(u: Real, densities: [Real; 2], solid: Real, alpha: Real) -> Real {
    let [before, after] = densities;
    if after > before { u + (1.0 - before / after) * (solid / alpha - u) } else { u }
}

/// Fraction and excess of the liquid `l` in the room `v`, both in cell volumes; `beside` is the fraction where there is no room.
fn split(l: Real, v: Real, beside: Real) -> [Real; 2] {
    let bounded = if v.abs() > NONE { l / v } else { beside }.clamp(0.0, 1.0);
    let excess = l - v * bounded;
    // Round-off is no reason to move liquid.
    if excess.abs() <= ROUND_OFF && v > NONE { [l / v, 0.0] } else { [bounded, excess] }
}

/// The open part of the cells, and what the equations of the whole cells owe to the grains.
pub(crate) struct Room {
    /// Open part V, ghosts filled.
    open: Field<Real>,
    /// Liquid fraction before the sweeps.
    fraction: Field<Real>,
    /// Velocity up to which the grains have got their part [m/s].
    kept: [Field<Real>; 3],
    /// Momentum for the grains of a cell, per volume [N s/m^3]; in a cell without grains what it was too light to take, until that is
    /// booked.
    given: [Field<Real>; 3],
    /// Liquid beyond the room, in cell volumes; between steps the rest that waits for room.
    excess: Field<Real>,
    /// Whether there is such a rest on any rank.
    waits: bool,
    /// Rows with grains, or with another room than that of a whole cell.
    rows: RowSet,
    /// Weight times time of the fluid on the covered part, over all ranks [N s].
    weight: Vector,
    settler: Settler,
}

impl Room {
    /// The room beside `grains`, if they act by their surfaces.
    pub fn beside(domain: &Domain, grains: &mut ResolvedGrains) -> Option<Self> {
        if !grains.leaves_room() {
            return None;
        }
        let three = || std::array::from_fn(|_| domain.field(0.0));
        let mut room = Self {
            open: domain.field(1.0),
            fraction: domain.field(0.0),
            kept: three(),
            given: three(),
            excess: domain.field(0.0),
            waits: false,
            rows: RowSet::default(),
            weight: Vector::ZERO,
            settler: Settler::new(domain),
        };
        let imprint = grains.covered_mut();
        let alpha = imprint.solid_fraction.data();
        domain.for_each_row(&domain.interior(), room.open.data_mut(), |row, open| {
            open.iter_mut().zip(&alpha[row.shifted(0)]).for_each(|(open, &alpha)| *open = open_part(alpha));
        });
        room.complete(domain, imprint);
        Some(room)
    }

    /// Fills ghosts, and finds the rows that are not wholly open.
    pub fn complete(&mut self, domain: &Domain, imprint: &mut Imprint) {
        imprint.fill_halos(domain);
        domain.fill_halos(&mut [(&mut self.open, &GhostRules::EVEN)]);
        self.mark(domain, imprint);
    }

    /// Finds the rows that are not wholly open.
    fn mark(&mut self, domain: &Domain, imprint: &Imprint) {
        let Self { rows, open, excess, .. } = self;
        let [n1, n2, n3] = domain.cells();
        let alpha = imprint.solid_fraction.data();
        rows.mark([n2, n3], |j, k| {
            let start = open.at(-1, j, k);
            let row = start..start + n1 + 2;
            let differs = |field: &[Real], from: Real| field[row.clone()].iter().any(|&value| value != from);
            differs(open.data(), 1.0) || differs(alpha, 0.0) || differs(excess.data(), 0.0)
        });
    }

    /// The open part of the cells as a field.
    pub fn open_field(&self) -> &Field<Real> {
        &self.open
    }

    /// The same for writing, at a restart: [`Self::resume`] comes after it.
    pub fn open_mut(&mut self) -> &mut Field<Real> {
        &mut self.open
    }

    /// The rests that wait for room as a field, in cell volumes.
    pub fn waiting_field(&self) -> &Field<Real> {
        &self.excess
    }

    /// The same for writing, at a restart: [`Self::resume`] comes after it.
    pub fn waiting_mut(&mut self) -> &mut Field<Real> {
        &mut self.excess
    }

    /// Goes on with open parts and rests of a restart.
    pub fn resume(&mut self, domain: &Domain, imprint: &mut Imprint) {
        self.waits = self.largest_excess(domain, None) > 0.0;
        self.complete(domain, imprint);
    }

    /// The open part of the cells, by place in memory.
    pub fn open(&self) -> &[Real] {
        self.open.data()
    }

    /// The part of a cell that liquid can fill, by place in memory; 0 where its fraction means nothing.
    #[inline]
    pub fn for_liquid(&self, at: usize) -> Real {
        usable(self.open.data()[at])
    }

    /// Momentum for the grains of each cell, per volume [N s/m^3].
    pub fn given(&self) -> &[Field<Real>; 3] {
        &self.given
    }

    /// The open part of the cells, by place in memory, and the momentum for the grains of each cell for writing, per volume [N s/m^3].
    pub fn open_and_given(&mut self) -> (&[Real], [&mut Field<Real>; 3]) {
        (self.open.data(), self.given.each_mut())
    }

    /// Forgets what has been given, and the weight of the fluid on the covered part times the time [N s].
    pub fn take_given(&mut self, domain: &Domain) -> Vector {
        let [g1, g2, g3] = self.given.each_mut().map(Field::data_mut);
        domain.for_each_row(&domain.interior(), (g1, g2, g3), |row, (g1, g2, g3)| {
            if self.rows.holds(row.j, row.k) {
                [g1, g2, g3].into_iter().for_each(|given| given.fill(0.0));
            }
        });
        std::mem::take(&mut self.weight)
    }

    /// From now on the grains get their part of what changes the `velocity`.
    pub fn keep(&mut self, domain: &Domain, velocity: &[Field<Real>; 3]) {
        for (kept, u) in self.kept.iter_mut().zip(velocity) {
            domain.for_each_row(&domain.interior(), kept.data_mut(), |row, kept| {
                if self.rows.holds(row.j, row.k) {
                    kept.copy_from_slice(&u.data()[row.shifted(0)]);
                }
            });
        }
    }

    /// Gives the grains what the covered part has gained since the velocity was kept, less the `fall` of a free fluid [m/s]. In a
    /// cell without grains the fluid takes all.
    pub fn hand_over(&mut self, domain: &Domain, imprint: &Imprint, flow: &mut Flow, fall: Vector) {
        let Self { open, kept, given, rows, weight, .. } = self;
        let (open, rho, alpha) = (open.data(), flow.density.data(), imprint.solid_fraction.data());
        for (d, (kept, given)) in kept.iter_mut().zip(given).enumerate() {
            let fields = (flow.velocity[d].data_mut(), kept.data_mut(), given.data_mut());
            domain.for_each_row(&domain.interior(), fields, |row, (u, kept, given)| {
                if !rows.holds(row.j, row.k) {
                    return;
                }
                for (i, at) in row.shifted(0).enumerate() {
                    if alpha[at] > 0.0 {
                        given[i] += (1.0 - open[at]) * rho[at] * (u[i] - kept[i] - fall[d]);
                    } else if open[at] != 1.0 {
                        u[i] = kept[i] + (u[i] - kept[i]) / open[at];
                    }
                    kept[i] = u[i];
                }
            });
        }
        if fall != Vector::ZERO {
            let covered = domain.sum_rows(&domain.interior(), |row| {
                let mass = |at: usize| if alpha[at] > 0.0 { (1.0 - open[at]) * rho[at] } else { 0.0 };
                [if rows.holds(row.j, row.k) { row.shifted(0).map(mass).sum() } else { 0.0 }]
            });
            *weight += domain.sum(covered)[0] * domain.grid().cell_volume() * fall;
        }
    }

    /// Takes from the grains what their hold on the cells that move with them has given to the fluid in these.
    pub fn hold(&mut self, domain: &Domain, flow: &Flow) {
        let Self { open, kept, given, rows, .. } = self;
        let (open, rho) = (open.data(), flow.density.data());
        for (d, (kept, given)) in kept.iter_mut().zip(given).enumerate() {
            let u = flow.velocity[d].data();
            domain.for_each_row(&domain.interior(), (kept.data_mut(), given.data_mut()), |row, (kept, given)| {
                if !rows.holds(row.j, row.k) {
                    return;
                }
                for (i, at) in row.shifted(0).enumerate() {
                    given[i] -= open[at] * rho[at] * (u[at] - kept[i]);
                    kept[i] = u[at];
                }
            });
        }
    }

    /// Finds the volume that moving grains carry through the faces between covered cells in a transport, over the area of the faces [m/s]:
    /// beside cells that grains share what their sections carry, as the projection has it ([`crate::mobility`]).
    pub fn find_carried(&mut self, domain: &Domain, grains: &ResolvedGrains, flow: &mut Flow) {
        let imprint = grains.covered();
        let (alpha, shared) = (imprint.solid_fraction.data(), imprint.shared());
        let [w1, w2, w3, ..] = &mut flow.work;
        if shared.is_some() {
            grains.carry_through_faces(domain, [w1, w2, w3]);
        }
        let is_shared = |at: usize| shared.is_some_and(|count| count[at] > 1.0);
        let rows = grains.covered_rows();
        for (d, carried) in self.settler.among.velocity.iter_mut().enumerate() {
            let (behind, solid) = (domain.strides()[d] as usize, imprint.solid_velocity[d].data());
            let fluxes = flow.work[d].data();
            let mean_of = |at: usize| solid[at] / alpha[at].max(1.0);
            domain.for_each_row(&domain.faces(d), carried.data_mut(), |row, carried| {
                if !rows.holds(row.j, row.k) {
                    return;
                }
                for (carried, at) in carried.iter_mut().zip(row.shifted(0)) {
                    if alpha[at] > 0.0 && alpha[at - behind] > 0.0 {
                        let shared = is_shared(at) || is_shared(at - behind);
                        let mean = || 0.5 * (mean_of(at) + mean_of(at - behind));
                        *carried = if shared { fluxes[at] } else { mean() };
                    }
                }
            });
        }
    }

    /// Adds `sign` times what grains carry, found before, to the face velocity.
    pub fn carry_grains(&self, domain: &Domain, imprint: &Imprint, flow: &mut Flow, sign: Real) {
        let alpha = imprint.solid_fraction.data();
        for (d, (uf, carried)) in flow.face_velocity.iter_mut().zip(&self.settler.among.velocity).enumerate() {
            let (behind, carried) = (domain.strides()[d] as usize, carried.data());
            let (a, b) = ([0, 1, 0][d], [0, 0, 1][d]);
            let last = domain.cells()[d] as isize;
            let [lower, upper] = [0, 1].map(|side| domain.at_box_end(d, side) && !domain.periodic()[d]);
            domain.for_each_row(&domain.faces(d), uf.data_mut(), |row, uf| {
                if !self.rows.holds(row.j, row.k) || !self.rows.holds(row.j - a, row.k - b) {
                    return;
                }
                for (i, at) in row.shifted(0).enumerate() {
                    let index = [row.first + i as isize, row.j, row.k][d];
                    let on_side = (lower && index == 0) || (upper && index == last);
                    if alpha[at] > 0.0 && alpha[at - behind] > 0.0 && !on_side {
                        uf[i] += sign * carried[at];
                    }
                }
            });
        }
    }

    /// Takes the momentum of the rests that wait for room from the grains again.
    fn take_up(&mut self, domain: &Domain, flow: &Flow) {
        if !self.waits {
            return;
        }
        let drho = flow.fluids.liquid_density - flow.fluids.gas_density;
        let excess = self.excess.data();
        for (given, u) in self.given.iter_mut().zip(&flow.velocity) {
            domain.for_each_row(&domain.interior(), given.data_mut(), |row, given| {
                for (given, at) in given.iter_mut().zip(row.shifted(0)).filter(|(_, at)| excess[*at] != 0.0) {
                    *given -= drho * excess[at] * u.data()[at];
                }
            });
        }
    }

    /// Keeps the liquid fraction before the sweeps.
    pub fn keep_fraction(&mut self, domain: &Domain, flow: &Flow) {
        self.take_up(domain, flow);
        let c = &flow.volume_fraction;
        domain.for_each_row(&domain.interior(), self.fraction.data_mut(), |row, fraction| {
            if self.rows.holds(row.j, row.k) {
                fraction.copy_from_slice(&c.data()[row.shifted(0)]);
            }
        });
    }

    /// Turns what the sweeps of `dt` \[s] with the present face velocities have done to whole cells into what it is to their
    /// open parts.
    pub fn carried(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        imprint: &Imprint,
        flow: &mut Flow,
        dt: Real,
    ) -> SettleReport {
        let Self { open, fraction, kept, given, excess, rows, .. } = self;
        let strides = domain.strides().map(|stride| stride as usize);
        let per_width = domain.grid().spacing.recip() * dt;
        let Flow { volume_fraction, velocity, face_velocity, fluids, .. } = flow;
        let (alpha, faces) = (imprint.solid_fraction.data(), face_velocity.each_ref().map(Field::data));
        let solid = imprint.solid_velocity.each_ref().map(Field::data);
        let (before, drho) = (fraction.data(), fluids.liquid_density - fluids.gas_density);
        let kept = kept.each_ref().map(Field::data);
        let [u1, u2, u3] = velocity.each_mut().map(Field::data_mut);
        let [g1, g2, g3] = given.each_mut().map(Field::data_mut);
        let fields = (volume_fraction.data_mut(), open.data_mut(), excess.data_mut(), (u1, u2, u3), (g1, g2, g3));
        domain.for_each_row(&domain.interior(), fields, |row, (c, open, excess, (u1, u2, u3), (g1, g2, g3))| {
            if !rows.holds(row.j, row.k) {
                return;
            }
            for (i, at) in row.shifted(0).enumerate() {
                if alpha[at] == 0.0 && open[i] == 1.0 && excess[i] == 0.0 {
                    continue;
                }
                let widening = |d: usize| per_width[d] * (faces[d][at + strides[d]] - faces[d][at]);
                let dilatation = widening(0) + widening(1) + widening(2);
                let (was, full) = (before[at], if before[at] > 0.5 { 1.0 } else { 0.0 });
                let liquid = open[i] * was + (c[i] - was) - full * dilatation + excess[i];
                let whole = fluids.density(was) + dilatation * fluids.density(full);
                let covered = whole - open[i] * fluids.density(was) - drho * excess[i];
                open[i] -= dilatation;
                let swept = fluids.density(c[i].clamp(0.0, 1.0));
                [c[i], excess[i]] = split(liquid, open[i], c[i]);
                let densities = [swept, fluids.density(c[i])];
                let mass = open[i] * fluids.density(c[i]) + drho * excess[i];
                let is_light = mass <= LIGHT * covered.abs();
                for (d, (u, given)) in
                    [(&mut *u1, &mut *g1), (&mut *u2, &mut *g2), (&mut *u3, &mut *g3)].into_iter().enumerate()
                {
                    let left = covered * (u[i] - kept[d][at]);
                    if alpha[at] > 0.0 {
                        let now = beside_grains(u[i], densities, solid[d][at], alpha[at]);
                        given[i] += left + mass * (u[i] - now);
                        u[i] = now;
                    } else if is_light {
                        given[i] += left;
                    } else {
                        u[i] += left / mass;
                    }
                }
            }
        });
        domain.fill_halos(&mut [(&mut self.open, &GhostRules::EVEN)]);
        let report = self.settle(domain, boundary, imprint, flow, Some(dt));
        self.mark(domain, imprint);
        self.keep(domain, &flow.velocity);
        report
    }

    /// Gives the fluid the room that the grains leave it in their new places, where they have the velocity in `imprint`.
    pub fn refit(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        imprint: &mut Imprint,
        flow: &mut Flow,
    ) -> SettleReport {
        self.take_up(domain, flow);
        let Self { open, given, excess, rows, .. } = self;
        let Flow { volume_fraction, velocity, fluids, .. } = flow;
        let drho = fluids.liquid_density - fluids.gas_density;
        let alpha = imprint.solid_fraction.data();
        let moving = imprint.solid_velocity.each_ref().map(Field::data);
        let [u1, u2, u3] = velocity.each_mut().map(Field::data_mut);
        let [g1, g2, g3] = given.each_mut().map(Field::data_mut);
        let fields = (volume_fraction.data_mut(), open.data_mut(), excess.data_mut(), (u1, u2, u3), (g1, g2, g3));
        domain.for_each_row(&domain.interior(), fields, |row, (c, open, excess, (u1, u2, u3), (g1, g2, g3))| {
            if !rows.holds(row.j, row.k) && !imprint.row_is_covered(row.j, row.k) {
                return;
            }
            for (i, at) in row.shifted(0).enumerate() {
                let now = open_part(alpha[at]);
                if now == open[i] {
                    continue;
                }
                let (liquid, density) = (open[i] * c[i] + excess[i], fluids.density(c[i]));
                let before = open[i] * density + drho * excess[i];
                // Without gas for the difference it is the room that differs.
                [c[i], excess[i]] = if c[i] > FULL - TRACE { [FULL, liquid - now] } else { split(liquid, now, c[i]) };
                open[i] = now;
                let after = now * fluids.density(c[i]) + drho * excess[i];
                let densities = [density, fluids.density(c[i])];
                let is_light = after <= LIGHT * before.abs().max(densities[1]);
                for (d, (u, given)) in [(&mut *u1, &mut *g1), (u2, g2), (u3, g3)].into_iter().enumerate() {
                    if alpha[at] > 0.0 {
                        let now = beside_grains(u[i], densities, moving[d][at], alpha[at]);
                        given[i] += before * u[i] - after * now;
                        u[i] = now;
                    } else if is_light {
                        given[i] += (before - after) * u[i];
                    } else {
                        u[i] *= before / after;
                    }
                }
            }
        });
        domain.fill_halos(&mut [(&mut self.open, &GhostRules::EVEN)]);
        let report = self.settle(domain, boundary, imprint, flow, None);
        self.complete(domain, imprint);
        let rules = boundary.volume_fraction_rules();
        domain.fill_halos_to(1, &mut [(&mut flow.volume_fraction, &rules)]);
        self.continue_into_grains(domain, flow);
        domain.fill_halos(&mut [(&mut flow.volume_fraction, &rules)]);
        flow.update_density(domain);
        report
    }

    /// Gives cells without room the mean liquid fraction of those around that have some, by their room; first ghost layers filled.
    fn continue_into_grains(&mut self, domain: &Domain, flow: &mut Flow) {
        let Self { open, fraction, rows, .. } = self;
        let (open, c, strides) = (open.data(), flow.volume_fraction.data(), domain.strides());
        domain.for_each_row(&domain.interior(), fraction.data_mut(), |row, fraction| {
            if !rows.holds(row.j, row.k) {
                return;
            }
            for (fraction, at) in fraction.iter_mut().zip(row.shifted(0)) {
                *fraction = if open[at] == 0.0 { mean_around(open, c, at, strides).unwrap_or(c[at]) } else { c[at] };
            }
        });
        let fraction = fraction.data();
        domain.for_each_row(&domain.interior(), flow.volume_fraction.data_mut(), |row, c| {
            if rows.holds(row.j, row.k) {
                c.copy_from_slice(&fraction[row.shifted(0)]);
            }
        });
    }

    /// Volume of the liquid, that which waits for room included, over all ranks [m^3].
    pub fn liquid_volume(&self, domain: &Domain, c: &Field<Real>) -> Real {
        let (open, c, waiting) = (self.open.data(), c.data(), self.excess.data());
        let liquid = |at: usize| open[at] * c[at] + waiting[at];
        let sum = domain.sum_rows(&domain.interior(), |row| [row.shifted(0).map(liquid).sum()]);
        domain.sum(sum)[0] * domain.grid().cell_volume()
    }

    /// Kinetic energy of the fluid in the open part of the cells, over all ranks \[J].
    pub fn kinetic_energy(&self, domain: &Domain, flow: &Flow) -> Real {
        let rho = flow.density.data();
        let u = flow.velocity.each_ref().map(Field::data);
        let sum = domain.sum_rows(&domain.interior(), |row| {
            let square = |at: usize| u[0][at] * u[0][at] + u[1][at] * u[1][at] + u[2][at] * u[2][at];
            [row.shifted(0).map(|at| 0.5 * self.for_liquid(at) * rho[at] * square(at)).sum()]
        });
        domain.sum(sum)[0] * domain.grid().cell_volume()
    }

    /// Momentum of the fluid on the covered part of the cells, over all ranks [N s].
    pub fn covered_momentum(&self, domain: &Domain, flow: &Flow) -> Vector {
        let (open, rho) = (self.open.data(), flow.density.data());
        let u = flow.velocity.each_ref().map(Field::data);
        let sum = domain.sum(domain.sum_rows(&domain.interior(), |row| {
            if !self.rows.holds(row.j, row.k) {
                return [0.0; 3];
            }
            [0, 1, 2].map(|d| row.shifted(0).map(|at| (1.0 - open[at]) * rho[at] * u[d][at]).sum())
        }));
        Vector::from_array(sum) * domain.grid().cell_volume()
    }
}

/// Mean of the fraction `c` in the 26 cells around, by the part that liquid can fill over the square of the distance; `None` where that
/// is none.
fn mean_around(open: &[Real], c: &[Real], at: usize, strides: [isize; 3]) -> Option<Real> {
    let (mut room, mut liquid) = (0.0, 0.0);
    for n in (0..27_isize).filter(|&n| n != 13) {
        let offset = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
        let by: isize = offset.iter().zip(strides).map(|(o, s)| o * s).sum();
        let beside = (at as isize + by) as usize;
        let weight = usable(open[beside]) / offset.iter().map(|o| o * o).sum::<isize>() as Real;
        room += weight;
        liquid += weight * c[beside];
    }
    (room > 0.0).then(|| liquid / room)
}

/// The part of the room `open` that liquid can fill.
#[inline]
fn usable(open: Real) -> Real {
    if open > NONE { open } else { 0.0 }
}

/// The open part of a cell covered by `alpha`.
fn open_part(alpha: Real) -> Real {
    if alpha < SOLID { 1.0 - alpha } else { 0.0 }
}
