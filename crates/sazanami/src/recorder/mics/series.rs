//! Columns of the series, the bed's profile, and fields on the grid.

use sazanami_io::table::{Column, Value};
use sazanami_io::vtk::{DataArray, ImageFile};
use sazanami_mics::momentum::{Impulses, StoredMomentum};
use sazanami_mics::solver::Solver;
use sazanami_numerics::Real;
use sazanami_numerics::choice::Choice;
use sazanami_numerics::grid::Grid;
use sazanami_observe::bed_profile;
use sazanami_observe::budget::MomentumBudget;
use sazanami_observe::erosion::Erosion;
use sazanami_observe::splash::Splash;

use super::{GridObserver, Interface, Soaked, liquid_share};
use crate::clock::Clock;
use crate::columns::{Quantity, cells, headings, quantities};
use crate::job::{Job, RecordError};
use crate::recorder::columns::{grain_substeps, of_step, pressure_iterations};
use crate::recorder::files::Files;
use crate::recorder::observer::{Output, Row, SeriesCell};
use crate::results::CRATER_PROFILES;
use crate::state::{Array, WaterState};

type SeriesRow<'a> = Row<'a, GridObserver>;

/// A term of the momentum budget [N s].
fn of_budget<T: Into<Value>>(row: &SeriesRow<'_>, value: impl FnOnce(&MomentumBudget) -> T) -> Value {
    row.observer.momentum.as_ref().map(value).into()
}

/// A term of the stored momentum [N s].
fn of_stored(row: &SeriesRow<'_>, value: impl FnOnce(&StoredMomentum) -> Real) -> Value {
    of_budget(row, |budget| value(&StoredMomentum::from_terms(budget.stored().map(|(_, term)| term))))
}

/// An impulse since the start [N s].
fn of_impulses(row: &SeriesRow<'_>, value: impl FnOnce(&Impulses) -> Real) -> Value {
    of_budget(row, |budget| value(&Impulses::from_terms(budget.impulses().map(|(_, impulse)| impulse))))
}

/// A measure of the interface; missing without surface tension.
fn of_interface<T: Into<Value>>(row: &SeriesRow<'_>, value: impl FnOnce(&Interface) -> T) -> Value {
    row.observer.interface.as_ref().map(value).into()
}

/// A measure of the crater; missing where there is none.
fn of_crater<T: Into<Value>>(row: &SeriesRow<'_>, value: impl FnOnce(&Erosion) -> T) -> Value {
    row.observer.findings.erosion.as_ref().map(value).into()
}

/// A measure of the liquid in the bed.
fn of_soaked(row: &SeriesRow<'_>, value: impl FnOnce(&Soaked) -> Real) -> Value {
    row.observer.findings.soaked.as_ref().map(value).into()
}

/// A measure of the splash.
fn of_splash<T: Into<Value>>(row: &SeriesRow<'_>, value: impl FnOnce(&Splash) -> T) -> Value {
    row.observer.findings.splash.as_ref().map(value).into()
}

/// Columns of the series.
pub(in crate::recorder) const SERIES: &[SeriesCell<GridObserver>] = quantities! {
    "fluid_passes", "", "passes of the fluid in the last step" => |row| of_step(row, |step| step.fluid_passes);
    ..pressure_iterations();
    "divergence", "", "largest `abs(div u) dt` that the projection left"
        => |row| of_step(row, |step| step.pressure.divergence);
    "courant", "", "advective Courant number of the last step" => |row| of_step(row, |step| step.courant);
    ..grain_substeps();
    "contact_pairs", "", "pairs of touching grains" => |row| of_step(row, |step| step.contacts.pairs);
    "contacts", "", "touching pairs of contact spheres" => |row| of_step(row, |step| step.contacts.contacts);
    "largest_overlap", "", "largest overlap over the smaller contact sphere's radius"
        => |row| of_step(row, |step| step.contacts.largest_overlap);
    "deep_contacts", "", "contacts so far that became deeper than 20 % of a contact sphere's radius, those of the packing included"
        => |row| row.totals.corrections.deep_contacts.into();
    "overfull_volume", "m^3", "volume by which grains overlap within cells"
        => |row| row.step.map_or(0.0, |step| step.report.imprint.overfull_volume).into();
    "out_of_range_cells", "", "cells so far whose liquid fraction left the range 0 to 1 by more than 1e-9"
        => |row| row.totals.corrections.out_of_range_cells.into();
    "clipped_volume", "m^3", "liquid volume added so far by clipping liquid fractions (negative: removed)"
        => |row| row.totals.corrections.clipped_volume.into();
    "liquid_volume_relative_change", "", "what of the change of the liquid volume since the start did not come through sides of the box, over the volume at the start: an error"
        => |row| row.observer.findings.liquid_relative_change.into();
    "wet_liquid_volume_relative_change", "", "the same of the liquid outside grains: with `exchange = \"stress\"` liquid that grains cover counts as lost"
        => |row| row.observer.findings.wet_relative_change.into();
    "kinetic_energy_fluid", "J", "kinetic energy of liquid and gas" => |row| row.observer.energies.fluid.into();
    "kinetic_energy_grains", "J", "kinetic energy of the grains" => |row| row.observer.energies.grains.into();
    "largest_grain_speed", "m/s", "speed of the fastest grain"
        => |row| row.grains.with_bed(|bed| bed_profile::motion(bed).largest_speed).into();
    "departed_grains", "", "grains that have left through open sides so far"
        => |row| row.observer.departures.grains.into();
    "departed_mass", "kg", "their mass" => |row| row.observer.departures.mass.into();
    "fed_grains", "", "grains that were fed in so far" => |row| row.observer.arrivals.grains.into();
    "fed_mass", "kg", "their mass" => |row| row.observer.arrivals.mass.into();
    "momentum_liquid_3", "N s", "momentum of the liquid along x3" => |row| of_stored(row, |stored| stored.liquid.z);
    "momentum_gas_3", "N s", "momentum of the gas along x3" => |row| of_stored(row, |stored| stored.gas.z);
    "momentum_grains_3", "N s", "momentum of the grains along x3" => |row| of_stored(row, |stored| stored.grains.z);
    "momentum_displaced_3", "N s", "momentum of the fluid on the covered part of the cells, or that grains displace"
        => |row| of_stored(row, |stored| stored.displaced.z);
    "impulse_walls_on_fluid_3", "N s", "impulse of the walls on the fluid along x3 since the start"
        => |row| of_impulses(row, |impulses| impulses.walls_on_fluid.z);
    "impulse_walls_on_grains_3", "N s", "impulse of the walls on the grains along x3"
        => |row| of_impulses(row, |impulses| impulses.walls_on_grains.z);
    "impulse_gravity_3", "N s", "impulse of gravity on fluid and grains along x3"
        => |row| of_impulses(row, |impulses| (impulses.gravity_on_fluid + impulses.gravity_on_grains).z);
    "impulse_displaced_mass_flux_3", "N s", "momentum brought by the fluid that grains displace"
        => |row| of_impulses(row, |impulses| impulses.displaced_mass_flux.z);
    "impulse_open_sides_3", "N s", "momentum through open sides along x3, that of grains that leave or are fed in included"
        => |row| of_impulses(row, |impulses| impulses.open_sides.z);
    "impulse_held_grains_3", "N s", "impulse on grains that are held, along x3"
        => |row| of_impulses(row, |impulses| impulses.held_grains.z);
    "impulse_residue_3", "N s", "momentum along x3 that liquid brought or took as it was clipped, and that cells without grains were too light to take: an error"
        => |row| of_impulses(row, |impulses| impulses.residue.z);
    "momentum_residual_3", "N s", "change of the momentum less all impulses"
        => |row| of_budget(row, |budget| budget.residual().z);
    "momentum_residual_relative", "", "the residual of all directions over the largest term of the budget, or over the momentum that all that moves would have along one direction if that is more"
        => |row| of_budget(row, MomentumBudget::relative_residual);
    "front", "m", "largest x1 that the interface reaches in a row of cells, by the liquid of its last cell at least half full and of the next"
        => |row| row.observer.front.into();
};

/// Columns of the series of a run with surface tension.
pub(in crate::recorder) const INTERFACE: &[SeriesCell<GridObserver>] = quantities! {
    "surface_energy", "J", "surface tension times the area of the interface, less what walls with a contact angle give where they are wet; sure to 4 %"
        => |row| of_interface(row, |interface| interface.energy);
    "largest_fluid_speed", "m/s", "largest speed of liquid and gas in a cell"
        => |row| of_interface(row, |interface| interface.speed);
    "velocity_deviation", "m/s", "root mean square by mass, outside grains, of the difference of the velocity from its mean"
        => |row| of_interface(row, |interface| interface.deviation);
    "gas_centre_1", "m", "mean x1 of the gas outside grains, across periodic sides where it lies together; empty where there is none"
        => |row| of_interface(row, |interface| interface.gas_centre.map(|centre| centre.x));
    "gas_centre_3", "m", "mean x3 of the gas, the same; empty where there is none"
        => |row| of_interface(row, |interface| interface.gas_centre.map(|centre| centre.z));
    "curvature_by_columns", "", "cells whose curvature came from heights in columns in the last step"
        => |row| of_step(row, |step| step.pressure.surface_tension.by_columns);
    "curvature_by_fit", "", "cells whose curvature came from a fit in the last step"
        => |row| of_step(row, |step| step.pressure.surface_tension.by_fit);
    "curvature_limited", "", "cells whose curvature was set to that of a sphere of a cell's radius in the last step"
        => |row| of_step(row, |step| step.pressure.surface_tension.limited);
    "curvature_unknown", "", "cells with an interface whose curvature could not be told in the last step"
        => |row| of_step(row, |step| step.pressure.surface_tension.unknown);
    "impulse_surface_tension_1", "N s", "impulse of surface tension along x1 since the start: zero but for errors of the curvature, and where walls hold the interface"
        => |row| of_impulses(row, |impulses| impulses.surface_tension.x);
    "impulse_surface_tension_3", "N s", "the same along x3"
        => |row| of_impulses(row, |impulses| impulses.surface_tension.z);
};

/// Columns of the series of a run whose crater is evaluated.
pub(in crate::recorder) const CRATER: &[SeriesCell<GridObserver>] = quantities! {
    "crater_depth", "m", "depth of the crater below its rim, H" => |row| of_crater(row, |erosion| erosion.crater.depth);
    "rim_radius", "m", "distance of the rim from the axis, L" => |row| of_crater(row, |erosion| erosion.crater.rim_radius);
    "erosion_volume_below_rim", "m^3", "volume of the crater below the plane of its rim"
        => |row| of_crater(row, |erosion| erosion.crater.volume_direct);
    "erosion_volume", "m^3", "erosion volume V, eq. (14) of Yagyu et al. (2015)"
        => |row| of_crater(row, |erosion| erosion.crater.volume);
    "erosion_volume_excavated", "m^3", "volume below the bed's surface before the impact"
        => |row| of_crater(row, |erosion| erosion.volume_excavated);
    "wetted_depth", "m", "from the bed's mean surface before the impact to the lowest interface of a cell at least half full"
        => |row| of_soaked(row, |soaked| soaked.depth);
    "soaked_volume", "m^3", "volume of the liquid outside grains below that surface"
        => |row| of_soaked(row, |soaked| soaked.volume);
    "splashed_grains", "", "grains that have left the bed" => |row| of_splash(row, |splash| splash.grains);
    "splashed_mass", "kg", "mass of these grains" => |row| of_splash(row, |splash| splash.mass);
    "splash_distance", "m", "distance of the farthest of them from the axis"
        => |row| of_splash(row, |splash| splash.farthest_distance);
};

/// Value of a column of the profiles.
type ProfileValue = fn(&(&Clock, &Erosion)) -> Value;

/// The first columns of the table of the crater's profiles; the smoothed height of each layer about the axis follows.
pub(in crate::recorder) const PROFILE: &[Quantity<ProfileValue>] = quantities! {
    "time", "s", "simulated time" => |(clock, _)| clock.time().into();
    "layer", "m", "width of a layer about the axis" => |(_, erosion)| erosion.profile.layer.into();
};

/// Adds the crater's profile to its table.
pub(super) fn tables(observer: &GridObserver, clock: &Clock, files: &mut Files) -> Result<(), RecordError> {
    let Some(erosion) = &observer.findings.erosion else { return Ok(()) };
    let heights = &erosion.profile.heights;
    let columns = || {
        let numbered = (0..heights.len()).map(|n| Column::new(&format!("height_{n}"), "m"));
        headings(PROFILE).into_iter().chain(numbered).collect()
    };
    let mut row: Vec<Value> = cells(PROFILE, &(clock, erosion)).collect();
    row.extend(heights.iter().map(|&height| Value::from(height)));
    files.add(CRATER_PROFILES, columns, clock, &[row])
}

/// Writes the fields for ParaView. All ranks take part.
pub(super) fn fields(solver: &Solver, Output { job, clock, files }: Output) -> Result<(), RecordError> {
    let (Some((grid, mut values)), Some(files)) = (gathered(solver, job, clock), files) else { return Ok(()) };
    // Files have the scalars first.
    values.rotate_left(1);
    let arrays: Vec<DataArray> = values.iter().map(|array| array.in_file(files.precision)).collect();
    let (time, frame) = (Some(clock.time()), Some(job.case.output.frame.word()));
    files.image(clock, &ImageFile { grid: &grid, time, cells: &arrays, scalars: Some("liquid_fraction"), frame })
}

/// The water as arrays, by the names of its files; on rank 0. All ranks take part.
pub(super) fn state(solver: &Solver, job: &Job, clock: &Clock) -> Option<WaterState> {
    gathered(solver, job, clock).map(|(grid, arrays)| WaterState::Grid { grid, arrays })
}

/// The grid in the frame that is written and the values in its cells, the velocity first; on rank 0. All ranks take part.
fn gathered(solver: &Solver, job: &Job, clock: &Clock) -> Option<(Grid, Vec<Array>)> {
    let domain = solver.domain();
    let Fractions { liquid, beside_grains } = Fractions::gather(solver);
    let pressure = domain.gather(solver.pressure());
    let mut velocity = solver.flow().velocity.each_ref().map(|u| domain.gather(u));
    if domain.communicator().rank() != 0 {
        return None;
    }
    let [shift, drift] = job.case.to_written_frame(clock.time());
    for (u, drift) in velocity.iter_mut().zip(drift.to_array()).filter(|(_, drift)| *drift != 0.0) {
        u.iter_mut().for_each(|u| *u += drift);
    }
    let [u, v, w] = &velocity;
    let velocity = u.iter().zip(v).zip(w).flat_map(|((&u, &v), &w)| [u, v, w]);
    let mut arrays = vec![Array::reals("velocity", 3, velocity)];
    let mut scalars = vec![("liquid_fraction", liquid), ("pressure", pressure)];
    if let Some([solid, outside]) = beside_grains {
        scalars.extend([("liquid_outside_grains", outside), ("solid_fraction", solid)]);
    }
    arrays.extend(scalars.into_iter().map(|(name, values)| Array::reals(name, 1, values)));
    let grid = Grid { lower: domain.grid().lower + shift, ..*domain.grid() };
    Some((grid, arrays))
}

/// Parts of the cells of the whole box, on rank 0.
pub(super) struct Fractions {
    /// Share of the liquid: of the cell, within grains too, or of its open part if liquid has only that as its room (NaN where there
    /// is none).
    pub liquid: Vec<Real>,
    /// Parts of each cell covered by grains, and liquid outside them; `None` without grains.
    pub beside_grains: Option<[Vec<Real>; 2]>,
}

impl Fractions {
    /// Gathers them. All ranks take part.
    pub fn gather(solver: &Solver) -> Self {
        let (domain, grains) = (solver.domain(), solver.grains());
        if grains.is_empty() {
            return Self { liquid: domain.gather(&solver.flow().volume_fraction), beside_grains: None };
        }
        // Grains may overlap: a cell holds no more than itself.
        let covered = domain.gather(&grains.covered().solid_fraction);
        let solid: Vec<Real> = covered.into_iter().map(|alpha| alpha.min(1.0)).collect();
        if !solver.has_open_room() {
            let liquid = domain.gather(&solver.flow().volume_fraction);
            let outside = liquid.iter().zip(&solid).map(|(c, alpha)| c * (1.0 - alpha)).collect();
            return Self { liquid, beside_grains: Some([solid, outside]) };
        }
        let gather = |of: &(dyn Fn(usize) -> Real + Sync)| {
            let mut field = domain.field(0.0);
            domain.for_each_row(&domain.interior(), field.data_mut(), |row, values| {
                values.iter_mut().zip(row.shifted(0)).for_each(|(value, at)| *value = of(at));
            });
            domain.gather(&field)
        };
        let liquid = gather(&|at| liquid_share(solver, at).unwrap_or(Real::NAN));
        Self { liquid, beside_grains: Some([solid, gather(&|at| solver.liquid_and_room(at)[0])]) }
    }

    /// Part of each cell that is liquid outside grains.
    pub fn outside_grains(self) -> Vec<Real> {
        self.beside_grains.map_or(self.liquid, |[_, outside]| outside)
    }
}
