//! Drops on cells and what is measured of them.

use std::sync::Arc;

use sazanami_dem::Engine;
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{DropVelocity, Flow, Fluids, Schemes};
use sazanami_mics::grains::Coupling;
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::snapshot::GRAINS;
use sazanami_mics::solver::{GridSettings, Solver};
use sazanami_mics::stability::StepLimits;
use sazanami_mics::surface_tension::{Curvature, SurfaceTension};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Communicator, Solo};

use crate::support::no_grains;

pub const SIGMA: Real = 1.0;
pub const FLUIDS: Fluids =
    Fluids { liquid_density: 1.0, gas_density: 1.0, liquid_viscosity: 0.01, gas_viscosity: 0.01 };

/// Share of the cell around `centre` on which `inside` is negative: a function that changes sign at most once along a line in the
/// direction `along`, integrated on 48 x 48 lines.
pub fn share(centre: Vector, edges: Vector, along: usize, inside: impl Fn(Vector) -> Real) -> Real {
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
pub fn fill(
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
    flow.add_liquid(domain, boundary, &beta, |_| Vector::ZERO, DropVelocity::Mass);
}

/// Direction of the largest component.
pub fn largest(v: Vector) -> usize {
    let v = v.abs();
    if v.x >= v.y && v.x >= v.z {
        0
    } else if v.y >= v.z {
        1
    } else {
        2
    }
}

pub fn periodic_box(cells: [usize; 3], size: Vector) -> (Domain, Boundary) {
    let boundary = Boundary::all_periodic();
    (Domain::solo(Grid::new(cells, Vector::ZERO, size), boundary.periodic()), boundary)
}

/// Largest error of the jumps of the pressure across faces, over that by the largest curvature, and the share of cells from columns.
pub fn error_of(
    (domain, boundary): (Domain, Boundary),
    inside: impl Fn(Vector) -> Real + Sync,
    steepest: impl Fn(Vector) -> usize + Sync,
    exact: impl Fn(Vector) -> Real,
) -> (Real, Real) {
    let cells = domain.cells();
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

/// A drop, or a bubble, in a box.
#[derive(Clone, Copy)]
pub struct Case {
    pub cells: [usize; 3],
    pub sides: [[Side; 2]; 3],
    pub fluids: Fluids,
    pub centre: Vector,
    pub semi_axes: Vector,
    pub curvature: Curvature,
    pub divergence: Real,
    /// Contact angles of the walls [degrees].
    pub angles: [[Real; 2]; 3],
}

pub const WALLS: [[Side; 2]; 3] = [[Side::NoSlip; 2]; 3];

impl Case {
    /// A drop of radius 0.3 in a slice of unit edge.
    pub fn slice(n: usize) -> Self {
        Self {
            cells: [n, 1, n],
            sides: [[Side::NoSlip; 2], [Side::Periodic; 2], [Side::NoSlip; 2]],
            fluids: FLUIDS,
            centre: Vector::new(0.5, 0.0, 0.5),
            semi_axes: Vector::new(0.3, Real::INFINITY, 0.3),
            curvature: Curvature::Found,
            divergence: 1e-13,
            angles: [[90.0; 2]; 3],
        }
    }

    pub fn solver(&self, communicator: Box<dyn Communicator>, from: Option<&Snapshot>) -> Solver {
        let width = 1.0 / self.cells[0] as Real;
        let grid = Grid::new(self.cells, Vector::ZERO, width * Vector::from_array(self.cells.map(|n| n as Real)));
        let angles = self.angles.map(|pair| pair.map(|angle| [angle.to_radians(); 2]));
        let boundary = Boundary::new(self.sides).expect("the case is sound").with_contact_angles(angles);
        let domain = Domain::new(grid, boundary.periodic(), communicator).expect("cells for every rank");
        let mut flow = Flow::new(&domain, self.fluids, Schemes::default());
        let scaled = |x: Vector| (x - self.centre) / self.semi_axes;
        let gradient = |x: Vector| (x - self.centre) / (self.semi_axes * self.semi_axes);
        fill(&domain, &boundary, &mut flow, |x| scaled(x).length() - 1.0, |x| largest(gradient(x)));
        let settings = GridSettings {
            gravity: Vector::ZERO,
            limits: StepLimits::up_to(1.0),
            tolerance: Tolerance { divergence: self.divergence, max_iterations: 500 },
            incremental: false,
        };
        let tension = SurfaceTension::new(&domain, &boundary, SIGMA, self.curvature);
        let (shapes, coupling) = (Arc::from([]), Coupling::default());
        match from {
            None => {
                let engine = Engine::new(&domain, no_grains(), &[]).expect("no grains");
                Solver::new(domain, boundary, settings, flow, engine, shapes, coupling)
                    .expect("a drop at rest")
                    .with_surface_tension(Some(tension))
            }
            Some(snapshot) => {
                let engine = Engine::restore(&domain, no_grains(), GRAINS, snapshot).expect("no grains");
                let tension = tension.restore(&domain, snapshot).expect("the snapshot is of this case");
                Solver::restore(domain, boundary, settings, flow, engine, shapes, coupling, snapshot)
                    .expect("the snapshot is of this case")
                    .with_surface_tension(Some(tension))
            }
        }
    }

    pub fn alone(&self) -> Solver {
        self.solver(Box::new(Solo::default()), None)
    }
}

/// Largest velocity component in cells and on faces.
pub fn fastest(solver: &Solver) -> Real {
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
pub fn advance(solver: &mut Solver, steps: usize) -> [Vector; 2] {
    let mut impulses = [Vector::ZERO; 2];
    for _ in 0..steps {
        let step = solver.stable_step();
        let report = solver.step(step, step.dt, |_| {}).expect("a slow flow");
        impulses[0] += report.impulses.surface_tension;
        impulses[1] += report.impulses.surface_tension + report.impulses.walls_on_fluid;
    }
    impulses
}
