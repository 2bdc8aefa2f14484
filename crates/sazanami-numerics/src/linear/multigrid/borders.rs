//! Ghosts of chequerboard values: periodic images and neighbouring ranks. Ghosts behind walls and
//! open sides are zero and are never written.

use super::chequerboard::{Chequerboard, Colours};
use super::wavefront::Planes;
use crate::domain::Domain;

/// First tag of the messages of this module.
const TAG: u32 = 200;

/// Periodic images and neighbouring ranks beyond the cells of a rank's part of a level.
pub(super) struct Borders {
    board: Chequerboard,
    /// Directions in which this rank is its own periodic neighbour.
    wraps: [bool; 3],
    /// Ranks at the lower and upper side in x1 and x2.
    neighbours: [[Option<usize>; 2]; 2],
    outgoing: Vec<f32>,
    incoming: Vec<u8>,
}

impl Borders {
    pub(super) fn new(board: Chequerboard, domain: &Domain) -> Self {
        let parts = domain.decomposition().parts();
        let periodic = domain.periodic();
        let rank = domain.communicator().rank();
        let wraps = [0, 1, 2].map(|d| periodic[d] && domain.grid().cells[d] > 1 && (d == 2 || parts[d] == 1));
        let neighbours = [0, 1].map(|d| {
            [0, 1].map(|side| {
                (parts[d] > 1).then(|| domain.decomposition().neighbour(rank, d, side, periodic[d])).flatten()
            })
        });
        Self { board, wraps, neighbours, outgoing: Vec::new(), incoming: Vec::new() }
    }

    /// Whether ghosts outside a plane never change, so that stages can follow each other.
    pub(super) fn still(&self) -> bool {
        !self.wraps[2] && self.neighbours.iter().flatten().all(Option::is_none)
    }

    /// Whether rows of a plane depend on rows far away in it.
    pub(super) fn rows_wrap(&self) -> bool {
        self.wraps[1]
    }

    /// Brings the ghosts inside plane `k` up to date after `colour` changed in these rows.
    #[inline]
    pub(super) fn inside(
        &self,
        x: [&mut Planes<'_, f32>; 2],
        colour: usize,
        (rows, k): (std::ops::Range<usize>, usize),
    ) {
        if !self.wraps[0] && !self.wraps[1] {
            return;
        }
        let board = &self.board;
        let [n1, n2, _] = board.cells;
        let k = k as isize;
        if self.wraps[0] {
            for j in rows.clone().map(|j| j as isize) {
                let at = board.first(j, k);
                if board.colour(0, j, k) == colour {
                    let value = x[colour].run(at, 1)[0];
                    x[board.colour(n1, j, k)].run_mut(at + n1 / 2, 1)[0] = value;
                }
                if board.colour(n1 - 1, j, k) == colour {
                    let value = x[colour].run(at + (n1 - 1) / 2, 1)[0];
                    x[board.colour(1, j, k)].run_mut(at - 1, 1)[0] = value;
                }
            }
        }
        if self.wraps[1] {
            let image = colour ^ (n2 & 1);
            let length = board.width - 2;
            let n2 = n2 as isize;
            for (from, to) in [(0, n2), (n2 - 1, -1)] {
                if rows.contains(&(from as usize)) {
                    for m in 0..length {
                        let value = x[colour].run(board.first(from, k) + m, 1)[0];
                        x[image].run_mut(board.first(to, k) + m, 1)[0] = value;
                    }
                }
            }
        }
    }

    /// Brings the ghosts beyond the first and last plane and those of other ranks up to date.
    pub(super) fn outside(&mut self, domain: &Domain, x: &mut Colours) {
        if self.wraps[2] {
            let plane = self.board.plane();
            let n3 = self.board.cells[2];
            for colour in 0..2 {
                let image = colour ^ (n3 & 1);
                for (from, to) in [(1, n3 + 1), (n3, 0)] {
                    for at in 0..plane {
                        x[image][to * plane + at] = x[colour][from * plane + at];
                    }
                }
            }
        }
        for direction in 0..2 {
            self.exchange(domain, direction, x);
        }
    }

    /// Swaps the outermost layers with the neighbouring ranks in `direction`.
    fn exchange(&mut self, domain: &Domain, direction: usize, x: &mut Colours) {
        let n = self.board.cells[direction] as isize;
        for side in 0..2 {
            if let Some(to) = self.neighbours[direction][side] {
                let layer = if side == 0 { 0 } else { n - 1 };
                let Self { board, outgoing, .. } = self;
                outgoing.clear();
                board.for_layer(direction, layer, |colour, at, length| {
                    outgoing.extend_from_slice(&x[colour][at..at + length]);
                });
                domain.communicator().send(to, TAG + (2 * direction + side) as u32, bytemuck::cast_slice(outgoing));
            }
        }
        for side in 0..2 {
            if let Some(from) = self.neighbours[direction][side] {
                let tag = TAG + (2 * direction + 1 - side) as u32;
                domain.communicator().receive(from, tag, &mut self.incoming);
                let mut values = self.incoming.chunks_exact(4).map(bytemuck::pod_read_unaligned::<f32>);
                let layer = if side == 0 { -1 } else { n };
                self.board.for_layer(direction, layer, |colour, at, length| {
                    x[colour][at..at + length].iter_mut().zip(&mut values).for_each(|(x, value)| *x = value);
                });
            }
        }
    }
}

impl Chequerboard {
    /// Calls `body(colour, place, length)` for the runs of values in a layer normal to `direction`
    /// (x1 or x2), in an order of position, not of colour: it is the same at both sides of a seam.
    fn for_layer(&self, direction: usize, layer: isize, mut body: impl FnMut(usize, usize, usize)) {
        for k in 0..self.cells[2] as isize {
            if direction == 0 {
                for j in 0..self.cells[1] as isize {
                    let at = self.first(j, k).wrapping_add_signed(layer.div_euclid(2));
                    body(self.colour(layer.rem_euclid(2) as usize, j, k), at, 1);
                }
            } else {
                for offset in 0..2 {
                    body(self.colour(offset, layer, k), self.first(layer, k), self.width - 2);
                }
            }
        }
    }
}
