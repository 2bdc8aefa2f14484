//! What a program measured.

use sazanami_numerics::Real;

/// A value before it is judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// What was measured.
    pub quantity: String,
    /// Its unit.
    pub unit: &'static str,
    /// Measured value.
    pub value: Real,
    /// Reference, if there is one.
    pub reference: Option<Real>,
    /// Ends of the band, if there is one; an infinite end is open.
    pub band: Option<[Real; 2]>,
    /// Where the reference comes from.
    pub source: &'static str,
}

impl Measured {
    /// A value that has to lie between `low` and `high`.
    #[must_use]
    pub fn within(quantity: impl Into<String>, unit: &'static str, value: Real, low: Real, high: Real) -> Self {
        Self { quantity: quantity.into(), unit, value, reference: None, band: Some([low, high]), source: "" }
    }

    /// A value that may differ from `reference` by the share `tolerance` of it.
    #[must_use]
    pub fn near(
        quantity: impl Into<String>,
        unit: &'static str,
        value: Real,
        reference: Real,
        tolerance: Real,
    ) -> Self {
        let reach = (reference * tolerance).abs();
        let row = Self::within(quantity, unit, value, reference - reach, reference + reach);
        Self { reference: Some(reference), ..row }
    }

    /// A value without a band.
    #[must_use]
    pub fn info(quantity: impl Into<String>, unit: &'static str, value: Real) -> Self {
        Self { quantity: quantity.into(), unit, value, reference: None, band: None, source: "" }
    }

    /// Names the source of the reference.
    #[must_use]
    pub fn from_source(self, source: &'static str) -> Self {
        Self { source, ..self }
    }
}
