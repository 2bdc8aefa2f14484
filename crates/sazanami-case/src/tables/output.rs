//! `[output]`: what is written when.

use std::path::PathBuf;

use sazanami_case_derive::Keys;
use sazanami_mps::grains::Lift;
use sazanami_numerics::Real;
use sazanami_numerics::choice::Choice;
use sazanami_numerics::choices;
use serde_json::json;

use super::{GrainPlacement, Population, Schedule};
use crate::key::{KeyDoc, ValueDoc};
use crate::known::Known;
use crate::presets::Solver;
use crate::read::{At, Context, Table};
use crate::value::{Range1, Value, Word, elements};
use crate::write::{Paths, Written};

choices! {
    /// Precision of written fields.
    #[derive(Default)]
    pub enum FieldPrecision {
        /// Four bytes a number.
        #[default]
        Single = "single",
        /// Eight bytes a number.
        Double = "double",
    }

    /// Frame that positions and velocities are written in.
    #[derive(Default)]
    pub enum OutputFrame {
        /// That of the tank.
        #[default]
        Tank = "tank",
        /// That of the laboratory.
        Laboratory = "laboratory",
    }

    /// Form of the grains for ParaView.
    #[derive(Default)]
    pub enum GrainForm {
        /// A point a grain in `grains.pvd`, for glyphs.
        #[default]
        Points = "points",
        /// The surface of each grain in `grain-meshes.pvd`, about 3 kB a grain.
        Meshes = "meshes",
        /// Both.
        Both = "both",
    }

    /// Colouring of the grains of pictures.
    #[derive(Default)]
    pub enum GrainColour {
        /// Their speed.
        #[default]
        Speed = "speed",
        /// Their height: craters and heaps show their shape.
        Height = "height",
    }

    /// A value of each grain.
    pub enum GrainArray {
        /// Identifier, the same in all files of a run.
        Id = "id",
        /// Number of the population in the case file, from 0.
        Population = "population",
        /// Number of the material in the case file, from 0.
        Material = "material",
        /// Diameter of the sphere of the same volume \[m].
        Diameter = "diameter",
        /// Size factor: the scale of its glyph.
        Scale = "scale",
        /// Mass \[kg].
        Mass = "mass",
        /// Quaternion w, x, y, z that turns its glyph; of points alone.
        Orientation = "orientation",
        /// Velocity of the centre of mass [m/s].
        Velocity = "velocity",
        /// Its magnitude [m/s].
        Speed = "speed",
        /// Spin [rad/s].
        AngularVelocity = "angular_velocity",
        /// Sum of the contact forces in the last sub-step \[N].
        ContactForce = "contact_force",
        /// Sum of their torques [N m].
        ContactTorque = "contact_torque",
        /// x3 of the centre of mass \[m].
        Height = "height",
        /// Time since the last contact \[s]; 1e9 without any.
        TimeSinceContact = "time_since_contact",
        /// Number of grains that it touches.
        TouchedGrains = "touched_grains",
        /// Drag, mean over the last step \[N]; of moving particles.
        Drag = "drag",
        /// Force of the pressure, buoyancy included, mean over the last step \[N]; of moving particles.
        PressureForce = "pressure_force",
        /// Lift, mean over the last step \[N]; with `overlap.lift`.
        Lift = "lift",
        /// Force of the added mass, mean over the last step \[N]; with `overlap.added_mass`.
        AddedMassForce = "added_mass_force",
        /// Void fraction around it; of moving particles.
        VoidFraction = "void_fraction",
        /// Part of it that is wet; of moving particles.
        Wetness = "wetness",
    }
}

impl GrainForm {
    /// Whether points are written.
    #[must_use]
    pub fn has_points(self) -> bool {
        self != Self::Meshes
    }

    /// Whether surfaces are written.
    #[must_use]
    pub fn has_meshes(self) -> bool {
        self != Self::Points
    }
}

impl GrainArray {
    /// Whether the run has it, and what it is known with.
    fn is_of(self, known: &Known) -> (bool, &'static str) {
        let moving = known.solver == Solver::Mps;
        match self {
            Self::Drag | Self::PressureForce | Self::VoidFraction | Self::Wetness => (moving, "`solver = \"mps\"`"),
            Self::Lift => (moving && known.overlap.lift != Lift::None, "`overlap.lift`, for `solver = \"mps\"`"),
            Self::AddedMassForce => {
                (moving && known.overlap.has_added_mass(), "`overlap.added_mass`, for `solver = \"mps\"`")
            }
            _ => (true, ""),
        }
    }
}

/// Values that are written of each grain, in this order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GrainArrays(pub Vec<GrainArray>);

impl GrainArrays {
    /// All that the run has.
    fn of(known: &Known) -> Self {
        Self(GrainArray::ALL.iter().copied().filter(|array| array.is_of(known).0).collect())
    }
}

impl Value for GrainArrays {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf("list of words", |_| {
            let words: Vec<&str> = GrainArray::ALL.iter().map(|array| array.word()).collect();
            json!({ "type": "array", "uniqueItems": true, "items": { "enum": words } })
        })
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        let list = elements(at, key, &format!("words such as {}", Self::example(key)), cx)?;
        let words = list.iter().map(|element| Some(Word::<GrainArray>::read(element, key, range, cx)?.0));
        let words: Vec<GrainArray> = words.collect::<Option<_>>()?;
        let mut once: Vec<GrainArray> = Vec::new();
        for (word, element) in words.into_iter().zip(&list) {
            if once.contains(&word) {
                cx.report
                    .error(element.span.clone(), format!("`{}` has `{word}` twice", key.name))
                    .label("an array is written once")
                    .help("leave it out here");
            } else {
                once.push(word);
            }
        }
        Some(Self(once))
    }

    fn write(&self, _: &str, _: Paths) -> Written {
        let words: Vec<String> = self.0.iter().map(|array| format!("\"{}\"", array.word())).collect();
        Written::Leaf(format!("[{}]", words.join(", ")))
    }

    fn blank() -> Self {
        Self::default()
    }

    fn example(_: &KeyDoc) -> String {
        "[\"id\", \"velocity\"]".into()
    }
}

/// Most grains whose surfaces are written where the case does not say.
const MESHED: usize = 1000;

/// Output and its schedule.
#[derive(Clone, Debug, Default, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Outputs {
    /// Precision of fields.
    #[key(word, default)]
    pub precision: FieldPrecision,
    /// Frame of positions and velocities in `fields`, `grains` and probes, where the tank moves. Series, `bed.csv`,
    /// `water.csv`, `layers.csv` and pictures are always those in the tank; so are the places of `point`, `line`,
    /// `plane` and `gauge` probes, fluxes, and water levels. The displacement is that of `frame.motion`.
    #[key(word, default)]
    pub frame: OutputFrame,
    /// File that the packed bed is written to, in place of `packed.bed` in the folder of results; relative to the case file.
    pub bed: Option<PathBuf>,
    /// Form of the grains: points that glyphs are set on, with a glyph `grains/shape-N.vtp` a population, or the surface
    /// of each grain.
    #[key(word, default = suited_form(&cx.known.grains), says = "`both` up to 1000 grains, else `points`")]
    pub grain_form: GrainForm,
    /// Arrays of each grain, all by default: `id`, `population`, `material`, `diameter` (of equal volume), `scale`,
    /// `mass`, `orientation` (of points), `velocity`, `speed`, `angular_velocity`, `contact_force`, `contact_torque`, `height`,
    /// `time_since_contact`, `touched_grains`; with moving particles also `drag`, `pressure_force`, `void_fraction`, `wetness`,
    /// and `lift` and `added_mass_force` where grains feel them.
    #[key(default = GrainArrays::of(&cx.known), says = "all")]
    pub grain_arrays: GrainArrays,
    /// Fields for ParaView.
    #[key(table, default = Schedule::ends(cx.known.run.until), says = "at the start and at the end")]
    pub fields: Schedule,
    /// Grains for ParaView.
    #[key(table, default = Schedule::ends(cx.known.run.until), says = "at the start and at the end")]
    pub grains: Schedule,
    /// Pictures.
    #[key(table, default = Schedule::ends(cx.known.run.until), says = "at the start and at the end")]
    pub figures: Schedule,
    /// Colouring of the grains of the sections and views of `solver = "mics"`: `speed`, up to a tenth of the fastest liquid's at
    /// the start, or `height`, from half the height of the bed to 1.2 of it.
    #[key(word, default)]
    pub grain_colour: GrainColour,
    /// Rows of series.csv; it has one at the start and one at the end of the case at any rate.
    #[key(table, default = Schedule::each_step(), says = "every step")]
    pub series: Schedule,
}

/// The form in which a number of grains that is known, and small, is easiest to look at.
fn suited_form(grains: &[Population]) -> GrainForm {
    let count: Option<usize> = grains.iter().map(Population::grains).sum();
    if count.is_some_and(|count| count <= MESHED) { GrainForm::Both } else { GrainForm::Points }
}

impl Outputs {
    /// Moves what is put out at the end by default with the end \[s].
    pub fn move_end(&mut self, from: Real, to: Real) {
        [&mut self.fields, &mut self.grains, &mut self.figures].into_iter().for_each(|times| times.move_end(from, to));
    }

    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        for array in &self.grain_arrays.0 {
            let (known, with) = array.is_of(&cx.known);
            if !known {
                cx.report
                    .error(table.place("grain_arrays"), format!("grains in this run have no `{array}`"))
                    .label(format!("it is known with {with}"))
                    .help("leave it out");
            }
        }
        let packs = cx.known.grains.iter().any(|p| matches!(p.placement, GrainPlacement::Packed(_)));
        if self.bed.is_some() && !packs && !cx.known.is_damaged {
            cx.report
                .error(table.place("bed"), "no bed is packed in this run")
                .label("`output.bed` writes the bed that `placement.packed` makes");
        }
    }
}
