//! Surface tension: curvature, the balance of forces at rest, momentum, and the same bits on any ranks and threads and after a restart.

use std::sync::Arc;

use sazanami_dem::{Engine, Interactions, LinearSpringDashpot, Setup};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{DropVelocity, Flow, Fluids, Schemes};
use sazanami_mics::grains::Coupling;
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::snapshot::GRAINS;
use sazanami_mics::solver::{Settings, Solver};
use sazanami_mics::stability::StepLimits;
use sazanami_mics::surface_tension::{Curvature, SurfaceTension};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Communicator, Solo, run_ranks, with_threads};

const SIGMA: Real = 1.0;
const FLUIDS: Fluids = Fluids { liquid_density: 1.0, gas_density: 1.0, liquid_viscosity: 0.01, gas_viscosity: 0.01 };

/// Share of the cell around `centre` on which `inside` is negative: a function that changes sign at most once along a line in the
/// direction `along`, integrated on 48 x 48 lines.
fn share(centre: Vector, edges: Vector, along: usize, inside: impl Fn(Vector) -> Real) -> Real {
    const LINES: u32 = 48;
    let (e, f) = ((along + 1) % 3, (along + 2) % 3);
    let place = |n: u32| (Real::from(n) + 0.5) / Real::from(LINES) - 0.5;
    let mut sum = 0.0;
    for a in 0..LINES {
        for b in 0..LINES {
            let point = |t: Real| {
                let mut point = centre;
                point[e] += place(a) * edges[e];
                point[f] += place(b) * edges[f];
                point[along] += (t - 0.5) * edges[along];
                inside(point)
            };
            let (first, last) = (point(0.0), point(1.0));
            sum += match (first < 0.0, last < 0.0) {
                (true, true) => 1.0,
                (false, false) => 0.0,
                (full_first, _) => {
                    let (mut low, mut high) = (0.0, 1.0);
                    for _ in 0..50 {
                        let middle = 0.5 * (low + high);
                        if (point(middle) < 0.0) == full_first { low = middle } else { high = middle }
                    }
                    if full_first { low } else { 1.0 - low }
                }
            };
        }
    }
    sum / Real::from(LINES * LINES)
}

/// Fills `flow` with the liquid where `inside` is negative, whose gradient has its largest component where `steepest` says.
fn fill(
    domain: &Domain,
    boundary: &Boundary,
    flow: &mut Flow,
    inside: impl Fn(Vector) -> Real + Sync,
    steepest: impl Fn(Vector) -> usize + Sync,
) {
    let edges = domain.grid().spacing;
    let mut beta = domain.field(0.0);
    domain.set(&mut beta, |i, j, k| {
        let centre = domain.centre(i, j, k);
        let corners = (0..8).map(|n| {
            let sign = |bit: u32| if n >> bit & 1 == 1 { 0.5 } else { -0.5 };
            inside(centre + Vector::new(sign(0), sign(1), sign(2)) * edges * 1.5)
        });
        let (low, high) = corners.fold((Real::INFINITY, Real::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if high < 0.0 {
            1.0
        } else if low > 0.0 {
            0.0
        } else {
            share(centre, edges, steepest(centre), &inside)
        }
    });
    flow.add_liquid(domain, boundary, &beta, Vector::ZERO, DropVelocity::Mass);
}

/// Direction of the largest component.
fn largest(v: Vector) -> usize {
    let v = v.abs();
    if v.x >= v.y && v.x >= v.z {
        0
    } else if v.y >= v.z {
        1
    } else {
        2
    }
}

fn periodic_box(cells: [usize; 3], size: Vector) -> (Domain, Boundary) {
    let boundary = Boundary::all_periodic();
    (Domain::solo(Grid::new(cells, Vector::ZERO, size), boundary.periodic()), boundary)
}

/// Largest error of the jumps of the pressure across faces, over that by the largest curvature, and the share of cells from columns.
fn error_of(
    cells: [usize; 3],
    size: Vector,
    inside: impl Fn(Vector) -> Real + Sync,
    steepest: impl Fn(Vector) -> usize + Sync,
    exact: impl Fn(Vector) -> Real,
) -> (Real, Real) {
    let (domain, boundary) = periodic_box(cells, size);
    let mut flow = Flow::new(&domain, FLUIDS, Schemes::default());
    fill(&domain, &boundary, &mut flow, inside, steepest);
    let mut tension = SurfaceTension::new(&domain, &boundary, SIGMA, Curvature::Found);
    tension.find(&domain, &flow, None);
    let c = flow.volume_fraction.data();
    let (mut worst, mut scale): (Real, Real) = (0.0, 0.0);
    for d in 0..3 {
        let (behind, jumps) = (domain.strides()[d] as usize, &tension.jump()[d]);
        for [k, j, i] in
            (0..cells.iter().product()).map(|n: usize| [n / cells[0] / cells[1], n / cells[0] % cells[1], n % cells[0]])
        {
            let at = jumps.at(i as isize, j as isize, k as isize);
            let face =
                domain.centre(i as isize, j as isize, k as isize) - 0.5 * domain.grid().spacing * Vector::AXES[d];
            let (kappa, difference) = (exact(face), c[at] - c[at - behind]);
            worst = worst.max((jumps.data()[at] - SIGMA * kappa * difference).abs());
            scale = scale.max(SIGMA * kappa.abs());
        }
    }
    let report = tension.report(Vector::ZERO);
    (worst / scale, report.by_columns as Real / (report.by_columns + report.by_fit) as Real)
}

#[test]
fn the_curvature_of_a_circle_is_of_second_order() {
    for mirrored in [false, true] {
        let errors = [16, 32, 64].map(|n| {
            let (width, radius) = (1.0 / n as Real, 0.3);
            let centre = Vector::new(0.5031, 0.0, 0.4977);
            let away = |x: Vector| Vector::new(x.x - centre.x, 0.0, x.z - centre.z);
            let sign = if mirrored { -1.0 } else { 1.0 };
            let size = Vector::new(1.0, width, 1.0);
            let inside = |x: Vector| sign * (away(x).length() - radius);
            error_of([n, 1, n], size, inside, |x| largest(away(x)), |_| sign / radius)
        });
        println!("circle: {errors:?}");
        assert!((errors[0].0 / errors[2].0).log2() > 2.0 * 1.8, "{errors:?}");
        assert!(errors[2].0 < 2e-3 && errors[2].1 == 1.0);
    }
}

#[test]
fn the_curvature_of_a_sphere_on_cells_that_are_no_cubes_converges() {
    let errors = [10, 20, 40].map(|n| {
        let (radius, centre) = (0.3, Vector::new(0.503, 0.5011, 0.4977));
        let away = |x: Vector| x - centre;
        let cells = [n, n * 9 / 10, n * 11 / 10];
        error_of(cells, Vector::ONE, |x| away(x).length() - radius, |x| largest(away(x)), |_| 2.0 / radius)
    });
    println!("sphere: {errors:?}");
    // Where the interface is steep in all directions columns do not end; there the fits are of a lower order.
    assert!((errors[0].0 / errors[2].0).log2() > 2.0 * 1.5, "{errors:?}");
    assert!(errors[2].0 < 2e-2 && errors[2].1 > 0.9);
}

#[test]
fn the_curvature_of_a_cosine_is_of_second_order() {
    let wave = std::f64::consts::TAU;
    let height = |x: Real| 0.5 + 0.05 * (wave * x).cos();
    let errors = [16, 32, 64].map(|n: usize| {
        let (domain, boundary) = periodic_box([n, 1, n], Vector::new(1.0, 1.0 / n as Real, 1.0));
        let mut flow = Flow::new(&domain, FLUIDS, Schemes::default());
        fill(&domain, &boundary, &mut flow, |x| x.z - height(x.x), |_| 2);
        let mut tension = SurfaceTension::new(&domain, &boundary, SIGMA, Curvature::Found);
        tension.find(&domain, &flow, None);
        let mut worst: Real = 0.0;
        for i in 0..n as isize {
            let x = wave * domain.centre(i, 0, 0).x;
            let exact = 0.05 * wave * wave * x.cos() / (1.0 + (0.05 * wave * x.sin()).powi(2)).powf(1.5);
            // The box is periodic: the liquid has a flat floor.
            let upper = (n as isize / 4..3 * n as isize / 4).map(|k| flow.volume_fraction.at(i, 0, k));
            let found: Vec<Real> = upper.filter_map(|at| tension.curvature(at)).collect();
            assert!(!found.is_empty());
            worst = found.iter().fold(worst, |worst, kappa| worst.max((kappa - exact).abs()));
        }
        worst / (0.05 * wave * wave)
    });
    println!("cosine: {errors:?}");
    assert!(errors.windows(2).all(|pair| (pair[0] / pair[1]).log2() > 1.8), "{errors:?}");
}

#[test]
fn a_sphere_of_few_cells_has_a_curvature_by_fits() {
    for radius in [1.3, 1.7, 2.4] {
        let centre = Vector::splat(4.0) + Vector::new(0.13, -0.21, 0.08);
        let away = |x: Vector| x - centre;
        let size = Vector::splat(8.0);
        let (error, by_columns) =
            error_of([8; 3], size, |x| away(x).length() - radius, |x| largest(away(x)), |_| 2.0 / radius);
        println!("radius {radius}: {error} {by_columns}");
        assert!(error < 0.5 && by_columns < 1.0);
    }
}

/// A drop, or a bubble, in a box.
#[derive(Clone, Copy)]
struct Case {
    cells: [usize; 3],
    sides: [[Side; 2]; 3],
    fluids: Fluids,
    centre: Vector,
    semi_axes: Vector,
    curvature: Curvature,
    divergence: Real,
}

const WALLS: [[Side; 2]; 3] = [[Side::NoSlip; 2]; 3];

impl Case {
    /// A drop of radius 0.3 in a slice of unit edge.
    fn slice(n: usize) -> Self {
        Self {
            cells: [n, 1, n],
            sides: [[Side::NoSlip; 2], [Side::Periodic; 2], [Side::NoSlip; 2]],
            fluids: FLUIDS,
            centre: Vector::new(0.5, 0.0, 0.5),
            semi_axes: Vector::new(0.3, Real::INFINITY, 0.3),
            curvature: Curvature::Found,
            divergence: 1e-13,
        }
    }

    fn solver(&self, communicator: Box<dyn Communicator>, from: Option<&Snapshot>) -> Solver {
        let width = 1.0 / self.cells[0] as Real;
        let grid = Grid::new(self.cells, Vector::ZERO, width * Vector::from_array(self.cells.map(|n| n as Real)));
        let boundary = Boundary::new(self.sides).expect("the case is sound");
        let domain = Domain::new(grid, boundary.periodic(), communicator).expect("cells for every rank");
        let mut flow = Flow::new(&domain, self.fluids, Schemes::default());
        let scaled = |x: Vector| (x - self.centre) / self.semi_axes;
        let gradient = |x: Vector| (x - self.centre) / (self.semi_axes * self.semi_axes);
        fill(&domain, &boundary, &mut flow, |x| scaled(x).length() - 1.0, |x| largest(gradient(x)));
        let setup = Setup {
            bodies: Vec::new(),
            interactions: Interactions::uniform(0, LinearSpringDashpot::SAND),
            walls: Vec::new(),
            region: [Vector::NEG_INFINITY, Vector::INFINITY],
            ghost_margin: 0.0,
        };
        let settings = Settings {
            gravity: Vector::ZERO,
            limits: StepLimits::up_to(1.0),
            tolerance: Tolerance { divergence: self.divergence, max_iterations: 500 },
            incremental: false,
        };
        let tension = SurfaceTension::new(&domain, &boundary, SIGMA, self.curvature);
        let (shapes, coupling) = (Arc::from([]), Coupling::default());
        match from {
            None => {
                let engine = Engine::new(&domain, setup, &[]).expect("no grains");
                Solver::new(domain, boundary, settings, flow, engine, shapes, coupling)
                    .expect("a drop at rest")
                    .with_surface_tension(Some(tension))
            }
            Some(snapshot) => {
                let engine = Engine::restore(&domain, setup, GRAINS, snapshot).expect("no grains");
                let tension = tension.restore(&domain, snapshot).expect("the snapshot is of this case");
                Solver::restore(domain, boundary, settings, flow, engine, shapes, coupling, snapshot)
                    .expect("the snapshot is of this case")
                    .with_surface_tension(Some(tension))
            }
        }
    }

    fn alone(&self) -> Solver {
        self.solver(Box::new(Solo::default()), None)
    }
}

/// Largest velocity component in cells and on faces.
fn fastest(solver: &Solver) -> Real {
    let domain = solver.domain();
    let flow = solver.flow();
    let of = |field: &[Real]| {
        domain.max_rows(&domain.interior(), |row| {
            field[row.shifted(0)].iter().fold(0.0, |worst: Real, u| worst.max(u.abs()))
        })
    };
    flow.velocity.iter().chain(&flow.face_velocity).map(|field| of(field.data())).fold(0.0, Real::max)
}

/// Takes `steps` steps; returns the impulses by surface tension and those of all.
fn advance(solver: &mut Solver, steps: usize) -> [Vector; 2] {
    let mut impulses = [Vector::ZERO; 2];
    for _ in 0..steps {
        let step = solver.stable_step();
        let report = solver.step(step, step.dt, |_| {}).expect("a slow flow");
        impulses[0] += report.impulses.surface_tension;
        impulses[1] += report.impulses.surface_tension + report.impulses.walls_on_fluid;
    }
    impulses
}

#[test]
fn a_drop_of_given_curvature_stays_at_rest_to_rounding() {
    let heavy = Fluids { liquid_density: 1000.0, ..FLUIDS };
    for (fluids, cells) in [(FLUIDS, [24, 1, 24]), (heavy, [24, 1, 24]), (heavy, [16; 3])] {
        let flat = if cells[1] == 1 { Real::INFINITY } else { 0.3 };
        let kappa = if cells[1] == 1 { 1.0 / 0.3 } else { 2.0 / 0.3 };
        let case = Case {
            cells,
            fluids,
            centre: Vector::new(0.5, if cells[1] == 1 { 0.0 } else { 0.5 }, 0.5),
            semi_axes: Vector::new(0.3, flat, 0.3),
            curvature: Curvature::Given(kappa),
            ..Case::slice(24)
        };
        let mut solver = case.alone();
        advance(&mut solver, 60);
        let scale = (SIGMA / (fluids.liquid_density * 0.6)).sqrt();
        println!("{cells:?} {}: {:e}", fluids.liquid_density, fastest(&solver) / scale);
        assert!(fastest(&solver) / scale < 1e-10);
        let p = solver.pressure();
        let middle = p[[cells[0] as isize / 2, cells[1] as isize / 2, cells[2] as isize / 2]];
        let jump = middle - p[[0, 0, 0]];
        assert!((jump / (SIGMA * kappa) - 1.0).abs() < 1e-10, "{jump}");
    }
    // Negative control: the curvature of an ellipse is not the same everywhere, and it starts to move.
    let mut solver = Case { semi_axes: Vector::new(0.33, Real::INFINITY, 0.27), ..Case::slice(24) }.alone();
    advance(&mut solver, 10);
    assert!(fastest(&solver) > 1e-2, "{}", fastest(&solver));
}

/// Largest kinetic energies, over the surface energy of the sphere, in the four halves of two periods of an eighth of a drop, 8 cells a
/// radius in a gas of a thousandth of its density, that begins longer by `stretch`.
fn swinging(stretch: Real) -> [Real; 4] {
    let (n, ratio) = (16, 1000.0);
    let radius: Real = 0.5;
    // Ohnesorge number mu/sqrt(sigma rho R) = 0.037.
    let viscosity = 0.037 * (SIGMA * radius).sqrt();
    let fluids = Fluids {
        liquid_density: 1.0,
        gas_density: 1.0 / ratio,
        liquid_viscosity: viscosity,
        gas_viscosity: viscosity / ratio,
    };
    let across = radius / (1.0 + stretch).sqrt();
    let case = Case {
        cells: [n; 3],
        sides: [[Side::Slip; 2]; 3],
        fluids,
        centre: Vector::ZERO,
        semi_axes: Vector::new(across, across, radius * (1.0 + stretch)),
        divergence: 1e-9,
        ..Case::slice(n)
    };
    let mut solver = case.alone();
    // Lamb (1932), art. 275.
    let half = std::f64::consts::PI / (24.0 * SIGMA / (radius.powi(3) * (3.0 + 2.0 / ratio))).sqrt();
    let sphere = SIGMA * 0.5 * std::f64::consts::PI * radius * radius;
    let mut time = 0.0;
    let mut largest: [Real; 4] = [0.0; 4];
    while time < 4.0 * half {
        let step = solver.stable_step();
        solver.step(step, step.dt, |_| {}).expect("a slow flow");
        time += step.dt;
        let largest = &mut largest[((time / half) as usize).min(3)];
        *largest = largest.max(solver.flow().kinetic_energy(solver.domain()) / sphere);
    }
    largest
}

#[test]
fn a_drop_in_light_gas_swings_with_ever_less_energy() {
    let energies = swinging(0.05);
    println!("{energies:?}");
    // The lowest mode alone loses a third in half a period (Lamb 1932, art. 355).
    assert!(energies.windows(2).all(|pair| (0.5..0.85).contains(&(pair[1] / pair[0]))), "{energies:?}");
    // Negative control: a sphere hardly moves.
    let still = swinging(0.0);
    println!("{still:?}");
    assert!(still[3] < 1e-3 * energies[3], "{still:?}");
}

#[test]
fn the_momentum_of_all_forces_is_what_the_fluid_has() {
    let fluids = Fluids { liquid_density: 10.0, ..FLUIDS };
    let case = Case {
        cells: [12, 12, 12],
        sides: WALLS,
        fluids,
        centre: Vector::new(0.5, 0.45, 0.2),
        semi_axes: Vector::new(0.3, 0.22, 0.26),
        ..Case::slice(12)
    };
    let mut solver = case.alone();
    let [tension, all] = advance(&mut solver, 12);
    let momentum: Vector = solver.flow().momentum(solver.domain()).into_iter().sum();
    assert!((momentum - all).length() < 1e-11 * tension.length(), "{momentum} {all} {tension}");
    // Negative control: the wall at which the interface ends holds the drop.
    assert!((momentum - (all - tension)).length() > 1e-3 * tension.length());
}

fn bits(snapshot: &Snapshot) -> Vec<(String, Vec<u64>)> {
    let fields =
        ["volume_fraction", "velocity_1", "velocity_2", "velocity_3", "surface_tension_1", "surface_tension_3"];
    let all = fields.map(|name| format!("fluid/{name}"));
    let bits_of = |name: &String| snapshot.reals(name).expect("the field").iter().map(|v| v.to_bits()).collect();
    all.iter().map(|name| (name.clone(), bits_of(name))).collect()
}

/// An ellipsoid that touches a wall and lies across ranks; not converged as far as rounding.
fn oblique() -> Case {
    Case {
        cells: [14, 12, 10],
        sides: [[Side::Periodic; 2], [Side::NoSlip; 2], [Side::NoSlip; 2]],
        fluids: Fluids { liquid_density: 50.0, ..FLUIDS },
        centre: Vector::new(0.55, 0.41, 0.15),
        semi_axes: Vector::new(0.31, 0.2, 0.24),
        divergence: 1e-12,
        ..Case::slice(14)
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let run = |threads: usize| {
        with_threads(threads, || {
            let mut solver = oblique().alone();
            advance(&mut solver, 6);
            bits(&solver.snapshot())
        })
        .expect("threads")
    };
    let one = run(1);
    assert!(one == run(3));
}

#[test]
fn curvature_and_jump_are_the_same_bits_on_any_ranks() {
    let jumps = |ranks: usize| {
        let all = run_ranks(ranks, 1, |c| {
            let case = oblique();
            let mut solver = case.solver(c, None);
            // Far from each other only by the rounding of the pressure's sums: the first step alone.
            let step = solver.stable_step();
            solver.step(step, step.dt, |_| {}).expect("a slow flow");
            solver.snapshot()
        })
        .expect("ranks");
        let snapshot = &all[0];
        ["fluid/volume_fraction", "fluid/surface_tension_1", "fluid/surface_tension_2", "fluid/surface_tension_3"]
            .map(|name| snapshot.reals(name).expect("the field").iter().map(|v| v.to_bits()).collect::<Vec<_>>())
    };
    let one = jumps(1);
    assert!(one[1].iter().any(|&bits| f64::from_bits(bits) != 0.0));
    for ranks in [2, 4] {
        assert!(one == jumps(ranks), "{ranks} ranks");
    }
}

#[test]
fn a_run_goes_on_from_a_snapshot_bit_by_bit() {
    let case = oblique();
    let mut solver = case.alone();
    advance(&mut solver, 4);
    let half = solver.snapshot();
    advance(&mut solver, 4);
    let mut again = case.solver(Box::new(Solo::default()), Some(&half));
    advance(&mut again, 4);
    assert!(bits(&solver.snapshot()) == bits(&again.snapshot()));
    assert!(bits(&half) != bits(&solver.snapshot()));
}

#[test]
fn the_energy_of_a_sphere_is_that_of_its_area() {
    let solver = Case {
        cells: [24; 3],
        centre: Vector::new(0.51, 0.5, 0.49),
        semi_axes: Vector::splat(0.3),
        sides: WALLS,
        ..Case::slice(24)
    }
    .alone();
    let exact = SIGMA * 4.0 * std::f64::consts::PI * 0.09;
    let error = solver.surface_energy() / exact - 1.0;
    assert!(error.abs() < 5e-3, "{error}");
    let flat = Case { semi_axes: Vector::new(Real::INFINITY, Real::INFINITY, 0.25), ..Case::slice(8) }.alone();
    assert!((flat.surface_energy() - 2.0 * SIGMA / 8.0).abs() < 1e-12, "{}", flat.surface_energy());
}
