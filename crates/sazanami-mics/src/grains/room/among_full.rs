//! Rounds of [`super::settle`] after grains have moved, in full cells without grains that stand among full ones.
//!
//! Such a cell hands on a part of its difference `x` to its neighbours `m` by their room, `r_n V_m` with `r_n = 2/3 max(x_n / sum V_m, -1)`:
//! of a lack no more than there is liquid for. It stays full, so that a round has no case to tell apart.

use sazanami_numerics::Real;
use sazanami_numerics::domain::{Domain, Ghost, GhostRules, Location};
use sazanami_numerics::grid::{Field, GHOSTS};
use sazanami_parallel::{Rows, for_each_chunk};

use super::{FULL, LIGHT, usable};
use crate::flow::Flow;
use crate::grains::Imprint;

/// Cells of a row in one go.
const BLOCK: usize = 32;
/// An excess up to this stays where it is, in cell volumes: traces would spread through the gas of the whole box.
const SETTLED: Real = 1e-12;
/// Part of its difference that a full cell hands on in a round.
pub(super) const PART: Real = 2.0 / 3.0;

/// Nothing stands behind the sides of the box.
pub(super) const NOTHING: GhostRules =
    GhostRules { location: Location::Cell, sides: [[Ghost::Constant { value: 0.0 }; 2]; 3] };

/// Whether a cell with this excess hands it on.
#[inline]
pub(super) fn goes(excess: Real) -> bool {
    excess.abs() > SETTLED
}

/// Whether the box ends at each side of the rank, so that there is no neighbour.
pub(super) fn box_ends(domain: &Domain) -> [[bool; 2]; 3] {
    [0, 1, 2].map(|d| [0, 1].map(|side| domain.at_box_end(d, side) && !domain.periodic()[d]))
}

/// The full cells among full ones.
pub(super) struct AmongFull {
    /// Room of the cells, none behind the sides of the box; one ghost layer filled.
    room: Field<Real>,
    /// Room of the neighbours of a full cell among full ones, zero in all other cells.
    around: Field<Real>,
    /// Full cells of each plane of the interior that are not among full ones.
    edges: Vec<Vec<u32>>,
    /// Whether each row of the interior has cells among full ones.
    rows: Vec<bool>,
    /// Velocity after a round; in a transport that of the volume that grains carry through the lower faces [m/s].
    pub velocity: [Field<Real>; 3],
    strides: [usize; 3],
}

impl AmongFull {
    pub fn new(domain: &Domain) -> Self {
        Self {
            room: domain.field(0.0),
            around: domain.field(0.0),
            edges: (0..domain.cells()[2]).map(|_| Vec::with_capacity(256)).collect(),
            rows: vec![false; domain.cells()[1] * domain.cells()[2]],
            velocity: std::array::from_fn(|_| domain.field(0.0)),
            strides: domain.strides().map(|stride| stride as usize),
        }
    }

    /// Whether the cell at this place is one of them.
    pub fn holds(&self, at: usize) -> bool {
        self.around.data()[at] > 0.0
    }

    /// Places of the full cells of plane `k` that are not.
    pub fn edges(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        self.edges[k].iter().map(|&at| at as usize)
    }

    /// Whether a neighbour of the cell at this place hands something on.
    pub fn is_beside_some(&self, at: usize, rates: &[Real]) -> bool {
        self.strides.into_iter().any(|stride| rates[at - stride] != 0.0 || rates[at + stride] != 0.0)
    }

    /// Finds the cells; rounds do not change them. The first ghost layer of both fields must be filled.
    pub fn find(&mut self, domain: &Domain, imprint: &Imprint, fraction: &Field<Real>, open: &Field<Real>) {
        let (c, v, alpha) = (fraction.data(), open.data(), imprint.solid_fraction.data());
        let Self { room, around, edges, rows, strides, .. } = self;
        domain.for_each_row(&domain.interior(), room.data_mut(), |row, room| {
            room.iter_mut().zip(row.shifted(0)).for_each(|(room, at)| *room = usable(v[at]));
        });
        domain.fill_halos_to(1, &mut [(&mut *room, &NOTHING)]);
        let (room, strides, ends) = (room.data(), *strides, box_ends(domain));
        let [n1, n2, n3] = domain.cells();
        let [_, width, plane] = strides;
        let of_around = Rows { data: &mut around.data_mut()[GHOSTS * plane..(GHOSTS + n3) * plane], width: plane };
        let of_rows = Rows { data: &mut rows[..], width: n2 };
        for_each_chunk((of_around, &mut edges[..], of_rows), 1, |k, (around, edges, rows)| {
            edges[0].clear();
            for (j, has_some) in rows.data.iter_mut().enumerate() {
                *has_some = false;
                let first = (GHOSTS + j) * width + GHOSTS;
                around.data[first..first + n1].fill(0.0);
                let of_row = &c[(GHOSTS + k) * plane + first..][..n1];
                for i in (0..n1).filter(|&i| of_row[i] == FULL) {
                    let (place, at) = (first + i, (GHOSTS + k) * plane + first + i);
                    let is_end =
                        |d: usize, side: usize| ends[d][side] && [i, j, k][d] == [0, [n1, n2, n3][d] - 1][side];
                    let are_full = |d: usize| {
                        (is_end(d, 0) || c[at - strides[d]] == FULL) && (is_end(d, 1) || c[at + strides[d]] == FULL)
                    };
                    if alpha[at] == 0.0 && v[at] > LIGHT && (0..3).all(are_full) {
                        around.data[place] =
                            strides.into_iter().map(|stride| room[at - stride] + room[at + stride]).sum();
                        *has_some = true;
                    } else {
                        edges[0].push(at as u32);
                    }
                }
            }
        });
    }

    /// Sets the `rates` of what they hand on in this round, none in all other cells, and the sum for each row: in the `first` round all over
    /// the box, then in the rows that have some of them or where the round before `handed` something on.
    pub fn hand_on(
        &self,
        domain: &Domain,
        first: bool,
        excess: &Field<Real>,
        rates: &mut Field<Real>,
        handed: &mut [Real],
    ) {
        let [_, width, plane] = self.strides;
        let [n1, n2, n3] = domain.cells();
        let (x, around) = (excess.data(), self.around.data());
        let rates = &mut rates.data_mut()[GHOSTS * plane..(GHOSTS + n3) * plane];
        let rows = (Rows { data: rates, width: plane }, Rows { data: handed, width: n2 });
        for_each_chunk(rows, 1, |k, (rates, handed)| {
            for (j, handed) in handed.data.iter_mut().enumerate() {
                let place = (GHOSTS + j) * width + GHOSTS;
                let at = (GHOSTS + k) * plane + place;
                let rates = &mut rates.data[place..][..n1];
                let before = std::mem::take(handed);
                if !self.rows[n2 * k + j] {
                    if first || before > 0.0 {
                        rates.fill(0.0);
                    }
                    continue;
                }
                let (x, around) = (&x[at..][..n1], &around[at..][..n1]);
                for i in 0..n1 {
                    let is_one = around[i] > 0.0 && goes(x[i]);
                    rates[i] = if is_one { PART * (x[i] / around[i]).max(-1.0) } else { 0.0 };
                    *handed += (rates[i] * around[i]).abs();
                }
            }
        });
    }

    /// Takes what neighbours hand to them, and its momentum; `handed` is what each row hands on. The first ghost layer of the `rates` and of
    /// the velocity must be filled.
    pub fn take(
        &mut self,
        domain: &Domain,
        [open, rates]: [&Field<Real>; 2],
        excess: &mut Field<Real>,
        handed: &[Real],
        flow: &mut Flow,
    ) {
        let [n1, n2, n3] = domain.cells();
        let [_, width, plane] = self.strides;
        let Self { room, around, rows, velocity: next, strides, .. } = self;
        let beside = |at: usize| strides.iter().flat_map(move |stride| [at - stride, at + stride]);
        let (room, around, rates, open) = (room.data(), around.data(), rates.data(), open.data());
        let n_rows = plane / width;
        // What enters from other ranks is in the ghosts; rows at the ends of the rank that have such cells are looked at in any case.
        let is_reached = |j: usize, k: usize| {
            if !rows[n2 * k + j] {
                return false;
            }
            let at_end = j == 0 || k == 0 || j + 1 == n2 || k + 1 == n3;
            let beside = || [n2 * k + j, n2 * k + j - 1, n2 * k + j + 1, n2 * (k - 1) + j, n2 * (k + 1) + j];
            let first = ((GHOSTS + k) * n_rows + GHOSTS + j) * width + GHOSTS;
            at_end
                || rates[first - 1] != 0.0
                || rates[first + n1] != 0.0
                || beside().into_iter().any(|row| handed[row] > 0.0)
        };
        let (gas, drho) = (flow.fluids.gas_density, flow.fluids.liquid_density - flow.fluids.gas_density);
        let u = flow.velocity.each_ref().map(Field::data);
        let interior = GHOSTS * plane..(GHOSTS + n3) * plane;
        let x = Rows { data: &mut excess.data_mut()[interior.clone()], width: plane };
        let next_rows =
            next.each_mut().map(|field| Rows { data: &mut field.data_mut()[interior.clone()], width: plane });
        for_each_chunk((x, next_rows), 1, |k, (x, mut next)| {
            let rows = (0..n2).filter(|&j| is_reached(j, k));
            for (j, i) in rows.flat_map(|j| (0..n1).step_by(BLOCK).map(move |i| (j, i))) {
                let n = BLOCK.min(n1 - i);
                let place = (GHOSTS + j) * width + GHOSTS + i;
                let at = (GHOSTS + k) * plane + place;
                let (own, rate, around) = (&room[at..][..n], &rates[at..][..n], &around[at..][..n]);
                let (mut entered, mut passing, mut impulse) = ([0.0; BLOCK], [0.0; BLOCK], [[0.0; BLOCK]; 3]);
                for there in beside(at) {
                    let (rates, room) = (&rates[there..][..n], &room[there..][..n]);
                    for i in 0..n {
                        let part = own[i] * rates[i];
                        entered[i] += part;
                        passing[i] = part.max(0.0) + (-rate[i]).max(0.0) * room[i];
                    }
                    for (impulse, u) in impulse.iter_mut().zip(u) {
                        let (u, there) = (&u[at..][..n], &u[there..][..n]);
                        for i in 0..n {
                            impulse[i] += passing[i] * (there[i] - u[i]);
                        }
                    }
                }
                let (x, open) = (&mut x.data[place..][..n], &open[at..][..n]);
                for i in 0..n {
                    let is_one = around[i] > 0.0;
                    let left = if is_one { x[i] - rate[i] * around[i] + entered[i] } else { x[i] };
                    x[i] = left;
                    let mass = open[i] * (gas + drho) + drho * left;
                    passing[i] = if is_one { drho / mass } else { 0.0 };
                }
                for ((next, impulse), u) in next.iter_mut().zip(impulse).zip(u) {
                    let (next, u) = (&mut next.data[place..][..n], &u[at..][..n]);
                    for i in 0..n {
                        next[i] = u[i] + passing[i] * impulse[i];
                    }
                }
            }
        });
        for (u, next) in flow.velocity.iter_mut().zip(next) {
            domain.for_each_row(&domain.interior(), u.data_mut(), |row, u| {
                if is_reached(row.j as usize, row.k as usize) {
                    u.copy_from_slice(&next.data()[row.shifted(0)]);
                }
            });
        }
    }
}
