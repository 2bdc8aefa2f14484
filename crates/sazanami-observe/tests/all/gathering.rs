//! The bed is the same whichever ranks hold its grains.

use sazanami_dem::{Body as ContactBody, Engine, Grain, Interactions, LinearSpringDashpot, Setup};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_observe::GatheredBed;
use sazanami_observe::bed_profile::motion;
use sazanami_parallel::run_ranks;

/// 48 balls of diameter 0.5 in a box of 8 x 6, with identifiers out of order.
fn grains() -> Vec<Grain> {
    let grain = |n: u64| {
        let place = (n * 29) % 48;
        let position = Vector::new((place % 8) as Real + 0.5, (place / 8) as Real + 0.5, 0.5 + 0.01 * n as Real);
        let mut grain = Grain::new(100 - n, 2650.0, position);
        grain.scale = 1.0 + 0.001 * n as Real;
        grain.velocity = Vector::new(0.0, 0.1 * n as Real, -1.0);
        grain.orientation = Quaternion::from_rotation_x(0.1 * n as Real);
        grain
    };
    (0..48).map(grain).collect()
}

fn gathered(ranks: usize) -> Vec<GatheredBed> {
    run_ranks(ranks, 1, |communicator| {
        let grid = Grid::new([12, 12, 4], Vector::ZERO, Vector::new(8.0, 6.0, 3.0));
        let domain = Domain::new(grid, [false; 3], communicator).expect("enough cells");
        let setup = Setup {
            bodies: vec![ContactBody::ball(0.25)],
            interactions: Interactions::uniform(1, LinearSpringDashpot::SAND),
            walls: Vec::new(),
            region: [Vector::NEG_INFINITY, Vector::INFINITY],
            ghost_margin: 1.0,
        };
        let engine = Engine::new(&domain, setup, &grains()).expect("sound grains");
        let mut bed = GatheredBed::default();
        // Twice: the second use must not keep anything of the first.
        bed.gather(&domain, engine.grains(), 0.0);
        bed.gather(&domain, engine.grains(), engine.time() + 7.0);
        bed
    })
    .expect("no rank fails")
}

#[test]
fn every_grain_arrives_once_in_the_order_of_the_identifiers() {
    let one = gathered(1).swap_remove(0);
    assert_eq!(one.grains.id, (53..=100).collect::<Vec<u64>>());
    let view = one.view(&[]);
    assert_eq!((view.len(), view.time), (48, 7.0));
    for (at, grain) in grains().iter().rev().enumerate() {
        assert_eq!((view.position[at], view.velocity[at]), (grain.position, grain.velocity));
        assert_eq!((view.scale[at], view.body[at]), (grain.scale, 0));
        assert!(view.orientation[at].angle_between(grain.orientation) < 1e-7);
        assert_eq!(view.time_since_contact(at), Some(Real::INFINITY));
    }
    for ranks in [2, 4, 6] {
        let beds = gathered(ranks);
        let (all, none) = beds.split_first().unwrap();
        assert_eq!(all.grains.id, one.grains.id, "{ranks} ranks");
        assert_eq!(all.view(&[]).position, view.position);
        assert_eq!(all.view(&[]).orientation, view.orientation);
        assert_eq!(motion(&all.view(&[])), motion(&view));
        assert!(none.iter().all(|bed| bed.view(&[]).is_empty()));
    }
}
