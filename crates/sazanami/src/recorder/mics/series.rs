//! Rows of the series, the bed's profile, and fields on the grid.

use sazanami_io::table::{Column, Value};
use sazanami_io::vtk::DataArray;
use sazanami_mics::solver::{Solver, StepReport};
use sazanami_numerics::Real;
use sazanami_observe::bed_profile;
use sazanami_observe::budget::MomentumBudget;
use sazanami_observe::erosion::Erosion;
use sazanami_observe::splash::Splash;

use super::GridBooks;
use crate::case::meaning::FieldPrecision;
use crate::clock::Clock;
use crate::recorder::bed::GrainsSeen;
use crate::recorder::books::Step;
use crate::recorder::columns::{LENGTH, Quantity, columns as named, length, missing};
use crate::recorder::files::Files;
use crate::recorder::{RecordError, Totals};
use crate::results::CRATER_PROFILES;

/// Adds a row to the series, and the bed's profile to its table.
pub(super) fn rows(
    books: &GridBooks,
    clock: &Clock,
    step: Option<&Step<'_, Solver>>,
    seen: &GrainsSeen,
    totals: &Totals,
    files: &mut Files,
) -> Result<(), RecordError> {
    files.row(clock, &values(books, clock, step, seen, totals))?;
    let Some(erosion) = &books.findings.erosion else { return Ok(()) };
    let heights = &erosion.profile.heights;
    let columns = || {
        let mut columns = vec![Column::new("time", "s"), Column::new("layer", "m")];
        columns.extend((0..heights.len()).map(|n| Column::new(&format!("height_{n}"), "m")));
        columns
    };
    let mut row: Vec<Value> = vec![clock.time().into(), erosion.profile.layer.into()];
    row.extend(heights.iter().map(|&height| Value::from(height)));
    files.add(CRATER_PROFILES, columns, clock, &[row])
}

/// Writes the fields for ParaView. All ranks take part.
pub(super) fn fields(solver: &Solver, clock: &Clock, files: Option<&mut Files>) -> Result<(), RecordError> {
    let domain = solver.domain();
    let flow = solver.flow();
    let Fractions { liquid, solid } = Fractions::gather(solver);
    let pressure = domain.gather(solver.pressure());
    let velocity = flow.velocity.each_ref().map(|u| domain.gather(u));
    let Some(files) = files else { return Ok(()) };
    let outside = solid.as_ref().map(|solid| outside_grains(&liquid, solid));
    let mut scalars = vec![("liquid_fraction", &liquid), ("pressure", &pressure)];
    scalars.extend(outside.as_ref().map(|values| ("liquid_outside_grains", values)));
    scalars.extend(solid.as_ref().map(|values| ("solid_fraction", values)));
    let parts = velocity.each_ref().map(Vec::as_slice);
    let mut arrays = Vec::new();
    for (name, values) in scalars {
        arrays.push(match files.precision {
            FieldPrecision::Single => DataArray::rounded(name, 1, values.iter().copied()),
            FieldPrecision::Double => DataArray::new(name, 1, values),
        });
    }
    arrays.push(match files.precision {
        FieldPrecision::Single => DataArray::rounded_vectors("velocity", parts),
        FieldPrecision::Double => DataArray::vectors("velocity", parts),
    });
    files.image(clock, domain.grid(), &arrays)
}

/// Parts of the cells of the whole box, on rank 0.
pub(super) struct Fractions {
    /// Volume fraction that the flow transports, within grains too.
    pub liquid: Vec<Real>,
    /// Part covered by grains; `None` without grains.
    pub solid: Option<Vec<Real>>,
}

impl Fractions {
    /// Gathers both. All ranks take part.
    pub fn gather(solver: &Solver) -> Self {
        let (domain, grains) = (solver.domain(), solver.grains());
        let liquid = domain.gather(&solver.flow().volume_fraction);
        let solid = (!grains.is_empty()).then(|| domain.gather(&grains.covered().solid_fraction));
        // Grains may overlap: a cell holds no more than itself.
        let solid = solid.map(|parts| parts.into_iter().map(|alpha| alpha.min(1.0)).collect());
        Self { liquid, solid }
    }

    /// Part of each cell that is liquid outside grains.
    pub fn outside_grains(self) -> Vec<Real> {
        match &self.solid {
            Some(solid) => outside_grains(&self.liquid, solid),
            None => self.liquid,
        }
    }
}

/// Of each cell that part of the liquid that lies outside grains, from its volume fraction and the covered part.
fn outside_grains(liquid: &[Real], solid: &[Real]) -> Vec<Real> {
    liquid.iter().zip(solid).map(|(c, alpha)| c * (1.0 - alpha)).collect()
}

/// Time of a row.
const TIME: [Quantity; 1] = [("time", "s")];
/// What the last step did.
const OF_STEP: [Quantity; 8] = [
    ("fluid_passes", ""),
    ("pressure_iterations", ""),
    ("divergence", ""),
    ("courant", ""),
    ("grain_substeps", ""),
    ("contact_pairs", ""),
    ("contacts", ""),
    ("largest_overlap", ""),
];
/// What had to be tidied up.
const TIDIED: [Quantity; 4] =
    [("deep_contacts", ""), ("overfull_volume", "m^3"), ("out_of_range_cells", ""), ("clipped_volume", "m^3")];
/// What is kept, or should be, and how it moves.
const CONSERVED: [Quantity; 5] = [
    ("liquid_volume_relative_change", ""),
    ("wet_liquid_volume_relative_change", ""),
    ("kinetic_energy_fluid", "J"),
    ("kinetic_energy_grains", "J"),
    ("largest_grain_speed", "m/s"),
];
/// Where the upward momentum is, and where it came from.
const MOMENTUM: [Quantity; 13] = [
    ("momentum_liquid_3", "N s"),
    ("momentum_gas_3", "N s"),
    ("momentum_grains_3", "N s"),
    ("momentum_displaced_3", "N s"),
    ("momentum_owed_3", "N s"),
    ("impulse_walls_on_fluid_3", "N s"),
    ("impulse_walls_on_grains_3", "N s"),
    ("impulse_gravity_3", "N s"),
    ("impulse_swallowed_3", "N s"),
    ("impulse_open_sides_3", "N s"),
    ("impulse_held_grains_3", "N s"),
    ("momentum_residual_3", "N s"),
    ("momentum_residual_relative", ""),
];
/// How far the liquid reaches.
const FRONT: [Quantity; 1] = [("front", "m")];
/// The crater.
const CRATER: [Quantity; 5] = [
    ("crater_depth", "m"),
    ("rim_radius", "m"),
    ("erosion_volume", "m^3"),
    ("erosion_volume_direct", "m^3"),
    ("erosion_volume_excavated", "m^3"),
];
/// Grains that were splashed.
const SPLASH: [Quantity; 3] = [("splashed_grains", ""), ("splashed_mass", "kg"), ("splash_distance", "m")];

pub(super) fn columns() -> Vec<Column> {
    named(&[&TIME, &LENGTH, &OF_STEP, &TIDIED, &CONSERVED, &MOMENTUM, &FRONT, &CRATER, &SPLASH])
}

fn values(
    books: &GridBooks,
    clock: &Clock,
    step: Option<&Step<'_, Solver>>,
    seen: &GrainsSeen,
    totals: &Totals,
) -> Vec<Value> {
    let findings = &books.findings;
    let mut row = vec![clock.time().into()];
    row.extend(step.map_or_else(missing, |step| length(step, totals)));
    row.extend(step.map_or_else(missing, |step| of_step(step.report)));
    row.extend(tidied(step, totals));
    row.extend(conserved(books, seen));
    row.extend(books.momentum.as_ref().map_or_else(missing, momentum));
    row.push(books.front.into());
    row.extend(findings.erosion.as_ref().map_or_else(missing, crater));
    row.extend(findings.splash.as_ref().map_or_else(missing, splash));
    row
}

fn of_step(report: &StepReport) -> [Value; OF_STEP.len()] {
    let contacts = &report.contacts;
    [
        report.fluid_passes.into(),
        report.pressure.iterations.into(),
        report.pressure.divergence.into(),
        report.courant.into(),
        contacts.substeps.into(),
        contacts.pairs.into(),
        contacts.contacts.into(),
        contacts.largest_overlap.into(),
    ]
}

fn tidied(step: Option<&Step<'_, Solver>>, totals: &Totals) -> [Value; TIDIED.len()] {
    let tidied = &totals.tidied;
    [
        tidied.deep_contacts.into(),
        step.map_or(0.0, |step| step.report.imprint.overfull_volume).into(),
        tidied.out_of_range_cells.into(),
        tidied.clipped_volume.into(),
    ]
}

fn conserved(books: &GridBooks, seen: &GrainsSeen) -> [Value; CONSERVED.len()] {
    let (findings, energies) = (&books.findings, books.energies);
    [
        findings.liquid_relative_change.into(),
        findings.wet_relative_change.into(),
        energies.fluid.into(),
        energies.grains.into(),
        seen.with_bed(|bed| bed_profile::motion(bed).largest_speed).into(),
    ]
}

fn momentum(budget: &MomentumBudget) -> [Value; MOMENTUM.len()] {
    let (stored, impulses) = (budget.stored(), budget.impulses());
    [
        stored.liquid.z.into(),
        stored.gas.z.into(),
        stored.grains.z.into(),
        stored.displaced.z.into(),
        stored.deferred.z.into(),
        impulses.walls_on_fluid.z.into(),
        impulses.walls_on_grains.z.into(),
        (impulses.gravity_on_fluid + impulses.gravity_on_grains).z.into(),
        impulses.displaced_mass_flux.z.into(),
        impulses.open_sides.z.into(),
        impulses.held_grains.z.into(),
        budget.residual().z.into(),
        budget.relative_residual().into(),
    ]
}

fn crater(erosion: &Erosion) -> [Value; CRATER.len()] {
    let crater = &erosion.crater;
    [
        crater.depth.into(),
        crater.rim_radius.into(),
        crater.volume.into(),
        crater.volume_direct.into(),
        erosion.volume_excavated.into(),
    ]
}

fn splash(splash: &Splash) -> [Value; SPLASH.len()] {
    [splash.grains.into(), splash.mass.into(), splash.farthest_distance.into()]
}
