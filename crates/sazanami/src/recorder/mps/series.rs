//! Columns of the series, of the profiles of bed and water, and of the averages over layers.

use sazanami_io::table::Value;
use sazanami_numerics::Real;
use sazanami_observe::ripples::{CrestedRipples, LayerMeans, Mound, SurfaceProfile};
use serde_json::json;

use super::{BedMeasures, ParticleObserver, TankSums};
use crate::clock::Clock;
use crate::columns::{Cell, Field, Quantity, cells, headings, quantities};
use crate::job::RecordError;
use crate::recorder::columns::{grain_substeps, of_step, pressure_iterations};
use crate::recorder::files::Files;
use crate::recorder::observer::{Row, SeriesCell};
use crate::results::{BED_PROFILES, LAYER_MEANS, WATER_PROFILES};

type SeriesRow<'a> = Row<'a, ParticleObserver>;

/// A measure of the bed; missing where there is none.
fn of_bed<T: Into<Value>>(row: &SeriesRow<'_>, value: impl FnOnce(&BedMeasures) -> T) -> Value {
    row.observer.found.as_ref().map(value).into()
}

/// A measure of the mound of the bed; missing where there is none.
fn of_mound(row: &SeriesRow<'_>, value: impl FnOnce(&Mound) -> Real) -> Value {
    row.observer.found.as_ref().and_then(|found| found.forms.mound.as_ref().ok()).map(value).into()
}

/// A measure of ripples by their crests; missing where there are none.
fn of_crests(row: &SeriesRow<'_>, value: impl FnOnce(&CrestedRipples) -> Real) -> Value {
    row.observer.found.as_ref().and_then(|found| found.forms.ripples.as_ref().ok()).map(value).into()
}

/// A value that only a tank with grains has.
fn with_grains(row: &SeriesRow<'_>, value: impl FnOnce(&TankSums) -> Real) -> Value {
    (!row.observer.gathered.grains.is_empty()).then(|| value(&row.observer.sums)).into()
}

/// One of the heights of the water's surface.
fn level(row: &SeriesRow<'_>, pick: fn(Real, Real) -> Real) -> Value {
    row.observer.water.points().map(|[_, z]| z).reduce(pick).into()
}

/// Upward force that carries the free grains over their submerged weight, in the last step.
fn carried_share(row: &SeriesRow<'_>) -> Value {
    let sums = row.step.map(|_| &row.observer.sums);
    sums.filter(|sums| sums.submerged_weight > 0.0).map(|sums| sums.carried_weight / sums.submerged_weight).into()
}

/// Columns of the series.
pub(in crate::recorder) const SERIES: &[SeriesCell<ParticleObserver>] = quantities! {
    ..pressure_iterations();
    "pressure_residual", "", "residual that the pressure solver left, as a volume strain in the step"
        => |row| of_step(row, |step| step.pressure.residual);
    "removed_mean_strain", "", "mean taken off the source of the pressure equation, so that it can be solved in a closed tank"
        => |row| of_step(row, |step| step.pressure.removed_mean);
    "strain_mean", "", "mean volume strain of the water away from its surface" => |row| of_step(row, |step| step.strain[0]);
    "strain_rms", "", "root mean square of the volume strain; below 3 % as a rule"
        => |row| of_step(row, |step| step.strain[1]);
    "surface_particles", "", "particles at the surface" => |row| of_step(row, |step| step.surface);
    "splash_particles", "", "isolated particles" => |row| of_step(row, |step| step.isolated);
    "uncorrected_gradients", "", "with the published scheme alone: particles whose neighbourhood is too thin for the corrected pressure gradient (GC); a few in spray"
        => |row| of_step(row, |step| step.uncorrected_gradients);
    "tensile_cutoffs", "", "wall particles at a film of water whose tension was cut off; tens as a rule"
        => |row| of_step(row, |step| step.tensile_cutoffs);
    "cut_coefficients", "", "coefficients of the pressure equation that were cut to zero"
        => |row| of_step(row, |step| step.pressure.cut_coefficients);
    "limited_rows", "", "particles beside the surface whose missing neighbours count as half a neighbourhood at most in the pressure equation; some in spray"
        => |row| of_step(row, |step| step.pressure.limited_rows);
    "stabilised_pairs", "", "with the published scheme alone: pairs that the dynamic stabilisation (DS) pushes apart; 0.7 to 0.9 of the number of fluid particles"
        => |row| of_step(row, |step| step.stabilised_pairs);
    "stabilisation_work", "J", "work of what keeps particles apart (negative: taken from the water): these pushes, or the damping of the default scheme"
        => |row| of_step(row, |step| step.stabilisation_work);
    "largest_viscosity", "m^2/s", "largest kinematic viscosity of the default scheme: that of the water, with `particles.turbulence` and eddies on top; 0 with the published one"
        => |row| of_step(row, |step| step.largest_viscosity);
    "largest_shift", "m", "longest displacement by particle shifting"
        => |row| of_step(row, |step| step.largest_shift);
    "collisions", "", "pairs nearer than half a spacing that collided; 0, at violent moments up to 5"
        => |row| of_step(row, |step| step.collisions);
    "clipped_particles", "", "particles put back from a wall; a few" => |row| of_step(row, |step| step.clipped);
    "limited_voids", "", "particles whose void fraction was raised to the least allowed; 0"
        => |row| of_step(row, |step| step.coupling.limited_voids);
    "least_void_fraction", "", "smallest void fraction of a particle, before it was raised"
        => |row| of_step(row, |step| step.coupling.least_void);
    "largest_fluid_speed", "m/s", "speed of the fastest fluid particle, against the tank" => |row| of_step(row, |step| step.largest_speed);
    "largest_grain_speed", "m/s", "speed of the fastest grain, against the tank" => |row| of_step(row, |step| step.contacts.largest_speed);
    ..grain_substeps();
    "contacts", "", "touching pairs of grains" => |row| of_step(row, |step| step.contacts.contacts);
    "largest_overlap", "", "largest overlap over the radius; below 5 %"
        => |row| of_step(row, |step| step.contacts.largest_overlap);
    "contact_force_over_submerged_weight", "", "force of walls and held grains on the free grains along x3 over their weight less that of the water they displace, under what does not change, gravity less `frame.acceleration` and a `drive.acceleration` by mass: 1 at rest, about 1 on the mean over a period; a bed that stays far below is carried by the water (fluidised)"
        => carried_share;
    "bulk_volume_relative_change", "", "change of the bulk volume of the water, with the room of the grains in it, since the start; 1e-3"
        => |row| row.observer.volume_change().into();
    "kinetic_energy_fluid", "J", "kinetic energy of the water" => |row| row.observer.sums.fluid_energy.into();
    "kinetic_energy_grains", "J", "kinetic energy of the grains" => |row| row.observer.sums.grain_energy.into();
    "potential_energy", "J", "potential energy of the water and of the grains, their weight less that of the water they displace, from the lower corner of the tank, against what does not change: gravity less `frame.acceleration`, and a `drive.acceleration` by mass; none along periodic sides"
        => |row| row.observer.sums.potential_energy.into();
    "momentum_1", "N s", "momentum of water and grains along x1, against the tank"
        => |row| row.observer.sums.momentum.x.into();
    "momentum_2", "N s", "along x2: with periodic sides only friction at the floor acts from outside, so it stays small beside the amplitude of `momentum_1`"
        => |row| row.observer.sums.momentum.y.into();
    "momentum_3", "N s", "momentum of water and grains along x3" => |row| row.observer.sums.momentum.z.into();
    "drag_exchange_residual", "N s", "impulse of the drag on grains and on water since the start, added; round-off"
        => |row| row.observer.momentum.impulses().drag_residual().length().into();
    "fluid_momentum_residual_1", "N s", "momentum along x1 that the water gained since the start beyond the impulses of body force, walls (pressure, friction, contact) and grains (drag, pressure)"
        => |row| row.observer.momentum.residual().x.into();
    "fluid_momentum_residual_2", "N s", "the same along x2" => |row| row.observer.momentum.residual().y.into();
    "fluid_momentum_residual_3", "N s", "along x3; at rest the weight of half a layer of particles, since the pressure vanishes in the middle of the particles at the surface"
        => |row| row.observer.momentum.residual().z.into();
    "departed_grains", "", "grains that have left through open sides so far"
        => |row| row.observer.departures.grains.into();
    "departed_mass", "kg", "their mass" => |row| row.observer.departures.mass.into();
    "fed_grains", "", "grains that were fed in so far" => |row| row.observer.arrivals.grains.into();
    "fed_mass", "kg", "their mass" => |row| row.observer.arrivals.mass.into();
    "grain_height", "m", "mean height of the grains above the floor" => |row| with_grains(row, |sums| sums.grain_height);
    "bed_law_share", "", "share of the grains under the drag law of dense beds (ratio of number densities above 0.4)"
        => |row| with_grains(row, |sums| sums.bed_share);
    "front", "m", "largest x1 of the water, isolated particles left out"
        => |row| Some(row.observer.sums.front).filter(|front| front.is_finite()).into();
    "water_level_mean", "m", "mean height of the water's surface, of the water averaged across the tank (x2)" => |row| row.observer.water.mean().into();
    "water_level_highest", "m", "highest point of that surface" => |row| level(row, Real::max);
    "water_level_lowest", "m", "lowest point of that surface" => |row| level(row, Real::min);
    "particles_above_rim", "", "particles beside walls above the top of an open box, where the walls end but still keep the water in; make the box higher if it is not 0"
        => |row| row.observer.rim.as_ref().map(|rim| rim.above).into();
    "bed_relief", "m", "root mean square of the bed's surface without its trend, all wavelengths"
        => |row| of_bed(row, |bed| bed.relief);
    "mound_wavelength", "m", "wavelength of the highest peak of the whole spectrum of the bed"
        => |row| of_mound(row, |mound| mound.wavelength);
    "mound_height", "m", "highest less lowest place of the bed without the waves of ripples; missing below a grain's size"
        => |row| of_mound(row, |mound| mound.height);
    "ripple_crests", "", "crests of at least a grain's size among waves as short as ripples, where the flow allows them"
        => |row| of_crests(row, |ripples| ripples.crests.len() as Real);
    "ripple_crest_spacing", "m", "wavelength of ripples: mean distance of these crests" => |row| of_crests(row, |ripples| ripples.wavelength);
    "ripple_crest_height", "m", "mean height of these crests above the troughs beside them"
        => |row| of_crests(row, |ripples| ripples.height);
    "suspended_grains", "", "grains that are not part of the bed" => |row| of_bed(row, |bed| bed.suspended);
};

/// Fields of `conservation` in the summary.
pub(in crate::recorder) const CONSERVATION: &[Field<ParticleObserver>] = quantities! {
    "departed_grains", "", "grains that have left through open sides" => |observer| json!(observer.departures.grains);
    "departed_mass", "kg", "their mass" => |observer| json!(observer.departures.mass);
    "departed_momentum", "N s", "momentum that they left with"
        => |observer| json!(observer.departures.momentum.to_array());
    "fed_grains", "", "grains that were fed in" => |observer| json!(observer.arrivals.grains);
    "fed_mass", "kg", "their mass" => |observer| json!(observer.arrivals.mass);
    "fed_momentum", "N s", "momentum that they had when forces began to move them"
        => |observer| json!(observer.arrivals.momentum.to_array());
    "liquid_volume_relative_change", "", "as `fluid_bulk_volume_relative_change`: of the bulk volume, with the room of the grains in the water, not of the water alone"
        => |observer| json!(observer.volume_change());
    "momentum_residual_relative", "", "largest part of `fluid_momentum_residual_relative`"
        => |observer| json!(observer.momentum.relative_residual().into_iter().flatten().reduce(Real::max));
    "fluid_bulk_volume_relative_change", "", "change of the bulk volume of the water since the start"
        => |observer| json!(observer.volume_change());
    "drag_exchange_residual_relative", "", "impulse of the drag on grains and on water added, over that on the water"
        => |observer| json!(observer.momentum.impulses().relative_drag_residual());
    "fluid_momentum_residual_relative", "", "momentum residual of the water over the impulse of the body force, direction by direction"
        => |observer| json!(observer.momentum.relative_residual());
};

/// A place of a surface, of the water or of the bed, at a time.
pub(in crate::recorder) struct SurfacePlace {
    time: Real,
    x: Real,
    height: Option<Real>,
}

/// Columns of the profiles of the water.
pub(in crate::recorder) const WATER: &[Cell<SurfacePlace>] = quantities! {
    "time", "s", "simulated time" => |at| at.time.into();
    "x", "m", "place along x1" => |at| at.x.into();
    "z", "m", "height of the water's surface" => |at| at.height.into();
};

/// Columns of the profiles of the bed.
pub(in crate::recorder) const BED: &[Cell<SurfacePlace>] = quantities! {
    "time", "s", "simulated time" => |at| at.time.into();
    "x", "m", "place along x1" => |at| at.x.into();
    "z_concentration", "m", "height of the bed: the highest place at which grains, averaged across the tank, take up 0.30 of the space"
        => |at| at.height.into();
};

/// Averages over a layer of the bed at a time.
pub(in crate::recorder) struct LayerAt<'a> {
    time: Real,
    name: &'static str,
    means: &'a LayerMeans,
}

/// Value of a column of the averages over layers.
pub(in crate::recorder) type LayerValue = fn(&LayerAt<'_>) -> Value;

/// Columns of the averages over layers.
pub(in crate::recorder) const LAYERS: &[Quantity<LayerValue>] = quantities! {
    "time", "s", "simulated time" => |at| at.time.into();
    "layer", "", "`lower` or `upper`" => |at| at.name.into();
    "water_velocity_1", "m/s", "mean velocity of the water along x1" => |at| at.means.water_velocity.into();
    "grain_velocity_1", "m/s", "mean velocity of the grains along x1" => |at| at.means.grain_velocity.into();
    "drag_1", "N", "mean drag on a grain along x1" => |at| at.means.drag.into();
    "pressure_force_1", "N", "mean force of the pressure on a grain along x1" => |at| at.means.pressure_force.into();
    "water_particles", "", "number of water particles" => |at| at.means.water_count.into();
    "grains", "", "number of grains" => |at| at.means.grain_count.into();
};

/// A row for each place of a surface at a time \[s].
fn rows(columns: &[Cell<SurfacePlace>], time: Real, surface: &SurfaceProfile) -> Vec<Vec<Value>> {
    let place = |n: usize| SurfacePlace { time, x: surface.x(n), height: surface.heights[n] };
    (0..surface.len()).map(|n| cells(columns, &place(n)).collect()).collect()
}

/// Adds what was measured last to the tables beside the series.
pub(super) fn tables(observer: &ParticleObserver, clock: &Clock, files: &mut Files) -> Result<(), RecordError> {
    let time = clock.time();
    files.add(WATER_PROFILES, || headings(WATER), clock, &rows(WATER, time, &observer.water))?;
    let Some(found) = &observer.found else { return Ok(()) };
    files.add(BED_PROFILES, || headings(BED), clock, &rows(BED, time, &found.bed))?;
    let layers = ["lower", "upper"].into_iter().zip(&found.layers);
    let rows: Vec<Vec<Value>> =
        layers.map(|(name, means)| cells(LAYERS, &LayerAt { time, name, means }).collect()).collect();
    files.add(LAYER_MEANS, || headings(LAYERS), clock, &rows)
}
