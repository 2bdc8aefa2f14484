//! Rows of the series, the bed's profile, and fields on the grid.

use sazanami_io::table::{Column, Value};
use sazanami_io::vtk::DataArray;
use sazanami_mics::solver::Solver;
use sazanami_numerics::Real;

use super::GridBooks;
use crate::case::meaning::FieldPrecision;
use crate::clock::Clock;
use crate::recorder::bed::GrainsSeen;
use crate::recorder::books::Step;
use crate::recorder::files::Files;
use crate::recorder::{RecordError, Totals};

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
    let mut row = vec![Value::Real(clock.time()), Value::Real(erosion.profile.layer)];
    row.extend(heights.iter().map(|height| height.map_or(Value::Missing, Value::Real)));
    files.add("profiles.csv", columns, clock, &[row])
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

pub(super) fn columns() -> Vec<Column> {
    let named = [
        ("time", "s"),
        ("dt", "s"),
        ("limiter", ""),
        ("fluid_passes", ""),
        ("pressure_iterations", ""),
        ("divergence", ""),
        ("courant", ""),
        ("grain_substeps", ""),
        ("contact_pairs", ""),
        ("contacts", ""),
        ("largest_overlap", ""),
        ("deep_contacts", ""),
        ("overfull_volume", "m^3"),
        ("out_of_range_cells", ""),
        ("clipped_volume", "m^3"),
        ("liquid_volume_relative_change", ""),
        ("wet_liquid_volume_relative_change", ""),
        ("kinetic_energy_fluid", "J"),
        ("kinetic_energy_grains", "J"),
        ("largest_grain_speed", "m/s"),
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
        ("front", "m"),
        ("crater_depth", "m"),
        ("rim_radius", "m"),
        ("erosion_volume", "m^3"),
        ("erosion_volume_direct", "m^3"),
        ("erosion_volume_excavated", "m^3"),
        ("splashed_grains", ""),
        ("splashed_mass", "kg"),
        ("splash_distance", "m"),
    ];
    named.iter().map(|(name, unit)| Column::new(name, unit)).collect()
}

fn values(
    books: &GridBooks,
    clock: &Clock,
    step: Option<&Step<'_, Solver>>,
    seen: &GrainsSeen,
    totals: &Totals,
) -> Vec<Value> {
    let real = Value::Real;
    let count = |n: usize| Value::Count(n as u64);
    let mut row = vec![real(clock.time())];
    match step {
        Some(Step { dt, limit, report }) => row.extend([
            real(*dt),
            Value::Text((*limit).to_owned()),
            count(report.fluid_passes),
            count(report.pressure.iterations),
            real(report.pressure.divergence),
            real(report.courant),
            count(report.contacts.substeps),
            count(report.contacts.pairs),
            count(report.contacts.contacts),
            real(report.contacts.largest_overlap),
        ]),
        None => row.extend(std::iter::repeat_with(|| Value::Missing).take(10)),
    }
    row.extend([
        count(totals.tidied.deep_contacts),
        real(step.map_or(0.0, |step| step.report.imprint.overfull_volume)),
        Value::Count(totals.tidied.out_of_range_cells),
        real(totals.tidied.clipped_volume),
    ]);
    let findings = &books.findings;
    let energies = books.energies;
    let fastest = seen.with_bed(|bed| sazanami_observe::bed_profile::motion(bed).largest_speed);
    row.extend([
        real(findings.liquid_relative_change),
        real(findings.wet_relative_change),
        real(energies.fluid),
        real(energies.grains),
        real(fastest),
    ]);
    match &books.momentum {
        Some(budget) => {
            let stock = budget.stock();
            let i = budget.impulses();
            let gravity = i.gravity_on_fluid + i.gravity_on_grains;
            let vectors = [
                stock.liquid,
                stock.gas,
                stock.grains,
                stock.displaced,
                stock.owed_to_grains,
                i.walls_on_fluid,
                i.walls_on_grains,
                gravity,
                i.swallowed,
                i.open_sides,
                i.held_grains,
                budget.residual(),
            ];
            row.extend(vectors.map(|vector| real(vector.z)));
            row.push(real(budget.relative_residual()));
        }
        None => row.extend(std::iter::repeat_with(|| Value::Missing).take(13)),
    }
    row.push(books.front.map_or(Value::Missing, real));
    match &findings.erosion {
        Some(erosion) => row.extend([
            real(erosion.crater.depth),
            real(erosion.crater.rim_radius),
            real(erosion.crater.volume),
            real(erosion.crater.volume_direct),
            erosion.volume_excavated.map_or(Value::Missing, Value::Real),
        ]),
        None => row.extend(std::iter::repeat_with(|| Value::Missing).take(5)),
    }
    match &findings.splash {
        Some(splash) => row.extend([count(splash.grains), real(splash.mass), real(splash.farthest_distance)]),
        None => row.extend(std::iter::repeat_with(|| Value::Missing).take(3)),
    }
    row
}
