//! Velocities of the grains in the cells that they cover.

use sazanami_dem::{Grains, Motion};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::GHOSTS;
use sazanami_numerics::{Real, Vector};

use super::{GROUP, Group, Share, two};

/// Rigid velocities of the grains in the cells that they cover.
#[derive(Clone, Copy)]
pub(super) struct Rigid<'a> {
    pub domain: &'a Domain,
    pub grains: &'a Grains,
    pub groups: &'a [Group],
    /// Velocity [m/s] and angular velocity [rad/s] of every entry of the engine.
    pub motion: &'a [[Real; 6]],
}

impl Rigid<'_> {
    /// The velocity of grain `n` in a cell, times its share of it [m/s].
    ///
    /// Of a grain that moves by what acts on it that of the covered part's centroid, so that the mean over its cells is its own. Of one whose
    /// motion is prescribed that of the cell's centre: the components normal to the faces of a cell are then those of one rotation, which
    /// takes as much out of a cell as into it. That of centroids does not, and the pressure within the body would grow in every step, since
    /// nothing yields to it.
    #[inline]
    pub fn share(&self, n: usize, share: &Share) -> Vector {
        let [velocity, spin] = two(&self.motion[n]);
        let arm = match self.grains.motion[n] {
            Motion::Prescribed => self.centre(share.at as usize) - self.groups[n / GROUP].poses[n % GROUP].position,
            _ => share.arm(),
        };
        share.fraction * (velocity + spin.cross(arm))
    }

    /// Centre of the cell at this place of a field \[m].
    fn centre(&self, at: usize) -> Vector {
        let [_, row, plane] = self.domain.strides().map(|stride| stride as usize);
        let [i, j, k] = [at % row, at % plane / row, at / plane].map(|n| n as isize - GHOSTS as isize);
        self.domain.centre(i, j, k)
    }
}
