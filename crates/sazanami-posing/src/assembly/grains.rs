//! The grain side of a case: bodies, contact laws, walls, and the grains where they begin.

use std::f64::consts::PI;

use sazanami_dem::{
    Body, Bridge, Engine, Film, Grain, Interactions, Lattice, LinearSpringDashpot, Motion, PackingSettings, Setup,
    Softness, Substeps, TILT, Wall,
};
use sazanami_io::bed::Bed;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::{Quaternion, Random, Real, Vector};

use crate::case::meaning::{
    BoundarySide, Case, FilmRoughness, Fraction, Gate, GrainPlacement, Packing, PackingStop, Population, Sieve,
    SizeDistribution, Solver, WALL, WallContact,
};

/// Solid fraction of a bed of grains that were packed, about.
pub(crate) const PACKED: Real = 0.55;
/// Identifiers of a population begin at its number times this.
const IDENTIFIERS: u64 = 1 << 32;
/// Cells around a rank's part in which its grains are known: the exchange needs none, the loads none, but a
/// grain that moves within a step must stay known.
const MARGIN_CELLS: Real = 2.0;

/// Number of a material; the box has the two after the last: its walls, and its vertical sides.
pub(crate) fn material_number(case: &Case, name: &str) -> u32 {
    case.materials.iter().position(|material| material.name == name).unwrap_or(case.materials.len()) as u32
}

/// Contact laws of all pairs of materials, walls included, in a liquid: with the film and the bridges that the case asks for.
///
/// Beds are packed without it.
pub(crate) fn wet_interactions(case: &Case) -> Interactions {
    let film = case.film_roughness().map(|roughness| Film {
        viscosity: case.fluid.liquid.viscosity,
        roughness,
        reach: case.dem.film_reach,
        farthest: case.film_farthest(),
        bounded: case.dem.film_roughness == FilmRoughness::Auto,
    });
    interactions(case).with_film(film).with_bridge(bridge(case))
}

/// The same without fluid, in which beds come to rest: with the bridges of damp grains alone.
fn resting_interactions(case: &Case) -> Interactions {
    let damp = case.dem.bridges.is_some_and(|bridges| bridges.damp != Some(false));
    interactions(case).with_bridge(bridge(case).filter(|_| damp))
}

/// Liquid bridges between the grains, if the case has any; beds are packed without.
fn bridge(case: &Case) -> Option<Bridge> {
    let bridges = case.dem.bridges?;
    Bridge::new(bridges.surface_tension, bridges.contact_angle, bridges.liquid_content)
        .map(|bridge| bridge.of_damp_grains(bridges.damp != Some(false)))
}

/// Contact laws of all pairs of materials, walls included.
pub fn interactions(case: &Case) -> Interactions {
    let count = case.materials.len();
    let names: Vec<&str> = case.materials.iter().map(|material| material.name.as_str()).collect();
    // What no pair says is not met.
    let any = case.contacts.first().map_or(LinearSpringDashpot::SAND, |pair| pair.law);
    let mut interactions = Interactions::uniform(count + 2, any);
    let (walls, sides) = (count as u32, count as u32 + 1);
    for (a, first) in names.iter().enumerate() {
        for (b, second) in names.iter().enumerate().skip(a) {
            if let Some(&law) = case.contact(first, second) {
                interactions.set(a as u32, b as u32, law);
            }
        }
        if let Some(&law) = case.contact(first, WALL) {
            interactions.set(a as u32, walls, law);
            let slippery = case.dem.wall == WallContact::FrictionlessSides;
            interactions.set(a as u32, sides, if slippery { law.without_friction() } else { law });
        }
    }
    interactions.with_allowed_error(case.dem.allowed_error)
}

/// Sides of the box, by direction, lower and upper.
type Sides = [[bool; 2]; 3];

/// Sides that hold grains while a bed is packed and comes to rest: all that do not repeat, of the lid and the floor those that hold in
/// the run too.
fn vessel(case: &Case) -> Sides {
    let [x, y, _] = case.periodic().map(|repeats| [!repeats; 2]);
    [x, y, case.dem.grain_walls[2]]
}

/// Walls on the sides of the box that are `present`, and gates.
fn walls(case: &Case, present: Sides) -> Vec<Wall> {
    let walls = case.materials.len() as u32;
    let (lower, upper) = (case.domain.lower, case.domain.upper);
    let mut all = Wall::of_box(lower, upper, walls + 1, [present[0], present[1], [false; 2]]);
    all.extend(Wall::of_box(lower, upper, walls, [[false; 2], [false; 2], present[2]]));
    let plate = |gate: &Gate| {
        let normal = Vector::AXES[gate.direction()];
        Wall::plate(gate.place() * normal, normal, walls + 1, [gate.bottom, gate.top])
    };
    all.extend(case.gates.iter().map(plate));
    all
}

/// The walls with the velocity that their sides of the box have.
fn moving(case: &Case, mut walls: Vec<Wall>) -> Vec<Wall> {
    for wall in walls.iter_mut().filter(|wall| wall.edges.is_none()) {
        let side = |d: usize| case.boundary[d][usize::from(wall.normal[d] < 0.0)];
        if let Some(BoundarySide::Moving { velocity }) = (0..3).find(|&d| wall.normal[d] != 0.0).map(side) {
            wall.velocity = velocity;
        }
    }
    walls
}

/// Whether a wall of the box moves.
fn has_moving_walls(case: &Case) -> bool {
    case.boundary.as_flattened().iter().any(|side| matches!(side, BoundarySide::Moving { .. }))
}

/// Bodies, contact laws and walls of the engine.
pub fn setup(case: &Case, shapes: &[Shape]) -> Setup {
    let at_rest = setup_between(case, shapes, case.dem.grain_walls);
    Setup { walls: moving(case, at_rest.walls), ..at_rest }
}

/// The setup of a run as it is for a bed that comes to rest before, levelled or from a file: without fluid, and where
/// [`rests_between_others`] says so between the walls of its packing, open sides too, all of them at rest.
#[must_use]
pub fn resting_setup(case: &Case, shapes: &[Shape], of_run: &Setup) -> Setup {
    let setup = if rests_between_others(case) { setup_between(case, shapes, vessel(case)) } else { of_run.clone() };
    Setup { interactions: resting_interactions(case), ..setup }
}

/// Whether a bed of a grid comes to rest between other walls than those of the run.
#[must_use]
pub fn rests_between_others(case: &Case) -> bool {
    let is_prepared = case.solver == Solver::Mics && (case.levels() || case.relaxes());
    is_prepared && (vessel(case) != case.dem.grain_walls || has_moving_walls(case))
}

fn setup_between(case: &Case, shapes: &[Shape], sides: Sides) -> Setup {
    let largest = case.grains.iter().zip(shapes).map(|(p, s)| s.bounding_radius() * p.sizes().largest());
    let reach = largest.fold(0.0, Real::max);
    // Where no wall holds them, grains may leave the box by their size before they are said to have escaped.
    let room = |d: usize, side: usize| if sides[d][side] { 0.0 } else { reach };
    let lower = Vector::from_array(std::array::from_fn(|d| case.domain.lower[d] - room(d, 0)));
    let upper = Vector::from_array(std::array::from_fn(|d| case.domain.upper[d] + room(d, 1)));
    Setup {
        bodies: shapes.iter().map(Body::from).collect(),
        interactions: wet_interactions(case),
        walls: walls(case, sides),
        region: [lower, upper],
        ghost_margin: MARGIN_CELLS * case.domain.spacing().max_element(),
    }
}

/// The engine, told whether grains are fed in, and through which sides they leave a box that stands still: those that are open and hold
/// none back.
#[must_use]
pub fn expecting(case: &Case, mut engine: Engine) -> Engine {
    if case.feeds() {
        engine.expect_arrivals();
    }
    let opens = |d: usize, upper: usize| {
        case.boundary[d][upper].is_open() && !case.holds_grains(d, upper) && !case.walls_move()
    };
    engine.let_leave([0, 1, 2].map(|d| [0, 1].map(|upper| opens(d, upper))));
    engine
}

/// Identifier of a grain by the number of its population and its own.
pub fn identifier(population: usize, index: usize) -> u64 {
    population as u64 * IDENTIFIERS + index as u64
}

/// Identifier of a grain by the name of its population and its number there.
pub fn named(case: &Case, population: &str, index: usize) -> u64 {
    identifier(case.grains.iter().position(|kind| kind.name == population).unwrap_or_default(), index)
}

/// Number of the population and number within it of a grain.
pub fn population_of(id: u64) -> (usize, u64) {
    ((id / IDENTIFIERS) as usize, id % IDENTIFIERS)
}

/// A grain of a population, its place still to be found.
pub fn member(case: &Case, population: usize, index: usize, scale: Real) -> Grain {
    let kind = &case.grains[population];
    let density = case.material(&kind.material).map_or(0.0, |material| material.density);
    Grain {
        shape: population as u32,
        material: material_number(case, &kind.material),
        scale,
        mass: kind.mass_override.map(|mass| mass * scale.powi(3)),
        motion: motion(case, kind, kind.motion),
        ..Grain::new(identifier(population, index), density, Vector::ZERO)
    }
}

/// Fixed in the tank, wherever that goes; one that was prepared at rest may be moved later. Grains that are released later are
/// fixed at first.
fn motion(case: &Case, population: &Population, motion: Motion) -> Motion {
    let motion = if motion == Motion::Free && population.release.is_some() { Motion::Fixed } else { motion };
    if motion == Motion::Fixed && case.solver == Solver::Mps { Motion::WithWalls } else { motion }
}

/// Draws the size factors of a population.
pub fn factors(population: &Population, count: usize) -> Vec<Real> {
    let mut random = Random::new(population.seed ^ 0x5eed_0f51_2e50_0000);
    let sizes = population.sizes();
    let mut draw = |n: usize| match &*sizes {
        SizeDistribution::Equal => 1.0,
        SizeDistribution::List(list) => {
            let total: Real = list.iter().map(|share| share.weight).sum();
            let mut left = random.unit() * total;
            let chosen = list.iter().find(|share| {
                left -= share.weight;
                left < 0.0
            });
            chosen.or(list.last()).map_or(1.0, |share| share.factor)
        }
        // One from each part of the curve: the rare large grains are as many as it says.
        SizeDistribution::Sieves(sieves) => sieved(sieves, (n as Real + random.unit()) / count as Real),
        SizeDistribution::Uniform { lower, upper } => random.between(*lower, *upper),
        SizeDistribution::Lognormal { lower, upper, .. } if lower == upper => *lower,
        SizeDistribution::Lognormal { median, sigma, lower, upper } => loop {
            // Box and Muller (1958).
            let normal = (-2.0 * (1.0 - random.unit()).ln()).sqrt() * (2.0 * PI * random.unit()).cos();
            let factor = median * (sigma * normal).exp();
            if (*lower..=*upper).contains(&factor) {
                break factor;
            }
        },
    };
    let mut factors: Vec<Real> = (0..count).map(&mut draw).collect();
    if let SizeDistribution::Sieves(_) = &*sizes {
        for n in (1..count).rev() {
            factors.swap(n, ((n + 1) as Real * random.unit()) as usize);
        }
    }
    factors
}

/// Factor that a share `part` of the grains of a sieve curve, by number, does not exceed.
fn sieved(sieves: &[Sieve], part: Real) -> Real {
    let total: Real = Fraction::of(sieves).map(|fraction| fraction.number()).sum();
    let mut left = part * total;
    for fraction in Fraction::of(sieves) {
        if left < fraction.number() {
            return fraction.factor(left / fraction.number());
        }
        left -= fraction.number();
    }
    Fraction::of(sieves).last().map_or(1.0, |fraction| fraction.factor(1.0))
}

/// Grains that have a place from the start: listed, on a lattice, or from a bed file. Listed ones and those of a lattice lie as their `shapes`
/// were given, then turned as the case says.
pub fn placed(case: &Case, shapes: &[Shape], beds: &[Option<Bed>]) -> Vec<Grain> {
    let mut all = Vec::new();
    for (number, population) in case.grains.iter().enumerate() {
        let make = |index: usize, scale: Real| member(case, number, index, scale);
        let drawn = shapes.get(number).map_or(Quaternion::IDENTITY, Shape::drawn);
        match &population.placement {
            GrainPlacement::Packed(_) | GrainPlacement::Fed(_) => {}
            GrainPlacement::List(list) => all.extend(list.iter().enumerate().map(|(index, grain)| Grain {
                position: grain.position,
                orientation: grain.orientation * drawn,
                velocity: grain.velocity,
                angular_velocity: grain.angular_velocity,
                motion: motion(case, population, grain.motion),
                ..make(index, grain.factor)
            })),
            GrainPlacement::Lattice(lattice) => {
                let [n1, n2, n3] = lattice.counts;
                let sizes = factors(population, n1 * n2 * n3);
                let mut random = Random::new(population.seed);
                let counts = Vector::new(n1 as Real, n2 as Real, n3 as Real);
                let pitch = (lattice.upper - lattice.lower) / counts;
                for (index, &scale) in sizes.iter().enumerate() {
                    let place = [index % n1, index / n1 % n2, index / (n1 * n2)];
                    let cell = Vector::new(place[0] as Real, place[1] as Real, place[2] as Real) + 0.5;
                    let shake = Vector::from_array(std::array::from_fn(|_| random.between(-1.0, 1.0)));
                    let turn = if lattice.random_orientation { random.orientation() } else { drawn };
                    all.push(Grain {
                        position: lattice.lower + pitch * (cell + lattice.jitter * shake),
                        orientation: turn,
                        velocity: lattice.velocity,
                        ..make(index, scale)
                    });
                }
            }
            GrainPlacement::Bed(file) => {
                let Some(bed) = &beds[number] else { continue };
                for (index, lying) in bed.grains.iter().enumerate() {
                    all.push(Grain {
                        position: case.domain.lower + file.scale * (lying.position - bed.lower),
                        orientation: lying.orientation,
                        motion: motion(case, population, if lying.held { Motion::Fixed } else { population.motion }),
                        ..make(index, lying.scale)
                    });
                }
            }
        }
    }
    all
}

/// What becomes of a grain of the population number `shape`, `body` times `scale`, once it is packed: nothing where it reaches above the
/// level of its population or into a gate, else whether it is glued to the floor.
pub fn after_packing(
    case: &Case,
    body: &Body,
    shape: u32,
    scale: Real,
    position: Vector,
    orientation: Quaternion,
) -> Option<bool> {
    let GrainPlacement::Packed(how) = &case.grains[shape as usize].placement else { return Some(false) };
    let floor = case.domain.lower.z;
    let middle = 0.5 * (case.domain.lower.x + case.domain.upper.x);
    let radius = scale * body.bounding_radius;
    let spheres = body.centres.iter().zip(&body.radii);
    let tops = spheres.map(|(&centre, &radius)| (orientation * (scale * centre)).z + scale * radius);
    let top = tops.fold(Real::NEG_INFINITY, Real::max);
    let stays = how.level_at(position.x - middle).is_none_or(|level| position.z + top <= floor + level);
    let apart = case.gates.iter().all(|gate| gate.plate().clearance(position) >= radius);
    (stays && apart).then(|| how.glued.is_some_and(|glued| position.z < floor + glued))
}

/// Grains that are to be packed, with the settings; `None` if none are.
pub fn to_pack(case: &Case) -> Option<(PackingSettings, Vec<Grain>)> {
    let mut packing = None;
    let mut grains = Vec::new();
    for (number, population) in case.grains.iter().enumerate() {
        if let GrainPlacement::Packed(how) = &population.placement {
            let settings = packing.get_or_insert_with(|| packing_settings(case, how));
            settings.seed ^= population.seed.rotate_left(number as u32);
            let sizes = factors(population, population.count.unwrap_or_default());
            for (index, &scale) in sizes.iter().enumerate() {
                grains.push(member(case, number, index, scale));
            }
        }
    }
    // Populations are mixed: the lattice is filled in an order drawn at random.
    let settings: PackingSettings = packing?;
    if case.grains.len() > 1 {
        let mut random = Random::new(settings.seed);
        for last in (1..grains.len()).rev() {
            grains.swap(last, (random.unit() * (last + 1) as Real) as usize);
        }
    }
    Some((settings, grains))
}

/// As [`placed`], but grains whose motion is prescribed wait at rest for the run to begin: [`set_in_motion`].
pub fn waiting(case: &Case, shapes: &[Shape], beds: &[Option<Bed>]) -> Vec<Grain> {
    let mut all = placed(case, shapes, beds);
    for grain in all.iter_mut().filter(|grain| grain.motion == Motion::Prescribed) {
        (grain.velocity, grain.angular_velocity) = (Vector::ZERO, Vector::ZERO);
    }
    all
}

/// Gives grains that waited the motion that is prescribed to them, when the run begins. All ranks take part.
pub fn set_in_motion(case: &Case, domain: &Domain, engine: &mut Engine) {
    let is_prescribed = |population: &Population| match &population.placement {
        GrainPlacement::List(list) => list.iter().any(|grain| grain.motion == Motion::Prescribed),
        GrainPlacement::Lattice(_) => population.motion == Motion::Prescribed,
        _ => false,
    };
    if !case.grains.iter().any(is_prescribed) {
        return;
    }
    for g in 0..engine.grains().owned() {
        if engine.grains().motion[g] != Motion::Prescribed {
            continue;
        }
        let (population, index) = population_of(engine.grains().id[g]);
        let [velocity, spin] = match &case.grains[population].placement {
            GrainPlacement::List(list) => [list[index as usize].velocity, list[index as usize].angular_velocity],
            GrainPlacement::Lattice(lattice) => [lattice.velocity, Vector::ZERO],
            _ => continue,
        };
        engine.set_velocity(g, velocity, spin);
    }
    engine.refresh_ghosts(domain);
}

/// What of a population matters to its fall: grains, and of one of size factor 1 the thickness, length and smallest contact sphere
/// \[m] and the volume [m^3].
pub(crate) struct Kind {
    pub count: usize,
    pub thick: Real,
    pub long: Real,
    pub volume: Real,
    pub sphere: Real,
}

/// The fall of grains that are packed.
pub(crate) struct Fall<'c> {
    pub how: &'c Packing,
    /// Time in which those of the uppermost layer fall onto the bed, or sink to it and fine ones trickle through it \[s].
    pub time: Real,
    /// Largest speed meanwhile [m/s].
    pub speed: Real,
    /// Time in which velocities fall to 1/e afterwards \[s].
    pub slowing: Real,
    /// How soft springs may be.
    pub softness: Softness,
}

/// Speed at which fine grains trickle down between coarse ones over that of grains that sink, about.
const TRICKLING: Real = 0.6;

/// Grains of a population whose sizes are drawn to foresee its lattice.
const DRAWN: usize = 100_000;

/// Sum of the cubes of the size factors of `count` grains of a population, of very many foreseen from some.
pub(crate) fn drawn_cubes(population: &Population, count: usize) -> Real {
    let drawn = factors(population, count.min(DRAWN));
    count as Real / drawn.len().max(1) as Real * drawn.iter().map(|factor| factor.powi(3)).sum::<Real>()
}

/// Radius of the smallest contact sphere of a body \[m].
pub(crate) fn smallest_sphere(body: &Body) -> Real {
    body.radii.iter().copied().fold(Real::INFINITY, Real::min)
}

/// The fall of the grains that are packed, of populations of this `kind`; `None` if none are or a kind is not known.
pub(crate) fn fall(case: &Case, kind: impl Fn(usize) -> Option<Kind>) -> Option<Fall<'_>> {
    let packed = case.grains.iter().enumerate().filter_map(|(number, population)| match &population.placement {
        GrainPlacement::Packed(how) => Some((number, population, how)),
        _ => None,
    });
    let how = packed.clone().next()?.2;
    let (settings, extent) = (packing_settings(case, how), case.domain.extent());
    let (mut solid, mut thickness, mut number_of_all) = (0.0, 0.0, 0.0);
    let (mut sizes, mut kinds) = (Vec::new(), Vec::new());
    let mut most: Real = 0.0;
    for (number, population, _) in packed {
        let Kind { count, thick, long, volume, sphere } = kind(number)?;
        let layer = match how.lattice {
            Lattice::Cubic => long,
            Lattice::Low => thick + TILT.sin() * (long - thick),
        };
        let factors = factors(population, count.min(DRAWN));
        let share = count as Real / factors.len().max(1) as Real;
        most = most.max(share);
        let volumes = share * volume * factors.iter().map(|factor| factor.powi(3)).sum::<Real>();
        let density = case.material(&population.material).map_or(0.0, |material| material.density);
        let density = population.mass_override.map_or(density, |mass| mass / volume);
        solid += volumes;
        thickness += share * thick * factors.iter().sum::<Real>();
        number_of_all += count as Real;
        kinds.extend(factors.iter().map(|factor| sazanami_dem::Kind {
            mass: density * volume * factor.powi(3),
            reach: 0.5 * factor * long,
            sphere: factor * sphere,
            count: share,
        }));
        sizes.extend(factors.iter().map(|factor| [factor * long, factor * layer]));
    }
    let lattice = most.max(1.0) * settings.lattice_height(&sizes)?;
    let bed = solid / (PACKED * extent.x * extent.y);
    let drop = (lattice - bed).max(0.0);
    let softness = Softness::of(&settings, &kinds);
    let slowing = settings.slowing_time(thickness / number_of_all.max(1.0));
    let gravity = case.packing_gravity();
    let (time, speed) = if softness.is_of_unlike() && how.stop == PackingStop::Settled {
        let speed = gravity * slowing;
        (drop / speed + bed / (TRICKLING * speed), speed)
    } else {
        let time = (2.0 * drop / (how.fall_gravity * gravity)).sqrt();
        (time, how.fall_gravity * gravity * time)
    };
    Some(Fall { how, time, speed, slowing, softness })
}

/// Settings of the packing of a case.
pub(crate) fn packing_settings(case: &Case, how: &Packing) -> PackingSettings {
    let periodic = case.boundary.map(|sides| sides[0] == BoundarySide::Periodic);
    PackingSettings {
        periodic: [periodic[0], periodic[1]],
        wall_material: case.materials.len() as u32,
        side_material: case.materials.len() as u32 + 1,
        lattice: how.lattice,
        spacing: how.spacing,
        jitter: how.jitter,
        seed: 0,
        gravity: case.packing_gravity(),
        fall_factor: how.fall_gravity,
        settling_time: how.settle_time,
        by_time_only: how.stop == PackingStop::TimeOnly,
        rest_speed: how.mean_speed,
        rest_energy: how.energy_ratio,
        fall_friction: how.friction_scale,
        longest: how.time_limit,
        substeps: Substeps::Auto,
        ..PackingSettings::new(case.domain.lower, case.domain.upper)
    }
}
