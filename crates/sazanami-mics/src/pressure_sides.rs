//! The pressure at the sides of the box, and its ghosts behind them.

use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

use crate::outside::{Outside, PressureSide, place_on_side};

/// The sides of the box that this rank touches.
pub(crate) struct BoxSides<'a> {
    /// Whether each side is a wall.
    pub wall: [[bool; 2]; 3],
    /// Pressure on the faces of sides of fixed pressure \[Pa].
    pub fixed: [[Option<&'a [Real]>; 2]; 3],
    /// Whether the pressure is fixed nowhere.
    pub singular: bool,
    /// What the pressure beyond the upper side in each periodic direction is higher than within the lower one \[Pa].
    jump: Vector,
    /// Which ends of the box this rank has.
    at_end: [[bool; 2]; 3],
}

impl<'a> BoxSides<'a> {
    /// The sides with a mean `gradient` of the pressure along periodic directions [Pa/m].
    pub fn new(domain: &Domain, sides: &[[PressureSide; 2]; 3], outside: &'a Outside, gradient: Vector) -> Self {
        let touched = |d: usize, side: usize| domain.at_box_end(d, side);
        let each = |d: usize, side: usize| sides[d][side];
        Self {
            wall: [0, 1, 2].map(|d| [0, 1].map(|s| touched(d, s) && each(d, s) == PressureSide::Wall)),
            fixed: [0, 1, 2].map(|d| {
                [0, 1].map(|s| {
                    let is_fixed = matches!(each(d, s), PressureSide::Fixed { .. }) && touched(d, s);
                    is_fixed.then(|| outside.pressure(d, s))
                })
            }),
            singular: !sides.iter().flatten().any(|side| matches!(side, PressureSide::Fixed { .. })),
            jump: gradient * domain.grid().extent(),
            at_end: [0, 1, 2].map(|d| [0, 1].map(|s| touched(d, s))),
        }
    }

    /// The same sides for the change of the pressure by a mean `gradient` alone [Pa/m]: zero where it is fixed.
    pub fn of_change(&self, domain: &Domain, gradient: Vector) -> BoxSides<'static> {
        let Self { wall, singular, at_end, .. } = *self;
        let fixed = self.fixed.map(|pair| pair.map(|side| side.map(|_| &[][..])));
        BoxSides { wall, fixed, singular, jump: gradient * domain.grid().extent(), at_end }
    }

    /// Sets the ghosts behind a side so that the pressure on its face number `n` is `face(n, pressure, density)` of the
    /// cell before it. Along the side it goes `margin` cells beyond the rank's part.
    fn fill_behind(
        domain: &Domain,
        (direction, side): (usize, usize),
        margin: isize,
        pressure: &mut Field<Real>,
        density: &Field<Real>,
        face: impl Fn(usize, Real, Real) -> Real,
    ) {
        let stride = domain.strides()[direction];
        let last = domain.cells()[direction] as isize;
        let (layer, inward) = if side == 0 { (-1, stride) } else { (last, -stride) };
        let mut range = domain.interior().map(|range| range.start - margin..range.end + margin);
        range[direction] = layer..layer + 1;
        let rho = density.data();
        let mut faces = 0..;
        for k in range[2].clone() {
            for j in range[1].clone() {
                for (i, n) in range[0].clone().zip(&mut faces) {
                    let ghost = pressure.at(i, j, k);
                    let cell = (ghost as isize + inward) as usize;
                    let p = pressure.data()[cell];
                    let (rc, rg) = (rho[cell], rho[ghost]);
                    // p_face = (p_c rho_g + p_g rho_c) / (rho_c + rho_g)
                    pressure.data_mut()[ghost] = p + (face(n, p, rc) - p) * ((rc + rg) / rc);
                }
            }
        }
    }

    /// Fills all ghosts for the equation: no gradient at walls.
    pub fn fill_solving(&self, domain: &Domain, pressure: &mut Field<Real>, density: &Field<Real>) {
        domain.fill_halos_to(1, &mut [(&mut *pressure, &GhostRules::EVEN)]);
        self.add_jump(domain, pressure);
        for d in 0..3 {
            for side in 0..2 {
                if let Some(values) = self.fixed[d][side] {
                    let value = |n: usize| values.get(n).copied().unwrap_or_default();
                    Self::fill_behind(domain, (d, side), 0, pressure, density, |n, _, _| value(n));
                }
            }
        }
    }

    /// Adds the jump of the pressure to the ghosts beyond periodic sides.
    fn add_jump(&self, domain: &Domain, pressure: &mut Field<Real>) {
        for (d, side) in (0..3).flat_map(|d| [(d, 0), (d, 1)]) {
            if self.jump[d] == 0.0 || !self.at_end[d][side] || !domain.periodic()[d] {
                continue;
            }
            let (layer, jump) =
                if side == 0 { (-1, -self.jump[d]) } else { (domain.cells()[d] as isize, self.jump[d]) };
            // Beyond the edges too, which have the jumps of both directions.
            let mut range = domain.interior().map(|range| range.start - 1..range.end + 1);
            range[d] = layer..layer + 1;
            domain.for_each_row(&range, pressure.data_mut(), |_, p| p.iter_mut().for_each(|p| *p += jump));
        }
    }

    /// Fills the ghosts behind walls with the pressure of a fluid at rest; returns the force of the
    /// pressure on this rank's sides of the box on the fluid \[N].
    pub fn fill_behind_walls(
        &self,
        domain: &Domain,
        pressure: &mut Field<Real>,
        density: &Field<Real>,
        gravity: Vector,
    ) -> Vector {
        let mut force = Vector::ZERO;
        for d in 0..3 {
            if domain.periodic()[d] && self.at_end[d][0] {
                let faces = domain.cells().into_iter().product::<usize>() / domain.cells()[d];
                force[d] -= self.jump[d] * faces as Real * domain.grid().face_area(d);
            }
            for side in 0..2 {
                let outward = if side == 0 { -1.0 } else { 1.0 };
                let climb = 0.5 * domain.grid().spacing[d] * gravity[d] * outward;
                let at_wall = |p: Real, rho: Real| p + rho * climb;
                let fixed = self.fixed[d][side];
                if self.wall[d][side] {
                    Self::fill_behind(domain, (d, side), 1, pressure, density, |_, p, rho| at_wall(p, rho));
                } else if fixed.is_none() {
                    continue;
                }
                let layer = if side == 0 { 0 } else { domain.cells()[d] as isize - 1 };
                let mut range = domain.interior();
                range[d] = layer..layer + 1;
                let [sum] = domain.sum_rows(&range, |row| match fixed {
                    Some(values) => {
                        [values[place_on_side(domain, d, [row.j, row.k].map(|n| n as usize))..][..row.len].iter().sum()]
                    }
                    None => [row.shifted(0).map(|at| at_wall(pressure.data()[at], density.data()[at])).sum()],
                });
                force[d] -= outward * sum * domain.grid().face_area(d);
            }
        }
        force
    }
}
