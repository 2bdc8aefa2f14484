//! Liquid beyond the room of a cell goes to its neighbours.
//!
//! A cell with more liquid than room (or less than none, where it gave more than it had) hands the excess over its six
//! faces, and takes gas of the same volume back. Most goes where there is room for it, and where the flow leads. What a
//! neighbour cannot hold is its own excess in the next round. The liquid takes its momentum along.
//!
//! After grains have moved, a full cell stays full, and its excess of either sign is a difference of its room: it hands a part of it on,
//! so that differences of opposite sign meet, or reach a surface. What is left after the last round a full cell keeps as such a
//! difference if it is small: a lack of more is gas that has come in, and what is more than full, like the rest of a cell without room,
//! waits where it is and is tried again in the next step. The equations of whole cells cannot bear a room far from the open part.
//!
//! The difference goes through all liquid: full cells without grains that stand among full ones, most of it, take part in these
//! rounds row by row (`among_full.rs`), the others one by one.

use std::ops::Range;

use sazanami_numerics::domain::{Domain, GhostRules, Row};
use sazanami_numerics::grid::{Field, GHOSTS};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk};

use super::among_full::{AmongFull, NOTHING, PART, box_ends, goes};
use super::{FULL, LIGHT, Room, beside_grains, split, usable};
use crate::boundary::Boundary;
use crate::flow::Flow;
use crate::fluids::Fluids;
use crate::grains::Imprint;

/// Most rounds in which liquid is handed on after a transport, and after the grains have moved.
const ROUNDS: [usize; 2] = [24, 12];
/// Part of what the neighbours of a cell have no room for, per room of a neighbour, that is handed over all the same: so it spreads to
/// where there is room.
const SPREADING: Real = 1e-3;
/// Gas up to which a cell counts as a full one, the less the more there is: round-off must not decide.
const NEARLY: Real = 1e-8;
/// Largest difference of its room that a full cell keeps, in cell volumes.
const DIFFERENCE: Real = 0.1;
/// Preference of faces without outflow, beside the Courant number of the others.
const STILL: Real = 0.02;

/// Liquid that had no room where the step left it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SettleReport {
    /// Rounds in which liquid was handed on.
    pub rounds: usize,
    /// Volume handed on, summed over the rounds [m^3].
    pub moved_volume: Real,
    /// Sum of the differences of full cells' room from their open part without their sign, in the last rounds [m^3].
    pub left_volume: Real,
    /// Other cells in which liquid, or the lack of it, waits for room.
    pub waiting_cells: u64,
    /// This liquid, each cell without its sign [m^3].
    pub waiting_volume: Real,
    /// Momentum added where a cell was too light to take what it was given [N s].
    pub clipped_momentum: Vector,
}

impl std::ops::AddAssign for SettleReport {
    fn add_assign(&mut self, other: Self) {
        self.rounds += other.rounds;
        self.moved_volume += other.moved_volume;
        self.left_volume = other.left_volume;
        (self.waiting_cells, self.waiting_volume) = (other.waiting_cells, other.waiting_volume);
        self.clipped_momentum += other.clipped_momentum;
    }
}

/// New values of a cell.
struct Change {
    at: usize,
    fraction: Real,
    excess: Real,
    velocity: Vector,
    given: Vector,
}

/// What a round finds in a plane of cells, ghosts included: places in memory.
#[derive(Default)]
struct Plane {
    /// Cells that hand something on.
    hot: Vec<u32>,
    /// Cells of the interior that hand something on or are beside such.
    near: Vec<u32>,
    /// A bit for each place of the plane.
    marks: Vec<u64>,
    changes: Vec<Change>,
}

impl Plane {
    /// Lists the cells of the plane of `columns` from place `first` on that are marked, of the interior and not `passed`, and takes the
    /// marks away.
    fn list_marked(&mut self, first: usize, columns: &PlaceIndices, passed: impl Fn(usize) -> bool) {
        self.near.clear();
        for (number, word) in self.marks.iter_mut().enumerate() {
            let mut bits = std::mem::take(word);
            while bits != 0 {
                let place = 64 * number + bits.trailing_zeros() as usize;
                if columns.inside(place) && !passed(first + place) {
                    self.near.push((first + place) as u32);
                }
                bits &= bits - 1;
            }
        }
    }
}

/// Local indices of the columns of cells, by place in a plane.
struct PlaceIndices {
    indices: Vec<[i32; 2]>,
    size: [i32; 2],
}

impl PlaceIndices {
    fn new(domain: &Domain) -> Self {
        let [width, plane] = [1, 2].map(|d| domain.strides()[d] as usize);
        let index = |n: usize| n as i32 - GHOSTS as i32;
        let [n1, n2, _] = domain.cells().map(|n| n as i32);
        Self { indices: (0..plane).map(|at| [index(at % width), index(at / width)]).collect(), size: [n1, n2] }
    }

    /// Whether the column belongs to the interior.
    fn inside(&self, place: usize) -> bool {
        let [i, j] = self.indices[place];
        (0..self.size[0]).contains(&i) && (0..self.size[1]).contains(&j)
    }

    /// Local indices of the cell in plane `k`.
    fn cell(&self, place: usize, k: usize) -> [isize; 3] {
        let [i, j] = self.indices[place];
        [i as isize, j as isize, k as isize]
    }
}

/// Storage of the rounds.
pub(super) struct Settler {
    /// The planes from the ghosts below on.
    planes: Vec<Plane>,
    /// What the round before has left in each plane.
    before: Vec<Vec<u32>>,
    columns: PlaceIndices,
    /// What each row of the interior hands on in a round, in cell volumes.
    handed: Vec<Real>,
    /// Of a cell that hands something on: what its neighbours cannot take of it in cell volumes, if positive, and what it hands to a
    /// neighbour per weight of this one; one ghost layer filled.
    beyond: Field<Real>,
    rates: Field<Real>,
    pub(super) among: AmongFull,
}

impl Settler {
    /// Finds the cells that hand something on, those of one ghost layer included if there `has_ghosts`: all over the box in the `first`
    /// round, then among those that the round before could change. After grains have `moved` full cells among full ones are left out.
    fn find_hot(&mut self, domain: &Domain, excess: &Field<Real>, [first, has_ghosts, moved]: [bool; 3]) {
        let [n1, n2, n3] = domain.cells().map(|n| n as isize);
        let (x, among) = (excess.data(), &self.among);
        for_each_chunk(&mut self.planes[..], 1, |number, planes| {
            let (Plane { hot, near, .. }, k) = (&mut planes[0], number as isize - 1);
            hot.clear();
            let inner = (0..n3).contains(&k);
            let is_hot = |at: &u32| goes(x[*at as usize]) && !(moved && among.holds(*at as usize));
            if inner && !first {
                hot.extend(near.iter().copied().filter(is_hot));
            }
            let mut add = |row: [isize; 2], j: isize| {
                let start = excess.at(row[0], j, k) as u32;
                hot.extend((start..start + (row[1] - row[0]) as u32).filter(is_hot));
            };
            if inner && first {
                (0..n2).for_each(|j| add([0, n1], j));
            }
            if has_ghosts && inner {
                (0..n2).for_each(|j| [[-1, 0], [n1, n1 + 1]].into_iter().for_each(|row| add(row, j)));
                [-1, n2].into_iter().for_each(|j| add([0, n1], j));
            } else if has_ghosts {
                (0..n2).for_each(|j| add([0, n1], j));
            }
        });
    }

    pub fn new(domain: &Domain) -> Self {
        let count = domain.cells()[2] + 2;
        let reserved = || Vec::with_capacity(256);
        let words = (domain.strides()[2] as usize).div_ceil(64);
        let plane =
            || Plane { hot: reserved(), near: reserved(), marks: vec![0; words], changes: Vec::with_capacity(256) };
        Self {
            planes: (0..count).map(|_| plane()).collect(),
            before: (0..count).map(|_| reserved()).collect(),
            columns: PlaceIndices::new(domain),
            handed: vec![0.0; domain.cells()[1] * domain.cells()[2]],
            beyond: domain.field(0.0),
            rates: domain.field(0.0),
            among: AmongFull::new(domain),
        }
    }
}

/// Whether a cell of this fraction keeps the `excess` that no round has placed, as a difference of its room.
#[inline]
fn keeps(fraction: Real, excess: Real) -> bool {
    fraction == FULL && excess.abs() <= DIFFERENCE
}

/// Fraction and excess of a cell that does not keep the difference of its room `open`: a full one takes gas for what it lacks.
#[inline]
fn waiting(fraction: Real, excess: Real, open: Real) -> [Real; 2] {
    if fraction == FULL { split(open + excess, open, FULL) } else { [fraction, excess] }
}

/// Fields of a round, by place in memory.
#[derive(Clone, Copy)]
struct Cells<'a> {
    open: &'a [Real],
    alpha: &'a [Real],
    fraction: &'a [Real],
    excess: &'a [Real],
    beyond: &'a [Real],
    rates: &'a [Real],
    velocity: [&'a [Real]; 3],
    /// Sum of the solid fractions times the velocities of the grains [m/s].
    solid: [&'a [Real]; 3],
    faces: [&'a [Real]; 3],
    strides: [usize; 3],
    /// Time over the widths of the cells [s/m].
    per_width: Vector,
    /// Local cells along each direction, and whether the box ends before the first and behind the last of them.
    size: [isize; 3],
    ends: [[bool; 2]; 3],
    fluids: Fluids,
    /// Whether full cells stay full.
    moved: bool,
}

impl Cells<'_> {
    fn velocity(&self, at: usize) -> Vector {
        Vector::new(self.velocity[0][at], self.velocity[1][at], self.velocity[2][at])
    }

    /// The neighbours within the box of the cell with local indices `cell` at place `at`: place, direction, whether above.
    fn neighbours(&self, cell: [isize; 3], at: usize) -> impl Iterator<Item = (usize, usize, bool)> + '_ {
        (0..6).map(|n| (n / 2, n % 2 == 1)).filter_map(move |(d, above)| {
            let outside = if above { cell[d] + 1 == self.size[d] } else { cell[d] == 0 };
            let place = if above { at + self.strides[d] } else { at - self.strides[d] };
            (!(outside && self.ends[d][usize::from(above)])).then_some((place, d, above))
        })
    }

    /// What the cell at `to` can take of an `excess`.
    fn takes(&self, to: usize, excess: Real) -> Real {
        let c = self.fraction[to].clamp(0.0, 1.0);
        usable(self.open[to]) * if excess > 0.0 { 1.0 - c } else { c }
    }

    /// What the neighbours of the cell with local indices `cell` at place `at` cannot take of its excess.
    fn beyond(&self, cell: [isize; 3], at: usize) -> Real {
        let excess = self.excess[at];
        excess.abs() - self.neighbours(cell, at).map(|(to, ..)| self.takes(to, excess)).sum::<Real>()
    }

    /// Weight with which the cell at `from` hands its excess to the neighbour at `to` in direction `d`.
    fn weight(&self, from: usize, to: usize, d: usize, above: bool) -> Real {
        let (room, excess) = (usable(self.open[to]), self.excess[from]);
        let takes = self.takes(to, excess);
        if self.moved {
            // Full cells pass a difference on.
            let fullness = 1.0 - (1.0 - self.fraction[to].clamp(0.0, 1.0)) / NEARLY;
            return if excess > 0.0 { takes.max(room * fullness) } else { takes };
        }
        let outflow = if above { self.faces[d][to] } else { -self.faces[d][from] };
        let spread = if excess > 0.0 { SPREADING * self.beyond[from].max(0.0) * room } else { 0.0 };
        (takes + spread) * (STILL + self.per_width[d] * outflow.max(0.0))
    }

    /// Part of its excess that a cell hands on: of a lack what there is liquid for.
    fn part(&self, at: usize) -> Real {
        let there_is = if self.excess[at] < 0.0 { 1.0 + self.beyond[at].max(0.0) / self.excess[at] } else { 1.0 };
        there_is.max(0.0) * if self.moved { PART } else { 1.0 }
    }

    /// Change of a cell in a round; `None` if there is none.
    fn change(&self, cell: [isize; 3], at: usize) -> Option<Change> {
        let drho = self.fluids.liquid_density - self.fluids.gas_density;
        let (own, u) = (self.excess[at], self.velocity(at));
        let goes = goes(own) && self.rates[at] != 0.0;
        let part_of = if goes { self.part(at) } else { 0.0 };
        let (mut entered, mut carried, mut impulse, mut touched) = (0.0, 0.0, Vector::ZERO, goes);
        for (beside, d, above) in self.neighbours(cell, at) {
            if self::goes(self.excess[beside]) && self.rates[beside] != 0.0 {
                let part = self.rates[beside] * self.weight(beside, at, d, !above);
                touched |= part != 0.0;
                entered += part;
                carried += drho * part.max(0.0);
                impulse += drho * part.max(0.0) * (self.velocity(beside) - u);
            }
            if goes && own < 0.0 {
                let part = -self.rates[at] * self.weight(at, beside, d, above);
                carried += drho * part;
                impulse += drho * part * (self.velocity(beside) - u);
            }
        }
        if !touched {
            return None;
        }
        let (open, c) = (self.open[at], self.fraction[at]);
        let liquid = open * c + (1.0 - part_of) * own + entered;
        let [fraction, excess] = if self.moved && c == FULL { [c, liquid - open] } else { split(liquid, open, c) };
        let mass = open * self.fluids.density(fraction) + drho * excess;
        // Grains take part of it where there are any: small rooms with much passing through stay slow.
        let (whole, is_covered) = (self.fluids.density(fraction), self.alpha[at] > 0.0);
        let is_light = mass < LIGHT * whole.max(carried);
        // With what carries the impulse: gas alone would be faster than the liquid that passes through it.
        let gained = if is_covered {
            let densities = [self.fluids.density(c), whole];
            let moving = Vector::from_array(
                [0, 1, 2].map(|d| beside_grains(u[d], densities, self.solid[d][at], self.alpha[at]) - u[d]),
            );
            (impulse + whole * moving) / (whole + carried)
        } else {
            impulse / if is_light { whole + carried } else { mass }
        };
        let given = if is_covered || is_light { impulse - mass * gained } else { Vector::ZERO };
        Some(Change { at, fraction, excess, velocity: u + gained, given })
    }
}

impl Room {
    /// Hands the excess on; afterwards the first ghost layer of the fractions is not filled.
    pub(super) fn settle(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        imprint: &Imprint,
        flow: &mut Flow,
        dt: Option<Real>,
    ) -> SettleReport {
        let mut report = SettleReport::default();
        let rules: [GhostRules; 3] = std::array::from_fn(|d| boundary.velocity_rules(d));
        let ends = box_ends(domain);
        // Behind a wall is no neighbour.
        let has_ghosts = ends.as_flattened().contains(&false);
        while report.rounds < ROUNDS[usize::from(dt.is_none())] {
            if has_ghosts {
                let Flow { volume_fraction, velocity: [u1, u2, u3], .. } = flow;
                domain.fill_halos_to(
                    1,
                    &mut [
                        (volume_fraction, &boundary.volume_fraction_rules()),
                        (&mut self.excess, &GhostRules::EVEN),
                        (u1, &rules[0]),
                        (u2, &rules[1]),
                        (u3, &rules[2]),
                    ],
                );
            }
            let (first, moved) = (report.rounds == 0, dt.is_none());
            if first && !goes(self.largest_excess(domain, Some(imprint))) {
                break;
            }
            let Settler { among, rates, handed, .. } = &mut self.settler;
            if moved && first {
                among.find(domain, imprint, &flow.volume_fraction, &self.open);
            }
            if moved {
                among.hand_on(domain, first, &self.excess, rates, handed);
            } else {
                handed.fill(0.0);
            }
            let among_full = handed.iter().any(|handed| *handed > 0.0);
            self.settler.find_hot(domain, &self.excess, [first, has_ghosts, moved]);
            let hot = among_full || self.settler.planes.iter().any(|plane| !plane.hot.is_empty());
            if domain.max(Real::from(u8::from(hot))) == 0.0 {
                break;
            }
            report.rounds += 1;
            let moved = self.hand_on(domain, imprint, flow, dt, has_ghosts);
            if moved == 0.0 {
                break;
            }
            report.moved_volume += moved;
        }
        // Rounds may have gone beyond the rows with grains.
        let within = (report.rounds == 0).then_some(imprint);
        if self.largest_excess(domain, within) > 0.0 {
            self.leave(domain, imprint, flow, &mut report);
        } else {
            self.waits = false;
        }
        report.clipped_momentum += self.take_untaken(domain, imprint, report.rounds > 0);
        report
    }

    /// Largest excess on any rank without its sign, of the rows with grains `within` this imprint, or that stood out before, or of all.
    pub(super) fn largest_excess(&self, domain: &Domain, within: Option<&Imprint>) -> Real {
        let excess = self.excess.data();
        domain.max(domain.max_rows(&domain.interior(), |row| match within {
            Some(imprint) if !self.is_beside_grains(imprint, &row) => 0.0,
            _ => excess[row.shifted(0)].iter().fold(0.0, |largest: Real, excess| largest.max(excess.abs())),
        }))
    }

    /// Whether there are grains in this row, or were, or a room other than that of whole cells.
    fn is_beside_grains(&self, imprint: &Imprint, row: &Row) -> bool {
        self.rows.holds(row.j, row.k) || imprint.row_is_covered(row.j, row.k)
    }

    /// One round; returns the volume handed on over all ranks [m^3].
    fn hand_on(
        &mut self,
        domain: &Domain,
        imprint: &Imprint,
        flow: &mut Flow,
        dt: Option<Real>,
        has_ghosts: bool,
    ) -> Real {
        let moved = dt.is_none();
        let Self { open, excess, settler, .. } = self;
        let Settler { planes, before, columns, beyond, rates, handed, among } = settler;
        let among = &*among;
        let columns = &*columns;
        let [_, width, plane] = domain.strides().map(|stride| stride as usize);
        let [n1, n2, n3] = domain.cells();
        let interior = GHOSTS * plane..(GHOSTS + n3) * plane;
        let cells = Cells {
            open: open.data(),
            alpha: imprint.solid_fraction.data(),
            fraction: flow.volume_fraction.data(),
            excess: excess.data(),
            beyond: &[],
            rates: &[],
            velocity: flow.velocity.each_ref().map(Field::data),
            solid: imprint.solid_velocity.each_ref().map(Field::data),
            faces: flow.face_velocity.each_ref().map(Field::data),
            strides: domain.strides().map(|stride| stride as usize),
            per_width: domain.grid().spacing.recip() * dt.unwrap_or_default(),
            size: [n1, n2, n3].map(|n| n as isize),
            ends: box_ends(domain),
            fluids: flow.fluids,
            moved,
        };
        // The cells of the interior in plane `k` that hand something on: place in memory, and in the plane.
        let hot = |k: usize| {
            let first = (GHOSTS + k) * plane;
            planes[k + 1]
                .hot
                .iter()
                .map(move |&at| (at as usize, at as usize - first))
                .filter(|&(_, place)| columns.inside(place))
        };
        let of_beyond = Rows { data: &mut beyond.data_mut()[interior.clone()], width: plane };
        for_each_chunk(of_beyond, 1, |k, beyond| {
            for (at, place) in hot(k) {
                beyond.data[place] = cells.beyond(columns.cell(place, k), at);
            }
        });
        let with_beyond = Cells { beyond: beyond.data(), ..cells };
        let of_rates = Rows { data: &mut rates.data_mut()[interior.clone()], width: plane };
        let of_handed = Rows { data: &mut handed[..], width: n2 };
        for_each_chunk((of_rates, of_handed), 1, |k, (rates, handed)| {
            for (at, place) in hot(k) {
                let cell = columns.cell(place, k);
                let weight = |(to, d, above)| with_beyond.weight(at, to, d, above);
                let sum: Real = cells.neighbours(cell, at).map(weight).sum();
                let part = if sum > 0.0 { with_beyond.part(at) * cells.excess[at] } else { 0.0 };
                rates.data[place] = if part != 0.0 { part / sum } else { 0.0 };
                handed.data[cell[1] as usize] += part.abs();
            }
        });
        let moved_volume = domain.sum([handed.iter().sum()])[0] * domain.grid().cell_volume();
        if has_ghosts {
            domain.fill_halos_to(1, &mut [(&mut *beyond, &NOTHING), (&mut *rates, &NOTHING)]);
        }
        let cells = Cells { beyond: beyond.data(), rates: rates.data(), ..cells };
        // The lists of this round become those that the next one starts from.
        for (plane, before) in planes.iter_mut().zip(&mut *before) {
            std::mem::swap(&mut plane.hot, before);
        }
        let hot = &*before;
        for_each_chunk(&mut planes[1..=n3], 1, |k, planes| {
            let first = (GHOSTS + k) * plane;
            let own = &mut planes[0];
            let mut mark = |place: usize| own.marks[place / 64] |= 1 << (place % 64);
            for place in hot[k + 1].iter().map(|&at| at as usize - first) {
                [place, place - 1, place + 1, place - width, place + width].into_iter().for_each(&mut mark);
            }
            hot[k].iter().map(|&at| at as usize + plane - first).for_each(&mut mark);
            hot[k + 2].iter().map(|&at| at as usize - plane - first).for_each(&mut mark);
            if moved {
                among.edges(k).filter(|&at| among.is_beside_some(at, cells.rates)).for_each(|at| mark(at - first));
            }
            own.list_marked(first, columns, |at| moved && among.holds(at));
            let Plane { near, changes, .. } = own;
            changes.clear();
            let change = |&at: &u32| cells.change(columns.cell(at as usize - first, k), at as usize);
            changes.extend(near.iter().filter_map(change));
        });
        if moved {
            let Settler { among, rates, handed, .. } = &mut self.settler;
            among.take(domain, [&self.open, rates], &mut self.excess, handed, flow);
        }
        self.take_changes(flow, interior, plane);
        moved_volume
    }

    /// Puts the changes of a round into the fields; the planes of the `interior` have `plane` cells each.
    fn take_changes(&mut self, flow: &mut Flow, interior: Range<usize>, plane: usize) {
        let Self { given, excess, settler: Settler { planes, .. }, .. } = self;
        let [u1, u2, u3] = flow.velocity.each_mut().map(Field::data_mut);
        let [g1, g2, g3] = given.each_mut().map(Field::data_mut);
        let fields = [flow.volume_fraction.data_mut(), excess.data_mut(), u1, u2, u3, g1, g2, g3];
        let [c, x, u1, u2, u3, g1, g2, g3] =
            fields.map(|field| Rows { data: &mut field[interior.clone()], width: plane });
        for_each_chunk(((c, x), (u1, u2, u3), (g1, g2, g3)), 1, |k, ((c, x), u, g)| {
            for change in &planes[k + 1].changes {
                let i = change.at - (GHOSTS + k) * plane;
                (c.data[i], x.data[i]) = (change.fraction, change.excess);
                (u.0.data[i], u.1.data[i], u.2.data[i]) = change.velocity.into();
                g.0.data[i] += change.given.x;
                g.1.data[i] += change.given.y;
                g.2.data[i] += change.given.z;
            }
        });
    }

    /// Leaves what no round has placed: a full cell keeps a small one as a difference of its room, to be settled later, and gives a larger
    /// lack to gas; elsewhere it waits, and what is given gets its momentum.
    fn leave(&mut self, domain: &Domain, imprint: &Imprint, flow: &mut Flow, report: &mut SettleReport) {
        let volume = domain.grid().cell_volume();
        let drho = flow.fluids.liquid_density - flow.fluids.gas_density;
        let gas = flow.fluids.gas_density;
        let (x, c, v) = (self.excess.data(), flow.volume_fraction.data(), self.open.data());
        let left = domain.sum(domain.sum_rows(&domain.interior(), |row| {
            let mut sum = [0.0; 4];
            for at in row.shifted(0).filter(|&at| x[at] != 0.0) {
                let (kind, rest) = if keeps(c[at], x[at]) { (0, x[at]) } else { (2, waiting(c[at], x[at], v[at])[1]) };
                sum[kind] += Real::from(u8::from(rest != 0.0));
                sum[kind + 1] += rest.abs() * volume;
            }
            sum
        }));
        report.waiting_cells = left[2] as u64;
        [report.left_volume, report.waiting_volume] = [left[1], left[3]];
        self.waits = report.waiting_cells > 0;
        let Flow { volume_fraction, velocity, fluids, .. } = flow;
        let (c, alpha) = (volume_fraction.data_mut(), imprint.solid_fraction.data());
        let [u1, u2, u3] = velocity.each_mut().map(Field::data_mut);
        let [g1, g2, g3] = self.given.each_mut().map(Field::data_mut);
        let fields = (c, self.open.data_mut(), self.excess.data_mut(), (u1, u2, u3), (g1, g2, g3));
        domain.for_each_row(&domain.interior(), fields, |row, (c, open, excess, (u1, u2, u3), (g1, g2, g3))| {
            for (i, at) in row.shifted(0).enumerate() {
                if excess[i] == 0.0 {
                    continue;
                }
                if !keeps(c[i], excess[i]) {
                    [c[i], excess[i]] = waiting(c[i], excess[i], open[i]);
                    for (u, given) in [(&u1[i], &mut g1[i]), (&u2[i], &mut g2[i]), (&u3[i], &mut g3[i])] {
                        *given += drho * excess[i] * u;
                    }
                    continue;
                }
                let before = open[i] * fluids.liquid_density + drho * excess[i];
                open[i] += excess[i];
                let after = open[i] * fluids.liquid_density;
                let is_light = after <= LIGHT * before.abs();
                for (u, given) in [(&mut *u1, &mut *g1), (&mut *u2, &mut *g2), (&mut *u3, &mut *g3)] {
                    if alpha[at] > 0.0 || is_light {
                        given[i] -= gas * excess[i] * u[i];
                    } else {
                        u[i] *= before / after;
                    }
                }
                excess[i] = 0.0;
            }
        });
        domain.fill_halos(&mut [(&mut self.open, &GhostRules::EVEN)]);
    }

    /// Takes what cells without grains were too light to take out of what is given; returns the momentum that this adds, over all
    /// ranks [N s]. Only rounds go beyond the rows with grains.
    fn take_untaken(&mut self, domain: &Domain, imprint: &Imprint, after_rounds: bool) -> Vector {
        let (alpha, given) = (imprint.solid_fraction.data(), self.given.each_ref().map(Field::data));
        let [x, y, z, cells] = domain.sum_rows(&domain.interior(), |row| {
            let mut sums = [0.0; 4];
            if after_rounds || self.is_beside_grains(imprint, &row) {
                for (d, given) in given.into_iter().enumerate() {
                    for at in row.shifted(0).filter(|&at| given[at] != 0.0 && alpha[at] == 0.0) {
                        sums[d] += given[at];
                        sums[3] += 1.0;
                    }
                }
            }
            sums
        });
        if cells > 0.0 {
            let [g1, g2, g3] = self.given.each_mut().map(Field::data_mut);
            domain.for_each_row(&domain.interior(), (g1, g2, g3), |row, (g1, g2, g3)| {
                for given in [g1, g2, g3] {
                    let there = given.iter_mut().zip(&alpha[row.shifted(0)]);
                    there.filter(|(_, alpha)| **alpha == 0.0).for_each(|(given, _)| *given = 0.0);
                }
            });
        }
        -domain.grid().cell_volume() * Vector::from_array(domain.sum([x, y, z]))
    }
}

#[cfg(test)]
mod tests;
