//! The files of a run: series, time series for ParaView, checkpoints.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use sazanami_io::checkpoint::CheckpointFolder;
use sazanami_io::table::{Column, SeriesWriter, Value};
use sazanami_io::vtk::{BodyFile, DataArray, ImageFile, PvdSeries, write_bodies, write_image};
use sazanami_io::{Bodies, BodyPose, BodySurface};
use sazanami_mics::solver::{Solver, StepReport};
use sazanami_mics::stability::Limit;
use sazanami_numerics::Real;
use sazanami_numerics::geometry::Shape;
use sazanami_observe::BedView;

use super::observers::Observers;
use super::summary::Fixed;
use super::{RecordError, Totals};
use crate::case::meaning::FieldPrecision;
use crate::case::resolved;
use crate::clock::Clock;
use crate::machine::Machine;
use crate::simulation::{Job, RankError};

/// Files of a run, open on rank 0.
pub(crate) struct Files {
    pub folder: PathBuf,
    pub fixed: Fixed,
    pub checkpoints: CheckpointFolder,
    series: SeriesWriter,
    profiles: Option<SeriesWriter>,
    fields: PvdSeries,
    grains: PvdSeries,
    precision: FieldPrecision,
    pub probes: Vec<Option<SeriesWriter>>,
    /// Time and step a resumed run goes on from.
    pub resumed_at: Option<(Real, u64)>,
}

impl Files {
    /// Opens the files of a run anew, or where it left them.
    pub fn open(job: &Job, resumed_at: Option<(Real, u64)>) -> Result<Self, RankError> {
        Self::open_files(job, resumed_at).map_err(RankError::from)
    }

    fn open_files(job: &Job, resumed_at: Option<(Real, u64)>) -> Result<Self, RecordError> {
        let (case, folder) = (job.case, job.folder.clone());
        for name in ["fields", "grains", "figures", "checkpoints"] {
            let path = folder.join(name);
            std::fs::create_dir_all(&path).map_err(|error| RecordError::Path { path, error })?;
        }
        if let Some(text) = &job.case_text {
            let path = folder.join("case.toml");
            std::fs::write(&path, text).map_err(|error| RecordError::Path { path, error })?;
        }
        let path = folder.join("series.csv");
        let (series, fields, grains) = match resumed_at {
            Some((time, step)) => (
                SeriesWriter::resume(&path, &columns(), step)?,
                PvdSeries::resume(&folder.join("fields.pvd"), time)?,
                PvdSeries::resume(&folder.join("grains.pvd"), time)?,
            ),
            None => (
                SeriesWriter::create(&path, &columns())?,
                PvdSeries::create(&folder.join("fields.pvd")),
                PvdSeries::create(&folder.join("grains.pvd")),
            ),
        };
        let machine = Machine::this();
        let fixed = Fixed {
            case: case.name.clone(),
            commit: job.options.commit.unwrap_or("unknown"),
            case_hash: format!("{:016x}", resolved::hash(case)),
            cpu: machine.cpu,
            cores: machine.cores,
            threads: job.threads,
            ranks: job.options.ranks.max(1),
            cells: case.domain.cell_count(),
            contact_spheres_by_shape: job.shapes.iter().map(|shape| shape.contact_spheres().len()).collect(),
        };
        let probes = case.probes.iter().map(|_| None).collect();
        Ok(Self {
            checkpoints: CheckpointFolder::new(folder.join("checkpoints"), case.checkpoint.keep),
            folder,
            fixed,
            series,
            profiles: None,
            fields,
            grains,
            precision: case.output.precision,
            probes,
            resumed_at,
        })
    }

    /// Adds a row to the series, and the bed's profile to its table.
    pub fn row(
        &mut self,
        clock: &Clock,
        step: Option<(Real, Limit, &StepReport)>,
        observers: &Observers,
        totals: &Totals,
    ) -> Result<(), RecordError> {
        self.series.record(clock.step(), &values(clock, step, observers, totals))?;
        let Some(erosion) = &observers.findings().erosion else { return Ok(()) };
        let heights = &erosion.profile.heights;
        if self.profiles.is_none() {
            let mut columns = vec![Column::new("time", "s"), Column::new("layer", "m")];
            columns.extend((0..heights.len()).map(|n| Column::new(&format!("height_{n}"), "m")));
            let path = self.folder.join("profiles.csv");
            self.profiles = Some(match self.resumed_at {
                Some((_, step)) => SeriesWriter::resume(&path, &columns, step)?,
                None => SeriesWriter::create(&path, &columns)?,
            });
        }
        let mut row = vec![Value::Real(clock.time()), Value::Real(erosion.profile.layer)];
        row.extend(heights.iter().map(|height| height.map_or(Value::Missing, Value::Real)));
        if let Some(profiles) = &mut self.profiles {
            profiles.record(clock.step(), &row)?;
        }
        Ok(())
    }

    /// Writes the grains for ParaView.
    pub fn grains(&mut self, clock: &Clock, observers: &Observers, shapes: &Arc<[Shape]>) -> Result<(), RecordError> {
        if observers.count() == 0 {
            return Ok(());
        }
        let name = format!("grains/grains-{:09}.vtp", clock.step());
        let path = self.folder.join(&name);
        let time = clock.time();
        observers.with_bed(|bed| {
            let (surfaces, poses) = (surfaces(shapes), poses(bed));
            let part = |d: usize| bed.velocity.iter().map(move |v| v[d]).collect::<Vec<Real>>();
            let velocity = [part(0), part(1), part(2)];
            let idle: Vec<Real> = match bed.last_contact {
                Some(last) => last.iter().map(|&last| (bed.time - last).min(1e9)).collect(),
                None => vec![0.0; bed.len()],
            };
            let arrays = [
                DataArray::rounded("speed", 1, bed.velocity.iter().map(|v| v.length())),
                DataArray::rounded_vectors("velocity", [&velocity[0], &velocity[1], &velocity[2]]),
                DataArray::rounded("height", 1, bed.position.iter().map(|x| x.z)),
                DataArray::rounded("time_since_contact", 1, idle),
            ];
            let file = BodyFile {
                bodies: Bodies { surfaces: &surfaces, poses: &poses },
                time: Some(time),
                arrays: &arrays,
                scalars: Some("speed"),
            };
            write_bodies(&path, &file)
        })?;
        self.grains.push(time, &name)?;
        Ok(())
    }

    fn image(
        &mut self,
        clock: &Clock,
        grid: &sazanami_numerics::grid::Grid,
        arrays: &[DataArray],
    ) -> Result<(), RecordError> {
        let name = format!("fields/fields-{:09}.vti", clock.step());
        let file = ImageFile { grid, time: Some(clock.time()), cells: arrays, scalars: Some("liquid_fraction") };
        write_image(&self.folder.join(&name), &file)?;
        self.fields.push(clock.time(), &name)?;
        Ok(())
    }

    /// Nothing is left unwritten: rows are flushed as they come.
    pub fn figure(&self, name: &str) -> PathBuf {
        self.folder.join("figures").join(name)
    }
}

/// Surfaces of the shapes for pictures and ParaView.
pub(crate) fn surfaces(shapes: &[Shape]) -> Vec<BodySurface<'_>> {
    shapes
        .iter()
        .map(|shape| BodySurface { nodes: &shape.surface().nodes, triangles: &shape.surface().triangles })
        .collect()
}

/// Poses of the grains, scaled.
pub(crate) fn poses(bed: &BedView) -> Vec<BodyPose> {
    (0..bed.len())
        .map(|n| BodyPose {
            surface: bed.body[n],
            scale: bed.scale[n],
            position: bed.position[n],
            orientation: bed.orientation[n],
        })
        .collect()
}

/// Writes the fields for ParaView. All ranks take part.
pub(crate) fn fields(solver: &Solver, clock: &Clock, files: Option<&mut Files>) -> Result<(), RecordError> {
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
pub(crate) struct Fractions {
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

fn columns() -> Vec<Column> {
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
    clock: &Clock,
    step: Option<(Real, Limit, &StepReport)>,
    observers: &Observers,
    totals: &Totals,
) -> Vec<Value> {
    let real = Value::Real;
    let count = |n: usize| Value::Count(n as u64);
    let mut row = vec![real(clock.time())];
    match step {
        Some((dt, limit, report)) => row.extend([
            real(dt),
            Value::Text(limit.name().to_owned()),
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
        real(step.map_or(0.0, |(_, _, report)| report.imprint.overfull_volume)),
        Value::Count(totals.tidied.out_of_range_cells),
        real(totals.tidied.clipped_volume),
    ]);
    let findings = observers.findings();
    let energies = observers.energies();
    let fastest = observers.with_bed(|bed| sazanami_observe::bed_profile::motion(bed).largest_speed);
    row.extend([
        real(findings.liquid_relative_change),
        real(findings.wet_relative_change),
        real(energies.fluid),
        real(energies.grains),
        real(fastest),
    ]);
    match observers.budget() {
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

/// Where a probe writes.
pub(crate) fn probe_path(folder: &Path, name: &str) -> PathBuf {
    folder.join("probes").join(format!("{name}.csv"))
}
