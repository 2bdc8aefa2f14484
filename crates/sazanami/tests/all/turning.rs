//! Bodies that turn as prescribed in liquid that goes round with them: the flow and what holds them against it are steady.

use sazanami_numerics::Real;

use crate::support::{On, Scratch, ran};

/// A cylinder of 10 mm that turns about x3, along which the box is one cell thick, in a thick liquid.
const CYLINDER: &str = r#"
gravity = "0 m/s^2"
domain = { size = ["24 mm", "24 mm", "1 mm"], cells = [24, 24, 1] }
boundary = { all = "no_slip", x3 = "slip" }
fluid.liquid = { density = "1000 kg/m^3", dynamic_viscosity = "0.1 Pa s" }
material.m.density = "1000 kg/m^3"
output = { fields = { at = [] }, figures = { at = [] }, grains = { at = [] } }
run.until = "0.7 s"

[[liquid]]
allow_touching_grains = true
region.box = { lower = ["-1 m", "-1 m", "-1 m"], upper = ["1 m", "1 m", "1 m"] }

[[grains]]
motion = "prescribed"
shape.cylinder = { diameter = "10 mm", length = "1 mm" }
placement.list = [{ position = ["12 mm", "12 mm", "0.5 mm"], axis = [0, 1, 0], angle = "-90 deg", angular_velocity = ["0 rad/s", "0 rad/s", "1 rad/s"] }]

[[probe]]
name = "body"
body.index = 0
steps = 2
"#;

/// The same, that turns about x2.
const ABOUT_X2: [&str; 3] = [
    "domain={ size = [\"24 mm\", \"1 mm\", \"24 mm\"], cells = [24, 1, 24] }",
    "boundary={ all = \"no_slip\", x2 = \"slip\" }",
    "grains.0.placement.list=[{ position = [\"12 mm\", \"0.5 mm\", \"12 mm\"], axis = [0, 0, 1], angle = \"90 deg\", angular_velocity = [\"0 rad/s\", \"1 rad/s\", \"0 rad/s\"] }]",
];

#[test]
fn the_torque_on_a_cylinder_that_turns_steadily_is_steady() {
    let scratch = Scratch::new("turning");
    // Least and largest torque [N m] after the start, against the turn.
    let torque = |name: &str, overrides: &[&str], column: &str| {
        let left = ran(CYLINDER, overrides, &scratch.join(name), On::threads(1));
        let probe = left.probe("body");
        let (time, torque) = (probe.column("time"), probe.column(column));
        let later: Vec<Real> =
            time.iter().zip(torque).filter(|(time, _)| **time > 0.3).map(|(_, torque)| -torque).collect();
        assert!(later.len() > 100, "{}", later.len());
        [later.iter().copied().fold(Real::INFINITY, Real::min), later.iter().copied().fold(0.0, Real::max)]
    };
    let (fine, x2) = (&["coupling.columns=32"][..], &ABOUT_X2[..]);
    for (name, overrides, column) in
        [("x3", &[][..], "fluid_torque_3"), ("x3-fine", fine, "fluid_torque_3"), ("x2", x2, "fluid_torque_2")]
    {
        // 3.69e-8 N m by the theory of a circle of the same mean width; the polygon goes round with its edges.
        let [least, most] = torque(name, overrides, column);
        assert!(least > 0.9 * most && (3.5e-8..4.15e-8).contains(&most), "{name}: {least} {most}");
    }
}
