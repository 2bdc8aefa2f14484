//! The resolved copy: a case file that says everything, in SI units, and is itself a case with the
//! same meaning.

mod particles;

use std::fmt::Write as _;
use std::path::Path;

use sazanami_numerics::{Real, Vector};

use super::meaning::{
    AlphaMethod, BedFile, BoundarySide, Case, ContactSphereChoice, Damping, Grain, GrainPlacement, GrainShape,
    LatticePlacement, LiquidRegion, Packing, Placement, Population, Probe, ProbePlace, Region, SIDE_NAMES, Schedule,
    SizeDistribution, Step, Substeps,
};
use super::written::ChoiceSet;

/// How file names are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paths {
    /// From the root: the copy may lie anywhere.
    Absolute,
    /// As the case has them.
    AsGiven,
    /// Without folders: the same for every place the case lies in (used for its hash).
    NameOnly,
}

/// The case as text.
#[must_use]
pub fn write(case: &Case, paths: Paths) -> String {
    let mut writer = Writer { text: String::new(), paths };
    writer.line("# The case as run: resolved, every default, SI units.");
    writer.text("name", &case.name);
    writer.text("title", &case.title);
    writer.word("preset", case.preset);
    writer.word("solver", case.solver);
    writer.vector("gravity", case.gravity, "m/s^2");
    writer.table("domain");
    writer.vector("lower", case.domain.lower, "m");
    writer.vector("upper", case.domain.upper, "m");
    writer.raw("cells", &format!("{:?}", case.domain.cells));
    writer.table("boundary");
    for (names, sides) in SIDE_NAMES.iter().zip(&case.boundary) {
        for (name, side) in names.iter().zip(sides) {
            let side = writer.side(side);
            writer.raw(name, &side);
        }
    }
    writer.frame(case);
    writer.fluids(case);
    writer.coupling(case);
    writer.particles(case);
    for liquid in &case.liquids {
        writer.liquid(liquid);
    }
    writer.dem(case);
    writer.materials(case);
    for population in &case.grains {
        writer.population(population);
    }
    writer.observed(case);
    writer.text
}

/// Hash of the meaning of a case: the same wherever it lies and however it was written.
#[must_use]
pub fn hash(case: &Case) -> u64 {
    xxhash_rust::xxh3::xxh3_64(write(case, Paths::NameOnly).as_bytes())
}

/// The same in the form in which it is written.
#[must_use]
pub fn hash_text(case: &Case) -> String {
    hex(hash(case))
}

fn hex(hash: u64) -> String {
    format!("{hash:016x}")
}

/// Keys whose value is the name of a file.
const FILES: [&str; 7] = ["file", "sphere_file", "recipe", "state", "bed", "water", "shape.mesh.file"];

/// Hash of the meaning that a resolved copy had for the program which wrote it, by its text alone: that of [`hash`],
/// whatever keys programs have come to know since.
#[must_use]
pub fn hash_of_copy(text: &str) -> u64 {
    let lines = text.lines().map(|line| name_only(line).unwrap_or_else(|| line.to_owned()) + "\n");
    xxhash_rust::xxh3::xxh3_64(lines.collect::<String>().as_bytes())
}

/// A line of a resolved copy that names a file, without its folder; `None` for another line.
fn name_only(line: &str) -> Option<String> {
    let (key, value) = line.split_once(" = ").filter(|(key, _)| FILES.contains(key))?;
    let toml::Value::String(path) = value.parse().ok()? else { return None };
    Some(format!("{key} = {}", quoted(Path::new(&path).file_name()?.to_str()?)))
}

/// Whether the case of `loaded` is the one whose hash was written down as `hash`: by its meaning, or as the copy that
/// an older program wrote.
#[must_use]
pub fn has_hash(loaded: &super::LoadedCase, hash: &str) -> bool {
    [self::hash(&loaded.case), hash_of_copy(loaded.source.text())].iter().any(|&own| hex(own) == hash)
}

struct Writer {
    text: String,
    paths: Paths,
}

/// A text of TOML with what needs it escaped.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn quantity(value: Real, unit: &str) -> String {
    format!("\"{value:?} {unit}\"")
}

fn vector(value: Vector, unit: &str) -> String {
    format!("[{}, {}, {}]", quantity(value.x, unit), quantity(value.y, unit), quantity(value.z, unit))
}

impl Writer {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn table(&mut self, name: &str) {
        let _ = writeln!(self.text, "\n[{name}]");
    }

    fn element(&mut self, name: &str) {
        let _ = writeln!(self.text, "\n[[{name}]]");
    }

    fn raw(&mut self, key: &str, value: &str) {
        let _ = writeln!(self.text, "{key} = {value}");
    }

    fn text(&mut self, key: &str, value: &str) {
        self.raw(key, &quoted(value));
    }

    fn word<E: ChoiceSet>(&mut self, key: &str, value: E) {
        self.raw(key, &format!("\"{}\"", value.word()));
    }

    fn quantity(&mut self, key: &str, value: Real, unit: &str) {
        self.raw(key, &quantity(value, unit));
    }

    fn number(&mut self, key: &str, value: Real) {
        self.raw(key, &format!("{value:?}"));
    }

    fn vector(&mut self, key: &str, value: Vector, unit: &str) {
        self.raw(key, &vector(value, unit));
    }

    fn path(&mut self, key: &str, path: &Path) {
        let path = match self.paths {
            Paths::Absolute => std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
            Paths::AsGiven => path.to_owned(),
            Paths::NameOnly => path.file_name().map(Into::into).unwrap_or_default(),
        };
        self.text(key, &path.display().to_string());
    }

    fn side(&self, side: &BoundarySide) -> String {
        match side {
            BoundarySide::NoSlip => "\"no_slip\"".into(),
            BoundarySide::Slip => "\"slip\"".into(),
            BoundarySide::Periodic => "\"periodic\"".into(),
            BoundarySide::Outflow => "\"outflow\"".into(),
            BoundarySide::Moving { velocity } => {
                format!("{{ moving = {{ velocity = {} }} }}", vector(*velocity, "m/s"))
            }
            BoundarySide::Inflow { velocity, fluid } => {
                format!("{{ inflow = {{ velocity = {}, fluid = \"{fluid}\" }} }}", vector(*velocity, "m/s"))
            }
            BoundarySide::FixedPressure { pressure, fluid } => {
                format!("{{ fixed_pressure = {{ pressure = {}, fluid = \"{fluid}\" }} }}", quantity(*pressure, "Pa"))
            }
        }
    }

    fn frame(&mut self, case: &Case) {
        let Some(frame) = &case.frame else { return };
        self.table("frame");
        self.vector("acceleration", frame.acceleration, "m/s^2");
        if let Some(oscillation) = &frame.oscillation {
            self.table("frame.oscillation");
            self.vector("amplitude", oscillation.amplitude, "m/s^2");
            self.quantity("frequency", oscillation.frequency, "Hz");
            self.quantity("phase", oscillation.phase, "rad");
        }
        self.motion(frame);
    }

    fn fluids(&mut self, case: &Case) {
        let options = &case.fluid;
        self.table("fluid");
        self.word("vof", options.vof);
        self.word("convection", options.convection);
        self.word("limiter", options.limiter);
        self.word("projection", options.projection);
        self.word("viscosity", options.viscosity);
        match options.step {
            Step::Fixed(dt) => self.quantity("dt", dt, "s"),
            Step::Adaptive { longest, first, growth } => {
                self.quantity("dt_max", longest, "s");
                self.quantity("dt_first", first, "s");
                self.number("dt_growth", growth);
            }
        }
        self.number("cfl", options.cfl);
        self.number("tol_div", options.divergence_tolerance);
        self.raw("pressure_iterations", &options.pressure_iterations.to_string());
        for (name, fluid) in [("liquid", case.fluids.liquid), ("gas", case.fluids.gas)] {
            self.table(&format!("fluid.{name}"));
            self.quantity("density", fluid.density, "kg/m^3");
            self.quantity("dynamic_viscosity", fluid.viscosity, "Pa s");
        }
    }

    fn coupling(&mut self, case: &Case) {
        self.table("coupling");
        self.word("exchange", case.coupling.exchange);
        self.word("weighting", case.coupling.weighting);
        let alpha = match case.coupling.alpha {
            AlphaMethod::Columns(n) => format!("columns({n})"),
            AlphaMethod::SubCells(n) => format!("subcell({n})"),
            AlphaMethod::Clip => "clip".into(),
        };
        self.text("alpha", &alpha);
        self.word("torque_arm", case.coupling.torque_arm);
    }

    fn liquid(&mut self, liquid: &LiquidRegion) {
        self.element("liquid");
        self.text("name", &liquid.name);
        self.word("fluid", liquid.fluid);
        self.raw("region", &region(&liquid.region));
        match liquid.placement {
            Placement::Absolute(position) => self.vector("position", position, "m"),
            Placement::AboveBed { height, to_bottom, offset } => {
                self.quantity(if to_bottom { "gap_above_bed" } else { "above_bed" }, height, "m");
                self.raw("offset", &format!("[{}, {}]", quantity(offset[0], "m"), quantity(offset[1], "m")));
            }
        }
        self.vector("velocity", liquid.velocity, "m/s");
        self.word("drop_velocity", liquid.drop_velocity);
        self.raw("allow_touching_grains", &liquid.allow_touching_grains.to_string());
    }

    fn dem(&mut self, case: &Case) {
        let dem = &case.dem;
        self.table("dem");
        match dem.substeps {
            Substeps::Auto => self.text("substeps", "auto"),
            Substeps::Fixed(n) => self.raw("substeps", &n.to_string()),
        }
        self.word("multiplicity", dem.multiplicity);
        self.word("slip_direction", dem.slip_direction);
        self.word("history", dem.history);
        self.word("rolling", dem.rolling);
        self.number("rolling_friction", dem.rolling_friction);
        self.word("wall", dem.wall);
        let walls: Vec<String> = (0..3)
            .flat_map(|d| [(d, 0), (d, 1)])
            .filter(|&(d, upper)| dem.grain_walls[d][upper])
            .map(|(d, upper)| format!("\"{}\"", SIDE_NAMES[d][upper]))
            .collect();
        self.raw("grain_walls", &format!("[{}]", walls.join(", ")));
    }

    fn materials(&mut self, case: &Case) {
        for material in &case.materials {
            self.table(&format!("material.{}", quoted(&material.name)));
            self.quantity("density", material.density, "kg/m^3");
        }
        for pair in &case.contacts {
            self.table(&format!("contact.{}", quoted(&format!("{}/{}", pair.a, pair.b))));
            self.quantity("normal_stiffness", pair.law.normal_stiffness, "N/m");
            self.quantity("tangential_stiffness", pair.law.tangential_stiffness, "N/m");
            match pair.law.damping {
                Damping::Literal { normal, tangential } => {
                    self.text("damping", "literal");
                    self.quantity("normal_damping", normal, "N s/m");
                    self.quantity("tangential_damping", tangential, "N s/m");
                }
                Damping::Restitution(e) => {
                    self.text("damping", "restitution");
                    self.number("restitution", e);
                }
            }
            self.number("friction", pair.law.friction);
            self.raw("tension", &pair.law.tension.to_string());
        }
    }

    fn population(&mut self, population: &Population) {
        self.element("grains");
        self.text("name", &population.name);
        if let Some(count) = population.count {
            self.raw("count", &count.to_string());
        }
        self.text("material", &population.material);
        self.raw("seed", &population.seed.to_string());
        self.word("motion", population.motion);
        if let Some(mass) = population.mass_override {
            self.quantity("mass_override", mass, "kg");
        }
        match &population.contact_spheres {
            ContactSphereChoice::Shell { count, radius } => {
                self.text("contact_spheres", &format!("shell({count})"));
                if let Some(radius) = radius {
                    self.quantity("sphere_radius", *radius, "m");
                }
            }
            ContactSphereChoice::Axis(n) => self.text("contact_spheres", &format!("axis({n})")),
            ContactSphereChoice::Single => self.text("contact_spheres", "single"),
            ContactSphereChoice::File { file, unit } => {
                self.text("contact_spheres", "file");
                self.path("sphere_file", file);
                self.quantity("sphere_file_unit", *unit, "m");
            }
        }
        self.size(&population.size);
        self.shape(&population.shape);
        match &population.placement {
            GrainPlacement::Packed(packing) => self.packing(packing),
            GrainPlacement::Bed(bed) => self.bed_file(bed),
            GrainPlacement::Lattice(lattice) => self.lattice(lattice),
            GrainPlacement::List(list) => self.list(list),
        }
    }

    fn size(&mut self, size: &SizeDistribution) {
        match size {
            SizeDistribution::Equal => {}
            SizeDistribution::List(list) => {
                let shares: Vec<String> = list
                    .iter()
                    .map(|[factor, weight]| format!("{{ factor = {factor:?}, weight = {weight:?} }}"))
                    .collect();
                self.raw("size.list", &format!("[{}]", shares.join(", ")));
            }
            SizeDistribution::Uniform { lower, upper } => {
                self.raw("size.uniform", &format!("{{ lower = {lower:?}, upper = {upper:?} }}"));
            }
            SizeDistribution::Lognormal { median, sigma, lower, upper } => self.raw(
                "size.lognormal",
                &format!("{{ median = {median:?}, sigma = {sigma:?}, lower = {lower:?}, upper = {upper:?} }}"),
            ),
        }
    }

    fn shape(&mut self, shape: &GrainShape) {
        match shape {
            GrainShape::Sphere { diameter, refinement, volume } => self.raw(
                "shape.sphere",
                &format!(
                    "{{ diameter = {}, refinement = {refinement}, volume = \"{volume}\" }}",
                    quantity(*diameter, "m")
                ),
            ),
            GrainShape::Spheroid { diameter, length, rings, segments, volume } => self.raw(
                "shape.spheroid",
                &format!(
                    "{{ diameter = {}, length = {}, rings = {rings}, segments = {segments}, volume = \"{volume}\" }}",
                    quantity(*diameter, "m"),
                    quantity(*length, "m")
                ),
            ),
            GrainShape::Box { size } => self.raw("shape.box", &format!("{{ size = {} }}", vector(*size, "m"))),
            GrainShape::Mesh { file, unit } => {
                self.path("shape.mesh.file", file);
                self.quantity("shape.mesh.unit", *unit, "m");
            }
        }
    }

    fn packing(&mut self, packing: &Packing) {
        self.table("grains.placement.packed");
        self.word("lattice", packing.lattice);
        self.number("spacing", packing.spacing);
        self.number("jitter", packing.jitter);
        if let Some(level) = packing.level {
            self.quantity("level", level, "m");
        }
        if let Some(glued) = packing.glued {
            self.quantity("glued", glued, "m");
        }
        if let Some(height) = packing.height {
            self.quantity("height", height, "m");
        }
        self.number("fall_gravity", packing.fall_gravity);
        self.quantity("settle_time", packing.settle_time, "s");
        self.word("stop", packing.stop);
        self.quantity("mean_speed", packing.mean_speed, "m/s");
        self.number("energy_ratio", packing.energy_ratio);
        self.number("friction_scale", packing.friction_scale);
        self.quantity("time_limit", packing.time_limit, "s");
    }

    fn bed_file(&mut self, bed: &BedFile) {
        self.table("grains.placement.bed");
        self.path("file", &bed.file);
        self.number("scale", bed.scale);
        self.raw("relax", &bed.relax.to_string());
        if let Some(recipe) = &bed.recipe {
            self.path("recipe", recipe);
        }
    }

    fn lattice(&mut self, lattice: &LatticePlacement) {
        self.table("grains.placement.lattice");
        self.vector("lower", lattice.lower, "m");
        self.vector("upper", lattice.upper, "m");
        self.raw("counts", &format!("{:?}", lattice.counts));
        self.number("jitter", lattice.jitter);
        self.raw("random_orientation", &lattice.random_orientation.to_string());
        self.vector("velocity", lattice.velocity, "m/s");
    }

    fn list(&mut self, list: &[Grain]) {
        for grain in list {
            self.element("grains.placement.list");
            let q = grain.orientation;
            self.vector("position", grain.position, "m");
            self.raw("quaternion", &format!("[{:?}, {:?}, {:?}, {:?}]", q.w, q.x, q.y, q.z));
            self.vector("velocity", grain.velocity, "m/s");
            self.vector("angular_velocity", grain.angular_velocity, "rad/s");
            self.word("motion", grain.motion);
            self.number("factor", grain.factor);
        }
    }

    fn observed(&mut self, case: &Case) {
        self.table("bed");
        self.quantity("porosity_lower", case.bed.porosity_slab[0], "m");
        self.quantity("porosity_upper", case.bed.porosity_slab[1], "m");
        self.quantity("height_radius", case.bed.height_radius, "m");
        self.axis(case.bed.axis);
        if let Some(erosion) = &case.erosion {
            self.table("erosion");
            self.quantity("grain_size", erosion.grain_size, "m");
            self.quantity("dx", erosion.dx, "m");
            self.quantity("dr", erosion.dr, "m");
            self.quantity("r_max", erosion.r_max, "m");
            self.word("mode", erosion.mode);
            self.axis(erosion.axis);
        }
        self.ripples(case);
        for probe in &case.probes {
            self.probe(probe);
        }
        self.table("output");
        self.word("precision", case.output.precision);
        self.word("frame", case.output.frame);
        if let Some(bed) = &case.output.bed {
            self.path("bed", bed);
        }
        let outputs = &case.output;
        for (name, schedule) in [
            ("fields", &outputs.fields),
            ("grains", &outputs.grains),
            ("figures", &outputs.figures),
            ("series", &outputs.series),
        ] {
            self.table(&format!("output.{name}"));
            self.schedule(schedule);
        }
        self.table("checkpoint");
        if let Some(every) = case.checkpoint.every_wall {
            self.quantity("every_wall", every, "s");
        }
        if let Some(every) = case.checkpoint.every {
            self.quantity("every", every, "s");
        }
        self.raw("keep", &case.checkpoint.keep.to_string());
        self.table("run");
        self.quantity("until", case.run.until, "s");
        if let Some(steps) = case.run.steps {
            self.raw("steps", &steps.to_string());
        }
        self.raw("packing_only", &case.run.packing_only.to_string());
    }

    fn axis(&mut self, axis: [Real; 2]) {
        self.raw("axis", &format!("[{}, {}]", quantity(axis[0], "m"), quantity(axis[1], "m")));
    }

    fn schedule(&mut self, schedule: &Schedule) {
        if let Some(every) = schedule.every {
            self.quantity("every", every, "s");
        }
        if let Some(steps) = schedule.steps {
            self.raw("steps", &steps.to_string());
        }
        let at: Vec<String> = schedule.at.iter().map(|&t| quantity(t, "s")).collect();
        self.raw("at", &format!("[{}]", at.join(", ")));
    }

    fn probe(&mut self, probe: &Probe) {
        self.element("probe");
        self.text("name", &probe.name);
        self.schedule(&probe.schedule);
        match &probe.place {
            ProbePlace::Point(point) => self.vector("point", *point, "m"),
            ProbePlace::Line { from, to, points } => self.raw(
                "line",
                &format!("{{ from = {}, to = {}, points = {points} }}", vector(*from, "m"), vector(*to, "m")),
            ),
            ProbePlace::Plane { direction, position } => {
                self.raw("plane", &format!("{{ x{} = {} }}", direction + 1, quantity(*position, "m")));
            }
            ProbePlace::Gauge(place) => {
                self.raw("gauge", &format!("[{}, {}]", quantity(place[0], "m"), quantity(place[1], "m")));
            }
            ProbePlace::Body { population, index } => {
                self.raw("body", &format!("{{ population = {}, index = {index} }}", quoted(population)));
            }
        }
    }
}

/// A region as an inline table.
fn region(shape: &Region) -> String {
    match shape {
        Region::Box { lower, upper } => {
            format!("{{ box = {{ lower = {}, upper = {} }} }}", vector(*lower, "m"), vector(*upper, "m"))
        }
        Region::Sphere { centre, diameter } => {
            format!("{{ sphere = {{ centre = {}, diameter = {} }} }}", vector(*centre, "m"), quantity(*diameter, "m"))
        }
        Region::Spheroid { centre, horizontal_diameter, vertical_diameter } => format!(
            "{{ spheroid = {{ centre = {}, horizontal_diameter = {}, vertical_diameter = {} }} }}",
            vector(*centre, "m"),
            quantity(*horizontal_diameter, "m"),
            quantity(*vertical_diameter, "m")
        ),
        Region::HalfSpace { point, normal } => format!(
            "{{ half_space = {{ point = {}, normal = [{:?}, {:?}, {:?}] }} }}",
            vector(*point, "m"),
            normal.x,
            normal.y,
            normal.z
        ),
        Region::Union(parts) => {
            let parts: Vec<String> = parts.iter().map(region).collect();
            format!("{{ union = [{}] }}", parts.join(", "))
        }
    }
}
