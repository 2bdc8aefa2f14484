//! Measurements of a program: values by name, and curves to be shown beside their references.

use std::collections::BTreeMap;

use sazanami_numerics::Real;
use serde::{Deserialize, Serialize};

/// One measured value. Its unit, reference and band are in the `expected.toml` of the case.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Name of the quantity in `expected.toml`.
    pub quantity: String,
    /// Value in the unit given there.
    pub value: Real,
}

impl Measured {
    /// A value by name.
    #[must_use]
    pub fn new(quantity: impl Into<String>, value: Real) -> Self {
        Self { quantity: quantity.into(), value }
    }
}

/// Lines over one pair of axes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Chart {
    /// Text above the axes.
    pub title: String,
    /// Labels of the abscissa and the ordinate, with units.
    pub axes: [String; 2],
    /// Lines and points.
    pub series: Vec<Series>,
    /// Whether both axes are logarithmic; all values are above zero then.
    #[serde(skip)]
    pub logarithmic: bool,
}

/// One line of a chart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Whether it is the reference: points instead of a line.
    pub reference: bool,
    /// Abscissa and ordinate.
    pub points: Vec<[Real; 2]>,
    /// Uncertainty of each ordinate, drawn as a bar to both sides, with a mark at the point; empty: a line alone.
    #[serde(skip)]
    pub bars: Vec<Real>,
}

impl Chart {
    /// Axes without lines.
    #[must_use]
    pub fn new(title: &str, abscissa: &str, ordinate: &str) -> Self {
        Self { title: title.to_owned(), axes: [abscissa, ordinate].map(str::to_owned), ..Self::default() }
    }

    /// Adds what was computed, thinned to about 200 points.
    #[must_use]
    pub fn computed(mut self, name: &str, points: &[[Real; 2]]) -> Self {
        let stride = points.len().div_ceil(200).max(1);
        let points = finite(points.iter().step_by(stride).map(|point| point.map(short)));
        self.series.push(Series { name: name.to_owned(), points, ..Series::default() });
        self
    }

    /// Adds single results with their uncertainties.
    #[must_use]
    pub fn results(mut self, name: &str, points: &[[Real; 2]], bars: &[Real]) -> Self {
        let (points, bars) = (points.to_vec(), bars.to_vec());
        self.series.push(Series { name: name.to_owned(), points, bars, ..Series::default() });
        self
    }

    /// Adds reference data.
    #[must_use]
    pub fn reference(mut self, name: &str, points: &[[Real; 2]]) -> Self {
        let points = finite(points.iter().copied());
        self.series.push(Series { name: name.to_owned(), reference: true, points, ..Series::default() });
        self
    }
}

impl Series {
    /// Ordinates with the ends of their bars.
    pub fn ordinates(&self) -> impl Iterator<Item = Real> {
        let bars = self.bars.iter().copied().chain(std::iter::repeat(0.0));
        self.points.iter().zip(bars).flat_map(|(point, bar)| [point[1] - bar, point[1] + bar])
    }
}

/// The points that can be drawn and kept.
fn finite(points: impl Iterator<Item = [Real; 2]>) -> Vec<[Real; 2]> {
    points.filter(|point| point.iter().all(|value| value.is_finite())).collect()
}

/// Five digits of a value: enough for a picture.
fn short(value: Real) -> Real {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// Measurements of a case, as kept beside its `expected.toml`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outcome {
    /// Values by the names of their quantities.
    pub values: BTreeMap<String, Real>,
    /// Charts of the case's page, with their references.
    #[serde(default)]
    pub curves: Vec<Chart>,
}

impl Outcome {
    /// Values without curves.
    ///
    /// # Errors
    /// If two values share a name.
    pub fn of(measured: Vec<Measured>) -> Result<Self, String> {
        let mut values = BTreeMap::new();
        for Measured { quantity, value } in measured {
            if values.insert(quantity.clone(), value).is_some() {
                return Err(format!("two values are called `{quantity}`"));
            }
        }
        Ok(Self { values, curves: Vec::new() })
    }
}
