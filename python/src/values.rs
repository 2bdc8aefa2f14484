//! Values between JSON and Python, and quantities as text.

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use sazanami::case::units::parse_quantity;
use sazanami::error::CommandError;
use serde_json::Value;

use crate::errors::raised;

/// A JSON value as what Python has for it.
pub fn to_python(py: Python<'_>, value: &Value) -> PyResult<Py<PyAny>> {
    match value {
        Value::Null => Ok(py.None()),
        Value::Bool(flag) => flag.into_py_any(py),
        Value::Number(number) => match (number.as_i64(), number.as_u64()) {
            (Some(whole), _) => whole.into_py_any(py),
            (None, Some(whole)) => whole.into_py_any(py),
            _ => number.as_f64().into_py_any(py),
        },
        Value::String(text) => text.into_py_any(py),
        Value::Array(list) => {
            let elements = list.iter().map(|element| to_python(py, element)).collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, elements)?.into_py_any(py)
        }
        Value::Object(table) => {
            let found = PyDict::new(py);
            for (name, inner) in table {
                found.set_item(name, to_python(py, inner)?)?;
            }
            found.into_py_any(py)
        }
    }
}

/// The SI value of a text such as `20 ms`, which has to have the dimension of `unit`.
#[pyfunction]
pub fn quantity(py: Python<'_>, text: &str, unit: &str) -> PyResult<f64> {
    let wanted = parse_quantity(&format!("1 {unit}")).map(|(_, dimension)| dimension);
    let outcome = match (parse_quantity(text), wanted) {
        (Ok((value, dimension)), Ok(wanted)) if dimension == wanted => Ok(value),
        (Ok((_, dimension)), Ok(wanted)) => Err(CommandError::input(
            format!("`{text}` has {dimension}, not {wanted}"),
            format!("write a number with a unit, or a number alone in {unit}"),
        )),
        (Err(error), _) | (_, Err(error)) => Err(CommandError::input(
            format!("`{text}` cannot be read: {}", error.message),
            error.suggestion.unwrap_or_else(|| format!("write a number with a unit, or a number alone in {unit}")),
        )),
    };
    outcome.map_err(|error| raised(py, &error))
}
