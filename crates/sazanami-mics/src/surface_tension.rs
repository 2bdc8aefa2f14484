//! Surface tension, in balance with the pressure gradient.
//!
//! With the curvature kappa of the interface, positive where the liquid is convex, the pressure jumps across a face by
//!
//! ```text
//! T_f = sigma kappa_f (C_R - C_L)
//! ```
//!
//! and wherever the step has the difference `p_R - p_L` of the pressures beside a face it has `p_R - p_L - T_f`: in the velocities of
//! the faces, in those of the cells, in the stress on grains. A drop whose curvature is the same everywhere is thus at rest to
//! rounding whatever its shape on the grid, with a pressure that jumps by sigma kappa. Continuum surface force: Brackbill, Kothe and
//! Zemach (1992), J. Comput. Phys. 100, 335; balance: Francois et al. (2006), J. Comput. Phys. 213, 141, and Popinet (2009), J. Comput.
//! Phys. 228, 5838.
//!
//! On a face kappa is the mean of the cells beside it that have an interface; that of cells where heights fail has a weight of C (1 - C). The
//! interface meets walls at their contact angles, 90 degrees where none is given: it goes on behind them at that angle, and the pull of the
//! walls is in the curvature beside them. Wide grains have an angle too, at which the liquid is continued into them
//! (`surface_tension/grains.rs`); the line of contact pulls at them. Through narrow ones the liquid fraction goes on in the covered part as
//! the transport has it there, and the interface with it. Such grains get their part of the jump with that of the pressure, the pull of the line
//! in which the interface meets them included; between cells that grains cover whole there is none. An entry pressure takes the place of
//! the curvature in beds of narrow grains (`surface_tension/pores.rs`).

mod columns;
mod curvature;
mod fit;
mod grains;
mod heights;
mod pins;
mod pores;

use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::{Field, Grid};
use sazanami_numerics::{Real, Vector};

use crate::boundary::Boundary;
use crate::flow::Flow;
use crate::fluids::Fluids;
use crate::interface::Plane;
use crate::mobility::{Mobility, RowSet};
use curvature::{CurvatureSource, Surroundings, largest_curvature};
pub use grains::WIDE;
use grains::{Continued, TELLS, around, moved};
use heights::Heights;
use pores::Pores;
pub use pores::entry_rate;

/// Curvature of a cell without one [1/m].
const NONE: Real = Real::MAX;
/// Curvature of a cell with an interface whose curvature cannot be told [1/m].
const UNKNOWN: Real = Real::INFINITY;

/// Least weight of a curvature by a fit. That of a cell which the interface hardly touches is known least: C (1 - C).
const LEAST_WEIGHT: Real = 1e-3;

/// Solid fraction from which on a cell counts as covered whole, as for its friction.
const COVERED: Real = 0.99;

/// Where the curvature of the interface comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curvature {
    /// From the liquid fractions.
    Found,
    /// It is this everywhere [1/m]: a test of the balance of forces.
    Given(Real),
}

/// Diagnostics of the surface tension in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceTensionReport {
    /// Cells whose curvature came from heights in columns, summed over the passes.
    pub by_columns: u64,
    /// Cells whose curvature came from the paraboloid nearest to heights or planes.
    pub by_fit: u64,
    /// Cells by a fit whose curvature was larger than that of a sphere of a cell's radius, which it was set to.
    pub limited: u64,
    /// Cells with an interface whose curvature could not be told; the faces beside them take that of the other side.
    pub unknown: u64,
    /// Impulse on the fluid over all ranks [N s]: zero but for the error of the curvature, and where the interface ends at walls.
    pub impulse: Vector,
}

impl std::ops::AddAssign for SurfaceTensionReport {
    fn add_assign(&mut self, other: Self) {
        self.by_columns += other.by_columns;
        self.by_fit += other.by_fit;
        self.limited += other.limited;
        self.unknown += other.unknown;
        self.impulse += other.impulse;
    }
}

/// Curvature of the interface in the cells.
struct Curvatures {
    /// The curvature [1/m].
    kappa: Field<Real>,
    /// Its weight on the faces of the cell: 1 from columns, less from a fit, 0 where there is none.
    weight: Field<f32>,
    /// Both, as they become where grains have an angle.
    beside_grains: Option<(Field<Real>, Field<f32>)>,
}

impl Curvatures {
    fn new(domain: &Domain) -> Self {
        Self { kappa: domain.field(NONE), weight: domain.field(0.0), beside_grains: None }
    }

    /// Finds that of each cell from what is around it, but in those that grains that it is continued into cover whole.
    fn find(&mut self, domain: &Domain, around: &Surroundings<'_>, continued: Option<&Continued>) {
        let (c, covers) = (around.c, continued.map(Continued::covers));
        let fields = (self.kappa.data_mut(), self.weight.data_mut());
        domain.for_each_row(&domain.interior(), fields, |row, (kappa, weight)| {
            for ((kappa, weight), at) in kappa.iter_mut().zip(weight).zip(row.shifted(0)) {
                let is_inside = covers.is_some_and(|alpha| alpha[at] >= COVERED);
                (*kappa, *weight) = if is_inside || !around.has_interface(at) {
                    (NONE, 0.0)
                } else if let Some((kappa, found)) = around.curvature(at) {
                    let by_fit = (c[at] * (1.0 - c[at])).max(LEAST_WEIGHT) as f32;
                    (kappa, if found == CurvatureSource::Columns { 1.0 } else { by_fit })
                } else {
                    (UNKNOWN, 0.0)
                };
            }
        });
        self.fill_halos(domain);
        if let Some(continued) = continued {
            self.extend(domain, continued);
        }
    }

    fn fill_halos(&mut self, domain: &Domain) {
        domain.fill_halos_to(1, &mut [(&mut self.kappa, &GhostRules::EVEN)]);
        domain.fill_halos_to(1, &mut [(&mut self.weight, &GhostRules::EVEN)]);
    }

    /// Gives cells that grains cover by more than half the mean of the curvatures around them, with the least weight:
    /// what is continued into the grains has none of its own, and gas would be driven round the line of contact by the difference. Without a
    /// curvature around they keep theirs.
    fn extend(&mut self, domain: &Domain, continued: &Continued) {
        let (alpha, rows) = (continued.covers(), continued.rows());
        let Self { kappa, weight, beside_grains } = self;
        let (next, next_weight) = beside_grains.get_or_insert_with(|| (domain.field(NONE), domain.field(0.0)));
        let (own, weights, strides) = (kappa.data(), weight.data(), domain.strides());
        let tells = |at: usize| 1.0 - alpha[at] >= TELLS && own[at].abs() < NONE;
        let mean = |at: usize| {
            let (sum, all) = around(strides).fold((0.0, 0.0), |(sum, all), (x, by)| {
                let beside = moved(at, by);
                let w = if tells(beside) { Real::from(weights[beside]) / x.length_squared() } else { 0.0 };
                (if w > 0.0 { sum + w * own[beside] } else { sum }, all + w)
            });
            (all > 0.0).then(|| (sum / all, LEAST_WEIGHT as f32))
        };
        let fields = (next.data_mut(), next_weight.data_mut());
        domain.for_each_row(&domain.interior(), fields, |row, (next, next_weight)| {
            if !rows.holds(row.j, row.k) {
                return;
            }
            for ((next, next_weight), at) in next.iter_mut().zip(next_weight).zip(row.shifted(0)) {
                let is_cut = own[at] != NONE && 1.0 - alpha[at] < TELLS;
                let found = if is_cut { mean(at) } else { None };
                (*next, *next_weight) = found.unwrap_or((own[at], weights[at]));
            }
        });
        domain.for_each_row(&domain.interior(), (kappa.data_mut(), weight.data_mut()), |row, (kappa, weight)| {
            if rows.holds(row.j, row.k) {
                kappa.copy_from_slice(&next.data()[row.shifted(0)]);
                weight.copy_from_slice(&next_weight.data()[row.shifted(0)]);
            }
        });
        self.fill_halos(domain);
    }
}

/// Sides of the box that are neither walls nor periodic let the interface out: the jump there is that of what stands outside.
struct Ends {
    sides: [[bool; 2]; 3],
    /// Index of the last face in each direction.
    last: [isize; 3],
}

impl Ends {
    fn of(domain: &Domain) -> Self {
        let sides = [0, 1, 2].map(|d| [0, 1].map(|side| domain.at_box_end(d, side) && !domain.periodic()[d]));
        Self { sides, last: domain.cells().map(|n| n as isize) }
    }

    /// Whether the faces of this index normal to a direction lie on one.
    #[inline]
    fn hold(&self, direction: usize, index: isize) -> bool {
        let [lower, upper] = self.sides[direction];
        (lower && index == 0) || (upper && index == self.last[direction])
    }
}

/// Surface tension on one rank.
pub struct SurfaceTension {
    coefficient: Real,
    of: Curvature,
    heights: Heights,
    /// The liquid in grains that have a contact angle, if there is one.
    continued: Option<Continued>,
    /// The pores of an entry pressure, if there is one.
    pores: Option<Pores>,
    /// One ghost layer filled.
    found: Curvatures,
    /// Jump of the pressure across the lower faces \[Pa].
    jump: [Field<Real>; 3],
    /// Rows with an interface, and with the rows beside them: those of faces with a jump.
    rows: [RowSet; 2],
    ends: Ends,
    report: SurfaceTensionReport,
}

impl SurfaceTension {
    /// A surface tension of `coefficient` [N/m]; no jump before it is first found.
    #[must_use]
    pub fn new(domain: &Domain, boundary: &Boundary, coefficient: Real, of: Curvature) -> Self {
        Self {
            coefficient,
            of,
            heights: Heights::new(domain, boundary),
            continued: None,
            pores: None,
            found: Curvatures::new(domain),
            jump: std::array::from_fn(|_| domain.field(0.0)),
            rows: Default::default(),
            ends: Ends::of(domain),
            report: SurfaceTensionReport::default(),
        }
    }

    /// Gives grains of [`WIDE`] cells and more, if they act by their surfaces, the angle in the liquid at which the interface meets them
    /// \[rad], between 0 and pi.
    #[must_use]
    pub fn with_angle_on_grains(self, domain: &Domain, boundary: &Boundary, angle: Real) -> Self {
        Self { continued: Some(Continued::new(domain, boundary, angle)), ..self }
    }

    /// Gives beds of grains narrower than [`WIDE`] cells, if they act by their surfaces, pores in which the pressure of the gas exceeds that of the
    /// liquid by the entry `pressure` \[Pa], whatever the curvature.
    #[must_use]
    pub fn with_entry_pressure(self, domain: &Domain, pressure: Real) -> Self {
        Self { pores: Some(Pores::new(domain, pressure)), ..self }
    }

    /// Surface tension [N/m].
    #[must_use]
    pub fn coefficient(&self) -> Real {
        self.coefficient
    }

    /// Jump of the pressure across the lower faces in each direction \[Pa].
    #[must_use]
    pub fn jump(&self) -> &[Field<Real>; 3] {
        &self.jump
    }

    /// The same for writing, at a restart; [`Self::jump_is_set`] follows.
    pub(crate) fn jump_mut(&mut self) -> &mut [Field<Real>; 3] {
        &mut self.jump
    }

    /// Where lines of contact with two angles stand, for a restart: see `heights.rs`.
    pub(crate) fn heights(&self) -> &Heights {
        &self.heights
    }

    /// The same for writing.
    pub(crate) fn heights_mut(&mut self) -> &mut Heights {
        &mut self.heights
    }

    /// Takes note of the rows of faces with a jump, after it was written.
    pub(crate) fn jump_is_set(&mut self, domain: &Domain) {
        let [_, n2, n3] = domain.cells();
        let jump = self.jump.each_ref();
        let inside = |n: isize, last: usize| (0..=last as isize).contains(&n);
        self.rows[1].mark([n2, n3], |j, k| {
            inside(j, n2)
                && inside(k, n3)
                && (0..3).any(|d| {
                    let range = domain.faces(d);
                    let start = jump[d].at(0, j, k);
                    range[1].contains(&j)
                        && range[2].contains(&k)
                        && jump[d].data()[start..start + range[0].len()].iter().any(|&t| t != 0.0)
                })
        });
    }

    /// Curvature of the interface in the cell at a place in memory [1/m], as it was last found; `None` where there is none.
    #[must_use]
    pub fn curvature(&self, at: usize) -> Option<Real> {
        let kappa = self.found.kappa.data()[at];
        (kappa.abs() < NONE).then_some(kappa)
    }

    /// Reciprocal of the longest stable step [1/s]: the shortest capillary wave on the grid, of two cells, must not cross a cell in a step
    /// (Brackbill et al. 1992; `dt < sqrt((rho_l + rho_g) dx^3 / (4 pi sigma))`), nor one that an entry pressure drives ([`entry_rate`]).
    #[must_use]
    pub fn rate(&self, domain: &Domain, fluids: &Fluids) -> Real {
        let grid = domain.grid();
        let of_pores = self.pores.as_ref().map_or(0.0, |pores| entry_rate(pores.pressure(), fluids, grid));
        capillary_rate(self.coefficient, fluids, grid).max(of_pores)
    }

    /// Finds curvature and jump of the liquid in `flow`, ghosts of the liquid fraction filled; within what grains cover whole there is no
    /// jump: `solid` is the solid fraction, one ghost layer filled, if there are grains. Collective.
    pub fn find(&mut self, domain: &Domain, flow: &Flow, solid: Option<&[Real]>) {
        if let Some(continued) = &mut self.continued {
            continued.find(domain, &flow.volume_fraction);
        }
        let liquid = self.continued.as_ref().map_or(&flow.volume_fraction, Continued::liquid);
        let (c, strides) = (liquid.data(), domain.strides());
        let [_, n2, n3] = domain.cells();
        match self.of {
            Curvature::Given(kappa) => self.found.kappa.fill(kappa),
            // An entry pressure alone needs none.
            Curvature::Found if self.coefficient == 0.0 => {}
            Curvature::Found => {
                self.heights.find(domain, liquid);
                let around = Surroundings::new(domain, c, &self.heights);
                self.found.find(domain, &around, self.continued.as_ref());
            }
        }
        if let Some(pores) = &mut self.pores {
            pores.find(domain, c, &self.ends);
        }
        let (kappa, pores) = (&self.found.kappa, self.pores.as_ref());
        let [with, beside] = &mut self.rows;
        with.mark([n2, n3], |j, k| {
            let start = kappa.at(-1, j, k);
            kappa.data()[start..start + domain.cells()[0] + 2].iter().any(|&kappa| kappa != NONE)
                || pores.is_some_and(|pores| pores.hold_row(j, k))
        });
        beside.and_beside(domain, with);
        let (kappa, weight) = (kappa.data(), self.found.weight.data());
        for (d, jump) in self.jump.iter_mut().enumerate() {
            let behind = strides[d] as usize;
            let of_pores = pores.map(|pores| (pores, pores.jump()[d].data()));
            domain.for_each_row(&domain.faces(d), jump.data_mut(), |row, jump| {
                if !beside.holds(row.j, row.k) {
                    return jump.fill(0.0);
                }
                for (i, (jump, at)) in jump.iter_mut().zip(row.shifted(0)).enumerate() {
                    let index = [row.first + i as isize, row.j, row.k][d];
                    let difference = c[at] - c[at - behind];
                    let is_end = self.ends.hold(d, index);
                    let is_inside = solid.is_some_and(|alpha| alpha[at - behind].min(alpha[at]) >= COVERED);
                    let curved = if difference == 0.0 || is_end || is_inside {
                        0.0
                    } else {
                        self.coefficient
                            * difference
                            * on_face([kappa[at - behind], kappa[at]], [weight[at - behind], weight[at]])
                    };
                    *jump =
                        of_pores.map_or(curved, |(pores, entry)| (1.0 - pores.share(at, behind)) * curved + entry[at]);
                }
            });
        }
        self.count(domain);
    }

    /// Takes note of the grains that have a contact angle, if there is one: `sum` adds their solid fraction and surface over the volume of
    /// the cells [1/m] to the first two of three fields of zeros. Collective.
    pub(crate) fn place_grains(&mut self, domain: &Domain, sum: impl FnOnce([&mut Field<Real>; 3])) {
        if let Some(continued) = &mut self.continued {
            continued.place(domain, sum);
        }
    }

    /// Takes note of the grains between which an entry pressure acts, if there is one: `sum` adds their solid fraction to the first of three
    /// fields of zeros. Collective.
    pub(crate) fn place_narrow_grains(&mut self, domain: &Domain, sum: impl FnOnce([&mut Field<Real>; 3])) {
        if let Some(pores) = &mut self.pores {
            pores.place(domain, sum);
        }
    }

    /// Gives grains that have a contact angle the pull of the line of contact over `dt` \[s], on their surface in each cell, instead of
    /// half of the jump across each face times the part of the cell that is not `open`: impulses per volume [N s/m^3]. Half whatever the
    /// densities, by which the cells got it: the line of contact would stand in the liquid otherwise, by a third of a cell. Returns the impulse over
    /// all ranks [N s]. Collective.
    pub(crate) fn pull_grains(
        &self,
        domain: &Domain,
        open: &[Real],
        dt: Real,
        [on_surface, given]: [[&mut Field<Real>; 3]; 2],
    ) -> Vector {
        let Some(continued) = &self.continued else { return Vector::ZERO };
        let pulled = continued.add_pull(domain, self.coefficient, dt, on_surface);
        let (strides, half) = (domain.strides(), 0.5 * dt / domain.grid().spacing);
        let of = |d: usize, at: usize| {
            let jump = self.jump[d].data();
            let of_pores = self.pores.as_ref().map(|pores| pores.jump()[d].data());
            let curved = |at: usize| jump[at] - of_pores.map_or(0.0, |entry| entry[at]);
            let covered = if continued.holds_grain(at) { 1.0 - open[at] } else { 0.0 };
            covered * half[d] * (curved(at) + curved(at + strides[d] as usize))
        };
        let [g1, g2, g3] = given.map(Field::data_mut);
        domain.for_each_row(&domain.interior(), (g1, g2, g3), |row, (g1, g2, g3)| {
            if self.rows[1].holds(row.j, row.k) {
                for (d, given) in [g1, g2, g3].into_iter().enumerate() {
                    given.iter_mut().zip(row.shifted(0)).for_each(|(given, at)| *given -= of(d, at));
                }
            }
        });
        let taken = domain.sum_rows(&domain.interior(), |row| {
            let mut sum = [0.0; 3];
            if self.rows[1].holds(row.j, row.k) {
                row.shifted(0).for_each(|at| (0..3).for_each(|d| sum[d] += of(d, at)));
            }
            sum
        });
        let all = pulled - Vector::from_array(taken) * domain.grid().cell_volume();
        Vector::from_array(domain.sum(all.to_array()))
    }

    /// Takes from what is `given` to the grains, per volume [N s/m^3], what an entry pressure gives the fluid over `dt` \[s]: the menisci
    /// hang on them. Returns the impulse over all ranks [N s], if there is one. Collective.
    pub(crate) fn pull_narrow_grains(
        &mut self,
        domain: &Domain,
        dt: Real,
        given: [&mut Field<Real>; 3],
    ) -> Option<Vector> {
        self.pores.as_mut().map(|pores| pores.pull_grains(domain, dt, given))
    }

    /// Counts what the curvature was found from, where it is not that of the cells around.
    fn count(&mut self, domain: &Domain) {
        let (kappa, weight, rows) = (self.found.kappa.data(), self.found.weight.data(), &self.rows[0]);
        let largest = largest_curvature(domain.grid());
        let covers = self.continued.as_ref().map(Continued::covers);
        let is_cut = |at: usize| covers.is_some_and(|alpha| 1.0 - alpha[at] < TELLS);
        let counts = domain.sum_rows(&domain.interior(), |row| {
            let mut counts = [0.0; 4];
            if rows.holds(row.j, row.k) {
                for at in row.shifted(0).filter(|&at| kappa[at] != NONE && !is_cut(at)) {
                    counts[if weight[at] == 1.0 {
                        0
                    } else if kappa[at] == UNKNOWN {
                        3
                    } else {
                        1 + usize::from(kappa[at].abs() == largest)
                    }] += 1.0;
                }
            }
            counts
        });
        let [by_columns, by_fit, limited, unknown] = domain.sum(counts).map(|n| n as u64);
        self.report = SurfaceTensionReport { by_columns, by_fit, limited, unknown, ..SurfaceTensionReport::default() };
    }

    /// Adds the acceleration by the jump over `dt` \[s] to the velocity of the faces.
    pub(crate) fn push_faces(
        &self,
        domain: &Domain,
        density: &Field<Real>,
        mobility: &Mobility,
        face_velocity: &mut [Field<Real>; 3],
        dt: Real,
    ) {
        let rho = density.data();
        for (d, uf) in face_velocity.iter_mut().enumerate() {
            let (behind, scale) = (domain.strides()[d] as usize, 2.0 * dt / domain.grid().spacing[d]);
            let jump = self.jump[d].data();
            domain.for_each_row(&domain.faces(d), uf.data_mut(), |row, uf| {
                if !self.rows[1].holds(row.j, row.k) {
                    return;
                }
                let mobility = mobility.of(d, &row, false);
                for (i, at) in row.shifted(0).enumerate() {
                    uf[i] += scale * mobility[i] * (jump[at] / (rho[at - behind] + rho[at]));
                }
            });
        }
    }

    /// Adds the mean acceleration of opposite faces by the jump over `dt` \[s] to the velocity of the cells; returns the impulse over all
    /// ranks [N s]. Collective.
    pub(crate) fn push_cells(
        &self,
        domain: &Domain,
        density: &Field<Real>,
        velocity: &mut [Field<Real>; 3],
        dt: Real,
    ) -> Vector {
        let rho = density.data();
        let gained = |d: usize, at: usize| {
            let (jump, stride) = (self.jump[d].data(), domain.strides()[d] as usize);
            let (below, above) = (at - stride, at + stride);
            (dt / domain.grid().spacing[d]) * (jump[at] / (rho[below] + rho[at]) + jump[above] / (rho[at] + rho[above]))
        };
        let [u1, u2, u3] = velocity.each_mut().map(Field::data_mut);
        domain.for_each_row(&domain.interior(), (u1, u2, u3), |row, (u1, u2, u3)| {
            if self.rows[1].holds(row.j, row.k) {
                for (d, u) in [u1, u2, u3].into_iter().enumerate() {
                    u.iter_mut().zip(row.shifted(0)).for_each(|(u, at)| *u += gained(d, at));
                }
            }
        });
        let sum = domain.sum_rows(&domain.interior(), |row| {
            let mut sum = [0.0; 3];
            if self.rows[1].holds(row.j, row.k) {
                row.shifted(0).for_each(|at| (0..3).for_each(|d| sum[d] += rho[at] * gained(d, at)));
            }
            sum
        });
        Vector::from_array(domain.sum(sum)) * domain.grid().cell_volume()
    }

    /// Adds the acceleration by the jump to that on the lower faces [m/s^2].
    pub(crate) fn add_acceleration(&self, domain: &Domain, density: &Field<Real>, faces: &mut [Field<Real>; 3]) {
        let rho = density.data();
        for (d, faces) in faces.iter_mut().enumerate() {
            let (behind, per_width) = (domain.strides()[d] as usize, 2.0 / domain.grid().spacing[d]);
            let jump = self.jump[d].data();
            domain.for_each_row(&domain.faces(d), faces.data_mut(), |row, faces| {
                if self.rows[1].holds(row.j, row.k) {
                    for (face, at) in faces.iter_mut().zip(row.shifted(0)) {
                        *face += per_width * (jump[at] / (rho[at - behind] + rho[at]));
                    }
                }
            });
        }
    }

    /// What [`Self::find`] found last, with the impulse that it gave [N s].
    #[must_use]
    pub fn report(&self, impulse: Vector) -> SurfaceTensionReport {
        SurfaceTensionReport { impulse, ..self.report }
    }

    /// Energy of the interface over all ranks \[J]: sigma times the area of the planes in the cells, less sigma cos(theta) times the area of
    /// walls that is wet (Young; the mean of the two cosines where there are two); ghosts of the liquid fraction filled.
    #[must_use]
    pub fn energy(&self, domain: &Domain, flow: &Flow) -> Real {
        if self.coefficient == 0.0 {
            return 0.0;
        }
        let (c, strides) = (flow.volume_fraction.data(), domain.strides());
        let around = Surroundings::new(domain, c, &self.heights);
        let area = domain.sum_rows(&domain.interior(), |row| {
            let mut area = 0.0;
            for at in row.shifted(0) {
                if (heights::PURE..=1.0 - heights::PURE).contains(&c[at]) {
                    area += around.facet(&around.wetting.neighbourhood(c, at)).map_or(0.0, |facet| facet.area);
                } else {
                    // An interface on a face is counted from the full cell.
                    for (d, s) in strides.into_iter().enumerate().filter(|_| c[at] > 0.5) {
                        let beside = [at as isize - s, at as isize + s].into_iter();
                        let empty = beside.filter(|&n| c[n as usize] < heights::PURE).count();
                        area += empty as Real * domain.grid().face_area(d);
                    }
                }
            }
            [area]
        });
        self.coefficient * (domain.sum(area)[0] - domain.sum([self.wet_area(domain, &around)])[0])
    }

    /// Area of the walls of this rank that is wet, each times the mean cosine of its contact angles [m^2].
    fn wet_area(&self, domain: &Domain, around: &Surroundings<'_>) -> Real {
        let (c, wetting) = (around.c, around.wetting);
        let sides = (0..6).map(|n| (n / 2, n % 2));
        sides
            .filter_map(|(d, side)| {
                let cosines = wetting.cotangents(d, side)?.map(|cotangent| cotangent / cotangent.hypot(1.0));
                let mut range = domain.interior();
                range[d] = if side == 0 { 0..1 } else { range[d].end - 1..range[d].end };
                let [wet] = domain.sum_rows(&range, |row| {
                    let share = |at: usize| {
                        if (heights::PURE..=1.0 - heights::PURE).contains(&c[at]) {
                            let plane = Plane::through(&wetting.neighbourhood(c, at));
                            plane.map_or(c[at], |plane| plane.share_of_face(d, side == 1))
                        } else {
                            c[at].round()
                        }
                    };
                    [row.shifted(0).map(share).sum()]
                });
                Some(wet * domain.grid().face_area(d) * 0.5 * (cosines[0] + cosines[1]))
            })
            .sum()
    }
}

/// Reciprocal of the longest step that resolves the shortest capillary waves on a grid [1/s].
#[must_use]
pub fn capillary_rate(coefficient: Real, fluids: &Fluids, grid: &Grid) -> Real {
    let [edge, _] = grid.divided_edges();
    let density = fluids.liquid_density + fluids.gas_density;
    (4.0 * std::f64::consts::PI * coefficient / (density * edge.powi(3))).sqrt()
}

/// Curvature on a face between two cells of curvature `kappa` [1/m]: the mean of those known by their weights.
#[inline]
fn on_face(kappa: [Real; 2], weight: [f32; 2]) -> Real {
    match kappa.map(|kappa| kappa.abs() < NONE) {
        [true, true] => {
            let [below, above] = weight.map(Real::from);
            let sum = below + above;
            let share = if sum > 0.0 { above / sum } else { 0.5 };
            kappa[0] + share * (kappa[1] - kappa[0])
        }
        [true, false] => kappa[0],
        [false, true] => kappa[1],
        [false, false] => 0.0,
    }
}
