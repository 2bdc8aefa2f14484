//! VTK files hold what was given, found again by a reader that follows the format and not the writer.

use sazanami_io::vtk::{
    BodyFile, DataArray, ImageFile, PointFile, Values, VtkError, VtkFile, write_bodies, write_image, write_points,
};
use sazanami_io::{Bodies, BodyPose, BodySurface};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Vector};
use sazanami_test_support::vtk::parse;

fn numbers<T: bytemuck::Pod>(bytes: &[u8]) -> Vec<T> {
    bytemuck::pod_collect_to_vec(bytes)
}

#[test]
fn fields_are_found_at_their_offsets() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fields.vti");
    let grid = Grid::new([52, 47, 41], Vector::new(0.0, -1.0, 0.5), Vector::new(5.2, 3.7, 4.6));
    let fraction: Vec<f64> = (0..grid.len()).map(|i| (i as f64 * 0.01).sin()).collect();
    let zero = vec![0.0; grid.len()];
    let flags: Vec<u8> = (0..grid.len()).map(|i| (i % 3) as u8).collect();
    let cells = [
        DataArray::rounded("liquid fraction", 1, fraction.iter().copied()),
        DataArray::rounded_vectors("velocity", [&fraction, &zero, &fraction]),
        DataArray::new("flags", 1, &flags),
        DataArray::new("pressure", 1, &fraction),
    ];
    let image = ImageFile {
        grid: &grid,
        time: Some(0.02),
        cells: &cells,
        scalars: Some("liquid fraction"),
        frame: Some("tank"),
    };
    write_image(&path, &image).unwrap();
    let parsed = parse(&path);
    assert_eq!(parsed.attribute("VTKFile", "header_type"), "UInt64");
    assert_eq!(parsed.attribute("VTKFile", "compressor"), "vtkLZ4DataCompressor");
    assert_eq!(parsed.attribute("ImageData", "WholeExtent"), "0 52 0 47 0 41");
    assert_eq!(parsed.attribute("ImageData", "Origin"), "0 -1 0.5");
    assert_eq!(parsed.attribute("CellData", "Scalars"), "liquid fraction");
    let single: Vec<f32> = fraction.iter().map(|&v| v as f32).collect();
    let (kind, components, bytes, _) = parsed.array("liquid fraction");
    assert_eq!((kind, components, numbers::<f32>(&bytes)), ("Float32", 1, single.clone()));
    let (_, components, bytes, _) = parsed.array("velocity");
    let velocity = numbers::<f32>(&bytes);
    assert_eq!((components, velocity.len()), (3, 3 * grid.len()));
    assert!(velocity.chunks(3).zip(&single).all(|(v, &s)| v == [s, 0.0, s]));
    assert_eq!(parsed.array("flags").2, flags);
    let (kind, _, bytes, end) = parsed.array("pressure");
    assert_eq!((kind, numbers::<f64>(&bytes)), ("Float64", fraction));
    assert_eq!(end, parsed.data.len(), "the last array ends with the data");
    assert_eq!(numbers::<f64>(&parsed.array("TimeValue").2), [0.02]);
}

#[test]
fn an_array_that_does_not_fit_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fields.vti");
    let grid = Grid::new([2, 2, 2], Vector::ZERO, Vector::ONE);
    let cells = [DataArray::rounded("p", 1, [0.0; 7])];
    let error = write_image(&path, &ImageFile { grid: &grid, time: None, cells: &cells, scalars: None, frame: None })
        .unwrap_err();
    assert!(matches!(error, VtkError::WrongLength { expected: 8, found: 7, .. }), "{error}");
    let cells = [DataArray::rounded("p", 1, [0.0; 8])];
    let image = ImageFile { grid: &grid, time: None, cells: &cells, scalars: Some("q"), frame: None };
    assert!(matches!(write_image(&path, &image), Err(VtkError::NoSuchArray { .. })));
    assert!(!path.exists());
}

#[test]
fn bodies_stand_posed_with_the_values_of_their_body() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grains.vtp");
    let corners = [Vector::ZERO, Vector::X, Vector::Y, Vector::Z];
    let tetrahedron = BodySurface { nodes: &corners, triangles: &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] };
    let pyramid_corners = [Vector::X, Vector::Y, -Vector::X, -Vector::Y, Vector::Z];
    let pyramid_triangles = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 2, 1], [0, 3, 2]];
    let pyramid = BodySurface { nodes: &pyramid_corners, triangles: &pyramid_triangles };
    let quarter = Quaternion::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let poses = [
        BodyPose { surface: 1, scale: 1.0, position: Vector::ZERO, orientation: Quaternion::IDENTITY },
        BodyPose { surface: 0, scale: 1.0, position: Vector::new(10.0, 0.0, 0.0), orientation: quarter },
    ];
    let arrays = [
        DataArray::rounded("speed", 1, [0.25, 2.0]),
        DataArray::rounded("velocity", 3, [0.0, 0.25, 0.0, 2.0, 0.0, 0.0]),
        DataArray::new("id", 1, &[7_u64, 9]),
    ];
    let bodies = Bodies { surfaces: &[tetrahedron, pyramid], poses: &poses };
    let (scalars, frame) = (Some("speed"), Some("laboratory"));
    write_bodies(&path, &BodyFile { bodies, time: Some(0.0), arrays: &arrays, scalars, frame }).unwrap();
    let parsed = parse(&path);
    assert_eq!(parsed.attribute("PointData", "Scalars"), "speed");
    assert_eq!(parsed.attribute("PointData", "Vectors"), "velocity");
    assert_eq!(parsed.attribute("Piece", "NumberOfPoints"), "9");
    assert_eq!(parsed.attribute("Piece", "NumberOfPolys"), "10");
    let points = numbers::<f32>(&parsed.array("Points").2);
    let second: Vec<f32> = points[15..].iter().map(|v| v.round()).collect();
    assert_eq!(second, [10., 0., 0., 10., 1., 0., 9., 0., 0., 10., 0., 1.]);
    let connectivity = numbers::<i32>(&parsed.array("connectivity").2);
    assert_eq!(connectivity[..6], [0, 1, 4, 1, 2, 4]);
    assert_eq!(connectivity[18..], [5, 7, 6, 5, 6, 8, 5, 8, 7, 6, 7, 8]);
    assert_eq!(numbers::<i32>(&parsed.array("offsets").2), (1..=10).map(|n| 3 * n).collect::<Vec<_>>());
    assert_eq!(numbers::<f32>(&parsed.array("speed").2), [0.25, 0.25, 0.25, 0.25, 0.25, 2., 2., 2., 2.]);
    assert_eq!(numbers::<u64>(&parsed.array("id").2), [7, 7, 7, 7, 7, 9, 9, 9, 9]);
}

#[test]
fn a_run_without_bodies_still_gives_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grains.vtp");
    let arrays = [DataArray::rounded("speed", 1, [])];
    let file =
        BodyFile { bodies: Bodies::none(), time: Some(1.0), arrays: &arrays, scalars: Some("speed"), frame: None };
    write_bodies(&path, &file).unwrap();
    assert!(numbers::<f32>(&parse(&path).array("Points").2).is_empty());
}

#[test]
fn points_far_from_the_origin_keep_their_distances() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.vtp");
    let written = |origin: Vector| {
        let places = [origin, origin + Vector::new(3e-3, 1e-3, 2e-3)];
        write_points(
            &path,
            &PointFile { places: &places, double: false, time: None, arrays: &[], scalars: None, frame: None },
        )
        .unwrap();
        let file = VtkFile::read(&path).unwrap();
        let found = file.doubles("Points").unwrap();
        let single = matches!(file.values("Points").unwrap().1, Values::F32(_));
        ((found[3] - found[0]) / 3e-3, (found[5] - found[2]) / 2e-3, single)
    };
    // Metres of a map grid; four bytes would put both on one place.
    let (along, up, single) = written(Vector::new(500_000.0, 4_500_000.0, 100.0));
    assert!((along - 1.0).abs() < 1e-6 && (up - 1.0).abs() < 1e-6 && !single, "{along} {up}");
    let (along, up, single) = written(Vector::ZERO);
    assert!(
        (along - 1.0).abs() < 1e-6 && (up - 1.0).abs() < 1e-6 && single,
        "negative control: near places take four bytes"
    );
}
