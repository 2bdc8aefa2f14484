//! What the fluid is and which of the enhancements act.

use sazanami_numerics::Real;
use sazanami_numerics::choices;

use crate::weight::{Calibration, LaplacianForm, Weight, Wendland};

choices! {
    /// Source of the pressure equation.
    #[derive(Default)]
    pub enum SourceForm {
        /// Rate of change of the number density from velocities (Khayyer & Gotoh 2009, HS).
        #[default]
        HigherOrder = "higher_order",
        /// Deviation of the number density from that of rest, over the step (Koshizuka & Oka 1996).
        Classical = "classical",
    }
}

choices! {
    /// Gradient of the pressure.
    #[derive(Default)]
    pub enum GradientForm {
        /// Exact for linear fields whatever the neighbours' places (Khayyer & Gotoh 2011, GC).
        #[default]
        Corrected = "corrected",
        /// Exact on a lattice.
        Classical = "classical",
    }
}

/// Forces that keep particles apart (Tsuruta, Khayyer & Gotoh 2013, DS).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stabilisation {
    /// Distance below which it acts, over the mean size of the two particles.
    pub distance: Real,
    /// Whether a pair counts with its weight, or fully.
    pub weighted: bool,
}

impl Default for Stabilisation {
    /// A distance of 0.95: with 0.85 (one less the Courant number) water at rest on a disordered arrangement gains
    /// energy (`docs/decisions/0006-moving-particles.md`).
    fn default() -> Self {
        Self { distance: 0.95, weighted: true }
    }
}

/// Which enhancements act, and how strongly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheme {
    /// Family of the weight function.
    pub weight: Wendland,
    /// Radius of influence r_e over the particle spacing, 2.1 to 3.6.
    pub radius: Real,
    /// HS.
    pub source: SourceForm,
    /// HL.
    pub laplacian: LaplacianForm,
    /// Factor of the error-compensating source (Khayyer & Gotoh 2011, ECS); 0: none.
    pub compensation: Real,
    /// Times of the flow (half a millisecond for spacings of 1 mm and water that moves slowly) over which an error of
    /// the number density relaxes; infinite: does not.
    pub relaxation: Real,
    /// GC.
    pub gradient: GradientForm,
    /// DS.
    pub stabilisation: Option<Stabilisation>,
    /// Part of the square of half the radius of influence by which particles move down the gradient of their
    /// concentration in a time of the flow, 0 to 0.5; 0: shifting is off.
    pub shifting: Real,
    /// Whether the pressure is solved for without its part at rest, which is exact for water at rest.
    pub reduced_pressure: bool,
}

impl Default for Scheme {
    fn default() -> Self {
        Self {
            weight: Wendland::C2,
            radius: 3.1,
            source: SourceForm::HigherOrder,
            laplacian: LaplacianForm::HigherOrder,
            compensation: 1.0,
            relaxation: 100.0,
            gradient: GradientForm::Corrected,
            stabilisation: Some(Stabilisation::default()),
            shifting: 0.0,
            reduced_pressure: true,
        }
    }
}

impl Scheme {
    /// The source of the pressure equation [1/s]: the `predicted` one with what compensates errors (Khayyer & Gotoh 2011),
    /// from rate of compression and strain at the start of the step; `time` is that of the flow [s].
    pub(crate) fn compensated(
        &self,
        predicted: Real,
        rate: Real,
        error: Real,
        beside_surface: bool,
        time: Real,
    ) -> Real {
        if beside_surface && error < 0.0 {
            // Below the surface a number density that is too low is no error.
            return match self.source {
                SourceForm::HigherOrder => predicted,
                SourceForm::Classical => predicted.max(0.0),
            };
        }
        predicted + (self.compensation * (error.abs() * rate + rate.abs() * error) + error / (self.relaxation * time))
    }
}

/// The fluid and its discretisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    /// Density [kg/m^3].
    pub density: Real,
    /// Kinematic viscosity [m^2/s].
    pub viscosity: Real,
    /// Particle spacing l0 [m].
    pub spacing: Real,
}

/// Everything that pairs of particles are summed with.
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

    /// Weight and Laplacian of a pair, chosen when the program is built: to be asked for where pairs are summed.
    #[inline(always)]
    pub fn pair<const C4: bool, const CLASSICAL: bool>(&self) -> (Weight, LaplacianForm) {
        let family = if C4 { Wendland::C4 } else { Wendland::C2 };
        let form = if CLASSICAL { LaplacianForm::Classical } else { LaplacianForm::HigherOrder };
        (Weight { family, radius: self.weight.radius }, form)
    }
}

/// Calls `$function::<C4, CLASSICAL>` as a kernel has it.
macro_rules! for_kernel {
    ($kernel:expr, $function:ident($($argument:expr),* $(,)?)) => {
        match ($kernel.weight.family, $kernel.scheme.laplacian) {
            (Wendland::C2, LaplacianForm::HigherOrder) => $function::<false, false>($($argument),*),
            (Wendland::C2, LaplacianForm::Classical) => $function::<false, true>($($argument),*),
            (Wendland::C4, LaplacianForm::HigherOrder) => $function::<true, false>($($argument),*),
            (Wendland::C4, LaplacianForm::Classical) => $function::<true, true>($($argument),*),
        }
    };
}
pub(crate) use for_kernel;
