//! Random numbers that are the same everywhere: xoshiro256++ seeded by splitmix64 (Blackman and Vigna, 2019).

use crate::{Quaternion, Real};

/// A generator of random numbers.
#[derive(Clone, Debug)]
pub struct Random {
    state: [u64; 4],
}

impl Random {
    /// A generator whose whole sequence follows from `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let mut z = seed;
        let mut next = || {
            z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut x = z;
            x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            x ^ (x >> 31)
        };
        Self { state: [next(), next(), next(), next()] }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        let s = &mut self.state;
        let result = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        result
    }

    /// A number from 0 up to but not including 1.
    pub fn unit(&mut self) -> Real {
        (self.bits() >> 11) as Real / (1_u64 << 53) as Real
    }

    /// A number from `low` to `high`.
    pub fn between(&mut self, low: Real, high: Real) -> Real {
        low + (high - low) * self.unit()
    }

    /// An orientation, all equally likely (Shoemake, 1992).
    pub fn orientation(&mut self) -> Quaternion {
        let (u, v, w) = (self.unit(), self.unit(), self.unit());
        let turn = 2.0 * std::f64::consts::PI;
        let ((s1, c1), (s2, c2)) = ((turn * v).sin_cos(), (turn * w).sin_cos());
        let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
        Quaternion::from_xyzw(a * s1, a * c1, b * s2, b * c2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_spread_evenly_and_repeat() {
        let mut random = Random::new(7);
        let n = 20_000;
        let mean = (0..n).map(|_| random.unit()).sum::<Real>() / Real::from(n);
        assert!((mean - 0.5).abs() < 0.01);
        assert_eq!(Random::new(7).bits(), Random::new(7).bits());
        assert_ne!(Random::new(7).bits(), Random::new(8).bits());
    }

    #[test]
    fn orientations_have_no_preferred_direction() {
        let mut random = Random::new(1);
        let n = 20_000;
        let square = (0..n).map(|_| (random.orientation() * crate::Vector::X).z.powi(2)).sum::<Real>();
        assert!((square / Real::from(n) - 1.0 / 3.0).abs() < 0.01);
    }
}
