//! Geometric multigrid for one 7-point equation with jumping coefficients.
//!
//! A cycle relaxes red, then black cells (Gauss-Seidel) twice on the way down and in mirrored order
//! on the way up, which makes it a symmetric preconditioner. Residuals are summed over the two
//! cells per direction that make a coarse cell, corrections are copied back; a coarse face takes
//! the sum of the coefficients of its fine faces, divided by how much farther apart the cell centres
//! are. The last cell of an odd number stands alone. Directions with one cell are not coarsened,
//! nor are those in which cells are much longer than in others. All of it is in single precision
//! (the caller checks true residuals in double precision).
//!
//! Between ranks, levels stay distributed while coarse cells fall on the cuts between the parts;
//! the first level that would not is gathered, and every rank solves it by itself. The result has
//! the same bits for any number of ranks and threads.
//!
//! Red-black relaxation and averaged coefficients for jumps: Wesseling, "An Introduction to
//! Multigrid Methods" (1992), chapters 4, 5 and 7.

mod borders;
mod chequerboard;
mod direction;
mod level;
mod measure;
mod stencil;
mod transfer;
mod wavefront;

use sazanami_parallel::{Rows, for_each_chunk};

use super::equation::Equation;
use crate::Real;
use crate::domain::{Decomposition, Domain, Row};
use crate::grid::{GHOSTS, Grid};
pub(crate) use chequerboard::{Chequerboard, Colours};
pub(crate) use direction::{Direction, DirectionStep, Residual};
use level::Level;
use stencil::RUN;
use transfer::Transfer;

/// A direction is coarsened unless its coupling is this many times weaker than the strongest.
const ANISOTROPY: Real = 3.0;
/// Levels below this number of cells are not worth messages: they are gathered.
const GATHERED: usize = 20_000;

/// Levels and cycles for one grid.
pub(crate) struct Multigrid {
    /// Finest first. A level that repeats the cells of the one before it is its gathered copy.
    levels: Vec<Level>,
    /// Number of the gathered copy, if there is one.
    gathered: Option<usize>,
    gathering: Gathering,
    /// Largest coefficient of each plane.
    largest: Vec<Real>,
}

/// Buffers for the gathering of a level.
#[derive(Default)]
struct Gathering {
    mine: Vec<f32>,
    all: Vec<Vec<u8>>,
}

impl Multigrid {
    /// Levels for the grid of `domain`, down to a single cell.
    pub(crate) fn new(domain: &Domain) -> Self {
        let mut levels: Vec<Level> = Vec::new();
        let mut gathered = None;
        let mut domain = domain.coarsened(*domain.grid(), domain.decomposition().cuts().clone());
        let spacing = domain.grid().spacing;
        let mut spacing = [spacing.x, spacing.y, spacing.z];
        let mut widths = domain.grid().cells.map(|n| vec![1.0; n]);
        loop {
            let ratio = coarsening(domain.grid().cells, spacing);
            if is_gathered(domain.grid(), domain.decomposition(), ratio) {
                gathered = Some(levels.len() + 1);
                let whole = domain.replicated();
                levels.push(Level::new(domain, 2));
                domain = whole;
                continue;
            }
            let mut level = Level::new(domain, 2);
            if ratio == [1; 3] {
                levels.push(level);
                return Self { levels, gathered, gathering: Gathering::default(), largest: Vec::new() };
            }
            let (grid, cuts) = coarse(level.frame.domain.grid(), level.frame.domain.decomposition(), ratio);
            let coarse = level.frame.domain.coarsened(grid, cuts);
            let coarse_widths: [Vec<Real>; 3] =
                [0, 1, 2].map(|d| widths[d].chunks(ratio[d]).map(|w| w.iter().sum()).collect());
            level.frame.factors = [0, 1, 2].map(|d| factors(&coarse, d, &widths[d], &coarse_widths[d], ratio[d]));
            let board = Chequerboard::new(coarse.cells(), coarse.start());
            level.frame.transfer = Some(Transfer { ratio, coarse: board });
            levels.push(level);
            widths = coarse_widths;
            spacing = [0, 1, 2].map(|d| spacing[d] * ratio[d] as Real);
            domain = coarse;
        }
    }

    /// Layout of the cells of the finest level.
    pub(crate) fn board(&self) -> &Chequerboard {
        self.levels[0].board()
    }

    /// The finest level.
    fn finest(&mut self) -> &mut Level {
        &mut self.levels[0]
    }

    /// The finest level, and the next one if a cycle relaxes the finest at all.
    fn finest_and_next(&mut self) -> (&mut Level, Option<&mut Level>) {
        let gathered = self.gathered;
        let (finest, rest) = self.levels.split_at_mut(1);
        (&mut finest[0], rest.first_mut().filter(|_| gathered != Some(1)))
    }

    /// Sets the operators of all levels; returns the largest coefficient.
    pub(crate) fn set_up(&mut self, equation: &impl Equation) -> Real {
        let largest = set_coefficients(&mut self.levels[0], equation, &mut self.largest);
        self.levels[0].invert_diagonal();
        for number in 1..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(number);
            let (fine, coarse) = (&finer[number - 1], &mut coarser[0]);
            if self.gathered == Some(number) {
                self.gathering.coefficients(fine, coarse);
            } else {
                fine.coarsen(coarse);
            }
            coarse.invert_diagonal();
        }
        largest
    }

    /// First half of a cycle on the finest level.
    pub(crate) fn descend(&mut self) {
        if let (finest, Some(next)) = self.finest_and_next() {
            finest.descend(&mut next.b);
        }
    }

    /// The rest of a cycle after [`Self::descend`]: sets the finest `x`, and returns per plane the
    /// sums of `b x`, `previous x`, `x A x` and `x`.
    pub(crate) fn complete(&mut self, previous: &Colours, sums: &mut [[f64; 4]]) {
        if self.gathered == Some(1) {
            self.cycle_gathered(0);
            self.levels[0].fill_ghosts();
            self.levels[0].measure(previous, sums);
        } else if self.levels.len() == 1 {
            self.levels[0].solve_single();
            self.levels[0].measure(previous, sums);
        } else {
            self.cycle(1);
            let (finest, rest) = self.levels.split_at_mut(1);
            finest[0].ascend(&rest[0].x, Some((previous, sums)));
        }
    }

    /// Sets `x` of a level from its `b`.
    fn cycle(&mut self, number: usize) {
        if number + 1 == self.levels.len() {
            self.levels[number].solve_single();
        } else if self.gathered == Some(number + 1) {
            self.cycle_gathered(number);
        } else {
            let (finer, coarser) = self.levels.split_at_mut(number + 1);
            finer[number].descend(&mut coarser[0].b);
            self.cycle(number + 1);
            let (finer, coarser) = self.levels.split_at_mut(number + 1);
            finer[number].ascend(&coarser[0].x, None);
        }
    }

    /// Solves level `number` by a cycle on its gathered copy.
    fn cycle_gathered(&mut self, number: usize) {
        let (finer, coarser) = self.levels.split_at_mut(number + 1);
        self.gathering.right_hand_side(&finer[number], &mut coarser[0]);
        self.cycle(number + 1);
        let (finer, coarser) = self.levels.split_at_mut(number + 1);
        let (part, whole) = (&mut finer[number], &coarser[0]);
        let [a, b, c] = part.frame.domain.start();
        let (from, to) = (*whole.board(), *part.board());
        to.for_each_place([0; 3], |i, j, k, (colour, at)| {
            let (other, there) = from.place(i + a, j + b, k + c);
            part.x[colour][at] = whole.x[other][there];
        });
    }
}

impl Gathering {
    /// Collects the coefficients of `part` of all ranks in `whole`.
    fn coefficients(&mut self, part: &Level, whole: &mut Level) {
        self.mine.clear();
        let stencil = &part.frame.stencil;
        stencil.board.for_each_place([1; 3], |i, j, k, (colour, _)| {
            for d in 0..3 {
                self.mine.push(stencil.faces[colour][stencil.face(d, j as isize, k as isize) + i / 2]);
            }
        });
        part.frame.domain.communicator().all_gather(bytemuck::cast_slice(&self.mine), &mut self.all);
        let stencil = &mut whole.frame.stencil;
        let board = stencil.board;
        for (rank, bytes) in self.all.iter().enumerate() {
            let (start, cells) = part.frame.domain.decomposition().part(rank);
            let mut values = bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned::<f32>);
            Chequerboard::new(cells, start).for_each_place([1; 3], |i, j, k, _| {
                let [i, j, k] = [i + start[0], j + start[1], k + start[2]];
                for d in 0..3 {
                    // A value behind the part in another direction is not set there, but elsewhere.
                    if let Some(value) = values.next().filter(|value| *value != 0.0) {
                        let at = stencil.face(d, j as isize, k as isize) + i / 2;
                        stencil.faces[board.colour(i, j as isize, k as isize)][at] = value;
                    }
                }
            });
        }
    }

    /// Collects the right-hand sides of `part` of all ranks in `whole`.
    fn right_hand_side(&mut self, part: &Level, whole: &mut Level) {
        self.mine.clear();
        part.board().for_each_place([0; 3], |_, _, _, (colour, at)| self.mine.push(part.b[colour][at]));
        part.frame.domain.communicator().all_gather(bytemuck::cast_slice(&self.mine), &mut self.all);
        let board = *whole.board();
        for (rank, bytes) in self.all.iter().enumerate() {
            let ([a, b, c], cells) = part.frame.domain.decomposition().part(rank);
            let mut values = bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned::<f32>);
            Chequerboard::new(cells, [a, b, c]).for_each_place([0; 3], |i, j, k, _| {
                let (colour, at) = board.place(i + a, j + b, k + c);
                whole.b[colour][at] = values.next().unwrap_or(0.0);
            });
        }
    }
}

impl Chequerboard {
    /// Colour and place of a cell.
    fn place(&self, i: usize, j: usize, k: usize) -> (usize, usize) {
        (self.colour(i, j as isize, k as isize), self.first(j as isize, k as isize) + i / 2)
    }

    /// Calls `body(i, j, k, (colour, place))` for all cells and `more` layers behind the last ones.
    fn for_each_place(&self, more: [usize; 3], mut body: impl FnMut(usize, usize, usize, (usize, usize))) {
        for k in 0..self.cells[2] + more[2] {
            for j in 0..self.cells[1] + more[1] {
                for i in 0..self.cells[0] + more[0] {
                    body(i, j, k, self.place(i, j, k));
                }
            }
        }
    }
}

/// Number of cells that make a coarse cell in each direction.
fn coarsening(cells: [usize; 3], spacing: [Real; 3]) -> [usize; 3] {
    let coupling = |d: usize| if cells[d] > 1 { 1.0 / (spacing[d] * spacing[d]) } else { 0.0 };
    let strongest = (0..3).map(coupling).fold(0.0, Real::max);
    [0, 1, 2].map(|d| if cells[d] > 1 && coupling(d) * ANISOTROPY >= strongest { 2 } else { 1 })
}

/// Whether each rank gets a level cut like this as a whole: it is small, or the cuts between the parts do not fall on
/// coarse cells.
fn is_gathered(grid: &Grid, cut: &Decomposition, ratio: [usize; 3]) -> bool {
    let cuts = cut.cuts();
    let aligned = (0..2).all(|d| cuts[d][..cuts[d].len() - 1].iter().all(|cut| cut.is_multiple_of(ratio[d])));
    cut.parts() != [1, 1] && (grid.len() < GATHERED || !aligned)
}

/// The coarse grid and the cuts between its parts.
fn coarse(grid: &Grid, cut: &Decomposition, ratio: [usize; 3]) -> (Grid, [Vec<usize>; 2]) {
    let cells = [0, 1, 2].map(|d| grid.cells[d].div_ceil(ratio[d]));
    let cuts = [0, 1].map(|d| cut.cuts()[d].iter().map(|cut| cut.div_ceil(ratio[d])).collect());
    (Grid::new(cells, grid.lower, grid.upper()), cuts)
}

/// Levels of a grid that is cut among ranks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Levels {
    /// Cells of those that stay cut, the finest first.
    pub distributed: Vec<[usize; 3]>,
    /// Cells of the first one that every rank has, and solves, as a whole; absent on one rank.
    pub gathered: Option<[usize; 3]>,
}

/// The levels that the pressure of a flow on `grid` has, cut like this.
#[must_use]
pub fn levels(grid: &Grid, cut: &Decomposition) -> Levels {
    let (mut grid, mut cut) = (*grid, cut.clone());
    let mut spacing = grid.spacing.to_array();
    let mut distributed = Vec::new();
    loop {
        let ratio = coarsening(grid.cells, spacing);
        if is_gathered(&grid, &cut, ratio) {
            return Levels { distributed, gathered: Some(grid.cells) };
        }
        distributed.push(grid.cells);
        if ratio == [1; 3] {
            return Levels { distributed, gathered: None };
        }
        let (coarse, cuts) = coarse(&grid, &cut, ratio);
        cut = Decomposition::from_cuts(&coarse, cuts);
        grid = coarse;
        spacing = [0, 1, 2].map(|d| spacing[d] * ratio[d] as Real);
    }
}

/// Fine over coarse distance of the centres at the lower faces of the coarse cells of a part, and
/// at the upper face of the last.
fn factors(coarse: &Domain, direction: usize, fine: &[Real], widths: &[Real], ratio: usize) -> Vec<f32> {
    let count = widths.len();
    let periodic = coarse.periodic()[direction];
    let start = coarse.start()[direction];
    (start..=start + coarse.cells()[direction])
        .map(|at| {
            let factor = if (at == 0 || at == count) && !periodic {
                let (cell, fine_cell) = if at == 0 { (0, 0) } else { (count - 1, fine.len() - 1) };
                fine[fine_cell] / widths[cell]
            } else if count == 1 {
                // A single periodic cell is its own neighbour.
                0.0
            } else {
                let (above, fine_above) = (at % count, at * ratio % (count * ratio));
                let (below, fine_below) =
                    ((at + count - 1) % count, if fine_above == 0 { fine.len() - 1 } else { fine_above - 1 });
                (fine[fine_above] + fine[fine_below]) / (widths[above] + widths[below])
            };
            factor as f32
        })
        .collect()
}

/// Sets the coefficients of the finest level; returns the largest of all ranks.
fn set_coefficients(level: &mut Level, equation: &impl Equation, maxima: &mut Vec<Real>) -> Real {
    let board = *level.board();
    let [n1, n2, n3] = board.cells;
    let domain = &level.frame.domain;
    let alone = [0, 1, 2].map(|d| domain.periodic()[d] && domain.grid().cells[d] == 1);
    maxima.clear();
    maxima.resize(n3 + 2, 0.0);
    let width = 3 * board.plane();
    let [a, b] = &mut level.frame.stencil.faces;
    let slices = (Rows { data: a, width }, Rows { data: b, width }, &mut maxima[..]);
    for_each_chunk(slices, 1, |number, (a, b, maximum)| {
        let Some(k) = number.checked_sub(1) else { return };
        let into = [a.data, b.data];
        for j in 0..=n2 {
            for d in (0..3).filter(|&d| !alone[d] && (j < n2 || d == 1) && (k < n3 || d == 2)) {
                let last = if d == 0 { n1 + 1 } else { n1 };
                for first in (0..last).step_by(RUN) {
                    let len = (last - first).min(RUN);
                    let start = ((k + GHOSTS) * (n2 + 2 * GHOSTS) + j + GHOSTS) * (n1 + 2 * GHOSTS) + first + GHOSTS;
                    let row = Row { first: first as isize, j: j as isize, k: k as isize, start, len };
                    let mut values = [0.0; RUN];
                    equation.coefficients(d, row, &mut values[..len]);
                    maximum[0] = values[..len].iter().fold(maximum[0], |a: Real, b| a.max(*b));
                    for offset in 0..2 {
                        let colour = board.colour(offset, row.j, row.k);
                        let at = (3 * (j + 1) + d) * board.width + 1 + first / 2;
                        let into = &mut into[colour][at..][..(len + 1 - offset) / 2];
                        for (into, value) in into.iter_mut().zip(values[offset..].iter().step_by(2)) {
                            *into = *value as f32;
                        }
                    }
                }
            }
        }
    });
    domain.max(maxima.iter().copied().fold(0.0, Real::max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vector;
    use crate::domain::GhostRules;
    use crate::linear::FaceEquation;
    use sazanami_parallel::{Communicator, Solo, run_ranks};

    /// A number in [0, 1) for a cell of the whole grid and a purpose.
    fn random(purpose: u64, [i, j, k]: [usize; 3]) -> Real {
        let mut n =
            (i as u64 + 1000 * j as u64 + 1_000_000 * k as u64 + (purpose << 40)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        n = (n ^ (n >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        n = (n ^ (n >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((n ^ (n >> 31)) >> 11) as Real / (1u64 << 53) as Real
    }

    /// A cycle for each of some random right-hand sides and random coefficients: global indices and values of the last.
    fn cycled(
        communicator: Box<dyn Communicator>,
        cells: [usize; 3],
        periodic: [bool; 3],
        rights: &[u64],
    ) -> Vec<([usize; 3], f32)> {
        let domain = Domain::new(Grid::new(cells, Vector::ZERO, Vector::ONE), periodic, communicator)
            .expect("cells for every rank");
        let start = domain.start();
        let global = |at: [usize; 3]| [0, 1, 2].map(|d| (at[d] + start[d]) % cells[d]);
        let mut faces = [0, 1, 2].map(|_| domain.field(0.0));
        let board = Chequerboard::new(domain.cells(), start);
        board.for_each_place([1; 3], |i, j, k, _| {
            for (d, faces) in faces.iter_mut().enumerate() {
                let index = [i, j, k][d] + start[d];
                let wall = !periodic[d] && (index == 0 || index == cells[d]);
                let value = if random(d as u64, global([i, j, k])) < 0.5 { 1e-3 } else { 1.0 };
                faces[[i as isize, j as isize, k as isize]] = if wall { 0.0 } else { value };
            }
        });
        let zero = domain.field(0.0);
        let faces = [&faces[0], &faces[1], &faces[2]];
        let equation = FaceEquation { faces, right_hand_side: &zero, ghosts: &GhostRules::EVEN, singular: true };
        let mut multigrid = Multigrid::new(&domain);
        multigrid.set_up(&equation);
        for &right in rights {
            let level = multigrid.finest();
            board.for_each_place([0; 3], |i, j, k, (colour, at)| {
                level.b[colour][at] = random(right, global([i, j, k])) as f32 - 0.5;
            });
            multigrid.descend();
            let mut sums = vec![[0.0; 4]; domain.cells()[2]];
            multigrid.complete(&board.zeros(), &mut sums);
        }
        let mut values = Vec::new();
        let level = multigrid.finest();
        board.for_each_place([0; 3], |i, j, k, (colour, at)| values.push((global([i, j, k]), level.x[colour][at])));
        values
    }

    #[test]
    fn a_cycle_has_the_same_bits_on_any_number_of_ranks() {
        let boxes =
            [([64, 48, 20], [false; 3]), ([64, 36, 21], [true, false, true]), ([18, 13, 7], [false, true, false])];
        for (cells, periodic) in boxes {
            let sorted = |mut values: Vec<([usize; 3], f32)>| {
                values.sort_by_key(|(at, _)| *at);
                values
            };
            let alone = sorted(cycled(Box::new(Solo::default()), cells, periodic, &[7]));
            for ranks in [2, 3, 4, 6] {
                let parts = run_ranks(ranks, 1, |c| cycled(c, cells, periodic, &[7])).unwrap();
                assert!(sorted(parts.concat()) == alone, "{cells:?} on {ranks} ranks");
            }
        }
    }

    #[test]
    fn passes_are_cut_where_threads_would_find_too_few_slabs() {
        let domain = Domain::solo(Grid::new([176, 184, 132], Vector::ZERO, Vector::ONE), [false; 3]);
        let multigrid = Multigrid::new(&domain);
        let Level { frame, borders, .. } = &multigrid.levels[0];
        let stages = |threads: usize| {
            let groups = || -> Vec<usize> {
                frame.groups(borders, &level::LAGS[..5], true).map(|group| group.stages.len()).collect()
            };
            sazanami_parallel::with_threads(threads, groups).unwrap()
        };
        let one_pass: Vec<usize> = vec![5];
        assert_eq!([1, 2, 8].map(stages), [(); 3].map(|()| one_pass.clone()));
        assert_eq!(stages(64), [3, 2]);
    }

    #[test]
    fn a_cycle_knows_nothing_of_the_one_before() {
        for (cells, periodic) in
            [([12, 12, 12], [true, true, false]), ([13, 9, 7], [true, false, true]), ([24, 20, 12], [false; 3])]
        {
            let last = |rights: &[u64]| cycled(Box::new(Solo::default()), cells, periodic, rights);
            assert!(last(&[8, 7]) == last(&[7]), "{cells:?}");
            assert!(last(&[7, 8]) != last(&[7]), "negative control: the right-hand side matters");
        }
    }

    #[test]
    fn a_cycle_is_symmetric() {
        for (cells, periodic) in
            [([24, 20, 12], [false; 3]), ([13, 9, 7], [true, false, true]), ([17, 1, 12], [true; 3])]
        {
            let product = |right: u64, left: u64| -> Real {
                let x = cycled(Box::new(Solo::default()), cells, periodic, &[right]);
                x.iter().map(|(at, x)| Real::from(*x) * Real::from(random(left, *at) as f32 - 0.5)).sum()
            };
            let (ab, ba, aa) = (product(7, 8), product(8, 7), product(7, 7));
            assert!((ab - ba).abs() < 2e-5 * aa.abs(), "{cells:?}: {ab} {ba} {aa}");
            assert!(aa > 0.0);
        }
    }
}
