//! Free grains under friction that is stiff: their speed does not ring, whatever the step.

use sazanami_dem::{Body, Engine, Grain, Interactions, LinearSpringDashpot, Setup, Substeps};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{Flow, Fluids, Schemes};
use sazanami_mics::grains::room::LiquidRoom;
use sazanami_mics::grains::{Coupling, Exchange, SurfaceFriction, TorqueArm, Weighting};
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::solver::{Settings, Solver};
use sazanami_mics::stability::StepLimits;
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, VolumeFractionMethod, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

/// Speeds of a sphere that settles in a box of 10 x 10 x 24 cells of width 1, gravity 0.02, kinematic viscosity 1, in steps
/// of `step` for 60 units of time.
fn settle(diameter: Real, ratio: Real, step: Real, end: Real) -> Result<Vec<Real>, String> {
    let grid = Grid::new([10, 10, 24], Vector::ZERO, Vector::new(10.0, 10.0, 24.0));
    let boundary =
        Boundary::new([[Side::Periodic; 2], [Side::Periodic; 2], [Side::NoSlip; 2]]).expect("the case is sound");
    let domain = Domain::solo(grid, boundary.periodic());
    let fluids = Fluids { liquid_density: 1.0, gas_density: 1.0, liquid_viscosity: 1.0, gas_viscosity: 1.0 };
    let schemes = Schemes { viscosity: ViscosityScheme::Implicit, ..Schemes::default() };
    let mut flow = Flow::new(&domain, fluids, schemes);
    flow.volume_fraction.fill(1.0);
    flow.fill_halos(&domain, &boundary);
    let shape =
        Shape::sphere(diameter, 3, VolumeRule::Preserve, &ContactSphereRule::Single).expect("the case is sound");
    let grain = Grain::new(0, ratio, Vector::new(5.13, 4.87, 14.21));
    let setup = Setup {
        bodies: vec![Body::from(&shape)],
        interactions: Interactions::uniform(1, LinearSpringDashpot::SAND),
        walls: Vec::new(),
        region: [Vector::ZERO, grid.upper()],
        ghost_margin: 2.0,
    };
    let engine = Engine::new(&domain, setup, &[grain]).expect("the case is sound");
    let settings = Settings {
        gravity: Vector::new(0.0, 0.0, -0.02),
        limits: StepLimits::always(step),
        tolerance: Tolerance { divergence: 1e-9, ..Tolerance::default() },
        incremental: false,
    };
    let coupling = Coupling {
        exchange: Exchange::Surface,
        friction: SurfaceFriction::HydraulicRadiusSlip,
        room: LiquidRoom::Whole,
        weighting: Weighting::Mass,
        volume_fraction: VolumeFractionMethod::default(),
        torque_arm: TorqueArm::Centroid,
        substeps: Substeps::Fixed(1),
    };
    let mut solver = Solver::new(domain, boundary, settings, flow, engine, vec![shape].into(), coupling)
        .map_err(|e| e.to_string())?;
    let mut speeds = Vec::new();
    for _ in 0..(end / step).round() as usize {
        let next = solver.stable_step();
        solver.step(next, step, |_| ()).map_err(|e| e.to_string())?;
        speeds.push(-solver.grains().engine().grains().velocity[0].z);
        if speeds[speeds.len() - 1].abs() > 1.0 {
            return Err(format!("out: {speeds:.4?}"));
        }
    }
    Ok(speeds)
}

#[test]
fn table() {
    for (diameter, ratio) in [(1.5, 2.65), (2.5, 2.65), (1.5, 1.1), (4.0, 1.1), (2.5, 0.5), (2.5, 0.1)] {
        for step in [0.02, 0.1, 0.25, 1.0, 4.0] {
            match settle(diameter, ratio, step, 60.0) {
                Ok(speeds) => {
                    let last = *speeds.last().expect("steps");
                    let peak = speeds.iter().fold(0.0, |a: Real, b| a.max(b.abs()));
                    let variation: Real = std::iter::once(&0.0)
                        .chain(&speeds)
                        .collect::<Vec<_>>()
                        .windows(2)
                        .map(|p| (p[1] - p[0]).abs())
                        .sum();
                    println!(
                        "{diameter} {ratio} step {step}: {last:.6} peak {peak:.6} variation {:.3}",
                        (variation - (peak - last.abs())) / peak
                    );
                }
                Err(error) => println!("{diameter} {ratio} step {step}: {}", &error[..error.len().min(120)]),
            }
        }
    }
}
