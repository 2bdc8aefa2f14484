//! Facts on the populations of grains, as far as the case gives them.

use sazanami_dem::{Body, Bumps};
use sazanami_numerics::Real;

use super::{BumpReport, PopulationReport, volumes};
use crate::assembly::shapes::shape_of;
use crate::case::meaning::{Case, ContactSphereChoice, Exchange, GrainPlacement, Population, Solver};

/// Facts about the shape of a population, once it is built.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeFacts {
    /// Volume of its mesh [m^3].
    pub volume: Option<Real>,
    /// Number of contact spheres of a grain.
    pub contact_spheres: Option<usize>,
    /// Grain size \[m].
    pub size: Option<Real>,
    /// Number of grains, where a bed file tells it.
    pub grains: Option<usize>,
    /// Volume of all grains of a bed file [m^3].
    pub bed_volume: Option<Real>,
    /// Contact spheres and inertia of a grain of size factor 1.
    pub body: Option<Body>,
    /// Corners of its surface.
    pub corners: Option<usize>,
    /// See [`PopulationReport::begins`].
    pub begins: [Real; 2],
    /// Description of the shape, a line each, for the report of `check`.
    pub lines: Vec<String>,
}

/// Reports on the populations; `shapes` as for [`check`].
pub(crate) fn population_reports(case: &Case, shapes: &[ShapeFacts]) -> Vec<PopulationReport> {
    let nothing = ShapeFacts::default();
    let facts = |n: usize| shapes.get(n).unwrap_or(&nothing);
    case.grains.iter().enumerate().map(|(n, population)| population_report(case, population, facts(n))).collect()
}

/// Exchange of momentum between grains and grid fluid, and the width of the narrowest grain in cells, as far as the
/// shapes are known; absent without resolved grains.
pub(crate) fn exchange_of(case: &Case, shapes: &[ShapeFacts]) -> Option<(Exchange, Real)> {
    if case.solver != Solver::Mics || case.grains.is_empty() {
        return None;
    }
    let width = |(n, population): (usize, &Population)| {
        let own = shapes.get(n).and_then(|facts| facts.size).or(population.shape.size());
        own.map_or(Real::INFINITY, |width| width * population.sizes().smallest())
    };
    let narrowest = case.grains.iter().enumerate().map(width).fold(Real::INFINITY, Real::min);
    let cells = case.domain.cells_across(narrowest);
    Some((case.coupling.exchange, cells))
}

fn population_report(case: &Case, population: &Population, facts: &ShapeFacts) -> PopulationReport {
    let size = population.shape.size().or(facts.size).map(|size| size * population.sizes().smallest());
    let shape = if facts.body.is_none() { shape_of(population).ok() } else { None };
    let body = facts.body.clone().or_else(|| shape.as_ref().map(Body::from));
    PopulationReport {
        name: population.name.clone(),
        grains: population.grains().or(facts.grains),
        levelled: volumes::levelled(case, population),
        contact_spheres: facts.contact_spheres.or_else(|| spheres_of(population)),
        size_m: size,
        cells_per_grain: size.map(|size| case.domain.cells_across(size)),
        mass_kg: mass_of(case, population, facts.volume),
        shape: facts.lines.clone(),
        face_spheres: body.as_ref().map(|body| body.face().spheres),
        body,
        begins: facts.begins,
        surface_corners: facts.corners.or_else(|| shape.map(|shape| shape.surface().nodes.len())),
    }
}

/// What bumps add to the friction of flat faces on each other, of two populations or two grains of one.
pub(super) fn bump_reports(case: &Case, populations: &[PopulationReport]) -> Vec<BumpReport> {
    let flat = |n: usize| {
        let body = populations[n].body.as_ref().filter(|body| body.face().is_flat())?;
        Some(body.flat_face(case.grains[n].sizes().largest()))
    };
    let meet = |&(a, b): &(usize, usize)| {
        let free = [a, b].iter().any(|&n| case.grains[n].has_free_grains());
        free && (a != b || populations[a].grains != Some(1))
    };
    let pairs = (0..populations.len()).flat_map(|b| (0..=b).map(move |a| (a, b)));
    let report = |(a, b): (usize, usize)| {
        let bumps = Bumps::of([flat(a)?, flat(b)?]);
        let speed = (case.gravity.length() * bumps.pitch).sqrt();
        Some(BumpReport { between: [a, b].map(|n| populations[n].name.clone()), friction: bumps.friction, speed })
    };
    pairs.filter(meet).filter_map(report).collect()
}

/// Contact spheres on a flat face of each body that forces move.
pub(super) fn on_faces(case: &Case, populations: &[PopulationReport]) -> Real {
    let spheres = |(population, report): (&Population, &PopulationReport)| {
        let face = report
            .body
            .as_ref()
            .map(sazanami_dem::Body::face)
            .filter(|face| face.is_flat() && population.has_free_grains())?;
        Some(face.spheres as Real * report.grains.unwrap_or(0) as Real)
    };
    case.grains.iter().zip(populations).filter_map(spheres).sum()
}

/// Cells that a grain fills, on average; of a wide one those near its surface, of which the work is.
pub(super) fn filled_cells(case: &Case, population: &Population, report: &PopulationReport) -> Option<Real> {
    let volume = report.body.as_ref().map(|body| body.volume).or(population.shape.volume())?;
    let cells = volume * population.sizes().mean_cube() / case.domain.spacing().element_product();
    Some(cells.min(5.0 * cells.powf(2.0 / 3.0)))
}

/// Contact spheres of one grain, where known without reading files.
pub(super) fn spheres_of(population: &Population) -> Option<usize> {
    match population.contact_spheres {
        ContactSphereChoice::Shell { count, .. } => Some(count),
        ContactSphereChoice::Axis(count) => Some(count),
        ContactSphereChoice::Single => Some(1),
        ContactSphereChoice::File { .. } => None,
    }
}

/// Mass of a grain of size factor 1, the mean of a list \[kg]; the volume of its mesh is used if it is known.
fn mass_of(case: &Case, population: &Population, mesh_volume: Option<Real>) -> Option<Real> {
    let density = case.material(&population.material)?.density;
    let mass =
        population.mass_override.or_else(|| Some(density * mesh_volume.or_else(|| population.shape.volume())?))?;
    let listed = matches!(population.placement, GrainPlacement::List(_));
    Some(if listed { mass * population.sizes().mean_cube() } else { mass })
}
