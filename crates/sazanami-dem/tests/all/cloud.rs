//! A cloud of balls that falls, the same on any ranks and threads and after an interruption.

use sazanami_dem::*;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Random, Vector};
use sazanami_parallel::{Communicator, Solo, run_ranks};

use crate::support::{floor, snapshot_of};

/// A cloud of balls that falls on a floor, in a box that is periodic in x1 and x2.
pub fn fall(communicator: Box<dyn Communicator>, setup: Setup, from: Option<&Snapshot>, steps: usize) -> Snapshot {
    let grid = Grid::new([24, 16, 8], Vector::ZERO, Vector::new(0.02, 0.02, 0.03));
    let domain = Domain::new(grid, [true, true, false], communicator).expect("the case is sound");
    let setup = Setup { ghost_margin: 1e-3, walls: floor(), ..setup };
    let mut random = Random::new(5);
    let mut grains: Vec<Grain> = (0..120)
        .map(|n| Grain { scale: random.between(0.5, 1.0), ..Grain::new(7 * n % 121, 2650.0, Vector::ZERO) })
        .collect();
    let mut settings = PackingSettings::new(Vector::ZERO, Vector::new(0.02, 0.02, 1.0));
    settings.lattice = Lattice::Low;
    settings.arrange(&setup.bodies, &mut grains).expect("the case is sound");
    for grain in &mut grains {
        grain.velocity = Vector::new(0.6, 0.3, -0.5) + random.between(-0.5, 0.5) * Vector::X;
    }
    let nothing = Snapshot::default();
    let mut engine = match from {
        None => Engine::new(&domain, setup, &grains),
        Some(from) => {
            let from = if domain.communicator().rank() == 0 { from } else { &nothing };
            Engine::restore(&domain, setup, "dem/", from)
        }
    }
    .expect("the case is sound");
    let gravity = Vector::new(0.0, 0.0, -50.0);
    for _ in 0..steps {
        engine.advance(&domain, &Loads::none(), gravity, 2e-4, Substeps::Auto).expect("the case is sound");
    }
    snapshot_of(&domain, &mut engine)
}

/// The cloud after 40 and after 80 steps, whose bits do not depend on ranks, threads and an interruption.
pub fn bits_agree(setup: impl Fn() -> Setup + Sync) -> [Snapshot; 2] {
    let [half, expected] = [40, 80].map(|steps| fall(Box::new(Solo::default()), setup(), None, steps));
    for (ranks, threads) in [(1, 3), (2, 1), (4, 2)] {
        let whole = run_ranks(ranks, threads, |c| fall(c, setup(), None, 80)).expect("the case is sound");
        assert!(whole[0] == expected, "{ranks} ranks, {threads} threads");
        let resumed = run_ranks(ranks, threads, |c| fall(c, setup(), Some(&half), 40)).expect("the case is sound");
        assert!(resumed[0] == expected, "{ranks} ranks, {threads} threads, resumed");
    }
    [half, expected]
}
