//! `[fluid.contact_angle]`: angles at which liquid meets the walls of the box, and grains.

use sazanami_case_derive::Keys;
use sazanami_numerics::Real;

use super::BoundarySide;

/// Contact angles at the walls of the box and at grains, measured in the liquid: less than 90 degrees where it wets. The more special key
/// wins; a wall or a wide grain without one is met at 90 degrees. Needs `fluid.surface_tension`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Keys)]
pub struct ContactAngles {
    /// At all walls that hold the fluid (`no_slip`, `moving`); `slip` walls, which may be planes of symmetry, have to be named.
    #[key(unit = "rad")]
    pub all: Option<Real>,
    /// At both walls normal to x1.
    #[key(unit = "rad")]
    pub x1: Option<Real>,
    /// At both walls normal to x2.
    #[key(unit = "rad")]
    pub x2: Option<Real>,
    /// At bottom and top.
    #[key(unit = "rad")]
    pub x3: Option<Real>,
    /// At the wall of smallest x1.
    #[key(unit = "rad")]
    pub x1_lower: Option<Real>,
    /// At the wall of largest x1.
    #[key(unit = "rad")]
    pub x1_upper: Option<Real>,
    /// At the wall of smallest x2.
    #[key(unit = "rad")]
    pub x2_lower: Option<Real>,
    /// At the wall of largest x2.
    #[key(unit = "rad")]
    pub x2_upper: Option<Real>,
    /// At the bottom.
    #[key(unit = "rad")]
    pub x3_lower: Option<Real>,
    /// At the top.
    #[key(unit = "rad")]
    pub x3_upper: Option<Real>,
    /// At grains that are four cells wide or more; `all` does not mean them. Through narrower ones the interface goes as it comes, or by
    /// `fluid.entry_pressure` where that is given. Only with `coupling.exchange = "surface"`.
    #[key(unit = "rad")]
    pub grains: Option<Real>,
}

impl ContactAngles {
    /// What is given, with the name of its key and the sides that it names (`[direction, 0 lower or 1 upper]`; `all` and `grains` name none).
    pub(crate) fn given(&self) -> impl Iterator<Item = (&'static str, Real, &'static [[usize; 2]])> {
        let list: [(_, _, &[[usize; 2]]); 11] = [
            ("all", self.all, &[]),
            ("x1", self.x1, &[[0, 0], [0, 1]]),
            ("x2", self.x2, &[[1, 0], [1, 1]]),
            ("x3", self.x3, &[[2, 0], [2, 1]]),
            ("x1_lower", self.x1_lower, &[[0, 0]]),
            ("x1_upper", self.x1_upper, &[[0, 1]]),
            ("x2_lower", self.x2_lower, &[[1, 0]]),
            ("x2_upper", self.x2_upper, &[[1, 1]]),
            ("x3_lower", self.x3_lower, &[[2, 0]]),
            ("x3_upper", self.x3_upper, &[[2, 1]]),
            ("grains", self.grains, &[]),
        ];
        list.into_iter().filter_map(|(name, angle, sides)| angle.map(|angle| (name, angle, sides)))
    }

    /// The angle at the wall `side` of `direction` on its lower (0) or upper (1) end \[rad]; `None` where none is given.
    #[must_use]
    pub fn at(&self, direction: usize, upper: usize, side: &BoundarySide) -> Option<Real> {
        let holds = matches!(side, BoundarySide::NoSlip | BoundarySide::Moving { .. });
        // The list goes from the general to the special.
        let names =
            |name: &str, sides: &[[usize; 2]]| if name == "all" { holds } else { sides.contains(&[direction, upper]) };
        self.given().filter(|(name, _, sides)| names(name, sides)).last().map(|(_, angle, _)| angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_more_special_angle_wins_and_planes_of_symmetry_are_named() {
        let angles = ContactAngles { all: Some(1.0), x1: Some(2.0), x1_upper: Some(3.0), ..ContactAngles::default() };
        let at = |d, upper| angles.at(d, upper, &BoundarySide::NoSlip);
        assert_eq!([at(0, 0), at(0, 1), at(2, 0)], [Some(2.0), Some(3.0), Some(1.0)]);
        let slip = |d| angles.at(d, 0, &BoundarySide::Slip);
        assert_eq!([slip(0), slip(2)], [Some(2.0), None]);
    }
}
