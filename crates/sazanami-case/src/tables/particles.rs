//! `[particles]`: water as moving particles, for `solver = "mps"`.

use sazanami_case_derive::Keys;
use sazanami_mps::pressure::Tolerance;
use sazanami_mps::scheme::{
    CONJUGATE_RADIUS, ENHANCED_RADIUS, GradientForm, Projection, Scheme, ShiftingForm, SourceForm, Stabilisation,
    SurfaceForm, SurfacePressure,
};
use sazanami_mps::stability::StepLimits;
use sazanami_mps::weight::{LaplacianForm, Wendland};
use sazanami_numerics::{Real, choices};

use crate::read::{Context, Table};

/// Range of the radius of influence over the particle spacing in which the lattice sums are what they should be.
const RADII: [Real; 2] = [2.1, 3.6];
/// Largest part of (r_e/2)^2 by which particles are shifted: with twice as much vortices gain energy.
const SHIFTING: Real = 0.5;

choices! {
    /// Dynamic stabilisation.
    pub enum StabilisationWeight {
        /// Pairs count with their weight.
        Weighted = "weighted",
        /// Pairs count fully.
        Full = "full",
        /// None.
        Off = "off",
    }
}

/// Water as moving particles, for `solver = "mps"`. Sides may be `no_slip`, `slip` (all walls alike), `periodic` and open
/// (`outflow`, or `fixed_pressure` of gas at 0 Pa). Edges of the box between walls are multiples of the spacing to 2 %,
/// periodic ones are multiples of it.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Particles {
    /// Particle spacing l0. Edges of the box are multiples of it: to 2 % between walls, to rounding where the box is
    /// periodic.
    #[key(unit = "m", range = Positive, example = "1 mm")]
    pub spacing: Real,
    /// Family of the weight function.
    #[key(word, default = Scheme::default().weight)]
    pub weight: Wendland,
    /// Projection of the velocities to zero divergence. `conjugate` has the weight C2 and does without the keys from
    /// `source` on that only `enhanced` has; see docs/decisions/0018-scheme-of-moving-particles.md.
    #[key(word, default = suited_projection(weight, table, cx), says = "`conjugate`; `enhanced` with grains and no gate, C4 or a key that only it has",
          paper_literal = (Tazaki, Projection::Enhanced, "MPS-HS-HL-ECS-GC-DS is theirs"))]
    pub projection: Projection,
    /// Radius of influence r_e over the spacing; 2.6 at least with `conjugate`.
    #[key(range = Between(RADII[0], RADII[1]), default = suited_radius(projection),
          says = "3.1; 2.6 with `conjugate`")]
    pub radius: Real,
    /// Source of the pressure equation.
    #[key(word, omit_if = self.is_conjugate(), default = Scheme::default().source)]
    pub source: SourceForm,
    /// Positions of the surface particles that set their pressure.
    #[key(word, omit_if = self.is_conjugate(), default = Scheme::default().surface_pressure)]
    pub surface_pressure: SurfacePressure,
    /// Test for particles at the free surface.
    #[key(word, omit_if = self.is_conjugate(), default = Scheme::default().surface_test)]
    pub surface_test: SurfaceForm,
    /// Laplacian.
    #[key(word, default = Scheme::default().laplacian)]
    pub laplacian: LaplacianForm,
    /// Factor of the error-compensating source (ECS); 0: none.
    #[key(range = Between(0.0, 10.0), omit_if = self.is_conjugate(), default = Scheme::default().compensation)]
    pub compensation: Real,
    /// Times of the flow over which an error of the number density relaxes; 0: it does not.
    #[key(range = NonNegative, default = Scheme::default().relaxation)]
    pub relaxation: Real,
    /// Gradient of the pressure.
    #[key(word, omit_if = self.is_conjugate(), default = Scheme::default().gradient)]
    pub gradient: GradientForm,
    /// Dynamic stabilisation (DS).
    #[key(word, omit_if = self.is_conjugate(), default = StabilisationWeight::Weighted)]
    pub stabilisation: StabilisationWeight,
    /// Distance below which DS acts, over the particle size.
    #[key(range = Between(0.5, 1.0), omit_if = self.is_conjugate(), default = Stabilisation::default().distance)]
    pub stabilisation_distance: Real,
    /// Part of (r_e/2)^2 by which particles that see no surface move down the gradient of their concentration in a time
    /// of the flow; 0: they do not. For closed and deep flows, see docs/decisions/0008-shifting.md.
    #[key(range = Between(0.0, SHIFTING), omit_if = self.is_conjugate(), default = Scheme::default().shifting)]
    pub shifting: Real,
    /// Speed of the shifting, and the particles that it moves.
    #[key(word, omit_if = self.is_conjugate(), default = Scheme::default().shifting_form)]
    pub shifting_form: ShiftingForm,
    /// Whether the pressure is solved for without its part at rest.
    #[key(omit_if = self.is_conjugate(), default = Scheme::default().reduced_pressure,
          paper_literal = (Tazaki, false, "the usual equations hold the whole pressure"))]
    pub reduced_pressure: bool,
    /// Way of the fastest particle or grain in a step over its size.
    #[key(range = Between(1e-3, 0.5), default = StepLimits::default().courant)]
    pub courant: Real,
    /// Fixed time step; steps longer than what the limits allow are counted as `fixed_beyond_limits` under `limiter` in
    /// summary.json.
    #[key(unit = "s", range = Positive, says = "adaptive")]
    pub dt: Option<Real>,
    /// Longest time step.
    #[key(unit = "s", range = Positive, default = StepLimits::default().longest)]
    pub dt_max: Real,
    /// Largest residual of the pressure equation, as a volume strain in a step.
    #[key(range = Between(1e-15, 1e-2), default = Tolerance::default().strain)]
    pub tolerance: Real,
    /// Most iterations of the pressure solver.
    #[key(least = 1, default = Tolerance::default().most_iterations)]
    pub pressure_iterations: usize,
}

/// Keys of the enhanced scheme alone.
const ENHANCED_ALONE: [&str; 10] = [
    "source",
    "surface_pressure",
    "surface_test",
    "compensation",
    "gradient",
    "stabilisation",
    "stabilisation_distance",
    "shifting",
    "shifting_form",
    "reduced_pressure",
];

/// The better one where it can be used and no key asks for the other.
fn suited_projection(weight: Wendland, table: &Table<'_>, cx: &Context<'_>) -> Projection {
    let asked = ENHANCED_ALONE.iter().any(|key| table.has(key));
    let suits = cx.known.grains.is_empty() || !cx.known.gates.is_empty();
    if suits && weight == Wendland::C2 && !asked { Projection::Conjugate } else { Projection::Enhanced }
}

fn suited_radius(projection: Projection) -> Real {
    match projection {
        Projection::Enhanced => ENHANCED_RADIUS,
        Projection::Conjugate => CONJUGATE_RADIUS,
    }
}

impl Particles {
    fn is_conjugate(&self) -> bool {
        self.projection == Projection::Conjugate
    }

    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        for key in ENHANCED_ALONE.into_iter().filter(|key| self.is_conjugate() && table.has(key)) {
            cx.report
                .warning(Some(table.place(key)), format!("`{key}` has no effect with `projection = \"conjugate\"`"))
                .label("a key of `projection = \"enhanced\"`")
                .help("leave it out");
        }
    }
}
