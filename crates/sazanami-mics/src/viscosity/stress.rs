//! Viscous stress on the faces, and its divergence in the cells.
//!
//! # Viscosity of a face
//!
//! Between the centres of two cells lies the resistance of the fluids between them. The velocity of a mixed cell is that of its
//! liquid, which has the mass; so the half of the cell towards more liquid resists as its mean by volume does, `1/(2 mu(c))`, and what its gas
//! resists lies on the other side. With `C` the larger fraction of the two cells, `c` the smaller,
//!
//! ```text
//! 1/mu_face = 1/(2 mu(C)) + 1/(2 mu(c)) + (C - c)/C (C/mu_l + (1 - C)/mu_g - 1/mu(C))
//! ```
//!
//! Along an interface, `C = c`, that is the mean by volume; across it the whole resistance of the mixed cell, as the harmonic mean has it, and the
//! harmonic mean itself where the interface is on a face. With the harmonic mean within cells as well, liquid that does not fill
//! its cell would be held by the viscosity of gas, and a film would run away with it.
//!
//! # Transposed gradient beside an interface
//!
//! It takes the change of the velocity in the liquid alone, or gas that slides along the surface would push at it (theory 2).

use std::cell::RefCell;
use std::ops::Range;

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::GHOSTS;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{SlicesMut, for_each_chunk};

use super::TRACE;
use crate::fluids::{Fluids, LEAST};
use crate::schemes::Transposed;

/// Velocity (or a change of it) in a mixture, one ghost layer filled.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    /// Liquid fraction, which sets density and viscosity.
    pub c: &'a [Real],
    /// Velocity [m/s].
    pub u: [&'a [Real]; 3],
    /// The transposed gradient that counts.
    pub transposed: Transposed,
    /// Factor of the viscosity of faces that see both fluids: in the sums over faces, and in the stress of changes of the velocity, which
    /// have no transposed gradient.
    pub reserve: Real,
}

/// Difference of viscosities, relative, that traces of one fluid in the other make.
const ALIKE: Real = 1e-6;
/// Planes of cells in one parallel task.
const DEPTH: usize = 8;

/// Coefficients of the viscous stress on a grid.
#[derive(Clone, Copy)]
pub(super) struct Stress {
    strides: [isize; 3],
    /// Reciprocals of the cell widths [1/m].
    per_width: [Real; 3],
    /// Viscosity of the gas, and of the liquid less that of the gas [Pa s].
    line: [Real; 2],
    /// Square of the difference of the viscosities over their product, twice.
    contrast: Real,
}

/// Viscosity on a row of faces, and the stress on them per component.
#[derive(Default)]
struct FaceRow {
    mu: Vec<Real>,
    stress: [Vec<Real>; 3],
    /// Sums over the cells on both sides: changes of the velocity, and the shares of them.
    turned: [Vec<Real>; 2],
}

/// Stresses on the faces around a row of cells, and the sums for that row: divergence of the stress, and face
/// viscosities over squared widths.
#[derive(Default)]
struct Scratch {
    side: FaceRow,
    front: FaceRow,
    back: FaceRow,
    above: FaceRow,
    below: Vec<FaceRow>,
    sum: FaceRow,
}

/// Liquid fraction and a component of the velocity in a row of cells, and in the rows before and after it in a direction.
struct Line<'a> {
    c: [&'a [Real]; 3],
    u: [&'a [Real]; 3],
}

impl<'a> Line<'a> {
    fn along(c: &'a [Real], u: &'a [Real], at: usize, stride: usize, n: usize) -> Self {
        let places = [at - stride, at, at + stride];
        Self { c: places.map(|at| &c[at..at + n]), u: places.map(|at| &u[at..at + n]) }
    }

    /// Whether all of its cells have so nearly this liquid fraction that their viscosities count as alike.
    fn is_even(&self, fraction: Real, [gas, slope]: [Real; 2]) -> bool {
        let fraction = fraction.clamp(0.0, 1.0);
        let apart = 0.5 * ALIKE * (gas + slope * fraction);
        let differ = |c: &Real| u64::from((slope * (c.clamp(0.0, 1.0) - fraction)).abs() >= apart);
        // Counted, not searched for, in lanes.
        self.c.iter().map(|c| c.iter().map(differ).sum::<u64>()).sum::<u64>() == 0
    }

    /// Twice what the velocity changes by from one cell to the next.
    fn change(&self, x: usize) -> Real {
        self.u[2][x] - self.u[0][x]
    }

    /// Calls `add` for each cell with twice what the velocity changes by in the fluid of the cell, and the shares `w` of the changes from the
    /// cell before and to the cell after, both together, that are changes of this fluid: `2 mu'/(mu' + mu)` towards a neighbour of less viscosity,
    /// 1 towards one that is alike or more viscous.
    #[inline(always)]
    fn for_each_change(&self, n: usize, [gas, slope]: [Real; 2], mut add: impl FnMut(usize, Real, Real)) {
        let ([c0, c1, c2], [u0, u1, u2]) = (self.c.map(|c| &c[..n]), self.u.map(|u| &u[..n]));
        let mu = |c: Real| gas + slope * c.clamp(0.0, 1.0);
        for x in 0..n {
            let (before, own, after) = (mu(c0[x]), mu(c1[x]), mu(c2[x]));
            let share = |beside: Real| if beside < (1.0 - ALIKE) * own { 2.0 * beside / (beside + own) } else { 1.0 };
            let (before, after) = (share(before), share(after));
            // The same operation, and so the same bits, as where all cells are alike.
            let whole = before + after == 2.0;
            let part = before * (u1[x] - u0[x]) + after * (u2[x] - u1[x]);
            add(x, if whole { u2[x] - u0[x] } else { part }, before + after);
        }
    }
}

impl FaceRow {
    fn reserve(&mut self, width: usize) {
        for values in [&mut self.mu].into_iter().chain(&mut self.stress).chain(&mut self.turned) {
            if values.len() < width {
                values.resize(width, 0.0);
            }
        }
    }
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// A row of cells with the divergence of the stress in it.
pub(super) struct DivergenceRow<'a> {
    /// Local indices of the row in x2 and x3.
    pub index: (isize, isize),
    /// Place in memory of the first cell.
    pub at: usize,
    /// Divergence of the stress per component [N/m^3 for velocities].
    pub divergence: [&'a [Real]; 3],
    /// Sum over the faces of viscosity over squared width [Pa s/m^2].
    pub sum: &'a [Real],
}

impl Stress {
    pub fn new(domain: &Domain, fluids: &Fluids) -> Self {
        let [gas, liquid] = fluids.viscosities();
        let line = [gas, liquid - gas];
        let contrast = 2.0 * (line[1] / gas) * (line[1] / liquid);
        Self { strides: domain.strides(), per_width: domain.grid().spacing.recip().to_array(), line, contrast }
    }

    /// Multiplies the viscosity `mu` of faces between cells of the fractions `c` where both fluids are.
    fn hold_in_reserve(reserve: Real, mu: &mut [Real], c: [&[Real]; 2]) {
        for (i, mu) in mu.iter_mut().enumerate() {
            let [low, high] = [c[0][i].min(c[1][i]), c[0][i].max(c[1][i])];
            *mu *= if high > TRACE && low < 1.0 - TRACE { reserve } else { 1.0 };
        }
    }

    /// Stress on the lower faces normal to `d` of the cells at places `cells`: `mu du_i/dx_d`, and
    /// `mu du_d/dx_i` too if the transposed gradient counts.
    fn on_faces(&self, d: usize, cells: Range<usize>, source: Source<'_>, row: &mut FaceRow) {
        let Source { c, u, transposed, reserve } = source;
        let (at, n) = (cells.start, cells.len());
        let behind = at - self.strides[d] as usize;
        let (c_l, c_r) = (&c[behind..behind + n], &c[at..at + n]);
        let FaceRow { mu, stress, turned } = row;
        let mu = &mut mu[..n];
        let [turned, shares] = turned.each_mut().map(|values| &mut values[..n]);
        let [gas, slope] = self.line;
        for i in 0..n {
            let (l, r) = (c_l[i].clamp(0.0, 1.0), c_r[i].clamp(0.0, 1.0));
            let (low, high) = (l.min(r), l.max(r));
            let [thin, thick] = [low, high].map(|c| (gas + slope * c).max(LEAST));
            // The formula above times 2 mu(C) mu(c).
            let across = self.contrast * (high - low) * (1.0 - high) * thin;
            mu[i] = 2.0 * thin * thick / (thin + thick + across);
        }
        let is_change = transposed == Transposed::Left;
        if reserve > 1.0 && is_change {
            Self::hold_in_reserve(reserve, mu, [c_l, c_r]);
        }
        let across = self.per_width[d];
        let lines = |i: usize, of: usize| [behind, at].map(|at| Line::along(c, u[of], at, self.strides[i] as usize, n));
        // Along each direction of the face: whether its cells and those beside them are all alike, as nearly everywhere.
        let is_even: [bool; 3] = std::array::from_fn(|i| {
            transposed != Transposed::Left && i != d && lines(i, d).iter().all(|line| line.is_even(c_l[0], self.line))
        });
        for (i, stress) in stress.iter_mut().enumerate() {
            let stress = &mut stress[..n];
            let (u_l, u_r) = (&u[i][behind..behind + n], &u[i][at..at + n]);
            if transposed == Transposed::Left || i == d {
                let factor = if transposed == Transposed::Whole { 2.0 * across } else { across };
                for x in 0..n {
                    stress[x] = mu[x] * factor * (u_r[x] - u_l[x]);
                }
                continue;
            }
            let (along, [l, r]) = (0.25 * self.per_width[i], lines(i, d));
            if is_even[i] {
                for x in 0..n {
                    stress[x] = mu[x] * (across * (u_r[x] - u_l[x]) + along * (l.change(x) + r.change(x)));
                }
            } else {
                l.for_each_change(n, self.line, |x, change, share| (turned[x], shares[x]) = (change, share));
                r.for_each_change(n, self.line, |x, change, share| {
                    turned[x] += change;
                    shares[x] += share;
                });
                // At a surface that bears no shear the velocity along it changes against that across it.
                for x in 0..n {
                    let whole = across * (u_r[x] - u_l[x]);
                    stress[x] = mu[x] * (whole * (0.25 * shares[x]) + along * turned[x]);
                }
            }
        }
        if transposed == Transposed::AtInterface {
            let normal = &mut stress[d][..n];
            for i in (0..3).filter(|&i| i != d) {
                let (along, [l, r]) = (0.25 * self.per_width[i], lines(i, i));
                if is_even[i] {
                    for x in 0..n {
                        normal[x] -= mu[x] * along * (l.change(x) + r.change(x));
                    }
                } else {
                    // The surface carries the velocity through it: that of the side which is the cell's own.
                    let stretching = |change: Real, share: Real| if share > 0.0 { 2.0 * change / share } else { 0.0 };
                    l.for_each_change(n, self.line, |x, change, share| turned[x] = stretching(change, share));
                    r.for_each_change(n, self.line, |x, change, share| turned[x] += stretching(change, share));
                    for x in 0..n {
                        normal[x] -= mu[x] * along * turned[x];
                    }
                }
            }
        }
        if reserve > 1.0 && !is_change {
            Self::hold_in_reserve(reserve, mu, [c_l, c_r]);
        }
    }

    /// Calls `body` for every row of interior cells with the divergence of the stress of `source` in
    /// it, and the row's part of `slices`.
    pub fn for_each_row<S: SlicesMut>(
        &self,
        domain: &Domain,
        source: Source<'_>,
        slices: S,
        body: impl Fn(DivergenceRow<'_>, S) + Sync,
    ) {
        let [n1, n2, n3] = domain.cells();
        let [_, width, plane] = self.strides.map(|s| s as usize);
        let place = |j: usize, k: usize| (k + GHOSTS) * plane + (j + GHOSTS) * width + GHOSTS;
        let on_faces = |d, at, n, row: &mut FaceRow| self.on_faces(d, at..at + n, source, row);
        let interior = slices.cut(GHOSTS * plane).1.cut(n3 * plane).0;
        for_each_chunk(interior, DEPTH * plane, |number, mut rest| {
            SCRATCH.with_borrow_mut(|scratch| {
                let planes = number * DEPTH..(number * DEPTH + DEPTH).min(n3);
                scratch.reserve(n1 + 1, n2);
                let Scratch { side, front, back, above, below, sum } = scratch;
                let mut reached = (planes.start + GHOSTS) * plane;
                for (j, below) in below[..n2].iter_mut().enumerate() {
                    on_faces(2, place(j, planes.start), n1, below);
                }
                for k in planes {
                    on_faces(1, place(0, k), n1, front);
                    for (j, below) in below[..n2].iter_mut().enumerate() {
                        let at = place(j, k);
                        on_faces(0, at, n1 + 1, side);
                        on_faces(1, place(j + 1, k), n1, back);
                        on_faces(2, place(j, k + 1), n1, above);
                        self.assemble_divergence(n1, side, [front, below], [back, above], sum);
                        std::mem::swap(front, back);
                        std::mem::swap(above, below);
                        let (values, behind) = rest.cut(at - reached).1.cut(n1);
                        (rest, reached) = (behind, at + n1);
                        let divergence = sum.stress.each_ref().map(|values| &values[..n1]);
                        body(
                            DivergenceRow { index: (j as isize, k as isize), at, divergence, sum: &sum.mu[..n1] },
                            values,
                        );
                    }
                }
            });
        });
    }

    fn assemble_divergence(
        &self,
        n: usize,
        side: &FaceRow,
        lower: [&FaceRow; 2],
        upper: [&FaceRow; 2],
        sum: &mut FaceRow,
    ) {
        let [p1, p2, p3] = self.per_width;
        {
            let (s, s_next) = (&side.mu[..n], &side.mu[1..=n]);
            let (l2, u2) = (&lower[0].mu[..n], &upper[0].mu[..n]);
            let (l3, u3) = (&lower[1].mu[..n], &upper[1].mu[..n]);
            for (x, sum) in sum.mu[..n].iter_mut().enumerate() {
                *sum = p1 * p1 * (s[x] + s_next[x]) + p2 * p2 * (l2[x] + u2[x]) + p3 * p3 * (l3[x] + u3[x]);
            }
        }
        for (i, sum) in sum.stress.iter_mut().enumerate() {
            let (s, s_next) = (&side.stress[i][..n], &side.stress[i][1..=n]);
            let (l2, u2) = (&lower[0].stress[i][..n], &upper[0].stress[i][..n]);
            let (l3, u3) = (&lower[1].stress[i][..n], &upper[1].stress[i][..n]);
            for (x, sum) in sum[..n].iter_mut().enumerate() {
                *sum = p1 * (s_next[x] - s[x]) + p2 * (u2[x] - l2[x]) + p3 * (u3[x] - l3[x]);
            }
        }
    }

    /// Force of the stress on the sides of the box on the fluid, this rank's part [N for velocities].
    pub fn on_sides(&self, domain: &Domain, source: Source<'_>) -> Vector {
        let mut force = Vector::ZERO;
        for d in (0..3).filter(|&d| !domain.periodic()[d]) {
            for side in (0..2).filter(|&side| domain.at_box_end(d, side)) {
                let mut range = domain.interior();
                range[d] = if side == 0 { 0..1 } else { range[d].end..range[d].end + 1 };
                let sum = domain.sum_rows(&range, |row| {
                    SCRATCH.with_borrow_mut(|scratch| {
                        scratch.reserve(domain.cells()[0] + 1, 0);
                        self.on_faces(d, row.shifted(0), source, &mut scratch.side);
                        scratch.side.stress.each_ref().map(|stress| stress[..row.len].iter().sum())
                    })
                });
                let outward = if side == 0 { -1.0 } else { 1.0 };
                force += outward * domain.grid().face_area(d) * Vector::from_array(sum);
            }
        }
        force
    }
}

impl Scratch {
    fn reserve(&mut self, width: usize, rows: usize) {
        for row in [&mut self.side, &mut self.front, &mut self.back, &mut self.above, &mut self.sum] {
            row.reserve(width);
        }
        if self.below.len() < rows {
            self.below.resize_with(rows, FaceRow::default);
        }
        self.below.iter_mut().take(rows).for_each(|row| row.reserve(width));
    }
}
