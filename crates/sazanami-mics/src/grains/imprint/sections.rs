//! Faces of cells that several grains share: what each covers of them.

use std::collections::BTreeMap;

use sazanami_dem::{Grains, Motion};
use sazanami_numerics::Real;
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::geometry::FLUSH_FRACTION;
use sazanami_numerics::grid::{Field, GHOSTS};
use sazanami_parallel::{Rows, for_each_chunk};

use super::lists::{Lists, Sections};
use super::{GROUP, Imprint};
use crate::mobility::RowSet;

impl Imprint {
    /// Sums the wetted areas over the cell volume, and counts the grains in the cells. A free grain whose flat end lies on the cells of another shares
    /// them, since it may leave; blocks that are held on one another are as one.
    pub(super) fn sum_areas(&mut self, domain: &Domain, grains: &Grains) {
        let Self { groups, planes, area, grains_in, covered, has_area, .. } = self;
        let (lists, covered) = (Lists { groups, planes }, &*covered);
        let [plane, width] = [2, 1].map(|d| domain.strides()[d] as usize);
        let [_, n2, n3] = domain.cells();
        let interior = GHOSTS * plane..(GHOSTS + n3) * plane;
        let planes =
            [area, &mut *grains_in].map(|field| Rows { data: &mut field.data_mut()[interior.clone()], width: plane });
        for_each_chunk((planes, Rows { data: has_area, width: n2 }), 1, |k, (planes, has_area)| {
            let ([area, count], origin) = (planes.map(|plane| plane.data), (GHOSTS + k) * plane);
            for j in (0..n2).filter(|&j| has_area.data[j]) {
                let row = (j + GHOSTS) * width..(j + GHOSTS + 1) * width;
                [&mut *area, &mut *count].into_iter().for_each(|values| values[row.clone()].fill(0.0));
            }
            has_area.data.copy_from_slice(&covered[k * n2..(k + 1) * n2]);
            lists.for_each_share(k, |n, _, shares| {
                let least = if grains.motion[n] == Motion::Free { 0.0 } else { FLUSH_FRACTION };
                for share in shares {
                    let at = share.at as usize - origin;
                    area[at] += Real::from(share.wetted);
                    count[at] += if share.fraction > least { 1.0 } else { 0.0 };
                }
            });
        });
        let count = grains_in.data();
        let most = domain.max_rows(&domain.interior(), |row| {
            let is_covered = covered[row.k as usize * n2 + row.j as usize];
            let counts = if is_covered { &count[row.shifted(0)] } else { &[][..] };
            counts.iter().fold(0.0, |a: Real, &b| a.max(b))
        });
        self.is_shared = domain.max(most) > 1.0;
        domain.fill_halos_to(1, &mut [(grains_in, &GhostRules::EVEN)]);
    }

    /// The number of grains in each cell, by place in memory, if any cell holds more than one.
    pub fn shared(&self) -> Option<&[Real]> {
        self.is_shared.then(|| self.grains_in.data())
    }

    /// Sums over the grains, on the lower faces in each direction, the part of the face that each covers, the volume that it carries through
    /// over the area of the face [m/s], and the part times its `lightness`, 1 over its density [m^3/kg]: velocity and angular velocity of
    /// every grain and ghost are in `motion`. In the `rows` that grains cover and those beside them; elsewhere the fields mean nothing.
    pub(crate) fn sum_sections(
        &self,
        domain: &Domain,
        motion: &[[Real; 6]],
        lightness: impl Fn(usize) -> Real + Sync,
        rows: &RowSet,
        into: [&mut Field<Real>; 9],
    ) {
        self.sum_over_faces(domain, rows, into, |n| {
            let (motion, lightness) = (motion[n], lightness(n));
            move |sections: &Sections| {
                let [a, b, c] = [0, 1, 2].map(|d| {
                    let part = Real::from(sections[d][0]);
                    [part, carried(motion, sections, d), part * lightness]
                });
                [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
            }
        });
    }

    /// Sums what the grains carry through the lower faces alone, as in [`Self::sum_sections`] [m/s].
    pub(crate) fn sum_carried(
        &self,
        domain: &Domain,
        motion: &[[Real; 6]],
        rows: &RowSet,
        into: [&mut Field<Real>; 3],
    ) {
        self.sum_over_faces(domain, rows, into, |n| {
            let motion = motion[n];
            move |sections: &Sections| [0, 1, 2].map(|d| carried(motion, sections, d))
        });
    }

    /// What the `grains` carry through the faces normal to `direction` below the cells of this `local` index, over the area of a face [m/s], by the
    /// place in memory of the cell; faces that no grain covers are left out. Empty unless areas are asked for.
    #[must_use]
    pub fn carried_through(
        &self,
        domain: &Domain,
        grains: &Grains,
        direction: usize,
        local: isize,
    ) -> BTreeMap<usize, Real> {
        let [_, width, plane] = domain.strides().map(|stride| stride as usize);
        let index = |at: usize| [at % width, at % plane / width, at / plane][direction] as isize - GHOSTS as isize;
        let mut sums = BTreeMap::new();
        for n in self.order.iter().map(|&n| n as usize).filter(|_| self.with_areas) {
            let group = &self.groups[n / GROUP];
            let range = group.range(n % GROUP);
            let (v, w) = (grains.velocity[n], grains.angular_velocity(n));
            let motion = [v.x, v.y, v.z, w.x, w.y, w.z];
            for (share, sections) in group.shares[range.clone()].iter().zip(&group.sections[range]) {
                let at = share.at as usize;
                if index(at) == local && sections[direction][0] != 0.0 {
                    *sums.entry(at).or_insert(0.0) += carried(motion, sections, direction);
                }
            }
        }
        sums
    }

    /// Sums `of(grain)(sections)` over the grains in the cells of the `rows`, and fills the first ghost layer.
    fn sum_over_faces<const N: usize, V: Fn(&Sections) -> [Real; N]>(
        &self,
        domain: &Domain,
        rows: &RowSet,
        mut into: [&mut Field<Real>; N],
        of: impl Fn(usize) -> V + Sync,
    ) {
        let lists = Lists { groups: &self.groups, planes: &self.planes };
        let [plane, width] = [2, 1].map(|d| domain.strides()[d] as usize);
        let [_, n2, n3] = domain.cells();
        let interior = GHOSTS * plane..(GHOSTS + n3) * plane;
        let planes = into.each_mut().map(|field| Rows { data: &mut field.data_mut()[interior.clone()], width: plane });
        for_each_chunk(planes, 1, |k, planes| {
            let (mut sums, origin) = (planes.map(|plane| plane.data), (GHOSTS + k) * plane);
            for j in (0..n2).filter(|&j| rows.holds(j as isize, k as isize)) {
                let row = (j + GHOSTS) * width..(j + GHOSTS + 1) * width;
                sums.iter_mut().for_each(|sum| sum[row.clone()].fill(0.0));
            }
            lists.for_each_section(k, |n, shares, sections| {
                let of = of(n);
                for (share, sections) in shares.iter().zip(sections) {
                    let at = share.at as usize - origin;
                    sums.iter_mut().zip(of(sections)).for_each(|(sum, value)| sum[at] += value);
                }
            });
        });
        domain.fill_halos_to(1, &mut into.map(|field| (field, &GhostRules::EVEN)));
    }
}

/// The volume that a grain in `motion` carries through the lower face in direction `d` of a cell, over the area of the face [m/s].
#[inline]
fn carried(motion: [Real; 6], sections: &Sections, d: usize) -> Real {
    let ([part, a, b], [s, t]) = (sections[d].map(Real::from), [1, 2].map(|t| motion[3 + (d + t) % 3]));
    part * motion[d] + s * b - t * a
}
