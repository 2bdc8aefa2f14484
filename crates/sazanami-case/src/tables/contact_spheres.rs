//! Contact spheres of a population: four keys of `[[grains]]`.

use std::path::PathBuf;

use sazanami_case_derive::Keys;
use sazanami_numerics::Real;

use super::GrainShape;
use crate::read::{Context, Table};
use crate::value::split_call;

/// Most contact spheres of a shell: to spread them takes time as the square of their number, and far fewer follow any
/// grain.
pub const MOST_ON_SHELL: usize = 1000;
/// Most contact spheres along an axis.
const MOST_ON_AXIS: usize = 1000;
/// Forms that can be written.
const EXPECTED: &str = "expected \"shell(75)\", \"axis(9)\", \"single\" or \"file\"";

/// Cover of the surface of grains by spheres that touch.
#[derive(Clone, Debug, Default, Keys)]
pub(super) struct ContactSphereKeys {
    /// `shell(n)`: equal spheres under the surface of any closed shape, 1000 at most; `axis(n)`: largest spheres on the
    /// long axis of a spheroid or a cylinder, 1000 at most (a cylinder that rolls on a shell rolls as a polygon); `single`: for
    /// spheres; `file`: as `sphere_file` has them.
    #[key(says = "sphere: `single`; prolate spheroid: `axis(9)`; else `shell(75)`")]
    contact_spheres: Option<String>,
    /// Radius of the spheres of a shell.
    #[key(unit = "m", range = Positive, says = "by rule")]
    sphere_radius: Option<Real>,
    /// File of contact spheres, lines `x y z r` in the frame of the mesh; that of other shapes has its origin in their centre.
    sphere_file: Option<PathBuf>,
    /// Length of that file's unit.
    #[key(unit = "m", range = Positive, meant = 1.0)]
    sphere_file_unit: Option<Real>,
}

/// Contact spheres of a grain.
#[derive(Clone, Debug, PartialEq)]
pub enum ContactSphereChoice {
    /// Equal spheres under the surface; the radius \[m] by rule if not given.
    Shell {
        /// Number of spheres.
        count: usize,
        /// Radius \[m].
        radius: Option<Real>,
    },
    /// Largest spheres along the long axis of a spheroid or a cylinder.
    Axis(usize),
    /// One sphere.
    Single,
    /// A list `x y z r` in a file, in the frame of the mesh.
    File {
        /// The file.
        file: PathBuf,
        /// Length of the file's unit \[m].
        unit: Real,
    },
}

impl ContactSphereKeys {
    /// Their meaning for a shape; errors are reported.
    pub(super) fn meaning(self, shape: &GrainShape, table: &Table<'_>, cx: &mut Context<'_>) -> ContactSphereChoice {
        let radius = self.sphere_radius;
        let default = match shape {
            GrainShape::Sphere { .. } => ContactSphereChoice::Single,
            GrainShape::Spheroid { diameter, length, .. } if length > diameter => ContactSphereChoice::Axis(9),
            _ => ContactSphereChoice::Shell { count: 75, radius },
        };
        let chosen = if self.contact_spheres.is_some() { self.chosen(shape, table, cx) } else { Some(default.clone()) };
        let Some(choice) = chosen else { return default };
        let of_file = matches!(choice, ContactSphereChoice::File { .. });
        let of_shell = matches!(choice, ContactSphereChoice::Shell { .. });
        for (key, is_used, help) in [
            ("sphere_file", of_file, "add `contact_spheres = \"file\"`, or leave it out"),
            ("sphere_file_unit", of_file, "it is for `contact_spheres = \"file\"`: leave it out"),
            ("sphere_radius", of_shell, "it is for `contact_spheres = \"shell(75)\"`: leave it out"),
        ] {
            if table.has(key) && !is_used {
                cx.report
                    .error(table.place(key), format!("`{key}` does nothing with these contact spheres"))
                    .help(help);
            }
        }
        choice
    }

    /// What `contact_spheres` asks for; `None` if it is refused.
    fn chosen(self, shape: &GrainShape, table: &Table<'_>, cx: &mut Context<'_>) -> Option<ContactSphereChoice> {
        let (span, radius) = (table.place("contact_spheres"), self.sphere_radius);
        let has_axis = matches!(shape, GrainShape::Spheroid { .. } | GrainShape::Cylinder { .. });
        let refused: (&str, String) = match split_call(self.contact_spheres.as_deref()?) {
            None => {
                cx.report.error(span, "`contact_spheres` cannot be read").label(EXPECTED);
                return None;
            }
            Some(("shell", Some(count))) if count > MOST_ON_SHELL => {
                ("too many contact spheres", format!("a shell has {MOST_ON_SHELL} at most: 75 follow the paper's sand"))
            }
            Some(("axis", Some(count))) if count > MOST_ON_AXIS => {
                ("too many contact spheres", format!("an axis has {MOST_ON_AXIS} at most: 9 follow the paper's sand"))
            }
            Some(("shell", Some(count @ 1..))) => return Some(ContactSphereChoice::Shell { count, radius }),
            Some(("axis", Some(n @ 1..))) if has_axis => return Some(ContactSphereChoice::Axis(n)),
            Some(("axis", _)) => (
                "spheres along the axis need a prolate spheroid or a cylinder, and a count",
                "`shell(75)` covers any closed shape".into(),
            ),
            Some(("single", None)) if matches!(shape, GrainShape::Sphere { .. }) => {
                return Some(ContactSphereChoice::Single);
            }
            Some(("single", None)) => {
                ("a single contact sphere is for spheres", "`axis(9)` or `shell(75)` follow the shape".into())
            }
            Some(("file", None)) => {
                let Some(file) = self.sphere_file else {
                    let help = "add `sphere_file = \"spheres.txt\"`, lines `x y z r`";
                    cx.missing(Some(span), "sphere_file", help);
                    return None;
                };
                return Some(ContactSphereChoice::File { file, unit: self.sphere_file_unit.unwrap_or(1.0) });
            }
            Some(_) => ("no such builder of contact spheres", "for example `shell(75)`, as in the paper".into()),
        };
        cx.report.error(span, refused.0).label(EXPECTED).help(refused.1);
        None
    }

    pub(super) fn of(choice: &ContactSphereChoice) -> Self {
        let called = |text: String| Self { contact_spheres: Some(text), ..Self::default() };
        match choice {
            ContactSphereChoice::Shell { count, radius } => {
                Self { sphere_radius: *radius, ..called(format!("shell({count})")) }
            }
            ContactSphereChoice::Axis(count) => called(format!("axis({count})")),
            ContactSphereChoice::Single => called("single".into()),
            ContactSphereChoice::File { file, unit } => {
                Self { sphere_file: Some(file.clone()), sphere_file_unit: Some(*unit), ..called("file".into()) }
            }
        }
    }
}
