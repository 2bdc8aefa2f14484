//! Keys and words of earlier versions that no case can have any more, and what took their place.

use sazanami_dem::TangentialForce;
use sazanami_numerics::Real;
use sazanami_numerics::choice::Choice;
use toml::de::{DeTable, DeValue};

/// What is said of parts of the published scheme of moving particles.
const OF_PUBLISHED: &str =
    "the default, `projection = \"conjugate\"`, has none, and `\"enhanced\"` has it as published; leave the key out";

/// What is said of parts of the tangential force of a contact.
const TANGENTIAL: &str = "`tangential_force` chooses the force as a whole: `from_touch` for `force`, `length_kept`, `touch`; `published` for `velocity`, `projected`, `sub_step`; mixtures are gone";

/// Path of a key without positions in lists, the word that went (`None`: the key went), and what a case does instead; sorted
/// by path and word.
const REMOVED: &[(&str, Option<&str>, &str)] = &[
    (
        "contact.damping",
        None,
        "coefficients (`normal_damping`) or a `restitution` say which dashpot is meant; where `restitution` stood here alone, write `restitution = 0.5`",
    ),
    (
        "coupling.alpha",
        None,
        "covered volumes are those of n x n columns a cell, `columns = 4` for `columns(4)`; `clip`, exact and dear, has no successor: more columns come near it",
    ),
    ("coupling.exchange", Some("auto"), "`surface`, the default, serves grains of any width; leave the key out"),
    (
        "coupling.exchange",
        Some("exact"),
        "`surface`, the default, keeps momentum too and hides no liquid in grains; leave the key out",
    ),
    (
        "coupling.friction",
        None,
        "friction is that of the hydraulic radius and the slip, `hydraulic_radius_slip` before; leave the key out",
    ),
    (
        "coupling.room",
        None,
        "liquid has the open part of the cells, with `exchange = \"stress\"` whole cells; leave the key out",
    ),
    ("coupling.torque_arm", None, "a force acts at the centroid of the covered part of its cell; leave the key out"),
    ("coupling.weighting", None, "grain and fluid in a shared cell count by their mass; leave the key out"),
    ("dem.contact_start", None, TANGENTIAL),
    (
        "dem.damping",
        None,
        "coefficients or the restitution of a contact say which dashpot is meant; for `restitution` write `contact.default.restitution`, 0.5 where none stood",
    ),
    ("dem.history", None, TANGENTIAL),
    ("dem.multiplicity", None, "all spheres of a pair that touch act in full; leave the key out"),
    ("dem.rolling", None, "a `rolling_friction` above 0 resists rolling, one of 0 does not; leave the key out"),
    ("dem.slip_direction", None, TANGENTIAL),
    (
        "fluid.carrying_flow",
        Some("rotation"),
        "choose `reversed_vortex` or `deformation`, which bring a shape back as well, or `uniform`",
    ),
    ("fluid.limiter", None, "velocities on faces are of third order, without a limiter; leave the key out"),
    ("fluid.projection", None, "the key is `pressure_form`, with the same words"),
    ("fluid.vof", None, "liquid is carried by a plane in every cell, `plic` before; leave the key out"),
    ("grains.placement.packed.height", None, "the lattice is as high as its grains need; leave the key out"),
    ("overlap.density_reference", None, "phi is 1 for touching spheres on a simple cubic lattice; leave the key out"),
    ("overlap.exchange", None, "the key is `drag_integration`, with `explicit` for `lagged`"),
    ("overlap.pressure_force", None, "grains feel the pressure of the same step; leave the key out"),
    ("overlap.reach", None, "grains read the water within `overlap.smoothing`; leave the key out"),
    (
        "overlap.sphere_drag",
        None,
        "single spheres have the drag of Schiller and Naumann; for that of Dalla Valle choose `drag = \"di_felice\"`",
    ),
    ("particles.compensation", None, OF_PUBLISHED),
    ("particles.gradient", None, OF_PUBLISHED),
    ("particles.laplacian", None, OF_PUBLISHED),
    (
        "particles.reduced_pressure",
        None,
        "`enhanced` splits the pressure at rest off, `conjugate` does not; leave the key out",
    ),
    (
        "particles.relaxation",
        None,
        "an error of the number density relaxes over 100 times of the flow; leave the key out",
    ),
    (
        "particles.shifting",
        None,
        "`projection = \"conjugate\"`, the default, shifts by the rate of strain; leave the key out",
    ),
    (
        "particles.shifting_form",
        None,
        "`projection = \"conjugate\"`, the default, shifts by the rate of strain; leave the key out",
    ),
    ("particles.source", None, OF_PUBLISHED),
    (
        "particles.stabilisation",
        None,
        "`projection = \"enhanced\"` is stabilised as published, `conjugate` needs no stabilisation; leave the key out",
    ),
    (
        "particles.stabilisation_distance",
        None,
        "`projection = \"enhanced\"` is stabilised as published, `conjugate` needs no stabilisation; leave the key out",
    ),
    ("particles.surface_pressure", None, OF_PUBLISHED),
    ("particles.surface_test", None, OF_PUBLISHED),
    ("particles.weight", None, "the weight is Wendland's C2; leave the key out"),
    ("ripples.image_side", None, "the bed is measured across the whole tank, from no side; leave the key out"),
    (
        "ripples.layers",
        Some("initial"),
        "layers follow the grains: choose `floor`, or `surface` for those below the surface of the bed",
    ),
];

/// Whether `word` at the key `name` that went, of the table at `path`, is what the case has without it: the copies that earlier versions
/// wrote have such keys. `published` says whether the preset has the forms of Yagyu et al.
pub(crate) fn is_kept(path: &str, name: &str, word: &str, table: &DeTable<'_>, published: bool) -> bool {
    let has = |keys: [&str; 2]| keys.iter().any(|key| table.contains_key(*key));
    let [coefficients, ratios] = [["normal_damping", "tangential_damping"], ["restitution", "damping_ratio"]].map(has);
    let value = |key: &str| table.get(key).map(|value| value.get_ref());
    let published = match value("tangential_force") {
        Some(DeValue::String(form)) => form == TangentialForce::Published.word(),
        _ => published,
    };
    let rolling: Option<Real> = value("rolling_friction").and_then(|value| match value {
        DeValue::Integer(number) => number.as_str().parse().ok(),
        DeValue::Float(number) => number.as_str().parse().ok(),
        _ => None,
    });
    match (path.split('.').next().unwrap_or(path), name, word) {
        ("coupling", "alpha", "columns(4)") | ("fluid", "vof", "plic") => true,
        ("overlap", "exchange", "lagged") => !table.contains_key("drag_integration"),
        ("fluid", "projection", "full") => !published && !table.contains_key("pressure_form"),
        ("fluid", "projection", "incremental") => published && !table.contains_key("pressure_form"),
        ("contact", "damping", "literal") => coefficients && !ratios,
        ("contact", "damping", "restitution") => ratios && !coefficients,
        ("dem", "contact_start", "touch") | ("dem", "history", "length_kept") | ("dem", "slip_direction", "force") => {
            !published
        }
        ("dem", "contact_start", "sub_step")
        | ("dem", "history", "projected")
        | ("dem", "slip_direction", "velocity") => published,
        ("dem", "rolling", "none") => rolling.is_none_or(|rolling| rolling == 0.0),
        ("dem", "rolling", "constant_torque") => rolling.is_some(),
        _ => false,
    }
}

/// What a case does instead of the key at `path`, or of its word, where an earlier version had it.
pub(crate) fn instead_of(path: &str, word: Option<&str>) -> Option<&'static str> {
    let names: Vec<&str> = path.split('.').filter(|name| name.parse::<usize>().is_err()).collect();
    let path = match names[..] {
        // Contacts go by names of the user's choice.
        ["contact", .., key] => format!("contact.{key}"),
        _ => names.join("."),
    };
    REMOVED.iter().find(|row| row.0 == path && row.1 == word).map(|row| row.2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::declared;
    use crate::key::ValueDoc;

    #[test]
    fn what_was_removed_is_sorted_and_gone() {
        assert!(REMOVED.is_sorted_by_key(|row| (row.0, row.1)));
        for (path, word, _) in REMOVED {
            let key = declared(&path.split('.').collect::<Vec<_>>());
            match (word, key.map(|key| key.value)) {
                (None, key) => assert!(key.is_none(), "{path} is there"),
                (Some(word), Some(ValueDoc::Words(words))) => {
                    assert!(words.iter().all(|(known, _)| known != word), "{path} has the word {word}");
                }
                // Words with a count in brackets: the parser of the key knows them.
                (Some(_), key) => assert!(key.is_some(), "{path} is no key: its words went with it"),
            }
        }
    }

    #[test]
    fn paths_may_have_positions_of_lists() {
        let (path, word, instead) = REMOVED[0];
        let (table, key) = path.split_once('.').unwrap();
        assert_eq!(instead_of(&format!("{table}.3.{key}"), word), Some(instead));
        assert_eq!(instead_of(path, Some("no such word")), None);
        assert_eq!(instead_of("overlap.drag", None), None);
    }
}
