//! Errors of the library as exceptions of the package, defined in `sazanami/_errors.py`.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use sazanami::case::si::UnknownKey;
use sazanami::case::{DiagnosticRecord, Severity};
use sazanami::error::{CommandError, Failure};

/// Does `work` with the interpreter lock released; its error, or a panic in it, is raised.
pub fn unlocked<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T, CommandError> + Send) -> PyResult<T> {
    let outcome = py.detach(|| catch_unwind(AssertUnwindSafe(work)));
    match outcome {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(raised(py, &error)),
        Err(panic) => Err(broken(py, &words(panic.as_ref()))),
    }
}

/// What a panic said.
pub fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("it said nothing").to_owned()
}

/// The exception for an error.
pub fn raised(py: Python<'_>, error: &CommandError) -> PyErr {
    match error {
        CommandError::Case(error) => {
            let found = findings(py, &error.diagnostics.records(&error.source));
            exception(py, "CaseError", |_| (error.to_string(), found?).into_pyobject(py))
        }
        CommandError::Input { message, help } => exception(py, "InputError", |_| (message, help).into_pyobject(py)),
        CommandError::Failed(failure) => failed(py, failure),
        CommandError::Undone(message) => exception(py, "UndoneError", |_| (message,).into_pyobject(py)),
    }
}

fn failed(py: Python<'_>, failure: &Failure) -> PyErr {
    exception(py, "RunFailed", |keywords| {
        keywords.set_item("kind", &failure.kind)?;
        keywords.set_item("message", &failure.message)?;
        keywords.set_item("step", failure.step)?;
        keywords.set_item("time", failure.time)?;
        keywords.set_item("limiter", &failure.limiter)?;
        keywords.set_item("rank", failure.rank)?;
        keywords.set_item("checkpoint", failure.checkpoint.as_ref())?;
        (failure.to_string(),).into_pyobject(py)
    })
}

/// The exception for a key that there is not.
pub fn unknown_key(py: Python<'_>, unknown: &UnknownKey) -> PyErr {
    exception(py, "UnknownKeyError", |_| (&unknown.path, &unknown.meant).into_pyobject(py))
}

/// The exception for a fault of the program.
pub fn broken(py: Python<'_>, cause: &str) -> PyErr {
    exception(py, "InternalError", |_| (cause,).into_pyobject(py))
}

/// An exception of the package by its name; `arguments` may add some by keyword.
fn exception<'py>(
    py: Python<'py>,
    name: &str,
    arguments: impl FnOnce(&Bound<'py, PyDict>) -> PyResult<Bound<'py, PyTuple>>,
) -> PyErr {
    let made = || {
        let keywords = PyDict::new(py);
        let arguments = arguments(&keywords)?;
        py.import("sazanami._errors")?.getattr(name)?.call(arguments, Some(&keywords))
    };
    made().map_or_else(|error| error, PyErr::from_value)
}

/// Findings as dictionaries.
pub fn findings(py: Python<'_>, records: &[DiagnosticRecord]) -> PyResult<Vec<Py<PyAny>>> {
    let of = |record: &DiagnosticRecord| {
        let found = PyDict::new(py);
        let severity = if record.severity == Severity::Error { "error" } else { "warning" };
        found.set_item("severity", severity)?;
        found.set_item("message", &record.message)?;
        found.set_item("file", &record.file)?;
        found.set_item("line", record.line)?;
        found.set_item("column", record.column)?;
        found.set_item("expected", &record.expected)?;
        found.set_item("suggestion", &record.suggestion)?;
        found.into_py_any(py)
    };
    records.iter().map(of).collect()
}
