//! Single contacts against closed forms.

use sazanami_dem::*;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

fn domain() -> Domain {
    Domain::solo(Grid::new([4, 4, 4], Vector::splat(-1.0), Vector::splat(1.0)), [false; 3])
}

fn setup(radius: Real, law: ContactLaw, walls: Vec<Wall>) -> Setup {
    Setup {
        bodies: vec![Body::ball(radius)],
        interactions: Interactions::uniform(1, law),
        walls,
        region: [Vector::splat(-1e3), Vector::splat(1e3)],
        ghost_margin: 0.0,
    }
}

fn floor() -> Vec<Wall> {
    vec![Wall::at_rest(Vector::ZERO, Vector::Z, 0)]
}

fn law(stiffness: Real, damping: Damping) -> ContactLaw {
    ContactLaw { normal_stiffness: stiffness, tangential_stiffness: stiffness, damping, ..ContactLaw::SAND }
}

/// Rebound speed over impact speed of a ball that falls on the floor, with `steps` in a contact.
fn rebound(law: ContactLaw, mass: Real, steps: Real) -> Real {
    let domain = domain();
    let (radius, speed) = (1e-3, 0.1);
    let grain = Grain {
        mass: Some(mass),
        velocity: Vector::new(0.0, 0.0, -speed),
        ..Grain::new(1, 1.0, Vector::new(0.0, 0.0, 1.00013 * radius))
    };
    let mut engine = Engine::new(&domain, setup(radius, law, floor()), &[grain]).unwrap();
    let contact = std::f64::consts::PI * (mass / law.normal_stiffness).sqrt();
    let step = contact / steps;
    for _ in 0..(2.0 * steps) as usize {
        engine.advance(&domain, &Loads::none(), Vector::ZERO, step, Substeps::Fixed(1)).unwrap();
    }
    engine.grains().velocity[0].z / speed
}

#[test]
fn restitution_is_what_was_asked_for() {
    for tension in [true, false] {
        for e in [0.5, 0.8, 1.0] {
            let law = ContactLaw { tension, ..law(1e4, Damping::Restitution(e)) };
            let found = rebound(law, 1e-6, 500.0);
            println!("tension {tension}: {e} -> {found}");
            assert!((found - e).abs() < 1e-3, "tension {tension}: {e} -> {found}");
        }
    }
}
