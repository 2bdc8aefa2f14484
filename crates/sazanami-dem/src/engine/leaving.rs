//! Grains that leave and come in through sides of the box.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::particles::ParticleColumns;
use sazanami_numerics::{Real, Vector};

use super::Engine;
use crate::error::DemError;
use crate::grain::{Grain, GrainRecord, Motion};

/// Grains that have left through open sides since the start, over all ranks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Departures {
    /// Their number.
    pub grains: u64,
    /// Their mass \[kg].
    pub mass: Real,
    /// Momentum that they left with [N s]; none for those that forces did not move.
    pub momentum: Vector,
    /// The smallest size of each shape that left, over that of the shape; infinite: none did.
    pub least_scale: Vec<Real>,
}

impl Departures {
    pub(crate) fn none(bodies: usize) -> Self {
        Self { least_scale: vec![Real::INFINITY; bodies], ..Self::default() }
    }

    fn add(&mut self, grain: &GrainRecord) {
        self.grains += 1;
        self.mass += grain.mass;
        if grain.motion == Motion::Free as u64 {
            self.momentum += grain.mass * Vector::from_array(grain.velocity);
        }
        let least = &mut self.least_scale[grain.shape as usize];
        *least = least.min(grain.scale);
    }

    /// Its numbers in one row, and back.
    pub(crate) fn to_row(&self) -> Vec<Real> {
        let [x, y, z] = self.momentum.to_array();
        [self.grains as Real, self.mass, x, y, z].into_iter().chain(self.least_scale.iter().copied()).collect()
    }

    /// Of a row of [`Self::to_row`]; an empty one stands for none.
    pub(crate) fn from_row(row: &[Real], bodies: usize) -> Self {
        match row {
            [grains, mass, x, y, z, least @ ..] => Self {
                grains: *grains as u64,
                mass: *mass,
                momentum: Vector::new(*x, *y, *z),
                least_scale: least.to_vec(),
            },
            _ => Self::none(bodies),
        }
    }
}

/// Grains that were fed in since the start, over all ranks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Arrivals {
    /// Their number.
    pub grains: u64,
    /// Their mass \[kg].
    pub mass: Real,
    /// Momentum that they had when forces began to move them [N s].
    pub momentum: Vector,
    /// Their number by shape.
    pub by_shape: Vec<u64>,
}

impl Arrivals {
    pub(crate) fn none(bodies: usize) -> Self {
        Self { by_shape: vec![0; bodies], ..Self::default() }
    }

    /// Its numbers in one row, and back.
    pub(crate) fn to_row(&self) -> Vec<Real> {
        let [x, y, z] = self.momentum.to_array();
        [self.grains as Real, self.mass, x, y, z].into_iter().chain(self.by_shape.iter().map(|&n| n as Real)).collect()
    }

    /// Of a row of [`Self::to_row`]; an empty one stands for none.
    pub(crate) fn from_row(row: &[Real], bodies: usize) -> Self {
        match row {
            [grains, mass, x, y, z, by_shape @ ..] => Self {
                grains: *grains as u64,
                mass: *mass,
                momentum: Vector::new(*x, *y, *z),
                by_shape: by_shape.iter().map(|&n| n as u64).collect(),
            },
            _ => Self::none(bodies),
        }
    }
}

impl Engine {
    /// Lets grains leave through these sides, by direction, lower and upper, once they are beyond the region
    /// ([`Setup::region`](super::Setup::region)): no [`DemError::GrainEscaped`] there, and [`Self::take_departed`] takes them away.
    pub fn let_leave(&mut self, sides: [[bool; 2]; 3]) {
        self.leave_through = sides;
    }

    /// Grains that have left since the start.
    #[must_use]
    pub fn departures(&self) -> &Departures {
        &self.departures
    }

    /// Says that grains will be fed in, whether there are any yet or not.
    pub fn expect_arrivals(&mut self) {
        self.arrivals_expected = true;
    }

    /// Whether grains will be fed in.
    #[must_use]
    pub fn expects_arrivals(&self) -> bool {
        self.arrivals_expected
    }

    /// Grains that were fed in since the start.
    #[must_use]
    pub fn arrivals(&self) -> &Arrivals {
        &self.arrivals
    }

    /// Feeds in grains that move as prescribed until [`Self::let_go_fed`]. Every rank gives the same list. Collective.
    ///
    /// # Errors
    /// As [`Self::insert`].
    pub fn feed(&mut self, domain: &Domain, grains: &[Grain]) -> Result<(), DemError> {
        self.insert(domain, grains)?;
        for grain in GrainRecord::of_all(grains, &self.bodies, self.interactions.materials())? {
            self.arrivals.grains += 1;
            self.arrivals.mass += grain.mass;
            self.arrivals.by_shape[grain.shape as usize] += 1;
        }
        Ok(())
    }

    /// Lets grains that were fed in move by the forces on them from now on; returns how many. Collective.
    ///
    /// # Errors
    /// As [`Self::release`].
    pub fn let_go_fed(&mut self, domain: &Domain, which: impl Fn(u64) -> bool + Sync) -> Result<usize, DemError> {
        let those =
            (0..self.grains.owned).filter(|&g| self.grains.motion[g] != Motion::Free && which(self.grains.id[g]));
        let those = those.map(|g| self.grains.record(g));
        // Summed in the order of identifiers: the same bits on any number of ranks.
        let all: Vec<GrainRecord> = domain.from_first(domain.to_first_by(those, |grain| grain.id));
        for grain in &all {
            self.arrivals.momentum += grain.mass * Vector::from_array(grain.velocity);
        }
        self.release(domain, which)
    }

    /// Whether a grain on any rank is beyond an open side. Collective.
    #[must_use]
    pub fn any_departed(&self, domain: &Domain) -> bool {
        let mine = || (0..self.grains.owned).any(|g| self.has_departed(g));
        self.leave_through != [[false; 2]; 3] && domain.max(if mine() { 1.0 } else { 0.0 }) > 0.0
    }

    fn has_departed(&self, g: usize) -> bool {
        self.beyond(g).is_some_and(|[d, side]| self.leave_through[d][side])
    }

    /// Takes away the grains that are beyond an open side, with their contacts; returns how many, over all ranks. No grain changes
    /// its owner. Collective.
    ///
    /// # Errors
    /// Those of new lists of neighbours.
    pub fn take_departed(&mut self, domain: &Domain) -> Result<usize, DemError> {
        if !self.any_departed(domain) {
            return Ok(0);
        }
        let own = (0..self.grains.owned).filter(|&g| self.has_departed(g)).map(|g| self.grains.record(g));
        // Summed in the order of identifiers: the same bits on any number of ranks.
        let all: Vec<GrainRecord> = domain.from_first(domain.to_first_by(own, |grain| grain.id));
        all.iter().for_each(|grain| self.departures.add(grain));
        self.collect_records();
        let left = |id: u64| all.binary_search_by_key(&id, |grain| grain.id).is_ok();
        self.records.retain(|contact| !left(contact.low) && !left(contact.high));
        let stay: Vec<GrainRecord> =
            (0..self.grains.owned).map(|g| self.grains.record(g)).filter(|grain| !left(grain.id)).collect();
        self.grains.truncate(0);
        stay.iter().for_each(|record| self.grains.push(record));
        self.grains.own_all();
        self.time_step = self.longest_time_step(domain);
        self.book.window = None;
        self.listed = false;
        self.renew(domain, false)?;
        Ok(all.len())
    }

    /// Direction and side beyond which own grain `g` is outside the region; `None` within it, and where a side is periodic.
    pub(super) fn beyond(&self, g: usize) -> Option<[usize; 2]> {
        let p = self.grains.unwrapped[g];
        let closed = (0..3).filter(|&d| self.period[d] == 0.0);
        closed
            .flat_map(|d| [[d, 0], [d, 1]])
            .find(|&[d, side]| if side == 0 { p[d] < self.region[0][d] } else { p[d] > self.region[1][d] })
    }
}
