//! Faces of cells that several grains share: what each covers of them.

use sazanami_numerics::Real;
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::{Field, GHOSTS};
use sazanami_parallel::{Rows, for_each_chunk};

use super::Imprint;
use super::lists::Lists;

impl Imprint {
    /// Sums the wetted areas over the cell volume, and counts the grains in the cells.
    pub(super) fn sum_areas(&mut self, domain: &Domain) {
        let Self { groups, planes, area, grains_in, .. } = self;
        let lists = Lists { groups, planes };
        let plane = domain.strides()[2] as usize;
        let interior = GHOSTS * plane..(GHOSTS + domain.cells()[2]) * plane;
        let rows =
            [area, &mut *grains_in].map(|field| Rows { data: &mut field.data_mut()[interior.clone()], width: plane });
        for_each_chunk(rows, 1, |k, rows| {
            let ([area, count], origin) = (rows.map(|rows| rows.data), (GHOSTS + k) * plane);
            area.fill(0.0);
            count.fill(0.0);
            lists.for_each_share(k, |_, _, shares| {
                for share in shares {
                    let at = share.at as usize - origin;
                    area[at] += Real::from(share.wetted);
                    count[at] += 1.0;
                }
            });
        });
        let count = grains_in.data();
        let most =
            domain.max_rows(&domain.interior(), |row| count[row.shifted(0)].iter().fold(0.0, |a: Real, &b| a.max(b)));
        self.is_shared = domain.max(most) > 1.0;
        domain.fill_halos_to(1, &mut [(grains_in, &GhostRules::EVEN)]);
    }

    /// The number of grains in each cell, by place in memory, if any cell holds more than one.
    pub fn shared(&self) -> Option<&[Real]> {
        self.is_shared.then(|| self.grains_in.data())
    }

    /// Sums over the grains, on the lower faces in each direction, the part of the face that each covers, the volume that it carries through
    /// over the area of the face [m/s], and the part times its `lightness`, 1 over its density [m^3/kg]: velocity and angular velocity of
    /// every grain and ghost are in `motion`.
    pub fn sum_sections(
        &self,
        domain: &Domain,
        motion: &[[Real; 6]],
        lightness: impl Fn(usize) -> Real + Sync,
        into: &mut [Field<Real>; 9],
    ) {
        let Self { groups, planes, .. } = self;
        let lists = Lists { groups, planes };
        let plane = domain.strides()[2] as usize;
        let interior = GHOSTS * plane..(GHOSTS + domain.cells()[2]) * plane;
        let rows = into.each_mut().map(|field| Rows { data: &mut field.data_mut()[interior.clone()], width: plane });
        for_each_chunk(rows, 1, |k, rows| {
            let (mut sums, origin) = (rows.map(|rows| rows.data), (GHOSTS + k) * plane);
            sums.iter_mut().for_each(|sum| sum.fill(0.0));
            lists.for_each_section(k, |n, share, sections| {
                let (at, motion, lightness) = (share.at as usize - origin, &motion[n], lightness(n));
                for (d, section) in sections.iter().enumerate() {
                    let ([part, a, b], [s, t]) = (section.map(Real::from), [1, 2].map(|t| motion[3 + (d + t) % 3]));
                    sums[3 * d][at] += part;
                    sums[3 * d + 1][at] += part * motion[d] + s * b - t * a;
                    sums[3 * d + 2][at] += part * lightness;
                }
            });
        });
        domain.fill_halos_to(1, &mut into.each_mut().map(|field| (field, &GhostRules::EVEN)));
    }
}
