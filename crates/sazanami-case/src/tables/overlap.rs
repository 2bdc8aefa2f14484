//! `[overlap]`: particles of water and the grains they overlap, for `solver = "mps"`.

use sazanami_case_derive::Keys;
use sazanami_mps::grains::{AddedMass, AddedMassForm, DragForm, DragIntegration, DragParameters, Lift};
use sazanami_numerics::Real;

use super::Population;
use crate::read::{Context, Table};

/// Smoothing of the void fraction over the mean diameter, and over the largest.
pub(crate) const SMOOTHING: [Real; 2] = [3.0, 2.5];

/// The recommended drag law; its parameters depend on no fluid.
const DRAG: DragParameters = DragParameters::recommended(0.0, 0.0);

/// Keys of the drag law `blend` alone.
const BLEND_ALONE: [&str; 3] = ["kozeny", "forchheimer", "blend"];

/// Particles and grains, for `solver = "mps"`.
#[derive(Clone, Debug, Default, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Overlap {
    /// Radius over which the void fraction is smoothed, and within which a grain reads the water and gives its drag back: from the
    /// largest diameter (below 2.5 of it with a warning) and 2.1 spacings of the water to the shortest edge between walls or
    /// periodic sides.
    #[key(unit = "m", range = Positive, default = suited_smoothing(&cx.known.grains),
          says = "3 mean diameters, at least 2.5 of the largest")]
    pub smoothing: Real,
    /// Least void fraction; smaller ones are cut, and counted.
    #[key(range = Between(0.05, 1.0), default = 0.3)]
    pub least_void: Real,
    /// Time level of the fluid velocity in the drag of a step; `implicit` for viscous liquids and any length of the step.
    #[key(word, default)]
    pub drag_integration: DragIntegration,
    /// Added mass: the force `C rho V (Du/Dt - dv/dt)` on a grain that moves otherwise than the water, and its reaction.
    #[key(word, default)]
    pub added_mass: AddedMassForm,
    /// Coefficient C of the added mass of a grain alone, 1/2 for a sphere.
    #[key(range = Between(0.0, 10.0), default = AddedMass::NONE.coefficient,
          omit_if = !self.has_added_mass())]
    pub added_mass_coefficient: Real,
    /// Lift of a grain that moves through sheared water, by the laws for a sphere alone far from walls.
    #[key(word, default)]
    pub lift: Lift,
    /// Drag law of the grains.
    #[key(word, default)]
    pub drag: DragForm,
    /// Kozeny's constant k in the permeability `eps^3 d^2/(k (1-eps)^2)`.
    #[key(range = Positive, default = DRAG.kozeny, omit_if = self.drag != DragForm::Blend)]
    pub kozeny: Real,
    /// Constant quadratic coefficient F_ch instead of Ergun's `1.75/sqrt(150 eps^3)`.
    #[key(range = NonNegative, says = "Ergun's", omit_if = self.drag != DragForm::Blend)]
    pub forchheimer: Option<Real>,
    /// Lower and upper solid number density phi between which the drag law goes over from single grains to a bed; phi is 1
    /// for touching spheres on a simple cubic lattice.
    #[key(default = DRAG.blend, omit_if = self.drag != DragForm::Blend, paper_literal = (Tazaki, [0.4, 0.4],
          "Tazaki et al. switch between the drag laws at phi = 0.4"))]
    pub blend: [Real; 2],
}

fn suited_smoothing(grains: &[Population]) -> Real {
    let sizes = |factor: fn(&Population) -> Real| {
        grains.iter().filter_map(move |p| p.shape.size().map(|d| d * factor(p))).collect::<Vec<Real>>()
    };
    let means = sizes(|p| p.sizes().mean());
    let largest = sizes(|p| p.sizes().largest()).into_iter().fold(0.0, Real::max);
    let mean = if means.is_empty() { 0.0 } else { means.iter().sum::<Real>() / means.len() as Real };
    let smoothing = (SMOOTHING[0] * mean).max(SMOOTHING[1] * largest);
    if smoothing > 0.0 { smoothing } else { 1.0 }
}

impl Overlap {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if self.drag != DragForm::Blend {
            for key in BLEND_ALONE.into_iter().filter(|key| table.has(key)) {
                cx.report
                    .warning(Some(table.place(key)), format!("`{key}` has no effect with `drag = \"{}\"`", self.drag))
                    .label("a parameter of `drag = \"blend\"`")
                    .help("leave it out");
            }
        }
        self.check_added_mass(table, cx);
        let [low, high] = self.blend;
        if low.is_finite() && high.is_finite() && !(0.0..=high).contains(&low) {
            cx.report
                .error(table.place("blend"), "`blend` is a lower and an upper solid number density")
                .label(format!("[{low}, {high}]"))
                .help("for example `blend = [0.38, 0.42]`, or `[0.4, 0.4]` for a switch");
        }
    }

    /// Whether grains accelerate water with themselves.
    #[must_use]
    pub fn has_added_mass(&self) -> bool {
        self.added_mass != AddedMassForm::None
    }

    fn check_added_mass(&self, table: &Table<'_>, cx: &mut Context<'_>) {
        if !self.has_added_mass() && table.has("added_mass_coefficient") {
            cx.report
                .warning(Some(table.place("added_mass_coefficient")), "`added_mass_coefficient` has no effect")
                .label("there is no added mass")
                .help("write `added_mass = \"constant\"` beside it, or leave it out");
        }
    }
}
