//! Volume fractions of the grains, covered centroids, and rigid velocities on the grid.
//!
//! Every grain keeps the list of the cells it covers. From these lists come, per cell, the solid
//! fraction alpha, the solid mass per volume and, when asked for, the volume-weighted rigid velocity. Where
//! grains overlap in a contact, alpha may exceed one: users of the fields scale it down there.

mod lists;
mod rigid;
mod sections;

use std::ops::Range;

use sazanami_dem::{Grains, Motion};
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::geometry::{CellCover, Rasteriser, Section, Shape, VolumeFractionMethod};
use sazanami_numerics::grid::{Field, GHOSTS};
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk};

use lists::{Lists, Part, Planes, Sections, cut};
use rigid::Rigid;

/// Grains in one group of cell lists: the unit of parallel work.
const GROUP: usize = 32;
/// Width in cells of the blocks that loops over grains follow: what such a loop reads in a block stays in the second cache.
const BLOCK: Real = 16.0;
/// Most values that are set for a grain together.
pub(super) const MOST: usize = 7;
/// Density of grains that are not free over their own or that of the liquid, whichever is larger, so that the projection does
/// not move them. Not more: within grains the pressure must follow that around them.
const RIGID: Real = 100.0;
/// A grain is imprinted anew when a point of it has moved by this part of the cell width.
pub(super) const STALE: Real = 1e-3;

/// The part of a grain in one cell.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    /// Volume fraction of the grain in the cell, before scaling where the sum exceeds one.
    pub fraction: Real,
    /// Place in memory of the cell.
    pub at: u32,
    arm: [f32; 3],
    /// Surface of the grain in the cell over the volume of the cell [1/m]; zero unless asked for.
    pub wetted: f32,
    foot: [f32; 3],
}

impl Share {
    /// From the grain's centre of mass to the covered part of the cell \[m].
    #[inline]
    #[must_use]
    pub fn arm(&self) -> Vector {
        Vector::new(self.arm[0].into(), self.arm[1].into(), self.arm[2].into())
    }

    /// From the grain's centre of mass to the surface in the cell \[m].
    #[inline]
    #[must_use]
    pub fn foot(&self) -> Vector {
        Vector::new(self.foot[0].into(), self.foot[1].into(), self.foot[2].into())
    }
}

/// The pose at which a grain was imprinted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Centre of mass \[m].
    pub position: Vector,
    /// Rotation from the body frame to the box.
    pub orientation: Quaternion,
}

impl Pose {
    /// Upper bound of the displacement of any point within `radius` \[m] of the centre to another pose \[m].
    pub(super) fn distance(&self, other: &Self, radius: Real) -> Real {
        let turn = self.orientation.dot(other.orientation).abs().min(1.0);
        // The chord of the turn: 2 sin(angle/2).
        let chord = 2.0 * (1.0 - turn * turn).sqrt();
        (self.position - other.position).length() + radius * chord
    }
}

/// Diagnostics of the volume fractions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImprintReport {
    /// Grains whose cell lists were evaluated anew.
    pub evaluated: usize,
    /// Solid volume in excess of one in cells whose solid fractions sum to more [m^3].
    pub overfull_volume: Real,
    /// Volume of grains outside the box, where they overlap walls in contact [m^3].
    pub outside_volume: Real,
}

/// The cell lists of up to [`GROUP`] grains that follow each other in the engine.
struct Group {
    rasteriser: Rasteriser,
    covers: Vec<CellCover>,
    shares: Vec<Share>,
    previous: Vec<Share>,
    /// What the shares cover of the faces of their cells; empty unless asked for.
    sections: Vec<Sections>,
    previous_sections: Vec<Sections>,
    ends: Vec<u32>,
    /// The shares of each member, cut at planes of cells, and the ends of these lists.
    parts: Vec<Part>,
    part_ends: Vec<u32>,
    poses: Vec<Pose>,
    volumes: Vec<Real>,
    outside: Vec<Real>,
    evaluated: usize,
}

/// Arguments common to all groups.
#[derive(Clone, Copy)]
struct Evaluation<'a> {
    domain: &'a Domain,
    grains: &'a Grains,
    shapes: &'a [Shape],
    with_areas: bool,
    /// Poses to use instead of the present ones.
    poses: Option<&'a [Pose]>,
}

/// Range of a list with these `ends` that belongs to `member`.
fn range_of(ends: &[u32], member: usize) -> Range<usize> {
    let start = if member == 0 { 0 } else { ends[member - 1] as usize };
    start..ends[member] as usize
}

impl Group {
    fn new(method: VolumeFractionMethod, with_areas: bool) -> Self {
        Self {
            rasteriser: Rasteriser::new(method).with_areas(with_areas),
            covers: Vec::new(),
            shares: Vec::new(),
            previous: Vec::new(),
            sections: Vec::new(),
            previous_sections: Vec::new(),
            ends: Vec::new(),
            parts: Vec::new(),
            part_ends: Vec::new(),
            poses: Vec::new(),
            volumes: Vec::new(),
            outside: Vec::new(),
            evaluated: 0,
        }
    }

    fn range(&self, member: usize) -> Range<usize> {
        range_of(&self.ends, member)
    }

    fn parts_of(&self, member: usize) -> &[Part] {
        &self.parts[range_of(&self.part_ends, member)]
    }

    /// Evaluates the members whose pose has changed; the lists of the others are kept.
    fn evaluate(&mut self, with: Evaluation, members: Range<usize>) {
        let known = self.poses.len() == members.len();
        let pose_of = |n: usize| match with.poses {
            Some(poses) => poses[n],
            None => Pose { position: with.grains.position[n], orientation: with.grains.orientation[n] },
        };
        let moved = |group: &Self, member: usize| !known || group.poses[member] != pose_of(members.start + member);
        self.evaluated = 0;
        if (0..members.len()).all(|member| !moved(self, member)) {
            return;
        }
        std::mem::swap(&mut self.shares, &mut self.previous);
        std::mem::swap(&mut self.sections, &mut self.previous_sections);
        self.shares.clear();
        self.sections.clear();
        if !known {
            self.ends.clear();
            self.ends.resize(members.len(), 0);
            self.poses.clear();
            self.poses.extend(members.clone().map(pose_of));
            self.volumes.resize(members.len(), 0.0);
            self.outside.resize(members.len(), 0.0);
        }
        let mut old_start = 0;
        for member in 0..members.len() {
            let old = old_start..self.ends[member] as usize;
            old_start = old.end;
            if moved(self, member) {
                self.poses[member] = pose_of(members.start + member);
                self.imprint(with, members.start + member, member);
            } else {
                if !self.previous_sections.is_empty() {
                    self.sections.extend_from_slice(&self.previous_sections[old.clone()]);
                }
                self.shares.extend_from_slice(&self.previous[old]);
            }
            self.ends[member] = self.shares.len() as u32;
        }
        self.cut(members.start, with.domain.strides()[2] as usize);
        if !known {
            // In reserve: grains that move may touch more cells.
            let reserve = self.shares.len() / 4 + 16;
            self.shares.reserve(reserve);
            let reserve = self.parts.len() / 4 + 16;
            self.parts.reserve(reserve);
            // Nothing of the earlier lists is needed any more. Exactly as much: the two take turns, and whatever one had more
            // than the other would be doubled whenever the entries change.
            self.previous.clear();
            self.previous.reserve_exact(self.shares.capacity());
            if !self.sections.is_empty() {
                self.sections.reserve(self.shares.capacity() - self.sections.len());
                self.previous_sections.clear();
                self.previous_sections.reserve_exact(self.sections.capacity());
            }
        }
    }

    /// Cuts the shares of the members, the `first` of which is this entry of the engine, at planes of `size` cells.
    fn cut(&mut self, first: usize, size: usize) {
        self.parts.clear();
        self.part_ends.clear();
        for member in 0..self.ends.len() {
            let range = self.range(member);
            cut(first + member, &self.shares[range.clone()], range.start, size, &mut self.parts);
            self.part_ends.push(self.parts.len() as u32);
        }
    }

    /// Appends the shares of grain `n`.
    fn imprint(&mut self, with: Evaluation, n: usize, member: usize) {
        let Evaluation { domain, grains, shapes, .. } = with;
        let (grid, start, cells) = (domain.grid(), domain.start(), domain.cells());
        let shape = &shapes[grains.shape[n] as usize];
        let pose = self.poses[member];
        self.covers.clear();
        self.rasteriser.imprint_scaled(shape, grains.scale[n], pose.position, pose.orientation, grid, &mut self.covers);
        self.evaluated += 1;
        self.volumes[member] = shape.volume() * grains.scale[n].powi(3);
        self.outside[member] = 0.0;
        let strides = domain.strides();
        for cover in &self.covers {
            let periodic = domain.periodic();
            let inside_box = (0..3).all(|d| periodic[d] || (0..grid.cells[d] as i32).contains(&cover.cell[d]));
            if !inside_box {
                self.outside[member] += cover.fraction * grid.cell_volume();
            }
            let local: [isize; 3] = std::array::from_fn(|d| cover.cell[d] as isize - start[d] as isize);
            if (0..3).all(|d| (0..cells[d] as isize).contains(&local[d])) {
                let at: isize = (0..3).map(|d| (local[d] + GHOSTS as isize) * strides[d]).sum();
                let arm = (cover.centroid - pose.position).as_vec3().to_array();
                let wetted = (cover.area / grid.cell_volume()) as f32;
                let foot = (cover.surface - pose.position).as_vec3().to_array();
                self.shares.push(Share { fraction: cover.fraction, at: at as u32, arm, wetted, foot });
                if with.with_areas {
                    self.sections.push([0, 1, 2].map(|d| {
                        let Section { part, moment: [a, b] } = cover.sections[d];
                        let [x, y] = [1, 2].map(|t| part * pose.position[(d + t) % 3]);
                        [part, a - x, b - y].map(|value| value as f32)
                    }));
                }
            }
        }
    }
}

/// The two vectors of six numbers.
pub(super) fn two(values: &[Real; 6]) -> [Vector; 2] {
    [0, 3].map(|first| Vector::from_slice(&values[first..first + 3]))
}

/// See [`Imprint::acting_density`].
fn acting_density(grains: &Grains, n: usize, volume: Real, (rigid, least): (Real, Real)) -> Real {
    match grains.motion[n] {
        Motion::Free => grains.mass[n] / volume,
        _ => (rigid * grains.mass[n] / volume).max(rigid * least),
    }
}

/// Volume fractions of the grains on the cells of a rank.
pub struct Imprint {
    method: VolumeFractionMethod,
    with_areas: bool,
    /// Density of grains that are not free over their own, and over what it is at least [kg/m^3].
    rigid: (Real, Real),
    groups: Vec<Group>,
    /// Identifier and image of every entry of the engine.
    keys: Vec<(u64, [i32; 3])>,
    /// Entries in the order of their keys: sums over them do not depend on the decomposition.
    order: Vec<u32>,
    /// Entries block by block of cells, and the place of each entry in this order.
    by_block: Vec<u32>,
    place: Vec<u32>,
    planes: Planes,
    overfull: Vec<Real>,
    covered: Vec<bool>,
    /// Rows that were covered when areas were last summed.
    has_area: Vec<bool>,
    rows: usize,
    /// Solid volume fraction alpha; above one where grains overlap.
    pub solid_fraction: Field<Real>,
    /// Solid mass per cell volume, sum of alpha_k rho_k [kg/m^3].
    pub solid_density: Field<Real>,
    /// Sum of alpha_k times the rigid velocity of grain k in the cell [m/s]: at the covered centroid, of a prescribed grain at the centre of the cell.
    pub solid_velocity: [Field<Real>; 3],
    /// Surface of the grains in each cell over its volume [1/m], if areas are asked for.
    pub(super) area: Field<Real>,
    /// Number of grains in each cell, if areas are asked for.
    grains_in: Field<Real>,
    /// Whether any cell on any rank holds more than one.
    is_shared: bool,
}

impl Imprint {
    /// Empty fields of `cells` cells (no cells if there are no grains).
    #[must_use]
    pub fn new(cells: [usize; 3], method: VolumeFractionMethod) -> Self {
        let [_, n2, n3] = cells;
        Self {
            method,
            with_areas: false,
            rigid: (1.0, 0.0),
            groups: Vec::new(),
            keys: Vec::new(),
            order: Vec::new(),
            by_block: Vec::new(),
            place: Vec::new(),
            planes: Planes::new(n3),
            overfull: vec![0.0; n3],
            covered: vec![false; n2 * n3],
            has_area: vec![false; n2 * n3],
            rows: n2,
            solid_fraction: Field::new(cells, 0.0),
            solid_density: Field::new(cells, 0.0),
            solid_velocity: std::array::from_fn(|_| Field::new(cells, 0.0)),
            area: Field::new([0; 3], 0.0),
            grains_in: Field::new([0; 3], 0.0),
            is_shared: false,
        }
    }

    /// The same; `with_areas` with the surface of the grains in each cell, and with grains that are not free a hundred times
    /// as heavy, or as the denser fluid of `densest` [kg/m^3] where that is more.
    #[must_use]
    pub fn with_areas(self, with_areas: bool, densest: Real) -> Self {
        let cells = if with_areas { self.solid_fraction.cells() } else { [0; 3] };
        let rigid = if with_areas { (RIGID, densest) } else { (1.0, 0.0) };
        Self { with_areas, rigid, area: Field::new(cells, 0.0), grains_in: Field::new(cells, 0.0), ..self }
    }

    /// The cells that grain `n` of the engine covers on this rank.
    #[inline]
    #[must_use]
    pub fn shares(&self, n: usize) -> &[Share] {
        let group = &self.groups[n / GROUP];
        &group.shares[group.range(n % GROUP)]
    }

    /// Whether the row of cells with local indices `j`, `k` holds any part of a grain.
    #[inline]
    #[must_use]
    pub fn row_is_covered(&self, j: isize, k: isize) -> bool {
        self.rows > 0 && self.covered[k as usize * self.rows + j as usize]
    }

    /// Evaluates the cell lists of the grains whose pose in `poses`, or without them whose present pose, is not
    /// that of the last time, and sums them into solid fraction and density.
    pub fn update(
        &mut self,
        domain: &Domain,
        grains: &Grains,
        shapes: &[Shape],
        poses: Option<&[Pose]>,
    ) -> ImprintReport {
        let count = grains.len();
        let keys = || (0..count).map(|n| (grains.id[n], grains.image(n)));
        // The engine changes the order of its entries only when it rebuilds its neighbour lists.
        if !keys().eq(self.keys.iter().copied()) {
            self.keys.clear();
            self.keys.extend(keys());
            self.order.clear();
            self.order.extend(0..count as u32);
            self.order.sort_unstable_by_key(|&n| self.keys[n as usize]);
            self.sort_by_block(domain, grains);
            self.groups.resize_with(count.div_ceil(GROUP), || Group::new(self.method, self.with_areas));
            self.groups.iter_mut().for_each(|group| group.poses.clear());
        }
        let with = Evaluation { domain, grains, shapes, with_areas: self.with_areas, poses };
        for_each_chunk(&mut self.groups[..], 1, |number, groups| {
            let first = number * GROUP;
            groups[0].evaluate(with, first..(first + GROUP).min(count));
        });
        self.planes.sort(&self.groups, &self.order);
        self.sum(domain, grains);
        if self.with_areas {
            self.sum_areas(domain, grains);
        }
        self.report(domain, grains.owned())
    }

    /// Sorts the entries by the block of cells that they are in.
    fn sort_by_block(&mut self, domain: &Domain, grains: &Grains) {
        let grid = domain.grid();
        let block_of = |&n: &u32| {
            let cell = (grains.position[n as usize] - grid.lower) / (BLOCK * grid.spacing);
            let [i, j, k] = cell.to_array().map(|index| index as i32);
            ([k, j, i], n)
        };
        self.by_block.clear();
        self.by_block.extend(0..grains.len() as u32);
        self.by_block.sort_unstable_by_key(block_of);
        self.place.clear();
        self.place.resize(grains.len(), 0);
        (0..).zip(&self.by_block).for_each(|(place, &n)| self.place[n as usize] = place);
    }

    /// Sets `values[n]` to `of(n)` for every entry of the engine, neighbours one after the other, so that the cells they share are still at
    /// hand; `by_block` is for storage.
    pub(super) fn set_by_block<const N: usize>(
        &self,
        values: &mut [[Real; N]],
        by_block: &mut Vec<[Real; MOST]>,
        of: impl Fn(usize) -> [Real; N] + Sync,
    ) {
        by_block.resize(values.len(), [0.0; MOST]);
        for_each_chunk(&mut by_block[..], 64, |number, part| {
            for (value, &n) in part.iter_mut().zip(&self.by_block[number * 64..]) {
                value[..N].copy_from_slice(&of(n as usize));
            }
        });
        let by_block = &*by_block;
        for_each_chunk(values, 1024, |number, part| {
            for (value, &place) in part.iter_mut().zip(&self.place[number * 1024..]) {
                value.copy_from_slice(&by_block[place as usize][..N]);
            }
        });
    }

    /// Diagnostics over all ranks; each grain counts on the rank that owns it.
    fn report(&self, domain: &Domain, owned: usize) -> ImprintReport {
        let evaluated: usize = self.groups.iter().map(|group| group.evaluated).sum();
        let excess: Real = self.overfull.iter().sum();
        let outside: Real = self.groups.iter().flat_map(|group| &group.outside).take(owned).sum();
        let [evaluated, excess, outside] = domain.sum([evaluated as Real, excess, outside]);
        ImprintReport {
            evaluated: evaluated as usize,
            overfull_volume: excess * domain.grid().cell_volume(),
            outside_volume: outside,
        }
    }

    /// Sums the shares into solid fraction and density, plane by plane; counts the overfull cells. The velocities
    /// of rows covered before become zero.
    fn sum(&mut self, domain: &Domain, grains: &Grains) {
        let [plane, width] = [2, 1].map(|d| domain.strides()[d] as usize);
        let [n1, n2, n3] = domain.cells();
        let interior = GHOSTS * plane..(GHOSTS + n3) * plane;
        let Self { groups, planes, solid_fraction, solid_density, solid_velocity, covered, overfull, .. } = self;
        let rigid = self.rigid;
        let lists = Lists { groups, planes };
        let [v1, v2, v3] = solid_velocity;
        let fields = [solid_fraction, solid_density, v1, v2, v3]
            .map(|field| Rows { data: &mut field.data_mut()[interior.clone()], width: plane });
        let [alpha, density, v1, v2, v3] = fields;
        let rows = Rows { data: covered, width: n2 };
        for_each_chunk((alpha, density, v1, v2, v3, rows, &mut overfull[..]), 1, |k, part| {
            let (alpha, density, v1, v2, v3) = (part.0.data, part.1.data, part.2.data, part.3.data, part.4.data);
            let (covered, overfull) = (part.5.data, part.6);
            let origin = (GHOSTS + k) * plane;
            for j in (0..n2).filter(|&j| covered[j]) {
                let row = (j + GHOSTS) * width..(j + GHOSTS + 1) * width;
                for field in [&mut *alpha, &mut *density, &mut *v1, &mut *v2, &mut *v3] {
                    field[row.clone()].fill(0.0);
                }
            }
            covered.fill(false);
            lists.for_each_share(k, |n, volume, shares| {
                let rho = acting_density(grains, n, volume, rigid);
                for share in shares {
                    let at = share.at as usize - origin;
                    alpha[at] += share.fraction;
                    density[at] += share.fraction * rho;
                    covered[at / width - GHOSTS] = true;
                }
            });
            overfull[0] = 0.0;
            for j in (0..n2).filter(|&j| covered[j]) {
                let start = (j + GHOSTS) * width + GHOSTS;
                for &alpha in alpha[start..start + n1].iter().filter(|&&alpha| alpha > 1.0) {
                    overfull[0] += alpha - 1.0;
                }
            }
        });
    }

    /// Fills the first ghost layer of all fields.
    pub fn fill_halos(&mut self, domain: &Domain) {
        let Self { solid_fraction, solid_density, solid_velocity: [v1, v2, v3], .. } = self;
        let fields = [solid_fraction, solid_density, v1, v2, v3];
        domain.fill_halos_to(1, &mut fields.map(|field| (field, &GhostRules::EVEN)));
    }

    /// Sums the rigid velocities into `solid_velocity`: velocity and angular velocity of every grain and ghost are in
    /// `motion`.
    pub fn sum_velocities(&mut self, domain: &Domain, grains: &Grains, motion: &[[Real; 6]]) {
        let Self { groups, planes, solid_velocity, covered, .. } = self;
        let (lists, rigid) = (Lists { groups, planes }, Rigid { domain, grains, groups, motion });
        lists.sum(domain, covered, solid_velocity.each_mut(), |n, share| rigid.share(n, share).to_array());
    }

    /// The same, and the wetted areas over the cell volume times the velocity of the surface [1/s] into `surface`.
    pub(super) fn sum_surfaces(
        &mut self,
        domain: &Domain,
        grains: &Grains,
        motion: &[[Real; 6]],
        surface: [&mut Field<Real>; 3],
    ) {
        let Self { groups, planes, solid_velocity: [v1, v2, v3], covered, .. } = self;
        let ([s1, s2, s3], rigid) = (surface, Rigid { domain, grains, groups, motion });
        Lists { groups, planes }.sum(domain, covered, [v1, v2, v3, s1, s2, s3], |n, share| {
            let (v, [velocity, spin]) = (rigid.share(n, share), two(&motion[n]));
            let s = Real::from(share.wetted) * (velocity + spin.cross(share.foot()));
            [v.x, v.y, v.z, s.x, s.y, s.z]
        });
    }

    /// Sums `value(grain, share)` over the grains in each cell into `into`.
    pub(super) fn sum_shares(
        &self,
        domain: &Domain,
        into: [&mut Field<Real>; 3],
        value: impl Fn(usize, &Share) -> Vector + Sync,
    ) {
        let Self { groups, planes, covered, .. } = self;
        Lists { groups, planes }.sum(domain, covered, into, |n, share| value(n, share).to_array());
    }

    /// The rigid velocities as in [`Self::sum_velocities`], `alpha_k density(k)` into the solid mass per cell volume, until the grains are
    /// imprinted again, and `value(grain, share, [area, alpha])` into `into`.
    pub(super) fn sum_bound(
        &mut self,
        domain: &Domain,
        (grains, motion): (&Grains, &[[Real; 6]]),
        density: impl Fn(usize) -> Real + Sync,
        into: [&mut Field<Real>; 3],
        value: impl Fn(usize, &Share, [&[Real]; 2]) -> Vector + Sync,
    ) {
        let Self { groups, planes, solid_velocity: [v1, v2, v3], solid_density, covered, area, solid_fraction, .. } =
            self;
        let (cover, [i1, i2, i3]) = ([area.data(), solid_fraction.data()], into);
        let rigid = Rigid { domain, grains, groups, motion };
        Lists { groups, planes }.sum(domain, covered, [v1, v2, v3, solid_density, i1, i2, i3], |n, share| {
            let (v, i) = (rigid.share(n, share), value(n, share, cover));
            [v.x, v.y, v.z, share.fraction * density(n), i.x, i.y, i.z]
        });
    }

    /// One over the density [m^3/kg] with which a grain of a volume [m^3] acts on the fluid.
    pub(super) fn lightness(&self, grains: &Grains, n: usize, volume: Real) -> Real {
        let (rigid, least) = self.rigid;
        match grains.motion[n] {
            Motion::Free => volume / grains.mass[n],
            _ => (volume / (rigid * grains.mass[n])).min((rigid * least).recip()),
        }
    }

    /// Density [kg/m^3] with which a grain of a volume [m^3] acts on the fluid: its own if it is free.
    pub(super) fn acting_density(&self, grains: &Grains, n: usize, volume: Real) -> Real {
        acting_density(grains, n, volume, self.rigid)
    }
}

#[cfg(test)]
mod tests {
    use sazanami_dem::{Body, Engine, Grain, Interactions, LinearSpringDashpot, Setup};
    use sazanami_numerics::geometry::{ContactSphereRule, VolumeRule};
    use sazanami_numerics::grid::Grid;

    use super::*;

    #[test]
    fn lists_take_no_more_memory_however_often_the_entries_change() {
        let domain = Domain::solo(Grid::new([8; 3], Vector::ZERO, Vector::ONE), [false; 3]);
        let shape = Shape::sphere(0.3, 2, VolumeRule::Preserve, &ContactSphereRule::Single).expect("a sphere");
        let setup = Setup {
            bodies: vec![Body::from(&shape)],
            interactions: Interactions::uniform(1, LinearSpringDashpot::SAND),
            walls: Vec::new(),
            region: [Vector::ZERO, Vector::ONE],
            ghost_margin: 0.1,
        };
        let grains: Vec<Grain> =
            (0..8u32).map(|n| Grain::new(n.into(), 1.0, Vector::splat(0.2 + 0.08 * Real::from(n)))).collect();
        let engine = Engine::new(&domain, setup, &grains).expect("grains");
        let mut imprint = Imprint::new([8; 3], VolumeFractionMethod::Clip);
        let capacities = |imprint: &Imprint| {
            let held = |group: &Group| group.shares.capacity() + group.previous.capacity() + group.parts.capacity();
            imprint.groups.iter().map(held).sum::<usize>()
        };
        imprint.update(&domain, engine.grains(), std::slice::from_ref(&shape), None);
        let first = capacities(&imprint);
        let needed: usize = imprint.groups.iter().map(|group| group.shares.len()).sum();
        assert!(needed > 0);
        for _ in 0..50 {
            // Other entries than the last time: all is evaluated anew.
            imprint.keys.clear();
            imprint.update(&domain, engine.grains(), std::slice::from_ref(&shape), None);
        }
        assert!(capacities(&imprint) <= 2 * first, "{} of {needed}, {first} at first", capacities(&imprint));
    }
}
