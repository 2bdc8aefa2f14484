//! Magnitudes that no experiment has: most are those of another unit, or of a forgotten power of ten.

use sazanami_numerics::Real;

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::surface_tension::LARGEST;
use crate::tables::{
    BoundarySide, BoxDomain, Coupling, DAMPING, DemOptions, FilmRoughness, Population, SIDE_NAMES, SPEED_AT_REST,
    STRAIN_AT_REST, usual_margin,
};
use crate::units::rounded;

/// Nothing is refused.
const ANY: [Real; 2] = [0.0, Real::INFINITY];

/// Edges of a cell over its shortest from which on they are doubted.
const LONGEST_CELL: Real = 5.0;

/// A kind of quantity, and between what it is not doubted.
struct Kind {
    /// With its article.
    name: &'static str,
    unit: &'static str,
    range: [Real; 2],
    /// Beyond these it cannot be meant.
    meant: [Real; 2],
    /// What is said of less, and of more.
    beyond: [&'static str; 2],
    /// What a common one is.
    common: &'static str,
}

macro_rules! kinds {
    ($($name:ident = $text:literal, $unit:literal, $least:literal to $most:literal, $meant:expr, $less:literal | $more:literal, $common:literal;)*) => {
        $(const $name: Kind = Kind {
            name: $text,
            unit: $unit,
            range: [$least, $most],
            meant: $meant,
            beyond: [$less, $more],
            common: $common,
        };)*
    };
}

kinds! {
    DENSITY = "a density", "kg/m^3", 10.0 to 23e3, ANY, "lighter than foam" | "heavier than osmium",
        "sand has about 2650 kg/m^3, which is 2.65 g/cm^3";
    GAS_DENSITY = "a density of the gas", "kg/m^3", 1e-3 to 2e3, ANY, "that of a vacuum" | "that of no gas", "air has 1.2 kg/m^3";
    VISCOSITY = "a viscosity", "Pa s", 1e-7 to 1e9, ANY, "less than that of any gas" | "more than that of pitch",
        "water has 1e-3 Pa s, which is 1 mPa s or 1 cP";
    GRAVITY = "gravity", "m/s^2", 1e-6 to 1e5, [1e-9, Real::INFINITY], "less than that in orbit" | "more than that in a centrifuge",
        "the Earth has 9.81 m/s^2; \"0 m/s^2\" is none";
    FORCE = "an acceleration", "m/s^2", 1e-7 to 1e5, ANY, "too small to move anything" | "more than that in a centrifuge",
        "a slope of a per cent drives by 0.1 m/s^2";
    EDGE = "an edge of the box", "m", 1e-6 to 1e4, [1e-9, 1e6], "smaller than any grain" | "larger than any lake of grains",
        "boxes of this program have millimetres to metres";
    SPACING = "a spacing of particles", "m", 1e-7 to 1e2, ANY, "smaller than any grain" | "larger than any wave", "tanks have 1 mm to 10 mm";
    TIME = "a time", "s", 1e-9 to 1e8, [1e-15, Real::INFINITY], "shorter than any motion of water" | "longer than a year",
        "drops take milliseconds, tanks seconds";
    FREQUENCY = "a frequency", "Hz", 1e-6 to 1e6, ANY, "slower than any tide" | "that of ultrasound", "tanks are shaken by some Hz";
    AMPLITUDE = "an amplitude", "m", 1e-9 to 1e3, ANY, "less than a thousand atoms" | "larger than any tank", "tanks are shaken by millimetres";
    SPEED = "a speed", "m/s", 1e-9 to 343.0, ANY, "slower than creep" | "faster than sound", "rain falls at 9 m/s at most";
    PRESSURE = "a pressure", "Pa", 1e-9 to 1e9, ANY, "less than any difference of heights brings" | "more than any sea has",
        "10 mm of water have 98 Pa";
    STIFFNESS = "a stiffness", "N/m", 1e-6 to 1e12, ANY, "too soft to bear a grain" | "stiffer than steel",
        "grains of sand are given 1e3 to 1e5 N/m";
    ROUGHNESS = "a roughness", "m", 1e-10 to 1e-2, ANY, "less than an atom" | "that of gravel", "beads have 0.02 um to 1 um";
    BRIDGE = "a surface tension", "N/m", 1e-3 to 5.0, ANY, "hardly one" | "that of no liquid", "water has 72.8 mN/m, which is 0.0728 N/m";
}

/// Warns of what is doubted, refuses what cannot be meant, and says which physics has nothing to act on.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    check_cells(&case.domain, cx);
    let mut judge = |key: &str, kind: &Kind, value: Real| judge(key, kind, value, cx);
    judge("gravity", &GRAVITY, case.gravity.length());
    let extent = case.domain.extent();
    let edge = if extent.min_element() < EDGE.range[0] { extent.min_element() } else { extent.max_element() };
    judge("domain", &EDGE, edge);
    let fluid = &case.fluid;
    judge("fluid.liquid.density", &DENSITY, fluid.liquid.density);
    judge("fluid.gas.density", &GAS_DENSITY, fluid.gas.density);
    judge("fluid.liquid", &VISCOSITY, fluid.liquid.viscosity);
    judge("fluid.gas", &VISCOSITY, fluid.gas.viscosity);
    for material in &case.materials {
        judge(&format!("material.{}.density", material.name), &DENSITY, material.density);
    }
    for (n, population) in case.grains.iter().enumerate() {
        if let Some(density) = density_by_mass(population) {
            judge(&format!("grains.{n}.mass_override"), &DENSITY, density);
        }
    }
    for pair in &case.contacts {
        let key = format!("contact.{}/{}", pair.a, pair.b);
        let place = if case.contacts.len() == 1 { "contact".to_owned() } else { key };
        judge(&place, &STIFFNESS, pair.law.normal_stiffness);
    }
    if let FilmRoughness::Height(height) = case.dem.film_roughness {
        judge("dem.film_roughness", &ROUGHNESS, height);
    }
    // A larger one is refused where bridges are checked.
    if let Some(bridges) = case.dem.bridges.as_ref().filter(|bridges| bridges.surface_tension <= LARGEST) {
        judge("dem.bridges.surface_tension", &BRIDGE, bridges.surface_tension);
    }
    judge("run.until", &TIME, case.run.until);
    if let Some(particles) = case.particles.as_ref().filter(|_| case.solver == Solver::Mps) {
        judge("particles.spacing", &SPACING, particles.spacing);
    }
    if let Some(drive) = &case.drive {
        judge("drive.acceleration", &FORCE, drive.acceleration.length());
        judge("drive.mean_velocity", &SPEED, drive.mean_velocity.map_or(0.0, |u| u.length()));
        judge("drive.answer", &TIME, drive.answer);
        if let Some(swing) = &drive.oscillation {
            judge("drive.oscillation.amplitude", &FORCE, swing.amplitude.length());
            judge("drive.oscillation.frequency", &FREQUENCY, swing.frequency);
        }
    }
    if let Some(frame) = &case.frame {
        judge("frame.acceleration", &FORCE, frame.acceleration.length());
        if let Some((amplitude, frequency)) = frame.motion.as_ref().and_then(|motion| motion.harmonic()) {
            judge("frame.motion", &AMPLITUDE, amplitude.length());
            judge("frame.motion", &FREQUENCY, frequency);
        }
        if let Some(swing) = &frame.oscillation {
            judge("frame.oscillation.amplitude", &FORCE, swing.amplitude.length());
            judge("frame.oscillation.frequency", &FREQUENCY, swing.frequency);
        }
    }
    for (d, upper) in (0..6).map(|n| (n / 2, n % 2)) {
        let key = format!("boundary.{}", SIDE_NAMES[d][upper]);
        match case.boundary[d][upper] {
            BoundarySide::FixedPressure { pressure, .. } => judge(&key, &PRESSURE, pressure),
            BoundarySide::Inflow { velocity, .. } | BoundarySide::Moving { velocity } => {
                judge(&key, &SPEED, velocity.length());
            }
            _ => {}
        }
    }
    check_idle(case, cx);
}

/// Warns of long cells, as numbers of cells in another order than the edges of the box make. Directions of a single cell are not divided.
fn check_cells(domain: &BoxDomain, cx: &mut Context<'_>) {
    let (spacing, [shortest, longest]) = (domain.spacing(), domain.divided_edges());
    if longest > LONGEST_CELL * shortest {
        cx.report
            .warning(cx.places.near("domain.cells"), format!("cells {} times as long as wide", rounded(longest / shortest)))
            .label(format!("{} m x {} m x {} m", rounded(spacing.x), rounded(spacing.y), rounded(spacing.z)))
            .help("give the numbers of cells along x1, x2 and x3 as the edges of the box go: what is resolved along one direction is seen with the longest edge");
    }
}

/// Density that a population has by its mass [kg/m^3].
fn density_by_mass(population: &Population) -> Option<Real> {
    Some(population.mass_override? / population.shape.volume()?)
}

fn judge(key: &str, kind: &Kind, value: Real, cx: &mut Context<'_>) {
    let [least, most] = kind.range;
    let size = value.abs();
    // One that cannot be read is not a number, and has been reported; nothing is nothing.
    if size == 0.0 || size.is_nan() || (least..=most).contains(&size) {
        return;
    }
    let text =
        format!("{} of {} {} is {}", kind.name, rounded(value), kind.unit, kind.beyond[usize::from(size > most)]);
    let finding = if size < kind.meant[0] || size > kind.meant[1] {
        cx.report.error_at(cx.places.near(key), text).label("this cannot be meant")
    } else {
        cx.report.warning(cx.places.near(key), text).label(format!(
            "not doubted are {} to {} {}",
            rounded(least),
            rounded(most),
            kind.unit
        ))
    };
    finding.help(format!("check the unit: {}", kind.common));
}

/// Says which keys have nothing to act on.
fn check_idle(case: &Case, cx: &mut Context<'_>) {
    if cx.known.is_damaged {
        return;
    }
    let (dry, bare) = (!case.has_liquid(), case.grains.is_empty());
    let around = case.periodic()[0]
        && case.ripples.as_ref().is_some_and(|ripples| ripples.margin != usual_margin(case.domain.extent().x));
    let net = case.mean_flow().is_some_and(|flow| flow.net);
    // Defaults, which the case in a run's folder has too, pass.
    let (dem, usual) = (&case.dem, DemOptions::default());
    let before = &case.preparation;
    let rolls = dem.rolling_friction != usual.rolling_friction;
    let by_shape = !bare && !case.grains.iter().any(Population::may_be_round);
    let why_by_shape = "grains of several contact spheres resist rolling by their shape";
    let unrested = case.solver == Solver::Mps && before.relax_steps == 0;
    let why_unrested = "water does not come to rest before the run: `preparation.relax_steps` is 0";
    let idle = [
        ("fluid.surface_tension", dry, "there is no liquid"),
        ("fluid.entry_pressure", dry, "there is no liquid"),
        ("fluid.contact_angle", dry, "there is no liquid"),
        ("fluid.receding_angle", dry, "there is no liquid"),
        ("drive.mean_velocity", dry && !net, "there is no liquid whose velocity could be held"),
        ("dem.film_roughness", bare && dem.film_roughness != usual.film_roughness, "there are no grains"),
        ("dem.bridges", bare, "there are no grains"),
        ("dem.soften", bare, "there are no grains"),
        ("dem.soften", case.run.packing_only, "the run packs its bed, with springs of its own, and ends"),
        ("dem.substeps", bare && dem.substeps != usual.substeps, "there are no grains"),
        ("dem.rolling_friction", rolls && bare, "there are no grains"),
        ("dem.rolling_friction", rolls && by_shape, why_by_shape),
        ("coupling", bare && case.coupling != Coupling::default(), "there are no grains"),
        ("contact", bare, "there are no grains"),
        ("overlap", bare, "there are no grains"),
        ("preparation.damping", unrested && before.damping != DAMPING, why_unrested),
        ("preparation.strain", unrested && before.strain != STRAIN_AT_REST, why_unrested),
        ("preparation.speed", unrested && before.speed != SPEED_AT_REST, why_unrested),
        ("preparation.must_rest", unrested && !before.must_rest, why_unrested),
        ("ripples.margin", around, "the box is periodic along x1, has no end walls and is measured whole"),
    ];
    for (key, without, why) in idle {
        if let Some(place) = cx.places.of(key).filter(|_| without) {
            cx.report.warning(Some(place), format!("`{key}` does nothing")).label(why).help("leave it out");
        }
    }
}
