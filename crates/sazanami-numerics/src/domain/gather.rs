//! Whole fields and lists on one rank, for files.

use std::ops::Range;

use super::Domain;
use crate::grid::Field;
use bytemuck::Pod;

const GATHER: u32 = 100;
const SCATTER: u32 = 101;
const LIST: u32 = 102;

impl Domain {
    /// The interior values of all ranks, `x1` fastest, on rank 0; empty on the others.
    pub fn gather<T: Pod>(&self, field: &Field<T>) -> Vec<T> {
        self.gather_within(&self.whole(), field)
    }

    /// The values of the cells of `region`, given by indices of the whole grid, `x1` fastest, on rank 0; empty on the
    /// others.
    pub fn gather_within<T: Pod>(&self, region: &Region, field: &Field<T>) -> Vec<T> {
        let part = self.overlap(self.communicator.rank(), region);
        let mut mine = Vec::with_capacity(count(&part));
        self.local_rows(&part, field, |row| mine.extend_from_slice(&field.data()[row]));
        if self.communicator.size() == 1 {
            return mine;
        }
        self.communicator.send(0, GATHER, bytemuck::cast_slice(&mine));
        if self.communicator.rank() != 0 {
            return Vec::new();
        }
        let mut all = vec![T::zeroed(); count(region)];
        let mut bytes = Vec::new();
        for rank in 0..self.communicator.size() {
            self.communicator.receive(rank, GATHER, &mut bytes);
            let part = self.overlap(rank, region);
            let values: Vec<T> = bytemuck::pod_collect_to_vec(&bytes);
            for (line, values) in lines(&part, region).zip(values.chunks(part[0].len().max(1))) {
                all[line..line + values.len()].copy_from_slice(values);
            }
        }
        all
    }

    /// The reverse of [`Self::gather`]: `all` is read on rank 0 only. Ghosts are not filled.
    ///
    /// # Panics
    /// If `all` has not one value per cell of the grid on rank 0.
    pub fn scatter<T: Pod>(&self, all: &[T], field: &mut Field<T>) {
        self.scatter_within(&self.whole(), all, field);
    }

    /// The reverse of [`Self::gather_within`]: `all` is read on rank 0 only; cells outside `region` keep their values.
    ///
    /// # Panics
    /// If `all` has not one value per cell of the region on rank 0.
    pub fn scatter_within<T: Pod>(&self, region: &Region, all: &[T], field: &mut Field<T>) {
        if self.communicator.rank() == 0 {
            assert_eq!(all.len(), count(region), "one value per cell of the region");
            let mut values = Vec::new();
            for rank in 0..self.communicator.size() {
                values.clear();
                let part = self.overlap(rank, region);
                lines(&part, region).for_each(|line| values.extend_from_slice(&all[line..line + part[0].len()]));
                self.communicator.send(rank, SCATTER, bytemuck::cast_slice(&values));
            }
        }
        let mut bytes = Vec::new();
        self.communicator.receive(0, SCATTER, &mut bytes);
        let values: Vec<T> = bytemuck::pod_collect_to_vec(&bytes);
        let part = self.overlap(self.communicator.rank(), region);
        let mut rows = values.chunks(part[0].len().max(1));
        let mut places = Vec::with_capacity(part[1].len() * part[2].len());
        self.local_rows(&part, field, |row| places.push(row));
        for (place, row) in places.into_iter().zip(&mut rows) {
            field.data_mut()[place].copy_from_slice(row);
        }
    }

    /// All cells of the grid.
    #[must_use]
    pub fn whole(&self) -> Region {
        self.grid.cells.map(|n| 0..n)
    }

    /// The cells of `region` that a rank has.
    fn overlap(&self, rank: usize, region: &Region) -> Region {
        let (start, cells) = self.decomposition.part(rank);
        std::array::from_fn(|d| {
            let (low, high) = (region[d].start.max(start[d]), region[d].end.min(start[d] + cells[d]));
            low..high.max(low)
        })
    }

    /// Calls `with` with the place in the data of `field` of each row of this rank's cells `part`.
    fn local_rows<T: Copy>(&self, part: &Region, field: &Field<T>, mut with: impl FnMut(Range<usize>)) {
        let local = |d: usize, at: usize| at as isize - self.start[d] as isize;
        if part[0].is_empty() {
            return;
        }
        for k in part[2].clone() {
            for j in part[1].clone() {
                let start = field.at(local(0, part[0].start), local(1, j), local(2, k));
                with(start..start + part[0].len());
            }
        }
    }

    /// The values of all ranks, in rank order, on rank 0; empty on the others.
    pub fn to_first<T: Pod>(&self, mine: &[T]) -> Vec<T> {
        let communicator = self.communicator();
        if communicator.rank() != 0 {
            communicator.send(0, LIST, bytemuck::cast_slice(mine));
            return Vec::new();
        }
        let mut all = mine.to_vec();
        let mut bytes = Vec::new();
        for rank in 1..communicator.size() {
            communicator.receive(rank, LIST, &mut bytes);
            all.extend(bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned::<T>));
        }
        all
    }

    /// The values of all ranks on rank 0, in the order of their identifiers; empty on the others.
    pub fn to_first_by<T: Pod>(&self, mine: impl IntoIterator<Item = T>, id: impl Fn(&T) -> u64) -> Vec<T> {
        let mut all = self.to_first(&mine.into_iter().collect::<Vec<T>>());
        all.sort_unstable_by_key(id);
        all
    }

    /// The values of rank 0 on every rank.
    pub fn from_first<T: Pod>(&self, values: Vec<T>) -> Vec<T> {
        let communicator = self.communicator();
        if communicator.size() == 1 {
            return values;
        }
        let mut bytes = if communicator.rank() == 0 { bytemuck::cast_slice(&values).to_vec() } else { Vec::new() };
        communicator.broadcast(&mut bytes);
        if communicator.rank() == 0 {
            return values;
        }
        bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
    }
}

/// Ranges of cells of the whole grid in each direction.
pub type Region = [Range<usize>; 3];

/// Number of cells of a region.
fn count(region: &Region) -> usize {
    region.iter().map(Range::len).product()
}

/// Places of the first cells of the rows of `part` in the array of `region`, which holds it.
fn lines(part: &Region, region: &Region) -> impl Iterator<Item = usize> {
    let [at, of] = [part, region].map(Clone::clone);
    let rows = if at[0].is_empty() { 0..0 } else { at[2].clone() };
    let [n1, n2] = [of[0].len(), of[1].len()];
    rows.flat_map(move |k| {
        let (at, of) = (at.clone(), of.clone());
        at[1].clone().map(move |j| ((k - of[2].start) * n2 + j - of[1].start) * n1 + at[0].start - of[0].start)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vector;
    use crate::grid::Grid;
    use sazanami_parallel::run_ranks;

    #[test]
    fn scatter_then_gather_gives_the_same_values() {
        let all: Vec<f64> = (0..12 * 8 * 3).map(f64::from).collect();
        for ranks in [1, 2, 6] {
            let back = run_ranks(ranks, 1, |c| {
                let grid = Grid::new([12, 8, 3], Vector::ZERO, Vector::ONE);
                let domain = Domain::new(grid, [false; 3], c).unwrap();
                let mut field = domain.field(0.0);
                domain.scatter(&all, &mut field);
                let region = [11..12, 1..8, 0..3];
                let layer = domain.gather_within(&region, &field);
                let whole = domain.gather(&field);
                // What is written back into a part leaves the rest as it is.
                let other: Vec<f64> = layer.iter().map(|value| -value).collect();
                domain.scatter_within(&region, &other, &mut field);
                (whole, layer, domain.gather(&field))
            })
            .unwrap();
            let (whole, layer, changed) = &back[0];
            assert_eq!(*whole, all);
            let at = |n: usize| ((n / 7) * 8 + n % 7 + 1) * 12 + 11;
            assert!(layer.len() == 21 && layer.iter().enumerate().all(|(n, value)| *value == all[at(n)]));
            let differ = (0..all.len()).filter(|&n| changed[n] != all[n]).collect::<Vec<_>>();
            assert_eq!(differ, (0..21).map(at).collect::<Vec<_>>());
        }
    }
}
