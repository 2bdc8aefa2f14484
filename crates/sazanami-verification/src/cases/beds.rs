//! Beds of grains: how they pack, and what a crater in them measures.

use sazanami_dem::{
    Body, Damping, Grain, Interactions, LinearSpringDashpot, Packing, PackingSettings, Random, Stage, lying_order,
};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, SpheroidMesh, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_observe::BedView;
use sazanami_observe::bed_profile::{height_near, porosity_of_grains};
use sazanami_observe::erosion::{
    Crater, Erosion, ErosionSettings, Profile, cap_volume, cap_volume_of_diameter, cap_volume_of_sphere,
    depth_below_rims, rim_diameter, sphere_radius, volumes_against,
};

use crate::measured::Measured;

const DENSITY: Real = 2650.0;
const GRAIN_SIZE: Real = 0.52e-3;

/// The paper's grain with nine spheres on its axis.
pub(crate) fn grain(spheres: &ContactSphereRule, volume: VolumeRule) -> Result<Shape, String> {
    Shape::spheroid(0.26e-3, 0.635e-3, SpheroidMesh::PAPER, volume, spheres).map_err(|error| error.to_string())
}

/// A bed and how it came to rest.
pub(crate) struct Packed {
    pub grains: Vec<Grain>,
    pub order: Real,
    pub mean_speed: Real,
    pub given_up: bool,
}

/// Packs `count` grains of `shape` in a box of square base.
pub(crate) fn pack(
    shape: &Shape,
    law: LinearSpringDashpot,
    count: u64,
    width: Real,
    adjust: impl FnOnce(PackingSettings) -> PackingSettings,
) -> Result<Packed, String> {
    let upper = Vector::new(width, width, 0.1);
    let settings = adjust(PackingSettings { step: 1e-4, ..PackingSettings::new(Vector::ZERO, upper) });
    let domain =
        Domain::solo(Grid::new([8; 3], Vector::ZERO, upper), [settings.periodic[0], settings.periodic[1], false]);
    let grains = (0..count).map(|id| Grain::new(id, DENSITY, Vector::ZERO)).collect();
    let laws = Interactions::uniform(1, law);
    let mut packing =
        Packing::new(&domain, settings, vec![Body::from(shape)], laws, grains).map_err(|error| error.to_string())?;
    loop {
        let report = packing.step(&domain).map_err(|error| error.to_string())?;
        if matches!(report.stage, Stage::Done | Stage::GivenUp) {
            return Ok(Packed {
                order: lying_order(&domain, packing.engine()),
                grains: packing.bed(),
                mean_speed: report.mean_speed,
                given_up: report.stage == Stage::GivenUp,
            });
        }
    }
}

/// A view of grains at rest.
pub(crate) fn view<R>(shape: &Shape, grains: &[Grain], look: impl FnOnce(&BedView) -> R) -> R {
    let bodies = [sazanami_observe::Body::of(shape)];
    let position: Vec<Vector> = grains.iter().map(|grain| grain.position).collect();
    let orientation: Vec<Quaternion> = grains.iter().map(|grain| grain.orientation).collect();
    let mass: Vec<Real> = grains.iter().map(|grain| grain.mass.unwrap_or(grain.density * shape.volume())).collect();
    look(&BedView {
        bodies: &bodies,
        body: &vec![0; grains.len()],
        scale: &vec![1.0; grains.len()],
        mass: &mass,
        position: &position,
        orientation: &orientation,
        velocity: &vec![Vector::ZERO; grains.len()],
        last_contact: None,
        time: 0.0,
    })
}

/// Beds are looser with friction, and long axes lie down.
pub(crate) fn friction_and_porosity() -> Result<Vec<Measured>, String> {
    let shape = grain(&ContactSphereRule::Axis { count: 9 }, VolumeRule::Preserve)?;
    let width = 5.4e-3;
    let mut rows = Vec::new();
    let (mut porosities, mut order) = (Vec::new(), 0.0);
    for friction in [0.6, 0.3, 0.0] {
        // Grains without friction that bounce as the paper's do are a gas for long: these bounce less.
        let law = LinearSpringDashpot { friction, damping: Damping::Restitution(0.3), ..LinearSpringDashpot::SAND };
        // Without friction grains never quite rest: all three get the same time, long enough to fall from the top
        // of the lattice if two meet there early.
        let packed = pack(&shape, law, 400, width, |settings| PackingSettings {
            periodic: [true; 2],
            by_time_only: true,
            settling_time: 0.12,
            ..settings
        })?;
        let porosity = view(&shape, &packed.grains, |bed| porosity_of_grains(bed, 1e-3..3e-3, width * width));
        rows.push(Measured::new(format!("porosity, friction {friction}"), porosity));
        rows.push(Measured::new(format!("order of lying axes, friction {friction}"), packed.order));
        porosities.push(porosity);
        order = if friction == 0.6 { packed.order } else { order };
    }
    rows.push(Measured::new("porosity at 0.6 less that at 0.3", porosities[0] - porosities[1]));
    rows.push(Measured::new("porosity at 0.3 less that at 0", porosities[1] - porosities[2]));
    // 400 axes that point anywhere have an order of 0 with a standard deviation of 0.045.
    rows.push(Measured::new("axes lie: order with friction 0.6", order));
    rows.push(Measured::new("control: order of random axes", random_order(100_000).abs()));
    Ok(rows)
}

/// Lying order of axes that point anywhere.
fn random_order(count: u32) -> Real {
    let mut random = Random::new(9);
    let squares: Real = (0..count).map(|_| (random.orientation() * Vector::X).z.powi(2)).sum();
    1.0 - 3.0 * squares / Real::from(count)
}

/// The paper's bed of 30,900 grains.
pub(crate) fn paper_bed() -> Result<Vec<Measured>, String> {
    let shell = ContactSphereRule::Shell { count: 75, radius: Some(0.075e-3) };
    let shape = grain(&shell, VolumeRule::Inscribed)?;
    let width = 33.8e-3;
    // As `cases/raindrop/bed.toml`.
    let packed = pack(&shape, LinearSpringDashpot::SAND, 30_900, width, |settings| settings)?;
    let (porosity, height) = view(&shape, &packed.grains, |bed| {
        let height = height_near(bed, [0.5 * width; 2], 1e-3).unwrap_or(0.0);
        (porosity_of_grains(bed, 0.0..5e-3, width * width), height)
    });
    Ok(vec![
        Measured::new("packing given up", if packed.given_up { 1.0 } else { 0.0 }),
        Measured::new("porosity, 0 to 5 mm", porosity),
        Measured::new("height within 1 mm of the axis", height),
        Measured::new("mean speed", packed.mean_speed),
        Measured::new("order of lying axes", packed.order),
    ])
}

/// Columns of balls on a square lattice whose tops follow `top(r)`, three layers deep, each moved up or down by up to
/// `rough` diameters at random.
fn columns(diameter: Real, half: Real, rough: Real, top: impl Fn(Real) -> Real) -> Vec<Grain> {
    let count = (2.0 * half / diameter).round() as usize;
    let pitch = 2.0 * half / count as Real;
    let mut random = Random::new(21);
    let mut grains = Vec::new();
    for i in 0..count {
        for j in 0..count {
            let [x, y] = [i, j].map(|n| -half + (n as Real + 0.5) * pitch);
            let level = top(x.hypot(y)) + rough * diameter * random.between(-0.5, 0.5);
            for k in 0..3 {
                let z = level - (0.5 + Real::from(k)) * diameter;
                grains.push(Grain::new(grains.len() as u64, DENSITY, Vector::new(x, y, z)));
            }
        }
    }
    grains
}

/// Erosion volumes of a profile worked by hand, and of beds with a known cap.
pub(crate) fn crater_evaluation() -> Result<Vec<Measured>, String> {
    let heights = [6.20, 6.45, 7.05, 7.80, 8.35, 8.55, 8.40, 8.25, 8.18, 8.15, 8.16, 8.14];
    let profile = Profile { layer: 1.0, heights: heights.map(Some).to_vec() };
    let crater = Crater::of(&profile).ok_or("the worked profile has a crater")?;
    let (excavated, rim) = volumes_against(&profile, |_| 8.15);
    let (diameter, depth) = (rim_diameter(11.2, 10.6), depth_below_rims(8.4, 8.6, 6.1));
    let mut rows: Vec<Measured> = [
        ("V of the worked profile", crater.volume),
        ("V_direct", crater.volume_direct),
        ("V_excavated against 8.15 mm", excavated),
        ("V_rim against 8.15 mm", rim),
        ("V of the experiment's formula, eq. (12)", cap_volume_of_sphere(depth, sphere_radius(depth, diameter))),
        ("V of the experiment's formula, eq. (13)", cap_volume_of_diameter(depth, diameter)),
    ]
    .into_iter()
    .map(|(name, found)| Measured::new(name, found))
    .collect();

    let diameter = GRAIN_SIZE;
    let shape =
        Shape::sphere(diameter, 1, VolumeRule::Inscribed, &ContactSphereRule::Single).map_err(|e| e.to_string())?;
    let (half, level) = (12e-3, 8e-3);
    let settings = ErosionSettings::recommended([-half; 2], [half; 2], 0.0, diameter);
    let evaluate =
        |grains: &[Grain]| view(&shape, grains, |bed| Erosion::of(bed, &settings, None)).map_err(|e| e.to_string());
    let (rim_radius, depth) = (5.85e-3, 2.35e-3);
    let radius = sphere_radius(depth, 2.0 * rim_radius);
    let cap = |r: Real| {
        if r < rim_radius {
            level - depth + radius - (radius * radius - r * r).sqrt()
        } else {
            level - 0.2 * (r - rim_radius)
        }
    };
    let found = evaluate(&columns(diameter, half, 0.0, cap))?;
    let error = found.crater.volume / cap_volume(depth, rim_radius) - 1.0;
    rows.push(Measured::new("spherical cap: error of V", error));
    let error = found.crater.volume_direct / cap_volume(depth, rim_radius) - 1.0;
    rows.push(Measured::new("spherical cap: error of the volume below the rim", error));
    let by_layers = found.by_layers.ok_or("the cap has grains at its axis")?;
    let error = by_layers.volume / cap_volume(depth, rim_radius) - 1.0;
    rows.push(Measured::new("spherical cap: error of V by layers", error));
    let flat = evaluate(&columns(diameter, half, 0.5, |_| level))?;
    let noise = flat.crater.volume / flat.volume_of_one_grain_depth(&settings);
    rows.push(Measured::new("flat bed: V over that of one grain layer", noise));
    let dent =
        evaluate(&columns(diameter, half, 0.5, |r| level - 3.0 * diameter * (1.0 - (r / 6e-3).powi(2)).max(0.0)))?;
    let above = dent.crater.volume / dent.volume_of_one_grain_depth(&settings);
    rows.push(Measured::new("control: a dent of three grains, the same", above));
    Ok(rows)
}
