//! Parts of the engine by themselves.

use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use sazanami::error::CommandError;
use sazanami::volume_fractions::{self as fractions, Placed, Quaternion, TetrahedralMesh, Vector};

use crate::errors::unlocked;
use crate::state::rows;

/// Nodes and tetrahedra of a mesh in a file of Gmsh.
#[pyfunction]
pub fn read_mesh(py: Python<'_>, path: PathBuf, unit: f64) -> PyResult<(Bound<'_, PyAny>, Vec<[u32; 4]>)> {
    let mesh = unlocked(py, || fractions::mesh_of_file(&path, unit))?;
    let nodes = rows(py, mesh.nodes.iter().flat_map(|node| node.to_array()).collect(), 3)?;
    Ok((nodes, mesh.tetrahedra))
}

/// The part of each cell that bodies of one mesh cover, x1 fastest. `places` has a row for each body: position, orientation
/// (w, x, y, z), scale.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "a mesh, places, a grid and a method")]
pub fn volume_fractions<'py>(
    py: Python<'py>,
    nodes: PyReadonlyArray2<'py, f64>,
    tetrahedra: PyReadonlyArray2<'py, u32>,
    places: PyReadonlyArray2<'py, f64>,
    lower: [f64; 3],
    upper: [f64; 3],
    cells: [usize; 3],
    method: &str,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let wide = [nodes.shape()[1], tetrahedra.shape()[1], places.shape()[1]];
    let nodes = nodes.as_array().rows().into_iter().map(|row| row.to_vec()).collect::<Vec<_>>();
    let tetrahedra = tetrahedra.as_array().rows().into_iter().map(|row| row.to_vec()).collect::<Vec<_>>();
    let places = places.as_array().rows().into_iter().map(|row| row.to_vec()).collect::<Vec<_>>();
    let found = unlocked(py, || {
        if wide != [3, 4, 8] {
            return Err(CommandError::input(
                format!("rows of {wide:?} numbers, not of [3, 4, 8]"),
                "nodes have three coordinates, tetrahedra four nodes",
            ));
        }
        let mesh = TetrahedralMesh {
            nodes: nodes.iter().map(|node| Vector::from_slice(node)).collect(),
            tetrahedra: tetrahedra.iter().map(|t| std::array::from_fn(|corner| t[corner])).collect(),
        };
        let placed: Vec<Placed> = places
            .iter()
            .map(|row| Placed {
                position: Vector::from_slice(row),
                orientation: Quaternion::from_xyzw(row[4], row[5], row[6], row[3]),
                scale: row[7],
            })
            .collect();
        let grid = fractions::grid_of(cells, lower.into(), upper.into())?;
        fractions::volume_fractions(mesh, &placed, &grid, fractions::method_of(method)?)
    })?;
    Ok(PyArray1::from_vec(py, found))
}
