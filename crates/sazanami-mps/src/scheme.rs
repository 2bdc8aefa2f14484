//! Properties of the fluid and choice of the scheme.

use sazanami_numerics::Real;
use sazanami_numerics::choices;

use crate::weight::{Calibration, Weight};

choices! {
    /// Projection of the velocities to zero divergence.
    #[derive(Default)]
    pub enum ParticleProjection {
        /// The pressure force is the negative transpose of the divergence: it keeps momentum and never adds kinetic energy. No
        /// pressure is prescribed at a surface; it is zero beyond the outermost particles
        /// (`docs/decisions/0018-scheme-of-moving-particles.md`).
        #[default]
        Conjugate = "conjugate",
        /// The published MPS-HS-HL-ECS-GC-DS, with `preset = "paper_literal"` alone: a Laplacian with a source, pressure zero at the
        /// particles found at the surface, a corrected gradient, dynamic stabilisation.
        Enhanced = "enhanced",
    }
}

choices! {
    /// Turbulence that particles do not resolve.
    #[derive(Default)]
    pub enum Turbulence {
        /// None: the flow is laminar, or as turbulent as the particles make it.
        #[default]
        None = "none",
        /// An eddy viscosity by Prandtl's mixing length, which grows from walls that hold the water and from the bed (Maurin et al.
        /// 2015): for beds under turbulent flow.
        MixingLength = "mixing_length",
    }
}

/// Distance below which dynamic stabilisation repels a pair (DS, Tsuruta, Khayyer & Gotoh 2013), over the mean size of its
/// particles. With 0.85 (one minus the Courant number) still water on a disordered arrangement gains energy
/// (`docs/decisions/0006-moving-particles.md`).
pub(crate) const STABILISATION_DISTANCE: Real = 0.95;

/// Least radius of influence of [`ParticleProjection::Conjugate`] over the particle spacing: with less still water of a lattice
/// does not stay at rest.
pub const CONJUGATE_RADIUS: Real = 2.6;

/// Radius of influence of [`ParticleProjection::Enhanced`] over the particle spacing that its constants were found with.
pub const ENHANCED_RADIUS: Real = 3.1;

/// The scheme in use and its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheme {
    /// Projection of the velocities to zero divergence.
    pub projection: ParticleProjection,
    /// Radius of influence r_e over the particle spacing, 2.1 to 3.6.
    pub radius: Real,
    /// Time over which an error of the number density relaxes, in flow time scales (half a millisecond for slowly
    /// moving water at a spacing of 1 mm); infinite, no relaxation, in negative controls.
    pub relaxation: Real,
    /// Turbulence that the particles do not resolve, with [`ParticleProjection::Conjugate`].
    pub turbulence: Turbulence,
}

impl Default for Scheme {
    fn default() -> Self {
        Self::conjugate(CONJUGATE_RADIUS)
    }
}

impl Scheme {
    /// The conjugate projection with a radius of influence, over the particle spacing.
    #[must_use]
    pub const fn conjugate(radius: Real) -> Self {
        Self { projection: ParticleProjection::Conjugate, radius, relaxation: 100.0, turbulence: Turbulence::None }
    }

    /// The published MPS-HS-HL-ECS-GC-DS.
    #[must_use]
    pub const fn published() -> Self {
        Self { projection: ParticleProjection::Enhanced, ..Self::conjugate(ENHANCED_RADIUS) }
    }

    /// Source of the pressure equation [1/s]: the `predicted` rate of compression plus the error-compensating terms
    /// (Khayyer & Gotoh 2011), from the rate of compression and the volume strain (`error`) at the start of the step;
    /// `time` is the flow time scale \[s].
    pub(crate) fn compensated(
        &self,
        predicted: Real,
        rate: Real,
        error: Real,
        beside_surface: bool,
        time: Real,
    ) -> Real {
        if beside_surface && error < 0.0 {
            // Next to the free surface a low number density is no error.
            return predicted;
        }
        predicted + (error.abs() * rate + rate.abs() * error + error / (self.relaxation * time))
    }
}

/// Fluid properties and resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    /// Density of the fluid [kg/m^3].
    pub density: Real,
    /// Kinematic viscosity [m^2/s].
    pub viscosity: Real,
    /// Particle spacing l0 \[m].
    pub spacing: Real,
}

/// Weight function, scheme and normalisation of all sums over pairs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kernel {
    pub weight: Weight,
    pub sums: Calibration,
}

impl Kernel {
    pub fn new(scheme: Scheme, spacing: Real) -> Self {
        let weight = Weight { radius: scheme.radius * spacing };
        Self { weight, sums: Calibration::new(&weight, spacing) }
    }
}
