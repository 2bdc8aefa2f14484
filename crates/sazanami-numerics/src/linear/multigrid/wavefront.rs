//! Several dependent updates in one pass over memory.
//!
//! An update (stage) of plane `k` may use planes `k - 1`, `k` and `k + 1` of the stages before it.
//! The stages then follow each other through the planes at fixed lags, and while they do the planes
//! stay in cache. Inside a plane the rows are cut into tiles skewed back by the lag, for the
//! same reason. Threads take slabs of planes: a stage with lag `l` first leaves out `l` planes at
//! either side of a cut, and a second round does those. The order in which cells are updated
//! differs from doing stage after stage, but what every update reads does not: the result has the
//! same bits for any number of slabs and any tile.

use std::ops::Range;

use sazanami_parallel::join;

/// Planes of one array, cut from it for one thread.
pub(super) struct Planes<'a, T> {
    data: &'a mut [T],
    /// Place of `data[0]` in the whole array.
    origin: usize,
    /// Values in a plane.
    width: usize,
    /// Planes of cells per plane of this array: 2 for a coarser level.
    thickness: usize,
    /// Ghost planes below the first.
    ghosts: usize,
}

impl<'a, T> Planes<'a, T> {
    /// All planes of an array with one ghost plane at either end.
    pub(super) fn with_ghosts(data: &'a mut [T], width: usize, thickness: usize) -> Self {
        Self { data, origin: 0, width, thickness, ghosts: 1 }
    }

    /// One value per plane, without ghosts.
    pub(super) fn one_each(data: &'a mut [T]) -> Self {
        Self { data, origin: 0, width: 1, thickness: 1, ghosts: 0 }
    }

    fn halves(&mut self, plane: usize) -> (Planes<'_, T>, Planes<'_, T>) {
        let Self { origin, width, thickness, ghosts, .. } = *self;
        let at = (plane.div_ceil(thickness) + ghosts) * width;
        // An array that a pass does not use is empty.
        let (a, b) = self.data.split_at_mut((at - origin).min(self.data.len()));
        (Planes { data: a, origin, width, thickness, ghosts }, Planes { data: b, origin: at, width, thickness, ghosts })
    }

    /// `length` values from place `at` of the whole array on.
    #[inline(always)]
    pub(super) fn run(&self, at: usize, length: usize) -> &[T] {
        &self.data[at - self.origin..][..length]
    }

    /// `length` values from place `at` of the whole array on.
    #[inline(always)]
    pub(super) fn run_mut(&mut self, at: usize, length: usize) -> &mut [T] {
        &mut self.data[at - self.origin..][..length]
    }
}

/// The arrays a pass writes, cut at planes together, and sums kept per plane.
pub(super) struct Part<'a, const N: usize> {
    /// Arrays written.
    pub arrays: [Planes<'a, f32>; N],
    /// Sums of each plane.
    pub sums: Planes<'a, [f64; 4]>,
}

impl<const N: usize> Part<'_, N> {
    fn halves(&mut self, plane: usize) -> (Part<'_, N>, Part<'_, N>) {
        let mut lower: [Option<Planes<'_, f32>>; N] = [const { None }; N];
        let mut higher: [Option<Planes<'_, f32>>; N] = [const { None }; N];
        for (n, array) in self.arrays.iter_mut().enumerate() {
            let (a, b) = array.halves(plane);
            lower[n] = Some(a);
            higher[n] = Some(b);
        }
        let (a, b) = self.sums.halves(plane);
        let all = "every array was cut";
        (
            Part { arrays: lower.map(|p| p.expect(all)), sums: a },
            Part { arrays: higher.map(|p| p.expect(all)), sums: b },
        )
    }
}

/// Order of a pass over the planes and rows of a level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pass<'a> {
    /// Number of planes.
    pub planes: usize,
    /// Number of rows in a plane.
    pub rows: usize,
    /// Rows in a tile (even); as many as there are rows, or more: no tiles.
    pub tile: usize,
    /// Number of slabs.
    pub slabs: usize,
    /// Lag of each stage in planes and rows, not falling; a stage with lag 0 uses its own plane only.
    pub lags: &'a [usize],
}

impl Pass<'_> {
    /// Runs `stage(number, plane, rows, arrays)` for all stages, planes and rows.
    pub(super) fn run<const N: usize>(
        &self,
        part: &mut Part<'_, N>,
        stage: &(impl Fn(usize, usize, Range<usize>, &mut Part<'_, N>) + Sync),
    ) {
        self.slabs(part, 0..self.slabs, stage);
    }

    /// First plane of a slab: even, so that no pair of planes of a coarser level is cut.
    fn cut(&self, slab: usize) -> usize {
        if slab == self.slabs { self.planes } else { self.planes * slab / self.slabs / 2 * 2 }
    }

    fn slabs<const N: usize>(
        &self,
        part: &mut Part<'_, N>,
        slabs: Range<usize>,
        stage: &(impl Fn(usize, usize, Range<usize>, &mut Part<'_, N>) + Sync),
    ) {
        if slabs.len() == 1 {
            let below = |lag: usize| if slabs.start == 0 { 0 } else { lag };
            let above = |lag: usize| if slabs.end == self.slabs { 0 } else { lag };
            let (start, end) = (self.cut(slabs.start), self.cut(slabs.end));
            self.stages(part, |lag| start + below(lag)..end - above(lag), stage);
            return;
        }
        let middle = slabs.start + slabs.len() / 2;
        let plane = self.cut(middle);
        {
            let (mut a, mut b) = part.halves(plane);
            join(|| self.slabs(&mut a, slabs.start..middle, stage), || self.slabs(&mut b, middle..slabs.end, stage));
        }
        self.stages(part, |lag| plane - lag..plane + lag, stage);
    }

    /// Runs all stages over their planes (given by lag), following each other.
    fn stages<const N: usize>(
        &self,
        part: &mut Part<'_, N>,
        planes: impl Fn(usize) -> Range<usize>,
        stage: &(impl Fn(usize, usize, Range<usize>, &mut Part<'_, N>) + Sync),
    ) {
        let first = self.lags.iter().map(|&lag| planes(lag).start + lag).min().unwrap_or(0);
        let last = self.lags.iter().map(|&lag| planes(lag).end + lag).max().unwrap_or(0);
        let deepest = self.lags.last().copied().unwrap_or(0);
        let tiles = if self.tile >= self.rows { 1 } else { (self.rows + deepest).div_ceil(self.tile) };
        for tile in 0..tiles {
            for front in first..last {
                for (number, &lag) in self.lags.iter().enumerate() {
                    let Some(plane) = front.checked_sub(lag).filter(|plane| planes(lag).contains(plane)) else {
                        continue;
                    };
                    let rows = if tiles == 1 {
                        0..self.rows
                    } else {
                        (tile * self.tile).saturating_sub(lag)..((tile + 1) * self.tile - lag).min(self.rows)
                    };
                    if !rows.is_empty() {
                        stage(number, plane, rows, part);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: usize = 37;
    const PLANES: usize = 50;
    const STAGES: usize = 5;
    const WIDTH: usize = ROWS + 2;

    /// Relaxes every second value (by row, plane and stage) with its four neighbours, stage by stage.
    fn relaxed(pass: Option<Pass<'_>>) -> Vec<f32> {
        let mut x: Vec<f32> = (0..WIDTH * (PLANES + 2)).map(|n| (n as f32 * 0.37).sin()).collect();
        let mut sums = vec![[0.0; 4]; PLANES];
        let stage = |number: usize, plane: usize, rows: Range<usize>, part: &mut Part<'_, 1>| {
            for row in rows.filter(|row| (row + plane + number).is_multiple_of(2)) {
                let at = (plane + 1) * WIDTH + row + 1;
                let value = |at: usize| part.arrays[0].run(at, 1)[0];
                let mean = 0.3 * (value(at - 1) + value(at + 1)) + 0.2 * (value(at - WIDTH) + value(at + WIDTH));
                part.arrays[0].run_mut(at, 1)[0] = mean;
                if number + 1 == STAGES {
                    part.sums.run_mut(plane, 1)[0][0] += f64::from(mean);
                }
            }
        };
        let mut part = Part { arrays: [Planes::with_ghosts(&mut x, WIDTH, 1)], sums: Planes::one_each(&mut sums) };
        match pass {
            Some(pass) => pass.run(&mut part, &stage),
            None => {
                for number in 0..STAGES {
                    for plane in 0..PLANES {
                        stage(number, plane, 0..ROWS, &mut part);
                    }
                }
            }
        }
        x.extend(sums.iter().map(|sum| sum[0] as f32));
        x
    }

    #[test]
    fn stages_in_one_pass_give_the_bits_of_stage_after_stage() {
        let one_by_one = relaxed(None);
        for slabs in [1, 2, 3, 4] {
            for tile in [6, 8, 20, ROWS] {
                for lags in [[1, 2, 3, 4, 5], [1, 2, 3, 4, 6]] {
                    let pass = Pass { planes: PLANES, rows: ROWS, tile, slabs, lags: &lags };
                    assert!(relaxed(Some(pass)) == one_by_one, "{slabs} slabs, tiles of {tile} rows, lags {lags:?}");
                }
            }
        }
        // Negative control: without lags the stages meet neighbours that are not ready.
        let pass = Pass { planes: PLANES, rows: ROWS, tile: ROWS, slabs: 1, lags: &[0; STAGES] };
        assert!(relaxed(Some(pass)) != one_by_one);
    }
}
