//! Ghosts and neighbour lists of the engine, and what passes from one list to the next.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Matrix, Real};

use super::{Engine, FARTHEST};
use crate::contact::neighbours::{Matter, Previous};
use crate::contact::walls::WallContact;
use crate::contact::{Census, ContactRecord};
use crate::error::DemError;
use crate::grain::{Grains, Motion};
use crate::motion::{Frame, Inert};

/// How far a resting grain may go before lists are renewed, over its bounding radius.
const RESTING_REACH: Real = 0.08;
/// Number of sub-steps that a fast grain's reach is meant to last.
const HORIZON: Real = 150.0;

/// What is known of the list before while the next one is made; kept for its memory.
#[derive(Debug, Default)]
pub(super) struct Past {
    /// Identifier and place of each grain that contacts looked at, in order; of those of other ranks the image too.
    known: Vec<(u64, Option<[i32; 2]>, u32)>,
    /// Place of each present grain then; of no use for images on this rank.
    number: Vec<u32>,
    budget: Vec<Real>,
    wall_budget: Vec<Real>,
    /// Bounding radius plus reach of each own grain now [m].
    size: Vec<Real>,
    /// See [`crate::ghosts::Exchange::originals`].
    originals: Vec<u32>,
}

impl Engine {
    /// Writes all contacts of this rank, by key, into `records`.
    pub(crate) fn collect_records(&mut self) {
        if !self.listed {
            return;
        }
        let Self { records, blocks, grains, .. } = self;
        records.clear();
        for block in blocks.iter() {
            let of_wall = |c: &WallContact| {
                let pair = &block.walls.pairs[c.pair as usize];
                ContactRecord {
                    low: grains.id[pair.grain as usize],
                    high: crate::WALL + u64::from(pair.wall),
                    image: [0; 2],
                    a: c.a,
                    b: 0,
                    deep: u32::from(c.deep),
                    d_t: c.d_t.to_array(),
                }
            };
            // In the order of rows, which is that of identifiers but for other ranks' grains: there is little to sort.
            let mut walls = block.walls.contacts.iter().peekable();
            for c in &block.contacts {
                let pair = &block.pairs[c.pair as usize];
                while let Some(c) = walls.next_if(|c| block.walls.pairs[c.pair as usize].grain < pair.low) {
                    records.push(of_wall(c));
                }
                records.push(ContactRecord {
                    low: grains.id[pair.low as usize],
                    high: grains.id[pair.high as usize],
                    image: pair.image.map(i32::from),
                    a: c.a,
                    b: c.b,
                    deep: u32::from(c.deep),
                    d_t: c.d_t.to_array(),
                });
            }
            records.extend(walls.map(of_wall));
        }
        records.sort_unstable_by_key(ContactRecord::key);
        debug_assert!(records.is_sorted_by(|a, b| a.key() < b.key()), "every pair stands in the list once");
    }

    /// New ghosts and lists; with `migrate`, new owners first.
    pub(super) fn renew(&mut self, domain: &Domain, migrate: bool) -> Result<(), DemError> {
        self.collect_records();
        let mut past = std::mem::take(&mut self.past);
        past.known.clear();
        if self.listed {
            let Grains { id, image, owned, .. } = &self.grains;
            let others = (*owned..id.len()).filter(|&g| past.originals[g] as usize == g);
            past.known.extend((0..*owned).map(|g| (id[g], None, g as u32)));
            past.known.extend(others.map(|g| (id[g], Some(image[g]), g as u32)));
            // Cheap: own grains are in order already.
            past.known.sort_unstable();
        }
        std::mem::swap(&mut past.budget, &mut self.budget);
        past.wall_budget.clone_from(&self.wall_budget);
        if migrate {
            self.exchange.migrate(domain, &mut self.grains, &mut self.records);
        }
        self.place();
        self.choose_reach();
        past.size.clear();
        past.size.extend((0..self.grains.owned).map(|g| self.bounding_radius(g) + self.reach[g]));
        self.exchange.renew(domain, &mut self.grains, &past.size, &mut self.reach, self.ghost_margin);
        self.set_frames();
        self.budget.clear();
        self.budget.resize(self.grains.len(), 0.0);
        self.grown = 0.0;
        self.wall_budget.fill(0.0);
        self.list(&mut past);
        self.past = past;
        Ok(())
    }

    fn list(&mut self, past: &mut Past) {
        let grains = &self.grains;
        let Past { known, number, budget, wall_budget, originals, .. } = past;
        self.exchange.originals(grains.len(), originals);
        number.clear();
        number.extend((0..grains.len()).map(|g| {
            let key = (grains.id[g], (g >= grains.owned).then_some(grains.image[g]));
            known.binary_search_by_key(&key, |k| (k.0, k.1)).map_or(u32::MAX, |at| known[at].2)
        }));
        std::mem::swap(&mut self.blocks, &mut self.former);
        let mut blocks = std::mem::take(&mut self.blocks);
        let mut builder = std::mem::take(&mut self.builder);
        let matter = Matter {
            grains: &self.grains,
            interactions: &self.interactions,
            reach: &self.reach,
            records: &self.records,
            originals,
        };
        let previous = Previous { blocks: &self.former, budget, wall_budget, number };
        builder.build(&self.world(), matter, self.listed.then_some(&previous), &mut blocks);
        self.incoming.rebuild(&mut blocks, &self.grains.id, self.grains.owned);
        self.censuses.resize(blocks.len(), Census::default());
        self.blocks = blocks;
        self.builder = builder;
        self.listed = true;
    }

    fn bounding_radius(&self, g: usize) -> Real {
        self.bodies[self.grains.shape[g] as usize].bounding_radius * self.grains.scale[g]
    }

    fn choose_reach(&mut self) {
        let grains = &self.grains;
        self.reach.clear();
        for g in 0..grains.owned {
            let size = self.bounding_radius(g);
            let arm = self.bodies[grains.shape[g] as usize].centre_radius * grains.scale[g];
            let speed = grains.velocity[g].length() + arm * grains.angular_velocity(g).length();
            let way = if self.time_step.is_finite() { HORIZON * self.time_step * speed } else { FARTHEST * size };
            self.reach.push((RESTING_REACH * size + way).min(FARTHEST * size));
        }
    }

    fn set_frames(&mut self) {
        let Self { grains, frames, rotations, inert, bodies, first_spheres, .. } = self;
        frames.resize(grains.len(), Frame::default());
        rotations.resize(grains.len(), Matrix::IDENTITY);
        inert.clear();
        for g in 0..grains.len() {
            let free = grains.motion[g] == Motion::Free;
            let body = &bodies[grains.shape[g] as usize];
            let moment = grains.inertia[g].recip();
            inert.push(Inert {
                inverse_mass: if free { 1.0 / grains.mass[g] } else { 0.0 },
                inverse_inertia: moment,
                arm: body.centre_radius * grains.scale[g],
                motion: grains.motion[g],
                ball: body.is_ball(),
            });
            frames[g].scale = grains.scale[g];
            frames[g].body = grains.shape[g];
            frames[g].radius = if body.is_ball() { body.radii[0] * grains.scale[g] } else { 0.0 };
            frames[g].spheres = first_spheres[grains.shape[g] as usize];
            rotations[g] = frames[g].follow(grains, g, &inert[g]);
        }
    }
}
