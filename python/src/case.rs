//! Cases: posed, changed by keys, examined.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use sazanami::case::{self, Explained, LoadedCase, changed, resolved, si};
use sazanami::check;
use sazanami::error::CommandError;
use sazanami::examine::examine;
use sazanami::templates::{TEMPLATES, template};
use serde_json::Value;

use crate::errors::{findings, unknown_key, unlocked};
use crate::values::to_python;

/// A case that can be read, with the keys that were set over its text. It never changes: setting keys makes another.
#[pyclass(frozen, module = "sazanami._engine")]
#[derive(Clone)]
pub struct CaseCore {
    path: PathBuf,
    text: String,
    settings: Vec<String>,
    /// What it means.
    pub loaded: LoadedCase,
}

impl CaseCore {
    fn read(path: PathBuf, text: String, settings: Vec<String>) -> Result<Self, CommandError> {
        let loaded = case::parse(&path, &text, &settings)?;
        Ok(Self { path, text, settings, loaded })
    }

    /// A case that was read before.
    pub fn of_loaded(loaded: LoadedCase) -> Self {
        let settings = loaded.source.overrides().map(|(_, text)| text.to_owned()).collect();
        Self { path: loaded.path.clone(), text: loaded.source.text().to_owned(), settings, loaded }
    }
}

/// Overrides that set keys: paths as names, values as JSON.
pub fn settings_of(keys: &[(Vec<String>, String)]) -> Result<Vec<String>, CommandError> {
    let of = |(names, json): &(Vec<String>, String)| {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let value: Value = serde_json::from_str(json).map_err(|error| {
            CommandError::input(format!("`{}`: {error}", names.join(".")), "give a number, a text, a list or a dict")
        })?;
        if has_null(&value) {
            return Err(CommandError::input(
                format!("`{}` cannot be set to what has a None in it", names.join(".")),
                "leave out the keys that are None",
            ));
        }
        Ok(si::setting(&names, &value))
    };
    keys.iter().map(of).collect()
}

fn has_null(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(list) => list.iter().any(has_null),
        Value::Object(table) => table.values().any(has_null),
        _ => false,
    }
}

#[pymethods]
impl CaseCore {
    #[staticmethod]
    fn from_file(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        unlocked(py, || {
            let loaded = case::load(&path, &[])?;
            Ok(Self { text: loaded.source.text().to_owned(), path, settings: Vec::new(), loaded })
        })
    }

    #[staticmethod]
    fn from_text(py: Python<'_>, text: String, path: PathBuf) -> PyResult<Self> {
        unlocked(py, || Self::read(path, text, Vec::new()))
    }

    #[staticmethod]
    fn template(py: Python<'_>, name: &str) -> PyResult<Self> {
        unlocked(py, || {
            let template = template(name)?;
            Self::read(format!("{name}.toml").into(), template.text.to_owned(), Vec::new())
        })
    }

    /// What [`Self::of_parts`] makes it from again.
    fn parts(&self) -> (&str, PathBuf, Vec<String>) {
        (&self.text, self.path.clone(), self.settings.clone())
    }

    #[staticmethod]
    fn of_parts(py: Python<'_>, text: String, path: PathBuf, settings: Vec<String>) -> PyResult<Self> {
        unlocked(py, || Self::read(path, text, settings))
    }

    /// The case with keys set: paths as names, values as JSON.
    fn with_keys(&self, py: Python<'_>, keys: Vec<(Vec<String>, String)>) -> PyResult<Self> {
        unlocked(py, || {
            let mut settings = self.settings.clone();
            for ((names, _), setting) in keys.iter().zip(settings_of(&keys)?) {
                // What was set below the key goes with its old value.
                let path = si::path(names);
                let is_under = |rest: &str| rest.starts_with(['=', '.']);
                settings.retain(|earlier: &String| !earlier.strip_prefix(&path).is_some_and(is_under));
                settings.push(setting);
            }
            Self::read(self.path.clone(), self.text.clone(), settings)
        })
    }

    /// Every key with its value in SI units.
    fn values(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        to_python(py, &unlocked(py, || Ok(si::values(&self.loaded)))?)
    }

    /// What is declared of a key.
    #[staticmethod]
    fn known<'py>(py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyDict>> {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let key = si::known(&names).map_err(|unknown| unknown_key(py, &unknown))?;
        let found = PyDict::new(py);
        found.set_item("about", key.about)?;
        found.set_item("unit", key.unit)?;
        found.set_item("keys", key.keys)?;
        let holds = match key.holds {
            si::Holds::Value => "value",
            si::Holds::Table => "table",
            si::Holds::Tables => "tables",
            si::Holds::Named => "named",
        };
        found.set_item("holds", holds)?;
        Ok(found)
    }

    /// The case file that says everything, in SI units; it may lie anywhere.
    fn resolved(&self) -> String {
        resolved::write(&self.loaded.case, resolved::Paths::Absolute)
    }

    /// Keys that are required or differ from their defaults: path, value, meaning.
    fn changed(&self) -> Vec<(String, String, &'static str)> {
        changed(&self.loaded).into_iter().map(|key| (key.path, key.value, key.about)).collect()
    }

    #[getter]
    fn name(&self) -> &str {
        &self.loaded.case.name
    }

    #[getter]
    fn hash(&self) -> String {
        resolved::hash_text(&self.loaded.case)
    }

    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// What can be said of the case before it runs: the report, warnings, messages, and all of it as text.
    #[pyo3(signature = (threads, ranks))]
    fn check<'py>(
        &self,
        py: Python<'py>,
        threads: Option<usize>,
        ranks: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (examined, report, text) = unlocked(py, || {
            let examined = examine(&self.loaded, threads, ranks, option_env!("SAZANAMI_COMMIT"))?;
            let report =
                serde_json::to_value(&examined.report).map_err(|error| CommandError::Undone(error.to_string()))?;
            let text = check::explain(&self.loaded.case, &examined.report);
            Ok((examined, report, text))
        })?;
        let found = PyDict::new(py);
        found.set_item("report", to_python(py, &report)?)?;
        found.set_item("warnings", findings(py, &examined.warnings.records(&self.loaded.source))?)?;
        found.set_item("messages", examined.messages)?;
        found.set_item("text", text)?;
        Ok(found)
    }
}

/// Names of the templates, each with what happens in it.
#[pyfunction]
pub fn templates() -> Vec<(&'static str, &'static str)> {
    TEMPLATES.iter().map(|template| (template.name, template.about)).collect()
}

/// What is declared of a key, as text.
#[pyfunction]
pub fn explain(py: Python<'_>, path: &str) -> PyResult<String> {
    match case::explain(path) {
        Explained::Text(text) => Ok(text),
        Explained::Unknown { meant, .. } => Err(unknown_key(py, &si::UnknownKey { path: path.to_owned(), meant })),
    }
}
