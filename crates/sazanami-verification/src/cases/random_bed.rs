//! Flow through spheres at random, from slow to Reynolds numbers of a hundred.

use std::f64::consts::PI;

use sazanami_dem::{Grain, Motion};
use sazanami_mics::boundary::Boundary;
use sazanami_mics::grains::Exchange;
use sazanami_mps::grains::{DragForm, DragParameters};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::tank::{Tank, ball, largest, single, step};
use crate::measured::Measured;

/// Spheres to an edge of the lattice that is shaken.
const EDGE: usize = 3;
/// Part of the periodic box that the spheres fill.
const SOLID_FRACTION: Real = 0.4;

/// Number between 0 and 1 of a linear congruential generator (Knuth's MMIX).
fn random(state: &mut u64) -> Real {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as Real / (1_u64 << 53) as Real
}

/// Edge of the periodic box in diameters.
fn edge() -> Real {
    (EDGE.pow(3) as Real * PI / 6.0 / SOLID_FRACTION).cbrt()
}

/// Centres of an arrangement of hard spheres in equilibrium: a lattice after 2000 trial moves of every sphere.
fn arrangement(seed: u64) -> Vec<Vector> {
    let (edge, mut state) = (edge(), seed);
    let pitch = edge / EDGE as Real;
    let at = |n: usize| (n as Real + 0.5) * pitch;
    let sites = (0..EDGE.pow(3)).map(|n| Vector::new(at(n % EDGE), at(n / EDGE % EDGE), at(n / EDGE / EDGE)));
    let mut centres: Vec<Vector> = sites.collect();
    for trial in 0..2000 * centres.len() {
        let moved = trial % centres.len();
        let place =
            centres[moved] + 0.3 * (Vector::from_array([0; 3].map(|_| random(&mut state))) - Vector::splat(0.5));
        let apart = |other: &Vector| {
            let way = place - *other;
            (way - edge * (way / edge).round()).length() > 1.01
        };
        if centres.iter().enumerate().all(|(n, other)| n == moved || apart(other)) {
            centres[moved] = place - edge * (place / edge).floor();
        }
    }
    centres
}

/// Drag on a sphere of a random arrangement over `3 pi mu d U`, `U` the superficial velocity, without the mean pressure gradient
/// (Beetstra, van der Hoef and Kuipers 2007, AIChE J. 53, 489).
fn beetstra(reynolds: Real) -> Real {
    let open = 1.0 - SOLID_FRACTION;
    let law = DragParameters { form: DragForm::Beetstra, ..DragParameters::recommended(1.0, 1.0) };
    law.coefficient(1.0, open, reynolds / open) / (3.0 * PI * open)
}

/// Drag over that of Beetstra et al. at the Reynolds number found; the mean over the last two fifths of the run.
fn drag(exchange: Exchange, seed: u64, reynolds: Real, cells_per_diameter: Real) -> Result<Real, String> {
    let (edge, count, open) = (edge(), EDGE.pow(3) as Real, 1.0 - SOLID_FRACTION);
    let n = (cells_per_diameter * edge).round() as usize;
    let grid = Grid::new([n; 3], Vector::ZERO, Vector::splat(edge));
    // The longest of a step: the Courant number decides where it is shorter; in slow flow dx^2/nu.
    let width = edge / n as Real;
    let longest = if reynolds < 1.0 { width * width * reynolds } else { 0.3 * width };
    let mut tank = Tank::new(grid, Boundary::all_periodic(), single(1.0, 1.0 / reynolds), longest);
    // Force on a sphere at this superficial velocity, that of the mean pressure gradient included.
    let force = |speed: Real| beetstra(reynolds * speed) / open * 3.0 * PI / reynolds * speed;
    let wanted = force(1.0);
    tank.gravity = Vector::X * (wanted * count / edge.powi(3));
    tank.exchange = exchange;
    tank.divergence = 1e-8;
    tank.shapes = vec![ball(1.0)?];
    for centre in arrangement(seed) {
        let id = tank.grains.len() as u64;
        tank.grains.push(Grain { motion: Motion::Fixed, ..Grain::new(id, 2.65, centre) });
    }
    let mut solver = tank.solver(|domain, boundary, flow| {
        flow.velocity[0].fill(1.0);
        flow.fill_halos(domain, boundary);
    })?;
    let until = if reynolds < 1.0 { 0.3 * reynolds } else { 5.0 };
    let (mut time, mut sums) = (0.0, [0.0; 2]);
    while time < until * (1.0 - 1e-9) {
        let dt = step(&mut solver, time, until)?.0;
        time += dt;
        if time > 0.6 * until {
            let faces = solver.flow().face_velocity[0].data();
            let domain = solver.domain();
            let flux = domain.sum_rows(&domain.interior(), |row| [faces[row.shifted(0)].iter().sum()])[0];
            sums[0] += dt * flux / (n * n * n) as Real;
            sums[1] += dt;
        }
    }
    Ok(wanted / force(sums[0] / sums[1]))
}

/// Mean over three arrangements, and the largest difference of one from it.
pub(crate) fn random_bed() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for reynolds in [0.1, 10.0, 100.0] {
        for cells in [8.0, 4.0, 2.7, 2.0] {
            let found = [1, 2, 3].map(|seed| drag(Exchange::Surface, seed, reynolds, cells));
            let found = found.into_iter().collect::<Result<Vec<_>, _>>()?;
            let mean = found.iter().sum::<Real>() / found.len() as Real;
            let spread = largest(found.iter().map(|one| (one - mean).abs()));
            let name = format!("Re {reynolds}, {cells} cells");
            rows.push(Measured::new(format!("{name}: drag over Beetstra et al."), mean));
            rows.push(Measured::new(format!("{name}: largest difference of an arrangement from the mean"), spread));
        }
    }
    // Negative control: what back-projection gives.
    rows.push(Measured::new("control: Re 0.1, 2 cells, back-projection", drag(Exchange::Stress, 1, 0.1, 2.0)?));
    Ok(rows)
}
