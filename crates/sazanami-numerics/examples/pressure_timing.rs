//! Times the multigrid-preconditioned conjugate gradients on the pressure equation of a falling drop
//! and of liquid sprinkled through a bed.
//!
//! `cargo run --release -p sazanami-numerics --example pressure_timing -- [drop|sprinkled] [n1 n2 n3] [tolerance] [threads]`

use std::time::Instant;

use sazanami_numerics::Vector;
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::{Field, Grid};
use sazanami_numerics::linear::{ConjugateGradient, FaceEquation, Stop};

const SIZE: [f64; 3] = [33.8e-3, 33.8e-3, 25.0e-3];
const DROP: f64 = 5.5e-3;
const SPEED: f64 = 9.0;
const STEP: f64 = 1e-5;
const REPEATS: usize = 11;

fn hash(mut n: u64) -> f64 {
    n = (n ^ (n >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    n = (n ^ (n >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((n ^ (n >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Liquid part of a cell: a drop in the middle, 4 x 4 x 4 samples.
fn drop(centre: Vector, spacing: Vector, at: Vector) -> f64 {
    let mut inside = 0;
    for n in 0..64 {
        let sub = Vector::new((n % 4) as f64, (n / 4 % 4) as f64, (n / 16) as f64);
        let x = centre + spacing * ((sub + Vector::splat(0.5)) / 4.0 - Vector::splat(0.5)) - at;
        inside += i32::from(x.length() < 0.5 * DROP);
    }
    f64::from(inside) / 64.0
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let text = |n: usize, default: &str| arguments.get(n).cloned().unwrap_or_else(|| default.into());
    let number = |n: usize, default: usize| arguments.get(n).and_then(|a| a.parse().ok()).unwrap_or(default);
    let sprinkled = text(0, "drop") == "sprinkled";
    let cells = [number(1, 176), number(2, 184), number(3, 132)];
    let tolerance: f64 = text(4, "1e-6").parse().expect("a tolerance");
    sazanami_parallel::with_threads(number(5, 2), || run(sprinkled, cells, tolerance))
        .expect("the threads are granted");
}

fn run(sprinkled: bool, cells: [usize; 3], tolerance: f64) {
    let domain = Domain::solo(Grid::new(cells, Vector::ZERO, Vector::from_array(SIZE)), [false; 3]);
    let spacing = domain.grid().spacing;
    let mut liquid = domain.field(0.0);
    let middle = 0.5 * Vector::from_array(SIZE);
    domain.set(&mut liquid, |i, j, k| {
        let centre = domain.centre(i, j, k);
        let number = (i + 1000 * j + 1_000_000 * k) as u64;
        // A bed in the lower third whose cells hold liquid or not at random under the drop.
        if sprinkled && k < cells[2] as isize / 3 {
            let near = (centre - middle).truncate().length() < 8e-3;
            f64::from(u8::from(near && hash(number.wrapping_mul(0x9e37_79b9_7f4a_7c15)) < 0.5))
        } else {
            drop(centre, spacing, middle)
        }
    });
    let (faces, right) = problem(&domain, &liquid);
    let faces: [&Field<f64>; 3] = [&faces[0], &faces[1], &faces[2]];
    let equation = FaceEquation { faces, right_hand_side: &right, ghosts: &GhostRules::EVEN, singular: true };
    let mut solver = ConjugateGradient::new(&domain);
    let mut p = domain.field(0.0);
    let mut times = Vec::new();
    for _ in 0..REPEATS {
        p.fill(0.0);
        let start = Instant::now();
        let solution = solver.solve(&domain, &equation, &mut p, Stop::Relative(tolerance), 200);
        times.push(start.elapsed().as_secs_f64() * 1e3);
        if times.len() == REPEATS {
            println!("{solution:?}");
        }
    }
    times.sort_by(f64::total_cmp);
    println!("best {:.1} ms, median {:.1} ms of {REPEATS}", times[0], times[REPEATS / 2]);
}

/// Face coefficients and right-hand side of `-div(grad p / rho) = -div(u) / dt`.
fn problem(domain: &Domain, liquid: &Field<f64>) -> ([Field<f64>; 3], Field<f64>) {
    let spacing = domain.grid().spacing;
    let mut faces: [Field<f64>; 3] = std::array::from_fn(|_| domain.field(0.0));
    let n = domain.cells().map(|n| n as isize);
    for d in 0..3 {
        let step: [isize; 3] = std::array::from_fn(|e| isize::from(e == d));
        domain.set(&mut faces[d], |i, j, k| {
            if [i, j, k][d] == 0 {
                return 0.0;
            }
            let mean = 0.5 * (liquid[[i, j, k]] + liquid[[i - step[0], j - step[1], k - step[2]]]);
            1.0 / ((1.0 + 999.0 * mean) * spacing[d] * spacing[d])
        });
    }
    let mut right = domain.field(0.0);
    let flux = |i: isize, j: isize, k: isize| {
        if k == 0 || k == n[2] { 0.0 } else { -SPEED * 0.5 * (liquid[[i, j, k]] + liquid[[i, j, k - 1]]) }
    };
    domain.set(&mut right, |i, j, k| -(flux(i, j, k + 1) - flux(i, j, k)) / (spacing.z * STEP));
    (faces, right)
}
