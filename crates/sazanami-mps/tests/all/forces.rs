//! Added mass and lift of grains.

use sazanami_dem::{Grain, Motion};
use sazanami_mps::grains::{AddedMass, AddedMassForm, DragParameters, Lift, lift_force, volume};
use sazanami_mps::solver::{Forcing, Solver};
use sazanami_numerics::{Real, Vector};

use crate::equivalence::{ranks_agree, restart_agrees, shaken, threads_agree};
use crate::support::{Case, GRAVITY, OPEN_TOP, PERIODIC, SPACING, WALLS, jittered, under};

const SPHERE: AddedMass = AddedMass { form: AddedMassForm::Constant, coefficient: 0.5 };
const ZUBER: AddedMass = AddedMass { form: AddedMassForm::Zuber, coefficient: 0.5 };

fn velocity(solver: &Solver) -> Vector {
    solver.grains().engine().grains().velocity[0]
}

#[test]
fn a_sphere_released_in_still_water_starts_with_its_added_mass() {
    let mut case = Case::filled([14, 14, 20], [14, 14, 18], [PERIODIC, PERIODIC, OPEN_TOP]);
    // Drag does not count.
    case.viscosity = 1e-9;
    let mut start = |density: Real, added_mass: AddedMass| {
        case.added_mass = added_mass;
        case.grains = vec![Grain::new(0, density, SPACING * Vector::new(7.13, 6.4, 9.0))];
        let mut solver = case.solo();
        let (dt, steps) = (1e-4, 10);
        for _ in 0..steps {
            solver.step(dt, &under(GRAVITY), |_| ()).expect("the step is sound");
        }
        velocity(&solver).z / (dt * Real::from(steps))
    };
    // The conjugate projection gives a light grain alone 3 % too little buoyancy, half of that with added mass.
    for (density, off) in [(2650.0, 0.03), (500.0, 0.035)] {
        let expected = |coefficient: Real| 9.81 * (1000.0 - density) / (density + coefficient * 1000.0);
        let [found, alone] = [SPHERE, AddedMass::NONE].map(|added| start(density, added));
        assert!((found / expected(0.5) - 1.0).abs() < off, "{density}: {found} {}", expected(0.5));
        // Negative control: without added mass as without.
        assert!((alone / expected(0.0) - 1.0).abs() < off, "{density}: {alone} {}", expected(0.0));
        let slower = found / alone * expected(0.0) / expected(0.5);
        assert!((slower - 1.0).abs() < 0.02, "{density}: {slower}");
        // In clear water Zuber's factor is 1.
        assert!((start(density, ZUBER) / found - 1.0).abs() < 1e-9);
    }
}

/// Amplitude of the velocity of a grain over that of the water that a gradient of pressure swings.
fn swung(density: Real, added_mass: AddedMass) -> Real {
    let mut case = Case::filled([10; 3], [10; 3], [PERIODIC; 3]);
    (case.viscosity, case.added_mass) = (1e-9, added_mass);
    case.fluid.truncate(999);
    case.grains = vec![Grain::new(0, density, SPACING * Vector::new(5.2, 4.9, 5.1))];
    let mut solver = case.solo();
    let (period, count) = (0.02, 100);
    let dt = period / Real::from(count);
    let rate = 2.0 * std::f64::consts::PI / period;
    let [mut grain, mut water]: [[Real; 2]; 2] = [[0.0; 2]; 2];
    for n in 0..count {
        // The way of the water is a twentieth of a diameter.
        let by_volume = 0.05 * SPACING * rate * rate * (rate * dt * (Real::from(n) + 0.5)).cos() * Vector::X;
        let forcing = Forcing { body_force: by_volume, by_volume, ..Forcing::default() };
        solver.step(dt, &forcing, |_| ()).expect("the step is sound");
        let mass = solver.particle_mass() * case.fluid.len() as Real;
        let now = [velocity(&solver).x, solver.fluid_momentum().x / mass];
        for (range, now) in [&mut grain, &mut water].into_iter().zip(now) {
            *range = [range[0].min(now), range[1].max(now)];
        }
    }
    (grain[1] - grain[0]) / (water[1] - water[0])
}

#[test]
fn grains_swing_in_oscillating_water_as_linear_theory_says() {
    for density in [2650.0, 1000.0, 500.0] {
        let [with, without] = [SPHERE, AddedMass::NONE].map(|added| swung(density, added));
        let expected = 3.0 * 1000.0 / (2.0 * density + 1000.0);
        assert!((with / expected - 1.0).abs() < 0.03, "{density}: {with} {expected}");
        // Negative control: by the gradient of pressure alone.
        assert!((without / (1000.0 / density) - 1.0).abs() < 0.03, "{density}: {without}");
    }
}

/// Grains that fall through sheared water, with all forces.
fn falling() -> Case {
    let mut case = Case::filled([12, 8, 16], [12, 8, 14], [PERIODIC, PERIODIC, OPEN_TOP]);
    (case.added_mass, case.lift) = (ZUBER, Lift::Mei);
    case.fluid.iter_mut().for_each(|p| p.velocity = 20.0 * p.position.z * Vector::X);
    case.grains = (0..48)
        .map(|id| {
            let place =
                Vector::new((id % 6) as Real * 1.9 + 1.0, (id / 6 % 4) as Real * 1.8 + 0.5, (id / 24) as Real * 1.2);
            let motion = if id % 7 == 0 { Motion::Fixed } else { Motion::Free };
            Grain { motion, ..Grain::new(id, 2650.0, SPACING * (place + 6.0 * Vector::Z)) }
        })
        .collect();
    case
}

#[test]
fn the_fluid_loses_what_added_mass_and_lift_give_the_grains() {
    let case = falling();
    let mut solver = case.solo();
    let mut given = Vector::ZERO;
    for n in 0..20 {
        // Lengths of steps differ.
        let dt = 1e-4 * Real::from(1 + n % 2);
        let coupling = solver.step(dt, &under(GRAVITY), |_| ()).expect("the step is sound").coupling;
        let on_grains = coupling.drag_on_grains + coupling.lift_on_grains + coupling.added_mass_returned;
        let scale = coupling.drag_on_grains.length();
        assert!((on_grains + coupling.drag_on_fluid).length() <= 1e-12 * scale);
        assert!((coupling.added_mass_returned - given).length() <= 1e-12 * scale);
        given = coupling.added_mass_on_grains;
        // Negative control: what there is of each.
        if n > 0 {
            assert!(coupling.lift_on_grains.z.abs() > 1e-4 * scale && given.length() > 1e-2 * scale);
        }
        assert_eq!(coupling.without_vorticity, 0);
    }
}

#[test]
fn forces_on_a_grain_are_what_its_momentum_changes_by() {
    let mut case = falling();
    case.grains.truncate(8);
    case.grains.retain(|grain| grain.motion == Motion::Free);
    let mut solver = case.solo();
    let dt = 2e-4;
    for _ in 0..10 {
        let before = solver.grains().engine().grains();
        let before = before.velocity[..before.owned()].to_vec();
        solver.step(dt, &under(GRAVITY), |_| ()).expect("the step is sound");
        let grains = solver.grains().engine().grains();
        for (g, before) in before.iter().enumerate() {
            let [drag, pressure, lift, added] = solver.grains().forces(g);
            let mass = grains.mass[g];
            let change = mass * ((grains.velocity[g] - *before) / dt - GRAVITY);
            let all = drag + pressure + lift + added;
            assert!((change - all).length() < 1e-9 * change.length(), "{change} {all}");
            // Negative control: without that of the added mass.
            assert!((change - all + added).length() > 1e-3 * change.length());
        }
    }
}

/// Momentum that grains and water in a box without walls gain beyond the impulses from outside while a gradient of pressure drives
/// them for a while, and the impulse of the added mass on the grains [N s].
fn gained(added_mass: AddedMass) -> [Real; 2] {
    let mut case = Case::filled([10; 3], [10; 3], [PERIODIC; 3]);
    case.added_mass = added_mass;
    let place = |n: u64| Vector::new((n % 2) as Real * 5.0, (n / 2 % 2) as Real * 5.0, (n / 4) as Real * 5.0);
    case.grains = (0..8).map(|n| Grain::new(n, 2650.0, SPACING * (place(n) + 1.3))).collect();
    // The water that the grains displace.
    case.fluid.truncate(1000 - (8.0 * volume(1.0)).round() as usize);
    let mut solver = case.solo();
    let momentum = |solver: &Solver| {
        let grains = solver.grains().engine().grains();
        (0..grains.owned()).map(|g| grains.mass[g] * grains.velocity[g]).sum::<Vector>() + solver.fluid_momentum()
    };
    let start = momentum(&solver);
    let mass = solver.particle_mass() * case.fluid.len() as Real + 8.0 * 1000.0 * volume(SPACING);
    let (mut given, mut last, mut driven) = (Vector::ZERO, Vector::ZERO, Vector::ZERO);
    for n in 0..20 {
        let (dt, force) = (2e-4, if n < 10 { 3.0 * Vector::X } else { Vector::ZERO });
        let forcing = Forcing { body_force: force, by_volume: force, ..Forcing::default() };
        last = solver.step(dt, &forcing, |_| ()).expect("the step is sound").coupling.added_mass_on_grains;
        given += last;
        driven += dt * mass * force;
    }
    // The fluid has the reaction of the last step still to come.
    [(momentum(&solver) - start - last - driven).x, given.x]
}

#[test]
fn momentum_is_kept_with_the_reaction_of_the_added_mass() {
    let [[with, given], [without, _]] = [SPHERE, AddedMass::NONE].map(gained);
    // Pressure and drag alone leave a residual.
    assert!((with - without).abs() < 0.01 * given, "{with:e} {without:e} {given:e}");
    // Negative control: without the reaction the momentum would be wrong by what the grains were given.
    assert!(given > 10.0 * without.abs(), "{given:e} {without:e}");
}

#[test]
fn lift_of_a_held_grain_in_a_linear_shear_is_saffmans_and_meis() {
    let mut case = Case::filled([12, 12, 20], [12, 12, 20], [PERIODIC, PERIODIC, WALLS]);
    case.fluid = jittered(case.fluid, 0.1);
    let place = SPACING * Vector::new(6.2, 5.9, 10.1);
    case.grains = vec![Grain { motion: Motion::Fixed, ..Grain::new(0, 2650.0, place) }];
    // Lift where the fluid passes the grain with a slip and has a shear.
    let mut force = |lift: Lift, slip: Real, shear: Real| {
        case.lift = lift;
        let mut solver = case.solo();
        solver.set_velocities(|p, a| (slip + shear * (p.position[a].z - place.z)) * Vector::X);
        let coupling = solver.step(1e-6, &under(Vector::ZERO), |_| ()).expect("the step is sound").coupling;
        let on_grains = coupling.drag_on_grains + coupling.lift_on_grains;
        assert!((on_grains + coupling.drag_on_fluid).length() <= 1e-12 * on_grains.length());
        solver.grains().forces(0)[2]
    };
    let water = DragParameters::recommended(1000.0, 1e-3);
    for lift in [Lift::Saffman, Lift::Mei] {
        // It lags and leads; Re 20 and 80.
        for (slip, shear) in [(0.02, 10.0), (-0.02, 10.0), (0.08, 20.0)] {
            let found = force(lift, slip, shear);
            let expected = lift_force(lift, &water, SPACING, slip * Vector::X, shear * Vector::Y);
            assert!((found - expected).length() < 0.03 * expected.length(), "{found} {expected}");
            assert!(found.z * slip > 0.0);
        }
    }
    // Negative controls: without shear, and off.
    let whole = force(Lift::Saffman, 0.02, 10.0).length();
    assert!(force(Lift::Saffman, 0.02, 0.0).length() < 1e-6 * whole);
    assert_eq!(force(Lift::None, 0.02, 10.0), Vector::ZERO);
}

#[test]
fn results_with_added_mass_and_lift_do_not_depend_on_threads_restarts_or_ranks() {
    let case = Case { added_mass: ZUBER, lift: Lift::Mei, ..shaken() };
    threads_agree(&case);
    restart_agrees(&case, "grains/grain.attached_further");
    ranks_agree(case);
}
