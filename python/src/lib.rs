//! The extension `sazanami._engine`: hands the library to Python. What people use is the package `sazanami` around it.
//!
//! Nothing is computed here. Work runs with the interpreter lock released, and a panic becomes an exception.

mod case;
mod errors;
mod functions;
mod results;
mod run;
mod state;
mod values;

use pyo3::prelude::*;

#[pymodule]
fn _engine(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<case::CaseCore>()?;
    module.add_function(wrap_pyfunction!(case::templates, module)?)?;
    module.add_function(wrap_pyfunction!(case::explain, module)?)?;
    module.add_function(wrap_pyfunction!(values::quantity, module)?)?;
    module.add_class::<run::RunCore>()?;
    module.add_class::<results::ResultsCore>()?;
    module.add_function(wrap_pyfunction!(results::analyse_folders, module)?)?;
    module.add_function(wrap_pyfunction!(results::bed, module)?)?;
    module.add_function(wrap_pyfunction!(functions::read_mesh, module)?)?;
    module.add_function(wrap_pyfunction!(functions::volume_fractions, module)?)?;
    Ok(())
}
