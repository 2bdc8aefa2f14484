//! Properties of the fluid and choice of the MPS enhancements.

use sazanami_numerics::Real;
use sazanami_numerics::choices;

use crate::weight::{Calibration, LaplacianForm, Weight, Wendland};

choices! {
    /// Projection of the velocities to zero divergence.
    #[derive(Default)]
    pub enum Projection {
        /// Enhanced MPS: a Laplacian with a source, pressure zero at the particles found at the surface, a corrected gradient.
        #[default]
        Enhanced = "enhanced",
        /// The pressure force is the negative transpose of the divergence: it keeps momentum and never adds kinetic energy;
        /// pressure zero lies beyond the outermost particles by itself (`docs/decisions/0018-scheme-of-moving-particles.md`).
        Conjugate = "conjugate",
    }
}

choices! {
    /// Source of the pressure equation.
    #[derive(Default)]
    pub enum SourceForm {
        /// Rate of change of the number density, from velocities (HS, Khayyer & Gotoh 2009).
        #[default]
        HigherOrder = "higher_order",
        /// The same divided by the first-moment matrix of the neighbours: exact for linear velocities on any arrangement,
        /// at the surface too (Bonet & Lok 1999).
        Corrected = "corrected",
        /// Deviation of the predicted number density from n0, divided by the step (Koshizuka & Oka 1996).
        Classical = "classical",
    }
}

choices! {
    /// Positions of the surface particles that set their reduced pressure, `rho b.x` less a constant.
    #[derive(Default)]
    pub enum SurfacePressure {
        /// The predicted ones, ahead by `dt u`: waves of circular frequency `w` and wave number `k` lose energy as by a
        /// viscosity `w^2 dt/(4 k^2)`.
        #[default]
        Predicted = "predicted",
        /// Those at the start of the step: positions and velocities then swing without loss (symplectic Euler).
        Start = "start",
    }
}

choices! {
    /// Test for particles at the free surface.
    #[derive(Default)]
    pub enum SurfaceForm {
        /// Number density and asymmetry of the neighbours below and above those of the layers of a lattice.
        #[default]
        Density = "density",
        /// Smallest eigenvalue of the first-moment matrix, and an empty cone towards the outside (Marrone et al. 2010).
        Cone = "cone",
    }
}

choices! {
    /// Gradient of the pressure.
    #[derive(Default)]
    pub enum GradientForm {
        /// With the inverse moment matrix: exact for linear fields on any arrangement (GC, Khayyer & Gotoh 2011).
        #[default]
        Corrected = "corrected",
        /// Normalised by the number density: exact on a cubic lattice only.
        Classical = "classical",
    }
}

choices! {
    /// Speed of the shifting, and the particles that it moves.
    #[derive(Default)]
    pub enum ShiftingForm {
        /// Over the flow time scale, away from free surfaces alone; velocities do not change.
        #[default]
        Inside = "inside",
        /// As fast as the flow deforms, beside free surfaces too; away from walls velocities are carried along.
        Strain = "strain",
    }
}

/// Dynamic stabilisation: repulsion between particles that overlap (DS, Tsuruta, Khayyer & Gotoh 2013).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stabilisation {
    /// Distance below which a pair is repelled, over the mean size of its particles.
    pub distance: Real,
    /// Whether the repulsion is multiplied by the weight of the pair.
    pub weighted: bool,
}

impl Default for Stabilisation {
    /// A distance of 0.95: with 0.85 (one minus the Courant number) still water on a disordered arrangement gains
    /// energy (`docs/decisions/0006-moving-particles.md`).
    fn default() -> Self {
        Self { distance: 0.95, weighted: true }
    }
}

/// Least radius of influence of [`Projection::Conjugate`] over the particle spacing: with less still water of a lattice
/// does not stay at rest.
pub const CONJUGATE_RADIUS: Real = 2.6;

/// Radius of influence of [`Projection::Enhanced`] over the particle spacing that its constants were found with.
pub const ENHANCED_RADIUS: Real = 3.1;

/// The enhancements in use and their parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheme {
    /// Projection of the velocities to zero divergence. [`Projection::Conjugate`] uses `weight`, `radius`, `laplacian`
    /// (of the velocity) and `relaxation` alone.
    pub projection: Projection,
    /// Family of the weight function.
    pub weight: Wendland,
    /// Radius of influence r_e over the particle spacing, 2.1 to 3.6.
    pub radius: Real,
    /// Source of the pressure equation (HS).
    pub source: SourceForm,
    /// Positions that set the reduced pressure at the surface.
    pub surface_pressure: SurfacePressure,
    /// Test for particles at the free surface.
    pub surface_test: SurfaceForm,
    /// Laplacian of the pressure and of the velocity (HL).
    pub laplacian: LaplacianForm,
    /// Factor of the error-compensating source (ECS, Khayyer & Gotoh 2011); 0: off.
    pub compensation: Real,
    /// Time over which an error of the number density relaxes, in flow time scales (half a millisecond for slowly
    /// moving water at a spacing of 1 mm); infinite: no relaxation.
    pub relaxation: Real,
    /// Gradient of the pressure (GC).
    pub gradient: GradientForm,
    /// Dynamic stabilisation (DS); `None`: off.
    pub stabilisation: Option<Stabilisation>,
    /// Diffusion number of particle shifting, 0 to 0.5: in one flow time scale particles move by this times
    /// `(r_e/2)^2` down the gradient of their concentration; 0: off.
    pub shifting: Real,
    /// Speed of the shifting, and the particles that it moves.
    pub shifting_form: ShiftingForm,
    /// Whether the hydrostatic part is split off the pressure before solving: exact for still water.
    pub reduced_pressure: bool,
}

impl Default for Scheme {
    fn default() -> Self {
        Self {
            projection: Projection::Enhanced,
            weight: Wendland::C2,
            radius: ENHANCED_RADIUS,
            source: SourceForm::HigherOrder,
            surface_pressure: SurfacePressure::Predicted,
            surface_test: SurfaceForm::Density,
            laplacian: LaplacianForm::HigherOrder,
            compensation: 1.0,
            relaxation: 100.0,
            gradient: GradientForm::Corrected,
            stabilisation: Some(Stabilisation::default()),
            shifting: 0.0,
            shifting_form: ShiftingForm::Inside,
            reduced_pressure: true,
        }
    }
}

impl Scheme {
    /// The conjugate projection with a radius of influence, over the particle spacing.
    #[must_use]
    pub fn conjugate(radius: Real) -> Self {
        Self { projection: Projection::Conjugate, radius, ..Self::default() }
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
            return match self.source {
                SourceForm::HigherOrder | SourceForm::Corrected => predicted,
                SourceForm::Classical => predicted.max(0.0),
            };
        }
        predicted + (self.compensation * (error.abs() * rate + rate.abs() * error) + error / (self.relaxation * time))
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

/// Weight function, enhancements and normalisation of all sums over pairs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kernel {
    pub scheme: Scheme,
    pub weight: Weight,
    pub sums: Calibration,
}

impl Kernel {
    pub fn new(scheme: Scheme, spacing: Real) -> Self {
        let weight = Weight { family: scheme.weight, radius: scheme.radius * spacing };
        Self { scheme, weight, sums: Calibration::new(&weight, scheme.laplacian, spacing) }
    }

    /// Weight and Laplacian with their families fixed at compile time: call it inside the loop over pairs.
    #[inline(always)]
    pub fn pair<const C4: bool, const FORM: u8>(&self) -> (Weight, LaplacianForm) {
        let family = if C4 { Wendland::C4 } else { Wendland::C2 };
        let form = match FORM {
            0 => LaplacianForm::HigherOrder,
            1 => LaplacianForm::Slope,
            _ => LaplacianForm::Classical,
        };
        (Weight { family, radius: self.weight.radius }, form)
    }
}

/// Calls `$function::<C4, FORM>` for the kernel's weight and Laplacian.
macro_rules! for_kernel {
    ($kernel:expr, $function:ident($($argument:expr),* $(,)?)) => {
        match ($kernel.weight.family, $kernel.scheme.laplacian) {
            (Wendland::C2, LaplacianForm::HigherOrder) => $function::<false, 0>($($argument),*),
            (Wendland::C2, LaplacianForm::Slope) => $function::<false, 1>($($argument),*),
            (Wendland::C2, LaplacianForm::Classical) => $function::<false, 2>($($argument),*),
            (Wendland::C4, LaplacianForm::HigherOrder) => $function::<true, 0>($($argument),*),
            (Wendland::C4, LaplacianForm::Slope) => $function::<true, 1>($($argument),*),
            (Wendland::C4, LaplacianForm::Classical) => $function::<true, 2>($($argument),*),
        }
    };
}
pub(crate) use for_kernel;
