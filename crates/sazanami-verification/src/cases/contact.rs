//! Grains without a fluid around them; a block that sticks on an incline.

use std::f64::consts::PI;

use sazanami_dem::{
    Body, Damping, Engine, Grain, Grains, Interactions, LinearSpringDashpot, Loads, Setup, Substeps, Wall,
};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use crate::measured::Measured;

/// A few bodies of one shape and one contact law over a floor, without a fluid.
pub(crate) struct Bench {
    pub domain: Domain,
    pub engine: Engine,
}

impl Bench {
    pub fn new(body: Body, law: LinearSpringDashpot, walls: Vec<Wall>, grains: &[Grain]) -> Result<Self, String> {
        let domain = Domain::solo(Grid::new([4; 3], Vector::splat(-1.0), Vector::ONE), [false; 3]);
        let setup = Setup {
            bodies: vec![body],
            interactions: Interactions::uniform(1, law),
            walls,
            region: [Vector::splat(-1e3), Vector::splat(1e3)],
            ghost_margin: 0.0,
        };
        let engine = Engine::new(&domain, setup, grains).map_err(|error| error.to_string())?;
        Ok(Self { domain, engine })
    }

    pub fn floor() -> Vec<Wall> {
        vec![Wall::at_rest(Vector::ZERO, Vector::Z, 0)]
    }

    /// One step of a single sub-step.
    pub fn step(&mut self, gravity: Vector, dt: Real) -> Result<sazanami_dem::ContactReport, String> {
        let Self { domain, engine } = self;
        engine.advance(domain, &Loads::none(), gravity, dt, Substeps::Fixed(1)).map_err(|error| error.to_string())
    }

    pub fn grains(&self) -> &Grains {
        self.engine.grains()
    }
}

fn law(stiffness: Real, damping: Damping, friction: Real) -> LinearSpringDashpot {
    LinearSpringDashpot {
        normal_stiffness: stiffness,
        tangential_stiffness: stiffness,
        damping,
        friction,
        ..LinearSpringDashpot::SAND
    }
}

fn ball_mass(radius: Real, density: Real) -> Real {
    density * 4.0 / 3.0 * PI * radius.powi(3)
}

/// Speed at which a block of four spheres creeps down an incline at rest [diameters per second], and the list
/// renewals meanwhile; with `history` the tangential springs hold it, without only dashpots do.
fn creep(degrees: Real, history: bool) -> Result<[Real; 2], String> {
    let (radius, density, g) = (5e-3, 2000.0, 9.81);
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let centres =
        [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| 2.0 * radius * Vector::new(x, y, 0.0));
    let volume = 4.0 * ball_mass(radius, 1.0);
    // As broad as a block of that size; it is flat and does not tip.
    let inertia = volume * radius * radius * Vector::new(8.0, 8.0, 16.0);
    let body = Body::new(volume, inertia, centres.to_vec(), vec![radius; 4], 4.0 * radius);
    let weight = density * volume * g;
    let damping = 2.0 * 0.3 * (density * volume * 1e5).sqrt() / 4.0;
    let mut law = law(1e5, Damping::Literal { normal: damping, tangential: damping }, 0.6);
    law.tangential_stiffness = if history { 1e5 } else { 1e-2 };
    let overlap = weight * cosine / 4.0 / law.normal_stiffness;
    // A second, fast one passes high above and makes the lists expire.
    let flying =
        Grain { velocity: Vector::new(0.0, 20.0, 0.0), ..Grain::new(2, density, Vector::new(0.0, -20.0, 30.0)) };
    let grains = [Grain::new(1, density, Vector::new(0.0, 0.0, radius - overlap)), flying];
    let mut bench = Bench::new(body, law, Bench::floor(), &grains)?;
    let gravity = g * Vector::new(sine, 0.0, -cosine);
    let dt = 2e-5;
    (0..25_000).try_for_each(|_| bench.step(gravity, dt).map(drop))?;
    let (start, mut renewals) = (bench.grains().position[0].x, 0);
    for _ in 0..50_000 {
        renewals += bench.step(gravity, dt)?.list_renewals;
    }
    Ok([(bench.grains().position[0].x - start) / (50_000.0 * dt) / (2.0 * radius), renewals as Real])
}

/// A block that sticks on an incline.
pub(crate) fn sticking() -> Result<Vec<Measured>, String> {
    let [stuck, renewals] = creep(28.0, true)?;
    Ok(vec![
        Measured::new("creep of a block at 28 deg, friction 0.6", stuck.abs()),
        Measured::new("list renewals meanwhile", renewals),
        Measured::new("control: creep without tangential springs", creep(28.0, false)?[0]),
    ])
}
