//! Short vectors of numbers for the processor's vector registers: a formula is written once for one contact or several.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use sazanami_numerics::{Real, Vector};

/// Number of contacts or grains worked on at once: a vector register of numbers.
pub(crate) const WIDTH: usize = 4;

/// `W` floating-point numbers.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct Lanes<const W: usize>(pub [Real; W]);

/// `W` conditions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mask<const W: usize>(pub [bool; W]);

impl<const W: usize> Lanes<W> {
    #[inline(always)]
    pub fn splat(value: Real) -> Self {
        Self([value; W])
    }

    #[inline(always)]
    pub fn from_fn(value: impl FnMut(usize) -> Real) -> Self {
        Self(std::array::from_fn(value))
    }

    #[inline(always)]
    pub fn map(self, f: impl Fn(Real) -> Real) -> Self {
        Self::from_fn(|l| f(self.0[l]))
    }

    #[inline(always)]
    pub fn zip(self, other: Self, f: impl Fn(Real, Real) -> Real) -> Self {
        Self::from_fn(|l| f(self.0[l], other.0[l]))
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.map(Real::sqrt)
    }

    #[inline(always)]
    pub fn divided_by(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }

    /// The smaller; `other` if this is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        self.map(Real::abs)
    }

    #[inline(always)]
    pub fn above(self, other: Self) -> Mask<W> {
        Mask(std::array::from_fn(|l| self.0[l] > other.0[l]))
    }
}

impl<const W: usize> Mask<W> {
    #[inline(always)]
    pub fn any(self) -> bool {
        self.0.iter().fold(false, |any, &truth| any | truth)
    }

    /// `yes` where true, else `no`.
    #[inline(always)]
    pub fn select(self, yes: Lanes<W>, no: Lanes<W>) -> Lanes<W> {
        Lanes::from_fn(|l| if self.0[l] { yes.0[l] } else { no.0[l] })
    }

    #[inline(always)]
    pub fn select3(self, yes: Lanes3<W>, no: Lanes3<W>) -> Lanes3<W> {
        Lanes3 { x: self.select(yes.x, no.x), y: self.select(yes.y, no.y), z: self.select(yes.z, no.z) }
    }
}

impl<const W: usize> Add for Lanes<W> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const W: usize> Sub for Lanes<W> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const W: usize> Mul for Lanes<W> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const W: usize> Neg for Lanes<W> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

/// `W` vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes3<const W: usize> {
    pub x: Lanes<W>,
    pub y: Lanes<W>,
    pub z: Lanes<W>,
}

impl<const W: usize> Lanes3<W> {
    #[inline(always)]
    pub fn from_fn(value: impl Fn(usize) -> Vector) -> Self {
        Self { x: Lanes::from_fn(|l| value(l).x), y: Lanes::from_fn(|l| value(l).y), z: Lanes::from_fn(|l| value(l).z) }
    }

    #[inline(always)]
    pub fn splat(value: Vector) -> Self {
        Self::from_fn(|_| value)
    }

    #[inline(always)]
    pub fn lane(&self, l: usize) -> Vector {
        Vector::new(self.x.0[l], self.y.0[l], self.z.0[l])
    }

    #[inline(always)]
    pub fn dot(self, o: Self) -> Lanes<W> {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self { x: self.y * o.z - self.z * o.y, y: self.z * o.x - self.x * o.z, z: self.x * o.y - self.y * o.x }
    }
}

impl<const W: usize> Add for Lanes3<W> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl<const W: usize> AddAssign for Lanes3<W> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<const W: usize> Sub for Lanes3<W> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl<const W: usize> Neg for Lanes3<W> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}

impl<const W: usize> Mul<Lanes<W>> for Lanes3<W> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: Lanes<W>) -> Self {
        Self { x: self.x * s, y: self.y * s, z: self.z * s }
    }
}
