//! `placement` of `[[grains]]`: where grains are put.

use std::f64::consts::TAU;
use std::ops::Range;
use std::path::PathBuf;

use sazanami_case_derive::Keys;
use sazanami_dem::{Lattice, Motion, PackingSettings};
use sazanami_io::as_word;
use sazanami_numerics::{Quaternion, Real, Vector, choices};

use super::boundary::SIDE_NAMES;
use super::read_by;
use crate::read::{Context, Table};
use crate::units::{SAME, rounded};

/// The recommended way to pack; it does not depend on the box.
const PACKING: PackingSettings = PackingSettings::new(Vector::ZERO, Vector::ZERO);

choices! {
    /// End of packing.
    pub enum PackingStop {
        /// When the bed has come to rest, by `mean_speed` and `energy_ratio`, after `settle_time`.
        Settled = "settled",
        /// After `settle_time`, at rest or not, as Yagyu et al. (2015).
        TimeOnly = "time_only",
    }
}

/// A bed packed within the run. The settings of the first packed population hold for all; populations are mixed at
/// random. They fall straight down x3, under that part of gravity. Grains that are placed otherwise come in when the bed is done and have to lie above it.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Packing {
    /// Lattice the grains fall from.
    #[key(word, default)]
    pub lattice: Lattice,
    /// Distance of neighbours over the largest extent of a grain. Below 1 they may begin within each other, which the run bears up to 0.8 of
    /// a contact sphere's radius. Grains of sizes more than a factor of two apart have no lattice.
    #[key(range = Between(0.1, 100.0), default = PACKING.spacing)]
    pub spacing: Real,
    /// Random displacement over the distance of neighbours, up to half of the room between them: along x3 to `(1 - 1/spacing)/2`, none where
    /// `spacing` is 1 or less; along x1 and x2, where the distance is stretched so that the box is filled, to no less.
    #[key(range = Between(0.0, 0.5), default = PACKING.jitter)]
    pub jitter: Real,
    /// Height above the floor at which the packed bed is levelled: grains that reach above are taken away, and the others come to
    /// rest once more (on a grid without fluid, in half a second at most, from contacts without memory; open sides hold them until the run begins). Without `count` as many
    /// grains are packed as fill it.
    #[key(unit = "m", range = Positive)]
    pub level: Option<Real>,
    /// Ripples along x1 that the levelled surface begins with; of several lengths they add up.
    #[key(tables)]
    pub ripples: Vec<SeededRipples>,
    /// For `solver = "mps"`: height above the floor below which the centres of grains lie that are glued to it once they
    /// are packed, so that the floor is rough.
    #[key(unit = "m", range = Positive)]
    pub glued: Option<Real>,
    /// Gravity during the fall over gravity; grains of sizes more than a factor of two apart sink slowly under gravity itself.
    #[key(range = Positive, default = PACKING.fall_factor)]
    pub fall_gravity: Real,
    /// Least time after the switch to normal gravity, when the highest grain meets another.
    #[key(unit = "s", range = NonNegative, default = PACKING.settling_time)]
    pub settle_time: Real,
    /// End of packing.
    #[key(word, default = PackingStop::Settled, paper_literal = (Yagyu, PackingStop::TimeOnly,
          "the bed is taken 5e-3 s after the first collision, at rest or not"))]
    pub stop: PackingStop,
    /// Largest mean speed of a bed at rest.
    #[key(unit = "m/s", range = Positive, default = PACKING.rest_speed)]
    pub mean_speed: Real,
    /// Largest kinetic energy of a bed at rest over N M g d.
    #[key(range = Positive, default = PACKING.rest_energy)]
    pub energy_ratio: Real,
    /// Friction while packing over friction; below 1 packs denser.
    #[key(range = NonNegative, default = PACKING.fall_friction)]
    pub friction_scale: Real,
    /// Longest simulated packing time; after it the run fails.
    #[key(unit = "s", range = Positive, default = longest_packing(cx),
          says = format!("{} s, or {FALLS} falls from the height of the box if that is longer", PACKING.longest))]
    pub time_limit: Real,
}

/// A displacement that is cut to less than this part of what is asked for is warned of.
const LITTLE: Real = 0.75;
/// Falls from the height of the box that a packing may take.
const FALLS: Real = 10.0;

/// Time that a packing may take \[s].
fn longest_packing(cx: &Context<'_>) -> Real {
    let fall = (2.0 * cx.known.domain.extent().z / cx.known.gravity.length()).sqrt();
    if fall.is_finite() { PACKING.longest.max(FALLS * fall) } else { PACKING.longest }
}

/// Ripples of a bed that is levelled to `level + height/2 cos(2 pi (x1 - middle - crest)/wavelength)`, summed over all of them.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
pub struct SeededRipples {
    /// Distance of the crests.
    #[key(unit = "m", range = Positive)]
    pub wavelength: Real,
    /// Height of a crest above a trough.
    #[key(unit = "m", range = Positive)]
    pub height: Real,
    /// Place of a crest along x1, from the middle of the box.
    #[key(unit = "m", default = 0.0)]
    pub crest: Real,
}

impl Packing {
    /// Height above the floor at which the bed is levelled at `x` \[m] from the middle of the box \[m].
    #[must_use]
    pub fn level_at(&self, x: Real) -> Option<Real> {
        let wave = |by: &SeededRipples| 0.5 * by.height * (TAU * (x - by.crest) / by.wavelength).cos();
        self.level.map(|level| level + self.ripples.iter().map(wave).sum::<Real>())
    }

    /// Highest level of the bed above the floor, where all crests meet \[m].
    #[must_use]
    pub fn highest_level(&self) -> Option<Real> {
        self.level.map(|level| level + self.amplitude())
    }

    /// Sum of the amplitudes of the ripples that the bed begins with \[m].
    fn amplitude(&self) -> Real {
        self.ripples.iter().map(|ripples| 0.5 * ripples.height).sum()
    }

    /// Says where `spacing` leaves little of a displacement that the case gives.
    fn check_jitter(&self, table: &Table<'_>, cx: &mut Context<'_>) {
        let room = (0.5 - 0.5 / self.spacing).max(0.0);
        let is_usual = !table.has("jitter") || self.jitter == PACKING.jitter;
        if is_usual || room > LITTLE * self.jitter {
            return;
        }
        cx.report
            .warning(Some(table.place("jitter")), "grains are displaced by less than `jitter` says")
            .label(format!(
                "along x3 by {} of the distance of neighbours, half of the room between layers",
                rounded(room)
            ))
            .help(format!("write `jitter = {}`, or a wider `spacing`", rounded(room)));
    }

    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        self.check_jitter(table, cx);
        if self.ripples.is_empty() {
            return;
        }
        let amplitude = self.amplitude();
        match self.level {
            None => {
                cx.report
                    .error(table.place("ripples"), "a bed that is not levelled has no ripples")
                    .label("ripples vary `level` along x1")
                    .help("add `level = \"7 mm\"`, the mean height of the bed");
            }
            Some(level) if amplitude >= level => {
                cx.report
                    .error(table.place("ripples"), "the troughs of the ripples reach below the floor")
                    .label(format!("half of the height, of all of them together, is {} mm", rounded(1e3 * amplitude)))
                    .help(format!("`level` is {} mm: take a lower height or a thicker bed", rounded(1e3 * level)));
            }
            Some(_) => {}
        }
    }
}

/// A bed from a file that `output.bed` wrote.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct BedFile {
    /// The file, relative to the case file.
    #[key(example = "beds/paper.bed")]
    pub file: PathBuf,
    /// Factor on the positions in the file; shapes keep their size.
    #[key(range = Positive, default = 1.0)]
    pub scale: Real,
    /// Whether the grains come to rest, without fluid, before the run begins; grains that overlap part at 0.05 m/s at
    /// most first. All grains of the case take part, on a grid behind open sides until the run begins, but those of prescribed motion wait;
    /// not beside `placement.packed`.
    #[key(default = false)]
    pub relax: bool,
    /// The case that makes the file; named in the message if the file is missing.
    pub recipe: Option<PathBuf>,
}

impl BedFile {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if !table.has("file") || self.file.is_file() {
            return;
        }
        let (file, exists) = (self.file.display(), self.file.exists());
        let title = if exists {
            format!("the bed `{file}` is no regular file")
        } else {
            format!("there is no bed file `{file}`")
        };
        cx.report
            .error(table.place("file"), title)
            .label(if exists { "a folder or a device" } else { "file not found" })
            .help(self.how_to_make());
    }

    /// Advice on making the file anew.
    #[must_use]
    pub fn how_to_make(&self) -> String {
        match &self.recipe {
            Some(recipe) => {
                let path = std::path::absolute(&self.file).unwrap_or_else(|_| self.file.clone());
                format!("make it with `sazanami run {} --set output.bed=\"{}\"`", as_word(recipe), path.display())
            }
            None => "make it with a case that packs grains and names it under `output.bed`".into(),
        }
    }
}

/// Grains on a lattice that fills a block evenly.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct LatticePlacement {
    /// Lower corner of the block.
    #[key(unit = "m", default = cx.known.domain.lower, says = "that of the box")]
    pub lower: Vector,
    /// Upper corner of the block.
    #[key(unit = "m", default = cx.known.domain.upper, says = "that of the box")]
    pub upper: Vector,
    /// Grains in x1, x2, x3.
    pub counts: [usize; 3],
    /// Random displacement over the distance of neighbours.
    #[key(range = Between(0.0, 0.5), default = 0.0)]
    pub jitter: Real,
    /// Whether each is turned at random; otherwise they lie as their shape is given.
    #[key(default = false)]
    pub random_orientation: bool,
    /// Velocity.
    #[key(unit = "m/s", default = Vector::ZERO, says = "at rest")]
    pub velocity: Vector,
}

impl LatticePlacement {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if (self.upper - self.lower).min_element() <= 0.0 {
            cx.report
                .error(table.span(), "the block of the lattice has no extent")
                .label("`upper` has to lie above `lower` in x1, x2 and x3");
        }
        let domain = &cx.known.domain;
        if (0..3).any(|d| domain.excludes_along(d, [self.lower[d], self.upper[d]])) {
            let reaches = domain.reaches();
            cx.report
                .error(table.span(), "the lattice reaches out of the box")
                .label(reaches)
                .help("leave out `lower` and `upper` to fill the box");
        }
        if cx.known.motion == Motion::Fixed && self.velocity != Vector::ZERO {
            refuse_held(table, "velocity", cx);
        }
    }
}

/// Refuses a velocity of what is held.
fn refuse_held(table: &Table<'_>, key: &str, cx: &mut Context<'_>) {
    cx.report
        .error(table.place(key), "what is held has no velocity")
        .label("`motion = \"fixed\"` holds it in place")
        .help("write `motion = \"prescribed\"` for grains that keep their velocity");
}

/// What components are divided by so that their squares are no numbers too large or too small: their largest, where that is needed.
fn scale_of(components: &[Real]) -> Real {
    let largest = components.iter().fold(0.0, |largest: Real, component| largest.max(component.abs()));
    if largest == 0.0 || (1e-100..1e100).contains(&largest) { 1.0 } else { largest }
}

/// Orientation of a grain put by hand; none of the keys: as its shape is given.
#[derive(Clone, Debug, Keys)]
struct OrientationKeys {
    #[key(skip = table.span())]
    span: Range<usize>,
    /// Rotation of the shape as it is given, about its centre of mass, as a quaternion `[w, x, y, z]`, instead of `axis` and `angle`.
    quaternion: Option<[Real; 4]>,
    /// Axis of that rotation.
    axis: Option<Vector>,
    /// Its angle.
    #[key(unit = "rad")]
    angle: Option<Real>,
}

read_by!(Quaternion, OrientationKeys);

impl OrientationKeys {
    fn meaning(self, cx: &mut Context<'_>) -> Option<Quaternion> {
        let mut refuse = |title: &str, help: &str| {
            cx.report.error(self.span.clone(), title).label("the orientation of this grain").help(help);
        };
        Some(match (self.axis, self.angle, self.quaternion) {
            (None, None, None) => Quaternion::IDENTITY,
            (Some(axis), Some(angle), None) => {
                if axis == Vector::ZERO {
                    refuse("an axis needs a direction", "for example `axis = [0, 0, 1]`");
                }
                let axis = axis / scale_of(&axis.to_array());
                Quaternion::from_axis_angle(axis.normalize_or(Vector::Z), angle)
            }
            (None, None, Some([w, x, y, z])) => {
                if [w, x, y, z].iter().all(|part| *part == 0.0) {
                    refuse("a quaternion must not be zero", "`[1, 0, 0, 0]` is no rotation");
                }
                let q = Quaternion::from_xyzw(x, y, z, w) / scale_of(&[w, x, y, z]);
                // A unit quaternion, as in a resolved case, is kept to the last bit.
                let length: Real = q.length();
                if (length - 1.0).abs() < 1e-15 { q } else { q.normalize() }
            }
            (_, _, Some(_)) => {
                refuse("an orientation is given once", "keep `quaternion`, or `axis` and `angle`");
                Quaternion::IDENTITY
            }
            (_, _, None) => {
                refuse("a rotation needs an axis and an angle", "add the one that is missing");
                Quaternion::IDENTITY
            }
        })
    }

    fn of(q: &Quaternion) -> Self {
        Self { span: 0..0, quaternion: Some([q.w, q.x, q.y, q.z]), axis: None, angle: None }
    }
}

/// A grain put by hand.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Grain {
    /// Centre of mass.
    #[key(unit = "m")]
    pub position: Vector,
    /// Orientation, body to laboratory.
    #[key(flatten)]
    pub orientation: Quaternion,
    /// Velocity.
    #[key(unit = "m/s", default = Vector::ZERO, says = "at rest")]
    pub velocity: Vector,
    /// Angular velocity.
    #[key(unit = "rad/s", default = Vector::ZERO, says = "none")]
    pub angular_velocity: Vector,
    /// Its motion.
    #[key(word, default = cx.known.motion, says = "as its population")]
    pub motion: Motion,
    /// Size factor.
    #[key(range = Positive, default = 1.0)]
    pub factor: Real,
}

impl Grain {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if cx.known.domain.excludes(self.position) {
            let reaches = cx.known.domain.reaches();
            cx.report
                .error(table.place("position"), "this grain lies outside the box")
                .label(reaches)
                .help("move the grain, or enlarge the box");
        }
        if self.motion == Motion::Fixed && [self.velocity, self.angular_velocity] != [Vector::ZERO; 2] {
            refuse_held(table, if self.velocity == Vector::ZERO { "angular_velocity" } else { "velocity" }, cx);
        }
    }
}

choices! {
    /// A side of the box.
    pub enum SideName {
        /// That of smallest x1.
        X1Lower = "x1_lower",
        /// That of largest x1.
        X1Upper = "x1_upper",
        /// That of smallest x2.
        X2Lower = "x2_lower",
        /// That of largest x2.
        X2Upper = "x2_upper",
        /// The bottom.
        X3Lower = "x3_lower",
        /// The top.
        X3Upper = "x3_upper",
    }
}

impl SideName {
    /// Its direction, and whether it is the lower one (0) or the upper one (1).
    #[must_use]
    pub fn place(self) -> [usize; 2] {
        let number = self as usize;
        [number / 2, number % 2]
    }

    /// Its name in a case.
    #[must_use]
    pub fn text(self) -> &'static str {
        let [direction, upper] = self.place();
        SIDE_NAMES[direction][upper]
    }
}

/// Grains that are fed in one after another through a side that holds none back. Each begins just outside, at a random place where
/// there is room, and is carried in at `velocity`; from when it is inside as a whole it moves by the forces on it. Where there is no room at
/// its time, or a gate stands, it waits for it. `fed_grains` and `fed_mass` count them.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Feed {
    /// The side.
    #[key(word, example = "x1_lower")]
    pub side: SideName,
    /// Grains in a second.
    #[key(unit = "Hz", range = Positive)]
    pub rate: Real,
    /// Velocity with which they come in.
    #[key(unit = "m/s")]
    pub velocity: Vector,
    /// Time of the first.
    #[key(unit = "s", range = NonNegative, default = 0.0)]
    pub from: Real,
    /// Time after which none comes.
    #[key(unit = "s", range = NonNegative, default = cx.known.run.until, says = "the end of the run")]
    pub until: Real,
    /// Lower corner of the part of the side through which they come.
    #[key(unit = "m", default = cx.known.domain.lower, says = "that of the side")]
    pub lower: Vector,
    /// Upper corner of that part.
    #[key(unit = "m", default = cx.known.domain.upper, says = "that of the side")]
    pub upper: Vector,
    /// Whether each is turned at random; otherwise they lie as their shape is given.
    #[key(default = false)]
    pub random_orientation: bool,
}

impl Feed {
    /// Number of grains that are due up to its end.
    #[must_use]
    pub fn count(&self) -> usize {
        ((self.until - self.from) * self.rate * (1.0 - 1e-12)).floor().max(0.0) as usize + 1
    }

    /// Time at which grain `index` is due \[s].
    #[must_use]
    pub fn due(&self, index: usize) -> Real {
        self.from + index as Real / self.rate
    }

    /// Time after `now` at which the next grain is due \[s].
    #[must_use]
    pub fn next_after(&self, now: Real) -> Option<Real> {
        let first = ((now - self.from) * self.rate).floor().max(0.0) as usize;
        (first..self.count().min(first.saturating_add(3)))
            .map(|index| self.due(index))
            .find(|due| *due > now * (1.0 + SAME))
    }

    /// Speed into the box [m/s].
    #[must_use]
    pub fn inward(&self) -> Real {
        let [direction, upper] = self.side.place();
        if upper == 0 { self.velocity[direction] } else { -self.velocity[direction] }
    }

    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        let side = self.side.text();
        if self.inward() <= 0.0 {
            cx.report
                .error(table.place("velocity"), format!("these grains do not come in through {side}"))
                .label("this velocity does not point into the box")
                .help("turn its component across the side round");
        }
        if self.until < self.from && table.has("until") {
            cx.report
                .error(table.place("until"), "the feed ends before it begins")
                .label(format!("it begins at {} s", rounded(self.from)))
                .help("leave out `until` to feed to the end of the run");
        } else if self.until < self.from {
            cx.report
                .error(table.place("from"), "the feed begins after the end of the run")
                .label(format!("the run ends at {} s", rounded(self.until)))
                .help("let it begin sooner, or end the run later");
        }
        let domain = &cx.known.domain;
        let [direction, _] = self.side.place();
        let out = (0..3)
            .filter(|&d| d != direction)
            .any(|d| domain.excludes_along(d, [self.lower[d], self.upper[d]]) || self.upper[d] <= self.lower[d]);
        if out {
            let reaches = domain.reaches();
            cx.report
                .error(table.span(), format!("this is no part of the side {side}"))
                .label(reaches)
                .help("leave out `lower` and `upper` to feed through the whole side");
        }
    }
}

/// Placement of the grains of a population.
#[derive(Clone, Debug, PartialEq, Keys)]
pub enum GrainPlacement {
    /// Packed within the run.
    Packed(Packing),
    /// Read from a bed file.
    Bed(BedFile),
    /// On a lattice.
    Lattice(LatticePlacement),
    /// Fed in through a side of the box.
    Fed(Feed),
    /// One by one, a list of tables.
    List(Vec<Grain>),
}
