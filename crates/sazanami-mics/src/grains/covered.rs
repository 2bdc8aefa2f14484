//! The part of a cell that is a grain's.

use sazanami_numerics::Real;

use super::surface::SOLID;

/// Part of a cell that belongs to a grain covering the `fraction` of it: all of it where the cell moves with its grains.
#[inline]
pub(super) fn part(fraction: Real, alpha: Real) -> Real {
    if alpha >= SOLID { fraction / alpha } else { fraction }
}
