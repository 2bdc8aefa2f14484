//! Particles of the fluid between ranks and periodic sides: owners, order in space, ghosts.

use bytemuck::Pod;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::particles::{self, Bins, GhostChoice, Migration, ParticleColumns, SpatialOrder};
use sazanami_numerics::{Real, Vector};

use crate::particles::{ParticleRecord, Particles};

const MIGRANTS: u32 = 400;
const GHOSTS: u32 = 401;
const VALUES: u32 = 402;

/// Lengths along which the fluid repeats itself, zero where it does not \[m].
///
/// Periods and the coordinates along them are multiples of a tiny length, so that an image lies exactly a period
/// away and a pair sees the same distance from both its ends, to the last bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Periods {
    lower: Vector,
    /// Period in each direction \[m].
    pub length: Vector,
    grain: Real,
}

impl Periods {
    /// Periods of the box of `domain` in its periodic directions.
    #[must_use]
    pub fn of(domain: &Domain) -> Self {
        let (lower, upper) = (domain.grid().lower, domain.grid().upper());
        let largest = lower.abs().max(upper.abs()).max_element().max(domain.grid().extent().max_element());
        // Multiples of 2^-50 of a length four times as large keep two bits to spare.
        let grain = (2.0 * largest.log2().ceil().exp2()) * (-50.0_f64).exp2();
        let periodic = domain.periodic();
        let of = |d: usize| if periodic[d] { (domain.grid().extent()[d] / grain).round() * grain } else { 0.0 };
        Self { lower, length: Vector::new(of(0), of(1), of(2)), grain }
    }

    /// `position` on exact multiples along periodic directions.
    #[inline]
    #[must_use]
    pub fn rounded(&self, mut position: Vector) -> Vector {
        for d in 0..3 {
            if self.length[d] > 0.0 {
                position[d] = (position[d] / self.grain).round() * self.grain;
            }
        }
        position
    }

    /// The image of `position` in the box, on exact multiples along periodic directions.
    #[must_use]
    pub fn wrapped(&self, mut position: Vector) -> Vector {
        for d in 0..3 {
            let length = self.length[d];
            if length > 0.0 {
                position[d] -= ((position[d] - self.lower[d]) / length).floor() * length;
            }
        }
        self.rounded(position)
    }

    /// Images other than the box itself that can matter.
    fn images(&self) -> impl Iterator<Item = Vector> {
        let range = |d: usize| if self.length[d] > 0.0 { -1..=1 } else { 0..=0 };
        let (first, second, third) = (range(0), range(1), range(2));
        let length = self.length;
        first.flat_map(move |i| {
            let third = third.clone();
            second.clone().flat_map(move |j| {
                third.clone().map(move |k| Vector::new(Real::from(i), Real::from(j), Real::from(k)) * length)
            })
        })
    }
}

/// The part of space that belongs to `rank`: its box, without end where the box ends.
fn zone(domain: &Domain, periods: &Periods, rank: usize) -> (Vector, Vector) {
    let (mut lower, mut upper) = domain.rank_box(rank);
    let (start, cells) = domain.decomposition().part(rank);
    for d in 0..3 {
        if periods.length[d] == 0.0 {
            if start[d] == 0 {
                lower[d] = Real::NEG_INFINITY;
            }
            if start[d] + cells[d] == domain.grid().cells[d] {
                upper[d] = Real::INFINITY;
            }
        }
    }
    (lower, upper)
}

/// Owners, order and ghosts of the particles, with all storage.
#[derive(Debug, Default)]
pub(crate) struct Ghosts {
    migration: Migration<ParticleRecord>,
    order: SpatialOrder<Particles>,
    copies: particles::Ghosts<Vector, ParticleRecord>,
    /// Bin, identifier and number of each ghost.
    keys: Vec<(u32, u64, u32)>,
}

/// Every particle within `margin` \[m] of a rank's part is a ghost there; `Vector` is the shift of an image \[m].
struct Near<'a> {
    domain: &'a Domain,
    periods: &'a Periods,
    margin: Real,
    bins: &'a Bins,
    keys: &'a mut Vec<(u32, u64, u32)>,
}

impl Near<'_> {
    /// Whether the parts of two ranks, one shifted, come near each other.
    fn near(&self, a: (Vector, Vector), b: (Vector, Vector), shift: Vector) -> bool {
        (b.0 - (a.1 + shift)).max((a.0 + shift) - b.1).max_element() <= 2.0 * self.margin
    }
}

impl GhostChoice<Particles, Vector> for Near<'_> {
    fn linked(&self, rank: usize) -> [bool; 2] {
        let me = self.domain.communicator().rank();
        // Both ends evaluate the same expression, and so agree.
        let [low, high] = [me.min(rank), me.max(rank)].map(|rank| zone(self.domain, self.periods, rank));
        [self.periods.images().any(|shift| self.near(low, high, shift)); 2]
    }

    fn choose(&mut self, particles: &Particles, rank: usize, chosen: &mut Vec<(u32, Vector)>) {
        let me = self.domain.communicator().rank();
        let [mine, theirs] = [me, rank].map(|rank| zone(self.domain, self.periods, rank));
        for shift in self.periods.images().filter(|&shift| rank != me || shift != Vector::ZERO) {
            if !self.near(mine, theirs, shift) {
                continue;
            }
            let (lower, upper) = (theirs.0 - shift - self.margin, theirs.1 - shift + self.margin);
            let positions = particles.position[..particles.owned].iter().enumerate();
            let wanted = positions.filter(|(_, x)| x.cmpge(lower).all() && x.cmple(upper).all());
            chosen.extend(wanted.map(|(a, _)| (a as u32, shift)));
        }
    }

    fn image(&self, particles: &Particles, own: u32, shift: Vector) -> ParticleRecord {
        let record = particles.record(own as usize);
        ParticleRecord { position: (Vector::from_array(record.position) + shift).to_array(), ..record }
    }

    /// Ghosts are sorted by bin key.
    fn arrange(&mut self, ghosts: &[ParticleRecord], order: &mut [u32]) {
        self.keys.clear();
        let bin = |ghost: &ParticleRecord| self.bins.number(Vector::from_array(ghost.position));
        self.keys.extend(ghosts.iter().zip(0..).map(|(ghost, number)| (bin(ghost), ghost.id, number)));
        // Images of one particle differ in position only.
        self.keys.sort_unstable_by(|a, b| {
            (a.0, a.1).cmp(&(b.0, b.1)).then_with(|| {
                let [a, b] = [a, b].map(|key| ghosts[key.2 as usize].position);
                a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
            })
        });
        order.iter_mut().zip(&*self.keys).for_each(|(number, key)| *number = key.2);
    }
}

impl Ghosts {
    /// Gives every particle to the rank whose part holds it. There are no ghosts.
    pub fn migrate(&mut self, domain: &Domain, particles: &mut Particles) {
        if self.migration.find_owners(domain, &particles.position) {
            self.migration.exchange(domain, MIGRANTS, particles, |_| {});
        }
    }

    /// Sorts the own particles by bin and, within a bin, by identifier. There are no ghosts.
    pub fn sort(&mut self, particles: &mut Particles, bins: &Bins) {
        self.order.sort(particles, bins.len(), |of, a| (bins.number(of.position[a]), of.id[a]));
    }

    /// Chooses and exchanges ghosts: every particle within `margin` \[m] of a rank's part becomes a ghost there. They
    /// are sorted by bin and identifier.
    pub fn renew(&mut self, domain: &Domain, periods: &Periods, particles: &mut Particles, margin: Real, bins: &Bins) {
        let Self { copies, keys, .. } = self;
        copies.renew(domain, GHOSTS, particles, &mut Near { domain, periods, margin, bins, keys });
    }

    /// Brings a column up to date at the ghosts, which have the value of the particle they are images of.
    pub fn refresh<T: Pod + Send + Sync>(&mut self, domain: &Domain, column: &mut [T]) {
        self.copies.refresh(domain, VALUES, column, |value, _| value);
    }

    /// Brings positions up to date at the ghosts.
    pub fn refresh_positions(&mut self, domain: &Domain, column: &mut [Vector]) {
        self.copies.refresh(domain, VALUES, column, |position, shift| position + shift);
    }
}
