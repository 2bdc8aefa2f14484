//! The paper's case with its shipped bed, and beds of spheres made of tiles of a small periodic one: no case file repeats what it packed, so
//! that these are put together by hand.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use sazanami_dem::{
    Body, Engine, Grain, Interactions, Lattice, LinearSpringDashpot, Loads, Packing, PackingSettings, Setup, Stage,
    Substeps, Wall,
};
use sazanami_io::bed::Bed;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Communicator, Solo};
use sazanami_posing::assembly::shapes::shape_of;
use sazanami_posing::assembly::{grains, shared};
use sazanami_posing::case::meaning::{Case, ContactSphereChoice, GrainPlacement};
use sazanami_posing::case::{self, LoadedCase};

/// The paper's case, as shipped.
const PAPER: &str = include_str!("../cases/raindrop/paper.toml");
/// Its path in the repository.
const PLACE: &str = "cases/raindrop/paper.toml";
/// Mean speed of a bed at rest, as the packing has it [m/s].
const AT_REST: Real = 2e-3;
/// Sub-steps in which grains lose speed until they lie on each other, what a sub-step leaves of it, and how fast they
/// may be [m/s].
const QUENCHES: usize = 15_000;
const QUENCHED: Real = 0.99;
const QUENCH_SPEED: Real = 0.01;
/// Sub-steps between two looks at a settling bed, and most of these.
const SETTLING: usize = 250;
const LOOKS: usize = 24;

/// The paper's case with its bed.
#[derive(Clone)]
pub(crate) struct Paper {
    pub case: Case,
    pub bed: Bed,
}

/// What to do where the shipped bed is not found.
const NO_BED: &str =
    "needs the shipped bed: run it in the repository, where `cases/raindrop/paper.toml` names the file";

/// The paper's case and the shipped bed.
pub(crate) fn paper() -> Result<Paper, String> {
    static ONCE: OnceLock<Result<Paper, String>> = OnceLock::new();
    ONCE.get_or_init(|| shipped().ok_or_else(|| NO_BED.to_owned())).clone()
}

/// The same for each of several ranks, all of which have to see the same bed.
pub(crate) fn paper_on(communicator: &dyn Communicator) -> Result<Paper, String> {
    let own = paper();
    let found = match &own {
        Ok(_) => "has it",
        Err(problem) => problem,
    };
    let mut all = Vec::new();
    communicator.all_gather(found.as_bytes(), &mut all);
    match all.iter().position(|other| *other != all[0]) {
        None => own,
        Some(rank) => Err(format!(
            "ranks differ in the bed they have: rank 0 {}, rank {rank} {}",
            String::from_utf8_lossy(&all[0]),
            String::from_utf8_lossy(&all[rank])
        )),
    }
}

fn parse(path: &Path, overrides: &[String]) -> Result<LoadedCase, String> {
    case::parse(path, PAPER, overrides).map_err(|error| error.to_string())
}

/// The paper's case alone: what it says of grains is of no use.
pub(crate) fn paper_case() -> Result<Case, String> {
    Ok(parse(Path::new(PLACE), &["grains.0.placement={ packed = {} }".to_owned()])?.case)
}

/// The case with the bed it names, looked for below the working folder and where the program was built.
fn shipped() -> Option<Paper> {
    let built = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    [PathBuf::from("."), built].iter().find_map(|root| {
        let case = parse(&root.join(PLACE), &[]).ok()?.case;
        let GrainPlacement::Bed(file) = &case.grains.first()?.placement else { return None };
        let bed = Bed::read(&file.file).ok()?;
        Some(Paper { bed, case })
    })
}

/// The shape of the paper's grain with contact spheres of choice.
pub(crate) fn shape(case: &Case, spheres: ContactSphereChoice) -> Result<Shape, String> {
    let mut kind = case.grains.first().ok_or("the paper's case has no grains")?.clone();
    kind.contact_spheres = spheres;
    shape_of(&kind).map_err(|error| error.to_string())
}

impl Paper {
    /// Solo domain of the case's box.
    pub(crate) fn domain(&self) -> Result<Domain, String> {
        self.domain_on(Box::<Solo>::default())
    }

    /// A rank's part of the case's box.
    pub(crate) fn domain_on(&self, communicator: Box<dyn Communicator>) -> Result<Domain, String> {
        shared::domain(&self.case, communicator).map_err(|error| error.to_string())
    }

    /// Engine with the bed, its grains of the given shape.
    pub(crate) fn engine(&self, domain: &Domain, shape: &Shape) -> Result<Engine, String> {
        let setup = grains::setup(&self.case, std::slice::from_ref(shape));
        let placed = grains::placed(&self.case, std::slice::from_ref(shape), &[Some(self.bed.clone())]);
        Engine::new(domain, setup, &placed).map_err(|error| error.to_string())
    }
}

/// Lets the grains come to rest; returns their mean speed [m/s]. A bed that was packed for other contact spheres or with
/// other springs would burst, and then fall for long: it moves slowly and loses speed at first.
pub(crate) fn settle(engine: &mut Engine, domain: &Domain, gravity: Vector, dt: Real) -> Result<Real, String> {
    for _ in 0..QUENCHES {
        engine.advance(domain, &Loads::none(), gravity, dt, Substeps::Fixed(1)).map_err(|error| error.to_string())?;
        engine.limit_speeds(domain, QUENCH_SPEED, QUENCHED);
    }
    let mut mean = Real::INFINITY;
    for _ in 0..LOOKS {
        let time = dt * SETTLING as Real;
        engine
            .advance(domain, &Loads::none(), gravity, time, Substeps::Fixed(SETTLING))
            .map_err(|error| error.to_string())?;
        let grains = engine.grains();
        let speeds: Real = (0..grains.owned()).map(|n| grains.velocity[n].length()).sum();
        mean = speeds / grains.owned().max(1) as Real;
        if mean < AT_REST {
            break;
        }
    }
    Ok(mean)
}

/// A settled bed in a periodic box of the given widths.
fn pack_tile(body: &Body, law: LinearSpringDashpot, width: [Real; 2], count: u64) -> Result<Vec<Grain>, String> {
    let upper = Vector::new(width[0], width[1], 0.05);
    let domain = Domain::solo(Grid::new([8, 8, 8], Vector::ZERO, upper), [true, true, false]);
    let templates = (0..count).map(|id| Grain::new(id, 2650.0, Vector::ZERO)).collect();
    let settings = PackingSettings {
        periodic: [true; 2],
        lattice: Lattice::Low,
        step: 1e-4,
        settling_time: 1e-2,
        ..PackingSettings::new(Vector::ZERO, upper)
    };
    let laws = Interactions::uniform(1, law);
    let failed = |error: sazanami_dem::DemError| error.to_string();
    let mut packing = Packing::new(&domain, settings, vec![body.clone()], laws, templates).map_err(failed)?;
    while !matches!(packing.stage(), Stage::Done | Stage::GivenUp) {
        packing.step(&domain).map_err(failed)?;
    }
    Ok(packing.bed())
}

/// The grains of a tile and its neighbours, numbered in space.
fn tiled(tile: &[Grain], width: [Real; 2], tiles: [usize; 2]) -> Vec<Grain> {
    let place = |n: usize| Vector::new((n % tiles[0]) as Real * width[0], (n / tiles[0]) as Real * width[1], 0.0);
    let places = (0..tiles[0] * tiles[1]).map(place);
    let mut grains: Vec<Grain> = places
        .flat_map(|place| tile.iter().map(move |grain| Grain { position: grain.position + place, ..*grain }))
        .collect();
    let key = |grain: &Grain| [grain.position.z, grain.position.y].map(|x| (x / 1.2e-3) as i64);
    grains.sort_by(|a, b| key(a).cmp(&key(b)).then(a.position.x.total_cmp(&b.position.x)));
    (0_u64..).zip(&mut grains).for_each(|(id, grain)| grain.id = id);
    grains
}

/// Engine with `count` equal spheres on a floor of these widths, made of so many tiles along x1 and x2; periodic in x2, and in
/// x1 unless there are walls.
pub(crate) fn spheres(
    diameter: Real,
    law: LinearSpringDashpot,
    (width, tiles): ([Real; 2], [usize; 2]),
    count: usize,
    walls: bool,
) -> Result<(Domain, Engine), String> {
    let body = Body::ball(0.5 * diameter);
    let tile = [0, 1].map(|d| width[d] / tiles[d] as Real);
    // A few more than needed between walls: those in the walls go.
    let of_tile = count / (tiles[0] * tiles[1]) + if walls { 20 } else { 0 };
    let mut grains = tiled(&pack_tile(&body, law, tile, of_tile as u64)?, tile, tiles);
    if walls {
        let margin = 0.25 * diameter;
        grains.retain(|grain| (margin..width[0] - margin).contains(&grain.position.x));
        grains.truncate(count);
    }
    let upper = Vector::new(width[0], width[1], 0.05);
    let domain = Domain::solo(Grid::new([8, 8, 8], Vector::ZERO, upper), [!walls, true, false]);
    let setup = Setup {
        bodies: vec![body],
        interactions: Interactions::uniform(1, law),
        walls: Wall::of_box(Vector::ZERO, upper, 0, [[walls; 2], [false; 2], [true, false]]),
        region: [Vector::splat(-1.0), Vector::ONE],
        ghost_margin: 0.0,
    };
    let engine = Engine::new(&domain, setup, &grains).map_err(|error| error.to_string())?;
    Ok((domain, engine))
}
