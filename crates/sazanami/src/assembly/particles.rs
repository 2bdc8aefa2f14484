//! Water as moving particles: tank, scheme, coupling, and the fluid where it begins.

use sazanami_dem::{Body, Setup};
use sazanami_mps::filling;
use sazanami_mps::grains::{Coupling, DragParameters, Forchheimer, GrainPhase};
use sazanami_mps::pressure::Tolerance;
use sazanami_mps::scheme::{Fluid, Scheme, Stabilisation};
use sazanami_mps::solver::{FluidParticle, Settings};
use sazanami_mps::stability::StepLimits;
use sazanami_numerics::domain::{Domain, LayoutError};
use sazanami_numerics::geometry::{Region, Shape};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::Communicator;

use super::{fluid, grains};
use crate::case::meaning::{BoundarySide, Case, FluidName, GrainShape, Population, PressureForce, StabilisationWeight};

/// Cells of the division into ranks, over the radius of influence.
const CELL: Real = 0.56;
/// Room around a rank's part for the way of grains within a step, over the largest diameter.
const GRAIN_WAY: Real = 0.6;
/// Places in each direction at which the void fraction of a height is taken, over the smoothing radius.
const PLACES: Real = 1.0;

/// Cells by which the tank is divided among ranks.
pub(crate) fn grid(case: &Case) -> Grid {
    let particles = case.moving_particles();
    let cell = CELL * particles.radius * particles.spacing;
    let extent = case.domain.extent();
    let cells = [0, 1, 2].map(|d| ((extent[d] / cell).floor() as usize).max(2));
    Grid::new(cells, case.domain.lower, case.domain.upper)
}

/// The tank divided among the ranks of a group.
pub(crate) fn domain(case: &Case, communicator: Box<dyn Communicator>) -> Result<Domain, LayoutError> {
    let periodic = case.boundary.map(|sides| sides[0] == BoundarySide::Periodic);
    Domain::new(grid(case), periodic, communicator)
}

/// How fluid and step are computed.
pub(crate) fn settings(case: &Case, level: Real) -> Settings {
    let p = case.moving_particles();
    let liquid = case.fluid.liquid;
    let middle = 0.5 * (case.domain.lower + case.domain.upper);
    let stabilised = |weighted| Some(Stabilisation { distance: p.stabilisation_distance, weighted });
    Settings {
        fluid: Fluid { density: liquid.density, viscosity: liquid.viscosity / liquid.density, spacing: p.spacing },
        scheme: Scheme {
            projection: p.projection,
            weight: p.weight,
            radius: p.radius,
            source: p.source,
            surface_pressure: p.surface_pressure,
            surface_test: p.surface_test,
            laplacian: p.laplacian,
            compensation: p.compensation,
            relaxation: if p.relaxation > 0.0 { p.relaxation } else { Real::INFINITY },
            gradient: p.gradient,
            stabilisation: match p.stabilisation {
                StabilisationWeight::Weighted => stabilised(true),
                StabilisationWeight::Full => stabilised(false),
                StabilisationWeight::Off => None,
            },
            shifting: p.shifting,
            reduced_pressure: p.reduced_pressure,
        },
        limits: StepLimits { courant: p.courant, longest: p.dt_max, fixed: p.dt },
        tolerance: Tolerance { strain: p.tolerance, most_iterations: p.pressure_iterations },
        reference: Vector::new(middle.x, middle.y, level),
    }
}

/// How grains and fluid act on each other.
pub(crate) fn coupling(case: &Case) -> Coupling {
    let overlap = &case.overlap;
    let liquid = case.fluid.liquid;
    Coupling {
        drag: DragParameters {
            form: overlap.drag,
            kozeny: overlap.kozeny,
            forchheimer: overlap.forchheimer.map_or(Forchheimer::Ergun, Forchheimer::Constant),
            sphere: overlap.sphere_drag,
            reference: overlap.density_reference,
            blend: overlap.blend,
            ..DragParameters::recommended(liquid.density, liquid.viscosity)
        },
        smoothing: overlap.smoothing,
        least_void: overlap.least_void,
        implicit_pressure_force: overlap.pressure_force == PressureForce::Implicit,
        substeps: case.dem.substeps,
    }
}

/// Spheres as the engine knows them, whatever mesh they would have.
pub(crate) fn bodies(case: &Case) -> Vec<Body> {
    let radius = |population: &Population| match population.shape {
        GrainShape::Sphere { diameter, .. } => 0.5 * diameter,
        _ => unreachable!("only spheres are accepted with the case"),
    };
    case.grains.iter().map(|population| Body::ball(radius(population))).collect()
}

/// What the engine of the grains needs.
pub(crate) fn setup(case: &Case, shapes: &[Shape]) -> Setup {
    let particles = case.moving_particles();
    let largest = case.grains.iter().filter_map(|p| Some(p.shape.size()? * p.size.largest())).fold(0.0, Real::max);
    let cutoff = case.overlap.smoothing.max(particles.radius * particles.spacing);
    let mut setup =
        Setup { bodies: bodies(case), ghost_margin: cutoff + GRAIN_WAY * largest, ..grains::setup(case, shapes) };
    if case.walls_move() {
        // Seen from the laboratory grains go wherever the tank goes.
        setup.region = [Vector::NEG_INFINITY, Vector::INFINITY];
    }
    setup
}

/// Highest level of liquid at the start \[m]; the floor without liquid.
pub(crate) fn level(case: &Case, bed_height: Real) -> Real {
    let tops = case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid).map(|liquid| {
        let origin = fluid::origin_of(liquid, case.bed.axis, bed_height);
        (origin.z + liquid.region.heights()[1]).min(case.domain.upper.z)
    });
    tops.fold(case.domain.lower.z, Real::max)
}

/// Fluid particles of the liquid at the start, between grains as many as their voids hold. All ranks take part and
/// have the same particles.
pub(crate) fn fill(case: &Case, domain: &Domain, grains: &GrainPhase, bed_height: Real) -> Vec<FluidParticle> {
    let (lower, upper) = (case.domain.lower, case.domain.upper);
    let spacing = case.moving_particles().spacing;
    let extent = upper - lower;
    let step = PLACES * case.overlap.smoothing.min(extent.min_element());
    let counts = [0, 1].map(|d| ((extent[d] / step).ceil() as usize).max(1));
    let me = domain.communicator().rank();
    let void = |z: Real| {
        let mut sums = [0.0; 2];
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                let part = |n: usize, d: usize| lower[d] + (n as Real + 0.5) / counts[d] as Real * extent[d];
                let place = Vector::new(part(i, 0), part(j, 1), z);
                if domain.owner_of(place) == me {
                    sums[0] += grains.void_fraction(place);
                    sums[1] += 1.0;
                }
            }
        }
        let [sum, count] = domain.sum(sums);
        sum / count
    };
    let regions: Vec<(Region, FluidName, Vector)> = case
        .liquids
        .iter()
        .map(|liquid| {
            let origin = fluid::origin_of(liquid, case.bed.axis, bed_height);
            (liquid.region.moved(origin).geometry(), liquid.fluid, liquid.velocity)
        })
        .collect();
    let places = filling::layers(lower, upper, level(case, bed_height), spacing, void);
    places
        .into_iter()
        .filter_map(|position| {
            // Later regions overwrite earlier ones.
            let (_, fluid, velocity) = regions.iter().rev().find(|(region, ..)| region.contains(position))?;
            (*fluid == FluidName::Liquid).then_some(FluidParticle { position, velocity: *velocity })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use sazanami_mps::grains::DragForm;

    use super::*;

    #[test]
    fn the_drag_law_of_the_case_is_that_of_the_grains() {
        let text = "solver = \"mps\"\n[domain]\nsize = [\"9 mm\", \"9 mm\", \"9 mm\"]\n[run]\nuntil = \"1 ms\"\n\
                    [particles]\nspacing = \"1 mm\"\n";
        let kappa = |law: &[&str]| {
            let overrides: Vec<String> = law.iter().map(|text| (*text).to_owned()).collect();
            let loaded = sazanami_case::parse(Path::new("c.toml"), text, &overrides).expect("the case is complete");
            let drag = coupling(&loaded.case).drag;
            (drag.form, drag.coefficient(1e-3, 0.6, 0.1))
        };
        let (form, di_felice) = kappa(&["overlap.drag=di_felice"]);
        assert_eq!(form, DragForm::DiFelice);
        // C_D = (0.63 + 4.8/sqrt(60))^2, kappa = V 3/4 C_D rho s/d eps^(2 - beta).
        let beta = 3.7 - 0.65 * (-0.5 * (1.5 - 60.0_f64.log10()).powi(2)).exp();
        let single = std::f64::consts::PI / 8.0 * (0.63 + 4.8 / 60.0_f64.sqrt()).powi(2) * 1e-6 * 1000.0 * 0.1;
        let liquid = kappa(&[]);
        assert!((di_felice / (single * 0.6_f64.powf(2.0 - beta)) - 1.0).abs() < 0.02, "{di_felice}");
        assert!(liquid.0 == DragForm::Blend && (liquid.1 / di_felice - 1.0).abs() > 0.05, "{liquid:?}");
    }
}
