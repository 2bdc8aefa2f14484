//! Lift on spheres in sheared fluid, and the vorticity of the fluid at grains.

use std::f64::consts::FRAC_1_SQRT_2;

use sazanami_numerics::{Real, Vector, choices};
use sazanami_parallel::for_each_chunk;

use super::OverlappingGrains;
use super::binned::{Lanes, lanes};
use super::drag::DragParameters;
use super::reading::READ;
use crate::moments::velocity_gradient;
use crate::neighbours::ROWS;

choices! {
    /// Lift on grains in sheared fluid.
    #[derive(Default)]
    pub enum Lift {
        /// None.
        #[default]
        None = "none",
        /// `1.615 d^2 sqrt(rho mu/|w|) (u - v) x w` with the vorticity `w` (Saffman 1965, 1968): for small Reynolds numbers.
        Saffman = "saffman",
        /// The same times the correction of Mei (1992) for Reynolds numbers up to 100.
        Mei = "mei",
    }
}

/// Factor of Saffman's force on the slip across the vorticity, from 6.46 for radii.
const SAFFMAN: Real = 1.615;
/// Constants of Mei's fit to the computations of Dandy and Dwyer (1990), and the Reynolds number at which its forms change.
const MEI: [Real; 2] = [0.3314, 0.0524];
const MEI_CHANGES: Real = 40.0;

/// Lift \[N] on a sphere of diameter `d` \[m] past which the fluid moves with `slip` [m/s], fluid less grain, and has the
/// `vorticity` [1/s]; density and viscosity are those of `fluid`.
///
/// Saffman, J. Fluid Mech. 22, 385 (1965) with the corrigendum 31, 624 (1968); Mei, Int. J. Multiphase Flow 18, 145 (1992),
/// eqs. (8) and (9), with `a = d |w|/(2 |u - v|)` fitted from 0.005 to 0.4.
#[must_use]
pub fn lift_force(lift: Lift, fluid: &DragParameters, d: Real, slip: Vector, vorticity: Vector) -> Vector {
    let (speed, rate) = (slip.length(), vorticity.length());
    if lift == Lift::None || speed == 0.0 || rate == 0.0 {
        return Vector::ZERO;
    }
    // Saffman's scale of length, and what Mei makes of it: with `a Re = rho d^2 |w|/(2 mu)` fast slip forgets the viscosity.
    let saffman = (fluid.density * fluid.viscosity / rate).sqrt();
    let scale = match lift {
        Lift::Saffman | Lift::None => saffman,
        Lift::Mei => {
            let (reynolds, shear) = (fluid.density * speed * d / fluid.viscosity, 0.5 * d * rate / speed);
            let part = MEI[0] * shear.sqrt();
            if reynolds > MEI_CHANGES {
                MEI[1] * fluid.density * d * FRAC_1_SQRT_2
            } else {
                saffman * ((1.0 - part) * (-0.1 * reynolds).exp() + part)
            }
        }
    };
    SAFFMAN * d * d * scale * slip.cross(vorticity)
}

/// Weighted sums over the fluid around a grain: weights, distances, velocities, and products of distances with one another
/// and with velocities.
type Sums = [Real; 22];

/// Least sum of the squares of the ways from the middle of the particles to them, over that of the ways from the grain: of two, at a sixteenth of their
/// way to the grain from one another. Of a single one rounding is left.
const SPREAD: Real = 1e-3;

/// Vorticity [1/s] by least squares with a linear velocity, exact for one on any arrangement. `None` if the particles do not
/// span the space.
fn vorticity(sums: &Sums) -> Option<Vector> {
    let [support, x, y, z, u, v, w, moments @ ..] = *sums;
    if support == 0.0 {
        return None;
    }
    let [xx, yy, zz, xy, xz, yz, products @ ..] = moments;
    // About the mean place.
    let about = |product: Real, a: Real, b: Real| product - a * b / support;
    let moments =
        [about(xx, x, x), about(yy, y, y), about(zz, z, z), about(xy, x, y), about(xz, x, z), about(yz, y, z)];
    if moments[0] + moments[1] + moments[2] < SPREAD * (xx + yy + zz) {
        return None;
    }
    let of = |d: usize, a: Real| {
        let row = Vector::from_slice(&products[3 * d..]);
        row - Vector::new(u, v, w) * (a / support)
    };
    let [dx, dy, dz] = velocity_gradient(&[of(0, x), of(1, y), of(2, z)], &moments)?;
    Some(Vector::new(dy.z - dz.y, dz.x - dx.z, dx.y - dy.x))
}

impl OverlappingGrains {
    /// Sets the lift on each own grain from the fluid that was interpolated last.
    pub(super) fn set_lift(&mut self) {
        let Self { engine, coupling, around, diameter, fluid, gates, .. } = self;
        let (grains, fluid, gates, diameter) = (engine.grains(), &*fluid, &gates[..], &diameter[..]);
        let (lift, law) = (coupling.lift, &coupling.drag);
        for_each_chunk(&mut around[..], ROWS, |number, around| {
            for (row, around) in around.iter_mut().enumerate().filter(|(_, around)| around.wetness > 0.0) {
                let g = number * ROWS + row;
                let sums = fluid.sum_beside(gates, grains.position[g], |pair, fluid: &[Lanes; READ]| {
                    let [_, _, _, bulk, _, u, v, w, ..] = fluid;
                    let weight = lanes(|l| pair.weight[l] * bulk[l]);
                    let times = |a: &Lanes, b: &Lanes| lanes(|l| a[l] * b[l]);
                    // From the grain to the particle.
                    let [x, y, z] = pair.apart.map(|apart| lanes(|l| -apart[l]));
                    let [wx, wy, wz] = [&x, &y, &z].map(|r| times(&weight, r));
                    let [xu, xv, xw] = [u, v, w].map(|u| times(&wx, u));
                    let [yu, yv, yw] = [u, v, w].map(|u| times(&wy, u));
                    let [zu, zv, zw] = [u, v, w].map(|u| times(&wz, u));
                    let [wu, wv, ww] = [u, v, w].map(|u| times(&weight, u));
                    let squares = [times(&wx, &x), times(&wy, &y), times(&wz, &z)];
                    let [xx, yy, zz] = squares;
                    let [xy, xz, yz] = [times(&wx, &y), times(&wx, &z), times(&wy, &z)];
                    [weight, wx, wy, wz, wu, wv, ww, xx, yy, zz, xy, xz, yz, xu, xv, xw, yu, yv, yw, zu, zv, zw]
                });
                match vorticity(&sums) {
                    Some(vorticity) => {
                        let slip = around.velocity - grains.velocity[g];
                        around.lift = around.wetness * lift_force(lift, law, diameter[g], slip, vorticity);
                    }
                    None => around.without_vorticity = true,
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WATER: DragParameters = DragParameters::recommended(1000.0, 1e-3);
    const D: Real = 1e-3;

    #[test]
    fn lift_pushes_grains_that_lag_to_the_faster_side() {
        // u = G z along x1 has the vorticity G along x2.
        let (shear, slip): (Real, Real) = (10.0, 1e-3);
        let force = |slip: Real, shear: Real| lift_force(Lift::Saffman, &WATER, D, slip * Vector::X, shear * Vector::Y);
        let expected = 1.615 * 1e-6 * (1e3 * 1e-3 * shear).sqrt() * slip;
        assert!((force(slip, shear).z / expected - 1.0).abs() < 1e-12);
        // One that leads goes to the slower side, as does one that lags where the shear is turned round.
        assert!((force(-slip, shear).z / expected + 1.0).abs() < 1e-12);
        assert!((force(slip, -shear).z / expected + 1.0).abs() < 1e-12);
        // Negative controls.
        assert_eq!(force(slip, 0.0), Vector::ZERO);
        assert_eq!(force(0.0, shear), Vector::ZERO);
        assert_eq!(lift_force(Lift::None, &WATER, D, slip * Vector::X, shear * Vector::Y), Vector::ZERO);
    }

    #[test]
    fn meis_correction_has_the_values_worked_out_by_hand() {
        // Over Saffman's force at a Reynolds number and a dimensionless shear, in water past 1 mm.
        let over = |reynolds: Real, shear: Real| {
            let slip = 1e-3 * reynolds;
            let of = |lift| lift_force(lift, &WATER, D, slip * Vector::X, 2.0 * shear * slip / D * Vector::Y).z;
            of(Lift::Mei) / of(Lift::Saffman)
        };
        // At a = 0.1: 0.3314 sqrt(a) = 0.10480, exp(-1) = 0.36788, exp(-4) = 0.018316; 0.0524 sqrt(10).
        for (reynolds, expected) in [(1e-6, 1.0), (10.0, 0.43413), (39.999, 0.12120), (100.0, 0.16570)] {
            assert!((over(reynolds, 0.1) - expected).abs() < 1e-5, "{reynolds} {}", over(reynolds, 0.1));
        }
        // Negative control: at another Reynolds number and in another shear.
        assert!((over(20.0, 0.1) - 0.43413).abs() > 0.1 && (over(10.0, 0.4) - 0.43413).abs() > 0.05);
        assert!((over(1e-6, 1e6) - 1.0).abs() < 1e-4, "slow slip in a strong shear");
        // Without viscosity the force of fast slip is the same.
        let inviscid = DragParameters { viscosity: 0.0, ..WATER };
        let of = |fluid| lift_force(Lift::Mei, fluid, D, 0.1 * Vector::X, 20.0 * Vector::Y);
        assert_eq!(of(&inviscid), of(&WATER));
    }

    /// Sums over disordered particles on one side of a grain with a `velocity`.
    fn sums(velocity: impl Fn(Vector) -> Vector) -> Sums {
        let mut sums = [0.0; 22];
        for n in 0..40_u32 {
            let at = |k: u32| Real::from(n * k % 41) / 41.0;
            let r = Vector::new(at(7) - 0.5, at(13) - 0.3, 0.8 * at(29));
            let (weight, u) = (1.0 - 0.5 * at(3), velocity(r));
            let [x, y, z] = r.to_array();
            let mut terms = vec![1.0, x, y, z, u.x, u.y, u.z, x * x, y * y, z * z, x * y, x * z, y * z];
            terms.extend([x, y, z].iter().flat_map(|&x| (x * u).to_array()));
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += weight * term);
        }
        sums
    }

    #[test]
    fn the_vorticity_of_a_linear_velocity_is_exact_on_any_arrangement() {
        let turning = Vector::new(1.0, -2.0, 0.5);
        let found = vorticity(&sums(|r| turning.cross(r) + Vector::new(3.0, 0.0, -1.0))).expect("they span the space");
        assert!((found - 2.0 * turning).length() < 1e-12, "{found}");
        let sheared = vorticity(&sums(|r| Vector::new(4.0 * r.z, 0.0, 0.0))).expect("they span the space");
        assert!((sheared - 4.0 * Vector::Y).length() < 1e-12, "{sheared}");
        // Negative control: a pure strain has none.
        let strained = vorticity(&sums(|r| Vector::new(r.z, 0.0, r.x))).expect("they span the space");
        assert!(strained.length() < 1e-12, "{strained}");
        // One particle by itself, and two: what is left about their middle is rounding.
        for places in [&[[0.3, 0.1, 0.2]][..], &[[0.3, 0.1, 0.2], [0.31, 0.1, 0.2]]] {
            let mut few = [0.0; 22];
            for r in places.iter().copied().map(Vector::from_array) {
                let ([x, y, z], u) = (r.to_array(), turning.cross(r));
                let mut terms = vec![1.0, x, y, z, u.x, u.y, u.z, x * x, y * y, z * z, x * y, x * z, y * z];
                terms.extend([x, y, z].iter().flat_map(|&x| (x * u).to_array()));
                few.iter_mut().zip(terms).for_each(|(sum, term)| *sum += 0.37 * term);
            }
            assert!(vorticity(&few).is_none());
        }
        // In a plane and with none at all it is not known.
        let mut plane = sums(|r| turning.cross(r));
        [3, 9, 11, 12].iter().for_each(|&n| plane[n] = 0.0);
        assert!(vorticity(&plane).is_none() && vorticity(&[0.0; 22]).is_none());
    }
}
