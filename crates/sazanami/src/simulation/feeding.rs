//! Grains that are fed in through sides of the box.

use sazanami_dem::{DemError, Engine, Grain, Motion};
use sazanami_mps::gates;
use sazanami_numerics::Random;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_posing::assembly::grains::{factors, member};

use crate::case::meaning::{Case, Feed, GrainPlacement};
use crate::clock::END;
use crate::water::Water;

/// Places that are tried for a grain in a step.
const TRIES: usize = 20;
/// Part of its size that a grain begins within reach of the side: round-off.
const WITHIN: Real = 1e-6;

/// A population that is fed in.
struct Stream {
    population: usize,
    feed: Feed,
    seed: u64,
    /// Size factors of its grains.
    scales: Vec<Real>,
    /// Number of the grain that comes next.
    next: usize,
    /// Whether some may still be on their way in.
    carries: bool,
    /// Whether the next one was due and found no room.
    waits: bool,
}

/// All that are fed in.
pub(super) struct Feeding {
    streams: Vec<Stream>,
}

/// A way that is taken: its ends \[m] and the radius of what takes it \[m].
type Way = ([Vector; 2], Real);

impl Feeding {
    /// Those of a run that begins or goes on with `water`.
    pub fn of<W: Water>(case: &Case, water: &W) -> Self {
        let arrivals = water.engine().arrivals();
        let stream = |(population, kind): (usize, &crate::case::meaning::Population)| {
            let GrainPlacement::Fed(feed) = &kind.placement else { return None };
            let scales = factors(kind, kind.grains().unwrap_or_default());
            let next = arrivals.by_shape[population] as usize;
            Some(Stream { population, feed: feed.clone(), seed: kind.seed, scales, next, carries: true, waits: false })
        };
        Self { streams: case.grains.iter().enumerate().filter_map(stream).collect() }
    }

    /// Feeds in the grains whose time has come, where there is room, and lets those go that are inside.
    pub fn feed<W: Water>(&mut self, case: &Case, water: &mut W, time: Real, step: u64) -> Result<(), DemError> {
        let (mut fed, mut ways, mut inside) = (Vec::new(), Vec::new(), Vec::new());
        for stream in &mut self.streams {
            stream.look(water.engine(), water.domain(), &mut inside);
            while stream.due().is_some_and(|due| due <= time * (1.0 + END)) {
                let placed = stream.place(case, water.engine(), water.domain(), (time, step), &mut ways);
                stream.waits = placed.is_none();
                let Some(grain) = placed else { break };
                fed.push(grain);
                stream.next += 1;
                stream.carries = true;
            }
        }
        let goes = water.domain().max(if inside.is_empty() { 0.0 } else { 1.0 }) > 0.0;
        if !fed.is_empty() || goes {
            inside.sort_unstable();
            water.feed(&fed, |id| inside.binary_search(&id).is_ok())?;
        }
        Ok(())
    }

    /// What is to be said of grains that were due by `time` \[s] and found no room.
    pub fn waiting(&self, time: Real) -> Option<String> {
        let due = |stream: &Stream| {
            (stream.next..stream.scales.len()).take_while(|&n| stream.feed.due(n) <= time * (1.0 + END)).count()
        };
        let late: usize = self.streams.iter().filter(|stream| stream.waits).map(due).sum();
        let said = format!(
            "warning: grains that were due and are not fed in, as there is no room at their side: {late}; feed fewer, faster, through a \
             larger part of it, or past gates that stand in their way"
        );
        (late > 0).then_some(said)
    }

    /// The next time at which a step has to end for a grain to come \[s].
    pub fn next(&self, time: Real) -> Option<Real> {
        self.streams.iter().filter_map(Stream::due).filter(|due| *due > time * (1.0 + END)).reduce(Real::min)
    }
}

impl Stream {
    /// Time at which the next grain is due \[s].
    fn due(&self) -> Option<Real> {
        (self.next < self.scales.len()).then(|| self.feed.due(self.next))
    }

    /// Direction into the box.
    fn inward(&self) -> Vector {
        let [direction, upper] = self.feed.side.place();
        if upper == 0 { Vector::AXES[direction] } else { -Vector::AXES[direction] }
    }

    /// Distance of a place from the side, into the box \[m].
    fn depth(&self, case_lower: Vector, case_upper: Vector, place: Vector) -> Real {
        let [direction, upper] = self.feed.side.place();
        if upper == 0 { place[direction] - case_lower[direction] } else { case_upper[direction] - place[direction] }
    }

    /// Adds the own grains that are carried and inside as a whole; notes whether any is still carried on any rank.
    fn look(&mut self, engine: &Engine, domain: &Domain, inside: &mut Vec<u64>) {
        if !self.carries {
            return;
        }
        let (grains, grid) = (engine.grains(), domain.grid());
        let reach = engine.bodies()[self.population].bounding_radius;
        let mut left = 0.0;
        let carried =
            |&g: &usize| grains.shape[g] as usize == self.population && grains.motion[g] == Motion::Prescribed;
        for g in (0..grains.owned()).filter(carried) {
            if self.depth(grid.lower, grid.upper(), grains.position[g]) >= reach * grains.scale[g] {
                inside.push(grains.id[g]);
            } else {
                left = 1.0;
            }
        }
        self.carries = domain.max(left) > 0.0;
    }

    /// The next grain outside its side, if there is a place with a free way in; its way joins the others.
    fn place(
        &self,
        case: &Case,
        engine: &Engine,
        domain: &Domain,
        (time, step): (Real, u64),
        ways: &mut Vec<Way>,
    ) -> Option<Grain> {
        let [direction, upper] = self.feed.side.place();
        let scale = self.scales[self.next];
        let reach = scale * engine.bodies()[self.population].bounding_radius;
        let periodic = domain.periodic();
        let mut random = Random::new(self.seed ^ (self.next as u64).rotate_left(24) ^ step.rotate_left(44));
        let way = self.feed.velocity / self.feed.inward();
        for _ in 0..TRIES {
            let mut start = Vector::from_array(std::array::from_fn(|d| {
                let (margin, drift) = if periodic[d] { (0.0, 0.0) } else { (reach, 2.0 * reach * way[d]) };
                let (lower, upper) = (self.feed.lower[d] + margin, self.feed.upper[d] - margin);
                random.between(lower - drift.min(0.0), upper - drift.max(0.0))
            }));
            let drawn = engine.bodies()[self.population].drawn;
            let turn = if self.feed.random_orientation { random.orientation() } else { drawn };
            let side = if upper == 0 { case.domain.lower[direction] } else { case.domain.upper[direction] };
            start[direction] = side;
            start -= (1.0 - WITHIN) * reach * self.inward();
            let end = start + 2.0 * reach * way;
            let taken = ([start, end], reach);
            let during = [time, time + 2.0 * reach / self.feed.inward()];
            if !meets_gate(case, during, taken) && self.is_free(engine, domain, taken, ways) {
                ways.push(taken);
                return Some(Grain {
                    position: start,
                    orientation: turn,
                    velocity: self.feed.velocity,
                    motion: Motion::Prescribed,
                    ..member(case, self.population, self.next, scale)
                });
            }
        }
        None
    }

    /// Whether no grain on any rank is near a way in, and no other way. Collective: all ranks ask for the same ways.
    fn is_free(&self, engine: &Engine, domain: &Domain, ([start, end], reach): Way, ways: &[Way]) -> bool {
        let (grains, extent, periodic) = (engine.grains(), domain.grid().extent(), domain.periodic());
        let distance = |place: Vector| {
            let mut from = place - start;
            for d in (0..3).filter(|&d| periodic[d]) {
                from[d] -= extent[d] * (from[d] / extent[d]).round();
            }
            let along = end - start;
            (from - along * (from.dot(along) / along.length_squared()).clamp(0.0, 1.0)).length()
        };
        let radius = |g: usize| grains.scale[g] * engine.bodies()[grains.shape[g] as usize].bounding_radius;
        let meets = |g: usize| distance(grains.position[g]) < reach + radius(g);
        let crosses = |&([a, b], other): &Way| {
            let samples = (0..=4).map(|n| a + (b - a) * (0.25 * Real::from(n)));
            samples.map(distance).fold(Real::INFINITY, Real::min) < reach + other
        };
        let met = (0..grains.owned()).any(meets) || ways.iter().any(crosses);
        domain.max(if met { 1.0 } else { 0.0 }) == 0.0
    }
}

/// Whether a gate is in the way of a grain on its way in, which it takes from one time to another \[s]; one that rises counts as far as it
/// reaches meanwhile.
fn meets_gate(case: &Case, [from, until]: [Real; 2], ([start, end], reach): Way) -> bool {
    let along = end - start;
    case.gates.iter().any(|gate| {
        let rise = |time: Real| gate.speed.map_or(0.0, |speed| speed * (time - gate.opens).max(0.0));
        let edges = [gate.bottom + rise(from), gate.top + rise(until)];
        let vanished = gate.speed.is_none() && from >= gate.opens * (1.0 - END);
        if vanished || edges[0] >= case.domain.upper.z {
            return false;
        }
        let plate = gates::Gate { edges, ..gate.plate() };
        let d = plate.direction;
        // Beside the ends of the way, the places at which it is nearest to an edge, or goes through the plate.
        let nearest = |z: Real| {
            let (across, upwards) = (plate.place - start[d], z - start.z);
            (across * along[d] + upwards * along.z) / (along[d] * along[d] + along.z * along.z)
        };
        let parts = [0.0, 1.0, nearest(edges[0]), nearest(edges[1]), (plate.place - start[d]) / along[d]];
        let ways = parts.into_iter().filter(|part| (0.0..=1.0).contains(part));
        ways.map(|part| plate.clearance(start + part * along)).any(|clearance| clearance < reach)
    })
}
