//! Contact angles at walls.

use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::solver::Solver;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::drops::*;

/// A cap of a sphere, or of a disc in a slice, on the floor of a unit box: its radius and the middle of the whole.
fn cap(angle: Real, flat: bool) -> (Real, Vector) {
    let (sin, cos) = angle.to_radians().sin_cos();
    let radius = if angle < 90.0 { 0.3 / sin } else { 0.25 };
    (radius, Vector::new(0.5031, if flat { 0.0 } else { 0.5011 }, -radius * cos))
}

/// Largest error of the jump of the pressure of a cap at `angle` where `given` [degrees] are the advancing and the receding contact angle, over that of the cap, and the
/// share of cells from columns.
fn error_of_cap(n: usize, flat: bool, angle: Real, given: [Real; 2]) -> (Real, Real) {
    let cells = [n, if flat { 1 } else { n }, n * 3 / 5];
    let size = Vector::from_array(cells.map(|cells| cells as Real / n as Real));
    let across = if flat { [Side::Periodic; 2] } else { [Side::NoSlip; 2] };
    let mut angles = [[[std::f64::consts::FRAC_PI_2; 2]; 2]; 3];
    angles[2][0] = given.map(Real::to_radians);
    let sides = [[Side::NoSlip; 2], across, [Side::NoSlip; 2]];
    let boundary = Boundary::new(sides).expect("a box").with_contact_angles(angles);
    let domain = Domain::solo(Grid::new(cells, Vector::ZERO, size), boundary.periodic());
    let (radius, centre) = cap(angle, flat);
    let away = |x: Vector| if flat { Vector::new(x.x - centre.x, 0.0, x.z - centre.z) } else { x - centre };
    let kappa = if flat { 1.0 } else { 2.0 } / radius;
    error_of((domain, boundary), |x| away(x).length() - radius, |x| largest(away(x)), |_| kappa)
}

#[test]
fn the_curvature_of_a_cap_converges_up_to_the_wall() {
    for angle in [30.0, 60.0, 90.0, 120.0, 150.0] {
        let errors = [32, 64, 128].map(|n| error_of_cap(n, true, angle, [angle; 2]));
        println!("slice, {angle} degrees: {errors:?}");
        // Heights with a slope of 1.7 are of their order only on finer cells.
        let order = if (60.0..=120.0).contains(&angle) { 1.0 } else { 0.8 };
        assert!((errors[0].0 / errors[2].0).log2() > 2.0 * order, "{errors:?}");
        assert!(errors[2].0 < 0.02, "{errors:?}");
        // Negative control: with another angle the error grows as cells get finer.
        let wrong =
            [32, 64].map(|n| error_of_cap(n, true, angle, [angle + if angle < 90.0 { 15.0 } else { -15.0 }; 2]).0);
        assert!(wrong[0] > 0.3 && wrong[1] > 1.5 * wrong[0], "{wrong:?}");
    }
}

#[test]
fn a_cap_of_a_sphere_has_its_curvature_up_to_the_wall() {
    // At 150 degrees, ten cells a radius, the wedge of gas at the wall is steep in two directions at once.
    for (angle, most) in [(45.0, 0.12), (60.0, 0.12), (120.0, 0.12), (150.0, 0.25)] {
        let error = error_of_cap(40, false, angle, [angle; 2]).0;
        println!("{angle} degrees: {error}");
        assert!(error < most, "{error}");
    }
    // Negative control: with another angle the curvature at the wall is none of the sphere's.
    let wrong = error_of_cap(40, false, 60.0, [75.0; 2]).0;
    println!("60 degrees with 75: {wrong}");
    assert!(wrong > 1.0, "{wrong}");
}

/// A cap in a slice of `n` cells on a floor of this contact angle [degrees].
fn on_floor(n: usize, angle: Real, given: Real) -> Solver {
    let (radius, centre) = cap(angle, true);
    let mut case = Case { centre, semi_axes: Vector::new(radius, Real::INFINITY, radius), ..Case::slice(n) };
    case.angles[2][0] = given;
    case.alone()
}

#[test]
fn a_cap_at_its_angle_stays_and_its_energy_is_the_least() {
    for angle in [45.0, 60.0, 120.0] {
        let mut still = on_floor(32, angle, angle);
        advance(&mut still, 150);
        let mut moves = on_floor(32, angle, 90.0);
        advance(&mut moves, 150);
        println!("{angle}: {} {}", fastest(&still), fastest(&moves));
        assert!(fastest(&still) < 3e-3);
        assert!(fastest(&moves) > 30.0 * fastest(&still));
        // Over a floor that it wets by 60 degrees a half disc has too much energy, which it loses.
        let mut spreads = on_floor(32, 90.0, angle);
        let before = spreads.surface_energy();
        advance(&mut spreads, 100);
        assert!(spreads.surface_energy() < before);
    }
}

#[test]
fn the_energy_of_a_cap_is_that_of_its_surface_less_what_the_wall_gives() {
    for angle in [45.0_f64, 60.0, 120.0] {
        let (radius, _) = cap(angle, true);
        let (sin, cos) = angle.to_radians().sin_cos();
        let exact = SIGMA * radius * (2.0 * angle.to_radians() - 2.0 * sin * cos) / 64.0;
        let found = on_floor(64, angle, angle).surface_energy();
        println!("{angle}: {found} {exact}");
        assert!((found / exact - 1.0).abs() < 0.01, "{angle}: {found} {exact}");
        // Negative control: at a right angle the wall gives nothing.
        let without = on_floor(64, angle, 90.0).surface_energy();
        assert!((without / exact - 1.0).abs() > 0.1);
    }
}

#[test]
fn between_two_angles_a_cap_keeps_its_own_curvature() {
    for (angle, flat) in [(60.0, true), (75.0, true), (100.0, true), (75.0, false)] {
        let errors = [32, 64].map(|n| error_of_cap(n, flat, angle, [125.0, 40.0]).0);
        println!("{angle} {flat}: {errors:?}");
        assert!(errors[0] < 0.3 && errors[1] < 0.12, "{angle} {flat}: {errors:?}");
    }
    // Negative control: what lies outside the two angles is pulled in.
    let outside = error_of_cap(64, true, 60.0, [125.0, 75.0]).0;
    assert!(outside > 0.3, "{outside}");
}
