//! Momentum, energy, forces against all pairs, and what is refused.

use sazanami_dem::*;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Matrix, Random, Real, Vector};
use sazanami_parallel::run_ranks;

fn domain() -> Domain {
    Domain::solo(Grid::new([4, 4, 4], Vector::ZERO, Vector::splat(0.02)), [false; 3])
}

fn setup(law: LinearSpringDashpot) -> Setup {
    crate::support::setup(vec![Body::prolate(0.26e-3, 0.635e-3, 9)], law, vec![])
}

/// A ball of 100 grains that falls in on itself while it turns.
fn implosion() -> Vec<Grain> {
    let mut random = Random::new(5);
    let mut grains: Vec<Grain> = (0..100).map(|id| Grain::new(id, 2650.0, Vector::ZERO)).collect();
    let settings = PackingSettings::new(Vector::ZERO, Vector::splat(7e-3));
    settings.arrange(&setup(LinearSpringDashpot::SAND).bodies, &mut grains).expect("the case is sound");
    let middle = Vector::splat(3.5e-3);
    for grain in &mut grains {
        let from = grain.position - middle;
        grain.velocity = -100.0 * from + Vector::new(-30.0 * from.y, 30.0 * from.x, 0.05);
        grain.angular_velocity = random.between(-300.0, 300.0) * Vector::new(1.0, 0.4, 0.0);
    }
    grains
}

/// Momentum, angular momentum about the origin, and the sums of their sizes.
fn momenta(engine: &Engine) -> [(Vector, Real); 2] {
    let g = engine.grains();
    let mut sums = [(Vector::ZERO, 0.0); 2];
    for i in 0..g.owned() {
        let p = g.mass[i] * g.velocity[i];
        for (sum, value) in sums.iter_mut().zip([p, g.position[i].cross(p) + g.angular_momentum[i]]) {
            *sum = (sum.0 + value, sum.1 + value.length());
        }
    }
    sums
}

#[test]
fn a_closed_set_keeps_its_momentum() {
    let domain = domain();
    let mut engine = Engine::new(&domain, setup(LinearSpringDashpot::SAND), &implosion()).expect("the case is sound");
    let before = momenta(&engine);
    let mut contacts = 0;
    for _ in 0..60 {
        contacts += engine
            .advance(&domain, &Loads::none(), Vector::ZERO, 1e-4, Substeps::Auto)
            .expect("the case is sound")
            .contacts;
    }
    for (before, after) in before.iter().zip(momenta(&engine)) {
        let change = (after.0 - before.0).length() / before.1;
        assert!(change < 1e-12, "{change}");
    }
    assert!(contacts > 50, "{contacts}");
    // Negative control: fixed grains among them take momentum away.
    let mut grains = implosion();
    grains.iter_mut().step_by(9).for_each(|g| g.motion = Motion::Fixed);
    let mut engine = Engine::new(&domain, setup(LinearSpringDashpot::SAND), &grains).expect("the case is sound");
    let before = momenta(&engine)[0];
    engine.advance(&domain, &Loads::none(), Vector::ZERO, 6e-3, Substeps::Auto).expect("the case is sound");
    assert!((momenta(&engine)[0].0 - before.0).length() / before.1 > 1e-6);
}

fn energy(engine: &Engine) -> Real {
    let g = engine.grains();
    (0..g.owned()).map(|i| g.kinetic_energy(i)).sum::<Real>() + engine.elastic_energy()
}

/// Root mean square of the relative change of energy, with `factor` times the usual number of sub-steps, and the largest rise
/// between two looks.
fn drift_of_energy(law: LinearSpringDashpot, factor: usize) -> (Real, Real) {
    let domain = domain();
    let mut engine = Engine::new(&domain, setup(law), &implosion()).expect("the case is sound");
    let start = energy(&engine);
    let substeps = Substeps::Fixed(factor * engine.substeps(&domain, 2e-6, Substeps::Auto));
    let (mut square, mut rise): (Real, Real) = (0.0, 0.0);
    let mut last = start;
    for _ in 0..3000 {
        engine.advance(&domain, &Loads::none(), Vector::ZERO, 2e-6, substeps).expect("the case is sound");
        let now = energy(&engine);
        square += (now / start - 1.0).powi(2);
        rise = rise.max((now - last) / start);
        last = now;
    }
    ((square / 3000.0).sqrt(), rise)
}

/// Elastic grains without friction.
const ELASTIC: LinearSpringDashpot = LinearSpringDashpot {
    damping: Damping::Literal { normal: 0.0, tangential: 0.0 },
    friction: 0.0,
    ..LinearSpringDashpot::SAND
};

#[test]
fn elastic_grains_keep_their_energy_in_sub_steps_of_contacts_from_the_sub_step() {
    let law = LinearSpringDashpot { tangential_force: TangentialForce::Published, ..ELASTIC };
    let [coarse, fine] = [1, 2].map(|factor| drift_of_energy(law, factor).0);
    println!("energy changes by {coarse} at the usual sub-step, by {fine} at half of it");
    assert!(coarse < 1e-2 && fine < coarse / 3.0, "{coarse} {fine}");
}

#[test]
fn elastic_grains_keep_their_energy() {
    // A quarter of the sub-step, since with half of it a few impacts decide.
    let [coarse, fine] = [1, 4].map(|factor| drift_of_energy(ELASTIC, factor).0);
    println!("energy changes by {coarse} at the usual sub-step, by {fine} at a quarter of it");
    assert!(coarse < 1e-2 && fine < coarse / 4.0, "{coarse} {fine}");
}

#[test]
fn dissipation_never_feeds_energy() {
    // With the published force it rises by 9.5e-6; which of its parts feeds is not known.
    for (tangential_force, most) in [(TangentialForce::Published, 2e-5), (TangentialForce::FromTouch, 1e-6)] {
        // Where a slipping contact has a tangential dashpot, its spring takes up `D_t v_t` against the force by definition,
        // so that the sum of energies is one of springs and motion only without.
        let damping = Damping::Literal { normal: 0.02, tangential: 0.0 };
        let law = LinearSpringDashpot { damping, tangential_force, ..LinearSpringDashpot::SAND };
        let (change, rise) = drift_of_energy(law, 1);
        println!("{tangential_force}: energy falls by {change}, never rises by more than {rise}");
        assert!(change > 0.1 && rise < most, "{tangential_force}: {change} {rise}");
        // Negative control: a dashpot of the wrong sign.
        let damping = Damping::Literal { normal: -0.002, tangential: 0.0 };
        assert!(drift_of_energy(LinearSpringDashpot { damping, ..law }, 1).1 > most);
    }
}

/// Force and torque on each grain over a first sub-step, by all pairs of all spheres.
fn by_all_pairs(law: &LinearSpringDashpot, body: &Body, grains: &[Grain], h: Real) -> Vec<(Vector, Vector)> {
    let Damping::Literal { normal, tangential } = law.damping else { unreachable!() };
    let mut sums = vec![(Vector::ZERO, Vector::ZERO); grains.len()];
    let home = |g: &Grain| g.position + 0.5 * h * g.velocity;
    for i in 0..grains.len() {
        for j in i + 1..grains.len() {
            let (gi, gj) = (&grains[i], &grains[j]);
            let (ri, rj) = (Matrix::from_quat(gi.orientation), Matrix::from_quat(gj.orientation));
            for a in 0..body.spheres() {
                for b in 0..body.spheres() {
                    let p = home(gi) + ri * body.centres[a] * gi.scale;
                    let q = home(gj) + rj * body.centres[b] * gj.scale;
                    let (ra, rb) = (body.radii[a] * gi.scale, body.radii[b] * gj.scale);
                    let overlap = ra + rb - (q - p).length();
                    if overlap <= 0.0 {
                        continue;
                    }
                    let n = (q - p).normalize();
                    let at = p + (ra - 0.5 * overlap) * n;
                    let (ai, aj) = (at - home(gi), at - home(gj));
                    let v = gj.velocity + gj.angular_velocity.cross(aj) - gi.velocity - gi.angular_velocity.cross(ai);
                    let vt = v - v.dot(n) * n;
                    let hn = (normal * v.dot(n) - law.normal_stiffness * overlap).min(0.0);
                    let ht = law.tangential_stiffness * h * vt + tangential * vt;
                    let f = hn * n + ht.clamp_length_max(law.friction * hn.abs());
                    sums[i] = (sums[i].0 + f, sums[i].1 + ai.cross(f));
                    sums[j] = (sums[j].0 - f, sums[j].1 - aj.cross(f));
                }
            }
        }
    }
    sums
}

#[test]
fn forces_from_lists_are_those_of_all_pairs() {
    let law = LinearSpringDashpot {
        damping: Damping::Literal { normal: 2e-3, tangential: 3e-3 },
        ..LinearSpringDashpot::SAND
    };
    let body = Body::prolate(0.26e-3, 0.635e-3, 9);
    let domain = domain();
    let mut random = Random::new(3);
    // Close enough that many touch, a few deeply.
    let mut grains: Vec<Grain> = Vec::new();
    for id in 0..200 {
        let mut at = || random.between(5e-3, 9.2e-3);
        let position = Vector::new(at(), at(), at());
        let mut spin = || random.between(-500.0, 500.0);
        let angular_velocity = Vector::new(spin(), spin(), spin());
        let velocity = Vector::new(spin(), spin(), spin()) * 1e-3;
        let (scale, orientation) = (random.between(0.3, 0.6), random.orientation());
        grains.push(Grain { orientation, velocity, angular_velocity, scale, ..Grain::new(id, 2650.0, position) });
        let mut setup = setup(law);
        setup.bodies = vec![body.clone()];
        let mut engine = Engine::new(&domain, setup, &grains).expect("the case is sound");
        if engine.advance(&domain, &Loads::none(), Vector::ZERO, 1e-13, Substeps::Fixed(1)).is_err() {
            grains.pop();
        }
    }
    let h = 1e-12;
    let mut engine = Engine::new(&domain, setup(law), &grains).expect("the case is sound");
    let report =
        engine.advance(&domain, &Loads::none(), Vector::ZERO, h, Substeps::Fixed(1)).expect("the case is sound");
    assert!(report.contacts > 50, "{report:?}");
    let expected = by_all_pairs(&law, &body, &grains, h);
    let g = engine.grains();
    let largest = expected.iter().map(|e| e.0.length()).fold(0.0, Real::max);
    for (i, (force, torque)) in expected.iter().enumerate() {
        // What is left is the turn of the grains during half of the sub-step.
        assert!((g.contact_force[i] - *force).length() < 1e-8 * largest, "{i} {} {force}", g.contact_force[i]);
        assert!((g.contact_torque[i] - *torque).length() < 1e-8 * largest * 0.6e-3);
    }
    // Negative control: without one of the touching grains the forces are others.
    let gone = (0..grains.len()).find(|&i| expected[i].0.length() == largest).expect("the case is sound");
    grains.remove(gone);
    let others = by_all_pairs(&law, &body, &grains, h);
    let found = (0..=grains.len()).filter(|&i| i != gone).map(|i| g.contact_force[i]);
    assert!(found.zip(&others).any(|(found, other)| (found - other.0).length() > 1e-3 * largest));
}

#[test]
fn a_grain_that_is_no_number_is_named_on_every_rank() {
    let outcomes = run_ranks(2, 1, |c| {
        let grid = Grid::new([4, 4, 4], Vector::ZERO, Vector::splat(0.01));
        let domain = Domain::new(grid, [false; 3], c).expect("the case is sound");
        let mut engine =
            Engine::new(&domain, setup(LinearSpringDashpot::SAND), &implosion()).expect("the case is sound");
        let own = engine.grains().owned();
        let mut force = vec![Vector::ZERO; own];
        if domain.communicator().rank() == 1 {
            force[3].x = Real::NAN;
        }
        let id = engine.grains().id[3];
        let loads = Loads { force: &force, ..Loads::none() };
        (id, engine.advance(&domain, &loads, Vector::ZERO, 1e-5, Substeps::Auto).unwrap_err())
    })
    .expect("the case is sound");
    assert!(matches!(outcomes[0].1, DemError::Elsewhere(_)));
    assert!(matches!(outcomes[1].1, DemError::NotFinite { id, .. } if id == outcomes[1].0), "{:?}", outcomes[1]);
}

#[test]
fn escapes_and_deep_overlaps_end_a_run() {
    let domain = domain();
    let gone = Grain { velocity: Vector::X, ..Grain::new(8, 2650.0, Vector::splat(0.01)) };
    let mut small = setup(LinearSpringDashpot::SAND);
    small.region = [Vector::ZERO, Vector::splat(0.0101)];
    let mut engine = Engine::new(&domain, small, &[gone]).expect("the case is sound");
    let error = engine.advance(&domain, &Loads::none(), Vector::ZERO, 2e-4, Substeps::Auto).unwrap_err();
    assert!(matches!(error, DemError::GrainEscaped { id: 8, .. }), "{error}");

    let at = |id: u64, x: Real| Grain::new(id, 2650.0, Vector::new(0.01 + x, 0.01, 0.01));
    let mut engine = Engine::new(&domain, setup(LinearSpringDashpot::SAND), &[at(5, 0.0), at(7, 0.26e-3)])
        .expect("the case is sound");
    let error = engine.advance(&domain, &Loads::none(), Vector::ZERO, 1e-9, Substeps::Auto).unwrap_err();
    assert!(matches!(error, DemError::OverlapTooLarge { ids: [5, 7], fraction, .. } if fraction > 0.8), "{error}");
    assert!(error.to_string().contains("grains 5 and 7 overlap by"));

    let mut engine = Engine::new(&domain, setup(LinearSpringDashpot::SAND), &[at(5, 0.0), at(7, 0.4e-3)])
        .expect("the case is sound");
    let report =
        engine.advance(&domain, &Loads::none(), Vector::ZERO, 1e-9, Substeps::Auto).expect("the case is sound");
    assert!(report.deep_contacts > 0 && report.largest_overlap > 0.2, "{report:?}");
    let again = engine.advance(&domain, &Loads::none(), Vector::ZERO, 1e-9, Substeps::Auto).expect("the case is sound");
    assert_eq!(again.deep_contacts, 0, "counted once");
}

#[test]
fn senseless_grains_are_refused() {
    let domain = domain();
    let refused = |change: fn(&mut Grain)| {
        let mut grain = Grain::new(3, 2650.0, Vector::splat(0.01));
        change(&mut grain);
        Engine::new(&domain, setup(LinearSpringDashpot::SAND), &[Grain::new(1, 2650.0, Vector::splat(0.005)), grain])
    };
    assert!(refused(|_| {}).is_ok());
    assert!(refused(|g| g.id = 1).is_err());
    assert!(refused(|g| g.shape = 4).is_err());
    assert!(refused(|g| g.material = 4).is_err());
    assert!(refused(|g| g.density = -1.0).is_err());
    assert!(refused(|g| g.scale = 0.0).is_err());
    assert!(refused(|g| g.position.x = Real::NAN).is_err());
    let narrow = Domain::solo(Grid::new([4, 4, 4], Vector::ZERO, Vector::splat(1e-3)), [true, false, false]);
    let error =
        Engine::new(&narrow, setup(LinearSpringDashpot::SAND), &[Grain::new(1, 2650.0, Vector::ZERO)]).unwrap_err();
    assert!(matches!(error, DemError::BoxTooShort { direction: 0, .. }));
}

#[test]
fn senseless_grains_are_refused_later_too_and_leave_the_others_alone() {
    let numbers = run_ranks(2, 1, |c| {
        let domain = Domain::new(Grid::new([4, 4, 4], Vector::ZERO, Vector::splat(0.02)), [false; 3], c)
            .expect("there are cells for two ranks");
        let at = |id: u64, x: Real| Grain::new(id, 2650.0, Vector::splat(x));
        let mut engine =
            Engine::new(&domain, setup(LinearSpringDashpot::SAND), &[at(1, 5e-3)]).expect("the grain makes sense");
        let late = at(2, 15e-3);
        let twice_there = [at(2, 5e-3), at(2, 15e-3)];
        for bad in [&[Grain { material: 1, ..late }][..], &[Grain { shape: 1, ..late }], &[at(1, 15e-3)], &twice_there]
        {
            let error = engine.insert(&domain, bad).unwrap_err();
            assert!(matches!(error, DemError::BadGrain { .. } | DemError::Elsewhere(_)), "{error}");
        }
        engine.insert(&domain, &[late]).expect("this grain makes sense");
        let report = engine.advance(&domain, &Loads::none(), Vector::ZERO, 1e-5, Substeps::Auto);
        report.expect("two grains far apart");
        engine.grains().owned()
    })
    .expect("no rank fails");
    assert_eq!(numbers, [1, 1]);
}

#[test]
fn less_friction_packs_denser() {
    let width = 3e-3;
    let grid = Grid::new([4, 4, 4], Vector::ZERO, Vector::new(width, width, 0.02));
    let domain = Domain::solo(grid, [true, true, false]);
    let height = |friction: Real| {
        let settings = PackingSettings {
            periodic: [true; 2],
            lattice: Lattice::Low,
            step: 2e-4,
            rest_speed: 1e-2,
            rest_energy: 1e-2,
            longest: 0.08,
            ..PackingSettings::new(Vector::ZERO, Vector::new(width, width, 0.02))
        };
        let law = LinearSpringDashpot {
            normal_stiffness: 500.0,
            tangential_stiffness: 500.0,
            damping: Damping::Restitution(0.4),
            friction,
            ..LinearSpringDashpot::SAND
        };
        let grains = (0..120).map(|id| Grain::new(id, 2650.0, Vector::ZERO)).collect();
        let bodies = vec![Body::prolate(0.26e-3, 0.635e-3, 7)];
        let mut packing =
            Packing::new(&domain, settings, bodies, Interactions::uniform(1, law), grains).expect("the case is sound");
        while !matches!(packing.step(&domain).expect("the case is sound").stage, Stage::Done | Stage::GivenUp) {}
        let bed = packing.bed();
        let order = lying_order(&domain, packing.engine());
        (bed.iter().map(|g| g.position.z).sum::<Real>() / bed.len() as Real, order)
    };
    let [rough, middle, smooth] = [0.6, 0.3, 0.0].map(height);
    println!("mean height and order: {rough:?} {middle:?} {smooth:?}");
    assert!(rough.0 > middle.0 && middle.0 > smooth.0);
    assert!([rough, middle, smooth].iter().all(|h| h.1 > 0.0));
}

#[test]
fn glued_grains_go_with_walls_that_are_not_there() {
    let domain = domain();
    let glued =
        |id: u64, motion: Motion| Grain { motion, ..Grain::new(id, 2650.0, Vector::splat(5e-3 * (id + 1) as Real)) };
    let grains = [glued(0, Motion::WithWalls), glued(1, Motion::Fixed)];
    let mut engine = Engine::new(&domain, setup(LinearSpringDashpot::SAND), &grains).expect("the case is sound");
    let velocity = Vector::new(0.1, 0.0, 0.0);
    engine.set_wall_velocities(&domain, velocity);
    // Negative control: a fixed one stays.
    assert_eq!(engine.grains().velocity[..2], [velocity, Vector::ZERO]);
    // One that comes later too.
    engine.insert(&domain, &[glued(2, Motion::WithWalls)]).expect("the case is sound");
    engine.set_wall_velocities(&domain, velocity);
    assert_eq!(engine.grains().velocity[2], velocity);
}
