//! The cell lists of the grains, in the order in which sums over them are made.

use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::{Field, GHOSTS};
use sazanami_parallel::{Rows, for_each_chunk};

use super::{GROUP, Group, Share};

/// What a grain covers of the lower faces of a cell: a part, and its first moments in the next two directions from the grain's centre of
/// mass \[m].
pub(super) type Sections = [[f32; 3]; 3];

/// The shares of a grain in one plane of cells.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Part {
    /// Entry of the engine.
    grain: u32,
    plane: u32,
    /// The first of the shares in the list of its group, and the one after the last.
    begin: u32,
    end: u32,
}

/// Cuts the `shares` of entry `grain`, which begin at `begin` in the list of its group, at planes of `size` cells.
pub(super) fn cut(grain: usize, shares: &[Share], begin: usize, size: usize, parts: &mut Vec<Part>) {
    let planes = shares.chunk_by(|a, b| a.at as usize / size == b.at as usize / size);
    let mut begin = begin as u32;
    for shares in planes {
        let (plane, end) = (shares[0].at as usize / size - GHOSTS, begin + shares.len() as u32);
        parts.push(Part { grain: grain as u32, plane: plane as u32, begin, end });
        begin = end;
    }
}

/// The parts of all grains, plane by plane, within a plane in the order of the keys of the grains.
#[derive(Default)]
pub(super) struct Planes {
    parts: Vec<Part>,
    /// Offset of each plane.
    starts: Vec<u32>,
}

impl Planes {
    /// No parts of grains in `count` planes.
    pub fn new(count: usize) -> Self {
        Self { parts: Vec::new(), starts: vec![0; count + 1] }
    }

    /// Sorts the parts in `groups` of the grains in this `order`: a counting sort.
    pub fn sort(&mut self, groups: &[Group], order: &[u32]) {
        let Self { parts, starts } = self;
        starts.fill(0);
        groups.iter().flat_map(|group| &group.parts).for_each(|part| starts[part.plane as usize + 1] += 1);
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let total = starts.last().map_or(0, |&end| end as usize);
        if parts.len() < total {
            // In reserve: grains that move may touch more planes.
            parts.resize(total + total / 4 + 16, Part::default());
        }
        for part in order.iter().flat_map(|&n| groups[n as usize / GROUP].parts_of(n as usize % GROUP)) {
            let place = &mut starts[part.plane as usize];
            parts[*place as usize] = *part;
            *place += 1;
        }
        // Every start has moved to its end, which is the next start.
        let last = starts.len() - 1;
        starts.copy_within(0..last, 1);
        starts[0] = 0;
    }
}

/// The cell lists of all grains, plane by plane.
#[derive(Clone, Copy)]
pub(super) struct Lists<'a> {
    pub groups: &'a [Group],
    pub planes: &'a Planes,
}

impl Lists<'_> {
    /// Sums `value(grain, share)` over the grains into the cells of the `covered` rows, plane by plane.
    pub fn sum<const N: usize>(
        &self,
        domain: &Domain,
        covered: &[bool],
        into: [&mut Field<Real>; N],
        value: impl Fn(usize, &Share) -> [Real; N] + Sync,
    ) {
        let [plane, width] = [2, 1].map(|d| domain.strides()[d] as usize);
        let [_, n2, n3] = domain.cells();
        let interior = GHOSTS * plane..(GHOSTS + n3) * plane;
        let into = into.map(|field| Rows { data: &mut field.data_mut()[interior.clone()], width: plane });
        for_each_chunk(into, 1, |k, into| {
            let mut sums = into.map(|rows| rows.data);
            let origin = (GHOSTS + k) * plane;
            for j in (0..n2).filter(|&j| covered[k * n2 + j]) {
                let row = (j + GHOSTS) * width..(j + GHOSTS + 1) * width;
                sums.iter_mut().for_each(|sum| sum[row.clone()].fill(0.0));
            }
            self.for_each_share(k, |n, _, shares| {
                for share in shares {
                    let (at, values) = (share.at as usize - origin, value(n, share));
                    sums.iter_mut().zip(values).for_each(|(sum, value)| sum[at] += value);
                }
            });
        });
    }

    /// Calls `body` with the index, the shares and their sections of every grain that touches plane `k` of cells, in the order of their keys.
    pub fn for_each_section(&self, k: usize, mut body: impl FnMut(usize, &[Share], &[Sections])) {
        let Planes { parts, starts } = self.planes;
        for part in &parts[starts[k] as usize..starts[k + 1] as usize] {
            let (n, range) = (part.grain as usize, part.begin as usize..part.end as usize);
            let group = &self.groups[n / GROUP];
            body(n, &group.shares[range.clone()], &group.sections[range]);
        }
    }

    /// Calls `body` with the index, the volume \[m^3] and the shares of every grain that touches plane `k` of cells, in the
    /// order of their keys.
    pub fn for_each_share(&self, k: usize, mut body: impl FnMut(usize, Real, &[Share])) {
        let Planes { parts, starts } = self.planes;
        for part in &parts[starts[k] as usize..starts[k + 1] as usize] {
            let n = part.grain as usize;
            let group = &self.groups[n / GROUP];
            body(n, group.volumes[n % GROUP], &group.shares[part.begin as usize..part.end as usize]);
        }
    }
}
