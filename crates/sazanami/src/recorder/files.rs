//! The files of a run: series, time series for ParaView, checkpoints.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use sazanami_io::checkpoint::CheckpointFolder;
use sazanami_io::replace_file;
use sazanami_io::table::{Column, SeriesWriter, TableError, Value, fields, unquoted};
use sazanami_io::vtk::{ImageFile, PointFile, PvdSeries, write_image, write_points};
use sazanami_numerics::Real;

use super::drawing::Drawing;
use super::grain_files::{GrainStates, write_glyph};
use crate::case::meaning::FieldPrecision;
use crate::clock::Clock;
use crate::columns::SeriesParts;
use crate::job::{History, Job, RecordError, RunState, Workers};
use crate::machine::Machine;
use crate::results::{
    CASE, CHECKPOINTS, FIELD_SERIES, FIELDS, FIGURES, GRAIN_SERIES, GRAINS, MESH_SERIES, PROBES, SERIES,
};
use crate::state::Array;
use sazanami_numerics::choice::Choice;
use sazanami_posing::assembly::fluid::{entry_pressure, surface_tension_coefficient};

/// Time \[s] and step a resumed run goes on from.
type Left = Option<(Real, u64)>;

/// The parts of the summary that do not change during a run.
#[derive(Clone, Debug)]
pub(crate) struct Fixed {
    pub solver: &'static str,
    pub case: String,
    pub commit: &'static str,
    pub case_hash: String,
    pub history: Option<History>,
    pub cpu: String,
    pub cores: usize,
    pub workers: Workers,
    pub cells: usize,
    pub contact_spheres_by_shape: Vec<usize>,
}

/// Files of a run, open on rank 0.
pub(crate) struct Files {
    pub folder: PathBuf,
    /// Pictures that are being drawn.
    pub drawing: Drawing,
    pub fixed: Fixed,
    pub checkpoints: CheckpointFolder,
    series: SeriesWriter,
    /// Parts of the series.
    pub parts: SeriesParts,
    tables: BTreeMap<&'static str, SeriesWriter>,
    fields: PvdSeries,
    grains: PvdSeries,
    meshes: PvdSeries,
    /// Whether the glyphs of the shapes were written.
    has_glyphs: bool,
    pub precision: FieldPrecision,
    probes: Vec<Option<SeriesWriter>>,
    resumed_at: Left,
}

impl Files {
    /// Opens the files of a run anew, or where it left them.
    ///
    /// `columns` are those of the series of such parts.
    pub fn open(job: &Job, columns: fn(SeriesParts) -> Vec<Column>, resumed_at: Left) -> Result<Self, RecordError> {
        let (case, folder) = (job.case, job.folder.clone());
        let series = folder.join(SERIES);
        // Earlier versions wrote the columns of a crater, empty, where there was none to evaluate.
        let crater = case.erosion.is_some() || resumed_at.is_some() && has_column(&series, "crater_depth");
        let parts = SeriesParts {
            crater,
            surface_tension: surface_tension_coefficient(case).is_some() || entry_pressure(case).is_some(),
            mean_flow: case.mean_flow().is_some(),
            moving_box: case.follows_liquid(),
            bridges: case.dem.bridges.is_some(),
        };
        for name in [FIELDS, GRAINS, FIGURES, CHECKPOINTS] {
            make_folder(&folder.join(name))?;
        }
        if let Some(text) = &job.case_text {
            let path = folder.join(CASE);
            let written = replace_file(&path, |file| file.write_all(text.as_bytes()));
            written.map_err(|error| RecordError::Path { path, error })?;
        }
        let (machine, beginning) = (Machine::this(), RunState::of(job));
        let fixed = Fixed {
            solver: case.solver.word(),
            case: case.name.clone(),
            commit: job.options.commit.unwrap_or("unknown"),
            case_hash: beginning.case_hash,
            history: beginning.history,
            cpu: machine.cpu,
            cores: machine.cores,
            workers: job.workers.clone(),
            cells: case.domain.cell_count(),
            contact_spheres_by_shape: job.shapes.iter().map(|shape| shape.contact_spheres().len()).collect(),
        };
        let probes = case.probes.iter().map(|_| None).collect();
        let series = open_table(&series, &columns(parts), resumed_at)?;
        let expected = job.resumed.as_ref().and_then(|state| state.run.last_row);
        if resumed_at.is_some() && series.last_step() < expected {
            let kept =
                series.last_step().map_or("no row of it is left".into(), |step| format!("it ends at step {step}"));
            job.say(format!(
                "warning: {SERIES} was cut or damaged: {kept}, its rows up to step {} are lost; the run goes on without \
                 them",
                expected.unwrap_or_default()
            ));
        }
        Ok(Self {
            drawing: Drawing::new(job.workers.threads),
            checkpoints: CheckpointFolder::new(folder.join(CHECKPOINTS), case.checkpoint.keep),
            fixed,
            series,
            parts,
            tables: BTreeMap::new(),
            fields: open_times(job, FIELD_SERIES, [FIELDS, "fields-"], resumed_at)?,
            grains: open_times(job, GRAIN_SERIES, [GRAINS, "grains-"], resumed_at)?,
            meshes: open_times(job, MESH_SERIES, [GRAINS, "meshes-"], resumed_at)?,
            has_glyphs: false,
            folder,
            precision: case.output.precision,
            probes,
            resumed_at,
        })
    }

    /// Step of the last row of the series.
    pub fn last_row(&self) -> Option<u64> {
        self.series.last_step()
    }

    /// Adds a row to the series.
    pub fn row(&mut self, clock: &Clock, values: &[Value]) -> Result<(), RecordError> {
        Ok(self.series.record(clock.step(), values)?)
    }

    /// Adds rows to the table `name`, which is opened by the first.
    pub fn add(
        &mut self,
        name: &'static str,
        columns: impl FnOnce() -> Vec<Column>,
        clock: &Clock,
        rows: &[Vec<Value>],
    ) -> Result<(), RecordError> {
        let table = match self.tables.entry(name) {
            Entry::Occupied(table) => table.into_mut(),
            Entry::Vacant(place) => place.insert(open_table(&self.folder.join(name), &columns(), self.resumed_at)?),
        };
        Ok(rows.iter().try_for_each(|row| table.record(clock.step(), row))?)
    }

    /// Writes the grains for ParaView in the form that the case asks for.
    pub fn grains(&mut self, job: &Job, clock: &Clock, grains: &GrainStates, own: &[Array]) -> Result<(), RecordError> {
        // Of grains that have all left, or are yet to come, there is a file without grains.
        if job.case.grains.is_empty() {
            return Ok(());
        }
        let form = job.case.output.grain_form;
        if form.has_points() {
            if !std::mem::replace(&mut self.has_glyphs, true) {
                for (n, shape) in job.shapes.iter().enumerate() {
                    write_glyph(shape, &self.folder.join(format!("{GRAINS}/shape-{n}.vtp")))?;
                }
            }
            let name = format!("{GRAINS}/grains-{:09}.vtp", clock.step());
            grains.write_points(job.case, own, clock, &self.folder.join(&name))?;
            self.grains.push(clock.time(), &name)?;
        }
        if form.has_meshes() {
            let name = format!("{GRAINS}/meshes-{:09}.vtp", clock.step());
            grains.write_meshes(job.case, own, &job.shapes, clock, &self.folder.join(&name))?;
            self.meshes.push(clock.time(), &name)?;
        }
        Ok(())
    }

    /// Writes fluid that is points with values for ParaView.
    pub fn fluid_points(&mut self, clock: &Clock, file: &PointFile) -> Result<(), RecordError> {
        let name = format!("{FIELDS}/fields-{:09}.vtp", clock.step());
        write_points(&self.folder.join(&name), file)?;
        Ok(self.fields.push(clock.time(), &name)?)
    }

    /// Writes fields on a grid for ParaView.
    pub fn image(&mut self, clock: &Clock, file: &ImageFile) -> Result<(), RecordError> {
        let name = format!("{FIELDS}/fields-{:09}.vti", clock.step());
        write_image(&self.folder.join(&name), file)?;
        Ok(self.fields.push(clock.time(), &name)?)
    }

    /// Adds rows to the table of probe `number`.
    pub fn probe(
        &mut self,
        number: usize,
        name: &str,
        columns: &[Column],
        step: u64,
        rows: impl Iterator<Item = Vec<Value>>,
        say: impl Fn(String),
    ) -> Result<(), RecordError> {
        let table = match &mut self.probes[number] {
            Some(table) => table,
            place => {
                let folder = self.folder.join(PROBES);
                make_folder(&folder)?;
                let (table, warning) = open_probe(&folder.join(format!("{name}.csv")), columns, self.resumed_at)?;
                warning.into_iter().for_each(&say);
                place.insert(table)
            }
        };
        for row in rows {
            table.record(step, &row)?;
        }
        Ok(())
    }

    /// Path of the picture `name`.
    pub fn figure(&self, name: &str) -> PathBuf {
        self.folder.join(FIGURES).join(name)
    }
}

/// Whether the table at `path` has the column `name`.
fn has_column(path: &Path, name: &str) -> bool {
    use std::io::{BufRead as _, BufReader};
    let mut header = String::new();
    let read = std::fs::File::open(path).and_then(|file| BufReader::new(file).read_line(&mut header));
    read.is_ok() && fields(&header).map(unquoted).any(|column| column.split(" [").next() == Some(name))
}

/// Opens a table anew, or where the run left it.
fn open_table(path: &Path, columns: &[Column], left: Left) -> Result<SeriesWriter, RecordError> {
    Ok(match left {
        Some((_, step)) => SeriesWriter::resume(path, columns, step)?,
        None => SeriesWriter::create(path, columns)?,
    })
}

/// Opens a time series for ParaView, of the files of a folder that begin with a prefix, anew, or where the run left it.
fn open_times(job: &Job, name: &str, [files, prefix]: [&str; 2], left: Left) -> Result<PvdSeries, RecordError> {
    let path = job.folder.join(name);
    let Some((time, _)) = left else { return Ok(PvdSeries::create(&path)) };
    let series = PvdSeries::restore(&path, files, prefix, time)?;
    if let Some(damage) = series.damage() {
        job.say(format!("warning: {damage}"));
    }
    Ok(series)
}

/// Opens the table of a probe anew, or where the run left it. One that is no longer a table of these columns is put
/// aside, so that it does not stop the run.
fn open_probe(path: &Path, columns: &[Column], left: Left) -> Result<(SeriesWriter, Option<String>), RecordError> {
    match open_table(path, columns, left) {
        Err(RecordError::Table(TableError::OtherColumns { .. })) => {
            let aside = path.with_extension("csv.damaged");
            std::fs::rename(path, &aside).map_err(|error| RecordError::Path { path: aside.clone(), error })?;
            let text = format!(
                "warning: {} is not the table of this probe: it is kept as {}, and a new one begins",
                path.display(),
                aside.display()
            );
            Ok((SeriesWriter::create(path, columns)?, Some(text)))
        }
        table => Ok((table?, None)),
    }
}

fn make_folder(path: &Path) -> Result<(), RecordError> {
    std::fs::create_dir_all(path).map_err(|error| RecordError::Path { path: path.to_owned(), error })
}
