//! The multigrid-preconditioned conjugate gradients: true residuals and iteration counts.

use std::sync::atomic::{AtomicUsize, Ordering};

use sazanami_numerics::domain::{Domain, Ghost, GhostRules, Location, Row};
use sazanami_numerics::grid::{Field, Grid};
use sazanami_numerics::linear::{ConjugateGradient, Equation, FaceEquation, Solution, SolveError, Stop};
use sazanami_numerics::{Real, Vector};

const OPEN_TOP: GhostRules = GhostRules {
    location: Location::Cell,
    sides: [[Ghost::Even; 2], [Ghost::Even; 2], [Ghost::Even, Ghost::Constant { value: 0.0 }]],
};

/// A number in [0, 1) for a cell.
fn random(i: isize, j: isize, k: isize) -> Real {
    let mut n = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ (k as u64) << 17;
    n = (n ^ (n >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    n = (n ^ (n >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((n ^ (n >> 31)) >> 11) as Real / (1u64 << 53) as Real
}

struct Problem {
    domain: Domain,
    faces: [Field<Real>; 3],
    right: Field<Real>,
    ghosts: GhostRules,
    singular: bool,
}

impl Problem {
    /// `-div(grad p / rho) = b` with walls all round, or p = 0 at the top.
    fn new(
        cells: [usize; 3],
        spacing: Vector,
        open: bool,
        density: impl Fn(isize, isize, isize) -> Real + Sync,
    ) -> Self {
        let size = spacing * Vector::new(cells[0] as Real, cells[1] as Real, cells[2] as Real);
        let domain = Domain::solo(Grid::new(cells, Vector::ZERO, size), [false; 3]);
        let mut rho = domain.field(1.0);
        domain.set(&mut rho, density);
        let mut faces = [0, 1, 2].map(|_| domain.field(0.0));
        for d in 0..3 {
            domain.set(&mut faces[d], |i, j, k| {
                let mut below = [i, j, k];
                below[d] -= 1;
                let per_square = 1.0 / (spacing[d] * spacing[d]);
                if below[d] < 0 { 0.0 } else { 2.0 * per_square / (rho[[i, j, k]] + rho[below]) }
            });
        }
        let mut right = domain.field(0.0);
        domain.set(&mut right, |i, j, k| random(k, i, j) - 0.5);
        if open {
            // The side is half a cell away.
            let last = cells[2] as isize;
            for j in 0..cells[1] as isize {
                for i in 0..cells[0] as isize {
                    faces[2][[i, j, last]] = 2.0 / (spacing.z * spacing.z * rho[[i, j, last - 1]]);
                }
            }
        } else {
            let [mean] = domain.sum_rows(&domain.interior(), |row| [right.data()[row.shifted(0)].iter().sum()]);
            let mean = mean / domain.grid().len() as Real;
            domain.for_each_row(&domain.interior(), right.data_mut(), |_, b| b.iter_mut().for_each(|b| *b -= mean));
        }
        let ghosts = if open { OPEN_TOP } else { GhostRules::EVEN };
        Self { domain, faces, right, ghosts, singular: !open }
    }

    fn equation(&self) -> FaceEquation<'_> {
        let faces = [&self.faces[0], &self.faces[1], &self.faces[2]];
        FaceEquation { faces, right_hand_side: &self.right, ghosts: &self.ghosts, singular: self.singular }
    }

    fn solve(
        &self,
        solver: &mut ConjugateGradient,
        p: &mut Field<Real>,
        tolerance: Real,
    ) -> Result<Solution, SolveError> {
        solver.solve(&self.domain, &self.equation(), p, Stop::Relative(tolerance), 100)
    }

    /// ||b - A p|| / ||b|| by the definition, face by face.
    fn true_residual(&self, p: &Field<Real>) -> Real {
        let n = self.domain.cells().map(|n| n as isize);
        let (mut squares, mut scale) = (0.0, 0.0);
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    let at = [i, j, k];
                    let mut r = self.right[at];
                    scale += r * r;
                    for d in 0..3 {
                        for side in [-1, 1] {
                            let mut next = at;
                            next[d] += side;
                            let face = if side < 0 { at } else { next };
                            let top = d == 2 && next[2] == n[2] && !self.singular;
                            let other = if top { 0.0 } else { p[next] };
                            if top || (0..n[d]).contains(&next[d]) {
                                r += self.faces[d][face] * (other - p[at]);
                            }
                        }
                    }
                    squares += r * r;
                }
            }
        }
        (squares / scale).sqrt()
    }
}

#[test]
fn iterations_stay_bounded_and_residuals_are_true() {
    let cube = Vector::ONE * 1e-3;
    let drop = |n: isize| {
        move |i: isize, j: isize, k: isize| {
            let r = |a: isize| (a - n / 2) * (a - n / 2);
            if r(i) + r(j) + r(k) < n * n / 16 { 1000.0 } else { 1.0 }
        }
    };
    let uniform = |_, _, _| 1.0;
    let cases: [(&str, Problem, usize); 9] = [
        ("uniform", Problem::new([32, 32, 32], cube, false, uniform), 8),
        ("uniform, odd", Problem::new([37, 29, 31], cube, false, uniform), 9),
        ("open", Problem::new([32, 32, 32], cube, true, uniform), 8),
        ("flat cells", Problem::new([32, 32, 32], Vector::new(1.0, 1.0, 0.1), false, uniform), 12),
        ("long cells", Problem::new([24, 48, 24], Vector::new(1.0, 0.1, 0.3), true, uniform), 11),
        ("plane", Problem::new([64, 1, 64], cube, false, uniform), 9),
        ("drop", Problem::new([40, 40, 40], cube, false, drop(40)), 11),
        ("drop, open", Problem::new([64, 64, 64], cube, true, drop(64)), 12),
        (
            "sprinkled",
            Problem::new([33, 24, 21], cube, true, |i, j, k| if random(i, j, k) < 0.5 { 1000.0 } else { 1.0 }),
            75,
        ),
    ];
    for (name, problem, most) in cases {
        let mut solver = ConjugateGradient::new(&problem.domain);
        let mut p = problem.domain.field(0.0);
        let solution = problem.solve(&mut solver, &mut p, 1e-9).unwrap();
        assert!(solution.iterations <= most, "{name}: {solution:?}");
        let residual = problem.true_residual(&p);
        assert!(residual <= 1e-9 * 1.0001, "{name}: {residual:e} {solution:?}");
        assert!((residual - solution.relative).abs() < 1e-12, "{name}: {residual:e} {solution:?}");
        if problem.singular {
            let [sum] =
                problem.domain.sum_rows(&problem.domain.interior(), |row| [p.data()[row.shifted(0)].iter().sum()]);
            let largest = problem.domain.max_rows(&problem.domain.interior(), |row| {
                p.data()[row.shifted(0)].iter().fold(0.0, |a, b| a.max(b.abs()))
            });
            let mean = sum / problem.domain.grid().len() as Real;
            assert!(mean.abs() < 1e-5 * largest, "{name}: mean {mean:e} of {largest:e}");
        }
    }
}

#[test]
fn a_solve_has_the_same_bits_on_any_number_of_threads() {
    for (cells, open) in [([40, 40, 132], false), ([37, 42, 131], true)] {
        let density = |i: isize, j: isize, k: isize| if random(i / 5, j / 5, k / 7) < 0.4 { 1000.0 } else { 1.0 };
        let problem = Problem::new(cells, Vector::ONE * 1e-3, open, density);
        let solved = |threads: usize| {
            let mut p = problem.domain.field(0.0);
            let solve = || problem.solve(&mut ConjugateGradient::new(&problem.domain), &mut p, 1e-6).unwrap();
            let solution = sazanami_parallel::with_threads(threads, solve).unwrap();
            (solution.iterations, p.data().iter().map(|p| p.to_bits()).collect::<Vec<_>>())
        };
        let alone = solved(1);
        assert!([2, 5, 16, 64].iter().all(|&threads| solved(threads) == alone), "{cells:?}");
    }
}

#[test]
fn double_precision_is_reached() {
    let problem = Problem::new([32, 30, 28], Vector::ONE, true, |i, _, _| if i < 9 { 1000.0 } else { 1.0 });
    let mut p = problem.domain.field(0.0);
    let solution = problem.solve(&mut ConjugateGradient::new(&problem.domain), &mut p, 1e-13).unwrap();
    assert!(problem.true_residual(&p) <= 1.1e-13, "{solution:?}");
    // Negative control: beyond the rounding of double precision it says that it stalls.
    let error = problem.solve(&mut ConjugateGradient::new(&problem.domain), &mut p, 1e-12).unwrap_err();
    assert!(matches!(error, SolveError::NotConverged { .. }), "{error}");
}

/// An equation whose residual is not a number any more from some evaluation of a row on.
struct Breaking<'a> {
    sound: FaceEquation<'a>,
    left: AtomicUsize,
}

impl Equation for Breaking<'_> {
    fn coefficients(&self, direction: usize, row: Row, into: &mut [Real]) {
        self.sound.coefficients(direction, row, into);
    }

    fn residual(&self, row: Row, p: &[Real], into: &mut [Real]) {
        self.sound.residual(row, p, into);
        let left = self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1));
        if left.is_err() {
            into.fill(Real::NAN);
        }
    }

    fn fill_ghosts(&self, domain: &Domain, p: &mut Field<Real>) {
        self.sound.fill_ghosts(domain, p);
    }

    fn is_singular(&self) -> bool {
        self.sound.is_singular()
    }
}

#[test]
fn a_number_that_is_not_finite_is_reported_with_the_iterations_before_it() {
    let problem = Problem::new([16, 16, 16], Vector::ONE, true, |_, _, _| 1.0);
    let iterations = |evaluations: usize| {
        let left = AtomicUsize::new(evaluations * 16 * 16);
        let equation = Breaking { sound: problem.equation(), left };
        let mut solver = ConjugateGradient::new(&problem.domain);
        let mut p = problem.domain.field(0.0);
        match solver.solve(&problem.domain, &equation, &mut p, Stop::Relative(1e-12), 100) {
            Err(SolveError::NotFinite { iterations }) => iterations,
            other => panic!("{other:?}"),
        }
    };
    let [first, second, third] = [0, 1, 2].map(iterations);
    assert!(first == 0 && second > 0 && third > second, "{first} {second} {third}");
}
