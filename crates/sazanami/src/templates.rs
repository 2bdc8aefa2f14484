//! Commented cases to start from.

use crate::case::nearest;
use crate::error::CommandError;

/// A commented case of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Template {
    /// Name, also that of its file.
    pub name: &'static str,
    /// One line on what happens in it.
    pub about: &'static str,
    /// The case file.
    pub text: &'static str,
}

/// All templates.
pub const TEMPLATES: [Template; 5] = [
    Template {
        name: "raindrop",
        about: "a drop hits a small bed of sand that is packed in the run",
        text: include_str!("../templates/raindrop.toml"),
    },
    Template {
        name: "settling_sphere",
        about: "a sphere settles in a box of liquid",
        text: include_str!("../templates/settling_sphere.toml"),
    },
    Template {
        name: "dam_break",
        about: "a column of water collapses against a few blocks",
        text: include_str!("../templates/dam_break.toml"),
    },
    Template {
        name: "packing",
        about: "grains of two kinds are packed, and their porosity measured",
        text: include_str!("../templates/packing.toml"),
    },
    Template {
        name: "shaken_tank",
        about: "a bed of spheres under water is shaken: ripples",
        text: include_str!("../templates/shaken_tank.toml"),
    },
];

/// The template of a name.
///
/// # Errors
/// If there is none.
pub fn template(name: &str) -> Result<&'static Template, CommandError> {
    TEMPLATES.iter().find(|template| template.name == name).ok_or_else(|| {
        let known = TEMPLATES.map(|template| template.name);
        let help = match nearest(name, known) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("templates: {}", known.join(", ")),
        };
        CommandError::input(format!("there is no template `{name}`"), help)
    })
}
