//! The stiffness or damping of contacts as a rigid body feels them: a 6 x 6 matrix over its mass and inertia, whose largest
//! eigenvalue is the square of its fastest frequency, or its fastest rate of damping.

use sazanami_numerics::{Real, Vector};

/// Sum over contacts of `k b b^T`, `b` a direction over the root of mass and inertia.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Modes([[Real; 6]; 6]);

/// Squarings of the matrix in [`Modes::largest`]: the bound is at most `6^(1/64)`, 2.8 %, above the eigenvalue.
const SQUARINGS: usize = 6;

/// What turns forces on a body into its motion: reciprocals of mass [1/kg] and principal moments [1/(kg m^2)].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inertia {
    pub inverse_mass: Real,
    pub inverse_moments: Vector,
}

impl Modes {
    /// Adds a contact at `arm` from the centre of mass, both it and the `normal` in principal axes, of these stiffnesses
    /// or dashpots along and across the normal.
    pub fn add(&mut self, inertia: &Inertia, arm: Vector, normal: Vector, [along, across]: [Real; 2]) {
        let tangent = normal.any_orthonormal_vector();
        for (direction, value) in [(normal, along), (tangent, across), (normal.cross(tangent), across)] {
            let push = direction * inertia.inverse_mass.sqrt();
            let turn = arm.cross(direction) * inertia.inverse_moments.map(Real::sqrt);
            let b = [push.x, push.y, push.z, turn.x, turn.y, turn.z];
            for (row, left) in self.0.iter_mut().zip(b) {
                for (entry, right) in row.iter_mut().zip(b) {
                    *entry += value * left * right;
                }
            }
        }
    }

    /// The largest eigenvalue or a little more: the root of the trace of a power.
    pub fn largest(&self) -> Real {
        let trace = |m: &[[Real; 6]; 6]| (0..6).map(|d| m[d][d]).sum::<Real>();
        let (mut power, mut logarithm, mut weight) = (self.0, 0.0, 1.0);
        for _ in 0..SQUARINGS {
            let size = trace(&power);
            if size <= 0.0 || !size.is_finite() {
                return size.max(0.0);
            }
            logarithm += size.ln() * weight;
            weight *= 0.5;
            power.iter_mut().flatten().for_each(|entry| *entry /= size);
            let m = power;
            power = std::array::from_fn(|i| std::array::from_fn(|j| (0..6).map(|k| m[i][k] * m[k][j]).sum::<Real>()));
        }
        (logarithm + trace(&power).ln() * weight).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_just_above_the_largest_eigenvalue() {
        // Four contacts at the corners of a square of half edge a under a plate: it rises with 4 k/m, tilts with 4 k a^2/I.
        let inertia = Inertia { inverse_mass: 0.5, inverse_moments: Vector::splat(3.0) };
        for (a, expected) in [(0.1_f64, 4.0 * 7.0 * 0.5), (1.0, 4.0 * 7.0 * 3.0)] {
            let mut modes = Modes::default();
            for (x, y) in [(a, a), (a, -a), (-a, a), (-a, -a)] {
                modes.add(&inertia, Vector::new(x, y, 0.0), Vector::Z, [7.0, 0.0]);
            }
            let found = modes.largest() / expected;
            assert!((1.0..1.029).contains(&found), "{a}: {found}");
        }
        assert_eq!(Modes::default().largest(), 0.0);
    }
}
