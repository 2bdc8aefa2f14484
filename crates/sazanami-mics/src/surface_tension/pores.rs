//! Entry pressure: the capillary pressure of pores between grains that the cells do not resolve.
//!
//! Between narrow grains the curvature that the cells see says nothing of the menisci in the pores. There the jump of the pressure across a
//! face is
//!
//! ```text
//! T_f = (1 - s) sigma kappa_f (C_R - C_L) - s p_e (C_R - C_L)
//! ```
//!
//! with the entry pressure `p_e`, by which the pressure of the gas exceeds that of the liquid, positive where the liquid wets the grains,
//! and the share `s` of the pores, the mean of the cells beside the face. It comes from the mean solid fraction `A` of narrow grains in the
//! cube of five cells about a cell: 0 up to [`ALONE`], 1 from [`BED`] on, in proportion between. Five cells, because one sphere of less than
//! four cells fills at most 0.27 of them away from the sides of the box, at which cubes are mirrored; a long grain may fill more. Where `s` is the same all over, the force is a gradient: it moves nothing along a
//! front, and the whole jump does not depend on how many cells this is spread over.
//!
//! The menisci hang on the grains: these get the reaction of the part of `p_e`, which is no force of the surroundings. What acts
//! in a cell goes to the grains in the cube about it by their solid fractions,
//!
//! ```text
//! f_n = -alpha_n sum_c t_c / (125 A_c),   t_c = -s p_e grad C,
//! ```
//!
//! so that its sum is that of `-t_c` to rounding. Sums over cubes are mirrored at the sides of the box in the same way for both.

use sazanami_numerics::domain::{Domain, GhostRules, Range3};
use sazanami_numerics::grid::{Field, Grid};
use sazanami_numerics::{Real, Vector};

use super::Ends;
use crate::fluids::Fluids;
use crate::mobility::RowSet;

/// Mean solid fraction up to which grains count as alone, a little above that of one sphere of four cells in the cube of five.
const ALONE: Real = 0.3;
/// Mean solid fraction from which on they are a bed. Loose beds of spheres have 0.5 to 0.55, of elongated grains down to 0.4.
const BED: Real = 0.4;

/// Cells of the cube over which the solid fraction is averaged.
const CUBE: Real = 125.0;

/// Pores of an entry pressure on one rank.
pub(super) struct Pores {
    /// By how much the pressure of the gas exceeds that of the liquid \[Pa].
    pressure: Real,
    /// Solid fraction of narrow grains, all ghosts filled.
    solid: Field<Real>,
    /// Its mean in the cube about a cell, one ghost layer filled.
    mean: Field<Real>,
    /// Part of the jump across the lower faces \[Pa].
    jump: [Field<Real>; 3],
    scratch: [Field<Real>; 2],
    /// Rows of cells with pores, and with the rows beside them.
    rows: [RowSet; 2],
}

impl Pores {
    /// No pores yet, of this entry pressure \[Pa].
    pub fn new(domain: &Domain, pressure: Real) -> Self {
        let field = || domain.field(0.0);
        Self {
            pressure,
            solid: field(),
            mean: field(),
            jump: std::array::from_fn(|_| field()),
            scratch: [field(), field()],
            rows: Default::default(),
        }
    }

    /// By how much the pressure of the gas exceeds that of the liquid \[Pa].
    pub fn pressure(&self) -> Real {
        self.pressure
    }

    /// Takes note of the narrow grains: `sum` adds their solid fraction to the first of three fields of zeros. Collective.
    pub fn place(&mut self, domain: &Domain, sum: impl FnOnce([&mut Field<Real>; 3])) {
        let Self { solid, mean, scratch: [s1, s2], rows: [with, beside], .. } = self;
        domain.for_each_row(&domain.interior(), (solid.data_mut(), s1.data_mut(), s2.data_mut()), |_, (a, b, c)| {
            [a, b, c].into_iter().for_each(|values| values.fill(0.0));
        });
        sum([&mut *solid, &mut *s1, &mut *s2]);
        domain.fill_halos(&mut [(solid, &GhostRules::EVEN)]);
        sum_along(domain, 0, solid, s1);
        sum_along(domain, 1, s1, s2);
        sum_along(domain, 2, s2, mean);
        domain.for_each_row(&domain.interior(), mean.data_mut(), |_, mean| {
            mean.iter_mut().for_each(|mean| *mean /= CUBE);
        });
        domain.fill_halos_to(1, &mut [(mean, &GhostRules::EVEN)]);
        let [n1, n2, n3] = domain.cells();
        with.mark([n2, n3], |j, k| {
            let start = mean.at(-1, j, k);
            mean.data()[start..start + n1 + 2].iter().any(|&mean| mean > ALONE)
        });
        beside.and_beside(domain, with);
    }

    /// Finds the part of the jump of the liquid fraction `c`, first ghost layer filled, but at the ends of the box.
    pub fn find(&mut self, domain: &Domain, c: &[Real], ends: &Ends) {
        let Self { pressure, mean, jump, rows: [_, beside], .. } = self;
        for (d, jump) in jump.iter_mut().enumerate() {
            let behind = domain.strides()[d] as usize;
            domain.for_each_row(&domain.faces(d), jump.data_mut(), |row, jump| {
                if !beside.holds(row.j, row.k) {
                    return jump.fill(0.0);
                }
                for ((jump, at), i) in jump.iter_mut().zip(row.shifted(0)).zip(row.first..) {
                    let difference = c[at] - c[at - behind];
                    let is_open = !ends.hold(d, [i, row.j, row.k][d]);
                    *jump = if is_open { -*pressure * on_face(mean.data(), at, behind) * difference } else { 0.0 };
                }
            });
        }
    }

    /// Rows of cells with pores, from one ghost layer on.
    pub fn hold_row(&self, j: isize, k: isize) -> bool {
        self.rows[0].holds(j, k)
    }

    /// Share of the pores on the face between a cell and that `behind` it in memory.
    #[inline]
    pub fn share(&self, at: usize, behind: usize) -> Real {
        on_face(self.mean.data(), at, behind)
    }

    /// Part of the jump across the lower faces \[Pa].
    pub fn jump(&self) -> &[Field<Real>; 3] {
        &self.jump
    }

    /// Takes from what is `given` to the grains, per volume [N s/m^3], what the entry pressure gives the fluid over `dt` \[s], so that
    /// both have the same momentum together; returns its sum over all ranks [N s]. Collective.
    pub fn pull_grains(&mut self, domain: &Domain, dt: Real, given: [&mut Field<Real>; 3]) -> Vector {
        let (strides, half) = (domain.strides(), 0.5 * dt / domain.grid().spacing);
        let Self { solid, mean, jump, scratch: [s1, s2], rows: [_, beside], .. } = self;
        let mut pulled = [0.0; 3];
        for (d, given) in given.into_iter().enumerate() {
            let (jump, mean, ahead) = (jump[d].data(), mean.data(), strides[d] as usize);
            domain.for_each_row(&domain.interior(), s1.data_mut(), |row, pull| {
                if !beside.holds(row.j, row.k) {
                    return pull.fill(0.0);
                }
                for (pull, at) in pull.iter_mut().zip(row.shifted(0)) {
                    let gained = half[d] * (jump[at] + jump[at + ahead]);
                    // Beside pores the cube is never empty.
                    *pull = if gained == 0.0 { 0.0 } else { gained / (CUBE * mean[at]) };
                }
            });
            domain.fill_halos(&mut [(&mut *s1, &GhostRules::EVEN)]);
            sum_along(domain, 0, s1, s2);
            sum_along(domain, 1, s2, s1);
            sum_along(domain, 2, s1, s2);
            let (solid, sums) = (solid.data(), s2.data());
            domain.for_each_row(&domain.interior(), given.data_mut(), |row, given| {
                for (given, at) in given.iter_mut().zip(row.shifted(0)).filter(|&(_, at)| solid[at] > 0.0) {
                    *given -= solid[at] * sums[at];
                }
            });
            [pulled[d]] = domain
                .sum_rows(&domain.interior(), |row| [-row.shifted(0).map(|at| solid[at] * sums[at]).sum::<Real>()]);
        }
        Vector::from_array(domain.sum(pulled)) * domain.grid().cell_volume()
    }
}

/// Share of the pores on the face between a cell and that `behind` it, from the mean solid fractions.
#[inline]
fn on_face(mean: &[Real], at: usize, behind: usize) -> Real {
    0.5 * (share(mean[at - behind]) + share(mean[at]))
}

/// Share of the pores at a mean solid fraction of narrow grains.
#[inline]
fn share(mean: Real) -> Real {
    ((mean - ALONE) / (BED - ALONE)).clamp(0.0, 1.0)
}

/// Sums five cells along a direction, in the interior and the ghosts of the directions after it.
fn sum_along(domain: &Domain, direction: usize, from: &Field<Real>, into: &mut Field<Real>) {
    let (interior, whole) = (domain.interior(), domain.interior_and(2));
    let range: Range3 = std::array::from_fn(|d| if d <= direction { interior[d].clone() } else { whole[d].clone() });
    let (values, stride) = (from.data(), domain.strides()[direction]);
    domain.for_each_row(&range, into.data_mut(), |row, into| {
        let [a, b, c, d, e] = [-2, -1, 0, 1, 2].map(|by| &values[row.shifted(by * stride)]);
        for i in 0..row.len {
            into[i] = (a[i] + e[i]) + (b[i] + d[i]) + c[i];
        }
    });
}

/// Reciprocal of the longest step that follows a front at the edge of a bed, where an entry `pressure` \[Pa] fades within about a cell, on
/// a grid [1/s]. The edge acts on the front as a gravity of `p_e/dx` over the densities does: its shortest
/// wave, of two cells, must not go half a cell in a step.
#[must_use]
pub fn entry_rate(pressure: Real, fluids: &Fluids, grid: &Grid) -> Real {
    let [edge, _] = grid.divided_edges();
    (4.0 * pressure.abs() / (std::f64::consts::PI * (fluids.liquid_density + fluids.gas_density))).sqrt() / edge
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(domain: &Domain, solid: impl Fn(isize, isize, isize) -> Real + Sync) -> Pores {
        let mut pores = Pores::new(domain, 100.0);
        pores.place(domain, |[into, ..]| domain.set(into, solid));
        pores
    }

    fn domain(periodic: [bool; 3]) -> Domain {
        let (cells, size) = ([8, 7, 9], Vector::new(0.8, 0.7, 0.9));
        Domain::solo(sazanami_numerics::grid::Grid::new(cells, Vector::ZERO, size), periodic)
    }

    #[test]
    fn beds_have_pores_and_a_grain_alone_has_none() {
        let domain = domain([false; 3]);
        let bed = placed(&domain, |_, _, k| if k < 5 { 0.55 } else { 0.0 });
        let at = |k: isize| bed.solid.at(4, 3, k);
        let plane = domain.strides()[2] as usize;
        assert_eq!([bed.share(at(1), plane), bed.share(at(8), plane)], [1.0, 0.0]);
        assert!((0.1..0.9).contains(&bed.share(at(5), plane)));
        // The largest of the narrow grains, in the middle of a cell.
        let alone = placed(&domain, |i, j, k| {
            let inside = |n: usize| {
                let of = |n: usize, c: isize, at: isize| (c - at) as Real + (n as Real + 0.5) / 8.0 - 0.5;
                let x = [of(n % 8, i, 4), of(n / 8 % 8, j, 3), of(n / 64, k, 4)];
                x.iter().map(|x| x * x).sum::<Real>() < 4.0
            };
            (0..512).filter(|&n| inside(n)).count() as Real / 512.0
        });
        assert!(alone.mean.data().iter().all(|&mean| share(mean) == 0.0));
        assert!(alone.mean.data().iter().any(|&mean| mean > 0.25));
    }

    #[test]
    fn grains_get_the_reaction_of_what_the_fluid_gets() {
        for periodic in [[false; 3], [true; 3]] {
            let domain = domain(periodic);
            let solid =
                |i: isize, j: isize, k: isize| ((3 * i + 5 * j + 7 * k) % 4) as Real * (if i < 4 { 0.2 } else { 0.25 });
            let mut pores = placed(&domain, solid);
            let mut c = domain.field(0.0);
            domain.set(&mut c, |i, j, k| ((i * i + 2 * j + k * j) % 5) as Real * 0.25);
            domain.fill_halos(&mut [(&mut c, &GhostRules::EVEN)]);
            pores.find(&domain, c.data(), &Ends::of(&domain));
            let dt = 0.3;
            let fluid: [Real; 3] = std::array::from_fn(|d| {
                let (ahead, per) = (domain.strides()[d] as usize, 0.5 * dt / domain.grid().spacing[d]);
                let jump = pores.jump[d].data();
                domain.sum_rows(&domain.interior(), |row| {
                    [row.shifted(0).map(|at| per * (jump[at] + jump[at + ahead])).sum()]
                })[0]
            });
            let mut given: [Field<Real>; 3] = std::array::from_fn(|_| domain.field(0.0));
            let pulled = pores.pull_grains(&domain, dt, given.each_mut());
            let grains: [Real; 3] = std::array::from_fn(|d| {
                domain.sum_rows(&domain.interior(), |row| [given[d].data()[row.shifted(0)].iter().sum()])[0]
            });
            let volume = domain.grid().cell_volume();
            for d in 0..3 {
                assert!((grains[d] + fluid[d]).abs() < 1e-9, "{d}: {} {}", grains[d], fluid[d]);
                assert!((pulled[d] - grains[d] * volume).abs() < 1e-12);
            }
            // Negative control: there is something to react to where the box does not close on itself.
            assert!(periodic[0] || fluid.iter().any(|f| f.abs() > 1.0), "{fluid:?}");
        }
    }
}
