//! The fluid outside the open sides of the box, which is at rest.
//!
//! Its pressure on a side is
//!
//! ```text
//! p = p_0 + rho_f g . (x - x_0) + E,   dE/dx_t = (rho - rho_f) g_t
//! ```
//!
//! with the pressure `p_0` and the fluid `f` of the side, the highest corner `x_0` of the box, and the density `rho` in the cells before the
//! side along the directions t in it: what stands there stands outside as well. `E` is summed from the highest edge of the side down, by the
//! mean density of neighbouring cells, as the pressure between cells at rest: a fluid at rest whose density varies along one direction of
//! the grid stays at rest to round-off. Gravity along periodic directions drives the flow and has no part in this.
//!
//! Beside a side that is open to gas, liquid counts where it is joined, within the side, to an edge that holds it up. A jet or a drop that
//! passes through the side has the pressure of the gas around it: outside it falls as it does inside. Along a side across which gravity
//! points more than along it, a top or a floor, nothing stands outside but its fluid.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::Reduction;

use crate::fluids::{FluidName, Fluids};

/// Boundary condition of the pressure on a side of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PressureSide {
    /// The normal velocity is given: a wall, or an inlet.
    Wall,
    /// The pressure is that of a fluid outside, at rest.
    Fixed {
        /// What it has at the highest corner of the box \[Pa].
        pressure: Real,
        /// The fluid.
        fluid: FluidName,
    },
    /// Periodic with the opposite side.
    Periodic,
}

impl PressureSide {
    /// The same side with no pressure outside.
    pub(crate) fn without_pressure(self) -> Self {
        match self {
            Self::Fixed { fluid, .. } => Self::Fixed { pressure: 0.0, fluid },
            other => other,
        }
    }
}

/// The fluid outside all open sides of the box.
#[derive(Default)]
pub(crate) struct Outside {
    /// Gravity, without the periodic directions [m/s^2].
    gravity: Vector,
    /// Density of gas and liquid [kg/m^3].
    densities: [Real; 2],
    /// Fluid outside this rank's faces on each side.
    faces: [[Faces; 2]; 3],
    plane: Plane,
}

/// The fluid outside the faces of a rank on one side of the box, in the order of their places in memory.
#[derive(Default)]
struct Faces {
    pressure: Vec<Real>,
    fraction: Vec<Real>,
}

/// The cells before a side, over all ranks; `across` and then `down` counted from the highest edge of the side.
#[derive(Default)]
struct Plane {
    /// Liquid fraction, 0 where liquid does not count.
    liquid: Vec<Real>,
    excess: Vec<Real>,
    stands: Vec<bool>,
    reached: Vec<usize>,
}

/// How the cells before a side are counted.
struct Layout {
    direction: usize,
    side: usize,
    /// The direction in the side along which gravity is strongest, and the other one.
    down: usize,
    across: usize,
    /// Cells of the box `[across, down]`.
    cells: [usize; 2],
    /// Whether they are counted from the upper side on `[across, down]`.
    reversed: [bool; 2],
}

/// Place of the first face of a row among the faces of a rank on the sides in `direction`.
pub(crate) fn place_on_side(domain: &Domain, direction: usize, [j, k]: [usize; 2]) -> usize {
    let [n1, n2, _] = domain.cells();
    match direction {
        0 => k * n2 + j,
        1 => k * n1,
        _ => j * n1,
    }
}

impl Outside {
    /// Gives the fluid outside a `gravity` [m/s^2].
    pub fn set(&mut self, domain: &Domain, gravity: Vector, fluids: &Fluids) {
        let [x, y, z] = domain.periodic().map(|periodic| if periodic { 0.0 } else { 1.0 });
        self.gravity = gravity * Vector::new(x, y, z);
        self.densities = [fluids.gas_density, fluids.liquid_density];
    }

    /// Pressure on the faces of this rank on a side \[Pa].
    pub fn pressure(&self, direction: usize, side: usize) -> &[Real] {
        &self.faces[direction][side].pressure
    }

    /// Liquid fraction of what stands outside the faces of this rank on a side; empty unless that differs among them.
    pub fn fraction(&self, direction: usize, side: usize) -> &[Real] {
        &self.faces[direction][side].fraction
    }

    /// Follows the liquid fraction `c` of the cells. Collective.
    pub fn update(&mut self, domain: &Domain, sides: &[[PressureSide; 2]; 3], c: &Field<Real>) {
        for (d, side) in (0..3).flat_map(|d| [(d, 0), (d, 1)]) {
            let PressureSide::Fixed { pressure, fluid } = sides[d][side] else { continue };
            let Self { gravity, densities, faces, plane } = self;
            let (gravity, outside) = (*gravity, densities[usize::from(fluid == FluidName::Liquid)]);
            let layout = Layout::of(domain, d, side, gravity);
            // Nothing stands over a top, or below a floor, that is tilted a little.
            let is_level = gravity[layout.down] == 0.0 || gravity[d].abs() > gravity[layout.down].abs();
            if !is_level {
                plane.gather(domain, &layout, c);
                if fluid == FluidName::Gas {
                    plane.keep_what_stands(domain, &layout, gravity, sides);
                }
                plane.sum_up(domain, &layout, gravity, *densities, outside);
            }
            let Faces { pressure: values, fraction } = &mut faces[d][side];
            values.clear();
            fraction.clear();
            let start = domain.start();
            let highest = Vector::select(gravity.cmpgt(Vector::ZERO), domain.grid().lower, domain.grid().upper());
            layout.for_each(domain, |[i, j, k]| {
                let mut x = domain.centre(i, j, k);
                x[d] = if side == 0 { domain.grid().lower[d] } else { domain.grid().upper()[d] };
                let hydrostatic = pressure + outside * gravity.dot(x - highest);
                if is_level {
                    values.push(hydrostatic);
                    return;
                }
                let at = layout.place([i, j, k], start);
                values.push(hydrostatic + plane.excess[at]);
                fraction.push(plane.liquid[at].clamp(0.0, 1.0));
            });
        }
    }
}

impl Layout {
    fn of(domain: &Domain, direction: usize, side: usize, gravity: Vector) -> Self {
        let [a, b] = [[1, 2], [0, 2], [0, 1]][direction];
        let [across, down] = if gravity[a].abs() > gravity[b].abs() { [b, a] } else { [a, b] };
        let cells = [across, down].map(|d| domain.grid().cells[d]);
        Self { direction, side, down, across, cells, reversed: [across, down].map(|d| gravity[d] < 0.0) }
    }

    /// Place in the plane of the cell with these indices on a rank whose cells `start` there.
    fn place(&self, index: [isize; 3], start: [usize; 3]) -> usize {
        let [a, d] = [(0, self.across), (1, self.down)].map(|(n, dir)| {
            let cell = index[dir] as usize + start[dir];
            if self.reversed[n] { self.cells[n] - 1 - cell } else { cell }
        });
        d * self.cells[0] + a
    }

    /// Calls `with` with the local indices of this rank's cells before the side, if it touches it.
    fn for_each(&self, domain: &Domain, mut with: impl FnMut([isize; 3])) {
        if !domain.at_box_end(self.direction, self.side) {
            return;
        }
        let mut range = domain.interior();
        let layer = if self.side == 0 { 0 } else { range[self.direction].end - 1 };
        range[self.direction] = layer..layer + 1;
        for k in range[2].clone() {
            for j in range[1].clone() {
                for i in range[0].clone() {
                    with([i, j, k]);
                }
            }
        }
    }
}

impl Plane {
    /// Takes the liquid fraction `c` of the cells before the side from all ranks.
    fn gather(&mut self, domain: &Domain, layout: &Layout, c: &Field<Real>) {
        let start = domain.start();
        self.liquid.clear();
        self.liquid.resize(layout.cells[0] * layout.cells[1], 0.0);
        layout.for_each(domain, |index| self.liquid[layout.place(index, start)] = c[index]);
        // Each cell has one owner: the sum is its value.
        domain.communicator().all_reduce(&mut self.liquid, Reduction::Sum);
    }

    /// Replaces liquid that nothing holds up by gas.
    fn keep_what_stands(&mut self, domain: &Domain, layout: &Layout, gravity: Vector, sides: &[[PressureSide; 2]; 3]) {
        let [across, down] = layout.cells;
        let held = |d: usize| match sides[d][usize::from(gravity[d] > 0.0)] {
            _ if gravity[d] == 0.0 => false,
            PressureSide::Wall => true,
            PressureSide::Fixed { fluid, .. } => fluid == FluidName::Liquid,
            PressureSide::Periodic => false,
        };
        let [beside, below] = [layout.across, layout.down].map(held);
        let wraps = domain.periodic()[layout.across];
        let Self { liquid, stands, reached, .. } = self;
        let is_liquid = |at: usize| liquid[at] >= 0.5;
        stands.clear();
        stands.resize(across * down, false);
        reached.clear();
        let bottom = (0..across).filter(|_| below).map(|a| (down - 1) * across + a);
        let flank = (0..down).filter(|_| beside).map(|d| d * across + across - 1);
        let mut visit = |at: usize, reached: &mut Vec<usize>| {
            if !stands[at] && is_liquid(at) {
                stands[at] = true;
                reached.push(at);
            }
        };
        bottom.chain(flank).for_each(|at| visit(at, reached));
        while let Some(at) = reached.pop() {
            let (a, d) = (at % across, at / across);
            let left = if a > 0 { Some(at - 1) } else { wraps.then_some(at + across - 1) };
            let right = if a + 1 < across { Some(at + 1) } else { wraps.then_some(at + 1 - across) };
            let vertical = [(d > 0).then(|| at - across), (d + 1 < down).then_some(at + across)];
            [left, right].into_iter().chain(vertical).flatten().for_each(|next| visit(next, reached));
        }
        // Cells of the surface belong to what stands under them.
        for a in 0..across {
            let (mut counts, mut before) = (below, Real::INFINITY);
            for d in (0..down).rev() {
                let at = d * across + a;
                let here = liquid[at];
                counts = stands[at] || (counts && here <= before);
                before = here;
                if !counts {
                    liquid[at] = 0.0;
                }
            }
        }
    }

    /// Sums the pressure up that comes on top of that of the fluid `outside`, a density [kg/m^3].
    fn sum_up(&mut self, domain: &Domain, layout: &Layout, gravity: Vector, [gas, liquid]: [Real; 2], outside: Real) {
        let [across, down] = layout.cells;
        let weight = |d: usize| gravity[d].abs() * domain.grid().spacing[d];
        let [beside, below] = [layout.across, layout.down].map(weight);
        let Self { liquid: fraction, excess, .. } = self;
        let beyond = |at: usize| gas + (liquid - gas) * fraction[at] - outside;
        let mean = |a: usize, b: usize| 0.5 * (beyond(a) + beyond(b));
        excess.clear();
        excess.push(mean(0, 0) * 0.5 * (beside + below));
        for at in 1..across * down {
            let (before, weight) = if at < across { (at - 1, beside) } else { (at - across, below) };
            excess.push(excess[before] + mean(before, at) * weight);
        }
    }
}
