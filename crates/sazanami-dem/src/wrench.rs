//! A force with a torque.

use sazanami_numerics::Vector;

/// A force and a torque about the centre of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Wrench {
    /// Force \[N].
    pub force: Vector,
    /// Torque [N m].
    pub torque: Vector,
}

impl std::ops::AddAssign for Wrench {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.torque += other.torque;
    }
}
