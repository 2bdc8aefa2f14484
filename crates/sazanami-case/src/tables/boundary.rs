//! `[boundary]`: the sides of the box.

use std::ops::Range;

use sazanami_case_derive::{Keys, keys_of};
pub use sazanami_mics::boundary::{FluidName, Side as BoundarySide};
use sazanami_numerics::{Real, Vector};

use super::{BoxDomain, read_by};
use crate::read::{Context, Places, Table};

/// Names of the sides of the box, `SIDE_NAMES[direction][0 lower, 1 upper]`.
pub const SIDE_NAMES: [[&str; 2]; 3] = [["x1_lower", "x1_upper"], ["x2_lower", "x2_upper"], ["x3_lower", "x3_upper"]];

/// One side of the box.
#[keys_of(BoundarySide)]
enum BoundarySide {
    /// Wall that holds the fluid.
    NoSlip,
    /// Wall without friction.
    Slip,
    /// Wall that moves in its own plane and holds the fluid.
    Moving {
        /// Velocity of the wall.
        #[key(unit = "m/s")]
        velocity: Vector,
    },
    /// Joined to the opposite side, which has to be periodic too.
    Periodic,
    /// Fluid enters; one side has to be open, unless as much leaves.
    Inflow {
        /// Velocity of the fluid.
        #[key(unit = "m/s")]
        velocity: Vector,
        /// Fluid that enters.
        #[key(word, default = FluidName::Liquid)]
        fluid: FluidName,
    },
    /// Open to gas at rest, whose pressure is zero at the highest corner of the box and that of its weight below. Liquid that stands before the side, held by the
    /// floor, stands outside as well, with its pressure, and comes back in if anything does; above it gas does.
    Outflow,
    /// Open to a fluid at rest, as `outflow`.
    FixedPressure {
        /// Pressure that the fluid outside has at the highest corner of the box.
        #[key(unit = "Pa", default = 0.0)]
        pressure: Real,
        /// Fluid outside, of whose weight the pressure is. Through a side along gravity what stands before it comes back in, gas above the
        /// liquid; through others this fluid.
        #[key(word, default = FluidName::Gas)]
        fluid: FluidName,
    },
}

/// The sides of the box; the more special key wins, and a side that none names is a wall that holds the fluid.
#[derive(Clone, Debug, Keys)]
#[keys(check = Self::check)]
struct BoundaryKeys {
    /// All sides.
    #[key(table)]
    all: Option<BoundarySide>,
    /// Both sides normal to x1.
    #[key(table)]
    x1: Option<BoundarySide>,
    /// Both sides normal to x2.
    #[key(table)]
    x2: Option<BoundarySide>,
    /// Bottom and top.
    #[key(table)]
    x3: Option<BoundarySide>,
    /// Side of smallest x1.
    #[key(table, inline)]
    x1_lower: Option<BoundarySide>,
    /// Side of largest x1.
    #[key(table, inline)]
    x1_upper: Option<BoundarySide>,
    /// Side of smallest x2.
    #[key(table, inline)]
    x2_lower: Option<BoundarySide>,
    /// Side of largest x2.
    #[key(table, inline)]
    x2_upper: Option<BoundarySide>,
    /// Bottom.
    #[key(table, inline)]
    x3_lower: Option<BoundarySide>,
    /// Top.
    #[key(table, inline)]
    x3_upper: Option<BoundarySide>,
}

/// Sides of the box, `[direction][0 lower, 1 upper]`.
pub type Sides = [[BoundarySide; 2]; 3];

read_by!(Sides, BoundaryKeys);

/// Place of a side in the file, if it is written about.
pub(crate) fn place_of_side(places: &Places, direction: usize, upper: usize) -> Option<Range<usize>> {
    let general = format!("boundary.x{}", direction + 1);
    let own = format!("boundary.{}", SIDE_NAMES[direction][upper]);
    [own.as_str(), &general, "boundary.all", "boundary"].into_iter().find_map(|path| places.of(path))
}

impl BoundaryKeys {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        let sides = self.sides();
        for (d, pair) in sides.iter().enumerate() {
            let place = |upper: usize| place_of_side(&cx.places, d, upper).unwrap_or(table.span());
            let spans = [place(0), place(1)];
            for (upper, span) in spans.iter().enumerate() {
                if let BoundarySide::Moving { velocity } = pair[upper]
                    && velocity[d].abs() > 0.0
                {
                    let name = SIDE_NAMES[d][upper];
                    cx.report
                        .error(span.clone(), format!("the wall {name} moves out of its plane"))
                        .label(format!("its velocity along x{} has to be zero", d + 1))
                        .help("use `inflow` for a side that fluid comes through");
                }
            }
            let periodic = pair.map(|side| side == BoundarySide::Periodic);
            if periodic[0] != periodic[1] {
                let single = usize::from(periodic[1]);
                let name = SIDE_NAMES[d][single];
                cx.report
                    .error(spans[single].clone(), format!("the side {name} is periodic, the opposite one is not"))
                    .label("a periodic side is joined to the opposite one")
                    .help(format!("write `x{} = \"periodic\"` for both", d + 1));
            }
        }
        check_net_inflow(&sides, &cx.known.domain.clone(), table.span(), cx);
    }

    fn sides(&self) -> Sides {
        let general = [&self.x1, &self.x2, &self.x3];
        let own =
            [[&self.x1_lower, &self.x1_upper], [&self.x2_lower, &self.x2_upper], [&self.x3_lower, &self.x3_upper]];
        let side = |d: usize, upper: usize| own[d][upper].or(*general[d]).or(self.all).unwrap_or(BoundarySide::NoSlip);
        [0, 1, 2].map(|d| [side(d, 0), side(d, 1)])
    }

    fn meaning(self, _: &mut Context<'_>) -> Option<Sides> {
        Some(self.sides())
    }

    fn of(sides: &Sides) -> Self {
        let [[a, b], [c, d], [e, f]] = sides.map(|pair| pair.map(Some));
        let none = None;
        Self {
            all: none,
            x1: none,
            x2: none,
            x3: none,
            x1_lower: a,
            x1_upper: b,
            x2_lower: c,
            x2_upper: d,
            x3_lower: e,
            x3_upper: f,
        }
    }
}

/// A box without an open side has to get out what comes in.
fn check_net_inflow(sides: &Sides, domain: &BoxDomain, span: Range<usize>, cx: &mut Context<'_>) {
    if sides.iter().flatten().any(BoundarySide::is_open) {
        return;
    }
    let extent = domain.extent();
    let (mut net, mut gross) = (0.0, 0.0);
    for d in 0..3 {
        let area = extent[(d + 1) % 3] * extent[(d + 2) % 3];
        for (upper, side) in sides[d].iter().enumerate() {
            if let BoundarySide::Inflow { velocity, .. } = side {
                let inwards = if upper == 0 { velocity[d] } else { -velocity[d] };
                net += inwards * area;
                gross += (inwards * area).abs();
            }
        }
    }
    if net.abs() > 1e-12 * gross {
        cx.report
            .error(span, "fluid enters a box that it cannot leave")
            .label(format!("{net:.3e} m^3/s in all, and no side is open"))
            .help("make one side `\"outflow\"` or `{ fixed_pressure = {} }`");
    }
}
