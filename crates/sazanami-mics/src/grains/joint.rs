//! The velocities of free grains as unknowns of the viscous step and of the projection.
//!
//! Friction on its surface takes a free grain and the fluid in its cells towards one another. Where the resistance over a step is
//! not small beside the mass of the grain, friction towards the velocity at the start of the step would overshoot. So the velocity `w` and
//! the spin at the end of the step are unknowns: with the impulse `I(w)` of the viscous step on the grain, friction and what the covered part of the
//! cells gains less its weight, and the acceleration `c` by all else (contacts, transport) in the last step,
//!
//! ```text
//! m (w - v) = I(w) + m dt (g + c)
//! ```
//!
//! `I` is linear. Where much of it hangs on the viscous stress, rounds of the viscous solve find `w` by secants from the resistance
//! `A = sum (1 - alpha) rho dV a (1 + s)/(1 + a + s)`, `a = dt mu f/rho`, `s` the diagonal of the viscous operator. What is
//! left goes to grain and fluid as friction alone shares it out: with `b = 1/(1 + a)` and `B = sum (1 - alpha) rho dV (1 - b)` grain and
//! bound fluid change by
//!
//! ```text
//! (m + B) d = rest,     du = (1 - b) d in the cells of the grain
//! ```
//!
//! and so they do by the change of the acceleration `a_f` of the fluid in the projection,
//!
//! ```text
//! (m + B) d = sum rho dV (alpha b + k (1 - b)) dt da_f,     du = b dt da_f + (1 - b) d
//! ```
//!
//! with the part `k` of the surface in the cell that is the grain's: the projection moves the closed part of a face as a grain with its bound
//! fluid moves. Whatever `w` is, what friction takes from the fluid it gives to the grain.

use sazanami_dem::Motion;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::{for_each_chunk, max_over};

use super::covered::part;
use super::imprint::{Imprint, Share, two};
use super::{ResolvedGrains, Surface};
use crate::boundary::Boundary;
use crate::diffusion::{DiffusionReport, ViscosityError};
use crate::flow::Flow;
use crate::schemes::ViscosityScheme;

/// Part of the resistance over the mass that hangs on the viscous stress, and over which on the viscous equation is solved again.
const SPREAD: Real = 0.1;
/// Solves of the viscous equation then, at most.
const ROUNDS: usize = 4;
/// Part of what the first solve leaves that is left at last.
const CLOSE: Real = 0.05;
/// Bounds of the slope of the impulse over the estimate.
const SLOPES: [Real; 2] = [0.05, 4.0];

/// State of the joint step.
#[derive(Default)]
pub(super) struct Joint {
    /// Whether velocities are unknowns in this step.
    pub on: bool,
    /// Velocity and spin at the end of the pass, as far as known, of every grain and ghost [m/s, rad/s].
    pub velocity: Vec<[Real; 6]>,
    /// Whether these are no longer those that the surfaces were placed with.
    moved: bool,
    /// Velocity and spin at its start.
    start: Vec<[Real; 6]>,
    /// What the grains and the covered part hold of impulses: at the start, now.
    held: Vec<[Real; 7]>,
    now: Vec<[Real; 7]>,
    /// A, B, the same of the rotation, and the volume of bound fluid, of every owned grain [kg, kg m^2, m^3].
    bound: Vec<[Real; 5]>,
    /// Impulses that are left, of owned grains; changes of the velocity, of all.
    left: Vec<[Real; 6]>,
    change: Vec<[Real; 6]>,
    slope: Vec<[Real; 2]>,
    /// Impulse and angular impulse of viscosity, friction and projection in the step.
    pub gained: Vec<[Real; 6]>,
    /// Velocity before the viscous step [m/s].
    kept: Option<[Field<Real>; 3]>,
    pub density: Vec<[Real; 1]>,
}

fn six([a, b]: [Vector; 2]) -> [Real; 6] {
    [a.x, a.y, a.z, b.x, b.y, b.z]
}

/// The part of the friction in the cell of a share that acts on its grain, and where from its centre \[m].
#[inline]
pub(super) fn hold_on([friction, area, alpha]: [&[Real]; 3], share: &Share) -> (Real, Vector) {
    let at = share.at as usize;
    if friction[at] == Real::INFINITY {
        (share.fraction / alpha[at], share.arm())
    } else if area[at] > 0.0 {
        (Real::from(share.wetted) / area[at], share.foot())
    } else {
        (0.0, Vector::ZERO)
    }
}

/// The velocity where it acts, of a grain in `motion`, times that part [m/s].
#[inline]
fn by_hold(grip: [&[Real]; 3], share: &Share, motion: &[Real; 6]) -> Vector {
    let ([velocity, spin], (weight, place)) = (two(motion), hold_on(grip, share));
    weight * (velocity + spin.cross(place))
}

impl Surface {
    /// The fields that [`hold_on`] needs.
    pub(super) fn grip<'a>(&'a self, imprint: &'a Imprint) -> [&'a [Real]; 3] {
        [self.friction.data(), imprint.area.data(), imprint.solid_fraction.data()]
    }

    /// Gives the cells with friction the velocity of the surfaces of grains in `motion`.
    fn follow(&mut self, domain: &Domain, imprint: &Imprint, motion: &[[Real; 6]]) {
        let Self { friction, velocity, .. } = self;
        let grip = [friction.data(), imprint.area.data(), imprint.solid_fraction.data()];
        imprint.sum_shares(domain, velocity.each_mut(), |n, share| by_hold(grip, share, &motion[n]));
    }
}

impl ResolvedGrains {
    /// Whether velocities of grains are unknowns in steps of this `flow`: grains act by their surfaces, and some are free.
    pub(crate) fn joins(&self, domain: &Domain, flow: &Flow) -> bool {
        let viscous = flow.schemes.viscosity != ViscosityScheme::Off;
        self.has_surfaces() && viscous && self.largest(domain, |_| 1.0) > 0.0
    }

    /// Starts a step: the grains have the velocity that they have.
    pub(super) fn begin_joint(&mut self) {
        let joint = &mut self.joint;
        joint.gained.clear();
        joint.gained.resize(self.engine.grains().owned(), [0.0; 6]);
        joint.velocity.clear();
        joint.velocity.extend_from_slice(&self.motion);
        joint.moved = false;
    }

    /// Starts a pass of `dt` \[s] after the transport; `response` is the factor b in the cells.
    pub(crate) fn join(&mut self, domain: &Domain, flow: &Flow, response: Option<&[Real]>, dt: Real) {
        let Some(response) = response.filter(|_| self.joint.on) else { return };
        let count = self.engine.grains().len();
        let Self { joint, imprint, surface, engine, by_block, .. } = self;
        joint.bound.resize(count, [0.0; 5]);
        let (volume, alpha) = (domain.grid().cell_volume(), imprint.solid_fraction.data());
        let grip = surface.grip(imprint);
        let (c, rho) = (flow.volume_fraction.data(), flow.density.data());
        let squares = 2.0 * dt * (domain.grid().spacing * domain.grid().spacing).recip().element_sum();
        imprint.set_by_block(&mut joint.bound, by_block, |n| {
            let mut bound = [0.0; 5];
            for share in imprint.shares(n) {
                let at = share.at as usize;
                let (weight, place) = hold_on(grip, share);
                let open = weight * (1.0 - alpha[at]).max(0.0) * volume;
                let mass = open * rho[at];
                let (s, b) = (squares * flow.fluids.kinematic_viscosity(c[at]), response[at]);
                // a/(1 + a) = 1 - b; a (1 + s)/(1 + a + s) without the infinite a of rigid cells.
                let whole = (1.0 - b) * (1.0 + s) / (1.0 + b * s);
                let square = place.length_squared();
                for (sum, value) in bound.iter_mut().zip([whole, 1.0 - b, whole * square, (1.0 - b) * square]) {
                    *sum += mass * value;
                }
                bound[4] += open * (1.0 - b);
            }
            bound
        });
        engine.gather_to_owners(domain, &mut joint.bound);
        joint.start.clone_from(&joint.velocity);
        let mut held = std::mem::take(&mut joint.held);
        self.sum_held(domain, flow, None, &mut held);
        self.joint.held = held;
    }

    /// Sums what friction gave each grain, that of `more` included, and the momentum of the fluid on the covered part of its cells.
    fn sum_held(&mut self, domain: &Domain, flow: &Flow, more: Option<[&[Real]; 3]>, sums: &mut Vec<[Real; 7]>) {
        let Self { imprint, surface, engine, by_block, .. } = self;
        sums.resize(engine.grains().len(), [0.0; 7]);
        let (volume, alpha) = (domain.grid().cell_volume(), imprint.solid_fraction.data());
        let (rho, u, taken) =
            (flow.density.data(), flow.velocity.each_ref().map(Field::data), surface.taken.each_ref().map(Field::data));
        let grip = surface.grip(imprint);
        let of = |fields: [&[Real]; 3], at: usize| Vector::new(fields[0][at], fields[1][at], fields[2][at]);
        imprint.set_by_block(sums, by_block, |n| {
            let (mut linear, mut angular, mut covered) = (Vector::ZERO, Vector::ZERO, 0.0);
            for share in imprint.shares(n) {
                let at = share.at as usize;
                let (weight, place) = hold_on(grip, share);
                let rubbed = weight * volume * (of(taken, at) + more.map_or(Vector::ZERO, |more| of(more, at)));
                let mass = part(share.fraction, alpha[at]) * volume * rho[at];
                let held = mass * of(u, at);
                linear += rubbed + held;
                angular += place.cross(rubbed) + share.arm().cross(held);
                covered += mass;
            }
            let [p, l] = [linear.to_array(), angular.to_array()];
            [p[0], p[1], p[2], l[0], l[1], l[2], covered]
        });
        engine.gather_to_owners(domain, sums);
    }

    /// The viscous step over a pass of `dt` \[s].
    pub(crate) fn diffuse(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        flow: &mut Flow,
        gravity: Vector,
        dt: Real,
    ) -> Result<DiffusionReport, ViscosityError> {
        if !self.joint.on {
            return flow.diffuse_beside(domain, boundary, dt, self.surface_mut());
        }
        let owned = self.engine.grains().owned();
        let (grains, joint) = (self.engine.grains(), &self.joint);
        let spread = self.largest(domain, |n| {
            let ([a, b, turning_a, turning_b, _], inertia) = (joint.bound[n], grains.inertia[n].min_element());
            ((a - b) / grains.mass[n]).max((turning_a - turning_b) / inertia)
        });
        let rounds = if flow.diffuses_implicitly(domain, dt) && spread > SPREAD { ROUNDS } else { 1 };
        if rounds > 1 {
            let kept = self.joint.kept.get_or_insert_with(|| std::array::from_fn(|_| domain.field(0.0)));
            for (kept, u) in kept.iter_mut().zip(&flow.velocity) {
                kept.data_mut().copy_from_slice(u.data());
            }
        }
        let mut slopes = std::mem::take(&mut self.joint.slope);
        slopes.clear();
        slopes.extend((0..owned).map(|n| match self.surface_state(n).slope {
            0.0 => [1.0; 2],
            slope => [slope; 2],
        }));
        self.joint.slope = slopes;
        let force_before = flow.force_before;
        let (mut iterations, mut first) = (0, 0.0);
        let mut report = DiffusionReport::default();
        for round in 0..rounds {
            if self.joint.moved {
                self.surface.follow(domain, &self.imprint, &self.joint.velocity);
            }
            if round > 0 {
                for (kept, u) in self.joint.kept.iter().flatten().zip(&mut flow.velocity) {
                    u.data_mut().copy_from_slice(kept.data());
                }
                flow.force_before = force_before;
            }
            report = flow.diffuse_against(domain, boundary, dt, Some(&self.surface))?;
            iterations += report.iterations;
            let left = self.find_left(domain, flow, gravity, dt, round > 0);
            if round == 0 {
                first = left;
            } else if left <= CLOSE * first {
                break;
            }
            if round + 1 < rounds {
                self.move_towards(domain);
            }
        }
        if rounds > 1 {
            for n in 0..owned {
                let mut state = self.surface_state(n);
                state.slope = self.joint.slope[n][0];
                self.set_surface_state(n, state);
            }
        }
        report.iterations = iterations;
        let [b1, b2, b3, ..] = &flow.work;
        self.surface.add_taken(domain, [b1, b2, b3]);
        Ok(report)
    }

    /// Sets the impulses left, and after a change of the velocities the slopes. Returns the largest change of a velocity that the bound
    /// fluid would leave of these [m/s].
    fn find_left(&mut self, domain: &Domain, flow: &Flow, gravity: Vector, dt: Real, changed: bool) -> Real {
        let mut now = std::mem::take(&mut self.joint.now);
        let [b1, b2, b3, ..] = &flow.work;
        self.sum_held(domain, flow, Some([b1, b2, b3].map(Field::data)), &mut now);
        self.joint.now = now;
        let (mut left, mut slopes) = (std::mem::take(&mut self.joint.left), std::mem::take(&mut self.joint.slope));
        let owned = self.engine.grains().owned();
        left.resize(owned, [0.0; 6]);
        let (grains, joint) = (self.engine.grains(), &self.joint);
        for_each_chunk((&mut left[..], &mut slopes[..]), 64, |number, (left, slopes)| {
            for (offset, (left, slopes)) in left.iter_mut().zip(slopes).enumerate() {
                let n = number * 64 + offset;
                let before = two(&std::mem::replace(left, [0.0; 6]));
                if grains.motion[n] != Motion::Free {
                    continue;
                }
                let state = self.surface_state(n);
                let [rest, turn] = [state.motion, state.rotation].map(Vector::from_array);
                let ([held, holding], [now, turning]) = (super::vectors(&joint.held[n]), super::vectors(&joint.now[n]));
                let ([v, spin], [w, spinning]) = (two(&joint.start[n]), two(&joint.velocity[n]));
                let mass = grains.mass[n];
                let linear = now - held - joint.now[n][6] * gravity * dt + mass * (v - w + dt * (gravity + rest));
                let angular = turning - holding + self.inertia(n, 0.0) * (spin - spinning + dt * turn);
                *left = six([linear, angular]);
                if changed {
                    let [moved, turned] = two(&joint.change[n]);
                    let estimates = [
                        (mass + joint.bound[n][0]) * moved.length_squared(),
                        turned.dot(self.inertia(n, joint.bound[n][2]) * turned),
                    ];
                    let found = [(before[0] - linear).dot(moved), (before[1] - angular).dot(turned)];
                    for (slope, (found, estimate)) in slopes.iter_mut().zip(found.into_iter().zip(estimates)) {
                        if estimate > 0.0 {
                            *slope = (found / estimate).clamp(SLOPES[0], SLOPES[1]);
                        }
                    }
                }
            }
        });
        let largest = self.largest(domain, |n| {
            let ([linear, angular], inertia) = (two(&left[n]), grains.inertia[n].min_element());
            let turning = angular.length() / (inertia + joint.bound[n][3]) * (inertia / grains.mass[n]).sqrt();
            turning.max(linear.length() / (grains.mass[n] + joint.bound[n][1]))
        });
        (self.joint.left, self.joint.slope) = (left, slopes);
        largest
    }

    /// Largest `value(n)` of the free grains on all ranks, at least zero.
    fn largest(&self, domain: &Domain, value: impl Fn(usize) -> Real + Sync) -> Real {
        let grains = self.engine.grains();
        let of = |n: usize| if grains.motion[n] == Motion::Free { value(n) } else { 0.0 };
        domain.max(max_over(grains.owned(), of).max(0.0))
    }

    /// The moment of inertia of a grain, and `more` about every axis [kg m^2].
    fn inertia(&self, n: usize, more: Real) -> Matrix {
        let grains = self.engine.grains();
        let turn = Matrix::from_quat(grains.orientation[n]);
        turn * Matrix::from_diagonal(grains.inertia[n] + more) * turn.transpose()
    }

    /// Changes the velocities by the impulses left over the resistances.
    fn move_towards(&mut self, domain: &Domain) {
        self.change_by(domain, |phase, n| {
            let (grains, joint) = (phase.engine.grains(), &phase.joint);
            let [linear, angular] = two(&joint.left[n]);
            let [slope, turning] = joint.slope[n];
            let inertia = turning * phase.inertia(n, joint.bound[n][2]);
            [linear / (slope * (grains.mass[n] + joint.bound[n][0])), inertia.inverse() * angular]
        });
    }

    /// Changes the velocities of free grains by `change(n)`, and keeps the changes with the ghosts.
    fn change_by(&mut self, domain: &Domain, change: impl Fn(&Self, usize) -> [Vector; 2] + Sync) {
        let mut changes = std::mem::take(&mut self.joint.change);
        let grains = self.engine.grains();
        changes.resize(grains.len(), [0.0; 6]);
        for_each_chunk(&mut changes[..grains.owned()], 64, |number, changes| {
            for (offset, value) in changes.iter_mut().enumerate() {
                let n = number * 64 + offset;
                *value = if grains.motion[n] == Motion::Free { six(change(self, n)) } else { [0.0; 6] };
            }
        });
        self.engine.share_with_ghosts(domain, &mut changes);
        for (velocity, change) in self.joint.velocity.iter_mut().zip(&changes) {
            velocity.iter_mut().zip(change).for_each(|(v, c)| *v += c);
        }
        self.joint.change = changes;
        self.joint.moved = true;
    }

    /// Shares out the impulse that the viscous step left between grain and bound fluid, and sets the closed parts of the faces.
    pub(crate) fn settle(&mut self, domain: &Domain, flow: &mut Flow, response: Option<&[Real]>) {
        let Some(response) = response.filter(|_| self.joint.on) else { return };
        self.yield_to_left(domain);
        self.bind(domain);
        let Surface { velocity, taken: [t1, t2, t3], covered, .. } = &mut self.surface;
        let (rho, velocity) = (flow.density.data(), velocity.each_ref().map(Field::data));
        for (d, (u, taken)) in flow.velocity.iter_mut().zip([t1, t2, t3]).enumerate() {
            domain.for_each_row(&domain.interior(), (u.data_mut(), taken.data_mut()), |row, (u, taken)| {
                if !covered.holds(row.j, row.k) {
                    return;
                }
                for (i, at) in row.shifted(0).enumerate().filter(|(_, at)| response[*at] < 1.0) {
                    let change = (1.0 - response[at]) * velocity[d][at];
                    u[i] += change;
                    taken[i] -= rho[at] * change;
                }
            });
        }
        self.imprint.fill_halos(domain);
    }

    /// Sums velocity and density of the grains with the fluid bound to them, and gives the cells with friction the change of their
    /// velocity.
    fn bind(&mut self, domain: &Domain) {
        let Self { joint, imprint, engine, shapes, surface, .. } = self;
        let grains = engine.grains();
        joint.density.resize(grains.len(), [0.0; 1]);
        let bound = &joint.bound;
        for_each_chunk(&mut joint.density[..grains.owned()], 64, |number, density| {
            for (offset, density) in density.iter_mut().enumerate() {
                let n = number * 64 + offset;
                let volume = shapes[grains.shape[n] as usize].volume() * grains.scale[n].powi(3);
                *density = [if grains.motion[n] == Motion::Free {
                    (grains.mass[n] + bound[n][1]) / (volume + bound[n][4])
                } else {
                    imprint.acting_density(grains, n, volume)
                }];
            }
        });
        engine.share_with_ghosts(domain, &mut joint.density);
        let Surface { friction, velocity, .. } = surface;
        let (friction, Joint { velocity: motion, density, change, .. }) = (friction.data(), &*joint);
        let follow =
            |n: usize, share: &Share, [area, alpha]: [&[Real]; 2]| by_hold([friction, area, alpha], share, &change[n]);
        imprint.sum_bound(domain, (grains, motion), |n| density[n][0], velocity.each_mut(), follow);
    }

    fn yield_to_left(&mut self, domain: &Domain) {
        self.change_by(domain, |phase, n| {
            let (grains, joint) = (phase.engine.grains(), &phase.joint);
            let [linear, angular] = two(&joint.left[n]);
            let inertia = phase.inertia(n, joint.bound[n][3]);
            [linear / (grains.mass[n] + joint.bound[n][1]), inertia.inverse() * angular]
        });
    }

    /// Leaves of the change of the acceleration by the projection, times the length of the pass in the middle three scratch fields of `flow`
    /// [m/s], what the friction of the surfaces leaves, and books what it takes; surfaces of free grains give way.
    pub(crate) fn give_way(&mut self, domain: &Domain, flow: &mut Flow, response: &[Real]) {
        let Flow { velocity, density, work: [_, _, _, c1, c2, c3, ..], .. } = flow;
        let (rho, change) = (density.data(), [&*c1, c2, c3].map(Field::data));
        let joint = self.joint.on;
        if joint {
            self.move_by_projection(domain, rho, response, change);
        }
        let Surface { velocity: yielding, taken, covered, .. } = &mut self.surface;
        for (d, (u, taken)) in velocity.iter_mut().zip(taken).enumerate() {
            let (change, yielding) = (change[d], yielding[d].data());
            domain.for_each_row(&domain.interior(), (u.data_mut(), taken.data_mut()), |row, (u, taken)| {
                if !covered.holds(row.j, row.k) {
                    return;
                }
                for (i, at) in row.shifted(0).enumerate().filter(|(_, at)| response[*at] < 1.0) {
                    let towards = if joint { yielding[at] } else { 0.0 };
                    let lost = (1.0 - response[at]) * (change[at] - towards);
                    u[i] -= lost;
                    taken[i] += rho[at] * lost;
                }
            });
        }
    }

    /// Sets the change of the velocity of the surfaces by the projection, `change` being that of the acceleration in the cells
    /// times the step [m/s].
    fn move_by_projection(&mut self, domain: &Domain, rho: &[Real], response: &[Real], change: [&[Real]; 3]) {
        let Self { joint, imprint, surface, engine, by_block, .. } = self;
        let (volume, alpha) = (domain.grid().cell_volume(), imprint.solid_fraction.data());
        let grip = surface.grip(imprint);
        joint.left.resize(engine.grains().len(), [0.0; 6]);
        imprint.set_by_block(&mut joint.left, by_block, |n| {
            let (mut linear, mut angular) = (Vector::ZERO, Vector::ZERO);
            for share in imprint.shares(n) {
                let at = share.at as usize;
                let (weight, place) = hold_on(grip, share);
                let impulse = rho[at] * volume * Vector::new(change[0][at], change[1][at], change[2][at]);
                let b = response[at];
                let (held, rubbed) = (part(share.fraction, alpha[at]) * b * impulse, weight * (1.0 - b) * impulse);
                linear += held + rubbed;
                angular += share.arm().cross(held) + place.cross(rubbed);
            }
            six([linear, angular])
        });
        engine.gather_to_owners(domain, &mut joint.left);
        joint.left.truncate(engine.grains().owned());
        self.yield_to_left(domain);
        self.surface.follow(domain, &self.imprint, &self.joint.change);
    }

    /// Ends a pass of `dt` \[s]: books what the grains gained in it.
    pub(crate) fn end_pass(&mut self, domain: &Domain, flow: &Flow, gravity: Vector, dt: Real) {
        if !self.joint.on {
            return;
        }
        let mut now = std::mem::take(&mut self.joint.now);
        self.sum_held(domain, flow, None, &mut now);
        let joint = &mut self.joint;
        for (gained, (now, held)) in joint.gained.iter_mut().zip(now.iter().zip(&joint.held)) {
            for d in 0..3 {
                gained[d] += now[d] - held[d] - now[6] * gravity[d] * dt;
                gained[3 + d] += now[3 + d] - held[3 + d];
            }
        }
        joint.now = now;
    }

    /// Velocity and spin of an owned grain after a step of `dt` \[s] that gravity, viscosity, friction and projection alone give it
    /// [m/s, rad/s]; those that it has where they are no unknowns.
    pub(super) fn without_rest(&self, n: usize, gravity: Vector, dt: Real) -> [[Real; 3]; 2] {
        let grains = self.engine.grains();
        let (v, spin) = (grains.velocity[n], grains.angular_velocity(n));
        if !self.joint.on {
            return [v, spin].map(|rate| rate.to_array());
        }
        let [linear, angular] = two(&self.joint.gained[n]);
        let turned = self.inertia(n, 0.0).inverse() * angular;
        [v + dt * gravity + linear / grains.mass[n], spin + turned].map(|rate| rate.to_array())
    }
}
