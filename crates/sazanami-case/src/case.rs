//! The top of a case file, and what the rest of the program asks of a case.

use std::path::Path;

use sazanami_case_derive::Keys;
use sazanami_dem::LinearSpringDashpot;
use sazanami_io::MeasuredProfile;
use sazanami_io::readings::ReadingsError;
use sazanami_mics::boundary::FluidName;
use sazanami_mics::surface_tension::WIDE;
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_mps::boundary::{Side, Tank, WallFriction};
use sazanami_numerics::mean_flow::{ActsBy, MeanFlowSettings};
use sazanami_numerics::{Real, Vector};
use sazanami_observe::Ground;
use serde_json::json;

use crate::key::{KeyDoc, Keys as _, TableDoc, ValueDoc};
use crate::presets::{Preset, Solver};
use crate::read::{At, Context, ORDER, Table, cannot_be_shown};
use crate::tables::{
    Bed, BoundarySide, BoxDomain, Checkpoints, Contacts, Coupling, DemOptions, Drive, Erosion, FilmRoughness,
    FluidOptions, Follows, Frame, Gate, GrainPlacement, HeapObserved, LONGEST_STEP, LiquidRegion, Material, Materials,
    OutputFrame, Outputs, Overlap, Particles, Population, Preparation, Probe, Region, Ripples, RunLength, Sides,
    WallMotion, check_names,
};
use crate::value::{Range1, Value};
use crate::write::{Paths, Written};
use crate::{cross_checks, moving_particles};

/// Longest name of a case \[bytes]: file systems take 255, and a run puts its number behind it.
const LONGEST_NAME: usize = 200;
/// Largest gap of a film in cells: at wider ones the cells have the lubrication.
const FILM_CELLS: Real = 0.5;

/// By how much of a period one may miss a whole part of a longer one.
const WHOLE: Real = 1e-6;

/// Roughness of grains that say nothing \[m]: beads of glass, steel and plastic of Joseph et al. (2001), J. Fluid Mech. 433, 329, have
/// some 0.02 to 1 um.
const ROUGHNESS: Real = 0.3e-6;
/// The smallest over the radius, that of polished beads.
const SMOOTHEST: Real = 1e-4;
/// The largest over the radius: Smart & Leighton (1989), Phys. Fluids A 1, 52, found 1e-3 to 1e-2 on spheres of 50 um.
const ROUGHEST: Real = 1e-2;

// Fields stand in the order in which they are read: what a default depends on comes before.
/// A sazanami case: grains under moving water. Every number with a dimension is a text with its unit.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Case {
    /// Name of the folder of results, `runs/<name>-<n>`.
    #[key(default = cx.known.file_name.clone(), says = "the file's name")]
    pub name: String,
    /// One line for people; stands in pictures.
    #[key(default = String::new(), says = "empty")]
    pub title: String,
    /// Set of defaults; any key of the case stands above it.
    #[key(word, shared, default = Preset::Recommended)]
    pub preset: Preset,
    /// Solver of the water. Tables of the other solver are left alone, so that one case can be run with both.
    #[key(word, shared, default = Solver::Mics)]
    pub solver: Solver,
    /// Gravity: a vector, or a magnitude that points down x3.
    #[key(unit = "m/s^2", via = Gravity, shared, default = Vector::new(0.0, 0.0, -9.8), says = "9.8 m/s^2")]
    pub gravity: Vector,
    /// The box and its cells.
    #[key(table, shared, default = absent::<BoxDomain>(table, "domain",
          "`[domain]` with `size = [\"33.8 mm\", \"33.8 mm\", \"25 mm\"]` and `cells = [88, 92, 66]`", cx),
          says = "required")]
    pub domain: BoxDomain,
    /// The sides of the box, `boundary[direction][0 lower, 1 upper]`.
    #[key(table, from_nothing, shared)]
    pub boundary: Sides,
    /// Length of the run.
    #[key(table, shared, default = absent::<RunLength>(table, "run", "`[run]` with `until = \"0.02 s\"`", cx),
          says = "required")]
    pub run: RunLength,
    /// Motion of the box.
    #[key(table, shared)]
    pub frame: Option<Frame>,
    /// What drives the flow through periodic sides.
    #[key(table)]
    pub drive: Option<Drive>,
    /// Liquid, gas and how they are computed.
    #[key(table, from_nothing)]
    pub fluid: FluidOptions,
    /// Motion and contact of the grains.
    #[key(table, from_nothing, shared)]
    pub dem: DemOptions,
    /// Coupling of fluid and resolved grains.
    #[key(table, from_nothing)]
    pub coupling: Coupling,
    /// Materials of the grains, by names of your choice: `[material.NAME]`.
    #[key(table, named, from_nothing, shared, name = "material")]
    pub materials: Materials,
    /// Contact of pairs of materials, `[contact."A/B"]`; `"A/wall"` is the box (what it does not give is as in `"A/A"`),
    /// `default` what a pair does not give itself.
    #[key(table, named, from_nothing, name = "contact")]
    pub contacts: Contacts,
    /// Populations of grains.
    #[key(tables, shared)]
    pub grains: Vec<Population>,
    /// Plates that hold water and grains back until they are raised, for `solver = "mps"`.
    #[key(tables, shared, name = "gate")]
    pub gates: Vec<Gate>,
    /// Water as moving particles, for `solver = "mps"`.
    #[key(table)]
    pub particles: Option<Particles>,
    /// Coupling of grains and the particles of water that overlap them, for `solver = "mps"`.
    #[key(table, from_nothing, shared, omit_if = self.particles.is_none() || self.grains.is_empty())]
    pub overlap: Overlap,
    /// Preparation of a bed in water before the run begins, for `solver = "mps"`.
    #[key(table, from_nothing, omit_if = self.particles.is_none())]
    pub preparation: Preparation,
    /// Measures of the bed.
    #[key(table, from_nothing, shared)]
    pub bed: Bed,
    /// Liquids (or bubbles) at the start; the rest is gas.
    #[key(tables, shared, name = "liquid")]
    pub liquids: Vec<LiquidRegion>,
    /// Observation of the slope of a heap, if it is wanted.
    #[key(table)]
    pub heap: Option<HeapObserved>,
    /// Observation of the crater, if it is wanted.
    #[key(table)]
    pub erosion: Option<Erosion>,
    /// Observation of ripples, if it is wanted.
    #[key(table)]
    pub ripples: Option<Ripples>,
    /// Output and its schedule.
    #[key(table, from_nothing, shared)]
    pub output: Outputs,
    /// Places to watch.
    #[key(tables, name = "probe")]
    pub probes: Vec<Probe>,
    /// Checkpoints.
    #[key(table, from_nothing)]
    pub checkpoint: Checkpoints,
}

/// The declaration of a case, its tables in that order.
pub(crate) fn docs_in_order() -> TableDoc {
    let mut docs = Case::docs();
    docs.keys.sort_by_key(|key| ORDER.iter().position(|name| *name == key.name));
    docs
}

/// Substitute for a table that has to be there and is not.
fn absent<T: Default>(table: &Table<'_>, name: &str, what: &str, cx: &mut Context<'_>) -> T {
    if !table.has(name) {
        cx.missing(None, name, &format!("add {what}"));
    }
    T::default()
}

/// Gravity as written: a vector, or a magnitude.
pub struct Gravity(Vector);

impl Value for Gravity {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf("one value or vector", |key| {
            let ValueDoc::Leaf(_, one) = Real::doc() else { return json!({}) };
            let ValueDoc::Leaf(_, three) = Vector::doc() else { return json!({}) };
            json!({ "oneOf": [one(key), three(key)] })
        })
    }

    fn read(at: &At<'_>, key: &KeyDoc, range: Range1, cx: &mut Context<'_>) -> Option<Self> {
        if at.elements().is_some() {
            return Vector::read(at, key, range, cx).map(Self);
        }
        let magnitude = Real::read(at, key, range, cx)?;
        if magnitude < 0.0 {
            cx.report
                .error(at.span.clone(), "a magnitude of gravity must not be negative")
                .label("a single value points down x3 by itself")
                .help("leave out the minus sign, or give three components");
        }
        Some(Self(Vector::new(0.0, 0.0, if magnitude == 0.0 { 0.0 } else { -magnitude })))
    }

    fn write(&self, unit: &str, style: Paths) -> Written {
        self.0.write(unit, style)
    }

    fn blank() -> Self {
        Self(Vector::NAN)
    }

    fn wrong() -> Option<Self> {
        Some(Self::blank())
    }

    fn example(key: &KeyDoc) -> String {
        Real::example(key)
    }
}

impl Case {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        let is_special = |c: char| c == '/' || c == '\\' || c.is_control();
        if self.name.trim() != self.name
            || ["", ".", ".."].contains(&self.name.as_str())
            || self.name.contains(is_special)
            || self.name.len() > LONGEST_NAME
        {
            cx.report
                .error(table.place("name"), "`name` cannot be the name of a folder")
                .label("the folder of results has this name")
                .help(format!(
                    "take a word of {LONGEST_NAME} bytes at most, without slashes, control characters and blanks at its ends"
                ));
        }
        if cannot_be_shown(&self.title) {
            cx.report
                .error(table.place("title"), "`title` has control characters")
                .label("it is shown in a terminal and on pages")
                .help("leave them out");
        }
        if self.materials.iter().any(|material| material.name.trim().is_empty() || cannot_be_shown(&material.name)) {
            cx.report
                .error(cx.places.at("material"), "a material has no name, or one that cannot be shown")
                .label("it stands under a name of nothing, blanks or control characters")
                .help("write `[material.sand]`");
        }
        if self.solver == Solver::Mps && !table.has("particles") {
            cx.missing(None, "particles", "add `[particles]` with `spacing = \"1 mm\"`");
        }
        if let Some(spacing) = self.particles.as_ref().map(|particles| particles.spacing)
            && self.domain.cells == [0; 3]
            && spacing > 0.0
        {
            let extent = self.domain.extent();
            self.domain.cells = [0, 1, 2].map(|d| ((extent[d] / spacing).round() as usize).max(1));
        }
        // Contacts have taken it over.
        self.dem.tension = false;
        check_names("grains", "populations", &self.grains, |population| &population.name, cx);
        check_names("gate", "gates", &self.gates, |gate| &gate.name, cx);
        check_names("liquid", "liquids", &self.liquids, |liquid| &liquid.name, cx);
        cross_checks::check(self, cx);
        moving_particles::check(self, cx);
    }

    /// Water as moving particles, in a case for that solver.
    ///
    /// # Panics
    /// In a case for another one.
    #[must_use]
    pub fn moving_particles(&self) -> &Particles {
        self.particles.as_ref().expect("a case of moving particles says how they are")
    }

    /// Mean body force per mass in the frame of positions from one time to another \[s], at it if they are the same [m/s^2]: gravity less the
    /// frame's acceleration, and what drives the flow beside a mean velocity that is held. Over a step it gives what is in the box the
    /// velocity that the motion has at its end, however fast that changes.
    #[must_use]
    pub fn effective_gravity(&self, over: [Real; 2]) -> Vector {
        let gravity = self.frame.as_ref().map_or(self.gravity, |frame| self.gravity - frame.mean_acceleration(over));
        self.drive.map_or(gravity, |drive| gravity + drive.mean_acceleration(over))
    }

    /// The part of it that acts on grains by the volume of water that they displace [m/s^2].
    #[must_use]
    pub fn force_by_volume(&self, over: [Real; 2]) -> Vector {
        self.drive.map_or(Vector::ZERO, |drive| drive.by_volume(drive.mean_acceleration(over)))
    }

    /// The rest of it, which acts on all by mass [m/s^2].
    #[must_use]
    pub fn force_by_mass(&self, over: [Real; 2]) -> Vector {
        self.effective_gravity(over) - self.force_by_volume(over)
    }

    /// The mean velocity that is held, if one is.
    #[must_use]
    pub fn mean_flow(&self) -> Option<MeanFlowSettings> {
        if self.follows_liquid() {
            return Some(self.followed());
        }
        let drive = self.drive.as_ref()?;
        let velocity = drive.mean_velocity?;
        let Drive { above, answer, ramp: rise, acts_by, .. } = *drive;
        let (extent, periodic) = (self.domain.extent(), self.periodic());
        let everywhere = velocity == Vector::ZERO;
        let pulled = |d: usize| velocity[d] != 0.0 || self.resting_gravity()[d] != 0.0;
        let held = [0, 1, 2].map(|d| if periodic[d] { everywhere || pulled(d) } else { velocity[d] != 0.0 });
        let net = everywhere || (self.solver == Solver::Mics && acts_by == ActsBy::Volume);
        let beside = self.resting_gravity() + drive.acceleration;
        Some(MeanFlowSettings {
            velocity,
            held,
            net,
            above,
            area: extent.x * extent.y,
            answer,
            rise,
            acts_by,
            beside,
            moves_box: false,
        })
    }

    /// Whether the box falls with its liquid.
    #[must_use]
    pub fn follows_liquid(&self) -> bool {
        self.frame.as_ref().is_some_and(|frame| frame.follows == Follows::Liquid)
    }

    /// A box that follows its liquid along gravity: what of the weight the fluid around does not bear is the acceleration of the box. It
    /// answers in the time of a fall through a cell.
    fn followed(&self) -> MeanFlowSettings {
        let extent = self.domain.extent();
        let fall = (self.domain.spacing().min_element() / self.gravity.length()).sqrt();
        let answer = fall.max(self.fluid.step.longest() / LONGEST_STEP);
        MeanFlowSettings {
            velocity: Vector::ZERO,
            held: self.gravity.to_array().map(|g| g != 0.0),
            net: false,
            above: self.domain.lower.z,
            area: extent.x * extent.y,
            answer,
            rise: 0.0,
            acts_by: ActsBy::Mass,
            beside: self.gravity,
            moves_box: true,
        }
    }

    /// The periodic directions.
    #[must_use]
    pub fn periodic(&self) -> [bool; 3] {
        self.boundary.map(|pair| pair[0] == BoundarySide::Periodic)
    }

    /// Where a liquid lies whose origin is `origin` \[m]: with what reaches through periodic sides.
    #[must_use]
    pub fn region_of(&self, liquid: &LiquidRegion, origin: Vector) -> Region {
        liquid.region.moved(origin).repeated(&self.domain, self.periodic())
    }

    /// The plan of the box.
    #[must_use]
    pub fn ground(&self) -> Ground {
        let corner = |v: Vector| [v.x, v.y];
        let [x, y, _] = self.periodic();
        Ground { lower: corner(self.domain.lower), upper: corner(self.domain.upper), periodic: [x, y] }
    }

    /// Heading of pictures: the title, or the name of a case without one.
    #[must_use]
    pub fn caption(&self) -> &str {
        if self.title.is_empty() { &self.name } else { &self.title }
    }

    /// Gravity in the frame of the tank before it moves [m/s^2].
    #[must_use]
    pub fn resting_gravity(&self) -> Vector {
        self.gravity - self.frame.as_ref().map_or(Vector::ZERO, |frame| frame.acceleration)
    }

    /// Gravity under which a bed is packed, straight down x3: that part of gravity in the frame of the tank [m/s^2].
    #[must_use]
    pub fn packing_gravity(&self) -> Real {
        -self.resting_gravity().z
    }

    /// What of the body force by mass never changes once the run has begun [m/s^2]: gravity less the constant acceleration of the frame, and the
    /// constant force that drives the flow. What swings is not part of it, nor what holds a mean velocity.
    #[must_use]
    pub fn constant_force_by_mass(&self) -> Vector {
        let gravity = self.resting_gravity();
        self.drive.map_or(gravity, |drive| gravity + (drive.acceleration - drive.by_volume(drive.acceleration)))
    }

    /// Displacement \[m], velocity [m/s] and acceleration [m/s^2] of the tank at `time` \[s] by its motion.
    #[must_use]
    pub fn tank_at(&self, time: Real) -> [Vector; 3] {
        let motion = self.frame.as_ref().and_then(|frame| frame.motion.as_ref());
        motion.map_or([Vector::ZERO; 3], |motion| motion.at(time))
    }

    /// Added to positions \[m] and velocities [m/s] in the tank for the frame that is written
    /// ([`Outputs::frame`](crate::tables::Outputs::frame)).
    #[must_use]
    pub fn to_written_frame(&self, time: Real) -> [Vector; 2] {
        let [place, velocity, _] = self.tank_at(time);
        match self.output.frame {
            OutputFrame::Tank => [Vector::ZERO; 2],
            OutputFrame::Laboratory => [place, velocity],
        }
    }

    /// Period of the cycles in which the box is shaken or the flow driven \[s]; of several the longest, if they are whole parts of
    /// it. `None` where nothing swings, or nothing comes back.
    #[must_use]
    pub fn period(&self) -> Option<Real> {
        let longest = self.swing_frequencies().reduce(Real::min)?.recip();
        let parts = self.swing_frequencies().map(|frequency| longest * frequency);
        parts.into_iter().all(|part| (part - part.round()).abs() < WHOLE).then_some(longest)
    }

    /// Highest frequency \[Hz] at which the box is shaken or the flow driven; `None` where nothing swings.
    #[must_use]
    pub fn swing_frequency(&self) -> Option<Real> {
        self.swing_frequencies().reduce(Real::max)
    }

    /// Frequencies \[Hz] at which the box is shaken or the flow driven: of a recorded motion that of its strongest harmonic.
    fn swing_frequencies(&self) -> impl Iterator<Item = Real> {
        let frame = self.frame.as_ref();
        let motion = frame.and_then(|frame| frame.motion.as_ref()?.frequency());
        let oscillations = [frame.and_then(|frame| frame.oscillation), self.drive.and_then(|drive| drive.oscillation)];
        let swings = oscillations.into_iter().flatten().filter(|swing| swing.amplitude != Vector::ZERO);
        swings.map(|swing| swing.frequency).chain(motion)
    }

    /// Reads a profile that was measured at `time` \[s], as seen from the tank; nothing if there is no such file.
    ///
    /// # Errors
    /// As [`MeasuredProfile::read_if_there`].
    pub fn measured_profile(&self, file: &Path, time: Real) -> Result<Option<MeasuredProfile>, ReadingsError> {
        let place = self.tank_at(time)[0];
        Ok(MeasuredProfile::read_if_there(file)?.map(|profile| profile.in_tank([place.x, place.z])))
    }

    /// Whether positions are those in the laboratory, in which the walls move.
    #[must_use]
    pub fn walls_move(&self) -> bool {
        self.frame.as_ref().is_some_and(|frame| frame.motion.is_some() && frame.walls == WallMotion::Moving)
    }

    /// Contact law of a pair of materials; `wall` is the box.
    #[must_use]
    pub fn contact(&self, a: &str, b: &str) -> Option<&LinearSpringDashpot> {
        self.contacts
            .iter()
            .find(|pair| (pair.a == a && pair.b == b) || (pair.a == b && pair.b == a))
            .map(|pair| &pair.law)
    }

    /// Material of that name.
    #[must_use]
    pub fn material(&self, name: &str) -> Option<&Material> {
        self.materials.iter().find(|material| material.name == name)
    }

    /// Whether grains of this `size` \[m] have the cells across to be met by an interface at an angle ([`WIDE`]).
    #[must_use]
    pub fn is_wide(&self, size: Real) -> bool {
        self.domain.cells_across(size * (1.0 + 1e-9)) >= WIDE
    }

    /// Whether a side of the box holds grains back.
    #[must_use]
    pub fn holds_grains(&self, direction: usize, upper: usize) -> bool {
        self.dem.grain_walls[direction][upper]
    }

    /// Whether grains are packed within the run.
    #[must_use]
    pub fn packs(&self) -> bool {
        self.grains.iter().any(|population| matches!(population.placement, GrainPlacement::Packed(_)))
    }

    /// Whether a bed that is packed within the run is levelled.
    #[must_use]
    pub fn levels(&self) -> bool {
        let levels =
            |placement: &GrainPlacement| matches!(placement, GrainPlacement::Packed(how) if how.level.is_some());
        self.grains.iter().any(|population| levels(&population.placement))
    }

    /// Whether a bed from a file comes to rest before the run begins.
    #[must_use]
    pub fn relaxes(&self) -> bool {
        self.grains.iter().any(|population| matches!(&population.placement, GrainPlacement::Bed(bed) if bed.relax))
    }

    /// Whether a liquid has a velocity from the start.
    #[must_use]
    pub fn sets_in_motion(&self, liquid: &LiquidRegion) -> bool {
        liquid.velocity != Vector::ZERO || self.fluid.initial_velocity.is_some()
    }

    /// Whether grains are fed in during the run.
    #[must_use]
    pub fn feeds(&self) -> bool {
        self.grains.iter().any(|population| matches!(population.placement, GrainPlacement::Fed(_)))
    }

    /// Whether the grains form a bed: packed within the run or read from a file.
    #[must_use]
    pub fn has_bed(&self) -> bool {
        self.grains
            .iter()
            .any(|population| matches!(population.placement, GrainPlacement::Packed(_) | GrainPlacement::Bed(_)))
    }

    /// Roughness down to which films between grains act \[m]; `None`: no film.
    #[must_use]
    pub fn film_roughness(&self) -> Option<Real> {
        match self.dem.film_roughness {
            FilmRoughness::None => None,
            FilmRoughness::Height(height) => Some(height),
            FilmRoughness::Auto => {
                let balls = self.grains.iter().all(Population::is_of_balls);
                let moves = self.grains.iter().any(Population::has_free_grains);
                let viscous = self.fluid.viscosity != ViscosityScheme::Off && self.fluid.liquid.viscosity > 0.0;
                let wet = viscous && self.has_liquid();
                if self.solver != Solver::Mics || !(balls && moves && wet) {
                    return None;
                }
                let smallest = self.smallest_radius();
                let roughness = ROUGHNESS.clamp(SMOOTHEST * smallest, ROUGHEST * smallest);
                (roughness < (self.dem.film_reach * smallest).min(self.film_farthest())).then_some(roughness)
            }
        }
    }

    /// Whether there is liquid at the start, or some enters or may come in.
    #[must_use]
    pub fn has_liquid(&self) -> bool {
        let brings = |side: &BoundarySide| match side {
            BoundarySide::Inflow { fluid, .. } | BoundarySide::FixedPressure { fluid, .. } => {
                *fluid == FluidName::Liquid
            }
            _ => false,
        };
        !self.liquids.is_empty() || self.boundary.iter().flatten().any(brings)
    }

    /// Radius of the smallest grain that a population may have; infinite without grains \[m].
    pub(crate) fn smallest_radius(&self) -> Real {
        let of = |p: &Population| p.shape.size().map(|diameter| 0.5 * diameter * p.sizes().smallest());
        self.grains.iter().filter_map(of).fold(Real::INFINITY, Real::min)
    }

    /// Largest gap of a film between grains \[m]: on a grid half a cell, from which on the cells have the lubrication.
    #[must_use]
    pub fn film_farthest(&self) -> Real {
        match self.solver {
            Solver::Mics => FILM_CELLS * self.domain.spacing().min_element(),
            Solver::Mps => Real::INFINITY,
        }
    }

    /// The box and its walls, for moving particles.
    #[must_use]
    pub fn tank(&self) -> Tank {
        let side = |side: BoundarySide| match side {
            // The others are refused with the case.
            BoundarySide::NoSlip | BoundarySide::Slip | BoundarySide::Moving { .. } | BoundarySide::Inflow { .. } => {
                Side::Wall
            }
            BoundarySide::Periodic => Side::Periodic,
            BoundarySide::Outflow | BoundarySide::FixedPressure { .. } => Side::Open,
        };
        let sides = self.boundary.map(|sides| sides.map(side));
        let gates = self.gates.iter().map(Gate::plate).collect();
        let slips = |side| if side == BoundarySide::Slip { WallFriction::Slip } else { WallFriction::NoSlip };
        let friction = self.boundary.map(|sides| sides.map(slips));
        let tank = Tank::new(self.domain.lower, self.domain.upper, sides, WallFriction::NoSlip);
        Tank { gates, friction, ..tank }
    }
}
