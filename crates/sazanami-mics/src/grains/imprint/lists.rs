//! The cell lists of the grains, in the order in which sums over them are made.

use std::ops::Range;

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::{Field, GHOSTS};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk};

use super::{GROUP, Group, Share};

/// The cell lists of all grains, plane by plane.
#[derive(Clone, Copy)]
pub(super) struct Lists<'a> {
    pub groups: &'a [Group],
    pub touching: &'a [u32],
    pub planes: &'a [u32],
}

impl Lists<'_> {
    /// Sums `value(grain, share)` over the grains into the cells of the `covered` rows, plane by plane.
    pub fn sum(
        &self,
        domain: &Domain,
        covered: &[bool],
        into: [&mut Field<Real>; 3],
        value: impl Fn(usize, &Share) -> Vector + Sync,
    ) {
        let [plane, width] = [2, 1].map(|d| domain.strides()[d] as usize);
        let [_, n2, n3] = domain.cells();
        let interior = GHOSTS * plane..(GHOSTS + n3) * plane;
        let [a, b, c] = into.map(|field| Rows { data: &mut field.data_mut()[interior.clone()], width: plane });
        for_each_chunk((a, b, c), 1, |k, (a, b, c)| {
            let (a, b, c) = (a.data, b.data, c.data);
            let origin = (GHOSTS + k) * plane;
            for j in (0..n2).filter(|&j| covered[k * n2 + j]) {
                let row = (j + GHOSTS) * width..(j + GHOSTS + 1) * width;
                [&mut *a, b, c].into_iter().for_each(|sum| sum[row.clone()].fill(0.0));
            }
            self.for_each_share(k, origin..origin + plane, |n, _, shares| {
                for share in shares {
                    let (at, value) = (share.at as usize - origin, value(n, share));
                    a[at] += value.x;
                    b[at] += value.y;
                    c[at] += value.z;
                }
            });
        });
    }

    /// Calls `body` with the index, the volume \[m^3] and the shares of every grain that touches the cells of plane
    /// `k` at these `places`, in the order of their keys.
    pub fn for_each_share(&self, k: usize, places: Range<usize>, mut body: impl FnMut(usize, Real, &[Share])) {
        for n in self.touching[self.planes[k] as usize..self.planes[k + 1] as usize].iter().map(|&n| n as usize) {
            let group = &self.groups[n / GROUP];
            let shares = &group.shares[group.range(n % GROUP)];
            let [begin, end] =
                [places.start, places.end].map(|place| shares.partition_point(|s| (s.at as usize) < place));
            body(n, group.volumes[n % GROUP], &shares[begin..end]);
        }
    }
}
