//! Faces of cells that several grains share: what each covers of them.

use sazanami_numerics::Real;
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::{Field, GHOSTS};
use sazanami_parallel::{Rows, for_each_chunk};

use super::Imprint;
use super::lists::Lists;

impl Imprint {
    /// Counts the grains in the cells.
    pub(super) fn count_grains(&mut self, domain: &Domain) {
        let Self { groups, planes, grains_in, .. } = self;
        let lists = Lists { groups, planes };
        let plane = domain.strides()[2] as usize;
        let interior = GHOSTS * plane..(GHOSTS + domain.cells()[2]) * plane;
        let rows = Rows { data: &mut grains_in.data_mut()[interior], width: plane };
        for_each_chunk(rows, 1, |k, count| {
            let origin = (GHOSTS + k) * plane;
            count.data.fill(0.0);
            lists.for_each_share(k, |_, _, shares| {
                shares.iter().for_each(|share| count.data[share.at as usize - origin] += 1.0);
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

    /// Sums over the grains, on the lower faces in direction `d`, the part of the face that each covers, the volume that it carries through
    /// over the area of the face [m/s], and the part over its density [m^3/kg]: velocity and angular velocity of every grain and ghost are in
    /// `motion`.
    pub fn sum_sections(
        &self,
        domain: &Domain,
        d: usize,
        motion: &[[Real; 6]],
        density: impl Fn(usize) -> Real + Sync,
        into: [&mut Field<Real>; 3],
    ) {
        let Self { groups, planes, .. } = self;
        let lists = Lists { groups, planes };
        let plane = domain.strides()[2] as usize;
        let interior = GHOSTS * plane..(GHOSTS + domain.cells()[2]) * plane;
        let [closed, flux, light] = into;
        let [a, b, c] = [&mut *closed, &mut *flux, &mut *light]
            .map(|field| Rows { data: &mut field.data_mut()[interior.clone()], width: plane });
        for_each_chunk((a, b, c), 1, |k, (closed, flux, light)| {
            let origin = (GHOSTS + k) * plane;
            let (closed, flux, light) = (closed.data, flux.data, light.data);
            [&mut *closed, flux, light].into_iter().for_each(|sum| sum.fill(0.0));
            lists.for_each_section(k, |n, share, sections| {
                let [part, a, b] = sections[d].map(Real::from);
                let (at, [s, t]) = (share.at as usize - origin, [1, 2].map(|t| motion[n][3 + (d + t) % 3]));
                closed[at] += part;
                flux[at] += part * motion[n][d] + s * b - t * a;
                light[at] += part / density(n);
            });
        });
        let even = &GhostRules::EVEN;
        domain.fill_halos_to(1, &mut [(closed, even), (flux, even), (light, even)]);
    }
}
