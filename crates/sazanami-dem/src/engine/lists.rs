//! Renewal of ghosts and neighbour lists, and what passes from one list to the next.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Matrix, Real};
use sazanami_parallel::for_each_chunk;

use super::{Engine, LARGEST_SKIN};
use crate::contact::counters::Counters;
use crate::contact::neighbours::{ListInput, Previous};
use crate::contact::pace::{PACES, Pace};
use crate::contact::record::ContactRecord;
use crate::contact::walls::WallContact;
use crate::error::DemError;
use crate::grain::{Grains, Motion, ROWS};
use crate::motion::{MassProperties, Pose};
use crate::wall::Wall;

/// Skin of a resting grain, the distance it may travel before lists are renewed, over its bounding radius.
const RESTING_SKIN: Real = 0.08;
/// Number of sub-steps for which the skin of a fast grain suffices at its present speed.
const HORIZON: Real = 150.0;

/// Data of the former list from which the next one takes over bounds; allocated once.
#[derive(Debug, Default)]
pub(super) struct FormerList {
    /// Sorted identifier, image (of other ranks' grains only) and index of each grain that took part in contacts.
    known: Vec<(u64, Option<[i32; 3]>, u32)>,
    /// Former index of each present grain; unused for images on this rank.
    number: Vec<u32>,
    travel: Vec<Real>,
    wall_travel: Vec<Real>,
    /// Bounding radius plus skin of each own grain now \[m].
    size: Vec<Real>,
    /// See [`crate::ghosts::GrainExchange::originals`].
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
                    image: [0; 3],
                    a: c.a,
                    b: 0,
                    marks: ContactRecord::marks(c.deep, false, false),
                    d_t: c.d_t.to_array(),
                    turn: c.turn.to_array(),
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
                    marks: ContactRecord::marks(c.deep, pair.apart, pair.bridged),
                    d_t: c.d_t.to_array(),
                    turn: c.turn.to_array(),
                });
            }
            records.extend(walls.map(of_wall));
            let apart = block.bridges.iter().filter(|held| !block.pairs[held.pair as usize].touching);
            records.extend(apart.map(|held| {
                let pair = &block.pairs[held.pair as usize];
                ContactRecord {
                    low: grains.id[pair.low as usize],
                    high: grains.id[pair.high as usize],
                    image: pair.image.map(i32::from),
                    a: held.spheres.0,
                    b: held.spheres.1,
                    marks: ContactRecord::BRIDGED | ContactRecord::NO_CONTACT,
                    d_t: [0.0; 3],
                    turn: [0.0; 3],
                }
            }));
        }
        records.sort_unstable_by_key(ContactRecord::key);
        debug_assert!(records.is_sorted_by(|a, b| a.key() < b.key()), "every pair stands in the list once");
    }

    /// Numbers the walls in the memory of contacts as `walls` does, before the engine has these; contacts with others are forgotten.
    pub(crate) fn renumber_walls(&mut self, walls: &[Wall]) {
        self.collect_records();
        self.listed = false;
        let is = |wall: &Wall, other: &Wall| {
            other.edges == wall.edges
                && other.normal == wall.normal
                && (other.point - wall.point).dot(wall.normal) == 0.0
        };
        let numbers: Vec<_> = self.walls.iter().map(|wall| walls.iter().position(|other| is(wall, other))).collect();
        self.records.retain_mut(|record| {
            let Some(wall) = record.high.checked_sub(crate::WALL) else { return true };
            let Some(number) = numbers[wall as usize] else { return false };
            record.high = crate::WALL + number as u64;
            true
        });
        self.records.sort_unstable_by_key(ContactRecord::key);
    }

    /// New ghosts and lists; with `migrate`, new owners first.
    pub(super) fn renew(&mut self, domain: &Domain, migrate: bool) -> Result<(), DemError> {
        self.collect_records();
        let mut former_list = std::mem::take(&mut self.former_list);
        former_list.known.clear();
        if self.listed {
            let Grains { id, image, owned, .. } = &self.grains;
            let others = (*owned..id.len()).filter(|&g| former_list.originals[g] as usize == g);
            former_list.known.extend((0..*owned).map(|g| (id[g], None, g as u32)));
            former_list.known.extend(others.map(|g| (id[g], Some(image[g]), g as u32)));
            // Cheap: own grains are in order already.
            former_list.known.sort_unstable();
        }
        std::mem::swap(&mut former_list.travel, &mut self.travel);
        former_list.wall_travel.clone_from(&self.wall_travel);
        if migrate {
            self.exchange.migrate(domain, &mut self.grains, &mut self.records);
        }
        self.place();
        self.choose_skins();
        former_list.size.clear();
        let grains = &self.grains;
        let margin = |g: usize| self.interactions.margin(&self.bodies[grains.shape[g] as usize], grains.scale[g]);
        let size = |g: usize| self.bounding_radius(g) + margin(g) + grains.skin[g];
        former_list.size.extend((0..grains.owned).map(size));
        self.exchange.renew(domain, &mut self.grains, &former_list.size, self.ghost_margin);
        self.paces.resize(self.grains.len(), Pace::FASTEST);
        self.set_poses();
        self.travel.clear();
        self.travel.resize(self.grains.len(), 0.0);
        self.largest_travel = [0.0; PACES];
        self.wall_travel.fill(0.0);
        self.list(&mut former_list);
        self.former_list = former_list;
        Ok(())
    }

    fn list(&mut self, former_list: &mut FormerList) {
        let grains = &self.grains;
        let FormerList { known, number, travel, wall_travel, originals, .. } = former_list;
        self.exchange.originals(grains.len(), originals);
        number.resize(grains.len(), u32::MAX);
        for_each_chunk(&mut number[..], ROWS, |chunk, number| {
            for (n, number) in number.iter_mut().enumerate() {
                let g = chunk * ROWS + n;
                let key = (grains.id[g], (g >= grains.owned).then_some(grains.image[g]));
                *number = known.binary_search_by_key(&key, |k| (k.0, k.1)).map_or(u32::MAX, |at| known[at].2);
            }
        });
        std::mem::swap(&mut self.blocks, &mut self.former);
        let mut blocks = std::mem::take(&mut self.blocks);
        let mut builder = std::mem::take(&mut self.builder);
        let input = ListInput {
            grains: &self.grains,
            interactions: &self.interactions,
            records: &self.records,
            originals,
            paces: &self.paces,
        };
        let previous = Previous { blocks: &self.former, travel, wall_travel, number };
        builder.build(&self.context(), input, self.listed.then_some(&previous), &mut blocks);
        self.incoming.rebuild(&mut blocks, &self.grains.id, self.grains.owned);
        self.block_counters.resize(blocks.len(), Counters::default());
        self.blocks = blocks;
        self.builder = builder;
        self.listed = true;
    }

    pub(super) fn bounding_radius(&self, g: usize) -> Real {
        self.bodies[self.grains.shape[g] as usize].bounding_radius * self.grains.scale[g]
    }

    /// Skins and paces of own grains.
    fn choose_skins(&mut self) {
        let mut skins = std::mem::take(&mut self.grains.skin);
        let mut paces = std::mem::take(&mut self.paces);
        let (grains, time_step) = (&self.grains, self.time_step);
        paces.resize(grains.owned, Pace::FASTEST);
        for_each_chunk((&mut skins[..grains.owned], &mut paces[..]), ROWS, |number, (skins, paces)| {
            for (n, (skin, pace)) in skins.iter_mut().zip(paces).enumerate() {
                let g = number * ROWS + n;
                let size = self.bounding_radius(g);
                let arm = self.bodies[grains.shape[g] as usize].centre_radius * grains.scale[g];
                let speed = grains.velocity[g].length() + arm * grains.angular_velocity(g).length();
                let way = if time_step.is_finite() { HORIZON * time_step * speed } else { LARGEST_SKIN * size };
                *skin = (RESTING_SKIN * size + way).min(LARGEST_SKIN * size);
                *pace = Pace::new(way, size);
            }
        });
        (self.grains.skin, self.paces) = (skins, paces);
    }

    fn set_poses(&mut self) {
        let Self { grains, poses, rotations, mass_properties, bodies, first_spheres, .. } = self;
        poses.resize(grains.len(), Pose::default());
        rotations.resize(grains.len(), Matrix::IDENTITY);
        mass_properties.resize(grains.len(), MassProperties::default());
        let columns = (&mut poses[..], &mut rotations[..], &mut mass_properties[..]);
        for_each_chunk(columns, ROWS, |number, (poses, rotations, mass_properties)| {
            for n in 0..poses.len() {
                let g = number * ROWS + n;
                let free = grains.motion[g] == Motion::Free;
                let body = &bodies[grains.shape[g] as usize];
                let moment = grains.inertia[g].recip();
                mass_properties[n] = MassProperties {
                    inverse_mass: if free { 1.0 / grains.mass[g] } else { 0.0 },
                    inverse_inertia: moment,
                    arm: body.centre_radius * grains.scale[g],
                    motion: grains.motion[g],
                    ball: body.is_ball(),
                };
                poses[n].scale = grains.scale[g];
                poses[n].body = grains.shape[g];
                poses[n].radius = if body.is_ball() { body.radii[0] * grains.scale[g] } else { 0.0 };
                poses[n].spheres = first_spheres[grains.shape[g] as usize];
                rotations[n] = poses[n].follow(grains, g, &mass_properties[n]);
            }
        });
    }
}
