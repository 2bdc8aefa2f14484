//! `[material.NAME]` and `[contact."A/B"]`: what grains are made of and how they touch.

use std::ops::Range;

use sazanami_case_derive::Keys;
use sazanami_dem::{Damping, LinearSpringDashpot};
use sazanami_numerics::Real;

use crate::key::{Keys, TableDoc};
use crate::read::{At, Context};
use crate::suggest::nearest;
use crate::write::{Entries, Paths, Show, Written, as_key, quoted};

/// Name of the box among the materials of a contact.
pub const WALL: &str = "wall";

/// Properties of a contact of which the case says nothing.
const SAND: LinearSpringDashpot = LinearSpringDashpot::SAND;
/// Restitution where a case gives the ratio of the dashpots alone.
const RESTITUTION: Real = 0.5;

/// Material of grains.
#[derive(Clone, Debug, PartialEq, Keys)]
pub struct Material {
    /// Name.
    #[key(skip = table.at().path.split_once('.').map_or_else(String::new, |(_, name)| name.to_owned()))]
    pub name: String,
    /// Density.
    #[key(unit = "kg/m^3", range = Positive)]
    pub density: Real,
}

/// The materials of a case: a table for each name.
pub type Materials = Vec<Material>;

impl Keys for Materials {
    fn docs() -> TableDoc {
        Material::docs()
    }

    fn read(at: &At<'_>, cx: &mut Context<'_>) -> Option<Self> {
        let mut materials = Vec::new();
        for (name, span, at) in cx.named(at) {
            if name == WALL || name == "default" || name.contains('/') {
                cx.report
                    .error(span, format!("a material cannot be called `{name}`"))
                    .label("this name is reserved in `[contact]`")
                    .help("choose another name");
            }
            materials.extend(Material::read(&at, cx));
        }
        Some(materials)
    }

    fn write(&self, style: Paths) -> Written {
        let mut entries = Entries::default();
        for material in self {
            entries.push(&quoted(&material.name), material.write(style), Show::Table);
        }
        Written::Table(entries)
    }
}

/// Contact of a pair of materials; what it leaves open is taken from `[contact.default]`.
#[derive(Clone, Debug, Default, Keys)]
struct ContactKeys {
    #[key(skip = table.span())]
    span: Range<usize>,
    /// Stiffness along the normal, per contact of two spheres.
    #[key(unit = "N/m", range = Positive, meant = SAND.normal_stiffness)]
    normal_stiffness: Option<Real>,
    /// Stiffness along the tangent.
    #[key(unit = "N/m", range = Positive, says = "as along the normal")]
    tangential_stiffness: Option<Real>,
    /// Coefficient of the dashpot along the normal; the dashpot is given by coefficients or by a restitution.
    #[key(unit = "N s/m", range = NonNegative, meant = LinearSpringDashpot::SAND_DASHPOT)]
    normal_damping: Option<Real>,
    /// Coefficient of the dashpot along the tangent.
    #[key(unit = "N s/m", range = NonNegative, says = "as along the normal")]
    tangential_damping: Option<Real>,
    /// Restitution coefficient, in place of the dashpot's coefficients: it follows from this and the grains' masses. It
    /// is that of a single contact: a body that touches with N contact spheres at once is damped as by sqrt(N) such dashpots, and rebounds
    /// less. The default is for
    /// contacts with `damping_ratio` alone.
    #[key(range = Between(1e-3, 1.0), meant = RESTITUTION)]
    restitution: Option<Real>,
    /// Tangential dashpot over the normal one, where a restitution gives that.
    #[key(range = NonNegative, says = "sqrt(K_t/K_n), the ratio to critical damping being the same along both")]
    damping_ratio: Option<Real>,
    /// Friction coefficient.
    #[key(range = Between(0.0, 10.0), meant = SAND.friction)]
    friction: Option<Real>,
    /// Whether a separating contact may pull.
    #[key(says = "`dem.tension`")]
    tension: Option<bool>,
}

/// Contact law of the materials `a` and `b`.
#[derive(Clone, Debug, PartialEq)]
pub struct PairContact {
    /// One material.
    pub a: String,
    /// The other, or [`WALL`].
    pub b: String,
    /// Their contact law, with what `[dem]` says of all contacts.
    pub law: LinearSpringDashpot,
}

/// Contact of every pair of materials that can meet, walls included: a table for each.
pub type Contacts = Vec<PairContact>;

impl Keys for Contacts {
    fn docs() -> TableDoc {
        ContactKeys::docs()
    }

    fn read(at: &At<'_>, cx: &mut Context<'_>) -> Option<Self> {
        let named = cx.named(at);
        let mut given = Vec::new();
        for (name, span, at) in named {
            check_name(&name, span.clone(), cx);
            let turned = name.split_once('/').map(|(a, b)| format!("{b}/{a}"));
            if given.iter().any(|(known, _)| Some(known) == turned.as_ref()) {
                cx.report
                    .error(span, format!("`{name}` is given twice"))
                    .label(format!("as `{}` too", turned.unwrap_or_default()))
                    .help("put the keys of both into one table");
            }
            if let Some(keys) = ContactKeys::read(&at, cx) {
                given.push((name, keys));
            }
        }
        let names: Vec<String> = cx.known.materials.iter().map(|material| material.name.clone()).collect();
        let mut contacts = Vec::new();
        for (n, a) in names.iter().enumerate() {
            for b in &names[n..] {
                let law = law_of(&given, &[[a, b]], cx);
                contacts.push(PairContact { a: a.clone(), b: b.clone(), law });
            }
            let law = law_of(&given, &[[a, WALL], [a, a]], cx);
            contacts.push(PairContact { a: a.clone(), b: WALL.into(), law });
        }
        Some(contacts)
    }

    fn write(&self, style: Paths) -> Written {
        let mut entries = Entries::default();
        for pair in self {
            let keys = ContactKeys::of(&pair.law);
            entries.push(&quoted(&format!("{}/{}", pair.a, pair.b)), keys.write(style), Show::Table);
        }
        Written::Table(entries)
    }
}

fn check_name(pair: &str, span: Range<usize>, cx: &mut Context<'_>) {
    if pair == "default" {
        return;
    }
    let Some((a, b)) = pair.split_once('/') else {
        cx.report
            .error(span, format!("`{pair}` is no pair of materials"))
            .label("expected two names with a slash between")
            .help("for example `[contact.\"sand/sand\"]` or `[contact.\"sand/wall\"]`");
        return;
    };
    if [a, b] == [WALL; 2] {
        cx.report
            .error(span, "walls do not touch walls")
            .label("a pair of materials, or a material and the walls")
            .help("for example `[contact.\"sand/wall\"]`");
        return;
    }
    for side in [a, b] {
        let known: Vec<&str> = cx.known.materials.iter().map(|material| material.name.as_str()).collect();
        if side != WALL && !known.contains(&side) {
            let meant = nearest(side, known);
            cx.report
                .error(span.clone(), format!("there is no material `{side}`"))
                .label(meant.map_or("not a material of this case".into(), |m| format!("did you mean `{m}`?")))
                .help(format!("add `[material.{}]` with its density", as_key(side)));
        }
    }
}

/// The law of the first of these pairs; what it leaves open is taken from the next that the case gives, and from `default` in
/// the end.
fn law_of(given: &[(String, ContactKeys)], pairs: &[[&str; 2]], cx: &mut Context<'_>) -> LinearSpringDashpot {
    let named = |wanted: String| given.iter().find(|(name, _)| *name == wanted).map(|(_, keys)| keys);
    let pair = |[a, b]: &[&str; 2]| named(format!("{a}/{b}")).or_else(|| named(format!("{b}/{a}")));
    let layers: Vec<&ContactKeys> = pairs.iter().filter_map(pair).chain(named("default".into())).collect();
    let number = |of: fn(&ContactKeys) -> Option<Real>| layers.iter().find_map(|keys| of(keys));
    let normal = number(|keys| keys.normal_damping);
    let tangential = number(|keys| keys.tangential_damping);
    let restitution = number(|keys| keys.restitution);
    // The nearest that says anything of a dashpot says which.
    let coefficients = |keys: &ContactKeys| keys.normal_damping.is_some() || keys.tangential_damping.is_some();
    let ratios = |keys: &ContactKeys| keys.restitution.is_some() || keys.damping_ratio.is_some();
    let nearest = layers.iter().find(|keys| coefficients(keys) || ratios(keys));
    if let Some(keys) = nearest.filter(|keys| coefficients(keys) && ratios(keys)) {
        cx.report
            .error(keys.span.clone(), "which of the two dashpots is meant?")
            .label("this contact has coefficients and a restitution")
            .help("leave out `normal_damping` and `tangential_damping`, or `restitution` and `damping_ratio`");
    }
    let damping = match nearest.is_some_and(|keys| ratios(keys)) {
        false => {
            let normal = normal.unwrap_or(LinearSpringDashpot::SAND_DASHPOT);
            Damping::Literal { normal, tangential: tangential.unwrap_or(normal) }
        }
        true => {
            let restitution = restitution.unwrap_or(RESTITUTION);
            match number(|keys| keys.damping_ratio) {
                Some(tangential) => Damping::RestitutionAndRatio { restitution, tangential },
                None => Damping::Restitution(restitution),
            }
        }
    };
    let normal_stiffness = number(|keys| keys.normal_stiffness).unwrap_or(SAND.normal_stiffness);
    let dem = &cx.known.dem;
    LinearSpringDashpot {
        normal_stiffness,
        tangential_stiffness: number(|keys| keys.tangential_stiffness).unwrap_or(normal_stiffness),
        damping,
        friction: number(|keys| keys.friction).unwrap_or(SAND.friction),
        tension: layers.iter().find_map(|keys| keys.tension).unwrap_or(dem.tension),
        tangential_force: dem.tangential_force,
        rolling_friction: dem.rolling_friction,
    }
}

impl ContactKeys {
    fn of(law: &LinearSpringDashpot) -> Self {
        let same = Self {
            normal_stiffness: Some(law.normal_stiffness),
            tangential_stiffness: Some(law.tangential_stiffness),
            friction: Some(law.friction),
            tension: Some(law.tension),
            ..Self::default()
        };
        match law.damping {
            Damping::Literal { normal, tangential } => {
                Self { normal_damping: Some(normal), tangential_damping: Some(tangential), ..same }
            }
            Damping::Restitution(coefficient) => Self { restitution: Some(coefficient), ..same },
            Damping::RestitutionAndRatio { restitution, tangential } => {
                Self { restitution: Some(restitution), damping_ratio: Some(tangential), ..same }
            }
        }
    }
}
