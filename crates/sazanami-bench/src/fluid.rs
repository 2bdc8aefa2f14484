//! Pressure and the whole fluid step, on the paper's grid.

use sazanami_dem::Engine;
use sazanami_mics::ball::ball;
use sazanami_mics::solver::{Phase, Solver};
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::{Field, Grid};
use sazanami_numerics::linear::{ConjugateGradient, FaceEquation, Solution, Stop};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::Solo;
use sazanami_posing::assembly::{fluid, grains, shared};
use sazanami_posing::case::meaning::{Case, Placement, StepChoice};

use crate::beds;
use crate::machine::floor_of_bytes;
use crate::stopwatch::{Lap, Stopwatch};
use crate::timing::{Timing, shares};

/// The paper's grid and box \[m].
const CELLS: [usize; 3] = [176, 184, 132];
const SIZE: [Real; 3] = [33.8e-3, 33.8e-3, 25e-3];
/// Diameter \[m] and speed [m/s] of the drop, and the step \[s].
const DROP: Real = 5.5e-3;
const SPEED: Real = 9.0;
const STEP: Real = 1e-5;
/// Density of the liquid over that of the gas, less one.
const JUMP: Real = 999.0;
/// Number of timed runs of each kernel.
const RUNS: usize = 7;

/// Bytes per cell that an iteration moves at least, in single precision: it passes over the finest level twice, once
/// for direction, step, residual and the way down, once for the way up and the sums (85 in all); coarser levels 8.
const ITERATION_BYTES: Real = 93.0;
/// Bytes per cell of a true residual: coefficients, right-hand side and unknown in double precision in, residual in
/// single precision out, and what moves along with it.
const RESIDUAL_BYTES: Real = 52.0;
/// Bytes per cell of the set-up: coefficients of all levels and their diagonals.
const SETUP_BYTES: Real = 80.0;
/// Bytes per cell of a sweep of the transport: liquid fraction, velocity and a face velocity in, four fields out.
const SWEEP_BYTES: Real = 72.0;
/// Bytes per cell of a pass of the viscosity: velocity and density in, velocity out.
const DIFFUSION_BYTES: Real = 56.0;
/// Bytes per cell of the predicted faces: velocity and density in, faces out.
const FACES_BYTES: Real = 56.0;
/// Bytes per cell of the correction: pressure, density, velocity and faces in, the last two out.
const CORRECTION_BYTES: Real = 112.0;

fn solve_bytes(iterations: usize, evaluations: usize) -> Real {
    iterations as Real * ITERATION_BYTES + evaluations as Real * RESIDUAL_BYTES + SETUP_BYTES
}

/// Face coefficients and right-hand side of `-div(grad p / rho) = -div(u) / dt` for the drop in air, in the middle of the box.
fn problem(domain: &Domain) -> ([Field<Real>; 3], Field<Real>) {
    let spacing = domain.grid().spacing;
    let liquid = ball(domain, 0.5 * Vector::from_array(SIZE), 0.5 * DROP, 4);
    let mut faces: [Field<Real>; 3] = std::array::from_fn(|_| domain.field(0.0));
    for (d, faces) in faces.iter_mut().enumerate() {
        let step: [isize; 3] = std::array::from_fn(|e| isize::from(e == d));
        domain.set(faces, |i, j, k| {
            if [i, j, k][d] == 0 {
                return 0.0;
            }
            let mean = 0.5 * (liquid[[i, j, k]] + liquid[[i - step[0], j - step[1], k - step[2]]]);
            1.0 / ((1.0 + JUMP * mean) * spacing[d] * spacing[d])
        });
    }
    let top = domain.cells()[2] as isize;
    let flux = |i: isize, j: isize, k: isize| {
        if k == 0 || k == top { 0.0 } else { -SPEED * 0.5 * (liquid[[i, j, k]] + liquid[[i, j, k - 1]]) }
    };
    let mut right = domain.field(0.0);
    domain.set(&mut right, |i, j, k| -(flux(i, j, k + 1) - flux(i, j, k)) / (spacing.z * STEP));
    (faces, right)
}

/// Pressure of a drop of 5.5 mm at 9 m/s in air, in a closed box, to a relative residual of 1e-6 from zero; set-up of
/// all levels included.
pub(crate) fn pressure_solve() -> Result<Timing, String> {
    let domain = Domain::solo(Grid::new(CELLS, Vector::ZERO, Vector::from_array(SIZE)), [false; 3]);
    let (faces, right) = problem(&domain);
    let equation =
        FaceEquation { faces: faces.each_ref(), right_hand_side: &right, ghosts: &GhostRules::EVEN, singular: true };
    let mut solver = ConjugateGradient::new(&domain);
    let mut p = domain.field(0.0);
    let mut solution = Solution::default();
    let mut timing = Timing::of_laps(RUNS, |_| {
        p.fill(0.0);
        let watch = Stopwatch::start();
        solution =
            solver.solve(&domain, &equation, &mut p, Stop::Relative(1e-6), 200).map_err(|error| error.to_string())?;
        Ok(watch.stop())
    })?;
    timing.size = format!(
        "{} x {} x {} cells, density ratio 1000, {} iterations, true relative residual {:.1e}",
        CELLS[0], CELLS[1], CELLS[2], solution.iterations, solution.relative
    );
    let bytes = domain.grid().len() as Real * solve_bytes(solution.iterations, solution.evaluations);
    let (floor, how) = floor_of_bytes(bytes, "two passes over the finest level an iteration, single precision");
    Ok(timing.with_floor(floor, how))
}

/// Seconds in the phases of steps, in the order of [`Phase`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Phases {
    seconds: [Real; 4],
}

impl Phases {
    /// Steps the solver once more and adds up its phases; the length of the step \[s] and a lap.
    pub(crate) fn step(&mut self, solver: &mut Solver) -> Result<Stepped, String> {
        let begin = std::time::Instant::now();
        let mut now = (Phase::Fluid, begin);
        let step = solver.stable_step();
        let watch = Stopwatch::start();
        let seconds = &mut self.seconds;
        let report = solver
            .step(step, step.dt, |phase| {
                let time = std::time::Instant::now();
                seconds[now.0 as usize] += (time - now.1).as_secs_f64();
                now = (phase, time);
            })
            .map_err(|error| error.to_string())?;
        self.seconds[now.0 as usize] += now.1.elapsed().as_secs_f64();
        let lap = watch.stop();
        Ok(Stepped { report, dt: step.dt, lap })
    }

    /// Shares of the phases that took any time, in words.
    pub(crate) fn in_words(&self) -> String {
        let [fluid, pressure, grains, coupling] = self.seconds;
        shares(&[
            ("transport and viscosity", fluid),
            ("pressure", pressure),
            ("grains", grains),
            ("coupling", coupling),
        ])
    }
}

/// A step that was timed.
pub(crate) struct Stepped {
    pub report: sazanami_mics::solver::StepReport,
    pub dt: Real,
    pub lap: Lap,
}

/// The paper's drop in the middle of its box, without grains, in steps of at most 1e-5 s.
fn drop_alone() -> Result<(Case, Solver), String> {
    let mut case = beds::paper_case()?;
    case.grains.clear();
    let centre = 0.5 * (case.domain.lower + case.domain.upper);
    let drop = case.liquids.first_mut().ok_or("the paper's case has no drop")?;
    drop.placement = Placement::Absolute(centre);
    drop.velocity = Vector::new(0.0, 0.0, -SPEED);
    case.fluid.step = StepChoice::Adaptive { longest: STEP, first: STEP, growth: 1.2 };
    let domain = shared::domain(&case, Box::<Solo>::default()).map_err(|error| error.to_string())?;
    let engine = Engine::new(&domain, grains::setup(&case, &[]), &[]).map_err(|error| error.to_string())?;
    let boundary = fluid::boundary(&case).map_err(|error| error.to_string())?;
    let solver = fluid::solver(&case, boundary, domain, engine, [].into(), 0.0).map_err(|error| error.to_string())?;
    Ok((case, solver))
}

/// Steps of the drop on its way through the air.
pub(crate) fn fluid_step() -> Result<Timing, String> {
    let (case, mut solver) = drop_alone()?;
    let mut phases = Phases::default();
    let mut bytes = 0.0;
    let (mut iterations, mut dt) = (0, 0.0);
    let mut timing = Timing::of_laps(RUNS, |run| {
        if run == 1 {
            (phases, iterations, bytes) = (Phases::default(), 0, 0.0);
        }
        let stepped = phases.step(&mut solver)?;
        let report = &stepped.report;
        iterations += report.pressure.iterations;
        dt = stepped.dt;
        bytes += solve_bytes(report.pressure.iterations, 2)
            + 3.0 * SWEEP_BYTES
            + report.diffusion.iterations as Real * DIFFUSION_BYTES
            + FACES_BYTES
            + CORRECTION_BYTES;
        Ok(stepped.lap)
    })?;
    let n = case.domain.cells;
    timing.size = format!(
        "{} x {} x {} cells, drop of 5.54 mm at 9 m/s, step {dt:.2e} s, {:.1} pressure iterations; {}",
        n[0],
        n[1],
        n[2],
        iterations as Real / RUNS as Real,
        phases.in_words()
    );
    let bytes = bytes / RUNS as Real * case.domain.cell_count() as Real;
    let (floor, how) = floor_of_bytes(bytes, "every phase streams its fields once a sweep, pass or iteration");
    Ok(timing.with_floor(floor, how))
}
