//! `[[grains]]`: populations of grains.

use std::borrow::Cow;

use sazanami_case_derive::Keys;
use sazanami_dem::Motion;
use sazanami_numerics::{Real, Vector};

use super::contact_spheres::ContactSphereKeys;
use super::{ContactSphereChoice, GrainPlacement, GrainShape, Share, SizeDistribution};
use crate::amounts::length;
use crate::presets::{Paper, Solver};
use crate::read::{Context, Table, cannot_be_shown};
use crate::suggest::nearest;
use crate::units::rounded;

/// The paper's grain: its two equal axes and the single one \[m], and its mass \[kg].
const PAPER_GRAIN: [Real; 2] = [0.52e-3, 1.27e-3];
const PAPER_MASS: Real = 1.93e-7;
/// Solid fraction for which grains of a bed that is levelled are counted: some are left to take away.
const LEVELLED: Real = 0.70;

/// A population of grains.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Population {
    /// Name, unlike that of any other population.
    #[key(default = numbered(table), says = "`grains N`")]
    pub name: String,
    /// Number of grains: required with `placement.packed` unless the bed is levelled; the other placements tell it
    /// themselves, of grains that are fed in it is the most.
    #[key(least = 1)]
    pub count: Option<usize>,
    /// Name of the material.
    #[key(default = only_material(table, cx), says = "the only one")]
    pub material: String,
    /// Seed of random places, orientations and sizes.
    #[key(default = 1)]
    pub seed: u64,
    /// Motion of the grains; `prescribed` is for lists and lattices only. Two grains that forces do not move have no contact.
    #[key(word, shared, default = Motion::Free)]
    pub motion: Motion,
    /// Time at which the grains begin to move; until then they are held where they are put, at rest. For lists and lattices of
    /// free grains.
    #[key(unit = "s", range = NonNegative, says = "from the start on")]
    pub release: Option<Real>,
    /// Mass of a grain of size factor 1, instead of density times volume of the mesh.
    #[key(unit = "kg", range = Positive, paper_literal = (Yagyu, PAPER_MASS,
          "table 1's mass, for the spheroid of 0.52 mm x 1.27 mm only"))]
    pub mass_override: Option<Real>,
    /// Spheres by which contacts are found.
    #[key(flatten, via = ContactSphereKeys, then = contact_spheres.meaning(&shape, table, cx))]
    pub contact_spheres: ContactSphereChoice,
    /// Size factors.
    #[key(table, dotted, default = SizeDistribution::Equal, says = "all 1")]
    pub(crate) size: SizeDistribution,
    /// Shape of a grain.
    #[key(
        table,
        dotted,
        example = "`shape.spheroid = { diameter = \"0.52 mm\", length = \"1.27 mm\" }` or another shape"
    )]
    pub shape: GrainShape,
    /// Placement of the grains.
    #[key(table, example = "`placement.packed = {}`, `bed`, `lattice` or `list`")]
    pub placement: GrainPlacement,
}

impl Population {
    /// Size factors of its grains: those of a list, else as they are drawn. A bed file has its own, within these.
    #[must_use]
    pub fn sizes(&self) -> Cow<'_, SizeDistribution> {
        match &self.placement {
            GrainPlacement::List(list) if !list.is_empty() => {
                let share = |grain: &super::Grain| Share { factor: grain.factor, weight: 1.0 };
                Cow::Owned(SizeDistribution::List(list.iter().map(share).collect()))
            }
            _ => Cow::Borrowed(&self.size),
        }
    }

    /// Size factor of its usual grain: 1, the mean of a list.
    #[must_use]
    pub fn usual_factor(&self) -> Real {
        if matches!(self.placement, GrainPlacement::List(_)) { self.sizes().mean() } else { 1.0 }
    }

    /// Whether any of its grains moves by the forces on it.
    #[must_use]
    pub fn has_free_grains(&self) -> bool {
        match &self.placement {
            GrainPlacement::List(list) => list.iter().any(|grain| grain.motion == Motion::Free),
            _ => self.motion == Motion::Free,
        }
    }

    /// Whether any of its grains moves, by forces or as prescribed.
    #[must_use]
    pub fn moves(&self) -> bool {
        match &self.placement {
            GrainPlacement::List(list) => list.iter().any(|grain| grain.motion != Motion::Fixed),
            _ => self.motion != Motion::Fixed,
        }
    }

    /// Whether its grains are spheres of one contact sphere, between which films and bridges can be.
    #[must_use]
    pub fn is_of_balls(&self) -> bool {
        matches!(self.shape, GrainShape::Sphere { .. }) && self.contact_spheres == ContactSphereChoice::Single
    }

    /// Whether its grains may have one contact sphere each, so that `dem.rolling_friction` is theirs: a file of spheres may have one.
    #[must_use]
    pub fn may_be_round(&self) -> bool {
        match self.contact_spheres {
            ContactSphereChoice::Single | ContactSphereChoice::File { .. } => true,
            ContactSphereChoice::Shell { count, .. } | ContactSphereChoice::Axis(count) => count == 1,
        }
    }

    /// Lets grains that are fed in up to the end of the run be fed in up to a later one \[s].
    pub fn move_end(&mut self, from: Real, to: Real) {
        let GrainPlacement::Fed(feed) = &mut self.placement else { return };
        if feed.until == from {
            feed.until = to;
        }
    }

    /// Number of its grains, as far as the case tells: of those that are fed in the most.
    #[must_use]
    pub fn grains(&self) -> Option<usize> {
        match &self.placement {
            GrainPlacement::Fed(feed) => Some(feed.count().min(self.count.unwrap_or(usize::MAX))),
            _ => self.count,
        }
    }

    /// Whether anything of it is drawn at random: a place, an orientation or a size.
    #[must_use]
    pub fn draws_from_seed(&self) -> bool {
        match &self.placement {
            GrainPlacement::Packed(_) | GrainPlacement::Fed(_) => true,
            GrainPlacement::Lattice(lattice) => {
                lattice.jitter != 0.0 || lattice.random_orientation || self.size.draws()
            }
            GrainPlacement::List(_) | GrainPlacement::Bed(_) => false,
        }
    }
}

/// `grains N` or `liquid N` by the place in the list.
pub(super) fn numbered(table: &Table<'_>) -> String {
    table.at().path.replace('.', " ")
}

fn only_material(table: &Table<'_>, cx: &mut Context<'_>) -> String {
    if let [only] = &cx.known.materials[..] {
        return only.name.clone();
    }
    let help = "add `material = \"sand\"` and `[material.sand]` with its density";
    cx.missing(Some(table.span()), "material", help);
    String::new()
}

impl Population {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        self.size.check(&table.get("size"), cx);
        self.check_material(table, cx);
        let is_ball = matches!(self.shape, GrainShape::Sphere { .. });
        if cx.known.solver == Solver::Mps && is_ball && self.contact_spheres != ContactSphereChoice::Single {
            cx.report
                .warning(
                    Some(table.place("contact_spheres")),
                    "`contact_spheres` has no effect on grains that water overlaps",
                )
                .label("with `solver = \"mps\"` a sphere touches others as one sphere")
                .help("leave it out");
            self.contact_spheres = ContactSphereChoice::Single;
        }
        let is_paper_grain = matches!(&self.shape, GrainShape::Spheroid { diameter, length, .. }
            if [*diameter, *length] == PAPER_GRAIN);
        if !table.has("mass_override") && cx.follows(Paper::Yagyu) && !is_paper_grain {
            self.mass_override = None;
        }
        self.count = self.counted(table, cx);
        if self.motion != Motion::Free && matches!(self.placement, GrainPlacement::Fed(_)) {
            cx.report
                .error(table.place("motion"), "grains that are fed in move by the forces on them")
                .label("once they are inside")
                .help("leave out `motion`");
        }
        let is_placed = matches!(self.placement, GrainPlacement::List(_) | GrainPlacement::Lattice(_));
        if self.motion == Motion::Prescribed && !is_placed {
            cx.report
                .error(table.span(), "a bed cannot move as prescribed")
                .label("prescribed motion is for listed grains and lattices")
                .help("use `motion = \"fixed\"` for a bed from a file that stays");
        }
        if self.motion == Motion::Fixed && matches!(self.placement, GrainPlacement::Packed(_)) {
            cx.report
                .error(table.place("motion"), "grains that are held cannot be packed")
                .label("they would hang where they begin to fall")
                .help("leave it out, and let `placement.packed.glued` reach over the bed: what lies below is held once it is packed");
        }
        self.check_release(table, cx);
        if matches!(self.placement, GrainPlacement::List(_)) && table.has("size") {
            cx.report
                .warning(Some(table.place("size")), "`size` has no effect on grains of a list")
                .label("each has its own `factor`, 1 if it says none")
                .help("give the grains of `placement.list` their `factor`, or leave out `size`");
        }
        if matches!(&self.placement, GrainPlacement::List(list) if list.is_empty()) {
            cx.report
                .error(table.place("placement"), "the list of grains is empty")
                .label("expected at least one")
                .help("for example `list = [{ position = [\"5 mm\", \"5 mm\", \"5 mm\"] }]`");
        }
        cx.known.motion = Motion::Free;
    }

    fn check_release(&self, table: &Table<'_>, cx: &mut Context<'_>) {
        let Some(release) = self.release else { return };
        let moves = match &self.placement {
            GrainPlacement::Packed(_) | GrainPlacement::Bed(_) => {
                cx.report
                    .error(table.place("release"), "a bed is not held until a time")
                    .label("`release` is for lists and lattices")
                    .help("leave it out: beds are at rest when the run begins");
                return;
            }
            GrainPlacement::Fed(_) => {
                cx.report
                    .error(table.place("release"), "grains that are fed in are not held until a time")
                    .label("`release` is for lists and lattices")
                    .help("say from when on they are fed in: `placement.fed.from`");
                return;
            }
            GrainPlacement::Lattice(lattice) => lattice.velocity != Vector::ZERO,
            GrainPlacement::List(list) => {
                list.iter().any(|grain| grain.velocity != Vector::ZERO || grain.angular_velocity != Vector::ZERO)
            }
        };
        if moves {
            cx.report
                .error(table.place("release"), "grains that are held until `release` have no initial velocity")
                .label("they are held at rest until this time")
                .help("leave out `velocity` and `angular_velocity`, or `release`");
        }
        let listed = match &self.placement {
            GrainPlacement::List(list) => list.iter().any(|grain| grain.motion != Motion::Free),
            _ => false,
        };
        if self.motion != Motion::Free || listed {
            cx.report
                .error(table.place("release"), "these grains never move by the forces on them")
                .label("`release` is for free grains")
                .help("leave out `motion`, or `release`");
        }
        if release >= cx.known.run.until {
            cx.report
                .warning(Some(table.place("release")), "these grains are held to the end of the run")
                .label(format!("the run ends at {} s", rounded(cx.known.run.until)))
                .help("release them before, or write `motion = \"fixed\"`");
        }
    }

    fn check_material(&self, table: &Table<'_>, cx: &mut Context<'_>) {
        let known: Vec<&str> = cx.known.materials.iter().map(|material| material.name.as_str()).collect();
        if !table.has("material") || known.contains(&self.material.as_str()) {
            return;
        }
        let meant = nearest(&self.material, known);
        cx.report
            .error(table.place("material"), format!("there is no material `{}`", self.material))
            .label(meant.map_or("not a material of this case".into(), |m| format!("did you mean `{m}`?")))
            .help(format!(
                "add `[material.{}]` with `density = \"2650 kg/m^3\"`",
                crate::write::as_key(&self.material)
            ));
    }

    /// Number of grains, as far as the case tells.
    fn counted(&self, table: &Table<'_>, cx: &mut Context<'_>) -> Option<usize> {
        let implied = match &self.placement {
            GrainPlacement::Packed(packing) => {
                let thinnest = self.shape.size().map(|size| size * self.size.smallest());
                if let (Some(level), Some(thinnest)) = (packing.highest_level(), thinnest)
                    && level < thinnest
                {
                    cx.report
                        .error(table.place("placement"), "no grain lies below the level of this bed")
                        .label(format!("levelled at {} at most", length(level)))
                        .help(format!("the thinnest grain is {} thick: take a higher `level`", length(thinnest)));
                }
                let height = cx.known.domain.extent().z;
                if let Some(level) = packing.highest_level().filter(|level| *level > height && height > 0.0) {
                    let title = "the level of this bed lies above the box: nothing is taken away";
                    let help = if table.has("count") { "lower `level`, or leave it out" } else { "lower `level`" };
                    cx.report
                        .warning(Some(table.place("placement")), title)
                        .label(format!("levelled at {} at most, the box is {} high", length(level), length(height)))
                        .help(help);
                }
                if table.has("count") {
                    return self.count;
                }
                if let (Some(level), Some(volume)) = (packing.highest_level(), self.shape.volume()) {
                    let extent = cx.known.domain.extent();
                    let solid = LEVELLED * extent.x * extent.y * level;
                    return Some((solid / (volume * self.size.mean_cube())).ceil().max(1.0) as usize);
                }
                cx.missing(Some(table.span()), "count", "add `count = 30900`: how many grains are packed");
                return None;
            }
            GrainPlacement::Bed(_) => return self.count,
            GrainPlacement::Lattice(lattice) => lattice.counts.iter().fold(1, |all: usize, &n| all.saturating_mul(n)),
            GrainPlacement::Fed(_) => return self.count,
            GrainPlacement::List(list) => list.len(),
        };
        if let Some(count) = self.count.filter(|count| *count != implied) {
            cx.report
                .error(table.place("count"), format!("`count` says {count}, the placement {implied}"))
                .label("the placement gives the number by itself")
                .help("leave out `count`");
        }
        Some(implied)
    }
}

/// Names tell the `things` of a list of tables apart in results.
pub(crate) fn check_names<T>(list: &str, things: &str, all: &[T], name: impl Fn(&T) -> &String, cx: &mut Context<'_>) {
    let names: Vec<&str> = all.iter().map(|one| name(one).as_str()).collect();
    let place = |n: usize, cx: &Context<'_>| {
        let of = format!("{list}.{n}");
        cx.places.of(&format!("{of}.name")).or_else(|| cx.places.near(&of)).unwrap_or(0..0)
    };
    if let Some(n) = names.iter().position(|name| name.trim().is_empty() || cannot_be_shown(name)) {
        cx.report
            .error(place(n, cx), format!("one of the {things} has a name that cannot be shown"))
            .label("it is empty, blank or has control characters")
            .help("give it a word for a name, or leave `name` out");
    }
    if let Some(n) = (0..names.len()).find(|&n| names[..n].contains(&names[n])) {
        cx.report
            .error(place(n, cx), format!("two {things} are called `{}`", names[n]))
            .label("results refer to them by name")
            .help("give each a `name` of its own");
    }
}
