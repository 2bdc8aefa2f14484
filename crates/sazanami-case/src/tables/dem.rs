//! `[dem]`: how grains are moved.

use sazanami_case_derive::Keys;
use sazanami_dem::{Substeps, TangentialForce};
use sazanami_numerics::{Real, choices};
use serde_json::json;
use toml::de::DeValue;

use super::{BoundarySide, SIDE_NAMES};
use crate::key::{KeyDoc, ValueDoc};
use crate::read::{At, Context};
use crate::value::{Range1, Value};
use crate::write::{Paths, Written};

/// Outer cut-off of the lubrication force: beyond it the drag law has what the liquid does.
pub(crate) const FILM_REACH: Real = 0.1;

choices! {
    /// Contact of grains with the walls of the box.
    #[derive(Default)]
    pub enum WallContact {
        /// As that between grains.
        #[default]
        AsGrains = "as_grains",
        /// Without friction on the vertical sides.
        FrictionlessSides = "frictionless_sides",
    }
}

/// Liquid bridges: each forms where two moist grains touch, pulls them together, and breaks at a gap of (1 + contact_angle/2) times the cube
/// root of its volume. Grains touch where contact spheres overlap: of those placed with no gap between them rounding decides. Walls are
/// dry. On the grid they pull as far as there is no liquid about their grains.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
pub struct Bridges {
    /// Surface tension of the liquid: `"72.8 mN/m"` for water.
    #[key(unit = "N/m", quantity = "a surface tension", range = Positive)]
    pub surface_tension: Real,
    /// Volume of liquid over that of the grains, with six bridges a grain.
    #[key(range = Between(1e-4, 0.07), default = 0.01)]
    pub liquid_content: Real,
    /// Contact angle of the liquid on the grains, up to 50 degrees.
    #[key(unit = "rad", range = NonNegative, default = 0.0)]
    pub contact_angle: Real,
    /// Whether grains are damp when the run begins; if not, those are that the liquid of the case has been about. They stay so. A case with a
    /// body of liquid has to say it.
    #[key(says = "`true`")]
    pub damp: Option<bool>,
}

/// Softer springs from a time on, with the restitution and the friction that contacts have: where grains move slowly, sub-steps longer by
/// the root of what is left of the stiffness do.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
pub struct Softening {
    /// Time from which springs are softer.
    #[key(unit = "s", range = NonNegative)]
    pub from: Real,
    /// Part that is left of the stiffness of every contact.
    #[key(range = Between(1e-3, 0.999))]
    pub stiffness: Real,
    /// Overlap of two contact spheres over the smaller radius that ends the run from then on; looked for in each sub-step.
    #[key(range = Between(1e-4, 0.5), default = 0.1)]
    pub largest_overlap: Real,
}

/// Motion and contact of the grains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Keys)]
pub struct DemOptions {
    /// Contact sub-steps in a step of the fluid: `auto`, as many as the contacts need (as `allowed_error` or `tangential_force` says, of
    /// pi sqrt(m*/K); m* is the least effective mass a contact can meet), or a number.
    #[key(default, paper_literal = (Yagyu, Substeps::Fixed(325),
          "the paper's number of sub-steps in a fluid step"))]
    pub substeps: Substeps,
    /// Mean error of an oblique impact of the lightest grains that the length of `auto` sub-steps may bring: of the coefficient of
    /// restitution, and of the spin over the tangential speed. Sub-steps are as long as it and the stability of damped contacts let them be,
    /// up to 0.225 pi sqrt(m*/K); `check` says the errors.
    #[key(range = Between(1e-6, 0.5), says = "sub-steps as `tangential_force` says")]
    pub allowed_error: Option<Real>,
    /// Whether separating contacts may pull.
    #[key(omit_if = true, default = false, paper_literal = (Yagyu, true, "eq. (4) without a cut: a separating contact may pull"))]
    pub tension: bool,
    /// How the tangential force of a contact comes about, and the length of `auto` sub-steps.
    #[key(word, default, paper_literal = (Yagyu, TangentialForce::Published,
          "eqs. (5) and (6): the spring grows by whole sub-steps, friction along the sliding velocity"))]
    pub tangential_force: TangentialForce,
    /// Largest torque against rolling and spinning of grains with one contact sphere, on walls and on any grain, over normal force and
    /// effective radius; 0: none. Up to it a spring holds a ball in place, also on a slope whose tangent is smaller. Grains of several contact
    /// spheres resist by their shape, and feel of it only what balls that touch them do.
    #[key(range = NonNegative, default = 0.0)]
    pub rolling_friction: Real,
    /// Roughness of the grains, down to which the film between spheres that do not touch resists their approach: a length, `none` for
    /// no film, or `auto`. `auto` is 0.3 um (1e-4 to 1e-2 of the smallest radius) on the grid where there is liquid and all grains
    /// are spheres of one contact sphere, else no film. Beads of glass, steel and plastic have some 0.02 to 1 um (Joseph et al. 2001). On
    /// the grid a film is as viscous as the fluid about its grains, with moving particles as the water everywhere.
    #[key(unit = "m", range = Positive, default, paper_literal = (Yagyu, FilmRoughness::None, "contacts without a film"))]
    pub film_roughness: FilmRoughness,
    /// Largest gap of the film over the radius of the smaller sphere; on a grid up to half a cell, from which on the cells have it.
    #[key(range = Between(1e-3, 1.0), default = FILM_REACH, omit_if = self.film_roughness == FilmRoughness::None)]
    pub film_reach: Real,
    /// Liquid bridges between moist grains; with `solver = "mps"` only in a case without water. Packed beds get them when the run begins,
    /// where they are damp.
    #[key(table)]
    pub bridges: Option<Bridges>,
    /// Softer springs from a time on. Not for packing, which has its own.
    #[key(table)]
    pub soften: Option<Softening>,
    /// Contact with the vertical sides of the box where no `"a/wall"` says otherwise.
    #[key(word, default)]
    pub wall: WallContact,
    /// Sides of the box that hold grains back, `[direction][0 lower, 1 upper]`.
    ///
    /// In a case a list such as `["x1_lower", "x3_lower"]`.
    #[key(default = cx.known.boundary.map(|pair| pair.map(|side: BoundarySide| side.is_wall())),
          says = "sides that are walls for the fluid")]
    pub grain_walls: [[bool; 2]; 3],
}

/// Height of the roughness at which films between grains end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FilmRoughness {
    /// A part of the smallest radius where there are films ([`crate::Case::film_roughness`]).
    #[default]
    Auto,
    /// No film.
    None,
    /// A height \[m].
    Height(Real),
}

impl Value for FilmRoughness {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf(
            "length, `auto` or `none`",
            |_| json!({ "type": "string", "pattern": "^(auto|none|\\s*[-+]?[0-9.].*)$" }),
        )
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        match at.value {
            Some(DeValue::String(word)) if word == "auto" => Some(Self::Auto),
            Some(DeValue::String(word)) if word == "none" => Some(Self::None),
            _ => Real::read(at, key, range, cx).map(Self::Height),
        }
    }

    fn write(&self, unit: &str, style: Paths) -> Written {
        match self {
            Self::Auto => Written::Leaf("\"auto\"".into()),
            Self::None => Written::Leaf("\"none\"".into()),
            Self::Height(height) => height.write(unit, style),
        }
    }

    fn blank() -> Self {
        Self::Auto
    }

    fn wrong() -> Option<Self> {
        Some(Self::None)
    }

    fn example(key: &KeyDoc) -> String {
        Real::example(key)
    }
}

impl Value for Substeps {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf(
            "`auto` or count",
            |_| json!({ "oneOf": [{ "const": "auto" }, { "type": "integer", "minimum": 1 }] }),
        )
    }

    fn read(at: &At<'_>, key: &KeyDoc, _: Range1, cx: &mut Context<'_>) -> Option<Self> {
        match (at.value, at.integer()) {
            (Some(DeValue::String(word)), _) if word == "auto" => return Some(Self::Auto),
            (_, Some(n)) if n > 0 => return Some(Self::Fixed(n as usize)),
            _ => {}
        }
        cx.report
            .error(at.span.clone(), format!("`{}` cannot be read", key.name))
            .label("expected \"auto\" or a whole number above zero")
            .help("\"auto\" takes as many as the contacts need");
        None
    }

    fn write(&self, _: &str, _: Paths) -> Written {
        Written::Leaf(match self {
            Self::Auto => "\"auto\"".into(),
            Self::Fixed(count) => count.to_string(),
        })
    }

    fn blank() -> Self {
        Self::Auto
    }

    fn example(_: &KeyDoc) -> String {
        "\"auto\"".into()
    }
}

/// Sides of the box by their names.
impl Value for [[bool; 2]; 3] {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf(
            "list of sides",
            |_| json!({ "type": "array", "items": { "enum": SIDE_NAMES.iter().flatten().collect::<Vec<_>>() } }),
        )
    }

    fn read(at: &At<'_>, key: &KeyDoc, _: Range1, cx: &mut Context<'_>) -> Option<Self> {
        let mut walls = [[false; 2]; 3];
        let Some(list) = at.elements() else {
            cx.report.error(at.span.clone(), format!("`{}` is not a list", key.name)).label("expected names of sides");
            return None;
        };
        for element in list {
            let word = match element.value {
                Some(DeValue::String(word)) => word.as_ref(),
                _ => "",
            };
            let found = (0..3).flat_map(|d| [(d, 0), (d, 1)]).find(|&(d, upper)| SIDE_NAMES[d][upper] == word);
            match found {
                Some((d, upper)) if cx.known.boundary[d][upper] == BoundarySide::Periodic => {
                    cx.report
                        .error(element.span.clone(), format!("`{word}` is periodic"))
                        .label("a periodic side holds nothing back");
                }
                Some((d, upper)) => walls[d][upper] = true,
                None => {
                    let known: Vec<&str> = SIDE_NAMES.iter().flatten().copied().collect();
                    cx.report
                        .error(element.span.clone(), "this is no side of the box")
                        .label(format!("expected one of {}", known.join(", ")));
                }
            }
        }
        Some(walls)
    }

    fn write(&self, _: &str, _: Paths) -> Written {
        let names = SIDE_NAMES.iter().flatten().zip(self.iter().flatten());
        let walls: Vec<String> = names.filter(|(_, wall)| **wall).map(|(name, _)| format!("\"{name}\"")).collect();
        Written::Leaf(format!("[{}]", walls.join(", ")))
    }

    fn blank() -> Self {
        [[false; 2]; 3]
    }

    fn example(_: &KeyDoc) -> String {
        "[\"x3_lower\"]".into()
    }
}
