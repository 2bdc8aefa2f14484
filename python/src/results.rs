//! Results of runs that have ended, and beds.

use std::path::PathBuf;

use numpy::PyArray1;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use sazanami::analyse::{self, Cells, Table};
use sazanami::bed_file::Bed;
use sazanami::error::CommandError;
use sazanami::finished::Finished;
use sazanami::progress::Progress;
use sazanami::progress::StepLine;
use sazanami::saved::{self, SavedTime};
use sazanami_picture::Painter;

use crate::case::CaseCore;
use crate::errors::unlocked;
use crate::state::{self, rows};
use crate::values::to_python;

/// A folder of results, read and checked.
#[pyclass(frozen, module = "sazanami._engine")]
pub struct ResultsCore {
    run: Finished,
    times: Vec<SavedTime>,
}

#[pymethods]
impl ResultsCore {
    #[staticmethod]
    fn open(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        unlocked(py, || {
            let run = Finished::open(&folder)?;
            Ok(Self { times: saved::times(&run.folder)?, run })
        })
    }

    fn summary(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        to_python(py, &self.run.summary)
    }

    fn case(&self) -> CaseCore {
        CaseCore::of_loaded(self.run.case.clone())
    }

    fn series<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        columns(py, &self.run.series)
    }

    fn table<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyList>>> {
        unlocked(py, || self.run.table(name))?.map(|table| columns(py, &table)).transpose()
    }

    /// Labels and values for people.
    fn findings(&self, py: Python<'_>) -> PyResult<Vec<(String, String)>> {
        unlocked(py, || analyse::findings(&self.run.folder, &self.run.summary))
    }

    /// Times at which grains or water were written [s].
    fn times(&self) -> Vec<f64> {
        self.times.iter().map(|saved| saved.time).collect()
    }

    fn state<'py>(&self, py: Python<'py>, number: usize) -> PyResult<Bound<'py, PyDict>> {
        let found = unlocked(py, || {
            let saved = self.times.get(number).ok_or_else(|| {
                CommandError::input(format!("there is no state {number}"), format!("there are {}", self.times.len()))
            })?;
            saved::state(saved)
        })?;
        state::to_python(py, found)
    }
}

/// Columns of a table: name, unit, and an array of numbers or a list of words.
fn columns<'py>(py: Python<'py>, table: &Table) -> PyResult<Bound<'py, PyList>> {
    let column = |(name, unit): (&str, &str)| {
        let values = match table.cells_of(name) {
            Cells::Numbers(values) => PyArray1::from_vec(py, values).into_py_any(py)?,
            Cells::Words(words) => PyList::new(py, words)?.into_py_any(py)?,
        };
        (name, unit, values).into_py_any(py)
    };
    let found = table.headings().map(column).collect::<PyResult<Vec<_>>>()?;
    PyList::new(py, found)
}

/// Keeps what is said.
#[derive(Default)]
struct Said(Vec<String>);

impl Progress for Said {
    fn step(&mut self, _: &StepLine) {}

    fn message(&mut self, text: &str) {
        self.0.push(text.to_owned());
    }
}

/// Evaluates one run again, or compares several: lines for people, and messages.
#[pyfunction]
pub fn analyse_folders(
    py: Python<'_>,
    folders: Vec<PathBuf>,
    settings: Vec<(Vec<String>, String)>,
    out: Option<PathBuf>,
    pictures: bool,
) -> PyResult<(Vec<String>, Vec<String>)> {
    unlocked(py, || {
        let mut said = Said::default();
        let settings = crate::case::settings_of(&settings)?;
        let artist: Option<&dyn sazanami::artist::Artist> = if pictures { Some(&Painter) } else { None };
        let lines = analyse::analyse(&folders, &settings, out.as_deref(), artist, &mut said)?;
        Ok((lines, said.0))
    })
}

/// A bed at rest in a file.
#[pyfunction]
pub fn bed(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let (bed, recipe) = unlocked(py, || {
        let bed = Bed::read(&path)
            .map_err(|error| CommandError::input(error.to_string(), "give the file of a bed that `sazanami` packed"))?;
        let recipe = serde_json::to_value(&bed.recipe).map_err(|error| CommandError::Undone(error.to_string()))?;
        Ok((bed, recipe))
    })?;
    let found = PyDict::new(py);
    found.set_item("lower", bed.lower.to_array())?;
    found.set_item("upper", bed.upper.to_array())?;
    found.set_item("recipe", to_python(py, &recipe)?)?;
    let grains = &bed.grains;
    found.set_item("position", rows(py, grains.iter().flat_map(|grain| grain.position.to_array()).collect(), 3)?)?;
    let w_first = |[x, y, z, w]: [f64; 4]| [w, x, y, z];
    let turns = grains.iter().flat_map(|grain| w_first(grain.orientation.to_array())).collect();
    found.set_item("orientation", rows(py, turns, 4)?)?;
    found.set_item("scale", PyArray1::from_vec(py, grains.iter().map(|grain| grain.scale).collect()))?;
    found.set_item("population", PyArray1::from_vec(py, grains.iter().map(|grain| grain.shape).collect()))?;
    Ok(found)
}
