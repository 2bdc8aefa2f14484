//! States as arrays of NumPy, which take over the memory of the library: nothing is copied.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sazanami::state::{Array, State, Values, WaterState};

/// A state as a dictionary.
pub fn to_python(py: Python<'_>, state: State) -> PyResult<Bound<'_, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("time", state.time)?;
    found.set_item("step", state.step)?;
    found.set_item("grains", bodies(py, state.grains)?)?;
    match state.water {
        None => found.set_item("water", py.None())?,
        Some(WaterState::Particles { arrays }) => {
            let water = PyDict::new(py);
            water.set_item("arrays", bodies(py, arrays)?)?;
            found.set_item("water", water)?;
        }
        Some(WaterState::Grid { grid, arrays }) => {
            let water = PyDict::new(py);
            water.set_item("lower", grid.lower.to_array())?;
            water.set_item("spacing", grid.spacing.to_array())?;
            water.set_item("cells", grid.cells)?;
            let fields = PyDict::new(py);
            let [n1, n2, n3] = grid.cells;
            for Array { name, components, values } in arrays {
                // x1 is fastest in memory, and the first index in Python.
                let flat = array(py, values)?;
                let field = if components == 1 {
                    flat.call_method1("reshape", ((n3, n2, n1),))?.call_method1("transpose", (2, 1, 0))?
                } else {
                    flat.call_method1("reshape", ((n3, n2, n1, components),))?
                        .call_method1("transpose", (2, 1, 0, 3))?
                };
                fields.set_item(name, field)?;
            }
            water.set_item("arrays", fields)?;
            found.set_item("water", water)?;
        }
    }
    Ok(found)
}

/// Arrays of grains or particles: a row for each where they are vectors.
pub fn bodies(py: Python<'_>, arrays: Vec<Array>) -> PyResult<Bound<'_, PyDict>> {
    let found = PyDict::new(py);
    for Array { name, components, values } in arrays {
        let count = values.len() / components.max(1);
        let flat = array(py, values)?;
        let rows = if components == 1 { flat } else { flat.call_method1("reshape", ((count, components),))? };
        found.set_item(name, rows)?;
    }
    Ok(found)
}

fn array(py: Python<'_>, values: Values) -> PyResult<Bound<'_, PyAny>> {
    Ok(match values {
        Values::F64(values) => PyArray1::from_vec(py, values).into_any(),
        Values::F32(values) => PyArray1::from_vec(py, values).into_any(),
        Values::U64(values) => PyArray1::from_vec(py, values).into_any(),
        Values::U32(values) => PyArray1::from_vec(py, values).into_any(),
        Values::I32(values) => PyArray1::from_vec(py, values).into_any(),
    })
}

/// Real numbers as rows of so many.
pub fn rows(py: Python<'_>, values: Vec<f64>, components: usize) -> PyResult<Bound<'_, PyAny>> {
    let count = values.len() / components;
    Ok(PyArray1::from_vec(py, values).reshape([count, components])?.into_any())
}
