//! Void fractions, flow through a bed, a bed at rest.

use sazanami_dem::{Grain, Loads, Motion, Substeps};
use sazanami_numerics::{Real, Vector};

use super::settled_bed::{SettledBed, packed};
use super::vessel::{
    DENSITY, DIAMETER, DOWN, ExperimentError, GRAIN_DENSITY, GRAVITY, OPEN, OPEN_TOP, PERIODIC, Vessel, WALLS,
};
use super::vessel::{advance, fluid, lattice, under, zero_above_surface};
use sazanami_mps::grains::{GrainPhase, Voids};
use sazanami_mps::pressure::hydrostatic;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::Solver;
use sazanami_mps::weight::{Calibration, Weight};
use sazanami_mps::{Kind, Role};

/// Void fractions of touching grains on a simple cubic lattice.
#[derive(Clone, Copy, Debug)]
pub struct LatticeVoids {
    /// Mean in the interior, and largest difference from it.
    pub interior: [Real; 2],
    /// Mean half a grain from a wall.
    pub at_wall: Real,
    /// The same if grains had no images in the walls.
    pub without_images: Real,
    /// Analytic rate of the void fraction over that from differences, while the lattice is compressed.
    pub rate: Real,
    /// The same with the rate of a lattice that stands still.
    pub rate_of_fluid_alone: Real,
}

/// 10 x 10 x 10 grains between a floor and a lid, periodic in x and y.
///
/// # Errors
/// [`ExperimentError`] if the grains cannot be set up.
pub fn lattice_voids() -> Result<LatticeVoids, ExperimentError> {
    let count = 10;
    let d = DIAMETER;
    let lid = |sides| {
        let mut vessel = Vessel::new([count; 3], d, sides);
        vessel.grains = lattice([count; 3])
            .enumerate()
            .map(|(n, place)| Grain { motion: Motion::Fixed, ..Grain::new(n as u64, GRAIN_DENSITY, d * place) })
            .collect();
        vessel
    };
    let phase = |vessel: &Vessel| -> Result<GrainPhase, ExperimentError> {
        let domain = vessel.domain();
        let mut phase = vessel.grain_phase(&domain)?;
        phase.place(&domain, &vessel.tank());
        Ok(phase)
    };
    let vessel = lid([PERIODIC, PERIODIC, WALLS]);
    let closed = phase(&vessel)?;
    let open = phase(&lid([PERIODIC, PERIODIC, OPEN]))?;
    // Over a cell of the lattice: the smoothed fraction ripples.
    let samples = |z: [Real; 2]| {
        lattice([8; 3]).map(move |s| {
            let place = Vector::new(5.0 + s.x / 8.0, 5.0 + s.y / 8.0, z[0] + (z[1] - z[0]) * s.z / 8.0);
            d * place
        })
    };
    let mean = |phase: &GrainPhase, z: [Real; 2]| samples(z).map(|x| phase.void_fraction(x)).sum::<Real>() / 512.0;
    let interior = mean(&closed, [5.0, 6.0]);
    let spread = samples([5.0, 6.0]).map(|x| (closed.void_fraction(x) - interior).abs()).fold(0.0, Real::max);
    let (at_wall, without_images) = (mean(&closed, [0.0, 1.0]), mean(&open, [0.0, 1.0]));

    // Grains and fluid move towards the middle of x at unequal rates.
    let mut vessel = lid([WALLS, PERIODIC, WALLS]);
    let middle = 0.5 * count as Real * d;
    let (grain_rate, fluid_rate) = (-2.0, 1.0);
    let moved = |vessel: &mut Vessel, time: Real| {
        for (grain, place) in vessel.grains.iter_mut().zip(lattice([count; 3])) {
            grain.position.x = middle + (d * place.x - middle) * (1.0 + grain_rate * time);
            grain.velocity = Vector::new(grain_rate * (d * place.x - middle), 0.0, 0.0);
            grain.motion = Motion::Prescribed;
        }
    };
    let points: Vec<Vector> = lattice([6; 3]).map(|s| d * (Vector::splat(3.0) + s / 1.5)).collect();
    let found = |vessel: &Vessel, time: Real, still: bool| -> Result<[Vec<Real>; 2], ExperimentError> {
        let mut phase = phase(vessel)?;
        let velocity: Vec<Vector> = points.iter().map(|x| fluid_rate * (x.x - middle) * Vector::X).collect();
        let place: Vec<Vector> = points.iter().zip(&velocity).map(|(x, u)| *x + time * *u).collect();
        if still {
            for g in 0..phase.engine().grains().owned() {
                phase.engine_mut().set_velocity(g, Vector::ZERO, Vector::ZERO);
            }
            phase.place(&vessel.domain(), &vessel.tank());
        }
        let count = points.len();
        let column = || vec![0.0; count];
        let mut voids = Voids { inverse: column(), inverse_rate: column(), grain_mobility: column() };
        phase.voids(&vec![Kind::Fluid; count], &place, &velocity, &mut voids);
        Ok([voids.inverse, voids.inverse_rate])
    };
    let step = 1e-4;
    let mut at = |time: Real, still: bool| {
        moved(&mut vessel, time);
        found(&vessel, time, still)
    };
    let ([before, _], [after, _], [_, rate], [_, still]) =
        (at(-step, false)?, at(step, false)?, at(0.0, false)?, at(0.0, true)?);
    let difference = |n: usize| (after[n] - before[n]) / (2.0 * step);
    let share = |rate: &[Real]| {
        let product: Real = (0..rate.len()).map(|n| rate[n] * difference(n)).sum();
        product / (0..rate.len()).map(|n| difference(n).powi(2)).sum::<Real>()
    };
    Ok(LatticeVoids {
        interior: [interior, spread],
        at_wall,
        without_images,
        rate: share(&rate),
        rate_of_fluid_alone: share(&still),
    })
}

/// Weight of the solver and its sums on a lattice.
fn weight_of(solver: &Solver) -> (Weight, Calibration) {
    let settings = solver.settings();
    let weight = Weight { radius: settings.scheme.radius * settings.fluid.spacing };
    (weight, Calibration::new(&weight, settings.fluid.spacing))
}

/// State of a bed under water at rest.
#[derive(Clone, Copy, Debug, Default)]
pub struct RestingBed {
    /// Largest difference of the reduced pressure from its value at the surface, over `rho g H`, as a mean over the
    /// last tenth of the run.
    pub pressure: Real,
    /// Change of the mean height of the grains, in diameters.
    pub height: Real,
    /// Largest speed of a grain in the last tenth of the run [m/s].
    pub speed: Real,
    /// Force on the floor over the submerged weight of the grains, mean over the last tenth.
    pub floor: Real,
    /// Change of the bulk volume of the fluid over itself.
    pub volume: Real,
    /// The same without every fiftieth particle.
    pub volume_of_fewer: Real,
    /// Mean number density in the bed over n0, less one.
    pub density: Real,
    /// Root mean square of the same.
    pub density_spread: Real,
}

/// A bed of `layers` diameters under `water` diameters of water in a box of `size` diameters, settled before it is
/// covered, for `seconds`; the body force has the part `tilt` of gravity along x, and the surface lies across it.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn resting_bed(
    scheme: Scheme,
    size: [usize; 2],
    [layers, water]: [Real; 2],
    tilt: Real,
    seconds: Real,
) -> Result<RestingBed, ExperimentError> {
    let d = DIAMETER;
    let bed = SettledBed { scheme, size, layers, water, tilt, ..SettledBed::default() };
    let (mut solver, depth) = (bed.solver()?, bed.depth());
    let force = Vector::new(tilt * GRAVITY, 0.0, -GRAVITY);
    let submerged: Real = {
        let grains = solver.grains().engine().grains();
        (0..grains.owned()).map(|g| grains.mass[g] * (1.0 - DENSITY / GRAIN_DENSITY) * GRAVITY).sum()
    };
    let mean_height = |solver: &Solver| {
        let grains = solver.grains().engine().grains();
        (0..grains.owned()).map(|g| grains.position[g].z).sum::<Real>() / grains.owned() as Real
    };
    // Of all particles, and without every fiftieth.
    let bulk = |solver: &Solver| {
        solver.sum_over_fluid(|p, a| {
            let bulk = solver.grains().void_fraction(p.position[a]).recip();
            [bulk, if p.id[a] % 50 == 0 { 0.0 } else { bulk }]
        })
    };
    let (height, [volume, _]) = (mean_height(&solver), bulk(&solver));
    let mut found = RestingBed::default();
    let (mut last, mut before) = ([0.0; 4], 0.0);
    advance(&mut solver, [0.0, seconds], under(force), |time, solver, report| {
        let dt = time - before;
        before = time;
        if time < 0.9 * seconds {
            return;
        }
        last[3] += dt;
        let grains = solver.grains().engine().grains();
        found.speed = grains.velocity[..grains.owned()].iter().map(|v| v.length()).fold(found.speed, Real::max);
        last[0] += 1.0;
        last[1] -= report.contacts.impulse_on_walls.z;
        last[2] += pressure_error(solver, force, depth);
    })?;
    found.pressure = last[2] / last[0];
    found.height = (mean_height(&solver) - height) / d;
    found.floor = last[1] / last[3] / submerged;
    [found.volume, found.volume_of_fewer] = bulk(&solver).map(|bulk| bulk / volume - 1.0);
    [found.density, found.density_spread] = bed_density(&solver, layers);
    Ok(found)
}

/// Force on the floor under the bed of [`resting_bed`] before it is covered, over the submerged weight of the grains.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn dry_bed(size: [usize; 2], layers: Real) -> Result<Real, ExperimentError> {
    let high = (layers + 6.0).ceil() as usize;
    let mut vessel = Vessel::new([size[0], size[1], high], DIAMETER, [WALLS, PERIODIC, OPEN_TOP]);
    vessel.grains = packed(&vessel, layers)?;
    let domain = vessel.domain();
    let mut engine = vessel.engine(&domain)?;
    let (mut impulse, dt) = (0.0, 2e-4);
    // Let the springs close again, then listen.
    for step in 0..1000 {
        let report = engine.advance(&domain, &Loads::none(), DOWN, dt, Substeps::Auto)?;
        impulse -= if step < 500 { 0.0 } else { report.impulse_on_walls.z };
    }
    let mass: Real = engine.grains().mass[..engine.grains().owned()].iter().sum();
    Ok(impulse / (500.0 * dt * mass * (1.0 - DENSITY / GRAIN_DENSITY) * GRAVITY))
}

/// Largest difference of the pressure of the fluid from the hydrostatic, over that of the depth `depth` \[m].
fn pressure_error(solver: &Solver, force: Vector, depth: Real) -> Real {
    let particles = solver.particles();
    let reference = solver.settings().reference;
    let up = -force.normalize();
    let (mut level, mut count) = (0.0, 0.0);
    for a in fluid(solver).filter(|&a| particles.role[a] == Role::Dirichlet) {
        level += up.dot(particles.position[a]);
        count += 1.0;
    }
    let level = level / Real::max(count, 1.0) + zero_above_surface(solver);
    let (weight, reduced) = (DENSITY * force.length(), solver.reduced_force(force));
    let error = |a: usize| {
        let x = particles.position[a];
        let p = particles.pressure[a] + hydrostatic(DENSITY, reduced, x, reference);
        (p - weight * (level - up.dot(x))).abs()
    };
    fluid(solver).map(error).fold(0.0, Real::max) / (weight * depth)
}

/// Mean and root mean square of `n/n0 - 1` of the fluid in the bed, away from its top.
fn bed_density(solver: &Solver, layers: Real) -> [Real; 2] {
    let (weight, sums) = weight_of(solver);
    let particles = solver.particles();
    let d = DIAMETER;
    let inside: Vec<usize> = fluid(solver).filter(|&a| particles.position[a].z < (layers - 2.0) * d).collect();
    let bulk: Vec<Real> = (0..particles.owned())
        .map(|b| if particles.is_fluid(b) { solver.grains().void_fraction(particles.position[b]).recip() } else { 1.0 })
        .collect();
    let tank = solver.tank();
    let width = tank.upper - tank.lower;
    let density = |a: usize| {
        let mut sum = 0.0;
        for (b, bulk) in bulk.iter().enumerate() {
            let mut apart = particles.position[b] - particles.position[a];
            for axis in 0..3 {
                if tank.sides[axis][0] == sazanami_mps::boundary::Side::Periodic {
                    apart[axis] -= width[axis] * (apart[axis] / width[axis]).round();
                }
            }
            sum += bulk * weight.value(apart.length());
        }
        sum / sums.number_density - 1.0
    };
    let values: Vec<Real> = inside.iter().map(|&a| density(a)).collect();
    let count = values.len() as Real;
    [values.iter().sum::<Real>() / count, (values.iter().map(|v| v * v).sum::<Real>() / count).sqrt()]
}
