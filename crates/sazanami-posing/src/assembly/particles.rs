//! Water as moving particles: tank, scheme, coupling, and the fluid where it begins.

use sazanami_dem::{Body, Engine, Setup};
use sazanami_mps::filling;
use sazanami_mps::grains::{AddedMass, DragParameters, Forchheimer, OverlapSettings, OverlappingGrains};
use sazanami_mps::pouring;
use sazanami_mps::pressure::Tolerance;
use sazanami_mps::scheme::{Fluid, Scheme};
use sazanami_mps::solver::{FluidParticle, ParticleSettings, SetupError, Solver};
use sazanami_mps::stability::StepLimits;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{Region, RegionFractions, Shape};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Reduction, for_each_chunk};

use super::{box_motion, fluid, grains};
use crate::case::meaning::{BoxDomain, Case, FluidName, Gate, GrainShape, InitialVelocity, LiquidRegion, Population};

/// Cells of the division into ranks, over the radius of influence.
const CELL: Real = 0.56;
/// Room around a rank's part for the way of grains within a step, over the largest diameter.
const GRAIN_WAY: Real = 0.6;
/// Distance of the void fraction of a place from the mean of its height from which on water is poured place by place. A
/// level bed of grains in disorder keeps within 0.2, a heap or column goes beyond 0.4.
const UNEVEN: Real = 0.3;
/// Part by which the water that is poured may miss what is asked for, before it is poured place by place or warned of.
pub const OFF: Real = 0.1;
/// Cells that a thread takes at a time.
const ROWS: usize = 1024;
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

/// Settings of the fluid and the step.
pub fn settings(case: &Case, level: Real) -> ParticleSettings {
    let p = case.moving_particles();
    let liquid = case.fluid.liquid;
    let middle = 0.5 * (case.domain.lower + case.domain.upper);
    ParticleSettings {
        fluid: Fluid { density: liquid.density, viscosity: liquid.viscosity / liquid.density, spacing: p.spacing },
        scheme: Scheme { projection: p.projection, radius: p.radius, turbulence: p.turbulence, ..Scheme::default() },
        limits: StepLimits { courant: p.courant, longest: p.dt_max, fixed: p.dt },
        tolerance: Tolerance { strain: p.tolerance, most_iterations: p.pressure_iterations },
        reference: Vector::new(middle.x, middle.y, level),
    }
}

/// Laws of the interaction of grains and fluid: drag and its integration, averaging, added mass, lift.
pub fn coupling(case: &Case) -> OverlapSettings {
    let overlap = &case.overlap;
    let liquid = case.fluid.liquid;
    OverlapSettings {
        drag: DragParameters {
            form: overlap.drag,
            kozeny: overlap.kozeny,
            forchheimer: overlap.forchheimer.map_or(Forchheimer::Ergun, Forchheimer::Constant),
            blend: overlap.blend,
            ..DragParameters::recommended(liquid.density, liquid.viscosity)
        },
        smoothing: overlap.smoothing,
        least_void: overlap.least_void,
        drag_integration: overlap.drag_integration,
        added_mass: AddedMass { form: overlap.added_mass, coefficient: overlap.added_mass_coefficient },
        lift: overlap.lift,
        substeps: case.dem.substeps,
    }
}

/// Spheres as the engine knows them, whatever mesh they would have.
pub fn bodies(case: &Case) -> Vec<Body> {
    let radius = |population: &Population| match population.shape {
        GrainShape::Sphere { diameter, .. } => 0.5 * diameter,
        _ => unreachable!("only spheres are accepted with the case"),
    };
    case.grains.iter().map(|population| Body::ball(radius(population))).collect()
}

/// Setup of the engine of the grains, with its ghost margin \[m] and moving walls.
pub fn setup(case: &Case, shapes: &[Shape]) -> Setup {
    let particles = case.moving_particles();
    let largest = case.grains.iter().filter_map(|p| Some(p.shape.size()? * p.sizes().largest())).fold(0.0, Real::max);
    let cutoff = case.overlap.smoothing.max(particles.radius * particles.spacing);
    let mut setup = Setup {
        bodies: bodies(case),
        interactions: grains::wet_interactions(case),
        ghost_margin: cutoff + GRAIN_WAY * largest,
        ..grains::setup(case, shapes)
    };
    if case.walls_move() {
        // Seen from the laboratory grains go wherever the tank goes.
        setup.region = [Vector::NEG_INFINITY, Vector::INFINITY];
    }
    setup
}

/// The grains of `engine` where they lie in the tank, with the fluid's room between them.
#[must_use]
pub fn overlapping_grains(case: &Case, domain: &Domain, engine: Engine) -> OverlappingGrains {
    let mut grains = OverlappingGrains::new(domain, engine, coupling(case));
    grains.place(domain, &case.tank());
    grains
}

/// The solver of a case at its start, with the fluid that was poured over a bed whose highest point near the axis is at `bed_height` \[m].
///
/// # Errors
/// [`SetupError`] if fluid, grains and tank do not fit.
pub fn solver(
    case: &Case,
    domain: Domain,
    fluid: &[FluidParticle],
    grains: OverlappingGrains,
    bed_height: Real,
) -> Result<Solver, SetupError> {
    Solver::new(domain, settings(case, level(case, bed_height)), case.tank(), fluid, grains)
}

/// The solver of a case at its start, its liquid poured between the grains of `engine` on a bed whose highest point near the axis is at
/// `bed_height` \[m]; where grains come or leave, the engine has gone through [`super::grains::expecting`].
///
/// # Errors
/// [`SetupError`] if fluid, grains and tank do not fit.
pub fn poured(case: &Case, domain: Domain, engine: Engine, bed_height: Real) -> Result<Solver, SetupError> {
    let grains = overlapping_grains(case, &domain, engine);
    let fluid = fill(case, &domain, &grains, bed_height).particles;
    solver(case, domain, &fluid, grains, bed_height)
}

/// Gives fluid and free grains the velocity that they have against a tank which begins with a speed; where its walls move, gives them,
/// and the grains that go with them, that speed.
pub fn set_off(case: &Case, solver: &mut Solver) {
    let (engine, domain) = solver.engine_mut();
    grains::set_in_motion(case, domain, engine);
    if case.walls_move() {
        engine.set_wall_velocities(domain, case.tank_at(0.0)[1]);
    }
    let Some(velocity) = box_motion::set_off(case) else { return };
    solver.set_velocities(|particles, a| particles.velocity[a] + velocity);
    let (engine, domain) = solver.engine_mut();
    engine.add_velocity(domain, velocity);
}

/// Highest level of liquid at the start \[m]; the floor without liquid.
pub fn level(case: &Case, bed_height: Real) -> Real {
    let tops = case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid).map(|liquid| {
        let origin = fluid::origin_of(liquid, case.bed.axis, bed_height);
        (origin.z + liquid.region.heights()[1]).min(case.domain.upper.z)
    });
    tops.fold(case.domain.lower.z, Real::max)
}

/// Fluid particles of the liquid at the start, and how many its volume is.
pub struct Poured {
    /// The particles.
    pub particles: Vec<FluidParticle>,
    /// Volume of the liquid in particles.
    pub asked: Real,
}

/// Fluid particles of the liquid at the start, between grains as many as their voids hold: in horizontal layers where grains
/// lie level and layers hold each liquid to a tenth, else by the void fraction of every place. All ranks take part and have the same
/// particles.
pub fn fill(case: &Case, domain: &Domain, grains: &OverlappingGrains, bed_height: Real) -> Poured {
    let (lower, upper) = (case.domain.lower, case.domain.upper);
    let spacing = case.moving_particles().spacing;
    let extent = upper - lower;
    let step = PLACES * case.overlap.smoothing.min(extent.min_element());
    let counts = [0, 1].map(|d| ((extent[d] / step).ceil() as usize).max(1));
    let me = domain.communicator().rank();
    // Mean void fraction of a height, and the largest distance of a place from it.
    let at_height = |z: Real| {
        let mut sums = [0.0; 2];
        let mut ends = [Real::INFINITY, Real::NEG_INFINITY];
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                let part = |n: usize, d: usize| lower[d] + (n as Real + 0.5) / counts[d] as Real * extent[d];
                let place = Vector::new(part(i, 0), part(j, 1), z);
                if domain.owner_of(place) == me {
                    let void = grains.void_fraction(place);
                    sums = [sums[0] + void, sums[1] + 1.0];
                    ends = [ends[0].min(void), ends[1].max(void)];
                }
            }
        }
        let [sum, count] = domain.sum(sums);
        let mean = sum / count;
        [mean, (mean - domain.min(ends[0])).max(domain.max(ends[1]) - mean)]
    };
    let liquids = Liquids::of(case, bed_height);
    let top = level(case, bed_height);
    let heights = (top - lower.z) / spacing;
    let uneven = !grains.is_empty()
        && (0..heights.max(0.0).ceil() as usize).any(|n| at_height(lower.z + (n as Real + 0.5) * spacing)[1] > UNEVEN);
    let (first, last) = liquids.bounds();
    let [low, high] = [lower.max(first), upper.min(last)];
    if low.cmpge(high).any() {
        return Poured { particles: Vec::new(), asked: 0.0 };
    }
    // Layers in a bed have a lattice of their own, which a gate would cut.
    if !uneven && (grains.is_empty() || case.gates.is_empty()) {
        let cells = pouring::cells(low, high, spacing);
        let fractions = liquids.fractions(&cells);
        let places = filling::layers(lower, upper, top, spacing, |z| at_height(z)[0]);
        let mut last = [Real::NAN, 1.0];
        let mut void_at = |z: Real| {
            if !grains.is_empty() && last[0] != z {
                last = [z, at_height(z)[0]];
            }
            last[1]
        };
        let wanted = wanted(&cells, &fractions, spacing);
        let mut held = vec![0.0; wanted.len()];
        let mut particles = Vec::new();
        for place in places {
            let Some((number, particle)) = liquids.particle_at(place) else { continue };
            held[number] += 1.0 / void_at(place.z);
            particles.push(particle);
        }
        if wanted.iter().zip(&held).all(|(wanted, held)| (held - wanted).abs() <= OFF * wanted) {
            let [wanted, held]: [Real; 2] = [wanted.iter().sum(), held.iter().sum()];
            let asked = if held > 0.0 { particles.len() as Real * wanted / held } else { wanted };
            return Poured { particles, asked };
        }
    }
    let all = sections(low, high, spacing, case)
        .into_iter()
        .map(|[low, high]| liquids.poured(domain, grains, &pouring::cells(low, high, spacing), spacing));
    all.fold(Poured { particles: Vec::new(), asked: 0.0 }, |mut all, section| {
        all.particles.extend(section.particles);
        Poured { asked: all.asked + section.asked, ..all }
    })
}

/// Corners of the parts into which gates cut the box from `low` to `high` \[m]: no particle is poured into a plate.
fn sections(low: Vector, high: Vector, spacing: Real, case: &Case) -> Vec<[Vector; 2]> {
    let mut sections = vec![[low, high]];
    for plate in case.gates.iter().map(Gate::plate) {
        let (d, place) = (plate.direction, plate.place);
        let cut = |[low, high]: [Vector; 2]| {
            // Thinner parts hold no layer.
            if place - low[d] < 0.5 * spacing || high[d] - place < 0.5 * spacing {
                return vec![[low, high]];
            }
            let (mut first, mut second) = (high, low);
            (first[d], second[d]) = (place, place);
            vec![[low, first], [second, high]]
        };
        sections = sections.into_iter().flat_map(cut).collect();
    }
    sections
}

/// Volume of each liquid, without what later ones take of it, in particles; of gas none.
fn wanted(cells: &Grid, fractions: &[(RegionFractions<'_>, &Liquid)], spacing: Real) -> Vec<Real> {
    let [nx, ny, nz] = cells.cells.map(|count| count as isize);
    let kinds = fractions.len();
    let mut of_layers = vec![0.0; kinds * nz as usize];
    for_each_chunk(&mut of_layers[..], kinds, |k, held| {
        for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))) {
            // Of each what the later ones leave.
            let mut taken = 0.0;
            for (n, (held, (fraction, liquid))) in held.iter_mut().zip(fractions).enumerate().rev() {
                let (centre, edges) = (cells.centre(i, j, k as isize), cells.spacing);
                let is_taken = |point| fractions[n + 1..].iter().any(|(_, later)| later.region.contains(point));
                let own = (|point| liquid.region.contains(point), fraction.fraction(i, j, k as isize));
                let part = fluid::left_by(own, (is_taken, taken), centre, edges);
                taken = Real::min(taken + part, 1.0);
                *held += if liquid.fluid == FluidName::Liquid { part } else { 0.0 };
            }
        }
    });
    let particles = cells.cell_volume() / spacing.powi(3);
    (0..kinds).map(|n| particles * of_layers.iter().skip(n).step_by(kinds).sum::<Real>()).collect()
}

/// A liquid or bubble of the case where it lies at the start.
struct Liquid {
    region: Region,
    fluid: FluidName,
    velocity: Vector,
}

/// Liquids and bubbles of the case: later ones take the place of earlier ones.
struct Liquids {
    placed: Vec<Liquid>,
    box_size: BoxDomain,
    initial: Option<InitialVelocity>,
}

impl Liquids {
    fn of(case: &Case, bed_height: Real) -> Self {
        let placed = |liquid: &LiquidRegion| {
            let origin = fluid::origin_of(liquid, case.bed.axis, bed_height);
            let region = case.region_of(liquid, origin).geometry();
            Liquid { region, fluid: liquid.fluid, velocity: liquid.velocity }
        };
        let placed = case.liquids.iter().map(placed).collect();
        Self { placed, box_size: case.domain, initial: case.fluid.initial_velocity }
    }

    /// A particle with the velocity of its liquid and that of its place.
    fn particle(&self, liquid: &Liquid, position: Vector) -> FluidParticle {
        let own = self.initial.map_or(Vector::ZERO, |initial| initial.at(&self.box_size, position));
        FluidParticle { position, velocity: liquid.velocity + liquid.region.velocity(position) + own }
    }

    /// The particle of a place with the number of its liquid, if there is liquid.
    fn particle_at(&self, position: Vector) -> Option<(usize, FluidParticle)> {
        let number = self.placed.iter().rposition(|liquid| liquid.region.contains(position))?;
        let found = &self.placed[number];
        (found.fluid == FluidName::Liquid).then(|| (number, self.particle(found, position)))
    }

    /// Smallest box around all liquids, with infinite sides where they have no end \[m].
    fn bounds(&self) -> (Vector, Vector) {
        let liquids = self.placed.iter().filter(|liquid| liquid.fluid == FluidName::Liquid);
        liquids
            .map(|liquid| liquid.region.bounds())
            .fold((Vector::INFINITY, Vector::NEG_INFINITY), |(lower, upper), (l, u)| (lower.min(l), upper.max(u)))
    }

    /// Particles in the voids of every place of a grid of `cells`. All ranks take part and have the same.
    fn poured(&self, domain: &Domain, grains: &OverlappingGrains, cells: &Grid, spacing: Real) -> Poured {
        let fractions = self.fractions(cells);
        let shares = shares(domain, grains, cells, |[i, j, k]| {
            let covered = |share: Real, (n, (fraction, liquid)): (usize, &(RegionFractions<'_>, &Liquid))| {
                let part = fraction.fraction(i, j, k);
                let earlier = || fractions[..n].iter().map(|(_, earlier)| (earlier.fluid, &earlier.region));
                let is_filled = |point| fluid::is_liquid_at(earlier(), point);
                let is_taken = |point| liquid.region.contains(point);
                let left = fluid::left_by((is_filled, share), (is_taken, part), cells.centre(i, j, k), cells.spacing);
                left + if liquid.fluid == FluidName::Liquid { part } else { 0.0 }
            };
            fractions.iter().enumerate().fold(0.0, covered)
        });
        let particle = |position: Vector| {
            // The middle of a particle that is cut by a surface may lie beyond it.
            let [i, j, k] = cells.cell_of(position);
            let is_here = |(fraction, liquid): &&(RegionFractions<'_>, &Liquid)| {
                liquid.fluid == FluidName::Liquid && fraction.fraction(i, j, k) > 0.0
            };
            let near = || fractions.iter().rev().find(is_here).map(|(_, liquid)| self.particle(liquid, position));
            self.particle_at(position).map(|(_, particle)| particle).or_else(near)
        };
        let particles = pouring::pour(cells, &shares, spacing).into_iter().filter_map(particle).collect();
        Poured { particles, asked: shares.iter().sum::<Real>() * cells.cell_volume() / spacing.powi(3) }
    }

    /// Part of each cell of a grid that each liquid fills.
    fn fractions(&self, cells: &Grid) -> Vec<(RegionFractions<'_>, &Liquid)> {
        self.placed.iter().map(|liquid| (RegionFractions::new(&liquid.region, cells, fluid::COLUMNS), liquid)).collect()
    }
}

/// Share of the volume of each cell that is liquid: the void fraction of its middle by the share `of_liquid` of the cell
/// where liquid is poured. All ranks take part and have the same.
fn shares(
    domain: &Domain,
    grains: &OverlappingGrains,
    cells: &Grid,
    of_liquid: impl Fn([isize; 3]) -> Real + Sync,
) -> Vec<Real> {
    let me = domain.communicator().rank();
    let mut shares = vec![0.0; cells.len()];
    for_each_chunk(&mut shares[..], ROWS, |number, shares| {
        for (row, share) in shares.iter_mut().enumerate() {
            let cell = pouring::position(cells, number * ROWS + row);
            let place = cells.centre(cell[0], cell[1], cell[2]);
            if domain.owner_of(place) == me {
                let liquid = of_liquid(cell);
                *share = if liquid > 0.0 { liquid * grains.void_fraction(place) } else { 0.0 };
            }
        }
    });
    domain.communicator().all_reduce(&mut shares, Reduction::Sum);
    shares
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

    #[test]
    fn the_film_of_the_case_is_that_of_the_grains_in_water_and_not_of_the_packing() {
        let text = "solver = \"mps\"\n[domain]\nsize = [\"9 mm\", \"9 mm\", \"9 mm\"]\n[run]\nuntil = \"1 ms\"\n\
                    [particles]\nspacing = \"1 mm\"\n[fluid.liquid]\ndensity = \"1200 kg/m^3\"\ndynamic_viscosity = \"0.1 Pa s\"\n";
        let film = |changes: &[&str]| {
            let overrides: Vec<String> = changes.iter().map(|text| (*text).to_owned()).collect();
            let case = sazanami_case::parse(Path::new("c.toml"), text, &overrides).expect("the case is complete").case;
            assert_eq!(grains::interactions(&case).film(), None);
            setup(&case, &[]).interactions.film().copied()
        };
        let expected = sazanami_dem::Film {
            viscosity: 0.1,
            roughness: 1e-6,
            reach: 0.1,
            farthest: Real::INFINITY,
            bounded: false,
        };
        assert_eq!(film(&["dem.film_roughness=1 um"]), Some(expected));
        assert_eq!(
            film(&["dem.film_roughness=1 um", "dem.film_reach=0.3"]),
            Some(sazanami_dem::Film { reach: 0.3, ..expected })
        );
        assert_eq!(film(&[]), None);
    }

    /// A tank with a column of spheres in one corner and water up to a level \[mm]: its case, and what is filled.
    fn column(level: Real) -> (Case, OverlappingGrains, Vec<FluidParticle>) {
        let text = "solver = \"mps\"\ngravity = \"9.81 m/s^2\"\n[domain]\nsize = [\"24 mm\", \"8 mm\", \"20 mm\"]\n\
                    [boundary]\nall = \"no_slip\"\nx2 = \"periodic\"\n[run]\nuntil = \"1 ms\"\n[particles]\n\
                    spacing = \"1 mm\"\n[[liquid]]\nname = \"water\"\nregion.box = { lower = [\"0 mm\", \"0 mm\", \
                    \"0 mm\"], upper = [\"24 mm\", \"8 mm\", \"LEVEL mm\"] }\n[material.sand]\ndensity = \"2650 kg/m^3\"\n\
                    [contact.default]\nnormal_stiffness = \"400 N/m\"\ntangential_stiffness = \"100 N/m\"\n\
                    restitution = 0.5\nfriction = 0.4\n[[grains]]\nname = \"sand\"\n\
                    shape.sphere = { diameter = \"0.999 mm\" }\nplacement.lattice = { lower = [\"0 mm\", \"0 mm\", \
                    \"0 mm\"], upper = [\"8 mm\", \"8 mm\", \"12 mm\"], counts = [8, 8, 12] }\n";
        let text = text.replace("LEVEL", &level.to_string());
        let case = sazanami_case::parse(Path::new("c.toml"), &text, &[]).expect("the case is complete").case;
        let shapes: Vec<_> = case.grains.iter().map(|p| super::super::shapes::shape_of(p).expect("a sphere")).collect();
        let domain = super::super::shared::domain(&case, Box::<sazanami_parallel::Solo>::default()).expect("one rank");
        let engine =
            sazanami_dem::Engine::new(&domain, setup(&case, &shapes), &grains::placed(&case, &shapes, &[None]));
        let mut phase = OverlappingGrains::new(&domain, engine.expect("sound grains"), coupling(&case));
        phase.place(&domain, &case.tank());
        let fluid = fill(&case, &domain, &phase, 0.0).particles;
        (case, phase, fluid)
    }

    /// Integral over the box in volumes of a particle.
    fn integral(case: &Case, of: impl Fn(Vector) -> Real) -> Real {
        let cells = pouring::cells(case.domain.lower, case.domain.upper, 0.5e-3);
        let centre = |[i, j, k]: [isize; 3]| cells.centre(i, j, k);
        let sum: Real = (0..cells.len()).map(|n| of(centre(pouring::position(&cells, n)))).sum();
        sum * cells.cell_volume() * 1e9
    }

    #[test]
    fn water_is_poured_up_to_levels_between_spacings() {
        for level in [15.0, 15.2, 15.3, 15.6] {
            let (case, phase, fluid) = column(level);
            // Rows on which a level falls are counted by their part below it.
            let below = |x: Vector| ((1e-3 * level - x.z) / 0.25e-3 + 0.5).clamp(0.0, 1.0);
            let held = integral(&case, |x| below(x) * phase.void_fraction(x));
            let found = fluid.len() as Real;
            assert!((found - held).abs() < 2.0, "{level}: {found} {held}");
            assert!(fluid.iter().all(|p| p.position.z < 1e-3 * level), "{level}");
            // Negative control: a level rounded to the next half spacing, 24 x 8 x 0.2 particles off.
            let rounded =
                integral(
                    &case,
                    |x| if x.z < 1e-3 * (2.0 * level).round() / 2.0 { phase.void_fraction(x) } else { 0.0 },
                );
            assert_eq!((found - rounded).abs() > 15.0, (2.0 * level).fract() != 0.0, "{level}: {found} {rounded}");
        }
    }

    #[test]
    fn water_is_poured_into_the_voids_of_a_column() {
        let (case, phase, fluid) = column(16.0);
        // A soft mask, so that whole rows on its rim do not count at once.
        let mask =
            |x: Vector| (0.5 + 250.0 * (6e-3 - x.x)).clamp(0.0, 1.0) * (0.5 + 250.0 * (10e-3 - x.z)).clamp(0.0, 1.0);
        let found: Real = fluid.iter().map(|p| mask(p.position)).sum();
        let expected = integral(&case, |x| phase.void_fraction(x) * mask(x));
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
        // Negative control: the mean of each height.
        let mean = |z: Real| {
            let along = (0..48).flat_map(|i| (0..16).map(move |j| [Real::from(i), Real::from(j)]));
            along.map(|[i, j]| phase.void_fraction(Vector::new(0.5e-3 * i, 0.5e-3 * j, z))).sum::<Real>() / 768.0
        };
        let layers = filling::layers(case.domain.lower, case.domain.upper, 16e-3, 1e-3, mean);
        let layered: Real = layers.into_iter().map(mask).sum();
        assert!(layered > 1.3 * expected, "{layered} {expected}");
    }
}
