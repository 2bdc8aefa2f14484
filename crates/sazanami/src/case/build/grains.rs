//! Materials, contacts and the shapes of grains.

use std::ops::Range;

use sazanami_numerics::{Real, Vector};

use super::{Context, span_of};
use crate::case::meaning::{
    BoundarySide, BoxDomain, ContactLaw, ContactSphereChoice, Damping, DampingKind, DemOptions, GrainPlacement,
    GrainShape, Material, Motion, Multiplicity, PairContact, Population, Rolling, SIDE_NAMES, SizeDistribution,
    Substeps, VolumeChoice, WALL,
};
use crate::case::presets::PAPER_GRAIN;
use crate::case::schema::{CaseText, ContactText, DemText, PopulationText, ShapeText};
use crate::case::suggest::nearest;
use crate::case::value::Range1;
use crate::case::written::{At, AutoOrWhole, Dashpot, Density, Item, Length, Mass, Stiffness, Words};

/// Contact of the paper's sand: stiffness [N/m], dashpot [N s/m], friction, restitution.
/// Solid fraction for which grains of a bed that is levelled are counted: some are left to take away.
const LEVELLED: Real = 0.70;
const STIFFNESS: Real = 1e4;
const DASHPOT: Real = 2.95e-3;
const FRICTION: Real = 0.6;
const RESTITUTION: Real = 0.5;

/// Most contact spheres of a shell: to spread them takes time as the square of their number, and far fewer follow
/// any grain.
const MOST_ON_SHELL: usize = 1000;
/// Most contact spheres along an axis.
const MOST_ON_AXIS: usize = 1000;
/// Most rings of a spheroid's mesh, and most segments of a ring.
const MOST_DIVISIONS: usize = 200;

impl Context<'_> {
    pub(super) fn dem(&mut self, text: &CaseText, boundary: &[[BoundarySide; 2]; 3]) -> DemOptions {
        let empty = DemText::default();
        let written = text.dem.as_ref().map_or(&empty, |at| &at.value);
        let defaults = self.defaults;
        let substeps = written.substeps.as_ref().map_or(defaults.substeps, |s| self.substeps(s));
        let grain_walls = self.grain_walls(written.grain_walls.as_ref(), boundary);
        let values = &mut self.values;
        DemOptions {
            substeps,
            multiplicity: values.choice(written.multiplicity.as_ref(), "multiplicity", Multiplicity::Sum),
            slip_direction: values.choice(written.slip_direction.as_ref(), "slip_direction", defaults.slip_direction),
            history: values.choice(written.history.as_ref(), "history", defaults.history),
            rolling: values.choice(written.rolling.as_ref(), "rolling", Rolling::None),
            rolling_friction: values.number(
                written.rolling_friction.as_ref(),
                "rolling_friction",
                Range1::NonNegative,
                0.0,
            ),
            wall: values.choice(written.wall.as_ref(), "wall", defaults.wall),
            grain_walls,
        }
    }

    fn substeps(&mut self, AutoOrWhole(at): &AutoOrWhole) -> Substeps {
        match &at.value {
            Item::Text(word) if word == "auto" => return Substeps::Auto,
            Item::Integer(n) if *n > 0 => return Substeps::Fixed(*n as usize),
            _ => {}
        }
        self.values
            .report
            .error(at.span.clone(), "`substeps` cannot be read")
            .label("expected \"auto\" or a whole number above zero")
            .help("\"auto\" takes as many as the contacts need");
        Substeps::Auto
    }

    fn grain_walls(&mut self, written: Option<&Words>, boundary: &[[BoundarySide; 2]; 3]) -> [[bool; 2]; 3] {
        let solid = |side: &BoundarySide| {
            matches!(side, BoundarySide::NoSlip | BoundarySide::Slip | BoundarySide::Moving { .. })
        };
        let Some(Words(at)) = written else { return boundary.map(|sides| [solid(&sides[0]), solid(&sides[1])]) };
        let mut walls = [[false; 2]; 3];
        let Item::List(list) = &at.value else {
            self.values.report.error(at.span.clone(), "`grain_walls` is not a list").label("expected names of sides");
            return walls;
        };
        for element in list {
            let word = match &element.value {
                Item::Text(word) => word.as_str(),
                _ => "",
            };
            let found = (0..3).flat_map(|d| [(d, 0), (d, 1)]).find(|&(d, upper)| SIDE_NAMES[d][upper] == word);
            match found {
                Some((d, upper)) if boundary[d][upper] == BoundarySide::Periodic => {
                    self.values
                        .report
                        .error(element.span.clone(), format!("`{word}` is periodic"))
                        .label("a periodic side holds nothing back");
                }
                Some((d, upper)) => walls[d][upper] = true,
                None => {
                    let known: Vec<&str> = SIDE_NAMES.iter().flatten().copied().collect();
                    self.values
                        .report
                        .error(element.span.clone(), "this is no side of the box")
                        .label(format!("expected one of {}", known.join(", ")));
                }
            }
        }
        walls
    }

    pub(super) fn materials(&mut self, text: &CaseText) -> (Vec<Material>, Vec<PairContact>) {
        let mut materials = Vec::new();
        for (name, At { value, span }) in &text.material {
            let name_text = name.0.get_ref();
            if name_text == WALL || name_text == "default" || name_text.contains('/') {
                self.values
                    .report
                    .error(name.0.span(), format!("a material cannot be called `{name_text}`"))
                    .label("this name means something else in contacts")
                    .help("choose another name");
            }
            let density = self.values.required::<Density>(value.density.as_ref(), span, "density", Range1::Positive);
            materials.push(Material { name: name_text.clone(), density });
        }
        self.check_contact_names(text, &materials);
        let mut contacts = Vec::new();
        for (n, a) in materials.iter().enumerate() {
            for b in &materials[n..] {
                let law = self.contact_law(text, &[format!("{}/{}", a.name, b.name), format!("{}/{}", b.name, a.name)]);
                contacts.push(PairContact { a: a.name.clone(), b: b.name.clone(), law });
            }
            let own = format!("{0}/{0}", a.name);
            let law = self.contact_law(text, &[format!("{}/{WALL}", a.name), format!("{WALL}/{}", a.name), own]);
            contacts.push(PairContact { a: a.name.clone(), b: WALL.into(), law });
        }
        (materials, contacts)
    }

    fn check_contact_names(&mut self, text: &CaseText, materials: &[Material]) {
        for name in text.contact.keys() {
            let pair = name.0.get_ref();
            if pair == "default" {
                continue;
            }
            let Some((a, b)) = pair.split_once('/') else {
                self.values
                    .report
                    .error(name.0.span(), format!("`{pair}` is no pair of materials"))
                    .label("expected two names with a slash between")
                    .help("for example `[contact.\"sand/sand\"]` or `[contact.\"sand/wall\"]`");
                continue;
            };
            for side in [a, b] {
                if side != WALL && !materials.iter().any(|material| material.name == side) {
                    let known = materials.iter().map(|material| material.name.as_str());
                    let meant = nearest(side, known);
                    self.values
                        .report
                        .error(name.0.span(), format!("there is no material `{side}`"))
                        .label(meant.map_or("not a material of this case".into(), |m| format!("did you mean `{m}`?")))
                        .help(format!("add `[material.{side}]` with its density"));
                }
            }
        }
    }

    /// The law of the first of `names` that the case gives; what it leaves open is taken from `default`.
    fn contact_law(&mut self, text: &CaseText, names: &[String]) -> ContactLaw {
        let find = |wanted: &str| text.contact.iter().find(|(name, _)| name.0.get_ref() == wanted).map(|(_, at)| at);
        let empty = ContactText::default();
        let nowhere = 0..0;
        let (pair, span) =
            names.iter().find_map(|name| find(name)).map_or((&empty, &nowhere), |At { value, span }| (value, span));
        let general = find("default").map_or(&empty, |at| &at.value);
        /// The pair's own entry, or else the general one.
        macro_rules! entry {
            ($key:ident) => {
                pair.$key.as_ref().or(general.$key.as_ref())
            };
        }
        let dem_text = text.dem.as_ref().map(|at| &at.value);
        let values = &mut self.values;
        let normal_stiffness =
            values.quantity::<Stiffness>(entry!(normal_stiffness), "normal_stiffness", Range1::Positive, STIFFNESS);
        let tangential_stiffness = values.quantity::<Stiffness>(
            entry!(tangential_stiffness),
            "tangential_stiffness",
            Range1::Positive,
            normal_stiffness,
        );
        let restitution = values.optional_number(entry!(restitution), "restitution", Range1::Between(1e-3, 1.0));
        let normal = values.optional::<Dashpot>(entry!(normal_damping), "normal_damping", Range1::NonNegative);
        let tangential =
            values.optional::<Dashpot>(entry!(tangential_damping), "tangential_damping", Range1::NonNegative);
        let coefficients = normal.is_some() || tangential.is_some();
        let implied = match (coefficients, restitution.is_some()) {
            (false, true) => Some(DampingKind::Restitution),
            (true, _) => Some(DampingKind::Literal),
            (false, false) => None,
        };
        let kind = values
            .optional_choice(entry!(damping), "damping")
            .or_else(|| values.optional_choice(dem_text.and_then(|d| d.damping.as_ref()), "damping"))
            .or(implied)
            .unwrap_or(DampingKind::Literal);
        if coefficients
            && pair.restitution.is_some()
            && pair.damping.is_none()
            && dem_text.is_none_or(|d| d.damping.is_none())
        {
            values
                .report
                .error(span.clone(), "which of the two dashpots is meant?")
                .label("this contact has coefficients and a restitution")
                .help("add `damping = \"literal\"` or `damping = \"restitution\"`");
        }
        let damping = match kind {
            DampingKind::Literal => {
                let normal = normal.unwrap_or(DASHPOT);
                Damping::Literal { normal, tangential: tangential.unwrap_or(normal) }
            }
            DampingKind::Restitution => Damping::Restitution(restitution.unwrap_or(RESTITUTION)),
        };
        let friction = values.number(entry!(friction), "friction", Range1::Between(0.0, 10.0), FRICTION);
        let general_tension = values.flag(dem_text.and_then(|d| d.tension.as_ref()), "tension", self.defaults.tension);
        let tension = values.flag(entry!(tension), "tension", general_tension);
        ContactLaw { normal_stiffness, tangential_stiffness, damping, friction, tension }
    }

    pub(super) fn populations(
        &mut self,
        text: &CaseText,
        domain: &BoxDomain,
        materials: &[Material],
    ) -> Vec<Population> {
        let populations: Vec<Population> = text
            .grains
            .iter()
            .enumerate()
            .filter_map(|(number, at)| self.population(number, at, domain, materials))
            .collect();
        let mut names: Vec<&str> = populations.iter().map(|population| population.name.as_str()).collect();
        names.sort_unstable();
        if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1])
            && let Some(At { span, .. }) = text.grains.last()
        {
            self.values
                .report
                .error(span.clone(), format!("two populations are called `{}`", twice[0]))
                .label("names tell populations apart in results")
                .help("give each a `name` of its own");
        }
        populations
    }

    fn population(
        &mut self,
        number: usize,
        at: &At<PopulationText>,
        domain: &BoxDomain,
        materials: &[Material],
    ) -> Option<Population> {
        let At { value, span } = at;
        let name =
            self.values.text(value.name.as_ref(), "name").map_or_else(|| format!("grains {number}"), str::to_owned);
        let shape = match &value.shape {
            Some(shape) => self.shape(shape),
            None => {
                self.values.missing(
                    Some(span),
                    "shape",
                    "add `shape.spheroid = { diameter = \"0.52 mm\", length = \"1.27 mm\" }` or another shape",
                );
                None
            }
        };
        let material = self.material_of(value, span, materials);
        let motion = self.values.choice(value.motion.as_ref(), "motion", Motion::Free);
        let seed = self.values.whole(value.seed.as_ref(), "seed", 0).unwrap_or(1) as u64;
        let size = value.size.as_ref().map_or(SizeDistribution::Equal, |size| self.size_distribution(size));
        let count = self.values.whole(value.count.as_ref(), "count", 1);
        let placement = match &value.placement {
            Some(placement) => self.grain_placement(placement, motion, domain),
            None => {
                self.values.missing(Some(span), "placement", "add `placement.packed = {}`, `bed`, `lattice` or `list`");
                None
            }
        };
        let shape = shape?;
        let contact_spheres = self.contact_spheres(value, &shape);
        let mass_override = self
            .values
            .optional::<Mass>(value.mass_override.as_ref(), "mass_override", Range1::Positive)
            .or_else(|| self.paper_mass(&shape));
        let placement = placement?;
        let level = match &placement {
            GrainPlacement::Packed(packing) => packing.level,
            _ => None,
        };
        let count = match (count, level, shape.volume()) {
            (None, Some(level), Some(volume)) if value.count.is_none() => {
                let extent = domain.extent();
                let solid = LEVELLED * extent.x * extent.y * level;
                Some((solid / (volume * size.mean_cube())).ceil().max(1.0) as usize)
            }
            _ => self.count(count, &placement, value, span),
        };
        if motion == Motion::Prescribed && !matches!(placement, GrainPlacement::List(_) | GrainPlacement::Lattice(_)) {
            self.values
                .report
                .error(span.clone(), "a bed cannot move as prescribed")
                .label("prescribed motion is for listed grains and lattices")
                .help("use `motion = \"fixed\"` for a bed that stays");
        }
        Some(Population { name, count, shape, contact_spheres, material, mass_override, size, seed, motion, placement })
    }

    fn count(
        &mut self,
        written: Option<usize>,
        placement: &GrainPlacement,
        value: &PopulationText,
        span: &Range<usize>,
    ) -> Option<usize> {
        let implied = match placement {
            GrainPlacement::Packed(_) => {
                if written.is_none() && value.count.is_none() {
                    self.values.missing(Some(span), "count", "add `count = 30900`: how many grains are packed");
                }
                return written;
            }
            GrainPlacement::Bed(_) => return written,
            GrainPlacement::Lattice(lattice) => lattice.counts.iter().fold(1, |all: usize, &n| all.saturating_mul(n)),
            GrainPlacement::List(list) => list.len(),
        };
        if let (Some(count), Some(text)) = (written, &value.count)
            && count != implied
        {
            self.values
                .report
                .error(text.0.span.clone(), format!("`count` says {count}, the placement {implied}"))
                .label("the placement gives the number by itself")
                .help("leave out `count`");
        }
        Some(implied)
    }

    fn material_of(&mut self, value: &PopulationText, span: &Range<usize>, materials: &[Material]) -> String {
        let Some(text) = &value.material else {
            if let [only] = materials {
                return only.name.clone();
            }
            self.values.missing(
                Some(span),
                "material",
                "add `material = \"sand\"` and `[material.sand]` with its density",
            );
            return String::new();
        };
        let name = self.values.text(Some(text), "material").unwrap_or_default().to_owned();
        if !materials.iter().any(|material| material.name == name) {
            let meant = nearest(&name, materials.iter().map(|material| material.name.as_str()));
            self.values
                .report
                .error(span_of(text), format!("there is no material `{name}`"))
                .label(meant.map_or("not a material of this case".into(), |m| format!("did you mean `{m}`?")))
                .help(format!("add `[material.{name}]` with `density = \"2650 kg/m^3\"`"));
        }
        name
    }

    /// The mass that a literal preset gives the paper's own grain.
    fn paper_mass(&self, shape: &GrainShape) -> Option<Real> {
        match shape {
            GrainShape::Spheroid { diameter, length, .. } if [*diameter, *length] == PAPER_GRAIN => {
                self.defaults.paper_grain_mass
            }
            _ => None,
        }
    }

    fn shape(&mut self, At { value, span }: &At<ShapeText>) -> Option<GrainShape> {
        Some(match value {
            ShapeText::Sphere(s) => GrainShape::Sphere {
                diameter: self.values.required::<Length>(s.diameter.as_ref(), span, "diameter", Range1::Positive),
                refinement: self.values.whole(s.refinement.as_ref(), "refinement", 0).unwrap_or(2),
                volume: self.values.choice(s.volume.as_ref(), "volume", VolumeChoice::Preserve),
            },
            ShapeText::Spheroid(s) => GrainShape::Spheroid {
                diameter: self.values.required::<Length>(s.diameter.as_ref(), span, "diameter", Range1::Positive),
                length: self.values.required::<Length>(s.length.as_ref(), span, "length", Range1::Positive),
                rings: self.values.whole_up_to(s.rings.as_ref(), "rings", 1, MOST_DIVISIONS).unwrap_or(7),
                segments: self.values.whole_up_to(s.segments.as_ref(), "segments", 3, MOST_DIVISIONS).unwrap_or(6),
                volume: self.values.choice(s.volume.as_ref(), "volume", VolumeChoice::Inscribed),
            },
            ShapeText::Box(b) => {
                let size = self.values.required_vector::<Length>(b.size.as_ref(), span, "size");
                if size.min_element() <= 0.0 {
                    self.values.report.error(span.clone(), "a box needs three edges above zero").label("this shape");
                }
                GrainShape::Box { size }
            }
            ShapeText::Mesh(m) => {
                let unit = self.values.quantity::<Length>(m.unit.as_ref(), "unit", Range1::Positive, 1.0);
                let Some(file) = self.path(m.file.as_ref(), "file") else {
                    if m.file.is_none() {
                        self.values.missing(
                            Some(span),
                            "file",
                            "add `file = \"grain.msh\"`, a tetrahedral mesh of Gmsh",
                        );
                    }
                    return None;
                };
                GrainShape::Mesh { file, unit }
            }
        })
    }

    fn contact_spheres(&mut self, value: &PopulationText, shape: &GrainShape) -> ContactSphereChoice {
        const EXPECTED: &str = "\"shell(75)\", \"axis(9)\", \"single\" or \"file\"";
        let radius = self.values.optional::<Length>(value.sphere_radius.as_ref(), "sphere_radius", Range1::Positive);
        let spheroid = matches!(shape, GrainShape::Spheroid { .. });
        let sphere = matches!(shape, GrainShape::Sphere { .. });
        let call = self.values.call(value.contact_spheres.as_ref(), "contact_spheres", EXPECTED);
        let span = value.contact_spheres.as_ref().map_or(0..0, |call| call.0.span.clone());
        let default = match shape {
            GrainShape::Sphere { .. } => ContactSphereChoice::Single,
            GrainShape::Spheroid { diameter, length, .. } if length > diameter => ContactSphereChoice::Axis(9),
            _ => ContactSphereChoice::Shell { count: 75, radius },
        };
        let mut refuse = |title: &str, help: &str| {
            self.values.report.error(span.clone(), title).label(format!("expected {EXPECTED}")).help(help);
        };
        match call {
            None => default,
            Some(("shell", Some(count))) if count > MOST_ON_SHELL => {
                refuse(
                    "too many contact spheres",
                    &format!("a shell has {MOST_ON_SHELL} at most: 75 follow the paper's sand"),
                );
                default
            }
            Some(("axis", Some(count))) if count > MOST_ON_AXIS => {
                refuse(
                    "too many contact spheres",
                    &format!("an axis has {MOST_ON_AXIS} at most: 9 follow the paper's sand"),
                );
                default
            }
            Some(("shell", Some(count @ 1..))) => ContactSphereChoice::Shell { count, radius },
            Some(("axis", Some(n @ 1..))) if spheroid => ContactSphereChoice::Axis(n),
            Some(("axis", _)) => {
                refuse(
                    "spheres along the axis need a prolate spheroid and a count",
                    "`shell(75)` covers any closed shape",
                );
                default
            }
            Some(("single", None)) if sphere => ContactSphereChoice::Single,
            Some(("single", None)) => {
                refuse("a single contact sphere is for spheres", "`axis(9)` or `shell(75)` follow the shape");
                default
            }
            Some(("file", None)) => match self.path(value.sphere_file.as_ref(), "sphere_file") {
                Some(file) => {
                    let unit = value.sphere_file_unit.as_ref();
                    ContactSphereChoice::File {
                        file,
                        unit: self.values.quantity::<Length>(unit, "sphere_file_unit", Range1::Positive, 1.0),
                    }
                }
                None => {
                    self.values.missing(
                        Some(&span),
                        "sphere_file",
                        "add `sphere_file = \"spheres.txt\"`, lines `x y z r`",
                    );
                    default
                }
            },
            Some(_) => {
                refuse("no such builder of contact spheres", "for example `shell(75)`, as in the paper");
                default
            }
        }
    }
}

/// Centre of the box in x1 and x2 [m].
pub(super) fn middle(domain: &BoxDomain) -> [Real; 2] {
    let centre: Vector = 0.5 * (domain.lower + domain.upper);
    [centre.x, centre.y]
}
