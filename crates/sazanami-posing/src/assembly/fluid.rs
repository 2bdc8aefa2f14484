//! The fluid side of a case: boundary, schemes, limits of the step, initial liquid.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use sazanami_dem::Engine;
use sazanami_mics::advection::Convection;
use sazanami_mics::boundary::{Boundary, BoundaryError};
use sazanami_mics::flow::{Carrier, Flow, Fluids, Schemes};
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::solver::{self, GridSettings, StepError};
use sazanami_mics::stability::StepLimits;
use sazanami_mics::surface_tension::{Curvature, SurfaceTension};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{Region, RegionFractions, Shape};
use sazanami_numerics::mean_flow::MeanFlow;
use sazanami_numerics::{Real, Vector};

use super::box_motion;
use crate::case::meaning::{
    Case, Exchange, FluidName, LiquidRegion, Placement, Population, PressureForm, Solver, StepChoice,
};

/// The sides of the box, with gravity outside and the contact angles of its walls.
///
/// # Errors
/// [`BoundaryError`] if the sides contradict each other.
pub fn boundary(case: &Case) -> Result<Boundary, BoundaryError> {
    let (angles, receding) =
        (case.fluid.contact_angle.unwrap_or_default(), case.fluid.receding_angle.unwrap_or_default());
    let pair = |d: usize, upper: usize| {
        let side = &case.boundary[d][upper];
        let advancing = angles.at(d, upper, side).unwrap_or(FRAC_PI_2);
        [advancing, receding.at(d, upper, side).unwrap_or(advancing)]
    };
    // The fluid outside open sides does not move with the box.
    Ok(Boundary::new(case.boundary)?
        .with_gravity_outside(case.gravity)
        .with_contact_angles([0, 1, 2].map(|d| [pair(d, 0), pair(d, 1)])))
}

/// Properties of the two fluids.
pub(crate) fn fluids(case: &Case) -> Fluids {
    Fluids {
        liquid_density: case.fluid.liquid.density,
        gas_density: case.fluid.gas.density,
        liquid_viscosity: case.fluid.liquid.viscosity,
        gas_viscosity: case.fluid.gas.viscosity,
    }
}

/// Both fluids at rest, without liquid yet.
pub fn flow(case: &Case, domain: &Domain) -> Flow {
    let options = &case.fluid;
    let schemes = Schemes {
        // The velocity of a carrying flow is given.
        convection: if options.carrying_flow.is_some() { Convection::Off } else { options.convection },
        viscosity: options.viscosity,
        carrier: match options.pressure_form {
            PressureForm::Full => Carrier::Start,
            PressureForm::Incremental => Carrier::Middle,
        },
    };
    Flow::new(domain, fluids(case), schemes)
}

/// Settings of the fluid and the step.
pub fn settings(case: &Case) -> GridSettings {
    let limits = match case.fluid.step {
        StepChoice::Fixed(step) => StepLimits { courant: case.fluid.cfl, ..StepLimits::always(step) },
        StepChoice::Adaptive { longest, growth, .. } => {
            StepLimits { courant: case.fluid.cfl, growth, ..StepLimits::up_to(longest) }
        }
    };
    GridSettings {
        gravity: case.force_by_mass([0.0; 2]),
        limits,
        tolerance: Tolerance {
            divergence: case.fluid.divergence_tolerance,
            max_iterations: case.fluid.pressure_iterations,
        },
        incremental: case.fluid.pressure_form == PressureForm::Incremental,
    }
}

/// The solver of a case at its start: the liquids poured over a bed whose highest point near the axis is at `bed_height` \[m], and the
/// grains of `engine`, of these shapes; gas, liquid and free grains with the velocity that they have against a box which begins with a speed.
/// Where grains come or leave, the engine has gone through [`super::grains::expecting`].
///
/// # Errors
/// [`StepError`] if the fluid at the start is none that steps can go on from, on this rank or another.
pub fn solver(
    case: &Case,
    boundary: Boundary,
    domain: Domain,
    mut engine: Engine,
    shapes: Arc<[Shape]>,
    bed_height: Real,
) -> Result<solver::Solver, StepError> {
    let mut flow = flow(case, &domain);
    pour(case, &domain, &boundary, &mut flow, bed_height);
    if let Some(velocity) = box_motion::set_off(case) {
        flow.add_velocity(&domain, &boundary, |_| velocity);
        engine.add_velocity(&domain, velocity);
    }
    let tension = surface_tension(case, &domain, &boundary);
    let mut solver = solver::Solver::waiting(domain, boundary, settings(case), flow, engine, shapes, case.coupling);
    solver.start(case.mean_flow().map(MeanFlow::new), case.force_by_volume([0.0; 2]))?;
    let mut solver = solver.with_surface_tension(tension);
    solver.limit_first_step(first_step(case));
    if let Some(carrying) = &case.fluid.carrying_flow {
        solver.set_carried(carrying, 0.0);
    }
    Ok(solver)
}

/// Surface tension of the case, or the entry pressure of its beds, if it has any.
pub fn surface_tension(case: &Case, domain: &Domain, boundary: &Boundary) -> Option<SurfaceTension> {
    let of_pores = |tension: SurfaceTension| match entry_pressure(case) {
        Some(pressure) => tension.with_entry_pressure(domain, pressure),
        None => tension,
    };
    let Some(coefficient) = surface_tension_coefficient(case) else {
        return entry_pressure(case).map(|_| of_pores(SurfaceTension::new(domain, boundary, 0.0, Curvature::Found)));
    };
    let tension = SurfaceTension::new(domain, boundary, coefficient, Curvature::Found);
    let angle = case.fluid.contact_angle.and_then(|angles| angles.grains).unwrap_or(FRAC_PI_2);
    let has_wide = has_wide_grains(case);
    Some(of_pores(if has_wide { tension.with_angle_on_grains(domain, boundary, angle) } else { tension }))
}

/// Whether grains may be wide enough to have a contact angle; the size of a shape from a file is not known yet.
pub fn has_wide_grains(case: &Case) -> bool {
    let may_be_wide =
        |grains: &Population| grains.shape.size().is_none_or(|size| case.is_wide(size * grains.sizes().largest()));
    case.coupling.exchange == Exchange::Surface && case.grains.iter().any(may_be_wide)
}

/// Entry pressure of beds of narrow grains \[Pa], if there is one.
pub fn entry_pressure(case: &Case) -> Option<Real> {
    case.fluid.entry_pressure.filter(|_| case.solver == Solver::Mics)
}

/// Surface tension [N/m], if there is any.
pub fn surface_tension_coefficient(case: &Case) -> Option<Real> {
    case.fluid.surface_tension.filter(|&sigma| sigma > 0.0 && case.solver == Solver::Mics)
}

/// First step of an adaptive run \[s].
fn first_step(case: &Case) -> Option<Real> {
    match case.fluid.step {
        StepChoice::Adaptive { first, .. } => Some(first),
        StepChoice::Fixed(_) => None,
    }
}

/// Origin of a liquid region \[m], above a bed whose highest point near the axis is at `bed_height` \[m].
pub fn origin_of(liquid: &LiquidRegion, axis: [Real; 2], bed_height: Real) -> Vector {
    match liquid.placement {
        Placement::Absolute(origin) => origin,
        Placement::AboveBed { height, to_bottom, offset } => {
            let below = if to_bottom { -liquid.region.heights()[0] } else { 0.0 };
            Vector::new(axis[0] + offset[0], axis[1] + offset[1], bed_height + height + below)
        }
    }
}

/// Columns per cell edge on which the surface of an initial liquid is sampled.
pub(super) const COLUMNS: u32 = 8;
/// Lines per cell edge where it has surface tension, which its steps would pull at.
const LINES: u32 = 12;

/// Puts the initial liquids (and bubbles) into `flow`, in the order of the case: later ones take the
/// place of earlier ones.
fn pour(case: &Case, domain: &Domain, boundary: &Boundary, flow: &mut Flow, bed_height: Real) {
    let mut poured: Vec<(FluidName, Region)> = Vec::new();
    for liquid in &case.liquids {
        let origin = origin_of(liquid, case.bed.axis, bed_height);
        let region = case.region_of(liquid, origin).geometry();
        let fractions = match surface_tension_coefficient(case) {
            Some(_) => RegionFractions::along_normals(&region, domain.grid(), LINES),
            None => RegionFractions::new(&region, domain.grid(), COLUMNS),
        };
        let start = domain.start().map(|n| n as isize);
        let mut beta = domain.field(0.0);
        domain.set(&mut beta, |i, j, k| fractions.fraction(i + start[0], j + start[1], k + start[2]));
        let Flow { volume_fraction, .. } = flow;
        domain.for_each_row(&domain.interior(), volume_fraction.data_mut(), |row, c| {
            for ((c, &beta), i) in c.iter_mut().zip(&beta.data()[row.shifted(0)]).zip(row.first..) {
                let is_filled = |point| is_liquid_at(poured.iter().map(|(fluid, earlier)| (*fluid, earlier)), point);
                let (centre, edges) = (domain.centre(i, row.j, row.k), domain.grid().spacing);
                *c = left_by((is_filled, *c), (|point| region.contains(point), beta), centre, edges);
            }
        });
        match liquid.fluid {
            FluidName::Liquid => {
                let velocity = |x| liquid.velocity + region.velocity(x);
                flow.add_liquid(domain, boundary, &beta, velocity, liquid.drop_velocity);
            }
            FluidName::Gas => set_gas_velocity(domain, flow, &beta, liquid.velocity),
        }
        poured.push((liquid.fluid, region));
    }
    match &case.fluid.initial_velocity {
        Some(initial) => flow.add_velocity(domain, boundary, |x| initial.at(&case.domain, x)),
        None => flow.fill_halos(domain, boundary),
    }
}

/// Whether liquid is at a place after all of these have been poured, the later ones in place of the earlier.
pub(super) fn is_liquid_at<'a>(
    poured: impl DoubleEndedIterator<Item = (FluidName, &'a Region)>,
    point: Vector,
) -> bool {
    poured.rev().find(|(_, region)| region.contains(point)).is_some_and(|(fluid, _)| fluid == FluidName::Liquid)
}

/// What a region that fills the part `beta` of a cell about `centre` with these edges leaves of the part `c` that others fill: all that there
/// is room for, or nothing but what is not needed, where the two do not meet or one lies within the other; in between by points in the cell.
pub(super) fn left_by(
    (is_filled, c): (impl Fn(Vector) -> bool, Real),
    (is_taken, beta): (impl Fn(Vector) -> bool, Real),
    centre: Vector,
    edges: Vector,
) -> Real {
    if c <= 0.0 || c >= 1.0 || beta <= 0.0 || beta >= 1.0 {
        return c * (1.0 - beta);
    }
    let place = |n: u32| (Real::from(n) + 0.5) / Real::from(COLUMNS) - 0.5;
    let (mut filled, mut taken, mut both) = (0_u32, 0_u32, 0_u32);
    for at in 0..COLUMNS.pow(3) {
        let [i, j, k] = [at % COLUMNS, at / COLUMNS % COLUMNS, at / COLUMNS.pow(2)].map(place);
        let point = centre + edges * Vector::new(i, j, k);
        let (was, is) = (is_filled(point), is_taken(point));
        filled += u32::from(was);
        taken += u32::from(is);
        both += u32::from(was && is);
    }
    let (least, most) = ((c - beta).max(0.0), c.min(1.0 - beta));
    match both {
        // Thinner than the points are apart.
        _ if filled == 0 || taken == 0 => c * (1.0 - beta),
        0 => most,
        _ if both == taken || both == filled => least,
        _ => (c * (1.0 - Real::from(both) / Real::from(filled))).clamp(least, most),
    }
}

/// Gives the gas that fills the part `beta` of each cell its velocity, by mass.
fn set_gas_velocity(domain: &Domain, flow: &mut Flow, beta: &sazanami_numerics::grid::Field<Real>, velocity: Vector) {
    let fluids = flow.fluids;
    let c = flow.volume_fraction.data();
    for (d, u) in flow.velocity.iter_mut().enumerate() {
        domain.for_each_row(&domain.interior(), u.data_mut(), |row, u| {
            for ((u, &beta), &c) in u.iter_mut().zip(&beta.data()[row.shifted(0)]).zip(&c[row.shifted(0)]) {
                let weight = (fluids.gas_density * beta / fluids.density(c)).min(1.0);
                *u += weight * (velocity[d] - *u);
            }
        });
    }
}
