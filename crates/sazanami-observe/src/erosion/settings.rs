//! What an evaluation of a crater is asked for.

use sazanami_numerics::Real;
use sazanami_numerics::choices;

use super::profile;
use crate::{Ground, Horizontal};

/// Bandwidth of the smooth profile over the thickness of the paper's layers: 1.7 grain sizes where these are 2.5.
const BANDWIDTH: Real = 2.0 / 3.0;
/// Least bandwidth in pixels: half a grain, and three rings of pixels within the narrowest of the uncertainty.
const LEAST_PIXELS: Real = 4.5;
/// Layers that a profile needs.
const LEAST_LAYERS: Real = 3.2;

choices! {
    /// Grains whose tops are averaged.
    pub enum CountedGrains {
        /// Those seen from above.
        Surface = "surface",
        /// All but those in the air. The result lies about half a bed depth too low; the literal reading of the paper.
        All = "all",
    }
}

/// Smoothing of the bed surface and grains that belong to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErosionSettings {
    /// Impact axis \[m].
    pub axis: Horizontal,
    /// Lower corner of the box \[m].
    pub lower: Horizontal,
    /// Upper corner of the box \[m].
    pub upper: Horizontal,
    /// Whether the box repeats in these directions.
    pub periodic: [bool; 2],
    /// Height of the floor \[m].
    pub floor: Real,
    /// Grain size: short axis \[m].
    pub grain_size: Real,
    /// Width of a smoothing cell, `dx*` \[m].
    pub cell: Real,
    /// Thickness of a layer, `dr` \[m].
    pub layer: Real,
    /// Radius to which layers reach \[m].
    pub largest_radius: Real,
    /// Grains whose tops are averaged in layers.
    pub counted: CountedGrains,
    /// Pixel of the view from above \[m].
    pub pixel: Real,
    /// Pixels at which a grain must be seen to count as surface.
    pub exposed_pixels: u32,
    /// A grain clear of the bed is in the air if its last contact is longer ago than this \[s].
    pub airborne_after: Real,
    /// A grain without contact is in the air if it is faster than this [m/s].
    pub airborne_speed: Real,
    /// A grain has contact if the last one is no longer ago than this \[s]: some sub-steps.
    pub touching_within: Real,
}

impl ErosionSettings {
    /// The recommended evaluation about the middle of the box from `lower` to `upper` \[m] over a floor
    /// at height `floor` \[m], for grains with short axis `grain_size` \[m]: cells and layers of 2.5
    /// grain sizes, or a sixth of the largest radius in a small box, which is 0.45 of the box width.
    #[must_use]
    pub fn recommended(lower: Horizontal, upper: Horizontal, floor: Real, grain_size: Real) -> Self {
        let axis = [0, 1].map(|d| 0.5 * (lower[d] + upper[d]));
        Self {
            axis,
            lower,
            upper,
            periodic: [false; 2],
            floor,
            grain_size,
            cell: 0.0,
            layer: 0.0,
            largest_radius: 0.0,
            counted: CountedGrains::Surface,
            pixel: grain_size / 8.0,
            exposed_pixels: 4,
            airborne_after: 1e-3,
            airborne_speed: 0.05,
            touching_within: 1e-5,
        }
        .reaching(0.45 * (upper[0] - lower[0]).min(upper[1] - lower[1]))
    }

    /// The plan of the box.
    #[must_use]
    pub fn ground(&self) -> Ground {
        Ground { lower: self.lower, upper: self.upper, periodic: self.periodic }
    }

    /// The same with layers out to `largest_radius` \[m], and the cells and layers that go with it.
    #[must_use]
    pub fn reaching(self, largest_radius: Real) -> Self {
        let layer = (2.5 * self.grain_size).min(largest_radius / 6.0);
        Self { cell: layer, layer, largest_radius, ..self }
    }

    /// Width of the weights with which the surface is smoothed along the radius \[m].
    #[must_use]
    pub fn bandwidth(&self) -> Real {
        (BANDWIDTH * self.layer).max(LEAST_PIXELS * self.pixel)
    }

    /// Thickness of the layers of [`super::Erosion::surface`] and of [`super::InitialBed::heights`] \[m].
    #[must_use]
    pub fn surface_layer(&self) -> Real {
        profile::smooth_layer(self.bandwidth())
    }

    /// Checks that the lengths make sense together.
    ///
    /// # Errors
    /// [`ErosionError`] names the length.
    pub fn check(&self) -> Result<(), ErosionError> {
        let lengths = [
            ("grain size", self.grain_size),
            ("smoothing cell", self.cell),
            ("layer thickness", self.layer),
            ("largest radius", self.largest_radius),
            ("pixel", self.pixel),
        ];
        for (name, value) in lengths {
            if !(value > 0.0 && value.is_finite()) {
                return Err(ErosionError::NotALength { name, value });
            }
        }
        if self.layer * LEAST_LAYERS > self.largest_radius {
            return Err(ErosionError::TooFewLayers { layer: self.layer, largest_radius: self.largest_radius });
        }
        Ok(())
    }
}

/// The erosion volume cannot be evaluated as asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ErosionError {
    /// A length is zero, negative or not finite.
    #[error("the {name} of the erosion evaluation is {value} m, not a positive length")]
    NotALength {
        /// Name of the length.
        name: &'static str,
        /// Its value \[m].
        value: Real,
    },
    /// Too few layers lie within the largest radius.
    #[error(
        "layers of {layer} m are too thick for a profile out to {largest_radius} m: it has to be {LEAST_LAYERS} times as far"
    )]
    TooFewLayers {
        /// Layer thickness \[m].
        layer: Real,
        /// Largest radius \[m].
        largest_radius: Real,
    },
    /// There is no crater to speak of without grains at the axis and around it.
    #[error("no surface grains in the innermost layer, or in no other: the bed does not reach the impact axis")]
    NoSurface,
}
