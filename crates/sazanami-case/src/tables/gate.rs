//! `[[gate]]`: plates that hold water and grains back until they are raised, for `solver = "mps"`.

use sazanami_case_derive::Keys;
use sazanami_mps::gates;
use sazanami_numerics::Real;

use super::grains::numbered;
use crate::read::{Context, Table};

/// A rigid plate without thickness, normal to x1 or x2, over the whole width of the tank, for `solver = "mps"`: it is closed all
/// through the preparation, and rises along x3 from a time on.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Gate {
    /// Name, for messages.
    #[key(default = numbered(table), says = "`gate N`")]
    pub name: String,
    /// Gate normal to x1, its coordinate.
    #[key(unit = "m")]
    pub x1: Option<Real>,
    /// Gate normal to x2, its coordinate.
    #[key(unit = "m")]
    pub x2: Option<Real>,
    /// Lower edge while it is closed.
    #[key(unit = "m", default = cx.known.domain.lower.z, says = "the floor of the box")]
    pub bottom: Real,
    /// Upper edge while it is closed.
    #[key(unit = "m", default = cx.known.domain.upper.z, says = "the top of the box")]
    pub top: Real,
    /// Time of the run at which it begins to rise.
    #[key(unit = "s", range = NonNegative, default = 0.0)]
    pub opens: Real,
    /// Speed at which it rises.
    #[key(unit = "m/s", range = Positive, says = "gone at once")]
    pub speed: Option<Real>,
}

impl Gate {
    /// Direction of its normal, 0 or 1.
    #[must_use]
    pub fn direction(&self) -> usize {
        usize::from(self.x1.is_none())
    }

    /// Coordinate along it \[m].
    #[must_use]
    pub fn place(&self) -> Real {
        self.x1.or(self.x2).unwrap_or(Real::NAN)
    }

    /// The gate as the solver knows it, closed.
    #[must_use]
    pub fn plate(&self) -> gates::Gate {
        gates::Gate::closed(self.direction(), self.place(), [self.bottom, self.top], self.opens, self.speed)
    }

    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if self.x1.is_some() == self.x2.is_some() {
            let given = if self.x1.is_some() { "both `x1` and `x2`" } else { "none" };
            cx.report
                .error(table.span(), format!("`{}` has one of `x1` and `x2`: it is normal to it", self.name))
                .label(format!("this gate has {given}"))
                .help("for example `x1 = \"60 mm\"`");
            return;
        }
        let domain = cx.known.domain;
        let (d, key) = (self.direction(), ["x1", "x2"][self.direction()]);
        if domain.excludes_along(d, [self.place(); 2]) {
            cx.report
                .error(table.place(key), format!("`{}` lies outside the box", self.name))
                .label(domain.reaches())
                .help("move it into the box; where the box begins is `lower` under `[domain]`");
        }
        if self.top <= self.bottom {
            cx.report
                .error(table.place("top"), format!("`{}` has no height", self.name))
                .label("`top` has to lie above `bottom`")
                .help("leave both out: it then reaches from the floor to the top of the box");
        } else if domain.excludes_along(2, [self.bottom, self.top]) {
            let key = if domain.excludes_along(2, [self.bottom; 2]) { "bottom" } else { "top" };
            cx.report
                .error(table.place(key), format!("`{}` reaches out of the box", self.name))
                .label(domain.reaches())
                .help(format!("leave out `{key}`: it then reaches as far as the box"));
        }
        if self.opens >= cx.known.run.until && cx.known.run.until > 0.0 {
            cx.report
                .warning(Some(table.place("opens")), format!("`{}` stays closed to the end of the run", self.name))
                .label("it would open later")
                .help("open it before, or run longer");
        }
    }
}
