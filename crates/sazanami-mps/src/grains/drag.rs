//! Drag of the fluid on grains: what a law is, the list of laws, and their parameters.
//!
//! A law gives the coefficient `kappa` of the drag force `kappa (u - v)` on a sphere, `V B/(1 - eps)` for a drag `B` per
//! bulk volume. The pressure force `-V grad p` is separate and not part of it ("model A"). A new law is a file in this
//! folder and its lines in the list here: the word of the case file and the arm of [`DragParameters::run`].

mod beetstra;
mod blend;
mod di_felice;
mod packed_bed;
mod single_sphere;

use std::f64::consts::PI;

use sazanami_numerics::Real;
use sazanami_numerics::choices;

use beetstra::Beetstra;
use blend::Blend;
use di_felice::DiFelice;

/// A drag law. Loops over grains are compiled for each law: a law has no cost beyond its own formulas.
pub trait DragLaw: Sync {
    /// The law with the parameters of a run.
    fn new(parameters: &DragParameters) -> Self;

    /// Drag coefficient `kappa` [kg/s] of a sphere of diameter `d` \[m] at void fraction `eps` and slip speed `s` [m/s].
    fn coefficient(&self, d: Real, eps: Real, s: Real) -> Real;
}

/// Work that is compiled for each drag law.
pub(crate) trait ForDragLaw {
    /// Result of the work.
    type Output;

    /// Does the work with a law.
    fn run<L: DragLaw>(self, law: &L) -> Self::Output;
}

choices! {
    /// Drag law of the grains.
    #[derive(Default)]
    pub enum DragForm {
        /// A packed bed (Kozeny and Ergun or Forchheimer) where grains are dense, single spheres (Wen & Yu 1966) where they
        /// are sparse, and a linear blend in between.
        #[default]
        Blend = "blend",
        /// One law for all void fractions: the voidage function of Di Felice (1994) with the drag coefficient of Dalla Valle.
        DiFelice = "di_felice",
        /// One law for all void fractions, from simulations of flow through arrays of spheres: Beetstra et al. (2007).
        Beetstra = "beetstra",
    }
}

choices! {
    /// Time level of the fluid velocity in the drag of a step.
    #[derive(Default)]
    pub enum DragIntegration {
        /// That of the start of the step: explicit for the fluid, stable for steps well below the relaxation time.
        #[default]
        Explicit = "explicit",
        /// That of the end of the step, fluid and grains together: stable for any step.
        Implicit = "implicit",
    }
}

/// Quadratic coefficient of flow through a bed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Forchheimer {
    /// `1.75/sqrt(150 eps^3)`: with Kozeny's permeability the equation of Ergun (1952).
    #[default]
    Ergun,
    /// A constant, as 0.55 (Ward 1964).
    Constant(Real),
}

/// The drag law of a run and the parameters of all laws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DragParameters {
    /// Density of the fluid [kg/m^3].
    pub density: Real,
    /// Dynamic viscosity of the fluid [Pa s].
    pub viscosity: Real,
    /// Law in use.
    pub form: DragForm,
    /// Kozeny's constant: 150 in Ergun's equation.
    pub kozeny: Real,
    /// Quadratic coefficient of the packed bed.
    pub forchheimer: Forchheimer,
    /// Solid number densities between which the law is blended from single spheres to a bed; equal: a switch there.
    pub blend: [Real; 2],
}

impl DragParameters {
    /// The recommended law for a fluid of this density [kg/m^3] and dynamic viscosity [Pa s].
    #[must_use]
    pub const fn recommended(density: Real, viscosity: Real) -> Self {
        Self {
            density,
            viscosity,
            form: DragForm::Blend,
            kozeny: 150.0,
            forchheimer: Forchheimer::Ergun,
            blend: [0.38, 0.42],
        }
    }

    /// Does work with the law in use.
    pub(crate) fn run<J: ForDragLaw>(&self, job: J) -> J::Output {
        match self.form {
            DragForm::Blend => job.run(&Blend::new(self)),
            DragForm::DiFelice => job.run(&DiFelice::new(self)),
            DragForm::Beetstra => job.run(&Beetstra::new(self)),
        }
    }

    /// Drag coefficient of one sphere by the law in use, see [`DragLaw::coefficient`] [kg/s].
    #[must_use]
    pub fn coefficient(&self, d: Real, eps: Real, s: Real) -> Real {
        struct One([Real; 3]);
        impl ForDragLaw for One {
            type Output = Real;

            fn run<L: DragLaw>(self, law: &L) -> Real {
                let [d, eps, s] = self.0;
                law.coefficient(d, eps, s)
            }
        }
        self.run(One([d, eps, s]))
    }

    /// Reciprocal of the time in which drag brings a grain of diameter `d` \[m] and mass `mass` \[kg] and the fluid around it to
    /// the same velocity, at void fraction `eps` and slip speed `s` [m/s]: what [`Rates::drag`](crate::stability::Rates)
    /// is the largest of [1/s].
    #[must_use]
    pub fn relaxation_rate(&self, d: Real, mass: Real, eps: Real, s: Real) -> Real {
        relaxation_rate(self.coefficient(d, eps, s), self.density, d, mass, eps)
    }

    /// Solid number density at void fraction `eps`: 1 for touching spheres on a simple cubic lattice, whose volume fraction is
    /// `pi/6`, the convention of moving-particle methods.
    #[must_use]
    pub fn number_density(eps: Real) -> Real {
        (1.0 - eps) / (PI / 6.0)
    }

    /// Share of the packed-bed law at void fraction `eps`.
    #[must_use]
    pub fn bed_share(&self, eps: Real) -> Real {
        let phi = Self::number_density(eps);
        let [low, high] = self.blend;
        if phi >= high {
            1.0
        } else if phi <= low {
            0.0
        } else {
            (phi - low) / (high - low)
        }
    }
}

/// See [`DragParameters::relaxation_rate`], for a drag coefficient [kg/s] and a density of the fluid [kg/m^3].
pub(crate) fn relaxation_rate(coefficient: Real, density: Real, d: Real, mass: Real, eps: Real) -> Real {
    coefficient * (1.0 / mass + yielding(density, d, eps))
}

/// One over the mass of fluid of a density [kg/m^3] between grains of diameter `d` \[m] at void fraction `eps`, for each
/// grain [1/kg].
pub(crate) fn yielding(density: Real, d: Real, eps: Real) -> Real {
    (1.0 - eps) / (eps * density * volume(d))
}

/// Volume of a sphere of diameter `d` [m^3].
#[must_use]
pub fn volume(d: Real) -> Real {
    PI / 6.0 * d * d * d
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The recommended law in water.
    pub(super) fn water() -> DragParameters {
        DragParameters::recommended(1000.0, 1e-3)
    }

    /// Superficial settling velocity [m/s] by `law` of a suspension in water of spheres of sand of diameter `d` \[m] at void
    /// fraction `eps`: drag balances `eps` times the submerged weight.
    pub(super) fn settling(law: &DragParameters, d: Real, eps: Real) -> Real {
        let weight = eps * 1650.0 * volume(d) * 9.81;
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..200 {
            let s = 0.5 * (low + high);
            if law.coefficient(d, eps, s) * s < weight { low = s } else { high = s }
        }
        eps * low
    }

    /// Exponent `n` of the settling velocity `U_t eps^n` of a suspension by `law`, between void fractions 1 and `eps`.
    pub(super) fn richardson_zaki(law: &DragParameters, d: Real, eps: Real) -> Real {
        (settling(law, d, eps) / settling(law, d, 1.0)).ln() / eps.ln()
    }

    #[test]
    fn drag_relaxes_by_stokes_law_in_clear_fluid_and_faster_among_grains() {
        // 18 mu/(sigma d^2).
        let (d, density) = (1e-4, 2650.0);
        let rate = |eps: Real| water().relaxation_rate(d, density * volume(d), eps, 1e-9);
        assert!((rate(1.0) / (18.0 * 1e-3 / (density * d * d)) - 1.0).abs() < 1e-3);
        assert!(rate(0.4) > 10.0 * rate(1.0));
    }

    #[test]
    fn drag_is_finite_without_viscosity_and_without_slip() {
        for form in [DragForm::Blend, DragForm::DiFelice, DragForm::Beetstra] {
            let law = DragParameters { form, ..DragParameters::recommended(1000.0, 0.0) };
            let at = |s: Real| law.coefficient(1e-3, 0.6, s);
            // The force grows with the square of the slip.
            assert!(at(0.0) == 0.0 && (at(0.2) / at(0.1) - 2.0).abs() < 1e-9, "{form:?}: {} {}", at(0.0), at(0.1));
            // Control: viscosity resists the slowest slip.
            assert!(DragParameters { viscosity: 1e-3, ..law }.coefficient(1e-3, 0.6, 0.0) > 0.0, "{form:?}");
        }
    }
}
