//! Liquid carried by a prescribed velocity back to where it started.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use sazanami_mics::advection::Convection;
use sazanami_mics::ball::ball;
use sazanami_mics::boundary::Boundary;
use sazanami_mics::carrying::CarryingFlow;
use sazanami_mics::flow::{Flow, Fluids, Schemes};
use sazanami_mics::interface::ResidueReport;

/// Errors of a shape that came back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeError {
    /// Sum of `|C - C_0|` times the cell volume.
    pub shape: Real,
    /// Change of the volume over the volume; what was cut with the residue is not counted.
    pub volume: Real,
    /// Smallest and largest fraction met after any step.
    pub range: [Real; 2],
    /// Mixed-cell residue over the whole run.
    pub residue: ResidueReport,
    /// Steps taken.
    pub steps: usize,
}

/// A sphere of radius 0.25 carried along the diagonal of a periodic unit cube of `n`^3 cells once.
#[must_use]
pub fn translation(n: usize) -> ShapeError {
    let grid = Grid::new([n; 3], Vector::ZERO, Vector::ONE);
    let shape = (Vector::new(0.5, 0.45, 0.55), 0.25);
    carry(
        grid,
        Boundary::all_periodic(),
        shape,
        (1.0, 0.43 / 3.0 / n as Real),
        CarryingFlow::Uniform { velocity: Vector::ONE },
    )
}

/// The reversed single vortex of Rider and Kothe (1998) with period 8 on `n` x `n` cells: a circle of
/// radius 0.15 at (0.5, 0.75).
#[must_use]
pub fn reversed_vortex(n: usize) -> ShapeError {
    let h = 1.0 / n as Real;
    // x2 is the thin direction; the flow is in x1 and x3.
    let grid = Grid::new([n, 1, n], Vector::ZERO, Vector::new(1.0, h, 1.0));
    let shape = (Vector::new(0.5, 0.0, 0.75), 0.15);
    let period = 8.0;
    let vortex = CarryingFlow::ReversedVortex { speed: 1.0, period };
    carry(grid, thin(1), shape, (period, 0.4 * h), vortex)
}

/// The three-dimensional deformation of LeVeque (1996) with period 3 on `n`^3 cells: a sphere of
/// radius 0.15 at (0.35, 0.35, 0.35).
#[must_use]
pub fn deformation(n: usize) -> ShapeError {
    let h = 1.0 / n as Real;
    let grid = Grid::new([n; 3], Vector::ZERO, Vector::ONE);
    let shape = (Vector::splat(0.35), 0.15);
    let period = 3.0;
    let deformation = CarryingFlow::Deformation { speed: 1.0, period };
    carry(grid, Boundary::closed(), shape, (period, 0.16 * h), deformation)
}

/// Walls all round, but periodic in the thin direction.
fn thin(direction: usize) -> Boundary {
    let mut sides = *Boundary::closed().sides();
    sides[direction] = [sazanami_mics::boundary::Side::Periodic; 2];
    Boundary::new(sides).expect("both sides are periodic")
}

/// Carries a ball of liquid for `time` in steps of about `dt` with the `velocity` of the middle of a step.
fn carry(
    grid: Grid,
    boundary: Boundary,
    (centre, radius): (Vector, Real),
    (time, dt): (Real, Real),
    velocity: CarryingFlow,
) -> ShapeError {
    let domain = Domain::solo(grid, boundary.periodic());
    let fluids = Fluids { liquid_density: 1e3, gas_density: 1.0, liquid_viscosity: 0.0, gas_viscosity: 0.0 };
    let schemes = Schemes { convection: Convection::Off, ..Schemes::default() };
    let mut flow = Flow::new(&domain, fluids, schemes);
    flow.volume_fraction = ball(&domain, centre, radius, 16);
    let start = flow.volume_fraction.clone();
    let volume = flow.liquid_volume(&domain);
    let steps = (time / dt).ceil() as usize;
    let dt = time / steps as Real;
    let mut residue = ResidueReport::default();
    let mut range: [Real; 2] = [0.0, 1.0];
    for step in 0..steps {
        velocity.set_faces(&domain, (step as Real + 0.5) * dt, &mut flow.face_velocity);
        residue = residue.and(flow.transport(&domain, &boundary, dt).residue);
        let c = flow.volume_fraction.data();
        let extreme = |sign: Real| {
            domain.max_rows(&domain.interior(), |row| c[row.shifted(0)].iter().fold(-1.0, |a, c| a.max(sign * c)))
        };
        range = [range[0].min(-extreme(-1.0)), range[1].max(extreme(1.0))];
    }
    let (c, c0) = (flow.volume_fraction.data(), start.data());
    let [difference] =
        domain.sum_rows(&domain.interior(), |row| [row.shifted(0).map(|at| (c[at] - c0[at]).abs()).sum()]);
    // Per unit of depth where the grid is one cell thick.
    let depth: Real = (0..3).filter(|&d| grid.cells[d] == 1).map(|d| grid.spacing[d]).product();
    ShapeError {
        shape: difference * grid.cell_volume() / depth,
        volume: (flow.liquid_volume(&domain) - volume - residue.clipped_volume) / volume,
        range,
        residue,
        steps,
    }
}
