//! Whole fields and lists on one rank, for files.

use super::Domain;
use crate::grid::Field;
use bytemuck::Pod;

const GATHER: u32 = 100;
const SCATTER: u32 = 101;
const LIST: u32 = 102;

impl Domain {
    /// The interior values of all ranks, `x1` fastest, on rank 0; empty on the others.
    pub fn gather<T: Pod>(&self, field: &Field<T>) -> Vec<T> {
        let mut mine = Vec::with_capacity(self.cells.iter().product());
        for k in 0..self.cells[2] as isize {
            for j in 0..self.cells[1] as isize {
                mine.extend_from_slice(field.row(j, k));
            }
        }
        if self.communicator.size() == 1 {
            return mine;
        }
        self.communicator.send(0, GATHER, bytemuck::cast_slice(&mine));
        if self.communicator.rank() != 0 {
            return Vec::new();
        }
        let mut all = vec![T::zeroed(); self.grid.len()];
        let mut bytes = Vec::new();
        for rank in 0..self.communicator.size() {
            self.communicator.receive(rank, GATHER, &mut bytes);
            let values: Vec<T> = bytemuck::pod_collect_to_vec(&bytes);
            for (line, values) in self.lines_of(rank).zip(values.chunks(self.decomposition.part(rank).1[0])) {
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
        if self.communicator.rank() == 0 {
            assert_eq!(all.len(), self.grid.len(), "one value per cell of the grid");
            let mut values = Vec::new();
            for rank in 0..self.communicator.size() {
                values.clear();
                let width = self.decomposition.part(rank).1[0];
                self.lines_of(rank).for_each(|line| values.extend_from_slice(&all[line..line + width]));
                self.communicator.send(rank, SCATTER, bytemuck::cast_slice(&values));
            }
        }
        let mut bytes = Vec::new();
        self.communicator.receive(0, SCATTER, &mut bytes);
        let values: Vec<T> = bytemuck::pod_collect_to_vec(&bytes);
        let mut rows = values.chunks(self.cells[0]);
        for k in 0..self.cells[2] as isize {
            for j in 0..self.cells[1] as isize {
                let start = field.at(0, j, k);
                if let Some(row) = rows.next() {
                    field.data_mut()[start..start + row.len()].copy_from_slice(row);
                }
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

    /// Places of the first cells of a rank's rows in the array of the whole grid.
    fn lines_of(&self, rank: usize) -> impl Iterator<Item = usize> + '_ {
        let (start, cells) = self.decomposition.part(rank);
        let [n1, n2, _] = self.grid.cells;
        (0..cells[2]).flat_map(move |k| (0..cells[1]).map(move |j| (k * n2 + j + start[1]) * n1 + start[0]))
    }
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
                domain.gather(&field)
            })
            .unwrap();
            assert_eq!(back[0], all);
        }
    }
}
