//! Checks of a case of moving particles, and the keys that such a case cannot have.

mod films;
mod gates;

use sazanami_dem::Motion;
use sazanami_mps::scheme::{CONJUGATE_RADIUS, ParticleProjection, Turbulence};
use sazanami_numerics::Real;

use crate::amounts::{at_least, length};
use crate::case::Case;
use crate::driven::resists;
use crate::presets::{Preset, Solver};
use crate::read::Context;
use crate::tables::{
    BoundarySide, FluidName, GrainPlacement, GrainShape, Particles, Population, ProbePlace, SIDE_NAMES, SMOOTHING,
    TankMotion, place_of_side,
};
use crate::units::{rounded, rounded_within};

/// Largest grain over the smallest edge of its tank.
const LARGEST_GRAIN: Real = 0.25;

/// Least radius within which grains read the water, in particle spacings: that of the narrowest scheme.
const LEAST_REACH: Real = 2.1;

/// Checks across the tables of a case of moving particles.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    films::check(case, cx);
    gates::check(case, cx);
    check_seeded_ripples(case, cx);
    if case.solver == Solver::Mics {
        for (n, population) in case.grains.iter().enumerate() {
            if let GrainPlacement::Packed(how) = &population.placement
                && how.glued.is_some()
            {
                let span = cx.places.at(&format!("grains.{n}"));
                cx.report
                    .error(span, "beds are glued to the floor for `solver = \"mps\"`")
                    .label("this case has `solver = \"mics\"`")
                    .help("leave out `glued`");
            }
        }
        if case.walls_move() {
            let span = cx.places.at("frame");
            cx.report
                .error(span, "the walls of a grid cannot move as a whole")
                .label("`walls = \"moving\"` is for `solver = \"mps\"`")
                .help("leave out `walls`: the fluid feels the acceleration of the tank");
        }
        if let Some(span) = cx.places.of("ripples") {
            cx.report
                .error(span, "ripples are observed with `solver = \"mps\"`")
                .label("this case has `solver = \"mics\"`");
        }
        return;
    }
    let Some(particles) = &case.particles else { return };
    check_sides(case, cx);
    check_spheres(case, cx);
    warn_of_glued_beds(case, cx);
    check_smoothing(case, cx);
    check_projection(case, cx, particles);
    check_turbulence(case, cx, particles);
    check_reach(case, cx, particles);
    check_lattice(case, cx, particles);
    if let Some(TankMotion::File { curve, .. }) = case.frame.as_ref().and_then(|frame| frame.motion.as_ref())
        && curve.range()[1] < case.run.until * (1.0 - 1e-9)
    {
        let span = cx.places.at("frame");
        cx.report
            .error(span, "the motion of the tank ends before the run")
            .label(format!("its last time is {} s, the run ends at {} s", curve.range()[1], case.run.until))
            .help("add rows, or end the run before");
    }
    let planes = case.probes.iter().enumerate();
    for (n, _) in planes.filter(|(_, probe)| matches!(probe.place, ProbePlace::Plane { .. })) {
        let span = cx.places.at(&format!("probe.{n}"));
        cx.report
            .error(span, "a plane is no probe among moving particles")
            .label("fluxes through a plane are for `solver = \"mics\"`")
            .help("use a `line` of points");
    }
    if let Some(span) = cx.places.of("erosion") {
        cx.report
            .error(span, "craters are observed with `solver = \"mics\"`")
            .label("this case has `solver = \"mps\"`");
    }
}

/// Sides that moving particles know: walls, periodic ones, and open ones.
fn check_sides(case: &Case, cx: &mut Context<'_>) {
    for (d, upper) in (0..3).flat_map(|d| [(d, 0), (d, 1)]) {
        let (name, span) = (SIDE_NAMES[d][upper], place_of_side(&cx.places, d, upper));
        let kind = match case.boundary[d][upper] {
            BoundarySide::Inflow { .. } => "inflow",
            BoundarySide::Moving { .. } => "moving",
            BoundarySide::FixedPressure { pressure, fluid } if pressure != 0.0 || fluid == FluidName::Liquid => {
                cx.report
                    .error_at(span, format!("moving particles leave through the side {name}, and none come in"))
                    .label("beyond an open side there is air at pressure zero")
                    .help("write \"outflow\"");
                continue;
            }
            _ => continue,
        };
        cx.report
            .error_at(span, format!("moving particles cannot have the side {name}: it is `{kind}`"))
            .label("sides of this kind are for `solver = \"mics\"`")
            .help("write \"no_slip\", \"slip\", \"periodic\" or \"outflow\"");
    }
    let span = cx.places.at("boundary");
    let any = |wanted: BoundarySide| case.boundary.iter().flatten().any(|side| *side == wanted);
    let published = case.particles.as_ref().is_some_and(|p| p.projection == ParticleProjection::Enhanced);
    if published && any(BoundarySide::NoSlip) && any(BoundarySide::Slip) {
        cx.report
            .error(span, "walls of the published scheme have one kind of friction")
            .label("both `no_slip` and `slip` walls are given")
            .help("choose \"no_slip\" or \"slip\" for all walls, or leave out `preset = \"paper_literal\"`");
    }
}

/// Overlapping grains are spheres, small against their tank.
fn check_spheres(case: &Case, cx: &mut Context<'_>) {
    let held = case.mean_flow().is_some_and(|flow| flow.held[2]);
    let falls = case.boundary[2][0] == BoundarySide::Periodic
        && case.effective_gravity([0.0; 2]).z != 0.0
        && !held
        && resists(case, 2);
    if let Some(n) = case.grains.iter().position(|population| falls && population.has_free_grains()) {
        let span = cx.places.at(&format!("grains.{n}"));
        cx.report
            .error(span, format!("`{}` needs a floor: x3 is periodic", case.grains[n].name))
            .label("its grains would fall without end")
            .help(
                "make x3 a wall, write `motion = \"fixed\"`, or hold a mean velocity along x3 (`drive.mean_velocity`)",
            );
    }
    let smallest = case.domain.extent().min_element();
    for (n, population) in case.grains.iter().enumerate() {
        let span = cx.places.at(&format!("grains.{n}.shape"));
        let GrainShape::Sphere { diameter, .. } = population.shape else {
            cx.report
                .error(span, format!("`{}` is no sphere", population.name))
                .label("grains that water overlaps are spheres")
                .help("write `shape.sphere = { diameter = \"1 mm\" }`, or `solver = \"mics\"` for grains of any shape");
            continue;
        };
        let largest = diameter * population.sizes().largest();
        if largest > LARGEST_GRAIN * smallest {
            cx.report
                .error(span, format!("`{}` is too large for its tank", population.name))
                .label(format!(
                    "up to {}, more than a quarter of the shortest edge, {}",
                    length(largest),
                    length(smallest)
                ))
                .help("make the tank wider or the grains smaller");
        }
    }
}

/// The published scheme belongs to the literal preset; the other has a least radius.
fn check_projection(case: &Case, cx: &mut Context<'_>, particles: &Particles) {
    if particles.projection == ParticleProjection::Enhanced && case.preset != Preset::PaperLiteral {
        let span = cx.places.of("particles.projection");
        cx.report
            .error_at(span, "`projection = \"enhanced\"` is the published scheme, part of `preset = \"paper_literal\"`")
            .label("not with the default preset: its stabilisation acts as 14 to 20 times water's viscosity over beds")
            .help("leave `projection` out, or write `preset = \"paper_literal\"` at the top of the case");
    }
    if particles.projection == ParticleProjection::Conjugate && particles.radius < CONJUGATE_RADIUS {
        let span = cx.places.of("particles.radius");
        cx.report
            .error_at(span, format!("`radius` is below {CONJUGATE_RADIUS}, the least of `projection = \"conjugate\"`"))
            .label(format!("with {}, still water does not stay at rest", particles.radius))
            .help(format!("write `radius = {CONJUGATE_RADIUS}` or more, or leave it out"));
    }
}

/// Eddies have viscous water to act in and a bed or a floor to grow from.
fn check_turbulence(case: &Case, cx: &mut Context<'_>, particles: &Particles) {
    if particles.turbulence == Turbulence::None {
        return;
    }
    let held = case.boundary[2][0] == BoundarySide::NoSlip;
    let is_bed = |population: &Population| {
        let lies = match &population.placement {
            GrainPlacement::Packed(_) | GrainPlacement::Bed(_) => true,
            GrainPlacement::List(list) => list.iter().any(|grain| grain.motion == Motion::Fixed),
            _ => population.motion == Motion::Fixed,
        };
        lies || population.release.is_some()
    };
    let (label, help) = if particles.projection == ParticleProjection::Enhanced {
        ("the published scheme has none", "leave `turbulence` or `preset = \"paper_literal\"` out")
    } else if case.fluid.liquid.viscosity <= 0.0 {
        ("the liquid has no viscosity", "write `fluid.liquid.kinematic_viscosity = \"1e-6 m^2/s\"` for water")
    } else if case.boundary[2][0] == BoundarySide::Periodic {
        (
            "x3 is periodic: there is no floor from which the length grows",
            "make the sides of x3 no periodic ones, or leave `turbulence` out",
        )
    } else if !held && !case.grains.iter().any(is_bed) {
        (
            "there is neither a bed nor a floor that holds the water",
            "write `boundary.x3_lower = \"no_slip\"`, or leave `turbulence` out",
        )
    } else {
        return;
    };
    let span = cx.places.of("particles.turbulence");
    cx.report.error_at(span, "the mixing length has nothing to work with").label(label).help(help);
}

/// Grains read several particles of water.
fn check_reach(case: &Case, cx: &mut Context<'_>, particles: &Particles) {
    let least = LEAST_REACH * particles.spacing;
    if !case.grains.is_empty() && case.has_liquid() && case.overlap.smoothing < least * (1.0 - 1e-9) {
        let span = cx.places.near("overlap.smoothing");
        let most = 1e3 * case.overlap.smoothing / LEAST_REACH;
        let [_, most] = rounded_within(0.99 * most, most);
        cx.report
            .error_at(span, format!("`smoothing` is below {LEAST_REACH} spacings: grains would read too few particles"))
            .label(format!("{} spacings", rounded(case.overlap.smoothing / particles.spacing)))
            .help(format!("take {} mm at least, or particles of {most} mm at most", rounded(1e3 * least)));
    }
}

/// The void fraction is smoothed over several grains, and over no more than one image of each beyond a side.
fn check_smoothing(case: &Case, cx: &mut Context<'_>) {
    let largest = case.grains.iter().filter_map(|p| Some(p.shape.size()? * p.sizes().largest())).reduce(Real::max);
    let Some(largest) = largest else { return };
    let (smoothing, wide) = (case.overlap.smoothing, SMOOTHING[1] * largest);
    let span = cx.places.of("overlap.smoothing");
    let edges =
        (0..3).filter(|&d| !case.boundary[d].iter().any(BoundarySide::is_open)).map(|d| case.domain.extent()[d]);
    let edge = edges.fold(Real::INFINITY, Real::min);
    let millimetres = |length: Real| rounded(1e3 * length);
    let [least, _] = rounded_within(1e3 * wide, Real::INFINITY);
    if smoothing > edge {
        let suited = SMOOTHING[0] * largest;
        let help = if suited <= edge {
            format!("{} mm, three grain sizes, suit these grains", millimetres(suited))
        } else {
            "make the tank wider or the grains smaller".to_owned()
        };
        cx.report
            .error_at(span, "`smoothing` is longer than the tank between two sides")
            .label(format!("{} mm, the edge {} mm", millimetres(smoothing), millimetres(edge)))
            .help(help);
    } else if smoothing < largest {
        cx.report
            .error_at(span, "`smoothing` is smaller than a grain")
            .label("the void fraction would be 1 between grains and 0 within them")
            .help(format!("take {least} mm at least, 2.5 times the largest grain"));
    } else if smoothing < wide * (1.0 - 1e-9) {
        cx.report
            .warning(span, "`smoothing` is short: at a single grain the void fraction is that of a dense bed")
            .label(format!("{} times the largest grain", rounded(smoothing / largest)))
            .help(format!("take {least} mm at least, 2.5 times the largest grain"));
    }
}

/// A bed of which every grain is glued to the floor does not move.
fn warn_of_glued_beds(case: &Case, cx: &mut Context<'_>) {
    for (n, population) in case.grains.iter().enumerate() {
        let GrainPlacement::Packed(how) = &population.placement else { continue };
        let radius = 0.5 * population.shape.size().unwrap_or(0.0) * population.sizes().smallest();
        let (Some(glued), Some(level)) = (how.glued, how.level) else { continue };
        if glued > level - radius {
            let span = cx.places.at(&format!("grains.{n}.placement"));
            cx.report
                .warning(Some(span), format!("every grain of `{}` is glued to the floor", population.name))
                .label(format!("up to {} mm, the bed is {} mm high", rounded(1e3 * glued), rounded(1e3 * level)))
                .help("lower `glued`: three quarters of a grain size hold the lowest layer");
        }
    }
}

/// Ripples that a bed begins with go round a periodic box a whole number of times.
fn check_seeded_ripples(case: &Case, cx: &mut Context<'_>) {
    let length = case.domain.extent().x;
    for (n, population) in case.grains.iter().enumerate() {
        let GrainPlacement::Packed(how) = &population.placement else { continue };
        if how.ripples.is_empty() {
            continue;
        }
        if how.highest_level().is_some_and(|level| level > case.domain.extent().z) {
            cx.report
                .error(cx.places.at(&format!("grains.{n}.placement")), "the crests of the ripples reach above the box")
                .label(format!("up to {} mm", rounded(1e3 * how.highest_level().unwrap_or_default())))
                .help("lower `level` or `height`");
        }
        for ripples in &how.ripples {
            let number = length / ripples.wavelength;
            let whole = number.round().max(1.0);
            if case.boundary[0][0] == BoundarySide::Periodic && (number / whole - 1.0).abs() > 1e-3 {
                cx.report
                    .error(
                        cx.places.at(&format!("grains.{n}.placement")),
                        "the ripples do not fit the box, which is periodic",
                    )
                    .label(format!("{} of them", rounded(number)))
                    .help(format!("take a wavelength of {} mm", rounded(1e3 * length / whole)));
            }
        }
    }
}

/// The tank fits the lattice of its walls and is longer than the reach of a particle; the water fits into it.
fn check_lattice(case: &Case, cx: &mut Context<'_>, particles: &Particles) {
    let span = cx.places.at("domain");
    // Between grains particles are larger by the conjugate projection, and so are their radii.
    let widens = particles.projection == ParticleProjection::Conjugate && !case.grains.is_empty();
    let size = if widens { case.overlap.least_void.cbrt().recip() } else { 1.0 };
    let reach = size * particles.radius * particles.spacing;
    let extent = case.domain.extent();
    for d in 0..3 {
        let periodic = case.boundary[d][0] == BoundarySide::Periodic;
        let needed = if periodic { 2.0 * reach } else { reach };
        if extent[d] < needed {
            cx.report
                .error(span.clone(), format!("the tank is too short along x{} for the radius of influence", d + 1))
                .label(format!("{}; it has to be {} at least", length(extent[d]), at_least(needed)))
                .help("make the tank longer or the particles smaller");
            continue;
        }
        let tank = case.tank();
        if let Err(problem) = tank.lattice(particles.spacing)
            && problem.direction == d
        {
            cx.report
                .error(span.clone(), format!("no lattice of wall particles fits the tank along x{}", d + 1))
                .label(problem.to_string())
                .help(multiples(extent[d], particles.spacing));
        }
    }
    for (n, liquid) in case.liquids.iter().enumerate() {
        let Some(top) = liquid.top() else { continue };
        if top.is_finite() && top > case.domain.upper.z + 1e-9 * extent.z {
            let span = cx.places.at(&format!("liquid.{n}"));
            cx.report
                .error(span, format!("`{}` is deeper than the tank", liquid.name))
                .label(format!("it reaches up to {}, the tank to {}", length(top), length(case.domain.upper.z)))
                .help("make the tank higher or the water shallower");
        }
    }
}

/// The two nearest lengths of an edge that are multiples of the spacing.
fn multiples(edge: Real, spacing: Real) -> String {
    let below = (edge / spacing + 1e-9).floor().max(1.0);
    let [below, above] = [below, below + 1.0].map(|count| rounded(1e3 * count * spacing));
    format!("make this edge a multiple of the particle spacing, {below} mm or {above} mm")
}
