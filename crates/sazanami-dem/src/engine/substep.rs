//! A sub-step of the engine: contact forces, kick, drift.

use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::{Drag, EXPIRED, Engine, FINE, Loads};
use crate::body::Body;
use crate::contact::block::Block;
use crate::contact::context::{ContactContext, SubStep};
use crate::contact::counters::Counters;
use crate::contact::incoming::Incoming;
use crate::contact::pace::{PACES, Pace};
use crate::ghosts::PoseState;
use crate::grain::{Grains, Motion, ROWS, image_position};
use crate::motion::{KickAndDrift, MassProperties, Moving, Pose};
use crate::wrench::Wrench;

/// Impulse of the implicit drag on own grain `own` of velocity `v` over `h`, beside gravity and the other impulses, with its
/// `share` of the mass that it moves. The fluid has given `given` to the grain in the sub-steps before, and yields to that
/// and to the drag itself.
fn drag_impulse(
    drag: &dyn Drag,
    own: usize,
    (mass_properties, share): (&MassProperties, Real),
    v: Vector,
    (h, gravity): (Real, Vector),
    others: &Wrench,
    given: Vector,
) -> Vector {
    let fluid = drag.inverse_fluid_mass(own);
    let u = drag.fluid_velocity(own) - given * fluid;
    let kappa = drag.coefficient(own, (u - v).length());
    let inverse_mass = mass_properties.inverse_mass * share;
    // Only a free grain yields to forces, and to the drag itself.
    let without =
        if mass_properties.motion == Motion::Free { v + others.force * inverse_mass + h * gravity * share } else { v };
    (u - without) * (h * kappa / (1.0 + h * kappa * (inverse_mass + fluid)))
}

/// A change of velocities by contacts, loads, drag and gravity.
pub(super) struct Kick<'a> {
    pub loads: &'a Loads<'a>,
    /// Gravity [m/s^2].
    pub gravity: Vector,
    /// Length of the sub-step \[s].
    pub h: Real,
    /// Whether grains keep the contact forces.
    pub keep: bool,
}

/// Contact forces of the present sub-step.
struct Contacts<'a> {
    blocks: &'a [Block],
    incoming: &'a Incoming,
    /// Whether films or bridges act between grains that do not touch.
    apart: bool,
    /// Present time on the grains' clock \[s].
    time: Real,
}

/// Per-grain results of a kick.
struct KickOutputs<'a> {
    last_contact: &'a mut [Real],
    contact_force: &'a mut [Vector],
    contact_torque: &'a mut [Vector],
    drag_impulse: &'a mut [Vector],
    /// See [`super::energy::EnergyBook::aside`].
    aside: &'a mut [Real],
    /// See [`super::energy::EnergyBook::held`].
    held: &'a mut [Vector],
}

impl Kick<'_> {
    /// Impulses on the grains of block `number`, besides gravity.
    #[inline]
    fn impulses(
        &self,
        contacts: &Contacts<'_>,
        number: usize,
        mass_properties: &[MassProperties],
        (velocity, poses): (&[Vector], &[Pose]),
        outputs: KickOutputs<'_>,
    ) -> [Wrench; ROWS] {
        let Self { loads, gravity, h, keep } = *self;
        let Contacts { blocks, incoming, apart, time } = *contacts;
        let mut impulses = [Wrench::default(); ROWS];
        let Some(block) = blocks.get(number) else { return impulses };
        let rows = number * ROWS..number * ROWS + velocity.len();
        let mut on_walls = &block.walls.actions[..];
        // In a loop of its own, so that many of these scattered reads are in flight at once.
        let mut arriving = [(Wrench::default(), false); ROWS];
        for (sum, g) in arriving.iter_mut().zip(rows.clone()) {
            *sum = incoming.total(blocks, g, apart);
        }
        for (row, g) in rows.enumerate() {
            let (mut total, touched) = arriving[row];
            total += block.own[row];
            if let [(grain, wrench), rest @ ..] = on_walls
                && *grain as usize == g
            {
                total += *wrench;
                on_walls = rest;
            }
            if touched || block.touches[row] {
                outputs.last_contact[row] = time;
            }
            if keep {
                (outputs.contact_force[row], outputs.contact_torque[row]) = (total.force, total.torque);
            }
            if mass_properties[row].motion != Motion::Free {
                let power = total.force.dot(velocity[row]) + total.torque.dot(poses[row].spin);
                outputs.aside[row] += h * power;
                outputs.held[row] += h * total.force;
            }
            if let Some(force) = loads.force.get(g) {
                total.force += *force;
            }
            if let Some(torque) = loads.torque.get(g) {
                total.torque += *torque;
            }
            impulses[row] = Wrench { force: h * total.force, torque: h * total.torque };
            let added = loads.added_mass.get(g).copied();
            let share = added.map_or(1.0, |added| (1.0 + added * mass_properties[row].inverse_mass).recip());
            let mut dragged = Vector::ZERO;
            if let Some(drag) = loads.drag {
                let impulse = drag_impulse(
                    drag,
                    g,
                    (&mass_properties[row], share),
                    velocity[row],
                    (h, gravity),
                    &impulses[row],
                    outputs.drag_impulse[row],
                );
                impulses[row].force += impulse;
                outputs.drag_impulse[row] += impulse;
                dragged = impulse;
            }
            if let Some(added) = added {
                // What moves the own mass alone as this impulse and gravity move both.
                impulses[row].force = share * (impulses[row].force - added * h * gravity);
            }
            if loads.drag.is_some() && mass_properties[row].motion == Motion::Free {
                let change = impulses[row].force * mass_properties[row].inverse_mass + h * gravity;
                outputs.aside[row] += dragged.dot(velocity[row] + 0.5 * change);
            }
        }
        impulses
    }
}

impl Engine {
    pub(super) fn context(&self) -> ContactContext<'_> {
        ContactContext {
            bodies: &self.bodies,
            arrays: &self.arrays,
            spheres: &self.spheres,
            reach: self.interactions.reach(),
            bridge: self.interactions.bridge(),
            wetness: &self.grains.wetness,
            moisture: &self.grains.moisture,
            balls: self.bodies.iter().all(Body::is_ball),
            poses: &self.poses,
            rotations: &self.rotations,
            travel: &self.travel,
            largest_travel: self.largest_travel,
            walls: &self.walls,
            wall_travel: &self.wall_travel,
            period: self.period,
            owned: self.grains.owned,
        }
    }

    /// Forces of all contacts over a sub-step of length `h` \[s].
    pub(super) fn contacts(&mut self, h: Real) -> Counters {
        let mut blocks = std::mem::take(&mut self.blocks);
        // Apart from the blocks, which lie far from each other: one thread reads them all.
        let mut block_counters = std::mem::take(&mut self.block_counters);
        let (context, plain) = (self.context(), self.interactions.plain());
        let step = SubStep { context: &context, laws: &self.laws, plain, ids: &self.grains.id, dt: h };
        for_each_chunk((&mut blocks[..], &mut block_counters[..]), 1, |_, (block, counters)| {
            counters[0] = block[0].step(&step);
        });
        self.incoming.follow(&blocks, &block_counters);
        let sum = block_counters.iter().fold(Counters::default(), |sum, counters| sum.merged(*counters));
        (self.blocks, self.block_counters) = (blocks, block_counters);
        sum
    }

    /// Moves grains and walls for `time` \[s] with the velocities that they have.
    pub(super) fn drift(&mut self, time: Real) -> u8 {
        self.move_grains(None, time).max(self.move_walls(time))
    }

    /// Changes velocities by `kick`, then moves grains and walls for `time` \[s].
    pub(super) fn kick_and_drift(&mut self, kick: &Kick<'_>, time: Real) -> u8 {
        self.move_grains(Some(kick), time).max(self.move_walls(time))
    }

    fn move_grains(&mut self, kick: Option<&Kick<'_>>, time: Real) -> u8 {
        let owned = self.grains.owned;
        let state = AtomicU8::new(FINE);
        // Numbers that are not negative are ordered as their bits are.
        let farthest = [const { AtomicU64::new(0) }; PACES];
        let Self { grains, poses, rotations, turned, travel, paces, mass_properties, blocks, incoming, book, .. } =
            self;
        let (skin, paces) = (&grains.skin[..owned], &paces[..owned]);
        let apart = self.interactions.film().is_some() || self.interactions.bridge().is_some();
        let contacts = Contacts { blocks, incoming, apart, time: self.time };
        let gravity = kick.map_or(Vector::ZERO, |kick| kick.h * kick.gravity);
        let motion = (
            &mut grains.unwrapped[..owned],
            &mut grains.orientation[..owned],
            &mut grains.velocity[..owned],
            &mut grains.angular_momentum[..owned],
        );
        let outputs = (
            &mut grains.last_contact[..owned],
            &mut grains.contact_force[..owned],
            &mut grains.contact_torque[..owned],
            &mut grains.drag_impulse[..owned],
            (&mut book.aside[..owned], &mut book.held[..owned]),
        );
        let bounds = (&mut turned[..owned], &mut travel[..owned]);
        for_each_chunk(
            (motion, outputs, &mut poses[..owned], &mut rotations[..owned], bounds),
            ROWS,
            |number, (motion, outputs, poses, rotations, (turned, travel))| {
                let (unwrapped, orientation, velocity, angular_momentum) = motion;
                let (last_contact, contact_force, contact_torque, drag_impulse, (aside, held)) = outputs;
                let rows = number * ROWS..number * ROWS + poses.len();
                let mass_properties = &mass_properties[rows.clone()];
                let impulses = match kick {
                    Some(kick) => {
                        let outputs =
                            KickOutputs { last_contact, contact_force, contact_torque, drag_impulse, aside, held };
                        kick.impulses(&contacts, number, mass_properties, (velocity, poses), outputs)
                    }
                    None => [Wrench::default(); ROWS],
                };
                let mut before = [0.0; ROWS];
                before[..travel.len()].copy_from_slice(travel);
                let mut moving = Moving {
                    mass_properties,
                    unwrapped,
                    orientation,
                    velocity,
                    angular_momentum,
                    poses,
                    rotations,
                    turned,
                    travel,
                };
                moving.kick_and_drift(&KickAndDrift { gravity, impulses: &impulses, time });
                let mut grown = [0.0; PACES];
                for ((after, before), pace) in moving.travel.iter().zip(&before).zip(&paces[rows.clone()]) {
                    grown[pace.index()] = Real::max(grown[pace.index()], after - before);
                }
                // Most chunks do not raise the maxima and skip the atomic writes.
                for (grown, farthest) in grown.iter().zip(&farthest) {
                    if grown.to_bits() > farthest.load(Ordering::Relaxed) {
                        farthest.fetch_max(grown.to_bits(), Ordering::Relaxed);
                    }
                }
                // NaN counts as expired: the check that follows finds it.
                if !moving.travel.iter().zip(&skin[rows]).all(|(travel, skin)| travel <= skin) {
                    state.fetch_max(EXPIRED, Ordering::Relaxed);
                }
            },
        );
        let mut slower: Real = 0.0;
        for (pending, farthest) in self.pending_travel.iter_mut().zip(farthest) {
            slower = slower.max(Real::from_bits(farthest.into_inner()));
            *pending += slower;
        }
        state.into_inner()
    }

    fn move_walls(&mut self, time: Real) -> u8 {
        let skin = &self.grains.skin[..self.grains.owned];
        let mut state = FINE;
        for (wall, travel) in self.walls.iter_mut().zip(&mut self.wall_travel) {
            if wall.velocity != Vector::ZERO {
                *travel += wall.advance(time) * (1.0 + 1e-9);
                if skin.iter().any(|skin| *travel > *skin) {
                    state = EXPIRED;
                }
            }
        }
        state
    }

    /// Brings ghosts up to date; with `all` also images on this rank, which contacts do not read.
    pub(super) fn refresh_poses(&mut self, domain: &Domain, all: bool) {
        let Self { exchange, grains, travel, poses, rotations, mass_properties, .. } = self;
        let others =
            exchange.refresh(domain, grains, &mut PoseState { poses, rotations, travel, mass_properties }, all);
        let fastest = &mut self.pending_travel[Pace::FASTEST.index()];
        *fastest = fastest.max(others);
        for (largest, pending) in self.largest_travel.iter_mut().zip(&mut self.pending_travel) {
            *largest += std::mem::take(pending);
        }
    }

    /// Positions of the periodic images that the entries of this rank represent.
    pub(super) fn place(&mut self) {
        let Grains { position, unwrapped, image, .. } = &mut self.grains;
        let period = self.period;
        for_each_chunk(&mut position[..], ROWS, |number, position| {
            let first = number * ROWS;
            for (n, position) in position.iter_mut().enumerate() {
                *position = image_position(unwrapped[first + n], image[first + n], period);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use sazanami_numerics::grid::Grid;

    use super::*;
    use crate::contact::laws::Interactions;
    use crate::contact::linear_spring_dashpot::LinearSpringDashpot;
    use crate::engine::Setup;
    use crate::grain::Grain;

    /// Balls along an edge of the cube of [`checked`].
    const EDGE: u64 = 6;

    /// Part of the rows of pairs that were checked in a hundred sub-steps of a cube of balls 5 % of a radius apart, one in
    /// `every` of which moves at `speed` [m/s].
    fn checked(speed: Real, every: u64) -> Real {
        let (n, radius) = (EDGE, 1e-3);
        let domain = Domain::solo(Grid::new([4; 3], Vector::ZERO, Vector::splat(0.02)), [false; 3]);
        let place = |id: u64| Vector::new((id % n) as Real, (id / n % n) as Real, (id / (n * n)) as Real);
        let grains: Vec<Grain> = (0..n * n * n)
            .map(|id| {
                let mut grain = Grain::new(id, 2650.0, Vector::splat(3e-3) + 2.05 * radius * place(id));
                grain.velocity = Vector::splat(if id % every == 0 { speed } else { 0.0 });
                grain
            })
            .collect();
        let setup = Setup {
            bodies: vec![Body::ball(radius)],
            interactions: Interactions::uniform(1, LinearSpringDashpot::SAND),
            walls: Vec::new(),
            region: [Vector::splat(Real::NEG_INFINITY), Vector::splat(Real::INFINITY)],
            ghost_margin: 0.0,
        };
        let mut engine = Engine::new(&domain, setup, &grains).expect("the grains make sense");
        let h = engine.contact_time_step();
        engine.turned.resize(grains.len(), Vector::ZERO);
        engine.book.aside.resize(grains.len(), 0.0);
        engine.book.held.resize(grains.len(), Vector::ZERO);
        let mut rows = 0;
        for _ in 0..100 {
            engine.drift(h);
            engine.refresh_poses(&domain, false);
            rows += engine.contacts(h).checked_rows;
        }
        rows as Real / (100 * grains.len()) as Real
    }

    #[test]
    fn rows_of_resting_grains_are_skipped() {
        assert!(checked(0.0, 2) <= 0.011, "the first sub-step checks all, the others none");
        let [slow, fast] = [1e-2, 10.0].map(|speed| checked(speed, 2));
        assert!(slow < 0.05, "{slow}");
        assert!(fast > 10.0 * slow, "negative control: rows of fast grains are checked: {fast}");
        let flier = checked(10.0, EDGE.pow(3));
        assert!(flier < 0.05, "one fast grain wakes its neighbours alone: {flier}");
    }
}
